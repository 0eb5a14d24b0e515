"""The CCF of three and more joints, and its integral over a surface that a loop spans.

It is a field of two-forms, with one component for each pair of joints:

    CCF = sum over i < j of CCF_ij dalpha_i ^ dalpha_j,
    displacement ~ exp of its integral over the surface.

With two joints there is one surface, the area. With more there are many, and CCF = dA +
[A, A] is not closed: by the Bianchi identity its derivative is the bracket of A and
CCF. So x and y depend on the surface, by a part of order 3 in the gait's size, the
order of the estimate's own error; they do not for a loop in a plane and surfaces there.
Turning, which has no bracket, is closed. `spanned` measures the dependence, from cones
over the loop with different tips.

Where a field of many joints does not fit into memory, `spanned_by` evaluates A on the
surfaces alone. Sparse grids do not help. For a viscous chain of five links within 2.5
rad, a grid of 2,929 shapes (Smolyak's) misses 40 to 50 % of the components x and y, a
tensor grid of 2,401 shapes with quintic splines 11 %; within 1.2 rad they miss 0.5 to 1
%, and 0.1 to 0.3 %."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import combinations
from typing import NamedTuple

import numpy as np

from geomech.mathematics.geometry.connection import SAMPLES_TOGETHER, Connection
from geomech.mathematics.geometry.curvature import ccf
from geomech.mathematics.geometry.curvature import error as ccf_error
from geomech.mathematics.geometry.gait import Gait, checked_gait
from geomech.mathematics.geometry.periods import ends_differ
from geomech.mathematics.geometry.representations.field import Field
from geomech.mathematics.geometry.representations.plane import (
    pair_periods,
    plane_shapes,
)
from rft.core.checks import in_range, real_array
from rft.core.refusal import Refusal
from rft.formulas import se2

RADII = 6  # nodes of Gauss's rule along a cone


@dataclass(frozen=True, eq=False)
class TwoForm:
    """CCF_ij of all pairs i < j.

    field: values (pairs, 3, N_1, ..., N_d). pairs: of joints, counted from 1, in
    the field's order."""

    field: Field
    pairs: tuple[tuple[int, int], ...]

    def __repr__(self) -> str:
        pairs = f"{len(self.pairs)} pairs of {self.field.joints} joints"
        return f"TwoForm({pairs}; {self.field!r})"

    def pair(self, i: int, j: int) -> Field:
        """Return CCF_ij, values (3, N_1, ..., N_d), of the joints i and j, counted from
        1; CCF_ji has the opposite sign."""
        if {i, j} not in map(set, self.pairs) or i == j:
            raise Refusal(
                f"i and j must be two of the joints 1 to {self.field.joints},"
                f" got {i} and {j}"
            )
        sign = 1.0 if i < j else -1.0
        values = sign * self.field.values[self.pairs.index((min(i, j), max(i, j)))]
        return replace(self.field, values=values)

    def slice(self, i: int, j: int, at) -> Field:
        """Return CCF_ij over the plane of joints i and j through the shape ``at`` (d,):
        a field of two joints, for pictures."""
        at = self.field.inside(real_array("at", at))
        axes = (self.field.axes[i - 1], self.field.axes[j - 1])
        periods = pair_periods(self.field.periods, (i, j))
        shapes = plane_shapes(axes, (i, j), at)
        values = np.moveaxis(self.pair(i, j)(shapes), -1, 0)
        return replace(self.field, axes=axes, values=values, periods=periods)

    @property
    def joints(self) -> int:
        """Number d of joints."""
        return self.field.joints

    def inside(self, alpha) -> np.ndarray:
        """Return alpha as an array; Refusal outside the grid (`Field.inside`)."""
        return self.field.inside(alpha)

    def __call__(self, alpha, u, v) -> np.ndarray:
        """Return CCF(u, v) (..., 3) at shapes alpha (..., d), for changes of shape u, v
        (..., d)."""
        i, j = np.array(self.pairs).T - 1
        area = u[..., i] * v[..., j] - u[..., j] * v[..., i]
        return np.einsum("...pc,...p->...c", self.field(alpha), area)


def two_form(connection: Connection) -> TwoForm:
    """Return the CCF of all pairs of joints, of order `Connection.degree` in the
    spacing."""
    return _from_pairs(ccf, connection)


def error(connection: Connection) -> TwoForm:
    """Return the estimated error of `two_form`, by pair
    (`geomech.mathematics.geometry.curvature.error`)."""
    return _from_pairs(ccf_error, connection)


def _from_pairs(component: Callable, connection: Connection) -> TwoForm:
    """Return the two-form with component(connection, i, j) for each pair of joints."""
    pairs = tuple(combinations(range(1, len(connection.axes) + 1), 2))
    if not pairs:
        raise Refusal(
            "a CCF needs at least two joints",
            because="a loop of one joint encloses no area",
        )
    values = np.stack([component(connection, i, j).values for i, j in pairs])
    return TwoForm(replace(connection.field, values=values), pairs)


class Spanned(NamedTuple):
    """Displacements of loops by integrals over cones.

    net: (B, 3), by the cone from the mean of the loop. others: (B, tips, 3), by cones
    from shapes on the loop. spread: (B, 2), the largest distance of these from net, of
    positions in the form's unit of length and of headings in rad: the part that depends
    on the surface."""

    net: np.ndarray
    others: np.ndarray
    spread: np.ndarray


def spanned(
    form: TwoForm, gait: Gait, amplitudes=None, phases: int = 256, tips: int = 4
) -> Spanned:
    """Return the displacements by the area tier of a gait of any number of joints, for
    amplitudes (B,) or its own.

    How much they depend on the surface is measured with ``tips`` other cones. Refusal
    where the gait leaves the field, whose box holds every cone over a loop in it."""
    in_range("phases", phases, 8, 1e6, whole=True)
    in_range("tips", tips, 0, phases, whole=True)
    if checked_gait(gait).joints != form.joints:
        raise Refusal(
            f"the gait moves {gait.joints} joints, the field has {form.joints}"
        )
    refuse_winding(gait)
    amplitudes = gait_amplitudes(gait, amplitudes)
    batch = max(1, SAMPLES_TOGETHER // int(phases))
    results = []
    for k in range(0, max(1, len(amplitudes)), batch):
        group = amplitudes[k : k + batch]
        results.append(_cones(form, gait, group, int(phases), int(tips)))
    net, others = zip(*results)
    return with_spread(np.concatenate(net), np.concatenate(others))


def refuse_winding(gait: Gait) -> None:
    """Refuse a gait whose ends differ, as it encloses no area."""
    if ends_differ(gait):
        raise Refusal(
            "the gait ends at another angle than it starts at, and encloses no area",
            because="it winds around a variable that repeats",
            instead="use geomech.mathematics.geometry.loop_at_rest.wound_area, or path "
            "or direct",
        )


def gait_amplitudes(gait: Gait, amplitudes) -> np.ndarray:
    """Return amplitudes (B,); the gait's own for None."""
    if amplitudes is None:
        amplitudes = gait.amplitude
    return np.atleast_1d(real_array("amplitudes", amplitudes))


def spanned_by(
    A: Callable,
    gait: Gait,
    amplitudes=None,
    phases: int = 256,
    tips: int = 2,
    around: int = 64,
) -> Spanned:
    """Return `spanned` without a field: A(alpha) -> (..., 3, d) is evaluated at shapes
    (..., d) of the cones.

    By Stokes's theorem the integral of dA is the integral of A along the loop, of
    ``phases``, whatever the surface; only [A, A] is integrated over each cone, at
    ``around`` phases."""
    in_range("phases", phases, 8, 1e6, whole=True)
    in_range("tips", tips, 0, around, whole=True)
    refuse_winding(checked_gait(gait))
    amplitudes = gait_amplitudes(gait, amplitudes)
    alpha, alphadot = checked_gait(gait).cycle(int(phases), amplitudes)
    along = np.einsum("...ij,...j->...i", A(alpha), alphadot).mean(1)

    around = max(int(around), 4 * gait.harmonics + 2)
    alpha, alphadot = gait.cycle(around, amplitudes)
    poses = []
    for tip in _tips(alpha, tips):
        integral = along + _brackets(A, alpha, alphadot, tip)
        poses.append(se2.exp(2 * np.pi * integral))
    poses = np.stack(poses, 1)
    return with_spread(poses[:, 0], poses[:, 1:])


def _tips(alpha: np.ndarray, count: int) -> list[np.ndarray]:
    """Return the tips (B, 1, d) of cones over loops alpha (B, N, d): their mean shapes,
    then ``count`` shapes on them."""
    phases = alpha.shape[1]
    on_loop = [alpha[:, k * phases // count, None] for k in range(count)]
    return [alpha.mean(1, keepdims=True), *on_loop]


def _brackets(A: Callable, alpha, alphadot, tip) -> np.ndarray:
    """Return the integral (B, 3) of [A, A] over tip + s (alpha - tip), over 2 pi."""
    nodes, weights = np.polynomial.legendre.leggauss(RADII)
    total = 0.0
    for s, w in zip((nodes + 1) / 2, weights / 2):
        A_cone = A(tip + s * (alpha - tip))
        u = np.einsum("...ij,...j->...i", A_cone, alpha - tip)
        v = np.einsum("...ij,...j->...i", A_cone, s * alphadot)
        total = total + w * se2.bracket(u, v).mean(1)
    return total


def with_spread(net: np.ndarray, others: np.ndarray) -> Spanned:
    """Return the displacement with the spread of poses (B, tips, 3) from net (B, 3)."""
    difference = others - net[:, None]
    position = np.hypot(difference[..., 0], difference[..., 1])
    heading = np.abs(difference[..., 2])
    spread = np.stack([position, heading], -1).max(1, initial=0.0)
    return Spanned(net, others, spread)


def _cones(
    form: TwoForm, gait: Gait, amplitudes, phases: int, tips: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return exp of the integrals over the cone from the mean shape (B, 3), and over
    the cones from shapes on the loop (B, tips, 3)."""
    alpha, alphadot = gait.cycle(phases, amplitudes)  # (B, N, d)
    form.inside(alpha)
    poses = [_cone(form, alpha, alphadot, tip) for tip in _tips(alpha, tips)]
    poses = np.stack(poses, 1)
    return poses[:, 0], poses[:, 1:]


def _cone(form: TwoForm, alpha, alphadot, tip) -> np.ndarray:
    """Return exp of the integral (B, 3) over tip + s (alpha - tip), s from 0 to 1."""
    nodes, weights = np.polynomial.legendre.leggauss(RADII)
    total = 0.0
    for s, w in zip((nodes + 1) / 2, weights / 2):
        values = form(tip + s * (alpha - tip), alpha - tip, s * alphadot)
        total = total + w * values.mean(1)
    return se2.exp(2 * np.pi * total)
