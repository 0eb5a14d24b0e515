"""The march: equation of motion against an independent integrator, orders in the step,
limit cycles, hard cases."""

import numpy as np
import pytest
from by_hand import drag, middles, points
from registry import BODIES, MEDIA
from scipy.integrate import solve_ivp

from geomech import scenes
from geomech.mathematics.gaits import Butterfly, Circle, Ellipse, Sine
from geomech.mathematics.geometry.reconstruct import displacement
from geomech.mathematics.systems import Swimmer
from geomech.scenes import Scene
from geomech.studies.displacement.choose import cheapest_displacements
from geomech.studies.estimates import estimate
from geomech.studies.scene_tables import SceneTables
from rft import (
    CATALOGUE,
    Backbone,
    BodyInertia,
    Chain,
    DepthProfile,
    DisturbedGround,
    EndCaps,
    GrainInertia,
    Granular,
    SkinFriction,
    Transient,
    Viscous,
    body_velocity,
    time_steps,
)
from rft.bodies.base import body_size
from rft.core.refusal import Refusal

pytestmark = pytest.mark.usefixtures("fastest")
GLASS = CATALOGUE["glass-0.3mm-loose"].medium
SANDFISH = scenes.load("sandfish-loose")
HEAVY = Ellipse(semi_axes=(1, 0.5), tilt=0.7, centre=(0.2, -0.3))
UNEVEN = Chain((1, 2, 1.5))


def heavy(inertia):
    """Body inertia of mass x length x (rad/s)^2 / drag = inertia, none of them 1."""
    mass = inertia * 2.5 / (0.4 * (2 * np.pi * 0.7) ** 2) * (1 - 1e-15)
    return BodyInertia(mass=mass, frequency=0.7, length=0.4, drag=2.5)


@pytest.mark.parametrize("medium", MEDIA)
@pytest.mark.parametrize("body", ["uneven", "serpenoid", "backbone"])
def test_without_effects_time_stepping_is_the_balance(medium, body):
    problem = MEDIA[medium], BODIES[body]
    t = 2 * np.pi * np.arange(16) / 16
    waves = t[:, None] - np.arange(BODIES[body].joints)
    shapes = 0.4 * np.cos(waves), -0.4 * np.sin(waves)
    march = time_steps(*problem, *shapes, cycles=1, tolerance=1e-12).checked()
    balance = body_velocity(*problem, *shapes, tolerance=1e-12)
    np.testing.assert_allclose(march.xi, balance.xi, atol=1e-8)


def newton(medium, inertia, gait, cycles, eps):
    """The three-link swimmer on the ground by world momenta: place and mean heading,
    and both momenta, by an adaptive integrator; forces at the middles of fine pieces.
    Shares nothing with the march but the force law.

    Returns the motion in every cycle."""
    body, share, still = Chain(), middles(60), np.zeros(3)

    def rate(t, y):
        place, own, along = points(body, gait.shape(t), gait.rate(t), still, share)
        onto = np.exp(1j * y[2])
        # Momenta of the centre of mass and about it give its velocity and the turning
        # of the body.
        v = y[3] + 1j * y[4]
        spin = y[5] - np.mean((place.conj() * own).imag)
        spin = spin / np.mean(np.abs(place) ** 2)
        velocity = v / onto + 1j * spin * place + own
        force = -drag(medium, velocity, along, eps) / inertia
        moment = np.mean((place.conj() * force).imag)
        force = force.mean() * onto
        return [v.real, v.imag, spin, force.real, force.imag, moment]

    place, own, _ = points(body, gait.shape(0.0), gait.rate(0.0), still, share)
    start = [0, 0, 0, 0, 0, np.mean((place.conj() * own).imag)]
    times = 2 * np.pi * np.arange(cycles + 1)
    span = 0, times[-1]
    found = solve_ivp(rate, span, start, "LSODA", times, rtol=1e-8, atol=1e-10)
    x, y, theta = found.y[:3]
    z = np.diff(x + 1j * y) * np.exp(-1j * theta[:-1])
    return np.stack([z.real, z.imag, np.diff(theta)], -1)


@pytest.mark.parametrize(
    ("medium", "inertia", "eps"),
    [(Viscous(2.0), 0.5, 0.0), (Viscous(2.0), 4.0, 0.0), (GLASS, 3.0, 1e-3)],
)
def test_motion_by_an_independent_integrator(medium, inertia, eps, truths):
    gait = Circle(amplitude=1.0)
    speed = np.sqrt(np.mean(np.sum(gait.rate(np.zeros(1)) ** 2)))
    wanted = truths("newton", newton, medium, inertia, gait, 8, eps * speed)[-1]
    problem = medium, Chain(), *gait.cycle(128)
    options = {"effects": (heavy(inertia),), "regularisation": max(eps, 1e-6)}
    found = time_steps(*problem, **options).checked()
    np.testing.assert_allclose(displacement(found.xi), wanted, atol=2e-5)
    massless = displacement(body_velocity(*problem).xi)
    assert np.abs(massless - wanted).max() > 3e-4


def test_without_mass_the_joints_work_on_the_ground_alone_at_every_phase():
    alpha, alphadot = Butterfly(amplitude=0.8).cycle(32)
    effects = (
        Transient(travel_m=0.01),
        EndCaps(radius_m=0.01),
        DisturbedGround(radius_m=0.01, weakening=0.2),
    )
    body = Chain((1, 2, 1), length=0.2)
    options = {"effects": effects, "cycles": 2, "with_work": True}
    work = time_steps(GLASS, body, alpha, alphadot, **options).work
    by_joints = (work.bending_moment * alphadot).sum(-1) * 0.2
    np.testing.assert_allclose(by_joints, work.power, rtol=1e-6)


def test_with_mass_the_joints_work_on_the_ground_in_the_mean():
    alpha, alphadot = HEAVY.cycle(48)
    options = {"effects": (heavy(3.0),), "with_work": True}
    work = time_steps(GLASS, UNEVEN, alpha, alphadot, **options).checked().work
    by_joints = (work.bending_moment * alphadot).sum(-1).mean()
    assert by_joints == pytest.approx(work.power.mean(), rel=1e-3)


def test_a_tolerance_below_what_time_stepping_repeats_to_is_refused():
    with pytest.raises(Refusal, match="repeat only to 1e-06: raise tolerance"):
        cheapest_displacements(scenes.load("sandfish-transient"), [0.2], 1e-7)


def test_batches_of_any_shape_march_as_each_alone():
    effects = Transient(travel=0.04), EndCaps(radius=0.05), heavy(0.2)
    options = {"effects": effects, "cycles": 2, "tolerance": 1e-12}

    def march(amplitudes):
        shapes = Sine(elements=15).cycle(16, amplitudes)
        return time_steps(GLASS, Backbone(15), *shapes, **options)

    together = march(np.array([[0.1, 0.2], [0.3, 0.4]]))
    assert together.pose.shape == (2, 2, 17, 3)
    np.testing.assert_allclose(together.xi[1, 0], march(0.3).xi, atol=1e-9)
    assert march(np.zeros(0)).xi.shape == (0, 16, 3)


HARD = {
    "light": (heavy(1e-9),),
    "heavy": (heavy(1e3),),
    "quick to build up": (Transient(travel=1e-9),),
    "slow to build up": (Transient(travel=5.0),),
    "no drag left on the track": (DisturbedGround(radius=0.1, weakening=1.0),),
    "steep": (DepthProfile(slope=0.5, along=(0.8, 3.0)),),
    "all": (
        heavy(0.3),
        Transient(travel=0.05),
        DisturbedGround(radius=0.05, weakening=0.3),
        DepthProfile(slope=0.1),
        EndCaps(radius=0.1, tail=4.0),
    ),
}
T = 2 * np.pi * np.arange(16) / 16
HARD_GAITS = {
    "both joints alike": [np.cos(T), np.cos(T)],
    "one joint": [1.5 * np.sin(T), 0 * T],
    "pauses": [np.clip(2 * np.cos(T), -1, 1), np.clip(2 * np.sin(T), -1, 1)],
}


@pytest.mark.parametrize("case", HARD)
@pytest.mark.parametrize("medium", ["glass-0.3mm-loose", "sharp", "strong"])
def test_hard_marches_converge(case, medium):
    alpha = np.moveaxis(list(HARD_GAITS.values()), 1, -1)
    alphadot = (np.roll(alpha, -1, 1) - np.roll(alpha, 1, 1)) / (2 * T[1])
    problem = MEDIA[medium], Chain(), alpha, alphadot
    found = time_steps(*problem, effects=HARD[case], cycles=1)
    assert (found.status != "unconverged").all()
    assert found.residual.max() < 1e-9
    assert np.abs(found.xi).max() < 10


def test_the_status_tells_how_a_march_ended():
    alpha, alphadot = Circle().cycle(16)
    memory = (Transient(travel=0.3),)
    first = time_steps(GLASS, Chain(), alpha, alphadot, effects=memory, cycles=1)
    assert first.checked().status == "running"
    half = alpha[::2], alphadot[::2]
    coasting = time_steps(Viscous(2.0), Chain(), *half, effects=(heavy(1e4),))
    assert coasting.status == "not periodic"
    with pytest.raises(RuntimeError, match="give 'cycles'.* or lower the mass"):
        coasting.checked()


def periodic(effects, gait, body, phases, amplitudes):
    """Poses after a settled cycle of the sandfish, as its scene gives them."""
    scene = SANDFISH.changed(body=body, effects=effects, gait=gait)
    tables = SceneTables(scene.with_numerics(phases=phases))
    return tables.poses("direct", None, amplitudes)


@pytest.mark.parametrize(
    "effect", [Transient(travel=0.05), heavy(2.0), DepthProfile(slope=0.2)], ids=repr
)
def test_estimates_of_marches_cover_the_truth(effect, truths):
    parts = {"body": Backbone(30), "effects": (effect,), "gait": Sine(elements=30)}
    scene = SANDFISH.changed(**parts)
    a = np.array([0.12, 0.22, 0.35])
    found, *errors, _ = estimate.direct_with_error_parts(scene, scene.gait, a, 64)
    question = (effect,), scene.gait, Backbone(30), 256, a
    truth = truths("marches", periodic, *question)
    off = estimate.pose_distance(found, truth, body_size(scene.system.body))
    error = sum(errors)
    assert (off <= error).all()
    assert error.max() <= 100 * off.max()


def pieced_scene(rng, kind):
    """A random chain in a random medium on a random ellipse, with an effect that varies
    along its links."""
    media = [
        GLASS,
        Viscous(2.0),
        Granular(C=rng.uniform(0.5, 5), gamma0=rng.uniform(0.1, 0.6)),
    ]
    medium = media[rng.integers(3)]
    body = Chain(tuple(rng.uniform(0.4, 1.5, 3)))
    axes, centre = tuple(rng.uniform(0.3, 1, 2)), tuple(rng.uniform(-0.4, 0.4, 2))
    effect = {
        "transient": Transient(travel=10 ** rng.uniform(-2.5, -0.7)),
        "disturbed": DisturbedGround(
            radius=rng.uniform(0.04, 0.1), weakening=rng.uniform(0.1, 0.6)
        ),
        "depth": DepthProfile(along=tuple(rng.uniform(0.5, 2, 4))),
    }[kind]
    gait = Ellipse(semi_axes=axes, tilt=rng.uniform(0, 3), centre=centre)
    return Scene(Swimmer(medium, body, (effect,)), gait)


def second_cycle(medium, body, gait, effects, pieces, phases, amplitudes):
    scene = Scene(Swimmer(medium, body, effects), gait)
    scene = scene.with_numerics(pieces=pieces, phases=phases, tolerance=1e-9, cycles=2)
    return SceneTables(scene).poses("direct", None, amplitudes)


def errors_over_estimates(scene, pieces, truths):
    """(3, 2): of three amplitudes, in place and heading, against four times the pieces
    and phases."""
    a = np.array([0.5, 1.0, 1.4])
    coarse = scene.with_numerics(pieces=pieces, tolerance=1e-9, cycles=2)
    found, error = estimate.direct(coarse, scene.gait, a, 64)
    system = scene.system
    question = system.medium, system.body, scene.gait, system.effects, 4 * pieces, 256
    truth = truths("pieces", second_cycle, *question, a)
    return estimate.pose_distance(found, truth, 1.0) / (error + 1e-9)


@pytest.mark.parametrize(("kind", "seeds"), [("depth", range(10)), ("transient", [0])])
def test_estimates_cover_what_pieces_leave(kind, seeds, truths):
    some = [pieced_scene(np.random.default_rng(k), kind) for k in seeds]
    found = [errors_over_estimates(scene, 10, truths) for scene in some]
    assert np.max(found) <= 1
    assert np.median(found) > 0.02


@pytest.mark.soak
@pytest.mark.timeout(3000)
def test_estimates_cover_what_pieces_leave_of_many_random_chains():
    """60 scenes of three amplitudes; the row in .docs/validation.md has the first four
    of each kind."""
    ratios = []
    for kind in ("transient", "disturbed", "depth"):
        for k in range(20):
            scene = pieced_scene(np.random.default_rng([7, k]), kind)
            found = errors_over_estimates(scene, 20, lambda _, compute, *a: compute(*a))
            ratios.append(found)
        some = ratios[-20:]
        print(f"\n{kind}: {np.median(some):.2f} of the estimate, to {np.max(some):.2f}")
    assert np.mean(np.array(ratios) <= 1) >= 0.95


def test_cells_of_the_ground_do_not_keep_a_march_from_settling():
    effects = (DisturbedGround(radius=0.05, weakening=0.3),)
    shapes = Sine(elements=12).cycle(16, [0.1, 0.3])
    found = time_steps(GLASS, Backbone(12), *shapes, effects=effects).checked()
    assert (found.status == "periodic").all()


def last_of(cycles, medium, body, gait, phases, effects):
    """(phases + 1, 3): xi through the last of so many cycles, and the pose after it."""
    shapes = gait.cycle(phases)
    found = time_steps(medium, body, *shapes, effects=effects, cycles=cycles)
    return [*found.xi, found.displacement]


def test_heavy_bodies_know_how_far_they_are(truths):
    """A viscous swimmer that forgets slowly, against sixty plain cycles."""
    problem = Viscous(2.0), UNEVEN, *HEAVY.cycle(16)
    mass = (heavy(20.0),)
    limit = time_steps(*problem, effects=mass).checked()
    assert limit.cycles < 15
    question = 60, Viscous(2.0), UNEVEN, HEAVY, 16, mass
    *xi, displacement = truths("marches", last_of, *question)
    assert np.abs(limit.displacement - displacement).max() <= limit.drift + 1e-9
    np.testing.assert_allclose(limit.xi, xi, atol=2e-6)


# Net displacements of 800 plain cycles, by which they change by less than 1e-11.
FORGETS_SLOWLY = {
    (0.1, 1.0, 1.8): (-2.23546018e-04, 1.07231935e-04, -3.95975078e-04),
}


@pytest.mark.parametrize("case", FORGETS_SLOWLY)
def test_small_strokes_with_a_long_transient_reach_their_limit(case):
    """Sixty plain cycles leave 1e-5 to 1e-4."""
    size, travel, C = case
    problem = Granular(C, 0.24), Chain(), *Circle(size, centre=(0.5, 0.0)).cycle(32)
    found = time_steps(*problem, effects=[Transient(travel=travel)]).checked()
    assert (found.status == "periodic").all()
    off = np.abs(found.displacement - FORGETS_SLOWLY[case]).max()
    assert off < found.drift + 1e-8


def test_estimates_hold_what_is_left_of_the_way():
    system = Swimmer(Viscous(2.0), UNEVEN, (heavy(5.0),))
    left = system.run(*HEAVY.cycle(32)).to_come
    error = estimate.direct(Scene(system, HEAVY), HEAVY, np.array([1.0]), 32)[1]
    assert (error >= left).all()
    assert left > 0


@pytest.mark.parametrize("inertia", [300.0, 400.0])
def test_no_kick_leads_a_body_astray(inertia):
    """Drag acts between the step before a kick and the next one; a velocity far from
    the limit once led to fast spin. The displacement is that of 128 phases."""
    problem = Viscous(2.0), Chain(), *Circle(amplitude=1.2).cycle(8)
    found = time_steps(*problem, effects=(heavy(inertia),)).checked()
    assert found.cycles <= 45
    assert np.abs(found.xi).max() < 0.2
    np.testing.assert_allclose(found.displacement[:2], [-0.05785, -0.00554], atol=1e-3)


def random_march(rng):
    """A medium, a body, a batch of eight closed gaits of 16 phases, and one to four
    effects; scales over many decades."""

    def many(low, high):
        return 10 ** rng.uniform(low, high)

    media = [
        Granular(C=many(-1, 2), gamma0=np.radians(rng.uniform(1, 80))),
        Viscous(many(0, 2)),
        GLASS,
    ]
    medium = media[rng.integers(3)]
    joints = int(rng.integers(1, 6))
    lengths = tuple(many(-1, 0) for _ in range(joints + 1))
    body = Chain(lengths, frame=["mean", "link-1"][rng.integers(2)])
    waves = rng.normal(size=(4, 8, 1, joints)) * rng.uniform(0, 1.5)
    basis = np.stack([np.cos(T), np.sin(T), np.cos(2 * T), np.sin(2 * T)])
    rates = np.stack([-np.sin(T), np.cos(T), -2 * np.sin(2 * T), 2 * np.cos(2 * T)])
    alpha, alphadot = ((waves * f[:, None, :, None]).sum(0) for f in (basis, rates))
    choices = [
        heavy(many(-6, 3)),
        Transient(travel=many(-6, 0)),
        DisturbedGround(radius=many(-1.7, -0.7), weakening=rng.uniform()),
        DepthProfile(
            slope=rng.uniform(0, 0.02),
            towards=rng.uniform(-3, 3),
            along=(1.0, many(0, 1)),
        ),
        SkinFriction(*(many(-2, 0) for _ in range(3))),
        GrainInertia(frequency=many(-1, 1), length=0.3, depth=0.05),
    ]
    kept = [choices[k] for k in rng.permutation(len(choices))[: rng.integers(1, 5)]]
    kept = [e for e in kept if medium.dry or not isinstance(e, GrainInertia)]
    return medium, body, alpha, alphadot, kept


def test_fast_spinning_heavy_bodies_are_solved():
    """Three radians of spin a radian of phase, a third of a radian a step: an equation
    quadratic in the velocity was not."""
    rng = np.random.default_rng(2026)
    marches = [random_march(rng) for _ in range(344)]
    for medium, body, alpha, alphadot, effects in (marches[250], marches[343]):
        problem = medium, body, alpha[0], alphadot[0]
        time_steps(*problem, effects=effects, cycles=2, tolerance=8e-11).checked()


@pytest.mark.soak
@pytest.mark.parametrize("backend", ["numpy", "numba"])
def test_two_hundred_thousand_steps_of_random_marches(backend):
    """800 marches of eight gaits, two cycles each, to 1e-10: prints a row of
    .docs/validation.md."""
    rng = np.random.default_rng(2026)
    residuals, failures = [], 0
    for _ in range(800):
        *problem, effects = random_march(rng)
        options = {"cycles": 2, "tolerance": 8e-11, "backend": backend}
        try:
            found = time_steps(*problem, effects=effects, **options)
        except ValueError as error:
            if "reaches the surface" not in str(error):
                raise
            continue
        residuals.append(found.residual)
        failures += np.count_nonzero(found.status == "unconverged")
    residuals = np.concatenate(residuals)
    steps = residuals.size * 32
    print(
        f"\n{backend}: {steps:,} steps, {failures} failures, to {residuals.max():.1e}"
    )
    assert failures == 0


# Of circles in glass, 64 phases, that stick and slip: the changes with half, a quarter
# and an eighth of the phases are small by chance. Net poses of 1024 phases.
LUCKY = {
    0.4543302326829342: (-0.017186712687, -0.001628653204, -0.011921901768),
    0.6814122420037888: (-0.038137641698, -0.003901619935, -0.031324130269),
}


def test_errors_cover_stick_and_slip_of_a_heavy_body():
    body = Chain((0.8286411040705133, 0.6431445619053251, 0.9066951046284145))
    gait = Circle(centre=(0.3695289476837925, 0.018390673250570422))
    mass = BodyInertia(1.8664073335775546, 1 / (2 * np.pi), 1.0, 1.0)
    scene = Scene(Swimmer(GLASS, body, (mass,)), gait)
    net, error = estimate.direct(scene, gait, np.array([*LUCKY]), 64)
    off = estimate.pose_distance(net, np.array([*LUCKY.values()]), 1.0)
    assert (off < error).all()
    assert (error < 60 * off.max()).all()
