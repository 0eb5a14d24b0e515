"""Bends of a body of equal elements from measured frames: from its curvature, or from
points along its midline."""

from __future__ import annotations

import numpy as np
from numpy.polynomial import legendre

from geomech.mathematics.gaits.frames import Frames

# Rad, between neighbouring elements, and between neighbouring chords from point to
# point.
LARGEST_BEND = np.pi / 2
# Of a frame's length about the mean: beyond it the tracking has lost a part of the
# body.
LENGTH_SPREAD = 0.2
NODES, WEIGHTS = legendre.leggauss(5)
# Passes that turn a spline's parameter into its arc length: the error is 1e-7 rad at 30
# points along a sandfish.
PASSES = 3


def bends(frames: Frames, elements: int, modes: int) -> np.ndarray:
    """Return the heading of each element minus the one before, (F, elements - 1), rad.

    modes: Legendre modes of the curvature along the body, fitted by least squares; 0:
    splines through the data."""
    _check_modes(frames, modes)
    centres = (np.arange(elements) + 0.5) / elements
    if "curvature" in frames.columns:
        heading = _from_curvature(frames, centres, modes)
    else:
        heading = _from_points(frames, centres, modes)
    angles = np.diff(heading)
    frame, bend = np.unravel_index(np.abs(angles).argmax(), angles.shape)
    largest = abs(angles[frame, bend])
    if not largest <= LARGEST_BEND:
        raise frames.wrong(
            f"at t = {frames.t[frame]:g} and s = {(bend + 1) / elements:.3g} "
            f"neighbouring elements form an angle of {largest:.3g} rad, more than "
            f"{LARGEST_BEND:.3g}",
            instead="correct that frame, or use more elements",
        )
    return angles


def _check_modes(frames: Frames, modes: int) -> None:
    """Refuse more modes than the rows of a frame determine."""
    # Polynomials through n equally spaced data are safe up to a degree of about 2
    # sqrt(n) (Runge).
    count = int(frames.counts.min())
    most = min(int(2 * np.sqrt(count)), count - 1)
    if modes not in range(most + 1):
        raise frames.wrong(
            f"keep_modes must be a whole number from 0 to {most} for {count} places",
            value=modes,
        )


def _from_curvature(frames: Frames, centres, modes: int) -> np.ndarray:
    """Return headings (F, elements) up to a constant for each frame: the exact integral
    of the spline, or of the modes."""
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

    heading = np.empty((len(frames.t), len(centres)))
    lengths = np.empty(len(frames.t))
    positions = frames.rows[:, -2] + 1j * frames.rows[:, -1]
    for k, (start, count) in enumerate(zip(frames.starts, frames.counts)):
        points = positions[start : start + count]
        _check_points(frames, start, points)
        s, tangent, lengths[k] = _arc(points)
        if modes:
            coefficients = legendre.legfit(2 * s - 1, tangent, modes)
            heading[k] = legendre.legval(2 * centres - 1, coefficients)
        else:
            heading[k] = CubicSpline(s, tangent)(centres)
    _check_lengths(frames, lengths)
    return heading


def _arc(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the shares s (P,) of arc length at which the spline through complex points
    (P,) passes them, its headings there, rad, and its length.

    They are of order 4 in the spacing, but of order 3 at the ends."""
    from scipy.interpolate import CubicSpline

    step = np.abs(np.diff(points))
    for _ in range(PASSES):
        u = np.concatenate([[0.0], np.cumsum(step)])
        curve = CubicSpline(u, points)
        speed = np.abs(curve(u[:-1, None] + step[:, None] * (NODES + 1) / 2, 1))
        step = step * (speed @ WEIGHTS) / 2
    return u / u[-1], np.unwrap(np.angle(curve(u, 1))), u[-1]


def _check_points(frames: Frames, start: int, points: np.ndarray) -> None:
    """Refuse points (P,) of a frame that coincide, or between which the midline turns
    too far."""
    chord = np.diff(points)
    same = np.flatnonzero(np.abs(chord) <= 1e-9 * np.abs(chord).sum())
    if same.size:
        raise frames.wrong(
            "the point coincides with its neighbour",
            start + same[0] + 1,
            instead="remove one of the two",
        )
    turn = np.abs(np.angle(chord[1:] / chord[:-1]))
    if turn.max() > LARGEST_BEND:
        raise frames.wrong(
            f"the midline bends by {turn.max():.3g} rad at this point, more than "
            f"{LARGEST_BEND:.3g}",
            int(start + turn.argmax() + 1),
            instead="order the points from tail to head, correct the frame, or give "
            "more points",
        )


def _check_lengths(frames: Frames, lengths: np.ndarray) -> None:
    """Refuse a frame whose midline (F,) is much longer or shorter than the mean."""
    share = lengths / lengths.mean()
    k = int(np.abs(share - 1).argmax())
    if abs(share[k] - 1) > LENGTH_SPREAD:
        raise frames.wrong(
            f"the midline at t = {frames.t[k]:g} is {share[k]:.3g} times as long as "
            f"the mean of all frames, a difference of more than {LENGTH_SPREAD:.0%}",
            frames.starts[k],
            instead="correct or remove that frame",
        )
