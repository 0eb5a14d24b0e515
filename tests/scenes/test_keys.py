"""Every key of a scene file is told from the class that reads it, and the schema for
editors agrees with the reader."""

import dataclasses
import json
import pathlib
import re
import tomllib

import pytest

from geomech.scenes import (
    builtin_names,
    from_tables,
    intruder_names,
    load,
    parse,
    walker_names,
)
from geomech.scenes.format.key import Key, aliases
from geomech.scenes.format.keys import SCENES, all_variants, sections, worded
from geomech.scenes.format.schema import schema
from geomech.scenes.format.sections import file_sections, keys_in
from rft import CATALOGUE
from rft.core.refusal import Refusal
from rft.terradynamics.plates import VERTICAL

VARIANTS = [  # every class that a scene may name
    variant
    for scene in SCENES.values()
    for how, *_ in file_sections(scene).values()
    if not isinstance(how, Key)
    for variant in all_variants(how)
]
PAGE = pathlib.Path(__file__).parents[2] / ".docs" / "how-it-works" / "extending.md"


# Told


def test_every_key_of_every_class_has_a_type_a_unit_and_a_meaning():
    """From its annotation, and "name (unit): meaning." in the docstring."""
    for variant in VARIANTS:
        names = aliases(variant.kind)
        fields = [x.name for x in dataclasses.fields(variant.kind) if x.init]
        keys = keys_in(variant)
        if not variant.file:
            left_out = ("solver", *variant.inner)
            own = [names.get(x, x) for x in fields]
            assert [key.name for key in keys] == [x for x in own if x not in left_out]
        for key in keys:
            place = f"{variant.kind.__name__}.{key.name}"
            assert re.search(r"[a-z]{2}|\|z\|", key.meaning), place
            assert 0 < len(key.unit) < 25 and len(key.meaning) < 500, place
            assert worded(key.schema) != "value", place  # no scene file has its type
            assert key.degrees == (key.unit == "rad"), place


def test_the_command_prints_angles_as_degrees_too_and_all_sections(geomech):
    _, out, _ = geomech("reference")
    assert all(part.title in out for parts in sections().values() for part in parts)
    assert re.search(r"\n +gamma0 +number +rad +required [^:]*as\s+gamma0_deg", out)
    told = "error: SECTION: 'bdy' is unknown: did you mean 'body'?\n"
    assert geomech("reference", "bdy") == (2, "", told)
    assert geomech("reference", "body", "--json-schema")[0] == 2


@pytest.mark.usefixtures("own_parts")
def test_keys_of_custom_classes_are_told(geomech):
    section = PAGE.read_text().partition("## Laws, bodies")[2]
    code = re.search(r"```python\n(.*?)```", section, re.S)[1]
    pathlib.Path("power.py").write_text(code)
    _, out, _ = geomech("reference", "medium", "--plugin", "power.py")
    assert re.search(
        r'law = "power"\nDrag .*\n  power +number +- +required +0 dry', out
    )
    _, out, _ = geomech("reference", "--json-schema", "--plugin", "power.py")
    media = json.loads(out)["$defs"]["gaits"]["medium"]["oneOf"]
    assert {"const": "power"} in [x["properties"].get("law") for x in media]


# The schema


@pytest.fixture(scope="module")
def valid():
    jsonschema = pytest.importorskip("jsonschema")  # of the extra `test`
    own = json.loads(json.dumps(schema()))
    jsonschema.Draft202012Validator.check_schema(own)
    return jsonschema.Draft202012Validator(own).is_valid


def is_read(scene):
    try:
        from_tables(scene, "scene")
    except Refusal:
        return False
    return True


def changed_scenes():
    """(scene, whether it is good, if known): those that ship, and with one key wrong,
    each key of each kind of part once."""
    seen = set()
    for name in builtin_names() + intruder_names() + walker_names():
        scene = tomllib.loads(load(name).text)
        yield scene, True
        yield {**scene, "mediun": {}}, False
        for table, value in scene.items():
            parts = value if isinstance(value, list) else [value]
            for k, part in enumerate(parts):
                for key, other, good in wrong_keys(part):
                    kind = [part.get(x) for x in ("kind", "law", "name")]
                    case = (*scene, table, *kind, key, good)
                    if case in seen:
                        continue
                    seen.add(case)
                    new = [*parts[:k], other, *parts[k + 1 :]]
                    table_of = new if isinstance(value, list) else other
                    yield {**scene, table: table_of}, good


def wrong_keys(part):
    """(key, part with this key wrong, False where it must be refused)."""
    yield "lenght", {**part, "lenght": 1}, False
    for key, value in part.items():
        yield key, {**part, key: 1 if key == "reverse" else True}, False
        if isinstance(value, float):
            unbounded = key in ("ratio", "k")
            yield key, {**part, key: 1e300}, None if unbounded else False
        if key in ("kind", "law", "name"):
            yield key, {x: v for x, v in part.items() if x != key}, None


def test_scenes_that_ship_are_valid_and_wrong_keys_are_not(valid):
    for scene, good in changed_scenes():
        assert valid(scene) == is_read(scene), scene
        assert good in (None, valid(scene)), scene


SWIM = '\n[body]\nkind = "chain"\n[gait]\nkind = "ellipse"\nsemi_axes_deg = [40, 30]\n'
CIRCLE = '\n[gait]\nkind = "circle"\n'
GLASS = '[medium]\nname = "glass-0.3mm-loose"\n'
DRY = '[medium]\nlaw = "coulomb"\n'
GRAINY = '[medium]\nlaw = "granular"\nC = 1\n'
TABLE = '[medium]\nlaw = "table"\npsi_deg = [0, 45, 90]\nf_t = [1, 0.7, 0]\n'
CAPS = f'{GLASS}[physical]\nlength = 0.3\n[[effects]]\nkind = "end-caps"\n'
SLED = CAPS.replace("end-caps", "towed-sled") + "pull = 1\n"
DEPTH = f'{DRY}[[effects]]\nkind = "depth-profile"\n'
INSIDE = '[system.medium]\nlaw = "coulomb"\n[system.body]\nkind = "chain"'
HEAVY = '[[effects]]\nkind = "body-inertia"\nfrequency = 2\ndrag = 1\n'
SNAKE = '[system]\nkind = "no-slip-snake"\n'
SWIMMERS = [
    (f"{GRAINY}gamma0_deg = 13{SWIM}", True),
    (f"{GRAINY}gamma0 = 0.2\ngamma0_deg = 13{SWIM}", False),
    (GRAINY + SWIM, False),
    (f'[medium]\nlaw = "viscous"\nC = 1{SWIM}', False),
    (f'[medium]\nname = "glass"{SWIM}', False),
    (f"{TABLE}f_n = [0, 2, 3]{SWIM}", True),
    (TABLE + SWIM, False),
    (f'[medium]\nfile = "sand.toml"\nC = 1{SWIM}', False),
    (f'{DRY}name = "coulomb"{SWIM}', False),
    (f"{DEPTH}towards_deg = 3{SWIM}", True),
    (f"{DEPTH}towards_deg = 3\ntowards = 1{SWIM}", False),
    (f'{GLASS}[[effects]]\nkind = "end-caps"\nhead = 3{SWIM}', False),
    (f"{CAPS}radius_m = 0.01{SWIM}", True),
    (f"{CAPS}radius_m = 0.01\nradius = 0.1{SWIM}", False),
    (CAPS.replace("0.3\n[[", "0.3\nradius_m = 0.01\n[[") + SWIM, True),
    (CAPS.replace("length", "height") + SWIM, False),
    (f"{SLED}distance_m = 0.1{SWIM}", True),
    (f"{SLED}distance = 0\ndistance_m = 0.1{SWIM}", False),
    (f'{DRY}[numerics]\ngrid = 9\nloads = "gauss:8"\ncycles = 2{SWIM}', True),
    (f"{DRY}[numerics]\ngrid = 9.5{SWIM}", False),
    (f'frame = "link-2"\n{DRY}{SWIM}', True),
    (f'[system]\nkind = "swimmer"\n{INSIDE}{CIRCLE}', True),
    (f"{DRY}{SWIM}{HEAVY}[physical]\nmass = 1\nlength = 0.3\n", True),
    (f"{SNAKE}lengths = [1, 2, 1]{CIRCLE}", True),
    (f"{SNAKE}lengths = [1, 2]{CIRCLE}", False),
    (f'[system]\nkind = "no-slip-snak"{CIRCLE}', False),
    (SNAKE, False),
    ("", False),
]


def intruder(medium, body, motion, more=""):
    return f"[medium]\n{medium}\n[intruder]\n{body}\n[motion]\n{motion}\n{more}"


NAMES = ["A00", "A10", "B11", "B01", "Bm11", "C11", "C01", "Cm11", "D10"]
NINE = "\n".join(f"{name} = 1" for name in NAMES)
PLATE = 'kind = "plate"\nlength = 0.1\nwidth = 0.1'
STEP = 'kind = "drag"\ndepth = 0.1'
POLYGON = 'kind = "polygon"\nwidth = 1'
POINTS = "points = [[0, 0], [1, 0], [0, 1]]"
STEEL = 'name = "glass-3mm"'
HOLE = '[[effects]]\nkind = "disturbed-ground"\nradius = 0.1\nweakening = 1\n'
INTRUDERS = [
    (intruder("zeta = 1", PLATE, STEP), True),
    (intruder("", PLATE, STEP), False),
    (intruder('tension = "cut"', PLATE, STEP), False),
    (intruder(NINE, PLATE, STEP), True),
    (intruder(NINE.replace("m1", "-1"), PLATE + "\ntilt_deg = 10", STEP), True),
    (intruder(NINE.replace("A10 = 1", ""), PLATE, STEP), False),
    (intruder(f"{NINE}\nB-11 = 1", PLATE, STEP), False),
    (intruder(f"{NINE}\n{STEEL}", PLATE, STEP), False),
    (intruder(f"A00 = 1\n{STEEL}", PLATE, STEP), False),
    (intruder(f"{STEEL}\nzeta = 2\ngrazing_deg = 0", PLATE, STEP), True),
    (intruder(f"{STEEL}\ngrazing_deg = 0\ngrazing = 0", PLATE, STEP), False),
    (intruder('name = "glass-0.3mm-loose"', PLATE, STEP), False),
    (intruder('law = "coulomb"', PLATE, STEP), False),
    (intruder("zeta = 1", f"{PLATE}\ntilt = 1\ntilt_deg = 1", STEP), False),
    (intruder("zeta = 1", f"{POLYGON}\n{POINTS}", STEP), True),
    (intruder("zeta = 1", POLYGON, STEP), False),
    (intruder("zeta = 1", f'{POLYGON}\nfile = "a.csv"\n{POINTS}', STEP), False),
    (intruder("zeta = 1", PLATE, 'kind = "csv"'), False),
    (intruder("zeta = 1", PLATE, STEP, "[numerics]\nelements = 20"), True),
    (intruder("zeta = 1", PLATE, STEP, "[numerics]\nphases = 20"), False),
    (intruder("zeta = 1", PLATE, STEP, CIRCLE), False),
    (intruder("zeta = 1", PLATE, STEP, f"{HOLE}places = [0.1]"), True),
    (intruder("zeta = 1", PLATE, STEP, HOLE), False),
    (f"[medium]\nzeta = 1\n[motion]\n{STEP}", False),
    (f"[medium]\nzeta = 1\n[intruder]\n{PLATE}", False),
]
XI = "xi_n = 3e5"
MOHR = "density = 1500\ninternal_friction = 0.5"
BALL = 'kind = "sphere"\nradius = 0.02'
MESH = 'kind = "mesh"\nradius = 0.02'
ROLL = 'kind = "drag"\ndepth = 0.05\nheading_deg = 30'
SLOPE = '[[effects]]\nkind = "slope"\nangle_deg = 5'
MESHES = [
    (intruder(XI, BALL, ROLL, SLOPE), True),
    (intruder(MOHR, BALL, ROLL), True),
    (intruder("density = 1500", BALL, ROLL), False),
    (intruder(f"{MOHR}\n{XI}", BALL, ROLL), False),
    (intruder(f'{STEEL}\nzeta = 2\ntension = "push"', BALL, ROLL), True),
    (intruder("zeta = 2", BALL, ROLL), False),
    (intruder(f"{XI}\nzeta = 2", BALL, ROLL), False),
    (intruder(f"{XI}\ngrazing_deg = 0\ngrazing = 0", BALL, ROLL), False),
    (intruder('name = "glass-0.3mm-loose"', BALL, ROLL), False),
    (intruder(f"{STEEL}\n{XI}", BALL, ROLL), False),
    (intruder(f"{STEEL}\nsurface_friction = 0.2", PLATE, STEP), False),
    (intruder(XI, PLATE, STEP), False),
    (intruder(XI, f"{BALL}\nwidth = 1", ROLL), False),
    (intruder(STEEL, PLATE, ROLL), False),
    (intruder(XI, f'{MESH}\nshape = "sphere"', ROLL), True),
    (intruder(XI, f'{MESH}\nshape = "screw"', ROLL), False),
    (intruder(XI, MESH, ROLL), False),
    (intruder(XI, f'{BALL}\nshape = "sphere"', ROLL), False),
    (intruder(XI, f'{MESH}\nshape = "sphere"\nfile = "a.stl"', ROLL), False),
    (intruder(XI, BALL, f"{ROLL}\nattitude_deg = [0, 30, 0]"), True),
    (intruder(XI, BALL, f"{ROLL}\nattitude_deg = 30\nattitude = 1"), False),
    (intruder(XI, BALL, 'kind = "csv"'), False),
    (intruder(XI, BALL, ROLL, "[numerics]\ntriangles = 20"), True),
    (intruder(XI, BALL, ROLL, "[numerics]\nelements = 20"), False),
    (intruder(STEEL, PLATE, STEP, "[numerics]\ntriangles = 20"), False),
]


def walker(robot, gait, more=""):
    medium = '[medium]\nname = "poppy-seeds-loose"'
    return f"{medium}\n[robot]\nmass = 0.2\n{robot}\n[gait]\n{gait}\n{more}"


LEG = '[robot.legs]\nkind = "flat-leg"\nradius = 0.02\nwidth = 0.01'
RHEX = 'kind = "rhex"\nlength = 0.1\nheight = 0.03\nwidth = 0.05\nhips = [0.0]\n'
BOX = RHEX + LEG
TURN = "frequency = 2"
ALL_OF_GAIT = f"{TURN}\nsweep_deg = 60\nmiddle = 0.1\nduty = 0.4"
TIMED = "[numerics]\nsteps = 16\nrounding = 1e-3\nduration = 2.0"
AIR = '[[effects]]\nkind = "aeration"\nair_speed = 0.1\nfluidisation = 0.3'
WALKERS = [
    (walker(BOX, TURN), True),
    (walker(f"inertia = 1e-3\naxle = -0.01\n{BOX}", ALL_OF_GAIT), True),
    (walker(f'kind = "wheel"\n{LEG}', f"{TURN}\nsweep = 1.0", TIMED), True),
    (walker(BOX, TURN, AIR), True),
    (walker(BOX, TURN, SLOPE), False),
    (walker(BOX, "sweep = 1.0"), False),
    (walker(BOX, ""), False),
    (walker(RHEX, TURN), False),
    (walker(BOX.replace("flat-leg", "sphere"), TURN), False),
    (walker(BOX, f"{TURN}\nsweep = 1.0\nsweep_deg = 60"), False),
    (walker(BOX, TURN, f"[motion]\n{STEP}"), False),
    (walker(BOX, TURN, "[numerics]\nphases = 20"), False),
    (walker(BOX.replace("width", "widht", 1), TURN), False),
]


@pytest.mark.parametrize(("text", "good"), SWIMMERS + INTRUDERS + MESHES + WALKERS)
def test_the_schema_agrees_with_the_reader(text, good, valid):
    scene = tomllib.loads(text)
    assert valid(scene) == good
    assert is_read(scene) == good


MACHINE = """<mujoco><worldbody><body><freejoint/>
<geom type="box" size=".05 .03 .01"/><body><joint name="j" axis="0 1 0"/>
<geom name="foot" type="capsule" fromto="0 0 0 0 0 -.05" size=".01"/></body>
</body></worldbody><actuator><position name="turn" joint="j" kp="1" kv=".1"/>
</actuator></mujoco>"""
MJCF = """[medium]
name = "poppy-seeds-loose"
[robot]
mjcf = "{}"
geoms = ["foot"]
[gait]
frequency = 1.0"""


@pytest.mark.parametrize(
    ("old", "new", "good"),
    [
        ("", "", True),
        ('name = "poppy-seeds-loose"', "xi_n = 3e5", True),
        ('name = "poppy-seeds-loose"', f'law = "3d"\n{MOHR}', True),
        ("name =", 'law = "planar"\nname =', True),
        ("name =", 'law = "spatial"\nname =', False),
        ("mjcf =", 'kind = "mjcf"\nmjcf =', True),
        ("mjcf =", 'kind = "rhex"\nmjcf =', False),
        ("mjcf =", "mass = 1.0\nmjcf =", False),
        ('geoms = ["foot"]', "", False),
        ("[gait]", 'actuators = ["turn"]\nphases = [0.5]\n[gait]', True),
    ],
)
def test_the_schema_agrees_with_the_reader_of_mjcf_robots(
    old, new, good, valid, tmp_path
):
    pytest.importorskip("mujoco")
    (tmp_path / "r.xml").write_text(MACHINE)
    scene = tomllib.loads(MJCF.format(tmp_path / "r.xml").replace(old, new))
    assert valid(scene) == good
    assert is_read(scene) == good


PATH = 'kind = "csv"\nfile = "path.csv"'
SPLINE = 'kind = "spline"\nfile = "points.csv"\nwidth = 1'
STL = 'kind = "mesh"\nfile = "body.stl"\nscale = 0.001\nsmooth = true'


@pytest.mark.parametrize(
    "text",
    [
        f'[medium]\nfile = "sand.toml"{SWIM}',
        f'[medium]\nlaw = "table"\nfile = "drag.csv"{SWIM}',
        intruder('file = "sand.toml"', SPLINE, PATH),
        intruder('file = "drag.csv"', SPLINE, STEP),
        intruder('file = "sand.toml"\nzeta = 2', STL, PATH),
    ],
)
def test_files_are_valid_wherever_they_are(text, valid):
    assert valid(tomllib.loads(text))


@pytest.mark.parametrize("name", [*CATALOGUE, *VERTICAL])
def test_named_media_are_shown_as_a_table_that_makes_them(name, geomech):
    code, out, err = geomech("scenes", "--show", name)
    assert (code, err) == (0, "")
    comments = [x.lstrip("# ") for x in out.splitlines() if x.startswith("#")]
    if name in CATALOGUE:
        assert CATALOGUE[name].source in " ".join(comments)
        assert parse(out + SWIM).system.medium == CATALOGUE[name].medium
    else:
        assert VERTICAL[name].source in " ".join(comments)
        scene = parse(f"{out}[intruder]\n{PLATE}\n[motion]\n{STEP}\n")
        assert scene.medium == VERTICAL[name].stress
