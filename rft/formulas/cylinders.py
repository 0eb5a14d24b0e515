"""Drag on a straight circular cylinder in a viscous fluid, from its slenderness p,
length over diameter.

    along   2 pi mu L / (ln p + g_t),  g_t = -0.207 + 0.980 / p - 0.133 / p^2
    across  4 pi mu L / (ln p + g_n),  g_n =  0.839 + 0.185 / p + 0.233 / p^2
    about the centre, across the axis
            pi mu L^3 / 3 (ln p + g_w),  g_w = -0.662 + 0.917 / p - 0.050 / p^2

Source: M. M. Tirado, C. Lopez Martinez and J. Garcia de la Torre, J. Chem. Phys. 81,
2047 (1984), for 2 <= p <= 30. As p grows, g_t and g_n tend to the limits -0.20 and 0.84
in the table of M. M. Tirado and J. Garcia de la Torre, J. Chem. Phys. 71, 2581 (1979),
so that longer cylinders are extrapolated. The articles were not read; the constants are
those that public programs quote from them."""

from __future__ import annotations

import numpy as np

# Constants of g along, across and about the centre: of order 1, 1 / p and 1 / p^2.
ALONG = (-0.207, 0.980, -0.133)
ACROSS = (0.839, 0.185, 0.233)
ABOUT = (-0.662, 0.917, -0.050)
SHORTEST = 2.0  # slenderness from which the constants hold
LONGEST_FITTED = 30.0  # slenderness up to which they were fitted


def _logarithm(p, constants):
    """Return ln p + g."""
    first, second, third = constants
    return np.log(p) + first + second / p + third / p**2


def axial_drag(p):
    """Return the drag per length along a cylinder at unit velocity, in units of 8 pi
    mu."""
    return 0.25 / _logarithm(p, ALONG)


def normal_drag(p):
    """Return the drag per length across a cylinder at unit velocity, in units of 8 pi
    mu."""
    return 0.5 / _logarithm(p, ACROSS)


def rotational_drag(p):
    """Return the torque on a cylinder that turns end over end at a unit rate, over the
    cube of its length, in units of 8 pi mu."""
    return 1 / 24 / _logarithm(p, ABOUT)


def drag_ratio(p):
    """Return the drag across a cylinder over the drag along it; 2 in the limit of
    infinite length.

    Examples
    --------
    >>> from rft.formulas.cylinders import drag_ratio
    >>> [round(float(drag_ratio(p)), 3) for p in (5, 25, 1000)]
    [1.277, 1.501, 1.73]
    """
    return normal_drag(p) / axial_drag(p)
