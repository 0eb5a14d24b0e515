"""Craft on screws as scenes and by MuJoCo, against their balance in the mean over a turn."""

import dataclasses
import tomllib
import types

import numpy as np
import pytest
from artists import curve, curves, drawn
from scipy.spatial.transform import Rotation
from tabled import of_json, of_swept

from geomech import plots, scenes
from geomech.studies.grid import with_parameter
from rft.core.refusal import Refusal
from rft.terradynamics.plates import StressMap
from rft.terradynamics.walking import Fineness, Screws, Tripod, Walker, cruise
from rft.terradynamics.walking.craft import PER_SQUARE

pytestmark = pytest.mark.usefixtures("fastest")

SCENE = scenes.load("screws")
SMALL = SCENE.text.replace("steps = 16 ", "elements = 4\nduration = 1\nsteps = 8 ")
COARSE = Fineness(steps=8, elements=4)


def test_the_scene_is_the_craft_it_says():
    assert (
        isinstance(SCENE.robot, Screws)
        and SCENE.engine == "mujoco"
        and SCENE.robot.screw.thickness == 0.004
    )
    assert SCENE.medium.xi_n == pytest.approx(
        1500 * 9.81 * (894 / 8 - 386 / 4 + 89 / 2)
    )
    alike = dataclasses.replace(
        SCENE, robot=dataclasses.replace(SCENE.robot, pair="alike"), text=""
    )
    for scene in (SCENE, alike):
        assert scenes.parse(scenes.toml(scene), scene.name) == scene
    poppy = (
        SCENE.text.replace("density = 1500 ", 'name = "poppy-seeds-loose" # ')
        .replace("internal_f", "# ")
        .replace("surface_f", "# ")
    )
    named = scenes.parse(poppy)
    assert named.medium.xi_n == pytest.approx(
        2.9e5, rel=0.01
    )  # by the law of three dimensions where none is named
    flat = scenes.parse(poppy.replace('name = "poppy', 'law = "planar"\nname = "poppy'))
    assert isinstance(flat.medium, StressMap)


@pytest.mark.parametrize("pair", ["mirrored", "alike"])
def test_mujoco_goes_on_as_the_balance_says(pair):
    """From the pose and velocity of the balance, a turn to settle, one to look at. Alike, the craft is so heavy that it
    screws forwards and does not roll aside."""
    pytest.importorskip("mujoco")
    from rft.terradynamics.walking.mujoco_walk import Simulation, Start

    robot = dataclasses.replace(SCENE.robot, mass=2.5, pair=pair)
    steady = cruise(SCENE.medium, robot, 0.7, PER_SQUARE * COARSE.elements**2, 8)
    assert steady.residual < 1e-5 and 0.1 < steady.slip < 0.6
    course = Simulation(Walker(robot, Tripod(0.7), SCENE.medium), COARSE)
    turn = np.roll(Rotation.from_euler("xy", [steady.roll, steady.pitch]).as_quat(), 1)
    qpos, qvel = course.body.data.qpos.copy(), course.body.data.qvel.copy()
    qpos[:7], qvel[:6] = (
        [0, 0, steady.height, *turn],
        [*steady.velocity, 0, 0, 0, steady.yaw_rate],
    )
    rows, states = [], []
    course.body.data.qpos[:], course.body.data.qvel[:] = Start(qpos, qvel)
    for k in range(2):
        assert course.stride(k, rows, states) == ""
    before, after = (
        dict(zip(("t", "x", "z", "pitch"), rows[k][:4]))
        | {"y": rows[k][10], "yaw": rows[k][12]}
        for k in (7, 15)
    )
    time, yaw = after["t"] - before["t"], before["yaw"] + steady.yaw_rate / 1.4
    way = np.array([after["x"] - before["x"], after["y"] - before["y"]]) / time
    ahead, aside = way @ [np.cos(yaw), np.sin(yaw)], way @ [-np.sin(yaw), np.cos(yaw)]
    assert time == pytest.approx(1 / 0.7) and ahead == pytest.approx(
        steady.velocity[0], rel=0.03
    )
    assert after["z"] == pytest.approx(steady.height, abs=0.1 * robot.screw.radius)
    if pair == "alike":
        assert (
            aside == pytest.approx(steady.velocity[1], rel=0.25)
            and steady.velocity[1] < -0.1 * ahead
        )
    else:
        assert abs(aside) < 1e-6 * ahead and abs(after["yaw"]) < 1e-6


def test_a_craft_walks_as_a_command(geomech, tmp_path, monkeypatch):
    """Few strides: of a walk that has not settled yet, whose speed is that of the last ones."""
    pytest.importorskip("mujoco")
    from rft.terradynamics.walking import mujoco_walk

    monkeypatch.setattr(mujoco_walk, "MOST_STRIDES", 1)
    monkeypatch.setattr(mujoco_walk, "STRIDES_NEAR_LIMIT", 1)
    (tmp_path / "small.toml").write_text(SMALL)
    (tmp_path / "out").mkdir()
    code, out, err = geomech(
        "walk", "small.toml", "--engine", "mujoco", "--json", "-o", "out"
    )
    assert (code, err) == (0, "")
    found = of_json(out)
    assert str(found["status"].values) == "walking"
    assert 0.5 < float(found["speed"]) / SCENE.robot.screw.pitch < 0.9
    table = np.genfromtxt(tmp_path / "out" / "walk.csv", delimiter=",", names=True)
    assert (
        np.abs(table["y"]).max() < 1e-6
        and np.isfinite(table["pitch"]).all()
        and table["t"][-1] == pytest.approx(1.0)
    )
    assert (tmp_path / "out" / "walk.png").is_file()


def test_the_planar_engine_knows_no_screws(geomech, tmp_path):
    (tmp_path / "small.toml").write_text(SMALL)
    code, out, err = geomech("walk", "small.toml", "--engine", "planar")
    assert (
        (code, out)
        == (
            2,
            "",
        )
        and err
        == "error: small.toml: the planar engine knows no Screws robot: use --engine mujoco\n"
    )


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
}  # fmt: skip


@pytest.mark.parametrize("right", WRONG)
def test_what_makes_no_craft_is_refused_with_one_line(right):
    wrong, said = WRONG[right]
    assert right in SMALL
    with pytest.raises(Refusal) as caught:
        scenes.parse(SMALL.replace(right, wrong, 1), "small")
    assert (
        said in str(caught.value)
        and str(caught.value).startswith("small")
        and "\n" not in str(caught.value)
    )


def test_sizes_of_screws_are_swept():
    tables = with_parameter(tomllib.loads(SMALL), "robot.screw.pitch", 0.04)
    assert (
        tables["robot"]["screw"]["pitch"] == 0.04
        and scenes.from_tables(tables).robot.screw.core == 0.02
    )
    assert with_parameter(tables, "robot.track", 0.2)["robot"]["track"] == 0.2
    for wrong in ("robot.legs.width", "robot.mass.kg"):
        with pytest.raises(Refusal, match="name a parameter such as"):
            with_parameter(tables, wrong, 1.0)
    results = {
        "over": {"robot.screw.pitch": [0.04, 0.06]},
        "speed": np.ones(2),
        "estimate": np.zeros(2),
    }
    (ax,) = plots.sweep_figure(
        SCENE, of_swept(results | {"status": np.full(2, "walking")})
    ).axes
    assert ax.get_xlabel() == "pitch (m)"


def test_a_craft_without_screws_is_told_so():
    bare = SMALL[: SMALL.index("[robot.screw]")] + SMALL[SMALL.index("[gait]") :]
    asked = {
        bare: r"\[robot\] the table \[robot.screw\] is missing: add it",
        bare.replace(
            "mass = 1.0", "screw = 3\nmass = 1.0"
        ): r"robot.screw must be a table \[robot.screw\], got int",
    }
    for text, said in asked.items():
        with pytest.raises(Refusal, match=said):
            scenes.parse(text)


def test_the_figure_of_screws_is_drawn(tmp_path, monkeypatch):
    """Of few points and turns."""
    pytest.importorskip("mujoco")
    from figures.terradynamics import screws
    from rft.terradynamics.walking import mujoco_walk

    monkeypatch.setattr(mujoco_walk, "MOST_STRIDES", 1)
    for name, less in (("HEIGHTS", (0.0,)), ("MASSES", (1.0,)), ("PATHS", {})):
        monkeypatch.setattr(screws, name, less)
    numbers = screws.compute(
        3, (0.06,), (0.06,), dataclasses.replace(COARSE, duration=1.0)
    )
    assert numbers["mujoco_advance"] == pytest.approx(
        numbers["advance"][1.0], rel=0.2
    )  # in the first two turns
    assert "by MuJoCo" in screws.table(numbers)
    (vx, vy), rate, time = (0.03, -0.01), 0.4, 4.0
    steady = types.SimpleNamespace(velocity=np.array([vx, vy]), yaw_rate=rate)
    numbers["paths"]["alike", 1.0] = (
        time,
        np.array([0.0, 0.1, 0.2]),
        np.array([0.0, 0.02, 0.01]),
        steady,
    )
    thrust, advance, _, path = drawn(screws, numbers, tmp_path).axes
    np.testing.assert_allclose(
        curve(thrust, "at the surface"),
        [numbers["slip"], numbers["turning"][0.0].thrust],
    )
    np.testing.assert_allclose(
        curve(advance, "1 kg, MuJoCo"),
        1e3 * np.array([[0.06], numbers["mujoco_advance"]]),
    )
    np.testing.assert_allclose(
        curve(path, "alike, 1 kg, 4 s"),
        1e2 * np.array([[0.0, 0.1, 0.2], [0.0, 0.02, 0.01]]),
    )
    sin, cos = (
        np.sin(rate * time),
        np.cos(rate * time),
    )  # a circle: the integral of the velocity as it turns
    end = [(vx * sin - vy * (1 - cos)) / rate, (vx * (1 - cos) + vy * sin) / rate]
    np.testing.assert_allclose(curves(path)[1][-1], 1e2 * np.array(end))
