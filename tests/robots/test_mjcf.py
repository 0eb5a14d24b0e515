"""Robots of MJCF files, and the engine of three dimensions from the command line."""

import dataclasses
import os
import pickle
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib import image
from tabled import of_json

import geomech as face
from geomech import scenes
from geomech.core.setting import Setting
from geomech.studies.displacement.sweep import sweep
from geomech.studies.terradynamics import walking
from rft.core.refusal import Refusal
from rft.terradynamics.meshes import Spatial
from rft.terradynamics.meshes.forces.contact import faces
from rft.terradynamics.walking import Fineness, Mjcf, Tripod, Walker, engine

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


def test_a_cart_rolls_ahead_and_with_its_gears_reversed_back(cart, geomech):
    """From a file in another folder; wheels in step, on seeds and not on the MJCF's own floor."""
    scene = scenes.load(cart / "cart.toml")
    assert scene.engine == "mujoco" and scene.files == (
        str(cart / "parts" / "cart.xml"),
    )
    numerics = dataclasses.replace(scene.numerics, elements=12)
    run = lambda robot: Simulation(
        dataclasses.replace(scene.walker, robot=robot), numerics
    ).walk(2)
    ahead = run(scene.robot)
    assert ahead.status == "walking" and 0.09 < ahead.speed < 2 * np.pi * 0.03
    assert ahead.pose[-1, 1] < 0.03 and np.abs(ahead.spatial["y"]).max() < 1e-3
    (cart / "back.xml").write_text(CART.replace('kp="40"', 'gear="-1" kp="40"'))
    back = run(dataclasses.replace(scene.robot, mjcf=str(cart / "back.xml")))
    assert back.speed == pytest.approx(-ahead.speed, rel=1e-3)
    (cart / "driven.xml").write_text(
        CART.replace("<position", "<velocity").replace(' kp="40"', "")
    )
    rolled = run(dataclasses.replace(scene.robot, mjcf=str(cart / "driven.xml")))
    assert rolled.speed == pytest.approx(ahead.speed, rel=0.03)


def test_the_clock_drives_what_it_is_told_to_and_the_rest_keeps_its_keyframe(cart):
    key = '<keyframe><key qpos="0 0 9 1 0 0 0 0 0.4 0 0" ctrl="1 2 3 4"/></keyframe></mujoco>'
    (cart / "key.xml").write_text(
        CART.replace("</mujoco>", key).replace(
            'name="fl" joint', 'name="fl" gear="2" joint'
        )
    )
    robot = Mjcf(str(cart / "key.xml"), ("fl",), ("rr", "fl"), (0.25, 0.5))
    assert robot.mass == pytest.approx(
        250 * (0.12 * 0.06 * 0.02 + 4 * np.pi * 0.03**2 * 0.02)
    )
    course = Simulation(
        Walker(robot, Tripod(2.0, 0.3, 1.0), Spatial(3e5)), Fineness(steps=8)
    )
    clock = course.clock
    angle, rate = clock.actuator_motion(0.1, 0.1)
    wanted = [angle[1] + rate[1] * 0.01, 2.0, 3.0, angle[0] + rate[0] * 0.01]
    np.testing.assert_allclose(clock(0.1, 0.1), wanted)
    np.testing.assert_allclose(clock.kinks(), [0.0, 0.35, 0.6, 0.65, 0.9, 1.0])
    data = course.body.data
    start = clock.actuator_motion(0.0, 1e-9)[0]
    np.testing.assert_allclose(data.qpos[7:], [start[1] / 2, 0.4, 0.0, start[0]])
    assert course.body.facets.heights(
        data.xmat[[2]].reshape(1, 3, 3), data.xpos[[2]]
    ).min() == pytest.approx(0.0)


def test_without_a_keyframe_what_the_clock_does_not_drive_is_left_at_zero(cart):
    robot = Mjcf(str(cart / "parts" / "cart.xml"), ("fl",), ("rr",), (0.25,))
    clock = Simulation(
        Walker(robot, Tripod(2.0, 0.3, 1.0), Spatial(3e5)), Fineness(steps=8)
    ).clock
    controls = clock(0.1, 0.1)
    assert controls[:3].tolist() == [0.0, 0.0, 0.0] and controls[3] != 0.0


@pytest.mark.parametrize(
    ("kind", "volume", "size"),
    [
        ('type="sphere" size="0.03"', 4 / 3 * np.pi * 0.03**3, (0.06,) * 3),
        (
            'type="ellipsoid" size="0.01 0.02 0.03"',
            4 / 3 * np.pi * 6e-6,
            (0.02, 0.04, 0.06),
        ),
        (
            'type="capsule" size="0.01 0.03"',
            np.pi * 1e-4 * (0.06 + 4 / 3 * 0.01),
            (0.02, 0.02, 0.08),
        ),
        ('type="cylinder" size="0.01 0.03"', np.pi * 1e-4 * 0.06, (0.02, 0.02, 0.06)),
        ('type="box" size="0.01 0.02 0.03"', 4.8e-5, (0.02, 0.04, 0.06)),
        ('type="mesh" mesh="wedge"', 1e-5, ()),
    ],
)
def test_geoms_become_triangles_of_their_size(kind, volume, size):
    asset = '<asset><mesh name="wedge" vertex="0 0 0 .03 0 0 0 .02 0 0 0 .1"/></asset>'
    geom = f'<geom name="g" {kind} pos="0.1 0.2 0.3" euler="0 90 0"/>'
    text = f"<mujoco>{asset}<worldbody><body><freejoint/>{geom}</body></worldbody></mujoco>"
    model = mujoco.MjModel.from_xml_string(text)
    mesh = geoms.geom_mesh(model, 0)
    assert mesh.volume == pytest.approx(volume, rel=1e-6)
    half = geoms.geom_mesh(model, 0, 24)
    assert half.volume == pytest.approx(volume, rel=1e-6)
    assert 3.0 < len(half.faces) / len(mesh.faces) < 5.0
    if size:
        np.testing.assert_allclose(np.ptp(mesh.vertices, axis=0), size, rtol=0.03)
    surface = geoms.surface(model, 0, mesh)
    f = faces(surface.corners, surface.normals)
    np.testing.assert_allclose(
        [f.area @ n for n in (f.nx, f.ny, f.nz)], 0.0, atol=1e-3 * f.area.sum()
    )
    if "wedge" in kind:
        corners = surface.corners.reshape(-1, 3)
        np.testing.assert_allclose(corners.min(0), [0.1, 0.2, 0.27], atol=1e-6)
        np.testing.assert_allclose(corners.max(0), [0.2, 0.22, 0.3], atol=1e-6)
        return
    middle = [
        f.area @ (a + b + c) / (3 * f.area.sum())
        for a, b, c in zip(f[:3], f[3:6], f[6:9])
    ]
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
    "mjcf": ("legs = 3\nmjcf", "key: 'legs' is unknown"),
    "steps = 8": ('engine = "planar"', "use --engine mujoco"),
}


@pytest.mark.parametrize("right", WRONG)
def test_what_makes_no_machine_is_refused_with_one_line(right, cart, geomech):
    wrong, said = WRONG[right]
    (cart / "bad.toml").write_text(SCENE.replace(right, wrong, 1))
    code, out, err = geomech("walk", "bad.toml")
    assert (
        (code, out) == (2, "")
        and err.count("\n") == 1
        and err.startswith("error: ")
        and said in err
    ), err


@pytest.mark.parametrize("field", ["mjcf", "geoms", "actuators", "phases"])
def test_no_machine_takes_a_wrong_type(field, cart):
    robot = Mjcf(str(cart / "parts" / "cart.xml"), NAMES)
    wrong = [
        3,
        True,
        {"a": 1},
        (1j,),
        (float("nan"),) * 4,
        [["fl"]],
        np.zeros(3),
        "fl",
        ("a\0b",),
        np.eye(2),
    ]
    for value in wrong + ([None] if field in ("mjcf", "geoms") else []):
        with pytest.raises(ValueError, match=".") as caught:
            dataclasses.replace(robot, **{field: value})
        assert "\n" not in str(caught.value)


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
    "larger than 20 MB": " " * 20_000_001,
}


@pytest.mark.parametrize("said", FILES)
def test_files_that_are_no_robot_are_refused_with_one_line(said, cart, geomech):
    (cart / "parts" / "cart.xml").write_text(FILES[said])
    code, out, err = geomech("walk", "cart.toml")
    assert (code, out) == (2, "") and err.count("\n") == 1 and said in err, err


def test_an_actuator_that_is_named_must_follow_the_clock(cart):
    file = cart / "parts" / "cart.xml"
    file.write_text(FILES["no actuator can follow the clock"])
    with pytest.raises(
        ValueError,
        match="cart.xml: the actuator 'fl' cannot .* clock: make it <position> or <velocity>$",
    ):
        Mjcf(str(file), NAMES, actuators=("fl",))


def test_a_sweep_over_robots_that_its_engine_does_not_take_is_refused(cart):
    (cart / "bad.toml").write_text(SCENE.replace("steps = 8", 'engine = "planar"', 1))
    with pytest.raises(ValueError, match="use engine mujoco"):
        walking.Walks().grid(
            scenes.load(cart / "bad.toml"), {"gait.frequency": [1.0, 2.0]}
        )


def test_a_machine_is_known_by_what_it_includes_too(cart):
    whole, part = (
        CART.replace('size="0.06 0.03 0.01"', 'size="{} 0.03 0.01"'),
        cart / "parts" / "whole.xml",
    )
    (cart / "parts" / "cart.xml").write_text(
        '<mujoco><include file="whole.xml"/></mujoco>'
    )
    part.write_text(whole.format(0.06))
    one, same = (Mjcf(str(cart / "parts" / "cart.xml"), NAMES) for _ in range(2))
    part.write_text(whole.format(0.05))
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
    (cart / "long.toml").write_text(
        SCENE.replace("steps = 8", "steps = 32").replace(
            "duration = 1.0", "duration = 1000.0"
        )
    )
    code, out, err = geomech("walk", "long.toml")
    assert (code, out) == (2, "") and err.count("\n") == 1 and "say --yes" in err, err


def test_a_machine_written_is_the_machine_read(cart):
    scene = scenes.load(cart / "cart.toml")
    assert (
        scenes.parse(SCENE.replace("[robot]", '[robot]\nkind = "mjcf"'), scene.name)
        == scene
    )
    anew = dataclasses.replace(scene, text="", medium=Spatial(2e5, tension="keep"))
    text = scenes.toml(anew)
    assert (
        scenes.parse(text, scene.name) == anew
        and "mjcf" in text
        and "digest" not in text
    )
    other = scenes.parse(
        SCENE.replace("grazing_deg = 5", 'law = "3d"\nzeta = 2.0'),
        str(cart / "cart.toml"),
    )
    assert isinstance(other.medium, Spatial) and other.medium.xi_n > 1e5
    copied = pickle.loads(pickle.dumps(anew.robot))
    assert copied == anew.robot and copied.geom_numbers.tolist() == [2, 3, 4, 5, 1]
    (cart / "parts" / "cart.xml").write_text(CART.replace("0.01", "0.011"))
    assert scenes.load(cart / "cart.toml").robot != scene.robot
    with pytest.raises(Refusal, match="law: '2d' is unknown: did you mean '3d'"):
        scenes.parse(
            SCENE.replace("grazing_deg = 5", 'law = "2d"'), str(cart / "cart.toml")
        )


SMALL = """[medium]
zeta = 1.0
grazing_deg = 5

[robot]
kind = "wheel"
mass = 0.2
axle = 0.01

[robot.legs]
kind = "wheel"
radius = 0.05
width = 0.03

[gait]
frequency = 2.0

[numerics]
steps = 8
elements = 12
duration = 0.6
engine = "mujoco"
"""


def test_walk_sweep_and_accuracy_take_the_engine(geomech, tmp_path, monkeypatch):
    monkeypatch.setattr(
        walking, "SETTINGS", (Setting("steps", (8,), 2, against="limit"),)
    )
    monkeypatch.setattr(walking, "FINEST", {"steps": 12})
    (tmp_path / "small.toml").write_text(SMALL)
    (tmp_path / "out").mkdir()
    code, out, _ = geomech("walk", "small.toml", "--json", "-o", "out")
    found = of_json(out)
    assert code == 0 and str(found["status"].values) == "walking"
    assert found["t"].values.shape == found["pitch"].values.shape
    assert found["speed"].error > 0
    columns = (tmp_path / "out" / "walk.csv").read_text().split("\n")[0]
    assert columns.endswith("work,loss,energy,y,roll,yaw")
    assert image.imread(tmp_path / "out" / "walk.png").std() > 0.05
    code, out, _ = geomech(
        "sweep", "small.toml", "--over", "gait.frequency=2", "-o", "s.nc"
    )
    assert code == 0 and "walking" in out
    results = face.accuracy(tmp_path / "small.toml")
    assert float(results["speed"]) == pytest.approx(float(found["speed"]), rel=0.02)
    assert 0 < results["error"][0, 0] < 0.2


def test_a_sweep_of_robots_that_walk_alone_tells_how_far_it_is(tmp_path, monkeypatch):
    walk = SimpleNamespace(speed=1.0, status="walking", cycles=3)
    monkeypatch.setattr(
        walking,
        "walked",
        lambda some, settling: [walking.Walked(walk, 0.0) for _ in some],
    )
    (tmp_path / "small.toml").write_text(SMALL)
    scene, done = scenes.load(tmp_path / "small.toml"), []
    sweep(scene, {"gait.frequency": [1.0, 2.0, 3.0, 4.0]}, progress=done.append)
    assert done == [0.25, 0.5, 0.75, 1.0]


def test_pictures_are_those_of_a_gl_or_none(cart):
    scene = scenes.load(cart / "cart.toml")
    view = walking.view(scene)
    states = np.tile(build_machine(scene.robot, 10).model.qpos0, (2, 1))
    states[:, 2] = 0.03
    assert view.triangles(states[0])[..., 2].min() == pytest.approx(0.0, abs=0.002)
    pictures = view.pictures(states, 160, 120)
    if pictures is None:
        pytest.skip("no GL here: set MUJOCO_GL to egl or osmesa where there is one")
    pictures = list(pictures)
    assert [p.shape for p in pictures] == [(120, 160, 3)] * 2 and pictures[0].std() > 5


def test_without_the_extra_there_is_one_line_with_the_cure(cart, geomech, monkeypatch):
    for name in [
        x
        for x in sys.modules
        if x == "mujoco" or x.startswith("rft.terradynamics.walking.mu")
    ]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "mujoco", None)
    for args in (("walk", "xplorer", "--engine", "mujoco"), ("walk", "cart.toml")):
        code, out, err = geomech(*args)
        assert (
            (code, out) == (2, "")
            and err.count("\n") == 1
            and "pip install 'geomech[mujoco]'" in err
        ), err
    with pytest.raises(ValueError, match="not installed"):
        engine("mujoco")


def test_the_clock_of_a_robot_of_the_plane_is_that_of_its_tripods():
    robot = scenes.load("xplorer").robot
    made = build_machine(robot, 6)
    clock = Clock(made, Tripod(2.0, 0.3, 1.0))
    assert [made.model.actuator(k).name for k in made.driven] == [
        f"leg{k}" for k in range(6)
    ]
    np.testing.assert_allclose(
        clock.actuator_motion(0.0, 1e-9)[0][[1, 2, 5]]
        - clock.actuator_motion(0.0, 1e-9)[0][[0, 3, 4]],
        np.pi,
    )


def test_machines_without_surfaces_are_refused():
    from rft.terradynamics.walking.spatial.facets import Facets

    with pytest.raises(Refusal, match="no geoms that touch the ground"):
        Facets([])
