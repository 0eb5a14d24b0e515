"""What the texts of options mean."""

import math

import pytest

import geomech
from geomech.questions.shared import texts
from rft.core.refusal import Refusal

GLASS = geomech.load("three-link-glass")
WALKER = geomech.load("xplorer")


def over(text):
    return [*texts.parameters([text], GLASS).items()]


def rounded(value):
    """Return a value with its numbers to 12 digits."""
    if isinstance(value, float):
        return float(f"{value:.12g}")
    if isinstance(value, list | tuple):
        return tuple(map(rounded, value))
    return value


MEANINGS = [
    (texts.joint_limits, ("2.5", GLASS), 2.5),
    (texts.joint_limits, ("120deg", GLASS), math.radians(120)),
    (texts.joint_limits, ("-0.5:2", GLASS), [(-0.5, 2.0), (-0.5, 2.0)]),
    (texts.joint_limits, ("1,-90deg:2", GLASS), [(-1, 1), (-math.pi / 2, 2)]),
    (texts.angles, (GLASS, "--alpha", "0.3,-20deg"), (0.3, -math.radians(20))),
    (texts.spread, ("--over", "2:1:5"), [2.0, 1.75, 1.5, 1.25, 1.0]),
    (texts.spread, ("--over", "2:9:1"), [2.0]),
    (over, ("gait.amplitude=30deg,0.5",), [("gait.amplitude", [math.pi / 6, 0.5])]),
    (over, ("medium.C=1:2:2",), [("medium.C", [1.0, 2.0])]),
    (texts.components, (" x,theta",), ("x", "theta")),
    (texts.colour_limit, (" 0.25",), 0.25),
    (texts.colour_limit, ("98%", ("x", "theta")), "98%"),
    (texts.colour_limit, ("100%",), "100%"),
    (texts.colour_limit, ("0%:95.5%",), "0%:95.5%"),
    (texts.parse_end_caps, ("left-out",), 0.0),
    (texts.parse_end_caps, ("fitted",), "fitted"),
    (texts.parse_end_caps, ("1.5",), 1.5),
]


@pytest.mark.parametrize(("function", "given", "meaning"), MEANINGS)
def test_a_text_means_a_value(function, given, meaning):
    assert rounded(function(*given)) == rounded(meaning)


REFUSED = [
    (texts.joint_limits, "1:2:3", GLASS),
    (texts.joint_limits, "wide", GLASS),
    (texts.components, "x,x"),
    (texts.components, "z"),
    (texts.colour_limit, "0"),
    (texts.colour_limit, "-1"),
    (texts.colour_limit, "inf"),
    (texts.colour_limit, "1:2"),
    (texts.colour_limit, "0%"),
    (texts.colour_limit, "101%"),
    (texts.colour_limit, "-1%:50%"),
    (texts.colour_limit, "95%:5%"),
    (texts.colour_limit, "5%:5%"),
    (texts.colour_limit, "5%:101%"),
    (texts.colour_limit, "5%:50%:95%"),
    (texts.colour_limit, "5:95%"),
    (texts.colour_limit, "0.1", ("x", "theta")),
    (texts.colour_limit, "0.1", ()),
    (texts.spread, "--over", "1:2"),
    (texts.spread, "--over", "1:2:0"),
    (texts.spread, "--over", "1,inf"),
    (texts.spread, "--over", "1,30deg"),
    (texts.parameters, ["gait.amplitude"], GLASS),
    (texts.parameters, ["medium.C=1", "medium.C=2"], GLASS),
    (texts.parameters, ["medium.C=30deg"], GLASS),
    (texts.parameters, ["gait.frequency=30deg"], WALKER),
    (texts.parameters, ["gait.sweep_deg=30deg"], WALKER),
    (texts.parse_end_caps, "flat"),
]


@pytest.mark.parametrize("asked", REFUSED)
def test_a_text_that_means_nothing_is_refused(asked):
    function, *given = asked
    with pytest.raises(Refusal):
        function(*given)
