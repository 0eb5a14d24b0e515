"""Shapes of a grid, and phases of a gait, whose velocities follow from those of others: where left and right, or head and
tail, of a body are alike.

Seen in a mirror a body has the shape -alpha and moves with (xi_x, -xi_y, -xi_theta). With its head taken for its tail it has
the shape -alpha backwards, alpha_k -> -alpha_(d + 1 - k), and moves with (-xi_x, -xi_y, xi_theta). Rates change as shapes do,
and velocities turn round with rates. So a gait whose second half is its first seen in a mirror takes half of the balances, and
one that, head for tail, is itself run backwards, as a circle or a travelling wave is, half of these.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from geomech.geometry.gait import Gait
from geomech.geometry.traits import Traits

SAME = (
    1e-12  # difference of two directions that are one, and, over the largest of a gait, of two of its shapes or rates
)
FEW = 1024  # phases, at least, from which `solved_count` tells the symmetries of a gait


class Image(NamedTuple):
    """index: (S,), where on the grid, read in C order, the image of every shape is. source: (C,), the direction there is the
    image of this one. factor: (C, 3), of its velocity, which is odd in the rates."""

    index: np.ndarray
    source: np.ndarray
    factor: np.ndarray

    def of(self, xi: np.ndarray) -> np.ndarray:
        """Return velocities (s, C, 3) at the images of shapes with velocities xi."""
        return self.factor * xi[:, self.source]


def images(axes: Sequence[np.ndarray], unit: np.ndarray, traits: Traits) -> list[Image]:
    """Those that a grid and directions (C, d) have with themselves, of a body whose left and right (``traits.halved``), head
    and tail (``traits.reversible``) are alike."""
    mirror, reversible = traits.halved, traits.reversible
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
    """Return [(source, sign (C, 1))] with unit = sign turned[source], or [] if the turned directions are others."""
    products = unit @ turned.T
    source = np.abs(products).argmax(1)
    sign = np.sign(np.take_along_axis(products, source[:, None], 1))
    good = np.abs(unit - sign * turned[source]).max() < SAME and np.unique(source).size == len(source)
    return [(source, sign)] if good else []


def to_solve(found: Sequence[Image], size: int) -> np.ndarray:
    """Return mask (size,) of the shapes that are no later image of another."""
    first, own = np.ones(size, bool), np.arange(size)
    for image in found:
        first &= own <= image.index
    return first


class Around(NamedTuple):
    """What of a cycle of N phases is solved. count: of phases. solved: which, none a later image of another. source: (N,), the
    place among these of the one that each phase is an image of. factor: (N, 3), of its velocity."""

    count: int
    solved: np.ndarray | slice
    source: np.ndarray | slice
    factor: np.ndarray | float

    def some(self, x: np.ndarray | None) -> np.ndarray | None:
        """Return (..., n, k), of the phases that are solved, from (..., N, k)."""
        return None if x is None else x[..., self.solved, :]

    def whole(self, xi: np.ndarray) -> np.ndarray:
        """Return velocities (..., N, 3) at all phases from those (..., n, 3) at the phases that are solved."""
        return self.factor * xi[..., self.source, :]


def around(alpha: np.ndarray, alphadot: np.ndarray, traits: Traits) -> Around:
    """Of cycles (..., N, d) together, as far as all are images of themselves in one way, of a body whose left and right
    (``traits.halved``), head and tail (``traits.reversible``) are alike."""
    phases, joints = alpha.shape[-2:]
    if not (traits.halved or traits.reversible):
        return _around(phases, False, ())
    sizes = [np.abs(x).max((-2, -1), keepdims=True) for x in (alpha, alphadot)]
    scaled = [x / np.where(size > 0, size, 1.0) for x, size in zip((alpha, alphadot), sizes)]
    path = np.concatenate(scaled, -1).reshape(-1, phases, 2 * joints)
    moving = sizes[1].argmax() if len(path) else 0
    return _around(phases, *_symmetries(lambda k: path[:, k % phases], phases, 1, moving, traits))


def solved_count(gait: Gait, phases: int, traits: Traits) -> int:
    """Return the count of `around` for a gait of so many phases, where they are many from the symmetries of a few."""
    if not (traits.halved or traits.reversible):
        return phases
    a, step = gait.amplitude or 1.0, phases // FEW
    if step < 2:
        return around(*gait.cycle(phases, a), traits).count
    t = lambda k: 2 * np.pi * (k % phases) / phases
    sizes = [np.abs(curve(t(np.arange(0, phases, step)), a)).max() or 1.0 for curve in (gait.shape, gait.rate)]
    path = lambda k: np.concatenate([gait.shape(t(k), a) / sizes[0], gait.rate(t(k), a) / sizes[1]], -1)[None]
    return _orbits(phases, *_symmetries(path, phases, step, 0, traits))


def _symmetries(path: Callable, phases: int, step: int, moving: int, traits: Traits) -> tuple[bool, tuple]:
    """Return (shifted, turned), as `_around` has them, of cycles path(k) (B, n, 2 d), shapes and rates at phases k (n,), from
    every ``step``-th of N phases. moving: a cycle that is not at rest."""
    mirror, some = traits.halved, np.arange(0, phases, step)
    here = path(some)
    joints = here.shape[-1] // 2
    same = lambda x, y: bool(np.abs(x - y).max(initial=0.0) <= SAME)
    nearest = lambda k, x: k[np.abs(path(k)[moving] - x).max(-1).argmin()]
    shifted = mirror and phases % 2 == 0 and same(path(some + phases // 2), -here)
    ways = (-1.0, 1.0) if mirror and not shifted else (-1.0,)  # where the halves are images each follows from the other
    for sign in ways if traits.reversible and len(here) else ():
        seen = sign * np.concatenate([here[..., joints - 1 :: -1], -here[..., : joints - 1 : -1]], -1)
        near = nearest(some, seen[moving, 0])
        first = int(nearest(near + np.arange(1 - step, step), seen[moving, 0])) % phases
        if same(path(first - some), seen):
            return shifted, (first, sign)
    return shifted, ()


def _orbits(phases: int, shifted: bool, turned: tuple) -> int:
    """Return the count of `_around`, the number of orbits: the mean over the symmetries of how many phases each leaves."""
    fixed = [phases] + [0] * shifted
    if turned:  # which leaves the phases k with 2 k = first (mod N)
        firsts = (turned[0], turned[0] + phases // 2)[: 1 + shifted]
        fixed += [1 if phases % 2 else 2 * (first % 2 == 0) for first in firsts]
    return sum(fixed) // len(fixed)


@functools.lru_cache(maxsize=64)
def _around(phases: int, shifted: bool, turned: tuple) -> Around:
    """Of a cycle that is an image of itself half a cycle later in the mirror (shifted), and backwards, head for tail, by
    (phase of the first one's image, sign of its shape: 1 in the mirror too), if that is not empty."""
    if not (shifted or turned):
        return Around(phases, slice(None), slice(None), 1.0)
    own = np.arange(phases)
    source, factor = own, np.ones((phases, 3))
    moves = [((own + phases // 2) % phases, (1.0, -1.0, -1.0))] * shifted
    if turned:
        first, sign = turned
        moves.append(((first - own) % phases, (1.0, -sign, sign)))
    for index, signs in moves:  # each undoes itself; an image may be one of an image
        earlier = source[index] < source
        factor = np.where(earlier[:, None], np.array(signs) * factor[index], factor)
        source = np.where(earlier, source[index], source)
    solved, source = np.unique(source, return_inverse=True)
    return Around(len(solved), solved, source, factor)
