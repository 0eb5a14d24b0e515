"""A chain of links afloat: in space, on ice or an air table, where nothing pushes. It turns itself about, and goes nowhere.

Its centre of mass stays where it is, and its angular momentum zero: a cat's righting, a diver's twist. Source: R. M. Murray,
Z. Li and S. S. Sastry, A Mathematical Introduction to Robotic Manipulation (1994), Ch. 7; the three-link chain is the first
example of G. C. Walsh and S. S. Sastry, IEEE Trans. Robotics and Automation 11, 139 (1995).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from geomech.systems.base import SYSTEMS
from geomech.systems.momentum import Momentum


@SYSTEMS.register
@dataclass(frozen=True)
class FloatingChain(Momentum):
    """Links joined by hinges, with masses and moments of inertia of their own.

    masses (-): of the links, relative; as their lengths if left out. inertias (-): of each link about its centre, over its
    mass and the square of its length; 1/12, that of a thin rod, if left out.

    Examples
    --------
    >>> from geomech.systems import FloatingChain
    >>> FloatingChain(lengths=(1, 1, 1)).velocity([0.5, 0.3], [1.0, 0.0]).round(4)
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
        """Return masses, as shares of the whole chain's, and inertias of the links (`Momentum.inertia`)."""
        lengths = [number(x) for x in self.lengths]
        masses = [number(x) for x in self.masses] or lengths
        rod = number(1) / 12
        inertias = [number(x) for x in self.inertias] or [rod] * len(lengths)
        body, total = sum(lengths), sum(masses)
        masses = [m / total for m in masses]
        return masses, [
            [m, m, k * m * (x / body) ** 2]
            for m, k, x in zip(masses, inertias, lengths)
        ]

    @classmethod
    def examples(cls) -> dict[str, FloatingChain]:
        return {
            "floating-chain": cls(
                (0.8, 1.3, 1.0), 0.4, "mean", (1.0, 0.5, 2.0), (0.1, 0.2, 0.05)
            )
        }
