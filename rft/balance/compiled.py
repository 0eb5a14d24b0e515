"""The compiled driver: eight samples at once, each in a lane of a vector; a lane whose sample has ended takes the next.

So the digits of a sample do not depend on the others, and no sample waits for the slowest. A kernel is compiled once for
each class of law records, from the formulas of `rft.link`, `rft.balance.newton` and the law. Importing this module loads
numba.
"""

from __future__ import annotations

import functools

import numpy as np
from numba import njit
from numba.extending import register_jitable

from rft.balance.cache import cached
from rft.balance.newton import (
    Descent,
    Frame,
    Inertia,
    Iterate,
    Limits,
    Net,
    element_net,
    first_iterate,
    newton_step,
    plus,
    to_element,
    with_momentum,
)
from rft.bodies.base import Elements
from rft.contact import Problem, mapped
from rft.link import Factor, Incline, Memory, point_load, side_load
from rft.momentum import frame_inertia
from rft.simd import WIDTH, load, record_access, register_formulas, store
from rft.vectors import absolute, minimum, where

# First rows of the records of an element: `Elements`, `Factor`, quadratic drag, `Memory`, `Incline`; of the records of a
# sample: `Iterate`, `Frame`, scale of speed, `Inertia`.
ELEMENTS, FACTOR, QUADRATIC, MEMORY, INCLINE, ROWS = 0, 9, 12, 13, 20, 25
ITERATE, FRAME, SPEED, MASS, SAMPLE_ROWS = 0, 13, 17, 18, 31
V_T, SPEED_SCALE = 6, 3  # places of v_t in `Elements`, of speed_scale in `Frame`
ROUNDING, ROUNDING_NEXT, RESIDUAL, SLOWEST, EVALUATIONS = 6, 7, 9, 10, 11  # places in `Iterate`
(read_elements, _), (read_factor, _), (read_memory, _), (read_incline, _) = map(
    record_access, (Elements, Factor, Memory, Incline)
)
(read_iterate, write_iterate), (read_frame, _), (read_mass, _) = map(record_access, (Iterate, Frame, Inertia))
DOUBLE = np.dtype(float)
NO_GUESS = np.zeros((3, 0))
NO_ROWS = np.zeros((0, 1, 1))
NO_TERMS = np.zeros((0, 0, 3))


@register_jitable(forceinline=True)
def fill(rows, first, record, e, lane, i):
    """Write element e and sample i of a record's arrays to a lane; a single row or column stands for all."""
    for j in range(len(record)):
        x = record[j]
        rows[first + j, lane] = x[min(e, x.shape[0] - 1), min(i, x.shape[1] - 1)]


@register_jitable(forceinline=True)
def sum_nets(a, b):
    """Return the sum of two `Net`."""
    return Net(
        plus(a.force, b.force),
        plus(a.by_x, b.by_x),
        plus(a.by_y, b.by_y),
        plus(a.by_theta, b.by_theta),
        plus(a.by_speed, b.by_speed),
    )


@register_jitable(forceinline=True)
def fill_elements(rows, sides, points, ground, inclines, lane, i):
    """Write all elements of sample i to a lane."""
    n = len(sides[0])
    for e in range(n):
        fill(rows[e], ELEMENTS, sides, e, lane, i)
        fill(rows[e], QUADRATIC, ground, e, lane, i)
        fill(rows[e], INCLINE, inclines[0], e, lane, i)
    for e in range(n, len(rows)):
        fill(rows[e], ELEMENTS, points, e - n, lane, i)
        fill(rows[e], INCLINE, inclines[1], e - n, lane, i)


@functools.cache
def evaluator(Law: type):
    """Return the compiled sum of forces for one class of law records."""
    register_formulas()

    @njit(nogil=True, error_model="numpy", forceinline=True)
    def evaluate(law, point_terms, n_sides, rows, v, v_next, iterate, speed, additions):
        """Return the `Net` on the frame after the next step, and the square of the slowest element's speed; write the
        velocities of elements after that step to v_next."""
        rounding, zero = iterate.rounding_next * speed, 0.0 * speed
        zeros = (zero, zero, zero)
        net, slowest2 = Net(zeros, zeros, zeros, zeros, zeros), zero + np.inf
        for e in range(len(v)):
            element = read_elements(rows[e], ELEMENTS)
            due_to_frame = to_element(element, iterate.dx, iterate.dy, iterate.dtheta)
            u = plus((load(v[e], 0), load(v[e], 1), load(v[e], 2)), due_to_frame)
            store(v_next[e], 0, u[0])
            store(v_next[e], 1, u[1])
            store(v_next[e], 2, u[2])
            across = absolute(u[1]) + absolute(u[2])
            slowest2 = minimum(slowest2, u[0] * u[0] + across * across)
            scaled = speed * u[0], speed * u[1], speed * u[2]
            factor, incline = read_factor(rows[e], FACTOR), read_incline(rows[e], INCLINE)
            if e < n_sides:
                quadratic, memory = load(rows[e], QUADRATIC), read_memory(rows[e], MEMORY)
                f = side_load(law, scaled, rounding, factor, incline, quadratic, memory, additions)
            else:
                f = point_load(point_terms[e - n_sides], scaled, rounding, factor, incline, additions)
            net = sum_nets(net, element_net(element, f, u, speed))
        return net, slowest2

    return evaluate


@functools.cache
def kernel(Law: type):
    """Return the compiled solver for one class of law records."""
    evaluate = evaluator(Law)

    @njit(nogil=True, error_model="numpy")
    def solve(
        numbers, sides, points, point_terms, ground, inclines, frame, mass, guess, descent, limits, additions, out
    ):
        law = Law(*numbers)
        n, m, size = len(sides[0]), len(points[0]), frame[0].shape[1]
        rows, v, v_next = np.ones((n + m, ROWS, WIDTH)), np.zeros((n + m, 3, WIDTH)), np.zeros((n + m, 3, WIDTH))
        samples, ended = np.ones((SAMPLE_ROWS, WIDTH)), np.zeros((1, WIDTH))
        sample_of_lane, fresh = np.full(WIDTH, -1), guess.shape[1] == 0
        next_sample, n_ended = 0, 0
        while n_ended < size:
            for lane in range(WIDTH):
                if sample_of_lane[lane] < 0 and next_sample < size:
                    i = next_sample
                    fill_elements(rows, sides, points, ground, inclines, lane, i)
                    for e in range(n + m):
                        for j in range(3):
                            v[e, j, lane] = rows[e, ELEMENTS + V_T + j, lane] / frame[SPEED_SCALE][0, i]
                    fill(samples, FRAME, frame, 0, lane, i)
                    fill(samples, MASS, mass, 0, lane, i)
                    dx, dy, dtheta = (0.0, 0.0, 0.0) if fresh else (guess[0, i], guess[1, i], guess[2, i])
                    first = first_iterate(dx, dy, dtheta, descent.first, 1.0 if fresh else 0.0)
                    for j in range(len(first)):
                        samples[ITERATE + j, lane] = first[j]
                    sample_of_lane[lane], next_sample = i, next_sample + 1
            iterate, speed = read_iterate(samples, ITERATE), load(samples, SPEED)
            net, slowest2 = evaluate(law, point_terms, n, rows, v, v_next, iterate, speed, additions)
            if additions.momentum:
                x, y, theta = iterate.x + iterate.dx, iterate.y + iterate.dy, iterate.theta + iterate.dtheta
                net = with_momentum(net, x, y, theta, read_mass(samples, MASS), speed)
            after, accepted, finished = newton_step(iterate, net, slowest2, read_frame(samples, FRAME), descent, limits)
            write_iterate(samples, ITERATE, after)
            for e in range(n + m):
                for j in range(3):
                    store(v[e], j, where(accepted, load(v_next[e], j), load(v[e], j)))
            store(ended, 0, where(finished, 1.0, 0.0))
            for lane in range(WIDTH):
                i = sample_of_lane[lane]
                if i >= 0 and ended[0, lane] > 0.0:
                    for j in range(3):
                        out[j, i] = samples[ITERATE + j, lane]
                    rounding, residual = samples[ITERATE + ROUNDING, lane], samples[ITERATE + RESIDUAL, lane]
                    out[3, i] = residual if rounding <= limits.rounding else np.inf
                    out[4, i], out[5, i] = samples[ITERATE + EVALUATIONS, lane], samples[ITERATE + SLOWEST, lane]
                    sample_of_lane[lane], n_ended = -1, n_ended + 1

    return cached(solve, f"the force balance for laws of the form {Law.__name__}")


@functools.cache
def net_kernel(Law: type):
    """Return the compiled sum of forces at given velocities of all elements, for one class of law records."""
    evaluate = evaluator(Law)

    @njit(nogil=True, error_model="numpy")
    def net_at(numbers, sides, points, point_terms, ground, inclines, frame, v, rounding, additions, out):
        law, n, size = Law(*numbers), len(sides[0]), v.shape[2]
        rows, v_lanes = np.ones((v.shape[1], ROWS, WIDTH)), np.zeros((v.shape[1], 3, WIDTH))
        v_next, samples, nets = np.zeros_like(v_lanes), np.zeros((SAMPLE_ROWS, WIDTH)), np.zeros((15, WIDTH))
        samples[SPEED] = 1.0
        for first in range(0, size, WIDTH):
            count = min(WIDTH, size - first)
            for lane in range(count):
                i = first + lane
                fill_elements(rows, sides, points, ground, inclines, lane, i)
                fill(samples, FRAME, frame, 0, lane, i)
                samples[ITERATE + ROUNDING_NEXT, lane] = rounding[i]
                v_lanes[:, :, lane] = v[:, :, i].T
            iterate = read_iterate(samples, ITERATE)
            net, _ = evaluate(law, point_terms, n, rows, v_lanes, v_next, iterate, load(samples, SPEED), additions)
            for j in range(5):
                for k in range(3):
                    store(nets, 3 * j + k, net[j][k])
            out[:, first : first + count] = nets[:, :count]

    return cached(net_at, f"walks along solutions for laws of the form {Law.__name__}")


def plain(x) -> np.ndarray:
    """Return an array (n, B) of doubles in C order, the only form that kernels are compiled for."""
    if isinstance(x, np.ndarray) and x.ndim == 2 and x.dtype is DOUBLE and x.flags.carray:
        return x
    return np.array(x, float, order="C", ndmin=2)


def plain_arrays(*arrays) -> tuple[np.ndarray, ...]:
    """Return each array as `plain` does."""
    return tuple([plain(x) for x in arrays])


def stacked(applies: bool, record) -> np.ndarray:
    """Return the arrays of a record as one array (rows, n, B); without rows, for speed, where the record does not
    apply."""
    return np.array(np.broadcast_arrays(*record), float) if applies else NO_ROWS


def kernel_number(x) -> np.ndarray | float:
    """Return a number of a law as a float, an array as two-dimensional, the nodes of a rule as a column."""
    if np.ndim(x) == 0:
        return float(x)
    return plain(np.reshape(x, (-1, 1)) if np.ndim(x) > 2 else x)


def load_arguments(problem: Problem) -> tuple:
    """Return the arguments of kernels that describe the loads of a problem: numbers of the law, sides, points, dry terms
    of the points, memory and quadratic drag of the ground, inclines, and the frame with the scale of speed."""
    p, additions = problem, problem.additions
    sides, points = [plain_arrays(*c.elements, *c.factor) for c in (p.sides, p.points)]
    terms = np.ascontiguousarray(np.moveaxis(p.point_terms[..., 0], 2, 0)) if len(p.point_terms) else NO_TERMS
    ground = stacked(additions.quadratic or additions.memory, (p.quadratic_drag, *p.memory))
    inclines = tuple(stacked(additions.incline, c.incline) for c in (p.sides, p.points))
    frame = plain_arrays(*p.frame, p.law_speed_scale)
    return tuple(map(kernel_number, p.law)), sides, points, terms, ground, inclines, frame


def nets(problem: Problem, v: np.ndarray, rounding: np.ndarray, xi: np.ndarray) -> np.ndarray:
    """Return the entries of `Net` as `rft.balance.arrays.nets` does."""
    p, out = problem, np.empty((15, problem.n_samples))
    net_kernel(type(p.law))(*load_arguments(p), np.ascontiguousarray(v), rounding, p.additions, out)
    out = out.reshape(5, 3, -1)
    if p.momentum_rate is None:
        return out
    mass = mapped(lambda x: x[0], frame_inertia(p.sides.elements, p.momentum_rate))
    return np.array(with_momentum(Net(*map(tuple, out)), *xi, mass, p.law_speed_scale[0]))


def solve(problem: Problem, descent: Descent, limits: Limits, guess: np.ndarray | None) -> tuple:
    """Solve all samples by one descent as `rft.balance.arrays.solve` does."""
    p, out = problem, np.empty((6, problem.n_samples))
    has_mass = p.momentum_rate is not None
    mass = stacked(has_mass, frame_inertia(p.sides.elements, p.momentum_rate) if has_mass else ())
    kernel(type(p.law))(
        *load_arguments(p),
        mass,
        NO_GUESS if guess is None else plain(guess),
        Descent(*map(float, descent)),
        Limits(*map(float, limits)),
        p.additions,
        out,
    )
    return out[:3], out[3], out[4].astype(int), out[5]
