"""The connection about a mean gait by regression over all cycles, with errors.

With delta the deviation from the mean gait theta(phi), to first order xi = A(phi) alphadot + sum_k dA/dn_k(phi) s_k
alphadot, s_k = n_k . delta, alphadot = thetadot + deltadot: the constant, the terms in delta, in deltadot and in their
products of Bittner, Hatton and Revzen (2018), tied by the A that they share, with all phases regressed at once on
Fourier series. Where xi is not linear in alphadot but homogeneous of degree one, as in sand, the same holds near the
gait, with A = d xi / d alphadot at it (Euler's theorem); this A is not the least-squares A over all directions."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from geomech.geometry.tube import Loop, waves

FOLDS = 5  # of the cross-validation over cycles that chooses harmonics
MOST_BLOCKS = 120  # of cycles in the jackknife
MOST_NUMBERS = 20_000_000  # of all their matrices
SECOND = 2  # harmonics of the terms of the second order in the deviation, at most
LAGS = 8  # blocks over which errors are correlated
CROSSWISE = (
    0.01  # least singular value, relative, of a series of A acting along the gait
)
CERTAIN = 5.0  # standard errors by which the cycles must vary
LEAST_VARIED = 3e-3  # least deviation across the gait, over joint rates or the gait's size: splines cause as much
NOTHING, SHAPES, RATES = range(
    3
)  # what varies from cycle to cycle beyond noise: it determines A along the gait, its slopes, all of A


class Samples(NamedTuple):
    """Samples of complete cycles.

    phase: (N,), of the nearest point of the mean gait. cycle: (N,), integers from 0. alpha, rate: (N, d). xi: (N, 3).
    halves: (alpha, rate) twice, and xi_halves: xi twice, with independent noise."""

    phase: np.ndarray
    cycle: np.ndarray
    alpha: np.ndarray
    rate: np.ndarray
    xi: np.ndarray
    halves: tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
    xi_halves: tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True, eq=False)
class Sums:
    """Normal equations of each block of cycles: matrix (B, P, P), right (B, P, 3), square (B, 3).

    The first ``terms`` times 2 ``harmonics`` + 1 of the P columns (waves are the last index) belong to the connection,
    the others to terms of the second order. kinds: numbers of rates and of deviations whose products the terms are."""

    matrix: np.ndarray
    right: np.ndarray
    square: np.ndarray
    kinds: tuple[int, int]
    harmonics: int

    @property
    def terms(self) -> int:
        return self.kinds[0] * self.kinds[1]

    def truncated(self, harmonics: int) -> Sums:
        """Return the equations without higher harmonics of the connection."""
        wide, all_columns = 2 * self.harmonics + 1, np.arange(self.matrix.shape[1])
        pick = all_columns[
            (all_columns >= self.terms * wide) | (all_columns % wide <= 2 * harmonics)
        ]
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
        first = self.terms * (2 * self.harmonics + 1)
        return replace(
            self, matrix=self.matrix[:, :first, :first], right=self.right[:, :first]
        )

    def solved(self, weights: np.ndarray) -> np.ndarray:
        """Return solutions (..., P, 3) for weights (..., B) of the blocks."""
        matrix, right = (
            np.tensordot(weights, self.matrix, 1),
            np.tensordot(weights, self.right, 1),
        )
        size = np.sqrt(np.maximum(np.abs(np.einsum("...pp->...p", matrix)), 1e-300))
        scaled = matrix / size[..., :, None] / size[..., None, :]
        return np.linalg.solve(scaled, right / size[..., None]) / size[..., None]

    def residual(self, solution: np.ndarray) -> np.ndarray:
        """Return sums of squares (B, 3) of the residual of xi with a solution (P, 3)."""
        cross = np.einsum("pi,bpi->bi", solution, self.right)
        return (
            self.square
            - 2 * cross
            + np.einsum("pi,bpi->bi", solution, self.matrix @ solution)
        )

    def split(self, solution: np.ndarray, loop: Loop) -> np.ndarray:
        """Return A and its slopes along the normals, (..., 3, d, d, 2 K + 1), from solutions (..., P, 3)."""
        wide, d = 2 * self.harmonics + 1, len(loop.coefficients)
        solution = solution[..., : self.terms * wide, :].reshape(
            *solution.shape[:-2], *self.kinds, wide, 3
        )
        solution = np.moveaxis(solution, -1, -4)
        if self.kinds[0] == 1:
            solution = _spread_out(loop, solution[..., 0, :, :])
        none = np.zeros((*solution.shape[:-2], d - self.kinds[1], solution.shape[-1]))
        return np.concatenate([solution, none], -2)


def _spread_out(loop: Loop, along: np.ndarray) -> np.ndarray:
    """Return the smallest A and slopes (..., 3, d, S, 2 K + 1) with A theta' = along (..., 3, S, 2 K + 1).

    They have as many harmonics as ``along`` or the gait, whichever has more. Combinations that would need far larger
    entries across the gait are left out."""
    d, wide = len(loop.coefficients), max(along.shape[-1], loop.coefficients.shape[1])
    t = 2 * np.pi * np.arange(8 * wide) / (8 * wide)
    rows = np.einsum("td,tw->tdw", loop.shape(t, 1), waves(t, wide // 2)).reshape(
        len(t), -1
    )
    least = np.linalg.lstsq(rows, waves(t, along.shape[-1] // 2), rcond=CROSSWISE)[0]
    return np.moveaxis((along @ least.T).reshape(*along.shape[:-1], d, wide), -2, -3)


def columns(
    loop: Loop, phase, alpha, rate, harmonics: int, varies: int, second: int = SECOND
) -> np.ndarray:
    """Return the regressors (..., N, P) of alpha and rate (..., N, d): alphadot_j and s_k alphadot_j times waves in phase
    (N,), and s_k s_l alphadot_j times ``second`` harmonics, none if that is -1.

    Where not all varies, the rate along the gait stands for alphadot; where nothing does, s_k are left out."""
    one, mean = np.ones((*alpha.shape[:-1], 1)), loop.shape(phase, 1)
    if varies < RATES:
        rate = ((rate * mean).sum(-1) / (mean**2).sum(-1))[..., None]
    if varies == NOTHING:
        return _times(rate, one, waves(phase, harmonics))
    normal = np.einsum(
        "nik,...ni->...nk", loop.normals(phase), alpha - loop.shape(phase)
    )
    k, m = np.triu_indices(normal.shape[-1])
    groups = (
        (np.concatenate([one, normal], -1), harmonics),
        (normal[..., k] * normal[..., m], second),
    )
    return np.concatenate(
        [_times(rate, s, waves(phase, h)) for s, h in groups if h >= 0], -1
    )


def _times(rate, s, w) -> np.ndarray:
    """Return all products (..., N, d S W) of rates (..., N, d), deviations (..., N, S) and waves (N, W)."""
    return np.einsum("...nj,...ns,nw->...njsw", rate, s, w).reshape(
        *rate.shape[:-1], -1
    )


def sums(
    loop: Loop,
    samples: Samples,
    harmonics: int,
    varies: int = RATES,
    second: int = SECOND,
) -> Sums:
    """Return the normal equations of blocks of cycles.

    The product of a regressor with itself is that of its two halves. Their noise is independent and biases nothing
    (instrumental variables); noise in a regressor would draw its coefficient to 0."""
    d = samples.alpha.shape[1]
    count = columns(
        loop,
        *(x[:1] for x in (samples.phase, samples.alpha, samples.rate)),
        harmonics,
        varies,
        second,
    ).shape[1]
    most = min(MOST_BLOCKS, max(FOLDS * LAGS, MOST_NUMBERS // count**2))
    products = []
    for block in blocks(samples, most):
        alpha, rate = (
            np.stack([x[block] for x in both]) for both in zip(*samples.halves)
        )
        one, other = columns(
            loop, samples.phase[block], alpha, rate, harmonics, varies, second
        )
        product, xi = one.T @ other, samples.xi[block]
        products.append(
            ((product + product.T) / 2, (one + other).T @ xi / 2, (xi**2).sum(0))
        )
    kinds = d if varies == RATES else 1, 1 if varies == NOTHING else d
    return Sums(*map(np.array, zip(*products)), kinds, harmonics)


def blocks(samples: Samples, most: int = MOST_BLOCKS) -> list[slice]:
    """Return slices of single cycles, or of groups of cycles where there are more than ``most``."""
    cycles = int(samples.cycle[-1]) + 1
    block = samples.cycle * min(cycles, most) // cycles
    ends = np.searchsorted(block, np.arange(block[-1] + 2))
    return [slice(a, b) for a, b in itertools.pairwise(ends)]


def varied(loop: Loop, samples: Samples) -> int:
    """Return what varies in every direction across the gait beyond noise: RATES, SHAPES alone, or NOTHING."""
    normal, theta, mean = (
        loop.normals(samples.phase),
        loop.shape(samples.phase),
        loop.shape(samples.phase, 1),
    )
    rate_along = (samples.rate * mean).sum(-1) / (mean**2).sum(-1)
    across = lambda x: np.einsum("nik,ni->nk", normal, x)
    if _sure(
        samples,
        [across(u - rate_along[:, None] * mean) for _, u in samples.halves],
        (samples.rate**2).sum(),
    ):
        return RATES
    size = ((theta - theta.mean(0)) ** 2).sum()
    return (
        SHAPES
        if _sure(samples, [across(x - theta) for x, _ in samples.halves], size)
        else NOTHING
    )


def of_joints(
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


def _sure(samples: Samples, halves, size: float) -> bool:
    """Return whether the products of two halves (N, d - 1), in which noise cancels, are surely positive in all
    directions."""
    one, other = halves
    each = np.array([one[block].T @ other[block] for block in blocks(samples)])
    least = np.linalg.eigh((each + each.swapaxes(1, 2)).mean(0))[1][:, 0]
    q = np.einsum("bij,i,j->b", each, least, least)
    return bool(
        q.mean()
        > max(
            CERTAIN * q.std(ddof=1) / np.sqrt(len(q)), LEAST_VARIED**2 * size / len(q)
        )
    )


def unknown(loop: Loop, A: np.ndarray, varies: int) -> np.ndarray:
    """Return errors (E, 3, d, d, 2 K + 1) of the undetermined entries of A across the gait and of its slopes, in the
    form of `Sums.split`.

    They are as large as A along the gait, and as that over the gait's size."""
    d, wide = A.shape[1], A.shape[-1]
    t = 2 * np.pi * np.arange(4 * wide) / (4 * wide)
    rate = loop.shape(t, 1)
    speed = np.linalg.norm(rate, axis=-1)
    along = (
        np.einsum("ijk,tk,tj->ti", A[:, :, 0], waves(t, wide // 2), rate)
        / speed[:, None]
    )
    size, extent = np.sqrt((along**2).mean(0)), np.linalg.norm(loop.coefficients[:, 1:])
    directions = np.concatenate(
        [loop.normals(t) * speed[:, None, None], rate[..., None]], -1
    ) / np.sqrt((speed**2).mean())
    directions = np.linalg.lstsq(
        waves(t, wide // 2), directions.reshape(len(t), -1), rcond=None
    )[0].T  # no more harmonics than the gait
    directions, errors = np.moveaxis(directions.reshape(d, d, wide), 1, 0), []
    for i, (direction, k) in itertools.product(
        range(3), itertools.product(range(d), range(d))
    ):
        if direction < d - 1 or (
            varies == NOTHING and k > 0
        ):  # the last direction is along the gait, k = 0 is A itself
            errors.append(np.zeros((3, d, d, wide)))
            errors[-1][i, :, k] = (
                directions[direction] * size[i] / (extent if k else 1.0)
            )
    return np.array(errors)


def solution(equations: Sums) -> tuple[np.ndarray, np.ndarray]:
    """Return coefficients (P, 3) and errors (E, P, 3), which are independent and whose squares add up to the variance.

    The errors are those of the jackknife over blocks of cycles (each block left out in turn), correlated between
    neighbours: noise of a pose ends one cycle too far and begins the next. Correlations fall to 0 over LAGS blocks
    (Bartlett's weights, by which no variance becomes negative; Newey and West 1987). The last error is half of the
    change by terms of the second order: where links begin or cease to stick, the series does not end there."""
    count, first = (
        len(equations.square),
        equations.terms * (2 * equations.harmonics + 1),
    )
    coefficients = equations.solved(np.ones(count))
    without = np.array([equations.solved(row) for row in 1 - np.eye(count)])
    errors = lagged(without - coefficients)
    if first == len(coefficients):
        return coefficients, errors
    plain = equations.plain.solved(np.ones(count))
    change = (
        np.concatenate(
            [coefficients[:first] - plain, np.zeros_like(coefficients[first:])]
        )
        / 2
    )
    return coefficients, np.concatenate([errors, change[None]])


def lagged(errors: np.ndarray) -> np.ndarray:
    """Return errors (B + LAGS - 1, ...) whose squares add up to the variance of the sum of ``errors`` (B, ...), which
    are correlated between neighbours."""
    count = len(errors)
    lags = _lags(count)
    behind = np.subtract.outer(np.arange(count + lags - 1), np.arange(count))
    return np.tensordot(((behind >= 0) & (behind < lags)) / np.sqrt(lags), errors, 1)


def _lags(count: int) -> int:
    return min(LAGS, max(1, count // 8))


def factor(count: int, level: float) -> float:
    """Return the number of standard errors of an interval from so many blocks, by Student's t with the degrees of
    freedom that Bartlett's weights leave."""
    from scipy.stats import t

    return float(t.ppf((1 + level) / 2, max(2.0, 1.5 * count / _lags(count) - 1)))
