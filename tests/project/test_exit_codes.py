"""How a command may end beside 0 with its answer, which data/commands.txt has: 2 with
one line, 130 or 143 when stopped."""

import signal
import sys

import frozen
import numpy as np
import pytest
from commands import geomech

import rft
from geomech.shell import cli
from geomech.studies.estimates import effort
from rft.balance.velocity import UNCONVERGED

SMALL = """[medium]\nname = "glass-0.3mm-loose"\n[body]\nkind = "chain"\nlengths = [1, 1.4, 0.8]\n
[gait]\nkind = "ellipse"\nsemi_axes = [0.8, 0.5]\n[numerics]\ngrid = 7\nphases = 32\nharmonics = 5\nextent = 2.0\n"""

SOLVING = {  # what each command that solves for velocities takes beside its scene
    "run": ["-o", "out"],
    "velocity": ["--alpha", "0.5,0.3", "--alphadot", "1,0"],
    "connection": ["-o", "out.nc", "--plot", "out.svg"],
    "ccf": ["--plot", "out.svg"],
    "displacement": ["--amplitudes", "0.5,1.0", "--plot", "out.svg"],
    "trajectory": ["-o", "out.csv", "--cycles", "2"],
    "trajectory --cycles 1": ["-o", "out.gif"],
    "accuracy": ["-o", "out.nc"],
    "sweep": ["--over", "gait.amplitude=0.5,1.0", "-o", "out.nc"],
    "optimize": ["--harmonics", "1", "-o", "out.toml", "--plot", "out.svg"],
}


@pytest.fixture
def ended(tmp_path, monkeypatch):
    """Runs a command in a folder with a small scene: (exit code, standard output,
    standard error, files left)."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "small.toml").write_text(SMALL)

    def run(name):
        told = geomech(*name.split(), "small.toml", *SOLVING[name])
        return *told, {p.name for p in tmp_path.iterdir()} - {"small.toml"}

    return run


def test_every_command_has_its_answers_its_help_and_refusals():
    commands = set(cli.Commands())
    ends = frozen.read_commands()
    assert {f"{name} --help" for name in commands} <= set(ends)
    answered = {line.split()[0] for line, told in ends.items() if told[-1] == "exit 0"}
    # The answer of the first is data/keys.txt; the others take LAMMPS.
    assert answered | {"reference", "grains", "drag-grains"} >= commands
    refused = [f"{section} {case}" for section, case in frozen.read_refusals()]
    options = [line.removeprefix("geomech ") for line in refused if "--fast" in line]
    assert {line.split()[0] for line in options} == commands


def failing(monkeypatch, how):
    """Let a batch of body velocities raise, the first; of an interrupted `run` the
    second, when there is something in its folder."""
    solve = rft.BodyVelocity.__call__
    calls = []
    effort._is_even.cache_clear()  # it asks for velocities, too

    def fails(*args, **kwargs):
        calls.append(1)
        if len(calls) == (2 if "run" in sys.argv and how is interrupt else 1):
            how()
        return solve(*args, **kwargs)

    monkeypatch.setattr(rft.BodyVelocity, "__call__", fails)
    return calls


@pytest.mark.parametrize("name", SOLVING)
def test_what_does_not_converge_ends_with_2(name, ended, monkeypatch):
    solve = rft.BodyVelocity.__call__
    effort._is_even.cache_clear()

    def unconverged(*args, **kwargs):
        found = solve(*args, **kwargs)
        return found._replace(code=np.full(found.code.shape, UNCONVERGED))

    monkeypatch.setattr(rft.BodyVelocity, "__call__", unconverged)
    code, out, err, files = ended(name)
    assert (code, out, files) == (2, "", set())
    # On a slow machine the cost is told, too.
    (error,) = (x for x in err.splitlines() if x.startswith("error: "))
    assert "did not converge" in error


def interrupt():
    raise KeyboardInterrupt


def no_memory():
    raise MemoryError


@pytest.mark.parametrize(
    ("how", "ends", "said"),
    [
        (interrupt, 130, ""),
        (no_memory, 2, "not enough memory"),
        (lambda: signal.raise_signal(signal.SIGTERM), 143, ""),
    ],
    ids=["interrupt", "memory", "terminate"],
)
@pytest.mark.parametrize("name", SOLVING)
def test_what_is_stopped_leaves_nothing_half_written(
    name, how, ends, said, ended, monkeypatch
):
    calls = failing(monkeypatch, how)
    code, out, err, files = ended(name)
    assert calls
    assert (code, out) == (ends, "")
    stored = (
        {".out.partial"}
        if "repeat the command to continue from there" in err
        else set()
    )
    assert files == stored and (not stored or how is interrupt)
    assert said in err
    assert err == "" or "error: " in err
