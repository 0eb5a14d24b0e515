"""MuJoCo's own constraints as rows: equality, dry friction, limits, contacts with
pyramidal or elliptic cones.

With the acceleration a of the joints and u = J a - a_ref, a row has the force (Todorov,
ICRA 2014, and the chapter "Computation" of MuJoCo's documentation)

    equality            f = -D u,
    dry friction        f = -D u, between -limit and limit,
    limits, contacts    f = -D u where u < 0, else 0,

and the rows of an elliptic contact, with N = mu u_1, scaled tangents s_j u_j of length
T and D_m = D_1 / (mu^2 (1 + mu^2)),

    above the cone (N >= mu T)          f = 0,
    below it (mu N + T <= 0)            f = -D u,
    between                             f_1 = -D_m mu (N - mu T),
                                        f_j = D_m mu (N - mu T) s_j^2 u_j / T.

Compiled code takes these functions, too."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from rft.mujoco.step.algebra import add_outer

EQUALITY, FRICTION_OF_DOF, FRICTION_OF_TENDON, ELLIPTIC = 0, 1, 2, 7  # mjtConstraint


class Rows(NamedTuple):
    """Constraint rows of a block, r of them.

    jacobian: (r, n). by_change: (r, n), from the change of the velocities over the step
    to J a. weight: (r,), D. reference: (r,), a_ref. kinds: (r,). limits: (r,), of dry
    friction. cones: (c, 2), first row and number of rows of elliptic contacts. scales:
    (c, 6), mu and the friction of their tangents."""

    jacobian: np.ndarray
    by_change: np.ndarray
    weight: np.ndarray
    reference: np.ndarray
    kinds: np.ndarray
    limits: np.ndarray
    cones: np.ndarray
    scales: np.ndarray


def row_forces(rows, u) -> np.ndarray:
    """Return the forces (r,) of constraint rows."""
    f = np.zeros(len(u))
    for i in range(len(u)):
        kind = rows.kinds[i]
        own = -rows.weight[i] * u[i]
        if kind == EQUALITY:
            f[i] = own
        elif kind in (FRICTION_OF_DOF, FRICTION_OF_TENDON):
            f[i] = min(max(own, -rows.limits[i]), rows.limits[i])
        elif kind != ELLIPTIC and u[i] < 0.0:
            f[i] = own
    for c in range(len(rows.cones)):
        first = rows.cones[c, 0]
        count = rows.cones[c, 1]
        mu, normal, tangent = _cone(rows, c, u)
        if normal >= mu * tangent:
            continue
        if mu * normal + tangent <= 0.0:
            for i in range(first, first + count):
                f[i] = -rows.weight[i] * u[i]
            continue
        push = _cone_weight(rows, c) * (normal - mu * tangent)
        f[first] = -push * mu
        for j in range(1, count):
            s = rows.scales[c, j]
            f[first + j] = push * mu / tangent * s * s * u[first + j]
    return f


def _cone(rows, c, u) -> tuple[float, float, float]:
    """Return mu, N and T of an elliptic contact."""
    first = rows.cones[c, 0]
    count = rows.cones[c, 1]
    tangent = 0.0
    for j in range(1, count):
        tangent += (rows.scales[c, j] * u[first + j]) ** 2
    mu = rows.scales[c, 0]
    return mu, mu * u[first], math.sqrt(tangent)


def _cone_weight(rows, c) -> float:
    """Return D_m of an elliptic contact."""
    mu = rows.scales[c, 0]
    return rows.weight[rows.cones[c, 0]] / (mu * mu * (1.0 + mu * mu))


def add_row_slopes(matrix, rows, u) -> None:
    """Add the slopes of less the rows' generalised forces, by the change of the
    velocities, to a matrix (n, n)."""
    for i in range(len(u)):
        kind = rows.kinds[i]
        weight = rows.weight[i]
        rigid = kind == EQUALITY
        is_friction = kind in (FRICTION_OF_DOF, FRICTION_OF_TENDON)
        sticks = is_friction and abs(weight * u[i]) < rows.limits[i]
        presses = kind > FRICTION_OF_TENDON and kind != ELLIPTIC and u[i] < 0.0
        if rigid or sticks or presses:
            add_outer(matrix, weight, rows.jacobian[i], rows.by_change[i])
    for c in range(len(rows.cones)):
        first = rows.cones[c, 0]
        count = rows.cones[c, 1]
        mu, normal, tangent = _cone(rows, c, u)
        if normal >= mu * tangent:
            continue
        if mu * normal + tangent <= 0.0:
            for i in range(first, first + count):
                add_outer(matrix, rows.weight[i], rows.jacobian[i], rows.by_change[i])
            continue
        for j in range(count):
            for k in range(count):
                slope = _slope_in_cone(rows, c, u, j, k, normal, tangent)
                add_outer(
                    matrix, slope, rows.jacobian[first + j], rows.by_change[first + k]
                )


def _slope_in_cone(rows, c, u, j, k, normal, tangent) -> float:
    """Return the slope of less the force of row j by u_k of an elliptic contact between
    its cones."""
    first = rows.cones[c, 0]
    mu = rows.scales[c, 0]
    weight = _cone_weight(rows, c)
    gap = normal - mu * tangent
    if j == 0 and k == 0:
        return weight * mu * mu
    x_j = rows.scales[c, j] * u[first + j]
    x_k = rows.scales[c, k] * u[first + k]
    if j == 0:
        return -weight * mu * mu * rows.scales[c, k] * x_k / tangent
    if k == 0:
        return -weight * mu * mu * rows.scales[c, j] * x_j / tangent
    slope = weight * mu * x_j * x_k / tangent**2 * (mu + gap / tangent)
    if j == k:
        slope -= weight * gap * mu / tangent
    return slope * rows.scales[c, j] * rows.scales[c, k]


COMPILED = row_forces, _cone, _cone_weight, add_row_slopes, _slope_in_cone
