"""The search for the best gait of a scene: with tables where these are near and cheap, finished by the direct tier."""

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
from geomech.optimisation import evaluators
from geomech.optimisation import loops as series
from geomech.optimisation.ascent import TRIES, ascend, project
from geomech.optimisation.constraints import NEARLY, Constraints
from geomech.optimisation.evaluate import evaluate_gait
from geomech.optimisation.limits import LimitsArgument
from geomech.optimisation.loops import Loops
from geomech.optimisation.optimum import Evaluation, Optimum
from geomech.optimisation.problem import EVEN
from geomech.optimisation.request import (
    ASCENT,
    FINISH,
    FINISHED,
    LED,
    MORE,
    NEAR,
    PERTURBATIONS,
    POLISH,
    RUNS,
    SHARE,
    Request,
    checked,
)
from geomech.run.runner import runner
from geomech.scenes.model import Scene
from rft.core.refusal import Refusal, located

NEAR_TOLERANCE, TOLERANCE = (
    1e-7,
    1e-5,
)  # change of the value in a step at which an ascent ends
NO_TURN = 1e-7  # rad: smaller net turns count as 0
AS_MUCH = 1e-3  # of the value: a reverse that loses less counts as good
LARGER = 0.6  # of the range: size of the scene's gait as a second start
POLISHED, EVEN_AT_LAST = (
    1e-7,
    EVEN / 10,
)  # tolerance and weight of the last ascent, at the phases of evaluations
FINISHING = 1.0  # s of other work per ascent by the direct tier, likewise
ENOUGH = 64  # harmonics that suffice for any initial gait


def optimise(
    scene: Scene, objective: str = "displacement", direction: str | None = None, harmonics: int | None = None,
    limits: LimitsArgument = None, starts: int | None = None, *, rate: float | None = None, power: float | None = None,
    progress: Callable | None = None,
) -> Optimum:  # fmt: skip
    """Return the gait of a scene with the largest displacement, efficiency, turning or speed (`Objective`).

    It is searched among Fourier series of ``harmonics`` (5) with every shape variable within ``limits`` (the field's extent)
    of 0, or between (lowest, highest) for each, from the scene's own gait and ``starts`` - 1 others. By default there
    are no others, except for two joints in a dry medium, which have many local optima: there the `OUTLINES` of the
    limits are used. For a sine, sines are searched. rate, power: limits for the objective "speed". Refusal for what makes no
    sense.

    Examples
    --------
    >>> from geomech.optimisation import optimise
    >>> from geomech.scenes import load
    >>> best = optimise(load("three-link-viscous"), "efficiency", harmonics=1, starts=1)
    >>> round(best.value, 3)  # displacement over path length
    0.11
    """
    request = checked(
        scene, objective, direction, harmonics, limits, starts, rate, power
    )
    return search(request, progress)


def search(request: Request, progress: Callable | None = None) -> Optimum:
    """Return the result of `optimise` for a checked request.

    Examples
    --------
    >>> from geomech.optimisation import checked, search
    >>> from geomech.scenes import load
    >>> found = search(checked(load("three-link-viscous"), "efficiency", harmonics=1, starts=1))
    >>> round(found.value, 3)  # displacement over path length
    0.11
    """
    check_fit_options(1, progress)
    with located(request.scene.name):
        return _Search(request, progress).optimum()


class _Search:
    """One search, with its number of cycles."""

    def __init__(self, request: Request, progress: Callable | None):
        self.request, self.progress, self.began, self.count = (
            request,
            progress,
            time.perf_counter(),
            0,
        )
        self.completed = 0
        ascents = request.ascents + self._rough
        self.cycles_per_ascent = TRIES * (
            RUNS if request.by_runs else FINISH
        )  # a rough estimate
        self.expected = ascents * self.cycles_per_ascent

    @property
    def _rough(self) -> bool:
        """Whether there are many local optima."""
        return (
            self.request.looks_up or self.request.system.traits.singularity is not None
        )

    def optimum(self) -> Optimum:
        r = self.request
        own = r.loops.of(r.scene.gait)
        self.origin, *others = r.loops.starts(own, r.starts)
        self.constraints = Constraints(
            r.loops, r.system.traits.singularity, self.origin
        )
        start = self._evaluated(self._start())
        self._timed(start)  # refuses impossible frequencies
        turn = abs(float(start.displacement[2]))
        loops, others = self._ascended(
            [self.constraints.first, *map(self.constraints.feasible, others)], turn
        )
        best, answers, p = start, [], None
        for q, times in loops:
            if self.constraints.meets_singular(q, NEARLY):
                continue
            evaluation, q = self._forwards(*self._finished(q, turn), turn)
            answers.append((evaluation.value, times))
            straight = not r.objective.straight or abs(
                evaluation.displacement[2]
            ) <= turn + self._slack(evaluation)
            if straight and evaluation.value > best.value:
                best, p = evaluation, q
        if p is None:
            best, p = (
                dataclasses.replace(start, gait=self._as_series(start.gait)),
                r.loops.fitted(own),
            )
        active = [
            *r.loops.active(p),
            *["singular shapes"] * self.constraints.meets_singular(p, 1 / NEARLY),
            *best.limits,
        ]
        best = dataclasses.replace(best, gait=self._timed(best))
        return Optimum(
            r, best, start, tuple(active), tuple(sorted(answers, reverse=True)), others, self.count,
            time.perf_counter() - self.began,
        )  # fmt: skip

    def _ascended(self, starts: list[np.ndarray], turn: float) -> tuple[list, tuple]:
        """Return the different loops that the starts lead to, each with its number of starts, and (value, starts) of
        those that a table led to and the direct tier did not finish."""
        r, tier = self.request, evaluators.direct(self.request)
        if not r.looks_up:
            return self._different(
                self._optima(tier, starts, turn, None, RUNS if r.by_runs else NEAR)
            ), ()
        tables = evaluators.build_tables(r)
        optima = self._optima(
            evaluators.from_tables(r, *tables),
            starts + self._from_narrower(tables, starts, turn),
            turn,
            tables,
            NEAR,
        )
        if (
            not r.system.traits.odd
        ):  # the table is odd and so does not distinguish the senses
            optima += [series.reversed_(p) for p in optima]
        ranked = self._ranked(tier, optima, turn)
        improved = self._each(
            [p for p, *_ in ranked[:FINISHED]], turn, None, FINISH, TOLERANCE
        )
        better = self._better(turn)
        finished = [(better(q, p), times) for q, (p, times, _) in zip(improved, ranked)]
        k = max(
            range(len(finished)), key=lambda k: self._merit(tier, finished[k][0], turn)
        )
        finished[k] = (
            better(*self._polished(tier, tables, finished[k][0], turn)),
            finished[k][1],
        )
        return finished, tuple((worth, times) for _, times, worth in ranked[FINISHED:])

    def _polished(
        self, tier, tables: tuple, p: np.ndarray, turn: float
    ) -> tuple[np.ndarray, ...]:
        """Return p and the loop it leads to at the phases of evaluations; with several starts from the best
        perturbation of p."""
        loops = [p]
        if self.request.starts > 1:
            near, further = self._perturbed(p)
            near += self._each(further, turn, tables, NEAR, NEAR_TOLERANCE)
            loops += self._each(near, turn, None, 2 * FINISH, TOLERANCE / 10)
        best = max(loops, key=lambda q: self._merit(tier, q, turn))
        return (
            p,
            best,
            *self._each(
                [best], turn, None, POLISH, POLISHED, phases=self.request.phases
            ),
        )

    def _better(self, turn: float) -> Callable:
        """Return a function that projects loops onto the constraints and returns the best."""
        tier = evaluators.direct(self.request, self.request.phases)
        return lambda *loops: max(
            (self._projected(p, turn) for p in loops),
            key=lambda p: self._merit(tier, p, turn),
        )

    def _perturbed(self, p: np.ndarray) -> tuple[list[np.ndarray], list[np.ndarray]]:
        """Return loops next to p, and others further off, without its symmetry.

        An ascent from a symmetric loop ends at the best symmetric one, which may be a saddle; and there are other
        optima about the best."""
        rng, loops = np.random.default_rng(0), self.request.loops
        falling = 1 / np.repeat(np.arange(loops.harmonics + 1), 2)[1:].clip(1)[:, None]
        perturbed = lambda size: self.constraints.feasible(
            loops.fitted(p + size * loops.unit * falling * rng.normal(size=p.shape))
        )
        near, further = (
            [perturbed(size) for _ in range(MORE)] for size in PERTURBATIONS
        )
        return near, further

    def _from_narrower(
        self, tables: tuple, starts: list[np.ndarray], turn: float
    ) -> list[np.ndarray]:
        """Return the best loops within narrower limits, or none for one start.

        The best one there is so far from other optima that a search within the wider limits alone may miss it."""
        if self.request.starts == 1:
            return []
        narrow = dataclasses.replace(
            self.request, loops=self.request.loops.narrower(SHARE)
        )
        starts_inside = [
            self.constraints.feasible(narrow.loops.fitted(p)) for p in starts
        ]
        optima = self._each(starts_inside, turn, tables, NEAR, NEAR_TOLERANCE, narrow)
        return [
            p
            for p, *_ in self._ranked(
                evaluators.from_tables(narrow, *tables), optima, turn
            )[:LED]
        ]

    def _ranked(
        self, tier, loops: list[np.ndarray], turn: float
    ) -> list[tuple[np.ndarray, int, float]]:
        """Return the different loops, the number of starts that led to each and their worth, best first."""
        worth = [
            (p, times, self._merit(tier, p, turn))
            for p, times in self._different(loops)
        ]
        return sorted(worth, key=lambda x: x[2], reverse=True)

    def _optima(
        self, cycles, starts: list[np.ndarray], turn: float, tables, max_steps: int
    ) -> list[np.ndarray]:
        """Return the loop that each start leads to; where there are many optima, the first start is tried in two sizes."""
        other_size = [self._larger(starts[0])] if self._rough else []
        optima = self._each(
            [*starts, *other_size], turn, tables, max_steps, NEAR_TOLERANCE
        )
        if other_size:
            optima[0] = max(
                optima[0], optima.pop(), key=lambda p: self._merit(cycles, p, turn)
            )
        return optima

    def _larger(self, p: np.ndarray) -> np.ndarray:
        """Return the loop in another size: a small one may lead to a poor optimum."""
        size = np.abs(self.request.loops.cycle(p)[0] - p[0]).max()
        return self.constraints.feasible(
            self.request.loops.fitted(
                np.concatenate(
                    [p[:1], p[1:] * LARGER * self.request.loops.half.max() / size]
                )
            )
        )

    def _each(
        self, starts: list[np.ndarray], turn: float, tables, max_steps: int, tolerance: float, r: Request | None = None,
        phases: int | None = None,
    ) -> list[np.ndarray]:  # fmt: skip
        """Return the loop that each start leads to, by tables or else by the direct tier. r, phases: another request,
        other phases."""
        is_single = len(starts) == 1 and not getattr(runner().executor, "remote", False)
        ascent = Ascent(
            r or self.request,
            self.origin,
            turn,
            tables,
            max_steps,
            tolerance,
            self._report if is_single else None,
            phases,
        )
        results, done_before, seconds = (
            [],
            self.completed,
            len(starts) * (ASCENT if tables else FINISHING),
        )
        for p, count in runner().map(
            _ascend_from, ascent, starts, len(starts), seconds
        ):
            results.append(p)
            self.count += count
            self._report(
                max(
                    0,
                    done_before
                    + len(results) * self.cycles_per_ascent
                    - self.completed,
                )
            )  # the same by any executor, however soon it ended
        return results

    def _merit(self, tier, p, turn: float) -> float:
        """Return the value of a loop, less a linear estimate of the loss by turning no more than ``turn``."""
        try:
            b = tier(p)
        except RuntimeError:  # the loop cannot be run
            return -np.inf
        finally:
            self.count += 1
        power = b.power[0] if b.power else None
        timed = self.request.objective.timed
        period = (
            self.request.objective.time(
                np.abs(tier.loops.cycle(p)[1]).max(), power, tier.degree
            )[0]
            if timed
            else 1.0
        )
        value, by = self.request.objective.value(b, period)
        if self.request.objective.straight:
            theta, by_theta = b.net[0][2], b.net[1][2]
            more = theta - np.clip(theta, -turn, turn)
            value -= more * (by * by_theta).sum() / ((by_theta**2).sum() or 1.0)
        return float(value) if np.isfinite(value) else -np.inf

    def _ascend(self, cycles, p, ascent: Ascent) -> np.ndarray:
        before = cycles.count
        p = ascend(
            cycles,
            self.request.objective,
            p,
            turn=ascent.turn,
            max_steps=ascent.max_steps,
            tolerance=ascent.tolerance,
            stroke=self.constraints.stroke,
            singularity=self.request.system.traits.singularity,
            away=self.constraints.away,
            on_cycle=ascent.on_cycle or (lambda: None),
            even=EVEN_AT_LAST if ascent.phases else EVEN,
        )
        self.count += cycles.count - before
        return (
            p if isinstance(self.request.loops, Loops) else self.request.loops.fitted(p)
        )  # loops are projected later

    def _finished(self, p: np.ndarray, turn: float) -> tuple[Evaluation, np.ndarray]:
        """Return the evaluation of the projected loop, and the loop."""
        p = self._projected(self._started_at_mean_heading(p), turn)
        return self._evaluated(self.request.loops.gait(p)), p

    def _projected(self, p: np.ndarray, turn: float) -> np.ndarray:
        """Return a loop near p that satisfies all constraints at the phases of evaluations, and between them."""
        r = self.request
        if not isinstance(r.loops, Loops):
            return p
        cycles = evaluators.direct(r, r.phases)
        with contextlib.suppress(
            RuntimeError
        ):  # raised for a loop nearby that cannot be run
            p = project(
                cycles, r.objective, p, turn=turn, stroke=self.constraints.stroke, singularity=r.system.traits.singularity,
                away=self.constraints.away,
            )  # fmt: skip
        self.count += cycles.count
        return r.loops.fitted(p)  # unchanged, unless no loop nearby is feasible

    def _slack(self, evaluation: Evaluation) -> float:
        """Return the allowed excess of a net turn, rad: roundoff and, where cycles are not those of the search, their
        error."""
        return NO_TURN + (
            evaluation.heading
            if self.request.by_runs
            or self.request.system is not self.request.scene.system
            else 0.0
        )

    def _report(self, cycles: int = 1) -> None:
        self.completed += cycles
        self.expected = max(self.expected, 1.1 * self.completed)
        if self.progress:
            self.progress(self.completed / self.expected)

    def _different(self, loops: list[np.ndarray]) -> list[tuple[np.ndarray, int]]:
        groups: list[list] = []
        for p in loops:
            for group in groups:
                if self._same(p, group[0]):
                    group[1] += 1
                    break
            else:
                groups.append([p, 1])
        return [tuple(group) for group in groups]

    def _same(self, p, q) -> bool:
        loops, system = self.request.loops, self.request.system
        return (
            series.same(p, q, system.traits.mirror, system.traits.odd)
            if isinstance(loops, Loops)
            else loops.same(p, q)
        )

    def _start(self) -> Gait:
        """Return the initial gait, with a note where it is not the scene's."""
        r = self.request
        if r.gait is not r.scene.gait:
            limit = (
                f"{r.loops.within:g} rad"
                if np.ndim(r.loops.within) == 0
                else "its limits"
            )
            note(
                f"{r.scene.name}: its gait reaches beyond {limit}: the search starts from a smaller one"
            )
            return r.loops.gait(self.constraints.first)
        return r.gait

    def _started_at_mean_heading(self, p: np.ndarray) -> np.ndarray:
        """Return the loop; for an objective with a direction, started at the phase where the heading equals its mean."""
        r = self.request
        if not (r.objective.direction and isinstance(r.loops, Loops)) or r.by_runs:
            return p
        for _ in range(3):  # the crossing nearest to the start, refined
            ahead = turning(r.scene.system.run(*r.loops.cycle(p)).xi)
            n, after = len(ahead), np.roll(ahead, -1)
            places = np.flatnonzero(ahead * after <= 0)
            k = places[np.argmin(np.minimum(places, n - places))]
            share = ahead[k] / ((ahead[k] - after[k]) or 1.0)
            p = series.shifted(p, 2 * np.pi / n * (k + share))
        return p

    def _forwards(
        self, evaluation: Evaluation, p: np.ndarray, turn: float
    ) -> tuple[Evaluation, np.ndarray]:
        """Return the gait, or its reverse where it moves against the direction and the reverse is about as good."""
        k = "xy".find(self.request.objective.direction or "-")
        if (
            k < 0
            or evaluation.displacement[k] >= 0
            or not isinstance(self.request.loops, Loops)
        ):
            return evaluation, p
        reverse, q = self._finished(series.reversed_(p), turn)
        return (
            (reverse, q)
            if reverse.value >= evaluation.value * (1 - AS_MUCH)
            else (evaluation, p)
        )

    def _timed(self, evaluation: Evaluation) -> Gait:
        """Return the gait with the frequency that its limits allow."""
        if self.request.objective.timed and 0 < evaluation.time < 1 / (
            2 * np.pi * FASTEST
        ):
            raise Refusal(
                f"its limits let a gait repeat more than {FASTEST:g} times a second",
                instead="lower ``rate``, or ``power``",
            )
        frequency = (
            1 / (2 * np.pi * evaluation.time)
            if self.request.objective.timed and evaluation.time
            else self.request.scene.gait.frequency
        )
        return dataclasses.replace(evaluation.gait, frequency=frequency)

    def _as_series(self, gait: Gait) -> Gait:
        """Return the initial gait as a Fourier series of amplitude 1."""
        if isinstance(self.request.loops, Loops):
            for harmonics in (self.request.loops.harmonics, 16, ENOUGH):
                loops = dataclasses.replace(self.request.loops, harmonics=harmonics)
                series_gait = loops.gait(loops.of(gait))
                if np.abs(series_gait.cycle(512)[0] - gait.cycle(512)[0]).max() < 1e-9:
                    break
            return series_gait
        return gait

    def _evaluated(self, gait: Gait) -> Evaluation:
        self.count += 1
        return evaluate_gait(self.request, gait)


@dataclasses.dataclass(frozen=True, eq=False)
class Ascent:
    """Settings of an ascent.

    origin: the first start. turn (rad): largest net turn of a cycle. tables: from `evaluators.build_tables`, or None
    for the direct tier. on_cycle: called after every cycle, where only one start is computed. phases: of the direct
    tier, where they differ from those of the loops, as in the last ascent."""

    request: Request
    origin: np.ndarray
    turn: float
    tables: tuple | None
    max_steps: int
    tolerance: float
    on_cycle: Callable | None = dataclasses.field(compare=False)
    phases: int | None = None


def _ascend_from(ascent: Ascent, p: np.ndarray) -> tuple[np.ndarray, int]:
    """Return the loop that a start leads to, and the number of cycles."""
    search = _Search(ascent.request, None)
    search.constraints = Constraints(
        ascent.request.loops, ascent.request.system.traits.singularity, ascent.origin
    )
    cycles = (
        evaluators.from_tables(ascent.request, *ascent.tables)
        if ascent.tables
        else evaluators.direct(ascent.request, ascent.phases)
    )
    return search._ascend(cycles, p, ascent), search.count
