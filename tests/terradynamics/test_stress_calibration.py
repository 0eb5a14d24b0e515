"""Strength and coefficients of a stress map from measurements: against closed forms,
plain least squares, a Bayesian formula and known sets under noise."""

import mpmath
import numpy as np
import pytest

from geomech import scenes
from geomech.io import rows
from geomech.scenes.terradynamics import penetration
from geomech.studies.terradynamics import calibration
from rft.fits.plates import (
    COEFFICIENTS,
    GENERIC,
    MISTAKES,
    SPREAD,
    fit_stress,
    fit_zeta,
)
from rft.terradynamics.plates import VERTICAL, StressMap

RAD = np.pi / 180
LOOSE = VERTICAL["poppy-seeds-loose"].stress
CLOSE = VERTICAL["poppy-seeds-close"].stress
# A set that is not near the generic one.
FAR = StressMap(0.3, 0.02, 0.25, 0.2, 0.15, -0.01, 0.3, 0.08, -0.03)
NAMED = [entry.stress for entry in VERTICAL.values()]
AXES = np.meshgrid(np.arange(-60, 91, 30) * RAD, np.arange(-90, 91, 30) * RAD)
GRID = [x.ravel() for x in AXES]
STEEP = np.stack([np.arange(-75, 91, 15) * RAD, np.full(12, 90 * RAD)])


def coefficients(stress):
    return stress.zeta * np.array([getattr(stress, name) for name in COEFFICIENTS])


def noisy(stress, rng, noise=0.01, angles=None, count=40):
    if angles is None:
        angles = rng.uniform(-90, 90, (2, count)) * RAD
    return *angles, *(a + rng.normal(0, noise, a.shape) for a in stress(*angles))


def design(beta, gamma):
    """Return the design matrix of both components, from the definition, for angles
    within +-pi/2."""
    sums = [2 * beta + gamma, gamma, gamma - 2 * beta]
    upwards = [beta**0, np.cos(2 * beta), *np.sin(sums)]
    along = [*np.cos(sums), np.sin(2 * beta)]
    along_rows = np.vstack([np.zeros((5, beta.size)), along])
    upward_rows = np.vstack([upwards, np.zeros((4, beta.size))])
    return np.hstack([along_rows, upward_rows]).T


def written(file, *lines):
    file.write_text("\n".join(lines) + "\n")
    return str(file)


def plates(file, angles=GRID, stress=CLOSE, angle_unit=RAD, scale=1.0):
    """Write plate drags with little noise."""
    beta, gamma, *alpha = noisy(stress, np.random.default_rng(3), 0.003, angles)
    drags = np.array(
        [beta / angle_unit, gamma / angle_unit, *(scale * np.array(alpha))]
    )
    lines = [",".join(f"{x:.6g}" for x in row) for row in drags.T]
    return written(file, "beta,gamma,alpha_x,alpha_z", *lines)


@pytest.mark.parametrize("stress", [FAR, *NAMED])
def test_exact_drags_give_their_set_back(stress):
    found = fit_stress(*GRID, *stress(*GRID))
    np.testing.assert_allclose(found.values, coefficients(stress), atol=1e-9)
    assert found.undetermined == []


def test_where_drags_determine_all_it_is_plain_least_squares():
    """Values to a twentieth of their errors, and the covariance of the textbook."""
    beta, gamma, *alpha = noisy(FAR, np.random.default_rng(0), 0.02, count=150)
    found = fit_stress(beta, gamma, *alpha)
    X = design(beta, gamma)
    y = np.concatenate(alpha)
    plain, (left,), *_ = np.linalg.lstsq(X, y, rcond=None)
    assert np.abs((found.values - plain) / found.errors).max() < 0.05
    textbook = left / (300 - 9) * np.linalg.inv(X.T @ X)
    np.testing.assert_allclose(found.covariance, textbook, rtol=0.02, atol=1e-7)
    np.testing.assert_allclose(found.residuals.ravel(), y - X @ found.values)
    half_widths = np.diff(found.intervals)[:, 0] / 2
    student = 1.968  # 291 degrees of freedom
    np.testing.assert_allclose(half_widths, student * found.errors, rtol=1e-3)


def test_intervals_cover():
    """By 6, 12 and 40 drags, with 95 %."""
    rng = np.random.default_rng(1)
    inside = []
    for k in range(270):
        stress = (LOOSE, CLOSE, FAR)[k % 3]
        drags = noisy(stress, rng, count=(6, 12, 40)[k // 3 % 3])
        low, high = fit_stress(*drags).intervals.T
        inside.append((low <= coefficients(stress)) & (coefficients(stress) <= high))
    assert 0.93 < np.mean(inside) < 0.975


def test_what_is_not_determined_follows_bayes():
    """Against the posterior of c = s M0 + d, with s nearly free and d of `SPREAD` zeta,
    at the noise that was found."""
    beta, gamma, *alpha = noisy(CLOSE, np.random.default_rng(2), 0.004, STEEP)
    found = fit_stress(beta, gamma, *alpha)
    rows_ = design(beta, gamma)
    measured = np.concatenate(alpha)
    with mpmath.workdps(50):
        M0 = mpmath.matrix(GENERIC[:, None].tolist())
        X = mpmath.matrix(rows_.tolist())
        y = mpmath.matrix(measured[:, None].tolist())
        spread = mpmath.mpf(SPREAD) * found.zeta
        prior = spread**2 * mpmath.eye(9) + mpmath.mpf(10) ** 10 * M0 * M0.T
        noise = mpmath.mpf(found.noise) ** 2 * mpmath.eye(24)
        gain = prior * X.T * (X * prior * X.T + noise) ** -1
        values = np.array((gain * y).tolist(), float)
        covariance = np.array((prior - gain * X * prior).tolist(), float)
    np.testing.assert_allclose(found.values, values[:, 0], atol=1e-9)
    np.testing.assert_allclose(found.covariance, covariance, atol=1e-9)
    # Such drags tell none of the nine from the others, but the stress straight down.
    assert found.undetermined == list(COEFFICIENTS)
    plain = rows_ @ np.linalg.lstsq(rows_, measured, rcond=None)[0]
    assert np.abs(rows_ @ found.values - plain).max() < 0.1 * found.noise


def test_no_matter_how_a_plate_is_turned():
    rng = np.random.default_rng(4)
    beta, gamma, a_x, a_z = noisy(LOOSE, rng, count=30)
    expected = fit_stress(beta, gamma, a_x, a_z)
    turns = rng.integers(-2, 3, (2, 30))
    mirrored = rng.random(30) < 0.5
    b, g, x = np.where(mirrored, [-beta, np.pi - gamma, -a_x], [beta, gamma, a_x])
    turned = fit_stress(b + np.pi * turns[0], g + 2 * np.pi * turns[1], x, a_z)
    np.testing.assert_allclose(turned.values, expected.values, atol=1e-9)
    residuals = np.where(mirrored, -1, 1) * expected.residuals[0]
    np.testing.assert_allclose(turned.residuals[0], residuals, atol=1e-9)


SLIPPED = [
    (lambda b, g, x, z: (b, g, z, x), "alpha_x and alpha_z were swapped"),
    (lambda b, g, x, z: (g, b, x, z), "beta and gamma were swapped"),
    (lambda b, g, x, z: (b, g, -x, z), "alpha_x had the opposite sign"),
    (lambda b, g, x, z: (b, g, x, -z), "alpha_z had the opposite sign"),
    (lambda b, g, x, z: (b, g, -x, -z), "both stresses had the opposite sign"),
    (lambda b, g, x, z: (b, -g, x, z), "gamma had the opposite sign"),
    (lambda b, g, x, z: (-b, g, x, z), "beta had the opposite sign"),
    (
        lambda b, g, x, z: (90 * RAD - b, g, x, z),
        "beta were not measured from the vertical",
    ),
    (
        lambda b, g, x, z: (b, 90 * RAD - g, x, z),
        "gamma were not measured from the vertical",
    ),
]
assert len(SLIPPED) == len(MISTAKES)


@pytest.mark.parametrize(("slip", "said"), SLIPPED, ids=[said for _, said in SLIPPED])
@pytest.mark.parametrize("stress", [StressMap(zeta=0.3), CLOSE])
def test_slips_of_columns_and_signs_are_named(slip, said, stress):
    drags = noisy(stress, np.random.default_rng(5), 0.01, GRID)
    with pytest.raises(
        ValueError, match=f"do not resemble those of any grains.*{said}"
    ):
        fit_stress(*slip(*drags))


def penetrated(rng, noise=0.05, count=40, alike=1):
    """Return depths and forces of zeta = 0.31 on 9.5 cm^2; noise is the same for some
    neighbours."""
    depth = np.linspace(0.003, 0.06, count)
    scatter = np.repeat(rng.normal(0, noise, count // alike), alike)
    return depth, 0.31e6 * depth * 9.5e-4 + scatter


def test_zeta_is_the_slope_through_the_origin():
    depth, force = penetrated(np.random.default_rng(0))
    found = fit_zeta(depth, force, 9.5e-4)
    unit = 1e6 * 9.5e-4 * depth
    slope = (unit @ force) / (unit @ unit)
    assert found.zeta == pytest.approx(slope, rel=1e-12)
    residuals = force - slope * unit
    np.testing.assert_allclose(found.force - found.law, residuals, atol=1e-12)
    plain = np.sqrt(residuals @ residuals / 39 / (unit @ unit))
    assert plain * (1 - 1e-12) <= found.error < 1.5 * plain
    student = 2.0227  # 39 degrees of freedom
    half_width = np.diff(found.interval)[0] / 2
    assert half_width == pytest.approx(student * found.error, rel=1e-4)


@pytest.mark.parametrize(("alike", "fewest"), [(1, 0.92), (4, 0.85)])
def test_errors_of_a_push_cover_even_if_neighbours_scatter_alike(alike, fewest):
    """Intervals of zeta, in any order of rows, and the scatter of the depth of zero."""
    rng = np.random.default_rng(1)
    inside = []
    off = []
    for _ in range(300):
        depth, force = penetrated(rng, 0.3, 60, alike)
        order = rng.permutation(60)
        found = fit_zeta(depth[order], force[order], 9.5e-4)
        inside.append(found.interval[0] <= 0.31 <= found.interval[1])
        off.append(found.zero / found.zero_error)
    assert np.mean(inside) > fewest
    assert 0.8 < np.std(off) < 1.3


def test_areas_may_differ_and_rows_above_the_surface_do_not_count():
    depth = [-0.01, 0.0, 0.01, 0.02, 0.03]
    area = np.array([1, 1, 1, 2, 3]) * 1e-3
    found = fit_zeta(depth, [3.0, 9.0, 1.0, 4.0, 9.0], area)
    assert found.zeta == pytest.approx(0.1, rel=1e-12)


DEPTHS = [0.01, 0.02, 0.03]
FORCES = [1.0, 2.0, 3.0]
REFUSED = {
    "3 to 100000 depths below the surface": lambda: fit_zeta([-1.0] * 3, FORCES, 1.0),
    "the force has the wrong sign for the law": lambda: fit_zeta(
        DEPTHS, [-1.0] * 3, 1e-3
    ),
    "the range of grains (0.01 to 100): check the units, depth": lambda: fit_zeta(
        DEPTHS, FORCES, 1e-9
    ),
    "area of the plate must be above 0": lambda: fit_zeta(DEPTHS, FORCES, [1, 0, 1]),
    "must be finite": lambda: fit_zeta([0.01, np.nan, 0.03], FORCES, 1e-3),
    "depth and force must have the same length": lambda: fit_zeta([0.01], FORCES, 1e-3),
    "area must be one number": lambda: fit_zeta(DEPTHS, FORCES, [1e-3] * 2),
    "the same length": lambda: fit_stress([0.1], [0.1, 0.2], [1], [1]),
    "must be a whole number from 6": lambda: fit_stress(*[[0.1] * 5] * 4),
    "the plate drags are all 0": lambda: fit_stress(*GRID, 0 * GRID[0], 0 * GRID[0]),
}


@pytest.mark.parametrize("said", REFUSED)
def test_what_makes_no_sense_is_refused_with_one_line(said):
    with pytest.raises(ValueError, match=".") as caught:
        REFUSED[said]()
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("shift", "noise", "noted"),
    [(0.004, 0.05, True), (-0.0025, 0.05, True), (0.0, 0.05, False), (0.0, 2.0, False)],
)
def test_a_surface_that_is_elsewhere_is_noted(shift, noise, noted, tmp_path):
    """Not if the force is zero at some other depth by chance."""
    depth, force = penetrated(np.random.default_rng(10), noise)
    lines = [f"{d + shift:.8f},{f:.6g}" for d, f in zip(depth, force)]
    file = written(tmp_path / "p.csv", "depth,force", *lines)
    found = calibration.answer(file, "zeta", {"area": 9.5e-4})
    assert ("note" in found) == noted


# A header and a row with the depth 2 and the force 3: both and the area, m, N, m^2.
HEADS = {
    "depth_m,force_n\n2,3": (2, 3, None),
    "force (N),depth (cm)\n3,2": (0.02, 3, None),
    "depth_mm,force_mN,t\n2,3,7": (2e-3, 3e-3, None),
    "z,force_z\n2,3": (-2, 3, None),
    "z_mm,force_z_kN\n2,3": (-2e-3, 3e3, None),
    "z (cm),Fz_N\n2,3": (-0.02, 3, None),
    "penetration depth [mm],F_z (mN),plate_area_cm2\n2,3,7": (2e-3, 3e-3, 7e-4),
    "z_m,force\n2,3": (-2, 3, None),
    "depth,force,area\n2,3,7": (2, 3, 7),
    "depth,force,area_m2\n2,3,7": (2, 3, 7),
    "Depth,Force,Area_cm2\n2,3,7": (2, 3, 7e-4),
    "depth,force,plate area (mm^2)\n2,3,7": (2, 3, 7e-6),
    "# plate area = 9.5 cm^2\ndepth,force\n2,3": (2, 3, 9.5e-4),
    "# area 950 mm2, level\ndepth,force\n2,3": (2, 3, 9.5e-4),
    "# area_cm2 = 9.5\ndepth,force\n2,3": (2, 3, 9.5e-4),
    "# area = 9.5e-4\ndepth,force\n2,3": (2, 3, 9.5e-4),
    "# a plate of 3.8 cm x 2.5 cm\ndepth,force\n2,3": (2, 3, 9.5e-4),
    "# Area (cm^2): 9.5; plate 38 by 25 mm\ndepth,force\n2,3": (2, 3, 9.5e-4),
    "# plate diameter 4 cm\ndepth,force\n2,3": (2, 3, 4e-4 * np.pi),
}


@pytest.mark.parametrize("text", HEADS)
def test_columns_and_areas_in_the_units_they_name(text, tmp_path):
    depth, force, area = HEADS[text]
    file = written(tmp_path / "p.csv", text)
    found = penetration.read(rows.read(file, 1000, ""))
    assert (found.depth[0], found.force[0]) == pytest.approx((depth, force))
    if area is None:
        assert found.area is None
    else:
        assert found.area[0] == pytest.approx(area)


def test_plate_drags_become_a_medium_that_scenes_read(tmp_path):
    fitted = calibration.answer(plates(tmp_path / "plates.csv"))
    off = np.abs(fitted["value"].values - coefficients(CLOSE))
    assert (off < fitted["value"].error).all()
    written(tmp_path / "m.toml", fitted.attributes["medium_toml"])
    whole = scenes.load("c-leg").text
    text = whole.replace('name = "poppy-seeds-loose"', 'file = "m.toml"')
    loaded = scenes.load(written(tmp_path / "s.toml", text))
    np.testing.assert_array_equal(coefficients(loaded.medium), fitted["value"].values)


def pushed(file, head="# area = 9.5e-4", scale=1.0):
    """Write a push, its depths in another unit."""
    depth, force = penetrated(np.random.default_rng(3))
    lines = [f"{scale * d:.8f},{f:.6g}" for d, f in zip(depth, force)]
    return written(file, head, "depth,force", *lines)


SLIPS_OF_UNITS = {
    "beta and gamma appear to be in radians": lambda file: plates(file, angle_unit=1.0),
    "1e-6 of the value in N/m^3": lambda file: plates(file, scale=1e6),
    "depth in m": lambda file: pushed(file, scale=1e3),
    "force in N, area in m^2": lambda file: pushed(file, "# area = 9.5"),
    "give areas 0.0009 and 0.0012 m^2": lambda file: pushed(
        file, "# plate area 9 cm^2\n# plate 3 x 4 cm"
    ),
}


@pytest.mark.parametrize("said", SLIPS_OF_UNITS)
def test_slips_of_units_are_named(said, tmp_path):
    file = SLIPS_OF_UNITS[said](tmp_path / "drags.csv")
    with pytest.raises(ValueError, match="drags.csv") as caught:
        calibration.answer(file)
    assert said in str(caught.value)
