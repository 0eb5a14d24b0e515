"""Robots of MJCF files, and the engine of three dimensions from the command line."""

import dataclasses
import os
import pickle

import numpy as np
import pytest

from geomech import scenes
from geomech.studies.terradynamics import walking
from rft.core.refusal import Refusal
from rft.terradynamics.meshes import Spatial
from rft.terradynamics.meshes.forces.contact import faces
from rft.terradynamics.walking import Fineness, Mjcf, Tripod, Walker

mujoco = pytest.importorskip(
    "mujoco", reason="needs the extra: pip install 'geomech[mujoco]'"
)
pytestmark = pytest.mark.usefixtures("fastest")
from rft.terradynamics.walking.mujoco_walk import Simulation  # noqa: E402
from rft.terradynamics.walking.spatial import geoms  # noqa: E402
from rft.terradynamics.walking.spatial.machine import Clock, build_machine  # noqa: E402

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
    assert scene.engine == "mujoco" and scene.files == (scene.robot.mjcf,)
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
    pose = data.xmat[[2]].reshape(1, 3, 3), data.xpos[[2]]
    assert course.body.facets.heights(*pose).min() == pytest.approx(0.0)


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
    assert 3.0 < len(half.faces) / len(mesh.faces) < 5.0
    surface = geoms.surface(model, 0, mesh)
    f = faces(surface.corners, surface.normals)
    closed = np.array([f.nx, f.ny, f.nz]) @ f.area
    np.testing.assert_allclose(closed, 0.0, atol=1e-3 * f.area.sum())
    if not size:
        corners = surface.corners.reshape(-1, 3)
        np.testing.assert_allclose(corners.min(0), [0.1, 0.2, 0.27], atol=1e-6)
        np.testing.assert_allclose(corners.max(0), [0.2, 0.22, 0.3], atol=1e-6)
        return
    np.testing.assert_allclose(np.ptp(mesh.vertices, axis=0), size, rtol=0.03)
    middles = surface.corners.mean(1)
    middle = f.area @ middles / f.area.sum()
    np.testing.assert_allclose(middle, [0.1, 0.2, 0.3], atol=1e-6)


WRONG = {
    "parts/cart.xml": ("parts/none.xml", "there is no MJCF file"),
    '"parts/cart.xml"': ('"parts"', "no ordinary file"),
    '"fl", "fr"': ('"fl", "zz"', "has no geom 'zz': it has floor, trunk, fl"),
    '["fl", "fr", "rl", "rr", "trunk"]': ("[]", "a robot without legs"),
    '"trunk"]': ('"floor"]', "fixed to the world"),
    '"rr", "trunk"]': ('"rr", "rr"]', "names one twice"),
    '"rr", "trunk"': ('"rr", "trunc"', "has no geom 'trunc': did you mean 'trunk'?"),
    "[gait]": ('actuators = ["zz"]\n[gait]', "has no actuator 'zz': it has fl, fr"),
    "frequency = 1.0": ("frequency = 0", "frequency must be"),
    "\n[gait]": ("phases = [0.5]\n[gait]", "phases must be 4 numbers"),
    "geoms": ("goems", "'goems' is unknown: did you mean 'geoms'"),
    "mjcf =": ('kind = "rhex"\nmjcf =', "mjcf a file; drop one"),
    "grazing_deg = 5": ('law = "2d"', "law: '2d' is unknown: did you mean '3d'"),
    "mjcf": ("legs = 3\nmjcf", "key: 'legs' is unknown"),
    "steps = 8": ('engine = "planar"', "use --engine mujoco"),
}


def assert_refused(ended, said):
    code, out, err = ended
    assert (code, out) == (2, "")
    assert err.count("\n") == 1 and err.startswith("error: ") and said in err, err


@pytest.mark.parametrize("right", WRONG)
def test_what_makes_no_machine_is_refused_with_one_line(right, cart, geomech):
    wrong, said = WRONG[right]
    (cart / "bad.toml").write_text(SCENE.replace(right, wrong, 1))
    assert_refused(geomech("walk", "bad.toml"), said)


@pytest.mark.parametrize("field", ["mjcf", "geoms", "actuators", "phases"])
def test_no_machine_takes_a_wrong_type(field, cart):
    robot = Mjcf(str(cart / "parts" / "cart.xml"), NAMES)
    wrong = [3, True, {"a": 1}, (1j,), (float("nan"),) * 4, [["fl"]], np.zeros(3), "fl"]
    for value in (*wrong, ("a\0b",), np.eye(2)):
        with pytest.raises(ValueError, match="^.+$"):
            dataclasses.replace(robot, **{field: value})


FILES = {
    "no MJCF that MuJoCo reads": "<mujoco><worl",
    "has no actuators": CART[: CART.index("<actuator>")] + "</mujoco>",
    "no actuator can follow the clock": CART.replace("<position", "<motor").replace(
        ' kp="40" kv="0.4"', ""
    ),
    "it has no joints": '<mujoco><worldbody><body><geom name="fl" size="1"/></body></worldbody></mujoco>',
    "gravity must be along -z": CART.replace("0 0 -9.81", "0 -9.81 0"),
    "the actuator 'fl' has a ctrlrange": CART.replace(
        'kv="0.4"', 'kv="0.4" ctrlrange="-1 1"'
    ),
    "state of their own": CART.replace(
        "</actuator>", '<general joint="fl" dyntype="filter" dynprm="0.1"/></actuator>'
    ),
    "nan or inf in body_pos, keyframe qpos": CART.replace(
        'pos="0 0 0.4"', 'pos="0 0 nan"'
    ).replace(
        "</mujoco>",
        '<keyframe><key qpos="0 0 nan 1 0 0 0 0 0 0 0"/></keyframe></mujoco>',
    ),
    "the actuator 'fl' cannot follow the clock: make it <position> or": CART.replace(
        "<position", "<motor"
    ).replace(' kp="40" kv="0.4"', ""),
    "larger than 20 MB": " " * 20_000_001,
}


@pytest.mark.parametrize("said", FILES)
def test_files_that_are_no_robot_are_refused_with_one_line(said, cart, geomech):
    (cart / "parts" / "cart.xml").write_text(FILES[said])
    (cart / "named.toml").write_text(
        SCENE.replace("[gait]", 'actuators = ["fl"]\n[gait]')
    )
    scene = "named.toml" if said.startswith("the actuator 'fl' cannot") else "cart.toml"
    assert_refused(geomech("walk", scene), said)


def test_a_sweep_over_robots_that_its_engine_does_not_take_is_refused(cart):
    (cart / "bad.toml").write_text(SCENE.replace("steps = 8", 'engine = "planar"', 1))
    with pytest.raises(ValueError, match="use engine mujoco"):
        walking.Walks().grid(
            scenes.load(cart / "bad.toml"), {"gait.frequency": [1.0, 2.0]}
        )


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
        "99,980,001 geoms or copies, more than 20,000: give <replicate> a smaller",
    ),
    "hfield": (
        '<asset><hfield name="h" nrow="90000" ncol="90000" size="1 1 1 1"/></asset>',
        "height fields have 8,100,000,000 nodes, more than",
    ),
    "pipe": ('<include file="pipe"/>', "pipe is no ordinary file"),
    "circle": ('<include file="cart.xml"/>', "cart.xml is included too deep"),
}


@pytest.mark.parametrize("name", HUGE)
def test_what_would_keep_mujoco_busy_is_refused_beforehand(name, cart):
    inner, message = HUGE[name]
    os.mkfifo(cart / "parts" / "pipe")
    file = cart / "parts" / "cart.xml"
    file.write_text(f"<mujoco>{inner}</mujoco>")
    with pytest.raises(ValueError, match=message):
        Mjcf(str(file), NAMES)


def test_machines_that_may_take_long_say_so_before_they_walk(cart, geomech):
    text = SCENE.replace("steps = 8", "steps = 32")
    (cart / "long.toml").write_text(text.replace("duration = 1.0", "duration = 1000.0"))
    assert_refused(geomech("walk", "long.toml"), "say --yes")


def test_a_machine_written_is_the_machine_read(cart):
    scene = scenes.load(cart / "cart.toml")
    named = SCENE.replace("[robot]", '[robot]\nkind = "mjcf"')
    assert scenes.parse(named, scene.name) == scene
    anew = dataclasses.replace(scene, text="", medium=Spatial(2e5, tension="keep"))
    text = scenes.toml(anew)
    assert scenes.parse(text, scene.name) == anew and "digest" not in text
    copied = pickle.loads(pickle.dumps(anew.robot))
    assert copied == anew.robot and copied.geom_numbers.tolist() == [2, 3, 4, 5, 1]
    law = SCENE.replace("grazing_deg = 5", 'law = "3d"\nzeta = 2.0')
    assert scenes.parse(law, scene.name).medium.xi_n > 1e5
    (cart / "parts" / "cart.xml").write_text(CART.replace("0.01", "0.011"))
    assert scenes.load(cart / "cart.toml").robot != scene.robot


def test_pictures_are_those_of_a_gl_or_none(cart):
    scene = scenes.load(cart / "cart.toml")
    view = walking.view(scene)
    states = np.tile(build_machine(scene.robot, 10).model.qpos0, (2, 1))
    states[:, 2] = 0.03
    assert view.triangles(states[0])[..., 2].min() == pytest.approx(0.0, abs=0.002)
    pictures = view.pictures(states, 160, 120)
    if pictures is None:
        pytest.skip("no GL here: set MUJOCO_GL to egl or osmesa where there is one")
    pictures = np.array([*pictures])
    assert pictures.shape == (2, 120, 160, 3) and pictures[0].std() > 5


def test_the_clock_of_a_robot_of_the_plane_is_that_of_its_tripods():
    built = build_machine(scenes.load("xplorer").robot, 6)
    names = [built.model.actuator(k).name for k in built.driven]
    assert names == [f"leg{k}" for k in range(6)]
    angles = Clock(built, WALK).actuator_motion(0.0, 1e-9)[0]
    np.testing.assert_allclose(angles[[1, 2, 5]] - angles[[0, 3, 4]], np.pi)


def test_machines_without_surfaces_are_refused():
    from rft.terradynamics.walking.spatial.facets import Facets

    with pytest.raises(Refusal, match="no geoms that touch the ground"):
        Facets([])
