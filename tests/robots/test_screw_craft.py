"""Craft on screws as scenes and by MuJoCo, against their balance in the mean over a
turn."""

import dataclasses
import re
import tomllib

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tabled import of_json

from geomech import scenes
from geomech.studies.grid import with_parameter
from rft.core.refusal import Refusal
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
    for scene in (SCENE, dataclasses.replace(SCENE, robot=robot, text="")):
        assert scenes.parse(scenes.toml(scene), scene.name) == scene


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


def test_a_craft_walks_as_a_command(geomech, tmp_path):
    """A walk of a second, which has not settled yet."""
    pytest.importorskip("mujoco")
    (tmp_path / "small.toml").write_text(SMALL)
    (tmp_path / "out").mkdir()
    asked = ("walk", "small.toml", "--engine", "mujoco", "--json", "-o", "out")
    code, out, err = geomech(*asked)
    assert (code, err) == (0, "")
    found = of_json(out)
    assert str(found["status"].values) == "walking"
    assert 0.3 < float(found["speed"]) / SCENE.robot.screw.pitch < 0.9
    table = np.genfromtxt(tmp_path / "out" / "walk.csv", delimiter=",", names=True)
    assert np.abs(table["y"]).max() < 1e-6 and np.isfinite(table["pitch"]).all()
    assert table["t"][-1] == pytest.approx(1.0)
    told = "small.toml: the planar engine knows no Screws robot: use --engine mujoco"
    assert told in geomech("walk", "small.toml", "--engine", "planar")[2]


SCREW = SMALL[SMALL.index("[robot.screw]") : SMALL.index("[gait]")]
WRONG = {
    "core = 0.02": ("core = 0.03", "[robot.screw] core must be less than the radius, got 0.03 and 0.03"),
    "pitch = 0.06 ": ("pitch = 0 ", "[robot.screw] pitch must be a number from 1e-06 to 10 m, got 0"),
    "thickness = 0.004 ": ("thickness = 0.07 ", "thickness must be 0, or from a thousandth of the pitch to less than that"),
    'handed = "right"': ('handed = "rigth"', "handed must be one of right, left, got 'rigth'"),
    "radius = 0.03 ": ("radius = nan ", "radius must be"),
    "track = 0.12 ": ("track = 0.05 ", "screws of radius 0.03 m meet: track must be more than 0.06 m"),
    'pair = "mirrored" ': ('pair = "twin" ', "pair must be one of mirrored, alike, got 'twin'"),
    "mass = 1.0 ": ("mass = 0 ", "mass must be a number"), "drop = 0.055 ": ("drop = inf ", "drop must be"),
    "length = 0.2 ": ("lenght = 0.2 ", "did you mean 'length'"),
    "height = 0.04": ("", "[robot] has no `height`: add height = ..., in m"),
    "nose = 0.03 ": ('kind = "sphere"\nnose = 0.03 ', "[robot.screw] kind: 'sphere' is unknown"),
    "frequency = 1.0 ": ("frequency = 0 ", "frequency must be a number from 0.001 to 200"),
    "density = 1500 ": ("density = -1 ", "density must be"),
    SCREW: ("", "[robot] the table [robot.screw] is missing: add it"),
}  # fmt: skip


@pytest.mark.parametrize("right", WRONG)
def test_what_makes_no_craft_is_refused_with_one_line(right):
    wrong, said = WRONG[right]
    with pytest.raises(Refusal, match=f"^small.*{re.escape(said)}.*$"):
        scenes.parse(SMALL.replace(right, wrong, 1), "small")


def test_sizes_of_screws_are_swept():
    tables = with_parameter(tomllib.loads(SMALL), "robot.screw.pitch", 0.04)
    robot = scenes.from_tables(with_parameter(tables, "robot.track", 0.2)).robot
    assert (robot.screw.pitch, robot.screw.core, robot.track) == (0.04, 0.02, 0.2)
    for wrong in ("robot.legs.width", "robot.mass.kg"):
        with pytest.raises(Refusal, match="name a parameter such as"):
            with_parameter(tables, wrong, 1.0)
