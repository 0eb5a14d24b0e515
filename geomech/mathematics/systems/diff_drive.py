"""The differential drive: a cart on two driven wheels that roll and do not slip.

Its shape variables are the angles of the wheels, and A does not depend on them: dA = 0,
and the CCF is the bracket of its columns alone, (0, -wheel_radius^2 / track, 0):
parallel parking. Source: R. L. Hatton and H. Choset, Int. J. Robotics Research 30, 988
(2011), Sec. 2."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from geomech.core.errors import choose
from geomech.mathematics.geometry.traits import Traits
from geomech.mathematics.systems.base import SYSTEMS, integrated
from rft.bodies.base import body_size
from rft.core.checks import Number, check_numbers, unmasked


@SYSTEMS.register
@dataclass(frozen=True)
class DifferentialDrive:
    """Two wheels on one axle. alpha_1 is the angle of the left wheel, alpha_2 of the
    right one, positive forwards.

    frame (-): "mean", midway between the wheels and heading forwards.

    Examples
    --------
    >>> from geomech.mathematics.systems import DifferentialDrive
    >>> DifferentialDrive(wheel_radius=0.5).velocity([0.0, 0.0], [1.0, 1.0])
    array([0.5, 0. , 0. ])
    """

    wheel_radius: Annotated[
        float,
        Number(
            1e-9,
            1e9,
            "m",
            "radius of both wheels; in units of the track if that is left out",
        ),
    ] = 0.5
    track: Annotated[
        float | None,
        Number(
            1e-9,
            1e9,
            "m",
            "distance between the wheels; lengths are in units of the track if it is "
            "left out",
        ),
    ] = None
    frame: str = "mean"

    kind = "differential-drive"
    joints = 2
    run = integrated
    traits = Traits(linear=True, labels=(("left wheel", "rad"), ("right wheel", "rad")))

    def __post_init__(self):
        check_numbers(self)
        choose("frame", self.frame, ["mean"])

    @property
    def length(self) -> float | None:
        """The track, m; None where lengths are in tracks."""
        return self.track

    @property
    def _matrix(self) -> np.ndarray:
        """A (3, 2)."""
        half = self.wheel_radius / 2
        turn = self.wheel_radius / body_size(self)
        return np.array([[half, half], [0.0, 0.0], [-turn, turn]])

    def velocity(self, alpha: ArrayLike, alphadot: ArrayLike) -> np.ndarray:
        """Return xi (..., 3), (track/time, track/time, rad/time): (r (w_1 + w_2) / 2,
        0, r (w_2 - w_1) / track)."""
        alpha = unmasked("alpha", alpha)
        alphadot = unmasked("alphadot", alphadot)
        _, rates = np.broadcast_arrays(alpha, alphadot)
        return rates @ self._matrix.T

    def symbolic(self) -> tuple[Any, tuple[Any, ...]]:
        """Return A (3, 2) as a sympy Matrix, and the wheels' angles
        (`geomech.mathematics.symbolic`)."""
        from geomech.mathematics.symbolic import connections

        return connections.differential_drive(self.wheel_radius, body_size(self))

    @classmethod
    def examples(cls) -> dict[str, DifferentialDrive]:
        return {"differential-drive": cls(0.03, 0.15)}
