"""A closed path of straight sides through given shapes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from geomech.mathematics.gaits.points import checked_loop
from geomech.mathematics.geometry.gait import GAITS, Gait


@GAITS.register
@dataclass(frozen=True)
class Polygon(Gait):
    """The straight sides between given shapes, in order and back to the first, such as
    Purcell's stroke, whose joints move one at a time.

    points (rad): corners of the polygon, three or more rows of joint angles.

    Each side takes a share of the phase by its length and is run from rest to rest, by
    the share 35 u^4 - 84 u^5 + 70 u^6 - 20 u^7 of it at the share u of its time: speed,
    acceleration and jerk are 0 at its ends. So the gait is smooth at its corners, and
    the displacement converges with order 4 in a fluid. The timing matters only to
    effects that depend on speed; the highest joint speed is 2.19 times the mean of its
    side.

    Examples
    --------
    >>> from geomech.mathematics.gaits import Polygon
    >>> square = Polygon(((0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5), (0.5, -0.5)))
    >>> square.shape([0.0, 0.785398]).round(3)  # a corner, and the middle of a side
    array([[0.5, 0.5],
           [0. , 0.5]])
    """

    kind = "polygon"

    points: tuple[tuple[float, ...], ...]

    def __post_init__(self):
        object.__setattr__(self, "points", checked_loop(self.points))
        super().__post_init__()

    @property
    def joints(self) -> int:
        return len(self.points[0])

    @property
    def harmonics(self) -> int:  # type: ignore[override]  # a number of most classes
        """The number of sides: a cycle has twice as many phases at least."""
        return len(self.points)

    def _along(self, t: ArrayLike) -> tuple[np.ndarray, ...]:
        """Return the corner before phases t (T...), (T..., joints), the side from there
        (T..., joints), its duration (T...) and the share u of it (T...)."""
        corners = np.array(self.points)
        sides = np.roll(corners, -1, 0) - corners
        duration = np.linalg.norm(sides, axis=1)
        duration *= 2 * np.pi / duration.sum()
        ends = np.cumsum(duration)
        phase = np.mod(np.asarray(t, float), 2 * np.pi)
        index = np.minimum(np.searchsorted(ends, phase, "right"), len(ends) - 1)
        u = 1.0 - (ends[index] - phase) / duration[index]
        return corners[index], sides[index], duration[index], np.clip(u, 0.0, 1.0)

    def unit(self, t: ArrayLike) -> np.ndarray:
        corner, side, _, u = self._along(t)
        share = u**4 * (35.0 - 84.0 * u + 70.0 * u**2 - 20.0 * u**3)
        return corner + share[..., None] * side

    def unit_rate(self, t: ArrayLike) -> np.ndarray:
        _, side, duration, u = self._along(t)
        return (140.0 * (u * (1.0 - u)) ** 3 / duration)[..., None] * side

    @classmethod
    def examples(cls) -> dict[str, Polygon]:
        return {"polygon": cls(points=((0.9, 0.5), (-0.4, 0.8), (-0.7, -0.6)))}
