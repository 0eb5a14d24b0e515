"""The kernels of the compiled driver: a vector holds one element of eight samples, or,
where samples are few, eight elements of one.

A sample that has ended gives its place to the next, so that no sample waits for the
slowest. Elements are summed in their order either way, so that the digits of a sample
do not depend on the others. A kernel is compiled once for each class of law records,
from the formulas of `rft.formulas.link`, `rft.formulas.newton` and the law. Importing
this module loads numba.
"""

from __future__ import annotations

import functools
import inspect

import numpy as np
from numba import njit
from numba.extending import register_jitable

from rft.balance.cache import cached
from rft.bodies.base import Elements
from rft.formulas.link import Factor, Incline, Memory, point_load, side_load
from rft.formulas.newton import (
    EVALUATIONS,
    RESIDUAL,
    RESULT_ROWS,
    SLIDING,
    SLOWEST,
    STUCK,
    UNCONVERGED,
    Frame,
    Inertia,
    Iterate,
    Net,
    element_net,
    first_iterate,
    newton_step,
    plus,
    result,
    to_element,
    with_momentum,
)
from rft.formulas.simd import (
    WIDTH,
    add_lanes,
    add_vector,
    any_of,
    load,
    of_one_element,
    record_access,
    register_formulas,
    store,
)
from rft.formulas.vectors import absolute, minimum, where

# First rows of the records of an element.
ELEMENTS = 0  # `Elements`
FACTOR = 9  # `Factor`
QUADRATIC = 12  # quadratic drag
MEMORY = 13  # `Memory`
INCLINE = 23  # `Incline`
ROWS = 28  # number of rows

# First rows of the records of a sample.
ITERATE = 0  # `Iterate`
FRAME = 13  # `Frame`
SPEED = 17  # scale of speed
MASS = 18  # `Inertia`
SAMPLE_ROWS = 31  # number of rows

# Rows of sums: `Net`, then the square of the slowest speed.
SLOWEST2 = 15
SUM_ROWS = 16

WEIGHT = 5  # place in `Elements`
V_T = 6  # place in `Elements`
FORCE_SCALE = 2  # place in `Frame`
SPEED_SCALE = 3  # place in `Frame`
LAW_SPEED = 4  # place after `Frame`
ROUNDING_NEXT = 7  # place in `Iterate`
(read_elements, _), (read_factor, _), (read_memory, _), (read_incline, _) = map(
    record_access, (Elements, Factor, Memory, Incline)
)
(read_iterate, write_iterate), (read_frame, _), (read_mass, _) = map(
    record_access, (Iterate, Frame, Inertia)
)


@register_jitable(forceinline=True)
def fill(rows, first, record, e, lane, i):
    """Write element e and sample i of a record's arrays to a lane; a single row or
    column stands for all, and the last element for those after it."""
    for j in range(len(record)):
        x = record[j]
        rows[first + j, lane] = x[min(e, x.shape[0] - 1), min(i, x.shape[1] - 1)]


@register_jitable
def ceil_divide(a, b):
    """Return a / b, rounded up."""
    return -(-a // b)


@register_jitable
def fill_contact(rows, contact, count, first, last, i):
    """Write the elements of sample i in one contact to the lanes from first to last of
    the rows of vectors, ``count`` elements to a vector; elements in excess have no
    weight."""
    elements, factors, ground, incline = contact
    for k in range(len(rows)):
        for lane in range(first, last):
            e = k * count + (lane - first) % count
            fill(rows[k], ELEMENTS, elements, e, lane, i)
            fill(rows[k], FACTOR, factors, e, lane, i)
            fill(rows[k], QUADRATIC, ground, e, lane, i)
            fill(rows[k], INCLINE, incline, e, lane, i)
            if e >= len(elements[0]) or lane - first >= count:
                rows[k, ELEMENTS + WEIGHT, lane] = 0.0


@register_jitable(forceinline=True)
def add_triple(sums, first, triple, by_elements):
    """Add a triple of vectors to three rows of sums: lane by lane, or, by elements, all
    lanes in turn to the first."""
    for j in range(3):
        if by_elements:
            add_lanes(sums, first + j, triple[j])
        else:
            add_vector(sums, first + j, triple[j])


@register_jitable(forceinline=True)
def net_of(sums):
    """Return the `Net` in the rows of sums."""
    return Net(
        (load(sums, 0), load(sums, 1), load(sums, 2)),
        (load(sums, 3), load(sums, 4), load(sums, 5)),
        (load(sums, 6), load(sums, 7), load(sums, 8)),
        (load(sums, 9), load(sums, 10), load(sums, 11)),
        (load(sums, 12), load(sums, 13), load(sums, 14)),
    )


@functools.cache
def evaluator(Law: type):
    """Return the compiled sum of forces for one class of law records."""
    register_formulas()

    @njit(nogil=True, error_model="numpy", forceinline=True)
    def evaluate(
        law,
        point_terms,
        n_sides,
        rows,
        v,
        v_next,
        iterate,
        speed,
        additions,
        by_elements,
        sums,
    ):
        """Compute the `Net` on the frame after the next step, and the square of the
        slowest element's speed, as the rows of ``sums``; write the velocities of
        elements after that step to v_next.

        n_sides: number of vectors of elements of the sides; those of the points
        follow."""
        rounding = iterate.rounding_next * speed
        slowest2 = 0.0 * speed + np.inf
        sums[:] = 0.0
        for k in range(len(v)):
            element = read_elements(rows[k], ELEMENTS)
            due_to_frame = to_element(element, iterate.dx, iterate.dy, iterate.dtheta)
            u = plus((load(v[k], 0), load(v[k], 1), load(v[k], 2)), due_to_frame)
            store(v_next[k], 0, u[0])
            store(v_next[k], 1, u[1])
            store(v_next[k], 2, u[2])
            scaled = speed * u[0], speed * u[1], speed * u[2]
            factor = read_factor(rows[k], FACTOR)
            incline = read_incline(rows[k], INCLINE)
            if k < n_sides:
                quadratic = load(rows[k], QUADRATIC)
                memory = read_memory(rows[k], MEMORY)
                f = side_load(
                    law, scaled, rounding, factor, incline, quadratic, memory, additions
                )
            else:
                f = point_load(
                    point_terms[k - n_sides],
                    scaled,
                    rounding,
                    factor,
                    incline,
                    additions,
                )
            net = element_net(element, f, u, speed)
            across = absolute(u[1]) + absolute(u[2])
            slowest2 = minimum(slowest2, u[0] * u[0] + across * across)
            add_triple(sums, 0, net.force, by_elements)
            add_triple(sums, 3, net.by_x, by_elements)
            add_triple(sums, 6, net.by_y, by_elements)
            add_triple(sums, 9, net.by_theta, by_elements)
            add_triple(sums, 12, net.by_speed, by_elements)
        store(sums, SLOWEST2, slowest2)
        if by_elements:
            for j in range(SLOWEST2):
                sums[j] = sums[j, 0]
            sums[SLOWEST2] = sums[SLOWEST2].min()

    return evaluate


@functools.cache
def kernel(Law: type):
    """Return the compiled solver for one class of law records."""
    evaluate = evaluator(Law)

    @njit(nogil=True, error_model="numpy")
    def solve(loads, mass, guess, descent, limits, out):
        numbers, sides, points, point_terms, frame, additions = loads
        law = Law(*numbers)
        size = out.shape[1]
        n = len(sides[0][0])
        m = points[0].shape[1]
        vectors_by_elements = size * (ceil_divide(n, WIDTH) + m)
        vectors_by_samples = ceil_divide(size, WIDTH) * (n + m)
        by_elements = vectors_by_elements < vectors_by_samples
        # slots: samples at once. count: elements of one sample in a vector.
        slots = 1 if by_elements else WIDTH
        count = WIDTH if by_elements else 1
        n_sides = ceil_divide(n, count)
        rows = np.ones((n_sides + m, ROWS, WIDTH))
        v = np.zeros((len(rows), 3, WIDTH))
        v_next = np.zeros((len(rows), 3, WIDTH))
        samples = np.ones((SAMPLE_ROWS, WIDTH))
        sums = np.zeros((SUM_ROWS, WIDTH))
        results = np.zeros((RESULT_ROWS + 1, WIDTH))
        sample_of_slot = np.full(slots, -1)
        fresh = guess.shape[1] == 0
        next_sample = 0
        n_ended = 0
        while n_ended < size:
            for slot in range(slots):
                if sample_of_slot[slot] < 0 and next_sample < size:
                    i = next_sample
                    end = WIDTH if by_elements else slot + 1
                    fill_contact(rows[:n_sides], sides, count, slot, end, i)
                    fill_contact(rows[n_sides:], points, 1, slot, end, i)
                    if fresh:
                        first = first_iterate(0.0, 0.0, 0.0, descent.first, 1.0)
                    else:
                        first = first_iterate(
                            guess[0, i], guess[1, i], guess[2, i], descent.first, 0.0
                        )
                    for lane in range(slot, end):
                        for k in range(len(rows)):
                            for j in range(3):
                                v[k, j, lane] = (
                                    rows[k, ELEMENTS + V_T + j, lane]
                                    / frame[SPEED_SCALE][0, i]
                                )
                        fill(samples, FRAME, frame, 0, lane, i)
                        fill(samples, MASS, mass, 0, lane, i)
                        for j in range(len(first)):
                            samples[ITERATE + j, lane] = first[j]
                    sample_of_slot[slot] = i
                    next_sample += 1
            iterate = read_iterate(samples, ITERATE)
            speed = load(samples, SPEED)
            evaluate(
                law,
                point_terms,
                n_sides,
                rows,
                v,
                v_next,
                iterate,
                speed,
                additions,
                by_elements,
                sums,
            )
            net = net_of(sums)
            if additions.momentum:
                x = iterate.x + iterate.dx
                y = iterate.y + iterate.dy
                theta = iterate.theta + iterate.dtheta
                net = with_momentum(net, x, y, theta, read_mass(samples, MASS), speed)
            slowest2 = load(sums, SLOWEST2)
            scales = read_frame(samples, FRAME)
            iterate, accepted, finished = newton_step(
                iterate, net, slowest2, scales, descent, limits
            )
            write_iterate(samples, ITERATE, iterate)
            for k in range(len(rows)):
                for j in range(3):
                    store(v[k], j, where(accepted, load(v_next[k], j), load(v[k], j)))
            if any_of(finished):
                ended = result(iterate, limits)
                for j in range(RESULT_ROWS):
                    store(results, j, ended[j])
                store(results, RESULT_ROWS, where(finished, 1.0, 0.0))
                for slot in range(slots):
                    i = sample_of_slot[slot]
                    if i >= 0 and results[RESULT_ROWS, slot] > 0.0:
                        for j in range(RESULT_ROWS):
                            out[j, i] = results[j, slot]
                        sample_of_slot[slot] = -1
                        n_ended += 1

    return cached(solve, f"the force balance for laws of the form {Law.__name__}")


# Rows of the shape of a chain: the heading of each link, its centre x + i y, the rates
# of these, and the cosine and the sine of the heading.
HEADING, TURN, X, Y, V_X, V_Y, COS, SIN = range(8)
LINK_ROWS = 8  # number of rows
CHAINS_TOGETHER = 1024  # samples whose links are computed before they are solved


@register_jitable
def joint_angle(chain, shape, k):
    """Return joint angle k of a shape, or its rate."""
    if len(chain.modes) == 0:
        return shape[k]
    angle = 0.0
    for j in range(len(shape)):
        angle += chain.modes[j, k] * shape[j]
    return angle


@register_jitable
def joint_speed(chain, rate):
    """Return the size of the joint rates."""
    speed2 = 0.0
    for k in range(len(chain.fractions) - 1):
        angle = joint_angle(chain, rate, k)
        speed2 += angle * angle
    return np.sqrt(speed2)


@register_jitable
def to_frame(chain, rows, j):
    """Subtract the frame's value from the values of the links in a row."""
    # A loop, since an expression with arrays takes seconds more to compile.
    n = rows.shape[1]
    value = 0.0
    if chain.frame_link >= 0:
        value = rows[j, chain.frame_link]
    else:
        for k in range(n):
            value += chain.fractions[k] * rows[j, k]
    for k in range(n):
        rows[j, k] -= value


@register_jitable
def place_links(chain, shape, rows):
    """Write where the links are in the body frame at a shape (joints,) to ``rows``
    (LINK_ROWS, n), as `rft.bodies.Chain` computes it."""
    n = rows.shape[1]
    rows[HEADING, 0] = 0.0
    for k in range(n - 1):
        rows[HEADING, k + 1] = rows[HEADING, k] + joint_angle(chain, shape, k)
    to_frame(chain, rows, HEADING)
    x = y = 0.0  # of the joint between links
    for k in range(n):
        half = 0.5 * chain.fractions[k]
        rows[COS, k] = np.cos(rows[HEADING, k])
        rows[SIN, k] = np.sin(rows[HEADING, k])
        c = half * rows[COS, k]
        s = half * rows[SIN, k]
        rows[X, k] = x + c
        rows[Y, k] = y + s
        x += 2.0 * c
        y += 2.0 * s
    to_frame(chain, rows, X)
    to_frame(chain, rows, Y)


@register_jitable
def move_links(chain, rate, rows):
    """Write the rates of the links that `place_links` has placed, at a rate (joints,)
    of the shape, to ``rows``."""
    n = rows.shape[1]
    rows[TURN, 0] = 0.0
    for k in range(n - 1):
        rows[TURN, k + 1] = rows[TURN, k] + joint_angle(chain, rate, k)
    to_frame(chain, rows, TURN)
    v_x = v_y = 0.0  # of the joint between links
    for k in range(n):
        half = 0.5 * chain.fractions[k]
        c = half * rows[COS, k]
        s = half * rows[SIN, k]
        turn = rows[TURN, k]
        rows[V_X, k] = v_x - turn * s
        rows[V_Y, k] = v_y + turn * c
        v_x -= 2.0 * turn * s
        v_y += 2.0 * turn * c
    to_frame(chain, rows, V_X)
    to_frame(chain, rows, V_Y)


@register_jitable
def link_lever(rows, k):
    """Return r_t and r_n of `Elements` of link k."""
    x = rows[X, k]
    y = rows[Y, k]
    c = rows[COS, k]
    s = rows[SIN, k]
    return x * s - y * c, x * c + y * s


@register_jitable
def link_velocity(rows, k):
    """Return v_t and v_n of `Elements` of link k."""
    c = rows[COS, k]
    s = rows[SIN, k]
    return rows[V_X, k] * c + rows[V_Y, k] * s, rows[V_Y, k] * c - rows[V_X, k] * s


@register_jitable
def write_links(chain, rows, elements, frame, i):
    """Write the links in ``rows`` to column i of the arrays of `Elements`, and the mean
    of their centres to the first two of `Frame`."""
    c, s, r_t, r_n, half, _, v_t, v_n, v_w = elements
    mean_x = 0.0
    mean_y = 0.0
    for k in range(rows.shape[1]):
        c[k, i] = rows[COS, k]
        s[k, i] = rows[SIN, k]
        r_t[k, i], r_n[k, i] = link_lever(rows, k)
        v_t[k, i], v_n[k, i] = link_velocity(rows, k)
        v_w[k, i] = rows[TURN, k] * half[k, 0]
        mean_x += chain.fractions[k] * rows[X, k]
        mean_y += chain.fractions[k] * rows[Y, k]
    frame[0][0, i] = mean_x
    frame[1][0, i] = mean_y


@functools.cache
def chain_kernel(Law: type):
    """Return the compiled solver of chains without effects, from shapes and rates to
    velocities, for one class of law records."""
    solve = kernel(Law)

    @njit(nogil=True, error_model="numpy")
    def velocities(numbers, chain, additions, descent, limits, alpha, alphadot, found):
        """Write the fields of a `Solution` at shapes and rates (B, joints) to arrays,
        and return the number of samples whose joints move, and of those among them
        that the descent leaves unsolved.

        additions: `Additions`, none of which applies."""
        xi, residual, code, evaluations = found
        n = len(chain.fractions)
        size = len(alpha)
        rows = np.empty((LINK_ROWS, n))
        half = np.empty((n, 1))
        weight = np.empty((n, 1))
        for k in range(n):
            half[k, 0] = 0.5 * chain.fractions[k]
            weight[k, 0] = 2.0 * half[k, 0]
        none = np.zeros((0, 1, 1))
        points = np.zeros((9, 0, 1)), none, none, none
        terms = np.zeros((0, 0, 3))
        guess = np.zeros((3, 0))
        moving = np.empty(min(size, CHAINS_TOGETHER), np.int64)
        n_moving = 0
        unsolved = 0
        for first in range(0, size, CHAINS_TOGETHER):
            count = 0
            for i in range(first, min(first + CHAINS_TOGETHER, size)):
                if joint_speed(chain, alphadot[i]) > 0.0:
                    moving[count] = i
                    count += 1
                else:
                    xi[i, 0] = 0.0
                    xi[i, 1] = 0.0
                    xi[i, 2] = 0.0
                    residual[i] = 0.0
                    code[i] = STUCK
                    evaluations[i] = 0
            n_moving += count
            elements = (
                np.empty((n, count)),
                np.empty((n, count)),
                np.empty((n, count)),
                np.empty((n, count)),
                half,
                weight,
                np.empty((n, count)),
                np.empty((n, count)),
                np.empty((n, count)),
            )
            frame = (
                np.empty((1, count)),
                np.empty((1, count)),
                np.empty((1, count)),
                np.empty((1, count)),
                np.empty((1, count)),
            )
            for j in range(count):
                shape = alpha[moving[j]]
                rate = alphadot[moving[j]]
                place_links(chain, shape, rows)
                move_links(chain, rate, rows)
                write_links(chain, rows, elements, frame, j)
                speed = joint_speed(chain, rate)
                above_1 = max(speed - 1.0, 0.0)
                frame[FORCE_SCALE][0, j] = (
                    chain.force
                    + chain.force_by_speed * speed
                    + chain.force_above_1 * above_1
                )
                frame[SPEED_SCALE][0, j] = speed
                frame[LAW_SPEED][0, j] = speed if chain.law_at_speed else 1.0
            out = np.empty((RESULT_ROWS, count))
            sides = elements, none, none, none
            loads = numbers, sides, points, terms, frame, additions
            solve(loads, none, guess, descent, limits, out)
            for j in range(count):
                i = moving[j]
                speed = frame[SPEED_SCALE][0, j]
                xi[i, 0] = out[0, j] * speed * chain.length
                xi[i, 1] = out[1, j] * speed * chain.length
                xi[i, 2] = out[2, j] * speed
                residual[i] = out[RESIDUAL, j]
                evaluations[i] = out[EVALUATIONS, j]
                code[i] = SLIDING
                if out[SLOWEST, j] < chain.stuck_below:
                    code[i] = STUCK
                if not out[RESIDUAL, j] <= limits.residual:
                    code[i] = UNCONVERGED
                    unsolved += 1
        return n_moving, unsolved

    return cached(
        velocities, f"velocities of chains for laws of the form {Law.__name__}"
    )


@functools.cache
def velocity_kernel():
    """Return the compiled velocities of elements at a velocity of the frame."""
    register_formulas()
    element = of_one_element(Elements, len(Elements._fields))

    @njit(nogil=True, error_model="numpy")
    def velocities(elements, xi, out):
        for e in range(out.shape[1]):
            for i in range(out.shape[2]):
                straight = element(elements, e, i)
                v = to_element(straight, xi[0, i], xi[1, i], xi[2, i])
                out[0, e, i] = straight.v_t + v[0]
                out[1, e, i] = straight.v_n + v[1]
                out[2, e, i] = straight.v_w + v[2]

    return cached(velocities, "the velocities of elements")


@functools.cache
def element_kernel(formula):
    """Return the compiled update of numbers of elements by a formula
    (`rft.effects.Effect.element_update`)."""
    register_formulas()
    new_numbers = of_one_element(formula, len(inspect.signature(formula).parameters))

    @njit(nogil=True, error_model="numpy")
    def update(arguments, out):
        for e in range(out.shape[1]):
            for i in range(out.shape[2]):
                new = new_numbers(arguments, e, i)
                for j in range(len(new)):
                    out[j, e, i] = new[j]

    return cached(update, f"the update of an effect by {formula.__name__}")
