"""Depth below the surface: drag grows in proportion to it (paper Eq. 2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from rft.core.checks import Number, check_numbers, real_array
from rft.core.premise import NONE, Premise
from rft.core.refusal import Refusal, require
from rft.effects.base import EFFECTS, Effect, InMetres, Site
from rft.effects.contact import Contact, Problem


@EFFECTS.register
@dataclass(frozen=True)
class DepthProfile(Effect):
    """Drag in proportion to depth, 2 k rho g r |z| of Eq. 2; depths are over the
    reference depth of the medium's drag.

    along (-): |z| over the reference depth at equally spaced places from tail to head,
    linear between them; [1, 1] is level.

    Each piece of the body has the depth of its centre. With a slope, drag depends on
    place and heading.

    Examples
    --------
    >>> from rft import Chain, Granular, body_velocity
    >>> from rft.effects import DepthProfile
    >>> tail_down = DepthProfile(along=(1.5, 1.0))
    >>> at_shape = Granular(1.8, 0.24), Chain(), [0.5, 0.3], [1.0, 0.0]
    >>> body_velocity(*at_shape, effects=[tail_down]).xi.round(3)
    array([ 0.009,  0.008, -0.139])
    """

    along: tuple[float, ...] = (1.0, 1.0)
    slope: Annotated[
        float,
        Number(
            0,
            1000,
            "per body length",
            "rise of |z| over the reference depth along the ground; or slope_per_m",
        ),
    ] = 0.0
    towards: Annotated[
        float,
        Number(
            -1e6,
            1e6,
            "rad",
            "direction of the rise, from the heading of the frame at the start",
        ),
    ] = 0.0
    slope_per_m: Annotated[
        float | None,
        Number(0, 1e9, "per m", "slope under a body with a length, instead of slope"),
    ] = None

    kind = "depth-profile"
    knows_contact = True
    metres = {"slope": InMetres("slope_per_m", -1)}
    odd = True
    limit = "along all 1 and slope = 0"
    cost = (
        "one multiplication per element; with a slope also phases solved one after "
        "another instead of all at once"
    )
    batched = ("slope", "towards", "slope_per_m")
    varies_along = True

    def __post_init__(self):
        along = real_array("along", self.along)
        require(
            along.ndim == 1
            and along.size >= 2
            and bool(((along > 0) & (along <= 1000)).all()),
            "along must be two or more depths over the reference depth, > 0 to 1000",
            value=self.along,
        )
        object.__setattr__(self, "along", tuple(along.tolist()))
        check_numbers(self)
        self.check_lengths()

    @property
    def _slopes(self) -> bool:
        return any(x is not None and np.any(x) for x in (self.slope, self.slope_per_m))

    @property
    def breaks(self) -> Premise:
        return Premise.SE2_SYMMETRIC if self._slopes else NONE

    def apply(self, problem: Problem, site: Site | None, state: Any = None) -> Problem:
        def with_depths(contact):
            depth = np.where(contact.buried > 0, self.depths(contact, site), 1.0)
            return contact.with_factors(depth, depth, depth)

        return problem._replace(
            sides=with_depths(problem.sides), points=with_depths(problem.points)
        )

    def depths(self, contact: Contact, site: Site | None) -> np.ndarray:
        """Return the depths of a contact's elements over the reference depth, (n, 1),
        or (n, B) with a slope; ValueError where a buried element comes to the
        surface."""
        places = np.linspace(0, 1, len(self.along))
        level = np.interp(contact.station, places, self.along)
        if not self.breaks:
            return level
        centres = site.centres(contact.elements)
        distance = (centres * np.exp(-1j * self.towards)).real
        depth = level + self.slope * distance
        if not (depth > 0).all(where=contact.buried > 0):
            raise Refusal(
                "the body reaches the surface",
                instead="lower the slope of the depth profile, or run fewer cycles",
            )
        return depth

    @classmethod
    def examples(cls, x: float = 0.3) -> dict[str, DepthProfile]:
        return {
            "depth-profile": cls(along=(1, 1 + x)),
            "depth-profile, slope": cls(slope=x, towards=1.0),
        }
