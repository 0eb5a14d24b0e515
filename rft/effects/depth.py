"""Depth below the surface other than the reference one: drag grows in proportion to it (paper Eq. 2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rft.contact import Model, PerSample
from rft.effects.base import Process, Site
from rft.media.base import check_ranges, real_array, require, shown
from rft.premise import NONE, Premise


@dataclass(frozen=True)
class DepthProfile(Process):
    """Drag times |z| over the depth that the medium's drag is for: 2 k rho g r |z| of Eq. 2, its other factors the same.

    along (-): |z| over that depth at equally spaced places from tail to head, linear between them; [1, 1] is level.
    slope (per body length): what the place on the ground adds to it, where the surface is not level above a level plane of
    motion. towards (rad): the direction in which it rises, from the frame's heading at the start.

    A piece of body counts as its centre. With a slope, place and heading matter.
    """

    along: tuple[float, ...] = (1.0, 1.0)
    slope: float = 0.0
    towards: float = 0.0

    kind = "depth-profile"
    odd = True
    limit = "along all 1 and slope = 0"
    cost = "one multiplication an element; with a slope, a step at a time in place of all phases at once"
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

    def at(self, state, site: Site) -> Deep:
        return Deep(self, site)

    def depths(self, stations: np.ndarray, place: np.ndarray) -> np.ndarray:
        """(n, B), relative, at stations along the body (n,) that are at complex places (n, B) on the ground."""
        level = np.interp(stations, np.linspace(0, 1, len(self.along)), self.along)[:, None]
        if not self.breaks:
            return level
        depth = level + self.slope * (place * np.exp(-1j * self.towards)).real
        if not (depth > 0).all():
            raise ValueError("the body comes to the surface: lower the slope of the depth profile, or run fewer cycles")
        return depth


@dataclass(frozen=True)
class Deep:
    """A depth profile at one site: it acts on all that is buried."""

    profile: DepthProfile
    site: Site

    def apply(self, model: Model) -> Model:
        for name, contact in model.contacts.items():
            if contact.buried:
                stations = contact.places(self.site.motions[name])
                depth = self.profile.depths(stations, self.site.place(name))
                model = model.changed(name, factors=(Multiplied(depth),))
        return model


@dataclass(frozen=True)
class Multiplied(PerSample):
    """Drag times a number of each element and sample, (n, B)."""

    by: np.ndarray

    @property
    def numbers(self) -> tuple:
        """For compiled code (`rft.backend`)."""
        return self.by, self.by, self.by

    def __call__(self, v_t, v_n, spin) -> tuple[np.ndarray, np.ndarray]:
        return self.by, self.by
