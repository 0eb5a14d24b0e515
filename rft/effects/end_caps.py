"""Drag on the ends of the body: the head above all, which pushes grains out of its way."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rft.bodies.base import Kinematics
from rft.contact import Contact, Model, PerSample
from rft.effects.base import Effect
from rft.media.base import TermLaw, check_ranges, require
from rft.media.granular import Granular


class _CapLaw(TermLaw):
    """f_t = C (v.t) / sqrt(tan^2 gamma0 + (v.t)^2), f_n = v.n for the unit velocity v: the law of the body's side with
    its extra force turned to face along it."""

    def __init__(self, medium: Granular):
        self.dry = (1.0, 1.0, 0.0), (math.sin(medium.gamma0), 0.0, medium.C * math.cos(medium.gamma0))

    def at(self, v_t, v_n, eps):
        """The load (3, 4, ...) of a point: `TermLaw` with along and across exchanged."""
        f_n, f_t = self.traction(v_n, v_t, eps)
        (nn, nt), (tn, tt) = self.derivatives(v_n, v_t, eps)
        zero = np.zeros_like(f_t)
        return np.array([[f_t, tt, tn, zero], [f_n, nt, nn, zero], [zero] * 4])


@dataclass(frozen=True)
class _Caps(PerSample):
    """The caps' law as a contact takes it."""

    medium: Granular
    rate_independent = True

    @property
    def numbers(self) -> tuple:
        """For compiled code (`rft.backend`)."""
        return list(_CapLaw(self.medium).dry), (0.0, 0.0), True

    def __call__(self, v_t, v_n, spin, eps):
        return _CapLaw(self.medium).at(v_t, v_n, eps)


@dataclass(frozen=True)
class EndCaps(Effect):
    """Flat or rounded ends: axial force e pi r^2 C_S sin(atan(cot gamma0 cos psi)), lateral e pi r^2 C_F sin psi.

    radius (body lengths): of the body, 0 to 1. head, tail (-): the factor e of that end, 0 for none, 1 flat, 4 hemisphere.

    Source: the end forces of the cylinder in granular resistive force theory as written in third-party code, C_S / C_F
    being C of Eq. 3. Granular media only.
    """

    radius: float
    head: float = 1.0
    tail: float = 1.0

    kind = "end-caps"
    odd = True
    limit = "radius = 0"
    cost = "one point load an end"

    def __post_init__(self):
        check_ranges(self, radius=(0, 1), head=(0, 100), tail=(0, 100))

    def apply(self, model: Model) -> Model:
        medium = model.medium
        require(isinstance(medium, Granular), f"end caps take a granular medium, got {type(medium).__name__}")
        return model.touching("ends", Contact(_Caps(medium), self.ends, (0.0, 1.0)))

    def ends(self, motion: Kinematics) -> Kinematics:
        """Two points, at the tail and at the head of a body whose `Kinematics` is given."""
        # In units of the whole body's axial drag 2 r C_F L: e pi r^2 C_F / (2 r C_F L) = e pi (r / L) / 2.
        weight = math.pi * self.radius / 2 * np.array([[self.tail], [self.head]])
        return motion.points([0, -1], motion.half[[0, -1]] * [[-1.0], [1.0]], weight)

    def traction(self, medium: Granular, v_t, v_n, eps=0.0) -> tuple[np.ndarray, np.ndarray]:
        """(along, across) force of both ends together at velocity (v_t, v_n), in units of the body's axial drag."""
        across, along = _CapLaw(medium).traction(v_n, v_t, eps)
        factor = (self.head + self.tail) * math.pi * self.radius / 2
        return factor * along, factor * across
