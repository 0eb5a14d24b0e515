"""Words and files are what they were: commands and what they write, refusals and what they name, keys of scenes."""

import json
import os
import re
import subprocess
import sys
import tomllib

import frozen
import pytest

from geomech.mathematics.geometry import connection
from geomech.plots import films
from geomech.run import cost

pytestmark = pytest.mark.usefixtures("fastest")
COMMANDS, REFUSALS = frozen.read_commands(), frozen.read_refusals()
TOOLS = sorted({line.split()[0] for line in COMMANDS})
PIECES = 6  # of the refusals, for processes to share
RENEW = "if that is meant: python tests/tools/golden.py --write"


@pytest.mark.parametrize("tool", TOOLS)
def test_commands_give_what_they_gave(tool, monkeypatch):
    monkeypatch.setattr(films, "WALK_PICTURES", 3)  # of a film counts that it is one
    lines = [line for line in COMMANDS if line.split()[0] == tool]
    found = {
        line: frozen.differs(COMMANDS[line], new)
        for line, new in frozen.outcomes(lines).items()
    }
    changed = [f"geomech {line}\n{how}" for line, how in found.items() if how]
    assert not changed, "\n".join([*changed, RENEW])


@pytest.mark.parametrize("piece", range(PIECES))
def test_refusals_end_as_they_did_and_name_what_they_named(piece, monkeypatch):
    monkeypatch.setattr(
        cost, "TIMED_SECONDS", 0.05
    )  # what takes too long does so by far: three small batches tell
    monkeypatch.setattr(connection, "SAMPLES_TOGETHER", 2000)
    with frozen.place():
        found = {
            case: frozen.still(REFUSALS[case], *case)
            for case in list(REFUSALS)[piece::PIECES]
        }
    changed = [
        f"[{section}] {case}\n{how}" for (section, case), how in found.items() if how
    ]
    assert not changed, "\n".join([*changed, RENEW])


def test_keys_and_schema_are_what_they_were():
    old, new = frozen.KEYS.read_text().splitlines(), list(frozen.keys())
    assert sorted(set(old) ^ set(new)) == [], RENEW
    assert len(new) > 600


BASES = {  # a scene that has such a table, by what `geomech reference` says of it
    "of a mesh": "ball.toml", "of an intruder": "leg.toml", "of a robot": "robot.toml", "mjcf": "cart.toml",
    "[intruder] kind = \"(mesh|sphere|cylinder|screw|extruded)": "ball.toml", "[intruder]": "leg.toml", "[motion]": "leg.toml",
    "[robot]": "robot.toml", "": "plain.toml",
}  # fmt: skip
NINE = ("A00", "A10", "B11", "B01", "Bm11", "C11", "C01", "Cm11", "D10")
LEGS = {"kind": "c-leg", "radius": 0.02, "width": 0.01}
SCREW = {"radius": 0.03, "core": 0.02, "pitch": 0.06, "length": 0.2}
BOX = {"mass": 0.2, "length": 0.2, "width": 0.2, "height": 0.1}
BESIDE = {  # what is asked for before
    ("intruder", "mesh"): {"file": "wedge.stl"}, ("robot", "rhex"): BOX | {"hips": [0.0, 0.1], "legs": LEGS},
    ("robot", "wheel"): {"mass": 1.0, "legs": LEGS}, ("robot", "screws"): BOX | {"track": 0.1, "screw": SCREW},
    ("robot", "mjcf"): {"mjcf": "cart.xml", "geoms": ["fl", "trunk"]},
}  # fmt: skip
OTHERWISE = {"internal_friction": "friction"}  # what is named in place of a key
KEY = re.compile(r"key (\[+(\w*)\]+(.*)): (\w+) \|.*")


def inline(value):
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {inline(x)}" for key, x in value.items()) + "}"
    return (
        "[" + ", ".join(map(inline, value)) + "]"
        if isinstance(value, list)
        else json.dumps(value)
    )


def with_wrong(head, table, kind, key):
    """A scene, as TOML, whose key in this table, of this kind, is a table where it takes none."""
    base = next(
        name
        for where, name in BASES.items()
        if re.search(where.replace("[", r"\[").replace("]", r"\]"), head)
    )
    tables = tomllib.loads((frozen.FOLDER / base).read_text())
    named = dict(re.findall(r'(\w+) = "([^"]*)"', kind))
    wrong = (
        dict.fromkeys(NINE, 0.1)
        if key in NINE
        else named or dict(tables.get(table, {}))
    )
    wrong |= BESIDE.get((table, named.get("kind")), {}) if "shape" not in named else {}
    wrong[key] = {"wrong": 1}
    if table == "system":
        del tables["medium"], tables["body"]
    tables |= {table: [wrong] if table == "effects" else wrong} if table else wrong
    return "".join(f"{name} = {inline(x)}\n" for name, x in tables.items())


def test_a_wrong_type_of_any_key_is_refused_by_its_name():
    bad = []
    with frozen.place() as here:
        for line in frozen.KEYS.read_text().splitlines():
            if found := KEY.fullmatch(line):
                (here / "wrong.toml").write_text(text := with_wrong(*found.groups()))
                code, out, err = frozen.geomech("explain", "wrong.toml")
                if not (
                    (code, out) == ("2", "")
                    and err.startswith("error: wrong.toml")
                    and OTHERWISE.get(found[4], found[4]) in err
                ):
                    bad.append(f"{line}\n{text}{code} {out}{err}")
    assert not bad, "\n".join(bad)


def test_a_script_without_a_guard_runs_once_and_on_two_workers():
    with frozen.place() as here:
        path = os.pathsep.join(
            [str(frozen.DATA.parents[1]), os.environ.get("PYTHONPATH", "")]
        )
        env = {**os.environ, "PYTHONPATH": path}
        done = subprocess.run(
            [sys.executable, "unguarded.py"],
            capture_output=True,
            text=True,
            cwd=here,
            env=env,
        )
    assert (done.returncode, done.stdout, done.stderr) == (
        0,
        "once\n2 3740.53764\n",
        "",
    )


def test_the_net_notices():
    """Numbers, units, keys, names, files and codes; not a last digit, and not wording."""
    old = [
        "| net 0.12345 BL +- 1.2e-03 of alpha_1 by --tol, 3 cycles",
        "= a.b = 1 2",
        "> x.nc",
        "~ :sign = + A",
        "exit 0",
    ]
    at = lambda k, line: [*old[:k], line, *old[k + 1 :]]
    for same in (
        at(
            0,
            "| by --tol alpha_1 has 0.12346 BL as net, or +- 1.2e-03, for three: 3 cycles",
        ),
        at(1, "= a.b = 1 2.000001"),
        at(3, "~ :sign = plus A"),
    ):
        assert frozen.differs(old, same) == "", same
    for other in (
        at(0, old[0].replace("0.12345", "0.12355")),
        at(0, old[0].replace("BL", "m")),
        at(0, old[0].replace("alpha_1", "alpha_2")),
        at(0, old[0].replace("--tol", "--tolerance")),
        at(0, old[0].replace(", 3 cycles", "")),
        at(1, "= a.c = 1 2"),
        at(1, "= a.b = 1 2.00001"),
        at(1, "= a.b = 1 2 3"),
        at(2, "> y.nc"),
        at(4, "exit 2"),
        [*old[:3], old[4]],
        [*old, "! note: x"],
    ):
        assert frozen.differs(old, other), other


@pytest.mark.parametrize(
    ("recorded", "how"),
    [
        ('2 ["plain.toml", "[gait]", "kind", "circel", "circle"] cure', ""),
        ('0 ["plain.toml"] cure', "ends with 2 in place of 0"),
        ('2 ["plane.toml", "circel"] cure', "does not name plane.toml"),
        ('2 ["plain.toml", "tilt", "7"]', "does not name tilt, 7"),
    ],
)
def test_the_net_notices_what_a_refusal_names(recorded, how):
    with frozen.place():
        found = frozen.still(recorded, "explain plain.toml", '"circle" => "circel"')
    assert found.startswith(how) and bool(found) == bool(how)


def test_a_refusal_without_its_cure_is_noticed(monkeypatch):
    monkeypatch.setattr(
        frozen, "refused", lambda *case: ("2", "error: s.toml: amplitude is 7")
    )
    assert frozen.still('2 ["s.toml", "7.0"] cure', "", "").startswith("says no cure")
    assert frozen.still('2 ["s.toml", "7.0"]', "", "") == ""
