"""Whether a table from elsewhere has its sign, axes or angles otherwise than they are read: by the swimmer in a fluid that a
body of links is, whose A that of any medium with more drag across than along resembles."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from geomech.geometry.connection import Connection
from geomech.systems.swimmer import Swimmer
from rft.bodies import Chain
from rft.laws import Viscous

POINTS, LARGEST, SMALLEST = (
    5,
    1.5,
    0.2,
)  # an axis; rad, of the shapes that are compared, and the least that tells anything
LIKE, BETTER = (
    0.85,
    0.4,
)  # correlation of another reading, and how much above that of the file as it is
READINGS = {
    (1, 0, 0): "of the other sign", (0, 1, 0): "with alpha1 and alpha2 swapped", (0, 0, 1): "with both axes mirrored",
    (1, 0, 1): "with angles, or y and heading, positive clockwise",
}  # fmt: skip


def misread(table: Connection, bodies: Sequence[Chain]) -> str:
    """Return how a table of two joints would be one of a body, or of some, much better than it is, in a line; "" if it would
    not."""
    half = min(LARGEST, 0.9 * min(min(-a[0], a[-1]) for a in table.axes))
    if len(table.axes) != 2 or half < SMALLEST:
        return ""
    axis = np.linspace(-half, half, POINTS)
    alpha = np.stack(np.meshgrid(axis, axis, indexing="ij"), -1)
    A = np.moveaxis(table(alpha), (-2, -1), (0, 1))
    models = [_model(body, alpha) for body in bodies]
    scores = {
        r: max(_likeness(_read(A, *r), model) for model in models)
        for r in product((0, 1), repeat=3)
    }
    best = max(scores, key=scores.get)
    if scores[best] < LIKE or scores[best] < scores[0, 0, 0] + BETTER:
        return ""
    words = READINGS.get(best) or " and ".join(
        READINGS[one] for one in READINGS if sum(one) == 1 and np.dot(one, best)
    )
    numbers = f"{scores[best]:.2f}, as it stands {scores[0, 0, 0]:.2f}"
    return f"its A is that of a body of links {words} (correlation {numbers}): check sign, axes and angles"


def _model(body: Chain, alpha: np.ndarray) -> np.ndarray:
    """Return A (3, 2, N, N) of a body in a fluid."""
    swimmer = Swimmer(Viscous(2.0), body)
    return np.stack(
        [np.moveaxis(swimmer.velocity(alpha, unit), -1, 0) for unit in np.eye(2)], 1
    )


def _read(A: np.ndarray, sign: int, swapped: int, mirrored: int) -> np.ndarray:
    """Return A (3, 2, N, N) of a symmetric grid as another reading has it."""
    A = -A if sign else A
    A = A[:, ::-1].swapaxes(-1, -2) if swapped else A
    return A[:, :, ::-1, ::-1] if mirrored else A


def _likeness(A: np.ndarray, model: np.ndarray) -> float:
    """Return the mean of the correlations of x, y and theta."""
    size = np.sqrt((A**2).sum((1, 2, 3)) * (model**2).sum((1, 2, 3)))
    return float(((A * model).sum((1, 2, 3)) / np.where(size > 0, size, 1.0)).mean())
