"""The chain: its geometry against a drawing made link by link, and its bounds."""

import numpy as np
import pytest
from registry import BODIES

from rft import Chain
from rft.formulas.newton import to_element, to_frame

CHAINS = [name for name, body in BODIES.items() if isinstance(body, Chain)]


def by_hand(body, alpha):
    """Return headings (n,) and centres (n, 2) of the links in the body's frame, link by
    link, of a body of length 1."""
    lengths = np.array(body.lengths) / sum(body.lengths)
    if body.modes is not None:
        alpha = alpha @ np.array(body.modes)
    headings = np.concatenate([[0.0], np.cumsum(alpha)])
    steps = lengths[:, None] * np.stack([np.cos(headings), np.sin(headings)], -1)
    centres = np.cumsum(steps, 0) - steps / 2
    weights = lengths
    if body.frame != "mean":
        weights = np.eye(len(lengths))[int(body.frame.removeprefix("link-")) - 1]
    zero = weights @ headings
    c = np.cos(zero)
    s = np.sin(zero)
    turned = (centres - weights @ centres) @ np.array([[c, -s], [s, c]])
    return headings - zero, turned


@pytest.mark.parametrize("name", CHAINS)
def test_links_are_where_they_should_be(name):
    """r_t and r_n: velocity of a centre along and across its link under a unit turn."""
    body = BODIES[name]
    alpha = np.random.default_rng(0).uniform(-3, 3, (body.joints, 7))
    motion = body.motion(alpha, np.zeros_like(alpha))
    for k in range(7):
        headings, centres = by_hand(body, alpha[:, k])
        x, y = centres.T
        c = np.cos(headings)
        s = np.sin(headings)
        expected = [c, s, x * s - y * c, y * s + x * c]
        found = [v[:, k] for v in (motion.c, motion.s, motion.r_t, motion.r_n)]
        np.testing.assert_allclose(found, expected, atol=1e-14)


@pytest.mark.parametrize("name", CHAINS)
def test_velocities_are_the_rates_of_places(name):
    body = BODIES[name]
    alpha, alphadot = np.random.default_rng(1).uniform(-2, 2, (2, body.joints))
    motion = body.motion(alpha[:, None], alphadot[:, None])
    h1, p1 = by_hand(body, alpha + 1e-6 * alphadot)
    h0, p0 = by_hand(body, alpha - 1e-6 * alphadot)
    x, y = (p1 - p0).T / 2e-6
    turn = (h1 - h0) / 2e-6
    c = motion.c[:, 0]
    s = motion.s[:, 0]
    own = c * x + s * y, c * y - s * x, turn * motion.half[:, 0]
    np.testing.assert_allclose(motion.v[..., 0], own, atol=1e-9)


def test_carried_and_wrench_are_transposes():
    rng = np.random.default_rng(2)
    motion = BODIES["uneven"].motion(*rng.normal(size=(2, 2, 6)))
    xi = rng.normal(size=(3, 6))
    force = rng.normal(size=(3, 3, 6))
    power = (force * np.stack(to_element(motion, *xi))).sum((0, 1))
    wrench = np.stack(to_frame(motion, *force)).sum(1)
    np.testing.assert_allclose(power, (xi * wrench).sum(0), rtol=1e-12)


@pytest.mark.parametrize(
    ("lengths", "said"),
    [
        ((1, float("inf")), "finite and > 0"),
        ((1e308,) * 3, "finite and > 0"),
        ((1, 1e-13), "at least 1e-12 of the body"),
    ],
)
def test_bad_chains_are_refused(lengths, said):
    with pytest.raises(ValueError, match=said):
        Chain(lengths)
