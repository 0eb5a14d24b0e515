"""Loops in shape space as finite Fourier series: their parameters, limits, initial guesses, and when two are the same.

The parameters of a loop are p (2 K + 1, joints), rad: the centre, then cosines and sines of the harmonics 1, 1, 2, 2
... K. Shapes and rates at the phases are linear in them."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from geomech.gaits import Fourier, Gait

DENSE = 1024  # phases at which limits hold and loops are compared
TOUCHING = 5e-3  # of a limit: a loop this near touches it
NARROWER = 1e-4  # of a limit: a curve may exceed it by this between phases
SMALL, SIZEABLE = (
    0.05,
    0.3,
)  # of the range: a start that is too small, and its size after enlargement
NOTHING = 1e-11  # of the largest coefficient: a smaller one is rounding
SAME = 0.02  # of its size: largest distance between two loops that count as the same
OUTLINES = (  # initial polygons of two joints with limits -1 and 1: the largest and shorter ones
    ((1, 1), (-1, 1), (-1, -1), (1, -1)),
    ((1, 0.5), (0.5, 1), (-1, 1), (-1, -0.5), (-0.5, -1), (1, -1)),
    ((1, 1), (-0.5, 1), (-1, 0.5), (-1, -1), (0.5, -1), (1, -0.5)),
    ((0.6, 0.6), (-0.6, 0.6), (-0.6, -0.6), (0.6, -0.6)),
    ((1, 1), (-0.4, 0.4), (-1, -1), (0.4, -0.4)),
    ((1, -1), (0.4, 0.4), (-1, 1), (-0.4, -0.4)),
    *(tuple((0.5 * i + 0.35 * x, 0.5 * j + 0.35 * y) for x, y in ((1, 1), (-1, 1), (-1, -1), (1, -1)))
      for i, j in ((1, -1), (1, 1), (-1, 1), (-1, -1))),
)  # fmt: skip
IN_MIRROR = 2  # number of these, at the end, that are mirror images of others


@dataclass(frozen=True)
class Loops:
    """All loops of ``harmonics`` harmonics in ``joints`` shape variables, evaluated at ``phases``. within (rad):
    largest |alpha| of all joints, or (lowest, highest) of each."""

    joints: int
    harmonics: int
    within: float | tuple[tuple[float, float], ...]
    phases: int = 64

    def narrower(self, share: float) -> Loops:
        """Return the loops within limits that are narrower by this factor, about the same middle."""
        sides = self.middle + share * (self.box - self.middle)
        return dataclasses.replace(self, within=tuple(zip(*sides.tolist())))

    @property
    def shape(self) -> tuple[int, int]:
        return 2 * self.harmonics + 1, self.joints

    @cached_property
    def box(self) -> np.ndarray:
        """Lowest and highest shapes, (2, joints)."""
        w = self.within
        return np.array(
            [[-w] * self.joints, [w] * self.joints]
            if np.ndim(w) == 0
            else np.transpose(w),
            float,
        )

    @property
    def middle(self) -> np.ndarray:
        """Middle of the limits, (joints,)."""
        return self.box.mean(0)

    @property
    def half(self) -> np.ndarray:
        """Half of the range between the limits, (joints,)."""
        return (self.box[1] - self.box[0]) / 2

    @cached_property
    def basis(self) -> np.ndarray:
        """Matrix (N, 2 K + 1) of shapes: alpha = basis @ p."""
        return waves(self.phases, self.harmonics)

    @cached_property
    def rates(self) -> np.ndarray:
        """Matrix (N, 2 K + 1) of rates: alphadot = rates @ p."""
        k = np.arange(1, self.harmonics + 1)
        out = np.zeros_like(self.basis)
        out[:, 1::2], out[:, 2::2] = -k * self.basis[:, 2::2], k * self.basis[:, 1::2]
        return out

    @property
    def unit(self) -> float:
        """Scale of p, so that steps are of the size of the range."""
        return float(self.half.max()) / 2.5

    def cycle(self, p) -> tuple[np.ndarray, np.ndarray]:
        """Return alpha and alphadot (..., N, joints) of loops p (..., 2 K + 1, joints)."""
        return self.basis @ p, self.rates @ p

    def limits(self, dense: bool = False) -> tuple[np.ndarray, np.ndarray]:
        """Return (A, b) with A p <= b, p as a row, at some 512 phases; dense: at so many that `fitted` changes no such
        loop."""
        rows = waves(
            DENSE if dense else max(512 // self.joints, 4 * self.harmonics),
            self.harmonics,
        )
        A = np.concatenate(
            [np.kron(rows, unit) for unit in np.eye(self.joints)[:, None]]
        )
        sides = self.half * (1 - NARROWER) + [[1.0], [-1.0]] * self.middle
        return np.concatenate([A, -A]), np.repeat(sides, len(rows), 1).ravel()

    def active(self, p) -> list[str]:
        """Return the limits that the loop touches, as text."""
        names = []
        (low, high), near, reached = self.box, TOUCHING * self.half, self.extremes(p)
        for j, (down, up) in enumerate(
            zip(reached[0] <= low + near, reached[1] >= high - near)
        ):
            names += [f"alpha_{j + 1} >= {low[j]:g}"] if down else []
            names += [f"alpha_{j + 1} <= {high[j]:g}"] if up else []
        return names

    def gait(self, p) -> Fourier:
        """Return the loop as a gait of amplitude 1, without coefficients that are nothing but rounding: they would hide
        its symmetry."""
        p = np.reshape(p, self.shape)
        p = np.where(np.abs(p) > NOTHING * np.abs(p).max(), p, 0.0)
        cos, sin = (tuple(map(tuple, p[first::2].T.tolist())) for first in (1, 2))
        return Fourier(cos=cos, sin=sin, centre=tuple(p[0].tolist()))

    def of(self, gait: Gait) -> np.ndarray:
        """Return p of a gait, truncated after the highest harmonic."""
        return self._series(gait.shape(2 * np.pi * np.arange(DENSE) / DENSE))

    def _series(self, alpha: np.ndarray) -> np.ndarray:
        """Return p of a closed curve (DENSE, joints) at equally spaced phases, up to the highest harmonic."""
        c = np.fft.rfft(alpha, axis=0)[: self.harmonics + 1] / DENSE
        p = np.empty(self.shape)
        p[0], p[1::2], p[2::2] = c[0].real, 2 * c[1:].real, -2 * c[1:].imag
        return p

    def fitted(self, p) -> np.ndarray:
        """Return p moved and made smaller by no more than it takes to lie within the limits."""
        p = np.array(np.reshape(p, self.shape))
        moving = waves(DENSE, self.harmonics)[:, 1:] @ p[1:]
        high, low = moving.max(0), moving.min(0)
        room = self.half * (1 - NARROWER / 2)
        size = min(1.0, float((2 * room / np.maximum(high - low, 1e-300)).min()))
        p[1:] *= size
        p[0] = np.clip(
            p[0], self.middle - room - size * low, self.middle + room - size * high
        )
        return p

    def _sizeable(self, p) -> np.ndarray:
        """Return p, enlarged where it is too small for useful slopes; a travelling wave where it does not move."""
        p = np.array(p)
        size, room = (
            np.abs(waves(DENSE, self.harmonics)[:, 1:] @ p[1:]).max(),
            self.half.max(),
        )
        if size == 0:
            lag = np.pi / 2 * np.arange(self.joints)
            p[1], p[2], size = np.cos(lag), np.sin(lag), 1.0
        if size < SMALL * room:
            p[1:] *= SIZEABLE * room / size
        return p

    def extremes(self, p) -> tuple[np.ndarray, np.ndarray]:
        """Return the least and the largest value of every shape variable, (joints,) each, rad."""
        alpha = waves(DENSE, self.harmonics) @ np.reshape(p, self.shape)
        return alpha.min(0), alpha.max(0)

    def starts(self, own, count: int, seed: int = 0) -> list[np.ndarray]:
        """Return ``count`` initial loops: ``own``, then `OUTLINES` for two joints, then travelling waves of several
        sizes and lags, then random ones."""
        rng, loops = np.random.default_rng(seed), [self.fitted(self._sizeable(own))]
        loops += [self._outline(x) for x in OUTLINES[: count - 1] if self.joints == 2]
        lags = [np.pi / 2, -np.pi / 2, 2 * np.pi / 3, np.pi / 4]
        for k in range(count - len(loops)):
            p = np.zeros(self.shape)
            lag = np.arange(self.joints) * (
                lags[k] if k < len(lags) else rng.uniform(-np.pi, np.pi)
            )
            size = self.half * (0.7 if k == 0 else rng.uniform(0.4, 0.9))
            p[0], p[1], p[2] = self.middle, size * np.cos(lag), size * np.sin(lag)
            if k > 0:
                falling = (
                    1 / np.repeat(np.arange(1, self.harmonics + 1), 2)[:, None] ** 2
                )
                p[1:] += (
                    0.3
                    * size
                    * falling
                    * rng.normal(size=(2 * self.harmonics, self.joints))
                )
                p[0] += 0.1 * self.half * rng.normal(size=self.joints)
            loops.append(self.fitted(p))
        return loops

    def _outline(self, corners) -> np.ndarray:
        """Return the loop round a polygon of `OUTLINES` at constant speed."""
        closed = np.array([*corners, corners[0]], float)
        path = np.concatenate(
            [[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))]
        )
        along = path[-1] * np.arange(DENSE) / DENSE
        curve = np.stack([np.interp(along, path, x) for x in closed.T], -1)
        return self.fitted(self._series(self.middle + self.half * curve))


def waves(phases: int, harmonics: int) -> np.ndarray:
    """Return (N, 2 K + 1): 1, cos t, sin t, cos 2t ... at equally spaced phases."""
    kt = 2 * np.pi * np.outer(np.arange(phases) / phases, np.arange(1, harmonics + 1))
    return np.concatenate(
        [
            np.ones((phases, 1)),
            np.stack([np.cos(kt), np.sin(kt)], -1).reshape(phases, -1),
        ],
        1,
    )


def shifted(p: np.ndarray, t: float) -> np.ndarray:
    """Return the loop that starts at phase t of this one."""
    k = np.arange(1, (len(p) + 1) // 2)[:, None]
    cos, sin, out = np.cos(k * t), np.sin(k * t), p.copy()
    out[1::2], out[2::2] = cos * p[1::2] + sin * p[2::2], cos * p[2::2] - sin * p[1::2]
    return out


def reversed_(p: np.ndarray) -> np.ndarray:
    """Return the loop run backwards from the same start."""
    return np.concatenate(
        [
            p[:1],
            (p[1:].reshape(-1, 2, p.shape[1]) * [[1.0], [-1.0]]).reshape(p[1:].shape),
        ]
    )


def same(
    p: np.ndarray,
    q: np.ndarray,
    mirror: bool = True,
    odd: bool = True,
    tolerance: float = SAME,
) -> bool:
    """Return whether two loops are the same curve: no point of either is further from the other than ``tolerance`` of
    its size.

    Start and pacing do not matter; with ``odd`` neither does the sense; with ``mirror`` a loop equals its mirror image
    (alpha -> -alpha)."""
    seen, ahead = waves(DENSE // 4, (len(p) - 1) // 2), shifted(p, np.pi / DENSE)
    first, size = seen @ p, np.ptp(seen @ p, axis=0).max()
    forwards = seen @ ahead - first
    for other in (seen @ q, -seen @ q) if mirror else (seen @ q,):
        distances = np.linalg.norm(first[:, None] - other[None], axis=-1)
        near = (
            max(distances.min(0).max(), distances.min(1).max())
            <= tolerance * size + np.pi * size / len(seen) / 2
        )
        along = (np.roll(other, -1, 0) - np.roll(other, 1, 0))[distances.argmin(1)]
        if near and (odd or (forwards * along).sum() > 0):
            return True
    return False
