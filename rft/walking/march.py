"""Steps in time of many robots at once, each at its own pace.

The law of stress knows of speed its direction alone, so it is stiff wherever something is nearly at rest: explicit steps
chatter there, and linearly implicit ones too, as a step may begin in slip and end in stick. So each stage is solved to its
end: SDIRK2 of Alexander, SIAM J. Numer. Anal. 14, 1006 (1977), of order 2, L-stable and stiffly accurate, by Newton's
method on the three rates, with slopes by differences that are columns of the batch of which the forces come. What that
does not solve it tries by way of wider roundings; a step it does not solve even so is halved. Steps end where the
clock's rate jumps.

Some robots stick where others slip, and take ten times as many iterations. So none waits for another: all that are
under way are in the batch of which the next forces come, each in its own step, stage and iteration.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rft.walking.planar import Robots, State

ORDER = 2  # of the error in 1/steps
GAMMA = 1.0 - np.sqrt(0.5)  # of SDIRK2
SOLVED = 1e-3  # m/s, times the rounding: what a stage may be off by
ITERATIONS, HALVINGS = 14, 3  # of Newton's method, and of a step that it does not solve
WIDTHS = np.array(
    [1.0, 30.0, 10.0, 5.0, 3.0, 2.0, 1.5, 1.2, 1.0]
)  # times the rounding, one after another until one is solved as it is
FARTHEST = 0.5  # of a leg's reach, that a step of Newton's method moves a body by
LEAST = 0.05  # of a step of Newton's method, below which it is given up
ENOUGH = 0.1  # of the fall of the residual that Newton's method foretells


def march(robots: Robots, which, state: State, phases, of, stop: Callable) -> State:
    """From a state of these robots, the states after every step (S, B): from phase to phase (S + 1,), while the legs
    turn at the rates that hold at the phases ``of`` (S,). stop: of a state and which of these it is, who goes no further."""
    one = March(robots, np.asarray(which), state, np.asarray(phases), np.asarray(of), stop)
    while (going := np.flatnonzero(one.step < len(of))).size:
        one.iterate(going)
    return State.unpacked(one.states)


def step(robots: Robots, state: State, phase: float, of: float, dt: float) -> State:
    """From a phase on for dt, s, while the legs turn at the rates that hold at the phase ``of``; robots of one frequency."""
    phases = phase, phase + dt * robots.frequency[0, 0]
    return march(robots, range(len(robots)), state, phases, [of], lambda s, which: np.zeros(len(which), bool)).take(0)


class March:
    """Where each of B robots is. At a step: ``level`` times halved and ``done`` of it, in 1 / 2^HALVINGS. At the first
    or second ``stage`` of that: v = from_ + k a(base + k v, v), with legs at ``angle``. At a ``width``, after
    ``tries``: ``found``, of all v tried the one that is least ``off``, and ``trial``, the next, a ``share`` of Newton's
    step ``newton`` away, at first ``most`` of it. now: packed state at the start of the part of the step; states:
    after each step."""

    def __init__(self, robots: Robots, which, state: State, phases, of, stop):
        self.robots, self.which, self.stop = robots, which, stop
        self.size, self.solved = robots.size[which], SOLVED * robots.ground.rounding[which]
        count, steps = len(which), len(of)
        self.length = np.diff(phases)[:, None] / robots.frequency[which, 0]
        here = np.broadcast_to(phases[:-1, None], (steps, count))
        self.angles, self.rates = robots.turned(here, np.broadcast_to(of[:, None], (steps, count)), which)
        self.now = state.packed()
        self.states = np.empty((steps, *self.now.shape))
        self.step, self.level, self.done, self.stage, self.width, self.tries = np.zeros((6, count), int)
        self.k, self.off, self.share, self.most = np.zeros((4, count))
        self.power = np.zeros((2, count))  # of motors and ground
        self.first = np.zeros((3, count))  # the same and off, of stage 0
        self.base, self.from_, self.guess, self.found, self.trial, self.newton = np.zeros((6, count, 3))
        self.angle = np.zeros(self.angles.shape[1:])
        self._begin(np.arange(count))

    def iterate(self, r: np.ndarray) -> None:
        """One evaluation for robots ``r``, and what follows."""
        ground = replace(self.robots.ground.take(self.which[r]), width=WIDTHS[self.width[r]])
        parts = (x[r] for x in (self.base, self.from_, self.trial, self.angle))
        rate, k = self.rates[self.step[r], r], self.k[r, None]
        residual, slopes, *power = self.robots.residual(self.which[r], *parts, rate, k, ground)
        size = np.abs(residual * self.size[r]).max(-1)
        better = size <= (1.0 - ENOUGH * self.share[r]) * self.off[r]
        took = r[better]
        self.found[took], self.off[took] = self.trial[took], size[better]
        self.power[:, took] = np.array(power)[:, better]
        self.newton[took] = -solved(slopes[better], residual[better])
        whole = np.abs(self.k[took, None] * self.newton[took] * self.size[took]).max(-1)
        self.most[took] = 1.0 / np.maximum(1.0, whole / (FARTHEST * self.robots.reach[self.which[took]]))
        self.share[r] = np.where(better, self.most[r], self.share[r] / 2)
        self.trial[r] = self.found[r] + self.share[r, None] * self.newton[r]
        self.tries[r] += 1
        good = better & (size <= WIDTHS[self.width[r]] * self.solved[r])
        self._go_on(r[good], r[~good & ((self.share[r] <= LEAST * self.most[r]) | (self.tries[r] == ITERATIONS))])

    def _go_on(self, good, given_up):
        """From rounding to rounding, stage to stage, step to step."""
        ready, failed = WIDTHS[self.width[good]] == 1.0, given_up
        if given_up.size or not ready.all():
            last = self.width[given_up] == len(WIDTHS) - 1
            wider, failed = np.concatenate([good[~ready], given_up[~last]]), given_up[last]
            self._begin_newton(wider, np.where(self.width[wider, None] > 0, self.found[wider], self.guess[wider]))
            self.width[wider] += 1
        if failed.size:
            again = self.level[failed] < HALVINGS
            self.level[failed[again]] += 1
            self._begin(failed[again])
        done = np.concatenate([good[ready], failed[~again]]) if failed.size else good[ready]
        if done.size:
            second = self.stage[done] == 1
            self._end(done[second])
            self._begin_second(done[~second])

    def _begin_newton(self, r, guess):
        self.trial[r] = self.found[r] = guess
        self.off[r], self.share[r], self.most[r], self.tries[r], self.newton[r] = np.inf, 1.0, 1.0, 0, 0.0

    def _begin_stage(self, r, stage: int, base, from_, guess, share: float):
        """At a share of the present part of a step."""
        whole, h = self._lengths(r)
        self.stage[r], self.width[r], self.k[r] = stage, 0, GAMMA * h
        self.base[r], self.from_[r], self.guess[r] = base, from_, guess
        at = self.step[r], r
        self.angle[r] = self.angles[at] + (whole * self.done[r] / 2**HALVINGS + share * h)[:, None] * self.rates[at]
        self._begin_newton(r, guess)

    def _lengths(self, r):
        """Of a step and of its present part, s."""
        whole = self.length[self.step[r], r]
        return whole, whole / 2.0 ** self.level[r]

    def _begin(self, r):
        self._begin_stage(r, 0, self.now[r, :3], self.now[r, 3:6], self.now[r, 3:6], GAMMA)

    def _begin_second(self, r):
        rest, v = (1.0 - GAMMA) * self._lengths(r)[1][:, None], self.found[r]
        self.first[:2, r], self.first[2, r] = self.power[:, r], self.off[r]
        pose, twist = self.now[r, :3] + rest * v, self.now[r, 3:6] + rest * (v - self.from_[r]) / self.k[r, None]
        self._begin_stage(r, 1, pose, twist, v, 1.0)

    def _end(self, r):
        """Of both stages, and on to the next part of a step, or to the next."""
        h, v, now = self._lengths(r)[1], self.found[r], State.unpacked(self.now[r])
        work, loss = h * ((1 - GAMMA) * self.first[:2, r] + GAMMA * self.power[:, r])
        off = np.stack([self.first[2, r], self.off[r]])
        left = np.where(off > self.solved[r], off, 0.0).sum(0)
        new = State(
            self.base[r] + self.k[r, None] * v, v, now.work + work, now.loss + loss, now.unsolved + (left > 0.0),
            now.defect + left, np.maximum(now.residual, off.max(0)),
        )  # fmt: skip
        self.now[r] = new.packed()
        self.done[r] += 2 ** (HALVINGS - self.level[r])
        while (whole := (self.level[r] > 0) & (self.done[r] % 2 ** (HALVINGS - self.level[r] + 1) == 0)).any():
            self.level[r] -= whole  # two halves make one
        over = self.done[r] == 2**HALVINGS
        self._end_step(r[over], new.take(over))
        self._begin(r[self.step[r] < len(self.length)])

    def _end_step(self, r, state: State):
        self.states[self.step[r], r] = self.now[r]
        self.step[r] += 1
        self.done[r] = 0
        for k in r[self.stop(state, r)]:
            self.states[self.step[k] :, k] = self.now[k]
            self.step[k] = len(self.length)


def solved(slopes, residual) -> np.ndarray:
    """(B, 3); none where there is no solution."""
    try:
        return np.linalg.solve(slopes, residual[..., None])[..., 0]
    except np.linalg.LinAlgError:
        good = np.linalg.det(slopes) != 0.0
        found = np.zeros_like(residual)
        found[good] = np.linalg.solve(slopes[good], residual[good][..., None])[..., 0]
        return found
