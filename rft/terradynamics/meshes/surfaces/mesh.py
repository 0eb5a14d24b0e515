"""Triangle meshes: their geometry, the parts of triangles below the surface, and meshes
that follow from others."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rft.core.checks import real_array
from rft.core.refusal import Refusal, require
from rft.terradynamics.meshes.surfaces import shells

MOST_TRIANGLES = 2_000_000
# Area over the square of the mesh's size, up to which a triangle counts as flat.
FLAT = 1e-14


@dataclass(frozen=True, eq=False)
class Mesh:
    """A surface of triangles, in its own frame.

    vertices: (V, 3), m. faces: (F, 3), indices of vertices, counter-clockwise as seen
    from outside. smooth_normals: (F, 3, 3), unit normals at the corners of the
    triangles of a mesh that stands for a smooth surface; None for the normals of the
    triangles.

    closed: True for bodies, whose triangles run along every edge as often one way as
    the other, in shells of which none lies inside another; ValueError for others. False
    for thin plates, of which either side may lead.

    Examples
    --------
    >>> import numpy as np
    >>> from rft.terradynamics.meshes import Mesh
    >>> vertices = 0.01 * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    >>> tetrahedron = Mesh(vertices, faces)
    >>> tetrahedron.faces.shape
    (4, 3)
    """

    vertices: np.ndarray
    faces: np.ndarray
    closed: bool = True
    smooth_normals: np.ndarray | None = None

    def __post_init__(self):
        vertices = real_array("vertices", self.vertices)
        require(
            vertices.ndim == 2 and vertices.shape[1:] == (3,),
            "vertices must be (V, 3)",
            value=vertices.shape,
        )
        faces = np.asarray(self.faces)
        are_triangles = faces.ndim == 2 and faces.shape[1:] == (3,)
        require(
            are_triangles and faces.dtype.kind in "iu",
            f"faces must be (F, 3) whole numbers, got {faces.dtype} {faces.shape}",
        )
        require(
            0 < len(faces) <= MOST_TRIANGLES,
            f"a mesh must have 1 to {MOST_TRIANGLES:,} triangles, got {len(faces):,}",
        )
        require(bool(np.isfinite(vertices).all()), "vertices must be finite")
        require_vertices(faces, len(vertices))
        require(
            isinstance(self.closed, bool),
            "closed must be true or false",
            value=self.closed,
        )
        normals = self.smooth_normals
        if normals is not None:
            normals = real_array("smooth_normals", normals)
            require(
                normals.shape == (len(faces), 3, 3)
                and bool(np.isfinite(normals).all()),
                f"smooth_normals must be unit normals of shape ({len(faces)}, 3, 3)",
            )
        object.__setattr__(self, "smooth_normals", normals)
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "faces", faces.astype(np.int64))

        flat = int((self.areas <= FLAT * np.ptp(vertices, axis=0).max() ** 2).sum())
        require(
            not flat,
            f"{flat} of {len(faces)} triangles have no area",
            instead="clean the mesh",
        )
        if self.closed:
            self._require_closed()

    def _require_closed(self) -> None:
        """Raise ValueError unless the mesh encloses a body, grains touch all triangles,
        and these agree on which side is out."""
        faces = self.faces
        surplus = shells.excess_edges(faces)
        if len(surplus):
            raise self._open_refusal(surplus)

        parts = [faces[part] for part in shells.shells(faces)]
        n_outside = [len(shells.without_walls(self.vertices, part)) for part in parts]
        is_hidden = shells.is_enclosed(self.vertices, parts)
        require(
            sum(n_outside) == len(faces) and not is_hidden.any(),
            "the mesh has an inner shell or wall",
            because="no grains touch it",
            instead=(
                "remove it, for example with rft.terradynamics.meshes.surfaces.sound"
            ),
        )
        require(
            all(shells.volume(self.vertices[part]) > 0 for part in parts),
            "the mesh is inside out",
            because="its normals point inwards",
            instead="reverse the triangles",
        )

    def _open_refusal(self, surplus: np.ndarray) -> Refusal:
        """Return the refusal of a mesh with edges (E, 2) along which more triangles run
        this way than the other."""
        _, uses = np.unique(surplus, axis=0, return_counts=True)
        if (uses > 1).any() or self._has_doubles():
            return Refusal(
                "two triangles run along an edge of the mesh in the same direction",
                because="some triangles are reversed or duplicated",
                instead=(
                    "repair them, for example with "
                    "rft.terradynamics.meshes.surfaces.sound"
                ),
            )
        cure = "close it, or use closed = false if it is a sheet"
        if shells.nearly_closes(self.vertices, self.faces):
            cure = "close it, for example with rft.terradynamics.meshes.surfaces.sound"
        return Refusal(
            "the mesh is open",
            because=f"{len(surplus)} edges have only one triangle",
            instead=cure,
        )

    def _has_doubles(self) -> bool:
        """Return whether a triangle stands twice."""
        return len(np.unique(np.sort(self.faces, 1), axis=0)) < len(self.faces)

    def _unchecked_copy(self, vertices: np.ndarray, faces: np.ndarray, normals) -> Mesh:
        """Return a mesh of these vertices, faces and smooth normals that is as sound as
        this one.

        It is not checked, because checks take longer than all the rest."""
        mesh = object.__new__(Mesh)
        values = {
            "vertices": vertices,
            "faces": faces,
            "closed": self.closed,
            "smooth_normals": normals,
        }
        for name, value in values.items():
            object.__setattr__(mesh, name, value)
        return mesh

    @cached_property
    def _cross(self) -> np.ndarray:
        """Normals (F, 3) times twice the areas, m^2."""
        a, b, c = self.vertices[self.faces.T]
        return np.cross(b - a, c - a)

    @cached_property
    def areas(self) -> np.ndarray:
        """Areas (F,), m^2."""
        return np.linalg.norm(self._cross, axis=-1) / 2

    @cached_property
    def normals(self) -> np.ndarray:
        """Outward unit normals (F, 3) of the triangles."""
        return self._cross / (2 * self.areas[:, None])

    @cached_property
    def middle_normals(self) -> np.ndarray:
        """Unit normals (F, 3) at the triangles' middles of the surface that the mesh
        stands for."""
        if self.smooth_normals is None:
            return self.normals
        mean = self.smooth_normals.sum(1)
        return mean / np.linalg.norm(mean, axis=-1, keepdims=True)

    @cached_property
    def middles(self) -> np.ndarray:
        """Centroids (F, 3), m."""
        return self.vertices[self.faces].mean(1)

    @cached_property
    def normal_moments(self) -> np.ndarray:
        """Moments (F, 3) of the normals about the origin, middle x normal, m."""
        return np.cross(self.middles, self.middle_normals)

    @cached_property
    def second_moments(self) -> np.ndarray:
        """Integrals (F, 3, 3) of x x^T over the triangles, m^4."""
        corners = self.vertices[self.faces]
        squares = np.einsum("fci,fcj->fij", corners, corners)
        squares_of_middles = np.einsum("fi,fj->fij", self.middles, self.middles)
        sums = squares + 9 * squares_of_middles
        return sums * (self.areas / 12)[:, None, None]

    @property
    def volume(self) -> float:
        """Volume that a closed mesh encloses, m^3."""
        a = self.vertices[self.faces[:, 0]]
        return float((a * self._cross).sum() / 6)

    @property
    def two_sided(self) -> Mesh:
        """An open mesh with a second triangle on the back of each, so that the side
        which leads bears.

        Shells that close stay as they are; ValueError if one nearly closes."""
        parts = shells.shells(self.faces)
        sheets = [part for part in parts if len(shells.excess_edges(self.faces[part]))]
        for part in sheets:
            require(
                not shells.nearly_closes(self.vertices, self.faces[part]),
                "closed = false is for sheets, but the mesh is almost closed",
                because="its inside would also carry stress",
                instead=(
                    "close it, for example with rft.terradynamics.meshes.surfaces.sound"
                ),
            )
        back = np.sort(np.concatenate([*sheets, np.empty(0, int)]))
        normals = self.smooth_normals
        if normals is not None:
            normals = np.concatenate([normals, -normals[back][:, ::-1]])
        faces = np.concatenate([self.faces, self.faces[back][:, ::-1]])
        return self._unchecked_copy(self.vertices, faces, normals)


def below(corners: np.ndarray, heights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the parts of triangles (T, 3, 3) below the surface, from the heights
    (T, 3) of their corners.

    Returns triangles (P, 3, 3), and the index (P,) of the triangle that each is a part
    of. A triangle that crosses the surface has one part or two.

    Examples
    --------
    >>> import numpy as np
    >>> from rft.terradynamics.meshes import below
    >>> corners = np.array([[[0.0, 0.0, 0.01], [0.01, 0.0, -0.01], [0.0, 0.01, -0.01]]])
    >>> triangles, index = below(corners, corners[..., 2])
    >>> triangles.shape, index  # one triangle, cut at the surface
    ((2, 3, 3), array([0, 0]))
    """
    under = heights < 0
    count = under.sum(-1)
    full = np.flatnonzero(count == 3)

    # With one corner under the surface, the part is a triangle at that corner a.
    tips = np.flatnonzero(count == 1)
    first = np.argmax(under[tips], -1)
    a, p, q = _corners_from(first, corners[tips], heights[tips])
    at_corner = np.stack([a[0], _crossing(a, p), _crossing(a, q)], 1)

    # With one corner over it, the part is the quadrilateral between the other two, b
    # and c, and the points p and q where edges cross the surface.
    quadrilaterals = np.flatnonzero(count == 2)
    first = np.argmin(under[quadrilaterals], -1)
    over, b, c = _corners_from(first, corners[quadrilaterals], heights[quadrilaterals])
    p = _crossing(b, over)
    q = _crossing(c, over)
    halves = [np.stack([p, b[0], c[0]], 1), np.stack([p, c[0], q], 1)]

    parts = np.concatenate([corners[full], at_corner, *halves])
    return parts, np.concatenate([full, tips, quadrilaterals, quadrilaterals])


def _corners_from(first: np.ndarray, corners: np.ndarray, heights: np.ndarray) -> list:
    """Return (point (T, 3), height (T,)) of the three corners of triangles in cyclic
    order, from the corner ``first`` (T,) on."""
    order = (first[:, None] + np.arange(3)) % 3
    corners = np.take_along_axis(corners, order[..., None], 1)
    heights = np.take_along_axis(heights, order, 1)
    return [(corners[:, k], heights[:, k]) for k in range(3)]


def _crossing(under: tuple, over: tuple) -> np.ndarray:
    """Return the points (T, 3) where edges from corners under the surface to corners on
    or over it cross it; corners are (point, height)."""
    share = under[1] / (under[1] - over[1])
    return under[0] + share[:, None] * (over[0] - under[0])


def cut_in_four(
    vertices: np.ndarray, faces: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices and faces of a mesh with every triangle cut in four flat ones at
    the middles of its edges."""
    edges = np.stack([faces, faces[:, [1, 2, 0]]], -1).reshape(-1, 2)
    edges, index = np.unique(np.sort(edges, -1), axis=0, return_inverse=True)
    a, b, c = faces.T
    ab, bc, ca = len(vertices) + index.reshape(-1, 3).T
    vertices = np.concatenate([vertices, vertices[edges].mean(1)])
    return vertices, _four_triangles(a, b, c, ab, bc, ca)


def quartered_mesh(mesh: Mesh) -> Mesh:
    """Return the same surface with four times as many triangles."""
    normals = mesh.smooth_normals
    if normals is not None:
        a, b, c = normals.swapaxes(0, 1)
        middles = [a + b, b + c, c + a]
        middles = [x / np.linalg.norm(x, axis=-1, keepdims=True) for x in middles]
        normals = _four_triangles(a, b, c, *middles)
    vertices, faces = cut_in_four(mesh.vertices, mesh.faces)
    return mesh._unchecked_copy(vertices, faces, normals)


def _four_triangles(a, b, c, ab, bc, ca) -> np.ndarray:
    """Return the values (4 F, 3, ...) at the corners of the four parts of triangles,
    from those at their corners and at the middles of their edges (F, ...)."""
    parts = [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
    return np.concatenate([np.stack(part, 1) for part in parts])


def mirror_image(mesh: Mesh) -> Mesh:
    """Return the mirror image of a mesh in the plane of x and z."""
    mirror = [1.0, -1.0, 1.0]
    normals = mesh.smooth_normals
    if normals is not None:
        normals = normals[:, ::-1] * mirror
    return mesh._unchecked_copy(mesh.vertices * mirror, mesh.faces[:, ::-1], normals)


def require_vertices(faces: np.ndarray, count: int) -> None:
    """Raise ValueError if faces name vertices other than 0 to count - 1."""
    unknown = faces[(faces < 0) | (faces >= count)]
    if len(unknown):
        raise Refusal(
            f"a face names vertex {unknown[0]}, but vertices are numbered 0 to "
            f"{count - 1}",
            instead="correct the mesh",
        )
