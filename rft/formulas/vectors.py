"""The functions that formulas use, for numbers, NumPy arrays and the vectors of
compiled code.

A formula is a plain function of one element, written as in the paper and marked with
`formula`. In Python it takes numbers and arrays, by NumPy. `rft.formulas.simd` defines
the functions below, and every formula, a second time for compiled code, where they also
take eight elements at once in a register of the processor. This module imports no
compiler."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rft.core.checks import refuse_mask

# Formulas not yet registered with the compiler (`rft.formulas.simd.register_formulas`).
FORMULAS: list[Callable] = []


def formula(function: Callable) -> Callable:
    """Mark a function as a formula, so that compiled code may call it; return it
    unchanged."""
    function.is_formula = True
    FORMULAS.append(function)
    return function


def is_formula(function: Callable) -> bool:
    """Return whether a function is marked as a formula."""
    return getattr(function, "is_formula", False)


def sqrt(x):
    """Return the square root."""
    return np.sqrt(x)


def absolute(x):
    """Return the absolute value."""
    return np.abs(x)


def exp(x):
    """Return the exponential function."""
    return np.exp(x)


def floor(x):
    """Return the largest integer that is not above x."""
    return np.floor(x)


def copysign(x, y):
    """Return the magnitude of x with the sign of y."""
    return np.copysign(x, y)


def maximum(x, y):
    """Return the larger number."""
    return np.maximum(x, y)


def minimum(x, y):
    """Return the smaller number."""
    return np.minimum(x, y)


def where(condition, x, y):
    """Return x where the condition holds, y elsewhere; both are computed."""
    refuse_mask("a formula", condition)
    return np.where(condition, x, y)


def log_ratio(a, b):
    """Return log(a / b) of positive numbers."""
    return np.log(a / b)


def polynomial(z, coefficients):
    """Return sum_j coefficients[j] z^j by Horner's rule."""
    value = coefficients[-1]
    for c in coefficients[-2::-1]:
        value = value * z + c
    return value


def combinations(coefficients, terms):
    """Return c_0 + sum_j c_j terms[j - 1] for each row c of coefficients, a tuple of
    tuples."""
    terms = np.broadcast_arrays(*terms)
    rows = np.stack([np.ones(terms[0].shape), *terms])
    sums = np.array(coefficients) @ rows.reshape(len(rows), rows[0].size)
    return tuple(sums.reshape(len(coefficients), *rows.shape[1:]))


def gather(table, row, column):
    """Return table[row, column] for each of the integers ``row``."""
    return table[np.asarray(row, int), column]


def anywhere(condition):
    """Return whether a condition holds for any of the numbers that are computed
    together, so that what concerns no other may be left out."""
    return np.any(condition)


def over_nodes(load):
    """Return a load summed over the nodes of a rule, the first axis of arrays; compiled
    code takes one node at a time."""
    return type(load)(*(np.sum(x, 0) for x in load))


FUNCTIONS = (
    sqrt,
    absolute,
    exp,
    floor,
    copysign,
    maximum,
    minimum,
    where,
    log_ratio,
    polynomial,
    combinations,
    gather,
)
ALLOWED = (
    "a formula may use + - * /, < <= > >= == joined by & and |, numbers of the law, "
    "other formulas, and from rft.formulas.vectors "
    + ", ".join(function.__name__ for function in FUNCTIONS)
)
