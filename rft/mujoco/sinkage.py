"""How deep geoms sink under their weight.

A body at rest creeps because the stress is rounded. Where the grains bear F(z) when it
moves straight down fast, it sinks at the speed v at which F(z) v / sqrt(v^2 + e^2) is
its weight, ever more slowly.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import mujoco
import numpy as np

if TYPE_CHECKING:
    from rft.mujoco.bed import Bed

N_DEPTHS = 200  # at which bearing forces are computed
BISECTIONS = 60


def sinkage(
    model: mujoco.MjModel, data: mujoco.MjData, bed: Bed, time: float
) -> tuple[float, float]:
    """Return the depths, m, of `rft.mujoco.sand.Sand.sinkage`; (inf, inf) where the
    grains bear less than the weight at any depth."""
    mass = model.body_subtreemass[np.unique(bed.geoms.roots)].sum()
    # Along the surface the weight does not press.
    weight = float(-mass * (model.opt.gravity @ bed.surface.up))
    deepest = float(model.stat.extent) + 1e-3
    force = _bearing_force(data, bed)
    if force(deepest) < weight:
        return np.inf, np.inf

    low = -deepest
    high = deepest
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        if force(middle) < weight:
            low = middle
        else:
            high = middle
    if not time:
        return high, high
    return high, _depth_after_creep(force, weight, high, deepest, time, bed)


def _bearing_force(data: mujoco.MjData, bed: Bed) -> Callable[[float], float]:
    """Return the function depth -> upward force, N, on geoms that move straight down so
    fast that rounding does not matter; depth: m, below their places in the data."""
    fast = bed.with_rounding(0.0)
    shape = (len(bed.geoms), 3)
    up = bed.surface.up
    down = -np.broadcast_to(up, shape)
    no_spin = np.zeros(shape)

    def force(depth: float) -> float:
        wrenches = fast.wrenches(data, down, no_spin, depth)
        return float((wrenches[:, :3] @ up).sum())

    return force


def _depth_after_creep(
    force: Callable[[float], float],
    weight: float,
    start: float,
    reach: float,
    time: float,
    bed: Bed,
) -> float:
    """Return the depth, m, a time, s, after the geoms have reached the depth ``start``,
    m, at which the grains bear the weight. reach: m, farthest they may creep."""
    # Depths are closer where the creep begins, and is fastest.
    share = np.linspace(0.0, 1.0, N_DEPTHS)
    depth = start + reach * share**2
    bearing = np.array([force(z) for z in depth])

    # Time by depth times the rounding e: e / v = sqrt(F^2 - weight^2) / weight.
    slowness = np.sqrt(np.maximum(bearing**2 - weight**2, 0.0)) / weight
    intervals = np.diff(depth) * (slowness[1:] + slowness[:-1]) / 2
    passed = np.concatenate([[0.0], np.cumsum(intervals)])
    return float(np.interp(time * bed.ground.rounding, passed, depth))
