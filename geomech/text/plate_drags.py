"""Nine coefficients fitted to plate drags: in lines, as JSON has them, and as a medium."""

from __future__ import annotations

import json
from typing import Any

from geomech.core.variables import Result
from geomech.text.rod_drag import MOST_ROWS, RESIDUALS
from rft.core.refusal import in_line

OF_COEFFICIENTS = "coefficient", "value", "interval", "resolution"


def numbers(result: Result) -> dict[str, Any]:
    """Return the coefficients as JSON has them; intervals with 95 %, resolution: the share that comes from the data."""
    names = result["coefficient"].values.tolist()
    by_name = lambda values: dict(zip(names, values.tolist()))
    return {
        "law": "stress-map",
        **by_name(result["value"].values),
        "zeta": result.subject.zeta,
        "covariance": result.subject.covariance.tolist(),
        "rms": result.attributes["rms"],
        "parameters": names,
        "errors": by_name(result["value"].error),
        "intervals": by_name(result["interval"].values),
        "resolution": by_name(result["resolution"].values),
        "undetermined": result.attributes["undetermined"],
        "residuals": {
            **{
                f"{name}_deg": result[name].values.tolist()
                for name in ("beta", "gamma")
            },
            **dict(zip(("alpha_x", "alpha_z"), result["residual"].values.tolist())),
        },
        "status": "converged",
    }


def text(result: Result) -> str:
    """Return the coefficients, what the map does over its plane, and a few residuals in lines."""
    return _lines(result, MOST_ROWS)


def full(result: Result) -> str:
    """Return the coefficients, what the map does over its plane, and all residuals in lines."""
    return _lines(result, result["beta"].values.size)


def _lines(result: Result, most: int) -> str:
    facts, zeta, beta = result.attributes, result.subject.zeta, result["beta"].values
    lines = [
        f"stress map fitted to {in_line(facts['name'])}: {beta.size} plate drags",
        "         N/cm^3   95 % interval        from the data   generic set times zeta",
    ]
    for name, x, (low, high), share, y in zip(
        *(result[v].values for v in (*OF_COEFFICIENTS, "generic"))
    ):
        lines.append(
            f"{name:5}{x:10.4f}   {low:7.4f} to {high:7.4f}{100 * abs(share):13.0f} %{y:16.4f}"
        )
    lines.append(
        f"zeta of the generic set that comes nearest: {zeta:.4g}; rms residual {facts['rms']:.3g} N/cm^3"
    )
    lines.append(f"the map {facts['map']}")
    if beta.size > most:
        return "\n".join([*lines, RESIDUALS])
    lines.append("    beta   gamma   alpha_x       map   alpha_z       map")
    stress, fitted = (
        result["stress"].values,
        result["stress"].values - result["residual"].values,
    )
    for b, g, (x, z), (map_x, map_z) in zip(
        beta, result["gamma"].values, stress.T, fitted.T
    ):
        lines.append(f"{b:8.4g}{g:8.4g}{x:10.4f}{map_x:10.4f}{z:10.4f}{map_z:10.4f}")
    return "\n".join(lines)


def medium(result: Result) -> str:
    """Return a file for `geomech stress` and the [medium] of intruder scenes."""
    facts, n_drags = result.attributes, result["beta"].values.size
    lines = [
        f"# Fitted to {json.dumps(facts['name'])}: {n_drags} plate drags, rms residual {facts['rms']:.3g} N/cm^3.",
        "[medium]  # N/cm^3; within, with 95 %:",
    ]
    for name, x, (low, high), share in zip(
        *(result[v].values.tolist() for v in OF_COEFFICIENTS)
    ):
        lacking = (
            f"; {100 * (1 - share):.0f} % of it from the generic shape"
            if name in facts["undetermined"]
            else ""
        )
        lines.append(f"{name} = {x!r}  # {low:.4g} to {high:.4g}{lacking}")
    return "\n".join(lines) + "\n"
