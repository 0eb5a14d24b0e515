"""Surfaces of rigid bodies that touch the ground, triangles in the frames of their
bodies, and the ground. SI units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from rft.core.checks import Number, check_numbers
from rft.core.refusal import require
from rft.terradynamics.ground import Ground
from rft.terradynamics.meshes.forces.extruded import Extruded
from rft.terradynamics.meshes.forces.law import Spatial
from rft.terradynamics.meshes.surfaces.mesh import Mesh
from rft.terradynamics.plates.outline import Outline


@dataclass(frozen=True)
class Grains:
    """The ground under the bodies. law: `Extruded`, a map of the vertical plane, or
    `Spatial`."""

    law: Extruded | Spatial
    strength: Annotated[float, Number(0, 1e9, "-", "factor of the law's stress")] = 1.0
    flux: Annotated[
        float, Number(0, 1e9, "kg/m^3", "lambda rho of the grains' inertia")
    ] = 0.0
    rounding: Annotated[
        float,
        Number(
            1e-7, 10, "m/s", "speed below which stress falls off in proportion to speed"
        ),
    ] = 3e-3
    downhill_loss: Annotated[
        float, Number(-1, 1, "-", "share of the strength lost in motion along +x")
    ] = 0.0

    def __post_init__(self):
        require(
            isinstance(self.law, Extruded | Spatial),
            "law must be an Extruded or Spatial",
            value=self.law,
        )
        check_numbers(self)

    @property
    def ground(self) -> Ground:
        """Ground under every face."""
        return Ground(
            self.strength,
            self.flux,
            self.rounding,
            self.law.grazing_sine,
            self.downhill_loss,
        )


class Surface(NamedTuple):
    """A surface of one body.

    body: number of the body. corners: (T, 3, 3), m, and normals: (T, 3), unit vectors,
    of triangles in the body's frame. sheet: whether they are one side of a thin sheet,
    of which either side may lead. geom: number of the geom that the surface stands for;
    None for all geoms of the body."""

    body: int
    corners: np.ndarray
    normals: np.ndarray
    sheet: bool = False
    geom: int | None = None

    @classmethod
    def from_mesh(
        cls, body: int, mesh: Mesh, rotation=None, place=(0.0, 0.0, 0.0)
    ) -> Surface:
        """Return the surface of a mesh, a sheet if the mesh is open.

        rotation: (3, 3), and place: (3,), m, of the mesh's frame in that of the
        body."""
        matrix = np.eye(3)
        if rotation is not None:
            matrix = np.asarray(rotation, float).reshape(3, 3)
        corners = mesh.vertices[mesh.faces] @ matrix.T + place
        normals = mesh.middle_normals @ matrix.T
        return cls(body, corners, normals, sheet=not mesh.closed)

    @classmethod
    def from_outline(
        cls, body: int, outline: Outline, place=(0.0, 0.0, 0.0), side: int = 0
    ) -> Surface:
        """Return the surface of an outline of the vertical plane across its width, with
        the sides of a closed one.

        side: 0 for triangles in two halves that are mirror images; 1 and -1 for
        triangles in one piece, each the mirror image of the other."""
        half_width = outline.width / 2
        if side:
            strips = [_strip(outline, -half_width, half_width, side > 0)]
        else:
            strips = [
                _strip(outline, -half_width, 0.0, False),
                _strip(outline, 0.0, half_width, True),
            ]
        corners = list(strips)
        normals = _strip_normals(outline) * len(strips)

        if outline.closed:
            n_triangles = outline.elements - 2
            for y, normal in ((-half_width, -1.0), (half_width, 1.0)):
                corners.append(_fan(outline, y))
                normals.append(np.tile([0.0, normal, 0.0], (n_triangles, 1)))
        normals = np.concatenate(normals)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        return cls(
            body, np.concatenate(corners) + place, normals, sheet=not outline.closed
        )


def _strip(outline: Outline, low: float, high: float, is_left: bool) -> np.ndarray:
    """Return triangles (2 N, 3, 3) of an outline from y = low to high, two for each
    element; those to the left are mirror images of those to the right."""
    near = np.insert(outline.points, 1, low, axis=1)
    far = np.insert(outline.points, 1, high, axis=1)
    a = near[:-1]
    b = near[1:]
    c = far[1:]
    d = far[:-1]
    if is_left:
        return np.concatenate([np.stack((a, d, b), 1), np.stack((b, d, c), 1)])
    return np.concatenate([np.stack((a, d, c), 1), np.stack((a, c, b), 1)])


def _strip_normals(outline: Outline) -> list[np.ndarray]:
    """Return normals (N, 3), not of unit length, of the first and of the second
    triangle of every element, at the triangles' middles."""
    begin = np.insert(outline.end_normals[:, 0], 1, 0.0, axis=1)
    end = np.insert(outline.end_normals[:, 1], 1, 0.0, axis=1)
    return [(1 - t) * begin + t * end for t in (1 / 3, 2 / 3)]


def _fan(outline: Outline, y: float) -> np.ndarray:
    """Return a fan of triangles (N - 2, 3, 3) in the plane at y, with normals away from
    the middle."""
    ring = np.insert(outline.points[:-1], 1, y, axis=1)
    first = np.broadcast_to(ring[0], ring[2:].shape)
    if y < 0:
        return np.stack([first, ring[1:-1], ring[2:]], 1)
    return np.stack([first, ring[2:], ring[1:-1]], 1)


class Facets:
    """All surfaces that touch the ground.

    bodies: (B,), numbers of their bodies, in the order of all arrays over bodies.
    corners: (T, 3, 3), m, of triangles in their bodies' frames. owner: (T,), index into
    ``bodies`` of each triangle. reach: (B,), m, of the farthest corner from its body's
    origin."""

    def __init__(self, surfaces: Sequence[Surface]):
        require(len(surfaces) > 0, "no geoms that touch the ground")
        surfaces = sorted(surfaces, key=lambda s: s.body)
        self.bodies, owner = np.unique([s.body for s in surfaces], return_inverse=True)
        self.corners = np.concatenate([s.corners for s in surfaces])
        self.owner = np.repeat(owner, [len(s.corners) for s in surfaces])
        first = np.searchsorted(self.owner, np.arange(len(self.bodies)))
        distance = np.linalg.norm(self.corners, axis=2).max(1)
        self.reach = np.maximum.reduceat(distance, first)

    def heights(self, rotation, place) -> np.ndarray:
        """Return the heights (T, 3), m, of the corners for rotations (B, 3, 3) and
        places (B, 3) of the bodies."""
        upwards = rotation[self.owner, 2]
        heights = np.einsum("tcj,tj->tc", self.corners, upwards)
        return heights + place[self.owner, 2:]
