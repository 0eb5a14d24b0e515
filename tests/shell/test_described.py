"""What `explain` and short lines say of scenes, grids and numbers."""

import numpy as np
import pytest
import words

import rft
from geomech.core import summary
from geomech.mathematics.gaits import Fourier, Wave
from geomech.scenes.parts import as_scene
from geomech.shell.describe.scene import description

LAW = rft.Viscous(2.0)


def chain(joints):
    """Return a scene of a chain of this many joints."""
    gait = Fourier(cos=((0.5,),), sin=((0.0,),))
    if joints > 1:
        gait = Wave(joints=joints)
    return as_scene(LAW, rft.Chain((1.0,) * (joints + 1)), gait)


@pytest.mark.parametrize(
    ("joints", "lacks"),
    [
        (1, ["CCF maps"]),
        (2, []),
        (5, []),
        (6, ["CCF maps", "--pair", "6 joints"]),
    ],
)
def test_results_that_a_scene_lacks_are_listed(joints, lacks):
    lines = description(chain(joints)).splitlines()
    missing = [line for line in lines if "CCF maps" in line]
    assert bool(missing) == bool(lacks)
    for name in lacks:
        assert name in missing[0]


@pytest.mark.parametrize(
    ("share", "told"),
    [
        (0.0, [0]),
        (1e-8, [0]),
        (1.5e-8, [1.5e-6]),
        (0.0123, [1.2]),
        (0.5, [50]),
    ],
)
def test_a_share_is_in_percent_to_two_digits(share, told):
    assert [x for x, _ in words.numbers(summary.percent(share))] == told


UNEVEN = [np.linspace(-1, 1, 9), np.linspace(0, 2, 7)]
LEFT = np.full((3, 2), 3.0)
TOLD = [  # a function, what it is given, and names and numbers of its text
    (
        summary.grid,
        (UNEVEN,),
        ["9 x 7", "alpha_1 from -1 to 1", "alpha_2 from 0 to 2"],
    ),
    (summary.grid, (UNEVEN, ["a", "b"]), ["a from -1 to 1", "b from 0 to 2"]),
    (summary.grid, (UNEVEN[:1],), ["9 shapes, alpha_1 from -1 to 1"]),
    (summary.grid, (UNEVEN[:1] * 2,), ["9 x 9", "alpha_1 and alpha_2 from -1 to 1"]),
    (summary.grid, (UNEVEN[:1] * 3,), ["9 x 9 x 9", "alpha_1 to alpha_3 from -1 to"]),
    (summary.span, ([3.0, np.nan, 1.0, 2.0],), ["1 to 3"]),
    (summary.span, ([[1.0, 1.0001]],), ["1"]),
    (summary.span, ([np.nan],), ["nothing"]),
    (
        summary.poses,
        ([[1, 2, 3], [-4, 5, -6]],),
        ["x -4 to 1", "y 2 to 5", "theta -6 to 3"],
    ),
    (summary.masked, ([[1, np.nan, 3], [2, np.nan, 3]],), ["1 singular"]),
    (summary.lengths, ("BL", 2.0), ["BL"]),
    (summary.lengths, ("m", 0.25), ["m", "0.25"]),
    (summary.fit_residual, (LEFT, 8 * LEFT), ["x 12 %", "y 12 %", "theta 12 %"]),
    (summary.fit_residual, (LEFT * [np.nan, 1], 8 * LEFT), ["x 12 %"]),
    (summary.fit_residual, (LEFT * np.nan, LEFT), ["unknown"]),
    (
        summary.part,
        ("chain", rft.Chain((1, 2), length=1 / 3)),
        ["chain", "0.333333", "(1.0, 2.0)"],
    ),
]


@pytest.mark.parametrize(("function", "given", "told"), TOLD)
def test_a_line_about_numbers_has_them(function, given, told):
    text = function(*given)
    for part in told:
        assert part in text


def test_a_line_says_nothing_of_what_is_not_there():
    assert summary.masked([[1.0, 2.0]]) == summary.lengths("m", None) == ""
    assert "-0" not in summary.poses([[-0.0, -1e-14, 0.0]])
    assert "length" not in summary.lengths("BL", 2.0).replace("lengths", "")


@pytest.mark.parametrize(
    ("names", "text"),
    [("x", "x"), ("xy", "x and y"), ("xyz", "x, y and z")],
)
def test_names_are_listed(names, text):
    assert summary.listed(names) == text


def test_long_lines_are_wrapped_and_short_ones_stay():
    line = "words " * 30 + "end"
    short, *rest = summary.wrapped(["x" * summary.WIDTH, line], indent=4)
    assert short == "x" * summary.WIDTH
    assert len(rest) == 3
    assert max(map(len, rest)) <= summary.WIDTH
    assert [x.startswith("    ") for x in rest] == [False, True, True]
    assert " ".join(" ".join(rest).split()) == line
