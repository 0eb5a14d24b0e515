"""How far a computation is: lines in a pipe, a bar in a notebook, from commands and
from Python."""

import sys
import time
from types import ModuleType, SimpleNamespace

import pytest

from geomech import scenes
from geomech.run import progress
from geomech.shell import terminal
from geomech.studies.scene_tables import SceneTables

VISCOUS = scenes.load("three-link-viscous").with_numerics(grid=5)


@pytest.fixture
def clock(monkeypatch):
    """Seconds that pass when a test says so."""
    seconds = [100.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: seconds[0])
    return seconds


def test_lines_in_a_pipe_end_with_the_computation(monkeypatch, capsys):
    monkeypatch.setattr(progress, "PRINT_INTERVAL", 0.02)
    said = ""
    with terminal.progress("field of <x>") as report:
        for fraction, line in ((0.0, "under way for "), (0.25, "25 % after ")):
            report(fraction)
            while f"field of <x>: {line}" not in said:
                time.sleep(0.01)
                said += capsys.readouterr().err
    with pytest.raises(terminal.Stopped), terminal.progress("field"):
        raise terminal.Stopped(2)
    capsys.readouterr()
    time.sleep(0.1)
    assert capsys.readouterr().err == ""


def test_what_is_quick_says_nothing(capsys):
    with terminal.progress("field") as report:
        report(0.5)
    assert capsys.readouterr().err == ""


def test_the_time_to_go(clock):
    computation = progress.Computation("field of x")
    clock[0] += 20.0
    computation.update(0.25)
    assert str(computation) == "field of x: 25 % after 20 s, about 60 s to go"
    computation.update(1.0)
    assert str(computation) == "field of x: under way for 20 s"


@pytest.fixture
def notebook(monkeypatch):
    """A list of all that a notebook is shown, at once."""
    shown = []

    def show(text, display_id):
        shown.append(text)
        return SimpleNamespace(update=shown.append)

    display = ModuleType("IPython.display")
    display.HTML = str
    display.display = show
    shell = ModuleType("IPython")
    shell.get_ipython = lambda: SimpleNamespace(kernel=1)
    monkeypatch.setitem(sys.modules, "IPython", shell)
    monkeypatch.setitem(sys.modules, "IPython.display", display)
    monkeypatch.setattr(progress, "REDRAW_INTERVAL", 0.0)
    return shown


def test_a_bar_in_a_notebook(notebook, capsys):
    with progress.progress("field of <x>") as report:
        report(0.25)
        report(0.5)
    bar = '<progress max="1" value="0.2500"></progress>'
    assert notebook[0].startswith(f"{bar} field of &lt;x&gt;: 25 % after 0 s")
    assert [text[25:31] for text in notebook] == ["0.2500", "0.5000", "1.0000"]
    assert notebook[-1].endswith("field of &lt;x&gt;: done in 0 s")
    assert capsys.readouterr().err == ""


def test_a_notebook_shows_nothing_of_what_is_quick(notebook, monkeypatch):
    monkeypatch.setattr(progress, "REDRAW_INTERVAL", 0.5)
    with progress.progress("quick") as report:
        report(0.5)
    assert notebook == []


def test_a_part_has_its_own_title_and_then_the_whole_goes_on(notebook, clock):
    with progress.progress("whole") as report:
        report(0.2)
        clock[0] += 20.0
        with progress.progress("part") as report_part:
            clock[0] += 10.0
            report_part(0.5)
        report(0.6)
    titles = [text.rpartition("> ")[2] for text in notebook]
    assert titles[1] == "part: 50 % after 10 s, about 10 s to go"
    assert titles[2] == "whole: 60 % after 30 s, about 20 s to go"


def test_progress_may_be_taken_by_the_caller(notebook):
    reported = []
    SceneTables(VISCOUS).compute_field(reported.append)
    assert reported == [1.0]
    assert notebook == []
