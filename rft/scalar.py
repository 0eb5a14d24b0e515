"""The descents of `rft.newton` as compiled scalar code, one sample after the other; the reasons are there.

Every step is that of the batched solver, with its constants. Inner loops index whole arrays only: a view of an array that
is taken in a loop costs as much as the force on an element. Imported only where it is used: numba takes a while.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rft.compiled import STAMP
from rft.scalar_loads import OPTIONS, add_momentum, compiled, plain, plus, sided, square, times

C, S, R_T, R_N, HALF, WEIGHT = range(6)  # columns of an element: `rft.bodies.base.Kinematics`
FORWARD, BACKWARD, ACROSS, SQUARE = range(4)  # its factors: of the drag along, either way, and across; of |u| u


@compiled
def columns(row, by, c, s, r_t, r_n, half, a, m, w):
    """A row of an element's load, its slopes in (a, m, w) made those in the frame's velocity, and that along its own."""
    to_t, to_n, to_w = by * row[1], by * row[2], by * row[3]
    on_frame = c * to_t - s * to_n, s * to_t + c * to_n, r_t * to_t + r_n * to_n + half * to_w
    return row[0], *on_frame, to_t * a + to_n * m + to_w * w


@compiled
def summed(p, k, t, i, n, j, s):
    """p + k t + i n + j s, of rows of five."""
    return (
        p[0] + k * t[0] + i * n[0] + j * s[0],
        p[1] + k * t[1] + i * n[1] + j * s[1],
        p[2] + k * t[2] + i * n[2] + j * s[2],
        p[3] + k * t[3] + i * n[3] + j * s[3],
        p[4] + k * t[4] + i * n[4] + j * s[4],
    )


@compiled
def set_net(net, terms, viscous, which, elements, factors, past, mass, rates, v, x, y, turn, eps, scale):
    """net (3, 5): force and moment on the frame that moves with (x, y, turn), their tangent with respect to velocities over
    the scale, and sum of J^T H v. rates: dt and e-foldings a length of `developed`, dt < 0 where there are none."""
    x_row = y_row = turn_row = (0.0, 0.0, 0.0, 0.0, 0.0)
    for e in range(len(elements)):
        a, m, w = v[e, 0] * scale, v[e, 1] * scale, v[e, 2] * scale
        if e < len(past):
            along, across, turning = sided(terms, viscous, which, past, e, rates[0], rates[1], a, m, w, eps * scale)
        else:
            along, across, turning = plain(terms, viscous, which, e, a, m, w, eps * scale)
        along = times(factors[e, FORWARD] if a >= 0 else factors[e, BACKWARD], along)
        across, turning = times(factors[e, ACROSS], across), times(factors[e, ACROSS], turning)
        if factors[e, SQUARE] != 0.0:
            n, s = square(factors[e, SQUARE], m, w)
            across, turning = plus(across, n), plus(turning, s)
        c, s, r_t, r_n = elements[e, C], elements[e, S], elements[e, R_T], elements[e, R_N]
        half, weight = elements[e, HALF], elements[e, WEIGHT]
        f_t = columns(along, scale, c, s, r_t, r_n, half, v[e, 0], v[e, 1], v[e, 2])
        f_n = columns(across, scale, c, s, r_t, r_n, half, v[e, 0], v[e, 1], v[e, 2])
        f_s = columns(turning, scale, c, s, r_t, r_n, half, v[e, 0], v[e, 1], v[e, 2])
        c, s, r_t, r_n, half = weight * c, weight * s, weight * r_t, weight * r_n, weight * half
        x_row = summed(x_row, c, f_t, -s, f_n, 0.0, f_s)
        y_row = summed(y_row, s, f_t, c, f_n, 0.0, f_s)
        turn_row = summed(turn_row, r_t, f_t, r_n, f_n, half, f_s)
    for j in range(5):
        net[0, j], net[1, j], net[2, j] = x_row[j], y_row[j], turn_row[j]
    if len(mass):
        add_momentum(net, mass, x, y, turn, scale)


@compiled
def slowest(v):
    """The speed of the slowest element, each by its faster end."""
    least = np.inf
    for e in range(len(v)):
        least = min(least, v[e, 0] ** 2 + (abs(v[e, 1]) + abs(v[e, 2])) ** 2)
    return math.sqrt(least)


@compiled
def solved3(net, x, y, z):
    """(x, y, z) over the tangent of net, by Cramer's rule; a singular one gives no step."""
    a, b, c = net[0, 1], net[0, 2], net[0, 3]
    d, e, f = net[1, 1], net[1, 2], net[1, 3]
    g, h, i = net[2, 1], net[2, 2], net[2, 3]
    A, B, D = e * i - f * h, f * g - d * i, d * h - e * g
    det = a * A + b * B + c * D
    inverse = 0.0 if det == 0.0 else 1.0 / det
    return (
        (A * x + (c * h - b * i) * y + (b * f - c * e) * z) * inverse,
        (B * x + (a * i - c * g) * y + (c * d - a * f) * z) * inverse,
        (D * x + (b * g - a * h) * y + (a * e - b * d) * z) * inverse,
    )


@compiled
def descend(
    descent,
    limits,
    terms,
    viscous,
    which,
    elements,
    factors,
    past,
    mass,
    rates,
    own,
    centre,
    v,
    tried,
    net,
    scale,
    unit,
    xi,
    warm,
):
    """One attempt on one sample: (residual, evaluations); leaves xi and v at the last velocity kept. xi holds the guess if
    ``warm``."""
    widest, ratio, loose, free, budget = descent
    last, limit, largest, shortest, lengthen = limits
    linear = len(terms) == 0
    eps = last if linear else max(widest, last)
    eps_next, stride, residual = eps, 1.0, np.inf
    v[:] = own
    x, y, turn = xi[0], xi[1], xi[2]
    if not warm:
        set_net(net, terms, viscous, which, elements, factors, past, mass, rates, v, 0.0, 0.0, 0.0, 1e3, scale)
        x, y, turn = solved3(net, -net[0, 0], -net[1, 0], -net[2, 0])
    xi[:] = 0.0
    for step in range(1, int(budget) + 1):
        for e in range(len(elements)):
            c, s = elements[e, C], elements[e, S]
            tried[e, 0] = v[e, 0] + (c * x + s * y + elements[e, R_T] * turn)
            tried[e, 1] = v[e, 1] + (c * y - s * x + elements[e, R_N] * turn)
            tried[e, 2] = v[e, 2] + elements[e, HALF] * turn
        set_net(
            net, terms, viscous, which, elements, factors, past, mass, rates, tried, xi[0] + x, xi[1] + y, xi[2] + turn,
            eps_next, scale,
        )  # fmt: skip
        force = math.sqrt(net[0, 0] * net[0, 0] + net[1, 0] * net[1, 0])
        moment = net[2, 0] - centre[0] * net[1, 0] + centre[1] * net[0, 0]
        now, before, eps = max(force, abs(moment)) / unit, eps, eps_next
        if not (eps < before or now < residual or stride <= shortest):
            stride, x, y, turn = 0.5 * stride, 0.5 * x, 0.5 * y, 0.5 * turn
            continue
        xi[0] += x
        xi[1] += y
        xi[2] += turn
        v[:] = tried
        residual = now
        if eps <= last and residual <= limit:
            return residual, step
        stride, pull = min(1.0, lengthen * stride), 0.0
        if eps > last and residual < loose:
            freely = slowest(v) > free * eps
            eps_next = last if freely else max(ratio * eps, last)
            change = eps_next / eps
            pull = (change * change - 1.0) / 2.0 if freely else change - 1.0
        x, y, turn = solved3(
            net,
            pull * net[0, 4] - stride * net[0, 0],
            pull * net[1, 4] - stride * net[1, 0],
            pull * net[2, 4] - stride * net[2, 0],
        )
        size = max(abs(x), abs(y), abs(turn))
        if size > 1.0:
            far = math.sqrt((x - centre[1] * turn) ** 2 + (y + centre[0] * turn) ** 2 + turn * turn)
            cut = min(1.0, largest / far)
            x, y, turn = cut * x, cut * y, cut * turn
    return residual if eps <= last else np.inf, int(budget)


def built(stamp: str):
    def attempt(descent, limits, law, motion, factors, pasts, rates, masses, centre, scale, unit, guess, out):
        """`descend` for samples on the last axis of the arrays of a motion, written to out: xi (3, B), residual, evaluations,
        the slowest element's speed (B,). law: dry terms (T, 3), viscous coefficients (n, 2), and which terms an element has
        (n, 3). factors: (4, n, B or 1). pasts: (5, k, B), shares developed left and right, velocity across before, and shares
        that are given, of the first k elements. rates: (2, B or 1). masses: (17, B) as `add_momentum` has them, or (0, B)."""
        _ = stamp  # this source's, so that numba's cache knows which it keeps
        cos, sin, r_t, r_n, half, weight, own_v = motion
        xi, residual, evaluations, slow = out
        terms, viscous, which = law
        n, size = cos.shape
        some, k = factors.shape[-1], pasts.shape[1]
        warm = guess.shape[1] > 0
        elements, kept, past, mass = np.zeros((n, 6)), np.ones((n, 4)), np.ones((k, 5)), np.zeros(masses.shape[0])
        own, v, tried, x, middle = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(3), np.zeros(2)
        rate = np.zeros(2)
        net = np.zeros((3, 5))
        for e in range(n):
            elements[e, HALF], elements[e, WEIGHT] = half[e, 0], weight[e, 0]
        for i in range(size):
            for e in range(n):
                elements[e, C], elements[e, S], elements[e, R_T], elements[e, R_N] = (
                    cos[e, i],
                    sin[e, i],
                    r_t[e, i],
                    r_n[e, i],
                )
                own[e, 0], own[e, 1], own[e, 2] = own_v[0, e, i], own_v[1, e, i], own_v[2, e, i]
                for j in range(4):
                    kept[e, j] = factors[j, e, i % some]
            for e in range(k):
                for j in range(5):
                    past[e, j] = pasts[j, e, i]
            for j in range(len(mass)):
                mass[j] = masses[j, i]
            rate[0], rate[1] = rates[0, i % rates.shape[1]], rates[1, i % rates.shape[1]]
            middle[0], middle[1] = centre[0, i], centre[1, i]
            if warm:
                x[0], x[1], x[2] = guess[0, i], guess[1, i], guess[2, i]
            residual[i], evaluations[i] = descend(
                descent,
                limits,
                terms,
                viscous,
                which,
                elements,
                kept,
                past,
                mass,
                rate,
                own,
                middle,
                v,
                tried,
                net,
                scale[i],
                unit[i],
                x,
                warm,
            )
            xi[0, i], xi[1, i], xi[2, i] = x[0], x[1], x[2]
            slow[i] = slowest(v)

    try:
        return njit(cache=True, **OPTIONS)(attempt)
    except RuntimeError:  # no folder for it: neither beside this file, nor the user's, nor where NUMBA_CACHE_DIR points
        return njit(**OPTIONS)(attempt)


attempt = built(STAMP)
