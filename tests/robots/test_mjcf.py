"""Robots of MJCF files in the engine of three dimensions."""

import dataclasses
import os
import pickle

import numpy as np
import pytest
from refusals import refuses

from geomech import scenes
from rft.core.notes import Note
from rft.terradynamics.meshes import Spatial
from rft.terradynamics.walking import Fineness, Mjcf, Tripod, Walker

mujoco = pytest.importorskip(
    "mujoco", reason="needs the extra: pip install 'geomech[mujoco]'"
)
pytestmark = pytest.mark.usefixtures("fastest")
from rft.mujoco import attach  # noqa: E402
from rft.terradynamics.meshes.geoms import geom_name  # noqa: E402
from rft.terradynamics.walking.mujoco_walk import Simulation  # noqa: E402
from rft.terradynamics.walking.spatial import geoms  # noqa: E402

ACTUATOR = '<position name="{0}" joint="{0}" kp="40" kv="0.4"/>'
NAMES = ("fl", "fr", "rl", "rr")
WHEEL = """<body pos="{1} {2} 0"><joint name="{0}" axis="0 1 0"/>
<geom name="{0}" type="cylinder" size="0.03 0.01" euler="90 0 0"/></body>"""
CART = """<mujoco><option gravity="0 0 -9.81"/><default><geom density="250"/></default><worldbody>
<geom name="floor" type="plane" size="3 3 1"/>
<body name="trunk" pos="0 0 0.4"><freejoint/><geom name="trunk" type="box" size="0.06 0.03 0.01"/>{}
</body></worldbody><actuator>{}</actuator></mujoco>""".format(
    "".join(
        WHEEL.format(n, 0.05 if n[0] == "f" else -0.05, 0.05 if n[1] == "l" else -0.05)
        for n in NAMES
    ),
    "".join(map(ACTUATOR.format, NAMES)),
)
SCENE = """[medium]
name = "poppy-seeds-loose"
grazing_deg = 5

[robot]
mjcf = "parts/cart.xml"
geoms = ["fl", "fr", "rl", "rr", "trunk"]

[gait]
frequency = 1.0

[numerics]
steps = 8
elements = 8
duration = 1.0
"""


@pytest.fixture
def cart(tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "cart.xml").write_text(CART)
    (tmp_path / "cart.toml").write_text(SCENE)
    return tmp_path


@pytest.mark.parametrize(
    ("edits", "speed", "rel"),
    [
        ({'kp="40"': 'gear="-1" kp="40"'}, -1.0, 1e-3),
        ({"<position": "<velocity", ' kp="40"': ""}, 1.0, 0.03),
    ],
)
def test_a_cart_rolls_ahead_and_with_its_gears_reversed_back(edits, speed, rel, cart):
    """Its wheels in step, by their places or speeds, on seeds, not on its own floor."""
    scene = scenes.load(cart / "cart.toml")
    text = CART
    for old, new in edits.items():
        text = text.replace(old, new)
    (cart / "other.xml").write_text(text)
    numerics = dataclasses.replace(scene.numerics, elements=12)
    ahead = Simulation(scene.walker, numerics).walk(2)
    robot = dataclasses.replace(scene.robot, mjcf=str(cart / "other.xml"))
    other = dataclasses.replace(scene.walker, robot=robot)
    found = Simulation(other, numerics).walk(2)
    assert ahead.status == "walking" and 0.09 < ahead.speed < 2 * np.pi * 0.03
    assert ahead.pose[-1, 1] < 0.03 and np.abs(ahead.spatial["y"]).max() < 1e-3
    assert found.speed == pytest.approx(speed * ahead.speed, rel=rel)


KEY = """<keyframe><key qpos="0 0 9 1 0 0 0 0 0.4 0 0" ctrl="1 2 3 4"/></keyframe>
</mujoco>"""
WALK = Tripod(2.0, 0.3, 1.0)


def test_the_clock_drives_what_it_is_told_to_and_the_rest_keeps_its_keyframe(cart):
    text = CART.replace('name="fl" joint', 'name="fl" gear="2" joint')
    (cart / "key.xml").write_text(text.replace("</mujoco>", KEY))
    robot = Mjcf(str(cart / "key.xml"), ("fl",), ("rr", "fl"), (0.25, 0.5))
    volume = 0.12 * 0.06 * 0.02 + 4 * np.pi * 0.03**2 * 0.02
    assert robot.mass == pytest.approx(250 * volume)
    course = Simulation(Walker(robot, WALK, Spatial(3e5)), Fineness(steps=8))
    clock = course.clock
    angle, rate = clock.actuator_motion(0.1, 0.1)
    driven = angle + 0.01 * rate
    np.testing.assert_allclose(clock(0.1, 0.1), [driven[1], 2.0, 3.0, driven[0]])
    np.testing.assert_allclose(clock.kinks(), [0.0, 0.35, 0.6, 0.65, 0.9, 1.0])
    data = course.body.data
    start = clock.actuator_motion(0.0, 1e-9)[0]
    np.testing.assert_allclose(data.qpos[7:], [start[1] / 2, 0.4, 0.0, start[0]])


@pytest.mark.parametrize(
    ("kind", "volume", "size"),
    [
        ('"sphere" size="0.03"', 4 / 3 * np.pi * 0.03**3, (0.06,) * 3),
        ('"ellipsoid" size="0.01 0.02 0.03"', 8e-6 * np.pi, (0.02, 0.04, 0.06)),
        ('"capsule" size="0.01 0.03"', 22e-6 / 3 * np.pi, (0.02, 0.02, 0.08)),
        ('"cylinder" size="0.01 0.03"', np.pi * 6e-6, (0.02, 0.02, 0.06)),
        ('"box" size="0.01 0.02 0.03"', 4.8e-5, (0.02, 0.04, 0.06)),
        ('"mesh" mesh="wedge"', 1e-5, ()),
    ],
)
def test_geoms_become_triangles_of_their_size(kind, volume, size):
    asset = '<asset><mesh name="wedge" vertex="0 0 0 .03 0 0 0 .02 0 0 0 .1"/></asset>'
    geom = f'<geom name="g" type={kind} pos="0.1 0.2 0.3" euler="0 90 0"/>'
    world = f"<worldbody><body><freejoint/>{geom}</body></worldbody>"
    model = mujoco.MjModel.from_xml_string(f"<mujoco>{asset}{world}</mujoco>")
    mesh = geoms.geom_mesh(model, 0)
    half = geoms.geom_mesh(model, 0, 24)
    assert [mesh.volume, half.volume] == pytest.approx([volume] * 2, rel=1e-6)
    surface = geoms.surface(model, 0, mesh)
    if not size:
        corners = surface.corners.reshape(-1, 3)
        np.testing.assert_allclose(corners.min(0), [0.1, 0.2, 0.27], atol=1e-6)
        np.testing.assert_allclose(corners.max(0), [0.2, 0.22, 0.3], atol=1e-6)
        return
    np.testing.assert_allclose(np.ptp(mesh.vertices, axis=0), size, rtol=0.03)
    corners = surface.corners.reshape(-1, 3)
    middle = (corners.min(0) + corners.max(0)) / 2
    np.testing.assert_allclose(middle, [0.1, 0.2, 0.3], atol=1e-3)


def test_patterns_and_bodies_mean_the_geoms_that_they_mean_to_attach(cart):
    """Also geoms without a name; a pattern leaves out what touches nothing, with a
    note, and a robot that is read again has the same geoms."""
    shown = '<geom name="fshow" type="sphere" size="0.01" contype="0" conaffinity="0"/>'
    text = CART.replace("</body></worldbody>", f"{shown}</body></worldbody>")
    text = text.replace('<geom name="rr" ', "<geom ")
    text = text.replace(
        '<body pos="-0.05 -0.05 0"', '<body name="back_rr" pos="-0.05 -0.05 0"'
    )
    file = cart / "parts" / "cart.xml"
    file.write_text(text)
    scene = SCENE.replace(
        '"fl", "fr", "rl", "rr", "trunk"', '"f*", "rl", "back_*", "rl"'
    )
    with pytest.raises(ValueError, match="geoms lists a name twice"):
        scenes.parse(scene, str(cart / "cart.toml"))
    (cart / "cart.toml").write_text(scene.replace(', "rl"]', "]"))
    with pytest.warns(Note, match="'fshow', which touches nothing"):
        robot = scenes.load(cart / "cart.toml").robot
    model = mujoco.MjModel.from_xml_path(str(file))
    with pytest.warns(Note), attach(model, "poppy-seeds-loose", robot.geoms) as sand:
        names = sand.geoms
    found = [geom_name(model, geom) for geom in robot.geom_numbers]
    assert tuple(found) == names and len(names) == 4
    assert len(robot.surfaces(8)) == 4
    again = pickle.loads(pickle.dumps(robot))
    np.testing.assert_array_equal(again.geom_numbers, robot.geom_numbers)
    with pytest.raises(ValueError, match="has no geom 'leg_.'") as refused:
        Mjcf(str(file), ("leg_*",))
    assert str(refused.value).startswith(str(file))


def test_a_machine_is_known_by_what_it_includes_too(cart):
    file = cart / "parts" / "cart.xml"
    file.write_text('<mujoco><include file="whole.xml"/></mujoco>')
    whole = cart / "parts" / "whole.xml"
    whole.write_text(CART)
    one = Mjcf(str(file), NAMES)
    same = Mjcf(str(file), NAMES)
    whole.write_text(CART.replace("0.06 0.03 0.01", "0.05 0.03 0.01"))
    assert one == same and dataclasses.replace(one) != one


HUGE = {
    "replicate": (
        '<worldbody><replicate count="9999"><replicate count="9999"><geom size="1"/>'
        "</replicate></replicate></worldbody>",
        "99,980,001 20,000 <replicate> | where instead",
    ),
    "hfield": (
        '<asset><hfield name="h" nrow="90000" ncol="90000" size="1 1 1 1"/></asset>',
        "8,100,000,000 nodes | where",
    ),
    "pipe": ('<include file="pipe"/>', "pipe file | where"),
    "circle": ('<include file="cart.xml"/>', "cart.xml included | where"),
}


@pytest.mark.parametrize("name", HUGE)
def test_what_would_keep_mujoco_busy_is_refused_beforehand(name, cart):
    inner, said = HUGE[name]
    os.mkfifo(cart / "parts" / "pipe")
    file = cart / "parts" / "cart.xml"
    file.write_text(f"<mujoco>{inner}</mujoco>")
    with refuses(said):
        Mjcf(str(file), NAMES)


def test_a_machine_written_is_the_machine_read(cart):
    scene = scenes.load(cart / "cart.toml")
    named = SCENE.replace("[robot]", '[robot]\nkind = "mjcf"')
    assert scenes.parse(named, scene.name) == scene
    anew = dataclasses.replace(scene, text="", medium=Spatial(2e5, tension="keep"))
    text = scenes.toml(anew)
    assert scenes.parse(text, scene.name) == anew and "digest" not in text
    assert pickle.loads(pickle.dumps(anew.robot)) == anew.robot
    (cart / "parts" / "cart.xml").write_text(CART.replace("0.01", "0.011"))
    assert scenes.load(cart / "cart.toml").robot != scene.robot
