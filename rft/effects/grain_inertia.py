"""Inertia of the grains that a fast body pushes aside: the drag grows with the square of the speed across it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rft.contact import SIDE, Model, PerSample
from rft.effects.base import Effect
from rft.media.base import check_ranges, is_linear, require
from rft.media.catalogue import GRAVITY
from rft.premise import Premise

ASSUMED_K = 2.5  # k of Eq. 2 for loosely packed 0.3 mm glass (Zhang and Goldman 2014); assumed of grains of unknown k


@dataclass(frozen=True)
class GrainInertia(Effect):
    """A normal force strength x rho v_n^2 on the body's width 2 r, added to Eqs. 2-3 (paper Sec. IV C).

    At high speed the inertia of grains counts; the form is the momentum flux of grains swept up, as in impact laws.

    In units of the axial drag 2 k rho g r |z| it is strength v_n^2 / (k g |z|), without radius or density. Dry media only.

    frequency (1/s): cycles per second, alphadot being per radian of phase. length (m): of the body. depth (m): |z|.
    strength (-): lambda; 1 is assumed. k (-): of Eq. 2, in place of the medium's own (2.5 for loose glass, 5.1 for close);
    where neither gives one, that of loose glass is assumed.
    """

    frequency: float
    length: float
    depth: float
    strength: float = 1.0
    k: float | None = None

    kind = "grain-inertia"
    odd = True
    breaks = Premise.RATE_INDEPENDENT
    limit = "frequency = 0"
    order = 2  # of strength = 0 it is 1
    cost = "a dozen operations an element"
    batched = ("frequency", "length", "depth", "strength", "k")

    def __post_init__(self):
        check_ranges(self, frequency=(0, 1e4), length=(1e-9, 1e6), depth=(1e-9, 1e6), strength=(0, 1e6))
        if self.k is not None:
            check_ranges(self, k=(1e-3, 1e3))

    def _known_k(self, medium):
        return getattr(medium, "k", None) if self.k is None else self.k

    def assumes(self, medium) -> str:
        return f"k = {ASSUMED_K:g}, that of loose glass" if self._known_k(medium) is None else ""

    def apply(self, model: Model) -> Model:
        medium = model.medium
        require(not is_linear(medium), f"grain inertia takes a medium of grains, got {type(medium).__name__}")
        speed_per_rad = 2 * np.pi * self.frequency * self.length
        k = self._known_k(medium)
        beta = self.strength * speed_per_rad**2 / ((ASSUMED_K if k is None else k) * GRAVITY * self.depth)
        return model.changed(SIDE, additions=(Flux(beta),))  # of the grains, which does not know the ground's pressure


@dataclass(frozen=True)
class Flux(PerSample):
    """Drag beta |v_n| v_n across the body's sides; beta: a number or (B,)."""

    beta: np.ndarray | float

    @property
    def numbers(self) -> np.ndarray | float:
        """For compiled code (`rft.backend`)."""
        return self.beta

    def __call__(self, v_t, v_n, spin, eps) -> np.ndarray:
        out = np.zeros((3, 4, *v_n.shape))
        np.multiply(self.beta, squared_speed_load(v_n, spin), out=out[1:])
        return out


def squared_speed_load(v_n: np.ndarray, spin: np.ndarray) -> np.ndarray:
    """(2, 4, ...): <|u| u>, <s |u| u> over u = v_n + s spin and their derivatives with respect to (v_t, v_n, spin), exactly.

    The parts on either side of the pivot s0, where u changes sign, are polynomials in s.
    """
    inside = np.abs(spin) > np.abs(v_n)
    pivot = np.where(inside, -v_n / np.where(inside, spin, 1.0), -1.0)
    beyond = np.sign(np.where(inside, spin, v_n))  # sign of u for s > s0
    moments = [beyond * (1 - (-1) ** k - 2 * pivot ** (k + 1)) / (2 * (k + 1)) for k in range(4)]  # <sign(u) s^k>
    s0, s1, s2, s3 = moments
    zero = np.zeros_like(v_n)
    flux = v_n * v_n * s0 + 2 * v_n * spin * s1 + spin * spin * s2
    turning = v_n * v_n * s1 + 2 * v_n * spin * s2 + spin * spin * s3
    d0, d1, d2 = (2 * (v_n * x + spin * y) for x, y in ((s0, s1), (s1, s2), (s2, s3)))
    return np.stack([np.stack([flux, zero, d0, d1]), np.stack([turning, zero, d1, d2])])
