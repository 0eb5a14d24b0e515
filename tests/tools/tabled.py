"""Results of displacements and sweeps as dicts of lists, as tests compare them."""

import json

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.io.results import from_dict
from geomech.mathematics.tiers import TIERS

QUANTITIES = ("x", "y", "heading", "net_distance")


def tabled(result):
    """Return a result of displacements by tier: {tier: poses, "estimate": {tier: errors
    of the position}, "estimate_heading": ..., quantity: {tier: values}, "amplitude":
    ...}, and its attributes."""
    tiers = result["tier"].values.tolist()

    def by_tier(values):
        return dict(zip(tiers, np.asarray(values).tolist()))

    poses = np.stack([result[name].values for name in QUANTITIES[:3]], -1)
    found = {
        **dict(result.attributes),
        "amplitude": result["amplitude"].values.tolist(),
        **by_tier(poses),
        "estimate": by_tier(result["net_distance"].error),
        "estimate_heading": by_tier(result["heading"].error),
        "zero_by_symmetry": [name for name in QUANTITIES if result[name].zero],
    }
    for name in (*QUANTITIES, "speed", "speed_body_lengths", "turning_rate"):
        if name in result:
            found[name] = by_tier(result[name].values)

    if "tolerance" in result.attributes:
        (found["tier"],) = tiers
        settings = [name for name in result if name.startswith("chosen_")]
        found["settings"] = {
            name.removeprefix("chosen_"): int(result[name].values) for name in settings
        }
    for name in ("surface_spread", "surface_spread_heading"):
        if name in result:
            rows = by_tier(result[name].values)
            found[name] = {t: x for t, x in rows.items() if not np.isnan(x).any()}

    if "seconds" in result:
        parts = result["part"].values.tolist()
        found["seconds"] = dict(zip(parts, result["seconds"].values.tolist()))
    return found


def swept_table(result):
    """Return a result of a sweep: {"over": {parameter: values}, "displacement": (...,
    3), "estimate": ..., name: array}."""
    axes = [v for v in result.variables if v.is_coordinate]
    found = {"over": {v.label: v.values.tolist() for v in axes}}
    for v in result.variables:
        if not v.is_coordinate:
            found[v.name] = v.values
    if "heading" in result:
        poses = [result[name].values for name in QUANTITIES[:3]]
        found["displacement"] = np.stack(poses, -1)
        found["estimate"] = result["net_distance"].error
        found["estimate_heading"] = result["heading"].error
    else:
        found["estimate"] = result["speed"].error
    return found


def of_table(table, unit="length", label="", zero=None, **facts):
    """Return the result of displacements that a dict as of `tabled` is of."""
    tiers = [name for name in TIERS if name in table]
    over = ("tier", "amplitude")
    poses = np.array([table[tier] for tier in tiers], float)
    values = {**dict(zip(QUANTITIES, np.moveaxis(poses, -1, 0)))}
    values["net_distance"] = np.hypot(values["x"], values["y"])
    variables = [
        Variable("tier", ("tier",), tiers),
        Variable("amplitude", ("amplitude",), table["amplitude"], label=label),
    ]
    spreads = table.get("medium_error_of", {})
    for name, x in values.items():
        of, error = unit, None
        errors = table.get("estimate")
        if name == "heading":
            of, errors = "rad", table.get("estimate_heading")
        if errors is not None:
            error = [errors[tier] for tier in tiers]
        spread = spreads.get(name)
        if spread is not None:
            spread = np.broadcast_to(spread, x.shape)
        why = (zero or {}).get(name, "")
        variables.append(Variable(name, over, x, of, "", error, spread, zero=why))
    if "body_length" in table:
        facts["body_length"] = table["body_length"]
    return Result("displacement", tuple(variables), facts)


def of_swept(table, unit="m"):
    """Return the result of a sweep that a dict as of `swept_table` is of."""
    names = {label: label.replace(".", "_") for label in table["over"]}
    dims = tuple(names.values())
    variables = [
        Variable(names[label], (names[label],), np.array(x, float), "", label)
        for label, x in table["over"].items()
    ]
    error = table["estimate"]
    if "displacement" in table:
        x, y, heading = np.moveaxis(np.array(table["displacement"], float), -1, 0)
        variables.append(Variable("x", dims, x, unit, "", error))
        variables.append(Variable("y", dims, y, unit, "", error))
        variables.append(Variable("heading", dims, heading, "rad", "", 0 * heading))
        net = np.hypot(x, y)
        variables.append(Variable("net_distance", dims, net, unit, "", error))
    else:
        variables.append(Variable("speed", dims, table["speed"], "m/s", "", error))
    for name in ("frequency", "status"):
        if name in table:
            variables.append(Variable(name, dims, table[name]))
    return Result("sweep", tuple(variables))


def of_json(out):
    """Return the result that a command printed as JSON."""
    return from_dict(json.loads(out))


def tabled_json(out):
    """Return the displacements that a command printed as JSON by tier (`tabled`)."""
    return tabled(of_json(out))
