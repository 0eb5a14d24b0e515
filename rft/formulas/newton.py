"""One step of Newton's method on a balance of forces, for numbers, arrays or the
vectors of compiled code.

The dry friction of a medium is first rounded off widely (``rounding``, a speed), where
the problem is easy, then less and less, level by level, down to the required rounding;
the tangent dx / d(rounding) predicts the solution on the next level. On a level the
steps are Newton's, halved while the residual does not fall. Element velocities are
stored beside xi and updated by small steps, so that an element at rest keeps all its
digits. Steps are accepted, and ended, by measures that are the same in every frame of
the body. All velocities here are over a scale of each sample, so that they are of size
1.

In the formulas ``e`` are straight elements, `rft.bodies.base.Elements`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rft.formulas.vectors import absolute, formula, maximum, minimum, sqrt, where

VISCOUS = 1e8  # rounding at which every law is viscous to the last digit
# velocity, larger than any solution: squares of larger ones overflow, and drag becomes
# 0
FASTEST = 1e30

# Rows of the result of a driver: the velocity (x, y, theta), the residual, the number
# of evaluations, and the speed of the slowest element.
RESIDUAL = 3
EVALUATIONS = 4
SLOWEST = 5
RESULT_ROWS = 6
SLIDING, STUCK, UNCONVERGED = range(3)  # status of a sample


class Frame(NamedTuple):
    """Mean and scales of a sample. x, y: mean of the body's centres of mass in the
    frame. force_scale: unit of residuals. speed_scale: unit of velocities."""

    x: float
    y: float
    force_scale: float
    speed_scale: float


class Inertia(NamedTuple):
    """Rate of change of momentum on the frame, strength (M xi + offset): M by rows,
    then the offset (x, y, theta)."""

    xx: float
    xy: float
    xt: float
    yx: float
    yy: float
    yt: float
    tx: float
    ty: float
    tt: float
    offset_x: float
    offset_y: float
    offset_t: float
    strength: float


class Net(NamedTuple):
    """Force and moment on the frame, as triples (x, y, theta).

    by_x, by_y, by_theta: slopes in the frame's velocity. by_speed: slope in the
    logarithm of all velocities together, the sum of J^T H v; in a law of degree 0 it is
    minus the slope in the logarithm of the rounding."""

    force: tuple
    by_x: tuple
    by_y: tuple
    by_theta: tuple
    by_speed: tuple


class Descent(NamedTuple):
    """A sequence of levels of rounding.

    first: rounding of the first level, over the scale of speed. ratio: of the rounding
    from one level to the next. level_residual: residual that ends a level. free_ratio:
    speed over rounding above which rounding no longer matters to an element. budget:
    most evaluations."""

    first: float
    ratio: float
    level_residual: float
    free_ratio: float
    budget: float


class Limits(NamedTuple):
    """Required accuracy, and limits of the steps.

    rounding: of the last level. residual: largest of a solution, (B,) in a batch of
    media. largest_step: change of the velocity of the body's mean place and of its
    rotation rate; no body moves that fast. least_damping: damping at which a step is
    accepted though the residual grows. damping_growth: factor of the damping after an
    accepted step."""

    rounding: float
    residual: float | np.ndarray
    largest_step: float = 3.0
    least_damping: float = 2.0**-12
    damping_growth: float = 2.0


class Iterate(NamedTuple):
    """State of a sample in a descent.

    x, y, theta: velocity of the frame. dx, dy, dtheta: the next step. rounding,
    rounding_next: of the level before and after it. damping: factor of Newton's step,
    at most 1. residual: after the last accepted step. slowest: speed of the slowest
    element then. evaluations: number of them. fresh: 1 before the first step, else
    0."""

    x: float
    y: float
    theta: float
    dx: float
    dy: float
    dtheta: float
    rounding: float
    rounding_next: float
    damping: float
    residual: float
    slowest: float
    evaluations: float
    fresh: float


class Progress(NamedTuple):
    """Scalars of a descent, whatever its unknowns; fields as in `Iterate`."""

    rounding: float
    rounding_next: float
    damping: float
    residual: float
    slowest: float
    evaluations: float
    fresh: float


# Triples (x, y, theta) and (v_t, v_n, v_w).


@formula
def plus(a, b):
    """Return a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@formula
def times(k, a):
    """Return k a."""
    return k * a[0], k * a[1], k * a[2]


@formula
def cross(a, b):
    """Return the cross product."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


@formula
def dot(a, b):
    """Return the scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@formula
def solve3(a, b, c, right):
    """Return the solution of (a b c) x = right, a, b, c columns, by Cramer's rule; 0
    where the matrix is singular."""
    bc = cross(b, c)
    det = dot(a, bc)
    inverse = where(det == 0.0, 0.0, 1.0) / where(det == 0.0, 1.0, det)
    return (
        dot(right, bc) * inverse,
        dot(right, cross(c, a)) * inverse,
        dot(right, cross(a, b)) * inverse,
    )


# Between elements and the frame.


@formula
def to_element(e, x, y, theta):
    """Return the contribution J xi of the frame's velocity xi = (x, y, theta) to an
    element's velocity (v_t, v_n, v_w)."""
    return (
        e.c * x + e.s * y + e.r_t * theta,
        e.c * y - e.s * x + e.r_n * theta,
        e.half * theta,
    )


@formula
def to_frame(e, t, n, w):
    """Return force and moment on the frame, J^T f, from averages f = (t, n, w) on an
    element."""
    return e.c * t - e.s * n, e.s * t + e.c * n, e.r_t * t + e.r_n * n + e.half * w


@formula
def element_net(e, f, v, speed):
    """Return the `Net` of an element with load f at velocities v: J^T f, J^T H J and
    J^T H v, with H the slopes of f.

    speed: scale of the velocities that the load is computed at."""
    t = to_frame(e, f.t_t, f.t_n, f.t_w)
    n = to_frame(e, f.n_t, f.n_n, f.n_w)
    w = to_frame(e, f.w_t, f.w_n, f.w_w)
    by_speed = to_frame(
        e,
        f.t_t * v[0] + f.t_n * v[1] + f.t_w * v[2],
        f.n_t * v[0] + f.n_n * v[1] + f.n_w * v[2],
        f.w_t * v[0] + f.w_n * v[1] + f.w_w * v[2],
    )
    slope = speed * e.weight
    return Net(
        times(e.weight, to_frame(e, f.t, f.n, f.w)),
        times(slope, to_frame(e, t[0], n[0], w[0])),
        times(slope, to_frame(e, t[1], n[1], w[1])),
        times(slope, to_frame(e, t[2], n[2], w[2])),
        times(slope, by_speed),
    )


@formula
def with_momentum(net, x, y, theta, inertia, speed):
    """Return a net with the rate of change of momentum at a velocity (x, y, theta) of
    the frame."""
    m = inertia
    slope = inertia.strength * speed
    by_x = (m.xx, m.yx, m.tx)
    by_y = (m.xy, m.yy, m.ty)
    by_theta = (m.xt, m.yt, m.tt)
    M_xi = plus(plus(times(x, by_x), times(y, by_y)), times(theta, by_theta))
    return Net(
        plus(
            net.force,
            plus(
                times(slope, M_xi),
                times(m.strength, (m.offset_x, m.offset_y, m.offset_t)),
            ),
        ),
        plus(net.by_x, times(slope, by_x)),
        plus(net.by_y, times(slope, by_y)),
        plus(net.by_theta, times(slope, by_theta)),
        net.by_speed,
    )


@formula
def residual_norm(force, frame):
    """Return the larger of force and moment about the body's mean place, over the scale
    of force."""
    f_x, f_y, moment = force
    moment = moment - frame.x * f_y + frame.y * f_x
    return maximum(sqrt(f_x * f_x + f_y * f_y), absolute(moment)) / frame.force_scale


# The step.


class Judgement(NamedTuple):
    """What follows from the residual after a step.

    fresh: whether it was the step to the viscous solution, before any other. accepted:
    whether the step is taken. ends_level: whether its level of rounding is solved.
    lower: rounding of the next level. prediction: change of the logarithm of all
    velocities, along the tangent, that leads to it. damping: factor of Newton's next
    step."""

    fresh: bool
    accepted: bool
    ends_level: bool
    lower: float
    prediction: float
    damping: float


@formula
def judge_step(iterate, residual, slowest, descent, limits):
    """Return the `Judgement` of the step that led to a residual, with the slowest
    element's speed after it, for a balance of any number of unknowns."""
    last = limits.rounding
    fresh = iterate.fresh > 0.0
    rounding = iterate.rounding_next
    helps = (
        (rounding < iterate.rounding)
        | (residual < iterate.residual)
        | (iterate.damping <= limits.least_damping)
    )
    accepted = where(fresh, 0.0, where(helps, 1.0, 0.0)) > 0.0
    # Where every element moves much faster than the rounding, its kinks no longer
    # matter and the next level is the last. The velocity of an element at rest is
    # linear in the rounding, that of a sliding element quadratic.
    ends_level = accepted & (rounding > last) & (residual < descent.level_residual)
    free = slowest > descent.free_ratio * rounding
    lower = where(free, last, maximum(descent.ratio * rounding, last))
    ratio = lower / rounding
    prediction = where(
        ends_level, where(free, 0.5 * (ratio * ratio - 1.0), ratio - 1.0), 0.0
    )
    damping = where(
        fresh, iterate.damping, minimum(1.0, limits.damping_growth * iterate.damping)
    )
    return Judgement(fresh, accepted, ends_level, lower, prediction, damping)


@formula
def progress_after(iterate, residual, slowest, judged, descent):
    """Return the `Progress` after a step that led to a residual, with its
    `Judgement`."""
    fresh = judged.fresh
    accepted = judged.accepted
    rounding = iterate.rounding_next
    evaluations = iterate.evaluations + where(fresh, 0.0, 1.0)
    return Progress(
        where(fresh, descent.first, rounding),
        where(fresh, descent.first, where(judged.ends_level, judged.lower, rounding)),
        where(accepted | fresh, judged.damping, 0.5 * iterate.damping),
        where(accepted, residual, iterate.residual),
        where(accepted, slowest, iterate.slowest),
        evaluations,
        0.0 * evaluations,
    )


@formula
def newton_step(iterate, net, slowest2, frame, descent, limits):
    """Return the next iterate, whether the step that led to ``net`` is accepted, and
    whether the sample has ended.

    slowest2: square of the slowest element's speed after that step.
    """
    residual = residual_norm(net.force, frame)
    slowest = sqrt(slowest2)
    judged = judge_step(iterate, residual, slowest, descent, limits)
    after = progress_after(iterate, residual, slowest, judged, descent)
    fresh = judged.fresh
    accepted = judged.accepted
    by_speed = times(judged.prediction, net.by_speed)
    right = plus(by_speed, times(-judged.damping, net.force))
    x, y, theta = solve3(net.by_x, net.by_y, net.by_theta, right)
    fraction = where(fresh, 1.0, step_fraction(x, y, theta, frame, limits.largest_step))
    new_step = accepted | fresh
    moved = where(accepted, 1.0, 0.0)
    is_last = iterate.rounding_next <= limits.rounding
    solved = accepted & is_last & (residual <= limits.residual)
    new = Iterate(
        iterate.x + moved * iterate.dx,
        iterate.y + moved * iterate.dy,
        iterate.theta + moved * iterate.dtheta,
        where(new_step, fraction * x, 0.5 * iterate.dx),
        where(new_step, fraction * y, 0.5 * iterate.dy),
        where(new_step, fraction * theta, 0.5 * iterate.dtheta),
        after.rounding,
        after.rounding_next,
        after.damping,
        after.residual,
        after.slowest,
        after.evaluations,
        after.fresh,
    )
    return new, accepted, solved | (after.evaluations >= descent.budget)


@formula
def result(iterate, limits):
    """Return the rows of a sample's result; the residual is infinite unless the
    rounding is the required one and the velocity is possible."""
    valid = (iterate.rounding <= limits.rounding) & is_possible(
        iterate.x, iterate.y, iterate.theta
    )
    residual = where(valid, iterate.residual, np.inf)
    return (
        iterate.x,
        iterate.y,
        iterate.theta,
        residual,
        iterate.evaluations,
        iterate.slowest,
    )


@formula
def is_possible(x, y, theta):
    """Return whether a velocity is finite and below FASTEST."""
    return (
        (absolute(x) < FASTEST) & (absolute(y) < FASTEST) & (absolute(theta) < FASTEST)
    )


@formula
def step_fraction(x, y, theta, frame, largest):
    """Return the fraction of a step that changes the velocity of the body's mean place,
    and its rotation rate, by no more than ``largest``."""
    mean_x = x - frame.y * theta
    mean_y = y + frame.x * theta
    size = sqrt(mean_x * mean_x + mean_y * mean_y + theta * theta)
    may_exceed = maximum(maximum(absolute(x), absolute(y)), absolute(theta)) > 1.0
    return where(may_exceed, largest / maximum(size, largest), 1.0)


@formula
def compliant_fraction(x, y, theta, rates2, frame, largest):
    """Return the fraction of a step as `step_fraction` does where joint rates are
    unknown as well; rates2: sum of the squares of their changes."""
    mean_x = x - frame.y * theta
    mean_y = y + frame.x * theta
    size = sqrt(mean_x * mean_x + mean_y * mean_y + theta * theta + rates2)
    return largest / maximum(size, largest)


@formula
def first_iterate(dx, dy, dtheta, first, fresh):
    """Return a sample at rest whose first step is (dx, dy, dtheta), or, if fresh is 1,
    the step to the viscous solution."""
    zero = 0.0 * fresh  # not of dx, which may be nan
    return Iterate(
        zero, zero, zero,
        dx, dy, dtheta,
        zero + first, zero + where(fresh > 0.0, VISCOUS, first), zero + 1.0,
        zero + np.inf, zero, zero, zero + fresh,
    )  # fmt: skip
