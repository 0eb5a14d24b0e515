"""What is reached from `geomech` itself, and what it costs to start."""

import ast
import importlib
import importlib.metadata
import inspect
import os
import pathlib
import re
import rlcompleter
import subprocess
import sys

import commands
import pytest
from commands import geomech as run

import geomech
from geomech import questions
from geomech.questions.shared import names

ROOT = pathlib.Path(__file__).parents[2]


def python(code, **env):
    """Return what a Python of its own prints, which must end well."""
    run = [sys.executable, "-c", code]
    env = {**os.environ, **env}
    done = subprocess.run(run, capture_output=True, text=True, cwd=ROOT, env=env)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


def test_names_are_found_by_tab_and_told():
    names = {name for name in dir(geomech) if not name.startswith("_")}
    complete = rlcompleter.Completer({"geomech": geomech}).complete
    offered = {complete("geomech.", k).rstrip("()") for k in range(len(names))}
    assert offered == {f"geomech.{name}" for name in names}
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
        ("geomech walk sandb", {"sandbot"}),
        ("geomech symbolic diff", {"differential-drive"}),
        ("geomech --ver", {"--version"}),
    ],
)
def test_a_shell_completes_commands_options_and_scenes(words, found, monkeypatch):
    monkeypatch.setenv("_GEOMECH_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", words)
    monkeypatch.setenv("COMP_CWORD", str(len(words.split()) - 1))
    assert set(run()[1].split()) == found


@pytest.mark.parametrize("name", names.printable_names())
def test_a_name_that_is_completed_is_shown(name):
    assert run("scenes", "--show", name)[::2] == (0, "")


@pytest.mark.parametrize("name", names.medium_names())
def test_a_medium_that_is_completed_has_stresses(name):
    assert run("stress", name, "--beta", "0", "--gamma", "90")[0] == 0


def test_the_program_that_checkers_look_at_runs():
    with commands.own_parts():
        import typed

        for part in (typed.connections, typed.scenes, typed.mechanics):
            part()


def test_every_question_is_a_function_of_its_name():
    importlib.import_module("geomech.runs.workers")  # no module takes its place
    for name in questions.SUMMARIES:
        assert getattr(geomech, name).__doc__.startswith(
            inspect.cleandoc(questions.question(name).__doc__)
        )
