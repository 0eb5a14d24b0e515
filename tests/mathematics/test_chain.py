"""The chain: its geometry against a drawing made link by link, and its bounds."""

import numpy as np
import pytest
from registry import BODIES

from rft import Chain

CHAINS = [name for name, body in BODIES.items() if isinstance(body, Chain)]


def by_hand(body, alpha):
    """Return headings (n,) and centres (2, n) of the links in the body's frame, link by
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
    return headings - zero, turned.T


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


@pytest.mark.parametrize("name", CHAINS)
def test_links_are_where_they_should_be_and_move_so(name):
    """r_t and r_n: velocity of a centre along and across its link under a unit turn."""
    body = BODIES[name]
    alpha, alphadot = np.random.default_rng(1).uniform(-3, 3, (2, body.joints))
    motion = body.motion(alpha[:, None], alphadot[:, None])
    headings, (x, y) = by_hand(body, alpha)
    c = np.cos(headings)
    s = np.sin(headings)
    found = np.array([motion.c, motion.s, motion.r_t, motion.r_n])[..., 0]
    np.testing.assert_allclose(found, [c, s, x * s - y * c, y * s + x * c], atol=1e-14)
    after, later = by_hand(body, alpha + 1e-6 * alphadot)
    before, earlier = by_hand(body, alpha - 1e-6 * alphadot)
    v_x, v_y = (later - earlier) / 2e-6
    turn = (after - before) / 2e-6
    own = c * v_x + s * v_y, c * v_y - s * v_x, turn * motion.half[:, 0]
    np.testing.assert_allclose(motion.v[..., 0], own, atol=1e-8)
