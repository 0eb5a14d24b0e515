"""A chain with legs: kinematics, closed forms and the coordination of legs and body."""

import dataclasses
import math

import numpy as np
import pytest

from geomech.mathematics.geometry.reconstruct import displacement
from rft import (
    CATALOGUE,
    Chain,
    Coulomb,
    EndCaps,
    LeggedChain,
    SkinFriction,
    Slope,
    Touching,
    Viscous,
    WaveContact,
    body_velocity,
    time_steps,
)
from rft.core.refusal import Refusal

GLASS = CATALOGUE["glass-0.3mm-loose"].medium
MEDIA = {"glass": GLASS, "coulomb": Coulomb(), "viscous": Viscous(3.0)}
SALAMANDER = LeggedChain(reach=0.1, swing=0.6)


def cycle(bend, count=128):
    """Shapes and rates (count, 2) of one joint that bends by ``bend`` cos t."""
    t = 2 * np.pi * np.arange(count) / count
    alpha = np.stack([bend * np.cos(t), t], -1)
    return alpha, np.stack([-bend * np.sin(t), np.ones(count)], -1)


def test_elements_move_as_their_places_change():
    """Velocities are differences of places, in the frame of the body."""
    body = LeggedChain((1.2, 0.8, 1.0), legs=(1, 3), lag=0.4, frame="link-2")
    rng = np.random.default_rng(1)
    alpha, rate = rng.normal(size=(2, 3, 20))
    step = 1e-5
    before = body.motion(alpha - step * rate, rate)
    after = body.motion(alpha + step * rate, rate)
    now = body.motion(alpha, rate)
    moved = (after.centres - before.centres) / (2 * step)
    own = (now.v_t + 1j * now.v_n) * (now.c + 1j * now.s)
    assert np.abs(moved - own).max() < 1e-8
    heading = (after.c + 1j * after.s) / (before.c + 1j * before.s)
    turning = np.angle(heading) / (2 * step)
    assert np.abs(turning - now.v_w / now.half).max() < 1e-8


def test_feet_are_drawn_where_they_are():
    shape = np.array([[0.3, 0.9], [0.1, 4.0]])
    legs = SALAMANDER.leg_points(shape)
    elements = SALAMANDER.motion(shape.T, 0 * shape.T)
    feet = elements.centres[2:].T
    assert np.abs(legs[:, :, 1, 0] + 1j * legs[:, :, 1, 1] - feet).max() < 1e-12
    assert np.allclose(
        np.hypot(*np.moveaxis(legs[:, :, 1] - legs[:, :, 0], -1, 0)), 0.1
    )
    turned = SALAMANDER.leg_points(shape, (1.0, 2.0, math.pi / 2))
    assert np.allclose(turned[..., 0], 1.0 - legs[..., 1])
    assert np.allclose(turned[..., 1], 2.0 + legs[..., 0])


@pytest.mark.parametrize("medium", MEDIA.values(), ids=MEDIA)
def test_one_foot_at_a_time_strides_by_kinematics(medium):
    """The foot that touches alone rests, so that the body turns about it: for two legs
    of a straight body the stride follows from the leg's angle when feet change."""
    body = LeggedChain(legs=(2,), rise=0.002, swing=0.5, reach=0.2)
    count = 512
    t = 2 * np.pi * (np.arange(count) + 0.5) / count
    alpha = np.stack([0 * t, t], -1)
    rate = np.stack([0 * t, 1 + 0 * t], -1)
    net = displacement(body_velocity(medium, body, alpha, rate).xi)

    def foot(side, angle):
        """The pose of a foot in the frame of the body, as a matrix."""
        leg = side * (math.pi / 2 - angle)
        x = 0.25 + 0.2 * math.cos(leg)
        y = 0.2 * math.sin(leg)
        c, s = math.cos(leg), math.sin(leg)
        return np.array([[c, -s, x], [s, c, y], [0.0, 0.0, 1.0]])

    # The hind link has no legs; its left leg touches while psi is from 0 to pi.
    pose = np.eye(3)
    for side in (1.0, -1.0):
        pose = pose @ foot(side, 0.5) @ np.linalg.inv(foot(side, -0.5))
    heading = math.atan2(pose[1, 0], pose[0, 0])
    assert net == pytest.approx([*pose[:2, 2], heading], abs=2e-3)


def test_a_trot_of_small_swing_strides_four_times_the_reach():
    """Diagonal feet move back alike, at 2 reach sin(swing) for each half cycle."""
    for swing in (0.05, 0.1):
        body = LeggedChain(swing=swing, reach=0.2, rise=0.01)
        net = displacement(body_velocity(Viscous(1.0), body, *cycle(0.0)).xi)
        exact = 4 * 0.2 * math.sin(swing)
        assert net[0] == pytest.approx(exact, rel=0.2 * swing**2 + 1e-4)
        assert np.abs(net[1:]).max() < 1e-9


@pytest.mark.parametrize("medium", MEDIA.values(), ids=MEDIA)
def test_the_mirror_image_walks_to_the_other_side(medium):
    right = dataclasses.replace(SALAMANDER, lag=1.0)
    swapped = ((0.5, 0.0), (0.0, 0.5))  # left and right
    left = dataclasses.replace(right, phases=swapped)
    nets = []
    for body, bend in ((right, 0.4), (left, -0.4)):
        nets.append(displacement(body_velocity(medium, body, *cycle(bend)).xi))
    assert np.abs(nets[0] - nets[1] * [1, -1, -1]).max() < 1e-7
    assert abs(nets[0][1]) > 1e-3


def test_the_best_coordination_goes_about_twice_as_far_as_the_worst():
    """The trend of a salamander robot on poppy seeds (APS March Meeting 2018,
    B50.12), for assumed sizes; best where the body bends to bring the feet forward."""
    lags = np.linspace(0, 2 * np.pi, 13)[:-1]
    strides = []
    for lag in lags:
        body = dataclasses.replace(SALAMANDER, lag=lag)
        strides.append(displacement(body_velocity(GLASS, body, *cycle(0.5)).xi)[0])
    assert 1.7 < max(strides) / min(strides) < 2.7
    assert int(np.argmax(strides)) in (0, 1, 11)
    assert int(np.argmin(strides)) in (5, 6, 7)


def test_feet_bear_the_body_alike():
    shapes = np.array([[0.0, 0.25 * 2 * np.pi], [0.0, 0.75 * 2 * np.pi]])
    state = SALAMANDER.contact_state(shapes)
    assert state.weight == pytest.approx(np.array([[1, 0, 0, 1], [0, 1, 1, 0]]))
    assert state.load == pytest.approx(2 * state.weight)
    # A trot stands on a diagonal through its centre of mass, as wide as its feet.
    assert ((state.margin > 0) & (state.margin < SALAMANDER.foot / 2)).all()


REFUSED = {
    "a link that is none": ({"legs": (1, 3)}, "legs", "2"),
    "half a link": ({"legs": (1.5,)}, "legs"),
    "no pair": ({"phases": ((0.0, 0.5),)}, "phases"),
    "no foot on the ground": (
        {"phases": ((0.0, 0.0), (0.0, 0.0))},
        "touches",
        "phase",
    ),
    "rise without room": ({"duty": 0.95}, "rise"),
    "reach": ({"reach": -0.1}, "reach"),
}


@pytest.mark.parametrize(
    ("changes", "named"), [(x[0], x[1:]) for x in REFUSED.values()]
)
def test_legs_that_make_no_sense_are_refused(changes, named):
    with pytest.raises(Refusal) as refusal:
        LeggedChain(**changes)
    assert all(word in str(refusal.value) for word in named)


@pytest.mark.parametrize("effect", [EndCaps(radius=0.05), Slope(angle=0.1)])
def test_effects_that_do_not_know_legs_are_refused(effect):
    with pytest.raises(Refusal, match=effect.kind):
        time_steps(GLASS, SALAMANDER, *cycle(0.5, 16), effects=[effect])
    skin = [SkinFriction(0.2, 0.2, 0.2)]
    body_velocity(GLASS, SALAMANDER, [0.1, 0.2], [1.0, 1.0], effects=skin)


def test_a_body_has_one_rule_of_contact():
    with pytest.raises(Refusal, match="contact"):
        Touching(SALAMANDER, WaveContact())
    assert Touching(Chain(), WaveContact()).joints == 3
