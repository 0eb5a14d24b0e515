"""Chains of links in a viscous fluid whose links feel each other's flow: without
resistive force theory, at the price of a dense system of equations for each shape
(`rft.hydrodynamics`).

The two systems differ in their model of the links: touching beads, or Stokeslets spread
along the links. Both end where links touch that are no neighbours: such shapes are
singular. Neighbouring links overlap at their joint in every shape."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from geomech.mathematics.geometry.reconstruct import displacement
from geomech.mathematics.geometry.representations.images import cycle_images
from geomech.mathematics.geometry.traits import Traits
from geomech.mathematics.systems.base import SYSTEMS, Cycle
from geomech.mathematics.systems.capabilities import BalanceSize
from rft.bodies import Chain
from rft.bodies.base import Length, body_size, is_reversible
from rft.core.checks import Number, check_numbers, unmasked
from rft.core.refusal import Refusal
from rft.formulas.cylinders import drag_ratio
from rft.hydrodynamics import (
    Beads,
    FluidModel,
    Resistance,
    Stokeslets,
    axial_drag,
    clearance,
    resistance,
)
from rft.hydrodynamics.beads import MOST_SLENDER as MOST_BEADS
from rft.hydrodynamics.stokeslets import BLOB, MOST_SLENDER, most_segments
from rft.hydrodynamics.stokeslets import SHORTEST_SEGMENT as SHORTEST

LEAST_SLENDER = 5.0
SHORTEST_LINK = 1.5  # diameters: then links between which one lies stay apart (assumed)
SEGMENTS = 8  # on a link of mean length
# Shortest segments over the size of the ball over which a force is spread, where their
# number is chosen: shorter ones resolve only the forces at the ends, which grow without
# limit. Of a given number: those of its refinement are half as long, and its equations
# have a condition number of 1e6.
CHOSEN_SEGMENT = 1.0
SHORTEST_SEGMENT = 2 * SHORTEST
# s for each shape, measured: besides, and of the solution by the cube of the number of
# sites. That of the matrix, by the square, differs between models.
SECONDS_PER_SHAPE = 3e-5
SECONDS_PER_TRIPLE = 2.5e-10
SINGULAR = "links that are not neighbours come within a diameter of each other"


@dataclass(frozen=True)
class StokesFlow:
    """Base of chains of links in Stokes flow.

    lengths (-): relative link lengths, tail to head, all > 0, at least two. frame (-):
    "mean", centre of mass and mean heading by length, or "link-1", "link-2" ..., those
    of that link."""

    lengths: tuple[float, ...] = (1.0, 1.0, 1.0)
    length: Length = None
    frame: str = "mean"
    slenderness: Annotated[
        float,
        Number(
            LEAST_SLENDER,
            MOST_SLENDER,
            "-",
            "length of the body over its diameter, at least 5",
        ),
    ] = 48.0

    model: ClassVar[FluidModel]
    seconds_per_pair: ClassVar[float]

    def __post_init__(self):
        check_numbers(self)
        chain = self._chain
        object.__setattr__(self, "lengths", chain.lengths)
        shortest = chain.fractions.min() * self.slenderness
        if shortest < SHORTEST_LINK:
            enough = self.slenderness * SHORTEST_LINK / shortest
            raise Refusal(
                f"the shortest link is {shortest:.3g} diameters long, and must be "
                f"{SHORTEST_LINK:g} or more",
                instead=f"raise slenderness to {np.ceil(enough):.0f} or more",
            )

    @property
    def joints(self) -> int:
        return len(self.lengths) - 1

    @cached_property
    def _chain(self) -> Chain:
        return Chain(self.lengths, self.length, self.frame)

    @property
    def traits(self) -> Traits:
        return Traits(
            linear=True,
            mirror=True,
            reversible=is_reversible(self._chain),
            power_degree=2.0,
            joint_angles=True,
            frame=self.frame,
            singularity=self._gap,
            singular=SINGULAR,
        )

    def _gap(self, alpha: ArrayLike) -> np.ndarray:
        """Return the smallest gap (...) between links, body lengths; negative where
        they overlap."""
        return clearance(self._chain, alpha) - 2 * self.model.radius

    def refuse_singular(self, alpha: ArrayLike) -> None:
        """Refuse a closed path alpha (..., N, joints) on which links overlap."""
        alpha = unmasked("alpha", alpha)
        overlapping = self._gap(alpha) <= 0
        if overlapping.any():
            shape = ", ".join(f"{x:.3g}" for x in alpha[overlapping][0])
            raise Refusal(
                f"the gait passes the singular shape alpha = ({shape}), where "
                f"{SINGULAR}",
                instead="move its centre, or lower the amplitude",
            )

    def about(self) -> dict:
        return {"singular_shapes": f"nan, where {SINGULAR}"}

    def points(self, alpha: ArrayLike, pose: ArrayLike = (0.0, 0.0, 0.0)) -> np.ndarray:
        """Return the ends of the links in the world, as `rft.Chain.points`."""
        return self._chain.points(alpha, pose)

    def frame_pose(
        self, frame: str, alpha: ArrayLike, alphadot: ArrayLike
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the pose of a frame and its rate, as `rft.Chain.frame_pose`."""
        return self._chain.frame_pose(frame, alpha, alphadot)

    def resistance(self, alpha: ArrayLike) -> Resistance:
        """Return the resistance at shapes (B, joints); nan at singular ones."""
        alpha = unmasked("alpha", alpha)
        good = self._gap(alpha) > 0
        regular = resistance(self.model, self._chain, alpha[good])
        matrices = []
        for matrix in regular:
            full = np.full((len(alpha), *matrix.shape[1:]), np.nan)
            full[good] = matrix
            matrices.append(full)
        return Resistance(*matrices)

    def _at_shapes(self, quantity: Callable, alpha: ArrayLike) -> np.ndarray:
        """Return a matrix (..., k, d) of the resistance at shapes (..., d), each of
        which is solved once, however many rates follow."""
        alpha = unmasked("alpha", alpha)
        repeated = [size > 1 and step == 0 for size, step in _axes(alpha)]
        distinct = alpha[tuple(slice(1) if x else slice(None) for x in repeated)]
        lead = distinct.shape[:-1]
        matrix = quantity(self.resistance(distinct.reshape(-1, self.joints)))
        return matrix.reshape(*lead, *matrix.shape[1:])

    def velocity(self, alpha: ArrayLike, alphadot: ArrayLike) -> np.ndarray:
        """Return xi (..., 3) in the frame, (length/time, length/time, rad/time); nan at
        singular shapes."""
        A = self._at_shapes(lambda r: r.connection, alpha)
        alphadot = unmasked("alphadot", alphadot)
        scale = [body_size(self), body_size(self), 1.0]
        return (A @ alphadot[..., None])[..., 0] * scale

    def power(self, alpha: ArrayLike, alphadot: ArrayLike, xi: ArrayLike) -> np.ndarray:
        # xi is that of the free body, for which the power is quadratic in alphadot.
        M = self._at_shapes(lambda r: r.dissipation, alpha)
        alphadot = unmasked("alphadot", alphadot)
        square = alphadot[..., None, :] @ M @ alphadot[..., None]
        return square[..., 0, 0] / axial_drag(self.model, self._chain)

    def run(
        self,
        alpha: ArrayLike,
        alphadot: ArrayLike,
        work: bool = False,
        start: ArrayLike | None = None,
    ) -> Cycle:
        """Return the cycle of a gait, from as few phases as symmetry allows; Refusal
        where links overlap. The equations are linear: ``start`` is not used."""
        self.refuse_singular(alpha)
        images = cycle_images(alpha, alphadot, self.traits)
        xi = self.velocity(images.select(alpha), images.select(alphadot))
        xi = images.expand(xi)
        speed = np.sqrt((alphadot**2).sum(-1)).mean(-1)
        return Cycle(
            xi=xi,
            net=displacement(xi),
            residual=0.0 * speed,
            speed=speed,
            work=None,
            cycles=1,
            to_come=0.0 * speed,
        )

    @property
    def _nonlocal_notes(self) -> tuple[str, ...]:
        """How the straight body compares with a local law."""
        rigid = self.resistance(np.zeros((1, self.joints))).rigid[0]
        return (
            f"straight: drag across over drag along {rigid[1, 1] / rigid[0, 0]:.3f}; "
            f"a cylinder of this slenderness has {drag_ratio(self.slenderness):.3f}",
        )

    @property
    def balance_size(self) -> BalanceSize:
        """Size of the balance of one shape."""
        n = len(self.model.sites(self._chain.fractions).link)
        seconds = SECONDS_PER_SHAPE + self.seconds_per_pair * n**2
        seconds += SECONDS_PER_TRIPLE * n**3
        return BalanceSize(
            elements=len(self.lengths), evaluations=n, seconds=seconds, all_rates=True
        )


def _axes(x: np.ndarray) -> list[tuple[int, int]]:
    """Return (length, step in bytes) of the leading axes of an array."""
    return list(zip(x.shape[:-1], x.strides))


@SYSTEMS.register
@dataclass(frozen=True)
class BeadSwimmer(StokesFlow):
    """Links of touching beads with the mobility of Rotne, Prager and Yamakawa
    (`rft.hydrodynamics.beads`).

    The number of beads is the slenderness; it is the model itself, and has no numerical
    error. A link whose length is no whole number of diameters has beads that overlap or
    gap a little.

    Examples
    --------
    >>> from geomech.mathematics.systems import BeadSwimmer
    >>> BeadSwimmer(slenderness=48).velocity([0.5, 0.3], [1.0, 0.0]).round(4)
    array([-0.0026, -0.0097, -0.0711])
    """

    slenderness: Annotated[
        float,
        Number(
            LEAST_SLENDER,
            MOST_BEADS,
            "-",
            "length of the body over its diameter, 5 to 1000: the number of beads",
        ),
    ] = 48.0

    kind = "bead-swimmer"
    seconds_per_pair: ClassVar[float] = 1e-7

    @property
    def model(self) -> Beads:
        return Beads(self.slenderness)

    @property
    def notes(self) -> tuple[str, ...]:
        """What the beads are, and where they overlap."""
        sites = self.model.sites(self._chain.fractions)
        spacing = 2 * sites.half * self.slenderness
        numbers = np.bincount(sites.link)
        distance = "touching on straight links"
        if np.ptp(spacing) > 1e-9 or abs(spacing[0] - 1) > 1e-9:
            distance = (
                f"{spacing.min():.3g} to {spacing.max():.3g} diameters apart, as links "
                "are no whole number of diameters long"
            )
        return (
            f"beads: {', '.join(map(str, numbers))} on the links, {distance}; their "
            "number is the model and has no numerical error",
            "joints: where a joint bends, the last bead of a link and the first of the "
            "next overlap, with the mobility of overlapping spheres. Three equal links "
            "with a bead on each joint instead swim 0.8 % less on the circle of 1 rad "
            "at slenderness 48, and 1.7 % less at 24",
            *self._nonlocal_notes,
        )

    @classmethod
    def examples(cls) -> dict[str, BeadSwimmer]:
        return {"bead-swimmer": cls((0.7, 1.4, 0.9), 0.3, "link-1", slenderness=30.0)}


@SYSTEMS.register
@dataclass(frozen=True)
class StokesletSwimmer(StokesFlow):
    """Links along which regularised Stokeslets are spread, with a constant force per
    length on each segment (`rft.hydrodynamics.stokeslets`).

    Examples
    --------
    >>> from geomech.mathematics.systems import StokesletSwimmer
    >>> StokesletSwimmer(slenderness=48).velocity([0.5, 0.3], [1.0, 0.0]).round(4)
    array([-0.0028, -0.0104, -0.0702])
    """

    segments: Annotated[
        int | None,
        Number(
            1,
            200,
            "-",
            "number of segments on a link of mean length; other links have as many per "
            "length. If left out 8, or fewer where these would be shorter than the "
            "ball over which a force is spread, 0.82 diameters",
            whole=True,
        ),
    ] = None

    kind = "stokeslet-swimmer"
    seconds_per_pair: ClassVar[float] = 2.5e-7
    closed = False
    shortest_segment: ClassVar[float] = SHORTEST_SEGMENT

    def __post_init__(self):
        super().__post_init__()
        most = self._most_segments(self.shortest_segment)
        if self._n_segments > most:
            raise Refusal(
                f"segments = {self.segments} on each of {len(self.lengths)} links are "
                "shorter than half of the ball over which a force is spread, "
                "and the equations are ill-conditioned",
                instead=f"use at most {most}; {self._chosen_segments} are enough",
            )

    def _most_segments(self, shortest: float) -> int:
        """Return the largest number of segments on a mean link."""
        return max(1, most_segments(self.slenderness, shortest) // len(self.lengths))

    @property
    def _chosen_segments(self) -> int:
        return min(SEGMENTS, self._most_segments(CHOSEN_SEGMENT))

    @property
    def _n_segments(self) -> int:
        """Number of segments on a mean link."""
        if self.segments is None:
            return self._chosen_segments
        return self.segments

    @property
    def model(self) -> Stokeslets:
        return Stokeslets(self.slenderness, self._n_segments * len(self.lengths))

    @property
    def notes(self) -> tuple[str, ...]:
        """What the segments are, and how they are matched to a cylinder."""
        sites = self.model.sites(self._chain.fractions)
        numbers = np.bincount(sites.link)
        return (
            f"Stokeslets: {', '.join(map(str, numbers))} segments on the links; errors "
            "include the difference from twice as many",
            f"radius: a force is spread over a ball of {BLOB:.3g} radii of the link, "
            "which gives a long straight link the drag of a cylinder along and across",
            "joints: links end in one point, around which their balls overlap; nothing "
            "is left out",
            *self._nonlocal_notes,
        )

    def refined(self) -> StokesletSwimmer:
        """Return the swimmer with twice the segments."""
        fields = dataclasses.asdict(self) | {"segments": 2 * self._n_segments}
        return _FinerStokeslets(**fields)

    @classmethod
    def examples(cls) -> dict[str, StokesletSwimmer]:
        swimmer = cls((0.7, 1.4, 0.9), 0.3, "link-1", slenderness=30.0, segments=4)
        return {"stokeslet-swimmer": swimmer}


@dataclass(frozen=True)
class _FinerStokeslets(StokesletSwimmer):
    """A refinement, with segments of half the shortest length."""

    shortest_segment: ClassVar[float] = SHORTEST_SEGMENT / 2
