"""Results of a measured gait: A, nan where there are no data, and all data of a look-up near the gait."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.geometry.curvature import ccf
from geomech.geometry.curvature import error as curvature_error
from geomech.geometry.tube import BEYOND
from geomech.measured.fit import Fitted, fit_log
from geomech.scenes.write import gait_table, table
from geomech.studies import fields
from geomech.studies.fields import INTERVAL_OF_CCF, angles_of
from geomech.studies.question import Allow, Progress, Question
from geomech.studies.tables import COMPONENTS
from geomech.systems.base import body_size

ALONG = "fitted along the gait alone"


def status(fit: Fitted) -> str:
    """Return which part of A is determined and, if not all, why; with the cure where joints depend on each other."""
    if fit.across:
        return "fitted"
    if not fit.combined:
        return f"{ALONG}: its cycles do not vary enough to tell A across it"
    combinations = ", ".join(
        f"{fit.log.joints[k]} is {_sum(fit, factors)}"
        for k, factors in fit.combined.items()
    )
    names = ", ".join(fit.log.joints[k] for k in fit.combined)
    return (
        f"{ALONG}: {combinations}, but for constants and noise, which leaves A across it open: "
        f"leave {names} out of the columns"
    )


def _sum(fit: Fitted, factors: np.ndarray) -> str:
    """Return a linear combination as text, such as 0.5 alpha_1 - 2 alpha_2."""
    terms = (f"{x:.3g} {name}" for x, name in zip(factors, fit.log.joints) if x)
    return " + ".join(terms).replace("+ -", "- ")


@dataclass(frozen=True)
class Fit(Question):
    """The connection near a measured gait, see `fit_log`."""

    log: Path
    columns: tuple[str, ...] = ()
    degrees: bool = False
    level: float = 0.95
    harmonics: int | None = None
    limits: float | None = None
    body_length: float | None = None

    def inputs(self) -> list[Path]:
        return [self.log]

    def answer(self, progress: Progress, allow: Allow) -> Result:
        fit = fit_log(
            self.log,
            columns=self.columns,
            degrees=self.degrees,
            level=self.level,
            harmonics=self.harmonics,
            limits=self.limits,
            body_length=self.body_length,
        )
        (net, error), (mean, mean_error) = fit.displacement, fit.mean
        over, unit = ("component",), f"{fit.unit} (x, y), rad (theta)"
        variables = (
            Variable("component", over, np.array(COMPONENTS)),
            Variable(
                "displacement_measured",
                over,
                mean,
                unit,
                "mean of the log's cycles",
                mean_error,
            ),
            Variable(
                "displacement_predicted",
                over,
                net,
                unit,
                "of the mean gait, by the connection",
                error,
            ),
        )
        return Result("measured", variables, {"status": status(fit)}, fit)


def of_fit(fit: Fitted) -> Result:
    """Return A with its error, the CCF of two joints, and all data of a look-up near the gait.

    `Connection.load` and [system] kind = "table" read it from NetCDF."""
    tube, unit = fit.tube, fit.unit
    error = tube.on_grid(tube.taylor.connection_error)
    variables = [
        *fields.of_connection(tube, error),
        *fields.of_known(tube.taylor, unit),
        fields.of_reach(tube),
    ]
    if len(tube.axes) == 2:
        variables.append(
            fields.of_ccf(ccf(tube), curvature_error(tube), INTERVAL_OF_CCF)
        )
    axes = fields.coordinates(
        tube.axes, [(name, "rad") for name in angles_of(tube.axes)]
    )
    return Result("connection", (*axes, *variables), _about(fit), fit)


def _about(fit: Fitted) -> dict:
    return {
        "title": f"Local connection near the mean gait of the log {fit.log.name}",
        "Conventions": "xi = + A alphadot; CCF = dA + [A, A], positive for counter-clockwise loops",
        "method": "first-order Taylor series of A in the deviation from the mean gait, by regression over all cycles (Bittner, "
        "Hatton and Revzen, Nonlinear Dynamics 94, 1933 (2018))",
        "frame": "that of the log",
        "frame_meaning": "body frame: the one whose x, y and heading were logged",
        "body_length": float(body_size(fit)),
        "length_unit": fit.unit,
        "components": "x, y, theta of the body velocity xi: along the heading, to the left, counter-clockwise",
        "sign_of_A": "xi = + A alphadot",
        "sign_of_ccf": "CCF = dA + [A, A] with [X, Y] = XY - YX, positive for counter-clockwise loops",
        "pair_of_ccf": "CCF_12 = dA_2 / dalpha_1 - dA_1 / dalpha_2 + [A_1, A_2]",
        "interpolation": int(fit.tube.degree),
        "singular_shapes": BEYOND,
        "level": float(fit.known.level),
        "error_factor": float(fit.known.factor),
        "cycles": len(fit.measured),
        "frequency": float(fit.frequency),
        "columns": ", ".join(fit.log.joints),
        "status": status(fit),
    }


def scene_toml(fit: Fitted, field: Path, scene: Path) -> str:
    """Return a scene of the mean gait with the field's file, named relative to the scene."""
    file = os.path.relpath(field.resolve(), scene.resolve().parent)
    head = f"# The mean gait of {len(fit.measured)} cycles of {fit.log.name}, and the connection near it.\n"
    return "\n".join(
        [
            head,
            table("system", {"kind": "table", "file": file}),
            table("gait", gait_table(fit.gait)),
        ]
    )
