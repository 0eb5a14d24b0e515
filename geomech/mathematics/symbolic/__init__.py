"""Connections and CCFs in closed form, as sympy matrices, for papers and for
`velocity`.

A, alpha = symbolic.viscous_chain(lengths, ratio)  # with numbers or symbols
A = symbolic.simplified(A, alpha)
print(symbolic.latex(symbolic.ccf(A, alpha)))
"""

from geomech.mathematics.symbolic.connections import (
    chain_connection,
    differential_drive,
    no_slip_snake,
    viscous_chain,
)
from geomech.mathematics.symbolic.matrices import (
    bracket,
    ccf,
    latex,
    simplified,
    velocity,
)

__all__ = [
    "bracket",
    "ccf",
    "chain_connection",
    "differential_drive",
    "latex",
    "no_slip_snake",
    "simplified",
    "velocity",
    "viscous_chain",
]


def __dir__() -> list[str]:
    return __all__
