"""Drag on a rod, separated into its flank and its ends by the force along it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rft.core.refusal import require
from rft.grains.experiment import Run

# Half widths at either end that do not count as flank: a cap stirs the grains up to
# there.
END = 2.5
# Half widths of travel after which the drag is taken for steady; the first 10 mm of a
# 12 mm rod are not.
UNSTEADY_TRAVEL = 2.5
BLOCKS = 5  # parts of a steady drag, from whose scatter its error is computed


class Drag(NamedTuple):
    """Drag on a rod, along it and across it (2,), positive where it opposes the motion.

    flank: force on a length of flank, N/m. ends: force on both ends together beyond
    that of the flank, N: the force on the rod, less its whole length of flank. lift:
    upward force on the whole rod, N. flank_error, ends_error, lift_error: standard
    errors by the scatter of `BLOCKS` parts in time; beds differ by more."""

    flank: np.ndarray
    ends: np.ndarray
    lift: float
    flank_error: np.ndarray
    ends_error: np.ndarray
    lift_error: float


class SteadyForce(NamedTuple):
    """Steady force on a body that is towed.

    force: (3,), mean, N. error: (3,), standard error by the scatter of `BLOCKS` parts.
    profile: (spheres, 3), mean force on each sphere, N. lift: over drag, with its
    error."""

    force: np.ndarray
    error: np.ndarray
    profile: np.ndarray
    lift: float
    lift_error: float


def steady_force(
    run: Run, half_width: float, angle: float, speed: float
) -> SteadyForce:
    """Return the steady force on a body that was towed along a line, after
    `UNSTEADY_TRAVEL` half widths.

    half_width (m): of the body. angle (rad): of its velocity from x. speed (m/s)."""
    is_steady = _steady_samples(run, half_width, speed)
    blocks = np.array_split(run.force[is_steady], BLOCKS)
    blocks = np.array([block.mean(0) for block in blocks])
    direction = np.array([np.cos(angle), np.sin(angle)])

    def lift_over_drag(force):
        return force[..., 2] / -(force[..., :2] @ direction)

    force = blocks.mean(0)
    return SteadyForce(
        force,
        error=_standard_error(blocks),
        profile=run.profile[is_steady].mean(0),
        lift=float(lift_over_drag(force)),
        lift_error=float(_standard_error(lift_over_drag(blocks))),
    )


def _standard_error(blocks: np.ndarray) -> np.ndarray:
    """Return the standard error of the mean of blocks (n, ...)."""
    return np.std(blocks, axis=0, ddof=1) / np.sqrt(len(blocks))


def _steady_samples(run: Run, half_width: float, speed: float) -> np.ndarray:
    """Return which samples (n,) are of a steady drag; ValueError if they are too
    few."""
    travel = run.t * speed
    is_steady = travel > UNSTEADY_TRAVEL * half_width
    require(
        np.count_nonzero(is_steady) >= 4 * BLOCKS,
        f"{1000.0 * travel[-1]:.0f} mm of travel are too short",
        instead=f"drag for {2e3 * UNSTEADY_TRAVEL * half_width:.0f} mm or more",
    )
    return is_steady


def flank_and_ends(
    run: Run, length: float, half_width: float, angle: float, speed: float
) -> Drag:
    """Return the drag on a round rod that was towed along a line.

    length, half_width (m): of the rod, which lay along x. angle (rad): of its velocity
    from x. speed (m/s)."""
    is_steady = _steady_samples(run, half_width, speed)
    is_flank = np.abs(run.arc_length) < length / 2 - END * half_width
    n_flank = is_flank.sum()
    require(
        bool(n_flank >= 8),
        "the rod is too short to have a flank",
        instead="use a length of ten radii or more",
    )
    flank_length = n_flank * np.diff(np.sort(run.arc_length[is_flank])).mean()

    # Forces along and across the rod, positive where they oppose the motion.
    signs = np.array([-np.sign(np.cos(angle)) or -1.0, -np.sign(np.sin(angle)) or -1.0])
    blocks = np.array_split(run.profile[is_steady], BLOCKS)
    on_flank = [block[:, is_flank, :2].sum(1).mean(0) for block in blocks]
    on_rod = [block[..., :2].sum(1).mean(0) for block in blocks]
    flank = signs * [force / flank_length for force in on_flank]
    ends = signs * on_rod - length * flank
    lift = np.array([block[..., 2].sum(1).mean() for block in blocks])
    return Drag(
        flank.mean(0),
        ends.mean(0),
        float(lift.mean()),
        flank_error=_standard_error(flank),
        ends_error=_standard_error(ends),
        lift_error=float(_standard_error(lift)),
    )
