"""A law as it was measured: drag along and across by the angle of attack, and a monotone curve through it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rft.drag import rod_drag
from rft.media.base import real_array, require, require_drag

MOST_ROWS = 10_000
REACH = np.radians(15.0)  # how near to 0 and pi/2 the angles must come


@dataclass(frozen=True)
class Table:
    """Rate-independent drag (f_t, f_n) measured at attack angles psi between velocity and body axis, in any one unit.

    psi (rad): at least three different angles that come within 15 degrees of 0 and of pi/2; others are folded between, and
    those measured again averaged (`rft.drag.rod_drag`). f_t, f_n (-): as many forces per length along and across, in one unit
    of any kind, positive against the motion.

    With the unit velocity v, f_t is a function of v.t = cos psi and f_n one of v.n = sin psi, as in Eq. 3 of Zhang and Goldman
    (2014): odd ones, through the origin and the measured values, by piecewise cubics that are monotone between neighbours and
    have a continuous derivative (PCHIP). They hold the last value where the angles do not reach 0 or pi/2; what was measured
    of f_n at 0 and of f_t at pi/2, where symmetry allows none, is left out. Forces are in units of f_t at psi = 0.
    """

    psi: tuple[float, ...]
    f_t: tuple[float, ...]
    f_n: tuple[float, ...]
    angles = ("psi",)
    dry = None
    viscous = None
    mirror = True

    def __post_init__(self):
        rows = [real_array(name, getattr(self, name)) for name in ("psi", "f_t", "f_n")]
        alike = all(x.ndim == 1 and x.size == rows[0].size for x in rows)
        require(
            alike and 3 <= rows[0].size <= MOST_ROWS, f"psi, f_t and f_n must be rows of 3 to {MOST_ROWS} numbers each"
        )
        for name, x in zip(("psi", "f_t", "f_n"), rows):
            require(bool(np.isfinite(x).all()), f"{name} must be finite numbers")
            object.__setattr__(self, name, tuple(x.tolist()))
        largest = np.abs(rows[0]).max()
        require(largest <= 2 * np.pi + 1e-9, f"psi is in rad, at most 2 pi, got {largest:g}: write psi_deg for degrees")
        data = rod_drag(np.degrees(rows[0]), *rows[1:])
        require(
            data.psi.min() <= REACH and data.psi.max() >= np.pi / 2 - REACH and len(np.unique(data.psi.round(9))) > 2,
            "the angles must come within 15 degrees of 0 and of 90, with at least one more between",
        )
        along, across = (_curve(x, f) for x, f in zip((np.cos(data.psi), np.sin(data.psi)), data.forces))
        unit = float(along(1.0)) if along(1.0) > 0 else float(across(1.0))
        require(unit > 0, "there is no drag at psi = 0 nor at psi = 90 degrees")
        object.__setattr__(self, "_curves", (along, across, along.derivative(), across.derivative(), unit))
        require_drag(self)

    def traction(self, v_t, v_n, eps=0.0) -> tuple[np.ndarray, np.ndarray]:
        """Drag per unit length (f_t, f_n) opposing (v_t, v_n), in units of the axial drag; zero at rest."""
        along, across, _, _, unit = self._curves
        c, s, _ = _parts(v_t, v_n, eps)
        return np.sign(c) * along(np.abs(c)) / unit, np.sign(s) * across(np.abs(s)) / unit  # odd to the last digit

    def derivatives(self, v_t, v_n, eps=0.0) -> tuple[tuple[np.ndarray, ...], tuple[np.ndarray, ...]]:
        """((df_t/dv_t, df_t/dv_n), (df_n/dv_t, df_n/dv_n)); infinite slopes at rest are returned as 0."""
        _, _, along, across, unit = self._curves
        c, s, inverse = _parts(v_t, v_n, eps)
        e2 = (eps * inverse) ** 2
        by_c, by_s = along(np.abs(c)) * inverse / unit, across(np.abs(s)) * inverse / unit
        return (by_c * (s * s + e2), -by_c * c * s), (-by_s * c * s, by_s * (c * c + e2))


def _parts(v_t, v_n, eps) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """v / |v| and 1 / |v|, with |v|^2 rounded off by eps^2; zeros at rest."""
    v_t, v_n = np.broadcast_arrays(np.asarray(v_t, float), np.asarray(v_n, float))
    size = np.hypot(np.hypot(v_t, v_n), eps)
    inverse = 1.0 / np.where(size == 0.0, np.inf, size)
    return v_t * inverse, v_n * inverse, inverse


def _curve(x: np.ndarray, f: np.ndarray):
    """The odd monotone piecewise cubic on [-1, 1] through the origin and (x, f), the mean of f where x repeats."""
    from scipy.interpolate import PchipInterpolator

    knots, which = np.unique(np.round(x, 12), return_inverse=True)
    values = np.bincount(which, f) / np.bincount(which)
    inner = knots > 1e-9
    knots, values = knots[inner], values[inner]
    if knots[-1] < 1.0:
        knots, values = np.append(knots, 1.0), np.append(values, values[-1])
    return PchipInterpolator(
        np.concatenate([-knots[::-1], [0.0], knots]), np.concatenate([-values[::-1], [0.0], values])
    )
