"""Evaluation of a gait by the direct tier, with an estimate of the error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geomech.gaits import Gait
from geomech.optimisation import loops as series
from geomech.optimisation.cycles import CycleValues, cycle_values
from geomech.optimisation.request import Request
from geomech.studies import estimate
from geomech.studies.effort import effort_error_by_elements
from geomech.studies.elements import n_elements
from geomech.systems.base import body_size
from geomech.systems.capabilities import OwnMetric, capability


@dataclass(frozen=True, eq=False)
class Evaluation:
    """A gait as evaluated by the direct tier.

    value, error: of the objective. heading: error of the net turn, rad. displacement:
    net pose (3,) in the frame at the start, in the system's unit. length: of the path;
    work: of a cycle at a rad of phase per unit of time, in body drag x body length;
    None where these are not known, and for the work of a metric that is not one of
    drag. time: of a rad of phase. limits: names of those that set the time."""

    gait: Gait
    value: float
    error: float
    heading: float
    displacement: np.ndarray
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

    alpha, alphadot = gait.cycle(phases)
    degree = request.degree if request.power else 1.0
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

    error = errors[1] if objective.name == "turning" else errors[0]
    if objective.name == "efficiency":
        length_error = _length_error(request, alpha, alphadot, P, length)
        error = (error + value * length_error) / (length or 1.0)
    if objective.timed:
        error = error / (2 * np.pi * (period or 1.0))

    work = None
    if cycle.power and capability(scene.system, OwnMetric) is None:
        work = 2 * np.pi * power
    return Evaluation(
        gait,
        float(value),
        float(error),
        float(errors[1]),
        net,
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
    value = x if np.ndim(x) else float(x)
    return value, np.zeros((*np.shape(x), 1))
