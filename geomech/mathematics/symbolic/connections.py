"""Connections in closed form, by sympy: an independent computation of A(alpha), and
formulas to read.

Sizes are numbers or symbols. Each function that returns a Formula returns (A, alpha): a
sympy Matrix (3, joints), in the body frame, and the tuple of shape variables.
`geomech.mathematics.symbolic.simplified` reduces A to lowest terms."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import sympy as sp

Formula = tuple[sp.Matrix, tuple[sp.Symbol, ...]]


def exact(x) -> Any:
    """Return a float as a fraction: of small whole numbers if that is the same number,
    else of its decimal digits.

    Symbols and exact numbers stay as they are.
    """
    if not isinstance(x, float):
        return sp.sympify(x)
    fraction = Fraction(x).limit_denominator(1000)
    if float(fraction) != x:
        fraction = Fraction(repr(x))
    return sp.Rational(fraction.numerator, fraction.denominator)


def shape_angles(count: int) -> tuple[sp.Symbol, ...]:
    """Return the shape variables alpha_1 to alpha_count."""
    return sp.symbols(f"alpha_1:{count + 1}", real=True)


class Link(NamedTuple):
    """A link in the frame of another: heading, centre (2, 1), J (3, 3) and B (3,
    joints).

    J xi + B alphadot is its velocity along itself, across, and about its centre.
    """

    heading: Any
    centre: Any
    J: Any
    B: Any


def links(lengths, reference: int) -> list[Link]:
    """Return the links of a chain of length 1 in the frame of link ``reference``,
    counted from 1 at the tail.

    lengths: of the links, divided by their sum here.
    """
    alpha = shape_angles(len(lengths) - 1)
    shares = relative_lengths(lengths)
    reference_heading = sp.Add(*alpha[: reference - 1])
    headings = [sp.Add(*alpha[:k]) - reference_heading for k in range(len(shares))]

    # Centres in the frame of the reference, from one half of a link to the next.
    halves = []
    for share, heading in zip(shares, headings):
        halves.append(share / 2 * sp.Matrix([sp.cos(heading), sp.sin(heading)]))
    centres = [sp.zeros(2, 1)]
    for tail, head in itertools.pairwise(halves):
        centres.append(centres[-1] + tail + head)
    origin = centres[reference - 1]
    return [
        _link(heading, centre - origin, alpha)
        for heading, centre in zip(headings, centres)
    ]


def _link(heading, centre, alpha) -> Link:
    """Return a link from its heading and centre as functions of the shape."""
    to_link = _rotation(heading)
    J = sp.eye(3)
    J[:2, :2] = to_link
    J[:2, 2] = to_link * quarter_turn() * centre
    B = sp.zeros(3, len(alpha))
    B[:2, :] = to_link * centre.jacobian(alpha)
    B[2, :] = sp.Matrix([heading]).jacobian(alpha)
    return Link(heading, centre, J, B)


def _rotation(heading) -> sp.Matrix:
    """Return the matrix (2, 2) from a frame to one that is rotated by ``heading``."""
    c = sp.cos(heading)
    s = sp.sin(heading)
    return sp.Matrix([[c, s], [-s, c]])


def relative_lengths(lengths) -> list[Any]:
    """Return exact lengths over their sum."""
    total = sum(map(exact, lengths))
    return [exact(x) / total for x in lengths]


def in_length(length, A) -> sp.Matrix:
    """Return A (3, joints) in the unit in which the body is ``length`` long, from A in
    body lengths."""
    return sp.diag(exact(length), exact(length), 1) * A


def quarter_turn() -> sp.Matrix:
    """Return the rotation by 90 degrees to the left."""
    return sp.Matrix([[0, -1], [1, 0]])


def solve_chain(lengths, frame: str, weights, equations: Callable) -> Formula:
    """Solve M xi + C alphadot = 0 for the connection of a chain, ``equations(links) ->
    (M, C)``.

    frame: "link-1", "link-2" ... or "mean", the mean of centres and headings of all
    links by weights, the lengths if left out."""
    alpha = shape_angles(len(lengths) - 1)
    # The equations are short in the frame of a link.
    if frame != "mean":
        chain = links(lengths, int(frame.removeprefix("link-")))
        M, C = equations(chain)
        return -M.LUsolve(C), alpha
    chain = links(lengths, (len(lengths) + 1) // 2)
    M, C = equations(chain)
    A = -M.LUsolve(C)

    # Then the mean frame, at h(alpha) in the frame of the link.
    shares = relative_lengths(weights or lengths)
    heading = sp.expand(sum(w * link.heading for w, link in zip(shares, chain)))
    centre = sp.zeros(2, 1)
    for w, link in zip(shares, chain):
        centre += w * link.centre
    shifted = A[:2, :] + quarter_turn() * centre * A[2, :] + centre.jacobian(alpha)
    turning = A[2, :] + sp.Matrix([heading]).jacobian(alpha)
    return sp.Matrix.vstack(_rotation(heading) * shifted, turning), alpha


def chain_connection(
    lengths: Sequence,
    resistances: Sequence,
    frame: str = "mean",
    weights: Sequence | None = None,
) -> Formula:
    """Return A = -(sum J_i^T R_i J_i)^-1 sum J_i^T R_i B_i of a chain whose links
    resist their velocity v_i by R_i v_i.

    R_i v_i is drag or momentum, and adds up to zero over the body.

    resistances: (along, across, about the centre) of each link, in any unit and body
    lengths. lengths, frame, weights: as in `solve_chain`.

    Examples
    --------
    >>> from geomech.mathematics.symbolic import chain_connection
    >>> drag = [(1, 2, 0)] * 2
    >>> A, alpha = chain_connection((1, 1), drag, frame="link-1")
    >>> A.shape
    (3, 1)
    """

    def balance(chain):
        M = sp.zeros(3, 3)
        C = sp.zeros(3, len(chain) - 1)
        for link, resistance in zip(chain, resistances):
            R = sp.diag(*map(exact, resistance))
            M += link.J.T * R * link.J
            C += link.J.T * R * link.B
        return M, C

    return solve_chain(lengths, frame, weights, balance)


def viscous_chain(
    lengths: Sequence = (1, 1, 1), ratio: Any = 2, frame: str = "link-2"
) -> Formula:
    """Return the connection of a chain of links in a linear medium.

    lengths: of the links, divided by their sum. ratio: drag across over drag along.
    frame: as in `solve_chain`.

    Examples
    --------
    >>> from geomech.mathematics.symbolic import viscous_chain
    >>> A, alpha = viscous_chain(ratio=2)
    >>> A.shape, alpha
    ((3, 2), (alpha_1, alpha_2))
    """
    ratio = exact(ratio)
    drag = [(x, ratio * x, ratio * x**3 / 12) for x in relative_lengths(lengths)]
    return chain_connection(lengths, drag, frame)


def no_slip_snake(lengths: Sequence = (1, 1, 1), frame: str = "mean") -> Formula:
    """Return the connection of three links on wheels: the velocity across each link's
    centre is zero.

    Examples
    --------
    >>> from geomech.mathematics.symbolic import no_slip_snake
    >>> A, alpha = no_slip_snake()
    >>> A.shape
    (3, 2)
    """

    def rolling(chain):
        M = sp.Matrix.vstack(*[link.J[1, :] for link in chain])
        C = sp.Matrix.vstack(*[link.B[1, :] for link in chain])
        return M, C

    return solve_chain(lengths, frame, None, rolling)


def differential_drive(radius: Any = None, track: Any = None) -> Formula:
    """Return the connection of a cart on two wheels of a radius, a track apart; symbols
    r and w if left out.

    Examples
    --------
    >>> from geomech.mathematics.symbolic import differential_drive
    >>> A, alpha = differential_drive()
    >>> A
    Matrix([
    [ r/2, r/2],
    [   0,   0],
    [-r/w, r/w]])
    """
    r = sp.Symbol("r", positive=True) if radius is None else exact(radius)
    w = sp.Symbol("w", positive=True) if track is None else exact(track)
    return sp.Matrix([[r / 2, r / 2], [0, 0], [-r / w, r / w]]), shape_angles(2)
