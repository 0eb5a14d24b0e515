"""Meshes of many small triangles as fewer faces that bear nearly the same.

Neighbouring triangles that point nearly the same way become one face. It has the sum of
their area vectors (area times normal), their middle, and their extent by the second
moments of area. It lies so far out that it keeps their share of the enclosed volume:
where the stress per depth is the same all over, the force is the volume's. Such faces
do not meet at edges. They need not, because forces are sums over faces."""

from __future__ import annotations

import numpy as np

from rft.core.refusal import require
from rft.terradynamics.meshes.surfaces.mesh import Mesh

SPREAD = 0.2  # between normals of one face, along each axis: some 11 degrees
# From this number of faces on, errors of single ones average out, and normals may
# differ by more.
MANY = 1000
SPREAD_OF_MANY = 0.4
LONGEST = 1.5  # edges over the wanted length, above which triangles are halved
SMALL = 0.1  # area over the square of that length, below which triangles are merged
SLENDER = 0.75  # edges over that length, above which triangles to be merged are halved
# Square of the distance of a triangle's corners from its middle, if its variance is 1.
SQUARED_REACH = 8.0


def resize_faces(mesh: Mesh, length: float, most: int) -> Mesh:
    """Return a mesh whose faces have edges of about ``length``, m, as a list of
    triangles that need not meet.

    Large triangles are halved across their longest edges, again and again; small ones
    are merged. Where neither happens, the mesh itself is returned. Refusal for more
    than ``most`` triangles on the way."""
    corners = mesh.vertices[mesh.faces]
    normals = _corner_normals(mesh)
    is_long = _is_long(corners, length)
    is_changed = bool(is_long.any())
    while is_long.any():
        corners, normals = _halve(corners, normals, is_long)
        require(
            len(corners) <= most,
            f"it has more than {most} elements",
            instead="make ``element`` longer",
        )
        is_long = _is_long(corners, length)
    normals = normals.sum(1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)

    is_small = _areas(corners) < SMALL * length**2
    if is_small.any():
        merged, merged_normals = _merge(corners[is_small], normals[is_small], length)
        if len(merged) < is_small.sum():
            is_changed = True
            corners = np.concatenate([corners[~is_small], merged])
            normals = np.concatenate([normals[~is_small], merged_normals])
    if not is_changed:
        return mesh
    return _separate_triangles(mesh, corners, normals)


def _corner_normals(mesh: Mesh) -> np.ndarray:
    """Return the normals at the corners of the triangles, (F, 3, 3)."""
    if mesh.smooth_normals is None:
        return np.repeat(mesh.normals[:, None], 3, axis=1)
    return mesh.smooth_normals


def _areas(corners: np.ndarray) -> np.ndarray:
    """Return the areas (F,) of triangles, m^2."""
    a, b, c = corners.swapaxes(0, 1)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def _is_long(corners: np.ndarray, length: float) -> np.ndarray:
    """Return whether triangles (F,) have to be halved."""
    edges = np.linalg.norm(corners - np.roll(corners, 1, 1), axis=-1).max(1)
    is_small = _areas(corners) < SMALL * length**2
    return edges > np.where(is_small, SLENDER, LONGEST) * length


def _halve(corners, normals, is_long) -> tuple[np.ndarray, np.ndarray]:
    """Return corners and normals there, (F, 3, 3), with some triangles halved across
    their longest edges."""
    long = corners[is_long]
    edges = np.linalg.norm(np.roll(long, -1, 1) - long, axis=-1)  # from each corner on
    order = (edges.argmax(1)[:, None] + np.arange(3)) % 3
    out = []
    for values in (corners, normals):
        # The longest edge is the one from a to b.
        ordered = np.take_along_axis(values[is_long], order[:, :, None], 1)
        a, b, c = ordered.swapaxes(0, 1)
        middle = (a + b) / 2
        halves = [np.stack([a, middle, c], 1), np.stack([middle, b, c], 1)]
        out.append(np.concatenate([values[~is_long], *halves]))
    return out[0], out[1]


def _merge(corners, normals, length: float) -> tuple[np.ndarray, np.ndarray]:
    """Return corners (G, 3, 3) and normals (G, 3) of faces that stand for triangles
    with normals (F, 3)."""
    area = _areas(corners)
    middle = corners.mean(1)
    group = _groups(middle, normals, length, SPREAD)
    if group.max() >= MANY:
        group = _groups(middle, normals, length, SPREAD_OF_MANY)
    n_groups = group.max() + 1

    def total(values):
        out = np.zeros((n_groups, *values.shape[1:]))
        np.add.at(out, group, values)
        return out

    vector = total(area[:, None] * normals)
    size = np.linalg.norm(vector, axis=1)
    n = vector / size[:, None]
    total_area = total(area)

    # The middle, moved along the normal to where the face keeps the enclosed volume.
    place = total(area[:, None] * middle) / total_area[:, None]
    volume = total(area * (normals * middle).sum(1))
    place += ((volume - (vector * place).sum(1)) / size)[:, None] * n

    # The second moments of a triangle's area, by its corners and its middle.
    arms = corners - place[group][:, None]
    arm_of_middle = 3.0 * arms.mean(1)
    moments = np.einsum("fki,fkj->fij", arms, arms)
    moments = moments + arm_of_middle[:, :, None] * arm_of_middle[:, None]
    moments = total(area[:, None, None] * moments / 12.0) / total_area[:, None, None]
    return _triangles_from_moments(place, n, size, moments), n


def _triangles_from_moments(place, n, area, moments) -> np.ndarray:
    """Return corners (G, 3, 3) of triangles with middles and normals (G, 3), second
    moments (G, 3, 3) within their planes, and areas (G,)."""
    plane = np.eye(3) - n[:, :, None] * n[:, None]
    variance, axes = np.linalg.eigh(plane @ moments @ plane)
    variance = np.maximum(variance[:, 1:], 1e-6 * variance[:, 2:])
    first, second = np.moveaxis(axes[:, :, 1:], 2, 0)
    runs_clockwise = (np.cross(first, second) * n).sum(1) < 0.0
    second = np.where(runs_clockwise[:, None], -second, second)

    lengths = np.sqrt(SQUARED_REACH * variance)
    area_by_moments = 3**1.5 / 4 * lengths.prod(1)
    lengths *= np.sqrt(area / area_by_moments)[:, None]
    corners = []
    for angle in 2 * np.pi / 3 * np.arange(3):
        x = np.cos(angle) * lengths[:, :1]
        y = np.sin(angle) * lengths[:, 1:]
        corners.append(place + x * first + y * second)
    return np.stack(corners, 1)


def _groups(middle, normals, length: float, spread: float) -> np.ndarray:
    """Return the group (F,) of each triangle: halved along the widest extent until all
    are narrower than ``length`` and their normals differ by less than ``spread``."""
    features = np.concatenate([middle / length, normals / spread], 1)
    group = np.zeros(len(features), np.int64)
    n_groups = 0
    waiting = [np.arange(len(features))]
    while waiting:
        index = waiting.pop()
        own = features[index]
        low = own.min(0)
        high = own.max(0)
        along = int((high - low).argmax())
        if high[along] - low[along] <= 1.0:
            group[index] = n_groups
            n_groups += 1
            continue
        is_low = own[:, along] < (low[along] + high[along]) / 2
        waiting += [index[is_low], index[~is_low]]
    return group


def _separate_triangles(mesh: Mesh, corners: np.ndarray, normals: np.ndarray) -> Mesh:
    """Return a mesh of triangles (G, 3, 3) that need not meet, as closed as ``mesh``,
    for which they stand."""
    faces = np.arange(3 * len(corners)).reshape(-1, 3)
    corner_normals = np.repeat(normals[:, None], 3, axis=1)
    return mesh._unchecked_copy(corners.reshape(-1, 3), faces, corner_normals)
