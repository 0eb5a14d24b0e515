"""The local connection A(alpha): the linear map from joint rates to body velocity that fits best (paper Sec. III D).

A velocity is any function (alpha (..., d), alphadot (..., d)) -> xi (..., 3): a force balance, a closed form, a
table from an experiment. It should be odd and homogeneous in alphadot, so that half the directions tell all.
"""

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
from geomech.geometry.field import UNKNOWN_UNIT, Field, as_axes, half_grid
from geomech.geometry.images import Image, images, to_solve
from geomech.geometry.traits import NOTHING, Traits
from geomech.geometry.velocity import Reporting, Velocity, checked_velocity, evaluate
from rft.core.checks import in_range, is_whole, real_array, unmasked
from rft.core.refusal import Refusal

EVEN_DIRECTIONS, EVEN_SHAPES = 4, 16  # a joint, and in all, at which `even_part` looks
EVEN = 1e-6  # of the largest velocity: a solver's rounding is below it
SAMPLES_TOGETHER = 25_000  # velocities asked for in one call: enough to fill the solver, few enough to share out


@dataclass(frozen=True, eq=False)
class Connection:
    """A connection on a grid: xi = + A alphadot, in the velocity's frame. A: (3, d, N_1, ..., N_d). residual: (3, N_1,
    ..., N_d), rms over the fitted directions of xi - A alphadot for |alphadot| = 1; speed: (3, N_1, ..., N_d), rms of
    xi itself. degree: of the interpolating spline. All are nan at grid points that are singular, or have a neighbour
    beyond singular shapes. direction_error: (3, d, N_1, ..., N_d), estimated error of A from the finite number of
    directions; None where it is not known. unit: of lengths, "BL" (body lengths) or "m". length: of the body in that
    unit; None where it is unknown.

    Examples
    --------
    >>> from geomech.geometry import connection
    >>> from geomech.scenes import load
    >>> A = connection.fit(load("three-link-viscous").system.velocity, connection.grid(2, 7))
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

    def __repr__(self) -> str:
        singular = summary.masked(self.A.reshape(-1, *self.A.shape[2:]))
        size = f"A {summary.spans(self.A)}; {summary.fit_residual(self.residual, self.speed)}{summary.lengths(**self.size)}"
        return f"Connection({summary.grid(self.axes)}{singular}; {size})"

    def _repr_html_(self) -> str:
        return implementation("Connection._repr_html_")(self)

    def to_xarray(self, *, shapes: Sequence[str] = ()) -> Any:
        """Return a Dataset of A, its fit residual and the rms of xi, as in the file of `geomech connection`.

        shapes: names of the shape variables, where these are no joint angles. ImportError without the package xarray."""
        return implementation("Connection.to_xarray")(self, shapes)

    @staticmethod
    def load(path: str | PathLike[str], sign: str = "", order: str = "") -> Connection:
        """Return the connection in a file that `geomech connection` wrote, .nc or .mat, or that sysplotter wrote
        (`geomech.io.tables`).

        Refusal, one line, for any other. The residual is nan where the file has none."""
        return implementation("Connection.load")(path, sign, order)

    @property
    def size(self) -> dict:
        """Unit of lengths and length of the body, as arguments of another connection or of a field."""
        return {"unit": self.unit, "length": self.length}

    @cached_property
    def field(self) -> Field:
        return Field(self.axes, self.A, self.degree, **self.size)

    def __call__(self, alpha) -> np.ndarray:
        """Return A (..., 3, d) at shapes alpha (..., d); ValueError outside the grid."""
        return self.field(alpha)

    def velocity(self, alpha: ArrayLike, alphadot: ArrayLike) -> np.ndarray:
        """Return xi = A(alpha) alphadot, (..., 3)."""
        return np.einsum(
            "...ij,...j->...i", self(alpha), real_array("alphadot", alphadot)
        )

    def half(self, first: int) -> Connection:
        """Return the connection on every second point of each axis from ``first``, and on both ends
        (`field.half_grid`)."""
        axes, arrays, degree = half_grid(
            self.axes, (self.A, self.residual, self.speed), self.degree, first
        )
        return Connection(axes, *arrays, degree, **self.size)


def grid(joints: int, points: int = 31, extent: float = 2.5) -> tuple[np.ndarray, ...]:
    """Return ``joints`` equal axes of ``points`` angles from -extent to extent (rad).

    Examples
    --------
    >>> from geomech.geometry.connection import grid
    >>> [axis.tolist() for axis in grid(2, 5, 1.0)]
    [[-1.0, -0.5, 0.0, 0.5, 1.0], [-1.0, -0.5, 0.0, 0.5, 1.0]]
    """
    in_range("joints", joints, 1, 10_000, whole=True)
    in_range("grid", points, 4, 1e6, whole=True)
    in_range("extent", extent, 1e-9, 1e6)
    axis = np.linspace(-extent, extent, int(points))
    return ((axis - axis[::-1]) / 2,) * int(
        joints
    )  # symmetric to the last digit, for `fit`'s mirror


def check_fit_options(degree: object, progress: object) -> None:
    """Raise Refusal for no degree of a spline, or for progress that is no function of the fraction done."""
    in_range("degree", degree, 1, 5, whole=True)
    if not (progress is None or callable(progress)):
        raise Refusal(
            "progress must be a function of the fraction done", value=progress
        )


def directions(joints: int, count: int) -> np.ndarray:
    """Return unit alphadot (count, joints), spread evenly over half of all directions: exactly for two joints, by a
    low-discrepancy sequence for more.

    Examples
    --------
    >>> from geomech.geometry.connection import directions
    >>> directions(2, 4).round(3)
    array([[ 1.   ,  0.   ],
           [ 0.707,  0.707],
           [ 0.   ,  1.   ],
           [-0.707,  0.707]])
    """
    in_range("joints", joints, 1, 10_000, whole=True)
    least = (
        joints if joints <= 2 else 4 * joints
    )  # a scattered set of fewer may nearly miss a direction
    if not (is_whole(count) and count >= least):
        raise Refusal(
            f"directions must be a whole number of at least {least} for {joints} joints",
            value=count,
        )
    if joints == 1:
        return np.ones((1, 1))
    if joints == 2:
        angle = np.pi * np.arange(count) / count
        return np.stack([np.cos(angle), np.sin(angle)], -1)
    from scipy.special import ndtri

    normal = ndtri(
        np.stack([_van_der_corput(count, base) for base in _primes(joints)], -1)
    )
    return normal / np.linalg.norm(normal, axis=-1, keepdims=True)


def _van_der_corput(count: int, base: int) -> np.ndarray:
    """Return 1, 2 ... ``count`` with their digits in a base mirrored at the point; for prime numbers the sequence of Halton,
    that of scipy.stats, which takes half a second to load."""
    mirrored, remaining, unit = np.zeros(count), np.arange(1, count + 1), 1.0 / base
    while remaining.any():
        mirrored += remaining % base * unit
        remaining, unit = remaining // base, unit / base
    return mirrored


def _primes(count: int) -> list[int]:
    """Return the first prime numbers."""
    primes: list[int] = []
    number = 2
    while len(primes) < count:
        if all(
            number % prime
            for prime in itertools.takewhile(lambda prime: prime**2 <= number, primes)
        ):
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
    """Return what `sampled_at` returns at every shape of a grid; arrays are (..., N_1, ..., N_d).

    Examples
    --------
    >>> from geomech.geometry.connection import directions, grid, least_squares, sampled
    >>> from geomech.scenes import load
    >>> unit = directions(2, 8)
    >>> A, residual, speed = sampled(load("three-link-viscous").system.velocity, grid(2, 5), unit, least_squares(unit))
    >>> A.shape, residual.shape
    ((3, 2, 5, 5), (3, 5, 5))
    """
    for a in axes:
        if a.ndim != 1 or len(a) <= degree or not (np.diff(a) > 0).all():
            raise Refusal(
                f"each axis must be more than {degree} ascending angles, got {a}"
            )
    alpha = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
    symmetries = images(axes, unit, traits)
    return sampled_on(
        velocity, alpha, unit, reduce, progress, symmetries, traits.singularity, map
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
) -> list[np.ndarray]:
    """Return what `sampled_at` returns on a mesh of shapes alpha (N_1, ..., d); arrays are (..., N_1, ...), nan where
    shapes are singular.

    Examples
    --------
    >>> import numpy as np
    >>> from geomech.geometry.connection import directions, least_squares, sampled_on
    >>> from geomech.scenes import load
    >>> unit, alpha = directions(2, 8), np.zeros((3, 4, 2))
    >>> A, residual, speed = sampled_on(load("three-link-viscous").system.velocity, alpha, unit, least_squares(unit))
    >>> A.shape, residual.shape
    ((3, 2, 3, 4), (3, 3, 4))
    """
    flat, shape = alpha.reshape(-1, alpha.shape[-1]), alpha.shape[:-1]
    fields = sampled_at(
        velocity, flat, unit, reduce, progress, symmetries, singularity is not None, map
    )
    fields = [x.reshape(*x.shape[:-1], *shape) for x in fields]
    if singularity is not None:
        mask = sign_changes(singularity(alpha))
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
    """Return reductions (..., S) of the velocity at shapes alpha (S, d), for the directions ``unit`` (C, d) of
    alphadot.

    ``reduce`` takes xi (s, C, 3) at some shapes and returns arrays (..., s). symmetries: images of shapes among
    themselves, of which one is solved. masked: xi may be nan. map: as the builtin, over batches of shapes.

    Examples
    --------
    >>> import numpy as np
    >>> from geomech.geometry.connection import directions, least_squares, sampled_at
    >>> from geomech.scenes import load
    >>> unit = directions(2, 8)
    >>> velocity = load("three-link-viscous").system.velocity
    >>> A, residual, speed = sampled_at(velocity, np.zeros((1, 2)), unit, least_squares(unit))
    >>> A.shape, residual.shape
    ((3, 2, 1), (3, 1))
    """
    solved = to_solve(symmetries, len(alpha))
    to_compute = np.flatnonzero(solved)
    step = max(1, SAMPLES_TOGETHER // len(unit))
    fields: list[np.ndarray] = []
    batches = [to_compute[k : k + step] for k in range(0, len(to_compute), step)]
    done, results = (
        0,
        map(
            partial(_velocities, (velocity, unit, masked)),
            [alpha[x, None] for x in batches],
        ),
    )
    for indices, (xi, *extra) in zip(batches, results):
        if extra:
            velocity.receive(*extra)
        places, velocities = [indices], [xi]
        for image in symmetries:
            distinct = ~solved[image.index[indices]]
            places.append(image.index[indices[distinct]])
            velocities.append(image.velocities(xi[distinct]))
        # Reduced batch by batch: all velocities of 2,000,000 shapes and 1,000 directions would take 48 GB.
        reduced = reduce(np.concatenate(velocities))
        fields = fields or [np.empty((*x.shape[:-1], len(alpha))) for x in reduced]
        for field, x in zip(fields, reduced):
            field[..., np.concatenate(places)] = x
        done += len(indices)
        if progress:
            progress(done / len(to_compute))
    return fields


def _velocities(shared: tuple, alpha: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return (xi, and the report of a `Reporting` velocity) at some shapes. shared: (velocity, unit, whether xi may be
    nan)."""
    velocity, unit, masked = shared
    if not isinstance(velocity, Reporting):
        return (evaluate(velocity, alpha, unit, masked),)
    xi, extra = velocity.with_report(alpha, unit)
    return evaluate(lambda *arguments: xi, alpha, unit, masked), extra


def even_part(
    velocity: Velocity,
    axes: Sequence[ArrayLike],
    traits: Traits = NOTHING,
    map: Map = each,
) -> np.ndarray | None:
    """Return the rms (3, N_1, ..., N_d) over directions of xi(alpha, alphadot) + xi(alpha, -alphadot), |alphadot| = 1.
    A fit from half of the directions takes it for 0. None where it is roundoff at a few shapes that stand for all.

    Examples
    --------
    >>> from geomech.geometry.connection import even_part, grid
    >>> from geomech.systems import DifferentialDrive
    >>> even_part(DifferentialDrive().velocity, grid(2, 5)) is None  # it changes sign with alphadot
    True
    """
    axes = tuple(unmasked("axes", a) for a in axes)
    unit = directions(len(axes), EVEN_DIRECTIONS * len(axes))
    rng = np.random.default_rng(0)
    shapes = np.stack([rng.uniform(a[0], a[-1], (EVEN_SHAPES, 1)) for a in axes], -1)
    forwards, backwards = (
        evaluate(velocity, shapes, sign * unit, masked=traits.singularity is not None)
        for sign in (1.0, -1.0)
    )
    if np.nanmax(np.abs(forwards + backwards)) <= EVEN * np.nanmax(np.abs(forwards)):
        return None
    sum_of_directions = lambda alpha, alphadot: (
        velocity(alpha, alphadot) + velocity(alpha, -alphadot)
    )
    singular = Traits(singularity=traits.singularity)  # what is even has no images
    return sampled(
        sum_of_directions,
        axes,
        unit,
        lambda xi: (np.sqrt((xi**2).mean(1)).T,),
        1,
        traits=singular,
        map=map,
    )[0]


def sign_changes(d: np.ndarray) -> np.ndarray:
    """Return a mask (N_1, ..., N_d) of the grid points at which d is 0 or of another sign than at a neighbour along an
    axis.

    Examples
    --------
    >>> import numpy as np
    >>> from geomech.geometry.connection import sign_changes
    >>> sign_changes(np.array([2.0, 1.0, -1.0, -2.0]))
    array([False,  True,  True, False])
    """
    mask = d == 0
    for axis in range(d.ndim):
        low, high = (
            np.moveaxis(mask, axis, 0)[part]
            for part in (slice(None, -1), slice(1, None))
        )
        ordered = np.moveaxis(d, axis, 0)
        changes = ordered[:-1] * ordered[1:] < 0
        low |= changes
        high |= changes
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
    """Fit A by least squares on the grid spanned by ``axes``, from ``count`` uniform directions of alphadot at each
    shape.

    progress: called with the fraction done. traits: what the velocity claims. Where left and right are alike (``halved``)
    half of a symmetric grid gives the other half; ``reversible`` halves it again where the directions allow
    (`geomech.geometry.images`); where ``singularity`` passes through 0 the connection is nan. Raises what ``velocity``
    raises.

    A velocity that takes one shape at a time is asked for each in turn, and what it returns is broadcast. It is tried at a
    few shapes: `VelocityWarning` if it is not odd or not homogeneous in alphadot, or ignores alpha. trusted: it is not tried.
    unit, length: of lengths in the velocity, and of the body, as `Connection` keeps them. map: as the builtin, of tasks that
    each have many shapes; that of a request, where one is under way, shares and stores them.

    Examples
    --------
    >>> from geomech.geometry import connection
    >>> from geomech.systems import Swimmer
    >>> from rft import Chain, Viscous
    >>> swimmer = Swimmer(Viscous(), Chain())
    >>> A = connection.fit(swimmer.velocity, connection.grid(2, 15))
    >>> A.velocity([0.5, 0.3], [1.0, 0.0]).round(4)
    array([-0.0014, -0.0035, -0.0817])
    """
    axes = as_axes(axes)
    check_fit_options(degree, progress)
    rates = directions(len(axes), count)
    if callable(velocity) and not trusted and all(a.ndim == 1 and a.size for a in axes):
        velocity = checked_velocity(velocity, axes, traits.singularity is not None)
    reduce = _with_direction_error(rates)
    *fields, error = sampled(
        velocity, axes, rates, reduce, degree, progress, traits, map
    )
    return Connection(
        axes, *fields, degree, unit=unit, length=length, direction_error=error
    )


def connection_function(
    velocity: Velocity,
    joints: int,
    count: int,
    degree_one: bool = False,
    map: Map = each,
) -> Callable:
    """Return the least-squares A (..., 3, d) as a function of shapes (..., d), solved at every call from ``count``
    directions; from d where the velocity is linear in alphadot (``degree_one``).

    Examples
    --------
    >>> from geomech.geometry.connection import connection_function
    >>> from geomech.systems import DifferentialDrive
    >>> A = connection_function(DifferentialDrive().velocity, joints=2, count=2, degree_one=True)
    >>> A([0.3, 0.1]).round(3)
    array([[ 0.25,  0.25],
           [ 0.  ,  0.  ],
           [-0.5 ,  0.5 ]])
    """
    unit = np.eye(joints) if degree_one else directions(joints, count)
    reduce = least_squares(unit)

    def A(alpha):
        alpha = real_array("alpha", alpha)
        values = sampled_at(
            velocity,
            alpha.reshape(-1, joints),
            unit,
            lambda xi: reduce(xi)[:1],
            map=map,
        )[0]
        return np.moveaxis(values, -1, 0).reshape(*alpha.shape[:-1], 3, joints)

    return A


def _with_direction_error(unit: np.ndarray) -> Callable:
    """Return the ``reduce`` of `least_squares` with the error of A (3, d, s) from the finite number of directions.

    Half of the directions change A by more than the others leave: three times, of two joints, whose directions are
    equally spaced, by theory for kinks; here half of that change is taken, of more joints all of it. The error is nan
    where there are too few directions for half of them to determine A."""
    reduce, joints = least_squares(unit), unit.shape[1]
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
    """Return a ``reduce`` of `sampled_at`: the A (3, d, s) that fits best, and the rms (3, s) of its residual and of
    xi.

    Examples
    --------
    >>> import numpy as np
    >>> from geomech.geometry.connection import directions, least_squares
    >>> unit = directions(2, 8)
    >>> A, residual, speed = least_squares(unit)((unit @ np.array([[1.0, 0.0, 2.0], [0.0, 3.0, 0.0]]))[None])
    >>> round(float(A[1, 1, 0]), 6)  # of xi_y = 3 alphadot_2
    3.0
    """
    inverse = np.linalg.pinv(unit)

    def reduce(xi):
        A = np.einsum("jc,sci->ijs", inverse, xi)
        residual = np.sqrt(((xi - np.einsum("ijs,cj->sci", A, unit)) ** 2).mean(1)).T
        return A, residual, np.sqrt((xi**2).mean(1)).T

    return reduce
