"""The import rules: rft knows nothing of geomech; of rft the pure geometry knows planar motions alone."""

import ast
import functools
import graphlib
import pathlib
import re
import tomllib

import mutants
import pytest

from geomech.shell import describe

ROOT = pathlib.Path(__file__).parents[2]
# Beside the systems: commands list the named media and ask a stress map, an intruder scene has a law, a body and effects but no
# system, a sweep puts effects side by side, a calibration fits a law, a class of one's own is told to be an effect, and the
# top shows media, bodies and effects to type checkers. A robot that walks has a map and no system, either; a map
# of stress is written by its coefficients. Workers tell the
# solver to take one thread, and by which back end. Environments for learning stand on sand, and
# measured midlines are put into a medium.
KNOW_MECHANICS = {
    "__init__.py",
    "gym/hexapod.py",
    "run/backend.py",
    "scenes/terradynamics/intruder.py",
    "scenes/terradynamics/intruding.py",
    "scenes/terradynamics/solid.py",
    "scenes/terradynamics/stress.py",
    "scenes/terradynamics/walker.py",
    "scenes/write.py",
    "shell/describe/builtin.py",
    "shell/describe/grains.py",
    "shell/describe/system.py",
    "studies/displacement/batch.py",
    "studies/grains/drag.py",
    "studies/grains/swim.py",
    "studies/measured/midlines/predicted.py",
    "studies/terradynamics/calibration.py",
    "studies/terradynamics/stress.py",
    "studies/terradynamics/stress_calibration.py",
    "studies/terradynamics/walking.py",
}


@functools.cache
def nodes(path):
    """All nodes of the tree of a file."""
    return [*ast.walk(ast.parse(path.read_text()))]


@functools.cache
def imports(path):
    """Dotted names of all that a file imports, wherever in it."""
    found = []
    for node in nodes(path):
        if isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            found += [f"{node.module}.{alias.name}" for alias in node.names]
    return found


def test_rft_does_not_import_geomech():
    files = list((ROOT / "rft").rglob("*.py"))
    assert len(files) > 8
    assert [
        p.name
        for p in files
        if {"geomech", "figures"} & {x.partition(".")[0] for x in imports(p)}
    ] == []


ABSTRACT = ("rft.core", "rft.formulas.se2")


def test_pure_geometry_knows_planar_motions_alone():
    folder = ROOT / "geomech"
    users = {
        p.relative_to(folder).as_posix()
        for p in folder.rglob("*.py")
        if any(
            x.partition(".")[0] == "rft" and not x.startswith(ABSTRACT)
            for x in imports(p)
        )
    }
    assert {
        x for x in users if not x.startswith("mathematics/systems/")
    } == KNOW_MECHANICS


def modules():
    """Files of all modules by their dotted names."""
    names = lambda p: ".".join(p.relative_to(ROOT).with_suffix("").parts).removesuffix(
        ".__init__"
    )
    return {
        names(p): p
        for top in ("rft", "geomech", "figures")
        for p in (ROOT / top).rglob("*.py")
    }


def arrows(path, known):
    """Modules that a file imports, inside functions too, but for type checkers alone."""

    checked = (
        node
        for node in nodes(path)
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
    )
    unloaded, found = {id(node) for one in checked for node in ast.walk(one)}, set()
    for node in nodes(path):
        names = (
            [alias.name for alias in node.names]
            if isinstance(node, ast.Import | ast.ImportFrom)
            else []
        )
        if isinstance(node, ast.ImportFrom):
            names = [f"{node.module}.{name}" for name in names]
        elif isinstance(node, ast.Call) and "import_module" in (
            getattr(node.func, "id", ""),
            getattr(node.func, "attr", ""),
        ):
            names = [x.value for x in node.args if isinstance(x, ast.Constant)]
        if names and id(node) not in unloaded:
            found |= {
                next((m for m in (name, name.rpartition(".")[0]) if m in known), None)
                for name in names
            }
    return found - {None}


FILES = modules()


@pytest.fixture(scope="module")
def imported():
    """Modules that each one imports."""
    return {name: arrows(path, FILES) - {name} for name, path in FILES.items()}


def test_imports_make_no_circle(imported):
    """Counting what is imported by name; that a package loads before its modules is Python's affair."""
    assert sum(map(len, imported.values())) > 800
    graphlib.TopologicalSorter(imported).prepare()


LAYERS = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["layers"]["order"]


def layer(module):
    """The row of the longest name that a module's begins with."""
    held = lambda prefix: f"{module}.".startswith(f"{prefix}.")
    return max(
        (len(prefix), k)
        for k, row in enumerate(LAYERS)
        for prefix in row
        if held(prefix)
    )[1]


def test_modules_import_from_their_own_layer_or_a_lower_one(imported):
    upward = [
        f"{a} imports {b}"
        for a, some in imported.items()
        for b in some
        if layer(b) > layer(a)
    ]
    assert upward == []
    folders = {
        name
        for name in FILES
        if name.count(".") == 1 and FILES[name].name == "__init__.py"
    }
    assert {name for name in folders if layer(name) == len(LAYERS) - 1} == {
        "geomech.shell",
        "figures.accuracy",
        "figures.grains",
        "figures.paper",
        "figures.robots",
        "figures.swimmers",
        "figures.terradynamics",
    }


def test_a_scene_is_a_small_class():
    tree = ast.parse((ROOT / "geomech" / "scenes" / "model.py").read_text())
    (scene,) = (
        node
        for node in tree.body
        if isinstance(node, ast.ClassDef) and node.name == "Scene"
    )
    statements = [node for node in ast.walk(scene) if isinstance(node, ast.stmt)]
    assert len(statements) < 60


def test_what_is_said_of_mutants_is_of_files_that_exist():
    files = [
        p.relative_to(ROOT).as_posix()
        for top in ("rft", "geomech")
        for p in (ROOT / top).rglob("*.py")
    ]
    assert [
        key
        for key in mutants.TABLE["unwatched"]
        if not any(f.startswith(key) for f in files)
    ] == []
    assert {
        *mutants.TABLE["tests"],
        *(x["file"] for x in mutants.TABLE["equivalent"]),
    } <= {*files}
    named = {
        x
        for names in (mutants.TABLE["sources"], *mutants.TABLE["tests"].values())
        for x in names
    }
    files = {p.stem.removeprefix("test_") for p in (ROOT / "tests").rglob("test_*.py")}
    assert named <= files


def test_mutants_are_programs_that_differ():
    made = mutants.mutants_of(ROOT / "rft" / "formulas" / "se2.py")
    assert len(made) > 100
    for m in made:
        assert ast.dump(ast.parse(m.mutated)) != ast.dump(ast.parse(m.source))
        assert m.change().startswith("- ")


def test_a_command_that_describes_is_the_function_of_its_file():
    files = {p.stem for p in (ROOT / "geomech" / "shell" / "describe").glob("*.py")}
    shared = {"__init__", "builtin", "grains", "scene", "system"}
    assert files == {*describe.SUMMARIES, *shared}


SPEAK_OF_OPTIONS = (
    "questions/shared/base.py",
    "questions/shared/loading.py",
    "questions/shared/texts.py",
    "shell/",
)  # of geomech: parts of commands alone


def test_what_python_reaches_names_arguments_and_no_options():
    """A refusal marks an argument, which a command spells as its option (`geomech.shell.terminal`)."""
    texts = []
    for path in sorted(p for x in ("rft", "geomech") for p in (ROOT / x).rglob("*.py")):
        if (
            not path.relative_to(ROOT)
            .as_posix()
            .removeprefix("geomech/")
            .startswith(SPEAK_OF_OPTIONS)
        ):
            prose = {
                id(node.value) for node in nodes(path) if isinstance(node, ast.Expr)
            }
            found = (
                n
                for n in nodes(path)
                if isinstance(n, ast.Constant) and isinstance(n.value, str)
            )
            texts += [
                n.value
                for n in found
                if id(n) not in prose and re.search(r"(?<!\w)--[a-z]", n.value)
            ]
    assert [x for x in texts if "geomech scenes --show" not in x] == []
