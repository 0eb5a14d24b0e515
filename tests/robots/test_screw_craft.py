"""Craft on screws as scenes and by MuJoCo, against their balance in the mean over a
turn."""

import dataclasses
import tomllib

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from geomech import scenes
from geomech.studies.grid import with_parameter
from rft.terradynamics.meshes import Spatial
from rft.terradynamics.plates import StressMap
from rft.terradynamics.walking import Fineness, Screws, Tripod, Walker, cruise
from rft.terradynamics.walking.craft import PER_SQUARE

pytestmark = pytest.mark.usefixtures("fastest")

SCENE = scenes.load("screws")
SMALL = SCENE.text.replace("steps = 16 ", "elements = 4\nduration = 1\nsteps = 8 ")
COARSE = Fineness(steps=8, elements=4)


def test_the_scene_is_the_craft_it_says():
    assert isinstance(SCENE.robot, Screws) and SCENE.engine == "mujoco"
    strength = 1500 * 9.81 * (894 / 8 - 386 / 4 + 89 / 2)
    assert SCENE.medium.xi_n == pytest.approx(strength)
    robot = dataclasses.replace(SCENE.robot, pair="alike")
    other = dataclasses.replace(SCENE, robot=robot, text="")
    assert scenes.parse(scenes.toml(other), SCENE.name) == other


@pytest.mark.parametrize(
    ("law", "kind"), [("", Spatial), ('law = "planar"\n', StressMap)]
)
def test_a_craft_is_in_a_law_of_three_dimensions_where_none_is_named(law, kind):
    text = SCENE.text.replace("internal_f", "# ").replace("surface_f", "# ")
    named = f'{law}name = "poppy-seeds-loose" # '
    medium = scenes.parse(text.replace("density = 1500 ", named)).medium
    assert isinstance(medium, kind)
    assert law or medium.xi_n == pytest.approx(2.9e5, rel=0.01)


@pytest.mark.parametrize("pair", ["mirrored", "alike"])
def test_mujoco_goes_on_as_the_balance_says(pair):
    """From the pose and velocity of the balance, a turn to settle, one to look at.
    Alike, the craft is so heavy that it screws forwards and does not roll aside."""
    pytest.importorskip("mujoco")
    from rft.terradynamics.walking.mujoco_walk import ROW, Simulation

    robot = dataclasses.replace(SCENE.robot, mass=2.5, pair=pair)
    steady = cruise(SCENE.medium, robot, 0.7, PER_SQUARE * COARSE.elements**2, 8)
    assert steady.residual < 1e-5 and 0.1 < steady.slip < 0.6
    course = Simulation(Walker(robot, Tripod(0.7), SCENE.medium), COARSE)
    turn = np.roll(Rotation.from_euler("xy", [steady.roll, steady.pitch]).as_quat(), 1)
    data = course.body.data
    data.qpos[:7] = [0, 0, steady.height, *turn]
    data.qvel[:6] = [*steady.velocity, 0, 0, 0, steady.yaw_rate]
    rows = []
    for k in range(2):
        assert course.stride(k, rows, []) == ""
    before = dict(zip(ROW, rows[7]))
    after = dict(zip(ROW, rows[15]))
    assert after["t"] - before["t"] == pytest.approx(1 / 0.7)
    way = complex(after["x"] - before["x"], after["y"] - before["y"])
    way *= 0.7 * np.exp(-1j * (before["yaw"] + steady.yaw_rate / 1.4))
    assert way.real == pytest.approx(steady.velocity[0], rel=0.03)
    assert after["z"] == pytest.approx(steady.height, abs=0.1 * robot.screw.radius)
    if pair == "alike":
        assert way.imag == pytest.approx(steady.velocity[1], rel=0.25)
        assert steady.velocity[1] < -0.1 * way.real
    else:
        assert abs(way.imag) < 1e-6 * way.real and abs(after["yaw"]) < 1e-6


def test_sizes_of_screws_are_swept():
    tables = with_parameter(tomllib.loads(SMALL), "robot.screw.pitch", 0.04)
    robot = scenes.from_tables(with_parameter(tables, "robot.track", 0.2)).robot
    assert (robot.screw.pitch, robot.screw.core, robot.track) == (0.04, 0.02, 0.2)
