"""The same balance of forces by programs that know nothing of this package: loops of
SciPy's fsolve and least_squares over midpoints, and a plain loop, compiled by numba,
with the exact integrals. All are of the three-link swimmer in dry grains (Eqs. 2-3), in
the frame of the middle link."""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np
from scipy.optimize import fsolve, least_squares

C = 1.8
GAMMA0 = np.radians(13.8)
TAN2 = np.tan(GAMMA0) ** 2
HALF = 1 / 6  # length of half a link, body lengths
START = (0.02, 0.01, 0.1)  # is not zero, where a link may stand still
ROUNDING = 1e-6  # speed below which dry friction is rounded off
TOLERANCE = 1e-10
NEAR = 0.03  # residual that does for the levels before the last
NARROWER = 0.2  # factor on the rounding from level to level
NODES, WEIGHTS = np.polynomial.legendre.leggauss(5)


def one_scipy_solve(alpha, alphadot, elements=20):
    """Return one balance solved in the plainest way: midpoint elements in the middle
    link's frame, Eqs. 2-3 as printed, fsolve."""
    return fsolve(
        force_on_midpoints(alpha, alphadot, elements), START, full_output=True
    )


def one_least_squares(alpha, alphadot, elements=20):
    """Return the same balance by least_squares, as it is without options."""
    return least_squares(force_on_midpoints(alpha, alphadot, elements), START)


def force_on_midpoints(alpha, alphadot, elements):
    """Return the function of a velocity (3,) that gives force and moment."""
    s = ((np.arange(elements) + 0.5) / elements * 2 - 1) * HALF
    headings = np.array([-alpha[0], 0.0, alpha[1]])
    turns = np.array([-alphadot[0], 0.0, alphadot[1]])
    t = np.stack([np.cos(headings), np.sin(headings)], -1)[:, None]
    n = np.stack([-t[..., 1], t[..., 0]], -1)
    joints = np.array([[-HALF, 0.0], [0.0, 0.0], [HALF, 0.0]])[:, None]
    arms = (s + np.array([-HALF, 0.0, HALF])[:, None])[..., None] * t
    place = joints + arms

    def force(xi):
        spin = xi[2] * np.stack([-place[..., 1], place[..., 0]], -1)
        swing = turns[:, None, None] * np.stack([-arms[..., 1], arms[..., 0]], -1)
        v = xi[:2] + spin + swing
        v = v / (np.sqrt((v**2).sum(-1, keepdims=True)) + 1e-12)
        vn = (v * n).sum(-1, keepdims=True)
        vt = (v * t).sum(-1, keepdims=True)
        f = (1 + C / np.sqrt(TAN2 + vn**2)) * vn * n + vt * t
        moment = place[..., 0] * f[..., 1] - place[..., 1] * f[..., 0]
        return [f[..., 0].sum(), f[..., 1].sum(), moment.sum()]

    return force


def by_fsolve(alpha: np.ndarray, alphadot: np.ndarray) -> np.ndarray:
    """Return the velocities (N, 3) of shapes and rates (N, 2), one after the other."""
    found = [one_scipy_solve(*sample)[0] for sample in zip(alpha, alphadot)]
    return np.array(found)


@functools.cache
def plain_loop() -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    """Return the function of shapes and rates (N, 2) that solves one sample after the
    other, and returns velocities (N, 3); it is compiled at its first call.

    Newton's method with exact slopes, from a wide rounding to the required one, each
    level from the solution of the one before."""
    import numba

    compiled = numba.njit(error_model="numpy")

    @compiled
    def integrals(k2, a, b):
        """Return the integrals of one term over a link, where u = a + b s is the
        velocity across at s and r = sqrt(k2 + u^2): those of u / r, s u / r and 1 / r;
        of k2 / r^3 times 1, s and s^2; of u / r^3 times 1 and s; and of 1 / r^3."""
        if abs(b) * HALF > 0.02 * np.sqrt(k2 + a * a):
            low = a - b * HALF
            high = a + b * HALF
            r_low = np.sqrt(k2 + low * low)
            r_high = np.sqrt(k2 + high * high)
            # arcsinh(high / k) - arcsinh(low / k), with one logarithm.
            p = abs(high) + r_high
            q = abs(low) + r_low
            if high * low > 0:
                log = np.copysign(1.0, high) * np.log(p / q)
            else:
                log = np.copysign(1.0, b) * np.log(p * q / k2)
            sine = high / r_high - low / r_low
            first = (r_high - r_low) / b
            square = 0.5 * (high * r_high - low * r_low - k2 * log)
            second = (square / b - a * first) / b
            slope = sine / b
            u_0 = (1 / r_low - 1 / r_high) / b
            u_1 = ((log - sine) / b - a * u_0) / b
            slope_s = (k2 * u_0 - a * slope) / b
            slope_ss = (k2 * u_1 - a * slope_s) / b
            return (
                *(first, second, log / b),
                *(slope, slope_s, slope_ss),
                *(u_0, u_1, slope / k2),
            )
        # Differences lose digits where the link hardly turns.
        first = second = inverse = slope = slope_s = slope_ss = u_0 = u_1 = cube = 0.0
        for j in range(5):
            s = HALF * NODES[j]
            u = a + b * s
            r2 = k2 + u * u
            weight = HALF * WEIGHTS[j] / np.sqrt(r2)
            first += weight * u
            second += weight * u * s
            inverse += weight
            weight /= r2
            slope += weight * k2
            slope_s += weight * k2 * s
            slope_ss += weight * k2 * s * s
            u_0 += weight * u
            u_1 += weight * u * s
            cube += weight
        return first, second, inverse, slope, slope_s, slope_ss, u_0, u_1, cube

    @compiled
    def force(xi, alpha, alphadot, rounding, out, slopes):
        """Write force and moment on the middle link to ``out``, and their derivatives
        by xi to ``slopes``."""
        out[:] = 0.0
        slopes[:] = 0.0
        sine2 = np.sin(GAMMA0) ** 2
        extra = C * np.cos(GAMMA0)
        for link in range(3):
            side = link - 1.0
            heading = 0.0
            spin = xi[2]
            if link == 0:
                heading = -alpha[0]
                spin -= alphadot[0]
            if link == 2:
                heading = alpha[1]
                spin += alphadot[1]
            c = np.cos(heading)
            s = np.sin(heading)
            # The centre is half a link beyond the joint, which the middle link moves.
            x = side * HALF * (1 + c)
            y = side * HALF * s
            v_x = xi[0] - spin * side * HALF * s
            v_y = xi[1] + xi[2] * side * HALF + spin * side * HALF * c
            v_t = c * v_x + s * v_y
            v_n = c * v_y - s * v_x
            k2 = v_t * v_t + rounding * rounding
            one = integrals(k2, v_n, spin)
            k2 = sine2 * v_t * v_t + rounding * rounding
            two = integrals(k2, v_n, spin)
            load = (v_t * one[2], one[0] + extra * two[0], one[1] + extra * two[1])
            # Rows: by v_t, v_n and spin.
            by = (
                (
                    one[2] - v_t * v_t * one[8],
                    -v_t * (one[6] + extra * sine2 * two[6]),
                    -v_t * (one[7] + extra * sine2 * two[7]),
                ),
                (-v_t * one[6], one[3] + extra * two[3], one[4] + extra * two[4]),
                (-v_t * one[7], one[4] + extra * two[4], one[5] + extra * two[5]),
            )
            # How v_t, v_n and spin change with xi, and so how loads add up.
            change = ((c, s, x * s - y * c), (-s, c, x * c + y * s), (0.0, 0.0, 1.0))
            for p in range(3):
                for i in range(3):
                    out[i] += change[p][i] * load[p]
                for j in range(3):
                    more = 0.0
                    for q in range(3):
                        more += by[q][p] * change[q][j]
                    for i in range(3):
                        slopes[i, j] += change[p][i] * more

    @compiled
    def cross(a, b):
        return (
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        )

    @compiled
    def largest(a):
        return max(abs(a[0]), abs(a[1]), abs(a[2]))

    @compiled
    def solve(alpha, alphadot, xi, rounding, tolerance):
        """Improve xi by Newton's method; return whether it is a solution."""
        now = np.zeros(3)
        step = np.zeros(3)
        other = np.zeros(3)
        slopes = np.zeros((3, 3))
        force(xi, alpha, alphadot, rounding, now, slopes)
        for _ in range(40):
            residual = largest(now)
            if residual < tolerance:
                return True
            first = cross(slopes[1], slopes[2])
            second = cross(slopes[2], slopes[0])
            third = cross(slopes[0], slopes[1])
            determinant = 0.0
            for j in range(3):
                determinant += slopes[0, j] * first[j]
            for j in range(3):
                step[j] = now[0] * first[j] + now[1] * second[j] + now[2] * third[j]
                step[j] /= determinant
            damping = 1.0
            while True:
                for j in range(3):
                    other[j] = xi[j] - damping * step[j]
                force(other, alpha, alphadot, rounding, now, slopes)
                if largest(now) < residual or damping < 1e-3:
                    break
                damping *= 0.5
            xi[:] = other
        return False

    @compiled
    def solve_all(alpha, alphadot):
        found = np.zeros((len(alpha), 3))
        for i in range(len(alpha)):
            speed = np.sqrt((alphadot[i] ** 2).sum())
            xi = found[i]
            level = 1.0
            while level > ROUNDING:
                level = max(NARROWER * level, ROUNDING)
                tolerance = TOLERANCE if level == ROUNDING else NEAR
                if not solve(alpha[i], alphadot[i], xi, level * speed, tolerance):
                    xi[:] = np.nan
                    break
        return found

    return solve_all
