"""The parts of a system that break the premises of a result, and the sentence that
refuses it."""

from __future__ import annotations

from geomech.mathematics.systems.base import System, kind_of
from geomech.mathematics.systems.capabilities import Composite, Part, capability
from rft.core.premise import Premise, negation
from rft.core.refusal import Refusal

CURES = {"law": ", or use another law", "effect": ", or remove the effect"}


def broken(system: System, premises: Premise) -> list[Part]:
    """Return the parts of a system that break one of some premises; the whole system
    where it has no parts."""
    composite = capability(system, Composite)
    parts = (Part("", kind_of(system), system.traits.lacks),)
    if composite is not None:
        parts = composite.parts
    return [part for part in parts if part.breaks & premises]


def because(system: System, premises: Premise) -> str:
    """Return the first part that breaks one of some premises, to follow "no connection
    with"; "" if none does."""
    for part in broken(system, premises):
        if part.role == "law":
            return f"the law {part.name}, whose drag is not a power of the speed"
        return f"{_named(part)}, which is {negation(part.breaks)}"
    return ""


def listed(system: System, premises: Premise) -> str:
    """Return all parts that break one of some premises, by name; the whole system where
    none does."""
    parts = broken(system, premises)
    if not parts:
        return f"the {kind_of(system)}"
    return ", ".join(_named(part).removeprefix("the effect ") for part in parts)


def refuse(system: System, what: str, premises: Premise, instead: str) -> None:
    """Refuse a result of which a premise does not hold."""
    if system.traits.lacks & premises:
        parts = broken(system, premises)
        raise Refusal(
            f"no {what} exists with {because(system, premises)}",
            instead=f"{instead}{CURES.get(parts[0].role, '')}",
        )


def _named(part: Part) -> str:
    """Return a part's name behind its role."""
    if part.role:
        return f"the {part.role} {part.name}"
    return f"the {part.name}"
