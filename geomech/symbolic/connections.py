"""Connections in closed form, by sympy: an independent road to A(alpha), and formulas to read.

Sizes are numbers or symbols. Each function that returns a Formula returns (A, alpha): a sympy Matrix (3, joints), in the body
frame, and the tuple of shape variables. `geomech.symbolic.simplified` brings A to lowest terms.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import sympy as sp

Formula = tuple[sp.Matrix, tuple[sp.Symbol, ...]]


def exact(x) -> Any:
    """Return a float as a fraction: of small whole numbers if that is the same number, else of its decimal digits.

    Symbols and exact numbers stay as they are.
    """
    if not isinstance(x, float):
        return sp.sympify(x)
    fraction = Fraction(x).limit_denominator(1000)
    fraction = fraction if float(fraction) == x else Fraction(repr(x))
    return sp.Rational(fraction.numerator, fraction.denominator)


def shape_angles(count: int) -> tuple[sp.Symbol, ...]:
    """Return the shape variables alpha_1 to alpha_count."""
    return sp.symbols(f"alpha_1:{count + 1}", real=True)


class Link(NamedTuple):
    """A link in the frame of another: heading, centre (2, 1), J (3, 3) and B (3, joints).

    J xi + B alphadot is its velocity along itself, across, and about its centre.
    """

    heading: Any
    place: Any
    J: Any
    B: Any


def links(lengths, reference: int) -> list[Link]:
    """Return the links of a chain of length 1 in the frame of link ``reference``, counted from 1 at the tail.

    lengths: of the links, divided by their sum here.
    """
    alpha = shape_angles(len(lengths) - 1)
    lengths = [exact(x) / sum(map(exact, lengths)) for x in lengths]
    headings = [
        sp.Add(*alpha[:k]) - sp.Add(*alpha[: reference - 1])
        for k in range(len(lengths))
    ]
    halves = [
        x / 2 * sp.Matrix([sp.cos(h), sp.sin(h)]) for x, h in zip(lengths, headings)
    ]
    places = [sp.zeros(2, 1)]
    for tail, head in itertools.pairwise(halves):
        places.append(places[-1] + tail + head)
    result = []
    for heading, place in zip(headings, [p - places[reference - 1] for p in places]):
        c, s = sp.cos(heading), sp.sin(heading)
        to_link = sp.Matrix([[c, s], [-s, c]])
        J, B = sp.eye(3), sp.zeros(3, len(alpha))
        J[:2, :2], J[:2, 2] = to_link, to_link * quarter_turn() * place
        B[:2, :] = to_link * place.jacobian(alpha)
        B[2, :] = sp.Matrix([heading]).jacobian(alpha)
        result.append(Link(heading, place, J, B))
    return result


def in_length(length, A) -> sp.Matrix:
    """Return A (3, joints) in the unit in which the body is ``length`` long, from A in body lengths."""
    return sp.diag(exact(length), exact(length), 1) * A


def quarter_turn() -> sp.Matrix:
    """Return the rotation by 90 degrees to the left."""
    return sp.Matrix([[0, -1], [1, 0]])


def solve_chain(lengths, frame: str, weights, equations: Callable) -> Formula:
    """Solve M xi + C alphadot = 0 for the connection of a chain, ``equations(links) -> (M, C)``.

    frame: "link-1", "link-2" ... or "mean", the mean of places and headings of all links by weights, the lengths if left out.
    The equations are solved in the frame of a link in any case, where they are short.
    """
    alpha, mean = shape_angles(len(lengths) - 1), frame == "mean"
    chain = links(
        lengths, (len(lengths) + 1) // 2 if mean else int(frame.removeprefix("link-"))
    )
    M, C = equations(chain)
    A = -M.LUsolve(C)
    if mean:
        weights = list(map(exact, weights or lengths))
        parts = [w / sum(weights) for w in weights]
        heading = sp.expand(sum(w * link.heading for w, link in zip(parts, chain)))
        place = sum((w * link.place for w, link in zip(parts, chain)), sp.zeros(2, 1))
        shifted = A[:2, :] + quarter_turn() * place * A[2, :] + place.jacobian(alpha)
        c, s = sp.cos(heading), sp.sin(heading)
        rotated = sp.Matrix([[c, s], [-s, c]]) * shifted
        A = sp.Matrix.vstack(rotated, A[2, :] + sp.Matrix([heading]).jacobian(alpha))
    return A, alpha


def chain_connection(
    lengths: Sequence,
    resistances: Sequence,
    frame: str = "mean",
    weights: Sequence | None = None,
) -> Formula:
    """Return A = -(sum J_i^T R_i J_i)^-1 sum J_i^T R_i B_i of a chain whose links resist their velocity v_i by R_i v_i.

    R_i v_i is drag or momentum, and adds up to zero over the body.

    resistances: (along, across, about the centre) of each link, in any unit and body lengths. lengths, frame, weights: as
    in `solve_chain`.

    Examples
    --------
    >>> from geomech.symbolic import chain_connection
    >>> drag = [(1, 2, 0)] * 2
    >>> A, alpha = chain_connection((1, 1), drag, frame="link-1")
    >>> A.shape
    (3, 1)
    """

    def balance(chain):
        R = [sp.diag(*map(exact, x)) for x in resistances]
        total = sum(
            (link.J.T * r * link.J for link, r in zip(chain, R)), sp.zeros(3, 3)
        )
        return total, sum(
            (link.J.T * r * link.B for link, r in zip(chain, R)),
            sp.zeros(3, len(chain) - 1),
        )

    return solve_chain(lengths, frame, weights, balance)


def viscous_chain(
    lengths: Sequence = (1, 1, 1), ratio: Any = 2, frame: str = "link-2"
) -> Formula:
    """Return the connection of a chain of links in a linear medium.

    lengths: of the links, divided by their sum. ratio: drag across over drag along. frame: as in `solve_chain`.

    Examples
    --------
    >>> from geomech.symbolic import viscous_chain
    >>> A, alpha = viscous_chain(ratio=2)
    >>> A.shape, alpha
    ((3, 2), (alpha_1, alpha_2))
    """
    ratio, body = exact(ratio), sum(map(exact, lengths))
    parts = [exact(x) / body for x in lengths]
    drag = [(x, ratio * x, ratio * x**3 / 12) for x in parts]
    return chain_connection(lengths, drag, frame)


def no_slip_snake(lengths: Sequence = (1, 1, 1), frame: str = "mean") -> Formula:
    """Return the connection of three links on wheels: the velocity across each link's centre is zero.

    Examples
    --------
    >>> from geomech.symbolic import no_slip_snake
    >>> A, alpha = no_slip_snake()
    >>> A.shape
    (3, 2)
    """
    rolling = lambda chain: tuple(
        sp.Matrix.vstack(*(x[1, :] for x in each))
        for each in zip(*(x[2:] for x in chain))
    )
    return solve_chain(lengths, frame, None, rolling)


def differential_drive(radius: Any = None, track: Any = None) -> Formula:
    """Return the connection of a cart on two wheels of a radius, a track apart; symbols r and w if left out.

    Examples
    --------
    >>> from geomech.symbolic import differential_drive
    >>> A, alpha = differential_drive()
    >>> A
    Matrix([
    [ r/2, r/2],
    [   0,   0],
    [-r/w, r/w]])
    """
    r, w = (
        sp.Symbol(name, positive=True) if x is None else exact(x)
        for name, x in (("r", radius), ("w", track))
    )
    return sp.Matrix([[r / 2, r / 2], [0, 0], [-r / w, r / w]]), shape_angles(2)
