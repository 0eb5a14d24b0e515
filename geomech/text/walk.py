"""The walk of a robot, in lines."""

from __future__ import annotations

from typing import Any

import numpy as np

from geomech.core.variables import Result
from geomech.studies import walking
from geomech.studies.walking import Walked
from rft.refusal import in_line

SERIES = "t", "x", "z", "pitch"  # of the table, that JSON has


def numbers(result: Result) -> dict[str, Any]:
    """Return a walk as JSON has it, in SI units and rad. settled: None where it is not known, or infinite."""
    w, found = result.subject[1].walk, result.subject[1]
    series = {name: result[name].values.tolist() for name in SERIES}
    return {
        "speed": w.speed,
        "status": w.status,
        **series,
        "cycles": w.cycles,
        "estimate": found.estimate,
        "periodic": w.periodic,
        "unsolved": w.unsolved,
        "residual": w.residual,
        "unaccounted": w.unaccounted,
        "settled": w.settling_time if np.isfinite(w.settling_time) else None,
        "aside": w.lateral_speed,
        "turning": w.yaw_rate,
        "estimate_aside": found.lateral,
        "estimate_turning": found.turning,
        "estimate_elements": found.elements,
    }


def text(result: Result) -> str:
    """Return speed, status and energy of a walk."""
    scene, found = result.subject
    w, f, cost = (
        found.walk,
        scene.gait.frequency,
        walking.cost_of_transport(scene, found.walk),
    )
    known = w.status == "walking" and np.isfinite(cost)
    share = (
        f", cost of transport {cost:.3g} (work over weight times distance, from rest)"
        if known
        else ""
    )
    return "\n".join([
        f"{in_line(scene.name)}: {w.status} at {w.speed:.4g} +- "
        f"{found.estimate:.1g} m/s at {f:g} Hz ({_regular(w)}{_settling(w)})",
        f"of the error {found.elements:.1g} m/s are of the elements, from twice as many",
        *_turning(found),
        f"t = 0 to {w.t[-1]:.4g} s: x to {w.pose[-1, 0]:.4g} m, z {w.pose[:, 1].min():.4g} to {w.pose[:, 1].max():.4g} m, "
        f"pitch {np.degrees(w.pose[:, 2].min()):.3g} to {np.degrees(w.pose[:, 2].max()):.3g} degrees (positive: nose down)",
        *_lateral(w),
        f"effort: work of the motors {w.work[-1]:.4g} J{share}",
        f"into the ground {w.loss[-1]:.4g} J; not accounted for, by the steps: {100 * w.unaccounted:.1g} % of the work",
        *([_unsolved(w)] if w.unsolved else []),
    ])  # fmt: skip


def _regular(walk) -> str:
    return (
        "limit cycle"
        if walk.periodic
        else "no limit cycle found: mean of what there is"
    )


def _settling(walk) -> str:
    """Return the time that a robot takes from rest to the limit cycle, in words."""
    if np.isnan(walk.settling_time):
        return ""
    within = f"within {100 * walking.NEAR:g} % of it"
    if np.isinf(walk.settling_time):
        return f"; from rest it does not come {within}"
    return (
        f"; from rest {within} after {walk.settling_time:.2g} s"
        if walk.settling_time
        else f"; {within} from the start"
    )


def _turning(found: Walked) -> list[str]:
    """Return the yaw rate and the drift of a walk of three dimensions."""
    w = found.walk
    if not w.spatial:
        return []
    turning, error = np.degrees([w.yaw_rate, found.turning])
    drift = f"drifting aside at {w.lateral_speed:.2g} +- {found.lateral:.1g} m/s"
    return [
        f"turning at {turning:.2g} +- {error:.1g} degrees/s, {drift} (positive: to the left of its heading)"
    ]


def _unsolved(walk) -> str:
    residual = f"off by up to {walk.residual:.1g} m/s, which moves the speed by {walk.unsolved_error:.1g} m/s"
    return f"{walk.unsolved} steps were taken unsolved, {residual}: raise [numerics] steps or rounding"


def _lateral(walk) -> list[str]:
    """Return the sideways motion, roll and yaw of a walk of three dimensions."""
    if not walk.spatial:
        return []
    y, roll, yaw = (walk.spatial[name] for name in ("y", "roll", "yaw"))
    angles = ", ".join(
        f"{name} {np.degrees(a.min()):.2g} to {np.degrees(a.max()):.2g}"
        for name, a in (("roll", roll), ("yaw", yaw))
    )
    return [
        f"aside to y {y[-1]:.2g} m, {angles} degrees (positive: left side up, turning left)"
    ]
