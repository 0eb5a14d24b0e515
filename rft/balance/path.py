"""Continuation of solutions of a balance from a wide rounding to the required one,
through folds.

With a wide ``rounding`` a dry law is viscous and has one solution. From there a curve
of solutions (xi, rounding) leads to any smaller rounding, since drag bounds the
velocities. Where a law is not monotone, as granular laws are, the curve may fold: the
rounding increases again along a stretch of it, three solutions share one rounding, and
a descent, which only lowers the rounding, fails. Here the curve is followed by its arc
length: a step along the tangent predicts, Newton's method across the tangent corrects,
damped where the natural monotonicity test requires it. (Allgower and Georg, Numerical
Continuation Methods, 1990, chapters 2 and 6; Deuflhard, Newton Methods for Nonlinear
Problems, 2004, section 3.3.)

The size of a change of (xi, log rounding) is the largest change of an element's
velocity over its speed or the rounding, whichever is larger, so that it does not depend
on frames, units or scales. Of several solutions the walk returns the first on the
curve, where the tangent dF/dxi has a positive determinant.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from rft.balance.arrays import nets, row, velocities
from rft.effects.contact import Problem
from rft.formulas.newton import (
    VISCOUS,
    Limits,
    is_possible,
    residual_norm,
    solve3,
    to_element,
    to_frame,
)

# rounding to start from, over the scale of speed: no element is that fast
WIDEST = 10.0
LOST = 2.0  # rounding over the first one, beyond which a walk has taken the way back
FIRST_STEP = 2.0
LARGEST_CORRECTION = 1.0  # first correction of a step that is not refused
# Size of a correction that is the last of a step: over that of the previous correction,
# or absolute.
CONVERGED_RATIO = 0.25
CONVERGED = 1e-6
MOST_CORRECTIONS = 5  # of a step
MOST_AT_THE_END = 8  # of the step that reaches the required rounding
FINE_STEP = 1e-5  # size of a step below which corrections are damped
MOST_FINE = 30  # corrections of a step below FINE_STEP
GROWTH = 3.0  # largest factor of the step after a success
SHRINKAGE = 0.5  # smallest factor of the step after a failure
# a correction with so little is accepted though the next one is no smaller
LEAST_DAMPING = 2.0**-10
DIFFERENCE = 1e-6  # of the rounding, for the derivative with respect to it


def _stacked(triples) -> np.ndarray:
    """Return velocities (3, n, B) of all elements, those of the sides first, from
    triples of the sides and of the points."""
    stacks = [np.array(u) for u in triples]
    if len(stacks) == 1:
        return stacks[0]
    return np.concatenate(stacks, 1)


def _contacts(problem: Problem) -> list:
    return [
        contact for contact in (problem.sides, problem.points) if len(contact.station)
    ]


def _to_elements(problem: Problem, xi: np.ndarray) -> np.ndarray:
    """Return the contribution of a velocity xi (3, B) of the frame to the velocities of
    all elements, (3, n, B)."""
    return _stacked(
        [to_element(contact.elements, *xi) for contact in _contacts(problem)]
    )


def _wrench(problem: Problem, force: np.ndarray) -> np.ndarray:
    """Return force and moment on the frame (3, B) of forces on all elements (3, n, B),
    with their weights."""
    n = len(problem.sides.station)
    wrench = 0.0
    for contact, f in zip(_contacts(problem), (force[:, :n], force[:, n:])):
        e = contact.elements
        wrench = wrench + np.array(to_frame(e, *(e.weight * f))).sum(1)
    return wrench


def _with_slope(
    problem: Problem, xi, v, rounding
) -> tuple[np.ndarray, np.ndarray, int]:
    """Return force and moment on the frame followed by their slopes in xi, (3, 4, B),
    their slope (3, B) in the logarithm of the rounding, and the number of
    evaluations."""
    *net, by_speed = nets(problem, v, rounding, xi)
    net = np.array(net).transpose(1, 0, 2)
    if problem.is_scale_free:
        return net, -by_speed, 1
    wider = nets(problem, v, (1.0 + DIFFERENCE) * rounding, xi)[0]
    return net, (wider - net[:, 0]) / DIFFERENCE, 2


def solve4(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return x (4, k, B) with matrix (4, 4, B) x = right; nan where the matrix is
    singular or no number."""
    matrix = np.moveaxis(matrix, -1, 0)
    right = np.moveaxis(right, -1, 0)
    is_regular = np.abs(np.linalg.det(matrix)) > 0
    x = np.linalg.solve(np.where(is_regular[:, None, None], matrix, np.eye(4)), right)
    return np.moveaxis(np.where(is_regular[:, None, None], x, np.nan), 0, -1)


class _Point(NamedTuple):
    """A velocity and a rounding. xi: (3, B). v: (3, n, B), velocities of the elements
    at xi. rounding: (B,)."""

    xi: np.ndarray
    v: np.ndarray
    rounding: np.ndarray

    def shifted(self, problem: Problem, change: np.ndarray) -> _Point:
        """Return the point after a change (4, B) of (xi, log rounding)."""
        v = self.v + _to_elements(problem, change[:3])
        return _Point(self.xi + change[:3], v, self.rounding * np.exp(change[3]))

    def where(self, mask: np.ndarray, other: _Point) -> _Point:
        """Return this point where the mask (B,) is true, the other elsewhere."""
        return _Point(*(np.where(mask, x, y) for x, y in zip(self, other)))

    def take(self, index) -> _Point:
        return _Point(*(x[..., index] for x in self))

    def squared_scale(self) -> np.ndarray:
        """Return squares of the elements' speeds plus the square of the rounding,
        (n, B)."""
        return self.squared_speed() + self.rounding**2

    def squared_speed(self) -> np.ndarray:
        """Return squares of the elements' speeds, each at its faster end, (n, B)."""
        v_t, v_n, v_w = self.v
        return v_t * v_t + (np.abs(v_n) + np.abs(v_w)) ** 2

    def size(self, problem: Problem, change: np.ndarray) -> np.ndarray:
        """Return the size (B,) of a change (4, B), as the module heading defines it."""
        v = _to_elements(problem, change[:3])
        return np.maximum(
            np.sqrt(((v * v).sum(0) / self.squared_scale()).max(0)), np.abs(change[3])
        )


@dataclass
class _Walk:
    """Samples on their curves, on the last axis of every array."""

    index: np.ndarray  # (B,), of the samples in the problem that is solved
    problem: Problem
    evaluations: np.ndarray
    base: _Point  # the last point on the curve
    tangent: np.ndarray  # (4, B), at the base, of size 1
    # (4, B), row of the tangent in the metric: corrections do not change its product
    # with a change
    border: np.ndarray
    step: np.ndarray  # length along the tangent
    point: _Point  # before the change that is tried
    change: np.ndarray  # (4, B), tried from the point
    damping: np.ndarray  # fraction of the correction in that change
    size: np.ndarray  # of the undamped correction
    matrix: np.ndarray  # (4, 4, B), with which it was solved
    corrections: np.ndarray  # number of them since the base
    first_size: np.ndarray  # of the first correction since the base
    last: np.ndarray  # whether the step reaches the required rounding

    def take(self, index: np.ndarray) -> _Walk:
        """Return the walk of some of the samples."""
        selected = {}
        for field in fields(self):
            x = getattr(self, field.name)
            if isinstance(x, np.ndarray):
                selected[field.name] = x[..., index]
            else:
                selected[field.name] = x.take(index)
        return _Walk(**selected)


def follow(
    problem: Problem, limits: Limits, correction: float, budget: int
) -> Iterator[tuple]:
    """Solve all samples of a problem. Yields their indices and their results, rows
    (6, b) as those of `rft.formulas.newton.result`, as they end, with an infinite
    residual where the budget is spent or the curve is lost.

    correction: intended size of the first correction of a step, by which the length of
    steps is chosen. budget: most evaluations."""
    walk = _start(problem, limits.rounding)
    while walk.index.size:
        new = walk.point.shifted(walk.problem, walk.change)
        new = new._replace(rounding=np.where(walk.last, limits.rounding, new.rounding))
        net, slope, evaluations = _with_slope(walk.problem, *new)
        walk.evaluations = walk.evaluations + evaluations
        residual = residual_norm(net[:, 0], row(walk.problem.frame))
        solved = walk.last & (residual <= limits.residual)
        _correct(walk, new, net, slope, correction, limits.rounding)
        is_lost = walk.base.rounding > LOST * max(WIDEST, limits.rounding)
        ended = solved | (walk.evaluations >= budget) | is_lost
        if ended.any():
            i = np.flatnonzero(ended)
            residual = np.where(solved & is_possible(*new.xi), residual, np.inf)
            slowest = np.sqrt(new.squared_speed().min(0))
            yield (
                walk.index[i],
                np.stack([*new.xi, residual, walk.evaluations, slowest])[:, i],
            )
            walk = walk.take(np.flatnonzero(~ended))


def _start(problem: Problem, last: float) -> _Walk:
    """Return all samples at the viscous solution, with a first step towards less
    rounding."""
    size = problem.n_samples
    v = _stacked([u for u in velocities(problem) if len(u[0])])
    force, *columns, _ = nets(problem, v, np.full(size, VISCOUS), np.zeros((3, size)))
    xi = -np.array(solve3(*columns, force))
    base = _Point(xi, v + _to_elements(problem, xi), np.full(size, max(WIDEST, last)))
    tangent = np.zeros((4, size))
    tangent[3] = -1.0
    walk = _Walk(
        index=np.arange(size),
        problem=problem,
        evaluations=np.ones(size, int),
        base=base,
        tangent=tangent,
        border=tangent,
        step=np.full(size, FIRST_STEP),
        point=base,
        change=tangent,
        damping=np.ones(size),
        size=np.zeros(size),
        matrix=np.zeros((4, 4, size)),
        corrections=np.zeros(size, int),
        first_size=np.zeros(size),
        last=np.zeros(size, bool),
    )
    _predict(walk, np.ones(size, bool), last)
    return walk


def _predict(walk: _Walk, mask: np.ndarray, last: float) -> None:
    """Set the next change of the masked samples to a step along the tangent.

    The step is straight in (xi, rounding), for the velocity of an element at rest is
    proportional to the rounding."""
    slope = walk.tangent[3]
    rounding = walk.base.rounding * np.exp(np.clip(walk.step * slope, -100.0, 5.0))
    reaches_last = rounding <= last
    rounding = np.where(reaches_last, last, rounding)
    ratio = rounding / walk.base.rounding
    level = np.abs(slope) < 1e-9
    length = np.where(level, walk.step, (ratio - 1.0) / np.where(level, 1.0, slope))
    change = np.concatenate([walk.tangent[:3] * length, np.log(ratio)[None]])
    walk.point = walk.base.where(mask, walk.point)
    walk.change = np.where(mask, change, walk.change)
    walk.last = np.where(mask, reaches_last, walk.last)
    walk.damping = np.where(mask, 1.0, walk.damping)
    walk.corrections = np.where(mask, 0, walk.corrections)


@np.errstate(
    over="ignore", invalid="ignore"
)  # corrections that fail may be of any size
def _correct(
    walk: _Walk, new: _Point, net, slope, intended: float, last: float
) -> None:
    """Accept or refuse the new points, and choose the next changes."""
    matrix = _bordered(walk, net, slope)
    right = np.zeros((4, 2, walk.index.size))
    right[:3, 0] = -net[:, 0]
    right[3, 1] = 1.0
    correction, tangent = np.moveaxis(solve4(matrix, right), 1, 0)
    size = new.size(walk.problem, correction)
    first = walk.corrections == 0
    fine = walk.step < FINE_STEP
    walk.first_size = np.where(first, size, walk.first_size)
    # Natural monotonicity: with the previous matrix, a correction must be smaller by
    # about half the damping.
    previous_matrix = np.where(first, np.eye(4)[..., None], walk.matrix)
    simplified = walk.point.size(
        walk.problem, solve4(previous_matrix, right[:, :1])[:, 0]
    )
    smaller = (
        first
        | (simplified <= (1.0 - 0.5 * walk.damping) * walk.size)
        | (walk.damping <= LEAST_DAMPING)
    )
    most = np.where(
        fine, MOST_FINE, np.where(walk.last, MOST_AT_THE_END, MOST_CORRECTIONS)
    )
    failed = ~np.isfinite(size) | (first & (size > LARGEST_CORRECTION))
    failed |= ~(smaller | fine) | (walk.corrections >= most)
    converged = (walk.damping == 1.0) & (
        size <= np.maximum(CONVERGED_RATIO * walk.size, CONVERGED)
    )
    on_curve = ~failed & smaller & ~first & ~walk.last & converged
    accepted = ~failed & smaller & ~on_curve
    damping = np.where(
        accepted,
        np.where(first, 1.0, np.minimum(1.0, 2.0 * walk.damping)),
        0.5 * walk.damping,
    )
    walk.change = np.where(accepted, damping * correction, 0.5 * walk.change)
    walk.change[3] = np.clip(walk.change[3], -1.0, 1.0)
    walk.point = new.where(accepted, walk.point)
    walk.size = np.where(accepted, size, walk.size)
    walk.matrix = np.where(accepted, matrix, walk.matrix)
    walk.damping = damping
    walk.corrections = walk.corrections + 1
    if on_curve.any():
        _rebase(walk, on_curve, new, correction, tangent)
    factor = np.sqrt(intended / np.fmax(walk.first_size, 1e-9))
    walk.step = np.where(
        on_curve, walk.step * np.clip(factor, 1 / GROWTH, GROWTH), walk.step
    )
    walk.step = np.where(
        failed, walk.step * np.fmin(np.fmax(factor, 0.1), SHRINKAGE), walk.step
    )
    if (failed | on_curve).any():
        _predict(walk, failed | on_curve, last)


def _bordered(walk: _Walk, net, slope) -> np.ndarray:
    """Return the tangent in (xi, log rounding) over the border, (4, 4, B); in the last
    step the border is that of a fixed rounding."""
    matrix = np.empty((4, 4, walk.index.size))
    matrix[:3, :3] = net[:, 1:]
    matrix[:3, 3] = slope
    matrix[3] = np.where(walk.last, np.eye(4)[3][:, None], walk.border)
    return matrix


def _rebase(walk: _Walk, mask: np.ndarray, new: _Point, correction, tangent) -> None:
    """Make the corrected points of the masked samples the base, with the tangents
    there."""
    base = new.shifted(walk.problem, np.where(mask, correction, 0.0))
    tangent = tangent / base.size(walk.problem, tangent)
    metric = _wrench(
        walk.problem, _to_elements(walk.problem, tangent[:3]) / base.squared_scale()
    )
    walk.base = base.where(mask, walk.base)
    walk.tangent = np.where(mask, tangent, walk.tangent)
    walk.border = np.where(mask, np.concatenate([metric, tangent[3:]]), walk.border)
