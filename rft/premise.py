"""Premises: what makes a body velocity follow from shape and its rate of change alone, and a local connection exist."""

from __future__ import annotations

from enum import Flag, auto


class Premise(Flag):
    """Something that holds of the plain force law and that an effect, or a system, may lack."""

    RATE_INDEPENDENT = auto()  # the gait's speed does not matter: xi(alpha, c alphadot) = c xi
    SE2_SYMMETRIC = auto()  # place and heading on the ground do not matter
    MEMORYLESS = auto()  # the past does not matter
    QUASI_STATIC = auto()  # mass does not matter: forces balance

    @property
    def words(self) -> list[str]:
        """As adjectives, in alphabetical order: a scene that lacks one is "not quasi-static"."""
        return sorted(WORDS[premise] for premise in self)

    def __str__(self) -> str:
        return ", ".join(self.words) or "nothing"


WORDS = {
    Premise.RATE_INDEPENDENT: "rate-independent",
    Premise.SE2_SYMMETRIC: "SE(2)-symmetric",
    Premise.MEMORYLESS: "memoryless",
    Premise.QUASI_STATIC: "quasi-static",
}
NONE, ALL = Premise(0), ~Premise(0)
SHAPE_ALONE = (
    Premise.SE2_SYMMETRIC | Premise.MEMORYLESS | Premise.QUASI_STATIC
)  # a body velocity follows from shape alone


def negated(lacking: Premise) -> str:
    """ "not memoryless, not quasi-static": how something that lacks premises is told."""
    return ", ".join(f"not {word}" for word in lacking.words)
