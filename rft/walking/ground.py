"""What walkers stand on: a stress map for many robots at once, rounded at rest, with the inertia of grains."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rft.vertical.outline import Outline
from rft.vertical.stress import PlateStress


@dataclass(frozen=True, eq=False)
class Ground:
    """A stress map that is common to all samples, at unit strength. What differs is (B,).

    strength: times the map. flux: lambda rho, kg/m^3, of the grains' inertia. rounding: m/s; the stress on an element of
    speed v is that of the map times v / sqrt(v^2 + rounding^2), as the law itself, like dry friction, jumps at rest. The
    faces of a closed outline, (n,), lead by degrees, too: with v_n / sqrt(v_n^2 + s^2 (v^2 + rounding^2)), s the sine
    of the map's ``grazing``, so that what lies still on its belly feels no jump. width: times the rounding, and its
    root times the sine, on the way to a solution.
    """

    stress: PlateStress
    strength: np.ndarray
    flux: np.ndarray
    rounding: np.ndarray
    closed: np.ndarray | bool = False
    width: np.ndarray | float = 1.0

    def take(self, samples, closed: np.ndarray | bool = False) -> Ground:
        """Of these samples, as often as they are named; under elements of outlines that are closed, or of sheets."""
        width = self.width[samples] if np.ndim(self.width) else self.width
        return Ground(self.stress, self.strength[samples], self.flux[samples], self.rounding[samples], closed, width)

    def on(self, parts) -> tuple[np.ndarray, np.ndarray]:
        """Stress (x, z) in Pa on `rft.vertical.loads.Parts` (..., n), one for each of the samples."""
        t_x, t_z = self.stress.traction(parts.n, parts.v)
        fast = np.sqrt(parts.speed * parts.speed + (self.rounding * self.width) ** 2)
        share = self.strength * parts.depth * parts.speed / fast
        across = parts.speed * (parts.n[0] * parts.v[0] + parts.n[1] * parts.v[1])
        if np.any(self.closed):
            scale = np.sqrt(across * across + (np.sin(self.stress.grazing) * np.sqrt(self.width) * fast) ** 2)
            share = np.where(self.closed, share * across / np.where(scale == 0.0, 1.0, scale), share)
        if not self.flux.any():
            return share * t_x, share * t_z
        flux = np.where(parts.depth > 0.0, -self.flux * across * np.abs(across), 0.0)
        return share * t_x + flux * parts.n[0], share * t_z + flux * parts.n[1]


@dataclass(frozen=True, eq=False)
class Outlines:
    """Outlines of equally many elements, all closed or none: what `rft.vertical.loads` reads of one, stacked (B, ...), or
    (1, ...) where it is the same for all samples."""

    points: np.ndarray
    width: np.ndarray
    lengths: np.ndarray
    normals: np.ndarray
    bends: np.ndarray | None
    closed: bool

    @classmethod
    def of(cls, outlines: list[Outline]) -> Outlines:
        first = outlines[0]
        if all(o is first for o in outlines):
            outlines = [first]
        bends = None if first.bends is None else np.stack([o.bends for o in outlines])
        points, lengths, normals = (
            np.stack([getattr(o, x) for o in outlines]) for x in ("points", "lengths", "normals")
        )
        return cls(points, np.array([[o.width] for o in outlines]), lengths, normals, bends, first.closed)

    def take(self, samples) -> Outlines:
        """Of these samples, as often as they are named."""
        if len(self.points) == 1:
            return self
        bends = None if self.bends is None else self.bends[samples]
        cut = (x[samples] for x in (self.points, self.width, self.lengths, self.normals))
        return Outlines(*cut, bends, self.closed)

    def lowest(self, angle) -> np.ndarray:
        """(B,): height of the lowest point over the origin, turned by angles (B,)."""
        x, z = self.points[..., 0], self.points[..., 1]
        return (np.cos(angle)[:, None] * z - np.sin(angle)[:, None] * x).min(-1)
