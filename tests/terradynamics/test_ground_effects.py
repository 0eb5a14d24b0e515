"""Effects of the vertical plane, on outlines and on meshes: limits, orders, closed forms, power, refusals."""

import dataclasses
import itertools
import math

import numpy as np
import pytest
from artists import curve, drawn
from registry import GROUND_EFFECTS, OUTLINES, STRESSES

from figures.terradynamics import ground_effects
from geomech import scenes
from geomech.shell.describe.scene import description
from rft.terradynamics.ground import GROUND_EFFECTS as KINDS
from rft.terradynamics.ground import (
    Aeration,
    DisturbedGround,
    GrainInertia,
    Slope,
    ground_of,
)
from rft.terradynamics.meshes import Spatial, bearing, wrench
from rft.terradynamics.meshes.surfaces import shapes
from rft.terradynamics.plates import Plate, Polygon, loads

POSE = [(0.0, -0.01, 0.7), (0.1, -0.2, -1.2), (-0.03, -0.04, 2.5)]
TWIST = [(0.02, -0.3, 4.0), (0.0, 0.0, -9.0), (-0.5, 0.2, 0.3)]
MAP = STRESSES["poppy-seeds-loose"]
SOLID, MESH = (
    Spatial(3e5, 0.3),
    shapes.leg(0.03, 0.8, 0.006, 0.02, along=12, across=3, thick=1),
)
ALL = (
    GrainInertia(2.0, 700.0), Aeration(0.01, 0.03), Slope(0.2, 0.6), DisturbedGround((0.0, 0.03), 0.02, 0.6),
    DisturbedGround((-0.1,), 0.05, 0.4),
)  # fmt: skip


def both(effects, shape="c-leg", stress=MAP):
    found = loads(stress, OUTLINES[shape].outline(40), POSE, TWIST, effects)
    return np.column_stack([found.force, found.moment])


def test_every_kind_is_in_the_registry():
    assert {name.partition(",")[0] for name in GROUND_EFFECTS} == set(KINDS)


def of_mesh(effects, shape=None):
    found = wrench(
        SOLID,
        MESH,
        np.eye(3),
        [0.02, 0.1, -0.01],
        [-0.3, 0.1, -0.4],
        [2.0, 9.0, 1.0],
        effects,
    )
    return np.concatenate([found.force, found.moment, [found.power]])


def test_what_faces_bear_with_effects_sums_to_the_wrench():
    """Force and, of a fine mesh, moment: pressure of grains pushes against faces and has its lever, too."""
    fine, place = (
        shapes.leg(0.03, 0.8, 0.006, 0.02, along=96, across=16, thick=6),
        np.array([0.02, 0.1, -0.01]),
    )
    rates, effects = (
        ([-0.3, 0.1, -0.4], [2.0, 9.0, 1.0]),
        (GrainInertia(20.0, 700.0), Slope(-0.2, 0.6)),
    )
    found, faces = (
        f(SOLID, fine, np.eye(3), place, *rates, effects) for f in (wrench, bearing)
    )
    plain = wrench(SOLID, fine, np.eye(3), place, *rates)
    assert (np.abs(found.moment - plain.moment) > 0.1 * np.abs(plain.moment)).all()
    np.testing.assert_allclose(faces.force.sum(0), found.force, rtol=2e-3)
    np.testing.assert_allclose(
        np.cross(faces.middle - place, faces.force).sum(0), found.moment, rtol=1e-2
    )
    speed = rates[0] + np.cross(rates[1], faces.middle - place)
    assert (faces.force * speed).sum() == pytest.approx(found.power, rel=1e-2)


@pytest.mark.parametrize(
    ("on", "shape"), [(both, "c-leg"), (both, "half-cylinder"), (of_mesh, None)]
)
@pytest.mark.parametrize("name", GROUND_EFFECTS)
def test_the_plain_law_comes_back_at_its_order(name, on, shape):
    make, order = GROUND_EFFECTS[name]
    assert order == make(0.1).order
    plain = on([], shape)
    change = [np.linalg.norm(on([make(x)], shape) - plain) for x in (0.04, 0.02, 0.01)]
    assert change[0] > 1e-6 * np.linalg.norm(plain)
    assert np.log2(change[0] / change[1]) == pytest.approx(order, abs=0.1)
    assert np.log2(change[1] / change[2]) == pytest.approx(order, abs=0.05)
    np.testing.assert_allclose(on([make(0.0)], shape), plain, rtol=1e-14, atol=1e-18)


def test_aeration_weakens_in_proportion_and_keeps_the_shape():
    for share in (0.25, 0.8):
        np.testing.assert_allclose(
            both([Aeration(0.03 * (1 - share), 0.03)]), share * both([]), rtol=1e-14
        )


@pytest.mark.parametrize("speed", [0.03, 0.05])
def test_fluidised_ground_is_refused_by_name(speed):
    with pytest.raises(ValueError, match=r"the ground is fluidised from 0\.03 m/s on"):
        Aeration(speed, 0.03)


@pytest.mark.parametrize("on", [both, of_mesh])
def test_effects_commute(on):
    first = on(ALL)
    for some in itertools.islice(itertools.permutations(ALL), 1, 120, 17):
        np.testing.assert_allclose(on(some), first, rtol=1e-12)


@pytest.mark.parametrize("tension", ["keep", "cut"])
@pytest.mark.parametrize("back", [1, -1])
def test_grain_inertia_is_the_momentum_swept_up(tension, back):
    """lambda rho v_n^2 on a plate, on whichever side leads, at any depth; of a cube, on the face that leads alone."""
    plate = Plate(length=0.04, width=0.03, tilt=0.4).outline(8)
    v = back * np.array([1.2, -0.7])
    stress = dataclasses.replace(MAP, tension=tension)
    for depth in (0.1, 0.5):
        found, plain = (
            loads(stress, plate, [0.0, -depth, 0.0], [*v, 0.0], e)
            for e in ([GrainInertia(1.5, 640.0)], [])
        )
        n = np.array([math.sin(0.4), -math.cos(0.4)])
        wanted = -back * 1.5 * 640.0 * (v @ n) ** 2 * 0.04 * 0.03 * n
        assert found.force - plain.force == pytest.approx(wanted, rel=1e-9)
    cylinder = shapes.cylinder(0.02, 0.05, 256, 2, 3)
    found, plain = (
        wrench(
            SOLID, cylinder, np.eye(3), [0, 0, -0.2], [0, back * 2.0, 0], [0, 0, 0], e
        )
        for e in ([GrainInertia(1.5, 640.0)], [])
    )
    assert found.force[1] - plain.force[1] == pytest.approx(
        -back * 1.5 * 640.0 * 4 * math.pi * 0.02**2, rel=1e-3
    )


def test_inertia_of_grains_is_seen_on_a_leg_above_some_230_rpm(tmp_path):
    """R = 3.8 cm in loose poppy seeds: a tenth of the force at 239 rpm with lambda = 1, nothing to see at 30."""
    numbers = ground_effects.compute()
    slow, seen = (
        numbers["added"][:, list(numbers["rates"]).index(rpm)] for rpm in (30, 230)
    )
    assert (
        numbers["noticeable_rates"][0] == pytest.approx(239, abs=1)
        and slow.max() < 0.01
    )
    assert seen == pytest.approx(np.array([1, 2, 4]) * seen[0], rel=1e-9) and seen[
        0
    ] == pytest.approx(0.093, abs=0.001)
    np.testing.assert_allclose(numbers["aerated"], 1 - numbers["shares"], atol=1e-12)
    assert "10 % at 239 rpm" in ground_effects.table(numbers)
    added, peaks, lift = drawn(ground_effects, numbers, tmp_path).axes
    np.testing.assert_allclose(
        curve(added, r"$\lambda$ = 2"), [numbers["rates"], numbers["added"][1]]
    )
    downhill = curve(peaks, "slope / angle of repose, leg sweeps downhill")
    np.testing.assert_allclose(downhill, [numbers["shares"], numbers["rising"]])
    np.testing.assert_allclose(
        curve(lift, "earlier at x = -40 mm")[1], numbers["lift"][-0.04]
    )


def test_sizes_beyond_the_ground_are_refused():
    for make in (
        lambda: Aeration(0.0, -1e-6), lambda: Aeration(-0.01, 0.03), lambda: Slope(0.1, 0.3, -1.0), lambda: GrainInertia(-1.0),
        lambda: GrainInertia(1.0, -1.0), lambda: DisturbedGround((0.0,), 0.02, 1.1), lambda: DisturbedGround((), 0.02, 0.1),
        lambda: DisturbedGround((0.0,), 0.0, 0.1), lambda: DisturbedGround((2e3,), 0.02, 0.1),
    ):  # fmt: skip
        with pytest.raises(ValueError, match="must be"):
            make()
    assert Slope(0.1).weight() == (0.0, 0.0)  # without a mass


HEADINGS = np.stack(
    [
        np.cos(np.radians(np.arange(0, 360, 30))),
        np.sin(np.radians(np.arange(0, 360, 30))),
    ],
    -1,
)


def test_half_the_drag_is_left_downhill_at_20_degrees():
    """The one datum of the paper (Sec. IV B), by default, of a plate that is dragged along the surface or pushed into it, in
    the vertical plane and of a mesh; the rest of the directions keeps what gravity presses, cos 20 degrees."""
    assert math.degrees(Slope(0.3).repose) == pytest.approx(37.88, abs=0.01)
    for angle in (math.radians(20), -math.radians(20)):
        downhill = -math.copysign(1.0, angle)
        for v, left in (
            ((downhill, 0), 0.5),
            ((-downhill, 0), math.cos(angle)),
            ((0, -1), math.cos(angle)),
        ):
            for tilt in (0.0, 0.4, math.pi / 2):
                plate = Plate(length=0.04, width=0.03, tilt=tilt).outline(8)
                given = plate, [0.1, -0.1, 0.0], [*v, 0.0]
                found, plain = loads(MAP, *given, [Slope(angle)]), loads(MAP, *given)
                np.testing.assert_allclose(found.force, left * plain.force, rtol=1e-12)
                np.testing.assert_allclose(
                    found.moment, left * plain.moment, rtol=1e-12
                )
            given = np.eye(3), [0.1, 0.0, -0.1], [v[0], 0.0, v[1]], [0, 0, 0]
            found, plain = (
                wrench(SOLID, MESH, *given, e) for e in ([Slope(angle)], [])
            )
            assert np.linalg.norm(plain.force) > 0
            for what in ("force", "moment"):
                np.testing.assert_allclose(
                    getattr(found, what), left * getattr(plain, what), atol=1e-15
                )
        across = wrench(
            SOLID, MESH, np.eye(3), [0, 0, -0.1], [0, 1.0, 0], [0, 0, 0], [Slope(angle)]
        ).force
        plain = wrench(
            SOLID, MESH, np.eye(3), [0, 0, -0.1], [0, 1.0, 0], [0, 0, 0]
        ).force
        np.testing.assert_allclose(across, math.cos(angle) * plain, atol=1e-15)


def test_a_slope_weakens_in_proportion_to_how_far_a_face_moves_downhill():
    """cos(angle) - d sin|angle| / tan(repose) at all directions; of a face that turns about a hub, by its own velocity."""
    for angle, repose in ((0.2, 0.6), (-0.35, 0.5), (0.0, 0.5)):
        d = np.maximum(-math.copysign(1.0, angle) * HEADINGS[:, 0], 0.0)
        left = math.cos(angle) - d * math.sin(abs(angle)) / math.tan(repose)
        assert left.min() == pytest.approx(
            math.sin(repose - abs(angle)) / math.sin(repose)
        )
        twist = np.column_stack([HEADINGS, np.zeros(len(HEADINGS))])
        plate = Plate(length=0.04, width=0.03, tilt=0.3).outline(8)
        found, plain = (
            loads(MAP, plate, [0, -0.1, 0], twist, e)
            for e in ([Slope(angle, repose)], [])
        )
        np.testing.assert_allclose(
            found.force, left[:, None] * plain.force, rtol=1e-12, atol=1e-15
        )
        tip = Polygon(
            points=((-1e-6, -0.03), (1e-6, -0.03)), width=0.02, closed=False
        ).outline(1)
        headings = np.arctan2(
            HEADINGS[:, 1], HEADINGS[:, 0]
        )  # of the tip: a leg that points down swings forwards at angle 0
        pose = np.column_stack([0 * headings, 0 * headings - 0.1, -headings])
        found, plain = (
            loads(MAP, tip, pose, [0, 0, -5.0], e) for e in ([Slope(angle, repose)], [])
        )
        np.testing.assert_allclose(found.moment, left * plain.moment, rtol=1e-12)
    for angle in (0.5, -0.5, 1.2):
        with pytest.raises(
            ValueError,
            match=r"slides by itself: it must be below the angle of repose, 28\.6 degrees",
        ):
            Slope(angle, 0.5)


def test_gravity_pulls_along_the_slope():
    """Down it whichever way it falls; the moment about the origin and the power of the grains are without it."""
    leg = scenes.load("c-leg")
    for angle in (0.2, -0.2):
        bare, heavy = (
            leg.changed(effects=(Slope(angle, 0.6, mass),)).run() for mass in (0.0, 0.5)
        )
        np.testing.assert_allclose(
            heavy.force - bare.force,
            [[-0.5 * 9.81 * math.sin(angle), 0.0]] * 271,
            atol=1e-12,
        )
        np.testing.assert_array_equal(heavy.moment, bare.moment)
        np.testing.assert_array_equal(heavy.power, bare.power)


def test_disturbed_ground_is_weaker_near_the_place():
    """A small plate pushed down at many x: full weakening within half a radius, none beyond one and a half, linear between."""
    plate, effect = (
        Plate(length=1e-5, width=0.03).outline(1),
        DisturbedGround((0.1, -0.3), radius=0.04, weakening=0.7),
    )
    x = np.array([-0.4, -0.3, 0.03, 0.045, 0.06, 0.07, 0.085, 0.1, 0.119, 0.14, 0.161])
    pose = np.stack([x, 0 * x - 0.05, 0 * x], -1)
    found, plain = (
        loads(MAP, plate, pose, [0.0, -1.0, 0.0], e).force[:, 1] for e in ([effect], [])
    )
    disturbed = np.array([0, 1, 0, 0.125, 0.5, 0.75, 1, 1, 1, 0.5, 0])
    np.testing.assert_allclose(found / plain, 1 - 0.7 * disturbed, atol=2e-4)
    cut = shapes.cylinder(0.0005, 0.03, 16, 1, 1)
    place = np.stack([x, 0 * x, 0 * x - 0.05], -1)
    found, plain = (
        wrench(SOLID, cut, np.eye(3), place, [0, 0, -1.0], [0, 0, 0], e).force[:, 2]
        for e in ([effect], [])
    )
    np.testing.assert_allclose(found / plain, 1 - 0.7 * disturbed, atol=0.01)


def motions(rng, count):
    """Poses and twists across the surface, fast and slow."""
    pose = rng.uniform([-0.2, -0.2, -np.pi], [0.2, 0.05, np.pi], (count, 3))
    return pose, rng.normal(size=(count, 3)) * [1, 1, 20] * rng.choice(
        [0.01, 1.0, 10.0], (count, 1)
    )


@pytest.mark.parametrize("tension", ["keep", "cut"])
def test_the_ground_takes_power_from_100_000_motions_with_all_effects(tension):
    rng = np.random.default_rng(3)
    for name, count in (("c-leg", 60_000), ("half-cylinder", 40_000)):
        pose, twist = motions(rng, count)
        stress = dataclasses.replace(MAP, tension=tension)
        power = loads(stress, OUTLINES[name].outline(8), pose, twist, ALL).power(twist)
        assert power.max() <= 0.0 and (power < 0).mean() > 0.5


def test_what_an_effect_assumes_is_told():
    scene = scenes.load("c-leg").changed(effects=(GrainInertia(strength=2.0),))
    told = description(scene)
    assert (
        "on:  grain-inertia (strength = 2.0, density = 638.0); not rate-independent"
        in told
    )
    assert (
        "assumes 638 kg/m^3, of loose poppy seeds\n" in told
        and "lambda = 1" not in told
    )
    assert (
        description(scene.changed(effects=(GrainInertia(2.0, 700.0),))).count("assumes")
        == 0
    )
    for kind in KINDS.values():
        assert kind.limit and kind.cost and kind.order in (1, 2)


def test_effects_that_are_none_are_refused():
    for wrong in (3, "slope", [3], [Slope], Slope(0.1)):
        with pytest.raises(
            ValueError, match="effects must be a list of effects such as"
        ):
            loads(MAP, OUTLINES["plate"].outline(1), POSE, TWIST, wrong)
    with pytest.raises(ValueError, match="aeration stands twice"):
        ground_of([Aeration(0.01, 0.03)] * 2)
