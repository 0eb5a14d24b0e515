"""The contact of triangles with the ground: meshes, hulls, legs and geoms of three dimensions.

On the part of a face below the surface the stress is that of `rft.ground.base` with one alpha, that of the velocity of
the part's middle; |z| and its moments are integrated exactly. Vectors are (3, ...), along any axes."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from rft.ground import Ground, inverse_speed, strength_at

UP, AHEAD = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])


class FaceLaw(Protocol):
    """A law of three dimensions. grazing_sine: sine of the grazing angle."""

    grazing_sine: float

    def traction(self, n: np.ndarray, v: np.ndarray, up: np.ndarray = UP) -> np.ndarray:
        """Return the force per area and depth (3, ...), N/m^3, on faces with outward unit normals n and unit velocities
        v (3, ...), whether or not they lead; ``up`` (3,) is the unit vector upwards."""
        ...

    def lead(self, n_dot_v: np.ndarray, grazing_sine: float, sheet: np.ndarray | bool) -> np.ndarray:
        """Return the share of the traction that faces bear, 0 to 1 (`rft.ground.lead`). sheet: whether either side may
        lead."""
        ...


class Part(NamedTuple):
    """The parts of faces below the surface. n: outward unit normal. middle: from the origin, m. area: m^2. depth:
    integral of |z| over the part, m^3. arms: integral of |z| times the vector from the origin, m^4."""

    n: np.ndarray
    middle: np.ndarray
    area: np.ndarray
    depth: np.ndarray
    arms: np.ndarray


class Motion(NamedTuple):
    """Motion of a body. velocity: of the origin, m/s. spin: angular velocity, rad/s. x: of the origin in the world, m.
    up, ahead: unit vectors upwards and along the world's x axis. All vectors are along the same axes."""

    velocity: np.ndarray
    spin: np.ndarray
    x: float | np.ndarray = 0.0
    up: np.ndarray = UP
    ahead: np.ndarray = AHEAD


def load(law: FaceLaw, ground: Ground, part: Part, motion: Motion, sheet: np.ndarray | bool = False):
    """Return force (3, ...), N, moment about the origin (3, ...), N m, and stress per depth (3, ...), N/m^3, of the
    grains on parts of faces. sheet: whether a face is one of a thin sheet, of which either side may lead."""
    n, v = np.broadcast_arrays(part.n, motion.velocity + cross(motion.spin, part.middle))
    speed, across = np.sqrt(dot(v, v)), dot(n, v)
    slowness, unit = inverse_speed(ground, speed), v / np.where(speed == 0.0, 1.0, speed)
    lead = law.lead(across * slowness, ground.grazing_sine, sheet)
    share = speed * slowness * lead * _strength(ground, part, motion, unit)
    stress = law.traction(n.reshape(3, -1), unit.reshape(3, -1), motion.up).reshape(v.shape) * share
    force, moment = stress * part.depth, cross(part.arms, stress)
    if np.any(ground.flux):
        across = np.where(sheet, across, np.maximum(across, 0.0))
        push = ground.flux * across * np.abs(across) * part.area
        force, moment = force - push * n, moment - push * cross(part.middle, n)
    return force, moment, stress


def _strength(ground: Ground, part: Part, motion: Motion, unit: np.ndarray):
    """Return the ground's strength at the parts, one number where it is the same everywhere."""
    if not (ground.downhill_loss or len(ground.disturbed)):
        return ground.strength
    ahead = motion.ahead.reshape(3, *[1] * (unit.ndim - 1))
    return strength_at(ground, motion.x + dot(ahead, part.middle), dot(ahead, unit))


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return a x b, components first."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        np.subtract(a[j] * b[k], a[k] * b[j], out=out[i])
    return out


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return a . b, components first."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
