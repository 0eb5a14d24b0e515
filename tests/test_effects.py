"""Effects: what each one is, that it vanishes at its limit, that it costs nothing when off, what it takes away."""

import dataclasses
import itertools

import numpy as np
import pytest
from registry import BODIES, EFFECTS

from geomech import scenes
from geomech.explain import explain
from geomech.gaits import Sine
from geomech.problem import SceneError
from rft import (
    CATALOGUE,
    Backbone,
    BodyInertia,
    Chain,
    DepthProfile,
    DisturbedGround,
    EndCaps,
    GrainInertia,
    SkinFriction,
    Transient,
    Viscous,
    body_velocity,
    march,
)
from rft.bodies.pieces import Pieces, cut
from rft.effects import ENGINES, KINDS, PREMISES, engine
from rft.effects.base import Here
from rft.effects.disturbed import Ground
from rft.effects.sides import sides
from rft.effects.transient import _developed
from rft.loads import element_load

GLASS = CATALOGUE["glass-0.3mm-loose"].medium
SANDFISH = scenes.load("sandfish-loose")


def test_the_registry_has_every_effect():
    assert {name.partition(",")[0] for name in EFFECTS} == set(KINDS)


@pytest.mark.parametrize("name", EFFECTS)
def test_effects_say_what_they_are(name):
    effect = EFFECTS[name][0](0.01)
    assert effect.breaks <= set(PREMISES)
    assert effect.limit
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


def test_end_caps_are_the_written_formula():
    cap, psi, e = EndCaps(radius=0.08, head=4.0, tail=0.0), np.linspace(0.01, 3.1, 20), 4.0
    along, across = cap.traction(GLASS, np.cos(psi), np.sin(psi))
    unit = 2 * 0.08  # 2 r C_F L with C_F = L = 1
    axial = e * np.pi * 0.08**2 * GLASS.C * np.sin(np.arctan(np.cos(psi) / np.tan(GLASS.gamma0))) / unit
    np.testing.assert_allclose(along, axial, rtol=1e-12)
    np.testing.assert_allclose(across, e * np.pi * 0.08**2 * np.sin(psi) / unit, rtol=1e-12)


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
    ('kind = "end-caps"\nradius = -1', "radius must lie from 0 to 1"),
    ('kind = "skin-friction"\nforward = 0', "forward must be a coefficient"),
    ('kind = "depth-profile"\nalong = [1]', "along must be two depths or more"),
    ('kind = "depth-profile"\nalong = [1, -1]', "along must be two depths or more"),
    ('kind = "depth-profile"\nslope = -0.1', "slope must lie from 0"),
    ('kind = "transient"\ntravel = -1', "travel must lie from 0 to 10 body lengths"),
    ('kind = "transient"\ntravel = nan', "travel must lie from 0 to 10 body lengths"),
    ('kind = "disturbed-ground"\nradius = 0.001\nweakening = 0.1', "radius must lie from 0.01 to 0.25"),
    ('kind = "disturbed-ground"\nradius = 0.05\nweakening = 2', "weakening must lie from 0 to 1"),
    ('kind = "body-inertia"\nmass = 1\nfrequency = 1\nlength = 1\ndrag = 0', "drag must lie from"),
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


def test_squared_speed_is_integrated_exactly():
    from rft.effects.grain_inertia import squared_speed_load

    rng = np.random.default_rng(0)
    m, w = rng.normal(size=(2, 60))
    m[:10], w[10:20], w[20:30] = 0.0, 0.0, m[20:30] * rng.choice([-1.0, 1.0], 10)
    x, weight = np.polynomial.legendre.leggauss(3)
    pivot = np.clip(np.where(w == 0, -1.0, -m / np.where(w == 0, 1.0, w)), -1, 1)
    exact = np.zeros((2, 60))
    for low, high in ((-1.0, pivot), (pivot, 1.0)):  # a polynomial on either side, for which three nodes are exact
        s = (low + high) / 2 + (high - low) / 2 * x[:, None]
        u = m + w * s
        part = np.array([np.abs(u) * u, s * np.abs(u) * u])
        exact += (weight[:, None] * part).sum(1) * (high - low) / 4
    got = squared_speed_load(m, w)
    np.testing.assert_allclose(got[:, 0], exact, atol=1e-14)
    h = 1e-6
    np.testing.assert_allclose(
        got[:, 2], (squared_speed_load(m + h, w) - squared_speed_load(m - h, w))[:, 0] / (2 * h), atol=1e-5
    )
    np.testing.assert_allclose(
        got[:, 3], (squared_speed_load(m, w + h) - squared_speed_load(m, w - h))[:, 0] / (2 * h), atol=1e-5
    )


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


def test_sides_are_parts_of_the_whole():
    """Left and right add up to the element's load; each is that of the positive and of the negative velocities across."""
    rng = np.random.default_rng(2)
    a, m, w = rng.normal(size=(3, 4, 50))
    m[0], w[1] = 0.0, 0.0
    eps, load = np.full(50, 1e-3), element_load(GLASS)
    left, right = sides(load, a, m, w, eps)
    np.testing.assert_allclose(left + right, load(a, m, w, eps), atol=1e-12)
    s = (np.arange(20000) + 0.5) / 10000 - 1
    u = m + w * s[:, None, None]
    f_t, f_n = GLASS.traction(a, u, 1e-3)
    for part, where in ((left, u > 0), (right, u < 0)):
        for row, f in enumerate((f_t, f_n, s[:, None, None] * f_n)):
            np.testing.assert_allclose(part[row, 0], (f * where).mean(0), atol=3e-4)
    h, inner = 1e-6, np.abs(np.abs(m) - np.abs(w)) > 1e-3
    for column, step in ((2, (0, h, 0)), (3, (0, 0, h))):
        up, down = (sides(load, a + k * step[0], m + k * step[1], w + k * step[2], eps)[0] for k in (1, -1))
        slope = (up - down)[1:, 0] / (2 * h)
        np.testing.assert_allclose(left[1:, column][:, inner], slope[:, inner], rtol=1e-3, atol=1e-3)


def test_transients_follow_their_equation():
    """An oscillating rod: shares against dh/dx = 3 (1 - h) / travel one way and -3 h / travel the other, of order 2 in the
    step; 95 % is there after the travel."""
    travel, t_end = 0.2, 7.0
    way = lambda t: np.sin(1.3 * t) + 0.3 * np.cos(2.1 * t)

    def exact():
        h, dt = np.zeros(2), 1e-4
        for t in np.arange(0, t_end, dt):
            u = way(t + dt / 2)
            goal = np.array([u > 0, u < 0], float)
            h = goal + (h - goal) * np.exp(-3 / travel * abs(u) * dt)
        return h

    def marched(steps):
        h, t = np.zeros((2, 1, 1)), np.linspace(0, t_end, steps + 1)
        for before, now in itertools.pairwise(t):
            h, _ = _developed(h, np.full((1, 1), way(before)), np.full((1, 1), way(now)), now - before, 3 / travel)
        return h[:, 0, 0]

    truth, counts = exact(), np.array([50, 100, 200, 400])
    errors = [np.abs(marched(n) - truth).max() for n in counts]
    assert -np.polyfit(np.log(counts), np.log(errors), 1)[0] == pytest.approx(2, abs=0.3)
    one = np.ones((1, 1))
    (left, right), _ = _developed(np.array([[[0.0]], [[1.0]]]), one, one, travel, 3 / travel)
    assert left == pytest.approx(1 - np.exp(-3))
    assert right == pytest.approx(np.exp(-3))


def test_slopes_of_shares_are_derivatives():
    rng = np.random.default_rng(3)
    memory, before, now, h = rng.uniform(size=(2, 5, 40)), *rng.normal(size=(2, 5, 40)), 1e-6
    values, slopes = _developed(memory, before, now, 0.3, 2.0)
    difference = _developed(memory, before, now + h, 0.3, 2.0)[0] - _developed(memory, before, now - h, 0.3, 2.0)[0]
    np.testing.assert_allclose(slopes, difference / (2 * h), atol=1e-7)
    assert (values >= 0).all()
    assert (values <= 1).all()
    assert (slopes[0] >= 0).all()  # the faster to the left, the more of the drag to the left
    assert (slopes[1] <= 0).all()
    still = _developed(memory, before, now, 0.3, np.inf)
    assert (still[0] == 1).all()
    assert (still[1] == 0).all()


def test_ground_remembers_where_the_body_was():
    ground = Ground(0.025, 2)
    ground.mark(np.array([[0.3 + 0.2j, 0.0]]), 0.05)
    # A whole disturbance on the axis, nothing far off, and nothing in the other sample's ground.
    assert ground.at(np.array([0.3 + 0.2j, 0.3 + 0.2j])) == pytest.approx([1, 0], abs=0.05)
    assert ground.at(np.array([0.3 + 0.32j, 5.0])) == pytest.approx([0, 0], abs=1e-12)
    assert ground.at(np.array([0.3 + 0.25j, 0.05])) == pytest.approx([0.5, 0.5], abs=0.1)
    # A patch that wraps round onto the same cells is untouched ground, and taking it over forgets the old.
    assert ground.at(np.array([0.3 + 0.2j + 4, 0.0])) == pytest.approx([0, 1], abs=0.05)
    ground.mark(np.array([[4.3 + 0.2j, 0.0]]), 0.05)
    assert ground.at(np.array([0.3 + 0.2j, 0.0])) == pytest.approx([0, 1], abs=0.05)


def test_a_body_that_finds_fresh_ground_is_not_weakened():
    """The first steps of a straight-ahead chain: its own track lies behind and under it, not at its sides."""
    effect = DisturbedGround(radius=0.03, weakening=1.0)
    body = cut(Chain((1, 1, 1)))
    motion = body.motion(np.zeros((2, 1)), np.ones((2, 1)))
    here = Here(0.1, motion.place, motion.c + 1j * motion.s, motion, motion.v, np.ones(1))
    memory = effect.start(len(motion.half), 1)
    memory = effect.after(memory, here, motion.v)
    now = effect.at(memory, here)
    np.testing.assert_allclose([now.left, now.right], 1.0, atol=1e-12)
    aside = here._replace(place=motion.place + 0.06j)
    assert effect.at(memory, aside).right.max() < 0.1  # the track it left
    assert effect.at(memory, aside).left.min() == 1.0


@pytest.mark.parametrize("name", BODIES)
def test_pieces_move_as_the_body(name):
    """Cutting elements changes no force and no moment."""
    body, rng = BODIES[name], np.random.default_rng(4)
    alpha, alphadot = rng.uniform(-1, 1, (20, body.joints)), rng.normal(size=(20, body.joints))
    whole = body_velocity(GLASS, body, alpha, alphadot, tolerance=1e-12)
    pieces = body_velocity(GLASS, Pieces(body, 0.03), alpha, alphadot, tolerance=1e-12)
    np.testing.assert_allclose(pieces.xi, whole.xi, atol=1e-7)


def test_depth_along_the_body():
    """Uniform depth changes nothing, whatever it is. A rising ground to the left mirrors one to the right."""
    body, rng = Chain((1, 1, 1)), np.random.default_rng(5)
    alpha, alphadot = rng.uniform(-1, 1, (20, 2)), rng.normal(size=(20, 2))
    plain = body_velocity(GLASS, body, alpha, alphadot).xi
    for depths in ((3.0, 3.0), (0.5, 0.5, 0.5)):
        level = body_velocity(GLASS, body, alpha, alphadot, effects=(DepthProfile(along=depths),)).xi
        np.testing.assert_allclose(level, plain, atol=1e-8)
    heads = Backbone(20), *Sine(elements=20).cycle(32)
    up, down = (
        march(GLASS, heads[0], sign * heads[1], sign * heads[2], effects=(DepthProfile(slope=0.5, towards=way),))
        for sign, way in ((1, 0.8), (-1, -0.8))
    )
    np.testing.assert_allclose(up.pose, down.pose * [1, -1, -1], atol=1e-7)


def test_depth_along_a_straight_chain_in_closed_form():
    """In a viscous medium, straight, the tail's link turning: two linear equations for drift and turn."""
    depth = lambda x: 1.5 + x
    nodes, weights = np.polynomial.legendre.leggauss(40)
    own, drift = 0.0, np.zeros((2, 2))
    for low, high, rate in ((-1 / 2, -1 / 6, -1.0), (-1 / 6, 1 / 2, 0.0)):
        x = (low + high) / 2 + (high - low) / 2 * nodes
        f = weights * (high - low) / 2 * depth(x)
        own = own + np.array([np.sum(f * rate * (x + 1 / 6)), np.sum(f * x * rate * (x + 1 / 6))])
        drift += [[np.sum(f), np.sum(f * x)], [np.sum(f * x), np.sum(f * x * x)]]
    wanted = np.linalg.solve(drift, -own)
    effect, body = DepthProfile(along=(1.0, 2.0)), Chain((1, 1, 1), frame="link-2")
    xi = body_velocity(Viscous(2.0), body, [0.0, 0.0], [1.0, 0.0], effects=(effect,)).xi
    np.testing.assert_allclose(xi, [0, *wanted], atol=2e-4)  # pieces count as their centres


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
