"""Frames that are computed for a scene: they depend on its numerics."""

from __future__ import annotations

from geomech.geometry import connection
from geomech.systems.base import System
from geomech.systems.framed import NAME, Framed
from geomech.systems.table import Table
from geomech.tiers.base import Numerics
from geomech.tiers.fitted import LARGEST_FIELD, LARGEST_GRID, directions
from rft.core.refusal import Refusal


def framed(system: System, numerics: Numerics) -> System:
    """Return a system in its minimum-perturbation frame, on the grid of the numerics; the same object where these
    change nothing."""
    if isinstance(system, Table):
        return system.in_frame(NAME)  # on the grid of its file
    inner = system.inner if isinstance(system, Framed) else system
    if (count := numerics.grid**inner.joints) > LARGEST_GRID or (
        inner.joints > 3 and count > LARGEST_FIELD
    ):
        raise Refusal(
            f"a frame on a grid of {numerics.grid}^{inner.joints} shapes is too large",
            instead="lower [numerics] grid, or take a body of two shape variables, such as a chain with "
            "[body] modes or a serpenoid",
        )
    axes = connection.grid(inner.joints, numerics.grid, numerics.extent)
    grid = tuple(tuple(a.tolist()) for a in axes)
    new = Framed(inner, grid, directions(inner, numerics), numerics.interpolation)
    return system if new == system else new


def reframed(system: System, numerics: Numerics) -> System:
    """Return a system whose frame depends on the numerics, computed with these; any other unchanged."""
    return framed(system, numerics) if isinstance(system, Framed) else system
