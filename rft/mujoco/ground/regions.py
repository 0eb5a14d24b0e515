"""Regions of the ground with media of their own, as a user writes them: "x > 0.5", "0 <
x < 1 and y > 0.2 * x"."""

from __future__ import annotations

import ast
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from rft.core.refusal import Refusal, formatted, require
from rft.terradynamics.meshes.forces.zones import EVERYWHERE, Zones

MAX_PLANES = 100  # of all regions
CURE = (
    "write a condition such as 'x > 0.5' or '0 < x < 1 and y > 0.2 * x', with x and y "
    "in m"
)
UNREADABLE = (  # what parsing and evaluating a user's text may raise
    SyntaxError,
    ValueError,
    ArithmeticError,
    AttributeError,
    TypeError,
    RecursionError,
    MemoryError,
)

Linear = tuple[float, float, float]  # p, q and r of the expression p x + q y + r


def parse_zones(regions: Mapping[str, Any]) -> Zones:
    """Return the zones of regions by their conditions, in order, and of the remaining
    ground."""
    require(
        isinstance(regions, Mapping),
        "``regions`` must map conditions to media",
        value=regions,
        instead=CURE,
    )
    if not regions:
        return EVERYWHERE
    planes = [parse_planes(text) for text in regions]
    counts = [len(own) for own in planes]
    total = sum(counts)
    require(
        total <= MAX_PLANES,
        f"the regions have {total} boundaries, more than {MAX_PLANES}",
    )
    # The remaining ground has no planes.
    first = np.cumsum([0, *counts, 0]).astype(np.int64)
    return Zones(np.concatenate(planes), first)


def parse_planes(text: str) -> list[Linear]:
    """Return a, b and c of the planes within which a condition holds, a x + b y > c
    with a^2 + b^2 = 1."""
    fault = f"the region {formatted(text)} is not a condition on x and y"
    try:
        pairs = _pairs_of_sides(text)
    except UNREADABLE:
        raise Refusal(fault, instead=CURE) from None
    planes = []
    for (a, b, c), (p, q, r) in pairs:
        size = math.hypot(a - p, b - q)
        require(0 < size < math.inf and math.isfinite(c - r), fault, instead=CURE)
        planes.append(((a - p) / size, (b - q) / size, (r - c) / size))
    return planes


def _pairs_of_sides(text: str) -> list[tuple[Linear, Linear]]:
    """Return the two sides of all inequalities of a condition, the greater first; some
    error of `UNREADABLE` for other text."""
    tree = ast.parse(text.strip(), mode="eval").body
    comparisons = [tree]
    if isinstance(tree, ast.BoolOp) and isinstance(tree.op, ast.And):
        comparisons = tree.values
    pairs = []
    for comparison in comparisons:
        pairs += _sides_of_chain(comparison)
    return pairs


def _sides_of_chain(comparison: Any) -> list[tuple[Linear, Linear]]:
    """Return the pairs of sides of a chain of comparisons, the greater first."""
    if not isinstance(comparison, ast.Compare):
        raise ValueError
    nodes = comparison.left, *comparison.comparators
    sides = [_linear(node) for node in nodes]
    pairs = []
    for sign, left, right in zip(comparison.ops, sides, sides[1:]):
        if isinstance(sign, ast.Gt | ast.GtE):
            pairs.append((left, right))
        elif isinstance(sign, ast.Lt | ast.LtE):
            pairs.append((right, left))
        else:
            raise ValueError
    return pairs


def _linear(node: Any) -> Linear:
    """Return p, q and r of the expression p x + q y + r; ValueError for another."""
    match node:
        case ast.Name(id="x"):
            return 1.0, 0.0, 0.0
        case ast.Name(id="y"):
            return 0.0, 1.0, 0.0
        case ast.Constant(value=bool()):
            raise ValueError
        case ast.Constant(value=int() | float() as number):
            return 0.0, 0.0, float(number)
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return _scaled(-1.0, _linear(operand))
        case ast.BinOp():
            return _combined(node.op, _linear(node.left), _linear(node.right))
    raise ValueError


def _combined(operator: ast.operator, left: Linear, right: Linear) -> Linear:
    """Return a sum, a difference, or a product or quotient with a number; ValueError
    for other operators."""
    match operator:
        case ast.Add():
            return _sum(left, right)
        case ast.Sub():
            return _sum(left, _scaled(-1.0, right))
        case ast.Mult() if _is_number(left):
            return _scaled(left[2], right)
        case ast.Mult() if _is_number(right):
            return _scaled(right[2], left)
        case ast.Div() if _is_number(right):
            return _scaled(1.0 / right[2], left)
    raise ValueError


def _is_number(expression: Linear) -> bool:
    return expression[:2] == (0.0, 0.0)


def _sum(left: Linear, right: Linear) -> Linear:
    return left[0] + right[0], left[1] + right[1], left[2] + right[2]


def _scaled(factor: float, expression: Linear) -> Linear:
    p, q, r = expression
    return factor * p, factor * q, factor * r
