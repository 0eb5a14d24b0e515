"""The tiers beyond the uniform fit, and whether error estimates can be believed."""

import dataclasses

import numpy as np
import pytest
from refusals import refuses
from registry import GAITS, MEDIA
from tabled import tabled

from geomech import plots, scenes
from geomech.mathematics.gaits import Butterfly, Circle, Fourier
from geomech.mathematics.geometry import connection, family
from geomech.mathematics.geometry.representations import harmonics
from geomech.mathematics.systems import Swimmer
from geomech.mathematics.tiers import TIERS, Plan, Tier, fitted
from geomech.mathematics.tiers.direct import direct
from geomech.scenes import Numerics, Scene
from geomech.studies.available import default_tiers
from geomech.studies.displacement.choose import cheapest_displacements
from geomech.studies.estimates import estimate
from geomech.studies.scene_tables import SceneTables
from rft import Chain
from rft.bodies.base import body_size
from rft.effects import DepthProfile

pytestmark = pytest.mark.usefixtures("fastest")
GLASS = scenes.load("three-link-glass")
FLUID = scenes.load("three-link-viscous")
STUDY = SceneTables(GLASS)
RADII = np.linspace(0.5, 2.0, 13)
SCALES = np.linspace(0.25, 1.0, 7)


def exact(medium, body, gait, amplitudes, regularisation=1e-6, phases=2048):
    """Net poses by the force balance, far finer than anything tested here."""
    scene = Scene(Swimmer(medium, body), gait, Numerics()).with_numerics(
        regularisation=regularisation
    )
    return direct(scene.system.velocity, gait, amplitudes, phases)


@pytest.fixture(scope="module")
def truth(truths):
    medium = GLASS.system.medium
    body = GLASS.system.body
    return {
        "circle": truths("tiers", exact, medium, body, Circle(), RADII),
        "butterfly": truths("tiers", exact, medium, body, Butterfly(), SCALES),
    }


def off(poses, truth):
    return np.abs(plots.net(poses) / plots.net(truth) - 1).max()


def test_harmonics_predict_circles_within_a_percent(truth):
    """A on a 31 x 31 grid is off by up to 50 %; the odd harmonics to the 15th by 1 %
    from 0.5 to 2 rad."""
    circle = truth["circle"]
    butterfly = STUDY.poses("harmonic", Butterfly(), SCALES)
    assert off(STUDY.poses("harmonic", Circle(), RADII), circle) < 0.0101
    assert off(STUDY.poses("path", Circle(), RADII), circle) > 0.4
    assert off(butterfly, truth["butterfly"]) < 0.01


def test_adapted_area_predicts_its_family(truth):
    """The CCF's area integral, uniform: +50 to -29 % on circles."""
    butterfly = STUDY.poses("adapted", Butterfly(), SCALES)
    assert off(STUDY.poses("area", Circle(), RADII), truth["circle"]) > 0.2
    assert off(butterfly, truth["butterfly"]) < 0.01
    circle = STUDY.poses("adapted", Circle(), RADII)
    np.testing.assert_allclose(circle, truth["circle"], atol=2e-4)


@pytest.mark.parametrize("name", GAITS)
@pytest.mark.parametrize("medium", ["viscous-2", "glass-0.3mm-loose"])
def test_families_of_every_gait(name, medium):
    swimmer = Swimmer(MEDIA[medium], Chain())
    study = SceneTables(Scene(swimmer, GAITS[name], Numerics(curves=48)))
    adapted, direct = (study.poses(m, None, [0.3, 0.6]) for m in ("adapted", "direct"))
    np.testing.assert_allclose(adapted[:, 2], direct[:, 2], atol=1e-3)
    bound = 0.01 * np.abs(plots.net(direct)) + 1e-4
    assert (estimate.distance(adapted, direct) < bound).all()


GRID = connection.grid(2, 5)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (
            lambda f: family.fit(f, Circle(), 0.5, 6, 16).area([0.6]),
            "0 family 0.5",
        ),
        (
            lambda f: family.fit(f, Circle(), 0.5, 6, 16, least=-0.5).area([-0.6]),
            "-0.5 family 0.5",
        ),
        (lambda f: family.fit(f, Circle(), 0.0), "largest amplitude | value"),
        (
            lambda f: harmonics.fit(f, GRID, 24, highest=4),
            "harmonics odd directions | value",
        ),
        (
            lambda f: harmonics.fit(f, GRID, highest=5, count=5),
            "harmonics directions | value",
        ),
        (
            lambda f: cheapest_displacements(GLASS, [1.0], 1e-15),
            "tier 1e-15 | where instead",
        ),
        (lambda f: cheapest_displacements(GLASS, [1.0], 0.0), "tolerance | value"),
    ],
)
def test_what_no_table_or_tier_reaches_is_refused(make, said):
    with refuses(said):
        make(FLUID.system.velocity)


def test_more_harmonics_than_usual_come_nearer_to_the_velocity():
    """At a shape of the grid, in directions between those of the fit."""
    errors = []
    for highest in (15, 45):
        few = GLASS.with_numerics(grid=7, phases=32, harmonics=highest)
        series = SceneTables(few).compute_harmonics()
        alpha = np.array([axis[2] for axis in series.axes])
        rates = connection.directions(2, 97)
        truth = GLASS.system.velocity(alpha, rates)
        errors.append(np.abs(series.velocity(alpha, rates) - truth).max())
    assert errors[1] < 0.3 * errors[0]


# Error estimates.

RANDOM_MEDIA = [
    "glass-0.3mm-loose",
    "glass-0.3mm-close",
    "coulomb",
    "viscous-2",
    "glass-0.3mm-surface",
    "sharp",
    "blunt",
]


def random_scene(rng):
    amplitude = rng.uniform(0.1, 1.4)
    centre = tuple(rng.uniform(-0.5, 0.5, 2))
    cos, sin = rng.normal(size=(2, 2, 3)) * [1.0, 0.3, 0.2]
    gait = [
        Circle(amplitude=amplitude, centre=centre),
        Butterfly(amplitude=0.7 * amplitude, centre=centre),
        Fourier(amplitude=0.6 * amplitude, centre=centre, cos=cos, sin=sin),
    ][rng.integers(3)]
    lengths = tuple(rng.uniform(0.4, 1.0, 3))
    body = Chain(lengths, frame=("mean", "link-2")[rng.integers(2)])
    medium = MEDIA[RANDOM_MEDIA[rng.integers(len(RANDOM_MEDIA))]]
    return Scene(Swimmer(medium, body), gait, Numerics(extent=4.0, grid=21))


def assert_believable(estimates, errors):
    """Errors are covered in 95 %, by ten times too much at most in the median."""
    estimates = np.concatenate(estimates)
    errors = np.concatenate(errors)
    assert (np.mean(errors <= estimates + 1e-12, 0) >= 0.95).all()
    assert (np.median(estimates / np.maximum(errors, 1e-16), 0) <= 10).all()


def test_direct_estimates_cover_the_truth(truths):
    """50 random scenes against 2048 phases at a regularisation of 1e-9: positions and
    headings."""
    rng = np.random.default_rng(7)
    estimates = []
    errors = []
    for _ in range(50):
        some = random_scene(rng)
        loads = ("exact", "exact", "midpoint:20")[rng.integers(3)]
        regularisation = 10.0 ** rng.uniform(-6, -3)
        coarse = some.with_numerics(loads=loads, regularisation=regularisation)
        a = np.array([some.gait.amplitude])
        phases = min(2 ** rng.integers(5, 9), 128)
        poses, error = estimate.direct(coarse, some.gait, a, phases)
        body = some.system.body
        true = truths("estimates", exact, some.system.medium, body, some.gait, a, 1e-9)
        estimates.append(error)
        errors.append(estimate.pose_distance(poses, true, body_size(body)))
    assert_believable(estimates, errors)


def test_look_up_estimates_cover_the_truth(truths):
    rng = np.random.default_rng(8)
    tiers = [tier for tier in TIERS if tier != "direct"]
    estimates = []
    errors = []
    for _ in range(8):
        some = random_scene(rng)
        system = some.system
        a = some.gait.amplitude * np.linspace(0.3, 1.0, 4)
        true = truths("estimates", exact, system.medium, system.body, some.gait, a)
        found = tabled(SceneTables(some).displacements(a, tiers))
        for tier, error in found["estimate"].items():
            estimates.append(np.stack([error, found["estimate_heading"][tier]], -1))
            errors.append(estimate.pose_distance(np.array(found[tier]), true, 1.0))
    assert_believable(estimates, errors)


@pytest.mark.parametrize(
    ("changes", "coarse", "fine"),
    [
        ({"medium": MEDIA["measured"]}, {"loads": "gauss:4"}, {"loads": "gauss:64"}),
        ({"effects": (DepthProfile((1.0, 0.5)),)}, {"pieces": 8}, {"pieces": 64}),
    ],
)
def test_errors_of_rules_and_pieces_are_covered_at_each_amplitude(
    changes, coarse, fine
):
    sand = GLASS.changed(**changes)
    (poses, error), (true, _) = (
        estimate.direct(
            sand.with_numerics(**x), Circle(), np.array([0.4, 0.9, 1.4]), 64
        )
        for x in (coarse, fine)
    )
    off = estimate.pose_distance(poses, true, 1.0)
    assert (off <= error + 1e-12).all()
    assert error.max() < 5 * off.max()


@pytest.mark.parametrize("length", [1.0, 0.3])
def test_what_the_solver_left_counts_in_the_estimate(length):
    """A residual, in units of the axial drag, is a velocity of the body for 2 pi of
    phase."""
    a = np.array([0.6, 1.4])
    body = dataclasses.replace(GLASS.system.body, length=length)
    tight = GLASS.changed(body=body)
    lazy = tight.with_numerics(tolerance=0.5)
    run = lazy.cycle(lazy.gait, a, 64)
    left = 2 * np.pi * (run.residual * run.speed)[:, None]
    poses, error = estimate.direct(lazy, lazy.gait, a, 64)
    true = tight.cycle(tight.gait, a, 64).net
    assert (error >= estimate.pose_distance(poses, true, length)).all()
    np.testing.assert_allclose(error[:, :1], left, rtol=0.9)


def test_estimates_are_in_the_unit_of_their_poses():
    tiny = GLASS.changed(body=dataclasses.replace(GLASS.system.body, length=1e-6))
    a = np.array([1.0])
    large, small = (
        tabled(SceneTables(s.with_numerics(grid=9)).displacements(a, ["path"]))
        for s in (GLASS, tiny)
    )
    for key, size in (("estimate", 1e-6), ("estimate_heading", 1.0)):
        expected = size * large[key]["path"][0]
        assert small[key]["path"][0] == pytest.approx(expected, rel=1e-6)


# Choosing a tier.


def test_a_tier_is_one_expression(own_parts):
    """The constant of the connection alone: predicted and judged like any."""

    def plan(system, numerics, gait, amplitudes):
        def straight(A, some):
            def velocity(alpha, rate):
                return np.einsum("...ij,...j->...i", A(0 * alpha), rate)

            return direct(velocity, gait, some, 64)

        return Plan(straight, fitted.table(system, numerics))

    TIERS.register(Tier("leading", "A at the straight pose", {"color": "k"}, plan))
    study = SceneTables(GLASS.with_numerics(grid=9))
    found = tabled(study.displacements([0.05, 1.0], ["leading", "direct"]))
    off = estimate.distance(np.array(found["leading"]), np.array(found["direct"]))
    assert (off <= found["estimate"]["leading"]).all()
    assert "leading" in default_tiers(study.scene.system)


@pytest.mark.parametrize("tier", TIERS.values(), ids=list(TIERS))
def test_settings_go_from_coarse_to_fine_without_a_repetition(tier):
    for setting in tier.settings:
        steps = np.diff(setting.values)
        assert (steps > 0).all() or (steps < 0).all()


MANY = np.linspace(0.3, 2.0, 201)


@pytest.mark.parametrize(("tol", "every"), [(1e-2, 2), (1e-3, 2), (1e-5, 100)])
def test_the_cheapest_tier_meets_the_tolerance(tol, every, truths):
    answer = tabled(cheapest_displacements(GLASS, MANY[::every], tol))
    tier = answer["tier"]
    assert max(answer["estimate"][tier]) <= tol
    medium = GLASS.system.medium
    true = truths("tiers", exact, medium, GLASS.system.body, GLASS.gait, MANY)[::every]
    off = estimate.pose_distance(np.array(answer[tier]), true, 1.0)
    assert off[:, 0].max() <= tol
    assert (off[:, 1] <= answer["estimate_heading"][tier]).all()


@pytest.mark.parametrize(("count", "tier"), [(3, "direct"), (400, "adapted")])
def test_a_table_pays_for_many_amplitudes_and_not_for_few(count, tier):
    found = cheapest_displacements(GLASS, np.linspace(0.3, 2.0, count), 2e-3)
    assert tabled(found)["tier"] == tier


def test_a_tolerance_refines_pieces():
    uneven = GLASS.changed(effects=(DepthProfile((1.0, 0.5)),))
    found = cheapest_displacements(uneven.with_numerics(pieces=2), [0.5], 1e-4)
    assert found["chosen_pieces"].values > 2
    fine = uneven.with_numerics(pieces=64)
    true, _ = estimate.direct(fine, uneven.gait, np.array([0.5]), 128)
    off = estimate.pose_distance(np.array(tabled(found)["direct"]), true, 1.0)
    assert off[0, 0] < 1e-4


# Amplitudes of either sign.

GENERIC = Fourier(
    cos=((0.8, 0.2), (0.3, -0.1)), sin=((-0.3, 0.1), (0.6, 0.25)), centre=(0.3, -0.2)
)
TURNED = Fourier(
    cos=((-0.8, -0.2), (-0.3, 0.1)),
    sin=((0.3, -0.1), (-0.6, -0.25)),
    centre=(0.3, -0.2),
)
A = np.array([-1.0, -0.35, 0.0, 0.35, 1.0])


@pytest.mark.parametrize("tier", ["area", "adapted", "path", "harmonic", "direct"])
def test_every_tier_takes_negative_and_zero_amplitudes_alike(tier):
    """As those of the curve reflected through the gait's centre, and rest."""
    found = STUDY.poses(tier, GENERIC, A)
    close = {"rtol": 1e-9, "atol": 1e-12}
    np.testing.assert_allclose(found[::-1], STUDY.poses(tier, TURNED, A), **close)
    np.testing.assert_allclose(found[2], 0.0, atol=1e-15)
