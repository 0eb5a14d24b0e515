"""Calibrations: a law and its covariance from measurements, by the law's name."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from geomech.core.errors import choose
from geomech.core.variables import Result, Variable, same_or_each
from geomech.scenes.data import drag
from geomech.scenes.write import table
from geomech.studies.terradynamics.stress_calibration import (
    INTERVAL,
    law_of,
    penetration_test,
    plate_drags,
)
from rft.core.refusal import Refusal, located
from rft.fits.rods import FITS, Fit, fit, student_factor
from rft.laws.drag import Rod, rod_drag

UNITS = {"axial_stress": "Pa", "axial_force": "N", "gamma0_deg": "degrees"}
SIZES = {"radius": "m", "length": "m", "depth": "m", "density": "kg/m^3"}
CURVE = np.linspace(0.0, np.pi / 2, 181)  # attack angles at which a law is drawn, rad
FORCE_DECIMALS = 12  # of forces by a law, N


def chosen_law(source: str, law: str | None) -> str:
    """Return the name of a law to be fitted, checked; for None the law that the columns
    of the file determine."""
    if law is None:
        law = law_of(source)
    return choose("``law``", law, CALIBRATIONS)


def answer(
    source: str,
    law: str | None = None,
    sizes: Mapping[str, float] | None = None,
    end_caps: float | str = 0.0,
) -> Result:
    """Return a law fitted to the measurements of a file, with its medium as text.

    law: one of CALIBRATIONS, by the columns of the file if None. sizes: of the rod or
    plate, which overrule the file's. end_caps: e of the rod's ends (`rft.EndCaps`), 0
    to leave them out, or "fitted". Refusal, one line that names the file, if the data
    are bad or do not determine the law."""
    name = chosen_law(source, law)
    return CALIBRATIONS[name](name, source, sizes or {}, end_caps)


def rod_fit(
    source: str,
    law: str = "granular",
    sizes: Mapping[str, float] | None = None,
    end_caps: float | str = 0.0,
) -> Fit:
    """Return a law fitted to the drag on a rod (`rft.fits.rods`), as `answer` does."""
    return _fit(law, drag.read(source), sizes or {}, end_caps)


def _fit(
    law: str,
    measured: drag.RodDrag,
    sizes: Mapping[str, float],
    end_caps: float | str,
) -> Fit:
    if "area" in sizes:
        raise Refusal(
            "``area`` belongs to another measurement",
            instead=f"leave it out for ``law`` {law}",
        )
    with located(measured.name):
        rod = Rod(**{**measured.sizes, **sizes})
        return fit(law, rod_drag(*measured.rows, measured.ends), rod, end_caps)


def rod_drags(
    law: str, source: str, sizes: Mapping[str, float], end_caps: float | str
) -> Result:
    """Return a law fitted to the drag on a rod."""
    measured = drag.read(source)
    f = _fit(law, measured, sizes, end_caps)
    # A fitted value may be none that a medium can have, such as a k of thousands.
    with located(measured.name):
        text = medium_text(f, measured.name)
    facts = {
        "file": measured.name,
        "law": f.law,
        "forces": f.data.n_forces,
        "angles": f.data.n_angles,
        "medium_toml": text,
    }
    missing = [name for name in SIZES if not getattr(f.rod, name)]
    if FITS[law].granular and missing:
        facts["lacks"] = ", ".join(missing)
    variables = fit_variables(f, measured.rows[0])
    return Result("fit_medium", tuple(variables), facts)


def fit_variables(f: Fit, psi: np.ndarray) -> list[Variable]:
    """Return the variables of a law fitted to the drag on a rod. psi: (N,), the attack
    angles of the measurements, degrees."""
    return [
        *_parameter_variables(f),
        *_rod_variables(f),
        *_row_variables(f, psi),
        *_curve_variables(f),
    ]


def _parameter_variables(f: Fit) -> list[Variable]:
    """Return the parameters of a law."""
    over = ("parameter",)
    names = [_displayed_name(name) for name in f.names]
    units = same_or_each([UNITS.get(name, "1") for name in names])
    half_width = student_factor(f.degrees_of_freedom) * f.errors
    return [
        Variable("parameter", over, names),
        Variable(
            "value", over, _with_degrees(f, f.values), units, "fitted",
            _with_degrees(f, half_width), error_label=INTERVAL,
        ),
        Variable(
            "standard_error", over, _with_degrees(f, f.errors), units,
            "standard error of the value",
        ),
        Variable(
            "covariance", (*over, "other_parameter"), f.covariance, "",
            "covariance of the parameters, gamma0 in rad",
        ),
    ]  # fmt: skip


def _rod_variables(f: Fit) -> list[Variable]:
    """Return forces on the whole rod, residuals and sizes, as far as they are known."""
    found = [
        Variable("axial_force", (), f.axial_force, "N", "axial force on the whole rod")
    ]
    if f.axial_stress is not None:
        label = "axial force over the projected area"
        found.append(Variable("axial_stress", (), f.axial_stress, "Pa", label))
    found.append(Variable("rms", (), f.rms, "N", "rms of the residuals"))
    repeated = repeats(f.data.psi, f.data.forces)
    if repeated is not None:
        label = "rms of forces about their means at equal angles"
        found.append(Variable("repeats_rms", (), repeated, "N", label))
    label = "e of both ends together, 0 if they are left out"
    found.append(Variable("end_caps", (), f.end_caps, "1", label))
    for name, unit in SIZES.items():
        size = getattr(f.rod, name)
        if size is not None:
            label = "density of the bed" if name == "density" else "size of the rod"
            found.append(Variable(f"rod_{name}", (), size, unit, label))
    return found


def _row_variables(f: Fit, psi: np.ndarray) -> list[Variable]:
    """Return the measured forces beside those by the law."""
    over = ("component", "row")
    folded = "attack angle, folded into 0 to 90 degrees"
    fitted = np.round(f.data.forces - f.residuals, FORCE_DECIMALS) + 0.0
    return [
        Variable("component", ("component",), ["parallel", "perpendicular"]),
        Variable("psi", ("row",), psi, "degrees", "attack angle"),
        Variable("folded_psi", ("row",), np.degrees(f.data.psi), "degrees", folded),
        Variable("force", over, f.data.forces, "N", "measured"),
        Variable("fitted", over, fitted, "N", "force by the law"),
        Variable("residual", over, f.residuals, "N", "force minus law"),
    ]


def _curve_variables(f: Fit) -> list[Variable]:
    """Return the law against the attack angle."""
    return [
        Variable("angle", ("angle",), np.degrees(CURVE), "degrees", "attack angle"),
        Variable(
            "law_curve", ("component", "angle"), f.forces(CURVE), "N",
            "force by the law",
            f.band(CURVE), error_label="half width of the 95 % confidence band",
        ),
    ]  # fmt: skip


def medium_text(f: Fit, name: str) -> str:
    """Return the text of a file that a scene takes as ``[medium] file``. name: of the
    file of the measurements."""
    size = f"{f.data.n_angles} angles, rms residual {f.rms:.3g} N"
    lines = [f"# Fitted to {json.dumps(name)}: {size}{_covariance_words(f)}."]
    if f.data.ends is not None and f.end_caps:
        # The last two parameters are those of the ends.
        parts = []
        for key, x, error in zip(("e", "across"), f.values[-2:], f.errors[-2:]):
            parts.append(f"{key} = {x:.3g} +- {error:.2g}")
        lines.append(
            "# Of the flank alone. Both ends together, in [[effects]] kind = "
            f'"end-caps": {", ".join(parts)}.'
        )
    return "\n".join([*lines, table("medium", _medium(f))])


def _covariance_words(f: Fit) -> str:
    """Return the end of a comment that names the parameters with a covariance; "" for
    none."""
    uncertain = getattr(f.medium, "uncertain", ())
    if not uncertain:
        return ""
    words = f"; covariance of {', '.join(uncertain)}"
    if "gamma0" in uncertain:
        words = f"{words}, gamma0 in rad"
    return f"{words}, widened for {f.degrees_of_freedom} degrees of freedom (Student)"


def _medium(f: Fit) -> dict[str, Any]:
    """Return the table [medium] of a fitted law."""
    found: dict[str, Any] = {"law": f.law}
    for field in dataclasses.fields(f.medium):
        value = getattr(f.medium, field.name)
        if value is None:
            continue
        if field.name == "gamma0":
            value = math.degrees(value)
        if field.name == "covariance":
            value = [list(row) for row in value]
        found[_displayed_name(field.name)] = value
    return found


def _with_degrees(f: Fit, values: np.ndarray) -> np.ndarray:
    """Return values (n,) of the parameters with gamma0 in degrees."""
    found = np.array(values, float)
    for k, name in enumerate(f.names):
        if name == "gamma0":
            found[k] = np.degrees(found[k])
    return found


def _displayed_name(name: str) -> str:
    """Return the name under which results and files have a parameter: that of gamma0
    tells its unit, degrees."""
    if name == "gamma0":
        return "gamma0_deg"
    return name


def repeats(psi: np.ndarray, forces: np.ndarray) -> float | None:
    """Return the root mean square of forces (2, N) about their means at equal angles
    psi (N,), N, with the degrees of freedom that these leave; None if no angle is
    repeated.
    No law can have smaller residuals."""
    _, group, counts = np.unique(psi.round(9), return_inverse=True, return_counts=True)
    degrees_of_freedom = psi.size - counts.size
    if degrees_of_freedom < 1:
        return None
    means = np.array([np.bincount(group, f) / counts for f in forces])
    squares = ((forces - means[:, group]) ** 2).sum()
    return float(np.sqrt(squares / (2 * degrees_of_freedom)))


CALIBRATIONS: dict[str, Callable[..., Result]] = {
    **dict.fromkeys(FITS, rod_drags),
    "stress-map": plate_drags,
    "zeta": penetration_test,
}
