"""Bodies from a function of shape that returns the poses of links: against chains and backbones that are built in."""

import pickle

import numpy as np
import pytest
from commands import geomech as run
from tabled import tabled, tabled_json

import geomech
from geomech.mathematics.gaits import Circle
from geomech.mathematics.tiers.fitted import directions
from geomech.scenes import load, toml
from geomech.scenes.kinds import load_file
from rft import Backbone, Chain, Coulomb, Granular, Serpenoid, Viscous
from rft.bodies import BODIES, Positions
from rft.core.refusal import Refusal

pytestmark = pytest.mark.usefixtures("fastest", "own_parts")
SAND = Granular(C=1.8, gamma0=0.24)
RNG = np.random.default_rng(4)
ALPHA, RATE = RNG.uniform(-2, 2, (2, 2, 40))


def hinged(alpha):
    """Three links seen from the middle one, one shape at a time; the tail's heading is wrapped."""
    back, front = -alpha[0] + 4 * np.pi, alpha[1]
    tail = [-(1 + np.cos(back)) / 2, -np.sin(back) / 2, back]
    return [tail, [0, 0, 0], [(1 + np.cos(front)) / 2, np.sin(front) / 2, front]]


def uneven(alpha):
    """Links from the tail on, many shapes at once, in an own frame that turns and moves with the shape."""
    theta = np.concatenate([0 * alpha[..., :1], np.cumsum(alpha, -1)], -1) + np.sin(
        alpha[..., :1]
    )
    half = np.array([0.7, 1.4, 0.9]) / 2 * np.exp(1j * theta)
    z = np.cumsum(2 * half, -1) - half + alpha[..., 1:] ** 2
    return np.stack([z.real, z.imag, np.arctan2(np.sin(theta), np.cos(theta))], -1)


PAIRS = [(hinged, (1, 1, 1), 1.0), (uneven, (0.7, 1.4, 0.9), 0.3)]


@pytest.mark.parametrize("frame", ["mean", "link-1", "link-2"])
@pytest.mark.parametrize(("function", "lengths", "length"), PAIRS)
def test_three_links_move_and_are_drawn_as_the_chain(function, lengths, length, frame):
    body, chain = (
        Positions(function, 2, lengths, length, frame),
        Chain(lengths, length, frame),
    )
    for x, y in zip(body.motion(ALPHA, RATE), chain.motion(ALPHA, RATE)):
        np.testing.assert_allclose(np.broadcast_to(x, y.shape), y, atol=1e-11)
    np.testing.assert_allclose(
        body.points(ALPHA.T, [1, 2, 0.3]),
        chain.points(ALPHA.T, [1, 2, 0.3]),
        atol=1e-14,
    )
    for one, two in zip(
        body.frame_pose("link-3", ALPHA.T, RATE.T),
        chain.frame_pose("link-3", ALPHA.T, RATE.T),
    ):
        np.testing.assert_allclose(np.exp(1j * one), np.exp(1j * two), atol=1e-11)


@pytest.mark.parametrize(("function", "lengths", "length"), PAIRS)
@pytest.mark.parametrize("medium", [Viscous(2.0), SAND])
def test_three_links_have_the_connection_of_the_chain(
    function, lengths, length, medium
):
    bodies = Positions(function, 2, lengths, length), Chain(lengths, length)
    one, two = (
        geomech.study(medium, body, Circle(), grid=5, extent=2.0) for body in bodies
    )
    np.testing.assert_allclose(one.tables.fitted.A, two.tables.fitted.A, atol=1e-11)
    assert one.scene.system.traits.mirror
    moved = [
        tabled(study.displacement([0.9], "direct"))["direct"] for study in (one, two)
    ]
    np.testing.assert_allclose(*moved, atol=1e-11)


def test_a_curve_converges_to_the_serpenoid_that_is_built_in():
    """Pieces on the curve against chords of it: apart by the square of their length."""

    def curve(elements):
        s = 2 * np.pi * (np.arange(elements) + 0.5) / elements

        def positions(alpha):
            theta = (alpha[..., :1] * np.sin(s) - alpha[..., 1:] * np.cos(s)) / (
                2 * np.pi
            )
            step = np.exp(1j * theta) / elements
            z = np.cumsum(step, -1) - step / 2
            return np.stack([z.real, z.imag, theta], -1)

        return Positions(positions, 2, (1 / elements,) * elements)

    difference = []
    for elements in (20, 40):
        bodies = curve(elements), Serpenoid(elements=elements)
        A, B = (
            geomech.study(
                Viscous(2.0), x, Circle(6.0), grid=4, extent=6.0
            ).tables.fitted.A
            for x in bodies
        )
        difference.append(np.abs(A - B).max() / np.abs(B).max())
    assert difference[1] < 2e-3 and difference[0] / difference[1] == pytest.approx(
        4.0, abs=0.2
    )


@pytest.mark.parametrize("medium", [Viscous(2.0), SAND])
def test_a_body_that_is_bent_at_rest_has_no_mirror_image(medium):
    """A chain with all shapes shifted, whose field is not half of itself."""
    shift = np.array([0.4, 0.1])
    bent = Positions(lambda alpha: hinged(alpha + shift), 2, (1, 1, 1))
    one = geomech.study(medium, bent, Circle(), grid=5, extent=1.0)
    assert not one.scene.system.traits.mirror
    swimmer = geomech.Swimmer(medium, Chain())
    alpha, rate = (
        np.array([[-0.5, 0.5], [1.0, -1.0], [0.0, 0.5]]),
        np.array([[1.0, 0.0], [0.3, -0.8], [0.0, 1.0]]),
    )
    np.testing.assert_allclose(
        one.scene.system.velocity(alpha, rate),
        swimmer.velocity(alpha + shift, rate),
        rtol=0,
        atol=1e-9,
    )
    shifted = [a + d for a, d in zip(one.tables.fitted.axes, shift)]
    two = geomech.connection.fit(
        swimmer.velocity, shifted, directions(swimmer, one.scene.numerics)
    )
    np.testing.assert_allclose(one.tables.fitted.A, two.A, atol=1e-9)


PLUGIN = """
import numpy as np, geomech

@geomech.register(joints=2, lengths=(1, 1, 1))
def bent(alpha, rest=0.0):
    back, front = -alpha[0] - rest, alpha[1] + rest
    tail = [-(1 + np.cos(back)) / 2, -np.sin(back) / 2, back]
    return [tail, [0, 0, 0], [(1 + np.cos(front)) / 2, np.sin(front) / 2, front]]
"""
SCENE = '[medium]\nname = "viscous-2"\n[body]\nkind = "bent"\n[gait]\nkind = "circle"\n[numerics]\ngrid = 7\nphases = 16\n'


def test_scenes_name_a_function_of_a_file(tmp_path):
    (tmp_path / "bent.py").write_text(PLUGIN)
    (tmp_path / "bent.toml").write_text(SCENE)
    given = ("--amplitudes", "0.8", "--tiers", "direct", "--json")
    code, text, err = run(
        "displacement", "bent.toml", *given, "--plugin", "bent.py", cwd=tmp_path
    )
    assert (code, err) == (0, "")
    (tmp_path / "chain.toml").write_text(SCENE.replace("bent", "chain"))
    expected = run("displacement", "chain.toml", *given, cwd=tmp_path)[1]
    np.testing.assert_allclose(
        *(tabled_json(x)["direct"] for x in (text, expected)), atol=1e-11
    )
    assert load_file(tmp_path / "bent.py") == ["bent"]
    (tmp_path / "rest.toml").write_text(
        SCENE.replace('"bent"', '"bent"\nrest = 0.3\nlength = 0.2\nframe = "link-2"')
    )
    scene = load(tmp_path / "rest.toml")
    body = scene.system.body
    assert (body.rest, body.length, body.frame, body.joints, body.lengths) == (
        0.3,
        0.2,
        "link-2",
        2,
        (1.0, 1.0, 1.0),
    )
    assert pickle.loads(pickle.dumps(body)) == body and "rest = 0.3" in toml(scene)
    assert body.points([0.0, 0.0]) == pytest.approx(
        Chain(length=0.2, frame="link-2").points([0.3, 0.3])
    )


@pytest.mark.parametrize(
    ("function", "says"),
    [
        (
            lambda alpha: np.zeros((2, 3)),
            r"poses \(x, y, theta\) of the links, \(3, 3\), got \(1, 2, 3\)",
        ),
        (lambda alpha: np.full((3, 3), np.nan), "positions must return finite numbers"),
        (lambda alpha: alpha.missing, "positions fails: AttributeError"),
        (lambda alpha: [["x"] * 3] * 3, "positions must be real numbers"),
    ],
)
def test_functions_that_return_no_poses_are_refused(function, says):
    with pytest.raises(Refusal, match=says):
        Positions(function, 2, (1, 1, 1))
    with pytest.raises(Refusal, match="frame must be 'mean' or 'link-1' ... 'link-3'"):
        Positions(hinged, 2, (1, 1, 1), frame="link-4")
    with pytest.raises(Refusal, match="lengths must all be finite and > 0"):
        Positions(hinged, 2, (1, -1, 1))


def test_bodies_that_are_built_in_have_mirror_images():
    for body in (*BODIES.examples().values(), Backbone(5)):
        assert geomech.Swimmer(Coulomb(), body).traits.mirror
