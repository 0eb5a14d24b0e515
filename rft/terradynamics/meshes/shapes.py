"""Closed meshes of bodies with a few sizes, m: sphere, cylinder, screw, capsule, box, leg. The origin is the middle, or the
hip of a leg."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rft.core.checks import in_range
from rft.core.refusal import require
from rft.terradynamics.meshes.mesh import Mesh, subdivided


def sphere(radius: float, fineness: int = 4) -> Mesh:
    """Return a sphere of 20 4^fineness triangles of nearly equal size: an icosahedron cut ``fineness`` (0 to 7) times, with
    all corners on the sphere."""
    _check_sizes(radius=radius)
    in_range("fineness", fineness, 0, 7, whole=True)
    g = (1 + 5**0.5) / 2
    vertices = np.array([
        (-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g), (0, -1, -g), (0, 1, -g),
        (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1),
    ])  # fmt: skip
    faces = np.array([
        (0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6),
        (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7),
        (9, 8, 1),
    ])  # fmt: skip
    for _ in range(int(fineness)):
        vertices, faces = _quartered(vertices, faces)
    return Mesh(
        radius * vertices / np.linalg.norm(vertices, axis=-1, keepdims=True), faces
    )


def _quartered(
    vertices: np.ndarray, faces: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices and faces with every triangle cut in four at the middles of its edges, all on one sphere."""
    size = np.linalg.norm(vertices[0])
    vertices, faces = subdivided(vertices, faces)
    return vertices * (size / np.linalg.norm(vertices, axis=-1, keepdims=True)), faces


def cylinder(
    radius: float, length: float, around: int = 64, along: int = 32, across: int = 8
) -> Mesh:
    """Return a cylinder along y. around, along, across: numbers of quadrilaterals, the last from rim to middle of an end."""
    _check_sizes(radius=radius, length=length)
    turn = 2 * np.pi * np.arange(_count("around", around, 3)) / around
    circle = np.stack([np.cos(turn), 0 * turn, -np.sin(turn)], -1)
    y = length * np.linspace(-0.5, 0.5, _count("along", along, 1) + 1)
    return _tube(
        np.array([radius * circle + [0, place, 0] for place in y]),
        _count("across", across, 1),
    )


def screw(
    radius: float, core: float, pitch: float, length: float, around: int = 64, along: int = 128, across: int = 6,
    nose: float = 0.0,
) -> Mesh:  # fmt: skip
    """Return a right-handed Archimedean screw along x: a core with one thread of a smooth profile, ``radius`` - ``core``
    high and ``pitch`` from turn to turn, and cones of length ``nose`` at its ends."""
    _check_sizes(radius=radius, core=core, pitch=pitch, length=length)
    require(
        core < radius, f"core must be less than the radius, got {core:g} and {radius:g}"
    )
    turn = 2 * np.pi * np.arange(_count("around", around, 3)) / around
    rings = []
    for x in length * np.linspace(-0.5, 0.5, _count("along", along, 1) + 1):
        height = np.exp(
            6.0 * (np.cos(turn - 2 * np.pi * x / pitch) - 1.0)
        )  # profile; the sharpness 6 is assumed
        r = core + (radius - core) * height
        rings.append(
            np.stack([np.full_like(turn, x), r * np.cos(turn), r * np.sin(turn)], -1)
        )
    return _tube(np.array(rings), _count("across", across, 1), nose)


def capsule(radius: float, half: float, around: int = 24, along: int = 4) -> Mesh:
    """Return a rod along z of length 2 ``half`` with a half sphere at either end. around, along: numbers of quadrilaterals.
    Its poles are cut off flat within a quarter of a triangle's angle of the axis."""
    _check_sizes(radius=radius, half=half)
    turn = 2 * np.pi * np.arange(_count("around", around, 4)) / around
    polar = np.linspace(0.25, around / 4, max(2, around // 4)) * 2 * np.pi / around
    z = [
        -half - radius * np.cos(polar),
        np.linspace(-half, half, _count("along", along, 1) + 1)[1:-1],
    ]
    z = np.concatenate([*z, -z[0][::-1]])
    r = np.concatenate(
        [
            radius * np.sin(polar),
            np.full(along - 1, radius),
            radius * np.sin(polar)[::-1],
        ]
    )
    return _tube(
        np.stack(
            [
                np.outer(r, np.cos(turn)),
                np.outer(r, np.sin(turn)),
                z[:, None] + 0 * turn,
            ],
            -1,
        ),
        1,
    )


def box(sides, m: int | Sequence[int] = 1) -> Mesh:
    """Return a box along the axes, about the origin, with each edge along an axis cut into m pieces, or into the number of
    pieces given for that axis."""
    half, points, faces, n = np.asarray(sides, float) / 2, [], [], 0
    pieces = [_count("m", one, 1) for one in np.broadcast_to(m, 3)]
    for axis in range(3):
        along, across = (pieces[(axis + k) % 3] for k in (1, 2))
        for out in (-1.0, 1.0):
            lines = (np.arange(-one, one + 1, 2) / one for one in (along, across))
            u, v = np.meshgrid(
                *(side * line for side, line in zip((1.0, out), lines)), indexing="ij"
            )
            index = n + np.arange(u.size).reshape(u.shape)
            n += u.size
            a, b, c, d = (
                x.ravel()
                for x in (
                    index[:-1, :-1],
                    index[1:, :-1],
                    index[1:, 1:],
                    index[:-1, 1:],
                )
            )
            points.append(
                np.roll(np.stack([out + 0 * u, u, v], -1).reshape(-1, 3), axis, 1)
                * half
            )
            faces += [np.stack([a, b, c], -1), np.stack([a, c, d], -1)]
    vertices, index = np.unique(np.concatenate(points), axis=0, return_inverse=True)
    return Mesh(vertices, index.reshape(-1)[np.concatenate(faces)])


def leg(
    reach: float,
    curvature: float,
    thickness: float,
    width: float,
    along: int = 64,
    across: int = 8,
    thick: int = 2,
) -> Mesh:
    """Return a strip that hangs from the hip, at the origin, to (0, 0, -2 reach), bent to an arc of radius reach / curvature.

    curvature: -1 (a half circle that opens forwards) to 1 (backwards, the c-leg of the paper's Fig. 8(b)), 0 for a flat leg.
    along, across, thick: numbers of quadrilaterals along the strip, across its width and through its thickness."""
    _check_sizes(reach=reach, thickness=thickness, width=width)
    in_range("curvature", curvature, -1, 1)
    require(
        thickness < reach,
        f"thickness must be less than the reach, got {thickness:g} and {reach:g}",
    )
    s = np.linspace(-1.0, 1.0, _count("along", along, 2) + 1)
    half = np.arcsin(abs(curvature))
    bend = (
        np.sign(curvature) * half * s
    )  # angle of the strip's direction from straight down
    if half:
        r = reach / np.sin(half)
        x, z = (
            np.sign(curvature) * r * (np.cos(half * s) - np.cos(half)),
            -reach - r * np.sin(half * s),
        )
    else:
        x, z = 0 * s, -reach - reach * s
    normal = np.stack(
        [np.cos(bend), 0 * s, -np.sin(bend)], -1
    )  # through the strip, forwards
    corners = _rectangle(
        thickness, width, _count("thick", thick, 1), _count("across", across, 1)
    )
    rings = (
        np.stack([x, 0 * s, z], -1)[:, None]
        + corners[None, :, :1] * normal[:, None]
        + corners[:, 1:] * [0.0, 1.0, 0.0]
    )
    return _tube(rings, max(1, round(across / 2)))


def _rectangle(a: float, b: float, m: int, n: int) -> np.ndarray:
    """Return points (2 m + 2 n, 2) around a rectangle a x b, counter-clockwise."""
    u, v = np.linspace(-0.5, 0.5, m + 1)[:-1], np.linspace(-0.5, 0.5, n + 1)[:-1]
    low, high = np.full(m, 0.5), np.full(n, 0.5)
    sides = [(u, -low), (high, v), (-u, low), (-high, -v)]
    return np.concatenate([np.stack(side, -1) for side in sides]) * [a, b]


def _tube(rings: np.ndarray, across: int, nose: float = 0.0) -> Mesh:
    """Return a closed mesh through rings (M, K, 3) of points. Each end has ``across`` - 1 smaller rings and a point in the
    middle, ``nose`` further out along x."""
    share = np.linspace(0.0, 1.0, across + 1)[1:-1][:, None, None]
    first, last = rings[0], rings[-1]
    near, far = first.mean(0) - [nose, 0.0, 0.0], last.mean(0) + [nose, 0.0, 0.0]
    rings = np.concatenate(
        [near + share * (first - near), rings, far + share[::-1] * (last - far)]
    )
    m, k, _ = rings.shape
    i = np.arange(m * k).reshape(m, k)
    tip, end, ahead = m * k, m * k + 1, np.roll(np.arange(k), -1)
    faces = [
        triangles(i),
        np.stack([np.full(k, tip), ahead, np.arange(k)], -1),
        np.stack([np.full(k, end), i[-1], i[-1][ahead]], -1),
    ]  # fmt: skip
    return outward(
        np.concatenate([rings.reshape(-1, 3), [near, far]]), np.concatenate(faces)
    )


def triangles(rows: np.ndarray, closed: bool = True) -> np.ndarray:
    """Return two triangles (F, 3) for each quadrilateral between neighbouring rows of vertices (M, K). closed: whether the
    last vertex of a row is a neighbour of its first."""
    ahead = np.roll(rows, -1, 1) if closed else rows[:, 1:]
    rows = rows if closed else rows[:, :-1]
    a, b, c, d = (x.ravel() for x in (rows[:-1], ahead[:-1], ahead[1:], rows[1:]))
    return np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)])


def outward(vertices: np.ndarray, faces: np.ndarray) -> Mesh:
    """Return the closed mesh of triangles that agree on which side is out, reversed if that is the inside."""
    corner = vertices[faces]
    inside_out = (corner[:, 0] * np.cross(corner[:, 1], corner[:, 2])).sum() < 0
    return Mesh(vertices, faces[:, ::-1] if inside_out else faces)


def _check_sizes(**sizes: float) -> None:
    """Raise ValueError for lengths out of range, m."""
    for name, value in sizes.items():
        in_range(name, value, 1e-6, 1e3)


def _count(name: str, value: int, low: int) -> int:
    """Return a number of quadrilaterals; ValueError if it is out of range."""
    in_range(name, value, low, 4096, whole=True)
    return int(value)
