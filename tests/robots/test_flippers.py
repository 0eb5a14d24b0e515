"""Robots on flippers: their stroke, their model, and how they fail on ground that they
have disturbed."""

import dataclasses
import math

import numpy as np
import pytest

from geomech import scenes
from rft.terradynamics.walking import (
    Fineness,
    Flippers,
    PrintedGround,
    Tripod,
    Walker,
    engine,
)

pytest.importorskip("mujoco")
SCENE = scenes.load("flipper-robot")
ROBOT = SCENE.robot
DISTURBED = SCENE.effects[0]
COARSE = Fineness(steps=16, elements=4)
GAITS = [SCENE.gait, Tripod(1.0, 0.3, 1.0, 0.2), Tripod(1.0, 0.8, 2.0)]


def steps(cycles, *effects, **changes):
    """Return the walk of the robot with other sizes."""
    robot = dataclasses.replace(ROBOT, **changes)
    walker = Walker(robot, SCENE.gait, SCENE.medium, effects)
    (walk,) = engine("mujoco").walk([walker], COARSE, cycles)
    return walk


UNDISTURBED = PrintedGround(DISTURBED.radius, 0.0)


def test_the_scene_is_the_robot_it_says():
    assert isinstance(ROBOT, Flippers) and SCENE.engine == "mujoco"
    other = dataclasses.replace(
        SCENE, robot=dataclasses.replace(ROBOT, wrist="free"), text=""
    )
    assert scenes.parse(scenes.toml(other), SCENE.name) == other


@pytest.mark.parametrize("gait", GAITS)
def test_a_stroke_sweeps_back_below_and_forth_above(gait):
    half = gait.duty / 2
    for phase, angle, height in (
        (0.0, gait.middle, 0.0),
        (-half, gait.middle - gait.sweep / 2, 0.0),
        (half, gait.middle + gait.sweep / 2, 0.0),
        (0.5 - (0.5 - half) / 2, gait.middle + gait.sweep / 2, ROBOT.travel),
        (0.5, gait.middle, ROBOT.travel),
    ):
        for turns in (-1, 0, 3):
            at = phase + turns
            found, _ = ROBOT.stroke(gait, at, at - 1e-9)
            np.testing.assert_allclose(found, [angle, height], atol=1e-12)


@pytest.mark.parametrize("gait", GAITS)
def test_the_rates_of_a_stroke_are_slopes_that_jump_at_its_kinks(gait):
    for phase in np.linspace(-0.7, 1.3, 157):
        distance = np.abs((phase - ROBOT.kinks(gait) + 0.5) % 1.0 - 0.5).min()
        if distance < 1e-4 or abs(phase % 1.0 - 0.5) < 1e-4:
            continue
        before, rates = ROBOT.stroke(gait, phase - 1e-5, phase)
        after, _ = ROBOT.stroke(gait, phase + 1e-5, phase)
        np.testing.assert_allclose((after - before) / 2e-5, rates, atol=1e-6)


@pytest.mark.parametrize("wrist", ["fixed", "free"])
def test_on_undisturbed_ground_steps_are_constant_and_straight(wrist):
    walk = steps(3, UNDISTURBED, wrist=wrist)
    lengths = walk.step_length
    np.testing.assert_allclose(lengths[1:], lengths[-1], rtol=0.02)
    # Without slip the arms would carry the body this far.
    farthest = 2 * ROBOT.arm * math.sin(SCENE.gait.sweep / 2)
    assert 0.5 * farthest < lengths[-1] < farthest
    assert abs(walk.lateral_speed) < 0.01 * walk.speed
    assert np.abs(walk.spatial["yaw"]).max() < 0.01
    assert walk.unsolved == 0
    assert walk.unaccounted < 0.05


def test_a_free_flipper_keeps_its_direction_in_the_ground():
    """While a fixed one turns with its arm."""
    walk = steps(2, UNDISTURBED, wrist="free")
    # Positions: seven of the hull, then arm, lift and wrist of either side.
    arm, lift, wrist = walk.spatial["states"][:, 7:10].T
    is_down = lift < 1e-3
    swept = np.ptp(arm[is_down])
    assert swept == pytest.approx(SCENE.gait.sweep, rel=0.05)
    assert np.ptp((arm + wrist)[is_down]) < 0.35 * swept


def test_deeper_strokes_go_farther():
    shallow, middle, deep = (
        steps(2, UNDISTURBED, depth=depth).step_length[-1]
        for depth in (0.01, 0.02, 0.03)
    )
    assert shallow < 0.5 * middle < 0.5 * deep


def test_on_disturbed_ground_shallow_strokes_fail_within_a_few_steps():
    """And deep ones hold; a trend, the law of weakening is assumed."""
    shallow = steps(4, DISTURBED, depth=0.02).step_length
    deep = steps(4, DISTURBED, depth=0.04).step_length
    assert (shallow[1:] < 0.3 * shallow[0]).all()
    assert (deep[1:] > 0.7 * deep[0]).all()


def test_refused():
    with pytest.raises(ValueError, match="wrist"):
        dataclasses.replace(ROBOT, wrist="loose")
    with pytest.raises(ValueError, match="depth"):
        dataclasses.replace(ROBOT, depth=0.06)
    with pytest.raises(ValueError, match="arm"):
        dataclasses.replace(ROBOT, flipper_width=0.13)
    with pytest.raises(ValueError, match="mujoco"):
        engine("planar").walk([SCENE.walker], COARSE)
