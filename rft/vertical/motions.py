"""Prescribed motions in the vertical plane, one class a kind: poses and twists in time. SI units; signs are those of
`rft.vertical.loads`."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rft.media.base import check_ranges, in_range, real_array, require
from rft.vertical.outline import LARGEST, Outline, check_metres

SPEEDS = (1e-9, 1e3)  # m/s, or rad/s
MOST_SAMPLES = 100_000
FARTHEST = 1e3  # m along the ground


class Course(NamedTuple):
    """A motion: times (T,), poses (T, 3) as (x, z, angle), twists (T, 3) as (v_x, v_z, rate)."""

    t: np.ndarray
    pose: np.ndarray
    twist: np.ndarray


class Motion:
    """Base of motions: a course for the outline that moves. turns: whether the angle tells where it is, not x and z.

    samples (-): poses along it, 2 to 100,000.
    """

    samples: int
    turns = False

    def _check(self) -> None:
        in_range("samples", self.samples, 2, MOST_SAMPLES, whole=True)
        object.__setattr__(self, "samples", int(self.samples))

    def course(self, outline: Outline) -> Course:
        raise NotImplementedError


@dataclass(frozen=True)
class Drag(Motion):
    """Along a straight line without turning.

    depth (m): of the frame's origin at the start. direction (rad): gamma, below the horizontal. speed (m/s): it changes no
    force. distance (m): how far it goes. attitude (rad): the angle that the body is held at.
    """

    depth: float
    direction: float = 0.0
    speed: float = 0.01
    distance: float = 0.1
    attitude: float = 0.0
    samples: int = 51
    angles = ("direction", "attitude")

    def __post_init__(self):
        self._check()
        check_metres(self, "depth", low=-LARGEST)
        check_ranges(self, speed=SPEEDS, distance=(1e-9, FARTHEST))
        check_ranges(self, direction=(-10.0, 10.0), attitude=(-10.0, 10.0))

    def course(self, outline: Outline) -> Course:
        return _straight(self, 0.0, -self.depth, self.distance)


@dataclass(frozen=True)
class Penetrate(Motion):
    """Straight down, or on a slope, from where the outline's lowest point touches the surface.

    depth (m): of the lowest point at the end. direction (rad): below the horizontal. speed (m/s): it changes no force.
    attitude (rad): the angle that the body is held at.
    """

    depth: float
    direction: float = math.pi / 2
    speed: float = 0.01
    attitude: float = 0.0
    samples: int = 51
    angles = ("direction", "attitude")

    def __post_init__(self):
        self._check()
        check_metres(self, "depth", low=1e-9)
        check_ranges(self, speed=SPEEDS, attitude=(-10.0, 10.0))
        told = "direction must point downwards, between 0 and 180 degrees below the horizontal"
        in_range("direction", self.direction, -10.0, 10.0)
        require(0.01 < self.direction < math.pi - 0.01, told)

    def course(self, outline: Outline) -> Course:
        x, z = outline.points.T
        lowest = (z * math.cos(self.attitude) - x * math.sin(self.attitude)).min()
        return _straight(self, 0.0, -lowest, self.depth / math.sin(self.direction))


@dataclass(frozen=True)
class Rotate(Motion):
    """About a hub at a fixed height above the surface.

    hub_height (m): of the frame's origin above the surface. rate (rad/s): positive as it sweeps a leg backwards that points
    down. start, stop (rad): the angle at either end, 0 where a leg points down. speed (m/s): of the hub, forwards.
    """

    hub_height: float
    rate: float = 2 * math.pi
    start: float = -math.pi
    stop: float = math.pi
    speed: float = 0.0
    samples: int = 361
    angles = ("start", "stop")
    turns = True

    def __post_init__(self):
        self._check()
        check_metres(self, "hub_height", low=-LARGEST)
        check_ranges(self, rate=(-1e3, 1e3), speed=(-1e3, 1e3))
        check_ranges(self, start=(-1e3, 1e3), stop=(-1e3, 1e3))
        require(abs(self.rate) >= 1e-9, "rate must not be 0: drag a body that does not turn")
        require(
            (self.stop - self.start) * self.rate > 0,
            "a rate from start to stop: positive if stop > start, else negative",
        )

    def course(self, outline: Outline) -> Course:
        angle = np.linspace(self.start, self.stop, self.samples)
        t = (angle - self.start) / self.rate
        pose = np.stack([self.speed * t, np.full_like(t, self.hub_height), angle], -1)
        return Course(t, pose, np.broadcast_to([self.speed, 0.0, self.rate], pose.shape))


@dataclass(frozen=True)
class Path(Motion):
    """Through given poses. Velocities are differences of order 2 in the spacing of t.

    t (s): times, ascending. x, z (m): of the frame's origin. angle (rad): of the body, 0 throughout if left out.
    """

    t: tuple[float, ...]
    x: tuple[float, ...]
    z: tuple[float, ...]
    angle: tuple[float, ...] = ()

    def __post_init__(self):
        for name in ("t", "x", "z", "angle"):
            values = real_array(name, getattr(self, name))
            require(values.ndim == 1, f"{name} must be a list of numbers")
            object.__setattr__(self, name, tuple(map(float, values)))
            largest, unit = {"x": (FARTHEST, " m"), "z": (LARGEST, " m")}.get(name, (1e9, ""))
            within = all(abs(v) <= largest for v in getattr(self, name))
            require(within, f"{name} must be finite and within {largest:g}{unit}")
        require(3 <= len(self.t) <= MOST_SAMPLES, f"a path takes 3 to {MOST_SAMPLES} poses, got {len(self.t)}")
        same = len(self.x) == len(self.z) == len(self.t) and len(self.angle) in (0, len(self.t))
        require(same, "t, x, z and angle must be equally many")
        late = np.flatnonzero(np.diff(self.t) <= 0)
        require(not late.size, f"t must ascend, but t = {self.t[late[0]] if late.size else 0:g} is not before the next")

    @property
    def samples(self) -> int:
        return len(self.t)

    def course(self, outline: Outline) -> Course:
        t, angle = np.array(self.t), self.angle or (0.0,) * len(self.t)
        pose = np.stack([self.x, self.z, angle], -1)
        return Course(t, pose, np.gradient(pose, t, axis=0, edge_order=2))


MOTIONS = {"drag": Drag, "penetrate": Penetrate, "rotate": Rotate, "csv": Path}


def _straight(motion, x: float, z: float, distance: float) -> Course:
    way = np.array([math.cos(motion.direction), -math.sin(motion.direction), 0.0])
    way[np.abs(way) < 1e-15] = 0.0  # straight down, or level, to the last digit
    s = np.linspace(0.0, distance, motion.samples)
    pose = np.array([x, z, motion.attitude]) + s[:, None] * way
    return Course(s / motion.speed, pose, np.broadcast_to(motion.speed * way, pose.shape))
