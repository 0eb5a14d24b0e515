"""Intruder scenes and the commands stress, intrude and accuracy: what they say, write and refuse."""

import csv
import dataclasses
import math
import types

import numpy as np
import pytest
from registry import OUTLINES, STRESSES
from tabled import of_json
from test_fuzz import VALUES, mutated

import geomech.scenes as scenes
from geomech import medium, plots
from geomech.core.setting import Setting
from geomech.scenes.terradynamics.intruder import IntruderScene
from geomech.studies.scene_tables import SceneTables
from geomech.studies.settings import Measurements
from geomech.studies.terradynamics import intrusion
from geomech.studies.terradynamics.intrusion import Settings, answer, estimate
from rft.core.refusal import Refusal
from rft.terradynamics.plates import (
    VERTICAL,
    CLeg,
    Drag,
    Outline,
    Penetrate,
    PlateDrags,
    Rotate,
    StressMap,
    loads,
)

pytestmark = pytest.mark.usefixtures("fastest")
FLAT = [
    n for n in scenes.intruder_names() if isinstance(scenes.load(n), IntruderScene)
]  # others are meshes
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


def refused(ended, said):
    code, out, err = ended
    assert (code, out) == (2, "")
    assert err.count("\n") == 1 and err.startswith("error: ") and said in err, err


CHECKS = {
    (0, 90): (0, 1),
    (0, -90): (0, -0.25),
    (90, 0): (0.37, 0.037),
    (0, 0): (0.136, 0.375),
    (45, 45): (0.3595, 0.5702),
}


def test_stress_tells_the_check_values(geomech):
    for (beta, gamma), wanted in CHECKS.items():
        code, out, err = geomech(
            "stress", "generic", "--beta", beta, "--gamma", gamma, "--json"
        )
        assert (code, err) == (0, "")
        found = of_json(out)
        values = [round(float(found[k]), 4) for k in ("alpha_x", "alpha_z")]
        assert values == list(wanted)
    args = ("--beta", 0, "--gamma", 90, "--json")
    found = of_json(geomech("stress", "glass-3mm", *args)[1])
    assert float(found["alpha_z"]) == 0.224
    code, out, err = geomech("stress", "poppy-seeds-loose", "--beta", 0, "--gamma", 90)
    assert (code, err) == (0, "")
    assert (
        "alpha_z = 0.254 N/cm^3" in out
        and "takes power at all angles, pulls on 14.7 % of the plane" in out
    )


def test_media_from_files(geomech, tmp_path):
    nine = {
        "A00": 0.1,
        "A10": 0.1,
        "B11": 0.1,
        "B01": 0.2,
        "B-11": 0.04,
        "C11": -0.05,
        "C01": 0.1,
        "C-11": 0.01,
        "D10": 0.05,
    }
    lines = "\n".join(f"{k} = {v}" for k, v in nine.items())
    (tmp_path / "bare.toml").write_text(lines)
    (tmp_path / "own.toml").write_text(
        f"[medium]\n{lines}\nzeta = 2\ntension = 'cut'\ngrazing_deg = 3\n"
    )
    wanted = StressMap(*nine.values(), zeta=2.0, grazing=math.radians(3), tension="cut")
    assert medium(str(tmp_path / "own.toml")) == wanted
    for name, times in (("bare.toml", 1), ("own.toml", 2)):
        found = of_json(
            geomech("stress", name, "--beta", 20, "--gamma", 50, "--json")[1]
        )
        assert float(found["alpha_z"]) == pytest.approx(
            times
            * float(StressMap(*nine.values())(math.radians(20), math.radians(50))[1]),
            abs=1e-12,
        )
    (tmp_path / "scene.toml").write_text(MADE)
    assert medium(str(tmp_path / "scene.toml")).zeta == 0.5  # a scene has a medium, too


def test_a_scene_takes_its_medium_from_a_file(tmp_path):
    """With what that says of tension and grazing, unless the scene says otherwise."""
    (tmp_path / "own.toml").write_text(
        "[medium]\nzeta = 0.4\ntension = 'cut'\ngrazing_deg = 3\n"
    )
    with_more = lambda more: MADE.replace(
        'name = "poppy-seeds-close"', f'file = "own.toml"\n{more}'
    )
    for more, tension, grazing in (
        ("", "cut", 3),
        ("tension = 'keep'", "keep", 3),
        ("grazing_deg = 1", "cut", 1),
    ):
        (tmp_path / "s.toml").write_text(with_more(more))
        wanted = StressMap(zeta=0.2, tension=tension, grazing=math.radians(grazing))
        assert scenes.load(tmp_path / "s.toml").medium == wanted
    (tmp_path / "own.toml").write_text("file = 'own.toml'\n")
    with pytest.raises(
        Refusal, match="names another file, own.toml: copy the coefficients"
    ):
        scenes.load(tmp_path / "s.toml")
    (tmp_path / "own.toml").write_text("zetta = 1\n")
    with pytest.raises(
        Refusal,
        match=r"s.toml: \[medium\] own.toml key: 'zetta' is unknown: did you mean 'zeta'",
    ):
        scenes.load(tmp_path / "s.toml")
    (tmp_path / "own.toml").write_text("[medium\n")
    with pytest.raises(Refusal, match="it is not TOML"):
        scenes.load(tmp_path / "s.toml")


def test_a_medium_from_plate_drags(geomech, tmp_path):
    rows = ["# measured in N/cm^3", "gamma,beta,alpha_z,alpha_x"]
    for beta in range(-75, 91, 15):
        for gamma in range(-90, 91, 15):
            a_x, a_z = StressMap(zeta=0.3)(math.radians(beta), math.radians(gamma))
            rows.append(f"{gamma},{beta},{a_z},{a_x}  # one plate")
    (tmp_path / "plates.csv").write_text("\n".join(rows))
    found = of_json(
        geomech("stress", "plates.csv", "--beta", 30, "--gamma", -45, "--json")[1]
    )
    wanted = StressMap(zeta=0.3)(math.radians(30), math.radians(-45))
    values = (float(found["alpha_x"]), float(found["alpha_z"]))
    assert values == pytest.approx(tuple(map(float, wanted)), abs=1e-9)
    (tmp_path / "scene.toml").write_text(
        MADE.replace('name = "poppy-seeds-close"', 'file = "plates.csv"')
    )
    scene = scenes.load(tmp_path / "scene.toml")
    assert isinstance(scene.medium, PlateDrags) and scene.medium.zeta == 0.5
    assert [p.name for p in scenes.inputs(scene)] == ["scene.toml", "plates.csv"]
    refused(geomech("intrude", "scene.toml", "-o", "plates.csv"), "it is an input")


def test_a_medium_that_drives_a_motion_on_is_told(geomech, tmp_path):
    lost = "A00 = 0.2\nA10 = 0.2\nB11 = 0.2\nB01 = -0.4\nBm11 = 0.05\nC11 = -0.1\nC01 = 0.2\nCm11 = 0\nD10 = 0.1\n"
    (tmp_path / "lost.toml").write_text(lost)
    code, out, err = geomech(
        "stress", "lost.toml", "--beta", 0, "--gamma", 90, "--json"
    )
    assert code == 0 and "alpha_x" in of_json(out)
    assert (
        err.startswith("note: lost.toml drives motion on over") and err.count("\n") == 1
    )


@pytest.mark.parametrize("name", FLAT)
def test_intrude_gives_what_the_python_door_gives(name, geomech, tmp_path):
    scene = scenes.load(name)
    assert isinstance(scene, IntruderScene)
    plot = (
        ("--plot", "out.png") if name in ("c-leg", "half-cylinder") else ()
    )  # one that turns, one that does not
    code, out, err = geomech("intrude", name, "--json", "-o", "out.csv", *plot)
    assert (code, err) == (0, "")
    found = of_json(out)
    place = ["angle"] if "leg" in name else ["x", "z"]
    assert int(found["finest_parts"].values) == scene.actual_count(2 * scene.count)
    assert list(found)[: 4 + len(place)] == [
        "t",
        *place,
        "force_x",
        "force_z",
        "moment",
    ]
    _, pose, twist = scene.motion.trajectory(scene.outline)
    wanted = loads(scene.medium, scene.outline, pose, twist)
    np.testing.assert_allclose(
        np.stack([found["force_x"], found["force_z"]], -1), wanted.force, rtol=1e-14
    )
    np.testing.assert_array_equal(found["moment"], wanted.moment)
    with open(tmp_path / "out.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    for key in ("t", *place, "force_x", "force_z", "moment"):
        assert [float(row[key]) for row in rows] == found[key].values.tolist()
    assert not plot or (tmp_path / "out.png").read_bytes().startswith(b"\x89PNG")
    if not plot:
        return
    code, out, err = geomech("intrude", name)
    assert (code, err) == (0, "") and "work     -" in out and "power at most" in out
    force, moment = (float(found[f"largest_{x}_error"]) for x in ("force", "moment"))
    told = (
        f"error    force {force:.1g} N, moment {moment:.1g} N m at most, from up to 2"
    )
    assert told in out
    assert name in geomech("scenes")[1]
    assert geomech("scenes", "--show", name)[1] == scene.text


@pytest.mark.parametrize(
    ("tension", "elements"),
    [("keep", 50), ("keep", 200), ("cut", 50), ("cut", 100), ("cut", 400)],
)
@pytest.mark.parametrize(
    "name", ["c-leg", "reversed-c-leg", "half-cylinder", "round-rod"]
)
def test_the_error_of_the_elements_is_told(name, tension, elements):
    """From twice as many: of a reversed c-leg with tension cut of first order, else of second."""
    scene = scenes.load(name)
    scene = scene.changed(
        medium=dataclasses.replace(scene.medium, tension=tension), elements=elements
    )
    found, exact = scene.run(), scene.run(3200)
    told = estimate(scene, found)
    force = np.linalg.norm(found.force - exact.force, axis=1).max()
    assert (
        (0.9 if tension == "keep" else 0.8) * force
        <= told.force
        <= (4.0 if tension == "keep" else 15.0) * force + 1e-12
    )
    assert (0.6 if tension == "keep" else 0.3) * np.abs(
        found.moment - exact.moment
    ).max() <= told.moment
    assert told.count == scene.actual_count(
        (2 if tension == "keep" else 3) * scene.count
    )
    if (name, tension, elements) == ("reversed-c-leg", "cut", 100):
        assert 0.01 < force / np.linalg.norm(exact.force, axis=1).max() < 0.03


def test_the_error_is_not_known_where_a_body_has_no_more_elements(geomech, tmp_path):
    (tmp_path / "s.toml").write_text(MADE.replace("elements = 40", "elements = 2499"))
    told = of_json(geomech("intrude", "s.toml", "--json")[1])
    assert np.isnan(float(told["largest_force_error"]))
    assert int(told["finest_parts"].values) == 2500 and told["force_x"].error is None
    assert (
        "error    not known: finer elements are more than it takes"
        in geomech("intrude", "s.toml")[1]
    )


def test_constants_of_the_intruder_scenes():
    legs = [scenes.load(name) for name in ("c-leg", "reversed-c-leg", "flat-leg")]
    assert [getattr(leg.intruder, "relative_curvature", 0.0) for leg in legs] == [
        1.0,
        -1.0,
        0.0,
    ]
    for leg in legs:
        assert leg.intruder.radius == 0.038  # caption of Fig. 8
        assert leg.motion.rate == pytest.approx(2 * math.pi, rel=1e-12)
        assert leg.medium == VERTICAL["poppy-seeds-loose"].stress
    for name in ("half-cylinder", "round-rod", "square-rod"):
        rod = scenes.load(name)
        assert (
            rod.medium == VERTICAL["glass-3mm"].stress and rod.motion.direction == 0.0
        )
    assert scenes.load("half-cylinder").intruder.flat == "down"


# Peaks of the built-in scenes as found first: N, degrees, N m.
PEAKS = {
    "c-leg": (8.90763, -47, -0.402135),
    "reversed-c-leg": (4.12917, 9, -0.167863),
    "flat-leg": (2.70632, -42, -0.211161),
}


def test_legs_differ_in_peak_and_in_phase():
    for name, (peak, angle, moment) in PEAKS.items():
        found = scenes.load(name).run()
        assert found.force[:, 1].max() == pytest.approx(peak, rel=1e-4)
        assert np.degrees(found.pose[found.force[:, 1].argmax(), 2]) == pytest.approx(
            angle, abs=0.01
        )
        assert found.moment.min() == pytest.approx(moment, rel=1e-4)
        assert found.power.max() == 0.0


def test_rods_deep_down_have_the_lift_of_one_depth(tmp_path):
    """As the radius is small against the depth; DESIGN section 9."""
    for name, kept, cut in (
        ("round-rod", 0.81, 0.68),
        ("half-cylinder", 0.54, 0.04),
        ("square-rod", 0.1, 0.1),
    ):
        for tension, wanted in (("keep", kept), ("cut", cut)):
            text = (
                scenes.load(name)
                .text.replace("depth = 0.1 ", "depth = 10.0")
                .replace("0.0127", "0.001")
                .replace("0.0254", "0.002")
            )
            text = text.replace(
                'name = "glass-3mm"', f'name = "glass-3mm"\ntension = "{tension}"'
            )
            found = scenes.parse(text).run(400)
            assert (-found.force[:, 1] / found.force[:, 0]).mean() == pytest.approx(
                wanted, abs=0.005
            )


def test_a_mirrored_scene_from_files(tmp_path):
    """An own body along an own path, and both mirrored, in CSV files."""
    t = np.linspace(0, 1, 21)
    x, z, angle = 0.1 * t, -0.02 - 0.03 * np.sin(3 * t), 0.5 * t**2
    body = np.array([(0, 0), (0.02, -0.01), (0.05, 0.01), (0.02, 0.03)])
    runs = []
    for side in (1, -1):
        rows = "\n".join(
            ",".join(map(repr, row))
            for row in np.stack([t, side * x, z, side * angle], -1).tolist()
        )
        (tmp_path / "path.csv").write_text("t,x,z,angle\n" + rows)
        rows = "\n".join(
            ",".join(map(repr, row)) for row in (body * [side, 1]).tolist()
        )
        (tmp_path / "body.csv").write_text("x,z\n" + rows)
        (tmp_path / "s.toml").write_text(
            '[medium]\nzeta = 0.3\n[intruder]\nkind = "spline"\nfile = "body.csv"\nwidth = 0.02\n'
            '[motion]\nkind = "csv"\nfile = "path.csv"\n[numerics]\nelements = 400\n'
        )
        runs.append(scenes.load(tmp_path / "s.toml").run())
    size = np.abs(runs[0].force).max()
    assert size > 0.1
    np.testing.assert_allclose(runs[1].force * [-1, 1], runs[0].force, atol=1e-4 * size)
    np.testing.assert_allclose(-runs[1].moment, runs[0].moment, atol=1e-5 * size)


def test_what_is_written_reads_the_same():
    """Scenes as read, and made of every outline and motion."""
    for name in FLAT:
        scene = scenes.load(name)
        assert scenes.toml(scene) == scene.text
        again = scenes.parse(scenes.toml(dataclasses.replace(scene, elements=77)))
        assert (again.medium, again.intruder, again.motion, again.elements) == (
            *_parts(scene),
            77,
        )
    motions = (
        Drag(0.02, attitude=0.1),
        Penetrate(0.03, 1.1),
        Rotate(0.02, -3.0, 1.0, -2.0, 0.3, 55),
    )
    stress = StressMap(0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.1, 0.02, "cut")
    for k, shape in enumerate(OUTLINES.values()):
        scene = IntruderScene(stress, shape, motions[k % 3], elements=31)
        assert scenes.parse(scenes.toml(scene)) == scene
    with pytest.raises(Refusal, match="has a CSV file of its own"):
        scenes.toml(IntruderScene(STRESSES["measured"], shape, motions[0]))


def _parts(scene):
    return scene.medium, scene.intruder, scene.motion


REFUSED = [
    (
        "[intruder]",
        "[motion.x]",
        "the table [intruder] is missing: add it, see 'geomech scenes --show c-leg'",
    ),
    ("[medium]", "[media]", "table: 'media' is unknown: did you mean 'medium'"),
    (
        'name = "poppy-seeds-close"',
        'name = "poppy"',
        "[medium] name: 'poppy' is unknown",
    ),
    (
        'name = "poppy-seeds-close"',
        'name = "glass-0.3mm-loose"',
        "[medium] name: 'glass-0.3mm-loose' is unknown",
    ),
    (
        'name = "poppy-seeds-close"',
        "A00 = 0.1",
        "has no A10, B01, B11, Bm11, C01, C11, Cm11, D10: keep one of",
    ),
    (
        'name = "poppy-seeds-close"',
        'name = "generic"\nA00 = 0.1',
        "keep one of 'name', 'file' and the nine",
    ),
    (
        "zeta = 0.5",
        "zeta = -0.5",
        "[medium] zeta must be a number from 0 to 1e+06, got -0.5",
    ),
    ("zeta = 0.5", 'zeta = "a"', "[medium] Expected `float`, got `str`"),
    (
        "zeta = 0.5",
        "zetta = 0.5",
        "[medium] key: 'zetta' is unknown: did you mean 'zeta'",
    ),
    ("zeta = 0.5", 'tension = "pull"', "tension must be 'keep' or 'cut', got 'pull'"),
    ("zeta = 0.5", 'file = "no.csv"', "keep one of 'name', 'file'"),
    (
        'name = "poppy-seeds-close"',
        'file = "no.csv"',
        "No such file or directory; give a CSV file with the header beta,gamma",
    ),
    (
        'kind = "polygon"',
        'kind = "poligon"',
        "[intruder] kind: 'poligon' is unknown: did you mean 'polygon'",
    ),
    (
        'kind = "polygon"',
        'kind = "cyllinder"',
        "[intruder] kind: 'cyllinder' is unknown: did you mean 'cylinder'",
    ),
    (
        'kind = "polygon"',
        "",
        "[intruder] has no 'kind': add kind = one of plate, round-rod",
    ),
    ("[0.03, 0.02]", "[0.03, 0.02], [0.01, -0.02]", "of the outline cross or touch"),
    ("[0.03, 0.02]", "[0.03]", "[intruder]"),
    (
        "points = [[0, 0], [0.04, 0.0], [0.03, 0.02]]",
        'file = "no.csv"',
        "[intruder] cannot read",
    ),
    ("width = 0.03", "width = 0.03\nfile = 'b.csv'", "give either 'file' or 'points'"),
    ("width = 0.03", "width = 30", "width must be a number from 1e-06 to 10 m, got 30"),
    ("width = 0.03", "", "[intruder] has no `width`: add"),
    (
        'kind = "drag"',
        'kind = "dragg"',
        "[motion] kind: 'dragg' is unknown: did you mean 'drag'",
    ),
    ("depth = 0.01", "depth = nan", "depth must be a number"),
    (
        "direction_deg = 30",
        "direction_deg = 30\ndirection = 1",
        "direction is given twice",
    ),
    ("samples = 7", "samples = 1", "samples must be a whole number from 2"),
    ("samples = 7", "samples = 7\nrate = 3", "[motion] key: 'rate' is unknown"),
    ("elements = 40", "elements = 0", "elements must be a whole number from 1 to 5000"),
    ("elements = 40", "grid = 40", "[numerics] key: 'grid' is unknown"),
    ("[numerics]", "[gait]", "table: 'gait' is unknown"),
    ("[motion]", "[x]\n[motion]", "table: 'x' is unknown"),
]


@pytest.mark.parametrize(
    ("old", "new", "said"), REFUSED, ids=[said for *_, said in REFUSED]
)
def test_what_makes_no_sense_is_refused(old, new, said):
    assert old in MADE
    with pytest.raises(Refusal) as caught:
        scenes.parse(MADE.replace(old, new), "made")
    assert said in str(caught.value) and str(caught.value).startswith("made")
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 450


TABLES = [
    ("", "header must be t,x,z, and angle if wanted"),
    ("t,x,y\n0,0,0\n", "path.csv, line 1: the header must be t,x,z"),
    ("t,x,z,z\n0,0,0,0\n", "line 1: the header has 2 columns z"),
    (
        "t,x,z\n0,0,0\n1,1\n2,2,0\n",
        "line 3: a row must be 3 finite numbers (t,x,z), at most 1e+12, got '1,1'",
    ),
    ("t,x,z\n0,0,0\n1,1,cm\n", "line 3: a row must be 3 finite numbers"),
    ("t,x,z\n0,0,0\n1,nan,0\n", "line 3: a row must be 3 finite numbers"),
    ("t,x,z\n0,0,0\n1,1,0\n", "a path takes 3 to 100000 poses, got 2"),
    ("t,x,z\n0,0,0\n1,1,0\n1,2,0\n", "t must ascend"),
    ("t,x,z\n0,0,0\n1,5000,0\n2,2,0\n", "x must be finite and within 1000 m"),
    (b"\x89\xfe\x00", "it is not text"),
]


@pytest.mark.parametrize(("text", "said"), TABLES, ids=[said for _, said in TABLES])
def test_bad_tables_are_refused_with_their_line(text, said, geomech, tmp_path):
    (tmp_path / "path.csv").write_bytes(
        text if isinstance(text, bytes) else text.encode()
    )
    (tmp_path / "s.toml").write_text(
        MADE[: MADE.index("[motion]")] + '[motion]\nkind = "csv"\nfile = "path.csv"\n'
    )
    code, out, err = geomech("intrude", "s.toml")
    assert (code, out) == (2, "") and said.replace("it is not text", "text") in err
    assert err.count("\n") == 1


def test_scenes_of_the_other_kind_are_refused_with_the_command_for_them(geomech):
    refused(
        geomech("intrude", "three-link-glass"),
        "three-link-glass: a scene with a gait has no [intruder]",
    )
    for command in (
        ["run", "c-leg", "-o", "out"], ["velocity", "c-leg", "--alpha", "0", "--alphadot", "1"],
        ["connection", "c-leg", "-o", "a.nc"], ["ccf", "c-leg", "--plot", "a.png"],
        ["displacement", "c-leg", "--amplitudes", "1"],
        ["sweep", "c-leg", "--over", "gait.amplitude=1,2", "-o", "a.nc"],
    ):  # fmt: skip
        refused(
            geomech(*command),
            "c-leg: an intruder scene has no gait: give it to 'geomech intrude'",
        )
    with pytest.raises(
        ValueError, match="a study is that of a Scene, got IntruderScene"
    ):
        SceneTables(scenes.load("c-leg"))


def test_options_of_stress_and_intrude_are_refused_before_anything_is_written(
    geomech, tmp_path
):
    refused(
        geomech("stress", "generic", "--beta", "10"), "give both --beta and --gamma"
    )
    refused(geomech("stress", "generic"), "give both --beta and --gamma")
    refused(
        geomech("stress", "generic", "--beta", "nan", "--gamma", "0"), "must be finite"
    )
    refused(
        geomech("stress", "generics", "--beta", "1", "--gamma", "0"),
        "medium: 'generics' is unknown: did you mean 'generic'",
    )
    refused(
        geomech("stress", "no.csv", "--beta", "1", "--gamma", "0"),
        "No such file or directory",
    )
    refused(geomech("stress", "generic", "--plot", "a.gif"), "end the name in .png")
    refused(
        geomech("intrude", "c-leg", "-o", "a.gif"), "end the name in one of .nc, .json"
    )
    refused(geomech("intrude", "c-leg", "--plot", "a.gif"), "end the name in .png")
    refused(geomech("intrude", "c-leg", "-o", "no/a.csv"), "cannot write no/a.csv")
    refused(
        geomech("intrude", "c-legs"), "scene: 'c-legs' is unknown: did you mean 'c-leg'"
    )
    assert list(tmp_path.iterdir()) == []


def test_a_tolerance_that_is_just_met_is_met(monkeypatch):
    """By the fewest elements, in force and moment."""
    monkeypatch.setattr(intrusion, "TOLERANCES", np.array([1e-2, 9.9e-3, 1e-3]))
    errors = {"force_error": [5e-3, 2e-3], "moment_error": [1e-2, 1e-3]}
    measured = Measurements(
        [Setting("elements", (8, 16), 2)],
        np.array([[8.0, 16.0]]),
        np.array([[1.0, 2.0]]),
        {name: np.array([values]) for name, values in errors.items()},
    )
    found = Settings(scenes.load("c-leg")).choices(measured)
    by_name = {v.name: v.values for v in found}
    np.testing.assert_array_equal(by_name["best_value"], [8, 16, np.nan])
    np.testing.assert_array_equal(by_name["best_error"], [1e-2, 2e-3, np.nan])


def test_accuracy_of_the_number_of_elements(geomech, tmp_path, monkeypatch):
    monkeypatch.setattr(IntruderScene, "ladder", (12, 25, 50, 100, 200, 800))
    (tmp_path / "s.toml").write_text(MADE)
    code, out, err = geomech("accuracy", "s.toml", "--json")
    assert (code, err) == (0, "")
    found = of_json(out)
    error = found["moment_error"].values[0]
    assert found["order_by_theory"].values.tolist() == ["2"]
    assert found["moment_order"][0] > 1.7 and error[-1] < 1e-5
    exact = scenes.load(tmp_path / "s.toml").run(800)
    off = scenes.load(tmp_path / "s.toml").run(12).moment - exact.moment
    wanted = np.sqrt(np.mean(off**2)) / np.abs(exact.moment).max()
    assert error[0] == pytest.approx(wanted, rel=1e-9)


def test_pictures_show_what_was_computed():
    scene = scenes.load("c-leg")
    found = scene.run()
    fig = plots.intrusion_figure(scene, answer(scene))
    bodies, forces, moment = fig.axes
    drawn = bodies.lines[0].get_xydata()
    a = found.pose[0, 2]
    tip = -0.076 * np.array([math.sin(a), math.cos(a)]) + [0, 0.02]
    np.testing.assert_allclose(drawn[[0, -1]], [(0, 0.02), tip], atol=1e-12)
    np.testing.assert_array_equal(forces.lines[0].get_ydata(), found.force[:, 0])
    np.testing.assert_array_equal(forces.lines[1].get_ydata(), found.force[:, 1])
    np.testing.assert_array_equal(moment.lines[0].get_ydata(), found.moment)
    assert forces.get_xlabel() == "angle (degrees)"


def test_a_scene_made_in_python_runs_and_says_what_is_wrong():
    scene = IntruderScene(
        StressMap(zeta=0.3),
        CLeg(0.04, 0.02, 0.5),
        Drag(depth=0.02, distance=0.1),
        elements=30,
    )
    assert scene.run().force.shape == (51, 2) and isinstance(scene.outline, Outline)
    for part, said in (
        ("medium", "a stress map such as"),
        ("intruder", "a body such as"),
        ("motion", "a motion such as"),
    ):
        with pytest.raises(ValueError, match=said):
            IntruderScene(
                **{
                    "medium": scene.medium,
                    "intruder": scene.intruder,
                    "motion": scene.motion,
                    part: 3,
                }
            )


def outcome(text):
    """'run' or 'refused'; anything else raises."""
    try:
        found = scenes.parse(text).run()
    except ValueError as error:
        message = str(error)
        assert message
        assert "\n" not in message
        assert len(message) < 450
        return "refused"
    assert (
        np.isfinite(found.force).all()
        and np.isfinite(found.moment).all()
        and np.isfinite(found.power).all()
    )
    return "run"


@pytest.mark.parametrize("seed", range(2))
def test_mutated_intruder_scenes_are_run_or_refused(seed):
    rng = np.random.default_rng(seed)
    texts = [MADE, *(scenes.load(name).text for name in FLAT)]
    values = [
        *VALUES,
        '"cut"',
        '"c-leg"',
        '"wheel"',
        '"penetrate"',
        '"up"',
        "360",
        "-0.04",
    ]
    keys = "kind zeta tension grazing_deg radius length width side flat lugs lug_height direction_deg rate start stop_deg"
    keys = f"{keys} samples elements closed points attitude A00 speed depth".split()
    seen = [
        outcome(mutated(texts[rng.integers(len(texts))], rng, keys, values))
        for _ in range(500)
    ]
    assert seen.count("run") > 50 and seen.count("refused") > 200


def test_a_moment_of_roundoff_has_its_error_over_the_force_times_the_size():
    """And where there is no force, either, an error is a force."""
    question = types.SimpleNamespace(
        measures=("force", "moment"), scene=types.SimpleNamespace(size=0.5)
    )
    for force, over in ((4.0, 2.0), (0.0, 1.0)):
        truth = [np.array([[force, 0.0]]), np.array([1e-15 * force])]
        found = Settings.errors(question, [truth[0], truth[1] + 0.02], truth)
        assert found == {"force": 0.0, "moment": pytest.approx(0.02 / over)}
