"""Evaluators of cycles: the balance of forces, or tables of its results on a grid."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from geomech.mathematics.geometry import metric
from geomech.mathematics.systems.base import body_size
from geomech.studies.optimisation.cycles import Phases, Runs
from geomech.studies.optimisation.request import Request
from geomech.studies.scene_tables import SceneTables


def direct(request: Request, phases: int | None = None) -> Phases | Runs:
    """Return cycles by the direct tier, at the phases of the loops or at others."""
    system = request.system
    costs = request.objective.costs
    degree = request.degree if costs else 1.0
    loops = request.loops
    if phases is not None:
        loops = dataclasses.replace(loops, phases=phases)
    if request.uses_runs:
        return Runs(loops, system.run, costs, degree, body_size(system))
    velocity = system.velocity
    if request.table is not None:
        velocity = _clipped(velocity, request.loops.box)
    power = request.power if costs else None
    return Phases(loops, velocity, power, degree)


def build_tables(request: Request) -> tuple:
    """Return the harmonics of the velocity on a grid, and the norm of the cost of
    moving; None in its place if the objective has no cost."""
    scene = request.scene.changed(system=request.system)
    study = SceneTables(scene).with_numerics(extent=request.extent)
    harmonics = study.compute_harmonics()
    if not request.objective.costs:
        return harmonics, None

    def norm(alpha, alphadot):
        xi = request.system.velocity(alpha, alphadot)
        return request.power(alpha, alphadot, xi) ** (1 / request.degree)

    return harmonics, metric.fit_norm(norm, harmonics.axes)


def from_tables(request: Request, harmonics, norm) -> Phases:
    """Return cycles by interpolation in the tables of `build_tables`."""
    box = (-request.extent, request.extent)
    velocity = _clipped(harmonics.velocity, box)
    degree = request.degree if request.objective.costs else 1.0
    if norm is None:
        return Phases(request.loops, velocity, None, degree)
    cost = _clipped(norm.norm, box)

    def power(alpha, alphadot, xi):
        return cost(alpha, alphadot) ** request.degree

    return Phases(request.loops, velocity, power, degree)


def _clipped(function: Callable, box) -> Callable:
    """Return a function(alpha, alphadot) that moves shapes outside the box, (lowest,
    highest), to its edge."""

    def clipped(alpha, alphadot):
        return function(np.clip(alpha, *box), alphadot)

    return clipped
