"""The local connection A(alpha): the linear map from joint rates to body velocity that fits best (paper Sec. III D).

A velocity is any function (alpha (..., d), alphadot (..., d)) -> xi (..., 3): a force balance, a closed form, a
table from an experiment. It should be odd and homogeneous in alphadot, so that half the directions tell all.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import KW_ONLY, dataclass
from functools import cached_property, partial

import numpy as np

from geomech.core import summary
from geomech.core.face import Faced
from geomech.core.work import Map, each
from geomech.geometry.field import UNTOLD, Field, as_axes, half_of
from geomech.geometry.images import Image, images, to_solve
from geomech.geometry.traits import NOTHING, Traits
from geomech.geometry.velocity import Telling, Velocity, evaluate, tried
from rft.checks import in_range, is_whole, real_array
from rft.refusal import Refusal

EVEN_DIRECTIONS, EVEN_SHAPES = 4, 16  # a joint, and in all, at which `even_part` looks
EVEN = 1e-6  # of the largest velocity: a solver's rounding is below it
SAMPLES_TOGETHER = 25_000  # velocities asked for in one call: enough to fill the solver, few enough to share out


@dataclass(frozen=True, eq=False)
class Connection(Faced):
    """A on a grid. A: (3, d, N_1, ..., N_d), xi = + A alphadot, in the velocity's frame.
    residual: (3, N_1, ..., N_d), rms over the fitted directions of xi - A alphadot for |alphadot| = 1;
    speed: (3, N_1, ..., N_d), rms of xi itself. degree: of the interpolating spline. All are nan at grid points that are
    singular, or have a neighbour beyond singular shapes. unit: of lengths, "BL" (body lengths) or "m". length: of the body in
    that unit; None where nothing says it."""

    axes: tuple[np.ndarray, ...]
    A: np.ndarray
    residual: np.ndarray
    speed: np.ndarray
    degree: int = 3
    _: KW_ONLY
    unit: str = UNTOLD
    length: float | None = None

    def __repr__(self) -> str:
        gone = summary.masked(self.A.reshape(-1, *self.A.shape[2:]))
        size = f"A {summary.spans(self.A)}; {summary.left(self.residual, self.speed)}{summary.lengths(**self.size)}"
        return f"Connection({summary.grid(self.axes)}{gone}; {size})"

    @property
    def size(self) -> dict:
        """Its unit and length, as arguments of another connection or of a field."""
        return {"unit": self.unit, "length": self.length}

    @cached_property
    def field(self) -> Field:
        return Field(self.axes, self.A, self.degree, **self.size)

    def __call__(self, alpha) -> np.ndarray:
        """A (..., 3, d) at shapes alpha (..., d); ValueError outside the grid."""
        return self.field(alpha)

    def velocity(self, alpha, alphadot) -> np.ndarray:
        """xi = A(alpha) alphadot, (..., 3)."""
        return np.einsum("...ij,...j->...i", self(alpha), real_array("alphadot", alphadot))

    def half(self, first: int) -> Connection:
        """The connection on every second point of each axis from ``first``, and on both ends (`field.half_of`)."""
        axes, arrays, degree = half_of(self.axes, (self.A, self.residual, self.speed), self.degree, first)
        return Connection(axes, *arrays, degree, **self.size)


def grid(joints: int, points: int = 31, extent: float = 2.5) -> tuple[np.ndarray, ...]:
    """``joints`` equal axes of ``points`` angles from -extent to extent (rad)."""
    in_range("joints", joints, 1, 10_000, whole=True)
    in_range("grid", points, 4, 1e6, whole=True)
    in_range("extent", extent, 1e-9, 1e6)
    axis = np.linspace(-extent, extent, int(points))
    return ((axis - axis[::-1]) / 2,) * int(joints)  # symmetric to the last digit, for `fit`'s mirror


def check_knobs(degree, progress) -> None:
    """ValueError for no degree of a spline, or nothing to be told the fraction done."""
    in_range("degree", degree, 1, 5, whole=True)
    if not (progress is None or callable(progress)):
        raise Refusal("progress must be a function of the fraction done", value=progress)


def directions(joints: int, count: int) -> np.ndarray:
    """Unit alphadot (count, joints), spread evenly over half of all directions: exactly for two joints, by a
    low-discrepancy sequence for more."""
    in_range("joints", joints, 1, 10_000, whole=True)
    least = joints if joints <= 2 else 4 * joints  # a scattered set of fewer may nearly miss a direction
    if not (is_whole(count) and count >= least):
        raise Refusal(f"directions must be a whole number of at least {least} for {joints} joints", value=count)
    if joints == 1:
        return np.ones((1, 1))
    if joints == 2:
        angle = np.pi * np.arange(count) / count
        return np.stack([np.cos(angle), np.sin(angle)], -1)
    from scipy.special import ndtri

    normal = ndtri(np.stack([_van_der_corput(count, base) for base in _primes(joints)], -1))
    return normal / np.linalg.norm(normal, axis=-1, keepdims=True)


def _van_der_corput(count: int, base: int) -> np.ndarray:
    """Return 1, 2 ... ``count`` with their digits in a base mirrored at the point; for prime numbers the sequence of Halton,
    as scipy.stats has it, which takes half a second to load."""
    found, left, unit = np.zeros(count), np.arange(1, count + 1), 1.0 / base
    while left.any():
        found += left % base * unit
        left, unit = left // base, unit / base
    return found


def _primes(count: int) -> list[int]:
    """Return the first prime numbers."""
    found: list[int] = []
    number = 2
    while len(found) < count:
        if all(number % prime for prime in itertools.takewhile(lambda prime: prime**2 <= number, found)):
            found.append(number)
        number += 1
    return found


def sampled(
    velocity: Velocity,
    axes,
    unit,
    keep: Callable,
    degree: int = 3,
    progress: Callable | None = None,
    traits: Traits = NOTHING,
    map: Map = each,
) -> list[np.ndarray]:
    """`sampled_at` at every shape of a grid; arrays are (..., N_1, ..., N_d)."""
    for a in axes:
        if a.ndim != 1 or len(a) <= degree or not (np.diff(a) > 0).all():
            raise Refusal(f"each axis must be more than {degree} ascending angles, got {a}")
    alpha = np.stack(np.meshgrid(*axes, indexing="ij"), -1)
    alike = images(axes, unit, traits)
    return sampled_on(velocity, alpha, unit, keep, progress, alike, traits.singularity, map)


def sampled_on(
    velocity: Velocity,
    alpha,
    unit,
    keep: Callable,
    progress: Callable | None = None,
    alike: Sequence[Image] = (),
    singularity: Callable | None = None,
    map: Map = each,
) -> list[np.ndarray]:
    """`sampled_at` on a mesh of shapes alpha (N_1, ..., d); arrays are (..., N_1, ...), nan where shapes are singular."""
    flat, shape = alpha.reshape(-1, alpha.shape[-1]), alpha.shape[:-1]
    fields = sampled_at(velocity, flat, unit, keep, progress, alike, singularity is not None, map)
    fields = [x.reshape(*x.shape[:-1], *shape) for x in fields]
    if singularity is not None:
        mask = crossed(singularity(alpha))
        fields = [np.where(mask, np.nan, x) for x in fields]
    return fields


def sampled_at(
    velocity: Velocity,
    alpha,
    unit,
    keep: Callable,
    progress: Callable | None = None,
    alike: Sequence[Image] = (),
    masked: bool = False,
    map: Map = each,
) -> list[np.ndarray]:
    """What ``keep`` keeps of the velocity at shapes alpha (S, d) for the directions ``unit`` (C, d) of alphadot: keep takes xi
    (s, C, 3) at some shapes and gives arrays (..., s), here (..., S). Velocities themselves are not kept: of 2,000,000 shapes
    and 1,000 directions they would fill 48 GB. alike: images of shapes among themselves, of which one is solved. map: as the
    builtin, of some shapes after others."""
    first = to_solve(alike, len(alpha))
    todo = np.flatnonzero(first)
    step = max(1, SAMPLES_TOGETHER // len(unit))
    fields: list[np.ndarray] = []
    parts = [todo[k : k + step] for k in range(0, len(todo), step)]
    done, found = 0, map(partial(_asked, (velocity, unit, masked)), [alpha[x, None] for x in parts])
    for here, (xi, *more) in zip(parts, found):
        if more:
            velocity.heard(*more)
        places, velocities = [here], [xi]
        for image in alike:
            some = ~first[image.index[here]]
            places.append(image.index[here[some]])
            velocities.append(image.of(xi[some]))
        kept = keep(np.concatenate(velocities))
        fields = fields or [np.empty((*x.shape[:-1], len(alpha))) for x in kept]
        for field, x in zip(fields, kept):
            field[..., np.concatenate(places)] = x
        done += len(here)
        if progress:
            progress(done / len(todo))
    return fields


def _asked(asked: tuple, alpha: np.ndarray) -> tuple[np.ndarray, ...]:
    """(xi, and more if the velocity tells more) of (velocity, unit, whether xi may be nan) at some shapes."""
    velocity, unit, masked = asked
    if not isinstance(velocity, Telling):
        return (evaluate(velocity, alpha, unit, masked),)
    xi, more = velocity.both(alpha, unit)
    return evaluate(lambda *at: xi, alpha, unit, masked), more


def even_part(velocity: Velocity, axes, traits: Traits = NOTHING, map: Map = each) -> np.ndarray | None:
    """(3, N_1, ..., N_d): rms over directions of xi(alpha, alphadot) + xi(alpha, -alphadot), |alphadot| = 1, which a fit from
    half of the directions takes for 0; None where it is nothing but rounding at a few shapes that stand for all."""
    axes = tuple(np.asarray(a, float) for a in axes)
    unit = directions(len(axes), EVEN_DIRECTIONS * len(axes))
    rng = np.random.default_rng(0)
    some = np.stack([rng.uniform(a[0], a[-1], (EVEN_SHAPES, 1)) for a in axes], -1)
    forth, back = (evaluate(velocity, some, sign * unit, masked=traits.singularity is not None) for sign in (1.0, -1.0))
    if np.nanmax(np.abs(forth + back)) <= EVEN * np.nanmax(np.abs(forth)):
        return None
    both = lambda alpha, alphadot: velocity(alpha, alphadot) + velocity(alpha, -alphadot)
    known = Traits(singularity=traits.singularity)  # what is even has no images
    return sampled(both, axes, unit, lambda xi: (np.sqrt((xi**2).mean(1)).T,), 1, traits=known, map=map)[0]


def crossed(d: np.ndarray) -> np.ndarray:
    """Mask (N_1, ..., N_d) of the grid points at which d is 0 or of another sign than at a neighbour along an axis."""
    mask = d == 0
    for axis in range(d.ndim):
        low, high = (np.moveaxis(mask, axis, 0)[part] for part in (slice(None, -1), slice(1, None)))
        ordered = np.moveaxis(d, axis, 0)
        other = ordered[:-1] * ordered[1:] < 0
        low |= other
        high |= other
    return mask


def fit(
    velocity: Velocity,
    axes,
    count: int = 8,
    degree: int = 3,
    progress: Callable | None = None,
    *,
    traits: Traits = NOTHING,
    trusted: bool = False,
    unit: str = UNTOLD,
    length: float | None = None,
    map: Map = each,
) -> Connection:
    """Least-squares A on the grid spanned by ``axes``, from ``count`` uniform directions of alphadot at each shape.

    progress: called with the fraction done. traits: what the velocity claims. Where left and right are alike (``halved``)
    half of a symmetric grid gives the other half; ``reversible`` halves it again where the directions allow
    (`geomech.geometry.images`); where ``singularity`` passes through 0 the connection is nan. Raises what ``velocity``
    raises.

    A velocity that takes one shape at a time is asked for each in turn, and what it returns is broadcast. It is tried at a
    few shapes: `VelocityWarning` if it is not odd or not homogeneous in alphadot, or ignores alpha. trusted: it is not tried.
    unit, length: of lengths in the velocity, and of the body, as `Connection` keeps them. map: as the builtin, of tasks that
    each have many shapes; that of a request, where one is under way, shares and stores them.
    """
    axes = as_axes(axes)
    check_knobs(degree, progress)
    rates = directions(len(axes), count)
    if callable(velocity) and not trusted and all(a.ndim == 1 and a.size for a in axes):
        velocity = tried(velocity, axes, traits.singularity is not None)
    found = sampled(velocity, axes, rates, least_squares(rates), degree, progress, traits, map)
    return Connection(axes, *found, degree, unit=unit, length=length)


def fitted_at(velocity: Velocity, joints: int, count: int, degree_one: bool = False, map: Map = each) -> Callable:
    """The least-squares A (..., 3, d) as a function of shapes (..., d), solved where it is asked for, from ``count``
    directions; of a velocity that is linear in alphadot, ``degree_one``, from d."""
    unit = np.eye(joints) if degree_one else directions(joints, count)
    keep = least_squares(unit)

    def A(alpha):
        alpha = real_array("alpha", alpha)
        found = sampled_at(velocity, alpha.reshape(-1, joints), unit, lambda xi: keep(xi)[:1], map=map)[0]
        return np.moveaxis(found, -1, 0).reshape(*alpha.shape[:-1], 3, joints)

    return A


def least_squares(unit: np.ndarray) -> Callable:
    """A `keep` of `sampled_at`: A (3, d, s) that fits best, rms (3, s) of what it leaves and of xi itself."""
    inverse = np.linalg.pinv(unit)

    def keep(xi):
        A = np.einsum("jc,sci->ijs", inverse, xi)
        residual = np.sqrt(((xi - np.einsum("ijs,cj->sci", A, unit)) ** 2).mean(1)).T
        return A, residual, np.sqrt((xi**2).mean(1)).T

    return keep
