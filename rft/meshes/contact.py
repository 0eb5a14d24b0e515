"""The contact of triangles with the ground: meshes, hulls, legs and geoms of three dimensions.

On the part of a face below the surface the stress is that of `rft.ground.base` with one alpha, that of the velocity of
the part's middle; |z| and its moments are integrated exactly. Vectors are (3, ...), along any axes."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from rft.ground import Ground, per_speed, share

UP, AHEAD = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])


class FaceLaw(Protocol):
    """A law of three dimensions. sine: of the grazing angle."""

    sine: float

    def traction(self, n: np.ndarray, v: np.ndarray, up: np.ndarray = UP) -> np.ndarray:
        """Return the force per area and depth, N/m^3 (3, ...), on faces with outward unit normals n and unit velocities
        v, whether or not they lead; upwards is along ``up``."""
        ...

    def lead(self, into: np.ndarray, sine: float, sheet: np.ndarray | bool) -> np.ndarray:
        """Return how much of it faces bear, 0 to 1 (`rft.ground.lead`). sheet: whether either side may lead."""
        ...


class Part(NamedTuple):
    """What of faces is below the surface. n: unit normal, outwards. middle: m from the origin. area: m^2. depth:
    integral of |z| over it, m^3. arms: integral of |z| times the place, m^4."""

    n: np.ndarray
    middle: np.ndarray
    area: np.ndarray
    depth: np.ndarray
    arms: np.ndarray


class Motion(NamedTuple):
    """Velocity of the origin, m/s, and spin, rad/s; x of the origin, m; upwards and the world's x axis, along the axes
    that vectors are told along."""

    velocity: np.ndarray
    spin: np.ndarray
    x: float | np.ndarray = 0.0
    up: np.ndarray = UP
    ahead: np.ndarray = AHEAD


def load(law: FaceLaw, ground: Ground, part: Part, at: Motion, sheet: np.ndarray | bool = False):
    """Return force (3, ...), N, moment about the origin (3, ...), N m, and stress per depth (3, ...), N/m^3, of the
    grains on faces."""
    n, v = np.broadcast_arrays(part.n, at.velocity + cross(at.spin, part.middle))
    speed, across = np.sqrt(dot(v, v)), dot(n, v)
    per, unit = per_speed(ground, speed), v / np.where(speed == 0.0, 1.0, speed)
    bears = speed * per * law.lead(across * per, ground.sine, sheet) * _share(ground, part, at, unit)
    flat = lambda x: x.reshape(3, -1)
    stress = law.traction(flat(n), flat(unit), at.up).reshape(v.shape) * bears
    force, moment = stress * part.depth, cross(part.arms, stress)
    if np.any(ground.flux):
        into = np.where(sheet, across, np.maximum(across, 0.0))
        push = ground.flux * into * np.abs(into) * part.area
        force, moment = force - push * n, moment - push * cross(part.middle, n)
    return force, moment, stress


def _share(ground: Ground, part: Part, at: Motion, unit: np.ndarray):
    """The ground's strength on the faces, one number where it is the same everywhere."""
    if not (ground.fall or len(ground.disturbed)):
        return ground.strength
    ahead = at.ahead.reshape(3, *[1] * (unit.ndim - 1))
    return share(ground, at.x + dot(ahead, part.middle), dot(ahead, unit))


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return a x b, components first."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        np.subtract(a[j] * b[k], a[k] * b[j], out=out[i])
    return out


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return a . b, components first."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
