"""One numerical setting of a question, with its values from coarse to fine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

ROUNDING = 1e-13  # errors below this are rounding, and say nothing about a setting


@dataclass(frozen=True)
class Setting:
    """A numerical setting that an error study varies from coarse to fine.

    order: of the error in 1/value, or in value where that falls, by theory. buys: what
    a finer value improves, to complete a sentence. against: "truth", or "limit" of the
    setting alone. key: its entry of [numerics], where that has another name; "loads"
    for rules, whose prefix is ``rule``. tier: to which it belongs."""

    name: str
    values: tuple
    order: Any
    buys: str = ""
    against: str = "truth"
    tier: str = ""
    key: str = ""
    rule: str = ""

    @property
    def label(self) -> str:
        """Its name, behind the name of its tier."""
        if self.tier:
            return f"{self.tier}: {self.name}"
        return self.name
