"""Connections in closed form, by sympy: an independent road to A(alpha), and formulas to read.

Sizes are numbers or symbols. Each function returns (A, alpha): a sympy Matrix (3, joints) and the tuple of shape variables.
`geomech.symbolic` simplifies what they give.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from fractions import Fraction
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    import sympy as sp

    from rft.bodies import Chain

    Formula = tuple[sp.Matrix, tuple[sp.Symbol, ...]]


def exact(x) -> Any:
    """A number as a fraction: of small whole numbers if that is the same number, else of its decimal digits. Symbols and
    exact numbers stay."""
    import sympy as sp

    if not isinstance(x, float):
        return sp.sympify(x)
    near = Fraction(x).limit_denominator(1000)
    near = near if float(near) == x else Fraction(repr(x))
    return sp.Rational(near.numerator, near.denominator)


def shape_angles(count: int) -> tuple[Any, ...]:
    """alpha_1 ... of so many shape variables."""
    import sympy as sp

    return sp.symbols(f"alpha_1:{count + 1}", real=True)


class Link(NamedTuple):
    """A link seen from another: heading, centre (2, 1), and its velocity along itself, across and about its centre, which is
    J xi + B alphadot."""

    heading: Any
    place: Any
    J: Any
    B: Any


def links(lengths, seen_from: int) -> list[Link]:
    """The links of a chain of length 1, in the frame of one of them, the first being 1. lengths: divided by their sum."""
    import sympy as sp

    alpha = shape_angles(len(lengths) - 1)
    lengths = [exact(x) / sum(map(exact, lengths)) for x in lengths]
    headings = [sp.Add(*alpha[:k]) - sp.Add(*alpha[: seen_from - 1]) for k in range(len(lengths))]
    halves = [x / 2 * sp.Matrix([sp.cos(h), sp.sin(h)]) for x, h in zip(lengths, headings)]
    places = [sp.zeros(2, 1)]
    for tail, head in itertools.pairwise(halves):
        places.append(places[-1] + tail + head)
    made = []
    for heading, place in zip(headings, [p - places[seen_from - 1] for p in places]):
        c, s = sp.cos(heading), sp.sin(heading)
        into = sp.Matrix([[c, s], [-s, c]])
        J, B = sp.eye(3), sp.zeros(3, len(alpha))
        J[:2, :2], J[:2, 2] = into, into * quarter_turn() * place
        B[:2, :] = into * place.jacobian(alpha)
        B[2, :] = sp.Matrix([heading]).jacobian(alpha)
        made.append(Link(heading, place, J, B))
    return made


def in_units_of(length, A) -> sp.Matrix:
    """A with its rows of translation in units of which the body has so many."""
    import sympy as sp

    return sp.diag(exact(length), exact(length), 1) * A


def quarter_turn() -> sp.Matrix:
    """A quarter turn to the left."""
    import sympy as sp

    return sp.Matrix([[0, -1], [1, 0]])


def solved(lengths, frame: str, weights, equations: Callable) -> Formula:
    """(A, alpha) in a frame from the equations M xi + C alphadot = 0 that links give, ``equations(links) -> (M, C)``.

    frame: "link-1", "link-2" ... or "mean", the mean of places and headings of all links by weights, the lengths if left out.
    The equations are those of a link's frame in any case, where they are short.
    """
    import sympy as sp

    alpha, mean = shape_angles(len(lengths) - 1), frame == "mean"
    some = links(lengths, (len(lengths) + 1) // 2 if mean else int(frame.removeprefix("link-")))
    M, C = equations(some)
    A = -M.LUsolve(C)
    if mean:
        weights = list(map(exact, weights or lengths))
        parts = [w / sum(weights) for w in weights]
        heading = sp.expand(sum(w * link.heading for w, link in zip(parts, some)))
        place = sum((w * link.place for w, link in zip(parts, some)), sp.zeros(2, 1))
        moved = A[:2, :] + quarter_turn() * place * A[2, :] + place.jacobian(alpha)
        c, s = sp.cos(heading), sp.sin(heading)
        turned = sp.Matrix([[c, s], [-s, c]]) * moved
        A = sp.Matrix.vstack(turned, A[2, :] + sp.Matrix([heading]).jacobian(alpha))
    return A, alpha


def chain_connection(lengths, resistances, frame: str = "mean", weights=None) -> Formula:
    """A(alpha) of a chain whose links resist their velocity v_i by R_i v_i, drag or momentum, that adds up to nothing:
    A = -(sum J_i^T R_i J_i)^-1 sum J_i^T R_i B_i.

    resistances: (along, across, about the centre) of each link, in any unit and body lengths. lengths, frame, weights: as
    in `solved`.
    """
    import sympy as sp

    def balance(some):
        R = [sp.diag(*map(exact, x)) for x in resistances]
        grand = sum((link.J.T * r * link.J for link, r in zip(some, R)), sp.zeros(3, 3))
        return grand, sum((link.J.T * r * link.B for link, r in zip(some, R)), sp.zeros(3, len(some) - 1))

    return solved(lengths, frame, weights, balance)


def viscous_chain(lengths=(1, 1, 1), ratio=2, link: int | None = 2) -> Formula:
    """A chain of links in a linear medium, in the frame of one link, or the mean one if that is None.

    lengths: of the links, divided by their sum. ratio: normal over axial drag.
    """
    ratio, body = exact(ratio), sum(map(exact, lengths))
    parts = [exact(x) / body for x in lengths]
    drag = [(x, ratio * x, ratio * x**3 / 12) for x in parts]
    return chain_connection(lengths, drag, "mean" if link is None else f"link-{link}")


def viscous_body(body: Chain, ratio) -> Formula:
    """As `viscous_chain`, of a chain of its own length and in its own frame."""
    link = None if body.frame == "mean" else int(body.frame.removeprefix("link-"))
    A, alpha = viscous_chain(body.lengths, ratio, link)
    return in_units_of(body.length, A), alpha


def no_slip_snake(lengths=(1, 1, 1), frame: str = "mean") -> Formula:
    """Three links on wheels: the velocity across each link's centre is zero."""
    import sympy as sp

    rolling = lambda some: tuple(sp.Matrix.vstack(*(x[1, :] for x in each)) for each in zip(*(x[2:] for x in some)))
    return solved(lengths, frame, None, rolling)


def differential_drive(radius=None, track=None) -> Formula:
    """A cart on two wheels of a radius, a track apart; symbols r and w if left out."""
    import sympy as sp

    r, w = (sp.Symbol(name, positive=True) if x is None else exact(x) for name, x in (("r", radius), ("w", track)))
    return sp.Matrix([[r / 2, r / 2], [0, 0], [-r / w, r / w]]), shape_angles(2)
