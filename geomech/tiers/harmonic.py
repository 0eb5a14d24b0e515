"""The harmonic tier: the odd harmonics of the velocity in the direction of alphadot, looked up along the gait."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from geomech.geometry import harmonics
from geomech.tiers.path import Path, around, axes, fits, path, zeros

HIGHEST = {2: 15, 3: 9}  # by joints, if [numerics] harmonics is left out
FEW = 5  # of more: 56 coefficients of each component of four joints, 126 of five


class Harmonic(Path):
    """The path tier with what the velocity has beyond its linear part."""

    name, label = "harmonic", "path integral, odd harmonics"
    style = {"color": "#009E73", "linestyle": ":"}
    joints, offered = range(2, 6), range(2, 3)  # of more joints by name: the table is large
    takes_joints, instead = (
        "takes two to five joints, and of more there are too many harmonics",
        "use path, adapted or direct",
    )
    looks_up = "harmonics"
    depends_on = ("grid", "extent", "harmonics", "interpolation")
    whole = True

    def directions(self, system, numerics) -> int:
        """Enough above the highest harmonic for folding to stay small."""
        highest = self.highest(system, numerics)
        return max(24, (8 * highest) // 5) if system.joints == 2 else 2 * harmonics.terms(system.joints, highest)

    def highest(self, system, numerics) -> int:
        """Of the harmonics that are kept."""
        return numerics.harmonics or HIGHEST.get(system.joints, FEW)

    def around(self, system, numerics) -> bool:
        return False

    def axes(self, system, numerics) -> tuple:
        d, n = system.joints, numerics.grid
        if around(system, numerics):
            raise ValueError(
                f"harmonics of {d} joint rates need a field, and one of {n}^{d} shapes is too large: lower [numerics] grid, to "
                f"{fits(d)} or less, or use path, adapted or direct, which need none"
            )
        return axes(system, numerics)

    def table(self, system, numerics, *reach, progress=None) -> Any:
        if own := system.stored(self.looks_up):
            return own
        count, degree = self.directions(system, numerics), numerics.interpolation
        grid = self.axes(system, numerics)
        known = {"highest": self.highest(system, numerics), "traits": system.traits}
        return harmonics.fit(system.velocity, grid, count, degree, progress, **known)

    def size(self, system, numerics) -> int:
        return (self._terms(system, numerics) + 1) * 3 * numerics.grid**system.joints

    def _terms(self, system, numerics) -> int:
        return harmonics.terms(system.joints, self.highest(system, numerics))

    def sample(self, system, numerics) -> Callable | None:
        field, d = zeros(system, numerics, (3, self._terms(system, numerics))), system.joints
        table = harmonics.Harmonics(field.axes, field.values, field.values[:, 0], field.degree)
        return lambda n: table.velocity(np.zeros((n, d)), np.ones((n, d)))

    def predict(self, table, system, gait, amplitudes, numerics) -> np.ndarray:
        return path(system.velocity if self.is_direct(system) else table.velocity, gait, amplitudes, numerics.phases)
