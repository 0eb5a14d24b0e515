"""Joints that give way: closed forms of linear drag and of a dry slider, energy, limits
of stiffness, and an integration that shares no code."""

import itertools
import json
import math
from pathlib import Path

import numpy as np
import pytest

from rft import (
    CATALOGUE,
    Backbone,
    BodyInertia,
    Chain,
    Serpenoid,
    Springs,
    Transient,
    Viscous,
    body_velocity,
    time_steps,
)
from rft.core.refusal import Refusal

pytestmark = pytest.mark.usefixtures("fastest")
compiled = pytest.mark.usefixtures("compiled_code")  # many steps
GLASS = CATALOGUE["glass-0.3mm-loose"].medium
ONE_RADIAN = 1 / (2 * np.pi)  # Hz at which a second is a radian of phase
M22, M21 = 0.0073160, 0.0050297  # of three equal links, ratio 2 (test_metric.py)
CCF = 0.0206  # |CCF_x| of these at the straight shape


def cosines(amplitudes, phases, count):
    """Shapes and rates (count, d) of joints with amplitudes and phases (d,)."""
    t = 2 * np.pi * np.arange(count)[:, None] / count
    return amplitudes * np.cos(t + phases), -amplitudes * np.sin(t + phases)


def circle(amplitude, count):
    return cosines(np.full(2, amplitude), np.array([0.0, np.pi / 2]), count)


@pytest.mark.parametrize(
    ("factor", "published"), [(0.3, 1.22e-4), (1.0, 2.218e-4), (3.0, 1.33e-4)]
)
def test_a_passive_tail_is_a_low_pass_and_swims_by_its_lag(factor, published):
    """alpha_2 / alpha_1 = -i M21 / (k + i M22) at unit frequency, and the displacement
    CCF(0) pi A^2 M21 k / (k^2 + M22^2)."""
    A, count = 0.1, 256
    k = factor * M22
    springs = Springs(stiffness=(math.inf, k), passive=2, frequency=ONE_RADIAN)
    command = cosines(np.array([A, 0.7]), 0.0, count)  # a passive joint has none
    steps = time_steps(Viscous(), Chain(), *command, effects=[springs]).checked()
    head, tail = np.fft.fft(steps.springs.alpha, axis=0)[1]
    assert abs(tail / head + 1j * M21 / (k + 1j * M22)) < 2e-3
    area = np.pi * A**2 * M21 * k / (k**2 + M22**2)
    assert -steps.displacement[0] == pytest.approx(published, rel=4e-3)
    assert 0.0204 < -steps.displacement[0] / area < CCF


def test_stiff_springs_are_a_prescribed_gait_at_order_1():
    command = circle(1.0, 64)
    prescribed = body_velocity(Viscous(), Chain(), *command).xi
    errors = []
    for stiffness in (1.0, 2.0, 4.0, math.inf):
        springs = Springs(stiffness=stiffness, frequency=ONE_RADIAN)
        found = time_steps(Viscous(), Chain(), *command, effects=[springs])
        errors.append(np.abs(found.xi - prescribed).max())
    assert errors[0] / errors[1] == pytest.approx(2.0, abs=0.05)
    assert errors[1] / errors[2] == pytest.approx(2.0, abs=0.05)
    assert errors[3] < 1e-12


@compiled
def test_a_free_hinge_goes_nowhere_with_one_actuator():
    """A free joint follows at once, so that the motion is the same backwards."""
    springs = Springs(stiffness=(math.inf, 0.0), frequency=ONE_RADIAN)
    steps = time_steps(Viscous(), Chain(), *circle(0.5, 256), effects=[springs])
    assert np.ptp(steps.springs.alpha[:, 1]) > 0.1
    assert np.abs(steps.displacement).max() < 2e-6


def works(medium, body, springs, command, **options):
    """Work of the actuators, on the medium and in dampers in a cycle."""
    steps = time_steps(
        medium, body, *command, effects=[springs], with_work=True, **options
    )
    motion = steps.checked().springs
    mean = 2 * np.pi / len(command[0])
    is_rigid = np.isnan(motion.actuator[0])
    own = np.nansum(motion.actuator_power) * mean
    moments = steps.work.bending_moment[:, is_rigid]
    own += (moments * command[1][:, is_rigid]).sum() * mean
    damping = np.broadcast_to(springs.damping, motion.torque.shape[1])
    return (
        own,
        steps.work.power.sum() * mean,
        (damping * motion.alphadot**2).sum() * mean,
    )


@compiled
def test_actuators_do_the_work_on_the_medium_and_in_dampers():
    """What springs store comes back on a limit cycle; the difference is of order 3 in
    the time step, and extrapolated 1e-8 of the work."""
    springs = Springs(stiffness=(0.05, 0.01), damping=0.002, frequency=ONE_RADIAN)
    missing = []
    for count in (128, 256, 512):
        own, medium, dampers = works(Viscous(), Chain(), springs, circle(1.0, count))
        missing.append((own - medium - dampers) / own)
    assert missing[0] / missing[1] == pytest.approx(8.0, abs=0.2)
    assert missing[1] / missing[2] == pytest.approx(8.0, abs=0.2)
    once = [(8 * b - a) / 7 for a, b in itertools.pairwise(missing)]
    assert abs((16 * once[1] - once[0]) / 15) < 1e-8


@compiled
def test_a_passive_spring_takes_no_work_and_a_prescribed_joint_gives_its_own():
    springs = Springs(stiffness=(math.inf, 0.01), passive=2, frequency=ONE_RADIAN)
    command = cosines(np.array([1.0, 0.0]), 0.0, 256)
    steps = time_steps(Viscous(), Chain(), *command, effects=[springs], with_work=True)
    assert (steps.springs.actuator_power[:, 1] == 0).all()
    own, medium, _ = works(Viscous(), Chain(), springs, command)
    assert own == pytest.approx(medium, rel=1e-5)


def test_a_spring_in_series_with_a_dry_slider_makes_its_hysteresis_loop():
    """A short link turns in sand about the end of a long one, which stays: its torque
    is the yield c b^2 / 2, c the drag across, or less. So the joint moves by the
    command's amplitude less yield / k, and a cycle takes 4 yield times that."""
    b, amplitude, lag = 0.02, 0.5, 0.2
    across = 1 + GLASS.C / math.sqrt(math.tan(GLASS.gamma0) ** 2 + 1)
    torque = across * b**2 / 2
    command = cosines(np.array([amplitude]), 0.0, 512)
    body = Chain((1 - b, b), frame="link-1")
    springs = Springs(stiffness=torque / lag)
    steps = time_steps(GLASS, body, *command, effects=[springs]).checked()
    motion = steps.springs
    reach = amplitude - lag
    alpha = motion.alpha[:, 0]
    assert alpha.max() == pytest.approx(reach, abs=1e-3)
    assert alpha.min() == pytest.approx(-reach, abs=1e-3)
    assert np.abs(motion.torque).max() == pytest.approx(torque, rel=1e-5)
    # After the command's turn the joint rests until the torque has changed its sign.
    t = 2 * np.pi * np.arange(512) / 512
    rests = (np.cos(t) > (amplitude - 2 * lag) / amplitude) & (t > 0) & (t < np.pi)
    assert np.abs(motion.alphadot[rests][3:-3]).max() < 2e-3 * amplitude
    work = motion.actuator_power.sum() * 2 * np.pi / 512
    assert work == pytest.approx(4 * torque * reach, rel=2e-3)


@compiled
def test_slack_takes_its_width_from_a_slow_spring_in_a_thick_fluid():
    """A stiff spring with slack: the joint lags by the slack, its amplitude is that of
    the command less the slack, and the torque is as without one."""
    command = cosines(np.array([0.6, 0.0]), 0.0, 256)
    springs = Springs(
        stiffness=(5.0, math.inf), dead_band=(0.2, 0), frequency=ONE_RADIAN
    )
    motion = time_steps(Viscous(), Chain(), *command, effects=[springs]).springs
    alpha = motion.alpha[:, 0]
    assert alpha.max() == pytest.approx(0.4, abs=2e-3)
    # Between the ends of the slack nothing drives the joint, and it stays.
    is_slack = motion.torque[:, 0] == 0
    assert 0.2 < is_slack.mean() < 0.5
    assert np.ptp(alpha[is_slack & (alpha > 0)]) < 1e-3


@compiled
def test_a_fin_that_folds_freely_settles_where_it_meets_no_stop():
    """Its stop pushes it away cycle after cycle, and what is left is a free hinge, with
    which one joint goes nowhere; its mirror image settles on the other side."""
    command = cosines(np.array([0.8, 0.0]), 0.0, 256)
    ends = []
    for band in ((0.0, math.inf), (-math.inf, 0.0)):
        fin = Springs(
            stiffness=1.0,
            passive=2,
            prescribed=1,
            dead_band=(0, band),
            frequency=ONE_RADIAN,
        )
        steps = time_steps(Viscous(), Chain(), *command, effects=[fin]).checked()
        assert np.abs(steps.displacement).max() < 1e-5
        ends.append(steps.springs.alpha[:, 1])
    left, right = ends
    assert left.max() > 0.1
    assert left.min() > -1e-3
    assert right.max() < 1e-3


DATA = Path(__file__).parents[1] / "data"
CHECKED = json.loads((DATA / "springs.json").read_text())


@compiled
@pytest.mark.parametrize("case", CHECKED, ids=str)
def test_chains_in_loose_glass_move_as_an_integration_by_hand(case):
    """Against SciPy's Radau (springs_by_hand.py), the same rounding and damping: the
    fourth cycle from the command's shape, within 1e-4 body lengths or what halving the
    steps changes."""
    body = Chain(case["lengths"], frame="link-1")
    springs = Springs(
        stiffness=case["stiffness"],
        dead_band=case["dead_band"],
        damping=0.03,
        frequency=ONE_RADIAN,
    )
    nets = []
    for count in (128, 256):
        command = cosines(np.array(case["amplitude"]), np.array(case["phase"]), count)
        # Both start at phase 0 with the command's shape.
        steps = time_steps(
            GLASS, body, *command, effects=[springs], cycles=4, regularisation=1e-3
        )
        assert steps.residual < 1e-9
        nets.append(of_tail(steps.displacement, body, steps.springs.alpha[0]))
    error = max(1e-4, 2 * np.abs(nets[1] - nets[0]).max())
    np.testing.assert_allclose(nets[1], case["net"], atol=error)


@compiled
def test_a_worm_of_25_rods_bends_as_that_of_another_program():
    """ElegansBot moves rods by springs and dampers whose angles of rest are a wave; its
    joints also push their rods apart, which the springs here do not."""
    theirs = json.loads((DATA / "elegansbot.json").read_text())
    place = 2 * np.pi * 1.832 * np.linspace(0, 1, 24)
    command = cosines(np.full(24, 0.7), -place, 100)
    muscles = Springs(
        stiffness=175000 / 3.2e6, damping=31250 / 3.2e6, frequency=1 / 1.6
    )
    steps = time_steps(Viscous(40.0), Chain((1,) * 25), *command, effects=[muscles])
    difference = steps.springs.alpha[::5] - theirs["alpha"]
    assert np.sqrt((difference**2).mean()) < 0.01
    distance = np.hypot(*steps.checked().displacement[:2])
    assert distance == pytest.approx(theirs["displacement"], rel=0.01)


def of_tail(net, body, alpha):
    """The displacement (x, y, heading) of the tail's end in its own frame, from that of
    link 1's centre."""
    half = body.lengths[0] / sum(body.lengths) / 2
    end = net[0] + 1j * net[1] - half * np.exp(1j * net[2]) + half
    return np.array([end.real, end.imag, net[2]])


CASES = {
    "viscous": (Viscous(), Chain(), {"stiffness": 0.02, "frequency": ONE_RADIAN}),
    "glass": (GLASS, Chain((1, 2, 1)), {"stiffness": (0.3, math.inf)}),
    "modes": (GLASS, Chain((1,) * 6, modes="serpenoid"), {"stiffness": 0.1}),
    "serpenoid": (Viscous(), Serpenoid(12), {"bending": 0.01, "frequency": ONE_RADIAN}),
}


@pytest.mark.parametrize("name", CASES)
def test_samples_of_a_batch_are_as_each_alone(name):
    medium, body, options = CASES[name]
    amplitudes = (0.3, 0.9)
    alone = [
        time_steps(medium, body, *circle(a, 32), effects=[Springs(**options)], cycles=2)
        for a in amplitudes
    ]
    both = [np.stack(x) for x in zip(*(circle(a, 32) for a in amplitudes))]
    found = time_steps(medium, body, *both, effects=[Springs(**options)], cycles=2)
    for k, one in enumerate(alone):
        np.testing.assert_allclose(found.xi[k], one.xi, atol=1e-8)
        np.testing.assert_allclose(found.springs.alpha[k], one.springs.alpha, atol=1e-8)


@pytest.mark.parametrize("name", CASES)
def test_rates_are_those_of_the_shape_and_velocities_those_of_both(name):
    """The connection of the true shape holds: with its shape and rate prescribed, the
    body moves as it does with springs."""
    medium, body, options = CASES[name]
    steps = time_steps(
        medium, body, *circle(0.9, 64), effects=[Springs(**options)], cycles=2
    )
    motion = steps.springs
    alone = body_velocity(medium, body, motion.alpha, motion.alphadot)
    scale = np.abs(motion.alphadot).max()
    is_clear = alone.status == "sliding"
    assert is_clear.mean() > 0.5
    np.testing.assert_allclose(
        steps.xi[is_clear], alone.xi[is_clear], atol=2e-4 * scale
    )


@compiled
def test_a_rod_bends_the_same_by_many_elements():
    """Bending stiffness is of the body, whatever its number of elements."""
    waves = []
    for elements in (20, 40):
        body = Serpenoid(elements)
        rod = Springs(bending=3e-4, frequency=ONE_RADIAN)
        steps = time_steps(Viscous(), body, *circle(4.0, 48), effects=[rod])
        waves.append(np.abs(steps.springs.alpha).max())
    assert waves[1] < 3.0  # the rod gives way
    assert waves[0] == pytest.approx(waves[1], rel=0.01)


def test_memory_of_the_ground_and_mass_go_with_springs():
    """As they go to zero, what is left are springs alone."""
    command = circle(0.8, 32)
    springs = Springs(stiffness=0.3)
    plain = time_steps(GLASS, Chain(), *command, effects=[springs], cycles=2)
    for small in (
        Transient(travel=1e-7),
        BodyInertia(mass=1e-6, frequency=0.5, length=1.0, drag=1.0),
    ):
        found = time_steps(GLASS, Chain(), *command, effects=[springs, small], cycles=2)
        np.testing.assert_allclose(found.xi, plain.xi, atol=2e-4)


@compiled
def test_a_heavy_link_on_a_spring_swings_at_its_frequency():
    """Almost without drag, a light link on the end of a heavy one swings at
    sqrt(k / I) about its hinge, I = m b^2 / 3."""
    b, count = 0.1, 512
    inertia = b * b**2 / 3  # of the short link, mass of the body 1
    k = 9.0 * inertia  # three swings per cycle
    heavy = BodyInertia(mass=1e4, frequency=ONE_RADIAN, length=1.0, drag=1.0)
    body = Chain((0.9, b, 1e-3), frame="link-1")
    command = np.zeros((count, 2)), np.zeros((count, 2))
    steps = time_steps(
        Viscous(),
        body,
        *command,
        effects=[
            Springs(stiffness=(k * 1e4, math.inf), passive=1, frequency=ONE_RADIAN),
            heavy,
        ],
        cycles=1,
        start=[0.01, 0.0],
    )
    spectrum = np.abs(np.fft.rfft(steps.springs.alpha[:, 0]))
    assert spectrum.argmax() == 3


@pytest.mark.parametrize(
    ("options", "body", "medium", "named"),
    [
        ({}, Chain(), GLASS, "stiffness or bending"),
        ({"stiffness": -1.0}, Chain(), GLASS, "stiffness"),
        ({"stiffness": math.nan}, Chain(), GLASS, "stiffness"),
        ({"stiffness": (1, 2, 3)}, Chain(), GLASS, "2 joints"),
        ({"stiffness": 1, "damping": 1}, Chain(), GLASS, "damping"),
        ({"stiffness": 1}, Chain(), Viscous(), "frequency"),
        ({"bending": 1}, Chain(), Viscous(), "frequency"),
        ({"stiffness": 1}, Backbone(20), GLASS, "bending"),
        ({"stiffness": 0}, Chain(), GLASS, "driven"),
        ({"bending": 1, "passive": 1}, Serpenoid(12), GLASS, "passive"),
        ({"stiffness": 1, "passive": (1, 2)}, Chain(), GLASS, "driven"),
        ({"stiffness": 1, "passive": 3}, Chain(), GLASS, "joint 3"),
        ({"stiffness": (math.inf, 1), "passive": 1}, Chain(), GLASS, "passive"),
        ({"stiffness": 1, "dead_band": ((1, 0), 0)}, Chain(), GLASS, "dead_band"),
        ({"stiffness": 1, "dead_band": (0, 0, 0)}, Chain(), GLASS, "dead_band"),
        ({"bending": 1, "unit": 1}, Chain(), GLASS, "unit"),
    ],
)
def test_springs_that_make_no_sense_are_refused(options, body, medium, named):
    with pytest.raises(Refusal, match=named):
        time_steps(
            medium, body, *np.zeros((2, 8, body.joints)), effects=[Springs(**options)]
        )


def test_commands_that_no_step_resolves_are_refused():
    """By the angles of joints: modes of a body with many have large amplitudes."""
    worm = Serpenoid(40)
    springs = Springs(bending=0.02, frequency=0.5)
    command = circle(6.0, 16)
    time_steps(Viscous(40.0), worm, *command, effects=[springs], cycles=1)
    stiff = Springs(1.0, frequency=0.5)
    with pytest.raises(Refusal, match="phases"):
        time_steps(Viscous(), Chain(), *circle(20.0, 16), effects=[stiff])
