"""Distance of time stepping from its limit cycle, and extrapolation of a heavy body to
it.

From cycle to cycle the displacement changes by less and less; its distance from the
limit is the sum of all changes to come. Without mass that sum follows from the ratio of
the last changes. On ground with a map of cells the changes in the end are random: they
alternate in sign and do not add up.

A heavy body takes many cycles, but its state is only the three velocities at the start
of a cycle. The map from these to the velocities at the next start is affine near its
fixed point, and the last few cycles determine it in the directions in which they differ
(Anderson's mixing). Only the velocities are changed; the memory of the ground follows
by itself.

Where a body without mass forgets slowly, as with strokes far shorter than the travel of
a transient, its memory at the start of a cycle is mixed likewise. It has as many
numbers as pieces, each with a factor of its own by which its distance from the limit
falls per cycle. Two changes tell these factors, and each number is scaled by 1 / (1 -
factor)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

# cycles that the limit is computed from; a velocity has three numbers, but the map is
# not quite affine
HISTORY = 6
# of the largest singular value, below which cycles count as linearly dependent
SINGULAR = 1e-6
FIRST_RATIO = 0.5  # of the second change of displacement to the first, assumed
LARGEST_RATIO = 0.99  # of a change to the previous one, where changes hardly decrease
# cycles whose memory is mixed; fewer, or more, converge more slowly
MEMORY_HISTORY = 11
MEMORY_SINGULAR = 1e-3  # as SINGULAR, of a map with kinks
# factor of a number of memory per cycle, beyond which it is held
SLOWEST_MEMORY = 0.9995
LEAST_CHANGE = 1e-13  # of memory from cycle to cycle, above roundoff
N_RATIOS = 3  # last ratios that are averaged
# times the least change of velocity so far: an extrapolation that led away from the
# limit
DIVERGED = 5.0
# extrapolations that led away, after which a sample takes plain cycles
MOST_FAILURES = 10


class Cycles(NamedTuple):
    """The last cycles of B samples, the latest last on the axis of HISTORY, nan where
    there was none.

    pose, start: (3, B), pose and velocity at the start of the present cycle.
    displacements: (HISTORY, 3, B). history: (3, HISTORY, 3, B), of a heavy body:
    velocities at the start of cycles, their changes over the cycles, and displacements;
    steadiest: (3, 3, B), the same of the cycle with the smallest change. failures:
    (1, B), number of extrapolations that led away from the limit. extrapolation:
    (3, B), change of velocity to the limit. drift: (B,), largest component of the sum
    of all changes of displacement to come."""

    pose: np.ndarray
    start: np.ndarray
    displacements: np.ndarray
    history: np.ndarray
    steadiest: np.ndarray
    failures: np.ndarray
    extrapolation: np.ndarray
    drift: np.ndarray


def begin(samples: int) -> Cycles:
    """Return the record before the first cycle."""
    none = np.full((3, HISTORY, 3, samples), np.nan)
    zero = np.zeros((3, samples))
    return Cycles(
        pose=zero,
        start=zero + np.nan,
        displacements=none[0],
        history=none,
        steadiest=np.stack([zero, zero + np.inf, zero]),
        failures=zero[:1],
        extrapolation=zero,
        drift=np.full(samples, np.inf),
    )


def after_massless_cycle(c: Cycles, displacement: np.ndarray) -> Cycles:
    """Return the record after a cycle of a body without mass, with its displacement
    (3, B)."""
    c = c._replace(displacements=_with_cycle(c.displacements, displacement))
    changes = np.diff(c.displacements, axis=0)[-N_RATIOS - 1 :]
    changes = changes[~np.isnan(changes).any((1, 2))]
    if not len(changes):
        return c
    if len(changes) == 1:
        ratio = FIRST_RATIO
    else:
        before = np.where(changes[:-1] == 0, 1.0, changes[:-1])
        ratios = np.clip(changes[1:] / before, -1.0, 1.0)
        ratio = np.clip(ratios.mean(0), 0.0, LARGEST_RATIO)
    return c._replace(drift=np.max(np.abs(changes[-1]) / (1 - ratio), axis=0))


def after_heavy_cycle(
    c: Cycles, displacement: np.ndarray, end: np.ndarray, tolerance: float
) -> Cycles:
    """Return the record after a cycle of a heavy body that ended with a velocity
    (3, B).

    tolerance: drift below which no extrapolation is needed. After an extrapolation that
    led away from the limit the next one leads back to the end of the steadiest
    cycle."""
    last = c.displacements[-1]
    c = c._replace(displacements=_with_cycle(c.displacements, displacement))
    if np.isnan(c.start).any():  # the first cycle starts from rest
        return c
    cycle = np.stack([c.start, end - c.start, displacement])
    size = np.abs(cycle[1]).max(0)
    least = np.abs(c.steadiest[1]).max(0)
    diverged = (size > DIVERGED * least) & (c.extrapolation != 0).any(0)
    steadiest = np.where(size < least, cycle, c.steadiest)
    failures = c.failures + diverged
    history = _with_cycle(c.history, cycle)
    history = np.where(diverged & ~np.isnan(history), steadiest[:, None], history)
    c = c._replace(history=history, steadiest=steadiest, failures=failures)
    differences = np.diff(history, axis=1)
    are_known = ~np.isnan(differences).any((0, 2, 3))
    starts, changes, displacements = differences[:, are_known]
    if not len(starts):
        return c
    weights = _mixing_weights(changes, history[1, -1])[:, None]
    predicted = np.abs((displacements * weights).sum(0))
    drift = np.maximum(predicted, np.abs(displacement - last)).max(0)
    back = steadiest[0] + steadiest[1] - end
    extrapolation = np.where(diverged, back, ((starts + changes) * weights).sum(0))
    extrapolates = (drift > tolerance) & (diverged | (failures[0] < MOST_FAILURES))
    extrapolation = np.where(extrapolates, extrapolation, 0.0)
    return c._replace(drift=drift, extrapolation=extrapolation)


class MemoryCycle(NamedTuple):
    """A cycle of a body without mass. start, end: memory (M, B) at its start and its
    end. displacement: (3, B)."""

    start: np.ndarray
    end: np.ndarray
    displacement: np.ndarray


def memory_gain(cycles: list[MemoryCycle]) -> np.ndarray:
    """Return the distance of memory from its limit over its change in a cycle, (M, B),
    from two plain cycles."""
    before, last = (c.end - c.start for c in cycles[-2:])
    large = np.abs(before) > LEAST_CHANGE
    ratio = np.where(large, last / np.where(large, before, 1.0), 0.0)
    return 1.0 / (1.0 - np.clip(ratio, 0.0, SLOWEST_MEMORY))


def mixed_memory(
    cycles: list[MemoryCycle], gain: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the memory (M, B) at the limit by Anderson's mixing of the last cycles,
    and the drift (B,).

    The drift is the largest of four: the change of displacement that the mixing
    predicts, the last change, and what displacement changes per change of memory times
    the change to the limit, with the largest such ratio of the cycles, or times gain x
    the last change of memory, with their median. Where the mixing stalls, the first two
    are small."""
    last = cycles[-1]
    starts = np.stack([c.start for c in cycles])
    changes = np.stack([c.end - c.start for c in cycles])
    displacements = np.stack([c.displacement for c in cycles])
    start_slope = np.diff(starts, axis=0)
    slope = np.diff(changes, axis=0)
    moves = np.diff(displacements, axis=0)
    matrix = np.moveaxis(gain * slope, (0, 1, 2), (2, 1, 0))
    inverse = np.linalg.pinv(matrix, MEMORY_SINGULAR)
    weights = -np.einsum("bkm,mb->kb", inverse, gain * changes[-1])[:, None]
    remaining = changes[-1] + (slope * weights).sum(0)
    step = (start_slope * weights).sum(0) + gain * remaining
    size = np.maximum(np.linalg.norm(start_slope, axis=1), LEAST_CHANGE)
    effect = np.abs(moves).max(1) / size  # of memory on displacement
    drifts = (
        np.abs((moves * weights).sum(0)).max(0),
        np.abs(moves[-1]).max(0),
        effect.max(0) * np.linalg.norm(step, axis=0),
        np.median(effect, 0) * np.linalg.norm(gain * changes[-1], axis=0),
    )
    return last.start + step, np.maximum.reduce(drifts)


def _with_cycle(cycles: np.ndarray, cycle: np.ndarray) -> np.ndarray:
    """Return the last cycles without the first of them and with one more."""
    return np.concatenate([cycles[..., 1:, :, :], cycle[..., None, :, :]], -3)


def _mixing_weights(differences: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Return the weights (k, B) of the differences (k, 3, B) whose sum with the change
    (3, B) is smallest."""
    size = np.sqrt((differences**2).sum(1))
    size = np.where(size > 0, size, 1.0)
    matrix = np.moveaxis(differences / size[:, None], (0, 1, 2), (2, 1, 0))
    return -np.einsum("bki,ib->kb", np.linalg.pinv(matrix, SINGULAR), change) / size
