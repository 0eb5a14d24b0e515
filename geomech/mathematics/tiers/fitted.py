"""The fitted connection: on a grid of shapes, on a plane, or solved at single
shapes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache, partial

import numpy as np

from geomech.mathematics.geometry import connection
from geomech.mathematics.geometry.connection import Connection
from geomech.mathematics.geometry.periods import Periods
from geomech.mathematics.geometry.representations.field import inside
from geomech.mathematics.geometry.representations.images import (
    images,
    plane_images,
    to_solve,
)
from geomech.mathematics.geometry.representations.plane import (
    Plane,
    checked_pair,
    indices,
    interpolated_plane,
    plane_shapes,
)
from geomech.mathematics.geometry.representations.plane import plane as fit_plane
from geomech.mathematics.geometry.traits import Traits
from geomech.mathematics.systems import premises
from geomech.mathematics.systems.base import (
    System,
    WrappedSystem,
    body_size,
    length_unit,
    shape_labels,
)
from geomech.mathematics.systems.capabilities import balances_at_rates, stored_table
from geomech.mathematics.systems.framed import Framed
from geomech.mathematics.tiers.base import Numerics, Table
from rft.core.premise import ALL
from rft.core.refusal import Refusal

INSTEAD = (
    "draw slices by ``Study.ccf(pair=...)``, or use tiers such as path and direct,"
    " which need no field"
)
LARGEST_GRID = 2_000_000  # shapes; a finer field is likely a mistake
# Shapes of a field of four and more joints: tiers do without a larger one.
LARGEST_FIELD = 30_000
FINEST_GRID = 31  # points per joint that are recommended
BYTES_PER_SHAPE = 24  # and joint: three numbers of A
GRIDS = (7, 11, 15, 21, 31, 45, 61)  # that an error study tries
DEPENDS_ON = ("grid", "extent", "directions", "interpolation")  # of [numerics]


def refuse(system: System) -> None:
    """Refuse a system that has no connection."""
    premises.refuse(system, "connection or CCF", ALL, "use the direct tier")


def directions(system: System, numerics: Numerics) -> int:
    """Return the number of directions of alphadot at each shape."""
    if numerics.directions:
        return numerics.directions
    if system.joints <= 2:
        return 8
    if system.traits.linear:
        return 4 * system.joints
    return 16 * system.joints


def axes(system: System, numerics: Numerics) -> tuple[np.ndarray, ...]:
    """Return the axes of the field; Refusal for a system without a field, or a field
    too large."""
    refuse(system)
    stored = stored_table(system, "connection")
    if stored:
        return stored.axes
    d = system.joints
    n = numerics.grid
    if n**d > LARGEST_GRID:
        what = f"a field of {n}^{d} shapes is too large"
        if 4**d > LARGEST_GRID:
            instead = f"give a chain two [body] modes, {INSTEAD}"
            raise Refusal(what, instead=instead)
        gigabytes = 1e-9 * BYTES_PER_SHAPE * d * n**d
        raise Refusal(
            f"{what} ({gigabytes:.3g} GB for A)",
            instead=f"lower [numerics] grid, to {finest_grid(d)} or less, {INSTEAD}",
        )
    return connection.grid(d, n, numerics.extent, system.traits.periods)


def finest_grid(joints: int) -> int:
    """Return the finest grid, odd and at most FINEST_GRID, whose field is quick; 4 if
    none is."""
    for n in range(FINEST_GRID, 4, -2):
        if n**joints <= LARGEST_FIELD:
            return n
    return 4


def is_too_large(system: System, numerics: Numerics) -> bool:
    """Return whether tiers do without a field, and solve for A at the shapes of the
    gait and of the surfaces that it spans."""
    if system.joints <= 3 or stored_table(system, "connection"):
        return False
    return numerics.grid**system.joints > LARGEST_FIELD


def table(system: System, numerics: Numerics) -> Table:
    """Return the connection on the scene's grid, as a table to build."""
    d = system.joints
    count = directions(system, numerics)
    solved = system.inner if isinstance(system, Framed) else system
    return Table(
        "connection",
        key=key(numerics, DEPENDS_ON),
        balances=solved_shapes(solved, numerics, count)
        * balances_at_rates(solved, count),
        numbers=(d + 3) * 3 * numerics.grid**d,
        build=partial(_build, system, numerics),
        axes=partial(axes, system, numerics),
    )


def key(numerics: Numerics, names: tuple[str, ...]) -> tuple:
    """Return the values of some entries of [numerics]."""
    return tuple(getattr(numerics, name) for name in names)


def _build(system: System, numerics: Numerics, progress: Callable | None) -> Connection:
    """Return the connection: the stored one, or a fit on the scene's grid."""
    stored = stored_table(system, "connection")
    if stored:
        if stored.length:
            return stored
        return replace(stored, unit=length_unit(system), length=body_size(system))
    if isinstance(system, Framed):
        return system.fitted(progress)
    return connection.fit(
        system.velocity,
        axes(system, numerics),
        directions(system, numerics),
        numerics.interpolation,
        progress,
        traits=system.traits,
        trusted=not isinstance(system, WrappedSystem),
        unit=length_unit(system),
        length=body_size(system),
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
    """Return how many balances `without_field` takes for each shape."""
    if system.traits.linear:
        return balances_at_rates(system, system.joints)
    return directions(system, numerics)


def plane(
    system: System,
    numerics: Numerics,
    pair: tuple[int, int],
    at,
    progress: Callable | None = None,
) -> Plane:
    """Return the plane of shape space on which two joints move
    (`geomech.mathematics.geometry.representations.plane`), interpolated in a stored
    field.

    Refusal for a system without a connection, or a plane outside the field."""
    refuse(system)
    stored = stored_table(system, "connection")
    if stored:
        return interpolated_plane(stored, pair, at)
    axes = connection.grid(
        system.joints, numerics.grid, numerics.extent, system.traits.periods
    )
    names = [name for name, _ in shape_labels(system)]
    at = inside(axes, at, names, system.traits.periods)
    return fit_plane(
        system.velocity,
        [axes[k] for k in indices(checked_pair(pair, system.joints))],
        pair,
        at,
        directions(system, numerics),
        numerics.interpolation,
        progress,
        traits=system.traits,
        unit=length_unit(system),
        length=body_size(system),
    )


def plane_balances(
    system: System, numerics: Numerics, pair: tuple[int, int], at
) -> int:
    """Return the velocities that `plane` takes."""
    if stored_table(system, "connection"):
        return 0
    count = directions(system, numerics)
    axes = connection.grid(
        system.joints, numerics.grid, numerics.extent, system.traits.periods
    )
    alpha = plane_shapes([axes[k] for k in indices(pair)], pair, np.asarray(at))
    symmetries = plane_images(alpha, count, system.traits, pair)
    n_shapes = int(to_solve(symmetries, alpha[..., 0].size).sum())
    return n_shapes * balances_at_rates(system, count)


def solved_shapes(system: System, numerics: Numerics, count: int) -> int:
    """Return the number of shapes of the field that are solved, each for ``count``
    directions of alphadot; 0 for a stored field."""
    if stored_table(system, "connection"):
        return 0
    return _solved_shapes(
        system.joints,
        numerics.grid,
        count,
        system.traits.halved,
        system.traits.reversible,
        system.traits.periods,
    )


@lru_cache
def _solved_shapes(
    joints: int,
    points: int,
    count: int,
    mirror: bool,
    reversible: bool,
    periods: Periods,
) -> int:
    """Return `solved_shapes` from the facts that it depends on."""
    if points**joints > LARGEST_GRID:  # refused before it is solved
        if mirror:
            return points**joints // 2
        return points**joints
    grid = connection.grid(joints, points, periods=periods)
    unit = connection.directions(joints, count)
    traits = Traits(mirror=mirror, reversible=reversible, periods=periods)
    symmetries = images(grid, unit, traits)
    return int(to_solve(symmetries, points**joints).sum())
