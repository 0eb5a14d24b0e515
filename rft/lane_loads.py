"""Loads on elements as compiled code: `rft.loads`, `rft.sides` and shares of the ground's past, of which the reasons are there.

Elements of all lanes (`rft.lanes`) lie side by side in the rows of one array, so that a loop along them is made with
vector instructions, eight elements at once. That takes loops from 0 without branches, and rows a constant apart.
A load is 12 rows: of <f_t>, <f_n> and <s f_n>, each its value and its slopes in (v_t, v_n, spin).
"""

from __future__ import annotations

import math

from numba import njit

from rft.loads import SERIES, TINY

OPTIONS = {"nogil": True, "error_model": "numpy"}
compiled = njit(**OPTIONS)
inlined = njit(forceinline=True, **OPTIONS)

ROW = 104  # entries of a row: an odd number of the cache's lines, else rows would push each other out
A, M, W, EPS = range(4)  # rows: velocities (v_t, v_n, spin) and the rounding, true ones
TWO_S, MU, T, C_MU, C_T, K, SQUARED, POWER = range(4, 12)  # of `rft.loads.Ends`; (1 + |t|)^2, a power of 2
LOAD, SUM = 12, 24  # the first of 12 rows each: a load, and one of all parts of elements
WHOLE_M, WHOLE_W, CENTRE, PART, SHARE, BY_M, BY_W, INSIDE = range(36, 44)  # what a part is of, and what is left of it
BY = 44  # what slopes are multiplied by
NET = 45  # the first of 15 rows: what every element adds to those of `rft.lanes`
ROWS = 60
FIRST, LAST, POINT = range(3)  # of an element's law: rows of dry terms, and whether it is a point's
LN2 = math.log(2.0)


K0, K1, K2, K3, K4, K5, K6, K7, K8, K9, K10, K11 = SERIES


@inlined
def series(z):
    k = (((((K11 * z + K10) * z + K9) * z + K8) * z + K7) * z + K6) * z + K5
    return ((((k * z + K4) * z + K3) * z + K2) * z + K1) * z + K0


@compiled
def add_dry(x, bits, whole, count, q, k_t, k_n):
    """Add to the load of so many entries that of f_t = k_t a / R and f_n = k_n u / R. bits, whole: the same array as whole
    numbers, and a row of such. Divisions are what takes time here: there are four."""
    for i in range(count):
        a, m, w, eps = x[A * ROW + i], x[M * ROW + i], x[W * ROW + i], x[EPS * ROW + i]
        qa, lead, u_far = q * q * a, abs(m) - abs(w), abs(m) + abs(w)
        A2, u_near = qa * a + eps * eps, abs(lead)
        R_near, R_far = math.sqrt(A2 + u_near * u_near), math.sqrt(A2 + u_far * u_far)
        two_S = 2.0 / (R_near + R_far + TINY)
        near, far = (R_near + u_near) * two_S, (R_far + u_far) * two_S
        excess = A2 * two_S * two_S * (near + far) / (near * far)  # 2 - 2 max(|mu|, |t|), as a sum of positive terms
        mu, t = m * two_S, w * two_S
        c_t = 0.5 * (excess + (u_near + lead) * two_S) * (1.0 + abs(t))
        x[TWO_S * ROW + i], x[MU * ROW + i], x[T * ROW + i], x[C_T * ROW + i] = two_S, mu, t, c_t
        x[C_MU * ROW + i] = 0.5 * (excess + (u_near - lead) * two_S) * (1.0 + abs(mu))
        x[SQUARED * ROW + i] = (1.0 + abs(t)) * (1.0 + abs(t))
    for i in range(count):
        whole[i] = (bits[SQUARED * ROW + i] >> 52) - (bits[C_T * ROW + i] >> 52)  # of their powers of 2
    for i in range(count):
        bits[POWER * ROW + i] = (1023 + whole[i]) << 52
    for i in range(count):
        # 2 atanh |t| = log (1 + |t|)^2 / (1 - t^2) = power log 2 + 2 atanh s, |s| < 1/3; below |t| = 1/3 nothing cancels.
        t, squared, rest = abs(x[T * ROW + i]), x[SQUARED * ROW + i], x[C_T * ROW + i] * x[POWER * ROW + i]
        small = t < 1.0 / 3.0
        cube = 1.0 if small else t * t * t
        inverse = 1.0 / ((squared + rest) * cube)
        s = (squared - rest) * inverse * cube
        k = series(t * t if small else s * s)
        atanh = 0.5 * LN2 * float(whole[i]) + (s + s * s * s * k)
        x[K * ROW + i] = k if small else (atanh - t) * (squared + rest) * inverse
    for i in range(count):
        a, two_S, mu, t = x[A * ROW + i], x[TWO_S * ROW + i], x[MU * ROW + i], x[T * ROW + i]
        c_mu, c_t, k = x[C_MU * ROW + i], x[C_T * ROW + i], x[K * ROW + i]
        qa, h, over = q * q * a, 1.0 - c_t * k, c_mu + mu * mu * c_t
        inverse = 1.0 / (over * c_t + TINY)
        p, per_c_t = c_t * inverse, two_S * two_S * over * inverse
        d_m, d_w, mean = -two_S * two_S * mu * p, per_c_t * t * (h - c_mu * p), two_S * (1.0 + t * t * k)
        normal = k_n * two_S * c_mu * p
        cross = -normal * mu * t
        x[LOAD * ROW + i] += k_t * a * mean
        x[(LOAD + 1) * ROW + i] += k_t * (mean - a * qa * per_c_t * two_S * p)
        x[(LOAD + 2) * ROW + i] += k_t * a * d_m
        x[(LOAD + 3) * ROW + i] += k_t * a * d_w
        x[(LOAD + 4) * ROW + i] += k_n * mu
        x[(LOAD + 5) * ROW + i] += k_n * qa * d_m
        x[(LOAD + 6) * ROW + i] += normal
        x[(LOAD + 7) * ROW + i] += cross
        x[(LOAD + 8) * ROW + i] += k_n * 0.5 * c_mu * t * h
        x[(LOAD + 9) * ROW + i] += k_n * qa * d_w
        x[(LOAD + 10) * ROW + i] += cross
        x[(LOAD + 11) * ROW + i] += k_n * two_S * c_mu * (p - h)


@compiled
def add_point(x, count, q, k_t, k_n):
    """The same of points whose law is that of a side turned to face along it: f_t = k_n a / R, f_n = k_t m / R, R^2 =
    (q m)^2 + a^2 + eps^2."""
    for i in range(count):
        a, m, eps = x[A * ROW + i], x[M * ROW + i], x[EPS * ROW + i]
        R2 = (q * m) ** 2 + a * a + eps * eps
        inverse = 1.0 / math.sqrt(R2) if R2 > 0.0 else 0.0
        e_m, e_a, e = m * inverse, a * inverse, eps * inverse
        x[LOAD * ROW + i] += k_n * e_a
        x[(LOAD + 1) * ROW + i] += k_n * ((q * e_m) ** 2 + e * e) * inverse
        x[(LOAD + 2) * ROW + i] -= k_n * q * q * e_m * e_a * inverse
        x[(LOAD + 4) * ROW + i] += k_t * e_m
        x[(LOAD + 5) * ROW + i] -= k_t * e_m * e_a * inverse
        x[(LOAD + 6) * ROW + i] += k_t * (e_a * e_a + e * e) * inverse


@compiled
def set_plain(x, bits, whole, count, terms, law, c_t, c_n):
    """The load of one law, without factors. law: (first term, last, whether it is a point's)."""
    for i in range(count):
        a, m, w = x[A * ROW + i], x[M * ROW + i], x[W * ROW + i]
        x[LOAD * ROW + i], x[(LOAD + 1) * ROW + i] = c_t * a, c_t
        x[(LOAD + 2) * ROW + i] = x[(LOAD + 3) * ROW + i] = x[(LOAD + 5) * ROW + i] = 0.0
        x[(LOAD + 4) * ROW + i], x[(LOAD + 6) * ROW + i], x[(LOAD + 7) * ROW + i] = c_n * m, c_n, 0.0
        x[(LOAD + 8) * ROW + i], x[(LOAD + 11) * ROW + i] = c_n / 3.0 * w, c_n / 3.0
        x[(LOAD + 9) * ROW + i] = x[(LOAD + 10) * ROW + i] = 0.0
    for j in range(law[FIRST], law[LAST]):
        if law[POINT]:
            add_point(x, count, terms[j, 0], terms[j, 1], terms[j, 2])
        else:
            add_dry(x, bits, whole, count, terms[j, 0], terms[j, 1], terms[j, 2])


@inlined
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


@inlined
def share(past, side, dt, rate, m, w):
    """What is left of an element's drag across on one side (0 left, 1 right), and its slopes in m and w. past: shares
    developed left and right, velocity across before, and shares that are given; dt < 0 where none develop."""
    left = past[3 + side]
    if dt < 0.0:
        return left, 0.0, 0.0
    turn, sign = abs(w), 1.0 if side == 0 else -1.0
    inside = turn > abs(m)
    now = max(0.5 * (sign * m + turn) if inside else sign * m, 0.0)
    value, slope = developed(past[side], sign * past[2], now, dt, rate)
    slope *= left
    by_w = 0.5 * math.copysign(1.0, w) * slope if inside else 0.0
    return left * value, (0.5 if inside else 1.0) * sign * slope, by_w


@inlined
def side_of(k, m, w):
    """The side (0 left, 1 right) that the part k of an element moves to: 0 from its pivot to the head's end."""
    headwards = w > 0 if abs(w) > abs(m) else m > 0
    return 0 if headwards == (k == 0) else 1


@compiled
def begin_part(x, count, k):
    """Put the velocities of the part k of elements in place of theirs, which WHOLE_M and WHOLE_W keep."""
    for i in range(count):
        m, w = x[WHOLE_M * ROW + i], x[WHOLE_W * ROW + i]
        inside = abs(w) > abs(m)
        pivot = -m / (w if inside else 1.0) if inside else -1.0
        low, high = (pivot, 1.0) if k == 0 else (-1.0, pivot)
        centre, part = 0.5 * (high + low), 0.5 * (high - low)
        x[CENTRE * ROW + i], x[PART * ROW + i] = centre, part
        x[M * ROW + i], x[W * ROW + i] = m + w * centre, w * part


@compiled
def end_part(x, count):
    """Add the load of a part of elements, times what is left of it, to SUM."""
    for i in range(count):
        c, h, left = x[CENTRE * ROW + i], x[PART * ROW + i], x[SHARE * ROW + i]
        by_m, by_w = x[BY_M * ROW + i], x[BY_W * ROW + i]
        t0, t1, t2, t3 = (
            x[LOAD * ROW + i], x[(LOAD + 1) * ROW + i], x[(LOAD + 2) * ROW + i], x[(LOAD + 3) * ROW + i]
        )  # fmt: skip
        n0, n1, n2, n3 = (
            x[(LOAD + 4) * ROW + i], x[(LOAD + 5) * ROW + i], x[(LOAD + 6) * ROW + i], x[(LOAD + 7) * ROW + i]
        )  # fmt: skip
        s0, s1, s2, s3 = (
            x[(LOAD + 8) * ROW + i], x[(LOAD + 9) * ROW + i], x[(LOAD + 10) * ROW + i], x[(LOAD + 11) * ROW + i]
        )  # fmt: skip
        s0, s1, s2, s3 = c * n0 + h * s0, c * n1 + h * s1, c * n2 + h * s2, c * n3 + h * s3
        x[SUM * ROW + i] += h * t0
        x[(SUM + 1) * ROW + i] += h * t1
        x[(SUM + 2) * ROW + i] += h * t2
        x[(SUM + 3) * ROW + i] += h * (c * t2 + h * t3)
        x[(SUM + 4) * ROW + i] += h * left * n0
        x[(SUM + 5) * ROW + i] += h * left * n1
        x[(SUM + 6) * ROW + i] += h * (left * n2 + by_m * n0)
        x[(SUM + 7) * ROW + i] += h * (left * (c * n2 + h * n3) + by_w * n0)
        x[(SUM + 8) * ROW + i] += h * left * s0
        x[(SUM + 9) * ROW + i] += h * left * s1
        x[(SUM + 10) * ROW + i] += h * (left * s2 + by_m * s0)
        x[(SUM + 11) * ROW + i] += h * (left * (c * s2 + h * s3) + by_w * s0)


@compiled
def apply_factors(x, factors, count):
    """Multiply loads by the factors of the drag along, either way, and across, in three rows."""
    for i in range(count):
        along, across = factors[i] if x[A * ROW + i] >= 0 else factors[ROW + i], factors[2 * ROW + i]
        for j in range(4):
            x[(LOAD + j) * ROW + i] *= along
        for j in range(4, 12):
            x[(LOAD + j) * ROW + i] *= across


@compiled
def add_square(x, beta, count):
    """Add beta |u| u, u = m + s w, whose sign changes at the pivot."""
    for i in range(count):
        m, w = x[M * ROW + i], x[W * ROW + i]
        inside = abs(w) > abs(m)
        pivot = -m / (w if inside else 1.0) if inside else -1.0
        beyond = w if inside else m
        sign = 0.0 if beyond == 0.0 else math.copysign(beta[i], beyond)
        p2 = pivot * pivot
        s0, s1 = sign * (-pivot), sign * (1.0 - p2) / 2.0
        s2, s3 = sign * (-p2 * pivot) / 3.0, sign * (1.0 - p2 * p2) / 4.0
        cross = 2.0 * (m * s1 + w * s2)
        x[(LOAD + 4) * ROW + i] += m * m * s0 + 2.0 * m * w * s1 + w * w * s2
        x[(LOAD + 6) * ROW + i] += 2.0 * (m * s0 + w * s1)
        x[(LOAD + 7) * ROW + i] += cross
        x[(LOAD + 8) * ROW + i] += m * m * s1 + 2.0 * m * w * s2 + w * w * s3
        x[(LOAD + 10) * ROW + i] += cross
        x[(LOAD + 11) * ROW + i] += 2.0 * (m * s2 + w * s3)
