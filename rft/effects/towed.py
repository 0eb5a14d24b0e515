"""A sled towed by the tail: friction at a point behind the last link."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from rft.core.checks import Number, check_numbers
from rft.core.refusal import require
from rft.effects.base import EFFECTS, Effect, InMetres
from rft.effects.contact import Contact, Problem
from rft.laws.base import speed_exponent
from rft.laws.coulomb import Coulomb


@EFFECTS.register
@dataclass(frozen=True)
class TowedSled(Effect):
    """Isotropic Coulomb friction at the end of a stiff bar that continues the tail
    link.

    The sled lies on the surface, so that its friction does not depend on the body's
    depth. Dry media only: beside drag that grows with speed, friction would depend on
    the unit of time.

    Examples
    --------
    >>> from rft import Chain, Granular, body_velocity
    >>> from rft.effects import TowedSled
    >>> law = Granular(1.8, 0.24)
    >>> sled = TowedSled(pull=0.2)
    >>> body_velocity(law, Chain(), [0.5, 0.3], [1.0, 0.0], effects=[sled]).xi.round(4)
    array([ 0.0071, -0.0021, -0.1022])
    """

    pull: Annotated[
        float,
        Number(
            0,
            1000,
            "-",
            "friction of the sled over the axial drag of the straight body",
        ),
    ]
    distance: Annotated[
        float,
        Number(
            0, 10, "body lengths", "distance of the sled behind the tail; or distance_m"
        ),
    ] = 0.0
    distance_m: Annotated[
        float | None,
        Number(0, 1e6, "m", "distance for a body with a length, instead of distance"),
    ] = None

    kind = "towed-sled"
    knows_contact = True
    mixes_media = True
    metres = {"distance": InMetres("distance_m")}
    adds_points = odd = True
    limit = "pull = 0"
    cost = "one point load"
    batched = ("pull",)

    def __post_init__(self):
        check_numbers(self)
        self.check_lengths()

    def check(self, medium: Any) -> None:
        name = type(medium).__name__
        require(
            speed_exponent(medium) == 0,
            "a towed sled needs a medium without viscous drag, because its own "
            f"friction is dry, got {name}",
        )

    def apply(self, problem: Problem, site: Any = None, state: Any = None) -> Problem:
        e = problem.sides.elements
        point = e.attached_points([0], -(e.half[:1] + self.distance), np.ones((1, 1)))
        sled = Contact(point, station=np.zeros((1, 1)), buried=np.zeros((1, 1)))
        sled = sled.with_factors(self.pull, self.pull, self.pull)
        return problem.with_points(sled, Coulomb().dry)

    @classmethod
    def examples(cls, x: float = 0.3) -> dict[str, TowedSled]:
        return {"towed-sled": cls(pull=x, distance=0.3)}
