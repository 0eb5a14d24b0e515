"""Touching beads along the links, with the mobility of Rotne, Prager and Yamakawa.

Two spheres of radius a at a distance r have the mobility

    r >= 2 a:  (1 + 2 a^2 / 3 r^2) / r I + (1 - 2 a^2 / r^2) / r n n
    r <  2 a:  4 / 3 a [(1 - 9 r / 32 a) I + 3 r / 32 a n n]

in units of 1 / 8 pi mu, with n along the line between them; the second, for spheres
that overlap, tends to that of a single sphere, 4 / 3 a, as r goes to 0. The matrix is
positive definite for all positions. Sources: J. Rotne and S. Prager, J. Chem. Phys. 50,
4831 (1969); H. Yamakawa, J. Chem. Phys. 53, 436 (1970). Torques and rotations of single
beads are left out.

Beads on a straight link touch: their number is the slenderness, and the count is the
model, not a numerical approximation. On a bent joint the last bead of a link and the
first of the next overlap; the second formula holds for them. A chain of touching beads
drags like a smooth cylinder of 0.85 (along) and 0.80 (across) of their radius in the
limit of a long rod."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from rft.core.checks import Number, check_numbers
from rft.hydrodynamics.base import Sites, divided

MOST_SLENDER = 1000.0  # a matrix of 2,000 rows takes 32 MB and half a second


def rotne_prager(separation: np.ndarray, radius: float) -> np.ndarray:
    """Return the mobility (..., 2, 2) of spheres of one radius at separations x + i y,
    in units of 1 / 8 pi mu; a separation of 0 is a sphere with itself.

    Examples
    --------
    >>> from rft.hydrodynamics import rotne_prager
    >>> rotne_prager(0.0, 0.1).round(3)  # 1 / 6 pi mu a
    array([[13.333,  0.   ],
           [ 0.   , 13.333]])
    """
    x = np.real(separation)
    y = np.imag(separation)
    along, rest = _isotropic(np.hypot(x, y), radius)
    xy = rest * x * y
    rows = [[along + rest * x * x, xy], [xy, along + rest * y * y]]
    return np.stack([np.stack(row, -1) for row in rows], -2)


def _isotropic(r: np.ndarray, a: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the factors of I and of r r."""
    far = np.maximum(r, 2 * a)
    ratio = (a / far) ** 2
    overlapping = r < 2 * a
    identity = np.where(
        overlapping, (4 - 9 * r / (8 * a)) / (3 * a), (1 + ratio / 1.5) / far
    )
    # At r = 0 the second term vanishes: r n n = r r / r.
    near = 0.125 / (a**2 * np.maximum(r, 1e-300))
    outer = np.where(overlapping, near, (1 - 2 * ratio) / far**3)
    return identity, outer


@dataclass(frozen=True)
class Beads:
    """Touching beads; see the module.

    slenderness (-): length of the body over its diameter.

    Examples
    --------
    >>> from rft import Chain
    >>> from rft.hydrodynamics import Beads, resistance
    >>> resistance(Beads(48), Chain(), [[0.5, 0.3]]).connection.round(4)
    array([[[-0.0026, -0.0005],
            [-0.0097, -0.0085],
            [-0.0711,  0.0623]]])
    """

    slenderness: Annotated[
        float, Number(1, MOST_SLENDER, "-", "length of the body over its diameter")
    ]

    def __post_init__(self):
        check_numbers(self)

    @property
    def radius(self) -> float:
        return 0.5 / self.slenderness

    def sites(self, fractions: np.ndarray) -> Sites:
        # A link whose length is not a whole number of diameters has beads that overlap
        # or gap by up to half a diameter in all.
        counts = np.maximum(1, np.round(fractions * self.slenderness).astype(int))
        return divided(fractions, counts)

    def mobility(
        self, sites: Sites, centre: np.ndarray, heading: np.ndarray
    ) -> np.ndarray:
        separation = centre[:, :, None] - centre[:, None, :]
        x = separation.real
        y = separation.imag
        identity, outer = _isotropic(np.abs(separation), self.radius)
        n = centre.shape[1]
        M = np.empty((len(centre), 2, n, 2, n))
        M[:, 0, :, 0] = identity + outer * x * x
        M[:, 1, :, 1] = identity + outer * y * y
        M[:, 0, :, 1] = outer * x * y
        M[:, 1, :, 0] = M[:, 0, :, 1]
        return M.reshape(-1, 2 * n, 2 * n)
