"""Abilities that only some systems have.

Each is a protocol with few readers; `capability` returns the object with an ability. A
class has an ability by having its members. Where the ability depends on values, as the
covariance of a swimmer does, or on a system inside, the class has a method
``capability(kind)`` that returns the object with the ability, or None."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple, Protocol, TypeVar, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from geomech.mathematics.systems.base import System, kind_of
from rft.core.premise import Premise
from rft.core.refusal import Refusal

T = TypeVar("T")
# Angles and velocities of gaits that are run at a time: with all arrays computed from
# them a batch takes some 120 MB. Larger batches take no less time for each gait; after
# the first the time of the others is known.
VALUES_TOGETHER = 1 << 20
# Likewise for time steps, which take their time however few gaits are stepped.
STEPPED_TOGETHER = 1 << 22


def capability(system: System, kind: type[T]) -> T | None:
    """Return the object that has an ability of a system, a protocol of this module;
    None for a system without it.

    Examples
    --------
    >>> from geomech.mathematics.systems import DifferentialDrive, Swimmer, capability
    >>> from geomech.mathematics.systems.capabilities import Dissipative
    >>> from rft import Chain, Viscous
    >>> capability(Swimmer(Viscous(), Chain()), Dissipative) is None
    False
    >>> capability(DifferentialDrive(), Dissipative) is None
    True
    """
    method = getattr(system, "capability", None)
    if method:
        return method(kind)
    return system if isinstance(system, kind) else None


@runtime_checkable
class Refinable(Protocol):
    """A velocity with a numerical error; read by `geomech.studies.estimates.estimate`.

    closed: whether the refined velocity has exact integrals over elements, else a finer
    rule."""

    closed: bool

    def refined(self) -> System | None:
        """Return the system with a velocity closer to the exact one, None where it is
        exact; its `run` takes ``start``, velocities nearby (..., N, 3)."""


@runtime_checkable
class Dissipative(Protocol):
    """A body that does work against its medium; read by
    `geomech.studies.estimates.effort` and `geomech.studies.optimisation`."""

    def power(self, alpha, alphadot, xi) -> np.ndarray:
        """Return the rate of work (...) at shapes, rates (..., d) and the velocity
        (..., 3) that they lead to, in axial drags of the whole body times body lengths
        a unit of time."""


@runtime_checkable
class OwnMetric(Protocol):
    """A shape space whose metric M is not one of drag but, say, of kinetic energy; read
    by `geomech.studies.estimates.effort`."""

    def squared_speed(self, alpha, alphadot) -> np.ndarray:
        """Return alphadot^T M(alpha) alphadot (...) at shapes and rates (..., d)."""


@runtime_checkable
class Loaded(Protocol):
    """A body under forces along its length; read by `geomech.studies.mechanics.forces`
    and `undulation`.

    axial_drag: on the whole straight body along itself, in the law's unit of force."""

    axial_drag: float

    def axial_stress(self, depth: float) -> float | None:
        """Return the axial drag over projected area, Pa, at a depth, m, where the
        medium is a measured one."""

    def elements(self, alpha: ArrayLike, alphadot: ArrayLike) -> Any:
        """Return the `rft.bodies.Elements` (n, N) of the body at shapes and rates (N,
        d), in a fixed frame."""

    def subdivided(self) -> System:
        """Return the system with its body cut into short elements."""


@runtime_checkable
class Drawable(Protocol):
    """A body to draw; read by `geomech.studies.mechanics.motion`."""

    def points(self, alpha, pose) -> np.ndarray:
        """Return the ends of the links (..., links + 1, 2) in the world, tail to head,
        at shapes (..., d) and poses of the frame (..., 3)."""


@runtime_checkable
class Tabulated(Protocol):
    """A velocity that is interpolated in stored tables; read wherever a table would be
    computed.

    near_gait: the gait near which alone the velocity is known, in words; "" where it is
    known everywhere."""

    near_gait: str

    def table(self, name: str) -> Any:
        """Return the table "connection", "harmonics", "metric", "even part" or
        "A_error"; None without it."""

    def table_error(self, alpha, alphadot) -> np.ndarray:
        """Return the errors (..., 2), body lengths and rad, of the net pose of cycles
        (..., N, d) that the tables cause."""


@runtime_checkable
class Uncertain(Protocol):
    """Parameters with a covariance; read by `geomech.studies.estimates.uncertainty`."""

    covariance: Any  # (n, n)

    def varied(self, step) -> System:
        """Return the system with parameters changed by ``step`` (n,); Refusal if there
        is no such system."""


@runtime_checkable
class Stepped(Protocol):
    """Cycles that differ from one another; read by `geomech.studies.mechanics.motion`
    and `choose`.

    settling: change of displacement at which cycles count as repeating, body lengths or
    rad; 0 if they are not run until they do."""

    settling: float

    def path(self, alpha, alphadot, cycles: int) -> np.ndarray:
        """Return poses (cycles N + 1, 3) of the frame, relative to the first, of a
        cycle (N, d) repeated ``cycles`` times."""


@runtime_checkable
class Compliant(Protocol):
    """Joints that give way, so that a gait is only a command; read by
    `geomech.studies.realised`.

    prescribed: the system with its joints held at the gait."""

    prescribed: System

    def commanded(self, alpha) -> np.ndarray:
        """Return shapes (..., d) of a gait with passive joints at rest."""

    def time_steps(
        self, alpha, alphadot, cycles, work=False, path=False, start=None
    ) -> Any:
        """Return the `rft.TimeSteps` of gaits (..., N, d) from shapes (..., d) one step
        before the first phase."""


@runtime_checkable
class PartlyLifted(Protocol):
    """A body of which parts touch the ground at a time; read by
    `geomech.studies.mechanics.motion` and `geomech.studies.mechanics.outcome`.

    touching_body: the body, which ``rests`` if it lies on the ground, so that it may
    roll over."""

    touching_body: Any

    def contact_state(self, alpha, heading) -> Any:
        """Return the `rft.contacts.ContactState` at shapes (B, d) and headings (B,) of
        the frame on the ground, rad."""


class BalanceSize(NamedTuple):
    """The size of the balance of forces of one velocity; the defaults are for a system
    that solves none.

    elements: number of straight parts of the body. evaluations: number of points at
    which forces are evaluated. pieces: per body length, into which effects that vary
    along elements cut these; 0 without such effects. memory: number of values that time
    stepping stores. batched: whether there is a parameter for each amplitude, so that
    gaits are run together. seconds: time of one balance, s, of a system whose velocity
    is no closed form and that has no `Tunable` solver; None for others. all_rates:
    whether one balance gives the velocities of a shape at all rates."""

    elements: int = 1
    evaluations: int = 1
    pieces: int = 0
    memory: int = 0
    batched: bool = False
    seconds: float | None = None
    all_rates: bool = False


@runtime_checkable
class Costed(System, Protocol):
    """A velocity that takes a balance of forces; read by
    `geomech.studies.estimates.cost`."""

    balance_size: BalanceSize


@runtime_checkable
class Tunable(Protocol):
    """A system with its own part of [numerics]; read by `geomech.scenes`.

    solver: a dataclass."""

    solver: Any

    def with_solver(self, solver) -> System:
        """Return the system with another solver."""


class Part(NamedTuple):
    """A part that breaks premises. role: "law" or "effect"; name: of its kind."""

    role: str
    name: str
    breaks: Premise


@runtime_checkable
class Composite(Protocol):
    """A system whose parts break premises; read by
    `geomech.mathematics.systems.premises`."""

    parts: tuple[Part, ...]


@runtime_checkable
class Diagnosed(Protocol):
    """A velocity that comes with a status and a residual; read by `geomech
    velocity`."""

    def diagnosed(self, alpha, alphadot) -> dict:
        """Return {"xi", "status", "residual"}, and more, for one shape and rate
        (d,)."""


@runtime_checkable
class Symbolic(Protocol):
    """A connection with a formula; read by `geomech symbolic`."""

    def symbolic(self) -> tuple[Any, tuple[Any, ...]]:
        """Return A (3, d) as a sympy Matrix, and its shape variables."""


@runtime_checkable
class Recorded(Protocol):
    """Attributes for a file of its connection; read by `geomech.questions`."""

    def about(self) -> Mapping[str, Any]:
        """Return the attributes by name."""


@runtime_checkable
class Noted(Protocol):
    """A model that its user may not know in detail; read by `geomech explain`.

    notes: facts about it, a line each."""

    notes: tuple[str, ...]


def stored_table(system: System, name: str) -> Any:
    """Return the table of that name that a system interpolates; None where tables are
    computed."""
    tabulated = capability(system, Tabulated)
    if tabulated is None:
        return None
    return tabulated.table(name)


def pieces_per_length(system: System) -> int:
    """Return the number of pieces per body length into which effects that vary along
    elements cut the body; 0 without such effects."""
    return balance_size(system).pieces


def refined(system: System) -> System | None:
    """Return the system with its velocity computed more exactly, None where it is
    exact."""
    refinable = capability(system, Refinable)
    if refinable is None:
        return None
    return refinable.refined()


def power(system: System, alpha, alphadot) -> np.ndarray:
    """Return the power (...) of a dissipative system at shapes and rates (..., d), in
    the unit of `Dissipative.power`."""
    return velocity_and_power(system, alpha, alphadot)[1]


def velocity_and_power(
    system: System, alpha, alphadot
) -> tuple[np.ndarray, np.ndarray]:
    """Return xi (..., 3) and power (...) of the same solutions; Refusal for a system
    without a power."""
    dissipative = capability(system, Dissipative)
    if dissipative is None:
        raise Refusal(
            f"no power is known for the {kind_of(system)}",
            because="nothing defines what a change of shape costs",
        )
    xi = system.velocity(alpha, alphadot)
    return xi, dissipative.power(alpha, alphadot, xi)


def balances_at_rates(system: System, n_rates: int) -> int:
    """Return the number of balances for the velocities of one shape at a number of
    rates."""
    if system.traits.linear and balance_size(system).all_rates:
        return 1
    return n_rates


def settling(system: System) -> float:
    """Return the change of displacement at which cycles count as repeating; 0 where
    they are not run until they do."""
    stepped = capability(system, Stepped)
    if stepped is None:
        return 0.0
    return stepped.settling


def solver_of(system: System) -> Any:
    """Return the system's own part of [numerics], a dataclass; None without one."""
    tunable = capability(system, Tunable)
    if tunable is None:
        return None
    return tunable.solver


def with_solver(system: System, changes: Mapping[str, Any]) -> System:
    """Return a system with some of its own [numerics] changed."""
    if not changes:
        return system
    return system.with_solver(replace(solver_of(system), **changes))


def gaits_per_batch(system: System, phases: int) -> int:
    """Return how many amplitudes of a gait are run at a time, at least one: more take
    more memory and no less time."""
    size = balance_size(system)
    if size.batched:
        return sys.maxsize
    if not system.traits.steps:
        values = phases * max(system.joints + 6, 2 * size.elements)
        return max(1, VALUES_TOGETHER // values)
    # Beside the memory of effects time stepping has some thirty arrays of elements,
    # where a gait has some ten of angles.
    stepped = 4 * size.elements + size.memory // 8
    values = max(phases * (system.joints + 6), stepped)
    return max(1, STEPPED_TOGETHER // values)


def near_gait(system: System) -> str:
    """Return the gait near which alone a system is valid, in words; "" where it is
    valid everywhere."""
    tabulated = capability(system, Tabulated)
    if tabulated is None:
        return ""
    return tabulated.near_gait


def table_error(system: System, alpha, alphadot) -> np.ndarray:
    """Return the errors (..., 2), body lengths and rad, of the net pose of cycles (...,
    N, d) that tables cause; 0 without tables."""
    tabulated = capability(system, Tabulated)
    if tabulated is None:
        return np.zeros((*np.shape(alpha)[:-2], 2))
    return tabulated.table_error(alpha, alphadot)


def is_closed(system: System) -> bool:
    """Return whether a system computes its velocity with an error, and `refined` has
    exact integrals."""
    refinable = capability(system, Refinable)
    return refinable is not None and refinable.closed


def balance_size(system: System) -> BalanceSize:
    """Return the size of the balance that a system's velocity takes."""
    costed = capability(system, Costed)
    if costed is None:
        return BalanceSize()
    return costed.balance_size
