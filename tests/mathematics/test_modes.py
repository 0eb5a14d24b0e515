"""Chains that move in modes, and waves of joint angles: as the plain chain along the
same angles, circles and backbones."""

import numpy as np
import pytest
from refusals import refuses

import rft
from geomech import scenes
from geomech.mathematics.gaits import Circle, Fourier, Wave
from geomech.mathematics.systems import Swimmer
from geomech.scenes import Scene
from geomech.studies.available import available_tiers
from geomech.studies.scene_tables import SceneTables
from rft import Chain, EndCaps, Granular, Serpenoid, SkinFriction, Viscous

pytestmark = pytest.mark.usefixtures("fastest")
LENGTHS = (0.8, 1.3, 1.0, 0.7)
FRAME = "link-2"
ROWS = ((1.4, 0.3, -0.5), (-0.2, 0.9, 2.1))
MODES = Chain(LENGTHS, 0.3, FRAME, modes=ROWS)
PLAIN = Chain(LENGTHS, 0.3, FRAME)
SAND = Granular(1.8, 0.24)
ROBOT = scenes.load("seven-link-wave")
RNG = np.random.default_rng(5)
SHAPE, RATE = RNG.uniform(-0.7, 0.7, (2, 30, 2))


def test_body_velocity_and_work_are_those_of_the_plain_chain():
    effects = SkinFriction(0.1, 0.15, 0.2), EndCaps(radius_m=0.018)
    options = {"effects": effects, "pieces": 7}
    same = PLAIN, SHAPE @ ROWS, RATE @ ROWS
    found = rft.body_velocity(SAND, MODES, SHAPE, RATE, **options).checked()
    expected = rft.body_velocity(SAND, *same, **options).checked()
    np.testing.assert_allclose(found.xi, expected.xi, atol=1e-13)
    work = rft.work_done(SAND, MODES, SHAPE, RATE, found.xi, **options)
    for a, b in zip(work, rft.work_done(SAND, *same, found.xi, **options), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("tier", ["path", "direct"])
def test_a_single_mode_closes_no_loop_and_goes_nowhere(tier):
    one = Swimmer(SAND, Chain(LENGTHS, modes=[[1, -0.5, 0.3]]))
    assert available_tiers(one) == ("adapted", "path", "direct")
    gait = Fourier(cos=[[0.5, 0.1]], sin=[[0.2, 0.3]])
    study = SceneTables(Scene(one, gait).with_numerics(grid=9, phases=256))
    np.testing.assert_allclose(study.poses(tier), 0, atol=3e-5)


@pytest.mark.parametrize("waves", [0.7, 1.0, 1.5])
def test_a_serpenoid_chain_of_many_links_is_the_serpenoid_backbone(waves):
    """Its amplitude is the angle of a joint: the backbone's, curvature times length,
    over the number of links. It converges to it by order 2."""

    def net(body, size):
        gait = Circle(amplitude=5 * size, centre=(size, -0.5 * size), reverse=True)
        return Swimmer(Viscous(2.5), body).run(*gait.cycle(16)).net

    def of_chain(n):
        return net(Chain((1,) * n, modes="serpenoid", waves=waves), 1 / n)

    same = net(Serpenoid(elements=30, waves=waves), 1)
    np.testing.assert_allclose(of_chain(30), same, atol=1e-13)
    truth = net(Serpenoid(elements=960, waves=waves), 1)
    off = [np.abs(of_chain(n) - truth).max() for n in (30, 60, 120)]
    np.testing.assert_allclose(np.divide(off[:2], off[1:]), 4, atol=0.3)


@pytest.mark.parametrize(
    ("modes", "waves", "said"),
    [
        ([[1, 2, 3]], None, "modes rows 2 | value"),
        ([], None, "modes rows 2 | value"),
        ([[1, 0], [0, 1], [1, 1]], None, "3 modes 2 joints dependent | instead"),
        ([[1, float("nan")]], None, "modes finite | value"),
        (None, 1.0, "waves modes = 'serpenoid' | instead"),
        ([[1, 2]], 1.0, "waves modes = 'serpenoid' | instead"),
        ("serpenoid", 1.5, "mode 2 zero | because instead"),
        ("serpenoid", 2.0, "waves 1e-06 1.5 | value"),
    ],
)
def test_modes_that_make_no_body_are_refused(modes, waves, said):
    with refuses(said):
        Chain(modes=modes, waves=waves)


@pytest.mark.parametrize(
    "body",
    [
        MODES,
        Chain((1,) * 5, modes="serpenoid", waves=1.2),
        Chain((1,) * 5, modes="serpenoid"),
    ],
)
def test_modes_go_through_scene_files(body):
    scene = Scene(Swimmer(SAND, body), Circle())
    assert scenes.parse(scenes.toml(scene)).system == scene.system


# Waves.


@pytest.mark.parametrize("waves", [-1.3, 0.7, 1.0])
def test_a_wave_is_a_circle_in_serpenoid_modes(waves):
    wave = Wave(amplitude=0.7, waves=waves, joints=5)
    circle = Circle(amplitude=0.7, reverse=waves > 0)
    lengths = (1, 1.3, 0.8, 1, 0.7, 1.1)
    body = Chain(lengths, modes="serpenoid", waves=abs(waves))
    for angles, amplitudes in zip(wave.cycle(16), circle.cycle(16), strict=True):
        found = body.joint_angles(amplitudes.T).T
        np.testing.assert_allclose(angles, found, atol=1e-14)


@pytest.mark.parametrize(
    ("settings", "low", "high"),
    [
        ({}, 0.2, 0.4),
        ({"waves": -1.0}, -0.4, -0.2),
        ({"reverse": True}, -0.4, -0.2),
        ({"waves": 0.0}, -1e-6, 1e-6),
    ],
)
def test_the_body_runs_against_its_wave(settings, low, high):
    study = SceneTables(ROBOT.changed(gait=Wave(amplitude=0.87, **settings)))
    assert low < study.poses("direct")[0] < high


def test_an_offset_turns_the_body():
    """To the left where joints bend to the left; to the right it is the mirror image
    half a cycle later."""
    left, right = (
        SceneTables(ROBOT.changed(gait=Wave(amplitude=0.6, offset=offset))).poses(
            "direct"
        )[2]
        for offset in (0.15, -0.15)
    )
    assert left > 0.05
    assert right == pytest.approx(-left, abs=1e-12)


def test_a_wave_is_about_its_centre_and_offset():
    wave = Wave(joints=3, amplitude=0.4, offset=0.2, centre=(0.1, 0.0, -0.1))
    np.testing.assert_allclose(wave.cycle(64)[0].mean(0), [0.3, 0.2, 0.1], atol=1e-15)
    np.testing.assert_allclose(wave.shape(0.3, 0.0), [0.3, 0.2, 0.1], atol=1e-15)


def test_a_wave_of_seven_links_swims_as_in_grains():
    """Wave efficiency 0.34 +- 0.02 (Maladen et al. 2011); a wave of A / lambda = 0.2 is
    0.757 body lengths long."""
    net = np.hypot(*SceneTables(ROBOT).poses("direct", amplitudes=[0.87])[0, :2])
    assert net / 0.757 == pytest.approx(0.34, abs=0.02)
