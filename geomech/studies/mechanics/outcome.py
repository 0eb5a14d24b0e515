"""What becomes of a body on a slope: whether it climbs, slips back, slides down or
rolls over."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from geomech.mathematics.gaits import Gait
from geomech.mathematics.systems.base import System
from geomech.mathematics.systems.capabilities import PartlyLifted, capability

CLIMBS = "climbs"
SLIPS = "slips back"
SLIDES = "slides down"
ROLLS = "rolls over"
OUTCOMES = {
    CLIMBS: "it ends the cycle higher than it began",
    SLIPS: "it ends the cycle no higher than it began",
    SLIDES: "at some phase no slow motion balances its weight",
    ROLLS: "at some phase its centre of mass lies beyond what supports it",
}


def slope_of(system: System) -> Any:
    """Return the slope (`rft.Slope`) on which a system moves; None on level ground."""
    return getattr(system, "slope", None)


def uphill(slope: Any, x: ArrayLike, y: ArrayLike) -> np.ndarray:
    """Return the distance (...) uphill along a slope of a displacement (x, y), in the
    frame at its start."""
    return np.cos(slope.towards) * x + np.sin(slope.towards) * y


def least_margin(system: System, gait: Gait, amplitudes: ArrayLike) -> np.ndarray:
    """Return the least support margin (B,) of a gait's cycle at amplitudes (B,), body
    lengths; inf for a body that cannot roll over. The heading is taken to stay that at
    the start."""
    amplitudes = np.atleast_1d(np.asarray(amplitudes, float))
    lifted = capability(system, PartlyLifted)
    if lifted is None or not can_roll(lifted):
        return np.full(len(amplitudes), np.inf)
    phases = max(64, 2 * gait.harmonics + 1)
    alpha, _ = gait.cycle(phases, amplitudes)
    flat = alpha.reshape(-1, alpha.shape[-1])
    margin = lifted.contact_state(flat, np.zeros(len(flat))).margin
    return margin.reshape(len(amplitudes), phases).min(1)


def can_roll(lifted: PartlyLifted) -> bool:
    """Return whether a body rests on the ground, so that it may roll over."""
    return lifted.touching_body.rests


def outcome(climbed: ArrayLike, margin: ArrayLike) -> np.ndarray:
    """Return the outcome (...), a name of `OUTCOMES`, from distances uphill (...), nan
    of a body that slides down, and least support margins (...).

    A body that has no support rolls over, whatever else it would do."""
    climbed = np.asarray(climbed, float)
    names = np.where(climbed > 0, CLIMBS, SLIPS).astype("U16")
    names = np.where(np.isnan(climbed), SLIDES, names)
    return np.where(np.asarray(margin) < 0, ROLLS, names)
