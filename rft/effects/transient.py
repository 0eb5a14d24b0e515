"""Transient response of the ground: on reversal the drag across the body builds up over some travel (paper Sec. IV A)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rft.contact import SIDE, Model, PerSample
from rft.effects.base import Process, Site
from rft.media.base import check_ranges
from rft.premise import Premise
from rft.sides import parts

SHORTEST = 1e-6  # body lengths: a travel of an element at rest, which creeps at the regularisation
SIGN = np.array([1.0, -1.0])[:, None, None]  # of motion to the left, for the shares to the left and to the right
DEVELOPED = 3.0  # e-foldings: 95 % of the steady drag is there after the travel


@dataclass(frozen=True)
class Transient(Process):
    """Each element remembers how far the ground's response to motion to its left and to its right has developed, 0 to 1.

    Travel x one way brings that side's share h nearer to 1, dh/dx = 3 (1 - h) / travel, and takes the other side's away,
    dh/dx = -3 h / travel. The drag across is the steady one times the share of the side it moves to.

    travel (body lengths): over which 95 % comes back; the paper gives about a fifth of the amplitude of an oscillating rod.

    That the approach is exponential, that it starts from nothing, and that the drag along the body needs none are assumed.
    A piece of body remembers the means of its shares. At every step it is cut where it does not move across, and each part
    builds up with its own mean velocity, so that no travel gives the steady drag however long the pieces. Order 1 is that
    of a body that slides along itself as it reverses; with links that come to rest there, in a dry medium, it is 1/2.
    """

    travel: float

    kind = "transient"
    breaks = Premise.MEMORYLESS
    limit = "travel = 0"
    cost = "two shares an element, one link integral more where its pivot lies inside"
    batched = ("travel",)
    varies = True

    def __post_init__(self):
        check_ranges(self, travel=(0, 10))

    def begin(self, site: Site) -> np.ndarray:
        """(2, n, B): shares to the left and right; time stepping starts where the ground resists fully either way."""
        return np.ones((2, *site.motions[SIDE].c.shape))

    def at(self, state: np.ndarray, site: Site) -> Developed:
        return Developed(state, site.before[SIDE][1], site.dt, _rate(self.travel))

    def after(self, state: np.ndarray, site: Site, v) -> np.ndarray:
        velocity, left, _ = parts(*v[SIDE][1:])
        step = SIGN * site.before[SIDE][1], SIGN * velocity, site.dt, _rate(self.travel)
        kept, lacking, *_ = _decays(*step)
        own = 1 - (1 - kept * state) * lacking  # to the left in the part that moves left, to the right in the other
        others = (1 - kept * (1 - state[::-1])) * lacking  # what one side loses another gains in the same way
        return np.array([left * own[0] + (1 - left) * others[1], left * others[0] + (1 - left) * own[1]])


@dataclass(frozen=True)
class Developed(PerSample):
    """The shares at one step: those before (2, n, B), velocities across before (n, B), the step and e-foldings to a body
    length."""

    shares: np.ndarray
    before: np.ndarray
    dt: float
    rate: np.ndarray

    def apply(self, model: Model) -> Model:
        return model.changed(SIDE, shares=(self,))

    @property
    def numbers(self) -> tuple:
        """For compiled code (`rft.backend`)."""
        return None, (self.shares, self.before, self.dt, self.rate)

    def __call__(self, v_n, spin) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        velocity, _, inside = parts(v_n, spin)
        values, slopes = _developed(self.shares, SIGN * self.before, SIGN * velocity, self.dt, self.rate)
        slopes = SIGN * slopes
        return values, np.where(inside, 0.5, 1.0) * slopes, np.where(inside, 0.5 * np.sign(spin), 0.0) * SIGN * slopes


def _rate(travel):
    return np.where(np.asarray(travel) > 0, DEVELOPED / np.maximum(travel, SHORTEST), np.inf)


def _developed(share, before, now, dt: float, rate):
    """A share after a step in which the velocity towards its side went evenly from ``before`` to ``now`` >= 0, and its
    derivative with respect to ``now``: order 2 in dt. Where it went the other way before, the share first decays."""
    kept, lacking, back, growth = _decays(before, now, dt, rate)
    kept = share * kept
    slope = np.where(np.isinf(rate), 0.0, rate) * dt / 2 * lacking * (growth * (1 - kept) + back * kept)
    return 1 - (1 - kept) * lacking, slope


def _decays(before, now, dt: float, rate):
    """What is left of a share after the way back, and of what it lacks after the way on (nothing where it develops at once);
    the way back, and how the way on grows with ``now``, over dt / 2 x e-foldings a length."""
    forth = before >= 0
    total = np.abs(before) + now
    total = np.where(total == 0, 1.0, total)
    old, new = np.abs(before) / total, now / total
    back, on = np.where(forth, 0.0, old**2), np.where(forth, old + new, new**2)  # travels, over dt / 2 x total
    growth = np.where(forth, 1.0, new**2 + 2 * old * new)  # of the way on, with ``now``; that back shrinks by old^2
    at_once = np.isinf(rate)
    step = np.where(at_once, 0.0, rate) * dt / 2 * total
    return np.exp(-step * back), np.where(at_once, 0.0, np.exp(-step * on)), back, growth
