"""How the balance of forces of a swimmer is solved."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from rft.balance import ahead
from rft.balance.backend import check, installed
from rft.bodies.pieces import PIECES
from rft.core.checks import Number, check_numbers
from rft.effects.contact import MOST_PIECES
from rft.formulas.quadrature import parse
from rft.laws.records import is_compilable


@dataclass(frozen=True)
class Solver:
    """How the balance of forces is solved; part of [numerics].

    loads (-): integration of the forces along a link, "exact", "midpoint:N" or
    "gauss:N" (rft.formulas.quadrature). backend (-): "numpy", "numba" (compiled code,
    which needs numba) or "auto", compiled code where numba is installed
    (`rft.balance.backend`). Results agree to rounding.

    Examples
    --------
    >>> from geomech.mathematics.systems import Solver, Swimmer
    >>> from rft import Chain, Viscous
    >>> swimmer = Swimmer(Viscous(), Chain(), solver=Solver(loads="gauss:24"))
    >>> swimmer.velocity([0.5, 0.3], [1.0, 0.0]).round(4)
    array([-0.0014, -0.0035, -0.0817])
    """

    loads: str = "exact"
    regularisation: Annotated[
        float,
        Number(
            1e-12,
            1,
            "body lengths per rad",
            "speed below which dry friction is smoothed (rft.balance)",
        ),
    ] = 1e-6
    tolerance: Annotated[
        float,
        Number(1e-13, 1, "-", "largest residual of the force balance, normalised"),
    ] = 1e-10
    cycles: Annotated[
        int | None,
        Number(
            1,
            10_000,
            "-",
            "number of cycles in time stepping (rft.time_steps); if left out, until "
            "they are periodic, or one where effects break symmetry",
            whole=True,
        ),
    ] = None
    pieces: Annotated[
        int,
        Number(
            1,
            MOST_PIECES,
            "-",
            "number of pieces per body length, 1 to 10,000, into which elements are "
            "cut where effects vary along them (rft.effects)",
            whole=True,
        ),
    ] = PIECES
    backend: str = "auto"

    def __post_init__(self):
        parse(self.loads)
        check(self.backend)
        check_numbers(self)

    def computed(self, law_record: Any, law: str) -> str:
        """Return the back end in words, and why it is not compiled code.

        law_record: of the law of that name."""
        if self.backend == "numpy":
            return "NumPy, as requested"
        if not is_compilable(law_record):
            return (
                f"NumPy: compiled code does not support the law {law}, whose traction "
                "is not a formula"
            )
        if ahead.has(type(law_record)):
            return "compiled code"
        if not installed():
            return "NumPy: numba is not installed (pip install 'geomech[fast]')"
        if self.backend == "numba":
            return "compiled code"
        return "compiled code; commands use NumPy for short computations"
