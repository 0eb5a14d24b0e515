"""Calibrations: a law and its covariance from measurements, by the law's name, and their texts and files."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from geomech.core.errors import choose
from geomech.core.variables import Result, Variable
from geomech.scene import drag
from geomech.scene.write import table
from geomech.study.question import Allow, Progress, Question
from geomech.study.stress_calibration import OfPenetration, OfPlates, law_of, of_penetration, of_plates
from rft.calibrate import FITS, Fit, fit
from rft.drag import Rod, rod_drag
from rft.refusal import Refusal, located

UNITS = {"k": "", "axial_stress": "Pa", "axial_force": "N", "gamma0": "degrees"}
SIZES = {
    "radius": "m",
    "length": "m",
    "depth": "m",
    "density": "kg/m^3",
}  # of the rod and the bed, by the names of options

MOST_LINES = 60  # of a table of residuals


@dataclass(frozen=True, eq=False)
class OfDrag:
    """A law fitted to the drag on a rod (`rft.calibrate`). psi_deg: (N,), the measured angles. name: of the file."""

    fit: Fit
    psi_deg: np.ndarray
    name: str
    picture, scene = "drag_figure", "a scene"

    def notes(self) -> list[str]:
        """Return notes for users of the medium."""
        return []

    def numbers(self) -> dict:
        """Return the JSON of `geomech calibrate`. covariance: of ``parameters``, gamma0 in rad; errors: standard ones,
        of gamma0 in degrees; intervals with 95 %, likewise."""
        f = self.fit
        medium = self._medium()
        medium.pop("covariance", None)
        return {
            "law": f.law,
            **{k: x for k, x in medium.items() if k not in ("law", "k")},
            "k": f.k,
            "covariance": f.covariance.tolist(),
            "rms": f.rms,
            "parameters": list(f.names),
            "errors": dict(zip(map(_in_degrees, f.names), _displayed(f, f.errors).tolist())),
            "intervals": dict(zip(map(_in_degrees, f.names), _displayed(f, f.intervals).tolist())),
            "axial_force_N": f.axial_force,
            "axial_stress_Pa": f.axial_stress,
            "end_caps": f.end_caps,
            "rod": {name: getattr(f.rod, name) for name in SIZES},
            "repeats_rms": repeats(f.data.psi, f.data.forces),
            "residuals": {
                "psi_deg": self.psi_deg.tolist(), "F_parallel_N": f.residuals[0].tolist(),
                "F_perpendicular_N": f.residuals[1].tolist(),
            },
            "status": "converged",
        }  # fmt: skip

    def _medium(self) -> dict:
        """Return the table [medium] of the law."""
        values = {f.name: getattr(self.fit.medium, f.name) for f in dataclasses.fields(self.fit.medium)}
        if "gamma0" in values:
            values = {_in_degrees(k): math.degrees(x) if k == "gamma0" else x for k, x in values.items()}
        if "covariance" in values:
            values["covariance"] = [list(row) for row in values["covariance"]]
        return {"law": self.fit.law, **{k: x for k, x in values.items() if x is not None}}

    def toml(self) -> str:
        """Return the text of a file for ``[medium] file`` of a scene."""
        f, own = self.fit, getattr(self.fit.medium, "uncertain", ())
        of = f"; covariance of {', '.join(own)}" + (", gamma0 in rad" if "gamma0" in own else "") if own else ""
        of += f", widened for {f.degrees_of_freedom} degrees of freedom (Student)" if own else ""
        about = f"# Fitted to {json.dumps(self.name)}: {f.data.n_angles} angles, rms residual {f.rms:.3g} N{of}.\n"
        return about + table("medium", self._medium())

    def text(self) -> str:
        """Return the numbers in words, and a table of residuals."""
        f = self.fit
        lines = [f"{f.law} law fitted to {self.name}: {f.data.n_forces} forces at {f.data.n_angles} angles"]
        for name, x, (low, high) in zip(f.names, _displayed(f, f.values), _displayed(f, f.intervals)):
            unit = f" {UNITS[name]}" if UNITS.get(name) else ""
            lines.append(f"{name:13}{x:12.5g}, {low:.4g} to {high:.4g}{unit} with 95 %")
        if f.axial_stress and "axial_stress" not in f.names:
            lines.append(f"{'axial_stress':13}{f.axial_stress:12.5g} Pa")
        if "axial_force" not in f.names:
            lines.append(f"{'axial_force':13}{f.axial_force:12.5g} N on the whole rod")
        caps = "left out" if not f.end_caps else f"{f.end_caps:.3g} flat ends"
        known = [f"{name} {getattr(f.rod, name):g} {unit}" for name, unit in SIZES.items() if getattr(f.rod, name)]
        lines.append(f"end caps: {caps}; rod and bed: {', '.join(known) or 'sizes not known'}")
        unknown = [name for name in SIZES if not getattr(f.rod, name)]
        if unknown and FITS[f.law].granular:
            lines.append(f"k is not known without {', '.join(unknown)}: in the header lines, or as --{unknown[0]}")
        repeated = repeats(f.data.psi, f.data.forces)
        lines.append(
            f"rms residual {f.rms:.3g} N" + (f", among repeats {repeated:.3g} N" if repeated is not None else "")
        )
        if self.psi_deg.size > MOST_LINES:
            return "\n".join([*lines, "residuals: with --json"])
        lines.append("  psi_deg  F_parallel_N       law  F_perpendicular_N       law")
        for psi, forces, residual in zip(self.psi_deg, f.data.forces.T, f.residuals.T):
            (t, n), (law_t, law_n) = forces, np.round(forces - residual, 12) + 0.0
            lines.append(f"{psi:9.4g} {t:13.4g} {law_t:9.4g} {n:18.4g} {law_n:9.4g}")
        return "\n".join(lines)

    def curves(self, count: int = 181) -> dict:
        """Return the numbers of the picture (`plots.drag_figure`): data and law by psi in degrees, (2, N) each."""
        psi, f = np.linspace(0.0, np.pi / 2, count), self.fit
        return {
            "psi_deg": np.degrees(f.data.psi), "forces": f.data.forces, "residuals": f.residuals, "rms": f.rms,
            "fine_deg": np.degrees(psi), "law": f.forces(psi), "band": f.band(psi), "label": f"{f.law} law",
        }  # fmt: skip


def _displayed(f: Fit, values: np.ndarray) -> np.ndarray:
    """Return values (n, ...) of the parameters with gamma0 in degrees."""
    return np.array([np.degrees(x) if name == "gamma0" else x for name, x in zip(f.names, values)])


def _in_degrees(name: str) -> str:
    return "gamma0_deg" if name == "gamma0" else name


def repeats(psi: np.ndarray, forces: np.ndarray) -> float | None:
    """Return the root mean square of forces about their means at equal angles, N, with the remaining degrees of
    freedom; None if no angle is repeated. No law can fit better."""
    _, which, counts = np.unique(psi.round(9), return_inverse=True, return_counts=True)
    if (free := psi.size - counts.size) < 1:
        return None
    means = np.array([np.bincount(which, f) / counts for f in forces])
    return float(np.sqrt(((forces - means[:, which]) ** 2).sum() / (2 * free)))


def of_drag(law: str, source: str, sizes: Mapping[str, float], end_caps: float | str) -> OfDrag:
    """Fit a law to the file or sample ``source``. sizes: of `SIZES`, overruling the header lines. Refusal, with the
    file's name, if the data are bad or do not determine the law."""
    if "area" in sizes:
        raise Refusal("--area belongs to another measurement", instead=f"leave it out for --law {law}")
    measured = drag.read(source)
    with located(measured.name):
        rod = Rod(**{**measured.sizes, **sizes})
        data = rod_drag(*measured.rows)
        calibration = OfDrag(fit(law, data, rod, end_caps), measured.rows[0], measured.name)
        calibration.toml()  # refuses impossible media, such as a k of thousands
    return calibration


CALIBRATIONS: dict[str, Callable[..., OfDrag | OfPlates | OfPenetration]] = {
    **dict.fromkeys(FITS, of_drag),
    "stress-map": of_plates,
    "zeta": of_penetration,
}


@dataclass(frozen=True)
class Calibration(Question):
    """A law fitted to measurements.

    law: one of CALIBRATIONS; by the columns of the file if None. sizes: of the rod or plate, overruling the file's.
    end_caps: e of the rod's ends (`rft.EndCaps`), 0 to leave them out, or "fitted"."""

    source: str
    law: str | None = None
    sizes: tuple[tuple[str, float], ...] = ()
    end_caps: float | str = 0.0

    def inputs(self) -> list[Path]:
        return [Path(self.source)]

    @cached_property
    def chosen(self) -> str:
        return choose("--law", law_of(self.source) if self.law is None else self.law, CALIBRATIONS)

    def check(self) -> None:
        _ = self.chosen

    def answer(self, progress: Progress, allow: Allow) -> Result:
        calibration = CALIBRATIONS[self.chosen](self.chosen, self.source, dict(self.sizes), self.end_caps)
        numbers = calibration.numbers()
        names = numbers["parameters"]
        deviations = np.sqrt(np.diag(np.reshape(numbers["covariance"], (len(names), len(names)))))
        over = ("parameter",)
        variables = Variable("parameter", over, np.array(names)), Variable("standard_error", over, deviations)
        return Result("calibration", variables, {"notes": calibration.notes()}, calibration)
