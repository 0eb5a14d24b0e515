"""A connection adapted to one family of gaits: the scaled copies alpha = centre + a
unit(t) of a closed curve.

The uniform least-squares connection spreads its misfit over all directions of alphadot.
A family uses one direction at each shape, so there a connection can be exact: in the
coordinates (a, t) of the family A_t(a, t) is the velocity itself, and A_a, across the
curves, is free, since no gait of the family ever moves that way. The freedom is spent
on the frame: the body frame is turned back by all the heading that the body gains along
each curve, and A_a = 0 is chosen. In that frame nothing turns, so the bracket is 0, and

    CCF = dA_t / da    per unit of a and t;

Its integral over 0 .. a and one cycle is the displacement, to any order in a, beyond
that of the curve at 0, which moves only where the gait winds. Where the
body has a net turn the frame does not close: it is cut at phase 0, and the turn is
spread evenly along the curve. The only approximation is the table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from geomech.core import summary
from geomech.core.work import Map, each
from geomech.mathematics.geometry.connection import SAMPLES_TOGETHER, Velocity, evaluate
from geomech.mathematics.geometry.gait import Gait, checked_gait
from geomech.mathematics.geometry.periods import ends_differ
from geomech.mathematics.geometry.reconstruct import displacement, turning
from rft.core.checks import in_range, real_array
from rft.core.refusal import Refusal
from rft.formulas import se2


@dataclass(frozen=True, eq=False)
class Family:
    """Velocities along the curves of a family.

    gait: its curve. amplitudes: (M,), ascending, 0 among them. xi: (M, N, 3), body
    velocity with respect to phase at N equally spaced phases. Either side of 0 has its
    own spline, because the velocity has a kink where rates change sign."""

    gait: Gait
    amplitudes: np.ndarray
    xi: np.ndarray

    def __repr__(self) -> str:
        curves, phases = self.xi.shape[:2]
        amplitudes = summary.span(self.amplitudes)
        return (
            f"Family({curves} curves of {self.gait!r},"
            f" amplitudes {amplitudes}, {phases} phases)"
        )

    @cached_property
    def phases(self) -> np.ndarray:
        """Phases (N,) of the velocities, rad."""
        return 2 * np.pi * np.arange(self.xi.shape[1]) / self.xi.shape[1]

    @cached_property
    def heading(self) -> np.ndarray:
        """Heading (M, N) of the body in the family's frame, rad; of zero mean over each
        curve from phase 0 to 2 pi."""
        return turning(self.xi) + self._mean_turning * (self.phases - np.pi)

    @property
    def _mean_turning(self) -> np.ndarray:
        """Mean xi_theta (M, 1) of each curve."""
        return self.xi[..., 2].mean(-1, keepdims=True)

    def _sides(self, values: np.ndarray):
        """Yield (sign, nodes, spline through values (M, ...) in |amplitude|) on each
        side of 0 that has curves."""
        from scipy.interpolate import make_interp_spline

        for sign in (-1, 1):
            nodes = np.flatnonzero(sign * self.amplitudes >= 0)[::sign]
            if len(nodes) > 1:
                sizes = np.abs(self.amplitudes[nodes])
                yield sign, nodes, make_interp_spline(sizes, values[nodes], 3)

    def area(self, amplitudes) -> np.ndarray:
        """Return the net pose (..., 3) of a cycle from phase 0, in the body frame at
        the start.

        It is the CCF's integral, which the table has exactly at each of its curves.
        ValueError for amplitudes off the table."""
        a = real_array("amplitudes", amplitudes)
        low, high = self.amplitudes[[0, -1]]
        if not ((a >= low * (1 + 1e-12)) & (a <= high * (1 + 1e-12))).all():
            raise Refusal(
                f"amplitudes must lie from {low:g} to the largest of the family, "
                f"{high:g}, got {a.ravel()[:4]}"
            )
        x, y, turn = displacement(self.xi).T
        start = self.heading[:, 0]
        at_curves = np.stack([*se2.rotated(start, x, y), turn, start], -1)
        at_zero = at_curves[np.flatnonzero(self.amplitudes == 0)[0]]
        integral = np.broadcast_to(at_zero, (*a.shape, 4)).copy()
        for sign, _, spline in self._sides(at_curves):
            on_side = sign * a > 0
            integral[on_side] = spline(np.abs(a[on_side]))
        x, y, turn, start = np.moveaxis(integral, -1, 0)
        return np.stack([*se2.rotated(-start, x, y), turn], -1)


def fit(
    velocity: Velocity,
    gait: Gait,
    largest: float,
    count: int = 24,
    phases: int = 128,
    progress: Callable | None = None,
    *,
    least: float = 0.0,
    map: Map = each,
) -> Family:
    """Fit the family of ``gait`` up to the amplitude ``largest`` (> 0), from ``count``
    curves of ``phases`` shapes.

    With a negative ``least`` there are as many curves down to that amplitude, reflected
    through the centre; largest may then be 0. The fit is of order 4 in 1/count and
    spectral in phases where the velocity is smooth; of about order 2 in both across
    kinks. map: as the builtin, over groups of curves."""
    checked_gait(gait)
    in_range("least amplitude", least, -1e300, 0.0)
    smallest = 0.0 if least < 0 else 1e-300
    in_range("largest amplitude", largest, smallest, 1e300)
    in_range("curves", count, 4, 1e6, whole=True)
    in_range("phases", phases, 4, 1e9, whole=True)
    count = int(count)
    phases = int(phases)
    below = _equal_steps(least, count)
    above = _equal_steps(largest, count)
    amplitudes = np.concatenate([below[::-1], [0.0], above])

    xi = np.zeros((len(amplitudes), phases, 3))
    moving = np.flatnonzero(amplitudes)
    if ends_differ(gait):  # it winds, and moves at amplitude 0 as well
        moving = np.arange(len(amplitudes))
    step = max(1, SAMPLES_TOGETHER // phases)
    groups = [moving[k : k + step] for k in range(0, len(moving), step)]
    cycles = [gait.cycle(phases, amplitudes[group]) for group in groups]
    for group, velocities in zip(groups, map(partial(_along, velocity), cycles)):
        xi[group] = velocities
        if progress:
            progress((group[-1] + 1) / (moving[-1] + 1))
    return Family(gait, amplitudes, xi)


def _equal_steps(last: float, count: int) -> np.ndarray:
    """Return ``count`` amplitudes in equal steps from 0, without it, to ``last``; none
    for a last of 0."""
    if not last:
        return np.zeros(0)
    return last * np.arange(1, count + 1) / count


def _along(velocity: Velocity, cycles: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Return xi (..., N, 3) along cycles (alpha, alphadot)."""
    return evaluate(velocity, *cycles)
