"""Work shared by processes: nothing is lost when a worker is ended, and nobody waits
for ever."""

import contextlib
import itertools
import os
import signal
import subprocess
import sys

import numpy as np
import pytest
from tasks import (
    always_dies,
    dies,
    doubled,
    fails,
    fails_oddly,
    meets,
    notes,
    waits,
    who,
)

import geomech
from geomech import scenes
from geomech.core.errors import UnitWarning
from geomech.runs import executors, pending
from geomech.runs.runner import Runner, runner
from geomech.runs.workers import using
from geomech.scenes import kinds
from geomech.studies.displacement import cycles
from rft.core import threads
from rft.core.refusal import Refusal
from rft.laws import LAWS

GLASS = scenes.load("three-link-glass").with_numerics(phases=32)
LONG = 1e9  # s


@pytest.fixture(scope="module")
def two():
    """Two processes, for all tests that leave them alive."""
    with using(2):
        yield runner().executor


def each(executor, task, common, items, total=100, seconds=LONG):
    return list(Runner(executor=executor).map(task, common, items, total, seconds))


def test_results_come_in_order(two):
    results = each(two, doubled, np.array([1.0, 2.0]), range(40))
    np.testing.assert_array_equal(results, np.outer(range(40), [1.0, 2.0]))
    # A function inside another, which processes cannot know, is computed here.
    assert each(two, lambda c, x: c + x, 1, range(4)) == [1, 2, 3, 4]


def test_a_worker_takes_one_thread_and_one_back_end_and_no_workers(two, tmp_path):
    results = each(two, meets, str(tmp_path), range(20))
    assert {x[1:4] for x in results} == {(1, "numpy", None)}
    pids = {x[0] for x in results}
    assert len(pids) == 2
    assert os.getpid() not in pids


@pytest.mark.parametrize(
    ("count", "seconds", "n_here"),
    [(5, None, 5), (5, 1.0, 5), (1, LONG, 1), (5, LONG, 0)],
    ids=["not known", "short", "one task", "long"],
)
def test_what_is_small_is_computed_here(count, seconds, n_here, two):
    results = each(two, who, None, range(count), count, seconds)
    assert [x[0] for x in results].count(os.getpid()) == n_here


def test_an_ended_worker_loses_nothing(tmp_path, monkeypatch):
    with contextlib.closing(executors.Processes(1)) as executor:
        assert each(executor, dies, str(tmp_path), range(8)) == [*range(8)]
        monkeypatch.setattr(pending, "MAX_TRIES", 1)
        with pytest.raises(RuntimeError, match="during the same task"):
            each(executor, always_dies, None, [0])


def test_errors_and_notes_come_back_and_printed_text_does_not(two):
    with pytest.raises(Refusal, match="no such thing as 2"):
        each(two, fails, None, range(4))
    with pytest.raises(RuntimeError, match="Odd: 1 and 5"):
        each(two, fails_oddly, None, [5])
    with pytest.warns(UnitWarning, match="an angle of 400 rad") as told:
        each(two, notes, None, range(4))
    assert len(told) == 1


LAW = """
from dataclasses import dataclass

@dataclass(frozen=True)
class Ratio:
    ratio: float
    law = "of-a-worker"

    def traction(self, v_t, v_n, eps=0.0):
        return v_t, self.ratio * v_n
"""


@pytest.mark.usefixtures("own_parts")
def test_plugins_are_known_to_workers(tmp_path, monkeypatch):
    """A custom law whose file is gone."""
    path = tmp_path / "law.py"
    path.write_text(LAW)
    kinds.load_file(path)
    path.unlink()
    monkeypatch.setattr(pending, "WORTH_PROCESSES", 0.0)
    monkeypatch.setattr(cycles, "BATCH_SIZE", 1)
    scene = GLASS.changed(medium=LAWS["of-a-worker"](1.5))
    over = {"medium.ratio": [1.5, 2.0, 2.5, 3.0]}
    alone = geomech.sweep(scene, over=over)
    with using(2):
        shared = geomech.sweep(scene, over=over)
        assert runner().executor.pool is not None
    np.testing.assert_array_equal(shared["x"].values, alone["x"].values)


@pytest.mark.parametrize("milliseconds", [1, 27])
def test_a_signal_at_any_moment_leaves_nobody_waiting(milliseconds, monkeypatch):
    """While tasks are given out, or results taken, all ends at once."""

    def ring(number, frame):
        raise InterruptedError

    monkeypatch.setattr(executors, "SIGNALS", [signal.SIGALRM])
    before = signal.signal(signal.SIGALRM, ring)
    try:
        with contextlib.closing(executors.Processes(1)) as executor:
            each(executor, doubled, 2, range(3))
            (worker,) = executor.pool._processes.values()
            signal.setitimer(signal.ITIMER_REAL, 1e-3 * milliseconds)
            with pytest.raises(InterruptedError):
                each(executor, doubled, 2, itertools.count(), 10**9)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    worker.join(20)
    assert not worker.is_alive()


def test_the_end_of_a_pool_ends_its_tasks(tmp_path):
    with contextlib.closing(executors.Processes(2)) as executor:
        tasks = [executor.submit(waits, str(tmp_path), k) for k in range(2)]
        workers = [*executor.pool._processes.values()]
        while len([*tmp_path.iterdir()]) < 2:
            assert not any(task.done() for task in tasks)
    for worker in workers:
        worker.join(20)
        assert not worker.is_alive()
    assert executor.pool is None
    executor.close()


KILLED = """
import os, signal
from geomech.runs.executors import Processes

if __name__ == "__main__":
    print(Processes(1).submit(abs, -1).result(), flush=True)
    os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.timeout(60)
def test_a_killed_program_leaves_no_worker_and_no_words(tmp_path):
    """Its standard error closes only once all of its processes have ended."""
    (tmp_path / "killed.py").write_text(KILLED)
    ended = subprocess.run(
        [sys.executable, "killed.py"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
    )
    told = (ended.returncode, ended.stdout, ended.stderr)
    assert told == (-signal.SIGKILL, "1\n", "")


@pytest.mark.timeout(20)
def test_an_error_in_a_thread_is_raised_and_stops_the_others():
    stopped = []

    def run(share, stop):
        if share == 0:
            raise ZeroDivisionError
        stopped.append(stop.wait(5))

    with pytest.raises(ZeroDivisionError):
        threads.run_shares(run, [0, 1, 2])
    assert stopped == [True, True]
