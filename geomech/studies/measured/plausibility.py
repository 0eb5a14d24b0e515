"""Plausibility of a log: a heading in degrees, positions in mm, times in ms, a
left-handed frame."""

from __future__ import annotations

import numpy as np

from geomech.core.errors import UnitWarning
from geomech.mathematics.geometry.representations.tube import Loop
from geomech.studies.measured import regression
from geomech.studies.measured.log import Log
from geomech.studies.measured.smooth import Smoothed
from rft.core.notes import warn

# Rad of the heading per rad of the joints, rms: no link turns much faster than its
# joints.
FASTEST_TURN = 4.0
# Body lengths per rad of the joints, rms: 0.02 to 0.07 in sand and fluid.
FASTEST_MOTION = 2.0
LONGEST_CYCLE = 300.0  # s
HARMONICS = 3  # of the body velocity over the phase, for the test of handedness
# Residual of the mirror image over that of the velocity itself in a left-handed frame.
MIRRORED = 0.5


def note_units(
    log: Log, joints: Smoothed, pose: Smoothed, period: float, length: float | None
) -> None:
    """Warn of numbers that are likely in another unit. length: of the body, m; None for
    a log in body lengths."""
    joint_speed = _rms(joints.rates)
    speed = _rms(pose.rates[:, :2])
    if length is not None:
        speed = speed / length
    turning = _rms(pose.rates[:, 2:])
    notes = []
    if turning > FASTEST_TURN * joint_speed:
        notes.append(
            f"the heading turns {turning / joint_speed:.3g} times as fast as the"
            " joints: end the name of its column in _deg if it is in degrees"
        )
    if speed > FASTEST_MOTION * joint_speed:
        notes.append(
            f"x and y move by {speed / joint_speed:.3g} body lengths while the joints "
            "turn by 1 rad: give them in body lengths, or in m with ``body_length``"
        )
    if length is None and log.metres:
        notes.append(
            "the column names give x and y in m, but they are assumed to be in body "
            "lengths: add ``body_length``"
        )
    if log.seconds and period > LONGEST_CYCLE:
        notes.append(
            f"the joints repeat every {period:.4g}, and t is assumed to be in s: "
            "convert it if it is in ms or counts frames"
        )
    for line in notes:
        warn(f"{log.name}: {line}", UnitWarning)


def _rms(rates: np.ndarray) -> float:
    """Return the rms over rows of |rates|, (N, n)."""
    return float(np.sqrt((rates**2).sum(-1).mean()))


def check_right_handed(
    log: Log, loop: Loop, phase: np.ndarray, joints: Smoothed, pose: Smoothed, count
) -> None:
    """Refuse a pose whose mirror image fits much better.

    In the body frame the velocity follows from phase and rate. If y or the heading has
    the wrong sign, that holds for velocities rotated by the heading in the wrong
    sense."""
    rows = np.flatnonzero(count >= 0)
    known = regression.columns(
        loop,
        phase[rows],
        joints.values[rows],
        joints.rates[rows],
        HARMONICS,
        regression.NOTHING,
    )
    velocity = pose.rates[rows, 0] + 1j * pose.rates[rows, 1]
    rotation = np.exp(-1j * pose.values[rows, 2])
    both = np.stack([velocity * rotation, velocity / rotation], -1)
    coefficients = np.linalg.lstsq(known.astype(complex), both, rcond=None)[0]
    residual = np.abs(both - known @ coefficients)
    plain, mirrored = (residual**2).sum(0)
    if mirrored < MIRRORED * plain:
        raise log.wrong(
            f"x, y and heading do not agree, {plain / mirrored:.3g} times worse than "
            "if mirrored",
            instead="give y pointing up (in images it points down), x and y in this "
            "order, and a heading that is counter-clockwise from x and does "
            "not drift",
        )
