"""Steps in time of many robots at once, each at its own pace (`rft.walking.sdirk`).

Steps end where the clock's rate jumps. Some robots stick where others slip, and take ten times as many iterations. So
none waits for another: all that are under way are in the batch of which the next forces come, each in its own step,
stage and iteration."""

from __future__ import annotations

import numpy as np

from rft.balance.backend import compiles
from rft.vectors import gather
from rft.walking.planar import Robots, State
from rft.walking.sdirk import EFFORT, GAMMA, SOLVED, Effort, Way, advanced, begun, ended, judged, when

UNENDING = np.inf, np.inf  # heights over which a robot is airborne, and below which it is sunk


def march(robots: Robots, which, state: State, phases, of, ends=UNENDING) -> tuple[State, np.ndarray]:
    """From a state of these robots, the states after every step (S, B): from phase to phase (S + 1,), while the legs
    turn at the rates that hold at the phases ``of`` (S,); and how often forces were evaluated (B,). ends: as of
    `rft.walking.sdirk.ended`; who is at an end goes no further."""
    which, phases = np.asarray(which), np.asarray(phases)
    here = np.broadcast_to(phases[:-1, None], (len(of), len(which)))
    angles, rates = robots.turned(here, np.broadcast_to(np.asarray(of)[:, None], here.shape), which)
    lengths = np.diff(phases)[:, None] / robots.frequency[which, 0]
    ends = np.stack([np.broadcast_to(x, len(which)) for x in ends])
    if compiles("auto", robots.elements.law):
        from rft.walking.compiled import stepped
    else:
        stepped = stepped_by_numpy
    states, tries = stepped(robots, which, state.packed(), angles, rates, lengths, ends, EFFORT)
    return State.unpacked(states), tries


def step(robots: Robots, state: State, phase: float, of: float, dt: float) -> State:
    """From a phase on for dt, s, while the legs turn at the rates that hold at the phase ``of``; robots of one frequency."""
    phases = phase, phase + dt * robots.frequency[0, 0]
    return march(robots, range(len(robots)), state, phases, [of])[0].take(0)


def stepped_by_numpy(robots: Robots, which, state: np.ndarray, angles, rates, lengths, ends, effort: Effort):
    """(states (S, B, 11) after each step, evaluations (B,)) from a packed state (B, 11), with legs at angles (S, B, K) at
    the begin of each step and turning at rates (S, B, K) for lengths (S, B), s."""
    count, size = lengths.shape
    states, tries, one = np.empty((count, *state.shape)), np.zeros(size, int), np.arange(size)
    w, now = way(state), np.zeros(size, int)  # of those that go on, numbered by ``one``, which are at the steps ``now``
    while one.size:
        robot, length = which[one], lengths[now, one]
        h, turned = w.part * length, (when(w) * length)[:, None]
        width, rate = gather(effort.widths, w.width, 0), rates[now, one]
        ground, k = robots.ground_under(robot, width), GAMMA * h
        off, slopes, power = robots.residual(
            robot, w.base, w.start, w.trial, angles[now, one] + turned * rate, rate, k, ground
        )
        solved = SOLVED * ground.rounding
        w, good, lost = judged(w, off, slopes, power, k, robots.reach[robot], solved, effort)
        tries[one] += 1
        if not (good | lost).any():
            continue
        w, over = advanced(w, good, lost, solved, k, h, effort)
        if over.any():
            new = packed(w)
            states[now[over], one[over]] = new[over]
            now = now + over
            done = over & ended(w.pose[1], w.pose[2], ends[:, one])
            for j in np.flatnonzero(done):
                states[now[j] :, one[j]] = new[j]
            on = ~done & (now < count)
            if not on.all():
                w, one, now = taken(w, on), one[on], now[on]
    return states, tries


def way(state: np.ndarray) -> Way:
    """The begin of a step in a packed state (B, 11)."""
    x = tuple(state.T)
    return begun(x[:3], x[3:6], *x[6:])


def packed(w: Way) -> np.ndarray:
    """(B, 11): the state at the begin of the present part of a step."""
    return np.stack([*w.pose, *w.twist, *w[2:7]], -1)


def taken(w: Way, some) -> Way:
    """The ways of some of the robots."""
    return Way(*(tuple(y[some] for y in x) if isinstance(x, tuple) else x[some] for x in w))
