"""Effect of an uncertain medium on a displacement: the covariance of its parameters propagated to the net pose.

This is no error of the computation but of the question: how far cycles in media that the drag measurements allow
differ. The direct tier runs at sigma points: the parameters, and sqrt(3) standard deviations to either side along each
principal direction of their covariance, which are the nodes of Gauss-Hermite quadrature, and one point for each pair of
directions. Where the widest points make no medium, points lie one standard deviation away. Differences to either side
give the linear propagation of the covariance, terms of third order included; second differences c_ij give the
contribution of a quadratic dependence to the variance for normally distributed parameters, (1/2) sum_ij c_ij^2, and the
shift of the mean, (1/2) sum_i c_ii. Where the quadratic contribution to the variance is small, linear propagation is
used; otherwise the sum. The shift is always reported."""

from __future__ import annotations

import itertools

import numpy as np

from geomech.mathematics.gaits import Gait
from geomech.mathematics.systems import System
from geomech.mathematics.systems.base import body_size
from geomech.mathematics.systems.capabilities import (
    Uncertain,
    capability,
    gaits_per_batch,
)
from geomech.mathematics.tiers.base import in_groups
from geomech.scenes.model import Scene
from geomech.studies.tables import QUANTITIES, pose_quantities
from rft.core.checks import unmasked
from rft.core.refusal import Refusal, located

PHASES = 64  # of a cycle: enough for changes of displacement to a per cent
NONLINEAR = (
    1.02  # times the linear standard deviation, from which on the second order counts
)
DEVIATIONS = np.sqrt(3.0)  # standard deviations, of sigma points
SMALLEST_SHIFT = (
    0.1  # of a standard deviation, from which on a shift of the mean is printed
)
SMALLEST_SPREAD = 1e-6  # body lengths or rad: smaller standard deviations of second order are roundoff


def covariance_root(covariance) -> np.ndarray:
    """Return standard deviations along the principal directions as columns (n, m): root @ root.T = covariance (n, n).

    Directions are those of the correlations, so that units do not matter; those without any spread are left out."""
    covariance = unmasked("covariance", covariance)
    spread = np.sqrt(np.diag(covariance))
    unit = np.where(spread > 0, spread, 1.0)
    variances, directions = np.linalg.eigh(covariance / unit[:, None] / unit)
    varying = variances > 1e-12  # of correlations, whose sum is n
    return (unit[:, None] * directions * np.sqrt(np.maximum(variances, 0.0)))[
        :, varying
    ]


def is_uncertain(system: System) -> bool:
    """Return whether the system has parameters with a covariance."""
    return capability(system, Uncertain) is not None


def n_systems(system: System) -> int:
    """Return the number of systems that `medium_spread` runs."""
    n = covariance_root(capability(system, Uncertain).covariance).shape[1]
    return 1 + 2 * n + n * (n - 1) // 2


def sigma_points(
    scene: Scene,
) -> tuple[float, list[tuple[System, System]], dict[tuple[int, int], System]]:
    """Return the number of standard deviations to either side, the systems there in every direction, and those in every
    pair of directions, by their numbers. Refusal if one is no system a standard deviation away: the covariance then
    allows impossible media."""
    try:
        return _sigma_points_at(scene, DEVIATIONS)
    except Refusal:
        return _sigma_points_at(scene, 1.0)


def _sigma_points_at(scene: Scene, deviations: float):
    system = capability(scene.system, Uncertain)
    steps = deviations * covariance_root(system.covariance).T
    pairs = itertools.combinations(range(len(steps)), 2)
    with located(scene.name):
        near = [(system.varied(s), system.varied(-s)) for s in steps]
        return (
            deviations,
            near,
            {(i, j): system.varied(steps[i] + steps[j]) for i, j in pairs},
        )


def medium_spread(
    scene: Scene, gait: Gait, amplitudes
) -> dict[str, np.ndarray | list[str]] | None:
    """Return standard deviations of the net pose by the medium; None for a certain medium. Refusal as of
    `sigma_points`.

    For amplitudes (B,), or None for gaits in a batch: {"x", "y", "heading", "net_distance": (B,) in the scene's unit
    and rad, "position": (B,), of both coordinates together, "rule": [...]}, "linear" or "second order" for each, and
    "shift": {the first four: (B,)}, the difference between the mean over the media and the pose in their mean.

    The deviation of the net distance is that of the position along the net displacement, which has no kink at 0; where
    the distance is smaller than the deviation of the whole position, it is the latter."""
    system = scene.system
    if not is_uncertain(system):
        return None
    deviations, near, both = sigma_points(scene)
    mid = _net_poses(system, gait, amplitudes)
    sides = [[_net_poses(s, gait, amplitudes) for s in pair] for pair in near]
    along = lambda change: _with_distance(mid, change)
    slopes = [along((p - m) / (2 * deviations)) for p, m in sides]
    curves = [along((p + m - 2 * mid) / deviations**2) for p, m in sides]
    mixed = [
        along(_net_poses(s, gait, amplitudes) - sides[i][0] - sides[j][0] + mid)
        for (i, j), s in both.items()
    ]
    bends = [c / np.sqrt(2) for c in curves] + [c / deviations**2 for c in mixed]
    linear, more = (
        sum((d * d for d in changes), np.zeros((len(mid), 4)))
        for changes in (slopes, bends)
    )
    size = np.array([body_size(system), body_size(system), 1.0])
    bent = (linear + more > NONLINEAR**2 * linear)[:, :3] & (
        np.sqrt((linear + more)[:, :3]) / size > SMALLEST_SPREAD
    )
    variance = linear + np.where(bent.any(1)[:, None], more, 0.0)
    spread = dict(zip(QUANTITIES, np.sqrt(variance).T))
    spread["position"] = np.hypot(spread["x"], spread["y"])
    far = pose_quantities(mid)["net_distance"] >= spread["position"]
    spread["net_distance"] = np.where(far, spread["net_distance"], spread["position"])
    shift = sum(curves, np.zeros((len(mid), 4))) / 2
    rule = ["second order" if b else "linear" for b in bent.any(1)]
    return {**spread, "shift": dict(zip(QUANTITIES, shift.T)), "rule": rule}


def _with_distance(poses: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Return changes (B, 3) of net poses (B, 3) with the change along the net displacement, QUANTITIES (B, 4)."""
    direction = (
        poses[:, :2]
        / np.maximum(pose_quantities(poses)["net_distance"], 1e-300)[:, None]
    )
    return np.column_stack([change, (change[:, :2] * direction).sum(1)])


def _net_poses(system: System, gait: Gait, amplitudes) -> np.ndarray:
    """Return net poses (B, 3)."""
    phases = max(PHASES, 8 * gait.harmonics)
    run = lambda amplitudes: system.run(*gait.cycle(phases, amplitudes)).net
    if amplitudes is None:
        return run(None)
    return in_groups(run, amplitudes, gaits_per_batch(system, phases))
