"""When a request is too long: by seconds that its first balances tell."""

import numpy as np
import pytest

from geomech import scenes
from geomech.runs import cost as run_cost
from geomech.runs import runner as runners
from geomech.runs.backend import WORTH_LOADING
from geomech.runs.cost import Cost, decide, is_undecided
from geomech.studies.scene_tables import SceneTables
from rft.balance.backend import preferring
from rft.balance.listening import listener, listening, no_listener
from rft.core.refusal import Refusal

UNDECIDED = Cost(10**6, 31.0, 1e8, 1.0)


class Clock:
    """Computing time that passes as a request says it does."""

    def __init__(self, monkeypatch):
        self.now = 0.0
        monkeypatch.setattr(run_cost.time, "process_time", lambda: self.now)

    def solve(self, seconds, count=1, tell=None):
        """Solve batches that take so long each."""
        tell = tell or listener()
        for _ in range(count):
            self.now += seconds
            tell(1000, 3, False)


@pytest.fixture
def clock(monkeypatch):
    with listening(no_listener), preferring("numpy"):
        yield Clock(monkeypatch)


# s that a batch is assumed to take
BATCH = 1000 * 3 * run_cost.BALANCE["numpy"] + run_cost.BATCH["numpy"]


@pytest.mark.parametrize("factor", [0.1, 1.0, 3.0])
def test_the_first_batches_tell_what_the_others_take(factor, clock):
    """The very first one, and one that is far off, have loaded code."""
    judged = []
    decide(UNDECIDED, judged.append)
    assert is_undecided()
    for seconds in (9.0, factor * BATCH, 25 * factor * BATCH):
        clock.solve(seconds)
    assert judged == []
    clock.solve(factor * BATCH, count=500)
    assert not is_undecided()
    (told,) = judged
    assert told.seconds == pytest.approx(1 + factor * 30)
    assert told._replace(seconds=31.0) == UNDECIDED


def test_compiled_code_is_loaded_where_numpy_takes_long():
    """A step of time takes NumPy as long as many balances at once; a viscous balance
    takes it a tenth of the time of a dry one."""
    marched = SceneTables(scenes.load("sandfish-transient")).cost([0.2], ["direct"])
    assert marched.balances < 20_000 and marched.numpy_seconds > WORTH_LOADING
    counts = []
    for name in ("three-link-viscous", "three-link-glass"):
        amplitudes = np.linspace(0.1, 1.0, 1000)
        cost = SceneTables(scenes.load(name)).cost(amplitudes, ["direct"])
        counts.append(cost.numpy_seconds / cost.balances)
    assert counts[1] > 5 * counts[0]


@pytest.mark.parametrize(
    "cost",
    [
        Cost(1, 2.0, 1e8),
        Cost(10**9, 301.0, 1e8),
        Cost(10**6, 30.0, 3e9),
        Cost(0, 70.0, 1e8, 70.0),
    ],
    ids=["little", "very much", "much memory", "no balances"],
)
def test_what_is_sure_is_decided_at_once(cost, clock):
    judged = []
    decide(cost, judged.append)
    assert judged == [cost]
    assert not is_undecided()


def test_what_is_refused_leaves_nothing(tmp_path, clock):
    def ask():
        with runners.store_results(tmp_path / ".a.partial") as runner:
            runner.store.put(b"key", 1.0, float)
            runner.store.commit()
            decide(UNDECIDED, lambda told: told.check("here", False))
            clock.solve(1.0, count=9)

    with pytest.raises(Refusal, match="here: 1,000,000 force balances, about"):
        ask()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("cost", "is_allowed"),
    [
        (Cost(1, 59.0, 1.9e9), True),
        (Cost(1, 61.0, 1.0), False),
        (Cost(1, 1.0, 2.1e9), False),
    ],
)
def test_a_minute_and_two_gigabytes_are_the_limits(cost, is_allowed):
    cost.check("here", yes=True)
    if is_allowed:
        cost.check("here", yes=False)
    else:
        with pytest.raises(Refusal, match="here: 1 force balances"):
            cost.check("here", yes=False)


def test_a_batch_after_other_work_does_not_tell(clock):
    """Such as the loading of what an optimiser needs, before its first large batch."""
    judged = []
    decide(UNDECIDED, judged.append)
    clock.solve(BATCH, count=5)
    clock.solve(15 * BATCH)
    clock.solve(BATCH, count=400)
    (told,) = judged
    assert told.seconds < 35.0
