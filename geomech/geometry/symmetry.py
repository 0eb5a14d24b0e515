"""Components of a net displacement that vanish by symmetry: facts about the velocity, and about the curve of the gait.

A symmetry of a cycle is alpha(s t + tau) = L alpha(t), s = 1 or -1, where L is -1 (left for right), the shape backwards with
its sign changed (head for tail), both or neither. By the traits the body velocity at the image of a phase is then s D xi, D a
diagonal matrix of signs, and the net pose g of a cycle obeys:

- s = 1, tau = 0: xi = D xi at every phase, so that components with D = -1 are 0 throughout;
- s = 1, tau = pi: g = h D(h) of its halves; with D_theta = -1 no heading is gained;
- s = -1, L = 1: the cycle retraces its path, and g is the identity;
- s = -1: the heading is its own image, so that with D_theta = 1 it is 0; with tau = 0 and no heading gained, x or y is its
  own image, and 0 where D = 1.

No magnitude of a displacement is looked at. Phases and tau are those of a grid, and curves are compared to roundoff.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from geomech.geometry.gait import Gait
from geomech.geometry.images import SAME
from geomech.geometry.traits import Traits

PHASES = 48  # at least, and a multiple of it: halves, thirds and quarters of a cycle are among them
COMPONENTS = "x", "y", "heading"
ALWAYS = "all shapes are their own image"
MIRRORED = "the second half of the cycle mirrors the first"
BACKWARDS = "the cycle run backwards is its own image, head for tail"
REFLECTED = "the cycle run backwards is its own mirror image"
RETRACED = "the cycle retraces its path"


def zero_components(traits: Traits, gait: Gait, amplitudes=None) -> dict[str, str]:
    """Return the reason by component, of those of COMPONENTS that are 0 by symmetry at each of the amplitudes (B,), or at the
    gait's own; none where the velocity does not follow from shape alone."""
    amplitudes = np.atleast_1d(
        gait.amplitude if amplitudes is None else amplitudes
    ).astype(float)
    if traits.steps or not amplitudes.size:
        return {}
    phases = PHASES * -(-(2 * gait.harmonics + 1) // PHASES)
    cycles = np.concatenate(
        [x / (np.abs(x).max() or 1.0) for x in gait.cycle(phases, amplitudes)], -1
    )
    found = [
        (sign, D, first)
        for sign, L, D in _moves(traits)
        for first in _firsts(cycles, sign, L)
    ]
    why: dict[int, str] = {}
    for sign, D, first in found:
        if sign == 1:
            of_halves = [2] if D[2] == -1 and 2 * first == phases else []
            zero, reason = (
                (np.flatnonzero(D == -1), ALWAYS)
                if first == 0
                else (of_halves, MIRRORED)
            )
        else:
            retraced = (D == 1).all()
            zero, reason = (
                (range(3), RETRACED)
                if retraced
                else ([2] if D[2] == 1 else [], BACKWARDS)
            )
        for k in zero:
            why.setdefault(int(k), reason)
    for sign, D, first in found if 2 in why else ():  # x and y need a heading of 0
        for k in (
            np.flatnonzero(D[:2] == 1) if (sign, D[2], first) == (-1, -1, 0) else ()
        ):
            why.setdefault(int(k), BACKWARDS if D[0] == -1 else REFLECTED)
    return {name: why[k] for k, name in enumerate(COMPONENTS) if k in why}


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
    image = factor * np.concatenate(
        [alpha[..., ::step], sign * alphadot[..., ::step]], -1
    )
    moving = np.abs(alphadot).max((1, 2)).argmax()
    for first in np.flatnonzero(
        np.abs(cycles[moving] - image[moving, 0]).max(-1) <= SAME
    ):
        if (
            np.abs(cycles[:, (first + sign * np.arange(phases)) % phases] - image)
            <= SAME
        ).all():
            yield int(first)
