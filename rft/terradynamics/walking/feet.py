"""How the feet of a robot move under its body, and how deep they are in the ground.

The foot of a moment is the lowest point of the legs. A wheel of radius R at the rate w
has the foot speed w R, so that 1 - speed / foot speed is its slip."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rft.terradynamics.walking.planar.equations import Robots, State


class Feet(NamedTuple):
    """The feet of one robot over some time.

    speed: mean speed, m/s, at which the lowest point of the legs moves back under the
    body, 0 while no leg is in the ground. sinkage: largest depth of the legs below the
    surface, m."""

    speed: float
    sinkage: float


def backward_motion(ahead, height) -> np.ndarray:
    """Return how far, m, the lowest point of the legs moves back in each of S steps.

    ahead: places of the legs' points ahead of the body at the begin and end of each
    step, m, (S, 2, P); height: above the surface, m, (S, 2, P). The mean of the points
    that are lowest at the begin and at the end counts, each where it is in the
    ground."""
    moved = ahead[:, 0] - ahead[:, 1]
    lowest = height.argmin(-1)
    in_ground = height.min(-1) < 0.0
    moved_at_ends = np.take_along_axis(moved, lowest, 1)
    return (moved_at_ends * in_ground).mean(1)


def feet_of(ahead, height, duration: float) -> Feet:
    """Return the feet of a robot over a duration, s, by `backward_motion`."""
    speed = 0.0
    if duration > 0.0:
        speed = backward_motion(ahead, height).sum() / duration
    return Feet(float(speed), float(-height.min(initial=0.0)))


def at_both_ends(values: np.ndarray) -> np.ndarray:
    """Return values (S + 1, ...) at the begin and end of every step, (S, 2, ...)."""
    return np.stack([values[:-1], values[1:]], 1)


def planar_feet(robots: Robots, index: int, states: State, phases, rate_phases) -> Feet:
    """Return the feet of robot ``index`` in the vertical plane.

    states: (S + 1,), at phases (S + 1,), cycles. rate_phases: (S,), at which the clock
    determines the rates of the steps."""
    shared = len(robots.legs.points) == 1
    points = robots.legs.points[0 if shared else index]
    x, z = points.T
    both = at_both_ends(np.asarray(phases))
    robot = np.full(both.shape, index)
    angles, _ = robots.leg_motion(both, np.stack([rate_phases] * 2, 1), robot)

    pose = at_both_ends(states.pose)
    pitch = pose[..., 2, None]
    hip_x, hip_z = robots.hips[:, index]
    # The legs at a hip have their own phases, as in `Robots`.
    hips_ahead = np.cos(pitch) * hip_x + np.sin(pitch) * hip_z
    hips_up = np.cos(pitch) * hip_z - np.sin(pitch) * hip_x
    angle = (pitch + angles)[..., None]
    ahead = hips_ahead[..., None] + np.cos(angle) * x + np.sin(angle) * z
    height = hips_up[..., None] + np.cos(angle) * z - np.sin(angle) * x
    height = height + pose[..., 1, None, None]
    count = len(both)
    duration = (phases[-1] - phases[0]) / robots.frequency[index, 0]
    return feet_of(
        ahead.reshape(count, 2, -1), height.reshape(count, 2, -1), float(duration)
    )
