"""Memory of disturbed ground: drag across the body is lower where the body has been
before (paper Sec. IV B)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from rft.core.checks import Number, check_numbers
from rft.core.premise import Premise
from rft.effects.base import EFFECTS, Effect, InMetres, Site
from rft.effects.contact import Problem

# The map of the ground is a square that moves with the body, in tiles of cells.
PATCH = 4.0  # body lengths, least side of the square
CELLS = 2.0  # cells to a radius
TILE = 32  # cells along a side of a tile; a step copies only the tiles that it marks
# radii from the body's axis to the ground that an element is about to meet
LOOK_AHEAD = 2.0


@EFFECTS.register
@dataclass(frozen=True)
class DisturbedGround(Effect):
    """Drag across times 1 - weakening x disturbance of the ground on the side that an
    element moves to.

    The track of the body is fully disturbed up to half a radius from its axis,
    undisturbed beyond one and a half radii; disturbance, 0 to 1, never decreases
    (grains do not settle by themselves). The disturbance on either side of an element
    is read two radii from its axis, outside its present track. Drag near disturbed
    ground falls substantially in experiments (paper Sec. IV B); the form, and every
    number, are assumed. Ground more than two body lengths away may be forgotten.

    Examples
    --------
    >>> import numpy as np
    >>> from rft import Chain, Granular, time_steps
    >>> from rft.effects import DisturbedGround
    >>> t = 2 * np.pi * np.arange(32) / 32
    >>> alpha = np.stack([np.cos(t), np.sin(t)], -1)
    >>> alphadot = np.stack([-np.sin(t), np.cos(t)], -1)
    >>> track = DisturbedGround(radius=0.02, weakening=0.3)
    >>> law = Granular(1.8, 0.24)
    >>> steps = time_steps(law, Chain(), alpha, alphadot, effects=[track])
    >>> steps.pose[-1, :2].round(3)  # x, y after the cycle, body lengths
    array([-0.119, -0.007])
    """

    radius: Annotated[
        float | None,
        Number(
            0.01,
            0.25,
            "body lengths",
            "half width of the track that the body leaves; or radius_m",
        ),
    ] = None
    weakening: Annotated[
        float | None,
        Number(0, 1, "-", "share of the drag lost in fully disturbed ground"),
    ] = None
    radius_m: Annotated[
        float | None,
        Number(0, 1e6, "m", "radius for a body with a length, instead of radius"),
    ] = None

    kind = "disturbed-ground"
    metres = {"radius": InMetres("radius_m")}
    required = ("weakening",)
    breaks = Premise.MEMORYLESS
    limit = "weakening = 0"
    cost = (
        "a map of the ground, with two look-ups and about thirty marks per element "
        "and step"
    )
    batched = ("weakening",)
    varies_along = True
    drift_tolerance = 1e-3  # the map has cells, and no two cycles meet them alike

    def __post_init__(self):
        check_numbers(self)
        self.check_lengths()

    @property
    def memory_size(self) -> int:
        return self.tiles_along**2 * TILE**2

    @property
    def cell(self) -> float:
        """Side of a cell of the map, body lengths."""
        return self.radius / CELLS

    @property
    def tiles_along(self) -> int:
        """Number of tiles along a side of the map."""
        return int(np.ceil(PATCH / self.cell / TILE))

    def begin(self, problem: Problem, site: Site) -> Tiles:
        count = self.tiles_along**2
        samples = site.pose.shape[1]
        return Tiles(
            (np.zeros((TILE**2, samples)),) * count,
            np.full((count, samples), -1, np.int64),
        )

    def apply(self, problem: Problem, site: Site, state: Tiles) -> Problem:
        points = self.points(problem, site)
        m = problem.memory
        offset = 1j * LOOK_AHEAD * self.radius * site.headings(problem.sides.elements)
        left = self.disturbance(state, points + offset).mean(0)
        right = self.disturbance(state, points - offset).mean(0)
        memory = m._replace(
            intact_left=m.intact_left * (1 - self.weakening * left),
            intact_right=m.intact_right * (1 - self.weakening * right),
        )
        return problem._replace(memory=memory)

    def after(self, problem: Problem, site: Site, state: Tiles, v: np.ndarray) -> Tiles:
        if site.count == 0:  # the first step is on undisturbed ground
            return state
        return self.with_track(state, self.points(problem, site))

    def points(self, problem: Problem, site: Site) -> np.ndarray:
        """Return k points along every element on the ground, complex (k, n, B), at most
        half a radius apart."""
        e = problem.sides.elements
        k = int(np.ceil(4 * e.half.max() / self.radius))
        s = (np.arange(k)[:, None, None] * 2 + 1 - k) / k  # of the element, -1 to 1
        return site.centres(e) + s * e.half * site.headings(e)

    def location(
        self, i: np.ndarray, j: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the tile and the row in the tile that store the cells (i, j) of the
        plane, and their patch of the plane."""
        tile_i, i = np.divmod(i, TILE)
        tile_j, j = np.divmod(j, TILE)
        patch_i, tile_i = np.divmod(tile_i, self.tiles_along)
        patch_j, tile_j = np.divmod(tile_j, self.tiles_along)
        tile = tile_i * self.tiles_along + tile_j
        row = i * TILE + j
        patch = (patch_i + 2**20) * 2**21 + (patch_j + 2**20)
        return tile, row, patch

    def disturbance(self, tiles: Tiles, place: np.ndarray) -> np.ndarray:
        """Return the disturbance, 0 to 1, at complex places (..., B), bilinear between
        cell centres."""
        x = place.real / self.cell - 0.5
        y = place.imag / self.cell - 0.5
        i = np.floor(x)
        j = np.floor(y)
        x = x - i
        y = y - j
        i = i.astype(np.int64)
        j = j.astype(np.int64)
        # The four cells around a place, (2, 2, ..., B), and their shares.
        i = np.stack([i, i + 1])[:, None]
        j = np.stack([j, j + 1])
        tile, row, patch = self.location(i, j)
        share = np.stack([1 - x, x])[:, None] * np.stack([1 - y, y])
        sample = np.arange(tiles.owner.shape[1])
        _, value, index = tiles.copies(tile)
        is_stored = tiles.owner[tile, sample] == patch
        value = share * value[index, row, sample]
        return np.where(is_stored, value, 0.0).sum((0, 1))

    def with_track(self, tiles: Tiles, place: np.ndarray) -> Tiles:
        """Return the map with a track at complex places (..., B): disturbance 1 up to
        radius / 2, 0 beyond 3 radius / 2."""
        reach = int(np.ceil(1.5 * self.radius / self.cell))
        around = np.arange(-reach, reach + 1).reshape(-1, *[1] * place.ndim)
        i = np.floor(place.real / self.cell).astype(np.int64) + around
        j = np.floor(place.imag / self.cell).astype(np.int64) + around
        i = i[:, None]
        x = (i + 0.5) * self.cell - place.real
        y = (j + 0.5) * self.cell - place.imag
        distance = np.hypot(x, y)
        tile, row, patch = self.location(i, j)  # (cells along, cells across, ..., B)
        owner = tiles.owner.copy()
        sample = np.arange(tiles.owner.shape[1])
        owner[tile, sample] = patch
        touched, value, index = tiles.copies(tile)
        value *= (owner == tiles.owner)[touched, None]
        disturbance = np.clip(1.5 - distance / self.radius, 0.0, 1.0)
        np.maximum.at(value, (index, row, sample), disturbance)
        new = list(tiles.value)
        for k, x in zip(touched, value):
            new[k] = x.copy()
        return Tiles(tuple(new), owner)

    @classmethod
    def examples(cls, x: float = 0.3) -> dict[str, DisturbedGround]:
        return {"disturbed-ground": cls(radius=0.05, weakening=x)}


class Tiles(NamedTuple):
    """A periodic square map of the ground, tile by tile; maps share the tiles in which
    they do not differ.

    value: disturbance, 0 to 1, (cells, B) for each tile. owner: (tiles, B), the patch
    of the plane that a tile stores, -1 for none; all other patches are undisturbed
    there."""

    value: tuple[np.ndarray, ...]
    owner: np.ndarray

    def copies(self, tile: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the K different tiles among ``tile``, copies of their values
        (K, cells, B), and for each entry of ``tile`` its index into these."""
        touched = np.flatnonzero(np.bincount(tile.ravel(), minlength=len(self.value)))
        index = np.zeros(len(self.value), int)
        index[touched] = np.arange(len(touched))
        return touched, np.stack([self.value[k] for k in touched]), index[tile]
