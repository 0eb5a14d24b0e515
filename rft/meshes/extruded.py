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

import numpy as np

from rft.ground.lead import rounded
from rft.plates.stress import PER_CUBIC_METRE, StressMap
from rft.refusal import formatted, require

CUT = 0.05  # width, in n . v times the cosine between stress and n, over which a cut of tension is rounded
SHARPEST = 2e-3  # least sine of the angle over which stress rises: implicit time steps cannot solve a jump
UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Extruded:
    """A stress map of the vertical plane as a law of three dimensions."""

    stress: StressMap

    def __post_init__(self):
        message = (
            f"stress must be a StressMap, nine coefficients, got {formatted(self.stress)}: fit some to plate drags"
        )
        require(isinstance(self.stress, StressMap), message)

    def traction(self, n: np.ndarray, v: np.ndarray, up: np.ndarray = UP) -> np.ndarray:
        """Return the force per area and depth (3, N), N/m^3, on faces with unit normals n and unit velocities v (3, N),
        whether or not they lead; ``up`` (3,) is the unit vector upwards."""
        s, n_z, v_z, along = self.stress, up @ n, up @ v, (n * v).sum(0)
        n_h, v_h, inner = n - n_z * up[:, None], v - v_z * up[:, None], along - n_z * v_z
        cos_2b = n_z * n_z - (n_h * n_h).sum(0)
        total, difference = s.C11 + s.Cm11, s.Cm11 - s.C11
        a_z = (
            s.A00 + s.A10 * cos_2b - (s.B11 + s.Bm11) * cos_2b * v_z - (s.B11 - s.Bm11) * 2 * n_z * inner - s.B01 * v_z
        )
        a_h = (s.C01 + total) * n_z * n_z * v_h
        a_h = a_h + ((s.C01 - total) * inner + 2 * n_z * (difference * v_z - s.D10)) * n_h
        traction = PER_CUBIC_METRE * s.zeta * (a_z * up[:, None] - a_h)
        if s.tension == "keep":
            return traction
        push = -(traction * n).sum(0) * along / np.maximum(np.sqrt((traction * traction).sum(0)), 1e-300)
        return traction * np.clip(0.5 + push / CUT, 0.0, 1.0)

    @property
    def grazing_sine(self) -> float:
        """Sine of the grazing angle (`rft.plates.stress.PlateStress`), at least `SHARPEST`."""
        return max(math.sin(self.stress.grazing), SHARPEST)

    def lead(self, n_dot_v: np.ndarray, grazing_sine: float, sheet: np.ndarray | bool = False) -> np.ndarray:
        """Return the share of the traction that faces bear, 0 to 1; 1 on a thin sheet, of which either side leads."""
        return np.where(sheet, 1.0, rounded(n_dot_v, grazing_sine))
