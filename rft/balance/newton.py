"""One step of Newton's method on a balance of forces, for numbers, arrays or the vectors of compiled code.

A dry medium is first taken with its kinks rounded off widely (``rounding``, a speed), where the problem is easy, then
with less and less rounding down to the wanted one; the tangent dx / d(rounding) carries the solution from one level to
the next. On a level the steps are Newton's, halved while the residual does not fall. Element velocities are carried
beside xi and updated by small steps, so that an element at rest keeps all its digits. What decides about a step, or an
end, is the same in every frame of the body. Velocities here are over a scale of each sample, so that they are of size
1."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rft.vectors import absolute, formula, maximum, minimum, sqrt, where

VISCOUS = 1e8  # rounding at which every law is a viscous one to the last digit


class Elements(NamedTuple):
    """Straight elements in the body frame, lengths in body lengths.

    c, s: cosine and sine of the heading. r_t, r_n: velocity of the centre along and across the element at a unit
    turning rate of the frame. half: half length, 0 for a point. weight: factor of the drag per length, which is the
    length of a piece of body. v_t, v_n, v_w: velocity with the frame held, along and across at the centre, and turning
    rate times half length."""

    c: float
    s: float
    r_t: float
    r_n: float
    half: float
    weight: float
    v_t: float
    v_n: float
    v_w: float


class Frame(NamedTuple):
    """Measures of a sample. x, y: the body's mean place. force: unit of force. speed: the scale of velocities."""

    x: float
    y: float
    force: float
    speed: float


class Inertia(NamedTuple):
    """Rate of change of momentum, strength (M xi + held), on the frame: M by rows, held (x, y, theta)."""

    xx: float
    xy: float
    xt: float
    yx: float
    yy: float
    yt: float
    tx: float
    ty: float
    tt: float
    held_x: float
    held_y: float
    held_t: float
    strength: float


class Net(NamedTuple):
    """Force and moment on the frame, their slopes in x, y and theta, and the sum of J^T H v, which follows the
    rounding."""

    force: tuple
    by_x: tuple
    by_y: tuple
    by_theta: tuple
    drift: tuple


class Descent(NamedTuple):
    """Levels of rounding of one attempt.

    first: rounding of the first level, body lengths per radian. ratio: of the rounding from one level to the next.
    loose: residual at which a level is left. free: speed over rounding beyond which an element does not feel it.
    budget: evaluations."""

    first: float
    ratio: float
    loose: float
    free: float
    budget: float


class Limits(NamedTuple):
    """Goals and guards. last: the wanted rounding. residual: the wanted residual.

    largest: step of the body's mean place and heading, per radian; no body moves that fast. shortest: damping that is
    taken whether it helps or not. lengthen: factor of the damping after a success."""

    last: float
    residual: float
    largest: float = 3.0
    shortest: float = 2.0**-12
    lengthen: float = 2.0


class Iterate(NamedTuple):
    """A sample under way: velocity of the frame, the step to try, the roundings of both, damping of the step, residual,
    speed of the slowest element, evaluations, and 1 before the first step."""

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
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@formula
def dot(a, b):
    """Return the scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@formula
def solve3(a, b, c, right):
    """Return the solution of (a b c) x = right, a, b, c columns, by Cramer's rule; 0 where the matrix is singular."""
    bc = cross(b, c)
    det = dot(a, bc)
    inverse = where(det == 0.0, 0.0, 1.0) / where(det == 0.0, 1.0, det)
    return dot(right, bc) * inverse, dot(right, cross(c, a)) * inverse, dot(right, cross(a, b)) * inverse


# From elements to the frame.


@formula
def carried(e, x, y, theta):
    """Return what a velocity of the frame adds to an element's (v_t, v_n, v_w): J xi."""
    return e.c * x + e.s * y + e.r_t * theta, e.c * y - e.s * x + e.r_n * theta, e.half * theta


@formula
def to_frame(e, t, n, w):
    """Return force and moment on the frame of averages on an element: J^T f."""
    return e.c * t - e.s * n, e.s * t + e.c * n, e.r_t * t + e.r_n * n + e.half * w


@formula
def on_frame(e, f, v, speed):
    """Return what an element's load f at velocities v does to the frame: J^T f, J^T H J and J^T H v, H the slopes of
    f."""
    t, n, w = to_frame(e, f.t_t, f.t_n, f.t_w), to_frame(e, f.n_t, f.n_n, f.n_w), to_frame(e, f.w_t, f.w_n, f.w_w)
    drift = to_frame(
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
        times(slope, drift),
    )


@formula
def with_momentum(net, x, y, theta, inertia, speed):
    """Return the balance with the rate of change of momentum at a velocity of the frame."""
    m, slope = inertia, inertia.strength * speed
    by_x, by_y, by_theta = (m.xx, m.yx, m.tx), (m.xy, m.yy, m.ty), (m.xt, m.yt, m.tt)
    moved = plus(plus(times(x, by_x), times(y, by_y)), times(theta, by_theta))
    return Net(
        plus(net.force, plus(times(slope, moved), times(m.strength, (m.held_x, m.held_y, m.held_t)))),
        plus(net.by_x, times(slope, by_x)),
        plus(net.by_y, times(slope, by_y)),
        plus(net.by_theta, times(slope, by_theta)),
        net.drift,
    )


@formula
def residual_of(force, frame):
    """Return the larger of force and moment about the body's mean place, over the unit of force."""
    f_x, f_y, moment = force
    about = moment - frame.x * f_y + frame.y * f_x
    return maximum(sqrt(f_x * f_x + f_y * f_y), absolute(about)) / frame.force


# The step.


@formula
def newton_step(it, net, slowest2, frame, descent, limits):
    """Return the next iterate, whether the step that led to ``net`` is accepted, and whether the sample has ended.

    slowest2: the square of the slowest element's speed after that step.
    """
    last = limits.last
    residual, slowest = residual_of(net.force, frame), sqrt(slowest2)
    fresh = it.fresh > 0.0
    helps = (it.rounding_next < it.rounding) | (residual < it.residual) | (it.damping <= limits.shortest)
    accepted = where(fresh, 0.0, where(helps, 1.0, 0.0)) > 0.0
    # Where every element moves much faster than the rounding its kinks no longer matter: go all the way. An element at rest
    # creeps in proportion to the rounding, one that slides feels its square.
    down = accepted & (it.rounding_next > last) & (residual < descent.loose)
    free = slowest > descent.free * it.rounding_next
    lower = where(free, last, maximum(descent.ratio * it.rounding_next, last))
    change = lower / it.rounding_next
    pull = where(down, where(free, 0.5 * (change * change - 1.0), change - 1.0), 0.0)
    damping = where(fresh, it.damping, minimum(1.0, limits.lengthen * it.damping))
    right = plus(times(pull, net.drift), times(-damping, net.force))
    x, y, theta = solve3(net.by_x, net.by_y, net.by_theta, right)
    cut = where(fresh, 1.0, shortened(x, y, theta, frame, limits.largest))
    go_on, taken = accepted | fresh, where(accepted, 1.0, 0.0)
    evaluations = it.evaluations + where(fresh, 0.0, 1.0)
    done = (accepted & (it.rounding_next <= last) & (residual <= limits.residual)) | (evaluations >= descent.budget)
    after = Iterate(
        it.x + taken * it.dx,
        it.y + taken * it.dy,
        it.theta + taken * it.dtheta,
        where(go_on, cut * x, 0.5 * it.dx),
        where(go_on, cut * y, 0.5 * it.dy),
        where(go_on, cut * theta, 0.5 * it.dtheta),
        where(fresh, descent.first, it.rounding_next),
        where(fresh, descent.first, where(down, lower, it.rounding_next)),
        where(go_on, damping, 0.5 * it.damping),
        where(accepted, residual, it.residual),
        where(accepted, slowest, it.slowest),
        evaluations,
        0.0 * evaluations,
    )
    return after, accepted, done


@formula
def shortened(x, y, theta, frame, largest):
    """Return the part of a step that moves the body's mean place and heading by no more than ``largest``."""
    place_x, place_y = x - frame.y * theta, y + frame.x * theta
    far = sqrt(place_x * place_x + place_y * place_y + theta * theta)
    long = maximum(maximum(absolute(x), absolute(y)), absolute(theta)) > 1.0  # within 1 no place moves too far
    return where(long, largest / maximum(far, largest), 1.0)


@formula
def begun(dx, dy, dtheta, first, fresh):
    """Return a sample at rest, whose first step is a guess, or, if fresh is 1, the one to the viscous solution."""
    zero = 0.0 * fresh  # a guess may be no number
    return Iterate(
        zero, zero, zero,
        dx, dy, dtheta,
        zero + first, zero + where(fresh > 0.0, VISCOUS, first), zero + 1.0, zero + np.inf, zero, zero, zero + fresh,
    )  # fmt: skip
