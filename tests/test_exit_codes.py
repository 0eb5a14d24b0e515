"""Every command and how it may end: 0 with its answer, 2 with one line, 130 or 143 when told to stop; no half-written files."""

import signal
import sys

import frozen
import numpy as np
import pytest

import rft
from geomech import cli
from geomech.gaits import Circle
from geomech.measured import synthetic
from geomech.study import effort

SMALL = """[medium]\nname = "glass-0.3mm-loose"\n[body]\nkind = "chain"\nlengths = [1, 1.4, 0.8]\n
[gait]\nkind = "ellipse"\nsemi_axes = [0.8, 0.5]\n[numerics]\ngrid = 7\nphases = 32\nharmonics = 5\nextent = 2.0\n"""

INTRUDER = """[medium]\nname = "poppy-seeds-close"\nzeta = 1.1\n[intruder]\nkind = "half-cylinder"\nradius = 0.02\nwidth = 0.03
[motion]\nkind = "drag"\ndepth = 0.01\ndirection_deg = 20\n[numerics]\nelements = 30\n"""
WALKER = """[medium]\nzeta = 0.3\ngrazing_deg = 5\n[robot]\nkind = "wheel"\nmass = 0.5\naxle = 0.01
legs = { kind = "round-rod", radius = 0.04, width = 0.05 }\n[gait]\nfrequency = 2
[numerics]\nsteps = 8\nelements = 8\nduration = 1
"""

# What each command takes beside its scene. A new one needs its row.
COMMANDS = {
    "run": ["-o", "out"],
    "velocity": ["--alpha", "0.5,0.3", "--alphadot", "1,0"],
    "connection": ["-o", "out.nc", "--plot", "out.svg"],
    "ccf": ["--plot", "out.svg"],
    "displacement": ["--amplitudes", "0.5,1.0", "--plot", "out.svg"],
    "trajectory": ["-o", "out.csv", "--cycles", "2"],
    "animate": ["-o", "out.gif", "--cycles", "1"],
    "accuracy": ["-o", "out"],
    "sweep": ["--over", "gait.amplitude=0.5,1.0", "--over", "body.length=1,2", "-o", "out.nc"],
    "optimize": ["--for", "displacement", "--harmonics", "1", "-o", "out.toml", "--plot", "out.svg"],
    "fit": ["-o", "out.nc", "--plot", "out.svg"],
    "calibrate": ["-o", "out.toml", "--plot", "out.svg"],
    "explain": [],
    "symbolic": [],
    "stress": ["--beta", "30", "--gamma", "-50", "--plot", "out.svg"],
    "intrude": ["-o", "out.csv", "--plot", "out.svg"],
    "walk": ["-o", "out", "--animate", "out.gif"],
    "scenes": [],
    "keys": [],
}
# Where it is no scene with a gait.
SUBJECT = {
    "scenes": [], "keys": [], "symbolic": ["differential-drive"],
    "calibrate": ["dem-rod-drag"], "fit": ["log.csv"], "stress": ["intruder.toml"], "intrude": ["intruder.toml"],
    "walk": ["walker.toml"],
}  # fmt: skip
SOLVING = [name for name in COMMANDS if name not in ("explain", *SUBJECT)]
SLOW = ("accuracy", "run")  # tried to their ends in test_cli.py


def arguments(name):
    return [name, *SUBJECT.get(name, ["small.toml"]), *COMMANDS[name]]


@pytest.fixture
def ended(tmp_path, monkeypatch, capsys):
    """Runs a command in a folder with a small scene: (exit code, standard output, standard error, files left)."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "small.toml").write_text(SMALL)
    (tmp_path / "intruder.toml").write_text(INTRUDER)
    (tmp_path / "walker.toml").write_text(WALKER)
    rolling = lambda alpha, alphadot: np.stack([alphadot[..., 0], 0 * alphadot[..., 0], alphadot[..., 1]], -1)
    synthetic.save(tmp_path / "log.csv", synthetic.made(rolling, Circle(amplitude=0.5), cycles=12, samples=20))
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}

    def run(*args):
        monkeypatch.setattr(sys, "argv", ["geomech", *args])
        with pytest.raises(SystemExit) as left:
            cli.main()
        said = capsys.readouterr()
        return (
            left.value.code,
            said.out,
            said.err,
            {p.name for p in tmp_path.iterdir()} - {"small.toml", "intruder.toml", "walker.toml", "log.csv"},
        )

    yield run
    for number, handler in before.items():
        signal.signal(number, handler)


def test_every_command_has_its_row_its_help_and_refusals():
    commands = {command.name or command.callback.__name__ for command in cli.app.registered_commands}
    assert commands == set(COMMANDS)
    assert {f"{name} --help" for name in commands} <= set(frozen.read_commands())
    refused = [section if section != "geomech" else case for section, case in frozen.read_refusals()]
    assert {line.split()[0] for line in refused if "--fast" in line} == commands


@pytest.mark.parametrize("name", [name for name in COMMANDS if name not in SLOW])
def test_what_goes_well_ends_with_0(name, ended):
    args = arguments(name) + ["--starts", "1"] * (name == "optimize")
    code, out, err, files = ended(*args)
    assert (code, err) == (0, "")
    assert bool(out) == (name not in ("connection", "ccf", "animate"))
    assert files == {word for word in COMMANDS[name] if word.startswith("out")}


def refused(told, said):
    code, out, err, files = told
    assert (code, out, files) == (2, "", set())
    lines = [
        line for line in err.splitlines() if "s of computing and" not in line
    ]  # on a slow machine the cost is told
    assert len(lines) == 1
    assert lines[0].startswith("error: ")
    assert said in lines[0]


def failing(monkeypatch, how):
    """Batches of body velocities that fail, all saying so, or one of them raising; of an interrupted `run` the second,
    when there is something in its folder."""
    solve, calls = rft.body_velocity, []
    effort._even.cache_clear()  # it asks for velocities, too

    def fails(*args, **kwargs):
        calls.append(1)
        if how == "unconverged":
            found = solve(*args, **kwargs)
            return found._replace(status=np.full(found.status.shape, "unconverged"))
        if len(calls) == (2 if "run" in sys.argv and how is interrupt else 1):
            how()
        return solve(*args, **kwargs)

    monkeypatch.setattr(rft, "body_velocity", fails)
    return calls


@pytest.mark.parametrize("name", SOLVING)
def test_what_does_not_converge_ends_with_2(name, ended, monkeypatch):
    assert failing(monkeypatch, "unconverged") == []
    refused(ended(*arguments(name)), "did not converge")


def interrupt():
    raise KeyboardInterrupt


def no_memory():
    raise MemoryError


@pytest.mark.parametrize(
    ("how", "ends", "said"),
    [(interrupt, 130, ""), (no_memory, 2, "not enough memory"), (lambda: signal.raise_signal(signal.SIGTERM), 143, "")],
    ids=["interrupt", "memory", "terminate"],
)
@pytest.mark.parametrize("name", SOLVING)
def test_what_is_stopped_leaves_nothing_half_written(name, how, ends, said, ended, monkeypatch):
    calls = failing(monkeypatch, how)
    code, out, err, files = ended(*arguments(name))
    assert calls
    assert (code, out) == (ends, "")
    stored = {".out.partial"} if "the same command goes on from there" in err else set()
    assert files == stored and (not stored or how is interrupt)
    assert said in err
    assert err == "" or err.startswith("error: ")


def test_a_fault_of_the_program_is_not_passed_off_as_the_users(ended, monkeypatch):
    failing(monkeypatch, lambda: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        ended(*arguments("displacement"))


def test_nor_as_a_signal(ended, monkeypatch, capsys):
    """An EOFError, of which typer makes what it makes of an interrupt."""

    def end_of_file():
        raise EOFError("Ran out of input")

    failing(monkeypatch, end_of_file)
    with pytest.raises(EOFError, match="Ran out of input"):
        ended(*arguments("displacement"))
    assert "stopped" not in capsys.readouterr().err
