"""Models of the flow between links: against formulas for rods and spheres, against
integrals of their own, and against numbers of another program."""

import itertools

import numpy as np
import pytest
from scipy.integrate import dblquad
from scipy.special import zeta

from geomech.mathematics.gaits import Circle
from geomech.mathematics.geometry.reconstruct import displacement
from rft import Chain
from rft.formulas import cylinders
from rft.hydrodynamics import (
    Beads,
    Stokeslets,
    axial_drag,
    clearance,
    resistance,
    rotne_prager,
)
from rft.hydrodynamics.base import Sites
from rft.hydrodynamics.stokeslets import BLOB, most_segments

THREE = Chain((1, 1, 1))
UNEVEN = Chain((0.6, 1.3, 0.8, 1.0), frame="link-2")


def circle_distance(model, phases=64):
    """Net distance, body lengths, of three links on the circle of 1 rad."""
    alpha, alphadot = Circle(1.0).cycle(phases)
    A = resistance(model, THREE, alpha).connection
    return np.hypot(*displacement(np.einsum("bij,bj->bi", A, alphadot))[:2])


@pytest.mark.parametrize(
    ("slenderness", "distance"), [(24, 0.0308), (48, 0.0350), (99, 0.0380)]
)
def test_touching_beads_swim_as_in_another_program(slenderness, distance):
    assert abs(circle_distance(Beads(slenderness)) / distance - 1) < 0.01


@pytest.mark.parametrize("slenderness", [5, 10, 25, 30])
@pytest.mark.parametrize("model", [Beads, Stokeslets])
def test_a_straight_rod_drags_across_over_along_as_a_cylinder(model, slenderness):
    """Tirado et al. (1984) fitted their formula from 2 to 30."""
    options = (most_segments(slenderness, 1.0),) if model is Stokeslets else ()
    rigid = resistance(model(slenderness, *options), THREE, np.zeros((1, 2))).rigid[0]
    ratio = rigid[1, 1] / rigid[0, 0]
    assert abs(ratio / cylinders.drag_ratio(slenderness) - 1) < 0.03


@pytest.mark.parametrize("slenderness", [30, 100])
def test_stokeslets_drag_as_a_cylinder_of_their_radius(slenderness):
    model = Stokeslets(slenderness, 24)
    rigid = resistance(model, THREE, np.zeros((1, 2))).rigid[0]
    expected = [cylinders.axial_drag(slenderness), cylinders.normal_drag(slenderness)]
    expected.append(cylinders.rotational_drag(slenderness))
    shares = np.diag(rigid) / expected - 1
    assert (np.abs(shares) < [0.015, 0.015, 0.035]).all()


@pytest.mark.parametrize("slenderness", [25, 100])
def test_beads_drag_as_a_thinner_cylinder(slenderness):
    """The velocity within a long row of touching beads is a sum of 1 / k and 1 / k^3,
    ln n + Euler's constant and zeta(3); a cylinder of the radius a has 4 ln(2 l / a) -
    2 along and 2 ln(2 l / a) + 1 across."""
    along = 8 / 3 + 4 * np.euler_gamma - 2 / 3 * zeta(3)
    across = 8 / 3 + 2 * np.euler_gamma + zeta(3) / 3
    thinner = [
        np.exp((along - 4 * np.log(4) + 2) / 4),
        np.exp((across - 2 * np.log(4) - 1) / 2),
    ]
    np.testing.assert_allclose(thinner, [1 / 0.854, 1 / 0.799], rtol=1e-3)
    rigid = resistance(Beads(slenderness), THREE, np.zeros((1, 2))).rigid[0]
    expected = [
        cylinders.axial_drag(slenderness * thinner[0]),
        cylinders.normal_drag(slenderness * thinner[1]),
    ]
    np.testing.assert_allclose(rigid[[0, 1], [0, 1]], expected, rtol=0.01)


def test_far_spheres_miss_the_exact_mobility_by_the_fourth_power_of_their_distance():
    """Two spheres of radius 1 have, in units of 1 / 6 pi mu, 1 - 15 / 4 r^-4 along
    their line and 1 - 17 / 16 r^-6 across for themselves, and 3 / 2 r - r^-3 + 75 / 4
    r^-7 and 3 / 4 r + r^-3 / 2 for each other (Batchelor, J. Fluid Mech. 74, 1
    (1976))."""
    errors = []
    for r in (20.0, 40.0):
        own = 0.75 * rotne_prager(0.0, 1.0)
        other = 0.75 * rotne_prager(r, 1.0)
        own_exact = np.diag([1 - 15 / 4 / r**4, 1 - 17 / 16 / r**6])
        other_exact = np.diag(
            [3 / 2 / r - 1 / r**3 + 75 / 4 / r**7, 3 / 4 / r + 1 / 2 / r**3]
        )
        errors.append(max(abs(own - own_exact).max(), abs(other - other_exact).max()))
    assert abs(np.log2(errors[0] / errors[1]) - 4) < 0.01


def test_overlapping_spheres_join_the_others_and_a_single_one():
    inside, outside = rotne_prager(np.array([2 - 1e-9, 2 + 1e-9]) * 1j, 1.0)
    np.testing.assert_allclose(inside, outside, rtol=1e-8, atol=1e-12)
    np.testing.assert_allclose(rotne_prager(1e-9, 1.0), 4 / 3 * np.eye(2), rtol=1e-8)


MODELS = {
    "beads": Beads(40),
    "stokeslets": Stokeslets(40, 16),
    "stokeslets, thin": Stokeslets(3000, 16),
    "stokeslets, as fine as they may be": Stokeslets(20, most_segments(20)),
}


@pytest.mark.parametrize("body", [THREE, UNEVEN], ids=["even", "uneven"])
@pytest.mark.parametrize("name", MODELS)
def test_resistance_is_symmetric_and_power_positive(name, body):
    model = MODELS[name]
    alpha = np.random.default_rng(1).uniform(-2, 2, (30, body.joints))
    found = resistance(model, body, alpha)
    sites = model.sites(body.fractions)
    top = np.concatenate([found.rigid, found.coupling], 2)
    low = np.concatenate([found.coupling.swapaxes(1, 2), found.shape], 2)
    full = np.concatenate([top, low], 1)
    assert (np.linalg.eigvalsh(full) > 0).all()
    assert (np.linalg.eigvalsh(found.dissipation) > 0).all()
    np.testing.assert_allclose(full, full.swapaxes(1, 2), rtol=1e-12)

    # The mobility too, and a body rotated by a right angle exchanges x and y.
    joint = np.random.default_rng(2).normal(size=(30, body.joints))
    motion = body.motion(alpha.T, joint.T)
    points = motion.attached_points(
        sites.link, sites.ahead[:, None], np.ones((len(sites.link), 1))
    )
    heading = (points.c + 1j * points.s).T
    M = model.mobility(sites, points.centres.T, heading)
    np.testing.assert_allclose(M, M.swapaxes(1, 2), rtol=1e-12, atol=1e-15)
    turned = model.mobility(sites, points.centres.T * 1j, heading * 1j)
    n = len(sites.link)
    np.testing.assert_allclose(turned[:, :n, :n], M[:, n:, n:], rtol=1e-9, atol=1e-12)


def kernel(x, y, size):
    """Velocity (2, 2) at x + i y from unit forces spread over a ball."""
    square = x * x + y * y
    R3 = (square + size**2) ** 1.5
    return ((square + 2 * size**2) * np.eye(2) + np.outer([x, y], [x, y])) / R3


def test_segments_have_the_mean_velocity_that_their_stokeslets_cause():
    """Two segments of one link and one of another, by quadrature of the kernel."""
    model = Stokeslets(10, 3)
    size = BLOB * model.radius
    sites = Sites(np.array([0, 0, 1]), np.array([-0.1, 0.1, 0.0]), np.full(3, 0.1))
    centre = np.array([[-0.1, 0.1, 0.3 + 0.2j]])
    heading = np.exp(1j * np.array([[0.0, 0.0, 1.1]]))
    M = model.mobility(sites, centre, heading).reshape(2, 3, 2, 3)
    for i, j in itertools.product(range(3), range(3)):
        for k, m in ((0, 0), (0, 1), (1, 1)):

            def value(s, t, i=i, j=j, k=k, m=m):
                a = centre[0, i] + s * heading[0, i]
                b = centre[0, j] + t * heading[0, j]
                return kernel((a - b).real, (a - b).imag, size)[k, m]

            expected, _ = dblquad(value, -0.1, 0.1, -0.1, 0.1, epsabs=1e-9)
            # Between links the mean is a rule of Gauss.
            tolerance = 1e-8 if sites.link[i] == sites.link[j] else 1e-5
            assert abs(M[k, i, m, j] - expected / 0.04) < tolerance


def test_many_segments_change_little_at_a_fixed_radius():
    """At slenderness 50 the default number, 24, is within 2 % of all finer ones."""
    distances = [circle_distance(Stokeslets(50, n), 32) for n in (12, 24, 48, 96)]
    differences = np.abs(np.diff(distances))
    assert differences[0] > 2 * differences[1]
    assert max(abs(np.array(distances[2:]) / distances[1] - 1)) < 0.02


def test_models_differ_by_less_the_thinner_the_links():
    shares = []
    for slenderness in (24, 48, 99):
        beads = circle_distance(Beads(slenderness), 32)
        shares.append(circle_distance(Stokeslets(slenderness, 24), 32) / beads - 1)
    assert shares[0] > shares[1] > shares[2] > 0
    assert shares[1] < 0.05


@pytest.mark.parametrize("kind", ["beads", "stokeslets"])
def test_links_side_by_side_shield_each_other(kind):
    """Three links folded into a Z drag more than one link alone, and less than
    three."""

    def model(slenderness):
        if kind == "beads":
            return Beads(slenderness)
        return Stokeslets(slenderness, slenderness)

    # A link alone has a third of the length, and so of the slenderness.
    alone = axial_drag(model(10), Chain((1, 1))) / 3
    folded = resistance(model(30), Chain(frame="link-2"), [[2.5, -2.5]])
    assert 1.05 * alone < folded.rigid[0, 0, 0] < 2.5 * alone


def test_links_that_are_no_neighbours_meet_at_the_corner_of_a_triangle():
    third = 2 * np.pi / 3
    before, meeting, crossed = clearance(
        THREE, [[third - 1e-3] * 2, [third] * 2, [2.3, 2.3]]
    )
    assert 0 < before < 1e-3
    assert meeting < 1e-12
    assert crossed == 0
    # A link folded onto its neighbour comes near it with its free end.
    assert clearance(THREE, [3.1, 0.0]) < 0.014


@pytest.mark.parametrize("segments", [most_segments(24) + 1, 400])
def test_segments_that_are_too_short_are_refused_with_a_number(segments):
    most = most_segments(24)
    with pytest.raises(ValueError, match=f"use {most} segments or fewer"):
        Stokeslets(24, segments)
    assert np.linalg.cond(_matrix(Stokeslets(24, most))) < 1e7


def _matrix(model):
    sites = model.sites(np.ones(1))
    heading = np.ones((1, len(sites.link)), complex)
    return model.mobility(sites, sites.ahead[None] + 0j, heading)
