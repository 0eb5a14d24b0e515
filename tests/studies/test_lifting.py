"""Scenes with contact that comes and goes: trajectories, outcomes on slopes, and gaits
that wind around the phase of contact."""

import dataclasses
import math

import numpy as np
import pytest

import geomech
from geomech import scenes
from geomech.mathematics.gaits import Circle, Wave
from geomech.mathematics.systems import Swimmer
from geomech.scenes import write
from geomech.studies.mechanics import outcome
from geomech.studies.mechanics.motion import compute_motion
from rft import Chain, Coulomb, LinkContact, Serpenoid, Slope, Touching, WaveContact
from rft.core.refusal import Refusal

pytestmark = pytest.mark.usefixtures("fastest")
CONTACT = ("sidewinder", "sidewinder-slope", "lifting-snake", "salamander")


def on_slope(scene, **changes):
    (slope,) = scene.system.effects
    return scene.changed(effects=(dataclasses.replace(slope, **changes),))


def with_duty(scene, duty):
    contact = dataclasses.replace(scene.system.contact, duty=duty)
    return scene.changed(contact=contact)


@pytest.mark.parametrize("name", CONTACT)
def test_a_trajectory_tells_what_touches(name):
    result = geomech.study(name, phases=32).trajectory()
    parts = [x for x in result if x.startswith("contact_")]
    weights = np.stack([result[x].values for x in parts])
    loads = np.stack([result[f"load_{x[8:]}"].values for x in parts])
    assert ((weights >= 0) & (weights <= 1)).all()
    assert np.ptp(weights, axis=1).min() > 0.9  # every part lifts and touches
    assert (loads[weights == 0] == 0).all()
    scene = scenes.load(name)
    if name in ("lifting-snake", "salamander"):
        assert np.abs(loads.mean(0) - 1).max() < 1e-9
    assert scenes.parse(write.toml(scene), name) == scene


def test_a_sidewinder_goes_sideways_and_leaves_tracks():
    """What touches hardly slides, as of a sidewinder, and its body does not turn."""
    motion = compute_motion(scenes.load("sidewinder").with_numerics(phases=128))
    x, y, turned = motion.pose[-1]
    assert y > 2 * x > 0
    assert abs(turned) < 1e-6
    points = motion.points()
    middles = (points[:, 1:] + points[:, :-1]) / 2
    step = np.hypot(*np.diff(middles, axis=0).T)
    held = np.minimum(motion.contact.weight[1:], motion.contact.weight[:-1]).T == 1
    lifted = np.maximum(motion.contact.weight[1:], motion.contact.weight[:-1]).T == 0
    assert step[held].mean() < 0.35 * step[lifted].mean()


def test_the_steps_of_a_walker_follow_its_contact_phase():
    """A scene carries the phase of contact along with its gait, backwards where the
    gait is reversed, so that the way back undoes the way there."""
    feet = LinkContact(links=((0.0, 0.5), (), (0.5, 1.0)))
    system = Swimmer(Coulomb(), Chain(), contact=feet)
    nets = []
    for reverse in (False, True):
        scene = scenes.Scene(system, Circle(0.6, reverse=reverse))
        assert scene.gait.joints == 3
        nets.append(scene.cycle(phases=512).net)
    there, back = (math.hypot(*net[:2]) for net in nets)
    assert there > 0.1
    assert back == pytest.approx(there, rel=1e-3)
    assert nets[0][2] == pytest.approx(-nets[1][2], abs=1e-6)


def test_a_body_with_contact_is_a_swimmer_with_contact():
    rule = WaveContact(follows="shape")
    split = Swimmer(Coulomb(), Touching(Serpenoid(20), rule))
    assert split == Swimmer(Coulomb(), Serpenoid(20), contact=rule)
    with pytest.raises(Refusal, match="contact"):
        Swimmer(Coulomb(), Touching(Serpenoid(20), rule), contact=rule)


# Areas of gaits that wind


@pytest.mark.parametrize("bend", [0.2])
def test_the_line_and_the_area_make_the_displacement_of_a_salamander(bend):
    """The integral along the loop at rest and the CCF between it and the gait, against
    the balance of forces, within the error that is told."""
    scene = scenes.load("salamander").with_numerics(grid=21, extent=0.3)
    gait = dataclasses.replace(scene.gait, amplitude=bend)
    found = geomech.study(scene.changed(gait=gait)).displacement(
        tiers=["area", "path", "direct"]
    )
    x, error = found["x"].values[:, 0], found["x"].error[:, 0]
    assert abs(x[0] - x[2]) < error[0] + error[2]
    assert error[0] < 0.05 * x[2]
    # The gait gains over a stiff back, by what it encloses.
    stiff = scene.changed(gait=dataclasses.replace(gait, amplitude=0.0))
    assert x[2] - float(stiff.cycle().net[0]) > 5 * error[0] + 0.01


def test_a_gait_without_the_phase_of_contact_is_refused_where_it_is_needed():
    system = Swimmer(Coulomb(), Chain((1,) * 4), contact=WaveContact())
    with pytest.raises(Refusal, match="2 joints"):
        scenes.Scene(system, Circle())
    assert scenes.Scene(system, Wave(0.4, joints=3)).gait.joints == 4


# Slopes


def test_outcomes_are_what_they_are_defined_to_be():
    climbed = [0.1, -0.1, 0.0, np.nan, 0.2]
    margin = [0.1, np.inf, 0.1, 0.1, -0.1]
    found = outcome.outcome(climbed, margin).tolist()
    assert found == [
        outcome.CLIMBS,
        outcome.SLIPS,
        outcome.SLIPS,
        outcome.SLIDES,
        outcome.ROLLS,
    ]
    assert {*found} == {*outcome.OUTCOMES}


def test_a_sidewinder_with_more_contact_climbs_where_less_slides():
    scene = scenes.load("sidewinder-slope").with_numerics(phases=32)
    climb = compute_motion(scene)
    assert climb.pose[-1, 1] > 0.1
    with pytest.raises(Refusal, match="slides"):
        compute_motion(with_duty(scene, 0.3))
    level = on_slope(scene, angle=math.radians(5))
    least = compute_motion(with_duty(level, 0.3)).pose[-1, 1]
    assert least > compute_motion(level).pose[-1, 1]


def test_a_sweep_goes_on_where_a_body_slides():
    over = {"contact.duty": [0.3, 0.5, 0.7], "effects.slope.angle_deg": [5.0, 22.0]}
    scene = scenes.load("sidewinder-slope").with_numerics(phases=32)
    result = geomech.sweep(scene, over)
    assert result["outcome"].values.tolist() == [
        [outcome.CLIMBS, outcome.SLIDES],
        [outcome.CLIMBS, outcome.CLIMBS],
        [outcome.CLIMBS, outcome.SLIPS],
    ]
    uphill = result["uphill"].values
    assert np.isnan(uphill).sum() == 1
    # The slope rises to the left.
    known = np.isfinite(uphill)
    assert uphill[known] == pytest.approx(result["y"].values[known], abs=1e-12)
    assert (result["uphill"].error[known] > 0).all()


def test_a_tall_body_rolls_over_on_a_slope_that_a_flat_one_climbs():
    scene = scenes.load("sidewinder-slope").with_numerics(phases=32)
    flat = outcome.least_margin(scene.system, scene.gait, 8.0)[0]
    assert flat == np.inf  # the ground holds a body that is buried
    margins = []
    for height in (0.02, 0.3):
        contact = dataclasses.replace(scene.system.contact, height=height)
        tall = scene.changed(contact=contact)
        margins.append(outcome.least_margin(tall.system, tall.gait, 8.0)[0])
    assert margins[1] < margins[0]
    shift = 0.28 * math.tan(math.radians(20))
    assert margins[0] - margins[1] <= shift + 1e-9
    result = geomech.study(tall).trajectory()
    assert result.attributes["outcome"] == outcome.ROLLS
    assert result["support_margin"].values.min() < 0


def test_uphill_is_along_the_rise():
    slope = Slope(angle=0.1, towards=math.pi / 3)
    assert outcome.uphill(slope, 1.0, math.sqrt(3)) == pytest.approx(2.0)
    assert outcome.uphill(slope, math.sqrt(3), -1.0) == pytest.approx(0.0, abs=1e-12)


def test_legs_have_no_bending_moments():
    with pytest.raises(Refusal, match="legs"):
        geomech.forces("salamander")
