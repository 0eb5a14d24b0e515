"""Calibrations: a law and its covariance from measurements, by the law's name."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from geomech.core.errors import choose
from geomech.core.variables import Result, Variable
from geomech.scenes import drag
from geomech.studies.question import Allow, Progress, Question
from geomech.studies.stress_calibration import law_of, penetration_test, plate_drags
from rft.core.refusal import Refusal, located
from rft.fits.rods import FITS, Fit, fit
from rft.laws.drag import Rod, rod_drag

SIZES = (
    "radius",
    "length",
    "depth",
    "density",
)  # of the rod and the bed, as options have them
CURVE = np.linspace(0.0, np.pi / 2, 181)  # attack angles at which a law is drawn, rad


def rod_drags(
    law: str, source: str, sizes: Mapping[str, float], end_caps: float | str
) -> Result:
    """Return a law fitted to the drag on a rod (`rft.fits.rods`), from a file or the sample ``source``.

    sizes: those of `SIZES` that overrule the header lines. Refusal, one line that names the file, if the data are bad or
    do not determine the law."""
    if "area" in sizes:
        raise Refusal(
            "``area`` belongs to another measurement",
            instead=f"leave it out for ``law`` {law}",
        )
    measured = drag.read(source)
    with located(measured.name):
        f = fit(
            law,
            rod_drag(*measured.rows, measured.ends),
            Rod(**{**measured.sizes, **sizes}),
            end_caps,
        )
        facts = {
            "name": measured.name,
            "medium": _medium(
                f
            ),  # what no medium can be, such as a k of thousands, is refused here
            "rod": {name: getattr(f.rod, name) for name in SIZES},
            "lacks": [
                name
                for name in SIZES
                if FITS[law].granular and not getattr(f.rod, name)
            ],
            "repeats_rms": repeats(f.data.psi, f.data.forces),
        }
    rows, over = ("component", "row"), ("parameter",)
    variables = (
        Variable("parameter", over, np.array([_in_degrees(name) for name in f.names])),
        Variable("value", over, _displayed(f, f.values), error=_displayed(f, f.errors)),
        Variable(
            "interval", (*over, "bound"), _displayed(f, f.intervals), label="with 95 %"
        ),
        Variable("component", ("component",), np.array(["parallel", "perpendicular"])),
        Variable("psi", ("row",), measured.rows[0], "degrees", "attack angle"),
        Variable(
            "folded_psi",
            ("row",),
            np.degrees(f.data.psi),
            "degrees",
            "attack angle, folded into 0 to 90 degrees",
        ),
        Variable("force", rows, f.data.forces, "N"),
        Variable("residual", rows, f.residuals, "N", "force minus law"),
        Variable("angle", ("angle",), np.degrees(CURVE), "degrees", "attack angle"),
        Variable(
            "law",
            ("component", "angle"),
            f.forces(CURVE),
            "N",
            error=f.band(CURVE),
            error_label="95 %",
        ),
    )
    return Result("rod_drag", variables, facts, f)


def _medium(f: Fit) -> dict:
    """Return the table [medium] of a fitted law."""
    values = {
        field.name: getattr(f.medium, field.name)
        for field in dataclasses.fields(f.medium)
    }
    if "gamma0" in values:
        values = {
            _in_degrees(k): math.degrees(x) if k == "gamma0" else x
            for k, x in values.items()
        }
    if "covariance" in values:
        values["covariance"] = [list(row) for row in values["covariance"]]
    return {"law": f.law, **{k: x for k, x in values.items() if x is not None}}


def _displayed(f: Fit, values: np.ndarray) -> np.ndarray:
    """Return values (n, ...) of the parameters with gamma0 in degrees."""
    return np.array(
        [np.degrees(x) if name == "gamma0" else x for name, x in zip(f.names, values)]
    )


def _in_degrees(name: str) -> str:
    return "gamma0_deg" if name == "gamma0" else name


def repeats(psi: np.ndarray, forces: np.ndarray) -> float | None:
    """Return the root mean square of forces about their means at equal angles, N, with the degrees of freedom that these
    leave; None if no angle is repeated. No law can go below it."""
    _, which, counts = np.unique(psi.round(9), return_inverse=True, return_counts=True)
    if (free := psi.size - counts.size) < 1:
        return None
    means = np.array([np.bincount(which, f) / counts for f in forces])
    return float(np.sqrt(((forces - means[:, which]) ** 2).sum() / (2 * free)))


CALIBRATIONS: dict[str, Callable[..., Result]] = {
    **dict.fromkeys(FITS, rod_drags),
    "stress-map": plate_drags,
    "zeta": penetration_test,
}


@dataclass(frozen=True)
class Calibration(Question):
    """A law fitted to measurements. law: one of CALIBRATIONS, by the columns of the file if None. sizes: those of the rod or
    plate that overrule the file's. end_caps: e of the rod's ends (`rft.EndCaps`), 0 to leave them out, or "fitted"."""

    source: str
    law: str | None = None
    sizes: tuple[tuple[str, float], ...] = ()
    end_caps: float | str = 0.0

    def inputs(self) -> list[Path]:
        return [Path(self.source)]

    @cached_property
    def chosen(self) -> str:
        return choose(
            "``law``",
            law_of(self.source) if self.law is None else self.law,
            CALIBRATIONS,
        )

    def check(self) -> None:
        _ = self.chosen

    def answer(self, progress: Progress, allow: Allow) -> Result:
        return CALIBRATIONS[self.chosen](
            self.chosen, self.source, dict(self.sizes), self.end_caps
        )
