"""A measured gait, in lines and as JSON has it."""

from __future__ import annotations

from typing import Any

import numpy as np

from geomech.core.variables import Result
from geomech.measured.fit import PRINTED_PHASES, Fitted
from geomech.measured.results import status
from geomech.scenes.write import gait_table
from geomech.systems.base import body_size
from rft.core.refusal import in_line


def numbers(result: Result) -> dict[str, Any]:
    """Return a measured gait as `geomech fit-gait --json` prints it."""
    return fit_numbers(result.subject)


def fit_numbers(fit: Fitted) -> dict[str, Any]:
    """Return the numbers of a fit. Triples are x, y and theta; intervals are (low, high) of each; A, its interval's half width
    and the half width of the data at PRINTED_PHASES phases of the gait."""
    (net, half_width), (mean, mean_half_width) = fit.displacement, fit.mean
    t = 2 * np.pi * np.arange(PRINTED_PHASES) / PRINTED_PHASES
    A, error = fit.along(t)
    residual, rates = (
        fit.measured - fit.predicted,
        [f"{fit.unit}/rad", f"{fit.unit}/rad", "rad/rad"],
    )
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
        "interval": np.stack([net - half_width, net + half_width], -1).tolist(),
        "interval_measured": np.stack([mean - mean_half_width, mean + mean_half_width], -1).tolist(),
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
            "rms": np.sqrt((residual**2).mean(0)).tolist(),
        },
        "body_length": body_size(fit),
        "units": {"displacement": [fit.unit, fit.unit, "rad"], "frequency": "cycles per unit of t", "phase_residual": "rad",
                  "residual": rates, "misfit": rates, "A": rates, "reach": "rad", "body_length": fit.unit},
        "status": status(fit),
    }  # fmt: skip


def reach(fit: Fitted) -> np.ndarray:
    """Return the half width of the data across the gait, rad, in the direction in which it is least, at PRINTED_PHASES."""
    spread = fit.known.spread
    least = np.sqrt(np.linalg.eigvalsh(np.moveaxis(spread, -1, 0))[:, 0])
    return least[np.arange(PRINTED_PHASES) * spread.shape[-1] // PRINTED_PHASES]


def text(result: Result) -> str:
    """Return a measured gait in lines."""
    return described(result.subject)


def described(fit: Fitted) -> str:
    """Return displacement, connection and reach of a measured gait, in lines."""
    (net, half_width), (mean, mean_half_width), unit = (
        fit.displacement,
        fit.mean,
        fit.unit,
    )
    residual, wide = np.sqrt(((fit.measured - fit.predicted) ** 2).mean(0)), reach(fit)
    lines = [
        f"{in_line(fit.log.name)}: {len(fit.measured)} whole cycles of "
        f"{', '.join(fit.log.joints)}, {fit.frequency:.6g} per unit of t",
        f"phase within {fit.irregular:.2g} rad of a uniform run through each",
        f"displacement per cycle, with intervals of {fit.known.level:.3g} of cases:",
        f"{'':10}{'mean of the log':>19}   {'by the connection':>19}   rms of their difference",
    ]
    for k, (name, u) in enumerate((("x", unit), ("y", unit), ("heading", "rad"))):
        pair = f"{mean[k]:11.6f} +-{mean_half_width[k]:7.1e}  {net[k]:11.6f} +-{half_width[k]:7.1e}"
        lines.append(
            f"{name:>8}{pair}   {residual[k]:.2g} of {fit.measured[:, k].std():.2g} {u}"
        )
    explained = "  ".join(
        f"{name} {100 * x:.3g} %"
        for name, x in zip(("x", "y", "heading"), fit.explained)
    )
    return "\n".join([
        *lines,
        f"connection: {fit.known.A.shape[-1] // 2} harmonics in the phase; explained of the body velocity:",
        f"  {explained}",
        f"the data reach {wide.min():.3g} to {wide.max():.3g} rad from the mean gait; status: {status(fit)}",
    ])  # fmt: skip
