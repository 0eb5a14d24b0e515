"""The same balance of forces without this package: loops of SciPy's fsolve and
least_squares over midpoints. They solve for the three-link swimmer in dry grains (Eqs.
2-3) in the frame of the middle link, as does the plain loop with exact integrals
(`figures.plain_loop`)."""

from __future__ import annotations

import numpy as np
from scipy.optimize import fsolve, least_squares

C = 1.8
GAMMA0 = np.radians(13.8)
TAN2 = np.tan(GAMMA0) ** 2
HALF = 1 / 6  # length of half a link, body lengths
START = (0.02, 0.01, 0.1)  # is not zero, where a link may stand still


def one_scipy_solve(alpha, alphadot, elements=20):
    """Return one balance solved in the plainest way: midpoint elements in the middle
    link's frame, Eqs. 2-3 as printed, fsolve."""
    return fsolve(
        force_on_midpoints(alpha, alphadot, elements), START, full_output=True
    )


def one_least_squares(alpha, alphadot, elements=20):
    """Return the same balance by least_squares, as it is without options."""
    return least_squares(force_on_midpoints(alpha, alphadot, elements), START)


def force_on_midpoints(alpha, alphadot, elements):
    """Return the function of a velocity (3,) that gives force and moment."""
    s = ((np.arange(elements) + 0.5) / elements * 2 - 1) * HALF
    headings = np.array([-alpha[0], 0.0, alpha[1]])
    turns = np.array([-alphadot[0], 0.0, alphadot[1]])
    t = np.stack([np.cos(headings), np.sin(headings)], -1)[:, None]
    n = np.stack([-t[..., 1], t[..., 0]], -1)
    joints = np.array([[-HALF, 0.0], [0.0, 0.0], [HALF, 0.0]])[:, None]
    arms = (s + np.array([-HALF, 0.0, HALF])[:, None])[..., None] * t
    place = joints + arms

    def force(xi):
        spin = xi[2] * np.stack([-place[..., 1], place[..., 0]], -1)
        swing = turns[:, None, None] * np.stack([-arms[..., 1], arms[..., 0]], -1)
        v = xi[:2] + spin + swing
        v = v / (np.sqrt((v**2).sum(-1, keepdims=True)) + 1e-12)
        vn = (v * n).sum(-1, keepdims=True)
        vt = (v * t).sum(-1, keepdims=True)
        f = (1 + C / np.sqrt(TAN2 + vn**2)) * vn * n + vt * t
        moment = place[..., 0] * f[..., 1] - place[..., 1] * f[..., 0]
        return [f[..., 0].sum(), f[..., 1].sum(), moment.sum()]

    return force


def by_fsolve(alpha: np.ndarray, alphadot: np.ndarray) -> np.ndarray:
    """Return the velocities (N, 3) of shapes and rates (N, 2), one after the other."""
    found = [one_scipy_solve(*sample)[0] for sample in zip(alpha, alphadot)]
    return np.array(found)
