"""The base of prescribed motions, for outlines in the vertical plane and for meshes."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np

from rft.core.checks import Number, real_array
from rft.core.metres import LARGEST, metres
from rft.core.refusal import Refusal, require

MOST_SAMPLES = 100_000
FARTHEST = 1e3  # m along the ground

Samples = Annotated[
    int,
    Number(
        2,
        MOST_SAMPLES,
        "-",
        "number of poses along the motion, 2 to 100,000",
        whole=True,
    ),
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
    """Base of motions.

    samples: number of poses. turns: True where the body's angle measures the progress
    of the motion, False where its position does.
    """

    samples: int
    turns = False

    def require_downwards(self) -> None:
        """Raise ValueError unless the direction points into the ground."""
        require(
            0.01 < self.direction < math.pi - 0.01,
            "direction must point downwards, "
            "between 0 and 180 degrees below the horizontal",
        )

    def require_turning(self) -> None:
        """Raise ValueError unless the rate leads from start to stop."""
        require(
            abs(self.rate) >= 1e-9,
            "rate must not be 0",
            instead="use drag for a body that does not turn",
        )
        reaches_stop = (self.stop - self.start) * self.rate > 0
        require(
            reaches_stop,
            "the rate must lead from start to stop",
            because="positive if stop > start, otherwise negative",
        )


def set_numbers(path: Motion, name: str, largest: float, unit: str = "") -> None:
    """Store a field of a path as a tuple of numbers; ValueError unless it is a list of
    finite numbers, of at most ``largest`` in size."""
    values = real_array(name, getattr(path, name))
    require(values.ndim == 1, f"{name} must be a list of numbers")
    object.__setattr__(path, name, tuple(values.tolist()))
    is_within = bool((np.abs(values) <= largest).all())
    require(is_within, f"{name} must be finite and within {largest:g}{unit}")


def require_path_length(t: tuple[float, ...]) -> None:
    """Raise ValueError unless a path has as many poses as it may have."""
    require(
        3 <= len(t) <= MOST_SAMPLES,
        f"a path must have 3 to {MOST_SAMPLES} poses",
        value=len(t),
    )


def require_ascending(t: tuple[float, ...]) -> None:
    """Raise ValueError unless each time of a path is before the next."""
    late = np.flatnonzero(np.diff(t) <= 0)
    if late.size:
        raise Refusal(f"t must increase, but t = {t[late[0]]:g} is not before the next")
