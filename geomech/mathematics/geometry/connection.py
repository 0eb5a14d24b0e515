"""The local connection A(alpha): the linear map from joint rates to body velocity.

It is the map that fits best (paper Sec. III D). A velocity is any function (alpha (...,
d), alphadot (..., d)) -> xi (..., 3): a force balance, a closed form, a table from an
experiment. It should be odd and homogeneous in alphadot, so that half of the directions
are enough."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import KW_ONLY, dataclass
from functools import cached_property, partial
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from geomech.core import summary
from geomech.core.face import implementation
from geomech.core.work import Map, each
from geomech.mathematics.geometry.periods import (
    Periods,
    check_axes,
    checked_periods,
    period_axis,
    periodic_axes,
)
from geomech.mathematics.geometry.representations.field import (
    UNKNOWN_UNIT,
    Field,
    as_axes,
    half_grid,
)
from geomech.mathematics.geometry.representations.images import Image, images, to_solve
from geomech.mathematics.geometry.traits import NOTHING, Traits
from geomech.mathematics.geometry.velocity import (
    Reporting,
    Velocity,
    checked_velocity,
    evaluate,
)
from rft.core.checks import in_range, is_whole, real_array, unmasked
from rft.core.refusal import Refusal

EVEN_DIRECTIONS = 4  # per joint, at which `even_part` looks first
EVEN_SHAPES = 16  # in all, likewise
EVEN = 1e-6  # of the largest velocity: a solver's rounding is below it
# Velocities computed in one call: enough to fill the solver, few enough to share out.
SAMPLES_TOGETHER = 25_000


@dataclass(frozen=True, eq=False)
class Connection:
    """A connection on a grid: xi = + A alphadot, in the velocity's frame.

    A: (3, d, N_1, ..., N_d). residual: (3, N_1, ..., N_d), rms over the fitted
    directions of xi - A alphadot for |alphadot| = 1; speed: (3, N_1, ..., N_d), rms of
    xi itself. degree: of the interpolating spline. All are nan at grid points that are
    singular, or have a neighbour beyond singular shapes. direction_error: (3, d, N_1,
    ..., N_d), estimated error of A from the finite number of directions; None where it
    is not known. unit: of lengths, "BL" (body lengths) or "m". length: of the body in
    that unit; None where it is unknown. periods: of the shape variables, as in
    `geomech.mathematics.geometry.representations.field.Field`.

    Examples
    --------
    >>> from geomech.mathematics.geometry import connection
    >>> from geomech.scenes import load
    >>> velocity = load("three-link-viscous").system.velocity
    >>> A = connection.fit(velocity, connection.grid(2, 7))
    >>> A([0.5, 0.3]).round(3)  # at a shape, (3, joints)
    array([[-0.017,  0.002],
           [-0.054, -0.054],
           [ 0.252, -0.262]])
    """

    axes: tuple[np.ndarray, ...]
    A: np.ndarray
    residual: np.ndarray
    speed: np.ndarray
    degree: int = 3
    _: KW_ONLY
    unit: str = UNKNOWN_UNIT
    length: float | None = None
    direction_error: np.ndarray | None = None
    periods: Periods = ()

    def __post_init__(self):
        periods = checked_periods(self.periods, len(self.axes))
        object.__setattr__(self, "periods", periods)

    def __repr__(self) -> str:
        grid = summary.grid(self.axes)
        singular = summary.masked(self.A.reshape(-1, *self.A.shape[2:]))
        residual = summary.fit_residual(self.residual, self.speed)
        lengths = summary.lengths(**self.size)
        return (
            f"Connection({grid}{singular};"
            f" A {summary.spans(self.A)}; {residual}{lengths})"
        )

    def _repr_html_(self) -> str:
        return implementation("Connection._repr_html_")(self)

    def to_xarray(self, *, shapes: Sequence[str] = ()) -> Any:
        """Return a Dataset of A, its fit residual and the rms of xi, as in the file of
        `geomech connection`.

        shapes: names of the shape variables, where these are no joint angles.
        ImportError without the package xarray."""
        return implementation("Connection.to_xarray")(self, shapes)

    @staticmethod
    def load(path: str | PathLike[str], sign: str = "", order: str = "") -> Connection:
        """Return the connection in a file that `geomech connection` wrote, .nc or .mat,
        or that sysplotter wrote (`geomech.io.tables`).

        Refusal, one line, for any other. The residual is nan where the file has
        none."""
        return implementation("Connection.load")(path, sign, order)

    @property
    def size(self) -> dict:
        """Unit of lengths and length of the body, as arguments of another connection or
        of a field."""
        return {"unit": self.unit, "length": self.length}

    @cached_property
    def field(self) -> Field:
        """A as a field."""
        return Field(self.axes, self.A, self.degree, **self.size, periods=self.periods)

    def __call__(self, alpha) -> np.ndarray:
        """Return A (..., 3, d) at shapes alpha (..., d); ValueError outside the
        grid."""
        return self.field(alpha)

    def velocity(self, alpha: ArrayLike, alphadot: ArrayLike) -> np.ndarray:
        """Return xi = A(alpha) alphadot, (..., 3)."""
        alphadot = real_array("alphadot", alphadot)
        return np.einsum("...ij,...j->...i", self(alpha), alphadot)

    def half(self, first: int) -> Connection:
        """Return the connection on every second point of each axis from ``first``, and
        on both ends (`field.half_grid`)."""
        arrays = (self.A, self.residual, self.speed)
        axes, arrays, degree = half_grid(self.axes, arrays, self.degree, first)
        return Connection(axes, *arrays, degree, **self.size, periods=self.periods)


def grid(
    joints: int, points: int = 31, extent: float = 2.5, periods: Periods = ()
) -> tuple[np.ndarray, ...]:
    """Return ``joints`` equal axes of ``points`` angles from -extent to extent (rad).

    The axis of a variable with a period covers that period, from 0, whatever the
    extent. periods: of each variable, None for one without, or () for none.

    Examples
    --------
    >>> from geomech.mathematics.geometry.connection import grid
    >>> [axis.tolist() for axis in grid(2, 5, 1.0)]
    [[-1.0, -0.5, 0.0, 0.5, 1.0], [-1.0, -0.5, 0.0, 0.5, 1.0]]
    """
    in_range("joints", joints, 1, 10_000, whole=True)
    in_range("grid", points, 4, 1e6, whole=True)
    in_range("extent", extent, 1e-9, 1e6)
    axis = np.linspace(-extent, extent, int(points))
    # Symmetric to the last digit, so that `fit` finds the mirror images.
    axis = (axis - axis[::-1]) / 2
    periods = checked_periods(periods, int(joints))
    axes = [axis] * int(joints)
    for k in periodic_axes(periods):
        axes[k] = period_axis(periods[k], points)
    return tuple(axes)


def check_fit_options(degree: object, progress: object) -> None:
    """Refuse a degree that no spline has, or a progress that is not a function of the
    fraction done."""
    in_range("degree", degree, 1, 5, whole=True)
    if progress is not None and not callable(progress):
        raise Refusal(
            "progress must be a function of the completed fraction", value=progress
        )


def directions(joints: int, count: int) -> np.ndarray:
    """Return unit alphadot (count, joints), spread evenly over half of all directions:
    exactly for two joints, by a low-discrepancy sequence for more.

    Examples
    --------
    >>> from geomech.mathematics.geometry.connection import directions
    >>> directions(2, 4).round(3)
    array([[ 1.   ,  0.   ],
           [ 0.707,  0.707],
           [ 0.   ,  1.   ],
           [-0.707,  0.707]])
    """
    in_range("joints", joints, 1, 10_000, whole=True)
    # A scattered set of fewer may nearly miss a direction.
    least = joints if joints <= 2 else 4 * joints
    if not (is_whole(count) and count >= least):
        raise Refusal(
            f"directions must be a whole number of at least {least}"
            f" for {joints} joints",
            value=count,
        )
    if joints == 1:
        return np.ones((1, 1))
    if joints == 2:
        angle = np.pi * np.arange(count) / count
        return np.stack([np.cos(angle), np.sin(angle)], -1)
    from scipy.special import ndtri

    uniform = [_van_der_corput(count, base) for base in _primes(joints)]
    normal = ndtri(np.stack(uniform, -1))
    return normal / np.linalg.norm(normal, axis=-1, keepdims=True)


def _van_der_corput(count: int, base: int) -> np.ndarray:
    """Return 1, 2 ... ``count`` with their digits in a base mirrored at the point.

    For prime bases these are Halton's sequences."""
    # scipy.stats has them as well, but takes half a second to load.
    mirrored = np.zeros(count)
    remaining = np.arange(1, count + 1)
    unit = 1.0 / base
    while remaining.any():
        mirrored += remaining % base * unit
        remaining = remaining // base
        unit = unit / base
    return mirrored


def _primes(count: int) -> list[int]:
    """Return the first prime numbers."""
    primes: list[int] = []
    number = 2
    while len(primes) < count:
        divisors = itertools.takewhile(lambda prime: prime**2 <= number, primes)
        if all(number % prime for prime in divisors):
            primes.append(number)
        number += 1
    return primes


def sampled(
    velocity: Velocity,
    axes: Sequence[ArrayLike],
    unit: ArrayLike,
    reduce: Callable,
    degree: int = 3,
    progress: Callable | None = None,
    traits: Traits = NOTHING,
    map: Map = each,
) -> list[np.ndarray]:
    """Return what `sampled_at` returns at every shape of a grid; arrays are (..., N_1,
    ..., N_d).

    Examples
    --------
    >>> from geomech.mathematics.geometry.connection import (
    ...     directions,
    ...     grid,
    ...     least_squares,
    ...     sampled,
    ... )
    >>> from geomech.scenes import load
    >>> velocity = load("three-link-viscous").system.velocity
    >>> unit = directions(2, 8)
    >>> A, residual, speed = sampled(velocity, grid(2, 5), unit, least_squares(unit))
    >>> A.shape, residual.shape
    ((3, 2, 5, 5), (3, 5, 5))
    """
    for a in axes:
        if a.ndim != 1 or len(a) <= degree or not (np.diff(a) > 0).all():
            raise Refusal(
                f"each axis must be more than {degree} ascending angles, got {a}"
            )
    check_axes(axes, checked_periods(traits.periods, len(axes)))
    alpha = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
    symmetries = images(axes, unit, traits)
    return sampled_on(
        velocity,
        alpha,
        unit,
        reduce,
        progress,
        symmetries,
        traits.singularity,
        map,
        traits.periods,
    )


def sampled_on(
    velocity: Velocity,
    alpha: ArrayLike,
    unit: ArrayLike,
    reduce: Callable,
    progress: Callable | None = None,
    symmetries: Sequence[Image] = (),
    singularity: Callable | None = None,
    map: Map = each,
    periods: Periods = (),
) -> list[np.ndarray]:
    """Return what `sampled_at` returns on a mesh of shapes alpha (N_1, ..., d); arrays
    are (..., N_1, ...), nan where shapes are singular. periods: of the axes of the
    mesh.

    Examples
    --------
    >>> import numpy as np
    >>> from geomech.mathematics.geometry.connection import (
    ...     directions,
    ...     least_squares,
    ...     sampled_on,
    ... )
    >>> from geomech.scenes import load
    >>> velocity = load("three-link-viscous").system.velocity
    >>> unit, alpha = directions(2, 8), np.zeros((3, 4, 2))
    >>> A, residual, speed = sampled_on(velocity, alpha, unit, least_squares(unit))
    >>> A.shape, residual.shape
    ((3, 2, 3, 4), (3, 3, 4))
    """
    flat = alpha.reshape(-1, alpha.shape[-1])
    masked = singularity is not None
    fields = sampled_at(velocity, flat, unit, reduce, progress, symmetries, masked, map)
    fields = [x.reshape(*x.shape[:-1], *alpha.shape[:-1]) for x in fields]
    if singularity is not None:
        mask = sign_changes(singularity(alpha), periods)
        fields = [np.where(mask, np.nan, x) for x in fields]
    return fields


def sampled_at(
    velocity: Velocity,
    alpha: ArrayLike,
    unit: ArrayLike,
    reduce: Callable,
    progress: Callable | None = None,
    symmetries: Sequence[Image] = (),
    masked: bool = False,
    map: Map = each,
) -> list[np.ndarray]:
    """Return reductions (..., S) of the velocity at shapes alpha (S, d), for the
    directions ``unit`` (C, d) of alphadot.

    ``reduce`` takes xi (s, C, 3) at some shapes and returns arrays (..., s).
    symmetries: images of shapes among themselves, of which one is solved. masked: xi
    may be nan. map: as the builtin, over batches of shapes.

    Examples
    --------
    >>> import numpy as np
    >>> from geomech.mathematics.geometry.connection import (
    ...     directions,
    ...     least_squares,
    ...     sampled_at,
    ... )
    >>> from geomech.scenes import load
    >>> unit = directions(2, 8)
    >>> velocity = load("three-link-viscous").system.velocity
    >>> alpha = np.zeros((1, 2))
    >>> A, residual, speed = sampled_at(velocity, alpha, unit, least_squares(unit))
    >>> A.shape, residual.shape
    ((3, 2, 1), (3, 1))
    """
    solved = to_solve(symmetries, len(alpha))
    to_compute = np.flatnonzero(solved)
    step = max(1, SAMPLES_TOGETHER // len(unit))
    fields: list[np.ndarray] = []
    batches = [to_compute[k : k + step] for k in range(0, len(to_compute), step)]
    compute = partial(_velocities, (velocity, unit, masked))
    results = map(compute, [alpha[indices, None] for indices in batches])
    n_computed = 0
    for indices, (xi, *report) in zip(batches, results):
        if report:
            velocity.receive(*report)

        # The shapes solved, and those that follow from them by symmetry.
        places = [indices]
        velocities = [xi]
        for image in symmetries:
            distinct = ~solved[image.index[indices]]
            places.append(image.index[indices[distinct]])
            velocities.append(image.velocities(xi[distinct]))

        # Reduced batch by batch: all velocities of 2,000,000 shapes and 1,000
        # directions would take 48 GB.
        reduced = reduce(np.concatenate(velocities))
        if not fields:
            fields = [np.empty((*x.shape[:-1], len(alpha))) for x in reduced]
        for field, x in zip(fields, reduced):
            field[..., np.concatenate(places)] = x

        n_computed += len(indices)
        if progress:
            progress(n_computed / len(to_compute))
    return fields


def _velocities(shared: tuple, alpha: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return xi at shapes alpha, and the report of a `Reporting` velocity.

    shared: (velocity, unit, whether xi may be nan)."""
    velocity, unit, masked = shared
    if not isinstance(velocity, Reporting):
        return (evaluate(velocity, alpha, unit, masked),)
    xi, report = velocity.with_report(alpha, unit)
    return evaluate(lambda *arguments: xi, alpha, unit, masked), report


def even_part(
    velocity: Velocity,
    axes: Sequence[ArrayLike],
    traits: Traits = NOTHING,
    map: Map = each,
) -> np.ndarray | None:
    """Return the rms (3, N_1, ..., N_d) of xi(alpha, alphadot) + xi(alpha, -alphadot).

    It is taken over directions with |alphadot| = 1. A fit from half of the directions
    takes it for 0. None where it is roundoff at a few shapes that stand for all.

    Examples
    --------
    >>> from geomech.mathematics.geometry.connection import even_part, grid
    >>> from geomech.mathematics.systems import DifferentialDrive
    >>> velocity = DifferentialDrive().velocity  # changes sign with alphadot
    >>> even_part(velocity, grid(2, 5)) is None
    True
    """
    axes = tuple(unmasked("axes", a) for a in axes)
    unit = directions(len(axes), EVEN_DIRECTIONS * len(axes))
    rng = np.random.default_rng(0)
    shapes = np.stack([rng.uniform(a[0], a[-1], (EVEN_SHAPES, 1)) for a in axes], -1)
    masked = traits.singularity is not None
    forwards = evaluate(velocity, shapes, unit, masked=masked)
    backwards = evaluate(velocity, shapes, -unit, masked=masked)
    if np.nanmax(np.abs(forwards + backwards)) <= EVEN * np.nanmax(np.abs(forwards)):
        return None

    def both_senses(alpha, alphadot):
        return velocity(alpha, alphadot) + velocity(alpha, -alphadot)

    def rms(xi):
        return (np.sqrt((xi**2).mean(1)).T,)

    # The even part has none of the symmetries of the velocity.
    singular = Traits(singularity=traits.singularity, periods=traits.periods)
    (even,) = sampled(both_senses, axes, unit, rms, 1, traits=singular, map=map)
    return even


def sign_changes(d: np.ndarray, periods: Periods = ()) -> np.ndarray:
    """Return a mask (N_1, ..., N_d) of the grid points at which d is 0 or of another
    sign than at a neighbour along an axis. Both ends of an axis with a period are one
    point.

    Examples
    --------
    >>> import numpy as np
    >>> from geomech.mathematics.geometry.connection import sign_changes
    >>> sign_changes(np.array([2.0, 1.0, -1.0, -2.0]))
    array([False,  True,  True, False])
    """
    mask = d == 0
    for axis in range(d.ndim):
        ordered = np.moveaxis(d, axis, 0)
        changes = ordered[:-1] * ordered[1:] < 0
        along = np.moveaxis(mask, axis, 0)  # a view of the mask
        along[:-1] |= changes
        along[1:] |= changes
    for axis in periodic_axes(periods):
        along = np.moveaxis(mask, axis, 0)
        along[0] |= along[-1]
        along[-1] = along[0]
    return mask


def fit(
    velocity: Velocity,
    axes: Sequence[ArrayLike],
    count: int = 8,
    degree: int = 3,
    progress: Callable | None = None,
    *,
    traits: Traits = NOTHING,
    trusted: bool = False,
    unit: str = UNKNOWN_UNIT,
    length: float | None = None,
    map: Map = each,
) -> Connection:
    """Fit A by least squares on the grid spanned by ``axes``, from ``count`` uniform
    directions of alphadot at each shape.

    progress: called with the fraction done. traits: facts about the velocity. Where
    left and right are alike (``halved``) half of a symmetric grid gives the other half;
    ``reversible`` halves it again where the directions allow
    (`geomech.mathematics.geometry.representations.images`); where ``singularity``
    passes through 0 the connection is nan; the axis of a variable with one of
    ``periods`` covers that period (`grid`). Errors that ``velocity`` raises are passed
    on.

    A velocity that takes one shape at a time is called for each in turn, and its result
    is broadcast. It is tried at a few shapes: `VelocityWarning` if it is not odd or not
    homogeneous in alphadot, ignores alpha, or does not repeat after its periods.
    trusted: it is not tried. unit, length: of lengths in the velocity, and of the body,
    as in `Connection`. map: as the builtin, over batches of shapes.

    Examples
    --------
    >>> from geomech.mathematics.geometry import connection
    >>> from geomech.mathematics.systems import Swimmer
    >>> from rft import Chain, Viscous
    >>> swimmer = Swimmer(Viscous(), Chain())
    >>> A = connection.fit(swimmer.velocity, connection.grid(2, 15))
    >>> A.velocity([0.5, 0.3], [1.0, 0.0]).round(4)
    array([-0.0014, -0.0035, -0.0817])
    """
    axes = as_axes(axes)
    check_fit_options(degree, progress)
    rates = directions(len(axes), count)
    has_shapes = all(a.ndim == 1 and a.size for a in axes)
    if callable(velocity) and not trusted and has_shapes:
        masked = traits.singularity is not None
        velocity = checked_velocity(velocity, axes, masked, traits.periods)
    reduce = _with_direction_error(rates)
    *fields, error = sampled(
        velocity, axes, rates, reduce, degree, progress, traits, map
    )
    return Connection(
        axes,
        *fields,
        degree,
        unit=unit,
        length=length,
        direction_error=error,
        periods=traits.periods,
    )


def connection_function(
    velocity: Velocity,
    joints: int,
    count: int,
    degree_one: bool = False,
    map: Map = each,
) -> Callable:
    """Return the least-squares A (..., 3, d) as a function of shapes (..., d).

    It is solved at every call from ``count`` directions; from d directions where the
    velocity is linear in alphadot (``degree_one``).

    Examples
    --------
    >>> from geomech.mathematics.geometry.connection import connection_function
    >>> from geomech.mathematics.systems import DifferentialDrive
    >>> velocity = DifferentialDrive().velocity
    >>> A = connection_function(velocity, joints=2, count=2, degree_one=True)
    >>> A([0.3, 0.1]).round(3)
    array([[ 0.25,  0.25],
           [ 0.  ,  0.  ],
           [-0.5 ,  0.5 ]])
    """
    unit = np.eye(joints) if degree_one else directions(joints, count)
    reduce = least_squares(unit)

    def connection_alone(xi):
        A, *_ = reduce(xi)
        return (A,)

    def A(alpha):
        alpha = real_array("alpha", alpha)
        flat = alpha.reshape(-1, joints)
        (values,) = sampled_at(velocity, flat, unit, connection_alone, map=map)
        return np.moveaxis(values, -1, 0).reshape(*alpha.shape[:-1], 3, joints)

    return A


def _with_direction_error(unit: np.ndarray) -> Callable:
    """Return the ``reduce`` of `least_squares` with a fourth array, the error of A
    (3, d, s) from the finite number of directions.

    It is estimated from the change of A with half of the directions. For two joints,
    whose directions are equally spaced, that change is three times the error by theory
    for kinks: half of it is taken. For more joints all of it is taken. The error is nan
    where there are too few directions for half of them to determine A."""
    reduce = least_squares(unit)
    joints = unit.shape[1]
    half = unit[::2]
    inverse = np.linalg.pinv(half)
    share = 0.5 if joints == 2 else 1.0
    if joints == 1:
        share = 0.0  # one direction is all there is
    elif len(half) < 2 * joints:
        share = np.nan

    def with_error(xi):
        A, residual, speed = reduce(xi)
        fewer = np.einsum("jc,sci->ijs", inverse, xi[:, ::2])
        return A, residual, speed, share * np.abs(A - fewer)

    return with_error


def least_squares(unit: np.ndarray) -> Callable:
    """Return a ``reduce`` of `sampled_at`: it returns the A (3, d, s) that fits best,
    the rms (3, s) of its residual, and the rms (3, s) of xi.

    Examples
    --------
    >>> import numpy as np
    >>> from geomech.mathematics.geometry.connection import directions, least_squares
    >>> unit = directions(2, 8)
    >>> xi = unit @ np.array([[1.0, 0.0, 2.0], [0.0, 3.0, 0.0]])
    >>> A, residual, speed = least_squares(unit)(xi[None])
    >>> round(float(A[1, 1, 0]), 6)  # of xi_y = 3 alphadot_2
    3.0
    """
    inverse = np.linalg.pinv(unit)

    def reduce(xi):
        A = np.einsum("jc,sci->ijs", inverse, xi)
        fitted = np.einsum("ijs,cj->sci", A, unit)
        residual = np.sqrt(((xi - fitted) ** 2).mean(1)).T
        speed = np.sqrt((xi**2).mean(1)).T
        return A, residual, speed

    return reduce
