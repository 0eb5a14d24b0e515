"""Averages of any law over a straight element by a quadrature rule; `rft.formulas.link`
has the exact averages of closed forms."""

from __future__ import annotations

import re

import numpy as np

from rft.core.refusal import Refusal
from rft.formulas.link import TINY, Load, sum_loads
from rft.formulas.vectors import formula, over_nodes, sqrt

QUADRATURE = "gauss:24"  # in place of "exact" for a law without a closed form
DIFFERENCE = 1e-6  # step of central differences, over the speed


@formula
def slopes_by_differences(law, v_t, v_n, rounding):
    """Return (df_t/dv_t, df_t/dv_n, df_n/dv_t, df_n/dv_n) of a law's traction, by
    central differences."""
    h = DIFFERENCE * sqrt(v_t * v_t + v_n * v_n + rounding * rounding) + TINY
    t1, n1 = law.traction(v_t + h, v_n, rounding)
    t2, n2 = law.traction(v_t - h, v_n, rounding)
    t3, n3 = law.traction(v_t, v_n + h, rounding)
    t4, n4 = law.traction(v_t, v_n - h, rounding)
    a = 0.5 / h
    return a * (t1 - t2), a * (t3 - t4), a * (n1 - n2), a * (n3 - n4)


@formula
def by_nodes(law, v_t, v_n, v_w, rounding):
    """Return the load of a law on an element from its traction and slopes at the nodes
    s in [-1, 1] of its rule, with weights that sum to 1."""
    zero = 0.0 * v_t
    load = Load(zero, zero, zero, zero, zero, zero, zero, zero, zero, zero, zero, zero)
    for j in range(len(law.nodes)):
        s = law.nodes[j, 0]
        w = law.weights[j, 0]
        u_t = v_t + 0.0 * s
        u_n = v_n + s * v_w
        t, n = law.traction(u_t, u_n, rounding)
        tt, tn, nt, nn = law.slopes(u_t, u_n, rounding)
        k = w * s
        load = sum_loads(load, over_nodes(Load(
            w * t, w * tt, w * tn, k * tn,
            w * n, w * nt, w * nn, k * nn,
            k * n, k * nt, k * nn, k * s * nn,
        )))  # fmt: skip
    return load


def nodes_and_weights(rule: tuple[str, int]) -> tuple[np.ndarray, np.ndarray]:
    """Return nodes and weights of a rule: "gauss" (Gauss-Legendre) or "midpoint" (equal
    parts with the velocity of their middle).

    The paper uses midpoints, of order 2. Gauss-Legendre rules converge slowly where the
    pivot lies in the element, for the law has a kink there."""
    kind, count = rule
    if kind == "gauss":
        s, weights = np.polynomial.legendre.leggauss(count)
        return s, weights / 2.0
    return (2.0 * np.arange(count) + 1.0) / count - 1.0, np.full(count, 1.0 / count)


def parse(text: str) -> tuple[str, int]:
    """Return ("exact", 1), ("midpoint", n) or ("gauss", n) from "exact", "midpoint:n",
    "gauss:n"; ValueError for other text."""
    kind, _, count = str(text).partition(":")
    if isinstance(text, str) and text == "exact":
        return "exact", 1
    if (
        kind in ("midpoint", "gauss")
        and re.fullmatch(r"[1-9]\d{0,3}", count)
        and int(count) <= 1000
    ):
        return kind, int(count)
    raise Refusal(
        "loads must be 'exact', 'midpoint:N' or 'gauss:N' with N from 1 to 1000",
        value=str(text)[:60],
    )
