"""Links whose poses are a function of shape: any body that one can write down, rigid links or the pieces of a curve."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rft.bodies.base import Length, numbered_labels
from rft.bodies.links import Links
from rft.checks import check_numbers, in_range, real_array
from rft.refusal import Refusal, require

STEP = 0.01  # of the shape variables, of differences of order 6: errors of 1e-14 for functions that vary over 1 rad
WEIGHTS = (
    np.array([-1.0, 9.0, -45.0, 0.0, 45.0, -9.0, 1.0]) / 60.0
)  # of values at -3 to 3 steps
SHAPES = 5, 7  # batch on which a function shows whether it takes many shapes


class Posed(Links):
    """Base of bodies with a function ``positions`` of shapes alpha (..., joints), or of one shape (joints,), that returns the
    poses (..., n, 3) of the links: x, y of the centre, in the unit of ``lengths``, and heading theta, rad.

    Where the function sees the body from does not matter: poses are taken relative to the body frame. Velocities are
    differences of order 6 in the shape."""

    positions: Callable[[np.ndarray], np.ndarray]

    def __post_init__(self) -> None:
        in_range("joints", self.joints, 1, 10_000, whole=True)
        self._check_lengths()
        check_numbers(self)
        self._frame_link(self.frame)
        try:
            self._at(np.zeros((1, self.joints)))
        except Refusal:
            raise
        except Exception as error:
            raise Refusal(
                "positions fails", because=f"{type(error).__name__}: {error}"
            ) from error

    @property
    def shape_labels(self) -> tuple[tuple[str, str], ...]:
        return numbered_labels(self.joints)

    @cached_property
    def _takes_batches(self) -> bool:
        """Whether the function takes many shapes at once."""
        alpha = np.random.default_rng(0).normal(size=(*SHAPES, self.joints))
        try:
            all_at_once = np.asarray(self.positions(alpha), float)
        except (TypeError, ValueError, IndexError):
            return False
        one = np.asarray(self.positions(alpha[-1, -1]), float)
        return all_at_once.shape == (*SHAPES, *one.shape) and np.allclose(
            all_at_once[-1, -1], one, rtol=1e-9
        )

    def _at(self, alpha: np.ndarray) -> np.ndarray:
        """Return the poses (..., n, 3) at shapes (..., joints), in body lengths; ValueError unless they are n poses."""
        batch = alpha.shape[:-1]
        if self._takes_batches:
            poses = real_array("positions", self.positions(alpha))
        else:
            poses = real_array(
                "positions",
                [self.positions(x.copy()) for x in alpha.reshape(-1, self.joints)],
            )
            poses = poses.reshape(*batch, *poses.shape[1:])
        expected = len(self.lengths), 3
        is_right = poses.shape == (*batch, *expected)
        require(
            is_right,
            f"positions must return poses (x, y, theta) of the links, {expected}",
            value=poses.shape,
        )
        require(bool(np.isfinite(poses).all()), "positions must return finite numbers")
        total = sum(self.lengths)
        return poses / np.array([total, total, 1.0])

    def _links(self, alpha, alphadot):
        size = np.sqrt((alphadot * alphadot).sum(0))
        direction = alphadot / np.where(size > 0, size, 1.0)
        near = STEP * np.arange(-3, 4)[:, None, None] * direction
        poses = np.moveaxis(
            self._at(np.moveaxis(alpha + near, 1, -1)), 1, -1
        )  # (7, n, 3, B)
        poses[:, :, 2] = np.unwrap(np.unwrap(poses[:, :, 2], axis=1), axis=0)
        centres, theta = poses[:, :, 0] + 1j * poses[:, :, 1], poses[:, :, 2]
        rate = lambda x: np.tensordot(WEIGHTS, x, 1) * (size / STEP)
        return self._in_frame(centres[3], rate(centres), theta[3], rate(theta))

    def _in_frame(self, centre, velocity, theta, rotation) -> tuple[np.ndarray, ...]:
        """Return what `_links` does from centres, headings and their rates (n, B) in any one frame."""
        origin, drift, angle, spin = (
            self._frame_value(x, self._link)
            for x in (centre, velocity, theta, rotation)
        )
        back = np.exp(-1j * angle)
        centre, theta, rotation = (
            back * (centre - origin),
            theta - angle,
            rotation - spin,
        )
        return (
            np.exp(1j * theta),
            rotation,
            centre,
            back * (velocity - drift) - 1j * spin * centre,
            theta,
        )


@dataclass(frozen=True)
class Positions(Posed):
    """Links whose poses the function ``positions`` gives, such as a backbone function of sysplotter.

    positions: function of shapes alpha (..., joints), or of one shape, that returns poses (..., n, 3) of the links, tail to
    head: x, y of the centre in the unit of ``lengths`` and heading theta (rad), in any frame. lengths: of the n links.
    length: of the body, m; without it lengths are in body lengths. frame: "mean" or "link-1", "link-2" ...

    Examples
    --------
    >>> import numpy as np
    >>> from rft import Viscous, body_velocity
    >>> from rft.bodies import Positions
    >>> def poses(alpha):  # of two links that meet at the origin
    ...     heading = np.stack([-alpha[..., 0] / 2, alpha[..., 0] / 2], -1)
    ...     return np.stack([[-0.25, 0.25] * np.cos(heading), [-0.25, 0.25] * np.sin(heading), heading], -1)
    ...
    >>> body = Positions(poses, joints=1, lengths=(0.5, 0.5))
    >>> xi = body_velocity(Viscous(), body, [0.5], [1.0]).xi
    >>> round(float(xi[1]), 4)  # to the left, per rad
    -0.0038
    """

    positions: Callable[[np.ndarray], np.ndarray]
    joints: int
    lengths: tuple[float, ...]
    length: Length = None
    frame: str = "mean"
    kind = "positions"
