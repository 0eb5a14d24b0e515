"""Net poses of gaits as results: x, y, heading and net distance by tier and amplitude, with units, errors and the
effect of an uncertain medium; and their tables for users and JSON."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.gaits import Gait
from geomech.geometry.field import UNKNOWN_UNIT
from geomech.geometry.symmetry import zero_components
from geomech.io.results import unit_name
from geomech.scenes.model import Scene, frequency_of
from geomech.systems.base import body_size, length_unit

COMPONENTS = ("x", "y", "theta")
ERRORS = ("estimate", "estimate_heading")
QUANTITIES = ("x", "y", "heading", "net_distance")  # of a pose
SURFACE = ("surface_spread", "surface_spread_heading")
EFFORT = ("path_length", "work")
BY_TIER = ("efficiency", "cost_of_transport")
OVER = ("tier", "amplitude")


def of_pose(poses) -> dict[str, np.ndarray]:
    """Return QUANTITIES (...,) of net poses (..., 3); the net distance is the length of (x, y)."""
    x, y, heading = np.moveaxis(np.asarray(poses, float), -1, 0)
    return {"x": x, "y": y, "heading": heading, "net_distance": np.hypot(x, y)}


def pose_variables(
    dims: tuple[str, ...],
    poses,
    errors,
    unit: str,
    spread: Mapping | None = None,
    frequency=None,
) -> list[Variable]:
    """Return QUANTITIES of net poses (..., 3) as variables, and the speed, net distance times frequency, where that is known.

    errors: (..., 2), of the position, in ``unit``, which bounds those of x, y and the net distance, and of the heading, rad.
    spread: standard deviations of QUANTITIES by the medium's covariance. frequency: Hz, a number or (...,)."""
    errors = np.asarray(errors)
    of = lambda name: (
        None if spread is None else np.broadcast_to(spread[name], errors.shape[:-1])
    )
    variable = lambda name, values: Variable(
        name,
        dims,
        values,
        "rad" if name == "heading" else unit,
        f"{name.replace('_', ' ')} per cycle",
        errors[..., 1 if name == "heading" else 0],
        of(name),
    )
    variables = [variable(name, values) for name, values in of_pose(poses).items()]
    if frequency is not None:
        net = variables[-1]
        spreads = None if net.spread is None else net.spread * frequency
        label = "net distance times frequency"
        variables.append(
            Variable(
                "speed",
                dims,
                net.values * frequency,
                f"{unit}/s",
                label,
                net.error * frequency,
                spreads,
            )
        )
    return variables


def result(
    scene: Scene, gait: Gait, amplitudes, poses: Mapping, errors: Mapping, medium=None, choices: Mapping | None = None,
    **more,
) -> Result:  # fmt: skip
    """Return the net poses (B, 3) of a gait by tier as a result; all lengths are in the system's unit.

    errors: (B, 2) by tier, as `geomech.studies.estimate` gives them, in body lengths and rad. medium: what the uncertainty of
    the medium does to the true displacement, and so to every tier's (`geomech.studies.uncertainty.of_medium`), or None.
    choices: (B, 2), the system's unit and rad, of tiers whose answer depends on the surface that a loop of three and more
    joints spans. more: attributes, such as the seconds that parts took."""
    system, tiers = scene.system, tuple(poses)
    unit, length, frequency = (
        length_unit(system),
        body_size(system),
        frequency_of(system, gait),
    )
    stacked = lambda by, width: np.array([by[t] for t in tiers], float).reshape(
        len(tiers), len(amplitudes), width
    )
    variables = [
        Variable("tier", ("tier",), np.array(tiers, dtype="U")),
        Variable(
            "amplitude",
            ("amplitude",),
            np.asarray(amplitudes, float),
            "",
            gait.amplitude_label,
        ),
        *pose_variables(
            OVER,
            stacked(poses, 3),
            stacked(errors, 2) * [length, 1.0],
            unit,
            medium,
            frequency,
        ),
    ]
    if frequency is not None:
        net, heading = (
            next(v for v in variables if v.name == name)
            for name in ("net_distance", "heading")
        )
        by, text = frequency / length, "net distance in body lengths times frequency"
        variables.append(
            Variable(
                "speed_body_lengths",
                OVER,
                net.values * by,
                "BL/s",
                text,
                net.error * by,
            )
        )
        turning = (
            heading.values * frequency,
            "rad/s",
            "heading times frequency",
            heading.error * frequency,
        )
        variables.append(Variable("turning_rate", OVER, *turning))
    if medium is not None:
        shift, label = (
            [medium["shift"][q] for q in QUANTITIES],
            "of the mean over the media, in the unit of the quantity",
        )
        variables.append(Variable("quantity", ("quantity",), np.array(QUANTITIES)))
        variables.append(
            Variable(
                "medium_shift", ("quantity", "amplitude"), np.array(shift), "", label
            )
        )
        variables.append(
            Variable(
                "medium_error_rule", ("amplitude",), np.array(medium["rule"], dtype="U")
            )
        )
    if choices:
        unknown = np.full((len(amplitudes), 2), np.nan)
        spread = stacked({t: choices.get(t, unknown) for t in tiers}, 2)
        text = "how far surfaces that a loop spans differ"
        variables += [
            Variable(n, OVER, spread[..., k], (unit, "rad")[k], text)
            for k, n in enumerate(SURFACE)
        ]
    attributes = {
        "name": scene.name,
        "frame": scene.frame,
        "body_length": float(length),
        "length_unit": unit,
    }
    attributes |= {} if frequency is None else {"frequency": frequency}
    if text := getattr(gait, "estimate_is", ""):
        attributes["estimate_is"] = text
    attributes["zero_by_symmetry"] = [*zero_components(system.traits, gait, amplitudes)]
    return Result(
        "displacement", tuple(variables), {**attributes, **more}, (scene, gait)
    )


def table(result: Result) -> dict:
    """Return {"amplitude": [...], tier: [[x, y, theta], ...], "estimate": {tier: [...]}, "estimate_heading": {tier:
    [...]}, "x", "y", "heading" and "net_distance": {tier: [...]}, "body_length", "units": {key: unit}} and the further
    attributes of the result.

    Where there is a frequency (Hz) also "frequency", and by tier "speed", the net distance times it,
    "speed_body_lengths", in body lengths per second, and "turning_rate" (rad/s). Where the medium is uncertain
    "medium_error" {tier: [...]}, of the position, "medium_error_heading" {tier: [...]}, rad, "medium_error_of" {one of
    QUANTITIES: [...]}, each in its own unit, "medium_shift_of", likewise, the shift of the mean, and
    "medium_error_rule" [...]. For a measured gait "estimate_is" describes in words what the estimates leave out.
    "zero_by_symmetry" [...] names which of x, y and heading are (`geomech.geometry.symmetry`)."""
    facts, tiers = dict(result.attributes), result["tier"].values.tolist()
    unit, net, heading = (
        facts.pop("length_unit"),
        result["net_distance"],
        result["heading"],
    )
    by_tier = lambda values: dict(zip(tiers, np.asarray(values).tolist()))
    units = {
        "amplitude": result["amplitude"].label,
        **dict.fromkeys(("x", "y", "net_distance"), unit),
        "heading": "rad",
    }
    units |= {
        "estimate": unit,
        "estimate_heading": "rad",
        "body_length": unit,
        "seconds": "s",
    }
    units |= {"tolerance": "BL"} if "tolerance" in facts else {}
    units |= (
        {"surface_spread": unit, "surface_spread_heading": "rad"}
        if SURFACE[0] in result
        else {}
    )
    out = {
        "amplitude": result["amplitude"].values.tolist(),
        **by_tier(
            np.stack([result[name].values for name in ("x", "y", "heading")], -1)
        ),
        **dict(zip(ERRORS, (by_tier(net.error), by_tier(heading.error)))),
        **{key: by_tier(result[key].values) for key in QUANTITIES},
        "body_length": facts.pop("body_length"),
        "units": units,
    }
    if net.spread is not None:
        units |= {
            "medium_error": unit,
            "medium_error_heading": "rad",
            "medium_error_of": "that of the quantity",
        }
        units["medium_shift_of"] = units["medium_error_of"]
        out |= {
            "medium_error": by_tier(position_spread(result)),
            "medium_error_heading": by_tier(heading.spread),
        }
        out["medium_error_of"] = {q: result[q].spread[0].tolist() for q in QUANTITIES}
        out["medium_shift_of"] = dict(
            zip(QUANTITIES, result["medium_shift"].values.tolist())
        )
        out["medium_error_rule"] = result["medium_error_rule"].values.tolist()
    if "estimate_is" in facts:
        out["estimate_is"] = facts.pop("estimate_is")
    if "frequency" in facts:
        units |= {
            "frequency": "Hz",
            "speed": f"{unit}/s",
            "speed_body_lengths": "BL/s",
            "turning_rate": "rad/s",
        }
        out["frequency"] = facts.pop("frequency")
        out |= {
            key: by_tier(result[key].values)
            for key in ("speed", "speed_body_lengths", "turning_rate")
        }
    for key in (key for key in SURFACE if key in result):
        out[key] = {
            t: x
            for t, x in by_tier(result[key].values).items()
            if not np.isnan(x).any()
        }
    out |= {key: x for key, x in facts.items() if key not in ("name", "frame")}
    if "work" in result:
        out |= _effort(result, by_tier)
        units |= {
            v.name: v.unit
            for v in result.variables
            if v.name in (*EFFORT, *BY_TIER) and v.unit
        }
        units |= {f"{key}_error": units[key] for key in EFFORT if key in units}
    return out


def _effort(result: Result, by_tier) -> dict:
    """Return path length, work and cost of transport as lists; None where undefined."""
    listed = lambda values: [float(x) if np.isfinite(x) else None for x in values]
    out = {key: listed(result[key].values) for key in EFFORT}
    out |= {f"{key}_error": listed(result[key].error) for key in EFFORT}
    return out | {
        key: {t: listed(x) for t, x in by_tier(result[key].values).items()}
        for key in BY_TIER
    }


def position_spread(result: Result) -> np.ndarray:
    """Return the standard deviation of the position, of both coordinates together."""
    return np.hypot(result["x"].spread, result["y"].spread)


def poses_as_stored(result: Result) -> list[Variable]:
    """Return net poses as variables of a file: displacement (..., component), its errors as estimate and
    estimate_heading, the standard deviations by the medium as medium_error and medium_error_heading, and, where there
    is a frequency, speeds."""
    net, heading = result["net_distance"], result["heading"]
    unit, dims = unit_name(net.unit), net.dims
    poses = np.stack([result[name].values for name in ("x", "y", "heading")], -1)
    both = f"{unit} (x, y), rad (theta)"
    variables = [
        *(v for v in result.variables if v.is_coordinate and v.name != "quantity"),
        Variable("component", ("component",), np.array(COMPONENTS)),
        Variable(
            "displacement",
            (*dims, "component"),
            poses,
            both,
            "net displacement per cycle",
        ),
        Variable("estimate", dims, net.error, unit, "estimated error of the position"),
        Variable(
            "estimate_heading",
            dims,
            heading.error,
            "rad",
            "estimated error of the heading",
        ),
    ]
    for name, units, label in (
        ("speed", f"{unit} s-1", "net distance times frequency"),
        (
            "speed_body_lengths",
            "body length s-1",
            "net distance in body lengths times frequency",
        ),
        ("turning_rate", "rad s-1", "heading times frequency"),
    ):
        variables += (
            [Variable(name, dims, result[name].values, units, label)]
            if name in result
            else []
        )
    if net.spread is not None:
        of = "one standard deviation of the {} by the medium's covariance"
        variables.append(
            Variable(
                "medium_error",
                dims,
                position_spread(result),
                unit,
                of.format("position"),
            )
        )
        variables.append(
            Variable(
                "medium_error_heading",
                dims,
                heading.spread,
                "rad",
                of.format("heading"),
            )
        )
    return variables


def as_stored(result: Result) -> Result:
    """Return net displacements by tier and amplitude as data for a file."""
    facts, unit = result.attributes, unit_name(result["net_distance"].unit)
    attributes = {
        "title": f"Net displacement per cycle of the scene {facts['name']}",
        "frame": facts["frame"],
    }
    attributes |= {"body_length": facts["body_length"], "length_unit": unit}
    attributes |= (
        {"frequency": float(facts["frequency"]), "frequency_unit": "Hz"}
        if "frequency" in facts
        else {}
    )
    attributes |= (
        {"estimate_is": facts["estimate_is"]} if "estimate_is" in facts else {}
    )
    return Result(
        result.kind, tuple(poses_as_stored(result)), attributes, result.subject
    )


def error_of(table: Mapping, quantity: str, tier: str) -> np.ndarray:
    """Return the estimated error (B,) of one of QUANTITIES, in its own unit."""
    return np.array(table[ERRORS[quantity == "heading"]][tier], float)


def unit_of(table: Mapping, quantity: str) -> str:
    """Return the unit of one of QUANTITIES, of a table that may be a user's own."""
    return (
        "rad"
        if quantity == "heading"
        else table.get("units", {}).get(quantity, UNKNOWN_UNIT)
    )
