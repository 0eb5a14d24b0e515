"""A test of whether a table from another program has another sign, axes or angles than
it is read with.

It is compared with the swimmer of links in a fluid, whose A resembles the A of any
medium with more drag across than along."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from geomech.mathematics.geometry.connection import Connection
from geomech.mathematics.systems.swimmer import Swimmer
from rft.bodies import Chain
from rft.laws import Viscous

POINTS = 5  # of an axis, that are compared
LARGEST_EXTENT = 1.5  # rad, of the shapes that are compared
SMALLEST_EXTENT = 0.2  # rad; smaller fields say nothing
LEAST_CORRELATION = 0.85  # of another reading
LEAST_GAIN = 0.4  # of its correlation over the file's as it is read
# By (other sign, swapped axes, mirrored axes).
READINGS = {
    (1, 0, 0): "with the opposite sign",
    (0, 1, 0): "with alpha1 and alpha2 swapped",
    (0, 0, 1): "with both axes reversed",
    (1, 0, 1): "with angles, or y and heading, positive clockwise",
}
AS_READ = (0, 0, 0)


def misread(table: Connection, bodies: Sequence[Chain]) -> str:
    """Return in a line how a table of two joints resembles one of the bodies much
    better when it is read otherwise; "" if it does not."""
    half = min(LARGEST_EXTENT, 0.9 * min(min(-a[0], a[-1]) for a in table.axes))
    if len(table.axes) != 2 or half < SMALLEST_EXTENT:
        return ""
    axis = np.linspace(-half, half, POINTS)
    alpha = np.stack(np.meshgrid(axis, axis, indexing="ij"), -1)
    A = np.moveaxis(table(alpha), (-2, -1), (0, 1))
    models = [_model(body, alpha) for body in bodies]

    scores = {}
    for reading in product((0, 1), repeat=3):
        read = _read(A, *reading)
        scores[reading] = max(_correlation(read, model) for model in models)
    best = max(scores, key=scores.get)
    score = scores[best]
    score_as_read = scores[AS_READ]
    if score < LEAST_CORRELATION or score < score_as_read + LEAST_GAIN:
        return ""
    return (
        f"its A resembles that of a body of links {_words(best)} (correlation "
        f"{score:.2f}; as read {score_as_read:.2f}): check sign, axes and angles"
    )


def _words(reading: tuple[int, ...]) -> str:
    """Return a reading in words: its own, or those of its changes."""
    if reading in READINGS:
        return READINGS[reading]
    changes = []
    for single, words in READINGS.items():
        if sum(single) == 1 and np.dot(single, reading):
            changes.append(words)
    return " and ".join(changes)


def _model(body: Chain, alpha: np.ndarray) -> np.ndarray:
    """Return A (3, 2, N, N) of a body in a fluid."""
    swimmer = Swimmer(Viscous(2.0), body)
    columns = [swimmer.velocity(alpha, unit) for unit in np.eye(2)]
    return np.moveaxis(np.stack(columns, -1), (-2, -1), (0, 1))


def _read(A: np.ndarray, sign: int, swapped: int, mirrored: int) -> np.ndarray:
    """Return A (3, 2, N, N) of a symmetric grid in another reading."""
    if sign:
        A = -A
    if swapped:
        A = A[:, ::-1].swapaxes(-1, -2)
    if mirrored:
        A = A[:, :, ::-1, ::-1]
    return A


def _correlation(A: np.ndarray, model: np.ndarray) -> float:
    """Return the mean of the correlations of x, y and theta."""
    size = np.sqrt((A**2).sum((1, 2, 3)) * (model**2).sum((1, 2, 3)))
    return float(((A * model).sum((1, 2, 3)) / np.where(size > 0, size, 1.0)).mean())
