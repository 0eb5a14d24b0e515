"""Force and moment of grains on a rigid mesh in any motion: the law of `rft.terradynamics.meshes.law` face by face
(`rft.terradynamics.meshes.contact`).

The error is of order 2 in the size of triangles where the surface is smooth and neighbouring triangles meet at less than
the medium's ``grazing`` angle.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rft.core.checks import real_array, unmasked
from rft.core.refusal import require
from rft.terradynamics.ground import Ground, GroundEffect, ground_of
from rft.terradynamics.meshes.contact import Motion, Part, load, velocity_of_middle
from rft.terradynamics.meshes.law import Spatial
from rft.terradynamics.meshes.mesh import Mesh, below
from rft.terradynamics.meshes.submerged import submerged


class Wrench(NamedTuple):
    """Load of the grains on a mesh, in the world. force: (..., 3), N. moment: (..., 3), N m, about the origin of the mesh.
    power: (...,), W, of the grains on the mesh; not positive where the law dissipates. area: (...,), m^2, under stress.

    Examples
    --------
    >>> import numpy as np
    >>> from rft.terradynamics.meshes import Spatial, Sphere, wrench
    >>> ball, sand = Sphere(radius=0.02).mesh(320), Spatial(xi_n=1e5)
    >>> load = wrench(sand, ball, np.eye(3), place=[0, 0, -0.05], velocity=[0, 0, -0.01], spin=[0, 0, 0])
    >>> bool(load.power < 0), round(float(load.area), 4)  # W, m^2
    (True, 0.0023)
    """

    force: np.ndarray
    moment: np.ndarray
    power: np.ndarray
    area: np.ndarray


class Faces(NamedTuple):
    """Parts of triangles below the surface at one pose. corners: (P, 3, 3), and middle: (P, 3), in the world, m. force:
    (P, 3), N. triangle: (P,), index of the triangle that each is a part of.

    Examples
    --------
    >>> import numpy as np
    >>> from rft.terradynamics.meshes import Spatial, Sphere, bearing
    >>> ball, sand = Sphere(radius=0.02).mesh(320), Spatial(xi_n=1e5)
    >>> faces = bearing(sand, ball, np.eye(3), place=[0, 0, 0], velocity=[0, 0, -0.01], spin=[0, 0, 0])
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

    rotation: (..., 3, 3), from the mesh's axes to the world's, z up and z = 0 the surface. place: (..., 3), origin of the
    mesh in the world, m. velocity: (..., 3), of the origin, m/s. spin: (..., 3), angular velocity, rad/s. Both are in the
    world.

    Examples
    --------
    >>> import numpy as np
    >>> from rft.terradynamics.meshes import Spatial, Sphere, wrench
    >>> ball, sand = Sphere(radius=0.02).mesh(320), Spatial(xi_n=1e5)
    >>> load = wrench(sand, ball, np.eye(3), place=[0, 0, -0.05], velocity=[0, 0, -0.01], spin=[0, 0, 0])
    >>> round(float(load.force[2]), 2)  # N, upwards
    7.19
    """
    rotation = real_array("rotation", rotation)
    place, velocity, spin = (
        real_array(n, x)
        for n, x in (("place", place), ("velocity", velocity), ("spin", spin))
    )
    require(
        rotation.shape[-2:] == (3, 3),
        "rotation must be (..., 3, 3)",
        value=rotation.shape,
    )
    skewness = np.abs(rotation @ np.swapaxes(rotation, -1, -2) - np.eye(3)).max(
        initial=0.0
    )
    proper = skewness < 1e-9 and np.all(np.linalg.det(rotation) > 0)
    require(
        bool(proper),
        "rotation must be rotation matrices",
        because="orthogonal, with determinant 1",
    )
    for name, x in (("place", place), ("velocity", velocity), ("spin", spin)):
        require(
            x.shape[-1:] == (3,) and bool(np.isfinite(x).all()),
            f"{name} must be finite (..., 3)",
            value=x.shape,
        )
    shape = np.broadcast_shapes(
        rotation.shape[:-2], place.shape[:-1], velocity.shape[:-1], spin.shape[:-1]
    )
    rotation = np.broadcast_to(rotation, (*shape, 3, 3)).reshape(-1, 3, 3)
    place, velocity, spin = (
        np.broadcast_to(x, (*shape, 3)).reshape(-1, 3) for x in (place, velocity, spin)
    )
    out, ground = (
        np.empty((len(place), 8)),
        ground_of(effects, Ground(grazing_sine=medium.grazing_sine)),
    )
    for k in range(len(place)):
        out[k] = _wrench_at(
            medium, mesh, ground, rotation[k], place[k], velocity[k], spin[k]
        )
    out = out.reshape(*shape, 8)
    return Wrench(out[..., :3], out[..., 3:6], out[..., 6], out[..., 7])


def _wrench_at(
    medium: Spatial, mesh: Mesh, ground: Ground, rotation, place, velocity, spin
) -> np.ndarray:
    """Return force, moment, power and area (8,) in one motion."""
    # Vectors are along the axes of the mesh: fewer numbers are rotated than the mesh has.
    up, height = rotation[2], place[2]
    velocity, spin = velocity @ rotation, spin @ rotation
    heights = mesh.vertices @ up + height
    under = (heights < 0)[mesh.faces].T
    any_under, all_under = (
        under[0] | under[1] | under[2],
        under[0] & under[1] & under[2],
    )
    # (v + w x middle) . n = v . n + w . (middle x n), for all triangles at once
    leads = mesh.middle_normals @ velocity + mesh.normal_moments @ spin >= 0
    parts = (
        _full_triangles(mesh, np.flatnonzero(all_under & leads), up, height),
        _cut_triangles(mesh, np.flatnonzero(any_under & ~all_under), heights),
    )
    part = Part(*(np.concatenate(x, -1) for x in zip(*parts)))
    motion = Motion(velocity, spin, place[0], up, rotation[0])
    force, moment, stress = load(
        medium, ground, part, motion, velocity_of_middle(part, motion), False
    )
    force, moment = np.sum(force, -1), np.sum(moment, -1)
    power = force @ velocity + moment @ spin
    return np.array(
        [
            *rotation @ force,
            *rotation @ moment,
            power,
            part.area[np.any(stress, 0)].sum(),
        ]
    )


def _full_triangles(
    mesh: Mesh, index: np.ndarray, up: np.ndarray, height: float
) -> Part:
    """Return the parts of triangles that are entirely below the surface; a corner x is at z = height + up . x."""
    middle, area = mesh.middles[index].T, mesh.areas[index]
    # the integral of |z| x from that of x x^T
    arms = -(mesh.second_moments[index] @ up).T - height * area * middle
    return Part(
        mesh.middle_normals[index].T, middle, area, -(up @ middle + height) * area, arms
    )


def _cut_triangles(mesh: Mesh, index: np.ndarray, heights: np.ndarray) -> Part:
    """Return the parts of triangles that cross the surface, at heights (V,) of the vertices."""
    share, middle, moments = submerged(heights[mesh.faces[index]].T)
    corners, area = mesh.vertices[mesh.faces[index]], mesh.areas[index]
    middle, arms = (np.einsum("ct,tcj->jt", x, corners) for x in (middle, moments))
    return Part(
        mesh.middle_normals[index].T,
        middle,
        area * share,
        area * moments.sum(0),
        area * arms,
    )


def bearing(
    medium: Spatial,
    mesh: Mesh,
    rotation,
    place,
    velocity,
    spin,
    effects: Sequence[GroundEffect] = (),
) -> Faces:
    """Return the parts of faces below the surface at one pose, and the force on each; arguments as of `wrench`.

    Examples
    --------
    >>> import numpy as np
    >>> from rft.terradynamics.meshes import Spatial, Sphere, bearing
    >>> ball, sand = Sphere(radius=0.02).mesh(320), Spatial(xi_n=1e5)
    >>> faces = bearing(sand, ball, np.eye(3), place=[0, 0, 0], velocity=[0, 0, -0.01], spin=[0, 0, 0])
    >>> round(float(faces.force[:, 2].sum()), 2)  # N, upwards, on the half below the surface
    1.56
    """
    rotation, place, velocity, spin = (
        unmasked("rotation, place, velocity and spin", x)
        for x in (rotation, place, velocity, spin)
    )
    world = mesh.vertices @ rotation.T + place
    parts, triangle = below(world[mesh.faces], world[mesh.faces, 2])
    middle, area = (
        parts.mean(1),
        np.linalg.norm(
            np.cross(parts[:, 1] - parts[:, 0], parts[:, 2] - parts[:, 0]), axis=-1
        )
        / 2,
    )
    depth, arm = -middle[:, 2] * area, (middle - place).T
    part = Part(
        (mesh.middle_normals[triangle] @ rotation.T).T, arm, area, depth, depth * arm
    )
    ground = ground_of(effects, Ground(grazing_sine=medium.grazing_sine))
    motion = Motion(velocity, spin, place[0])
    force = load(medium, ground, part, motion, velocity_of_middle(part, motion), False)[
        0
    ]
    return Faces(parts, middle, np.stack(force, -1), triangle)
