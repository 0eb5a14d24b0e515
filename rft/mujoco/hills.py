"""A height field of MuJoCo as the surface of the sand: heights and slopes between its nodes.

Each geom sees the plane that touches the surface below its middle, so that a geom should be small beside the hills."""

from __future__ import annotations

import math
from typing import NamedTuple

import mujoco
import numpy as np

from rft.core.refusal import formatted, require
from rft.terradynamics.meshes.geoms import geom_kind, geom_name

UPRIGHT = 1e-6  # rad: tilt of a height field that counts as none


class Hills(NamedTuple):
    """A surface over a rectangle; beyond it, it goes on level.

    grid: (rows, columns, 3), height, m, and slopes along the field's x and y at its nodes, row by row along y. frame: (7,),
    place of its middle x, y and z, cosine and sine of its angle about z, and half its lengths along x and y, m."""

    grid: np.ndarray
    frame: np.ndarray


FLAT = Hills(np.zeros((0, 0, 3)), np.zeros(7))


def tangent_plane(
    grid: np.ndarray, frame: np.ndarray, x: float, y: float
) -> tuple[tuple, float]:
    """Return the unit normal n and the distance n . x of the plane that touches the surface at a place (x, y), m.

    Heights and slopes are linear along rows and columns between the nodes. Compiled code takes this function, too."""
    dx, dy, cos, sin = x - frame[0], y - frame[1], frame[3], frame[4]
    u, v = cos * dx + sin * dy, cos * dy - sin * dx
    rows, columns = grid.shape[0], grid.shape[1]
    c = 0.5 * (u / frame[5] + 1.0) * (columns - 1)
    r = 0.5 * (v / frame[6] + 1.0) * (rows - 1)
    inside = 0.0 <= c <= columns - 1 and 0.0 <= r <= rows - 1
    c, r = min(max(c, 0.0), columns - 1.0), min(max(r, 0.0), rows - 1.0)
    i, j = min(int(r), rows - 2), min(int(c), columns - 2)
    s, t = r - i, c - j
    a, b, d, e = (1 - s) * (1 - t), (1 - s) * t, s * (1 - t), s * t
    height = (
        a * grid[i, j, 0]
        + b * grid[i, j + 1, 0]
        + d * grid[i + 1, j, 0]
        + e * grid[i + 1, j + 1, 0]
    )
    along = (
        a * grid[i, j, 1]
        + b * grid[i, j + 1, 1]
        + d * grid[i + 1, j, 1]
        + e * grid[i + 1, j + 1, 1]
    )
    across = (
        a * grid[i, j, 2]
        + b * grid[i, j + 1, 2]
        + d * grid[i + 1, j, 2]
        + e * grid[i + 1, j + 1, 2]
    )
    if not inside:
        along, across = 0.0, 0.0
    by_x, by_y = cos * along - sin * across, sin * along + cos * across
    size = 1.0 / math.sqrt(1.0 + by_x * by_x + by_y * by_y)
    n = (-by_x * size, -by_y * size, size)
    return n, n[0] * x + n[1] * y + n[2] * (frame[2] + height)


def hills_of(model: mujoco.MjModel, name: str) -> tuple[Hills, int]:
    """Return the surface of a height field, given by the name of its geom, and the number of the geom."""
    geom = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, name)
    require(
        geom >= 0,
        f"the model has no geom {formatted(name)}",
        instead="``level`` names a height field",
    )
    kind = geom_kind(model, geom)
    require(
        kind == "hfield",
        f"the geom {formatted(name)} is a {kind}",
        instead="``level`` names a height field",
    )
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    turn, place = data.geom_xmat[geom].reshape(3, 3), data.geom_xpos[geom]
    upright = (
        turn[2, 2] > 1.0 - UPRIGHT**2
        and model.body_weldid[model.geom_bodyid[geom]] == 0
    )
    require(
        bool(upright),
        f"the height field {formatted(geom_name(model, geom))} is tilted or moves",
    )
    field = model.geom_dataid[geom]
    rows, columns, first = (
        model.hfield_nrow[field],
        model.hfield_ncol[field],
        model.hfield_adr[field],
    )
    half_x, half_y, top, _ = model.hfield_size[field]
    height = top * model.hfield_data[first : first + rows * columns].astype(
        float
    ).reshape(rows, columns)
    by_y, by_x = np.gradient(
        height, 2 * half_y / (rows - 1), 2 * half_x / (columns - 1)
    )
    grid = np.ascontiguousarray(np.stack([height, by_x, by_y], -1))
    return Hills(grid, np.array([*place, turn[0, 0], turn[1, 0], half_x, half_y])), geom
