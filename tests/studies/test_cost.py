"""Large requests: refused without --yes, stopped at once, and bounded in memory."""

import contextlib
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from commands import geomech as run

from geomech import scenes
from geomech.mathematics.geometry import connection
from geomech.mathematics.geometry.representations import harmonics
from geomech.mathematics.systems import capabilities
from geomech.runs import cost as run_cost
from geomech.shell import terminal
from geomech.studies.displacement import cycles
from geomech.studies.estimates import estimate
from geomech.studies.scene_tables import SceneTables

GLASS = scenes.load("three-link-glass")
SANDFISH = scenes.load("sandfish-loose").text
FIVE_LINKS = GLASS.text.partition("[gait]")[0].replace(
    "[1, 1, 1]", "[1, 1.2, 1, 0.8, 1]"
)
FIVE_LINKS += '[gait]\nkind = "wave"\njoints = 4\namplitude = 0.4\n'
LARGE_SCENES = {
    "directions.toml": GLASS.text + "\n[numerics]\ndirections = 2048\n",
    "harmonics.toml": GLASS.text + "\n[numerics]\nharmonics = 999\n",
    "phases.toml": GLASS.text + "\n[numerics]\nphases = 1_000_000\n",
    "five.toml": FIVE_LINKS,
    "finest.toml": f"{FIVE_LINKS}[numerics]\ndirections = 128\n",
    "elements.toml": SANDFISH.replace("elements = 100", "elements = 2000"),
}
HARMONICS = "displacement harmonics.toml --amplitudes 1 --tiers harmonic"
MANY = "--over gait.amplitude=0.1:2:99999"
AROUND = "displacement five.toml --tiers path"
LARGE = {
    "values of a sweep": "sweep sandfish-transient --over medium.C=1:2:99999 -o out.nc",
    "amplitudes of a sweep": f"sweep sandfish-loose {MANY} -o out.nc",
    "a grid": "connection three-link-glass --grid 1414 -o out.nc",
    "a field of four joints": "connection finest.toml --grid 36 -o out.nc",
    "a connection around a gait": f"{AROUND} --amplitudes 0.1:0.5:99999",
    "a map": "ccf directions.toml --grid 301 --plot out.png",
    "directions": "connection directions.toml -o out.nc --grid 301",
    "harmonics": f"{HARMONICS} --grid 201",
    "phases": "run phases.toml -o out",
    "phases of many amplitudes": "displacement phases.toml --amplitudes 0.1:1:1000",
    "elements": "displacement elements.toml --amplitudes 0.1:0.2:2000",
    "time stepping": "displacement sandfish-transient --amplitudes 0.1:0.2:9999",
    "a tolerance": "displacement butterfly-glass --amplitudes 0.1:1:99999 --tol 1e-5",
    "accuracy": "accuracy phases.toml -o out.nc",
}


@pytest.fixture
def large(tmp_path, monkeypatch):
    """A folder with scenes that ask for much."""
    for name, text in LARGE_SCENES.items():
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("name", [name for name in LARGE if name != "phases"])
def test_large_requests_are_refused_without_yes(name, large, monkeypatch):
    """They are far beyond what may be: three small batches tell."""
    monkeypatch.setattr(run_cost, "TIMED_SECONDS", 0.05)
    monkeypatch.setattr(connection, "SAMPLES_TOGETHER", 2000)
    monkeypatch.setattr(cycles, "BATCH_SIZE", 4)
    monkeypatch.setattr(capabilities, "VALUES_TOGETHER", 1 << 15)
    code, out, err = run(*LARGE[name].split())
    assert (code, out) == (2, "")
    assert "to compute for more than 60 s or 2 GB use --yes" in err
    assert {p.name for p in large.iterdir()} == {*LARGE_SCENES}


@pytest.mark.usefixtures("large")
@pytest.mark.parametrize(
    "line",
    [
        "displacement three-link-viscous --amplitudes 1 --tiers direct",
        "run three-link-viscous -o d",
        "accuracy three-link-viscous -o d.nc",
    ],
)
def test_every_question_that_computes_long_is_refused(line, monkeypatch):
    monkeypatch.setattr(run_cost, "LONGEST", 0.0)
    code, _, err = run(*line.split())
    assert code == 2
    assert "use --yes" in err


def everything():
    """Return the numbers of all tiers, tables and errors of a scene."""
    scene = GLASS.with_numerics(grid=7, phases=48, harmonics=5)
    amplitudes = np.linspace(0.3, 1.4, 4)
    tables = SceneTables(scene)
    tiers = ("area", "adapted", "path", "harmonic", "direct")
    found = [tables.poses(tier, None, amplitudes) for tier in tiers]
    found += [tables.fitted.A, tables.fitted.residual, tables.fitted.speed]
    found.append(tables.table("harmonic").residual)
    found += estimate.direct(scene, scene.gait, amplitudes, 32)
    text = SANDFISH.partition("[[effects]]")[0].replace("= 100", "= 10")
    text += '\n[[effects]]\nkind = "transient"\ntravel = 0.1'
    stepped = SceneTables(scenes.parse(text).with_numerics(phases=16, cycles=2))
    return [*found, stepped.poses("direct", None, amplitudes / 5)]


@pytest.mark.usefixtures("fastest")
def test_groups_change_no_numbers(monkeypatch):
    at_once = everything()
    monkeypatch.setattr(capabilities, "VALUES_TOGETHER", 1)
    monkeypatch.setattr(capabilities, "STEPPED_TOGETHER", 1)
    monkeypatch.setattr(connection, "SAMPLES_TOGETHER", 17)
    for name in ("tiers.area", "tiers.direct", "geometry.family"):
        module = sys.modules[f"geomech.mathematics.{name}"]
        monkeypatch.setattr(module, "SAMPLES_TOGETHER", 17)
    monkeypatch.setattr(harmonics, "VALUES_TOGETHER", 23)
    for one, other in zip(everything(), at_once, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-13)


# Stopping

SIGNALS = {signal.SIGHUP: signal.SIG_DFL, signal.SIGTERM: signal.SIG_DFL}
SIGNALS[signal.SIGINT] = signal.default_int_handler


def started(line, cwd):
    """Return a command as a process, with the signals of a terminal."""
    before = {number: signal.signal(number, to) for number, to in SIGNALS.items()}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    try:
        whole = [sys.executable, "-m", "geomech", *line]
        return subprocess.Popen(whole, cwd=cwd, **pipes)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def ran(line, cwd, **options):
    """Return the outcome of a line of bash."""
    line = ["bash", "-c", line.replace("geomech", f"{sys.executable} -m geomech")]
    options = {"capture_output": True, "cwd": cwd, "timeout": 120, **options}
    return subprocess.run(line, **options)


def test_a_signal_stops_the_solvers_threads():
    """Of one batch of half a million balances, solved on both cores."""
    code = """if True:
        import os, signal, sys, threading, numpy as np
        from geomech.shell import terminal
        from rft import Chain, Granular, body_velocity
        shapes = np.random.default_rng(0).uniform(-2, 2, (2, 500_000, 2))
        threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGTERM)).start()
        try:
            with terminal.stoppable():
                body_velocity(Granular(1.8, .24), Chain(), *shapes, threads=2)
        except terminal.Stopped as stopped:
            print(stopped.code)
    """
    line = [sys.executable, "-c", code]
    done = subprocess.run(line, capture_output=True, text=True, timeout=20)
    assert (done.returncode, done.stdout, done.stderr) == (0, "143\n", "")


def test_what_was_ignored_stays_ignored():
    """nohup geomech ... outlives its terminal."""
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with terminal.stoppable():
            os.kill(os.getpid(), signal.SIGHUP)
            assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)


# Terminals and folders


def test_a_terminal_without_letters_and_a_home_without_folders(tmp_path):
    name = "sch\u00f6n \u2603.toml"
    text = scenes.load("three-link-viscous").text + "# \u2603\n"
    (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / "file").write_text("")
    env = {**os.environ, "PYTHONIOENCODING": "ascii", "LC_ALL": "C"}
    env["MPLCONFIGDIR"] = str(tmp_path / "file" / "no")
    env.pop("HOME", None)
    line = (
        f"geomech displacement '{name}' --amplitudes 1 --tiers direct --plot \u2603.png"
    )
    done = ran(line, tmp_path, env=env)
    assert done.returncode == 0, done.stderr
    assert b"sch\\xf6n \\u2603.toml: displacement per cycle" in done.stdout
    assert (tmp_path / "\u2603.png").stat().st_size > 10_000


def test_too_many_open_files_are_said_and_nothing_is_left(tmp_path):
    """A folder of ours needs two more to go than the file that is to be written."""
    line = "ulimit -n 6; exec geomech trajectory three-link-viscous -o a.csv"
    done = ran(line, tmp_path, text=True)
    assert done.returncode == 2
    said = "error: too many files are open at once: raise the limit, for example with 'ulimit -n"
    assert done.stderr.startswith(said)
    assert {p.suffix for p in tmp_path.iterdir()} <= {".partial"}


FULL = "No space left on device; free some disk space, or redirect the output"


@pytest.mark.parametrize(
    ("line", "code", "err"),
    [
        ("geomech scenes | true; exit ${PIPESTATUS[0]}", 0, ""),
        ("geomech --version >&-", 0, ""),
        ("geomech --version 2>&- >/dev/null", 0, ""),
        ("geomech --version > /dev/full", 2, f"standard output: {FULL}\n"),
    ],
)
def test_nobody_need_listen_but_a_full_disk_is_a_failure(line, code, err, tmp_path):
    done = ran(line, tmp_path, text=True)
    assert done.returncode == code
    assert done.stderr.removeprefix("error: cannot write to ") == err


# By hand


@pytest.mark.soak
@pytest.mark.timeout(3600)
@pytest.mark.parametrize(
    "line",
    [
        *(LARGE[name] for name in ("a grid", "a map", "phases", "directions")),
        "displacement three-link-viscous --amplitudes 0.1:2:99999",
        "displacement elements.toml --amplitudes 0.1:0.2:20",
        HARMONICS,
    ],
)
def test_memory_stays_below_what_was_said(line, large):
    code = """if True:
        import atexit, resource, sys
        from geomech.shell.cli import main
        def tell():
            print(resource.getrusage(0).ru_maxrss * 1024, file=sys.stderr)
        atexit.register(tell)
        main(sys.argv[1:])
    """
    whole = [sys.executable, "-c", code, *line.split(), "--yes"]
    done = subprocess.run(whole, capture_output=True, text=True)
    assert done.returncode == 0
    assert int(done.stderr.splitlines()[-1]) < run_cost.LARGEST


@pytest.mark.soak
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("name", LARGE)
@pytest.mark.parametrize("after", [0.5, 3.0, 9.0, 20.0])
def test_every_large_request_stops_within_two_seconds(name, after, large):
    process = started([*LARGE[name].split(), "--yes"], large)
    with contextlib.suppress(subprocess.TimeoutExpired):
        process.wait(after)
    if process.poll() is not None:
        pytest.skip("it had ended")
    process.send_signal(signal.SIGTERM)
    begun = time.monotonic()
    err = process.communicate(timeout=60)[1]
    took = time.monotonic() - begun
    assert process.returncode == (143 if "stopped by" in err else -15)
    print(f"{name} after {after} s: {took:.2f} s")
    assert took < 2.0
