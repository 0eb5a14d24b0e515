"""The contact of faces with the ground in compiled code, eight faces at once. Importing
this module loads numba."""

from __future__ import annotations

import functools

import numpy as np
from numba import njit
from numba.extending import register_jitable

from rft.balance.cache import cached
from rft.formulas.simd import any_of, record_access, register_formulas, sum_of
from rft.formulas.simd import load as read
from rft.formulas.vectors import absolute
from rft.terradynamics.ground import Ground
from rft.terradynamics.meshes.forces.contact import (
    Face,
    Motion,
    corner_heights,
    load,
    part_below,
    velocity_of_middle,
)
from rft.terradynamics.meshes.forces.triples import dot, plus

read_face, _ = record_access(Face)


@register_jitable
def load_on_faces(law, ground, table, begin, end, motion):
    """Return force, N, and moment about the origin, N m, on the faces in rows ``begin``
    to ``end`` of a table (R, 14, 8), along the axes of their body."""
    zero = 0.0 * read(table[begin], 0)
    force = (zero, zero, zero)
    moment = (zero, zero, zero)
    for k in range(begin, end):
        face = read_face(table[k], 0)
        heights = corner_heights(face, motion)
        if any_of((heights[0] < 0.0) | (heights[1] < 0.0) | (heights[2] < 0.0)):
            part = part_below(face, heights)
            is_sheet = face.sheet > 0.0
            v = velocity_of_middle(part, motion)
            leads = (dot(part.n, v) >= 0.0) | is_sheet
            # Rows of which no face is below the surface and leads bear nothing.
            if any_of(leads & (absolute(part.depth) > 0.0)):
                f, m, _ = load(law, ground, part, motion, v, is_sheet)
                force = plus(force, f)
                moment = plus(moment, m)
    return (
        (sum_of(force[0]), sum_of(force[1]), sum_of(force[2])),
        (sum_of(moment[0]), sum_of(moment[1]), sum_of(moment[2])),
    )


@functools.cache
def kernel(Law: type):
    """Return the compiled function that adds up loads by laws whose records have one
    class."""
    register_formulas()

    @njit(nogil=True, error_model="numpy")
    def total(
        numbers,
        ground_numbers,
        disturbed,
        table,
        first,
        velocity,
        spin,
        x,
        up,
        ahead,
        height,
        out,
    ):
        law = Law(*numbers)
        strength, flux, rounding, grazing_sine, downhill_loss = ground_numbers
        ground = Ground(
            strength, flux, rounding, grazing_sine, downhill_loss, disturbed
        )
        for b in range(len(first) - 1):
            for c in range(height.shape[1]):
                motion = Motion(
                    (velocity[b, c, 0], velocity[b, c, 1], velocity[b, c, 2]),
                    (spin[b, c, 0], spin[b, c, 1], spin[b, c, 2]),
                    x[b, c],
                    (up[b, c, 0], up[b, c, 1], up[b, c, 2]),
                    (ahead[b, c, 0], ahead[b, c, 1], ahead[b, c, 2]),
                    height[b, c],
                )
                force, moment = load_on_faces(
                    law, ground, table, first[b], first[b + 1], motion
                )
                out[b, c, 0], out[b, c, 1], out[b, c, 2] = force
                out[b, c, 3], out[b, c, 4], out[b, c, 5] = moment

    return cached(total, f"the contact of faces with ground of the form {Law.__name__}")


def sum_loads(
    law, ground: Ground, table: np.ndarray, first: np.ndarray, motions: Motion
) -> np.ndarray:
    """Return (B, C, 6): the same as
    `rft.terradynamics.meshes.forces.blocks.Blocks.loads`, by the record of a law."""
    add_up = kernel(type(law))
    law_numbers = tuple(law)
    ground_numbers = tuple(map(float, ground[:-1]))
    arrays = [np.ascontiguousarray(x, float) for x in motions]
    out = np.empty((*motions.height.shape, 6))
    add_up(law_numbers, ground_numbers, ground.disturbed, table, first, *arrays, out)
    return out
