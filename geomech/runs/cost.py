"""Cost of requests, and the limits beyond which they need consent.

Balances and memory are counted beforehand. Seconds are assumed at first, from the time
of balances on the machine that this was written on. Where the assumption does not
decide, the first balances of the request itself are timed. They are part of the
request: nothing is computed only to be timed. No computed number depends on seconds.
Seconds are CPU time, so that other work on the machine does not count."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple

from geomech.runs.backend import listen, listener, no_listener, preferred
from rft.core.refusal import Refusal

LONGEST = 60.0  # s of computing that a command begins without consent
LARGEST = 2e9  # bytes of memory, likewise
WORTH_SAYING = 5.0  # s
BASE = 1.6e8  # bytes: Python, its libraries, and a batch of the solver
# Balances may take up to this many times the assumed seconds, ...
SLOWEST = 10.0
# ... and no less than one over this of them.
FASTEST = 5.0
# s of computing, and number of batches of balances, that suffice to time them.
TIMED_SECONDS = 0.25
TIMED_BATCHES = 3
# Times the median: a batch that takes longer has loaded or compiled code, or follows
# other work.
LOADING = 3.0

# Assumed seconds, for each place of the body where forces are evaluated. Measured with
# the work around a balance: 2e-6 to 5e-6 by NumPy and 0.3e-6 to 1.2e-6 compiled in dry
# media, 0.8e-6 and 0.5e-6 in a linear one, whose bodies were small.
BALANCE = {"numpy": 5e-6, "built": 0.8e-6, "numba": 0.8e-6}
LINEAR = 0.1  # times BALANCE, in a linear medium
# s for each batch of balances, however small
BATCH = {"numpy": 2e-3, "built": 5e-4, "numba": 5e-4}


class TooLong(Refusal):
    """A request needs more computing or memory than a command begins without
    consent."""


class Cost(NamedTuple):
    """Cost of a request.

    balances: number of balances of force. seconds: of computing, ``besides`` of which
    are other work. memory: bytes at the peak. numpy_seconds: that the balances are
    assumed to take NumPy, by which the back end is chosen; 0 where it does not
    matter."""

    balances: int
    seconds: float
    memory: float
    besides: float = 0.0
    numpy_seconds: float = 0.0

    def __str__(self) -> str:
        balances = f"{self.balances:,} force balances"
        seconds = duration(self.seconds)
        memory = _size(self.memory)
        return f"{balances}, about {seconds} of computing and {memory} of memory"

    @property
    def small(self) -> bool:
        """Whether the cost is too small to be printed."""
        return self.seconds < WORTH_SAYING and self.memory < LARGEST

    def scaled(self, factor: float) -> Cost:
        """Return the cost if balances take ``factor`` times as long."""
        of_balances = self.seconds - self.besides
        return self._replace(seconds=self.besides + factor * of_balances)

    def check(
        self, place: str, yes: bool, cheaper_alternative: str = "request less"
    ) -> None:
        """Raise `TooLong` beyond the limits unless ``yes``. cheaper_alternative: advice
        on a smaller request."""
        if not yes and (self.seconds > LONGEST or self.memory > LARGEST):
            limits = f"{duration(LONGEST)} or {_size(LARGEST)}"
            raise TooLong(
                str(self),
                where=place,
                instead=f"to compute for more than {limits} use ``yes``, or "
                f"{cheaper_alternative}",
            )


def assumed_seconds(
    samples: float, points: int, linear: bool, batches: float, back_end: str = ""
) -> float:
    """Return the assumed seconds for balances of ``samples`` with ``points`` each, in a
    number of batches, by the preferred back end or another."""
    back_end = back_end or preferred()
    of_place = BALANCE[back_end]
    if linear:
        of_place *= LINEAR
    return samples * points * of_place + batches * BATCH[back_end]


def decide(cost: Cost, judge: Callable[[Cost], None]) -> None:
    """Call judge(cost) at once where the assumed seconds decide, else once the first
    balances have been timed. An exception from it ends the request."""
    of_balances = cost.seconds - cost.besides
    is_decided = (
        of_balances > FASTEST * LONGEST
        or cost.seconds < LONGEST / SLOWEST
        or cost.besides > LONGEST
        or cost.memory > LARGEST
    )
    if is_decided:
        # Times of an earlier part of the request do not apply to this one.
        listen(no_listener)
        judge(cost)
    else:
        listen(_Stopwatch(cost, judge))


def is_undecided() -> bool:
    """Return whether the first balances are still to be timed."""
    watch = listener()
    return isinstance(watch, _Stopwatch) and not watch.is_over


class _Stopwatch:
    """A listener that times the first balances of a request, except those that load
    code."""

    def __init__(self, cost: Cost, judge: Callable[[Cost], None]):
        self.cost = cost
        self.judge = judge
        self.is_over = False
        self.back_end = preferred()  # threads of the solver do not inherit it
        self.last: float | None = None
        self.measured: list[float] = []  # s, for each batch
        self.assumed: list[float] = []  # s, for each batch

    def __call__(self, samples: int, points: int, linear: bool) -> None:
        if self.is_over:
            return
        now = time.process_time()
        if self.last is not None:
            seconds = assumed_seconds(samples, points, linear, 1, self.back_end)
            self.measured.append(now - self.last)
            self.assumed.append(seconds)
        self.last = now
        kept = self._without_loading()
        if len(kept) < TIMED_BATCHES:
            return
        measured = sum(seconds for seconds, _ in kept)
        if measured >= TIMED_SECONDS:
            assumed = sum(seconds for _, seconds in kept)
            self.is_over = True
            self.judge(self.cost.scaled(float(measured / assumed)))

    def _without_loading(self) -> list[tuple[float, float]]:
        """Return (measured, assumed) seconds of the batches that have loaded no
        code."""
        batches = list(zip(self.measured, self.assumed))
        factors = sorted(measured / assumed for measured, assumed in batches)
        if not factors:
            return []
        largest = LOADING * factors[len(factors) // 2]
        return [
            (measured, assumed)
            for measured, assumed in batches
            if measured <= largest * assumed
        ]


def duration(seconds: float) -> str:
    """Return a time in words: at least a second, in the largest unit of which it has
    one and a half."""
    for unit, size in (("days", 86400.0), ("h", 3600.0), ("min", 60.0)):
        count = seconds / size
        if count >= 100:
            return f"{count:,.0f} {unit}"
        if count >= 1.5:
            return f"{count:.2g} {unit}"
    return f"{max(1.0, seconds):.0f} s"


def _size(memory: float) -> str:
    if memory >= 1e9:
        return f"{memory / 1e9:,.2g} GB"
    return f"{memory / 1e6:.0f} MB"
