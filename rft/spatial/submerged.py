"""What of a flat triangle is below the surface, in closed form.

With the corners' heights alone: the share of the area, the middle of the part below and the moments of depth, all in
barycentric coordinates. A triangle that crosses the surface has one corner alone on its side; the tip that the surface cuts
off there is a triangle whose edges are the shares s = d / (d - d') of those of the whole, d the depth of that corner and d'
that of the other end. What is not the tip is the whole less the tip.
"""

from __future__ import annotations

import numpy as np


def submerged(heights: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(share (...,), middle (3, ...), moments (3, ...), m) of triangles whose corners are at ``heights`` (3, ...), m: of the
    area that is below; its middle is sum_i middle_i x_i; the integral over it of depth times x is area times
    sum_i moments_i x_i, so the integral of depth is area times the sum of the moments."""
    depth = -np.asarray(heights, float)
    under = depth > 0.0
    count = under.sum(0)
    alone = np.argmax(under == (count == 1), 0)
    order = [alone, (alone + 1) % 3, (alone + 2) % 3]
    d, e, f = (np.take_along_axis(depth, k[None], 0)[0] for k in order)
    cut = (count == 1) | (count == 2)
    s, t = (d / np.where(cut, d - x, 1.0) * cut for x in (e, f))
    tip = s * t
    middles = [tip * x / 3 for x in (3 - s - t, s, t)]
    moments = [tip * d * x / 12 for x in (4 - s - t, s, t)]
    sign, most = np.where(count == 1, 1.0, -1.0), count > 1
    middle, moment = np.empty_like(depth), np.empty_like(depth)
    for k, x, y in zip(order, middles, moments):
        np.put_along_axis(middle, k[None], (sign * x)[None], 0)
        np.put_along_axis(moment, k[None], (sign * y)[None], 0)
    share = sign * tip + most
    middle += most / 3
    moment += most * (depth + depth.sum(0)) / 12
    return share, middle / np.where(share > 0.0, share, 1.0), moment
