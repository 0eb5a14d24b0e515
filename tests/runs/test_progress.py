"""How far a computation is: lines in a pipe, a bar in a notebook, from commands and from Python."""

import sys
import time
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from geomech import scenes
from geomech.mathematics.systems import Swimmer
from geomech.run import progress
from geomech.run.progress import PRINT_INTERVAL, Computation
from geomech.shell import terminal
from geomech.studies.scene_tables import SceneTables

VISCOUS = scenes.load("three-link-viscous").with_numerics(grid=5)


def test_lines_in_a_pipe(monkeypatch, capsys):
    assert PRINT_INTERVAL == 10.0
    monkeypatch.setattr(progress, "PRINT_INTERVAL", 0.02)
    said = ""
    with terminal.progress("field of <x>") as reached:
        for fraction, line in (
            (0.0, "field of <x>: under way for "),
            (0.25, "field of <x>: 25 % after "),
        ):
            reached(fraction)
            while line not in said:
                time.sleep(0.01)
                said += capsys.readouterr().err
    capsys.readouterr()
    time.sleep(0.1)
    assert capsys.readouterr().err == ""  # nothing more when it is over


def test_what_is_quick_says_nothing(capsys):
    with terminal.progress("field") as reached:
        reached(0.5)
    assert capsys.readouterr().err == ""


def test_the_time_to_go(monkeypatch):
    clock = [100.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: clock[0])
    course = Computation("field of x")
    clock[0] += 20.0
    course.update(0.25)
    assert str(course) == "field of x: 25 % after 20 s, about 60 s to go"
    course.update(1.0)
    assert str(course) == "field of x: under way for 20 s"


def test_a_part_has_its_own_title(monkeypatch):
    seen = []
    monkeypatch.setattr(
        Computation, "update", lambda course, f: seen.append((course.title, f))
    )
    with terminal.progress("displacement") as reached:
        with progress.progress("table") as inner:
            inner(0.5)
        reached(0.7)
    assert seen == [("table", 0.5), ("displacement", 0.7)]


def test_after_a_part_the_whole_goes_on(monkeypatch):
    clock = [100.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: clock[0])
    with terminal.progress("whole") as reached:
        reached(0.2)
        clock[0] += 10.0
        with progress.progress("part"):
            clock[0] += 10.0
        assert str(reached.__self__) == "whole: 20 % after 20 s, about 80 s to go"


def test_an_error_ends_it(capsys, monkeypatch):
    monkeypatch.setattr(progress, "PRINT_INTERVAL", 0.02)
    with pytest.raises(terminal.Stopped), terminal.progress("field") as failed:
        raise terminal.Stopped(2)
    time.sleep(0.06)
    assert capsys.readouterr().err == ""
    with terminal.progress("next") as reached:  # is nobody's part
        assert (
            reached.__self__.title == "next" and reached.__self__ is not failed.__self__
        )


@pytest.fixture
def notebook(monkeypatch):
    """What a notebook would have been shown."""
    shown, display = [], ModuleType("IPython.display")
    display.HTML = lambda text: text
    display.display = lambda text, display_id: (
        shown.append(text) or SimpleNamespace(update=shown.append)
    )
    shell = ModuleType("IPython")
    shell.get_ipython, shell.display = (lambda: SimpleNamespace(kernel=1)), display
    monkeypatch.setitem(sys.modules, "IPython", shell)
    monkeypatch.setitem(sys.modules, "IPython.display", display)
    return shown


def test_a_bar_in_a_notebook(notebook, monkeypatch, capsys):
    with progress.progress("quick") as reached:
        reached(0.5)
    assert notebook == []
    monkeypatch.setattr(progress, "REDRAW_INTERVAL", 0.0)
    with progress.progress("field of <x>") as reached:
        reached(0.25)
        reached(0.5)
    assert notebook[0].startswith(
        '<progress max="1" value="0.2500"></progress> field of &lt;x&gt;: 25 % after 0 s'
    )
    assert [text[25:31] for text in notebook] == ["0.2500", "0.5000", "1.0000"]
    assert notebook[-1].endswith("field of &lt;x&gt;: done in 0 s")
    assert capsys.readouterr().err == ""


def test_a_table_from_python_shows_how_far_it_is(notebook, monkeypatch):
    monkeypatch.setattr(progress, "REDRAW_INTERVAL", 0.0)
    study = SceneTables(VISCOUS)
    assert np.isfinite(study.fitted.A).all()
    assert (
        "connection of three-link-viscous, 72 force balances: done in 0 s"
        in notebook[-1]
    )
    before = len(notebook)
    study.poses("path", None, [0.3])
    assert len(notebook) == before  # it is there already


def test_progress_may_be_taken_by_the_caller(notebook, monkeypatch):
    monkeypatch.setattr(progress, "REDRAW_INTERVAL", 0.0)
    told = []
    SceneTables(VISCOUS).compute_field(told.append)
    assert told == [1.0] and notebook == []


def test_a_command_in_a_pipe_says_how_far_its_tables_are(monkeypatch, capsys):
    monkeypatch.setattr(progress, "PRINT_INTERVAL", 0.03)
    solve = Swimmer.velocity
    monkeypatch.setattr(
        Swimmer, "velocity", lambda self, *x: time.sleep(0.1) or solve(self, *x)
    )
    with terminal.progress("displacement of x"):
        SceneTables(scenes.load("three-link-glass").with_numerics(grid=5)).poses(
            "harmonic"
        )
    lines = capsys.readouterr().err.splitlines()
    assert any(
        line.startswith("harmonics of three-link-glass, 216 force balances: under way")
        for line in lines
    )
