"""What an uncertain medium does to a displacement, against many media drawn from its
covariance."""

import numpy as np
import pytest

from geomech.mathematics.gaits import Butterfly, Ellipse
from geomech.mathematics.systems import Swimmer, capability
from geomech.mathematics.systems.capabilities import Uncertain
from geomech.scenes import Scene
from geomech.studies.displacement import sweep
from geomech.studies.displacement.choose import cheapest_displacements
from geomech.studies.displacement.variables import QUANTITIES, pose_quantities
from geomech.studies.estimates import uncertainty
from geomech.studies.estimates.uncertainty import covariance_root, medium_spread
from geomech.studies.scene_tables import SceneTables
from rft import Chain, Granular, SkinFriction, Transient, Viscous
from rft.core.refusal import Refusal

pytestmark = pytest.mark.usefixtures("fastest")
# It moves along, sideways and turns.
GAIT = Ellipse(semi_axes=(1.0, 0.6), tilt=0.4, centre=(0.3, -0.2))
BODY = Chain((1, 1.4, 0.8), length=0.3, frame="link-1")
COVARIANCE = ((0.012, -0.0012), (-0.0012, 0.0004))  # correlated
AMPLITUDES = np.array([0.7, 1.2])


def scene(medium, **changes):
    return Scene(Swimmer(medium, BODY), GAIT, name="sand", **changes)


SAND = scene(Granular(1.49, 0.22, covariance=COVARIANCE))


@pytest.fixture(autouse=True)
def few_phases(monkeypatch):
    monkeypatch.setattr(uncertainty, "PHASES", 16)


def quantities(system, gait, amplitudes, phases=16):
    """Return QUANTITIES (B, 4) of a system."""
    net = system.run(*gait.cycle(phases, np.array(amplitudes))).net
    return np.stack([*pose_quantities(net).values()], -1)


def drawn(scene, draws, amplitudes, phases=16):
    """Return deviations and shifts (B, 4) in media with parameters off by the draws."""
    system = capability(scene.system, Uncertain)
    found = [
        quantities(system.varied(draw), scene.gait, amplitudes, phases)
        for draw in draws
    ]
    mean = quantities(scene.system, scene.gait, amplitudes, phases)
    return np.std(found, 0), np.mean(found, 0) - mean


def whitened(count, size, seed):
    """Return normal draws (2 count, size) in opposite pairs, with exactly unit
    covariance."""
    z = np.random.default_rng(seed).normal(size=(count, size))
    z -= z.mean(0)
    covariance = np.cov(z.T, bias=True).reshape(size, size)
    z = z @ np.linalg.inv(np.linalg.cholesky(covariance)).T
    return np.concatenate([z, -z])


def assert_as_drawn(told, scatter, shift):
    for k, name in enumerate(QUANTITIES):
        np.testing.assert_allclose(told[name], scatter[:, k], rtol=0.03)
        tolerance = 0.03 * scatter[:, k].max()
        np.testing.assert_allclose(told["shift"][name], shift[:, k], atol=tolerance)


def test_media_drawn_from_the_covariance_scatter_as_told():
    told = medium_spread(SAND, GAIT, AMPLITUDES)
    media = whitened(100, 2, seed=1) @ covariance_root(COVARIANCE).T
    scatter, shift = drawn(SAND, media, AMPLITUDES)
    assert_as_drawn(told, scatter, shift)


def test_a_wide_covariance_is_carried_on_to_second_order():
    """Where drag is almost the same in all directions, the turn of a viscous swimmer is
    far from linear in its ratio."""
    wide = scene(Viscous(1.15, ((0.3**2,),)))
    told = medium_spread(wide, GAIT, np.array([0.7]))
    near = scene(Viscous(1.15, ((0.03**2,),)))
    linear = medium_spread(near, GAIT, np.array([0.7]))
    scatter, _ = drawn(wide, 0.3 * whitened(100, 1, seed=3), [0.7])
    assert 9 * linear["heading"] < 0.9 * told["heading"]
    assert 0.9 * told["heading"] < told["heading"] < scatter[0, 2]


@pytest.mark.parametrize(("share", "is_told"), [(1.0, True), (0.1, False)])
def test_wide_media_shift_the_mean_and_it_is_told(share, is_told, monkeypatch):
    """By 33 % on C and 25 % on gamma0, in a strong butterfly."""
    monkeypatch.setattr(uncertainty, "PHASES", 32)
    spread = share * np.array([0.33 * 1.8, 0.25 * 0.24])
    medium = Granular(1.8, 0.24, covariance=np.diag(spread**2))
    wide = Scene(Swimmer(medium, Chain()), Butterfly()).with_numerics(phases=64)
    told = medium_spread(wide, wide.gait, np.array([1.2]))
    media = whitened(60, 2, seed=5) * spread
    media = media[(media + [1.8, 0.24] > [0.0, 0.001]).all(1)]
    scatter, shift = drawn(wide, media, [1.2], 32)
    assert told["net_distance"][0] == pytest.approx(scatter[0, 3], rel=0.06)
    tolerance = 0.03 * scatter[0, 3]
    found = told["shift"]["net_distance"][0]
    assert found == pytest.approx(shift[0, 3], abs=tolerance)
    result = SceneTables(wide).displacements([1.2], ["direct"])
    line = f"mean over the media: net distance shifted by up to {abs(found):.1e}"
    assert (line in str(result)) == is_told


def test_media_that_end_before_the_points_are_carried_on_from_nearer_ones():
    """C = 1.49 +- 1: at sqrt(3) deviations there is no medium, at one there is."""
    wide = scene(Granular(1.49, 0.22, covariance=((1.0, 0.0), (0.0, 1e-6))))
    points = uncertainty.sigma_points(wide)
    found = {round(s.medium.C, 9) for pair in points.sides for s in pair}
    assert found == {0.49, 1.49, 2.49}
    assert points.deviations == 1.0


@pytest.mark.parametrize(
    ("matrix", "rank"),
    [
        (COVARIANCE, 2),
        (((4.0, 6.0), (6.0, 9.0)), 1),
        (((1e-12, 0.0), (0.0, 1e6)), 2),
        (((0.0, 0.0), (0.0, 2.0)), 1),
        (((0.0, 0.0), (0.0, 0.0)), 0),
    ],
)
def test_a_root_has_a_column_for_each_direction_of_spread(matrix, rank):
    root = covariance_root(matrix)
    assert root.shape == (2, rank)
    np.testing.assert_allclose(root @ root.T, matrix, rtol=1e-12, atol=1e-30)


def assert_spread(result, told, rows=...):
    spread = np.hypot(result["x"].spread, result["y"].spread)
    expected = np.broadcast_to(told["position"], spread[rows].shape)
    np.testing.assert_allclose(spread[rows], expected, rtol=1e-6)
    heading = np.broadcast_to(told["heading"], expected.shape)
    np.testing.assert_allclose(result["heading"].spread[rows], heading, rtol=1e-6)


def test_every_tier_has_it_beside_its_own_error():
    sand = SAND.with_numerics(grid=7, phases=64)
    result = SceneTables(sand).displacements([0.5, 1.0], ["area", "direct"])
    told = medium_spread(sand, GAIT, np.array([0.5, 1.0]))
    assert_spread(result, told)
    assert_spread(cheapest_displacements(sand, [0.5, 1.0], 1e-2), told)


@pytest.mark.parametrize("effect", [SkinFriction(0.1, 0.15), Transient(travel_m=0.03)])
def test_effects_and_time_stepping_feel_it(effect):
    """By central differences of the whole cycle in the ratio of a viscous medium."""
    fluid = scene(Viscous(2.5, ((0.04**2,),))).changed(effects=(effect,))
    fluid = fluid.with_numerics(cycles=1)
    told = medium_spread(fluid, GAIT, np.array([1.0]))
    more, less = (
        fluid.changed(medium=Viscous(2.5 + h)).cycle(phases=16).net
        for h in (0.01, -0.01)
    )
    found = [told[name][0] for name in QUANTITIES[:3]]
    np.testing.assert_allclose(found, 2 * np.abs(more - less), rtol=0.01, atol=1e-7)


WIDE = scene(Granular(1.49, 0.22, covariance=((4.0, 0.0), (0.0, 1e-4))))


@pytest.mark.parametrize(
    "ask",
    [
        lambda: SceneTables(WIDE).displacements([1.0], ["direct"]),
        lambda: cheapest_displacements(WIDE, [1.0], 1e-2),
        lambda: sweep.sweep(WIDE, {"gait.amplitude": [1.0]}),
        lambda: sweep.sweep(SAND, {"medium.C": [2.0, 1.0, 0.05]}),  # at one end
    ],
)
def test_a_covariance_that_reaches_no_medium_is_refused(ask):
    refused = (
        r"\[medium\] covariance: one standard deviation away the medium is not valid"
    )
    with pytest.raises(Refusal, match=refused):
        ask()


def test_sweeps_have_it_of_every_length_and_batch():
    sand = SAND.with_numerics(phases=32)
    amplitudes = np.linspace(0.1, 1.0, 70)  # more than go together
    many = sweep.sweep(sand, {"gait.amplitude": amplitudes.tolist()})
    assert_spread(many, medium_spread(sand, GAIT, amplitudes))
    lengths = sweep.sweep(sand, {"body.length": [0.3, 0.6], "gait.amplitude": [1.0]})
    told = medium_spread(sand, GAIT, np.array([1.0]))
    assert_spread(lengths, {**told, "position": 2 * told["position"]}, rows=1)
