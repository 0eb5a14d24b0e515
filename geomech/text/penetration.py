"""zeta fitted to a penetration test: in lines, as JSON has it, and as a medium."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from geomech.core.variables import Result


def numbers(result: Result) -> dict[str, Any]:
    """Return zeta as JSON has it; interval with 95 %."""
    f, area = result.subject, result["area"].values.tolist()
    return {
        "law": "zeta",
        "zeta": f.zeta,
        "error": f.error,
        "interval": f.interval.tolist(),
        "covariance": [[f.error**2]],
        "parameters": ["zeta"],
        "area": area[0] if len(area) == 1 else area,
        "zero_depth": f.zero if np.isfinite(f.zero) else None,
        "rms": result.attributes["rms"],
        "residuals": {"depth": f.depth.tolist(), "force": (f.force - f.law).tolist()},
        "status": "converged",
    }


def text(result: Result) -> str:
    """Return zeta, its interval and the residual in lines."""
    f, facts = result.subject, result.attributes
    low, high = f.interval
    return (
        f"zeta fitted to {facts['name']}: {f.depth.size} depths to {1e2 * f.depth[-1]:.3g} cm\n"
        f"zeta     {f.zeta:10.5g}, {low:.4g} to {high:.4g} with 95 %\n"
        f"straight down a plate feels {f.zeta:.4g} N/cm^3; rms residual {facts['rms']:.3g} N"
    )


def medium(result: Result) -> str:
    """Return a file for `geomech stress` and the [medium] of intruder scenes."""
    f, facts = result.subject, result.attributes
    low, high = f.interval
    return (
        f"# Fitted to {json.dumps(facts['name'])}: {f.depth.size} depths, rms residual {facts['rms']:.3g} N.\n"
        f"[medium]  # the generic set times\nzeta = {f.zeta!r}  # {low:.4g} to {high:.4g} with 95 %\n"
    )
