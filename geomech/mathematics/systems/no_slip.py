"""The no-slip, or kinematic, snake: three links on wheels that roll along the link and
do not slip sideways.

The velocity across the link is zero at every link's centre: three equations for xi,
linear in alphadot, without a force law. Source: the kinematic snake of E. A. Shammas,
H. Choset and A. A. Rizzi, Int. J. Robotics Research 26, 1075 (2007)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from geomech.mathematics.geometry.traits import Traits
from geomech.mathematics.systems.base import SYSTEMS, integrated
from rft.bodies import Chain
from rft.bodies.base import Length, body_size
from rft.core.checks import unmasked
from rft.core.refusal import Refusal

# The equations count as singular below this determinant; roundoff is smaller.
SINGULAR = 1e-14


@SYSTEMS.register
@dataclass(frozen=True)
class NoSlipSnake:
    """Three links, tail to head, with wheels at their centres.

    lengths (-): relative link lengths, tail to head. frame (-): "mean", centre of mass
    and mean heading, or "link-1", "link-2", "link-3", centre and heading of that link.

    Where the wheels' axles meet in one point, or are parallel, the snake can turn about
    it without a wheel slipping sideways: the shape is singular. For equal links that is
    alpha_1 = alpha_2, the straight snake and arcs of a circle.

    Examples
    --------
    >>> from geomech.mathematics.systems import NoSlipSnake
    >>> NoSlipSnake().velocity([0.7, -0.7], [1.0, 0.0]).round(4)
    array([-0.1027, -0.0041, -0.05  ])
    """

    lengths: tuple[float, float, float] = (1.0, 1.0, 1.0)
    length: Length = None
    frame: str = "mean"

    kind = "no-slip-snake"
    joints = 2
    run = integrated

    def __post_init__(self):
        object.__setattr__(self, "lengths", self._chain.lengths)
        if len(self.lengths) != 3:
            raise Refusal(
                "lengths must be those of three links", value=len(self.lengths)
            )

    @property
    def traits(self) -> Traits:
        return Traits(
            linear=True,
            mirror=True,
            joint_angles=True,
            frame=self.frame,
            singularity=self._determinant,
            singular="the axles of the wheels meet in one point",
        )

    @property
    def _chain(self) -> Chain:
        return Chain(self.lengths, self.length, self.frame)

    def points(self, alpha: ArrayLike, pose: ArrayLike = (0.0, 0.0, 0.0)) -> np.ndarray:
        """Return the ends of the links in the world, as `rft.Chain.points`."""
        return self._chain.points(alpha, pose)

    def _rolling(self, alpha, alphadot):
        """Return rows (..., 3, 3) and sides (..., 3): velocity across each link's
        centre = row . xi + side, body lengths."""
        alpha = unmasked("alpha", alpha)
        alphadot = unmasked("alphadot", alphadot)
        alpha, alphadot = np.broadcast_arrays(alpha, alphadot)
        motion = self._chain.motion(alpha.reshape(-1, 2).T, alphadot.reshape(-1, 2).T)
        rows = np.stack([-motion.s, motion.c, motion.r_n], -1).swapaxes(0, 1)
        sides = motion.v[1].T
        lead = alpha.shape[:-1]
        return rows.reshape(*lead, 3, 3), sides.reshape(*lead, 3)

    def about(self) -> dict:
        where = (
            f"nan, where {self.traits.singular}, and where they lie between two grid "
            "points"
        )
        return {"singular_shapes": where}

    def _determinant(self, alpha) -> np.ndarray:
        """Return the determinant of the three equations (...,), 0 at singular shapes;
        no unit."""
        det = np.linalg.det(self._rolling(alpha, np.zeros(2))[0])
        return np.where(np.abs(det) < SINGULAR, 0.0, det)

    def velocity(self, alpha: ArrayLike, alphadot: ArrayLike) -> np.ndarray:
        """Return xi (..., 3) in the frame, (length/time, length/time, rad/time); nan at
        singular shapes."""
        rows, side = self._rolling(alpha, alphadot)
        good = np.abs(np.linalg.det(rows)) >= SINGULAR
        rows = np.where(good[..., None, None], rows, np.eye(3))
        xi = np.linalg.solve(rows, -side[..., None])[..., 0]
        scale = [body_size(self), body_size(self), 1.0]
        return np.where(good[..., None], xi, np.nan) * scale

    def symbolic(self) -> tuple[Any, tuple[Any, ...]]:
        from geomech.mathematics.symbolic import connections

        A, alpha = connections.no_slip_snake(self.lengths, self.frame)
        return connections.in_length(body_size(self), A), alpha

    @classmethod
    def examples(cls) -> dict[str, NoSlipSnake]:
        return {"no-slip-snake": cls((0.8, 1.3, 1.0), length=0.4, frame="link-1")}
