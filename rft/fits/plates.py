"""The stress map of a medium from measurements (Sec. II B): its strength zeta from a
plate pushed straight down, or its nine coefficients from plates dragged at many tilts
and directions.

The map is linear in its coefficients, so both are linear least squares. Coefficients
that the drags do not determine stay near the shape of the generic set: c = s M0 + d
with any strength s, and d of about `SPREAD` s.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rft.core.checks import in_range, real_array
from rft.core.refusal import require
from rft.fits.rods import student_factor
from rft.terradynamics.plates.stress import COEFFICIENTS, PER_CUBIC_METRE, StressMap

GENERIC = np.array([getattr(StressMap(), name) for name in COEFFICIENTS])
# N/cm^3 over zeta, assumed: four times the most that named media with own coefficients
# differ by
SPREAD = 0.2
DETERMINED = 0.9  # share of a coefficient that must come from the data, assumed
FEWEST_DRAGS = 6
FEWEST_DEPTHS = 3
MOST_ROWS = 100_000
LARGEST = 1e12  # of any number; numbers below 1 / LARGEST count as 0
# bounds of zeta, more than a factor of 20 beyond all named media: else units are wrong
STRENGTHS = (0.01, 100.0)
EXACT = 1e-6  # least noise, over zeta
# misfit of the generic shape, rms over that of the drags, from which on slips are
# looked for
STRAY = 0.5


@dataclass(frozen=True, eq=False)
class StressFit:
    """Nine coefficients fitted to plate drags.

    values: (9,), the `COEFFICIENTS`, N/cm^3. covariance: (9, 9), with the scatter about
    the map as noise. resolution: (9,), the share of each coefficient that comes from
    the data; the rest comes from the generic shape. zeta: strength of the nearest
    generic set. residuals: (2, N), measured minus fitted alpha_x, alpha_z, N/cm^3.
    noise: standard deviation of the residuals. free: its degrees of freedom."""

    values: np.ndarray
    covariance: np.ndarray
    resolution: np.ndarray
    zeta: float
    residuals: np.ndarray
    noise: float
    free: float

    @property
    def stress(self) -> StressMap:
        """The fitted map."""
        return StressMap(**dict(zip(COEFFICIENTS, self.values.tolist())))

    @property
    def errors(self) -> np.ndarray:
        """Standard errors (9,), N/cm^3."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def intervals(self) -> np.ndarray:
        """Intervals (9, 2) of 95 %, N/cm^3."""
        half = student_factor(self.free) * self.errors
        return np.stack([self.values - half, self.values + half], -1)

    @property
    def undetermined(self) -> list[str]:
        """Names of the coefficients that the data do not determine."""
        shares = zip(COEFFICIENTS, self.resolution)
        return [name for name, share in shares if share < DETERMINED]

    def least_known(self) -> tuple[float, float]:
        """Return the (beta, gamma), rad in steps of 15 degrees, at which the map has
        the largest variance."""
        line = np.radians(np.arange(-90, 91, 15))
        beta, gamma = (x.ravel() for x in np.meshgrid(line[1:], line, indexing="ij"))
        design = _design(beta, gamma).reshape(2, beta.size, -1)
        most = np.einsum("kni,ij,knj->n", design, self.covariance, design).argmax()
        return float(beta[most]), float(gamma[most])


@dataclass(frozen=True, eq=False)
class ZetaFit:
    """Strength fitted to a plate pushed straight down.

    error: standard error of zeta, from the scatter about the law and the correlation of
    neighbouring residuals. free: its degrees of freedom. depth (m), force, law (N):
    (N,), the rows below the surface in the order of depth. zero, zero_error: depth
    where the best straight line of stress against depth is zero, m; the law has 0."""

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
        """The fitted map."""
        return StressMap(zeta=self.zeta)

    @property
    def interval(self) -> np.ndarray:
        """Interval (2,) of 95 % of zeta."""
        half = student_factor(self.free) * self.error
        return np.array([self.zeta - half, self.zeta + half])


def fit_stress(beta, gamma, alpha_x, alpha_z) -> StressFit:
    """Return the nine coefficients fitted to (N,) plate drags: angles in radians,
    stresses per depth in N/cm^3.

    Least squares with a prior of `SPREAD` on the difference from the generic shape; the
    noise, one number for both components, is estimated with it. ValueError for drags
    that no grains have, with the slip of columns, signs or units that explains them."""
    rows = _drags(beta, gamma, alpha_x, alpha_z)
    design = _design(*rows[:2])
    y = rows[2:].ravel()
    zeta, misfit = _generic(design, y)
    _check_mistakes(rows, misfit)
    check_strength(
        zeta, "angles in degrees, stresses in N/cm^3 (1e-6 of the value in N/m^3)"
    )
    unit = GENERIC / np.linalg.norm(GENERIC)
    prior = (np.eye(len(unit)) - np.outer(unit, unit)) / (SPREAD * zeta)
    noise = max(misfit * np.sqrt(np.mean(y * y)), EXACT * zeta)
    for _ in range(100):
        values, covariance, resolution = _solve(design, y, prior, noise)
        free = len(y) - np.trace(resolution)
        last = noise
        noise = max(math.sqrt(np.sum((y - design @ values) ** 2) / free), EXACT * zeta)
        if abs(noise - last) <= 1e-9 * last:
            break
    residuals = (y - design @ values).reshape(2, -1)
    return StressFit(
        values, covariance, np.diag(resolution), zeta, residuals, noise, float(free)
    )


def fit_zeta(depth, force, area) -> ZetaFit:
    """Return zeta fitted to (N,) forces, N upwards, on a level plate of ``area``, m^2,
    one number or (N,), that is pushed straight down to ``depth``, m: F = zeta
    alpha_z(0, 90 degrees) |z| A. Rows above the surface do not count."""
    depth = np.atleast_1d(real_array("depth", depth))
    force = np.atleast_1d(real_array("force", force))
    area = np.atleast_1d(real_array("area", area))
    require(
        depth.ndim == 1 and depth.shape == force.shape,
        "depth and force must have the same length",
    )
    require(
        area.shape in ((1,), depth.shape),
        "area must be one number, or one for each depth",
    )
    within = all(bool((np.abs(x) <= LARGEST).all()) for x in (depth, force, area))
    require(
        within,
        f"depths, forces and areas must be finite numbers of at most {LARGEST:g}",
    )
    require(bool((area >= 1 / LARGEST).all()), "the area of the plate must be above 0")
    order = np.argsort(depth, kind="stable")
    order = order[depth[order] > 1 / LARGEST]
    require(
        FEWEST_DEPTHS <= order.size <= MOST_ROWS,
        f"{FEWEST_DEPTHS} to {MOST_ROWS} depths below the surface are needed, "
        f"got {order.size}",
        because="depth is positive downwards",
    )
    d = depth[order]
    f = force[order]
    a = np.broadcast_to(area, depth.shape)[order]
    per_zeta = float(StressMap()(0.0, math.pi / 2)[1]) * PER_CUBIC_METRE * a * d
    zeta = float(per_zeta @ f / (per_zeta @ per_zeta))
    require(
        zeta > 0,
        "the force has the wrong sign for the law",
        because="it must be positive where grains push the plate upwards",
    )
    check_strength(zeta, "depth in m, force in N, area in m^2")
    residuals = f - zeta * per_zeta
    error = math.sqrt((residuals @ residuals) / (len(f) - 1) / (per_zeta @ per_zeta))
    error = max(error * _correlation_factor(residuals), EXACT**2 * zeta)
    zero, zero_error = _zero(d, f / a)
    return ZetaFit(
        zeta,
        error,
        free=float(len(f) - 1),
        depth=d,
        force=f,
        law=zeta * per_zeta,
        zero=zero,
        zero_error=zero_error,
    )


def check_strength(zeta: float, units: str) -> None:
    """Raise ValueError if no grains have this zeta; the message names the right
    units."""
    low, high = STRENGTHS
    require(
        low <= zeta <= high,
        f"zeta = {zeta:.3g} is outside the range of grains ({low:g} to {high:g}): "
        f"check the units, {units}",
    )


def _drags(beta, gamma, alpha_x, alpha_z) -> np.ndarray:
    """Return the drags as rows (4, N); ValueError for wrong lengths, too few or too
    many, or numbers out of range."""
    columns = {"beta": beta, "gamma": gamma, "alpha_x": alpha_x, "alpha_z": alpha_z}
    rows = [np.atleast_1d(real_array(name, x)) for name, x in columns.items()]
    require(
        all(x.shape == (rows[0].size,) for x in rows),
        "beta, gamma, alpha_x and alpha_z must have the same length",
    )
    rows = np.stack(rows)
    require(
        bool((np.abs(rows) <= LARGEST).all()),
        f"plate drags must be finite numbers of at most {LARGEST:g}",
    )
    in_range(
        "number of plate drags", rows.shape[1], FEWEST_DRAGS, MOST_ROWS, whole=True
    )
    require(
        bool((np.abs(rows[2:]) > 1 / LARGEST).any()),
        "the plate drags are all 0",
        instead="measure some force",
    )
    return rows


def _design(beta, gamma) -> np.ndarray:
    """Return the derivatives (2 N, 9) of alpha_x, then of alpha_z, by the coefficients,
    at any angles (N,)."""
    unit_maps = [
        StressMap(**dict.fromkeys(COEFFICIENTS, 0.0) | {name: 1.0})
        for name in COEFFICIENTS
    ]
    return np.stack([np.concatenate(stress(beta, gamma)) for stress in unit_maps], -1)


def _generic(design, y) -> tuple[float, float]:
    """Return zeta of the nearest generic set, and the rms of its residuals over that of
    the drags ``y``."""
    shape = design @ GENERIC
    zeta = float(shape @ y / (shape @ shape))
    residual = y - max(zeta, 0.0) * shape
    return zeta, float(np.sqrt(np.mean(residual**2) / np.mean(y * y)))


# Slips of columns, signs and angles, and the rows (beta, gamma, alpha_x, alpha_z) that
# were meant.
MISTAKES = {
    "alpha_x and alpha_z were swapped": lambda b, g, x, z: (b, g, z, x),
    "beta and gamma were swapped": lambda b, g, x, z: (g, b, x, z),
    "alpha_x had the opposite sign (positive against the motion's x)": (
        lambda b, g, x, z: (b, g, -x, z)
    ),
    "alpha_z had the opposite sign (positive upwards)": (
        lambda b, g, x, z: (b, g, x, -z)
    ),
    "both stresses had the opposite sign (they act on the plate)": (
        lambda b, g, x, z: (b, g, -x, -z)
    ),
    "gamma had the opposite sign (positive below the horizontal)": (
        lambda b, g, x, z: (b, -g, x, z)
    ),
    "beta had the opposite sign (positive if the forward edge is up)": (
        lambda b, g, x, z: (-b, g, x, z)
    ),
    "beta were not measured from the vertical (0 is a plate that lies flat)": (
        lambda b, g, x, z: (np.pi / 2 - b, g, x, z)
    ),
    "gamma were not measured from the vertical (90 degrees is straight down)": (
        lambda b, g, x, z: (b, np.pi / 2 - g, x, z)
    ),
}


def _check_mistakes(rows, misfit: float) -> None:
    """Raise ValueError if the drags are far from the shape that all grains have (Fig.
    7), and a slip explains it."""
    if misfit < STRAY:
        return
    misfits = {}
    for mistake, undo in MISTAKES.items():
        b, g, x, z = undo(*rows)
        misfits[mistake] = _generic(_design(b, g), np.concatenate([x, z]))[1]
    best = min(misfits, key=misfits.get)
    require(
        misfits[best] > misfit / 2,
        f"these drags do not resemble those of any grains, but would if {best}: "
        "check the columns",
    )


def _solve(design, y, prior, noise: float):
    """Return values (9,), covariance (9, 9) and resolution (9, 9), the data's share in
    the values, for a noise."""
    rows = np.concatenate([design / noise, prior])
    u, s, vt = np.linalg.svd(rows, full_matrices=False)
    root = vt.T / s
    of_data = u[: len(y)].T
    values = root @ (of_data @ (y / noise))
    covariance = root @ root.T
    resolution = root @ (of_data @ design) / noise
    return values, covariance, resolution


def _correlation_factor(residuals) -> float:
    """Return the factor of a standard error by which correlated neighbouring residuals
    widen it."""
    size = residuals @ residuals
    correlation = 0.0
    if size:
        correlation = float(residuals[1:] @ residuals[:-1] / size)
        correlation = min(max(correlation, 0.0), 0.99)
    return math.sqrt((1 + correlation) / (1 - correlation))


def _zero(depth, stress) -> tuple[float, float]:
    """Return the depth at which the best straight line is zero, and its standard error,
    m; nan if there is no line."""
    if np.ptp(depth) == 0:
        return math.nan, math.nan
    rows = np.stack([depth, np.ones_like(depth)], -1)
    (slope, intercept), *_ = np.linalg.lstsq(rows, stress, rcond=None)
    residuals = stress - rows @ [slope, intercept]
    noise = (residuals @ residuals) / (len(depth) - 2)
    variance = noise * np.linalg.inv(rows.T @ rows)[1, 1]
    error = math.sqrt(variance) * _correlation_factor(residuals)
    if not slope:
        return math.nan, math.nan
    return -float(intercept / slope), float(abs(error / slope))
