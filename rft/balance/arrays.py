"""The NumPy driver: all samples take their steps side by side, by the very formulas of the compiled driver."""

from __future__ import annotations

from typing import Any

import numpy as np

from rft.balance.newton import (
    Descent,
    Iterate,
    Limits,
    Net,
    begun,
    carried,
    newton_step,
    on_frame,
    plus,
    times,
    with_momentum,
)
from rft.contact import Problem, mapped, take
from rft.link import point_load, side_load
from rft.momentum import inertia

CROWDED = 0.65  # part of the samples that are still active, below which the others leave the arrays
FEW = 200  # elements x samples, of which fewer take no less time


def velocities(problem: Problem) -> tuple[tuple, tuple]:
    """Return (v_t, v_n, v_w), over the scale, of the body's sides and of points with the frame held."""
    speed = problem.frame.speed
    return tuple(tuple(x / speed for x in contact.elements[6:]) for contact in (problem.sides, problem.points))


def moved(problem: Problem, v, x, y, theta) -> tuple[tuple, tuple]:
    """Return the velocities of sides and points after a change (x, y, theta) of the frame's velocity."""
    contacts = problem.sides, problem.points
    return tuple(plus(u, carried(contact.elements, x, y, theta)) for u, contact in zip(v, contacts))


def loads(problem: Problem, v, rounding) -> list:
    """Return pairs of elements and `Load`, of the sides and, if there are any, of the points, at velocities over the
    scale."""
    sides, points, speed = problem.sides, problem.points, problem.speed
    true = [times(speed, u) for u in v]
    rounding, acts = rounding * speed, problem.acts
    load = side_load(problem.law, true[0], rounding, sides.factor, sides.incline, problem.square, problem.memory, acts)
    found = [(sides.elements, load)]
    if len(points.station):
        found.append(
            (points.elements, point_load(problem.point_terms, true[1], rounding, points.factor, points.incline, acts))
        )
    return found


def net_of(problem: Problem, v, rounding, x, y, theta, mass=None) -> Net:
    """Return what loads, and momentum, come to on the frame at velocities v of elements and (x, y, theta) of the frame.

    Every entry is (B,); velocities are over the scale of speed. mass: `rft.momentum.inertia`, computed if it is not
    given."""
    speed = problem.speed
    net, *others = (summed(on_frame(e, f, u, speed)) for (e, f), u in zip(loads(problem, v, rounding), v))
    for other in others:
        net = Net(*map(plus, net, other))
    if problem.momenta is not None:
        mass = inertia(problem.sides.elements, problem.momenta) if mass is None else mass
        net = with_momentum(net, x, y, theta, row(mass), speed[0])
    return net


def nets(problem: Problem, v: np.ndarray, rounding: np.ndarray, xi: np.ndarray) -> np.ndarray:
    """Return the entries of `Net` (5, 3, B) at velocities v (3, n, B) of elements, those of points last, and xi (3, B)
    of the frame."""
    n = len(problem.sides.station)
    return np.array(net_of(problem, (tuple(v[:, :n]), tuple(v[:, n:])), rounding, *xi))


def summed(net: Net) -> Net:
    """Return the sum over elements of what they do to the frame."""
    return Net(*[tuple([np.add.reduce(term, 0) for term in triple]) for triple in net])


def slowest2(v) -> np.ndarray:
    """Return the square of the slowest element's speed (B,), each by its faster end."""
    least = [(v_t * v_t + (np.abs(v_n) + np.abs(v_w)) ** 2).min(0) for v_t, v_n, v_w in v if len(v_t)]
    return least[0] if len(least) == 1 else np.minimum(*least)


def row(record) -> Any:
    """Return a record of arrays (1, B) as one of arrays (B,)."""
    return mapped(lambda x: x[0], record)


def solve(problem: Problem, descent: Descent, limits: Limits, guess: np.ndarray | None) -> tuple:
    """Solve all samples by one descent: (xi (3, B) over the scale, residual, evaluations, slowest element's speed).

    guess: (3, B), over the scale, or None. The residual is infinite where the wanted rounding was not reached.
    """
    size, fresh = problem.size, guess is None
    it = begun(*(np.zeros((3, size)) if fresh else guess), descent.first, np.full(size, float(fresh)))
    mass = None if problem.momenta is None else inertia(problem.sides.elements, problem.momenta)
    active, index, v = np.ones(size, bool), np.arange(size), velocities(problem)
    xi, rest = np.zeros((3, size)), np.full((3, size), np.inf)
    while index.size:
        tried = moved(problem, v, it.dx, it.dy, it.dtheta)
        x, y, theta = it.x + it.dx, it.y + it.dy, it.theta + it.dtheta
        net = net_of(problem, tried, it.rounding_next, x, y, theta, mass)
        it, accepted, done = newton_step(it, net, slowest2(tried), row(problem.frame), descent, limits)
        v = tried if accepted.all() else mapped(lambda a, b: np.where(accepted, a, b), tried, v)
        ended = done & active
        if ended.any():
            i = index[ended]
            xi[:, i] = np.stack([it.x, it.y, it.theta])[:, ended]
            rest[:, i] = np.stack([residual_at(it, limits), it.evaluations, it.slowest])[:, ended]
            active &= ~ended
            count = np.count_nonzero(active)
            if count == 0:
                break
            if count < CROWDED * active.size and v[0][0].size > FEW:
                keep = np.flatnonzero(active)
                index, problem, it, v, mass = (
                    index[keep],
                    problem.take(keep),
                    take(it, keep),
                    take(v, keep),
                    take(mass, keep),
                )
                active = active[keep]
    return xi, rest[0], rest[1].astype(int), rest[2]


def residual_at(it: Iterate, limits: Limits) -> np.ndarray:
    """Return the residuals; infinite at a wider rounding, whose balance is not the one that was asked for."""
    return np.where(it.rounding <= limits.last, it.residual, np.inf)
