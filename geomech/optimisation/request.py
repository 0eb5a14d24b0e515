"""Requests to the optimiser, checked before anything is computed, and their cost."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from geomech.gaits import Gait, Sine
from geomech.geometry.connection import evaluate
from geomech.optimisation.ascent import TRIES
from geomech.optimisation.limits import LimitsArgument, checked_limits
from geomech.optimisation.loops import DENSE, IN_MIRROR, OUTLINES, Loops
from geomech.optimisation.objectives import Objective
from geomech.optimisation.undulations import Undulations
from geomech.scenes.model import Scene, checked_scene
from geomech.studies import cost
from geomech.systems.base import System, body_size, kind_of
from geomech.systems.capabilities import (
    Dissipative,
    OwnMetric,
    capability,
    near_gait,
    stored_table,
)
from geomech.systems.framed import Framed, in_frame
from geomech.systems.premises import listed, refuse
from rft.core.checks import in_range
from rft.core.premise import ALL, Premise
from rft.core.refusal import Refusal, located

JOINTS = 12  # with more, loops have too many parameters for this search
PHASES = 128  # of a cycle in the search
FINISHED = 3  # optima by tables that the direct tier improves
PERTURBATIONS = (
    0.1,
    0.2,
)  # rad, if joints have 2.5: of the best loop; the larger ones are first improved by tables
MORE = 3  # loops for each of these sizes
SHARE, LED = (
    0.8,
    4,
)  # narrower limits for a first search, relative; and the number of its optima that are start values
ROOM = 1.02  # extent of tables over the limit, as iterates exceed it
NEAR, FINISH, POLISH, RUNS = (
    100,
    16,
    60,
    12,
)  # steps in tables, by the direct tier, of its best, of gaits run as a whole
ASCENT = 0.4  # s of other work per ascent, some twice the time on the machine that this was written on
STILL = 1e-12  # of the velocity: roundoff
LOOPS = 4 + len(OUTLINES)  # loops for the test whether any turns
DEGREES = 1e-3  # largest scatter of the degree of the power


@dataclass(frozen=True)
class Request:
    """A scene, an objective, and the loops that are searched; built by `checked`.

    Examples
    --------
    >>> from geomech.optimisation import checked
    >>> from geomech.scenes import load
    >>> request = checked(load("three-link-viscous"), "displacement", harmonics=2)
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
        """System of the search: the scene's, in its original frame if the scene has another."""
        return _inner(self.scene.system)

    by_runs = property(
        lambda self: self.system.traits.steps or isinstance(self.loops, Undulations),
        doc="Whether gaits are run as a whole.",
    )
    looks_up = property(
        lambda self: not self.by_runs and self.system.joints == 2 and not self.system.traits.linear and self.stored is None
        and self.system.traits.singularity is None,
        doc="Whether the search begins with tables.",
    )  # fmt: skip
    stored = property(lambda self: stored_table(self.system, "connection"))

    @cached_property
    def power(self) -> Callable | None:
        """Function power(alpha, alphadot, xi) in body drag x body length / time, from forces or a table; the squared
        speed for a system with its own metric; None where the cost of moving is not known."""
        system = self.system
        if self.stored:
            metric, degree, box = (
                stored_table(system, "metric"),
                system.traits.power_degree or 2.0,
                self.loops.box,
            )
            return metric and (
                lambda alpha, alphadot, xi: (
                    metric.norm(np.clip(alpha, *box), alphadot) ** degree
                )
            )
        if own := capability(system, OwnMetric):
            return lambda alpha, alphadot, xi: own.squared_speed(alpha, alphadot)
        dissipative = capability(system, Dissipative)
        return dissipative and dissipative.power

    @cached_property
    def degree(self) -> float:
        """Degree of the power in the rate of shape: 2 in a linear medium, 1 in a dry one; Refusal if it has none."""
        objective, system = self.objective, self.system
        if self.power is None:
            instead = (
                "say ``rate``"
                if objective.timed
                else "optimize for displacement, turning or speed"
            )
            raise Refusal(
                f"``objective`` {objective.name} asks for power, which {source_name(system)} does not tell",
                instead=instead,
            )
        if capability(system, OwnMetric) is not None:
            if objective.power is not None:
                raise Refusal(
                    f"``power`` is that of drag, and the {kind_of(system)} has none",
                    instead="say ``rate``",
                )
            return 2.0
        if self.stored:
            return system.traits.power_degree
        if self.system.traits.steps:
            return 1.0 if not self.system.traits.smooth else 2.0
        rng = np.random.default_rng(0)
        alpha, rate = (
            self.loops.unit * rng.normal(size=(8, self.system.joints)),
            rng.normal(size=(8, self.system.joints)),
        )
        slow, fast = (
            self.power(alpha, u, evaluate(self.system.velocity, alpha, u))
            for u in (rate, 2 * rate)
        )
        degrees = np.log2(fast / slow)
        if np.ptp(degrees) > DEGREES:
            raise Refusal(
                f"no path has a length with {listed(self.system, ALL)}",
                because="its power is of no one degree in the rate",
                instead="optimize for displacement",
            )
        return float(np.round(degrees.mean(), 3))

    @cached_property
    def gait(self) -> Gait:
        """Gait of the scene, made smaller where it exceeds the limits."""
        gait, loops = self.scene.gait, self.loops
        if isinstance(loops, Loops):
            excursion = np.abs(gait.cycle(DENSE)[0] - loops.middle).max(0)
            if (excursion > loops.half * (1 + 1e-3)).any():
                return loops.gait(loops.fitted(loops.of(gait)))
        return gait

    @property
    def phases(self) -> int:
        """Phases at which a gait is evaluated: a multiple of 8, as errors are estimated on an eighth of them."""
        return 8 * -(-max(self.scene.numerics.phases, self.loops.phases) // 8)

    def cost(self) -> cost.Cost:
        """Return the balances, seconds and memory that the search takes at most."""
        scene, loops, gait = self.scene, self.loops, self.gait
        numbers = int(np.prod(loops.shape))
        each = 1 + 2 * numbers if self.by_runs else 1 + 4 * self.system.joints
        finished = min(FINISHED, self.starts) if self.looks_up else self.starts
        jobs = cost.direct(
            scene, gait, 3 + finished, max(scene.numerics.phases, PHASES)
        )
        if self.looks_up:
            jobs += cost.harmonics(
                scene.changed(system=self.system).with_numerics(extent=self.extent)
            )
            perturbed = 2 * MORE * (self.starts > 1)
            steps = (
                finished + 2 * perturbed
            ) * FINISH + POLISH * self.phases / loops.phases
        else:
            steps = self.starts * (RUNS if self.by_runs else NEAR)
        gaits = int(steps * TRIES * each)
        jobs += cost.direct(
            scene, gait, gaits, loops.phases, each, checked=False, all_phases=True
        )
        total, ascents = cost.price(jobs), ASCENT * (self.ascents + 1)
        return total._replace(
            seconds=total.seconds + ascents, besides=total.besides + ascents
        )

    @property
    def ascents(self) -> int:
        """Number of ascents: one from each start and, where tables are used, by the direct tier and once more from the
        best; with several starts also within narrower limits, from their results, and from perturbations of the best.
        """
        if not self.looks_up:
            return self.starts
        extra = self.starts + LED + 3 * MORE if self.starts > 1 else 0
        return self.starts + min(FINISHED, self.starts) + 1 + extra

    @property
    def extent(self) -> float:
        """Extent of the field of the tables."""
        return float(np.abs(self.loops.box).max()) * ROOM


def checked(
    scene: Scene, objective: str, direction: str | None = None, harmonics: int | None = None, limits: LimitsArgument = None,
    starts: int | None = None, rate: float | None = None, power: float | None = None,
) -> Request:  # fmt: skip
    """Return the request; Refusal for one that makes no sense.

    Examples
    --------
    >>> from geomech.optimisation import checked, search
    >>> from geomech.scenes import load
    >>> request = checked(load("three-link-viscous"), "displacement", harmonics=1, starts=1)
    >>> round(search(request).value, 3)
    0.101
    """
    with located(checked_scene(scene).name):
        in_range("``starts``", 1 if starts is None else starts, 1, 1000, whole=True)
        system, pace = scene.system, {"rate": rate, "power": power}
        towards = "" if direction is None else direction
        if near_gait(system):
            raise Refusal(
                "no gait but one to search",
                because=f"A is known near {near_gait(system)} alone",
                instead="measure more varied cycles",
            )
        maximised = Objective(objective, towards, body_size(system), **pace)
        if maximised.timed:
            if system.traits.lacks & Premise.RATE_INDEPENDENT:
                refuse(
                    system,
                    "speed",
                    Premise.RATE_INDEPENDENT,
                    "optimize for displacement, at the scene's frequency",
                )
            if rate is None and power is None:
                waves = isinstance(scene.gait, Sine)
                own = (
                    {"power": _own_power(scene)}
                    if waves
                    else {"rate": _own_rate(scene)}
                )
                maximised = Objective(objective, towards, body_size(system), **own)
        loops = _loops(scene, harmonics, limits)
        if isinstance(loops, Undulations) and not maximised.straight:
            raise Refusal(
                "a sine along a straight axis does not turn",
                because="``objective`` turning takes a gait of few joints",
            )
        if (
            isinstance(loops, Undulations)
            and maximised.direction == "y"
            and system.traits.mirror
        ):
            raise Refusal(
                "a sine along a straight axis brings nothing across it",
                instead="drop ``direction``, or say x",
            )
        if isinstance(loops, Undulations) and maximised.rate is not None:
            raise Refusal(
                "a wave is as fast as its power allows",
                instead="say ``power``, a limit of rate is that of joints",
            )
        request = Request(scene, maximised, loops, 1 if starts is None else int(starts))
        if starts is None and request.looks_up:
            request = dataclasses.replace(
                request, starts=1 + len(OUTLINES) - IN_MIRROR * _in_mirror(request)
            )
        if maximised.costs:
            request.degree  # noqa: B018 - refuses what has none
        if maximised.straight and _stays(system):
            raise Refusal(
                f"the {kind_of(system)} goes nowhere",
                because="its mean frame stays where it is",
                instead="optimize for turning",
            )
        if maximised.name == "turning" and _never_turns(request):
            whose = (
                f"{source_name(system)} tells a body whose"
                if stored_table(system, "connection")
                else f"the {kind_of(system)}'s"
            )
            raise Refusal(
                "no gait turns it",
                because=f"{whose} heading follows from its shape and comes back with it",
                instead="optimize for displacement",
            )
        return request


def source_name(system: System) -> str:
    """Return the name of a system, or of its file."""
    return (
        "the table's file"
        if stored_table(system, "connection")
        else f"the {kind_of(system)}"
    )


def _in_mirror(request: Request) -> bool:
    """Return whether the last of `OUTLINES` are mirror images of others."""
    return request.system.traits.mirror and not request.loops.middle.any()


def _stays(system: System) -> bool:
    """Return whether no change of shape moves its mean frame, or its own if it has none, tested at a few shapes."""
    if (
        system.traits.steps
        or not system.traits.linear
        or stored_table(system, "connection")
    ):
        return False
    with contextlib.suppress(ValueError, TypeError):
        system = in_frame(system, "mean")
    rng = np.random.default_rng(0)
    xi = evaluate(system.velocity, *rng.normal(size=(2, 16, system.joints)))
    return bool(
        np.nanmax(np.abs(xi[:, :2]))
        <= STILL * body_size(system) * np.nanmax(np.abs(xi))
    )


def _never_turns(request: Request) -> bool:
    """Return whether the heading is a function of the shape, dA_theta = 0, tested on a few loops."""
    system, loops = request.system, request.loops
    if (
        system.traits.steps
        or not system.traits.linear
        or system.traits.singularity is not None
    ):
        return False
    samples = np.array(loops.starts(loops.of(request.gait), LOOPS))
    turning = evaluate(system.velocity, *loops.cycle(samples))[..., 2]
    return bool(np.abs(turning.mean(-1)).max() <= STILL * np.abs(turning).max())


def _own_rate(scene: Scene) -> float:
    """Return the fastest rate of shape in the scene's gait, rad/s; 1 without a frequency, or for a gait that rests."""
    return (
        float(
            2
            * np.pi
            * (scene.frequency or 0.0)
            * np.abs(scene.gait.cycle(PHASES)[1]).max()
        )
        or 1.0
    )


def _own_power(scene: Scene) -> float:
    """Return the mean power of the scene's gait at its frequency, or at 1 rad of phase per unit of time; 1 for a gait
    that rests."""
    gait, system = scene.gait, scene.system
    work = system.run(*gait.cycle(PHASES), True).work
    per_second = 2 * np.pi * scene.frequency if scene.frequency else 1.0
    return (
        float(
            np.maximum(work.power, 0.0).mean()
            / body_size(system)
            * per_second**system.traits.power_degree
        )
        or 1.0
    )


def _loops(
    scene: Scene, harmonics: int | None, limits: LimitsArgument
) -> Loops | Undulations:
    gait, system, n = scene.gait, scene.system, scene.numerics
    if isinstance(gait, Sine):
        for name, value in (("harmonics", harmonics), ("limits", limits)):
            if value is not None:
                raise Refusal(
                    f"``{name}`` is that of joints",
                    because="of a sine, amplitude and waves are sought",
                    instead="drop it",
                )
        return Undulations(gait, max(64, min(n.phases, PHASES)))
    if system.joints > JOINTS:
        raise Refusal(
            f"a loop of {system.joints} joints is too much to search",
            because=f"at most {JOINTS}, or a sine gait",
        )
    in_range("``harmonics``", 5 if harmonics is None else harmonics, 1, 32, whole=True)
    harmonics = 5 if harmonics is None else int(harmonics)
    return Loops(
        system.joints,
        harmonics,
        checked_limits(scene, limits, PHASES),
        max(PHASES, 16 * harmonics),
    )


def _inner(system: System) -> System:
    return system.inner if isinstance(system, Framed) else system
