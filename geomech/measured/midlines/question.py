"""The question of midlines, and its result: quantities with intervals, along the body, by cycle, and as predicted."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.measured.midlines import kinematics
from geomech.measured.midlines.fit import Kinematics, fit_midlines
from geomech.measured.midlines.kinematics import PARTS, QUANTITIES
from geomech.measured.midlines.predicted import COMPARED, Comparison, compare
from geomech.scenes.read import medium_of
from geomech.studies.question import Allow, Progress, Question
from rft.core.checks import in_range

LABELS = {
    "frequency": "cycles per time",
    "length": "length of the body",
    "speed": "distance of the body's mean frame over time",
    "stride": "distance per cycle",
    "heading": "direction of the way, counter-clockwise from x",
    "drift": "direction of the way less the mean heading of the body",
    "turn": "turn of the body per cycle",
    "slip": "mean angle between body and velocity",
    "efficiency": "wave efficiency: distance per cycle over wavelength",
    "amplitude": "half the range across the way of each cycle, mean over the body",
    "wavelength": "along the way",
    "arc_wavelength": "along the body",
}
SOURCES = "cycles", "noise", "smoothing"  # of errors


@dataclass(frozen=True)
class Midlines(Question):
    """Kinematics of a trial of midlines, and the same predicted in a medium; see `fit_midlines`."""

    midlines: Path
    medium: str | None = None
    columns: tuple[str, ...] = ()
    units: str | None = None
    scale: float | None = None
    fps: float | None = None
    y: str | None = None
    head: str | None = None
    least_score: float | None = None
    individual: str | None = None
    body_length: float | None = None
    mend: bool = False
    level: float = 0.95

    def inputs(self) -> list[Path]:
        return [self.midlines]

    def check(self) -> None:
        if self.medium is not None:
            medium_of(self.medium)
        if self.body_length is not None:
            in_range("``body_length``", self.body_length, 1e-9, 1e9)

    def answer(self, progress: Progress, allow: Allow) -> Result:
        fit = fit_midlines(
            self.midlines, columns=self.columns, units=self.units, scale=self.scale, fps=self.fps, y=self.y, head=self.head,
            least_score=self.least_score, individual=self.individual, body_length=self.body_length, mend=self.mend,
            level=self.level,
        )  # fmt: skip
        return result_of(
            fit, None if self.medium is None else compare(fit, medium_of(self.medium))
        )


def units_of(fit: Kinematics) -> dict[str, str]:
    """Return the unit of each quantity."""
    time, length = fit.trial.unit_of_time, fit.trial.unit
    speed = "m" if length == "m" else "BL"
    return {
        "frequency": "Hz" if time == "s" else "1/frame",
        "length": fit.trial.unit_of_length,
        "speed": f"{speed}/{time}",
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


def with_unit(words: str, unit: str) -> str:
    """Return a value in words with its unit; a pure number has none."""
    if unit in ("", "1", "-"):
        return words
    return f"{words} {unit}"


def result_of(fit: Kinematics, comparison: Comparison | None = None) -> Result:
    """Return all numbers of a trial. The errors are half widths of intervals."""
    found, units = fit.intervals, units_of(fit)
    label = f"half width of the interval of {100 * fit.level:.3g} % of cases"
    variables = [
        Variable(
            name,
            (),
            found.value[k],
            units[name],
            LABELS[name],
            found.half_width[k],
            error_label=label,
        )
        for k, name in enumerate(QUANTITIES)
    ]
    place, n = (np.arange(PARTS) + 0.5) / PARTS, len(QUANTITIES)
    variables.append(
        Variable("s", ("s",), place, "1", "place on the body, tail 0 to head 1")
    )
    for name, k in (("slip", n), ("amplitude", n + PARTS)):
        profile, words = slice(k, k + PARTS), f"{name} of a tenth of the body"
        along = found.value[profile], units[name], words, found.half_width[profile]
        variables.append(Variable(f"{name}_along", ("s",), *along, error_label=label))
    parts = np.stack([found.cycles, found.noise, found.smoothing], -1)[:n]
    variables += [
        Variable("quantity", ("quantity",), np.array(QUANTITIES)),
        Variable("source", ("source",), np.array(SOURCES)),
        Variable(
            "standard_error",
            ("quantity", "source"),
            parts,
            "",
            "of each source, in the unit of the quantity",
        ),
        Variable(
            "per_cycle",
            ("cycle", "quantity"),
            found.per_cycle[:, :n],
            "",
            "pseudo-values, in the unit of the quantity",
        ),
        Variable(
            "cycle_start",
            ("cycle",),
            _starts(fit),
            fit.trial.unit_of_time,
            "time when a cycle begins",
        ),
        *_mean_cycle(fit),
    ]
    if comparison is not None:
        variables += _compared(comparison, units, label)
    return Result(
        "midlines", tuple(variables), _about(fit, comparison), (fit, comparison)
    )


def _starts(fit: Kinematics) -> np.ndarray:
    cycles = fit.cycles(fit.curve)
    return cycles.t[:, 0] - cycles.duration / (2 * kinematics.PHASES)


def _mean_cycle(fit: Kinematics) -> list[Variable]:
    """Return the mean cycle: headings along the body, less their mean over the cycle."""
    headings = fit.cycles(fit.curve).headings
    mean = (headings - headings.mean((1, 2), keepdims=True)).mean(0)
    error = (
        headings.std(0, ddof=1) / np.sqrt(len(headings)) if len(headings) > 1 else None
    )
    phase = 2 * np.pi * (np.arange(kinematics.PHASES) + 0.5) / kinematics.PHASES
    return [
        Variable("phase", ("phase",), phase, "rad", "of the mean cycle"),
        Variable("place", ("place",), fit.curve.places, "1", "on the body, tail 0 to head 1"),
        Variable("mean_cycle", ("phase", "place"), mean, "rad", "headings less their mean", error,
                 error_label="standard error of the mean over cycles"),
    ]  # fmt: skip


def _compared(c: Comparison, units: dict[str, str], label: str) -> list[Variable]:
    variables = [
        Variable(f"{name}_predicted", (), c.predicted[k], units[name], f"{LABELS[name]}, predicted",
                 c.predicted_error[k], error_label=label)
        for k, name in enumerate(COMPARED)
    ]  # fmt: skip
    if c.closing:
        over = ("parameter",)
        variables += [
            Variable("parameter", over, np.array([x.name for x in c.closing])),
            Variable("parameter_present", over, np.array([x.present for x in c.closing]), "", "in the medium"),
            Variable("parameter_closing", over, np.array([x.value for x in c.closing]), "",
                     "which makes the predicted stride the measured one; nan where none does",
                     np.array([x.error for x in c.closing]), error_label=label),
        ]  # fmt: skip
    return variables


def _about(fit: Kinematics, comparison: Comparison | None) -> dict[str, Any]:
    """Return facts about a trial."""
    trial, curve = fit.trial, fit.curve
    about = {
        "title": f"Kinematics of the midlines {trial.name}",
        "file": trial.name,
        "frames": len(trial.t),
        "points": len(trial.names),
        "cycles": len(fit.used),
        "cycles_left_out": len(fit.marks) - 1 - len(fit.used),
        "head": fit.head,
        "modes": curve.modes,
        "knots_per_cycle": float(
            (len(curve.knots) - 11)
            / ((trial.t[-1] - trial.t[0]) * fit.value("frequency")[0])
        ),
        "noise": float(curve.noise / fit.value("length")[0]),
        "level": float(fit.level),
        "frame_meaning": "mean of the body's points and mean heading; heading counter-clockwise from x",
    }
    if comparison is not None:
        about["medium"] = type(comparison.medium).__name__.lower()
    notes = trial.notes if comparison is None else trial.notes + comparison.notes
    return {**about, "notes": "\n".join(notes)}
