"""The group of planar rigid motions. Poses g = (x, y, theta) and velocities xi = (xi_x, xi_y, xi_theta) are
arrays (..., 3); theta is not wrapped. Every formula is free of thresholds: quotients that vanish together are
written with sinc or the half angle."""

from __future__ import annotations

import numpy as np


def _sinc(x: np.ndarray) -> np.ndarray:
    """sin x / x, 1 at 0, to the last digit or two (np.sinc rounds pi x first)."""
    safe = np.where(x == 0.0, 1.0, x)
    return np.where(x == 0.0, 1.0, np.sin(safe) / safe)


def _split(g):
    try:
        g = np.asarray(g, float)
    except (TypeError, ValueError, OverflowError):
        raise ValueError("a pose or velocity of the plane has three real numbers (..., 3)") from None
    if g.ndim == 0 or g.shape[-1] != 3:
        raise ValueError(f"a pose or velocity of the plane has shape (..., 3), got {g.shape}")
    return g[..., 0], g[..., 1], g[..., 2]


def rotated(theta, x, y) -> tuple[np.ndarray, np.ndarray]:
    """The vector (x, y) turned counter-clockwise by theta (rad)."""
    c, s = np.cos(theta), np.sin(theta)
    return c * x - s * y, s * x + c * y


def exp(xi) -> np.ndarray:
    """Pose reached from the identity after unit time at body velocity xi (..., 3)."""
    x, y, turn = _split(xi)
    along, across = _sinc(turn), np.sin(turn / 2) * _sinc(turn / 2)
    return np.stack([along * x - across * y, across * x + along * y, turn], -1)


def log(g) -> np.ndarray:
    """Body velocity that reaches the pose g (..., 3) in unit time, turning the short way: |xi_theta| <= pi."""
    x, y, theta = _split(g)
    turn = theta - 2 * np.pi * np.round(theta / (2 * np.pi))
    along, across = np.cos(turn / 2) / _sinc(turn / 2), turn / 2
    return np.stack([along * x + across * y, along * y - across * x, turn], -1)


def compose(g, h) -> np.ndarray:
    """g h: the pose h of a frame, seen from where the frame is itself at g. Angles add."""
    (gx, gy, gt), (hx, hy, ht) = _split(g), _split(h)
    x, y = rotated(gt, hx, hy)
    return np.stack([gx + x, gy + y, gt + ht], -1)


def inverse(g) -> np.ndarray:
    """The pose with compose(g, inverse(g)) = (0, 0, 0)."""
    x, y, theta = _split(g)
    x, y = rotated(-theta, x, y)
    return np.stack([-x, -y, -theta], -1)


def adjoint(g) -> np.ndarray:
    """Ad_g (..., 3, 3): maps the body velocity at pose g to the spatial one, xi_spatial = Ad_g xi_body."""
    x, y, theta = _split(g)
    c, s = np.cos(theta), np.sin(theta)
    zero, one = np.zeros_like(c), np.ones_like(c)
    rows = [c, -s, y], [s, c, -x], [zero, zero, one]
    return np.stack([np.stack(row, -1) for row in rows], -2)


def bracket(X, Y) -> np.ndarray:
    """[X, Y] = XY - YX on se(2), (..., 3)."""
    (xx, xy, xt), (yx, yy, yt) = _split(X), _split(Y)
    return np.stack([yt * xy - xt * yy, xt * yx - yt * xx, np.zeros_like(xt * yt)], -1)
