"""A closed curve through given shapes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from geomech.geometry.gait import GAITS, Gait, finite_array
from rft.checks import unmasked
from rft.refusal import Refusal


@GAITS.register
@dataclass(frozen=True)
class Points(Gait):
    """The periodic cubic spline through given shapes, in order and back to the first, phase running with chord length.

    points (rad): three rows of joint angles or more.

    Examples
    --------
    >>> from geomech.gaits import Points
    >>> square = Points(((0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5), (0.5, -0.5)))
    >>> square.shape(0.0).round(6)
    array([0.5, 0.5])
    """

    kind = "points"

    points: tuple[tuple[float, ...], ...]

    def __post_init__(self):
        points = finite_array("points", self.points, 2)
        if np.array_equal(points[0], points[-1]):
            points = points[:-1]
        steps = np.linalg.norm(np.diff(points, axis=0, append=points[:1]), axis=1)
        if len(points) < 3 or not (steps > 1e-12 * steps.sum()).all():
            raise Refusal(
                "points must be at least 3 shapes, neighbours distinct",
                value=self.points,
            )
        object.__setattr__(self, "points", tuple(map(tuple, points.tolist())))
        super().__post_init__()

    @property
    def joints(self) -> int:
        return len(self.points[0])

    def _spline(self):
        from scipy.interpolate import CubicSpline

        loop = np.array([*self.points, self.points[0]])
        length = np.concatenate(
            [[0.0], np.cumsum(np.linalg.norm(np.diff(loop, axis=0), axis=1))]
        )
        return CubicSpline(2 * np.pi * length / length[-1], loop, bc_type="periodic")

    def unit(self, t: ArrayLike) -> np.ndarray:
        return self._spline()(unmasked("t", t))

    def unit_rate(self, t: ArrayLike) -> np.ndarray:
        return self._spline()(unmasked("t", t), 1)

    @classmethod
    def examples(cls) -> dict[str, Points]:
        return {"points": cls(points=((1, 0), (0.4, 0.8), (-0.7, 0.2), (-0.1, -0.9)))}
