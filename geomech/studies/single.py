"""The body velocity for one shape and its rate of change, with its residual."""

from __future__ import annotations

import numpy as np

from geomech.geometry.velocity import evaluate
from geomech.systems.base import System, note_angles
from geomech.systems.capabilities import Diagnosed, capability
from rft.checks import real_array
from rft.refusal import Refusal, formatted


def single(system: System, alpha, alphadot) -> dict:
    """Return {"xi", "status", "residual"} for one shape (joints,) and its rate; ValueError if it is singular."""
    alpha, alphadot = (
        _checked_numbers(system, name, x)
        for name, x in (("alpha", alpha), ("alphadot", alphadot))
    )
    note_angles(system, np.abs(alpha).max())
    traits = system.traits
    if traits.singularity is not None and not traits.singularity(alpha):
        raise Refusal(
            "the shape is singular", because=traits.singular, instead="move a joint"
        )
    if (diagnosed := capability(system, Diagnosed)) is not None:
        return diagnosed.diagnosed(alpha, alphadot)
    return {
        "xi": evaluate(system.velocity, alpha, alphadot).tolist(),
        "status": "exact",
        "residual": 0.0,
    }


def _checked_numbers(system: System, name: str, x) -> np.ndarray:
    """Return x as finite numbers (joints,); ValueError naming it."""
    x = real_array(name, x)
    if x.shape != (system.joints,) or not np.isfinite(x).all():
        count = "" if x.shape == (system.joints,) else f"{x.size}: "
        raise Refusal(
            f"{name} must be {system.joints} finite numbers for this system, got {count}{formatted(x.tolist())}"
        )
    return x
