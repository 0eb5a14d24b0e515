"""The path tier: the fitted connection integrated along the gait."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from geomech.gaits import Gait
from geomech.geometry import connection
from geomech.geometry.connection import Connection, Velocity
from geomech.geometry.field import Field, inside
from geomech.geometry.images import images, to_solve
from geomech.geometry.plane import Plane, looked_up
from geomech.geometry.plane import plane as fit_plane
from geomech.systems.base import length_unit, shape_labels
from geomech.tiers.base import Tier
from geomech.tiers.direct import direct

INSTEAD = "draw slices (geomech ccf --pair), or use methods such as path and direct, which need no field"

LARGEST_GRID = 2_000_000  # shapes; a finer field is a slip of the pen
FIELD = 30_000  # shapes of four and more joints: tiers do without a larger field


def path(fitted: Connection | Velocity, gait: Gait, amplitudes=None, phases: int = 256) -> np.ndarray:
    """The fitted connection integrated along the gait, for amplitudes (...,) or the gait's own."""
    return direct(fitted.velocity if isinstance(fitted, Connection) else fitted, gait, amplitudes, phases)


def axes(system, numerics) -> tuple[np.ndarray, ...]:
    """Of the field; ValueError if there is none, or one too large."""
    system.refuse(Tier.needs, Tier.rests_on, "use the direct tier")
    if own := system.stored("connection"):
        return own.axes
    d, n = system.joints, numerics.grid
    if n**d > LARGEST_GRID:
        few = 4**d <= LARGEST_GRID
        cost = f" ({24e-9 * d * n**d:.3g} GB for A)" if few else ""
        lower = f"lower [numerics] grid, to {fits(d)} or less, " if few else "give a chain two [body] modes, "
        raise ValueError(f"a field of {n}^{d} shapes is too large{cost}: {lower}{INSTEAD}")
    return connection.grid(system.joints, numerics.grid, numerics.extent)


def fits(joints: int) -> int:
    """The finest grid, odd, of which a field of so many joints is quick."""
    return max(4, next((n for n in range(31, 4, -2) if n**joints <= FIELD), 4))


def around(system, numerics) -> bool:
    """Whether the grid that is asked for is too large a field of so many joints, so that its tiers solve for A at shapes of
    the gait and of the surfaces that it spans, and look nothing up."""
    return system.joints > 3 and not system.stored("connection") and numerics.grid**system.joints > FIELD


def plane(system, numerics, pair: tuple[int, int], at, progress: Callable | None = None) -> Plane:
    """The plane of shape space on which two joints move (`geomech.geometry.plane`), looked up in a stored field; ValueError if
    there is no connection, or if the plane lies outside the field."""
    tier = Path()
    tier.refuse(system)
    if own := system.stored("connection"):
        return looked_up(own, pair, at)
    axis = connection.grid(1, numerics.grid, numerics.extent)[0]
    at = inside((axis,) * system.joints, at, [name for name, _ in shape_labels(system)])
    count = tier.directions(system, numerics)
    known = {"traits": system.traits, "unit": length_unit(system), "length": system.length}
    return fit_plane(system.velocity, (axis, axis), pair, at, count, numerics.interpolation, progress, **known)


def shapes(system, numerics, directions: int = 0) -> int:
    """Of the field, that are solved: none of one that is stored. directions: of alphadot, where head and tail alike count."""
    if system.stored("connection"):
        return 0
    size = numerics.grid**system.joints
    if not directions or size > LARGEST_GRID:
        return size // (2 if system.traits.halved else 1)
    unit, grid = connection.directions(system.joints, directions), connection.grid(system.joints, numerics.grid)
    return int(to_solve(images(grid, unit, replace(system.traits, reversible=True)), size).sum())


def zeros(system, numerics, components: tuple[int, ...]) -> Field:
    """A field of zeros on as many points as a spline through one touches."""
    axes = (np.linspace(-1.0, 1.0, numerics.interpolation + 3),) * system.joints
    return Field(axes, np.zeros((*components, *map(len, axes))), numerics.interpolation)


class Path(Tier):
    """Looks the least-squares connection up. Where xi = A alphadot holds exactly it needs none, and is the direct tier."""

    name, label = "path", "path integral of A"
    style = {"color": "#0072B2", "linestyle": "-."}
    offered = range(1, 6)
    looks_up = "connection"
    on_grid = True
    depends_on = ("grid", "extent", "directions", "interpolation")

    def is_direct(self, system) -> bool:
        return system.traits.linear

    def directions(self, system, numerics) -> int:
        """Of alphadot at each shape."""
        return numerics.directions or (8 if system.joints <= 2 else (4 if system.traits.linear else 16) * system.joints)

    def axes(self, system, numerics) -> tuple[np.ndarray, ...]:
        """Of its field; ValueError if that is too large."""
        return axes(system, numerics)

    def around(self, system, numerics) -> bool:
        return around(system, numerics)

    def along(self, system, numerics, count, phases) -> int:
        return count * phases * self.directions(system, numerics)

    def A(self, system, numerics) -> Callable:
        """The connection at shapes (..., d), without a field."""
        return connection.fitted_at(
            system.velocity, system.joints, self.directions(system, numerics), system.traits.linear
        )

    def table(self, system, numerics, *reach, progress=None) -> Any:
        if own := system.stored(self.looks_up):
            return own if own.length else replace(own, unit=length_unit(system), length=system.length)
        return system.fitted(
            axes(system, numerics), self.directions(system, numerics), numerics.interpolation, progress
        )

    def solves(self, system, numerics, gait, count, phases) -> int:
        directions = self.directions(system, numerics)
        return shapes(system, numerics, directions if system.traits.reversible else 0) * directions

    def size(self, system, numerics) -> int:
        return (system.joints + 3) * 3 * numerics.grid**system.joints

    def sample(self, system, numerics) -> Callable | None:
        field = zeros(system, numerics, (3, system.joints))
        return lambda n: field(np.zeros((n, system.joints)))

    def predict(self, table, system, gait, amplitudes, numerics) -> np.ndarray:
        if table is None and not self.is_direct(system):
            A = self.A(system, numerics)
            return path(lambda a, u: np.einsum("...ij,...j->...i", A(a), u), gait, amplitudes, numerics.phases)
        return path(system.velocity if self.is_direct(system) else table, gait, amplitudes, numerics.phases)
