"""Stress of grains on a plate in the vertical plane, per unit depth: the map
alpha_x,z(beta, gamma) of Sec. II B and Fig. 7.

Axes: x forward, z up, the surface at z = 0. beta: tilt of the plate, 0 lying flat, pi/2
upright; its leading normal is n = (sin beta, -cos beta). gamma: direction of motion
below the horizontal, v = (cos gamma, -sin gamma). The force on an area A at depth |z|
is |z| A (-alpha_x, alpha_z), alpha in N/cm^3 (Eq. 4).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from rft.core.checks import Number, check_numbers, real_array
from rft.core.refusal import require
from rft.formulas.vectors import absolute, formula, where

PER_CUBIC_METRE = 1e6  # N/m^3 in one N/cm^3
TENSION = ("keep", "cut")
# Assumed; the drag of smooth rods is 0.2 % less than with a jump.
GRAZING = math.radians(0.25)


def _coefficient(meaning: str) -> Number:
    return Number(-1e6, 1e6, "N/cm^3", meaning)


CosineZ = Annotated[float, _coefficient("coefficient of a cosine in alpha_z")]
SineZ = Annotated[
    float, _coefficient("coefficient of a sine in alpha_z, where m = -1 is written m1")
]
CosineX = Annotated[float, _coefficient("coefficient of a cosine in alpha_x")]
SineX = Annotated[float, _coefficient("coefficient of a sine in alpha_x")]
Zeta = Annotated[
    float,
    Number(
        1e-6,
        1e6,
        "-",
        "strength of the medium, by which its coefficients are multiplied",
    ),
]
Grazing = Annotated[
    float,
    Number(
        0, math.pi / 4, "rad",
        "angle between motion and face over which the stress on a face of a closed "
        "body rises from zero to its value in the map; 0 for a jump",
    ),
]  # fmt: skip


@formula
def alpha(law, n, v):
    """Return (alpha_x, alpha_z), N/cm^3, for any unit normal n = (n_x, n_z) and unit
    velocity v = (v_x, v_z), from `PlateStress.alpha_ahead` and the mirror symmetry of
    the map."""
    mirror = where(v[0] < 0.0, -1.0, 1.0)
    a_x, a_z = law.alpha_ahead((mirror * n[0], n[1]), (absolute(v[0]), v[1]))
    a_x = mirror * a_x
    if law.cut == 0.0:
        return a_x, a_z
    pushes = (n[1] * a_z - n[0] * a_x) * (n[0] * v[0] + n[1] * v[1]) <= 0.0
    return where(pushes, a_x, 0.0), where(pushes, a_z, 0.0)


class PlateStress:
    """Base of stress maps.

    A map gives `alpha_ahead` for motion forwards, gamma within +-pi/2. All other
    directions follow by mirror symmetry, and because a plate rotated by pi is the same
    plate:

        alpha_x(beta, gamma) = -alpha_x(-beta, +-pi - gamma),
        alpha_z(beta, gamma) = alpha_z(-beta, +-pi - gamma).

    grazing: angle between motion and face, rad, over which the stress on the face of a
    closed body rises. A thin plate has no jump where it slides along itself: its other
    face leads. tension: "keep" leaves the stress on faces that the map pulls on instead
    of pushing, "cut" sets it to 0, which is nearer to what beds of grains bear in level
    motion.

    Examples
    --------
    >>> import math
    >>> from rft.terradynamics.plates import VERTICAL
    >>> stress = VERTICAL["poppy-seeds-loose"].stress
    >>> alpha_x, alpha_z = stress(0.0, math.pi / 2)  # a level plate pushed down, N/cm^3
    >>> round(float(alpha_x), 3), round(float(alpha_z), 3)
    (0.0, 0.254)
    """

    grazing: float
    tension: str

    def alpha_ahead(self, n, v) -> tuple[np.ndarray, np.ndarray]:
        """Return (alpha_x, alpha_z), N/cm^3, for unit normals n = (n_x, n_z), either of
        the plate's two, and unit velocities v = (v_x, v_z) with v_x >= 0."""
        raise NotImplementedError

    def __call__(self, beta, gamma) -> tuple[np.ndarray, np.ndarray]:
        """Return (alpha_x, alpha_z), N/cm^3, for angles in radians, of any size, that
        broadcast together."""
        beta = real_array("beta", beta)
        gamma = real_array("gamma", gamma)
        n = np.sin(beta), -np.cos(beta)
        v = np.cos(gamma), -np.sin(gamma)
        return self.alpha(n, v)

    def alpha(self, n, v) -> tuple[np.ndarray, np.ndarray]:
        """Return (alpha_x, alpha_z), N/cm^3, for unit normals n = (n_x, n_z) and unit
        velocities v = (v_x, v_z), pairs of arrays."""
        return alpha(self, n, v)

    @property
    def cut(self) -> float:
        """1.0 if faces that the map pulls on bear no stress, else 0.0."""
        return float(self.tension == "cut")

    def _check(self) -> None:
        """Raise ValueError for numbers out of range and for an unknown tension."""
        check_numbers(self)
        is_known = isinstance(self.tension, str) and self.tension in TENSION
        require(
            is_known,
            f"tension must be {' or '.join(map(repr, TENSION))}",
            value=self.tension,
        )


@dataclass(frozen=True)
class StressMap(PlateStress):
    """The map as nine Fourier coefficients in N/cm^3, times zeta:

        alpha_z = sum A_mn cos(2 m beta + n gamma) + B_mn sin(2 m beta + n gamma),
        alpha_x = sum C_mn cos(2 m beta + n gamma) + D_mn sin(2 m beta + n gamma)

    with m in -1, 0, 1 and n in 0, 1.

    The defaults are the generic set M0. Source: Li, Zhang and Goldman, Science 339,
    1408 (2013), Table S2; Fig. 7 of Zhang and Goldman (2014).

    Examples
    --------
    >>> import math
    >>> from rft.terradynamics.plates import StressMap
    >>> stress = StressMap(zeta=0.5)
    >>> alpha_x, alpha_z = stress(0.0, math.pi / 2)  # a level plate pushed down, N/cm^3
    >>> round(float(alpha_z), 3)
    0.5
    """

    A00: CosineZ = 0.206
    A10: CosineZ = 0.169
    B11: SineZ = 0.212
    B01: SineZ = 0.358
    Bm11: SineZ = 0.055
    C11: CosineX = -0.124
    C01: CosineX = 0.253
    Cm11: CosineX = 0.007
    D10: SineX = 0.088
    zeta: Zeta = 1.0
    grazing: Grazing = GRAZING
    tension: str = "keep"

    def __post_init__(self):
        self._check()

    @formula
    def alpha_ahead(self, n, v):
        cos_2b = n[1] * n[1] - n[0] * n[0]
        sin_2b = -2.0 * n[0] * n[1]
        cos_g = v[0]
        sin_g = -v[1]
        # sin(gamma +- 2 beta) = cos_sin +- sin_cos
        # cos(gamma +- 2 beta) = cos_cos -+ sin_sin
        cos_sin = cos_2b * sin_g
        sin_cos = sin_2b * cos_g
        cos_cos = cos_2b * cos_g
        sin_sin = sin_2b * sin_g
        a_z = (
            self.A00
            + self.A10 * cos_2b
            + (self.B11 + self.Bm11) * cos_sin
            + (self.B11 - self.Bm11) * sin_cos
        )
        a_x = (
            (self.C11 + self.Cm11) * cos_cos
            + (self.Cm11 - self.C11) * sin_sin
            + self.C01 * cos_g
            + self.D10 * sin_2b
        )
        return self.zeta * a_x, self.zeta * (a_z + self.B01 * sin_g)


COEFFICIENTS = ("A00", "A10", "B11", "B01", "Bm11", "C11", "C01", "Cm11", "D10")
