"""A wheel that is driven at a given slip: its sinkage, pull and torque."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rft.core.checks import in_range, real_array
from rft.core.refusal import require
from rft.terradynamics.ground import GroundEffect
from rft.terradynamics.plates.loads import loads
from rft.terradynamics.plates.shapes import Shape
from rft.terradynamics.plates.stress import PlateStress

HALVINGS = 40  # of the interval that holds the hub's height
ANGLES = 24  # of a turn of a wheel that is not round


class Rolling(NamedTuple):
    """Rolling of a wheel, (...,) for each slip.

    sinkage: m, of the lowest point. pull: N, of the drawbar, the net force of the
    grains forwards. torque: N m, of the axle. carried: whether the ground bears the
    load; where it does not, the others are nan.

    Examples
    --------
    >>> from rft.terradynamics.plates import StressMap, Wheel
    >>> from rft.terradynamics.walking import rolling
    >>> wheel = Wheel(radius=0.05, width=0.03)
    >>> result = rolling(StressMap(), wheel, load=5.0, rate=2.0, slip=[0.0, 0.3])
    >>> result.sinkage.round(4), result.carried  # m
    (array([0.0088, 0.0115]), array([ True,  True]))
    """

    slip: np.ndarray
    sinkage: np.ndarray
    pull: np.ndarray
    torque: np.ndarray
    carried: np.ndarray


def rolling(
    stress: PlateStress,
    wheel: Shape,
    load: float,
    rate: float,
    slip,
    effects: Sequence[GroundEffect] = (),
    radius: float | None = None,
    elements: int = 100,
) -> Rolling:
    """Return the rolling of a wheel under ``load``, N, that rotates at ``rate``, rad/s,
    and moves level at (1 - slip) rate radius.

    At the hub's height the grains bear the load, in the mean over a turn for a wheel
    with lugs. radius: m, by default the wheel's own. slip: (...,), 0 for pure rolling,
    1 for a wheel that rotates without moving, below 0 for braking. elements: number of
    them in the outline.

    Examples
    --------
    >>> from rft.terradynamics.plates import StressMap, Wheel
    >>> from rft.terradynamics.walking import rolling
    >>> wheel = Wheel(radius=0.05, width=0.03)
    >>> result = rolling(StressMap(), wheel, load=5.0, rate=2.0, slip=[0.0, 0.3])
    >>> result.carried, bool(result.pull[1] > result.pull[0])
    (array([ True,  True]), True)
    """
    slip = real_array("slip", slip)
    outline = wheel.outline(elements)
    if radius is None:
        radius = getattr(wheel, "radius", None)
    require(
        radius is not None,
        f"a {type(wheel).__name__} has no radius",
        instead="give it a radius",
    )
    require(bool((np.abs(slip) <= 100).all()), "slip must be within +-100", value=slip)
    in_range("load", load, 1e-6, 1e6)
    in_range("rate", rate, 1e-9, 1e4)

    # A round wheel looks the same at all angles.
    angles = ANGLES if getattr(wheel, "lugs", 1) else 1
    angle = np.linspace(0.0, 2 * np.pi, angles, endpoint=False)
    v_x = (1.0 - slip) * rate * radius
    twist = np.stack([v_x, np.zeros_like(slip), np.full_like(slip, rate)], -1)
    twist = twist[..., None, :]

    def mean_loads(height):
        pose = np.stack(np.broadcast_arrays(0.0, height[..., None], angle), -1)
        twists = np.broadcast_to(twist, pose.shape)
        force, moment = loads(stress, outline, pose, twists, effects)
        return force.mean(-2), moment.mean(-1)

    def bears_load(height):
        force, _ = mean_loads(height)
        return force[..., 1] >= load

    reach = float(np.hypot(*outline.points.T).max())
    low = np.full(slip.shape, -2 * reach)
    high = np.full(slip.shape, reach)
    carried = bears_load(low)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        bears = bears_load(middle)
        low = np.where(bears, middle, low)
        high = np.where(bears, high, middle)
    height = (low + high) / 2
    force, moment = mean_loads(height)
    return Rolling(
        slip,
        sinkage=np.where(carried, reach - height, np.nan),
        pull=np.where(carried, force[..., 0], np.nan),
        torque=np.where(carried, -moment, np.nan),
        carried=carried,
    )
