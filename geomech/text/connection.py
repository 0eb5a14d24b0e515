"""The local connection of a scene in lines: its range, the fit, what is alike in it, and what it cost."""

from __future__ import annotations

import numpy as np

from geomech.core.summary import fit_residual, grid
from geomech.core.variables import Result
from geomech.geometry.connection import Connection
from geomech.studies.shape_space import Space
from geomech.systems.base import System, shape_labels
from geomech.systems.capabilities import stored_table
from rft.refusal import in_line

ROWS = 16  # joints in a table


def text(result: Result) -> str:
    """Return the grid, the range of A by joint, the residual of its fit, its symmetries and its cost."""
    space: Space = result.subject
    scene, fitted = space.study.scene, space.study.fitted
    lines = [
        f"{in_line(scene.name)}: local connection A, xi = A alphadot, in the frame {scene.frame}"
    ]
    lines += [f"grid: {grid(fitted.axes)}"]
    lines += [
        *_ranges(fitted, shape_labels(scene.system)),
        f"fit: {_fit(scene.system, fitted)}",
    ]
    lines += _directions(scene.system, fitted)
    lines += [f"symmetry: {line}" for line in symmetries(scene.system)]
    if space.balances:
        lines.append(f"cost: {space.balances:,} force balances, {space.seconds:.2g} s")
    return "\n".join(lines)


def _ranges(fitted: Connection, labels: list[tuple[str, str]]) -> list[str]:
    """Return the least and largest entries of A, a row a joint."""
    units = [fitted.unit, fitted.unit, "rad"]
    heads = (
        f"A_{row} ({unit} per {labels[0][1]})"
        for row, unit in zip(("x", "y", "theta"), units)
    )
    lines = ["rate of   " + "".join(f"{head:>23}" for head in heads)]
    for k, (name, _) in enumerate(labels[:ROWS]):
        both = ((np.nanmin(row[k]) + 0.0, np.nanmax(row[k]) + 0.0) for row in fitted.A)
        lines.append(
            f"{name:10}"
            + "".join(f"{low:>11.4g} to {high:>8.4g}" for low, high in both)
        )
    return lines + [f"and {len(labels) - ROWS} joints more"] * (len(labels) > ROWS)


def _directions(system: System, fitted: Connection) -> list[str]:
    """Return the error of A from the number of directions, of each row over that row."""
    error = fitted.direction_error
    if system.traits.linear or error is None or not np.isfinite(error).any():
        return []
    axes = tuple(range(1, error.ndim))
    with np.errstate(divide="ignore", invalid="ignore"):
        shares = np.sqrt(np.nanmean(error**2, axes) / np.nanmean(fitted.A**2, axes))
    told = ", ".join(
        f"{row} {100 * share:.2g} %"
        for row, share in zip(("x", "y", "theta"), shares)
        if np.isfinite(share)
    )
    return [
        f"directions of alphadot: with more of them A changes by about {told} (rms)"
    ]


def _fit(system: System, fitted: Connection) -> str:
    """Return what the linear fit leaves of the velocity."""
    if system.traits.linear and not stored_table(system, "connection"):
        return "exact, xi is linear in alphadot"
    singular = int(np.isnan(fitted.A).any((0, 1)).sum())
    return fit_residual(fitted.residual, fitted.speed).removeprefix(
        "fit "
    ) + f"; {singular} singular shapes" * bool(singular)


def symmetries(system: System) -> list[str]:
    """Return which entries of A follow from others, by the traits of the system."""
    traits, lines = system.traits, []
    if traits.halved:
        lines.append("A_x is odd in alpha, A_y and A_theta even (left and right alike)")
    if traits.reversible:
        lines.append(
            "the last joint's column follows from the first's (head and tail alike)"
        )
    return lines
