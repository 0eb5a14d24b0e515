"""Mass of the body: the balance of forces becomes an equation of motion
(`rft.formulas.momentum`)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from rft.core.checks import Number, check_numbers
from rft.core.premise import Premise
from rft.core.refusal import require
from rft.effects.base import EFFECTS, Effect, Site
from rft.effects.contact import Problem
from rft.formulas.momentum import (
    MomentumRate,
    element_momenta,
    frame_to_ground,
    ground_to_frame,
)
from rft.formulas.newton import to_element


@EFFECTS.register
@dataclass(frozen=True)
class BodyInertia(Effect):
    """Mass of the body, uniform along its length: d(momentum)/dt = force of the medium,
    and likewise for the moment.

    Only mass x length x (2 pi frequency)^2 / drag matters. In a viscous medium the drag
    is that at one body length per radian of phase.

    Examples
    --------
    >>> from rft.effects import BodyInertia
    >>> BodyInertia(mass=0.1, frequency=1.0, length=0.3, drag=2.0).breaks
    <Premise.RATE_INDEPENDENT|QUASI_STATIC: 9>
    """

    mass: Annotated[float, Number(0, 1e9, "kg", "mass of the body")]
    frequency: Annotated[
        float,
        Number(
            0,
            1e4,
            "1/s",
            "cycles per second; the gait gives alphadot per radian of phase",
        ),
    ]
    length: Annotated[float, Number(1e-9, 1e6, "m", "length of the body")]
    drag: Annotated[
        float,
        Number(
            1e-12,
            1e12,
            "N",
            "drag on the straight body along its axis, 2 k rho g r |z| L (Eq. 2)",
        ),
    ]

    kind = "body-inertia"
    knows_contact = True
    breaks = Premise.QUASI_STATIC | Premise.RATE_INDEPENDENT
    limit = "mass = 0"
    cost = (
        "phases solved one after another instead of all at once, and a dozen "
        "operations per sample"
    )
    batched = ("mass", "frequency", "length", "drag")

    def __post_init__(self):
        check_numbers(self)
        require(
            self.inertia <= 1000000.0,
            f"inertia is {self.inertia:.3g} times the axial drag",
            because="beyond 1e6 no gait becomes periodic",
        )

    @property
    def inertia(self) -> Any:
        """Ratio of inertia to drag, mass x length x (2 pi frequency)^2 / drag, without
        a unit."""
        return self.mass * self.length * (2 * np.pi * self.frequency) ** 2 / self.drag

    def begin(self, problem: Problem, site: Site) -> np.ndarray:
        """Return the momenta (2, 3, n, B) of the elements on the ground at the last two
        steps, the older one first."""
        return np.zeros((2, 3, *problem.sides.elements.c.shape))

    def apply(self, problem: Problem, site: Site, state: np.ndarray) -> Problem:
        older, last = state
        if site.count == 1:
            # Of order 1: only one earlier step is known.
            rate = 1.0 / site.dt
            past = last / site.dt
        else:
            rate = 1.5 / site.dt
            past = (2 * last - 0.5 * older) / site.dt
        momentum_rate = MomentumRate(
            np.full((1, 1), rate),
            *ground_to_frame(site.pose, past),
            strength=np.atleast_2d(self.inertia * problem.axial_drag),
        )
        return problem._replace(momentum_rate=momentum_rate)

    def after(
        self, problem: Problem, site: Site, state: np.ndarray, v: np.ndarray
    ) -> np.ndarray:
        new = element_momenta(problem.sides.elements, v)
        return np.stack([state[1], frame_to_ground(site.pose, new)])

    def with_velocity_change(
        self,
        problem: Problem,
        site: Site,
        state: np.ndarray,
        change: np.ndarray,
        drag: np.ndarray,
    ) -> np.ndarray:
        # Drag reduced the change of momentum during the last step, so that it was
        # larger one step earlier.
        e = problem.sides.elements
        last = element_momenta(e, to_element(e, *change))
        loss = site.dt / (self.inertia + site.dt) * drag
        older = last + e.half / e.half.sum(0) * loss[:, None]
        return state + np.stack(
            [frame_to_ground(site.pose, older), frame_to_ground(site.pose, last)]
        )

    @classmethod
    def examples(cls, x: float = 0.3) -> dict[str, BodyInertia]:
        return {
            "body-inertia": cls(mass=x, frequency=0.6, length=0.8, drag=1.3),
            "body-inertia, frequency": cls(
                mass=0.7, frequency=0.6 * x, length=0.8, drag=1.3
            ),
        }
