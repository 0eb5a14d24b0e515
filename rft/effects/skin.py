"""Skin friction: it scales the drag along the body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from rft.core.checks import Number, check_numbers
from rft.effects.base import EFFECTS, Effect
from rft.effects.contact import Problem


@EFFECTS.register
@dataclass(frozen=True)
class SkinFriction(Effect):
    """Axial drag times forward / reference where an element slides towards its head,
    backward / reference where it slides towards its tail.

    The defaults are the coefficients of the shovel-nosed snake on 0.3 mm glass, 0.109
    forward and 0.137 backward (from the literature on the snake), and about 0.15 for
    the rod whose drag gave Eqs. 2 and 3 (paper, caption of Fig. 5). For a law measured
    with an aluminium rod the reference is 0.2 (literature on the snake). Axial drag in
    proportion to friction is assumed.

    Examples
    --------
    >>> from rft import Chain, Granular, body_velocity
    >>> from rft.effects import SkinFriction
    >>> law = Granular(1.8, 0.24)
    >>> skin = SkinFriction()
    >>> body_velocity(law, Chain(), [0.5, 0.3], [1.0, 0.0], effects=[skin]).xi.round(4)
    array([ 0.0154,  0.0148, -0.1879])
    """

    forward: Annotated[
        float,
        Number(1e-3, 100, "-", "coefficient of friction when sliding towards the head"),
    ] = 0.109
    backward: Annotated[
        float,
        Number(1e-3, 100, "-", "coefficient of friction when sliding towards the tail"),
    ] = 0.137
    reference: Annotated[
        float,
        Number(
            1e-3, 100, "-", "coefficient of friction of the rod whose drag was measured"
        ),
    ] = 0.15

    kind = "skin-friction"
    knows_contact = True
    mixes_media = True
    limit = "forward = backward = reference"
    cost = "one multiplication per element"
    batched = ("forward", "backward", "reference")

    def __post_init__(self):
        check_numbers(self)

    def apply(self, problem: Problem, site: Any = None, state: Any = None) -> Problem:
        factors = self.forward / self.reference, self.backward / self.reference, 1.0
        return problem._replace(sides=problem.sides.with_factors(*factors))

    @classmethod
    def examples(cls, x: float = 0.3) -> dict[str, SkinFriction]:
        return {"skin-friction": cls(0.2 * (1 - x), 0.2 * (1 - 2 * x), 0.2)}
