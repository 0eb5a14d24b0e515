"""The area tier of gaits that wind around a shape variable with a period.

Such a gait encloses no area by itself. Its reference is the *loop at rest*: the gait at
amplitude 0, which rests at its centre while the variables with a period advance. With
rest(t) on it and delta(t) from there to the gait at the same phase, the strip rest(t) +
s delta(t), s from 0 to 1, lies between the two loops. In the gauge that is transported
along its lines,

    xi = A(rest) rest' + integral over s of Ad_g(s, t) CCF(delta, rest' + s delta') ds

is the body velocity of the gait, exactly, where g(s, t) is the pose at s on a line
relative to its start. So the displacement is the line integral along the loop at rest
and the CCF's integral over the strip, taken together phase by phase. The tier takes
exp(s A(rest) delta) for g. Its error is of order 3 in delta, as that of the area
enclosed by a small loop, and 2 if g were left out."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from geomech.mathematics.geometry.connection import SAMPLES_TOGETHER, Connection
from geomech.mathematics.geometry.gait import Gait, checked_gait
from geomech.mathematics.geometry.periods import Periods, winding
from geomech.mathematics.geometry.reconstruct import displacement
from geomech.mathematics.geometry.two_form import (
    RADII,
    Spanned,
    gait_amplitudes,
    two_form,
    with_spread,
)
from rft.core.checks import in_range
from rft.core.refusal import Refusal
from rft.formulas import se2

NODES = 16  # of Gauss's rule along a line, where a field of two variables is cheap
STEP = 2e-4  # rad, of differences where there is no field
STEPS = 4  # of the midpoint rule, from the loop at rest to the gait's first shape


class _Leg(NamedTuple):
    """A straight part of the lines from the loop at rest: offsets from it at its start
    and end, and their rates by phase; all (B, N, d) or fewer by broadcasting."""

    start: np.ndarray
    end: np.ndarray
    start_rate: np.ndarray
    end_rate: np.ndarray


def wound_area(
    connection: Connection,
    gait: Gait,
    amplitudes: ArrayLike | None = None,
    phases: int = 256,
    tips: int = 0,
) -> Spanned:
    """Return the displacements of a gait that winds around variables with periods, for
    amplitudes (B,) or its own: the line integral along the loop at rest and the CCF's
    integral over the strip from there to the gait.

    tips: number of other surfaces, which go from the loop at rest through a parallel
    loop, in which the gait's other variables rest at a shape of the gait. How far they
    differ is the ``spread``; with two variables there is one strip, and no spread.
    Refusal for a gait that leaves the field, is not closed, or does not wind as its
    loop at rest does.

    Examples
    --------
    >>> import numpy as np
    >>> from geomech.mathematics.gaits import Wound
    >>> from geomech.mathematics.gaits.fourier import Fourier
    >>> from geomech.mathematics.geometry import connection
    >>> from geomech.mathematics.geometry.loop_at_rest import wound_area
    >>> from geomech.mathematics.geometry.traits import Traits
    >>> def slide(alpha, alphadot):  # x' = cos(phase) alpha_1'
    ...     x = np.cos(alpha[..., 1]) * alphadot[..., 0]
    ...     return np.stack([x, 0 * x, 0 * x], -1)
    >>> traits = Traits(linear=True, periods=(None, 2 * np.pi))
    >>> axes = connection.grid(2, 31, 1.0, traits.periods)
    >>> A = connection.fit(slide, axes, traits=traits)
    >>> gait = Wound(Fourier(cos=((0.0,),), sin=((1.0,),), amplitude=0.5))
    >>> np.abs(wound_area(A, gait).net).round(4)  # pi / 2
    array([[1.5708, 0.    , 0.    ]])
    """
    in_range("phases", phases, 8, 1e6, whole=True)
    in_range("tips", tips, 0, phases, whole=True)
    form = two_form(connection)
    if checked_gait(gait).joints != form.joints:
        raise Refusal(
            f"the gait moves {gait.joints} joints, the field has {form.joints}"
        )
    amplitudes = gait_amplitudes(gait, amplitudes)
    _check_loop_at_rest(gait, connection.periods, amplitudes)
    return _in_batches(connection.field, form, gait, amplitudes, phases, tips)


def wound_area_by(
    A: Callable,
    gait: Gait,
    periods: Periods,
    amplitudes: ArrayLike | None = None,
    phases: int = 64,
    tips: int = 0,
) -> Spanned:
    """Return `wound_area` without a field: A(alpha) -> (..., 3, d) is evaluated at
    shapes (..., d) of the strips, and its derivatives are differences over `STEP`."""
    in_range("phases", phases, 8, 1e6, whole=True)
    in_range("tips", tips, 0, phases, whole=True)
    amplitudes = gait_amplitudes(checked_gait(gait), amplitudes)
    _check_loop_at_rest(gait, periods, amplitudes)
    form = _Differences(A, gait.joints)
    return _in_batches(A, form, gait, amplitudes, phases, tips)


class _Differences(NamedTuple):
    """The CCF of a connection A(alpha) without a field, as `TwoForm`."""

    A: Callable
    joints: int

    def __call__(self, alpha, u, v) -> np.ndarray:
        """Return CCF(u, v) (..., 3) = D_u(A) v - D_v(A) u + [A u, A v]."""
        alpha, u, v = np.broadcast_arrays(alpha, u, v)
        A = self.A(alpha)
        exterior = _times(self._derivative(alpha, u), v)
        exterior = exterior - _times(self._derivative(alpha, v), u)
        return exterior + se2.bracket(_times(A, u), _times(A, v))

    def _derivative(self, alpha, u) -> np.ndarray:
        """Return D_u(A) (..., 3, d)."""
        size = np.linalg.norm(u, axis=-1, keepdims=True)
        step = STEP * u / np.where(size > 0, size, 1.0)
        change = self.A(alpha + step) - self.A(alpha - step)
        return change * (size / (2 * STEP))[..., None]


def _times(A: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Return A u (..., 3) of matrices (..., 3, d) and changes of shape (..., d)."""
    return np.einsum("...ij,...j->...i", A, u)


def _in_batches(A: Callable, form, gait, amplitudes, phases, tips) -> Spanned:
    """Return displacements of many amplitudes, so that memory is bounded."""
    if form.joints == 2:
        tips = 0
    batch = max(1, SAMPLES_TOGETHER // int(phases))
    results = []
    for k in range(0, max(1, len(amplitudes)), batch):
        group = amplitudes[k : k + batch]
        results.append(_strips(A, form, gait, group, int(phases), int(tips)))
    net, others = zip(*results)
    return with_spread(np.concatenate(net), np.concatenate(others))


def _check_loop_at_rest(gait: Gait, periods, amplitudes: np.ndarray) -> None:
    """Refuse a gait that does not wind as its loop at rest does."""
    turns = winding(gait, periods, amplitudes)
    if turns != winding(gait, periods, 0.0):
        raise Refusal(
            "the gait winds around a variable that repeats, and at amplitude 0 it does "
            "not wind as often",
            because="the area tier takes the loop at rest as its reference",
            instead="give the gait of the other variables alone, or use path or direct",
        )


def _strips(
    A_at: Callable, form, gait: Gait, amplitudes, phases, tips
) -> tuple[np.ndarray, np.ndarray]:
    """Return displacements by the strip from the loop at rest (B, 3), and by those
    through parallel loops (B, tips, 3).

    A_at: the connection, a function of shapes. form: its CCF, a `TwoForm` or a function
    like it."""
    alpha, alphadot = gait.cycle(phases, amplitudes)  # (B, N, d)
    rest, rest_rate = gait.cycle(phases, 0.0)  # (N, d)
    A = A_at(rest)
    delta = alpha - rest
    delta_rate = alphadot - rest_rate
    none = np.zeros(alpha.shape[-1])

    surfaces = [[_Leg(none, delta, none, delta_rate)]]
    for k in range(tips):
        parallel = delta[:, k * phases // tips, None]
        surfaces.append(
            [
                _Leg(none, parallel, none, none),
                _Leg(parallel, delta, none, delta_rate),
            ]
        )
    along = np.einsum("nij,nj->ni", A, rest_rate)
    poses = []
    for legs in surfaces:
        xi = along
        first = np.zeros((len(delta), 3))
        for leg in legs:
            xi = xi + _across(form, A, rest, rest_rate, leg)
            first = se2.compose(first, _transport(A_at, rest[0], leg))
        at_rest = displacement(xi)
        poses.append(se2.compose(se2.inverse(first), se2.compose(at_rest, first)))
    poses = np.stack(poses, 1)
    return poses[:, 0], poses[:, 1:]


def _across(form, A, rest, rest_rate, leg: _Leg) -> np.ndarray:
    """Return the integral (B, N, 3) of the CCF along one leg of the lines, seen from
    the loop at rest, where the connection is A (N, 3, d)."""
    n_nodes = NODES if form.joints == 2 else RADII
    nodes, weights = np.polynomial.legendre.leggauss(n_nodes)
    change = leg.end - leg.start
    rate_change = leg.end_rate - leg.start_rate
    total = 0.0
    for s, w in zip((nodes + 1) / 2, weights / 2):
        offset = leg.start + s * change
        rate = rest_rate + leg.start_rate + s * rate_change
        value = form(rest + offset, change, rate)
        g = se2.exp(np.einsum("nij,bnj->bni", A, offset + 0 * rest))
        total = total + w * np.einsum("...ij,...j->...i", se2.adjoint(g), value)
    return total


def _transport(A_at: Callable, rest: np.ndarray, leg: _Leg) -> np.ndarray:
    """Return the poses (B, 3) at the end of a leg, at phase 0, relative to those at its
    start; rest: (d,), on the loop at rest."""
    start, end = (x if x.ndim == 1 else x[:, 0] for x in (leg.start, leg.end))
    change = end - start
    pose = np.zeros((len(change), 3))
    for k in range(STEPS):
        A = A_at(rest + start + (k + 0.5) / STEPS * change)
        step = np.einsum("bij,bj->bi", A, change / STEPS)
        pose = se2.compose(pose, se2.exp(step))
    return pose
