"""Drag measured on a rod: attack angles, forces along and across it, the rod's sizes and the grains' density."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rft.checks import in_range, real_array, require
from rft.laws.catalogue import GRAVITY

NEGATIVE = 0.1  # of the largest force: what may be missing to zero before a force counts as pushing
LIKE_RADIANS = 7.0  # degrees: angles that stay below are taken for radians


@dataclass(frozen=True)
class Rod:
    """A rod and the bed it was dragged through; None for what is not known. radius, length, depth (of its axis): m. density:
    kg/m^3 of the bed, that of the grains times their volume fraction."""

    radius: float | None = None
    length: float | None = None
    depth: float | None = None
    density: float | None = None

    def __post_init__(self):
        for name, high in (("radius", 1e3), ("length", 1e3), ("depth", 1e3), ("density", 1e6)):
            if getattr(self, name) is not None:
                in_range(f"the rod's {name}" if name != "density" else name, getattr(self, name), 1e-9, high)

    @property
    def area(self) -> float | None:
        """Projected, 2 r L, m^2."""
        return 2 * self.radius * self.length if self.radius and self.length else None

    @property
    def pressure(self) -> float | None:
        """Of the weight of grains above its axis, rho g |z|, Pa."""
        return self.density * GRAVITY * self.depth if self.density and self.depth else None


@dataclass(frozen=True, eq=False)
class RodDrag:
    """Forces on the whole rod (N), positive against the velocity's parts along and across it. psi: (N,), rad, from 0 to pi/2.
    forces: (2, N), along and across. weight: (N,), of the squares, 1 in the mean."""

    psi: np.ndarray
    forces: np.ndarray
    weight: np.ndarray

    @property
    def count(self) -> int:
        """Forces that weigh something."""
        return 2 * int(np.count_nonzero(self.weight))

    @property
    def angles(self) -> int:
        """Different ones."""
        return np.unique(self.psi.round(9)).size


def rod_drag(psi_deg, along, across, weight=None) -> RodDrag:
    """Measurements at attack angles in degrees, folded into 0 to 90: a law of a rod knows neither front from back nor left
    from right. Beyond, forces may have the signs of the velocity's parts, or be magnitudes throughout. Equal angles all count.
    ValueError for what cannot be drag: forces that push, columns exchanged, angles in radians."""
    columns = {"psi_deg": psi_deg, "forces along": along, "forces across": across}
    psi, *forces = (real_array(name, x) for name, x in columns.items())
    forces = np.array(forces) if all(x.shape == psi.shape for x in forces) else np.zeros(0)
    weight = np.ones(psi.shape) if weight is None else real_array("weights", weight)
    require(forces.shape == (2, psi.size) and weight.shape == psi.shape, "angles and forces must be rows of one length")
    finite = all(bool(np.isfinite(x).all()) for x in (psi, forces, weight))
    require(finite and psi.size > 0, "angles, forces and weights must be finite numbers, one at least")
    require(bool((weight >= 0).all() and weight.any()), "weights must be 0 or more, and not all 0")
    require(
        not 0 < np.abs(psi).max() <= LIKE_RADIANS,
        f"psi_deg reaches only {np.abs(psi).max():.3g}: angles look like radians, give degrees from 0 to 90",
    )
    angle = np.arctan2(np.abs(np.sin(np.radians(psi))), np.abs(np.cos(np.radians(psi))))
    data = RodDrag(angle, _against(psi, forces), weight / weight[weight > 0].mean())
    _require_not_exchanged(data)
    return data


def _against(psi: np.ndarray, forces: np.ndarray) -> np.ndarray:
    """The forces, positive where they oppose the motion; ValueError naming the angle of one that does not."""
    parts = np.array([np.cos(np.radians(psi)), np.sin(np.radians(psi))])
    signs = np.where(np.abs(parts) < 1e-9, 1.0, np.sign(parts))
    largest = np.abs(forces).max()
    require(largest > 0, "all forces are zero: there is no drag to fit")
    require(bool((forces > 0).any()), "no force is positive: drag is, where it opposes the motion; change the sign")
    opposing = max(signs * forces, forces, key=lambda x: x.min())
    which, row = np.unravel_index(np.argmin(opposing), opposing.shape)
    require(
        opposing[which, row] >= -NEGATIVE * largest,
        f"at psi = {psi[row]:g} degrees the force {('along', 'across')[which]} the rod is {forces[which, row]:g} N and pushes: "
        "drag is positive where it opposes the motion",
    )
    return opposing


def _require_not_exchanged(data: RodDrag) -> None:
    """ValueError if the forces along go like sin psi and those across like cos psi, much better than the right way round."""
    wave = np.array([np.cos(data.psi), np.sin(data.psi)])

    def missed(shape):
        size = (shape * data.forces).sum(1) / np.maximum((shape**2).sum(1), 1e-12)
        return float(((data.forces - size[:, None] * shape) ** 2).sum())

    wrong = missed(wave)
    require(
        missed(wave[::-1]) >= 0.25 * wrong or wrong < 1e-6 * (data.forces**2).sum(),
        "the forces along the rod grow with psi and those across it fall: the columns are exchanged, or psi is measured from "
        "the rod's normal; it is the angle between velocity and rod axis",
    )
