"""The viscous chain in closed form, by sympy: an independent road to A(alpha), and formulas to read."""

from __future__ import annotations

import sympy as sp


def viscous_chain(lengths=(1, 1, 1), ratio=2, link: int = 2) -> tuple[sp.Matrix, tuple[sp.Symbol, ...]]:
    """A(alpha) of a chain of links in a linear medium, in the frame of one link.

    lengths: of the links, divided by their sum; exact numbers or symbols. ratio: normal over axial drag.
    link: 1, 2 ... whose frame is used. Returns (A, alpha): a sympy Matrix (3, joints) and the tuple of symbols.
    A is what makes force and moment vanish: with the drag on link i being R_i v_i (3 x 3) and v_i = J_i xi + B_i alphadot,
    A = -(sum J_i^T R_i J_i)^-1 sum J_i^T R_i B_i.
    """
    n = len(lengths)
    alpha = sp.symbols(f"alpha_1:{n}", real=True)
    total = sum(map(sp.sympify, lengths))
    halves = [sp.sympify(x) / total / 2 for x in lengths]
    headings = [sp.Integer(0)]
    for a in alpha:
        headings.append(headings[-1] + a)
    headings = [h - headings[link - 1] for h in headings]
    places = [sp.Matrix([0, 0])]
    for i in range(1, n):
        step = sum(
            (halves[k] * sp.Matrix([sp.cos(headings[k]), sp.sin(headings[k])]) for k in (i - 1, i)), sp.zeros(2, 1)
        )
        places.append(places[-1] + step)
    places = [p - places[link - 1] for p in places]
    grand, coupling = sp.zeros(3, 3), sp.zeros(3, n - 1)
    for half, heading, place in zip(halves, headings, places):
        c, s = sp.cos(heading), sp.sin(heading)
        into = sp.Matrix([[c, s], [-s, c]])
        turn = sp.Matrix([-place[1], place[0]])
        J = sp.zeros(3, 3)
        J[:2, :2], J[:2, 2], J[2, 2] = into, into * turn, 1
        B = sp.zeros(3, n - 1)
        B[:2, :] = into * place.jacobian(alpha)
        B[2, :] = sp.Matrix([heading]).jacobian(alpha)
        R = 2 * half * sp.diag(1, ratio, ratio * half**2 / 3)
        grand += J.T * R * J
        coupling += J.T * R * B
    return -grand.LUsolve(coupling), alpha
