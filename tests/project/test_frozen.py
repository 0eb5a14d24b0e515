"""Words and files are what they were: commands and what they write, refusals and what
they name, keys of scenes."""

import os
import subprocess
import sys

import frozen
import pytest

from geomech.plots import films

pytestmark = pytest.mark.usefixtures("fastest")
COMMANDS, REFUSALS = frozen.read_commands(), frozen.read_refusals()
TOOLS = sorted({line.split()[0] for line in COMMANDS})
PIECES = 6  # of the refusals, for processes to share
RENEW = "if that is meant: python tests/tools/golden.py --write"


@pytest.mark.parametrize("tool", TOOLS)
def test_commands_give_what_they_gave(tool, monkeypatch):
    monkeypatch.setattr(films, "WALK_PICTURES", 3)  # of a film counts that it is one
    lines = [line for line in COMMANDS if line.split()[0] == tool]
    changed = []
    for line, new in frozen.outcomes(lines).items():
        difference = frozen.differs(COMMANDS[line], new)
        if difference:
            changed.append(f"geomech {line}\n{difference}")
    assert not changed, "\n".join([*changed, RENEW])


@pytest.mark.parametrize("piece", range(PIECES))
def test_refusals_end_as_they_did_and_name_what_they_named(piece):
    changed = []
    with frozen.place():
        for section, case in list(REFUSALS)[piece::PIECES]:
            difference = frozen.still(REFUSALS[section, case], section, case)
            if difference:
                changed.append(f"[{section}] {case}\n{difference}")
    assert not changed, "\n".join([*changed, RENEW])


def test_keys_and_schema_are_what_they_were():
    old = frozen.KEYS.read_text().splitlines()
    new = list(frozen.keys())
    assert sorted(set(old) ^ set(new)) == [], RENEW


def test_a_script_without_a_guard_runs_once_and_on_two_workers():
    root = str(frozen.DATA.parents[1])
    path = os.pathsep.join([root, os.environ.get("PYTHONPATH", "")])
    env = {**os.environ, "PYTHONPATH": path}
    command = [sys.executable, "unguarded.py"]
    with frozen.place():
        done = subprocess.run(command, capture_output=True, text=True, env=env)
    told = done.returncode, done.stdout, done.stderr
    assert told == (0, "once\n2 3740.53764\n", "")


@pytest.mark.parametrize(
    ("recorded", "how"),
    [
        ('2 ["plain.toml", "[gait]", "kind", "circel", "circle"] where instead', ""),
        ('0 ["plain.toml"] where instead', "ends with 2 in place of 0"),
        ('2 ["plane.toml", "circel"] where instead', "does not name plane.toml"),
        ('2 ["plain.toml", "circel"] where because instead', "tells"),
        ('2 ["plain.toml", "tilt", "7"]', "does not name tilt, 7"),
    ],
)
def test_the_net_notices_what_a_refusal_names(recorded, how):
    with frozen.place():
        found = frozen.still(recorded, "explain plain.toml", '"circle" => "circel"')
    assert found.startswith(how) and bool(found) == bool(how)


TOLD = [
    "| net 0.12345 BL +- 1.2e-03 of alpha_1 by --tol, 3 cycles",
    "= a.b = 1 2",
    "> x.nc",
    "~ :sign = + A",
    "exit 0",
]


@pytest.mark.parametrize(
    ("line", "old", "new"),
    [
        (0, "0.12345", "0.12355"),
        (0, "BL", "m"),
        (0, "alpha_1", "alpha_2"),
        (0, "--tol", "--tolerance"),
        (0, ", 3 cycles", ""),
        (1, "a.b", "a.c"),
        (1, "1 2", "1 2.00001"),
        (1, "1 2", "1 2 3"),
        (2, "x.nc", "y.nc"),
        (4, "0", "2"),
    ],
)
def test_the_net_notices_numbers_units_names_files_and_codes(line, old, new):
    changed = [*TOLD[:line], TOLD[line].replace(old, new), *TOLD[line + 1 :]]
    assert frozen.differs(TOLD, changed)
