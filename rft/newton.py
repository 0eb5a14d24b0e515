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
from rft.descents import LARGEST_STEP, LENGTHEN, SHORTEST, Descending, Descent, slowest
from rft.linear import solve3
from rft.media.base import is_closed, is_linear
from rft.numbers import attempt
from rft.path import follow
from rft.samples import Jacobian, Samples
from rft.workers import each, keep_freed_memory, split, workers

STUCK_BELOW = 10.0  # an element whose ends are slower than this many times the regularisation is at rest
ELEMENTS_TOGETHER = 24576  # elements x nodes x samples solved side by side
COMPILED_WORTH = 4096  # samples a thread, below which another does not pay
FASTEST = 1e30  # velocity over the scale, of which none comes near: beyond it squares overflow, and drag reads as 0

keep_freed_memory()


QUICK = Descent(0.011, 0.32, 0.08, 4.0, 48)
WARM = Descent(0.0, 0.0, 0.0, np.inf, 12)  # from a good guess, at the wanted rounding at once
# Walks along a curve: size of a step's first correction, evaluations allowed. A force law alone needs no more than these;
# the slow descents are for effects, and quadrature rules, with kinks of their own that no rounding takes away.
WALKS = ((0.2, 150), (0.02, 600))
SLOW = (
    Descent(0.1, 0.1, 1e-4, 1e3, 150),
    Descent(0.3, 0.3, 1e-6, np.inf, 500),
    Descent(1.0, 0.6, 1e-8, np.inf, 3000),
)
WITHOUT_END = 1e8  # rounding at which every law is a viscous one to the last digit
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
        self.nodes, self.linear = model.contacts[SIDE].law.nodes, is_linear(model.medium)
        self.base = tolerance + 1e-14 * max(1.0, model.lateral / model.unit)  # rounding of the largest forces
        self.limit = self.base

    @classmethod
    def of(cls, model: Model, body: Body, regularisation: float, tolerance: float) -> Balance:
        """That of a model on a body."""
        zero = np.zeros((body.joints, 1))
        return cls(model, rows(model.motions(body.motion(zero, zero))), regularisation, tolerance)

    def solve(self, motion: Callable, scale, threads=None, guess=None, model: Model | None = None) -> Solved:
        """Body velocities of B samples. motion(index): `Kinematics` of all contacts' elements of those samples. scale:
        (B,), the size of their velocities. guess: (3, B), tried first but where it is nan, or beyond FASTEST. model: of this
        batch, if not the balance's own."""
        self.motion, self.scale = motion, scale
        self.model = self.model if model is None else model
        self.scaled = not self.model.rate_independent
        self.unit = self._units(scale)
        self.limit = self.base + sum(1e-14 * np.max(term.size * scale / self.unit) for term in self.model.terms)
        size = scale.size
        out = Solved(np.zeros((3, size)), np.full(size, np.inf), np.zeros(size, int), np.zeros(size, bool))
        todo = np.arange(size)
        with np.errstate(over="ignore"):
            guess = None if guess is None else guess / scale
        for way in (WARM,) * (guess is not None) + (QUICK, *WALKS, *SLOW):
            start = guess if way is WARM else None
            some = todo if start is None else np.flatnonzero(_possible(start))
            if isinstance(way, Descent) and some.size:
                self._descend(some, way, start, out, threads)
            elif some.size:
                self._follow(some, *way, out)
            todo = np.flatnonzero(~(out.residual <= self.limit))
            if not todo.size:
                break
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
        if medium.viscous[0] == 0.0:
            return np.full(scale.size, unit)
        return unit + medium.viscous[0] * np.maximum(scale - 1.0, 0.0)

    def samples(self, index: np.ndarray) -> Samples:
        """Those of the batch."""
        scale, motion = self.scale[index], self.motion(index)
        given = Jacobian.of(motion._replace(v=motion.v / scale))
        return Samples(index, given, motion.centre, scale, self.unit[index], self._model(index))

    def _model(self, index: np.ndarray) -> Model:
        return self.model if index.size == self.scale.size else self.model.take(index)

    def _follow(self, todo, wanted: float, budget: int, out: Solved) -> None:
        """Solve the samples ``todo`` along their curves."""
        for index in np.array_split(todo, math.ceil(todo.size / self._together())):
            for i, xi, v, residual, evaluations in follow(self, index, wanted, budget):
                out.iterations[i] += evaluations
                solved = residual <= self.limit
                i, v = i[solved], v[..., solved]
                out.xi[:, i], out.residual[i], out.stuck[i] = xi[:, solved], residual[solved], self._stuck(slowest(v))

    def _together(self) -> int:
        """How many samples are solved side by side."""
        return max(1, ELEMENTS_TOGETHER // (self.rows[-1].stop * self.nodes))

    def _stuck(self, slowest: np.ndarray) -> np.ndarray:
        """(B,): whether some element is at rest, from the speed of the slowest (B,)."""
        return (slowest < STUCK_BELOW * self.regularisation) & (not self.linear)

    def _descend(self, todo, way: Descent, guess, out: Solved, threads) -> None:
        """Try one descent of the samples ``todo``, shared out to threads."""

        def wrote(index, xi, residual, evaluations, slowest):
            out.xi[:, index], out.stuck[index] = xi, self._stuck(slowest)
            out.residual[index] = np.where(_possible(xi), residual, np.inf)
            out.iterations[index] += evaluations

        if backend.takes(self.backend, self.model, todo.size * self.rows[-1].stop * self.nodes):
            batch = 4 * self._together()
            run, useful = (lambda share, stop: self._compiled(share, stop, batch, way, guess, wrote)), COMPILED_WORTH
        else:
            batch, batches = self._together(), Descending(self, way, guess, wrote)
            run, useful = (lambda share, stop: batches.run(share, stop, batch)), 2 * batch
        with backend.counted(self.backend):
            each(run, split(todo, workers(threads, todo.size // useful)))

    def _compiled(self, share, stop, batch: int, way: Descent, guess, wrote: Callable) -> None:
        """A descent of a share of the samples by compiled code, which lets go of the interpreter."""
        limits = np.array([self.regularisation, self.limit, LARGEST_STEP, SHORTEST, LENGTHEN])
        for start in range(0, share.size, batch):
            if stop.is_set():
                return
            index = share[start : start + batch]
            model, whole = self._model(index), index.size == self.scale.size
            scale, unit = (self.scale, self.unit) if whole else (self.scale[index], self.unit[index])
            begun = None if guess is None else guess[:, index]
            done = attempt(self.motion(index), model, self.rows, scale, unit, begun, way, limits, self.scaled)
            wrote(slice(None) if whole else index, *done)

    def viscous(self, of: Samples) -> np.ndarray:
        """(3, B): the solution with kinks rounded off almost without end."""
        drag = None if self.scaled else self.model.drag(self.rows, WITHOUT_END)
        if drag is None:
            net = self.net(of, of.motion.v, np.zeros((3, of.size)), np.full(of.size, WITHOUT_END))[0]
            return -solve3(net[:, 1:], net[:, 0])
        net, drift = of.motion.assembled(np.broadcast_to(drag, (*drag.shape[:-1], of.size)), of.motion.v)
        return -solve3(net[:, 1:], drift)

    def with_slope(self, of: Samples, xi, v, eps) -> tuple[np.ndarray, np.ndarray, int]:
        """What comes to the frame, (3, 4, B), its derivative with respect to log eps, (3, B), and the evaluations taken."""
        net, slope = self.net(of, v, xi, eps, with_slope=not self.scaled)
        if not self.scaled:
            return net, -slope, 1
        more = self.net(of, v, xi, (1.0 + DIFFERENCE) * eps)[0]
        return net, (more[:, 0] - net[:, 0]) / DIFFERENCE, 2

    def residual(self, net: np.ndarray, of: Samples) -> np.ndarray:
        """(B,): the larger of force and moment about the mean place, from those on the frame (3, B)."""
        force = np.hypot(net[0], net[1])
        moment = net[2] - of.centre[0] * net[1] + of.centre[1] * net[0]
        return np.maximum(force, np.abs(moment)) / of.unit

    def net(self, of: Samples, v, xi, eps, with_slope: bool = False) -> tuple[np.ndarray, np.ndarray | None]:
        """What loads of elements, and terms, come to on the frame, (3, 4, B), and on request what the loads' tangents times v
        do, (3, B). Tangents are with respect to velocities over the scale; where drag does not depend on speed, that makes no
        difference."""
        if not self.scaled:
            return of.motion.assembled(of.model.load(v, self.rows, eps), v if with_slope else None)
        load = of.model.load(v * of.scale, self.rows, eps * of.scale)
        net, slope = of.motion.assembled(load, v if with_slope else None)
        for term in of.model.terms:
            net += term(xi * of.scale)
        net[:, 1:] *= of.scale
        return net, slope if slope is None else slope * of.scale


def _possible(xi: np.ndarray) -> np.ndarray:
    """Return whether velocities over the scale (3, B) are numbers that the solver can compute with, (B,)."""
    return (np.abs(xi) < FASTEST).all(0)
