"""Force and moment of grains on a rigid mesh in any motion: the law of
`rft.terradynamics.meshes.forces.law` face by face
(`rft.terradynamics.meshes.forces.contact`).

The error is of order 2 in the size of triangles where the surface is smooth and
neighbouring triangles meet at less than the medium's ``grazing`` angle.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rft.core.checks import real_array, unmasked
from rft.core.refusal import require
from rft.terradynamics.ground import Ground, GroundEffect, ground_of
from rft.terradynamics.meshes.forces.contact import (
    Motion,
    Part,
    load,
    velocity_of_middle,
)
from rft.terradynamics.meshes.forces.law import Spatial
from rft.terradynamics.meshes.forces.submerged import submerged_part
from rft.terradynamics.meshes.surfaces.mesh import Mesh, below


class Wrench(NamedTuple):
    """Load of the grains on a mesh, in the world.

    force: (..., 3), N. moment: (..., 3), N m, about the origin of the mesh. power:
    (...,), W, of the grains on the mesh; at most 0 where the law dissipates. area:
    (...,), m^2, under stress.

    Examples
    --------
    >>> import numpy as np
    >>> from rft.terradynamics.meshes import Spatial, Sphere, wrench
    >>> ball, sand = Sphere(radius=0.02).mesh(320), Spatial(xi_n=1e5)
    >>> sinking = dict(place=[0, 0, -0.05], velocity=[0, 0, -0.01], spin=[0, 0, 0])
    >>> load = wrench(sand, ball, np.eye(3), **sinking)
    >>> bool(load.power < 0), round(float(load.area), 4)  # W, m^2
    (True, 0.0023)
    """

    force: np.ndarray
    moment: np.ndarray
    power: np.ndarray
    area: np.ndarray


class Faces(NamedTuple):
    """Parts of triangles below the surface at one pose, in the world.

    corners: (P, 3, 3), m. middle: (P, 3), m. force: (P, 3), N. triangle: (P,), index of
    the triangle that each is a part of.

    Examples
    --------
    >>> import numpy as np
    >>> from rft.terradynamics.meshes import Spatial, Sphere, bearing
    >>> ball, sand = Sphere(radius=0.02).mesh(320), Spatial(xi_n=1e5)
    >>> sinking = dict(place=[0, 0, 0], velocity=[0, 0, -0.01], spin=[0, 0, 0])
    >>> faces = bearing(sand, ball, np.eye(3), **sinking)
    >>> faces.corners.shape[1:], int(faces.triangle.max()) < 320
    ((3, 3), True)
    """

    corners: np.ndarray
    middle: np.ndarray
    force: np.ndarray
    triangle: np.ndarray


def wrench(
    medium: Spatial,
    mesh: Mesh,
    rotation,
    place,
    velocity,
    spin,
    effects: Sequence[GroundEffect] = (),
) -> Wrench:
    """Return force and moment on a mesh in motions that broadcast together, on ground
    with effects (`rft.terradynamics.ground`).

    rotation: (..., 3, 3), from the mesh's axes to the world's, with z up and z = 0 the
    surface. place: (..., 3), origin of the mesh, m. velocity: (..., 3), of the origin,
    m/s. spin: (..., 3), angular velocity, rad/s. All three are in the world.

    Examples
    --------
    >>> import numpy as np
    >>> from rft.terradynamics.meshes import Spatial, Sphere, wrench
    >>> ball, sand = Sphere(radius=0.02).mesh(320), Spatial(xi_n=1e5)
    >>> sinking = dict(place=[0, 0, -0.05], velocity=[0, 0, -0.01], spin=[0, 0, 0])
    >>> load = wrench(sand, ball, np.eye(3), **sinking)
    >>> round(float(load.force[2]), 2)  # N, upwards
    7.19
    """
    rotation = _checked_rotation(rotation)
    place = _checked_vector("place", place)
    velocity = _checked_vector("velocity", velocity)
    spin = _checked_vector("spin", spin)
    shape = np.broadcast_shapes(
        rotation.shape[:-2], place.shape[:-1], velocity.shape[:-1], spin.shape[:-1]
    )
    rotation = np.broadcast_to(rotation, (*shape, 3, 3)).reshape(-1, 3, 3)
    place = np.broadcast_to(place, (*shape, 3)).reshape(-1, 3)
    velocity = np.broadcast_to(velocity, (*shape, 3)).reshape(-1, 3)
    spin = np.broadcast_to(spin, (*shape, 3)).reshape(-1, 3)

    ground = ground_of(effects, Ground(grazing_sine=medium.grazing_sine))
    out = np.empty((len(place), 8))
    for k in range(len(place)):
        out[k] = _wrench_of_motion(
            medium, mesh, ground, rotation[k], place[k], velocity[k], spin[k]
        )
    out = out.reshape(*shape, 8)
    return Wrench(out[..., :3], out[..., 3:6], out[..., 6], out[..., 7])


def _checked_rotation(rotation) -> np.ndarray:
    """Return rotation matrices (..., 3, 3) as an array; ValueError for others."""
    rotation = real_array("rotation", rotation)
    require(
        rotation.shape[-2:] == (3, 3),
        "rotation must be (..., 3, 3)",
        value=rotation.shape,
    )
    product = rotation @ np.swapaxes(rotation, -1, -2)
    is_orthogonal = np.abs(product - np.eye(3)).max(initial=0.0) < 1e-9
    is_proper = is_orthogonal and np.all(np.linalg.det(rotation) > 0)
    require(
        bool(is_proper),
        "rotation must be rotation matrices",
        because="orthogonal, with determinant 1",
    )
    return rotation


def _checked_vector(name: str, vector) -> np.ndarray:
    """Return vectors (..., 3) as an array; ValueError unless they are finite."""
    vector = real_array(name, vector)
    require(
        vector.shape[-1:] == (3,) and bool(np.isfinite(vector).all()),
        f"{name} must be finite (..., 3)",
        value=vector.shape,
    )
    return vector


def _wrench_of_motion(
    medium: Spatial, mesh: Mesh, ground: Ground, rotation, place, velocity, spin
) -> np.ndarray:
    """Return force, moment, power and area (8,) in one motion."""
    # Vectors are along the axes of the mesh: fewer numbers are rotated than the mesh
    # has.
    up = rotation[2]
    height = place[2]
    velocity = velocity @ rotation
    spin = spin @ rotation
    motion = Motion(velocity, spin, place[0], up, rotation[0])

    heights = mesh.vertices @ up + height
    a, b, c = (heights < 0)[mesh.faces].T
    is_under = a & b & c
    is_cut = (a | b | c) & ~is_under
    # (v + w x middle) . n = v . n + w . (middle x n), for all triangles at once
    leads = mesh.middle_normals @ velocity + mesh.normal_moments @ spin >= 0
    full = _full_triangles(mesh, np.flatnonzero(is_under & leads), up, height)
    cut = _cut_triangles(mesh, np.flatnonzero(is_cut), heights)
    part = Part(*(np.concatenate(x, -1) for x in zip(full, cut)))

    v = velocity_of_middle(part, motion)
    force, moment, stress = load(medium, ground, part, motion, v, False)
    force = np.sum(force, -1)
    moment = np.sum(moment, -1)
    power = force @ velocity + moment @ spin
    area = part.area[np.any(stress, 0)].sum()
    return np.array([*rotation @ force, *rotation @ moment, power, area])


def _full_triangles(
    mesh: Mesh, index: np.ndarray, up: np.ndarray, height: float
) -> Part:
    """Return the parts of triangles that are entirely below the surface; a corner x is
    at z = height + up . x."""
    middle = mesh.middles[index].T
    area = mesh.areas[index]
    depth = -(up @ middle + height) * area
    # the integral of |z| x from that of x x^T
    arms = -(mesh.second_moments[index] @ up).T - height * area * middle
    return Part(mesh.middle_normals[index].T, middle, area, depth, arms)


def _cut_triangles(mesh: Mesh, index: np.ndarray, heights: np.ndarray) -> Part:
    """Return the parts of triangles that cross the surface, at heights (V,) of the
    vertices."""
    share, middle, moments = submerged_part(heights[mesh.faces[index]].T)
    corners = mesh.vertices[mesh.faces[index]]
    area = mesh.areas[index]
    normal = mesh.middle_normals[index].T
    middle = np.einsum("ct,tcj->jt", middle, corners)
    arms = area * np.einsum("ct,tcj->jt", moments, corners)
    return Part(normal, middle, area * share, area * moments.sum(0), arms)


def bearing(
    medium: Spatial,
    mesh: Mesh,
    rotation,
    place,
    velocity,
    spin,
    effects: Sequence[GroundEffect] = (),
) -> Faces:
    """Return the parts of faces below the surface at one pose, and the force on each;
    for the arguments see `wrench`.

    Examples
    --------
    >>> import numpy as np
    >>> from rft.terradynamics.meshes import Spatial, Sphere, bearing
    >>> ball, sand = Sphere(radius=0.02).mesh(320), Spatial(xi_n=1e5)
    >>> sinking = dict(place=[0, 0, 0], velocity=[0, 0, -0.01], spin=[0, 0, 0])
    >>> faces = bearing(sand, ball, np.eye(3), **sinking)
    >>> round(float(faces.force[:, 2].sum()), 2)  # N, upwards, on the lower half
    1.56
    """
    names = "rotation, place, velocity and spin"
    rotation = unmasked(names, rotation)
    place = unmasked(names, place)
    velocity = unmasked(names, velocity)
    spin = unmasked(names, spin)

    world = mesh.vertices @ rotation.T + place
    parts, triangle = below(world[mesh.faces], world[mesh.faces, 2])
    middle = parts.mean(1)
    cross = np.cross(parts[:, 1] - parts[:, 0], parts[:, 2] - parts[:, 0])
    area = np.linalg.norm(cross, axis=-1) / 2
    depth = -middle[:, 2] * area
    arm = (middle - place).T
    normal = (mesh.middle_normals[triangle] @ rotation.T).T
    part = Part(normal, arm, area, depth, depth * arm)

    ground = ground_of(effects, Ground(grazing_sine=medium.grazing_sine))
    motion = Motion(velocity, spin, place[0])
    v = velocity_of_middle(part, motion)
    force, _, _ = load(medium, ground, part, motion, v, False)
    return Faces(parts, middle, np.stack(force, -1), triangle)
