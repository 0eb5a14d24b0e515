"""Surfaces of rigid bodies that touch the ground, triangles in the frames of their
bodies, and the ground. SI units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, NamedTuple

import numpy as np

from rft.core.checks import Number, check_numbers
from rft.core.refusal import require
from rft.terradynamics.ground import Ground
from rft.terradynamics.meshes.extruded import Extruded
from rft.terradynamics.meshes.law import Spatial
from rft.terradynamics.meshes.mesh import Mesh
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
        return Ground(self.strength, self.flux, self.rounding, self.law.grazing_sine)


class Surface(NamedTuple):
    """A surface of one body. body: number of the body. corners: (T, 3, 3), m, and
    normals: (T, 3), unit vectors, of triangles in the body's frame. sheet: whether they
    are one side of a thin sheet, of which either side may lead. geom: number of the
    geom that the surface stands for; None for all geoms of the body."""

    body: int
    corners: np.ndarray
    normals: np.ndarray
    sheet: bool = False
    geom: int | None = None

    @classmethod
    def from_mesh(
        cls, body: int, mesh: Mesh, rotation=None, place=(0.0, 0.0, 0.0)
    ) -> Surface:
        """Return the surface of a mesh, a sheet if the mesh is open. rotation: (3, 3),
        and place: (3,), m, of the mesh's frame in that of the body."""
        matrix = (
            np.eye(3) if rotation is None else np.asarray(rotation, float).reshape(3, 3)
        )
        return cls(
            body,
            mesh.vertices[mesh.faces] @ matrix.T + place,
            mesh.middle_normals @ matrix.T,
            not mesh.closed,
        )

    @classmethod
    def from_outline(
        cls, body: int, outline: Outline, place=(0.0, 0.0, 0.0), side: int = 0
    ) -> Surface:
        """Return the surface of an outline of the vertical plane across its width, with
        the sides of a closed one.

        side: 0 for triangles in two halves that are mirror images; 1 and -1 for
        triangles in one piece, each the mirror image of the other."""
        edges = np.linspace(-outline.width / 2, outline.width / 2, 2 if side else 3)
        corners = [
            _strip(outline, a, b, (side or a + b) > 0) for a, b in pairwise(edges)
        ]
        near, far = (
            np.insert(outline.end_normals[:, k], 1, 0.0, axis=1) for k in (0, 1)
        )
        normals = [(1 - t) * near + t * far for t in (1 / 3, 2 / 3)] * len(corners)
        if outline.closed:
            corners += [_side(outline, y) for y in edges[[0, -1]]]
            normals += [
                np.tile([0.0, y, 0.0], (outline.elements - 2, 1)) for y in (-1.0, 1.0)
            ]
        normals = np.concatenate(normals)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        return cls(body, np.concatenate(corners) + place, normals, not outline.closed)


def _strip(outline: Outline, low: float, high: float, left: bool) -> np.ndarray:
    """Return triangles (2 N, 3, 3) of an outline from y = low to high, two for each
    element."""
    low, high = (np.insert(outline.points, 1, y, axis=1) for y in (low, high))
    a = low[:-1]
    b = low[1:]
    c = high[1:]
    d = high[:-1]
    first, second = ((a, d, b), (b, d, c)) if left else ((a, d, c), (a, c, b))
    return np.concatenate([np.stack(first, 1), np.stack(second, 1)])


def _side(outline: Outline, y: float) -> np.ndarray:
    """Return a fan of triangles (N - 2, 3, 3) in the plane at y, with normals away from
    the middle."""
    ring = np.insert(outline.points[:-1], 1, y, axis=1)
    first = np.broadcast_to(ring[0], ring[2:].shape)
    return np.stack(
        [first, ring[1:-1], ring[2:]] if y < 0 else [first, ring[2:], ring[1:-1]], 1
    )


class Facets:
    """All surfaces that touch the ground.

    bodies: (B,), numbers of their bodies, in the order of all arrays over bodies.
    corners: (T, 3, 3), m, of triangles in their bodies' frames. owner: (T,), index into
    ``bodies`` of each triangle. reach: (B,), m, of the farthest corner from its body's
    origin."""

    def __init__(self, surfaces: Sequence[Surface]):
        require(len(surfaces) > 0, "no geoms that touch the ground")
        surfaces = sorted(surfaces, key=lambda s: s.body)
        self.bodies, counts = np.unique([s.body for s in surfaces], return_inverse=True)
        sizes = [len(s.corners) for s in surfaces]
        self.corners = np.concatenate([s.corners for s in surfaces])
        self.owner = np.repeat(counts, sizes)
        first = np.searchsorted(self.owner, np.arange(len(self.bodies)))
        self.reach = np.maximum.reduceat(
            np.linalg.norm(self.corners, axis=2).max(1), first
        )

    def heights(self, rotation, place) -> np.ndarray:
        """Return the heights (T, 3), m, of the corners for rotations (B, 3, 3) and
        places (B, 3) of the bodies."""
        return (
            np.einsum("tcj,tj->tc", self.corners, rotation[self.owner, 2])
            + place[self.owner, 2:]
        )
