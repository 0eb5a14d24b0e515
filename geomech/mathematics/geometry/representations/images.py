"""Shapes of a grid, and phases of a gait, whose velocities follow from others by
symmetry.

A body has such images where its left and right, or its head and tail, are alike. Seen
in a mirror it has the shape -alpha and moves with (xi_x, -xi_y, -xi_theta). With its
head taken for its tail it has the shape -alpha backwards, alpha_k -> -alpha_(d + 1 -
k), and moves with (-xi_x, -xi_y, xi_theta). Rates change as shapes do, and velocities
change sign with rates. So a gait whose second half is its first seen in a mirror takes
half of the balances. A gait that with head and tail exchanged is itself run backwards,
as a circle or a travelling wave is, takes half of these."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from geomech.mathematics.geometry.gait import Gait
from geomech.mathematics.geometry.periods import periodic_axes
from geomech.mathematics.geometry.traits import Traits

# Largest difference of two equal directions and, relative to the largest of a gait, of
# two equal shapes or rates.
SAME = 1e-12
SAMPLED_PHASES = 1024  # at least, for the symmetries of a gait in `solved_count`
MIRROR = (1.0, -1.0, -1.0)  # signs of the velocity seen in a mirror


class Image(NamedTuple):
    """An image of every shape of a grid.

    index: (S,), where on the grid, read in C order, the image of every shape is.
    source: (C,), the direction of which a direction there is the image. factor: (C, 3),
    of the velocity, which is odd in the rates."""

    index: np.ndarray
    source: np.ndarray
    factor: np.ndarray

    def velocities(self, xi: np.ndarray) -> np.ndarray:
        """Return the velocities (s, C, 3) at the images of shapes with velocities
        xi."""
        return self.factor * xi[:, self.source]


def images(axes: Sequence[np.ndarray], unit: np.ndarray, traits: Traits) -> list[Image]:
    """Return the symmetries that a grid and directions (C, d) have, for a body whose
    left and right (``traits.halved``), head and tail (``traits.reversible``) are
    alike. Both ends of an axis with a period (``traits.periods``) are images of each
    other, and an image of the axis may lie whole periods away."""
    counts = [len(a) for a in axes]
    index = np.arange(np.prod(counts)).reshape(counts)
    periods = traits.periods or (None,) * len(axes)
    backwards = axes[::-1]
    periods_backwards = periods[::-1]

    # Axes and periods, indices and directions of the image, and the signs of its
    # velocity.
    moves = []
    if traits.halved:
        mirrored_axes = [-a[::-1] for a in axes]
        moves.append((mirrored_axes, periods, np.flip(index), -unit, MIRROR))
    if traits.reversible:
        reversed_axes = [-a[::-1] for a in backwards]
        reversed_unit = -unit[:, ::-1]
        signs = (-1.0, -1.0, 1.0)
        moves.append(
            (reversed_axes, periods_backwards, np.flip(index).T, reversed_unit, signs)
        )
    if traits.halved and traits.reversible:
        signs = (-1.0, 1.0, -1.0)
        moves.append((backwards, periods_backwards, index.T, unit[:, ::-1], signs))

    result = []
    for image_axes, image_periods, image_index, image_unit, signs in moves:
        if image_periods != periods:
            continue
        if not all(map(_is_same_axis, axes, image_axes, periods)):
            continue
        matched = _matched(unit, image_unit)
        if matched is not None:
            source, sign = matched
            result.append(Image(image_index.ravel(), source, sign * np.array(signs)))
    return _with_ends(result, index, periodic_axes(periods), len(unit))


def plane_images(
    alpha: np.ndarray, count: int, traits: Traits, pair: tuple[int, int]
) -> list[Image]:
    """Return the symmetries of the shapes alpha (N_i, N_j, d) of a plane of two joints,
    counted from 1, for ``count`` directions: the mirror (``traits.halved``) where the
    mirror images are the same shapes in reverse order, and both ends of an axis with a
    period."""
    periods = traits.periods or (None,) * alpha.shape[-1]
    index = np.arange(alpha.shape[0] * alpha.shape[1]).reshape(alpha.shape[:2])
    result = []
    if traits.halved:
        shapes = alpha.reshape(-1, alpha.shape[-1])
        if all(map(_is_same_axis, shapes.T, -shapes[::-1].T, periods)):
            signs = np.array([[-1.0, 1.0, 1.0]])
            result.append(Image(index.ravel()[::-1], np.arange(count), signs))
    around = [k for k, joint in enumerate(pair) if periods[joint - 1] is not None]
    return _with_ends(result, index, around, count)


def _is_same_axis(a: np.ndarray, b: np.ndarray, period: float | None) -> bool:
    """Return whether two rows of angles are the same shapes, one by one."""
    if period is None:
        return np.array_equal(a, b)
    turns = (a - b) / period
    return bool(np.abs(turns - np.round(turns)).max(initial=0.0) <= SAME)


def _with_ends(
    symmetries: list[Image], index: np.ndarray, around: Sequence[int], count: int
) -> list[Image]:
    """Return images with those that exchange both ends of each axis in ``around``, and
    all that are composed of them; index: (N_1, ..., N_d) of the grid."""
    identity = Image(index.ravel(), np.arange(count), np.ones((count, 3)))
    group = [identity, *symmetries]
    for axis in around:
        exchanged = index.copy()
        along = np.moveaxis(exchanged, axis, 0)  # a view
        along[[0, -1]] = along[[-1, 0]]
        ends = exchanged.ravel()
        group += [image._replace(index=ends[image.index]) for image in group]
    return group[1:]


def _matched(
    unit: np.ndarray, image_unit: np.ndarray
) -> tuple[np.ndarray, np.ndarray] | None:
    """Return (source (C,), sign (C, 1)) with unit = sign * image_unit[source]; None if
    the images are other directions."""
    products = unit @ image_unit.T
    source = np.abs(products).argmax(1)
    sign = np.sign(np.take_along_axis(products, source[:, None], 1))
    if np.abs(unit - sign * image_unit[source]).max() >= SAME:
        return None
    if np.unique(source).size < len(source):
        return None
    return source, sign


def to_solve(symmetries: Sequence[Image], size: int) -> np.ndarray:
    """Return a mask (size,) of the shapes that are no later image of another."""
    first = np.ones(size, bool)
    indices = np.arange(size)
    for image in symmetries:
        first &= indices <= image.index
    return first


class CycleImages(NamedTuple):
    """The phases of a cycle of N phases that are solved, and how the others follow.

    count: number of phases solved. solved: their indices, none a later image of
    another. source: (N,), for each phase the index among the solved ones of the one
    that it is an image of. factor: (N, 3), of its velocity."""

    count: int
    solved: np.ndarray | slice
    source: np.ndarray | slice
    factor: np.ndarray | float

    def select(self, x: np.ndarray | None) -> np.ndarray | None:
        """Return x (..., n, k) at the phases that are solved, from (..., N, k)."""
        if x is None:
            return None
        return x[..., self.solved, :]

    def expand(self, xi: np.ndarray) -> np.ndarray:
        """Return velocities (..., N, 3) at all phases from those (..., n, 3) at the
        phases that are solved."""
        return self.factor * xi[..., self.source, :]


def cycle_images(
    alpha: np.ndarray, alphadot: np.ndarray, traits: Traits
) -> CycleImages:
    """Return the symmetries that cycles (..., N, d) have in common, for a body whose
    left and right (``traits.halved``), head and tail (``traits.reversible``) are
    alike."""
    phases, joints = alpha.shape[-2:]
    if not (traits.halved or traits.reversible):
        return _cycle_images(phases, False, ())
    shape_size = np.abs(alpha).max((-2, -1), keepdims=True)
    rate_size = np.abs(alphadot).max((-2, -1), keepdims=True)
    shapes = alpha / np.where(shape_size > 0, shape_size, 1.0)
    rates = alphadot / np.where(rate_size > 0, rate_size, 1.0)
    samples = np.concatenate([shapes, rates], -1).reshape(-1, phases, 2 * joints)

    def path(k):
        return samples.take(k, 1, mode="wrap")

    moving = 0
    if len(samples):
        moving = rate_size.argmax()
    return _cycle_images(phases, *_symmetries(path, phases, 1, moving, traits))


def solved_count(gait: Gait, phases: int, traits: Traits) -> int:
    """Return the count of `cycle_images` for a gait at ``phases`` phases; many phases
    are judged by the symmetries of every few."""
    if not (traits.halved or traits.reversible):
        return phases
    amplitude = gait.amplitude or 1.0
    step = phases // SAMPLED_PHASES
    if step < 2:
        return cycle_images(*gait.cycle(phases, amplitude), traits).count
    sampled = 2 * np.pi * np.arange(0, phases, step) / phases
    shape_size = np.abs(gait.shape(sampled, amplitude)).max() or 1.0
    rate_size = np.abs(gait.rate(sampled, amplitude)).max() or 1.0

    def path(k):
        t = 2 * np.pi * (k % phases) / phases
        shapes = gait.shape(t, amplitude) / shape_size
        rates = gait.rate(t, amplitude) / rate_size
        return np.concatenate([shapes, rates], -1)[None]

    return _orbits(phases, *_symmetries(path, phases, step, 0, traits))


def _symmetries(
    path: Callable, phases: int, step: int, moving: int, traits: Traits
) -> tuple[bool, tuple]:
    """Return (shifted, backwards), arguments of `_cycle_images`, of cycles path(k) (B,
    n, 2 d), shapes and rates at phases k (n,), from every ``step``-th of N phases.

    moving: index of a cycle that is not at rest."""
    sampled = np.arange(0, phases, step)
    samples = path(sampled)
    joints = samples.shape[-1] // 2

    def nearest(k, x):
        difference = path(k)[moving] - x
        return k[np.einsum("kj,kj->k", difference, difference).argmin()]

    shifted = False
    if traits.halved and phases % 2 == 0:
        shifted = _is_equal(path(sampled + phases // 2), -samples)
    if not traits.reversible or not len(samples):
        return shifted, ()

    # Where the halves are images of each other, one sign follows from the other.
    signs = [-1.0]
    if traits.halved and not shifted:
        signs.append(1.0)
    for sign in signs:
        shapes = samples[..., joints - 1 :: -1]
        rates = -samples[..., : joints - 1 : -1]
        image = sign * np.concatenate([shapes, rates], -1)
        closest = nearest(sampled, image[moving, 0])
        around = closest + np.arange(1 - step, step)
        first = int(nearest(around, image[moving, 0])) % phases
        if _is_equal(path(first - sampled), image):
            return shifted, (first, sign)
    return shifted, ()


def _is_equal(x: np.ndarray, y: np.ndarray) -> bool:
    """Return whether two arrays, or two empty ones, differ by no more than SAME."""
    if not x.size:
        return True
    difference = x - y
    return bool(max(difference.max(), -difference.min()) <= SAME)


def _orbits(phases: int, shifted: bool, backwards: tuple) -> int:
    """Return the count of `_cycle_images`: the number of orbits, which is the mean over
    the symmetries of the number of phases that each leaves unchanged."""
    unchanged = [phases]
    if shifted:
        unchanged.append(0)
    if backwards:
        firsts = [backwards[0]]
        if shifted:
            firsts.append(backwards[0] + phases // 2)
        for first in firsts:
            # Unchanged are the phases k with 2 k = first (mod N).
            if phases % 2:
                unchanged.append(1)
            elif first % 2 == 0:
                unchanged.append(2)
            else:
                unchanged.append(0)
    return sum(unchanged) // len(unchanged)


@functools.lru_cache(maxsize=64)
def _cycle_images(phases: int, shifted: bool, backwards: tuple) -> CycleImages:
    """Return the images within a cycle.

    shifted: it is its own mirror image half a cycle later. backwards: () or, where it
    is its own image run backwards with head and tail exchanged, (phase of the first
    one's image, sign of its shape: 1 where it is seen in the mirror as well)."""
    if not (shifted or backwards):
        return CycleImages(phases, slice(None), slice(None), 1.0)
    phase_indices = np.arange(phases)
    moves = []
    if shifted:
        moves.append(((phase_indices + phases // 2) % phases, MIRROR))
    if backwards:
        first, sign = backwards
        moves.append(((first - phase_indices) % phases, (1.0, -sign, sign)))

    source = phase_indices
    factor = np.ones((phases, 3))
    for index, signs in moves:  # each undoes itself; an image may be one of an image
        earlier = source[index] < source
        factor = np.where(earlier[:, None], np.array(signs) * factor[index], factor)
        source = np.where(earlier, source[index], source)
    solved, source = np.unique(source, return_inverse=True)
    return CycleImages(len(solved), solved, source, factor)
