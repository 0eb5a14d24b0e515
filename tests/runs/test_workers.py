"""Work shared by processes and clusters: the same digits whoever computes, nothing lost when a worker is ended."""

import contextlib
import dataclasses
import itertools
import os
import queue
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import Future
from pathlib import Path

import numpy as np
import pytest
from tabled import swept_table
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
from geomech.mathematics.geometry import connection, metric
from geomech.run import executors, pending
from geomech.run.runner import Runner, runner, use_runner
from geomech.run.workers import using
from geomech.scenes import kinds
from geomech.shell import terminal
from geomech.studies.displacement import cycles, sweep, tiered
from geomech.studies.optimisation import build_request, search
from geomech.studies.optimisation.variables import answers, displacement, values
from geomech.studies.scene_tables import SceneTables
from rft.balance import backend
from rft.core import threads as threaded
from rft.core.refusal import Refusal
from rft.core.threads import cores, thread_count
from rft.laws import LAWS

TOOLS = Path(__file__).parents[1] / "tools"

GLASS = scenes.load("three-link-glass").with_numerics(phases=32)


@pytest.fixture(scope="module")
def two():
    """Two processes, for all tests that leave them alive."""
    with using(2):
        yield runner().executor


@pytest.fixture
def given_away(monkeypatch):
    """All work goes to others, however small."""
    monkeypatch.setattr(pending, "WORTH_PROCESSES", 0.0)


def each(executor, task, common, items, total=100, seconds=1e9):
    return list(Runner(executor=executor).map(task, common, items, total, seconds))


def test_an_executor_is_looked_at_while_nothing_comes():
    """Which may find that its workers have gone."""

    class Slow(executors.Processes):
        patience = 0.01

        def submit(self, task, *arguments):
            return Future()

        def warn_if_stalled(self, future):
            future.set_result(b"done")

    assert pending.PendingTask(Slow(2), None, b"").result() == b"done"


def test_what_is_left_to_do_decides_whether_processes_are_worth_their_start(
    monkeypatch,
):
    asked = []
    monkeypatch.setattr(
        pending.TaskQueue,
        "_is_worth_processes",
        lambda self, remaining: asked.append(remaining),
    )
    assert each(executors.Processes(2), doubled, 2, range(4), total=4) == [
        0,
        2,
        4,
        6,
    ] and asked == [4, 3, 2, 1]


def test_results_come_in_order(two):
    found = each(two, doubled, np.array([1.0, 2.0]), range(40))
    np.testing.assert_array_equal(found, np.outer(range(40), [1.0, 2.0]))


def test_a_worker_takes_one_thread_and_one_back_end_and_no_workers_of_its_own(
    two, tmp_path
):
    found = each(two, meets, str(tmp_path), range(20))
    assert {x[1:4] for x in found} == {(1, "numpy", None)}
    pids = {x[0] for x in found}
    assert len(pids) == 2 and os.getpid() not in pids
    with backend.preferring("numba"):
        assert {x[:4] for x in each(None, who, None, range(2))} == {
            (os.getpid(), 1, "numba", None)
        }
    assert (
        thread_count(None, 100) == cores() and backend.preferred() == "numpy"
    )  # and it is over


def test_what_is_small_is_done_here(two):
    here = each(two, who, None, range(5), 5, seconds=None)
    assert {x[0] for x in here} == {os.getpid()}
    assert {x[0] for x in each(two, who, None, range(5), 5, seconds=1.0)} == {
        os.getpid()
    }
    assert {x[0] for x in each(two, who, None, [7], 1, seconds=1e9)} == {
        os.getpid()
    }  # there is nothing to share


def test_what_turns_out_to_take_long_is_given_away(two, monkeypatch):
    monkeypatch.setattr(pending, "WORTH_PROCESSES", 1e-9)
    found = each(two, who, None, range(6), 6, seconds=None)
    assert [x[-1] for x in found] == [*range(6)]
    assert [x[0] == os.getpid() for x in found] == [
        True,
        True,
        False,
        False,
        False,
        False,
    ]


def test_an_ended_worker_loses_nothing(tmp_path):
    with contextlib.closing(executors.Processes(1)) as executor:
        assert each(executor, dies, str(tmp_path), range(8)) == [*range(8)]
        with pytest.raises(
            RuntimeError, match="ended 3 times at the same part: out of memory"
        ):
            each(executor, always_dies, None, [0])
        assert each(executor, doubled, 2, range(4)) == [0, 2, 4, 6]


def test_errors_and_notes_come_back_and_what_is_printed_is_no_answer(two):
    with pytest.raises(Refusal, match="no such thing as 2"):
        each(two, fails, None, range(4))
    with pytest.raises(RuntimeError, match="Odd: 1 and 5"):
        each(two, fails_oddly, None, [5])
    with pytest.warns(UnitWarning, match="an angle of 400 rad") as told:
        assert each(two, notes, None, range(4)) == [*range(4)]
    assert len(told) == 1


def test_what_others_cannot_know_is_done_here(two, monkeypatch):
    """Without a word for a function that is made inside another; a class that only the program has is worth saying."""
    assert each(two, lambda c, x: c + x, 1, range(4)) == [1, 2, 3, 4]
    monkeypatch.setattr(kinds, "registered", lambda: (("__main__", "Own"),))
    with pytest.warns(
        Note,
        match="computed by one process, others cannot know it: the class Own is of the program",
    ):
        assert {x[0] for x in each(two, who, None, range(4))} == {os.getpid()}


def test_a_request_that_is_given_up_ends_its_workers(tmp_path):
    """Nobody waits for what is under way, and nobody goes on with it."""

    def stop():
        while not list(tmp_path.iterdir()):
            time.sleep(0.02)
        os.kill(os.getpid(), signal.SIGTERM)

    start, stopper = time.monotonic(), threading.Thread(target=stop)
    stopper.start()
    one = contextlib.closing(executors.Processes(1))
    with pytest.raises(terminal.Stopped), terminal.stoppable(), one as executor:
        each(executor, waits, str(tmp_path), range(4))
    assert time.monotonic() - start < 50  # of the minute that a task takes
    for mark in tmp_path.iterdir():
        with pytest.raises(ProcessLookupError):
            os.kill(int(mark.name), 0)


def test_workers_end_with_whoever_started_them(tmp_path):
    """SIGKILL, which nobody can hear: in the middle of a part, too."""
    code = f"""if True:
        import sys
        sys.path[:0] = {[str(TOOLS)]!r}
        from tasks import waits
        from geomech.run.executors import Processes
        from geomech.run.runner import Runner
        list(Runner(executor=Processes(1)).map(waits, {str(tmp_path)!r}, range(4), 4, seconds=1e9))
    """
    with subprocess.Popen([sys.executable, "-c", code]) as process:
        while not list(tmp_path.iterdir()):
            assert process.poll() is None
            time.sleep(0.02)
        process.kill()
    left = {int(mark.name) for mark in tmp_path.iterdir()}
    until = time.monotonic() + 20
    while left and time.monotonic() < until:
        left = {
            pid
            for pid in left
            if Path(f"/proc/{pid}").exists() and "Z" not in status(pid)
        }
        time.sleep(0.02)
    assert left == set()


def status(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return "Z"


OVER = {
    "body.length": [1.0, 2.0, 3.0],
    "medium.C": [1.5, 2.5],
    "gait.amplitude": [0.4, 0.8, 1.2],
}


@pytest.mark.parametrize("at_once", [2, 64])
def test_a_sweep_has_the_same_digits_whoever_computes(
    at_once, two, given_away, monkeypatch
):
    monkeypatch.setattr(cycles, "BATCH_SIZE", at_once)
    here, shared = both(
        two, lambda: swept_table(sweep.sweep(GLASS, OVER)), at_once < 64
    )
    for key in ("displacement", "estimate", "estimate_heading"):
        np.testing.assert_array_equal(shared[key], here[key])


def both(two, ask, shared=True):
    """What a request gives here, and by processes, which have done some of it if it is to be shared."""
    with use_runner(Runner()):  # `two` is there for all tests
        here, sent = ask(), []

    class Counted(executors.Processes):
        def submit(self, task, *arguments):
            sent.append(task)
            return two.submit(task, *arguments)

    with use_runner(Runner(executor=Counted(2))):
        there = ask()
    assert (len(sent) > 1) == shared
    return here, there


def test_fields_have_the_same_digits_whoever_computes(two, given_away, monkeypatch):
    """With what moving costs, whose powers come beside the velocities."""
    monkeypatch.setattr(
        connection, "SAMPLES_TOGETHER", 20
    )  # a quarter of the viscous field has 36
    monkeypatch.setattr(metric, "SAMPLES_TOGETHER", 30)
    for scene in (
        GLASS.with_numerics(grid=5, harmonics=3),
        scenes.load("three-link-viscous").with_numerics(grid=5),
    ):

        def ask():
            study = SceneTables(scene)
            study.compute_metric()
            return study.fitted.A, study.fitted.residual, study.metric

        (A, residual, cost), shared = both(two, ask)
        np.testing.assert_array_equal(shared[0], A)
        np.testing.assert_array_equal(shared[1], residual)
        name = "M" if scene.system.traits.linear else "coefficients"
        np.testing.assert_array_equal(getattr(shared[2], name), getattr(cost, name))


def test_error_studies_have_the_same_digits_whoever_computes(
    two, given_away, monkeypatch
):
    few = [
        dataclasses.replace(k, values=k.values[:2])
        for k in tiered.SETTINGS
        if k.tier in ("direct", "path")
    ]
    monkeypatch.setattr(tiered, "SETTINGS", few)
    monkeypatch.setattr(tiered, "TRUTH_PHASES", 64)
    scene, told = scenes.load("three-link-viscous").with_numerics(grid=5, phases=32), []
    here, shared = both(
        two, lambda: geomech.accuracy(scene, runs=1, progress=told.append)
    )
    np.testing.assert_array_equal(shared["error"].values, here["error"].values)
    assert here.sizes["setting"] == 3
    assert (shared["seconds"].values > 0).all()
    parts = len(told) // 2  # each tells, whoever has done it
    assert parts >= 2 * 3 and told == 2 * [(k + 1) / parts for k in range(parts)]


def test_searches_have_the_same_digits_whoever_computes(two, given_away, monkeypatch):
    for names in (
        search.__globals__,
        vars(sys.modules["geomech.studies.optimisation.request"]),
    ):
        monkeypatch.setitem(names, "N_PERTURBED", 1)  # perturbation of each size
        monkeypatch.setitem(names, "N_FROM_NARROWER", 1)  # start from narrower limits
    scene, told = GLASS.with_numerics(grid=5), []
    request = build_request(scene, "efficiency", harmonics=1, starts=2)
    here, shared = both(two, lambda: search(request, told.append))
    numbers = lambda optimum: [
        v.values.tolist()
        for v in (*values(optimum), *displacement(optimum), *answers(optimum))
    ]
    assert numbers(here) == numbers(shared)
    assert here.best.gait == shared.best.gait and here.answers == shared.answers
    assert all(0 < x < 1 for x in told) and len(set(told)) > 2
    for some in (told[: len(told) // 2], told[len(told) // 2 :]):  # here, and by others
        assert some == sorted(some) and some[-1] > 0.8


POWER = """
from dataclasses import dataclass
import numpy as np

@dataclass(frozen=True)
class Power:
    power: float
    law = "power-of-workers"

    def traction(self, v_t, v_n, eps=0.0):
        drag = (np.sqrt(v_t**2 + v_n**2 + eps**2) + 1e-300) ** (self.power - 1)
        return drag * v_t, 3.0 * drag * v_n
"""


@pytest.fixture
def power(tmp_path, own_parts):
    """A law of one's own, whose file is gone."""
    path = tmp_path / "power.py"
    path.write_text(POWER)
    kinds.load_file(path)
    path.unlink()
    return LAWS["power-of-workers"]


def test_plugins_are_known_to_workers(power, two, given_away, monkeypatch):
    """By their text, which need not be a file where they are."""
    monkeypatch.setattr(cycles, "BATCH_SIZE", 1)
    scene, over = (
        GLASS.changed(medium=power(1.0)),
        {"medium.power": [0.8, 0.9, 1.0, 1.1, 1.2]},
    )
    here, shared = both(two, lambda: swept_table(sweep.sweep(scene, over)))
    np.testing.assert_array_equal(shared["displacement"], here["displacement"])


def test_processes_are_not_started_before_they_are_asked():
    with using(3):
        assert (
            isinstance(runner().executor, executors.Processes)
            and runner().executor.pool is None
        )


def test_a_signal_at_any_moment_leaves_nobody_waiting(monkeypatch):
    """One that arrives while tasks are given out, or results taken: all ends at once, and others can be begun."""

    class Rung(Exception):
        pass

    def ring(number, frame):
        raise Rung

    monkeypatch.setattr(executors, "SIGNALS", [signal.SIGALRM])
    before = signal.signal(signal.SIGALRM, ring)
    try:
        for k in (0, 2):
            with (
                contextlib.suppress(Rung),
                contextlib.closing(executors.Processes(1)) as executor,
            ):
                assert each(executor, doubled, 2, range(3)) == [0, 2, 4]
                pool = executor.pool
                signal.setitimer(signal.ITIMER_REAL, 1e-3 * (1 + 13 * k))
                each(executor, doubled, 2, itertools.count(), 10**9)
            begun = time.monotonic()
            pool._executor_manager_thread and pool._executor_manager_thread.join(5.0)
            assert executor.pool is None and time.monotonic() - begun < 5.0
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def test_a_signal_that_comes_as_a_thread_ends_is_no_reason_to_wait_for_ever(
    monkeypatch,
):
    """Between what the thread says and our hearing it: a queue that was emptied has nothing more to say."""

    class Deaf(queue.SimpleQueue):
        def get(self):
            super().get()
            raise terminal.Stopped(signal.SIGINT)

    ended = []
    monkeypatch.setattr(threaded, "SimpleQueue", Deaf)
    with pytest.raises(terminal.Stopped):
        threaded.run_shares(
            lambda share, stop: stop.wait(0.2 * share) or ended.append(share), [0, 1, 5]
        )
    assert ended == [0]  # the others were told to stop


@pytest.mark.timeout(20)
def test_an_error_in_a_thread_is_raised_and_stops_the_others():
    stopped = []
    with pytest.raises(ZeroDivisionError):
        threaded.run_shares(
            lambda share, stop: stopped.append(stop.wait(5)) if share else 1 / share,
            [0, 1, 2],
        )
    assert stopped == [True, True]
