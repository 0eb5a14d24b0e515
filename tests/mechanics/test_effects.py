"""Effects: what each one is, that it vanishes at its limit, that it costs nothing when off, what it takes away."""

import dataclasses
import functools
import itertools
import re

import numpy as np
import pytest
from artists import curve, drawn
from registry import EFFECTS

from geomech import scenes
from geomech.core.errors import UnitWarning
from geomech.mathematics.gaits import Circle, Ellipse, Sine
from geomech.mathematics.systems import Swimmer
from geomech.shell.describe.scene import description
from geomech.studies.available import default_tiers
from geomech.studies.scene_tables import SceneTables
from rft import (
    CATALOGUE,
    Backbone,
    BodyInertia,
    Chain,
    DepthProfile,
    GrainInertia,
    Transient,
    body_velocity,
    time_steps,
)
from rft.core.premise import ALL, negation
from rft.core.refusal import Refusal
from rft.effects import EFFECTS as KINDS
from rft.effects import batched_effect, engine
from rft.effects.contact import assemble
from rft.formulas.link import quadratic_load

pytestmark = pytest.mark.usefixtures("fastest")
GLASS = CATALOGUE["glass-0.3mm-loose"].medium
SANDFISH = scenes.load("sandfish-loose")


def test_the_registry_has_every_effect():
    assert {name.partition(",")[0] for name in EFFECTS} == set(KINDS)


def at_its_limit(effect):
    """The effect with no more changed than the limit it declares asks for: "x = 0", "x = y = z" or "x all 1", joined by
    "and"."""
    for clause in effect.limit.split(" and "):
        name, every, value = clause.partition(" all ")
        if every:
            effect = dataclasses.replace(
                effect, **{name: tuple(float(value) for _ in getattr(effect, name))}
            )
        else:
            *names, goal = clause.split(" = ")
            value = getattr(effect, goal) if hasattr(effect, goal) else float(goal)
            effect = dataclasses.replace(effect, **dict.fromkeys(names, value))
    return effect


@pytest.mark.parametrize("name", EFFECTS)
def test_effects_say_what_they_are(name):
    make, order = EFFECTS[name]
    effect, kind = make(0.3), KINDS[name.partition(",")[0]]
    assert isinstance(effect, kind)
    assert effect.breaks in ALL
    if "," not in name:  # the limit it declares, not one more
        assert order == effect.order
    alpha, alphadot = Circle(centre=(0.3, -0.2)).cycle(8)
    run = lambda *effects: (
        time_steps(
            GLASS, Chain((1, 1.4, 0.8)), alpha, alphadot, effects=effects, cycles=2
        ).xi
    )
    # Of a balance the body cut in pieces has its own rounding.
    np.testing.assert_allclose(run(at_its_limit(effect)), run(), atol=1e-7)
    assert np.abs(run(effect) - run()).max() > 1e-3
    told = description(SANDFISH.changed(effects=(effect,)))
    assert (
        f"; costs {effect.cost}; gone at {effect.limit}, order {effect.order}" in told
    )
    assert f"; {negation(effect.breaks) or 'keeps every premise'};" in told
    assert len(effect.cost) > 10


@pytest.mark.parametrize("name", [name for name in EFFECTS if "," not in name])
def test_parameters_that_may_differ_within_a_batch(name):
    """Those an effect names, each side by side, and no other."""
    effect = EFFECTS[name][0](0.01)
    for field in dataclasses.fields(effect):
        value = getattr(effect, field.name)
        if value is None:  # left to the medium
            continue
        changed = (
            (*value[:-1], 2 * value[-1])
            if isinstance(value, tuple)
            else value * 1.5 + 0.001
        )
        other = dataclasses.replace(effect, **{field.name: changed})
        if field.name in effect.batched:
            joined = batched_effect([effect, other], [2, 1])
            assert getattr(joined, field.name).tolist() == [value, value, changed]
            assert all(
                getattr(joined, f.name) == getattr(effect, f.name)
                for f in dataclasses.fields(effect)
                if f != field
            )
        else:
            with pytest.raises(
                ValueError,
                match=f"{effect.kind}: {field.name} cannot differ within a batch",
            ):
                batched_effect([effect, other], [2, 1])


@pytest.mark.parametrize("name", EFFECTS)
def test_effects_are_the_same_on_a_body_of_any_size(name):
    """Lengths of an effect are of the body or its own: body lengths in, body lengths out."""
    effect = EFFECTS[name][0](0.3)
    alpha, alphadot = Ellipse(semi_axes=(1.1, 0.7), tilt=0.4, centre=(0.3, -0.2)).cycle(
        12
    )
    one, small = (
        time_steps(
            GLASS, Chain((1, 1.4, 0.8), length=length, frame="link-1"), alpha, alphadot, cycles=2,
            effects=(effect.in_metres(length),), tolerance=1e-13, with_work=True,
        )
        for length in (None, 0.3)
    )  # fmt: skip
    np.testing.assert_allclose(
        small.xi, one.xi * [0.3, 0.3, 1.0], rtol=1e-12, atol=1e-14
    )
    np.testing.assert_allclose(
        small.pose, one.pose * [0.3, 0.3, 1.0], rtol=1e-12, atol=1e-14
    )
    np.testing.assert_allclose(small.work.power, 0.3 * one.work.power, rtol=1e-12)
    np.testing.assert_allclose(
        small.work.bending_moment, one.work.bending_moment, rtol=1e-12, atol=1e-14
    )
    np.testing.assert_allclose(small.drift, one.drift, rtol=1e-9)


@pytest.mark.parametrize("name", [name for name, kind in KINDS.items() if kind.metres])
def test_lengths_are_in_metres_on_a_body_with_a_length_and_in_body_lengths_without(
    name,
):
    """Neither is taken for the other in silence: a scene, Python, and the solver."""
    effect = EFFECTS["depth-profile, slope" if "depth" in name else name][0](0.3)
    field = next(iter(KINDS[name].metres))
    in_metres = effect.in_metres(0.4)
    back = in_metres.in_body_lengths(0.4)
    assert getattr(back, field) == pytest.approx(getattr(effect, field))
    medium, bare, sized = GLASS, Chain(), Chain(length=0.4)
    for body, wrong in ((sized, effect), (bare, in_metres)):
        for call in (Swimmer, assemble):
            with pytest.raises(Refusal, match=field) as caught:
                call(medium, body, (wrong,))
            assert caught.value.instead
    for body, right in ((bare, effect), (sized, in_metres)):
        Swimmer(medium, body, (right,))
    both = {field: getattr(effect, field), KINDS[name].metres[field].name: 0.1}
    with pytest.raises(Refusal, match="twice"):
        dataclasses.replace(effect, **both)


def test_the_radius_of_a_robot_is_in_metres():
    """16 mm on links of 117 mm; as a radius in body lengths it would be 5.6 mm."""
    text = """[medium]
name = "glass-0.3mm-loose"
[body]
kind = "chain"
length = 0.35
[gait]
kind = "circle"
[[effects]]
kind = "end-caps"
"""
    robot = scenes.parse(text + "radius_m = 0.016")
    bare = text.replace("length = 0.35", "") + f"radius = {0.016 / 0.35!r}"
    np.testing.assert_allclose(
        robot.cycle(phases=64).net[:2],
        0.35 * scenes.parse(bare).cycle(phases=64).net[:2],
    )
    assert "radius 16 mm" in description(robot)
    for radius in (0.13, 0.002):  # longer than a link, and below a fiftieth of it
        with pytest.warns(UnitWarning, match=f"{1e3 * radius:g} mm"):
            scenes.parse(text + f"radius_m = {radius}")


ONE_BY_ONE = (
    "end-caps",
    "depth-profile",
)  # what is varied here cannot differ within a batch


def each(f, effects):
    """f(effect, count) (count,) of all effects of a kind: side by side, as one of so many samples, or one by one."""
    if effects[0].kind in ONE_BY_ONE:
        return np.concatenate([f(effect, 1) for effect in effects])
    return f(batched_effect(effects, [1] * len(effects)), len(effects))


@pytest.mark.parametrize("name", EFFECTS)
def test_effects_vanish_at_their_limit(name):
    """Body velocities through a cycle against those without the effect, in the mean: elements that reverse within the
    travel of a transient are few, but they feel all of it."""
    make, order = EFFECTS[name]
    fine = name == "transient"  # elements and steps must be short against the travel
    elements, phases = (60, 128) if fine else (20, 32)
    sizes = np.array(
        [0.04, 0.02, 0.01, 0.0] if fine else [0.04, 0.02, 0.01, 0.005, 0.0]
    )
    body, (alpha, alphadot) = Backbone(elements), Sine(elements=elements).cycle(phases)
    plain = body_velocity(GLASS, body, alpha, alphadot).xi
    cycles = 2 if name == "disturbed-ground" or fine else None

    def off(effect, count):
        many = (np.broadcast_to(x, (count, *x.shape)) for x in (alpha, alphadot))
        return np.abs(
            time_steps(GLASS, body, *many, effects=(effect,), cycles=cycles).xi - plain
        ).mean((1, 2))

    effects = [make(x) for x in sizes]
    errors = each(off, effects)
    assert np.polyfit(np.log(sizes[:-1]), np.log(errors[:-1]), 1)[0] == pytest.approx(
        order, abs=0.1
    )
    assert errors[-1] < 1e-8


UNEVEN, OFF_CENTRE = (
    Chain((1, 1.4, 0.8)),
    Ellipse(semi_axes=(1.0, 0.6), tilt=0.4, centre=(0.3, -0.2)),
)


@pytest.mark.parametrize("name", EFFECTS)
def test_effects_vanish_on_chains_too(name):
    """At the declared order over six decades, pivots inside links and links at rest included. Of a transient, which
    feels all of what reverses and links that come to rest as they do, the order is that of its docstring."""
    make, order = EFFECTS[name]
    alpha, alphadot = OFF_CENTRE.cycle(32 if name == "transient" else 16)
    plain = body_velocity(GLASS, UNEVEN, alpha, alphadot).xi

    def off(effect, count):
        many = (np.broadcast_to(x, (count, *x.shape)) for x in (alpha, alphadot))
        found = time_steps(GLASS, UNEVEN, *many, effects=(effect,), cycles=2, pieces=12)
        return np.abs(found.xi - plain).mean((1, 2))

    sizes = np.array([1e-2, 1e-3, 1e-4, 1e-6])[
        : 4 if order == 1 else 2
    ]  # below is the solver
    *errors, none = each(off, [make(x) for x in [*sizes, 0.0]])
    slopes = np.diff(np.log(errors)) / np.diff(np.log(sizes))
    if name == "transient":
        assert (slopes > 0.45).all()
        assert (slopes < 1.1).all()
    else:
        np.testing.assert_allclose(slopes, order, atol=0.1)
    assert none < 1e-8


@pytest.mark.parametrize("pieces", [1, 40])
def test_no_travel_is_no_transient_however_long_the_pieces(pieces):
    alpha, alphadot = Circle(amplitude=1.2).cycle(64)
    none, hardly = (
        time_steps(
            GLASS,
            Chain(),
            alpha,
            alphadot,
            effects=(Transient(travel=t),),
            cycles=2,
            pieces=pieces,
        ).displacement
        for t in (0.0, 1e-6)
    )
    np.testing.assert_allclose(hardly, none, atol=1e-5)


PARTS = ("apply", "begin", "at", "after", "kicked", "__call__")


@pytest.mark.parametrize("name", EFFECTS)
def test_effects_that_are_off_are_not_evaluated(monkeypatch, name):
    """Every call into every effect is counted, with none on and with one on."""
    calls = []
    for kind in KINDS.values():
        for part in filter(lambda part: hasattr(kind, part), PARTS):
            original = getattr(kind, part)
            counted = lambda self, *a, f=original: (
                calls.append(type(self)) or f(self, *a)
            )
            monkeypatch.setattr(kind, part, counted)
    small = SANDFISH.changed(effects=(), body=Backbone(12), gait=Sine(elements=12))
    small.cycle(phases=16, work=True)
    assert calls == []
    effect = EFFECTS[name][0](0.1)
    assert (
        small.changed(effects=(effect,)).with_numerics(cycles=1).cycle(phases=16).work
        is None
    )
    assert set(calls) == {type(effect)}


@pytest.mark.parametrize("name", EFFECTS)
def test_engines(name):
    """What needs no time stepping gets none; time stepping agrees with the algebraic engine there."""
    effect = EFFECTS[name][0](0.01)
    needs = {
        "body-inertia": "dynamic",
        "transient": "time stepping",
        "disturbed-ground": "time stepping",
    }
    wanted = (
        "time stepping"
        if name in ("depth-profile, slope", "slope")
        else needs.get(name.partition(",")[0], "algebraic")
    )
    assert engine((effect,)) == wanted
    assert engine((effect, BodyInertia(1, 1, 1, 1))) == "dynamic"
    body, (alpha, alphadot) = Backbone(12), Sine(elements=12).cycle(16)
    if wanted == "algebraic":
        marched = time_steps(
            GLASS, body, alpha, alphadot, effects=(effect,), cycles=1, tolerance=1e-12
        ).xi
        at_once = body_velocity(
            GLASS, body, alpha, alphadot, effects=(effect,), tolerance=1e-12
        ).xi
        np.testing.assert_allclose(marched, at_once, atol=1e-9)
    else:
        with pytest.raises(
            ValueError,
            match=re.escape(
                f"effects are {negation(effect.breaks)}: use rft.time_steps"
            ),
        ):
            body_velocity(GLASS, body, alpha, alphadot, effects=(effect,))


ONE_OF_EACH = {
    name: make(0.3) for name, (make, _) in EFFECTS.items() if "," not in name
}
ONE_OF_EACH["depth-profile"] = DepthProfile(along=(0.8, 1.0, 1.3), slope=0.1)


@functools.cache
def few_phases(solve, *effects):
    """xi of an uneven chain over a few phases."""
    cycle, more = OFF_CENTRE.cycle(8), {"cycles": 1} if solve is time_steps else {}
    how = {"regularisation": 1e-3, "tolerance": 1e-12, "pieces": 10, **more}
    return solve(
        GLASS, Chain((1, 1.4, 0.8), frame="link-1"), *cycle, effects=effects, **how
    ).xi


@pytest.mark.parametrize("name", ONE_OF_EACH)
def test_any_two_effects_commute(name):
    """In both orders: body velocities where shape settles them, and a few time steps, which every pair has."""
    names = list(ONE_OF_EACH)
    for other in names[names.index(name) + 1 :]:
        both = [ONE_OF_EACH[name], ONE_OF_EACH[other]]
        for solve in (
            (time_steps, body_velocity)
            if engine(both) == "algebraic"
            else (time_steps,)
        ):
            first, second = few_phases(solve, *both), few_phases(solve, *both[::-1])
            np.testing.assert_allclose(second, first, rtol=0, atol=1e-13, err_msg=other)
            for one in both:
                assert np.abs(first - few_phases(solve, one)).max() > 1e-4, other


def test_all_effects_commute():
    effects, body, (alpha, alphadot) = (
        tuple(ONE_OF_EACH.values()),
        Backbone(10),
        Sine(elements=10).cycle(8),
    )
    run = lambda order: (
        time_steps(
            GLASS, body, alpha, alphadot, effects=order, cycles=1, regularisation=1e-3
        ).xi
    )
    first = run(effects)
    for order in itertools.islice(itertools.permutations(effects), 1, None, 31_991):
        np.testing.assert_allclose(run(order), first, atol=1e-13)


@pytest.mark.parametrize("name", ONE_OF_EACH)
def test_every_sample_of_a_batch_has_its_own_parameters(name):
    """Those that may differ, all at once, against every sample alone, through time stepping and at single shapes."""
    effect, body, how = (
        ONE_OF_EACH[name],
        Chain((1, 1.4, 0.8)),
        {"regularisation": 1e-3, "tolerance": 1e-13, "pieces": 10},
    )
    alpha, alphadot = OFF_CENTRE.cycle(8, [0.7, 1.0, 1.2])
    given = {
        k: getattr(effect, k) for k in effect.batched if getattr(effect, k) is not None
    }
    batch = effect.with_parameters(
        **{k: value * np.array([1.0, 0.6, 0.8]) for k, value in given.items()}
    )
    each = [
        effect.with_parameters(**{k: value * part for k, value in given.items()})
        for part in (1.0, 0.6, 0.8)
    ]
    alone = [
        time_steps(GLASS, body, a, d, effects=(e,), cycles=1, **how).xi
        for a, d, e in zip(alpha, alphadot, each)
    ]
    found = time_steps(
        GLASS, body, alpha, alphadot, effects=(batch,), cycles=1, **how
    ).xi
    np.testing.assert_allclose(found, alone, atol=1e-9)
    if engine((effect,)) == "algebraic":
        samples = np.repeat(np.arange(3), 8)
        found = body_velocity(
            GLASS, body, alpha, alphadot, effects=(batch.take(samples),), **how
        ).xi
        np.testing.assert_allclose(found, alone, atol=1e-9)


def test_explain_names_effects_engine_and_losses():
    told = description(scenes.load("shovel-nosed-snake"))
    assert "on:  skin-friction" in told
    assert "on:  end-caps" in told
    assert "engine: algebraic" in told
    assert "not available: CCF maps" in told
    plain = description(scenes.load("three-link-glass"))
    assert "off, not evaluated: " + ", ".join(KINDS) in plain
    assert "not available" not in plain
    assert (
        "by symmetry: 65 of 256 phases of the gait are solved" in plain
        and "by symmetry" not in told
    )


BAD = [
    ('kind = "end-cap"\nradius = 0.1', "'end-cap' is unknown: did you mean 'end-caps'"),
    ('kind = "end-caps"', "end-caps has no radius: give radius"),
    ('kind = "end-caps"\nradius = -1', "radius must be a number from 0 to 1"),
    ('kind = "skin-friction"\nforward = 0', "forward must be a number from 0.001"),
    ('kind = "depth-profile"\nalong = [1]', "along must be two depths or more"),
    ('kind = "depth-profile"\nalong = [1, -1]', "along must be two depths or more"),
    ('kind = "depth-profile"\nslope = -0.1', "slope must be a number from 0"),
    ('kind = "transient"\ntravel = -1', "travel must be a number from 0 to 10"),
    ('kind = "transient"\ntravel = nan', "travel must be a number from 0 to 10"),
    (
        'kind = "disturbed-ground"\nradius = 0.001\nweakening = 0.1',
        "radius must be a number from 0.01 to 0.25",
    ),
    (
        'kind = "disturbed-ground"\nradius = 0.05\nweakening = 2',
        "weakening must be a number from 0 to 1",
    ),
    (
        'kind = "body-inertia"\nmass = 1\nfrequency = 1\nlength = 1\ndrag = 0',
        "drag must be a number from",
    ),
    (
        'kind = "body-inertia"\nmass = 1e9\nfrequency = 100\nlength = 1\ndrag = 1',
        "beyond 1e6 no gait settles",
    ),
    (
        'kind = "end-caps"\nradius = 0.1\n[[effects]]\nkind = "end-caps"\nradius = 0.2',
        "asked for twice",
    ),
]


@pytest.mark.parametrize(("effects", "said"), BAD)
def test_bad_effects_are_refused(effects, said):
    with pytest.raises(Refusal, match=said):
        scenes.parse(scenes.load("three-link-glass").text + "[[effects]]\n" + effects)


def test_grain_inertia_needs_grains():
    effect = (
        '[[effects]]\nkind = "grain-inertia"\nfrequency = 1\nlength = 0.1\ndepth = 0.05'
    )
    with pytest.raises(
        Refusal, match="grain inertia takes a medium of grains, got Viscous"
    ):
        scenes.parse(scenes.load("three-link-viscous").text + effect)


def test_grain_inertia_takes_the_grains_own_pressure():
    """The quadratic drag is lambda rho v_n^2 over k rho g |z|: with k = 2.5 in loose glass, 5.1 in close, one's own
    where one is given, and 2.5 where nobody says, which is said."""
    plain = {"frequency": 2.0, "length": 0.3, "depth": 0.05, "strength": 1.5}
    m = np.array([[0.7]])
    zero = 0 * m

    def added(effect, medium):
        """Normal load of an element that goes across at 0.7 body lengths per rad, over what the medium itself gives."""
        strength = (
            assemble(medium, Chain(), [effect])
            .problem(np.zeros((2, 1)), np.ones((2, 1)))
            .quadratic_drag
        )
        return float(quadratic_load(m, zero, strength).n[0, 0])

    speed = 0.7 * 0.3 * 2 * np.pi * 2.0  # m/s
    unit = 1.5 * speed**2 / (9.81 * 0.05)
    own = GrainInertia(**plain, k=4.0)
    for name, k in (
        ("loose", 2.5),
        ("close", 5900 / (0.62 * 2500 * 9.81 * 0.0762)),
        ("surface", 2.5),
    ):
        medium = CATALOGUE[f"glass-0.3mm-{name}"].medium
        assert added(GrainInertia(**plain), medium) == pytest.approx(
            unit / k, rel=1e-12
        )
        assert added(own, medium) == pytest.approx(unit / 4.0, rel=1e-12)
        assert GrainInertia(**plain).assumes(medium) == (
            "k = 2.5, that of loose glass" if name == "surface" else ""
        )
        assert own.assumes(medium) == ""
    old = INERTIAL.format(f=1.0)
    assert "assumes" not in description(scenes.parse(old))
    assert "assumes k = 2.5" in description(
        scenes.parse(old.replace("0.3mm-loose", "0.3mm-surface"))
    )
    with pytest.raises(Refusal, match="k must be a number from 0.001 to 1000"):
        scenes.parse(old + "\nk = 0")


def test_end_caps_need_grains():
    with pytest.raises(Refusal, match="end caps take a granular medium, got Viscous"):
        scenes.parse(
            scenes.load("three-link-viscous").text
            + '[[effects]]\nkind = "end-caps"\nradius = 0.1'
        )


INERTIAL = (
    scenes.load("three-link-glass").text
    + '[[effects]]\nkind = "grain-inertia"\nfrequency = {f}\nlength = 0.3\ndepth = 0.05'
)


def test_with_grain_inertia_frequency_matters():
    slow, fast = (scenes.parse(INERTIAL.format(f=f)) for f in (0.01, 3.0))
    plain = SceneTables(scenes.load("three-link-glass")).poses("direct")
    np.testing.assert_allclose(SceneTables(slow).poses("direct"), plain, atol=1e-4)
    assert np.abs(SceneTables(fast).poses("direct") - plain).max() > 5e-3
    alpha, alphadot = fast.gait.cycle(16)
    twice = fast.system.velocity(alpha, 2 * alphadot) / 2
    assert (
        np.abs(twice - fast.system.velocity(alpha, alphadot)).max() > 1e-3
    )  # time is not the swimmer's own any more


@pytest.mark.parametrize("tier", ["area", "path", "harmonic"])
def test_what_an_effect_breaks_is_refused_by_name(tier):
    inertial = scenes.parse(INERTIAL.format(f=1.0))
    assert default_tiers(inertial.system) == ("direct",)
    with pytest.raises(
        Refusal, match="the effect grain-inertia, which is not rate-independent"
    ):
        SceneTables(inertial).poses(tier)
    assert "; not rate-independent; costs" in description(inertial)
    assert "not available: connection, CCF" in description(inertial)
    np.testing.assert_allclose(
        SceneTables(inertial).poses("adapted"),
        SceneTables(inertial).poses("direct"),
        atol=1e-3,
    )


def test_transients_draw(tmp_path):
    from figures.swimmers import transients

    numbers = transients.compute(shares=(0.0, 0.2, 0.65, 2.1), elements=20, phases=32)
    assert (np.diff(numbers["net"], axis=1) < 0).all()
    assert numbers["net"][1] == pytest.approx([1, 0.91, 0.73, 0.50], abs=0.01)
    net, velocity = drawn(transients, numbers, tmp_path).axes
    np.testing.assert_allclose(
        curve(net, r"$A/\lambda$ = 0.4"), [numbers["shares"], numbers["net"][2]]
    )
    np.testing.assert_allclose(
        curve(velocity, "travel 2.1 $A$"), [numbers["t"], numbers["velocity"][3]]
    )


def test_the_cost_of_effects_draws(tmp_path):
    from figures.accuracy import effects_cost

    numbers = effects_cost.compute(phases=16, repeats=1, cycles=2)
    assert numbers["none"]["engine"] == numbers["these four"]["engine"] == "algebraic"
    assert numbers["transient"]["engine"] == "time stepping"
    assert numbers["body inertia"]["engine"] == "dynamic"
    assert numbers["transient"]["cycles"] > 1
    assert numbers["none"]["ratio"] == 1.0
    assert set(numbers) == set(effects_cost.SETS)
    (ax,) = drawn(effects_cost, numbers, tmp_path).axes
    names = [x.get_text() for x in ax.get_yticklabels()]
    bars = {
        names[round(bar.get_y() + bar.get_height() / 2)]: bar.get_width()
        for bar in ax.patches
    }
    assert bars == {name: one["ratio"] for name, one in numbers.items()}


def test_a_body_that_comes_to_the_surface_is_refused():
    text = (
        SANDFISH.text.partition("[[effects]]")[0]
        + '[[effects]]\nkind = "depth-profile"\nslope = 10.0\n'
    )
    with pytest.raises(ValueError, match="comes to the surface: lower the slope"):
        SceneTables(scenes.parse(text)).poses("direct")


PAST = {
    "transient": "travel = 0.03",
    "disturbed-ground": "radius = 0.05\nweakening = 0.1",
    "depth-profile": "slope = 0.1",
    "body-inertia": "mass = 0.1\nfrequency = 1\nlength = 0.3\ndrag = 2",
}


@pytest.mark.parametrize("name", PAST)
def test_what_a_march_cannot_give_is_refused_by_name(name):
    swimmer = scenes.parse(
        f'{scenes.load("three-link-glass").text}\n[[effects]]\nkind = "{name}"\n{PAST[name]}\n'
    )
    assert SceneTables(swimmer).tiers == default_tiers(swimmer.system) == ("direct",)
    for asked in (
        lambda: SceneTables(swimmer).poses("area"),
        lambda: SceneTables(swimmer).poses("path"),
        lambda: SceneTables(swimmer).poses("harmonic"),
        lambda: SceneTables(swimmer).poses("adapted"),
        lambda: SceneTables(swimmer).fitted,
        lambda: swimmer.system.velocity([0.1, 0.2], [1.0, 0.0]),
    ):
        with pytest.raises(
            ValueError,
            match=f"with the effect {name}, which is not .*: .*, or drop the effect",
        ):
            asked()
    told = description(swimmer)
    assert f"engine: {engine(swimmer.system.effects)}" in told
    assert f"with {name} " in told
    assert (
        f"not available: connection, CCF, velocity at a single shape, area, adapted, path and harmonic tiers: {name}"
        in told
    )
