"""Systems without drag: chains whose momentum is zero, and the differential drive,
against sums of their own."""

import numpy as np
import pytest

from geomech.mathematics.gaits import Circle, Ellipse
from geomech.mathematics.geometry import metric
from geomech.mathematics.systems import (
    DifferentialDrive,
    FloatingChain,
    IdealFluidSwimmer,
)
from geomech.mathematics.systems.framed import in_frame
from geomech.mathematics.tiers.base import Numerics
from geomech.scenes import Scene
from geomech.studies.mechanics import motion as moving
from geomech.studies.scene_tables import SceneTables
from rft.bodies.base import body_size

OVAL = Ellipse(semi_axes=(0.9, 0.5), centre=(0.7, -0.2), tilt=0.3)
CART = DifferentialDrive(0.03, 0.15)
AFLOAT = FloatingChain((0.8, 1.3, 1.0), 0.4, "mean", (1.0, 0.5, 2.0), (0.1, 0.2, 0.05))
SWIMMER = IdealFluidSwimmer(
    (0.8, 1.3, 1.0), 0.4, "link-1", 0.2, (1.0, 0.5, 2.0), (0.1, 0.07, 0.05)
)


@pytest.mark.parametrize("aspect", [0.1, 0.6])
def test_added_masses_are_those_of_the_flow_around_an_ellipse(aspect):
    """On the ellipse the stream function is that of the body's motion; outside of it
    the potential phi + i psi is a series sum a_k exp(-i k t) on the boundary, by
    conformal mapping, and the fluid's energy is pi / 2 sum k |a_k|^2. Links have the
    half axis 1 / 2, in units of pi."""
    t = 2 * np.pi * np.arange(64) / 64
    x, y = np.cos(t) / 2, aspect * np.sin(t) / 2
    stream = np.array([y, -x, (x**2 + y**2) / 2])
    series = np.abs(2 * np.fft.rfft(stream)[:, 1:20] / 64) ** 2
    added = np.pi * series @ np.arange(1, 20)
    swimmer = IdealFluidSwimmer((1, 1), aspect=aspect, masses=(1e-9, 1e-9))
    found = np.pi * np.array(swimmer.inertia()[1][0]) * [4, 4, 16]
    np.testing.assert_allclose(found, added, rtol=1e-7)


def impulses(motion, masses, inertia):
    """Linear and angular impulse of chain and fluid in the world (phases, 3), its
    scale, and twice the kinetic energy, from the links' ends by differences of order 8.
    inertia: (along, across, about) of each link, in the world's units."""
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
    """Masses, and inertia of each link in the world's units, written out anew from the
    fields."""
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
    """Over two cycles, whatever the frame; and `cost` is twice the kinetic energy that
    is seen."""
    system = in_frame(system, frame)
    masses, inertia, unit = own(system)
    found = moving.compute_motion(Scene(system, OVAL, Numerics(phases=256)), 2)
    impulse, size, energy = impulses(found, masses, inertia)
    assert min(size) > 1e-6
    assert (np.abs(impulse) < 1e-9 * np.array(size)).all()
    alpha, alphadot = OVAL.cycle(256)
    cost = np.tile(system.squared_speed(alpha, alphadot), 2)[4 : 4 + len(energy)]
    np.testing.assert_allclose(cost * unit, energy, rtol=1e-8)


@pytest.mark.parametrize("system", [AFLOAT, SWIMMER], ids=lambda s: s.kind)
def test_cost_is_a_metric(system):
    alpha, alphadot = np.random.default_rng(4).uniform(-2.5, 2.5, (2, 20, 2))
    cost = system.squared_speed(alpha, alphadot)
    other = in_frame(system, "link-2").squared_speed(alpha, alphadot)
    np.testing.assert_allclose(other, cost, rtol=1e-12)
    fitted = metric.fit(system.squared_speed, (np.linspace(-3, 3, 41),) * 2)
    np.testing.assert_allclose(fitted.norm(alpha, alphadot) ** 2, cost, rtol=2e-3)


def test_the_cart_goes_aside_by_the_area_of_a_circle_of_its_wheels():
    """Its CCF is -r^2 / track; heading is known in closed form, and the way is its
    integral."""
    circle = Circle(amplitude=0.8, centre=(0.3, 1.0))
    tables = SceneTables(Scene(CART, circle, Numerics(grid=9, extent=20.0)))
    t = np.linspace(0, 2 * np.pi, 4096, endpoint=False)
    heading = 0.2 * 0.8 * (1 + np.sin(t) - np.cos(t))
    flow = 0.015 * 0.8 * (np.cos(t) - np.sin(t)) * np.exp(1j * heading)
    net = 2 * np.pi * flow.mean()
    direct, area = tables.poses("direct"), -(0.03**2) / 0.15 * np.pi * 0.8**2
    np.testing.assert_allclose(direct, [net.real, net.imag, 0], atol=1e-14)
    np.testing.assert_allclose(tables.poses("area"), [0, area, 0], atol=1e-12)


@pytest.mark.parametrize("kind", [FloatingChain, IdealFluidSwimmer])
def test_masses_are_values_within_bounds(kind):
    for name, wrong in (("masses", 0.9e-9), ("inertias", np.nan)):
        with pytest.raises(ValueError, match=f"{name} must be 3 numbers from 1e-0"):
            kind(**{name: (1.0, wrong, 1.0)})
