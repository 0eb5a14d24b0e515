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


WIDTH, HEIGHT = 80, 24  # of a terminal


def test_the_help_fits_a_terminal_and_names_all_commands():
    code, out, _ = geomech("--help")
    assert code is None or code == 0
    assert len(out.splitlines()) < HEIGHT
    assert max(map(len, out.splitlines())) <= WIDTH
    described = re.findall(r"^  ([a-z][a-z-]+)  ", out, re.M)
    assert len(described) == 8
    assert {*cli.Commands()} <= {*re.findall(r"[a-z-]+", out)}


def test_the_full_help_describes_all_commands():
    _, out, _ = geomech("--help-all")
    assert {*cli.Commands()} == {*re.findall(r"^  ([a-z][a-z-]+)  ", out, re.M)}
    assert "--install-completion" in out


def test_options_that_few_need_come_last():
    _, out, _ = geomech("displacement", "--help")
    last = out.split("\n\n")[-1]
    assert last.startswith("Advanced:")
    options = set(re.findall(r"^  (--[a-z]+)", last, re.M))
    assert options >= {"--workers", "--scheduler", "--plugin", "--yes", "--grid"}
    assert not options & {"--plot", "--json", "--tol"}
