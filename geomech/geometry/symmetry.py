"""Components of a net displacement that vanish by symmetry: facts about the velocity, and about the curve of the gait.

A symmetry of a cycle is alpha(s t + tau) = L alpha(t), s = 1 or -1, where L is -1 (left for right), the shape backwards with
its sign changed (head for tail), both or neither. By the traits the body velocity at the image of a phase is then s D xi, D a
diagonal matrix of signs, and the net pose g of a cycle obeys:

- s = 1, tau = 0: xi = D xi at every phase, so that components with D = -1 are 0 throughout;
- s = 1, tau = pi: g = h D(h) of its halves; with D_theta = -1 no heading is gained;
- s = -1, L = 1: the cycle retraces its path, and g is the identity;
- s = -1: the heading is its own image, so that with D_theta = 1 it is 0; with tau = 0 and no heading gained, x or y is its
  own image, and 0 where D = 1.

No magnitude of a displacement is looked at. Phases are those of a grid, tau is one of them, and curves are compared to roundoff.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from geomech.geometry.gait import Gait
from geomech.geometry.images import SAME
from geomech.geometry.traits import Traits

PHASES = 48  # at least, and a multiple of it: halves, thirds and quarters of a cycle are among them
COMPONENTS = "x", "y", "heading"


def zero_components(traits: Traits, gait: Gait, amplitudes) -> list[str]:
    """Return which of COMPONENTS of the net displacement are 0 by symmetry, at each of the amplitudes (B,); none where the
    velocity does not follow from shape alone."""
    amplitudes = np.asarray(amplitudes, float)
    if traits.steps or not amplitudes.size:
        return []
    phases = PHASES * -(-(2 * gait.harmonics + 1) // PHASES)
    cycles = np.concatenate([x / (np.abs(x).max() or 1.0) for x in gait.cycle(phases, amplitudes)], -1)
    found = [(sign, D, first) for sign, L, D in _moves(traits) for first in _firsts(cycles, sign, L)]
    zero = np.zeros(3, bool)
    for sign, D, first in found:  # a heading of 0 is what places need
        zero |= (sign == 1 and first == 0) & (D == -1)
        zero[2] |= D[2] == -sign and (sign == -1 or 2 * first == phases)
        zero |= sign == -1 and (D == 1).all()
    for sign, D, first in found:
        zero[:2] |= bool(zero[2] and sign == -1 and D[2] == -1 and first == 0) & (D[:2] == 1)
    return [name for name, is_zero in zip(COMPONENTS, zero) if is_zero]


def _moves(traits: Traits) -> Iterator[tuple[int, tuple[int, int], np.ndarray]]:
    """Yield (s, (sign, step), D) for each symmetry that the traits allow: L alpha is sign * alpha[..., ::step]."""
    shapes = (
        (True, (1, 1), (1, 1, 1)),
        (traits.mirror, (-1, 1), (1, -1, -1)),
        (traits.reversible, (-1, -1), (-1, -1, 1)),
        (traits.mirror and traits.reversible, (1, -1), (-1, 1, -1)),
    )
    for holds, L, D in shapes:
        for sign in (1, -1) if traits.odd else (1,):
            if holds and (sign, L) != (1, (1, 1)):
                yield sign, L, np.array(D)


def _firsts(cycles: np.ndarray, sign: int, L: tuple[int, int]) -> Iterator[int]:
    """Yield the phases tau, as numbers on the grid, for which cycles (B, N, 2 d), shapes and rates, are their images."""
    phases, joints = cycles.shape[1], cycles.shape[2] // 2
    factor, step = L
    alpha, alphadot = cycles[..., :joints], cycles[..., joints:]
    image = factor * np.concatenate([alpha[..., ::step], sign * alphadot[..., ::step]], -1)
    moving = np.abs(alphadot).max((1, 2)).argmax()
    for first in np.flatnonzero(np.abs(cycles[moving] - image[moving, 0]).max(-1) <= SAME):
        if (np.abs(cycles[:, (first + sign * np.arange(phases)) % phases] - image) <= SAME).all():
            yield int(first)
