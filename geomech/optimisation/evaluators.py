"""Evaluators of cycles: the balance of forces, or tables of its results on a grid."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from geomech.geometry import metric
from geomech.optimisation.cycles import Phases, Runs
from geomech.optimisation.request import Request
from geomech.studies.study import Study
from geomech.systems.base import body_size


def direct(r: Request, phases: int | None = None) -> Phases | Runs:
    """Return cycles by the direct tier, at the phases of the loops or at others."""
    degree = r.degree if r.objective.costs else 1.0
    loops = r.loops if phases is None else dataclasses.replace(r.loops, phases=phases)
    if r.by_runs:
        return Runs(loops, r.system.run, r.objective.costs, degree, body_size(r.system))
    velocity = (
        _inside(r.system.velocity, r.loops.box) if r.stored else r.system.velocity
    )
    return Phases(loops, velocity, r.power if r.objective.costs else None, degree)


def build_tables(r: Request) -> tuple:
    """Return the harmonics of the velocity on a grid, and the norm of the cost of moving; None if the objective has no cost."""
    study = Study(r.scene.changed(system=r.system)).with_numerics(extent=r.extent)
    harmonics = study.compute_harmonics()
    if not r.objective.costs:
        return harmonics, None
    run = lambda alpha, alphadot: (
        r.power(alpha, alphadot, r.system.velocity(alpha, alphadot)) ** (1 / r.degree)
    )
    return harmonics, metric.fit_norm(run, harmonics.axes)


def from_tables(r: Request, harmonics, norm) -> Phases:
    """Return cycles by interpolation in the tables of `build_tables`."""
    power, box = None, (-r.extent, r.extent)
    if norm is not None:
        cost = _inside(norm.norm, box)
        power = lambda alpha, alphadot, xi: cost(alpha, alphadot) ** r.degree
    return Phases(
        r.loops,
        _inside(harmonics.velocity, box),
        power,
        r.degree if r.objective.costs else 1.0,
    )


def _inside(look_up: Callable, box) -> Callable:
    """Return a look-up that moves shapes outside its field to the edge of the field."""
    return lambda alpha, alphadot: look_up(np.clip(alpha, *box), alphadot)
