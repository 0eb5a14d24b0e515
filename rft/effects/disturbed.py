"""Memory of disturbed ground: drag across the body is lower where the body has been before (paper Sec. IV B)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np

from rft.checks import Number, check_numbers
from rft.contact import Problem
from rft.effects.base import Effect, Site
from rft.premise import Premise

PATCH = (
    4.0  # body lengths: the ground is remembered on a square of this size, or a little more, that goes with the body
)
CELLS = 2.0  # cells of that square to a radius
TILE = 32  # cells along a side of the tiles that the square consists of; those that a step does not mark are not copied
AHEAD = 2.0  # radii from the body's axis at which the ground it will meet is looked up


@dataclass(frozen=True)
class DisturbedGround(Effect):
    """Drag across times 1 - weakening x disturbance of the ground on the side an element moves to.

    The track is fully disturbed up to half a radius from its axis, untouched beyond one and a half; disturbance, 0 to
    1, does not heal (grains do not settle by themselves). The ground an element will meet is looked up two radii to its
    left and right, outside its own present track. Drag near disturbed ground falls substantially by experiment (paper
    Sec. IV B); the form, and every number, are assumed. Ground further than two body lengths off may be forgotten."""

    radius: Annotated[float, Number(0.01, 0.25, "body lengths", "half width of the track that the body leaves")]
    weakening: Annotated[float, Number(0, 1, "-", "share of the drag lost in fully disturbed ground")]

    kind = "disturbed-ground"
    breaks = Premise.MEMORYLESS
    limit = "weakening = 0"
    cost = "a map of the ground, two look-ups and some thirty marks an element and step"
    batched = ("weakening",)
    varies = True
    settles = 1e-3  # the map has cells, and no two cycles meet them alike

    def __post_init__(self):
        check_numbers(self)

    @property
    def held(self) -> int:
        return self.tiles_along**2 * TILE**2

    @property
    def cell(self) -> float:
        """Side of a cell of the map, body lengths."""
        return self.radius / CELLS

    @property
    def tiles_along(self) -> int:
        """Tiles along a side of the square that is remembered."""
        return int(np.ceil(PATCH / self.cell / TILE))

    def begin(self, problem: Problem, site: Site) -> Tiles:
        count, samples = self.tiles_along**2, site.pose.shape[1]
        return Tiles((np.zeros((TILE**2, samples)),) * count, np.full((count, samples), -1, np.int64))

    def apply(self, problem: Problem, site: Site, past: Tiles) -> Problem:
        points, m = self.points(problem, site), problem.memory
        aside = 1j * AHEAD * self.radius * site.along(problem.sides.elements)
        left, right = (1 - self.weakening * self.disturbance(past, points + x).mean(0) for x in (aside, -aside))
        return problem._replace(memory=m._replace(given_left=m.given_left * left, given_right=m.given_right * right))

    def after(self, problem: Problem, site: Site, past: Tiles, v) -> Tiles:
        if site.count == 0:  # the first step is on untouched ground
            return past
        return self.marked(past, self.points(problem, site))

    def points(self, problem: Problem, site: Site) -> np.ndarray:
        """Return complex points (k, n, B) along every element, at most half a radius apart."""
        e = problem.sides.elements
        k = int(np.ceil(4 * e.half.max() / self.radius))
        return site.place(e) + (np.arange(k)[:, None, None] * 2 + 1 - k) / k * e.half * site.along(e)

    def location(self, i, j) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return where the map holds the cells (i, j) of the plane: tile, row in the tile, and patch of the plane."""
        (tile_i, i), (tile_j, j) = np.divmod(i, TILE), np.divmod(j, TILE)
        (patch_i, tile_i), (patch_j, tile_j) = np.divmod(tile_i, self.tiles_along), np.divmod(tile_j, self.tiles_along)
        return tile_i * self.tiles_along + tile_j, i * TILE + j, (patch_i + 2**20) * 2**21 + (patch_j + 2**20)

    def disturbance(self, tiles: Tiles, place: np.ndarray) -> np.ndarray:
        """Return the disturbance at complex places (..., B), bilinear between cell centres."""
        x, y = place.real / self.cell - 0.5, place.imag / self.cell - 0.5
        i, j = np.floor(x), np.floor(y)
        x, y = x - i, y - j
        i, j = i.astype(np.int64), j.astype(np.int64)
        tile, row, patch = self.location(np.stack([i, i + 1])[:, None], np.stack([j, j + 1]))  # (2, 2, ..., B)
        share, sample = np.stack([1 - x, x])[:, None] * np.stack([1 - y, y]), np.arange(tiles.owner.shape[1])
        _, value, index = tiles.copied(tile)
        return np.where(tiles.owner[tile, sample] == patch, share * value[index, row, sample], 0.0).sum((0, 1))

    def marked(self, tiles: Tiles, place: np.ndarray) -> Tiles:
        """Return the map with a track at complex places (..., B): fully disturbed up to radius / 2, not at all beyond
        3 radius / 2."""
        reach = int(np.ceil(1.5 * self.radius / self.cell))
        around = np.arange(-reach, reach + 1).reshape(-1, *[1] * place.ndim)
        i, j = (np.floor(x / self.cell).astype(np.int64) + around for x in (place.real, place.imag))
        i = i[:, None]
        distance = np.hypot((i + 0.5) * self.cell - place.real, (j + 0.5) * self.cell - place.imag)
        tile, row, patch = self.location(i, j)  # (cells along, cells across, ..., B)
        owner, sample = tiles.owner.copy(), np.arange(tiles.owner.shape[1])
        owner[tile, sample] = patch
        touched, value, index = tiles.copied(tile)
        value *= (owner == tiles.owner)[touched, None]
        np.maximum.at(value, (index, row, sample), np.clip(1.5 - distance / self.radius, 0.0, 1.0))
        new = list(tiles.value)
        for k, x in zip(touched, value):
            new[k] = x.copy()
        return Tiles(tuple(new), owner)


class Tiles(NamedTuple):
    """A square map of the ground that wraps round, tile by tile; maps share the tiles in which they do not differ.

    value: disturbance, 0 to 1, (cells, B) for each tile. owner: (tiles, B), the patch of the plane whose tile is held,
    -1 for none: a tile of another patch is untouched."""

    value: tuple[np.ndarray, ...]
    owner: np.ndarray

    def copied(self, tile: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the numbers of the tiles (K,) that ``tile`` names, copies of their values (K, cells, B), and the index
        into these of each name."""
        touched = np.flatnonzero(np.bincount(tile.ravel(), minlength=len(self.value)))
        index = np.zeros(len(self.value), int)
        index[touched] = np.arange(len(touched))
        return touched, np.stack([self.value[k] for k in touched]), index[tile]
