"""Measured drag on a rod: attack angles, forces along and across the rod, its sizes and
the density of the bed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rft.core.checks import in_range, real_array
from rft.core.metres import GRAVITY
from rft.core.refusal import require

# Of the largest force: a force below minus that pushes. Smaller negative forces count
# as errors of measurement.
PUSHING = 0.1
LARGEST_IN_RADIANS = 7.0  # if no angle is larger, the angles are refused as radians


@dataclass(frozen=True)
class Rod:
    """A rod and the bed that it was dragged through; None for an unknown number.

    radius, length, depth (of the axis): m. density: kg/m^3, of the bed, which is that
    of the grains times their volume fraction.

    Examples
    --------
    >>> from rft.fits.rods import fit
    >>> from rft.laws.drag import Rod, rod_drag
    >>> along = [1.0, 0.9, 0.5, 0.0]  # N
    >>> across = [0.0, 1.0, 1.7, 2.0]
    >>> drag = rod_drag([0, 30, 60, 90], along, across)  # at angles in degrees
    >>> round(fit("viscous", drag, Rod(radius=0.008, length=0.08)).axial_stress)  # Pa
    793
    """

    radius: float | None = None
    length: float | None = None
    depth: float | None = None
    density: float | None = None

    def __post_init__(self):
        for name in ("radius", "length", "depth"):
            value = getattr(self, name)
            if value is not None:
                in_range(f"the rod's {name}", value, 1e-9, 1e3)
        if self.density is not None:
            in_range("density", self.density, 1e-9, 1e6)

    @property
    def area(self) -> float | None:
        """Projected area 2 r L, m^2."""
        if self.radius and self.length:
            return 2 * self.radius * self.length
        return None

    @property
    def pressure(self) -> float | None:
        """Pressure rho g |z| of the grains above the axis, Pa."""
        if self.density and self.depth:
            return self.density * GRAVITY * self.depth
        return None


@dataclass(frozen=True, eq=False)
class RodDrag:
    """Forces on a rod, positive where they oppose the velocity.

    psi: (N,), attack angles, rad, from 0 to pi/2. forces: (2, N), along and across the
    rod, N. weight: (N,), of the squares of residuals, with mean 1. ends: (2, N), forces
    on both ends together, N, where they are told apart: ``forces`` are then those on a
    flank as long as the rod; None where they are those on the whole rod.

    Examples
    --------
    >>> from rft.laws.drag import rod_drag
    >>> drag = rod_drag([0.0, 90.0], [1.0, 0.0], [0.0, 2.0])
    >>> drag.psi.round(3), drag.forces.shape, drag.weight
    (array([0.   , 1.571]), (2, 2), array([1., 1.]))
    """

    psi: np.ndarray
    forces: np.ndarray
    weight: np.ndarray
    ends: np.ndarray | None = None

    @property
    def n_forces(self) -> int:
        """Number of forces of positive weight."""
        return 2 * int(np.count_nonzero(self.weight))

    @property
    def n_angles(self) -> int:
        """Number of different angles."""
        return np.unique(self.psi.round(9)).size


def rod_drag(psi_deg, along, across, weight=None, ends=None) -> RodDrag:
    """Return measurements at attack angles in degrees, mapped to 0 to 90 by symmetry:
    the ends of a rod are alike, and so are its sides. ends: (2, N), forces along and
    across on both ends, where the others are those on the flank.

    At angles beyond 0 to 90 forces may have the signs of the velocity's components, or
    all be magnitudes. Equal angles are separate measurements. Raises ValueError for
    numbers that cannot be drag: forces that push, exchanged columns, angles in radians.

    Examples
    --------
    >>> from rft.laws.drag import rod_drag
    >>> drag = rod_drag([0.0, 45.0, 135.0], [1.0, 0.8, -0.8], [0.0, 1.9, 1.9])
    >>> drag.psi.round(3), drag.forces
    (array([0.   , 0.785, 0.785]), array([[1. , 0.8, 0.8],
           [0. , 1.9, 1.9]]))
    """
    psi = real_array("psi_deg", psi_deg)
    along = real_array("forces along", along)
    across = real_array("forces across", across)
    if weight is None:
        weight = np.ones(psi.shape)
    weight = real_array("weights", weight)
    require(
        along.shape == across.shape == weight.shape == (psi.size,),
        "angles and forces must have the same length",
    )
    forces = np.array([along, across])
    finite = all(bool(np.isfinite(x).all()) for x in (psi, forces, weight))
    require(
        finite and psi.size > 0,
        "angles, forces and weights must be finite numbers, at least one of each",
    )
    require(
        bool((weight >= 0).all() and weight.any()),
        "weights must be 0 or more, and not all 0",
    )
    require(
        not 0 < np.abs(psi).max() <= LARGEST_IN_RADIANS,
        f"psi_deg reaches only {np.abs(psi).max():.3g}",
        because="angles look like radians",
        instead="give degrees from 0 to 90",
    )
    angle = np.arctan2(np.abs(np.sin(np.radians(psi))), np.abs(np.cos(np.radians(psi))))
    if ends is not None:
        ends = real_array("forces on the ends", ends)
        require(
            ends.shape == forces.shape and bool(np.isfinite(ends).all()),
            "forces on the ends must be two rows of numbers",
        )
        ends = _signs(psi) * ends
    data = RodDrag(
        angle, _opposing(psi, forces), weight / weight[weight > 0].mean(), ends
    )
    _require_not_exchanged(data)
    return data


def _signs(psi: np.ndarray) -> np.ndarray:
    """Return the signs (2, N) of velocities along and across at angles in degrees, 1
    where there is none."""
    velocity = np.array([np.cos(np.radians(psi)), np.sin(np.radians(psi))])
    return np.where(np.abs(velocity) < 1e-9, 1.0, np.sign(velocity))


def _opposing(psi: np.ndarray, forces: np.ndarray) -> np.ndarray:
    """Return the forces, positive where they oppose the motion; ValueError with the
    angle of a force that pushes."""
    largest = np.abs(forces).max()
    require(largest > 0, "all forces are zero", because="there is no drag to fit")
    require(
        bool((forces > 0).any()),
        "no force is positive",
        because="drag is positive where it opposes the motion",
        instead="change the sign",
    )
    opposing = max(_signs(psi) * forces, forces, key=lambda x: x.min())
    component, row = np.unravel_index(np.argmin(opposing), opposing.shape)
    direction = ("along", "across")[component]
    force = forces[component, row]
    require(
        opposing[component, row] >= -PUSHING * largest,
        f"at psi = {psi[row]:g} degrees the force {direction} the rod is {force:g} N, "
        "which drives the motion",
        because="drag is positive where it opposes the motion",
    )
    return opposing


def _require_not_exchanged(data: RodDrag) -> None:
    """Raise ValueError if forces along are nearer to a multiple of sin psi, and forces
    across to one of cos psi, than the other way round, by a factor of 4 in the sum of
    squares."""
    directions = np.array([np.cos(data.psi), np.sin(data.psi)])

    def misfit(shape):
        size = (shape * data.forces).sum(1) / np.maximum((shape**2).sum(1), 1e-12)
        return float(((data.forces - size[:, None] * shape) ** 2).sum())

    as_given = misfit(directions)
    require(
        misfit(directions[::-1]) >= 0.25 * as_given
        or as_given < 1e-06 * (data.forces**2).sum(),
        "the forces along the rod grow with psi and those across it fall",
        because="the columns are swapped, or psi is measured from the rod's normal",
        instead="psi is the angle between the velocity and the axis of the rod",
    )
