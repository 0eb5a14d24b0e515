"""Who bears the weight of a body that touches the ground in places: loads that balance
force, pitch and roll, and never pull.

The ground is taken for a bed of springs under a rigid body, stiff in proportion to the
contact: loads c l max(0, a + b x + d y) with l an element's length. Of all loads >= 0
in balance these have the smallest sum of load^2 / (c l)."""

from __future__ import annotations

import numpy as np

# A weak spring against rotation, over that of a body which touches everywhere, so that
# a body whose centre of mass has no support has a solution: all its load where it comes
# closest to balance.
RESTRAINT = 1e-12
STEPS = 200
ACCURATE = 1e-13
# A line from tail to head that is shorter than this has no direction, body lengths.
LEAST_CHORD = 1e-9


def balanced_loads(
    weights: np.ndarray,
    fraction: np.ndarray,
    centres: np.ndarray,
    along: np.ndarray,
    width: float | None = None,
) -> np.ndarray:
    """Return loads (n, B) per length over the mean load of the body.

    weights: (n, B), of contact. fraction: (n, 1), of the body's length. centres: (n,
    B), x + i y. along: (n, B), exp(i theta) of the headings. width: None balances
    pitch, about the axis across the line from tail to head; a width also roll, with
    load on both sides of each element."""
    places, stiffness = _places(weights, fraction, centres, along, width)
    balanced = 2 if width is None else 3
    levers = np.stack([np.ones_like(places.real), places.real, places.imag])
    pressure = _pressure(levers[:balanced], stiffness)
    loads = stiffness * pressure
    if width is not None:
        loads = loads[: len(weights)] + loads[len(weights) :]
    return loads / fraction


def _places(weights, fraction, centres, along, width) -> tuple[np.ndarray, np.ndarray]:
    """Return the places (m, B) that bear, x + i y from the centre of mass with x from
    tail to head, and how stiff each is."""
    middle = (fraction * centres).sum(0)
    chord = (fraction * along).sum(0)
    length = np.abs(chord)
    direction = np.where(
        length > LEAST_CHORD, chord / np.maximum(length, LEAST_CHORD), 1.0
    )
    places = (centres - middle) / direction
    stiffness = np.broadcast_to(fraction * weights, places.shape)
    if width is None:
        return places, stiffness
    aside = 0.5j * width * along / direction
    places = np.concatenate([places + aside, places - aside])
    return places, np.concatenate([0.5 * stiffness, 0.5 * stiffness])


def _pressure(levers: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    """Return max(0, tilt . levers) (m, B) for which the loads stiffness x pressure have
    sum 1 and balance, levers (k, m, B): the least of a convex, piecewise quadratic
    function of the tilt, by Newton's method with shorter steps where it rises."""
    k = len(levers)
    restraint = np.diag([0.0] + [RESTRAINT] * (k - 1))
    unit = np.zeros(k)
    unit[0] = 1.0

    def value(tilt):
        pressure = np.maximum(np.einsum("bk,kmb->mb", tilt, levers), 0.0)
        bed = 0.5 * (stiffness * pressure**2).sum(0)
        return bed - tilt[:, 0] + 0.5 * np.einsum("bk,kl,bl->b", tilt, restraint, tilt)

    def solved(active):
        mass = np.where(active, stiffness, 0.0)
        matrix = np.einsum("kmb,mb,lmb->bkl", levers, mass, levers) + restraint
        return np.linalg.solve(
            matrix, np.broadcast_to(unit, (len(matrix), k))[..., None]
        )[..., 0]

    tilt = solved(np.ones(stiffness.shape, bool))
    best = value(tilt)
    for _ in range(STEPS):
        active = np.einsum("bk,kmb->mb", tilt, levers) > 0.0
        step = solved(active) - tilt
        size = np.ones(len(tilt))
        new = value(tilt + step)
        for _ in range(50):
            rises = new > best + 1e-15 * np.abs(best)
            if not rises.any():
                break
            size = np.where(rises, 0.5 * size, size)
            new = np.where(rises, value(tilt + size[:, None] * step), new)
        tilt = tilt + size[:, None] * step
        best = new
        if (np.abs(step) <= ACCURATE * (1.0 + np.abs(tilt))).all():
            break
    pressure = np.maximum(np.einsum("bk,kmb->mb", tilt, levers), 0.0)
    return pressure / (stiffness * pressure).sum(0)  # exactly the weight
