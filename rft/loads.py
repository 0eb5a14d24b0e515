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

import numpy as np

from rft.media.base import Medium, TermLaw, is_closed, require_law

TINY = 1e-300  # keeps 0/0 finite where the element is at rest; far below any speed that can matter
SERIES_BELOW = 1.0 / 9.0  # t^2 below which k is a polynomial; above it atanh t - t loses at most one digit
QUADRATURE = "gauss:24"  # in place of "exact" where a medium has no closed form


# (v_t, v_n, spin, eps) -> (3, 4, n, B)
LoadLaw = Callable[..., np.ndarray]


def _polynomial(count: int = 12) -> tuple[float, ...]:
    """Coefficients of k = sum_j t^2j / (2j + 3) in powers of t^2 below SERIES_BELOW, to 1e-17: through Chebyshev's points."""
    k = lambda z: sum(z**j / (2 * j + 3) for j in range(40))
    series = np.polynomial.Chebyshev.interpolate(k, count - 1, domain=[0.0, SERIES_BELOW])
    return tuple(map(float, series.convert(kind=np.polynomial.Polynomial).coef))


SERIES = _polynomial()
FOURS = np.array(SERIES).reshape(3, 4)  # of powers 0 to 3, times t^8 to the power of the row


def k_function(z: np.ndarray, one_minus_z: np.ndarray) -> np.ndarray:
    """k = (atanh t - t) / t^3 for z = t^2 in [0, 1). ``one_minus_z`` is passed for its digits near z = 1."""
    powers = np.empty((4, z.size))
    powers[0] = 1.0
    np.minimum(z.ravel(), SERIES_BELOW, out=powers[1])
    np.multiply(powers[1], powers[1], out=powers[2])
    np.multiply(powers[1], powers[2], out=powers[3])
    fourth = powers[2] * powers[2]
    low, middle, high = FOURS @ powers
    high *= fourth
    high += middle
    high *= fourth
    high += low
    far = np.maximum(z, SERIES_BELOW)
    t = np.sqrt(far)
    atanh = 1.0 + t
    atanh *= atanh
    atanh /= np.maximum(one_minus_z, TINY)
    np.log(atanh, out=atanh)
    atanh *= 0.5
    atanh -= t
    far *= t
    atanh /= far
    return np.where(z < SERIES_BELOW, high.reshape(z.shape), atanh)


def exact(medium: Medium) -> LoadLaw:
    """The closed-form load of a medium made of dry and viscous terms (paper Eqs. 2-3 among them).

    Raises ValueError if the medium has a law without such terms, of which `element_load` takes QUADRATURE.
    """
    if not is_closed(medium):
        raise ValueError(f"{type(medium).__name__} has no closed-form link integral: use loads={QUADRATURE!r}")
    q2, weights = _weights(medium.dry) if medium.dry else (None, None)

    def load(v_t, v_n, spin, eps):
        out = np.zeros((3, 4, *v_t.shape)) if weights is None else _dry(v_t, np.array([v_n, spin]), eps, q2, weights)
        if any(medium.viscous):
            _add_viscous(out, medium.viscous, v_t, v_n, spin)
        return out

    return load


PIECES = 9  # of a term's load, in `_dry`


def _weights(terms) -> tuple[np.ndarray, np.ndarray]:
    """q^2 (T, 1, 1) and what the pieces of each term are weighed with in its load: (12, PIECES T)."""
    q, k_t, k_n = np.array(terms).T
    q2, weights = q * q, np.zeros((3, 4, PIECES, len(q)))
    for row, column, piece, weight in (
        (0, 0, 0, k_t), (0, 1, 1, k_t * q2), (0, 2, 2, -k_t), (0, 3, 3, k_t),
        (1, 0, 4, k_n), (1, 1, 2, -k_n * q2), (1, 2, 5, k_n), (1, 3, 6, -k_n),
        (2, 0, 7, 0.5 * k_n), (2, 1, 3, k_n * q2), (2, 2, 6, -k_n), (2, 3, 8, k_n),
    ):  # fmt: skip
        weights[row, column, piece] = weight
    return q2[:, None, None], weights.reshape(12, -1)


def _add_viscous(out, coefficients, v_t, v_n, spin) -> None:
    c_t, c_n = coefficients
    for i, (c, x) in enumerate(((c_t, v_t), (c_n, v_n), (c_n / 3.0, spin))):
        out[i, 0] += c * x
        out[i, i + 1] += c


def _dry(v_t, across, eps, q2, weights) -> np.ndarray:
    """The sum over terms of f_t = k_t v_t / R, f_n = k_n u / R; across: (v_n, spin). Terms are on the axis before elements.
    In place where it can be, and all terms at once: where batches are small every call counts, where they are large memory."""
    squares = v_t * v_t
    A2 = q2 * squares
    A2 += eps * eps
    abs_n, abs_spin = np.abs(across)
    lead = abs_n - abs_spin
    u, over = np.empty((2, 2, 1, *v_t.shape))
    np.abs(lead, out=u[0, 0])  # at the nearer end
    np.add(abs_n, abs_spin, out=u[1, 0])  # and the farther one
    R = u * u
    R = R + A2
    np.sqrt(R, out=R)
    R += TINY
    two_S = R[0] + R[1]
    np.divide(2.0, two_S, out=two_S)
    R += u
    np.divide(A2, R, out=R)
    # S - 2 max(|v_n|, |spin|) as a sum of positive terms: S - 2|v_n| and S - 2|spin| would cancel.
    excess = R[0] + R[1]
    excess *= 0.5
    ends = across[:, None] * two_S
    np.maximum(lead, 0.0, out=over[1, 0])
    np.subtract(over[1, 0], lead, out=over[0, 0])
    c = over + excess
    c *= two_S
    np.abs(ends, out=R)
    R += 1.0
    c *= R
    (mu, t), (c_mu, c_t) = ends, c
    return _load(v_t, squares, two_S, mu, t, c_mu, c_t, weights)


def _load(v_t, squares, two_S, mu, t, c_mu, c_t, weights) -> np.ndarray:
    """The load from an element's elliptic coordinates (see the module's heading); c = 1 - mu^2, 1 - t^2."""
    pieces = np.empty((PIECES, *mu.shape))
    mean, cube, by_n, by_spin, copied, normal, cross, turning, swing = pieces
    z = t * t
    k = k_function(z, c_t)
    p = mu * mu
    p *= c_t
    p += c_mu
    p += TINY
    np.divide(1.0, p, out=p)  # 1 / (1 - mu^2 t^2) = S^2 / (4 R1 R2)
    h = c_t * k
    np.subtract(1.0, h, out=h)
    four = two_S * two_S
    np.add(c_t, TINY, out=cube)
    np.divide(four, cube, out=cube)
    np.multiply(c_mu, p, out=normal)
    np.subtract(h, normal, out=by_spin)
    by_spin *= t
    by_spin *= cube  # <s u/R^3>, negative
    cube *= two_S
    cube *= p  # <1/R^3>
    normal *= two_S
    np.multiply(z, k, out=mean)
    mean += 1.0
    mean *= two_S  # <1/R>
    np.multiply(four, mu, out=by_n)
    by_n *= p  # <u/R^3>
    copied[...] = mu
    np.multiply(normal, mu, out=cross)
    cross *= t
    np.multiply(c_mu, t, out=turning)
    turning *= h
    np.subtract(p, h, out=swing)
    swing *= c_mu
    swing *= two_S
    out = (weights @ pieces.reshape(weights.shape[1], -1)).reshape(3, 4, *v_t.shape)
    squares *= out[0, 1]
    np.subtract(out[0, 0], squares, out=out[0, 1])
    out[0, 0] *= v_t
    out[0, 2:] *= v_t
    out[1:, 1] *= v_t
    return out


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
