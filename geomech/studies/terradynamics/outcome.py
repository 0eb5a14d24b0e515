"""What becomes of a robot that walks: whether it climbs, gets stuck, slips back, slides
down, sinks or falls. Outcomes that swimmers on slopes have as well have their names
(`geomech.studies.mechanics.outcome`)."""

from __future__ import annotations

import math

import numpy as np

from geomech.studies.mechanics.outcome import CLIMBS, SLIDES, SLIPS
from rft.terradynamics.walking import Walk
from rft.terradynamics.walking.planar.stride import STUCK

WALKS = "walks"
DESCENDS = "descends"
STAYS = "gets stuck"
TURNS = "turns round"
TIPS = "tips over"
SINKS = "sinks"
FLIES = "leaves the ground"
UNDECIDED = "undecided"
OUTCOMES = {
    WALKS: "on level ground, it ends the cycle ahead of where it began",
    CLIMBS: "it ends the cycle higher than it began",
    DESCENDS: "on ground that falls ahead of it, it ends the cycle ahead of where it "
    "began",
    STAYS: f"in a cycle it moves by less than {100 * STUCK:g} % of the reach of its "
    "legs",
    SLIPS: "it ends the cycle behind where it began",
    SLIDES: "no cycle repeats, and in each it moves farther downhill than in the last",
    TURNS: "it has turned by more than 90 degrees to the side",
    TIPS: "its body leans by more than 90 degrees",
    SINKS: "its whole body is below the surface",
    FLIES: "none of its parts can reach the ground",
    UNDECIDED: "its motion in a cycle, with its error, may have two of these outcomes",
}
OF_STATUS = {"flipped": TIPS, "sunk": SINKS, "airborne": FLIES}
# Of the last increase of the distance downhill to the one before, from which on it does
# not decay, assumed.
STEADY = 0.5
HALF_TURN = math.pi / 2  # rad


def outcome(walk: Walk, error: float, frequency: float, rise: float) -> str:
    """Return the outcome of a walk, a name of `OUTCOMES`.

    error: of its speed, m/s. frequency: of the gait, Hz. rise: angle by which the
    surface rises ahead of it, rad."""
    if walk.status in OF_STATUS:
        return OF_STATUS[walk.status]
    if abs(walk.turned) > HALF_TURN:
        return TURNS
    least = STUCK * walk.reach
    if _slides(walk, frequency, rise, least):
        return SLIDES
    distance = walk.speed_along / frequency
    error = error / frequency
    if abs(distance) + error < least:
        return STAYS
    # Also where the error is not known.
    if not abs(distance) - error >= least:
        return UNDECIDED
    if distance < 0.0:
        return SLIPS
    if rise == 0.0:
        return WALKS
    return CLIMBS if rise > 0.0 else DESCENDS


def _slides(walk: Walk, frequency: float, rise: float, least: float) -> bool:
    """Return whether a walk without a limit cycle gathers speed downhill: its last
    three cycles from rest go ever farther, by no less and less. least: m, distance of
    the last."""
    cycles = math.floor(walk.t[-1] * frequency + 1e-6)
    if walk.periodic or rise == 0.0 or cycles < 3:
        return False
    times = np.arange(cycles - 3, cycles + 1) / frequency
    x = np.interp(times, walk.t, walk.pose[:, 0])
    first, second, third = -np.sign(rise) * np.diff(x)
    return bool(
        third > least
        and third > second > first
        and third - second > STEADY * (second - first)
    )
