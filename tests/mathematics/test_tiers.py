"""The tiers beyond the uniform fit, and whether error estimates can be believed."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from registry import GAITS, MEDIA
from tabled import tabled

from geomech import plots, scenes
from geomech.mathematics.gaits import Butterfly, Circle, Fourier, Wave
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
from rft import BodyInertia, Chain, Granular, Viscous
from rft.balance.listening import listening
from rft.bodies.base import body_size
from rft.core.refusal import Refusal
from rft.effects import DepthProfile
from rft.formulas import se2

pytestmark = pytest.mark.usefixtures("fastest")
GLASS = scenes.load("three-link-glass")
BENCH = SceneTables(GLASS)
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
    return {
        "circle": truths(
            "tiers", exact, GLASS.system.medium, GLASS.system.body, Circle(), RADII
        ),
        "butterfly": truths(
            "tiers", exact, GLASS.system.medium, GLASS.system.body, Butterfly(), SCALES
        ),
    }


def off(poses, truth):
    return np.abs(plots.net(poses) / plots.net(truth) - 1)


def test_harmonics_predict_circles_within_a_percent(truth):
    """A on a 31 x 31 grid is off by up to 50 %; the odd harmonics to the 15th by 1 % from 0.5 to 2 rad."""
    tier = BENCH.poses("harmonic", Circle(), RADII)
    assert off(tier, truth["circle"]).max() < 0.0101
    assert off(BENCH.poses("path", Circle(), RADII), truth["circle"]).max() > 0.4
    assert (
        off(BENCH.poses("harmonic", Butterfly(), SCALES), truth["butterfly"]).max()
        < 0.01
    )


def test_the_first_harmonic_is_the_uniform_fit():
    axes = connection.grid(2, 7, 2.0)
    first = harmonics.fit(GLASS.system.velocity, axes, 24, highest=1)
    fitted = connection.fit(GLASS.system.velocity, axes, 24)
    np.testing.assert_allclose(first.coefficients, fitted.A, atol=1e-12)
    np.testing.assert_allclose(first.residual, fitted.residual, atol=1e-12)


def test_all_harmonics_reproduce_the_samples():
    axes, count = connection.grid(2, 5, 2.0), 12
    full = harmonics.fit(GLASS.system.velocity, axes, count, highest=count - 1)
    assert full.residual.max() < 1e-12
    alpha = np.stack(np.meshgrid(*axes, indexing="ij"), -1)[1, 2]
    for direction in connection.directions(2, count):
        np.testing.assert_allclose(
            full.velocity(alpha, 2 * direction),
            GLASS.system.velocity(alpha, 2 * direction),
            atol=1e-8,
        )


def test_harmonics_fall_off_as_kinks_let_them():
    """Stick puts kinks in f(beta): coefficients fall like 1/k^2, so the rms left behind like K^-1.5; least at shapes
    where no link sticks."""
    axes = connection.grid(2, 21, 2.5)
    left = [
        harmonics.fit(GLASS.system.velocity, axes, 96, highest=K).residual
        for K in (5, 15, 45)
    ]
    rms = [np.sqrt((x**2).mean()) for x in left]
    slope = np.polyfit(np.log([5, 15, 45]), np.log(rms), 1)[0]
    assert -2.0 < slope < -1.0
    assert np.median(left[2]) < np.sqrt(
        (left[2] ** 2).mean()
    )  # the misfit sits at few shapes


def test_adapted_area_predicts_its_family(truth):
    """The CCF's area integral, uniform: +50 to -29 % on circles. Adapted to the family: the goal was 5 %."""
    assert off(BENCH.poses("area", Circle(), RADII), truth["circle"]).max() > 0.2
    assert off(BENCH.poses("adapted", Circle(), RADII), truth["circle"]).max() < 0.005
    assert (
        off(BENCH.poses("adapted", Butterfly(), SCALES), truth["butterfly"]).max()
        < 0.01
    )


def test_adapted_poses_are_in_the_body_frame_at_the_start(truth):
    np.testing.assert_allclose(
        BENCH.poses("adapted", Circle(), RADII), truth["circle"], atol=2e-4
    )


def test_the_adapted_map_integrates_to_the_displacement():
    """Summing the map over its own cells of shape space gives the displacement in the family's frame."""
    gait = Circle()
    table = family.fit(GLASS.system.velocity, gait, 1.5, 48, 128)
    alpha, ccf = table.ccf()
    radius = np.linalg.norm(alpha[:, 0], axis=-1)
    cells = radius[:, None] * (2 * np.pi / 128) * np.gradient(radius)[:, None]
    total = np.nansum(ccf[..., 0] * cells), np.nansum(ccf[..., 1] * cells)
    assert np.hypot(*total) == pytest.approx(abs(plots.net(table.area(1.5))), rel=0.03)
    assert ccf[5:15, :, 0].mean() < 0  # like the uniform CCF about the straight pose


@pytest.mark.parametrize("name", GAITS)
@pytest.mark.parametrize("medium", ["viscous-2", "glass-0.3mm-loose"])
def test_families_of_every_gait(name, medium):
    """Exact up to the table, whether or not the body turns on the whole."""
    swimmer = Scene(Swimmer(MEDIA[medium], Chain()), GAITS[name], Numerics(curves=48))
    adapted, direct = (
        SceneTables(swimmer).poses(m, None, np.array([0.3, 0.6]))
        for m in ("adapted", "direct")
    )
    np.testing.assert_allclose(adapted[:, 2], direct[:, 2], atol=1e-3)
    assert (
        estimate.distance(adapted, direct) < 0.01 * np.abs(plots.net(direct)) + 1e-4
    ).all()


TURNING = Circle(centre=(0.5, 0.2))


def test_a_net_turn_leaves_nothing_to_commute():
    """On a circle off the centre, which turns the body by 0.2 rad a cycle, errors shrink with the curves as on any other:
    order 4 where nothing kinks."""
    viscous, a, counts = (
        scenes.load("three-link-viscous"),
        np.linspace(0.0, 1.4, 401)[1:],
        np.array([8, 16, 32]),
    )
    exact = direct(viscous.system.velocity, TURNING, a)
    assert np.abs(exact[:, 2]).max() > 0.2
    tables = [
        SceneTables(viscous.with_numerics(curves=int(n))).poses("adapted", TURNING, a)
        for n in counts
    ]
    errors = [np.abs(found - exact).max() for found in tables]
    assert -np.polyfit(np.log(counts), np.log(errors), 1)[0] == pytest.approx(
        4.0, abs=0.2
    )
    a = a[39::40]
    glass = [BENCH.poses(tier, TURNING, a) for tier in ("adapted", "direct")]
    assert estimate.distance(*glass).max() < 3e-4


@pytest.mark.parametrize(
    "gait", [TURNING, Circle(centre=(0.6, -0.6), reverse=True), Circle()]
)
def test_the_map_of_a_family_integrates_to_its_area(gait):
    """Over the cells of shape space, off centre too: position in the family's frame, and the turn."""
    table = family.fit(
        scenes.load("three-link-viscous").system.velocity, gait, 1.2, 60, 128
    )
    alpha, ccf = table.ccf()
    radius = np.linalg.norm(alpha[:, 0] - gait.shape(0.0, 0.0), axis=-1)
    ring = 2 * np.pi / 128 * np.gradient(radius) * radius * (-1 if gait.reverse else 1)
    ring[-1] /= 2
    total = np.nansum(ccf * ring[:, None, None], axis=(0, 1))
    moved = table.area(1.2)
    place = se2.rotated(
        table.heading[-1, 0], *moved[:2]
    )  # the family's frame at the start, from the body's
    np.testing.assert_allclose(
        total, [*place, moved[2]], atol=0.004 * np.abs(moved).max()
    )


def test_limits_of_the_tables():
    done = []
    table = family.fit(GLASS.system.velocity, Circle(), 0.5, 6, 16, done.append)
    assert done == [1.0]
    with pytest.raises(ValueError, match="from 0 to the family's 0.5"):
        table.area([0.6])
    with pytest.raises(ValueError, match="largest amplitude"):
        family.fit(GLASS.system.velocity, Circle(), 0.0)
    with pytest.raises(
        ValueError, match="harmonics must be odd and below the number of directions"
    ):
        harmonics.fit(GLASS.system.velocity, connection.grid(2, 5), 24, highest=4)
    for highest, count in ((5, 5), (7, 5)):
        with pytest.raises(ValueError, match="below the number of directions"):
            harmonics.fit(
                GLASS.system.velocity,
                connection.grid(2, 5),
                highest=highest,
                count=count,
            )
    assert (
        harmonics.fit(
            GLASS.system.velocity, connection.grid(2, 5), highest=5, count=6
        ).highest
        == 5
    )


def random_scene(rng):
    names = [
        "glass-0.3mm-loose",
        "glass-0.3mm-close",
        "coulomb",
        "viscous-2",
        "glass-0.3mm-surface",
        "sharp",
        "blunt",
    ]
    amplitude, centre = rng.uniform(0.1, 1.4), tuple(rng.uniform(-0.5, 0.5, 2))
    series = rng.normal(size=(2, 2, 3)) * [1.0, 0.3, 0.2]
    gait = [
        Circle(amplitude=amplitude, centre=centre),
        Butterfly(amplitude=0.7 * amplitude, centre=centre),
        Fourier(amplitude=0.6 * amplitude, centre=centre, cos=series[0], sin=series[1]),
    ][rng.integers(3)]
    body = Chain(
        tuple(rng.uniform(0.4, 1.0, 3)), frame=("mean", "link-2")[rng.integers(2)]
    )
    return Scene(
        Swimmer(MEDIA[names[rng.integers(len(names))]], body),
        gait,
        Numerics(extent=4.0, grid=21),
    )


def judged(estimates, errors):
    """Coverage and median overestimate (2,), of position and heading; below 1e-12 rounding has the last word."""
    estimates, errors = np.concatenate(estimates), np.concatenate(errors)
    return np.mean(errors <= estimates + 1e-12, 0), np.median(
        estimates / np.maximum(errors, 1e-16), 0
    )


def test_direct_estimates_cover_the_truth(truths):
    """80 random scenes against 2048 phases at a regularisation of 1e-9: covered in 95 %, ten times too large at most in
    the median; positions and headings."""
    rng, estimates, errors = np.random.default_rng(7), [], []
    for _ in range(80):
        some = random_scene(rng)
        loads = ("exact", "exact", "midpoint:20")[rng.integers(3)]
        coarse = some.with_numerics(
            loads=loads, regularisation=10.0 ** rng.uniform(-6, -3)
        )
        a = np.array([some.gait.amplitude])
        poses, error = estimate.direct(
            coarse, some.gait, a, min(2 ** rng.integers(5, 9), 128)
        )
        estimates.append(error)
        true = truths(
            "estimates", exact, some.system.medium, some.system.body, some.gait, a, 1e-9
        )
        errors.append(estimate.pose_distance(poses, true, body_size(some.system.body)))
    coverage, excess = judged(estimates, errors)
    assert (coverage >= 0.95).all()
    assert (excess <= 10).all()


BY_RULES = [  # links, C, gamma0, amplitude, frame, centre: headings that two rules see half of, by chance
    ((1.467, 1.521, 0.829), 1.557, 0.2287, 1.232, "link-2", (0.156, 0.053)),
    ((1.389, 1.217, 1.404), 1.967, 0.3765, 1.678, "link-2", (-0.124, -0.201)),
    ((0.598, 1.452, 1.474), 0.406, 0.1793, 1.291, "mean", (-0.166, -0.178)),
    ((0.541, 1.007, 1.379), 0.778, 0.1301, 1.171, "link-2", (0.229, 0.214)),
    ((1.0, 1.4, 0.7), 1.8, 0.2409, 0.5, "mean", (0.0, 0.0)),
]


@dataclasses.dataclass(frozen=True)
class TractionAlone:
    """A granular law that tells no closed form."""

    C: float
    gamma0: float

    def traction(self, v_t, v_n, eps=0.0):
        return Granular(self.C, self.gamma0).traction(v_t, v_n, eps)


@pytest.mark.parametrize(
    ("lengths", "C", "gamma0", "amplitude", "frame", "centre"), BY_RULES
)
def test_estimates_between_two_rules_cover_exact_integrals(
    lengths, C, gamma0, amplitude, frame, centre
):
    gait, a = Circle(centre=centre), np.array([amplitude])
    own, exact_ = (
        Scene(Swimmer(law(C, gamma0), Chain(lengths, frame=frame)), gait)
        for law in (TractionAlone, Granular)
    )
    (poses, error), (true, _) = (
        estimate.direct(s, gait, a, 128) for s in (own, exact_)
    )
    off = estimate.pose_distance(poses, true, 1.0)
    assert (off <= error).all()
    assert (error < 12 * off.max()).all()


def test_no_estimate_is_below_rounding():
    some = scenes.load("three-link-ideal-fluid")
    error = estimate.direct(some, some.gait, np.array([0.5, 1.0]), 256)[1]
    assert (error >= 5e-16).all()


def test_estimates_of_refinement_are_neither_short_nor_long():
    """Where phases are all that is left, one error in twenty comes near its estimate: error over estimate, 30 random dry
    scenes at three amplitudes against eight times the phases."""
    rng, ratios = np.random.default_rng(21), []
    while len(ratios) < 30:
        some = random_scene(rng).with_numerics(regularisation=1e-8)
        if some.system.traits.linear:
            continue
        a = some.gait.amplitude * np.array([0.6, 0.8, 1.0])
        poses, error = estimate.direct(some, some.gait, a, 64)
        true = direct(some.system.velocity, some.gait, a, 512)
        ratios.append(estimate.distance(poses, true) / error[:, 0])
    assert 0.5 < np.percentile(ratios, 95) < 0.95
    assert 0.1 < np.median(ratios) < 0.4


def test_look_up_estimates_cover_the_truth(truths):
    rng, estimates, errors = np.random.default_rng(8), [], []
    for _ in range(12):
        some = random_scene(rng)
        a = some.gait.amplitude * np.linspace(0.3, 1.0, 4)
        true = truths(
            "estimates", exact, some.system.medium, some.system.body, some.gait, a
        )
        table = tabled(
            SceneTables(some).displacements(a, [m for m in TIERS if m != "direct"])
        )
        for tier, error in table["estimate"].items():
            estimates.append(np.stack([error, table["estimate_heading"][tier]], -1))
            errors.append(estimate.pose_distance(np.array(table[tier]), true, 1.0))
    coverage, excess = judged(estimates, errors)
    assert (coverage >= 0.95).all()
    assert (excess <= 10).all()


@pytest.mark.parametrize(
    ("off", "told"),
    [
        ({16: 0.01, 4: 0.0, 2: 0.02}, 0.02),
        ({16: 0.0, 4: 0.16, 2: 0.0}, 0.04),
        ({16: 0.0, 4: 0.1, 2: 0.1}, 0.0),
    ],
)
def test_the_error_of_pieces_is_what_halving_them_changes_or_how_that_scatters(
    off, told, monkeypatch
):
    """Of poses made up for 16, 4 and 2 pieces to a body length, where the request has 8."""
    run = lambda self, alpha, rate: SimpleNamespace(
        net=np.array([[off[self.solver.pieces], 0.0, 0.0]])
    )
    monkeypatch.setattr(Swimmer, "run", run)
    scene, cycle = (
        GLASS.changed(effects=(DepthProfile((1.0, 0.5)),)).with_numerics(pieces=8),
        Circle().cycle(8),
    )
    assert estimate.pieces_error(scene, cycle, cycle, np.zeros((1, 3)))[
        0
    ] == pytest.approx([told, 0.0])


class Known(Swimmer):
    """With a table of its own, of a body of length 1."""

    near_gait = ""

    def table(self, name):
        return (
            connection.fit(self.velocity, connection.grid(2, 4))
            if name == "connection"
            else None
        )

    def table_error(self, alpha, alphadot):
        return np.zeros((*np.shape(alpha)[:-2], 2))


def test_a_table_without_a_length_has_that_of_its_body():
    body = Chain(length=0.3)
    made, found = (
        SceneTables(Scene(kind(Viscous(2.0), body), Circle(), Numerics(grid=5))).fitted
        for kind in (Swimmer, Known)
    )
    assert len(found.axes[0]) == 4 and (found.length, found.unit) == (
        made.length,
        made.unit,
    ) == (0.3, "m")


def test_a_tier_is_one_expression(monkeypatch):
    """The constant of the connection alone, looked up where the path tier looks: predicted, counted, and judged like any."""

    def plan(system, numerics, gait, amplitudes):
        straight = lambda A, some: direct(
            lambda a, u: np.einsum("...ij,...j->...i", A(0 * a), u), gait, some, 64
        )
        return Plan(straight, fitted.table(system, numerics))

    leading = Tier(
        "leading", "A at the straight pose", {"color": "k"}, plan, joints=range(2, 3)
    )
    monkeypatch.setitem(TIERS._parts, "leading", leading)
    scene, counts = GLASS.with_numerics(grid=9), []
    study = SceneTables(scene)
    foretold = study.cost([0.05, 1.0], ["path", "leading", "direct"]).balances
    with listening(lambda samples, points, linear: counts.append(samples)):
        table = tabled(study.displacements([0.05, 1.0], ["path", "leading", "direct"]))
    assert foretold == sum(counts) and [*table["seconds"]] == [
        "field",
        "direct",
        "leading",
        "path",
    ]
    off = estimate.distance(np.array(table["leading"]), np.array(table["direct"]))
    assert (off <= table["estimate"]["leading"]).all() and off[1] > 0.01
    assert "leading" in default_tiers(scene.system)
    assert tabled(cheapest_displacements(scene, [0.05, 1.0], 1e-4))["tier"] == "direct"
    with pytest.raises(
        Refusal,
        match="the leading tier takes a body of joints, this body has 4: use direct",
    ):
        SceneTables(
            scenes.load("seven-link-wave").changed(
                body=Chain((1,) * 5), gait=Wave(joints=4)
            )
        ).plan("leading")


def test_settings_go_from_coarse_to_fine_without_a_repetition():
    for values in (
        setting.values for tier in TIERS.values() for setting in tier.settings
    ):
        steps = np.diff(values)
        assert (steps > 0).all() or (steps < 0).all()


MANY = np.linspace(0.3, 2.0, 201)


@pytest.mark.parametrize("every", [100, 2])
@pytest.mark.parametrize("tol", [1e-2, 1e-3, 1e-5])
def test_the_cheapest_tier_meets_the_tolerance(tol, every, truths):
    answer = tabled(cheapest_displacements(GLASS, MANY[::every], tol))
    (told,) = answer["estimate"].values()
    assert [*answer["estimate"]] == [answer["tier"]] and max(told) <= tol
    true = truths(
        "tiers", exact, GLASS.system.medium, GLASS.system.body, GLASS.gait, MANY
    )[::every]
    off = estimate.pose_distance(np.array(answer[answer["tier"]]), true, 1.0)
    assert off[:, 0].max() <= tol
    assert (off[:, 1] <= answer["estimate_heading"][answer["tier"]]).all()
    assert (answer["tier"] == "direct") or (every == 2 and tol >= 1e-3)


def test_a_table_pays_for_many_amplitudes_and_not_for_few():
    few, many = (
        tabled(cheapest_displacements(GLASS, np.linspace(0.3, 2.0, n), 2e-3))["tier"]
        for n in (3, 400)
    )
    assert (few, many) == ("direct", "adapted")


@pytest.mark.parametrize(
    ("error", "tier"), [([1.9e-3, 0.5], "adapted"), ([2.1e-3, 0.0], "direct")]
)
def test_the_position_decides_and_not_the_heading(error, tier, monkeypatch):
    monkeypatch.setattr(
        "geomech.studies.displacement.choose.errors_from_direct",
        lambda *_: np.tile(error, (400, 1)),
    )
    assert (
        tabled(cheapest_displacements(GLASS, np.linspace(0.3, 2.0, 400), 2e-3))["tier"]
        == tier
    )


def test_errors_of_rules_are_those_of_each_amplitude():
    """In a medium without closed integrals, where one rule is judged by another."""
    sand, a = GLASS.changed(medium=MEDIA["measured"]), np.array([0.4, 0.9, 1.4])
    (poses, error), (true, _) = (
        estimate.direct(sand.with_numerics(loads=x), Circle(), a, 64)
        for x in ("gauss:4", "gauss:64")
    )
    off = estimate.pose_distance(poses, true, 1.0)
    assert (
        error.shape == (3, 2)
        and (off <= error + 1e-12).all()
        and error.max() < 5 * off.max()
    )


def test_what_the_solver_left_counts_in_the_estimate():
    """A residual, in units of the axial drag, is a velocity of the body for 2 pi of phase: where it is what is left, the
    estimate says it, in body lengths whatever the size; likewise in rad for the heading."""
    a = np.array([0.6, 1.4])
    for length in (1.0, 0.3):
        sized = GLASS.changed(
            body=dataclasses.replace(GLASS.system.body, length=length)
        )
        lazy, run = sized.with_numerics(tolerance=0.5), None
        run = lazy.cycle(lazy.gait, a, 64)
        left = 2 * np.pi * (run.residual * run.speed)[:, None]
        _, tight = estimate.direct(sized, sized.gait, a, 64)
        poses, error = estimate.direct(lazy, lazy.gait, a, 64)
        assert left.min() > 10 * tight.max()
        assert (error >= left).all()
        off = estimate.pose_distance(
            poses, SceneTables(sized).poses("direct", None, a), length
        )
        assert (error >= off).all()
        np.testing.assert_allclose(error[:, :1], left, rtol=0.9)


def test_impossible_tolerances_are_refused():
    with pytest.raises(Refusal, match="no tier gets to 1e-15 body lengths"):
        tabled(
            cheapest_displacements(
                GLASS.with_numerics(regularisation=1e-4), [1.0], 1e-15
            )
        )
    with pytest.raises(Refusal, match="tolerance must be"):
        tabled(cheapest_displacements(GLASS, [1.0], 0.0))


def test_the_map_of_a_family_gives_each_shape_its_own_value():
    """Where nothing turns: the derivative of the velocity along the curve across the curves, at the shape it is told for."""
    gait, h = Circle(centre=(0.3, -0.2)), 1e-4
    pull = lambda alpha, rate: (
        (alpha[..., 0] ** 2 + 0.5 * alpha[..., 0] * alpha[..., 1]) * rate[..., 1]
    )
    fitted = family.fit(
        lambda *x: pull(*x)[..., None] * np.array([1.0, 0.0, 0.0]), gait, 1.0, 16, 24
    )
    alpha, ccf = fitted.ccf()
    off = alpha - gait.centre
    a = np.hypot(off[..., 0], off[..., 1])[..., None]
    with np.errstate(invalid="ignore", divide="ignore"):
        out = off / a
        along = np.stack([-out[..., 1], out[..., 0]], -1)
        up, down = (pull(gait.centre + b * out, b * along) for b in (a + h, a - h))
        wanted = (up - down) / (2 * h) / a[..., 0]
    known = np.isfinite(ccf[..., 0])
    assert known.mean() > 0.9
    np.testing.assert_allclose(ccf[known][:, 0], wanted[known], atol=1e-6)
    np.testing.assert_allclose(ccf[known][:, 1:], 0, atol=1e-12)


def test_every_amplitude_must_meet_the_tolerance(monkeypatch):
    """The refinement goes on to the largest number of phases that is allowed, for the worst of the amplitudes."""
    monkeypatch.setattr("geomech.studies.displacement.choose.MAX_PHASES", 128)
    with pytest.raises(
        Refusal, match="no tier gets to 1e-09 body lengths .* with 128 phases"
    ):
        tabled(cheapest_displacements(GLASS, [0.0, 1.0], 1e-9))


@pytest.mark.parametrize(
    ("effects", "phases"), [((), 32), ((BodyInertia(0.1, 1.0, 1.0, 1.0),), 64)]
)
def test_the_search_for_a_tier_starts_with_few_phases(effects, phases):
    scene = GLASS.changed(effects=effects).with_numerics(cycles=1)
    assert tabled(cheapest_displacements(scene, [0.5], 10.0))["settings"] == {
        "phases": phases
    }


def test_estimates_are_in_body_lengths_and_in_tables_in_the_unit_of_their_poses():
    tiny = GLASS.changed(body=dataclasses.replace(GLASS.system.body, length=1e-6))
    a = np.array([1.0])
    (poses, error), (small, same) = (
        estimate.direct(s, s.gait, a, 64) for s in (GLASS, tiny)
    )
    np.testing.assert_allclose(same, error, rtol=1e-6)
    np.testing.assert_allclose(small[:, :2], 1e-6 * poses[:, :2], rtol=1e-9)
    tables = [
        tabled(SceneTables(s.with_numerics(grid=9)).displacements(a, ["path"]))
        for s in (GLASS, tiny)
    ]
    for key, size in (
        ("estimate", 1e-6),
        ("estimate_heading", 1.0),
    ):  # against the direct tier
        small, large = (np.array(x[key]["path"]) for x in tables[::-1])
        np.testing.assert_allclose(small, size * large, rtol=1e-6, atol=1e-12 * size)


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
    found = BENCH.poses(tier, GENERIC, A)
    np.testing.assert_allclose(
        found[::-1], BENCH.poses(tier, TURNED, A), rtol=1e-9, atol=1e-12
    )
    np.testing.assert_allclose(found[:2], BENCH.poses(tier, GENERIC, A[:2]), atol=1e-12)
    np.testing.assert_allclose(found[2], 0.0, atol=1e-15)
    np.testing.assert_allclose(BENCH.poses(tier, GENERIC, [0.0, 0.0]), 0.0, atol=1e-15)
    assert np.abs(found[0] - found[-1]).max() > 1e-3
    own = dataclasses.replace(GENERIC, amplitude=-1.0)
    np.testing.assert_allclose(BENCH.poses(tier, own), found[0], rtol=1e-9, atol=1e-12)


def test_the_adapted_tier_is_near_the_truth_on_both_sides():
    truth, found = (BENCH.poses(tier, GENERIC, A) for tier in ("direct", "adapted"))
    np.testing.assert_allclose(found, truth, atol=5e-3 * np.abs(truth).max())
    table = BENCH.table("adapted", GENERIC, A)
    assert len(table.amplitudes) == 2 * BENCH.scene.numerics.curves + 1
    with pytest.raises(ValueError, match="must lie from -1 to the family's 1, got"):
        table.area([-1.1])
    alone = family.fit(GLASS.system.velocity, GENERIC, 0.0, 24, 128, least=-1.0)
    np.testing.assert_allclose(alone.area(A[:3]), found[:3], rtol=1e-9, atol=1e-12)
    shapes, values = table.ccf()
    reflected = family.fit(GLASS.system.velocity, TURNED, 1.0)
    np.testing.assert_allclose(
        values[23::-1], reflected.ccf()[1][1:], rtol=1e-6, atol=1e-9
    )
    np.testing.assert_allclose(shapes[23::-1], reflected.ccf()[0][1:], atol=1e-12)


@pytest.mark.parametrize("r", [0.1, 0.25, 0.4, 0.5, 0.8])
def test_what_is_to_come_of_further_phases_is_a_geometric_series(r):
    """Of which the changes so far tell the ratio, at most a half; where links stick at least a quarter, from the first on."""
    changes = 3e-3 * r ** np.arange(3)
    sum_from = lambda first, ratio: (
        estimate.SAFETY * first * (ratio ** np.arange(1, 100)).sum()
    )
    assert estimate._remaining_error(*changes, 0.0) == pytest.approx(
        sum_from(changes[2], min(r, 0.5))
    )
    slowest = (
        sum_from(3e-3 * max(r, 0.25) ** 2, min(max(r, 0.25), 0.5))
        if r <= 0.5
        else sum_from(changes[2], 0.5)
    )
    assert estimate._remaining_error(*changes, 0.25) == pytest.approx(slowest)
    scattered = (
        estimate._remaining_error(1e-6, 4e-3, 1e-5, 0.25),
        estimate._remaining_error(1e-6, 4e-3, 3e-3, 0.25),
    )
    assert scattered == pytest.approx((sum_from(2e-3, 0.5), sum_from(3e-3, 0.5)))


@pytest.mark.parametrize("way", [1, -1])
def test_between_amplitudes_that_are_compared_the_worse_neighbour_counts(
    way, monkeypatch
):
    """33 of 100 are compared, with the tier that has an error of its own."""
    asked, amplitudes = [], np.linspace(0.5, 1.0, 100)

    def truth(scene, gait, some, phases):
        asked.append((some, phases))
        return np.zeros((len(some), 3)), np.array([[0.5, 7.0]] * len(some))

    monkeypatch.setattr(estimate, "direct", truth)
    k, scene = (
        np.arange(100)[::way],
        SimpleNamespace(system=SimpleNamespace(length=0.2)),
    )
    poses = np.stack([0.6 * k, -0.8 * k, 2.0 * k], -1)
    found = estimate.errors_from_direct(
        scene, poses, SimpleNamespace(harmonics=9), amplitudes
    )
    ((some, phases),) = asked
    assert (len(some), phases) == (33, 72)
    compared = np.searchsorted(amplitudes, some)
    assert compared[[0, -1]].tolist() == [0, 99] and np.diff(compared).max() <= 4
    after = compared[np.searchsorted(compared, np.arange(100))]
    before = compared[np.searchsorted(compared, np.arange(100), "right") - 1]
    worse = (after if way == 1 else 99 - before).astype(float)
    np.testing.assert_allclose(
        found, np.stack([5 * worse + 0.5, 2 * worse + 7.0], -1), rtol=1e-12
    )
    estimate.errors_from_direct(
        scene, poses, SimpleNamespace(harmonics=1), amplitudes[:20]
    )
    assert (len(asked[1][0]), asked[1][1]) == (20, 64)
