"""The part of a flat triangle below the surface, in closed form.

The corners' heights give the share of the area, the middle of the part below and the
moments of depth, all in barycentric coordinates. A triangle that crosses the surface
has one corner alone on its side of it, and the surface cuts off a tip there. The edges
of the tip are s = d / (d - d') times those of the full triangle, where d is the depth
of the lone corner and d' the depth of the edge's other end. The rest is the full
triangle less the tip.
"""

from __future__ import annotations

import numpy as np

from rft.core.checks import unmasked
from rft.formulas.vectors import formula, where


@formula
def _tip(depth, following, preceding):
    """Return (s t, s, t) of the tip at a corner that is alone on its side of the
    surface, and 0 at other corners; s t, the share of the area, is negative where the
    tip is above.

    depth, following, preceding: depths of the corner and of the next ones, m."""
    under = depth > 0.0
    below = under & (following <= 0.0) & (preceding <= 0.0)
    lone = below | ((depth <= 0.0) & (following > 0.0) & (preceding > 0.0))
    d = where(lone, depth, 0.0)
    s = d / where(lone, depth - following, 1.0)
    t = d / where(lone, depth - preceding, 1.0)
    return where(under, 1.0, -1.0) * s * t, s, t


@formula
def part_of_triangle(d1, d2, d3):
    """Return share, middle and moments, as `submerged_part` does, of a triangle with
    corners at depths d1, d2, d3, m."""
    tip1, s1, t1 = _tip(d1, d2, d3)
    tip2, s2, t2 = _tip(d2, d3, d1)
    tip3, s3, t3 = _tip(d3, d1, d2)
    count = (
        where(d1 > 0.0, 1.0, 0.0)
        + where(d2 > 0.0, 1.0, 0.0)
        + where(d3 > 0.0, 1.0, 0.0)
    )
    mostly_under = where(count > 1.0, 1.0, 0.0)
    share = tip1 + tip2 + tip3 + mostly_under
    third = 1.0 / (3.0 * where(share > 0.0, share, 1.0))
    middle = (
        third * (tip1 * (3.0 - s1 - t1) + tip3 * s3 + tip2 * t2 + mostly_under),
        third * (tip2 * (3.0 - s2 - t2) + tip1 * s1 + tip3 * t3 + mostly_under),
        third * (tip3 * (3.0 - s3 - t3) + tip2 * s2 + tip1 * t1 + mostly_under),
    )

    m1 = tip1 * d1
    m2 = tip2 * d2
    m3 = tip3 * d3
    total = d1 + d2 + d3
    moments = (
        (m1 * (4.0 - s1 - t1) + m3 * s3 + m2 * t2 + mostly_under * (d1 + total)) / 12.0,
        (m2 * (4.0 - s2 - t2) + m1 * s1 + m3 * t3 + mostly_under * (d2 + total)) / 12.0,
        (m3 * (4.0 - s3 - t3) + m2 * s2 + m1 * t1 + mostly_under * (d3 + total)) / 12.0,
    )
    return share, middle, moments


def submerged_part(heights: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return share (...,), middle (3, ...) and moments (3, ...), m, of triangles with
    corners at ``heights`` (3, ...), m.

    share: of the area below the surface. With x_i the corners, the middle of the part
    below is sum_i middle_i x_i. The integral over it of depth times x is area times
    sum_i moments_i x_i, and the integral of depth is area times sum_i moments_i."""
    share, middle, moments = part_of_triangle(*-unmasked("heights", heights))
    return share, np.stack(middle), np.stack(moments)
