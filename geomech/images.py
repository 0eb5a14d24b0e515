"""Shapes of a grid whose velocities follow from those of others: where left and right, or head and tail, of a body are alike.

Seen in a mirror a body has the shape -alpha and moves with (xi_x, -xi_y, -xi_theta). With its head taken for its tail it has
the shape -alpha backwards, alpha_k -> -alpha_(d + 1 - k), and moves with (-xi_x, -xi_y, xi_theta). Rates change as shapes do,
and velocities turn round with rates.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

SAME = 1e-12  # difference of two directions that are one


class Image(NamedTuple):
    """index: (S,), where on the grid, read in C order, the image of every shape is. source: (C,), the direction there is the
    image of this one. factor: (C, 3), of its velocity, which is odd in the rates."""

    index: np.ndarray
    source: np.ndarray
    factor: np.ndarray

    def of(self, xi: np.ndarray) -> np.ndarray:
        """Velocities (s, C, 3) at the images of shapes with velocities xi."""
        return self.factor * xi[:, self.source]


def images(axes: Sequence[np.ndarray], unit: np.ndarray, mirror: bool, reversible: bool) -> list[Image]:
    """Those that a grid and directions (C, d) have with themselves, of a body whose left and right (mirror), head and tail
    (reversible) are alike."""
    index = np.arange(np.prod([len(a) for a in axes])).reshape([len(a) for a in axes])
    backwards = axes[::-1]
    moves = (
        (mirror, [-a[::-1] for a in axes], np.flip(index), -unit, (1.0, -1.0, -1.0)),
        (reversible, [-a[::-1] for a in backwards], np.flip(index).T, -unit[:, ::-1], (-1.0, -1.0, 1.0)),
        (mirror and reversible, backwards, index.T, unit[:, ::-1], (-1.0, 1.0, -1.0)),
    )
    found = []
    for alike, seen, where, turned, signs in moves:
        if alike and all(map(np.array_equal, axes, seen)):
            found += [Image(where.ravel(), source, sign * np.array(signs)) for source, sign in _matched(unit, turned)]
    return found


def mirrored(alpha: np.ndarray, count: int) -> list[Image]:
    """That of shapes (S, d) which read backwards are those of the other side, for so many directions; [] if they are not."""
    if not np.array_equal(alpha, -alpha[::-1]):
        return []
    return [Image(np.arange(len(alpha))[::-1], np.arange(count), np.array([[-1.0, 1.0, 1.0]]))]


def _matched(unit: np.ndarray, turned: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """[(source, sign (C, 1))] with unit = sign turned[source], or [] if the turned directions are others."""
    products = unit @ turned.T
    source = np.abs(products).argmax(1)
    sign = np.sign(np.take_along_axis(products, source[:, None], 1))
    good = np.abs(unit - sign * turned[source]).max() < SAME and np.unique(source).size == len(source)
    return [(source, sign)] if good else []


def to_solve(found: Sequence[Image], size: int) -> np.ndarray:
    """Mask (size,) of the shapes that are no later image of another."""
    first, own = np.ones(size, bool), np.arange(size)
    for image in found:
        first &= own <= image.index
    return first
