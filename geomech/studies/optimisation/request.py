"""Requests to the optimiser, checked before anything is computed, and their cost."""

from __future__ import annotations

import contextlib
import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from geomech.mathematics.gaits import Gait, Sine
from geomech.mathematics.geometry.connection import Connection, evaluate
from geomech.mathematics.systems.base import System, body_size, kind_of
from geomech.mathematics.systems.capabilities import (
    Dissipative,
    OwnMetric,
    capability,
    near_gait,
    stored_table,
)
from geomech.mathematics.systems.framed import Framed, in_frame
from geomech.mathematics.systems.premises import listed, refuse
from geomech.scenes.model import Scene, checked_scene
from geomech.studies.estimates import cost
from geomech.studies.optimisation.limits import LimitsArgument, checked_limits
from geomech.studies.optimisation.local.ascent import TRIES
from geomech.studies.optimisation.local.objectives import Objective
from geomech.studies.optimisation.loops import DENSE, N_IN_MIRROR, OUTLINES, Loops
from geomech.studies.optimisation.undulations import Undulations
from rft.core.checks import in_range
from rft.core.premise import ALL, Premise
from rft.core.refusal import Refusal, located

MAX_JOINTS = 12  # with more, loops have too many parameters for this search
MAX_HARMONICS = 32
HARMONICS = 5  # by default
PHASES = 128  # of a cycle in the search
N_IMPROVED = 3  # optima by tables that the direct tier improves
# Perturbations of the best loop: rad, if joints have 2.5. The larger ones are first
# improved by tables.
PERTURBATIONS = (0.1, 0.2)
N_PERTURBED = 3  # loops for each of these sizes
NARROWER_LIMITS = 0.8  # of the limits: of a first search
N_FROM_NARROWER = 4  # optima within narrower limits that are start values
TABLE_MARGIN = 1.02  # extent of tables over the limit, as iterates exceed it
TABLE_STEPS = 100  # of an ascent in tables
DIRECT_STEPS = 16  # by the direct tier
LAST_STEPS = 60  # by the direct tier, of the best
RUN_STEPS = 12  # of gaits run as a whole
# Of other work per ascent: some twice the time on the machine that this was written on.
SECONDS_PER_ASCENT = 0.4
REST = 1e-12  # of the velocity: a smaller one is roundoff
N_TURNING_LOOPS = 4 + len(OUTLINES)  # loops for the test whether any turns
DEGREE_SCATTER = 1e-3  # largest scatter of the degree of the power


@dataclass(frozen=True)
class Request:
    """A scene, an objective, and the loops that are searched; built by `build_request`.

    Examples
    --------
    >>> from geomech.studies.optimisation import build_request
    >>> from geomech.scenes import load
    >>> request = build_request(load("three-link-viscous"), "displacement", harmonics=2)
    >>> request.starts, request.scene.system.joints
    (1, 2)
    """

    scene: Scene
    objective: Objective
    loops: Loops | Undulations
    starts: int

    def __reduce__(self) -> tuple:
        """Return the request as workers receive it, without cached values."""
        return Request, (self.scene, self.objective, self.loops, self.starts)

    @property
    def system(self) -> System:
        """System of the search: the scene's, in its original frame if the scene has
        another."""
        system = self.scene.system
        return system.inner if isinstance(system, Framed) else system

    @property
    def uses_runs(self) -> bool:
        """Whether gaits are run as a whole."""
        return self.system.traits.steps or isinstance(self.loops, Undulations)

    @property
    def uses_tables(self) -> bool:
        """Whether the search begins with tables."""
        system = self.system
        return (
            not self.uses_runs
            and system.joints == 2
            and not system.traits.linear
            and self.table is None
            and system.traits.singularity is None
        )

    @property
    def table(self) -> Connection | None:
        """Stored table of the connection, or None."""
        return stored_table(self.system, "connection")

    @cached_property
    def power(self) -> Callable | None:
        """Function power(alpha, alphadot, xi) in body drag x body length / time, from
        forces or a table; the squared speed for a system with its own metric; None
        where the cost of moving is not known."""
        system = self.system
        if self.table:
            return _table_power(system, self.loops.box)

        own_metric = capability(system, OwnMetric)
        if own_metric:

            def squared_speed(alpha, alphadot, xi):
                return own_metric.squared_speed(alpha, alphadot)

            return squared_speed
        dissipative = capability(system, Dissipative)
        return dissipative and dissipative.power

    @cached_property
    def degree(self) -> float:
        """Degree of the power in the rate of shape: 2 in a linear medium, 1 in a dry
        one. Refusal if it has none."""
        objective = self.objective
        system = self.system
        if self.power is None:
            instead = "optimize for displacement, turning or speed"
            if objective.timed:
                instead = "say ``rate``"
            raise Refusal(
                f"``objective`` {objective.name} needs the power, which "
                f"{source_name(system)} does not give",
                instead=instead,
            )
        if capability(system, OwnMetric) is not None:
            if objective.power is not None:
                raise Refusal(
                    f"``power`` is the power of drag, and the {kind_of(system)} "
                    "has none",
                    instead="say ``rate``",
                )
            return 2.0
        if self.table:
            return system.traits.power_degree
        if system.traits.steps:
            return 2.0 if system.traits.smooth else 1.0
        return self._measured_degree()

    def _measured_degree(self) -> float:
        """Return the degree of the power from its change at twice the rate, for a few
        random shapes and rates."""
        system = self.system
        rng = np.random.default_rng(0)
        alpha = self.loops.unit * rng.normal(size=(8, system.joints))
        rate = rng.normal(size=(8, system.joints))
        slow = self.power(alpha, rate, evaluate(system.velocity, alpha, rate))
        fast = self.power(alpha, 2 * rate, evaluate(system.velocity, alpha, 2 * rate))
        degrees = np.log2(fast / slow)
        if np.ptp(degrees) > DEGREE_SCATTER:
            raise Refusal(
                f"paths have no length with {listed(system, ALL)}",
                because="its power is not proportional to one power of the rate",
                instead="optimize for displacement",
            )
        return float(np.round(degrees.mean(), 3))

    @cached_property
    def gait(self) -> Gait:
        """Gait of the scene, made smaller where it exceeds the limits."""
        gait = self.scene.gait
        loops = self.loops
        if isinstance(loops, Loops):
            excursion = np.abs(gait.cycle(DENSE)[0] - loops.middle).max(0)
            if (excursion > loops.half * (1 + 1e-3)).any():
                return loops.gait(loops.fitted(loops.from_gait(gait)))
        return gait

    @property
    def phases(self) -> int:
        """Phases at which a gait is evaluated: a multiple of 8, as errors are estimated
        on an eighth of them."""
        phases = max(self.scene.numerics.phases, self.loops.phases)
        return 8 * math.ceil(phases / 8)

    def cost(self) -> cost.Cost:
        """Return the balances, seconds and memory that the search takes at most."""
        scene = self.scene
        loops = self.loops
        improved = self.starts
        if self.uses_tables:
            improved = min(N_IMPROVED, self.starts)

        # The gait of the scene and the results are evaluated with their errors.
        phases = max(scene.numerics.phases, PHASES)
        jobs = cost.direct_jobs(scene, self.gait, 3 + improved, phases)
        if self.uses_tables:
            own_frame = scene.changed(system=self.system)
            jobs += cost.harmonic_jobs(own_frame.with_numerics(extent=self.extent))

        # The ascents themselves: steps, cycles per step, gaits per cycle.
        gaits_per_cycle = 1 + 4 * self.system.joints
        if self.uses_runs:
            gaits_per_cycle = 1 + 2 * int(np.prod(loops.shape))
        gaits = int(self._direct_steps(improved) * TRIES * gaits_per_cycle)
        jobs += cost.direct_jobs(
            scene,
            self.gait,
            gaits,
            loops.phases,
            gaits_per_cycle,
            with_error=False,
            all_phases=True,
        )
        total = cost.total_cost(jobs)
        seconds = SECONDS_PER_ASCENT * (self.ascents + 1)
        return total._replace(
            seconds=total.seconds + seconds, besides=total.besides + seconds
        )

    def _direct_steps(self, improved: int) -> float:
        """Return the number of steps by the direct tier, at the phases of the loops."""
        if self.uses_tables:
            perturbed = 0
            if self.starts > 1:
                perturbed = 2 * N_PERTURBED
            last = LAST_STEPS * self.phases / self.loops.phases
            return (improved + 2 * perturbed) * DIRECT_STEPS + last
        if self.uses_runs:
            return self.starts * RUN_STEPS
        return self.starts * TABLE_STEPS

    @property
    def ascents(self) -> int:
        """Number of ascents.

        There is one from each start. Where tables are used the direct tier improves
        some, and once more the best; with several starts there are also ascents within
        narrower limits, from their results, and from perturbations of the best."""
        if not self.uses_tables:
            return self.starts
        ascents = self.starts + min(N_IMPROVED, self.starts) + 1
        if self.starts > 1:
            ascents += self.starts + N_FROM_NARROWER + 3 * N_PERTURBED
        return ascents

    @property
    def extent(self) -> float:
        """Extent of the field of the tables, rad."""
        return float(np.abs(self.loops.box).max()) * TABLE_MARGIN


def build_request(
    scene: Scene,
    objective: str,
    direction: str | None = None,
    harmonics: int | None = None,
    limits: LimitsArgument = None,
    starts: int | None = None,
    rate: float | None = None,
    power: float | None = None,
) -> Request:
    """Return the request; Refusal for one that makes no sense.

    Examples
    --------
    >>> from geomech.studies.optimisation import build_request, search
    >>> from geomech.scenes import load
    >>> scene = load("three-link-viscous")
    >>> request = build_request(scene, "displacement", harmonics=1, starts=1)
    >>> round(search(request).value, 3)
    0.101
    """
    with located(checked_scene(scene).name):
        n_starts = 1 if starts is None else starts
        in_range("``starts``", n_starts, 1, 1000, whole=True)
        system = scene.system
        if near_gait(system):
            raise Refusal(
                "there is only one gait to search",
                because=f"A is known only near {near_gait(system)}",
                instead="measure cycles that vary more",
            )
        maximised = _objective(scene, objective, direction, rate, power)
        loops = _loops(scene, harmonics, limits)
        if isinstance(loops, Undulations):
            _check_undulations(maximised, system)

        request = Request(scene, maximised, loops, int(n_starts))
        if starts is None and request.uses_tables:
            count = 1 + len(OUTLINES)
            if _in_mirror(request):
                count -= N_IN_MIRROR
            request = dataclasses.replace(request, starts=count)
        if maximised.costs:
            _ = request.degree  # refuses a power without one
        _check_motion(request)
        return request


def _objective(
    scene: Scene,
    name: str,
    direction: str | None,
    rate: float | None,
    power: float | None,
) -> Objective:
    """Return the objective; for speed without limits, those of the scene's own gait."""
    system = scene.system
    size = body_size(system)
    if direction is None:
        direction = ""
    objective = Objective(name, direction, size, rate=rate, power=power)
    if not objective.timed:
        return objective
    if system.traits.lacks & Premise.RATE_INDEPENDENT:
        refuse(
            system,
            "speed",
            Premise.RATE_INDEPENDENT,
            "optimize for displacement, at the scene's frequency",
        )
    if rate is not None or power is not None:
        return objective
    if isinstance(scene.gait, Sine):
        return Objective(name, direction, size, power=_own_power(scene))
    return Objective(name, direction, size, rate=_own_rate(scene))


def _check_undulations(objective: Objective, system: System) -> None:
    """Refuse an objective that a sine along a straight axis cannot have."""
    if not objective.straight:
        raise Refusal(
            "a sine along a straight axis does not turn",
            because="``objective`` turning needs a gait with few joints",
        )
    if objective.direction == "y" and system.traits.mirror:
        raise Refusal(
            "a sine along a straight axis does not move across it",
            instead="remove ``direction``, or use x",
        )
    if objective.rate is not None:
        raise Refusal(
            "the speed of a wave is limited by its power",
            instead="use ``power``; a limit of rate applies to joints",
        )


def _check_motion(request: Request) -> None:
    """Refuse a search for a motion that the system cannot have."""
    system = request.scene.system
    objective = request.objective
    if objective.straight and _stays(system):
        raise Refusal(
            f"the {kind_of(system)} does not move",
            because="its mean frame stays where it is",
            instead="optimize for turning",
        )
    if objective.name == "turning" and _never_turns(request):
        whose = f"the {kind_of(system)}'s"
        if stored_table(system, "connection"):
            whose = f"{source_name(system)} describes a body whose"
        raise Refusal(
            "no gait turns it",
            because=f"{whose} heading follows from its shape and returns with it",
            instead="optimize for displacement",
        )


def source_name(system: System) -> str:
    """Return the name of a system, or of its file."""
    if stored_table(system, "connection"):
        return "the table's file"
    return f"the {kind_of(system)}"


def _table_power(system: System, box) -> Callable | None:
    """Return power(alpha, alphadot, xi) by a stored metric, with shapes clipped to its
    field; None without a metric."""
    metric = stored_table(system, "metric")
    if not metric:
        return None
    degree = system.traits.power_degree or 2.0

    def power(alpha, alphadot, xi):
        return metric.norm(np.clip(alpha, *box), alphadot) ** degree

    return power


def _in_mirror(request: Request) -> bool:
    """Return whether the last of `OUTLINES` are mirror images of others."""
    return request.system.traits.mirror and not request.loops.middle.any()


def _stays(system: System) -> bool:
    """Return whether no change of shape moves its mean frame, or its own if it has
    none, tested at a few shapes."""
    if system.traits.steps or not system.traits.linear:
        return False
    if stored_table(system, "connection"):
        return False
    with contextlib.suppress(ValueError, TypeError):
        system = in_frame(system, "mean")
    rng = np.random.default_rng(0)
    xi = evaluate(system.velocity, *rng.normal(size=(2, 16, system.joints)))
    largest = np.nanmax(np.abs(xi[:, :2]))
    return bool(largest <= REST * body_size(system) * np.nanmax(np.abs(xi)))


def _never_turns(request: Request) -> bool:
    """Return whether the heading is a function of the shape, dA_theta = 0, tested on a
    few loops."""
    system = request.system
    loops = request.loops
    if system.traits.steps or not system.traits.linear:
        return False
    if system.traits.singularity is not None:
        return False
    samples = np.array(loops.starts(loops.from_gait(request.gait), N_TURNING_LOOPS))
    xi_theta = evaluate(system.velocity, *loops.cycle(samples))[..., 2]
    return bool(np.abs(xi_theta.mean(-1)).max() <= REST * np.abs(xi_theta).max())


def _own_rate(scene: Scene) -> float:
    """Return the fastest rate of shape in the scene's gait, rad/s; 1 without a
    frequency, or for a gait that rests."""
    fastest = np.abs(scene.gait.cycle(PHASES)[1]).max()
    return float(2 * np.pi * (scene.frequency or 0.0) * fastest) or 1.0


def _own_power(scene: Scene) -> float:
    """Return the mean power of the scene's gait at its frequency, or at 1 rad of phase
    per unit of time; 1 for a gait that rests."""
    system = scene.system
    alpha, alphadot = scene.gait.cycle(PHASES)
    work = system.run(alpha, alphadot, True).work
    power = np.maximum(work.power, 0.0).mean() / body_size(system)
    rate = 1.0
    if scene.frequency:
        rate = 2 * np.pi * scene.frequency
    return float(power * rate**system.traits.power_degree) or 1.0


def _loops(
    scene: Scene, harmonics: int | None, limits: LimitsArgument
) -> Loops | Undulations:
    """Return the loops to search; Refusal for options that the scene's gait has not."""
    gait = scene.gait
    joints = scene.system.joints
    if scene.system.traits.periods:
        raise Refusal(
            f"a search over loops of the {kind_of(scene.system)} is not possible",
            because="one of its shape variables repeats, and its gaits wind around it",
            instead="sweep parameters of the gait ('geomech sweep')",
        )
    if isinstance(gait, Sine):
        for name, value in (("harmonics", harmonics), ("limits", limits)):
            if value is not None:
                raise Refusal(
                    f"``{name}`` applies to joints",
                    because="the search varies only amplitude and waves of a sine",
                    instead="remove it",
                )
        return Undulations(gait, max(64, min(scene.numerics.phases, PHASES)))
    if joints > MAX_JOINTS:
        raise Refusal(
            f"a search over a loop of {joints} joints is too large",
            because=f"use at most {MAX_JOINTS} joints, or a sine gait",
        )
    if harmonics is None:
        harmonics = HARMONICS
    in_range("``harmonics``", harmonics, 1, MAX_HARMONICS, whole=True)
    harmonics = int(harmonics)
    phases = max(PHASES, 16 * harmonics)
    return Loops(joints, harmonics, checked_limits(scene, limits, PHASES), phases)
