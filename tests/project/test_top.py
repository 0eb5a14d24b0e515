"""What is reached from `geomech` itself, and what it costs to start."""

import ast
import importlib.metadata
import io
import os
import pathlib
import pydoc
import re
import rlcompleter
import subprocess
import sys
import tomllib

import pytest
from commands import geomech as run

import geomech
import rft
from geomech.questions.shared import names
from geomech.scenes.format.keys import sections

ROOT = pathlib.Path(__file__).parents[2]


def python(code, **env):
    ran = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        cwd=ROOT,
        env={**os.environ, **env},
        timeout=60,
    )
    assert (ran.returncode, ran.stderr) == (0, "")
    return ran.stdout


def test_parts_are_reached_from_the_top():
    from geomech.scenes import Numerics, Scene, load, toml

    assert (geomech.load, geomech.toml, geomech.Scene, geomech.Numerics) == (
        load,
        toml,
        Scene,
        Numerics,
    )
    assert geomech.mathematics.gaits.Circle in geomech.mathematics.gaits.KINDS.values()
    assert geomech.media is rft.laws
    assert set(geomech.mathematics.tiers.TIERS) == {
        "area",
        "adapted",
        "path",
        "harmonic",
        "direct",
    }
    study = geomech.Study(geomech.load("three-link-viscous").with_numerics(grid=7))
    assert study.tables.poses("path").shape == (3,)
    axes = geomech.plots.figure(3, 3)[1]
    geomech.plots.displacement(study.displacement([0.5], ["path"]), ax=axes[0, 0])
    with pytest.raises(
        AttributeError, match="module 'geomech' has no attribute 'lode'"
    ):
        geomech.lode  # noqa: B018


def test_they_are_listed_found_by_tab_and_told_on_one_screen():
    names = {name for name in dir(geomech) if not name.startswith("_")}
    assert {
        "load",
        "Scene",
        "Study",
        "gaits",
        "media",
        "tiers",
        "plots",
        "register",
    } <= names
    assert all(getattr(geomech, name) for name in names)
    offered = rlcompleter.Completer({"geomech": geomech})
    assert {
        offered.complete("geomech.", k).rstrip("()") for k in range(len(names))
    } == {f"geomech.{x}" for x in names}
    told = pydoc.render_doc(geomech, renderer=pydoc.plaintext)
    assert told.count("\n") <= 75  # lines
    assert max(map(len, told.splitlines())) <= 110
    assert all(re.search(rf"\b{name}\b", geomech.__doc__) for name in names)


def test_checkers_are_shown_the_same_names_as_are_found():
    tree = ast.parse((ROOT / "geomech" / "__init__.py").read_text())
    (shown,) = (node for node in tree.body if isinstance(node, ast.If))
    exec(ast.unparse(shown.body), names := {})
    names = {name: value for name, value in names.items() if not name.startswith("_")}
    assert set(names) == {name for name in dir(geomech) if not name.startswith("_")}
    assert all(value is getattr(geomech, name) for name, value in names.items())


def test_nothing_heavy_is_loaded_to_start():
    """Neither by `import geomech` and `dir` nor by `geomech --help`; NumPy alone takes longer than both."""
    heavy = "{'numpy', 'scipy', 'matplotlib', 'sympy', 'msgspec', 'rft.laws'} & set(sys.modules)"
    assert python(f"import sys, geomech; dir(geomech); print({heavy})") == "set()\n"
    assert (
        python(f"import sys; from geomech.shell import cli; print({heavy})")
        == "set()\n"
    )


def test_the_version_is_told_once_and_the_same_everywhere():
    assert run("--version")[:2] == (0, f"geomech {geomech.__version__}\n")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    assert "version" in project["project"]["dynamic"]
    assert project["tool"]["hatch"]["version"] == {"path": "geomech/core/version.py"}
    assert importlib.metadata.version("geomech") == geomech.__version__
    assert not re.search(r"^version: ", (ROOT / "CITATION.cff").read_text(), re.M)
    assert re.search(r"^## (\S+)", (ROOT / "CHANGELOG.md").read_text(), re.M)[1] in (
        geomech.__version__,
        "Unreleased",
    )


def test_help_fits_a_screen():
    code, out, _ = run("--help")
    assert code == 0
    assert out.count("\n") <= 43


@pytest.mark.parametrize(
    ("words", "found"),
    [
        ("geomech disp", {"displacement"}),
        (
            "geomech displacement three-link-gl",
            {"three-link-glass", "three-link-glass-close"},
        ),
        ("geomech run sandfish-h", {"sandfish-heavy"}),
        ("geomech sweep --ov", {"--over"}),
        ("geomech intrude sq", {"square-rod"}),
        ("geomech reference mo", {"motion"}),
        ("geomech accuracy sph", {"sphere"}),
        ("geomech walk xpl", {"xplorer"}),
        ("geomech --ver", {"--version"}),
    ],
)
def test_a_shell_completes_commands_options_and_scenes(words, found, monkeypatch):
    asked = {
        "_GEOMECH_COMPLETE": "complete_bash",
        "COMP_WORDS": words,
        "COMP_CWORD": str(len(words.split()) - 1),
    }
    for name, value in asked.items():
        monkeypatch.setenv(name, value)
    assert set(run()[1].split()) == found


def test_what_is_completed_can_be_given():
    for name in (
        *names.printable_names(),
        "half-cylinder",
        "sphere",
        "poppy-seeds-loose",
        "coulomb",
        "no-slip-snake",
    ):
        assert name in names.printable_names() and run("scenes", "--show", name)[0] == 0
    for name in names.medium_names():
        assert run("stress", name, "--beta", "0", "--gamma", "90")[0] == 0
    assert names.section_names() == [
        *sections()
    ]  # each of which tests/scenes/test_keys.py prints


def test_completion_can_be_shown(monkeypatch, capfd):
    monkeypatch.setattr(sys, "stdin", io.StringIO())
    code = "import sys; sys.argv[0] = 'geomech'; from geomech.shell.cli import main; main(['--show-completion', 'bash'])"
    assert "_GEOMECH_COMPLETE=complete_bash" in python(
        code, _TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION="1"
    )


def test_what_checkers_and_people_look_for_beside_the_code_is_there():
    for package in ("geomech", "rft"):
        assert (ROOT / package / "py.typed").is_file()
    cited = (ROOT / "CITATION.cff").read_text()
    for field in (
        "cff-version: 1.2.0",
        "title: ",
        "authors:",
        "license: MIT",
        "references:",
        "doi: 10.1063/1.4898629",
    ):
        assert field in cited


def test_the_program_that_checkers_look_at_runs():
    import typed

    from geomech.mathematics.systems import KINDS

    try:
        assert all(
            len(part()) > 7 for part in (typed.geometry, typed.scenes, typed.mechanics)
        )
    finally:
        KINDS.restore({name: kind for name, kind in KINDS.items() if name != "cart"})


def public(tree):
    """Functions and methods that are seen from outside, with the class they are of."""
    for node in tree.body:
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            yield from ((f"{node.name}.{name}", f) for name, f in public(node))
        elif isinstance(node, ast.FunctionDef) and (
            not node.name.startswith("_") or node.name == "__call__"
        ):
            yield node.name, node


# Files whose functions take numbers, arrays and vectors alike.
FORMULAS = {"vectors", "simd", "compiled", "equations"}
# Decorators of functions that numba compiles by the types of a call.
COMPILED = {"formula", "register_jitable", "intrinsic"}


def test_public_functions_are_annotated():
    """One without any annotation is untyped to type checkers, which complain of every call of it in a strict
    program."""
    bare = []
    for package in ("rft", "geomech"):
        for path in (ROOT / package).rglob("*.py"):
            if path.stem in FORMULAS:
                continue
            for name, f in public(ast.parse(path.read_text())):
                if any(getattr(d, "id", "") in COMPILED for d in f.decorator_list):
                    continue
                asked = [
                    *f.args.posonlyargs,
                    *f.args.args,
                    *f.args.kwonlyargs,
                    f.args.vararg,
                    f.args.kwarg,
                ]
                if f.returns is None and not any(a and a.annotation for a in asked):
                    bare.append(f"{path.relative_to(ROOT)}:{f.lineno} {name}")
    assert bare == [], "say at least what it returns"
