"""Force of the medium on straight elements: exact where a closed form exists, by quadrature elsewhere.

An element of unit length slides along itself with speed ``v_t`` and sideways with ``u(s) = v_n + s spin``,
``s`` in [-1, 1] from tail to head, so ``spin`` is its rate of turning times its half length. A load takes
(v_t, v_n, spin), arrays of one shape, and returns the averages over s

    f[0] = <f_t>,  f[1] = <f_n>,  f[2] = <s f_n>

of the drag per unit length, positive along the velocity it opposes, beside their tangent: an array
(3, 4, ...) whose column 0 is f and whose columns 1 to 3 are d f / d (v_t, v_n, spin).

Closed form. With R = sqrt(A^2 + u^2), A^2 = q^2 v_t^2 + eps^2, the end values R1, R2 and S = R1 + R2 give
elliptic coordinates mu = 2 v_n / S, t = 2 spin / S in which A^2 = S^2 (1 - mu^2)(1 - t^2) / 4, and every average
is elementary in mu, t and one function k(t) = (atanh t - t) / t^3:

    <1/R> = (2/S)(1 + t^2 k)    <u/R> = mu    <s u/R> = (1 - mu^2) t h / 2,   h = 1 - (1 - t^2) k.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rft.media.base import Medium, TermLaw, is_closed, require_law

TINY = 1e-300  # keeps 0/0 finite where the element is at rest; far below any speed that can matter
SERIES_BELOW = 0.04  # t^2 below which k is summed; above it atanh t - t loses at most two digits
QUADRATURE = "gauss:24"  # in place of "exact" where a medium has no closed form
SERIES = tuple(1.0 / (2 * j + 3) for j in range(11))  # k = sum_j t^2j / (2j + 3)


# (v_t, v_n, spin, eps) -> (3, 4, n, B)
LoadLaw = Callable[..., np.ndarray]


def k_function(z: np.ndarray, one_minus_z: np.ndarray) -> np.ndarray:
    """k = (atanh t - t) / t^3 for z = t^2 in [0, 1). ``one_minus_z`` is passed for its digits near z = 1."""
    small = np.minimum(z, SERIES_BELOW)
    series = np.full_like(z, SERIES[-1])
    for c in SERIES[-2::-1]:
        series *= small
        series += c
    t = np.sqrt(np.maximum(z, SERIES_BELOW))
    atanh = 0.5 * np.log((1.0 + t) ** 2 / np.maximum(one_minus_z, TINY))
    return np.where(z < SERIES_BELOW, series, (atanh - t) / (t * t * t))


@dataclass(frozen=True)
class Ends:
    """Elliptic coordinates of an element and the pieces all averages share (see the module's heading)."""

    S: np.ndarray
    mu: np.ndarray
    t: np.ndarray
    c_mu: np.ndarray  # 1 - mu^2
    c_t: np.ndarray  # 1 - t^2
    k: np.ndarray
    h: np.ndarray

    @classmethod
    def of(cls, A2: np.ndarray, v_n: np.ndarray, spin: np.ndarray) -> Ends:
        abs_n, abs_spin = np.abs(v_n), np.abs(spin)
        lead = abs_n - abs_spin
        u_near, u_far = np.abs(lead), abs_n + abs_spin
        R_near, R_far = np.sqrt(A2 + u_near * u_near), np.sqrt(A2 + u_far * u_far)
        S = R_near + R_far + TINY
        # S - 2 max(|v_n|, |spin|) as a sum of positive terms: S - 2|v_n| and S - 2|spin| would cancel.
        excess = A2 / (R_near + u_near + TINY) + A2 / (R_far + u_far + TINY)
        inv = 1.0 / S
        mu, t = 2.0 * v_n * inv, 2.0 * spin * inv
        c_mu = (excess + (u_near - lead)) * (1.0 + np.abs(mu)) * inv
        c_t = (excess + (u_near + lead)) * (1.0 + np.abs(t)) * inv
        k = k_function(t * t, c_t)
        return cls(S, mu, t, c_mu, c_t, k, 1.0 - c_t * k)


def exact(medium: Medium) -> LoadLaw:
    """The closed-form load of a medium made of dry and viscous terms (paper Eqs. 2-3 among them).

    Raises ValueError if the medium has a law without such terms, of which `element_load` takes QUADRATURE.
    """
    if not is_closed(medium):
        raise ValueError(f"{type(medium).__name__} has no closed-form link integral: use loads={QUADRATURE!r}")
    terms = sorted(medium.dry, key=lambda term: term[1] == 0.0)  # those with an axial part first
    axial = sum(k_t != 0.0 for _, k_t, _ in terms)
    q, k_t, k_n = np.array(terms).reshape(-1, 3).T
    q2, k_t = (q * q)[:, None, None], k_t[:axial]

    def load(v_t, v_n, spin, eps):
        if not terms:
            out = np.zeros((3, 4, *v_t.shape))
        else:
            out = _dry(Ends.of(q2 * (v_t * v_t) + eps * eps, v_n, spin), v_t, q2 * v_t, k_t, k_n)
        if any(medium.viscous):
            _add_viscous(out, medium.viscous, v_t, v_n, spin)
        return out

    return load


def _add_viscous(out, coefficients, v_t, v_n, spin) -> None:
    c_t, c_n = coefficients
    for i, (c, x) in enumerate(((c_t, v_t), (c_n, v_n), (c_n / 3.0, spin))):
        out[i, 0] += c * x
        out[i, i + 1] += c


def _dry(e: Ends, v_t, q2_v_t, k_t, k_n) -> np.ndarray:
    """Sum over terms of f_t = k_t v_t / R, f_n = k_n u / R; ``e`` and ``q2_v_t`` = q^2 v_t have the terms on axis 0."""
    out = np.empty((3, 4, *v_t.shape))
    two_S = 2.0 / e.S
    mt = e.mu * e.t
    p = 1.0 / (e.c_mu + e.mu * e.mu * e.c_t + TINY)  # 1 / (1 - mu^2 t^2) = S^2 / (4 R1 R2)
    cmp = e.c_mu * p
    four_S2 = two_S * two_S
    per_c_t = four_S2 / (e.c_t + TINY)
    by_n = -four_S2 * e.mu * p  # d<1/R>/dv_n = -<u/R^3>
    by_spin = per_c_t * e.t * (e.h - cmp)  # d<1/R>/dspin = -<s u/R^3>
    first = k_t.size
    rows = np.empty((first, 4, *v_t.shape))
    if first:
        inverse = two_S[:first] * (1.0 + e.t[:first] * e.t[:first] * e.k[:first])  # <1/R>
        by_t = -q2_v_t[:first] * per_c_t[:first] * two_S[:first] * p[:first]  # -q^2 v_t <1/R^3>
        np.multiply(v_t, inverse, out=rows[:, 0])
        np.add(inverse, v_t * by_t, out=rows[:, 1])
        np.multiply(v_t, by_n[:first], out=rows[:, 2])
        np.multiply(v_t, by_spin[:first], out=rows[:, 3])
    _weigh(k_t, rows, out[0])
    rows = np.empty((k_n.size, 2, 4, *v_t.shape))
    across, turning = rows[:, 0], rows[:, 1]
    across[:, 0] = e.mu
    np.multiply(q2_v_t, by_n, out=across[:, 1])
    np.multiply(two_S, cmp, out=across[:, 2])
    np.multiply(-mt, across[:, 2], out=across[:, 3])
    np.multiply(0.5 * e.c_mu * e.t, e.h, out=turning[:, 0])
    np.multiply(q2_v_t, by_spin, out=turning[:, 1])
    turning[:, 2] = across[:, 3]
    np.multiply(two_S * e.c_mu, p - e.h, out=turning[:, 3])
    _weigh(k_n, rows, out[1:])
    return out


def _weigh(k: np.ndarray, rows: np.ndarray, out: np.ndarray) -> None:
    """To ``out``: the sum over the terms on axis 0 of k times rows."""
    np.matmul(k, rows.reshape(k.size, -1) if k.size else np.zeros((0, out.size)), out=out.reshape(-1))


def quadrature(medium: Medium, nodes: np.ndarray, weights: np.ndarray) -> LoadLaw:
    """The load by a quadrature rule on [-1, 1] (weights summing to 1), for any medium with a `traction`."""
    s, weight = (np.asarray(x, float)[:, None, None] for x in (nodes, weights))
    if is_closed(medium) and medium.dry and any(medium.viscous):
        return _sum(quadrature(_dry_part(medium), nodes, weights), medium)

    def load(v_t, v_n, spin, eps):
        u = v_n + spin * s
        v_t = np.broadcast_to(v_t, u.shape)
        (f_t, f_n), slopes = _pointwise(medium, v_t, u, eps)
        (tt, tn), (nt, nn) = slopes

        def mean(x):
            return (weight * x).sum(0)

        rows = (f_t, tt, tn, s * tn), (f_n, nt, nn, s * nn), (s * f_n, s * nt, s * nn, s * s * nn)
        return np.array([[mean(x) for x in row] for row in rows])

    return load


def _dry_part(medium: Medium) -> Medium:
    part = TermLaw()
    part.dry = medium.dry
    return part


def _sum(dry: LoadLaw, medium: Medium) -> LoadLaw:
    """The load of dry terms with the medium's viscous ones, which are polynomials in s and need no rule."""

    def load(v_t, v_n, spin, eps):
        out = dry(v_t, v_n, spin, eps)
        _add_viscous(out, medium.viscous, v_t, v_n, spin)
        return out

    return load


def _pointwise(medium, v_t, v_n, eps):
    """Traction and its 2 x 2 derivative; by central differences where the medium offers no `derivatives`."""
    value = medium.traction(v_t, v_n, eps)
    if hasattr(medium, "derivatives"):
        return value, medium.derivatives(v_t, v_n, eps)
    h = 1e-6 * np.sqrt(v_t * v_t + v_n * v_n + eps * eps) + TINY
    along = [(p - q) / (2 * h) for p, q in zip(medium.traction(v_t + h, v_n, eps), medium.traction(v_t - h, v_n, eps))]
    across = [(p - q) / (2 * h) for p, q in zip(medium.traction(v_t, v_n + h, eps), medium.traction(v_t, v_n - h, eps))]
    return value, ((along[0], across[0]), (along[1], across[1]))


def midpoint(medium: Medium, segments: int) -> LoadLaw:
    """Each element cut into equal segments that move like their midpoints: the paper's way. Order 2 in 1/segments."""
    nodes = (2.0 * np.arange(segments) + 1.0) / segments - 1.0
    return quadrature(medium, nodes, np.full(segments, 1.0 / segments))


def gauss(medium: Medium, nodes: int) -> LoadLaw:
    """Gauss-Legendre nodes on each element; slow to converge where the pivot lies in the element (the law has a kink there)."""
    x, weights = np.polynomial.legendre.leggauss(nodes)
    return quadrature(medium, x, weights / 2.0)


def parse(how: str) -> tuple[str, int]:
    """('exact', 1), ('midpoint', n) or ('gauss', n) from 'exact', 'midpoint:n', 'gauss:n'. ValueError for other text."""
    kind, _, count = str(how).partition(":")
    if isinstance(how, str) and how == "exact":
        return "exact", 1
    if kind in ("midpoint", "gauss") and re.fullmatch(r"[1-9]\d{0,3}", count) and int(count) <= 1000:
        return kind, int(count)
    raise ValueError(f"loads must be 'exact', 'midpoint:N' or 'gauss:N' with N from 1 to 1000, got {str(how)[:60]!r}")


def rule_for(medium: Medium, how: str) -> tuple[str, int]:
    """As `parse`, but for QUADRATURE where "exact" is asked of a medium without a closed form."""
    kind, count = parse(how)
    return (kind, count) if kind != "exact" or is_closed(medium) else parse(QUADRATURE)


def element_load(medium: Medium, how: str = "exact") -> LoadLaw:
    """The load of a medium on an element by `rule_for`; ValueError for what is no medium."""
    require_law(medium)
    kind, count = rule_for(medium, how)
    if kind == "exact":
        return exact(medium)
    return {"midpoint": midpoint, "gauss": gauss}[kind](medium, count)
