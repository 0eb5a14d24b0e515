"""Slip, sinkage and outcomes of robots that walk, over sweeps of their slopes."""

import dataclasses
import math

import numpy as np
import pytest

import geomech
from geomech import scenes
from geomech.core.variables import Result, Variable
from geomech.results import show
from geomech.studies.terradynamics import outcome as outcomes
from geomech.studies.terradynamics.walking import walked
from rft.core.metres import GRAVITY
from rft.terradynamics.ground import Slope
from rft.terradynamics.plates import VERTICAL, Wheel
from rft.terradynamics.walking import (
    Fineness,
    Roller,
    Tripod,
    Walker,
    engine,
    rolling,
)

pytestmark = pytest.mark.usefixtures("fastest")
LOOSE = VERTICAL["poppy-seeds-loose"].stress
XPLORER = scenes.load("xplorer")
QUICK = Fineness(steps=16, elements=6, duration=1.0)


@pytest.fixture(scope="module")
def level_walk():
    walker = Walker(XPLORER.robot, XPLORER.gait, LOOSE)
    (one,) = engine("planar").walk([walker], QUICK, 3)
    return one


def test_the_slip_of_a_wheel_is_that_at_which_it_pulls_nothing():
    """Its feet move back at rate x radius; it sinks as deep as a wheel that rolls
    steadily with that slip."""
    wheel = Walker(Roller(2.0, Wheel(0.1, 0.1)), Tripod(0.5), LOOSE)
    (one,) = engine("planar").walk([wheel], Fineness(steps=96, elements=48), 3)
    assert one.foot_speed == pytest.approx(math.pi * 0.1, rel=3e-3)
    slip = 1.0 - one.speed / one.foot_speed
    steady = rolling(LOOSE, Wheel(0.1, 0.1), 2 * GRAVITY, math.pi, slip)
    assert abs(steady.pull) < 0.01 * 2 * GRAVITY
    assert one.sinkage == pytest.approx(float(steady.sinkage), rel=0.02)


def test_feet_are_the_same_in_both_engines():
    pytest.importorskip("mujoco")
    walker = Walker(XPLORER.robot, XPLORER.gait, XPLORER.medium)
    planar, spatial = (
        engine(name).walk([walker], Fineness(steps=24), 3)[0]
        for name in ("planar", "mujoco")
    )
    assert spatial.foot_speed == pytest.approx(planar.foot_speed, rel=0.01)
    # Its legs' ends are a little longer, to have the area of their arcs.
    assert spatial.sinkage == pytest.approx(planar.sinkage, rel=0.03)
    assert spatial.speed_along == pytest.approx(spatial.speed, rel=1e-3)


def test_slip_and_sinkage_have_the_errors_of_coarse_steps():
    """On level ground, and on a slope; against steps and elements that are finer."""
    coarse = dataclasses.replace(XPLORER, numerics=Fineness(steps=16, elements=8))
    fine = dataclasses.replace(XPLORER, numerics=Fineness(steps=96, elements=32))
    for effects in ((), (Slope(0.1),)):
        one, exact = (
            walked([dataclasses.replace(scene, effects=effects)], settling=True)[0]
            for scene in (coarse, fine)
        )
        slip, error = one.slip
        assert abs(slip - exact.slip[0]) < error < 0.3
        sinkage = one.walk.sinkage
        assert abs(sinkage - exact.walk.sinkage) < one.sinkage < 0.1 * sinkage


OUTCOMES = [
    ({"status": "sunk"}, 0.1, outcomes.SINKS),
    ({"status": "flipped"}, 0.0, outcomes.TIPS),
    ({"status": "airborne"}, -0.1, outcomes.FLIES),
    ({"turned": -1.6}, 0.1, outcomes.TURNS),
    ({"turned": 1.5}, 0.1, outcomes.CLIMBS),
    ({}, 0.0, outcomes.WALKS),
    ({}, -0.1, outcomes.DESCENDS),
    ({"speed_along": -0.1}, 0.1, outcomes.SLIPS),
    ({"speed_along": -0.1}, 0.0, outcomes.SLIPS),
    ({"speed_along": 0.0}, 0.1, outcomes.STAYS),
    ({"speed_along": 2e-3}, 0.1, outcomes.UNDECIDED),
    ({"speed_along": 0.012, "periodic": False}, 0.1, outcomes.UNDECIDED),
]


@pytest.mark.parametrize(("changes", "rise", "expected"), OUTCOMES)
def test_outcomes_are_what_they_are_defined_to_be(level_walk, changes, rise, expected):
    """Of a robot with legs of 41 mm at 2 Hz: it is stuck below 1.6 mm/s."""
    one = level_walk._replace(**changes)
    error = 0.012 if changes.get("periodic") is False else 5e-4
    assert outcomes.outcome(one, error, 2.0, rise) == expected
    assert {name for *_, name in OUTCOMES} | {outcomes.SLIDES} == {*outcomes.OUTCOMES}


@pytest.mark.parametrize(
    ("moves", "rise", "expected"),
    [
        ((0.01, 0.03, 0.05), 0.2, outcomes.SLIDES),
        ((-0.01, -0.03, -0.05), -0.2, outcomes.SLIDES),
        ((0.01, 0.03, 0.035), 0.2, outcomes.SLIPS),  # it settles
        ((0.05, 0.03, 0.01), 0.2, outcomes.SLIPS),
        ((0.01, 0.03, 0.05), 0.0, outcomes.SLIPS),  # nothing is downhill
    ],
)
def test_a_robot_slides_down_that_gathers_speed_downhill(
    level_walk, moves, rise, expected
):
    """moves: towards -x in the last cycles of half a second."""
    x = -np.cumsum([0.0, 0.02, *moves])
    pose = np.stack([x, 0 * x, 0 * x], -1)
    speed = 2 * float(x[-1] - x[-2])
    one = level_walk._replace(
        t=0.5 * np.arange(5), pose=pose, speed=speed, speed_along=speed, periodic=False
    )
    assert outcomes.outcome(one, 1e-3, 2.0, rise) == expected
    repeated = one._replace(periodic=True)
    assert outcomes.outcome(repeated, 1e-3, 2.0, rise) != outcomes.SLIDES


@pytest.mark.parametrize(
    ("degrees", "expected"),
    [(0.0, outcomes.WALKS), (20.0, outcomes.STAYS), (35.0, outcomes.SLIDES)],
)
def test_a_light_wheel_walks_gets_stuck_and_slides_down(degrees, expected):
    wheel = Roller(0.3, Wheel(0.1, 0.1))
    scene = dataclasses.replace(
        XPLORER,
        robot=wheel,
        gait=Tripod(0.5),
        effects=(Slope(math.radians(degrees)),),
        numerics=Fineness(),
    )
    (one,) = walked([scene], settling=True)
    assert one.outcome(scene) == expected


OVER = {
    "effects.slope.angle_deg": [-10.0, 0.0, 8.0, 22.0, 37.0],
    "gait.frequency": [1.0, 2.0],
}


@pytest.fixture(scope="module")
def swept(fastest):
    scene = dataclasses.replace(scenes.load("xplorer-slope"), numerics=QUICK)
    return geomech.sweep(scene, OVER)


def test_a_sweep_has_slip_sinkage_and_outcome_of_every_point(swept):
    """The steeper, the slower and the deeper; and each point is as by itself."""
    names = swept["outcome"].values
    assert names[:, 1].tolist() == [
        outcomes.DESCENDS,
        outcomes.WALKS,
        outcomes.CLIMBS,
        outcomes.SLIPS,
        outcomes.SINKS,
    ]
    for name in ("speed", "slip", "sinkage", "uphill"):
        assert swept[name].values.shape == swept[name].error.shape == (5, 2)
    assert (np.diff(swept["speed"].values[:4], axis=0) < 0).all()
    assert (np.diff(swept["slip"].values[:4], axis=0) > 0).all()
    assert (np.diff(swept["sinkage"].values[2:4], axis=0) > 0).all()
    assert np.isnan(swept["uphill"].values[1]).all()

    slope = Slope(math.radians(8.0))
    scene = dataclasses.replace(XPLORER, numerics=QUICK, effects=(slope,))
    (alone,) = walked([scene], settling=True)
    assert swept["slip"].values[2, 1] == pytest.approx(alone.slip[0], abs=1e-9)
    uphill, _ = alone.uphill(scene)
    assert swept["uphill"].values[2, 1] == pytest.approx(uphill, abs=1e-12)
    assert uphill == pytest.approx(alone.walk.speed / 2.0)


def test_maps_of_a_sweep_name_the_outcomes_of_its_points(swept):
    figure = geomech.plots.sweep_figure(swept.question.scene, swept, maps=True)
    (legend,) = figure.legends
    named = {text.get_text() for text in legend.get_texts()}
    assert named == {*swept["outcome"].values.ravel().tolist()}
    labels = [ax.get_ylabel() for ax in figure.axes]
    assert sum("frequency" in label for label in labels) == 3
    for ax in figure.axes[:3]:
        points = sum(len(marks.get_offsets()) for marks in ax.collections[1:])
        assert points == swept["outcome"].values.size


def test_texts_over_a_large_grid_are_counted():
    """Beside numbers, of which the least and the largest are shown."""
    x = np.linspace(0.0, 1.0, 40)
    fates = np.full((40, 40), outcomes.CLIMBS, "U20")
    fates[3, :7] = outcomes.UNDECIDED
    over = ("x", "y")
    result = Result(
        "sweep",
        (
            Variable("x", ("x",), x),
            Variable("y", ("y",), x),
            Variable("speed", over, x[:, None] + x),
            Variable("outcome", over, fates),
        ),
        {"scene": "robots"},
    )
    text = [line.split() for line in show.lines(result)]
    assert [outcomes.UNDECIDED, "7"] in text
    assert [outcomes.CLIMBS, "1593"] in text


REFUSED = [
    ("xplorer-slope", {"gait.frequency": [1.0]}, "cannot draw maps over 1"),
    ("three-link-glass", {"medium.C": [1.0], "medium.gamma0": [0.2]}, "robots"),
]


@pytest.mark.parametrize(("name", "over", "said"), REFUSED)
def test_maps_are_of_robots_over_two_parameters(name, over, said):
    from geomech.questions.swimmers.sweep import Sweep

    with pytest.raises(ValueError, match=said):
        Sweep(scenes.load(name), over).check_draw(maps=True)


def test_a_scene_on_a_slope_tells_what_becomes_of_its_robot():
    scene = dataclasses.replace(scenes.load("xplorer-slope"), numerics=QUICK)
    result = geomech.walk(scene)
    assert str(result["outcome"].values) == outcomes.CLIMBS
    assert float(result["uphill"]) > 0
    assert outcomes.OUTCOMES[outcomes.CLIMBS] in "\n".join(show.lines(result))
