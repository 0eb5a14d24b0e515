"""The base of prescribed motions, of outlines in the vertical plane and of meshes."""

from __future__ import annotations

import math
from typing import Annotated

from rft.core.checks import Number
from rft.core.metres import LARGEST, metres
from rft.core.refusal import require

MOST_SAMPLES = 100_000
FARTHEST = 1e3  # m along the ground

Samples = Annotated[
    int,
    Number(2, MOST_SAMPLES, "-", "poses along the motion, 2 to 100,000", whole=True),
]
Distance = Annotated[float, Number(1e-9, FARTHEST, "m", "length of the path")]
Direction = Annotated[
    float, Number(-10, 10, "rad", "direction of the motion below the horizontal")
]
Depth = Annotated[float, metres("depth of the frame's origin at the start", -LARGEST)]
Height = Annotated[
    float, metres("height of the frame's origin above the surface", -LARGEST)
]


class Motion:
    """Base of motions. turns: whether the progress of the motion is the angle of the body, not its position."""

    samples: int
    turns = False

    def require_downwards(self) -> None:
        """Raise ValueError unless the direction points into the ground."""
        message = "direction must point downwards, between 0 and 180 degrees below the horizontal"
        require(0.01 < self.direction < math.pi - 0.01, message)

    def require_turning(self) -> None:
        """Raise ValueError unless the rate leads from start to stop."""
        require(
            abs(self.rate) >= 1e-09,
            "rate must not be 0",
            because="drag a body that does not turn",
        )
        forwards = (self.stop - self.start) * self.rate > 0
        require(
            forwards,
            "a rate from start to stop",
            because="positive if stop > start, else negative",
        )
