"""The terminal of a command: one line for an error, a bar for progress, handlers for signals."""

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
from collections.abc import Iterable, Iterator
from pathlib import Path

import typer

from geomech.core.errors import Note
from geomech.run import THREAD_VARIABLES
from geomech.run.progress import progress
from rft.core.refusal import Refusal, line, printable, spell_arguments

__all__ = ["Stopped", "exit_code", "progress", "report", "show", "stoppable"]

LONGEST = 2000  # characters of an error
PRINTING = (
    "geomech.cli",
    "geomech.describe",
    "geomech.pipeline",
    "geomech.terminal",
    "click",
    "typer",
)  # modules that print; no files
PATIENCE = 2.0  # s after a signal in which further ones are ignored: finished tasks are being stored


class Stopped(BaseException):
    """A signal asked to stop."""

    def __init__(self, number: int):
        self.name, self.code = signal.Signals(number).name, 128 + number


@contextlib.contextmanager
def stoppable() -> Iterator[None]:
    """Raise `Stopped` on INT, TERM and HUP, so that no file stays half-written. Signals that are ignored, as HUP is under
    nohup, stay ignored."""
    last = [-math.inf]

    def stop(number, frame):
        if time.monotonic() > last[0] + PATIENCE:
            last[0] = time.monotonic()
            raise Stopped(number)

    numbers = [
        getattr(signal, name)
        for name in ("SIGINT", "SIGTERM", "SIGHUP")
        if hasattr(signal, name)
    ]
    before = {
        n: signal.getsignal(n)
        for n in numbers
        if threading.current_thread() is threading.main_thread()
    }
    before = {
        n: handler
        for n, handler in before.items()
        if handler not in (signal.SIG_IGN, None)
    }
    for n in before:
        signal.signal(n, stop)
    try:
        yield
    finally:
        for n, handler in before.items():
            signal.signal(n, handler)


def limit_threads() -> None:
    """Let the libraries below NumPy, which loads later, take one thread: small matrices gain nothing from more, their threads
    wait by turning in circles, and sums that are shared out end in other digits."""
    os.environ.update(dict.fromkeys(THREAD_VARIABLES, "1"))


def exit_code(app: typer.Typer, argv: list[str]) -> int:
    """Run a command and return its exit code, after one line on standard error if it failed."""
    with stoppable(), _printable_output():
        _escape_letters()
        return _run(app, argv)


class _PrintableStream:
    """A stream of text, all of it `printable`."""

    def __init__(self, stream):
        self._stream = stream

    def write(self, text: str) -> int:
        return self._stream.write(printable(text))

    def __getattr__(self, name: str):
        return getattr(self._stream, name)


@contextlib.contextmanager
def _printable_output() -> Iterator[None]:
    """Make all that is printed `printable`, whatever files hold and are called."""
    before = sys.stdout
    sys.stdout = before and _PrintableStream(before)
    try:
        yield
    finally:
        sys.stdout = before


def _run(app: typer.Typer, argv: list[str]) -> int:
    with _notes() as notes:
        code = _run_noting(app, argv, notes)
    if not code:
        for text in notes.values():
            report(f"note: {text}")
    return code


@contextlib.contextmanager
def _notes():
    """Collect the notes of a command: the first of each kind, by its text before its first number."""
    notes: dict[str, str] = {}
    with warnings.catch_warnings():
        warnings.simplefilter("always", Note)
        warnings.filterwarnings(
            "always", category=UserWarning, module=r"rft\."
        )  # its notes; it takes NumPy to load
        others = warnings.showwarning

        def show(message, category, *where, **options):
            if (
                issubclass(category, Note)
                or category.__module__.partition(".")[0] == "rft"
            ):
                text = (
                    spell_arguments(message.args[0], _option)
                    if isinstance(message, Note)
                    else str(message)
                )
                notes.setdefault(re.split(r"[\d.]+ ", text)[0], text)
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
    except SystemExit as end:  # typer raises it for a closed pipe
        return (
            _pipe_closed() if isinstance(end.__context__, BrokenPipeError) else end.code
        )
    except (Stopped, KeyboardInterrupt) as stopped:
        return _stopped(stopped, argv)
    except typer.Abort as aborted:  # typer raises it for an interrupt, and for an EOFError, which is none
        if isinstance(aborted.__cause__, KeyboardInterrupt):
            return _stopped(aborted.__cause__, argv)
        raise (aborted.__cause__ or aborted) from None
    except MemoryError:
        report(
            "error: not enough memory: lower the grid, the phases or the number of amplitudes"
        )
    except BrokenPipeError:
        return _pipe_closed()
    except Exception as error:
        text = (
            line(error.format_message())
            if hasattr(error, "format_message")
            else _said(error)
        )
        if not isinstance(error, (ValueError, OSError, RuntimeError)) and not hasattr(
            error, "format_message"
        ):
            raise
        if isinstance(error, OSError):
            text = _system_error(error)
        report(
            "error: "
            + "; ".join(
                [line(text, LONGEST), *getattr(error, "__notes__", ()), *notes.values()]
            )
        )
        if isinstance(error, OSError):
            _discard(sys.stdout)
    return 2


OPTIONS = {  # what a reader of a command types where its name is not that of the argument
    "tolerance": "--tol",
    "at": "--slice",
    "drawn": "--plot",
    "longest": "--yes",
    "geomech.register": "--plugin FILE.py",
    "Study.ccf(pair=...)": "geomech ccf --pair",
}


def _said(error: Exception) -> str:
    """Return the line of an error, with options for the arguments that it names."""
    return error.as_line(_option) if isinstance(error, Refusal) else str(error)


def _option(argument: str) -> str:
    return OPTIONS.get(argument) or "--" + argument.replace("_", "-")


def _system_error(error: OSError) -> str:
    """Return the text of an error of the system, with its cure. Standard output, to which commands write, has no name."""
    if error.errno in (errno.EMFILE, errno.ENFILE):
        return (
            "too many files are open at once: raise the limit, as by 'ulimit -n 1024'"
        )
    *_, (frame, _) = traceback.walk_tb(error.__traceback__)
    where = frame.f_globals["__name__"]
    if error.filename is None and where.startswith(PRINTING):
        return f"cannot write to standard output: {error.strerror}; make room, or send it elsewhere"
    return str(error)


def _stopped(by: BaseException, argv: list[str]) -> int:
    """Report what is stored, as the notes of ``by`` say, and the command that resumes; return the exit code."""
    stored, command = (
        "; ".join(getattr(by, "__notes__", ())),
        shlex.join(["geomech", *argv]),
    )
    text = (
        f"{stored}: {command}"
        if stored
        else f"nothing is kept; the same command starts anew: {command}"
    )
    report(f"error: stopped by {getattr(by, 'name', 'SIGINT')}: {text}")
    return getattr(by, "code", 130)


def _pipe_closed() -> int:
    """Return success where the reader left early: `geomech scenes | head -1`. Files are written by then."""
    _discard(sys.stdout)
    return 0


def show(lines: Iterable[str]) -> None:
    """Print lines as they come."""
    for text in lines:
        print(text, flush=True)


def report(text: str) -> None:
    """Print one line on standard error, if that can be written to."""
    try:
        print(printable(" ".join(text.split())), file=sys.stderr, flush=True)
    except OSError:
        _discard(sys.stderr)


def _discard(stream) -> None:
    """Redirect a stream that cannot be written to, so that Python does not complain of it at the end."""
    with contextlib.suppress(AttributeError, OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _escape_letters() -> None:
    """Escape letters that a terminal does not have, and silence matplotlib about its folders: no command fails for the sake
    of its messages."""
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(AttributeError, ValueError):
            stream.reconfigure(errors="backslashreplace")
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    try:
        Path.home()
    except RuntimeError:  # there is none: matplotlib takes a temporary folder if MPLCONFIGDIR cannot be one
        os.environ.setdefault("MPLCONFIGDIR", os.devnull)
