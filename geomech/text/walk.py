"""How a robot walks, in lines."""

from __future__ import annotations

from typing import Any

import numpy as np

from geomech.core.variables import Result
from geomech.scene.walker import WalkerScene
from geomech.study import walking
from geomech.study.walking import Walked

SERIES = "t", "x", "z", "pitch"  # of the table, that JSON has


def numbers(result: Result) -> dict[str, Any]:
    """Return SI units and rad. settled: None where it is not known, or never."""
    w, found = result.subject[1].walk, result.subject[1]
    series = {name: result[name].values.tolist() for name in SERIES}
    told = {"cycles": w.cycles, "estimate": found.estimate, "periodic": w.periodic, "unsolved": w.unsolved}
    told |= {"residual": w.residual, "unaccounted": w.unaccounted}
    told |= {"settled": w.settling_time if np.isfinite(w.settling_time) else None}
    told |= {"aside": w.lateral_speed, "turning": w.yaw_rate}
    told |= {"estimate_aside": found.lateral, "estimate_turning": found.turning, "estimate_elements": found.elements}
    return {"speed": w.speed, "status": w.status, **series, **told}


def text(result: Result) -> str:
    """Return speed, status and energy."""
    return told(*result.subject)


def told(scene: WalkerScene, found: Walked) -> str:
    """Return speed, status and energy of a walk."""
    w, f, cost = found.walk, scene.gait.frequency, walking.cost_of_transport(scene, found.walk)
    known = w.status == "walking" and np.isfinite(cost)
    share = f", cost of transport {cost:.3g} (work over weight times way, from rest)" if known else ""
    return "\n".join([
        f"{scene.name}: {w.status} at {w.speed:.4g} +- {found.estimate:.1g} m/s at {f:g} Hz ({_regular(w)}{_settled(w)})",
        f"of the error {found.elements:.1g} m/s are of the elements, from twice as many",
        *_turning(found),
        f"t = 0 to {w.t[-1]:.4g} s: x to {w.pose[-1, 0]:.4g} m, z {w.pose[:, 1].min():.4g} to {w.pose[:, 1].max():.4g} m, "
        f"pitch {np.degrees(w.pose[:, 2].min()):.3g} to {np.degrees(w.pose[:, 2].max()):.3g} degrees (positive: nose down)",
        *_aside(w),
        f"work of the motors {w.work[-1]:.4g} J{share}; into the ground {w.loss[-1]:.4g} J; "
        f"{100 * w.unaccounted:.1g} % of the work is not accounted for, an error of the time steps",
        *([_unsolved(w)] if w.unsolved else []),
    ])  # fmt: skip


def _regular(walk) -> str:
    return "limit cycle" if walk.periodic else "no limit cycle found: mean of what there is"


def _settled(walk) -> str:
    """When a robot that starts from rest goes on as the limit cycle does."""
    if np.isnan(walk.settling_time):
        return ""
    within = f"within {100 * walking.NEAR:g} % of it"
    if np.isinf(walk.settling_time):
        return f"; from rest it does not come {within}"
    return (
        f"; from rest {within} after {walk.settling_time:.2g} s" if walk.settling_time else f"; {within} from the start"
    )


def _turning(found: Walked) -> list[str]:
    """How a robot of three dimensions leaves its heading."""
    w = found.walk
    if not w.spatial:
        return []
    turning, error = np.degrees([w.yaw_rate, found.turning])
    aside = f"drifting aside at {w.lateral_speed:.2g} +- {found.lateral:.1g} m/s"
    return [f"turning at {turning:.2g} +- {error:.1g} degrees/s, {aside} (positive: to the left of its heading)"]


def _unsolved(walk) -> str:
    off = f"off by up to {walk.residual:.1g} m/s, which moves the speed by {walk.unsolved_error:.1g} m/s"
    return f"{walk.unsolved} steps were taken unsolved, {off}: raise [numerics] steps or rounding"


def _aside(walk) -> list[str]:
    """What a walk of three dimensions does besides."""
    if not walk.spatial:
        return []
    y, roll, yaw = (walk.spatial[name] for name in ("y", "roll", "yaw"))
    angles = ", ".join(
        f"{name} {np.degrees(a.min()):.2g} to {np.degrees(a.max()):.2g}" for name, a in (("roll", roll), ("yaw", yaw))
    )
    return [f"aside to y {y[-1]:.2g} m, {angles} degrees (positive: left side up, turning left)"]
