"""Options say what they are for, and old spellings keep working."""

import re

import pytest
from commands import geomech

from geomech.shell import cli, renamed


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


OLD = {  # a command for each old option, with its value
    "--for": "optimize three-link-viscous --harmonics 0 --for=displacement",
    "--within": "fit-gait nothing.csv --within 5deg",
    "--beside": "ccf three-link-viscous --plot a.txt --beside link-1",
    "--methods": "displacement three-link-viscous --methods direct",
    "--cost": "displacement three-link-viscous --tiers direct --cost",
}


@pytest.mark.parametrize("old", renamed.OPTIONS)
def test_an_old_option_is_the_new_one_with_a_note(old):
    new = renamed.OPTIONS[old]
    told = geomech(*OLD[old].split())
    same = geomech(*OLD[old].replace(old, new).split())
    seconds = re.compile(r"^seconds: .*$", re.M)
    assert told[0] == same[0]
    assert seconds.sub("", told[1]) == seconds.sub("", same[1])
    assert f"{old} is now {new}" in told[2]
