"""Objectives of an optimisation: a number of a cycle to be maximised, with its
slopes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geomech.core.errors import choose
from geomech.studies.optimisation.cycles import CycleValues
from rft.core.checks import in_range
from rft.core.refusal import Refusal

OBJECTIVES = ("displacement", "efficiency", "turning", "speed")
DIRECTIONS = ("x", "y")
UNITS = {
    "displacement": "BL per cycle",
    "efficiency": "BL/BL",
    "turning": "rad per cycle",
    "speed": "BL/s",
}
TINY = 1e-9  # body lengths: smaller distances count as 0
NEARLY_LONGEST = 1e-2  # of the longest time: a limit so near sets the time as well


@dataclass(frozen=True)
class Objective:
    """A number of a cycle to be maximised.

    displacement: net distance of a cycle over the body's length, or its component along
    an axis of the body frame as this points on average over the cycle. For a gait that
    does not turn, neither depends on where the cycle starts. turning: net angle of a
    cycle, rad. efficiency: displacement over the length of the path. speed:
    displacement over the least time of a cycle.

    name: one of OBJECTIVES. direction: "x" or "y", or "" for the net distance. length:
    of the body. For speed, rate: the largest rate of any shape variable, rad per unit
    of time; power: the largest mean power, in the body's axial drag x body length /
    time."""

    name: str
    direction: str = ""
    length: float = 1.0
    rate: float | None = None
    power: float | None = None

    def __post_init__(self):
        choose("``objective``", self.name, OBJECTIVES)
        if not (isinstance(self.direction, str) and self.direction == ""):
            choose("``direction``", self.direction, DIRECTIONS)
            if self.name == "turning":
                raise Refusal(
                    "``direction`` applies to displacement",
                    because="turning has no direction",
                    instead="remove it",
                )
        for name in ("rate", "power"):
            limit = getattr(self, name)
            if limit is None:
                continue
            in_range(f"``{name}``", limit, 1e-9, 1e9)
            if self.name != "speed":
                raise Refusal(
                    f"``{name}`` limits a speed",
                    instead="use ``objective`` speed, or remove it",
                )

    @property
    def straight(self) -> bool:
        """Whether the objective is a distance, not an angle."""
        return self.name != "turning"

    @property
    def costs(self) -> bool:
        """Whether the value depends on power."""
        return self.name == "efficiency" or self.power is not None

    @property
    def timed(self) -> bool:
        """Whether the value depends on the time of a cycle."""
        return self.name == "speed"

    @property
    def unit(self) -> str:
        return UNITS[self.name]

    def value(self, cycle: CycleValues, time: float = 1.0) -> tuple[float, np.ndarray]:
        """Return the value and its slopes in p.

        time: of a rad of phase, for speed; the slopes hold at that constant time."""
        if self.name == "turning":
            theta = cycle.net[0][2]
            return abs(theta), _sign(theta) * cycle.net[1][2]
        distance, slopes = self._displacement(cycle)

        if self.name == "efficiency":
            length, length_slopes = cycle.length
            if length == 0:  # the gait rests
                return 0.0, 0 * slopes
            value = distance / length
            return value, (slopes - value * length_slopes) / length

        if time == 0:  # the gait rests
            return 0.0, 0 * slopes
        period = 1.0
        if self.timed:
            period = 2 * np.pi * time
        return distance / period, slopes / period

    def _displacement(self, cycle: CycleValues) -> tuple[float, np.ndarray]:
        """Return the distance over the body's length, and its slopes."""
        if self.direction:
            value, slopes = self.along(cycle)
            return abs(value) / self.length, _sign(value) * slopes / self.length
        (x, y, _), (dx, dy, _) = cycle.net
        distance = np.hypot(x, y)
        if distance < TINY * self.length:
            # At the tip of the cone |(x, y)|: take the direction of steepest ascent.
            rows = np.stack([dx.ravel(), dy.ravel()])
            x, y = np.linalg.svd(rows, full_matrices=False)[0][:, 0]
        slopes = (x * dx + y * dy) / np.hypot(x, y)
        return distance / self.length, slopes / self.length

    def along(self, cycle: CycleValues) -> tuple[float, np.ndarray]:
        """Return the displacement along the direction, with its sign and in the
        system's unit, and its slopes."""
        (x, y, _), (dx, dy, _) = cycle.net
        swing, d_swing = cycle.swing
        c = np.cos(swing)
        s = np.sin(swing)
        along = c * x - s * y
        across = s * x + c * y
        if self.direction == "x":
            return along, c * dx - s * dy - across * d_swing
        return across, s * dx + c * dy + along * d_swing

    def time(
        self, fastest: float, power: float | None, degree: float
    ) -> tuple[float, list[str]]:
        """Return the least time of a rad of phase that the limits allow, and the names
        of the limits that set it.

        fastest: largest rate of any shape variable; power: mean power; both at one rad
        of phase per unit of time. The power is of ``degree`` in the rate."""
        times = {"rate": 0.0, "power": 0.0}
        if self.rate:
            times["rate"] = fastest / self.rate
        if self.power:
            times["power"] = (power / self.power) ** (1 / degree)
        longest = max(times.values())
        if longest <= 0:
            return longest, []
        nearly = [x * (1 + NEARLY_LONGEST) for x in times.values()]
        return longest, [name for name, x in zip(times, nearly) if longest <= x]


def _sign(value: float) -> float:
    """Return -1 for negative values, else 1."""
    return -1.0 if value < 0 else 1.0
