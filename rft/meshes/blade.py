"""A screw whose thread is a blade of constant thickness along the axis, as on augers and on craft that screws drive.

Its section across the axis is a disc with a sector: the core, and the blade from -a to a about the thread's angle, with
a = pi thickness / pitch; the sides of the blade are helicoids. The section's area is the same everywhere, so that

    volume = length (pi core^2 + (thickness / pitch) pi (radius^2 - core^2)) + (2 / 3) pi core^2 nose.

Normals are those of these surfaces, at the middles of triangles: a core that turns slides along itself, and a thread that
advances as in a nut, and they would not by normals of triangles.
"""

from __future__ import annotations

import numpy as np

from rft.meshes.mesh import Mesh
from rft.meshes.shapes import between

AXIS = np.array([1.0, 0.0, 0.0])


def blade(
    radius: float, core: float, pitch: float, length: float, thickness: float, nose: float = 0.0,
    around: int = 32, along: int = 96, across: int = 6, high: int = 4, thick: int = 2,
) -> Mesh:  # fmt: skip
    """Right-handed and along x, about the origin; with cones as long as ``nose`` beyond either end of the core. So many
    quadrilaterals around the core between the blade's sides, along x, from rim to middle of the ends, up the blade and
    through it."""
    half = np.pi * thickness / pitch
    foot = np.linspace(-half, half, thick + 1)
    free = np.linspace(half, 2 * np.pi - half, around + 1)[1:-1]
    x = length * np.linspace(-0.5, 0.5, along + 1)
    turn = (2 * np.pi / pitch) * x[:, None]
    discs = _ring(x[:, None], core, turn + np.concatenate([foot, free]))  # (along + 1, thick + around, 3)
    levels = np.linspace(core, radius, high + 1)[1:, None]
    fins = _ring(x[:, None, None], levels, turn[:, None] + foot)  # (along + 1, high, thick + 1, 3)
    tips = AXIS * (x[[0, -1], None] + [[-nose], [nose]])
    shares = np.linspace(0.0, 1.0, across + 1)[1:-1, None, None]
    cones = [tip + shares * (disc - tip) for tip, disc in zip(tips, discs[[0, -1]])]

    parts = [discs, fins, *cones, tips]
    starts = np.cumsum([0, *(p.size // 3 for p in parts)])
    discs_, fins_, near, far, ends = (s + np.arange(p.size // 3).reshape(p.shape[:-1]) for s, p in zip(starts, parts))
    near, far = np.concatenate([near, discs_[:1]]), np.concatenate([far, discs_[-1:]])
    sides = np.concatenate([discs_[:, None, : thick + 1], fins_], 1)  # with the foot on the core
    bare = np.concatenate([discs_[:, thick:], discs_[:, :1]], 1)
    points = np.concatenate([p.reshape(-1, 3) for p in parts])
    strips = [
        (_short(bare), _radial),
        (_short(sides[:, -1]), _radial),
        (between(sides[:, :, 0], closed=False), lambda p: -_helicoid(p, pitch)),
        (between(sides[:, ::-1, -1], closed=False), lambda p: _helicoid(p, pitch)),
        (between(sides[0], closed=False), lambda p: _flat(p, -1.0)),
        (between(sides[-1, ::-1], closed=False), lambda p: _flat(p, 1.0)),
        (_cap(ends[0], near), lambda p: _conical(p, core, nose, -1.0)),
        (_cap(ends[1], far)[:, ::-1], lambda p: _conical(p, core, nose, 1.0)),
    ]  # fmt: skip
    normals = np.concatenate([normal(points[faces].mean(1)) for faces, normal in strips])
    bends = np.repeat(normals[:, None], 3, 1)  # those of the middles, one for all corners
    used, faces = np.unique(np.concatenate([faces for faces, _ in strips]), return_inverse=True)
    return Mesh(points[used], faces.reshape(-1, 3), bends=bends)


def _ring(x, r, angle) -> np.ndarray:
    return np.stack(np.broadcast_arrays(x, r * np.cos(angle), r * np.sin(angle)), -1)


def _short(rows: np.ndarray) -> np.ndarray:
    """Triangles between rows of which each is turned on from the last: cut along the shorter diagonals."""
    return between(rows[:, ::-1], closed=False)[:, ::-1]


def _cap(point: int, rings: np.ndarray) -> np.ndarray:
    """From a point to the first of rings, and from each of these to the next."""
    fan = np.stack([np.full(rings.shape[1], point), np.roll(rings[0], -1), rings[0]], -1)
    return np.concatenate([fan, between(rings)])


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def _radial(points: np.ndarray) -> np.ndarray:
    return _unit(points * [0.0, 1.0, 1.0])


def _helicoid(points: np.ndarray, pitch: float) -> np.ndarray:
    """Out of the side of the blade that looks on along the turn."""
    _, y, z = np.moveaxis(points, -1, 0)
    r = np.hypot(y, z)
    return _unit(np.stack([-2 * np.pi * r**2 / pitch, -z, y], -1))


def _flat(points: np.ndarray, way: float) -> np.ndarray:
    return np.broadcast_to(way * AXIS, points.shape)


def _conical(points: np.ndarray, core: float, nose: float, way: float) -> np.ndarray:
    return _unit(nose * _radial(points) + way * core * AXIS)
