"""Contact that comes and goes: closed forms, symmetry, and programs that share no
code."""

import math

import numpy as np
import pytest

from rft import (
    CATALOGUE,
    Chain,
    Coulomb,
    EndCaps,
    FunctionContact,
    LinkContact,
    Serpenoid,
    Slope,
    Springs,
    Touching,
    Transient,
    Viscous,
    WaveContact,
    body_velocity,
    time_steps,
    work_done,
)
from rft.contacts import BEARINGS, CONTACTS, support_margin
from rft.contacts.loads import balanced_loads
from rft.core.refusal import Refusal

GLASS = CATALOGUE["glass-0.3mm-loose"].medium
MEDIA = {"glass": GLASS, "coulomb": Coulomb(), "viscous": Viscous(3.0)}
QUARTER = math.pi / 2


def wave(amplitude, waves, links, count):
    """Shapes and rates (count, links - 1) of a wave of joint angles."""
    t = 2 * np.pi * np.arange(count)[:, None] / count
    phase = t + 2 * np.pi * waves * np.arange(1, links) / links
    return amplitude * np.cos(phase), -amplitude * np.sin(phase)


def with_phase(alpha, alphadot):
    """Shapes and rates (N, d) of a cycle, with the contact phase as the last
    variable."""
    t = 2 * np.pi * np.arange(len(alpha))[:, None] / len(alpha)
    return np.hstack([alpha, t]), np.hstack([alphadot, np.ones_like(t)])


def curves(count, length=7.0):
    """Shapes and rates (count, 2) of a serpenoid whose wave runs from head to tail."""
    t = 2 * np.pi * np.arange(count) / count
    alpha = length * np.stack([np.cos(t), -np.sin(t)], -1)
    return alpha, length * np.stack([-np.sin(t), -np.cos(t)], -1)


@pytest.mark.parametrize("bearing", BEARINGS)
@pytest.mark.parametrize("medium", MEDIA.values(), ids=MEDIA)
def test_full_contact_is_no_contact(medium, bearing):
    body = Chain((1, 2, 1, 1.5))
    cycle = wave(0.7, 1.0, 4, 24)
    whole = body_velocity(medium, body, *cycle).xi
    touching = Touching(body, WaveContact(duty=1, bearing=bearing))
    found = body_velocity(medium, touching, *with_phase(*cycle)).xi
    assert np.abs(found - whole).max() < 1e-9


@pytest.mark.parametrize("rule", CONTACTS.examples().values(), ids=CONTACTS.examples())
def test_contact_moves_nothing_by_itself_and_repeats(rule):
    """The rate of the contact phase moves nothing, and weights have its period."""
    body = Touching(Chain((1, 2, 1)), rule)
    shape = np.array([0.4, -0.7, 0.9])[: body.joints]
    rate = np.array([1.0, 0.5, 0.0])[: body.joints]
    last = np.arange(body.joints) == 2
    xi = body_velocity(GLASS, body, shape, rate).xi
    faster = body_velocity(GLASS, body, shape, rate + 5.0 * last).xi
    later = body_velocity(GLASS, body, shape + 2 * math.pi * last, rate).xi
    assert np.abs(faster - xi).max() < 1e-9
    assert np.abs(later - xi).max() < 1e-9
    station = np.linspace(0.01, 0.99, 50)[:, None]
    weights = rule.weights(station, np.linspace(-9.0, 9.0, 70))
    assert 0.0 <= weights.min() < weights.max() <= 1.0


@pytest.mark.parametrize("bearing", BEARINGS)
def test_the_mirror_image_of_a_pattern_moves_to_the_other_side(bearing):
    """Half a cycle later, or earlier, the wave is its own mirror image."""
    nets = []
    for lag in (QUARTER, QUARTER + math.pi):
        rule = WaveContact(follows="shape", lag=lag, bearing=bearing, duty=0.6)
        body = Touching(Serpenoid(30), rule)
        nets.append(body_velocity(GLASS, body, *curves(64)).xi)
    mirrored = np.roll(nets[1], 32, axis=0) * [1.0, -1.0, -1.0]
    assert np.abs(nets[0] - mirrored).max() < 1e-8


def test_a_factor_of_all_weights_changes_no_velocity_but_the_power():
    cycle = with_phase(*wave(0.5, 1.0, 6, 16))
    found = {}
    for bearing in ("buried", "normalised"):
        body = Touching(Chain((1,) * 6), WaveContact(waves=1.3, bearing=bearing))
        xi = body_velocity(GLASS, body, *cycle).xi
        found[bearing] = xi, work_done(GLASS, body, *cycle, xi).power
    assert np.abs(found["buried"][0] - found["normalised"][0]).max() < 1e-8
    station = (np.arange(2000)[:, None] + 0.5) / 2000
    mean = WaveContact(waves=1.3).weights(station, cycle[0][:, -1]).mean(0)
    ratio = found["buried"][1] / found["normalised"][1]
    assert np.abs(ratio - mean).max() < 2e-3  # as the links are cut into 7 pieces each


@pytest.mark.parametrize("backend", ["numpy", "auto"])
@pytest.mark.parametrize("medium", MEDIA.values(), ids=MEDIA)
def test_back_ends_agree_on_lifted_bodies(medium, backend, fastest):
    rule = WaveContact(duty=0.4, lag=1.0, bearing="balanced", width=0.05)
    body = Touching(Chain((1,) * 6), rule)
    cycle = with_phase(*wave(0.5, 1.0, 6, 16))
    found = body_velocity(medium, body, *cycle, backend=backend)
    numpy = body_velocity(medium, body, *cycle, backend="numpy")
    assert np.abs(found.xi - numpy.xi).max() < 1e-7
    assert found.residual.max() < 1e-9


def test_caps_are_lifted_with_their_ends():
    """Three links of which the tail alone touches: the head's cap has no drag."""
    rest = (0.0, 1.0), (), ()
    caps = {}
    for name in ("tail", "head"):
        caps[name] = EndCaps(radius=0.05, **{name: 4.0, other_end(name): 0.0})
    body = Touching(Chain(), LinkContact(links=rest))
    shape = [0.3, 0.5, 0.0], [1.0, -0.4, 0.0]
    bare = body_velocity(GLASS, body, *shape)
    xi = bare.xi
    power = {
        name: work_done(GLASS, body, *shape, xi + 0.1, effects=[cap]).end_power
        for name, cap in caps.items()
    }
    assert power["tail"][0] > 1e-3
    assert np.abs(power["head"]).max() == 0.0


def other_end(name):
    return {"tail": "head", "head": "tail"}[name]


# Two feet


def se2(x, y, turned):
    c, s = math.cos(turned), math.sin(turned)
    return np.array([[c, -s, x], [s, c, y], [0.0, 0.0, 1.0]])


def link_poses(alpha):
    """Poses of three equal links of 1/3 in the frame of the first, as matrices."""
    poses = [np.eye(3)]
    for angle in alpha:
        step = se2(1 / 6, 0, 0) @ se2(0, 0, angle) @ se2(1 / 6, 0, 0)
        poses.append(poses[-1] @ step)
    return poses


def mean_frame(alpha):
    """Pose of the frame of the mean in the frame of the first link."""
    poses = link_poses(alpha)
    x, y = np.mean([pose[:2, 2] for pose in poses], axis=0)
    headings = np.cumsum([0.0, *alpha])
    return se2(x, y, headings.mean())


@pytest.mark.parametrize("medium", MEDIA.values(), ids=MEDIA)
@pytest.mark.parametrize("amplitude", [0.3, 0.6, 1.0])
def test_two_feet_that_alternate_stride_by_kinematics(medium, amplitude):
    """The link that touches alone rests on the ground, in any medium, so that the
    stride follows from the shapes at which the feet change: C-shape to mirrored C."""
    feet = LinkContact(links=((0.125, 0.625), (), (0.625, 0.125)), rise=0.002)
    count = 512
    t = 2 * np.pi * (np.arange(count) + 0.5) / count
    alpha = amplitude * np.stack([np.cos(t), np.sin(t)], -1)
    rate = amplitude * np.stack([-np.sin(t), np.cos(t)], -1)
    body = Touching(Chain(), feet)
    shapes = np.column_stack([alpha, t])
    rates = np.column_stack([rate, np.ones(count)])
    xi = body_velocity(medium, body, shapes, rates).xi

    holding = np.where((t > QUARTER / 2) & (t < 5 * QUARTER / 2), 0, 2)
    inner = Chain().motion(alpha.T, rate.T)
    along = inner.v_t + inner.c * xi[:, 0] + inner.s * xi[:, 1] + inner.r_t * xi[:, 2]
    across = inner.v_n - inner.s * xi[:, 0] + inner.c * xi[:, 1] + inner.r_n * xi[:, 2]
    sliding = np.hypot(along, across)[holding, np.arange(count)]
    assert sliding.max() < 1e-4

    a = amplitude / math.sqrt(2)
    change = link_poses([-a, -a])[2] @ np.linalg.inv(link_poses([a, a])[2])
    start = mean_frame([a, a])
    stride = np.linalg.inv(start) @ change @ start
    assert math.atan2(stride[1, 0], stride[0, 0]) == pytest.approx(-4 * a, abs=1e-12)
    pose = np.eye(3)
    order = np.argsort((t - QUARTER / 2) % (2 * np.pi))
    step = 2 * np.pi / count
    for x, y, turning in xi[order]:
        half = step * turning / 2
        chord = math.sin(half) / half if half else 1.0
        z = step * chord * complex(math.cos(half), math.sin(half)) * complex(x, y)
        pose = pose @ se2(z.real, z.imag, step * turning)
    assert np.abs(pose - stride).max() < 3e-4


# Loads


def test_balanced_loads_bear_the_body_and_never_pull():
    rng = np.random.default_rng(3)
    count, size = 40, 60
    body = Chain((1,) * count)
    joints = np.arange(1, count)[:, None]
    bends = rng.uniform(0.05, 0.3, size)
    alpha = bends * np.cos(rng.uniform(0, 7, size) + joints / rng.uniform(3, 12, size))
    elements = body.motion(alpha, 0.0 * alpha)
    fraction = np.full((count, 1), 1 / count)
    station = (np.arange(count)[:, None] + 0.5) / count
    along = elements.c + 1j * elements.s
    weights = WaveContact(waves=1.5).weights(station, rng.uniform(0, 7, size))
    loads = fraction * balanced_loads(weights, fraction, elements.centres, along, 0.0)
    margin = support_margin(
        (weights > 1e-3).astype(float), fraction, elements.centres, along
    )
    place = elements.centres - elements.centres.mean(0)
    moment = np.abs((loads * place).sum(0))
    assert loads.min() >= 0.0
    assert np.abs(loads.sum(0) - 1).max() < 1e-9
    assert moment[margin > 0.01].max() < 1e-7
    assert (moment[margin < -0.01] > 1e-4).all()
    assert (margin > 0.01).any() and (margin < -0.01).any()
    assert (loads[weights == 0] == 0).all()


def test_support_is_the_hull_of_what_touches():
    """A body that touches at the corners of a square, seen from its middle."""
    corners = np.array([1 + 1j, -1 + 1j, -1 - 1j, 1 - 1j])[:, None]
    rest = np.ones((4, 1)), np.full((4, 1), 0.25), corners, np.ones((4, 1), complex)
    assert support_margin(*rest)[0] == pytest.approx(1.0, abs=1e-4)
    assert support_margin(*rest, shift=0.4)[0] == pytest.approx(0.6, abs=1e-4)
    assert support_margin(*rest, shift=-1.5)[0] == pytest.approx(-0.5, abs=1e-4)
    lifted = np.array([[1.0], [1.0], [0.0], [0.0]])
    edge = support_margin(lifted, *rest[1:])[0]
    assert edge == pytest.approx(-1.0, abs=1e-4)  # from the middle to the edge
    wide = support_margin(lifted, *rest[1:], width=0.2)[0]
    assert wide == pytest.approx(-0.9, abs=1e-4)


def test_the_height_of_the_centre_of_mass_moves_it_downhill():
    rule = WaveContact(duty=1, bearing="normalised", height=0.1)
    body = Touching(Chain((1,) * 8), rule)
    straight = np.zeros((1, body.joints))
    level = body.contact_state(straight).margin[0]
    ahead = body.contact_state(straight, shift=0.1 * math.tan(0.5)).margin[0]
    assert level == pytest.approx(0.0, abs=1e-9)  # a line supports no body
    assert ahead == pytest.approx(0.0, abs=1e-9)
    aside = body.contact_state(straight, shift=0.1j * math.tan(0.5)).margin[0]
    assert aside == pytest.approx(-0.1 * math.tan(0.5), abs=1e-5)


# Slopes


def rigid_on_slope(share, weight):
    """Return the status of a straight body across a slope of 20 degrees, held still,
    that touches with a share of its length, half of it at each end."""
    links = (share / 2, 1 - share, share / 2)
    feet = LinkContact(links=((0.0, 1.0), (), (0.0, 1.0)))
    body = Touching(Chain(links), feet)
    slope = Slope(angle=math.radians(20), towards=QUARTER, weight=weight)
    still = np.zeros((8, 3))
    return time_steps(GLASS, body, still, still, effects=[slope]).status


@pytest.mark.parametrize("share", [0.2, 0.35])
def test_a_body_slides_where_its_weight_exceeds_what_the_ground_holds(share):
    """It holds share f_n(1) (cos - sin / tan(repose)) of the axial drag."""
    angle = math.radians(20)
    across = 1 + GLASS.C / math.sqrt(math.tan(GLASS.gamma0) ** 2 + 1)
    repose = Slope(angle=angle).repose
    weakened = math.cos(angle) - math.sin(angle) / math.tan(repose)
    holds = share * across * weakened / math.sin(angle)
    assert rigid_on_slope(share, 0.97 * holds) != "slides"
    assert rigid_on_slope(share, 1.03 * holds) == "slides"


def test_the_steeper_the_slope_the_more_of_a_sidewinder_must_touch():
    """The trend of Marvi et al. 2014."""
    duties = (0.2, 0.3, 0.4, 0.5)
    least = []
    for degrees in (5, 12, 20):
        slope = Slope(angle=math.radians(degrees), towards=QUARTER, weight=0.6)
        holding = []
        for duty in duties:
            rule = WaveContact(follows="shape", waves=1.5, lag=QUARTER, duty=duty)
            body = Touching(Serpenoid(40, waves=1.5), rule)
            steps = time_steps(GLASS, body, *curves(32, 8.0), effects=[slope])
            climbs = steps.status != "slides" and steps.displacement[1] > 0
            holding.append(bool(climbs))
        least.append(holding.index(True))
        assert all(holding[least[-1] :])
    assert least == sorted(least)
    assert least[-1] > least[0]


# Refusals

REFUSED = {
    "duty without room": (lambda: WaveContact(duty=0.95), "rise", "duty"),
    "nothing touches": (lambda: WaveContact(waves=0.1, duty=0.3), "touches", "phase"),
    "no foot on the ground": (
        lambda: LinkContact(links=((0.0, 0.4), (), (0.5, 0.9))),
        "touches",
        "phase",
    ),
    "three phases": (lambda: LinkContact(links=((0.0, 0.5, 1.0),)), "links"),
    "beyond a cycle": (lambda: LinkContact(links=((0.0, 1.5),)), "links"),
    "weight above 1": (
        lambda: FunctionContact(function=lambda s, p: 2.0 + 0 * s * p),
        "0 to 1",
        "2.0",
    ),
    "weights of one shape": (
        lambda: FunctionContact(function=lambda s, p: np.ones(3)),
        "shape",
    ),
    "unknown bearing": (lambda: WaveContact(bearing="floats"), *BEARINGS),
    "width of a buried body": (lambda: WaveContact(width=0.1), "width", "balanced"),
    "links of another body": (
        lambda: Touching(Chain(), LinkContact(links=((0.0, 1.0),) * 4)),
        "4",
        "3",
    ),
    "one variable": (
        lambda: Touching(Chain((1, 1)), WaveContact(follows="shape")),
        "follows",
    ),
    "no rule": (lambda: Touching(Chain(), "wave"), "contact"),
}


@pytest.mark.parametrize(("make", "named"), [(x[0], x[1:]) for x in REFUSED.values()])
def test_contact_that_makes_no_sense_is_refused(make, named):
    with pytest.raises(Refusal) as refusal:
        make()
    line = str(refusal.value)
    assert "\n" not in line
    assert all(word in line for word in named)


@pytest.mark.parametrize("effect", [Springs(1.0), Transient(travel=0.1)])
def test_effects_that_follow_the_ground_are_refused_beside_lifted_parts(effect):
    body = Touching(Chain(), WaveContact(follows="shape"))
    with pytest.raises(Refusal, match=effect.kind):
        time_steps(GLASS, body, *curves(16, 0.5), effects=[effect])
