"""SDIRK2, of which each stage is solved to its end by Newton's method: one robot's way through its time steps.

The law of stress knows of speed its direction alone, so it is stiff wherever something is nearly at rest: explicit
steps chatter there, and linearly implicit ones too, as a step may begin in slip and end in stick. So each stage is
solved to its end: SDIRK2 of Alexander, SIAM J. Numer. Anal. 14, 1006 (1977), of order 2, L-stable and stiffly accurate,
by Newton's method on the three rates. What that does not solve it tries by way of wider roundings; a step it does not
solve even so is halved.

The functions are formulas (`rft.vectors`): `rft.walking.march` takes many robots through them side by side by NumPy,
`rft.walking.compiled` one after the other. Triples are (x, z, pitch)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rft.balance.newton import plus, solve3, times
from rft.vectors import absolute, floor, formula, maximum, where

ORDER = 2  # of the error in 1 / steps
GAMMA = 1.0 - 0.5**0.5
SOLVED = 1e-3  # m/s, times the rounding: residual of a solved stage
HALVINGS = 3  # of a step
FARTHEST = 0.5  # of a leg's reach, that a step of Newton's method moves a body by
LEAST = 0.05  # of a step of Newton's method, below which it is given up
ENOUGH = 0.1  # of the fall of the residual that Newton's method foretells


class Effort(NamedTuple):
    """What is done to solve a stage. widths: (W, 1), times the rounding, one after another until one is solved as it
    is, the first and the last 1. iterations: of Newton's method at a width. smallest: part of a step."""

    widths: np.ndarray
    iterations: float
    smallest: float


EFFORT = Effort(np.array([[1.0, 30.0, 10.0, 5.0, 3.0, 2.0, 1.5, 1.2, 1.0]]).T, 14.0, 0.5**HALVINGS)


class Way(NamedTuple):
    """A robot on its way.

    pose, twist: at the start of the present part of a step. work, loss, unsolved, defect, residual: as of
    `rft.walking.planar.State`. part, done: the present part of the step, and what is done of it, both over the step. At
    the first or second ``stage``, 0 or 1, v = start + k a(base + k v, v). width: which rounding; tries: evaluations at
    it. found: of all v tried the one with the smallest residual ``off``, m/s, with power of the motors and into the
    ground, W; trial: the next, a ``share`` of Newton's step ``newton`` away, at first ``most`` of it. first: power and
    residual of the first stage."""

    pose: tuple[float, float, float]
    twist: tuple[float, float, float]
    work: float
    loss: float
    unsolved: float
    defect: float
    residual: float
    part: float
    done: float
    stage: float
    width: float
    tries: float
    base: tuple[float, float, float]
    start: tuple[float, float, float]
    guess: tuple[float, float, float]
    found: tuple[float, float, float]
    trial: tuple[float, float, float]
    newton: tuple[float, float, float]
    off: float
    share: float
    most: float
    power: tuple[float, float]
    first: tuple[float, float, float]


@formula
def begun(pose, twist, work, loss, unsolved, defect, residual):
    """Return the way of a robot in a state at the start of a step."""
    zero = 0.0 * work
    one, none = zero + 1.0, (zero, zero, zero)
    return Way(
        pose, twist, work, loss, unsolved, defect, residual, one, zero, zero, zero, zero,
        pose, twist, twist, twist, twist, none, zero + np.inf, one, one, (zero, zero), none,
    )  # fmt: skip


@formula
def pick(condition, a, b):
    """Return the triple a where the condition holds, b elsewhere."""
    return where(condition, a[0], b[0]), where(condition, a[1], b[1]), where(condition, a[2], b[2])


@formula
def gained(condition, now, more):
    """Return now + more where the condition holds, now elsewhere."""
    return now + where(condition, more, 0.0)


@formula
def largest(a, size):
    """Return the largest of a triple, its third times ``size``."""
    return maximum(maximum(absolute(a[0]), absolute(a[1])), size * absolute(a[2]))


@formula
def when(w):
    """Return the time at which the present stage is evaluated, over the step."""
    return w.done + where(w.stage > 0.0, 1.0, GAMMA) * w.part


@formula
def judged(w, off, slopes, power, k, reach, solved, effort):
    """Return the way after an evaluation, the residual ``off`` (triple) of the trial and its slopes, three columns;
    whether that is below ``solved``, m/s; and whether Newton's method is to be given up."""
    size = largest(off, reach) + 0.0 * (off[0] + off[1] + off[2])  # no number where one of them is none
    better = size <= (1.0 - ENOUGH * w.share) * w.off
    x, z, pitch = solve3(slopes[0], slopes[1], slopes[2], off)
    newton = pick(better, (-x, -z, -pitch), w.newton)
    most = where(better, 1.0 / maximum(1.0, largest(newton, reach) * k / (FARTHEST * reach)), w.most)
    share, found = where(better, most, 0.5 * w.share), pick(better, w.trial, w.found)
    power = where(better, power[0], w.power[0]), where(better, power[1], w.power[1])
    tries, size = w.tries + 1.0, where(better, size, w.off)
    good = better & (size <= solved)
    lost = (where(good, np.inf, share) <= LEAST * most) | (where(good, 0.0, tries) >= effort.iterations)
    after = Way(
        w.pose, w.twist, w.work, w.loss, w.unsolved, w.defect, w.residual, w.part, w.done, w.stage, w.width, tries, w.base,
        w.start, w.guess, found, plus(found, times(share, newton)), newton, size, share, most, power, w.first,
    )  # fmt: skip
    return after, good, lost


@formula
def advanced(w, good, lost, solved, k, h, effort):
    """Return the way of a robot that has solved a stage at a rounding, or given it up, on to the next rounding, stage or
    part of a step, and whether a step has ended; of others as it is. h: s, of the present part of the step."""
    at_last, whole, small = w.width >= len(effort.widths) - 1.0, w.width <= 0.0, w.part <= effort.smallest
    ready = (good & (whole | at_last)) | (lost & at_last & small)
    moves = good | lost
    halved, wider = where(ready, False, lost & at_last), where(ready | at_last, False, moves)
    second, ended = ready & (w.stage <= 0.0), ready & (w.stage > 0.0)
    again = ended | halved

    left = where(w.off > solved, w.off, 0.0) + where(w.first[2] > solved, w.first[2], 0.0)
    pose, twist = pick(ended, plus(w.base, times(k, w.found)), w.pose), pick(ended, w.found, w.twist)
    done = w.done + where(ended, w.part, 0.0)
    part = where(halved, 0.5 * w.part, w.part)
    for _ in range(HALVINGS):  # two halves make one
        pairs = done / (2.0 * part)
        part = where(ended & (part < 1.0) & (pairs == floor(pairs)), 2.0 * part, part)
    over = ended & (done >= 1.0)
    rest = h - k
    base = pick(again, pose, pick(second, plus(w.pose, times(rest, w.found)), w.base))
    on = plus(w.twist, times(rest / k, plus(w.found, times(-1.0, w.start))))
    start = pick(again, twist, pick(second, on, w.start))
    guess = pick(again, twist, pick(second, w.found, w.guess))
    fresh = again | second | wider
    at = pick(wider & (w.width > 0.0), w.found, guess)
    first = pick(second, (w.power[0], w.power[1], w.off), w.first)
    return Way(
        pose, twist,
        gained(ended, w.work, h * (1.0 - GAMMA) * w.first[0] + k * w.power[0]),
        gained(ended, w.loss, h * (1.0 - GAMMA) * w.first[1] + k * w.power[1]),
        gained(ended, w.unsolved, where(left > 0.0, 1.0, 0.0)), gained(ended, w.defect, left),
        where(ended, maximum(w.residual, maximum(w.off, w.first[2])), w.residual),
        part, where(over, 0.0, done), where(again, 0.0, where(second, 1.0, w.stage)),
        where(wider, w.width + 1.0, where(fresh, 0.0, w.width)), where(fresh, 0.0, w.tries),
        base, start, guess, pick(fresh, at, w.found), pick(fresh, at, w.trial),
        pick(fresh, (0.0, 0.0, 0.0), w.newton),
        where(fresh, np.inf, w.off), where(fresh, 1.0, w.share), where(fresh, 1.0, w.most), w.power, first,
    ), over  # fmt: skip


@formula
def ended(z, pitch, ends):
    """Return whether a robot is at an end: sunk, -z above the first of ``ends``, airborne, z above the second, or
    flipped."""
    return (z + ends[0] < 0.0) | (z > ends[1]) | (absolute(pitch) > 0.5 * np.pi)
