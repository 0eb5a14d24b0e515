"""Stored tables in another body frame: one of the chain that they are of, or minimum-perturbation coordinates.

The frame at h(alpha) in the first has xi_2 = Ad_h^-1 xi_1 + h^-1 dh/dt (`geomech.geometry.coordinates`). A and harmonics are
exact at the grid's points. Of an rms residual, and of half widths of intervals, only the size of each component is known: they
become |Ad_h^-1| times their old ones, an upper bound.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from geomech.geometry.connection import Connection, directions
from geomech.geometry.coordinates import change_connection
from geomech.geometry.harmonics import Harmonics, basis
from geomech.geometry.minimum_perturbation import minimum_perturbation
from geomech.geometry.tube import Tube
from geomech.io.tables.base import MINIMUM_PERTURBATION, Stored, rms
from rft.core.refusal import Refusal
from rft.formulas import se2


def in_frame(stored: Stored, frame: str, chain: Any = None) -> Stored:
    """Return the table in another frame; Refusal where nothing says which it has. chain: the body (`rft.Chain`), in the
    table's frame, None where it is unknown."""
    if frame in ("", stored.frame):
        return stored
    h, dh = _pose(stored, frame, chain)
    carried = np.moveaxis(
        se2.adjoint(se2.inverse(h)), (-2, -1), (0, 1)
    )  # (3, 3, N_1, ...)
    bound = lambda x: (
        None if x is None else np.einsum("ij...,j...->i...", np.abs(carried), x)
    )
    c, residual = stored.connection, bound(stored.connection.residual)
    A = np.moveaxis(
        change_connection(np.moveaxis(c.A, (0, 1), (-2, -1)), h, dh), (-2, -1), (0, 1)
    )
    error = stored.A_error
    return replace(
        stored, connection=Connection(c.axes, A, residual, rms(A, np.nan_to_num(residual)), c.degree, **c.size), frame=frame,
        harmonics=stored.harmonics and _harmonics(stored.harmonics, carried, A - _times(carried, c.A), bound),
        even=bound(stored.even), A_error=None if error is None else _times(np.abs(carried), error),
        body=stored.body if frame == MINIMUM_PERTURBATION or stored.body is None else {**stored.body, "frame": frame},
    )  # fmt: skip


def _times(matrices: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Return matrices (3, 3, N_1, ...) times columns (3, n, N_1, ...)."""
    return np.einsum("ij...,jk...->ik...", matrices, columns)


def _pose(stored: Stored, frame: str, chain: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return the pose h (N_1, ..., 3) of a frame in the table's on its grid, and dh / d alpha (N_1, ..., 3, d)."""
    c = stored.connection
    if isinstance(c, Tube):
        raise Refusal(
            f"a table near a measured gait keeps its frame, {stored.frame!r}",
            instead="drop frame",
        )
    if frame == MINIMUM_PERTURBATION:
        field = minimum_perturbation(c)
        return np.moveaxis(field.field.values, 0, -1), field.grid_slopes
    if chain is None or stored.frame != chain.frame:
        cure = f"drop frame, or take {MINIMUM_PERTURBATION!r}"
        if chain is None:
            cure += ", or add [system.body], with the frame that A has"
        raise Refusal(
            f"no frame {frame!r} of a table whose frame is {stored.frame!r}",
            instead=cure,
        )
    alpha = np.stack(np.meshgrid(*c.axes, indexing="ij"), -1)
    h, columns = None, []
    for unit in np.eye(len(c.axes)):
        h, column = chain.frame_pose(frame, alpha, unit)
        columns.append(column)
    return h, np.stack(columns, -1)


def _harmonics(
    table: Harmonics, carried: np.ndarray, added: np.ndarray, bound
) -> Harmonics:
    """Return the harmonics of the other frame: their velocity carried over, and ``added`` (3, d, N_1, ...) times alphadot."""
    d = len(table.axes)
    unit = directions(d, max(2, 4 * table.coefficients.shape[1]))
    linear = (
        np.linalg.pinv(basis(unit, table.highest)) @ unit
    )  # (terms, d): alphadot as a series of the same basis
    coefficients = _times(carried, table.coefficients) + np.einsum(
        "ik...,tk->it...", added, linear
    )
    return Harmonics(table.axes, coefficients, bound(table.residual), table.degree)
