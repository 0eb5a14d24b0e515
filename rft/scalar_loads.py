"""Loads on one element as compiled scalar code: `rft.loads`, `rft.sides` and shares of the ground's past, of which the
reasons are there. A load is three rows, of <f_t>, <f_n> and <s f_n>, each (value, slopes in a, m and w), where (a, m, w) are
(v_t, v_n, spin). Rows are tuples, which live in registers where arrays would go through memory."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rft.loads import SERIES, SERIES_BELOW, TINY

OPTIONS = {"nogil": True, "error_model": "numpy"}
compiled = njit(forceinline=True, **OPTIONS)
FIRST, LAST, POINT = range(3)  # of an element's law: rows of dry terms, and whether it is a point's
K_SERIES = np.array(SERIES)
NONE = (0.0, 0.0, 0.0, 0.0)


@compiled
def plus(p, q):
    return p[0] + q[0], p[1] + q[1], p[2] + q[2], p[3] + q[3]


@compiled
def times(k, p):
    return k * p[0], k * p[1], k * p[2], k * p[3]


@compiled
def k_function(z, one_minus_z):
    """(atanh t - t) / t^3 for z = t^2."""
    if z < SERIES_BELOW:
        k = K_SERIES[-1]
        for j in range(K_SERIES.size - 2, -1, -1):
            k = k * z + K_SERIES[j]
        return k
    t = math.sqrt(z)
    return (0.5 * math.log((1.0 + t) * (1.0 + t) / max(one_minus_z, TINY)) - t) / (t * z)


@compiled
def dry(q, k_t, k_n, a, m, w, eps):
    """The load of f_t = k_t a / R and f_n = k_n u / R on an element."""
    qa, lead, u_far = q * q * a, abs(m) - abs(w), abs(m) + abs(w)
    A2, u_near = qa * a + eps * eps, abs(lead)
    R_near, R_far = math.sqrt(A2 + u_near * u_near), math.sqrt(A2 + u_far * u_far)
    two_S = 2.0 / (R_near + R_far + TINY)
    excess = A2 / (R_near + u_near + TINY) + A2 / (R_far + u_far + TINY)
    mu, t = m * two_S, w * two_S
    c_mu = 0.5 * (excess + (u_near - lead)) * (1.0 + abs(mu)) * two_S
    c_t = 0.5 * (excess + (u_near + lead)) * (1.0 + abs(t)) * two_S
    k = k_function(t * t, c_t)
    h = 1.0 - c_t * k
    p = 1.0 / (c_mu + mu * mu * c_t + TINY)
    per_c_t = two_S * two_S / (c_t + TINY)
    d_m, d_w = -two_S * two_S * mu * p, per_c_t * t * (h - c_mu * p)
    along = NONE
    if k_t != 0.0:
        inverse = two_S * (1.0 + t * t * k)
        along = (
            k_t * a * inverse,
            k_t * (inverse - a * qa * per_c_t * two_S * p),
            k_t * a * d_m,
            k_t * a * d_w,
        )
    normal = two_S * c_mu * p
    cross = -normal * mu * t
    across = k_n * mu, k_n * qa * d_m, k_n * normal, k_n * cross
    turning = k_n * 0.5 * c_mu * t * h, k_n * qa * d_w, k_n * cross, k_n * two_S * c_mu * (p - h)
    return along, across, turning


@compiled
def on_point(q, k_t, k_n, a, m, eps):
    """The rows along and across of a point whose law is that of a side turned to face along it: f_t = k_n a / R, f_n = k_t m /
    R, R^2 = (q m)^2 + a^2 + eps^2."""
    R2 = (q * m) ** 2 + a * a + eps * eps
    inverse = 1.0 / math.sqrt(R2) if R2 > 0.0 else 0.0
    e_m, e_a, e = m * inverse, a * inverse, eps * inverse
    along = k_n * e_a, k_n * ((q * e_m) ** 2 + e * e) * inverse, -k_n * q * q * e_m * e_a * inverse, 0.0
    return along, (k_t * e_m, -k_t * e_m * e_a * inverse, k_t * (e_a * e_a + e * e) * inverse, 0.0)


@compiled
def square(beta, m, w):
    """The rows across and turning of beta |u| u, u = m + s w."""
    inside = abs(w) > abs(m)
    pivot = -m / w if inside else -1.0
    beyond = w if inside else m
    sign = 0.0 if beyond == 0.0 else math.copysign(beta, beyond)
    p2 = pivot * pivot
    s0, s1 = sign * (-pivot), sign * (1.0 - p2) / 2.0
    s2, s3 = sign * (-p2 * pivot) / 3.0, sign * (1.0 - p2 * p2) / 4.0
    cross = 2.0 * (m * s1 + w * s2)
    across = m * m * s0 + 2.0 * m * w * s1 + w * w * s2, 0.0, 2.0 * (m * s0 + w * s1), cross
    return across, (m * m * s1 + 2.0 * m * w * s2 + w * w * s3, 0.0, cross, 2.0 * (m * s2 + w * s3))


@compiled
def developed(share, before, now, dt, rate):
    """A share after a step, and its slope in ``now``: `rft.effects.transient`."""
    if math.isinf(rate):
        return 1.0, 0.0
    total = abs(before) + now
    total = 1.0 if total == 0 else total
    old, new = abs(before) / total, now / total
    if before >= 0:
        back, on, growth = 0.0, old + new, 1.0
    else:
        back, on, growth = old * old, new * new, new * new + 2.0 * old * new
    step = rate * dt / 2.0
    kept, lacking = share * math.exp(-step * total * back), math.exp(-step * total * on)
    return 1.0 - (1.0 - kept) * lacking, step * lacking * (growth * (1.0 - kept) + back * kept)


@compiled
def share(past, e, side, dt, rate, m, w):
    """What is left of an element's drag across on one side (0 left, 1 right), and its slopes in m and w."""
    left = past[e, 3 + side]
    if dt < 0.0:
        return left, 0.0, 0.0
    turn, sign = abs(w), 1.0 if side == 0 else -1.0
    inside = turn > abs(m)
    now = max(0.5 * (sign * m + turn) if inside else sign * m, 0.0)
    value, slope = developed(past[e, side], sign * past[e, 2], now, dt, rate)
    slope *= left
    by_w = 0.5 * math.copysign(1.0, w) * slope if inside else 0.0
    return left * value, (0.5 if inside else 1.0) * sign * slope, by_w


@compiled
def plain(terms, viscous, which, e, a, m, w, eps):
    """The load of an element's own law, without factors."""
    c_t, c_n = viscous[e, 0], viscous[e, 1]
    along, across, turning = (c_t * a, c_t, 0.0, 0.0), (c_n * m, 0.0, c_n, 0.0), (c_n / 3.0 * w, 0.0, 0.0, c_n / 3.0)
    for j in range(which[e, FIRST], which[e, LAST]):
        if which[e, POINT]:
            t, n = on_point(terms[j, 0], terms[j, 1], terms[j, 2], a, m, eps)
        else:
            t, n, s = dry(terms[j, 0], terms[j, 1], terms[j, 2], a, m, w, eps)
            turning = plus(turning, s)
        along, across = plus(along, t), plus(across, n)
    return along, across, turning


@compiled
def sided(terms, viscous, which, past, e, dt, rate, a, m, w, eps):
    """That of a law with shares of the drag across, each side of its pivot for itself: `rft.sides`."""
    inside = abs(w) > abs(m)
    pivot = -m / w if inside else -1.0
    left = w > 0 if inside else m > 0  # the part towards the head
    along, across, turning = NONE, NONE, NONE
    for k in range(2 if inside else 1):
        low, high = (pivot, 1.0) if k == 0 else (-1.0, pivot)
        centre, half = 0.5 * (high + low), 0.5 * (high - low)
        left_of, by_m, by_w = share(past, e, 0 if left == (k == 0) else 1, dt, rate, m, w)
        t, n, s = plain(terms, viscous, which, e, a, m + w * centre, w * half, eps)
        s = plus(times(centre, n), times(half, s))
        along = plus(along, times(half, (t[0], t[1], t[2], centre * t[2] + half * t[3])))
        n = n[0], n[1], n[2], centre * n[2] + half * n[3]
        s = s[0], s[1], s[2], centre * s[2] + half * s[3]
        across = plus(across, times(half, plus(times(left_of, n), (0.0, 0.0, by_m * n[0], by_w * n[0]))))
        turning = plus(turning, times(half, plus(times(left_of, s), (0.0, 0.0, by_m * s[0], by_w * s[0]))))
    return along, across, turning


@compiled
def add_momentum(net, mass, x, y, turn, scale):
    """Add strength (rate p - past + ad*_xi p), p = M xi + shape, to the force and its tangent: `rft.effects.body_inertia`.
    mass: M, shape, past, rate and strength of one sample in a row."""
    x, y, turn, rate, strength = x * scale, y * scale, turn * scale, mass[15], mass[16]
    p0 = mass[0] * x + mass[1] * y + mass[2] * turn + mass[9]
    p1 = mass[3] * x + mass[4] * y + mass[5] * turn + mass[10]
    p2 = mass[6] * x + mass[7] * y + mass[8] * turn + mass[11]
    net[0, 0] += strength * (rate * p0 - turn * p1 - mass[12])
    net[1, 0] += strength * (rate * p1 + turn * p0 - mass[13])
    net[2, 0] += strength * (rate * p2 + x * p1 - y * p0 - mass[14])
    for k in range(3):
        m0, m1, m2 = mass[k], mass[3 + k], mass[6 + k]
        net[0, k + 1] += strength * scale * (rate * m0 - turn * m1)
        net[1, k + 1] += strength * scale * (rate * m1 + turn * m0)
        net[2, k + 1] += strength * scale * (rate * m2 + x * m1 - y * m0)
    net[2, 1] += strength * scale * p1
    net[2, 2] -= strength * scale * p0
    net[0, 3] -= strength * scale * p1
    net[1, 3] += strength * scale * p0
