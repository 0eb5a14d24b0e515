"""A plane of shape space: two joints move, the others are fixed.

The CCF of the two is a component of the two-form there, for bodies with any number of
joints. It takes no field of all joints, as its derivatives are along the plane."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import NoReturn

import numpy as np

from geomech.core.work import Map, each
from geomech.mathematics.geometry.connection import (
    Connection,
    Velocity,
    as_axes,
    directions,
    least_squares,
    sampled_on,
)
from geomech.mathematics.geometry.curvature import ccf, error
from geomech.mathematics.geometry.gait import Gait
from geomech.mathematics.geometry.periods import Periods, checked_periods, period_of
from geomech.mathematics.geometry.representations.field import UNKNOWN_UNIT, Field
from geomech.mathematics.geometry.representations.images import plane_images
from geomech.mathematics.geometry.representations.tube import Tube
from geomech.mathematics.geometry.traits import NOTHING, Traits
from rft.core.checks import is_whole, real_array
from rft.core.refusal import Refusal, formatted

IN_PLANE = 1e-9  # rad: largest motion of the fixed joints of a gait in the plane


@dataclass(frozen=True, eq=False)
class Plane:
    """A plane of shape space.

    pair: the joints that move, counted from 1, the first on the first axis. at: (d,),
    a shape that it goes through, rad. connection: of these two joints, columns of the
    least-squares A of all d."""

    pair: tuple[int, int]
    at: tuple[float, ...]
    connection: Connection

    @cached_property
    def ccf(self) -> Field:
        """CCF_ij, values (3, N, N)."""
        return ccf(self.connection)

    @cached_property
    def error(self) -> Field:
        """Estimated error of `ccf` (`curvature.error`), values (3, N, N)."""
        return error(self.connection)

    @property
    def fixed(self) -> list[int]:
        """The joints that do not move, counted from 1."""
        return [k for k in range(1, len(self.at) + 1) if k not in self.pair]


@dataclass(frozen=True, eq=False)
class ProjectedGait:
    """A gait of many joints projected on a plane, along the joints that are fixed
    there."""

    gait: Gait
    plane: Plane

    def shape(self, t, amplitudes=None) -> np.ndarray:
        """Return shapes (..., 2) on the plane, as `Gait.shape`."""
        return self.gait.shape(t, amplitudes)[..., indices(self.plane.pair)]

    @property
    def lies_in_plane(self) -> bool:
        """Whether the gait moves on the plane itself."""
        fixed = indices(self.plane.fixed)
        shapes = self.gait.shape(np.linspace(0.0, 2 * np.pi, 64))
        distance = shapes[..., fixed] - np.array(self.plane.at)[fixed]
        return bool(np.abs(distance).max(initial=0.0) <= IN_PLANE)


def indices(joints: Sequence[int]) -> list[int]:
    """Return the places in an array of joints counted from 1."""
    return [k - 1 for k in joints]


def checked_pair(pair: Sequence[int], joints: int) -> tuple[int, int]:
    """Return pair as two different joints, counted from 1; Refusal for any other."""
    are_joints = all(is_whole(k) and 1 <= k <= joints for k in pair)
    if len(pair) != 2 or not are_joints or pair[0] == pair[1]:
        numbers = ", ".join(map(formatted, pair))
        raise Refusal(f"a pair must be two of the joints 1 to {joints}, got {numbers}")
    return int(pair[0]), int(pair[1])


def pair_periods(periods: Periods, pair: tuple[int, int]) -> Periods:
    """Return the periods of two joints, counted from 1; () where neither has one."""
    return checked_periods(tuple(period_of(periods, k) for k in indices(pair)), 2)


def plane_shapes(axes, pair: tuple[int, int], at: np.ndarray) -> np.ndarray:
    """Return the shapes (N_i, N_j, d) of the plane of two joints, ``axes`` of each,
    through the shape ``at`` (d,)."""
    alpha = np.broadcast_to(at, (len(axes[0]), len(axes[1]), len(at))).copy()
    alpha[..., indices(pair)] = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
    return alpha


def plane(
    velocity: Velocity,
    axes,
    pair: tuple[int, int],
    at,
    count: int,
    degree: int = 3,
    progress: Callable | None = None,
    *,
    traits: Traits = NOTHING,
    unit: str = UNKNOWN_UNIT,
    length: float | None = None,
    map: Map = each,
) -> Plane:
    """Return the plane of two joints, counted from 1, ``axes`` of each, through the
    shape ``at`` (d,).

    Other arguments are those of `connection.fit`. A is the same: fitted over all
    directions of alphadot, not only those of the two joints."""
    at = real_array("at", at)
    axes = as_axes(axes)
    if at.ndim != 1 or not np.isfinite(at).all():
        raise Refusal("at must be one finite shape", value=at.tolist())
    pair = checked_pair(pair, len(at))
    alpha = plane_shapes(axes, pair, at)
    rates = directions(len(at), count)
    periods = pair_periods(traits.periods, pair)
    symmetries = plane_images(alpha, count, traits, pair)
    A, residual, speed = sampled_on(
        velocity,
        alpha,
        rates,
        least_squares(rates),
        progress,
        symmetries,
        traits.singularity,
        map,
        periods,
    )
    fitted = Connection(
        axes,
        A[:, indices(pair)],
        residual,
        speed,
        degree,
        unit=unit,
        length=length,
        periods=periods,
    )
    return Plane(pair, tuple(at.tolist()), fitted)


def interpolated_plane(fitted: Connection, pair: tuple[int, int], at) -> Plane:
    """Return the plane in a field of all joints, on its axes, interpolated between its
    points; near a measured gait nan where the data do not reach.

    Refusal off the field, or for a plane that the data do not reach at all."""
    at = fitted.field.inside(real_array("at", at))
    pair = checked_pair(pair, len(fitted.axes))
    axes = tuple(fitted.axes[k] for k in indices(pair))
    alpha = plane_shapes(axes, pair, at)
    if isinstance(fitted, Tube):
        A = fitted.taylor.connection_within_reach(alpha)
        if np.isnan(A).all():
            _refuse_unreached(fitted, pair, at)
    else:
        A = fitted(alpha)
    A = np.moveaxis(A, (-2, -1), (0, 1))[:, indices(pair)]

    # Files of other programs do not have the residual of their fit.
    residual = np.full((3, *alpha.shape[:-1]), np.nan)
    speed = residual
    if np.isfinite(fitted.residual).all():
        linear = partial(Field, fitted.axes, degree=1, periods=fitted.periods)
        residual = np.moveaxis(linear(fitted.residual)(alpha), -1, 0)
        speed = np.moveaxis(linear(fitted.speed)(alpha), -1, 0)
    periods = pair_periods(fitted.periods, pair)
    connection = Connection(
        axes, A, residual, speed, fitted.degree, **fitted.size, periods=periods
    )
    return Plane(pair, tuple(at.tolist()), connection)


def _refuse_unreached(tube: Tube, pair: tuple[int, int], at: np.ndarray) -> NoReturn:
    """Refuse a plane that the data of a measured gait do not reach."""
    fixed = [f"alpha_{k} = {x:.3g}" for k, x in enumerate(at, 1) if k not in pair]
    start = ",".join(f"{x:.3f}" for x in tube.taylor.loop.shape(np.array(0.0)))
    raise Refusal(
        f"the data do not reach the plane of {', '.join(fixed)}",
        instead=f"slice it at a shape of the mean gait, ``at`` {start}",
    )
