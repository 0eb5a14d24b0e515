"""Links whose poses are a function of shape: any body that one can write down, rigid
links or the pieces of a curve."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from rft.bodies.base import Length, numbered_labels
from rft.bodies.links import Links
from rft.core.checks import check_numbers, in_range, real_array
from rft.core.refusal import Refusal, require

# of the shape variables, of differences of order 6: errors of 1e-14 for functions that
# vary over 1 rad
STEP = 0.01
# of values at -3 to 3 steps
WEIGHTS = np.array([-1.0, 9.0, -45.0, 0.0, 45.0, -9.0, 1.0]) / 60.0
SHAPES = 5, 7  # batch on which a function shows whether it takes many shapes
# Links that are taken for pieces of a curve where the body does not say (assumed): so
# many, and so many times the shape variables.
PIECES_OF_A_CURVE = 10
PIECES_PER_VARIABLE = 3
JOINED = 1e-9  # of the body's length, between links that meet


class PosedLinks(Links):
    """Base of bodies with a function ``positions`` of shapes alpha (..., joints), or of
    one shape (joints,), that returns the poses (..., n, 3) of the links: x, y of the
    centre, in the unit of ``lengths``, and heading theta, rad.

    Where the function sees the body from does not matter: poses are taken relative to
    the body frame. Velocities are differences of order 6 in the shape.

    continuous: whether the links are pieces of a curve, whose number is a numerical
    setting; None: they are where there are at least 10, and three times as many as
    shape variables."""

    positions: Callable[[np.ndarray], np.ndarray]
    continuous: bool | None = None

    def __post_init__(self) -> None:
        in_range("joints", self.joints, 1, 10_000, whole=True)
        self._check_lengths()
        check_numbers(self)
        self._frame_link(self.frame)
        try:
            self._poses(np.zeros((1, self.joints)))
        except Refusal:
            raise
        except Exception as error:
            raise Refusal(
                "positions fails", because=f"{type(error).__name__}: {error}"
            ) from error

    @property
    def shape_labels(self) -> tuple[tuple[str, str], ...]:
        return numbered_labels(self.joints)

    @property
    def elements(self) -> int | None:
        """Number of pieces of a curve; None of rigid links."""
        links = len(self.lengths)
        continuous = self.continuous
        if continuous is None:
            enough = links >= PIECES_PER_VARIABLE * self.joints
            continuous = enough and links >= PIECES_OF_A_CURVE
        return links if continuous else None

    def with_elements(self, count: int) -> ResampledLinks:
        """Return the body of ``count`` equal links on the same curve, in the frame
        "mean"."""
        return ResampledLinks(self, count)

    def resampled(self, shape: ArrayLike, count: int) -> np.ndarray:
        """Return shapes, or rates, (..., joints) as those of `with_elements`: the
        same."""
        return np.asarray(shape, float)

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

    def _poses(self, alpha: np.ndarray) -> np.ndarray:
        """Return the poses (..., n, 3) at shapes (..., joints), in body lengths;
        ValueError unless they are n poses."""
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
        poses = self._poses(np.moveaxis(alpha + near, 1, -1))
        poses = np.moveaxis(poses, 1, -1)  # (7, n, 3, B)
        poses[:, :, 2] = np.unwrap(np.unwrap(poses[:, :, 2], axis=1), axis=0)
        centres = poses[:, :, 0] + 1j * poses[:, :, 1]
        theta = poses[:, :, 2]

        def rate(x):
            return np.tensordot(WEIGHTS, x, 1) * (size / STEP)

        return self._in_frame(centres[3], rate(centres), theta[3], rate(theta))

    def _in_frame(self, centre, velocity, theta, rotation) -> tuple[np.ndarray, ...]:
        """Return what `_links` does from centres, headings and their rates (n, B) in
        any one frame."""
        origin, frame_velocity, frame_theta, frame_rotation = (
            self._frame_value(x, self.frame_link)
            for x in (centre, velocity, theta, rotation)
        )
        to_frame = np.exp(-1j * frame_theta)
        centre = to_frame * (centre - origin)
        velocity = to_frame * (velocity - frame_velocity) - 1j * frame_rotation * centre
        theta = theta - frame_theta
        rotation = rotation - frame_rotation
        return np.exp(1j * theta), rotation, centre, velocity, theta


@dataclass(frozen=True)
class Positions(PosedLinks):
    """Links whose poses the function ``positions`` gives, such as a backbone function
    of sysplotter.

    positions: function of shapes alpha (..., joints), or of one shape, that returns
    poses (..., n, 3) of the links, tail to head: x, y of the centre in the unit of
    ``lengths`` and heading theta (rad), in any frame. lengths: of the n links. length:
    of the body, m; without it lengths are in body lengths. frame: "mean" or "link-1",
    "link-2" ... continuous: whether the links are pieces of a curve, so that errors
    contain the change with half of them; None: where there are at least 10, and three
    times as many as shape variables.

    Examples
    --------
    >>> import numpy as np
    >>> from rft import Viscous, body_velocity
    >>> from rft.bodies import Positions
    >>> def poses(alpha):  # of two links that meet at the origin
    ...     heading = np.stack([-alpha[..., 0] / 2, alpha[..., 0] / 2], -1)
    ...     x = [-0.25, 0.25] * np.cos(heading)
    ...     y = [-0.25, 0.25] * np.sin(heading)
    ...     return np.stack([x, y, heading], -1)
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
    continuous: bool | None = None
    kind = "positions"


@dataclass(frozen=True)
class ResampledLinks(PosedLinks):
    """``count`` equal links on the curve through the links of a body, by splines: of
    their headings where links join, so that these join too, else of their poses."""

    inner: PosedLinks
    count: int
    frame: str = "mean"

    def __post_init__(self) -> None:
        in_range("elements", self.count, 3, 10_000, whole=True)
        super().__post_init__()

    @property
    def joints(self) -> int:
        return self.inner.joints

    @property
    def length(self) -> float | None:  # type: ignore[override]  # of most it is a field
        return self.inner.length

    @property
    def lengths(self) -> tuple[float, ...]:  # type: ignore[override]
        return (1.0 / self.count,) * self.count

    def _check_lengths(self) -> None:
        """The inner body's are checked."""

    @cached_property
    def _joined(self) -> bool:
        """Whether links of the inner body meet at their ends, at a few random
        shapes."""
        alpha = np.random.default_rng(0).uniform(-1.0, 1.0, (5, self.joints))
        poses = self.inner._poses(alpha)
        centre = poses[..., 0] + 1j * poses[..., 1]
        half = self.inner.fractions / 2 * np.exp(1j * poses[..., 2])
        gap = (centre - half)[..., 1:] - (centre + half)[..., :-1]
        return bool(np.abs(gap).max() < JOINED)

    def positions(self, alpha: np.ndarray) -> np.ndarray:
        from scipy.interpolate import CubicSpline

        poses = self.inner._poses(np.asarray(alpha, float))
        poses[..., 2] = np.unwrap(poses[..., 2], axis=-1)
        ends = np.cumsum(self.inner.fractions)
        spline = CubicSpline(ends - self.inner.fractions / 2, poses, axis=-2)
        poses = spline((np.arange(self.count) + 0.5) / self.count)
        if self._joined:
            link = np.exp(1j * poses[..., 2]) / self.count
            centre = np.cumsum(link, -1) - link / 2
            poses[..., 0] = centre.real
            poses[..., 1] = centre.imag
        return poses
