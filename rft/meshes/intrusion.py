"""Force and moment of grains on a rigid mesh that moves in any way: the law of `rft.meshes.law` face by face
(`rft.meshes.contact`).

The error is of second order in the size of triangles where the surface
is smooth and triangles turn by less than the medium's ``grazing`` angle from one to the next.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rft.checks import real_array, require
from rft.ground import Ground, GroundEffect, ground_of
from rft.meshes.contact import Motion, Part, load
from rft.meshes.law import Spatial
from rft.meshes.mesh import Mesh, below
from rft.meshes.submerged import submerged


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
    those of the vertical plane (`rft.ground`), whose x is the world's."""
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
    out, ground = np.empty((len(place), 8)), ground_of(effects, Ground(sine=medium.sine))
    for k in range(len(place)):
        out[k] = _at(medium, mesh, ground, rotation[k], place[k], velocity[k], spin[k])
    out = out.reshape(*shape, 8)
    return Wrench(out[..., :3], out[..., 3:6], out[..., 6], out[..., 7])


def _at(medium: Spatial, mesh: Mesh, ground: Ground, rotation, place, velocity, spin) -> np.ndarray:
    """Force, moment, power and area at one pose. All is told along the axes of the mesh, which turn the least numbers."""
    up, height = rotation[2], place[2]
    velocity, spin = velocity @ rotation, spin @ rotation
    heights = mesh.vertices @ up + height
    under = (heights < 0)[mesh.faces].T
    some, every = under[0] | under[1] | under[2], under[0] & under[1] & under[2]
    # (v + w x middle) . n = v . n + w . (middle x n), for all triangles at once
    leads = mesh.facing @ velocity + mesh.twists @ spin >= 0
    parts = _whole(mesh, np.flatnonzero(every & leads), up, height), _cut(mesh, np.flatnonzero(some & ~every), heights)
    part = Part(*(np.concatenate(x, -1) for x in zip(*parts)))
    at = Motion(velocity[:, None], spin[:, None], place[0], up, rotation[0])
    force, moment, stress = load(medium, ground, part, at)
    force, moment = force.sum(-1), moment.sum(-1)
    power = force @ velocity + moment @ spin
    return np.array([*rotation @ force, *rotation @ moment, power, part.area[stress.any(0)].sum()])


def _whole(mesh: Mesh, some: np.ndarray, up: np.ndarray, height: float) -> Part:
    """Of triangles that are wholly below the surface, z = height + up . x."""
    middle, area = mesh.middles[some].T, mesh.areas[some]
    # the integral of |z| x from that of x x^T
    arms = -(mesh.squares[some] @ up).T - height * area * middle
    return Part(mesh.facing[some].T, middle, area, -(up @ middle + height) * area, arms)


def _cut(mesh: Mesh, some: np.ndarray, heights: np.ndarray) -> Part:
    """Of triangles that cross the surface."""
    share, middle, moments = submerged(heights[mesh.faces[some]].T)
    corners, area = mesh.vertices[mesh.faces[some]], mesh.areas[some]
    middle, arms = (np.einsum("ct,tcj->jt", x, corners) for x in (middle, moments))
    return Part(mesh.facing[some].T, middle, area * share, area * moments.sum(0), area * arms)


def bearing(
    medium: Spatial, mesh: Mesh, rotation, place, velocity, spin, effects: Sequence[GroundEffect] = ()
) -> Faces:
    """The faces, or parts of them below the surface, at one pose, and what force each bears."""
    rotation, place, velocity, spin = (np.asarray(x, float) for x in (rotation, place, velocity, spin))
    world = mesh.vertices @ rotation.T + place
    parts, of = below(world[mesh.faces], world[mesh.faces, 2])
    middle, area = (
        parts.mean(1),
        np.linalg.norm(np.cross(parts[:, 1] - parts[:, 0], parts[:, 2] - parts[:, 0]), axis=-1) / 2,
    )
    depth, arm = -middle[:, 2] * area, (middle - place).T
    part = Part((mesh.facing[of] @ rotation.T).T, arm, area, depth, depth * arm)
    ground = ground_of(effects, Ground(sine=medium.sine))
    force = load(medium, ground, part, Motion(velocity[:, None], spin[:, None], place[0]))[0]
    return Faces(parts, middle, force.T, of)
