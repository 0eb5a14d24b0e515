"""Round solids of few triangles that bear nearly what the solids bear: ellipsoid,
capsule, cylinder.

The normal of a triangle is that of the surface above its middle, because the stress
depends on the direction of motion to the surface, not to a chord of it. The corners lie
off the surface, by the same factor of their distance to the axis or to the middle, so
that the triangles enclose the solid's volume: where the stress per depth is the same
all over, the force is the volume's (the integral of |z| n dA). Of 200 random poses and
motions of solids with aspect ratios of 1 to 20, 90 % have an error of the force below 3
%, and none has one above 6 %."""

from __future__ import annotations

import numpy as np

from rft.terradynamics.meshes.surfaces import shapes
from rft.terradynamics.meshes.surfaces.mesh import Mesh


def ellipsoid(radii, fineness: int = 2) -> Mesh:
    """Return an ellipsoid about the origin with three radii, m, made of 20 4^fineness
    triangles."""
    radii = np.broadcast_to(np.asarray(radii, float), 3)
    ball = shapes.sphere(1.0, fineness)
    factor = (4 / 3 * np.pi / ball.volume) ** (1 / 3)
    vertices = factor * radii * ball.vertices
    outward = vertices[ball.faces].mean(1) / radii**2
    return _with_normals(vertices, ball.faces, outward)


def cylinder(radius: float, half: float, around: int, along: int, across: int) -> Mesh:
    """Return a cylinder along z, from -half to half, m, about the origin.

    around, along, across: numbers of quadrilaterals, the last from the rim to the
    middle of an end."""
    rod = shapes.cylinder(radius, 2 * half, around, along, across)
    area = around / 2 * np.sin(2 * np.pi / around)  # of a polygon in the unit circle
    factor = np.sqrt(np.pi / area)
    x, y, z = rod.vertices.T
    vertices = np.stack([factor * x, -factor * z, y], -1)
    flat = Mesh(vertices, rod.faces)
    is_end = np.abs(flat.normals[:, 2]) > 0.5
    outward = np.where(is_end[:, None], flat.normals, flat.middles * [1.0, 1.0, 0.0])
    return _with_normals(vertices, rod.faces, outward)


def capsule(radius: float, half: float, quarter: int, along: int) -> Mesh:
    """Return a rod along z from -half to half, m, with a half sphere at either end.

    quarter: edges of triangles from a pole to the rim, and along a quarter of the rim.
    along: pieces of the rod."""
    points, cap = _hemisphere(quarter)
    count = 4 * quarter
    rim = np.arange(len(points) - count, len(points))
    upper = radius * points + [0.0, 0.0, half]
    lower = radius * points * [1.0, 1.0, -1.0] - [0.0, 0.0, half]
    heights = np.linspace(half, -half, along + 1)[1:-1]
    between = [radius * points[rim] + [0.0, 0.0, z] for z in heights]
    vertices = np.concatenate([upper, lower, *between])

    first = 2 * len(points)
    rings = first + np.arange(count * (along - 1)).reshape(along - 1, count)
    rows = np.concatenate([[rim], rings, [rim + len(points)]])
    side = shapes.triangles(rows)[:, ::-1]
    faces = np.concatenate([cap, cap[:, ::-1] + len(points), side])

    axis = np.zeros_like(vertices)
    axis[:, 2] = np.clip(vertices[:, 2], -half, half)
    factor = _factor_of_capsule(vertices, axis, faces, radius, half)
    vertices = axis + factor * (vertices - axis)
    outward = vertices[faces].mean(1)
    outward[:, 2] -= np.clip(outward[:, 2], -half, half)
    return _with_normals(vertices, faces, outward)


def _factor_of_capsule(vertices, axis, faces, radius: float, half: float) -> float:
    """Return the factor of the vertices' distances to the axis with which the triangles
    enclose a capsule's volume. axis: (V, 3), point of the axis next to each vertex."""
    volume = np.pi * radius**2 * (4 / 3 * radius + 2 * half)

    def enclosed(factor):
        a, b, c = (axis + factor * (vertices - axis))[faces].swapaxes(0, 1)
        return (a * np.cross(b, c)).sum() / 6

    factor = 1.0
    for _ in range(3):  # a cubic in the factor, near 1: Newton's method by differences
        slope = (enclosed(factor + 1e-4) - enclosed(factor - 1e-4)) / 2e-4
        factor += (volume - enclosed(factor)) / slope
    return factor


def _hemisphere(quarter: int) -> tuple[np.ndarray, np.ndarray]:
    """Return points (P, 3) of the unit hemisphere z >= 0, in rings of 4, 8, ... points
    from the pole down to the rim, and the triangles (T, 3) between them,
    counter-clockwise as seen from outside."""
    points = [[[0.0, 0.0, 1.0]]]
    faces = []
    for ring in range(1, quarter + 1):
        polar = np.pi / 2 * ring / quarter
        turn = np.pi / 2 * np.arange(4 * ring) / ring
        x = np.sin(polar) * np.cos(turn)
        y = np.sin(polar) * np.sin(turn)
        points.append(np.stack([x, y, np.full_like(x, np.cos(polar))], -1))
        faces += _faces_of_ring(ring)
    return np.concatenate(points), np.array(faces)


def _faces_of_ring(ring: int) -> list[list[int]]:
    """Return the triangles between a ring of `_hemisphere` and the one above it."""
    inner = _first_of_ring(ring - 1)
    outer = _first_of_ring(ring)
    n_inner = max(1, 4 * (ring - 1))
    n_outer = 4 * ring
    faces = []
    for quadrant in range(4):
        for j in range(ring):
            on_inner = quadrant * (ring - 1) + j
            on_outer = quadrant * ring + j
            a = inner + on_inner % n_inner
            b = outer + on_outer % n_outer
            c = outer + (on_outer + 1) % n_outer
            faces.append([a, b, c])
            if j < ring - 1:
                faces.append([a, c, inner + (on_inner + 1) % n_inner])
    return faces


def _first_of_ring(ring: int) -> int:
    """Return the index of the first point of a ring of `_hemisphere`; ring 0 is the
    pole."""
    if ring == 0:
        return 0
    return 1 + 2 * ring * (ring - 1)


def _with_normals(vertices, faces, outward) -> Mesh:
    """Return the mesh whose triangles have normals along the vectors outward (F, 3)."""
    normals = outward / np.linalg.norm(outward, axis=1, keepdims=True)
    return Mesh(vertices, faces, True, np.repeat(normals[:, None], 3, axis=1))
