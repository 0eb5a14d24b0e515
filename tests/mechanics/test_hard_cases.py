"""Hard cases by name, crossed with every law and body of the registry: a new one meets
them all on its first day."""

import dataclasses

import numpy as np
import pytest
from registry import BODIES, CLOSED, LINEAR, MEDIA

from geomech.mathematics.gaits import Butterfly, Circle, Fourier
from geomech.mathematics.geometry import coordinates
from geomech.mathematics.tiers.direct import direct
from rft import (
    CATALOGUE,
    Chain,
    Coulomb,
    Granular,
    LeggedChain,
    Viscous,
    body_velocity,
)
from rft.balance import backend
from rft.balance.arrays import solve
from rft.bodies.base import body_size
from rft.effects.contact import assemble
from rft.formulas import se2
from rft.formulas.newton import Descent, Limits

pytestmark = pytest.mark.usefixtures("fastest")

GLASS = CATALOGUE["glass-0.3mm-loose"].medium


def all_directions(joints, count=4):
    rng = np.random.default_rng(0)
    d = rng.normal(size=(count, joints))
    axes = np.concatenate(
        [np.eye(joints), np.ones((1, joints)), (-1.0) ** np.arange(joints)[None]]
    )
    return np.concatenate([d / np.linalg.norm(d, axis=1, keepdims=True), axes, -axes])


def at(pose):
    return lambda joints: (
        np.broadcast_to(pose(joints), (1, joints)),
        all_directions(joints),
    )


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
    "one joint faster by 1e8": lambda n: (
        np.full(n, 0.4),
        np.concatenate([[1.0], np.full(n - 1, 1e-8)]),
    ),
    "wound up many turns": lambda n: (np.full(n, 40.0), all_directions(n)),
    "at random": lambda n: (
        np.random.default_rng(n).normal(size=(2, 60, n)) * [[[2.0]], [[1.0]]]
    ),
}

SOME_LAWS = (
    "coulomb",
    "sharp",
    "strong",
    "viscous-1",
    "measured",
)  # for large and strange bodies: others are between these
STRANGE_BODIES = {
    "a millionth of a link": Chain((1, 1e-6, 1)),
    "a millionth at the end": Chain((1, 1, 1e-6)),
    "long and short": Chain((1, 100, 1, 100)),
    "micrometre": Chain(length=1e-6),
    "kilometre": Chain(length=1e3),
    "twelve": Chain((1,) * 12, frame="link-7"),
}


def hard(joints, ill):
    """Names, alpha and alphadot of all samples of HARD; those at random are for bodies
    that are not badly conditioned."""
    names = [name for name in HARD if not ill or name != "at random"]
    problems = [
        np.broadcast_arrays(*map(np.atleast_2d, HARD[name](joints))) for name in names
    ]
    return np.repeat(names, [len(alpha) for alpha, _ in problems]), *(
        np.concatenate(x) for x in zip(*problems)
    )


def apart(one, other, alphadot, body):
    """(...,): how far body velocities differ, over the joints' speed."""
    speed = np.linalg.norm(alphadot, axis=-1, keepdims=True) + 1e-300
    return (
        np.abs(one.xi - other.xi) / [body_size(body), body_size(body), 1.0] / speed
    ).max(-1)


ILL_CONDITIONED = ("a millionth of a link", "twelve")


@pytest.mark.parametrize("name", BODIES | STRANGE_BODIES)
def test_hard_cases(name):
    """By NumPy, three links in every medium, the others in some; and compiled code
    gives the same, to 1e-10. A link of a millionth, or twelve that lie upon each other,
    make a balance so badly conditioned at the usual regularisation that its residual
    leaves the sixth digit open; there the two are compared at a wider one."""
    body, ill = (BODIES | STRANGE_BODIES)[name], name in ILL_CONDITIONED
    backends = ("numpy", "numba") if backend.installed() else ("numpy",)
    for label, medium in (
        MEDIA if name == "three" else {label: MEDIA[label] for label in SOME_LAWS}
    ).items():
        some = slice(
            None, None, 1 if body.joints < 5 or label in CLOSED else 3
        )  # quadrature takes its time
        cases, alpha, alphadot = (x[some] for x in hard(body.joints, ill))
        # One that stands on two feet near each other turns faster.
        most = 6 if isinstance(body, LeggedChain) else 3
        fastest = (
            most
            * np.linalg.norm(alphadot, axis=-1, keepdims=True)
            * [body_size(body), body_size(body), 1]
            + 1e-300
        )
        for regularisation in (1e-6, 1e-3)[: 1 + ill]:
            given = {"regularisation": regularisation}
            found = [
                body_velocity(medium, body, alpha, alphadot, backend=b, **given)
                for b in backends
            ]
            plain = found[0]
            bad = (plain.status == "unconverged") | ~(plain.residual < 1e-9)
            assert not bad.any(), (label, set(cases[bad]))
            if label in LINEAR:
                assert (plain.iterations[cases != "at rest"] == 1).all()
            bad = (np.abs(plain.xi) > fastest).any(
                -1
            )  # no body moves faster than its joints drive it
            assert not bad.any(), (label, set(cases[bad]))
            for fast in found[1:]:
                assert (plain.status == fast.status).all()
                assert fast.residual.max() < 1e-9
                differ = np.sum(
                    plain.iterations != fast.iterations
                )  # steps, by rounding where that is amplified
                assert differ <= max(
                    1, (0.02 if ill else 0.001) * plain.iterations.size
                )
                bad = (apart(plain, fast, alphadot, body) > 1e-10) & (
                    not ill or regularisation > 1e-6
                )
                assert not bad.any(), (label, set(cases[bad]))


@pytest.mark.usefixtures("solved_by")
@pytest.mark.parametrize("links", [2, 3, 10, 50, 200])
@pytest.mark.parametrize(
    "medium", ["glass-0.3mm-loose", "coulomb", "viscous-2", "strong"]
)
def test_from_two_to_two_hundred_links(links, medium):
    rng, spread = np.random.default_rng(links), 2.5 / np.sqrt(links)
    alpha = rng.uniform(-spread, spread, (20, links - 1))
    alphadot = rng.normal(size=(20, links - 1))
    found = body_velocity(MEDIA[medium], Chain((1,) * links), alpha, alphadot)
    assert (found.status != "unconverged").all()
    assert found.residual.max() < 1e-9


def test_isotropic_viscous_drag_moves_nothing():
    """Ratio 1: the drag is proportional to the momentum of a uniform body, so its
    centre stays where it is."""
    for gait in (Circle(), Butterfly()):
        g = direct(lambda a, d: body_velocity(Viscous(1.0), Chain(), a, d).xi, gait)
        assert np.abs(g[:2]).max() < 1e-15


@pytest.mark.parametrize("amplitude", [1e-6, 1e-4, 1e-2])
def test_tiny_gaits_keep_their_digits(amplitude):
    g = direct(
        lambda a, d: body_velocity(Viscous(2.0), Chain(frame="link-2"), a, d).xi,
        Circle(),
        [amplitude],
    )
    limit = 5 / 243 * np.pi * amplitude**2
    assert np.hypot(*g[0, :2]) == pytest.approx(limit, rel=1e-8 + amplitude**2)


@pytest.mark.parametrize("medium", MEDIA)
def test_scallops_go_nowhere(medium):
    """A gait of no area, and every gait followed by its reversal."""

    def velocity(a, d):
        return body_velocity(MEDIA[medium], Chain((1, 1.3, 0.8)), a, d).checked().xi

    scallop = Fourier(centre=(0.3, 0.5), cos=((1.0,), (0.6,)), sin=((0.0,), (0.0,)))
    assert np.abs(direct(velocity, scallop, phases=64)).max() < 1e-9
    forth, back = (
        direct(velocity, Circle(amplitude=0.8, reverse=r), phases=64)
        for r in (False, True)
    )
    np.testing.assert_allclose(se2.compose(forth, back), 0, atol=1e-9)


@pytest.mark.parametrize(
    "medium", ["glass-0.3mm-loose", "coulomb", "glass-0.3mm-close"]
)
def test_stuck_samples_approach_the_limit(medium):
    rng = np.random.default_rng(11)
    shapes = rng.uniform(-2.8, 2.8, (2000, 2)), rng.normal(size=(2000, 2))
    problem = MEDIA[medium], Chain()
    stuck = body_velocity(*problem, *shapes).status == "stuck"
    levels = [1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-10]
    *xi, limit = (
        body_velocity(*problem, *(x[stuck] for x in shapes), regularisation=e).xi
        for e in levels
    )
    errors = np.linalg.norm(np.array(xi) - limit, axis=-1)
    middle = np.log(np.median(errors, axis=1))
    order = np.polyfit(np.log(levels[:5]), middle, 1)[0]
    assert order == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("ratio", [1e4, 1e6])
def test_velocities_keep_digits_at_large_ratios(ratio):
    """Forces cancel to 1e-14 of the largest, so residuals grow with the ratio;
    velocities of the mirrored body, of other roundoff, stay equal."""
    alpha, alphadot = np.random.default_rng(1).uniform(-2.8, 2.8, (2, 200, 2))
    found, mirrored = (
        body_velocity(Granular(ratio, 0.24), Chain(), sign * alpha, sign * alphadot)
        for sign in (1, -1)
    )
    assert (found.status != "unconverged").all()
    assert (found.residual <= 1e-10 + 1e-14 * ratio * 5).all()
    assert np.abs(found.xi - mirrored.xi * [1, -1, -1]).max() < 1e-12


# Curves of solutions that fold on the way to the wanted rounding: a descent that only
# lowers it falls off.
FOLDS = {
    "uneven": (
        (
            Granular(8.081366032651289, 0.6101439803612351),
            Chain((0.77, 0.44, 1.82), frame="link-2"),
        ),
        (
            (1.4618952868928987, 1.0483336749944137),
            (2.852759416671848, -0.013853068453873112),
        ),
    ),
    "even": (
        (Granular(8, np.radians(35)), Chain()),
        ((-1.47053323, -1.9356507), (-0.99735926, -0.07262584)),
    ),
    "sharp turn": (
        (
            Granular(5.980265998691821, 0.6236043450543391),
            Chain((0.71646314, 0.60005133, 0.33690735)),
        ),
        ((-2.672321485415303, -1.7777827133167854), (-0.0006543260192958726, -1.0)),
    ),
    "five links": (
        (
            Granular(27.75370146097607, 1.244926847635884),
            Chain((1.31967198, 0.19320949, 1.36708407, 1.68819898, 1.0321)),
        ),
        (
            (
                2.404695543137478,
                -0.1323310137498579,
                0.6528898645336709,
                2.6018260660472747,
            ),
            (0.0, -1.0, 0.0006417417292624078, 0.0),
        ),
    ),
}


def in_all_frames(medium, body, alpha, alphadot):
    """(xi, solution) in every link's frame, xi told in the mean frame; the mean frame's
    own first."""
    mean = dataclasses.replace(body, frame="mean")
    found = body_velocity(medium, mean, alpha, alphadot)
    yield found.xi, found
    for link in range(len(body.lengths)):
        body = dataclasses.replace(body, frame=f"link-{link + 1}")
        found = body_velocity(medium, body, alpha, alphadot)
        yield (
            coordinates.change_velocity(
                found.xi, *body.frame_pose("mean", alpha, alphadot)
            ),
            found,
        )


@pytest.mark.parametrize("name", FOLDS)
def test_folds(name):
    problem = (*FOLDS[name][0], *FOLDS[name][1])
    (wanted, first), *others = in_all_frames(*problem)
    assert first.checked().iterations <= 200
    for xi, found in others:
        np.testing.assert_allclose(xi, wanted, atol=1e-10)
        assert (found.status, found.iterations) == (first.status, first.iterations)
    finer = body_velocity(*problem, regularisation=1e-8, tolerance=1e-12).checked()
    again = body_velocity(*problem, tolerance=1e-12).checked()
    np.testing.assert_allclose(
        again.xi, finer.xi, atol=3e-4
    )  # the same branch: at a fold they part by much more


WAY_BACK = (
    Granular(9.802017159410523, 0.6491130281674442),
    Chain((1.354941115666729, 0.930051062795154, 0.2800145133387486, 1.59170403904621)),
)


def test_walks_that_take_the_way_back_are_begun_anew(solved_by):
    """A quarter of the walks here turn at a fold, to wide rounding again, whatever
    their steps, and one in twenty by both of the lengths that come first; there is one
    solution."""
    alpha = np.array([2.0689235254797094, -0.6492379591456583, 2.888801367122009])
    rates = np.array([1.0024224503820196, 0.5617545614948484, 0.13544073178888066])
    (wanted,) = solutions(*WAY_BACK, alpha, rates, 1e-6, 500)
    alpha = alpha + np.random.default_rng(4).uniform(-1e-6, 1e-6, (300, 3))
    found = body_velocity(*WAY_BACK, alpha, rates, backend=solved_by).checked()
    np.testing.assert_allclose(found.xi - np.linalg.norm(rates) * wanted, 0, atol=1e-5)


@pytest.mark.parametrize("name", FOLDS)
def test_neighbours_of_folds(name):
    """As many as share a batch: the way out is not for a few samples only."""
    rng = np.random.default_rng(4)
    alpha, alphadot = (
        np.array(x) + rng.uniform(-1e-4, 1e-4, (300, len(x))) for x in FOLDS[name][1]
    )
    found = body_velocity(*FOLDS[name][0], alpha, alphadot).checked()
    assert found.iterations.max() <= 200


def hard_problem(rng, count):
    """Laws that are far from monotone, and half of the rates along the axis of a joint,
    or nearly."""
    links = rng.integers(3, 6)
    frame = ("mean", f"link-{rng.integers(1, links + 1)}")[rng.integers(2)]
    body = Chain(tuple(10.0 ** rng.uniform(-1, 0.3, links)), frame=frame)
    medium = Granular(
        10.0 ** rng.uniform(0, np.log10(50)), np.radians(rng.uniform(10, 85))
    )
    spread = min(np.pi, 6.0 / np.sqrt(links))
    alpha, alphadot = (
        rng.uniform(-spread, spread, (count, links - 1)),
        rng.normal(size=(count, links - 1)),
    )
    one = 10.0 ** rng.uniform(-8, -1, alpha.shape) * rng.choice(
        [-1, 0, 1], size=alpha.shape
    )
    one[np.arange(count), rng.integers(0, links - 1, count)] = rng.choice(
        [-1, 1], count
    )
    return medium, body, alpha, np.where(rng.random((count, 1)) < 0.5, one, alphadot)


def solutions(medium, body, alpha, alphadot, regularisation, starts):
    """Body velocities (k, 3), in the mean frame per |alphadot|, that Newton's method
    finds from random starts."""
    rng = np.random.default_rng(6)
    rates = np.divide(alphadot, np.linalg.norm(alphadot))
    shapes = (np.array(x)[:, None] * np.ones(starts) for x in (alpha, rates))
    assembly = assemble(medium, dataclasses.replace(body, frame="mean"))
    problem, limits = assembly.problem(*shapes), Limits(regularisation, 1e-10)
    found = np.zeros((0, 3))
    for widest in (0.0, 1e-4, 1e-3, 1e-2):
        guess = rng.normal(size=(3, starts)) * [[0.3], [0.3], [1.0]]
        guess *= 10.0 ** rng.uniform(-4, 0, starts)
        first = max(widest, regularisation)
        descent = Descent(first, 0.1, 1e-4, np.inf, 100.0)
        with np.errstate(all="ignore"):  # some starts lead nowhere
            *xi, residual, _, _ = solve(problem, descent, limits, guess)
        for one in np.transpose(xi)[residual <= limits.residual]:
            distances = np.abs(found - one).max(-1, initial=0.0)
            if (distances > 10 * regularisation).all():
                found = np.concatenate([found, one[None]])
    return found


@pytest.mark.parametrize(("regularisation", "count"), [(1.5e-4, 3), (1e-6, 1)])
def test_between_folds_there_are_three_solutions(regularisation, count):
    """And the one on the curve's first part is taken, which slides most: the curve
    comes from wide rounding, where the body hardly feels its kinks. At the usual
    rounding there is one."""
    (medium, body), shapes = FOLDS["uneven"]
    problem = medium, dataclasses.replace(body, frame="mean"), *shapes
    taken = body_velocity(*problem, regularisation=regularisation).xi
    found = solutions(*problem, regularisation, 500)
    assert len(found) == count
    first = found[found[:, 0].argmin()]
    np.testing.assert_allclose(first, taken / np.linalg.norm(shapes[1]), atol=1e-7)


def test_of_three_solutions_at_the_usual_rounding_the_first_is_taken(solved_by):
    """Which follows from the viscous one without a jump as the rounding falls."""
    alpha = 2.0688404, -0.6491862, 2.8888857
    rates = 1.0025004, 0.561798, 0.1355264
    problem = *WAY_BACK, alpha, rates
    found = solutions(*problem, 1e-6, 300)
    assert len(found) == 3
    start = np.zeros(3)
    for rounding in np.geomspace(10.0, 1e-6, 250):
        asked = {"start": start, "regularisation": rounding, "backend": solved_by}
        start = body_velocity(*problem, **asked).xi
    taken = body_velocity(*problem, backend=solved_by).xi
    np.testing.assert_allclose(taken, start, rtol=0, atol=1e-8)
    first = found[np.abs(found[:, 2]).argmin()]
    np.testing.assert_allclose(taken / np.linalg.norm(rates), first, atol=1e-7)


def random_problem(rng, count):
    links = rng.integers(2, 13)
    body = Chain(
        tuple(10.0 ** rng.uniform(-1, 0, links)),
        frame=("mean", f"link-{rng.integers(1, links + 1)}")[rng.integers(2)],
    )
    medium = [
        Granular(10.0 ** rng.uniform(-2, 3), np.radians(10.0 ** rng.uniform(-1, 1.95))),
        Granular(rng.uniform(0.5, 4), np.radians(rng.uniform(5, 30))),
        Coulomb(),
        Viscous(10.0 ** rng.uniform(-1, 3)),
    ][rng.choice(4, p=[0.4, 0.4, 0.15, 0.05])]
    spread = min(np.pi, 6.0 / np.sqrt(links))
    return (
        medium,
        body,
        rng.uniform(-spread, spread, (count, links - 1)),
        rng.normal(size=(count, links - 1)),
    )


@pytest.mark.soak
@pytest.mark.parametrize("backend", ["numpy", "numba"])
@pytest.mark.parametrize(
    ("problem", "batches"), [(random_problem, 400), (hard_problem, 1600)]
)
def test_a_million_random_problems(problem, batches, backend):
    """Media and bodies, 500 samples each, to a normalised residual of 1e-10: prints
    rows of .docs/validation.md."""
    rng = np.random.default_rng(2026)
    residuals, iterations, stuck = [], [], 0
    for _ in range(batches):
        solution = body_velocity(*problem(rng, 500), tolerance=8e-11, backend=backend)
        residuals.append(solution.residual)
        iterations.append(solution.iterations)
        stuck += np.count_nonzero(solution.status == "stuck")
    residuals, iterations = np.concatenate(residuals), np.concatenate(iterations)
    failures = np.count_nonzero(~(residuals <= 1e-10))
    print(
        f"\n{backend}: {residuals.size:,} problems: {failures} failures, residuals to"
        f" {residuals.max():.1e}, {stuck:,} stuck; iterations mean"
        f" {iterations.mean():.1f}, 99 % {np.percentile(iterations, 99):.0f}, worst"
        f" {iterations.max()}"
    )
    assert failures == 0
    assert iterations.max() <= 200


@pytest.mark.soak
def test_no_sample_has_several_solutions():
    """A thousand starts at each of forty samples that no descent solves, and at the
    folds above: one solution each, and it is the one that is taken."""
    rng, samples = np.random.default_rng(8), [(*law, *at) for law, at in FOLDS.values()]
    while len(samples) < 40 + len(FOLDS):
        medium, body, alpha, alphadot = hard_problem(rng, 500)
        tries = body_velocity(medium, body, alpha, alphadot).iterations
        hard = np.flatnonzero(tries > 60)
        samples += [(medium, body, alpha[k], alphadot[k]) for k in hard]
    missed = 0
    for medium, body, *shapes in samples:
        mean = dataclasses.replace(body, frame="mean")
        taken = body_velocity(medium, mean, *shapes).xi / np.linalg.norm(shapes[1])
        found = solutions(medium, mean, *shapes, 1e-6, 1000)
        assert len(found) <= 1, (medium, body, shapes, found)
        missed += len(found) == 0
        np.testing.assert_allclose(found, 0 * found + taken, atol=1e-5)
    print(f"\n{len(samples)} samples, one solution each; no start led to {missed}")
    assert missed < len(samples) / 2


def test_the_frame_does_not_matter():
    rng = np.random.default_rng(77)
    for _ in range(5):
        problem = hard_problem(rng, 100)
        (wanted, first), *others = in_all_frames(*problem)
        speed = np.linalg.norm(problem[3], axis=-1, keepdims=True)
        for xi, found in others:
            assert np.abs((xi - wanted) / speed).max() < 1e-10
            assert (found.status == first.status).all()
            assert np.mean(found.iterations != first.iterations) < 0.02
