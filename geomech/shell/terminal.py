"""The terminal of a command: one line for an error, a bar for progress, handlers of
signals."""

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
from typing import Any

import typer

from geomech.runs import THREAD_VARIABLES
from geomech.runs.progress import progress
from rft.core.notes import Note
from rft.core.refusal import Refusal, line, printable, spell_arguments

__all__ = ["Stopped", "exit_code", "progress", "report", "show", "stoppable"]

LONGEST = 2000  # characters of an error
# Modules that print, and write no files.
PRINTING = (
    "geomech.shell.cli",
    "geomech.shell.describe",
    "geomech.shell.pipeline",
    "geomech.shell.terminal",
    "click",
    "typer",
)
# s after a signal in which further ones are ignored: finished tasks are being stored.
PATIENCE = 2.0
SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP")  # those that stop a command
INTERRUPTED = 130  # exit code of a command that SIGINT stopped
# What a reader of a command types where its name is not that of the argument.
OPTIONS = {
    "tolerance": "--tol",
    "at": "--slice",
    "drawn": "--plot",
    "longest": "--yes",
    "geomech.register": "--plugin FILE.py",
    "Study.ccf(pair=...)": "geomech ccf --pair",
}


class Stopped(BaseException):
    """A signal asked to stop."""

    def __init__(self, number: int):
        self.name = signal.Signals(number).name
        self.code = 128 + number


@contextlib.contextmanager
def stoppable() -> Iterator[None]:
    """Raise `Stopped` on INT, TERM and HUP, so that no file stays half-written.

    Signals that are ignored, as HUP is under nohup, stay ignored."""
    last_stop = -math.inf

    def stop(number, frame):
        nonlocal last_stop
        if time.monotonic() > last_stop + PATIENCE:
            last_stop = time.monotonic()
            raise Stopped(number)

    former = former_handlers()
    for number in former:
        signal.signal(number, stop)
    try:
        yield
    finally:
        for number, handler in former.items():
            signal.signal(number, handler)


def former_handlers() -> dict[int, Any]:
    """Return the handlers of the signals that stop a command, by number; without those
    that are ignored. Only the main thread has any."""
    if threading.current_thread() is not threading.main_thread():
        return {}
    handlers = {}
    for name in SIGNALS:
        if not hasattr(signal, name):  # Windows has no HUP
            continue
        number = getattr(signal, name)
        handler = signal.getsignal(number)
        if handler not in (signal.SIG_IGN, None):
            handlers[number] = handler
    return handlers


def limit_threads() -> None:
    """Let the libraries below NumPy, which loads later, take one thread.

    Small matrices gain nothing from more threads, which wait in busy loops, and sums in
    several threads end in other digits."""
    os.environ.update(dict.fromkeys(THREAD_VARIABLES, "1"))


def exit_code(app: typer.Typer, argv: list[str]) -> int:
    """Run a command and return its exit code, after one line on standard error if it
    failed."""
    with stoppable(), printable_output():
        escape_letters()
        with collected_notes() as notes:
            code = run(app, argv, notes)
        if not code:
            for text in notes.values():
                report(f"note: {text}")
        return code


class PrintableStream:
    """A stream of text, all of it `printable`."""

    def __init__(self, stream):
        self._stream = stream

    def write(self, text: str) -> int:
        return self._stream.write(printable(text))

    def __getattr__(self, name: str):
        return getattr(self._stream, name)


@contextlib.contextmanager
def printable_output() -> Iterator[None]:
    """Make all that is printed `printable`, whatever files hold and are called."""
    stdout = sys.stdout
    if stdout is not None:
        sys.stdout = PrintableStream(stdout)
    try:
        yield
    finally:
        sys.stdout = stdout


@contextlib.contextmanager
def collected_notes() -> Iterator[dict[str, str]]:
    """Collect the notes of a command: the first of each kind, by its text before its
    first number."""
    notes: dict[str, str] = {}
    with warnings.catch_warnings():
        warnings.simplefilter("always", Note)
        show_others = warnings.showwarning

        def collect(message, category, *where, **options):
            if not issubclass(category, Note):
                show_others(message, category, *where, **options)
                return
            text = spell_arguments(message.args[0], option)
            kind = re.split(r"[\d.]+ ", text)[0]
            notes.setdefault(kind, text)

        warnings.showwarning = collect
        yield notes


def run(app: typer.Typer, argv: list[str], notes: dict[str, str]) -> int:
    """Run a command and return its exit code. notes: collected meanwhile; the line of
    an error ends with them."""
    try:
        code = app(args=argv, prog_name="geomech", standalone_mode=False)
        if code == INTERRUPTED:  # an interrupt that typer caught
            raise KeyboardInterrupt
        if sys.stdout:
            sys.stdout.flush()
        return code or 0
    except SystemExit as end:  # typer raises it for a closed pipe
        if isinstance(end.__context__, BrokenPipeError):
            return pipe_closed()
        return end.code
    except (Stopped, KeyboardInterrupt) as stop:
        return stopped(stop, argv)
    except typer.Abort as aborted:
        # typer raises it for an interrupt, and for an EOFError, which is none.
        if isinstance(aborted.__cause__, KeyboardInterrupt):
            return stopped(aborted.__cause__, argv)
        raise (aborted.__cause__ or aborted) from None
    except MemoryError:
        report(
            "error: not enough memory: reduce the grid, the phases or the number of "
            "amplitudes"
        )
    except BrokenPipeError:
        return pipe_closed()
    except Exception as error:
        text = error_text(error)
        if text is None:
            raise
        more = [*getattr(error, "__notes__", ()), *notes.values()]
        report(f"error: {'; '.join([line(text, LONGEST), *more])}")
        if isinstance(error, OSError):
            discard(sys.stdout)
    return 2


def error_text(error: Exception) -> str | None:
    """Return the text of an error of a user or of the system; None for a fault of the
    program, which shows its traceback."""
    if isinstance(error, OSError):
        return system_error(error)
    if hasattr(error, "format_message"):  # of typer
        return line(error.format_message())
    if isinstance(error, Refusal):
        return error.as_line(option)
    if isinstance(error, ValueError | RuntimeError):
        return str(error)
    return None


def option(argument: str) -> str:
    """Return the option for an argument of Python."""
    if argument in OPTIONS:
        return OPTIONS[argument]
    return f"--{argument.replace('_', '-')}"


def system_error(error: OSError) -> str:
    """Return the text of an error of the system, with its cure. Standard output, to
    which commands write, has no name."""
    if error.errno in (errno.EMFILE, errno.ENFILE):
        return (
            "too many files are open at once: raise the limit, for example with "
            "'ulimit -n 1024'"
        )
    *_, (frame, _) = traceback.walk_tb(error.__traceback__)
    module = frame.f_globals["__name__"]
    if error.filename is None and module.startswith(PRINTING):
        return (
            f"cannot write to standard output: {error.strerror}; free some disk "
            "space, or redirect the output"
        )
    return str(error)


def stopped(stop: BaseException, argv: list[str]) -> int:
    """Report what is stored, as the notes of ``stop`` say, and the command that
    resumes; return the exit code."""
    command = shlex.join(["geomech", *argv])
    stored = "; ".join(getattr(stop, "__notes__", ()))
    if stored:
        text = f"{stored}: {command}"
    else:
        text = (
            "nothing is stored; the same command starts again from the beginning: "
            f"{command}"
        )
    report(f"error: stopped by {getattr(stop, 'name', 'SIGINT')}: {text}")
    return getattr(stop, "code", INTERRUPTED)


def pipe_closed() -> int:
    """Return success where the reader left early: `geomech scenes | head -1`. Files are
    written by then."""
    discard(sys.stdout)
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
        discard(sys.stderr)


def discard(stream) -> None:
    """Redirect a stream that cannot be written to, so that Python does not complain of
    it at its end."""
    with contextlib.suppress(AttributeError, OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def escape_letters() -> None:
    """Escape letters that a terminal does not have, and silence matplotlib about its
    folders: no command fails for the sake of its messages."""
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(AttributeError, ValueError):
            stream.reconfigure(errors="backslashreplace")
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    try:
        Path.home()
    except RuntimeError:
        # Without a home matplotlib takes a temporary folder if MPLCONFIGDIR cannot be
        # one.
        os.environ.setdefault("MPLCONFIGDIR", os.devnull)
