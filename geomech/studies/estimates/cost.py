"""Cost of studies, counted beforehand: force balances and memory of each part of a request, a list of jobs.

Balances are counted as tiers and estimates (`geomech.studies.estimates.estimate`) need them; where time stepping goes on until
cycles repeat, their number is assumed. Seconds are those of `geomech.run.cost`. From Python nothing is refused: see
`SceneTables.cost`."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from geomech.mathematics.gaits import Gait
from geomech.mathematics.geometry.connection import (
    EVEN_DIRECTIONS,
    EVEN_SHAPES,
    SAMPLES_TOGETHER,
)
from geomech.mathematics.systems.base import System
from geomech.mathematics.systems.capabilities import (
    balance_size,
    gaits_per_batch,
    pieces_per_length,
    refined,
    settling,
    solver_of,
    stored_table,
)
from geomech.mathematics.systems.framed import Framed
from geomech.mathematics.tiers import fitted, harmonic
from geomech.mathematics.tiers.base import Plan, Table, solved_phases
from geomech.run.backend import prefer_backend
from geomech.run.cost import BASE, Cost, assumed_seconds
from geomech.scenes.model import Scene
from geomech.studies.estimates import effort, estimate, uncertainty
from geomech.studies.estimates.elements import coarser_systems

SECONDS_PER_CLOSED_FORM = 1e-6  # s of a velocity without balance of forces, measured for built-in systems, assumed for others
SECONDS_PER_LOOKUP, SECONDS_PER_NUMBER = (
    2.2e-7,
    1.1e-9,
)  # s for each look-up in a table, and for each number that it sums; measured
ASSUMED_CYCLES = 3  # until they repeat, assumed
CYCLE_COPIES = (
    14  # of the angles and velocities of a gait while they are solved and integrated
)
TABLE_COPIES = 4  # of a table while it is built, interpolated and written
AMPLITUDE_BYTES = (
    800  # bytes of an amplitude's results by all tiers, as lists and as text
)


class Job(NamedTuple):
    """Part of a request.

    count: number of velocities, solved in ``batches``. weight: of one, relative to the scene's system as it is.
    besides: seconds of other work. memory: bytes at the peak."""

    scene: Scene
    count: float
    batches: float
    weight: float = 1.0
    besides: float = 0.0
    memory: float = BASE


def total_cost(jobs: Sequence[Job]) -> Cost:
    """Return the cost of jobs that are done one after the other."""
    balances, seconds, besides = (
        math.ceil(sum(job.count for job in jobs)),
        0.0,
        sum(job.besides for job in jobs),
    )
    steps = sum(job.batches for job in jobs if job.scene.system.traits.steps)
    with prefer_backend(Cost(balances, 0.0, 0.0, steps=steps).as_balances):
        for job in jobs:
            system = job.scene.system
            if solver_of(system) is None:
                besides += SECONDS_PER_CLOSED_FORM * job.count
            else:
                points = balance_size(system).evaluations
                seconds += assumed_seconds(
                    job.weight * job.count, points, system.traits.linear, job.batches
                )
    return Cost(
        balances,
        seconds + besides,
        max((job.memory for job in jobs), default=BASE),
        besides,
        steps,
    )


def study_jobs(
    scene: Scene,
    plans: Mapping[str, Plan],
    count: int,
    gait: Gait | None = None,
    tables: bool = True,
) -> list[Job]:
    """Return the jobs of `SceneTables.study` for ``count`` amplitudes of a gait, or the scene's own, by plans of tiers;
    without tables if these are stored."""
    gait, phases = gait or scene.gait, scene.numerics.phases
    jobs, names = [], set()
    for plan in sorted(plans.values(), key=lambda plan: -plan.numbers):
        if tables and plan.table and plan.table.name not in names:
            names.add(plan.table.name)
            jobs += table_jobs(scene, plan.table, plan.numbers)
    jobs += frame_jobs(scene) if tables and "connection" not in names else []
    guesses = [plan for plan in plans.values() if not plan.exact]
    for plan in guesses:
        jobs += _lookup_jobs(scene, plan, count, phases)
    jobs += medium_jobs(scene, gait, count)
    if len(guesses) < len(plans):
        return jobs + (len(plans) - len(guesses)) * direct_jobs(
            scene, gait, count, phases
        )
    fewer = max(estimate.REFERENCE_PHASES, 8 * gait.harmonics)
    return jobs + len(guesses) * direct_jobs(
        scene, gait, min(count, estimate.N_COMPARED), fewer
    )


def prediction_jobs(scene: Scene, plan: Plan, count: int) -> list[Job]:
    """Return the jobs of a prediction of ``count`` amplitudes by a tier, with its table."""
    table = table_jobs(scene, plan.table, plan.numbers) if plan.table else []
    return table + _lookup_jobs(scene, plan, count, scene.numerics.phases)


def n_balances(plan: Plan, count: int, phases: int) -> int:
    """Return the number of velocities for a prediction of ``count`` amplitudes at so many phases, with its table."""
    return (plan.table.balances if plan.table else 0) + plan.balances(count, phases)


def _lookup_jobs(scene: Scene, plan: Plan, count: int, phases: int) -> list[Job]:
    """Return the jobs of a tier besides its table."""
    if plan.table:
        return [
            Job(
                scene,
                0,
                0,
                besides=(SECONDS_PER_LOOKUP + SECONDS_PER_NUMBER * plan.read)
                * count
                * phases,
            )
        ]
    return field_jobs(scene, plan.balances(count, phases), BASE)


def field_jobs(scene: Scene, count: float, memory: float) -> list[Job]:
    """Return the jobs of velocities at shapes all over the field."""
    return [Job(scene, count, -(-count // SAMPLES_TOGETHER), memory=memory)]


def frame_jobs(scene: Scene) -> list[Job]:
    """Return the jobs of the field that defines a frame, as "minimum-perturbation" has one."""
    return connection_jobs(scene) if isinstance(scene.system, Framed) else []


def medium_jobs(
    scene: Scene, gait: Gait, count: int, together: int = sys.maxsize
) -> list[Job]:
    """Return the jobs of an uncertain medium for ``count`` amplitudes (`uncertainty.medium_spread`), at most ``together``
    in a batch."""
    if not uncertainty.is_uncertain(scene.system):
        return []
    phases, points = (
        max(uncertainty.PHASES, 8 * gait.harmonics),
        uncertainty.n_systems(scene.system),
    )
    return points * direct_jobs(scene, gait, count, phases, together, checked=False) + (
        points - 1
    ) * frame_jobs(scene)


def direct_jobs(
    scene: Scene, gait: Gait, count: int, phases: int, together: int = sys.maxsize, checked: bool = True,
    all_phases: bool = False,
) -> list[Job]:  # fmt: skip
    """Return the jobs of the direct tier for ``count`` amplitudes, at most ``together`` in a batch, with its estimate
    of the error (`estimate.direct`) if ``checked``. all_phases: balances are solved at all phases, at mirror images,
    too."""
    system, stepping = scene.system, scene.system.traits.steps
    if checked:
        phases = max(estimate.MIN_STEPS if stepping else 32, 8 * -(-phases // 8))
    group = min(max(1, count), together, gaits_per_batch(system, phases))
    size = balance_size(system)
    stored = group * (60 * size.elements + size.memory) if stepping else 0
    memory = (
        BASE
        + 8 * (CYCLE_COPIES * group * phases * (system.joints + 6) + stored)
        + count * AMPLITUDE_BYTES
    )
    solves = (lambda n: n) if all_phases else (lambda n: solved_phases(system, gait, n))
    runs = _direct_runs(scene, phases) if checked else [(phases, 1.0)]
    groups, cycles = -(-count // group), n_cycles(system)
    jobs = [
        Job(
            scene,
            cycles * count * solves(n),
            groups * (cycles * n if stepping else 1),
            weight,
            memory=memory,
        )
        for n, weight in runs
    ]
    return jobs + (
        frame_jobs(scene) * groups * (len(runs) - 1)
        if isinstance(system, Framed)
        else []
    )  # other models have frames of their own


def n_cycles(system: System) -> int:
    """Return the number of cycles that a gait is run for: the setting, one where every cycle differs, else an
    assumption."""
    return (
        ASSUMED_CYCLES
        if settling(system)
        else (system.traits.steps and solver_of(system).cycles) or 1
    )


def _direct_runs(scene: Scene, phases: int) -> list[tuple[int, float]]:
    """Return (phases, weight of a balance) of the runs of `estimate.direct`: time stepping again at a half, a quarter and an
    eighth of the phases, a quarter with a finer model where there is one, with half and a quarter of the elements of a
    continuous body likewise, and where effects cut the body, twice as many pieces at a quarter of the phases, and half and
    a quarter of them at all."""
    quarter, system = phases // 4, scene.system
    runs = [(phases, 1.0)]
    runs += [(phases // k, 1.0) for k in (2, 4, 8)] if system.traits.steps else []
    runs += (
        [(quarter, 2.0), (phases, 0.5), (phases, 0.25)]
        if pieces_per_length(system)
        else []
    )
    runs += [(quarter, 1.0 / other.ratio) for other in coarser_systems(system)]
    return runs + ([(quarter, 1.0)] if refined(system) else [])


def connection_jobs(scene: Scene) -> list[Job]:
    """Return the jobs of the connection with its CCF."""
    return table_jobs(scene, fitted.table(scene.system, scene.numerics))


def harmonic_jobs(scene: Scene) -> list[Job]:
    """Return the jobs of the harmonics of the velocity."""
    return table_jobs(scene, harmonic.table(scene.system, scene.numerics))


def table_jobs(scene: Scene, table: Table, numbers: int = 0) -> list[Job]:
    """Return the jobs of a table. numbers: stored besides."""
    if table.axes:
        table.axes()  # refuses a field that is too large
    return field_jobs(
        scene, table.balances, BASE + 8 * TABLE_COPIES * (table.numbers + numbers)
    )


def even_part_jobs(scene: Scene) -> list[Job]:
    """Return the jobs of the even part of the velocity (`SceneTables.even_part`): at a few shapes, and at all where it is not
    odd."""
    system = scene.system
    if stored_table(system, "connection"):
        return []
    shapes = math.prod(len(a) for a in fitted.axes(system, scene.numerics))
    looked_at = EVEN_SHAPES + (0 if system.traits.odd else shapes)
    return field_jobs(
        scene,
        2 * looked_at * EVEN_DIRECTIONS * system.joints,
        BASE + 8 * TABLE_COPIES * 3 * shapes,
    )


def plane_jobs(
    scene: Scene, pairs: Sequence[tuple[int, int]], at: Sequence
) -> list[Job]:
    """Return the jobs of planes of pairs of joints through shapes (`SceneTables.plane`)."""
    balances = [
        fitted.plane_balances(scene.system, scene.numerics, *one)
        for one in zip(pairs, at)
    ]
    return [job for count in balances for job in field_jobs(scene, count, BASE)]


def metric_jobs(scene: Scene) -> list[Job]:
    """Return the jobs of the metric, with the harmonic table where they share velocities (`SceneTables.compute_metric`)."""
    system, n = scene.system, scene.numerics
    if stored_table(system, "metric"):
        return []
    if effort.shares_velocities(system):
        return table_jobs(scene, effort.shared_table(system, n))
    rates = (
        system.joints * (system.joints + 1) // 2
        if system.traits.linear
        else harmonic.directions(system, n)
    )
    count, numbers = (
        np.prod([len(a) for a in fitted.axes(system, n)]),
        max(system.joints**2, effort.HIGHEST_HARMONIC + 1),
    )
    return field_jobs(
        scene, float(count * rates), BASE + 8 * TABLE_COPIES * float(count * numbers)
    )


def effort_jobs(scene: Scene, count: int, gait: Gait | None = None) -> list[Job]:
    """Return the jobs of path length and work of ``count`` amplitudes (`effort.effort`): for time stepping again at
    half and a quarter of the phases, and at a quarter with twice the pieces, or fewer elements of a continuous body."""
    phases, system = effort.effort_phases(scene), scene.system
    once = lambda n: direct_jobs(scene, gait or scene.gait, count, n, checked=False)
    jobs = once(phases)
    jobs += once(phases // 2) + once(phases // 4) if system.traits.steps else []
    weights = [1.0 / other.ratio for other in coarser_systems(system)]
    weights += [2.0] if pieces_per_length(system) else []
    return jobs + [
        job._replace(weight=weight) for weight in weights for job in once(phases // 4)
    ]
