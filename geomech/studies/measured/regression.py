"""The connection about a mean gait by regression over all cycles, with errors.

With delta the deviation from the mean gait theta(phi), to first order

    xi = A(phi) alphadot + sum_k dA/dn_k(phi) s_k alphadot,

s_k = n_k . delta, alphadot = thetadot + deltadot. These are the constant, the terms in
delta, in deltadot and in their products of Bittner, Hatton and Revzen (2018), tied by
the A that they share, with all phases regressed at once on Fourier series. Where xi is
not linear in alphadot but homogeneous of degree one, as in sand, the same holds near
the gait, with A = d xi / d alphadot there (Euler's theorem); this A is not the
least-squares A over all directions."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from geomech.mathematics.geometry.representations.tube import Loop, waves

FOLDS = 5  # of the cross-validation over cycles that chooses harmonics
MOST_BLOCKS = 120  # of cycles in the jackknife
MOST_NUMBERS = 20_000_000  # in the matrices of all blocks
SECOND = 2  # harmonics of the terms of the second order in the deviation, at most
LAGS = 8  # blocks over which errors are correlated
# Least relative singular value of a series of A that acts along the gait.
LEAST_SINGULAR = 0.01
CERTAIN = 5.0  # standard errors by which the cycles must vary
# Least deviation across the gait, over joint rates or the gait's size: splines cause as
# much.
LEAST_VARIED = 3e-3
# What varies from cycle to cycle beyond noise: nothing determines A along the gait,
# shapes its slopes as well, rates all of A.
NOTHING = 0
SHAPES = 1
RATES = 2


class Samples(NamedTuple):
    """Samples of complete cycles.

    phase: (N,), of the nearest point of the mean gait. cycle: (N,), integers from 0.
    alpha, rate: (N, d). xi: (N, 3). halves: (alpha, rate) twice, and xi_halves: xi
    twice, with independent noise."""

    phase: np.ndarray
    cycle: np.ndarray
    alpha: np.ndarray
    rate: np.ndarray
    xi: np.ndarray
    halves: tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
    xi_halves: tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True, eq=False)
class Sums:
    """Normal equations of each block of cycles: matrix (B, P, P), right (B, P, 3),
    square (B, 3).

    The first ``terms`` times 2 ``harmonics`` + 1 of the P columns (waves are the last
    index) belong to the connection, the others to terms of the second order. kinds:
    numbers of rates and of deviations, whose products are the terms."""

    matrix: np.ndarray
    right: np.ndarray
    square: np.ndarray
    kinds: tuple[int, int]
    harmonics: int

    @property
    def terms(self) -> int:
        """Number of products of rates and deviations."""
        return self.kinds[0] * self.kinds[1]

    def truncated(self, harmonics: int) -> Sums:
        """Return the equations without higher harmonics of the connection."""
        n_waves = 2 * self.harmonics + 1
        column = np.arange(self.matrix.shape[1])
        is_second_order = column >= self.terms * n_waves
        pick = column[is_second_order | (column % n_waves <= 2 * harmonics)]
        return Sums(
            self.matrix[:, pick][:, :, pick],
            self.right[:, pick],
            self.square,
            self.kinds,
            harmonics,
        )

    @property
    def plain(self) -> Sums:
        """Equations without terms of the second order."""
        n = self.terms * (2 * self.harmonics + 1)
        return replace(self, matrix=self.matrix[:, :n, :n], right=self.right[:, :n])

    def solved(self, weights: np.ndarray) -> np.ndarray:
        """Return solutions (..., P, 3) for weights (..., B) of the blocks."""
        matrix = np.tensordot(weights, self.matrix, 1)
        right = np.tensordot(weights, self.right, 1)
        # Scaled columns are of one size, so that the solution loses fewer digits.
        size = np.sqrt(np.maximum(np.abs(np.einsum("...pp->...p", matrix)), 1e-300))
        scaled = matrix / size[..., :, None] / size[..., None, :]
        return np.linalg.solve(scaled, right / size[..., None]) / size[..., None]

    def residual(self, solution: np.ndarray) -> np.ndarray:
        """Return sums of squares (B, 3) of the residual of xi with a solution (P,
        3)."""
        cross = np.einsum("pi,bpi->bi", solution, self.right)
        fitted = np.einsum("pi,bpi->bi", solution, self.matrix @ solution)
        return self.square - 2 * cross + fitted

    def split(self, solution: np.ndarray, loop: Loop) -> np.ndarray:
        """Return A and its slopes along the normals, (..., 3, d, d, 2 K + 1), from
        solutions (..., P, 3)."""
        d = len(loop.coefficients)
        n_rates, n_deviations = self.kinds
        n_waves = 2 * self.harmonics + 1
        lead = solution.shape[:-2]
        first_order = solution[..., : self.terms * n_waves, :]
        entries = first_order.reshape(*lead, n_rates, n_deviations, n_waves, 3)
        entries = np.moveaxis(entries, -1, -4)
        if n_rates == 1:
            entries = _spread_out(loop, entries[..., 0, :, :])
        missing = (*entries.shape[:-2], d - n_deviations, entries.shape[-1])
        return np.concatenate([entries, np.zeros(missing)], -2)


def _spread_out(loop: Loop, along: np.ndarray) -> np.ndarray:
    """Return the smallest A and slopes (..., 3, d, S, 2 K + 1) with
    A theta' = along (..., 3, S, 2 K + 1).

    They have as many harmonics as ``along`` or the gait, whichever has more.
    Combinations that would need far larger entries across the gait are left out."""
    d = len(loop.coefficients)
    n_waves = max(along.shape[-1], loop.coefficients.shape[1])
    t = 2 * np.pi * np.arange(8 * n_waves) / (8 * n_waves)
    products = np.einsum("td,tw->tdw", loop.shape(t, 1), waves(t, n_waves // 2))
    rows = products.reshape(len(t), -1)
    targets = waves(t, along.shape[-1] // 2)
    least = np.linalg.lstsq(rows, targets, rcond=LEAST_SINGULAR)[0]
    entries = (along @ least.T).reshape(*along.shape[:-1], d, n_waves)
    return np.moveaxis(entries, -2, -3)


def columns(
    loop: Loop, phase, alpha, rate, harmonics: int, varies: int, second: int = SECOND
) -> np.ndarray:
    """Return the regressors (..., N, P) of alpha and rate (..., N, d): alphadot_j and
    s_k alphadot_j times waves in phase (N,), and s_k s_l alphadot_j times ``second``
    harmonics, none if that is -1.

    Where rates do not vary, the rate along the gait stands for alphadot; where nothing
    does, s_k are left out."""
    one = np.ones((*alpha.shape[:-1], 1))
    mean_rate = loop.shape(phase, 1)
    if varies < RATES:
        rate = ((rate * mean_rate).sum(-1) / (mean_rate**2).sum(-1))[..., None]
    if varies == NOTHING:
        return _products(rate, one, waves(phase, harmonics))
    deviation = alpha - loop.shape(phase)
    normal = np.einsum("nik,...ni->...nk", loop.normals(phase), deviation)
    first_order = np.concatenate([one, normal], -1)
    regressors = [_products(rate, first_order, waves(phase, harmonics))]
    if second >= 0:
        k, m = np.triu_indices(normal.shape[-1])
        squares = normal[..., k] * normal[..., m]
        regressors.append(_products(rate, squares, waves(phase, second)))
    return np.concatenate(regressors, -1)


def _products(rate, s, w) -> np.ndarray:
    """Return all products (..., N, d S W) of rates (..., N, d), deviations (..., N, S)
    and waves (N, W)."""
    products = np.einsum("...nj,...ns,nw->...njsw", rate, s, w)
    return products.reshape(*rate.shape[:-1], -1)


def sums(
    loop: Loop,
    samples: Samples,
    harmonics: int,
    varies: int = RATES,
    second: int = SECOND,
) -> Sums:
    """Return the normal equations of blocks of cycles.

    The product of a regressor with itself is the product of its two halves. Their noise
    is independent and causes no bias (instrumental variables); noise in a regressor
    would draw its coefficient to 0."""
    d = samples.alpha.shape[1]
    (alpha_1, rate_1), (alpha_2, rate_2) = samples.halves

    def regressors(rows, alpha, rate):
        return columns(
            loop, samples.phase[rows], alpha, rate, harmonics, varies, second
        )

    first_row = slice(0, 1)
    count = regressors(first_row, samples.alpha[:1], samples.rate[:1]).shape[1]
    most = min(MOST_BLOCKS, max(FOLDS * LAGS, MOST_NUMBERS // count**2))
    matrix = []
    right = []
    square = []
    for block in blocks(samples, most):
        alpha = np.stack([alpha_1[block], alpha_2[block]])
        rate = np.stack([rate_1[block], rate_2[block]])
        one, other = regressors(block, alpha, rate)
        xi = samples.xi[block]
        product = one.T @ other
        matrix.append((product + product.T) / 2)
        right.append((one + other).T @ xi / 2)
        square.append((xi**2).sum(0))
    n_rates = d if varies == RATES else 1
    n_deviations = 1 if varies == NOTHING else d
    return Sums(
        np.array(matrix),
        np.array(right),
        np.array(square),
        (n_rates, n_deviations),
        harmonics,
    )


def blocks(samples: Samples, most: int = MOST_BLOCKS) -> list[slice]:
    """Return slices of single cycles, or of groups of cycles where there are more than
    ``most``."""
    cycles = int(samples.cycle[-1]) + 1
    block = samples.cycle * min(cycles, most) // cycles
    ends = np.searchsorted(block, np.arange(block[-1] + 2))
    return [slice(a, b) for a, b in itertools.pairwise(ends)]


def variation(loop: Loop, samples: Samples) -> int:
    """Return what varies in every direction across the gait beyond noise: RATES, SHAPES
    alone, or NOTHING."""
    normals = loop.normals(samples.phase)
    theta = loop.shape(samples.phase)
    mean_rate = loop.shape(samples.phase, 1)
    rate_along = (samples.rate * mean_rate).sum(-1) / (mean_rate**2).sum(-1)
    rate = rate_along[:, None] * mean_rate

    def across(x):
        return np.einsum("nik,ni->nk", normals, x)

    rates = [across(half_rate - rate) for _, half_rate in samples.halves]
    if _varies_surely(samples, rates, (samples.rate**2).sum()):
        return RATES
    shapes = [across(half_alpha - theta) for half_alpha, _ in samples.halves]
    if _varies_surely(samples, shapes, ((theta - theta.mean(0)) ** 2).sum()):
        return SHAPES
    return NOTHING


def select_joints(
    loop: Loop, samples: Samples, joints: Sequence[int]
) -> tuple[Loop, Samples]:
    """Return the mean gait and the samples of some joints alone."""
    joints = list(joints)
    halves = tuple(
        (alpha[:, joints], rate[:, joints]) for alpha, rate in samples.halves
    )
    selected = samples._replace(
        alpha=samples.alpha[:, joints], rate=samples.rate[:, joints], halves=halves
    )
    return Loop(loop.coefficients[joints]), selected


def _varies_surely(samples: Samples, halves, size: float) -> bool:
    """Return whether the products of two halves (N, d - 1), in which noise cancels, are
    surely positive in all directions. size: sum of squares that the variation is
    compared with."""
    one, other = halves
    products = np.array([one[block].T @ other[block] for block in blocks(samples)])
    _, directions = np.linalg.eigh((products + products.swapaxes(1, 2)).mean(0))
    least = directions[:, 0]
    q = np.einsum("bij,i,j->b", products, least, least)
    noise = CERTAIN * q.std(ddof=1) / np.sqrt(len(q))
    return bool(q.mean() > max(noise, LEAST_VARIED**2 * size / len(q)))


def undetermined_errors(loop: Loop, A: np.ndarray, varies: int) -> np.ndarray:
    """Return errors (E, 3, d, d, 2 K + 1) of the undetermined entries of A across the
    gait and of its slopes, in the form of `Sums.split`.

    Entries of A across the gait have errors as large as A along it, slopes as large as
    that over the gait's size."""
    d = A.shape[1]
    n_waves = A.shape[-1]
    t = 2 * np.pi * np.arange(4 * n_waves) / (4 * n_waves)
    w = waves(t, n_waves // 2)
    rate = loop.shape(t, 1)
    speed = np.linalg.norm(rate, axis=-1)
    along = np.einsum("ijk,tk,tj->ti", A[:, :, 0], w, rate) / speed[:, None]
    size = np.sqrt((along**2).mean(0))
    extent = np.linalg.norm(loop.coefficients[:, 1:])

    # Directions (d, d, 2 K + 1), the last one along the gait, with its harmonics alone.
    normals = loop.normals(t) * speed[:, None, None]
    directions = np.concatenate([normals, rate[..., None]], -1)
    directions = directions / np.sqrt((speed**2).mean())
    fitted = np.linalg.lstsq(w, directions.reshape(len(t), -1), rcond=None)[0].T
    directions = np.moveaxis(fitted.reshape(d, d, n_waves), 1, 0)

    errors = []
    for i, direction, k in itertools.product(range(3), range(d), range(d)):
        is_across = direction < d - 1
        is_slope = k > 0
        if not is_across and not (varies == NOTHING and is_slope):
            continue
        scale = extent if is_slope else 1.0
        error = np.zeros((3, d, d, n_waves))
        error[i, :, k] = directions[direction] * size[i] / scale
        errors.append(error)
    return np.array(errors)


def solution(equations: Sums) -> tuple[np.ndarray, np.ndarray]:
    """Return coefficients (P, 3) and errors (E, P, 3), which are independent and whose
    squares add up to the variance.

    The errors are those of the jackknife over blocks of cycles, each block left out
    once. They are correlated between neighbours: a noisy pose ends one cycle too far
    and begins the next. Correlations fall to 0 over LAGS blocks (Bartlett's weights,
    with which no variance becomes negative; Newey and West 1987). The last error is
    half of the change by terms of the second order: where links begin or cease to
    stick, the series does not end there."""
    count = len(equations.square)
    coefficients = equations.solved(np.ones(count))
    without = np.array([equations.solved(row) for row in 1 - np.eye(count)])
    errors = newey_west_terms(without - coefficients)
    n_first = equations.terms * (2 * equations.harmonics + 1)
    if n_first == len(coefficients):
        return coefficients, errors
    change = np.zeros_like(coefficients)
    plain = equations.plain.solved(np.ones(count))
    change[:n_first] = (coefficients[:n_first] - plain) / 2
    return coefficients, np.concatenate([errors, change[None]])


def newey_west_terms(errors: np.ndarray) -> np.ndarray:
    """Return errors (B + LAGS - 1, ...) whose squares add up to the variance of the sum
    of ``errors`` (B, ...), which are correlated between neighbours."""
    count = len(errors)
    lags = _lags(count)
    lag = np.subtract.outer(np.arange(count + lags - 1), np.arange(count))
    weights = ((lag >= 0) & (lag < lags)) / np.sqrt(lags)
    return np.tensordot(weights, errors, 1)


def _lags(count: int) -> int:
    """Return the number of blocks, of ``count``, over which errors are correlated."""
    return min(LAGS, max(1, count // 8))


def interval_factor(count: int, level: float) -> float:
    """Return the number of standard errors of an interval from ``count`` blocks, by
    Student's t with the degrees of freedom that Bartlett's weights leave."""
    from scipy.stats import t

    degrees = max(2.0, 1.5 * count / _lags(count) - 1)
    return float(t.ppf((1 + level) / 2, degrees))
