"""Sound meshes from the triangles of files and models, with notes of what was mended.

Grains touch the outside of closed shells, and both sides of sheets. So shells inside
others, walls between parts and doubles are left out.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rft.core.refusal import Refusal, require
from rft.terradynamics.meshes import shells
from rft.terradynamics.meshes.mesh import FLAT, MOST_TRIANGLES, Mesh, require_known

SMALLEST = 1e-3  # m: a smaller mesh is a few grains large; assumed to be a wrong scale
LARGE = 1.0  # m: a larger one is noted
ROUNDINGS = (1e-7, 1e-6, 1e-5)  # of the size: distances within which corners are equal
SINGLE = 2.0**-23  # of a coordinate: rounding of single precision, that of STL files
FOLDED = -0.99999  # cosine of the angle between normals, 0.26 degrees from a fold
FOLDS = 1e-4  # of the surface: area of folds below which they are rounding
MOST_FLAT = 1000  # triangles without area that are merged, each in a search
MOST_WALLS = 20  # within a body, which are tried in turn
OPEN_CURE = "close it, or say closed = false if it is a sheet"


class Sound(NamedTuple):
    """A mesh, and notes (lines) of what was mended."""

    mesh: Mesh
    notes: tuple[str, ...]


def sound(
    vertices: np.ndarray, faces: np.ndarray, closed: bool = True, cure: str = OPEN_CURE
) -> Sound:
    """Return the sound mesh of triangles; Refusal if they enclose nothing.

    Corners within rounding are welded where triangles do not meet, holes are filled if
    the mesh nearly closes, triangles are turned to agree on which side is out.

    Parameters
    ----------
    vertices : (V, 3), m.
    faces : (F, 3), indices of vertices.
    closed : False for sheets, of which either side may lead (`Mesh.two_sided`). Shells
        that close are then solids all the same; refused if none is a sheet, or if one
        nearly closes.
    cure : what to do about a mesh that is open.

    Examples
    --------
    >>> import numpy as np
    >>> from rft.terradynamics.meshes import shapes, sound
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
        f"a mesh has 1 to {MOST_TRIANGLES:,} triangles, got {len(faces):,}",
    )
    require_known(faces, len(vertices))
    return _Mender(vertices, faces, cure).mended(closed)


def size_note(mesh: Mesh, cure: str) -> list[str]:
    """Return a note on a mesh of a size that is likely not meant, else none."""
    size = float(np.ptp(mesh.vertices, axis=0).max())
    if SMALLEST <= size <= LARGE:
        return []
    return [f"the mesh is {size:.3g} m large: {cure}"]


def _counted(count: int, noun: str) -> str:
    """Return a number with its noun, such as "2 holes"."""
    return f"{count:,} {noun}" if count == 1 else f"{count:,} {noun}s"


class _Mender:
    """Mends a mesh step by step, and keeps notes."""

    def __init__(self, vertices: np.ndarray, faces: np.ndarray, cure: str):
        self.cure = cure
        self.notes: list[str] = []
        self.vertices, index = np.unique(vertices, axis=0, return_inverse=True)
        self.faces = index.reshape(-1)[faces]
        self.size = float(np.ptp(self.vertices[self.faces], axis=(0, 1)).max())

    def note(self, count: int, noun: str, done: str) -> None:
        if count:
            self.notes.append(f"{_counted(count, noun)} {done}")

    def mended(self, closed: bool) -> Sound:
        self.drop_points()
        self.drop_doubles(closed)
        if self.weld():
            self.drop_doubles(closed)
        self.turn(closed)
        if closed:
            self.drop_single_walls()
        parts = shells.shells(self.faces)
        is_open = [len(shells.excess(self.faces[part])) > 0 for part in parts]
        solids = [part for part, loose in zip(parts, is_open) if not loose]
        sheets = [part for part, loose in zip(parts, is_open) if loose]
        if closed:
            kept = self.closed(solids, sheets)
        else:
            kept = self.with_sheets(solids, sheets)
        faces = self.without_flat(np.concatenate(kept))
        self.refuse_folds(faces)
        used, index = np.unique(faces, return_inverse=True)
        mesh = Mesh(self.vertices[used], index.reshape(-1, 3), closed)
        return Sound(mesh, tuple(self.notes))

    def drop_points(self) -> None:
        """Leave out triangles with equal corners, which close nothing."""
        a, b, c = self.faces.T
        proper = (a != b) & (b != c) & (c != a)
        flat = int((~proper).sum())
        require(
            bool(proper.any()),
            f"{flat} of {len(proper)} triangles have no area",
            because="clean the mesh",
        )
        self.faces = self.faces[proper]
        self.note(flat, "triangle", "without area left out")

    def weld(self) -> bool:
        """Weld corners of open edges within rounding; return whether that closes any."""
        from scipy.sparse import coo_matrix
        from scipy.sparse.csgraph import connected_components
        from scipy.spatial import cKDTree

        loose = self.loose(self.faces)
        if not len(loose):
            return False
        corners = np.unique([loose // len(self.vertices), loose % len(self.vertices)])
        rounding = 2 * SINGLE * float(np.abs(self.vertices[self.faces]).max())
        tree = cKDTree(self.vertices[corners])
        best = None
        for share in ROUNDINGS:
            distance = max(share * self.size, rounding)
            pairs = tree.query_pairs(distance, output_type="ndarray")
            if not len(pairs):
                continue
            graph = coo_matrix(
                (np.ones(len(pairs)), tuple(pairs.T)), (len(corners), len(corners))
            )
            _, label = connected_components(graph, directed=False)
            _, first = np.unique(label, return_index=True)
            target = np.arange(len(self.vertices))
            target[corners] = corners[first[label]]
            faces = target[self.faces]
            a, b, c = faces.T
            faces = faces[(a != b) & (b != c) & (c != a)]
            left = len(self.loose(faces))
            if len(faces) and (best is None or left < best[0]):
                best = left, faces, len(corners) - len(first), distance
        if best is None or best[0] >= len(loose):
            return False
        dropped = len(self.faces) - len(best[1])
        self.faces = best[1]
        self.notes.append(
            f"corners within {best[3]:.2g} m of others welded: {best[2]:,}"
        )
        self.note(dropped, "triangle", "without area left out")
        return True

    def loose(self, faces: np.ndarray) -> np.ndarray:
        """Return codes of the edges that an odd number of triangles share."""
        a, b = shells.directed_edges(faces).T
        codes = np.minimum(a, b) * len(self.vertices) + np.maximum(a, b)
        unique, uses = np.unique(codes, return_counts=True)
        return unique[uses % 2 == 1]

    def drop_doubles(self, closed: bool) -> None:
        """Leave out triangles that stand twice. Of triangles back to back one stays, if
        they are sheets, or if they close a surface, by themselves or with others."""
        a, b, c = self.faces.T
        is_even = np.sum([a < b, b < c, c < a], axis=0) == 2
        number = self.numbers()
        _, first = np.unique(2 * number + is_even, return_index=True)
        self.note(len(number) - len(first), "double triangle", "left out")
        self.faces = self.faces[np.sort(first)]
        back = self.back_to_back()
        if not len(back):
            return
        surface = self.faces[back[:, 0]]
        parts = shells.shells(surface)
        if closed:
            open_edges = self.loose(np.delete(self.faces, back.ravel(), axis=0))
            rims = [self.loose(surface[part]) for part in parts]
            parts = [p for p, rim in zip(parts, rims) if np.isin(rim, open_edges).all()]
        if parts:
            gone = back[np.concatenate(parts), 1]
            self.note(len(gone), "triangle", "back to back with others left out")
            self.faces = np.delete(self.faces, gone, axis=0)

    def numbers(self) -> np.ndarray:
        """Return the same whole number (F,) for triangles with the same corners."""
        low, middle, high = np.sort(self.faces, 1).T
        count = len(self.vertices)
        _, pair = np.unique(low * count + middle, return_inverse=True)
        _, number = np.unique(pair.reshape(-1) * count + high, return_inverse=True)
        return number.reshape(-1)

    def back_to_back(self) -> np.ndarray:
        """Return the pairs (P, 2) of triangles with the same corners."""
        number = self.numbers()
        uses = np.bincount(number)
        order = np.argsort(number, kind="stable")
        starts = np.cumsum(uses) - uses
        first = starts[uses == 2]
        return np.stack([order[first], order[first + 1]], -1)

    def turn(self, closed: bool) -> None:
        """Turn triangles so that neighbours agree on which side is out."""
        turned = shells.oriented(self.faces)
        if turned is None and not closed:
            return
        require(
            turned is not None,
            "the mesh has one side only, as a Moebius strip",
            instead="mend it in the program that made it",
        )
        self.faces[turned] = self.faces[turned][:, ::-1]
        self.note(int(turned.sum()), "triangle", "wound against the others turned")

    def drop_single_walls(self) -> None:
        """Leave out surfaces that end at edges of others, if a body closes without."""
        codes, _ = shells.edge_codes(self.faces)
        _, index, uses = np.unique(codes, return_inverse=True, return_counts=True)
        odd = (uses % 2 == 1) & (uses > 2)
        touched = odd[index.reshape(-1)].reshape(-1, 3).any(1)
        if not touched.any():
            return
        label = shells.pieces(self.faces)
        candidates = np.unique(label[touched])
        best = None
        for candidate in candidates[:MOST_WALLS]:
            rest = self.faces[label != candidate]
            if not len(rest) or len(shells.excess(rest)):
                continue
            size = abs(shells.volume(self.vertices[rest]))
            if best is None or size > best[0]:
                best = size, candidate, rest
        if best is None:
            return
        wall = self.faces[label == best[1]]
        middles = self.vertices[wall].mean(1)
        if (shells.winding(middles, self.vertices[best[2]]) != 0).all():
            self.note(len(wall), "triangle", "of a wall within the body left out")
            self.faces = best[2]

    def closed(self, solids: list, sheets: list) -> list[np.ndarray]:
        """Return the triangles (F, 3) of the outermost shells."""
        solids = [self.faces[part] for part in solids]
        filled = holes = inner = 0
        added_area = 0.0
        for part in sheets:
            faces = self.faces[part]
            if not shells.nearly_closes(self.vertices, faces):
                self.require_inside(faces, solids)
                inner += len(faces)
                continue
            self.vertices, added, count = shells.caps(self.vertices, faces)
            added_area += shells.area(self.vertices[added])
            solids.append(np.concatenate([faces, added]))
            filled += len(added)
            holes += count
        if holes:
            total = sum(shells.area(self.vertices[faces]) for faces in solids)
            self.note(
                holes,
                "hole",
                f"filled by {_counted(filled, 'triangle')}, "
                f"{100 * added_area / total:.2g} % of the surface",
            )
        self.note(inner, "triangle", "of open surfaces within the body left out")
        return self.outermost(solids)

    def require_inside(self, faces: np.ndarray, solids: list[np.ndarray]) -> None:
        """Raise Refusal unless an open surface lies inside closed shells."""
        middles = self.vertices[faces].mean(1)
        inside = np.zeros(len(middles), bool)
        for solid in solids:
            inside |= shells.winding(middles, self.vertices[solid]) != 0
        if not inside.all():
            count = len(shells.excess(faces))
            raise Refusal(
                "the mesh is open",
                because=f"{count} edges have one triangle",
                instead=self.cure,
            )

    def outermost(self, solids: list[np.ndarray]) -> list[np.ndarray]:
        """Return the shells that no other encloses, with their outside out."""
        count = sum(map(len, solids))
        solids = [shells.without_walls(self.vertices, faces) for faces in solids]
        count -= sum(map(len, solids))
        self.note(count, "triangle", "of walls within the body left out")
        enclosed = shells.is_enclosed(self.vertices, solids)
        kept = []
        hidden = turned = 0
        for faces, is_hidden in zip(solids, enclosed):
            if is_hidden:
                hidden += len(faces)
                continue
            content = shells.volume(self.vertices[faces])
            require(
                abs(content) > FLAT * self.size**3,
                "a shell of the mesh encloses nothing",
                instead=self.cure,
            )
            if content < 0:
                turned += len(faces)
            kept.append(faces if content > 0 else faces[:, ::-1])
        self.note(
            hidden,
            "triangle",
            f"of {_counted(int(enclosed.sum()), 'shell')} inside another left out, "
            "as no grains touch them",
        )
        self.note(turned, "triangle", "of shells that were inside out turned")
        return kept

    def with_sheets(self, solids: list, sheets: list) -> list[np.ndarray]:
        """Return the triangles of sheets, and of solids beside them."""
        for part in sheets:
            require(
                not shells.nearly_closes(self.vertices, self.faces[part]),
                "closed = false is for sheets, and the mesh nearly closes",
                because="its inside would bear, too",
                instead="leave closed = false out: its holes are then filled",
            )
        require(
            len(sheets) > 0,
            "closed = false is for sheets, and the mesh is closed",
            instead="leave closed = false out",
        )
        kept = [self.faces[part] for part in sheets]
        if solids:
            kept += self.outermost([self.faces[part] for part in solids])
            self.note(len(solids), "closed shell", "beside sheets taken as solid")
        return kept

    def without_flat(self, faces: np.ndarray) -> np.ndarray:
        """Return faces without triangles of no area, and with the same surface.

        Of such a triangle and the one beyond its longest edge, with the fourth corner,
        two others are made, until all have an area.
        """
        flat = np.flatnonzero(self.is_flat(faces))
        count = len(flat)
        for _ in range(10 * count if count <= MOST_FLAT else 0):
            if not len(flat):
                break
            faces = self.flipped(faces, flat)
            flat = np.flatnonzero(self.is_flat(faces))
        self.note(count, "triangle", "without area merged with others")
        return faces

    def flipped(self, faces: np.ndarray, flat: np.ndarray) -> np.ndarray:
        """Return faces after one turn of the longest edge of triangles ``flat``."""
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

    def refuse_folds(self, faces: np.ndarray) -> None:
        """Raise Refusal if triangles lie on their neighbours, back to back."""
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
            because="likely of polygons that are not convex",
            instead="write triangles in the program that made the mesh",
        )

    def is_flat(self, faces: np.ndarray) -> np.ndarray:
        a, b, c = np.moveaxis(self.vertices[faces], 1, 0)
        areas = np.linalg.norm(np.cross(b - a, c - a), axis=-1) / 2
        return areas <= FLAT * self.size**2
