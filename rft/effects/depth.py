"""Depth below the surface other than the reference one: drag grows in proportion to it (paper Eq. 2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rft.bodies.base import Body, stations
from rft.effects.base import Effect, Here
from rft.loads import ALONE
from rft.media.base import check_ranges, real_array, require, shown
from rft.premise import NONE, Premise


@dataclass(frozen=True)
class DepthProfile(Effect):
    """Drag times |z| over the depth that the medium's drag is for: 2 k rho g r |z| of Eq. 2, its other factors the same.

    along: |z| over that depth at equally spaced places from tail to head, linear between them; (1, 1) is level. slope:
    what the place on the ground adds to it per body length (a surface that is not level above a level plane of motion),
    rising in the direction ``towards``, rad from the frame's heading at the start. A piece of body
    counts as its centre. With a slope, place and heading matter.
    """

    along: tuple[float, ...] = (1.0, 1.0)
    slope: float = 0.0
    towards: float = 0.0

    kind = "depth-profile"
    limit = "along all 1 and slope = 0"
    cost = "one multiplication an element; with a slope, a step at a time in place of all phases at once"
    rank = 4
    batched = ("slope", "towards")
    angles = ("towards",)
    varies = True

    def __post_init__(self):
        along = real_array("along", self.along)
        good = along.ndim == 1 and along.size >= 2 and ((along > 0) & (along <= 1000)).all()
        require(
            good, f"along must be two depths or more, over the reference depth, > 0 to 1000, got {shown(self.along)}"
        )
        object.__setattr__(self, "along", tuple(along.tolist()))
        check_ranges(self, slope=(0, 1000), towards=(-1e6, 1e6))

    @property
    def breaks(self) -> Premise:
        return Premise.SE2_SYMMETRIC if np.any(self.slope) else NONE

    def load(self, load, medium, body: Body):
        depth = _depths(self.along, body)
        return _scaled(load, lambda known: depth)

    def at(self, memory, here: Here) -> Effect:
        if not self.breaks:
            return self
        reach = here.motion.half * here.along
        place = np.concatenate([here.place, here.place[:1] - reach[:1], here.place[-1:] + reach[-1:]])  # and both ends
        return _There(self.along, self.slope * (place * np.exp(-1j * self.towards)).real)


@dataclass(frozen=True, eq=False)
class _There(Effect):
    """The effect at one place: added (n + 2, B), relative depth that the ground adds at the elements and both ends."""

    along: tuple[float, ...]
    added: np.ndarray
    rank = DepthProfile.rank

    def load(self, load, medium, body: Body):
        depth = _depths(self.along, body)
        depth = depth + self.added[: len(depth)]  # the ends count where they have caps
        if not (depth > 0).all():
            raise ValueError("the body comes to the surface: lower the slope of the depth profile, or run fewer cycles")
        return _scaled(load, lambda known: known.of(depth))


def _depths(along, body: Body) -> np.ndarray:
    """(n, 1): depth of the elements' centres on a level ground."""
    return np.interp(stations(body), np.linspace(0, 1, len(along)), along)[:, None]


def _scaled(load, depth):
    def law(a, m, w, eps, known=ALONE):
        return load(a, m, w, eps, known) * depth(known)

    return law
