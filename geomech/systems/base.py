"""What a system is: a body velocity for a shape and its rate of change, and the premises it lacks."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any, NamedTuple, Protocol, Self

import numpy as np

from geomech.core import summary
from geomech.core.errors import check_angle, choose, real_array, short
from geomech.geometry.connection import Connection, evaluate, fit
from geomech.geometry.images import Around, around
from geomech.geometry.reconstruct import displacement, poses, repeated
from geomech.geometry.traits import NOTHING, Traits
from rft.premise import ALL, NONE, SHAPE_ALONE, Premise, negated

__all__ = ["ALL", "NONE", "SHAPE_ALONE", "Cycle", "Plain", "Premise", "System", "checked_system", "negated"]

# Of gaits run side by side, angles and velocities, a batch of which takes some 120 MB with what is made of them: more take
# no less time each, and the first of a long request is soon done, which tells how long the others take.
VALUES_TOGETHER = 1 << 20


class Cycle(NamedTuple):
    """A gait run once, for amplitudes (...,). xi: (..., N, 3), body velocity by phase. net: (..., 3), pose after the cycle
    in the frame at its start. residual: (...), the largest of the cycle. speed: (...), mean |alphadot|, 1. work: power,
    internal moments and slip, (..., N) each (`rft.work_done`), or None. cycles: how many time stepping took, 1 without it.
    to_come: (...), change of displacement still to come where cycles go on until they repeat, body lengths or rad; 0
    elsewhere."""

    xi: np.ndarray
    net: np.ndarray
    residual: np.ndarray
    speed: np.ndarray
    work: Any
    cycles: int
    to_come: np.ndarray

    def __repr__(self) -> str:
        count = np.size(self.speed)
        size = f"{count} gait{'s' * (count != 1)} of {np.shape(self.xi)[-2]} phases, net {summary.poses(self.net)}"
        more = f"; {self.cycles} cycles" * (self.cycles > 1) + "; with work" * (self.work is not None)
        return f"Cycle({size}; residual up to {np.max(self.residual, initial=0.0):.1e}{more})"


class System(Protocol):
    """What the geometry asks for; `Plain` answers all but ``joints`` and ``velocity`` for a system that needs no more.

    joints: shape variables. length: of the body. traits: what algorithms may use. points: None, or a function of shapes
    (..., joints) and poses of the
    frame (..., 3) that gives the ends of the body's links in the world (..., links + 1, 2), tail to head.
    """

    @property
    def joints(self) -> int: ...

    @property
    def length(self) -> float: ...

    @property
    def traits(self) -> Traits: ...

    @property
    def points(self) -> Callable | None: ...

    def velocity(self, alpha, alphadot) -> np.ndarray:
        """xi (..., 3) for alpha, alphadot (..., joints), in the body frame; nan at singular shapes."""

    def run(self, alpha, alphadot, work: bool = False) -> Cycle:
        """A gait given by alpha, alphadot (..., N, joints) at N equally spaced phases."""


@dataclasses.dataclass(frozen=True)
class NoSolver:
    """Of a system without [numerics] of its own."""


class Plain:
    """Base of systems: what holds of one whose velocity follows from shape alone, at one place at a time.

    starts: `run` takes velocities nearby,
    (..., N, 3), to begin from. kinks: the velocity has kinks in shape or direction, so that errors fall with the square of the
    phases only. solver: its own part of [numerics], a dataclass, or None. elements: places of the body at which forces are
    evaluated, for one velocity ``evaluations``, and ``together`` for as many velocities as are solved in one go. held: numbers
    that time stepping remembers for each sample. cut: pieces to a body length, 0 where there are none. settling: change of
    displacement still to come at which its cycles count as repeating, body lengths or rad; 0 without such cycles. near: of
    which gait alone it is known, in words, empty where it is of all. carried: its displacements are those of another frame,
    carried over. closed:
    forces on an element have an exact form, which finer loads come near to. notes: lines on what its user may not expect of
    how it is computed. covariance: (n, n), of parameters of its
    own that are not known for certain, which `varied` changes; None where all are. cost: None, or a function of
    alpha and alphadot that gives alphadot^T M(alpha) alphadot where the metric M of `geomech.geometry.metric` is not one of
    drag but, say, of kinetic energy.
    """

    kind = "system"
    length = 1.0
    traits = NOTHING
    covariance = None
    starts = False
    solver = None
    points = cost = None
    elements = evaluations = 1
    together = 1 << 12
    held = cut = 0
    closed = carried = False
    near = ""
    notes: tuple[str, ...] = ()
    settling = 0.0
    engine = "algebraic"

    @property
    def settles(self) -> bool:
        """Whether its cycles are run until they repeat."""
        return self.settling > 0

    def sample(self, alpha, alphadot) -> np.ndarray:
        """`velocity`, unchecked, to be timed."""
        return self.velocity(alpha, alphadot)

    def single(self, alpha, alphadot) -> dict:
        """{"xi", "status", "residual"} for one shape (joints,) and its rate; ValueError if it is singular."""
        alpha, alphadot = (self._one(name, x) for name, x in (("alpha", alpha), ("alphadot", alphadot)))
        self.note_angles(np.abs(alpha).max())
        if self.traits.singularity is not None and not self.traits.singularity(alpha):
            raise ValueError(f"the shape is singular: {self.traits.singular}: move a joint")
        xi = evaluate(self.velocity, alpha, alphadot)
        return {"xi": xi.tolist(), "status": "exact", "residual": 0.0}

    def note_angles(self, largest: float) -> None:
        """UnitWarning if the largest of some shape variables is a joint angle beyond a full turn."""
        if self.traits.joint_angles:
            check_angle("a joint angle", largest)

    def _one(self, name: str, x) -> np.ndarray:
        """x as finite numbers (joints,), or ValueError naming it."""
        x = real_array(name, x)
        if x.shape != (self.joints,) or not np.isfinite(x).all():
            raise ValueError(f"{name} must be {self.joints} finite numbers for this system, got {short(x.tolist())}")
        return x

    def run(self, alpha, alphadot, work: bool = False) -> Cycle:
        """A gait given by alpha, alphadot (..., N, joints) at N equally spaced phases; ValueError at a singular shape."""
        self.refuse_singular(alpha)
        xi, speed = evaluate(self.velocity, alpha, alphadot), np.sqrt((alphadot**2).sum(-1)).mean(-1)
        return Cycle(xi, displacement(xi), 0.0 * speed, speed, None, 1, 0.0 * speed)

    def driven(self, alpha, alphadot) -> tuple[np.ndarray, np.ndarray]:
        """(xi (..., 3), power (...)): `velocity`, and the rate of work against the medium that moving so takes, in axial
        drags of the whole body times body lengths a unit of time (`rft.work_done`), for a body ``length`` in any unit.
        ValueError if nothing says what it takes."""
        if not hasattr(self, "work"):
            raise ValueError(f"no power with the {self.kind}: nothing says what a change of shape costs it")
        xi = self.velocity(alpha, alphadot)
        return xi, self.work(alpha, alphadot, xi).power / self.length

    def power(self, alpha, alphadot) -> np.ndarray:
        """What a change of shape costs, (...), as `driven` has it."""
        return self.driven(alpha, alphadot)[1]

    def path(self, alpha, alphadot, cycles: int = 1) -> np.ndarray:
        """Poses (cycles N + 1, 3) of the frame, seen from where it is at first, through so many cycles of a gait given by
        alpha, alphadot (N, joints) as in `run`, whose net pose the first of them ends at."""
        return repeated(poses(self.run(alpha, alphadot).xi), cycles)

    def fitted(self, axes, count: int, degree: int, progress: Callable | None = None) -> Connection:
        """The least-squares connection on a grid, from so many directions; other arguments as in `connection.fit`."""
        known = {"traits": self.traits, "trusted": True, "unit": length_unit(self), "length": self.length}
        return fit(self.velocity, axes, count, degree, progress, **known)

    def images(self, alpha, alphadot) -> Around:
        """Which phases of gaits, as in `run`, are solved, and how the others follow: all, unless a system says else."""
        return around(alpha, alphadot, NOTHING)

    def at_once(self, phases: int) -> int:
        """Amplitudes of a gait that are run side by side, at least one: more would take more memory and no less time."""
        return max(1, VALUES_TOGETHER // (phases * (self.joints + 6)))

    def symbolic(self) -> tuple[Any, tuple[Any, ...]]:
        """A (3, joints) as a sympy Matrix, and its shape variables (`geomech.symbolic`); ValueError if it has no formula."""
        raise ValueError(f"no formula of the connection of a {self.kind}: 'geomech connection' has its numbers")

    def stored(self, name: str) -> Any:
        """Its own table, "connection" or "harmonics", where it is known by one; None where tables are computed."""
        return None

    def own_error(self, alpha, alphadot) -> np.ndarray:
        """(..., 2), body lengths and rad: what the velocity itself leaves of the displacement of a gait given as in `run`;
        0 for one that follows from a law."""
        return np.zeros((*np.shape(alpha)[:-2], 2))

    def finer(self) -> System | None:
        """The system with its velocity computed more exactly, None where it is exact already."""
        return None

    def in_frame(self, frame: str) -> Self:
        """The system seen from another of its frames; ValueError if it has none of that name."""
        return dataclasses.replace(self, frame=frame)

    def with_solver(self, **changes) -> Self:
        """The system with some of its own [numerics] changed."""
        for name in changes:
            choose(f"the {self.kind}'s [numerics]", name, [f.name for f in dataclasses.fields(self.solver or NoSolver)])
        return dataclasses.replace(self, solver=dataclasses.replace(self.solver, **changes)) if changes else self

    @property
    def costs_as(self) -> str:
        """The same for systems whose velocities take the same time."""
        return repr(self)

    @property
    def blames(self) -> str:
        """All that lack a premise, by name."""
        return f"the {self.kind}"

    def blame(self, premises: Premise) -> str:
        """Who lacks one of these premises, to follow "no connection with"; empty if nobody does."""
        return f"the {self.kind}, which is {negated(self.traits.lacks)}" if self.traits.lacks & premises else ""

    def refuse(self, what: str, premises: Premise, instead: str) -> None:
        """ValueError if there is no such result because a premise of it does not hold."""
        if blame := self.blame(premises):
            raise ValueError(f"no {what} with {blame}: {instead}")

    def refuse_singular(self, alpha) -> None:
        """ValueError naming the first shape at which a closed path alpha (..., N, joints) meets a singular one."""
        if self.traits.singularity is None:
            return
        d = self.traits.singularity(alpha)
        met = (d == 0) | (d * np.roll(d, -1, -1) < 0)
        if met.any():
            shape = ", ".join(f"{x:.3g}" for x in np.asarray(alpha)[met][0])
            raise ValueError(
                f"the gait meets the singular shape near alpha = ({shape}), where {self.traits.singular}: "
                "move its centre, or lower the amplitude"
            )

    def about(self) -> dict:
        """Attributes of a file of results, beside those every system has."""
        return {}

    def told(self) -> list[str]:
        """What it is and what follows, in lines; the first continues the scene's name."""
        fields = ", ".join(f"{f.name} = {short(getattr(self, f.name))}" for f in dataclasses.fields(self))
        return [f"{self.kind} ({fields})"]

    @property
    def because(self) -> str:
        """Why it needs its engine, and what that does."""
        return "(the velocity at every shape, all shapes at once): nothing remembers, places are alike, no mass"


def checked_system(system) -> System:
    """system, or ValueError if it is nothing of the kind."""
    if isinstance(system, type) or not all(hasattr(system, x) for x in ("joints", "velocity", "run", "traits")):
        raise ValueError(f"system must be a system such as Swimmer(medium, body), got {short(system)}")
    refuse_mutable(system)
    return system


def length_unit(system: System) -> str:
    """Return the unit of a system's lengths: body lengths, or metres where its body has a size."""
    return system.traits.unit or ("BL" if system.length == 1.0 else "m")


def shape_labels(system: System) -> tuple[tuple[str, str], ...]:
    """Return (name, unit) of each shape variable of a system, for axes."""
    return system.traits.labels or tuple((f"alpha_{k + 1}", "rad") for k in range(system.joints))


def refuse_mutable(*parts) -> None:
    """ValueError for a part of a class that has no hash: tables are kept under the system that they are of."""
    for part in parts:
        if type(part).__hash__ is None:
            raise ValueError(f"{type(part).__name__} must be a value: put @dataclass(frozen=True) above the class")
