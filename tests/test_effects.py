"""Effects: what each one is, that it vanishes at its limit, that it costs nothing when off, what it takes away."""

import dataclasses
import itertools

import numpy as np
import pytest
from registry import EFFECTS

from geomech import scenes
from geomech.explain import explain
from geomech.gaits import Sine
from geomech.problem import SceneError
from rft import (
    CATALOGUE,
    Backbone,
    BodyInertia,
    DepthProfile,
    DisturbedGround,
    EndCaps,
    GrainInertia,
    SkinFriction,
    Transient,
    body_velocity,
    march,
)
from rft.effects import ENGINES, KINDS, PREMISES, engine

GLASS = CATALOGUE["glass-0.3mm-loose"].medium
SANDFISH = scenes.load("sandfish-loose")


def test_the_registry_has_every_effect():
    assert {name.partition(",")[0] for name in EFFECTS} == set(KINDS)


@pytest.mark.parametrize("name", EFFECTS)
def test_effects_say_what_they_are(name):
    effect = EFFECTS[name][0](0.01)
    assert effect.breaks <= set(PREMISES)
    assert effect.limit
    if "," not in name:  # the limit it declares, not one more
        assert EFFECTS[name][1] == effect.order
    assert effect.cost
    assert engine((effect,)) in ENGINES
    assert set(effect.batched) <= {f.name for f in dataclasses.fields(effect)}


@pytest.mark.parametrize("name", EFFECTS)
def test_effects_vanish_at_their_limit(name):
    """Body velocities through a cycle against those without the effect, in the mean: elements that reverse within the
    travel of a transient are few, but they feel all of it."""
    make, order = EFFECTS[name]
    fine = name == "transient"  # elements and steps must be short against the travel
    elements, phases = (80, 256) if fine else (20, 32)
    body, (alpha, alphadot) = Backbone(elements), Sine(elements=elements).cycle(phases)
    plain = body_velocity(GLASS, body, alpha, alphadot).xi
    cycles = 2 if name == "disturbed-ground" else None

    def off(x):
        return np.abs(march(GLASS, body, alpha, alphadot, effects=(make(x),), cycles=cycles).xi - plain).mean()

    sizes = np.array([0.04, 0.02, 0.01, 0.005][: 3 if fine else 4])
    assert np.polyfit(np.log(sizes), np.log([off(x) for x in sizes]), 1)[0] == pytest.approx(order, abs=0.1)
    assert off(0.0) < 1e-8


PARTS = ("load", "body", "start", "at", "after")


@pytest.mark.parametrize("name", EFFECTS)
def test_effects_that_are_off_are_not_evaluated(monkeypatch, name):
    """Every call into every effect is counted, with none on and with one on."""
    calls = []
    for kind in KINDS.values():
        for part in PARTS:
            original = getattr(kind, part)
            counted = lambda self, *a, f=original: calls.append(type(self)) or f(self, *a)
            monkeypatch.setattr(kind, part, counted)
    small = dataclasses.replace(SANDFISH, effects=(), body=Backbone(12), gait=Sine(elements=12))
    small.cycle(phases=16, work=True)
    assert calls == []
    effect = EFFECTS[name][0](0.01)
    dataclasses.replace(small, effects=(effect,)).with_numerics(cycles=1).cycle(phases=16)
    assert set(calls) == {type(effect)}


@pytest.mark.parametrize("name", EFFECTS)
def test_engines(name):
    """What needs no march gets none; a march agrees with the algebraic engine there."""
    effect = EFFECTS[name][0](0.01)
    needs = {"body-inertia": "dynamic", "transient": "marching", "disturbed-ground": "marching"}
    wanted = "marching" if name == "depth-profile, slope" else needs.get(name.partition(",")[0], "algebraic")
    assert engine((effect,)) == wanted
    assert engine((effect, BodyInertia(1, 1, 1, 1))) == "dynamic"
    body, (alpha, alphadot) = Backbone(12), Sine(elements=12).cycle(16)
    if wanted == "algebraic":
        marched = march(GLASS, body, alpha, alphadot, effects=(effect,), cycles=1, tolerance=1e-12).xi
        at_once = body_velocity(GLASS, body, alpha, alphadot, effects=(effect,), tolerance=1e-12).xi
        np.testing.assert_allclose(marched, at_once, atol=1e-9)
    else:
        with pytest.raises(ValueError, match=f"effects break {', '.join(sorted(effect.breaks))}: use rft.march"):
            body_velocity(GLASS, body, alpha, alphadot, effects=(effect,))


def test_the_order_in_the_scene_does_not_matter():
    effects = (
        SkinFriction(),
        EndCaps(radius=0.06),
        GrainInertia(frequency=3.0, length=0.3, depth=0.05),
        DepthProfile(along=(0.8, 1.0, 1.3), slope=0.1),
        Transient(travel=0.03),
        DisturbedGround(radius=0.05, weakening=0.2),
        BodyInertia(mass=0.1, frequency=1.0, length=0.3, drag=2.0),
    )
    body, (alpha, alphadot) = Backbone(10), Sine(elements=10).cycle(8)
    first = march(GLASS, body, alpha, alphadot, effects=effects, cycles=1).xi
    for order in itertools.islice(itertools.permutations(effects), 1, None, 997):
        np.testing.assert_allclose(march(GLASS, body, alpha, alphadot, effects=order, cycles=1).xi, first, atol=1e-8)


def test_explain_names_effects_engine_and_losses():
    told = explain(scenes.load("shovel-nosed-snake"))
    assert "on:  skin-friction" in told
    assert "on:  end-caps" in told
    assert "engine: algebraic" in told
    assert "not available: CCF maps" in told
    plain = explain(scenes.load("three-link-glass"))
    assert "off, not evaluated: " + ", ".join(KINDS) in plain
    assert "not available" not in plain


BAD = [
    ('kind = "end-cap"\nradius = 0.1', "'end-cap' is unknown; did you mean 'end-caps'"),
    ('kind = "end-caps"', "missing required field `radius`"),
    ('kind = "end-caps"\nradius = -1', "radius must be a number from 0 to 1"),
    ('kind = "skin-friction"\nforward = 0', "forward must be a number from 0.001"),
    ('kind = "depth-profile"\nalong = [1]', "along must be two depths or more"),
    ('kind = "depth-profile"\nalong = [1, -1]', "along must be two depths or more"),
    ('kind = "depth-profile"\nslope = -0.1', "slope must be a number from 0"),
    ('kind = "transient"\ntravel = -1', "travel must be a number from 0 to 10"),
    ('kind = "transient"\ntravel = nan', "travel must be a number from 0 to 10"),
    ('kind = "disturbed-ground"\nradius = 0.001\nweakening = 0.1', "radius must be a number from 0.01 to 0.25"),
    ('kind = "disturbed-ground"\nradius = 0.05\nweakening = 2', "weakening must be a number from 0 to 1"),
    ('kind = "body-inertia"\nmass = 1\nfrequency = 1\nlength = 1\ndrag = 0', "drag must be a number from"),
    ('kind = "body-inertia"\nmass = 1e9\nfrequency = 100\nlength = 1\ndrag = 1', "beyond 1e6 no gait settles"),
    ('kind = "end-caps"\nradius = 0.1\n[[effects]]\nkind = "end-caps"\nradius = 0.2', "asked for twice"),
]


@pytest.mark.parametrize(("effects", "said"), BAD)
def test_bad_effects_are_refused(effects, said):
    with pytest.raises(SceneError, match=said):
        scenes.parse(scenes.load("three-link-glass").text + "[[effects]]\n" + effects)


def test_grain_inertia_needs_grains():
    effect = '[[effects]]\nkind = "grain-inertia"\nfrequency = 1\nlength = 0.1\ndepth = 0.05'
    with pytest.raises(SceneError, match="grain inertia takes a medium of grains, got Viscous"):
        scenes.parse(scenes.load("three-link-viscous").text + effect)


def test_end_caps_need_grains():
    with pytest.raises(SceneError, match="end caps take a granular medium, got Viscous"):
        scenes.parse(scenes.load("three-link-viscous").text + '[[effects]]\nkind = "end-caps"\nradius = 0.1')


INERTIAL = (
    scenes.load("three-link-glass").text
    + '[[effects]]\nkind = "grain-inertia"\nfrequency = {f}\nlength = 0.3\ndepth = 0.05'
)


def test_with_grain_inertia_frequency_matters():
    slow, fast = (scenes.parse(INERTIAL.format(f=f)) for f in (0.01, 3.0))
    plain = scenes.load("three-link-glass").displacement("direct")
    np.testing.assert_allclose(slow.displacement("direct"), plain, atol=1e-4)
    assert np.abs(fast.displacement("direct") - plain).max() > 5e-3
    alpha, alphadot = fast.gait.cycle(16)
    twice = fast.velocity(alpha, 2 * alphadot) / 2
    assert np.abs(twice - fast.velocity(alpha, alphadot)).max() > 1e-3  # time is not the swimmer's own any more


@pytest.mark.parametrize("method", ["area", "path", "harmonic"])
def test_what_an_effect_breaks_is_refused_by_name(method):
    inertial = scenes.parse(INERTIAL.format(f=1.0))
    assert inertial.methods == ("direct",)
    with pytest.raises(SceneError, match="the effect grain-inertia, which breaks rate independence"):
        inertial.displacement(method)
    assert "breaks rate independence" in explain(inertial)
    assert "not available: connection, CCF" in explain(inertial)
    np.testing.assert_allclose(inertial.displacement("adapted"), inertial.displacement("direct"), atol=1e-3)


def test_transients_draw(tmp_path):
    from figures import transients
    from geomech import plots

    numbers = transients.compute(shares=(0.0, 0.2, 0.65), elements=40, phases=64)
    assert (np.diff(numbers["net"], axis=1) < 0).all()
    assert numbers["net"][1] == pytest.approx([1, 0.902, 0.70], abs=0.01)
    plots.save(transients.draw(numbers), tmp_path / "f.png")
    assert (tmp_path / "f.png").stat().st_size > 15_000


def test_the_cost_of_effects_draws(tmp_path):
    from figures import effects_cost
    from geomech import plots

    numbers = effects_cost.compute(phases=16, repeats=1)
    assert numbers["none"]["engine"] == numbers["these four"]["engine"] == "algebraic"
    assert numbers["transient"]["engine"] == "marching"
    assert numbers["body inertia"]["engine"] == "dynamic"
    assert numbers["transient"]["cycles"] > 1
    assert numbers["none"]["ratio"] == 1.0
    assert set(numbers) == set(effects_cost.SETS)
    plots.save(effects_cost.draw(numbers), tmp_path / "f.png")
    assert (tmp_path / "f.png").stat().st_size > 8_000


def test_a_body_that_comes_to_the_surface_is_refused():
    text = SANDFISH.text.partition("[[effects]]")[0] + '[[effects]]\nkind = "depth-profile"\nslope = 10.0\n'
    with pytest.raises(ValueError, match="comes to the surface: lower the slope"):
        scenes.parse(text).displacement("direct")


PAST = {
    "transient": "travel = 0.03",
    "disturbed-ground": "radius = 0.05\nweakening = 0.1",
    "depth-profile": "slope = 0.1",
    "body-inertia": "mass = 0.1\nfrequency = 1\nlength = 0.3\ndrag = 2",
}


@pytest.mark.parametrize("name", PAST)
def test_what_a_march_cannot_give_is_refused_by_name(name):
    swimmer = scenes.parse(f'{scenes.load("three-link-glass").text}\n[[effects]]\nkind = "{name}"\n{PAST[name]}\n')
    assert swimmer.tiers == swimmer.methods == ("direct",)
    for asked in (
        lambda: swimmer.displacement("area"),
        lambda: swimmer.displacement("path"),
        lambda: swimmer.displacement("harmonic"),
        lambda: swimmer.displacement("adapted"),
        lambda: swimmer.connection(),
        lambda: swimmer.velocity([0.1, 0.2], [1.0, 0.0]),
    ):
        with pytest.raises(SceneError, match=f"with the effect {name}, which breaks .*: .*, or drop the effect"):
            asked()
    told = explain(swimmer)
    assert f"engine: {swimmer.engine}" in told
    assert f"with {name} " in told
    assert (
        f"not available: connection, CCF, area, path and harmonic tiers, adapted tier, velocity at a single shape: {name}"
        in told
    )
