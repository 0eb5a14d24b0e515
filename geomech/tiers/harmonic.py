"""The harmonic tier: the odd harmonics of the velocity in the direction of alphadot, looked up along the gait."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from geomech import harmonics
from geomech.tiers.path import Path, axes, path, shapes, zeros


class Harmonic(Path):
    """The path tier with what the velocity has beyond its linear part."""

    name, label = "harmonic", "path integral, odd harmonics"
    style = {"color": "#009E73", "linestyle": ":"}
    joints = offered = range(2, 3)
    takes_joints, instead = "takes a body of two joints", "use path, adapted or direct"
    looks_up = "harmonics"
    depends_on = ("grid", "extent", "harmonics", "interpolation")
    whole = True

    def directions(self, system, numerics) -> int:
        """Enough above the highest harmonic for folding to stay small."""
        return max(24, (8 * numerics.harmonics) // 5)

    def table(self, system, numerics, *reach, progress=None) -> Any:
        if own := system.stored(self.looks_up):
            return own
        count, degree = self.directions(system, numerics), numerics.interpolation
        grid = axes(system, numerics)
        return harmonics.fit(system.velocity, grid, count, degree, progress, system.mirror, highest=numerics.harmonics)

    def solves(self, system, numerics, count, phases) -> int:
        return shapes(system, numerics) * self.directions(system, numerics)

    def size(self, system, numerics) -> int:
        return (numerics.harmonics + 2) * 3 * numerics.grid**2

    def sample(self, system, numerics) -> Callable | None:
        field = zeros(system, numerics, (3, numerics.harmonics + 1))
        table = harmonics.Harmonics(field.axes, field.values, field.values[:, 0], field.degree)
        return lambda n: table.velocity(np.zeros((n, 2)), np.ones((n, 2)))

    def predict(self, table, system, gait, amplitudes, numerics) -> np.ndarray:
        return path(system.velocity if self.is_direct(system) else table.velocity, gait, amplitudes, numerics.phases)
