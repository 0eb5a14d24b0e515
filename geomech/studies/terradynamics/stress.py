"""Stress of the grains on a plate, by a stress map."""

from __future__ import annotations

import math

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.scenes.terradynamics.stress import stress_map
from rft.core.refusal import Refusal
from rft.terradynamics.plates import Survey, survey

LARGEST_ANGLE = 1e6  # degrees
UNIT = "N/cm^3"
MAPS = ("map_x", "map_z", "map_normal", "map_power")  # of a survey, by its fields
OVER = ("tilt", "direction")


def check(beta: float | None, gamma: float | None, mapped: bool) -> None:
    """Refuse one angle without the other, no angles without the map, and angles that
    are not finite."""
    alone = (beta is None) != (gamma is None)
    if alone or (beta is None and not mapped):
        raise Refusal(
            "give both ``beta`` and ``gamma``, in degrees, or ``drawn`` for all angles"
        )
    for angle in (beta, gamma):
        if angle is not None and not abs(angle) <= LARGEST_ANGLE:
            raise Refusal(
                "``beta`` and ``gamma`` must be finite angles in degrees, "
                "of at most 1e6"
            )


def answer(
    medium: str, beta: float | None, gamma: float | None, mapped: bool
) -> Result:
    """Return the stress per unit depth at one tilt and direction, degrees, the shares
    of the plane of angles in which the map pulls and pushes, and the map itself."""
    law = stress_map(medium)
    overview = survey(law)
    description = f"{medium} {overview.description()}"
    if law.tension == "cut":
        description = f"{description}, which is cut"
    variables = []
    if beta is not None:
        variables += angle_variables(law, beta, gamma)
    pulling = "share of angles at which it pulls on the leading face"
    pushing = "share of angles at which it drives the motion"
    variables.append(Variable("pulling", (), overview.pulling, "1", pulling))
    variables.append(Variable("pushing", (), overview.pushing, "1", pushing))
    if overview.pushing:
        variables.append(Variable("note", ("line",), [description]))
    if mapped:
        variables += map_variables(overview)
    facts = {"medium": medium, "description": description}
    return Result("stress", tuple(variables), facts)


def angle_variables(law, beta: float, gamma: float) -> list[Variable]:
    """Return the stress at one tilt and direction, degrees."""
    values = law(math.radians(beta), math.radians(gamma))
    # The sum with 0.0 turns -0.0 into 0.0.
    alpha_x, alpha_z = (np.round(float(x), 12) + 0.0 for x in values)
    return [
        Variable("beta", (), beta, "degrees", "tilt of the plate"),
        Variable("gamma", (), gamma, "degrees", "direction below the horizontal"),
        Variable("alpha_x", (), alpha_x, UNIT, "against the motion's x"),
        Variable("alpha_z", (), alpha_z, UNIT, "upwards"),
    ]


def map_variables(overview: Survey) -> list[Variable]:
    """Return a survey as variables over tilt and direction."""
    arrays = (overview.alpha_x, overview.alpha_z, overview.normal, overview.power)
    units = (UNIT, UNIT, UNIT, f"{UNIT} x speed")
    maps = []
    for name, values, unit in zip(MAPS, arrays, units):
        maps.append(Variable(name, OVER, values, unit))
    return [
        Variable("tilt", ("tilt",), overview.beta, "rad"),
        Variable("direction", ("direction",), overview.gamma, "rad"),
        *maps,
    ]


def drawn(result: Result) -> tuple[Survey, tuple[float, float] | None]:
    """Return the survey of a result for its picture, and the angles (beta, gamma),
    degrees, at which it has the stress; None without them."""
    if "map_x" not in result:
        raise Refusal("its map was not computed", instead="say ``drawn``")
    maps = [result[name].values for name in MAPS]
    point = None
    if "beta" in result:
        point = (float(result["beta"]), float(result["gamma"]))
    axes = (result[dim].values for dim in OVER)
    return Survey(*axes, *maps), point
