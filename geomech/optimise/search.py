"""The search for the best gait of a scene: in a table where that is near and cheap, finished and told by the direct tier."""

from __future__ import annotations

import contextlib
import dataclasses
import time
from collections.abc import Callable

import numpy as np

from geomech.gaits import Gait
from geomech.geometry.connection import check_fit_options
from geomech.geometry.gait import FASTEST
from geomech.geometry.reconstruct import turning
from geomech.io.files import note
from geomech.optimise import loops as series
from geomech.optimise import ways
from geomech.optimise.climb import TRIES, climb, settled
from geomech.optimise.keeping import NEARLY, Keeping
from geomech.optimise.limits import Asked
from geomech.optimise.loops import Loops
from geomech.optimise.optimum import Optimum, Told
from geomech.optimise.problem import EVEN
from geomech.optimise.request import (
    BESIDE,
    CLIMB,
    FINISH,
    FINISHED,
    LED,
    MORE,
    NEAR,
    POLISH,
    RUNS,
    SHARE,
    Request,
    checked,
)
from geomech.optimise.telling import told
from geomech.run.jobs import runner
from geomech.scene.model import Scene
from rft.refusal import Refusal, located

NEAR_TOLERANCE, TOLERANCE = 1e-7, 1e-5  # at which a search ends: change of the value of a step
NO_TURN = 1e-7  # rad: a net turn that is none
AS_MUCH = 1e-3  # of the value
LARGER = 0.6  # of the room: how far the scene's own gait goes the second time
POLISHED, EVEN_AT_LAST = 1e-7, EVEN / 10  # of the way of the best one, at the phases where it is told
FINISHING = 1.0  # s from a start by the direct tier, likewise
ENOUGH = 64  # harmonics that any start is told in


def optimise(
    scene: Scene, aim: str = "displacement", direction: str | None = None, harmonics: int | None = None,
    within: Asked = None, starts: int | None = None, *, rate: float | None = None, power: float | None = None,
    progress: Callable | None = None,
) -> Optimum:  # fmt: skip
    """The gait of a scene with the largest displacement, efficiency, turning or speed (`Aim`), among Fourier series up to
    ``harmonics`` (5) that keep every shape variable ``within`` (the field's extent) of 0, or of (lowest, highest) for each,
    searched for from the scene's own gait and ``starts`` - 1 others: by default none, and for two joints in a dry medium, where
    many a gait is the best near by, `OUTLINES` of the limits. A sine is sought among sines. Refusal for what makes no
    sense."""
    request = checked(scene, aim, direction, harmonics, within, starts, rate, power)
    return search(request, progress)


def search(request: Request, progress: Callable | None = None) -> Optimum:
    """`optimise` of a request that is checked."""
    check_fit_options(1, progress)
    with located(request.scene.name):
        return _Search(request, progress).optimum()


class _Search:
    """One search, with its count of cycles."""

    def __init__(self, request: Request, progress: Callable | None):
        self.r, self.progress, self.began, self.count = request, progress, time.perf_counter(), 0
        self.done = 0
        climbs = request.climbs + self._rough
        self.climb = TRIES * (RUNS if request.whole else FINISH)  # cycles of one, or so
        self.expected = climbs * self.climb

    @property
    def _rough(self) -> bool:
        """Many a loop is the best near by."""
        return self.r.looks_up or self.r.system.traits.singularity is not None

    def optimum(self) -> Optimum:
        r = self.r
        own = r.loops.of(r.scene.gait)
        self.origin, *others = r.loops.starts(own, r.starts)
        self.keeping = Keeping(r.loops, r.system.traits.singularity, self.origin)
        start = self._told(self._start())
        self._timed(start)  # refuses what no gait can be
        turn = abs(float(start.displacement[2]))
        found, others = self._climbed([self.keeping.first, *map(self.keeping.start, others)], turn)
        best, answers, p = start, [], None
        for q, times in found:
            if self.keeping.meets(q, NEARLY):
                continue
            this, q = self._forwards(*self._finished(q, turn), turn)
            answers.append((this.value, times))
            straight = not r.aim.straight or abs(this.displacement[2]) <= turn + self._slack(this)
            if straight and this.value > best.value:
                best, p = this, q
        if p is None:
            best, p = dataclasses.replace(start, gait=self._as_series(start.gait)), r.loops.fitted(own)
        active = [*r.loops.active(p), *["singular shapes"] * self.keeping.meets(p, 1 / NEARLY), *best.limits]
        best = dataclasses.replace(best, gait=self._timed(best))
        return Optimum(
            r, best, start, tuple(active), tuple(sorted(answers, reverse=True)), others, self.count,
            time.perf_counter() - self.began,
        )  # fmt: skip

    def _climbed(self, starts: list[np.ndarray], turn: float) -> tuple[list, tuple]:
        """(different loops that the starts lead to, each with how many led there; values of those that a table led to and
        nobody finished, likewise)."""
        r, tier = self.r, ways.direct(self.r)
        if not r.looks_up:
            return self._different(self._near(tier, starts, turn, None, RUNS if r.whole else NEAR)), ()
        looked_up = ways.looked_up(r)
        near = self._near(
            ways.table(r, *looked_up), starts + self._led_on(looked_up, starts, turn), turn, looked_up, NEAR
        )
        if not r.system.traits.odd:  # where the table, which is, takes either sense for as good
            near += [series.reversed_(p) for p in near]
        ranked = self._ranked(tier, near, turn)
        further = self._each([p for p, *_ in ranked[:FINISHED]], turn, None, FINISH, TOLERANCE)
        better = self._better(turn)
        finished = [(better(q, p), times) for q, (p, times, _) in zip(further, ranked)]
        k = max(range(len(finished)), key=lambda k: self._worth(tier, finished[k][0], turn))
        finished[k] = better(*self._polished(tier, looked_up, finished[k][0], turn)), finished[k][1]
        return finished, tuple((worth, times) for _, times, worth in ranked[FINISHED:])

    def _polished(self, tier, looked_up: tuple, p: np.ndarray, turn: float) -> tuple[np.ndarray, ...]:
        """p and where it leads at the phases where it is told, or, with several starts, whatever beside it leads further up."""
        found = [p]
        if self.r.starts > 1:
            near, further = self._beside(p)
            near += self._each(further, turn, looked_up, NEAR, NEAR_TOLERANCE)
            found += self._each(near, turn, None, 2 * FINISH, TOLERANCE / 10)
        best = max(found, key=lambda q: self._worth(tier, q, turn))
        return p, best, *self._each([best], turn, None, POLISH, POLISHED, phases=self.r.phases)

    def _better(self, turn: float) -> Callable:
        """A function that settles loops and returns the best."""
        tier = ways.direct(self.r, self.r.phases)
        return lambda *some: max((self._settled(p, turn) for p in some), key=lambda p: self._worth(tier, p, turn))

    def _beside(self, p: np.ndarray) -> tuple[list[np.ndarray], list[np.ndarray]]:
        """(loops next to p, others further off), without its symmetry: a way up from a symmetric loop comes to what is best
        among these, be it a saddle among all, and there are others about the best."""
        rng, loops = np.random.default_rng(0), self.r.loops
        falling = 1 / np.repeat(np.arange(loops.harmonics + 1), 2)[1:].clip(1)[:, None]
        off = lambda size: self.keeping.start(loops.fitted(p + size * loops.unit * falling * rng.normal(size=p.shape)))
        near, further = ([off(size) for _ in range(MORE)] for size in BESIDE)
        return near, further

    def _led_on(self, looked_up: tuple, starts: list[np.ndarray], turn: float) -> list[np.ndarray]:
        """The best loops within narrower limits, from which the search goes on: what is best there is so far from others that
        wider limits alone may miss it. None for one start."""
        if self.r.starts == 1:
            return []
        narrow = dataclasses.replace(self.r, loops=self.r.loops.narrower(SHARE))
        begun = [self.keeping.start(narrow.loops.fitted(p)) for p in starts]
        near = self._each(begun, turn, looked_up, NEAR, NEAR_TOLERANCE, narrow)
        return [p for p, *_ in self._ranked(ways.table(narrow, *looked_up), near, turn)[:LED]]

    def _ranked(self, tier, found: list[np.ndarray], turn: float) -> list[tuple[np.ndarray, int, float]]:
        """Different loops, how many led to each and their worth, the best first."""
        worth = [(p, times, self._worth(tier, p, turn)) for p, times in self._different(found)]
        return sorted(worth, key=lambda x: x[2], reverse=True)

    def _near(self, cycles, starts: list[np.ndarray], turn: float, looked_up, most: int) -> list[np.ndarray]:
        """Where each start leads; the first twice, as it is and with another size, where many a loop is the best near by."""
        twice = [self._larger(starts[0])] if self._rough else []
        near = self._each([*starts, *twice], turn, looked_up, most, NEAR_TOLERANCE)
        if twice:
            near[0] = max(near[0], near.pop(), key=lambda p: self._worth(cycles, p, turn))
        return near

    def _larger(self, p: np.ndarray) -> np.ndarray:
        """The loop with another size: a small one may lead to a poor answer."""
        size = np.abs(self.r.loops.cycle(p)[0] - p[0]).max()
        return self.keeping.start(
            self.r.loops.fitted(np.concatenate([p[:1], p[1:] * LARGER * self.r.loops.half.max() / size]))
        )

    def _each(
        self, starts: list[np.ndarray], turn: float, looked_up, most: int, tolerance: float, r: Request | None = None,
        phases: int | None = None,
    ) -> list[np.ndarray]:  # fmt: skip
        """Where each start leads, by the direct tier or what is ``looked_up``, in this request or another, at its phases or
        others. Who computes: `geomech.run.workers`."""
        here = len(starts) == 1 and not getattr(runner().executor, "remote", False)
        how = Way(r or self.r, self.origin, turn, looked_up, most, tolerance, self._tell if here else None, phases)
        ends, before, seconds = [], self.done, len(starts) * (CLIMB if looked_up else FINISHING)
        for p, count in runner().map(_up_from, how, starts, len(starts), seconds):
            ends.append(p)
            self.count += count
            self._tell(max(0, before + len(ends) * self.climb - self.done))  # whoever did it, and however soon
        return ends

    def _worth(self, tier, p, turn: float) -> float:
        """Value of a loop as the search sees it, less what it takes by its slopes not to turn too much."""
        try:
            b = tier(p)
        except RuntimeError:  # it cannot be run
            return -np.inf
        finally:
            self.count += 1
        power = b.power[0] if b.power else None
        timed = self.r.aim.timed
        period = self.r.aim.time(np.abs(tier.loops.cycle(p)[1]).max(), power, tier.degree)[0] if timed else 1.0
        value, by = self.r.aim.value(b, period)
        if self.r.aim.straight:
            theta, by_theta = b.net[0][2], b.net[1][2]
            more = theta - np.clip(theta, -turn, turn)
            value -= more * (by * by_theta).sum() / ((by_theta**2).sum() or 1.0)
        return float(value) if np.isfinite(value) else -np.inf

    def _up(self, cycles, p, how: Way) -> np.ndarray:
        before = cycles.count
        p = climb(
            cycles, self.r.aim, p, turn=how.turn, most=how.most, tolerance=how.tolerance, stroke=self.keeping.stroke,
            singularity=self.r.system.traits.singularity, away=self.keeping.away, told=how.told or (lambda: None),
            even=EVEN_AT_LAST if how.phases else EVEN,
        )  # fmt: skip
        self.count += cycles.count - before
        return p if isinstance(self.r.loops, Loops) else self.r.loops.fitted(p)  # loops are settled yet

    def _finished(self, p: np.ndarray, turn: float) -> tuple[Told, np.ndarray]:
        """The loop, or the one next to it that keeps all rules, and what that brings."""
        p = self._settled(self._turned_to(p), turn)
        return self._told(self.r.loops.gait(p)), p

    def _settled(self, p: np.ndarray, turn: float) -> np.ndarray:
        """The loop next to p that keeps all rules at the phases where it is told, and between them."""
        r = self.r
        if not isinstance(r.loops, Loops):
            return p
        cycles = ways.direct(r, r.phases)
        with contextlib.suppress(RuntimeError):  # of a loop near by that cannot be run
            p = settled(
                cycles, r.aim, p, turn=turn, stroke=self.keeping.stroke, singularity=r.system.traits.singularity,
                away=self.keeping.away,
            )  # fmt: skip
        self.count += cycles.count
        return r.loops.fitted(p)  # as it is, but where no loop near by keeps all rules

    def _slack(self, this: Told) -> float:
        """What a gait may turn more by rounding, rad; where its cycles are not those of the search, by its error, too."""
        return NO_TURN + (this.heading if self.r.whole or self.r.system is not self.r.scene.system else 0.0)

    def _tell(self, cycles: int = 1) -> None:
        self.done += cycles
        self.expected = max(self.expected, 1.1 * self.done)
        if self.progress:
            self.progress(self.done / self.expected)

    def _different(self, found: list[np.ndarray]) -> list[tuple[np.ndarray, int]]:
        kept: list[list] = []
        for p in found:
            for one in kept:
                if self._same(p, one[0]):
                    one[1] += 1
                    break
            else:
                kept.append([p, 1])
        return [tuple(one) for one in kept]

    def _same(self, p, q) -> bool:
        loops, system = self.r.loops, self.r.system
        return (
            series.same(p, q, system.traits.mirror, system.traits.odd) if isinstance(loops, Loops) else loops.same(p, q)
        )

    def _start(self) -> Gait:
        """The gait to begin with; a note where that is not the scene's."""
        r = self.r
        if r.gait is not r.scene.gait:
            limit = f"{r.loops.within:g} rad" if np.ndim(r.loops.within) == 0 else "its limits"
            note(f"{r.scene.name}: its gait reaches beyond {limit}: the search starts from a smaller one")
            return r.loops.gait(self.keeping.first)
        return r.gait

    def _turned_to(self, p: np.ndarray) -> np.ndarray:
        """The loop; with a direction, it starts where the body points as in the mean, and goes forwards or to the left."""
        r = self.r
        if not (r.aim.direction and isinstance(r.loops, Loops)) or r.whole:
            return p
        for _ in range(3):  # the crossing nearest to the start, more closely each time
            ahead = turning(r.scene.system.run(*r.loops.cycle(p)).xi)
            n, after = len(ahead), np.roll(ahead, -1)
            places = np.flatnonzero(ahead * after <= 0)
            k = places[np.argmin(np.minimum(places, n - places))]
            share = ahead[k] / ((ahead[k] - after[k]) or 1.0)
            p = series.shifted(p, 2 * np.pi / n * (k + share))
        return p

    def _forwards(self, this: Told, p: np.ndarray, turn: float) -> tuple[Told, np.ndarray]:
        """Run backwards where a direction is asked for and the gait goes the other way, if that brings as much."""
        k = "xy".find(self.r.aim.direction or "-")
        if k < 0 or this.displacement[k] >= 0 or not isinstance(self.r.loops, Loops):
            return this, p
        other, back = self._finished(series.reversed_(p), turn)
        return (other, back) if other.value >= this.value * (1 - AS_MUCH) else (this, p)

    def _timed(self, this: Told) -> Gait:
        """With the frequency that its limits allow."""
        if self.r.aim.timed and 0 < this.time < 1 / (2 * np.pi * FASTEST):
            raise Refusal(
                f"its limits let a gait repeat more than {FASTEST:g} times a second", instead="lower --rate, or --power"
            )
        frequency = 1 / (2 * np.pi * this.time) if self.r.aim.timed and this.time else self.r.scene.gait.frequency
        return dataclasses.replace(this.gait, frequency=frequency)

    def _as_series(self, gait: Gait) -> Gait:
        """The start itself, at amplitude 1."""
        if isinstance(self.r.loops, Loops):
            for harmonics in (self.r.loops.harmonics, 16, ENOUGH):
                some = dataclasses.replace(self.r.loops, harmonics=harmonics)
                found = some.gait(some.of(gait))
                if np.abs(found.cycle(512)[0] - gait.cycle(512)[0]).max() < 1e-9:
                    break
            return found
        return gait

    def _told(self, gait: Gait) -> Told:
        self.count += 1
        return told(self.r, gait)


@dataclasses.dataclass(frozen=True, eq=False)
class Way:
    """How a start is led uphill. origin: the first start. turn (rad): of a cycle, at most. looked_up: `ways.looked_up`, or
    None for the direct tier. told: whenever a cycle is done, where only one start is under way. phases: of the direct tier,
    where it takes others than the loops have, as the last way up does."""

    r: Request
    origin: np.ndarray
    turn: float
    looked_up: tuple | None
    most: int
    tolerance: float
    told: Callable | None = dataclasses.field(compare=False)
    phases: int | None = None


def _up_from(how: Way, p: np.ndarray) -> tuple[np.ndarray, int]:
    """(where a start leads, cycles)."""
    search = _Search(how.r, None)
    search.keeping = Keeping(how.r.loops, how.r.system.traits.singularity, how.origin)
    cycles = ways.table(how.r, *how.looked_up) if how.looked_up else ways.direct(how.r, how.phases)
    return search._up(cycles, p, how), search.count
