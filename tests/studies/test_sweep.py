"""Sweeps over a scene's parameters: right at every point, kept when interrupted, taken up again."""

import numpy as np
import pytest
import xarray
from commands import geomech
from tabled import swept_table

from geomech import scenes
from geomech.studies import grid
from geomech.studies.displacement import cycles, sweep
from geomech.studies.estimates import estimate
from geomech.studies.scene_tables import SceneTables
from rft import CATALOGUE, Granular
from rft.core.refusal import Refusal

pytestmark = pytest.mark.usefixtures("fastest")
GLASS = scenes.load("three-link-glass").with_numerics(phases=32)


def test_every_point_is_the_scene_there():
    results = swept_table(
        sweep.sweep(
            GLASS, {"gait.amplitude": [0.5, 1.0, 1.5], "body.length": [1.0, 2.0]}
        )
    )
    assert results["displacement"].shape == (3, 2, 3)
    alone = scenes.parse(
        GLASS.text.replace("lengths", "length = 2.0\nlengths")
    ).with_numerics(phases=32)
    poses, error = estimate.direct(
        alone, alone.gait, np.array([1.5]), alone.numerics.phases
    )
    np.testing.assert_allclose(results["displacement"][2, 1], poses[0], atol=1e-12)
    np.testing.assert_allclose(results["estimate"][2, 1], 2 * error[0, 0], rtol=1e-6)
    np.testing.assert_allclose(
        results["estimate_heading"][2, 1], error[0, 1], rtol=1e-6
    )
    np.testing.assert_allclose(
        results["displacement"][:, 1, 0],
        2 * results["displacement"][:, 0, 0],
        rtol=1e-9,
    )


def test_parameters_of_a_medium_given_by_name_can_be_swept():
    """As if its law stood in the scene; what is not swept stays that of the name."""
    named, over = (
        GLASS.text.partition("[medium]"),
        {"medium.gamma0_deg": [10.0, 20.0], "gait.amplitude": [1.0]},
    )
    text = (
        named[0]
        + '[medium]\nname = "glass-0.3mm-close"\n[body]'
        + named[2].partition("[body]")[2]
    )
    results = swept_table(
        sweep.sweep(scenes.parse(text).with_numerics(phases=32), over)
    )
    alone = GLASS.changed(
        medium=Granular(
            C=CATALOGUE["glass-0.3mm-close"].medium.C, gamma0=np.radians(20.0)
        )
    )
    np.testing.assert_allclose(
        results["displacement"][1, 0], SceneTables(alone).poses("direct"), rtol=1e-9
    )


def test_effects_and_whole_numbers_can_be_swept():
    fish = scenes.load("sandfish-loose")
    results = swept_table(
        sweep.sweep(
            fish, {"effects.end-caps.radius": [0.0, 0.1], "numerics.phases": [32, 64]}
        )
    )
    assert (results["displacement"][0, :, 0] > results["displacement"][1, :, 0]).all()


PAST = "\n[[effects]]\nkind = "
BATCHES = {
    "wave number": ("", {"gait.waves": [0.8, 1.0, 1.5], "gait.amplitude": [0.1, 0.2]}),
    "friction": (
        PAST + '"skin-friction"',
        {"effects.skin-friction.forward": [0.05, 0.1, 0.2]},
    ),
    "frequency": (
        PAST + '"body-inertia"\nmass = 0.02\nfrequency = 1.0\nlength = 0.1\ndrag = 1.0',
        {"effects.body-inertia.frequency": [0.0, 5.0], "gait.amplitude": [0.1, 0.2]},
    ),
    "frequency of grains": (
        PAST + '"grain-inertia"\nfrequency = 1.0\nlength = 0.1\ndepth = 0.05',
        {"effects.grain-inertia.frequency": [0.0, 2.0, 5.0]},
    ),
    "travel": (
        PAST + '"transient"\ntravel = 0.1',
        {"effects.transient.travel": [0.05, 0.1]},
    ),
    "ground": (
        PAST + '"disturbed-ground"\nradius = 0.05\nweakening = 0.0',
        {"effects.disturbed-ground.weakening": [0.05, 0.1]},
    ),
    "slope": (
        PAST + '"depth-profile"\nslope = 0.1',
        {"effects.depth-profile.slope": [0.05, 0.1]},
    ),
}


@pytest.mark.parametrize("name", BATCHES)
def test_sweeps_are_batches(name, monkeypatch):
    """Points that differ in gait and effects are one call of the engine, and each is what it is alone."""
    effect, over = BATCHES[name]
    text = (
        scenes.load("sandfish-loose")
        .text.partition("[[effects]]")[0]
        .replace("elements = 100", "elements = 16")
    )
    fish = scenes.parse(text + effect).with_numerics(phases=32, pieces=12)
    if name != "frequency":  # of which all settle
        fish = fish.with_numerics(cycles=1)
    calls, direct = [], estimate.direct
    monkeypatch.setattr(
        estimate, "direct", lambda *args: calls.append(args) or direct(*args)
    )
    at_once = swept_table(sweep.sweep(fish, over))
    assert len(calls) == 1
    last = tuple(len(values) - 1 for values in over.values())
    alone = swept_table(
        sweep.sweep(fish, {name: values[-1:] for name, values in over.items()})
    )
    assert (
        np.abs(
            at_once["displacement"][last] - at_once["displacement"][(0,) * len(over)]
        ).max()
        > 1e-4
    )
    # Side by side all settle before any stops; the rest is rounding.
    np.testing.assert_allclose(
        at_once["displacement"][last], alone["displacement"].ravel(), atol=2e-6
    )
    np.testing.assert_allclose(
        at_once["estimate"][last], alone["estimate"].ravel(), rtol=0.2, atol=2e-6
    )


@pytest.fixture
def without_estimates(monkeypatch):
    def direct(scene, gait, amplitudes, phases):
        net = scene.system.run(*gait.cycle(phases, amplitudes)).net
        return net, np.zeros((len(net), 2))

    monkeypatch.setattr(estimate, "direct", direct)


def test_a_level_ground_is_no_gentle_slope(without_estimates):
    """Without a slope cycles become periodic, with one there is one cycle: they do not share a batch."""
    text = (
        scenes.load("sandfish-loose")
        .text.partition("[[effects]]")[0]
        .replace("elements = 100", "elements = 16")
    )
    effects = (
        PAST + '"transient"\ntravel = 0.03' + PAST + '"depth-profile"\nslope = 0.0'
    )
    parse = lambda text: scenes.parse(text).with_numerics(phases=64, pieces=12)
    found = swept_table(
        sweep.sweep(parse(text + effects), {"effects.depth-profile.slope": [0.0, 0.05]})
    )
    level = SceneTables(parse(text + PAST + '"transient"\ntravel = 0.03')).poses(
        "direct"
    )
    np.testing.assert_allclose(found["displacement"][0], level, atol=2e-6)


def test_a_scene_changed_since_it_was_read_is_swept_as_it_is():
    fish = scenes.load("sandfish-loose").with_numerics(phases=32)
    plain = fish.changed(effects=())
    found = swept_table(
        sweep.sweep(plain, {"gait.amplitude": [0.1], "medium.C": [1.8, 3.0]})
    )["displacement"]
    assert SceneTables(plain).poses("direct", None, 0.1) == pytest.approx(
        found[0, 0], abs=1e-9
    )
    assert np.abs(found[0, 0] - SceneTables(fish).poses("direct", None, 0.1))[0] > 0.01
    with pytest.raises(Refusal, match="the scene has no effect 'end-caps'"):
        swept_table(sweep.sweep(plain, {"effects.end-caps.radius": [0.1]}))


def test_one_frequency_for_all_effects(without_estimates):
    both = scenes.load("sandfish-heavy").text.replace(
        "elements = 100", "elements = 12"
    ) + (PAST + '"grain-inertia"\nfrequency = 3.0\nlength = 0.1\ndepth = 0.05')
    swimmer = scenes.parse(both).with_numerics(phases=64)
    swept = swept_table(sweep.sweep(swimmer, {"effects.frequency": [0.0, 3.0, 9.0]}))
    found = swept["displacement"]
    assert swept["frequency"].tolist() == [0.0, 3.0, 9.0]
    np.testing.assert_allclose(
        found[1], SceneTables(swimmer).poses("direct"), atol=1e-9
    )
    assert np.abs(found[0] - found[2]).max() > 3e-3
    with pytest.raises(
        Refusal,
        match="body-inertia gives frequency = 3.0 and grain-inertia 2.0: it is one swimmer",
    ):
        swept_table(
            sweep.sweep(scenes.parse(both), {"effects.grain-inertia.frequency": [2.0]})
        )
    with pytest.raises(
        Refusal, match=r"\[body\] gives length = 0.2 and body-inertia 0.1"
    ):
        swept_table(sweep.sweep(scenes.parse(both), {"body.length": [0.2]}))
    with pytest.raises(Refusal, match="no effect of the scene gives 'speed'"):
        swept_table(sweep.sweep(scenes.parse(both), {"effects.speed": [2.0]}))


def test_what_cannot_share_a_batch_gets_its_own(monkeypatch):
    fish = scenes.load("sandfish-loose").with_numerics(phases=32)
    calls, direct = [], estimate.direct
    monkeypatch.setattr(
        estimate, "direct", lambda *args: calls.append(args) or direct(*args)
    )
    swept_table(
        sweep.sweep(
            fish, {"effects.end-caps.radius": [0.02, 0.06], "gait.waves": [0.9, 1.1]}
        )
    )
    assert len(calls) == 2


OVER = {"body.length": [1.0, 2.0, 3.0, 4.0], "gait.amplitude": [0.5, 1.0]}


@pytest.mark.parametrize("over", [OVER, {"gait.amplitude": [0.2, 0.4, 0.6, 0.8, 1.0]}])
def test_an_interrupted_sweep_resumes_from_the_file_it_is_given(
    over, tmp_path, monkeypatch
):
    """Which stays until its caller has saved the results; a sweep of one more point takes what it can."""
    partial, calls, rows = tmp_path / "p", [], cycles._rows

    def failing(at, amplitudes):
        calls.append((at[0].system.body.length, amplitudes))
        if len(calls) == 2:
            raise KeyboardInterrupt
        return rows(at, amplitudes)

    monkeypatch.setattr(cycles, "BATCH_SIZE", 2)
    whole = swept_table(sweep.sweep(GLASS, over))
    monkeypatch.setattr(cycles, "_rows", failing)
    with pytest.raises(KeyboardInterrupt) as ended:
        swept_table(sweep.sweep(GLASS, over, partial))
    assert ended.value.__notes__ == [
        f"1 results so far are kept in {partial}: the same command goes on from there"
    ]
    again = swept_table(sweep.sweep(GLASS, over, partial))
    assert calls[1] == calls[2] and len(calls) == len(set(map(str, calls))) + 1
    for key in ("displacement", "estimate", "estimate_heading"):
        np.testing.assert_array_equal(again[key], whole[key])
    count = len(calls)
    assert (
        swept_table(sweep.sweep(GLASS, over, partial))["estimate"].tolist()
        == again["estimate"].tolist()
        and partial.exists()
    )
    assert len(calls) == count
    more = {**over, "gait.amplitude": [*over["gait.amplitude"], 1.1]}
    swept_table(sweep.sweep(GLASS, more, partial))
    assert len(calls) > count
    with pytest.raises(Refusal, match="partial must be the path of a file"):
        swept_table(sweep.sweep(GLASS, over, ""))


def test_three_parameters_are_swept_but_not_drawn(tmp_path):
    args = [
        f"--over={key}"
        for key in ("gait.amplitude=0.5", "medium.ratio=2,4", "body.length=1")
    ]
    code, out, err = geomech(
        "sweep", "three-link-viscous", *args, "-o", "s.nc", cwd=tmp_path
    )
    assert (code, err) == (0, "") and "2 points" in out
    code, out, err = geomech(
        "sweep", "three-link-viscous", *args, "--plot", "s.png", cwd=tmp_path
    )
    assert (code, out) == (
        2,
        "",
    ) and "cannot draw 3 parameters: sweep one or two" in err


def test_the_command_writes_netcdf_and_a_plot(tmp_path):
    args = [
        "--over",
        "gait.amplitude=0.5:1.5:3",
        "--over",
        "medium.ratio=2,4",
        "-o",
        "s.nc",
        "--plot",
        "s.png",
    ]
    code, out, err = geomech("sweep", "three-link-viscous", *args, cwd=tmp_path)
    assert (code, err) == (0, "")
    assert "6 points" in out
    assert {p.name for p in tmp_path.iterdir()} == {"s.nc", "s.png"}
    with xarray.open_dataset(tmp_path / "s.nc") as data:
        assert data.x.dims == ("gait_amplitude", "medium_ratio")
        found = data.net_distance.sel(gait_amplitude=1.0, medium_ratio=2.0)
        assert float(found) == pytest.approx(0.0512808243, abs=1e-9)
        units = {name: data[name].attrs["units"] for name in data.data_vars}
    assert (units["x"], units["x_error"], units["heading_error"]) == ("BL", "BL", "rad")


@pytest.mark.parametrize(
    ("over", "said"),
    [
        ({"gait.size": [1.0]}, "'size' is unknown"),
        ({"gait": [1.0]}, "name a parameter such as"),
        ({"effects.end-caps.radius": [0.1]}, "no effect 'end-caps'"),
        ({"body.length": [1.0, -1.0]}, "length must be a number from"),
        ({}, "must span 1 to"),
    ],
)
def test_bad_sweeps_are_refused_before_computing(over, said):
    with pytest.raises(Refusal, match=said):
        swept_table(sweep.sweep(GLASS, over))


def test_rows_find_their_points_whatever_varies_fastest_or_changes_nothing():
    """The amplitude is the innermost, wherever it is given, and a frequency that changes no row is computed once."""
    over = {
        "gait.amplitude": [0.5, 1.0, 1.5],
        "gait.frequency": [1.0, 2.0],
        "body.length": [1.0, 2.0, 3.0, 4.0],
    }
    one = grid.Grid(None, over, {}, "gait.amplitude", ("gait.frequency",))
    assert (one.names, one.total) == (
        ["gait.frequency", "body.length", "gait.amplitude"],
        12,
    )
    points = [one.points[k] for k in range(one.points.total)]
    rows = one.arranged(
        np.array(
            [[10 * length, a, f] for f, length in points for a in one.inner_values]
        )
    )
    amplitude, frequency, length = np.meshgrid(*over.values(), indexing="ij")
    np.testing.assert_array_equal(
        rows, np.stack([10 * length, amplitude, 1.0 + 0 * frequency], -1)
    )
    assert np.array_equal(
        grid.values_at_points(over, ("gait", "physical", "frequency"), 7.0), frequency
    )
    assert np.array_equal(
        grid.values_at_points(over, ("physical", "frequency"), 7.0),
        np.full((3, 2, 4), 7.0),
    )
    assert grid.values_at_points(over, ("physical", "frequency"), None) is None


def test_corners_of_a_grid_are_tried_and_some_of_many_values_along_its_edges():
    over = {"medium.C": [3.0, 1.0, 2.0], "body.length": [*range(1, 402), 0.5]}
    corners = list(grid.Grid(None, over, {}).corners())
    assert corners[:4] == [(3.0, 1), (3.0, 0.5), (2.0, 1), (2.0, 0.5)]
    assert corners[4:7] == [(3.0, 1), (1.0, 1), (2.0, 1)]
    along = [x for c, x in corners[7:] if c == 3.0]
    assert (
        len(along) == len(corners) - 7 <= 202
        and {0.5, 401} <= {*along}
        and np.diff(sorted({*along})).max() <= 3
    )
    few = list(grid.Grid(None, {"body.length": [*range(1, 201)]}, {}).corners())
    assert few == [(1,), (200,), *((x,) for x in range(1, 201))]
