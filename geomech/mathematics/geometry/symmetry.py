"""Components of a net displacement that vanish by symmetry.

They follow from facts about the velocity and about the curve of the gait. A symmetry of
a cycle is alpha(s t + tau) = L alpha(t), s = 1 or -1, where L is -1 (left for right),
the shape backwards with its sign changed (head for tail), both or neither. By the
traits the body velocity at the image of a phase is then s D xi, D a diagonal matrix of
signs, and the net pose g of a cycle obeys:

- s = 1, tau = 0: xi = D xi at every phase, so that components with D = -1 are 0
  throughout;
- s = 1, tau = pi: g = h D(h) of its halves; with D_theta = -1 no heading is gained;
- s = -1, L = 1: the cycle retraces its path, and g is the identity;
- s = -1: the heading is its own image, so that with D_theta = 1 it is 0; with tau = 0
  and no heading gained, x or y is its own image, and 0 where D = 1.

No magnitude of a displacement is used. Phases and tau are those of a grid, and curves
are compared to roundoff."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from geomech.mathematics.geometry.gait import Gait
from geomech.mathematics.geometry.representations.images import SAME
from geomech.mathematics.geometry.traits import Traits

# A multiple of this number of phases has halves, thirds and quarters of a cycle.
PHASES = 48
COMPONENTS = ("x", "y", "heading")
HEADING = 2  # its index
ALWAYS = "every shape is its own image"
MIRRORED = "the second half of the cycle mirrors the first"
BACKWARDS = "the reversed cycle is its own image with head and tail exchanged"
REFLECTED = "the reversed cycle is its own mirror image"
RETRACED = "the cycle retraces its path"


def zero_components(traits: Traits, gait: Gait, amplitudes=None) -> dict[str, str]:
    """Return the reasons by component, for those of COMPONENTS that are 0 by symmetry
    at each of the amplitudes (B,), or at the gait's own; {} where the velocity does not
    follow from shape alone."""
    if amplitudes is None:
        amplitudes = gait.amplitude
    amplitudes = np.atleast_1d(amplitudes).astype(float)
    if traits.steps or not amplitudes.size:
        return {}
    phases = PHASES * math.ceil((2 * gait.harmonics + 1) / PHASES)
    alpha, alphadot = gait.cycle(phases, amplitudes)
    alpha = alpha / (np.abs(alpha).max() or 1.0)
    alphadot = alphadot / (np.abs(alphadot).max() or 1.0)

    symmetries = []
    for sign, L, D in _moves(traits):
        for first in _first_phases(alpha, alphadot, sign, L):
            symmetries.append((sign, D, first))

    reasons: dict[int, str] = {}
    for sign, D, first in symmetries:
        components, reason = _zeros(sign, D, first, phases)
        for k in components:
            reasons.setdefault(k, reason)
    if HEADING in reasons:
        for sign, D, first in symmetries:
            components, reason = _zeros_without_turn(sign, D, first)
            for k in components:
                reasons.setdefault(k, reason)
    return {name: reasons[k] for k, name in enumerate(COMPONENTS) if k in reasons}


def _zeros(sign: int, D: np.ndarray, first: int, phases: int) -> tuple[list[int], str]:
    """Return the components that one symmetry, with tau at the phase ``first``, makes
    0, and the reason."""
    if sign == 1 and first == 0:
        return np.flatnonzero(D == -1).tolist(), ALWAYS
    if sign == 1:
        if D[HEADING] == -1 and 2 * first == phases:
            return [HEADING], MIRRORED
        return [], MIRRORED
    if (D == 1).all():
        return [0, 1, HEADING], RETRACED
    if D[HEADING] == 1:
        return [HEADING], BACKWARDS
    return [], BACKWARDS


def _zeros_without_turn(sign: int, D: np.ndarray, first: int) -> tuple[list[int], str]:
    """Return which of x and y one symmetry makes 0 where no heading is gained, and the
    reason."""
    reason = BACKWARDS if D[0] == -1 else REFLECTED
    if sign == -1 and D[HEADING] == -1 and first == 0:
        return np.flatnonzero(D[:2] == 1).tolist(), reason
    return [], reason


def _moves(traits: Traits) -> Iterator[tuple[int, tuple[int, int], np.ndarray]]:
    """Yield (s, (factor, step), D) for each symmetry that the traits allow: L alpha is
    factor * alpha[..., ::step]."""
    shapes = [((1, 1), (1, 1, 1))]
    if traits.mirror:
        shapes.append(((-1, 1), (1, -1, -1)))
    if traits.reversible:
        shapes.append(((-1, -1), (-1, -1, 1)))
    if traits.mirror and traits.reversible:
        shapes.append(((1, -1), (-1, 1, -1)))
    for L, D in shapes:
        if L != (1, 1):  # that is no symmetry but the identity
            yield 1, L, np.array(D)
        if traits.odd:
            yield -1, L, np.array(D)


def _first_phases(
    alpha: np.ndarray, alphadot: np.ndarray, sign: int, L: tuple[int, int]
) -> Iterator[int]:
    """Yield the phases tau, as numbers on the grid, for which cycles of shapes and
    rates (B, N, d) are their images."""
    phases = alpha.shape[1]
    factor, step = L
    cycles = np.concatenate([alpha, alphadot], -1)
    image_shapes = alpha[..., ::step]
    image_rates = sign * alphadot[..., ::step]
    image = factor * np.concatenate([image_shapes, image_rates], -1)
    moving = np.abs(alphadot).max((1, 2)).argmax()
    distance = np.abs(cycles[moving] - image[moving, 0]).max(-1)
    for first in np.flatnonzero(distance <= SAME):
        order = (first + sign * np.arange(phases)) % phases
        if (np.abs(cycles[:, order] - image) <= SAME).all():
            yield int(first)
