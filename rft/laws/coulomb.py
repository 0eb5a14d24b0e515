"""Isotropic Coulomb friction: the drag has one magnitude, whatever the direction."""

from __future__ import annotations

from dataclasses import dataclass

from rft.laws.base import TermLaw


@dataclass(frozen=True)
class Coulomb(TermLaw):
    """f_t = v.t, f_n = v.n with v the unit velocity: `Granular` with C = 0. The unit of force is the yield force."""

    dry = ((1.0, 1.0, 1.0),)
