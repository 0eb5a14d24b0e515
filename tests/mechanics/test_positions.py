"""Bodies from a function of shape that returns the poses of links: against chains and
backbones that are built in."""

import numpy as np
import pytest
from refusals import refuses

import geomech
from geomech.mathematics.gaits import Circle
from geomech.scenes import load, toml
from geomech.scenes.kinds import load_file
from rft import Chain, Granular, Viscous
from rft.bodies import Positions

pytestmark = pytest.mark.usefixtures("fastest", "own_parts")
SAND = Granular(C=1.8, gamma0=0.24)
RNG = np.random.default_rng(4)
ALPHA, RATE = RNG.uniform(-2, 2, (2, 2, 40))


def hinged(alpha):
    """Three links seen from the middle one, one shape at a time; the tail's heading is
    wrapped."""
    back, front = -alpha[0] + 4 * np.pi, alpha[1]
    tail = [-(1 + np.cos(back)) / 2, -np.sin(back) / 2, back]
    return [tail, [0, 0, 0], [(1 + np.cos(front)) / 2, np.sin(front) / 2, front]]


def uneven(alpha):
    """Links from the tail on, many shapes at once, in an own frame that turns and moves
    with the shape."""
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
    body = Positions(function, 2, lengths, length, frame)
    chain = Chain(lengths, length, frame)
    for x, y in zip(body.motion(ALPHA, RATE), chain.motion(ALPHA, RATE)):
        np.testing.assert_allclose(np.broadcast_to(x, y.shape), y, atol=1e-11)
    drawn = (x.points(ALPHA.T, [1, 2, 0.3]) for x in (body, chain))
    np.testing.assert_allclose(*drawn, atol=1e-14)


def test_a_body_that_is_bent_at_rest_has_no_mirror_image():
    shift = np.array([0.4, 0.1])
    bent = Positions(lambda alpha: hinged(alpha + shift), 2, (1, 1, 1))
    swimmer = geomech.Swimmer(SAND, bent)
    assert not swimmer.traits.mirror
    found = swimmer.velocity(ALPHA.T, RATE.T)
    chain = geomech.Swimmer(SAND, Chain()).velocity(ALPHA.T + shift, RATE.T)
    np.testing.assert_allclose(found, chain, atol=1e-8)


PLUGIN = """
import numpy as np, geomech

@geomech.register(joints=2, lengths=(1, 1, 1))
def bent(alpha, rest=0.0):
    back, front = -alpha[0] - rest, alpha[1] + rest
    tail = [-(1 + np.cos(back)) / 2, -np.sin(back) / 2, back]
    return [tail, [0, 0, 0], [(1 + np.cos(front)) / 2, np.sin(front) / 2, front]]
"""
SCENE = '[medium]\nname = "viscous-2"\n[body]\nkind = "bent"\n[gait]\nkind = "circle"\n[numerics]\ngrid = 7\nphases = 16\n'


def test_parameters_of_a_function_are_keys_of_its_scene(tmp_path):
    (tmp_path / "bent.py").write_text(PLUGIN)
    assert load_file(tmp_path / "bent.py") == ["bent"]
    more = '"bent"\nrest = 0.3\nlength = 0.2\nframe = "link-2"'
    (tmp_path / "rest.toml").write_text(SCENE.replace('"bent"', more))
    scene = load(tmp_path / "rest.toml")
    body, chain = scene.system.body, Chain(length=0.2, frame="link-2")
    assert body.points([0.0, 0.0]) == pytest.approx(chain.points([0.3, 0.3]))
    assert "rest = 0.3" in toml(scene)


@pytest.mark.parametrize(
    ("function", "given", "says"),
    [
        (
            lambda alpha: [["x"] * 3] * 3,
            {},
            "positions real | value",
        ),
        (hinged, {"frame": "link-4"}, "frame mean link-1 link-3 | value"),
        (hinged, {"lengths": (1, -1, 1)}, "lengths finite 0 | value"),
    ],
)
def test_functions_that_return_no_poses_are_refused(function, given, says):
    with refuses(says):
        Positions(function, 2, **({"lengths": (1, 1, 1)} | given))


@pytest.mark.parametrize(("function", "lengths", "length"), PAIRS)
@pytest.mark.parametrize("medium", [Viscous(2.0), SAND])
def test_three_links_have_the_connection_of_the_chain(
    function, lengths, length, medium
):
    one, two = (
        geomech.study(medium, body, Circle(), grid=5, extent=2.0)
        for body in (Positions(function, 2, lengths, length), Chain(lengths, length))
    )
    np.testing.assert_allclose(one.tables.fitted.A, two.tables.fitted.A, atol=1e-11)
    assert one.scene.system.traits.mirror
