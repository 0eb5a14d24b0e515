"""How far a computation is: lines in a pipe, a bar in a notebook or on a terminal."""

import io
import re
import sys
import time
from types import SimpleNamespace

from geomech.runs import progress
from geomech.shell import terminal


def test_lines_in_a_pipe_end_with_the_computation(monkeypatch, capsys):
    monkeypatch.setattr(progress, "PRINT_INTERVAL", 0.02)
    said = ""
    with terminal.progress("field of <x>") as report:
        report(0.25)
        while "field of <x>: 25 % after " not in said:
            time.sleep(0.01)
            said += capsys.readouterr().err
    capsys.readouterr()
    time.sleep(0.1)
    assert capsys.readouterr().err == ""


def test_the_time_to_go(monkeypatch):
    monkeypatch.setattr(progress.time, "monotonic", [120.0, 100.0].pop)
    computation = progress.Computation("field of x")
    computation.fraction = 0.25
    assert str(computation) == "field of x: 25 % after 20 s, about 60 s to go"


def test_a_bar_in_a_notebook(monkeypatch, capsys):
    shown = []

    def display(text, display_id):
        shown.append(text)
        return SimpleNamespace(update=shown.append)

    of_notebook = SimpleNamespace(kernel=1)
    shell = SimpleNamespace(get_ipython=lambda: of_notebook)
    monkeypatch.setitem(sys.modules, "IPython", shell)
    displays = SimpleNamespace(HTML=str, display=display)
    monkeypatch.setitem(sys.modules, "IPython.display", displays)
    monkeypatch.setattr(progress, "REDRAW_INTERVAL", 0.0)
    with progress.progress("field of <x>") as report:
        report(0.25)
    bar = '<progress max="1" value="0.2500"></progress>'
    assert shown[0].startswith(f"{bar} field of &lt;x&gt;: 25 % after 0 s")
    assert shown[-1].endswith("field of &lt;x&gt;: done in 0 s")
    assert capsys.readouterr().err == ""


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_a_bar_on_a_terminal_shows_what_is_done_and_is_gone_at_the_end(
    monkeypatch, capsys
):
    terminal_of_user = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal_of_user)
    monkeypatch.setenv("TERM", "xterm")
    with progress.progress("field of <x>") as report:
        report(0.25)
    written = terminal_of_user.getvalue()
    *_, last_drawn = re.findall(r"field of <x>.*? (\d+)%", written)
    assert last_drawn == "25"
    assert written.endswith("\x1b[2K")  # the line is erased
    assert capsys.readouterr().out == ""
