"""Net poses of gaits as variables: x, y, heading and net distance by tier and
amplitude, with units, errors and the effect of an uncertain medium."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.mathematics.gaits import Gait
from geomech.mathematics.geometry.gait import loop_area
from geomech.mathematics.geometry.periods import ends_differ
from geomech.mathematics.geometry.symmetry import zero_components
from geomech.mathematics.systems.base import body_size, length_unit
from geomech.scenes.model import Scene, frequency_of

COMPONENTS = ("x", "y", "theta")  # of a velocity in the body frame
QUANTITIES = ("x", "y", "heading", "net_distance")  # of a pose
POSE = QUANTITIES[:3]
SURFACE = ("surface_spread", "surface_spread_heading")
DIMS = ("tier", "amplitude")


def pose_quantities(poses) -> dict[str, np.ndarray]:
    """Return QUANTITIES (...,) of net poses (..., 3); the net distance is the length of
    (x, y)."""
    x, y, heading = np.moveaxis(np.asarray(poses, float), -1, 0)
    return {"x": x, "y": y, "heading": heading, "net_distance": np.hypot(x, y)}


def poses(result: Mapping[str, Variable]) -> np.ndarray:
    """Return the net poses (..., 3) of a result."""
    return np.stack([result[name].values for name in POSE], -1)


def zero_reason(reason: str) -> str:
    """Return why a quantity is zero in words, for a reason of `zero_components`."""
    return f"by symmetry, as {reason}"


def pose_variables(
    dims: tuple[str, ...],
    poses,
    errors,
    unit: str,
    spread: Mapping | None = None,
    frequency=None,
    zero: Mapping[str, str] | None = None,
) -> list[Variable]:
    """Return QUANTITIES of net poses (..., 3) as variables, and the speed, net distance
    times frequency, where that is known.

    errors: (..., 2), of the position, in ``unit``, which bounds those of x, y and the
    net distance, and of the heading, rad. spread: standard deviations of QUANTITIES by
    the medium's covariance. frequency: Hz, a number or (...,). zero: why quantities are
    zero, by name."""
    errors = np.asarray(errors)
    zero = zero or {}
    variables = []
    for name, values in pose_quantities(poses).items():
        is_heading = name == "heading"
        spreads = None
        if spread is not None:
            spreads = np.broadcast_to(spread[name], errors.shape[:-1])
        variables.append(
            Variable(
                name,
                dims,
                values,
                unit="rad" if is_heading else unit,
                label=f"{name.replace('_', ' ')} per cycle",
                error=errors[..., 1 if is_heading else 0],
                spread=spreads,
                zero=zero.get(name, ""),
            )
        )
    if frequency is not None:
        label = "net distance times frequency"
        net = variables[-1]
        variables.append(scaled(net, frequency, "speed", f"{unit}/s", label))
    return variables


def scaled(
    variable: Variable, factor: Any, name: str, unit: str, label: str
) -> Variable:
    """Return a variable times a factor, a number or an array that broadcasts."""
    return variable.with_arrays(
        lambda array: array * factor, name=name, unit=unit, label=label
    )


def displacement_result(
    scene: Scene,
    gait: Gait,
    amplitudes,
    poses: Mapping,
    errors: Mapping,
    medium: Mapping | None = None,
    choices: Mapping | None = None,
    more: Sequence[Variable] = (),
    **facts: Any,
) -> Result:
    """Return the net poses (B, 3) of a gait by tier as a result; lengths are in the
    system's unit.

    errors: (B, 2) by tier, body lengths and rad, of
    `geomech.studies.estimates.estimate`. medium: spread of the true displacement by an
    uncertain medium, which every tier shares
    (`geomech.studies.estimates.uncertainty.medium_spread`), or None. choices: (B, 2),
    the system's unit and rad, of tiers whose answer depends on the surface that a loop
    of three and more joints spans. more: further variables. facts: further
    attributes."""
    system, tiers = scene.system, tuple(poses)
    unit = length_unit(system)
    length = body_size(system)
    frequency = frequency_of(system, gait)

    values = np.asarray(amplitudes, float)
    reasons = zero_components(system.traits, gait, amplitudes)
    zero = {name: zero_reason(reason) for name, reason in reasons.items()}
    variables = [
        Variable("tier", ("tier",), np.array(tiers, dtype="U")),
        Variable("amplitude", ("amplitude",), values, "", gait.amplitude_label),
        *pose_variables(
            DIMS,
            _stacked(poses, tiers, amplitudes, 3),
            _stacked(errors, tiers, amplitudes, 2) * [length, 1.0],
            unit,
            medium,
            frequency,
            zero,
        ),
    ]
    attributes: dict[str, Any] = {
        "scene": scene.name,
        "frame": scene.frame,
        "body_length": float(length),
        "length_unit": unit,
    }
    if frequency is not None:
        attributes["frequency"] = float(frequency)
        variables += rate_variables(variables, float(frequency), length)
    if medium is not None:
        variables += medium_variables(medium, unit)
    if choices:
        unknown = np.full((len(amplitudes), 2), np.nan)
        by_tier = {tier: choices.get(tier, unknown) for tier in tiers}
        spread = _stacked(by_tier, tiers, amplitudes, 2)
        variables += _surface_variables(spread, unit)
    if system.joints == 2:
        variables.append(_loop_area(gait, scene.numerics.phases, values))
    error_is = getattr(gait, "estimate_is", "")
    if error_is:
        attributes["error_is"] = error_is
    return Result("displacement", (*variables, *more), {**attributes, **facts})


def _stacked(
    by_tier: Mapping, tiers: Sequence[str], amplitudes, width: int
) -> np.ndarray:
    """Return arrays by tier as one, (tiers, amplitudes, width)."""
    arrays = np.array([by_tier[tier] for tier in tiers], float)
    return arrays.reshape(len(tiers), len(amplitudes), width)


def _surface_variables(spread: np.ndarray, unit: str) -> list[Variable]:
    """Return how far answers differ between surfaces that a loop spans, from (tiers,
    amplitudes, 2): in position and heading."""
    position, heading = SURFACE
    label = "difference between surfaces that the loop spans"
    return [
        Variable(position, DIMS, spread[..., 0], unit, label),
        Variable(heading, DIMS, spread[..., 1], "rad", label),
    ]


def _loop_area(gait: Gait, phases: int, amplitudes: np.ndarray) -> Variable:
    """Return the area of a gait's loop in shape space at each amplitude."""
    area, error = loop_area(gait, phases, amplitudes)
    label = "area in shape space, counter-clockwise positive"
    if ends_differ(gait):
        label = f"{label}, between the loop at rest and the gait"
    return Variable("loop_area", ("amplitude",), area, "rad2", label, error)


def rate_variables(
    variables: Sequence[Variable], frequency: float, length: float
) -> list[Variable]:
    """Return the speed in body lengths and the turning rate."""
    by_name = {variable.name: variable for variable in variables}
    net = by_name["net_distance"].with_arrays(np.asarray, spread=None)
    heading = by_name["heading"].with_arrays(np.asarray, spread=None)
    speed_label = "net distance in body lengths times frequency"
    turning_label = "heading times frequency"
    return [
        scaled(net, frequency / length, "speed_body_lengths", "BL/s", speed_label),
        scaled(heading, frequency, "turning_rate", "rad/s", turning_label),
    ]


def medium_variables(medium: Mapping, unit: str) -> list[Variable]:
    """Return the shift of the mean over uncertain media, and how their spread was
    propagated."""
    shift = np.array([medium["shift"][name] for name in QUANTITIES])
    label = "shift of the mean over the media from the displacement in their mean"
    rule = np.array(medium["rule"], dtype="U")
    return [
        Variable("quantity", ("quantity",), [*QUANTITIES]),
        Variable(
            "medium_shift",
            ("quantity", "amplitude"),
            shift,
            (unit, unit, "rad", unit),
            label,
        ),
        Variable("medium_error_rule", ("amplitude",), rule),
    ]


def position_spread(result: Mapping[str, Variable]) -> np.ndarray:
    """Return the standard deviation of the position, of both coordinates together."""
    return np.hypot(result["x"].spread, result["y"].spread)


def timing_variables(
    seconds: Mapping[str, float], stored: Sequence[str]
) -> list[Variable]:
    """Return the seconds that parts of a computation took, and whether they were stored
    already."""
    was_stored = [int(part in stored) for part in seconds]
    return [
        Variable("part", ("part",), np.array([*seconds], dtype="U")),
        Variable("seconds", ("part",), [*seconds.values()], "s", "computing time"),
        Variable(
            "computed_before", ("part",), was_stored, "1", "1 if it was stored already"
        ),
    ]
