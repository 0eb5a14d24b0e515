"""The balance of forces of the three-link swimmer in dry grains (Eqs. 2-3) by a plain
loop, as somebody would write it for this body alone: exact integrals, Newton's method
from a wide rounding to the required one, each level from the solution of the one
before. Importing this module loads numba, which compiles the loop at its first call."""

from __future__ import annotations

import numba
import numpy as np

from figures.peers import GAMMA0, HALF, C

ROUNDING = 1e-6  # speed below which dry friction is rounded off
TOLERANCE = 1e-10
NEAR = 0.03  # residual that does for the levels before the last
NARROWER = 0.2  # factor on the rounding from level to level
NODES, WEIGHTS = np.polynomial.legendre.leggauss(5)

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
    """Return the cross product of two vectors."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


@compiled
def largest(a):
    """Return the size of the largest component."""
    return max(abs(a[0]), abs(a[1]), abs(a[2]))


@compiled
def solve_one(alpha, alphadot, xi, rounding, tolerance):
    """Improve xi by Newton's method with exact slopes; return whether it is a
    solution."""
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
def solve(alpha, alphadot):
    """Return the velocities (N, 3) of shapes and rates (N, 2), one after the other."""
    found = np.zeros((len(alpha), 3))
    for i in range(len(alpha)):
        speed = np.sqrt((alphadot[i] ** 2).sum())
        xi = found[i]
        level = 1.0
        while level > ROUNDING:
            level = max(NARROWER * level, ROUNDING)
            tolerance = TOLERANCE if level == ROUNDING else NEAR
            if not solve_one(alpha[i], alphadot[i], xi, level * speed, tolerance):
                xi[:] = np.nan
                break
    return found
