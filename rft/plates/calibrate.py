"""The stress map of a medium from measurements (Sec. II B): its strength zeta from a plate pushed straight down, or its nine
coefficients from plates dragged at many tilts and directions.

The map is linear in its coefficients, so both are linear least squares. What drags do not tell is held near the shape of the
generic set: c = s M0 + d with any strength s, and d of the size `SPREAD` of it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rft.calibrate import student_factor
from rft.checks import in_range, real_array, require
from rft.plates.stress import COEFFICIENTS, PER_CUBIC_METRE, StressMap

GENERIC = np.array([getattr(StressMap(), name) for name in COEFFICIENTS])
SPREAD = 0.2  # N/cm^3 over zeta, assumed: four times what the named media with nine of their own stray by at most
DETERMINED = 0.9  # share of a coefficient that must come from the data, assumed
FEWEST_DRAGS, FEWEST_DEPTHS = 6, 3
MOST = 100_000
LARGEST = 1e12  # of any number; what is below 1 over it counts as 0
STRENGTHS = (0.01, 100.0)  # of zeta: more than a factor of 20 beyond all named media is a slip of units
EXACT = 1e-6  # least noise, over zeta
STRAY = 0.5  # rms of what the generic shape leaves of drags, over theirs, from which on slips are looked for


@dataclass(frozen=True, eq=False)
class StressFit:
    """Nine coefficients fitted to plate drags. values: (9,), of `COEFFICIENTS`, N/cm^3. covariance: (9, 9), with the scatter
    about the map as noise. resolution: (9,), the share of each that comes from the data; the rest is the generic shape.
    zeta: strength of the generic set that comes nearest. residuals: (2, N), measured minus fitted alpha_x, alpha_z.
    noise: their standard deviation; free: its degrees of freedom."""

    values: np.ndarray
    covariance: np.ndarray
    resolution: np.ndarray
    zeta: float
    residuals: np.ndarray
    noise: float
    free: float

    @property
    def stress(self) -> StressMap:
        return StressMap(**dict(zip(COEFFICIENTS, self.values.tolist())))

    @property
    def errors(self) -> np.ndarray:
        """(9,), standard errors."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def intervals(self) -> np.ndarray:
        """(9, 2), each with 95 %."""
        return self.values[:, None] + student_factor(self.free) * self.errors[:, None] * [-1.0, 1.0]

    @property
    def undetermined(self) -> list[str]:
        """Names of the coefficients that the data do not determine."""
        return [name for name, share in zip(COEFFICIENTS, self.resolution) if share < DETERMINED]

    def least_known(self) -> tuple[float, float]:
        """(beta, gamma), radians in steps of 15 degrees, at which the covariance leaves the map most open."""
        line = np.radians(np.arange(-90, 91, 15))
        beta, gamma = (x.ravel() for x in np.meshgrid(line[1:], line, indexing="ij"))
        design = _design(beta, gamma).reshape(2, beta.size, -1)
        most = np.einsum("kni,ij,knj->n", design, self.covariance, design).argmax()
        return float(beta[most]), float(gamma[most])


@dataclass(frozen=True, eq=False)
class ZetaFit:
    """Strength from a plate pushed straight down. error: its standard error, from the scatter about the straight line and how
    neighbours scatter alike. depth (m), force, law (N): (N,), what was below the surface, in the order of depth. zero,
    zero_error: depth where the best straight line of stress against depth is zero, m; the law has 0."""

    zeta: float
    error: float
    free: float
    depth: np.ndarray
    force: np.ndarray
    law: np.ndarray
    zero: float
    zero_error: float

    @property
    def stress(self) -> StressMap:
        return StressMap(zeta=self.zeta)

    @property
    def interval(self) -> np.ndarray:
        """(2,), with 95 %."""
        return self.zeta + student_factor(self.free) * self.error * np.array([-1.0, 1.0])


def fit_stress(beta, gamma, alpha_x, alpha_z) -> StressFit:
    """The nine coefficients from (N,) plate drags: angles in radians, stresses per depth in N/cm^3.

    Least squares with the departure from the generic shape held to `SPREAD`; the noise is estimated beside it, one for
    both components. ValueError for drags that no grains have, naming the slip of columns, signs or units that explains it."""
    rows = _drags(beta, gamma, alpha_x, alpha_z)
    design, y = _design(*rows[:2]), rows[2:].ravel()
    zeta, left = _generic(design, y)
    _check_slips(rows, left)
    check_strength(zeta, "angles in degrees, stresses in N/cm^3 (1e-6 of those in N/m^3)")
    unit = GENERIC / np.linalg.norm(GENERIC)
    hold = (np.eye(len(unit)) - np.outer(unit, unit)) / (SPREAD * zeta)
    noise = max(left * np.sqrt(np.mean(y * y)), EXACT * zeta)
    for _ in range(100):
        values, covariance, told = _solve(design, y, hold, noise)
        free = len(y) - np.trace(told)
        last, noise = noise, max(math.sqrt(np.sum((y - design @ values) ** 2) / free), EXACT * zeta)
        if abs(noise - last) <= 1e-9 * last:
            break
    residuals = (y - design @ values).reshape(2, -1)
    return StressFit(values, covariance, np.diag(told), zeta, residuals, noise, float(free))


def fit_zeta(depth, force, area) -> ZetaFit:
    """zeta from (N,) forces (N, upwards) on a level plate of ``area`` (m^2, one or (N,)) pushed straight down to ``depth`` (m):
    F = zeta alpha_z(0, 90 degrees) |z| A. Rows above the surface are left out."""
    depth, force, area = (np.atleast_1d(real_array(*x)) for x in (("depth", depth), ("force", force), ("area", area)))
    require(depth.ndim == 1 and depth.shape == force.shape, "depth and force must be equally many numbers")
    require(area.shape in ((1,), depth.shape), "area must be one number, or as many as depths")
    small = all(bool((np.abs(x) <= LARGEST).all()) for x in (depth, force, area))
    require(small, f"depths, forces and areas must be finite numbers of at most {LARGEST:g}")
    require(bool((area >= 1 / LARGEST).all()), "the area of the plate must be above 0")
    order = np.argsort(depth, kind="stable")
    order = order[depth[order] > 1 / LARGEST]
    require(FEWEST_DEPTHS <= order.size <= MOST, f"{FEWEST_DEPTHS} to {MOST} depths below the surface are needed, got "
            f"{order.size}: depth is positive downwards")  # fmt: skip
    d, f, a = depth[order], force[order], np.broadcast_to(area, depth.shape)[order]
    per_zeta = float(StressMap()(0.0, math.pi / 2)[1]) * PER_CUBIC_METRE * a * d
    zeta = float(per_zeta @ f / (per_zeta @ per_zeta))
    require(zeta > 0, "the force is against the law: it must be positive where grains push the plate upwards")
    check_strength(zeta, "depth in m, force in N, area in m^2")
    left = f - zeta * per_zeta
    error = math.sqrt((left @ left) / (len(f) - 1) / (per_zeta @ per_zeta))
    error = max(error * _alike(left), EXACT**2 * zeta)
    return ZetaFit(zeta, error, float(len(f) - 1), d, f, zeta * per_zeta, *_zero(d, f / a))


def check_strength(zeta: float, units: str) -> None:
    """ValueError if zeta is that of no grains."""
    low, high = STRENGTHS
    told = f"zeta = {zeta:.3g} is that of no grains ({low:g} to {high:g}): check the units, {units}"
    require(low <= zeta <= high, told)


def _drags(beta, gamma, alpha_x, alpha_z) -> np.ndarray:
    """(4, N)."""
    names = ("beta", "gamma", "alpha_x", "alpha_z")
    rows = [np.atleast_1d(real_array(name, x)) for name, x in zip(names, (beta, gamma, alpha_x, alpha_z))]
    same = all(x.ndim == 1 and x.shape == rows[0].shape for x in rows)
    require(same, "beta, gamma, alpha_x and alpha_z must be equally many numbers")
    rows = np.stack(rows)
    require(bool((np.abs(rows) <= LARGEST).all()), f"plate drags must be finite numbers of at most {LARGEST:g}")
    in_range("number of plate drags", rows.shape[1], FEWEST_DRAGS, MOST, whole=True)
    require(bool((np.abs(rows[2:]) > 1 / LARGEST).any()), "the plate drags are all 0: measure some force")
    return rows


def _design(beta, gamma) -> np.ndarray:
    """(2 N, 9): what each coefficient adds to alpha_x, then to alpha_z, wherever the angles lie."""
    alone = [StressMap(**dict.fromkeys(COEFFICIENTS, 0.0) | {name: 1.0}) for name in COEFFICIENTS]
    return np.stack([np.concatenate(stress(beta, gamma)) for stress in alone], -1)


def _generic(design, y) -> tuple[float, float]:
    """(zeta, what the generic set times it leaves, rms over that of the drags)."""
    shape = design @ GENERIC
    zeta = float(shape @ y / (shape @ shape))
    return zeta, float(np.sqrt(np.mean((y - max(zeta, 0.0) * shape) ** 2) / np.mean(y * y)))


SLIPS = {
    "alpha_x and alpha_z are swapped": lambda b, g, x, z: (b, g, z, x),
    "beta and gamma are swapped": lambda b, g, x, z: (g, b, x, z),
    "alpha_x has the other sign: positive is against the motion's x": lambda b, g, x, z: (b, g, -x, z),
    "alpha_z has the other sign: positive is upwards": lambda b, g, x, z: (b, g, x, -z),
    "both stresses have the other sign: they are those on the plate": lambda b, g, x, z: (b, g, -x, -z),
    "gamma has the other sign: positive is below the horizontal": lambda b, g, x, z: (b, -g, x, z),
    "beta has the other sign: positive if the forward edge is up": lambda b, g, x, z: (-b, g, x, z),
    "beta is from the vertical: 0 is a plate that lies flat": lambda b, g, x, z: (np.pi / 2 - b, g, x, z),
    "gamma is from the vertical: 90 degrees is straight down": lambda b, g, x, z: (b, np.pi / 2 - g, x, z),
}


def _check_slips(rows, left: float) -> None:
    """ValueError if the drags are far from the shape that all grains have (Fig. 7), and a slip explains it."""
    if left < STRAY:
        return
    tried = {}
    for slip, undone in SLIPS.items():
        b, g, x, z = undone(*rows)
        tried[slip] = _generic(_design(b, g), np.concatenate([x, z]))[1]
    best = min(tried, key=tried.get)
    told = f"these drags are like those of no grains, but would be if {best}"
    require(tried[best] > left / 2, told)


def _solve(design, y, hold, noise: float):
    """(values, covariance, share of the data in the values (9, 9)) of a given noise."""
    rows = np.concatenate([design / noise, hold])
    u, s, vt = np.linalg.svd(rows, full_matrices=False)
    root = vt.T / s
    return root @ (u[: len(y)].T @ (y / noise)), root @ root.T, root @ (u[: len(y)].T @ design) / noise


def _alike(left) -> float:
    """How much wider neighbours that scatter alike make a standard error."""
    size = left @ left
    alike = min(max(float(left[1:] @ left[:-1] / size), 0.0), 0.99) if size else 0.0
    return math.sqrt((1 + alike) / (1 - alike))


def _zero(depth, stress) -> tuple[float, float]:
    """Depth at which the best straight line is zero, and its standard error (m); nan if there is no line."""
    if np.ptp(depth) == 0:
        return math.nan, math.nan
    rows = np.stack([depth, np.ones_like(depth)], -1)
    (slope, at), *_ = np.linalg.lstsq(rows, stress, rcond=None)
    left = stress - rows @ [slope, at]
    spread = math.sqrt((left @ left) / (len(depth) - 2) * np.linalg.inv(rows.T @ rows)[1, 1]) * _alike(left)
    return (-float(at / slope), float(abs(spread / slope))) if slope else (math.nan, math.nan)
