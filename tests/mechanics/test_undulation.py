"""Backbones, travelling waves, the sandfish and the snake: progress, cost, slip and
activation."""

import dataclasses

import numpy as np
import pytest
from artists import drawn
from by_hand import drag, laid_out, middles, points
from scipy.optimize import brentq

from figures.paper import fig09c_efficiency, fig10_neuromechanics
from geomech import scenes
from geomech.mathematics.gaits import Fourier, Sine, Wave
from geomech.mathematics.systems import Swimmer
from geomech.scenes import Scene
from geomech.studies.mechanics import undulation
from rft import (
    CATALOGUE,
    Backbone,
    Chain,
    ConstantCurvature,
    Coulomb,
    Serpenoid,
    Viscous,
    body_velocity,
    work_done,
)

pytestmark = pytest.mark.usefixtures("fastest")
GLASS = CATALOGUE["glass-0.3mm-loose"].medium
SANDFISH = scenes.load("sandfish-loose")


def test_the_sine_is_a_sine():
    """Laid out in the plane, the elements lie on A sin(k x) with the amplitude and
    wavelength asked for."""
    gait = Sine(amplitude=0.3, waves=2.0, elements=2000)
    z = np.cumsum(np.exp(1j * gait.headings(0.7))) / 2000
    wavelength = gait.wavelength()
    assert np.ptp(z.imag) / 2 / wavelength == pytest.approx(0.3, rel=1e-4)
    x = 2 * np.pi / wavelength * z.real
    basis = np.stack([np.sin(x), np.cos(x), np.ones_like(x)], -1)
    fitted = basis @ np.linalg.lstsq(basis, z.imag, rcond=None)[0]
    np.testing.assert_allclose(fitted, z.imag, atol=1e-4 * wavelength)


def test_curvature_in_closed_form():
    gait = Sine(waves=1.0, elements=2000)
    turned = np.abs(np.diff(gait.headings(0.0, [0.2])[0])).sum()
    assert gait.relative_curvature(0.2) == pytest.approx(turned, rel=2e-3)


@pytest.mark.parametrize("body", [Serpenoid(waves=1.3), ConstantCurvature(sections=2)])
def test_backbones_are_of_order_two(body):
    """The elements are chords: body velocity against 960 of them."""
    rng = np.random.default_rng(0)
    shapes = rng.uniform(-2, 2, (10, 2)), rng.normal(size=(10, 2))
    counts = [20, 40, 80, 960]
    *coarse, fine = (
        body_velocity(Viscous(2.0), dataclasses.replace(body, elements=n), *shapes).xi
        for n in counts
    )
    errors = np.abs(np.array(coarse) - fine).max((1, 2))
    order = -np.polyfit(np.log(counts[:3]), np.log(errors), 1)[0]
    assert order == pytest.approx(2.0, abs=0.1)


def test_arcs_and_modes_bend_as_they_say():
    """From the middle of the first element to that of the last: half an element's bend
    is missing at either end."""
    arcs = ConstantCurvature(elements=60, sections=3)
    assert arcs.bends.sum(0) == pytest.approx([1 - 1 / 40, 1.0, 1 - 1 / 40])
    modes = Serpenoid(elements=200, waves=2.0)
    angle = 4 * np.pi * np.arange(1, 200) / 200
    expected = np.cos(angle) + 2 * np.sin(angle)
    np.testing.assert_allclose(modes.bends @ [1, 2] * 200, expected, atol=1e-12)


@pytest.mark.parametrize("medium", [GLASS, Coulomb(), Viscous(2.0)])
@pytest.mark.parametrize("seed", range(3))
def test_forces_and_internal_moments_by_an_independent_sum(medium, seed):
    """From `traction` at many points and velocities by differences: the medium's forces
    vanish together; its moment on the tail's side of a joint is that of the joint, and
    that on the head's side the opposite."""
    rng = np.random.default_rng(seed)
    body = Chain((2.0, 1.0, 3.0, 1.0, 2.0))
    shapes = rng.uniform(-0.8, 0.8, 4), rng.normal(size=4)
    xi = body_velocity(medium, body, *shapes, tolerance=1e-13).xi
    place, velocity, along = points(body, *shapes, xi, middles(4000))
    force = -drag(medium, velocity, along, 1e-6) * body.fractions[:, None] / 4000
    assert abs(force.sum()) < 1e-6
    joints = laid_out(body, shapes[0])[0][1:-1]
    moment = work_done(medium, body, *shapes, xi).bending_moment
    for k, joint in enumerate(joints):
        about = ((place - joint).conj() * force).imag.sum(1)
        assert about[: k + 1].sum() == pytest.approx(moment[k], abs=1e-6)
        assert about[k + 1 :].sum() == pytest.approx(-moment[k], abs=1e-6)


def test_sawtooth_is_algebra():
    """Straight pieces at +- theta: one equation for the attack angle psi, (1 + C /
    sqrt(tan^2 g0 + sin^2 psi)) tan psi = cot theta; in a viscous medium the efficiency
    is (r - 1) sin^2 / (cos^2 + r sin^2)."""
    theta, r = 0.6, 3.0
    c, s, tan2 = np.cos(theta), np.sin(theta), np.tan(GLASS.gamma0) ** 2

    def equation(psi):
        across = 1 + GLASS.C / np.sqrt(tan2 + np.sin(psi) ** 2)
        return across * np.tan(psi) - 1 / np.tan(theta)

    psi = brentq(equation, 1e-9, 1.5, xtol=1e-15)
    # v = (eta c, s) makes the angle psi with the piece at theta.
    for medium, expected in (
        (GLASS, s / np.tan(theta + psi) / c),
        (Viscous(r), (r - 1) * s**2 / (c**2 + r * s**2)),
        (Coulomb(), 0.0),
    ):
        found = undulation.endless_efficiency(medium, theta * np.array([1.0, -1.0]))
        assert found == pytest.approx(expected, rel=1e-10, abs=1e-11)


# Best progress over the arc length of a wave of an endless sine, and its A / lambda, by
# what its points do.
ENDLESS = {
    ("glass-0.3mm-loose", "sliding"): (0.2108, 0.5305),
    ("glass-0.3mm-loose", "sideways"): (0.2119, 0.5152),
    ("glass-0.3mm-close", "sliding"): (0.2432, 0.4763),
    ("glass-0.3mm-close", "sideways"): (0.2452, 0.4596),
}
SLOPE = 2 * np.pi * np.cos(2 * np.pi * (np.arange(4000) + 0.5) / 4000)  # of A / lambda


def own_velocity(progress, slope, kinematics):
    """Velocity along and across of points of a wave of speed 1, held to their
    kinematics in the swimmer's frame."""
    root = np.sqrt(1 + slope**2)
    if kinematics == "sideways":
        v_x, v_y = progress, slope
    else:
        v_x, v_y = progress + root.mean() / root - 1, root.mean() * slope / root
    return (v_x + slope * v_y) / root, (v_y - slope * v_x) / root


@pytest.mark.parametrize(("name", "kinematics"), ENDLESS)
def test_endless_waves_slide_or_go_sideways(name, kinematics):
    """The forces of a wave integrated over x vanish. Over the wavelength there is no
    optimum."""
    medium, a = CATALOGUE[name].medium, np.linspace(0.15, 0.35, 41)
    options = {"elements": 500, "kinematics": kinematics}
    found = np.array([undulation.endless_sine(medium, x, **options) for x in a])
    best = undulation.optimum(a, found * Sine().wavelength(a))
    assert best == pytest.approx(ENDLESS[name, kinematics], abs=2e-4)
    assert (np.diff(found) > 0).all()
    slope = a[7] * SLOPE
    f_t, f_n = medium.traction(*own_velocity(found[7], slope, kinematics))
    assert np.mean(f_t - slope * f_n) == pytest.approx(0.0, abs=2e-4)


@pytest.fixture(scope="module")
def numbers():
    return fig09c_efficiency.compute(np.linspace(0.05, 0.5, 13), finer=1)


def test_fig09c_has_the_published_numbers(numbers):
    """0.7 without and 0.5 with yaw and head drag at the animal's wave, 0.22; the
    snake has, "compared with S. scincus, little slip"."""
    loose = numbers["sandfish-loose"]
    a = loose["amplitude"]
    assert np.interp(0.2, a, loose["endless"]) == pytest.approx(0.7, abs=0.01)
    assert np.interp(0.22, a, loose["efficiency"]) == pytest.approx(0.5, abs=0.05)
    assert (numbers["shovel-nosed-snake"]["slip"] < loose["slip"]).all()
    assert loose["best"]["progress"][0] == pytest.approx(0.295, abs=0.006)
    # By the arc length of a wave the optimum of an endless wave is at the animal, by
    # the wavelength there is none.
    arc = fig09c_efficiency.arc_efficiency(loose, "endless")
    assert undulation.optimum(a, arc)[0] == pytest.approx(0.211, abs=0.004)
    assert undulation.optimum(a, loose["endless"]) is None


# With three times the elements: where transport is cheapest, A / lambda and cost; slip
# at A / lambda = 0.22, rad.
CHEAPEST = {
    "sandfish-loose": (0.282, 2.878, 0.2996),
    "sandfish-close": (0.322, 3.134, 0.4031),
    "shovel-nosed-snake": (0.181, 1.290, 0.1050),
}


@pytest.mark.parametrize("name", CHEAPEST)
def test_cost_and_slip(numbers, name):
    best, cost, slip = CHEAPEST[name]
    found = numbers[name]
    place, least = found["best"]["cost_of_transport"]
    assert place == pytest.approx(best, abs=0.006)
    assert least == pytest.approx(cost, rel=0.015)
    at_animal = np.interp(0.22, found["amplitude"], found["slip"])
    assert at_animal == pytest.approx(slip, rel=0.02)


def test_an_optimum_is_that_of_a_parabola_through_logarithms():
    """Exact for a bell and for its inverse; None at either edge of the range."""
    x = np.array([0.0, 0.1, 0.25, 0.45, 0.5])
    bell = 3.0 * np.exp(-7.0 * (x - 0.3) ** 2)
    assert undulation.optimum(x, bell) == pytest.approx((0.3, 3.0))
    assert undulation.optimum(x, 1 / bell, -1) == pytest.approx((0.3, 1 / 3))
    assert undulation.optimum(x, np.exp(x)) is None  # the last


CHAIN = scenes.load("seven-link-wave").with_numerics(phases=32)
MODES = scenes.load("seven-link-modes").with_numerics(phases=32)
PAIR = Scene(Swimmer(GLASS, Chain((1, 2))), Fourier(cos=((0.5,),), sin=((0.0,),)))
PAIR = PAIR.with_numerics(phases=16)


def test_any_gait_has_the_wave_that_its_bends_make():
    """Modes of a chain, told by the motion, as the wave of joint angles that they are;
    one joint has none."""
    known, moved = (undulation.performance(s, [0.4, 0.87]) for s in (CHAIN, MODES))
    for key in ("waves", "wavelength", "relative_curvature", "efficiency"):
        np.testing.assert_allclose(moved[key], known[key], rtol=0.03)
    np.testing.assert_array_equal(
        known["wavelength"], CHAIN.gait.wavelength([0.4, 0.87])
    )
    assert np.isnan(undulation.performance(PAIR, [1.0])["wavelength"]).all()
    bent = CHAIN.changed(gait=dataclasses.replace(CHAIN.gait, offset=0.3))
    of_straight = bent.gait.wavelength([0.87])
    assert undulation.performance(bent, [0.87])["wavelength"] < 0.9 * of_straight


def waving(waves, elements=50, phases=64, effects=(), **gait):
    """The sandfish with that many waves on its body, without head drag unless told."""
    gait = Sine(**{"amplitude": 0.22, "waves": waves, "elements": elements, **gait})
    plain = SANDFISH.changed(body=Backbone(elements), effects=effects, gait=gait)
    return plain.with_numerics(phases=phases)


@pytest.mark.parametrize(
    "scene",
    [waving(1.0), waving(1.5), waving(1.0, effects=SANDFISH.system.effects), SANDFISH],
)
def test_onset_and_offset_are_where_the_moment_changes_sign(scene):
    """Solved anew just before and after, between the phases that the lines were found
    from."""
    found, system = undulation.activation(scene), scene.system
    assert (found["changes"] == 2).all()
    for key, sign in (("onset", 1.0), ("offset", -1.0)):
        for step in (-0.02, 0.02):
            t = found[key] + step
            shapes = scene.gait.shape(t), scene.gait.rate(t)
            work = system.work(*shapes, system.velocity(*shapes))
            moment = np.diagonal(work.bending_moment)
            assert (np.sign(moment) == -sign * np.sign(step)).all()


# 400 elements, 512 phases: waves: speed of activation over curvature by the lines, by
# the first harmonic; lag at s = 0.25.
ACTIVATION = {
    0.5: (2.748, 3.040, 2.062),
    0.75: (2.680, 2.594, 2.293),
    1.0: (2.176, 2.083, 2.365),
    1.25: (2.122, 2.269, 2.525),
    1.5: (1.945, 1.932, 2.700),
    1.8: (1.176, 1.220, 1.682),
}


def test_fig10(tmp_path):
    """The wave of activation outruns that of curvature, the less the more waves the
    body has (0.5 to 1.8), and is ahead of it ever more towards the tail. At the middle
    of a body alike fore and aft, muscles work just while they shorten."""
    module = fig10_neuromechanics
    numbers = module.compute(module.SELECTED, elements=50, phases=64)
    lines, harmonic, lag = np.array(list(ACTIVATION.values())).T
    np.testing.assert_allclose(numbers["speed"], lines, rtol=0.015)
    np.testing.assert_allclose(numbers["fundamental_speed"], harmonic, rtol=0.015)
    assert numbers["head"]["speed"].min() > 1
    found = [np.interp([0.25, 0.5], numbers["s"], row) for row in numbers["lag"]]
    expected = np.stack([lag, np.pi / 2 + 0 * lag], -1)
    np.testing.assert_allclose(found, expected, atol=0.02)
    drawn(module, numbers, tmp_path)


def test_the_wave_of_joint_angles_is_that_of_a_long_chain():
    wave = Wave(amplitude=0.7, waves=1.3, joints=6)
    alpha = 0.7 * np.cos(0.4 + 2 * np.pi * 1.3 * np.arange(70_000) / 7)
    straight = np.abs(np.exp(1j * np.cumsum(alpha)).mean())
    assert wave.wavelength() == pytest.approx(straight / 1.3, rel=1e-8)
    curvature = np.abs(alpha).mean() * 7 / 1.3
    assert wave.relative_curvature() == pytest.approx(curvature, rel=1e-3)
