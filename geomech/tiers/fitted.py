"""The fitted connection: on a grid of shapes, on a plane, or solved at single shapes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache, partial
from typing import Any

import numpy as np

from geomech.geometry import connection
from geomech.geometry.connection import Connection
from geomech.geometry.field import inside
from geomech.geometry.images import images, mirrored, to_solve
from geomech.geometry.plane import Plane, interpolated_plane, plane_shapes
from geomech.geometry.plane import plane as fit_plane
from geomech.geometry.traits import Traits
from geomech.systems import premises
from geomech.systems.base import (
    System,
    WrappedSystem,
    body_size,
    length_unit,
    shape_labels,
)
from geomech.systems.capabilities import stored_table
from geomech.systems.framed import Framed
from geomech.tiers.base import Numerics, Table
from rft.core.premise import ALL
from rft.core.refusal import Refusal

INSTEAD = "draw slices by ``Study.ccf(pair=...)``, or use tiers such as path and direct, which need no field"

LARGEST_GRID = 2_000_000  # shapes; a finer field is a slip of the pen
FIELD = 30_000  # shapes of four and more joints: tiers do without a larger field
GRIDS = 7, 11, 15, 21, 31, 45, 61  # that an error study tries
DEPENDS_ON = ("grid", "extent", "directions", "interpolation")  # of [numerics]


def refuse(system: System) -> None:
    """Raise Refusal if the system has no connection."""
    premises.refuse(system, "connection or CCF", ALL, "use the direct tier")


def directions(system: System, numerics: Numerics) -> int:
    """Return the number of directions of alphadot at each shape."""
    return numerics.directions or (
        8 if system.joints <= 2 else (4 if system.traits.linear else 16) * system.joints
    )


def axes(system: System, numerics: Numerics) -> tuple[np.ndarray, ...]:
    """Return the axes of the field; Refusal if there is none, or one too large."""
    refuse(system)
    if stored := stored_table(system, "connection"):
        return stored.axes
    d, n = system.joints, numerics.grid
    if n**d > LARGEST_GRID:
        coarse_fits = 4**d <= LARGEST_GRID
        cost = f" ({24e-9 * d * n**d:.3g} GB for A)" if coarse_fits else ""
        lower = (
            f"lower [numerics] grid, to {finest_grid(d)} or less, "
            if coarse_fits
            else "give a chain two [body] modes, "
        )
        raise Refusal(
            f"a field of {n}^{d} shapes is too large{cost}", instead=f"{lower}{INSTEAD}"
        )
    return connection.grid(system.joints, numerics.grid, numerics.extent)


def finest_grid(joints: int) -> int:
    """Return the finest grid, odd, of which a field of so many joints is quick."""
    return max(4, next((n for n in range(31, 4, -2) if n**joints <= FIELD), 4))


def is_too_large(system: System, numerics: Numerics) -> bool:
    """Return whether tiers do without the field of so many shapes, and solve for A at those of the gait and of the
    surfaces that it spans."""
    return (
        system.joints > 3
        and not stored_table(system, "connection")
        and numerics.grid**system.joints > FIELD
    )


def table(system: System, numerics: Numerics) -> Table:
    """Return the connection on the scene's grid, as a table to build."""
    count, d = directions(system, numerics), system.joints
    return Table(
        "connection",
        key(numerics, DEPENDS_ON),
        solved_shapes(
            system.inner if isinstance(system, Framed) else system, numerics, count
        )
        * count,
        (d + 3) * 3 * numerics.grid**d,
        partial(_build, system, numerics),
        partial(axes, system, numerics),
    )


def key(numerics: Numerics, names: tuple[str, ...]) -> tuple:
    """Return the values of some entries of [numerics]."""
    return tuple(getattr(numerics, name) for name in names)


def _build(system: System, numerics: Numerics, progress: Callable | None) -> Connection:
    if stored := stored_table(system, "connection"):
        return (
            stored
            if stored.length
            else replace(stored, unit=length_unit(system), length=body_size(system))
        )
    if isinstance(system, Framed):
        return system.fitted(progress)
    count, trusted = directions(system, numerics), not isinstance(system, WrappedSystem)
    options: dict[str, Any] = {
        "traits": system.traits,
        "unit": length_unit(system),
        "length": body_size(system),
    }
    return connection.fit(
        system.velocity,
        axes(system, numerics),
        count,
        numerics.interpolation,
        progress,
        trusted=trusted,
        **options,
    )


def without_field(system: System, numerics: Numerics) -> Callable:
    """Return the connection as a function of shapes (..., d), without a field."""
    return connection.connection_function(
        system.velocity,
        system.joints,
        directions(system, numerics),
        system.traits.linear,
    )


def balances_per_shape(system: System, numerics: Numerics) -> int:
    """Return how many velocities `without_field` takes for each shape."""
    return system.joints if system.traits.linear else directions(system, numerics)


def plane(
    system: System,
    numerics: Numerics,
    pair: tuple[int, int],
    at,
    progress: Callable | None = None,
) -> Plane:
    """Return the plane of shape space on which two joints move (`geomech.geometry.plane`), interpolated in a stored
    field.

    Refusal if there is no connection, or if the plane lies outside the field."""
    refuse(system)
    if stored := stored_table(system, "connection"):
        return interpolated_plane(stored, pair, at)
    axis = connection.grid(1, numerics.grid, numerics.extent)[0]
    at = inside((axis,) * system.joints, at, [name for name, _ in shape_labels(system)])
    count = directions(system, numerics)
    options: dict[str, Any] = {
        "traits": system.traits,
        "unit": length_unit(system),
        "length": body_size(system),
    }
    return fit_plane(
        system.velocity,
        (axis, axis),
        pair,
        at,
        count,
        numerics.interpolation,
        progress,
        **options,
    )


def plane_balances(
    system: System, numerics: Numerics, pair: tuple[int, int], at
) -> int:
    """Return the velocities that `plane` takes."""
    if stored_table(system, "connection"):
        return 0
    axis, count = (
        connection.grid(1, numerics.grid, numerics.extent)[0],
        directions(system, numerics),
    )
    alpha = plane_shapes((axis, axis), pair, np.asarray(at)).reshape(-1, system.joints)
    return (
        int(
            to_solve(
                mirrored(alpha, count) if system.traits.halved else (), len(alpha)
            ).sum()
        )
        * count
    )


def solved_shapes(system: System, numerics: Numerics, count: int) -> int:
    """Return the number of shapes of the field that are solved, each for ``count`` directions of alphadot; 0 of one that is
    stored."""
    if stored_table(system, "connection"):
        return 0
    return _solved_shapes(
        system.joints,
        numerics.grid,
        count,
        system.traits.halved,
        system.traits.reversible,
    )


@lru_cache
def _solved_shapes(
    joints: int, points: int, count: int, mirror: bool, reversible: bool
) -> int:
    if points**joints > LARGEST_GRID:  # which is refused before it is solved
        return points**joints // (2 if mirror else 1)
    grid, unit = connection.grid(joints, points), connection.directions(joints, count)
    symmetries = images(grid, unit, Traits(mirror=mirror, reversible=reversible))
    return int(to_solve(symmetries, points**joints).sum())
