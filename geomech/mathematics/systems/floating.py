"""A floating chain of links: in space, on ice or on an air table, without outer forces.

It turns, and goes nowhere. Its centre of mass stays in place, and its angular momentum
zero: a cat's righting, a diver's twist. Source: R. M. Murray, Z. Li and S. S. Sastry, A
Mathematical Introduction to Robotic Manipulation (1994), Ch. 7; the three-link chain is
the first example of G. C. Walsh and S. S. Sastry, IEEE Trans. Robotics and Automation
11, 139 (1995)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from geomech.mathematics.systems.base import SYSTEMS
from geomech.mathematics.systems.momentum import Momentum


@SYSTEMS.register
@dataclass(frozen=True)
class FloatingChain(Momentum):
    """Links joined by hinges, each with its mass and moment of inertia.

    masses (-): relative masses of the links; in proportion to their lengths if left
    out. inertias (-): moment of inertia of each link about its centre, over its mass
    and the square of its length; if left out 1/12, the value of a thin rod.

    Examples
    --------
    >>> from geomech.mathematics.systems import FloatingChain
    >>> xi = FloatingChain(lengths=(1, 1, 1)).velocity([0.5, 0.3], [1.0, 0.0])
    >>> xi.round(4) + 0.0  # no -0
    array([ 0.    ,  0.    , -0.0841])
    """

    masses: tuple[float, ...] = ()
    inertias: tuple[float, ...] = ()

    kind = "floating-chain"

    def __post_init__(self):
        super().__post_init__()
        self.check_per_link("masses", 1e-9, 1e9)
        self.check_per_link("inertias", 1e-6, 1e6)

    def inertia(self, number: int = float) -> tuple[list[Any], list[list[Any]]]:
        """Return masses, as shares of the whole chain's, and inertias of the links
        (`Momentum.inertia`)."""
        lengths = list(map(number, self.lengths))
        masses = list(map(number, self.masses)) or lengths
        rod = number(1) / 12
        coefficients = list(map(number, self.inertias)) or [rod] * len(lengths)
        body = sum(lengths)
        total = sum(masses)
        shares = []
        inertias = []
        for mass, coefficient, length in zip(masses, coefficients, lengths):
            share = mass / total
            about = coefficient * share * (length / body) ** 2
            shares.append(share)
            inertias.append([share, share, about])
        return shares, inertias

    @classmethod
    def examples(cls) -> dict[str, FloatingChain]:
        chain = cls(
            lengths=(0.8, 1.3, 1.0),
            length=0.4,
            frame="mean",
            masses=(1.0, 0.5, 2.0),
            inertias=(0.1, 0.2, 0.05),
        )
        return {"floating-chain": chain}
