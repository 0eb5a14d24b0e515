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

    Newton's method with slopes by differences, from a wide rounding to the required
    one, each level from the solution of the one before."""
    import numba

    @numba.njit
    def integrals(v_t2, a, b, rounding):
        """Return the integrals over a link of u / |v| and of s u / |v|, and of 1 / |v|,
        where u = a + b s is the velocity across and v_t2 the square of the other."""
        k2 = v_t2 + rounding * rounding
        if abs(b) * HALF > 0.02 * np.sqrt(k2 + a * a):
            low = a - b * HALF
            high = a + b * HALF
            r_low = np.sqrt(k2 + low * low)
            r_high = np.sqrt(k2 + high * high)
            k = np.sqrt(k2)
            log = np.arcsinh(high / k) - np.arcsinh(low / k)
            first = (r_high - r_low) / b
            square = 0.5 * (high * r_high - low * r_low - k2 * log)
            return first, (square / b - a * first) / b, log / b
        # Differences lose digits where the link hardly turns.
        first = 0.0
        second = 0.0
        inverse = 0.0
        for k in range(5):
            u = a + b * HALF * NODES[k]
            weight = HALF * WEIGHTS[k] / np.sqrt(v_t2 + rounding * rounding + u * u)
            first += weight * u
            second += weight * u * HALF * NODES[k]
            inverse += weight
        return first, second, inverse

    @numba.njit
    def force(xi, alpha, alphadot, rounding, out):
        """Write force and moment on the middle link to ``out``."""
        out[:] = 0.0
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
            one, two, zero = integrals(v_t * v_t, v_n, spin, rounding)
            more = integrals(sine2 * v_t * v_t, v_n, spin, rounding)
            f_t = v_t * zero
            f_n = one + extra * more[0]
            f_x = c * f_t - s * f_n
            f_y = s * f_t + c * f_n
            out[0] += f_x
            out[1] += f_y
            out[2] += x * f_y - y * f_x + two + extra * more[1]

    @numba.njit
    def solve(alpha, alphadot, xi, rounding, tolerance):
        """Improve xi by Newton's method; return whether it is a solution."""
        now = np.zeros(3)
        tried = np.zeros(3)
        slopes = np.zeros((3, 3))
        force(xi, alpha, alphadot, rounding, now)
        for _ in range(40):
            if np.abs(now).max() < tolerance:
                return True
            for j in range(3):
                other = xi.copy()
                other[j] += 1e-3 * rounding
                force(other, alpha, alphadot, rounding, tried)
                slopes[:, j] = (tried - now) / (1e-3 * rounding)
            step = np.linalg.solve(slopes, now)
            damping = 1.0
            while True:
                force(xi - damping * step, alpha, alphadot, rounding, tried)
                if np.abs(tried).max() < np.abs(now).max() or damping < 1e-3:
                    break
                damping *= 0.5
            xi -= damping * step
            now[:] = tried
        return False

    @numba.njit
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
