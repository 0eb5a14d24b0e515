"""Effects of the vertical plane, on outlines and on meshes: limits, orders, closed
forms, power, refusals."""

import dataclasses
import itertools
import math

import numpy as np
import pytest
from artists import curve, drawn
from registry import GROUND_EFFECTS, OUTLINES, STRESSES

from figures.terradynamics import ground_effects
from rft.terradynamics.ground import GROUND_EFFECTS as KINDS
from rft.terradynamics.ground import (
    Aeration,
    DisturbedGround,
    GrainInertia,
    Slope,
    ground_of,
)
from rft.terradynamics.meshes import Spatial, wrench
from rft.terradynamics.meshes.surfaces import shapes
from rft.terradynamics.plates import Plate, loads

POSE = [(0.0, -0.01, 0.7), (0.1, -0.2, -1.2), (-0.03, -0.04, 2.5)]
TWIST = [(0.02, -0.3, 4.0), (0.0, 0.0, -9.0), (-0.5, 0.2, 0.3)]
MAP = STRESSES["poppy-seeds-loose"]
SOLID = Spatial(3e5, 0.3)
MESH = shapes.leg(0.03, 0.8, 0.006, 0.02, along=12, across=3, thick=1)
MOTION = (np.eye(3), np.array([0.02, 0.1, -0.01]), [-0.3, 0.1, -0.4], [2.0, 9.0, 1.0])
ALL = (
    GrainInertia(2.0, 700.0),
    Aeration(0.01, 0.03),
    Slope(0.2, 0.6),
    DisturbedGround((0.0, 0.03), 0.02, 0.6),
    DisturbedGround((-0.1,), 0.05, 0.4),
)


def on_outline(effects, shape="c-leg"):
    found = loads(MAP, OUTLINES[shape].outline(40), POSE, TWIST, effects)
    return np.column_stack([found.force, found.moment])


def on_half_cylinder(effects):
    return on_outline(effects, "half-cylinder")


def on_mesh(effects):
    found = wrench(SOLID, MESH, *MOTION, effects)
    return np.concatenate([found.force, found.moment, [found.power]])


def test_every_kind_is_in_the_registry():
    assert {name.partition(",")[0] for name in GROUND_EFFECTS} == set(KINDS)


@pytest.mark.parametrize("on", [on_outline, on_half_cylinder, on_mesh])
@pytest.mark.parametrize("name", GROUND_EFFECTS)
def test_the_plain_law_comes_back_at_its_order(name, on):
    effect, order = GROUND_EFFECTS[name]
    assert order == effect(0.1).order
    plain = on([])
    change = [np.linalg.norm(on([effect(x)]) - plain) for x in (0.04, 0.02, 0.01)]
    assert change[0] > 1e-6 * np.linalg.norm(plain)
    np.testing.assert_allclose(-np.diff(np.log2(change)), order, atol=0.1)
    np.testing.assert_allclose(on([effect(0.0)]), plain, rtol=1e-14, atol=1e-18)


@pytest.mark.parametrize("on", [on_outline, on_mesh])
def test_effects_commute(on):
    first = on(ALL)
    for effects in itertools.islice(itertools.permutations(ALL), 1, 120, 17):
        np.testing.assert_allclose(on(effects), first, rtol=1e-12)


INERTIA = [GrainInertia(1.5, 640.0)]


@pytest.mark.parametrize("tension", ["keep", "cut"])
@pytest.mark.parametrize("back", [1, -1])
@pytest.mark.parametrize("depth", [0.1, 0.5])
def test_grain_inertia_is_the_momentum_swept_up(depth, back, tension):
    """lambda rho v_n^2 on a plate, on whichever side leads, at any depth."""
    plate = Plate(length=0.04, width=0.03, tilt=0.4).outline(8)
    v = back * np.array([1.2, -0.7])
    n = np.array([math.sin(0.4), -math.cos(0.4)])
    stress = dataclasses.replace(MAP, tension=tension)
    motion = ([0.0, -depth, 0.0], [*v, 0.0])
    added = loads(stress, plate, *motion, INERTIA).force
    added -= loads(stress, plate, *motion).force
    expected = -back * 1.5 * 640.0 * (v @ n) ** 2 * 0.04 * 0.03 * n
    assert added == pytest.approx(expected, rel=1e-9)


def test_inertia_of_grains_is_seen_on_a_leg_above_some_230_rpm(tmp_path):
    """R = 3.8 cm in loose poppy seeds: a tenth of the force at 239 rpm with lambda = 1,
    nothing to see at 30."""
    numbers = ground_effects.compute()
    rates = list(numbers["rates"])
    added = numbers["added"]
    assert numbers["noticeable_rates"][0] == pytest.approx(239, abs=1)
    assert added[:, rates.index(30)].max() < 0.01
    expected = 0.093 * np.array([1, 2, 4])
    assert added[:, rates.index(230)] == pytest.approx(expected, rel=0.01)
    ax = drawn(ground_effects, numbers, tmp_path).axes[0]
    np.testing.assert_allclose(curve(ax, r"$\lambda$ = 2"), [rates, added[1]])


ANGLES = np.radians(np.arange(0, 360, 30))
HEADINGS = np.stack([np.cos(ANGLES), np.sin(ANGLES)], -1)


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize(
    ("way", "left"),
    [
        ([-1, 0, 0], 0.5),
        ([1, 0, 0], math.cos(math.radians(20))),
        ([0, 0, -1], math.cos(math.radians(20))),
        ([0, 1, 0], math.cos(math.radians(20))),
    ],
    ids=["downhill", "uphill", "into it", "across"],
)
def test_half_the_drag_is_left_downhill_at_20_degrees(way, left, side):
    """The one datum of the paper (Sec. IV B), by default. The other directions keep
    what gravity presses, cos 20 degrees."""
    slope = [Slope(side * math.radians(20))]
    v = side * np.array(way, float)
    motion = (np.eye(3), [0.1, 0.0, -0.1], v * [1, side, side], [0, 0, 0])
    found = wrench(SOLID, MESH, *motion, slope)
    plain = wrench(SOLID, MESH, *motion)
    np.testing.assert_allclose(found.force, left * plain.force, atol=1e-15)
    np.testing.assert_allclose(found.moment, left * plain.moment, atol=1e-15)


@pytest.mark.parametrize(("angle", "repose"), [(0.2, 0.6), (-0.35, 0.5), (0.0, 0.5)])
def test_a_slope_weakens_in_proportion_to_how_far_a_face_moves_downhill(angle, repose):
    """cos(angle) - d sin|angle| / tan(repose)."""
    d = np.maximum(-math.copysign(1.0, angle) * HEADINGS[:, 0], 0.0)
    left = math.cos(angle) - d * math.sin(abs(angle)) / math.tan(repose)
    slope = [Slope(angle, repose)]
    plate = Plate(length=0.04, width=0.03, tilt=0.3).outline(8)
    motion = ([0, -0.1, 0], np.column_stack([HEADINGS, 0 * ANGLES]))
    found = loads(MAP, plate, *motion, slope).force
    plain = loads(MAP, plate, *motion).force
    np.testing.assert_allclose(found, left[:, None] * plain, rtol=1e-12, atol=1e-15)


def test_disturbed_ground_is_weaker_near_the_place():
    """Of a small plate and a thin rod: all of the weakening within half a radius, none
    beyond one and a half, linear between."""
    effect = [DisturbedGround((0.1, -0.3), radius=0.04, weakening=0.7)]
    x = np.array([-0.4, -0.3, 0.03, 0.045, 0.06, 0.07, 0.085, 0.1, 0.119, 0.14, 0.161])
    share = 1 - 0.7 * np.array([0, 1, 0, 0.125, 0.5, 0.75, 1, 1, 1, 0.5, 0])
    plate = Plate(length=1e-5, width=0.03).outline(1)
    pose = np.stack([x, 0 * x - 0.05, 0 * x], -1)
    found, plain = (
        loads(MAP, plate, pose, [0, -1.0, 0], e).force for e in (effect, [])
    )
    np.testing.assert_allclose(found[:, 1], share * plain[:, 1], rtol=1e-3)
    rod = shapes.cylinder(0.0005, 0.03, 16, 1, 1)
    motion = (np.eye(3), pose[:, [0, 2, 1]], [0, 0, -1.0], [0, 0, 0])
    found, plain = (wrench(SOLID, rod, *motion, e).force for e in (effect, []))
    np.testing.assert_allclose(found[:, 2] / plain[:, 2], share, atol=0.01)


@pytest.mark.parametrize("tension", ["keep", "cut"])
@pytest.mark.parametrize(
    ("name", "count"), [("c-leg", 60_000), ("half-cylinder", 40_000)]
)
def test_the_ground_takes_power_with_all_effects(name, count, tension):
    """From 100,000 motions across the surface, fast and slow."""
    rng = np.random.default_rng(3)
    pose = rng.uniform([-0.2, -0.2, -np.pi], [0.2, 0.05, np.pi], (count, 3))
    speed = rng.choice([0.01, 1.0, 10.0], (count, 1))
    twist = rng.normal(size=(count, 3)) * [1, 1, 20] * speed
    stress = dataclasses.replace(MAP, tension=tension)
    power = loads(stress, OUTLINES[name].outline(8), pose, twist, ALL).power(twist)
    assert power.max() <= 0.0
    assert (power < 0).mean() > 0.5


FLAT = OUTLINES["plate"].outline(1)
REFUSED = [
    (lambda: Aeration(0.03, 0.03), r"the ground is fluidised from 0\.03 m/s"),
    (lambda: Slope(0.5, 0.5), r"slides by itself.* angle of repose, 28\.6 degrees"),
    (lambda: DisturbedGround((), 0.02, 0.1), "must be"),
    (lambda: ground_of([Aeration(0.01, 0.03)] * 2), "aeration appears twice"),
    (lambda: loads(MAP, FLAT, POSE, TWIST, Slope(0.1)), "a list of effects such as"),
]


@pytest.mark.parametrize(("build", "said"), REFUSED)
def test_effects_that_make_no_sense_are_refused(build, said):
    with pytest.raises(ValueError, match=said):
        build()
