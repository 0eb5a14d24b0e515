"""The accuracy study: declared orders where theory gives them, and what it prints and draws."""

import numpy as np
import pytest
from artists import curve, drawn

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


@pytest.fixture(scope="module")
def glass():
    return work_precision.compute(
        runs=1
    )  # a first run times what it warms too: only errors are judged here


@pytest.fixture(scope="module")
def viscous():
    return geomech.accuracy("three-link-viscous", runs=1)


def line(result, label):
    """The values, errors and seconds of a setting."""
    one = result.at(setting=label)
    is_run = np.isfinite(one["value"].values)
    return {x: one[x].values[is_run] for x in ("value", "error", "seconds")}


def test_errors_are_root_mean_squares_over_amplitudes():
    """Of distances, in body lengths; a turn is none."""
    scene = scenes.parse(
        scenes.load("three-link-viscous").text.replace("[body]", "[body]\nlength = 2.0")
    )
    away = np.array([[0.06, 0.08, 0.0], [0.0, -0.2, 0.1], [0.0, 0.0, 0.3]])
    error = tiered.Settings(scene).errors([away + 0.5], [np.full((3, 3), 0.5)])["error"]
    assert error == pytest.approx(np.sqrt((0.05**2 + 0.1**2) / 3))


def test_every_setting_gets_better(glass):
    """Each setting's finest value beats its coarsest, but for those whose tier has an error of its own."""
    labels = glass["setting"].values.tolist()
    assert (
        len(labels) == len(tiered.SETTINGS) - 1
    )  # no effect cuts the body into pieces
    for name, factor in {
        "phases": 2,
        "segments": 2,
        "nodes": 2,
        "regularisation": 0.1,
    }.items():
        values = line(glass, f"direct: {name}")["value"]
        assert np.divide(values[1:], values[:-1]) == pytest.approx(factor)
    for label in labels:
        found = line(glass, label)
        if label not in ("path: grid", "area: grid"):
            assert found["error"][-1] < 0.5 * found["error"][0], label
        assert (found["seconds"] > 0).all()


def test_amplitudes_go_up_to_the_gaits_own(glass):
    largest = scenes.load("three-link-glass").gait.amplitude
    shares = np.array([0.4, 0.55, 0.7, 0.85, 1.0])
    np.testing.assert_allclose(glass["amplitude"].values, shares * largest)


def test_the_truth_has_exact_integrals_whatever_rule_the_scene_takes():
    ruled = scenes.load("three-link-glass").with_numerics(
        loads="midpoint:3", regularisation=1e-3
    )
    solver = tiered.Settings(ruled).scene_with(None, None).system.solver
    assert (solver.loads, solver.regularisation) == ("exact", 1e-9)


def test_tiers_rank_as_they_should(glass):
    """What each tier settles at: the direct one below the harmonic one below the path and the area."""
    is_true = glass["against"].values == "truth"
    least = np.nanmin(glass["error"].values, axis=1)[is_true]
    floor = dict(zip(glass["tier"].values[is_true].tolist(), least))
    assert floor["direct"] < 1e-6 < floor["harmonic"] < 2e-4 < floor["path"]
    assert floor["adapted"] < 2e-5
    assert floor["area"] > 5e-3


def test_orders_with_kinks(glass):
    """Direct tier on loose glass: about order 2 in phases, its kinks cut at random; order 1 in the regularisation."""
    assert float(glass.at(setting="direct: phases")["order"]) == pytest.approx(
        2.0, abs=0.5
    )
    assert float(glass.at(setting="direct: regularisation")["order"]) == pytest.approx(
        1.0, abs=0.2
    )


def test_midpoint_segments_are_of_order_two_where_nothing_kinks(viscous):
    assert float(viscous.at(setting="direct: segments")["order"]) == pytest.approx(
        2.0, abs=0.1
    )


@pytest.mark.parametrize(("degree", "order"), [(1, 2.0), (3, 4.0), (5, 6.0)])
def test_interpolation_is_of_order_degree_plus_one(degree, order):
    """A smooth field at shapes between its grid points."""
    swimmer = lambda a, d: body_velocity(Viscous(2.0), Chain(frame="link-2"), a, d).xi
    shapes = np.random.default_rng(0).uniform(-0.9, 0.9, (400, 2))
    exact = np.stack([swimmer(shapes, e) for e in np.eye(2)], -1)
    points = np.array([41, 61, 91, 137])
    errors = []
    for n in points:
        fitted = connection.fit(swimmer, connection.grid(2, n, 1.5), degree=degree)
        errors.append(np.sqrt(np.mean((fitted(shapes) - exact) ** 2)))
    assert -np.polyfit(np.log(points - 1), np.log(errors), 1)[0] == pytest.approx(
        order, abs=0.1
    )


def test_families_are_of_order_four_where_nothing_kinks():
    viscous = scenes.load("three-link-viscous")
    counts = np.array([8, 16, 32, 64])
    a = np.linspace(0.0, 1.5, 2001)[1:]
    exact = direct(viscous.system.velocity, Circle(), a)
    errors = []
    for n in counts:
        adapted = SceneTables(viscous.with_numerics(curves=int(n))).poses(
            "adapted", Circle(), a
        )
        errors.append(np.abs(adapted - exact).max())
    assert -np.polyfit(np.log(counts), np.log(errors), 1)[0] == pytest.approx(
        4.0, abs=0.1
    )


def test_phases_are_spectral_where_nothing_kinks():
    swimmer = lambda a, d: body_velocity(Viscous(2.0), Chain(), a, d).xi
    gait = Ellipse(centre=(0.4, 0.2), semi_axes=(1.0, 0.8))
    exact = direct(swimmer, gait, phases=256)
    errors = [
        np.abs(direct(swimmer, gait, phases=n) - exact).max() for n in (8, 16, 32, 64)
    ]
    assert errors[1] < errors[0] / 30
    assert errors[2] < errors[1] / 300
    assert errors[3] < 1e-15


def test_phases_are_of_order_two_across_kinks():
    """Averaged over gaits, since where a kink falls between two phases is chance."""
    glass = scenes.load("three-link-glass")
    radii, counts = np.linspace(0.4, 2.0, 25), np.array([32, 64, 128, 256, 512])
    exact = direct(glass.system.velocity, Circle(centre=(0.2, 0.1)), radii, 4096)
    off = [
        direct(glass.system.velocity, Circle(centre=(0.2, 0.1)), radii, n) - exact
        for n in counts
    ]
    errors = [np.exp(np.log(np.linalg.norm(x, axis=-1)).mean()) for x in off]
    assert -np.polyfit(np.log(counts), np.log(errors), 1)[0] == pytest.approx(
        2.0, abs=0.25
    )


def test_the_best_setting_is_the_quickest_that_is_good_enough():
    """Of runs made up here: not the most accurate, not the slowest, and none that is against the setting's own limit."""
    runs = {
        Setting("phases", (16, 32, 64), 2, tier="direct"): (
            (3e-2, 2e-3, 5e-5),
            (1.0, 2.0, 4.0),
        ),
        Setting("curves", (6, 12), 4, tier="adapted"): ((4e-3, 8e-4), (3.0, 2.5)),
        Setting("segments", (4,), 2, against="limit"): ((1e-9,), (0.1,)),
    }
    errors, seconds = (padded_array(rows) for rows in zip(*runs.values()))
    values = padded_array([setting.values for setting in runs])
    measured = Measurements([*runs], values, seconds, {"error": errors})
    best = {
        0.1: ("direct: phases", 16, 1.0),
        3e-2: ("direct: phases", 16, 1.0),
        1e-2: ("direct: phases", 32, 2.0),
        1e-3: ("adapted: curves", 12, 2.5),
        1e-4: ("direct: phases", 64, 4.0),
        1e-5: ("none", np.nan, np.nan),
    }
    tolerances = np.array([*best])

    def choose(tolerance):
        return tiered.quickest(measured, errors, tolerance)

    found = choice_variables(measured, errors, "BL", tolerances, choose)
    by_name = {v.name: v.values for v in found}
    names, values, seconds = zip(*best.values())
    assert tuple(by_name["best_setting"]) == names
    np.testing.assert_array_equal(by_name["best_value"], values)
    np.testing.assert_array_equal(by_name["best_seconds"], seconds)
    assert by_name["best_error"][3] == 8e-4


def test_a_linear_medium_has_no_dry_settings(viscous):
    labels = viscous["setting"].values.tolist()
    assert "direct: phases" in labels
    assert not any(
        "regularisation" in x or "harmonic" in x or "path" in x for x in labels
    )


def test_the_diagram_draws(glass, tmp_path):
    phases = line(glass, "direct: phases")
    drawn_lines = [
        x for ax in drawn(work_precision, glass, tmp_path).axes for x in ax.lines
    ]
    assert any(
        np.array_equal(x.get_xydata().T, [phases["seconds"], phases["error"]])
        for x in drawn_lines
    )


def test_costs_are_drawn_by_the_sample(tmp_path):
    """Batches in microseconds a sample, as the loop is; the others in seconds, under their exponent."""
    batches = {"NumPy, one core": [1e-4, 6.4e-4], "compiled, 2 cores": [2e-5, 6.4e-5]}
    numbers = {
        "samples": {"x": [1, 64], "seconds": batches, "loop": 5e-3, "exponent": 0.5},
        "links": {
            "x": [3, 6],
            "seconds": {"NumPy": [0.1, 0.3], "compiled": [0.01, 0.02]},
            "exponent": 1.1,
        },
    }
    samples, links, *_ = drawn(cost_scaling, numbers, tmp_path).axes
    np.testing.assert_allclose(curve(samples, "NumPy, one core"), [[1, 64], [100, 10]])
    np.testing.assert_allclose(curve(samples, "compiled, 2 cores"), [[1, 64], [20, 1]])
    assert samples.lines[-1].get_ydata()[0] == pytest.approx(5000)
    np.testing.assert_allclose(curve(links, "compiled"), [[3, 6], [0.01, 0.02]])
    assert links.get_title() == "exponent 1.10"


@pytest.mark.benchmark
def test_cost_is_linear_or_less(tmp_path):
    numbers = cost_scaling.compute()
    for axis, found in numbers.items():
        print(f"\n{axis}: exponent {found['exponent']:.2f}", end="")
        assert found["exponent"] < 1.15
    drawn(cost_scaling, numbers, tmp_path)
