"""Faces of many rigid bodies, and the loads of the grains on each body, by NumPy or by compiled code."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from rft.balance.backend import compiles
from rft.terradynamics.ground import Ground
from rft.terradynamics.meshes.contact import (
    Face,
    FaceLaw,
    Motion,
    corner_heights,
    load,
    part_below,
    record,
    velocity_of_middle,
)
from rft.terradynamics.meshes.zones import shared

WIDTH = 8  # faces that compiled code computes at once, `rft.formulas.simd.WIDTH`


class Blocks:
    """Faces of B bodies, each in the frame of its body.

    faces: `Face` of arrays (T,), body after body, neighbours near each other. first: (B + 1,), index of each body's first
    face, and T. order: (T,), index that each face had in the list that was given."""

    def __init__(self, bodies: Sequence[Face]):
        orders = [_clusters(faces) for faces in bodies]
        sizes = [len(order) for order in orders]
        self.first = np.concatenate([[0], np.cumsum(sizes)])
        self.order = np.concatenate(
            [order + first for order, first in zip(orders, self.first)]
        )
        self.faces = Face(*(np.concatenate(x)[self.order] for x in zip(*bodies)))
        self.owner = np.repeat(np.arange(len(sizes)), sizes)

    @cached_property
    def rows(self) -> tuple[np.ndarray, np.ndarray]:
        """Faces as rows of eight, (R, 14, 8), and the first row of each body and R, (B + 1,). Faces without area fill up
        the last row of a body."""
        tables = []
        for begin, end in zip(self.first, self.first[1:]):
            table = np.stack([x[begin:end] for x in self.faces])
            if short := -table.shape[1] % WIDTH:
                table = np.concatenate([table, table[:, -1:].repeat(short, 1)], 1)
                table[Face._fields.index("area"), -short:] = 0.0
            tables.append(table.reshape(len(table), -1, WIDTH).swapaxes(0, 1))
        first = np.concatenate([[0], np.cumsum([len(x) for x in tables])])
        return np.ascontiguousarray(np.concatenate(tables)), first

    @cached_property
    def row_spheres(self) -> np.ndarray:
        """Middles and radii, m, of spheres around the faces of each row, (R, 4)."""
        corners = np.moveaxis(self.rows[0][:, :9], 1, 2).reshape(-1, 3 * WIDTH, 3)
        middle = (corners.max(1) + corners.min(1)) / 2
        arms = np.linalg.norm(corners - middle[:, None], axis=2)
        return np.concatenate([middle, arms.max(1, keepdims=True)], 1)

    def loads(self, law: FaceLaw, ground: Ground, motions: Motion) -> np.ndarray:
        """Return force, N, and moment about the origin, N m, of the grains on each body along its own axes, (B, C, 6), in C
        motions, along the same axes. motions: of arrays (B, C, 3) and (B, C)."""
        if compiles("auto", record(law)):
            from rft.terradynamics.meshes.compiled import sum_loads

            return sum_loads(record(law), ground, *self.rows, motions)
        return self.loads_by_numpy(law, ground, motions)

    def loads_by_numpy(
        self,
        law: FaceLaw,
        ground: Ground,
        motions: Motion,
        shares: np.ndarray | None = None,
    ) -> np.ndarray:
        """Return the same as `loads`; faces that are above the surface in the first motion bear nothing. shares: (T,), of
        each face, that the law acts upon."""
        first = Motion(*(x[self.owner, 0].T for x in motions))
        under = np.flatnonzero(np.min(corner_heights(self.faces, first), 0) < 0.0)
        owner, out = self.owner[under], np.zeros((*motions.height.shape, 6))
        if not under.size:
            return out
        motion = Motion(
            *(np.moveaxis(x[owner], (0, 1), (-1, -2)) for x in motions)
        )  # (..., C, T)
        face = Face(*(x[under] for x in self.faces))
        part = part_below(face, corner_heights(face, motion))
        if shares is not None:
            part = shared(part, shares[under])
        force, moment, _ = load(
            law,
            ground,
            part,
            motion,
            velocity_of_middle(part, motion),
            face.sheet > 0.0,
        )
        begin = np.flatnonzero(np.diff(owner, prepend=-1))
        sums = np.add.reduceat(np.stack(force + moment), begin, axis=2)
        out[owner[begin]] = sums.transpose(2, 1, 0)
        return out


def _clusters(faces: Face) -> np.ndarray:
    """Return an order of faces in which eight neighbours lie near each other and point the same way: most rows of eight
    are then above the surface, or trail, as a whole."""
    x = np.stack(faces, -1)
    middles, normals = x[:, :9].reshape(-1, 3, 3).mean(1), x[:, 9:12]
    size = max(float(np.ptp(middles, axis=0).max()), 1e-300)
    features = np.concatenate([2.0 * middles / size, normals], 1)

    def halves(index: np.ndarray) -> list[np.ndarray]:
        if len(index) <= WIDTH:
            return [index]
        along = np.ptp(features[index], axis=0).argmax()
        index = index[np.argsort(features[index, along], kind="stable")]
        middle = WIDTH * max(1, round(len(index) / 2 / WIDTH))
        return halves(index[:middle]) + halves(index[middle:])

    return np.concatenate(halves(np.arange(len(x))))
