"""The search for the best gait of a scene.

Tables are used where these are near and cheap; the direct tier finishes the search."""

from __future__ import annotations

import contextlib
import dataclasses
import time
from collections.abc import Callable

import numpy as np

from geomech.io.files import note
from geomech.mathematics.gaits import Gait
from geomech.mathematics.geometry.connection import check_fit_options
from geomech.mathematics.geometry.gait import FASTEST
from geomech.mathematics.geometry.reconstruct import turning
from geomech.runs.runner import runner
from geomech.scenes.model import Scene
from geomech.studies.optimisation import evaluators
from geomech.studies.optimisation import loops as series
from geomech.studies.optimisation.evaluate import Evaluation, evaluate_gait
from geomech.studies.optimisation.limits import LimitsArgument
from geomech.studies.optimisation.local.ascent import TRIES, ascend, project
from geomech.studies.optimisation.local.constraints import NEARLY, Constraints
from geomech.studies.optimisation.local.problem import EVEN
from geomech.studies.optimisation.loops import Loops
from geomech.studies.optimisation.optimum import Optimum
from geomech.studies.optimisation.request import (
    DIRECT_STEPS,
    LAST_STEPS,
    N_FROM_NARROWER,
    N_IMPROVED,
    N_PERTURBED,
    NARROWER_LIMITS,
    PERTURBATIONS,
    RUN_STEPS,
    SECONDS_PER_ASCENT,
    TABLE_STEPS,
    Request,
    build_request,
)
from rft.core.refusal import Refusal, located

# Change of the value in a step at which an ascent ends: in tables, by the direct tier,
# and at last by the direct tier at the phases of evaluations.
TABLE_TOLERANCE = 1e-7
DIRECT_TOLERANCE = 1e-5
LAST_TOLERANCE = 1e-7
LAST_EVEN = EVEN / 10  # weight of even pacing in the last ascent
NO_TURN = 1e-7  # rad: smaller net turns count as 0
REVERSE_LOSS = 1e-3  # of the value: a reverse that loses less counts as good
LARGER = 0.6  # of the range: size of the scene's gait as a second start
SECONDS_PER_DIRECT_ASCENT = 1.0  # of other work, likewise
SERIES_HARMONICS = 64  # suffice for any initial gait
SERIES_ERROR = 1e-9  # rad: of a series that stands for a gait
Ranked = tuple[np.ndarray, int, float]  # a loop, its number of starts, its value


def optimise(
    scene: Scene,
    objective: str = "displacement",
    direction: str | None = None,
    harmonics: int | None = None,
    limits: LimitsArgument = None,
    starts: int | None = None,
    *,
    rate: float | None = None,
    power: float | None = None,
    progress: Callable | None = None,
) -> Optimum:
    """Return the gait of a scene with the largest displacement, efficiency, turning or
    speed (`Objective`).

    It is searched among Fourier series of ``harmonics`` (5) with every shape variable
    within ``limits`` (the field's extent) of 0, or between (lowest, highest) for each,
    from the scene's own gait and ``starts`` - 1 others. By default there are no others,
    except for two joints in a dry medium, which have many local optima: there the
    `OUTLINES` of the limits are used. For a sine, sines are searched. rate, power:
    limits for the objective "speed". Refusal for a request that makes no sense.

    Examples
    --------
    >>> from geomech.studies.optimisation import optimise
    >>> from geomech.scenes import load
    >>> best = optimise(load("three-link-viscous"), "efficiency", harmonics=1, starts=1)
    >>> round(best.value, 3)  # displacement over path length
    0.11
    """
    request = build_request(
        scene, objective, direction, harmonics, limits, starts, rate, power
    )
    return search(request, progress)


def search(request: Request, progress: Callable | None = None) -> Optimum:
    """Return the result of `optimise` for a checked request.

    Examples
    --------
    >>> from geomech.studies.optimisation import build_request, search
    >>> from geomech.scenes import load
    >>> scene = load("three-link-viscous")
    >>> found = search(build_request(scene, "efficiency", harmonics=1, starts=1))
    >>> round(found.value, 3)  # displacement over path length
    0.11
    """
    check_fit_options(1, progress)
    with located(request.scene.name):
        return _Search(request, progress).optimum()


class _Search:
    """One search, with its number of cycles."""

    def __init__(self, request: Request, progress: Callable | None):
        self.request = request
        self.progress = progress
        self.began = time.perf_counter()
        self.count = 0
        self.completed = 0
        ascents = request.ascents + self._rough
        steps = RUN_STEPS if request.uses_runs else DIRECT_STEPS
        self.cycles_per_ascent = TRIES * steps  # a rough estimate
        self.expected = ascents * self.cycles_per_ascent

    @property
    def _rough(self) -> bool:
        """Whether there are many local optima."""
        request = self.request
        return request.uses_tables or request.system.traits.singularity is not None

    def optimum(self) -> Optimum:
        """Return the result of the search."""
        request = self.request
        singularity = request.system.traits.singularity
        own = request.loops.from_gait(request.scene.gait)
        self.origin, *more_starts = request.loops.starts(own, request.starts)
        self.constraints = Constraints(request.loops, singularity, self.origin)

        start = self._evaluated(self._start())
        self._timed(start)  # refuses impossible frequencies
        turn = abs(float(start.displacement[2]))
        starts = [self.constraints.first]
        starts += [self.constraints.feasible(p) for p in more_starts]
        loops, others = self._ascended(starts, turn)

        best = start
        best_loop = None
        answers = []
        for p, times in loops:
            if self.constraints.meets_singular(p, NEARLY):
                continue
            evaluation, p = self._finished(p, turn)
            evaluation, p = self._forwards(evaluation, p, turn)
            answers.append((evaluation.value, times))
            is_allowed = self._turns_no_more(evaluation, turn)
            if is_allowed and evaluation.value > best.value:
                best = evaluation
                best_loop = p
        if best_loop is None:
            best = dataclasses.replace(start, gait=self._as_series(start.gait))
            best_loop = request.loops.fitted(own)

        active = request.loops.active(best_loop)
        if self.constraints.meets_singular(best_loop, 1 / NEARLY):
            active.append("singular shapes")
        active += best.limits
        best = dataclasses.replace(best, gait=self._timed(best))
        return Optimum(
            request,
            best,
            start,
            tuple(active),
            tuple(sorted(answers, reverse=True)),
            others,
            self.count,
            time.perf_counter() - self.began,
        )

    def _turns_no_more(self, evaluation: Evaluation, turn: float) -> bool:
        """Return whether a gait turns no more than ``turn``, where that is asked
        for."""
        if not self.request.objective.straight:
            return True
        return abs(evaluation.displacement[2]) <= turn + self._slack(evaluation)

    def _ascended(self, starts: list[np.ndarray], turn: float) -> tuple[list, tuple]:
        """Return the different loops that the starts lead to, each with its number of
        starts, and (value, starts) of the optima that a table led to and the direct
        tier did not finish."""
        request = self.request
        tier = evaluators.direct(request)
        if not request.uses_tables:
            steps = RUN_STEPS if request.uses_runs else TABLE_STEPS
            optima = self._optima(tier, starts, turn, None, steps)
            return self._different(optima), ()

        # Optima by tables: from the starts, and from the optima within narrower limits.
        tables = evaluators.build_tables(request)
        table_tier = evaluators.from_tables(request, *tables)
        starts = starts + self._from_narrower(tables, starts, turn)
        optima = self._optima(table_tier, starts, turn, tables, TABLE_STEPS)
        if not request.system.traits.odd:
            # The table is odd and so does not distinguish the senses.
            optima += [series.reversed_loop(p) for p in optima]
        ranked = self._ranked(tier, optima, turn)

        # The direct tier improves the first few, and the best of them once more.
        first = [p for p, *_ in ranked[:N_IMPROVED]]
        improved = self._each(first, turn, None, DIRECT_STEPS, DIRECT_TOLERANCE)
        better = self._better(turn)
        loops = [better(q, p) for q, p in zip(improved, first)]
        times = [times for _, times, _ in ranked[:N_IMPROVED]]
        k = max(range(len(loops)), key=lambda k: self._merit(tier, loops[k], turn))
        loops[k] = better(*self._polished(tier, tables, loops[k], turn))

        unfinished = tuple((value, times) for _, times, value in ranked[N_IMPROVED:])
        return list(zip(loops, times)), unfinished

    def _polished(
        self, tier, tables: tuple, p: np.ndarray, turn: float
    ) -> tuple[np.ndarray, ...]:
        """Return p, the best loop near it, and the loop that an ascent at the phases of
        evaluations reaches from there; with several starts the loops near p include
        those reached from its perturbations."""
        request = self.request
        loops = [p]
        if request.starts > 1:
            near, further = self._perturbed(p)
            near += self._each(further, turn, tables, TABLE_STEPS, TABLE_TOLERANCE)
            tolerance = DIRECT_TOLERANCE / 10
            loops += self._each(near, turn, None, 2 * DIRECT_STEPS, tolerance)
        best = max(loops, key=lambda q: self._merit(tier, q, turn))
        last = self._each(
            [best], turn, None, LAST_STEPS, LAST_TOLERANCE, phases=request.phases
        )
        return (p, best, *last)

    def _better(self, turn: float) -> Callable:
        """Return a function that projects loops onto the constraints and returns the
        best."""
        tier = evaluators.direct(self.request, self.request.phases)

        def better(*loops):
            projected = [self._projected(p, turn) for p in loops]
            return max(projected, key=lambda p: self._merit(tier, p, turn))

        return better

    def _perturbed(self, p: np.ndarray) -> tuple[list[np.ndarray], list[np.ndarray]]:
        """Return loops next to p, and others further off, without its symmetry.

        An ascent from a symmetric loop ends at the best symmetric one, which may be a
        saddle; and there are other optima about the best."""
        loops = self.request.loops
        rng = np.random.default_rng(0)
        order = np.repeat(np.arange(loops.harmonics + 1), 2)[1:].clip(1)
        falling = 1 / order[:, None]

        def perturbed(size):
            change = size * loops.unit * falling * rng.normal(size=p.shape)
            return self.constraints.feasible(loops.fitted(p + change))

        near_size, further_size = PERTURBATIONS
        near = [perturbed(near_size) for _ in range(N_PERTURBED)]
        further = [perturbed(further_size) for _ in range(N_PERTURBED)]
        return near, further

    def _from_narrower(
        self, tables: tuple, starts: list[np.ndarray], turn: float
    ) -> list[np.ndarray]:
        """Return the best loops within narrower limits, or none for one start.

        The best one there is so far from other optima that a search within the wider
        limits alone may miss it."""
        request = self.request
        if request.starts == 1:
            return []
        loops = request.loops.narrower(NARROWER_LIMITS)
        narrow = dataclasses.replace(request, loops=loops)
        inside = [self.constraints.feasible(loops.fitted(p)) for p in starts]
        optima = self._each(inside, turn, tables, TABLE_STEPS, TABLE_TOLERANCE, narrow)
        tier = evaluators.from_tables(narrow, *tables)
        ranked = self._ranked(tier, optima, turn)
        return [p for p, *_ in ranked[:N_FROM_NARROWER]]

    def _ranked(self, tier, loops: list[np.ndarray], turn: float) -> list[Ranked]:
        """Return the different loops, the number of starts that led to each and their
        values, best first."""
        ranked = [
            (p, times, self._merit(tier, p, turn))
            for p, times in self._different(loops)
        ]
        return sorted(ranked, key=lambda row: row[2], reverse=True)

    def _optima(
        self, cycles, starts: list[np.ndarray], turn: float, tables, max_steps: int
    ) -> list[np.ndarray]:
        """Return the loop that each start leads to; where there are many optima, the
        first start is tried in two sizes."""
        if not self._rough:
            return self._each(starts, turn, tables, max_steps, TABLE_TOLERANCE)
        starts = [*starts, self._larger(starts[0])]
        first, *others, larger = self._each(
            starts, turn, tables, max_steps, TABLE_TOLERANCE
        )
        best = max(first, larger, key=lambda p: self._merit(cycles, p, turn))
        return [best, *others]

    def _larger(self, p: np.ndarray) -> np.ndarray:
        """Return the loop in another size: a small one may lead to a poor optimum."""
        loops = self.request.loops
        size = np.abs(loops.cycle(p)[0] - p[0]).max()
        resized = p[1:] * LARGER * loops.half.max() / size
        larger = loops.fitted(np.concatenate([p[:1], resized]))
        return self.constraints.feasible(larger)

    def _each(
        self,
        starts: list[np.ndarray],
        turn: float,
        tables,
        max_steps: int,
        tolerance: float,
        request: Request | None = None,
        phases: int | None = None,
    ) -> list[np.ndarray]:
        """Return the loop that each start leads to, by tables or else by the direct
        tier.

        request, phases: another request, other phases."""
        is_single = len(starts) == 1 and not getattr(runner().executor, "remote", False)
        ascent = Ascent(
            request or self.request,
            self.origin,
            turn,
            tables,
            max_steps,
            tolerance,
            self._report if is_single else None,
            phases,
        )
        seconds = SECONDS_PER_ASCENT if tables else SECONDS_PER_DIRECT_ASCENT
        ascents = runner().map(
            _ascend_from, ascent, starts, len(starts), len(starts) * seconds
        )
        completed_before = self.completed
        loops = []
        for p, count in ascents:
            loops.append(p)
            self.count += count
            # An ascent counts the same by any executor, however soon it ended.
            completed = completed_before + len(loops) * self.cycles_per_ascent
            self._report(max(0, completed - self.completed))
        return loops

    def _merit(self, tier, p, turn: float) -> float:
        """Return the value of a loop, less a linear estimate of the loss by turning no
        more than ``turn``; -inf for a loop that cannot be run."""
        objective = self.request.objective
        try:
            cycle = tier(p)
        except RuntimeError:  # the loop cannot be run
            return -np.inf
        finally:
            self.count += 1

        period = 1.0
        if objective.timed:
            fastest = np.abs(tier.loops.cycle(p)[1]).max()
            power = None
            if cycle.power:
                power, _ = cycle.power
            period, _ = objective.time(fastest, power, tier.degree)
        value, by_p = objective.value(cycle, period)
        if objective.straight:
            theta = cycle.net[0][2]
            theta_by_p = cycle.net[1][2]
            excess = theta - np.clip(theta, -turn, turn)
            square = (theta_by_p**2).sum() or 1.0
            value -= excess * (by_p * theta_by_p).sum() / square
        if not np.isfinite(value):
            return -np.inf
        return float(value)

    def _ascend(self, cycles, p, ascent: Ascent) -> np.ndarray:
        """Return the loop that an ascent from p reaches, and count its cycles."""
        count_before = cycles.count
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
            even=LAST_EVEN if ascent.phases else EVEN,
        )
        self.count += cycles.count - count_before
        if isinstance(self.request.loops, Loops):
            return p  # projected later
        return self.request.loops.fitted(p)

    def _finished(self, p: np.ndarray, turn: float) -> tuple[Evaluation, np.ndarray]:
        """Return the evaluation of the projected loop, and the loop."""
        p = self._projected(self._started_at_mean_heading(p), turn)
        return self._evaluated(self.request.loops.gait(p)), p

    def _projected(self, p: np.ndarray, turn: float) -> np.ndarray:
        """Return a loop near p that satisfies all constraints at the phases of
        evaluations, and between them."""
        request = self.request
        if not isinstance(request.loops, Loops):
            return p
        cycles = evaluators.direct(request, request.phases)
        # A loop nearby that cannot be run raises RuntimeError.
        with contextlib.suppress(RuntimeError):
            p = project(
                cycles,
                request.objective,
                p,
                turn=turn,
                stroke=self.constraints.stroke,
                singularity=request.system.traits.singularity,
                away=self.constraints.away,
            )
        self.count += cycles.count
        return request.loops.fitted(p)  # unchanged, unless no loop nearby is feasible

    def _slack(self, evaluation: Evaluation) -> float:
        """Return the allowed excess of a net turn, rad: roundoff and, where cycles are
        not those of the search, their error."""
        request = self.request
        if request.uses_runs or request.system is not request.scene.system:
            return NO_TURN + evaluation.displacement_error[2]
        return NO_TURN

    def _report(self, cycles: int = 1) -> None:
        """Report the progress after more cycles."""
        self.completed += cycles
        self.expected = max(self.expected, 1.1 * self.completed)
        if self.progress:
            self.progress(self.completed / self.expected)

    def _different(self, loops: list[np.ndarray]) -> list[tuple[np.ndarray, int]]:
        """Return the loops that differ, the first of each, and how often each
        occurs."""
        groups: list[list] = []
        for p in loops:
            for group in groups:
                if self._is_same(p, group[0]):
                    group[1] += 1
                    break
            else:
                groups.append([p, 1])
        return [tuple(group) for group in groups]

    def _is_same(self, p, q) -> bool:
        """Return whether two loops have the same value by their shape."""
        loops = self.request.loops
        if not isinstance(loops, Loops):
            return loops.is_same(p, q)
        traits = self.request.system.traits
        return series.is_same(p, q, traits.mirror, traits.odd)

    def _start(self) -> Gait:
        """Return the initial gait, with a note where it is not the scene's."""
        request = self.request
        if request.gait is request.scene.gait:
            return request.gait
        limit = "its limits"
        if np.ndim(request.loops.within) == 0:
            limit = f"{request.loops.within:g} rad"
        note(
            f"{request.scene.name}: its gait exceeds {limit}: the search starts from "
            "a smaller one"
        )
        return request.loops.gait(self.constraints.first)

    def _started_at_mean_heading(self, p: np.ndarray) -> np.ndarray:
        """Return the loop; for an objective with a direction, started at the phase
        where the heading equals its mean."""
        request = self.request
        if not request.objective.direction or not isinstance(request.loops, Loops):
            return p
        if request.uses_runs:
            return p
        for _ in range(3):  # the crossing nearest to the start, refined
            alpha, alphadot = request.loops.cycle(p)
            heading = turning(request.scene.system.run(alpha, alphadot).xi)
            following = np.roll(heading, -1)
            n = len(heading)
            crossings = np.flatnonzero(heading * following <= 0)
            k = crossings[np.argmin(np.minimum(crossings, n - crossings))]
            share = heading[k] / ((heading[k] - following[k]) or 1.0)
            p = series.shifted(p, 2 * np.pi / n * (k + share))
        return p

    def _forwards(
        self, evaluation: Evaluation, p: np.ndarray, turn: float
    ) -> tuple[Evaluation, np.ndarray]:
        """Return the gait, or its reverse where it moves against the direction and the
        reverse is about as good."""
        direction = self.request.objective.direction
        if not direction or not isinstance(self.request.loops, Loops):
            return evaluation, p
        if evaluation.displacement["xy".index(direction)] >= 0:
            return evaluation, p
        reverse, q = self._finished(series.reversed_loop(p), turn)
        if reverse.value >= evaluation.value * (1 - REVERSE_LOSS):
            return reverse, q
        return evaluation, p

    def _timed(self, evaluation: Evaluation) -> Gait:
        """Return the gait with the frequency that its limits allow."""
        frequency = self.request.scene.gait.frequency
        if self.request.objective.timed and evaluation.time:
            if 0 < evaluation.time < 1 / (2 * np.pi * FASTEST):
                raise Refusal(
                    f"its limits let a gait repeat more than {FASTEST:g} times per "
                    "second",
                    instead="lower ``rate``, or ``power``",
                )
            frequency = 1 / (2 * np.pi * evaluation.time)
        return dataclasses.replace(evaluation.gait, frequency=frequency)

    def _as_series(self, gait: Gait) -> Gait:
        """Return the initial gait as a Fourier series of amplitude 1."""
        if not isinstance(self.request.loops, Loops):
            return gait
        for harmonics in (self.request.loops.harmonics, 16, SERIES_HARMONICS):
            loops = dataclasses.replace(self.request.loops, harmonics=harmonics)
            as_series = loops.gait(loops.from_gait(gait))
            error = np.abs(as_series.cycle(512)[0] - gait.cycle(512)[0]).max()
            if error < SERIES_ERROR:
                break
        return as_series

    def _evaluated(self, gait: Gait) -> Evaluation:
        """Return the evaluation of a gait, and count it."""
        self.count += 1
        return evaluate_gait(self.request, gait)


@dataclasses.dataclass(frozen=True, eq=False)
class Ascent:
    """Settings of an ascent.

    origin: the first start. turn (rad): largest net turn of a cycle. tables: from
    `evaluators.build_tables`, or None for the direct tier. on_cycle: called after every
    cycle, where only one start is computed. phases: of the direct tier, where they
    differ from those of the loops, as in the last ascent."""

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
    request = ascent.request
    singularity = request.system.traits.singularity
    search = _Search(request, None)
    search.constraints = Constraints(request.loops, singularity, ascent.origin)
    if ascent.tables:
        cycles = evaluators.from_tables(request, *ascent.tables)
    else:
        cycles = evaluators.direct(request, ascent.phases)
    return search._ascend(cycles, p, ascent), search.count
