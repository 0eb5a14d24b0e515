"""Force and moment of grains on many rigid bodies at once, and how they change with the bodies' motion.

The surfaces of all bodies are triangles, told in the frames of their bodies. Everything is summed about the bodies' origins
and told along the axes of the world, z = 0 the surface and z up. SI units.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from rft.media.base import check_ranges, require, shown
from rft.spatial.extruded import Extruded
from rft.spatial.law import Spatial
from rft.spatial.mesh import Mesh
from rft.spatial.submerged import submerged
from rft.vertical.outline import Outline

NUDGE = 1e-3  # times the rounding, for differences


@dataclass(frozen=True)
class Grains:
    """What the bodies touch. law: `Extruded`, a map of the vertical plane, or `Spatial`. strength: times its stress. flux:
    lambda rho, kg/m^3, of the grains' inertia. rounding: m/s, below which stress falls off in proportion to speed."""

    law: Extruded | Spatial
    strength: float = 1.0
    flux: float = 0.0
    rounding: float = 3e-3

    def __post_init__(self):
        require(isinstance(self.law, Extruded | Spatial), f"law must be an Extruded or Spatial, got {shown(self.law)}")
        check_ranges(self, strength=(0.0, 1e9), flux=(0.0, 1e9), rounding=(1e-7, 10.0))

    def stress(self, n, v, sheet) -> tuple[np.ndarray, np.ndarray]:
        """Of faces with unit normals n (3, N) and velocities v (3, N): stress per depth, N/m^3 (3, N), and stress besides,
        Pa (3, N). sheet (N,): whether they are of a thin sheet, either side of which may lead."""
        speed = np.sqrt((v * v).sum(0))
        fast, along = np.sqrt(speed * speed + self.rounding**2), (n * v).sum(0)
        share = speed / fast * self.law.share(along / fast, sheet) * self.strength
        per = self.law.traction(n, v / np.where(speed > 0.0, speed, 1.0)) * share
        into = np.where(sheet, along, np.maximum(along, 0.0))
        return per, -self.flux * into * np.abs(into) * n


class Surface(NamedTuple):
    """Of one body: corners (T, 3, 3) and unit normals (T, 3) of triangles in the body's frame, m; sheet: whether they are a
    thin sheet, either side of which may lead, and which is given once. geom: the number of the geom that they stand for; None
    for all of the body's."""

    body: int
    corners: np.ndarray
    normals: np.ndarray
    sheet: bool = False
    geom: int | None = None

    @classmethod
    def of_mesh(cls, body: int, mesh: Mesh, rotation=None, place=(0.0, 0.0, 0.0)) -> Surface:
        """A mesh whose frame is turned (3, 3) and moved (3,) in that of the body; an open one is a sheet."""
        turn = np.eye(3) if rotation is None else np.asarray(rotation, float).reshape(3, 3)
        return cls(body, mesh.vertices[mesh.faces] @ turn.T + place, mesh.facing @ turn.T, not mesh.closed)

    @classmethod
    def of_outline(cls, body: int, outline: Outline, place=(0.0, 0.0, 0.0), side: int = 0) -> Surface:
        """An outline of the vertical plane across its width, and the sides of a closed one. side: 0 cuts it along its middle
        in halves that are mirror images; 1 and -1 are cut in one piece each, the one the mirror image of the other."""
        edges = np.linspace(-outline.width / 2, outline.width / 2, 2 if side else 3)
        corners = [_strip(outline, a, b, (side or a + b) > 0) for a, b in pairwise(edges)]
        near, far = (np.insert(outline.end_normals[:, k], 1, 0.0, axis=1) for k in (0, 1))
        normals = [(1 - t) * near + t * far for t in (1 / 3, 2 / 3)] * len(corners)
        if outline.closed:
            corners += [_side(outline, y) for y in edges[[0, -1]]]
            normals += [np.tile([0.0, y, 0.0], (outline.elements - 2, 1)) for y in (-1.0, 1.0)]
        normals = np.concatenate(normals)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        return cls(body, np.concatenate(corners) + place, normals, not outline.closed)


def _strip(outline: Outline, low: float, high: float, left: bool) -> np.ndarray:
    """(2 N, 3, 3): of an outline from y = low to high, two triangles an element, one on each of its ends."""
    low, high = (np.insert(outline.points, 1, y, axis=1) for y in (low, high))
    a, b, c, d = low[:-1], low[1:], high[1:], high[:-1]
    first, second = ((a, d, b), (b, d, c)) if left else ((a, d, c), (a, c, b))
    return np.concatenate([np.stack(first, 1), np.stack(second, 1)])


def _side(outline: Outline, y: float) -> np.ndarray:
    """(N - 2, 3, 3): a fan of triangles in the plane at y, looking away from the middle."""
    ring = np.insert(outline.points[:-1], 1, y, axis=1)
    first = np.broadcast_to(ring[0], ring[2:].shape)
    return np.stack([first, ring[1:-1], ring[2:]] if y < 0 else [first, ring[2:], ring[1:-1]], 1)


class Poses(NamedTuple):
    """Of B bodies: rotation (B, 3, 3), place (B, 3), velocity (B, 3) and spin (B, 3) in the world."""

    rotation: np.ndarray
    place: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray


class Facets:
    """All surfaces; ``bodies``: (B,) the numbers they name, in the order of what is given and returned. A triangle whose
    corners turn clockwise seen from where its normal points counts as negative."""

    def __init__(self, surfaces: Sequence[Surface]):
        require(len(surfaces) > 0, "no geoms that touch the ground")
        surfaces = sorted(surfaces, key=lambda s: s.body)
        self.bodies, counts = np.unique([s.body for s in surfaces], return_inverse=True)
        sizes = [len(s.corners) for s in surfaces]
        self.corners = np.concatenate([s.corners for s in surfaces])
        self.normals = np.concatenate([s.normals for s in surfaces])
        self.sheet, self.of = np.repeat([s.sheet for s in surfaces], sizes), np.repeat(counts, sizes)
        a, b, c = self.corners.swapaxes(0, 1)
        across = np.cross(b - a, c - a)
        self.areas = np.copysign(np.linalg.norm(across, axis=1) / 2, (across * self.normals).sum(1))
        self.first = np.searchsorted(self.of, np.arange(len(self.bodies)))
        self.reach = np.maximum.reduceat(np.linalg.norm(self.corners, axis=2).max(1), self.first)

    def heights(self, rotation, place) -> np.ndarray:
        """(T, 3): of the corners."""
        return np.einsum("tcj,tj->tc", self.corners, rotation[self.of, 2]) + place[self.of, 2:]

    def loads(self, grains: Grains, at: Poses, k: float | None = None) -> tuple[np.ndarray, np.ndarray | None]:
        """Wrenches (B, 6), force and moment, and, with a time k (s), their slopes (B, 6, 6) by velocity and spin of bodies
        whose poses change by k times that, else None."""
        heights = self.heights(at.rotation, at.place)
        some = np.flatnonzero((heights < 0.0).any(1))
        count = len(self.bodies)
        if not some.size:
            return np.zeros((count, 6)), None if k is None else np.zeros((count, 6, 6))
        of, turn = self.of[some], at.rotation[self.of[some]]
        r = np.einsum("tij,tcj->ict", turn, self.corners[some])[:, :, None]  # (xyz, corner, column, triangle)
        n = np.einsum("tij,tj->it", turn, self.normals[some])[:, None]
        heights = heights[some].T[:, None]
        v, spin = at.velocity[of].T[:, None], at.spin[of].T[:, None]
        if k is not None:
            nudge = grains.rounding * NUDGE / np.stack([np.ones(count), self.reach])
            dv, dw = np.zeros((3, 7, len(of))), np.zeros((3, 7, len(of)))
            for j in range(3):
                dv[j, 1 + j], dw[j, 4 + j] = nudge[0, of], nudge[1, of]
            turned = k * dw
            r = r + _cross(turned[:, None], r)
            heights = heights + k * dv[2] + (r[2] - r[2, :, :1])
            n, v, spin = n + _cross(turned, n), v + dv, spin + dw
        wrench = self._summed(grains, some, of, r, heights, n, v, spin)
        if k is None:
            return wrench[:, 0], None
        change = (wrench[:, 1:] - wrench[:, :1]) / np.repeat(nudge, 3, 0).T[:, :, None]
        return wrench[:, 0], change.swapaxes(1, 2)

    def _summed(self, grains, some, of, r, heights, n, v, spin) -> np.ndarray:
        """(B, C, 6): of C columns."""
        share, middle, moments = submerged(heights)
        x, arms = (middle * r).sum(1), (moments * r).sum(1)
        v, n = np.broadcast_arrays(v + _cross(spin, x), n)
        flat = lambda y: y.reshape(3, -1)
        sheet = np.broadcast_to(self.sheet[some], share.shape).ravel()
        per, besides = (y.reshape(v.shape) * self.areas[some] for y in grains.stress(flat(n), flat(v), sheet))
        force, moment = per * moments.sum(0), _cross(arms, per)
        if grains.flux:
            besides = besides * share
            force, moment = force + besides, moment + _cross(x, besides)
        out = np.zeros((len(self.bodies), share.shape[0], 6))
        first = np.flatnonzero(np.diff(of, prepend=-1))
        sums = np.add.reduceat(np.concatenate([force, moment]), first, axis=2)
        out[of[first]] = sums.transpose(2, 1, 0)
        return out

    def rounded(self, grains: Grains, wider: float) -> Grains:
        return replace(grains, rounding=wider * grains.rounding)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a x b, components first."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        np.subtract(a[j] * b[k], a[k] * b[j], out=out[i])
    return out
