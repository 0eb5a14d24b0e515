"""Motion along a gait from body velocities at equally spaced phases.

The heading is the integral of a periodic function, the position the integral of e^(i
theta) times another. Both are exact for the trigonometric polynomials through the
samples: for smooth gaits in smooth media the error falls faster than any power of the
number of phases, with kinks (sticking links) like its square."""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rft.core.checks import real_array, unmasked
from rft.core.refusal import Refusal
from rft.formulas import se2


class _Waves(NamedTuple):
    """Fourier terms of n equally spaced samples.

    k: (M,), wave numbers -K .. K. place: (M,), their indices in a Fourier transform.
    share: (M,), of the coefficient at that index: the highest of an even n is shared by
    +-K. integral: (M,), factors from a function's coefficients to those of its integral
    of zero mean."""

    k: np.ndarray
    place: np.ndarray
    share: np.ndarray
    integral: np.ndarray

    def coefficients(self, f: np.ndarray) -> np.ndarray:
        """Return Fourier coefficients (..., M) of samples (..., n)."""
        return np.fft.fft(f)[..., self.place] * self.share


@functools.lru_cache(maxsize=32)
def _waves(n: int) -> _Waves:
    """Return the Fourier terms of n samples."""
    k = np.arange(-(n // 2), n // 2 + 1)
    share = np.full(len(k), 1 / n)
    if n % 2 == 0:
        share[[0, -1]] /= 2
    integral = np.where(k == 0, 0.0, 1 / np.where(k == 0, 1, 1j * k))
    return _Waves(k, k % n, share, integral)


def turning(xi: ArrayLike) -> np.ndarray:
    """Return the heading (..., N) gained at the phases, less its mean growth, of zero
    mean over the cycle; xi as in `displacement`.

    Examples
    --------
    >>> import numpy as np
    >>> from geomech.mathematics.geometry.reconstruct import turning
    >>> t = 2 * np.pi * np.arange(8) / 8
    >>> turning(np.stack([0 * t, 0 * t, 1 + np.cos(t)], -1))[1:4].round(3)  # sin t
    array([0.707, 1.   , 0.707])
    """
    xi = real_array("xi", xi)
    if xi.ndim < 2 or xi.shape[-1] != 3:
        raise Refusal("xi must be of shape (..., N, 3)", value=xi.shape)
    n = xi.shape[-2]
    return np.fft.irfft(np.fft.rfft(xi[..., 2]) * _waves(n).integral[n // 2 :], n)


class _Spectrum(NamedTuple):
    """Fourier coefficients of the velocity of a cycle in the world.

    mean_turn: (..., 1), mean of xi_theta. k: (M,), wave numbers, symmetric about 0.
    wave: (..., M), coefficients of e^(i (theta - mean growth)) (xi_x + i xi_y)."""

    mean_turn: np.ndarray
    k: np.ndarray
    wave: np.ndarray


def displacement(xi: ArrayLike) -> np.ndarray:
    """Return the net pose (..., 3) after one cycle, in the frame at its start.

    xi: (..., N, 3), body velocity with respect to phase at t = 2 pi n / N, N >= 3.

    Examples
    --------
    >>> import numpy as np
    >>> from geomech.mathematics.geometry.reconstruct import displacement
    >>> xi = np.tile([1.0, 0.0, 0.5], (64, 1))  # ahead and left, per rad of phase
    >>> displacement(xi).round(3)  # half a turn on a circle of radius 2
    array([0.   , 4.   , 3.142])
    """
    s = _spectrum(xi)
    z = (s.wave * _reach(s.mean_turn + s.k)).sum(-1)
    return np.stack([z.real, z.imag, 2 * np.pi * s.mean_turn[..., 0]], -1)


def trajectory(xi: ArrayLike, phases: ArrayLike) -> np.ndarray:
    """Return poses (..., P, 3) at phases t (P,) from the start of the cycle; xi as in
    `displacement`.

    Examples
    --------
    >>> import numpy as np
    >>> from geomech.mathematics.geometry.reconstruct import trajectory
    >>> xi = np.tile([1.0, 0.0, 0.5], (64, 1))
    >>> trajectory(xi, [np.pi, 2 * np.pi]).round(3)
    array([[2.   , 2.   , 1.571],
           [0.   , 4.   , 3.142]])
    """
    s = _spectrum(xi)
    t = real_array("phases", phases)
    if t.ndim != 1 or not np.isfinite(t).all():
        raise Refusal("phases must be a list of finite numbers", value=t)
    turns = (s.mean_turn + s.k)[..., None, :]
    span = t[:, None]
    reach = span * np.exp(0.5j * turns * span) * np.sinc(turns * span / (2 * np.pi))
    z = (s.wave[..., None, :] * reach).sum(-1)
    waves = _waves(np.shape(xi)[-2])
    swing = waves.integral * waves.coefficients(unmasked("xi", xi)[..., 2])
    swing = (swing[..., None, :] * np.expm1(1j * s.k * span)).sum(-1).real
    return np.stack([z.real, z.imag, s.mean_turn * t + swing], -1)


def poses(xi: ArrayLike) -> np.ndarray:
    """Return poses (..., N + 1, 3) at the phases of the samples and at the cycle's end.

    They are those of `trajectory`, in time N log N.

    Examples
    --------
    >>> import numpy as np
    >>> from geomech.mathematics.geometry.reconstruct import poses
    >>> xi = np.tile([1.0, 0.0, 0.5], (64, 1))
    >>> poses(xi)[[0, 32, 64]].round(3)
    array([[0.   , 0.   , 0.   ],
           [2.   , 2.   , 1.571],
           [0.   , 4.   , 3.142]])
    """
    s = _spectrum(xi)
    n = np.shape(xi)[-2]
    span = 2 * np.pi * np.arange(n + 1) / n

    def closed(x):
        return np.take(x, np.arange(n + 1) % n, -1)

    # The integral of each wave is a quotient, except for one slow wave at most.
    turns = s.mean_turn + s.k
    slow = np.abs(turns) < 0.5
    quotients = np.where(slow, 0.0, s.wave / np.where(slow, 1.0, 1j * turns))
    integral = closed(_values(quotients, s.k, n))
    integral = integral * np.exp(1j * s.mean_turn * span)
    z = integral - integral[..., :1]

    # The slow wave, by the sine over its argument.
    drift = np.where(slow, s.wave, 0.0).sum(-1)[..., None]
    turn = np.where(slow, turns, 0.0).sum(-1)[..., None]
    quotient = np.sinc(turn * span / (2 * np.pi))
    z = z + drift * span * np.exp(0.5j * turn * span) * quotient

    swing = closed(turning(xi))
    return np.stack([z.real, z.imag, s.mean_turn * span + swing - swing[..., :1]], -1)


def repeated(path: np.ndarray, cycles: int) -> np.ndarray:
    """Return the poses (cycles N + 1, 3) of several equal cycles from those of one, (N
    + 1, 3).

    Examples
    --------
    >>> import numpy as np
    >>> from geomech.mathematics.geometry.reconstruct import poses, repeated
    >>> xi = np.tile([1.0, 0.0, 0.25], (64, 1))
    >>> repeated(poses(xi), 2)[-1].round(3)  # after half a turn
    array([0.   , 8.   , 3.142])
    """
    starts = np.zeros((1, 3))
    net = path[-1]
    while len(starts) <= cycles:  # each time twice as many
        end = se2.compose(starts[-1], net)
        starts = np.concatenate([starts, se2.compose(end, starts)])
    earlier = se2.compose(starts[:cycles, None], path[:-1]).reshape(-1, 3)
    return np.concatenate([earlier, starts[cycles : cycles + 1]])


def _spectrum(xi) -> _Spectrum:
    """Return the spectrum of a cycle xi (..., N, 3)."""
    xi = real_array("xi", xi)
    if xi.ndim < 2 or xi.shape[-1] != 3 or xi.shape[-2] < 3:
        raise Refusal("xi must have shape (..., N >= 3, 3)", value=xi.shape)
    if not np.isfinite(xi).all():
        raise Refusal("xi must be finite")
    waves = _waves(xi.shape[-2])
    swing = turning(xi)
    rotation = np.exp(1j * (swing - swing[..., :1]))
    wave = waves.coefficients(rotation * (xi[..., 0] + 1j * xi[..., 1]))
    return _Spectrum(xi[..., 2].mean(-1, keepdims=True), waves.k, wave)


def _values(c: np.ndarray, k: np.ndarray, n: int) -> np.ndarray:
    """Return sum_k c_k e^(i k t) (..., n) at the n phases: the inverse of
    `_Waves.coefficients`."""
    spectrum = np.zeros((*c.shape[:-1], n), complex)
    np.add.at(spectrum, (..., k % n), c)
    return np.fft.ifft(spectrum, axis=-1) * n


def slopes(xi: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Return the net pose (3,) of `displacement` and its derivatives (3, N, 3) by the
    body velocities, for one cycle xi (N, 3).

    Examples
    --------
    >>> import numpy as np
    >>> from geomech.mathematics.geometry.reconstruct import slopes
    >>> net, derivative = slopes(np.tile([1.0, 0.0, 0.5], (64, 1)))
    >>> derivative.shape
    (3, 64, 3)
    """
    xi = real_array("xi", xi)
    n = np.shape(xi)[-2]
    s = _spectrum(xi)
    turns = s.mean_turn + s.k
    reach = _reach(turns)
    z = (s.wave * reach).sum()
    net = np.array([z.real, z.imag, 2 * np.pi * s.mean_turn[0]])

    # By xi_x + i xi_y at each phase, which is rotated by e^(i theta).
    share = np.where((n % 2 == 0) & (np.abs(s.k) == n // 2), 0.5, 1.0)
    factors = _phase_factors(n) @ (share * reach) / n
    heading = turning(xi) - turning(xi)[0]
    by_x = np.exp(1j * heading) * factors

    # By xi_theta at each phase: through the headings, and through the mean growth.
    velocity = xi[:, 0] + 1j * xi[:, 1]
    response = _turning_response(n)
    by_heading = (1j * by_x * velocity) @ (response - response[0])
    step = 1e-5  # rad per rad of phase, of a central difference
    slopes_by_turn = s.wave * (_reach(turns + step) - _reach(turns - step)) / (2 * step)
    by_theta = by_heading + slopes_by_turn.sum() / n

    dz = np.stack([by_x, 1j * by_x, by_theta], -1)
    dtheta = np.broadcast_to([0.0, 0.0, 2 * np.pi / n], (n, 3))
    return net, np.stack([dz.real, dz.imag, dtheta])


def _reach(turns: np.ndarray) -> np.ndarray:
    """Return the integral of e^(i turns t) over a cycle."""
    return 2 * np.pi * np.exp(1j * np.pi * turns) * np.sinc(turns)


@functools.lru_cache(maxsize=8)
def _phase_factors(n: int) -> np.ndarray:
    """Return (N, M): e^(-i k t) at each phase, for every wave number of `_waves`."""
    return np.exp(-1j * np.outer(2 * np.pi * np.arange(n) / n, _waves(n).k))


@functools.lru_cache(maxsize=8)
def _turning_response(n: int) -> np.ndarray:
    """Return (N, N): `turning` at the phases (rows) per unit of xi_theta at each of
    them (columns)."""
    unit = np.zeros((n, n, 3))
    unit[..., 2] = np.eye(n)
    return turning(unit).T
