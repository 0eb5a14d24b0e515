"""Ground that remembers the steps of a robot: its law, both engines, and repetition."""

import dataclasses

import numpy as np
import pytest

from geomech import scenes
from geomech.studies.terradynamics import walking
from rft.balance.backend import preferring
from rft.terradynamics.ground import Aeration, DisturbedGround
from rft.terradynamics.walking import Fineness, PrintedGround, Walker, engine
from rft.terradynamics.walking.prints import Limb, Memory, meet

GROUND = PrintedGround(radius=0.02, weakening=0.4)
XPLORER = scenes.load("xplorer")
SHORT = Fineness(steps=24, elements=8, duration=2.0)


def xplorer(*effects):
    return Walker(XPLORER.robot, XPLORER.gait, XPLORER.medium, effects)


def walked(ground, name="planar", numerics=SHORT):
    (walk,) = engine(name).walk([xplorer(ground)], numerics)
    return walk


def foot(x, depth, y=0.0):
    """Return a limb of one element."""
    return Limb(np.array([[x, y]]), np.array([depth]), np.array([1e-4]))


def share_after_a_print(distance, y=0.0):
    """Return the share of force on a foot at a distance from the print of another."""
    memory = Memory.undisturbed(2)
    up = foot(1.0, -0.1)
    _, memory = meet(GROUND, memory, [foot(0.0, 0.01), up])
    _, memory = meet(GROUND, memory, [up, up])
    shares, _ = meet(GROUND, memory, [up, foot(distance, 0.01, y)])
    return shares[1]


@pytest.mark.parametrize("over_radius", [0.0, 0.3, 0.5, 0.8, 1.2, 1.5, 2.0])
def test_ground_is_weaker_near_a_print_in_all_directions(over_radius):
    r = over_radius * GROUND.radius
    expected = 1 - GROUND.weakening * min(1.0, max(0.0, 1.5 - over_radius))
    for x, y in ((r, 0.0), (-r, 0.0), (0.6 * r, 0.8 * r), (0.6 * r, -0.8 * r)):
        assert share_after_a_print(x, y) == pytest.approx(expected, abs=1e-12)


def test_a_limb_in_the_ground_does_not_meet_its_own_print():
    memory = Memory.undisturbed(1)
    for x in np.linspace(0.0, GROUND.radius, 5):
        shares, memory = meet(GROUND, memory, [foot(x, 0.01)])
        assert shares == 1.0
    assert not len(memory.prints)
    # Farther on, the place where it began is a print, to which it may return.
    far = 2 * GROUND.radius
    shares, memory = meet(GROUND, memory, [foot(far, 0.01)])
    assert shares == 1.0
    shares, memory = meet(GROUND, memory, [foot(0.0, 0.01)])
    assert shares == pytest.approx(1 - GROUND.weakening)


def test_the_mean_is_weighted_by_area_and_depth():
    places = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 0.0]])
    limb = Limb(places, np.array([0.02, 0.01, -0.5]), np.array([1.0, 3.0, 9.0]))
    ground = dataclasses.replace(GROUND, places=(0.0,))
    shares, _ = meet(ground, Memory.undisturbed(1), [limb])
    assert shares[0] == pytest.approx(1 - ground.weakening * 2 / 5)


@pytest.mark.parametrize("name", ["planar", "mujoco"])
def test_without_weakening_walks_are_those_on_other_ground(name):
    """To the last digit, as long as both are computed."""
    with_memory = walked(PrintedGround(0.02, 0.0), name)
    (without,) = engine(name).walk([xplorer()], SHORT)
    rows = with_memory.t <= 1.0
    count = rows.sum()
    np.testing.assert_array_equal(with_memory.t[rows], without.t[:count])
    np.testing.assert_allclose(
        with_memory.pose[rows], without.pose[:count], rtol=1e-12, atol=1e-12
    )
    assert (with_memory.step_strength == 1.0).all()


def test_the_effect_vanishes_in_proportion_to_the_weakening():
    lost = []
    for weakening in (0.02, 0.04):
        lost.append(1 - walked(PrintedGround(0.02, weakening)).step_strength)
    np.testing.assert_allclose(lost[1], 2 * lost[0], rtol=0.05)


@pytest.mark.parametrize("name", ["planar", "mujoco"])
def test_walks_repeat_to_the_last_digit(name):
    first = walked(GROUND, name)
    second = walked(GROUND, name)
    for field in ("pose", "step_length", "step_strength", "prints"):
        np.testing.assert_array_equal(getattr(first, field), getattr(second, field))


def test_numpy_and_compiled_code_agree():
    numerics = dataclasses.replace(SHORT, duration=1.0)
    with preferring("numpy"):
        by_numpy = walked(GROUND, numerics=numerics)
    compiled = walked(GROUND, numerics=numerics)
    np.testing.assert_allclose(by_numpy.pose, compiled.pose, atol=1e-6)


@pytest.mark.parametrize("name", ["planar", "mujoco"])
def test_a_second_walk_meets_the_prints_of_the_first(name):
    """On weaker ground from its first step on."""
    first = walked(GROUND, name)
    x = tuple(np.unique(first.prints[:, 0].round(3)))
    second = walked(dataclasses.replace(GROUND, places=x), name)
    assert second.step_strength[0] < 0.75 < first.step_strength[0]
    assert second.step_length.sum() < 0.95 * first.step_length.sum()
    again = walked(dataclasses.replace(GROUND, places=x), name)
    np.testing.assert_array_equal(again.pose, second.pose)


def test_both_engines_take_the_same_law():
    numerics = Fineness(steps=64, elements=16, duration=3.0)
    planar = walked(GROUND, "planar", numerics)
    spatial = walked(GROUND, "mujoco", numerics)
    assert planar.speed == pytest.approx(spatial.speed, rel=0.03)
    np.testing.assert_allclose(planar.step_strength, spatial.step_strength, atol=0.03)


def test_weaker_ground_slows_a_walk_down():
    lengths = [
        walked(PrintedGround(0.02, weakening)).step_length.sum()
        for weakening in (0.0, 0.3, 0.6, 0.9)
    ]
    assert (np.diff(lengths) < 0).all()


def test_prints_keep_to_the_tracks_of_the_legs():
    robot = XPLORER.robot
    y = np.abs(walked(GROUND).prints[:, 1])
    nearest = np.abs(y[:, None] - robot.sides).min(1)
    assert nearest.max() < robot.legs.width / 2


def test_a_scene_reports_its_steps():
    effects = (GROUND, Aeration(0.05, 0.25))
    scene = dataclasses.replace(XPLORER, effects=effects, numerics=SHORT)
    run = walking.run(scene)
    found = {v.name: v for v in walking.variables(scene, run)}
    steps = found["step_length"].values
    assert len(steps) == 4
    assert steps.sum() == pytest.approx(found["x"].values[-1], abs=1e-9)
    assert not run.walk.periodic
    assert found["speed"].error > 0
    assert "step_length" not in [
        v.name for v in walking.variables(XPLORER, walking.run(XPLORER))
    ]


def test_refused():
    with pytest.raises(ValueError, match="twice"):
        xplorer(GROUND, GROUND)
    with pytest.raises(ValueError, match="PrintedGround"):
        xplorer(DisturbedGround((0.0,), 0.02, 0.5))
    with pytest.raises(ValueError, match="places"):
        PrintedGround(0.02, 0.5, places=(2000.0,))
