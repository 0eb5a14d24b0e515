"""Prescribed motions of rigid bodies, one class per kind. SI units; x forwards, z up,
the surface at z = 0.

Rotations are right-handed about their axes: about y, a body that hangs down and rotates
at a positive rate sweeps backwards. A heading is the direction of motion along the
ground, rad from x towards y.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, NamedTuple

import numpy as np

from rft.core.checks import Number, check_numbers, real_array
from rft.core.metres import LARGEST, metres
from rft.core.refusal import Refusal, require
from rft.terradynamics.meshes.surfaces.mesh import Mesh
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

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

WIDEST = 2.0  # rad between two poses of a path

Speed = Annotated[
    float,
    Number(1e-9, 1e3, "m/s", "speed; it affects only the force of grain inertia"),
]
Heading = Annotated[
    float,
    Number(-10, 10, "rad", "heading of the motion along the ground, from x towards y"),
]
Angle = Annotated[
    float,
    Number(
        -1e3,
        1e3,
        "rad",
        "angle about the axis, relative to the attitude, at one end of the motion",
    ),
]


class Trajectory(NamedTuple):
    """A motion in time, in the world.

    t: (T,), s. place: (T, 3), of the origin, m. rotation: (T, 3, 3), from the body's
    axes to the world's. velocity: (T, 3), of the origin, m/s. spin: (T, 3), angular
    velocity, rad/s. angle: (T,), rad, of a body that rotates about one axis, else 0.

    Examples
    --------
    >>> from rft.terradynamics.meshes import Drag, Sphere
    >>> ball = Sphere(0.02).mesh(80)
    >>> motion = Drag(depth=0.05, distance=0.1, samples=3).trajectory(ball)
    >>> motion.place, motion.spin.shape
    (array([[ 0.  ,  0.  , -0.05],
           [ 0.05,  0.  , -0.05],
           [ 0.1 ,  0.  , -0.05]]), (3, 3))
    """

    t: np.ndarray
    place: np.ndarray
    rotation: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray
    angle: np.ndarray


@dataclass(frozen=True)
class Drag(Motion):
    """Motion along a straight line without rotation.

    attitude (rad): orientation of the body, a rotation vector, or an angle about y.

    Examples
    --------
    >>> from rft.terradynamics.meshes import Drag, Sphere
    >>> motion = Drag(depth=0.05, distance=0.1).trajectory(Sphere(0.02).mesh(80))
    >>> motion.place[-1].round(3)
    array([ 0.1 ,  0.  , -0.05])
    """

    depth: Depth
    direction: Direction = 0.0
    heading: Heading = 0.0
    speed: Speed = 0.01
    distance: Distance = 0.1
    attitude: float | tuple[float, ...] = (0.0, 0.0, 0.0)
    samples: Samples = 51

    def __post_init__(self):
        check_numbers(self)
        _set_attitude(self)

    def trajectory(self, mesh: Mesh) -> Trajectory:
        """Return the motion of a mesh in time."""
        return _straight(self, -self.depth, self.distance)


@dataclass(frozen=True)
class Penetrate(Motion):
    """Motion straight or obliquely down, from where the lowest point touches the
    surface.

    attitude (rad): orientation of the body, a rotation vector, or an angle about y.

    Examples
    --------
    >>> from rft.terradynamics.meshes import Penetrate, Sphere
    >>> motion = Penetrate(depth=0.05).trajectory(Sphere(0.02).mesh(80))
    >>> motion.place[-1].round(3)
    array([ 0.  ,  0.  , -0.03])
    """

    depth: Annotated[
        float, metres("depth of the lowest point at the end of the motion", 1e-9)
    ]
    direction: Direction = math.pi / 2
    heading: Heading = 0.0
    speed: Speed = 0.01
    attitude: float | tuple[float, ...] = (0.0, 0.0, 0.0)
    samples: Samples = 51

    def __post_init__(self):
        check_numbers(self)
        self.require_downwards()
        _set_attitude(self)

    def trajectory(self, mesh: Mesh) -> Trajectory:
        """Return the motion of a mesh in time."""
        lowest = float((mesh.vertices @ _matrix(self.attitude)[2]).min())
        return _straight(self, -lowest, self.depth / math.sin(self.direction))


@dataclass(frozen=True)
class Rotate(Motion):
    """Rotation about an axis through the origin, at a fixed height above the surface;
    the origin may move along the ground.

    axis (-): direction of the axis, of any length but 0. attitude (rad): orientation of
    the body at angle 0, a rotation vector, or an angle about y.

    Examples
    --------
    >>> from rft.terradynamics.meshes import Leg, Rotate
    >>> motion = Rotate(hub_height=0.02).trajectory(Leg(0.038, 0.02, 0.002).mesh(500))
    >>> motion.rotation.shape
    (361, 3, 3)
    """

    hub_height: Height
    axis: tuple[float, ...] = (0.0, 1.0, 0.0)
    rate: Annotated[
        float,
        Number(
            -1e3,
            1e3,
            "rad/s",
            "rate of rotation, right-handed about the axis; positive if stop > start",
        ),
    ] = 2 * math.pi
    start: Angle = -math.pi
    stop: Angle = math.pi
    speed: Annotated[
        float, Number(-1e3, 1e3, "m/s", "speed of the origin along the ground")
    ] = 0.0
    heading: Heading = 0.0
    attitude: float | tuple[float, ...] = (0.0, 0.0, 0.0)
    samples: Samples = 361
    turns = True

    def __post_init__(self):
        check_numbers(self)
        self.require_turning()
        axis = real_array("axis", self.axis)
        is_vector = axis.shape == (3,)
        require(
            is_vector and 1e-9 < float(np.linalg.norm(axis)) < 1e9,
            "axis must be three numbers that are not all 0, such as [0, 1, 0]",
            value=self.axis,
        )
        object.__setattr__(self, "axis", tuple(axis.tolist()))
        _set_attitude(self)

    def trajectory(self, mesh: Mesh) -> Trajectory:
        """Return the motion of a mesh in time."""
        axis = np.array(self.axis) / np.linalg.norm(self.axis)
        angle = np.linspace(self.start, self.stop, self.samples)
        t = (angle - self.start) / self.rate
        rotation = rotations(angle[:, None] * axis).as_matrix() @ _matrix(self.attitude)
        spin = np.broadcast_to(self.rate * axis, (len(t), 3))
        velocity = self.speed * _unit_vector(self.heading, 0.0)
        velocity = np.broadcast_to(velocity, (len(t), 3))
        place = velocity * t[:, None] + [0.0, 0.0, self.hub_height]
        return Trajectory(t, place, rotation, velocity, spin, angle)


@dataclass(frozen=True)
class Path(Motion):
    """Motion through given poses. Velocities and spins are differences of order 2 in
    the spacing of t.

    t (s): times, ascending. x, y, z (m): of the origin. rx, ry, rz (rad): rotation
    vectors, all or none; from one pose to the next the body rotates by less than 2 rad.

    Examples
    --------
    >>> from rft.terradynamics.meshes import Path, Sphere
    >>> still, deep = (0.0, 0.0, 0.0), (-0.05, -0.05, -0.05)
    >>> path = Path(t=(0.0, 1.0, 2.0), x=(0.0, 0.01, 0.02), y=still, z=deep)
    >>> path.trajectory(Sphere(0.02).mesh(80)).velocity[0].round(3)  # m/s
    array([0.01, 0.  , 0.  ])
    """

    t: tuple[float, ...]
    x: tuple[float, ...]
    y: tuple[float, ...]
    z: tuple[float, ...]
    rx: tuple[float, ...] = ()
    ry: tuple[float, ...] = ()
    rz: tuple[float, ...] = ()

    def __post_init__(self):
        set_numbers(self, "t", 1e9)
        set_numbers(self, "x", FARTHEST, " m")
        set_numbers(self, "y", FARTHEST, " m")
        set_numbers(self, "z", LARGEST, " m")
        for name in ("rx", "ry", "rz"):
            set_numbers(self, name, 1e9)
        require_path_length(self.t)
        are_equal = len(self.x) == len(self.y) == len(self.z) == len(self.t)
        n_rotations = {len(self.rx), len(self.ry), len(self.rz)}
        all_or_none = n_rotations in ({0}, {len(self.t)})
        require(
            are_equal and all_or_none,
            "t, x, y, z and rx, ry, rz must have the same length",
        )
        require_ascending(self.t)

        rotation = self._rotations()
        steps = (rotation[1:] * rotation[:-1].inv()).magnitude()
        wide = np.flatnonzero(steps >= WIDEST)
        if wide.size:
            raise Refusal(
                f"the body turns by {WIDEST:g} rad or more "
                f"after t = {self.t[wide[0]]:g}",
                instead="give poses in between",
            )

    @property
    def samples(self) -> int:
        return len(self.t)

    def _rotations(self) -> Rotation:
        """Return the rotations (T,) of the poses."""
        if not self.rx:
            return rotations(np.zeros((len(self.t), 3)))
        return rotations(np.stack([self.rx, self.ry, self.rz], -1))

    def trajectory(self, mesh: Mesh) -> Trajectory:
        """Return the motion of a mesh in time."""
        t = np.array(self.t)
        place = np.stack([self.x, self.y, self.z], -1)
        velocity = np.gradient(place, t, axis=0, edge_order=2)
        rotation = self._rotations()
        spin = _spins(t, rotation)
        angle = np.zeros_like(t)
        return Trajectory(t, place, rotation.as_matrix(), velocity, spin, angle)


MOTIONS = {"drag": Drag, "penetrate": Penetrate, "rotate": Rotate, "csv": Path}


def rotations(vectors) -> Rotation:
    """Return the rotations (...,) by rotation vectors (..., 3), rad."""
    from scipy.spatial.transform import Rotation  # takes a fifth of a second to load

    return Rotation.from_rotvec(vectors)


def _spins(t, rotation: Rotation) -> np.ndarray:
    """Return the angular velocities (T, 3), rad/s in the world, of rotations at times t
    (T,).

    At each time it is the slope of the parabola through three rotation vectors: from
    this rotation to itself and to its neighbours."""
    # The numbers (T, 3) of the poses at which each parabola is known.
    nodes = np.clip(np.arange(len(t)) - 1, 0, len(t) - 3)[:, None] + np.arange(3)
    inverse = rotation.inv()
    spins = 0.0
    for k in range(3):
        vector = (rotation[nodes[:, k]] * inverse).as_rotvec()
        i, j = np.delete(nodes, k, axis=1).T
        spacing = (t[nodes[:, k]] - t[i]) * (t[nodes[:, k]] - t[j])
        slope = (2 * t - t[i] - t[j]) / spacing
        spins = spins + slope[:, None] * vector
    return spins


def _set_attitude(motion) -> None:
    """Store the attitude of a motion as a rotation vector; ValueError unless it is an
    angle or three numbers."""
    value = motion.attitude
    array = real_array("attitude", value)
    is_valid = array.shape in ((), (3,)) and bool((np.abs(array) <= 10.0).all())
    require(
        is_valid,
        "attitude must be an angle about y or a rotation vector of three numbers, "
        "within 10 rad",
        value=value,
    )
    vector = array.tolist() if array.ndim else [0.0, float(array), 0.0]
    object.__setattr__(motion, "attitude", tuple(vector))


def _matrix(vector) -> np.ndarray:
    """Return the matrix (3, 3) of a rotation vector."""
    return rotations(vector).as_matrix()


def _unit_vector(heading: float, direction: float) -> np.ndarray:
    """Return the unit vector (3,) with a heading along the ground and a direction below
    the horizontal, rad."""
    level = math.cos(direction)
    x = level * math.cos(heading)
    y = level * math.sin(heading)
    along = np.array([x, y, -math.sin(direction)])
    along[np.abs(along) < 1e-15] = 0.0  # straight down, or level, to the last digit
    return along


def _straight(motion, z: float, distance: float) -> Trajectory:
    """Return a motion over a distance, m, along a straight line from (0, 0, z)."""
    along = _unit_vector(motion.heading, motion.direction)
    s = np.linspace(0.0, distance, motion.samples)
    place = np.array([0.0, 0.0, z]) + s[:, None] * along
    rotation = np.broadcast_to(_matrix(motion.attitude), (len(s), 3, 3))
    velocity = np.broadcast_to(motion.speed * along, place.shape)
    spin = np.zeros_like(place)
    angle = np.zeros_like(s)
    return Trajectory(s / motion.speed, place, rotation, velocity, spin, angle)
