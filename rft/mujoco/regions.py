"""Regions of the ground with media of their own, as a user writes them: "x > 0.5", "0 < x < 1 and y > 0.2 * x"."""

from __future__ import annotations

import ast
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from rft.core.refusal import Refusal, formatted, require
from rft.terradynamics.meshes.zones import EVERYWHERE, Zones

MOST = 100  # planes of all regions
CURE = "write it like 'x > 0.5' or '0 < x < 1 and y > 0.2 * x', x and y in m"


def zones_of(regions: Mapping[str, Any]) -> Zones:
    """Return the zones of regions by their conditions, in order, and of what is left."""
    require(
        isinstance(regions, Mapping),
        "``regions`` must be media by their conditions",
        value=regions,
        instead=CURE,
    )
    planes = [planes_of(text) for text in regions]
    count = sum(map(len, planes))
    require(count <= MOST, f"the regions have {count} boundaries, more than {MOST}")
    first = np.cumsum([0, *map(len, planes), 0]).astype(np.int64)
    return (
        Zones(np.array([plane for one in planes for plane in one], float), first)
        if planes
        else EVERYWHERE
    )


def planes_of(text: str) -> list[tuple[float, float, float]]:
    """Return a, b and c of the planes within which a condition holds, a x + b y > c with a^2 + b^2 = 1."""
    what = f"the region {formatted(text)} is no condition on x and y"
    try:
        tree = ast.parse(text.strip(), mode="eval").body
        parts = (
            tree.values
            if isinstance(tree, ast.BoolOp) and isinstance(tree.op, ast.And)
            else [tree]
        )
        pairs = [pair for part in parts for pair in _greater(part)]
    except (
        SyntaxError,
        ValueError,
        ArithmeticError,
        AttributeError,
        TypeError,
        RecursionError,
        MemoryError,
    ):
        raise Refusal(what, instead=CURE) from None
    planes = []
    for (a, b, c), (p, q, r) in pairs:
        x, y, size = a - p, b - q, math.hypot(a - p, b - q)
        require(0 < size < math.inf and math.isfinite(c - r), what, instead=CURE)
        planes.append((x / size, y / size, (r - c) / size))
    return planes


def _greater(comparison: Any) -> list[tuple[tuple, tuple]]:
    """Return the pairs of expressions of a chain of comparisons, the greater first."""
    if not isinstance(comparison, ast.Compare):
        raise ValueError
    sides, pairs = [_linear(x) for x in (comparison.left, *comparison.comparators)], []
    for sign, left, right in zip(comparison.ops, sides, sides[1:]):
        if not isinstance(sign, ast.Gt | ast.GtE | ast.Lt | ast.LtE):
            raise ValueError
        pairs.append(
            (left, right) if isinstance(sign, ast.Gt | ast.GtE) else (right, left)
        )
    return pairs


def _linear(node: Any) -> tuple[float, float, float]:
    """Return p, q and r of the expression p x + q y + r."""
    if isinstance(node, ast.Name) and node.id in ("x", "y"):
        return (1.0, 0.0, 0.0) if node.id == "x" else (0.0, 1.0, 0.0)
    if (
        isinstance(node, ast.Constant)
        and isinstance(node.value, int | float)
        and not isinstance(node.value, bool)
    ):
        return 0.0, 0.0, float(node.value)
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        return _scaled(-1.0, _linear(node.operand))
    if not isinstance(node, ast.BinOp):
        raise ValueError
    left, right = _linear(node.left), _linear(node.right)
    if isinstance(node.op, ast.Add | ast.Sub):
        p, q, r = right if isinstance(node.op, ast.Add) else _scaled(-1.0, right)
        return left[0] + p, left[1] + q, left[2] + r
    if isinstance(node.op, ast.Mult) and left[:2] == (0.0, 0.0):
        return _scaled(left[2], right)
    if isinstance(node.op, ast.Mult | ast.Div) and right[:2] == (0.0, 0.0):
        return _scaled(
            right[2] if isinstance(node.op, ast.Mult) else 1.0 / right[2], left
        )
    raise ValueError


def _scaled(
    factor: float, expression: tuple[float, float, float]
) -> tuple[float, float, float]:
    p, q, r = expression
    return factor * p, factor * q, factor * r
