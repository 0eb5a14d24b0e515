"""Prescribed motions in the vertical plane, one class per kind: poses and twists in
time. SI units; signs as in `rft.terradynamics.plates.loads`."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from rft.core.checks import Number, check_numbers
from rft.core.metres import LARGEST, metres
from rft.core.refusal import require
from rft.terradynamics.plates.outline import Outline
from rft.terradynamics.prescribed import (
    FARTHEST,
    Depth,
    Direction,
    Distance,
    Height,
    Motion,
    Samples,
    require_ascending,
    require_path_length,
    set_numbers,
)

Speed = Annotated[float, Number(1e-9, 1e3, "m/s", "speed; it affects no force")]
Attitude = Annotated[float, Number(-10, 10, "rad", "angle at which the body is held")]
Angle = Annotated[
    float,
    Number(
        -1e3, 1e3, "rad", "angle at one end of the motion, 0 where a leg points down"
    ),
]


class Trajectory(NamedTuple):
    """A motion in time. t: (T,), s. pose: (T, 3) as (x, z, angle), m and rad. twist:
    (T, 3) as (v_x, v_z, rate).

    Examples
    --------
    >>> from rft.terradynamics.plates import CLeg, Rotate
    >>> leg = CLeg(0.038, 0.02).outline(24)
    >>> motion = Rotate(hub_height=0.02, samples=5).trajectory(leg)
    >>> motion.pose[:, 2].round(3)  # angle, rad
    array([-3.142, -1.571,  0.   ,  1.571,  3.142])
    """

    t: np.ndarray
    pose: np.ndarray
    twist: np.ndarray


@dataclass(frozen=True)
class Drag(Motion):
    """Motion along a straight line without rotation.

    Examples
    --------
    >>> from rft.terradynamics.plates import Drag, RoundRod
    >>> rod = RoundRod(0.01, 0.1).outline(40)
    >>> motion = Drag(depth=0.05, distance=0.1).trajectory(rod)
    >>> motion.pose[[0, -1]].round(3)
    array([[ 0.  , -0.05,  0.  ],
           [ 0.1 , -0.05,  0.  ]])
    """

    depth: Depth
    direction: Direction = 0.0
    speed: Speed = 0.01
    distance: Distance = 0.1
    attitude: Attitude = 0.0
    samples: Samples = 51

    def __post_init__(self):
        check_numbers(self)

    def trajectory(self, outline: Outline) -> Trajectory:
        """Return the motion of an outline in time."""
        return _straight(self, 0.0, -self.depth, self.distance)


@dataclass(frozen=True)
class Penetrate(Motion):
    """Motion straight or obliquely down, from where the outline's lowest point touches
    the surface.

    Examples
    --------
    >>> from rft.terradynamics.plates import Penetrate, Plate
    >>> motion = Penetrate(depth=0.05).trajectory(Plate(0.04, 0.02).outline(4))
    >>> motion.pose[-1].round(3)
    array([ 0.  , -0.05,  0.  ])
    """

    depth: Annotated[
        float, metres("depth of the lowest point at the end of the motion", 1e-9)
    ]
    direction: Direction = math.pi / 2
    speed: Speed = 0.01
    attitude: Attitude = 0.0
    samples: Samples = 51

    def __post_init__(self):
        check_numbers(self)
        self.require_downwards()

    def trajectory(self, outline: Outline) -> Trajectory:
        """Return the motion of an outline in time."""
        x, z = outline.points.T
        lowest = (z * math.cos(self.attitude) - x * math.sin(self.attitude)).min()
        return _straight(self, 0.0, -lowest, self.depth / math.sin(self.direction))


@dataclass(frozen=True)
class Rotate(Motion):
    """Rotation about a hub at a fixed height above the surface.

    Examples
    --------
    >>> from rft.terradynamics.plates import CLeg, Rotate
    >>> motion = Rotate(hub_height=0.02).trajectory(CLeg(0.038, 0.02).outline(24))
    >>> motion.pose.shape
    (361, 3)
    """

    hub_height: Height
    rate: Annotated[
        float,
        Number(
            -1e3,
            1e3,
            "rad/s",
            "rate of rotation, positive if a leg that points down sweeps backwards",
        ),
    ] = 2 * math.pi
    start: Angle = -math.pi
    stop: Angle = math.pi
    speed: Annotated[float, Number(-1e3, 1e3, "m/s", "forward speed of the hub")] = 0.0
    samples: Samples = 361
    turns = True

    def __post_init__(self):
        check_numbers(self)
        self.require_turning()

    def trajectory(self, outline: Outline) -> Trajectory:
        """Return the motion of an outline in time."""
        angle = np.linspace(self.start, self.stop, self.samples)
        t = (angle - self.start) / self.rate
        pose = np.stack([self.speed * t, np.full_like(t, self.hub_height), angle], -1)
        twist = np.broadcast_to([self.speed, 0.0, self.rate], pose.shape)
        return Trajectory(t, pose, twist)


@dataclass(frozen=True)
class Path(Motion):
    """Motion through given poses. Velocities are differences of order 2 in the spacing
    of t.

    t (s): times, ascending. x, z (m): of the frame's origin. angle (rad): of the body,
    0 throughout if left out.

    Examples
    --------
    >>> from rft.terradynamics.plates import Path, Plate
    >>> path = Path(t=(0.0, 1.0, 2.0), x=(0.0, 0.01, 0.03), z=(-0.02, -0.02, -0.02))
    >>> path.trajectory(Plate(0.04, 0.02).outline(4)).twist[:, 0].round(3)  # m/s
    array([0.005, 0.015, 0.025])
    """

    t: tuple[float, ...]
    x: tuple[float, ...]
    z: tuple[float, ...]
    angle: tuple[float, ...] = ()

    def __post_init__(self):
        set_numbers(self, "t", 1e9)
        set_numbers(self, "x", FARTHEST, " m")
        set_numbers(self, "z", LARGEST, " m")
        set_numbers(self, "angle", 1e9)
        require_path_length(self.t)
        require(
            len(self.x) == len(self.z) == len(self.t)
            and len(self.angle) in (0, len(self.t)),
            "t, x, z and angle must have the same length",
        )
        require_ascending(self.t)

    @property
    def samples(self) -> int:
        return len(self.t)

    def trajectory(self, outline: Outline) -> Trajectory:
        """Return the motion of an outline in time."""
        t = np.array(self.t)
        angle = self.angle or np.zeros_like(t)
        pose = np.stack([self.x, self.z, angle], -1)
        twist = np.gradient(pose, t, axis=0, edge_order=2)
        return Trajectory(t, pose, twist)


MOTIONS = {"drag": Drag, "penetrate": Penetrate, "rotate": Rotate, "csv": Path}


def _straight(motion, x: float, z: float, distance: float) -> Trajectory:
    """Return a motion over a distance, m, along a straight line from (x, z)."""
    along = np.array([math.cos(motion.direction), -math.sin(motion.direction), 0.0])
    along[np.abs(along) < 1e-15] = 0.0  # straight down, or level, to the last digit
    s = np.linspace(0.0, distance, motion.samples)
    pose = np.array([x, z, motion.attitude]) + s[:, None] * along
    twist = np.broadcast_to(motion.speed * along, pose.shape)
    return Trajectory(s / motion.speed, pose, twist)
