"""The compiled driver: eight samples at once, each in a lane of its own; one that has ended gives its lane to the next.

So no sample depends on the others, to the last digit, and none waits for the slowest. A kernel is compiled once for
every form of law, from the formulas of `rft.link`, `rft.balance.newton` and the law. Importing this module loads numba.
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
    begun,
    carried,
    newton_step,
    on_frame,
    plus,
    with_momentum,
)
from rft.bodies.base import Elements
from rft.contact import Problem, mapped
from rft.link import Factor, Incline, Memory, point_load, side_load
from rft.momentum import inertia
from rft.simd import WIDTH, load, record_access, register_formulas, store
from rft.vectors import absolute, minimum, where

# Rows of an element in a lane: `Elements`, `Factor`, square, `Memory`, `Incline`; rows of a sample: `Iterate`, `Frame`,
# speed, `Inertia`.
OWN, FACTOR, SQUARE, MEMORY, INCLINE, ROWS = 0, 9, 12, 13, 20, 25
ITERATE, FRAME, SPEED, MASS, SAMPLE_ROWS = 0, 13, 17, 18, 31
(read_elements, _), (read_factor, _), (read_memory, _), (read_incline, _) = map(
    record_access, (Elements, Factor, Memory, Incline)
)
(read_iterate, write_iterate), (read_frame, _), (read_mass, _) = map(record_access, (Iterate, Frame, Inertia))
DOUBLE = np.dtype(float)
NO_GUESS = np.zeros((3, 0))
NOTHING = np.zeros((0, 1, 1))
NO_TERMS = np.zeros((0, 0, 3))


@register_jitable(forceinline=True)
def fill(rows, first, record, e, lane, i):
    """Write element e of sample i of a record's arrays to a lane; one row, or one column, stands for all."""
    for j in range(len(record)):
        x = record[j]
        rows[first + j, lane] = x[min(e, x.shape[0] - 1), min(i, x.shape[1] - 1)]


@register_jitable(forceinline=True)
def added(a, b):
    """Return the sum of two `Net`."""
    return Net(
        plus(a.force, b.force),
        plus(a.by_x, b.by_x),
        plus(a.by_y, b.by_y),
        plus(a.by_theta, b.by_theta),
        plus(a.drift, b.drift),
    )


@register_jitable(forceinline=True)
def fill_elements(rows, sides, points, ground, inclines, lane, i):
    """Write all elements of sample i to a lane."""
    n = len(sides[0])
    for e in range(n):
        fill(rows[e], OWN, sides, e, lane, i)
        fill(rows[e], SQUARE, ground, e, lane, i)
        fill(rows[e], INCLINE, inclines[0], e, lane, i)
    for e in range(n, len(rows)):
        fill(rows[e], OWN, points, e - n, lane, i)
        fill(rows[e], INCLINE, inclines[1], e - n, lane, i)


@functools.cache
def evaluator(Law: type):
    """Return the compiled sum of forces for laws of one form, which is the class of their records."""
    register_formulas()

    @njit(nogil=True, error_model="numpy", forceinline=True)
    def evaluate(law, point_terms, sides, rows, v, tried, it, speed, acts):
        """Return what loads come to on the frame after the next step, and the square of the slowest element's speed."""
        rounding, zero = it.rounding_next * speed, 0.0 * speed
        nothing = (zero, zero, zero)
        net, slowest2 = Net(nothing, nothing, nothing, nothing, nothing), zero + np.inf
        for e in range(len(v)):
            x = read_elements(rows[e], OWN)
            u = plus((load(v[e], 0), load(v[e], 1), load(v[e], 2)), carried(x, it.dx, it.dy, it.dtheta))
            store(tried[e], 0, u[0])
            store(tried[e], 1, u[1])
            store(tried[e], 2, u[2])
            fast = absolute(u[1]) + absolute(u[2])
            slowest2 = minimum(slowest2, u[0] * u[0] + fast * fast)
            true = speed * u[0], speed * u[1], speed * u[2]
            factor, incline = read_factor(rows[e], FACTOR), read_incline(rows[e], INCLINE)
            if e < sides:
                square, memory = load(rows[e], SQUARE), read_memory(rows[e], MEMORY)
                f = side_load(law, true, rounding, factor, incline, square, memory, acts)
            else:
                f = point_load(point_terms[e - sides], true, rounding, factor, incline, acts)
            net = added(net, on_frame(x, f, u, speed))
        return net, slowest2

    return evaluate


@functools.cache
def kernel(Law: type):
    """Return the compiled solver for laws of one form."""
    evaluate = evaluator(Law)

    @njit(nogil=True, error_model="numpy")
    def solve(numbers, sides, points, point_terms, ground, inclines, frame, mass, guess, descent, limits, acts, out):
        law = Law(*numbers)
        n, m, size = len(sides[0]), len(points[0]), frame[0].shape[1]
        rows, v, tried = np.ones((n + m, ROWS, WIDTH)), np.zeros((n + m, 3, WIDTH)), np.zeros((n + m, 3, WIDTH))
        samples, ended = np.ones((SAMPLE_ROWS, WIDTH)), np.zeros((1, WIDTH))
        who, fresh = np.full(WIDTH, -1), guess.shape[1] == 0
        following, finished = 0, 0
        while finished < size:
            for lane in range(WIDTH):
                if who[lane] < 0 and following < size:
                    i = following
                    fill_elements(rows, sides, points, ground, inclines, lane, i)
                    for e in range(n + m):
                        for j in range(3):
                            v[e, j, lane] = rows[e, OWN + 6 + j, lane] / frame[3][0, i]
                    fill(samples, FRAME, frame, 0, lane, i)
                    fill(samples, MASS, mass, 0, lane, i)
                    dx, dy, dtheta = (0.0, 0.0, 0.0) if fresh else (guess[0, i], guess[1, i], guess[2, i])
                    first = begun(dx, dy, dtheta, descent.first, 1.0 if fresh else 0.0)
                    for j in range(len(first)):
                        samples[ITERATE + j, lane] = first[j]
                    who[lane], following = i, following + 1
            it, scale = read_iterate(samples, ITERATE), load(samples, SPEED)
            net, slowest2 = evaluate(law, point_terms, n, rows, v, tried, it, scale, acts)
            if acts[4]:
                x, y, theta = it.x + it.dx, it.y + it.dy, it.theta + it.dtheta
                net = with_momentum(net, x, y, theta, read_mass(samples, MASS), scale)
            after, accepted, done = newton_step(it, net, slowest2, read_frame(samples, FRAME), descent, limits)
            write_iterate(samples, ITERATE, after)
            for e in range(n + m):
                for j in range(3):
                    store(v[e], j, where(accepted, load(tried[e], j), load(v[e], j)))
            store(ended, 0, where(done, 1.0, 0.0))
            for lane in range(WIDTH):
                i = who[lane]
                if i >= 0 and ended[0, lane] > 0.0:
                    for j in range(3):
                        out[j, i] = samples[ITERATE + j, lane]
                    rounding, residual = samples[ITERATE + 6, lane], samples[ITERATE + 9, lane]
                    out[3, i] = residual if rounding <= limits.last else np.inf
                    out[4, i], out[5, i] = samples[ITERATE + 11, lane], samples[ITERATE + 10, lane]
                    who[lane], finished = -1, finished + 1

    return cached(solve, f"the force balance for laws of the form {Law.__name__}")


@functools.cache
def net_kernel(Law: type):
    """Return the compiled sum of forces at given velocities of all elements, for laws of one form."""
    evaluate = evaluator(Law)

    @njit(nogil=True, error_model="numpy")
    def net_at(numbers, sides, points, point_terms, ground, inclines, frame, v, rounding, acts, out):
        law, n, size = Law(*numbers), len(sides[0]), v.shape[2]
        rows, own = np.ones((v.shape[1], ROWS, WIDTH)), np.zeros((v.shape[1], 3, WIDTH))
        tried, samples, nets = np.zeros_like(own), np.zeros((SAMPLE_ROWS, WIDTH)), np.zeros((15, WIDTH))
        samples[SPEED] = 1.0
        for first in range(0, size, WIDTH):
            count = min(WIDTH, size - first)
            for lane in range(count):
                i = first + lane
                fill_elements(rows, sides, points, ground, inclines, lane, i)
                fill(samples, FRAME, frame, 0, lane, i)
                samples[ITERATE + 7, lane] = rounding[i]
                own[:, :, lane] = v[:, :, i].T
            it = read_iterate(samples, ITERATE)
            net, _ = evaluate(law, point_terms, n, rows, own, tried, it, load(samples, SPEED), acts)
            for j in range(5):
                for k in range(3):
                    store(nets, 3 * j + k, net[j][k])
            out[:, first : first + count] = nets[:, :count]

    return cached(net_at, f"walks along solutions for laws of the form {Law.__name__}")


def plain(x) -> np.ndarray:
    """Return an array (n, B) of doubles, rows one after the other, since code is compiled for these alone."""
    if isinstance(x, np.ndarray) and x.ndim == 2 and x.dtype is DOUBLE and x.flags.carray:
        return x
    return np.array(x, float, order="C", ndmin=2)


def plains(*arrays) -> tuple[np.ndarray, ...]:
    """Return arrays as `plain` does."""
    return tuple([plain(x) for x in arrays])


def stacked(acts: bool, record) -> np.ndarray:
    """Return the arrays of a record as one, (rows, n, B); without rows where it does not act, for speed."""
    return np.array(np.broadcast_arrays(*record), float) if acts else NOTHING


def number_of_law(x) -> np.ndarray | float:
    """Return a number of a law as it is, an array as rows and columns, nodes of a rule one below the other."""
    if np.ndim(x) == 0:
        return float(x)
    return plain(np.reshape(x, (-1, 1)) if np.ndim(x) > 2 else x)


def loads_of(problem: Problem) -> tuple:
    """Return what the loads of a problem follow from, as kernels take it: numbers of the law, sides, points, their
    terms, the ground, how it slopes, and the frame with the scale of speed."""
    p = problem
    sides, points = [plains(*c.elements, *c.factor) for c in (p.sides, p.points)]
    terms = np.ascontiguousarray(np.moveaxis(p.point_terms[..., 0], 2, 0)) if len(p.point_terms) else NO_TERMS
    ground = stacked(p.acts[1] or p.acts[2], (p.square, *p.memory))
    inclines = stacked(p.acts[3], p.sides.incline), stacked(p.acts[3], p.points.incline)
    return tuple(map(number_of_law, p.law)), sides, points, terms, ground, inclines, plains(*p.frame, p.speed)


def nets(problem: Problem, v: np.ndarray, rounding: np.ndarray, xi: np.ndarray) -> np.ndarray:
    """Return the entries of `Net` (5, 3, B) at velocities v (3, n, B) of elements and xi (3, B) of the frame.

    As `rft.balance.arrays.nets`."""
    p, out = problem, np.empty((15, problem.size))
    net_kernel(type(p.law))(*loads_of(p), np.ascontiguousarray(v), rounding, p.acts, out)
    out = out.reshape(5, 3, -1)
    if p.momenta is None:
        return out
    mass = mapped(lambda x: x[0], inertia(p.sides.elements, p.momenta))
    return np.array(with_momentum(Net(*map(tuple, out)), *xi, mass, p.speed[0]))


def solve(problem: Problem, descent: Descent, limits: Limits, guess: np.ndarray | None) -> tuple:
    """Solve all samples by one descent: (xi (3, B) over the scale, residual, evaluations, slowest element's speed).

    As `rft.balance.arrays.solve`.
    """
    p, out = problem, np.empty((6, problem.size))
    heavy = p.momenta is not None
    mass = stacked(heavy, inertia(p.sides.elements, p.momenta) if heavy else ())
    kernel(type(p.law))(
        *loads_of(p),
        mass,
        NO_GUESS if guess is None else plain(guess),
        Descent(*map(float, descent)),
        Limits(*map(float, limits)),
        (*p.acts, heavy),
        out,
    )
    return out[:3], out[3], out[4].astype(int), out[5]
