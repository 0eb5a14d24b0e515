"""Transient response of the ground: after a reversal the drag comes back over some
travel (paper Sec. IV A)."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from rft.core.checks import Number, check_numbers
from rft.core.premise import Premise
from rft.effects.base import EFFECTS, Effect, InMetres, Site
from rft.effects.contact import Problem
from rft.formulas.link import directions_after

# body lengths, least travel: an element at rest creeps at the regularisation
SHORTEST = 1e-6
# of a direction over the travel: of what is missing after a reversal exp(-3) = 5 % is
# still missing
E_FOLDINGS = 3.0
# Of the flank of a rod 12 mm in diameter that goes to and fro 24.5 mm deep in beds of 6
# mm grains, by three amplitudes together, with standard errors over three beds
# (`figures.grains.beds`, topic page on beds of grains).
AT_ONCE = 0.15  # +- 0.015; 0.035 at a depth of 15 mm
AT_ONCE_ALONG = 0.49  # +- 0.015
RATIO = 0.28  # +- 0.02


@EFFECTS.register
@dataclass(frozen=True)
class Transient(Effect):
    """Drag that recovers after a reversal: a share of it acts at once, and the rest
    recovers over a distance.

    Each element has a mean direction m, -1 to 1, of its travel x so far across the
    body, positive to the left, in which older travel counts exponentially less: dm/dx =
    3 (sign(v_n) - m) / travel. The drag across is the steady one times at_once + (1 -
    at_once) (1 + m sign(v_n)) / 2. So it takes the travel until 95 % of what a long way
    in one direction took from the other is back, and a short way takes little. Along
    the body it is the same with numbers of its own.

    The paper says that drag on an oscillating rod needs about a fifth of the amplitude,
    without more. The form and the default shares are measured in grains, where the
    travel across is 2.8 diameters of a rod. That motion along leaves the direction
    across as it is, and the other way about, is assumed. `EndCaps` bear their steady
    drag.

    A piece of the body has the mean of its directions. At every step a piece is split
    at its pivot, and the direction of each part develops with the mean velocity of that
    part, so that travel = 0 gives the steady drag however long the pieces are. The
    effect vanishes at order 1 for a body that slides along itself as it reverses, at
    order 1/2 if links come to rest there, in a dry medium.

    Examples
    --------
    >>> from rft.effects import Transient, engine
    >>> engine([Transient(travel=0.2)])
    'time stepping'
    """

    travel: Annotated[
        float | None,
        Number(
            0,
            10,
            "body lengths",
            "distance over which 95 % of the drag across recovers; or travel_m",
        ),
    ] = None
    at_once: Annotated[
        float, Number(0, 1, "-", "share of the drag across that acts at once")
    ] = AT_ONCE
    ratio: Annotated[
        float, Number(0, 10, "-", "distance of recovery along over the distance across")
    ] = RATIO
    at_once_along: Annotated[
        float, Number(0, 1, "-", "share of the drag along that acts at once")
    ] = AT_ONCE_ALONG
    travel_m: Annotated[
        float | None,
        Number(0, 1e6, "m", "travel for a body with a length, instead of travel"),
    ] = None

    kind = "transient"
    metres = {"travel": InMetres("travel_m")}
    breaks = Premise.MEMORYLESS
    limit = "travel = 0"
    cost = (
        "two directions per element, and one more link integral where its pivot "
        "lies inside"
    )
    batched = ("travel", "at_once", "ratio", "at_once_along", "travel_m")
    memory_bounds = (-1.0, 1.0)
    reads_place = False
    varies_along = True
    element_update = staticmethod(directions_after)

    def __post_init__(self):
        check_numbers(self)
        self.check_lengths()

    def begin(self, problem: Problem, site: Site) -> np.ndarray:
        """Return the mean directions (2, n, B) of travel along and across; the first
        step replaces them by its own."""
        return np.zeros((2, *problem.sides.elements.c.shape))

    def apply(self, problem: Problem, site: Site, state: np.ndarray) -> Problem:
        along, across = state
        v_t_before, v_n_before, _ = site.v_before
        step_along, step_across = self.steps(site.dt)
        memory = problem.memory._replace(
            along=along,
            across=across,
            v_t_before=v_t_before,
            v_n_before=v_n_before,
            at_once_along=np.array(self.at_once_along, ndmin=2),
            at_once_across=np.array(self.at_once, ndmin=2),
            step_along=step_along,
            step_across=step_across,
        )
        return problem._replace(memory=memory)

    def element_arguments(
        self, problem: Problem, site: Site, state: np.ndarray
    ) -> tuple[np.ndarray, ...]:
        return (*state, *site.v_before[:2], *self.steps(site.dt))

    def steps(self, dt: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the e-foldings of the directions along and across over a step (1, B)
        at unit speed; inf without travel, and at the first step: a body begins as if it
        had always moved as it does then."""
        return e_foldings(self.ratio * self.travel, dt), e_foldings(self.travel, dt)

    @classmethod
    def examples(cls, x: float = 0.3) -> dict[str, Transient]:
        return {"transient": cls(travel=2 * x)}


def e_foldings(travel: float | np.ndarray, dt: float) -> np.ndarray:
    """Return the e-foldings (1, B) of a mean direction over a step at unit speed; inf
    without travel or step."""
    if isinstance(travel, float):
        return _e_foldings_of_one(travel, dt)
    return _e_foldings(np.atleast_2d(travel), dt)


def _e_foldings(travel: np.ndarray, dt: float) -> np.ndarray:
    count = E_FOLDINGS * dt / np.maximum(travel, SHORTEST)
    return np.where((travel > 0) & (dt > 0), count, np.inf)


@functools.lru_cache
def _e_foldings_of_one(travel: float, dt: float) -> np.ndarray:
    # The same at every step, and as long to compute as all elements' directions.
    return _e_foldings(np.array([[travel]]), dt)
