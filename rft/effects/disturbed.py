"""Memory of disturbed ground: drag across the body is lower where the body has been before (paper Sec. IV B)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rft.contact import SIDE, Model, PerSample
from rft.effects.base import Process, Site
from rft.media.base import check_ranges
from rft.premise import Premise

PATCH = 4.0  # body lengths: the ground is remembered on a square of this size that goes with the body
CELLS = 2.0  # cells of that square to a radius
AHEAD = 2.0  # radii from the body's axis at which the ground it will meet is looked up


@dataclass(frozen=True)
class DisturbedGround(Process):
    """Drag across times 1 - weakening x disturbance of the ground on the side an element moves to.

    radius (body lengths): half width of the track that the body leaves, 0.01 to 0.25. weakening (-): the share of drag lost
    in fully disturbed ground, 0 to 1.

    The track is fully disturbed up to half a radius from its axis, untouched beyond one and a half; disturbance, 0 to 1,
    does not heal (grains do not settle by themselves). The ground an element will meet is looked up two radii to its left
    and right, outside its own present track. Drag near disturbed ground falls substantially by experiment (paper Sec. IV
    B); the form, and every number, are assumed. Ground further than two body lengths off may be forgotten.
    """

    radius: float
    weakening: float

    kind = "disturbed-ground"
    breaks = Premise.MEMORYLESS
    limit = "weakening = 0"
    cost = "a map of the ground, two look-ups and some thirty marks an element and step"
    batched = ("weakening",)
    varies = True
    settles = 1e-3  # the map has cells, and no two cycles meet them alike

    def __post_init__(self):
        check_ranges(self, radius=(0.01, 0.25), weakening=(0, 1))

    @property
    def held(self) -> int:
        return 2 * _cells(self.radius / CELLS) ** 2

    def begin(self, site: Site) -> Ground:
        return Ground(self.radius / CELLS, site.pose.shape[1])

    def at(self, state: Ground, site: Site) -> Weakened:
        points, side = self._points(site), 1j * AHEAD * self.radius * site.along(SIDE)
        found = [state.at(points + offset).mean(0) for offset in (side, -side)]  # averaged over each element
        return Weakened(1 - self.weakening * np.stack(found))

    def after(self, state: Ground, site: Site, v) -> Ground:
        if site.dt > 0:  # the first step is on untouched ground
            state.mark(self._points(site), self.radius)
        return state

    def numbers(self, state: Ground) -> tuple:
        """Of the cells that were marked, which are few."""
        some = np.flatnonzero(state.owner >= 0)
        cells = np.stack([some, state.owner.ravel()[some], state.value.ravel()[some]])  # owners are 2^42 at most
        return state.sample.size, cells

    def state(self, numbers: tuple) -> Ground:
        samples, (some, owner, value) = numbers
        ground, some = Ground(self.radius / CELLS, samples), some.astype(np.int64)
        ground.owner.ravel()[some], ground.value.ravel()[some] = owner.astype(np.int64), value
        return ground

    def _points(self, site: Site) -> np.ndarray:
        """(k, n, B): points along every element, at most half a radius apart."""
        half = site.motions[SIDE].half
        k = int(np.ceil(4 * half.max() / self.radius))
        return site.place(SIDE) + (np.arange(k)[:, None, None] * 2 + 1 - k) / k * half * site.along(SIDE)


@dataclass(frozen=True)
class Weakened(PerSample):
    """What is left of the drag across at one step, to the left and to the right, (2, n, B)."""

    left: np.ndarray

    def apply(self, model: Model) -> Model:
        return model.changed(SIDE, shares=(self,))

    @property
    def numbers(self) -> tuple:
        """For compiled code (`rft.backend`)."""
        return self.left, None

    def __call__(self, v_n, spin) -> tuple[np.ndarray, None, None]:
        return self.left, None, None


def _cells(cell: float) -> int:
    """Along a side of the square that is remembered."""
    return int(np.ceil(PATCH / cell))


class Ground:
    """Disturbance on a square grid that wraps round: a cell knows which patch of the plane it holds, and a new one starts
    untouched."""

    def __init__(self, cell: float, samples: int):
        self.cell, self.size = cell, _cells(cell)
        self.value = np.zeros((self.size * self.size, samples))
        self.owner = np.full((self.size * self.size, samples), -1, np.int64)
        self.sample = np.arange(samples)

    def _cells(self, i, j):
        """Flat places in the arrays of the cells (i, j) of the plane, and the patches they belong to."""
        (row_patch, row), (column_patch, column) = np.divmod(i, self.size), np.divmod(j, self.size)
        return row * self.size + column, (row_patch + 2**20) * 2**21 + (column_patch + 2**20)

    def at(self, place: np.ndarray) -> np.ndarray:
        """Disturbance at complex places (..., B), bilinear between cell centres."""
        x, y = place.real / self.cell - 0.5, place.imag / self.cell - 0.5
        i, j = np.floor(x), np.floor(y)
        x, y = x - i, y - j
        i, j = i.astype(np.int64), j.astype(np.int64)
        where, patch = self._cells(np.stack([i, i + 1])[:, None], np.stack([j, j + 1]))  # (2, 2, ..., B)
        share = np.stack([1 - x, x])[:, None] * np.stack([1 - y, y])
        here = self.owner[where, self.sample] == patch
        return np.where(here, share * self.value[where, self.sample], 0.0).sum((0, 1))

    def mark(self, place: np.ndarray, radius: float) -> None:
        """Disturb the ground around complex places (..., B): wholly up to radius / 2, not at all beyond 3 radius / 2."""
        reach = int(np.ceil(1.5 * radius / self.cell))
        around = np.arange(-reach, reach + 1).reshape(-1, *[1] * place.ndim)
        i, j = (np.floor(x / self.cell).astype(np.int64) + around for x in (place.real, place.imag))
        i = i[:, None]
        distance = np.hypot((i + 0.5) * self.cell - place.real, (j + 0.5) * self.cell - place.imag)
        value = np.clip(1.5 - distance / radius, 0.0, 1.0)
        where, patch = self._cells(i, j)  # (cells along, cells across, ..., B)
        sample = np.broadcast_to(self.sample, where.shape)
        stale = self.owner[where, sample] != patch
        self.value[where[stale], sample[stale]] = 0.0
        self.owner[where, sample] = patch
        np.maximum.at(self.value, (where, sample), value)
