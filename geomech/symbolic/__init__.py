"""Connections and curvatures in closed form, as sympy matrices: formulas that simplify, for papers and for `velocity`.

A, alpha = system.symbolic()            # or rft.symbolic.viscous_chain(lengths, ratio), with symbols
A = symbolic.simplified(A, alpha)
print(symbolic.latex(symbolic.ccf(A, alpha)))
"""

from geomech.symbolic.matrices import bracket, ccf, latex, simplified, velocity

__all__ = ["bracket", "ccf", "latex", "simplified", "velocity"]
