"""How much of its stress a face bears that leads, slides along itself or trails: 1 to 0.

The law of stress jumps where a face begins to lead. ``into`` is the part of a face's velocity along its outward normal
over its speed, ``sine`` that of the grazing angle, over which the stress rises from none to its own. All functions are
formulas (`rft.vectors`)."""

from __future__ import annotations

from rft.link import TINY
from rft.vectors import absolute, formula, maximum, minimum, sqrt, where


@formula
def jump(into):
    """Return all of the stress on a face that leads, or slides along itself, none on one that trails."""
    return where(into >= 0.0, 1.0, 0.0)


@formula
def smoothstep(into, sine):
    """Return s^2 (3 - 2 s), s = into / sine from 0 to 1."""
    share = minimum(maximum(into / sine, 0.0), 1.0)
    return share * share * (3.0 - 2.0 * share)


@formula
def rounded(into, sine):
    """Return into / sqrt(into^2 + sine^2)."""
    return maximum(into, 0.0) / maximum(sqrt(into * into + sine * sine), TINY)


@formula
def mean_ramp(first, last, sine):
    """Return the mean of min(into / sine, 1) over a part along which ``into`` goes evenly from ``first`` to ``last``,
    both at least 0."""
    per = 1.0 / sine
    a, b = maximum(first * per, 0.0), maximum(last * per, 0.0)
    below_a, below_b = where(a < 1.0, 0.5 * a * a, a - 0.5), where(b < 1.0, 0.5 * b * b, b - 0.5)
    step = b - a
    flat = absolute(step) < 1e-6
    return where(flat, minimum(0.5 * (a + b), 1.0), (below_b - below_a) / where(flat, 1.0, step))
