"""Engines that compute walks, by name. An engine is one module with the functions of
`Engine`, and a line in `ENGINES`."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, NamedTuple, Protocol

from rft.core.checks import Number, check_numbers
from rft.core.refusal import Refusal, formatted, require
from rft.terradynamics.ground import (
    GROUND_EFFECTS,
    Ground,
    GroundEffect,
    checked_effects,
    ground_of,
    rise_of,
)
from rft.terradynamics.meshes.forces.law import Spatial
from rft.terradynamics.plates.stress import PlateStress
from rft.terradynamics.walking.planar.stride import Walk, compute_stride
from rft.terradynamics.walking.prints import PrintedGround
from rft.terradynamics.walking.robot import SMALLEST_ROUNDING, Robot, Tripod


@dataclass(frozen=True)
class Walker:
    """A robot, its clock and its ground. stress: a stress map of the vertical plane, or
    a law of three dimensions. effects: on the ground, those on which robots walk.
    On a slope x is along the surface and z along its normal.

    Examples
    --------
    >>> from rft.terradynamics.plates import CLeg, StressMap
    >>> from rft.terradynamics.walking import Fineness, Rhex, Tripod, Walker, engine
    >>> robot = Rhex(0.15, 0.13, 0.02, 0.03, CLeg(0.02, 0.01), hips=(-0.05, 0.0, 0.05))
    >>> walker = Walker(robot, Tripod(frequency=2.0), StressMap(zeta=0.6))
    >>> (walk,) = engine("planar").walk([walker], Fineness(steps=16))
    >>> walk.status, round(walk.speed, 3)
    ('walking', 0.305)
    """

    robot: Robot
    gait: Tripod
    stress: PlateStress | Spatial
    effects: tuple[GroundEffect, ...] = ()

    def __post_init__(self):
        for name, kind, spoken in (
            ("robot", Robot, "Robot"),
            ("gait", Tripod, "Tripod"),
            ("stress", PlateStress | Spatial, "PlateStress or Spatial"),
        ):
            value = getattr(self, name)
            require(isinstance(value, kind), f"{name} must be a {spoken}", value=value)
        object.__setattr__(self, "effects", checked_effects(self.effects))
        for effect in self.effects:
            kinds = sorted(k for k, kind in GROUND_EFFECTS.items() if kind.walks)
            require(
                effect.kind != PrintedGround.kind or effect.walks,
                f"{type(effect).__name__} is for intruders",
                instead="use PrintedGround",
            )
            require(
                effect.walks,
                f"walking supports the effects {', '.join(kinds)}, not {effect.kind}",
                instead="remove it",
            )
            require(
                not getattr(effect, "mass", 0.0),
                f"a robot has a mass of its own, {effect.kind} needs none",
                instead=f"remove ``mass`` of {effect.kind}",
            )
        printed = [e for e in self.effects if isinstance(e, PrintedGround)]
        require(
            len(printed) <= 1,
            "disturbed-ground appears twice in effects",
            instead="keep one of them",
        )

    @property
    def ground(self) -> Ground:
        """Ground with all effects."""
        return ground_of(self.effects)

    @property
    def rise(self) -> float:
        """Angle by which the surface rises ahead of the robot, rad."""
        return rise_of(self.effects)

    @property
    def prints(self) -> PrintedGround | None:
        """The effect by which the ground remembers steps, if there is one."""
        for effect in self.effects:
            if isinstance(effect, PrintedGround):
                return effect
        return None


@dataclass(frozen=True)
class Fineness:
    """Numerical settings of a walk.

    engine (-): planar or mujoco; the default is planar, or mujoco for robots and ground
    in three dimensions.

    Examples
    --------
    >>> from rft.terradynamics.walking import Fineness
    >>> Fineness(steps=64).elements  # of each leg, where none are given
    12
    """

    steps: Annotated[
        int, Number(8, 10_000, "-", "number of time steps per cycle", whole=True)
    ] = 32
    elements: Annotated[
        int,
        Number(
            4,
            1000,
            "-",
            "number of elements of a leg's outline, and of the belly",
            whole=True,
        ),
    ] = 12
    rounding: Annotated[
        float,
        Number(
            SMALLEST_ROUNDING, 0.1, "m/s",
            "speed below which drag falls in proportion to speed; for slow legs at "
            "most 5 % of the speed of their ends",
        ),
    ] = 3e-3  # fmt: skip
    duration: Annotated[
        float, Number(1e-3, 1e4, "s", "longest time of walking from rest")
    ] = 10.0
    engine: str | None = None

    def __post_init__(self):
        valid = self.engine is None or (
            isinstance(self.engine, str) and self.engine in ENGINES
        )
        require(valid, f"engine must be one of {', '.join(ENGINES)}", value=self.engine)
        check_numbers(self)


class Variation(NamedTuple):
    """Numerics that differ in one setting, for an estimate of its error.

    setting: "steps" or "elements". factor: error of the speed over its change with
    these numerics, at least. cost: of a walk's strides with these numerics over their
    cost without."""

    numerics: Fineness
    setting: str
    factor: float
    cost: float


# Error of the speed over its change with twice the elements; up to 1.49 measured, 4/3
# for order 2.
ELEMENT_FACTOR = 1.5


def with_more_elements(numerics: Fineness, cost: float) -> Variation:
    """Return numerics with twice the elements."""
    finer = replace(numerics, elements=min(1000, 2 * numerics.elements))
    return Variation(finer, "elements", ELEMENT_FACTOR, cost)


class Engine(Protocol):
    """A module that computes walks. ORDER: of its time steps."""

    ORDER: int

    def variations(self, numerics: Fineness) -> list[Variation]:
        """Return the numerics by which errors are estimated, at least one for each
        setting."""
        ...

    def refuse(self, walker: Walker) -> None:
        """Raise ValueError for a walker that this engine cannot compute."""
        ...

    def walk(
        self,
        walkers: Sequence[Walker],
        numerics: Fineness,
        cycles: int | None = None,
        progress: Callable | None = None,
        advance: Callable = compute_stride,
    ) -> list[Walk]:
        """Return the walks of walkers from rest, with their speeds at the limit cycle.

        A walk lasts ``cycles`` cycles, by default the duration of the numerics, or
        until the robot's end. progress: receives the finished fraction. advance:
        computes a stride, as
        `rft.terradynamics.walking.planar.stride.compute_stride`."""
        ...

    def rerun(
        self,
        walkers: Sequence[Walker],
        numerics: Fineness,
        walks: Sequence[Walk],
        cycles: int | None = None,
        advance: Callable = compute_stride,
    ) -> list[Walk]:
        """Return given walks with other numerics.

        A walk with a limit cycle starts near it, and only the fields of the limit cycle
        change; others are computed from rest."""
        ...

    def step_cost(
        self, walkers: Sequence[Walker], numerics: Fineness, seconds: float
    ) -> tuple[float, float]:
        """Return the cost of a time step of equal walkers side by side: processor
        seconds for all of them, and evaluations of forces for one.

        They are measured on the first steps of the walks: all steps of a stride, or as
        many as ``seconds`` s of computing allow."""
        ...


def engine(name: str) -> Engine:
    """Return the engine of a name; ValueError for unknown engines and those that are
    not installed.

    Examples
    --------
    >>> from rft.terradynamics.walking import ENGINES, engine
    >>> list(ENGINES), callable(engine("planar").walk)
    (['planar', 'mujoco'], True)
    """
    require(
        isinstance(name, str) and name in ENGINES,
        f"engine must be one of {', '.join(ENGINES)}",
        value=name,
    )
    try:
        return importlib.import_module(ENGINES[name])
    except ModuleNotFoundError as error:
        if error.name != name:
            raise
        raise Refusal(
            f"the {name} engine is not installed",
            instead=f"pip install 'geomech[{name}]'",
        ) from None
    except (
        Exception
    ) as error:  # importing MuJoCo loads the library that MUJOCO_GL names
        raise Refusal(
            f"the {name} engine cannot be loaded",
            because=formatted(str(error)),
            instead="is MUJOCO_GL right?",
        ) from None


ENGINES = {
    "planar": "rft.terradynamics.walking.planar_walk",
    "mujoco": "rft.terradynamics.walking.mujoco_walk",
}
