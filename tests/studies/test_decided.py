"""When a request is too long: assumed seconds, and those that its first balances tell."""

import dataclasses
from concurrent.futures import Future

import numpy as np
import pytest
import tasks

from geomech import scenes
from geomech.questions.swimmers.sweep import Sweep
from geomech.run import cost as run_cost
from geomech.run import runner as runners
from geomech.studies.scene_tables import SceneTables
from rft.balance.backend import preferring
from rft.balance.listening import listener, listening, no_listener
from rft.core.refusal import Refusal
from rft.core.threads import run_shares

GLASS = scenes.load("three-link-glass")
VISCOUS = scenes.load("three-link-viscous")


def test_seconds_are_assumed_for_places_of_the_body_and_for_batches():
    """Ten times as many places, or batches, take ten times as long; a linear medium takes a tenth."""
    with preferring("numpy"):
        one, places, batches = (
            run_cost.assumed_seconds(*x)
            for x in ((1e6, 3, False, 0), (1e6, 30, False, 0), (0, 0, False, 1e3))
        )
        assert places == pytest.approx(10 * one) and run_cost.assumed_seconds(
            1e6, 3, True, 0
        ) == pytest.approx(one / 10)
        assert run_cost.assumed_seconds(1e6, 3, False, 1e3) == pytest.approx(
            one + batches
        )
    few, many = (
        {"medium.ratio": np.linspace(1, 3, n).tolist()} for n in (10, 100)
    )  # each medium is a batch
    assert Sweep(VISCOUS, many).cost().seconds == pytest.approx(
        10 * Sweep(VISCOUS, few).cost().seconds, rel=0.01
    )
    together = {
        "medium.ratio": many["medium.ratio"][:10],
        "gait.amplitude": np.linspace(0.1, 1, 10).tolist(),
    }
    assert (
        Sweep(VISCOUS, together).cost().seconds
        < 0.4 * Sweep(VISCOUS, many).cost().seconds
    )


class Clock:
    """Computing time that passes as a request says it does."""

    def __init__(self, monkeypatch):
        self.now = 0.0
        monkeypatch.setattr(run_cost.time, "process_time", lambda: self.now)

    def solve(self, seconds, samples=1000, count=1):
        """Batches that take so long each."""
        for _ in range(count):
            self.take(seconds, listener(), samples)

    def take(self, seconds, tell, samples=1000):
        self.now += seconds
        tell(samples, 3, False)


@pytest.fixture
def clock(monkeypatch):
    with listening(no_listener), preferring("numpy"):
        yield Clock(monkeypatch)


BATCH = (
    1000 * 3 * run_cost.BALANCE["numpy"] + run_cost.BATCH["numpy"]
)  # s that one is assumed to take


@pytest.mark.parametrize("factor", [0.1, 1.0, 3.0])
def test_the_first_batches_tell_what_the_others_take(factor, clock):
    """The very first one, and one that is far off, have loaded code."""
    judged = []
    run_cost.decide(run_cost.Cost(10**6, 31.0, 1e8, 1.0), judged.append)
    assert run_cost.is_undecided()
    clock.solve(9.0)
    clock.solve(factor * BATCH)
    clock.solve(25 * factor * BATCH)
    assert judged == []
    clock.solve(factor * BATCH, count=500)
    (told,) = judged
    assert (
        told.seconds == pytest.approx(1 + factor * 30) and not run_cost.is_undecided()
    )
    assert (told.balances, told.memory) == (10**6, 1e8)


def test_threads_of_the_solver_tell_by_the_back_end_of_the_request(clock):
    judged = []
    run_cost.decide(run_cost.Cost(10**6, 30.0, 1e8), judged.append)
    tell = listener()
    run_shares(
        lambda share, stop: [clock.take(2 * BATCH, tell) for _ in range(500)], [0, 1]
    )
    assert judged[0].seconds == pytest.approx(60.0) and len(judged) == 1


def test_what_is_decided_next_is_not_told_by_what_was_to_be_before(clock):
    judged = []
    run_cost.decide(
        run_cost.Cost(10**6, 30.0, 1e8), lambda told: judged.append("first")
    )
    run_cost.decide(run_cost.Cost(10, 1e-3, 1e8), lambda told: judged.append("second"))
    clock.solve(1.0, count=99)
    assert judged == ["second"]


def test_a_step_of_time_weighs_as_much_as_many_balances_of_a_batch():
    """As NumPy takes a batch's time for it; for the choice of the back end alone."""
    marched = scenes.load("sandfish-transient")
    found = SceneTables(marched).cost([0.2], ["direct"])
    assert (
        found.steps > 500
        and found.as_balances
        == found.balances + 200 * found.steps
        > 100_000
        > found.balances
    )
    assert (
        SceneTables(scenes.load("three-link-glass")).cost([0.2], ["direct"]).steps == 0
    )


@pytest.mark.parametrize(
    "cost",
    [(1, 2.0, 1e8), (10**9, 301.0, 1e8), (10**6, 30.0, 3e9), (0, 70.0, 1e8, 70.0)],
)
def test_what_is_sure_is_decided_at_once(cost, clock):
    """Little, very much, much memory, or much that is no balances."""
    judged = []
    run_cost.decide(run_cost.Cost(*cost), judged.append)
    assert judged == [run_cost.Cost(*cost)] and not run_cost.is_undecided()


class Others:
    """Who begin at once, and are given what they compute."""

    remote, patience = True, None

    def __init__(self):
        self.given = 0

    def submit(self, task, *arguments):
        assert not run_cost.is_undecided()
        self.given, future = self.given + 1, Future()
        future.set_result(task(*arguments))
        return future

    def max_pending(self):
        return 1


def test_others_compute_once_it_is_decided(clock):
    others, found = Others(), []
    run_cost.decide(run_cost.Cost(10**6, 30.0, 1e8), lambda told: None)
    with runners.use_runner(dataclasses.replace(runners.runner(), executor=others)):
        for x in runners.runner().map(tasks.doubled, 2.0, range(8), 8):
            found.append(x)
            clock.solve(1.0)
    assert (
        found == [2.0 * x for x in range(8)]
        and others.given == 8 - 1 - run_cost.TIMED_BATCHES
    )


def test_what_is_refused_leaves_nothing(tmp_path, clock):
    def refused():
        with runners.store_results(tmp_path / ".a.partial", keep=True) as runner:
            runner.store.put(b"key", 1.0, float)
            runner.store.commit()
            run_cost.decide(
                run_cost.Cost(10**6, 31.0, 1e8), lambda told: told.check("here", False)
            )
            clock.solve(1.0, count=9)

    with pytest.raises(Refusal, match="here: 1,000,000 force balances, about"):
        refused()
    assert list(tmp_path.iterdir()) == []


def test_a_cost_reads_well():
    assert str(run_cost.Cost(1_000_000, 90.0, 2.1e9)) == (
        "1,000,000 force balances, about 1.5 min of computing and 2.1 GB of memory"
    )
    assert "about 14 h" in str(run_cost.Cost(1, 5e4, 0)) and "about 116 days" in str(
        run_cost.Cost(1, 1e7, 0)
    )
    run_cost.Cost(1, 59.0, 1.9e9).check("here", False)
    for beyond in (run_cost.Cost(1, 61.0, 1.0), run_cost.Cost(1, 1.0, 2.1e9)):
        beyond.check("here", True)
        with pytest.raises(Refusal, match="here: 1 force balances"):
            beyond.check("here", False)
