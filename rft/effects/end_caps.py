"""Drag on the ends of the body, head and tail."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from rft.core.checks import Number, check_numbers, unmasked
from rft.core.refusal import require
from rft.effects.base import EFFECTS, Effect, InMetres
from rft.effects.contact import NO_FACTOR, Contact, Problem
from rft.formulas.link import dry_point
from rft.laws.batch import for_samples
from rft.laws.granular import Granular


@EFFECTS.register
@dataclass(frozen=True)
class EndCaps(Effect):
    """Flat or rounded ends: axial force e pi r^2 C_S sin(atan(cot gamma0 cos psi)),
    lateral e pi r^2 C_F sin psi.

    Source: the end forces of the cylinder in granular resistive force theory as written
    in third-party code, C_S / C_F being C of Eq. 3. Granular media only. The axial
    force is e pi r^2 C_S cos gamma0 v_t / sqrt(v_t^2 + q^2 v_n^2) with q = sin gamma0;
    ``across`` is another q. Round ends of rods in simulated grains have q = 1.2 +- 0.3
    (sample flank-drag): an axial force nearly as cos psi.

    Examples
    --------
    >>> from rft import Chain, Granular, body_velocity
    >>> from rft.effects import EndCaps
    >>> law = Granular(1.8, 0.24)
    >>> caps = EndCaps(radius=0.04)
    >>> body_velocity(law, Chain(), [0.5, 0.3], [1.0, 0.0], effects=[caps]).xi.round(4)
    array([ 0.0151,  0.0128, -0.1833])
    """

    radius: Annotated[
        float | None, Number(0, 1, "body lengths", "radius of the body; or radius_m")
    ] = None
    head: Annotated[
        float, Number(0, 100, "-", "factor e of the head: 0 none, 1 flat, 4 hemisphere")
    ] = 1.0
    tail: Annotated[
        float, Number(0, 100, "-", "factor e of the tail: 0 none, 1 flat, 4 hemisphere")
    ] = 1.0
    across: Annotated[
        float | None,
        Number(
            0,
            100,
            "-",
            "q of the axial force: sin gamma0 if left out, 1 for a force "
            "proportional to cos psi",
        ),
    ] = None
    radius_m: Annotated[
        float | None,
        Number(0, 1e6, "m", "radius of a body with a length, instead of radius"),
    ] = None

    kind = "end-caps"
    knows_contact = True
    mixes_media = True
    metres = {"radius": InMetres("radius_m")}
    adds_points = odd = True
    limit = "radius = 0"
    cost = "one point load per end"

    def __post_init__(self):
        check_numbers(self)
        self.check_lengths()

    def check(self, medium: Any) -> None:
        require(
            isinstance(medium, Granular),
            f"end caps need a granular medium, got {type(medium).__name__}",
        )

    def apply(self, problem: Problem, site: Any = None, state: Any = None) -> Problem:
        e = problem.sides.elements
        # In units of the whole body's axial drag 2 r C_F L: e pi r^2 C_F / (2 r C_F L)
        # = e pi (r / L) / 2.
        weight = math.pi * self.radius / 2 * np.array([[self.tail], [self.head]])
        ends = e.attached_points([0, -1], e.half[[0, -1]] * [[-1.0], [1.0]], weight)
        station = np.array([[0.0], [1.0]])
        points = Contact(ends, station, buried=np.ones((2, 1)))
        if problem.sides.factor is not NO_FACTOR:
            # Effects that add points act first: the factors are those of contact.
            lifted = [x[[0, -1]] for x in problem.sides.factor]
            points = points.with_factors(*lifted)
        terms = for_samples(problem.medium, self.terms)
        return problem.with_points(points, terms)

    def traction(
        self, medium: Granular, v_t: Any, v_n: Any, rounding: Any = 0.0
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the force (along, across) of both ends together at velocities
        (v_t, v_n), in units of the body's axial drag; ValueError unless the radius is
        in body lengths."""
        require(
            self.radius is not None,
            "the traction of end caps needs their radius in body lengths",
            instead="use ``in_body_lengths`` with the length of the body",
        )
        v_t = unmasked("v", v_t)
        v_n = unmasked("v", v_n)
        load = dry_point(v_t, v_n, rounding, np.array(self.terms(medium)))
        factor = (self.head + self.tail) * math.pi * self.radius / 2
        return factor * load.t, factor * load.n

    def terms(self, medium: Granular) -> list[tuple[float, float, float]]:
        """Return the dry terms (q, k_t, k_n) of a flat end, whose normal is the body's
        axis: f_t = C cos gamma0 v_t / sqrt(v_t^2 + q^2 v_n^2), f_n = v_n."""
        q = self.across
        if q is None:
            q = math.sin(medium.gamma0)
        return [(1.0, 1.0, 0.0), (q, 0.0, medium.C * math.cos(medium.gamma0))]

    @classmethod
    def examples(cls, x: float = 0.3) -> dict[str, EndCaps]:
        return {"end-caps": cls(radius=0.1 * x, tail=4.0)}
