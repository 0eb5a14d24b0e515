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
# Shorter parts of a cycle get as many time steps as this share of it, since all of the
# motion may lie in them.
SHORTEST_INTERVAL = 1 / 8
SMALLEST_ROUNDING = 1e-7  # m/s
# Largest rounding over the speed of the legs' ends: with more, slow legs sink as they
# stand.
LARGEST_ROUNDING_SHARE = 0.05

Mass = Annotated[float, Number(1e-6, 1e4, "kg", "mass of everything that moves")]
Axle = Annotated[
    float,
    metres(
        "height of the axle about which legs turn, above the origin of their outline",
        -LARGEST,
    ),
]


@dataclass(frozen=True)
class Tripod:
    """The clock of a leg (RHex).

    For a share ``duty`` of the cycle a leg rotates by ``sweep``, with the angle
    ``middle`` in the middle of that time, for the rest of the cycle by 2 pi - sweep.
    Angle 0 is straight down from the body. Both rates are constant; by default they
    are equal. The legs at a hip differ by half a cycle.

    Examples
    --------
    >>> from rft.terradynamics.walking import Tripod
    >>> gait = Tripod(frequency=2.0, duty=0.5, sweep=1.0)
    >>> # rad, a quarter of a cycle after the middle of its stance
    >>> round(float(gait.angle(0.25, 0.25)), 3)
    0.5
    """

    frequency: Annotated[float, Number(1e-3, 200, "Hz", "turns per second")]
    duty: Annotated[
        float,
        Number(
            0.01,
            0.99,
            "-",
            "share of the cycle in which a leg is in stance, 0.01 to 0.99",
        ),
    ] = 0.5
    sweep: Annotated[
        float,
        Number(
            0.01,
            2 * math.pi - 0.01,
            "rad",
            "angle through which a leg turns during stance",
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
        if abs(first - 0.25) < 1e-12:
            return 0.0, first, 0.5
        return 0.0, first, 0.5 - first, 0.5

    def angle(self, phase, rate_phase) -> np.ndarray:
        """Return the angle of a leg at ``phase``, cycles, by the rate at
        ``rate_phase``, which determines the side of a kink."""
        return leg_angle(phase, rate_phase, self.duty, self.sweep, self.middle)

    def rate(self, phase) -> np.ndarray:
        """Return the rate of a leg at ``phase``, rad per cycle."""
        return leg_rate(phase, self.duty, self.sweep)


def intervals(kinks: Sequence[float], steps: int) -> list[tuple[float, float, int]]:
    """Return (begin, end, number of time steps) between neighbouring kinks of a clock:
    about ``steps`` per cycle.

    Each interval has at least the steps of `SHORTEST_INTERVAL`, so that half of
    ``steps`` are half of the steps in every interval."""
    out = []
    for begin, end in pairwise(kinks):
        length = max(end - begin, SHORTEST_INTERVAL)
        out.append((begin, end, max(1, round(steps * length))))
    return out


def leg_angle(phase, rate_phase, duty, sweep, middle) -> np.ndarray:
    """Return `Tripod.angle` of many clocks."""
    turns = np.floor(np.asarray(rate_phase) + 0.5)
    phase = np.asarray(phase) - turns
    rate_phase = np.asarray(rate_phase) - turns  # from -0.5 to 0.5
    stance = sweep / duty * phase
    side = np.sign(rate_phase)
    recovery = side * math.pi + _recovery_rate(duty, sweep) * (phase - side * 0.5)
    stands = np.abs(rate_phase) <= duty / 2
    return middle + 2 * math.pi * turns + np.where(stands, stance, recovery)


def leg_rate(phase, duty, sweep) -> np.ndarray:
    """Return `Tripod.rate` of many clocks."""
    phase = np.asarray(phase) - np.floor(np.asarray(phase) + 0.5)
    stands = np.abs(phase) <= duty / 2
    return np.where(stands, sweep / duty, _recovery_rate(duty, sweep))


def _recovery_rate(duty, sweep):
    """Return the rate of a leg that recovers, rad per cycle."""
    return (2 * math.pi - sweep) / (1.0 - duty)


def walking_rounding(rounding: float, frequency, reach):
    """Return the rounding, m/s, for legs of a reach, m, at a frequency, Hz: less than
    ``rounding`` for slow legs."""
    largest = LARGEST_ROUNDING_SHARE * 2 * math.pi * np.asarray(frequency) * reach
    return np.clip(largest, SMALLEST_ROUNDING, rounding)


class Robot:
    """Base of robots.

    legs: shape of every leg, which rotates about its axle at a hip. inertia: kg m^2,
    infinite for a robot that keeps its pitch.

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
    # Field, and table of a scene, of the parts that drive the robot.
    part: ClassVar[str] = "legs"
    parts: ClassVar[str] = "legs"  # name of these parts in messages
    hip_phases: ClassVar[tuple[float, ...]]  # phases of the legs at a hip, cycles
    period: ClassVar[float]  # cycles after which the robot looks the same

    def leg(self, elements: int) -> Outline:
        """Return the outline of a leg about its hip."""
        outline = self.legs.outline(elements)
        if not self.axle:
            return outline
        points = outline.points - [0.0, self.axle]
        return Outline(points, outline.width, outline.smooth_normals)

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

    hips (m): x of each hip, from the centre of mass.

    aside (m): distance of the two legs at each hip from the middle plane, for the
    engine of three dimensions. By default legs touch the box. With an odd number of
    hips the legs of every second hip are farther out, so that a tripod with equal
    forces on its legs neither rolls nor yaws the body.

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
            "moment of inertia in pitch; if left out, that of the box",
        ),
    ] = None
    axle: Axle = 0.0
    aside: tuple[float, ...] | None = None
    hip_phases = (0.0, 0.5)
    period = 1.0

    def __post_init__(self):
        self._check()
        object.__setattr__(self, "hips", self._checked_hips())
        if self.inertia is None:
            inertia = self.mass * (self.length**2 + self.height**2) / 12
            object.__setattr__(self, "inertia", inertia)
            check_numbers(self)
        if self.aside is not None:
            object.__setattr__(self, "aside", self._checked_aside())

    def _checked_hips(self) -> tuple[float, ...]:
        """Return the hips as numbers; ValueError unless they are some, on the body."""
        hips = real_array("hips", self.hips)
        require(hips.ndim == 1, "hips must be a list of x in m", value=self.hips)
        require(
            0 < len(hips) <= MOST_HIPS,
            "a robot without legs",
            because=f"hips must be 1 to {MOST_HIPS} numbers, got {len(hips)}",
        )
        require(
            bool((np.abs(hips) <= self.length).all()),
            f"hips must be within a body length, {self.length:g} m, of the centre of "
            "mass (in m)",
        )
        return tuple(map(float, hips))

    def _checked_aside(self) -> tuple[float, ...]:
        """Return the distances ``aside`` as numbers; ValueError unless each hip has
        one."""
        count = len(self.hips)
        aside = real_array("aside", self.aside)
        is_within = bool(((aside >= 0) & (aside <= LARGEST)).all())
        require(
            aside.shape == (count,) and is_within,
            f"aside must be {count} numbers from 0 to {LARGEST:g} m, one for each hip",
            value=self.aside,
        )
        return tuple(map(float, aside))

    @property
    def sides(self) -> np.ndarray:
        """Distances (K,), m, of the legs at each hip from the middle plane."""
        if self.aside is not None:
            return np.array(self.aside)
        count = len(self.hips)
        near = (self.width + self.legs.width) / 2
        far = near
        if count > 1 and count % 2:
            # The fewer legs of one tripod are farther out, so that both have the same
            # moment about the middle plane.
            far = near * ((count + 1) / (count - 1))
        return np.where(np.arange(count) % 2, far, near)

    def belly(self, elements: int) -> Outline:
        x = self.length / 2
        z = self.height / 2
        box = Polygon(((-x, -z), (x, -z), (x, z), (-x, z)), self.width)
        return box.outline(elements)


@dataclass(frozen=True)
class Roller(Robot):
    """A wheel, or another rotating shape, on an axle kept level: a mass that moves
    forwards and up and down under its own weight.

    Examples
    --------
    >>> from rft.terradynamics.plates import StressMap, Wheel
    >>> from rft.terradynamics.walking import Fineness, Roller, Tripod, Walker, engine
    >>> wheel = Roller(mass=1.0, legs=Wheel(radius=0.05, width=0.03))
    >>> walker = Walker(wheel, Tripod(frequency=0.5), StressMap())
    >>> (walk,) = engine("planar").walk([walker], Fineness(steps=16))
    >>> walk.status
    'walking'
    """

    mass: Annotated[
        float,
        Number(1e-6, 1e4, "kg", "mass of the wheel and all that it carries"),
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
