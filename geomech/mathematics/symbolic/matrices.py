"""Brackets, CCFs, LaTeX and numbers of connections given as sympy matrices."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import sympy as sp

from geomech.mathematics.symbolic.waves import Waves
from rft.core.checks import unmasked


def bracket(X: sp.Matrix, Y: sp.Matrix) -> sp.Matrix:
    """Return [X, Y] on se(2), columns (x, y, theta), as `rft.formulas.se2.bracket`.

    Examples
    --------
    >>> import sympy as sp
    >>> from geomech.mathematics.symbolic import bracket
    >>> bracket(sp.Matrix([1, 0, 0]), sp.Matrix([0, 0, 1]))  # ahead, then turning
    Matrix([
    [ 0],
    [-1],
    [ 0]])
    """
    return sp.Matrix([Y[2] * X[1] - X[2] * Y[1], X[2] * Y[0] - Y[2] * X[0], 0])


def ccf(A: sp.Matrix, alpha: Sequence[sp.Symbol], i: int = 1, j: int = 2) -> sp.Matrix:
    """Return d_i A_j - d_j A_i + [A_i, A_j] of a connection A (3, d), a column of
    three.

    i, j: joints, counted from 1.

    Examples
    --------
    >>> from geomech.mathematics.symbolic import ccf, differential_drive
    >>> A, alpha = differential_drive()
    >>> ccf(A, alpha)
    Matrix([
    [      0],
    [-r**2/w],
    [      0]])
    """
    A_i = A[:, i - 1]
    A_j = A[:, j - 1]
    return A_j.diff(alpha[i - 1]) - A_i.diff(alpha[j - 1]) + bracket(A_i, A_j)


def velocity(A: sp.Matrix, alpha: Sequence[sp.Symbol]) -> Callable[..., Any]:
    """Return a function velocity(alpha, alphadot) -> xi, as
    `geomech.mathematics.geometry.connection.fit` and
    `geomech.mathematics.tiers.direct.direct` take it.

    Examples
    --------
    >>> from geomech.mathematics.symbolic import differential_drive, velocity
    >>> A, alpha = differential_drive(radius=1, track=1)
    >>> velocity(A, alpha)([0.0, 0.0], [1.0, 1.0])
    array([1., 0., 0.])
    """
    import numpy as np

    entries = sp.lambdify(alpha, list(A), "numpy", cse=True)
    rows, columns = A.shape

    def xi(a, adot):
        a, adot = np.broadcast_arrays(unmasked("a", a), unmasked("adot", adot))
        values = entries(*np.moveaxis(a, -1, 0))
        flat = [np.broadcast_to(value, a.shape[:-1]) for value in values]
        matrix = np.stack(flat, -1).reshape(*a.shape[:-1], rows, columns)
        return np.einsum("...ij,...j->...i", matrix, adot)

    return xi


def simplified(A: sp.Matrix, alpha: Sequence[sp.Symbol]) -> sp.Matrix:
    """Return the matrix with every entry one fraction in lowest terms, of sums of
    cosines and sines of sums of angles.

    Two formulas of one function become equal. An entry that is no rational function of
    sines and cosines, or neither even nor odd in alpha, is unchanged.

    Examples
    --------
    >>> import sympy as sp
    >>> from geomech.mathematics.symbolic import simplified
    >>> a = sp.symbols("a")
    >>> simplified(sp.Matrix([sp.sin(a) ** 2 + sp.cos(a) ** 2]), [a])
    Matrix([[1]])
    """
    waves = Waves(A, alpha)
    return A.applyfunc(waves.reduced)


def latex(A: sp.Matrix, name: str = "A") -> str:
    """Return LaTeX of a matrix, with one entry on each line; it needs amsmath.

    The denominator stands in front if all entries have the same, up to a number.

    Examples
    --------
    >>> from geomech.mathematics.symbolic import differential_drive, latex
    >>> A, alpha = differential_drive(radius=1, track=1)
    >>> text = latex(A)  # a matrix of amsmath
    """
    inverses = {_inverse_denominator(x) for x in A if x != 0}
    if len(inverses) != 1 or inverses == {1}:
        return f"{name} = {_pmatrix(A)}"
    (inverse,) = inverses

    def numerator(x):
        factors = sp.Mul.make_args(x)
        return sp.Mul(*[f for f in factors if f not in (*inverse.args, inverse)])

    matrix = _pmatrix(A.applyfunc(numerator))
    denominator = sp.latex(1 / inverse)
    return f"{name} = \\frac{{1}}{{D}} {matrix},\n\\qquad D = {denominator}"


def _inverse_denominator(x) -> sp.Expr:
    """Return the product of the factors of an entry with negative powers, but for
    numbers."""
    powers = [f for f in sp.Mul.make_args(x) if f.is_Pow and not f.is_number]
    return sp.Mul(*[f for f in powers if f.exp.is_negative])


def _pmatrix(M: sp.Matrix) -> str:
    """Return a matrix in LaTeX."""
    rows = [" &\n".join(map(sp.latex, M.row(k))) for k in range(M.rows)]
    return "\\begin{pmatrix}\n" + " \\\\\n".join(rows) + "\n\\end{pmatrix}"
