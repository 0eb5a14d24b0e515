"""The contact of elements with the ground in compiled code, eight elements at once. Importing this module loads numba."""

from __future__ import annotations

import functools

import numpy as np
from numba import njit
from numba.extending import register_jitable

from rft.balance.cache import cached
from rft.formulas.simd import WIDTH, any_of, record_access, register_formulas, store
from rft.formulas.simd import load as read
from rft.terradynamics.ground import Ground
from rft.terradynamics.plates.contact import Element, Force, Motion, load

(read_element, _) = record_access(Element)


@register_jitable
def on_elements(law, ground, table, begin, end, g, side, lead_of_middle, sums):
    """Return the `Force` on the elements in rows ``begin`` to ``end`` of a table (R, 9, 8). sums: (3, 8), overwritten."""
    x = z = moment = 0.0 * read(sums, 0)
    for k in range(begin, end):
        e = read_element(table[k], 0)
        if any_of(
            (g.z + g.cos * e.z1 - g.sin * e.x1 < 0.0)
            | (g.z + g.cos * e.z2 - g.sin * e.x2 < 0.0)
        ):
            f = load(law, ground, e, g, side, side != 0.0, lead_of_middle)
            x, z, moment = x + f.x, z + f.z, moment + f.moment
    store(sums, 0, x)
    store(sums, 1, z)
    store(sums, 2, moment)
    return Force(sums[0].sum(), sums[1].sum(), sums[2].sum())


@functools.cache
def kernel(Law: type):
    """Return the compiled function that adds up forces by laws whose records have one class."""
    register_formulas()

    @njit(nogil=True, error_model="numpy")
    def total(numbers, ground_numbers, disturbed, table, side, motions, out):
        law, sums = Law(*numbers), np.zeros((3, WIDTH))
        strength, flux, rounding, grazing_sine, downhill_loss = ground_numbers
        ground = Ground(
            strength, flux, rounding, grazing_sine, downhill_loss, disturbed
        )
        for i in range(len(motions)):
            x, z, cos, sin, v_x, v_z, rate = motions[i]
            f = on_elements(
                law,
                ground,
                table,
                0,
                len(table),
                Motion(x, z, cos, sin, v_x, v_z, rate),
                side,
                False,
                sums,
            )
            out[0, i] += f.x
            out[1, i] += f.z
            out[2, i] += f.moment

    return cached(total, f"the contact with ground of the form {Law.__name__}")


def rows_of_eight(elements: Element) -> np.ndarray:
    """Return elements (..., E) as (..., E / 8, 9, 8), the last row filled up with elements without area."""
    table = np.stack(elements, -2)
    if short := -table.shape[-1] % WIDTH:
        table = np.concatenate([table, table[..., :1].repeat(short, -1)], -1)
        table[..., -1, -short:] = 0.0
    return np.ascontiguousarray(
        np.moveaxis(table.reshape(*table.shape[:-1], -1, WIDTH), -2, -3)
    )


def sum_forces(
    law, ground: Ground, outline: Element, motions: Motion, sides: tuple[float, ...]
) -> np.ndarray:
    """Return (3, M): the same as `rft.terradynamics.plates.loads.sum_forces_by_numpy`."""
    table, moves, out = (
        rows_of_eight(outline),
        np.stack(motions, -1),
        np.zeros((3, len(motions.x))),
    )
    numbers = tuple(map(float, ground[:-1]))
    for side in sides:
        kernel(type(law))(
            tuple(law), numbers, ground.disturbed, table, side, moves, out
        )
    return out
