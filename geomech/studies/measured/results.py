"""Results of a measured gait: displacements as logged and by the connection near it, A
along it, and all data of a look-up there."""

from __future__ import annotations

from typing import Any

import numpy as np

from geomech.core.variables import COMPONENTS, POSE, Result, Variable
from geomech.mathematics.geometry.curvature import ccf
from geomech.mathematics.geometry.curvature import error as curvature_error
from geomech.mathematics.geometry.representations.tube import BEYOND
from geomech.mathematics.systems.base import body_size
from geomech.studies.maps import fields
from geomech.studies.maps.fields import INTERVAL_OF_CCF, angle_names
from geomech.studies.measured.fit import PRINTED_PHASES, Fitted

ALONG = "fitted only along the gait"
DOTS = 4000  # rows of the log, at most, whose shapes a picture shows


def status(fit: Fitted) -> str:
    """Return which part of A is determined and, if not all, why; with the cure where
    joints depend on each other."""
    if fit.across:
        return "fitted"
    if not fit.combined:
        return f"{ALONG}: its cycles vary too little to determine A across it"
    combinations = []
    for k, factors in fit.combined.items():
        combinations.append(f"{fit.log.joints[k]} is {_sum(fit, factors)}")
    names = [fit.log.joints[k] for k in fit.combined]
    return (
        f"{ALONG}: {', '.join(combinations)}, apart from constants and noise, so that "
        f"A across it is undetermined: leave {', '.join(names)} out of the columns"
    )


def _sum(fit: Fitted, factors: np.ndarray) -> str:
    """Return a linear combination as text, such as 0.5 alpha_1 - 2 alpha_2."""
    terms = (f"{x:.3g} {name}" for x, name in zip(factors, fit.log.joints) if x)
    return " + ".join(terms).replace("+ -", "- ")


def fit_result(fit: Fitted, mapped: bool = True) -> Result:
    """Return all numbers of a measured gait. mapped: with A and its error on a grid,
    and the CCF of two joints, nan where there are no data.

    `Connection.load` and [system] kind = "table" read a file of it that is mapped."""
    variables = [
        *_displacements(fit),
        *_quality(fit),
        *_along(fit),
        *_cycles(fit),
        *fields.taylor_variables(fit.taylor, fit.unit),
    ]
    lead = [
        Variable("component", ("component",), np.array(COMPONENTS)),
        Variable(
            "joint", ("joint",), np.arange(1, len(fit.log.joints) + 1, dtype="i4")
        ),
    ]
    facts = _about(fit)
    if mapped:
        axes, maps = _maps(fit)
        lead += axes
        variables += maps
        facts["interpolation"] = int(fit.tube.degree)
        facts["singular_shapes"] = BEYOND
    return Result("fit_gait", (*lead, *variables), facts)


def _units(fit: Fitted) -> tuple[str, str, str]:
    return (fit.unit, fit.unit, "rad")


def _displacements(fit: Fitted) -> list[Variable]:
    """Return the displacement of a cycle, as logged and of the mean gait."""
    net, error = fit.displacement
    mean, mean_error = fit.mean
    interval = f"half width of the {100 * fit.taylor.level:.3g} % confidence interval"
    found = []
    for ending, label, values, errors in (
        ("", "displacement per cycle, mean of the log", mean, mean_error),
        (
            "_predicted",
            "displacement per cycle of the mean gait, from the connection",
            net,
            error,
        ),
    ):
        for name, value, half_width, unit in zip(POSE, values, errors, _units(fit)):
            variable = Variable(
                f"{name}{ending}", (), value, unit, label, half_width,
                error_label=interval,
            )  # fmt: skip
            found.append(variable)
    return found


def _quality(fit: Fitted) -> list[Variable]:
    """Return how well the connection explains the log."""
    over = ("component",)
    rates = fields.component_units(fit.unit, "rad")
    difference = np.sqrt(((fit.measured - fit.predicted) ** 2).mean(0))
    recorded = (*fit.log.joints, *POSE)
    of_time = "Hz" if fit.log.seconds else "1/unit of t"
    noise_units = ("rad",) * len(fit.log.joints) + _units(fit)
    return [
        Variable("frequency", (), fit.frequency, of_time, "cycles per unit of t"),
        Variable(
            "phase_residual", (), fit.irregular, "rad",
            "rms deviation of the phase from uniform progress through each cycle",
        ),
        Variable(
            "harmonics", (), fit.taylor.A.shape[-1] // 2, "1", "harmonics of A in phase"
        ),
        Variable(
            "difference", over, difference, _units(fit),
            "rms difference between logged and predicted cycles",
        ),
        Variable(
            "scatter", over, fit.measured.std(0), _units(fit),
            "standard deviation of the logged cycles",
        ),
        Variable(
            "explained", over, fit.explained, "1",
            "explained share of the squares of xi",
        ),
        Variable(
            "residual", over, fit.residual, rates,
            "rms residual of xi over the rms of the joint rates",
        ),
        Variable(
            "misfit", over, fit.misfit, rates,
            "rms over the phase of the error of A along the gait, from the residual "
            "of the fit",
        ),
        Variable("recorded", ("recorded",), np.array(recorded)),
        Variable("noise", ("recorded",), fit.noise, noise_units, "noise of a row"),
    ]  # fmt: skip


def _along(fit: Fitted) -> list[Variable]:
    """Return A, its error, and the reach of the data along the mean gait."""
    t = 2 * np.pi * np.arange(PRINTED_PHASES) / PRINTED_PHASES
    A, error = (np.moveaxis(x, 0, -1) for x in fit.along(t))
    rates = fields.component_units(fit.unit, "rad")
    return [
        Variable("phase", ("phase",), t, "rad", "phase of the mean gait"),
        Variable(
            "A_along", ("component", "joint", "phase"), A, rates,
            "A along the mean gait", error,
            error_label="half width of the confidence interval of A",
        ),
        Variable(
            "reach_along", ("phase",), _reach(fit), "rad",
            "half width of the data across the gait, in the direction in which it "
            "is smallest",
        ),
    ]  # fmt: skip


def _reach(fit: Fitted) -> np.ndarray:
    """Return the half width of the data across the gait, rad, in the direction in which
    it is least, at PRINTED_PHASES."""
    spread = fit.taylor.spread
    least = np.sqrt(np.linalg.eigvalsh(np.moveaxis(spread, -1, 0))[:, 0])
    return least[np.arange(PRINTED_PHASES) * spread.shape[-1] // PRINTED_PHASES]


def _cycles(fit: Fitted) -> list[Variable]:
    """Return the displacement of each cycle, and shapes of rows of the log."""
    of_time = "s" if fit.log.seconds else "unit of t"
    starts = "start of a cycle"
    found = [Variable("cycle_start", ("cycle",), fit.times[:-1], of_time, starts)]
    for ending, values, label in (
        ("", fit.measured, "displacement as logged"),
        (
            "_predicted",
            fit.predicted,
            "displacement predicted by the connection for its own shapes",
        ),
    ):
        for k, (name, unit) in enumerate(zip(POSE, _units(fit))):
            name = f"{name}_per_cycle{ending}"
            found.append(Variable(name, ("cycle",), values[:, k], unit, label))
    shapes = fit.samples.alpha
    shapes = shapes[:: max(1, len(shapes) // DOTS)]
    label = "smoothed shapes of rows of the log"
    return [*found, Variable("shapes", ("row", "joint"), shapes, "rad", label)]


def _maps(fit: Fitted) -> tuple[list[Variable], list[Variable]]:
    """Return the axes of shape space, and fields over them."""
    tube = fit.tube
    error = tube.on_grid(tube.taylor.connection_error)
    labels = [(name, "rad") for name in angle_names(tube.axes)]
    _, _, *axes = fields.coordinates(tube.axes, labels)
    maps = [*fields.connection_variables(tube, error), fields.reach_variable(tube)]
    if len(tube.axes) == 2:
        error = curvature_error(tube)
        maps.append(fields.ccf_variable(ccf(tube), error, INTERVAL_OF_CCF))
    return axes, maps


def _about(fit: Fitted) -> dict[str, Any]:
    return {
        "form": "log",
        "file": fit.log.name,
        "title": f"Local connection near the mean gait of the log {fit.log.name}",
        "Conventions": "xi = + A alphadot; CCF = dA + [A, A], positive for "
        "counter-clockwise loops",
        "method": "first-order Taylor series of A in the deviation from the mean gait, "
        "by regression over all cycles (Bittner, Hatton and Revzen, Nonlinear Dynamics "
        "94, 1933 (2018))",
        "frame": "that of the log",
        "frame_meaning": "body frame: the one whose x, y and heading were logged",
        "body_length": float(body_size(fit)),
        "length_unit": fit.unit,
        "components": "x, y, theta of the body velocity xi: along the heading, to the "
        "left, counter-clockwise",
        "sign_of_A": "xi = + A alphadot",
        "sign_of_ccf": "CCF = dA + [A, A] with [X, Y] = XY - YX, positive for "
        "counter-clockwise loops",
        "pair_of_ccf": "CCF_12 = dA_2 / dalpha_1 - dA_1 / dalpha_2 + [A_1, A_2]",
        "level": float(fit.taylor.level),
        "error_factor": float(fit.taylor.factor),
        "cycles": len(fit.measured),
        "rows": len(fit.log.t),
        "columns": ", ".join(fit.log.joints),
        "status": status(fit),
    }
