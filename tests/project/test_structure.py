"""The import rules: rft knows nothing of geomech; of rft the pure geometry knows planar
motions alone."""

import ast
import graphlib
import pathlib
import re
import tomllib

import pytest

ROOT = pathlib.Path(__file__).parents[2]


# Of rft the mathematics of a connection knows errors and planar motions alone.
ABSTRACT = ("rft.core", "rft.formulas.se2")
PURE = (
    "geomech.mathematics.gaits",
    "geomech.mathematics.geometry",
    "geomech.mathematics.tiers",
)


def test_the_mathematics_of_gaits_knows_planar_motions_alone(imported):
    for name, others in imported.items():
        if name.startswith(PURE):
            mechanics = {x for x in others if x.startswith("rft")}
            assert mechanics == {x for x in mechanics if x.startswith(ABSTRACT)}, name


def modules():
    """Return the files of all modules by their dotted names."""
    found = {}
    for top in ("rft", "geomech", "figures"):
        for path in (ROOT / top).rglob("*.py"):
            name = ".".join(path.relative_to(ROOT).with_suffix("").parts)
            found[name.removesuffix(".__init__")] = path
    return found


def statements(node):
    """Yield the statements below a node, inside functions too, but not those that type
    checkers alone load."""
    for inner in ast.iter_child_nodes(node):
        if isinstance(inner, ast.If) and "TYPE_CHECKING" in ast.dump(inner.test):
            continue
        if isinstance(inner, (ast.stmt, ast.excepthandler, ast.match_case)):
            yield inner
            yield from statements(inner)


def arrows(path, known):
    """Return the modules that a file imports."""
    text = path.read_text()
    found = {*re.findall(r'import_module\("([\w.]+)"', text)}
    for node in statements(ast.parse(text)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        if isinstance(node, ast.ImportFrom):
            names = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= {x if x in known else node.module for x in names}
    return found & {*known}


FILES = modules()


@pytest.fixture(scope="module")
def imported():
    """Modules that each one imports."""
    return {name: arrows(path, FILES) - {name} for name, path in FILES.items()}


def test_imports_make_no_circle(imported):
    """Counting what is imported by name; that a package loads before its modules is
    Python's affair."""
    assert sum(map(len, imported.values())) > 800
    graphlib.TopologicalSorter(imported).prepare()


LAYERS = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["layers"]["order"]


def layer(module):
    """Return the row of the longest name with which a module's begins."""
    lengths = []
    for k, row in enumerate(LAYERS):
        for prefix in row:
            if f"{module}.".startswith(f"{prefix}."):
                lengths.append((len(prefix), k))
    return max(lengths)[1]


def test_modules_import_from_their_own_layer_or_a_lower_one(imported):
    for name, others in imported.items():
        upward = {other for other in others if layer(other) > layer(name)}
        assert not upward, name


SPEAK_OF_OPTIONS = (
    "geomech.questions.shared.base",
    "geomech.questions.shared.loading",
    "geomech.questions.shared.texts",
    "geomech.shell",
)  # parts of commands alone
OPTION = re.compile(r"(?<!\w)--[a-z]")


def test_what_python_reaches_names_arguments_and_no_options():
    """A refusal marks an argument, which a command spells as its option
    (`geomech.shell.terminal`)."""
    for name, path in FILES.items():
        text = path.read_text().replace("geomech scenes --show", "")
        if name.startswith(("figures", *SPEAK_OF_OPTIONS)) or not OPTION.search(text):
            continue
        nodes = [*ast.walk(ast.parse(text))]
        prose = {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
        for node in nodes:
            if isinstance(node, ast.Constant) and id(node) not in prose:
                assert not OPTION.search(str(node.value)), (name, node.value)
