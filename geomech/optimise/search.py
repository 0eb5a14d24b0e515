"""The search for the best gait of a scene: in a table where that is near and cheap, finished and told by the direct tier."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from geomech import workers
from geomech.connection import check_knobs
from geomech.errors import SceneError, named
from geomech.files import note
from geomech.gaits import Gait
from geomech.gaits.base import FASTEST
from geomech.optimise import loops as series
from geomech.optimise import ways
from geomech.optimise.climb import TRIES, climb
from geomech.optimise.keeping import NEARLY, Keeping
from geomech.optimise.limits import Asked
from geomech.optimise.loops import Loops
from geomech.optimise.optimum import Optimum, Told
from geomech.optimise.request import CLIMB, FINISH, NEAR, RUNS, Request, checked
from geomech.optimise.telling import told
from geomech.reconstruct import turning
from geomech.scene.model import Scene

NEAR_TOLERANCE, TOLERANCE = 1e-7, 1e-5  # at which a search ends: change of the value of a step
FINISHED = 2  # answers of the table that the direct tier goes on from
TURNED = 0.02  # rad: what 128 phases leave of a net turn
AS_MUCH = 1e-3  # of the value
STRAIGHTENED = 4  # steps of Newton, at most
LARGER = 0.6  # of the room: how far the scene's own gait goes the second time
FINISHING = 1.0  # s from a start by the direct tier, likewise
ENOUGH = 64  # harmonics that any start is told in


def optimise(
    scene: Scene, aim: str = "displacement", direction: str | None = None, harmonics: int | None = None,
    within: Asked = None, starts: int = 1, *, rate: float | None = None, power: float | None = None,
    progress: Callable | None = None,
) -> Optimum:  # fmt: skip
    """The gait of a scene with the largest displacement, efficiency, turning or speed (`Aim`), among Fourier series up to
    ``harmonics`` (5) that keep every shape variable ``within`` (the field's extent) of 0, or of (lowest, highest) for each,
    searched for from the scene's own gait and ``starts`` - 1 others. A sine is sought among sines. SceneError for what makes
    no sense."""
    request = checked(scene, aim, direction, harmonics, within, starts, rate, power)
    return search(request, progress)


def search(request: Request, progress: Callable | None = None) -> Optimum:
    """`optimise` of a request that is checked."""
    check_knobs(1, progress)
    with named(request.scene.name), workers.one_way(workers.MANY if request.starts > 1 else 1):
        return _Search(request, progress).optimum()


class _Search:
    """One search, with its count of cycles."""

    def __init__(self, request: Request, progress: Callable | None):
        self.r, self.progress, self.began, self.count = request, progress, time.perf_counter(), 0
        self.done = 0
        climbs = request.starts + (min(FINISHED, request.starts) if request.looks_up else 0) + self._rough
        self.climb = TRIES * (RUNS if request.whole else FINISH)  # cycles of one, or so
        self.expected = climbs * self.climb

    @property
    def _rough(self) -> bool:
        """Many a loop is the best near by."""
        return self.r.looks_up or self.r.system.singularity is not None

    def optimum(self) -> Optimum:
        r = self.r
        own = r.loops.of(r.scene.gait)
        self.origin, *others = r.loops.starts(own, r.starts)
        self.keeping = Keeping(r.loops, r.system.singularity, self.origin)
        start = self._told(self._start())
        self._timed(start)  # refuses what no gait can be
        turn = abs(float(start.displacement[2]))
        found = self._climbed([self.keeping.first, *map(self.keeping.start, others)], turn)
        best, answers, p = start, [], None
        for q, times in found:
            if self.keeping.meets(q, NEARLY):
                continue
            this, q = self._forwards(self._told(self._turned_to(q)), q)
            straight = not r.aim.straight or abs(this.displacement[2]) <= turn + TURNED + this.heading
            answers.append((this.value, times))
            if straight and this.value > best.value:
                best, p = this, q
        if p is None:
            best, p = dataclasses.replace(start, gait=self._as_series(start.gait)), r.loops.fitted(own)
        active = [*r.loops.active(p), *["singular shapes"] * self.keeping.meets(p, 1 / NEARLY), *best.limits]
        best = dataclasses.replace(best, gait=self._timed(best))
        return Optimum(
            r, best, start, tuple(active), tuple(sorted(answers, reverse=True)), self.count,
            time.perf_counter() - self.began,
        )  # fmt: skip

    def _climbed(self, starts: list[np.ndarray], turn: float) -> list[tuple[np.ndarray, int]]:
        """Different loops that the starts lead to, each with how many led there."""
        r, tier = self.r, ways.direct(self.r)
        if not r.looks_up:
            return self._different(self._near(tier, starts, turn, None, RUNS if r.whole else NEAR))
        looked_up = ways.looked_up(r)
        near = self._near(ways.table(r, *looked_up), starts, turn, looked_up, NEAR)
        if not r.system.odd:  # where the table, which is, takes either sense for as good
            near += [series.reversed_(p) for p in near]
        worth = lambda found: [self._worth(tier, found[0], x) for x in (turn, np.inf)]  # what turns is straightened yet
        ranked = sorted(self._different(near), key=worth, reverse=True)[:FINISHED]
        further = self._each([p for p, _ in ranked], turn, None, FINISH, TOLERANCE)
        finished = [max(q, p, key=lambda q: self._worth(tier, q, turn)) for q, (p, _) in zip(further, ranked)]
        return [(self._straightened(tier, p, turn), times) for p, (_, times) in zip(finished, ranked)]

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

    def _each(self, starts: list[np.ndarray], turn: float, looked_up, most: int, tolerance: float) -> list[np.ndarray]:
        """Where each start leads, by the direct tier or what is ``looked_up``. Who computes: `geomech.workers`."""
        at_hand = len(starts) == 1 and not workers.far()
        how = Way(self.r, self.origin, turn, looked_up, most, tolerance, self._tell if at_hand else None)
        ends, before, seconds = [], self.done, len(starts) * (CLIMB if looked_up else FINISHING)
        for p, count in workers.each(_up_from, how, starts, len(starts), seconds=seconds):
            ends.append(p)
            self.count += count
            self._tell(max(0, before + len(ends) * self.climb - self.done))  # whoever did it, and however soon
        return ends

    def _worth(self, tier, p, turn: float) -> float:
        """Value of a loop as the search sees it, none if it turns too much."""
        try:
            b = tier(p)
        except RuntimeError:  # it cannot be run
            return -np.inf
        finally:
            self.count += 1
        if self.r.aim.straight and abs(b.net[0][2]) > turn + TURNED:
            return -np.inf
        power = b.power[0] if b.power else None
        timed = self.r.aim.timed
        period = self.r.aim.time(np.abs(tier.loops.cycle(p)[1]).max(), power, tier.degree)[0] if timed else 1.0
        return self.r.aim.value(b, period)[0]

    def _up(self, cycles, p, how: Way) -> np.ndarray:
        before = cycles.count
        p = climb(
            cycles, self.r.aim, p, turn=how.turn, most=how.most, tolerance=how.tolerance, stroke=self.keeping.stroke,
            singularity=self.r.system.singularity, away=self.keeping.away, told=how.told or (lambda: None),
        )  # fmt: skip
        self.count += cycles.count - before
        return self._straightened(cycles, self.r.loops.fitted(p), how.turn)

    def _straightened(self, cycles, p, turn: float) -> np.ndarray:
        """The loop near by that turns no more than it may: the search may end a little beyond."""
        for _ in range(STRAIGHTENED if self.r.aim.straight else 0):
            b = cycles(p)
            self.count += 1
            theta, slopes = b.net[0][2], b.net[1][2]
            more = theta - np.clip(theta, -turn, turn)
            if abs(more) < TURNED / 20:
                break
            p = self.r.loops.fitted(p - more * slopes / ((slopes**2).sum() or 1.0))
        return p

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
        return series.same(p, q, system.mirror, system.odd) if isinstance(loops, Loops) else loops.same(p, q)

    def _start(self) -> Gait:
        """The gait to begin with; a note where that is not the scene's."""
        r = self.r
        if r.gait is not r.scene.gait:
            limit = f"{r.loops.within:g} rad" if np.ndim(r.loops.within) == 0 else "its limits"
            note(f"{r.scene.name}: its gait reaches beyond {limit}: the search starts from a smaller one")
            return r.loops.gait(self.keeping.first)
        return r.gait

    def _turned_to(self, p: np.ndarray) -> Gait:
        """The gait; with a direction, it starts where the body points as in the mean, and goes forwards or to the left."""
        r = self.r
        if not (r.aim.direction and isinstance(r.loops, Loops)) or r.whole:
            return r.loops.gait(p)
        for _ in range(3):  # the crossing nearest to the start, more closely each time
            ahead = turning(r.scene.system.run(*r.loops.cycle(p)).xi)
            n, after = len(ahead), np.roll(ahead, -1)
            places = np.flatnonzero(ahead * after <= 0)
            k = places[np.argmin(np.minimum(places, n - places))]
            share = ahead[k] / ((ahead[k] - after[k]) or 1.0)
            p = series.shifted(p, 2 * np.pi / n * (k + share))
        return r.loops.gait(p)

    def _forwards(self, this: Told, p: np.ndarray) -> tuple[Told, np.ndarray]:
        """Run backwards where a direction is asked for and the gait goes the other way, if that brings as much."""
        k = "xy".find(self.r.aim.direction or "-")
        if k < 0 or this.displacement[k] >= 0 or not isinstance(self.r.loops, Loops):
            return this, p
        back = series.reversed_(p)
        other = self._told(self._turned_to(back))
        return (other, back) if other.value >= this.value * (1 - AS_MUCH) else (this, p)

    def _timed(self, this: Told) -> Gait:
        """With the frequency that its limits allow."""
        if self.r.aim.timed and 0 < this.time < 1 / (2 * np.pi * FASTEST):
            raise SceneError(
                f"its limits let a gait repeat more than {FASTEST:g} times a second: lower --rate, or --power"
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


class Way(NamedTuple):
    """How a start is led uphill. origin: the first start. turn (rad): of a cycle, at most. looked_up: `ways.looked_up`, or
    None for the direct tier. told: whenever a cycle is done, where only one start is under way."""

    r: Request
    origin: np.ndarray
    turn: float
    looked_up: tuple | None
    most: int
    tolerance: float
    told: Callable | None


def _up_from(how: Way, p: np.ndarray) -> tuple[np.ndarray, int]:
    """(where a start leads, cycles)."""
    search = _Search(how.r, None)
    search.keeping = Keeping(how.r.loops, how.r.system.singularity, how.origin)
    cycles = ways.table(how.r, *how.looked_up) if how.looked_up else ways.direct(how.r)
    return search._up(cycles, p, how), search.count
