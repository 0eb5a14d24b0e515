"""The accuracy study: declared orders where theory gives them, and what it chooses and
draws."""

import numpy as np
import pytest
from artists import drawn

import geomech
from figures.accuracy import cost_scaling, work_precision
from geomech import scenes
from geomech.core.setting import Setting
from geomech.mathematics.gaits import Circle, Ellipse
from geomech.mathematics.geometry import connection
from geomech.mathematics.tiers.direct import direct
from geomech.studies.displacement import tiered
from geomech.studies.scene_tables import SceneTables
from geomech.studies.settings import Measurements, choice_variables, padded_array
from rft import Chain, Viscous, body_velocity

pytestmark = pytest.mark.usefixtures("fastest")
FLUID = scenes.load("three-link-viscous")
SAND = scenes.load("three-link-glass")


@pytest.fixture(scope="module")
def glass():
    return work_precision.compute(runs=1)  # only errors are judged here


@pytest.fixture(scope="module")
def viscous():
    return geomech.accuracy(FLUID, runs=1)


def line(result, label):
    """Return the values, errors and seconds of a setting."""
    one = result.at(setting=label)
    is_run = np.isfinite(one["value"].values)
    return {name: one[name].values[is_run] for name in ("value", "error", "seconds")}


def order(counts, errors):
    return -np.polyfit(np.log(counts), np.log(errors), 1)[0]


def fluid_velocity(alpha, alphadot, frame="mean"):
    return body_velocity(Viscous(2.0), Chain(frame=frame), alpha, alphadot).xi


def test_errors_are_root_mean_squares_over_amplitudes():
    """Of distances, in body lengths; a turn is none."""
    settings = tiered.Settings(FLUID.changed(body=Chain(length=2.0)))
    away = np.array([[0.06, 0.08, 0.0], [0.0, -0.2, 0.1], [0.0, 0.0, 0.3]])
    error = settings.errors([away + 0.5], [np.full((3, 3), 0.5)])["error"]
    assert error == pytest.approx(np.sqrt((0.05**2 + 0.1**2) / 3))


def test_every_setting_gets_better(glass):
    """But for those whose tier has an error of its own."""
    labels = glass["setting"].values.tolist()
    assert len(labels) == len(tiered.SETTINGS) - 1  # no body is cut into pieces
    for label in labels:
        found = line(glass, label)
        assert (found["seconds"] > 0).all()
        if label not in ("path: grid", "area: grid"):
            assert found["error"][-1] < 0.5 * found["error"][0], label


def test_tiers_rank_as_they_should(glass):
    """By what each settles at."""
    is_true = glass["against"].values == "truth"
    least = np.nanmin(glass["error"].values, axis=1)[is_true]
    floor = dict(zip(glass["tier"].values[is_true].tolist(), least))
    assert floor["direct"] < 1e-6 < floor["harmonic"] < 2e-4 < floor["path"]
    assert floor["adapted"] < 2e-5
    assert floor["area"] > 5e-3


@pytest.mark.parametrize(
    ("study", "setting", "expected", "tolerance"),
    [
        ("glass", "direct: phases", 2.0, 0.5),  # its kinks are cut at random
        ("glass", "direct: regularisation", 1.0, 0.2),
        ("viscous", "direct: segments", 2.0, 0.1),
    ],
)
def test_measured_orders_are_those_of_theory(
    study, setting, expected, tolerance, request
):
    found = request.getfixturevalue(study).at(setting=setting)["order"]
    assert float(found) == pytest.approx(expected, abs=tolerance)


@pytest.mark.parametrize(("degree", "expected"), [(1, 2.0), (3, 4.0), (5, 6.0)])
def test_interpolation_is_of_order_degree_plus_one(degree, expected):
    """In a smooth field, at shapes between its grid points."""

    def velocity(alpha, alphadot):
        return fluid_velocity(alpha, alphadot, "link-2")

    shapes = np.random.default_rng(0).uniform(-0.9, 0.9, (400, 2))
    exact = np.stack([velocity(shapes, unit) for unit in np.eye(2)], -1)
    points = np.array([41, 61, 91, 137])
    errors = []
    for n in points:
        fitted = connection.fit(velocity, connection.grid(2, n, 1.5), degree=degree)
        errors.append(np.sqrt(np.mean((fitted(shapes) - exact) ** 2)))
    assert order(points - 1, errors) == pytest.approx(expected, abs=0.1)


def test_families_are_of_order_four_where_nothing_kinks():
    amplitudes = np.linspace(0.0, 1.5, 2001)[1:]
    exact = direct(FLUID.system.velocity, Circle(), amplitudes)
    counts = [8, 16, 32, 64]
    errors = []
    for n in counts:
        tables = SceneTables(FLUID.with_numerics(curves=n))
        found = tables.poses("adapted", Circle(), amplitudes)
        errors.append(np.abs(found - exact).max())
    assert order(counts, errors) == pytest.approx(4.0, abs=0.1)


def test_phases_are_spectral_where_nothing_kinks():
    gait = Ellipse(centre=(0.4, 0.2), semi_axes=(1.0, 0.8))
    exact = direct(fluid_velocity, gait, phases=256)
    coarse, medium, fine, finest = (
        np.abs(direct(fluid_velocity, gait, phases=n) - exact).max()
        for n in (8, 16, 32, 64)
    )
    assert medium < coarse / 30
    assert fine < medium / 300
    assert finest < 1e-15


def test_phases_are_of_order_two_across_kinks():
    """Averaged over gaits, since where a kink falls between two phases is chance."""
    radii = np.linspace(0.4, 2.0, 25)
    counts = [32, 64, 128, 256, 512]
    poses = [
        direct(SAND.system.velocity, Circle(centre=(0.2, 0.1)), radii, n)
        for n in (*counts, 4096)
    ]
    off = np.linalg.norm(np.array(poses[:-1]) - poses[-1], axis=-1)
    assert order(counts, np.exp(np.log(off).mean(-1))) == pytest.approx(2.0, abs=0.25)


RUNS = {
    Setting("phases", (16, 32, 64), 2, tier="direct"): (
        (3e-2, 2e-3, 5e-5),
        (1.0, 2.0, 4.0),
    ),
    Setting("curves", (6, 12), 4, tier="adapted"): ((4e-3, 8e-4), (3.0, 2.5)),
    Setting("segments", (4,), 2, against="limit"): ((1e-9,), (0.1,)),
}


@pytest.mark.parametrize(
    ("tolerance", "setting", "value", "seconds"),
    [
        (0.1, "direct: phases", 16, 1.0),
        (3e-2, "direct: phases", 16, 1.0),
        (1e-2, "direct: phases", 32, 2.0),
        (1e-3, "adapted: curves", 12, 2.5),
        (1e-4, "direct: phases", 64, 4.0),
        (1e-5, "none", np.nan, np.nan),
    ],
)
def test_the_best_setting_is_the_quickest_that_is_good_enough(
    tolerance, setting, value, seconds
):
    """And none that is compared with its own limit."""
    errors, times = (padded_array(rows) for rows in zip(*RUNS.values()))
    values = padded_array([setting.values for setting in RUNS])
    measured = Measurements([*RUNS], values, times, {"error": errors})

    def choose(tolerance):
        return tiered.quickest(measured, errors, tolerance)

    best = choice_variables(measured, errors, "BL", np.array([tolerance]), choose)
    found = {v.name: v.values[0] for v in best}
    assert found["best_setting"] == setting
    expected = [value, seconds]
    np.testing.assert_array_equal(
        [found["best_value"], found["best_seconds"]], expected
    )
    assert not found["best_error"] > tolerance


@pytest.mark.benchmark
def test_cost_is_linear_or_less(tmp_path):
    numbers = cost_scaling.compute()
    for axis, found in numbers.items():
        print(f"\n{axis}: exponent {found['exponent']:.2f}", end="")
        assert found["exponent"] < 1.15
    drawn(cost_scaling, numbers, tmp_path)
