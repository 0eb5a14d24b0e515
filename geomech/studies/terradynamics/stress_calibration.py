"""Calibrations of the vertical plane: zeta from a penetration test, nine coefficients
from plate drags."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.io.rows import plain
from geomech.io.rows import read as read_rows
from geomech.scenes.data.drag import LARGEST_FILE
from geomech.scenes.terradynamics import penetration
from geomech.scenes.terradynamics.stress import plate_rows
from rft.core.refusal import Refusal, located
from rft.fits.plates import (
    COEFFICIENTS,
    GENERIC,
    StressFit,
    ZetaFit,
    fit_stress,
    fit_zeta,
)
from rft.fits.rods import student_factor
from rft.terradynamics.plates.survey import survey

# Names of the coefficients in files: B-11 for Bm11.
KEYS = tuple(name.replace("m", "-") for name in COEFFICIENTS)
# A depth of zero force is noted beyond so many of its standard errors, and beyond this
# share of the largest depth.
NOTED_ERRORS = 3.0
NOTED_SHARE = 0.02
UNIT = "N/cm^3"
INTERVAL = "half width of the 95 % confidence interval"
EXPECTED_FILE = "give a CSV file with columns depth_m,force_N"


def plate_drags(
    law: str, source: str, sizes: Mapping[str, float], end_caps: float | str
) -> Result:
    """Return nine coefficients fitted to a CSV file of plate drags. Refusal, one line
    that names the file, for bad ones."""
    _refuse_others(law, sizes, end_caps)
    beta, gamma, *alpha = plate_rows("plate drags", source)
    name = Path(source).name
    with located(name):
        f = fit_stress(np.radians(beta), np.radians(gamma), *alpha)
    undetermined = [KEYS[COEFFICIENTS.index(name)] for name in f.undetermined]
    overview = survey(f.stress)
    notes = _undetermined_notes(name, f, undetermined)
    if overview.pushing:
        notes.append(f"{name}: the fitted map {overview.description()}")
    rms = _rms(f.residuals)
    facts = {
        "file": name,
        "law": law,
        "drags": len(beta),
        "map": overview.description(),
        "medium_toml": _coefficients_text(f, name, rms, undetermined),
    }
    over = ("parameter",)
    rows = ("component", "row")
    pulling = "share of angles at which the map pulls"
    pushing = "share of angles at which the map drives the motion"
    stress = np.array(alpha)
    half_width = student_factor(f.free) * f.errors
    missing = [int(key in undetermined) for key in KEYS]
    variables = [
        Variable("parameter", over, list(KEYS)),
        Variable(
            "value", over, f.values, UNIT, "fitted", half_width, error_label=INTERVAL
        ),
        Variable("generic", over, f.zeta * GENERIC, UNIT, "generic set times zeta"),
        Variable(
            "share_from_data", over, f.resolution, "1",
            "share of each value that the data determine; the rest comes from the "
            "shape of the generic set",
        ),
        Variable(
            "undetermined", over, missing, "1",
            "1 if the data do not determine it",
        ),
        Variable("standard_error", over, f.errors, UNIT, "standard error of the value"),
        Variable(
            "covariance", (*over, "other_parameter"), f.covariance, f"({UNIT})^2",
            "covariance of the parameters",
        ),
        Variable("zeta", (), f.zeta, "1", "zeta of the closest generic set"),
        Variable("rms", (), rms, UNIT, "rms of the residuals"),
        Variable("pulling", (), overview.pulling, "1", pulling),
        Variable("pushing", (), overview.pushing, "1", pushing),
        Variable("component", ("component",), ["alpha_x", "alpha_z"]),
        Variable("beta", ("row",), beta, "degrees", "tilt"),
        Variable("gamma", ("row",), gamma, "degrees", "direction of motion"),
        Variable("stress", rows, stress, UNIT, "measured stress per depth"),
        Variable("fitted", rows, stress - f.residuals, UNIT, "stress by the map"),
        Variable("residual", rows, f.residuals, UNIT, "measured stress minus map"),
        *note_variables(notes),
    ]  # fmt: skip
    return Result("fit_medium", tuple(variables), facts)


def note_variables(notes: list[str]) -> list[Variable]:
    """Return notes as a variable, if there are any."""
    if not notes:
        return []
    return [Variable("note", ("line",), notes)]


def _coefficients_text(
    f: StressFit, name: str, rms: float, undetermined: list[str]
) -> str:
    """Return a file for `geomech stress` and the [medium] of intruder scenes."""
    count = f.residuals.shape[1]
    lines = [
        f"# Fitted to {json.dumps(name)}: {count} plate drags, "
        f"rms residual {rms:.3g} {UNIT}.",
        f"[medium]  # {UNIT}; within, with 95 %:",
    ]
    for key, x, (low, high), share in zip(
        KEYS, f.values.tolist(), f.intervals, f.resolution
    ):
        line = f"{key} = {x!r}  # {low:.4g} to {high:.4g}"
        if key in undetermined:
            line += f"; {100 * (1 - share):.0f} % of it from the generic shape"
        lines.append(line)
    return "\n".join(lines) + "\n"


def _undetermined_notes(name: str, f: StressFit, undetermined: list[str]) -> list[str]:
    """Return a note on the coefficients that the data do not determine, if there are
    any."""
    if not undetermined:
        return []
    beta, gamma = (round(np.degrees(x)) for x in f.least_known())
    return [
        f"{name}: these drags do not determine {', '.join(undetermined)}: they are "
        "taken from the shape of the generic set; drag plates at other angles, above "
        f"all near beta = {beta}, gamma = {gamma} degrees"
    ]


def penetration_test(
    law: str, source: str, sizes: Mapping[str, float], end_caps: float | str
) -> Result:
    """Return zeta fitted to a plate that was pushed straight down, from a CSV file.

    sizes: "area", m^2, which overrules the file's. Refusal, one line that names the
    file, for bad ones."""
    _refuse_others(law, sizes, end_caps, own=("area",))
    test = penetration.read(read_rows(source, LARGEST_FILE, EXPECTED_FILE))
    area = test.area
    if "area" in sizes:
        area = np.array([sizes["area"]])
    with located(test.name):
        if area is None:
            raise Refusal(
                "the area of the plate is missing",
                instead=(
                    "give ``area`` in m^2, or a header line '# plate area = 9.5 cm^2'"
                ),
            )
        f = fit_zeta(test.depth, test.force, area)
    rms = _rms(f.force - f.law)
    facts = {
        "file": test.name,
        "law": law,
        "medium_toml": _zeta_text(f, test.name, rms),
    }
    half_width = f.interval[1] - f.zeta
    if np.ptp(area) == 0:
        area = np.unique(area)
    label = "on a level plate that is pushed down"
    band = f.law * (f.interval[1] / f.zeta - 1)
    variables = [
        Variable("parameter", ("parameter",), ["zeta"]),
        Variable(
            "value", ("parameter",), [f.zeta], "1", "fitted", [half_width],
            error_label=INTERVAL,
        ),
        Variable(
            "standard_error", ("parameter",), [f.error], "1",
            "standard error of the value",
        ),
        Variable(
            "covariance", ("parameter", "other_parameter"), [[f.error**2]], "1",
            "covariance of the parameters",
        ),
        Variable("downward_stress", (), f.zeta, UNIT, label),
        Variable("rms", (), rms, "N", "rms of the residuals"),
        Variable("area", ("plate",), area, "m^2", "area of the plate"),
        Variable("depth", ("row",), f.depth, "m"),
        Variable("force", ("row",), f.force, "N", "measured"),
        Variable(
            "fitted", ("row",), f.law, "N", "force by zeta", band, error_label=INTERVAL
        ),
        Variable(
            "residual", ("row",), f.force - f.law, "N",
            "measured force minus law",
        ),
        *note_variables(_zero_depth_notes(test.name, f)),
    ]  # fmt: skip
    if np.isfinite(f.zero):
        label = "depth at which a straight line through the forces is zero"
        zero = Variable("zero_depth", (), f.zero, "m", label, f.zero_error)
        variables.append(replace(zero, error_label="standard error"))
    return Result("fit_medium", tuple(variables), facts)


def _zeta_text(f: ZetaFit, name: str, rms: float) -> str:
    """Return a file for `geomech stress` and the [medium] of intruder scenes."""
    low, high = f.interval
    return (
        f"# Fitted to {json.dumps(name)}: {f.depth.size} depths, "
        f"rms residual {rms:.3g} N.\n"
        "[medium]  # the generic set times\n"
        f"zeta = {f.zeta!r}  # {low:.4g} to {high:.4g} with 95 %\n"
    )


def _zero_depth_notes(name: str, f: ZetaFit) -> list[str]:
    """Return a note if the force is zero at another depth than zero."""
    shift = abs(f.zero)
    if not (shift > NOTED_ERRORS * f.zero_error and shift > NOTED_SHARE * f.depth[-1]):
        return []
    return [
        f"{name}: a straight line through the forces is zero at a depth of "
        f"{1000.0 * f.zero:.3g} mm: if the surface is there, count depth from it; "
        "otherwise the force is not proportional to depth, and zeta holds only for "
        "these depths"
    ]


def _rms(residuals: np.ndarray) -> float:
    return float(np.sqrt(np.mean(residuals**2)))


def _refuse_others(
    law: str,
    sizes: Mapping[str, float],
    end_caps: float | str,
    own: tuple[str, ...] = (),
) -> None:
    """Refuse options of a rod. own: sizes of this measurement."""
    names = [*sizes]
    if end_caps:
        names.append("end_caps")
    for name in names:
        if name not in own:
            raise Refusal(
                f"``{name}`` belongs to another measurement",
                instead=f"leave it out for ``law`` {law}",
            )


def law_of(source: str) -> str:
    """Return the law that the columns of a file determine; "granular" for a file that
    cannot be read."""
    try:
        rows = read_rows(source, LARGEST_FILE, "")
    except ValueError:
        return "granular"
    words = [plain(word) for word in rows.words]
    if any(word.startswith("psi") for word in words):
        return "granular"
    if any(word.startswith(("alpha_", "beta")) for word in words):
        return "stress-map"
    if penetration.is_penetration(rows):
        return "zeta"
    return "granular"
