"""Skin friction other than that of the rod whose drag was measured: it scales the drag along the body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rft.effects.base import Effect
from rft.loads import ALONE
from rft.media.base import require


@dataclass(frozen=True)
class SkinFriction(Effect):
    """Axial drag times forward / reference where an element slides towards its head, backward / reference where it
    slides towards its tail.

    Coefficients of friction with the grains. The defaults are the shovel-nosed snake's against 0.3 mm glass, 0.109
    forward and 0.137 backward, and 0.2 for the aluminium of the measured rod (from the literature on the snake; that
    they scale the axial drag in proportion is assumed).
    """

    forward: float = 0.109
    backward: float = 0.137
    reference: float = 0.2

    limit = "forward = backward = reference"
    cost = "one multiplication an element"
    batched = ("forward", "backward", "reference")

    def __post_init__(self):
        for name in ("forward", "backward", "reference"):
            value = getattr(self, name)
            require(1e-3 <= value <= 100, f"{name} must be a coefficient of friction from 0.001 to 100, got {value!r}")

    def load(self, load, medium, body):
        ahead, astern = self.forward / self.reference, self.backward / self.reference

        def scaled(a, m, w, eps, known=ALONE):
            out = load(a, m, w, eps, known)
            out[0] *= np.where(a >= 0, known.of(ahead), known.of(astern))
            return out

        return scaled
