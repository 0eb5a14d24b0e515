"""Force and moment of grains on a rigid mesh that moves in any way: the law of `rft.spatial.law` face by face.

On a face the stress is alpha |z| with one alpha, that of the velocity of the middle of the part below the surface; |z| and
its moments are integrated exactly over that part. The error is of second order in the size of triangles where the surface
is smooth and triangles turn by less than the medium's ``grazing`` angle from one to the next.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rft.media.base import real_array, require
from rft.spatial.law import Spatial
from rft.spatial.mesh import Mesh, below
from rft.vertical.effects import GroundEffect, checked, pressure, strength


class Wrench(NamedTuple):
    """force: (..., 3), N. moment: (..., 3), N m, about the origin of the mesh, along x, y, z of the world. power: (...,), W,
    of the grains on the mesh; not positive where the law dissipates. area: (...,), m^2, that bears."""

    force: np.ndarray
    moment: np.ndarray
    power: np.ndarray
    area: np.ndarray


class Faces(NamedTuple):
    """What is below the surface at one pose: corners (P, 3, 3) and middles (P, 3) in the world, m; force (P, 3), N; of (P,):
    the triangle that each is a part of."""

    corners: np.ndarray
    middle: np.ndarray
    force: np.ndarray
    of: np.ndarray


def wrench(
    medium: Spatial, mesh: Mesh, rotation, place, velocity, spin, effects: Sequence[GroundEffect] = ()
) -> Wrench:
    """Force and moment on a mesh at poses (rotation (..., 3, 3), place (..., 3), m, of its origin in the world, z = 0 the
    surface and z up) that moves at velocity (..., 3), m/s, of its origin and spin (..., 3), rad/s, told in the world. effects:
    those of the vertical plane (`rft.vertical.effects`), whose x is the world's."""
    rotation = real_array("rotation", rotation)
    place, velocity, spin = (real_array(n, x) for n, x in (("place", place), ("velocity", velocity), ("spin", spin)))
    require(rotation.shape[-2:] == (3, 3), f"rotation must be (..., 3, 3), got {rotation.shape}")
    straight = np.abs(rotation @ np.swapaxes(rotation, -1, -2) - np.eye(3)).max(initial=0.0)
    proper = straight < 1e-9 and np.all(np.linalg.det(rotation) > 0)
    require(bool(proper), "rotation must be rotation matrices: orthogonal, with determinant 1")
    for name, x in (("place", place), ("velocity", velocity), ("spin", spin)):
        require(x.shape[-1:] == (3,) and bool(np.isfinite(x).all()), f"{name} must be finite (..., 3), got {x.shape}")
    shape = np.broadcast_shapes(rotation.shape[:-2], place.shape[:-1], velocity.shape[:-1], spin.shape[:-1])
    rotation = np.broadcast_to(rotation, (*shape, 3, 3)).reshape(-1, 3, 3)
    place, velocity, spin = (np.broadcast_to(x, (*shape, 3)).reshape(-1, 3) for x in (place, velocity, spin))
    out, effects = np.empty((len(place), 8)), checked(effects)
    for k in range(len(place)):
        out[k] = _at(medium, mesh, rotation[k], place[k], velocity[k], spin[k], effects)
    out = out.reshape(*shape, 8)
    return Wrench(out[..., :3], out[..., 3:6], out[..., 6], out[..., 7])


def _at(medium: Spatial, mesh: Mesh, rotation, place, velocity, spin, effects) -> np.ndarray:
    """Force, moment, power and area at one pose. All is told along the axes of the mesh, which turn the least numbers."""
    up, height, ahead = rotation[2], place[2], (rotation[0], place[0])
    velocity, spin = velocity @ rotation, spin @ rotation
    heights = mesh.vertices @ up + height
    under = (heights < 0)[mesh.faces].T
    some, every = under[0] | under[1] | under[2], under[0] & under[1] & under[2]
    total = np.zeros(8)
    # (v + w x middle) . n = v . n + w . (middle x n), for all triangles at once
    leads = mesh.facing @ velocity + mesh.twists @ spin >= 0
    whole, cut = np.flatnonzero(every & leads), np.flatnonzero(some & ~every)
    if whole.size:
        middle, area = mesh.middles[whole].T, mesh.areas[whole]
        n, weight = mesh.facing[whole].T, -(up @ middle + height) * area
        # integral of |z| x over a triangle, z = up . x + height, from the integral of x x^T
        arms = -(mesh.squares[whole] @ up).T - height * area * middle
        total += _summed(medium, effects, n, up, ahead, velocity, spin, middle, weight, arms, area)
    if cut.size:
        parts, of = below(mesh.vertices[mesh.faces[cut]], heights[mesh.faces[cut]])
        depth = -(parts @ up + height)
        middle, area, sums = parts.mean(1).T, _areas(parts), depth.sum(-1)
        arms = (np.einsum("pi,pij->jp", depth, parts) + 3 * sums * middle) * (area / 12)
        n = mesh.facing[cut[of]].T
        weight = sums / 3 * area
        total += _summed(medium, effects, n, up, ahead, velocity, spin, middle, weight, arms, area)
    total[:3], total[3:6] = rotation @ total[:3], rotation @ total[3:6]
    return total


def _summed(medium, effects, n, up, ahead, velocity, spin, middle, weight, arms, area) -> np.ndarray:
    """(8,): force, moment, power and area of faces (3, N), of which weight (N,) is the integral of |z| and arms (3, N) that
    of |z| x. ahead: the world's x axis, and its value at the origin."""
    v = velocity[:, None] + _cross(spin, middle)
    stress = medium.on_faces(n, v, up)
    bears = area[stress.any(0)].sum()
    if effects:
        stress = stress * strength(effects, ahead[0] @ middle + ahead[1], ahead[0] @ v / _sizes(v))
        push = pressure(effects, np.maximum(np.einsum("iN,iN->N", n, v), 0.0)) * area
    force, moment = stress @ weight, _cross(arms, stress).sum(-1)
    if effects:
        force, moment = force - n @ push, moment - (_cross(middle, n) * push).sum(-1)
    return np.array([*force, *moment, force @ velocity + moment @ spin, bears])


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a x b, components first."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def bearing(
    medium: Spatial, mesh: Mesh, rotation, place, velocity, spin, effects: Sequence[GroundEffect] = ()
) -> Faces:
    """The faces, or parts of them below the surface, at one pose, and what force each bears."""
    rotation, place, velocity, spin = (np.asarray(x, float) for x in (rotation, place, velocity, spin))
    world = mesh.vertices @ rotation.T + place
    parts, of = below(world[mesh.faces], world[mesh.faces, 2])
    middle, n = parts.mean(1), mesh.facing[of] @ rotation.T
    v = velocity + np.cross(spin, middle - place)
    share = strength(effects, middle[:, 0], v[:, 0] / _sizes(v.T))
    stress = medium.stress(n, v) * (-middle[:, 2:] * np.reshape(share, (-1, 1)))
    stress = stress - n * np.reshape(pressure(effects, np.maximum((n * v).sum(-1), 0.0)), (-1, 1))
    return Faces(parts, middle, stress * _areas(parts)[:, None], of)


def _sizes(vectors: np.ndarray) -> np.ndarray:
    """Lengths (N,) of vectors (3, N), 1 of none."""
    sizes = np.sqrt(np.einsum("iN,iN->N", vectors, vectors))
    return np.where(sizes == 0.0, 1.0, sizes)


def _areas(parts: np.ndarray) -> np.ndarray:
    return np.linalg.norm(np.cross(parts[:, 1] - parts[:, 0], parts[:, 2] - parts[:, 0]), axis=-1) / 2
