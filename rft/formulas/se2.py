"""The group SE(2) of planar rigid motions.

Poses g = (x, y, theta) and velocities xi = (xi_x, xi_y, xi_theta) are arrays (..., 3);
theta is not wrapped. No formula has a threshold: quotients 0/0 are avoided by sinc and
half angles."""

from __future__ import annotations

import numpy as np

from rft.core.checks import refuse_mask
from rft.core.refusal import Refusal


def _sinc(x: np.ndarray) -> np.ndarray:
    """Return sin x / x, 1 at 0, to the last digit or two (np.sinc rounds pi x
    first)."""
    nonzero = np.where(x == 0.0, 1.0, x)
    return np.where(x == 0.0, 1.0, np.sin(nonzero) / nonzero)


def _components(g):
    """Return the three components of poses or velocities (..., 3); ValueError for
    another shape."""
    refuse_mask("a pose or velocity of the plane", g)
    try:
        g = np.asarray(g, float)
    except (TypeError, ValueError, OverflowError):
        raise Refusal(
            "a pose or velocity of the plane has three real numbers (..., 3)"
        ) from None
    if g.ndim == 0 or g.shape[-1] != 3:
        raise Refusal(
            "a pose or velocity of the plane has shape (..., 3)", value=g.shape
        )
    return g[..., 0], g[..., 1], g[..., 2]


def rotated(theta, x, y) -> tuple[np.ndarray, np.ndarray]:
    """Return the vector (x, y) rotated counter-clockwise by theta (rad)."""
    c, s = np.cos(theta), np.sin(theta)
    return c * x - s * y, s * x + c * y


def exp(xi) -> np.ndarray:
    """Return the pose reached from the identity after unit time at body velocity xi
    (..., 3)."""
    x, y, angle = _components(xi)
    along, across = _sinc(angle), np.sin(angle / 2) * _sinc(angle / 2)
    return np.stack([along * x - across * y, across * x + along * y, angle], -1)


def log(g) -> np.ndarray:
    """Return the body velocity that reaches the pose g (..., 3) in unit time, with
    |xi_theta| <= pi."""
    x, y, theta = _components(g)
    angle = theta - 2 * np.pi * np.round(theta / (2 * np.pi))
    along, across = np.cos(angle / 2) / _sinc(angle / 2), angle / 2
    return np.stack([along * x + across * y, along * y - across * x, angle], -1)


def compose(g, h) -> np.ndarray:
    """Return g h, the pose in the world of a frame whose pose in the frame at g is
    h."""
    (gx, gy, gt), (hx, hy, ht) = _components(g), _components(h)
    x, y = rotated(gt, hx, hy)
    return np.stack([gx + x, gy + y, gt + ht], -1)


def inverse(g) -> np.ndarray:
    """Return the pose with compose(g, inverse(g)) = (0, 0, 0)."""
    x, y, theta = _components(g)
    x, y = rotated(-theta, x, y)
    return np.stack([-x, -y, -theta], -1)


def adjoint(g) -> np.ndarray:
    """Return Ad_g (..., 3, 3), the matrix in xi_spatial = Ad_g xi_body at a pose g."""
    x, y, theta = _components(g)
    c, s = np.cos(theta), np.sin(theta)
    zero, one = np.zeros_like(c), np.ones_like(c)
    rows = [c, -s, y], [s, c, -x], [zero, zero, one]
    return np.stack([np.stack(row, -1) for row in rows], -2)


def bracket(X, Y) -> np.ndarray:
    """Return [X, Y] = XY - YX on se(2), (..., 3)."""
    (xx, xy, xt), (yx, yy, yt) = _components(X), _components(Y)
    return np.stack([yt * xy - xt * yy, xt * yx - yt * xx, np.zeros_like(xt * yt)], -1)
