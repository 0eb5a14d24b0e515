"""Transient response of the ground: on reversal the drag across the body builds up over some travel (paper Sec. IV
A)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from rft.checks import Number, check_numbers
from rft.contact import Problem
from rft.effects.base import Effect, Site
from rft.link import decay, pivot_of
from rft.premise import Premise

SHORTEST = 1e-6  # body lengths: a travel of an element at rest, which creeps at the regularisation
SIGN = np.array([1.0, -1.0])[:, None, None]  # of motion to the left, for the shares to the left and to the right
DEVELOPED = 3.0  # e-foldings: 95 % of the steady drag is there after the travel


@dataclass(frozen=True)
class Transient(Effect):
    """Each element remembers how far the ground's response to motion to its left and to its right has developed, 0 to
    1.

    Travel x one way brings that side's share h nearer to 1, dh/dx = 3 (1 - h) / travel, and takes the other side's
    away, dh/dx = -3 h / travel. The drag across is the steady one times the share of the side it moves to.

    The paper gives a travel of about a fifth of the amplitude of an oscillating rod. That the approach is exponential,
    that it starts from nothing, and that the drag along the body needs none are assumed. A piece of body remembers the
    means of its shares. At every step it is cut where it does not move across, and each part builds up with its own
    mean velocity, so that no travel gives the steady drag however long the pieces. Order 1 is that of a body that
    slides along itself as it reverses; with links that come to rest there, in a dry medium, it is 1/2."""

    travel: Annotated[float, Number(0, 10, "body lengths", "travel over which 95 % of the drag comes back")]

    kind = "transient"
    breaks = Premise.MEMORYLESS
    limit = "travel = 0"
    cost = "two shares an element, one link integral more where its pivot lies inside"
    batched = ("travel",)
    varies = True

    def __post_init__(self):
        check_numbers(self)

    def begin(self, problem: Problem, site: Site) -> np.ndarray:
        """Return the shares (2, n, B) to the left and right; the ground resists fully either way."""
        return np.ones((2, *problem.sides.elements.c.shape))

    def apply(self, problem: Problem, site: Site, past: np.ndarray) -> Problem:
        left, right = past
        dt, rate = np.full((1, 1), site.dt), np.atleast_2d(self.rate)
        memory = problem.memory._replace(left=left, right=right, before=site.before[1], dt=dt, rate=rate)
        return problem._replace(memory=memory)

    def after(self, problem: Problem, site: Site, past: np.ndarray, v) -> np.ndarray:
        velocity, left = sides(v[1], v[2])
        share_remains, lack_remains, _, _ = decay(SIGN * site.before[1], SIGN * velocity, site.dt, self.rate)
        own = (
            1 - (1 - share_remains * past) * lack_remains
        )  # to the left in the part that moves left, and so to the right
        other = (
            1 - share_remains * (1 - past[::-1])
        ) * lack_remains  # what one side loses another gains in the same way
        return np.array([left * own[0] + (1 - left) * other[1], left * other[0] + (1 - left) * own[1]])

    @property
    def rate(self) -> np.ndarray:
        """E-foldings of a share to a body length of travel; infinite without travel."""
        return np.where(np.asarray(self.travel) > 0, DEVELOPED / np.maximum(self.travel, SHORTEST), np.inf)


def sides(v_n: np.ndarray, v_w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return mean velocities (2, n, B) of the parts of elements that move to the left and to the right, 0 where there
    is none, and the left one's share of the length (n, B)."""
    _, inside, _ = pivot_of(v_n, v_w)
    turn = np.abs(v_w)
    left = np.where(inside, (v_n + turn) / 2, np.maximum(v_n, 0.0))
    right = np.where(inside, (v_n - turn) / 2, np.minimum(v_n, 0.0))
    return np.array([left, right]), np.where(inside, (1 + v_n / np.where(inside, turn, 1.0)) / 2, v_n > 0)
