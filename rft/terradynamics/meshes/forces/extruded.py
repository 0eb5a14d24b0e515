"""The stress map of the vertical plane for faces that point and move in any direction.

In the plane the nine-term map (`rft.terradynamics.plates.stress.StressMap`) has
trigonometric functions of the tilt beta and of the direction of motion gamma. Here n is
the normal of a face and v the unit vector of its velocity. Each is split into its part
along the vertical, n_z and v_z, and a horizontal vector, n_h and v_h. Then

    cos 2 beta = n_z^2 - n_h^2,    sin 2 beta = -2 n_z n_h,
    cos gamma = v_h,    sin gamma = -v_z,
    sin 2 beta cos gamma = -2 n_z n_h . v_h,
    cos 2 beta cos gamma = n_z^2 v_h - n_h (n_h . v_h).

In these terms the map needs no plane. It rotates with n and v about the vertical, takes
either normal of a face, and equals the map of the vertical plane wherever n and v lie
in one. Out of the plane the form is chosen so that an upright face that moves along
itself bears nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from rft.core.refusal import formatted, require
from rft.formulas.vectors import formula, maximum, minimum, sqrt, where
from rft.terradynamics.ground.lead import rounded_step, rounded_step_slope
from rft.terradynamics.meshes.forces.triples import UP, dot, minus, plus, times
from rft.terradynamics.plates.stress import COEFFICIENTS, PER_CUBIC_METRE, StressMap

# Width, in n . v times the cosine between stress and n, over which a cut of tension is
# rounded; assumed.
CUT = 0.05
# Least sine of the angle over which stress rises: implicit time steps cannot solve a
# jump.
SHARPEST = 2e-3
NUMBERS = (*COEFFICIENTS, "zeta", "cut")


@formula
def uncut_traction(s, n, v, up):
    """Return `traction_of_map` before any cut of tension."""
    n_z = dot(up, n)
    v_z = dot(up, v)
    n_h = minus(n, times(n_z, up))
    v_h = minus(v, times(v_z, up))
    inner = dot(n, v) - n_z * v_z  # n_h . v_h
    cos_2b = n_z * n_z - dot(n_h, n_h)
    total = s.C11 + s.Cm11
    difference = s.Cm11 - s.C11
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
    return times(PER_CUBIC_METRE * s.zeta, minus(times(a_z, up), a_h))


@formula
def traction_of_map(s, n, v, up=UP):
    """Return the force per area and depth, N/m^3, by the numbers s of a stress map on
    faces with unit normals n and unit velocities v, whether or not they lead; ``up`` is
    the unit vector upwards."""
    traction = uncut_traction(s, n, v, up)
    if s.cut == 0.0:
        return traction
    along = dot(n, v)
    push = -(dot(traction, n) * along) / maximum(sqrt(dot(traction, traction)), 1e-300)
    return times(minimum(maximum(0.5 + push / CUT, 0.0), 1.0), traction)


@formula
def slope_of_map(s, n, v, up, k):
    """Return the slope of `traction_of_map` by the component of v along the unit vector
    k, for stress maps that keep their tension."""
    n_z = dot(up, n)
    k_z = dot(up, k)
    n_h = minus(n, times(n_z, up))
    k_h = minus(k, times(k_z, up))
    inner = dot(n, k) - n_z * k_z
    cos_2b = n_z * n_z - dot(n_h, n_h)
    total = s.C11 + s.Cm11
    difference = s.Cm11 - s.C11
    a_z = (
        -((s.B11 + s.Bm11) * cos_2b + s.B01) * k_z
        - (s.B11 - s.Bm11) * 2.0 * n_z * inner
    )
    a_h = plus(
        times((s.C01 + total) * n_z * n_z, k_h),
        times((s.C01 - total) * inner + 2.0 * n_z * difference * k_z, n_h),
    )
    return times(PER_CUBIC_METRE * s.zeta, minus(times(a_z, up), a_h))


@formula
def slope_of_cut_map(s, n, v, up, k):
    """Return the slope of `traction_of_map` by the component of v along the unit vector
    k, for all stress maps."""
    slope = slope_of_map(s, n, v, up, k)
    if s.cut == 0.0:
        return slope
    traction = uncut_traction(s, n, v, up)
    size = maximum(sqrt(dot(traction, traction)), 1e-300)
    across = dot(traction, n) / size
    along = dot(n, v)
    share = 0.5 - across * along / CUT
    by_k = (
        dot(slope, n) * along / size
        + across * dot(n, k)
        - across * along * dot(traction, slope) / (size * size)
    )
    share_slope = where((share > 0.0) & (share < 1.0), -by_k / CUT, 0.0)
    share = minimum(maximum(share, 0.0), 1.0)
    return plus(times(share, slope), times(share_slope, traction))


@dataclass(frozen=True)
class Extruded:
    """A stress map of the vertical plane as a law of three dimensions."""

    stress: StressMap

    def __post_init__(self):
        require(
            isinstance(self.stress, StressMap),
            "stress must be a StressMap with nine coefficients, got "
            f"{formatted(self.stress)}: fit one to plate drags",
        )

    def __getattr__(self, name: str) -> float:
        # The formulas read the numbers of the map from the law.
        if name in NUMBERS:
            return getattr(self.stress, name)
        raise AttributeError(name)

    @property
    def numbers(self) -> dict[str, float]:
        """Numbers that the formulas read (`rft.laws.records.law_numbers`)."""
        return {name: float(getattr(self.stress, name)) for name in NUMBERS}

    traction = traction_of_map
    traction_slope = slope_of_cut_map

    @property
    def grazing_sine(self) -> float:
        """Sine of the grazing angle (`rft.terradynamics.plates.stress.PlateStress`), at
        least `SHARPEST`."""
        return max(math.sin(self.stress.grazing), SHARPEST)

    @formula
    def lead(self, n_dot_v, grazing_sine, sheet=False):
        """Return the share of the traction that faces bear, 0 to 1; 1 on a thin sheet,
        of which either side leads."""
        return where(sheet, 1.0, rounded_step(n_dot_v, grazing_sine))

    @formula
    def lead_slope(self, n_dot_v, grazing_sine, sheet=False):
        """Return the slope of `lead` by n_dot_v."""
        return where(sheet, 0.0, rounded_step_slope(n_dot_v, grazing_sine))
