"""Objectives of an optimisation: a number of a cycle that should be as large as possible, with its slopes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geomech.core.errors import choose
from geomech.optimisation.cycles import CycleValues
from rft.core.checks import in_range
from rft.core.refusal import Refusal

OBJECTIVES = ("displacement", "efficiency", "turning", "speed")
DIRECTIONS = ("x", "y")
TINY = 1e-9  # body lengths: smaller distances count as 0


@dataclass(frozen=True)
class Objective:
    """A number of a cycle to be maximised.

    displacement: net distance of a cycle over the body's length, or its component along an axis of the body frame as
    this points on average over the cycle; for a gait that does not turn, neither depends on where the cycle starts.
    turning: net angle of a cycle, rad. efficiency: displacement over the length of the path. speed: displacement over
    the least time of a cycle.

    name: one of OBJECTIVES. direction: "x" or "y", or "" for the net distance. length: of the body. For speed, rate: the
    largest rate of any shape variable, rad per unit of time; power: the largest mean power, in the body's axial drag x
    body length / time."""

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
                    "``direction`` is that of a displacement",
                    because="turning takes none",
                    instead="drop it",
                )
        for name in ("rate", "power"):
            if getattr(self, name) is not None:
                in_range(f"``{name}``", getattr(self, name), 1e-9, 1e9)
                if self.name != "speed":
                    raise Refusal(
                        f"``{name}`` limits speed",
                        instead="say ``objective`` speed, or drop it",
                    )

    straight = property(
        lambda self: self.name != "turning",
        doc="Whether the objective is a distance, not an angle.",
    )
    costs = property(
        lambda self: self.name == "efficiency" or self.power is not None,
        doc="Whether the value depends on power.",
    )
    timed = property(
        lambda self: self.name == "speed",
        doc="Whether the value depends on the time of a cycle.",
    )
    unit = property(
        lambda self: {"turning": "rad per cycle", "speed": "BL/s"}.get(
            self.name, "BL per cycle" if self.name == "displacement" else "BL/BL"
        )
    )

    def value(self, b: CycleValues, time: float = 1.0) -> tuple[float, np.ndarray]:
        """Return the value and its slopes. time: of a rad of phase, used by speed; its slopes hold at that constant
        time."""
        if self.name == "turning":
            theta = b.net[0][2]
            return abs(theta), (-1.0 if theta < 0 else 1.0) * b.net[1][2]
        far = self._displacement(b)
        if (b.length[0] if self.name == "efficiency" else time) == 0:  # the gait rests
            return 0.0, 0 * far[1]
        if self.name == "efficiency":
            value = far[0] / b.length[0]
            return value, (far[1] - value * b.length[1]) / b.length[0]
        cycle = 2 * np.pi * time if self.timed else 1.0
        return far[0] / cycle, far[1] / cycle

    def _displacement(self, b: CycleValues) -> tuple[float, np.ndarray]:
        (x, y, _), (dx, dy, _) = b.net
        if not self.direction:
            size = np.hypot(x, y)
            if (
                size < TINY * self.length
            ):  # at the tip of a cone: the direction of steepest ascent
                x, y = np.linalg.svd(
                    np.stack([dx.ravel(), dy.ravel()]), full_matrices=False
                )[0][:, 0]
            return size / self.length, (x * dx + y * dy) / np.hypot(x, y) / self.length
        value, slopes = self.along(b)
        return abs(value) / self.length, (
            -1.0 if value < 0 else 1.0
        ) * slopes / self.length

    def along(self, b: CycleValues) -> tuple[float, np.ndarray]:
        """Return the displacement along the direction, with its sign and in the system's unit, and its slopes."""
        (x, y, _), (dx, dy, _), (swing, d_swing) = *b.net, b.swing
        c, s = np.cos(swing), np.sin(swing)
        along, across = c * x - s * y, s * x + c * y
        if self.direction == "x":
            return along, c * dx - s * dy - across * d_swing
        return across, s * dx + c * dy + along * d_swing

    def time(
        self, fastest: float, power: float | None, degree: float
    ) -> tuple[float, list[str]]:
        """Return the least time of a rad of phase that the limits allow, and the names of the limits that set it.
        fastest: largest rate of any shape variable, power: mean power, both at one rad of phase per unit of time; the
        power is of ``degree`` in the rate."""
        times = {"rate": fastest / self.rate if self.rate else 0.0}
        times["power"] = (power / self.power) ** (1 / degree) if self.power else 0.0
        longest = max(times.values())
        return longest, [
            name for name, x in times.items() if 0 < longest <= x * (1 + 1e-2)
        ]
