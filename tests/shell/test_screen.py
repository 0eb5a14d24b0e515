"""Results as lines on a screen: as many digits as their errors leave meaning, as many
rows and columns as there is room for."""

import re

import numpy as np
import pytest

from geomech.core.variables import Result, Variable
from geomech.results import lengths, numbers, show

SHOWN = [
    (numbers.number, (2 / 3,), "0.666667"),
    (numbers.number, (-0.0,), "0"),
    (numbers.number, (-0.0004, 3), "0.000"),
    (numbers.number, (1234.5678, 1), "1234.6"),
    (numbers.number, (np.nan, 3), "-"),
    (numbers.number, (np.inf,), "-"),
    (numbers.size, (0.0,), "0"),
    (numbers.size, (0.01234,), "1.2e-02"),
    (numbers.size, (np.nan,), "unknown"),
    (numbers.magnitude, (0.099,), -2),
    (numbers.magnitude, (100.0,), 2),
    (numbers.decimals, (np.array([0.5, 3.0]), np.array([0.02, 0.003])), 4),
    (numbers.decimals, (np.array([123.0]), np.array([1e-9])), 4),
    (numbers.decimals, (np.array([123.0]), np.array([2000.0])), 0),
    (numbers.decimals, (np.array([1e-9]), np.array([1e-12])), None),
    (numbers.decimals, (np.array([1.0]), np.array([0.0])), None),
    (numbers.decimals, (np.array([1.0]), None), None),
    (
        numbers.with_error,
        (np.array(0.12344), np.array(0.0012), "m"),
        "0.1234 +- 1.2e-03 m",
    ),
    (numbers.with_error, (np.array(0.5), np.array(0.0), "m"), "0.5 +- 0 m"),
    (numbers.with_error, (np.array(0.5), np.array(np.nan)), "0.5"),
    (show.chosen_rows, (5, None), [0, 1, 2, 3, 4]),
    (show.chosen_rows, (5, 9), [0, 1, 2, 3, 4]),
    (show.chosen_rows, (9, 5), [0, 2, 4, 6, 8]),
    (show.chosen_rows, (9, 1), [0]),
    (show.with_unit, ("x", "m"), "x (m)"),
    (show.with_unit, ("x", "1"), "x"),
    (show.span, (np.array([3.0, np.nan, -1.0]),), "-1 to 3"),
    (show.span, (np.array([1e-13, np.nan, 0.0]),), "zero"),
    (show.aligned, (["a", "bcd"],), ["  a", "bcd"]),
    (show.joined, ([["a", "bcd"], ["ef", "g"]],), ["  a ef", "bcd  g"]),
    (show.width, ([["abc"], ["de"]],), 7),
    (lengths.unit_with, ("m/s", "m", "cm"), ("cm/s", 1)),
    (lengths.unit_with, ("m/rad2", "m", "BL"), ("BL/rad2", 1)),
    (lengths.unit_with, ("mm", "m", "cm"), ("mm", 0)),
    (lengths.unit_with, ("rad/s", "m", "cm"), ("rad/s", 0)),
]


@pytest.mark.parametrize(("function", "given", "shown"), SHOWN)
def test_a_part_of_a_line_is_short_and_true(function, given, shown):
    found = function(*given)
    if isinstance(found, np.ndarray):
        assert found.tolist() == shown
    else:
        assert found == shown


PHASE = Variable("phase", ("phase",), np.linspace(0, 3, 31), "rad")
HEIGHT = Variable(
    "height", ("phase",), 0.5 * PHASE.values + 1, "m", error=0.01 * PHASE.values
)
WEIGHT = Variable("weight", (), 2.5, "kg", "of the body", error=0.25, spread=0.125)
TINY = Variable("drift", (), 1e-9, "m/s", error=2e-9)
NAMES = Variable("leg", ("leg",), ["left", "right"])
TURNS = Variable("turn", ("leg", "phase"), np.outer([1.0, -2.0], PHASE.values), "rad")
SHOWN_RESULT = Result(
    "made", (PHASE, HEIGHT, WEIGHT, TINY, NAMES, TURNS), {"title": "t", "text": "a\nb"}
)


def rows_of(lines, first):
    """Return the numbers of the first table whose head begins with this name."""
    start, *_ = [k for k, line in enumerate(lines) if line.lstrip().startswith(first)]
    rows = []
    for line in lines[start + 1 :]:
        found = re.findall(r"-?\d+\.?\d*(?:e-?\d+)?", line)
        if not found or re.search("[a-df-z]", line):
            break
        rows.append([float(x) for x in found])
    return np.array(rows)


@pytest.mark.parametrize(("everything", "count"), [(False, show.ROWS), (True, 31)])
def test_a_long_table_is_thinned_and_a_whole_one_is_not(everything, count):
    lines = show.lines(SHOWN_RESULT, everything)
    rows = rows_of(lines, "phase (rad)" if everything else "phase (rad), 14 of 31")
    assert len(rows) == count
    assert rows[0, 0] == 0.0
    assert rows[-1, 0] == 3.0
    np.testing.assert_allclose(rows[:, 1], 0.5 * rows[:, 0] + 1, atol=6e-4)
    np.testing.assert_allclose(rows[:, 2], 0.01 * rows[:, 0], atol=6e-4)
    assert show.leaves_out(SHOWN_RESULT)


def test_a_number_has_its_error_its_spread_and_its_unit_and_a_zero_its_reason():
    lines = show.lines(SHOWN_RESULT)
    (weight,) = [line for line in lines if line.startswith("weight")]
    assert re.findall(r"[\d.]+(?:e-\d+)?", weight) == ["2.50", "2.5e-01", "1.2e-01"]
    assert "kg" in weight
    assert "of the body" in weight
    (drift,) = [line for line in lines if line.startswith("drift")]
    assert "zero" in drift
    assert "2.0e-09 m/s" in drift


def test_attributes_are_lines_of_a_whole_result_alone():
    assert "title: t" in show.lines(SHOWN_RESULT, everything=True)
    assert not any("title: t" in line for line in show.lines(SHOWN_RESULT))
    assert not any("text:" in x for x in show.lines(SHOWN_RESULT, everything=True))


def test_places_of_an_outer_dimension_are_columns():
    lines = show.lines(SHOWN_RESULT, everything=True)
    (start,) = [k for k, line in enumerate(lines) if line.startswith("turn (rad)")]
    assert lines[start + 1].split()[-2:] == ["left", "right"]
    assert [float(x) for x in lines[start + 32].split()] == [3.0, 3.0, -6.0]


AXES = [
    Variable("a", ("a",), np.linspace(-1, 1, 5), "rad"),
    Variable("b", ("b",), np.linspace(0, 9, 10), "rad"),
]
FIELD = np.sin(AXES[0].values)[:, None] * (AXES[1].values + 1.0)


def test_a_map_is_shown_by_its_extremes_and_their_places():
    both = np.stack([FIELD, 0 * FIELD])
    error = 0.1 + np.arange(100.0).reshape(both.shape)
    parts = Variable("part", ("part",), ["one", "none"])
    field = Variable("field", ("part", "a", "b"), both, "m", error=error)
    lines = show.lines(Result("made", (*AXES, parts, field)))
    assert any("5 x 10 points" in line for line in lines)
    assert any("a -1 to 1 rad" in line and "b 0 to 9 rad" in line for line in lines)
    (one,) = [line.split() for line in lines if line.split()[0] == "one"]
    size = 10 * np.sin(1)
    assert one == [
        "one",
        f"{-size:.4g}",
        "-1,",
        "9",
        f"{size:.4g}",
        "1,",
        "9",
        "4.9e+01",
    ]
    (none,) = [line.split() for line in lines if line.split()[0] == "none"]
    assert none == ["none", "zero", "zero", "5.0e+01"]


def test_lengths_in_another_unit_are_the_same_lengths():
    shown = lengths.converted(HEIGHT, "m", "cm", 100.0)
    assert shown.unit == "cm"
    np.testing.assert_allclose(shown.values, 100 * HEIGHT.values)
    np.testing.assert_allclose(shown.error, 100 * HEIGHT.error)
    mixed = Variable("xi", ("c",), np.ones(3), ("m/s", "m/s", "rad/s"))
    shown = lengths.converted(mixed, "m", "mm", 1000.0)
    assert shown.unit == ("mm/s", "mm/s", "rad/s")
    assert shown.values.tolist() == [1000, 1000, 1]
    assert lengths.converted(PHASE, "m", "cm", 100.0) is PHASE
