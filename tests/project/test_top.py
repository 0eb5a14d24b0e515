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

import commands
import pytest
from commands import geomech as run

import geomech
from geomech.questions.shared import names

ROOT = pathlib.Path(__file__).parents[2]


def python(code, **env):
    """Return what a Python of its own prints, which must end well."""
    run = [sys.executable, "-c", code]
    env = {**os.environ, **env}
    done = subprocess.run(run, capture_output=True, text=True, cwd=ROOT, env=env)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


def test_they_are_listed_found_by_tab_and_told_on_one_screen():
    names = {name for name in dir(geomech) if not name.startswith("_")}
    assert {"load", "Scene", "Study", "gaits", "media", "plots", "register"} <= names
    complete = rlcompleter.Completer({"geomech": geomech}).complete
    offered = {complete("geomech.", k).rstrip("()") for k in range(len(names))}
    assert offered == {f"geomech.{name}" for name in names}
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


@pytest.mark.parametrize(
    "load", ["import geomech; dir(geomech)", "from geomech.shell import cli"]
)
def test_nothing_heavy_is_loaded_to_start(load):
    """NumPy alone takes longer than all that is loaded."""
    heavy = {"numpy", "scipy", "matplotlib", "sympy", "msgspec", "rft.laws"}
    assert python(f"import sys; {load}; print({heavy} & {{*sys.modules}})") == "set()\n"


def test_the_version_is_told_once_and_the_same_everywhere():
    assert run("--version")[:2] == (0, f"geomech {geomech.__version__}\n")
    assert importlib.metadata.version("geomech") == geomech.__version__
    assert not re.search(r"^version: ", (ROOT / "CITATION.cff").read_text(), re.M)
    heading = re.search(r"^## (\S+)", (ROOT / "CHANGELOG.md").read_text(), re.M)[1]
    assert heading in (geomech.__version__, "Unreleased")


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
        ("geomech symbolic diff", {"differential-drive"}),
        ("geomech --ver", {"--version"}),
    ],
)
def test_a_shell_completes_commands_options_and_scenes(words, found, monkeypatch):
    monkeypatch.setenv("_GEOMECH_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", words)
    monkeypatch.setenv("COMP_CWORD", str(len(words.split()) - 1))
    assert set(run()[1].split()) == found


def test_completion_can_be_shown(monkeypatch, capfd):
    monkeypatch.setattr(sys, "stdin", io.StringIO())
    code = "import sys; sys.argv[0] = 'geomech'; from geomech.shell.cli import main; main(['--show-completion', 'bash'])"
    assert "_GEOMECH_COMPLETE=complete_bash" in python(
        code, _TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION="1"
    )


@pytest.mark.parametrize("name", names.printable_names())
def test_a_name_that_is_completed_is_shown(name):
    assert run("scenes", "--show", name)[0] == 0


@pytest.mark.parametrize("name", names.medium_names())
def test_a_medium_that_is_completed_has_stresses(name):
    assert run("stress", name, "--beta", "0", "--gamma", "90")[0] == 0


def test_what_checkers_and_people_look_for_beside_the_code_is_there():
    assert (ROOT / "geomech" / "py.typed").is_file()
    assert (ROOT / "rft" / "py.typed").is_file()
    assert "doi: 10.1063/1.4898629" in (ROOT / "CITATION.cff").read_text()


def test_the_program_that_checkers_look_at_runs():
    import typed

    parts = typed.geometry, typed.scenes, typed.mechanics
    with commands.own_parts():
        assert all(len(part()) > 7 for part in parts)


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


def is_bare(f):
    """Whether a function has no annotation at all."""
    arguments = [*f.args.posonlyargs, *f.args.args, *f.args.kwonlyargs]
    arguments += [a for a in (f.args.vararg, f.args.kwarg) if a]
    return f.returns is None and not any(a.annotation for a in arguments)


def test_public_functions_are_annotated():
    """One without any annotation is untyped to type checkers, which complain of every
    call of it in a strict program."""
    bare = []
    for path in [*ROOT.glob("rft/**/*.py"), *ROOT.glob("geomech/**/*.py")]:
        for name, f in public(ast.parse(path.read_text())):
            compiled = COMPILED & {getattr(d, "id", "") for d in f.decorator_list}
            if is_bare(f) and not compiled and path.stem not in FORMULAS:
                bare.append(f"{path.relative_to(ROOT)}:{f.lineno} {name}")
    assert bare == [], "say at least what it returns"


def test_a_name_that_is_none_has_no_attribute():
    with pytest.raises(AttributeError, match="'geomech' has no attribute 'lode'"):
        geomech.lode  # noqa: B018
