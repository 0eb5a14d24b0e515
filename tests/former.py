"""Numbers of results under the names that the golden data have, which were recorded before
results had one vocabulary."""

import numpy as np
from tabled import of_json, tabled

WALK = {
    "speed": "speed",
    "t": "t",
    "x": "x",
    "z": "z",
    "pitch": "pitch",
    "cycles": "cycles",
    "unsolved": "unsolved",
    "residual": "residual",
    "unaccounted": "unaccounted",
    "settled": "settling_time",
    "aside": "lateral_speed",
    "turning": "yaw_rate",
    "estimate_elements": "speed_error_of_elements",
}
WALK_ERRORS = {
    "estimate": "speed",
    "estimate_aside": "lateral_speed",
    "estimate_turning": "yaw_rate",
}
PLACES = ("t", "angle", "x", "y", "z")


def walk(out):
    """Return the numbers of a walk that a command printed."""
    result = of_json(out)
    found = {}
    for old, new in WALK.items():
        if new in result and np.isfinite(result[new].values).all():
            found[old] = result[new].values.tolist()
    for old, new in WALK_ERRORS.items():
        found[old] = result[new].error.tolist()
    return found


def intrusion(out):
    """Return the numbers of an intrusion that a command printed."""
    result = of_json(out)
    found = {}
    for name in result:
        if name in PLACES or name.startswith(("force", "moment")):
            found[name] = result[name].values.tolist()
    parts = result.attributes["parts"]
    estimate = {f"from_{parts}": int(result["finest_parts"].values)}
    for kind in ("force", "moment"):
        value = float(result[f"largest_{kind}_error"])
        if np.isfinite(value):
            estimate[kind] = value
    return {**found, "estimate": estimate}


def displacement(out):
    """Return the displacements that a command printed, by tier."""
    table = tabled(of_json(out))
    return {key: table[key] for key in (*table["estimate"], "estimate")}


def connection(path):
    """Return the arrays of a file of a connection."""
    import geomech

    result = geomech.load_result(path)
    found = {}
    for variable in result.variables:
        over_shapes = {"alpha_1", "alpha_2"} & {*variable.dims}
        if variable.values.dtype.kind == "f" and over_shapes:
            name = {"xi_rms": "speed"}.get(variable.name, variable.name)
            found[name] = variable.values
            if variable.error is not None:
                found[f"{name}_error"] = variable.error
    return found


def sweep(path):
    """Return the displacements in a file of a sweep, and their errors."""
    import geomech

    result = geomech.load_result(path)
    poses = [result[name].values for name in ("x", "y", "heading")]
    return np.stack(poses, -1), result["net_distance"].error
