"""Descents of `rft.newton` for many samples at once, by NumPy; its heading has the reasons."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rft.linear import solve3
from rft.samples import Samples, State

LARGEST_STEP = 3.0  # of the body's mean place and heading, per radian: no body moves that fast
SHORTEST = 2.0**-12  # part of a Newton step that is taken whether it helps or not
LENGTHEN = 2.0  # the next part to try, after a success
CROWDED = 0.65  # of samples that go on, below which those that have ended leave the arrays
FEW = 200  # elements x samples, of which fewer take no less time


class Descent(NamedTuple):
    """How an attempt comes down to the wanted regularisation."""

    widest: float  # the first rounding of the kinks, in body lengths per radian
    ratio: float  # of the rounding from one level to the next
    loose: float  # residual at which a level is left
    free: float  # elements faster than this many times the rounding let a sample go all the way at once
    budget: int  # iterations allowed


class Descending:
    """Some samples of a `rft.newton.Balance` under way, on their way down. guess: (3, B) of the whole batch, or None. wrote:
    called with places in the batch of samples that have ended, their xi, residual, evaluations and slowest elements' speed."""

    def __init__(self, problem, descent: Descent, guess: np.ndarray | None, wrote: Callable):
        self.problem, self.descent, self.guess, self.wrote = problem, descent, guess, wrote
        self.last, self.limit = problem.regularisation, problem.limit

    def run(self, share: np.ndarray, stop, together: int) -> None:
        """Solve the samples ``share``, so many side by side: as some end, others come."""
        queue, state, ended = np.array_split(share, math.ceil(2 * share.size / together)), None, []
        while (queue or state is not None) and not stop.is_set():
            while queue and (state is None or state.of.size <= together // 2):
                fresh = self._start(self.problem.samples(queue.pop()))
                state = fresh if state is None else State.join([state, fresh], self.problem.model)
            state = self._advance(state, ended)
            if ended and (state is None or state.v[0].size > FEW):
                self._write(ended)

    def _start(self, of: Samples) -> State:
        """The first step from rest: the guess, or the viscous solution, which is a dry law rounded off without end."""
        size = of.size
        eps = np.full(size, self.last if self.problem.linear else max(self.descent.widest, self.last))
        dx = self.problem.viscous(of) if self.guess is None else self.guess[:, of.index]
        at_rest, worst, steps = np.zeros((3, size)), np.full(size, np.inf), np.zeros(size, int)
        return State(of, at_rest, dx, of.motion.v, eps, eps, np.ones(size), worst, steps, np.ones(size, bool))

    def _advance(self, s: State, ended: list) -> State | None:
        """One step of all samples; those that end leave, for ``ended``. None when none are left."""
        net, slope, kept = self._step(s)
        left = s.going
        done = (s.residual <= self.limit) & left
        if np.count_nonzero(done):
            done &= s.eps <= self.last
        done |= (s.iterations >= self.descent.budget) & left
        if np.count_nonzero(done):
            some = np.flatnonzero(done)
            ended.append([x[..., some] for x in (s.of.index, s.xi, s.v, s.eps, s.residual, s.iterations)])
            s.going = left = left & ~done
            if not np.count_nonzero(left):
                return None
        dx = self._next_step(s, net, slope, kept)
        s.dx = dx if np.count_nonzero(kept) == kept.size else np.where(kept, dx, 0.5 * s.dx)
        crowded = s.v[0].size > FEW and np.count_nonzero(left) < CROWDED * s.of.size
        return s.take(np.flatnonzero(left)) if crowded else s

    def _step(self, s: State) -> tuple[np.ndarray, np.ndarray | None, np.ndarray]:
        """Try the step of every sample and keep it where it helps. What it came to (`rft.newton.Balance.net`), and the mask of
        samples kept."""
        xi, v = s.xi + s.dx, s.of.motion.carried(s.dx)
        v += s.v
        net, slope = self.problem.net(s.of, v, xi, s.eps_next, with_slope=True)
        residual = self.problem.residual(net[:, 0], s.of)
        kept = residual < s.residual
        all_kept = np.count_nonzero(kept) == kept.size
        if not all_kept:
            kept |= (s.eps_next < s.eps) | (s.stride <= SHORTEST)
            all_kept = np.count_nonzero(kept) == kept.size
        s.iterations, s.eps = s.iterations + 1, s.eps_next
        stride = np.minimum(1.0, LENGTHEN * s.stride)
        if not all_kept:
            stride = np.where(kept, stride, 0.5 * s.stride)
            xi, v, residual = (np.where(kept, a, b) for a, b in ((xi, s.xi), (v, s.v), (residual, s.residual)))
        s.xi, s.v, s.residual, s.stride = xi, v, residual, stride
        return net, slope, kept

    def _next_step(self, s: State, net, slope, kept) -> np.ndarray:
        """Newton's step, and for samples that go on to the next level the change dx/d(eps) brings."""
        right = -s.stride * net[:, 0]
        down = s.eps > self.last
        if np.count_nonzero(down):
            down &= kept
            down &= s.residual < self.descent.loose
        if np.count_nonzero(down):
            # Where every element moves much faster than the rounding, its kinks no longer matter: go all the way.
            free = slowest(s.v) > self.descent.free * s.eps
            lower = np.where(free, self.last, np.maximum(self.descent.ratio * s.eps, self.last))
            s.eps_next = np.where(down, lower, s.eps)
            # A dry law is homogeneous of degree 0 in (v, eps), so eps dF/d(eps) = -(dF/dv) v. An element at rest creeps
            # in proportion to eps; one that slides feels eps^2.
            change = s.eps_next / s.eps
            right += np.where(free, (change * change - 1.0) / 2.0, change - 1.0) * slope
        dx = solve3(net[:, 1:], right)
        if -1.0 <= dx.min(initial=0.0) and dx.max(initial=0.0) <= 1.0:  # no place within a body length moves too far
            return dx
        x, y, turn = dx
        size2 = (x - s.of.centre[1] * turn) ** 2 + (y + s.of.centre[0] * turn) ** 2 + turn * turn
        return dx * (LARGEST_STEP / np.sqrt(np.maximum(size2, LARGEST_STEP**2)))

    def _write(self, ended: list) -> None:
        """Tell of samples that have ended, and forget them."""
        index, xi, v, eps, residual, iterations = (np.concatenate(x, -1) for x in zip(*ended))
        ended.clear()
        residual[eps > self.last] = np.inf  # a balance with wider rounding is not the one that was asked for
        self.wrote(index, xi, residual, iterations, slowest(v))


def slowest(v: np.ndarray) -> np.ndarray:
    """(B,): the speed of the slowest element, each by its faster end, from velocities (3, n, B)."""
    v_t, v_n, spin = v
    return np.sqrt((v_t * v_t + (np.abs(v_n) + np.abs(spin)) ** 2).min(0))
