"""How deep geoms sink under their weight.

A body at rest creeps because the stress is rounded. Where the grains bear F(z) when it moves straight down fast, it sinks
at the speed v at which F(z) v / sqrt(v^2 + e^2) is its weight, ever more slowly.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import mujoco
import numpy as np

if TYPE_CHECKING:
    from rft.mujoco.bed import Bed

DEPTHS = 200  # at which bearing forces are computed


def sinkage(
    model: mujoco.MjModel, data: mujoco.MjData, bed: Bed, time: float
) -> tuple[float, float]:
    """Return `rft.mujoco.sand.Sand.sinkage`; (inf, inf) where the grains bear less than the weight at any depth."""
    weight = float(
        model.body_subtreemass[np.unique(bed.roots)].sum()
        * np.linalg.norm(model.opt.gravity)
    )
    down, still, fast = (
        -np.broadcast_to(bed.up, (len(bed.geoms), 3)),
        np.zeros((len(bed.geoms), 3)),
        bed.rounded(0.0),
    )
    force = lambda depth: float(
        (fast.wrenches(data, down, still, depth)[:, :3] @ bed.up).sum()
    )
    deepest = float(model.stat.extent) + 1e-3
    low, high = -deepest, deepest
    if force(high) < weight:
        return np.inf, np.inf
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if force(middle) < weight else (low, middle)
    depth = np.linspace(high, high + deepest, DEPTHS) if time else np.array([high])
    depth = high + (depth - high) ** 2 / deepest  # finer where it begins
    slowness = (
        np.sqrt(np.maximum(np.array([force(z) for z in depth]) ** 2 - weight**2, 0.0))
        / weight
    )
    passed = np.concatenate(
        [[0.0], np.cumsum(np.diff(depth) * (slowness[1:] + slowness[:-1]) / 2)]
    )
    return high, float(np.interp(time * bed.ground.rounding, passed, depth))
