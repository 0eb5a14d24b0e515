"""Effect of an uncertain medium on a displacement: the covariance of its parameters,
propagated to the net pose.

This is no error of the computation but of the question: how far cycles differ in media
that the drag measurements allow. The direct tier runs at sigma points: the parameters
themselves; sqrt(3) standard deviations to either side along each principal direction of
their covariance, which are the nodes of Gauss-Hermite quadrature; and one point for
each pair of directions. Where the widest points make no medium, points lie one standard
deviation away.

Differences to either side give the linear propagation of the covariance, terms of third
order included. Second differences c_ij give the contribution of a quadratic dependence
for normally distributed parameters: to the variance (1/2) sum_ij c_ij^2, and to the
mean (1/2) sum_i c_ii. Where the contribution to the variance is small, linear
propagation is used; otherwise the sum. The shift of the mean is always reported."""

from __future__ import annotations

import itertools
from typing import NamedTuple

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
from geomech.studies.displacement.variables import QUANTITIES, pose_quantities
from rft.core.checks import unmasked
from rft.core.refusal import Refusal, located

PHASES = 64  # of a cycle: enough for changes of displacement to a per cent
# Times the linear standard deviation, from which on the second order counts.
NONLINEAR = 1.02
DEVIATIONS = np.sqrt(3.0)  # standard deviations, of sigma points
# Of a standard deviation, from which on a shift of the mean is printed.
SMALLEST_SHIFT = 0.1
# Body lengths or rad: smaller standard deviations of second order are roundoff.
SMALLEST_SPREAD = 1e-6


class SigmaPoints(NamedTuple):
    """Systems with other parameters of the medium.

    deviations: number of standard deviations to either side. sides: the two systems in
    each direction. pairs: the system in each pair of directions, by their numbers."""

    deviations: float
    sides: list[tuple[System, System]]
    pairs: dict[tuple[int, int], System]


def covariance_root(covariance) -> np.ndarray:
    """Return standard deviations along the principal directions as columns (n, m):
    root @ root.T = covariance (n, n).

    Directions are those of the correlations, so that units do not matter. Directions
    without any spread are left out."""
    covariance = unmasked("covariance", covariance)
    spread = np.sqrt(np.diag(covariance))
    unit = np.where(spread > 0, spread, 1.0)
    variances, directions = np.linalg.eigh(covariance / unit[:, None] / unit)
    has_spread = variances > 1e-12  # of correlations, whose sum is n
    deviations = np.sqrt(np.maximum(variances, 0.0))
    return (unit[:, None] * directions * deviations)[:, has_spread]


def is_uncertain(system: System) -> bool:
    """Return whether the system has parameters with a covariance."""
    return capability(system, Uncertain) is not None


def n_systems(system: System) -> int:
    """Return the number of systems that `medium_spread` runs."""
    n = covariance_root(capability(system, Uncertain).covariance).shape[1]
    return 1 + 2 * n + n * (n - 1) // 2


def sigma_points(scene: Scene) -> SigmaPoints:
    """Return the systems at the sigma points. Refusal if one is no system a standard
    deviation away: the covariance then allows impossible media."""
    try:
        return _sigma_points_at(scene, DEVIATIONS)
    except Refusal:
        return _sigma_points_at(scene, 1.0)


def _sigma_points_at(scene: Scene, deviations: float) -> SigmaPoints:
    system = capability(scene.system, Uncertain)
    steps = deviations * covariance_root(system.covariance).T
    with located(scene.name):
        sides = [(system.varied(step), system.varied(-step)) for step in steps]
        pairs = {}
        for i, j in itertools.combinations(range(len(steps)), 2):
            pairs[i, j] = system.varied(steps[i] + steps[j])
        return SigmaPoints(deviations, sides, pairs)


def medium_spread(
    scene: Scene, gait: Gait, amplitudes
) -> dict[str, np.ndarray | list[str]] | None:
    """Return standard deviations of the net pose by the medium; None for a certain
    medium.
    Refusal as of `sigma_points`.

    amplitudes: (B,), or None for gaits in a batch.

    Returns {"x", "y", "heading", "net_distance": (B,) in the scene's unit and rad,
    "position": (B,), of both coordinates together, "rule": "linear" or "second order"
    for each amplitude, "shift": {the first four: (B,)}}. The shift is the difference
    between the mean over the media and the pose in their mean.

    The deviation of the net distance is that of the position along the net
    displacement, which has no kink at 0. Where the distance is smaller than the
    deviation of the whole position, it is the latter."""
    system = scene.system
    if not is_uncertain(system):
        return None
    points = sigma_points(scene)
    poses = _net_poses(system, gait, amplitudes)
    linear, curvatures, second_order = _variances(points, poses, gait, amplitudes)

    size = np.array([body_size(system), body_size(system), 1.0])
    total = linear + second_order
    is_larger = (total > NONLINEAR**2 * linear)[:, :3]
    is_above_roundoff = np.sqrt(total[:, :3]) / size > SMALLEST_SPREAD
    is_nonlinear = (is_larger & is_above_roundoff).any(1)
    variance = linear + np.where(is_nonlinear[:, None], second_order, 0.0)

    spread = dict(zip(QUANTITIES, np.sqrt(variance).T))
    spread["position"] = np.hypot(spread["x"], spread["y"])
    is_far = pose_quantities(poses)["net_distance"] >= spread["position"]
    spread["net_distance"] = np.where(
        is_far, spread["net_distance"], spread["position"]
    )
    shift = sum(curvatures, np.zeros((len(poses), 4))) / 2
    rules = ["second order" if nonlinear else "linear" for nonlinear in is_nonlinear]
    return {**spread, "shift": dict(zip(QUANTITIES, shift.T)), "rule": rules}


def _variances(
    points: SigmaPoints, poses: np.ndarray, gait: Gait, amplitudes
) -> tuple[np.ndarray, list[np.ndarray], np.ndarray]:
    """Return the linear variance of QUANTITIES (B, 4), their second differences along
    each direction, and the variance of second order.

    poses: (B, 3), in the mean of the media."""
    sides = []
    for plus, minus in points.sides:
        plus_poses = _net_poses(plus, gait, amplitudes)
        sides.append((plus_poses, _net_poses(minus, gait, amplitudes)))

    slopes = []
    curvatures = []
    second_order = []
    for plus, minus in sides:
        slope = (plus - minus) / (2 * points.deviations)
        curvature = (plus + minus - 2 * poses) / points.deviations**2
        slopes.append(_with_distance(poses, slope))
        curvatures.append(_with_distance(poses, curvature))
        second_order.append(curvatures[-1] / np.sqrt(2))
    for (i, j), system in points.pairs.items():
        pair_poses = _net_poses(system, gait, amplitudes)
        mixed = _with_distance(poses, pair_poses - sides[i][0] - sides[j][0] + poses)
        second_order.append(mixed / points.deviations**2)
    return (
        _sum_of_squares(slopes, poses),
        curvatures,
        _sum_of_squares(second_order, poses),
    )


def _sum_of_squares(changes: list[np.ndarray], poses: np.ndarray) -> np.ndarray:
    """Return the sum of squares of changes of QUANTITIES, (B, 4), 0 without any."""
    return sum((change * change for change in changes), np.zeros((len(poses), 4)))


def _with_distance(poses: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Return changes (B, 3) of net poses (B, 3) with the change along the net
    displacement, QUANTITIES (B, 4)."""
    distance = np.maximum(pose_quantities(poses)["net_distance"], 1e-300)
    direction = poses[:, :2] / distance[:, None]
    return np.column_stack([change, (change[:, :2] * direction).sum(1)])


def _net_poses(system: System, gait: Gait, amplitudes) -> np.ndarray:
    """Return the net poses (B, 3) of a gait by the direct tier."""
    phases = max(PHASES, 8 * gait.harmonics)

    def run(amplitudes):
        return system.run(*gait.cycle(phases, amplitudes)).net

    if amplitudes is None:
        return run(None)
    return in_groups(run, amplitudes, gaits_per_batch(system, phases))
