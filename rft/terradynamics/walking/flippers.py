"""A robot on two flippers: a box that lies on the ground, and drags itself by them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from rft.core.checks import check_numbers
from rft.core.metres import LARGEST, metres
from rft.core.refusal import require
from rft.terradynamics.meshes import Mesh
from rft.terradynamics.meshes.surfaces import shapes
from rft.terradynamics.walking.robot import Mass, Robot, Tripod

WRISTS = ("fixed", "free")
# Of the time between strokes: in the first quarter flippers rise, in the last they go
# down.
QUARTER = 0.25


@dataclass(frozen=True)
class Flippers(Robot):
    """A box with a flipper on either side, which go down, back, up and forth together.

    A flipper is an upright plate at the end of a level arm. The arm turns about an
    upright axis at the shoulder, and the plate moves up and down along it. For a share
    ``duty`` of the cycle the plate is down and the arm sweeps back by ``sweep``; for
    the rest it rises, comes back and goes down again, a quarter, half and quarter of
    the time. At angle 0 the arm points aside.

    wrist (-): "fixed", the plate turns with the arm, or "free", it turns on an upright
    hinge in its middle, with a spring that only aligns it while it is in the air.

    Examples
    --------
    >>> from rft.terradynamics.walking import Flippers
    >>> robot = Flippers(0.8, 0.19, 0.1, 0.04, 0.06, 0.05, 0.05, 0.005, depth=0.03)
    >>> robot.wrist, robot.travel
    ('fixed', 0.04)
    """

    mass: Mass
    length: Annotated[float, metres("length of the box about the centre of mass")]
    width: Annotated[float, metres("width of the box about the centre of mass")]
    height: Annotated[float, metres("height of the box about the centre of mass")]
    arm: Annotated[float, metres("length of an arm, from shoulder to wrist")]
    flipper_width: Annotated[float, metres("width of a flipper, along its arm")]
    flipper_height: Annotated[float, metres("height of a flipper")]
    flipper_thickness: Annotated[float, metres("thickness of a flipper")]
    depth: Annotated[
        float, metres("how far the lower edges of flippers go below the box")
    ]
    lift: Annotated[
        float, metres("how far the lower edges are above the box's bottom in the air")
    ] = 0.01
    shoulder: Annotated[
        float, metres("x of the shoulders from the centre of mass", -LARGEST)
    ] = 0.0
    wrist: str = "fixed"
    part = "flipper"
    parts = "flippers"
    period = 1.0

    def __post_init__(self):
        check_numbers(self)
        require(
            self.wrist in WRISTS,
            f"wrist must be one of {', '.join(WRISTS)}",
            value=self.wrist,
        )
        require(
            self.depth < self.flipper_height,
            f"flippers {self.flipper_height:g} m high do not reach "
            f"{self.depth:g} m below the box",
            instead="make depth less than flipper_height",
        )
        require(
            self.flipper_width < 2 * self.arm,
            "flippers reach into the box",
            instead="make flipper_width less than twice the arm",
        )

    @property
    def travel(self) -> float:
        """How far flippers move up and down, m."""
        return self.depth + self.lift

    @property
    def inertia(self) -> np.ndarray:
        """Moments of inertia (3,), kg m^2, of the box about x, y, z."""
        squares = np.array([self.length, self.width, self.height]) ** 2
        return self.mass / 12 * (squares.sum() - squares)

    @property
    def shoulders(self) -> tuple[tuple[float, float, float], ...]:
        """Left and right shoulder from the centre of mass, m, at the height of the
        middles of flippers that are down."""
        z = -self.height / 2 - self.depth + self.flipper_height / 2
        y = self.width / 2
        return (self.shoulder, y, z), (self.shoulder, -y, z)

    def flipper(self, elements: int) -> Mesh:
        """Return the mesh of a flipper about its middle, with the arm along y."""
        sides = (self.flipper_thickness, self.flipper_width, self.flipper_height)
        count = max(1, elements // 4)
        return shapes.box(sides, (1, count, count))

    def hull(self, elements: int) -> Mesh:
        """Return the mesh of the box, about the centre of mass, with an edge along its
        middle plane."""
        count = max(1, elements // 6)
        sides = (self.length, self.width, self.height)
        return shapes.box(sides, (count, 2 * count, count))

    def check(self, elements: int) -> None:
        self.flipper(elements)

    def stroke(self, gait: Tripod, phase, rate_phase) -> tuple[np.ndarray, np.ndarray]:
        """Return the angle of the arms back from aside, rad, and the height of the
        flippers over their lowest, m, (2,), and both per cycle, at a phase by the rates
        at ``rate_phase``, cycles.

        Phase 0 is the middle of the stroke."""
        turns = np.floor(rate_phase + 0.5)
        phase = phase - turns
        rate_phase = rate_phase - turns
        times, angles, heights = self._corners(gait)
        part = np.clip(np.searchsorted(times, rate_phase) - 1, 0, len(times) - 2)
        values = np.stack([angles, heights])
        duration = times[part + 1] - times[part]
        rates = (values[:, part + 1] - values[:, part]) / duration
        return values[:, part] + rates * (phase - times[part]), rates

    def _corners(self, gait: Tripod) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the phases from -0.5 to 0.5 where rates jump, with both ends, and the
        angles, rad, and heights, m, there."""
        half = gait.duty / 2
        raised = half + QUARTER * (1 - gait.duty)
        times = np.array([-0.5, -raised, -half, half, raised, 0.5])
        front = gait.middle - gait.sweep / 2
        back = gait.middle + gait.sweep / 2
        angles = [gait.middle, front, front, back, back, gait.middle]
        up = self.travel
        return times, np.array(angles), np.array([up, up, 0.0, 0.0, up, up])

    def kinks(self, gait: Tripod) -> np.ndarray:
        """Return the phases from -0.5 to 0.5 at which rates jump."""
        return self._corners(gait)[0][1:-1]
