"""What computes how robots walk, by name. An engine is one module and its name here."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Protocol

from rft.checks import Number, check_numbers, require, shown
from rft.ground import Ground, GroundEffect, checked_effects, ground_of
from rft.meshes.law import Spatial
from rft.plates.stress import PlateStress
from rft.walking.robot import SMALLEST, Robot, Tripod
from rft.walking.stride import Walk, advanced


@dataclass(frozen=True)
class Walker:
    """A robot, its clock and its ground: a stress map of the vertical plane, or a law of three dimensions. effects: aeration
    and grain inertia."""

    robot: Robot
    gait: Tripod
    stress: PlateStress | Spatial
    effects: tuple[GroundEffect, ...] = ()

    def __post_init__(self):
        for name, kind in (("robot", Robot), ("gait", Tripod), ("stress", PlateStress | Spatial)):
            value, such = getattr(self, name), getattr(kind, "__name__", "PlateStress or Spatial")
            require(isinstance(value, kind), f"{name} must be a {such}, got {shown(value)}")
        object.__setattr__(self, "effects", checked_effects(self.effects))
        for effect in self.effects:
            require(effect.walks, f"walking takes the effects aeration and grain-inertia, not {effect.kind}: drop it")

    @property
    def ground(self) -> Ground:
        """What the effects make of it."""
        return ground_of(self.effects)


@dataclass(frozen=True)
class Fineness:
    """Numerical settings of a walk.

    engine (-): planar or mujoco; if left out the planar one, but for robots and ground of three dimensions.
    """

    steps: Annotated[int, Number(8, 10_000, "-", "time steps of a cycle", whole=True)] = 32
    elements: Annotated[int, Number(4, 1000, "-", "elements of a leg's outline; the belly has as many", whole=True)] = (
        12
    )
    rounding: Annotated[
        float,
        Number(
            SMALLEST, 0.1, "m/s",
            "speed below which drag falls off in proportion to speed; of slow legs it is no more than 5 % of the speed of "
            "their ends",
        ),
    ] = 3e-3  # fmt: skip
    duration: Annotated[float, Number(1e-3, 1e4, "s", "time of walking from rest, at most")] = 10.0
    engine: str | None = None

    def __post_init__(self):
        good = self.engine is None or (isinstance(self.engine, str) and self.engine in ENGINES)
        require(good, f"engine must be one of {', '.join(ENGINES)}, got {shown(self.engine)}")
        check_numbers(self)


class Engine(Protocol):
    """A module with these four."""

    def refuse(self, walker: Walker) -> None:
        """ValueError for a walker that this engine does not take."""
        ...

    def walk(
        self,
        walkers: Sequence[Walker],
        numerics: Fineness,
        settling: int | None = None,
        progress: Callable | None = None,
        advance: Callable = advanced,
    ) -> list[Walk]:
        """Each walker from rest for the duration, or so many cycles, or to its end; its speed at the limit cycle.
        progress: told the fraction done. advance: takes the strides, as `rft.walking.stride.advanced`."""
        ...

    def again(
        self,
        walkers: Sequence[Walker],
        numerics: Fineness,
        walks: Sequence[Walk],
        settling: int | None = None,
        advance: Callable = advanced,
    ) -> list[Walk]:
        """The speeds with other numerics, of walks that are known."""
        ...

    def pace(self, walker: Walker, numerics: Fineness, enough: float) -> tuple[float, float]:
        """(s of computing, times that forces are evaluated) of a time step: of the first ones from rest, till ``enough`` s
        are over or a stride is."""
        ...


def engine(name: str) -> Engine:
    """The engine of that name; ValueError for one that is not here."""
    require(isinstance(name, str) and name in ENGINES, f"engine must be one of {', '.join(ENGINES)}, got {shown(name)}")
    try:
        return importlib.import_module(ENGINES[name])
    except ModuleNotFoundError as error:
        if error.name != name:
            raise
        raise ValueError(f"the {name} engine is not installed: pip install 'geomech[{name}]'") from None
    except Exception as error:  # MuJoCo loads what MUJOCO_GL names as it is imported
        raise ValueError(f"the {name} engine cannot be loaded: {shown(str(error))}; is MUJOCO_GL right?") from None


ENGINES = {"planar": "rft.walking.planar_walk", "mujoco": "rft.walking.mujoco_walk"}
