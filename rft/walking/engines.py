"""What computes how robots walk, by name. An engine is one module and its name here."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from rft.media.base import check_ranges, in_range, require, shown
from rft.spatial.law import Spatial
from rft.vertical.effects import Aeration, GrainInertia, GroundEffect, checked, pressure, strength
from rft.vertical.stress import PlateStress
from rft.walking.robot import SMALLEST, Robot, Tripod
from rft.walking.stride import Walk


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
        object.__setattr__(self, "effects", checked(self.effects))
        for effect in self.effects:
            good = isinstance(effect, Aeration | GrainInertia)
            require(good, f"walking takes the effects aeration and grain-inertia, not {effect.kind}: drop it")

    @property
    def strength(self) -> float:
        """Of the ground, times that of its map at zeta = 1."""
        return self.stress.zeta * float(strength(self.effects, 0.0))

    @property
    def flux(self) -> float:
        """lambda rho of the grains' inertia, kg/m^3: a face that leads with v_n feels lambda rho v_n^2 besides."""
        return float(pressure(self.effects, 1.0))


@dataclass(frozen=True)
class Fineness:
    """steps (-): of a cycle. elements (-): of a leg's outline; the belly has as many. rounding (m/s): below which drag
    falls off in proportion to speed; of slow legs it is no more than 5 % of the speed of their ends. duration (s): of
    walking from rest, at most. engine (-): planar or mujoco; if left out the planar one, but for robots and ground of three
    dimensions."""

    steps: int = 32
    elements: int = 12
    rounding: float = 3e-3
    duration: float = 10.0
    engine: str | None = None

    def __post_init__(self):
        good = self.engine is None or (isinstance(self.engine, str) and self.engine in ENGINES)
        require(good, f"engine must be one of {', '.join(ENGINES)}, got {shown(self.engine)}")
        for name, low, high in (("steps", 8, 10_000), ("elements", 4, 1000)):
            in_range(name, getattr(self, name), low, high, whole=True)
            object.__setattr__(self, name, int(getattr(self, name)))
        check_ranges(self, rounding=(SMALLEST, 0.1), duration=(1e-3, 1e4))


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
    ) -> list[Walk]:
        """Each walker from rest for the duration, or so many cycles, or to its end; its speed at the limit cycle.
        progress: told the fraction done."""
        ...

    def again(
        self, walkers: Sequence[Walker], numerics: Fineness, walks: Sequence[Walk], settling: int | None = None
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
