"""The CCF of three and more joints: a field of two-forms, one component for each pair of joints, and its integral over a
surface that a loop spans.

    CCF = sum over i < j of CCF_ij dalpha_i ^ dalpha_j,      displacement ~ exp of its integral over the surface.

With two joints there is one surface, the area. With more there are many, and CCF = dA + [A, A] is not closed: by the Bianchi
identity its derivative is the bracket of A and CCF. So x and y hang on the surface, by a part of order 3 in the gait's size, as
is what the estimate leaves out; by none for a loop in a plane and surfaces there. Turning, which has no bracket, is closed.
`spanned` tells how much, from cones over the loop with different tips.

Where a field of so many joints does not fit, `spanned_by` asks for A on the surfaces alone. Sparse grids are no help: of a
viscous chain of five links within 2.5 rad one of 2,929 shapes (Smolyak's) leaves 40 to 50 % of the rows of x and y, a tensor
grid of 2,401 with quintic splines 11 %; within 1.2 rad 0.5 to 1 %, and 0.1 to 0.3 %.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import combinations
from typing import NamedTuple

import numpy as np

from geomech.geometry.connection import SAMPLES_TOGETHER, Connection
from geomech.geometry.curvature import ccf
from geomech.geometry.curvature import error as ccf_error
from geomech.geometry.field import Field
from geomech.geometry.gait import Gait, checked_gait
from rft.core.checks import in_range, real_array
from rft.core.refusal import Refusal
from rft.formulas import se2

RADII = 6  # nodes of Gauss's rule along a cone


@dataclass(frozen=True, eq=False)
class TwoForm:
    """CCF_ij of all pairs i < j. field: values (pairs, 3, N_1, ..., N_d). pairs: of joints, from 0, in the field's order."""

    field: Field
    pairs: tuple[tuple[int, int], ...]

    def __repr__(self) -> str:
        return f"TwoForm({len(self.pairs)} pairs of {self.field.joints} joints; {self.field!r})"

    def pair(self, i: int, j: int) -> Field:
        """Return CCF_ij, values (3, N_1, ..., N_d); that of (j, i) has the other sign."""
        if {i, j} not in map(set, self.pairs) or i == j:
            raise Refusal(
                f"i and j must be two of the joints 0 to {self.field.joints - 1}, got {i} and {j}"
            )
        sign = 1.0 if i < j else -1.0
        values = sign * self.field.values[self.pairs.index((min(i, j), max(i, j)))]
        return replace(self.field, values=values)

    def slice(self, i: int, j: int, at) -> Field:
        """Return CCF_ij over the plane of joints i and j through the shape ``at`` (d,): a field of two joints, to be
        drawn."""
        at = self.field.inside(real_array("at", at))
        axes = self.field.axes[i], self.field.axes[j]
        shapes = np.broadcast_to(at, (len(axes[0]), len(axes[1]), len(at))).copy()
        shapes[..., i], shapes[..., j] = np.meshgrid(*axes, indexing="ij")
        return replace(
            self.field, axes=axes, values=np.moveaxis(self.pair(i, j)(shapes), -1, 0)
        )

    @property
    def joints(self) -> int:
        return self.field.joints

    def inside(self, alpha) -> np.ndarray:
        """Return alpha as an array; Refusal outside the grid (`Field.inside`)."""
        return self.field.inside(alpha)

    def __call__(self, alpha, u, v) -> np.ndarray:
        """Return CCF(u, v) (..., 3) at shapes alpha (..., d), for changes of shape u, v (..., d)."""
        i, j = np.array(self.pairs).T
        area = u[..., i] * v[..., j] - u[..., j] * v[..., i]
        return np.einsum("...pc,...p->...c", self.field(alpha), area)


def two_form(connection: Connection) -> TwoForm:
    """Return the CCF of all pairs of joints, of order `Connection.degree` in the spacing."""
    return _from_pairs(ccf, connection)


def error(connection: Connection) -> TwoForm:
    """Return the estimated error of `two_form`, that of each pair (`geomech.geometry.curvature.error`)."""
    return _from_pairs(ccf_error, connection)


def _from_pairs(component: Callable, connection: Connection) -> TwoForm:
    pairs = tuple(combinations(range(len(connection.axes)), 2))
    if not pairs:
        raise Refusal(
            "a CCF needs at least two joints",
            because="a loop of one joint encloses no area",
        )
    values = np.stack([component(connection, i, j).values for i, j in pairs])
    return TwoForm(replace(connection.field, values=values), pairs)


class Spanned(NamedTuple):
    """Displacement (B, 3) by the integral over a cone from the mean of the loop. others: by cones from shapes on the
    loop, (B, tips, 3). spread: (B, 2), the largest distance between them, of positions in the form's unit of length and
    of headings in rad: the part that depends on the surface."""

    net: np.ndarray
    others: np.ndarray
    spread: np.ndarray


def spanned(
    form: TwoForm, gait: Gait, amplitudes=None, phases: int = 256, tips: int = 4
) -> Spanned:
    """Return the displacements by the area tier of a gait of any number of joints, for amplitudes (B,) or its own, and
    how much depends on the surface, by ``tips`` others. Refusal where the gait leaves the field, whose box holds every
    cone over a loop in it."""
    in_range("phases", phases, 8, 1e6, whole=True)
    in_range("tips", tips, 0, phases, whole=True)
    if checked_gait(gait).joints != form.joints:
        raise Refusal(
            f"the gait moves {gait.joints} joints, the field has {form.joints}"
        )
    amplitudes = np.atleast_1d(
        real_array("amplitudes", gait.amplitude if amplitudes is None else amplitudes)
    )
    batch = max(1, SAMPLES_TOGETHER // int(phases))
    groups = [
        amplitudes[k : k + batch] for k in range(0, max(1, len(amplitudes)), batch)
    ]
    net, others = map(
        np.concatenate,
        zip(*(_cones(form, gait, group, int(phases), int(tips)) for group in groups)),
    )
    return _with_spread(net, others)


def spanned_by(
    A: Callable,
    gait: Gait,
    amplitudes=None,
    phases: int = 256,
    tips: int = 2,
    around: int = 64,
) -> Spanned:
    """Return `spanned` without a field: A (..., 3, d) is evaluated at shapes (..., d) of the cones. By Stokes's theorem
    the integral of dA is that of A along the loop, of ``phases``, whatever the surface; only [A, A] is integrated over
    each cone, at ``around`` phases."""
    in_range("phases", phases, 8, 1e6, whole=True)
    in_range("tips", tips, 0, around, whole=True)
    amplitudes = np.atleast_1d(
        real_array("amplitudes", gait.amplitude if amplitudes is None else amplitudes)
    )
    alpha, alphadot = checked_gait(gait).cycle(int(phases), amplitudes)
    along = np.einsum("...ij,...j->...i", A(alpha), alphadot).mean(1)
    alpha, alphadot = gait.cycle(max(int(around), 4 * gait.harmonics + 2), amplitudes)
    tips_at = [
        alpha.mean(1, keepdims=True),
        *(alpha[:, k * alpha.shape[1] // max(1, tips), None] for k in range(tips)),
    ]
    net, *others = (
        se2.exp(2 * np.pi * (along + _brackets(A, alpha, alphadot, tip)))
        for tip in tips_at
    )
    return _with_spread(
        net, np.stack(others, 1) if others else np.zeros((len(net), 0, 3))
    )


def _brackets(A: Callable, alpha, alphadot, tip) -> np.ndarray:
    """Return integral (B, 3) of [A, A] over tip + s (alpha - tip), over 2 pi."""
    nodes, weights = np.polynomial.legendre.leggauss(RADII)
    total = 0.0
    for s, w in zip((nodes + 1) / 2, weights / 2):
        A_cone = A(tip + s * (alpha - tip))
        u, v = (
            np.einsum("...ij,...j->...i", A_cone, x)
            for x in (alpha - tip, s * alphadot)
        )
        total = total + w * se2.bracket(u, v).mean(1)
    return total


def _with_spread(net: np.ndarray, others: np.ndarray) -> Spanned:
    """Return the displacement with the spread of poses (B, tips, 3) from net (B, 3)."""
    difference = others - net[:, None]
    spread = np.stack(
        [np.hypot(difference[..., 0], difference[..., 1]), np.abs(difference[..., 2])],
        -1,
    ).max(1, initial=0.0)
    return Spanned(net, others, spread)


def _cones(
    form: TwoForm, gait: Gait, amplitudes, phases: int, tips: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return exp of the integrals over the cone from the mean shape (B, 3), and over those from shapes on the loop (B,
    tips, 3)."""
    alpha, alphadot = gait.cycle(phases, amplitudes)  # (B, N, d)
    form.inside(alpha)
    on_loop = [alpha[:, k * phases // tips, None] for k in range(tips)]
    first, *others = (
        _cone(form, alpha, alphadot, tip)
        for tip in (alpha.mean(1, keepdims=True), *on_loop)
    )
    return first, np.stack(others, 1) if others else np.zeros((len(alpha), 0, 3))


def _cone(form: TwoForm, alpha, alphadot, tip) -> np.ndarray:
    """Return exp of the integral (B, 3) over tip + s (alpha - tip), s from 0 to 1."""
    nodes, weights = np.polynomial.legendre.leggauss(RADII)
    total = 0.0
    for s, w in zip((nodes + 1) / 2, weights / 2):
        total = total + w * form(
            tip + s * (alpha - tip), alpha - tip, s * alphadot
        ).mean(1)
    return se2.exp(2 * np.pi * total)
