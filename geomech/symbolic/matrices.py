"""Brackets, CCFs, LaTeX and numbers of connections given as sympy matrices."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import sympy as sp

from geomech.symbolic.waves import Waves
from rft.core.checks import unmasked


def bracket(X: sp.Matrix, Y: sp.Matrix) -> sp.Matrix:
    """Return [X, Y] on se(2), columns (x, y, theta), as `rft.formulas.se2.bracket`.

    Examples
    --------
    >>> import sympy as sp
    >>> from geomech.symbolic import bracket
    >>> bracket(sp.Matrix([1, 0, 0]), sp.Matrix([0, 0, 1]))  # ahead, then turning
    Matrix([
    [ 0],
    [-1],
    [ 0]])
    """
    return sp.Matrix([Y[2] * X[1] - X[2] * Y[1], X[2] * Y[0] - Y[2] * X[0], 0])


def ccf(A: sp.Matrix, alpha: Sequence[sp.Symbol], i: int = 0, j: int = 1) -> sp.Matrix:
    """Return d_i A_j - d_j A_i + [A_i, A_j] of a connection A (3, d), a column of three.

    Examples
    --------
    >>> from geomech.symbolic import ccf, differential_drive
    >>> A, alpha = differential_drive()
    >>> ccf(A, alpha)
    Matrix([
    [      0],
    [-r**2/w],
    [      0]])
    """
    return A[:, j].diff(alpha[i]) - A[:, i].diff(alpha[j]) + bracket(A[:, i], A[:, j])


def velocity(A: sp.Matrix, alpha: Sequence[sp.Symbol]) -> Callable[..., Any]:
    """Return a function velocity(alpha, alphadot) -> xi, as `geomech.geometry.connection.fit` and
    `geomech.tiers.direct.direct` take it.

    Examples
    --------
    >>> from geomech.symbolic import differential_drive, velocity
    >>> A, alpha = differential_drive(radius=1, track=1)
    >>> velocity(A, alpha)([0.0, 0.0], [1.0, 1.0])
    array([1., 0., 0.])
    """
    import numpy as np

    entries = sp.lambdify(alpha, list(A), "numpy", cse=True)
    rows, columns = A.shape

    def xi(a, adot):
        a, adot = np.broadcast_arrays(unmasked("a", a), unmasked("adot", adot))
        flat = [
            np.broadcast_to(e, a.shape[:-1]) for e in entries(*np.moveaxis(a, -1, 0))
        ]
        matrix = np.stack(flat, -1).reshape(*a.shape[:-1], rows, columns)
        return np.einsum("...ij,...j->...i", matrix, adot)

    return xi


def simplified(A: sp.Matrix, alpha: Sequence[sp.Symbol]) -> sp.Matrix:
    """Return the matrix with every entry one fraction in lowest terms, of sums of cosines and sines of sums of angles.
    Two formulas of one function come out equal. An entry that is no rational function of sines and cosines, or neither
    even nor odd in alpha, is unchanged.

    Examples
    --------
    >>> import sympy as sp
    >>> from geomech.symbolic import simplified
    >>> a = sp.symbols("a")
    >>> simplified(sp.Matrix([sp.sin(a) ** 2 + sp.cos(a) ** 2]), [a])
    Matrix([[1]])
    """
    waves = Waves(A, alpha)
    return A.applyfunc(waves.reduced)


def latex(A: sp.Matrix, name: str = "A") -> str:
    """Return LaTeX of a matrix, an entry a line, with its denominator in front if all entries have the same, up to a number.
    It needs amsmath.

    Examples
    --------
    >>> from geomech.symbolic import differential_drive, latex
    >>> A, alpha = differential_drive(radius=1, track=1)
    >>> text = latex(A)  # a matrix of amsmath
    """
    below = lambda x: sp.Mul(
        *(
            f
            for f in sp.Mul.make_args(x)
            if f.is_Pow and f.exp.is_negative and not f.is_number
        )
    )
    common = {below(x) for x in A if x != 0}
    if len(common) != 1 or common == {1}:
        return f"{name} = {_pmatrix(A)}"
    (one_over,) = common
    above = A.applyfunc(
        lambda x: sp.Mul(
            *(
                f
                for f in sp.Mul.make_args(x)
                if f not in one_over.args and f != one_over
            )
        )
    )
    return f"{name} = \\frac{{1}}{{D}} {_pmatrix(above)},\n\\qquad D = {sp.latex(1 / one_over)}"


def _pmatrix(M: sp.Matrix) -> str:
    rows = (" &\n".join(map(sp.latex, M.row(k))) for k in range(M.rows))
    return "\\begin{pmatrix}\n" + " \\\\\n".join(rows) + "\n\\end{pmatrix}"
