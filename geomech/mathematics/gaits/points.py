"""A closed curve through given shapes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from geomech.mathematics.geometry.gait import GAITS, Gait, finite_array
from rft.core.checks import unmasked
from rft.core.notes import warn
from rft.core.refusal import Refusal

LARGEST_BULGE = 1 / 20  # of the size of a polygon: a larger one of the spline is noted


def checked_loop(points) -> tuple[tuple[float, ...], ...]:
    """Return at least three shapes, without the first where it is repeated at the end;
    Refusal unless neighbours are distinct."""
    loop = finite_array("points", points, 2)
    if np.array_equal(loop[0], loop[-1]):
        loop = loop[:-1]
    steps = np.linalg.norm(np.diff(loop, axis=0, append=loop[:1]), axis=1)
    if len(loop) < 3 or not (steps > 1e-12 * steps.sum()).all():
        raise Refusal(
            "points must be at least 3 shapes, and neighbours must differ",
            value=points,
        )
    return tuple(map(tuple, loop.tolist()))


@GAITS.register
@dataclass(frozen=True)
class Points(Gait):
    """The periodic cubic spline through given shapes, in order and back to the first.

    Phase runs with chord length. Corners become round, and between few points the curve
    bulges: a `Polygon` has straight sides.

    points (rad): shapes on the curve, three or more rows of joint angles.

    Examples
    --------
    >>> from geomech.mathematics.gaits import Points
    >>> loop = Points(((0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5), (0.5, -0.5)))
    >>> loop.shape(0.0).round(6)
    array([0.5, 0.5])
    """

    kind = "points"

    points: tuple[tuple[float, ...], ...]

    def __post_init__(self):
        object.__setattr__(self, "points", checked_loop(self.points))
        super().__post_init__()

    @property
    def joints(self) -> int:
        return len(self.points[0])

    def _spline(self):
        """Return the spline, a function of phases and an order of derivative."""
        from scipy.interpolate import CubicSpline

        loop = np.array([*self.points, self.points[0]])
        return CubicSpline(self._phases, loop, bc_type="periodic")

    @property
    def _phases(self) -> np.ndarray:
        """Phases of the points, and of the first once more."""
        loop = np.array([*self.points, self.points[0]])
        steps = np.linalg.norm(np.diff(loop, axis=0), axis=1)
        length = np.concatenate([[0.0], np.cumsum(steps)])
        return 2 * np.pi * length / length[-1]

    @property
    def bulge(self) -> float:
        """Largest distance of the spline from the side between its two points, over the
        diagonal of the box around the points: 0.012 for twelve points of a circle, 0.13
        for the four corners of a square."""
        phases = self._phases
        corners = np.array(self.points)
        share = np.linspace(0.0, 1.0, 17)[:, None]
        curve = self._spline()(phases[:-1] + share * np.diff(phases))
        sides = np.roll(corners, -1, 0) - corners
        from_corner = curve - corners
        along = (from_corner * sides).sum(-1) / (sides * sides).sum(-1)
        nearest = np.clip(along, 0.0, 1.0)[..., None] * sides
        farthest = np.linalg.norm(from_corner - nearest, axis=-1).max()
        diagonal = np.linalg.norm(corners.max(0) - corners.min(0))
        return float(farthest / diagonal)

    def note(self) -> None:
        """Warn (`Note`) where the spline leaves the polygon through its points."""
        bulge = self.bulge
        if bulge > LARGEST_BULGE:
            warn(
                f"[gait] points: the spline through {len(self.points)} shapes departs "
                f"from the polygon through them by {100 * bulge:.0f} % of its size: "
                "for straight sides use kind = 'polygon'; for a smooth curve give "
                "more points"
            )

    def unit(self, t: ArrayLike) -> np.ndarray:
        return self._spline()(unmasked("t", t))

    def unit_rate(self, t: ArrayLike) -> np.ndarray:
        return self._spline()(unmasked("t", t), 1)

    @classmethod
    def examples(cls) -> dict[str, Points]:
        right = ((1, 0), (0.75, 0.59), (0.15, 0.83), (-0.47, 0.56))
        left = ((-0.73, -0.03), (-0.47, -0.66), (0.09, -0.91), (0.7, -0.61))
        return {"points": cls(points=right + left)}
