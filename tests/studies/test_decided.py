"""When a request is too long: assumed seconds, and those that its first balances
tell."""

import numpy as np
import pytest

from geomech import scenes
from geomech.questions.swimmers.sweep import Sweep
from geomech.run import cost as run_cost
from geomech.run import runner as runners
from geomech.run.backend import WORTH_LOADING
from geomech.run.cost import Cost, assumed_seconds, decide, is_undecided
from geomech.studies.scene_tables import SceneTables
from rft.balance.backend import preferring
from rft.balance.listening import listener, listening, no_listener
from rft.core.refusal import Refusal
from rft.core.threads import run_shares

VISCOUS = scenes.load("three-link-viscous")
UNDECIDED = Cost(10**6, 31.0, 1e8, 1.0)


def test_seconds_are_assumed_for_places_of_the_body_and_for_batches():
    with preferring("numpy"):
        one = assumed_seconds(1e6, 3, False, 0)
        assert assumed_seconds(1e6, 30, False, 0) == pytest.approx(10 * one)
        assert assumed_seconds(1e6, 3, True, 0) == pytest.approx(one / 10)
        batches = assumed_seconds(0, 0, False, 1e3)
        both = assumed_seconds(1e6, 3, False, 1e3)
        assert both == pytest.approx(one + batches)


def test_each_medium_of_a_sweep_is_a_batch():
    def seconds(n_media, n_amplitudes):
        media = np.linspace(1, 3, n_media).tolist()
        amplitudes = np.linspace(0.1, 1, n_amplitudes).tolist()
        over = {"medium.ratio": media, "gait.amplitude": amplitudes}
        return Sweep(VISCOUS, over).cost().seconds

    assert seconds(100, 1) == pytest.approx(10 * seconds(10, 1), rel=0.01)
    assert seconds(10, 10) < 0.4 * seconds(100, 1)


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


def test_threads_of_the_solver_tell_by_the_back_end_of_the_request(clock):
    judged = []
    decide(UNDECIDED, judged.append)
    tell = listener()
    run_shares(lambda *_: clock.solve(2 * BATCH, 500, tell), [0, 1])
    (told,) = judged
    assert told.seconds == pytest.approx(61.0)


def test_what_is_decided_next_is_not_told_by_what_was_to_be_before(clock):
    judged = []
    decide(UNDECIDED, lambda told: judged.append("first"))
    decide(Cost(10, 1e-3, 1e8), lambda told: judged.append("second"))
    clock.solve(1.0, count=99)
    assert judged == ["second"]


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


@pytest.mark.parametrize(
    ("seconds", "memory", "told"),
    [
        (90.0, 2.1e9, "about 1.5 min of computing and 2.1 GB of memory"),
        (5e4, 3e8, "about 14 h of computing and 300 MB of memory"),
        (1e7, 3e8, "about 116 days of computing and 300 MB of memory"),
    ],
)
def test_a_cost_reads_well(seconds, memory, told):
    assert str(Cost(1_000_000, seconds, memory)) == f"1,000,000 force balances, {told}"
