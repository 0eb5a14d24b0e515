"""What the uncertainty of a medium does to a displacement: the covariance of its parameters carried to the net pose.

This is no error of the computation but of the question: how far cycles in the sands that drag measurements allow differ. By
the direct tier at sigma points, the parameters and sqrt(3) standard deviations to either side along each principal direction
of their covariance, the nodes of the quadrature of Gauss and Hermite, and one point for each two directions. Where a medium
of the widest points is none, points lie one standard deviation away. Differences to either side give the linear propagation
of the covariance, terms of third order included; second differences c_ij what a quadratic dependence adds to the variance for
normally distributed parameters, (1/2) sum_ij c_ij^2, and by how much it shifts the mean, (1/2) sum_i c_ii. Where they add
little to the variance, linear propagation is right, and stands; where they do not, the sum does. The shift is always there.
"""

from __future__ import annotations

import itertools

import numpy as np

from geomech.gaits import Gait
from geomech.scene.model import Scene
from geomech.study.tables import QUANTITIES, of_pose
from geomech.systems import System
from geomech.systems.capabilities import Uncertain, capability, gaits_per_batch
from geomech.tiers.base import in_groups
from rft.refusal import Refusal, located

PHASES = 64  # of a cycle: changes of displacement are wanted to a per cent, not displacements
NONLINEAR = 1.02  # times the linear standard deviation, from which on the second order counts
REACH = np.sqrt(3.0)  # standard deviations, of sigma points
SHIFTED = 0.1  # of a standard deviation, from which on a shift of the mean is told
SEEN = 1e-6  # body lengths or rad: smaller standard deviations, of second order, are rounding


def root(covariance) -> np.ndarray:
    """Standard deviations along the principal directions as columns (n, m): root @ root.T = covariance (n, n). Directions
    are those of the correlations, so that units do not matter; those without any spread are left out."""
    covariance = np.asarray(covariance, float)
    spread = np.sqrt(np.diag(covariance))
    unit = np.where(spread > 0, spread, 1.0)
    variances, directions = np.linalg.eigh(covariance / unit[:, None] / unit)
    some = variances > 1e-12  # of correlations, whose sum is n
    return (unit[:, None] * directions * np.sqrt(np.maximum(variances, 0.0)))[:, some]


def uncertain(system: System) -> bool:
    """Whether the system has parameters with a covariance."""
    return capability(system, Uncertain) is not None


def points(system: System) -> int:
    """Systems that `of_medium` runs."""
    n = root(capability(system, Uncertain).covariance).shape[1]
    return 1 + 2 * n + n * (n - 1) // 2


def sigma_points(scene: Scene) -> tuple[float, list[tuple[System, System]], dict[tuple[int, int], System]]:
    """(standard deviations to either side, the systems there in every direction, those in any two together, by their
    numbers). Refusal if one is no system a standard deviation away: the covariance then allows what cannot be."""
    try:
        return _points(scene, REACH)
    except Refusal:
        return _points(scene, 1.0)


def _points(scene: Scene, reach: float):
    system = capability(scene.system, Uncertain)
    steps = reach * root(system.covariance).T
    pairs = itertools.combinations(range(len(steps)), 2)
    with located(scene.name):
        near = [(system.varied(s), system.varied(-s)) for s in steps]
        return reach, near, {(i, j): system.varied(steps[i] + steps[j]) for i, j in pairs}


def of_medium(scene: Scene, gait: Gait, amplitudes) -> dict[str, np.ndarray | list[str]] | None:
    """Standard deviations of the net pose for amplitudes (B,), or None for those of gaits side by side: {"x", "y", "heading",
    "net_distance": (B,) in the scene's unit and rad, "position": (B,), of both coordinates together, "rule": [...]},
    "linear" or "second order" for each, and "shift": {the first four: (B,)}, how far the mean over the media lies from the
    pose in their mean. None where the medium is taken for certain. Refusal as of `sigma_points`.

    What is of the net distance is of the position along the direction of the net displacement, which does not fold at 0; the
    deviation is that of the whole position where the distance is smaller than that."""
    system = scene.system
    if not uncertain(system):
        return None
    reach, near, both = sigma_points(scene)
    mid = _moved(system, gait, amplitudes)
    sides = [[_moved(s, gait, amplitudes) for s in pair] for pair in near]
    along = lambda change: _with_distance(mid, change)
    slopes = [along((p - m) / (2 * reach)) for p, m in sides]
    curves = [along((p + m - 2 * mid) / reach**2) for p, m in sides]
    mixed = [along(_moved(s, gait, amplitudes) - sides[i][0] - sides[j][0] + mid) for (i, j), s in both.items()]
    bends = [c / np.sqrt(2) for c in curves] + [c / reach**2 for c in mixed]
    linear, more = (sum((d * d for d in changes), np.zeros((len(mid), 4))) for changes in (slopes, bends))
    size = np.array([system.length, system.length, 1.0])
    bent = (linear + more > NONLINEAR**2 * linear)[:, :3] & (np.sqrt((linear + more)[:, :3]) / size > SEEN)
    variance = linear + np.where(bent.any(1)[:, None], more, 0.0)
    found = dict(zip(QUANTITIES, np.sqrt(variance).T))
    found["position"] = np.hypot(found["x"], found["y"])
    far = of_pose(mid)["net_distance"] >= found["position"]
    found["net_distance"] = np.where(far, found["net_distance"], found["position"])
    shift = sum(curves, np.zeros((len(mid), 4))) / 2
    rule = ["second order" if b else "linear" for b in bent.any(1)]
    return {**found, "shift": dict(zip(QUANTITIES, shift.T)), "rule": rule}


def _with_distance(poses: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Changes (B, 3) of net poses (B, 3) with that along the net displacement, QUANTITIES (B, 4)."""
    direction = poses[:, :2] / np.maximum(of_pose(poses)["net_distance"], 1e-300)[:, None]
    return np.column_stack([change, (change[:, :2] * direction).sum(1)])


def _moved(system: System, gait: Gait, amplitudes) -> np.ndarray:
    """Net poses (B, 3)."""
    phases = max(PHASES, 8 * gait.harmonics)
    run = lambda some: system.run(*gait.cycle(phases, some)).net
    if amplitudes is None:
        return run(None)
    return in_groups(run, amplitudes, gaits_per_batch(system, phases))
