"""Vectors of three components: triples of numbers, of arrays, or of the vectors of
compiled code. All are formulas."""

from __future__ import annotations

from rft.formulas.vectors import formula

UP = (0.0, 0.0, 1.0)
AHEAD = (1.0, 0.0, 0.0)
AXES = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


@formula
def dot(a, b):
    """Return a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@formula
def cross(a, b):
    """Return a x b."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


@formula
def times(c, a):
    """Return c a for a number c."""
    return c * a[0], c * a[1], c * a[2]


@formula
def plus(a, b):
    """Return a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@formula
def minus(a, b):
    """Return a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@formula
def weighted_sum(weights, a, b, c):
    """Return the sum of three triples a, b, c with three weights."""
    return plus(plus(times(weights[0], a), times(weights[1], b)), times(weights[2], c))
