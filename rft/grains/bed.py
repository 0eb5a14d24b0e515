"""Beds of spherical grains with Hertz-Mindlin contacts: what they are made of, and
which time step resolves them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from rft.core.checks import Number, check_numbers
from rft.core.metres import GRAVITY
from rft.core.refusal import require

# of all the bed, voids at floor and surface included, assumed to count grains; 0.6
# within, measured
PACKING = 0.56
# of the Rayleigh time: the largest time step (Otsubo et al., Comput. Geotech. 86, 67
# (2017), discuss it)
SHARE = 0.2
PITCH = 1.02  # of the lattice that grains fall from, in largest diameters
JITTER = 0.04  # of the lattice, diameters
MOST_GRAINS = 2_000_000

Metres = Annotated[float, Number(1e-6, 1e3, "m", "")]
Friction = Annotated[float, Number(0, 10, "-", "")]


@dataclass(frozen=True)
class Bed:
    """A bed of grains on a floor, which falls from a lattice and settles.

    length, width, depth (m): along x, along y, and of the grains before anything moves.
    diameter (m): mean of the grains'. spread (-): diameters are uniform within that
    share of the mean to both sides. density (kg/m^3): of a grain. young (Pa), poisson
    (-): elastic constants of grains, body and floor. restitution (-): of all contacts.
    friction, body_friction, floor_friction (-): between grains, of body and grain, of
    floor or wall and grain. settling_friction (-): between grains while they settle,
    `friction` if None; less of it packs them closer. walled: sides are walls, else both
    directions are periodic. seed: of the lattice and the diameters. time_step (s):
    `SHARE` of the Rayleigh time if None.

    The defaults are of plastic particles such as those of Maladen, Ding, Umbanhowar and
    Goldman, Int. J. Robot. Res. 30, 805 (2011), with a tenth of a per mille of their
    stiffness: assumed, as `friction` is.

    Examples
    --------
    >>> from rft.grains import Bed
    >>> bed = Bed(length=0.1, width=0.1, depth=0.05)
    >>> bed.grains, round(1e6 * bed.step)  # microseconds
    (2464, 98)
    """

    length: Metres = 0.28
    width: Metres = 0.24
    depth: Metres = 0.049
    diameter: Metres = 6e-3
    spread: Annotated[float, Number(0, 0.5, "-", "")] = 0.07
    density: Annotated[float, Number(1, 1e5, "kg/m^3", "")] = 1030.0
    young: Annotated[float, Number(1e3, 1e12, "Pa", "")] = 1e6
    poisson: Annotated[float, Number(0, 0.49, "-", "")] = 0.3
    restitution: Annotated[float, Number(0.01, 1, "-", "")] = 0.6
    friction: Friction = 0.3
    body_friction: Friction = 0.27
    floor_friction: Friction = 0.5
    settling_friction: Annotated[float | None, Number(0, 10, "-", "")] = None
    walled: bool = False
    seed: Annotated[int, Number(0, 2**31 - 1, "-", "", whole=True)] = 1
    time_step: Annotated[float | None, Number(1e-9, 1, "s", "")] = None

    def __post_init__(self):
        check_numbers(self)
        require(
            isinstance(self.walled, bool),
            "walled must be True or False",
            value=self.walled,
        )
        require(
            self.step <= SHARE * self.rayleigh_time * (1 + 1e-9),
            f"a time step of {self.step:.3g} s is {self.step / self.rayleigh_time:.2f} of the Rayleigh time",
            because=f"contacts are resolved up to {SHARE:g} of it",
            instead=f"take {SHARE * self.rayleigh_time:.2g} s or less, or softer grains",
        )
        narrow = min(self.length, self.width) / self.diameter
        require(
            narrow >= 6,
            f"a bed {narrow:.1f} grains wide is too small",
            instead="take six grains or more",
        )
        require(
            self.grains <= MOST_GRAINS,
            f"{self.grains:,} grains are too many",
            instead="take a smaller bed",
        )

    @property
    def rayleigh_time(self) -> float:
        """Time that a Rayleigh wave takes along the surface of the smallest grain, s:
        pi r sqrt(density/G) / (0.1631 poisson + 0.8766)."""
        shear = self.young / (2 * (1 + self.poisson))
        smallest = self.diameter / 2 * (1 - self.spread)
        return (
            math.pi
            * smallest
            * math.sqrt(self.density / shear)
            / (0.1631 * self.poisson + 0.8766)
        )

    @property
    def step(self) -> float:
        """Time step, s."""
        return self.time_step or SHARE * self.rayleigh_time

    @property
    def grains(self) -> int:
        """Number of grains, at an assumed packing of `PACKING`."""
        grain = math.pi / 6 * self.diameter**3 * (1 + self.spread**2)
        return max(1, round(PACKING * self.length * self.width * self.depth / grain))

    @property
    def weight(self) -> float:
        """Weight of a grain of mean size, N."""
        return math.pi / 6 * self.diameter**3 * self.density * GRAVITY

    def lattice(
        self, body: np.ndarray, radius: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return centres (N, 3), m, and diameters (N,), m, of grains on a cubic lattice
        with some jitter, layer by layer from the floor at z = 0, none of which touches
        the spheres of a body.

        body: (n, 3), centres of its spheres, m, periodic as the bed. radius: (n,),
        m."""
        from scipy.spatial import cKDTree

        rng = np.random.default_rng(self.seed)
        pitch = PITCH * self.diameter * (1 + self.spread)
        largest = self.diameter * (1 + self.spread)
        nx = int(self.length / pitch)
        ny = int(self.width / pitch)
        span = np.array([self.length, self.width])
        x, y = ((np.arange(n) + 0.5) * s / n - s / 2 for n, s in zip((nx, ny), span))
        layer = np.stack(np.meshgrid(x, y, indexing="ij"), -1).reshape(-1, 2)
        images = (
            [(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1)]
            if not self.walled
            else [(0, 0)]
        )
        tree = cKDTree(
            np.concatenate([body + [*(span * image), 0.0] for image in images])
        )
        radii = np.tile(radius, len(images))
        found = []
        height = 0.52 * largest
        while sum(map(len, found)) < self.grains:
            points = np.column_stack([layer, np.full(len(layer), height)])
            points += rng.uniform(-JITTER / 2, JITTER / 2, points.shape) * self.diameter
            near = tree.query_ball_point(points, radius.max() + largest)
            clear = [
                all(
                    np.linalg.norm(points[k] - tree.data[j]) > radii[j] + 0.55 * largest
                    for j in some
                )
                for k, some in enumerate(near)
            ]
            found.append(points[clear])
            height += pitch
        centres = np.concatenate(found)[: self.grains]
        return centres, self.diameter * rng.uniform(
            1 - self.spread, 1 + self.spread, len(centres)
        )
