"""How a time step and the masses round the forces of grains, and what a body at rest sinks because of it.

The stress on an element depends on the direction of its velocity alone, so it jumps at rest. Rounded over a speed e, a
load S resists slow motion like a damper S / e. MuJoCo holds passive forces during a step h, also by its implicit
integrators. A mass m that creeps is then multiplied by 1 - h S / (e m) in a step; where that is below -1 it chatters, at up
to h S / 2 m. It does not for

    e >= h S / (2 m),

with S the weight of the robot, that any one geom may bear, and 1 / m the geom's inverse mass as the joints let it move
(``body_invweight0``). A free body so needs h g / 2: 1 cm/s at 2 ms. Light legs need more: shorter steps, or ``armature``
on their joints, as geared motors have it.

A body at rest then creeps. Where the grains bear F(z) when it moves straight down fast, it sinks at the speed v at which
F(z) v / sqrt(v^2 + e^2) is its weight, ever more slowly.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import mujoco
import numpy as np

if TYPE_CHECKING:
    from rft.mujoco.bed import Bed

COARSE = 0.1  # assumed: a rounding above that share of sqrt(g L), L the size of the robot, changes how it moves
ROOM = 1.01  # a rounding that is short of what is needed by less than that is no fault
DEPTHS = 200  # at which bearing forces are computed


def loads_and_masses(
    model: mujoco.MjModel, geoms: Sequence[int]
) -> tuple[np.ndarray, np.ndarray]:
    """Return for each geom the weight of its robot, N, and the inverse mass of its body as joints let it move, 1/kg, (G,)."""
    bodies = model.geom_bodyid[list(geoms)]
    weight = model.body_subtreemass[model.body_rootid[bodies]] * np.linalg.norm(
        model.opt.gravity
    )
    return weight, model.body_invweight0[bodies, 0]


def needed_rounding(model: mujoco.MjModel, geoms: Sequence[int]) -> float:
    """Return the rounding, m/s, that the model's time step asks for, so that no geom chatters at rest."""
    weight, inverse_mass = loads_and_masses(model, geoms)
    return float(model.opt.timestep * (weight * inverse_mass).max() / 2)


def step_note(model: mujoco.MjModel, geoms: Sequence[int], rounding: float) -> str:
    """Return a line about a time step that is too long for a rounding, m/s, or for the robot; "" for none."""
    needed, step = needed_rounding(model, geoms), model.opt.timestep
    coarse = COARSE * float(
        np.sqrt(np.linalg.norm(model.opt.gravity) * 2 * model.stat.extent)
    )
    described = f"a time step of {1e3 * step:.3g} ms"
    if rounding * ROOM < needed:
        return (
            f"{described} asks for a rounding of {needed:.2g} m/s, the sand has {rounding:.2g}: light geoms may chatter at"
            f" up to {needed:.2g} m/s; steps of {1e3 * step * rounding / needed:.2g} ms would not"
        )
    if rounding > coarse > 0:
        return (
            f"the rounding of {rounding:.2g} m/s, for {described}, lets geoms creep at a speed that matters: with steps of"
            f" {1e3 * step * coarse / rounding:.2g} ms, or more armature, it would be {coarse:.2g}"
        )
    return ""


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
