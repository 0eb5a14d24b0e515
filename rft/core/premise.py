"""Premises: assumptions under which the body velocity follows from shape and its rate
alone, and a connection exists."""

from __future__ import annotations

from enum import Flag, auto


class Premise(Flag):
    """Assumptions that hold for the plain force law and that effects and systems may
    break."""

    RATE_INDEPENDENT = auto()  # xi(alpha, c alphadot) = c xi
    SE2_SYMMETRIC = auto()  # xi does not depend on the pose on the ground
    MEMORYLESS = auto()  # xi does not depend on the past
    QUASI_STATIC = auto()  # forces balance, mass is negligible
    PRESCRIBED_SHAPE = auto()  # the shape is that of the gait

    @property
    def words(self) -> list[str]:
        """Adjectives of the premises, such as "quasi-static", in alphabetical order."""
        return sorted(WORDS[premise] for premise in self)

    def __str__(self) -> str:
        return ", ".join(self.words) or "nothing"


WORDS = {
    Premise.RATE_INDEPENDENT: "rate-independent",
    Premise.SE2_SYMMETRIC: "SE(2)-symmetric",
    Premise.MEMORYLESS: "memoryless",
    Premise.QUASI_STATIC: "quasi-static",
    Premise.PRESCRIBED_SHAPE: "prescribed in shape",
}
NONE = Premise(0)
ALL = ~Premise(0)
# With these a body velocity follows from shape and its rate alone.
SHAPE_ALONE = Premise.SE2_SYMMETRIC | Premise.MEMORYLESS | Premise.QUASI_STATIC
# With these it follows from the gait's phase, too, and no time steps are needed.
PHASE_ALONE = SHAPE_ALONE | Premise.PRESCRIBED_SHAPE


def negation(broken: Premise) -> str:
    """Return the description of something that breaks premises, such as "not
    memoryless, not quasi-static"."""
    return ", ".join(f"not {word}" for word in broken.words)
