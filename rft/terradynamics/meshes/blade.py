"""A screw whose thread is a blade of constant thickness along the axis, as on augers and on craft that screws drive.

The section across the axis is a disc with a sector: the core, and the blade from -a to a about the thread's angle, with
a = pi thickness / pitch; the sides of the blade are helicoids. The section's area is the same everywhere, so that

    volume = length (pi core^2 + (thickness / pitch) pi (radius^2 - core^2)) + (2 / 3) pi core^2 nose.

Normals are those of these exact surfaces at the middles of triangles. With them a core that rotates slides along itself, and
so does a thread that advances as in a nut; with the normals of flat triangles they would not.
"""

from __future__ import annotations

import numpy as np

from rft.terradynamics.meshes.mesh import Mesh
from rft.terradynamics.meshes.shapes import triangles

AXIS = np.array([1.0, 0.0, 0.0])


def blade(
    radius: float, core: float, pitch: float, length: float, thickness: float, nose: float = 0.0,
    around: int = 32, along: int = 96, across: int = 6, high: int = 4, thick: int = 2,
) -> Mesh:  # fmt: skip
    """Return a right-handed screw along x, centred at the origin, with cones of length ``nose`` at both ends of the core.

    Lengths are in m. The other arguments are numbers of quadrilaterals: around the core between the blade's sides, along x,
    across an end from rim to middle, up the blade, and through its thickness."""
    half = np.pi * thickness / pitch
    foot = np.linspace(-half, half, thick + 1)
    free = np.linspace(half, 2 * np.pi - half, around + 1)[1:-1]
    x = length * np.linspace(-0.5, 0.5, along + 1)
    turn = (2 * np.pi / pitch) * x[:, None]
    discs = _ring(
        x[:, None], core, turn + np.concatenate([foot, free])
    )  # (along + 1, thick + around, 3)
    levels = np.linspace(core, radius, high + 1)[1:, None]
    fins = _ring(
        x[:, None, None], levels, turn[:, None] + foot
    )  # (along + 1, high, thick + 1, 3)
    tips = AXIS * (x[[0, -1], None] + [[-nose], [nose]])
    shares = np.linspace(0.0, 1.0, across + 1)[1:-1, None, None]
    cones = [tip + shares * (disc - tip) for tip, disc in zip(tips, discs[[0, -1]])]

    # Indices of the points, in arrays of the shapes of the points.
    parts = [discs, fins, *cones, tips]
    starts = np.cumsum([0, *(p.size // 3 for p in parts)])
    indices = [
        s + np.arange(p.size // 3).reshape(p.shape[:-1]) for s, p in zip(starts, parts)
    ]
    disc, fin, near, far, ends = indices
    near, far = np.concatenate([near, disc[:1]]), np.concatenate([far, disc[-1:]])
    sides = np.concatenate(
        [disc[:, None, : thick + 1], fin], 1
    )  # with the foot on the core
    core_rows = np.concatenate([disc[:, thick:], disc[:, :1]], 1)
    points = np.concatenate([p.reshape(-1, 3) for p in parts])
    strips = [
        (_along_short_diagonals(core_rows), _radial),
        (_along_short_diagonals(sides[:, -1]), _radial),
        (triangles(sides[:, :, 0], closed=False), lambda p: -_helicoid(p, pitch)),
        (triangles(sides[:, ::-1, -1], closed=False), lambda p: _helicoid(p, pitch)),
        (triangles(sides[0], closed=False), lambda p: _flat(p, -1.0)),
        (triangles(sides[-1, ::-1], closed=False), lambda p: _flat(p, 1.0)),
        (_cap(ends[0], near), lambda p: _conical(p, core, nose, -1.0)),
        (_cap(ends[1], far)[:, ::-1], lambda p: _conical(p, core, nose, 1.0)),
    ]  # fmt: skip
    normals = np.concatenate(
        [normal(points[faces].mean(1)) for faces, normal in strips]
    )
    used, faces = np.unique(
        np.concatenate([faces for faces, _ in strips]), return_inverse=True
    )
    return Mesh(
        points[used],
        faces.reshape(-1, 3),
        smooth_normals=np.repeat(normals[:, None], 3, 1),
    )


def _ring(x, r, angle) -> np.ndarray:
    """Return points (..., 3) in cylindrical coordinates about the x axis."""
    return np.stack(np.broadcast_arrays(x, r * np.cos(angle), r * np.sin(angle)), -1)


def _along_short_diagonals(rows: np.ndarray) -> np.ndarray:
    """Return the triangles (F, 3) between rows that are rotated from one to the next, cut along the shorter diagonals."""
    return triangles(rows[:, ::-1], closed=False)[:, ::-1]


def _cap(point: int, rings: np.ndarray) -> np.ndarray:
    """Return the triangles (F, 3) from a point to the first of rings (M, K), and from each ring to the next."""
    fan = np.stack(
        [np.full(rings.shape[1], point), np.roll(rings[0], -1), rings[0]], -1
    )
    return np.concatenate([fan, triangles(rings)])


def _unit(vectors: np.ndarray) -> np.ndarray:
    """Return unit vectors (..., 3)."""
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def _radial(points: np.ndarray) -> np.ndarray:
    """Return unit vectors away from the x axis."""
    return _unit(points * [0.0, 1.0, 1.0])


def _helicoid(points: np.ndarray, pitch: float) -> np.ndarray:
    """Return the outward normals of the side of the blade at the larger angle."""
    _, y, z = np.moveaxis(points, -1, 0)
    r = np.hypot(y, z)
    return _unit(np.stack([-2 * np.pi * r**2 / pitch, -z, y], -1))


def _flat(points: np.ndarray, sign: float) -> np.ndarray:
    """Return the normals of an end of the blade: +x or -x."""
    return np.broadcast_to(sign * AXIS, points.shape)


def _conical(points: np.ndarray, core: float, nose: float, sign: float) -> np.ndarray:
    """Return the outward normals of the cone at the end towards +x or -x."""
    return _unit(nose * _radial(points) + sign * core * AXIS)
