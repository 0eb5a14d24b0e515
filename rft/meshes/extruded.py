"""The stress map of the vertical plane for faces that point and move in any direction.

In the plane the nine-term map (`rft.plates.stress.StressMap`) has trigonometric functions of the tilt beta and of the
direction of motion gamma. With n the normal of a face, v the unit vector of its velocity, both cut into a part along the
vertical, n_z and v_z, and a horizontal vector, n_h and v_h, they read

    cos 2 beta = n_z^2 - n_h^2,    sin 2 beta = -2 n_z n_h,    sin gamma = -v_z,    cos gamma = v_h,
    sin 2 beta cos gamma = -2 n_z n_h . v_h,    cos 2 beta cos gamma = n_z^2 v_h - n_h (n_h . v_h).

In these terms the map needs no plane. It rotates with n and v about the vertical, takes either normal of a face, and equals
the map of the vertical plane wherever n and v lie in one. Out of the plane the form is chosen so that an upright face that
moves along itself bears nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rft.ground.lead import rounded
from rft.meshes.triples import UP, dot, minus, plus, times
from rft.plates.stress import COEFFICIENTS, PER_CUBIC_METRE, StressMap
from rft.refusal import formatted, require
from rft.vectors import formula, maximum, minimum, sqrt, where

CUT = 0.05  # width, in n . v times the cosine between stress and n, over which a cut of tension is rounded
SHARPEST = 2e-3  # least sine of the angle over which stress rises: implicit time steps cannot solve a jump
NUMBERS = (*COEFFICIENTS, "zeta", "cut")


@formula
def traction_of_map(s, n, v, up=UP):
    """Return the force per area and depth, N/m^3, by the numbers of a stress map on faces with unit normals n and unit
    velocities v, whether or not they lead; ``up`` is the unit vector upwards."""
    n_z, v_z, along = dot(up, n), dot(up, v), dot(n, v)
    n_h, v_h, inner = (
        minus(n, times(n_z, up)),
        minus(v, times(v_z, up)),
        along - n_z * v_z,
    )
    cos_2b = n_z * n_z - dot(n_h, n_h)
    total, difference = s.C11 + s.Cm11, s.Cm11 - s.C11
    a_z = (
        s.A00
        + s.A10 * cos_2b
        - (s.B11 + s.Bm11) * cos_2b * v_z
        - (s.B11 - s.Bm11) * 2.0 * n_z * inner
        - s.B01 * v_z
    )
    a_h = plus(
        times((s.C01 + total) * n_z * n_z, v_h),
        times((s.C01 - total) * inner + 2.0 * n_z * (difference * v_z - s.D10), n_h),
    )
    traction = times(PER_CUBIC_METRE * s.zeta, minus(times(a_z, up), a_h))
    if s.cut == 0.0:
        return traction
    push = -(dot(traction, n) * along) / maximum(sqrt(dot(traction, traction)), 1e-300)
    return times(minimum(maximum(0.5 + push / CUT, 0.0), 1.0), traction)


@dataclass(frozen=True)
class Extruded:
    """A stress map of the vertical plane as a law of three dimensions."""

    stress: StressMap

    def __post_init__(self):
        message = f"stress must be a StressMap, nine coefficients, got {formatted(self.stress)}: fit some to plate drags"
        require(isinstance(self.stress, StressMap), message)

    def __getattr__(self, name: str) -> float:
        """Return a number of the map; the formulas read these."""
        if name in NUMBERS:
            return getattr(self.stress, name)
        raise AttributeError(name)

    @property
    def numbers(self) -> dict[str, float]:
        """Numbers that the formulas read (`rft.laws.records.law_numbers`)."""
        return {name: float(getattr(self.stress, name)) for name in NUMBERS}

    traction = traction_of_map

    @property
    def grazing_sine(self) -> float:
        """Sine of the grazing angle (`rft.plates.stress.PlateStress`), at least `SHARPEST`."""
        return max(math.sin(self.stress.grazing), SHARPEST)

    @formula
    def lead(self, n_dot_v, grazing_sine, sheet=False):
        """Return the share of the traction that faces bear, 0 to 1; 1 on a thin sheet, of which either side leads."""
        return where(sheet, 1.0, rounded(n_dot_v, grazing_sine))
