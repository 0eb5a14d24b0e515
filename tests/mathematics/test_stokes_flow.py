"""Swimmers whose links feel each other's flow, as systems: their velocity against the
resistance of `rft.hydrodynamics`, singular shapes, errors and cost."""

import dataclasses

import numpy as np
import pytest

import geomech
from geomech.mathematics.gaits import Circle
from geomech.mathematics.geometry import connection, metric
from geomech.mathematics.systems import BeadSwimmer, StokesletSwimmer, Swimmer
from geomech.mathematics.systems.capabilities import power, refined
from geomech.mathematics.systems.framed import in_frame
from geomech.mathematics.tiers import fitted
from geomech.mathematics.tiers.base import Numerics
from geomech.scenes import Scene
from geomech.studies.scene_tables import SceneTables
from rft import Chain, Refusal, Viscous
from rft.formulas.cylinders import drag_ratio
from rft.hydrodynamics import Beads, axial_drag, clearance, resistance

BEADS = BeadSwimmer(slenderness=24, frame="link-2")
STOKESLETS = StokesletSwimmer(slenderness=24, frame="link-2")
BOTH = pytest.mark.parametrize("system", [BEADS, STOKESLETS], ids=lambda s: s.kind)


@BOTH
def test_each_shape_is_solved_for_all_its_rates(system):
    rng = np.random.default_rng(3)
    alpha = rng.uniform(-1.5, 1.5, (6, 1, 2))
    rates = rng.normal(size=(4, 2))
    found = system.velocity(alpha, rates)
    one_by_one = [[system.velocity(a[0], rate) for rate in rates] for a in alpha]
    np.testing.assert_allclose(found, one_by_one, rtol=1e-12, atol=1e-15)
    # As a fit passes shapes: repeated by broadcasting.
    repeated = system.velocity(*np.broadcast_arrays(alpha, rates))
    np.testing.assert_allclose(repeated, found, rtol=1e-12, atol=1e-15)


def test_velocity_is_that_at_which_no_force_acts():
    swimmer = BeadSwimmer((0.7, 1.4, 0.9), 0.3, "link-1", slenderness=30)
    chain = Chain((0.7, 1.4, 0.9), 0.3, "link-1")
    alpha, alphadot = np.random.default_rng(4).uniform(-1.5, 1.5, (2, 5, 2))
    xi = swimmer.velocity(alpha, alphadot) / [0.3, 0.3, 1.0]
    R = resistance(Beads(30), chain, alpha)
    force = np.einsum("bij,bj->bi", R.rigid, xi)
    force += np.einsum("bij,bj->bi", R.coupling, alphadot)
    assert np.abs(force).max() < 1e-12

    torque = np.einsum("bji,bj->bi", R.coupling, xi)
    torque += np.einsum("bij,bj->bi", R.shape, alphadot)
    expected = (torque * alphadot).sum(-1) / axial_drag(Beads(30), chain)
    np.testing.assert_allclose(power(swimmer, alpha, alphadot), expected, rtol=1e-10)


@BOTH
def test_power_is_a_metric_and_the_same_in_every_frame(system):
    alpha, alphadot = np.random.default_rng(5).uniform(-1, 1, (2, 20, 2))
    expected = power(system, alpha, alphadot)
    other = power(in_frame(system, "mean"), alpha, alphadot)
    np.testing.assert_allclose(other, expected, rtol=1e-10)
    axes = (np.linspace(-1.2, 1.2, 15),) * 2
    found = metric.fit(lambda a, r: power(system, a, r), axes)
    np.testing.assert_allclose(found.norm(alpha, alphadot) ** 2, expected, rtol=2e-3)


@BOTH
def test_fields_are_nan_where_links_overlap(system):
    study = SceneTables(Scene(system, Circle(1.0), Numerics(grid=21)))
    A = study.fitted.A
    shapes = np.stack(np.meshgrid(*study.fitted.axes, indexing="ij"), -1)
    gap = clearance(Chain(), shapes) - 1 / 24
    mask = (gap <= 0) | connection.sign_changes(gap)
    assert 4 < mask.sum() < 40
    for field in (A, study.metric.M):
        np.testing.assert_array_equal(np.isnan(field).all((0, 1)), mask)
    # Links that are alike cross from alpha_1 = alpha_2 = 2 pi / 3 on.
    assert mask[-1, -1] and mask[0, 0] and not mask[0, -1]


@pytest.mark.parametrize("tier", ["path", "direct"])
def test_a_gait_on_which_links_touch_is_refused(tier):
    study = SceneTables(Scene(BEADS, Circle(1.0, centre=(1.6, 1.6))))
    with pytest.raises(Refusal, match="singular shape .*within a diameter"):
        study.poses(tier)
    assert np.isfinite(study.poses(tier, None, [0.5])).all()


def test_told_errors_cover_those_of_few_segments():
    """Against segments as short as the ball over which a force is spread: with shorter
    ones forces at the ends grow without limit."""
    swimmer = StokesletSwimmer(slenderness=50)
    finest = dataclasses.replace(swimmer, segments=20)
    for amplitude in (0.5, 1.0, 1.9):
        alpha, alphadot = Circle(amplitude).cycle(32)
        truth = np.hypot(*finest.run(alpha, alphadot).net[:2])
        study = geomech.study(swimmer, Circle(amplitude), phases=32)
        found = study.displacement(tiers="direct")
        distance = found["net_distance"]
        assert abs(distance.values.item() - truth) < distance.error.item()
        assert abs(distance.values.item() / truth - 1) < 0.02
    assert distance.error.item() < 0.04 * truth


@pytest.mark.parametrize("slenderness", [5, 12, 50, 1e4])
def test_every_slenderness_has_a_refinement(slenderness):
    swimmer = StokesletSwimmer(slenderness=slenderness)
    alpha, alphadot = Circle(1.0).cycle(16)
    coarse = swimmer.run(alpha, alphadot).net
    fine = refined(swimmer).run(alpha, alphadot).net
    assert np.hypot(*(coarse - fine)[:2]) < 0.03 * np.hypot(*fine[:2])


def test_beads_have_no_refinement():
    assert refined(BEADS) is None


def test_a_local_law_with_the_ratio_of_a_cylinder_swims_less_than_beads():
    """And with a ratio of 2 more, on the circle of 1 rad at slenderness 48."""
    distances = []
    for medium in ({"slenderness": 48}, {"ratio": 2.0}):
        tables = {
            "medium": {"law": "viscous", **medium},
            "body": {"kind": "chain"},
            "gait": {"kind": "circle", "amplitude": 1.0},
        }
        run = geomech.scenes.from_tables(tables).system.run(*Circle(1.0).cycle(64))
        distances.append(np.hypot(*run.net[:2]))
    beads = np.hypot(*BeadSwimmer().run(*Circle(1.0).cycle(64)).net[:2])
    shares = np.array(distances) / beads - 1
    np.testing.assert_allclose(shares, [-0.146, 0.463], atol=0.002)


def test_the_cost_counts_each_shape_once():
    scene = geomech.load("three-link-stokeslets")
    tables = SceneTables(scene)
    fewer = tables.with_numerics(directions=4)
    assert fitted.table(scene.system, tables.scene.numerics).balances == 256
    assert fitted.table(scene.system, fewer.scene.numerics).balances == 256


def test_ten_links_swim_a_wave():
    """In many links a wave of bends moves against its direction, as it does by
    resistive force theory."""
    n = 9
    swimmer = StokesletSwimmer((1,) * (n + 1), slenderness=100)
    t = 2 * np.pi * np.arange(32) / 32
    phase = t[:, None] - 2 * np.pi * np.arange(n) / n
    alpha, alphadot = 0.5 * np.cos(phase), -0.5 * np.sin(phase)
    nonlocal_x = swimmer.run(alpha, alphadot).net[0]
    law = rft_swimmer(n + 1, drag_ratio(100)).run(alpha, alphadot).net[0]
    assert nonlocal_x * law > 0
    assert 0.7 < nonlocal_x / law < 1.5


def rft_swimmer(links, ratio):
    return Swimmer(Viscous(float(ratio)), Chain((1,) * links))
