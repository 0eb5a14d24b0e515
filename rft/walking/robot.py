"""Robots of the vertical plane: a rigid body on legs that turn as they are told, and the clock that tells them.

Signs are those of `rft.plates.loads`: x forwards, z up, angles and rates about the y axis that points away, so a positive
pitch has the nose down, and a leg that points down and turns at a positive rate drives the body forwards. SI units.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, ClassVar

import numpy as np

from rft.checks import Number, check_numbers, real_array, require, shown
from rft.metres import LARGEST, metres
from rft.plates.outline import Outline
from rft.plates.shapes import Polygon, Shape

MOST_HIPS = 20
LEAST_PART = 1 / 8  # of a cycle, as which a shorter part of it counts: a robot may be driven in that alone
SMALLEST = 1e-7  # m/s, that a rounding may be
CREEP = 0.05  # of the speed of the legs' ends, that it may be: above it legs sink as they stand, the more the slower

Mass = Annotated[float, Number(1e-6, 1e4, "kg", "mass of all that moves")]
Axle = Annotated[float, metres("height of the axle about which legs turn, above the origin of their outline", -LARGEST)]


@dataclass(frozen=True)
class Tripod:
    """The clock of a leg (RHex): for a share ``duty`` of the cycle it turns by ``sweep``, in the middle of which its
    angle is ``middle``, for the rest by what a whole turn lacks. 0 is straight down from the body; as it stands, a
    constant rate.

    The legs at a hip are half a cycle apart.
    """

    frequency: Annotated[float, Number(1e-3, 200, "Hz", "turns a second")]
    duty: Annotated[float, Number(0.01, 0.99, "-", "share of the cycle in which a leg stands, 0.01 to 0.99")] = 0.5
    sweep: Annotated[float, Number(0.01, 2 * math.pi - 0.01, "rad", "angle by which a leg turns as it stands")] = (
        math.pi
    )
    middle: Annotated[float, Number(-math.pi, math.pi, "rad", "angle of a leg in the middle of its stance")] = 0.0

    def __post_init__(self):
        check_numbers(self)

    @property
    def kinks(self) -> tuple[float, ...]:
        """Phases, of the first half of the cycle, at which a leg of either tripod changes its rate, with both ends."""
        if abs(self.sweep - 2 * math.pi * self.duty) < 1e-12:
            return 0.0, 0.5
        first = min(self.duty, 1.0 - self.duty) / 2
        return (0.0, first, 0.5) if abs(first - 0.25) < 1e-12 else (0.0, first, 0.5 - first, 0.5)

    def angle(self, phase, of) -> np.ndarray:
        """Of a leg at ``phase`` (cycles), by the rate that holds at the phase ``of``, on whose side of a kink it is."""
        return leg_angle(phase, of, self.duty, self.sweep, self.middle)

    def rate(self, of) -> np.ndarray:
        """rad a cycle, at the phase ``of``."""
        return leg_rate(of, self.duty, self.sweep)


def parts(kinks: Sequence[float], steps: int) -> list[tuple[float, float, int]]:
    """(begin, end, time steps) between neighbouring kinks of a clock: about ``steps`` to a cycle, an eighth of them at least
    in each part, however short, so that half of the steps are half of them there, too."""
    return [(a, b, max(1, round(steps * max(b - a, LEAST_PART)))) for a, b in pairwise(kinks)]


def leg_angle(phase, of, duty, sweep, middle) -> np.ndarray:
    """`Tripod.angle` of many clocks."""
    turns = np.floor(np.asarray(of) + 0.5)
    place, there = np.asarray(phase) - turns, np.asarray(of) - turns  # of the second, -0.5 to 0.5
    slow = sweep / duty * place
    fast = np.sign(there) * math.pi + _fast(duty, sweep) * (place - np.sign(there) * 0.5)
    return middle + 2 * math.pi * turns + np.where(np.abs(there) <= duty / 2, slow, fast)


def leg_rate(of, duty, sweep) -> np.ndarray:
    """`Tripod.rate` of many clocks."""
    there = np.asarray(of) - np.floor(np.asarray(of) + 0.5)
    return np.where(np.abs(there) <= duty / 2, sweep / duty, _fast(duty, sweep))


def _fast(duty, sweep):
    """rad a cycle, while a leg recovers."""
    return (2 * math.pi - sweep) / (1.0 - duty)


def rounded(rounding: float, frequency, reach):
    """m/s: the rounding of the ground's law at rest that does for legs of a reach, m, that turn at a frequency, Hz."""
    return np.clip(CREEP * 2 * math.pi * np.asarray(frequency) * reach, SMALLEST, rounding)


class Robot:
    """Base of robots. legs: the outline they share turns about its axle at each of the hips. inertia: kg m^2,
    infinite for one that keeps its pitch.
    """

    mass: float
    legs: Shape
    axle: float
    part: ClassVar[str] = "legs"  # the field, and the table of a scene, that says what it moves by
    parts: ClassVar[str] = "legs"  # what these are
    apart: ClassVar[tuple[float, ...]]  # phases of the legs at a hip
    period: ClassVar[float]  # cycles after which the robot looks the same

    def leg(self, elements: int) -> Outline:
        """The outline of a leg about its hip."""
        outline = self.legs.outline(elements)
        return Outline(outline.points - [0.0, self.axle], outline.width, outline.bends) if self.axle else outline

    def belly(self, elements: int) -> Outline | None:
        """The outline of the body, if it can touch the ground."""
        return None

    def check(self, elements: int) -> None:
        """ValueError unless what touches the ground can be cut into so many elements."""
        self.leg(elements)

    def _check(self) -> None:
        check_numbers(self)
        require(isinstance(self.legs, Shape), f"a robot without legs: legs must be a shape, got {shown(self.legs)}")


@dataclass(frozen=True)
class Rhex(Robot):
    """A box on two legs at each hip, half a cycle apart and alternating from hip to hip: an alternating tripod.

    hips (m): x of each hip from the centre of mass.

    aside (m): distance of the legs at each hip from the middle plane, one on either side, for the engine of three
    dimensions; where none are given, beside the box, and at every other one of an odd number of hips so much farther out
    that a tripod whose legs bear alike neither rolls nor yaws the body.
    """

    mass: Mass
    length: Annotated[float, metres("length of the box about the centre of mass")]
    height: Annotated[float, metres("height of the box about the centre of mass")]
    width: Annotated[float, metres("width of the box about the centre of mass")]
    legs: Shape
    hips: tuple[float, ...]
    hip_height: Annotated[float, metres("height of the hips above the centre of mass", -LARGEST)] = 0.0
    inertia: Annotated[
        float | None, Number(1e-12, 1e5, "kg m^2", "moment of inertia of pitching; that of the box where none is given")
    ] = None
    axle: Axle = 0.0
    aside: tuple[float, ...] | None = None
    apart = (0.0, 0.5)
    period = 1.0

    def __post_init__(self):
        self._check()
        hips = real_array("hips", self.hips)
        require(hips.ndim == 1, f"hips must be a list of x in m, got {shown(self.hips)}")
        require(
            0 < len(hips) <= MOST_HIPS, f"a robot without legs: hips must be 1 to {MOST_HIPS} numbers, got {len(hips)}"
        )
        within = bool((np.abs(hips) <= self.length).all())
        require(within, f"hips must be within a body length, {self.length:g} m, of the centre of mass (in m)")
        object.__setattr__(self, "hips", tuple(map(float, hips)))
        if self.inertia is None:
            object.__setattr__(self, "inertia", self.mass * (self.length**2 + self.height**2) / 12)
            check_numbers(self)
        if self.aside is not None:
            aside = real_array("aside", self.aside)
            good = aside.shape == hips.shape and bool(((aside >= 0) & (aside <= LARGEST)).all())
            told = (
                f"aside must be {len(hips)} numbers from 0 to {LARGEST:g} m, one for each hip, got {shown(self.aside)}"
            )
            require(good, told)
            object.__setattr__(self, "aside", tuple(map(float, aside)))

    @property
    def sides(self) -> np.ndarray:
        """m, of each hip: its legs from the middle plane."""
        if self.aside is not None:
            return np.array(self.aside)
        count, near = len(self.hips), (self.width + self.legs.width) / 2
        out = (count + 1) / (count - 1) if count > 1 and count % 2 else 1.0
        return np.array([near * (out if k % 2 else 1.0) for k in range(count)])

    def belly(self, elements: int) -> Outline:
        x, z = self.length / 2, self.height / 2
        return Polygon(((-x, -z), (x, -z), (x, z), (-x, z)), self.width).outline(elements)


@dataclass(frozen=True)
class Roller(Robot):
    """A wheel, or whatever turns, on an axle that is kept level: a mass that moves forwards and up and down, driven by
    its own weight."""

    mass: Annotated[float, Number(1e-6, 1e4, "kg", "mass of all that the wheel carries, and its own")]
    legs: Shape
    axle: Axle = 0.0
    hips = (0.0,)
    hip_height = 0.0
    inertia = math.inf
    height = 0.0
    apart = (0.0,)
    period = 1.0

    def __post_init__(self):
        self._check()
