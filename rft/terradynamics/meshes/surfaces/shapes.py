"""Closed meshes of bodies with a few sizes, m: sphere, cylinder, screw, box, leg.
The origin is at the middle, or at the hip of a leg."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rft.core.checks import in_range
from rft.core.refusal import require
from rft.terradynamics.meshes.surfaces.mesh import Mesh, cut_in_four


def sphere(radius: float, fineness: int = 4) -> Mesh:
    """Return a sphere of 20 4^fineness triangles of nearly equal size: an icosahedron
    whose triangles are cut in four ``fineness`` (0 to 7) times, with all corners on the
    sphere."""
    _check_sizes(radius=radius)
    in_range("fineness", fineness, 0, 7, whole=True)
    vertices, faces = _icosahedron()
    for _ in range(int(fineness)):
        vertices, faces = _quarter_on_sphere(vertices, faces)
    size = np.linalg.norm(vertices, axis=-1, keepdims=True)
    return Mesh(radius * vertices / size, faces)


def _icosahedron() -> tuple[np.ndarray, np.ndarray]:
    """Return the vertices (12, 3) and faces (20, 3) of an icosahedron with edges 2."""
    g = (1 + 5**0.5) / 2
    vertices = np.array([
        (-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0),
        (0, -1, g), (0, 1, g), (0, -1, -g), (0, 1, -g),
        (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1),
    ])  # fmt: skip
    faces = np.array([
        (0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11),
        (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6), (7, 1, 8),
        (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9),
        (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1),
    ])  # fmt: skip
    return vertices, faces


def _quarter_on_sphere(
    vertices: np.ndarray, faces: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices and faces of a mesh with all corners on a sphere about the
    origin, with every triangle cut in four at the middles of its edges."""
    size = np.linalg.norm(vertices[0])
    vertices, faces = cut_in_four(vertices, faces)
    return vertices * (size / np.linalg.norm(vertices, axis=-1, keepdims=True)), faces


def cylinder(
    radius: float, length: float, around: int = 64, along: int = 32, across: int = 8
) -> Mesh:
    """Return a cylinder along y.

    around, along, across: numbers of quadrilaterals, the last from the rim to the
    middle of an end."""
    _check_sizes(radius=radius, length=length)
    turn = 2 * np.pi * np.arange(_checked_count("around", around, 3)) / around
    circle = np.stack([np.cos(turn), 0 * turn, -np.sin(turn)], -1)
    along = _checked_count("along", along, 1)
    across = _checked_count("across", across, 1)
    y = length * np.linspace(-0.5, 0.5, along + 1)
    rings = [radius * circle + [0.0, place, 0.0] for place in y]
    return _tube(np.array(rings), across)


def screw(
    radius: float,
    core: float,
    pitch: float,
    length: float,
    around: int = 64,
    along: int = 128,
    across: int = 6,
    nose: float = 0.0,
) -> Mesh:
    """Return a right-handed Archimedean screw along x: a core with one thread of a
    smooth profile, ``radius`` - ``core`` high and ``pitch`` from turn to turn, and
    cones of length ``nose`` at its ends.

    around, along, across: numbers of quadrilaterals, the last from the rim to the
    middle of an end."""
    _check_sizes(radius=radius, core=core, pitch=pitch, length=length)
    require(
        core < radius, f"core must be less than the radius, got {core:g} and {radius:g}"
    )
    turn = 2 * np.pi * np.arange(_checked_count("around", around, 3)) / around
    along = _checked_count("along", along, 1)
    across = _checked_count("across", across, 1)
    rings = []
    for x in length * np.linspace(-0.5, 0.5, along + 1):
        # The profile of the thread, 0 to 1; the sharpness 6 is assumed.
        profile = np.exp(6.0 * (np.cos(turn - 2 * np.pi * x / pitch) - 1.0))
        r = core + (radius - core) * profile
        ring = [np.full_like(turn, x), r * np.cos(turn), r * np.sin(turn)]
        rings.append(np.stack(ring, -1))
    return _tube(np.array(rings), across, nose)


def box(sides, m: int | Sequence[int] = 1) -> Mesh:
    """Return a box along the axes, about the origin, with each edge along an axis cut
    into m pieces, or into the number of pieces given for that axis."""
    half = np.asarray(sides, float) / 2
    pieces = [_checked_count("m", count, 1) for count in np.broadcast_to(m, 3)]
    points = []
    faces = []
    n_points = 0
    for axis in range(3):
        along = pieces[(axis + 1) % 3]
        across = pieces[(axis + 2) % 3]
        for out in (-1.0, 1.0):
            # A side of the cube from -1 to 1. On that towards -axis v runs backwards,
            # so that the corners of its triangles run the right way.
            u = np.arange(-along, along + 1, 2) / along
            v = out * (np.arange(-across, across + 1, 2) / across)
            u, v = np.meshgrid(u, v, indexing="ij")
            side = np.stack([out + 0 * u, u, v], -1).reshape(-1, 3)
            points.append(np.roll(side, axis, 1) * half)

            index = n_points + np.arange(u.size).reshape(u.shape)
            n_points += u.size
            a = index[:-1, :-1].ravel()
            b = index[1:, :-1].ravel()
            c = index[1:, 1:].ravel()
            d = index[:-1, 1:].ravel()
            faces += [np.stack([a, b, c], -1), np.stack([a, c, d], -1)]

    # Sides share the vertices at edges.
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
    """Return a strip that hangs from the hip, at the origin, to (0, 0, -2 reach), bent
    to an arc of radius reach / |curvature|.

    curvature: -1 (a half circle that opens forwards) to 1 (backwards, the c-leg of the
    paper's Fig. 8(b)), 0 for a flat leg. along, across, thick: numbers of
    quadrilaterals along the strip, across its width and through its thickness."""
    _check_sizes(reach=reach, thickness=thickness, width=width)
    in_range("curvature", curvature, -1, 1)
    require(
        thickness < reach,
        f"thickness must be less than the reach, got {thickness:g} and {reach:g}",
    )
    s = np.linspace(-1.0, 1.0, _checked_count("along", along, 2) + 1)
    half = np.arcsin(abs(curvature))  # half the angle of the arc
    if half:
        r = reach / np.sin(half)
        x = np.sign(curvature) * r * (np.cos(half * s) - np.cos(half))
        z = -reach - r * np.sin(half * s)
    else:
        x = 0 * s
        z = -reach - reach * s

    # Angle of the strip's direction from straight down, and the normal forwards.
    bend = np.sign(curvature) * half * s
    normal = np.stack([np.cos(bend), 0 * s, -np.sin(bend)], -1)
    thick = _checked_count("thick", thick, 1)
    across = _checked_count("across", across, 1)
    corners = _rectangle(thickness, width, thick, across)
    rings = (
        np.stack([x, 0 * s, z], -1)[:, None]
        + corners[None, :, :1] * normal[:, None]
        + corners[:, 1:] * [0.0, 1.0, 0.0]
    )
    return _tube(rings, max(1, round(across / 2)))


def _rectangle(a: float, b: float, m: int, n: int) -> np.ndarray:
    """Return points (2 m + 2 n, 2) around a rectangle a x b about the origin,
    counter-clockwise, with m pieces along a and n along b."""
    u = np.linspace(-0.5, 0.5, m + 1)[:-1]
    v = np.linspace(-0.5, 0.5, n + 1)[:-1]
    u_end = np.full(n, 0.5)
    v_end = np.full(m, 0.5)
    sides = [(u, -v_end), (u_end, v), (-u, v_end), (-u_end, -v)]
    return np.concatenate([np.stack(side, -1) for side in sides]) * [a, b]


def _tube(rings: np.ndarray, across: int, nose: float = 0.0) -> Mesh:
    """Return a closed mesh through rings (M, K, 3) of points.

    Each end has ``across`` - 1 smaller rings and a point in the middle, ``nose``
    further out along x."""
    first = rings[0]
    last = rings[-1]
    first_middle = first.mean(0) - [nose, 0.0, 0.0]
    last_middle = last.mean(0) + [nose, 0.0, 0.0]
    share = np.linspace(0.0, 1.0, across + 1)[1:-1][:, None, None]
    first_rings = first_middle + share * (first - first_middle)
    last_rings = last_middle + share[::-1] * (last - last_middle)
    rings = np.concatenate([first_rings, rings, last_rings])

    m, k, _ = rings.shape
    index = np.arange(m * k).reshape(m, k)
    tip = np.full(k, m * k)
    end = tip + 1
    ahead = np.roll(np.arange(k), -1)
    faces = [
        triangles(index),
        np.stack([tip, ahead, index[0]], -1),
        np.stack([end, index[-1], index[-1][ahead]], -1),
    ]
    vertices = np.concatenate([rings.reshape(-1, 3), [first_middle, last_middle]])
    return outward(vertices, np.concatenate(faces))


def triangles(rows: np.ndarray, closed: bool = True) -> np.ndarray:
    """Return two triangles (F, 3) for each quadrilateral between neighbouring rows of
    vertices (M, K). closed: whether the last vertex of a row is a neighbour of its
    first."""
    if closed:
        ahead = np.roll(rows, -1, 1)
    else:
        ahead = rows[:, 1:]
        rows = rows[:, :-1]
    a = rows[:-1].ravel()
    b = ahead[:-1].ravel()
    c = ahead[1:].ravel()
    d = rows[1:].ravel()
    return np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)])


def outward(vertices: np.ndarray, faces: np.ndarray) -> Mesh:
    """Return the closed mesh of triangles that agree on which side is out, all reversed
    if that is the inside."""
    a, b, c = vertices[faces.T]
    if (a * np.cross(b, c)).sum() < 0:
        faces = faces[:, ::-1]
    return Mesh(vertices, faces)


def _check_sizes(**sizes: float) -> None:
    """Raise ValueError for lengths out of range, m."""
    for name, value in sizes.items():
        in_range(name, value, 1e-6, 1e3)


def _checked_count(name: str, value: int, least: int) -> int:
    """Return a number of quadrilaterals; ValueError if it is out of range."""
    in_range(name, value, least, 4096, whole=True)
    return int(value)
