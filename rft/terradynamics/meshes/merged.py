"""Meshes of many small triangles as fewer faces that bear nearly the same.

Neighbouring triangles that point nearly the same way become one face. It has their area vector (the sum of area times
normal), their middle and their extent, as the second moments of area tell it, and it lies as far out as keeps their share
of the enclosed volume: where the stress per depth is the same all over, the force is the volume's. Faces of that kind do
not meet at edges; forces are sums over faces, so that they need not."""

from __future__ import annotations

import numpy as np

from rft.core.refusal import require
from rft.terradynamics.meshes.mesh import Mesh

SPREAD = 0.2  # between normals of one face, along each axis: some 11 degrees
MANY, WIDER = (
    1000,
    0.4,
)  # faces from which on errors of single ones average out, and their spread
LONGEST = 1.5  # edges over the length asked for, above which triangles are halved
SMALL = 0.1  # area over the square of that length, below which triangles are merged
SLENDER = 0.75  # edges over that length, above which triangles to be merged are halved
FILLED = 8.0  # square of the distance of the corners of a triangle whose variance is 1


def resized(mesh: Mesh, length: float, most: int) -> Mesh:
    """Return a mesh whose faces have edges of about ``length``, m, as a list of triangles that need not meet.

    Large triangles are halved across their longest edges, again and again; small ones are merged. The mesh is returned as
    it is where neither happens. Refusal for more than ``most`` triangles on the way."""
    corners, normals = mesh.vertices[mesh.faces], _corner_normals(mesh)
    is_long = _is_long(corners, length)
    is_changed = bool(is_long.any())
    while is_long.any():
        corners, normals = _halved(corners, normals, is_long)
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
        merged = _merged(corners[is_small], normals[is_small], length)
        if len(merged[0]) < is_small.sum():
            is_changed = True
            corners = np.concatenate([corners[~is_small], merged[0]])
            normals = np.concatenate([normals[~is_small], merged[1]])
    if not is_changed:
        return mesh
    return _of_triangles(mesh, corners, normals)


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


def _halved(corners, normals, is_long) -> tuple[np.ndarray, np.ndarray]:
    """Return corners and normals there, (F, 3, 3), with some triangles halved across their longest edges."""
    long = corners[is_long]
    edges = np.linalg.norm(np.roll(long, -1, 1) - long, axis=-1)  # from each corner on
    order = (edges.argmax(1)[:, None] + np.arange(3)) % 3
    out = []
    for values in (corners, normals):
        turned = np.take_along_axis(values[is_long], order[:, :, None], 1)
        a, b, c = turned.swapaxes(0, 1)
        middle = (a + b) / 2
        halves = [np.stack([a, middle, c], 1), np.stack([middle, b, c], 1)]
        out.append(np.concatenate([values[~is_long], *halves]))
    return out[0], out[1]


def _merged(corners, normals, length: float) -> tuple[np.ndarray, np.ndarray]:
    """Return corners (G, 3, 3) and normals (G, 3) of faces in place of triangles with normals (F, 3)."""
    area, middle = _areas(corners), corners.mean(1)
    group = _groups(middle, normals, length, SPREAD)
    if group.max() >= MANY:
        group = _groups(middle, normals, length, WIDER)
    count = group.max() + 1

    def total(values):
        out = np.zeros((count, *values.shape[1:]))
        np.add.at(out, group, values)
        return out

    vector = total(area[:, None] * normals)
    size = np.linalg.norm(vector, axis=1)
    n = vector / size[:, None]
    place = total(area[:, None] * middle) / total(area)[:, None]
    volume = total(area * (normals * middle).sum(1))
    place += ((volume - (vector * place).sum(1)) / size)[:, None] * n
    arms = corners - place[group][:, None]
    whole = 3.0 * arms.mean(1)
    # The second moments of a triangle's area, by its corners and its middle.
    moments = np.einsum("fki,fkj->fij", arms, arms) + whole[:, :, None] * whole[:, None]
    moments = total(area[:, None, None] * moments / 12.0) / total(area)[:, None, None]
    return _triangles_of(place, n, size, moments), n


def _triangles_of(place, n, area, moments) -> np.ndarray:
    """Return corners (G, 3, 3) of triangles with middles, normals and second moments (G, 3, 3), scaled to their areas."""
    flat = np.eye(3) - n[:, :, None] * n[:, None]
    variance, axes = np.linalg.eigh(flat @ moments @ flat)
    variance = np.maximum(variance[:, 1:], 1e-6 * variance[:, 2:])
    first, second = np.moveaxis(axes[:, :, 1:], 2, 0)
    is_turned = (np.cross(first, second) * n).sum(1) < 0.0
    second = np.where(is_turned[:, None], -second, second)
    lengths = np.sqrt(FILLED * variance)
    of_them = 3**1.5 / 4 * lengths.prod(1)
    lengths *= np.sqrt(area / of_them)[:, None]
    corners = []
    for angle in 2 * np.pi / 3 * np.arange(3):
        x, y = np.cos(angle) * lengths[:, :1], np.sin(angle) * lengths[:, 1:]
        corners.append(place + x * first + y * second)
    return np.stack(corners, 1)


def _groups(middle, normals, length: float, spread: float) -> np.ndarray:
    """Return the group (F,) of each triangle: halved along the widest extent until all are narrower than ``length`` and
    normals less than ``spread`` apart."""
    features = np.concatenate([middle / length, normals / spread], 1)
    group, count = np.zeros(len(features), np.int64), 0
    waiting = [np.arange(len(features))]
    while waiting:
        index = waiting.pop()
        own = features[index]
        low, high = own.min(0), own.max(0)
        along = int((high - low).argmax())
        if high[along] - low[along] <= 1.0:
            group[index] = count
            count += 1
            continue
        is_low = own[:, along] < (low[along] + high[along]) / 2
        waiting += [index[is_low], index[~is_low]]
    return group


def _of_triangles(mesh: Mesh, corners: np.ndarray, normals: np.ndarray) -> Mesh:
    """Return a mesh of triangles that need not meet, as closed as the mesh that they are made from."""
    faces = np.arange(3 * len(corners)).reshape(-1, 3)
    smooth = np.repeat(normals[:, None], 3, axis=1)
    return mesh._copy(corners.reshape(-1, 3), faces, smooth)
