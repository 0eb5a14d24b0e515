"""Transient response of the ground: on reversal the drag across the body builds up over some travel (paper Sec. IV A)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rft.effects.base import Effect, Here
from rft.effects.sides import parts, weakened
from rft.media.base import check_ranges
from rft.premise import Premise

SHORTEST = 1e-6  # body lengths: a travel of an element at rest, which creeps at the regularisation
SIGN = np.array([1.0, -1.0])[:, None, None]  # of motion to the left, for the shares to the left and to the right
DEVELOPED = 3.0  # e-foldings: 95 % of the steady drag is there after the travel


@dataclass(frozen=True)
class Transient(Effect):
    """Each element remembers how far the ground's response to motion to its left and to its right has developed, 0 to 1.

    Travel x one way brings that side's share h nearer to 1, dh/dx = 3 (1 - h) / travel, and takes the other side's away,
    dh/dx = -3 h / travel. The drag across is the steady one times the share of the side it moves to. travel: body
    lengths over which 95 % comes back; the paper gives about a fifth of the amplitude of an oscillating rod. That the
    approach is exponential, that it starts from nothing, and that the drag along the body needs none are assumed.
    A piece of body remembers the means of its shares. At every step it is cut where it does not move across, and each part
    builds up with its own mean velocity, so that no travel gives the steady drag however long the pieces. Order 1 is that
    of a body that slides along itself as it reverses; with links that come to rest there, in a dry medium, it is 1/2.
    """

    travel: float

    kind = "transient"
    breaks = Premise.MEMORYLESS
    limit = "travel = 0"
    cost = "two shares an element, one link integral more where its pivot lies inside"
    rank = 2  # outside disturbed ground: its memory is that of whole elements
    batched = ("travel",)
    varies = True

    def __post_init__(self):
        check_ranges(self, travel=(0, 10))

    def start(self, elements: int, samples: int) -> np.ndarray:
        """(2, n, B): shares to the left and right; a march starts where the ground resists fully either way."""
        return np.ones((2, elements, samples))

    def at(self, memory: np.ndarray, here: Here) -> Effect:
        return _Now(self.travel, memory, here.before[1], here.dt, here.scale)

    def after(self, memory: np.ndarray, here: Here, v: np.ndarray) -> np.ndarray:
        velocity, left, _ = parts(v[1], v[2])
        ends = [_developed(memory, SIGN * here.before[1], SIGN * u, here.dt, _rate(self.travel))[0] for u in velocity]
        return left * ends[0] + (1 - left) * ends[1]


@dataclass(frozen=True, eq=False)
class _Now(Effect):
    """The effect at one step, with memory (2, n, B), normal velocities before (n, B) and the scale (B,) of those now."""

    travel: float
    memory: np.ndarray
    before: np.ndarray
    dt: float
    scale: np.ndarray
    rank = Transient.rank

    def load(self, load, medium, body):
        def shares(m, w, known):
            scale, rate = known.of(self.scale), known.of(_rate(self.travel))
            velocity, _, inside = parts(scale * m, w * scale)
            before = SIGN * known.of(self.before)
            values, slopes = _developed(known.of(self.memory), before, SIGN * velocity, self.dt, rate)
            slopes = SIGN * scale * slopes
            by_w = np.where(inside, 0.5 * np.sign(w), 0.0) * slopes * SIGN
            return values, np.where(inside, 0.5, 1.0) * slopes, by_w

        return weakened(load, shares)


def _rate(travel):
    return np.where(np.asarray(travel) > 0, DEVELOPED / np.maximum(travel, SHORTEST), np.inf)


def _developed(share, before, now, dt: float, rate):
    """A share after a step in which the velocity towards its side went evenly from ``before`` to ``now``, and its
    derivative with respect to ``now``: order 2 in dt. The right's share is that of velocities to the right."""
    same = before * now >= 0
    total = np.abs(before) + np.abs(now)
    total = np.where(total == 0, 1.0, total)
    old, new = np.abs(before) / total, np.abs(now) / total
    # Travel first the old way and then, past a reversal, the new way; and its growth with |now|.
    travels = dt / 2 * total * np.array([np.where(same, old + new, old**2), np.where(same, 0.0, new**2)])
    at_once = np.isinf(rate)
    rate = np.where(at_once, 0.0, rate)
    growths = dt / 2 * np.array([np.where(same, 1.0, -(old**2)), np.where(same, 0.0, new**2 + 2 * old * new)])
    ways = np.where(same, before + now > 0, before > 0), now > 0
    slope = np.zeros_like(share)
    for way, travel, growth in zip(ways, travels, growths):
        left = np.exp(-rate * travel)
        share = way + (share - way) * left
        slope = slope * left + (way - share) * rate * growth * np.sign(now)
    return np.where(at_once, 1.0, share), slope
