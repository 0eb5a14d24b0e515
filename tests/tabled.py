"""Results of displacements and sweeps as dicts of lists, as tests compare them."""

import numpy as np

QUANTITIES = ("x", "y", "heading", "net_distance")


def tabled(result):
    """Return a result of displacements by tier: {tier: poses, "estimate": {tier: errors of
    the position}, "estimate_heading": ..., quantity: {tier: values}, "amplitude": ...},
    and its attributes."""
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
    for name in ("efficiency", "cost_of_transport"):
        if name in result:
            found[name] = by_tier(result[name].values)
    for name in ("path_length", "work"):
        if name in result:
            found[name] = result[name].values.tolist()
            found[f"{name}_error"] = result[name].error.tolist()
    if "seconds" in result:
        parts = result["part"].values.tolist()
        found["seconds"] = dict(zip(parts, result["seconds"].values.tolist()))
        before = result["computed_before"].values
        found["kept"] = [part for part, was in zip(parts, before) if was]
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
