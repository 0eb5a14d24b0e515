"""Regularised Stokeslets spread along the centre lines of the links.

A force f that is spread over a small ball of size e about a point causes the velocity
(R. Cortez, SIAM J. Sci. Comput. 23, 1204 (2001), in three dimensions)

    8 pi mu v = (r^2 + 2 e^2) / R^3 f + (r . f) r / R^3,    R^2 = r^2 + e^2.

Each link is cut into segments with a constant force per length. Along the link, at
distances x along and d across, the integrals over a segment close, with c^2 = d^2 + e^2
and [] the difference between its ends:

    I = int 1 / R = [asinh(x / c)],   G = [x / R],   J = [-1 / R]
    tt = 2 I - d^2 / c^2 G,   nn = I + G,   tn = d J.

The velocity that counts is the mean over a segment (a Galerkin method), so that the
mobility is symmetric. On the same link the mean closes too, by the second integrals x
asinh(x / e) - R of 1 / R, and R of e^2 / R^3; between links it is a rule of Gauss. A
segment may be longer than e, so that the number of segments does not grow with the
slenderness (R. Cortez, J. Comput. Phys. 375, 783 (2018), for linear forces).

The size of the ball follows from the radius a of the links: far from its ends a line of
these Stokeslets gives 4 ln(l / e) + ... along and 2 ln(l / e) + 2 + ... across, and
slender-body theory for a cylinder 4 ln(l / a) - 2 and 2 ln(l / a) + 1. Both agree for

    e = sqrt(exp(1)) a = 1.65 a.

That the size must be proportional to the radius, with a factor from slender-body
theory, is the result of B. Zhao and L. Koens, Fluids 6, 335 (2021).

Links meet in the point of a joint, where the balls overlap; nothing is left out."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from rft.core.checks import Number, check_numbers
from rft.core.refusal import Refusal
from rft.hydrodynamics.base import Sites, divided

BLOB = math.exp(0.5)  # size of the ball over the radius of the link
MOST_SLENDER = 1e5
# Shortest segment over the size of the ball. The matrix then has a condition number of
# some 1e6, and of 1e12 at half of this (measured).
SHORTEST_SEGMENT = 0.25
# Points on each segment, of a rule of Gauss, at which velocities from other links are
# averaged. 3, 6 and 10 points differ by 3e-4 in the displacement of three links.
POINTS = 4


@dataclass(frozen=True)
class Stokeslets:
    """Regularised Stokeslets along the links; see the module.

    slenderness (-): length of the body over its diameter. segments (-): number of
    segments of the whole body, shared out in proportion to the links' lengths.

    Examples
    --------
    >>> from rft import Chain
    >>> from rft.hydrodynamics import Stokeslets, resistance
    >>> resistance(Stokeslets(48, 24), Chain(), [[0.5, 0.3]]).connection.round(4)
    array([[[-0.0028, -0.0005],
            [-0.0104, -0.0091],
            [-0.0702,  0.0614]]])
    """

    slenderness: Annotated[
        float, Number(1, MOST_SLENDER, "-", "length of the body over its diameter")
    ]
    segments: Annotated[
        int, Number(1, 2000, "-", "number of segments of the body", whole=True)
    ]

    def __post_init__(self):
        check_numbers(self)
        most = most_segments(self.slenderness)
        if self.segments > most:
            raise Refusal(
                f"{self.segments} segments of a body of slenderness "
                f"{self.slenderness:g} are shorter than a quarter of the ball over "
                "which a force is spread, and the equations are ill-conditioned",
                instead=f"use {most} segments or fewer",
            )

    @property
    def radius(self) -> float:
        return 0.5 / self.slenderness

    def sites(self, fractions: np.ndarray) -> Sites:
        counts = np.round(fractions * self.segments).astype(int)
        return divided(fractions, np.maximum(1, counts))

    def mobility(
        self, sites: Sites, centre: np.ndarray, heading: np.ndarray
    ) -> np.ndarray:
        n = centre.shape[1]
        size = BLOB * self.radius
        M = np.empty((len(centre), 2, n, 2, n))
        links = [np.flatnonzero(sites.link == k) for k in range(sites.link[-1] + 1)]
        for i, rows in enumerate(links):
            for j, columns in enumerate(links):
                towards = heading[:, columns[0], None, None]
                if i == j:
                    tt, nn, tn = _same_link(sites.ahead[rows], sites.half[rows], size)
                else:
                    tt, nn, tn = _other_link(
                        centre, heading, sites.half, rows, columns, size
                    )
                c = towards.real
                s = towards.imag
                xy = c * s * (tt - nn) + (c * c - s * s) * tn
                at = np.ix_(rows, columns)
                M[:, 0, :, 0][:, *at] = c * c * tt - 2 * c * s * tn + s * s * nn
                M[:, 1, :, 1][:, *at] = s * s * tt + 2 * c * s * tn + c * c * nn
                M[:, 0, :, 1][:, *at] = xy
                M[:, 1, :, 0][:, *at] = xy
        M = M.reshape(-1, 2 * n, 2 * n)
        # Between links the mean over the first and the integral over the second are
        # exchanged in the transposed block.
        return (M + M.swapaxes(1, 2)) / 2


def most_segments(slenderness: float, shortest: float = SHORTEST_SEGMENT) -> int:
    """Return the largest number of segments of a body none of which is shorter than
    ``shortest`` sizes of the ball."""
    return int(2 * slenderness / (BLOB * shortest))


def _same_link(ahead: np.ndarray, half: np.ndarray, size: float) -> tuple:
    """Return means (n, n) of the velocity along and across a link, and 0, from unit
    forces on its segments."""
    low = ahead - half
    high = ahead + half

    def mean(second_integral):
        """Return the double integral over two segments, over both lengths."""
        total = (
            second_integral(high[:, None] - low)
            + second_integral(low[:, None] - high)
            - second_integral(high[:, None] - high)
            - second_integral(low[:, None] - low)
        )
        return total / (4 * half[:, None] * half)

    def distance(x):
        return np.sqrt(x * x + size * size)

    def of_inverse(x):
        return x * np.arcsinh(x / size) - distance(x)

    inverse = mean(of_inverse)
    return 2 * inverse, inverse + mean(distance), 0.0


def _other_link(centre, heading, half, rows, columns, size: float) -> tuple:
    """Return means (B, rows, columns) over segments of one link of the velocities
    (along, across, mixed) that unit forces on segments of another cause, in the
    directions of that other link."""
    node, weight = np.polynomial.legendre.leggauss(POINTS)
    back = heading[:, columns[0], None].conj()
    at = (half[rows, None] * node).ravel()
    points = np.repeat(centre[:, rows], POINTS, 1) + heading[:, rows[0], None] * at
    points = points * back
    middle = centre[:, columns] * back
    half = half[columns]
    ends = np.concatenate([middle - half, (middle + half)[:, -1:]], 1)

    separation = points[:, :, None] - ends[:, None]
    x = separation.real
    d = separation.imag
    c2 = d * d + size * size
    R = np.sqrt(x * x + c2)

    def between_ends(values):
        return values[..., :-1] - values[..., 1:]

    integral = between_ends(np.arcsinh(x / np.sqrt(c2)))  # int 1 / R
    G = between_ends(x / R)
    J = between_ends(-1 / R)
    d = d[..., :-1]
    share = d * d / c2[..., :-1]

    def mean(values):
        shape = (len(points), len(rows), POINTS, len(columns))
        return np.einsum("biqj,q->bij", values.reshape(shape), weight) / (4 * half)

    return mean(2 * integral - share * G), mean(integral + G), mean(d * J)
