"""What elements do to the frame, as compiled code, for all lanes at once (`rft.lanes`): velocities, loads, and their sums.

``body`` holds what is an element's own, in blocks of as many elements as fit a row of `rft.lane_loads`, element after
element and every lane of one beside the other. ``of`` holds what is a lane's own. Both are plain rows of one array.
"""

from __future__ import annotations

import numpy as np

from rft.lane_loads import (
    BY,
    BY_M,
    BY_W,
    EPS,
    FIRST,
    LAST,
    LOAD,
    NET,
    POINT,
    ROW,
    SHARE,
    SUM,
    WHOLE_M,
    WHOLE_W,
    A,
    M,
    W,
    add_square,
    apply_factors,
    begin_part,
    compiled,
    end_part,
    inlined,
    set_plain,
    share,
    side_of,
)

# isort: on

LANES = 16  # at most, and as many numbers to a row of lanes
C, S, R_T, R_N, HALF, WEIGHT = range(6)  # rows of an element's own: `rft.bodies.base.Kinematics`
V, TRIED, FACTORS, SQUARE, PAST, OWN = 6, 9, 12, 15, 16, 21  # first rows: velocities at xi and beyond, what effects say
DX, XI, NOW, NEXT, STRIDE, RESIDUAL, SCALE, UNIT, C_X, C_Y, FRESH, STEPS = 0, 3, *range(6, 16)  # rows of a lane
KEPT, ENDED, SLOWEST, SLOW, TOTAL = range(16, 21)  # SLOW: square of the speed of the slowest element that is tried
LANE_ROWS = TOTAL + 15


@inlined
def place(e, lane, lanes):
    """Where the first row of an element is, in a lane."""
    together = ROW // lanes
    block = e // together
    return block * OWN * ROW + (e - block * together) * lanes + lane


@compiled
def set_velocities(x, body, of, count, lanes):
    """Velocities of a block's elements after the step that is to be tried."""
    for e in range(count):
        for lane in range(lanes):
            i = e * lanes + lane
            dx, dy, turn = of[DX * LANES + lane], of[(DX + 1) * LANES + lane], of[(DX + 2) * LANES + lane]
            c, s, scale = body[C * ROW + i], body[S * ROW + i], of[SCALE * LANES + lane]
            a = body[V * ROW + i] + (c * dx + s * dy + body[R_T * ROW + i] * turn)
            m = body[(V + 1) * ROW + i] + (c * dy - s * dx + body[R_N * ROW + i] * turn)
            w = body[(V + 2) * ROW + i] + body[HALF * ROW + i] * turn
            body[TRIED * ROW + i], body[(TRIED + 1) * ROW + i], body[(TRIED + 2) * ROW + i] = a, m, w
            x[A * ROW + i], x[M * ROW + i], x[W * ROW + i] = a * scale, m * scale, w * scale
            x[EPS * ROW + i], x[BY * ROW + i] = of[NEXT * LANES + lane] * scale, scale
            of[SLOW * LANES + lane] = min(of[SLOW * LANES + lane], a * a + (abs(m) + abs(w)) * (abs(m) + abs(w)))


@compiled
def set_sided(x, bits, whole, body, count, lanes, terms, law, c_t, c_n, rates):
    """The load of a law with shares of the drag across, each side of an element's pivot for itself: `rft.sides`."""
    past = np.empty(5)
    for i in range(count):
        x[WHOLE_M * ROW + i], x[WHOLE_W * ROW + i] = x[M * ROW + i], x[W * ROW + i]
        for j in range(12):
            x[(SUM + j) * ROW + i] = 0.0
    for k in range(2):
        begin_part(x, count, k)
        for i in range(count):
            for j in range(5):
                past[j] = body[(PAST + j) * ROW + i]
            m, w, lane = x[WHOLE_M * ROW + i], x[WHOLE_W * ROW + i], i % lanes
            side = side_of(k, m, w)
            x[SHARE * ROW + i], x[BY_M * ROW + i], x[BY_W * ROW + i] = share(
                past, side, rates[0, lane], rates[1, lane], m, w
            )
        set_plain(x, bits, whole, count, terms, law, c_t, c_n)
        end_part(x, count)
    for i in range(count):
        x[M * ROW + i], x[W * ROW + i] = x[WHOLE_M * ROW + i], x[WHOLE_W * ROW + i]
        for j in range(12):
            x[(LOAD + j) * ROW + i] = x[(SUM + j) * ROW + i]


@compiled
def add_net(x, body, of, count, lanes):
    """Add to TOTAL of every lane what a block's elements do to the frame: force and moment, their tangent with respect to
    velocities over the scale, and sum of J^T H v."""
    for i in range(count * lanes):
        c, s, r_t, r_n, half = (
            body[C * ROW + i], body[S * ROW + i], body[R_T * ROW + i], body[R_N * ROW + i], body[HALF * ROW + i]
        )  # fmt: skip
        a, m, w = body[TRIED * ROW + i], body[(TRIED + 1) * ROW + i], body[(TRIED + 2) * ROW + i]
        weight, by = body[WEIGHT * ROW + i], x[BY * ROW + i]
        to = by * x[(LOAD + 1) * ROW + i], by * x[(LOAD + 2) * ROW + i], by * x[(LOAD + 3) * ROW + i]
        on = by * x[(LOAD + 5) * ROW + i], by * x[(LOAD + 6) * ROW + i], by * x[(LOAD + 7) * ROW + i]
        tw = by * x[(LOAD + 9) * ROW + i], by * x[(LOAD + 10) * ROW + i], by * x[(LOAD + 11) * ROW + i]
        t1, t2 = c * to[0] - s * to[1], s * to[0] + c * to[1]
        n1, n2 = c * on[0] - s * on[1], s * on[0] + c * on[1]
        s1, s2 = c * tw[0] - s * tw[1], s * tw[0] + c * tw[1]
        t3, t4 = r_t * to[0] + r_n * to[1] + half * to[2], to[0] * a + to[1] * m + to[2] * w
        n3, n4 = r_t * on[0] + r_n * on[1] + half * on[2], on[0] * a + on[1] * m + on[2] * w
        s3, s4 = r_t * tw[0] + r_n * tw[1] + half * tw[2], tw[0] * a + tw[1] * m + tw[2] * w
        t0, n0, s0 = x[LOAD * ROW + i], x[(LOAD + 4) * ROW + i], x[(LOAD + 8) * ROW + i]
        c, s, r_t, r_n, half = weight * c, weight * s, weight * r_t, weight * r_n, weight * half
        x[NET * ROW + i], x[(NET + 5) * ROW + i] = c * t0 - s * n0, s * t0 + c * n0
        x[(NET + 1) * ROW + i], x[(NET + 6) * ROW + i] = c * t1 - s * n1, s * t1 + c * n1
        x[(NET + 2) * ROW + i], x[(NET + 7) * ROW + i] = c * t2 - s * n2, s * t2 + c * n2
        x[(NET + 3) * ROW + i], x[(NET + 8) * ROW + i] = c * t3 - s * n3, s * t3 + c * n3
        x[(NET + 4) * ROW + i], x[(NET + 9) * ROW + i] = c * t4 - s * n4, s * t4 + c * n4
        x[(NET + 10) * ROW + i] = r_t * t0 + r_n * n0 + half * s0
        x[(NET + 11) * ROW + i] = r_t * t1 + r_n * n1 + half * s1
        x[(NET + 12) * ROW + i] = r_t * t2 + r_n * n2 + half * s2
        x[(NET + 13) * ROW + i] = r_t * t3 + r_n * n3 + half * s3
        x[(NET + 14) * ROW + i] = r_t * t4 + r_n * n4 + half * s4
    for e in range(count):
        for j in range(15):
            for lane in range(lanes):
                of[(TOTAL + j) * LANES + lane] += x[(NET + j) * ROW + e * lanes + lane]


@compiled
def evaluate(x, bits, whole, body, of, lanes, n, shared, terms, viscous, which, rates, changed):
    """Set TOTAL and SLOW of every lane, at the velocities its next step leads to."""
    for i in range(15 * LANES):
        of[TOTAL * LANES + i] = 0.0
    for lane in range(lanes):
        of[SLOW * LANES + lane] = np.inf
    together = ROW // lanes
    for first in range(0, n, together):
        here, count = body[place(first, 0, lanes) :] if first else body, min(together, n - first)
        set_velocities(x, here, of, count, lanes)
        e = first
        while e < first + count:
            law, end = (which[e, FIRST], which[e, LAST], which[e, POINT]), e + 1
            while (
                end < first + count
                and which[end, FIRST] == law[FIRST]
                and which[end, LAST] == law[LAST]
                and which[end, POINT] == law[POINT]
                and viscous[end, 0] == viscous[e, 0]
                and viscous[end, 1] == viscous[e, 1]
                and (end < shared) == (e < shared)
            ):
                end += 1
            at, some, c_t, c_n = (e - first) * lanes, (end - e) * lanes, viscous[e, 0], viscous[e, 1]
            y, ybits = (x[at:], bits[at:]) if at else (x, bits)  # a view takes as long as an element
            if e < shared:
                set_sided(y, ybits, whole, here[at:], some, lanes, terms, law, c_t, c_n, rates)
            else:
                set_plain(y, ybits, whole, some, terms, law, c_t, c_n)
            e = end
        if changed[0]:
            apply_factors(x, here[FACTORS * ROW :], count * lanes)
        if changed[1]:
            add_square(x, here[SQUARE * ROW :], count * lanes)
        add_net(x, here, of, count, lanes)
