"""Strength and coefficients of a stress map from measurements: against closed forms, plain least squares, a Bayesian formula
and known sets under noise; slips of columns, signs and units are refused."""

import former
import mpmath
import numpy as np
import pytest
from commands import geomech
from tabled import of_json

from geomech import scenes as scene
from geomech.io import rows
from geomech.scenes.terradynamics import penetration
from geomech.studies.terradynamics import calibration, stress_calibration
from rft.fits import plates as calibrate
from rft.fits.plates import (
    COEFFICIENTS,
    GENERIC,
    MISTAKES,
    SPREAD,
    fit_stress,
    fit_zeta,
)
from rft.terradynamics.plates import VERTICAL, StressMap
from rft.terradynamics.plates.survey import survey

RAD = np.pi / 180
FAR = StressMap(
    0.3, 0.02, 0.25, 0.2, 0.15, -0.01, 0.3, 0.08, -0.03
)  # a set that is not near the generic one
GRID = [
    x.ravel()
    for x in np.meshgrid(np.arange(-60, 91, 30) * RAD, np.arange(-90, 91, 30) * RAD)
]


def coefficients(stress):
    return stress.zeta * np.array([getattr(stress, name) for name in COEFFICIENTS])


def noisy(stress, rng, noise=0.01, angles=None, count=40):
    angles = rng.uniform(-90, 90, (2, count)) * RAD if angles is None else angles
    return *angles, *(a + rng.normal(0, noise, a.shape) for a in stress(*angles))


def design(beta, gamma):
    """Of both components, from the definition (DESIGN section 4), for angles within +-pi/2."""
    one, zero = np.ones_like(beta), np.zeros((4, len(beta)))
    upwards = [
        one,
        np.cos(2 * beta),
        np.sin(2 * beta + gamma),
        np.sin(gamma),
        np.sin(gamma - 2 * beta),
    ]
    along = [
        np.cos(2 * beta + gamma),
        np.cos(gamma),
        np.cos(gamma - 2 * beta),
        np.sin(2 * beta),
    ]
    return np.concatenate(
        [
            np.concatenate([np.zeros((5, len(beta))), along]),
            np.concatenate([upwards, zero]),
        ],
        1,
    ).T


def plates(
    tmp_path,
    stress=VERTICAL["poppy-seeds-close"].stress,
    noise=0.003,
    angles=None,
    name="plates.csv",
    scale=1.0,
):
    beta, gamma, *alpha = noisy(
        stress, np.random.default_rng(3), noise, GRID if angles is None else angles
    )
    lines = [
        f"{b / RAD:.6g},{g / RAD:.6g},{scale * x:.6g},{scale * z:.6g}"
        for b, g, x, z in zip(beta, gamma, *alpha)
    ]
    return written(tmp_path / name, "beta,gamma,alpha_x,alpha_z", *lines)


def written(file, *lines):
    file.write_text("\n".join(lines) + "\n")
    return file


@pytest.mark.parametrize(
    "stress", [FAR, *(entry.stress for entry in VERTICAL.values())]
)
def test_exact_drags_give_their_set_back(stress):
    found = fit_stress(*GRID, *stress(*GRID))
    np.testing.assert_allclose(found.values, coefficients(stress), atol=1e-9)
    assert found.undetermined == [] and found.resolution.min() > 1 - 1e-9
    assert np.abs(found.residuals).max() < 1e-9
    strength = coefficients(stress) @ GENERIC / (GENERIC @ GENERIC)
    assert found.zeta == pytest.approx(strength, rel=0.3)


def test_where_drags_determine_all_it_is_plain_least_squares():
    """Values to a hundredth of their errors, and the covariance of the textbook."""
    rng = np.random.default_rng(0)
    beta, gamma, a_x, a_z = noisy(FAR, rng, 0.02, count=150)
    found, rows_ = fit_stress(beta, gamma, a_x, a_z), design(beta, gamma)
    plain, (left,), *_ = np.linalg.lstsq(rows_, np.concatenate([a_x, a_z]), rcond=None)
    assert np.abs((found.values - plain) / found.errors).max() < 0.05
    np.testing.assert_allclose(
        found.covariance,
        left / (300 - 9) * np.linalg.inv(rows_.T @ rows_),
        rtol=0.02,
        atol=1e-7,
    )
    assert found.free == pytest.approx(291, abs=0.1)
    np.testing.assert_allclose(
        found.residuals.ravel(),
        np.concatenate([a_x, a_z]) - rows_ @ found.values,
        atol=1e-12,
    )
    wide = np.diff(found.intervals)[:, 0] / 2
    np.testing.assert_allclose(
        wide, 1.968 * found.errors, rtol=1e-3
    )  # Student, 291 degrees of freedom


def test_intervals_cover():
    """Of sets that are named and one far from generic, by 6, 12 and 40 drags, with 95 %."""
    rng, inside, total = np.random.default_rng(1), 0, 0
    for k in range(270):
        stress = (
            VERTICAL["poppy-seeds-loose"].stress,
            VERTICAL["poppy-seeds-close"].stress,
            FAR,
        )[k % 3]
        found = fit_stress(*noisy(stress, rng, count=(6, 12, 40)[k // 3 % 3]))
        low, high = found.intervals.T
        inside += ((low <= coefficients(stress)) & (coefficients(stress) <= high)).sum()
        total += 9
    assert 0.93 < inside / total < 0.975


def test_what_is_not_determined_follows_bayes():
    """Against the posterior of c = s M0 + d with s nearly free and d of SPREAD zeta, at the noise that was found."""
    rng = np.random.default_rng(2)
    angles = np.stack([np.arange(-75, 91, 15) * RAD, np.full(12, 90 * RAD)])
    stress = VERTICAL["poppy-seeds-close"].stress
    beta, gamma, *alpha = noisy(stress, rng, 0.004, angles)
    found, rows_ = fit_stress(beta, gamma, *alpha), design(beta, gamma)
    with mpmath.workdps(50):
        M0, X, y = (
            mpmath.matrix(a.tolist())
            for a in (GENERIC[:, None], rows_, np.concatenate(alpha)[:, None])
        )
        prior = (mpmath.mpf(SPREAD) * found.zeta) ** 2 * mpmath.eye(9) + mpmath.mpf(
            10
        ) ** 10 * M0 * M0.T
        gain = (
            prior
            * X.T
            * (X * prior * X.T + mpmath.mpf(found.noise) ** 2 * mpmath.eye(24)) ** -1
        )
        values, covariance = (
            np.array(a.tolist(), float) for a in (gain * y, prior - gain * X * prior)
        )
    np.testing.assert_allclose(found.values, values[:, 0], atol=1e-9)
    np.testing.assert_allclose(found.covariance, covariance, atol=1e-9)
    np.testing.assert_allclose(
        found.resolution[COEFFICIENTS.index("C01")], 0.0, atol=0.3
    )
    low, high = found.intervals.T
    assert ((low <= coefficients(stress)) & (coefficients(stress) <= high)).all()
    assert found.undetermined == list(
        COEFFICIENTS
    )  # A00 and B01 are told apart by nothing, nor are the others
    # What the drags do tell, stress straight down, is theirs all the same.
    plain = rows_ @ np.linalg.lstsq(rows_, np.concatenate(alpha), rcond=None)[0]
    assert np.abs(rows_ @ found.values - plain).max() < 0.1 * found.noise


def test_the_least_known_angle():
    beta, gamma = GRID
    found = fit_stress(
        beta[gamma > 0.5],
        gamma[gamma > 0.5],
        *(a[gamma > 0.5] for a in StressMap()(*GRID)),
    )
    where = found.least_known()

    def spread(*angles):
        rows_ = design(*np.array(angles)[:, None])
        return np.trace(rows_ @ found.covariance @ rows_.T)

    assert where[1] < 0
    assert all(spread(*where) >= spread(b, g) * (1 - 1e-9) for b, g in zip(*GRID))


def test_no_matter_how_a_plate_is_turned_nor_in_which_unit():
    rng = np.random.default_rng(4)
    beta, gamma, a_x, a_z = noisy(VERTICAL["poppy-seeds-loose"].stress, rng, count=30)
    want = fit_stress(beta, gamma, a_x, a_z)
    turns = rng.integers(-2, 3, (2, 30))
    mirrored = rng.random(30) < 0.5
    b, g, x = np.where(mirrored, [-beta, np.pi - gamma, -a_x], [beta, gamma, a_x])
    turned = fit_stress(b + np.pi * turns[0], g + 2 * np.pi * turns[1], x, a_z)
    np.testing.assert_allclose(turned.values, want.values, atol=1e-9)
    np.testing.assert_allclose(
        turned.residuals[0], np.where(mirrored, -1, 1) * want.residuals[0], atol=1e-9
    )
    stronger = fit_stress(beta, gamma, 3 * a_x, 3 * a_z)
    np.testing.assert_allclose(stronger.values, 3 * want.values, rtol=1e-7)
    np.testing.assert_allclose(stronger.errors, 3 * want.errors, rtol=1e-7)
    order = rng.permutation(30)
    np.testing.assert_allclose(
        fit_stress(beta[order], gamma[order], a_x[order], a_z[order]).values,
        want.values,
        atol=1e-10,
    )


SLIPPED = [
    (lambda b, g, x, z: (b, g, z, x), "alpha_x and alpha_z are swapped"),
    (lambda b, g, x, z: (g, b, x, z), "beta and gamma are swapped"),
    (lambda b, g, x, z: (b, g, -x, z), "alpha_x has the other sign"),
    (lambda b, g, x, z: (b, g, x, -z), "alpha_z has the other sign"),
    (lambda b, g, x, z: (b, g, -x, -z), "both stresses have the other sign"),
    (lambda b, g, x, z: (b, -g, x, z), "gamma has the other sign"),
    (lambda b, g, x, z: (-b, g, x, z), "beta has the other sign"),
    (lambda b, g, x, z: (90 * RAD - b, g, x, z), "beta is from the vertical"),
    (lambda b, g, x, z: (b, 90 * RAD - g, x, z), "gamma is from the vertical"),
]


@pytest.mark.parametrize(("slip", "said"), SLIPPED, ids=[said for _, said in SLIPPED])
def test_slips_of_columns_and_signs_are_named(slip, said):
    rng = np.random.default_rng(5)
    for stress in (StressMap(zeta=0.3), VERTICAL["poppy-seeds-close"].stress):
        with pytest.raises(ValueError, match="like those of no grains") as caught:
            fit_stress(*slip(*noisy(stress, rng, 0.01, GRID)))
        assert said in str(caught.value)
    assert len(SLIPPED) == len(MISTAKES)


def test_no_medium_is_taken_for_a_slip():
    """Those named, the far one, and each with noise of a third of its stress."""
    rng = np.random.default_rng(6)
    for stress in (FAR, *(entry.stress for entry in VERTICAL.values())):
        for noise in (0.0, 0.1 * stress.zeta * (stress.A00 + stress.B01) / 0.5):
            fit_stress(*noisy(stress, rng, noise))


def penetrated(rng, zeta=0.31, area=9.5e-4, noise=0.05, count=40):
    depth = np.linspace(0.003, 0.06, count)
    return depth, zeta * 1e6 * depth * area + rng.normal(0, noise, count)


def test_zeta_is_the_slope_through_the_origin():
    depth, force = penetrated(np.random.default_rng(0))
    found, unit = fit_zeta(depth, force, 9.5e-4), 1e6 * 9.5e-4 * depth
    slope = (unit @ force) / (unit @ unit)
    assert found.zeta == pytest.approx(slope, rel=1e-12)
    plain = np.sqrt(((force - slope * unit) ** 2).sum() / 39 / (unit @ unit))
    assert plain * (1 - 1e-12) <= found.error < 1.5 * plain
    assert np.diff(found.interval)[0] / 2 == pytest.approx(
        2.0227 * found.error, rel=1e-4
    )  # Student, 39
    np.testing.assert_allclose(
        found.force - found.law, force - slope * unit, atol=1e-12
    )
    assert found.stress == StressMap(zeta=found.zeta)
    assert found.stress(0.0, np.pi / 2)[1] == pytest.approx(found.zeta)
    line = np.polyfit(depth, force, 1)
    assert found.zero == pytest.approx(-line[1] / line[0], rel=1e-9)


def test_intervals_of_zeta_cover_even_if_neighbours_scatter_alike():
    """White noise, and noise of which each value is shared by four neighbours; in any order of rows."""
    rng = np.random.default_rng(1)
    for alike, fewest in ((1, 0.92), (4, 0.85)):
        inside = 0
        for _ in range(300):
            depth, force = penetrated(rng, noise=0.0, count=60)
            order = rng.permutation(60)
            force = force + np.repeat(rng.normal(0, 0.3, 60 // alike), alike)
            low, high = fit_zeta(depth[order], force[order], 9.5e-4).interval
            inside += low <= 0.31 <= high
        assert inside / 300 > fewest


def test_the_error_of_the_depth_of_zero_is_its_scatter():
    rng = np.random.default_rng(7)
    for alike in (1, 4):
        off = []
        for _ in range(300):
            depth, force = penetrated(rng, noise=0.0, count=80)
            found = fit_zeta(
                depth + 0.001,
                force + np.repeat(rng.normal(0, 0.3, 80 // alike), alike),
                9.5e-4,
            )
            off.append((found.zero - 0.001) / found.zero_error)
        assert 0.8 < np.sqrt(np.mean(np.square(off))) < 1.3


def test_areas_may_differ_and_rows_above_the_surface_do_not_count():
    depth, force = (
        np.array([-0.01, 0.0, 0.01, 0.02, 0.03]),
        np.array([3.0, 9.0, 1.0, 4.0, 9.0]),
    )
    found = fit_zeta(depth, force, np.array([1, 1, 1, 2, 3]) * 1e-3)
    assert found.zeta == pytest.approx(0.1, rel=1e-12)
    assert found.depth.tolist() == [0.01, 0.02, 0.03]
    assert abs(found.zero) < 1e-12


REFUSED = {
    "3 to 100000 depths below the surface are needed, got 0": lambda: fit_zeta(
        [-1.0, -2, -3], [1.0, 2, 3], 1e-3
    ),
    "the force is against the law": lambda: fit_zeta(
        [0.01, 0.02, 0.03], [-1.0, -2, -3], 1e-3
    ),
    "zeta = 1e+05 is that of no grains": lambda: fit_zeta(
        [0.01, 0.02, 0.03], [0.1e9, 0.2e9, 0.3e9], 1e-1
    ),
    "the area of the plate must be above 0": lambda: fit_zeta(
        [0.01, 0.02, 0.03], [1.0, 2, 3], [1.0, 0.0, 1.0]
    ),
    "depths, forces and areas must be finite": lambda: fit_zeta(
        [0.01, np.nan, 0.03], [1.0, 2, 3], 1e-3
    ),
    "depth and force must be equally many": lambda: fit_zeta(
        [0.01, 0.02], [1.0, 2, 3], 1e-3
    ),
    "area must be one number": lambda: fit_zeta(
        [0.01, 0.02, 0.03], [1.0, 2, 3], [1e-3, 1e-3]
    ),
    "depth must be real numbers": lambda: fit_zeta(["a", "b"], [1.0, 2], 1e-3),
    "equally many numbers": lambda: fit_stress([0.1], [0.1, 0.2], [1], [1]),
    "plate drags must be finite numbers of at most 1e+12": lambda: fit_stress(
        *GRID, GRID[0], GRID[0] + 1e300
    ),
    "plate drags must be finite": lambda: fit_stress(*GRID, GRID[0] * np.nan, GRID[0]),
    "number of plate drags must be a whole number from 6": lambda: fit_stress(
        *[[0.1] * 5] * 4
    ),
    "the plate drags are all 0": lambda: fit_stress(
        *GRID, 0 * GRID[0], 0 * GRID[0] + 1e-300
    ),
    "is that of no grains (0.01 to 100): check the units": lambda: fit_stress(
        *GRID, *(1e6 * a for a in StressMap()(*GRID))
    ),
}


@pytest.mark.parametrize("said", REFUSED)
def test_what_makes_no_sense_is_refused_with_one_line(said):
    with pytest.raises(ValueError, match=".") as caught:
        REFUSED[said]()
    assert said in str(caught.value) and "\n" not in str(caught.value)


def test_plate_drags_become_a_medium_that_commands_read(tmp_path):
    file, out = plates(tmp_path), tmp_path / "m.toml"
    code, text, err = geomech("fit-medium", file, "-o", out, "--json")
    found = former.medium(text)
    assert (code, err, found["law"]) == (0, "", "stress-map")
    close = VERTICAL["poppy-seeds-close"].stress
    for name in COEFFICIENTS:
        low, high = found["intervals"][name.replace("m", "-")]
        assert low <= found[name.replace("m", "-")] <= high
        assert found[name.replace("m", "-")] == pytest.approx(
            getattr(close, name), abs=0.004
        )
    assert found["parameters"][4] == "B-11" and found["undetermined"] == []
    assert np.sqrt(np.diag(found["covariance"])) == pytest.approx(
        list(found["errors"].values())
    )
    assert found["rms"] == pytest.approx(0.003, rel=0.3)
    assert (
        len(found["residuals"]["alpha_x"]) == len(found["residuals"]["beta_deg"]) == 42
    )
    told = of_json(geomech("stress", out, "--beta", "30", "--gamma", "50", "--json")[1])
    medium = StressMap(*(found[name.replace("m", "-")] for name in COEFFICIENTS))
    np.testing.assert_allclose(
        [float(told["alpha_x"]), float(told["alpha_z"])],
        medium(30 * RAD, 50 * RAD),
        atol=1e-9,
    )
    text = (
        '[medium]\nfile = "m.toml"\n[intruder]\nkind = "plate"\nlength = 0.03\nwidth = 0.02\n'
        '[motion]\nkind = "penetrate"\ndepth = 0.04\n'
    )
    loaded = scene.load(written(tmp_path / "s.toml", text))
    assert loaded.medium == medium
    assert str(out) in map(str, scene.inputs(loaded))


def test_what_is_not_determined_is_noted(tmp_path):
    level = np.stack([np.arange(-75, 91, 15) * RAD, np.zeros(12)])
    file, out = plates(tmp_path, angles=level), tmp_path / "m.toml"
    code, text, err = geomech(
        "fit-medium", file, "-o", out, "--plot", tmp_path / "map.svg"
    )
    assert code == 0 and err.count("\n") == 1
    assert (
        err.startswith("note: plates.csv: these drags do not determine ")
        and "B01" in err
    )
    assert (
        "A00" not in err and "D10" not in err and "A10" not in err
    )  # at gamma = 0 they stand alone
    assert "generic shape" in out.read_text() and "B01" in text
    assert former.medium(geomech("fit-medium", file, "--json")[1])["undetermined"][
        :2
    ] == [
        "B11",
        "B01",
    ]
    assert "not determined" in (tmp_path / "map.svg").read_text()


def test_numbers_are_those_of_the_fit(tmp_path):
    found = calibration.answer(str(plates(tmp_path)), "stress-map")
    alpha, strength = found["stress"].values, float(found["zeta"])
    f = fit_stress(*GRID, *alpha)
    assert strength == pytest.approx(f.zeta)
    np.testing.assert_allclose(found["generic"].values, f.zeta * GENERIC)
    value = found["value"]
    np.testing.assert_allclose(value.values, f.values)
    np.testing.assert_allclose(value.values + value.error, f.intervals[:, 1])
    np.testing.assert_allclose(found["beta"].values, GRID[0] / RAD)
    np.testing.assert_allclose(found["gamma"].values, GRID[1] / RAD)
    of_map = np.array(f.stress(*GRID))
    np.testing.assert_allclose(found["fitted"].values, of_map, atol=1e-12)
    np.testing.assert_allclose(found["residual"].values, alpha - of_map, atol=1e-12)
    file = written(tmp_path / "p.csv", "depth,force", *TEST)
    test = calibration.answer(str(file), "zeta", {"area": 1e-3})
    law, z = test["fitted"], float(test["value"][0])
    np.testing.assert_allclose(law.values, z * 1e3 * test["depth"].values)
    share = float(test["value"].error[0]) / z
    np.testing.assert_allclose(law.error / law.values, np.full(4, share))
    left = test["force"].values - law.values
    assert float(test["rms"]) == pytest.approx(np.sqrt(np.mean(left**2)))


def test_drags_are_drawn_where_the_same_plate_moves_ahead():
    from geomech.plots.terradynamics.intruders import mirrored_ahead

    beta, gamma = np.random.default_rng(8).uniform(-360, 360, (2, 400))
    b, g, side = mirrored_ahead(beta, gamma)
    assert np.abs([b, g]).max() <= 90
    a_x, a_z = StressMap()(beta * RAD, gamma * RAD)
    np.testing.assert_allclose(
        StressMap()(b * RAD, g * RAD), [side * a_x, a_z], atol=1e-12
    )


TEST = ("0.01,2.1", "0.02,4.2", "0.03,5.9", "0.05,10.1")


def test_one_component_may_be_nothing():
    """Straight up and down with level plates there is no drag at all."""
    level, way = np.zeros(8), np.repeat([90.0, -90.0], 4) * RAD
    a_x, a_z = StressMap(zeta=0.5)(level, way)
    found = fit_stress(level, way, 0 * a_x, a_z)
    assert found.zeta == pytest.approx(0.5)
    np.testing.assert_allclose(found.stress(0.0, np.pi / 2), (0.0, 0.5), atol=1e-6)


def test_a_map_that_drives_motion_on_is_noted(tmp_path):
    lost = StressMap(B01=-0.05)
    assert survey(lost).pushing > 0
    found = calibration.answer(str(plates(tmp_path, lost)), "stress-map")
    assert any("drives motion on" in line for line in found["note"].values)


def test_a_plate_that_the_package_pushes_down_has_its_zeta(tmp_path):
    """The table of `geomech intrude` is a penetration test: columns z and force_z."""
    plate = '[intruder]\nkind = "plate"\nlength = 0.038\nwidth = 0.025\n[motion]\nkind = "penetrate"\ndepth = 0.05\n'
    written(tmp_path / "s.toml", '[medium]\nname = "glass-3mm"\n' + plate)
    assert geomech("intrude", tmp_path / "s.toml", "-o", tmp_path / "down.csv")[0] == 0
    code, text, err = geomech(
        "fit-medium",
        tmp_path / "down.csv",
        "--area",
        9.5e-4,
        "-o",
        tmp_path / "m.toml",
        "--json",
    )
    found = former.medium(text)
    assert (code, err, found["law"], found["area"]) == (0, "", "zeta", 9.5e-4)
    assert found["zeta"] == pytest.approx(0.224, rel=1e-9)
    assert 0 < found["error"] < 1e-10
    assert found["covariance"] == [[pytest.approx(found["error"] ** 2)]]
    again = scene.load(
        written(tmp_path / "t.toml", '[medium]\nfile = "m.toml"\n' + plate)
    )
    assert again.medium == StressMap(zeta=found["zeta"])
    np.testing.assert_allclose(
        again.run().force, scene.load(tmp_path / "s.toml").run().force, rtol=1e-9
    )


def test_zeta_as_text_and_picture(tmp_path):
    depth, force = penetrated(np.random.default_rng(2))
    rows_ = [f"{1e3 * d:.6g},{f:.6g}" for d, f in zip(depth, force)]
    file = written(tmp_path / "p.csv", "# plate 38 x 25 mm", "depth_mm,force_N", *rows_)
    code, text, err = geomech(
        "fit-medium", file, "-o", tmp_path / "m.toml", "--plot", tmp_path / "p.png"
    )
    assert (code, err) == (0, "")
    assert text.startswith("zeta fitted to p.csv: 40 depths to 6 cm\n")
    assert (tmp_path / "p.png").is_file()
    assert "zeta = 0.3" in (tmp_path / "m.toml").read_text()


def test_a_surface_that_is_elsewhere_is_noted(tmp_path):
    depth, force = penetrated(np.random.default_rng(3))
    loud = force + np.random.default_rng(10).normal(
        0, 2.0, 40
    )  # zero at some other depth, by chance
    assert abs(fit_zeta(depth, loud, 9.5e-4).zero) > 0.02 * 0.06
    for shift, notes, measured in (
        (0.004, 1, force),
        (-0.0025, 1, force),
        (0.0, 0, force),
        (0.0, 0, loud),
    ):
        file = written(
            tmp_path / "p.csv",
            "depth,force",
            *(f"{d + shift:.8f},{f:.6g}" for d, f in zip(depth, measured)),
        )
        code, _, err = geomech("fit-medium", file, "--area", "9.5e-4")
        assert (code, err.count("\n")) == (0, notes)
        assert not notes or f"is zero at a depth of {1e3 * shift:.1f}"[:-1] in err


HEADS = {
    "depth_m,force_n": (1, 1, None),
    "force (N),depth (cm)": (1e-2, 1, None),
    "depth_mm,force_mN,t": (1e-3, 1e-3, None),
    "z,force_z": (-1, 1, None),
    "z_mm,force_z_kN": (-1e-3, 1e3, None),
    "z (cm),Fz_N": (-1e-2, 1, None),
    "penetration depth [mm],F_z (mN),plate_area_cm2": (1e-3, 1e-3, 1e-4),
    "z_m,force": (-1, 1, None),
    "depth,force,area": (1, 1, 1),
    "depth,force,area_m2": (1, 1, 1),
    "Depth,Force,Area_cm2": (1, 1, 1e-4),
    "depth,force,plate area (mm^2)": (1, 1, 1e-6),
    "# plate area = 9.5 cm^2\ndepth,force": (1, 1, "9.5e-4"),
    "# area 950 mm2, level\ndepth,force": (1, 1, "9.5e-4"),
    "# area_cm2 = 9.5\ndepth,force": (1, 1, "9.5e-4"),
    "# area = 9.5e-4\ndepth,force": (1, 1, "9.5e-4"),
    "# a plate of 3.8 cm x 2.5 cm\ndepth,force": (1, 1, "9.5e-4"),
    "# Area (cm^2): 9.5; plate 38 by 25 mm\ndepth,force": (1, 1, "9.5e-4"),
}


@pytest.mark.parametrize("head", HEADS)
def test_columns_and_areas_in_the_units_they_name(head, tmp_path):
    per_depth, per_force, area = HEADS[head]
    names = head.split("\n")[-1].split(",")
    row = ",".join(
        {"d": "2", "p": "2", "z": "2", "f": "3"}.get(
            n.replace("plate", "").strip(" _")[0].lower(), "7"
        )
        for n in names
    )
    found = penetration.read(
        rows.read(written(tmp_path / "p.csv", head, row), 1000, "")
    )
    assert (found.depth[0], found.force[0]) == pytest.approx(
        (2 * per_depth, 3 * per_force)
    )
    if area is None:
        assert found.area is None
    else:
        assert found.area[0] == pytest.approx(
            float(area) if isinstance(area, str) else 7 * area
        )


BAD = {
    "no number": (
        ["beta,gamma,alpha_x,alpha_z", "0,90,nan,1"] * 3,
        "plates: p.csv, line 2: a row must be 4 finite numbers",
    ),
    "short row": (
        ["beta,gamma,alpha_x,alpha_z", "0,90,0.1"],
        "line 2: a row must be 4 finite numbers",
    ),
    "turns": (
        ["beta,gamma,alpha_x,alpha_z", "0,361,0,1"],
        "beta and gamma must be from -360 to 360 degrees, got 361",
    ),
    "inches": (
        ["depth_inch,force_N", "1,2"],
        "line 1: the header has no column depth: it has 'depth_inch, force_N'; it must have depth_m,force_N",
    ),
    "few": (
        ["beta,gamma,alpha_x,alpha_z", "0,90,0,1"],
        "p.csv: number of plate drags must be a whole number from 6",
    ),
    "none": (["beta,gamma,alpha_x,alpha_z"], "p.csv: number of plate drags must be"),
    "column": (
        ["beta,gamma,alpha_x", "0,90,0"],
        "line 1: the header must be beta,gamma,alpha_x,alpha_z",
    ),
    "area": (
        ["depth,force", "0.1,1"],
        "p.csv: the area of the plate is missing: give --area in m^2",
    ),
    "two areas": (
        ["# plate area 9 cm^2", "# plate 3 x 4 cm", "depth,force", "1,2"],
        "give areas 0.0009 and 0.0012 m^2",
    ),
    "area twice": (
        ["# plate area 9 cm^2", "depth,force,area", "1,2,3"],
        "area is given in a column and in a header line",
    ),
    "two depths": (
        ["depth_mm,depth_m,force", "1,2,3"],
        "p.csv, line 1: the header has 2 columns depth: it has 'depth_mm, depth_m, force'; keep one",
    ),
    "text": (
        ["depth,force", "0.01,soft"],
        "p.csv, line 2: a row must be 2 finite numbers (depth,force)",
    ),
    "few depths": (
        ["# plate area 9 cm^2", "depth,force", "0.01,1"],
        "3 to 100000 depths below the surface are needed",
    ),
}


@pytest.mark.parametrize("kind", BAD)
def test_bad_files_get_one_line(kind, tmp_path):
    lines, said = BAD[kind]
    code, out, err = geomech(
        "fit-medium", written(tmp_path / "p.csv", *lines), "-o", tmp_path / "m.toml"
    )
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert said.replace("plates: ", "") in err
    assert not (tmp_path / "m.toml").exists()


def test_slips_of_units_get_one_line(tmp_path):
    radians = plates(tmp_path, angles=GRID, name="rad.csv")
    rows_ = np.loadtxt(radians, delimiter=",", skiprows=1)
    rows_[:, :2] *= RAD
    np.savetxt(
        radians, rows_, delimiter=",", header="beta,gamma,alpha_x,alpha_z", comments=""
    )
    refused = [(radians, "beta and gamma look like radians: give degrees")]
    refused.append(
        (plates(tmp_path, name="si.csv", scale=1e6), "N/cm^3 (1e-6 of those in N/m^3)")
    )
    depth, force = penetrated(np.random.default_rng(3))
    for name, scale, area in (
        ("mm.csv", 1e3, 9.5e-4),
        ("cm.csv", 1e2, 9.5e-4),
        ("area.csv", 1, 9.5),
    ):
        lines = (f"{scale * d:.8f},{f:.6g}" for d, f in zip(depth, force))
        file = written(tmp_path / name, f"# area = {area:g}", "depth,force", *lines)
        refused.append((file, "check the units, depth in m, force in N, area in m^2"))
    for file, said in refused:
        code, out, err = geomech("fit-medium", file)
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert said in err and file.name in err


def test_the_law_is_that_of_the_columns_or_the_one_asked_for(tmp_path):
    file = plates(tmp_path)
    assert stress_calibration.law_of(str(file)) == "stress-map"
    assert (
        stress_calibration.law_of(
            str(written(tmp_path / "p.csv", "depth_m,force_N", "1,2"))
        )
        == "zeta"
    )
    for head, law in (
        ("z,force_z", "zeta"), ("depth_inch;force", "zeta"), ("psi_deg,depth,force", "granular"), ("t,z", "granular"),
        ("gamma,beta_deg", "stress-map"), ("gamma,alpha_x", "stress-map"), ("area,force", "granular"),
    ):  # fmt: skip
        assert stress_calibration.law_of(str(written(tmp_path / "q.csv", head))) == law
    assert (
        stress_calibration.law_of("short-rod-drag")
        == stress_calibration.law_of("nowhere.csv")
        == "granular"
    )
    for law, said in (
        ("granular", "the header has no column psi_deg"), ("zeta", "the header has no column depth"),
        ("stres-map", "--law: 'stres-map' is unknown: did you mean 'stress-map'?"),
    ):  # fmt: skip
        code, _, err = geomech("fit-medium", file, "--law", law)
        assert code == 2 and said in err and err.count("\n") == 1
    for option in (("--area", "1e-3"), ("--radius", "0.01"), ("--end-caps", "fitted")):
        code, _, err = geomech("fit-medium", file, *option)
        assert (
            code == 2
            and f"{option[0]} belongs to another measurement: leave it out for --law stress-map"
            in err
        )
    for option in ("--radius", "--length", "--depth", "--density"):
        code, _, err = geomech(
            "fit-medium", tmp_path / "p.csv", "--area", "1e-3", option, "0.01"
        )
        assert (
            code == 2
            and f"{option} belongs to another measurement: leave it out for --law zeta"
            in err
        )
    code, _, err = geomech("fit-medium", "short-rod-drag", "--area", "1e-3")
    assert code == 2 and "--area belongs to another measurement" in err


def test_zeta_of_the_catalogue_is_within_what_is_taken_for_grains():
    low, high = calibrate.STRENGTHS
    for entry in VERTICAL.values():
        assert 20 * low <= entry.stress(0.0, np.pi / 2)[1] <= high / 20
