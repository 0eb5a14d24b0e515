"""Bends of a body of equal elements from measured frames: from its curvature, or from points along its midline."""

from __future__ import annotations

import numpy as np
from numpy.polynomial import legendre

from geomech.gaits.frames import Frames

LARGEST_BEND = (
    np.pi / 2
)  # rad, between neighbouring elements, and between neighbouring chords from point to point
LENGTH_SPREAD = 0.2  # of a frame's length about the mean of all; beyond it the tracking has lost a part of the body
NODES, WEIGHTS = legendre.leggauss(5)
PASSES = 3  # of making a spline's parameter its own arc length; 1e-7 rad is left at 30 points along a sandfish


def bends(frames: Frames, elements: int, modes: int) -> np.ndarray:
    """Return the heading of each element minus that of the one before, (F, elements - 1), rad. modes: Legendre modes of
    the curvature along the body, fitted by least squares; 0: splines through the data."""
    _check_modes(frames, modes)
    centres = (np.arange(elements) + 0.5) / elements
    heading = (_from_curvature if "curvature" in frames.columns else _from_points)(
        frames, centres, modes
    )
    angles = np.diff(heading)
    worst = np.unravel_index(np.abs(angles).argmax(), angles.shape)
    if not abs(angles[worst]) <= LARGEST_BEND:
        raise frames.wrong(
            f"at t = {frames.t[worst[0]]:g} and s = {(worst[1] + 1) / elements:.3g} neighbouring "
            f"elements bend by {abs(angles[worst]):.3g} rad, more than {LARGEST_BEND:.3g}",
            instead="mend that frame, or take more elements",
        )
    return angles


def _check_modes(frames: Frames, modes: int) -> None:
    # Polynomials through equally spaced data are safe up to about twice the root of their number (Runge).
    count = int(frames.counts.min())
    most = min(int(2 * np.sqrt(count)), count - 1)
    if modes not in range(most + 1):
        raise frames.wrong(
            f"keep_modes must be a whole number from 0 to {most} for {count} places",
            value=modes,
        )


def _from_curvature(frames: Frames, centres, modes: int) -> np.ndarray:
    """Return headings (F, elements) up to a constant each: the exact integral of the spline, or of the modes."""
    from scipy.interpolate import CubicSpline

    curvature = frames.rows[:, 2].reshape(len(frames.t), -1)
    s = frames.rows[: curvature.shape[1], 1]
    if max(abs(s[0]), abs(s[-1] - 1)) > 1e-6:
        raise frames.wrong(
            f"s must run from 0 (tail) to 1 (head), got {s[0]:g} to {s[-1]:g}"
        )
    if modes:
        fitted = legendre.legfit(2 * s - 1, curvature.T, modes - 1)
        return legendre.legval(2 * centres - 1, legendre.legint(fitted) / 2)
    return CubicSpline(s, curvature, axis=1).antiderivative()(centres)


def _from_points(frames: Frames, centres, modes: int) -> np.ndarray:
    """Return headings (F, elements) of the splines through the points of each frame."""
    from scipy.interpolate import CubicSpline

    heading, lengths = np.empty((len(frames.t), len(centres))), np.empty(len(frames.t))
    place = frames.rows[:, -2] + 1j * frames.rows[:, -1]
    for k, (start, count) in enumerate(zip(frames.starts, frames.counts)):
        points = place[start : start + count]
        _check_points(frames, start, points)
        s, tangent, lengths[k] = _arc(points)
        if modes:
            heading[k] = legendre.legval(
                2 * centres - 1, legendre.legfit(2 * s - 1, tangent, modes)
            )
        else:
            heading[k] = CubicSpline(s, tangent)(centres)
    _check_lengths(frames, lengths)
    return heading


def _arc(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Return, of the spline through points (P,), complex, the shares s (P,) of its arc length at which it passes them,
    its headings at these, rad, and its length. Of order 4 in the spacing, but of order 3 at the ends."""
    from scipy.interpolate import CubicSpline

    step = np.abs(np.diff(points))
    for _ in range(PASSES):
        u = np.concatenate([[0.0], np.cumsum(step)])
        curve = CubicSpline(u, points)
        speed = np.abs(curve(u[:-1, None] + step[:, None] * (NODES + 1) / 2, 1))
        step = step * (speed @ WEIGHTS) / 2
    return u / u[-1], np.unwrap(np.angle(curve(u, 1))), u[-1]


def _check_points(frames: Frames, start: int, points: np.ndarray) -> None:
    chord = np.diff(points)
    same = np.flatnonzero(np.abs(chord) <= 1e-9 * np.abs(chord).sum())
    if same.size:
        raise frames.wrong(
            "the point is where its neighbour is",
            start + same[0] + 1,
            instead="drop one of the two",
        )
    turn = np.abs(np.angle(chord[1:] / chord[:-1]))
    if turn.max() > LARGEST_BEND:
        raise frames.wrong(
            f"the midline turns by {turn.max():.3g} rad at this point, more than {LARGEST_BEND:.3g}",
            int(start + turn.argmax() + 1),
            instead="order the points from tail to head, mend the frame, or give more points",
        )


def _check_lengths(frames: Frames, lengths: np.ndarray) -> None:
    share = lengths / lengths.mean()
    k = int(np.abs(share - 1).argmax())
    if abs(share[k] - 1) > LENGTH_SPREAD:
        raise frames.wrong(
            f"the midline at t = {frames.t[k]:g} is {share[k]:.3g} times as long as the mean of "
            f"all frames, off by more than {LENGTH_SPREAD:.0%}",
            frames.starts[k],
            instead="mend or drop that frame",
        )
