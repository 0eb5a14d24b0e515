"""Strides of robots from rest, and the result of a walk."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from rft.core.metres import GRAVITY
from rft.terradynamics.walking.planar.equations import Robots, State
from rft.terradynamics.walking.planar.march import march
from rft.terradynamics.walking.robot import Robot, Tripod, intervals

# A cycle is periodic where its start differs from the last one's, and from all to come,
# by at most this share of the speed of the legs' ends, or of the speed of a fall that
# lasts a cycle if that is less.
PERIODIC = 1e-3
# Largest change, in all, of a cycle's progress that is still to come at the limit, over
# a leg's reach.
REMAINING_CHANGE = 1e-3
MOST_STRIDES = 10  # on the way to the limit cycle
STRIDES_NEAR_LIMIT = 4  # on the way to the limit cycle from a state near it
AVERAGED_CYCLES = 4  # of a walk without a limit cycle, whose mean is its speed
# Change over two strides over that of one stride, below which a robot limps.
LIMPING = 0.5
# Progress in a cycle over a leg's reach, below which a robot is stuck, assumed.
STUCK = 0.02
# Largest difference of a settled cycle's progress from the limit cycle's, over the
# latter.
NEAR = 0.05


class Walk(NamedTuple):
    """Result of a walk of one robot.

    Attributes
    ----------
    t : array (T,)
        Times, s.
    pose, twist : array (T, 3)
        x, z and pitch, and their rates; SI units.
    work, loss, energy : array (T,)
        Work of the motors, loss into the ground and energy of the body, J; work = loss
        + change of energy.
    speed : float
        Mean over the limit cycle, or until the robot's end, m/s, along the heading at a
        cycle's start.
    status : str
        "walking", "stuck", "sunk", "flipped" or "airborne".
    cycles : float
        Number of cycles computed.
    periodic : bool
        Whether the limit cycle was found.
    drift : float
        Change of the speed that may still come, m/s.
    limit
        State at the limit cycle, for `rft.terradynamics.walking.engines.Engine.rerun`;
        None for a robot that came to an end.
    unsolved : int
        Number of steps that were accepted unsolved.
    residual : float
        Largest residual of a step, m/s.
    unsolved_error : float
        Change of the speed by the unsolved steps, m/s, at most.
    spatial : mapping, optional
        In three dimensions y (m), roll and yaw (rad), (T,), and "states" (T, nq),
        MuJoCo's positions.
    settling_time : float
        Time from rest, s, after which the progress of every cycle is within `NEAR` of
        the limit cycle's; inf for a robot that never settles, nan without a limit
        cycle.
    lateral_speed, yaw_rate : float
        Mean velocity to the left of the heading at a cycle's start, m/s, and rate to
        the left, rad/s, over the same time as the speed; 0 in the plane.
    speed_along : float
        Mean velocity along x over the same time as the speed, m/s: on a slope, along
        the slope. That is the speed but for a robot that has turned.
    turned : float
        Angle to the left by which the robot has turned since the start, rad.
    foot_speed, sinkage : float
        `rft.terradynamics.walking.feet.Feet`, m/s and m, over the limit cycle, or until
        the robot's end.
    reach : float
        Of the legs, m.
    step_length, step_strength : array (C,), optional
        On ground that remembers, for each cycle from rest: progress, m, along the
        heading at its start, and mean strength of the ground under limbs that were in
        it, 1 for undisturbed ground.
    prints : array (N, 2), optional
        On ground that remembers, x and y of the prints, m, that the walk leaves.

    Examples
    --------
    >>> from rft.terradynamics.plates import CLeg, StressMap
    >>> from rft.terradynamics.walking import Fineness, Rhex, Tripod, Walker, engine
    >>> robot = Rhex(0.15, 0.13, 0.02, 0.03, CLeg(0.02, 0.01), hips=(-0.05, 0.0, 0.05))
    >>> walker = Walker(robot, Tripod(frequency=2.0), StressMap(zeta=0.6))
    >>> (walk,) = engine("planar").walk([walker], Fineness(steps=16))
    >>> walk.periodic, walk.pose.shape[1]
    (True, 3)
    """

    t: np.ndarray
    pose: np.ndarray
    twist: np.ndarray
    work: np.ndarray
    loss: np.ndarray
    energy: np.ndarray
    speed: float
    status: str
    cycles: float
    periodic: bool
    drift: float
    limit: Any
    unsolved: int = 0
    residual: float = 0.0
    unsolved_error: float = 0.0
    spatial: Mapping[str, np.ndarray] | None = None
    settling_time: float = np.nan
    lateral_speed: float = 0.0
    yaw_rate: float = 0.0
    speed_along: float = np.nan
    turned: float = 0.0
    foot_speed: float = np.nan
    sinkage: float = np.nan
    reach: float = np.nan
    step_length: np.ndarray | None = None
    step_strength: np.ndarray | None = None
    prints: np.ndarray | None = None

    @property
    def unaccounted(self) -> float:
        """Share of the motors' work that is neither loss nor energy: an error of the
        time steps."""
        if not self.work[-1] > 0.0:
            return 0.0
        difference = self.work[-1] - self.loss[-1] - self.energy[-1] + self.energy[0]
        return float(abs(difference) / self.work[-1])


def compute_stride(stride: Callable, *arguments) -> Any:
    """Return stride(*arguments), the states of a stride.

    A function in its place may store the states of strides, and return stored ones."""
    return stride(*arguments)


class Strides:
    """Strides of B robots with clocks that have their kinks at the same phases.

    Where two legs at a hip differ by half a cycle, a stride is half a cycle, since in
    the plane the legs are equal.

    Parameters
    ----------
    robots : Robots
    designs : list of Robot
        The robot of each of ``robots``.
    gaits : list of Tripod
        Their clocks.
    steps : int
        Time steps in a cycle, about.
    advance
        Computes a stride, as `compute_stride`.

    Attributes
    ----------
    period : float
        Cycles in a stride.
    cycle : int
        Strides in a cycle.
    phases, rate_phases : arrays (S + 1,), (S,)
        Phases at the steps' ends, cycles, and phases that determine the rates within.
    leg_speed : array (B,)
        Speed of the legs' ends, m/s.
    free : array (n,)
        Of height, pitch and the three rates the numbers of those that can change.
    scale : array (5, B)
        Scales of these five, SI units.
    top : array (B,)
        Height of the body's top over its centre of mass, m.
    airborne_height : array (B,)
        Height of the centre of mass above which a robot is out of reach of the ground,
        m.
    """

    def __init__(
        self,
        robots: Robots,
        designs: list[Robot],
        gaits: list[Tripod],
        steps: int,
        advance=compute_stride,
    ):
        self.advance = advance
        self.robots = robots
        self.period = designs[0].period / len(designs[0].hip_phases)
        self.cycle = round(1 / self.period)
        self.frequency = robots.frequency[:, 0]
        self.reach = robots.reach
        self.leg_speed = 2 * np.pi * self.frequency * self.reach

        speed = self.leg_speed
        self.scale = np.stack(
            [self.reach, np.ones(len(robots)), speed, speed, speed / self.reach]
        )
        # The moment of inertia of a robot that keeps its pitch is infinite.
        self.free = np.flatnonzero(np.isfinite(robots.masses[0])[[1, 2, 0, 1, 2]])

        height = np.array([r.height for r in designs])
        farthest_hip = np.hypot(*np.abs(robots.hips)).max(1)
        self.top = height / 2
        self.airborne_height = self.reach + farthest_hip + height

        kinks = gaits[0].kinks
        if self.cycle != 2:
            kinks = _kinks_of_cycle(kinks)
        spans = [
            np.linspace(begin, end, count + 1)
            for begin, end, count in intervals(kinks, steps)
        ]
        self.phases = np.concatenate([[0.0], *(span[1:] for span in spans)])
        self.rate_phases = np.concatenate(
            [np.full(len(span) - 1, (span[0] + span[-1]) / 2) for span in spans]
        )

    def run(
        self, state: State, stride: int, index: np.ndarray
    ) -> tuple[np.ndarray, State]:
        """Return phases (S,), cycles, and states (S, B) after each step of a stride of
        the robots ``index`` from a state; a robot at an end stays there."""
        phases = stride * self.period + self.phases[1:]
        return phases, self.advance(self.states, stride, index, state)

    def states(self, stride: int, index: np.ndarray, state: State) -> State:
        """Return the states (S, B) after each step of a stride, as `run`."""
        begin = stride * self.period
        states, _ = march(
            self.robots,
            index,
            state,
            begin + self.phases,
            begin + self.rate_phases,
            (self.top[index], self.airborne_height[index]),
        )
        return states

    def scaled_state(self, state: State, index) -> np.ndarray:
        """Return height, pitch and rates (n, B), those that can change, over their
        scales for the robots ``index``."""
        numbers = np.concatenate([state.pose[:, 1:], state.twist], 1).T
        return numbers[self.free] / self.scale[self.free][:, index]

    def with_scaled_state(self, state: State, numbers: np.ndarray, index) -> State:
        """Return the state with the scaled numbers (n, B) of `scaled_state`."""
        new = np.concatenate([state.pose[:, 1:], state.twist], 1)
        new[:, self.free] = (numbers * self.scale[self.free][:, index]).T
        pose = np.concatenate([state.pose[:, :1], new[:, :2]], 1)
        return state._replace(pose=pose, twist=new[:, 2:])

    def end_status(self, state: State, index) -> np.ndarray:
        """Return "sunk", "airborne" or "flipped" (B,) for robots that are at an end, ""
        for the others."""
        z = state.pose[:, 1]
        pitch = np.abs(state.pose[:, 2])
        status = np.where(z > self.airborne_height[index], "airborne", "")
        status = np.where(z + self.top[index] < 0.0, "sunk", status)
        return np.where(pitch > np.pi / 2, "flipped", status)


def cycles_to_settle(moves, limit: float) -> float:
    """Return the number of cycles after which the progress of all, moves (N,), m, is
    within `NEAR` of the limit, m; inf if the last is not."""
    is_near = np.abs(np.asarray(moves) - limit) <= NEAR * abs(limit)
    others = np.flatnonzero(~is_near)
    after = others[-1] + 1 if others.size else 0
    if after == len(moves):
        return np.inf
    return float(after)


def _kinks_of_cycle(kinks: tuple[float, ...]) -> tuple[float, ...]:
    """Return the kinks of a full cycle from those of its first half."""
    return tuple(sorted({*kinks, *(0.5 + k for k in kinks)}))


class WalksFromRest(NamedTuple):
    """Walks of B robots from rest.

    state: at the end. blocks: for each robot rows (T, 9) of t, pose, twist, work and
    loss, a block for each stride. strides: (B,), number computed. status: (B,),
    "periodic" where all further cycles repeat the last one, as of `Strides.end_status`
    for a robot at an end, else "". period: (B,), as of `map_period`."""

    state: State
    blocks: list[list[np.ndarray]]
    strides: np.ndarray
    status: np.ndarray
    period: np.ndarray


def _no_progress(fraction: float) -> None:
    """Ignore the finished fraction."""


def walk_from_rest(
    strides: Strides, durations: np.ndarray, progress: Callable = _no_progress
) -> WalksFromRest:
    """Return the walks of robots from rest until a cycle repeats itself, the robot is
    at an end, or its duration (B,), s, is over. progress: receives the finished
    fraction."""
    count = len(strides.robots)
    every_robot = np.arange(count)
    state = strides.robots.start()
    blocks = [[state_rows(np.zeros(1), state.take([[k]]), 0)] for k in range(count)]
    most = np.ceil(durations * strides.frequency / strides.period - 1e-9).astype(int)
    computed = np.zeros(count, int)
    status = np.full(count, "", "U10")
    period = np.ones(count, int)
    weight = _weights(strides)
    # Scaled states at the last five starts, two cycles of two strides apart.
    starts = [strides.scaled_state(state, every_robot)] * 5

    active = every_robot
    for stride in range(most.max()):
        phases, states = strides.run(state.take(active), stride, active)
        state = state.put(active, states.take(-1))
        for j, k in enumerate(active):
            blocks[k].append(state_rows(phases / strides.frequency[k], states, j))
        computed[active] = stride + 1
        status[active] = strides.end_status(state.take(active), active)

        starts = [*starts[1:], strides.scaled_state(state, every_robot)]
        period[active] = map_period(*(x[:, active] for x in starts[-3:]))
        now, last, before = (
            (x * weight)[:, active] for x in starts[:: -strides.cycle][:3]
        )
        rest = (most - computed)[active] / strides.cycle
        change = remaining_change(now - last, last - before, rest)
        is_periodic = (change < PERIODIC) & (stride >= strides.cycle)
        is_periodic &= status[active] == ""
        status[active] = np.where(is_periodic, "periodic", status[active])

        active = active[(status[active] == "") & (computed[active] < most[active])]
        progress((stride + 1) / most[active].max(initial=stride + 1))
        if not active.size:
            break
    return WalksFromRest(state, blocks, computed, status, period)


def _weights(strides: Strides) -> np.ndarray:
    """Return the weights (n, B) of the scaled states' differences from cycle to
    cycle."""
    # Rates count over the speed of a fall for a cycle where the legs are faster.
    is_rate = strides.free[:, None] >= 2
    falls = strides.leg_speed * strides.frequency / GRAVITY
    return np.where(is_rate, np.maximum(1.0, falls), 1.0)


def remaining_change(change, before, cycles) -> np.ndarray:
    """Return the change (B,) of the starts of cycles that may still come, from the last
    change and the one before, (n, B).

    It is the sum of a geometric series with the ratio of the two, but at most
    ``cycles`` (B,) times the last change, and at least the last change."""
    now = np.abs(change).max(0)
    then = np.abs(before).max(0)
    shrinks = now < then
    ratio = now / np.where(shrinks, then, 1.0)
    series = np.where(shrinks, now / np.where(shrinks, 1 - ratio, 1.0), np.inf)
    return np.minimum(series, now * np.maximum(1.0, cycles))


def map_period(before, last, now) -> np.ndarray:
    """Return the number (B,) of strides after which a walk repeats itself, 2 for robots
    that limp, else 1, from the scaled starts (n, B) of three strides."""
    change = np.abs(now - last).max(0)
    change_of_two = np.abs(now - before).max(0)
    limps = (change > PERIODIC) & (change_of_two < LIMPING * change)
    return np.where(limps, 2, 1)


def state_rows(t, states: State, k: int) -> np.ndarray:
    """Return rows (T, 9) of t, pose, twist, work and loss of robot k."""
    return np.column_stack(
        [t, states.pose[:, k], states.twist[:, k], states.work[:, k], states.loss[:, k]]
    )
