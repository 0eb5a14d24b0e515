"""Robots of the vertical plane: a rigid body on legs, and the clock by which the legs
rotate.

Signs are those of `rft.terradynamics.plates.loads`: x forwards, z up, angles and rates
about the y axis that points away, so a positive pitch has the nose down, and a leg that
points down and turns at a positive rate drives the body forwards. SI units.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, ClassVar

import numpy as np

from rft.core.checks import Number, check_numbers, real_array
from rft.core.metres import LARGEST, metres
from rft.core.refusal import formatted, require
from rft.terradynamics.plates.outline import Outline
from rft.terradynamics.plates.shapes import Polygon, Shape

MOST_HIPS = 20
# of a cycle: shorter parts get as many time steps, since all of the motion may lie in
# them
SHORTEST = 1 / 8
SMALLEST = 1e-7  # m/s, least rounding
# largest rounding over the speed of the legs' ends: with more, slow legs sink as they
# stand
CREEP = 0.05

Mass = Annotated[float, Number(1e-6, 1e4, "kg", "mass of all that moves")]
Axle = Annotated[
    float,
    metres(
        "height of the axle about which legs turn, above the origin of their outline",
        -LARGEST,
    ),
]


@dataclass(frozen=True)
class Tripod:
    """The clock of a leg (RHex): for a share ``duty`` of the cycle it rotates by
    ``sweep``, with the angle ``middle`` in the middle of that time, for the rest by 2
    pi - sweep. Angle 0 is straight down from the body. Both rates are constant; by
    default they are equal.

    The legs at a hip differ by half a cycle.

    Examples
    --------
    >>> from rft.terradynamics.walking import Tripod
    >>> gait = Tripod(frequency=2.0, duty=0.5, sweep=1.0)
    >>> round(float(gait.angle(0.25, 0.25)), 3)  # rad, a quarter of a cycle after the middle of its stance
    0.5
    """

    frequency: Annotated[float, Number(1e-3, 200, "Hz", "turns a second")]
    duty: Annotated[
        float,
        Number(
            0.01, 0.99, "-", "share of the cycle in which a leg stands, 0.01 to 0.99"
        ),
    ] = 0.5
    sweep: Annotated[
        float,
        Number(
            0.01, 2 * math.pi - 0.01, "rad", "angle by which a leg turns as it stands"
        ),
    ] = math.pi
    middle: Annotated[
        float,
        Number(-math.pi, math.pi, "rad", "angle of a leg in the middle of its stance"),
    ] = 0.0

    def __post_init__(self):
        check_numbers(self)

    @property
    def kinks(self) -> tuple[float, ...]:
        """Phases from 0 to 0.5 at which a leg of either tripod changes its rate, with 0
        and 0.5."""
        if abs(self.sweep - 2 * math.pi * self.duty) < 1e-12:
            return 0.0, 0.5
        first = min(self.duty, 1.0 - self.duty) / 2
        return (
            (0.0, first, 0.5)
            if abs(first - 0.25) < 1e-12
            else (0.0, first, 0.5 - first, 0.5)
        )

    def angle(self, phase, rate_phase) -> np.ndarray:
        """Return the angle of a leg at ``phase``, cycles, by the rate at
        ``rate_phase``, which tells the side of a kink."""
        return leg_angle(phase, rate_phase, self.duty, self.sweep, self.middle)

    def rate(self, phase) -> np.ndarray:
        """Return the rate of a leg at ``phase``, rad a cycle."""
        return leg_rate(phase, self.duty, self.sweep)


def intervals(kinks: Sequence[float], steps: int) -> list[tuple[float, float, int]]:
    """Return (begin, end, number of time steps) between neighbouring kinks of a clock:
    about ``steps`` to a cycle, and in each interval at least those of `SHORTEST`, so
    that half of the steps are half of them in every interval."""
    return [
        (a, b, max(1, round(steps * max(b - a, SHORTEST)))) for a, b in pairwise(kinks)
    ]


def leg_angle(phase, rate_phase, duty, sweep, middle) -> np.ndarray:
    """Return `Tripod.angle` of many clocks."""
    turns = np.floor(np.asarray(rate_phase) + 0.5)
    # the second from -0.5 to 0.5
    phase = np.asarray(phase) - turns
    within = np.asarray(rate_phase) - turns
    stance = sweep / duty * phase
    recovery = np.sign(within) * math.pi + _recovery_rate(duty, sweep) * (
        phase - np.sign(within) * 0.5
    )
    return (
        middle
        + 2 * math.pi * turns
        + np.where(np.abs(within) <= duty / 2, stance, recovery)
    )


def leg_rate(phase, duty, sweep) -> np.ndarray:
    """Return `Tripod.rate` of many clocks."""
    within = np.asarray(phase) - np.floor(np.asarray(phase) + 0.5)
    return np.where(
        np.abs(within) <= duty / 2, sweep / duty, _recovery_rate(duty, sweep)
    )


def _recovery_rate(duty, sweep):
    """Return the rate of a leg that recovers, rad a cycle."""
    return (2 * math.pi - sweep) / (1.0 - duty)


def walking_rounding(rounding: float, frequency, reach):
    """Return the rounding, m/s, for legs of a reach, m, at a frequency, Hz: less than
    ``rounding`` for slow legs."""
    return np.clip(
        CREEP * 2 * math.pi * np.asarray(frequency) * reach, SMALLEST, rounding
    )


class Robot:
    """Base of robots. legs: shape of every leg, which rotates about its axle at a hip.
    inertia: kg m^2, infinite for a robot that keeps its pitch.

    Examples
    --------
    >>> from rft.terradynamics.plates import Wheel
    >>> from rft.terradynamics.walking import Robot, Roller
    >>> isinstance(Roller(mass=1.0, legs=Wheel(radius=0.05, width=0.03)), Robot)
    True
    """

    mass: float
    legs: Shape
    axle: float
    part: ClassVar[str] = (
        "legs"  # field, and table of a scene, of the parts that drive the robot
    )
    parts: ClassVar[str] = "legs"  # name of these parts in messages
    hip_phases: ClassVar[tuple[float, ...]]  # phases of the legs at a hip, cycles
    period: ClassVar[float]  # cycles after which the robot looks the same

    def leg(self, elements: int) -> Outline:
        """Return the outline of a leg about its hip."""
        outline = self.legs.outline(elements)
        return (
            Outline(
                outline.points - [0.0, self.axle], outline.width, outline.smooth_normals
            )
            if self.axle
            else outline
        )

    def belly(self, elements: int) -> Outline | None:
        """Return the outline of the body; None if it cannot touch the ground."""
        return None

    def check(self, elements: int) -> None:
        """Raise ValueError unless the robot's surfaces can have ``elements``
        elements."""
        self.leg(elements)

    def _check(self) -> None:
        """Raise ValueError for numbers out of range, and without legs."""
        check_numbers(self)
        require(
            isinstance(self.legs, Shape),
            "a robot without legs",
            because=f"legs must be a shape, got {formatted(self.legs)}",
        )


@dataclass(frozen=True)
class Rhex(Robot):
    """A box on two legs at each hip, which differ by half a cycle and alternate from
    hip to hip: an alternating tripod.

    hips (m): x of each hip from the centre of mass.

    aside (m): distance of the legs at each hip from the middle plane, one on either
    side, for the engine of three dimensions. By default legs touch the box; of an odd
    number of hips every second one has its legs farther out, so that a tripod with
    equal forces on its legs neither rolls nor yaws the body.

    Examples
    --------
    >>> from rft.terradynamics.plates import CLeg
    >>> from rft.terradynamics.walking import Rhex
    >>> robot = Rhex(0.15, 0.13, 0.02, 0.03, CLeg(0.02, 0.01), hips=(-0.05, 0.0, 0.05))
    >>> robot.leg(24).elements
    24
    """

    mass: Mass
    length: Annotated[float, metres("length of the box about the centre of mass")]
    height: Annotated[float, metres("height of the box about the centre of mass")]
    width: Annotated[float, metres("width of the box about the centre of mass")]
    legs: Shape
    hips: tuple[float, ...]
    hip_height: Annotated[
        float, metres("height of the hips above the centre of mass", -LARGEST)
    ] = 0.0
    inertia: Annotated[
        float | None,
        Number(
            1e-12,
            1e5,
            "kg m^2",
            "moment of inertia of pitching; that of the box where none is given",
        ),
    ] = None
    axle: Axle = 0.0
    aside: tuple[float, ...] | None = None
    hip_phases = (0.0, 0.5)
    period = 1.0

    def __post_init__(self):
        self._check()
        hips = real_array("hips", self.hips)
        require(hips.ndim == 1, "hips must be a list of x in m", value=self.hips)
        require(
            0 < len(hips) <= MOST_HIPS,
            "a robot without legs",
            because=f"hips must be 1 to {MOST_HIPS} numbers, got {len(hips)}",
        )
        within = bool((np.abs(hips) <= self.length).all())
        require(
            within,
            f"hips must be within a body length, {self.length:g} m, of the centre of mass (in m)",
        )
        object.__setattr__(self, "hips", tuple(map(float, hips)))
        if self.inertia is None:
            object.__setattr__(
                self, "inertia", self.mass * (self.length**2 + self.height**2) / 12
            )
            check_numbers(self)
        if self.aside is not None:
            aside = real_array("aside", self.aside)
            valid = aside.shape == hips.shape and bool(
                ((aside >= 0) & (aside <= LARGEST)).all()
            )
            message = f"aside must be {len(hips)} numbers from 0 to {LARGEST:g} m, one for each hip"
            require(valid, message, value=self.aside)
            object.__setattr__(self, "aside", tuple(map(float, aside)))

    @property
    def sides(self) -> np.ndarray:
        """Distances (K,), m, of the legs at each hip from the middle plane."""
        if self.aside is not None:
            return np.array(self.aside)
        count = len(self.hips)
        near = (self.width + self.legs.width) / 2
        out = (count + 1) / (count - 1) if count > 1 and count % 2 else 1.0
        return np.array([near * (out if k % 2 else 1.0) for k in range(count)])

    def belly(self, elements: int) -> Outline:
        x = self.length / 2
        z = self.height / 2
        return Polygon(((-x, -z), (x, -z), (x, z), (-x, z)), self.width).outline(
            elements
        )


@dataclass(frozen=True)
class Roller(Robot):
    """A wheel, or another rotating shape, on an axle kept level: a mass that moves
    forwards and up and down under its own weight.

    Examples
    --------
    >>> from rft.terradynamics.plates import StressMap, Wheel
    >>> from rft.terradynamics.walking import Fineness, Roller, Tripod, Walker, engine
    >>> wheel = Roller(mass=1.0, legs=Wheel(radius=0.05, width=0.03))
    >>> (walk,) = engine("planar").walk([Walker(wheel, Tripod(frequency=0.5), StressMap())], Fineness(steps=16))
    >>> walk.status
    'walking'
    """

    mass: Annotated[
        float,
        Number(1e-6, 1e4, "kg", "mass of all that the wheel carries, and its own"),
    ]
    legs: Shape
    axle: Axle = 0.0
    hips = (0.0,)
    hip_height = 0.0
    inertia = math.inf
    height = 0.0
    hip_phases = (0.0,)
    period = 1.0

    def __post_init__(self):
        self._check()
