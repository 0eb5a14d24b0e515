"""The lead of a face: the share of the law's stress that it bears, 1 where the face
leads and 0 where it trails.

The law of stress jumps where a face begins to lead. ``n_dot_v`` is n . v, with n the
outward unit normal of the face and v its unit velocity. ``grazing_sine`` is the sine of
the grazing angle, over which the lead rises from 0 to 1. All functions are formulas
(`rft.formulas.vectors`)."""

from __future__ import annotations

from rft.formulas.link import TINY
from rft.formulas.vectors import absolute, formula, maximum, minimum, sqrt, where


@formula
def jump(n_dot_v):
    """Return 1 where a face leads or slides along itself, and 0 where it trails."""
    return where(n_dot_v >= 0.0, 1.0, 0.0)


@formula
def smoothstep(n_dot_v, grazing_sine):
    """Return s^2 (3 - 2 s) with s = n_dot_v / grazing_sine, clipped to 0 to 1."""
    share = minimum(maximum(n_dot_v / grazing_sine, 0.0), 1.0)
    return share * share * (3.0 - 2.0 * share)


@formula
def smoothstep_slope(n_dot_v, grazing_sine):
    """Return the slope of `smoothstep` by n_dot_v."""
    share = minimum(maximum(n_dot_v / grazing_sine, 0.0), 1.0)
    return 6.0 * share * (1.0 - share) / grazing_sine


@formula
def rounded_step(n_dot_v, grazing_sine):
    """Return n_dot_v / sqrt(n_dot_v^2 + grazing_sine^2), and 0 where a face trails."""
    size = maximum(sqrt(n_dot_v * n_dot_v + grazing_sine * grazing_sine), TINY)
    return maximum(n_dot_v, 0.0) / size


@formula
def rounded_step_slope(n_dot_v, grazing_sine):
    """Return the slope of `rounded_step` by n_dot_v."""
    size = maximum(sqrt(n_dot_v * n_dot_v + grazing_sine * grazing_sine), TINY)
    slope = grazing_sine * grazing_sine / (size * size * size)
    return where(n_dot_v > 0.0, slope, 0.0)


@formula
def mean_ramp(first, last, grazing_sine):
    """Return the mean of min(n_dot_v / grazing_sine, 1) over a part of a face along
    which n_dot_v changes linearly from ``first`` to ``last``, both at least 0."""
    scale = 1.0 / grazing_sine
    a = maximum(first * scale, 0.0)
    b = maximum(last * scale, 0.0)

    # The integral of min(s, 1) from 0 to a, and to b.
    up_to_a = where(a < 1.0, 0.5 * a * a, a - 0.5)
    up_to_b = where(b < 1.0, 0.5 * b * b, b - 0.5)

    step = b - a
    is_constant = absolute(step) < 1e-6
    mean = (up_to_b - up_to_a) / where(is_constant, 1.0, step)
    return where(is_constant, minimum(0.5 * (a + b), 1.0), mean)
