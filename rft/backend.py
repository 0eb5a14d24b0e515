"""Which code makes the solver's descents: NumPy's batches, or compiled code (`rft.lanes`) where numba is installed
and a model is nothing but numbers.

Both take the same steps to the same answer, but for rounding. For a hundred samples compiled code is some twenty times as
fast, for many thousands some six times; but to load it takes half a second, and to make it, once for an installation, some
fifteen. So "auto" begins with NumPy, and loads the compiled code once NumPy has worked, or a batch would take it, for as
long as loading takes. Where it is not made yet, a process of lower priority makes it meanwhile; nobody waits for it, and it
ends with the command. `python -m rft` makes it beforehand.
"""

from __future__ import annotations

import atexit
import contextlib
import functools
import importlib.util
import math
import sys
import time
from collections.abc import Iterator, Sequence
from contextvars import ContextVar

import numpy as np

from rft.bodies.base import Body
from rft.contact import Model
from rft.effects.base import Effect, Site, folded, pieced, under_way
from rft.media.base import require, shown
from rft.numbers import foreign
from rft.workers import is_one_thread

BACKENDS = ("auto", "numpy", "numba")
TO_LOAD, LONG = 0.5, 3.0  # s of NumPy's work after which the compiled code is loaded, and is made
AHEAD = 3e-6  # s that NumPy takes for a sample of one element, on the machine this was written on


def check(backend: str) -> None:
    """ValueError for no back end, and for one that is not installed."""
    if not (isinstance(backend, str) and backend in BACKENDS):
        raise ValueError(f"backend must be one of {', '.join(BACKENDS)}, got {shown(backend)}")
    require(
        backend != "numba" or installed(), "backend = 'numba' takes numba: pip install 'geomech[fast]', or take 'auto'"
    )


@functools.cache
def installed() -> bool:
    """Whether numba is."""
    return importlib.util.find_spec("numba") is not None


def takes(backend: str, model: Model, evaluations: int = 0) -> bool:
    """Whether the next descents of a model, of so many samples times elements, are compiled ones."""
    backend = (_settled.get() or backend) if backend == "auto" else backend
    if backend == "numpy" or foreign(model) is not None or not installed():
        return False
    return backend == "numba" or AUTO.ready(AHEAD * evaluations)


_settled: ContextVar[str] = ContextVar("settled", default="")


@contextlib.contextmanager
def settled(backend: str) -> Iterator[None]:
    """In the body of the statement "auto" is this one from the first balance to the last: the parts of a large request give
    the same digits whenever and wherever they are computed."""
    token = _settled.set(backend)
    try:
        yield
    finally:
        _settled.reset(token)


def settled_on() -> str:
    """What "auto" is here, if that is settled."""
    return _settled.get()


def at_hand() -> str:
    """What "auto" is settled on where there is much to do: compiled code if it lies ready on this machine."""
    if AUTO.is_ready:
        return "numba"
    if not installed() or AUTO.worked < 0:
        return "numpy"
    from rft import compiled

    return "numba" if compiled.made() else "numpy"


def foreign_to(medium, body: Body, effects: Sequence[Effect], loads: str):
    """What of a body's model, with all that its effects bring about while they go on, compiled code does not know; None if
    nothing."""
    body = pieced(body, effects, 1)
    model = folded(effects, medium, body, loads)
    motions = model.motions(body.motion(*np.zeros((2, body.joints, 1))))
    held = {name: 0.0 * motion.v for name, motion in motions.items()}
    first, next_ = (Site(dt, np.zeros((3, 1)), motions, held) for dt in (0.0, 1.0))
    for process in under_way(effects):
        state = process.after(process.begin(first), first, held)
        model = process.at(state, next_).apply(model)
    return foreign(model)


def counted(backend: str):
    """Count NumPy's work in the body of the statement, so that "auto" knows when compiled code pays: its own, not what it
    waits for on a busy machine. By itself what it works because that is settled, of which what follows must not know, but
    where compiled code would have served it is made for the next time."""
    settled = _settled.get()
    if backend != "auto" or AUTO.is_ready or AUTO.worked < 0 or settled == "numba" or (settled and is_one_thread()):
        return contextlib.nullcontext()
    return _counted(bool(settled))


@contextlib.contextmanager
def _counted(settled: bool):
    start = time.process_time()
    yield
    took = time.process_time() - start
    if not settled:
        AUTO.worked += took
        return
    AUTO.bore += took
    if AUTO.bore > LONG:
        AUTO.make()


class Auto:
    """What "auto" knows in this process. worked: s of NumPy's work; below 0 no compiled code is taken. bore: s of what is
    settled to be NumPy's, till the next look at whether there is compiled code."""

    def __init__(self):
        self.worked, self.bore, self.maker, self.is_ready = 0.0, 0.0, None, False

    def ready(self, ahead: float = 0.0) -> bool:
        """Whether compiled code lies ready, and has been worth loading, or is for what lies ahead, s."""
        if self.is_ready or self.worked + ahead < TO_LOAD:
            return self.is_ready
        if self.maker is not None and self.maker.poll() is None:
            return False
        from rft import compiled  # which takes half a second

        self.is_ready = compiled.made()
        if not self.is_ready and self.worked > LONG:
            self.make()
        return self.is_ready

    def make(self) -> None:
        """Have compiled code made, once, if there is none."""
        self.bore = -math.inf
        if self.maker is None and installed() and not _is_child():
            from rft import compiled

            if not compiled.made():
                self.maker = _started()


AUTO = Auto()


def _is_child() -> bool:
    """Whether this is a worker of another process, which has the code made itself."""
    import multiprocessing

    return multiprocessing.parent_process() is not None


def _started():
    """A process that makes the compiled code, and does not outlive this one."""
    import subprocess

    code = f"import sys; sys.path[:] = {sys.path!r}; from rft import compiled; compiled.make(5)"
    nothing = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.DEVNULL)
    maker = subprocess.Popen([sys.executable, "-c", code], **nothing)
    atexit.register(_end, maker)
    return maker


def _end(maker) -> None:
    maker.terminate()
    maker.wait()
