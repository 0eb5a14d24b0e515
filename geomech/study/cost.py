"""What a request costs, foretold: force balances, seconds and memory, from a pilot of the very scene on this machine.

A request is a list of jobs, counted as the tiers ask for them (`geomech.study.estimate`); `price` solves a few balances of each
kind, then more, until it can tell what one takes. Jobs too small to matter are not piloted. Seconds are of computing, so
that other work on the machine does not count. From Python nothing is refused: ask `Study.cost`, and decide.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from geomech.core.errors import SceneError
from geomech.gaits import Gait
from geomech.geometry.connection import SAMPLES_TOGETHER
from geomech.run.backend import suiting
from geomech.run.jobs import unaided
from geomech.scene.model import Scene
from geomech.study import effort, estimate, uncertainty
from geomech.systems.capabilities import Dissipative, at_once, capability, costed, pieces_of, refined, stored
from geomech.systems.framed import Framed
from geomech.tiers import fitted, harmonic
from geomech.tiers.base import Plan, Table, solved

LONGEST = 60.0  # s of computing that a command takes up without being told to
LARGEST = 2e9  # bytes of memory, likewise
WORTH_SAYING = 5.0  # s
PILOT = 0.05  # s after which a pilot has seen enough
FREE = (
    2.0  # s below which there is no pilot, if a balance took SLOW for each element, a time step STEP and NEXT for each
)
SLOW, STEP = 2e-5, 4e-3  # s: some two times what NumPy took on the machine this was written on
NEXT = 4e-6  # s for each element in a time step, which begins near its end
READ = 5e-9  # s for each number of a table that a look-up sums; 1.3e-9 to 6e-9 measured
CYCLES = 3  # that it takes to reach a limit cycle
BASE = 1.6e8  # bytes: Python with its libraries, and the solver's batch
COPIES = 14  # of the angles and velocities of a gait while they are solved and integrated
TABLES = 4  # of a table while it is built, interpolated and written
ROW = 800  # bytes of an amplitude's results by all tiers, as lists and as text


class Cost(NamedTuple):
    """balances: of force. seconds: of computing. memory: bytes at the peak."""

    balances: int
    seconds: float
    memory: float

    def __str__(self) -> str:
        balances = f"{self.balances:,} force balances"
        return f"{balances}, about {_duration(self.seconds)} of computing and {_size(self.memory)} of memory"

    @property
    def as_balances(self) -> float:
        """Balances that take NumPy about as long, for the choice of a back end."""
        return self.balances

    @property
    def small(self) -> bool:
        """Not worth saying."""
        return self.seconds < WORTH_SAYING and self.memory < LARGEST

    def check(self, place: str, yes: bool, less: str = "ask for less") -> None:
        """SceneError where it goes beyond the limits and ``yes`` does not allow that. less: what to do else."""
        if not yes and (self.seconds > LONGEST or self.memory > LARGEST):
            limits = f"{_duration(LONGEST)} or {_size(LARGEST)}"
            raise SceneError(f"{place}: {self}: to compute for more than {limits} say --yes, or {less}")


class Job(NamedTuple):
    """Part of a request. what: "balances" solved side by side, "steps" of one cycle of ``group`` samples,
    "powers" of balances, or "look-ups" of so many numbers read each. gait: whose shapes, None for those all over the field.
    memory: bytes at the peak."""

    what: str
    scene: Scene
    gait: Gait | None
    count: float
    group: int = 1
    read: int = 0
    memory: float = BASE

    @property
    def kind(self) -> str:
        """The same for jobs whose balances, steps or look-ups take the same time."""
        return repr((self.what, costed(self.scene.system).cost_key, self.gait, self.group, self.read))

    @property
    def balances(self) -> int:
        """Balances of one of them, or of one time step."""
        return self.group if self.what not in ("look-ups", "powers") else 0

    @property
    def least(self) -> float:
        """Balances of all, as far as they are known before one is solved: one cycle of steps."""
        return self.count * self.balances


def price(jobs: Sequence[Job]) -> Cost:
    """Of jobs that are done one after the other."""
    kinds: dict[str, list[Job]] = {}
    for job in jobs:
        kinds.setdefault(job.kind, []).append(job)
    balances = seconds = 0.0
    with suiting(sum(j.least for j in jobs)):
        for same in kinds.values():
            job, count = same[0], sum(j.count for j in same)
            each, cycles = _per_step(job, count) if job.what == "steps" else (_per_sample(job, count), 1)
            seconds += count * cycles * each
            balances += count * cycles * job.balances
    return Cost(math.ceil(balances), seconds, max((j.memory for j in jobs), default=BASE))


def _duration(seconds: float) -> str:
    for unit, size in (("days", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 1.5 * size:
            return f"{seconds / size:.2g} {unit}" if seconds < 100 * size else f"{seconds / size:,.0f} {unit}"
    return f"{max(1.0, seconds):.0f} s"


def _size(memory: float) -> str:
    return f"{memory / 1e9:,.2g} GB" if memory >= 1e9 else f"{memory / 1e6:.0f} MB"


def study(
    scene: Scene, plans: Mapping[str, Plan], count: int, gait: Gait | None = None, tables: bool = True
) -> list[Job]:
    """`Study.study` of ``count`` amplitudes of a gait, or the scene's own, by the plans of tiers; without tables if they are
    there."""
    gait, phases = gait or scene.gait, scene.numerics.phases
    jobs, names = [], set()
    for plan in sorted(plans.values(), key=lambda plan: -plan.numbers):
        if tables and plan.table and plan.table.name not in names:
            names.add(plan.table.name)
            jobs += built(scene, plan.table, plan.numbers)
    jobs += frame(scene) if "connection" not in names else []
    guesses = [plan for plan in plans.values() if not plan.exact]
    for plan in guesses:
        jobs += _looked_up(scene, plan, count, phases)
    jobs += of_medium(scene, gait, count)
    if len(guesses) < len(plans):
        return jobs + (len(plans) - len(guesses)) * direct(scene, gait, count, phases)
    fewer = max(estimate.REFERENCE_PHASES, 8 * gait.harmonics)
    return jobs + len(guesses) * direct(scene, gait, min(count, estimate.CHECKED), fewer)


def predicted(scene: Scene, plan: Plan, count: int) -> list[Job]:
    """The prediction of ``count`` amplitudes by a tier, with its table."""
    table = built(scene, plan.table, plan.numbers) if plan.table else []
    return table + _looked_up(scene, plan, count, scene.numerics.phases)


def balances(plan: Plan, count: int, phases: int) -> int:
    """Velocities that the prediction of ``count`` amplitudes at so many phases takes, with its table."""
    return (plan.table.balances if plan.table else 0) + plan.balances(count, phases)


def _looked_up(scene: Scene, plan: Plan, count: int, phases: int) -> list[Job]:
    """What a tier takes beside its table."""
    if plan.table:
        return [Job("look-ups", scene, None, count * phases, read=plan.read)]
    memory = BASE + 8 * COPIES * SAMPLES_TOGETHER
    return [Job("balances", scene, None, float(plan.balances(count, phases)), memory=memory)]


def frame(scene: Scene) -> list[Job]:
    """The field that a frame is made of which is one itself, as "minimum-perturbation" is: of two joints a trifle."""
    return connection(scene) if isinstance(scene.system, Framed) and scene.system.joints > 2 else []


def of_medium(scene: Scene, gait: Gait, count: int) -> list[Job]:
    """What an uncertain medium does to ``count`` amplitudes (`uncertainty.of_medium`)."""
    if not uncertainty.uncertain(scene.system):
        return []
    phases = max(uncertainty.PHASES, 8 * gait.harmonics)
    return uncertainty.points(scene.system) * direct(scene, gait, count, phases, checked=False)


def direct(
    scene: Scene, gait: Gait, count: int, phases: int, together: int = sys.maxsize, checked: bool = True,
    every: bool = False,
) -> list[Job]:  # fmt: skip
    """The direct tier for ``count`` amplitudes, at most ``together`` side by side, with its estimate of the error
    (`estimate.direct`) or, if not ``checked``, without. every: balances of all phases, those that are images too."""
    system, stepping = scene.system, scene.system.traits.steps
    if checked:
        phases = max(estimate.FEWEST_STEPS if stepping else 32, 8 * -(-phases // 8))
    group = min(max(1, count), together, at_once(system, phases))
    held = group * (60 * costed(system).elements + costed(system).held) if stepping else 0
    memory = BASE + 8 * (COPIES * group * phases * (system.joints + 6) + held) + count * ROW
    solves = (lambda n: n) if every else (lambda n: solved(system, gait, n))
    asked = _refined(scene, solves, phases) if checked else solves(phases)
    if stepping:
        return [Job("steps", scene, gait, asked * count / group, group, memory=memory)]
    return [Job("balances", scene, gait, asked * count, memory=memory)]


def _refined(scene: Scene, solves: Callable, phases: int) -> float:
    """Balances that `estimate.direct` solves, of which a gait of n phases takes solves(n): time stepping again at a half, a
    quarter and an eighth of the phases, and a quarter with a finer model where there is one. Pieces of body are doubled on the
    quarter, and halved and quartered at all phases: as much as half and a quarter."""
    full, quarter = solves(phases), solves(phases // 4)
    again = solves(phases // 2) + quarter + solves(phases // 8) if scene.system.traits.steps else 0
    again += 2 * quarter + 0.75 * full if pieces_of(scene.system) else 0
    return full + again + (quarter if refined(scene.system) else 0)


def connection(scene: Scene) -> list[Job]:
    """The connection with its CCF."""
    return built(scene, fitted.table(scene.system, scene.numerics))


def harmonics(scene: Scene) -> list[Job]:
    """The harmonics of the velocity."""
    return built(scene, harmonic.table(scene.system, scene.numerics))


def built(scene: Scene, table: Table, numbers: int = 0) -> list[Job]:
    """A table, beside which so many numbers are held."""
    if table.axes:
        table.axes()  # refuses a field that is too large
    gait = None if table.amplitudes is None else scene.gait
    memory = BASE + 8 * TABLES * (table.numbers + numbers)
    return [Job("balances", scene, gait, table.balances, memory=memory)]


def of_planes(scene: Scene, count: int) -> list[Job]:
    """So many planes of two joints (`Study.plane`)."""
    if stored(scene.system, "connection"):
        return []
    solves = count * scene.numerics.grid**2 * fitted.directions(scene.system, scene.numerics)
    return [Job("balances", scene, None, float(solves)), *frame(scene)]


def of_metric(scene: Scene) -> list[Job]:
    """The metric, with the harmonic table where it shares the velocities of that one (`Study.compute_metric`)."""
    system, n = scene.system, scene.numerics
    if stored(system, "metric"):
        return []
    if effort.shared(system):
        (table,) = harmonics(scene)
        return [table, table._replace(what="powers")]
    rates = system.joints * (system.joints + 1) // 2 if system.traits.linear else harmonic.directions(system, n)
    count, numbers = np.prod([len(a) for a in fitted.axes(system, n)]), max(system.joints**2, effort.HIGHEST + 1)
    return [Job("balances", scene, None, float(count * rates), memory=BASE + 8 * TABLES * float(count * numbers))]


def of_effort(scene: Scene, count: int, gait: Gait | None = None) -> list[Job]:
    """Path length and work of ``count`` amplitudes (`effort.effort`): steps of time again at half and a quarter of the
    phases, and a quarter of the phases with twice the pieces."""
    times = 1.0 + 0.75 * bool(scene.system.traits.steps) + 0.5 * bool(pieces_of(scene.system))
    jobs = direct(scene, gait or scene.gait, count, scene.numerics.phases, checked=False)
    return [job._replace(count=times * job.count) for job in jobs]


def _per_sample(job: Job, count: float) -> float:
    """Seconds a force balance, the power of one, or a look-up, takes."""
    scene = job.scene
    if job.what == "look-ups":
        return READ * job.read
    solver = costed(scene.system)
    prior = SLOW * solver.evaluations
    if prior * count < FREE:
        return prior / 2
    rng, joints, extent = np.random.default_rng(0), scene.system.joints, scene.numerics.extent

    def solve(samples: int):
        if job.gait is None:
            alpha, alphadot = rng.uniform(-extent, extent, (samples, joints)), rng.normal(size=(samples, joints))
            if job.what == "powers":
                return capability(scene.system, Dissipative).power(alpha, alphadot, np.zeros((samples, 3)))
            return solver.solve(alpha, alphadot)
        phases = max(8, 2 * job.gait.harmonics + 2)
        return solver.solve(*job.gait.cycle(phases, np.full(-(-samples // phases), job.gait.amplitude)))

    return _grown(solve, max(8, 3072 // solver.elements), count)


def _per_step(job: Job, count: float) -> tuple[float, int]:
    """(seconds a time step takes, cycles until they are periodic)."""
    system, gait = costed(job.scene.system), job.gait
    prior, cycles = STEP + NEXT * system.evaluations * job.group, system.solver.cycles or CYCLES
    if prior * count * cycles < FREE:
        return prior / 2, cycles
    phases = max(16, 8 * -(-gait.harmonics // 3))
    some = min(job.group, max(1, system.together // system.evaluations))

    def time_steps(samples: int, cycles: int | None):
        start = time.process_time()
        found = system.time_steps(*gait.cycle(phases, np.full(samples, gait.amplitude)), cycles)
        return found.cycles, (time.process_time() - start) / (phases * found.cycles)

    with unaided():
        cycles = time_steps(1, system.solver.cycles and 1)[0]  # also loads what the first steps load
        return time_steps(some, 1)[1] * job.group / some, system.solver.cycles or cycles


def _grown(f: Callable, samples: int, most: float) -> float:
    """Seconds a sample that f(samples) takes, for as many as it takes to tell."""
    with unaided():
        f(samples)  # loads what the first call loads
        while True:
            start = time.process_time()
            f(samples)
            took = time.process_time() - start
            if took > PILOT or samples >= most:
                return took / samples
            samples *= 2 if took > PILOT / 4 else 4
