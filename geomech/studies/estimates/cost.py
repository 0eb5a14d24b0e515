"""Cost of studies: the force balances and the memory of each part of a request, as a
list of jobs, counted before anything is computed.

Balances are counted as tiers and error estimates (`geomech.studies.estimates.estimate`)
need them.
Where time stepping runs until cycles repeat, the number of cycles is assumed. Seconds
are those of `geomech.runs.cost`. From Python nothing is refused: see
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
    balances_at_rates,
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
from geomech.runs.backend import prefer_backend, preferred
from geomech.runs.cost import BASE, Cost, assumed_seconds
from geomech.scenes.model import Scene
from geomech.studies.estimates import effort, estimate, uncertainty
from geomech.studies.estimates.elements import coarser_systems

# s for each velocity without a balance of forces; measured for built-in systems,
# assumed for others.
SECONDS_PER_CLOSED_FORM = 1e-6
SECONDS_PER_LOOKUP = 2.2e-7  # s for each look-up in a table; measured
SECONDS_PER_NUMBER = 1.1e-9  # s for each number that a look-up sums; measured
ASSUMED_CYCLES = 3  # until cycles repeat
# Time of a step of joints that give way over that of a batch of balances; measured.
COMPLIANT = {"numpy": 3.0, "built": 0.2, "numba": 0.2}
# Copies of a gait's angles and velocities while they are solved and integrated.
CYCLE_COPIES = 14
TABLE_COPIES = 4  # of a table while it is built, interpolated and written
AMPLITUDE_BYTES = 800  # of an amplitude's results by all tiers, as lists and as text
STEPPED_NUMBERS = 60  # stored of each element in time stepping; assumed


class Job(NamedTuple):
    """Part of a request: velocities of one scene.

    count: number of velocities, solved in ``batches``. weight: time of one relative to
    the scene's system as it is. besides: seconds of other work. memory: bytes at the
    peak."""

    scene: Scene
    count: float
    batches: float
    weight: float = 1.0
    besides: float = 0.0
    memory: float = BASE

    def seconds(self, back_end: str = "") -> float:
        """Return the seconds that its balances are assumed to take the preferred back
        end, or another."""
        system = self.scene.system
        points = balance_size(system).evaluations
        batches = self.batches
        if system.traits.compliant:
            batches *= COMPLIANT[back_end or preferred()]
        return assumed_seconds(
            self.weight * self.count,
            points,
            system.traits.linear,
            batches,
            back_end,
        )


def total_cost(jobs: Sequence[Job]) -> Cost:
    """Return the cost of jobs that run one after the other."""
    count = math.ceil(sum(job.count for job in jobs))
    solved = [job for job in jobs if solver_of(job.scene.system) is not None]
    n_closed = sum(job.count for job in jobs) - sum(job.count for job in solved)
    besides = sum(job.besides for job in jobs) + SECONDS_PER_CLOSED_FORM * n_closed
    besides += sum(job.count * _seconds_of_balance(job.scene.system) for job in jobs)
    numpy_seconds = sum(job.seconds("numpy") for job in solved)
    with prefer_backend(numpy_seconds):
        seconds = sum(job.seconds() for job in solved) + besides
    memory = max((job.memory for job in jobs), default=BASE)
    return Cost(count, seconds, memory, besides, numpy_seconds)


def _seconds_of_balance(system: System) -> float:
    """Return the seconds of a balance of a system that knows them; 0 for others."""
    return balance_size(system).seconds or 0.0


def study_jobs(
    scene: Scene,
    plans: Mapping[str, Plan],
    count: int,
    gait: Gait | None = None,
    tables: bool = True,
) -> list[Job]:
    """Return the jobs of `SceneTables.displacements` for ``count`` amplitudes of a
    gait, or the scene's own, by the plans of tiers. tables: False if these are
    stored."""
    gait = gait or scene.gait
    phases = scene.numerics.phases
    jobs: list[Job] = []
    if tables:
        jobs += _shared_table_jobs(scene, plans)

    inexact = [plan for plan in plans.values() if not plan.exact]
    for plan in inexact:
        jobs += _lookup_jobs(scene, plan, count, phases)
    jobs += medium_jobs(scene, gait, count)

    # The errors of look-up tiers are distances from the direct tier: at all amplitudes
    # if that is asked for, else at some of them.
    n_exact = len(plans) - len(inexact)
    if n_exact:
        return jobs + n_exact * direct_jobs(scene, gait, count, phases)
    compared = min(count, estimate.N_COMPARED)
    phases = max(estimate.REFERENCE_PHASES, 8 * gait.harmonics)
    return jobs + len(inexact) * direct_jobs(scene, gait, compared, phases)


def _shared_table_jobs(scene: Scene, plans: Mapping[str, Plan]) -> list[Job]:
    """Return the jobs of the tables of tiers, each table once, and of the frame's
    field."""
    jobs: list[Job] = []
    names = set()
    for plan in sorted(plans.values(), key=lambda plan: -plan.numbers):
        if plan.table and plan.table.name not in names:
            names.add(plan.table.name)
            jobs += table_jobs(scene, plan.table, plan.numbers)
    if "connection" not in names:
        jobs += frame_jobs(scene)
    return jobs


def prediction_jobs(scene: Scene, plan: Plan, count: int) -> list[Job]:
    """Return the jobs of a prediction of ``count`` amplitudes by a tier, with its
    table."""
    jobs: list[Job] = []
    if plan.table:
        jobs += table_jobs(scene, plan.table, plan.numbers)
    return jobs + _lookup_jobs(scene, plan, count, scene.numerics.phases)


def n_balances(plan: Plan, count: int, phases: int) -> int:
    """Return the number of velocities that a tier solves for ``count`` amplitudes at
    ``phases`` phases, with its table."""
    n_table = plan.table.balances if plan.table else 0
    return n_table + plan.balances(count, phases)


def _lookup_jobs(scene: Scene, plan: Plan, count: int, phases: int) -> list[Job]:
    """Return the jobs of a tier besides its table."""
    # The loop that the shape really makes is computed first.
    jobs = loop_jobs(scene, scene.gait, count)
    if not plan.table:
        return jobs + field_jobs(scene, plan.balances(count, phases), BASE)
    seconds_per_lookup = SECONDS_PER_LOOKUP + SECONDS_PER_NUMBER * plan.read
    return [*jobs, Job(scene, 0, 0, besides=seconds_per_lookup * count * phases)]


def loop_jobs(scene: Scene, gait: Gait, count: int) -> list[Job]:
    """Return the jobs of the loops that joints which give way make under ``count``
    amplitudes of a gait; none where the gait prescribes the shape."""
    if not scene.system.traits.compliant:
        return []
    phases = scene.numerics.phases
    return direct_jobs(scene, gait, count, phases, with_error=False)


def field_jobs(scene: Scene, count: float, memory: float) -> list[Job]:
    """Return the jobs of ``count`` velocities at shapes all over the field."""
    return [Job(scene, count, -(-count // SAMPLES_TOGETHER), memory=memory)]


def frame_jobs(scene: Scene) -> list[Job]:
    """Return the jobs of the field that defines a frame such as "minimum-perturbation";
    none for other frames."""
    if not isinstance(scene.system, Framed):
        return []
    return connection_jobs(scene)


def medium_jobs(
    scene: Scene, gait: Gait, count: int, batch_size: int = sys.maxsize
) -> list[Job]:
    """Return the jobs of `uncertainty.medium_spread` for ``count`` amplitudes, at most
    ``batch_size`` in a batch; none for a medium without a covariance."""
    if not uncertainty.is_uncertain(scene.system):
        return []
    phases = max(uncertainty.PHASES, 8 * gait.harmonics)
    n_systems = uncertainty.n_systems(scene.system)
    one_system = direct_jobs(scene, gait, count, phases, batch_size, with_error=False)
    return n_systems * one_system + (n_systems - 1) * frame_jobs(scene)


def direct_jobs(
    scene: Scene,
    gait: Gait,
    count: int,
    phases: int,
    batch_size: int = sys.maxsize,
    with_error: bool = True,
    all_phases: bool = False,
) -> list[Job]:
    """Return the jobs of the direct tier for ``count`` amplitudes, at most
    ``batch_size`` in a batch.

    with_error: with the runs that estimate its error (`estimate.direct`). all_phases:
    all phases are solved, mirror images of others included."""
    system = scene.system
    is_stepping = system.traits.steps
    if with_error:
        least = estimate.MIN_STEPS if is_stepping else 32
        phases = max(least, 8 * -(-phases // 8))
    runs = _direct_runs(scene, phases) if with_error else [(phases, 1.0)]

    group = min(max(1, count), batch_size, gaits_per_batch(system, phases))
    n_groups = -(-count // group)
    cycles = n_cycles(system)
    memory = _direct_memory(system, group, phases) + count * AMPLITUDE_BYTES

    jobs = []
    for n, weight in runs:
        solved = n if all_phases else solved_phases(system, gait, n)
        batches = n_groups
        if is_stepping:  # the balances of each step are a batch
            batches *= cycles * n
        jobs.append(Job(scene, cycles * count * solved, batches, weight, memory=memory))
    if isinstance(system, Framed):  # other models have frames of their own
        jobs += frame_jobs(scene) * n_groups * (len(runs) - 1)
    return jobs


def _direct_memory(system: System, n_gaits: int, phases: int) -> float:
    """Return the bytes that a batch of the direct tier takes."""
    numbers = CYCLE_COPIES * n_gaits * phases * (system.joints + 6)
    if system.traits.steps:
        size = balance_size(system)
        numbers += n_gaits * (STEPPED_NUMBERS * size.elements + size.memory)
    return BASE + 8 * numbers


def n_cycles(system: System) -> int:
    """Return the number of cycles that a gait runs for: assumed where cycles run until
    they repeat, else the setting of time stepping, or one."""
    if settling(system):
        return ASSUMED_CYCLES
    if system.traits.steps:
        return solver_of(system).cycles or 1
    return 1


def _direct_runs(scene: Scene, phases: int) -> list[tuple[int, float]]:
    """Return (phases, weight of a balance) of the runs of `estimate.direct`."""
    system = scene.system
    quarter = phases // 4
    runs = [(phases, 1.0)]
    if system.traits.steps:  # fewer phases are other steps
        runs += [(phases // 2, 1.0), (phases // 4, 1.0), (phases // 8, 1.0)]
    if pieces_per_length(system):  # twice the pieces, half and a quarter of them
        runs += [(quarter, 2.0), (phases, 0.5), (phases, 0.25)]
    runs += [(quarter, 1.0 / other.ratio) for other in coarser_systems(system)]
    if refined(system):  # a finer model
        runs.append((quarter, 1.0))
    return runs


def connection_jobs(scene: Scene) -> list[Job]:
    """Return the jobs of the connection with its CCF."""
    return table_jobs(scene, fitted.table(scene.system, scene.numerics))


def harmonic_jobs(scene: Scene) -> list[Job]:
    """Return the jobs of the harmonics of the velocity."""
    return table_jobs(scene, harmonic.table(scene.system, scene.numerics))


def table_jobs(scene: Scene, table: Table, numbers: int = 0) -> list[Job]:
    """Return the jobs of a table. numbers: stored besides those of the table itself."""
    if table.axes:
        table.axes()  # refuses a field that is too large
    memory = BASE + 8 * TABLE_COPIES * (table.numbers + numbers)
    return field_jobs(scene, table.balances, memory)


def even_part_jobs(scene: Scene) -> list[Job]:
    """Return the jobs of the even part of the velocity (`SceneTables.even_part`): at a
    few shapes, and at all of the field where the velocity is not odd."""
    system = scene.system
    if stored_table(system, "connection"):
        return []
    n_shapes = math.prod(len(axis) for axis in fitted.axes(system, scene.numerics))
    n_solved = EVEN_SHAPES
    if not system.traits.odd:
        n_solved += n_shapes
    n_rates = balances_at_rates(system, EVEN_DIRECTIONS * system.joints)
    count = 2 * n_solved * n_rates
    return field_jobs(scene, count, BASE + 8 * TABLE_COPIES * 3 * n_shapes)


def plane_jobs(
    scene: Scene, pairs: Sequence[tuple[int, int]], origins: Sequence[np.ndarray]
) -> list[Job]:
    """Return the jobs of planes (`SceneTables.plane`) of pairs of joints, each through
    the shape of ``origins``."""
    jobs = []
    for pair, origin in zip(pairs, origins):
        count = fitted.plane_balances(scene.system, scene.numerics, pair, origin)
        jobs += field_jobs(scene, count, BASE)
    return jobs


def metric_jobs(scene: Scene) -> list[Job]:
    """Return the jobs of the metric (`SceneTables.compute_metric`), with the harmonic
    table where both come from the same velocities."""
    system = scene.system
    numerics = scene.numerics
    if stored_table(system, "metric"):
        return []
    if effort.shares_velocities(system):
        return table_jobs(scene, effort.shared_table(system, numerics))

    if system.traits.linear:
        n_rates = system.joints * (system.joints + 1) // 2
    else:
        n_rates = harmonic.directions(system, numerics)
    n_shapes = np.prod([len(axis) for axis in fitted.axes(system, numerics)])
    n_numbers = max(system.joints**2, effort.HIGHEST_HARMONIC + 1)
    memory = BASE + 8 * TABLE_COPIES * float(n_shapes * n_numbers)
    n_balances = n_shapes * balances_at_rates(system, n_rates)
    return field_jobs(scene, float(n_balances), memory)


def effort_jobs(scene: Scene, count: int, gait: Gait | None = None) -> list[Job]:
    """Return the jobs of path length and work (`effort.effort`) of ``count`` amplitudes
    of a gait, or the scene's own, with the runs that estimate their error."""
    system = scene.system
    gait = gait or scene.gait
    phases = effort.effort_phases(scene)

    def run(n: int) -> list[Job]:
        return direct_jobs(scene, gait, count, n, with_error=False)

    jobs = run(phases)
    if system.traits.steps:  # fewer phases are other steps
        jobs += run(phases // 2) + run(phases // 4)

    weights = [1.0 / other.ratio for other in coarser_systems(system)]
    if pieces_per_length(system):  # twice the pieces
        weights.append(2.0)
    for weight in weights:
        jobs += [job._replace(weight=weight) for job in run(phases // 4)]
    return jobs
