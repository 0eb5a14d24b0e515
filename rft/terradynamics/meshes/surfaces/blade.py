"""A screw whose thread is a blade of constant thickness along the axis, as on augers
and on craft that screws drive.

The section across the axis is a disc and a sector: the core, and the blade from -a to a
about the thread's angle, with a = pi thickness / pitch. The sides of the blade are
helicoids. The area of the section is the same everywhere, so that

    volume = length (pi core^2 + (thickness / pitch) pi (radius^2 - core^2))
             + (2 / 3) pi core^2 nose.

Normals are those of these exact surfaces at the middles of triangles. With them a core
that rotates slides along itself, and so does a thread that advances as in a nut. With
the normals of flat triangles they would not.
"""

from __future__ import annotations

import numpy as np

from rft.terradynamics.meshes.surfaces.mesh import Mesh
from rft.terradynamics.meshes.surfaces.shapes import triangles

AXIS = np.array([1.0, 0.0, 0.0])


def blade(
    radius: float,
    core: float,
    pitch: float,
    length: float,
    thickness: float,
    nose: float = 0.0,
    around: int = 32,
    along: int = 96,
    across: int = 6,
    high: int = 4,
    thick: int = 2,
) -> Mesh:
    """Return a right-handed screw along x, centred at the origin, with cones of length
    ``nose`` at both ends of the core.

    Lengths are in m. The other arguments are numbers of quadrilaterals: around the core
    between the blade's sides, along x, across an end from rim to middle, up the blade,
    and through its thickness."""
    half = np.pi * thickness / pitch
    foot = np.linspace(-half, half, thick + 1)
    free = np.linspace(half, 2 * np.pi - half, around + 1)[1:-1]
    x = length * np.linspace(-0.5, 0.5, along + 1)
    turn = (2 * np.pi / pitch) * x[:, None]

    # Points: rings around the core, the blade above its foot, rings of the two cones
    # from tip to core, and the tips.
    discs = _ring(x[:, None], core, turn + np.concatenate([foot, free]))
    levels = np.linspace(core, radius, high + 1)[1:, None]
    fins = _ring(x[:, None, None], levels, turn[:, None] + foot)
    tips = AXIS * (x[[0, -1], None] + [[-nose], [nose]])
    shares = np.linspace(0.0, 1.0, across + 1)[1:-1, None, None]
    first_cone = tips[0] + shares * (discs[0] - tips[0])
    last_cone = tips[1] + shares * (discs[-1] - tips[1])
    parts = [discs, fins, first_cone, last_cone, tips]
    points = np.concatenate([part.reshape(-1, 3) for part in parts])

    # Rows of points, as indices: blade (along + 1, high + 1, thick + 1) from the foot
    # on the core outwards, bare core (along + 1, around + 1), rings from tip to core.
    disc, fin, first_rings, last_rings, ends = _indices(parts)
    blade_rows = np.concatenate([disc[:, None, : thick + 1], fin], 1)
    core_rows = np.concatenate([disc[:, thick:], disc[:, :1]], 1)
    first_rings = np.concatenate([first_rings, disc[:1]])
    last_rings = np.concatenate([last_rings, disc[-1:]])

    def middles(faces: np.ndarray) -> np.ndarray:
        return points[faces].mean(1)

    bare_core = _along_short_diagonals(core_rows)
    top = _along_short_diagonals(blade_rows[:, -1])
    lower_side = triangles(blade_rows[:, :, 0], closed=False)
    upper_side = triangles(blade_rows[:, ::-1, -1], closed=False)
    first_end = triangles(blade_rows[0], closed=False)
    last_end = triangles(blade_rows[-1, ::-1], closed=False)
    first_nose = _cap(ends[0], first_rings)
    last_nose = _cap(ends[1], last_rings)[:, ::-1]
    faces_and_normals = [
        (bare_core, _radial(middles(bare_core))),
        (top, _radial(middles(top))),
        (lower_side, -_helicoid(middles(lower_side), pitch)),
        (upper_side, _helicoid(middles(upper_side), pitch)),
        (first_end, np.broadcast_to(-AXIS, first_end.shape)),
        (last_end, np.broadcast_to(AXIS, last_end.shape)),
        (first_nose, _conical(middles(first_nose), core, nose, -1.0)),
        (last_nose, _conical(middles(last_nose), core, nose, 1.0)),
    ]
    faces = np.concatenate([faces for faces, _ in faces_and_normals])
    normals = np.concatenate([normals for _, normals in faces_and_normals])
    used, faces = np.unique(faces, return_inverse=True)
    corner_normals = np.repeat(normals[:, None], 3, 1)
    return Mesh(points[used], faces.reshape(-1, 3), smooth_normals=corner_normals)


def _indices(parts: list[np.ndarray]) -> list[np.ndarray]:
    """Return the indices of points (..., 3) in arrays (...,), counted through all
    parts."""
    indices = []
    first = 0
    for points in parts:
        count = points.size // 3
        indices.append(first + np.arange(count).reshape(points.shape[:-1]))
        first += count
    return indices


def _ring(x, r, angle) -> np.ndarray:
    """Return points (..., 3) in cylindrical coordinates about the x axis."""
    return np.stack(np.broadcast_arrays(x, r * np.cos(angle), r * np.sin(angle)), -1)


def _along_short_diagonals(rows: np.ndarray) -> np.ndarray:
    """Return the triangles (F, 3) between rows of which each is rotated against the one
    before; quadrilaterals are cut along the shorter diagonals."""
    return triangles(rows[:, ::-1], closed=False)[:, ::-1]


def _cap(point: int, rings: np.ndarray) -> np.ndarray:
    """Return the triangles (F, 3) from a point to the first of rings (M, K), and from
    each ring to the next."""
    tip = np.full(rings.shape[1], point)
    fan = np.stack([tip, np.roll(rings[0], -1), rings[0]], -1)
    return np.concatenate([fan, triangles(rings)])


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def _radial(points: np.ndarray) -> np.ndarray:
    """Return unit vectors away from the x axis."""
    return _unit(points * [0.0, 1.0, 1.0])


def _helicoid(points: np.ndarray, pitch: float) -> np.ndarray:
    """Return the outward normals of the side of the blade at the larger angle, at
    points (N, 3) on it."""
    _, y, z = np.moveaxis(points, -1, 0)
    r = np.hypot(y, z)
    return _unit(np.stack([-2 * np.pi * r**2 / pitch, -z, y], -1))


def _conical(points: np.ndarray, core: float, nose: float, sign: float) -> np.ndarray:
    """Return the outward normals of the cone at the end towards +x or -x."""
    return _unit(nose * _radial(points) + sign * core * AXIS)
