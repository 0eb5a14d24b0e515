"""Loops in shape space as finite Fourier series.

The parameters of a loop are p (2 K + 1, joints), rad: the centre, then cosines and
sines of the harmonics 1, 1, 2, 2 ... K. Shapes and rates at the phases are linear in
them. Here are their limits, initial guesses, and a test of when two loops are the
same."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from geomech.mathematics.gaits import Fourier, Gait

DENSE = 1024  # phases at which limits hold and loops are compared
TOUCHING = 5e-3  # of a limit: a loop this near touches it
NARROWER = 1e-4  # of a limit: a curve may exceed it by this between phases
SMALL = 0.05  # of the range: a smaller start is enlarged
ENLARGED = 0.3  # of the range: size of a start after that
ROUNDING = 1e-11  # of the largest coefficient: a smaller one is rounding
SAME = 0.02  # of its size: largest distance between two loops that count as the same
# Sizes of initial travelling waves, relative to the range, and lags between joints.
FIRST_SIZE = 0.7
SIZES = (0.4, 0.9)
LAGS = (np.pi / 2, -np.pi / 2, 2 * np.pi / 3, np.pi / 4)


def _square(i: int, j: int) -> tuple:
    """Return the corners of a square of side 0.7 about the middle of the quadrant with
    the signs i and j."""
    corners = ((1, 1), (-1, 1), (-1, -1), (1, -1))
    return tuple((0.5 * i + 0.35 * x, 0.5 * j + 0.35 * y) for x, y in corners)


# Initial polygons of two joints with limits -1 and 1: the largest and shorter ones.
OUTLINES = (
    ((1, 1), (-1, 1), (-1, -1), (1, -1)),
    ((1, 0.5), (0.5, 1), (-1, 1), (-1, -0.5), (-0.5, -1), (1, -1)),
    ((1, 1), (-0.5, 1), (-1, 0.5), (-1, -1), (0.5, -1), (1, -0.5)),
    ((0.6, 0.6), (-0.6, 0.6), (-0.6, -0.6), (0.6, -0.6)),
    ((1, 1), (-0.4, 0.4), (-1, -1), (0.4, -0.4)),
    ((1, -1), (0.4, 0.4), (-1, 1), (-0.4, -0.4)),
    _square(1, -1),
    _square(1, 1),
    _square(-1, 1),
    _square(-1, -1),
)
N_IN_MIRROR = 2  # number of these, at the end, that are mirror images of others


@dataclass(frozen=True)
class Loops:
    """All loops of ``harmonics`` harmonics in ``joints`` shape variables, evaluated at
    ``phases``. within (rad): largest |alpha| of all joints, or (lowest, highest) of
    each."""

    joints: int
    harmonics: int
    within: float | tuple[tuple[float, float], ...]
    phases: int = 64

    def narrower(self, share: float) -> Loops:
        """Return the loops within limits that are narrower by this factor, about the
        same middle."""
        sides = self.middle + share * (self.box - self.middle)
        return dataclasses.replace(self, within=tuple(zip(*sides.tolist())))

    @property
    def shape(self) -> tuple[int, int]:
        """Shape of p."""
        return 2 * self.harmonics + 1, self.joints

    @cached_property
    def box(self) -> np.ndarray:
        """Lowest and highest shapes, (2, joints), rad."""
        limit = self.within
        if np.ndim(limit) == 0:
            return np.array([[-limit] * self.joints, [limit] * self.joints], float)
        return np.array(np.transpose(limit), float)

    @property
    def middle(self) -> np.ndarray:
        """Middle of the limits, (joints,), rad."""
        return self.box.mean(0)

    @property
    def half(self) -> np.ndarray:
        """Half of the range between the limits, (joints,), rad."""
        return (self.box[1] - self.box[0]) / 2

    @cached_property
    def basis(self) -> np.ndarray:
        """Matrix (N, 2 K + 1) of shapes: alpha = basis @ p."""
        return waves(self.phases, self.harmonics)

    @cached_property
    def rates(self) -> np.ndarray:
        """Matrix (N, 2 K + 1) of rates: alphadot = rates @ p."""
        k = np.arange(1, self.harmonics + 1)
        rates = np.zeros_like(self.basis)
        rates[:, 1::2] = -k * self.basis[:, 2::2]
        rates[:, 2::2] = k * self.basis[:, 1::2]
        return rates

    @property
    def unit(self) -> float:
        """Scale of p, so that steps are of the size of the range."""
        return float(self.half.max()) / 2.5

    def cycle(self, p) -> tuple[np.ndarray, np.ndarray]:
        """Return alpha and alphadot (..., N, joints) of loops p (..., 2 K + 1,
        joints)."""
        return self.basis @ p, self.rates @ p

    def limits(self, dense: bool = False) -> tuple[np.ndarray, np.ndarray]:
        """Return (A, b) with A p <= b, p as a row, at some 512 phases; dense: at so
        many phases that `fitted` changes no such loop."""
        phases = DENSE
        if not dense:
            phases = max(512 // self.joints, 4 * self.harmonics)
        rows = waves(phases, self.harmonics)
        units = np.eye(self.joints)[:, None]
        A = np.concatenate([np.kron(rows, unit) for unit in units])
        sides = self.half * (1 - NARROWER) + [[1.0], [-1.0]] * self.middle
        return np.concatenate([A, -A]), np.repeat(sides, len(rows), 1).ravel()

    def active(self, p) -> list[str]:
        """Return the limits that the loop touches, as text."""
        low, high = self.box
        near = TOUCHING * self.half
        lowest, highest = self.extremes(p)
        names = []
        for j in range(self.joints):
            if lowest[j] <= low[j] + near[j]:
                names.append(f"alpha_{j + 1} >= {low[j]:g}")
            if highest[j] >= high[j] - near[j]:
                names.append(f"alpha_{j + 1} <= {high[j]:g}")
        return names

    def gait(self, p) -> Fourier:
        """Return the loop as a gait of amplitude 1.

        Coefficients that are nothing but rounding are left out: they would hide the
        symmetry of the gait."""
        p = np.reshape(p, self.shape)
        p = np.where(np.abs(p) > ROUNDING * np.abs(p).max(), p, 0.0)
        cos = tuple(map(tuple, p[1::2].T.tolist()))
        sin = tuple(map(tuple, p[2::2].T.tolist()))
        return Fourier(cos=cos, sin=sin, centre=tuple(p[0].tolist()))

    def from_gait(self, gait: Gait) -> np.ndarray:
        """Return p of a gait, truncated after the highest harmonic."""
        return self._series(gait.shape(2 * np.pi * np.arange(DENSE) / DENSE))

    def _series(self, alpha: np.ndarray) -> np.ndarray:
        """Return p of a closed curve (DENSE, joints) at equally spaced phases, up to
        the highest harmonic."""
        c = np.fft.rfft(alpha, axis=0)[: self.harmonics + 1] / DENSE
        p = np.empty(self.shape)
        p[0] = c[0].real
        p[1::2] = 2 * c[1:].real
        p[2::2] = -2 * c[1:].imag
        return p

    def fitted(self, p) -> np.ndarray:
        """Return p moved and made smaller by no more than it takes to lie within the
        limits."""
        p = np.array(np.reshape(p, self.shape))
        moving = waves(DENSE, self.harmonics)[:, 1:] @ p[1:]
        low = moving.min(0)
        high = moving.max(0)
        half = self.half * (1 - NARROWER / 2)
        size = min(1.0, float((2 * half / np.maximum(high - low, 1e-300)).min()))
        p[1:] *= size
        p[0] = np.clip(
            p[0], self.middle - half - size * low, self.middle + half - size * high
        )
        return p

    def _sizeable(self, p) -> np.ndarray:
        """Return p, enlarged where it is too small for useful slopes; a travelling wave
        where it does not move."""
        p = np.array(p)
        half = self.half.max()
        size = np.abs(waves(DENSE, self.harmonics)[:, 1:] @ p[1:]).max()
        if size == 0:
            lag = np.pi / 2 * np.arange(self.joints)
            p[1] = np.cos(lag)
            p[2] = np.sin(lag)
            size = 1.0
        if size < SMALL * half:
            p[1:] *= ENLARGED * half / size
        return p

    def extremes(self, p) -> tuple[np.ndarray, np.ndarray]:
        """Return the least and the largest value of every shape variable, (joints,)
        each, rad."""
        alpha = waves(DENSE, self.harmonics) @ np.reshape(p, self.shape)
        return alpha.min(0), alpha.max(0)

    def starts(self, first, count: int, seed: int = 0) -> list[np.ndarray]:
        """Return ``count`` initial loops: ``first``, then `OUTLINES` for two joints,
        then travelling waves of several sizes and lags, then random ones."""
        rng = np.random.default_rng(seed)
        loops = [self.fitted(self._sizeable(first))]
        if self.joints == 2:
            loops += [self._outline(corners) for corners in OUTLINES[: count - 1]]
        for k in range(count - len(loops)):
            loops.append(self._wave(k, rng))
        return loops

    def _wave(self, k: int, rng) -> np.ndarray:
        """Return the k-th travelling wave of the starts; all but the first
        perturbed."""
        if k < len(LAGS):
            step = LAGS[k]
        else:
            step = rng.uniform(-np.pi, np.pi)
        lag = np.arange(self.joints) * step
        share = FIRST_SIZE
        if k > 0:
            share = rng.uniform(*SIZES)
        size = self.half * share
        p = np.zeros(self.shape)
        p[0] = self.middle
        p[1] = size * np.cos(lag)
        p[2] = size * np.sin(lag)
        if k > 0:
            order = np.repeat(np.arange(1, self.harmonics + 1), 2)[:, None]
            falling = 1 / order**2
            random = rng.normal(size=(2 * self.harmonics, self.joints))
            p[1:] += 0.3 * size * falling * random
            p[0] += 0.1 * self.half * rng.normal(size=self.joints)
        return self.fitted(p)

    def _outline(self, corners) -> np.ndarray:
        """Return the loop round a polygon of `OUTLINES` at constant speed."""
        closed = np.array([*corners, corners[0]], float)
        sides = np.linalg.norm(np.diff(closed, axis=0), axis=1)
        path = np.concatenate([[0.0], np.cumsum(sides)])
        along = path[-1] * np.arange(DENSE) / DENSE
        curve = np.stack([np.interp(along, path, x) for x in closed.T], -1)
        return self.fitted(self._series(self.middle + self.half * curve))


def waves(phases: int, harmonics: int) -> np.ndarray:
    """Return (N, 2 K + 1): 1, cos t, sin t, cos 2t ... at equally spaced phases."""
    kt = 2 * np.pi * np.outer(np.arange(phases) / phases, np.arange(1, harmonics + 1))
    pairs = np.stack([np.cos(kt), np.sin(kt)], -1).reshape(phases, -1)
    return np.concatenate([np.ones((phases, 1)), pairs], 1)


def shifted(p: np.ndarray, t: float) -> np.ndarray:
    """Return the loop that starts at phase t of this one."""
    k = np.arange(1, (len(p) + 1) // 2)[:, None]
    cos = np.cos(k * t)
    sin = np.sin(k * t)
    q = p.copy()
    q[1::2] = cos * p[1::2] + sin * p[2::2]
    q[2::2] = cos * p[2::2] - sin * p[1::2]
    return q


def reversed_loop(p: np.ndarray) -> np.ndarray:
    """Return the loop run backwards from the same start."""
    pairs = p[1:].reshape(-1, 2, p.shape[1]) * [[1.0], [-1.0]]
    return np.concatenate([p[:1], pairs.reshape(p[1:].shape)])


def is_same(
    p: np.ndarray,
    q: np.ndarray,
    mirror: bool = True,
    odd: bool = True,
    tolerance: float = SAME,
) -> bool:
    """Return whether two loops are the same curve: no point of either is further from
    the other than ``tolerance`` of its size.

    Start and pacing do not matter; with ``odd`` neither does the sense; with ``mirror``
    a loop equals its mirror image (alpha -> -alpha)."""
    basis = waves(DENSE // 4, (len(p) - 1) // 2)
    first = basis @ p
    size = np.ptp(basis @ p, axis=0).max()
    forwards = basis @ shifted(p, np.pi / DENSE) - first
    # Points of equal curves lie up to half a spacing apart.
    largest = tolerance * size + np.pi * size / len(basis) / 2

    others = [basis @ q]
    if mirror:
        others.append(-basis @ q)
    for other in others:
        distances = np.linalg.norm(first[:, None] - other[None], axis=-1)
        farthest = max(distances.min(0).max(), distances.min(1).max())
        tangent = np.roll(other, -1, 0) - np.roll(other, 1, 0)
        along = tangent[distances.argmin(1)]
        same_sense = odd or (forwards * along).sum() > 0
        if farthest <= largest and same_sense:
            return True
    return False
