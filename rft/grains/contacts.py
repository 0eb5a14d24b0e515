"""Contacts and energies of grains from their positions alone, independent of the
engine, which is checked against them."""

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
    """All spheres in a bed.

    x, v: (n, 3), centres and their velocities, m and m/s. spin: (n, 3), rad/s. radius:
    (n,), m. body: (n,), whether a sphere belongs to the body."""

    x: np.ndarray
    v: np.ndarray
    spin: np.ndarray
    radius: np.ndarray
    body: np.ndarray


def contacts(bed: Bed, p: Particles) -> Contacts:
    """Return the contacts of grains with each other, the body and the floor.

    The energy is that of normal forces (Hertz, 8/15 E sqrt(R) overlap^(5/2), with
    E = young / (2 (1 - poisson^2)) and R the harmonic sum of the radii), without the
    springs of friction."""
    pairs, offset = _near_pairs(bed, p)
    r = p.radius[pairs]
    grains = ~p.body
    pair_overlap = r.sum(1) - np.linalg.norm(offset, axis=1)
    floor_overlap = (p.radius - p.x[:, 2])[grains]
    overlap = np.concatenate([pair_overlap, floor_overlap])
    R = np.concatenate([r.prod(1) / r.sum(1), p.radius[grains]])

    touching = overlap > 0
    overlap = overlap[touching]
    R = R[touching]
    E = bed.young / (2 * (1 - bed.poisson**2))
    elastic = 8 / 15 * E * float(np.sum(np.sqrt(R) * overlap**2.5))
    share = overlap / bed.diameter if overlap.size else np.zeros(1)
    return Contacts(float(share.max()), float(share.mean()), elastic)


def _near_pairs(bed: Bed, p: Particles) -> tuple[np.ndarray, np.ndarray]:
    """Return pairs (n, 2) of spheres that may touch, not both of the body, and the
    distances (n, 3), m, of the first from the nearest image of the second."""
    from scipy.spatial import cKDTree

    # 0 is a direction without periodic images.
    span = np.zeros(3)
    if not bed.walled:
        span[:2] = bed.length, bed.width
    is_periodic = span > 0
    divisor = np.where(is_periodic, span, 1.0)
    place = np.where(is_periodic, np.mod(p.x + span / 2, divisor), p.x)
    tree = cKDTree(place, boxsize=span)
    pairs = tree.query_pairs(2 * p.radius.max(), output_type="ndarray")
    pairs = pairs[~p.body[pairs].all(1)]
    offset = place[pairs[:, 0]] - place[pairs[:, 1]]
    offset -= span * np.round(offset / divisor)
    return pairs, offset


def motion_energy(bed: Bed, p: Particles) -> float:
    """Return the kinetic energy of the grains and their energy in gravity over the
    floor, J."""
    g = ~p.body
    mass = bed.density * 4 / 3 * np.pi * p.radius[g] ** 3
    r2 = p.radius[g] ** 2
    of_velocities = 0.5 * mass @ (p.v[g] ** 2).sum(1)
    of_spins = 0.2 * (mass * r2) @ (p.spin[g] ** 2).sum(1)
    return float(of_velocities + of_spins + GRAVITY * mass @ p.x[g, 2])
