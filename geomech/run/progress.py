"""How far a long computation is: a bar on a terminal and in a notebook, a line every ten seconds in a pipe."""

from __future__ import annotations

import contextlib
import html
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextvars import ContextVar

from rft.refusal import printable

EVERY = 10.0  # s between lines
REDRAWN = 0.5  # s between drawings of a notebook's bar, and before the first


class Course:
    """Of a computation. title: of what is under way. fraction: done of that. shown: called whenever there is news."""

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
        """Since it began."""
        return time.monotonic() - self.start

    def __str__(self) -> str:
        seconds, fraction = self.seconds, self.fraction
        if not 0 < fraction < 1:
            return f"{self.title}: under way for {seconds:.0f} s"
        left = seconds * (1 / fraction - 1)
        return f"{self.title}: {100 * fraction:.0f} % after {seconds:.0f} s, about {left:.0f} s to go"


_under_way: ContextVar[Course | None] = ContextVar("course", default=None)


def told(found: Iterable, count: int, progress: Callable | None) -> Iterator:
    """What is found, ``count`` in all, while ``progress`` is told how much of it there is."""
    for done, one in enumerate(found, 1):
        if progress:
            progress(done / count)
        yield one


@contextlib.contextmanager
def progress(title: str, bar: bool = True):
    """A function that takes the fraction done, and shows it: in a notebook as a bar; on a terminal as one too, unless ``bar``
    is False; else as lines on standard error. Within another it is a part of that, under its own title."""
    outer = _under_way.get()
    if outer is not None:
        before = outer.title, outer.fraction, outer.start
        outer.begin(title)
        try:
            yield outer.reached
        finally:
            outer.title, outer.fraction, outer.start = before
        return
    course = Course(title)
    token = _under_way.set(course)
    try:
        with _way(bar)(course):
            yield course.reached
    finally:
        _under_way.reset(token)


def _way(bar: bool) -> Callable:
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    if hasattr(shell, "kernel"):  # of a notebook; IPython on a terminal has none
        return _in_notebook
    return _on_terminal if bar and sys.stderr and sys.stderr.isatty() else _in_pipe


@contextlib.contextmanager
def _on_terminal(course: Course):
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bars:
        task = bars.add_task(escape(course.title), total=1.0)
        course.shown = lambda: bars.update(task, completed=course.fraction, description=escape(course.title))
        yield


@contextlib.contextmanager
def _in_notebook(course: Course):
    from IPython.display import HTML, display

    handle, due = None, time.monotonic() + REDRAWN

    def show(last: bool = False):
        nonlocal handle, due
        if time.monotonic() < due and not (last and handle):
            return
        said, part = (
            (f"{course.title}: done in {course.seconds:.0f} s", 1.0) if last else (str(course), course.fraction)
        )
        text = HTML(f'<progress max="1" value="{part:.4f}"></progress> {html.escape(said)}')
        if handle is None:
            handle = display(text, display_id=True)
        else:
            handle.update(text)
        due = time.monotonic() + REDRAWN

    course.shown = show
    yield
    show(last=True)


@contextlib.contextmanager
def _in_pipe(course: Course):
    over = threading.Event()

    def speak():
        while not over.wait(EVERY):
            with contextlib.suppress(OSError, ValueError, AttributeError):  # nobody need listen
                print(course, file=sys.stderr, flush=True)

    speaker = threading.Thread(target=speak, daemon=True)
    speaker.start()
    try:
        yield
    finally:
        over.set()
        speaker.join(1.0)
