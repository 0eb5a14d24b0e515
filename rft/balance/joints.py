"""The kernel of steps of a chain whose joints give way: `rft.motion.compliance` and
`rft.balance.compliant` for one sample after the other, eight links in a vector.
Importing this module loads numba."""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import register_jitable

from rft.balance.cache import cached
from rft.balance.compliant import MOST_GEOMETRIES, SHAPE_TOLERANCE, SHIFT
from rft.balance.kernels import (
    COS,
    LINK_ROWS,
    SIN,
    TURN,
    X,
    Y,
    ceil_divide,
    link_lever,
    link_velocity,
    move_links,
    place_links,
)
from rft.formulas.newton import (
    FASTEST,
    VISCOUS,
    Frame,
    Progress,
    compliant_fraction,
    judge_step,
    progress_after,
    residual_norm,
)
from rft.formulas.simd import WIDTH, load, register_formulas, store, sum_of
from rft.formulas.springs import (
    extrapolated_rate,
    held_shape,
    mixing_weight,
    resistance,
    spring_load,
)
from rft.formulas.vectors import absolute, minimum


class Work(NamedTuple):
    """Arrays to compute in, for P unknowns.

    links: (LINK_ROWS, n), of `rft.balance.kernels`. weight, rounding: of vectors of
    links, (vectors, 8) and (1, 8). columns: (3 P vectors, 8), velocities of links per
    unknown, one unknown after the other. v_start: (3 vectors, 8), velocities of links
    at unknowns of 0. near_...: the same at a neighbouring shape. v, v_next, force,
    by_speed, product: (3 vectors, 8). slope: (9 vectors, 8). y, dy, guess, newton, net,
    net_by_speed: (P,). net_slope: (P, P). shape_slope: (P, m). joint_slope: (E,),
    slopes of the joints' torques. base, fixed, shape, moved, unit: (d,). first,
    reached, change, reached_before, change_before: (m,)."""

    links: np.ndarray
    near_links: np.ndarray
    weight: np.ndarray
    rounding: np.ndarray
    columns: np.ndarray
    near_columns: np.ndarray
    v_start: np.ndarray
    near_v_start: np.ndarray
    v: np.ndarray
    v_next: np.ndarray
    force: np.ndarray
    by_speed: np.ndarray
    product: np.ndarray
    slope: np.ndarray
    y: np.ndarray
    dy: np.ndarray
    guess: np.ndarray
    newton: np.ndarray
    net: np.ndarray
    net_by_speed: np.ndarray
    net_slope: np.ndarray
    shape_slope: np.ndarray
    joint_slope: np.ndarray
    base: np.ndarray
    fixed: np.ndarray
    shape: np.ndarray
    moved: np.ndarray
    unit: np.ndarray
    first: np.ndarray
    reached: np.ndarray
    change: np.ndarray
    reached_before: np.ndarray
    change_before: np.ndarray


NO_LINK = 1e3  # speed, over the scale of speed


@register_jitable
def new_work(n, d, m):
    """Return arrays for n links, d shape variables and m unknown rates."""
    vectors = ceil_divide(n, WIDTH)
    count = 3 + m
    v_start = np.zeros((3 * vectors, WIDTH))
    near_v_start = np.zeros((3 * vectors, WIDTH))
    for k in range(n, vectors * WIDTH):
        # Places behind the last link have no weight, and are never the slowest.
        v_start[3 * (k // WIDTH), k % WIDTH] = NO_LINK
        near_v_start[3 * (k // WIDTH), k % WIDTH] = NO_LINK
    return Work(
        np.zeros((LINK_ROWS, n)),
        np.zeros((LINK_ROWS, n)),
        np.zeros((vectors, WIDTH)),
        np.zeros((1, WIDTH)),
        np.zeros((3 * count * vectors, WIDTH)),
        np.zeros((3 * count * vectors, WIDTH)),
        v_start,
        near_v_start,
        np.zeros((3 * vectors, WIDTH)),
        np.zeros((3 * vectors, WIDTH)),
        np.zeros((3 * vectors, WIDTH)),
        np.zeros((3 * vectors, WIDTH)),
        np.zeros((3 * vectors, WIDTH)),
        np.zeros((9 * vectors, WIDTH)),
        np.zeros(count),
        np.zeros(count),
        np.zeros(count),
        np.zeros(count),
        np.zeros(count),
        np.zeros(count),
        np.zeros((count, count)),
        np.zeros((count, m)),
        np.zeros(n - 1),
        np.zeros(d),
        np.zeros(d),
        np.zeros(d),
        np.zeros(d),
        np.zeros(d),
        np.zeros(m),
        np.zeros(m),
        np.zeros(m),
        np.zeros(m),
        np.zeros(m),
    )


@register_jitable
def column_of(x, i):
    """Return the column of sample i, where one may stand for all."""
    return min(i, x.shape[1] - 1)


@register_jitable
def write_velocities(chain, rows, scale, to, first):
    """Write the velocities of the links in ``rows`` over a scale to vectors from the
    row ``first`` on."""
    for k in range(rows.shape[1]):
        row = first + 3 * (k // WIDTH)
        lane = k % WIDTH
        v_t, v_n = link_velocity(rows, k)
        to[row, lane] = v_t / scale
        to[row + 1, lane] = v_n / scale
        to[row + 2, lane] = rows[TURN, k] * 0.5 * chain.fractions[k] / scale


@register_jitable
def write_geometry(chain, unknown, shape, rate, unit, scale, rows, weight, columns, v):
    """Write velocities and columns of the links at a shape and a rate of the
    prescribed variables, and return the mean of their centres. unit: (d,), zeros."""
    n = rows.shape[1]
    size = len(v)
    place_links(chain, shape, rows)
    move_links(chain, rate, rows)
    write_velocities(chain, rows, scale, v, 0)
    mean_x = 0.0
    mean_y = 0.0
    for k in range(n):
        mean_x += chain.fractions[k] * rows[X, k]
        mean_y += chain.fractions[k] * rows[Y, k]
        row = 3 * (k // WIDTH)
        lane = k % WIDTH
        weight[k // WIDTH, lane] = chain.fractions[k]
        r_t, r_n = link_lever(rows, k)
        columns[row, lane] = rows[COS, k]
        columns[row + 1, lane] = -rows[SIN, k]
        columns[size + row, lane] = rows[SIN, k]
        columns[size + row + 1, lane] = rows[COS, k]
        columns[2 * size + row, lane] = r_t
        columns[2 * size + row + 1, lane] = r_n
        columns[2 * size + row + 2, lane] = 0.5 * chain.fractions[k]
    for u in range(len(unknown)):
        unit[unknown[u]] = 1.0
        move_links(chain, unit, rows)
        unit[unknown[u]] = 0.0
        write_velocities(chain, rows, 1.0, columns, (3 + u) * size)
    return mean_x, mean_y


@register_jitable(forceinline=True)
def contract(columns, first, x):
    """Return the sum of the products of vectors x and as many from the row ``first``
    on."""
    total = load(columns, first) * load(x, 0)
    for row in range(1, len(x)):
        total = total + load(columns, first + row) * load(x, row)
    return sum_of(total)


@register_jitable(forceinline=True)
def times_slope(slope, x, first, to):
    """Write the products of slopes of loads and velocities, in x from the row ``first``
    on, vector by vector."""
    for k in range(len(to) // 3):
        t = load(x, first + 3 * k)
        n = load(x, first + 3 * k + 1)
        turn = load(x, first + 3 * k + 2)
        for a in range(3):
            row = 9 * k + 3 * a
            total = load(slope, row) * t + load(slope, row + 1) * n
            store(to, 3 * k + a, total + load(slope, row + 2) * turn)


@register_jitable
def add_springs(
    springs, i, command, unit, reach, scale, rounding, base, moved, y, dy, net, slopes
):
    """Add the torques of springs and dampers at the unknowns y + dy to forces, as
    `rft.balance.compliant` does, and write their slopes (E,); moved: (d,), the shape
    that these lead to."""
    rows = springs.rows
    unknown = springs.unknown
    m = len(unknown)
    less = np.sqrt(1.0 + rounding * rounding)
    for d in range(len(base)):
        moved[d] = base[d]
    for u in range(m):
        moved[unknown[u]] += reach * scale * (y[3 + u] + dy[3 + u])
    for e in range(len(rows)):
        deviation = -springs.rest[e, 0] - springs.actuated[e, 0] * command[e, i]
        rate = 0.0
        for d in range(len(base)):
            deviation += rows[e, d] * moved[d]
        for u in range(m):
            rate += rows[e, unknown[u]] * (y[3 + u] + dy[3 + u])
        stiffness = springs.stiffness[e, column_of(springs.stiffness, i)]
        damping = springs.damping[e, column_of(springs.damping, i)]
        spring = spring_load(
            deviation, stiffness, springs.low[e, 0], springs.high[e, 0]
        )
        torque, slope = resistance(spring, scale * rate, damping, reach)
        slopes[e] = unit * slope * scale / less
        for u in range(m):
            net[3 + u] += rows[e, unknown[u]] * (unit * torque / less)


@register_jitable
def add_spring_slopes(springs, slopes, net_slope):
    """Add the slopes (E,) of the joints' torques to those of forces."""
    rows = springs.rows
    unknown = springs.unknown
    m = len(unknown)
    for e in range(len(rows)):
        for u in range(m):
            along = rows[e, unknown[u]] * slopes[e]
            if along != 0.0:
                for other in range(m):
                    net_slope[3 + u, 3 + other] += along * rows[e, unknown[other]]


@register_jitable
def sum_slopes(slope, columns, product, net_slope):
    """Write the slopes of forces in the unknowns at one shape."""
    size = len(product)
    for q in range(len(net_slope)):
        times_slope(slope, columns, q * size, product)
        for p in range(len(net_slope)):
            net_slope[p, q] = contract(columns, p * size, product)


@register_jitable
def largest_difference(a, b):
    """Return the largest difference of the numbers of two arrays."""
    largest = 0.0
    for k in range(len(a)):
        largest = max(largest, abs(a[k] - b[k]))
    return largest


@register_jitable
def write_shape_slopes(chain, unknown, reach, scale, y, dy, w):
    """Write the slopes of forces that follow from the shape ``w.shape``, a difference
    of neighbouring shapes, as `rft.balance.compliant.Places` does."""
    size = len(w.v)
    count = len(y)
    factor = reach * scale / SHIFT
    columns, near_columns = w.columns, w.near_columns
    v_start, near_v_start = w.v_start, w.near_v_start
    dv, product, force = w.by_speed, w.product, w.force
    for u in range(len(unknown)):
        d = unknown[u]
        here = w.shape[d]
        w.shape[d] = here + SHIFT
        write_geometry(
            chain, unknown, w.shape, w.fixed, w.unit, scale, w.near_links, w.weight,
            near_columns, near_v_start,
        )  # fmt: skip
        w.shape[d] = here
        for row in range(size):
            total = load(near_v_start, row) - load(v_start, row)
            for p in range(count):
                k = p * size + row
                change = load(near_columns, k) - load(columns, k)
                store(near_columns, k, change)
                total = total + (y[p] + dy[p]) * change
            store(dv, row, total)
        times_slope(w.slope, dv, 0, product)
        for p in range(count):
            there = contract(near_columns, p * size, force)
            total = there + contract(columns, p * size, product)
            w.shape_slope[p, u] = factor * total


@register_jitable
def solve_linear(a, x):
    """Replace ``x`` by the solution of a y = x by Gauss's elimination with row pivots,
    and return the sign of the determinant; 0, and x = 0, if there is none."""
    n = len(x)
    sign = 1.0
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(a[i, k]) > abs(a[best, k]):
                best = i
        pivot = a[best, k]
        if pivot == 0.0 or not np.isfinite(pivot):
            sign = 0.0
            break
        if best != k:
            sign = -sign
            for j in range(k, n):
                a[k, j], a[best, j] = a[best, j], a[k, j]
            x[k], x[best] = x[best], x[k]
        if pivot < 0.0:
            sign = -sign
        for i in range(k + 1, n):
            factor = a[i, k] / pivot
            if factor != 0.0:
                for j in range(k + 1, n):
                    a[i, j] -= factor * a[k, j]
                x[i] -= factor * x[k]
    for k in range(n - 1, -1, -1):
        if sign != 0.0:
            for j in range(k + 1, n):
                x[k] -= a[k, j] * x[j]
            x[k] /= a[k, k]
    is_finite = sign != 0.0
    for k in range(n):
        is_finite = is_finite and np.isfinite(x[k])
    for k in range(n):
        if not is_finite:
            x[k] = 0.0
    return sign


@register_jitable
def largest_residual(net, frame):
    """Return the largest of force, moment and torques over the unit of residuals."""
    size = residual_norm((net[0], net[1], net[2]), frame)
    for u in range(3, len(net)):
        size = max(size, abs(net[u]) / frame.force_scale)
    return size


@register_jitable
def is_below_fastest(y):
    """Return whether all velocities are finite and below FASTEST."""
    is_below = True
    for p in range(len(y)):
        is_below = is_below and abs(y[p]) < FASTEST
    return is_below


@functools.cache
def step_kernel(Law: type):
    """Return the compiled steps for one class of law records."""
    register_formulas()

    @register_jitable(forceinline=True)
    def write_loads(law, speed, rounding, weights, v, scratch, force, slope):
        """Write loads, and their slopes, at velocities of links, and return the slowest
        link's speed."""
        for lane in range(WIDTH):
            scratch[0, lane] = rounding * speed
        wide = load(scratch, 0)
        slowest2 = wide + np.inf
        for k in range(len(weights)):
            u_t = load(v, 3 * k)
            u_n = load(v, 3 * k + 1)
            u_w = load(v, 3 * k + 2)
            f = law.average(speed * u_t, speed * u_n, speed * u_w, wide)
            weight = load(weights, k)
            store(force, 3 * k, weight * f.t)
            store(force, 3 * k + 1, weight * f.n)
            store(force, 3 * k + 2, weight * f.w)
            weight = speed * weight
            store(slope, 9 * k, weight * f.t_t)
            store(slope, 9 * k + 1, weight * f.t_n)
            store(slope, 9 * k + 2, weight * f.t_w)
            store(slope, 9 * k + 3, weight * f.n_t)
            store(slope, 9 * k + 4, weight * f.n_n)
            store(slope, 9 * k + 5, weight * f.n_w)
            store(slope, 9 * k + 6, weight * f.w_t)
            store(slope, 9 * k + 7, weight * f.w_n)
            store(slope, 9 * k + 8, weight * f.w_w)
            across = absolute(u_n) + absolute(u_w)
            slowest2 = minimum(slowest2, u_t * u_t + across * across)
        store(scratch, 0, slowest2)
        least = np.inf
        for lane in range(WIDTH):
            least = min(least, scratch[0, lane])
        return np.sqrt(least)

    @register_jitable
    def descend(
        law, chain, springs, i, command, unit, reach, scales, descent, limits, fresh,
        moves, w,
    ):  # fmt: skip
        """Solve the balance by one descent from the step ``w.dy``, or, if fresh is 1,
        from the viscous solution, and return the residual. The shape is ``w.shape``,
        or, if it moves, the one that its own rates lead to. Velocities are in ``w.y``
        and ``w.v`` then, slopes of loads in ``w.slope``."""
        scale, force_scale, speed = scales
        unknown = springs.unknown
        # Each access of an array in a record counts its references, which takes as long
        # as the formulas.
        columns, weight, scratch = w.columns, w.weight, w.rounding
        v_start, v, v_next = w.v_start, w.v, w.v_next
        force, by_speed, slope = w.force, w.by_speed, w.slope
        y, dy, newton = w.y, w.dy, w.newton
        net, net_by_speed, net_slope = w.net, w.net_by_speed, w.net_slope
        base, shape, moved, joint_slope = w.base, w.shape, w.moved, w.joint_slope
        count = len(y)
        size = len(v)
        x_mean, y_mean = write_geometry(
            chain, unknown, shape, w.fixed, w.unit, scale, w.links, weight, columns,
            v_start,
        )  # fmt: skip
        frame = Frame(x_mean, y_mean, force_scale, scale)
        for p in range(count):
            y[p] = 0.0
        for row in range(size):
            store(v, row, load(v_start, row))
        rounding = VISCOUS if fresh > 0.0 else descent.first
        it = Progress(descent.first, rounding, 1.0, np.inf, 0.0, 0.0, fresh)
        has_shape_slope = False
        while True:
            for p in range(count):
                net[p] = 0.0
            add_springs(
                springs, i, command, unit, reach, scale, it.rounding_next, base, moved,
                y, dy, net, joint_slope,
            )  # fmt: skip
            if moves and largest_difference(moved, shape) > SHAPE_TOLERANCE:
                for d in range(len(shape)):
                    shape[d] = moved[d]
                x_mean, y_mean = write_geometry(
                    chain, unknown, shape, w.fixed, w.unit, scale, w.links, weight,
                    columns, v_start,
                )  # fmt: skip
                frame = Frame(x_mean, y_mean, force_scale, scale)
                for row in range(size):
                    total = load(v_start, row)
                    for p in range(count):
                        total = total + (y[p] + dy[p]) * load(columns, p * size + row)
                    store(v_next, row, total)
            else:
                for row in range(size):
                    total = load(v, row)
                    for p in range(count):
                        total = total + dy[p] * load(columns, p * size + row)
                    store(v_next, row, total)
            slowest = write_loads(
                law, speed, it.rounding_next, weight, v_next, scratch, force, slope
            )
            for p in range(count):
                net[p] += contract(columns, p * size, force)
            residual = largest_residual(net, frame)
            judged = judge_step(it, residual, slowest, descent, limits)
            accepted = judged.accepted
            is_last = accepted and it.rounding_next <= limits.rounding
            it = progress_after(it, residual, slowest, judged, descent)
            solved = is_last and it.residual <= limits.residual
            ended = solved or it.evaluations >= descent.budget
            if accepted or judged.fresh:
                # Slopes are those at the velocities after the step.
                if not ended:
                    sum_slopes(slope, columns, w.product, net_slope)
                    add_spring_slopes(springs, joint_slope, net_slope)
                    if judged.prediction != 0.0:
                        times_slope(slope, v_next, 0, by_speed)
                        for p in range(count):
                            net_by_speed[p] = contract(columns, p * size, by_speed)
                    for p in range(count):
                        forward = judged.prediction * net_by_speed[p]
                        newton[p] = forward - judged.damping * net[p]
                    if moves and not has_shape_slope:
                        write_shape_slopes(chain, unknown, reach, scale, y, dy, w)
                        has_shape_slope = True
                    if moves:
                        for p in range(count):
                            for u in range(count - 3):
                                net_slope[p, 3 + u] += w.shape_slope[p, u]
                    solve_linear(net_slope, newton)
                if accepted:
                    for p in range(count):
                        y[p] += dy[p]
                    for row in range(size):
                        store(v, row, load(v_next, row))
            if ended:
                break
            if accepted or judged.fresh:
                fraction = 1.0
                if not judged.fresh:
                    rates2 = 0.0
                    for p in range(3, count):
                        rates2 += newton[p] * newton[p]
                    largest = limits.largest_step
                    fraction = compliant_fraction(
                        newton[0], newton[1], newton[2], rates2, frame, largest
                    )
                for p in range(count):
                    dy[p] = fraction * newton[p]
            else:
                for p in range(count):
                    dy[p] *= 0.5
        if it.rounding <= limits.rounding and is_below_fastest(y):
            return it.residual
        return np.inf

    @register_jitable
    def solve_at(
        law, chain, springs, i, command, unit, reach, scales, descents, limits, first, w
    ):
        """Solve the balance at the shape ``w.shape`` by the descents from the number
        ``first`` on, the first of all from the velocities ``w.guess``; return the
        residual."""
        residual = np.inf
        for j in range(first, len(descents)):
            for p in range(len(w.y)):
                w.dy[p] = w.guess[p] if j == 0 else 0.0
            residual = descend(
                law, chain, springs, i, command, unit, reach, scales, descents[j],
                limits, 0.0 if j == 0 else 1.0, False, w,
            )  # fmt: skip
            if residual <= limits.residual:
                break
        return residual

    @register_jitable
    def solve_fixed_point(
        law, chain, springs, i, command, unit, reach, scales, descents, limits, w
    ):
        """Solve the balance at one shape after the other, begun at the shape
        ``w.shape``, until it is the one that its own rates lead to; return the
        residual."""
        unknown = springs.unknown
        m = len(unknown)
        for count in range(MOST_GEOMETRIES):
            first = 0 if count > 0 else 1
            residual = solve_at(
                law, chain, springs, i, command, unit, reach, scales, descents, limits,
                first, w,
            )  # fmt: skip
            if not residual <= limits.residual:
                break
            largest = product = square = 0.0
            for u in range(m):
                d = unknown[u]
                w.reached[u] = w.base[d] + reach * scales[0] * w.y[3 + u]
                w.change[u] = w.reached[u] - w.shape[d]
                largest = max(largest, abs(w.change[u]))
                difference = w.change[u] - w.change_before[u]
                product += w.change[u] * difference
                square += difference * difference
            if largest <= SHAPE_TOLERANCE:
                return residual
            weight = mixing_weight(product, square) if count > 0 else 0.0
            for u in range(m):
                step = w.reached[u] - w.reached_before[u]
                w.shape[unknown[u]] = w.reached[u] - weight * step
                w.reached_before[u] = w.reached[u]
                w.change_before[u] = w.change[u]
            for p in range(len(w.y)):
                w.guess[p] = w.y[p]
        return np.inf

    @register_jitable
    def solve_shape(
        law, chain, springs, i, command, unit, reach, scales, moving, descents, limits,
        guessed, w,
    ):  # fmt: skip
        """Solve the balance at the shape that its own rates lead to, from the rates
        ``w.guess``, and, if guessed, from all velocities there; return the residual,
        inf if it is unsolved."""
        unknown = springs.unknown
        m = len(unknown)
        residual = np.inf
        for u in range(m):
            w.first[u] = w.base[unknown[u]] + reach * scales[0] * w.guess[3 + u]
        for attempt in range(0 if guessed else 1, 2):
            for d in range(len(w.base)):
                w.shape[d] = w.base[d]
            for u in range(m):
                w.shape[unknown[u]] = w.first[u]
            if attempt == 1:
                # At this shape, then while it moves.
                solve_at(
                    law, chain, springs, i, command, unit, reach, scales, descents,
                    limits, 1, w,
                )  # fmt: skip
                for p in range(len(w.y)):
                    w.guess[p] = w.y[p]
                for u in range(m):
                    step = reach * scales[0] * w.y[3 + u]
                    w.shape[unknown[u]] = w.base[unknown[u]] + step
            for p in range(len(w.y)):
                w.dy[p] = w.guess[p]
            residual = descend(
                law, chain, springs, i, command, unit, reach, scales, moving, limits,
                0.0, True, w,
            )  # fmt: skip
            if residual <= limits.residual:
                return residual
        for u in range(m):
            w.shape[unknown[u]] = w.first[u]
        return solve_fixed_point(
            law, chain, springs, i, command, unit, reach, scales, descents, limits, w
        )

    @register_jitable
    def take_step(
        law, chain, springs, unit, dt, number, step, i, gait, moving, descents, limits,
        history, w,
    ):  # fmt: skip
        """Write step ``step`` of sample i, which has taken ``number`` steps before, to
        the history; return whether it is solved."""
        unknown = springs.unknown
        scale = gait.scale[step, i]
        shape = history.shape[step + 1]
        before = history.shape[step]
        rate = history.rate[step]
        reach = dt
        if number > 0:
            reach = 2.0 * dt / 3.0
        for d in range(len(w.base)):
            w.base[d] = gait.shape[step, d, i]
            w.fixed[d] = gait.rate[step, d, i]
        for u in range(len(unknown)):
            d = unknown[u]
            guess = w.fixed[d]
            held = shape[d, i]
            if number > 0:
                guess = extrapolated_rate(shape[d, i], before[d, i], rate[d, i], dt)
                held = held_shape(shape[d, i], before[d, i])
            w.base[d] = held + gait.change[step, d, i]
            w.fixed[d] = 0.0
            w.guess[3 + u] = guess / scale
        for p in range(3):
            guess = history.xi[step + 1, p, i]
            if number > 1:
                guess = 2.0 * guess - history.xi[step, p, i]
            w.guess[p] = guess / scale
        command = gait.command[step]
        scales = scale, gait.force_scale[step, i], gait.law_speed[step, i]
        residual = solve_shape(
            law, chain, springs, i, command, unit, reach, scales, moving, descents,
            limits, number > 0, w,
        )  # fmt: skip
        if not residual <= limits.residual:
            return False
        for p in range(3):
            history.xi[step + 2, p, i] = scale * w.y[p]
        for d in range(len(w.base)):
            history.shape[step + 2, d, i] = w.base[d]
            history.rate[step + 1, d, i] = w.fixed[d]
        for u in range(len(unknown)):
            reached = w.base[unknown[u]] + reach * scale * w.y[3 + u]
            history.shape[step + 2, unknown[u], i] = reached
            history.rate[step + 1, unknown[u], i] = scale * w.y[3 + u]
        for k in range(history.v.shape[2]):
            for a in range(3):
                v = w.v[3 * (k // WIDTH) + a, k % WIDTH]
                history.v[step, a, k, i] = scale * v
        history.residual[step, i] = residual
        # Of the slopes at one shape, as by NumPy.
        sum_slopes(w.slope, w.columns, w.product, w.net_slope)
        add_spring_slopes(springs, w.joint_slope, w.net_slope)
        sign = solve_linear(w.net_slope, w.newton)
        history.several[step, i] = 1.0 if sign < 0.0 else 0.0
        return True

    @njit(nogil=True, error_model="numpy")
    def steps(
        numbers,
        chain,
        springs,
        unit,
        dt,
        number,
        gait,
        moving,
        descents,
        limits,
        history,
    ):
        """Take steps after ``number`` others, and return how many are solved for all
        samples.

        springs: `rft.effects.springs.JointSprings` with stiffness 0 of prescribed
        joints. unit: axial drag, in the law's unit of force. moving: the descent
        from a guess while the shape moves. descents: from a guess, then from the
        viscous solution, until one solves a sample at one shape."""
        law = Law(*numbers)
        n = len(chain.fractions)
        w = new_work(n, history.shape.shape[1], len(springs.unknown))
        for step in range(len(gait.scale)):
            for i in range(gait.scale.shape[1]):
                is_solved = take_step(
                    law, chain, springs, unit, dt, number + step, step, i, gait,
                    moving, descents, limits, history, w,
                )  # fmt: skip
                if not is_solved:
                    return step
        return len(gait.scale)

    name = f"steps of joints that give way for laws of the form {Law.__name__}"
    return cached(steps, name)
