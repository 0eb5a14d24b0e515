"""Progress of a long computation: a bar on a terminal and in a notebook, a line every
ten seconds in a pipe."""

from __future__ import annotations

import contextlib
import html
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextvars import ContextVar

from rft.core.refusal import printable

PRINT_INTERVAL = 10.0  # s between lines
REDRAW_INTERVAL = 0.5  # s between drawings of a notebook's bar, and before the first


class Computation:
    """State of a computation.

    title: what is computed. fraction: the part that is done. show: called whenever the
    fraction changes."""

    def __init__(self, title: str):
        self.show: Callable = _show_nothing
        self.begin(title)

    def begin(self, title: str) -> None:
        self.title = printable(title)
        self.fraction = 0.0
        self.start = time.monotonic()

    def update(self, fraction: float) -> None:
        self.fraction = fraction
        self.show()

    @property
    def seconds(self) -> float:
        """Seconds since it began."""
        return time.monotonic() - self.start

    def __str__(self) -> str:
        seconds = self.seconds
        if not 0 < self.fraction < 1:
            return f"{self.title}: running for {seconds:.0f} s"
        percent = 100 * self.fraction
        remaining = seconds * (1 / self.fraction - 1)
        return (
            f"{self.title}: {percent:.0f} % after {seconds:.0f} s, "
            f"about {remaining:.0f} s to go"
        )


def _show_nothing() -> None:
    pass


_current: ContextVar[Computation | None] = ContextVar("computation", default=None)


def counted(items: Iterable, count: int, progress: Callable | None) -> Iterator:
    """Yield items, ``count`` in all, and call ``progress`` with the fraction done
    before each."""
    for n_done, item in enumerate(items, 1):
        if progress:
            progress(n_done / count)
        yield item


@contextlib.contextmanager
def progress(title: str, bar: bool = True) -> Iterator[Callable[[float], None]]:
    """Yield a function that takes the fraction done and shows it: as a bar in a
    notebook and, unless ``bar`` is False, on a terminal; else as lines on standard
    error. Inside another computation it is a part of that, under its own title."""
    outer = _current.get()
    if outer is not None:
        before = outer.title, outer.fraction, outer.start
        outer.begin(title)
        try:
            yield outer.update
        finally:
            outer.title, outer.fraction, outer.start = before
        return
    computation = Computation(title)
    token = _current.set(computation)
    try:
        display = _display_for(bar)
        with display(computation):
            yield computation.update
    finally:
        _current.reset(token)


def _display_for(bar: bool) -> Callable:
    """Return the context manager that shows a computation where this process runs."""
    ipython = sys.modules.get("IPython")
    if hasattr(ipython, "get_ipython"):
        shell = ipython.get_ipython()
        if hasattr(shell, "kernel"):  # of a notebook; IPython on a terminal has none
            return _show_in_notebook
    if bar and sys.stderr and sys.stderr.isatty():
        return _show_on_terminal
    return _print_lines


@contextlib.contextmanager
def _show_on_terminal(computation: Computation):
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bars:
        task = bars.add_task(escape(computation.title), total=1.0)

        def show() -> None:
            title = escape(computation.title)
            bars.update(task, completed=computation.fraction, description=title)

        computation.show = show
        yield


@contextlib.contextmanager
def _show_in_notebook(computation: Computation):
    from IPython.display import HTML, display

    handle = None
    due = time.monotonic() + REDRAW_INTERVAL

    def draw(text: str, fraction: float) -> None:
        nonlocal handle, due
        bar = f'<progress max="1" value="{fraction:.4f}"></progress>'
        cell = HTML(f"{bar} {html.escape(text)}")
        if handle is None:
            handle = display(cell, display_id=True)
        else:
            handle.update(cell)
        due = time.monotonic() + REDRAW_INTERVAL

    def show() -> None:
        if time.monotonic() >= due:
            draw(str(computation), computation.fraction)

    computation.show = show
    yield
    if handle is not None or time.monotonic() >= due:
        draw(f"{computation.title}: done in {computation.seconds:.0f} s", 1.0)


@contextlib.contextmanager
def _print_lines(computation: Computation):
    is_over = threading.Event()

    def print_state():
        while not is_over.wait(PRINT_INTERVAL):
            # The pipe may be closed.
            with contextlib.suppress(OSError, ValueError, AttributeError):
                print(computation, file=sys.stderr, flush=True)

    thread = threading.Thread(target=print_state, daemon=True)
    thread.start()
    try:
        yield
    finally:
        is_over.set()
        thread.join(1.0)
