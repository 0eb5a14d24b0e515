"""Stored tables in another body frame: another one of their chain, or
minimum-perturbation coordinates.

In the frame whose pose in the first is h(alpha), xi_2 = Ad_h^-1 xi_1 + h^-1 dh/dt
(`geomech.mathematics.geometry.coordinates`). A and harmonics are exact at the grid's
points. Of an rms residual, and of half widths of intervals, only the size of each
component is known: they are multiplied by |Ad_h^-1|, which gives an upper bound.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from geomech.io.tables.base import MINIMUM_PERTURBATION, Stored, rms
from geomech.mathematics.geometry.connection import Connection, directions
from geomech.mathematics.geometry.coordinates import change_connection
from geomech.mathematics.geometry.minimum_perturbation import minimum_perturbation
from geomech.mathematics.geometry.representations.harmonics import Harmonics, basis
from geomech.mathematics.geometry.representations.tube import Tube
from rft.core.refusal import Refusal
from rft.formulas import se2


def in_frame(stored: Stored, frame: str, chain: Any = None) -> Stored:
    """Return the table in another frame; Refusal where the pose of that frame is
    unknown. chain: the body (`rft.Chain`), in the table's frame; None where it is
    unknown."""
    if frame in ("", stored.frame):
        return stored
    h, dh = _pose(stored, frame, chain)
    adjoint = np.moveaxis(se2.adjoint(se2.inverse(h)), (-2, -1), (0, 1))

    def bound(sizes):
        """Return bounds (3, ...) of components from bounds in the first frame."""
        return np.einsum("ij...,j...->i...", np.abs(adjoint), sizes)

    c = stored.connection
    matrices = change_connection(np.moveaxis(c.A, (0, 1), (-2, -1)), h, dh)
    A = np.moveaxis(matrices, (-2, -1), (0, 1))
    residual = bound(c.residual)
    speed = rms(A, np.nan_to_num(residual))
    connection = Connection(
        c.axes, A, residual, speed, c.degree, **c.size, periods=c.periods
    )

    harmonics = stored.harmonics
    if harmonics:
        frame_velocity = A - _times(adjoint, c.A)
        residual = bound(harmonics.residual)
        harmonics = _harmonics(harmonics, adjoint, frame_velocity, residual)
    even = stored.even
    if even is not None:
        even = bound(even)
    error = stored.A_error
    if error is not None:
        error = _times(np.abs(adjoint), error)
    body = stored.body
    if body is not None and frame != MINIMUM_PERTURBATION:
        body = {**body, "frame": frame}
    return replace(
        stored,
        connection=connection,
        frame=frame,
        harmonics=harmonics,
        even=even,
        A_error=error,
        body=body,
    )


def _times(matrices: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Return matrices (3, 3, N_1, ...) times columns (3, n, N_1, ...)."""
    return np.einsum("ij...,jk...->ik...", matrices, columns)


def _pose(stored: Stored, frame: str, chain: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return the pose h (N_1, ..., 3) of a frame in the table's, on its grid, and
    dh / d alpha (N_1, ..., 3, d)."""
    c = stored.connection
    if isinstance(c, Tube):
        raise Refusal(
            f"a table near a measured gait has only the frame {stored.frame!r}",
            instead="remove frame",
        )
    if frame == MINIMUM_PERTURBATION:
        field = minimum_perturbation(c)
        return np.moveaxis(field.field.values, 0, -1), field.grid_slopes
    if chain is None or stored.frame != chain.frame:
        cure = f"remove frame, or use {MINIMUM_PERTURBATION!r}"
        if chain is None:
            cure += ", or add [system.body] in the frame of A"
        raise Refusal(
            f"a table in the frame {stored.frame!r} cannot be converted to the "
            f"frame {frame!r}",
            instead=cure,
        )
    alpha = np.stack(np.meshgrid(*c.axes, indexing="ij"), -1)
    h = None
    columns = []
    for unit in np.eye(len(c.axes)):
        h, column = chain.frame_pose(frame, alpha, unit)
        columns.append(column)
    return h, np.stack(columns, -1)


def _harmonics(
    table: Harmonics, adjoint: np.ndarray, added: np.ndarray, residual: np.ndarray
) -> Harmonics:
    """Return the harmonics of xi in the other frame: those of the first, times
    ``adjoint`` (3, 3, N_1, ...), plus ``added`` (3, d, N_1, ...) times alphadot.
    residual: of the new harmonics."""
    d = len(table.axes)
    unit = directions(d, max(2, 4 * table.coefficients.shape[1]))
    # alphadot as a series of the same basis, (terms, d).
    linear = np.linalg.pinv(basis(unit, table.highest)) @ unit
    coefficients = _times(adjoint, table.coefficients)
    coefficients = coefficients + np.einsum("ik...,tk->it...", added, linear)
    return replace(table, coefficients=coefficients, residual=residual)
