"""The minimum-perturbation frame of a scene, which depends on its numerics."""

from __future__ import annotations

from geomech.mathematics.geometry import connection
from geomech.mathematics.systems.base import System
from geomech.mathematics.systems.framed import NAME, Framed
from geomech.mathematics.systems.table import Table
from geomech.mathematics.tiers.base import Numerics
from geomech.mathematics.tiers.fitted import LARGEST_FIELD, LARGEST_GRID, directions
from rft.core.refusal import Refusal


def framed(system: System, numerics: Numerics) -> System:
    """Return a system in its minimum-perturbation frame, on the grid of the numerics;
    the same object where its frame is this one already. Refusal for a grid that is too
    large."""
    if isinstance(system, Table):
        return system.in_frame(NAME)  # on the grid of its file
    inner = system.inner if isinstance(system, Framed) else system
    shapes = numerics.grid**inner.joints
    largest = LARGEST_GRID
    if inner.joints > 3:
        largest = min(LARGEST_GRID, LARGEST_FIELD)
    if shapes > largest:
        raise Refusal(
            f"a frame on a grid of {numerics.grid}^{inner.joints} shapes is too large",
            instead="lower [numerics] grid, or use a body of two shape variables, "
            "such as a chain with [body] modes or a serpenoid",
        )
    axes = connection.grid(inner.joints, numerics.grid, numerics.extent)
    grid = tuple(tuple(a.tolist()) for a in axes)
    new = Framed(inner, grid, directions(inner, numerics), numerics.interpolation)
    return system if new == system else new


def reframed(system: System, numerics: Numerics) -> System:
    """Return a system whose frame depends on numerics with the frame of these; any
    other system unchanged."""
    if isinstance(system, Framed):
        return framed(system, numerics)
    return system
