"""Help of the commands under its headings, and old spellings that keep working."""

import re

import pytest
from commands import geomech

from geomech.shell import cli, renamed

SUMMARIES = re.compile(r"^  ([a-z][a-z-]*)  +(\S.*)$", re.M)


def test_help_has_every_command_under_its_heading_with_its_whole_summary():
    _, out, _ = geomech("--help")
    found = {part.split(":")[0]: SUMMARIES.findall(part) for part in out.split("\n\n")}
    for heading, names in cli.headings().items():
        listed = [name.replace("_", "-") for name in names]
        assert [name for name, _ in found[heading]] == listed
        assert all(re.search(r"[^.]\.$", summary) for _, summary in found[heading])
    lines = out.splitlines()
    assert max(map(len, lines)) <= 80 and len(lines) <= 43


def test_every_option_and_argument_says_what_it_is_for():
    parameters = [x for command in cli.Commands().values() for x in command.params]
    assert len(parameters) > 100
    assert [x.name for x in parameters if not x.help] == []


@pytest.mark.parametrize("old", renamed.COMMANDS)
def test_an_old_name_of_a_command_is_the_new_one_with_a_note(old):
    new = renamed.COMMANDS[old]
    told = geomech(old, "--help")
    assert told[:2] == geomech(new, "--help")[:2]
    assert told[2].startswith(f"note: {old} is now {new}")
    assert f"  {old}  " not in geomech("--help")[1]


OLD = {  # a command for each old option, with its value
    "--for": [
        "optimize",
        "three-link-viscous",
        "--harmonics",
        "0",
        "--for=displacement",
    ],
    "--within": ["fit-gait", "nothing.csv", "--within", "5deg"],
    "--beside": ["ccf", "three-link-viscous", "--plot", "a.txt", "--beside", "link-1"],
    "--methods": [
        "displacement",
        "three-link-viscous",
        "--amplitudes",
        "1",
        "--methods",
        "direct",
    ],
    "--cost": [
        "displacement",
        "three-link-viscous",
        "--amplitudes",
        "1",
        "--tiers",
        "direct",
        "--cost",
    ],
}


@pytest.mark.parametrize("old", renamed.OPTIONS)
def test_an_old_option_is_the_new_one_with_a_note(old):
    new, line = renamed.OPTIONS[old], OLD[old]
    told = geomech(*line)
    same = geomech(*(re.sub(f"^{old}(?==|$)", new, word) for word in line))
    seconds = re.compile(r"^seconds: .*$", re.M)
    assert told[0] == same[0] and seconds.sub("", told[1]) == seconds.sub("", same[1])
    assert f"{old} is now {new}" in told[2] and "is now" not in same[2]
    assert old not in geomech(line[0], "--help")[1]


def test_a_value_that_reads_like_an_old_option_stays_behind_two_dashes():
    assert renamed.current(["explain", "--", "--for"]) == ["explain", "--", "--for"]
