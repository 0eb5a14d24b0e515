"""Who computes: this process, as many others as there are cores, or a Dask cluster.

What is large is asked for in parts that do not depend on who computes them, one thread and one back end each: `each` gives
the same numbers to the last digit whoever does. `using` says who; that changes no answer, and so it is said around a
computation, like who is told how far it is, and is no argument of it:

    with geomech.workers.using(4):
        study.compute_field()
"""

from __future__ import annotations

import contextlib
import itertools
import time
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextvars import ContextVar
from typing import Any, Protocol

from geomech.errors import Note, SceneError, number
from geomech.workers.solving import at_hand, cores, in_turn, known, settled, settled_on

__all__ = ["alone", "each", "far", "keeping", "known", "one_way", "settle", "settled_on", "shared", "using"]

WORTH = 3.0  # s of computing, below which other processes are not worth their start: a second of each
MANY = 4  # parts of a request, from which on "auto" takes compiled code at once, where it lies ready
MOST = 1024  # processes


class Crew(Protocol):
    """Some that compute side by side. remote: not for this command alone."""

    remote: bool

    def each(self, order, items: Iterable) -> Iterator: ...

    def has(self) -> str:
        """The back end that all of them have at hand."""

    def close(self) -> None: ...


class Keeper(Protocol):
    """One that keeps the results of parts. settled: what `settle` said of many parts, now or when they were kept."""

    settled: str

    def each(self, call: tuple, back_end: str, items: Iterable, parts: int, computed: Callable) -> Iterator:
        """Those that are kept, then computed(the other items)."""

    def in_turn(self, what: str, compute: Callable, start: Any) -> Any:
        """One that is kept, or else compute(): `rft.in_turn.known`."""


_crew: ContextVar[Crew | None] = ContextVar("crew", default=None)
_keeper: ContextVar[Keeper | None] = ContextVar("keeper", default=None)


@contextlib.contextmanager
def using(count: int | None = None, scheduler: str | None = None) -> Iterator[None]:
    """In the body of the statement what is large is computed by ``count`` processes, by default one a core, or on the Dask
    cluster of the ``scheduler`` at an address such as "tcp://10.0.0.1:8786". Processes start when something turns out to be
    worth it. SceneError for what is none, and at once for a scheduler that does not answer."""
    crew = _called(count, scheduler)
    token = _crew.set(crew)
    try:
        yield
    finally:
        _crew.reset(token)
        if crew:
            crew.close()


def _called(count: int | None, scheduler: str | None) -> Crew | None:
    if count is not None:
        try:
            number("--workers", count, 1, MOST, whole=True)
        except ValueError as error:
            raise SceneError(str(error)) from None
    if scheduler is not None:
        if count is not None:
            raise SceneError("--workers are processes of this machine, --scheduler has its own: give one of the two")
        from geomech.workers.cluster import Cluster

        return Cluster(scheduler)
    if (count or cores()) == 1:
        return None
    from geomech.workers.processes import Processes

    return Processes(int(count or cores()))


@contextlib.contextmanager
def keeping(keeper: Keeper | None) -> Iterator[None]:
    """In the body of the statement results of parts are kept (`geomech.study.parts`), or none: those of `each`, and the pieces
    of what is computed one after the other (`known`). What is asked for in it is the same, in the same order, each time that
    the same is to be taken up."""
    token = _keeper.set(keeper)
    try:
        with in_turn.keeping(keeper and keeper.in_turn):
            yield
    finally:
        _keeper.reset(token)


def far() -> bool:
    """Whether a cluster computes."""
    crew = _crew.get()
    return crew is not None and crew.remote


def settle(parts: int) -> str:
    """The back end that "auto" stands for in a request of so many parts, from the first to the last; none for one alone,
    which goes its way. What a larger request has settled holds for those within it."""
    if already := settled_on():
        return already
    if parts < MANY:
        return "numpy" if parts > 1 else ""
    crew, keeper = _crew.get(), _keeper.get()
    found = (keeper and keeper.settled) or (crew.has() if crew else at_hand())
    if keeper:
        keeper.settled = found
    return found


@contextlib.contextmanager
def one_way(parts: int) -> Iterator[None]:
    """In the body of the statement "auto" is what `settle` says for so many parts, for what is done between them, too."""
    with settled(settle(parts)):
        yield


def each(
    f: Callable, common: Any, items: Iterable, parts: int, back_end: str | None = None, seconds: float | None = None
) -> Iterator:
    """f(common, item) of every item, in their order; how many there are in all, those done before included, is ``parts``. f is
    a function of a module; what cannot be sent is computed here. back_end: as `settle` gives it. seconds: what they take one
    after the other, if that is known; else the first ones tell. What is raised, a signal among others, ends all that is
    under way."""
    keeper, items = _keeper.get(), iter(items)
    back_end = settle(parts) if back_end is None else back_end
    computed = lambda rest: _computed(f, common, iter(rest), parts, back_end, seconds)
    yield from keeper.each((f, common), back_end, items, parts, computed) if keeper else computed(items)


def _computed(f: Callable, common: Any, items: Iterator, parts: int, back_end: str, seconds: float | None) -> Iterator:
    """As `each`."""
    from geomech.workers.task import here

    crew = _crew.get()
    at_home = lambda item: here(f, common, item, back_end, parts > 1)
    if crew is not None and not crew.remote:
        yield from _first(at_home, items, parts, seconds)
    for item in items:  # the first that is left, if any
        rest = itertools.chain([item], items)
        order = crew and _order(crew.remote, f, common, back_end)
        yield from crew.each(order, rest) if order else map(at_home, rest)


def _first(f: Callable, items: Iterator, parts: int, seconds: float | None) -> Iterator:
    """Do, here, what is too little for others: all of it, or as much as it takes to know better."""
    took: list[float] = []
    while parts == 1 or seconds is None or seconds < WORTH:
        try:
            item = next(items)
        except StopIteration:
            return
        start = time.perf_counter()
        found = f(item)
        took.append(time.perf_counter() - start)
        yield found
        if len(took) > 1 and parts - len(took) > 1:
            each = sum(took[1:]) / (len(took) - 1)  # the first one also loads what is needed
            each = max(each, sum(took) / len(took)) if sum(took) > WORTH else each
            if each * (parts - len(took)) > WORTH:
                return


def _order(remote: bool, f: Callable, common: Any, back_end: str):
    """What others need to know; None, with a note, if they cannot, and SceneError where others are asked for by name."""
    from geomech.workers.task import Alone, packed

    try:
        return packed(f, common, back_end)
    except Alone as error:
        cure = "put it in a module, or in a file for --plugin"
        if remote:
            raise SceneError(f"a cluster cannot know what is to be computed: {error}: {cure}") from None
        if error.told:
            warnings.warn(f"computed by one process, others cannot know it: {error}: {cure}", Note, stacklevel=5)
    return None


def shared() -> bool:
    """Whether others compute besides this process."""
    return _crew.get() is not None


@contextlib.contextmanager
def alone() -> Iterator[None]:
    """In the body of the statement nothing is given away, or kept by itself: it is the work of a worker."""
    token = _crew.set(None)
    try:
        with keeping(None):
            yield
    finally:
        _crew.reset(token)
