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
OF_ROD = {
    "axial_force_N": "axial_force",
    "axial_stress_Pa": "axial_stress",
    "end_caps": "end_caps",
    "repeats_rms": "repeats_rms",
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


def medium(out):
    """Return the numbers of a fitted medium that a command printed."""
    result = of_json(out)
    law, value = result.attributes["law"], result["value"]
    names = result["parameter"].values.tolist()

    def by_name(values):
        return dict(zip(names, values.tolist()))

    bounds = np.stack([value.values - value.error, value.values + value.error], -1)
    found = {
        "law": law,
        **by_name(value.values),
        "covariance": result["covariance"].values.tolist(),
        "rms": float(result["rms"]),
        "parameters": names,
        "errors": by_name(result["standard_error"].values),
        "intervals": by_name(bounds),
    }
    if law == "zeta":
        found["error"] = found.pop("errors")["zeta"]
        found["interval"] = found.pop("intervals")["zeta"]
        found["area"] = float(result["area"][0])
        if "zero_depth" in result:
            found["zero_depth"] = float(result["zero_depth"])
        rows = {"depth": result["depth"], "force": result["residual"]}
        return {**found, "residuals": plain(rows)}
    residuals = result["residual"].values.tolist()
    if law == "stress-map":
        missing = result["undetermined"].values > 0
        found["zeta"] = float(result["zeta"])
        found["resolution"] = by_name(result["share_from_data"].values)
        found["undetermined"] = result["parameter"].values[missing].tolist()
        rows = plain({f"{name}_deg": result[name] for name in ("beta", "gamma")})
        rows |= dict(zip(("alpha_x", "alpha_z"), residuals))
        return {**found, "residuals": rows}
    if "gamma0_deg" in names:
        found["parameters"][names.index("gamma0_deg")] = "gamma0"
    for old, new in OF_ROD.items():
        if old != new:
            found.pop(new, None)
        found[old] = float(result[new]) if new in result else None
    found.setdefault("k", None)
    sizes = {name: v for name, v in result.items() if name.startswith("rod_")}
    found["rod"] = {name[4:]: float(v) for name, v in sizes.items()}
    rows = {"psi_deg": result["psi"].values.tolist()}
    rows |= dict(zip(("F_parallel_N", "F_perpendicular_N"), residuals))
    return {**found, "residuals": rows}


def gait(out):
    """Return the numbers of a fit to a log of joint angles that a command printed."""
    from geomech.results.measured import fitted_gait
    from geomech.scenes.write import gait_table

    result = of_json(out)
    facts, pose = result.attributes, ("x", "y", "heading")

    def stacked(ending):
        return np.stack([result[f"{name}{ending}"].values for name in pose], -1)

    def bounds(ending):
        half = np.array([result[f"{name}{ending}"].error for name in pose])
        return np.stack([stacked(ending) - half, stacked(ending) + half], -1).tolist()

    found = {
        "rows": facts["rows"],
        "cycles": facts["cycles"],
        "gait": gait_table(fitted_gait(result)),
        "displacement_measured": stacked("").tolist(),
        "displacement_predicted": stacked("_predicted").tolist(),
        "interval": bounds("_predicted"),
        "interval_measured": bounds(""),
        "coverage_level": facts["level"],
        "noise": dict(zip(result["recorded"].values.tolist(), result["noise"].values)),
        "reach": result["reach_along"].values.tolist(),
        "A": result["A_along"].values.tolist(),
        "A_error": result["A_along"].error.tolist(),
        "per_cycle": {
            "measured": stacked("_per_cycle").tolist(),
            "predicted": stacked("_per_cycle_predicted").tolist(),
            "rms": result["difference"].values.tolist(),
        },
        "body_length": facts["body_length"],
    }
    names = ("frequency", "phase_residual", "harmonics", "explained", "misfit", "phase")
    return {**found, **plain({name: result[name] for name in names})}


def plain(variables):
    """Return the values of variables by name as lists."""
    return {name: v.values.tolist() for name, v in variables.items()}
