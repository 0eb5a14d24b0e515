"""Follow the solutions of a balance from a wide rounding of its kinks to the wanted one, round folds.

With a wide rounding ``eps`` a dry law is viscous and has one solution. From there a curve of solutions (xi, eps) leads
to any smaller rounding, since drag bounds the velocities. Where a law is not monotone, as a granular one, the curve may
fold: eps grows again for a while, three solutions share it, and a descent that only lowers eps falls off. The curve
goes on, and is followed by its arc length: a step along the tangent predicts, Newton's method across it corrects, with
parts of its steps where the natural monotonicity test asks for them. (Allgower and Georg, Numerical Continuation
Methods, 1990, chapters 2 and 6; Deuflhard, Newton Methods for Nonlinear Problems, 2004, section 3.3.)

A change of (xi, log eps) counts as the largest change of an element's velocity over its speed or eps, the larger: no
frame, unit or scale matters. Of several solutions this takes the first on the curve, where the tangent dF/dxi has a
positive determinant.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from rft.balance.arrays import row, velocities
from rft.balance.newton import VISCOUS, Limits, carried, residual_of, solve3, to_frame
from rft.contact import Problem

WIDE = 10.0  # rounding to start from, body lengths per radian: no element is that fast
FIRST = 2.0  # the first step
LONGEST = 1.0  # first correction that is not refused
CLOSE, SMALL = 0.25, 1e-6  # a correction is the last one: as part of the one before, or whatever that was
CORRECTIONS, AT_THE_END = 5, 8  # of a step; of one that reaches the wanted rounding
FINE, PATIENCE = 1e-5, 30  # steps below this are corrected with damping, so many times
GROWS, SHRINKS = 3.0, 0.5  # the step's change, at most after a success, at least after a failure
LEAST = 2.0**-10  # part of a correction that is taken whether it helps or not
DIFFERENCE = 1e-6  # of the rounding, for the derivative with respect to it


def _stacked(triples) -> np.ndarray:
    """Return velocities (3, n, B) of all elements, those of the sides first, from triples of the sides and of the
    points."""
    stacks = [np.array(u) for u in triples]
    return stacks[0] if len(stacks) == 1 else np.concatenate(stacks, 1)


def _contacts(of: Problem) -> list:
    return [contact for contact in (of.sides, of.points) if len(contact.station)]


def _carried(of: Problem, xi: np.ndarray) -> np.ndarray:
    """Return what a change xi (3, B) of the frame's velocity adds to those of all elements, (3, n, B)."""
    return _stacked([carried(contact.elements, *xi) for contact in _contacts(of)])


def _wrench(of: Problem, force: np.ndarray) -> np.ndarray:
    """Return force and moment on the frame (3, B) of forces on all elements (3, n, B), with their weights."""
    n = len(of.sides.station)
    parts = [(contact.elements, f) for contact, f in zip(_contacts(of), (force[:, :n], force[:, n:]))]
    return sum(np.array(to_frame(e, *(e.weight * f))).sum(1) for e, f in parts)


def _with_slope(nets: Callable, of: Problem, xi, v, rounding) -> tuple[np.ndarray, np.ndarray, int]:
    """Return force and moment on the frame beside their slopes in xi, (3, 4, B), their slope (3, B) in the logarithm of
    the rounding, and the evaluations taken."""
    *net, drift = nets(of, v, rounding, xi)
    net = np.array(net).transpose(1, 0, 2)
    if of.speed.shape[-1] == 1:  # doubled velocities, and rounding, give the same drag
        return net, -drift, 1
    more = nets(of, v, (1.0 + DIFFERENCE) * rounding, xi)[0]
    return net, (more - net[:, 0]) / DIFFERENCE, 2


def solve4(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return x (4, k, B) with matrix (4, 4, B) x = right; nan where the matrix is singular or no number."""
    matrix, right = np.moveaxis(matrix, -1, 0), np.moveaxis(right, -1, 0)
    sound = np.abs(np.linalg.det(matrix)) > 0
    x = np.linalg.solve(np.where(sound[:, None, None], matrix, np.eye(4)), right)
    return np.moveaxis(np.where(sound[:, None, None], x, np.nan), 0, -1)


class _Point(NamedTuple):
    """xi: (3, B). v: (3, n, B), element velocities there. eps: (B,)."""

    xi: np.ndarray
    v: np.ndarray
    eps: np.ndarray

    def moved(self, of: Problem, change: np.ndarray) -> _Point:
        """After a change (4, B) of (xi, log eps)."""
        return _Point(self.xi + change[:3], self.v + _carried(of, change[:3]), self.eps * np.exp(change[3]))

    def where(self, mask: np.ndarray, other: _Point) -> _Point:
        """This point where the mask (B,) says so, the other elsewhere."""
        return _Point(*(np.where(mask, x, y) for x, y in zip(self, other)))

    def take(self, keep) -> _Point:
        return _Point(*(x[..., keep] for x in self))

    def speed2(self) -> np.ndarray:
        """(n, B): squares of the elements' speeds, each at its faster end, and of eps."""
        return self.fastest2() + self.eps**2

    def fastest2(self) -> np.ndarray:
        """(n, B): squares of the elements' speeds, each at its faster end."""
        v_t, v_n, v_w = self.v
        return v_t * v_t + (np.abs(v_n) + np.abs(v_w)) ** 2

    def size(self, of: Problem, change: np.ndarray) -> np.ndarray:
        """(B,): the size of a change (4, B), as the module's heading has it."""
        v = _carried(of, change[:3])
        return np.maximum(np.sqrt(((v * v).sum(0) / self.speed2()).max(0)), np.abs(change[3]))


@dataclass
class _Walk:
    """Samples on their curves. Every array has them on its last axis."""

    index: np.ndarray  # (B,), which samples these are
    of: Problem
    evaluations: np.ndarray
    foot: _Point  # on the curve
    tangent: np.ndarray  # (4, B) there, of size 1
    border: np.ndarray  # (4, B) what a correction is to leave alone: the tangent, by the metric
    step: np.ndarray  # along the tangent
    point: _Point  # on the way to the curve, after a step
    change: np.ndarray  # (4, B) to try from there
    part: np.ndarray  # of the correction that is
    size: np.ndarray  # of the whole correction
    matrix: np.ndarray  # (4, 4, B) that it was solved with
    tries: np.ndarray  # corrections since the foot
    miss: np.ndarray  # size of the first one
    last: np.ndarray  # whether the step reaches the wanted rounding

    def take(self, keep: np.ndarray) -> _Walk:
        parts = {f.name: getattr(self, f.name) for f in fields(self)}
        moves = ("of", "foot", "point")
        return _Walk(**{k: x.take(keep) if k in moves else x[..., keep] for k, x in parts.items()})


def follow(problem: Problem, limits: Limits, nets: Callable, wanted: float, budget: int) -> Iterator[tuple]:
    """Solve all samples of a problem. Yields (their places, xi (3, b) over the scale, residual (b,), evaluations (b,),
    speed of the slowest element (b,)) as they end, with residual inf where the budget is spent.

    nets: `rft.balance.arrays.nets` or its compiled twin. wanted: the size of a step's first correction, by which the
    next step is chosen."""
    s = _start(nets, problem, limits.last)
    while s.index.size:
        new = s.point.moved(s.of, s.change)
        new = new._replace(eps=np.where(s.last, limits.last, new.eps))
        net, slope, cost = _with_slope(nets, s.of, *new)
        s.evaluations = s.evaluations + cost
        residual = residual_of(net[:, 0], row(s.of.frame))
        done = s.last & (residual <= limits.residual)
        _correct(s, new, net, slope, wanted, limits.last)
        ended = done | (s.evaluations >= budget)
        if ended.any():
            i = np.flatnonzero(ended)
            residual = np.where(done, residual, np.inf)[i]
            slowest = np.sqrt(new.fastest2().min(0))[i]
            yield s.index[i], new.xi[:, i], residual, s.evaluations[i], slowest
            s = s.take(np.flatnonzero(~ended))


def _start(nets: Callable, of: Problem, last: float) -> _Walk:
    """Return all samples at the viscous solution, on the way to less rounding."""
    size = of.size
    held = _stacked([u for u in velocities(of) if len(u[0])])
    force, *columns, _ = nets(of, held, np.full(size, VISCOUS), np.zeros((3, size)))
    xi = -np.array(solve3(*columns, force))
    foot = _Point(xi, held + _carried(of, xi), np.full(size, max(WIDE, last)))
    down = np.zeros((4, size))
    down[3] = -1.0
    zero, one, count = np.zeros(size), np.ones(size), np.zeros(size, int)
    s = _Walk(np.arange(size), of, count + 1, foot, down, down, FIRST * one, foot, down, one, zero,
              np.zeros((4, 4, size)), count, zero, count > 0)  # fmt: skip
    _predict(s, np.ones(size, bool), last)
    return s


def _predict(s: _Walk, who: np.ndarray, target: float) -> None:
    """A step along the tangent for the samples ``who``, straight in (xi, eps), for an element at rest creeps with
    eps."""
    slope = s.tangent[3]
    eps = s.foot.eps * np.exp(np.clip(s.step * slope, -100.0, 5.0))
    last = eps <= target
    eps = np.where(last, target, eps)
    level = np.abs(slope) < 1e-9
    part = np.where(level, s.step, (eps / s.foot.eps - 1.0) / np.where(level, 1.0, slope))
    ahead = np.concatenate([s.tangent[:3] * part, np.log(eps / s.foot.eps)[None]])
    s.point = s.foot.where(who, s.point)
    s.change = np.where(who, ahead, s.change)
    s.last = np.where(who, last, s.last)
    s.part, s.tries = np.where(who, 1.0, s.part), np.where(who, 0, s.tries)


@np.errstate(over="ignore", invalid="ignore")  # corrections that fail may be of any size
def _correct(s: _Walk, new: _Point, net, slope, wanted: float, target: float) -> None:
    """Judge the points that were tried, and choose what to try next."""
    matrix = _bordered(s, net, slope)
    right = np.zeros((4, 2, s.index.size))
    right[:3, 0], right[3, 1] = -net[:, 0], 1.0
    correction, tangent = np.moveaxis(solve4(matrix, right), 1, 0)
    size = new.size(s.of, correction)
    first, fine = s.tries == 0, s.step < FINE
    s.miss = np.where(first, size, s.miss)
    # With the matrix of the point before, a correction must be smaller by about half the part that was taken.
    before = s.point.size(s.of, solve4(np.where(first, np.eye(4)[..., None], s.matrix), right[:, :1])[:, 0])
    smaller = first | (before <= (1.0 - 0.5 * s.part) * s.size) | (s.part <= LEAST)
    most = np.where(fine, PATIENCE, np.where(s.last, AT_THE_END, CORRECTIONS))
    failed = ~np.isfinite(size) | (first & (size > LONGEST)) | ~(smaller | fine) | (s.tries >= most)
    onto = ~failed & smaller & ~first & ~s.last & (s.part == 1.0) & (size <= np.maximum(CLOSE * s.size, SMALL))
    going = ~failed & smaller & ~onto
    part = np.where(going, np.where(first, 1.0, np.minimum(1.0, 2.0 * s.part)), 0.5 * s.part)
    s.change = np.where(going, part * correction, 0.5 * s.change)
    s.change[3] = np.clip(s.change[3], -1.0, 1.0)
    s.point = new.where(going, s.point)
    s.size, s.matrix = np.where(going, size, s.size), np.where(going, matrix, s.matrix)
    s.part, s.tries = part, s.tries + 1
    if onto.any():
        _stand(s, onto, new, correction, tangent)
    factor = np.sqrt(wanted / np.fmax(s.miss, 1e-9))
    s.step = np.where(onto, s.step * np.clip(factor, 1 / GROWS, GROWS), s.step)
    s.step = np.where(failed, s.step * np.fmin(np.fmax(factor, 0.1), SHRINKS), s.step)
    if (failed | onto).any():
        _predict(s, failed | onto, target)


def _bordered(s: _Walk, net, slope) -> np.ndarray:
    """(4, 4, B): the tangent with respect to (xi, log eps) over the border; over eps itself in the last step."""
    matrix = np.empty((4, 4, s.index.size))
    matrix[:3, :3], matrix[:3, 3] = net[:, 1:], slope
    matrix[3] = np.where(s.last, np.eye(4)[3][:, None], s.border)
    return matrix


def _stand(s: _Walk, who: np.ndarray, new: _Point, correction, tangent) -> None:
    """Take the corrected points of the samples ``who`` for points of the curve, and the tangents there."""
    foot = new.moved(s.of, np.where(who, correction, 0.0))
    tangent = tangent / foot.size(s.of, tangent)
    border = _wrench(s.of, _carried(s.of, tangent[:3]) / foot.speed2())
    s.foot = foot.where(who, s.foot)
    s.tangent = np.where(who, tangent, s.tangent)
    s.border = np.where(who, np.concatenate([border, tangent[3:]]), s.border)
