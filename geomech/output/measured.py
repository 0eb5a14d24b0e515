"""What a measured gait tells, as JSON, text, a field and a scene."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from geomech.geometry.curvature import ccf
from geomech.geometry.curvature import error as curvature_error
from geomech.geometry.tube import BEYOND
from geomech.measured.fit import SHOWN, Fitted
from geomech.output.netcdf import (
    INTERVAL_OF_CCF,
    angles_of,
    of_ccf,
    of_connection,
    of_error,
    of_known,
    of_reach,
    units_of,
    write,
)
from geomech.scene.write import gait_table, table

ALONG = "fitted along the gait alone"


def status(fit: Fitted) -> str:
    """What of A is told, and why not all; with the cure, where joints depend on each other."""
    if fit.across:
        return "fitted"
    if not fit.combined:
        return f"{ALONG}: its cycles do not vary enough to tell A across it"
    said = ", ".join(f"{fit.log.joints[k]} is {_sum(fit, factors)}" for k, factors in fit.combined.items())
    names = ", ".join(fit.log.joints[k] for k in fit.combined)
    return (
        f"{ALONG}: {said}, but for constants and noise, which leaves A across it open: leave {names} out with --columns"
    )


def _sum(fit: Fitted, factors: np.ndarray) -> str:
    """0.5 alpha_1 - 2 alpha_2."""
    terms = (f"{x:.3g} {name}" for x, name in zip(factors, fit.log.joints) if x)
    return " + ".join(terms).replace("+ -", "- ")


def numbers(fit: Fitted) -> dict:
    """What `geomech fit --json` prints. Triples are x, y and theta; intervals are (low, high) of each; A, its interval's half
    width and the half width of the data at SHOWN phases of the gait."""
    (net, off), (mean, mean_off) = fit.displacement, fit.mean
    t = 2 * np.pi * np.arange(SHOWN) / SHOWN
    A, error = fit.along(t)
    apart, rates = fit.measured - fit.predicted, [f"{fit.unit}/rad", f"{fit.unit}/rad", "rad/rad"]
    return {
        "log": fit.log.name,
        "rows": len(fit.log.t),
        "columns": list(fit.log.joints),
        "cycles": len(fit.measured),
        "frequency": fit.frequency,
        "phase_residual": fit.irregular,
        "gait": gait_table(fit.gait),
        "displacement_measured": mean.tolist(),
        "displacement_predicted": net.tolist(),
        "interval": np.stack([net - off, net + off], -1).tolist(),
        "interval_measured": np.stack([mean - mean_off, mean + mean_off], -1).tolist(),
        "coverage_level": fit.known.level,
        "harmonics": fit.known.A.shape[-1] // 2,
        "residual": fit.residual.tolist(),
        "explained": fit.explained.tolist(),
        "misfit": fit.misfit.tolist(),
        "noise": dict(zip((*fit.log.joints, "x", "y", "heading"), fit.noise.tolist())),
        "reach": reach(fit).tolist(),
        "phase": t.tolist(),
        "A": np.moveaxis(A, 0, -1).tolist(),
        "A_error": np.moveaxis(error, 0, -1).tolist(),
        "per_cycle": {
            "measured": fit.measured.tolist(),
            "predicted": fit.predicted.tolist(),
            "rms": np.sqrt((apart**2).mean(0)).tolist(),
        },
        "body_length": fit.length,
        "units": {"displacement": [fit.unit, fit.unit, "rad"], "frequency": "cycles per unit of t", "phase_residual": "rad",
                  "residual": rates, "misfit": rates, "A": rates, "reach": "rad", "body_length": fit.unit},
        "status": status(fit),
    }  # fmt: skip


def reach(fit: Fitted) -> np.ndarray:
    """Half width, rad, of what the data reach across the gait, in the direction in which that is least, at SHOWN phases."""
    spread = fit.known.spread
    least = np.sqrt(np.linalg.eigvalsh(np.moveaxis(spread, -1, 0))[:, 0])
    return least[np.arange(SHOWN) * spread.shape[-1] // SHOWN]


def text(fit: Fitted) -> str:
    """The same in lines."""
    (net, off), (mean, mean_off), unit = fit.displacement, fit.mean, fit.unit
    apart, wide = np.sqrt(((fit.measured - fit.predicted) ** 2).mean(0)), reach(fit)
    lines = [
        f"{fit.log.name}: {len(fit.measured)} whole cycles of {', '.join(fit.log.joints)}, {fit.frequency:.6g} per unit of t; "
        f"phase within {fit.irregular:.2g} rad of a uniform run through each",
        f"displacement per cycle, with intervals of {fit.known.level:.3g} of cases:",
        "            mean of the log        mean gait, by the connection   rms of a cycle: log - prediction",
    ]
    for k, (name, u) in enumerate((("x", unit), ("y", unit), ("heading", "rad"))):
        pair = f"{mean[k]:11.6f} +-{mean_off[k]:7.1e}      {net[k]:11.6f} +-{off[k]:7.1e}"
        lines.append(f"{name:>8}{pair}          {apart[k]:.2g} of {fit.measured[:, k].std():.2g} {u}")
    told = "  ".join(f"{name} {100 * x:.3g} %" for name, x in zip(("x", "y", "heading"), fit.explained))
    return "\n".join([
        *lines,
        f"connection: {fit.known.A.shape[-1] // 2} harmonics in the phase; explains of the body velocity {told}",
        f"the data reach {wide.min():.3g} to {wide.max():.3g} rad from the mean gait; status: {status(fit)}",
    ])  # fmt: skip


def save_field(path: str | Path, fit: Fitted) -> None:
    """A, nan where the data do not reach, its error, the CCF of two joints there, and all that a lookup near the gait takes, as
    NetCDF that `Connection.load` and [system] kind = "table" read."""
    tube, unit = fit.tube, fit.unit
    error = of_error(tube.at_grid(tube.known.of_error), unit)
    found = [*of_connection(tube), error, *of_known(tube.known, unit), of_reach(tube)]
    if len(tube.axes) == 2:
        found += [of_ccf(ccf(tube)), of_ccf(curvature_error(tube), "ccf_error", INTERVAL_OF_CCF)]
    labels = tuple((name, "rad") for name in angles_of(tube.axes))
    write(path, _about(fit), tube.axes, labels, found)


def _about(fit: Fitted) -> dict:
    return {
        "title": f"Local connection near the mean gait of the log {fit.log.name}",
        "Conventions": "xi = + A alphadot; CCF = dA + [A, A], positive for counter-clockwise loops",
        "method": "first-order Taylor series of A in the deviation from the mean gait, by regression over all cycles (Bittner, "
        "Hatton and Revzen, Nonlinear Dynamics 94, 1933 (2018))",
        "frame": "that of the log",
        "frame_meaning": "body frame: the one whose x, y and heading were logged",
        "body_length": float(fit.length),
        "length_unit": units_of(fit.unit),
        "components": "x, y, theta of the body velocity xi: along the heading, to the left, counter-clockwise",
        "sign_of_A": "xi = + A alphadot",
        "sign_of_ccf": "CCF = dA + [A, A] with [X, Y] = XY - YX, positive for counter-clockwise loops",
        "pair_of_ccf": "CCF_12 = dA_2 / dalpha_1 - dA_1 / dalpha_2 + [A_1, A_2]",
        "interpolation": int(fit.tube.degree),
        "singular_shapes": BEYOND,
        "level": float(fit.known.level),
        "error_factor": float(fit.known.factor),
        "cycles": len(fit.measured),
        "frequency": float(fit.frequency),
        "columns": ", ".join(fit.log.joints),
        "status": status(fit),
    }


def scene_toml(fit: Fitted, field: Path, scene: Path) -> str:
    """A scene of the mean gait with the field's file, named by its place beside the scene."""
    file = os.path.relpath(field.resolve(), scene.resolve().parent)
    head = f"# The mean gait of {len(fit.measured)} cycles of {fit.log.name}, and the connection near it.\n"
    return "\n".join([head, table("system", {"kind": "table", "file": file}), table("gait", gait_table(fit.gait))])
