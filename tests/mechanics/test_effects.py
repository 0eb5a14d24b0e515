"""Effects: what each one is, that it vanishes at its limit, that it commutes with
others, what it takes away."""

import functools

import numpy as np
import pytest
from artists import drawn
from registry import EFFECTS

from geomech import scenes
from geomech.mathematics.gaits import Ellipse
from geomech.mathematics.systems import Swimmer
from geomech.studies.scene_tables import SceneTables
from rft import (
    CATALOGUE,
    Chain,
    DepthProfile,
    GrainInertia,
    body_velocity,
    time_steps,
)
from rft.core.refusal import Refusal
from rft.effects import EFFECTS as KINDS
from rft.effects import engine
from rft.effects.contact import assemble
from rft.formulas.link import quadratic_load

pytestmark = pytest.mark.usefixtures("fastest")
GLASS = CATALOGUE["glass-0.3mm-loose"].medium
SANDFISH = scenes.load("sandfish-loose")
UNEVEN = Chain((1, 1.4, 0.8))
OFF_CENTRE = Ellipse(semi_axes=(1.0, 0.6), tilt=0.4, centre=(0.3, -0.2))
KINDS_BY_NAME = [name for name in EFFECTS if "," not in name]


def march(*effects, phases=8, amplitude=1.0, body=UNEVEN, cycles=1, **options):
    shapes = OFF_CENTRE.cycle(phases, amplitude)
    return time_steps(GLASS, body, *shapes, effects=effects, cycles=cycles, **options)


@pytest.mark.parametrize("name", EFFECTS)
def test_effects_are_the_same_on_a_body_of_any_size(name):
    """Lengths of an effect are of the body or its own: body lengths in, body lengths
    out."""
    effect = EFFECTS[name][0](0.3)
    options = {"cycles": 2, "phases": 12, "tolerance": 1e-13, "with_work": True}
    one, small = (
        march(effect.in_metres(length), body=body, **options)
        for length, body in ((None, UNEVEN), (0.3, Chain(UNEVEN.lengths, length=0.3)))
    )
    scale = np.array([0.3, 0.3, 1.0])
    np.testing.assert_allclose(small.xi, one.xi * scale, rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(small.work.power, 0.3 * one.work.power, rtol=1e-12)


@pytest.mark.parametrize("name", [name for name, kind in KINDS.items() if kind.metres])
def test_lengths_are_in_metres_on_a_body_with_a_length_and_in_body_lengths_without(
    name,
):
    effect = EFFECTS["depth-profile, slope" if "depth" in name else name][0](0.3)
    field = next(iter(KINDS[name].metres))
    in_metres = effect.in_metres(0.4)
    back = in_metres.in_body_lengths(0.4)
    assert getattr(back, field) == pytest.approx(getattr(effect, field))
    for call in (Swimmer, assemble):
        for length, wrong in ((0.4, effect), (None, in_metres)):
            with pytest.raises(Refusal, match=field):
                call(GLASS, Chain(length=length), (wrong,))


@pytest.mark.parametrize("name", EFFECTS)
def test_effects_vanish_at_their_limit(name):
    """At the declared order over six decades, in the mean, pivots inside links and
    links at rest included. Of a transient, which feels all of what reverses and links
    that come to rest as they do, the order is that of its docstring."""
    make, order = EFFECTS[name]
    steps = {"phases": 32 if name == "transient" else 16, "cycles": 2, "pieces": 12}
    sizes = [1e-2, 1e-3, 1e-4, 1e-6]
    sizes = np.array(sizes if order == 1 else sizes[:2])  # below is the solver
    plain = body_velocity(GLASS, UNEVEN, *OFF_CENTRE.cycle(steps["phases"])).xi
    *errors, none = (
        np.abs(march(make(x), **steps).xi - plain).mean() for x in [*sizes, 0.0]
    )
    slopes = np.diff(np.log(errors)) / np.diff(np.log(sizes))
    low, high = (0.45, 1.1) if name == "transient" else (order - 0.1, order + 0.1)
    assert (slopes > low).all()
    assert (slopes < high).all()
    assert none < 1e-8


STEPS = {
    "body-inertia": "dynamic",
    "body-inertia, frequency": "dynamic",
    "transient": "time stepping",
    "disturbed-ground": "time stepping",
    "depth-profile, slope": "time stepping",
    "slope": "time stepping",
    "springs": "time stepping",
}


@pytest.mark.parametrize("name", EFFECTS)
def test_what_shape_settles_needs_no_time_stepping(name):
    effect = EFFECTS[name][0](0.01)
    assert engine((effect,)) == STEPS.get(name, "algebraic")
    problem = GLASS, UNEVEN, *OFF_CENTRE.cycle(8)
    if name in STEPS:
        with pytest.raises(ValueError, match="use rft.time_steps"):
            body_velocity(*problem, effects=(effect,))
    else:
        marched = march(effect, tolerance=1e-12).xi
        at_once = body_velocity(*problem, effects=(effect,), tolerance=1e-12).xi
        np.testing.assert_allclose(marched, at_once, atol=1e-9)


ONE_OF_EACH = {name: EFFECTS[name][0](0.3) for name in KINDS_BY_NAME}
ONE_OF_EACH["depth-profile"] = DepthProfile(along=(0.8, 1.0, 1.3), slope=0.1)
LINK_1 = Chain(UNEVEN.lengths, frame="link-1")


@functools.cache
def few_phases(*effects):
    options = {"regularisation": 1e-3, "tolerance": 1e-12, "pieces": 10}
    return march(*effects, body=LINK_1, **options).xi


@pytest.mark.parametrize("name", ONE_OF_EACH)
def test_any_two_effects_commute(name):
    one = ONE_OF_EACH[name]
    for other in (effect for effect in ONE_OF_EACH.values() if effect != one):
        both = few_phases(one, other)
        reverse = few_phases(other, one)
        np.testing.assert_allclose(reverse, both, rtol=0, atol=1e-13, err_msg=other)
        assert np.abs(both - few_phases(one)).max() > 1e-4, other


@pytest.mark.parametrize("name", ONE_OF_EACH)
def test_every_sample_of_a_batch_has_its_own_parameters(name):
    effect = ONE_OF_EACH[name]
    options = {"regularisation": 1e-3, "tolerance": 1e-13, "pieces": 10}
    parts, amplitudes = np.array([1.0, 0.6, 0.8]), np.array([0.7, 1.0, 1.2])

    def scaled(by):
        values = {k: getattr(effect, k) for k in effect.batched}
        given = {k: x * by for k, x in values.items() if x is not None}
        return effect.with_parameters(**given)

    found = march(scaled(parts), amplitude=amplitudes, **options).xi
    alone = [
        march(scaled(part), amplitude=amplitude, **options).xi
        for part, amplitude in zip(parts, amplitudes)
    ]
    np.testing.assert_allclose(found, alone, atol=1e-9)


LOOSE = scenes.load("three-link-glass").text
GRAINS = 'kind = "grain-inertia"\nfrequency = {f}\nlength = 0.3\ndepth = 0.05\n'


def test_a_body_that_comes_to_the_surface_is_refused():
    steep = SANDFISH.changed(effects=(DepthProfile(slope=10.0),))
    with pytest.raises(ValueError, match="reaches the surface: lower the slope"):
        SceneTables(steep).poses("direct")


@pytest.mark.parametrize(
    ("packing", "k"),
    [
        ("loose", 2.5),
        ("close", 5900 / (0.62 * 2500 * 9.81 * 0.0762)),
        ("surface", 2.5),
    ],
)
def test_grain_inertia_takes_the_grains_own_pressure(packing, k):
    """The quadratic drag is lambda rho v_n^2 over k rho g |z|: with k = 2.5 in loose
    glass, 5.1 in close, one's own where one is given, and 2.5 where nobody says."""
    medium = CATALOGUE[f"glass-0.3mm-{packing}"].medium
    given = {"frequency": 2.0, "length": 0.3, "depth": 0.05, "strength": 1.5}
    speed = 0.7 * 0.3 * 2 * np.pi * 2.0  # m/s, of 0.7 body lengths per rad
    for effect, own in ((GrainInertia(**given), k), (GrainInertia(**given, k=4.0), 4)):
        assembly = assemble(medium, Chain(), [effect])
        problem = assembly.problem(np.zeros((2, 1)), np.ones((2, 1)))
        load = quadratic_load(0.7, 0.0, problem.quadratic_drag)
        expected = 1.5 * speed**2 / (9.81 * 0.05) / own
        assert float(np.squeeze(load.n)) == pytest.approx(expected, rel=1e-12)


def test_with_grain_inertia_only_tiers_at_the_gaits_own_speed_are_left():
    scene = scenes.parse(f"{LOOSE}[[effects]]\n{GRAINS.format(f=1.0)}")
    tables = SceneTables(scene)
    direct = tables.poses("direct")
    np.testing.assert_allclose(tables.poses("adapted"), direct, atol=1e-3)
    with pytest.raises(Refusal, match="effect grain-inertia, which is not rate-indep"):
        tables.poses("path")


@pytest.mark.parametrize("name", [name for name in STEPS if name != "springs"])
def test_only_the_direct_tier_steps_in_time(name):
    scene = scenes.load("three-link-glass").changed(effects=(EFFECTS[name][0](0.1),))
    assert SceneTables(scene).tiers == ("direct",)


def test_transients_slow_the_sandfish(tmp_path):
    """A travel of a fifth of the wave's amplitude costs 9 % of the speed, of 0.65 about
    27 %: resistive force theory exceeds discrete elements by 30 % (paper Sec. IV A)."""
    from figures.swimmers import transients

    numbers = transients.compute(shares=(0.0, 0.2, 0.65, 2.1), elements=20, phases=32)
    assert numbers["net"][1] == pytest.approx([1, 0.91, 0.73, 0.50], abs=0.01)
    drawn(transients, numbers, tmp_path)
