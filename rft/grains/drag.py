"""Drag on a rod, its flank and its ends told apart by the force along it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rft.core.refusal import require
from rft.grains.experiment import Run

# half widths at either end that count as no flank: what a cap stirs up reaches so far
END = 2.5
# half widths of travel after which the drag is taken for steady; the first 10 mm of a
# 12 mm rod are not
SETTLED = 2.5
BLOCKS = 5  # parts of a steady drag, from whose scatter its error is computed


class Drag(NamedTuple):
    """Drag on a rod, along it and across it (2,), positive where it opposes the motion.

    flank: force on a length of flank, N/m. ends: force on both ends together beyond
    that of the flank, N: what the rod bears, less its whole length of flank. lift:
    upward force on the whole rod, N. flank_error, ends_error, lift_error: standard
    errors by the scatter of `BLOCKS` parts in time; beds differ by more."""

    flank: np.ndarray
    ends: np.ndarray
    lift: float
    flank_error: np.ndarray
    ends_error: np.ndarray
    lift_error: float


class Steady(NamedTuple):
    """Steady force on a body that is towed: mean (3,), N, and standard error by the
    scatter of `BLOCKS` parts; the mean force on each sphere (spheres, 3), N. lift: over
    drag, with its error."""

    force: np.ndarray
    error: np.ndarray
    profile: np.ndarray
    lift: float
    lift_error: float


def steady(run: Run, half_width: float, angle: float, speed: float) -> Steady:
    """Return the steady force on a body that was towed along a line, after `SETTLED`
    half widths. half_width (m): of the body. angle (rad): of its velocity from x. speed
    (m/s)."""
    kept = _steady(run, half_width, speed)
    blocks = np.array([f.mean(0) for f in np.array_split(run.force[kept], BLOCKS)])
    direction = np.array([np.cos(angle), np.sin(angle)])
    lift = blocks[:, 2] / -(blocks[:, :2] @ direction)
    mean = blocks.mean(0)
    return Steady(
        mean,
        _error(blocks),
        run.profile[kept].mean(0),
        float(mean[2] / -(mean[:2] @ direction)),
        float(_error(lift)),
    )


def _error(blocks: np.ndarray) -> np.ndarray:
    """Return the standard error of the mean of blocks (n, ...)."""
    return np.std(blocks, axis=0, ddof=1) / np.sqrt(len(blocks))


def _steady(run: Run, half_width: float, speed: float) -> np.ndarray:
    """Return which samples (n,) are of a steady drag; ValueError if they are too
    few."""
    kept = run.t * speed > SETTLED * half_width
    require(
        np.count_nonzero(kept) >= 4 * BLOCKS,
        f"{1e3 * run.t[-1] * speed:.0f} mm of travel are too few",
        instead=f"drag for {2e3 * SETTLED * half_width:.0f} mm or more",
    )
    return kept


def flank_and_ends(
    run: Run, length: float, half_width: float, angle: float, speed: float
) -> Drag:
    """Return the drag on a round rod that was towed along a line.

    length, half_width (m): of the rod, which lay along x. angle (rad): of its velocity
    from x. speed (m/s)."""
    kept = _steady(run, half_width, speed)
    reach = length / 2 - END * half_width
    flank = np.abs(run.along) < reach
    require(
        bool(flank.sum() >= 8),
        "the rod is too short to have a flank",
        instead="take one of ten radii or more",
    )
    spacing = np.diff(np.sort(run.along[flank])).mean()
    signs = np.array([-np.sign(np.cos(angle)) or -1.0, -np.sign(np.sin(angle)) or -1.0])
    blocks = np.array_split(run.profile[kept], BLOCKS)
    per_length = signs * [
        b[:, flank, :2].sum(1).mean(0) / (flank.sum() * spacing) for b in blocks
    ]
    whole = signs * [b[..., :2].sum(1).mean(0) for b in blocks]
    ends = whole - length * per_length
    lift = np.array([b[..., 2].sum(1).mean() for b in blocks])
    return Drag(
        per_length.mean(0),
        ends.mean(0),
        float(lift.mean()),
        _error(per_length),
        _error(ends),
        float(_error(lift)),
    )
