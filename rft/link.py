"""Drag on a straight element: averages over its length, and their slopes (paper Eqs. 2-3).

An element slides along itself with speed v_t and across itself with u(s) = v_n + s v_w, s in [-1, 1] from its tail's
end to its head's, so that v_w is its turning rate times its half length. The drag per unit length, positive along the
velocity that it opposes, is averaged over s:

    t = <f_t>,    n = <f_n>,    w = <s f_n>.

A dry term is f_t = k_t v_t / R, f_n = k_n u / R with R = sqrt(A^2 + u^2), A^2 = q^2 v_t^2 + rounding^2. In granular
media two of them are Eqs. 2-3. The values R1, R2 at the ends and S = R1 + R2 give the elliptic coordinates mu = 2 v_n /
S, t = 2 v_w / S, in which A^2 = S^2 (1 - mu^2) (1 - t^2) / 4, and every average is elementary in mu, t and k(t) =
(atanh t - t) / t^3:

    <1/R> = (2 / S) (1 + t^2 k)    <u/R> = mu    <s u/R> = (1 - mu^2) t h / 2,    h = 1 - (1 - t^2) k.

All functions here are formulas (`rft.vectors`): they take numbers, arrays that broadcast, and the vectors of compiled
code."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rft.vectors import absolute, copysign, exp, formula, log_ratio, maximum, minimum, polynomial, sqrt, where

TINY = 1e-300  # keeps 0/0 finite where the element is at rest; far below any speed that can matter
SERIES_BELOW = 1.0 / 9.0  # t^2 below which k is a polynomial; above it atanh t - t loses at most one digit


def _series(count: int = 12) -> tuple[float, ...]:
    """Return the coefficients of k = sum_j t^2j / (2j + 3) in powers of t^2 below SERIES_BELOW, to 1e-17, at
    Chebyshev's points."""
    k = lambda z: sum(z**j / (2 * j + 3) for j in range(40))
    series = np.polynomial.Chebyshev.interpolate(k, count - 1, domain=[0.0, SERIES_BELOW])
    return tuple(map(float, series.convert(kind=np.polynomial.Polynomial).coef))


SERIES = _series()


class Load(NamedTuple):
    """Averages of the drag on an element, t along, n across and w across times s, each with its slopes in v_t, v_n and
    v_w."""

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
def added(x, y):
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
    """Return the elliptic coordinates of an element, with 1 - mu^2 and 1 - t^2 to full precision."""
    A2 = q * q * v_t * v_t + rounding * rounding
    margin = absolute(v_n) - absolute(v_w)  # negative where the pivot lies in the element
    u_near, u_far = absolute(margin), absolute(v_n) + absolute(v_w)
    R_near, R_far = sqrt(A2 + u_near * u_near), sqrt(A2 + u_far * u_far)
    two_over_S = 2.0 / (R_near + R_far + TINY)
    mu, t = v_n * two_over_S, v_w * two_over_S
    # 2 - 2 max(|mu|, |t|) as a sum of positive terms: a difference would have no digits left near 1.
    near, far = (R_near + u_near) * two_over_S, (R_far + u_far) * two_over_S
    excess = A2 * two_over_S * two_over_S * (near + far) / (near * far)
    one_minus_mu2 = 0.5 * (excess + (u_near - margin) * two_over_S) * (1.0 + absolute(mu))
    one_minus_t2 = 0.5 * (excess + (u_near + margin) * two_over_S) * (1.0 + absolute(t))
    return EndCoordinates(two_over_S, mu, t, one_minus_mu2, one_minus_t2)


@formula
def k_function(t, one_minus_t2):
    """Return k = (atanh t - t) / t^3, which is even in t; 1 - t^2 is passed for its digits near t = 1."""
    z = t * t
    far = maximum(z, SERIES_BELOW)
    t = sqrt(far)
    atanh = 0.5 * log_ratio((1.0 + t) * (1.0 + t), maximum(one_minus_t2, TINY))
    return where(z < SERIES_BELOW, polynomial(minimum(z, SERIES_BELOW), SERIES), (atanh - t) / (t * far))


@formula
def dry(v_t, v_n, v_w, rounding, q, k_t, k_n):
    """Return the load of f_t = k_t v_t / R, f_n = k_n u / R."""
    two_over_S, mu, t, one_minus_mu2, one_minus_t2 = end_coordinates(v_t, v_n, v_w, rounding, q)
    k = k_function(t, one_minus_t2)
    h, denominator = 1.0 - one_minus_t2 * k, one_minus_mu2 + mu * mu * one_minus_t2
    inverse = 1.0 / (denominator * one_minus_t2 + TINY)
    p = one_minus_t2 * inverse  # 1 / (1 - mu^2 t^2) = S^2 / (4 R1 R2)
    square = two_over_S * two_over_S
    cube = square * denominator * inverse  # (2 / S)^2 / (1 - t^2)
    mean_1_R = two_over_S * (1.0 + t * t * k)
    mean_u_R3, mean_su_R3 = square * mu * p, cube * t * (one_minus_mu2 * p - h)
    mean_1_R3 = cube * two_over_S * p
    q2v = q * q * v_t
    normal = k_n * two_over_S * one_minus_mu2 * p
    cross = -normal * mu * t
    return Load(
        k_t * v_t * mean_1_R, k_t * (mean_1_R - v_t * q2v * mean_1_R3), -k_t * v_t * mean_u_R3, -k_t * v_t * mean_su_R3,
        k_n * mu, -k_n * q2v * mean_u_R3, normal, cross,
        0.5 * k_n * one_minus_mu2 * t * h, -k_n * q2v * mean_su_R3, cross, k_n * two_over_S * one_minus_mu2 * (p - h),
    )  # fmt: skip


@formula
def point(v_t, v_n, rounding, terms):
    """Return the load on a point of dry terms (q, k_t, k_n), rows of ``terms``, of a law turned to face along the
    element.

    An end cap pushes grains along the body as its side does across, so v_t and v_n change places:
    f_t = k_n v_t / R and f_n = k_t v_n / R with R^2 = q^2 v_n^2 + v_t^2 + rounding^2.
    """
    zero = 0.0 * v_t
    load = Load(zero, zero, zero, zero, zero, zero, zero, zero, zero, zero, zero, zero)
    for j in range(len(terms)):
        q, k_t, k_n = terms[j, 0], terms[j, 1], terms[j, 2]
        R2 = q * v_n * (q * v_n) + v_t * v_t + rounding * rounding
        inverse = where(R2 > 0.0, 1.0, 0.0) / sqrt(where(R2 > 0.0, R2, 1.0))
        e_n, e_t, e = v_n * inverse, v_t * inverse, rounding * inverse
        mixed = e_n * e_t * inverse
        load = added(load, Load(
            k_n * e_t, k_n * (q * e_n * (q * e_n) + e * e) * inverse, -k_n * q * q * mixed, zero,
            k_t * e_n, -k_t * mixed, k_t * (e_t * e_t + e * e) * inverse, zero,
            zero, zero, zero, zero,
        ))  # fmt: skip
    return load


# Additions and factors.


@formula
def pivot_of(v_n, v_w):
    """Return the place on an element where it does not move across, or -1; whether there is one; and u on its head's
    side."""
    inside = absolute(v_w) > absolute(v_n)
    return where(inside, -v_n / where(inside, v_w, 1.0), -1.0), inside, where(inside, v_w, v_n)


@formula
def square(v_n, v_w, strength):
    """Return the load of f_n = strength |u| u, the momentum of grains that are pushed away; exact on both sides of the
    pivot."""
    pivot, _, u_head = pivot_of(v_n, v_w)
    sign = where(u_head == 0.0, 0.0, copysign(strength, u_head))
    p2 = pivot * pivot
    s0, s1 = -sign * pivot, sign * (1.0 - p2) / 2.0  # averages of sign(u) s^k
    s2, s3 = -sign * p2 * pivot / 3.0, sign * (1.0 - p2 * p2) / 4.0
    zero, cross = 0.0 * v_n, 2.0 * (v_n * s1 + v_w * s2)
    return Load(
        zero, zero, zero, zero,
        v_n * v_n * s0 + 2.0 * v_n * v_w * s1 + v_w * v_w * s2, zero, 2.0 * (v_n * s0 + v_w * s1), cross,
        v_n * v_n * s1 + 2.0 * v_n * v_w * s2 + v_w * v_w * s3, zero, cross, 2.0 * (v_n * s2 + v_w * s3),
    )  # fmt: skip


class Factor(NamedTuple):
    """Factors of the drag on an element: along it, where it slides forward or backward, and across it."""

    forward: float
    backward: float
    across: float


@formula
def multiplied(load, v_t, factor):
    """Return a load times the factors of the drag."""
    along, across = where(v_t >= 0.0, factor.forward, factor.backward), factor.across
    return Load(
        along * load.t, along * load.t_t, along * load.t_n, along * load.t_w,
        across * load.n, across * load.n_t, across * load.n_n, across * load.n_w,
        across * load.w, across * load.w_t, across * load.w_n, across * load.w_w,
    )  # fmt: skip


class Incline(NamedTuple):
    """A ground that slopes, as an element meets it.

    down_t, down_n: unit vector downhill, along and across the element. level: factor of the drag on motion that is not
    downhill. weakened: what the factor loses straight downhill. weight: force downhill per unit length, of the body."""

    down_t: float
    down_n: float
    level: float
    weakened: float
    weight: float


@formula
def inclined(load, v, rounding, incline):
    """Return a load where the drag is times level - weakened (v . down) / |v| downhill, by the velocity of the centre,
    less the body's weight along the slope."""
    down_t, down_n, level, weakened, weight = incline
    inverse = 1.0 / sqrt(v[0] * v[0] + v[1] * v[1] + rounding * rounding + TINY)
    down = down_t * v[0] + down_n * v[1]
    lost = where(down > 0.0, weakened, 0.0) * inverse
    weight = weight / sqrt(1.0 + rounding * rounding)  # where drag is viscous it would speed the body up beyond measure
    factor, share = level - lost * down, down * inverse * inverse
    by_t, by_n = lost * (share * v[0] - down_t), lost * (share * v[1] - down_n)
    return Load(
        factor * load.t - weight * down_t, factor * load.t_t + by_t * load.t, factor * load.t_n + by_n * load.t,
        factor * load.t_w,
        factor * load.n - weight * down_n, factor * load.n_t + by_t * load.n, factor * load.n_n + by_n * load.n,
        factor * load.n_w,
        factor * load.w, factor * load.w_t + by_t * load.w, factor * load.w_n + by_n * load.w, factor * load.w_w,
    )  # fmt: skip


# The ground's memory: each side of an element has a share of the drag across.


class Memory(NamedTuple):
    """State of the ground beside an element.

    left, right: developed shares (0 to 1) of the drag on motion to either side. before: v_n one step earlier.
    given_left, given_right: shares that earlier passes have left. dt: the step, rad, below 0 where no share develops.
    rate: e-foldings of a share to a body length of travel."""

    left: float
    right: float
    before: float
    given_left: float
    given_right: float
    dt: float
    rate: float


class Decay(NamedTuple):
    """One step of a share: the parts of the share and of what it lacks that remain, and the slopes of both exponents in
    ``now``."""

    share_remains: float
    lack_remains: float
    back_slope: float
    on_slope: float


@formula
def decay(before, now, dt, rate):
    """Return the decay over a step in which the velocity to a side went evenly from ``before`` to ``now`` >= 0.

    Where it went the other way before, the share first decays. With an infinite rate the share develops at once.
    """
    at_once, forth = rate == np.inf, before >= 0.0
    total = absolute(before) + now
    total = where(total == 0.0, 1.0, total)
    old, new = absolute(before) / total, now / total
    back, on = where(forth, 0.0, old * old), where(forth, old + new, new * new)  # travels, over dt / 2 x total
    growth = where(forth, 1.0, new * new + 2.0 * old * new)
    step = where(at_once, 0.0, rate) * dt / 2.0
    return Decay(exp(-step * total * back), where(at_once, 0.0, exp(-step * total * on)), step * back, step * growth)


@formula
def developed(share, before, now, dt, rate):
    """Return a share after such a step, and its slope in ``now``."""
    share_remains, lack_remains, back_slope, on_slope = decay(before, now, dt, rate)
    old = share * share_remains
    return 1.0 - (1.0 - old) * lack_remains, lack_remains * (on_slope * (1.0 - old) + back_slope * old)


@formula
def side_share(share, given, sign, v_n, v_w, memory):
    """Return the share of the drag on the part that moves left (sign 1) or right (-1), and its slopes in v_n and
    v_w."""
    _, inside, _ = pivot_of(v_n, v_w)
    now = where(inside, 0.5 * (sign * v_n + absolute(v_w)), maximum(sign * v_n, 0.0))  # mean velocity of the part
    value, slope = developed(share, sign * memory.before, now, memory.dt, memory.rate)
    develops = memory.dt >= 0.0
    value, slope = where(develops, given * value, given), where(develops, given * slope, 0.0)
    return value, where(inside, 0.5, 1.0) * sign * slope, where(inside, copysign(0.5, v_w), 0.0) * slope


@formula
def chosen(condition, x, y):
    """Return the triple x where the condition holds, y elsewhere."""
    return where(condition, x[0], y[0]), where(condition, x[1], y[1]), where(condition, x[2], y[2])


@formula
def part(law, v_t, v_n, v_w, rounding, low, high, share):
    """Return the load of the part of an element from s = low to high, with its share (value, slopes) of the drag
    across."""
    value, by_n, by_w = share
    c, h = 0.5 * (high + low), 0.5 * (high - low)
    f = law.average(v_t, v_n + v_w * c, h * v_w, rounding)
    w, w_t, w_n, w_w = c * f.n + h * f.w, c * f.n_t + h * f.w_t, c * f.n_n + h * f.w_n, c * f.n_w + h * f.w_w
    return Load(
        h * f.t, h * f.t_t, h * f.t_n, h * (c * f.t_n + h * f.t_w),
        h * value * f.n, h * value * f.n_t, h * (value * f.n_n + by_n * f.n),
        h * (value * (c * f.n_n + h * f.n_w) + by_w * f.n),
        h * value * w, h * value * w_t, h * (value * w_n + by_n * w), h * (value * (c * w_n + h * w_w) + by_w * w),
    )  # fmt: skip


@formula
def sided(law, v_t, v_n, v_w, rounding, memory):
    """Return the load of a law with a share of the drag across for each side.

    The element is split at its pivot. There the drag across vanishes, so moving the pivot costs nothing, and the slopes
    are those of the parts."""
    pivot, _, u_head = pivot_of(v_n, v_w)
    left = side_share(memory.left, memory.given_left, 1.0, v_n, v_w, memory)
    right = side_share(memory.right, memory.given_right, -1.0, v_n, v_w, memory)
    leftward = u_head > 0.0
    head = part(law, v_t, v_n, v_w, rounding, pivot, 1.0, chosen(leftward, left, right))
    tail = part(law, v_t, v_n, v_w, rounding, -1.0, pivot, chosen(leftward, right, left))
    return added(head, tail)


@formula
def side_load(law, v, rounding, factor, incline, strength, memory, acts):
    """Return the load on an element of the body's side.

    v: (v_t, v_n, v_w). strength: of the drag with the square of the speed. acts: whether factors, that drag, memory and
    a slope act."""
    v_t, v_n, v_w = v
    load = sided(law, v_t, v_n, v_w, rounding, memory) if acts[2] else law.average(v_t, v_n, v_w, rounding)
    if acts[0]:
        load = multiplied(load, v_t, factor)
    if acts[3]:
        load = inclined(load, v, rounding, incline)
    if acts[1]:
        load = added(load, square(v_n, v_w, strength))
    return load


@formula
def point_load(terms, v, rounding, factor, incline, acts):
    """Return the load on a point fixed to the body, of dry terms turned to face along it."""
    load = multiplied(point(v[0], v[1], rounding, terms), v[0], factor)
    return inclined(load, v, rounding, incline) if acts[3] else load
