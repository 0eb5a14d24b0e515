"""Long requests under kills, interrupts, rivals and a full disk: the digits of a quiet
run, and no orphans.

The short form takes some seconds; the long one is asked for by hand: pytest -m soak
tests/runs/test_torture.py"""

import os
import random
import re
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from commands import geomech

from geomech import scenes
from geomech.run.store import Store

pytestmark = pytest.mark.skipif(
    not Path("/proc").is_dir(), reason="sees by /proc what is left of a process"
)
COMMAND = """
import signal, sys
for number in (signal.SIGINT, signal.SIGTERM):
    signal.signal(number, signal.SIG_DFL)
from geomech import connection
from geomech.shell import cli
from geomech.run import pending, store
from geomech.run import runner as runners
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


def begun(request, cwd, workers=1, **options):
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
        **options,
    )
    assert process.stdout.readline() == "begun\n"
    return process


def output(process, place):
    """Return what a command wrote that nobody disturbs any more; it is removed."""
    _, err = process.communicate(timeout=100)
    assert process.returncode == 0, err
    (path,) = place.glob("out.*")
    content = path.read_bytes()
    path.unlink()
    return content


def orphans(process):
    """Return all others that run in the session of a process."""
    listed = subprocess.run(
        ["ps", "-o", "pid=,stat=", "-s", str(process.pid)],
        capture_output=True,
        text=True,
    )
    rows = [line.split() for line in listed.stdout.splitlines()]
    return [pid for pid, state in rows if state[0] != "Z" and int(pid) != process.pid]


def ended(process, number):
    """Return what a process says that is sent a signal; no worker outlives it."""
    if number == signal.SIGINT:  # as Ctrl-C does, to all of them
        os.killpg(process.pid, number)
    else:
        process.send_signal(number)
    _, err = process.communicate(timeout=20)
    end = time.monotonic() + 20
    while orphans(process) and time.monotonic() < end:
        time.sleep(0.02)
    assert orphans(process) == []
    return err


def check_words(err, number, partial):
    """Check what a command says that is stopped: nothing, if it had not begun to
    hear."""
    if not err or number == signal.SIGKILL:
        return
    assert err.splitlines()[-1].startswith(f"error: stopped by {number.name}: "), err
    kept = re.search(r"\d+ results so far are kept in (.*): the same command", err)
    assert kept is None or (kept[1] == partial.name and partial.exists())


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
        number = SIGNALS[bout % len(SIGNALS)]
        check_words(ended(process, number), number, partial)
        if partial.exists() and bout % 5 == 2:
            flip_a_bit(partial, rng)
        elif partial.exists():
            Store(partial).close(done=False)  # what a kill leaves is whole
    assert output(begun(request, place), place) == undisturbed
    left = {p.name for p in place.iterdir()} - {*SCENES}
    strays = rf"\{partial.name}\.unreadable(-\d)?|\.geomech-.*"
    assert all(re.fullmatch(strays, name) for name in left), left


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


def test_a_rival_is_refused_and_a_full_disk_is_no_obstacle(place, undisturbed):
    """A limit on the size of files leaves room for the output, not for what is kept."""
    size = 16_000
    assert len(undisturbed) < size

    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    first = begun("sweep", place, preexec_fn=limit)
    while not (place / ".out.nc.partial").exists():
        assert first.poll() is None, first.communicate()
        time.sleep(0.005)
    code, out, err = geomech(*REQUESTS["sweep"].split(), cwd=place)
    assert (code, out) == (2, "")
    cure = "wait for it, stop it, or choose another output with -o"
    assert err == f"error: another computation to out.nc is under way: {cure}\n"
    _, err = first.communicate(timeout=100)
    assert first.returncode == 0, err
    assert err.count("note: what is done is not kept in .out.nc.partial: ") == 1
    assert (place / "out.nc").read_bytes() == undisturbed
    assert {p.name for p in place.iterdir()} == {*SCENES, "out.nc"}
