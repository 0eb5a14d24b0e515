"""Every key of a scene file is told, from the class that reads it, and editors get a schema that agrees with the reader."""

import copy
import dataclasses
import json
import pathlib
import re
import tomllib

import pytest
from commands import geomech

from geomech.scenes import (
    builtin_names,
    from_tables,
    intruder_names,
    kinds,
    load,
    parse,
    walker_names,
)
from geomech.scenes.format.key import Key, aliases, keys_of, meanings
from geomech.scenes.format.keys import SCENES, all_variants, sections, worded
from geomech.scenes.format.schema import schema
from geomech.scenes.format.sections import file_sections, keys_in
from geomech.scenes.model import Scene
from rft import CATALOGUE
from rft.core.refusal import Refusal
from rft.laws import LAWS
from rft.terradynamics.plates import VERTICAL

TABLES = file_sections(Scene)
EVERY = {  # section and name of every class that a scene may name, by kind of scene
    f"{group}-{section}-{variant.label or variant.kind.__name__}": (section, variant)
    for group, scene in SCENES.items()
    for section, (how, *_) in file_sections(scene).items()
    if not isinstance(how, Key)
    for variant in all_variants(how)
}
ROOT = pathlib.Path(__file__).parents[2]


def test_every_key_of_every_class_has_a_type_a_unit_and_a_meaning():
    """In the annotation or the docstring of a class: "name (unit): meaning." for each of its fields, - for no unit."""
    for _, variant in EVERY.values():
        fields = [
            aliases(variant.kind).get(f.name, f.name)
            for f in dataclasses.fields(variant.kind)
            if f.init
        ]
        if not variant.file:
            assert [key.name for key in keys_in(variant)] == [
                x for x in fields if x not in ("solver", *variant.inner)
            ]
    for _, variant in EVERY.values():
        for key in keys_in(variant):
            place = f"{variant.kind.__name__}.{key.name}: say in the docstring of the class what it is, as name (unit): meaning"
            assert re.search(r"[a-z]{2}|\|z\|", key.meaning), place
            assert 0 < len(key.unit) < 25, place
            assert len(key.meaning) < 500, f"{place}, and end the paragraph there"
            assert worded(key.schema) != "value", (
                f"{variant.kind.__name__}.{key.name}: of a type that no scene file has"
            )
            assert key.degrees == (key.unit == "rad")


def test_keys_are_told_as_they_are():
    @dataclasses.dataclass(frozen=True)
    class Base:
        """first (rad): of the base. second, third (rad): of both."""

        first: float
        second: float | None = None
        third: tuple[tuple[int, ...], ...] = ()

    @dataclasses.dataclass(frozen=True)
    class Derived(Base):
        """A thing. Not (a key): this one.

        first (1/s): its own,
        on two lines; (in brackets). fourth (-): "text".

        More of first is not told.
        """

        fourth: str = "x"
        fifth: bool = True

    assert meanings(Derived) == {
        "first": ("1/s", "its own, on two lines; (in brackets)"), "second": ("rad", "of both"), "third": ("rad", "of both"),
        "fourth": ("-", '"text"'),
    }  # fmt: skip
    keys = {k.name: k for k in keys_of(Derived)}
    assert [(worded(k.schema), k.value) for k in keys.values()] == [
        ("number", "required"), ("number", "none"), ("list of lists of whole numbers", "[]"), ("text", '"x"'),
        ("true or false", "true"),
    ]  # fmt: skip
    assert keys["fifth"] == Key(
        "fifth", {"type": "boolean"}, "", "", False, True, False
    )
    assert keys["third"].degrees


@pytest.fixture(scope="module")
def printed():
    """What the command prints of each section; of "" of all."""
    ended = {
        section: geomech(*["reference", section][: 1 + bool(section)])
        for section in ("", *sections())
    }
    assert {(code, err) for code, _, err in ended.values()} == {(0, "")}
    return {section: out for section, (_, out, _) in ended.items()}


def test_the_command_prints_them_all_or_a_section(printed):
    for table, variant in EVERY.values():
        assert variant.implied or (variant.label or f"[{table}]") in printed[""]
        assert [
            key.name
            for key in keys_in(variant)
            if f"\n  {key.name} " not in printed[""]
        ] == []
    assert max(map(len, printed[""].splitlines())) <= 120
    assert {*TABLES} <= {*printed}
    body = printed["body"]
    assert "[body]" in body and "[gait]" not in body
    assert re.search(r'^  frame +text +-  "mean" ', body, re.M)
    by_name = "[medium]\nBy name, with no key beside it.\n  name  text  -  required  a medium of the catalogue: glass-"
    assert [section for section in TABLES if by_name in printed[section]] == ["medium"]
    assert '[system] kind = "swimmer"\nA body in a medium' in printed["system"]
    granular = printed["medium"].partition('law = "granular"')[2].partition("\n\n")[0]
    assert re.search(r"\n +C +number +- +required +the extra normal force", granular)
    assert re.search(
        r"\n +gamma0 +number +rad +required [^:]*as\s+gamma0_deg", granular
    )
    code, out, err = geomech("reference", "bdy")
    assert (code, out, err) == (
        2,
        "",
        "error: SECTION: 'bdy' is unknown: did you mean 'body'?\n",
    )
    assert geomech("reference", "body", "--json-schema")[:2] == (2, "")


def test_keys_of_ones_own_classes_are_told(tmp_path, monkeypatch):
    monkeypatch.setattr(kinds, "_sources", {})
    section = (
        (ROOT / ".docs" / "how-it-works" / "extending.md")
        .read_text()
        .partition("## Laws, bodies")[2]
    )
    path = tmp_path / "power.py"
    path.write_text(re.search(r"```python\n(.*?)```", section, re.S)[1])
    try:
        code, out, _ = geomech("reference", "medium", "--plugin", str(path))
        assert code == 0
        assert re.search(
            r'law = "power"\nDrag .*\n  power +number +- +required +0 dry.*\n.*ratio +number +- +3.0',
            out,
        )
        made = json.loads(
            geomech("reference", "--json-schema", "--plugin", str(path))[1]
        )
        assert {"const": "power"} in [
            x["properties"].get("law")
            for x in made["$defs"]["gaits"]["medium"]["oneOf"]
        ]
    finally:
        LAWS.restore({name: law for name, law in LAWS.items() if name != "power"})


@pytest.fixture(scope="module")
def valid():
    jsonschema = pytest.importorskip("jsonschema")  # of the extra `test`
    made = json.loads(json.dumps(schema()))
    jsonschema.Draft202012Validator.check_schema(made)
    return jsonschema.Draft202012Validator(made).is_valid


def tables(name):
    return tomllib.loads(load(name).text)


SEEN = set()  # keys of parts that another scene has had wrong


@pytest.mark.parametrize("name", builtin_names() + intruder_names() + walker_names())
def test_built_in_scenes_are_valid_and_wrong_keys_are_not(name, valid):
    scene = tables(name)
    assert valid(scene)
    assert not valid({**scene, "mediun": {}})
    for table, value in scene.items():
        for k, part in enumerate(value if isinstance(value, list) else [value]):
            named = (
                *sorted(scene),
                table,
                *(part.get(x) for x in ("kind", "law", "name")),
            )
            if (named, *part) in SEEN:
                continue
            SEEN.add((named, *part))
            assert not both(valid, scene, table, k, {**part, "lenght": 1})
            for key, value in part.items():
                if (named, key) in SEEN:
                    continue
                SEEN.add((named, key))
                if isinstance(value, float) and key not in (
                    "ratio",
                    "k",
                ):  # bounds are in the schema, too
                    assert not both(valid, scene, table, k, {**part, key: 1e300})
                assert not both(
                    valid,
                    scene,
                    table,
                    k,
                    {**part, key: True if key != "reverse" else 1},
                )
            if kind := {"kind", "law", "name"} & {*part}:
                bare = both(
                    valid,
                    scene,
                    table,
                    k,
                    {x: v for x, v in part.items() if x not in kind},
                )
                assert not bare or {*part} & {"zeta", "xi_n", "density"}


def both(valid, scene, table, k, part):
    """Whether a scene with this part in place of its own is valid; the schema and the reader must agree."""
    changed = copy.deepcopy(scene)
    if isinstance(changed[table], list):
        changed[table][k] = part
    else:
        changed[table] = part
    try:
        from_tables(changed, "scene")
        read = True
    except Refusal:
        read = False
    assert valid(changed) == read, part
    return read


SIZED = """[medium]
name = "glass-0.3mm-loose"
[physical]
length = 0.3
[[effects]]
kind = "end-caps"
"""


@pytest.mark.parametrize(
    ("toml", "good"),
    [
        ('[medium]\nlaw = "granular"\nC = 1\ngamma0_deg = 13', True),
        ('[medium]\nlaw = "granular"\nC = 1\ngamma0 = 0.2\ngamma0_deg = 13', False),
        ('[medium]\nlaw = "granular"\nC = 1', False),
        ('[medium]\nlaw = "viscous"\nC = 1', False),
        ('[medium]\nname = "glass"', False),
        (
            '[medium]\nlaw = "table"\npsi_deg = [0, 45, 90]\nf_t = [1, 0.7, 0]\nf_n = [0, 2, 3]',
            True,
        ),
        ('[medium]\nlaw = "table"\npsi_deg = [0, 45, 90]\nf_t = [1, 0.7, 0]', False),
        ('[medium]\nfile = "sand.toml"\nC = 1', False),
        ('[medium]\nname = "coulomb"\nlaw = "coulomb"', False),
        (
            '[medium]\nlaw = "coulomb"\n[[effects]]\nkind = "depth-profile"\ntowards_deg = 3',
            True,
        ),
        (
            '[medium]\nlaw = "coulomb"\n[[effects]]\nkind = "depth-profile"\ntowards_deg = 3\ntowards = 1',
            False,
        ),
        (
            '[medium]\nname = "glass-0.3mm-loose"\n[[effects]]\nkind = "end-caps"\nhead = 3',
            False,
        ),
        (
            '[medium]\nname = "glass-0.3mm-loose"\n[physical]\nradius = 0.1\n[[effects]]\nkind = "end-caps"\nhead = 3',
            True,
        ),
        (
            '[medium]\nlaw = "coulomb"\n[physical]\nradius = 0.1\n[[effects]]\nkind = "disturbed-ground"\nweakening = 1',
            False,
        ),
        (SIZED + "radius_m = 0.01", True),
        (SIZED + "radius_m = 0.01\nradius = 0.1", False),
        (SIZED.replace("0.3\n[[", "0.3\nradius_m = 0.01\n[["), True),
        (SIZED.replace("end-caps", "towed-sled") + "pull = 1\ndistance_m = 0.1", True),
        (
            SIZED.replace("end-caps", "towed-sled")
            + "pull = 1\ndistance = 0\ndistance_m = 0.1",
            False,
        ),
        (
            '[medium]\nlaw = "coulomb"\n[numerics]\nphases = 64\ngrid = 9\nloads = "gauss:8"\ncycles = 2',
            True,
        ),
        ('[medium]\nlaw = "coulomb"\n[numerics]\ngrid = 9.5', False),
        ('frame = "link-2"\n[medium]\nlaw = "coulomb"\n[physical]\nlength = 0.3', True),
        ('[medium]\nlaw = "coulomb"\n[physical]\nheight = 0.3', False),
        ("", False),
    ],
)
def test_the_schema_agrees_with_the_reader(toml, good, valid):
    scene = (
        toml
        + '\n[body]\nkind = "chain"\n[gait]\nkind = "ellipse"\nsemi_axes_deg = [40, 30]\n'
    )
    assert valid(tomllib.loads(scene)) == good
    if good:
        parse(scene)
    else:
        with pytest.raises(Refusal):
            parse(scene)


NINE = (
    "A00 = 1\nA10 = 1\nB11 = 1\nB01 = 1\nBm11 = 1\nC11 = 1\nC01 = 1\nCm11 = 1\nD10 = 1"
)
PLATE, STEP = 'kind = "plate"\nlength = 0.1\nwidth = 0.1', 'kind = "drag"\ndepth = 0.1'


@pytest.mark.parametrize(
    ("medium", "intruder", "motion", "more", "good"),
    [
        ("zeta = 1", PLATE, STEP, "", True),
        ("", PLATE, STEP, "", False),
        ('tension = "cut"', PLATE, STEP, "", False),
        (NINE, PLATE, STEP, "", True),
        (
            NINE.replace("m1", "-1"),
            PLATE + "\ntilt_deg = 10",
            STEP,
            "[numerics]\nelements = 20",
            True,
        ),
        (NINE.replace("A10 = 1", ""), PLATE, STEP, "", False),
        (NINE + "\nB-11 = 1", PLATE, STEP, "", False),
        (NINE + '\nname = "generic"', PLATE, STEP, "", False),
        ("A00 = 1\nname = 'generic'", PLATE, STEP, "", False),
        (
            'name = "glass-3mm"\nzeta = 2\ntension = "cut"\ngrazing_deg = 0',
            PLATE,
            STEP,
            "",
            True,
        ),
        ('name = "glass-3mm"\ngrazing_deg = 0\ngrazing = 0', PLATE, STEP, "", False),
        ('name = "glass-0.3mm-loose"', PLATE, STEP, "", False),
        ('law = "coulomb"', PLATE, STEP, "", False),
        ("zeta = 1", PLATE + "\ntilt = 1\ntilt_deg = 1", STEP, "", False),
        (
            "zeta = 1",
            'kind = "polygon"\nwidth = 1\npoints = [[0, 0], [1, 0], [0, 1]]',
            STEP,
            "",
            True,
        ),
        ("zeta = 1", 'kind = "polygon"\nwidth = 1', STEP, "", False),
        (
            "zeta = 1",
            'kind = "spline"\nwidth = 1\nfile = "a.csv"\npoints = [[0, 0], [1, 0], [0, 1]]',
            STEP,
            "",
            False,
        ),
        ("zeta = 1", PLATE, 'kind = "csv"', "", False),
        ("zeta = 1", PLATE, STEP, "[numerics]\nphases = 20", False),
        ("zeta = 1", PLATE, STEP, '[gait]\nkind = "circle"', False),
        ("zeta = 1", None, STEP, "", False),
        ("zeta = 1", PLATE, None, "", False),
    ],
)
def test_the_schema_agrees_with_the_reader_of_intruders(
    medium, intruder, motion, more, good, valid
):
    parts = {"medium": medium, "intruder": intruder, "motion": motion}
    scene = (
        "\n".join(
            f"[{name}]\n{part}" for name, part in parts.items() if part is not None
        )
        + f"\n{more}"
    )
    assert valid(tomllib.loads(scene)) == good
    if good:
        parse(scene)
    else:
        with pytest.raises(Refusal):
            parse(scene)


BALL, ROLL = (
    'kind = "sphere"\nradius = 0.02',
    'kind = "drag"\ndepth = 0.05\nheading_deg = 30',
)


@pytest.mark.parametrize(
    ("medium", "intruder", "motion", "more", "good"),
    [
        ("xi_n = 3e5", BALL, ROLL, "", True),
        ("density = 1500\ninternal_friction = 0.5", BALL, ROLL, "", True),
        ("density = 1500", BALL, ROLL, "", False),
        ("density = 1500\ninternal_friction = 0.5\nxi_n = 3e5", BALL, ROLL, "", False),
        (
            'name = "glass-3mm"\nzeta = 2\ntension = "push"\ngrazing_deg = 0',
            BALL,
            ROLL,
            "",
            True,
        ),
        ("zeta = 2", BALL, ROLL, "", False),
        ("xi_n = 3e5\nzeta = 2", BALL, ROLL, "", False),
        ("xi_n = 3e5\ngrazing_deg = 0\ngrazing = 0", BALL, ROLL, "", False),
        ('name = "glass-0.3mm-loose"', BALL, ROLL, "", False),
        ('name = "glass-3mm"\nxi_n = 3e5', BALL, ROLL, "", False),
        ('name = "glass-3mm"\nsurface_friction = 0.2', PLATE, STEP, "", False),
        ("xi_n = 3e5", PLATE, STEP, "", False),
        ("xi_n = 3e5", BALL + "\nwidth = 1", ROLL, "", False),
        ('name = "glass-3mm"', PLATE, ROLL, "", False),
        (
            "xi_n = 3e5",
            'kind = "mesh"\nshape = "sphere"\nradius = 0.02',
            ROLL,
            "",
            True,
        ),
        (
            "xi_n = 3e5",
            'kind = "mesh"\nshape = "screw"\nradius = 0.02',
            ROLL,
            "",
            False,
        ),
        ("xi_n = 3e5", 'kind = "mesh"\nradius = 0.02', ROLL, "", False),
        (
            "xi_n = 3e5",
            'kind = "sphere"\nshape = "sphere"\nradius = 0.02',
            ROLL,
            "",
            False,
        ),
        (
            "xi_n = 3e5",
            'kind = "mesh"\nshape = "sphere"\nfile = "a.stl"',
            ROLL,
            "",
            False,
        ),
        (
            "xi_n = 3e5",
            BALL,
            ROLL + "\nattitude_deg = [0, 30, 0]",
            "[numerics]\ntriangles = 20",
            True,
        ),
        ("xi_n = 3e5", BALL, ROLL + "\nattitude_deg = 30\nattitude = 1", "", False),
        ("xi_n = 3e5", BALL, 'kind = "csv"', "", False),
        ("xi_n = 3e5", BALL, ROLL, "[numerics]\nelements = 20", False),
        ('name = "glass-3mm"', PLATE, STEP, "[numerics]\ntriangles = 20", False),
        ("xi_n = 3e5", BALL, ROLL, '[[effects]]\nkind = "slope"\nangle_deg = 5', True),
        (
            "zeta = 1",
            PLATE,
            STEP,
            '[[effects]]\nkind = "disturbed-ground"\nplaces = [0.1]\nradius = 0.1\nweakening = 1',
            True,
        ),
        (
            "zeta = 1",
            PLATE,
            STEP,
            '[[effects]]\nkind = "disturbed-ground"\nradius = 0.1\nweakening = 1',
            False,
        ),
        (
            "zeta = 1",
            PLATE,
            STEP,
            '[[effects]]\nkind = "end-caps"\nhead = 3\nradius = 0.1',
            False,
        ),
        ("xi_n = 3e5", BALL, None, "", False),
    ],
)
def test_the_schema_agrees_with_the_reader_of_meshes(
    medium, intruder, motion, more, good, valid
):
    test_the_schema_agrees_with_the_reader_of_intruders(
        medium, intruder, motion, more, good, valid
    )


def test_keys_of_all_scenes_are_told(printed):
    """Each with a type, a unit and a meaning, in the section that it has in a scene file."""
    whole = printed[""]
    for section, parts in sections().items():
        out = printed[section]
        for part in parts:
            assert part.title in out and part.title in whole
            block = out.partition(f"{part.title}\n{part.about[:20]}")[2].partition(
                "\n\n"
            )[0]
            for key in part.keys:
                assert re.search(
                    rf"^  {key.name} +{worded(key.schema)} +{re.escape(key.unit)} +\S+ +.*[a-z]",
                    block,
                    re.M,
                ), key.name
                assert worded(key.schema) != "value" and key.unit, (
                    f"{part.title} {key.name}: say it as name (unit): meaning"
                )
    assert re.search(
        r"\n  tilt +number +rad +0.0 +beta, 0 lying flat; in degrees as tilt_deg", whole
    )
    assert re.search(
        r"\n  B-11 +number +N/cm\^3 +none +coefficient of a sine of alpha_z", whole
    )
    assert re.search(r"\n  elements +whole number +- +100 ", printed["numerics"])
    assert re.search(r"\n  triangles +whole number +- +5000 ", printed["numerics"])
    of_mesh = printed["motion"].partition('[motion] kind = "drag" of a mesh\n')[2]
    assert re.search(
        r"^  heading +number +rad +0.0 ", of_mesh.partition("\n\n")[0], re.M
    )
    assert re.search(
        r"\n  internal_friction +number +- +none +mu, tan of the angle of repose", whole
    )
    assert '[[effects]] kind = "aeration" of an intruder scene\n' in printed["effects"]


LEG, BOX = (
    'kind = "flat-leg"\nradius = 0.02\nwidth = 0.01',
    "length = 0.1\nheight = 0.03\nwidth = 0.05\nhips = [0.0]",
)


@pytest.mark.parametrize(
    ("robot", "legs", "gait", "more", "good"),
    [
        (BOX, LEG, "frequency = 2", "", True),
        (
            BOX + "\ninertia = 1e-3\naxle = -0.01",
            LEG,
            "frequency = 2\nsweep_deg = 60\nmiddle = 0.1\nduty = 0.4",
            "",
            True,
        ),
        (
            None,
            LEG,
            "frequency = 2\nsweep = 1.0",
            "[numerics]\nsteps = 16\nrounding = 1e-3\nduration = 2.0",
            True,
        ),
        (
            BOX,
            LEG,
            "frequency = 2",
            '[[effects]]\nkind = "aeration"\nair_speed = 0.1\nfluidisation = 0.3',
            True,
        ),
        (
            BOX,
            LEG,
            "frequency = 2",
            '[[effects]]\nkind = "slope"\nangle_deg = 3',
            False,
        ),
        (BOX, LEG, "sweep = 1.0", "", False),
        (BOX, LEG, None, "", False),
        (BOX, None, "frequency = 2", "", False),
        (BOX, LEG.replace("flat-leg", "sphere"), "frequency = 2", "", False),
        (BOX, LEG, "frequency = 2\nsweep = 1.0\nsweep_deg = 60", "", False),
        (BOX, LEG, "frequency = 2", "[motion]\nkind = 'drag'\ndepth = 0.1", False),
        (BOX, LEG, "frequency = 2", "[numerics]\nphases = 20", False),
        (BOX.replace("width", "widht"), LEG, "frequency = 2", "", False),
    ],
)
def test_the_schema_agrees_with_the_reader_of_walkers(
    robot, legs, gait, more, good, valid
):
    kind = "wheel" if robot is None else "rhex"
    parts = {
        "robot": f'kind = "{kind}"\nmass = 0.2\n{robot or ""}',
        "robot.legs": legs,
        "gait": gait,
    }
    written = "\n".join(
        f"[{name}]\n{part}" for name, part in parts.items() if part is not None
    )
    scene = f'[medium]\nname = "poppy-seeds-loose"\n{written}\n{more}'
    assert valid(tomllib.loads(scene)) == good
    if good:
        parse(scene)
    else:
        with pytest.raises(Refusal):
            parse(scene)


@pytest.mark.parametrize(
    ("old", "new", "good"),
    [
        ("", "", True),
        ('name = "poppy-seeds-loose"', "xi_n = 3e5", True),
        (
            'name = "poppy-seeds-loose"',
            'law = "3d"\ndensity = 700\ninternal_friction = 0.5',
            True,
        ),
        ("name =", 'law = "planar"\nname =', True),
        ("name =", 'law = "spatial"\nname =', False),
        ("mjcf =", 'kind = "mjcf"\nmjcf =', True),
        ("mjcf =", 'kind = "rhex"\nmjcf =', False),
        ("mjcf =", "mass = 1.0\nmjcf =", False),
        ('geoms = ["foot"]', "", False),
        (
            'geoms = ["foot"]',
            'geoms = ["foot"]\nactuators = ["turn"]\nphases = [0.5]',
            True,
        ),
    ],
)
def test_the_schema_agrees_with_the_reader_of_mjcf_robots(
    old, new, good, valid, tmp_path
):
    pytest.importorskip("mujoco")
    leg = '<body><joint name="j" axis="0 1 0"/><geom name="foot" type="capsule" fromto="0 0 0 0 0 -.05" size=".01"/></body>'
    body = f'<body><freejoint/><geom type="box" size=".05 .03 .01"/>{leg}</body>'
    turn = '<actuator><position name="turn" joint="j" kp="1" kv=".1"/></actuator>'
    (tmp_path / "r.xml").write_text(
        f"<mujoco><worldbody>{body}</worldbody>{turn}</mujoco>"
    )
    robot = f'[robot]\nmjcf = "{tmp_path}/r.xml"\ngeoms = ["foot"]'
    scene = f'[medium]\nname = "poppy-seeds-loose"\n{robot}\n[gait]\nfrequency = 1.0'.replace(
        old, new
    )
    assert valid(tomllib.loads(scene)) == good
    if good:
        parse(scene)
    else:
        with pytest.raises(Refusal):
            parse(scene)


def test_keys_of_robots_are_told(printed):
    robots = printed["robot"]
    assert "[robot.screw]" in robots
    assert (
        re.search(
            r"\n  mass +number +kg +required +mass of all that the wheel carries",
            robots,
        )
        and "[robot.legs]" in robots
    )
    assert re.search(r"\n  hips +list of numbers +m +required +x of each", robots)
    assert re.search(
        r"\n  sweep +number +rad +3.14\d* +angle by which.*sweep_deg", printed["gait"]
    )


def test_systems_and_sizes_given_once_are_valid(valid):
    gait = '[gait]\nkind = "circle"\n'
    inside = '[system.medium]\nlaw = "coulomb"\n[system.body]\nkind = "chain"\n'
    heavy = '[[effects]]\nkind = "body-inertia"\nfrequency = 2\ndrag = 1\n[physical]\nmass = 1\nlength = 0.3\n'
    for scene in (
        f'[system]\nkind = "swimmer"\n{inside}{gait}',
        f'[system]\nkind = "no-slip-snake"\nlengths = [1, 2, 1]\n{gait}',
        f'[medium]\nlaw = "coulomb"\n[body]\nkind = "chain"\n{gait}{heavy}',
    ):
        assert parse(scene)
        assert valid(tomllib.loads(scene))
    for medium in ('file = "sand.toml"', 'law = "table"\nfile = "drag.csv"'):
        assert valid(
            tomllib.loads(f'[medium]\n{medium}\n[body]\nkind = "chain"\n{gait}')
        )
    for medium, path in (
        ('file = "sand.toml"', 'kind = "csv"\nfile = "path.csv"'),
        ('file = "drag.csv"', STEP),
    ):
        shape = 'kind = "spline"\nfile = "points.csv"\nwidth = 1'
        assert valid(
            tomllib.loads(f"[medium]\n{medium}\n[intruder]\n{shape}\n[motion]\n{path}")
        )
        body = 'kind = "mesh"\nfile = "body.stl"\nscale = 0.001\nsmooth = true'
        assert valid(
            tomllib.loads(
                f"[medium]\n{medium}\nzeta = 2\n[intruder]\n{body}\n[motion]\n{path}"
            )
        )
    assert not valid(
        tomllib.loads(f'[system]\nkind = "no-slip-snake"\nlengths = [1, 2]\n{gait}')
    )
    assert not valid(tomllib.loads(f'[system]\nkind = "no-slip-snak"\n{gait}'))
    assert not valid(tomllib.loads('[system]\nkind = "no-slip-snake"\n'))


@pytest.mark.parametrize("name", CATALOGUE)
def test_named_media_are_shown_as_a_table_that_makes_them(name):
    code, out, err = geomech("scenes", "--show", name)
    assert (code, err) == (0, "")
    scene = parse(out + '[body]\nkind = "chain"\n[gait]\nkind = "circle"\n')
    assert scene.system.medium == CATALOGUE[name].medium
    said = " ".join(
        line.lstrip("# ") for line in out.splitlines() if line.startswith("#")
    )
    assert CATALOGUE[name].source in said
    assert geomech("scenes", "--show", name + "x")[0] == 2


@pytest.mark.parametrize("name", VERTICAL)
def test_media_of_intruders_are_shown_as_a_table_that_makes_them(name, valid):
    code, out, err = geomech("scenes", "--show", name)
    assert (code, err) == (0, "")
    scene = f"{out}[intruder]\n{PLATE}\n[motion]\n{STEP}\n"
    assert parse(scene).medium == VERTICAL[name].stress
    assert valid(tomllib.loads(scene))
    assert VERTICAL[name].source in " ".join(
        x.lstrip("# ") for x in out.splitlines() if x.startswith("#")
    )
