"""Evaluation of a gait by the direct tier, with an estimate of the error."""

from __future__ import annotations

import numpy as np

from geomech.gaits import Gait
from geomech.optimisation import loops as series
from geomech.optimisation.cycles import CycleValues, cycle_values
from geomech.optimisation.optimum import Evaluation
from geomech.optimisation.request import Request
from geomech.studies import estimate
from geomech.studies.effort import change_by_elements
from geomech.studies.elements import elements_of
from geomech.systems.base import body_size
from geomech.systems.capabilities import OwnMetric, capability


def evaluate_gait(r: Request, gait: Gait) -> Evaluation:
    """Return the evaluation of a gait at its own amplitude."""
    system, objective = r.scene.system, r.objective
    phases = max(r.phases, 4 * gait.harmonics)
    (net,), (errors,) = estimate.direct(
        r.scene, gait, np.array([gait.amplitude]), phases
    )
    alpha, alphadot = gait.cycle(phases)
    degree = r.degree if r.power else 1.0
    run = system.run(alpha, alphadot, r.power is not None)
    P = _power(r, run, alpha, alphadot)
    b = _without_slopes(net, *cycle_values(run, P, degree)[1:])
    period, limits = 1.0, []
    if objective.timed:
        period, limits = objective.time(
            np.abs(gait.cycle(series.DENSE)[1]).max(), b.power and b.power[0], degree
        )
    value = objective.value(b, period)[0]
    error = errors[1] if objective.name == "turning" else errors[0]
    length = b.length and b.length[0]
    if objective.name == "efficiency":
        coarse = 2 * np.pi * (P[::2] ** (1 / degree)).mean()
        of_length = abs(length - coarse)
        if elements_of(system):
            quarter = (x[None, ::4] for x in (alpha, alphadot))
            path = 2 * np.pi * (P[::4] ** (1 / degree)).mean()
            values = np.array([[path, np.nan]])
            of_length += change_by_elements(system, *quarter, values)[0, 0]
        error = (error + value * of_length) / (length or 1.0)
    if objective.timed:
        error = error / (2 * np.pi * (period or 1.0))
    work = (
        2 * np.pi * b.power[0]
        if b.power and capability(system, OwnMetric) is None
        else None
    )
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


def _power(r: Request, run, alpha, alphadot) -> np.ndarray | None:
    """Return the power (N,) of a gait that was run, in body drag x body length / time; None where it is not known."""
    if run.work is not None:
        return np.maximum(run.work.power / body_size(r.system), 0.0)
    return (
        None if r.power is None else np.maximum(r.power(alpha, alphadot, run.xi), 0.0)
    )


def _without_slopes(*numbers) -> CycleValues:
    flat = lambda x: (
        None
        if x is None
        else (x if np.ndim(x) else float(x), np.zeros((*np.shape(x), 1)))
    )
    return CycleValues(*map(flat, numbers))
