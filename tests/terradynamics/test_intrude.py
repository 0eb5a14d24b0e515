"""Scenes of bodies that are moved through grains, flat and solid: media, files, errors,
pictures, and what is refused."""

import dataclasses
import math
import re

import numpy as np
import pytest
from frozen import FOLDER
from registry import GROUND_EFFECTS, OUTLINES, STRESSES

from geomech import medium, plots, scenes
from geomech.core.setting import Setting
from geomech.questions.terradynamics.stress import Stress
from geomech.scenes import MeshScene
from geomech.scenes.terradynamics.intruder import IntruderScene
from geomech.studies.scene_tables import SceneTables
from geomech.studies.settings import Measurements
from geomech.studies.terradynamics.intrusion import Settings, answer, estimate
from rft.core.refusal import Refusal
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


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("file = 'own.toml'", "names another file, own.toml: copy the coefficients"),
        ("zetta = 1\n", r"s.toml: \[medium\] own.toml key: 'zetta' is unknown"),
        ("[medium\n", "it is not TOML"),
    ],
)
def test_files_that_are_no_medium_are_refused(text, said, scene_with):
    with pytest.raises(Refusal, match=said):
        scene_with(text)


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
    assert [p.name for p in scenes.inputs(scene)] == ["s.toml", "plates.csv"]


def test_a_medium_that_drives_a_motion_on_is_told(tmp_path):
    lost = "A00 = 0.2\nA10 = 0.2\nB11 = 0.2\nB01 = -0.4\nBm11 = 0.05\nC11 = -0.1\n"
    (tmp_path / "lost.toml").write_text(f"{lost}C01 = 0.2\nCm11 = 0\nD10 = 0.1\n")
    (note,) = Stress(str(tmp_path / "lost.toml"), 0.0, 90.0).ask()["note"].values
    assert "lost.toml drives motion on over" in note


@pytest.mark.parametrize("name", NAMES)
def test_forces_of_a_scene_are_those_of_its_body_on_its_motion(name):
    scene = scenes.load(name)
    assert scenes.toml(scene) == scene.text
    if name in FLAT:
        _, pose, twist = scene.motion.trajectory(scene.outline)
        expected = plates.loads(scene.medium, scene.outline, pose, twist)
    else:
        scene = dataclasses.replace(scene, triangles=min(scene.triangles, 5000))
        _, place, *motion, _ = scene.motion.trajectory(scene.mesh)
        turn, *rates = motion
        expected = meshes.wrench(scene.medium, scene.mesh, turn, place, *rates)
    found = answer(scene)
    axes = "xz" if name in FLAT else "xyz"
    force = np.stack([found[f"force_{axis}"].values for axis in axes], -1)
    np.testing.assert_allclose(force, expected.force, rtol=1e-12, atol=1e-15)
    moment = expected.moment if name in FLAT else expected.moment[:, 1]
    np.testing.assert_allclose(found["moment"].values, moment, rtol=1e-12, atol=1e-15)
    largest = np.linalg.norm(force, axis=1).max()
    assert 0 <= float(found["largest_force_error"]) < 0.4 * largest


@pytest.mark.parametrize("elements", [50, 100, 400])
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
    assert told.count == scene.actual_count(factor * scene.count)


def test_the_error_is_not_known_where_a_body_has_no_more_elements():
    found = answer(scenes.parse(MADE.replace("elements = 40", "elements = 2499")))
    assert np.isnan(float(found["largest_force_error"]))
    assert int(found["finest_parts"].values) == 2500
    assert found["force_x"].error is None


# Sizes as in the captions of Figs. 6 and 8; peaks as found first: N, degrees, N m.
PEAKS = {
    "c-leg": (1.0, 8.90763, -47, -0.402135),
    "reversed-c-leg": (-1.0, 4.12917, 9, -0.167863),
    "flat-leg": (0.0, 2.70632, -42, -0.211161),
}


@pytest.mark.parametrize("name", PEAKS)
def test_legs_differ_in_peak_and_in_phase(name):
    curvature, peak, angle, moment = PEAKS[name]
    scene = scenes.load(name)
    assert scene.intruder.radius == 0.038
    assert getattr(scene.intruder, "relative_curvature", 0.0) == curvature
    assert scene.motion.rate == pytest.approx(2 * math.pi, rel=1e-12)
    assert scene.medium == VERTICAL["poppy-seeds-loose"].stress
    found = scene.run()
    highest = found.force[:, 1].argmax()
    assert found.force[highest, 1] == pytest.approx(peak, rel=1e-4)
    assert np.degrees(found.pose[highest, 2]) == pytest.approx(angle, abs=0.01)
    assert found.moment.min() == pytest.approx(moment, rel=1e-4)
    assert found.power.max() == 0.0


@pytest.mark.parametrize("name", ["half-cylinder", "round-rod", "square-rod"])
def test_rods_are_dragged_ahead_through_glass(name):
    rod = scenes.load(name)
    assert rod.medium == VERTICAL["glass-3mm"].stress
    assert rod.motion.direction == 0.0


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


# The scene, what is changed in it, and what the refusal names.
REFUSED = [
    (MADE, "[intruder]", "[motion.x]", "the table [intruder] is missing: add it"),
    (MADE, "zeta = 0.5", 'zeta = "a"', "[medium] Expected `float`, got `str`"),
    (MADE, "zeta = 0.5", "zetta = 0.5", "[medium] key: 'zetta' is unknown"),
    (MADE, "zeta = 0.5", 'file = "no.csv"', "keep one of 'name', 'file'"),
    (MADE, 'name = "poppy-seeds-close"', "A00 = 0.1", "has no A10, B01, B11"),
    (MADE, 'kind = "polygon"', "", "[intruder] has no 'kind': add kind = one of"),
    (MADE, 'kind = "polygon"', 'kind = "cyllinder"', "did you mean 'cylinder'"),
    (MADE, "width = 0.03", "width = 0.03\nfile = 'b'", "either 'file' or 'points'"),
    (MADE, "direction_deg = 30", "direction_deg = 3\ndirection = 1", "given twice"),
    (MADE, "depth = 0.01", "depth = nan", "depth must be a number"),
    (MADE, "samples = 7", "samples = 7\nrate = 3", "[motion] key: 'rate' is unknown"),
    (MADE, "[motion]", "[x]\n[motion]", "table: 'x' is unknown"),
    (BALL, "density = 1500", "xi_n = 3e5", "give 'xi_n' (N/m^3), or"),
    (BALL, 'shape = "sphere"', "", "has no 'shape': add shape = one of sphere"),
    (BALL, 'kind = "mesh"', 'kind = "sphere"', "'shape' is unknown: use one of"),
    (BALL, "[10, 0, 20]", "[10, 0]", "an angle about y or a rotation vector"),
    (BALL, 'kind = "drag"', 'kind = "rotate"', "[motion] key: 'depth' is unknown"),
    (BALL, 'kind = "slope"', 'kind = "hill"', "[[effects]] kind: 'hill' is unknown"),
]


@pytest.mark.parametrize(
    ("text", "old", "new", "said"), REFUSED, ids=[said for *_, said in REFUSED]
)
def test_scenes_that_make_no_sense_are_refused(text, old, new, said):
    assert old in text
    with pytest.raises(Refusal, match=f"made.*{re.escape(said)}") as caught:
        scenes.parse(text.replace(old, new), "made")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "header must be t,x,z, and angle if wanted"),
        ("t,x,y\n0,0,0\n", "line 1: the header must be t,x,z"),
        ("t,x,z,z\n0,0,0,0\n", "line 1: the header has 2 columns z"),
        ("t,x,z\n0,0,0\n1,1\n2,2,0\n", "line 3: a row must be 3 finite numbers"),
        ("t,x,z\n0,0,0\n1,nan,0\n", "line 3: a row must be 3 finite numbers"),
        ("t,x,z\n0,0,0\n1,1,0\n", "a path takes 3 to 100000 poses, got 2"),
        ("t,x,z\n0,0,0\n1,1,0\n1,2,0\n", "t must ascend"),
        ("t,x,z\n0,0,0\n1,5000,0\n2,2,0\n", "x must be finite and within 1000 m"),
    ],
)
def test_bad_paths_are_refused_with_their_line(text, said, tmp_path):
    (tmp_path / "path.csv").write_text(text)
    before, _, _ = MADE.partition("[motion]")
    file = tmp_path / "s.toml"
    file.write_text(f'{before}[motion]\nkind = "csv"\nfile = "path.csv"\n')
    with pytest.raises(Refusal, match=said):
        scenes.load(file)


C_LEG = scenes.load("c-leg")
SPHERE = scenes.load("sphere")
OWN_TABLE = dataclasses.replace(C_LEG, medium=STRESSES["measured"], text="")
WRONG = [
    (lambda: dataclasses.replace(C_LEG, medium=3), "a stress map such as"),
    (lambda: dataclasses.replace(C_LEG, intruder=3), "a body such as"),
    (lambda: dataclasses.replace(C_LEG, motion=3), "a motion such as"),
    (lambda: dataclasses.replace(SPHERE, medium=C_LEG.medium), "a medium such as"),
    (lambda: dataclasses.replace(SPHERE, intruder=3), "a solid such as"),
    (lambda: dataclasses.replace(SPHERE, motion=C_LEG.motion), "rft.terradynamics.mes"),
    (lambda: SceneTables(C_LEG), "a study is that of a Scene, got IntruderScene"),
    (lambda: scenes.toml(OWN_TABLE), "has a CSV file of its own"),
]


@pytest.mark.parametrize(("build", "said"), WRONG, ids=[said for _, said in WRONG])
def test_parts_of_another_kind_are_refused(build, said):
    with pytest.raises(ValueError, match=said):
        build()


def test_a_tolerance_that_is_just_met_is_met():
    """By the fewest elements, in force and moment."""
    errors = {"force_error": [[5e-2, 2e-3]], "moment_error": [[1e-1, 1e-3]]}
    measured = Measurements(
        [Setting("elements", (8, 16), 2)],
        np.array([[8.0, 16.0]]),
        np.array([[1.0, 2.0]]),
        {name: np.array(values) for name, values in errors.items()},
    )
    found = {v.name: v.values for v in Settings(C_LEG).choices(measured)}
    np.testing.assert_array_equal(found["best_value"][:3], [8, 16, np.nan])
    np.testing.assert_array_equal(found["best_error"][:3], [1e-1, 2e-3, np.nan])


def test_errors_of_an_accuracy_study_are_rms_over_the_largest():
    """Against the finest parts of the scene's ladder, and of the order declared."""
    scene = scenes.parse(MADE)
    question = Settings(scene)
    (setting,) = question.settings()
    coarse, fine = setting.values[1:3]
    truth = question.evaluate(setting, None)
    errors = []
    for value in (coarse, fine):
        numbers = question.evaluate(setting, value)
        errors.append(question.errors(numbers, truth)["moment_error"])
    off = scene.run(scene.ladder[1]).moment - scene.run(scene.ladder[-1]).moment
    expected = np.sqrt(np.mean(off**2)) / np.abs(truth[1]).max()
    assert errors[0] == pytest.approx(expected, rel=1e-9)
    assert setting.order == 2
    order = np.log(errors[0] / errors[1]) / np.log(fine / coarse)
    assert order == pytest.approx(2, abs=0.4)


@pytest.mark.parametrize(("force", "scale"), [(4.0, 4.0 * C_LEG.size), (0.0, 1.0)])
def test_a_moment_of_roundoff_has_its_error_over_the_force_times_the_size(force, scale):
    """And where there is no force, either, an error is a moment."""
    truth = [np.array([[force, 0.0]]), np.array([1e-15 * force])]
    found = Settings(C_LEG).errors([truth[0], truth[1] + 0.02], truth)
    assert found["force_error"] == 0.0
    assert found["moment_error"] == pytest.approx(0.02 / scale)


def test_pictures_show_what_was_computed():
    found = C_LEG.run()
    bodies, forces, moment = plots.intrusion_figure(C_LEG, answer(C_LEG)).axes
    angle = found.pose[0, 2]
    tip = -0.076 * np.array([math.sin(angle), math.cos(angle)]) + [0, 0.02]
    ends = bodies.lines[0].get_xydata()[[0, -1]]
    np.testing.assert_allclose(ends, [(0, 0.02), tip], atol=1e-12)
    curves = [line.get_ydata() for line in (*forces.lines[:2], moment.lines[0])]
    np.testing.assert_array_equal(curves, [*found.force.T, found.moment])
    assert forces.get_xlabel() == "angle (degrees)"


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


COARSE = "\n[numerics]\ntriangles = 100\n"
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
