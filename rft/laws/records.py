"""Force laws as records: numbers, and formulas of these numbers, for both drivers of
the balance.

The record of a law is a NamedTuple of arrays whose class holds the formulas `traction`,
`slopes` and `average`. A closed form, a sum of viscous and dry terms, has exact
averages over an element; any other law is averaged by a quadrature rule. A law whose
traction is no formula (`rft.formulas.vectors.formula`) is computed by NumPy alone."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from typing import Any, NamedTuple

import numpy as np

from rft.core.checks import is_number
from rft.formulas.link import dry, sum_loads, viscous
from rft.formulas.quadrature import (
    QUADRATURE,
    by_nodes,
    nodes_and_weights,
    parse,
    slopes_by_differences,
)
from rft.formulas.vectors import formula, is_formula
from rft.laws.base import (
    cached_if_immutable,
    is_closed,
    require_law,
    term_numbers,
    terms_slopes,
    terms_traction,
)


@formula
def closed_form(law, v_t, v_n, v_w, rounding):
    """Return the exact load of viscous and dry terms."""
    load = viscous(v_t, v_n, v_w, law.viscous[0, 0], law.viscous[0, 1])
    for j in range(len(law.dry)):
        load = sum_loads(
            load,
            dry(v_t, v_n, v_w, rounding, law.dry[j, 0], law.dry[j, 1], law.dry[j, 2]),
        )
    return load


class Terms(NamedTuple):
    """The record of a law in closed form; fields as in `TermNumbers`."""

    viscous: np.ndarray
    dry: np.ndarray
    traction = terms_traction
    slopes = terms_slopes
    average = closed_form


class UncompiledLaw:
    """The record of a law whose traction is no formula."""

    slopes = slopes_by_differences
    average = by_nodes

    def __init__(self, law, nodes: np.ndarray, weights: np.ndarray):
        self.nodes = nodes
        self.weights = weights
        self.traction = law.traction
        if hasattr(law, "slopes"):
            self.slopes = law.slopes


@cached_if_immutable
def record(law, rule: str = "exact") -> Any:
    """Return the record of a law under a rule ("exact", "midpoint:N", "gauss:N");
    ValueError unless it is a law."""
    require_law(law)
    kind, count = rule_for(law, rule)
    if kind == "exact":
        return Terms(*term_numbers(law))
    nodes, weights = (
        x.reshape(1, 1, -1, 1, 1) for x in nodes_and_weights((kind, count))
    )
    if is_closed(law):
        numbers = term_numbers(law)._asdict()
        traction = terms_traction
        slopes = terms_slopes
    elif is_formula(type(law).traction):
        numbers = law_numbers(law)
        traction = type(law).traction
        slopes = getattr(type(law), "slopes", slopes_by_differences)
    else:
        return UncompiledLaw(law, nodes, weights)
    formulas = (("traction", traction), ("slopes", slopes), ("average", by_nodes))
    cls = record_class(type(law).__name__, (*numbers, "nodes", "weights"), formulas)
    return cls(*numbers.values(), nodes, weights)


def law_numbers(law) -> dict[str, np.ndarray | float]:
    """Return the numbers that the formulas of a law read: its ``numbers``, or the
    numbers among its fields."""
    if hasattr(law, "numbers"):
        return law.numbers
    if not is_dataclass(law):
        return {}
    values = {f.name: getattr(law, f.name) for f in fields(law)}
    return {name: float(x) for name, x in values.items() if is_number(x)}


@functools.cache
def record_class(
    name: str, names: tuple[str, ...], formulas: tuple[tuple[str, Callable], ...]
) -> type:
    """Return the class of records with these numbers and formulas; a kernel is compiled
    for each class."""
    cls = NamedTuple(name, [(field, np.ndarray) for field in names])
    for field, function in formulas:
        setattr(cls, field, function)
    return cls


def is_compilable(law_record) -> bool:
    """Return whether a law, given by its record, can be compiled."""
    return isinstance(law_record, tuple)


def rule_for(law, rule: str) -> tuple[str, int]:
    """Return the rule as `rft.formulas.quadrature.parse` does, but QUADRATURE in place
    of "exact" for a law without a closed form."""
    kind, count = parse(rule)
    if kind == "exact" and not is_closed(law):
        return parse(QUADRATURE)
    return kind, count
