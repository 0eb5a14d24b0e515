"""Drag on a straight element: averages over its length, and their slopes (paper Eqs.
2-3).

An element slides along itself with speed v_t and across itself with u(s) = v_n + s v_w,
s from -1 at its tail's end to 1 at its head's, so that v_w is its rotation rate times
its half length. The drag per unit length, positive where it opposes a positive
velocity, is averaged over s:

    t = <f_t>,    n = <f_n>,    w = <s f_n>.

A dry term is f_t = k_t v_t / R, f_n = k_n u / R with R = sqrt(A^2 + u^2), A^2 = q^2
v_t^2 + rounding^2. Eqs. 2-3 are two dry terms (`rft.laws.granular`). The values R1, R2
at the ends and S = R1 + R2 give the elliptic coordinates mu = 2 v_n / S, t = 2 v_w / S,
in which A^2 = S^2 (1 - mu^2) (1 - t^2) / 4, and every average is elementary in mu, t
and k(t) = (atanh t - t) / t^3:

    <1/R> = (2 / S) (1 + t^2 k)    <u/R> = mu    <s u/R> = (1 - mu^2) t h / 2

with h = 1 - (1 - t^2) k.

All functions here are formulas (`rft.formulas.vectors`): they take numbers, arrays that
broadcast, and the vectors of compiled code."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rft.formulas.vectors import (
    absolute,
    anywhere,
    copysign,
    exp,
    formula,
    log_ratio,
    maximum,
    minimum,
    polynomial,
    sqrt,
    where,
)

# added to divisors, for an element at rest without rounding; far below any speed that
# can matter
TINY = 1e-300
# t^2 below which k is a polynomial; above it atanh t - t loses at most one digit
SERIES_BELOW = 1.0 / 9.0


def _series(count: int = 12) -> tuple[float, ...]:
    """Return the coefficients of k = sum_j t^2j / (2j + 3) in powers of t^2 below
    SERIES_BELOW, to 1e-17, at Chebyshev's points."""

    def k(t2):
        return sum(t2**j / (2 * j + 3) for j in range(40))

    series = np.polynomial.Chebyshev.interpolate(
        k, count - 1, domain=[0.0, SERIES_BELOW]
    )
    return tuple(map(float, series.convert(kind=np.polynomial.Polynomial).coef))


SERIES = _series()


class Load(NamedTuple):
    """Averages of the drag on an element, t = <f_t>, n = <f_n>, w = <s f_n>, each
    followed by its slopes in v_t, v_n and v_w."""

    t: float
    t_t: float
    t_n: float
    t_w: float
    n: float
    n_t: float
    n_n: float
    n_w: float
    w: float
    w_t: float
    w_n: float
    w_w: float


@formula
def sum_loads(x, y):
    """Return the sum of two loads."""
    return Load(
        x.t + y.t, x.t_t + y.t_t, x.t_n + y.t_n, x.t_w + y.t_w,
        x.n + y.n, x.n_t + y.n_t, x.n_n + y.n_n, x.n_w + y.n_w,
        x.w + y.w, x.w_t + y.w_t, x.w_n + y.w_n, x.w_w + y.w_w,
    )  # fmt: skip


# Viscous and dry terms.


@formula
def viscous(v_t, v_n, v_w, c_t, c_n):
    """Return the load of f_t = c_t v_t, f_n = c_n u."""
    zero = 0.0 * v_t
    return Load(
        c_t * v_t, zero + c_t, zero, zero,
        c_n * v_n, zero, zero + c_n, zero,
        c_n / 3.0 * v_w, zero, zero, zero + c_n / 3.0,
    )  # fmt: skip


class EndCoordinates(NamedTuple):
    """Elliptic coordinates of an element: 2 / S, mu, t, 1 - mu^2 and 1 - t^2."""

    two_over_S: float
    mu: float
    t: float
    one_minus_mu2: float
    one_minus_t2: float


@formula
def end_coordinates(v_t, v_n, v_w, rounding, q):
    """Return the elliptic coordinates of an element, with 1 - mu^2 and 1 - t^2 to full
    precision."""
    A2 = q * q * v_t * v_t + rounding * rounding
    # Negative where the pivot lies in the element.
    margin = absolute(v_n) - absolute(v_w)
    u_near, u_far = absolute(margin), absolute(v_n) + absolute(v_w)
    R_near, R_far = sqrt(A2 + u_near * u_near), sqrt(A2 + u_far * u_far)
    two_over_S = 2.0 / (R_near + R_far + TINY)
    mu, t = v_n * two_over_S, v_w * two_over_S
    # 2 - 2 max(|mu|, |t|) as a sum of positive terms: a difference would have no digits
    # left near 1.
    near, far = (R_near + u_near) * two_over_S, (R_far + u_far) * two_over_S
    excess = A2 * two_over_S * two_over_S * (near + far) / (near * far)
    one_minus_mu2 = (
        0.5 * (excess + (u_near - margin) * two_over_S) * (1.0 + absolute(mu))
    )
    one_minus_t2 = 0.5 * (excess + (u_near + margin) * two_over_S) * (1.0 + absolute(t))
    return EndCoordinates(two_over_S, mu, t, one_minus_mu2, one_minus_t2)


@formula
def k_function(t, one_minus_t2):
    """Return k = (atanh t - t) / t^3, which is even in t; 1 - t^2 is an argument, for a
    difference would lose digits near t = 1."""
    z = t * t
    far = maximum(z, SERIES_BELOW)
    t = sqrt(far)
    atanh = 0.5 * log_ratio((1.0 + t) * (1.0 + t), maximum(one_minus_t2, TINY))
    return where(
        z < SERIES_BELOW,
        polynomial(minimum(z, SERIES_BELOW), SERIES),
        (atanh - t) / (t * far),
    )


@formula
def dry(v_t, v_n, v_w, rounding, q, k_t, k_n):
    """Return the load of f_t = k_t v_t / R, f_n = k_n u / R."""
    two_over_S, mu, t, one_minus_mu2, one_minus_t2 = end_coordinates(
        v_t, v_n, v_w, rounding, q
    )
    k = k_function(t, one_minus_t2)
    h = 1.0 - one_minus_t2 * k
    denominator = one_minus_mu2 + mu * mu * one_minus_t2
    inverse = 1.0 / (denominator * one_minus_t2 + TINY)
    p = one_minus_t2 * inverse  # 1 / (1 - mu^2 t^2) = S^2 / (4 R1 R2)
    four_over_S2 = two_over_S * two_over_S
    ratio = four_over_S2 * denominator * inverse  # (2 / S)^2 / (1 - t^2)
    mean_1_R = two_over_S * (1.0 + t * t * k)
    mean_u_R3 = four_over_S2 * mu * p
    mean_su_R3 = ratio * t * (one_minus_mu2 * p - h)
    mean_1_R3 = ratio * two_over_S * p
    q2v = q * q * v_t
    normal = k_n * two_over_S * one_minus_mu2 * p
    cross = -normal * mu * t
    return Load(
        k_t * v_t * mean_1_R, k_t * (mean_1_R - v_t * q2v * mean_1_R3),
        -k_t * v_t * mean_u_R3, -k_t * v_t * mean_su_R3,
        k_n * mu, -k_n * q2v * mean_u_R3, normal, cross,
        0.5 * k_n * one_minus_mu2 * t * h, -k_n * q2v * mean_su_R3, cross,
        k_n * two_over_S * one_minus_mu2 * (p - h),
    )  # fmt: skip


@formula
def dry_point(v_t, v_n, rounding, terms):
    """Return the load of dry terms (q, k_t, k_n), the rows of ``terms``, on a point
    that faces along the element.

    The end of a body pushes grains along the body as its side pushes them across, so
    that v_t and v_n are exchanged: f_t = k_n v_t / R and f_n = k_t v_n / R with R^2 =
    q^2 v_n^2 + v_t^2 + rounding^2.
    """
    zero = 0.0 * v_t
    load = Load(zero, zero, zero, zero, zero, zero, zero, zero, zero, zero, zero, zero)
    for j in range(len(terms)):
        q, k_t, k_n = terms[j, 0], terms[j, 1], terms[j, 2]
        R2 = q * v_n * (q * v_n) + v_t * v_t + rounding * rounding
        inverse = where(R2 > 0.0, 1.0, 0.0) / sqrt(where(R2 > 0.0, R2, 1.0))
        e_n, e_t, e = v_n * inverse, v_t * inverse, rounding * inverse
        mixed = e_n * e_t * inverse
        load = sum_loads(load, Load(
            k_n * e_t, k_n * (q * e_n * (q * e_n) + e * e) * inverse,
            -k_n * q * q * mixed, zero,
            k_t * e_n, -k_t * mixed, k_t * (e_t * e_t + e * e) * inverse, zero,
            zero, zero, zero, zero,
        ))  # fmt: skip
    return load


# Additions to the law, and factors of its drag.


class Additions(NamedTuple):
    """Additions to the law that apply to a problem; the others are not computed.

    factor: `Factor`. quadratic: drag with the square of the speed. memory: `Memory`.
    incline: `Incline`. momentum: the rate of change of momentum, which is added to the
    sum over all elements."""

    factor: bool
    quadratic: bool
    memory: bool
    incline: bool
    momentum: bool


@formula
def find_pivot(v_n, v_w):
    """Return the pivot s of an element, where u(s) = 0, or -1 without a pivot; whether
    there is one; and a number with the sign of u on the head's side of it."""
    inside = absolute(v_w) > absolute(v_n)
    return (
        where(inside, -v_n / where(inside, v_w, 1.0), -1.0),
        inside,
        where(inside, v_w, v_n),
    )


@formula
def quadratic_load(v_n, v_w, strength):
    """Return the exact load of f_n = strength |u| u, the flux of momentum into grains
    that are pushed away."""
    pivot, _, u_head = find_pivot(v_n, v_w)
    sign = where(u_head == 0.0, 0.0, copysign(strength, u_head))
    p2 = pivot * pivot
    s0, s1 = -sign * pivot, sign * (1.0 - p2) / 2.0  # averages of sign(u) s^k
    s2, s3 = -sign * p2 * pivot / 3.0, sign * (1.0 - p2 * p2) / 4.0
    zero, cross = 0.0 * v_n, 2.0 * (v_n * s1 + v_w * s2)
    return Load(
        zero, zero, zero, zero,
        v_n * v_n * s0 + 2.0 * v_n * v_w * s1 + v_w * v_w * s2, zero,
        2.0 * (v_n * s0 + v_w * s1), cross,
        v_n * v_n * s1 + 2.0 * v_n * v_w * s2 + v_w * v_w * s3, zero, cross,
        2.0 * (v_n * s2 + v_w * s3),
    )  # fmt: skip


class Factor(NamedTuple):
    """Factors of the drag on an element: of f_t where it slides forward and backward,
    and of f_n."""

    forward: float
    backward: float
    across: float


@formula
def scaled_load(load, v_t, factor):
    """Return a load with its averages along and across multiplied by the factors of the
    drag."""
    along, across = where(v_t >= 0.0, factor.forward, factor.backward), factor.across
    return Load(
        along * load.t, along * load.t_t, along * load.t_n, along * load.t_w,
        across * load.n, across * load.n_t, across * load.n_n, across * load.n_w,
        across * load.w, across * load.w_t, across * load.w_n, across * load.w_w,
    )  # fmt: skip


class Incline(NamedTuple):
    """Sloping ground under an element.

    down_t, down_n: unit vector downhill, along and across the element. level_factor:
    factor of the drag on motion that is not downhill. downhill_loss: decrease of that
    factor straight downhill. weight: force of gravity downhill per unit length of the
    body."""

    down_t: float
    down_n: float
    level_factor: float
    downhill_loss: float
    weight: float


@formula
def inclined_load(load, v, rounding, incline):
    """Return a load on a slope: the drag times level_factor - downhill_loss max(v .
    down, 0) / |v|, with v the velocity of the element's centre, less the body's weight
    along the slope."""
    down_t, down_n, level_factor, downhill_loss, weight = incline
    inverse = 1.0 / sqrt(v[0] * v[0] + v[1] * v[1] + rounding * rounding + TINY)
    down = down_t * v[0] + down_n * v[1]
    loss = where(down > 0.0, downhill_loss, 0.0) * inverse
    # With wide rounding drag is viscous and weak, and the full weight would move the
    # body at enormous speeds.
    weight = weight / sqrt(1.0 + rounding * rounding)
    factor = level_factor - loss * down
    # Slopes of the factor, with the cosine over the speed.
    cosine = down * inverse * inverse
    slope_t = loss * (cosine * v[0] - down_t)
    slope_n = loss * (cosine * v[1] - down_n)
    return Load(
        factor * load.t - weight * down_t, factor * load.t_t + slope_t * load.t,
        factor * load.t_n + slope_n * load.t,
        factor * load.t_w,
        factor * load.n - weight * down_n, factor * load.n_t + slope_t * load.n,
        factor * load.n_n + slope_n * load.n,
        factor * load.n_w,
        factor * load.w, factor * load.w_t + slope_t * load.w,
        factor * load.w_n + slope_n * load.w, factor * load.w_w,
    )  # fmt: skip


# Memory of the ground: shares of the drag by the directions in which an element has
# moved.


class Memory(NamedTuple):
    """State of the ground at an element.

    along, across: mean directions of its travel so far, -1 to 1. v_t_before,
    v_n_before: its velocity one step earlier. intact_left, intact_right: shares, 0 to
    1, of the drag across in ground that earlier passes have disturbed. at_once_along,
    at_once_across: shares of the drag that are there at once after a reversal.
    step_along, step_across: e-foldings of a mean direction over the step at unit speed,
    inf where the drag is steady at once."""

    along: float
    across: float
    v_t_before: float
    v_n_before: float
    intact_left: float
    intact_right: float
    at_once_along: float
    at_once_across: float
    step_along: float
    step_across: float


@formula
def developed_direction(direction, before, now, step):
    """Return the mean direction of travel after a step, and its slope in ``now``.

    The velocity changes linearly from ``before`` to ``now`` >= 0, and the direction
    decays towards -1 while it is negative, towards 1 while it is positive, exp(-step)
    at unit speed. With an infinite ``step`` it is 1."""
    instant, forward = step == np.inf, before >= 0.0
    total = absolute(before) + now
    total = where(total == 0.0, 1.0, total)
    old, new = absolute(before) / total, now / total
    # Travels backward and forward, over total x the duration of the step / 2.
    backward_travel = where(forward, 0.0, old * old)
    forward_travel = where(forward, old + new, new * new)
    forward_slope = where(forward, 1.0, new * new + 2.0 * old * new)
    half_step = where(instant, 0.0, step) / 2.0
    turned = (1.0 + direction) * exp(-half_step * total * backward_travel)
    rest = where(instant, 0.0, exp(-half_step * total * forward_travel))
    slope = (
        rest * half_step * (forward_slope * (2.0 - turned) + backward_travel * turned)
    )
    return 1.0 - (2.0 - turned) * rest, slope


@formula
def developed_share(direction, before, now, at_once, step):
    """Return the share of the drag on motion with the velocity ``now`` >= 0 after the
    step of `developed_direction`, and its slope in ``now``."""
    after, slope = developed_direction(direction, before, now, step)
    share = at_once + (1.0 - at_once) * (0.5 + 0.5 * after)
    return share, (1.0 - at_once) * (0.5 * slope)


@formula
def part_speed(sign, v_n, v_w, inside):
    """Return the mean speed across of the part of an element that moves left (sign 1)
    or right (sign -1), 0 where there is none; inside: as in `find_pivot`."""
    return where(inside, 0.5 * (sign * v_n + absolute(v_w)), maximum(sign * v_n, 0.0))


@formula
def directions_after(
    along, across, v_t_before, v_n_before, step_along, step_across, v_t, v_n, v_w
):
    """Return the mean directions of an element's travel, along and across, after a step
    that ends with velocities (v_t, v_n, v_w).

    Other arguments as in `Memory`. The direction across is the mean of those of the
    parts that move left and right."""
    sign = where(v_t >= 0.0, 1.0, -1.0)
    forward, _ = developed_direction(
        sign * along, sign * v_t_before, absolute(v_t), step_along
    )
    _, inside, _ = find_pivot(v_n, v_w)
    left, _ = developed_direction(
        across, v_n_before, part_speed(1.0, v_n, v_w, inside), step_across
    )
    right, _ = developed_direction(
        -across, -v_n_before, part_speed(-1.0, v_n, v_w, inside), step_across
    )
    # The left part's fraction of the length.
    fraction = where(
        inside,
        0.5 * (1.0 + v_n / where(inside, absolute(v_w), 1.0)),
        where(v_n > 0.0, 1.0, 0.0),
    )
    return sign * forward, fraction * left - (1.0 - fraction) * right


@formula
def share_across(sign, intact, v_n, v_w, inside, memory):
    """Return the share of the drag across on the part of an element that moves left
    (sign 1) or right (sign -1), and its slopes in v_n and v_w; inside: as in
    `find_pivot`."""
    now = part_speed(sign, v_n, v_w, inside)
    direction = sign * memory.across
    before = sign * memory.v_n_before
    value, slope = developed_share(
        direction, before, now, memory.at_once_across, memory.step_across
    )
    slope = intact * slope
    return (
        intact * value,
        where(inside, 0.5, 1.0) * sign * slope,
        where(inside, copysign(0.5, v_w), 0.0) * slope,
    )


@formula
def with_share_along(load, v_t, memory):
    """Return a load with the share of the drag along that the ground has developed."""
    sign = where(v_t >= 0.0, 1.0, -1.0)
    direction, before = sign * memory.along, sign * memory.v_t_before
    value, slope = developed_share(
        direction, before, absolute(v_t), memory.at_once_along, memory.step_along
    )
    return Load(
        value * load.t, value * load.t_t + sign * slope * load.t, value * load.t_n,
        value * load.t_w,
        load.n, load.n_t, load.n_n, load.n_w, load.w, load.w_t, load.w_n, load.w_w,
    )  # fmt: skip


@formula
def part_load(law, v_t, v_n, v_w, rounding, low, high, share):
    """Return the load of the part of an element from s = low to high, with a share of
    the drag across, given as (value, slope in v_n, slope in v_w)."""
    value, by_n, by_w = share
    c, h = 0.5 * (high + low), 0.5 * (high - low)  # centre and half length of the part
    f = law.average(v_t, v_n + v_w * c, h * v_w, rounding)
    w = c * f.n + h * f.w
    w_t = c * f.n_t + h * f.w_t
    w_n = c * f.n_n + h * f.w_n
    w_w = c * f.n_w + h * f.w_w
    return Load(
        h * f.t, h * f.t_t, h * f.t_n, h * (c * f.t_n + h * f.t_w),
        h * value * f.n, h * value * f.n_t, h * (value * f.n_n + by_n * f.n),
        h * (value * (c * f.n_n + h * f.n_w) + by_w * f.n),
        h * value * w, h * value * w_t, h * (value * w_n + by_n * w),
        h * (value * (c * w_n + h * w_w) + by_w * w),
    )  # fmt: skip


@formula
def two_sided_load(law, v_t, v_n, v_w, rounding, memory):
    """Return the load of a law with shares of the drag along and, for each side of an
    element, across, split at its pivot.

    The drag across vanishes at the pivot, so that its motion does not contribute to the
    slopes."""
    pivot, inside, u_head = find_pivot(v_n, v_w)
    leftward = u_head > 0.0
    left, right = memory.intact_left, memory.intact_right
    sign = where(leftward, 1.0, -1.0)
    share = share_across(sign, where(leftward, left, right), v_n, v_w, inside, memory)
    load = part_load(law, v_t, v_n, v_w, rounding, pivot, 1.0, share)
    if anywhere(inside):  # else nothing lies on the tail's side
        intact = where(leftward, right, left)
        share = share_across(-sign, intact, v_n, v_w, inside, memory)
        tail = part_load(law, v_t, v_n, v_w, rounding, -1.0, pivot, share)
        load = sum_loads(load, tail)
    return with_share_along(load, v_t, memory)


@formula
def side_load(law, v, rounding, factor, incline, strength, memory, additions):
    """Return the load on an element of the body's sides at v = (v_t, v_n, v_w).

    strength: of the drag with the square of the speed. additions: `Additions`, those of
    the arguments that apply."""
    v_t, v_n, v_w = v
    if additions.memory:
        load = two_sided_load(law, v_t, v_n, v_w, rounding, memory)
    else:
        load = law.average(v_t, v_n, v_w, rounding)
    if additions.factor:
        load = scaled_load(load, v_t, factor)
    if additions.incline:
        load = inclined_load(load, v, rounding, incline)
    if additions.quadratic:
        load = sum_loads(load, quadratic_load(v_n, v_w, strength))
    return load


@formula
def point_load(terms, v, rounding, factor, incline, additions):
    """Return the load on a point attached to the body, of dry terms (q, k_t, k_n) that
    face along the body."""
    load = scaled_load(dry_point(v[0], v[1], rounding, terms), v[0], factor)
    return inclined_load(load, v, rounding, incline) if additions.incline else load
