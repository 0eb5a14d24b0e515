"""Beds of spherical grains with Hertz-Mindlin contacts: material, size, time step."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from rft.core.checks import Number, check_numbers
from rft.core.metres import GRAVITY
from rft.core.refusal import require

# Share of the bed's volume that is grains, voids at floor and surface included, assumed
# to count grains; 0.6 within, measured.
PACKING = 0.56
# Largest time step over the Rayleigh time; Otsubo et al., Comput. Geotech. 86, 67
# (2017), discuss it.
RAYLEIGH_SHARE = 0.2
PITCH = 1.02  # of the lattice that grains fall from, in largest diameters
JITTER = 0.04  # of the lattice, diameters
FIRST_LAYER = 0.52  # height of the lowest grains of the lattice, in largest diameters
CLEARANCE = 0.55  # of grains' centres from the body, in largest diameters
MOST_GRAINS = 2_000_000

Metres = Annotated[float, Number(1e-6, 1e3, "m", "")]
Friction = Annotated[float, Number(0, 10, "-", "")]


@dataclass(frozen=True)
class Bed:
    """A bed of grains on a floor. They fall from a lattice and settle.

    length, width, depth (m): along x, along y, and of the grains before anything moves.
    diameter (m): mean of the grains'. spread (-): diameters are uniform within that
    share of the mean to both sides. density (kg/m^3): of a grain. young (Pa), poisson
    (-): elastic constants of grains, body and floor. restitution (-): of all contacts.
    friction, body_friction, floor_friction (-): between grains, of body and grain, of
    floor or wall and grain. settling_friction (-): between grains while they settle,
    `friction` if None; less of it packs them closer. walled: sides are walls, else both
    directions are periodic. seed: of the lattice and the diameters. time_step (s):
    `RAYLEIGH_SHARE` of the Rayleigh time if None.

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
        share = self.step / self.rayleigh_time
        require(
            self.step <= RAYLEIGH_SHARE * self.rayleigh_time * (1 + 1e-9),
            f"a time step of {self.step:.3g} s is {share:.2f} of the Rayleigh time",
            because=f"contacts are resolved up to {RAYLEIGH_SHARE:g} of it",
            instead=f"use {RAYLEIGH_SHARE * self.rayleigh_time:.2g} s or less, or "
            "softer grains",
        )
        narrow = min(self.length, self.width) / self.diameter
        require(
            narrow >= 6,
            f"a bed {narrow:.1f} grains wide is too small",
            instead="use six grains or more",
        )
        require(
            self.grains <= MOST_GRAINS,
            f"{self.grains:,} grains are too many",
            instead="use a smaller bed",
        )

    @property
    def rayleigh_time(self) -> float:
        """Time that a Rayleigh wave takes along the surface of the smallest grain, s:
        pi r sqrt(density / G) / (0.1631 poisson + 0.8766), G the shear modulus."""
        G = self.young / (2 * (1 + self.poisson))
        r = self.diameter / 2 * (1 - self.spread)
        factor = 0.1631 * self.poisson + 0.8766
        return math.pi * r * math.sqrt(self.density / G) / factor

    @property
    def step(self) -> float:
        """Time step, s."""
        return self.time_step or RAYLEIGH_SHARE * self.rayleigh_time

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
        largest = self.diameter * (1 + self.spread)
        pitch = PITCH * self.diameter * (1 + self.spread)
        shifts = self._image_shifts()
        tree = cKDTree(np.concatenate([body + shift for shift in shifts]))
        distance = np.tile(radius, len(shifts)) + CLEARANCE * largest

        layer = self._lattice_layer(pitch)
        height = FIRST_LAYER * largest
        layers: list[np.ndarray] = []
        count = 0
        while count < self.grains:
            points = np.column_stack([layer, np.full(len(layer), height)])
            points += rng.uniform(-JITTER / 2, JITTER / 2, points.shape) * self.diameter
            near = tree.query_ball_point(points, radius.max() + largest)
            point = np.repeat(np.arange(len(points)), [len(some) for some in near])
            sphere = np.concatenate(near).astype(int)
            gap = np.linalg.norm(points[point] - tree.data[sphere], axis=1)
            is_clear = np.ones(len(points), bool)
            is_clear[point[gap <= distance[sphere]]] = False
            layers.append(points[is_clear])
            count += len(layers[-1])
            height += pitch
        centres = np.concatenate(layers)[: self.grains]
        factor = rng.uniform(1 - self.spread, 1 + self.spread, len(centres))
        return centres, self.diameter * factor

    def _lattice_layer(self, pitch: float) -> np.ndarray:
        """Return x and y (n, 2), m, of the points of one layer, ``pitch``, m, apart or
        a little more."""

        def places(span: float) -> np.ndarray:
            n = int(span / pitch)
            return (np.arange(n) + 0.5) * span / n - span / 2

        x = places(self.length)
        y = places(self.width)
        return np.stack(np.meshgrid(x, y, indexing="ij"), -1).reshape(-1, 2)

    def _image_shifts(self) -> np.ndarray:
        """Return the places (n, 3), m, of a body's periodic images and of itself, all
        from the body."""
        if self.walled:
            return np.zeros((1, 3))
        shifts = [(i, j, 0.0) for i in (-1, 0, 1) for j in (-1, 0, 1)]
        return np.array(shifts) * [self.length, self.width, 0.0]
