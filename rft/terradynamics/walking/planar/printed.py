"""Walks in the vertical plane over ground that remembers the steps
(`rft.terradynamics.walking.prints`).

Such a walk is no map from five numbers to five numbers, so no limit cycle is looked
for: all cycles are computed, one robot and one time step after another."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rft.terradynamics.walking.planar.equations import Robots, State
from rft.terradynamics.walking.planar.march import march
from rft.terradynamics.walking.planar.stride import (
    AVERAGED_CYCLES,
    STUCK,
    Strides,
    WalksFromRest,
    state_rows,
)
from rft.terradynamics.walking.prints import Limb, Memory, PrintedGround, meet
from rft.terradynamics.walking.robot import Rhex, Robot

ONLY = np.array([0])  # index of the robot
# Of a leg's width: where the two halves of its elements are, from its middle.
HALF = 0.25


def tracks(robot: Robot) -> np.ndarray:
    """Return y (K,), m, of the legs, those at a hip on both sides."""
    if not isinstance(robot, Rhex):
        return np.zeros(len(robot.hips) * len(robot.hip_phases))
    sides = (1.0, -1.0)[: len(robot.hip_phases)]
    return (robot.sides[:, None] * sides).ravel()


def limbs(
    robots: Robots, pose: np.ndarray, angles, y: np.ndarray, width: float
) -> list[Limb]:
    """Return the legs of the only robot at a pose (3,) and angles (K,), on tracks
    (K,), m, of a width, m."""
    e = robots.legs.elements
    middles = np.stack([e.x1 + e.x2, e.z1 + e.z2], -1)[0] / 2
    areas = np.tile(e.area[0] / 2, 2)
    x, z, pitch = pose
    hips = robots.hips[:, 0]
    hip_x = x + np.cos(pitch) * hips[0] + np.sin(pitch) * hips[1]
    hip_z = z + np.cos(pitch) * hips[1] - np.sin(pitch) * hips[0]
    out = []
    for k, angle in enumerate(pitch + angles):
        cos = np.cos(angle)
        sin = np.sin(angle)
        place = hip_x[k] + cos * middles[:, 0] + sin * middles[:, 1]
        height = hip_z[k] + cos * middles[:, 1] - sin * middles[:, 0]
        halves = [
            np.stack([place, np.full_like(place, y[k] + side * HALF * width)], -1)
            for side in (1, -1)
        ]
        places = np.concatenate(halves)
        out.append(Limb(places, np.tile(-height, 2), areas))
    return out


class PrintedStrides:
    """Strides of one robot on ground that remembers.

    strides: those of the robot on other ground. ground: how it remembers. y: (K,), m,
    of the legs. width: m, of each."""

    def __init__(self, strides: Strides, ground: PrintedGround, robot: Robot):
        self.strides = strides
        self.ground = ground
        self.y = tracks(robot)
        self.width = robot.legs.width

    def states(self, stride: int, state: State, memory: Memory) -> tuple[State, Memory]:
        """Return the states (S, 1) after each step of a stride, and what the ground
        remembers then."""
        strides = self.strides
        robots = strides.robots
        begin = stride * strides.period
        ends = (strides.top, strides.airborne_height)
        found = []
        for k, rate_phase in enumerate(begin + strides.rate_phases):
            phases = begin + strides.phases[k : k + 2]
            angles, _ = robots.leg_motion(phases[:1], rate_phase)
            legs = limbs(robots, state.pose[0], angles[0], self.y, self.width)
            shares, memory = meet(self.ground, memory, legs)
            after, _ = march(
                robots, ONLY, state, phases, [rate_phase], ends, shares[None]
            )
            state = after.take(-1)
            found.append(state)
        return State(*map(np.stack, zip(*found))), memory


def walk_from_rest(
    strides: PrintedStrides, duration: float, progress: Callable
) -> tuple[WalksFromRest, dict]:
    """Return the walk of one robot from rest for a duration, s, or until its end, and
    the fields of `rft.terradynamics.walking.planar.stride.Walk` that follow from its
    steps. progress: receives the finished fraction."""
    own = strides.strides
    frequency = own.frequency[0]
    state = own.robots.start()
    memory = Memory.undisturbed(len(strides.y))
    blocks = [state_rows(np.zeros(1), state.take([[0]]), 0)]
    most = int(np.ceil(duration * frequency / own.period - 1e-9))
    ends: list[float] = [0.0]
    strengths = []
    status = ""
    for stride in range(most):
        states, memory = own.advance(strides.states, stride, state, memory)
        state = states.take(-1)
        times = (stride * own.period + own.phases[1:]) / frequency
        blocks.append(state_rows(times, states, 0))
        status = str(own.end_status(state, ONLY)[0])
        progress((stride + 1) / most)
        if status:
            break
        if (stride + 1) % own.cycle == 0:
            ends.append(float(state.pose[0, 0]))
            strengths.append(memory.mean_strength)
            memory = memory._replace(met=0.0, count=0)

    count = np.array([len(blocks) - 1])
    walks = WalksFromRest(state, [blocks], count, np.array([status]), np.ones(1, int))
    lengths = np.diff(ends)
    fields = {
        "step_length": lengths,
        "step_strength": np.array(strengths),
        "prints": memory.prints,
    }
    if not status and len(lengths):
        late = lengths[-AVERAGED_CYCLES:]
        spread = float(np.ptp(late)) if len(late) > 1 else abs(float(late[0]))
        is_stuck = abs(late.mean()) < STUCK * own.reach[0]
        fields |= {
            "speed": float(late.mean() * frequency),
            "drift": spread * float(frequency),
            "status": "stuck" if is_stuck else "walking",
        }
    return walks, fields
