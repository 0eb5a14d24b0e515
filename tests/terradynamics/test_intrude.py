"""Scenes of bodies that are moved through grains, flat and solid: media, files, errors,
and what is refused."""

import dataclasses
import math
import re

import numpy as np
import pytest
from frozen import FOLDER
from refusals import refuses
from registry import GROUND_EFFECTS, OUTLINES

from geomech import medium, scenes
from geomech.scenes import MeshScene
from geomech.scenes.terradynamics.intruder import IntruderScene
from geomech.studies.terradynamics.intrusion import Settings, answer, estimate
from rft.terradynamics import meshes, plates
from rft.terradynamics.plates import VERTICAL, PlateDrags, StressMap

pytestmark = pytest.mark.usefixtures("fastest")
NAMES = scenes.intruder_names()
FLAT = [n for n in NAMES if isinstance(scenes.load(n), IntruderScene)]
SOLID = [n for n in NAMES if n not in FLAT]
MADE = """[medium]
name = "poppy-seeds-close"
zeta = 0.5
[intruder]
kind = "polygon"
points = [[0, 0], [0.04, 0.0], [0.03, 0.02]]
width = 0.03
[motion]
kind = "drag"
depth = 0.01
direction_deg = 30
attitude_deg = 15
distance = 0.05
samples = 7
[numerics]
elements = 40
"""
BALL = (FOLDER / "ball.toml").read_text()
NINE = dict(
    zip(
        ["A00", "A10", "B11", "B01", "B-11", "C11", "C01", "C-11", "D10"],
        np.arange(9) / 50,
    )
)
COEFFICIENTS = "\n".join(f"{key} = {value}" for key, value in NINE.items())


@pytest.fixture
def scene_with(tmp_path):
    """Load the polygon's scene from a file, with its medium in another."""

    def load(medium_text, more="", name="own.toml"):
        (tmp_path / name).write_text(medium_text)
        file = f'file = "{name}"\n{more}'
        text = MADE.replace('name = "poppy-seeds-close"', file)
        (tmp_path / "s.toml").write_text(text)
        return scenes.load(tmp_path / "s.toml")

    return load


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (COEFFICIENTS, StressMap(*NINE.values())),
        (
            f"[medium]\n{COEFFICIENTS}\nzeta = 2\ntension = 'cut'\ngrazing_deg = 3\n",
            StressMap(*NINE.values(), 2.0, math.radians(3), "cut"),
        ),
        (MADE, dataclasses.replace(VERTICAL["poppy-seeds-close"].stress, zeta=0.5)),
    ],
    ids=["bare", "of a section", "of a scene"],
)
def test_media_from_files(text, expected, tmp_path):
    (tmp_path / "own.toml").write_text(text)
    assert medium(str(tmp_path / "own.toml")) == expected


@pytest.mark.parametrize(
    ("more", "tension", "grazing"),
    [("", "cut", 3), ("tension = 'keep'", "keep", 3), ("grazing_deg = 1", "cut", 1)],
)
def test_a_scene_takes_its_medium_from_a_file(more, tension, grazing, scene_with):
    """With what that says of tension and grazing, unless the scene says otherwise."""
    text = "[medium]\nzeta = 0.4\ntension = 'cut'\ngrazing_deg = 3\n"
    expected = StressMap(zeta=0.2, tension=tension, grazing=math.radians(grazing))
    assert scene_with(text, more).medium == expected


def test_a_medium_from_plate_drags(scene_with):
    rows = ["# measured in N/cm^3", "gamma,beta,alpha_z,alpha_x"]
    for beta in range(-75, 91, 15):
        for gamma in range(-90, 91, 15):
            a_x, a_z = StressMap()(math.radians(beta), math.radians(gamma))
            rows.append(f"{gamma},{beta},{a_z},{a_x}  # one plate")
    scene = scene_with("\n".join(rows), name="plates.csv")
    assert isinstance(scene.medium, PlateDrags)
    angles = (math.radians(30), math.radians(-45))
    expected = 0.5 * np.array(StressMap()(*angles))
    np.testing.assert_allclose(scene.medium(*angles), expected, atol=1e-9)


@pytest.mark.parametrize("elements", [50, 400])
@pytest.mark.parametrize(
    ("tension", "factor", "low", "high"), [("keep", 2, 0.9, 4), ("cut", 3, 0.8, 15)]
)
@pytest.mark.parametrize(
    "name", ["c-leg", "reversed-c-leg", "half-cylinder", "round-rod"]
)
def test_the_error_of_the_elements_is_told(name, tension, factor, low, high, elements):
    """From twice as many; of first order, with tension cut, from thrice as many."""
    scene = scenes.load(name)
    stress = dataclasses.replace(scene.medium, tension=tension)
    scene = scene.changed(medium=stress, elements=elements)
    found = scene.run()
    exact = scene.run(3200)
    told = estimate(scene, found)
    force = np.linalg.norm(found.force - exact.force, axis=1).max()
    moment = np.abs(found.moment - exact.moment).max()
    assert low * force <= told.force <= high * force + 1e-12
    assert (low - 0.5) * moment <= told.moment


def test_the_error_is_not_known_where_a_body_has_no_more_elements():
    found = answer(scenes.parse(MADE.replace("elements = 40", "elements = 2499")))
    assert np.isnan(float(found["largest_force_error"]))
    assert found["force_x"].error is None


OF_FILES = """[medium]
zeta = 0.3
[intruder]
kind = "spline"
file = "body.csv"
width = 0.02
[motion]
kind = "csv"
file = "path.csv"
"""


def test_bodies_and_paths_from_files(tmp_path):
    body = "x,z\n0,0\n0.02,-0.01\n0.05,0.01\n0.02,0.03\n"
    (tmp_path / "body.csv").write_text(body)
    path = "t,x,z,angle\n0,0,-0.02,0\n1,0.1,-0.03,0.1\n3,0.2,-0.01,0.3\n"
    (tmp_path / "path.csv").write_text(path)
    (tmp_path / "s.toml").write_text(OF_FILES)
    scene = scenes.load(tmp_path / "s.toml")
    points = ((0, 0), (0.02, -0.01), (0.05, 0.01), (0.02, 0.03))
    np.testing.assert_array_equal(scene.intruder.points, points)
    expected = plates.Path(
        (0, 1, 3), (0, 0.1, 0.2), (-0.02, -0.03, -0.01), (0, 0.1, 0.3)
    )
    outline = plates.Spline(points, 0.02).outline(100)
    motion = expected.trajectory(outline)
    force = plates.loads(scene.medium, outline, motion.pose, motion.twist).force
    np.testing.assert_allclose(scene.run().force, force, rtol=1e-12)


def made_scenes():
    """Return a scene of every outline and solid, with every motion."""
    flat_motions = (
        plates.Drag(0.02, attitude=0.1),
        plates.Penetrate(0.03, 1.1),
        plates.Rotate(0.02, -3.0, 1.0, -2.0, 0.3, 55),
    )
    stress = StressMap(0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.1, 0.02, "cut")
    found = [
        IntruderScene(stress, shape, flat_motions[k % 3], elements=31)
        for k, shape in enumerate(OUTLINES.values())
    ]
    motions = (
        meshes.Drag(0.03, 0.2, -0.4, 0.05, 0.08, (0.1, 0.2, -0.3), 5),
        meshes.Penetrate(0.03, 1.1, 0.6, 0.02, 0.5, 5),
        meshes.Rotate(-0.01, (1.0, 2.0, -1.0), -3.0, 1.0, -2.0, 0.3, 0.5, 0.2, 6),
    )
    law = meshes.Spatial(2.5e5, 0.3, "keep", 0.1)
    effects = [
        GROUND_EFFECTS[name][0](0.3) for name in ("disturbed-ground", "aeration")
    ]
    for k, name in enumerate(SOLID):
        body = scenes.load(name).intruder
        scene = MeshScene(law, body, motions[k % 3], 70, tuple(effects[: k % 3]))
        found.append(scene)
    return found


@pytest.mark.parametrize("scene", made_scenes(), ids=repr)
def test_what_is_written_reads_the_same(scene):
    assert scenes.parse(scenes.toml(scene)) == scene


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "header t,x,z | where"),
        ("t,x,y\n0,0,0\n", "line 1 t,x,z | where because"),
        ("t,x,z,z\n0,0,0,0\n", "line 1 header 2 columns z | where because instead"),
        ("t,x,z\n0,0,0\n1,1\n2,2,0\n", "line 3 row 3 finite | where value"),
        ("t,x,z\n0,0,0\n1,nan,0\n", "line 3 row 3 finite | where value"),
        ("t,x,z\n0,0,0\n1,1,0\n", "3 100000 2 | where value"),
        ("t,x,z\n0,0,0\n1,1,0\n1,2,0\n", "t increase | where"),
        ("t,x,z\n0,0,0\n1,5000,0\n2,2,0\n", "x finite 1000 m | where"),
    ],
)
def test_bad_paths_are_refused_with_their_line(text, said, tmp_path):
    (tmp_path / "path.csv").write_text(text)
    before, _, _ = MADE.partition("[motion]")
    file = tmp_path / "s.toml"
    file.write_text(f'{before}[motion]\nkind = "csv"\nfile = "path.csv"\n')
    with refuses(said):
        scenes.load(file)


def test_errors_of_an_accuracy_study_are_rms_over_the_largest():
    """Against the finest parts of the scene's ladder."""
    scene = scenes.parse(MADE)
    question = Settings(scene)
    (setting,) = question.settings()
    truth = question.evaluate(setting, None)
    numbers = question.evaluate(setting, setting.values[1])
    found = question.errors(numbers, truth)["moment_error"]
    off = scene.run(scene.ladder[1]).moment - scene.run(scene.ladder[-1]).moment
    expected = np.sqrt(np.mean(off**2)) / np.abs(truth[1]).max()
    assert found == pytest.approx(expected, rel=1e-9)


VALUES = [
    "nan", "inf", "0", "-1", "1e308", "1e-320", "true", '""', '"x"', "[]", "[1]",
    "[[1]]", "[nan,1,1]", "{}", "1979-05-27", "360", "3", '"cut"', '"c-leg"', "-0.04",
    '"wheel"', '"penetrate"', '"up"', '"screw"', '"mesh"', '"rotate"', "[0,0,1]",
]  # fmt: skip


def changed(text, rng):
    """Return a text with one or two lines dropped, copied, or with another number,
    value or key."""
    lines = [line for line in text.splitlines() if line and line[0] != "#"]
    for _ in range(rng.integers(1, 3)):
        k = rng.integers(len(lines))
        key, _, value = lines[k].partition("=")
        other = lines[rng.integers(len(lines))]
        number = f"{10 ** rng.uniform(-2, 1):.3g}"
        lines[k] = rng.choice([
            "",
            f"{lines[k]}\n{other}",
            f"{key}= {rng.choice(VALUES)}",
            f"{other.partition('=')[0]}={value}",
            re.sub(r"\d+(\.\d+)?", number, lines[k]),
            re.sub(r"\d+(\.\d+)?", number, lines[k]),
        ])  # fmt: skip
    return "\n".join(lines)


COARSE = "\n[numerics]\ntriangles = 30\n"
TEXTS = {
    "flat": [MADE, *(scenes.load(name).text for name in FLAT)],
    "solid": [BALL, *(scenes.load(name).text + COARSE for name in SOLID)],
}


@pytest.mark.parametrize(
    ("kind", "count", "seed"), [("flat", 500, 0), ("flat", 500, 1), ("solid", 300, 2)]
)
def test_mutated_scenes_are_run_or_refused(kind, count, seed):
    rng = np.random.default_rng(seed)
    refusals = []
    for _ in range(count):
        text = changed(rng.choice(TEXTS[kind]), rng)
        try:
            found = scenes.parse(text).run()
        except ValueError as error:
            refusals.append(str(error))
            continue
        for values in (found.force, found.moment, found.power):
            assert np.isfinite(values).all(), text
    assert 0.4 * count < len(refusals) < 0.9 * count
    assert all(0 < len(line) < 450 and "\n" not in line for line in refusals)
