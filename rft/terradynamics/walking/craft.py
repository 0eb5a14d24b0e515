"""A craft that two screws drive: a box over screws along its x axis, side by side,
which rotate at a given rate."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated

import numpy as np

from rft.core.checks import check_numbers
from rft.core.metres import LARGEST, metres
from rft.core.refusal import formatted, require
from rft.terradynamics.meshes import Mesh, Screw
from rft.terradynamics.meshes.surfaces import shapes
from rft.terradynamics.walking.robot import Mass, Robot

PAIRS = ("mirrored", "alike")
PER_SQUARE = 10  # triangles of a screw over the square of the number of elements


@dataclass(frozen=True)
class Screws(Robot):
    """Two screws under a box that carries all the mass. x forwards, y to the left, z
    up.

    screw (-): the left screw; both drive forwards. pair (-): "mirrored", the right
    screw is the mirror image of the left and rotates in the other direction, or
    "alike", both are the same and rotate in the same direction.

    Examples
    --------
    >>> from rft.terradynamics.meshes import Screw
    >>> from rft.terradynamics.walking import Screws
    >>> screw = Screw(radius=0.03, core=0.02, pitch=0.06, length=0.2, thickness=0.004)
    >>> craft = Screws(1.0, 0.2, 0.16, 0.04, screw, track=0.12, drop=0.055)
    >>> craft.pair  # the right screw is the mirror image of this one
    'mirrored'
    """

    mass: Mass
    length: Annotated[float, metres("length of the box about the centre of mass")]
    width: Annotated[float, metres("width of the box about the centre of mass")]
    height: Annotated[float, metres("height of the box about the centre of mass")]
    screw: Screw
    track: Annotated[float, metres("distance between the axes")]
    drop: Annotated[
        float, metres("depth of the axes below the centre of mass", -LARGEST)
    ] = 0.0
    pair: str = "mirrored"
    part = "screw"
    parts = "screws"
    period = 1.0

    def __post_init__(self):
        check_numbers(self)
        require(
            isinstance(self.screw, Screw),
            "a robot without screws",
            because=f"screw must be a Screw, got {formatted(self.screw)}",
        )
        require(
            self.pair in PAIRS,
            f"pair must be one of {', '.join(PAIRS)}",
            value=self.pair,
        )
        radius = self.screw.radius
        require(
            self.track > 2 * radius,
            f"screws of radius {radius:g} m meet: track must be more than "
            f"{2 * radius:g} m",
        )

    @property
    def screws(self) -> tuple[tuple[Screw, tuple[float, float, float]], ...]:
        """The left and the right screw, each with its middle from the centre of mass,
        m."""
        y = self.track / 2
        z = -self.drop
        right = self.screw.mirrored if self.pair == "mirrored" else self.screw
        return (self.screw, (0.0, y, z)), (right, (0.0, -y, z))

    @property
    def inertia(self) -> np.ndarray:
        """Moments of inertia (3,), kg m^2, of the box about x, y, z."""
        squares = np.array([self.length, self.width, self.height]) ** 2
        return self.mass / 12 * (squares.sum() - squares)

    def meshes(self, elements: int) -> list[Mesh]:
        """Return the meshes of the screws, of `PER_SQUARE` elements^2 triangles."""
        return [_mesh(screw, PER_SQUARE * elements**2) for screw, _ in self.screws]

    def hull(self, elements: int) -> Mesh:
        """Return the mesh of the box, about the centre of mass."""
        return shapes.box((self.length, self.width, self.height), max(1, elements // 6))

    def check(self, elements: int) -> None:
        _mesh(
            self.screw, PER_SQUARE * elements**2
        )  # the right screw is the same, or its mirror image


@lru_cache(maxsize=2)
def _mesh(screw: Screw, triangles: int) -> Mesh:
    """Return the mesh of a screw, the same one for the scenes of a sweep over another
    parameter."""
    return screw.mesh(triangles)
