"""A measured law: drag along and across at angles of attack, and monotone curves
through the measurements."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from rft.core.checks import real_array
from rft.core.refusal import require
from rft.formulas.vectors import (
    absolute,
    copysign,
    floor,
    formula,
    gather,
    minimum,
    sqrt,
    where,
)
from rft.laws.base import LAWS, require_drag
from rft.laws.drag import rod_drag
from rft.laws.granular import Granular

MOST_ROWS = 10_000
MOST_CELLS = 4096  # of a curve on [0, 1]
LARGEST_GAP = np.radians(
    15.0
)  # from 0 to the smallest angle, and from the largest angle to pi/2


@LAWS.register
@dataclass(frozen=True)
class Table:
    """Rate-independent drag (f_t, f_n) measured at attack angles psi between velocity
    and body axis, in any one unit.

    psi (rad): attack angles, at least three different ones, of which one lies within 15
    degrees of 0 and one within 15 degrees of pi/2. Other angles are mapped to 0 to pi/2
    by symmetry, and forces at equal angles are averaged (`rft.laws.drag.rod_drag`). f_t
    (-): force per length along the body at each angle, positive against the motion, in
    the same unit as f_n. f_n (-): force per length across the body at each angle,
    positive against the motion, in the same unit as f_t.

    With the unit velocity v, f_t is a function of v.t = cos psi and f_n a function of
    v.n = sin psi, as in Eq. 3 of Zhang and Goldman (2014). Both are odd piecewise
    cubics through the origin and the measured values, monotone between neighbours and
    with a continuous derivative (PCHIP), and constant beyond the last measured value.
    Values of f_n at 0 and of f_t at pi/2 are ignored, for they vanish by symmetry.
    Forces are in units of f_t at psi = 0.

    Examples
    --------
    >>> import math
    >>> from rft.laws import Table
    >>> angles = (0.0, math.pi / 4, math.pi / 2)
    >>> medium = Table(psi=angles, f_t=(1.0, 0.8, 0.0), f_n=(0.0, 1.9, 2.5))
    >>> round(float(medium.traction(0.0, 1.0)[1]), 2)
    2.5
    """

    psi: tuple[float, ...]
    f_t: tuple[float, ...]
    f_n: tuple[float, ...]
    dry = None
    viscous = None
    mirror = True
    law = "table"

    def __post_init__(self):
        psi = real_array("psi", self.psi)
        f_t = real_array("f_t", self.f_t)
        f_n = real_array("f_n", self.f_n)
        require(
            psi.shape == f_t.shape == f_n.shape == (psi.size,)
            and 3 <= psi.size <= MOST_ROWS,
            f"psi, f_t and f_n must each have 3 to {MOST_ROWS} numbers",
        )
        for name, x in (("psi", psi), ("f_t", f_t), ("f_n", f_n)):
            require(bool(np.isfinite(x).all()), f"{name} must be finite numbers")
            object.__setattr__(self, name, tuple(x.tolist()))
        largest = np.abs(psi).max()
        require(
            largest <= 2 * np.pi + 1e-09,
            f"psi is in rad, at most 2 pi, got {largest:g}",
            instead="write psi_deg for degrees",
        )
        data = rod_drag(np.degrees(psi), f_t, f_n)
        require(
            data.psi.min() <= LARGEST_GAP
            and data.psi.max() >= np.pi / 2 - LARGEST_GAP
            and (len(np.unique(data.psi.round(9))) > 2),
            "the angles must include one within 15 degrees of 0, one within 15 "
            "degrees of 90, and at least one between them",
        )
        along = _monotone_curve(np.cos(data.psi), data.forces[0])
        across = _monotone_curve(np.sin(data.psi), data.forces[1])
        unit = float(along(1.0))
        if unit <= 0:
            unit = float(across(1.0))
        require(unit > 0, "there is no drag at psi = 0 or at psi = 90 degrees")
        numbers = {
            **_curve_arrays("along", along, unit),
            **_curve_arrays("across", across, unit),
        }
        object.__setattr__(self, "numbers", numbers)
        for name, x in numbers.items():
            object.__setattr__(self, name, x)
        require_drag(self)

    @formula
    def traction(self, v_t: Any, v_n: Any, rounding: Any = 0.0) -> Any:
        """Return the drag per unit length (f_t, f_n) opposing (v_t, v_n), in units of
        the axial drag; zero at rest."""
        inverse = inverse_speed(v_t, v_n, rounding)
        f_t, _ = curve(
            v_t * inverse,
            self.along,
            self.along_cells,
            self.along_knots,
            self.along_steps,
        )
        f_n, _ = curve(
            v_n * inverse,
            self.across,
            self.across_cells,
            self.across_knots,
            self.across_steps,
        )
        return f_t, f_n

    @formula
    def slopes(self, v_t: Any, v_n: Any, rounding: Any) -> Any:
        """Return (df_t/dv_t, df_t/dv_n, df_n/dv_t, df_n/dv_n); infinite slopes at rest
        are returned as 0."""
        inverse = inverse_speed(v_t, v_n, rounding)
        c = v_t * inverse
        s = v_n * inverse
        e = rounding * inverse
        _, by_c = curve(
            c, self.along, self.along_cells, self.along_knots, self.along_steps
        )
        _, by_s = curve(
            s, self.across, self.across_cells, self.across_knots, self.across_steps
        )
        by_c = by_c * inverse
        by_s = by_s * inverse
        return (
            by_c * (s * s + e * e),
            -by_c * c * s,
            -by_s * c * s,
            by_s * (c * c + e * e),
        )

    @classmethod
    def examples(cls) -> dict[str, Table]:
        psi = np.linspace(0.0, np.pi / 2, 12)
        return {
            "measured": cls(
                psi, *Granular(C=1.4, gamma0=0.25).traction(np.cos(psi), np.sin(psi))
            )
        }


@formula
def inverse_speed(v_t, v_n, rounding):
    """Return 1 / sqrt(|v|^2 + rounding^2); 0 at rest without rounding."""
    size2 = v_t * v_t + v_n * v_n + rounding * rounding
    return where(size2 > 0.0, 1.0, 0.0) / sqrt(where(size2 > 0.0, size2, 1.0))


@formula
def curve(x, pieces, cells, knots, steps):
    """Return value and slope at x, |x| <= 1, of an odd piecewise cubic.

    pieces: (K, 4), coefficients about each knot in [0, 1], the highest power first.
    cells: (N + 1, 1), the piece at the left end of each of N equal cells of [0, 1].
    knots: (K + 1, 1), the last one beyond 1. steps: (S, 1), S the most knots in a
    cell."""
    a = minimum(absolute(x), 1.0)
    piece = gather(cells, floor(a * (1.0 * (len(cells) - 1))), 0)
    for _ in range(len(steps)):
        piece = piece + where(a >= gather(knots, piece + 1.0, 0), 1.0, 0.0)
    d = a - gather(knots, piece, 0)
    c3 = gather(pieces, piece, 0)
    c2 = gather(pieces, piece, 1)
    c1 = gather(pieces, piece, 2)
    c0 = gather(pieces, piece, 3)
    value = c0 + d * (c1 + d * (c2 + d * c3))
    slope = c1 + d * (2.0 * c2 + d * (3.0 * c3))
    return copysign(value, x), slope


def _curve_arrays(name: str, polynomial, unit: float) -> dict[str, np.ndarray]:
    """Return the arrays that `curve` takes, by name, from one of SciPy's odd piecewise
    polynomials on [-1, 1]."""
    half = polynomial.x >= 0.0
    knots = polynomial.x[half]
    pieces = polynomial.c.T[half[:-1]] / unit
    count = min(MOST_CELLS, 1 << int(np.ceil(np.log2(1.0 / np.diff(knots).min()))))
    first = np.searchsorted(knots, np.arange(count + 1) / count, side="right") - 1
    cells = np.minimum(first, len(pieces) - 1)
    steps = np.zeros(max(1, np.diff(first).max()))
    columns = {"cells": cells, "knots": [*knots[:-1], 2.0], "steps": steps}
    columns = {
        f"{name}_{key}": np.array(x, float).reshape(-1, 1) for key, x in columns.items()
    }
    return {name: np.ascontiguousarray(pieces), **columns}


def _monotone_curve(x: np.ndarray, f: np.ndarray):
    """Return the odd monotone piecewise cubic on [-1, 1] through the origin and (x, f),
    the mean of f where x repeats."""
    from scipy.interpolate import PchipInterpolator

    knots, index = np.unique(np.round(x, 12), return_inverse=True)
    values = np.bincount(index, f) / np.bincount(index)
    positive = knots > 1e-9
    knots = knots[positive]
    values = values[positive]
    if knots[-1] < 1.0:
        knots = np.append(knots, 1.0)
        values = np.append(values, values[-1])
    return PchipInterpolator(
        np.concatenate([-knots[::-1], [0.0], knots]),
        np.concatenate([-values[::-1], [0.0], values]),
    )
