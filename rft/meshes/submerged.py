"""What of a flat triangle is below the surface, in closed form.

With the corners' heights alone: the share of the area, the middle of the part below and the moments of depth, all in
barycentric coordinates. A triangle that crosses the surface has one corner alone on its side; the tip that the surface cuts
off there is a triangle whose edges are the shares s = d / (d - d') of those of the whole, d the depth of that corner and d'
that of the other end. What is not the tip is the whole less the tip.
"""

from __future__ import annotations

import numpy as np

AHEAD, BEHIND = [1, 2, 0], [2, 0, 1]


def submerged(heights: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(share (...,), middle (3, ...), moments (3, ...), m) of triangles whose corners are at ``heights`` (3, ...), m: of the
    area that is below; its middle is sum_i middle_i x_i; the integral over it of depth times x is area times
    sum_i moments_i x_i, so the integral of depth is area times the sum of the moments."""
    depth = -np.asarray(heights, float)
    under = depth > 0.0
    most = under.sum(0) > 1
    alone = (under != under[AHEAD]) & (under != under[BEHIND])  # at most one of three
    s, t = (np.where(alone, depth, 0.0) / np.where(alone, depth - depth[k], 1.0) for k in (AHEAD, BEHIND))
    tip = np.where(under, 1.0, -1.0) * s * t
    middle, d = tip * (3 - s - t) + (tip * s)[BEHIND] + (tip * t)[AHEAD] + most, tip * depth
    moment = d * (4 - s - t) + (d * s)[BEHIND] + (d * t)[AHEAD] + most * (depth + depth.sum(0))
    share = tip.sum(0) + most
    return share, middle / (3 * np.where(share > 0.0, share, 1.0)), moment / 12
