"""The result of a trial of midlines: quantities with intervals, along the body, by
cycle, and as predicted."""

from __future__ import annotations

from typing import Any

import numpy as np

from geomech.core.variables import Result, Variable, same_or_each
from geomech.studies.measured.midlines import kinematics
from geomech.studies.measured.midlines.fit import Kinematics
from geomech.studies.measured.midlines.kinematics import PARTS, QUANTITIES
from geomech.studies.measured.midlines.predicted import COMPARED, Comparison

LABELS = {
    "frequency": "cycles per unit of time",
    "body_length": "length from end to end",
    "speed": "distance of the body's mean frame over time",
    "stride": "distance per cycle",
    "heading": "direction of travel, counter-clockwise from x",
    "drift": "direction of travel minus the mean heading of the body",
    "turn": "turn of the body per cycle",
    "slip": "mean angle between the body and its velocity",
    "efficiency": "wave efficiency: stride over wavelength",
    "amplitude": "half the range across the direction of travel, mean over the body",
    "wavelength": "measured along the direction of travel",
    "arc_wavelength": "measured along the body",
}
GIVEN = "as given"
SOURCES = ("cycles", "noise", "smoothing")  # of errors


def units_of(fit: Kinematics) -> dict[str, str]:
    """Return the unit of each quantity."""
    time = fit.trial.unit_of_time
    length, _ = _unit_of_track(fit)
    return {
        "frequency": "Hz" if time == "s" else "1/frame",
        "body_length": fit.trial.unit_of_length,
        "speed": f"{length}/{time}",
        "stride": "BL",
        "heading": "rad",
        "drift": "rad",
        "turn": "rad",
        "slip": "rad",
        "efficiency": "1",
        "amplitude": "BL",
        "wavelength": "BL",
        "arc_wavelength": "BL",
    }


def trial_result(fit: Kinematics, comparison: Comparison | None = None) -> Result:
    """Return all numbers of a trial. The errors are half widths of intervals."""
    units = units_of(fit)
    label = f"half width of the {100 * fit.level:.3g} % confidence interval"
    variables = [*_quantities(fit, units, label), *_along(fit, units, label)]
    variables += [*_sources(fit, units), *_cycles(fit, units), *_mean_cycle(fit)]
    variables += _track(fit)
    notes = fit.trial.notes
    if comparison is not None:
        variables += _compared(fit, comparison, units, label)
        variables += _closing(comparison, label)
        notes = notes + comparison.notes
    if notes:
        variables.append(Variable("note", ("line",), list(notes)))
    return Result("fit_gait", tuple(variables), _about(fit, comparison))


def _quantities(fit: Kinematics, units: dict[str, str], label: str) -> list[Variable]:
    intervals = fit.intervals
    variables = []
    for k, name in enumerate(QUANTITIES):
        variable = Variable(
            name, (), intervals.value[k], units[name], LABELS[name],
            intervals.half_width[k], error_label=label,
        )  # fmt: skip
        if name == "body_length" and fit.trial.length is not None:
            variable = Variable(name, (), fit.trial.length, units[name], GIVEN)
        variables.append(variable)
    noise = float(fit.curve.noise / fit.value("body_length")[0])
    variables.append(Variable("noise", (), noise, "BL", "noise of a point"))
    return variables


def _along(fit: Kinematics, units: dict[str, str], label: str) -> list[Variable]:
    """Return slip and amplitude along the body."""
    intervals = fit.intervals
    place = (np.arange(PARTS) + 0.5) / PARTS
    on_body = "place on the body, tail 0 to head 1"
    variables = [Variable("s", ("s",), place, "1", on_body)]
    first = len(QUANTITIES)  # profiles follow the quantities
    for name in ("slip", "amplitude"):
        profile = slice(first, first + PARTS)
        variable = Variable(
            f"{name}_along", ("s",), intervals.value[profile], units[name],
            f"{name} of a tenth of the body", intervals.half_width[profile],
            error_label=label,
        )  # fmt: skip
        variables.append(variable)
        first += PARTS
    return variables


def _sources(fit: Kinematics, units: dict[str, str]) -> list[Variable]:
    """Return the standard error by each source."""
    intervals = fit.intervals
    parts = np.stack([intervals.cycles, intervals.noise, intervals.smoothing], -1)
    return [
        Variable("quantity", ("quantity",), np.array(QUANTITIES)),
        Variable("source", ("source",), np.array(SOURCES)),
        Variable(
            "standard_error", ("quantity", "source"), parts[: len(QUANTITIES)],
            tuple(units[name] for name in QUANTITIES),
            "standard error from each source",
        ),
    ]  # fmt: skip


def _cycles(fit: Kinematics, units: dict[str, str]) -> list[Variable]:
    """Return the quantities of each cycle."""
    time = fit.trial.unit_of_time
    variables = [
        Variable("cycle_start", ("cycle",), _starts(fit), time, "start of a cycle")
    ]
    for k, name in enumerate(QUANTITIES):
        values = fit.intervals.per_cycle[:, k]
        variables.append(_per_cycle(name, values, units[name]))
    return variables


def _per_cycle(name: str, values: np.ndarray, unit: str, ending: str = "") -> Variable:
    label = "pseudo-value of a cycle"
    return Variable(f"{name}_per_cycle{ending}", ("cycle",), values, unit, label)


def _starts(fit: Kinematics) -> np.ndarray:
    cycles = fit.cycles(fit.curve)
    return cycles.t[:, 0] - cycles.duration / (2 * kinematics.PHASES)


def _mean_cycle(fit: Kinematics) -> list[Variable]:
    """Return the mean cycle: headings along the body, less their mean over the
    cycle."""
    headings = fit.cycles(fit.curve).headings
    each = headings - headings.mean((1, 2), keepdims=True)
    error = None
    if len(headings) > 1:
        error = headings.std(0, ddof=1) / np.sqrt(len(headings))
    phase = 2 * np.pi * (np.arange(kinematics.PHASES) + 0.5) / kinematics.PHASES
    on_body = "place on the body, tail 0 to head 1"
    return [
        Variable("phase", ("phase",), phase, "rad", "phase of the mean cycle"),
        Variable("place", ("place",), fit.curve.places, "1", on_body),
        Variable(
            "mean_cycle", ("phase", "place"), each.mean(0), "rad",
            "headings minus their mean", error,
            error_label="standard error of the mean over cycles",
        ),
    ]  # fmt: skip


def _track(fit: Kinematics) -> list[Variable]:
    """Return the track of the body, and the midlines of its first cycle."""
    unit, size = _unit_of_track(fit)
    place = fit.cycles(fit.curve).place / size
    centre = place.mean(-1)
    first = place[0]
    track_dims = ("cycle", "phase")
    midline_dims = ("phase", "place")
    mean = "mean position of the body"
    of_first = "midlines of the first cycle"
    return [
        Variable("track_x", track_dims, centre.real, unit, mean),
        Variable("track_y", track_dims, centre.imag, unit, mean),
        Variable("midline_x", midline_dims, first.real, unit, of_first),
        Variable("midline_y", midline_dims, first.imag, unit, of_first),
    ]


def _unit_of_track(fit: Kinematics) -> tuple[str, float]:
    """Return the unit of lengths in the world, and its size in the unit of the
    trial."""
    if fit.trial.unit == "m":
        return "m", 1.0
    return "BL", fit.value("body_length")[0]


def _compared(
    fit: Kinematics, c: Comparison, units: dict[str, str], label: str
) -> list[Variable]:
    """Return the prediction: quantities, their distances from the measured ones, the
    quantities of each cycle, and the track."""
    variables = []
    for k, name in enumerate(COMPARED):
        words = f"{LABELS[name]}, predicted"
        variable = Variable(
            f"{name}_predicted", (), c.predicted[k], units[name], words,
            c.predicted_error[k], error_label=label,
        )  # fmt: skip
        variables.append(variable)
        each = c.per_cycle[:, k]
        variables.append(_per_cycle(name, each, units[name], "_predicted"))
    both = np.hypot(c.measured_error, c.predicted_error)
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = np.abs(c.measured - c.predicted) / both
    over = ("compared",)
    unit, _ = _unit_of_track(fit)
    track = _predicted_track(fit, c)
    label = "position of the body at the start of a cycle, predicted"
    return [
        *variables,
        Variable("compared", over, np.array(COMPARED)),
        Variable(
            "apart", over, distance, "1",
            "distance between measured and predicted values over their combined errors",
        ),
        Variable("track_x_predicted", ("begin",), track.real, unit, label),
        Variable("track_y_predicted", ("begin",), track.imag, unit, label),
    ]  # fmt: skip


def _predicted_track(fit: Kinematics, c: Comparison) -> np.ndarray:
    """Return where the body is when cycles begin, and at the end of the last, as
    predicted (C + 1,), x + i y, from where it was at the start."""
    cycles = fit.cycles(fit.curve)
    _, size = _unit_of_track(fit)
    values = dict(zip(COMPARED, c.predicted))
    n_cycles = len(cycles.duration)
    length = fit.value("body_length")[0]
    turns = values["turn"] * (np.arange(n_cycles) - (n_cycles - 1) / 2)
    steps = np.exp(1j * (values["heading"] + turns)) * values["stride"] * length / size
    start = complex(*cycles.starts[0, :2]) / size
    return np.concatenate([[0.0], np.cumsum(steps)]) + start


def _closing(c: Comparison, label: str) -> list[Variable]:
    """Return the values of the medium's parameters that give the measured stride."""
    if not c.closing:
        return []
    over = ("parameter",)
    units = same_or_each([x.unit.replace("-", "1") or "1" for x in c.closing])
    tried = np.array([[x.low, x.high] for x in c.closing], float)
    value = np.array([x.value for x in c.closing])
    error = np.array([x.error for x in c.closing])
    present = np.array([x.present for x in c.closing])
    return [
        Variable("parameter", over, np.array([x.name for x in c.closing])),
        Variable("parameter_present", over, present, units, "value in the medium"),
        Variable(
            "parameter_closing", over, value, units,
            "value that reproduces the measured stride; nan where none does",
            error, error_label=label,
        ),
        Variable("bound", ("bound",), np.array(["low", "high"])),
        Variable(
            "parameter_tried", ("parameter", "bound"), tried, units, "range searched"
        ),
    ]  # fmt: skip


def _about(fit: Kinematics, comparison: Comparison | None) -> dict[str, Any]:
    """Return facts about a trial."""
    trial = fit.trial
    curve = fit.curve
    duration = trial.t[-1] - trial.t[0]
    n_cycles = duration * fit.value("frequency")[0]
    about = {
        "form": "midlines",
        "title": f"Kinematics of the midlines {trial.name}",
        "file": trial.name,
        "frames": len(trial.t),
        "points": len(trial.names),
        "cycles": len(fit.used),
        "cycles_left_out": len(fit.marks) - 1 - len(fit.used),
        "head": fit.head,
        "modes": int(curve.modes),
        "knots_per_cycle": float((len(curve.knots) - 11) / n_cycles),
        "level": float(fit.level),
        "frame_meaning": "mean of the body's points, and mean heading, "
        "counter-clockwise from x",
    }
    if comparison is not None:
        about["medium"] = type(comparison.medium).__name__.lower()
    return about
