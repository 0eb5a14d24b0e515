"""The part of a flat triangle below the surface, in closed form.

The corners' heights give the share of the area, the middle of the part below and the moments of depth, all in barycentric
coordinates. A triangle that crosses the surface has one corner alone on its side. The surface cuts off a tip there, a
triangle with edges s = d / (d - d') times those of the full triangle, where d is the depth of the lone corner and d' that of
the edge's other end. The rest is the full triangle less the tip.
"""

from __future__ import annotations

import numpy as np

NEXT, LAST = [1, 2, 0], [2, 0, 1]  # corners that follow and precede each corner


def submerged(heights: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return share (...,), middle (3, ...) and moments (3, ...), m, of triangles with corners at ``heights`` (3, ...), m.

    share: of the area below the surface. The middle of the part below is sum_i middle_i x_i, with x_i the corners. The
    integral over it of depth times x is area times sum_i moments_i x_i, so that of depth is area times sum_i moments_i."""
    depth = -np.asarray(heights, float)
    under = depth > 0.0
    mostly_under = under.sum(0) > 1
    alone = (under != under[NEXT]) & (under != under[LAST])  # at most one of three
    s, t = (np.where(alone, depth, 0.0) / np.where(alone, depth - depth[k], 1.0) for k in (NEXT, LAST))
    tip = np.where(under, 1.0, -1.0) * s * t
    middle, d = tip * (3 - s - t) + (tip * s)[LAST] + (tip * t)[NEXT] + mostly_under, tip * depth
    moment = d * (4 - s - t) + (d * s)[LAST] + (d * t)[NEXT] + mostly_under * (depth + depth.sum(0))
    share = tip.sum(0) + mostly_under
    return share, middle / (3 * np.where(share > 0.0, share, 1.0)), moment / 12
