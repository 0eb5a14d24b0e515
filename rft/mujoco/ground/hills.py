"""A height field of MuJoCo as the surface of the sand: heights and slopes between its
nodes.

Each geom sees the plane that touches the surface below its middle, so a geom should be
small compared with the hills."""

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

    grid: (rows, columns, 3), height, m, and slopes along the field's x and y at its
    nodes, row by row along y. frame: (7,), place of its middle x, y and z, cosine and
    sine of its angle about z, and half its lengths along x and y, m."""

    grid: np.ndarray
    frame: np.ndarray


FLAT = Hills(np.zeros((0, 0, 3)), np.zeros(7))


def tangent_plane(
    grid: np.ndarray, frame: np.ndarray, x: float, y: float
) -> tuple[tuple, float]:
    """Return the unit normal n and the distance n . x of the plane that touches the
    surface at a place (x, y), m.

    Heights and slopes are linear along rows and columns between the nodes. Compiled
    code calls this function, too."""
    dx = x - frame[0]
    dy = y - frame[1]
    cos = frame[3]
    sin = frame[4]
    u = cos * dx + sin * dy
    v = cos * dy - sin * dx

    # Column and row of the place, as real numbers.
    rows, columns = grid.shape[0], grid.shape[1]
    c = 0.5 * (u / frame[5] + 1.0) * (columns - 1)
    r = 0.5 * (v / frame[6] + 1.0) * (rows - 1)
    is_inside = 0.0 <= c <= columns - 1 and 0.0 <= r <= rows - 1
    c = min(max(c, 0.0), columns - 1.0)
    r = min(max(r, 0.0), rows - 1.0)
    i = min(int(r), rows - 2)
    j = min(int(c), columns - 2)
    s = r - i
    t = c - j

    height = _between_nodes(grid, 0, i, j, s, t)
    along = 0.0
    across = 0.0
    if is_inside:
        along = _between_nodes(grid, 1, i, j, s, t)
        across = _between_nodes(grid, 2, i, j, s, t)
    by_x = cos * along - sin * across
    by_y = sin * along + cos * across
    size = 1.0 / math.sqrt(1.0 + by_x * by_x + by_y * by_y)
    n = (-by_x * size, -by_y * size, size)
    return n, n[0] * x + n[1] * y + n[2] * (frame[2] + height)


def _between_nodes(grid, quantity, i, j, s, t) -> float:
    """Return a quantity of a grid at fractions s and t of the cell between the nodes
    (i, j) and (i + 1, j + 1)."""
    return (
        (1 - s) * (1 - t) * grid[i, j, quantity]
        + (1 - s) * t * grid[i, j + 1, quantity]
        + s * (1 - t) * grid[i + 1, j, quantity]
        + s * t * grid[i + 1, j + 1, quantity]
    )


def hills_of(model: mujoco.MjModel, name: str) -> tuple[Hills, int]:
    """Return the surface of a height field, given by the name of its geom, and the
    number of the geom."""
    cure = "``level`` must name a height field"
    geom = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, name)
    require(geom >= 0, f"the model has no geom {formatted(name)}", instead=cure)
    kind = geom_kind(model, geom)
    require(kind == "hfield", f"the geom {formatted(name)} is a {kind}", instead=cure)

    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    turn = data.geom_xmat[geom].reshape(3, 3)
    place = data.geom_xpos[geom]
    is_upright = turn[2, 2] > 1.0 - UPRIGHT**2
    is_fixed = model.body_weldid[model.geom_bodyid[geom]] == 0
    require(
        bool(is_upright and is_fixed),
        f"the height field {formatted(geom_name(model, geom))} is tilted or moves",
    )

    field = model.geom_dataid[geom]
    rows = model.hfield_nrow[field]
    columns = model.hfield_ncol[field]
    first = model.hfield_adr[field]
    half_x, half_y, top, _ = model.hfield_size[field]
    values = model.hfield_data[first : first + rows * columns].astype(float)
    height = top * values.reshape(rows, columns)
    dx = 2 * half_x / (columns - 1)
    dy = 2 * half_y / (rows - 1)
    by_y, by_x = np.gradient(height, dy, dx)
    grid = np.ascontiguousarray(np.stack([height, by_x, by_y], -1))
    frame = np.array([*place, turn[0, 0], turn[1, 0], half_x, half_y])
    return Hills(grid, frame), geom


COMPILED = tangent_plane, _between_nodes
