"""The chain: its geometry against a drawing made link by link, its frames, its bounds."""

import numpy as np
import pytest
from registry import BODIES

from rft import Chain
from rft.formulas.link import Load
from rft.formulas.newton import element_net, to_element, to_frame


def by_hand(body, alpha):
    """Headings (n,) and centres (n, 2) of the links in the body's frame, one link after the other; unit body."""
    lengths = np.array(body.lengths) / sum(body.lengths)
    alpha = (
        alpha
        if body.modes is None
        else sum(m * np.array(row) for m, row in zip(alpha, body.modes))
    )
    headings, centres, tip = [], [], np.zeros(2)
    heading = 0.0
    for k, length in enumerate(lengths):
        heading += alpha[k - 1] if k else 0.0
        along = np.array([np.cos(heading), np.sin(heading)])
        headings.append(heading)
        centres.append(tip + length / 2 * along)
        tip = tip + length * along
    headings, centres = np.array(headings), np.array(centres)
    if body.frame == "mean":
        zero, origin = lengths @ headings, lengths @ centres
    else:
        k = int(body.frame[5:]) - 1
        zero, origin = headings[k], centres[k]
    c, s = np.cos(zero), np.sin(zero)
    return headings - zero, (centres - origin) @ np.array([[c, -s], [s, c]])


@pytest.mark.parametrize(
    "name", [n for n, body in BODIES.items() if isinstance(body, Chain)]
)
def test_links_are_where_they_should_be(name):
    body, rng = BODIES[name], np.random.default_rng(0)
    alpha = rng.uniform(-3, 3, (body.joints, 7))
    motion = body.motion(alpha, np.zeros_like(alpha))
    for b in range(7):
        headings, centres = by_hand(body, alpha[:, b])
        np.testing.assert_allclose(
            [motion.c[:, b], motion.s[:, b]],
            [np.cos(headings), np.sin(headings)],
            atol=1e-14,
        )
        lever = np.stack(
            [-centres[:, 1], centres[:, 0]], -1
        )  # velocity of the centres under a unit turn
        np.testing.assert_allclose(
            motion.r_t[:, b],
            (lever * np.stack([motion.c, motion.s], -1)[:, b]).sum(-1),
            atol=1e-14,
        )
        np.testing.assert_allclose(
            motion.r_n[:, b],
            (lever * np.stack([-motion.s, motion.c], -1)[:, b]).sum(-1),
            atol=1e-14,
        )


@pytest.mark.parametrize(
    "name", [n for n, body in BODIES.items() if isinstance(body, Chain)]
)
def test_velocities_are_the_rates_of_places(name):
    body, rng, h = BODIES[name], np.random.default_rng(1), 1e-6
    alpha, alphadot = rng.uniform(-2, 2, (2, body.joints))
    motion = body.motion(alpha[:, None], alphadot[:, None])
    (h1, p1), (h0, p0) = (
        by_hand(body, alpha + h * alphadot),
        by_hand(body, alpha - h * alphadot),
    )
    velocity, turn = (p1 - p0) / (2 * h), (h1 - h0) / (2 * h)
    c, s = motion.c[:, 0], motion.s[:, 0]
    own = (
        c * velocity[:, 0] + s * velocity[:, 1],
        c * velocity[:, 1] - s * velocity[:, 0],
        turn * motion.half[:, 0],
    )
    np.testing.assert_allclose(motion.v[..., 0], own, atol=1e-9)


def test_carried_and_wrench_are_transposes():
    body, rng = BODIES["uneven"], np.random.default_rng(2)
    motion = body.motion(*rng.normal(size=(2, 2, 6)))
    xi, force = rng.normal(size=(3, 6)), rng.normal(size=(3, 3, 6))
    power = sum(f * v for f, v in zip(force, to_element(motion, *xi))).sum(0)
    np.testing.assert_allclose(
        power, (xi * np.stack(to_frame(motion, *force)).sum(1)).sum(0), rtol=1e-12
    )
    H = rng.normal(size=(3, 3, 3, 6))
    load = Load(*(x for row in range(3) for x in (force[row], *H[row])))
    v = rng.normal(size=(3, 3, 6))
    net = element_net(motion, load, v, 0.7)
    wrench = lambda f: np.stack(to_frame(motion, *(motion.weight * f))).sum(1)
    tangent = lambda v: wrench(
        np.einsum("ijnb,jnb->inb", H, np.stack(np.broadcast_arrays(*v, motion.c)[:3]))
    )
    total = lambda triple: np.stack(triple).sum(1)
    np.testing.assert_allclose(total(net.force), wrench(force), rtol=1e-12)
    for column, unit in zip(net[1:4], np.eye(3)):
        np.testing.assert_allclose(
            total(column),
            0.7 * tangent(to_element(motion, *unit)),
            rtol=1e-10,
            atol=1e-12,
        )
    np.testing.assert_allclose(
        total(net.by_speed), 0.7 * tangent(v), rtol=1e-10, atol=1e-12
    )


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Chain((1,)), "at least two links, got 1"),
        (lambda: Chain((1, -2)), r"finite and > 0, got \[1.0, -2.0\]"),
        (lambda: Chain((1, float("inf"))), "finite and > 0"),
        (
            lambda: Chain(length=0.0),
            "length must be a number from 1e-15 to 1e\\+15 m, got 0.0",
        ),
        (lambda: Chain(frame="link-4"), "'link-1' ... 'link-3', got 'link-4'"),
        (lambda: Chain(frame="head"), "got 'head'"),
        (lambda: Chain((1e308,) * 3), "finite and > 0"),
        (lambda: Chain((1, 1e-13)), "at least 1e-12 of the body"),
        (lambda: Chain(3), "must be a list of numbers"),
    ],
)
def test_bad_chains_are_refused(make, said):
    with pytest.raises(ValueError, match=said):
        make()
