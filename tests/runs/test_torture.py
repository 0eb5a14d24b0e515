"""Long requests under kills, interrupts, flipped bits, rivals and a full disk: the digits of a quiet run, and no orphans.

The short form takes some seconds; the long one is asked for by hand: pytest -m soak tests/runs/test_torture.py
"""

import contextlib
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
import sys
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
SANDFISH = (
    scenes.load("sandfish-transient")
    .text.replace("= 100", "= 5")
    .replace("phases = 64", "phases = 32")
)
REQUESTS = {  # with the name of the output
    "sweep": (
        [
            "sweep",
            "glass.toml",
            "--over",
            "medium.C=1:3:4",
            "--over",
            "gait.amplitude=0.3:1.2:40",
        ],
        "out.nc",
    ),
    "field": (["connection", "glass.toml", "--grid", "31"], "out.nc"),
    "march": (["trajectory", "sandfish.toml", "--cycles", "2"], "out.csv"),
}


def scenes_in(folder):
    (folder / "sandfish.toml").write_text(SANDFISH)
    (folder / "glass.toml").write_text(
        scenes.load("three-link-glass").text + "[numerics]\nphases = 32\n"
    )
    return folder


@pytest.fixture
def place(tmp_path):
    return scenes_in(tmp_path)


def begun(args, out, cwd, workers, **options):
    """The command as a process, in a session of its own."""
    more = [] if args[0] == "trajectory" else ["--workers", str(workers)]
    command = [sys.executable, "-c", COMMAND, *args, *more, "-o", out]
    plain = lambda: [
        signal.signal(n, signal.SIG_DFL) for n in (signal.SIGINT, signal.SIGTERM)
    ]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    before = options.pop("preexec_fn", None)
    prepare = lambda: (plain(), before and before())
    return subprocess.Popen(
        command, cwd=cwd, start_new_session=True, preexec_fn=prepare, **pipes, **options
    )


def session(process):
    """Ids of all that is left of a process: it was the first of a session, and began no other."""
    found = []
    for place in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError, ValueError):
            state, _, _, leader = (
                place.joinpath("stat").read_text().rpartition(")")[2].split()[:4]
            )
            if (
                int(leader) == process.pid
                and state != "Z"
                and int(place.name) != process.pid
            ):
                found.append(int(place.name))
    return found


def ended(process, number, patience=1.0):
    """What a process says that is sent a signal; it ends soon, and none of its workers outlives it."""
    began = time.monotonic()
    if number == signal.SIGINT:  # as Ctrl-C does, to all of them
        os.killpg(process.pid, number)
    else:
        process.send_signal(number)
    _, err = process.communicate(timeout=20)
    took = time.monotonic() - began
    while session(process) and time.monotonic() < began + 20 * patience:
        time.sleep(0.02)
    assert session(process) == []
    if number != signal.SIGKILL:
        assert took < 2 * patience, took
    return err


def tortured(name, place, whole, kills, seed, early=False):
    """Every bout of a request ends badly, with one worker or two; the last one has the digits of a quiet one. early: each as
    soon as it has kept something, else at any moment."""
    (args, out), rng, seen = REQUESTS[name], random.Random(seed), set()
    partial = place / f".{out}.partial"
    size = lambda: partial.stat().st_size if partial.exists() else 0
    numbers = [signal.SIGINT, signal.SIGKILL, signal.SIGTERM, signal.SIGKILL]
    for bout in range(kills):
        before = size()
        process = begun(args, out, place, 1 + bout % 2)
        assert process.stdout.readline() == "begun\n"
        until = time.monotonic() + rng.uniform(0.05, 0.8)
        while process.poll() is None and (
            size() <= before if early else time.monotonic() < until
        ):
            time.sleep(0.005)
        if process.poll() is not None:  # it was through
            process.communicate()
            assert (place / out).read_bytes() == whole
            (place / out).unlink()
            continue
        err = ended(process, number := numbers[bout % len(numbers)])
        seen.add(number)
        if number != signal.SIGKILL:
            if not err:  # it had not yet begun to hear
                continue
            assert err.splitlines()[-1].startswith(
                f"error: stopped by {number.name}: "
            ), err
            kept = re.search(
                r"(\d+) results so far are kept in (.*): the same command", err
            )
            assert kept is None or (kept[2] == partial.name and partial.exists())
        if size():
            if bout % 5 == 2:
                raw = bytearray(partial.read_bytes())
                raw[rng.randrange(len(raw))] ^= 1 << rng.randrange(8)
                partial.write_bytes(raw)
            else:
                some = Store(partial)  # what a kill leaves is whole
                some.close(done=False)
    process = begun(args, out, place, 1)
    _, err = process.communicate(timeout=100)
    assert process.returncode == 0, err
    assert (place / out).read_bytes() == whole
    left = {p.name for p in place.iterdir()} - {"glass.toml", "sandfish.toml", out}
    assert all(
        re.fullmatch(rf"\.{out}\.partial\.unreadable(-\d)?|\.geomech-.*", x)
        for x in left
    ), left
    (place / out).unlink()
    return seen


def quiet(name, place):
    """The output of a request that nobody disturbs."""
    args, out = REQUESTS[name]
    process = begun(args, out, place, 1)
    _, err = process.communicate(timeout=100)
    assert process.returncode == 0, err
    try:
        return (place / out).read_bytes()
    finally:
        (place / out).unlink()


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The sweep that nobody disturbs, by this process."""
    (args, out), folder = REQUESTS["sweep"], scenes_in(tmp_path_factory.mktemp("quiet"))
    assert geomech(*args, "--workers", "1", "-o", out, cwd=folder)[0] == 0
    return (folder / out).read_bytes()


def test_kills_and_interrupts_change_no_digit(place, whole):
    assert len(tortured("sweep", place, whole, 2, 0, early=True)) == 2


@pytest.mark.soak
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("name", REQUESTS)
def test_torture(name, seed, place):
    tortured(name, place, quiet(name, place), 14, seed)


def test_a_rival_is_refused_and_a_full_disk_is_no_obstacle(place, whole):
    """A limit on the size of files stands for the disk: room for the output, and not for what is kept."""
    args, out = REQUESTS["sweep"]
    size = 16_000
    assert len(whole) < size
    limit = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
    first = begun(args, out, place, 1, preexec_fn=limit)
    while not (place / f".{out}.partial").exists():
        assert first.poll() is None, first.communicate()
        time.sleep(0.005)
    second = geomech(*args, "-o", out, cwd=place)
    assert second == (2, "", f"error: another computation to {out} is under way: wait for it, stop "
        "it, or choose another output with -o\n")  # fmt: skip
    _, err = first.communicate(timeout=100)
    assert (
        first.returncode == 0
        and err.count("note: what is done is not kept in .out.nc.partial: ") == 1
    ), err
    assert (place / out).read_bytes() == whole
    assert {p.name for p in place.iterdir()} == {"glass.toml", "sandfish.toml", out}
