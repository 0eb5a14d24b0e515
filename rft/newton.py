"""Newton's method for the balance of forces, for many samples at once.

A dry medium is first taken with its kinks rounded off widely (``eps``, a speed), where the problem is easy, then with
less and less rounding down to the wanted ``regularisation``; the tangent dx/d(eps) carries the solution from one level
to the next. On a level the steps are Newton's, halved while the residual does not fall. Samples that need too many are
followed along their curve of solutions, which may turn back on its way down (`rft.path`); where that breaks, slower
descents are tried. Element velocities are carried beside xi and updated by small steps, so that an element at rest keeps
all its digits. What decides about a step, or an end, is the same in every frame of the body.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rft import backend
from rft.bodies.base import Body
from rft.contact import SIDE, Model, rows
from rft.linear import solve3
from rft.media.base import is_closed, is_linear
from rft.numbers import attempt
from rft.path import follow
from rft.samples import Jacobian, Samples, State
from rft.workers import each, keep_freed_memory, split, workers

LARGEST_STEP = 3.0  # of the body's mean place and heading, per radian: no body moves that fast
SHORTEST = 2.0**-12  # part of a Newton step that is taken whether it helps or not
LENGTHEN = 2.0  # the next part to try, after a success
STUCK_BELOW = 10.0  # an element whose ends are slower than this many times the regularisation is at rest
ELEMENTS_TOGETHER = 24576  # elements x nodes x samples solved side by side

keep_freed_memory()


class Descent(NamedTuple):
    """How an attempt comes down to the wanted regularisation."""

    widest: float  # the first rounding of the kinks, in body lengths per radian
    ratio: float  # of the rounding from one level to the next
    loose: float  # residual at which a level is left
    free: float  # elements faster than this many times the rounding let a sample go all the way at once
    budget: int  # iterations allowed


QUICK = Descent(0.03, 0.03, 1e-3, 5.0, 48)
WARM = Descent(0.0, 0.0, 0.0, np.inf, 12)  # from a good guess, at the wanted rounding at once
# Walks along a curve: size of a step's first correction, evaluations allowed. A force law alone needs no more than these;
# the slow descents are for effects, and quadrature rules, with kinks of their own that no rounding takes away.
WALKS = ((0.2, 150), (0.02, 600))
SLOW = (
    Descent(0.1, 0.1, 1e-4, 1e3, 150),
    Descent(0.3, 0.3, 1e-6, np.inf, 500),
    Descent(1.0, 0.6, 1e-8, np.inf, 3000),
)
CROWDED = 0.8  # of samples that go on, below which those that have ended leave the arrays
DIFFERENCE = 1e-6  # of eps, for the derivative with respect to it


class Solved(NamedTuple):
    """xi: (3, B), body velocities; the others (B,)."""

    xi: np.ndarray
    residual: np.ndarray
    iterations: np.ndarray
    stuck: np.ndarray


class Balance:
    """How finely to solve the balance of forces of a `rft.contact.Model`; one serves for all time steps.

    Within, velocities are over a scale of each sample, so that they, and the rounding, are of size 1; what laws and terms
    are given, and `solve` takes and returns, are true ones. rows: of each contact's elements among all of them.
    """

    def __init__(self, model: Model, rows: list[slice], regularisation: float, tolerance: float, backend: str = "auto"):
        self.model, self.rows, self.regularisation, self.backend = model, rows, regularisation, backend
        self.nodes = model.contacts[SIDE].law.nodes
        medium = model.medium
        lateral = abs(float(medium.traction(0.0, 1.0)[1]))
        self.base = tolerance + 1e-14 * max(1.0, lateral / model.unit)  # rounding of the largest forces
        self.limit, self.linear = self.base, is_linear(medium)

    @classmethod
    def of(cls, model: Model, body: Body, regularisation: float, tolerance: float) -> Balance:
        """That of a model on a body."""
        zero = np.zeros((body.joints, 1))
        return cls(model, rows(model.motions(body.motion(zero, zero))), regularisation, tolerance)

    def solve(self, motion: Callable, scale, threads=None, guess=None, model: Model | None = None) -> Solved:
        """Body velocities of B samples. motion(index): `Kinematics` of all contacts' elements of those samples. scale:
        (B,), the size of their velocities. guess: (3, B), tried first but where it is nan. model: of this batch, if not the
        balance's own."""
        self.motion, self.scale, self.guess = motion, scale, None if guess is None else guess / scale
        self.model = self.model if model is None else model
        self.scaled = not self.model.rate_independent
        self.unit = self._units(scale)
        self.limit = self.base + sum(1e-14 * np.max(term.size * scale / self.unit) for term in self.model.terms)
        size = scale.size
        out = Solved(np.zeros((3, size)), np.full(size, np.inf), np.zeros(size, int), np.zeros(size, bool))
        for way in (WARM,) * (guess is not None) + (QUICK, *WALKS, *SLOW):
            todo = np.flatnonzero(out.residual > self.limit)
            if way is WARM:
                todo = todo[np.isfinite(self.guess).all(0)]
            if not todo.size:
                continue
            if isinstance(way, Descent) and backend.takes(self.backend, self.model):
                self._attempt_compiled(todo, way, out, threads)
            elif isinstance(way, Descent):
                with backend.counted(self.backend):
                    self._attempt(todo, way, out, threads)
            else:
                self._follow(todo, *way, out)
        return out._replace(xi=out.xi * scale)

    def _units(self, scale) -> np.ndarray:
        """(B,): of residuals, which are magnitudes: drag at the samples' speeds, in dry media not below that at unit speed."""
        unit, medium = self.model.unit, self.model.medium
        if self.linear:
            return unit * scale
        if not is_closed(medium):
            along, across = (
                np.abs(medium.traction(*v)[k]) for k, v in enumerate(((scale, 0 * scale), (0 * scale, scale)))
            )
            return np.where(along > 0, along, across)
        return unit + medium.viscous[0] * np.maximum(scale - 1.0, 0.0)

    def samples(self, index: np.ndarray, compiled: bool = False) -> Samples:
        """Those of the batch, as compiled code takes their motion or as NumPy does."""
        scale, motion = self.scale[index], self.motion(index)
        motion = motion._replace(v=motion.v / scale)
        model = self.model if index.size == self.scale.size else self.model.take(index)
        given = motion if compiled else Jacobian.of(motion)
        return Samples(index, given, motion.centre, scale, self.unit[index], model)

    def _follow(self, todo, wanted: float, budget: int, out: Solved) -> None:
        """Solve the samples ``todo`` along their curves."""
        for index in np.array_split(todo, math.ceil(todo.size / self._together())):
            for i, xi, v, residual, evaluations in follow(self, index, wanted, budget):
                out.iterations[i] += evaluations
                solved = residual <= self.limit
                i = i[solved]
                out.xi[:, i], out.residual[i], out.stuck[i] = xi[:, solved], residual[solved], self._stuck(v)[solved]

    def _together(self) -> int:
        """How many samples are solved side by side."""
        return max(1, ELEMENTS_TOGETHER // (self.rows[-1].stop * self.nodes))

    def _stuck(self, v: np.ndarray) -> np.ndarray:
        """(B,): whether some element is at rest, from velocities (3, n, B)."""
        slowest = _slowest(v)
        return np.zeros(slowest.shape, bool) if self.linear else slowest < STUCK_BELOW * self.regularisation

    def _attempt(self, todo, descent: Descent, out: Solved, threads) -> None:
        """Solve the samples ``todo``, writing to ``out``; each worker keeps its batch full from its share of them."""
        batch = self._together()

        def work(share, stop):
            queue, state = np.array_split(share, math.ceil(2 * share.size / batch)), None
            while (queue or state is not None) and not stop.is_set():
                while queue and (state is None or state.of.size <= batch // 2):
                    fresh = self._start(descent, self.samples(queue.pop()))
                    state = fresh if state is None else State.join([state, fresh], self.model)
                state = self._advance(state, descent, out)

        each(work, split(todo, workers(threads, todo.size // (2 * batch))))

    def _attempt_compiled(self, todo, descent: Descent, out: Solved, threads) -> None:
        """`_attempt` by compiled code, which lets go of the interpreter."""
        limits = [self.regularisation, self.limit, LARGEST_STEP, SHORTEST, LENGTHEN]
        batch = 4 * self._together()

        def work(share, stop):
            for start in range(0, share.size, batch):
                if stop.is_set():
                    return
                index = share[start : start + batch]
                guess = self.guess[:, index] if descent is WARM else np.zeros((3, 0))
                done = attempt(self.samples(index, compiled=True), self.rows, descent, limits, guess, self.scaled)
                out.xi[:, index], out.residual[index], evaluations, slowest = done
                out.iterations[index] += evaluations
                out.stuck[index] = (slowest < STUCK_BELOW * self.regularisation) & (not self.linear)

        each(work, split(todo, workers(threads, todo.size // 64)))

    def _start(self, descent: Descent, of: Samples) -> State:
        """The first step from rest: the guess, or the viscous solution, which is a dry law rounded off without end."""
        size = of.size
        at_rest, worst = np.zeros((3, size)), np.full(size, np.inf)
        first = self.regularisation if self.linear else max(descent.widest, self.regularisation)
        eps = np.full(size, first)
        dx = self.guess[:, of.index] if descent is WARM else self.viscous(of)
        going = np.ones(size, bool)
        return State(of, at_rest, dx, of.motion.v, eps, eps, np.ones(size), worst, np.zeros(size, int), going)

    def viscous(self, of: Samples) -> np.ndarray:
        """(3, B): the solution with kinks rounded off almost without end."""
        net = self._net(of, of.motion.v, np.zeros((3, of.size)), np.full(of.size, 1e3))[1]
        return -solve3(net[:, 1:], net[:, 0])

    def with_slope(self, of: Samples, xi, v, eps) -> tuple[np.ndarray, np.ndarray, int]:
        """What comes to the frame, (3, 4, B), its derivative with respect to log eps, (3, B), and the evaluations taken."""
        load, net = self._net(of, v, xi, eps)
        if not self.scaled:
            return net, -of.motion.wrench(_along(load, v)), 1
        more = self._net(of, v, xi, (1.0 + DIFFERENCE) * eps)[1]
        return net, (more[:, 0] - net[:, 0]) / DIFFERENCE, 2

    def residual(self, net: np.ndarray, of: Samples) -> np.ndarray:
        """(B,): the larger of force and moment about the mean place, from those on the frame (3, B)."""
        force = np.sqrt(net[0] * net[0] + net[1] * net[1])
        moment = net[2] - of.centre[0] * net[1] + of.centre[1] * net[0]
        return np.maximum(force, np.abs(moment)) / of.unit

    def _net(self, of: Samples, v, xi, eps) -> tuple[np.ndarray, np.ndarray]:
        """Element loads (3, 4, n, B) and what they, and the terms, come to on the frame, (3, 4, B); its tangent with respect
        to velocities over the scale. Where drag does not depend on speed, the scale makes no difference."""
        if not self.scaled:
            load = of.model.load(v, self.rows, eps)
            return load, of.motion.assembled(load)
        load = of.model.load(v * of.scale, self.rows, eps * of.scale)
        net = of.motion.assembled(load)
        for term in of.model.terms:
            net += term(xi * of.scale)
        net[:, 1:] *= of.scale
        return load, net

    def _advance(self, s: State, descent: Descent, out: Solved) -> State | None:
        """One step of all samples; those that end are written to ``out`` and leave. None when none are left."""
        kept = self._step(s, descent)
        ended = kept & (s.eps <= self.regularisation) & (s.residual <= self.limit)
        ended |= s.iterations >= descent.budget
        ended &= s.going
        if ended.any():
            self._write(s, ended, out)
            s.going = s.going & ~ended
            left = np.flatnonzero(s.going)
            if left.size < CROWDED * s.of.size:
                s = s.take(left)
        return s if s.of.size else None

    def _step(self, s: State, descent: Descent) -> np.ndarray:
        """Try the step of every sample, keep it where it helps, choose the next. Returns the mask of samples kept."""
        v = s.v + s.of.motion.carried(s.dx)
        load, net = self._net(s.of, v, s.xi + s.dx, s.eps_next)
        residual = self.residual(net[:, 0], s.of)
        kept = (s.eps_next < s.eps) | (residual < s.residual) | (s.stride <= SHORTEST)
        s.iterations = s.iterations + 1
        s.xi = np.where(kept, s.xi + s.dx, s.xi)
        s.v = np.where(kept, v, s.v)
        s.residual = np.where(kept, residual, s.residual)
        s.eps = s.eps_next
        halved = 0.5 * s.dx
        s.stride = np.where(kept, np.minimum(1.0, LENGTHEN * s.stride), 0.5 * s.stride)
        s.dx = np.where(kept, self._next_step(s, load, net, kept, descent), halved)
        return kept

    def _next_step(self, s: State, load, net, kept, descent: Descent) -> np.ndarray:
        """Newton's step, and for samples that go on to the next level the change dx/d(eps) brings."""
        down = kept & (s.eps > self.regularisation) & (s.residual < descent.loose)
        right = -s.stride * net[:, 0]
        if down.any():
            d = np.flatnonzero(down)
            # Where every element moves much faster than the rounding, its kinks no longer matter: go all the way.
            free = _slowest(s.v[..., d]) > descent.free * s.eps[d]
            ratio = np.where(free, 0.0, descent.ratio)
            s.eps_next = s.eps.copy()
            s.eps_next[d] = np.maximum(ratio * s.eps[d], self.regularisation)
            # A dry law is homogeneous of degree 0 in (v, eps), so eps dF/d(eps) = -(dF/dv) v. An element at rest creeps
            # in proportion to eps; one that slides feels eps^2.
            slope = _along(load[..., d], s.v[..., d]) * (s.of.scale[d] if self.scaled else 1.0)
            change = s.eps_next[d] / s.eps[d]
            right[:, d] += np.where(free, (change**2 - 1.0) / 2.0, change - 1.0) * s.of.motion.take(d).wrench(slope)
        dx = solve3(net[:, 1:], right)
        if np.abs(dx).max(initial=0.0) <= 1.0:  # then no place within a body length moves by LARGEST_STEP
            return dx
        x, y, turn = dx
        size2 = (x - s.of.centre[1] * turn) ** 2 + (y + s.of.centre[0] * turn) ** 2 + turn * turn
        return dx * (LARGEST_STEP / np.sqrt(np.maximum(size2, LARGEST_STEP**2)))

    def _write(self, s: State, ended: np.ndarray, out: Solved) -> None:
        i = s.of.index[ended]
        there = s.eps <= self.regularisation  # a balance with wider rounding is not the one that was asked for
        out.xi[:, i], out.residual[i] = s.xi[:, ended], np.where(there, s.residual, np.inf)[ended]
        out.iterations[i] += s.iterations[ended]
        out.stuck[i] = self._stuck(s.v[..., ended])


def _slowest(v: np.ndarray) -> np.ndarray:
    """(B,): the speed of the slowest element, each by its faster end, from velocities (3, n, B)."""
    v_t, v_n, spin = v
    return np.sqrt((v_t * v_t + (np.abs(v_n) + np.abs(spin)) ** 2).min(0))


def _along(load: np.ndarray, v: np.ndarray) -> np.ndarray:
    """(3, n, B): the change of element loads (3, 4, n, B) along their velocities, tangent times v."""
    return np.einsum("ijnb,jnb->inb", load[:, 1:], v)
