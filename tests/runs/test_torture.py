"""Long requests under kills, interrupts and rivals: the digits of a quiet run, and no
orphans.

The short form takes some seconds; the long one is asked for by hand: pytest -m soak
tests/runs/test_torture.py"""

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from commands import geomech

from geomech import scenes
from geomech.runs.store import Store

pytestmark = pytest.mark.skipif(
    not Path("/proc").is_dir(), reason="sees by /proc what is left of a process"
)
COMMAND = """
import signal, sys
for number in (signal.SIGINT, signal.SIGTERM):
    signal.signal(number, signal.SIG_DFL)
from geomech.mathematics.geometry import connection
from geomech.shell import cli
from geomech.runs import pending, store
from geomech.runs import runner as runners
from geomech.studies.displacement import cycles
store.CHECKPOINT = runners.CHECKPOINT = 0.05
pending.WORTH_PROCESSES = 0.2
connection.SAMPLES_TOGETHER, cycles.BATCH_SIZE = 400, 8
print("begun", flush=True)
cli.main()
"""
SANDFISH = scenes.load("sandfish-transient").text
SANDFISH = SANDFISH.replace("= 100", "= 5").replace("phases = 64", "phases = 32")
GLASS = scenes.load("three-link-glass").text + "[numerics]\nphases = 32\n"
SCENES = {"sandfish.toml": SANDFISH, "glass.toml": GLASS}
GRID = "--over medium.C=1:3:4 --over gait.amplitude=0.3:1.2:40"
REQUESTS = {
    "sweep": f"sweep glass.toml {GRID} -o out.nc",
    "field": "connection glass.toml --grid 31 -o out.nc",
    "march": "trajectory sandfish.toml --cycles 2 -o out.csv",
}
SIGNALS = [signal.SIGINT, signal.SIGKILL, signal.SIGTERM, signal.SIGKILL]


@pytest.fixture
def place(tmp_path):
    for name, text in SCENES.items():
        (tmp_path / name).write_text(text)
    return tmp_path


def begun(request, cwd, workers=1):
    """Return the command as a process, in a session of its own, once it has begun."""
    line = REQUESTS[request].split()
    if line[0] != "trajectory":
        line += ["--workers", str(workers)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    process = subprocess.Popen(
        [sys.executable, "-c", COMMAND, *line],
        cwd=cwd,
        start_new_session=True,
        **pipes,
    )
    assert process.stdout.readline() == "begun\n"
    return process


def output(process, place):
    """Return what a command wrote that nobody disturbs any more."""
    _, err = process.communicate(timeout=100)
    assert process.returncode == 0, err
    (path,) = place.glob("out.*")
    return path.read_bytes()


def orphans(process):
    """Return all others that run in the session of a process."""
    listed = subprocess.run(
        ["ps", "-o", "pid=,stat=", "-s", str(process.pid)],
        capture_output=True,
        text=True,
    )
    rows = [line.split() for line in listed.stdout.splitlines()]
    return [pid for pid, state in rows if state[0] != "Z" and int(pid) != process.pid]


def end(process, number):
    """Send a signal to a process; no worker outlives it."""
    if number == signal.SIGINT:  # as Ctrl-C does, to all of them
        os.killpg(process.pid, number)
    else:
        process.send_signal(number)
    process.communicate(timeout=20)
    until = time.monotonic() + 20
    while orphans(process) and time.monotonic() < until:
        time.sleep(0.02)
    assert orphans(process) == []


def size(path):
    return path.stat().st_size if path.exists() else 0


def flip_a_bit(path, rng):
    raw = bytearray(path.read_bytes())
    raw[rng.randrange(len(raw))] ^= 1 << rng.randrange(8)
    path.write_bytes(raw)


def torture(request, place, undisturbed, kills, rng=None):
    """Stop a request again and again, with one worker or two; then let it end.

    rng: of the moments; None: as soon as something more is kept."""
    partial = place / f".{REQUESTS[request].split()[-1]}.partial"
    for bout in range(kills):
        before = size(partial)
        process = begun(request, place, 1 + bout % 2)
        if rng is not None:
            time.sleep(rng.uniform(0.05, 0.8))
        while rng is None and process.poll() is None and size(partial) <= before:
            time.sleep(0.005)
        if process.poll() is not None:  # it was through
            assert output(process, place) == undisturbed
            continue
        end(process, SIGNALS[bout % len(SIGNALS)])
        if partial.exists() and bout % 5 == 2:
            flip_a_bit(partial, rng)
        elif partial.exists():
            Store(partial).close(done=False)  # what a kill leaves is whole
    assert output(begun(request, place), place) == undisturbed
    assert not partial.exists()


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """The sweep that nobody disturbs, by this process."""
    folder = tmp_path_factory.mktemp("quiet")
    (folder / "glass.toml").write_text(GLASS)
    line = REQUESTS["sweep"].split()
    assert geomech(*line, "--workers", "1", cwd=folder)[0] == 0
    return (folder / "out.nc").read_bytes()


def test_kills_and_interrupts_change_no_digit(place, undisturbed):
    torture("sweep", place, undisturbed, 2)


@pytest.mark.soak
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("request_name", REQUESTS)
def test_kills_at_any_moment_change_no_digit(request_name, seed, place):
    undisturbed = output(begun(request_name, place), place)
    torture(request_name, place, undisturbed, 14, random.Random(seed))


def test_a_rival_is_refused(place, undisturbed):
    first = begun("sweep", place)
    while not (place / ".out.nc.partial").exists():
        assert first.poll() is None, first.communicate()
        time.sleep(0.005)
    code, _, err = geomech(*REQUESTS["sweep"].split(), cwd=place)
    cure = "wait for it, stop it, or choose another output with -o"
    assert code == 2
    assert (
        err == f"error: another computation with the output out.nc is running: {cure}\n"
    )
    assert output(first, place) == undisturbed
