"""Skin friction other than that of the rod whose drag was measured: it scales the drag along the body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rft.contact import SIDE, Model
from rft.effects.base import Effect
from rft.media.base import check_ranges


@dataclass(frozen=True)
class SkinFriction(Effect):
    """Axial drag times forward / reference where an element slides towards its head, backward / reference where it
    slides towards its tail.

    forward, backward (-): coefficient of friction with the grains that way. reference (-): that of the rod whose drag was
    measured.

    The defaults are the shovel-nosed snake's against 0.3 mm glass, 0.109 forward and 0.137 backward (from the literature on
    the snake), and about 0.15 for the rod whose drag gave Eqs. 2 and 3 (paper, caption of Fig. 5). The literature on the
    snake has 0.2, for aluminium: take that with a law that was measured with such a rod. That friction scales the axial drag
    in proportion is assumed.
    """

    forward: float = 0.109
    backward: float = 0.137
    reference: float = 0.15

    kind = "skin-friction"
    limit = "forward = backward = reference"
    cost = "one multiplication an element"
    batched = ("forward", "backward", "reference")

    def __post_init__(self):
        check_ranges(self, forward=(1e-3, 100), backward=(1e-3, 100), reference=(1e-3, 100))

    def apply(self, model: Model) -> Model:
        return model.changed(SIDE, factors=(self,))

    @property
    def numbers(self) -> tuple:
        """For compiled code (`rft.backend`): factors along, forwards and backwards, and across."""
        return self.forward / self.reference, self.backward / self.reference, 1.0

    def __call__(self, v_t, v_n, spin) -> tuple[np.ndarray, None]:
        return np.where(v_t >= 0, self.forward / self.reference, self.backward / self.reference), None
