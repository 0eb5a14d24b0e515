"""Numbers of a fitted medium as a dict by the names that fits had at first."""

import numpy as np
from tabled import of_json

OF_ROD = {
    "axial_force_N": "axial_force",
    "axial_stress_Pa": "axial_stress",
    "end_caps": "end_caps",
    "repeats_rms": "repeats_rms",
}


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


def plain(variables):
    """Return the values of variables by name as lists."""
    return {name: v.values.tolist() for name, v in variables.items()}
