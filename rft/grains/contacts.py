"""Contacts and energies of grains, from their positions alone: what the engine does is
held against them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rft.core.metres import GRAVITY
from rft.grains.bed import Bed


class Contacts(NamedTuple):
    """Overlaps of touching spheres, in mean grain diameters, and the elastic energy of
    all contacts, J."""

    largest: float
    mean: float
    elastic: float


class Particles(NamedTuple):
    """All spheres in a bed, (n, ...): centres and velocities (n, 3), m and m/s, spins
    (n, 3), rad/s, radii, m, and whether one is of the body."""

    x: np.ndarray
    v: np.ndarray
    spin: np.ndarray
    radius: np.ndarray
    body: np.ndarray


def contacts(bed: Bed, p: Particles) -> Contacts:
    """Return the contacts of grains with each other, the body and the floor.

    The energy is that of normal forces (Hertz, 8/15 E sqrt(R) overlap^(5/2), with E =
    young / (2 (1 - poisson^2)) and R the harmonic sum of the radii); the springs of
    friction have none in it."""
    from scipy.spatial import cKDTree

    span = np.array([bed.length, bed.width, 0.0])
    if bed.walled:
        span[:] = 0.0
    place = np.where(
        span > 0, np.mod(p.x + span / 2, np.where(span > 0, span, 1.0)), p.x
    )
    pairs = cKDTree(place, boxsize=span).query_pairs(
        2 * p.radius.max(), output_type="ndarray"
    )
    pairs = pairs[~p.body[pairs].all(1)]
    d = place[pairs[:, 0]] - place[pairs[:, 1]]
    d -= span * np.round(d / np.where(span > 0, span, 1.0))
    r = p.radius[pairs]
    grains = ~p.body
    overlap = np.concatenate(
        [r.sum(1) - np.linalg.norm(d, axis=1), (p.radius - p.x[:, 2])[grains]]
    )
    reduced = np.concatenate([r.prod(1) / r.sum(1), p.radius[grains]])
    touching = overlap > 0
    overlap = overlap[touching]
    reduced = reduced[touching]
    stiff = bed.young / (2 * (1 - bed.poisson**2))
    elastic = 8 / 15 * stiff * float(np.sum(np.sqrt(reduced) * overlap**2.5))
    share = overlap / bed.diameter if overlap.size else np.zeros(1)
    return Contacts(float(share.max()), float(share.mean()), elastic)


def motion_energy(bed: Bed, p: Particles) -> float:
    """Return the kinetic energy of the grains and their energy in gravity over the
    floor, J."""
    g = ~p.body
    mass = bed.density * 4 / 3 * np.pi * p.radius[g] ** 3
    r2 = p.radius[g] ** 2
    kinetic = 0.5 * mass @ (p.v[g] ** 2).sum(1) + 0.2 * (mass * r2) @ (
        p.spin[g] ** 2
    ).sum(1)
    return float(kinetic + GRAVITY * mass @ p.x[g, 2])
