"""The contact of elements with the ground in compiled code, eight elements at once.
Importing this module loads numba."""

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

read_element, _ = record_access(Element)


@register_jitable
def force_on_elements(law, ground, table, begin, end, g, side, lead_of_middle, sums):
    """Return the `Force` on the elements in rows ``begin`` to ``end`` of a table
    (R, 9, 8). sums: (3, 8), overwritten."""
    x = z = moment = 0.0 * read(sums, 0)
    for k in range(begin, end):
        e = read_element(table[k], 0)
        # Rows whose eight elements are all above the surface bear nothing.
        height1 = g.z + g.cos * e.z1 - g.sin * e.x1
        height2 = g.z + g.cos * e.z2 - g.sin * e.x2
        if any_of((height1 < 0.0) | (height2 < 0.0)):
            f = load(law, ground, e, g, side, side != 0.0, lead_of_middle)
            x = x + f.x
            z = z + f.z
            moment = moment + f.moment
    store(sums, 0, x)
    store(sums, 1, z)
    store(sums, 2, moment)
    return Force(sums[0].sum(), sums[1].sum(), sums[2].sum())


@functools.cache
def kernel(Law: type):
    """Return the compiled function that adds up forces by laws whose records have one
    class."""
    register_formulas()

    @njit(nogil=True, error_model="numpy")
    def total(numbers, ground_numbers, disturbed, table, side, motions, out):
        law = Law(*numbers)
        sums = np.zeros((3, WIDTH))
        strength, flux, rounding, grazing_sine, downhill_loss = ground_numbers
        ground = Ground(
            strength, flux, rounding, grazing_sine, downhill_loss, disturbed
        )
        for i in range(len(motions)):
            x, z, cos, sin, v_x, v_z, rate = motions[i]
            g = Motion(x, z, cos, sin, v_x, v_z, rate)
            f = force_on_elements(
                law, ground, table, 0, len(table), g, side, False, sums
            )
            out[0, i] += f.x
            out[1, i] += f.z
            out[2, i] += f.moment

    return cached(total, f"the contact with ground of the form {Law.__name__}")


def rows_of_eight(elements: Element) -> np.ndarray:
    """Return elements (..., E) as (..., E / 8, 9, 8), the last row filled up with
    elements without area."""
    table = np.stack(elements, -2)
    n_missing = -table.shape[-1] % WIDTH
    if n_missing:
        fillers = table[..., :1].repeat(n_missing, -1)
        table = np.concatenate([table, fillers], -1)
        table[..., -1, -n_missing:] = 0.0
    rows = table.reshape(*table.shape[:-1], -1, WIDTH)
    return np.ascontiguousarray(np.moveaxis(rows, -2, -3))


def sum_forces(
    law, ground: Ground, outline: Element, motions: Motion, sides: tuple[float, ...]
) -> np.ndarray:
    """Return (3, M): the same as
    `rft.terradynamics.plates.loads.sum_forces_by_numpy`."""
    add_forces = kernel(type(law))
    law_numbers = tuple(law)
    ground_numbers = tuple(map(float, ground[:-1]))
    table = rows_of_eight(outline)
    moves = np.stack(motions, -1)
    out = np.zeros((3, len(motions.x)))
    for side in sides:
        add_forces(
            law_numbers, ground_numbers, ground.disturbed, table, side, moves, out
        )
    return out
