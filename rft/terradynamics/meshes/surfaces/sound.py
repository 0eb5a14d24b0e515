"""Sound meshes from the triangles of files and models, with notes of what was mended.

Grains touch the outside of closed shells, and both sides of sheets. Shells inside
others, walls between parts and doubles are therefore left out.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rft.core.refusal import Refusal, require
from rft.terradynamics.meshes.surfaces import shells
from rft.terradynamics.meshes.surfaces.mesh import (
    FLAT,
    MOST_TRIANGLES,
    Mesh,
    require_vertices,
)

SMALLEST = 1e-3  # m: a smaller mesh is a few grains large; assumed to be a wrong scale
LARGE = 1.0  # m: a larger one is noted
ROUNDINGS = (1e-7, 1e-6, 1e-5)  # of the size: distances within which corners are equal
SINGLE = 2.0**-23  # of a coordinate: rounding of single precision, that of STL files
FOLDED = -0.99999  # cosine of the angle between normals, 0.26 degrees from a fold
FOLDS = 1e-4  # of the surface: area of folds below which they are rounding
MOST_FLAT = 1000  # triangles without area that are merged, each in a search
MOST_WALLS = 20  # within a body, which are tried in turn
OPEN_CURE = "close it, or use closed = false if it is a sheet"


class Sound(NamedTuple):
    """A sound mesh, and notes, one line each, of what was mended in it."""

    mesh: Mesh
    notes: tuple[str, ...]


def sound(
    vertices: np.ndarray, faces: np.ndarray, closed: bool = True, cure: str = OPEN_CURE
) -> Sound:
    """Return the sound mesh of triangles; Refusal if they enclose nothing.

    Corners within rounding are welded where triangles do not meet, holes are filled if
    the mesh nearly closes, and triangles are reversed to agree on which side is out.

    Parameters
    ----------
    vertices : (V, 3), m.
    faces : (F, 3), indices of vertices.
    closed : False for sheets, of which either side may lead (`Mesh.two_sided`). Shells
        that close are solids even so. Refused if none is a sheet, or if one nearly
        closes.
    cure : advice in the refusal of a mesh that is open.

    Examples
    --------
    >>> import numpy as np
    >>> from rft.terradynamics.meshes import sound
    >>> from rft.terradynamics.meshes.surfaces import shapes
    >>> ball, hole = shapes.sphere(0.02, 2), shapes.sphere(0.01, 2)
    >>> vertices = np.concatenate([ball.vertices, hole.vertices])
    >>> faces = np.concatenate([ball.faces, hole.faces[:, ::-1] + len(ball.vertices)])
    >>> mesh, notes = sound(vertices, faces)
    >>> len(mesh.faces) == len(ball.faces)
    True
    """
    vertices = np.asarray(vertices, float)
    require(bool(np.isfinite(vertices).all()), "vertices must be finite")
    require(
        0 < len(faces) <= MOST_TRIANGLES,
        f"a mesh must have 1 to {MOST_TRIANGLES:,} triangles, got {len(faces):,}",
    )
    require_vertices(faces, len(vertices))
    return _Mender(vertices, faces, cure).mend(closed)


def size_note(mesh: Mesh, cure: str) -> list[str]:
    """Return a list of one note on the size of a mesh if it is likely not meant, else
    an empty list."""
    size = float(np.ptp(mesh.vertices, axis=0).max())
    if SMALLEST <= size <= LARGE:
        return []
    return [f"the mesh is {size:.3g} m large: {cure}"]


def _counted(count: int, noun: str) -> str:
    """Return a number with its noun, such as "2 holes"."""
    if count == 1:
        return f"{count:,} {noun}"
    return f"{count:,} {noun}s"


class _Weld(NamedTuple):
    """Triangles (F, 3) after corners within a distance, m, were welded; how many
    corners were welded, and how many edges still have an odd number of triangles."""

    faces: np.ndarray
    distance: float
    n_corners: int
    n_odd_edges: int


class _Mender:
    """Mends a mesh step by step, and keeps notes of what it does."""

    def __init__(self, vertices: np.ndarray, faces: np.ndarray, cure: str):
        self.cure = cure
        self.notes: list[str] = []
        self.vertices, index = np.unique(vertices, axis=0, return_inverse=True)
        self.faces = index.reshape(-1)[faces]
        self.size = float(np.ptp(self.vertices[self.faces], axis=(0, 1)).max())

    def note(self, count: int, noun: str, what_was_done: str) -> None:
        """Add a note, unless the count is 0."""
        if count:
            self.notes.append(f"{_counted(count, noun)} {what_was_done}")

    def mend(self, closed: bool) -> Sound:
        """Return the sound mesh with all notes."""
        self.drop_degenerate()
        self.drop_doubles(closed)
        if self.weld():
            self.drop_doubles(closed)
        self.orient(closed)
        if closed:
            self.drop_single_walls()

        solids = []
        sheets = []
        for part in shells.shells(self.faces):
            is_open = len(shells.excess_edges(self.faces[part])) > 0
            if is_open:
                sheets.append(part)
            else:
                solids.append(part)
        if closed:
            kept_shells = self.close_shells(solids, sheets)
        else:
            kept_shells = self.keep_sheets(solids, sheets)

        faces = self.merge_flat(np.concatenate(kept_shells))
        self.require_no_folds(faces)
        used, index = np.unique(faces, return_inverse=True)
        mesh = Mesh(self.vertices[used], index.reshape(-1, 3), closed)
        return Sound(mesh, tuple(self.notes))

    def drop_degenerate(self) -> None:
        """Leave out triangles with equal corners, which close nothing."""
        proper = _proper(self.faces)
        n_dropped = len(self.faces) - len(proper)
        has_area = len(proper) > 0 and not self.is_flat(proper).all()
        require(
            has_area,
            f"{len(self.faces)} of {len(self.faces)} triangles have no area",
            instead="clean the mesh",
        )
        self.faces = proper
        self.note(n_dropped, "triangle", "without area left out")

    def weld(self) -> bool:
        """Weld corners of open edges within rounding, at the distance that closes most;
        return whether any closes."""
        odd = self.odd_edges(self.faces)
        if not len(odd):
            return False
        corners = np.unique([odd // len(self.vertices), odd % len(self.vertices)])
        rounding = 2 * SINGLE * float(np.abs(self.vertices[self.faces]).max())
        best = None
        for share in ROUNDINGS:
            weld = self.try_weld(corners, max(share * self.size, rounding))
            if weld is None or not len(weld.faces):
                continue
            if best is None or weld.n_odd_edges < best.n_odd_edges:
                best = weld
        if best is None or best.n_odd_edges >= len(odd):
            return False
        n_dropped = len(self.faces) - len(best.faces)
        self.faces = best.faces
        self.notes.append(
            f"{best.n_corners:,} corners welded to others within {best.distance:.2g} m"
        )
        self.note(n_dropped, "triangle", "without area left out")
        return True

    def try_weld(self, corners: np.ndarray, distance: float) -> _Weld | None:
        """Return the triangles after corners (indices of vertices) within a distance,
        m, are made one; None if there are none."""
        from scipy.sparse import coo_matrix
        from scipy.sparse.csgraph import connected_components
        from scipy.spatial import cKDTree

        tree = cKDTree(self.vertices[corners])
        pairs = tree.query_pairs(distance, output_type="ndarray")
        if not len(pairs):
            return None
        n = len(corners)
        graph = coo_matrix((np.ones(len(pairs)), tuple(pairs.T)), (n, n))
        _, label = connected_components(graph, directed=False)
        _, first = np.unique(label, return_index=True)
        target = np.arange(len(self.vertices))
        target[corners] = corners[first[label]]
        faces = _proper(target[self.faces])
        return _Weld(faces, distance, n - len(first), len(self.odd_edges(faces)))

    def odd_edges(self, faces: np.ndarray) -> np.ndarray:
        """Return whole numbers for the edges that an odd number of triangles share."""
        a, b = shells.directed_edges(faces).T
        codes = np.minimum(a, b) * len(self.vertices) + np.maximum(a, b)
        unique, uses = np.unique(codes, return_counts=True)
        return unique[uses % 2 == 1]

    def drop_doubles(self, closed: bool) -> None:
        """Leave out doubles. Of two triangles back to back one stays, if they are
        sheets, or if they close a surface, by themselves or with others."""
        a, b, c = self.faces.T
        is_even = np.sum([a < b, b < c, c < a], axis=0) == 2
        number = self.corner_sets()
        _, first = np.unique(2 * number + is_even, return_index=True)
        self.note(len(number) - len(first), "duplicate triangle", "left out")
        self.faces = self.faces[np.sort(first)]
        back = self.back_to_back()
        if not len(back):
            return
        surface = self.faces[back[:, 0]]
        parts = shells.shells(surface)
        if closed:
            rest = np.delete(self.faces, back.ravel(), axis=0)
            open_edges = self.odd_edges(rest)
            rims = [self.odd_edges(surface[part]) for part in parts]
            parts = [
                part for part, rim in zip(parts, rims) if np.isin(rim, open_edges).all()
            ]
        if parts:
            dropped = back[np.concatenate(parts), 1]
            self.note(len(dropped), "triangle", "back to back with others left out")
            self.faces = np.delete(self.faces, dropped, axis=0)

    def corner_sets(self) -> np.ndarray:
        """Return a whole number (F,) for each triangle, the same for triangles with the
        same corners."""
        low, middle, high = np.sort(self.faces, 1).T
        count = len(self.vertices)
        _, pair = np.unique(low * count + middle, return_inverse=True)
        _, number = np.unique(pair.reshape(-1) * count + high, return_inverse=True)
        return number.reshape(-1)

    def back_to_back(self) -> np.ndarray:
        """Return the pairs (P, 2) of triangles with the same corners."""
        number = self.corner_sets()
        uses = np.bincount(number)
        order = np.argsort(number, kind="stable")
        starts = np.cumsum(uses) - uses
        first = starts[uses == 2]
        return np.stack([order[first], order[first + 1]], -1)

    def orient(self, closed: bool) -> None:
        """Reverse triangles so that neighbours agree on which side is out."""
        is_reversed = shells.reversed_triangles(self.faces)
        if is_reversed is None and not closed:
            return
        require(
            is_reversed is not None,
            "the mesh has only one side, like a Moebius strip",
            instead="correct it in the program that created it",
        )
        self.faces[is_reversed] = self.faces[is_reversed][:, ::-1]
        count = int(is_reversed.sum())
        self.note(count, "triangle", "wound against the others reversed")

    def drop_single_walls(self) -> None:
        """Leave out the surface that ends at edges of others and lies within the body
        that is left, if there is one: of several, that which leaves the largest
        body."""
        codes, _ = shells.edge_codes(self.faces)
        _, index, uses = np.unique(codes, return_inverse=True, return_counts=True)
        is_odd = (uses % 2 == 1) & (uses > 2)
        is_at_odd_edge = is_odd[index.reshape(-1)].reshape(-1, 3).any(1)
        if not is_at_odd_edge.any():
            return

        piece = shells.pieces(self.faces)
        candidates = np.unique(piece[is_at_odd_edge])
        largest = 0.0
        body = wall = None
        for candidate in candidates[:MOST_WALLS]:
            is_wall = piece == candidate
            rest = self.faces[~is_wall]
            if not len(rest) or len(shells.excess_edges(rest)):
                continue
            size = abs(shells.volume(self.vertices[rest]))
            if body is None or size > largest:
                largest = size
                body = rest
                wall = self.faces[is_wall]
        if body is None:
            return
        middles = self.vertices[wall].mean(1)
        if (shells.winding(middles, self.vertices[body]) != 0).all():
            self.note(len(wall), "triangle", "of a wall within the body left out")
            self.faces = body

    def close_shells(self, solids: list, sheets: list) -> list[np.ndarray]:
        """Return the triangles (F, 3) of the outermost shells, with holes filled;
        Refusal for open surfaces outside of them. solids, sheets: indices of triangles,
        of closed and of open shells."""
        solids = [self.faces[part] for part in solids]
        n_holes = 0
        n_added = 0
        n_inner = 0
        added_area = 0.0
        for part in sheets:
            faces = self.faces[part]
            if not shells.nearly_closes(self.vertices, faces):
                self.require_inside(faces, solids)
                n_inner += len(faces)
                continue
            self.vertices, added, count = shells.caps(self.vertices, faces)
            added_area += shells.area(self.vertices[added])
            solids.append(np.concatenate([faces, added]))
            n_added += len(added)
            n_holes += count
        if n_holes:
            total = sum(shells.area(self.vertices[faces]) for faces in solids)
            self.note(
                n_holes,
                "hole",
                f"filled by {_counted(n_added, 'triangle')}, "
                f"{100 * added_area / total:.2g} % of the surface",
            )
        self.note(n_inner, "triangle", "of open surfaces within the body left out")
        return self.outermost_shells(solids)

    def require_inside(self, faces: np.ndarray, solids: list[np.ndarray]) -> None:
        """Raise Refusal unless an open surface lies inside closed shells."""
        middles = self.vertices[faces].mean(1)
        inside = np.zeros(len(middles), bool)
        for solid in solids:
            inside |= shells.winding(middles, self.vertices[solid]) != 0
        if not inside.all():
            count = len(shells.excess_edges(faces))
            raise Refusal(
                "the mesh is open",
                because=f"{count} edges have only one triangle",
                instead=self.cure,
            )

    def outermost_shells(self, solids: list[np.ndarray]) -> list[np.ndarray]:
        """Return the shells that no other encloses, with their outside out."""
        count = sum(map(len, solids))
        solids = [shells.without_walls(self.vertices, faces) for faces in solids]
        n_walls = count - sum(map(len, solids))
        self.note(n_walls, "triangle", "of walls within the body left out")

        is_enclosed = shells.is_enclosed(self.vertices, solids)
        outermost = []
        n_enclosed = 0
        n_reversed = 0
        for faces, is_hidden in zip(solids, is_enclosed):
            if is_hidden:
                n_enclosed += len(faces)
                continue
            volume = shells.volume(self.vertices[faces])
            require(
                abs(volume) > FLAT * self.size**3,
                "a shell of the mesh encloses nothing",
                instead=self.cure,
            )
            if volume < 0:
                n_reversed += len(faces)
                faces = faces[:, ::-1]
            outermost.append(faces)
        n_shells = _counted(int(is_enclosed.sum()), "shell")
        self.note(
            n_enclosed,
            "triangle",
            f"of {n_shells} inside another left out, because no grains touch them",
        )
        self.note(n_reversed, "triangle", "of shells that were inside out reversed")
        return outermost

    def keep_sheets(self, solids: list, sheets: list) -> list[np.ndarray]:
        """Return the triangles (F, 3) of sheets and of the outermost closed shells;
        Refusal if there is no sheet, or one nearly closes."""
        for part in sheets:
            require(
                not shells.nearly_closes(self.vertices, self.faces[part]),
                "closed = false is for sheets, but the mesh is almost closed",
                because="its inside would also carry stress",
                instead="leave closed = false out: its holes are then filled",
            )
        require(
            len(sheets) > 0,
            "closed = false is for sheets, but the mesh is closed",
            instead="leave closed = false out",
        )
        kept_shells = [self.faces[part] for part in sheets]
        if solids:
            kept_shells += self.outermost_shells([self.faces[part] for part in solids])
            self.note(len(solids), "closed shell", "next to sheets treated as solid")
        return kept_shells

    def merge_flat(self, faces: np.ndarray) -> np.ndarray:
        """Return the same surface without triangles of no area.

        Such a triangle and the one beyond its longest edge are replaced by the two on
        the other diagonal, again and again, until all have an area.
        """
        flat = np.flatnonzero(self.is_flat(faces))
        n_flat = len(flat)
        most_flips = 10 * n_flat if n_flat <= MOST_FLAT else 0
        for _ in range(most_flips):
            if not len(flat):
                break
            faces = self.flip_longest_edge(faces, flat)
            flat = np.flatnonzero(self.is_flat(faces))
        self.note(n_flat, "triangle", "without area merged with others")
        return faces

    def flip_longest_edge(self, faces: np.ndarray, flat: np.ndarray) -> np.ndarray:
        """Return faces after the longest edge of the triangles ``flat`` (indices)
        became the other diagonal of the quadrilateral that its two triangles form."""
        corners = self.vertices[faces[flat]]
        lengths = np.linalg.norm(np.roll(corners, -1, 1) - corners, axis=-1)
        which, side = np.unravel_index(lengths.argmax(), lengths.shape)
        one = int(flat[which])
        p, q, r = np.roll(faces[one], -side)
        beyond = np.argwhere((faces == q) & (np.roll(faces, -1, 1) == p))
        if not len(beyond):
            return np.delete(faces, one, axis=0)
        two, first = beyond[0]
        s = faces[two, (first + 2) % 3]
        if s == r:
            return np.delete(faces, [one, two], axis=0)
        faces = faces.copy()
        faces[one] = r, p, s
        faces[two] = s, q, r
        return faces

    def require_no_folds(self, faces: np.ndarray) -> None:
        """Raise Refusal if triangles are folded back on their neighbours."""
        a, b, c = np.moveaxis(self.vertices[faces], 1, 0)
        normals = np.cross(b - a, c - a)
        sizes = np.linalg.norm(normals, axis=-1)
        normals /= np.maximum(sizes, np.finfo(float).tiny)[:, None]
        pairs = shells.neighbours(faces)[0]
        cosine = (normals[pairs[:, 0]] * normals[pairs[:, 1]]).sum(-1)
        folded = pairs[cosine < FOLDED]
        share = sizes[folded].min(1).sum() / sizes.sum()
        require(
            share < FOLDS,
            f"{len(folded)} triangles are folded back on their neighbours",
            because="probably from polygons that are not convex",
            instead="export triangles from the program that created the mesh",
        )

    def is_flat(self, faces: np.ndarray) -> np.ndarray:
        """Return which triangles (F,) have no area but roundoff."""
        a, b, c = np.moveaxis(self.vertices[faces], 1, 0)
        areas = np.linalg.norm(np.cross(b - a, c - a), axis=-1) / 2
        return areas <= FLAT * self.size**2


def _proper(faces: np.ndarray) -> np.ndarray:
    """Return the triangles (F, 3) whose corners are three vertices."""
    a, b, c = faces.T
    return faces[(a != b) & (b != c) & (c != a)]
