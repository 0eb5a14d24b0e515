"""What a command owes its terminal: one line for what went wrong, a bar for what takes long, an ear for signals."""

from __future__ import annotations

import contextlib
import errno
import logging
import math
import os
import re
import shlex
import signal
import sys
import threading
import time
import traceback
import warnings
from collections.abc import Iterator
from pathlib import Path

import typer

from geomech.core.errors import Note
from geomech.run import BELOW
from geomech.run.progress import progress
from rft.refusal import line, printable

__all__ = ["Stopped", "ended", "progress", "stoppable", "tell"]

LONGEST = 2000  # characters of an error
PRINTING = "geomech.cli", "geomech.commands", "geomech.terminal", "click", "typer"  # modules that print; no files
PATIENCE = 2.0  # s after a signal in which further ones are not heeded: what is done is being kept


class Stopped(BaseException):
    """A signal asked to stop."""

    def __init__(self, number: int):
        self.name, self.code = signal.Signals(number).name, 128 + number


@contextlib.contextmanager
def stoppable() -> Iterator[None]:
    """INT, TERM and HUP raise `Stopped`, so that nothing half-written stays behind. Those that are ignored, as HUP is under
    nohup, stay so."""
    heard = [-math.inf]

    def stop(number, frame):
        if time.monotonic() > heard[0] + PATIENCE:
            heard[0] = time.monotonic()
            raise Stopped(number)

    numbers = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
    before = {n: signal.getsignal(n) for n in numbers if threading.current_thread() is threading.main_thread()}
    before = {n: handler for n, handler in before.items() if handler not in (signal.SIG_IGN, None)}
    for n in before:
        signal.signal(n, stop)
    try:
        yield
    finally:
        for n, handler in before.items():
            signal.signal(n, handler)


def calm() -> None:
    """Let the libraries below NumPy, which loads later, take one thread: small matrices gain nothing from more, their threads
    wait by turning in circles, and sums that are shared out end in other digits."""
    os.environ.update(dict.fromkeys(BELOW, "1"))


def ended(app: typer.Typer, argv: list[str]) -> int:
    """The exit code of a command, after one line on standard error if it failed."""
    with stoppable(), _plainly():
        _any_letters()
        return _run(app, argv)


class _Plain:
    """A stream of text, all of it `plain`."""

    def __init__(self, stream):
        self._stream = stream

    def write(self, text: str) -> int:
        return self._stream.write(printable(text))

    def __getattr__(self, name: str):
        return getattr(self._stream, name)


@contextlib.contextmanager
def _plainly() -> Iterator[None]:
    """What is printed is `plain`, whatever files hold and are called."""
    before = sys.stdout
    sys.stdout = before and _Plain(before)
    try:
        yield
    finally:
        sys.stdout = before


def _run(app: typer.Typer, argv: list[str]) -> int:
    with _notes() as notes:
        code = _run_noting(app, argv, notes)
    if not code:
        for text in notes.values():
            tell(f"note: {text}")
    return code


@contextlib.contextmanager
def _notes():
    """What is noted while a command runs: the first of each kind, by what it says before its first number."""
    notes: dict[str, str] = {}
    with warnings.catch_warnings():
        warnings.simplefilter("always", Note)
        warnings.filterwarnings("always", category=UserWarning, module=r"rft\.")  # its notes; it takes NumPy to load
        others = warnings.showwarning

        def show(message, category, *where, **options):
            if issubclass(category, Note) or category.__module__.partition(".")[0] == "rft":
                notes.setdefault(re.split(r"[\d.]+ ", str(message))[0], str(message))
            else:
                others(message, category, *where, **options)

        warnings.showwarning = show
        yield notes


def _run_noting(app: typer.Typer, argv: list[str], notes: dict[str, str]) -> int:
    try:
        code = app(args=argv, prog_name="geomech", standalone_mode=False)
        if code == 130:  # an interrupt that typer caught
            raise KeyboardInterrupt
        if sys.stdout:
            sys.stdout.flush()
        return code or 0
    except SystemExit as ended:  # what typer makes of a closed pipe
        return _unheard() if isinstance(ended.__context__, BrokenPipeError) else ended.code
    except (Stopped, KeyboardInterrupt) as stopped:
        return _stopped(stopped, argv)
    except typer.Abort as aborted:  # what typer makes of an interrupt, and of an EOFError, which is none
        if isinstance(aborted.__cause__, KeyboardInterrupt):
            return _stopped(aborted.__cause__, argv)
        raise (aborted.__cause__ or aborted) from None
    except MemoryError:
        tell("error: not enough memory: lower the grid, the phases or the number of amplitudes")
    except BrokenPipeError:
        return _unheard()
    except Exception as error:
        text = error.format_message() if hasattr(error, "format_message") else str(error)
        if not isinstance(error, (ValueError, OSError, RuntimeError)) and not hasattr(error, "format_message"):
            raise
        if isinstance(error, OSError):
            text = _of_system(error)
        tell("error: " + "; ".join([line(text, LONGEST), *getattr(error, "__notes__", ()), *notes.values()]))
        if isinstance(error, OSError):
            _deaf(sys.stdout)
    return 2


def _of_system(error: OSError) -> str:
    """What the system refuses, with its cure. Standard output has no name; it is what commands write to themselves."""
    if error.errno in (errno.EMFILE, errno.ENFILE):
        return "too many files are open at once: raise the limit, as by 'ulimit -n 1024'"
    *_, (frame, _) = traceback.walk_tb(error.__traceback__)
    where = frame.f_globals["__name__"]
    if error.filename is None and where.startswith(PRINTING):
        return f"cannot write to standard output: {error.strerror}; make room, or send it elsewhere"
    return str(error)


def _stopped(by: BaseException, argv: list[str]) -> int:
    """What is kept, as the notes of ``by`` say, and the command that takes it up."""
    kept, again = "; ".join(getattr(by, "__notes__", ())), shlex.join(["geomech", *argv])
    told = f"{kept}: {again}" if kept else f"nothing is kept; the same command starts anew: {again}"
    tell(f"error: stopped by {getattr(by, 'name', 'SIGINT')}: {told}")
    return getattr(by, "code", 130)


def _unheard() -> int:
    """What we said was not wanted to the end: `geomech scenes | head -1`. Files are written by then: no failure."""
    _deaf(sys.stdout)
    return 0


def tell(text: str) -> None:
    """One line on standard error, if anybody listens."""
    try:
        print(printable(" ".join(text.split())), file=sys.stderr, flush=True)
    except OSError:
        _deaf(sys.stderr)


def _deaf(stream) -> None:
    """Lead a stream that cannot be written to nowhere, so that Python does not complain of it at the end."""
    with contextlib.suppress(AttributeError, OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _any_letters() -> None:
    """What a terminal has no letters for is escaped, and matplotlib keeps its folders to itself: nothing fails for the sake
    of what is said beside the results."""
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(AttributeError, ValueError):
            stream.reconfigure(errors="backslashreplace")
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    try:
        Path.home()
    except RuntimeError:  # nowhere: matplotlib then takes a temporary folder if it is told of one that cannot be
        os.environ.setdefault("MPLCONFIGDIR", os.devnull)
