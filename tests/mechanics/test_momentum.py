"""Systems without drag: chains whose momentum is zero, and the differential drive, against sums of their own."""

import re

import numpy as np
import pytest
from registry import SYSTEMS

from geomech.mathematics.gaits import Circle, Ellipse
from geomech.mathematics.geometry import coordinates, metric
from geomech.mathematics.systems import (
    DifferentialDrive,
    FloatingChain,
    IdealFluidSwimmer,
)
from geomech.mathematics.systems.capabilities import OwnMetric, capability
from geomech.mathematics.systems.framed import in_frame
from geomech.mathematics.tiers.base import Numerics
from geomech.scenes import Scene
from geomech.studies.mechanics import motion as moving
from geomech.studies.scene_tables import SceneTables
from rft.bodies.base import body_size
from rft.core.refusal import Refusal

OVAL = Ellipse(semi_axes=(0.9, 0.5), centre=(0.7, -0.2), tilt=0.3)
AFLOAT = FloatingChain((0.8, 1.3, 1.0), 0.4, "mean", (1.0, 0.5, 2.0), (0.1, 0.2, 0.05))
SWIMMER = IdealFluidSwimmer(
    (0.8, 1.3, 1.0), 0.4, "link-1", 0.2, (1.0, 0.5, 2.0), (0.1, 0.07, 0.05)
)


def test_afloat_three_equal_rods_turn_as_by_hand():
    """About the centre of mass angular momentum is sum I w + sum over pairs of m r_ij x v_ij / 3, with r_12 = l (e_1 + e_2) / 2
    and so on; in units of m l^2 / 12, w being the links' turning rates and c their angles' cosines, that is
    w_1 (3 + 3 c_1 + c_12) + w_2 (7 + 3 c_1 + 3 c_2) + w_3 (3 + 3 c_2 + c_12)."""
    rng = np.random.default_rng(0)
    alpha, alphadot = rng.uniform(-3, 3, (2, 50, 2))
    (c1, c2), c12 = np.cos(alpha).T, np.cos(alpha.sum(-1))
    ahead, behind = 3 + 3 * c1 + c12, 3 + 3 * c2 + c12
    wanted = (ahead * alphadot[:, 0] - behind * alphadot[:, 1]) / (
        ahead + behind + 7 + 3 * c1 + 3 * c2
    )
    xi = FloatingChain(frame="link-2").velocity(alpha, alphadot)
    np.testing.assert_allclose(xi[:, 2], wanted, atol=1e-14)
    np.testing.assert_allclose(
        FloatingChain(frame="link-2").velocity([0, 0], [1, 0]),
        [0, -1 / 18, 7 / 27],
        atol=1e-15,
    )


@pytest.mark.parametrize("aspect", [0.05, 0.4, 1.0])
def test_straight_ellipses_start_as_by_hand(aspect):
    """Middle link: across 3 mu v + mu l / 2 (a_1 + a_2) = 0, about 2 mu l^2 w + 3 i w = (mu l^2 / 2 + i) (a_1 - a_2)."""
    length, rates = 0.7, np.array([1.3, -0.4])
    link = length / 3
    a, b = link / 2, aspect * link / 2
    mu = np.pi * a * b + np.pi * a**2
    turning = np.pi * a * b * (a**2 + b**2) / 4 + np.pi * (a**2 - b**2) ** 2 / 8
    across = -link / 6 * rates.sum()
    about = (
        (mu * link**2 / 2 + turning)
        / (2 * mu * link**2 + 3 * turning)
        * (rates[0] - rates[1])
    )
    found = IdealFluidSwimmer(length=length, frame="link-2", aspect=aspect).velocity(
        [0, 0], rates
    )
    np.testing.assert_allclose(found, [0, across, about], atol=1e-15)


@pytest.mark.parametrize("aspect", [0.1, 0.6])
def test_added_masses_are_those_of_the_flow_around_an_ellipse(aspect):
    """On the ellipse the stream function is that of the body's motion; outside of it the potential phi + i psi is a series
    sum a_k exp(-i k t) on the boundary, by conformal mapping, and the fluid's energy is pi / 2 sum k |a_k|^2."""
    t = 2 * np.pi * np.arange(64) / 64
    a, b = 1 / 2, aspect / 2
    x, y = a * np.cos(t), b * np.sin(t)
    k = np.arange(1, 20)
    added = [
        np.pi * (k * np.abs(2 * np.fft.rfft(psi)[1:20] / 64) ** 2).sum()
        for psi in (y, -x, (x**2 + y**2) / 2)
    ]
    swimmer = IdealFluidSwimmer(
        (1, 1), aspect=aspect, masses=(1e-9, 1e-9)
    )  # of links of 1 / 2, in units of pi
    found = np.pi * np.array(swimmer.inertia()[1][0]) * [4, 4, 16]
    np.testing.assert_allclose(found, added, rtol=1e-7)


def impulses(motion, masses, inertia):
    """Linear and angular impulse of chain and fluid in the world (phases, 3), its scale, and twice the kinetic energy, from
    the links' ends by differences of order 8. inertia: (along, across, about) of each link, in the world's units."""
    ends, step, weights = (
        motion.points(),
        motion.phase[1],
        (4 / 5, -1 / 5, 4 / 105, -1 / 280),
    )
    rate = (
        sum(
            w * (np.roll(ends, -k, 0) - np.roll(ends, k, 0))
            for k, w in enumerate(weights, 1)
        )
        / step
    )
    ends, rate = (x[4:-4, :, 0] + 1j * x[4:-4, :, 1] for x in (ends, rate))
    centre, velocity, along = (
        (ends[:, 1:] + ends[:, :-1]) / 2,
        (rate[:, 1:] + rate[:, :-1]) / 2,
        np.diff(ends),
    )
    turning = (np.diff(rate) / along).imag
    along /= abs(along)
    m_t, m_n, about = np.array(inertia).T
    v = velocity * along.conj()
    p = (m_t * v.real + 1j * m_n * v.imag) * along
    angular = (centre.conj() * p).imag + about * turning
    energy = (m_t * v.real**2 + m_n * v.imag**2 + about * turning**2).sum(1)
    size = [abs(p).max(), abs(p).max(), abs(angular).max()]
    return np.stack([p.real.sum(1), p.imag.sum(1), angular.sum(1)], -1), size, energy


def own(system):
    """Masses, and inertia of each link in the world's units, written out anew from the fields."""
    x = body_size(system) * np.array(system.lengths) / sum(system.lengths)
    if isinstance(system, FloatingChain):
        m = np.array(system.masses) / sum(system.masses)
        return (
            m,
            np.stack([m, m, np.array(system.inertias) * m * x**2], -1),
            body_size(system) ** 2,
        )
    a, b = x / 2, system.aspect * x / 2
    m = np.array(system.masses) * a * b
    about = np.array(system.inertias) * m * x**2 + (a**2 - b**2) ** 2 / 8
    return m, np.stack([m + b**2, m + a**2, about], -1), body_size(system) ** 4


@pytest.mark.parametrize("frame", ["mean", "link-1", "link-3"])
@pytest.mark.parametrize("system", [AFLOAT, SWIMMER], ids=lambda s: s.kind)
def test_momentum_is_conserved_in_the_world(system, frame):
    """Over two cycles, whatever the frame; and `cost` is twice the kinetic energy that is seen."""
    system = in_frame(system, frame)
    masses, inertia, unit = own(system)
    found = moving.compute_motion(Scene(system, OVAL, Numerics(phases=256)), 2)
    impulse, size, energy = impulses(found, masses, inertia)
    assert min(size) > 1e-6
    assert (np.abs(impulse) < 1e-9 * np.array(size)).all()
    alpha, alphadot = OVAL.cycle(256)
    cost = np.tile(system.squared_speed(alpha, alphadot), 2)[4 : 4 + len(energy)]
    np.testing.assert_allclose(cost * unit, energy, rtol=1e-8)


def test_afloat_nothing_goes_anywhere_and_the_area_tells_how_far_it_turns():
    study = SceneTables(Scene(AFLOAT, OVAL, Numerics(grid=61)))
    direct = study.poses("direct")
    assert np.abs(direct[:2]).max() < 1e-15 and abs(direct[2]) > 5e-3
    np.testing.assert_allclose(study.poses("area"), direct, atol=1e-6)


def test_heavy_links_are_afloat():
    """Where fluid weighs nothing: of order 1 in its density."""
    alpha, alphadot = np.random.default_rng(3).normal(size=(2, 30, 2))
    lengths, over = np.array([0.8, 1.3, 1.0]), np.array([1.0, 0.5, 2.0])
    about = (0.1, 0.07, 0.05)
    wanted = FloatingChain(
        tuple(lengths), 0.4, "mean", tuple(over * lengths**2), about
    ).velocity(alpha, alphadot)
    off = [
        np.abs(
            IdealFluidSwimmer(
                lengths, 0.4, "mean", 0.2, tuple(k * over), about
            ).velocity(alpha, alphadot)
            - wanted
        )
        for k in (1e3, 1e4)
    ]
    assert 9 < off[0].max() / off[1].max() < 11
    assert off[1].max() < 1e-2


@pytest.mark.parametrize(
    "system",
    [AFLOAT, SWIMMER, FloatingChain((1, 2)), IdealFluidSwimmer((1, 2, 1, 1, 2))],
    ids=repr,
)
def test_cost_is_a_metric(system):
    """Quadratic in alphadot and positive; the same in every frame; and `metric.fit` takes it."""
    alpha, alphadot = np.random.default_rng(4).normal(size=(2, 20, system.joints))
    cost = system.squared_speed(alpha, alphadot)
    assert (cost > 0).all()
    np.testing.assert_allclose(
        system.squared_speed(alpha, -3 * alphadot), 9 * cost, rtol=1e-12
    )
    np.testing.assert_allclose(
        in_frame(system, "link-2").squared_speed(alpha, alphadot), cost, rtol=1e-12
    )
    if system.joints == 2:
        fitted = metric.fit(system.squared_speed, (np.linspace(-3, 3, 41),) * 2)
        inside = np.abs(alpha).max(-1) < 2.5
        np.testing.assert_allclose(
            fitted.norm(alpha[inside], alphadot[inside]) ** 2, cost[inside], rtol=2e-3
        )


def test_the_cart_drives_as_by_hand():
    np.testing.assert_allclose(
        DifferentialDrive().velocity([0, 0], [1.0, 0.0]), [0.25, 0, -0.5], atol=1e-15
    )
    cart = DifferentialDrive(0.03, 0.15)
    xi = cart.velocity([5.0, -40.0], [[1, 1], [-1, 1], [1, 0]])
    np.testing.assert_allclose(
        xi, [[0.03, 0, 0], [0, 0, 0.4], [0.015, 0, -0.2]], atol=1e-15
    )
    study = SceneTables(
        Scene(
            cart,
            Circle(amplitude=0.8, centre=(0.3, 1.0)),
            Numerics(grid=9, extent=20.0),
        )
    )
    np.testing.assert_allclose(study.curvature.values[1], -(0.03**2) / 0.15, rtol=1e-10)
    assert np.abs(study.curvature.values[[0, 2]]).max() < 1e-15
    t = np.linspace(0, 2 * np.pi, 4096, endpoint=False)
    heading = 0.2 * 0.8 * (np.sin(t) - np.cos(t))
    flow = 0.015 * 0.8 * (np.cos(t) - np.sin(t)) * np.exp(1j * (heading + 0.2 * 0.8))
    net = 2 * np.pi * flow.mean()
    np.testing.assert_allclose(
        study.poses("direct"), [net.real, net.imag, 0], atol=1e-14
    )
    area = -(0.03**2) / 0.15 * np.pi * 0.8**2
    np.testing.assert_allclose(study.poses("area"), [0, area, 0], atol=1e-12)
    assert net.imag == pytest.approx(area, rel=0.05)


WRONG = {
    "masses of another number of links": lambda: FloatingChain(masses=(1.0, 2.0)),
    "no mass": lambda: IdealFluidSwimmer(masses=(1.0, 0.0, 1.0)),
    "an inertia below 0": lambda: FloatingChain(inertias=(0.1, -0.1, 0.1)),
    "wide links": lambda: IdealFluidSwimmer(aspect=1.5),
    "one link": lambda: FloatingChain(lengths=(1.0,)),
    "no such frame": lambda: IdealFluidSwimmer(frame="link-4"),
    "wheels without size": lambda: DifferentialDrive(wheel_radius=0.0),
    "a frame of links": lambda: DifferentialDrive(frame="link-1"),
}


@pytest.mark.parametrize("what", WRONG)
def test_what_is_wrong_is_refused_in_a_line(what):
    with pytest.raises((ValueError, Refusal)) as caught:
        WRONG[what]()
    assert "\n" not in str(caught.value)


def test_systems_without_a_metric_have_no_cost():
    with_metric = {
        name for name, system in SYSTEMS.items() if capability(system, OwnMetric)
    }
    assert with_metric == {"ideal-fluid-swimmer", "floating-chain"}


@pytest.mark.parametrize("system", [AFLOAT, SWIMMER], ids=lambda s: s.kind)
def test_frames_tell_of_one_motion(system):
    alpha, alphadot = np.random.default_rng(5).normal(size=(2, 20, 2))
    seen = system.velocity(alpha, alphadot)
    for frame in ("mean", "link-2", "link-3"):
        h, hdot = system.frame_pose(frame, alpha, alphadot)
        other = in_frame(system, frame).velocity(alpha, alphadot)
        np.testing.assert_allclose(
            coordinates.change_velocity(seen, h, hdot), other, atol=1e-14
        )


def test_masses_are_values_within_bounds():
    some = FloatingChain(
        np.array([1, 1, 1]), masses=np.array([1, 2, 3]), inertias=[0.1, 1e-6, 1e6]
    )
    assert some == FloatingChain(masses=(1.0, 2.0, 3.0), inertias=(0.1, 1e-6, 1e6))
    assert (
        len(
            {
                some,
                IdealFluidSwimmer(
                    masses=[1e-9, 1e9, 1], inertias=[1e-6, 1, 1e6], aspect=1
                ),
            }
        )
        == 2
    )
    for kind in (FloatingChain, IdealFluidSwimmer):
        for name, low, high in (("masses", 1e-9, 1e9), ("inertias", 1e-6, 1e6)):
            for wrong in (0.9 * low, 1.1 * high, np.nan):
                with pytest.raises(
                    ValueError,
                    match=re.escape(
                        f"{name} must be 3 numbers from {low:g} to {high:g}, one"
                    ),
                ):
                    kind(**{name: (1.0, wrong, 1.0)})
