"""The body velocity for one shape and its rate of change, with its residual."""

from __future__ import annotations

import numpy as np

from geomech.core.variables import Variable
from geomech.mathematics.geometry.velocity import evaluate
from geomech.mathematics.systems.base import System, length_unit, note_angles
from geomech.mathematics.systems.capabilities import Diagnosed, capability
from rft.core.checks import real_array
from rft.core.refusal import Refusal, formatted


def velocity(system: System, alpha, alphadot) -> list[Variable]:
    """Return the body velocity xi (3,) for one shape (joints,) and its rate, with the
    residual and the status of the balance of forces; nan where a residual is
    unknown."""
    solution = diagnosed_velocity(system, alpha, alphadot)
    unit = length_unit(system)
    residual = solution["residual"]
    if residual is None:
        residual = np.nan
    variables = [
        Variable(
            "xi",
            ("component",),
            solution["xi"],
            (unit, unit, "rad"),
            "body velocity per unit of time",
        ),
        Variable("status", (), solution["status"], label="status of the force balance"),
        Variable("residual", (), residual, "1", "residual of the force balance"),
    ]
    if "iterations" in solution:
        steps = solution["iterations"]
        variables.append(
            Variable("iterations", (), steps, "1", "iterations of the solver")
        )
    return variables


def diagnosed_velocity(system: System, alpha, alphadot) -> dict:
    """Return {"xi", "status", "residual"} for one shape (joints,) and its rate;
    ValueError if it is singular."""
    alpha = _checked_numbers(system, "alpha", alpha)
    alphadot = _checked_numbers(system, "alphadot", alphadot)
    note_angles(system, np.abs(alpha).max())
    traits = system.traits
    singular = Refusal(
        "the shape is singular", because=traits.singular, instead="move a joint"
    )
    if traits.singularity is not None and not traits.singularity(alpha):
        raise singular
    diagnosed = capability(system, Diagnosed)
    if diagnosed is not None:
        return diagnosed.diagnosed(alpha, alphadot)
    masked = traits.singularity is not None
    xi = evaluate(system.velocity, alpha, alphadot, masked=masked)
    if np.isnan(xi).any():
        raise singular
    return {"xi": xi.tolist(), "status": "exact", "residual": 0.0}


def _checked_numbers(system: System, name: str, x) -> np.ndarray:
    """Return x as finite numbers (joints,); ValueError naming it."""
    x = real_array(name, x)
    has_shape = x.shape == (system.joints,)
    if not has_shape or not np.isfinite(x).all():
        count = ""
        if not has_shape:
            count = f"{x.size}: "
        raise Refusal(
            f"{name} must be {system.joints} finite numbers for this system, got "
            f"{count}{formatted(x.tolist())}"
        )
    return x
