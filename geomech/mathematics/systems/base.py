"""The interface of a system: five members, and adapters for objects that have fewer."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, Protocol

import numpy as np

from geomech.core import summary
from geomech.core.errors import check_angle
from geomech.mathematics.geometry.periods import checked_periods
from geomech.mathematics.geometry.reconstruct import displacement
from geomech.mathematics.geometry.traits import NOTHING, Traits, unit_of
from geomech.mathematics.geometry.velocity import evaluate, in_batches
from rft.bodies.base import body_size as body_size  # of systems as well
from rft.core.checks import in_range, unmasked
from rft.core.refusal import Refusal
from rft.core.registry import Registry, classes_with

MEMBERS = ("joints", "length", "traits", "velocity", "run")


class Cycle(NamedTuple):
    """A gait run once, for amplitudes (...,).

    xi: (..., N, 3), body velocity by phase. net: (..., 3), pose after the cycle in the
    frame at its start. residual: (...), the largest of the cycle. speed: (...), mean
    |alphadot|, 1. work: power, internal moments and slip, (..., N) each
    (`rft.work_done`), or None. cycles: number that time stepping took, 1 without it.
    to_come: (...), change of displacement still to come where cycles go on until they
    repeat, body lengths or rad; 0 elsewhere. springs: the shape that joints take which
    give way, (..., N, d), and their torques (`rft.motion.compliance.SpringMotion`), or
    None.

    Examples
    --------
    >>> from geomech.mathematics.gaits import Circle
    >>> from geomech.mathematics.systems import DifferentialDrive
    >>> cycle = DifferentialDrive().run(*Circle(0.5).cycle(64))
    >>> cycle.xi.shape, cycle.net.shape
    ((64, 3), (3,))
    """

    xi: np.ndarray
    net: np.ndarray
    residual: np.ndarray
    speed: np.ndarray
    work: Any
    cycles: int
    to_come: np.ndarray
    springs: Any = None

    def __repr__(self) -> str:
        count = np.size(self.speed)
        gaits = "1 gait" if count == 1 else f"{count} gaits"
        parts = [
            f"{gaits} of {np.shape(self.xi)[-2]} phases, net {summary.poses(self.net)}",
            f"residual up to {np.max(self.residual, initial=0.0):.1e}",
        ]
        if self.cycles > 1:
            parts.append(f"{self.cycles} cycles")
        if self.work is not None:
            parts.append("with work")
        return f"Cycle({'; '.join(parts)})"


class System(Protocol):
    """A body velocity for every shape and every rate of change of shape.

    Abilities of only some systems are in `geomech.mathematics.systems.capabilities`.

    Examples
    --------
    >>> import numpy as np
    >>> from geomech.mathematics.systems import as_system
    >>> class Roller:
    ...     joints = 1
    ...
    ...     def velocity(self, alpha, alphadot):
    ...         return np.concatenate([alphadot, 0 * alphadot, 0 * alphadot], -1)
    ...
    >>> as_system(Roller()).velocity(np.zeros(1), np.ones(1))
    array([1., 0., 0.])
    """

    @property
    def joints(self) -> int:
        """Number d of shape variables."""

    @property
    def length(self) -> float | None:
        """Length of the body, m; None where lengths are in body lengths."""

    @property
    def traits(self) -> Traits:
        """Facts that algorithms may use to save work."""

    def velocity(self, alpha: np.ndarray, alphadot: np.ndarray) -> np.ndarray:
        """Return xi (..., 3) at shapes and rates (..., d), in the body frame; nan at
        singular shapes."""

    def run(self, alpha: np.ndarray, alphadot: np.ndarray, work: bool = False) -> Cycle:
        """Return the cycle of a gait with shapes and rates (..., N, d) at N equally
        spaced phases."""


def integrated(
    system: System, alpha: np.ndarray, alphadot: np.ndarray, work: bool = False
) -> Cycle:
    """Return the cycle of a velocity that follows from shape alone, by integration.

    Classes use it as their ``run``. Refusal at a singular shape.

    Examples
    --------
    >>> from geomech.mathematics.gaits import Circle
    >>> from geomech.mathematics.systems import NoSlipSnake, integrated
    >>> cycle = integrated(NoSlipSnake(), *Circle(0.3, centre=(0.7, -0.7)).cycle(64))
    >>> cycle.net[:2].round(3)  # x, y in body lengths
    array([0.063, 0.009])
    """
    refuse_singular(system, alpha)
    xi = evaluate(system.velocity, alpha, alphadot)
    speed = np.sqrt((alphadot**2).sum(-1)).mean(-1)
    return Cycle(
        xi=xi,
        net=displacement(xi),
        residual=0.0 * speed,
        speed=speed,
        work=None,
        cycles=1,
        to_come=0.0 * speed,
    )


@dataclass(frozen=True)
class WrappedSystem:
    """A system that `as_system` builds from a velocity alone, or from an object that
    lacks some of the five members.

    wrapped: the function, or the object. joints, length, traits: as in `System`."""

    wrapped: Any
    joints: int
    length: float | None = None
    traits: Traits = NOTHING

    def __post_init__(self):
        in_range("joints", self.joints, 1, 10_000, whole=True)
        if self.length is not None:
            in_range("length", self.length, 1e-9, 1e9)
        if not isinstance(self.traits, Traits):
            raise Refusal("traits must be Traits(...)", value=self.traits)
        checked_periods(self.traits.periods, self.joints)
        if not _accepts_two(self._velocity):
            raise Refusal(f"the velocity of {self.kind} must accept (alpha, alphadot)")

    @property
    def kind(self) -> str:
        return kind_of(self.wrapped)

    @property
    def _velocity(self) -> Callable:
        return getattr(self.wrapped, "velocity", self.wrapped)

    @cached_property
    def _batched(self) -> Callable:
        """The velocity for many shapes at once, whether the wrapped one takes them or
        not."""
        alpha, rates = np.random.default_rng(0).normal(size=(2, 3, self.joints))
        return in_batches(self._velocity, *np.broadcast_arrays(alpha[:, None], rates))

    def velocity(self, alpha, alphadot) -> np.ndarray:
        alpha = unmasked("alpha", alpha)
        alphadot = unmasked("alphadot", alphadot)
        alpha, alphadot = np.broadcast_arrays(alpha, alphadot)
        masked = self.traits.singularity is not None
        return evaluate(self._batched, alpha, alphadot, masked=masked)

    def run(self, alpha, alphadot, work: bool = False) -> Cycle:
        method = getattr(self.wrapped, "run", None)
        if method is None:
            return integrated(self, alpha, alphadot)
        return method(alpha, alphadot)

    def __reduce__(self) -> tuple:
        return WrappedSystem, (self.wrapped, self.joints, self.length, self.traits)

    def capability(self, kind: type) -> Any:
        """Return the wrapped object, if it has the ability."""
        return self.wrapped if isinstance(self.wrapped, kind) else None


def _accepts_two(function: Callable) -> bool:
    """Return whether a function takes two arguments, or does not say what it takes."""
    try:
        inspect.signature(function).bind(None, None)
    except TypeError:
        return False
    except ValueError:  # it has no signature
        return True
    return True


def as_system(system: Any, joints: int | None = None) -> System:
    """Return a system from an object with a velocity: the object itself where it has
    the five members, else with defaults for those it lacks.

    joints: of a function without an attribute ``joints``. Refusal for anything else.

    Examples
    --------
    >>> import numpy as np
    >>> from geomech.mathematics.systems import as_system
    >>> def drift(alpha, alphadot):
    ...     x = alphadot[..., 0] * np.sin(alpha[..., 1])
    ...     return np.stack([x, 0 * x, 0 * x], -1)
    ...
    >>> system = as_system(drift, joints=2)
    >>> system.joints, system.length  # in body lengths
    (2, None)
    """
    if not isinstance(system, type) and all(hasattr(system, name) for name in MEMBERS):
        refuse_mutable(system)
        if not isinstance(system.traits, Traits):
            raise Refusal(
                f"traits of the {kind_of(system)} must be Traits(...)",
                value=system.traits,
            )
        return system
    function = getattr(system, "velocity", system)
    traits = getattr(system, "traits", NOTHING)
    if isinstance(traits, Traits) and traits.periods:
        joints = len(traits.periods)
    joints = getattr(system, "joints", joints)
    if isinstance(system, type) or not callable(function) or joints is None:
        raise Refusal(
            "system must be a system such as Swimmer(medium, body), or a function"
            " velocity(alpha, alphadot)",
            value=system,
        )
    refuse_mutable(system)
    return WrappedSystem(
        system,
        joints,
        getattr(system, "length", None),
        traits,
    )


def unwrapped(system: Any) -> Any:
    """Return the object that `as_system` received."""
    return system.wrapped if isinstance(system, WrappedSystem) else system


def kind_of(system: Any) -> str:
    """Return the name of a kind of system, for messages."""
    kind = getattr(system, "kind", None)
    return kind or getattr(system, "__name__", type(system).__name__)


def note_angles(system: System, largest: float) -> None:
    """Warn (`UnitWarning`) if the largest of some shape variables is a joint angle
    beyond a full turn."""
    if system.traits.joint_angles:
        check_angle("a joint angle", largest)


SYSTEMS = Registry("geomech.systems", "kind", "a system", classes_with("velocity"))


def length_unit(system: System) -> str:
    """Return the unit of a system's lengths: body lengths, or metres where its body has
    a size."""
    return system.traits.unit or unit_of(system.length)


def shape_labels(system: System) -> tuple[tuple[str, str], ...]:
    """Return (name, unit) of each shape variable of a system, for axes."""
    if system.traits.labels:
        return system.traits.labels
    return tuple((f"alpha_{k + 1}", "rad") for k in range(system.joints))


def refuse_singular(system: System, alpha) -> None:
    """Refuse a closed path alpha (..., N, joints) that meets a singular shape, and name
    the first one."""
    method = getattr(system, "refuse_singular", None)
    if method:
        method(alpha)
        return
    singularity = system.traits.singularity
    if singularity is None:
        return
    d = singularity(alpha)
    singular = (d == 0) | (d * np.roll(d, -1, -1) < 0)
    if singular.any():
        shape = ", ".join(f"{x:.3g}" for x in np.asarray(alpha)[singular][0])
        raise Refusal(
            f"the gait passes the singular shape near alpha = ({shape}), where "
            f"{system.traits.singular}",
            instead="move its centre, or lower the amplitude",
        )


def refuse_mutable(*parts) -> None:
    """Refuse a part of a class without a hash: tables are stored by the system's
    hash."""
    for part in parts:
        if type(part).__hash__ is None:
            raise Refusal(
                f"{type(part).__name__} must be a frozen dataclass",
                instead="put @dataclass(frozen=True) above the class",
            )
