"""How the balance of forces of a swimmer is solved."""

from __future__ import annotations

from dataclasses import dataclass

from rft.backend import TO_LOAD, check, installed
from rft.bodies.pieces import PIECES
from rft.contact import Averages
from rft.effects.base import MOST_PIECES
from rft.loads import parse
from rft.media.base import check_ranges, in_range


@dataclass(frozen=True)
class Solver:
    """How the balance of forces is solved; part of [numerics].

    loads (-): "exact", "midpoint:N", "gauss:N" (rft.loads). regularisation (body lengths per rad): speed below which dry
    friction is rounded off (rft.balance). tolerance (-): normalised residual. cycles (-): of time stepping
    (`rft.time_steps`); if left out until they are periodic, one where effects break symmetry. pieces (-): to a body length,
    1 to 10,000, into which effects that vary along an element cut it (`rft.effects`). backend (-): what computes, "numpy",
    "numba" (compiled code, where numba is installed) or "auto": compiled code where it is installed and pays
    (`rft.backend`). Answers are the same but for rounding.
    """

    loads: str = "exact"
    regularisation: float = 1e-6
    tolerance: float = 1e-10
    cycles: int | None = None
    pieces: int = PIECES
    backend: str = "auto"

    def __post_init__(self):
        parse(self.loads)
        check(self.backend)
        check_ranges(self, regularisation=(1e-12, 1), tolerance=(1e-13, 1))
        in_range("pieces", self.pieces, 1, MOST_PIECES, whole=True)
        if self.cycles is not None:
            in_range("cycles", self.cycles, 1, 10_000, whole=True)

    def computed(self, alien, law: str) -> str:
        """By what balances are solved, and why not by compiled code. alien: what of the model that does not know. law: its
        name."""
        if self.backend == "numpy":
            return "NumPy, as asked for"
        if alien is not None:
            unknown = f"the law {law} by quadrature" if isinstance(alien, Averages) else type(alien).__name__
            return f"NumPy: compiled code does not know {unknown}"
        if self.backend == "auto" and not installed():
            return "NumPy: numba is not installed (pip install 'geomech[fast]')"
        when = "" if self.backend == "numba" else f" after {TO_LOAD:g} s of NumPy, once it is made (python -m rft)"
        return f"compiled code{when}; the few samples that are followed along their curves stay with NumPy"
