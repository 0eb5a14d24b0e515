"""Evaluation of a gait by the direct tier, with an estimate of the error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geomech.mathematics.gaits import Gait
from geomech.mathematics.systems.base import body_size
from geomech.mathematics.systems.capabilities import OwnMetric, capability
from geomech.studies.estimates import estimate
from geomech.studies.estimates.effort import effort_error_by_elements
from geomech.studies.estimates.elements import n_elements
from geomech.studies.optimisation import loops as series
from geomech.studies.optimisation.cycles import CycleValues, cycle_values
from geomech.studies.optimisation.request import Request


@dataclass(frozen=True, eq=False)
class Evaluation:
    """A gait as evaluated by the direct tier.

    value, error: of the objective. displacement: net pose (3,) in the frame at the
    start, x and y in the system's unit, heading in rad; displacement_error: (3,), its
    estimated error. length: of the path; work: of a cycle at a rad of phase per unit of
    time, in body drag x body length; None where these are not known, and for the work
    of a metric that is not one of drag. time: of a rad of phase. limits: names of those
    that set the time."""

    gait: Gait
    value: float
    error: float
    displacement: np.ndarray
    displacement_error: np.ndarray
    length: float | None
    work: float | None
    time: float
    limits: tuple[str, ...]


def evaluate_gait(request: Request, gait: Gait) -> Evaluation:
    """Return the evaluation of a gait at its own amplitude."""
    scene = request.scene
    objective = request.objective
    phases = max(request.phases, 4 * gait.harmonics)
    amplitudes = np.array([gait.amplitude])
    (net,), (errors,) = estimate.direct(scene, gait, amplitudes, phases)
    position_error, heading_error = errors  # body lengths, rad

    alpha, alphadot = gait.cycle(phases)
    degree = 1.0
    if request.power:
        degree = request.degree
    run = scene.system.run(alpha, alphadot, request.power is not None)
    P = _power(request, run, alpha, alphadot)
    _, *others = cycle_values(run, P, degree)
    cycle = CycleValues(*(_without_slopes(x) for x in (net, *others)))
    length = cycle.length and cycle.length[0]
    power = cycle.power and cycle.power[0]

    period = 1.0
    limits: list[str] = []
    if objective.timed:
        fastest = np.abs(gait.cycle(series.DENSE)[1]).max()
        period, limits = objective.time(fastest, power, degree)
    value = objective.value(cycle, period)[0]

    error = position_error
    if objective.name == "turning":
        error = heading_error
    if objective.name == "efficiency":
        length_error = _length_error(request, alpha, alphadot, P, length)
        error = (error + value * length_error) / (length or 1.0)
    if objective.timed:
        error = error / (2 * np.pi * (period or 1.0))

    # The error of the position bounds those of x and of y.
    xy_error = position_error * body_size(scene.system)
    work = None
    if cycle.power and capability(scene.system, OwnMetric) is None:
        work = 2 * np.pi * power
    return Evaluation(
        gait,
        float(value),
        float(error),
        net,
        np.array([xy_error, xy_error, heading_error]),
        length,
        work,
        float(period),
        tuple(limits),
    )


def _length_error(request: Request, alpha, alphadot, P, length: float) -> float:
    """Return the error estimate of the path length: the change with half the phases,
    and with finer elements where the body has any."""
    system = request.scene.system
    root = 1 / request.degree
    coarse = 2 * np.pi * (P[::2] ** root).mean()
    error = abs(length - coarse)
    if n_elements(system):
        # A quarter of the phases is enough for the effect of the elements.
        quarter = 2 * np.pi * (P[::4] ** root).mean()
        values = np.array([[quarter, np.nan]])
        error += effort_error_by_elements(
            system, alpha[None, ::4], alphadot[None, ::4], values
        )[0, 0]
    return error


def _power(request: Request, run, alpha, alphadot) -> np.ndarray | None:
    """Return the power (N,) of a gait that was run, in body drag x body length / time;
    None where it is not known."""
    if run.work is not None:
        return np.maximum(run.work.power / body_size(request.system), 0.0)
    if request.power is None:
        return None
    return np.maximum(request.power(alpha, alphadot, run.xi), 0.0)


def _without_slopes(x) -> tuple | None:
    """Return a number or array with slopes of 0, as `CycleValues` has them."""
    if x is None:
        return None
    if np.ndim(x) == 0:
        x = float(x)
    return x, np.zeros((*np.shape(x), 1))
