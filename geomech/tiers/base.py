"""What a tier is: a way to predict the net pose (..., 3) of a gait's cycle from phase t = 0, in the frame at the start."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from geomech.core.errors import number, real_array
from geomech.gaits import Gait
from geomech.systems.base import ALL, System

WHOLE = {  # numbers of [numerics], from and to
    "directions": (2, 4096), "grid": (4, 4096), "interpolation": (1, 5), "phases": (8, 1_000_000),
    "harmonics": (1, 999), "curves": (4, 4096),
}  # fmt: skip


@dataclass(frozen=True)
class Numerics:
    """How finely tiers compute; all optional, and part of [numerics] beside the system's own.

    directions (-): of alphadot in the least-squares fit; if left out 8 for up to two joints, beyond 16 a joint, or
    4 where xi is linear in alphadot.
    grid (-): points per joint. extent (rad): of the field, on either side of 0. interpolation (-): degree of its splines.
    phases (-): per cycle. harmonics (-): the highest kept, odd; if left out 15 of two joint rates, 9 of three, 5 beyond.
    curves (-): in the table of a family of gaits.
    """

    directions: int | None = None
    grid: int = 31
    extent: float = 2.5
    interpolation: int = 3
    phases: int = 256
    harmonics: int | None = None
    curves: int = 24

    angles = ("extent",)

    def __post_init__(self):
        number("extent", self.extent, 1e-6, 100)
        for name, (low, high) in WHOLE.items():
            if name not in ("directions", "harmonics") or getattr(self, name) is not None:
                number(name, getattr(self, name), low, high, whole=True)
        if self.harmonics is not None and self.harmonics % 2 == 0:
            raise ValueError(f"harmonics must be an odd number from 1 to 999, got {self.harmonics!r}")
        if self.interpolation >= self.grid:
            raise ValueError(f"interpolation must be from 1 to 5 and less than grid, got {self.interpolation!r}")


class Tier:
    """Base of all tiers. name: in scenes, options and tables. label: for legends. style: of its line. rests_on: premises
    without which it says nothing. needs: what these are lost for. joints: shape variables that it takes; offered: those
    for which a plain study asks for it; takes_joints, instead: in words, and what to do with others. looks_up: its table's
    name, of which tiers may share one, "" for none. depends_on: entries of [numerics] that the table depends on, beside the
    system and `reach`. on_grid: the table is a field on the scene's grid. whole: it must have no singular shapes. plain: a
    plain study asks for it.
    """

    name = "tier"
    label = ""
    style: dict = {}
    rests_on = ALL
    needs = "connection or CCF"
    joints = offered = range(1, 10_001)
    looks_up = ""
    depends_on: tuple[str, ...] = ()
    takes_joints, instead = "takes a body of joints", "use direct"
    on_grid = False
    whole = False
    plain = True

    @property
    def colour(self) -> str:
        """Of its markers."""
        return self.style["color"]

    def refuse(self, system: System) -> None:
        """ValueError if it says nothing of this system."""
        system.refuse(self.needs, self.rests_on, "use the direct tier")
        if system.joints not in self.joints:
            raise ValueError(f"the {self.name} tier {self.takes_joints}, this body has {system.joints}: {self.instead}")
        if self.whole and system.traits.singularity is not None:
            near = getattr(system, "near", "")
            why = f"A is known near {near} alone" if near else f"the {system.kind} has singular shapes"
            raise ValueError(f"the {self.name} tier sums a field up, and {why}: use path or direct")

    def takes(self, system: System) -> bool:
        """Whether it says something of this system, and is worth asking."""
        if system.joints not in self.offered or system.traits.lacks & self.rests_on:
            return False
        return not (self.whole and system.traits.singularity is not None)

    def is_direct(self, system: System) -> bool:
        """Whether it is the direct tier, for want of anything to look up."""
        return not self.looks_up

    def reach(self, gait: Gait, amplitudes) -> tuple:
        """What of a gait the table depends on: nothing."""
        return ()

    def around(self, system: System, numerics: Numerics) -> bool:
        """Whether it has no table of so many joints, and asks for velocities at shapes around the gait instead."""
        return False

    def along(self, system: System, numerics: Numerics, count: int, phases: int) -> int:
        """How many, where it does."""
        return 0

    def table(self, system: System, numerics: Numerics, *reach, progress: Callable | None = None) -> Any:
        """What is computed once for a system; None for nothing."""

    def solves(self, system: System, numerics: Numerics, gait: Gait, count: int, phases: int) -> int:
        """Velocities that it asks for in all, for ``count`` amplitudes of a gait: its cost, look-ups being cheap beside it."""
        raise NotImplementedError

    def size(self, system: System, numerics: Numerics) -> int:
        """Numbers that the table holds."""
        return 0

    def sample(self, system: System, numerics: Numerics) -> Callable | None:
        """Looks n shapes up in a table of zeros, as large as a shape touches, to be timed; None if that costs nothing."""
        return None

    def predict(self, table, system: System, gait: Gait, amplitudes, numerics: Numerics) -> np.ndarray:
        """Net poses (..., 3) for amplitudes (...,), or the gait's own."""
        raise NotImplementedError

    def choice(self, table, system: System, gait: Gait, amplitudes, numerics: Numerics) -> np.ndarray | None:
        """(B, 2), the system's unit and rad: how far positions and headings at amplitudes (B,) hang on what is no part of the
        question, as a spanning surface; None where there is nothing to choose."""


def solved(system: System, gait: Gait, phases: int) -> int:
    """Of a gait's phases, those at which a system that runs it is asked for its velocity: the others are images of these."""
    if system.traits.steps or phases < max(4, 2 * gait.harmonics + 1):  # the least that show a gait
        return phases
    return system.images(*gait.cycle(phases, gait.amplitude or 1.0)).count


def in_groups(f: Callable, amplitudes, size: int) -> np.ndarray:
    """f(some) (b, ...) for amplitudes (...,), at most ``size`` (or one) at a time, so that memory is bounded: (..., ...)."""
    amplitudes = real_array("amplitudes", amplitudes)
    flat, size = amplitudes.reshape(-1), max(1, size)
    found = [f(flat[k : k + size]) for k in range(0, flat.size, size)]
    return np.concatenate(found).reshape(*amplitudes.shape, -1) if found else np.zeros((*amplitudes.shape, 3))
