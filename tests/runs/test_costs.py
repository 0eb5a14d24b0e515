"""What a request costs, in words, and beyond which limits it needs consent."""

import pytest

from geomech.runs import cost
from geomech.runs.cost import Cost, TooLong
from geomech.runs.progress import counted


@pytest.mark.parametrize(
    ("seconds", "told"),
    [
        (0.2, "1 s"),
        (89.0, "89 s"),
        (90.0, "1.5 min"),
        (5399.0, "90 min"),
        (5400.0, "1.5 h"),
        (7200.0, "2 h"),
        (86400.0 * 1.5, "1.5 days"),
        (86400.0 * 1200, "1,200 days"),
    ],
)
def test_a_time_is_told_in_its_largest_unit(seconds, told):
    assert cost.duration(seconds) == told


def test_a_cost_tells_its_balances_time_and_memory():
    told = str(Cost(12345, 180.0, 3.2e9))
    assert "12,345" in told
    assert "3 min" in told
    assert "3.2 GB" in told
    assert "320 MB" in str(Cost(1, 1.0, 3.2e8))


@pytest.mark.parametrize(
    ("seconds", "memory", "is_small", "is_allowed"),
    [
        (1.0, 1e8, True, True),
        (cost.WORTH_SAYING, 1e8, False, True),
        (cost.LONGEST, cost.LARGEST, False, True),
        (cost.LONGEST * 1.01, 1e8, False, False),
        (1.0, cost.LARGEST * 1.01, False, False),
    ],
)
def test_what_needs_consent_is_refused_without(seconds, memory, is_small, is_allowed):
    asked = Cost(10, seconds, memory)
    assert asked.small == is_small
    asked.check("here", True)
    if is_allowed:
        asked.check("here", False)
        return
    with pytest.raises(TooLong, match="here.*ask for less"):
        asked.check("here", False, "ask for less")


def test_balances_that_take_longer_leave_other_work_as_it_is():
    assert Cost(10, 5.0, 1.0, besides=2.0).scaled(3.0).seconds == 2.0 + 3.0 * 3.0


@pytest.mark.parametrize("back_end", cost.BALANCE)
def test_assumed_seconds_grow_with_samples_points_and_batches(back_end):
    def assumed(samples, points, linear, batches):
        return cost.assumed_seconds(samples, points, linear, batches, back_end)

    batch = assumed(0, 10, False, 1)
    assert batch == cost.BATCH[back_end]
    dry = assumed(100, 10, False, 0)
    assert dry == pytest.approx(1000 * cost.BALANCE[back_end])
    assert assumed(100, 10, True, 0) == pytest.approx(cost.LINEAR * dry)
    assert assumed(100, 10, False, 7) == pytest.approx(dry + 7 * batch)


def test_the_fraction_done_is_told_before_each_item():
    told = []
    items = []
    for item in counted("abcd", 4, told.append):
        items.append((item, told[-1]))
    assert items == [("a", 0.25), ("b", 0.5), ("c", 0.75), ("d", 1.0)]
    assert [*counted("ab", 2, None)] == ["a", "b"]
