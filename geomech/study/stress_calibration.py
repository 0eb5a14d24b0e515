"""Calibrations of the vertical plane: zeta from a penetration test, nine coefficients from plate drags."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from geomech.io.rows import read as read_rows
from geomech.scene import penetration
from geomech.scene.drag import LARGEST_FILE
from geomech.scene.stress import plate_rows
from rft.plates.calibrate import COEFFICIENTS, GENERIC, StressFit, ZetaFit, fit_stress, fit_zeta
from rft.plates.survey import survey
from rft.refusal import Refusal, located

KEYS = tuple(name.replace("m", "-") for name in COEFFICIENTS)  # in files: B-11 for Bm11
MOST_LINES = 60  # of a table of residuals
SEEN = 3.0  # standard errors of a wrong zero of depth from which on it is noted
GIVEN = "give a CSV file with columns depth_m,force_N"


@dataclass(frozen=True, eq=False)
class OfPlates:
    """Nine coefficients fitted to plate drags. beta_deg, gamma_deg, alpha_x, alpha_z: (N,), as measured. name: of the
    file."""

    fit: StressFit
    beta_deg: np.ndarray
    gamma_deg: np.ndarray
    alpha_x: np.ndarray
    alpha_z: np.ndarray
    name: str
    picture, scene = "plates_figure", "an intruder scene"

    def numbers(self) -> dict:
        """Return the JSON of `geomech calibrate`; intervals with 95 %, resolution: the share that comes from the data."""
        f = self.fit
        by_key = lambda values: dict(zip(KEYS, values.tolist()))
        return {
            "law": "stress-map",
            **by_key(f.values),
            "zeta": f.zeta,
            "covariance": f.covariance.tolist(),
            "rms": self.rms,
            "parameters": list(KEYS),
            "errors": by_key(f.errors),
            "intervals": by_key(f.intervals),
            "resolution": by_key(f.resolution),
            "undetermined": self.undetermined,
            "residuals": {
                "beta_deg": self.beta_deg.tolist(), "gamma_deg": self.gamma_deg.tolist(),
                "alpha_x": f.residuals[0].tolist(), "alpha_z": f.residuals[1].tolist(),
            },
            "status": "converged",
        }  # fmt: skip

    @property
    def rms(self) -> float:
        return float(np.sqrt(np.mean(self.fit.residuals**2)))

    @property
    def undetermined(self) -> list[str]:
        return [KEYS[COEFFICIENTS.index(name)] for name in self.fit.undetermined]

    def notes(self) -> list[str]:
        """Return notes for users of the medium."""
        out, overview = [], survey(self.fit.stress)
        if self.undetermined:
            beta, gamma = (round(np.degrees(x)) for x in self.fit.least_known())
            lacking = f"{self.name}: these drags do not determine {', '.join(self.undetermined)}"
            out.append(
                f"{lacking}: what they lack is taken from the shape of the generic set; drag plates at other angles, least is "
                f"known at beta = {beta}, gamma = {gamma} degrees"
            )
        if overview.pushing:
            out.append(f"{self.name}: the fitted map {overview.description()}")
        return out

    def toml(self) -> str:
        """Return the text of a file for `geomech stress` and the [medium] of intruder scenes."""
        f = self.fit
        about = f"# Fitted to {json.dumps(self.name)}: {self.beta_deg.size} plate drags, rms residual {self.rms:.3g} N/cm^3.\n"
        lines = ["[medium]  # N/cm^3; within, with 95 %:"]
        for key, value, (low, high), share in zip(KEYS, f.values.tolist(), f.intervals, f.resolution):
            note = "" if key not in self.undetermined else f"; {100 * (1 - share):.0f} % of it from the generic shape"
            lines.append(f"{key} = {value!r}  # {low:.4g} to {high:.4g}{note}")
        return about + "\n".join(lines) + "\n"

    def text(self) -> str:
        """Return the numbers in words, and a table of residuals."""
        f = self.fit
        lines = [
            f"stress map fitted to {self.name}: {self.beta_deg.size} plate drags",
            "         N/cm^3   95 % interval        from the data   generic set times zeta",
        ]
        for key, value, (low, high), share, generic in zip(KEYS, f.values, f.intervals, f.resolution, f.zeta * GENERIC):
            lines.append(f"{key:5}{value:10.4f}   {low:7.4f} to {high:7.4f}{100 * abs(share):13.0f} %{generic:16.4f}")
        lines.append(f"zeta of the generic set that comes nearest: {f.zeta:.4g}; rms residual {self.rms:.3g} N/cm^3")
        lines.append(f"the map {survey(f.stress).description()}")
        if self.beta_deg.size > MOST_LINES:
            return "\n".join([*lines, "residuals: with --json"])
        lines.append("    beta   gamma   alpha_x       map   alpha_z       map")
        for row in zip(self.beta_deg, self.gamma_deg, self.alpha_x, self.alpha_z, *f.residuals):
            b, g, x, z, residual_x, residual_z = row
            lines.append(f"{b:8.4g}{g:8.4g}{x:10.4f}{x - residual_x:10.4f}{z:10.4f}{z - residual_z:10.4f}")
        return "\n".join(lines)

    def curves(self) -> dict:
        """Return the numbers of the picture (`plots.plates_figure`)."""
        f = self.fit
        return {
            "beta_deg": self.beta_deg, "gamma_deg": self.gamma_deg, "residuals": f.residuals, "rms": self.rms, "names": KEYS,
            "values": f.values, "intervals": f.intervals, "generic": f.zeta * GENERIC, "zeta": f.zeta,
            "undetermined": self.undetermined,
        }  # fmt: skip


@dataclass(frozen=True, eq=False)
class OfPenetration:
    """zeta fitted to a plate that was pushed straight down. area: of the plate, m^2, (1,) or one per row. name: of the
    file."""

    fit: ZetaFit
    area: np.ndarray
    name: str
    picture, scene = "penetration_figure", "an intruder scene"

    def numbers(self) -> dict:
        """Return the JSON of `geomech calibrate`; interval with 95 %."""
        f = self.fit
        return {
            "law": "zeta",
            "zeta": f.zeta,
            "error": f.error,
            "interval": f.interval.tolist(),
            "covariance": [[f.error**2]],
            "parameters": ["zeta"],
            "area": float(self.area[0]) if len({*self.area.tolist()}) == 1 else self.area.tolist(),
            "zero_depth": f.zero if np.isfinite(f.zero) else None,
            "rms": self.rms,
            "residuals": {"depth": f.depth.tolist(), "force": (f.force - f.law).tolist()},
            "status": "converged",
        }

    @property
    def rms(self) -> float:
        """Root mean square residual, N."""
        return float(np.sqrt(np.mean((self.fit.force - self.fit.law) ** 2)))

    def notes(self) -> list[str]:
        """Return a note where the zero of the depth looks wrong."""
        f = self.fit
        if not (abs(f.zero) > SEEN * f.zero_error and abs(f.zero) > 0.02 * f.depth[-1]):
            return []
        line = f"{self.name}: a straight line through the forces is zero at a depth of {1e3 * f.zero:.3g} mm"
        return [
            f"{line}: if the surface is there, count depth from it; if not, the force is not in proportion to depth, and zeta "
            "holds for these depths alone"
        ]

    def toml(self) -> str:
        """Return the text of a file for `geomech stress` and the [medium] of intruder scenes."""
        low, high = self.fit.interval
        about = f"# Fitted to {json.dumps(self.name)}: {self.fit.depth.size} depths, rms residual {self.rms:.3g} N.\n"
        return (
            f"{about}[medium]  # the generic set times\nzeta = {self.fit.zeta!r}  # {low:.4g} to {high:.4g} with 95 %\n"
        )

    def text(self) -> str:
        f = self.fit
        low, high = f.interval
        return (
            f"zeta fitted to {self.name}: {f.depth.size} depths to {1e2 * f.depth[-1]:.3g} cm\n"
            f"zeta     {f.zeta:10.5g}, {low:.4g} to {high:.4g} with 95 %\n"
            f"straight down a plate feels {f.zeta:.4g} N/cm^3; rms residual {self.rms:.3g} N"
        )

    def curves(self) -> dict:
        """Return the numbers of the picture (`plots.penetration_figure`)."""
        f = self.fit
        low, high = f.interval / f.zeta
        return {
            "depth": f.depth,
            "force": f.force,
            "law": f.law,
            "low": low * f.law,
            "high": high * f.law,
            "rms": self.rms,
        }


def of_plates(law: str, source: str, sizes: Mapping[str, float], end_caps: float | str) -> OfPlates:
    """Fit the nine coefficients to a CSV file of plate drags. Refusal, with the file's name, for bad data."""
    _refuse(law, sizes, end_caps, ())
    beta, gamma, a_x, a_z = plate_rows("plate drags", source)
    with located(_name(source)):
        return OfPlates(fit_stress(np.radians(beta), np.radians(gamma), a_x, a_z), beta, gamma, a_x, a_z, _name(source))


def of_penetration(law: str, source: str, sizes: Mapping[str, float], end_caps: float | str) -> OfPenetration:
    """Fit zeta to a CSV file of a penetration test. sizes: "area", m^2, overruling the file's. Refusal for bad data."""
    _refuse(law, sizes, end_caps, ("area",))
    test = penetration.read(read_rows(source, LARGEST_FILE, GIVEN))
    area = np.array([sizes["area"]]) if "area" in sizes else test.area
    with located(test.name):
        if area is None:
            raise Refusal(
                "the area of the plate is missing",
                instead="give --area in m^2, or a header line '# plate area = 9.5 cm^2'",
            )
        return OfPenetration(fit_zeta(test.depth, test.force, area), area, test.name)


def _refuse(law: str, sizes: Mapping[str, float], end_caps, known: tuple[str, ...]) -> None:
    """Refuse options that belong to a rod."""
    for name in (*sizes, *(["end-caps"] if end_caps else [])):
        if name not in known:
            raise Refusal(f"--{name} belongs to another measurement", instead=f"leave it out for --law {law}")


def _name(source: str) -> str:
    return Path(source).name


def law_of(source: str) -> str:
    """Return the law that the columns of a file suit; granular for drag on a rod, and for a file that cannot be read."""
    try:
        header = read_rows(source, LARGEST_FILE, "").header[1]
    except ValueError:
        return "granular"
    begins = lambda *words: any(word.startswith(words) for word in header)
    if begins("psi"):
        return "granular"
    if begins("alpha_", "beta"):
        return "stress-map"
    quantities = {named[0] for word in header if (named := penetration.quantity(word))}
    return "zeta" if begins("depth") or {"depth", "force"} <= quantities else "granular"
