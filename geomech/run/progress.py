"""Progress of a long computation: a bar on a terminal and in a notebook, a line every ten seconds in a pipe."""

from __future__ import annotations

import contextlib
import html
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextvars import ContextVar

from rft.core.refusal import printable

EVERY = 10.0  # s between lines
REDRAWN = 0.5  # s between drawings of a notebook's bar, and before the first


class Computation:
    """State of a computation. title: what is computed. fraction: the part that is done. shown: called whenever one
    changes."""

    def __init__(self, title: str):
        self.shown: Callable = lambda: None
        self.begin(title)

    def begin(self, title: str) -> None:
        self.title, self.fraction, self.start = printable(title), 0.0, time.monotonic()

    def reached(self, fraction: float) -> None:
        self.fraction = fraction
        self.shown()

    @property
    def seconds(self) -> float:
        """Seconds since it began."""
        return time.monotonic() - self.start

    def __str__(self) -> str:
        seconds, fraction = self.seconds, self.fraction
        if not 0 < fraction < 1:
            return f"{self.title}: under way for {seconds:.0f} s"
        remaining = seconds * (1 / fraction - 1)
        return f"{self.title}: {100 * fraction:.0f} % after {seconds:.0f} s, about {remaining:.0f} s to go"


_current: ContextVar[Computation | None] = ContextVar("course", default=None)


def counted(items: Iterable, count: int, progress: Callable | None) -> Iterator:
    """Yield items, ``count`` in all, and call ``progress`` with the fraction done before each."""
    for done, one in enumerate(items, 1):
        if progress:
            progress(done / count)
        yield one


@contextlib.contextmanager
def progress(title: str, bar: bool = True):
    """Yield a function that takes the fraction done and shows it: in a notebook as a bar; on a terminal, too, unless
    ``bar`` is False; else as lines on standard error. Inside another computation it is a part of that, under its own
    title."""
    outer = _current.get()
    if outer is not None:
        before = outer.title, outer.fraction, outer.start
        outer.begin(title)
        try:
            yield outer.reached
        finally:
            outer.title, outer.fraction, outer.start = before
        return
    computation = Computation(title)
    token = _current.set(computation)
    try:
        with _display_for(bar)(computation):
            yield computation.reached
    finally:
        _current.reset(token)


def _display_for(bar: bool) -> Callable:
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    if hasattr(shell, "kernel"):  # of a notebook; IPython on a terminal has none
        return _in_notebook
    return _on_terminal if bar and sys.stderr and sys.stderr.isatty() else _in_pipe


@contextlib.contextmanager
def _on_terminal(computation: Computation):
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bars:
        task = bars.add_task(escape(computation.title), total=1.0)
        computation.shown = lambda: bars.update(
            task, completed=computation.fraction, description=escape(computation.title)
        )
        yield


@contextlib.contextmanager
def _in_notebook(computation: Computation):
    from IPython.display import HTML, display

    handle, due = None, time.monotonic() + REDRAWN

    def show(last: bool = False):
        nonlocal handle, due
        if time.monotonic() < due and not (last and handle):
            return
        text, part = (
            (f"{computation.title}: done in {computation.seconds:.0f} s", 1.0)
            if last
            else (str(computation), computation.fraction)
        )
        text = HTML(
            f'<progress max="1" value="{part:.4f}"></progress> {html.escape(text)}'
        )
        if handle is None:
            handle = display(text, display_id=True)
        else:
            handle.update(text)
        due = time.monotonic() + REDRAWN

    computation.shown = show
    yield
    show(last=True)


@contextlib.contextmanager
def _in_pipe(computation: Computation):
    over = threading.Event()

    def speak():
        while not over.wait(EVERY):
            with contextlib.suppress(
                OSError, ValueError, AttributeError
            ):  # the pipe may be closed
                print(computation, file=sys.stderr, flush=True)

    speaker = threading.Thread(target=speak, daemon=True)
    speaker.start()
    try:
        yield
    finally:
        over.set()
        speaker.join(1.0)
