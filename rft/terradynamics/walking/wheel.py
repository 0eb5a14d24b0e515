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
    """Rolling of a wheel, (...,) for each slip. sinkage: m, of the lowest point. pull:
    N, of the drawbar, the net force of the grains forwards. torque: N m, of the axle.
    carried: whether the ground bears the load; where not, the others are nan.

    Examples
    --------
    >>> from rft.terradynamics.plates import StressMap, Wheel
    >>> from rft.terradynamics.walking import rolling
    >>> found = rolling(StressMap(), Wheel(radius=0.05, width=0.03), load=5.0, rate=2.0, slip=[0.0, 0.3])
    >>> found.sinkage.round(4), found.carried  # m
    (array([0.0088, 0.0115]), array([ True,  True]))
    """

    slip: np.ndarray
    sinkage: np.ndarray
    pull: np.ndarray
    torque: np.ndarray
    carried: np.ndarray


def rolling(
    stress: PlateStress, wheel: Shape, load: float, rate: float, slip, effects: Sequence[GroundEffect] = (),
    radius: float | None = None, elements: int = 100,
) -> Rolling:  # fmt: skip
    """Return the rolling of a wheel under ``load``, N, that rotates at ``rate``, rad/s,
    and moves level at (1 - slip) rate radius.

    At the hub's height the grains bear the load, in the mean over a turn for a wheel
    with lugs. radius: m, by default the wheel's own. slip: (...,), 0 for pure rolling,
    1 for a wheel that rotates without moving, below 0 for braking.

    Examples
    --------
    >>> from rft.terradynamics.plates import StressMap, Wheel
    >>> from rft.terradynamics.walking import rolling
    >>> wheel = rolling(StressMap(), Wheel(radius=0.05, width=0.03), load=5.0, rate=2.0, slip=[0.0, 0.3])
    >>> wheel.carried, bool(wheel.pull[1] > wheel.pull[0])
    (array([ True,  True]), True)
    """
    slip = real_array("slip", slip)
    points = wheel.outline(elements)
    radius = getattr(wheel, "radius", None) if radius is None else radius
    require(
        radius is not None,
        f"a {type(wheel).__name__} has no radius",
        instead="give one",
    )
    require(bool((np.abs(slip) <= 100).all()), "slip must be within +-100", value=slip)
    in_range("load", load, 1e-6, 1e6)
    in_range("rate", rate, 1e-9, 1e4)
    reach = float(np.hypot(*points.points.T).max())
    angle = np.linspace(
        0.0, 2 * np.pi, ANGLES if getattr(wheel, "lugs", 1) else 1, endpoint=False
    )
    twist = np.stack(
        [(1.0 - slip) * rate * radius, np.zeros_like(slip), np.full_like(slip, rate)],
        -1,
    )[..., None, :]

    def mean_loads(height):
        pose = np.stack(np.broadcast_arrays(0.0, height[..., None], angle), -1)
        force, moment = loads(
            stress, points, pose, np.broadcast_to(twist, pose.shape), effects
        )
        return force.mean(-2), moment.mean(-1)

    low = np.full(slip.shape, -2 * reach)
    high = np.full(slip.shape, reach)
    carried = mean_loads(low)[0][..., 1] >= load
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        bears = mean_loads(middle)[0][..., 1] >= load
        low = np.where(bears, middle, low)
        high = np.where(bears, high, middle)
    height = (low + high) / 2
    force, moment = mean_loads(height)
    numbers = reach - height, force[..., 0], -moment
    return Rolling(slip, *(np.where(carried, x, np.nan) for x in numbers), carried)
