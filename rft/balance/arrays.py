"""The NumPy driver: a batch of samples takes each step together, by the formulas that
the compiled driver compiles."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from rft.effects.contact import Problem, mapped, take
from rft.formulas.link import point_load, side_load
from rft.formulas.momentum import frame_inertia
from rft.formulas.newton import (
    RESULT_ROWS,
    Descent,
    Limits,
    Net,
    element_net,
    first_iterate,
    newton_step,
    plus,
    result,
    times,
    to_element,
    with_momentum,
)

# Samples that have ended leave the arrays where less than COMPACT_BELOW of them are
# active, and where the arrays have more than COMPACT_ABOVE elements x samples: smaller
# arrays take as long.
COMPACT_BELOW = 0.65
COMPACT_ABOVE = 200


def velocities(problem: Problem) -> tuple[tuple, tuple]:
    """Return (v_t, v_n, v_w) over the scale of speed, of the body's sides and of its
    points, with the frame held."""
    speed = problem.frame.speed_scale
    return tuple(
        tuple(x / speed for x in contact.elements[6:])
        for contact in (problem.sides, problem.points)
    )


def with_frame_velocity(problem: Problem, v, x, y, theta) -> tuple[tuple, tuple]:
    """Return the velocities v of sides and points plus those due to a velocity
    (x, y, theta) of the frame."""
    contacts = problem.sides, problem.points
    return tuple(
        plus(u, to_element(contact.elements, x, y, theta))
        for u, contact in zip(v, contacts)
    )


def loads(problem: Problem, v, rounding) -> list:
    """Return pairs of `Elements` and their `Load`, for the sides and, if there are any,
    for the points, at velocities v over the scale of speed."""
    sides = problem.sides
    points = problem.points
    additions = problem.additions
    speed = problem.law_speed_scale
    v_sides, v_points = (times(speed, u) for u in v)
    rounding = rounding * speed
    load = side_load(
        problem.law,
        v_sides,
        rounding,
        sides.factor,
        sides.incline,
        problem.quadratic_drag,
        problem.memory,
        additions,
    )
    if not len(points.station):
        return [(sides.elements, load)]
    on_points = point_load(
        problem.point_terms,
        v_points,
        rounding,
        points.factor,
        points.incline,
        additions,
    )
    return [(sides.elements, load), (points.elements, on_points)]


def frame_net(problem: Problem, v, rounding, x, y, theta, mass=None) -> Net:
    """Return the sum of loads, and of the rate of change of momentum, on the frame;
    entries (B,).

    v, (x, y, theta): velocities of elements and of the frame, over the scale of speed.
    mass: `rft.formulas.momentum.frame_inertia`, computed by default."""
    speed = problem.law_speed_scale
    net, *of_points = (
        sum_elements(element_net(e, f, u, speed))
        for (e, f), u in zip(loads(problem, v, rounding), v)
    )
    for other in of_points:
        net = Net(*map(plus, net, other))
    if problem.momentum_rate is not None:
        if mass is None:
            mass = frame_inertia(problem.sides.elements, problem.momentum_rate)
        net = with_momentum(net, x, y, theta, row(mass), speed[0])
    return net


def nets(
    problem: Problem, v: np.ndarray, rounding: np.ndarray, xi: np.ndarray
) -> np.ndarray:
    """Return the entries of `Net` (5, 3, B) at velocities v (3, n, B) of elements,
    those of points last, and xi (3, B) of the frame."""
    n = len(problem.sides.station)
    v_by_contact = tuple(v[:, :n]), tuple(v[:, n:])
    return np.array(frame_net(problem, v_by_contact, rounding, *xi))


def sum_elements(net: Net) -> Net:
    """Return the sum of a `Net` over its elements."""
    return Net(*[tuple([np.add.reduce(term, 0) for term in triple]) for triple in net])


def slowest2(v) -> np.ndarray:
    """Return the square of the slowest element's speed (B,), each by its faster end."""
    least = [
        (v_t * v_t + (np.abs(v_n) + np.abs(v_w)) ** 2).min(0)
        for v_t, v_n, v_w in v
        if len(v_t)
    ]
    if len(least) == 1:
        return least[0]
    return np.minimum(*least)


def row(record) -> Any:
    """Return a record of arrays (1, B) as a record of arrays (B,)."""
    return mapped(lambda x: x[0], record)


def solve(
    problem: Problem, descent: Descent, limits: Limits, guess: np.ndarray | None
) -> np.ndarray:
    """Return the results of all samples after one descent, the rows (6, B) of
    `rft.formulas.newton.result`.

    guess: (3, B) or None. Velocities are over the scale of speed."""
    size = problem.n_samples
    fresh = guess is None
    if fresh:
        guess = np.zeros((3, size))
    iterate = first_iterate(*guess, descent.first, np.full(size, float(fresh)))
    mass = None
    if problem.momentum_rate is not None:
        mass = frame_inertia(problem.sides.elements, problem.momentum_rate)
    active = np.ones(size, bool)
    index = np.arange(size)
    v = velocities(problem)
    out = np.empty((RESULT_ROWS, size))
    while index.size:
        step = iterate.dx, iterate.dy, iterate.dtheta
        v_next = with_frame_velocity(problem, v, *step)
        xi_next = plus((iterate.x, iterate.y, iterate.theta), step)
        net = frame_net(problem, v_next, iterate.rounding_next, *xi_next, mass)
        iterate, accepted, finished = newton_step(
            iterate, net, slowest2(v_next), row(problem.frame), descent, limits
        )
        if accepted.all():
            v = v_next
        else:
            v = mapped(functools.partial(np.where, accepted), v_next, v)
        ended = finished & active
        if ended.any():
            out[:, index[ended]] = np.stack(result(take(iterate, ended), limits))
            active &= ~ended
            count = np.count_nonzero(active)
            if count == 0:
                break
            if count < COMPACT_BELOW * active.size and v[0][0].size > COMPACT_ABOVE:
                rest = np.flatnonzero(active)
                problem = problem.take(rest)
                index = index[rest]
                active = active[rest]
                iterate = take(iterate, rest)
                v = take(v, rest)
                mass = take(mass, rest)
                limits = take(limits, rest)
    return out
