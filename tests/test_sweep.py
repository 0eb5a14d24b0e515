"""Sweeps over a scene's parameters: right at every point, kept when interrupted, taken up again."""

import json

import numpy as np
import pytest
import xarray
from test_cli import geomech

from geomech import estimate, scenes, sweep
from geomech.problem import SceneError

GLASS = scenes.load("three-link-glass").with_numerics(phases=32)


def test_every_point_is_the_scene_there():
    results = sweep.sweep(GLASS, {"gait.amplitude": [0.5, 1.0, 1.5], "body.length": [1.0, 2.0]})
    assert results["displacement"].shape == (3, 2, 3)
    alone = scenes.parse(GLASS.text.replace("length = 1.0 ", "length = 2.0 ")).with_numerics(phases=32)
    poses, error = estimate.direct(alone, alone.gait, np.array([1.5]), alone.numerics.phases)
    np.testing.assert_allclose(results["displacement"][2, 1], poses[0], atol=1e-12)
    np.testing.assert_allclose(results["estimate"][2, 1], error[0, 0], rtol=1e-6)
    np.testing.assert_allclose(results["estimate_heading"][2, 1], error[0, 1], rtol=1e-6)
    np.testing.assert_allclose(results["displacement"][:, 1, 0], 2 * results["displacement"][:, 0, 0], rtol=1e-9)


def test_effects_and_whole_numbers_can_be_swept():
    fish = scenes.load("sandfish-loose")
    results = sweep.sweep(fish, {"effects.end-caps.radius": [0.0, 0.1], "numerics.phases": [32, 64]})
    assert (results["displacement"][0, :, 0] > results["displacement"][1, :, 0]).all()


PAST = "\n[[effects]]\nkind = "
BATCHES = {
    "wave number": ("", {"gait.waves": [0.8, 1.0, 1.5], "gait.amplitude": [0.1, 0.2]}),
    "friction": (PAST + '"skin-friction"', {"effects.skin-friction.forward": [0.05, 0.1, 0.2]}),
    "frequency": (
        PAST + '"body-inertia"\nmass = 0.02\nfrequency = 1.0\nlength = 0.1\ndrag = 1.0',
        {"effects.body-inertia.frequency": [0.0, 5.0], "gait.amplitude": [0.1, 0.2]},
    ),
    "frequency of grains": (
        PAST + '"grain-inertia"\nfrequency = 1.0\nlength = 0.1\ndepth = 0.05',
        {"effects.grain-inertia.frequency": [0.0, 2.0, 5.0]},
    ),
    "travel": (PAST + '"transient"\ntravel = 0.1', {"effects.transient.travel": [0.0, 0.1]}),
    "ground": (
        PAST + '"disturbed-ground"\nradius = 0.05\nweakening = 0.0',
        {"effects.disturbed-ground.weakening": [0.0, 0.1]},
    ),
    "slope": (PAST + '"depth-profile"\nslope = 0.1', {"effects.depth-profile.slope": [0.05, 0.1]}),
}


@pytest.mark.parametrize("name", BATCHES)
def test_sweeps_are_batches(name, monkeypatch):
    """Points that differ in gait and effects are one call of the engine, and each is what it is alone."""
    effect, over = BATCHES[name]
    text = scenes.load("sandfish-loose").text.partition("[[effects]]")[0].replace("elements = 100", "elements = 16")
    fish = scenes.parse(text + effect).with_numerics(phases=64)
    calls, direct = [], estimate.direct
    monkeypatch.setattr(estimate, "direct", lambda *args: calls.append(args) or direct(*args))
    at_once = sweep.sweep(fish, over)
    assert len(calls) == 1
    monkeypatch.setattr(sweep, "SAMPLES_TOGETHER", 1)
    alone = sweep.sweep(fish, over)
    # Side by side all settle before any stops; the rest is rounding.
    atol = 2e-3 if name == "ground" else 2e-6
    np.testing.assert_allclose(at_once["displacement"], alone["displacement"], atol=atol)
    np.testing.assert_allclose(at_once["estimate"], alone["estimate"], rtol=0.2, atol=atol)


def test_a_level_ground_is_no_gentle_slope():
    """Without a slope a march settles, with one it is one cycle: they do not share a batch."""
    text = scenes.load("sandfish-loose").text.partition("[[effects]]")[0].replace("elements = 100", "elements = 16")
    effects = PAST + '"transient"\ntravel = 0.1' + PAST + '"depth-profile"\nslope = 0.0'
    parse = lambda text: scenes.parse(text).with_numerics(phases=64)
    found = sweep.sweep(parse(text + effects), {"effects.depth-profile.slope": [0.0, 0.05]})
    level = parse(text + PAST + '"transient"\ntravel = 0.1').displacement("direct")
    np.testing.assert_allclose(found["displacement"][0], level, atol=2e-6)


def test_a_scene_changed_since_it_was_read_is_refused():
    import dataclasses

    fish = dataclasses.replace(scenes.load("sandfish-loose"), effects=())
    with pytest.raises(SceneError, match="a sweep takes a scene as its TOML text has it"):
        sweep.sweep(fish, {"gait.amplitude": [0.1]})


def test_one_frequency_for_all_effects():
    both = scenes.load("sandfish-heavy").text.replace("elements = 100", "elements = 12") + (
        PAST + '"grain-inertia"\nfrequency = 3.0\nlength = 0.1\ndepth = 0.05'
    )
    swimmer = scenes.parse(both).with_numerics(phases=64)
    found = sweep.sweep(swimmer, {"effects.frequency": [0.0, 3.0, 9.0]})["displacement"]
    np.testing.assert_allclose(found[1], swimmer.displacement("direct"), atol=1e-9)
    assert np.abs(found[0] - found[2]).max() > 3e-3
    with pytest.raises(SceneError, match="BodyInertia gives frequency = 3.0 and GrainInertia 2.0: it is one swimmer"):
        sweep.sweep(scenes.parse(both), {"effects.grain-inertia.frequency": [2.0]})
    with pytest.raises(SceneError, match=r"\[body\] gives length = 0.2 and BodyInertia 0.1"):
        sweep.sweep(scenes.parse(both), {"body.length": [0.2]})
    with pytest.raises(SceneError, match="no effect of the scene gives 'speed'"):
        sweep.sweep(scenes.parse(both), {"effects.speed": [2.0]})


def test_what_cannot_share_a_batch_gets_its_own(monkeypatch):
    fish = scenes.load("sandfish-loose").with_numerics(phases=32)
    calls, direct = [], estimate.direct
    monkeypatch.setattr(estimate, "direct", lambda *args: calls.append(args) or direct(*args))
    sweep.sweep(fish, {"effects.end-caps.radius": [0.02, 0.06], "gait.waves": [0.9, 1.1]})
    assert len(calls) == 2


def test_an_interrupted_sweep_is_taken_up(tmp_path, monkeypatch):
    kept, over = tmp_path / ".s.partial", {"body.length": [1.0, 2.0, 3.0, 4.0], "gait.amplitude": [0.5, 1.0]}
    whole = sweep.sweep(GLASS, over)
    rows, calls = sweep._rows, []

    def failing(at, amplitudes):
        calls.append(at[0].body.length)
        if len(calls) == 3:
            raise KeyboardInterrupt
        return rows(at, amplitudes)

    monkeypatch.setattr(sweep, "_rows", failing)
    monkeypatch.setattr(sweep, "SAMPLES_TOGETHER", 2)  # both amplitudes of one length
    with pytest.raises(KeyboardInterrupt):
        sweep.sweep(GLASS, over, kept)
    assert np.shape(json.loads(kept.read_text())["rows"]) == (4, 5)  # two lengths, two amplitudes each
    again = sweep.sweep(GLASS, over, kept)
    assert calls == [1.0, 2.0, 3.0, 3.0, 4.0]
    np.testing.assert_array_equal(again["displacement"], whole["displacement"])
    assert not kept.exists()


def test_another_sweep_does_not_take_up_what_is_not_its_own(tmp_path):
    kept = tmp_path / ".s.partial"
    kept.write_text(json.dumps({"sweep": "of something else", "rows": [[[9.0, 9.0, 9.0, 9.0]]]}))
    results = sweep.sweep(GLASS, {"gait.amplitude": [1.0]}, kept)
    assert abs(results["displacement"][0, 0]) < 1


def test_the_command_writes_netcdf_and_a_plot(tmp_path):
    args = ["--over", "gait.amplitude=0.5:1.5:3", "--over", "medium.ratio=2,4", "-o", "s.nc", "--plot", "s.png"]
    code, out, err = geomech("sweep", "three-link-viscous", *args, cwd=tmp_path)
    assert (code, err) == (0, "")
    assert out.startswith("6 points")
    assert {p.name for p in tmp_path.iterdir()} == {"s.nc", "s.png"}
    with xarray.open_dataset(tmp_path / "s.nc") as data:
        assert data.displacement.dims == ("gait_amplitude", "medium_ratio", "component")
        found = data.displacement.sel(gait_amplitude=1.0, medium_ratio=2.0)
        assert float(np.hypot(*found[:2])) == pytest.approx(0.0512808243, abs=1e-9)
        units = {name: data[name].attrs["units"] for name in data.data_vars}
    assert units["displacement"] == "body length (x, y), rad (theta)"
    assert (units["estimate"], units["estimate_heading"]) == ("body length", "rad")


@pytest.mark.parametrize(
    ("over", "said"),
    [
        ({"gait.size": [1.0]}, "'size' is unknown"),
        ({"gait": [1.0]}, "name a parameter such as"),
        ({"effects.end-caps.radius": [0.1]}, "no effect 'end-caps'"),
        ({"body.length": [1.0, -1.0]}, "length must be finite"),
        ({}, "must span 1 to"),
    ],
)
def test_bad_sweeps_are_refused_before_computing(over, said):
    with pytest.raises(SceneError, match=said):
        sweep.sweep(GLASS, over)
