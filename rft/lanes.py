"""The descents of `rft.newton` as compiled code, for several samples at once; the reasons are there.

Every step is that of the batched solver, with its constants. Each sample has a lane. One evaluation serves all lanes; then
each chooses its next step for itself, and one that has ended gives its lane to the next sample. So no sample hangs on
the others, to the last digit, and none waits for the slowest. Imported only where it is used: numba takes a while.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from rft.compiled import STAMP
from rft.lane_cache import kept
from rft.lane_loads import OPTIONS, ROW, ROWS, compiled, inlined

# isort: off
from rft.lane_nets import (
    C, C_X, C_Y, DX, ENDED, FACTORS, FRESH, HALF, KEPT, LANE_ROWS, LANES, NEXT, NOW, OWN, PAST, R_N, R_T, RESIDUAL, S,
    SCALE, SLOW, SLOWEST, STEPS, STRIDE, TOTAL, TRIED, UNIT, V, WEIGHT, XI, evaluate, place,
)  # fmt: skip
# isort: on

VISCOUS = 1e8  # rounding at which every law is a viscous one to the last digit


@inlined
def solved3(of, lane, x, y, z):
    """(x, y, z) over the tangent in TOTAL, by Cramer's rule; a singular one gives no step."""
    at = TOTAL * LANES + lane
    a, b, c = of[at + LANES], of[at + 2 * LANES], of[at + 3 * LANES]
    d, e, f = of[at + 6 * LANES], of[at + 7 * LANES], of[at + 8 * LANES]
    g, h, i = of[at + 11 * LANES], of[at + 12 * LANES], of[at + 13 * LANES]
    A, B, D = e * i - f * h, f * g - d * i, d * h - e * g
    det = a * A + b * B + c * D
    inverse = 0.0 if det == 0.0 else 1.0 / det
    return (
        (A * x + (c * h - b * i) * y + (b * f - c * e) * z) * inverse,
        (B * x + (a * i - c * g) * y + (c * d - a * f) * z) * inverse,
        (D * x + (b * g - a * h) * y + (a * e - b * d) * z) * inverse,
    )


@compiled
def add_momentum(of, lane, mass, sample):
    """Add strength (M xi + held) to the force and its tangent: `rft.effects.body_inertia`. mass (13, B): M, held and strength
    of each sample."""
    at, strength = TOTAL * LANES + lane, mass[12, sample]
    of_v = strength * of[SCALE * LANES + lane]
    x, y, turn = (
        of[(XI + 0) * LANES + lane] + of[(DX + 0) * LANES + lane],
        of[(XI + 1) * LANES + lane] + of[(DX + 1) * LANES + lane],
        of[(XI + 2) * LANES + lane] + of[(DX + 2) * LANES + lane],
    )
    for k in range(3):
        m_x, m_y, m_turn = mass[3 * k, sample], mass[3 * k + 1, sample], mass[3 * k + 2, sample]
        row = at + 5 * k * LANES
        of[row] += of_v * (m_x * x + m_y * y + m_turn * turn) + strength * mass[9 + k, sample]
        of[row + LANES] += of_v * m_x
        of[row + 2 * LANES] += of_v * m_y
        of[row + 3 * LANES] += of_v * m_turn


@compiled
def judge(of, lanes, first, descent, limits):
    """Keep the step of every lane that helps, choose the next, and say which lanes have ended. first: the rounding after that
    of the viscous solution, which FRESH lanes begin with. Without branches, for all at once."""
    ratio, loose, free, budget = descent[1], descent[2], descent[3], descent[4]
    last, limit, largest, shortest, lengthen = limits[0], limits[1], limits[2], limits[3], limits[4]
    for lane in range(lanes):
        at = TOTAL * LANES + lane
        f_x, f_y, moment = of[at], of[at + 5 * LANES], of[at + 10 * LANES]
        cx, cy, fresh = of[C_X * LANES + lane], of[C_Y * LANES + lane], of[FRESH * LANES + lane] > 0.0
        before, eps, stride, worst = (
            of[NOW * LANES + lane],
            of[NEXT * LANES + lane],
            of[STRIDE * LANES + lane],
            of[RESIDUAL * LANES + lane],
        )
        force, about = math.sqrt(f_x * f_x + f_y * f_y), moment - cx * f_y + cy * f_x
        now = max(force, abs(about)) / of[UNIT * LANES + lane]
        now = now if force + abs(about) < np.inf else np.inf  # max forgets a nan
        kept = ((eps < before) | (now < worst) | (stride <= shortest)) & (not fresh)
        down = kept & (eps > last) & (now < loose)
        slow, slowest = of[SLOW * LANES + lane], of[SLOWEST * LANES + lane]
        freely = math.sqrt(slow) > free * eps
        lower = last if freely else max(ratio * eps, last)
        change = lower / eps
        pull = (change * change - 1.0) / 2.0 if freely else change - 1.0
        pull = pull if down else 0.0
        longer = stride if fresh else min(1.0, lengthen * stride)
        x, y, turn = solved3(
            of,
            lane,
            pull * of[at + 4 * LANES] - longer * f_x,
            pull * of[at + 9 * LANES] - longer * f_y,
            pull * of[at + 14 * LANES] - longer * moment,
        )
        place_x, place_y = x - cy * turn, y + cx * turn
        far = math.sqrt(place_x * place_x + place_y * place_y + turn * turn)
        cut = largest / max(far, largest) if (max(abs(x), abs(y), abs(turn)) > 1.0) & (not fresh) else 1.0
        dx, dy, dturn = of[DX * LANES + lane], of[(DX + 1) * LANES + lane], of[(DX + 2) * LANES + lane]
        of[XI * LANES + lane] += dx if kept else 0.0
        of[(XI + 1) * LANES + lane] += dy if kept else 0.0
        of[(XI + 2) * LANES + lane] += dturn if kept else 0.0
        chosen = kept | fresh
        of[DX * LANES + lane] = cut * x if chosen else 0.5 * dx
        of[(DX + 1) * LANES + lane] = cut * y if chosen else 0.5 * dy
        of[(DX + 2) * LANES + lane] = cut * turn if chosen else 0.5 * dturn
        of[STRIDE * LANES + lane] = longer if chosen else 0.5 * stride
        of[RESIDUAL * LANES + lane] = now if kept else worst
        of[NOW * LANES + lane], of[NEXT * LANES + lane] = (
            first if fresh else eps,
            first if fresh else (lower if down else eps),
        )
        of[SLOWEST * LANES + lane] = slow if kept else slowest
        steps = of[STEPS * LANES + lane] + (0.0 if fresh else 1.0)
        done = (kept & (eps <= last) & (now <= limit)) | (steps >= budget)
        of[STEPS * LANES + lane], of[FRESH * LANES + lane] = steps, 0.0
        of[KEPT * LANES + lane], of[ENDED * LANES + lane] = 1.0 if kept else 0.0, 1.0 if done else 0.0


@compiled
def keep(body, of, lanes, n):
    """Velocities of the lanes that keep their steps."""
    together = ROW // lanes
    for first in range(0, n, together):
        here, count = body[place(first, 0, lanes) :] if first else body, min(together, n - first)
        for e in range(count):
            for lane in range(lanes):
                i, kept = e * lanes + lane, of[KEPT * LANES + lane] > 0.0
                for j in range(3):
                    old, new = here[(V + j) * ROW + i], here[(TRIED + j) * ROW + i]
                    here[(V + j) * ROW + i] = new if kept else old


@compiled
def enter(body, of, lane, lanes, i, motion, factors, pasts, scale, unit, scaled):
    """Give a lane to the sample i, at rest."""
    cos, sin, r_t, r_n, half, weight, own = motion
    c_x, c_y, length = 0.0, 0.0, 0.0  # the mean place
    for e in range(len(cos)):
        c_x += half[e, 0] * (r_t[e, i] * sin[e, i] + r_n[e, i] * cos[e, i])
        c_y += half[e, 0] * (r_n[e, i] * sin[e, i] - r_t[e, i] * cos[e, i])
        length += half[e, 0]
        at = place(e, lane, lanes)
        body[at + C * ROW], body[at + S * ROW], body[at + R_T * ROW] = cos[e, i], sin[e, i], r_t[e, i]
        body[at + R_N * ROW], body[at + HALF * ROW], body[at + WEIGHT * ROW] = r_n[e, i], half[e, 0], weight[e, 0]
        for j in range(3):
            body[at + (V + j) * ROW] = own[j, e, i] / scale[i]
        for j in range(4):
            body[at + (FACTORS + j) * ROW] = factors[j, e, i % factors.shape[2]]
    for e in range(pasts.shape[1]):
        for j in range(5):
            body[place(e, lane, lanes) + (PAST + j) * ROW] = pasts[j, e, i]
    for row in range(TOTAL):
        of[row * LANES + lane] = 0.0
    of[STRIDE * LANES + lane], of[RESIDUAL * LANES + lane] = 1.0, np.inf
    of[SCALE * LANES + lane], of[UNIT * LANES + lane] = scale[i] if scaled else 1.0, unit[i]
    of[C_X * LANES + lane], of[C_Y * LANES + lane] = c_x / length, c_y / length


@compiled
def begin(of, lane, i, first, guess):
    """Its first step: the guess, if there is one, else that to the viscous solution."""
    warm = guess.shape[1] > 0
    of[FRESH * LANES + lane] = 0.0 if warm else 1.0
    of[NOW * LANES + lane], of[NEXT * LANES + lane] = first, first if warm else VISCOUS
    if warm:
        for j in range(3):
            of[(DX + j) * LANES + lane] = guess[j, i]


@compiled
def leave(of, lane, i, last, out):
    """Write what a lane has come to. A balance with wider rounding is not the one that was asked for."""
    xi, residual, evaluations, slow = out
    for j in range(3):
        xi[j, i] = of[(XI + j) * LANES + lane]
    residual[i] = of[RESIDUAL * LANES + lane] if of[NOW * LANES + lane] <= last else np.inf
    evaluations[i], slow[i] = int(of[STEPS * LANES + lane]), math.sqrt(of[SLOWEST * LANES + lane])


def built(stamp: str):
    def attempt(descent, limits, law, motion, factors, pasts, rates, masses, scale, unit, guess, scaled, out):
        """A descent of samples on the last axis of the arrays of a motion, written to out: xi (3, B), residual, evaluations,
        the slowest element's speed (B,), velocities over the scale (B,). scaled: drag knows of true ones. law: dry terms
        (T, 3), viscous coefficients (n, 2), and which terms an element has (n, 3). factors: (4, n, B or 1). pasts: (5, k, B),
        shares developed left and right, velocity across before, and shares that are given, of the first k elements. rates:
        (2, B or 1), dt and e-foldings a length, dt < 0 where nothing develops. masses: (13, B) as `add_momentum` has them,
        or (0, 1)."""
        _ = stamp  # this source's, so that what is kept tells which it is
        terms, viscous, which = law
        n, size, shared = motion[0].shape[0], motion[0].shape[1], pasts.shape[1]
        lanes = max(1, min(LANES, size, 4 * ROW // n))
        x, whole, of = np.empty(ROWS * ROW), np.empty(ROW, np.int64), np.zeros(LANE_ROWS * LANES)
        bits, body = x.view(np.int64), np.empty((1 + (n - 1) // (ROW // lanes)) * OWN * ROW)
        who, rate, changed = np.full(lanes, -1), np.zeros((2, lanes)), ((factors[:3] != 1.0).any(), factors[3].any())
        last = limits[0]
        first = last if len(terms) == 0 else max(descent[0], last)
        come, gone = 0, 0
        while gone < size:
            for lane in range(lanes):
                if who[lane] < 0 and come < size:
                    i = who[lane] = come
                    come += 1
                    enter(body, of, lane, lanes, i, motion, factors, pasts, scale, unit, scaled)
                    begin(of, lane, i, first, guess)
                    rate[0, lane], rate[1, lane] = rates[0, i % rates.shape[1]], rates[1, i % rates.shape[1]]
            evaluate(x, bits, whole, body, of, lanes, n, shared, terms, viscous, which, rate, changed)
            if len(masses):
                for lane in range(lanes):
                    if who[lane] >= 0:
                        add_momentum(of, lane, masses, who[lane])
            judge(of, lanes, first, descent, limits)
            keep(body, of, lanes, n)
            for lane in range(lanes):
                if of[ENDED * LANES + lane] > 0.0 and who[lane] >= 0:
                    leave(of, lane, who[lane], last, out)
                    who[lane], gone = -1, gone + 1

    return kept(njit(**OPTIONS)(attempt), "lanes")


attempt = built(STAMP)
