"""The curvature constraint function: CCF = dA + [A, A], the density of displacement in shape space (paper Fig. 11(d)).

For each pair of joints i < j,  CCF_ij = d_i A_j - d_j A_i + [A_i, A_j]  with the columns A_i in se(2). Its integral
over the area a gait encloses, counter-clockwise positive, estimates the gait's displacement: to order 3 in the gait's
size about a generic shape, to order 4 where A vanishes at its centre.
"""

from __future__ import annotations

import numpy as np

from geomech import se2
from geomech.connection import Connection
from geomech.field import Field


def exterior_derivative(connection: Connection, i: int = 0, j: int = 1) -> np.ndarray:
    """d_i A_j - d_j A_i on the grid, (3, N_1, ..., N_d)."""
    field = connection.field
    return field.derivative(i)[:, j] - field.derivative(j)[:, i]


def lie_bracket(connection: Connection, i: int = 0, j: int = 1) -> np.ndarray:
    """[A_i, A_j] on the grid, (3, N_1, ..., N_d)."""
    columns = np.moveaxis(connection.A, 0, -1)
    return np.moveaxis(se2.bracket(columns[i], columns[j]), -1, 0)


def ccf(connection: Connection, i: int = 0, j: int = 1) -> Field:
    """CCF_ij on the grid, values (3, N_1, ..., N_d): displacement per rad^2, in the connection's length unit and rad."""
    if connection.field.joints < 2:
        raise ValueError("a CCF needs at least two joints: a loop of one joint encloses no area")
    values = exterior_derivative(connection, i, j) + lie_bracket(connection, i, j)
    return Field(connection.axes, values, connection.degree)
