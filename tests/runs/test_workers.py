"""Work shared by processes: nothing is lost when a worker is ended, and nobody waits
for ever."""

import contextlib
import itertools
import os
import queue
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

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
from geomech.core.errors import Note, UnitWarning
from geomech.run import backend, executors, pending
from geomech.run.runner import Runner, runner
from geomech.run.workers import using
from geomech.scenes import kinds
from geomech.shell import terminal
from geomech.studies.displacement import cycles
from rft.core import threads
from rft.core.refusal import Refusal
from rft.laws import LAWS

TOOLS = Path(__file__).parents[1] / "tools"
GLASS = scenes.load("three-link-glass").with_numerics(phases=32)
LONG = 1e9  # s


@pytest.fixture(scope="module")
def two():
    """Two processes, for all tests that leave them alive."""
    with using(2):
        yield runner().executor


def each(executor, task, common, items, total=100, seconds=LONG):
    return list(Runner(executor=executor).map(task, common, items, total, seconds))


def test_processes_start_when_they_are_asked():
    with using(3):
        assert runner().executor.pool is None


def test_results_come_in_order(two):
    results = each(two, doubled, np.array([1.0, 2.0]), range(40))
    np.testing.assert_array_equal(results, np.outer(range(40), [1.0, 2.0]))


def test_a_worker_takes_one_thread_and_one_back_end_and_no_workers(two, tmp_path):
    results = each(two, meets, str(tmp_path), range(20))
    assert {x[1:4] for x in results} == {(1, "numpy", None)}
    pids = {x[0] for x in results}
    assert len(pids) == 2
    assert os.getpid() not in pids


def test_a_task_of_many_takes_one_thread_in_this_process_as_well():
    with backend.preferring("numba"):
        results = each(None, who, None, range(2))
    assert {x[:4] for x in results} == {(os.getpid(), 1, "numba", None)}
    assert threads.thread_count(None, 100) == threads.cores()


@pytest.mark.parametrize(
    ("count", "seconds", "n_here"),
    [(5, None, 5), (5, 1.0, 5), (1, LONG, 1), (5, LONG, 0)],
    ids=["not known", "short", "one task", "long"],
)
def test_what_is_small_is_computed_here(count, seconds, n_here, two):
    results = each(two, who, None, range(count), count, seconds)
    assert [x[0] for x in results].count(os.getpid()) == n_here


def test_what_turns_out_to_take_long_is_given_away(two, monkeypatch):
    monkeypatch.setattr(pending, "WORTH_PROCESSES", 1e-9)
    results = each(two, who, None, range(6), 6, None)
    assert [x[-1] for x in results] == [*range(6)]
    is_here = [x[0] == os.getpid() for x in results]
    assert is_here == [True] * 2 + [False] * 4


def test_an_ended_worker_loses_nothing(tmp_path):
    with contextlib.closing(executors.Processes(1)) as executor:
        assert each(executor, dies, str(tmp_path), range(8)) == [*range(8)]
        often = "ended 3 times at the same part: out of memory"
        with pytest.raises(RuntimeError, match=often):
            each(executor, always_dies, None, [0])
        assert each(executor, doubled, 2, range(4)) == [0, 2, 4, 6]


def test_errors_and_notes_come_back_and_printed_text_does_not(two):
    with pytest.raises(Refusal, match="no such thing as 2"):
        each(two, fails, None, range(4))
    with pytest.raises(RuntimeError, match="Odd: 1 and 5"):
        each(two, fails_oddly, None, [5])
    with pytest.warns(UnitWarning, match="an angle of 400 rad") as told:
        assert each(two, notes, None, range(4)) == [*range(4)]
    assert len(told) == 1


def test_a_function_inside_another_is_computed_here_without_a_word(two):
    assert each(two, lambda c, x: c + x, 1, range(4)) == [1, 2, 3, 4]


def test_a_class_of_the_program_is_computed_here_and_told(two, monkeypatch):
    monkeypatch.setattr(kinds, "registered", lambda: (("__main__", "Own"),))
    alone = "computed by one process, others cannot know it: the class Own is of the"
    with pytest.warns(Note, match=alone):
        assert {x[0] for x in each(two, who, None, range(4))} == {os.getpid()}


def test_a_request_that_is_given_up_ends_its_workers(tmp_path):
    def stop():
        while not list(tmp_path.iterdir()):
            time.sleep(0.02)
        os.kill(os.getpid(), signal.SIGTERM)

    threading.Thread(target=stop).start()
    one = contextlib.closing(executors.Processes(1))
    with pytest.raises(terminal.Stopped), terminal.stoppable(), one as executor:
        each(executor, waits, str(tmp_path), range(4))
    assert not any(map(is_running, tmp_path.iterdir()))


def test_workers_end_with_whoever_started_them(tmp_path):
    """By SIGKILL, which nobody hears, in the middle of a task."""
    code = """if True:
        import sys
        sys.path.insert(0, sys.argv[1])
        from tasks import waits
        from geomech.run.executors import Processes
        from geomech.run.runner import Runner
        one = Runner(executor=Processes(1))
        list(one.map(waits, sys.argv[2], range(4), 4, seconds=1e9))
    """
    line = [sys.executable, "-c", code, TOOLS, tmp_path]
    with subprocess.Popen(line) as process:
        while not list(tmp_path.iterdir()):
            assert process.poll() is None
            time.sleep(0.02)
        process.kill()
    end = time.monotonic() + 20
    while any(map(is_running, tmp_path.iterdir())) and time.monotonic() < end:
        time.sleep(0.02)
    assert not any(map(is_running, tmp_path.iterdir()))


def is_running(mark):
    """Return whether the process that left a file of its name still runs."""
    try:
        stat = Path(f"/proc/{mark.name}/stat").read_text()
    except OSError:
        return False
    return stat.rpartition(")")[2].split()[0] != "Z"


LAW = """
from dataclasses import dataclass

@dataclass(frozen=True)
class Ratio:
    ratio: float
    law = "of-a-worker"

    def traction(self, v_t, v_n, eps=0.0):
        return v_t, self.ratio * v_n
"""


@pytest.fixture
def own_law(tmp_path, own_parts):
    """A custom law whose file is gone."""
    path = tmp_path / "law.py"
    path.write_text(LAW)
    kinds.load_file(path)
    path.unlink()
    return LAWS["of-a-worker"]


def own_sweep(own_law):
    scene = GLASS.changed(medium=own_law(1.5))
    result = geomech.sweep(scene, over={"medium.ratio": [1.5, 2.0, 2.5, 3.0]})
    return result["x"].values


def test_plugins_are_known_to_workers(own_law, monkeypatch):
    monkeypatch.setattr(pending, "WORTH_PROCESSES", 0.0)
    monkeypatch.setattr(cycles, "BATCH_SIZE", 1)
    alone = own_sweep(own_law)
    with using(2):
        np.testing.assert_array_equal(own_sweep(own_law), alone)
        assert runner().executor.pool is not None


class Rung(Exception):
    pass


@pytest.mark.parametrize("milliseconds", [1, 27])
def test_a_signal_at_any_moment_leaves_nobody_waiting(milliseconds, monkeypatch):
    """While tasks are given out, or results taken, all ends at once."""

    def ring(number, frame):
        raise Rung

    monkeypatch.setattr(executors, "SIGNALS", [signal.SIGALRM])
    before = signal.signal(signal.SIGALRM, ring)
    try:
        with contextlib.closing(executors.Processes(1)) as executor:
            assert each(executor, doubled, 2, range(3)) == [0, 2, 4]
            workers = list(executor.pool._processes)
            signal.setitimer(signal.ITIMER_REAL, 1e-3 * milliseconds)
            with pytest.raises(Rung):
                each(executor, doubled, 2, itertools.count(), 10**9)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    assert not any(is_running(Path(str(pid))) for pid in workers)


def test_a_signal_as_a_thread_ends_is_no_reason_to_wait_for_ever(monkeypatch):
    """Between what the thread says and our hearing it."""

    class Deaf(queue.SimpleQueue):
        def get(self):
            super().get()
            raise terminal.Stopped(signal.SIGINT)

    ended = []

    def run(share, stop):
        if not stop.wait(0.2 * share):
            ended.append(share)

    monkeypatch.setattr(threads, "SimpleQueue", Deaf)
    with pytest.raises(terminal.Stopped):
        threads.run_shares(run, [0, 1, 5])
    assert ended == [0]  # the others were told to stop


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
