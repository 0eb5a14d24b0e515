"""Isotropic Coulomb friction: the drag has one magnitude, whatever the direction."""

from __future__ import annotations

from dataclasses import dataclass

from rft.laws.base import LAWS, TermLaw


@LAWS.register
@dataclass(frozen=True)
class Coulomb(TermLaw):
    """Isotropic friction: f_t = v.t, f_n = v.n with v the unit velocity, in units of
    the yield force.

    The law is that of `Granular` with C = 0.

    Examples
    --------
    >>> from rft import Coulomb
    >>> [float(f) for f in Coulomb().traction(0.6, 0.8)]  # along and across
    [0.6, 0.8]
    """

    dry = ((1.0, 1.0, 1.0),)
    law = "coulomb"
