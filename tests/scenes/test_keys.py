"""Every key of a scene file is told from the class that reads it, and the schema for
editors agrees with the reader."""

import dataclasses
import json
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
from geomech.scenes.format.key import MARK, Key, aliases
from geomech.scenes.format.keys import SCENES, all_variants, sections, worded
from geomech.scenes.format.schema import schema
from geomech.scenes.format.sections import file_sections, keys_in
from rft import CATALOGUE
from rft.core.refusal import Refusal

VARIANTS = [  # every class that a scene may name
    variant
    for scene in SCENES.values()
    for how, *_ in file_sections(scene).values()
    if not isinstance(how, Key)
    for variant in all_variants(how)
]


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
            assert key.unit and re.search(r"[a-z]{2}|\|z\|", key.meaning), place
            assert worded(key.schema) != "value", place  # no scene file has its type
            assert key.degrees == (key.unit == "rad"), place


def test_a_meaning_ends_where_that_of_the_next_key_begins():
    """Wherever the line of the docstring breaks."""
    keys = [key for parts in sections().values() for part in parts for key in part.keys]
    assert [key.name for key in keys if MARK.search(key.meaning)] == []


def test_a_kind_is_described_by_a_whole_sentence_or_not_at_all():
    described = [part.about for parts in sections().values() for part in parts]
    assert [about for about in described if re.search(r"^\.|[ ,]\.$", about)] == []


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


@pytest.mark.parametrize("names", [builtin_names, intruder_names, walker_names])
def test_scenes_that_ship_are_valid(names, valid):
    assert all(valid(tomllib.loads(load(name).text)) for name in names())


@pytest.mark.parametrize(
    "name", ["sandfish-heavy", "seven-link-modes", "no-slip-snake", "screw", "xplorer"]
)
def test_each_key_with_a_wrong_value_is_valid_where_it_is_read(name, valid):
    scene = tomllib.loads(load(name).text)
    for table, value in scene.items():
        first = value[0] if isinstance(value, list) else value
        for key in ("lenght", *first):
            for wrong in (True, 1e300):
                part = {**first, key: wrong}
                changed = {**scene, table: [part] if value is not first else part}
                assert valid(changed) == is_read(changed), changed


SWIM = '\n[body]\nkind = "chain"\n[gait]\nkind = "ellipse"\nsemi_axes_deg = [40, 30]\n'
CIRCLE = '\n[gait]\nkind = "circle"\n'
GLASS = '[medium]\nname = "glass-0.3mm-loose"\n'
DRY = '[medium]\nlaw = "coulomb"\n'
GRAINY = '[medium]\nlaw = "granular"\nC = 1\n'
TABLE = '[medium]\nlaw = "table"\npsi_deg = [0, 45, 90]\nf_t = [1, 0.7, 0]\n'
CAPS = f'{GLASS}[physical]\nlength = 0.3\n[[effects]]\nkind = "end-caps"\n'
SWIMMERS = [
    (f"{GRAINY}gamma0_deg = 13{SWIM}", True),
    (f"{GRAINY}gamma0 = 0.2\ngamma0_deg = 13{SWIM}", False),
    (GRAINY + SWIM, False),
    (f'[medium]\nlaw = "viscous"\nC = 1{SWIM}', False),
    (f"{TABLE}f_n = [0, 2, 3]{SWIM}", True),
    (TABLE + SWIM, False),
    (f'[medium]\nfile = "sand.toml"\nC = 1{SWIM}', False),
    (f'{DRY}name = "coulomb"{SWIM}', False),
    (f"{CAPS}radius_m = 0.01{SWIM}", True),
    (f"{CAPS}radius_m = 0.01\nradius = 0.1{SWIM}", False),
    (CAPS.replace("0.3\n[[", "0.3\nradius_m = 0.01\n[[") + SWIM, True),
    (f'{DRY}[numerics]\ngrid = 9\nloads = "gauss:8"\ncycles = 2{SWIM}', True),
    (f"{DRY}[numerics]\ngrid = 9.5{SWIM}", False),
    (f'frame = "link-2"\n{DRY}{SWIM}', True),
    (f'[system]\nkind = "no-slip-snake"\nlengths = [1, 2, 1]{CIRCLE}', True),
    ("", False),
]


def intruder(medium, body, motion, more=""):
    return f"[medium]\n{medium}\n[intruder]\n{body}\n[motion]\n{motion}\n{more}"


NINE = "A00 A10 B11 B01 Bm11 C11 C01 Cm11 D10".replace(" ", " = 1\n") + " = 1"
PLATE = 'kind = "plate"\nlength = 0.1\nwidth = 0.1'
STEP = 'kind = "drag"\ndepth = 0.1'
POLYGON = 'kind = "polygon"\nwidth = 1\npoints = [[0, 0], [1, 0], [0, 1]]'
STEEL = 'name = "glass-3mm"'
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
    (intruder("zeta = 1", f"{PLATE}\ntilt = 1\ntilt_deg = 1", STEP), False),
    (intruder("zeta = 1", POLYGON, STEP), True),
    (intruder("zeta = 1", 'kind = "polygon"\nwidth = 1', STEP), False),
    (intruder("zeta = 1", f'{POLYGON}\nfile = "a.csv"', STEP), False),
    (intruder("zeta = 1", PLATE, STEP, "[numerics]\nelements = 20"), True),
    (intruder("zeta = 1", PLATE, STEP, "[numerics]\nphases = 20"), False),
]
XI = "xi_n = 3e5"
MOHR = "density = 1500\ninternal_friction = 0.5"
BALL = 'kind = "sphere"\nradius = 0.02'
MESH = 'kind = "mesh"\nradius = 0.02'
ROLL = 'kind = "drag"\ndepth = 0.05\nheading_deg = 30'
MESHES = [
    (intruder(XI, BALL, ROLL), True),
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
    (intruder(XI, BALL, ROLL, "[numerics]\ntriangles = 20"), True),
    (intruder(XI, BALL, ROLL, "[numerics]\nelements = 20"), False),
    (intruder(STEEL, PLATE, STEP, "[numerics]\ntriangles = 20"), False),
]


def walker(robot, gait, more=""):
    medium = '[medium]\nname = "poppy-seeds-loose"'
    return f"{medium}\n[robot]\nmass = 0.2\n{robot}\n[gait]\n{gait}\n{more}"


LEG = '[robot.legs]\nkind = "flat-leg"\nradius = 0.02\nwidth = 0.01'
BOX = f'kind = "rhex"\nlength = 0.1\nheight = 0.03\nwidth = 0.05\nhips = [0.0]\n{LEG}'
TURN = "frequency = 2"
WALKERS = [
    (walker(BOX, TURN), True),
    (walker(f"axle = -0.01\n{BOX}", f"{TURN}\nsweep_deg = 60\nmiddle = 0.1"), True),
    (walker(f'kind = "wheel"\n{LEG}', TURN, "[numerics]\nsteps = 16"), True),
    (walker(BOX, "sweep = 1.0"), False),
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


@pytest.mark.parametrize("name", CATALOGUE)
def test_named_media_are_shown_as_a_table_that_makes_them(name, geomech):
    _, out, _ = geomech("scenes", "--show", name)
    assert parse(out + SWIM).system.medium == CATALOGUE[name].medium
