"""Every number in data/golden.json is what it was; the registry's newcomers have
theirs."""

import math

import golden
import pytest


def assert_unchanged(part, least):
    old = golden.kept(part)
    new = golden.compute(part)
    assert len(new) >= least
    if golden.changed(old, new):
        pytest.fail(f"if that is meant: {WRITE}\n{golden.table(old, new)}")


WRITE = "python tests/tools/golden.py --write"


@pytest.mark.usefixtures("solved_by")
@pytest.mark.parametrize(
    ("part", "least"),
    [
        (golden.velocities, 150),
        (golden.marches, 12),
        (golden.intrusions, 100),
        (golden.solids, 20),
    ],
    ids=lambda x: getattr(x, "__name__", ""),
)
def test_nothing_changed_that_nobody_meant_to_change(part, least):
    assert_unchanged(part, least)


@pytest.mark.usefixtures("fastest")
@pytest.mark.parametrize(
    ("part", "least"),
    [
        (golden.commands, 25),
        (golden.tiers, 60),
        (golden.pairs, 60),
        (golden.walks, 4),
        (golden.walkers, 60),
        (golden.intruders, 110),
        (golden.measurements, 105),
        (golden.forms, 450),
        (golden.pictures, 130),
        (golden.grains, 40),
        (golden.costs, 140),
    ],
    ids=lambda x: getattr(x, "__name__", ""),
)
def test_nor_of_what_is_made_of_them(part, least):
    assert_unchanged(part, least)


OLD = {"a": [1.0, -200.0], "b": [0.0], "c": [1.0], "d": [1.0, 2.0], "e, error": [1.0]}


def test_the_comparison_notices_the_twelfth_digit_and_what_is_missing_or_new():
    new = {"a": [1.0, -200.0000000003], "b": [0.0], "d": [1.0], "f": [1.0]}
    new["e, error"] = [1.0 + 1e-9]
    changes = golden.changed(OLD, new)
    moved = pytest.approx(1.5e-12, rel=0.01)
    assert changes == {"a": moved, "c": math.inf, "d": math.inf, "f": math.inf}
    assert golden.changed({"x": [1.0]}, {"x": [math.nan]})
    assert [line[0] for line in golden.table(OLD, new).splitlines()] == [*changes]


def test_the_comparison_takes_rounding():
    assert golden.changed(OLD, {**OLD, "a": [1.0 + 1e-10, -200.0]}) == {}
    assert "all 5 entries as recorded" in golden.table(OLD, OLD)
