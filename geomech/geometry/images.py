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

SAME = 1e-12  # difference of two directions that are one, and, over the largest of a gait, of two of its shapes or rates
FEW = 1024  # phases, at least, from which `solved_count` tells the symmetries of a gait


class Image(NamedTuple):
    """An image of every shape of a grid. index: (S,), where on the grid, read in C order, the image of every shape is.
    source: (C,), the direction of which a direction there is the image. factor: (C, 3), of the velocity, which is odd
    in the rates."""

    index: np.ndarray
    source: np.ndarray
    factor: np.ndarray

    def velocities(self, xi: np.ndarray) -> np.ndarray:
        """Return the velocities (s, C, 3) at the images of shapes with velocities xi."""
        return self.factor * xi[:, self.source]


def images(axes: Sequence[np.ndarray], unit: np.ndarray, traits: Traits) -> list[Image]:
    """Return the symmetries that a grid and directions (C, d) have, for a body whose left and right
    (``traits.halved``), head and tail (``traits.reversible``) are alike."""
    mirror, reversible = traits.halved, traits.reversible
    index = np.arange(np.prod([len(a) for a in axes])).reshape([len(a) for a in axes])
    backwards = axes[::-1]
    moves = (
        (mirror, [-a[::-1] for a in axes], np.flip(index), -unit, (1.0, -1.0, -1.0)),
        (
            reversible,
            [-a[::-1] for a in backwards],
            np.flip(index).T,
            -unit[:, ::-1],
            (-1.0, -1.0, 1.0),
        ),
        (mirror and reversible, backwards, index.T, unit[:, ::-1], (-1.0, 1.0, -1.0)),
    )
    result = []
    for holds, image_axes, index_of_image, image_unit, signs in moves:
        if holds and all(map(np.array_equal, axes, image_axes)):
            result += [
                Image(index_of_image.ravel(), source, sign * np.array(signs))
                for source, sign in _matched(unit, image_unit)
            ]
    return result


def mirrored(alpha: np.ndarray, count: int) -> list[Image]:
    """Return the image of shapes (S, d) that mirrors them, which must be these shapes in reverse order, for ``count``
    directions; [] if they are not."""
    if not np.array_equal(alpha, -alpha[::-1]):
        return []
    return [
        Image(
            np.arange(len(alpha))[::-1], np.arange(count), np.array([[-1.0, 1.0, 1.0]])
        )
    ]


def _matched(
    unit: np.ndarray, image_unit: np.ndarray
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return [(source, sign (C, 1))] with unit = sign turned[source], or [] if the turned directions are others."""
    products = unit @ image_unit.T
    source = np.abs(products).argmax(1)
    sign = np.sign(np.take_along_axis(products, source[:, None], 1))
    good = np.abs(unit - sign * image_unit[source]).max() < SAME and np.unique(
        source
    ).size == len(source)
    return [(source, sign)] if good else []


def to_solve(symmetries: Sequence[Image], size: int) -> np.ndarray:
    """Return a mask (size,) of the shapes that are no later image of another."""
    first, indices = np.ones(size, bool), np.arange(size)
    for image in symmetries:
        first &= indices <= image.index
    return first


class CycleImages(NamedTuple):
    """Which phases of a cycle of N phases are solved, and how the others follow. count: of phases solved. solved:
    which, none a later image of another. source: (N,), for each phase the index among these of the one that it is an
    image of. factor: (N, 3), of its velocity."""

    count: int
    solved: np.ndarray | slice
    source: np.ndarray | slice
    factor: np.ndarray | float

    def select(self, x: np.ndarray | None) -> np.ndarray | None:
        """Return x (..., n, k) at the phases that are solved, from (..., N, k)."""
        return None if x is None else x[..., self.solved, :]

    def expand(self, xi: np.ndarray) -> np.ndarray:
        """Return velocities (..., N, 3) at all phases from those (..., n, 3) at the phases that are solved."""
        return self.factor * xi[..., self.source, :]


def cycle_images(
    alpha: np.ndarray, alphadot: np.ndarray, traits: Traits
) -> CycleImages:
    """Return the symmetries that cycles (..., N, d) have in common, for a body whose left and right
    (``traits.halved``), head and tail (``traits.reversible``) are alike."""
    phases, joints = alpha.shape[-2:]
    if not (traits.halved or traits.reversible):
        return _cycle_images(phases, False, ())
    sizes = [np.abs(x).max((-2, -1), keepdims=True) for x in (alpha, alphadot)]
    scaled = [
        x / np.where(size > 0, size, 1.0) for x, size in zip((alpha, alphadot), sizes)
    ]
    path = np.concatenate(scaled, -1).reshape(-1, phases, 2 * joints)
    moving = sizes[1].argmax() if len(path) else 0
    return _cycle_images(
        phases,
        *_symmetries(lambda k: path.take(k, 1, mode="wrap"), phases, 1, moving, traits),
    )


def solved_count(gait: Gait, phases: int, traits: Traits) -> int:
    """Return the count of `cycle_images` for a gait of so many phases, where they are many from the symmetries of a
    few."""
    if not (traits.halved or traits.reversible):
        return phases
    a, step = gait.amplitude or 1.0, phases // FEW
    if step < 2:
        return cycle_images(*gait.cycle(phases, a), traits).count
    t = lambda k: 2 * np.pi * (k % phases) / phases
    sizes = [
        np.abs(curve(t(np.arange(0, phases, step)), a)).max() or 1.0
        for curve in (gait.shape, gait.rate)
    ]
    path = lambda k: np.concatenate(
        [gait.shape(t(k), a) / sizes[0], gait.rate(t(k), a) / sizes[1]], -1
    )[None]
    return _orbits(phases, *_symmetries(path, phases, step, 0, traits))


def _symmetries(
    path: Callable, phases: int, step: int, moving: int, traits: Traits
) -> tuple[bool, tuple]:
    """Return (shifted, turned), arguments of `_cycle_images`, of cycles path(k) (B, n, 2 d), shapes and rates at phases
    k (n,), from every ``step``-th of N phases. moving: a cycle that is not at rest."""
    mirror, sampled = traits.halved, np.arange(0, phases, step)
    samples = path(sampled)
    joints = samples.shape[-1] // 2
    same = lambda x, y: not x.size or bool(max((d := x - y).max(), -d.min()) <= SAME)
    nearest = lambda k, x: k[
        np.einsum("kj,kj->k", d := path(k)[moving] - x, d).argmin()
    ]
    shifted = mirror and phases % 2 == 0 and same(path(sampled + phases // 2), -samples)
    # Where the halves are images of each other, one sign follows from the other.
    signs = (-1.0, 1.0) if mirror and not shifted else (-1.0,)
    for sign in signs if traits.reversible and len(samples) else ():
        image = sign * np.concatenate(
            [samples[..., joints - 1 :: -1], -samples[..., : joints - 1 : -1]], -1
        )
        closest = nearest(sampled, image[moving, 0])
        first = (
            int(nearest(closest + np.arange(1 - step, step), image[moving, 0])) % phases
        )
        if same(path(first - sampled), image):
            return shifted, (first, sign)
    return shifted, ()


def _orbits(phases: int, shifted: bool, backwards: tuple) -> int:
    """Return the count of `_cycle_images`, which is the number of orbits: the mean over the symmetries of how many
    phases each leaves unchanged."""
    fixed = [phases] + [0] * shifted
    if backwards:  # which leaves the phases k with 2 k = first (mod N)
        firsts = (backwards[0], backwards[0] + phases // 2)[: 1 + shifted]
        fixed += [1 if phases % 2 else 2 * (first % 2 == 0) for first in firsts]
    return sum(fixed) // len(fixed)


@functools.lru_cache(maxsize=64)
def _cycle_images(phases: int, shifted: bool, backwards: tuple) -> CycleImages:
    """Return the images within a cycle. shifted: it is its own mirror image half a cycle later. turned: () or, where it
    is its own image backwards, head for tail, (phase of the first one's image, sign of its shape: 1 in the mirror
    too)."""
    if not (shifted or backwards):
        return CycleImages(phases, slice(None), slice(None), 1.0)
    phase_indices = np.arange(phases)
    source, factor = phase_indices, np.ones((phases, 3))
    moves = [((phase_indices + phases // 2) % phases, (1.0, -1.0, -1.0))] * shifted
    if backwards:
        first, sign = backwards
        moves.append(((first - phase_indices) % phases, (1.0, -sign, sign)))
    for index, signs in moves:  # each undoes itself; an image may be one of an image
        earlier = source[index] < source
        factor = np.where(earlier[:, None], np.array(signs) * factor[index], factor)
        source = np.where(earlier, source[index], source)
    solved, source = np.unique(source, return_inverse=True)
    return CycleImages(len(solved), solved, source, factor)
