"""How far time stepping is from its limit cycle, and how a heavy body gets there sooner.

From cycle to cycle the displacement changes by less and less; what is left is the sum of all changes to come, not the
last of them. Without mass the last few give their ratio. Where the ground remembers in cells, changes at last come and
go at random: these take turns in sign, and do not add up. A heavy body forgets over many cycles, but only what its
three velocities at the start of a cycle are: the map from these to those at the next start is affine near its fixed
point, and the last few cycles tell it along the ways they went (Anderson's mixing, for which nothing but the velocities
is touched: what the ground remembers follows by itself)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

DEEPEST = 6  # cycles the limit is found from; a velocity has three numbers, but the map bends
SINGULAR = 1e-6  # of the largest singular value, below which two cycles went the same way
UNKNOWN = 0.5  # ratio of the first change of displacement to the next, assumed
SLOWEST = 0.95  # ratio of a change to that before, where they hardly shrink
RATIOS = 3  # of late, whose mean counts
ASTRAY = 5.0  # times the least change of velocity so far: a kick that led away from the limit
FAILURES = 10  # after so many of these a sample goes round and round without


class Cycles(NamedTuple):
    """The last cycles of B samples, the latest at the end, nan where there was none.

    pose, start: (3, B), pose and velocity at the start of the cycle under way. moves: (6, 3, B), displacements. known:
    (3, 6, 3, B), velocities at the start, their changes, and displacements, of a heavy body; calmest: (3, 3, B), those
    of the cycle that changed least. failures: (1, B), kicks that led away from the limit. kick: (3, B), the change of
    velocity that leads to the limit. drift: (B,), the largest component of how much displacement will yet change in all
    cycles to come."""

    pose: np.ndarray
    start: np.ndarray
    moves: np.ndarray
    known: np.ndarray
    calmest: np.ndarray
    failures: np.ndarray
    kick: np.ndarray
    drift: np.ndarray


def begin(samples: int) -> Cycles:
    """Return the record before the first cycle."""
    none, zero = np.full((3, DEEPEST, 3, samples), np.nan), np.zeros((3, samples))
    calmest = np.stack([zero, zero + np.inf, zero])
    return Cycles(zero, zero + np.nan, none[0], none, calmest, zero[:1], zero, np.full(samples, np.inf))


def light(c: Cycles, moved: np.ndarray) -> Cycles:
    """Return the record after a cycle of a body without mass, with its displacement (3, B)."""
    c = c._replace(moves=_appended(c.moves, moved))
    changes = np.diff(c.moves, axis=0)[-RATIOS - 1 :]
    changes = changes[~np.isnan(changes).any((1, 2))]
    if not len(changes):
        return c
    ratios = np.clip(changes[1:] / np.where(changes[:-1] == 0, 1.0, changes[:-1]), -1.0, 1.0)
    ratio = np.clip(ratios.mean(0), 0.0, SLOWEST) if len(ratios) else UNKNOWN
    return c._replace(drift=np.max(np.abs(changes[-1]) / (1 - ratio), axis=0))


def heavy(c: Cycles, moved: np.ndarray, end: np.ndarray, enough: float) -> Cycles:
    """Return the record after a cycle of a heavy body that ended with a velocity (3, B).

    A kick after which velocities change more than in the calmest cycle so far is taken back, to the end of that.
    """
    last, c = c.moves[-1], c._replace(moves=_appended(c.moves, moved))
    if np.isnan(c.start).any():  # the first cycle starts from rest
        return c
    now = np.stack([c.start, end - c.start, moved])
    size, least = np.abs(now[1]).max(0), np.abs(c.calmest[1]).max(0)
    astray = (size > ASTRAY * least) & (c.kick != 0).any(0)
    calmest, failures = np.where(size < least, now, c.calmest), c.failures + astray
    known = _appended(c.known, now)
    known = np.where(astray & ~np.isnan(known), calmest[:, None], known)
    c = c._replace(known=known, calmest=calmest, failures=failures)
    steps = np.diff(known, axis=1)
    starts, changes, moves = steps[:, ~np.isnan(steps).any((0, 2, 3))]
    if not len(starts):
        return c
    mix = _mix(changes, known[1, -1])[:, None]
    drift = np.maximum(np.abs((moves * mix).sum(0)), np.abs(moved - last)).max(0)
    ahead = np.where(astray, calmest[0] + calmest[1] - end, ((starts + changes) * mix).sum(0))
    may = (drift > enough) & (astray | (failures[0] < FAILURES))
    return c._replace(drift=drift, kick=np.where(may, ahead, 0.0))


def _appended(old: np.ndarray, new: np.ndarray) -> np.ndarray:
    """Return the last cycles with one more, in place of the first."""
    return np.concatenate([old[..., 1:, :, :], new[..., None, :, :]], -3)


def _mix(changes: np.ndarray, last: np.ndarray) -> np.ndarray:
    """(k, B): how much of the differences (k, 3, B) takes the last change (3, B) nearest to nothing."""
    size = np.sqrt((changes**2).sum(1))
    size = np.where(size > 0, size, 1.0)
    matrix = np.moveaxis(changes / size[:, None], (0, 1, 2), (2, 1, 0))
    return -np.einsum("bki,ib->kb", np.linalg.pinv(matrix, SINGULAR), last) / size
