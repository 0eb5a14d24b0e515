"""What gives the cycles of a search: the balance of forces, or tables of what it gave on a grid."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from geomech.geometry import metric
from geomech.optimise.cycles import Phases, Runs
from geomech.optimise.request import Request
from geomech.study.bench import Study


def direct(r: Request, phases: int | None = None) -> Phases | Runs:
    """Cycles by the direct tier, at the phases of the loops or at others."""
    degree = r.degree if r.aim.costs else 1.0
    loops = r.loops if phases is None else dataclasses.replace(r.loops, phases=phases)
    if r.whole:
        return Runs(loops, r.system.run, r.aim.costs, degree, r.system.length)
    velocity = _inside(r.system.velocity, r.loops.box) if r.stored else r.system.velocity
    return Phases(loops, velocity, r.power if r.aim.costs else None, degree)


def looked_up(r: Request) -> tuple:
    """(harmonics of the velocity, and the norm of what moving costs if that is asked for), on a grid."""
    study = Study(r.scene.changed(system=r.system)).turned(extent=r.extent)
    found = study.compute_harmonics()
    if not r.aim.costs:
        return found, None
    run = lambda alpha, alphadot: r.power(alpha, alphadot, r.system.velocity(alpha, alphadot)) ** (1 / r.degree)
    return found, metric.fit_norm(run, found.axes)


def table(r: Request, harmonics, norm) -> Phases:
    """Cycles by what is `looked_up`."""
    power, box = None, (-r.extent, r.extent)
    if norm is not None:
        cost = _inside(norm.norm, box)
        power = lambda alpha, alphadot, xi: cost(alpha, alphadot) ** r.degree
    return Phases(r.loops, _inside(harmonics.velocity, box), power, r.degree if r.aim.costs else 1.0)


def _inside(look_up: Callable, box) -> Callable:
    """A look-up that takes shapes beyond its field for those at its edge."""
    return lambda alpha, alphadot: look_up(np.clip(alpha, *box), alphadot)
