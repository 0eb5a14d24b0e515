"""Hard cases by name, crossed with every medium and body of the registry: a new one meets them all on its first day."""

import numpy as np
import pytest
from registry import BODIES, DRY, MEDIA

from geomech import predict, se2
from geomech.gaits import Butterfly, Circle, Fourier
from rft import CATALOGUE, Chain, Coulomb, Granular, Viscous, body_velocity

GLASS = CATALOGUE["glass-0.3mm-loose"].medium


def all_directions(joints, count=24):
    rng = np.random.default_rng(0)
    d = rng.normal(size=(count, joints))
    axes = np.concatenate([np.eye(joints), np.ones((1, joints)), (-1.0) ** np.arange(joints)[None]])
    return np.concatenate([d / np.linalg.norm(d, axis=1, keepdims=True), axes, -axes])


def at(pose):
    return lambda joints: (np.broadcast_to(pose(joints), (1, joints)), all_directions(joints))


HARD = {
    "at rest": lambda n: (np.linspace(-2, 2, 5)[:, None] * np.ones(n), np.zeros(n)),
    "straight": at(lambda n: np.zeros(n)),
    "almost straight": at(lambda n: 1e-9 * np.arange(1, n + 1)),
    "folded": at(lambda n: np.full(n, np.pi)),
    "folded back and forth": at(lambda n: np.pi * (-1.0) ** np.arange(n)),
    "almost folded": at(lambda n: np.full(n, np.pi - 1e-7)),
    "right angles": at(lambda n: np.full(n, np.pi / 2)),
    "curled up, stuck links": at(lambda n: np.full(n, 1.5)),
    "zigzag": at(lambda n: 2.0 * (-1.0) ** np.arange(n)),
    "slow": lambda n: (np.full(n, 0.7), 1e-12 * all_directions(n)),
    "fast": lambda n: (np.full(n, 0.7), 1e12 * all_directions(n)),
    "one joint faster by 1e8": lambda n: (np.full(n, 0.4), np.concatenate([[1.0], np.full(n - 1, 1e-8)])),
    "wound up many turns": lambda n: (np.full(n, 40.0), all_directions(n)),
}

STRANGE_BODIES = {
    "a millionth of a link": Chain((1, 1e-6, 1)),
    "a millionth at the end": Chain((1, 1, 1e-6)),
    "long and short": Chain((1, 100, 1, 100)),
    "micrometre": Chain(length=1e-6),
    "kilometre": Chain(length=1e3),
    "twelve": Chain((1,) * 12, frame="link-7"),
}


@pytest.mark.parametrize("medium", MEDIA)
@pytest.mark.parametrize("case", HARD)
def test_hard_cases(case, medium):
    for body in (BODIES | STRANGE_BODIES).values():
        alpha, alphadot = HARD[case](body.joints)
        solution = body_velocity(MEDIA[medium], body, alpha, alphadot)
        speed = np.linalg.norm(alphadot, axis=-1)
        assert (solution.status != "unconverged").all(), body
        assert solution.residual.max() < 1e-9, body
        # No body moves faster than its joints drive it.
        assert (np.abs(solution.xi) <= 3 * speed[..., None] * [body.length, body.length, 1] + 1e-300).all(), body


@pytest.mark.parametrize("links", [2, 3, 10, 50, 200])
@pytest.mark.parametrize("medium", ["glass-0.3mm-loose", "coulomb", "viscous-2", "strong"])
def test_from_two_to_two_hundred_links(links, medium):
    rng = np.random.default_rng(links)
    body, spread = Chain((1,) * links), 2.5 / np.sqrt(links)
    alpha, alphadot = rng.uniform(-spread, spread, (20, links - 1)), rng.normal(size=(20, links - 1))
    solution = body_velocity(MEDIA[medium], body, alpha, alphadot)
    assert (solution.status != "unconverged").all()
    assert solution.residual.max() < 1e-9


def test_isotropic_viscous_drag_moves_nothing():
    """Ratio 1: the drag is proportional to the momentum of a uniform body, so its centre stays where it is."""
    for gait in (Circle(), Butterfly()):
        g = predict.direct(lambda a, d: body_velocity(Viscous(1.0), Chain(), a, d).xi, gait)
        assert np.abs(g[:2]).max() < 1e-15


def test_large_ratios_approach_the_kinematic_limit():
    """Ratio -> infinity: the body moves so that the mean square of sideways slip is least, order 1 in 1/ratio."""
    rng, body = np.random.default_rng(3), Chain((1, 2, 1), frame="link-2")
    alpha, alphadot = rng.uniform(0.5, 2.0, (20, 2)), rng.normal(size=(20, 2))
    motion = body.motion(alpha.T, alphadot.T)
    limit = []
    for b in range(20):
        J = np.stack([motion.carried(e[:, None] * np.ones(20))[1:, :, b].ravel() for e in np.eye(3)], 1)
        weight = np.sqrt(np.concatenate([motion.half[:, 0], motion.half[:, 0] / 3]))
        limit.append(np.linalg.lstsq(weight[:, None] * J, -weight * motion.v[1:, :, b].ravel(), rcond=None)[0])
    ratios = np.array([1e3, 1e4, 1e5, 1e6])
    off = [np.abs(body_velocity(Viscous(r), body, alpha, alphadot).xi - limit).max() for r in ratios]
    assert -np.polyfit(np.log(ratios), np.log(off), 1)[0] == pytest.approx(1.0, abs=0.05)
    assert np.abs(body_velocity(Viscous(1e8), body, alpha, alphadot).xi - limit).max() < 1e-5


@pytest.mark.parametrize("amplitude", [1e-6, 1e-4, 1e-2])
def test_tiny_gaits_keep_their_digits(amplitude):
    g = predict.direct(lambda a, d: body_velocity(Viscous(2.0), Chain(frame="link-2"), a, d).xi, Circle(), [amplitude])
    limit = 5 / 243 * np.pi * amplitude**2
    assert np.hypot(*g[0, :2]) == pytest.approx(limit, rel=1e-8 + amplitude**2)


def test_tiny_gaits_in_sand():
    """Displacement per area settles as the circle shrinks, down to a millionth of a radian."""
    radii = np.array([1e-2, 1e-3, 1e-4, 1e-5, 1e-6])
    g = predict.direct(
        lambda a, d: body_velocity(GLASS, Chain((1, 1, 1.1)), a, d).checked().xi, Circle(centre=(0.7, -0.4)), radii
    )
    per_radius = np.hypot(g[:, 0], g[:, 1]) / radii**2
    np.testing.assert_allclose(per_radius[2:], per_radius[1], rtol=0.02)


@pytest.mark.parametrize("medium", MEDIA)
def test_scallops_go_nowhere(medium):
    """A gait of no area, and every gait followed by its reversal."""
    velocity = lambda a, d: body_velocity(MEDIA[medium], Chain((1, 1.3, 0.8)), a, d).checked().xi
    scallop = Fourier(centre=(0.3, 0.5), cos=((1.0,), (0.6,)), sin=((0.0,), (0.0,)))
    assert np.abs(predict.direct(velocity, scallop, phases=64)).max() < 1e-9
    forth, back = (predict.direct(velocity, Circle(amplitude=0.8, reverse=r), phases=64) for r in (False, True))
    np.testing.assert_allclose(se2.compose(forth, back), 0, atol=1e-9)


@pytest.mark.parametrize("medium", ["glass-0.3mm-loose", "coulomb", "glass-0.3mm-close"])
def test_stuck_samples_approach_the_limit_monotonically(medium):
    rng = np.random.default_rng(11)
    alpha, alphadot = rng.uniform(-2.8, 2.8, (2000, 2)), rng.normal(size=(2000, 2))
    stuck = body_velocity(MEDIA[medium], Chain(), alpha, alphadot).status == "stuck"
    assert 10 < stuck.sum() < 400
    alpha, alphadot = alpha[stuck], alphadot[stuck]
    solve = lambda eps: body_velocity(MEDIA[medium], Chain(), alpha, alphadot, regularisation=eps).checked()
    limit = solve(1e-10).xi
    levels = [1e-3, 1e-4, 1e-5, 1e-6, 1e-7]
    off = np.array([np.linalg.norm(solve(eps).xi - limit, axis=-1) for eps in levels])
    assert (np.diff(off, axis=0) < 1e-12).all()
    slope = np.polyfit(np.log(levels), np.log(np.median(off, axis=1)), 1)[0]
    assert slope == pytest.approx(1.0, abs=0.1)  # the regularisation is of order 1


@pytest.mark.parametrize("medium", ["glass-0.3mm-loose", "coulomb", "sharp"])
def test_the_status_is_that_of_the_limit(medium):
    """Stuck or sliding is decided at 1e-6 as it is ten thousand times nearer to the limit, but for links about to slip."""
    rng = np.random.default_rng(12)
    alpha, alphadot = rng.uniform(-2.8, 2.8, (4000, 2)), rng.normal(size=(4000, 2))
    near, limit = (body_velocity(MEDIA[medium], Chain(), alpha, alphadot, regularisation=e) for e in (1e-6, 1e-10))
    assert np.mean(near.status != limit.status) < 0.005


@pytest.mark.parametrize("medium", DRY)
def test_regularisation_is_reported_by_what_it_changes(medium):
    """Where all links slide, ten times less regularisation changes next to nothing."""
    rng = np.random.default_rng(13)
    alpha, alphadot = rng.uniform(-1.5, 1.5, (300, 2)), rng.normal(size=(300, 2))
    alphadot /= np.linalg.norm(alphadot, axis=1, keepdims=True)
    one, finer = (body_velocity(DRY[medium], Chain(), alpha, alphadot, regularisation=e) for e in (1e-6, 1e-7))
    sliding = one.status == "sliding"
    assert np.median(np.abs(one.xi - finer.xi)[sliding]) < 1e-8


def random_problem(rng):
    links = rng.integers(2, 13)
    body = Chain(
        tuple(10.0 ** rng.uniform(-1, 0, links)), frame=("mean", f"link-{rng.integers(1, links + 1)}")[rng.integers(2)]
    )
    medium = [
        Granular(10.0 ** rng.uniform(-2, 3), np.radians(10.0 ** rng.uniform(-1, 1.95))),
        Granular(rng.uniform(0.5, 4), np.radians(rng.uniform(5, 30))),
        Coulomb(),
        Viscous(10.0 ** rng.uniform(-1, 3)),
    ][rng.choice(4, p=[0.4, 0.4, 0.15, 0.05])]
    spread = min(np.pi, 6.0 / np.sqrt(links))
    return medium, body, rng.uniform(-spread, spread, (500, links - 1)), rng.normal(size=(500, links - 1))


@pytest.mark.soak
def test_a_hundred_thousand_random_problems():
    """200 media and bodies, 500 samples each, to a normalised residual of 1e-10: prints the README's reliability row."""
    rng = np.random.default_rng(2026)
    residuals, iterations, stuck, failures = [], [], 0, 0
    for _ in range(200):
        medium, body, alpha, alphadot = random_problem(rng)
        solution = body_velocity(medium, body, alpha, alphadot, tolerance=8e-11)
        residuals.append(solution.residual)
        iterations.append(solution.iterations)
        stuck += np.count_nonzero(solution.status == "stuck")
        failures += np.count_nonzero(~(solution.residual <= 1e-10))
    residuals, iterations = np.concatenate(residuals), np.concatenate(iterations)
    print(f"\n{residuals.size:,} problems: {failures} failures, worst residual {residuals.max():.1e}, {stuck:,} stuck,")
    print(
        f"iterations mean {iterations.mean():.1f}, 99 % {np.percentile(iterations, 99):.0f}, worst {iterations.max()}"
    )
    assert failures == 0
