"""Every number in data/golden.json is what it was; the registry's newcomers have theirs."""

import math

import golden
import pytest


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
    old, new = golden.kept(part), golden.compute(part)
    assert len(new) >= least
    if moved := golden.changed(old, new):
        missing = [name for name in moved if name not in old]
        pytest.fail(
            f"{len(moved)} of {len(new)} numbers are not as recorded, {len(missing)} of them new: if that is meant, "
            f"python tests/tools/golden.py --write\n{golden.table(old, new)}"
        )


@pytest.mark.usefixtures("fastest")
@pytest.mark.parametrize(
    ("part", "least"),
    [
        (golden.commands, 15),
        (golden.tiers, 30),
        (golden.pairs, 40),
        (golden.walks, 4),
        (golden.walkers, 20),
        (golden.intruders, 40),
        (golden.measurements, 80),
        (golden.costs, 130),
    ],
    ids=lambda x: getattr(x, "__name__", ""),
)
def test_nor_of_what_is_made_of_them(part, least):
    test_nothing_changed_that_nobody_meant_to_change(part, least)


def test_the_comparison_notices(tmp_path, monkeypatch):
    """A change in the twelfth digit of the largest number, a missing, a new and a shorter entry; and not less than that."""
    old = {
        "a": [1.0, -200.0],
        "b": [0.0],
        "c": [1.0],
        "d": [1.0, 2.0],
        "e, estimate": [1.0],
    }
    new = {
        "a": [1.0, -200.0000000003],
        "b": [0.0],
        "d": [1.0],
        "e, estimate": [1.0 + 1e-9],
        "f": [1.0],
    }
    assert golden.changed(old, new) == {
        "a": pytest.approx(1.5e-12, rel=0.01)
    } | dict.fromkeys("cdf", math.inf)
    assert golden.changed(old, old | {"a": [1.0 + 1e-10, -200.0], "b": [0.0]}) == {}
    assert golden.changed({"x": [1.0]}, {"x": [math.nan]})
    lines = golden.table(old, new).splitlines()[1:]
    assert [line.split()[0] for line in lines] == ["a", "c", "d", "f"]
    assert lines[1].split()[1:] == ["1", "numbers", "none", "inf"]
    assert "all 5 entries as recorded" in golden.table(old, old)
    monkeypatch.setattr(golden, "FILE", tmp_path / "g.json")
    golden.write(old, new)
    assert golden.kept() == new | {
        "e, estimate": [1.0]
    }  # what did not change keeps its digits
    assert (tmp_path / "g.json").read_text().count("\n") == len(new) + 2
