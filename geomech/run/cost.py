"""Cost of requests, and the limits beyond which they need consent.

Balances and memory are counted beforehand. Seconds are assumed at first, from the time of balances on the machine that
this was written on; where the assumption does not decide, the first balances of the request itself are timed. They are
part of the request: nothing is computed only to be timed. No computed number depends on seconds. Seconds are CPU time,
so that other work on the machine does not count."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple

from geomech.run.backend import listen, listener, no_listener, preferred
from rft.core.refusal import Refusal

LONGEST = 60.0  # s of computing that a command begins without consent
LARGEST = 2e9  # bytes of memory, likewise
WORTH_SAYING = 5.0  # s
BASE = 1.6e8  # bytes: Python, its libraries, and a batch of the solver
SLOW, FAST = (
    10.0,
    5.0,
)  # most and one over the least that balances may take, over the assumed seconds
ENOUGH, FEWEST = (
    0.25,
    3,
)  # s of computing, and batches of balances, that suffice to time them
LOADING = (
    20.0  # times the median: a batch that takes longer has loaded or compiled code
)

# Assumed seconds, for each place of the body where forces are evaluated; measured, with the work around a balance, 2e-6 to
# 5e-6 by NumPy and 0.3e-6 to 1.2e-6 compiled in dry media, 0.8e-6 and 0.5e-6 in a linear one, whose bodies were small; and
# for each batch of balances, however small.
BALANCE = {"numpy": 5e-6, "numba": 0.8e-6}
LINEAR = 0.1
BATCH = {"numpy": 2e-3, "numba": 5e-4}
STEP = (
    200  # balances of large batches that take NumPy as long as one batch, however small
)


class TooLong(Refusal):
    """A request needs more computing or memory than a command begins without consent."""


class Cost(NamedTuple):
    """Cost of a request. balances: of force. seconds: of computing, ``besides`` of which are other work. memory: bytes
    at the peak. steps: of time, in which balances are solved one after the other."""

    balances: int
    seconds: float
    memory: float
    besides: float = 0.0
    steps: float = 0.0

    def __str__(self) -> str:
        balances = f"{self.balances:,} force balances"
        return f"{balances}, about {duration(self.seconds)} of computing and {_size(self.memory)} of memory"

    @property
    def as_balances(self) -> float:
        """Number of balances that take NumPy about as long, for the choice of a back end."""
        return self.balances + STEP * self.steps

    @property
    def small(self) -> bool:
        """Whether the cost is too small to be printed."""
        return self.seconds < WORTH_SAYING and self.memory < LARGEST

    def scaled(self, factor: float) -> Cost:
        """Return the cost if balances take ``factor`` times as long."""
        return self._replace(
            seconds=self.besides + factor * (self.seconds - self.besides)
        )

    def check(self, place: str, yes: bool, less: str = "ask for less") -> None:
        """Raise `TooLong` beyond the limits unless ``yes``. less: advice on a smaller request."""
        if not yes and (self.seconds > LONGEST or self.memory > LARGEST):
            limits = f"{duration(LONGEST)} or {_size(LARGEST)}"
            raise TooLong(
                str(self),
                where=place,
                instead=f"to compute for more than {limits} say ``yes``, or {less}",
            )


def assumed(
    samples: float, points: int, linear: bool, batches: float, back_end: str = ""
) -> float:
    """Return the assumed seconds of so many balances in so many batches, by the preferred back end or another."""
    back_end = back_end or preferred()
    return (
        samples * points * (LINEAR if linear else 1.0) * BALANCE[back_end]
        + batches * BATCH[back_end]
    )


def decide(cost: Cost, judge: Callable[[Cost], None]) -> None:
    """Call judge(cost) at once where the assumed seconds decide, else once the first balances have been timed; an
    exception from it ends the request."""
    of_balances = cost.seconds - cost.besides
    is_clear = (
        of_balances > FAST * LONGEST
        or cost.seconds < LONGEST / SLOW
        or cost.besides > LONGEST
    )
    decided = is_clear or cost.memory > LARGEST
    listen(
        no_listener if decided else _Watch(cost, judge)
    )  # times of an earlier part of the request do not apply to this one
    if decided:
        judge(cost)


def is_undecided() -> bool:
    """Return whether the first balances are still to be timed."""
    return isinstance(listener(), _Watch) and not listener().over


class _Watch:
    """A listener that times the first balances of a request, except those that load code."""

    def __init__(self, cost: Cost, judge: Callable[[Cost], None]):
        self.cost, self.judge, self.over = cost, judge, False
        self.back_end = preferred()  # threads of the solver do not inherit it
        self.last: float | None = None
        self.batches: list[tuple[float, float]] = []  # (seconds, those assumed)

    def __call__(self, samples: int, points: int, linear: bool) -> None:
        if self.over:
            return
        now = time.process_time()
        if self.last is not None:
            self.batches.append(
                (now - self.last, assumed(samples, points, linear, 1, self.back_end))
            )
        self.last = now
        if (
            len(self.batches) >= FEWEST
            and sum(took for took, _ in self.batches) >= ENOUGH
        ):
            self.over = True
            self.judge(self.cost.scaled(self._factor()))

    def _factor(self) -> float:
        """Return the seconds of balances over those assumed."""
        factors = sorted(took / each for took, each in self.batches)
        most = LOADING * factors[len(factors) // 2]
        took, expected = map(
            sum,
            zip(*((took, each) for took, each in self.batches if took <= most * each)),
        )
        return took / expected


def duration(seconds: float) -> str:
    """Return a time in words, at least a second, in the largest unit that makes a few of it."""
    for unit, size in (("days", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 1.5 * size:
            return (
                f"{seconds / size:.2g} {unit}"
                if seconds < 100 * size
                else f"{seconds / size:,.0f} {unit}"
            )
    return f"{max(1.0, seconds):.0f} s"


def _size(memory: float) -> str:
    return f"{memory / 1e9:,.2g} GB" if memory >= 1e9 else f"{memory / 1e6:.0f} MB"
