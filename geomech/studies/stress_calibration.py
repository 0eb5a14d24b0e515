"""Calibrations of the vertical plane: zeta from a penetration test, nine coefficients from plate drags."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.io.rows import plain
from geomech.io.rows import read as read_rows
from geomech.scenes import penetration
from geomech.scenes.drag import LARGEST_FILE
from geomech.scenes.stress import plate_rows
from rft.core.refusal import Refusal, located
from rft.fits.plates import (
    COEFFICIENTS,
    GENERIC,
    StressFit,
    ZetaFit,
    fit_stress,
    fit_zeta,
)
from rft.terradynamics.plates.survey import survey

KEYS = tuple(
    name.replace("m", "-") for name in COEFFICIENTS
)  # as files have them: B-11 for Bm11
SEEN = 3.0  # standard errors beyond which the depth of zero force is noted
GIVEN = "give a CSV file with columns depth_m,force_N"


def plate_drags(
    law: str, source: str, sizes: Mapping[str, float], end_caps: float | str
) -> Result:
    """Return nine coefficients fitted to a CSV file of plate drags. Refusal, one line that names the file, for bad ones."""
    _refuse(law, sizes, end_caps, ())
    beta, gamma, *alpha = plate_rows("plate drags", source)
    name = Path(source).name
    with located(name):
        f = fit_stress(np.radians(beta), np.radians(gamma), *alpha)
    undetermined = [KEYS[COEFFICIENTS.index(name)] for name in f.undetermined]
    overview, notes = survey(f.stress), _lacking(name, f, undetermined)
    if overview.pushing:
        notes.append(f"{name}: the fitted map {overview.description()}")
    facts = {
        "name": name,
        "undetermined": undetermined,
        "rms": _rms(f.residuals),
        "map": overview.description(),
        "notes": notes,
    }
    over, rows = ("coefficient",), ("component", "row")
    variables = (
        Variable("coefficient", over, np.array(KEYS)),
        Variable("value", over, f.values, "N/cm^3", error=f.errors),
        Variable("interval", (*over, "bound"), f.intervals, "N/cm^3", "with 95 %"),
        Variable(
            "resolution", over, f.resolution, "1", "share that comes from the data"
        ),
        Variable("generic", over, f.zeta * GENERIC, "N/cm^3", "generic set times zeta"),
        Variable("beta", ("row",), beta, "degrees"),
        Variable("gamma", ("row",), gamma, "degrees"),
        Variable("component", ("component",), np.array(["alpha_x", "alpha_z"])),
        Variable("stress", rows, np.array(alpha), "N/cm^3"),
        Variable("residual", rows, f.residuals, "N/cm^3", "stress minus map"),
    )
    return Result("plate_drags", variables, facts, f)


def _lacking(name: str, f: StressFit, undetermined: list[str]) -> list[str]:
    """Return a note on the coefficients that the data do not determine, if there are any."""
    if not undetermined:
        return []
    beta, gamma = (round(np.degrees(x)) for x in f.least_known())
    return [
        f"{name}: these drags do not determine {', '.join(undetermined)}: what they lack is taken from the shape of the "
        f"generic set; drag plates at other angles, least is known at beta = {beta}, gamma = {gamma} degrees"
    ]


def penetration_test(
    law: str, source: str, sizes: Mapping[str, float], end_caps: float | str
) -> Result:
    """Return zeta fitted to a plate that was pushed straight down, from a CSV file.

    sizes: "area", m^2, which overrules the file's. Refusal, one line that names the file, for bad ones."""
    _refuse(law, sizes, end_caps, ("area",))
    test = penetration.read(read_rows(source, LARGEST_FILE, GIVEN))
    area = np.array([sizes["area"]]) if "area" in sizes else test.area
    with located(test.name):
        if area is None:
            raise Refusal(
                "the area of the plate is missing",
                instead="give ``area`` in m^2, or a header line '# plate area = 9.5 cm^2'",
            )
        f = fit_zeta(test.depth, test.force, area)
    facts = {
        "name": test.name,
        "rms": _rms(f.force - f.law),
        "notes": _shifted(test.name, f),
    }
    variables = (
        Variable("zeta", (), f.zeta, "1", error=f.error),
        Variable("interval", ("bound",), f.interval, "1", "of zeta, with 95 %"),
        Variable(
            "area",
            ("plate",),
            np.unique(area) if len({*area.tolist()}) == 1 else area,
            "m^2",
        ),
        Variable("depth", ("row",), f.depth, "m"),
        Variable("force", ("row",), f.force, "N"),
        Variable(
            "law",
            ("row",),
            f.law,
            "N",
            error=f.law * (f.interval[1] / f.zeta - 1),
            error_label="95 %",
        ),
    )
    return Result("penetration", variables, facts, f)


def _shifted(name: str, f: ZetaFit) -> list[str]:
    """Return a note if the force is zero at another depth than zero."""
    if not (abs(f.zero) > SEEN * f.zero_error and abs(f.zero) > 0.02 * f.depth[-1]):
        return []
    return [
        f"{name}: a straight line through the forces is zero at a depth of {1e3 * f.zero:.3g} mm: if the surface is there, "
        "count depth from it; if not, the force is not in proportion to depth, and zeta holds for these depths alone"
    ]


def _rms(residuals: np.ndarray) -> float:
    return float(np.sqrt(np.mean(residuals**2)))


def _refuse(
    law: str, sizes: Mapping[str, float], end_caps, known: tuple[str, ...]
) -> None:
    """Refuse options that belong to a rod."""
    for name in (*sizes, *(["end_caps"] if end_caps else [])):
        if name not in known:
            raise Refusal(
                f"``{name}`` belongs to another measurement",
                instead=f"leave it out for ``law`` {law}",
            )


def law_of(source: str) -> str:
    """Return the law that the columns of a file determine; "granular" for a file that cannot be read."""
    try:
        rows = read_rows(source, LARGEST_FILE, "")
    except ValueError:
        return "granular"
    words = [plain(word) for word in rows.words]
    if any(word.startswith("psi") for word in words):
        return "granular"
    if any(word.startswith(("alpha_", "beta")) for word in words):
        return "stress-map"
    return "zeta" if penetration.is_penetration(rows) else "granular"
