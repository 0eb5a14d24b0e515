"""The kernel of walks along curves of solutions: `rft.balance.path` for one sample
after the other, eight elements in a vector. Importing this module loads numba."""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import register_jitable

from rft.balance.cache import cached
from rft.balance.kernels import (
    ELEMENTS,
    FRAME,
    ITERATE,
    MASS,
    ROUNDING_NEXT,
    ROWS,
    SAMPLE_ROWS,
    SPEED,
    SPEED_SCALE,
    SUM_ROWS,
    V_T,
    ceil_divide,
    evaluator,
    fill,
    fill_contact,
    net_of,
    read_elements,
    read_iterate,
    read_mass,
)
from rft.balance.path import (
    CONVERGED,
    CONVERGED_RATIO,
    DIFFERENCE,
    FINE_STEP,
    FIRST_STEP,
    GROWTH,
    LARGEST_CORRECTION,
    LEAST_DAMPING,
    LOST,
    MOST_AT_THE_END,
    MOST_CORRECTIONS,
    MOST_FINE,
    SHRINKAGE,
    WIDEST,
)
from rft.formulas.newton import (
    VISCOUS,
    Frame,
    is_possible,
    residual_norm,
    solve3,
    to_element,
    to_frame,
    with_momentum,
)
from rft.formulas.simd import WIDTH, load, store


class Point(NamedTuple):
    """A velocity and a rounding. xi: (4,), the velocity of the frame and the rounding.
    v: (vectors, 3, 8), velocities of the elements at xi."""

    xi: np.ndarray
    v: np.ndarray


@register_jitable
def new_point(n_vectors):
    """Return a point without values."""
    return Point(np.zeros(4), np.zeros((n_vectors, 3, WIDTH)))


@register_jitable
def copy_point(point, to):
    """Write a point to another."""
    for j in range(4):
        to.xi[j] = point.xi[j]
    for k in range(len(point.v)):
        for j in range(3):
            for lane in range(WIDTH):
                to.v[k, j, lane] = point.v[k, j, lane]


@register_jitable
def write_rest(rows, speed, point):
    """Write the point at which the frame is at rest; speed: scale of the elements'
    velocities."""
    for j in range(4):
        point.xi[j] = 0.0
    for k in range(len(rows)):
        for j in range(3):
            for lane in range(WIDTH):
                point.v[k, j, lane] = rows[k, ELEMENTS + V_T + j, lane] / speed


@register_jitable
def shift_point(point, rows, change, to):
    """Write the point after a change (4,) of (xi, log rounding) to another."""
    for j in range(3):
        to.xi[j] = point.xi[j] + change[j]
    to.xi[3] = point.xi[3] * np.exp(change[3])
    for k in range(len(rows)):
        e = read_elements(rows[k], ELEMENTS)
        due = to_element(e, change[0], change[1], change[2])
        for j in range(3):
            store(to.v[k], j, load(point.v[k], j) + due[j])


@register_jitable
def write_velocities(e, change, due):
    """Write what a change of the frame's velocity does to elements' velocities, (3, 8),
    to ``due``."""
    triple = to_element(e, change[0], change[1], change[2])
    for j in range(3):
        store(due, j, triple[j])


@register_jitable
def squared_speed(v, lane):
    """Return the square of an element's speed at its faster end."""
    across = abs(v[1, lane]) + abs(v[2, lane])
    return v[0, lane] * v[0, lane] + across * across


@register_jitable
def size_of(point, rows, change, due):
    """Return the size of a change at a point, as `rft.balance.path` defines it; nan
    where it is no number. due: (3, 8), to write to."""
    rounding2 = point.xi[3] * point.xi[3]
    largest = 0.0
    for k in range(len(rows)):
        e = read_elements(rows[k], ELEMENTS)
        write_velocities(e, change, due)
        for lane in range(WIDTH):
            square = 0.0
            for j in range(3):
                square += due[j, lane] * due[j, lane]
            square /= squared_speed(point.v[k], lane) + rounding2
            if not square <= largest:
                largest = square
    size = np.sqrt(largest)
    if not abs(change[3]) <= size:
        size = abs(change[3])
    return size if np.isfinite(largest) else np.nan


@register_jitable
def slowest_of(point):
    """Return the speed of the slowest element."""
    least = np.inf
    for k in range(len(point.v)):
        for lane in range(WIDTH):
            least = min(least, squared_speed(point.v[k], lane))
    return np.sqrt(least)


@register_jitable
def solve4(matrix, right, work, x):
    """Write the solution of matrix (4, 4) x = right (4,) to x; nan where the matrix is
    singular or no number. work: (4, 5), to write to."""
    for i in range(4):
        for j in range(4):
            work[i, j] = matrix[i, j]
        work[i, 4] = right[i]
    for j in range(4):
        largest = j
        for i in range(j + 1, 4):
            if abs(work[i, j]) > abs(work[largest, j]):
                largest = i
        if not abs(work[largest, j]) > 0.0:
            for i in range(4):
                x[i] = np.nan
            return
        for k in range(j, 5):
            held = work[j, k]
            work[j, k] = work[largest, k]
            work[largest, k] = held
        for i in range(j + 1, 4):
            ratio = work[i, j] / work[j, j]
            for k in range(j, 5):
                work[i, k] -= ratio * work[j, k]
    for i in range(3, -1, -1):
        value = work[i, 4]
        for j in range(i + 1, 4):
            value -= work[i, j] * x[j]
        x[i] = value / work[i, i]


@register_jitable
def write_border(point, rows, tangent, due, border):
    """Write the row of the tangent in the metric of changes at a point."""
    rounding2 = point.xi[3] * point.xi[3]
    for j in range(3):
        border[j] = 0.0
    border[3] = tangent[3]
    for k in range(len(rows)):
        e = read_elements(rows[k], ELEMENTS)
        write_velocities(e, tangent, due)
        for lane in range(WIDTH):
            scale = squared_speed(point.v[k], lane) + rounding2
            for j in range(3):
                due[j, lane] /= scale
        t = e.weight * load(due, 0)
        n = e.weight * load(due, 1)
        w = e.weight * load(due, 2)
        wrench = to_frame(e, t, n, w)
        for j in range(3):
            store(due, j, wrench[j])
        for lane in range(WIDTH):
            for j in range(3):
                border[j] += due[j, lane]


@register_jitable
def write_viscous(sums, change):
    """Write the change from rest to the viscous solution, from force, moment and slopes
    in the first column of ``sums``."""
    xi = solve3(
        (sums[3, 0], sums[4, 0], sums[5, 0]),
        (sums[6, 0], sums[7, 0], sums[8, 0]),
        (sums[9, 0], sums[10, 0], sums[11, 0]),
        (-sums[0, 0], -sums[1, 0], -sums[2, 0]),
    )
    for j in range(3):
        change[j] = xi[j]
    change[3] = 0.0


@register_jitable
def predict(base, tangent, step, last_rounding, change):
    """Write the change from the base by a step along the tangent, which is straight in
    (xi, rounding), and return whether it reaches the required rounding."""
    slope = tangent[3]
    rounding = base.xi[3] * np.exp(min(max(step * slope, -100.0), 5.0))
    reaches_last = rounding <= last_rounding
    if reaches_last:
        rounding = last_rounding
    ratio = rounding / base.xi[3]
    length = step
    if abs(slope) >= 1e-9:
        length = (ratio - 1.0) / slope
    for j in range(3):
        change[j] = tangent[j] * length
    change[3] = np.log(ratio)
    return reaches_last


@register_jitable
def most_corrections(reaches_last, is_fine):
    """Return after how many corrections a step has failed."""
    if is_fine:
        return MOST_FINE
    if reaches_last:
        return MOST_AT_THE_END
    return MOST_CORRECTIONS


@register_jitable
def next_step(step, factor, failed, on_curve):
    """Return the length of the next step; factor: that by which the first correction
    asks to change it."""
    if on_curve:
        return step * min(max(factor, 1.0 / GROWTH), GROWTH)
    if failed:
        return step * min(max(factor, 0.1), SHRINKAGE)
    return step


@functools.cache
def walk_kernel(Law: type):
    """Return the compiled walk for one class of law records."""
    evaluate = evaluator(Law)

    @njit(nogil=True, error_model="numpy")
    def write_net(
        law, point_terms, n_sides, rows, point, rounding, samples, additions, v, sums
    ):
        """Write force and moment on the frame at a point, with their slopes, to the
        first column of ``sums``. v: as those of the point, to write to."""
        for lane in range(WIDTH):
            samples[ITERATE + ROUNDING_NEXT, lane] = rounding
        iterate = read_iterate(samples, ITERATE)
        speed = load(samples, SPEED)
        evaluate(
            law,
            point_terms,
            n_sides,
            rows,
            point.v,
            v,
            iterate,
            speed,
            additions,
            True,
            sums,
        )
        if additions.momentum:
            mass = read_mass(samples, MASS)
            x, y, theta = point.xi[0], point.xi[1], point.xi[2]
            net = with_momentum(net_of(sums), x, y, theta, mass, speed)
            for j in range(3):
                store(sums, j, net.force[j])
                store(sums, 3 + j, net.by_x[j])
                store(sums, 6 + j, net.by_y[j])
                store(sums, 9 + j, net.by_theta[j])

    @njit(nogil=True, error_model="numpy")
    def walk(loads, mass, is_scale_free, limits, intended, budget, out):
        """Write the results of all samples, the rows of `rft.formulas.newton.result`,
        with an infinite residual where the budget is spent or the curve is lost.

        is_scale_free: whether drag stays if velocities and rounding double. intended:
        size of the first correction of a step, by which the length of steps is
        chosen."""
        numbers, sides, points, point_terms, frame, additions = loads
        law = Law(*numbers)
        last_rounding = limits.rounding
        n_sides = ceil_divide(len(sides[0][0]), WIDTH)
        n_vectors = n_sides + points[0].shape[1]
        rows = np.ones((n_vectors, ROWS, WIDTH))
        samples = np.zeros((SAMPLE_ROWS, WIDTH))
        sums = np.zeros((SUM_ROWS, WIDTH))
        v = np.zeros((n_vectors, 3, WIDTH))
        due = np.zeros((3, WIDTH))
        work = np.zeros((4, 5))
        base = new_point(n_vectors)  # the last point on the curve
        point = new_point(n_vectors)  # before the change that is tried
        new = new_point(n_vectors)  # after it
        tangent = np.zeros(4)  # at the base, of size 1
        border = np.zeros(4)  # its row in the metric
        change = np.zeros(4)  # tried from the point
        correction = np.zeros(4)
        new_tangent = np.zeros(4)
        matrix = np.zeros((4, 4))
        old_matrix = np.zeros((4, 4))  # with which the change was solved
        right = np.zeros(4)
        simplified = np.zeros(4)
        unit = np.zeros(4)
        unit[3] = 1.0
        force = np.zeros(3)
        for i in range(out.shape[1]):
            fill_contact(rows[:n_sides], sides, WIDTH, 0, WIDTH, i)
            fill_contact(rows[n_sides:], points, 1, 0, WIDTH, i)
            for lane in range(WIDTH):
                fill(samples, FRAME, frame, 0, lane, i)
                fill(samples, MASS, mass, 0, lane, i)
            scales = Frame(
                samples[FRAME, 0],
                samples[FRAME + 1, 0],
                samples[FRAME + 2, 0],
                samples[FRAME + SPEED_SCALE, 0],
            )

            # The viscous solution, with a first step towards less rounding.
            write_rest(rows, scales.speed_scale, point)
            write_net(
                law,
                point_terms,
                n_sides,
                rows,
                point,
                VISCOUS,
                samples,
                additions,
                v,
                sums,
            )
            write_viscous(sums, change)
            for j in range(4):
                tangent[j] = -unit[j]
                border[j] = -unit[j]
            shift_point(point, rows, change, base)
            base.xi[3] = max(WIDEST, last_rounding)
            step = FIRST_STEP
            evaluations = 1
            damping = 1.0
            size = 0.0  # of the undamped correction in the change
            first_size = 0.0  # of the first correction since the base
            corrections = 0  # number of them
            reaches_last = False  # whether the step reaches the required rounding
            from_base = True

            while True:
                if from_base:
                    reaches_last = predict(base, tangent, step, last_rounding, change)
                    copy_point(base, point)
                    damping = 1.0
                    corrections = 0

                shift_point(point, rows, change, new)
                if reaches_last:
                    new.xi[3] = last_rounding
                write_net(
                    law,
                    point_terms,
                    n_sides,
                    rows,
                    new,
                    new.xi[3],
                    samples,
                    additions,
                    v,
                    sums,
                )
                evaluations += 1
                for j in range(3):
                    force[j] = sums[j, 0]
                    right[j] = -force[j]
                    for k in range(3):
                        matrix[j, k] = sums[3 + 3 * k + j, 0]
                    matrix[j, 3] = -sums[12 + j, 0]
                residual = residual_norm((force[0], force[1], force[2]), scales)
                if not is_scale_free:
                    write_net(
                        law,
                        point_terms,
                        n_sides,
                        rows,
                        new,
                        (1.0 + DIFFERENCE) * new.xi[3],
                        samples,
                        additions,
                        v,
                        sums,
                    )
                    evaluations += 1
                    for j in range(3):
                        matrix[j, 3] = (sums[j, 0] - force[j]) / DIFFERENCE
                solved = reaches_last and residual <= limits.residual
                if solved or evaluations >= budget:
                    break

                # Accept or refuse the new point, and choose the next change.
                for j in range(4):
                    matrix[3, j] = unit[j] if reaches_last else border[j]
                solve4(matrix, right, work, correction)
                solve4(matrix, unit, work, new_tangent)
                new_size = size_of(new, rows, correction, due)
                first = corrections == 0
                is_fine = step < FINE_STEP
                smaller = first or damping <= LEAST_DAMPING
                if first:
                    first_size = new_size
                else:
                    # Natural monotonicity: with the previous matrix, a correction must
                    # be smaller by about half the damping.
                    solve4(old_matrix, right, work, simplified)
                    limit = (1.0 - 0.5 * damping) * size
                    smaller |= size_of(point, rows, simplified, due) <= limit
                most = most_corrections(reaches_last, is_fine)
                failed = not np.isfinite(new_size)
                failed |= first and new_size > LARGEST_CORRECTION
                failed |= not (smaller or is_fine) or corrections >= most
                enough = max(CONVERGED_RATIO * size, CONVERGED)
                on_curve = not failed and smaller and not first and not reaches_last
                on_curve &= damping == 1.0 and new_size <= enough
                corrections += 1
                if not failed and not on_curve:
                    if smaller:
                        damping = 1.0 if first else min(1.0, 2.0 * damping)
                        for j in range(4):
                            change[j] = damping * correction[j]
                            for k in range(4):
                                old_matrix[j, k] = matrix[j, k]
                        copy_point(new, point)
                        size = new_size
                    else:
                        damping *= 0.5
                        for j in range(4):
                            change[j] *= 0.5
                    change[3] = min(max(change[3], -1.0), 1.0)
                if on_curve:
                    shift_point(new, rows, correction, base)
                    length = size_of(base, rows, new_tangent, due)
                    for j in range(4):
                        tangent[j] = new_tangent[j] / length
                    write_border(base, rows, tangent, due, border)
                factor = np.sqrt(intended / 1e-9)
                if first_size > 1e-9:
                    factor = np.sqrt(intended / first_size)
                step = next_step(step, factor, failed, on_curve)
                from_base = failed or on_curve
                if base.xi[3] > LOST * max(WIDEST, last_rounding):
                    break

            valid = solved and is_possible(new.xi[0], new.xi[1], new.xi[2])
            for j in range(3):
                out[j, i] = new.xi[j]
            out[3, i] = residual if valid else np.inf
            out[4, i] = evaluations
            out[5, i] = slowest_of(new)

    return cached(walk, f"walks along solutions for laws of the form {Law.__name__}")
