"""Transient response of the ground: on reversal the drag across the body builds up over some travel (paper Sec. IV
A)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from rft.checks import Number, check_numbers
from rft.contact import Problem
from rft.effects.base import EFFECTS, Effect, Site
from rft.link import decay, find_pivot
from rft.premise import Premise

SHORTEST = 1e-6  # body lengths, least travel: an element at rest creeps at the regularisation
SIGN = np.array([1.0, -1.0])[:, None, None]  # of v_n towards the left and the right side
E_FOLDINGS = 3.0  # of a share over the travel: exp(-3) = 5 % of the steady drag is then missing


@EFFECTS.register
@dataclass(frozen=True)
class Transient(Effect):
    """Drag across that builds up on reversal: each side of each element has a developed share of it, 0 to 1.

    While an element travels by x towards one side, that side's share h grows, dh/dx = 3 (1 - h) / travel, and the other
    side's share decays, dh/dx = -3 h / travel. The drag across is the steady one times the share of the side that the
    element moves to.

    The paper gives a travel of about a fifth of the amplitude of an oscillating rod. Assumed are the exponential form, a
    start from no drag, and no transient of the drag along the body. A piece of the body has the means of its shares.
    At every step a piece is split at its pivot, and the share of each part develops with the mean velocity of that part,
    so that travel = 0 gives the steady drag however long the pieces are. The effect vanishes at order 1 for a body that
    slides along itself as it reverses, at order 1/2 if links come to rest there, in a dry medium.

    Examples
    --------
    >>> from rft.effects import Transient, engine
    >>> engine([Transient(travel=0.12)])
    'time stepping'
    """

    travel: Annotated[float, Number(0, 10, "body lengths", "travel over which 95 % of the drag comes back")]

    kind = "transient"
    breaks = Premise.MEMORYLESS
    limit = "travel = 0"
    cost = "two shares an element, one link integral more where its pivot lies inside"
    batched = ("travel",)
    varies_along = True

    def __post_init__(self):
        check_numbers(self)

    def begin(self, problem: Problem, site: Site) -> np.ndarray:
        """Return the shares (2, n, B) of the left and the right side: all developed."""
        return np.ones((2, *problem.sides.elements.c.shape))

    def apply(self, problem: Problem, site: Site, state: np.ndarray) -> Problem:
        left, right = state
        dt, rate = np.full((1, 1), site.dt), np.atleast_2d(self.rate)
        memory = problem.memory._replace(left=left, right=right, v_n_before=site.v_before[1], dt=dt, rate=rate)
        return problem._replace(memory=memory)

    def after(self, problem: Problem, site: Site, state: np.ndarray, v: np.ndarray) -> np.ndarray:
        velocity, left = part_velocities(v[1], v[2])
        share, deficit, _, _ = decay(SIGN * site.v_before[1], SIGN * velocity, site.dt, self.rate)
        # In each part the share of the side that it moves to grows, and the share of the opposite side decays likewise.
        own = 1 - (1 - share * state) * deficit
        opposite = (1 - share * (1 - state[::-1])) * deficit
        return np.array([left * own[0] + (1 - left) * opposite[1], left * opposite[0] + (1 - left) * own[1]])

    @property
    def rate(self) -> np.ndarray:
        """E-foldings of a share per body length of travel; infinite where travel = 0."""
        return np.where(np.asarray(self.travel) > 0, E_FOLDINGS / np.maximum(self.travel, SHORTEST), np.inf)

    @classmethod
    def examples(cls, x: float = 0.3) -> dict[str, Transient]:
        return {"transient": cls(travel=2 * x)}


def part_velocities(v_n: np.ndarray, v_w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean velocities v_n (2, n, B) of the parts of elements that move left and right, 0 where a part is
    empty, and the left part's fraction of the length (n, B)."""
    _, inside, _ = find_pivot(v_n, v_w)
    difference = np.abs(v_w)  # of v_n, between centre and end
    left = np.where(inside, (v_n + difference) / 2, np.maximum(v_n, 0.0))
    right = np.where(inside, (v_n - difference) / 2, np.minimum(v_n, 0.0))
    return np.array([left, right]), np.where(inside, (1 + v_n / np.where(inside, difference, 1.0)) / 2, v_n > 0)
