"""Faces of many rigid bodies, and the loads of the grains on each body, by NumPy or by
compiled code."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from rft.balance.backend import compiles
from rft.terradynamics.ground import Ground
from rft.terradynamics.meshes.forces.contact import (
    Face,
    FaceLaw,
    Motion,
    corner_heights,
    load,
    part_below,
    record,
    velocity_of_middle,
)
from rft.terradynamics.meshes.forces.zones import share_of_part

WIDTH = 8  # faces that compiled code computes at once, `rft.formulas.simd.WIDTH`


class Blocks:
    """Faces of B bodies, each in the frame of its body.

    faces: `Face` of arrays (T,), body after body, neighbours near each other. first:
    (B + 1,), index of the first face of each body, and T. order: (T,), index of each
    face in the list that was given. owner: (T,), number of its body."""

    def __init__(self, bodies: Sequence[Face]):
        orders = [_clusters(faces) for faces in bodies]
        sizes = [len(order) for order in orders]
        self.first = np.concatenate([[0], np.cumsum(sizes)])
        self.owner = np.repeat(np.arange(len(sizes)), sizes)
        self.order = np.concatenate(orders) + self.first[self.owner]
        columns = [np.concatenate(column) for column in zip(*bodies)]
        self.faces = Face(*(column[self.order] for column in columns))

    @cached_property
    def rows(self) -> tuple[np.ndarray, np.ndarray]:
        """Faces as rows of eight, (R, 14, 8), and the first row of each body and R,
        (B + 1,). Faces without area fill up the last row of a body."""
        tables = []
        for begin, end in zip(self.first, self.first[1:]):
            table = np.stack([column[begin:end] for column in self.faces])
            n_missing = -table.shape[1] % WIDTH
            if n_missing:
                fillers = table[:, -1:].repeat(n_missing, 1)
                table = np.concatenate([table, fillers], 1)
                table[Face._fields.index("area"), -n_missing:] = 0.0
            tables.append(table.reshape(len(table), -1, WIDTH).swapaxes(0, 1))
        first = np.concatenate([[0], np.cumsum([len(table) for table in tables])])
        return np.ascontiguousarray(np.concatenate(tables)), first

    def set_shares(self, shares: np.ndarray) -> None:
        """Let each body bear a share (B,) of its loads from now on, as if its faces had
        that share of their areas."""
        index = Face._fields.index("area")
        table, first = self.rows
        for body, share in enumerate(shares):
            faces = slice(self.first[body], self.first[body + 1])
            rows = slice(first[body], first[body + 1])
            self.faces.area[faces] = share * self._areas[0][faces]
            table[rows, index] = share * self._areas[1][rows]

    @cached_property
    def _areas(self) -> tuple[np.ndarray, np.ndarray]:
        """Areas of the faces (T,), and of the rows of eight (R, 8), m^2."""
        area = Face._fields.index("area")
        return self.faces.area.copy(), self.rows[0][:, area].copy()

    @cached_property
    def row_spheres(self) -> np.ndarray:
        """Middles and radii, m, of spheres around the faces of each row, (R, 4)."""
        corners = np.moveaxis(self.rows[0][:, :9], 1, 2).reshape(-1, 3 * WIDTH, 3)
        middle = (corners.max(1) + corners.min(1)) / 2
        arms = np.linalg.norm(corners - middle[:, None], axis=2)
        return np.concatenate([middle, arms.max(1, keepdims=True)], 1)

    def loads(self, law: FaceLaw, ground: Ground, motions: Motion) -> np.ndarray:
        """Return force, N, and moment about the origin, N m, of the grains on each body
        in C motions, (B, C, 6), along the axes of the body.

        motions: vectors (B, C, 3) and numbers (B, C), along the same axes."""
        if compiles("auto", record(law)):
            from rft.terradynamics.meshes.forces.compiled import (
                sum_loads,  # loads numba
            )

            return sum_loads(record(law), ground, *self.rows, motions)
        return self.loads_by_numpy(law, ground, motions)

    def loads_by_numpy(
        self,
        law: FaceLaw,
        ground: Ground,
        motions: Motion,
        shares: np.ndarray | None = None,
    ) -> np.ndarray:
        """Return the same as `loads`; faces above the surface in the first motion bear
        nothing. shares: (T,), of each face, on which the law acts; all of it if
        None."""
        out = np.zeros((*motions.height.shape, 6))
        first_motion = Motion(*(x[self.owner, 0].T for x in motions))
        lowest = np.min(corner_heights(self.faces, first_motion), 0)
        under = np.flatnonzero(lowest < 0.0)
        if not under.size:
            return out

        owner = self.owner[under]
        face = Face(*(column[under] for column in self.faces))
        # Vectors (3, C, T) and numbers (C, T).
        motion = Motion(*(np.moveaxis(x[owner], (0, 1), (-1, -2)) for x in motions))
        part = part_below(face, corner_heights(face, motion))
        if shares is not None:
            part = share_of_part(part, shares[under])
        velocity = velocity_of_middle(part, motion)
        is_sheet = face.sheet > 0.0
        force, moment, _ = load(law, ground, part, motion, velocity, is_sheet)

        begin = np.flatnonzero(np.diff(owner, prepend=-1))
        sums = np.add.reduceat(np.stack(force + moment), begin, axis=2)
        out[owner[begin]] = sums.transpose(2, 1, 0)
        return out


def _clusters(faces: Face) -> np.ndarray:
    """Return an order of faces, as indices, in which eight neighbours lie near each
    other and point the same way.

    Most rows of eight are then above the surface, or trail, as a whole, and compiled
    code skips them."""
    x = np.stack(faces, -1)
    middles = x[:, :9].reshape(-1, 3, 3).mean(1)
    normals = x[:, 9:12]
    size = max(float(np.ptp(middles, axis=0).max()), 1e-300)
    features = np.concatenate([2.0 * middles / size, normals], 1)

    def halves(index: np.ndarray) -> list[np.ndarray]:
        if len(index) <= WIDTH:
            return [index]
        along = np.ptp(features[index], axis=0).argmax()
        index = index[np.argsort(features[index, along], kind="stable")]
        # The first half fills whole rows.
        middle = WIDTH * max(1, round(len(index) / 2 / WIDTH))
        return halves(index[:middle]) + halves(index[middle:])

    return np.concatenate(halves(np.arange(len(x))))
