"""A law, a body's drag of one's own: the one of the README, with a name."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Thick:
    """ratio (-): drag across over drag along."""

    ratio: float = 3.0
    law = "thick"

    def traction(self, v_t, v_n, eps=0.0):
        return v_t, self.ratio * v_n
