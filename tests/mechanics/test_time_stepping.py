"""The march: equation of motion against an independent integrator, orders in the step, hard cases, refusals."""

import numpy as np
import pytest
from registry import BODIES, MEDIA
from scipy.integrate import solve_ivp
from tabled import tabled

from geomech import scenes
from geomech.mathematics.gaits import Butterfly, Circle, Ellipse, Sine
from geomech.mathematics.geometry.reconstruct import displacement
from geomech.mathematics.systems import Swimmer
from geomech.scenes import Scene
from geomech.studies.displacement import tiered
from geomech.studies.displacement.batch import joined_scene
from geomech.studies.displacement.choose import cheapest_displacements
from geomech.studies.estimates import estimate
from geomech.studies.mechanics import undulation
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
    work_done,
)
from rft.balance.solver import Accuracy
from rft.bodies.base import body_size, half_lengths
from rft.core.refusal import Refusal
from rft.effects.contact import assemble
from rft.formulas.se2 import compose, exp
from rft.motion import limit_cycle
from rft.motion.stepping import Stepping

pytestmark = pytest.mark.usefixtures("fastest")
GLASS = CATALOGUE["glass-0.3mm-loose"].medium
SANDFISH = scenes.load("sandfish-loose")


def heavy(inertia):
    """Body inertia of mass x length x (rad/s)^2 / drag = inertia, none of them 1."""
    mass = inertia * 2.5 / (0.4 * (2 * np.pi * 0.7) ** 2) * (1 - 1e-15)
    return BodyInertia(mass=mass, frequency=0.7, length=0.4, drag=2.5)


@pytest.mark.parametrize("medium", MEDIA)
def test_without_effects_time_stepping_is_the_balance(medium):
    for body in (BODIES["uneven"], BODIES["serpenoid"], BODIES["backbone"]):
        t = 2 * np.pi * np.arange(16) / 16
        k = np.arange(body.joints)
        alpha, alphadot = 0.4 * np.cos(t[:, None] - k), -0.4 * np.sin(t[:, None] - k)
        found = time_steps(
            MEDIA[medium], body, alpha, alphadot, cycles=1, tolerance=1e-12
        ).checked()
        wanted = body_velocity(MEDIA[medium], body, alpha, alphadot, tolerance=1e-12).xi
        np.testing.assert_allclose(found.xi, wanted, atol=1e-8)


def newton(medium, inertia, gait, cycles, eps):
    """The three-link swimmer on the ground by world momenta: x, y, heading of the first link and both momenta, by an
    adaptive integrator; forces by the midpoints of fine pieces. Shares nothing with the march but the force law.

    Returns the pose of the centre of mass and mean heading at the end of every cycle."""
    pieces = 60
    offset = ((np.arange(pieces) + 0.5) / pieces - 0.5) / 3

    def parts(t, theta):
        alpha, rate = gait.shape(t), gait.rate(t)
        heading = theta + np.concatenate([[0.0], np.cumsum(alpha)])
        turn = np.concatenate([[0.0], np.cumsum(rate)])
        unit = np.exp(1j * heading)
        centre = np.cumsum(unit / 3) - unit / 6
        flow = (
            np.cumsum(1j * turn * unit / 3) - 1j * turn * unit / 6
        )  # while the first link keeps its heading
        place = centre[:, None] + offset * unit[:, None]
        velocity = flow[:, None] + offset * (1j * turn * unit)[:, None]
        middle = place.mean()
        return unit, place - middle, velocity - velocity.mean()

    def rate(t, y):
        unit, place, velocity = parts(t, y[2])
        # Momenta of the centre of mass and about it give its velocity and the turning of the first link.
        v = y[3] + 1j * y[4]
        spin = (y[5] - np.mean((place.conj() * velocity).imag)) / np.mean(
            np.abs(place) ** 2
        )
        flow = v + 1j * spin * place + velocity
        along = (flow * unit.conj()[:, None]).real
        across = (flow * unit.conj()[:, None]).imag
        f_t, f_n = medium.traction(along, across, eps)
        force = -(f_t + 1j * f_n) * unit[:, None] / inertia
        moment = np.mean((place.conj() * force).imag)
        return [v.real, v.imag, spin, force.mean().real, force.mean().imag, moment]

    _, place, velocity = parts(0.0, -gait.shape(0.0) @ [2 / 3, 1 / 3])
    start = [
        0.0,
        0.0,
        -gait.shape(0.0) @ [2 / 3, 1 / 3],
        0.0,
        0.0,
        np.mean((place.conj() * velocity).imag),
    ]
    times = 2 * np.pi * np.arange(cycles + 1)
    found = solve_ivp(
        rate, (0, times[-1]), start, "LSODA", times, rtol=1e-8, atol=1e-10
    )
    assert found.success
    x, y, theta = found.y[:3]
    theta = theta + gait.shape(0.0) @ [2 / 3, 1 / 3]
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
    alpha, alphadot = gait.cycle(128)
    found = time_steps(
        medium,
        Chain(),
        alpha,
        alphadot,
        effects=(heavy(inertia),),
        regularisation=max(eps, 1e-6),
    ).checked()
    np.testing.assert_allclose(displacement(found.xi), wanted, atol=2e-5)
    plain = displacement(body_velocity(medium, Chain(), alpha, alphadot).xi)
    assert np.abs(plain - wanted).max() > 3e-4  # mass matters here


def test_a_body_in_almost_nothing_keeps_its_momentum():
    """With a millionth of drag the momentum over the ground stays what it was at the start."""
    alpha, alphadot = Circle(amplitude=1.0).cycle(256)
    found = time_steps(
        Viscous(2.0), Chain(), alpha, alphadot, effects=(heavy(1e6),), cycles=1
    )
    xi, theta = found.xi, found.pose[:-1, 2]
    over_ground = (xi[:, 0] + 1j * xi[:, 1]) * np.exp(
        1j * theta
    )  # the mean frame moves with the centre of mass
    np.testing.assert_allclose(over_ground, over_ground[0], atol=1e-4)
    assert (
        np.abs(xi[:, 2] - xi[0, 2]).max() > 0.1
    )  # it turns with its shape all the same


@pytest.mark.parametrize("medium", [GLASS, Viscous(2.0)])
def test_massless_comes_back_at_order_one(medium):
    """Net displacement: quasi-static as the mass goes to zero, at order 1."""
    alpha, alphadot = Sine(elements=30).cycle(32)
    plain = time_steps(medium, Backbone(30), alpha, alphadot, cycles=1).xi
    sizes = np.array([0.04, 0.02, 0.01])
    off = [
        np.abs(
            time_steps(medium, Backbone(30), alpha, alphadot, effects=(heavy(m),)).xi
            - plain
        ).max()
        for m in sizes
    ]
    assert np.polyfit(np.log(sizes), np.log(off), 1)[0] == pytest.approx(1, abs=0.05)


def net(effects, gait, body, phases):
    """Pose after a cycle in loose glass."""
    return time_steps(GLASS, body, *gait.cycle(phases), effects=effects).displacement


@pytest.mark.parametrize(
    ("effect", "fewest"),
    [
        (heavy(3.0), 32),
        (Transient(travel=0.05), 32),
        (DepthProfile(slope=0.3, towards=1.0), 64),
    ],
    ids=["BodyInertia", "Transient", "DepthProfile"],
)
def test_order_two_in_the_step(effect, fewest, truths):
    gait, phases = Sine(elements=20), fewest * np.array([1, 2, 4])
    true = truths("marches", net, (effect,), gait, Backbone(20), 1024)
    errors = [
        np.hypot(*(net((effect,), gait, Backbone(20), n) - true)[:2]) for n in phases
    ]
    assert -np.polyfit(np.log(phases), np.log(errors), 1)[0] == pytest.approx(
        2, abs=0.35
    )


def test_transients_slow_the_sandfish():
    """A travel of a fifth of the wave's amplitude costs 9 % of the speed; that resistive force theory exceeds
    discrete-element simulation by 30 %, the most there is, takes half of it (paper Secs. III B, IV A)."""
    wave = SANDFISH.gait.amplitude * float(SANDFISH.gait.wavelength())
    effects = [Transient(travel=share * wave) for share in (0.0, 0.1, 0.2, 0.4, 0.525)]
    head = SANDFISH.system.effects
    slowed = [SANDFISH.changed(effects=(*head, effect)) for effect in effects]
    net = np.hypot(*joined_scene(slowed).cycle(phases=64).net.T[:2])
    lost = 1 - net / net[0]
    assert (np.diff(lost) > 0).all()
    assert lost[2] == pytest.approx(0.090, abs=0.003)
    assert lost[4] == pytest.approx(1 - 1 / 1.3, abs=0.02)


def test_the_built_in_march_is_slower_than_the_plain_sandfish():
    slowed = scenes.load("sandfish-transient")
    assert slowed.system.traits.steps
    found = undulation.performance(slowed, [0.22])
    plain = undulation.performance(SANDFISH, [0.22])
    assert (found["efficiency"] < 0.95 * plain["efficiency"]).all()
    assert (found["cost_of_transport"] > 0).all()


def test_work_is_done_by_the_joints_in_time_stepping_too():
    """Without mass, what the joints put in goes into the ground at every phase, memories and caps included."""
    alpha, alphadot = Butterfly(amplitude=0.8).cycle(32)
    effects = (
        Transient(travel_m=0.01),
        EndCaps(radius_m=0.01),
        DisturbedGround(radius_m=0.01, weakening=0.2),
    )
    found = time_steps(
        GLASS,
        Chain((1, 2, 1), length=0.2),
        alpha,
        alphadot,
        effects=effects,
        cycles=2,
        with_work=True,
    )
    put_in = (found.work.bending_moment * alphadot).sum(-1) * 0.2
    np.testing.assert_allclose(put_in, found.work.power, rtol=1e-6)
    assert found.work.bending_moment.shape == (32, 2)


@pytest.mark.parametrize(("medium", "phases"), [(GLASS, 48), (Viscous(2.0), 64)])
def test_work_moves_the_mass(medium, phases):
    """With mass the joints put in what the ground takes in the mean over a cycle, and it does not matter from which end
    the links are counted: the moments include what moves them."""
    gait, effects = (
        Ellipse(semi_axes=(1, 0.5), tilt=0.7, centre=(0.2, -0.3)),
        (heavy(3.0),),
    )
    alpha, alphadot = gait.cycle(phases)
    found = (
        time_steps(
            medium, Chain((1, 2, 1.5)), alpha, alphadot, effects=effects, with_work=True
        )
        .checked()
        .work
    )
    assert (found.bending_moment * alphadot).sum(-1).mean() == pytest.approx(
        found.power.mean(), rel=1e-3
    )
    turned = time_steps(
        medium,
        Chain((1.5, 2, 1)),
        alpha[:, ::-1],
        alphadot[:, ::-1],
        effects=effects,
        with_work=True,
    ).work
    np.testing.assert_allclose(
        found.bending_moment,
        turned.bending_moment[:, ::-1],
        atol=2e-3 * np.abs(found.bending_moment).max(),
    )
    light = time_steps(medium, Chain((1, 2, 1.5)), alpha, alphadot, with_work=True).work
    assert (
        np.abs(found.bending_moment - light.bending_moment).max()
        > 0.05 * np.abs(light.bending_moment).max()
    )


def test_a_first_cycle_is_of_order_two_as_well(truths):
    effects, gait, phases = (
        (Transient(travel=0.05), DepthProfile(slope=0.2)),
        Sine(elements=20),
        np.array([64, 128, 256]),
    )
    true = truths("marches", net, effects, gait, Backbone(20), 1024)
    errors = [
        np.hypot(*(net(effects, gait, Backbone(20), n) - true)[:2]) for n in phases
    ]
    assert -np.polyfit(np.log(phases), np.log(errors), 1)[0] == pytest.approx(
        2, abs=0.4
    )


def test_cycles_that_do_not_repeat_are_not_taken_for_periodic():
    slow = (
        scenes.load("three-link-glass")
        .changed(effects=(heavy(20.0),))
        .with_numerics(cycles=1, phases=64)
    )
    alpha, alphadot = slow.gait.cycle(64)
    wanted = time_steps(
        GLASS, slow.system.body, alpha, alphadot, effects=slow.system.effects, cycles=1
    ).displacement
    np.testing.assert_allclose(SceneTables(slow).poses("direct"), wanted, atol=1e-12)


def test_a_tolerance_below_what_time_stepping_repeats_to_is_refused():
    slowed = scenes.load("sandfish-transient")
    with pytest.raises(Refusal, match="repeat to 1e-06 only: raise tolerance"):
        tabled(cheapest_displacements(slowed, [0.2], 1e-7))


def test_pauses_and_empty_batches():
    alpha, alphadot = Circle().cycle(16)
    alphadot[3] = [1e-99, 0.0]
    found = time_steps(
        GLASS, Chain(), alpha, alphadot, effects=(Transient(travel=0.1),)
    ).checked()
    assert np.isfinite(found.xi).all()
    assert np.abs(found.xi[3]).max() < 1e-8
    nothing = time_steps(
        GLASS,
        Chain(),
        alpha[None][:0],
        alphadot[None][:0],
        effects=(Transient(travel=0.1),),
    )
    assert (nothing.xi.shape, nothing.pose.shape) == ((0, 16, 3), (0, 17, 3))


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


@pytest.mark.parametrize("case", HARD)
@pytest.mark.parametrize("medium", ["glass-0.3mm-loose", "sharp", "strong"])
def test_hard_marches_converge(case, medium):
    """Links that stick, joints that pause, straight bodies and kinks, phase after phase."""
    t = 2 * np.pi * np.arange(16) / 16
    gaits = {
        "both joints alike": np.stack([np.cos(t), np.cos(t)], -1),
        "one joint": np.stack([1.5 * np.sin(t), 0 * t], -1),
        "pauses": np.stack(
            [np.clip(2 * np.cos(t), -1, 1), np.clip(2 * np.sin(t), -1, 1)], -1
        ),
    }
    alpha = np.stack(list(gaits.values()))
    alphadot = (np.roll(alpha, -1, 1) - np.roll(alpha, 1, 1)) / (2 * t[1])
    found = time_steps(
        MEDIA[medium], Chain(), alpha, alphadot, effects=HARD[case], cycles=1
    )
    assert (found.status != "unconverged").all()
    assert found.residual.max() < 1e-9
    assert np.isfinite(found.xi).all()
    assert np.abs(found.xi).max() < 10


def test_status_and_refusals():
    alpha, alphadot = Circle().cycle(16)
    running = time_steps(
        GLASS, Chain(), alpha, alphadot, effects=(Transient(travel=0.3),), cycles=1
    )
    assert running.status == "running"
    assert np.isinf(running.drift)
    running.checked()
    coasting = time_steps(
        Viscous(2.0), Chain(), alpha[::2], alphadot[::2], effects=(heavy(1e4),)
    )
    assert coasting.status == "not periodic"
    with pytest.raises(
        RuntimeError, match="give 'cycles' to take it as it is, or lower the mass"
    ):
        coasting.checked()
    once = time_steps(
        GLASS, Chain(), alpha, alphadot, effects=(DepthProfile(slope=0.1),)
    )
    assert once.cycles == 1
    with pytest.raises(ValueError, match="takes 8 phases or more"):
        time_steps(GLASS, Chain(), alpha[:4], alphadot[:4])
    with pytest.raises(ValueError, match="cycles must be a whole number"):
        time_steps(GLASS, Chain(), alpha, alphadot, cycles=0)
    with pytest.raises(ValueError, match="alpha must be finite"):
        time_steps(GLASS, Chain(), alpha * np.nan, alphadot)


def test_batches_march_as_each_alone():
    effects = (Transient(travel=0.04), EndCaps(radius=0.05), heavy(0.2))
    gait, amplitudes = Sine(elements=15), np.array([[0.1, 0.2], [0.3, 0.4]])
    together = time_steps(
        GLASS,
        Backbone(15),
        *gait.cycle(16, amplitudes),
        effects=effects,
        cycles=2,
        tolerance=1e-12,
    )
    assert together.xi.shape == (2, 2, 16, 3)
    assert together.pose.shape == (2, 2, 17, 3)
    alone = time_steps(
        GLASS,
        Backbone(15),
        *gait.cycle(16, 0.3),
        effects=effects,
        cycles=2,
        tolerance=1e-12,
    )
    np.testing.assert_allclose(together.xi[1, 0], alone.xi, atol=1e-9)


def periodic(effects, gait, body, phases, amplitudes):
    """Poses after a settled cycle of the sandfish, as its scene gives them."""
    scene = SANDFISH.changed(body=body, effects=effects, gait=gait).with_numerics(
        phases=phases
    )
    return SceneTables(scene).poses("direct", None, amplitudes)


def test_estimates_of_marches_cover_the_truth(truths):
    """Against four times the phases, with the same elements."""
    for effect in (Transient(travel=0.05), heavy(2.0), DepthProfile(slope=0.2)):
        scene = SANDFISH.changed(
            body=Backbone(30), effects=(effect,), gait=Sine(elements=30)
        )
        a = np.array([0.12, 0.22, 0.35])
        found, *parts, _ = estimate.direct_with_error_parts(scene, scene.gait, a, 64)
        error = sum(parts)
        truth = truths("marches", periodic, (effect,), scene.gait, Backbone(30), 256, a)
        off = estimate.pose_distance(found, truth, body_size(scene.system.body))
        assert (off <= error).all(), type(effect)
        assert (error[:, 0] <= 100 * off[:, 0] + 1e-4).all(), type(effect)
        assert error[:, 1].max() <= 100 * off[:, 1].max() + 1e-4, type(
            effect
        )  # one heading may be right by chance


# Of circles in glass, 64 phases, that stick and slip: the changes with half, a quarter and
# an eighth of the phases are small by chance. Net poses of 1024 phases.
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


def pieced_scene(rng, kind):
    """A random chain in a random medium on a random ellipse, with an effect that varies along its links."""
    medium = [
        GLASS,
        Viscous(2.0),
        Granular(C=rng.uniform(0.5, 5), gamma0=rng.uniform(0.1, 0.6)),
    ][rng.integers(3)]
    body = Chain(tuple(rng.uniform(0.4, 1.5, 3)))
    axes, centre = tuple(rng.uniform(0.3, 1, 2)), tuple(rng.uniform(-0.4, 0.4, 2))
    effect = {
        "transient": Transient(travel=10 ** rng.uniform(-2.5, -0.7)),
        "disturbed": DisturbedGround(
            radius=rng.uniform(0.04, 0.1), weakening=rng.uniform(0.1, 0.6)
        ),
        "depth": DepthProfile(along=tuple(rng.uniform(0.5, 2, 4))),
    }[kind]
    return Scene(
        Swimmer(medium, body, (effect,)),
        Ellipse(semi_axes=axes, tilt=rng.uniform(0, 3), centre=centre),
    )


def second_cycle(medium, body, gait, effects, pieces, phases, amplitudes):
    """Poses after the second cycle."""
    scene = Scene(Swimmer(medium, body, effects), gait)
    scene = scene.with_numerics(pieces=pieces, phases=phases, tolerance=1e-9, cycles=2)
    return SceneTables(scene).poses("direct", None, amplitudes)


def errors_over_estimates(scene, pieces, phases, finer, truths):
    """(3, 2): of three amplitudes, in place and heading, against so many times the pieces and phases."""
    a = np.array([0.5, 1.0, 1.4])
    scene = scene.with_numerics(pieces=pieces, tolerance=1e-9, cycles=2)
    found, error = estimate.direct(scene, scene.gait, a, phases)
    fine = (
        scene.system.medium,
        scene.system.body,
        scene.gait,
        scene.system.effects,
        finer * pieces,
        finer * phases,
        a,
    )
    return estimate.pose_distance(found, truths("pieces", second_cycle, *fine), 1.0) / (
        error + 1e-9
    )


@pytest.mark.parametrize(("kind", "seeds"), [("depth", range(10)), ("transient", [0])])
def test_estimates_cover_what_pieces_leave(kind, seeds, truths):
    found = [
        errors_over_estimates(
            pieced_scene(np.random.default_rng(k), kind), 10, 64, 4, truths
        )
        for k in seeds
    ]
    assert np.max(found) <= 1
    assert np.median(found) > 0.02


@pytest.mark.soak
@pytest.mark.timeout(3000)
def test_estimates_cover_what_pieces_leave_of_many_random_chains():
    """60 scenes of three amplitudes; the row in .docs/validation.md has the first four of each kind."""
    found, at_once = {}, lambda _, compute, *question: compute(*question)
    for kind in ("transient", "disturbed", "depth"):
        for k in range(20):
            some = errors_over_estimates(
                pieced_scene(np.random.default_rng([7, k]), kind), 20, 64, 4, at_once
            )
            found.setdefault(kind, []).extend(some.ravel())
        print(
            f"\n{kind}: error over estimate {np.median(found[kind]):.2f} in the middle, {max(found[kind]):.2f} at most"
        )
    assert np.mean(np.concatenate(list(found.values())) <= 1) >= 0.95


def test_a_tolerance_refines_pieces_or_is_refused(monkeypatch):
    """Depth that differs along long links, all else being exact enough long before."""
    scene = Scene(
        Swimmer(Viscous(2.0), Chain((1, 1.4, 0.8)), (DepthProfile(along=(0.5, 2, 1)),)),
        Circle(amplitude=1.2),
    )
    scene = scene.with_numerics(pieces=5)
    found = tabled(cheapest_displacements(scene, [1.2], 1e-5))
    assert found["settings"]["pieces"] > 5
    truth = SceneTables(scene.with_numerics(pieces=640)).poses("direct", None, [1.2])
    off = estimate.distance(np.array(found[found["tier"]]), truth)
    assert (off <= found["estimate"][found["tier"]]).all()
    assert max(found["estimate"][found["tier"]]) <= 1e-5
    monkeypatch.setattr("geomech.studies.displacement.choose.MAX_PIECES", 40)
    with pytest.raises(
        Refusal,
        match="no tier gets to 1e-08 body lengths .* with .* phases and 40 pieces",
    ):
        tabled(cheapest_displacements(scene, [1.2], 1e-8))


def test_a_setting_for_pieces():
    depth = scenes.load("three-link-glass").changed(
        effects=(DepthProfile(along=(0.5, 2, 1)),)
    )
    setting = next(k for k in tiered.SETTINGS if k.name == "pieces")
    assert tiered.is_applicable(setting, depth)
    assert not tiered.is_applicable(setting, depth.changed(effects=()))
    a = np.linspace(0.5, 1.5, 8)
    far = SceneTables(depth.with_numerics(pieces=320, phases=64)).poses(
        "direct", Circle(), a
    )
    coarse = [
        SceneTables(
            tiered.Settings(depth.with_numerics(phases=64)).scene_with(setting, n)
        ).poses("direct", Circle(), a)
        for n in setting.values
    ]
    errors = [np.sqrt(np.mean(estimate.distance(x, far) ** 2)) for x in coarse]
    assert -np.polyfit(np.log(setting.values), np.log(errors), 1)[0] == pytest.approx(
        2, abs=0.35
    )
    with pytest.raises(
        ValueError, match="pieces must be a whole number from 1 to 10000, got 0"
    ):
        body_velocity(
            GLASS, Chain(), [0.1, 0.2], [1, 0], effects=depth.system.effects, pieces=0
        )
    with pytest.raises(
        Refusal, match="pieces must be a whole number from 1 to 10000, got 0.5"
    ):
        depth.with_numerics(pieces=0.5)


HEAVY = Ellipse(semi_axes=(1, 0.5), tilt=0.7, centre=(0.2, -0.3))


def test_what_is_left_is_the_sum_of_all_changes_to_come():
    """Two modes of a massless march, one of either sign, one in heading; the change of each cycle is known."""
    ratio, size = np.array([0.5, 0.8]), np.array([[1.0, 0.0], [0.0, 0.0], [0.0, -2.0]])
    cycles = limit_cycle.begin(2)
    assert np.isinf(limit_cycle.after_massless_cycle(cycles, size).drift).all()
    for k in range(6):
        cycles = limit_cycle.after_massless_cycle(cycles, 3.0 + size * ratio**k)
    np.testing.assert_allclose(
        cycles.drift, np.abs(size).max(0) * ratio**4, rtol=1e-12
    )  # counted from the cycle before


def test_cells_of_the_ground_do_not_keep_a_march_from_settling():
    """Changes of displacement as the sandfish's on disturbed ground: they shrink, then come and go at random, sample by
    sample and in heading most."""
    rng, slow = np.random.default_rng(2), np.array([0.5, 0.7, 0.8, 0.2, 0.6, 0.3, 0.4])
    cells, cycles, settled = np.array([0.4e-4, 0.9e-4, 3e-4]), limit_cycle.begin(7), []
    for k in range(40):
        left = 0.02 * slow**k * np.array([[1.0], [-0.5], [0.2]])
        cycles = limit_cycle.after_massless_cycle(
            cycles, 0.3 + left + cells[:, None] * rng.normal(size=(3, 7))
        )
        settled.append((cycles.drift <= 1e-3).all())
        assert k < 2 or (cycles.drift > 0.4 * np.abs(left).max(0) - 2e-4).all(), k
    assert not any(settled[:10])
    assert 14 < np.count_nonzero(settled[14:])


def last_of(cycles, medium, body, gait, phases, effects):
    """(phases + 1, 3): xi through the last of so many cycles, and the pose after it."""
    found = time_steps(
        medium, body, *gait.cycle(phases), effects=effects, cycles=cycles
    )
    return [*found.xi, found.displacement]


def test_heavy_bodies_know_how_far_they_are(truths):
    """Plain cycles of a viscous swimmer that forgets slowly: after each, what is left of the way is what is said."""
    problem = Viscous(2.0), Chain((1, 2, 1.5)), HEAVY, 16, (heavy(20.0),)
    march_on = lambda **how: time_steps(
        *problem[:2], *HEAVY.cycle(16), effects=problem[4], **how
    )
    limit = march_on().checked()
    assert limit.cycles < 15
    for cycles in (8, 12):
        some = march_on(cycles=cycles)
        off = np.abs(some.displacement - limit.displacement).max()
        assert off > 1e-5
        assert some.drift == pytest.approx(off, rel=0.2)
    *xi, displacement = truths(
        "marches", last_of, 60, *problem
    )  # nothing was led to another limit
    assert np.abs(limit.displacement - displacement).max() <= limit.drift + 1e-9
    np.testing.assert_allclose(limit.xi, xi, atol=2e-6)


# Net displacements of 800 plain cycles, by which they change by less than 1e-11.
FORGETS_SLOWLY = {
    (0.05, 0.3, 1.8): (-5.864540457e-05, 2.912377523e-05, -8.750617274e-05),
    (0.1, 1.0, 1.8): (-2.23546018e-04, 1.07231935e-04, -3.95975078e-04),
}


@pytest.mark.parametrize("case", FORGETS_SLOWLY)
def test_small_strokes_with_a_long_transient_reach_their_limit(case):
    """Sixty plain cycles leave 1e-5 to 1e-4."""
    size, travel, C = case
    circle = Circle(size, centre=(0.5, 0.0)).cycle(32)
    steps = time_steps(
        Granular(C, 0.24), Chain(), *circle, effects=[Transient(travel=travel)]
    )
    assert (steps.checked().status == "periodic").all()
    off = np.abs(steps.displacement - FORGETS_SLOWLY[case]).max()
    assert off < steps.drift + 1e-8


def test_estimates_hold_what_is_left_of_the_way(monkeypatch):
    scene = Scene(
        Swimmer(Viscous(2.0), Chain((1, 2, 1.5)), (heavy(5.0),)), HEAVY
    ).with_numerics(phases=32)
    a, shapes = np.array([1.0]), HEAVY.cycle(32, np.array([1.0]))
    left = time_steps(
        scene.system.medium, scene.system.body, *shapes, effects=scene.system.effects
    ).drift
    assert scene.system.run(*shapes).to_come == left > 0
    assert (scene.with_numerics(cycles=3).system.run(*shapes).to_come == 0).all()
    scene = scene.with_numerics(cycles=1)
    of_steps = estimate.direct(scene, HEAVY, a, 32)[1]
    monkeypatch.setattr(
        Swimmer,
        "run",
        lambda *args, run=Swimmer.run, **more: (c := run(*args, **more))._replace(
            to_come=c.to_come + 0.125
        ),
    )
    np.testing.assert_allclose(
        estimate.direct(scene, HEAVY, a, 32)[1], of_steps + 0.125, rtol=1e-6
    )


def test_a_kicked_body_coasts():
    """In almost nothing, a kick that turns the frame changes the momentum over the ground once, not step by step
    after."""
    alpha, alphadot = (
        x.T[:, :, None].transpose(1, 0, 2) for x in Circle(amplitude=1.0).cycle(64)
    )
    body, effects = Chain(), (heavy(1e6),)
    assembly = assemble(Viscous(2.0), body, effects)
    steps = Stepping(
        assembly,
        alpha,
        alphadot,
        Accuracy(1e-6, 1e-10),
        "numpy",
        True,
        half_lengths(body),
    )
    over_ground = lambda s: s.effect_states[0][-1][:, :, 0].sum(
        1
    )  # momentum, and its moment
    state = steps.begin()
    for _ in range(5):
        site = steps.site(state)
        state, _ = steps.step(state)
    before, change = over_ground(state), np.array([[0.3], [-0.2], [0.4]])
    state = steps.with_velocity_change(
        state._replace(cycles=state.cycles._replace(extrapolation=change)),
        steps.problem(4),
        site,
    )
    kicked = over_ground(state)
    np.testing.assert_array_less(0.02, np.abs(kicked - before))
    after = []
    for _ in range(12):
        state, _ = steps.step(state)
        after.append(over_ground(state))
    np.testing.assert_allclose(after, np.broadcast_to(kicked, (12, 3)), atol=1e-4)


@pytest.mark.parametrize(
    ("medium", "off"), [(GLASS, 1e-3), (Viscous(2.0), 1e-7)]
)  # work rounds kinks as at its own speed
def test_moments_of_a_heavy_body_move_its_elements(medium, off):
    """Beside what the medium asks for, at a joint: the moment of d(momentum)/dt of all on the tail's side, by hand over
    the ground, with the differences in time of the march, from the poses it foresees by the velocities before."""
    body, inertia, N = Chain((1, 1.4, 0.8), frame="link-1"), 3.0, 32
    alpha, alphadot = HEAVY.cycle(N)
    found = time_steps(
        medium,
        body,
        alpha,
        alphadot,
        effects=(heavy(inertia),),
        cycles=1,
        tolerance=1e-13,
        with_work=True,
    )
    medium_alone = work_done(medium, body, alpha, alphadot, found.xi).bending_moment
    dt, motion, (x, y, turn) = (
        2 * np.pi / N,
        body.motion(alpha.T, alphadot.T),
        found.xi.T,
    )
    ahead = np.concatenate(
        [found.xi[:1], 1.5 * found.xi[1:-1] - 0.5 * found.xi[:-2]]
    )  # mean of the last and the next
    pose = np.concatenate([found.pose[:1], compose(found.pose[:-2], exp(dt * ahead))])
    at, facing = pose[:, 0] + 1j * pose[:, 1], np.exp(1j * pose[:, 2])
    along, half, place = (
        facing * (motion.c + 1j * motion.s),
        motion.half,
        at + facing * motion.centres,
    )
    velocity = (
        (motion.v[0] + 1j * motion.v[1]) * along
        + facing * (x + 1j * y)
        + 1j * turn * (place - at)
    )
    spin = motion.v[2] / half + turn
    p = 2 * half * velocity
    L = (place.conj() * p).imag + 2 * half * half**2 / 3 * spin
    rate = lambda q: (1.5 * q[:, 2:] - 2 * q[:, 1:-1] + 0.5 * q[:, :-2]) / dt
    force, torque = inertia * rate(p), inertia * rate(L)
    joints = (place + half * along)[:-1, 2:]
    wanted = (joints.conj() * np.cumsum(force, 0)[:-1]).imag - np.cumsum(torque, 0)[:-1]
    got = (found.work.bending_moment - medium_alone)[2:].T
    np.testing.assert_allclose(got, wanted, atol=off * np.abs(wanted).max())
    assert np.abs(wanted).max() > 0.01


def test_a_kick_that_leads_astray_is_taken_back():
    """Two samples whose velocity halves its way to (1, -1, 2) in a cycle; one of them is thrown about after its first
    kick. It goes on from the end of its calmest cycle, and both get there."""
    limit, zero = np.array([[1.0], [-1.0], [2.0]]), np.zeros((3, 2))
    halved = lambda x: x + 0.5 * (limit - x)
    after = lambda c, start, end: limit_cycle.after_heavy_cycle(
        c._replace(start=start), end - limit, end, 0.0
    )
    cycles = limit_cycle.after_heavy_cycle(limit_cycle.begin(2), zero, zero, 0.0)
    assert np.isinf(cycles.drift).all()
    x = zero
    for _ in range(2):
        start, x = x, halved(x)
        cycles = after(cycles, start, x)
    step = cycles.extrapolation
    calm, wild = x, halved(x + step) + [[0.0, 30.0], [0.0, -20.0], [0.0, 10.0]]
    np.testing.assert_allclose(calm + step, limit * np.ones(2), atol=1e-12)
    cycles = after(cycles, calm + step, wild)
    step, drift = cycles.extrapolation, cycles.drift
    np.testing.assert_allclose(wild + step, np.hstack([limit, calm[:, 1:]]), atol=1e-12)
    assert drift[0] <= 0.5 < 10.0 < drift[1]
    x = wild + step
    for _ in range(3):
        start, x = x, halved(x)
        cycles = after(cycles, start, x)
        x = x + cycles.extrapolation
    np.testing.assert_allclose(x, limit * np.ones(2), atol=1e-9)


@pytest.mark.parametrize(("inertia", "phases"), [(300.0, 8), (400.0, 8)])
def test_no_kick_leads_a_body_astray(inertia, phases):
    """Drag acts between the step before a kick and the next one; a velocity far from the limit once led to fast
    spin."""
    shapes = Circle(amplitude=1.2).cycle(phases)
    found = time_steps(
        Viscous(2.0), Chain(), *shapes, effects=(heavy(inertia),)
    ).checked()
    assert found.cycles <= 45
    assert np.abs(found.xi).max() < 0.2
    np.testing.assert_allclose(
        found.displacement[:2], [-0.05785, -0.00554], atol=1e-3
    )  # of 128 phases


@pytest.mark.parametrize("medium", [GLASS, Viscous(2.0)])
def test_heavy_bodies_settle_in_tens_of_cycles(medium):
    alpha, alphadot = HEAVY.cycle(16, np.linspace(0.3, 1.2, 6))
    for inertia in (60.0, 300.0):
        found = time_steps(
            medium, Chain((1, 2, 1.5)), alpha, alphadot, effects=(heavy(inertia),)
        ).checked()
        assert found.cycles <= 40
        assert found.drift.max() <= 1e-6


def test_time_stepping_that_fails_says_so(monkeypatch):
    """Starved descents: the status, and RuntimeError by `checked`."""
    import rft.balance.solver

    monkeypatch.setattr(
        rft.balance.solver,
        "QUICK",
        rft.balance.solver.Descent(0.03, 0.03, 2e-2, 5.0, 5.0),
    )  # enough at rest
    monkeypatch.setattr(
        rft.balance.solver, "WARM", rft.balance.solver.WARM._replace(budget=1.0)
    )
    for name in ("WALKS", "SLOW"):
        monkeypatch.setattr(rft.balance.solver, name, ())
    alpha, alphadot = Circle().cycle(8, np.array([0.0, 1.0]))
    found = time_steps(
        GLASS, Chain(), alpha, alphadot, effects=(Transient(travel=0.1),), cycles=1
    )
    assert list(found.status) == ["running", "unconverged"]
    assert found.residual[1] > 1e-9
    with pytest.raises(RuntimeError, match="did not converge"):
        found.checked()


@pytest.mark.parametrize("kept", [True, False])
def test_what_does_not_change_is_not_built_again(kept, monkeypatch):
    """One motion a phase for all cycles, or one a step where phases are too many to keep; the same answer by both."""
    effects, counts = (
        (
            Transient(travel=0.05),
            DisturbedGround(0.05, 0.2),
            EndCaps(radius=0.05),
            heavy(1.0),
        ),
        [],
    )
    usual = time_steps(
        GLASS, Chain(), *HEAVY.cycle(8), effects=effects, cycles=2, with_work=True
    )
    made = []
    for owner, what in ((Stepping, "__init__"), (Chain, "motion")):
        original = getattr(owner, what)
        counted = lambda *args, f=original, what=what: made.append(what) or f(*args)
        monkeypatch.setattr(owner, what, counted)
    if not kept:
        monkeypatch.setattr("rft.motion.stepping.MOST_STORED", 0)
    for phases in (8, 16):
        made.clear()
        found = time_steps(
            GLASS,
            Chain(),
            *HEAVY.cycle(phases),
            effects=effects,
            cycles=2,
            with_work=True,
        )
        assert made.count("__init__") == 1
        counts.append(made.count("motion"))
        if phases == 8:
            np.testing.assert_allclose(found.xi, usual.xi, rtol=0, atol=1e-12)
    assert counts[1] - counts[0] == (8 if kept else 2 * 8)
    assert counts[0] < (0 if kept else 2 * 8) + 10


def test_halves_are_the_whole_body():
    for body in BODIES.values():
        assert 2 * half_lengths(body).sum() == pytest.approx(1)


def random_march(rng):
    """A medium, a body, a batch of eight closed gaits of 16 phases, and one to four effects; scales over many
    decades."""
    many = lambda low, high: 10 ** rng.uniform(low, high)
    medium = [
        Granular(C=many(-1, 2), gamma0=np.radians(rng.uniform(1, 80))),
        Viscous(many(0, 2)),
        GLASS,
    ][rng.integers(3)]
    joints = int(rng.integers(1, 6))
    body = Chain(
        tuple(many(-1, 0) for _ in range(joints + 1)),
        frame=["mean", "link-1"][rng.integers(2)],
    )
    t = 2 * np.pi * np.arange(16) / 16
    waves = rng.normal(size=(4, 8, 1, joints)) * rng.uniform(0, 1.5)
    basis = np.cos(t), np.sin(t), np.cos(2 * t), np.sin(2 * t)
    rates = -np.sin(t), np.cos(t), -2 * np.sin(2 * t), 2 * np.cos(2 * t)
    alpha, alphadot = (
        sum(w * f[:, None] for w, f in zip(waves, fs)) for fs in (basis, rates)
    )
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
    """Three radians of spin a radian of phase, a third of a radian a step: an equation quadratic in the velocity was
    not."""
    rng = np.random.default_rng(2026)
    marches = [random_march(rng) for _ in range(344)]
    for k, sample in (250, 0), (343, 0):
        medium, body, alpha, alphadot, effects = marches[k]
        alpha, alphadot = alpha[sample], alphadot[sample]
        time_steps(
            medium, body, alpha, alphadot, effects=effects, cycles=2, tolerance=8e-11
        ).checked()


@pytest.mark.soak
@pytest.mark.parametrize("backend", ["numpy", "numba"])
def test_two_hundred_thousand_steps_of_random_marches(backend):
    """800 marches of eight gaits, two cycles each, to 1e-10: prints a row of .docs/validation.md."""
    rng, residuals, failures = np.random.default_rng(2026), [], 0
    for _ in range(800):
        medium, body, alpha, alphadot, effects = random_march(rng)
        try:
            found = time_steps(
                medium,
                body,
                alpha,
                alphadot,
                effects=effects,
                cycles=2,
                tolerance=8e-11,
                backend=backend,
            )
        except ValueError as error:
            if "comes to the surface" not in str(error):
                raise
            continue
        residuals.append(found.residual)
        failures += np.count_nonzero(found.status == "unconverged")
    residuals = np.concatenate(residuals)
    print(
        f"\n{backend}: {residuals.size * 32:,} steps: {failures} marches failed, residuals to {residuals.max():.1e}"
    )
    assert failures == 0
