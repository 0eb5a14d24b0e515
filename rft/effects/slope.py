"""Sloping ground: drag is weaker on downhill motion, and the body's weight pulls
downhill (paper Sec. IV B)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from rft.core.checks import Number, check_numbers
from rft.core.premise import Premise
from rft.core.refusal import require
from rft.effects.base import EFFECTS, Effect, Site
from rft.effects.contact import Problem
from rft.formulas.link import Incline
from rft.laws.base import is_linear
from rft.laws.catalogue import REPOSE
from rft.laws.incline import (
    assumed_of_incline,
    incline_factors,
    require_below_repose,
)


@EFFECTS.register
@dataclass(frozen=True)
class Slope(Effect):
    """A plane surface that rises by an angle, and a body that moves along it at a fixed
    depth.

    The drag is multiplied by cos(angle) - d sin(angle) / tan(repose)
    (`rft.laws.incline`), where d is the downhill part of the unit velocity of an
    element's centre, 0 across and uphill. With the default of repose, 37.9 degrees,
    motion straight downhill at 20 degrees has half the drag of level ground, as
    measured (paper Sec. IV B). Only one direction at one angle has been measured;
    assumed are a drag that falls in proportion to d, no gain uphill, and the same
    factor along and across an element. Weight adds the force weight sin(angle)
    downhill.

    Examples
    --------
    >>> import numpy as np
    >>> from rft import Chain, Granular, time_steps
    >>> from rft.effects import Slope
    >>> t = 2 * np.pi * np.arange(32) / 32
    >>> alpha = np.stack([np.cos(t), np.sin(t)], -1)
    >>> alphadot = np.stack([-np.sin(t), np.cos(t)], -1)
    >>> slope = Slope(angle=0.2)
    >>> law = Granular(1.8, 0.24)
    >>> steps = time_steps(law, Chain(), alpha, alphadot, effects=[slope])
    >>> steps.pose[-1, :2].round(3)  # x, y after the cycle, body lengths
    array([-0.086,  0.002])
    """

    angle: Annotated[
        float, Number(0, math.pi / 2, "rad", "angle by which the surface rises")
    ]
    towards: Annotated[
        float,
        Number(
            -1e6,
            1e6,
            "rad",
            "direction of the rise, from the heading of the frame at the start",
        ),
    ] = 0.0
    repose: Annotated[
        float,
        Number(
            0.01,
            1.5,
            "rad",
            "angle of repose, at which the ground slides by itself; must exceed angle",
        ),
    ] = REPOSE
    weight: Annotated[
        float,
        Number(
            0,
            1e6,
            "-",
            "weight of the body over its axial drag when straight",
        ),
    ] = 0.0

    kind = "slope"
    knows_contact = True
    breaks = Premise.SE2_SYMMETRIC
    limit = "angle = 0"
    cost = (
        "two dozen operations per element, and phases solved one after another "
        "instead of all at once"
    )
    batched = ("angle", "towards", "repose", "weight")
    varies_along = True

    def __post_init__(self):
        check_numbers(self)
        require_below_repose(self.angle, self.repose)
        pull = self.weight * math.sin(self.angle)
        level_factor, downhill_loss = incline_factors(self.angle, self.repose)
        drag = level_factor - downhill_loss
        require(
            pull < drag,
            "a body of this weight slides down",
            because=f"its pull along the slope, {pull:.3g} of the drag on level "
            f"ground, must be less than the drag downhill, {drag:.3g}",
        )

    def check(self, medium: Any) -> None:
        require(
            not is_linear(medium),
            f"a slope needs a granular medium, got {type(medium).__name__}",
        )

    def assumes(self, medium: Any) -> str:
        return assumed_of_incline(self.repose, "an element")

    def apply(self, problem: Problem, site: Site, state: Any = None) -> Problem:
        level_factor, downhill_loss = incline_factors(self.angle, self.repose)
        uphill = np.exp(1j * np.asarray(self.towards))

        def inclined(contact, weight):
            downhill = -uphill * np.conj(site.headings(contact.elements))
            incline = Incline(
                downhill.real,
                downhill.imag,
                level_factor=np.atleast_2d(level_factor),
                downhill_loss=np.atleast_2d(downhill_loss),
                weight=np.atleast_2d(weight),
            )
            return contact._replace(incline=incline)

        weight = self.weight * np.sin(self.angle) * problem.axial_drag
        return problem._replace(
            sides=inclined(problem.sides, weight), points=inclined(problem.points, 0.0)
        )

    @classmethod
    def examples(cls, x: float = 0.3) -> dict[str, Slope]:
        return {"slope": cls(angle=x, towards=2.0, repose=0.6, weight=0.3)}
