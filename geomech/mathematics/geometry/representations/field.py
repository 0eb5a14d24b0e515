"""Functions on shape space, known on a grid and interpolated by tensor-product
splines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from geomech.core import summary
from geomech.core.face import implementation
from geomech.mathematics.geometry.periods import (
    Periods,
    check_axes,
    checked_periods,
    closed_ends,
    period_of,
    wrapped,
)
from rft.core.checks import in_range, real_array
from rft.core.refusal import Refusal

UNKNOWN_UNIT = "length"  # stands for the unit of lengths where it is not known


@dataclass(frozen=True, eq=False)
class Field:
    """Values (..., N_1, ..., N_d) on the grid spanned by d axes of shape angles (rad),
    all ascending.

    nan in all components masks a grid point: derivatives come from the points between
    masks, and such a field is not interpolated.

    degree: of the spline through the values; interpolation is of order degree + 1 in
    the spacing where the function is smooth, of order 1 to 2 across the kinks that
    sticking links leave in a dry medium's connection. unit: of the lengths among the
    values, "BL" (body lengths) or "m". length: of the body in that unit; None where it
    is not known. periods: of the shape variables, None for one without, () for none.
    The axis of a variable with a period covers one period, with the same values at both
    ends; the spline repeats, and takes any angle.

    Examples
    --------
    >>> import numpy as np
    >>> from geomech.mathematics.geometry.representations.field import Field
    >>> axis = np.linspace(0.0, 2 * np.pi, 33)
    >>> wave = Field((axis,), np.cos(axis), periods=(2 * np.pi,))
    >>> wave([[1.0], [1.0 + 2 * np.pi]]).round(4)
    array([0.5403, 0.5403])
    """

    axes: tuple[np.ndarray, ...]
    values: np.ndarray
    degree: int = 3
    _: KW_ONLY
    unit: str = UNKNOWN_UNIT
    length: float | None = None
    periods: Periods = ()

    def __post_init__(self):
        object.__setattr__(self, "axes", as_axes(self.axes))
        object.__setattr__(self, "values", real_array("values", self.values))
        in_range("degree", self.degree, 0, 5, whole=True)
        shape = tuple(len(a) for a in self.axes)
        if self.values.shape[-len(shape) :] != shape:
            raise Refusal(
                f"values {self.values.shape} do not end in the grid's shape {shape}"
            )
        if min(shape) <= self.degree:
            raise Refusal(
                f"a spline of degree {self.degree} needs more than that many grid"
                f" points, got {shape}"
            )
        periods = checked_periods(self.periods, len(shape))
        check_axes(self.axes, periods)
        values = closed_ends(self.values, len(shape), periods)
        object.__setattr__(self, "periods", periods)
        object.__setattr__(self, "values", values)

    def __repr__(self) -> str:
        lead = self.values.shape[: -self.joints]
        components = "x".join(map(str, lead)) or "one"
        grid = summary.grid(self.axes)
        masked = summary.masked(
            self.values.reshape(-1, *self.values.shape[len(lead) :])
        )
        span = summary.spans if lead == (3,) else summary.span
        lengths = summary.lengths(**self.size)
        return (
            f"Field({components} components on {grid}{masked};"
            f" values {span(self.values)}{lengths})"
        )

    def _repr_html_(self) -> str:
        return implementation("Field._repr_html_")(self)

    def to_xarray(self, name: str = "ccf", *, shapes: Sequence[str] = ()) -> Any:
        """Return a DataArray; with three components it is taken for a CCF, with its
        units.

        shapes: names of the shape variables, where these are no joint angles.
        ImportError without the package xarray."""
        return implementation("Field.to_xarray")(self, name, shapes)

    @property
    def size(self) -> dict:
        """Unit of lengths and length of the body, as arguments of another field."""
        return {"unit": self.unit, "length": self.length}

    @property
    def joints(self) -> int:
        """Number d of axes."""
        return len(self.axes)

    def _along(self, axis: int):
        """Return the one-dimensional spline along a grid axis; that axis comes
        first."""
        rows = np.moveaxis(self.values, axis - self.joints, 0)
        period = period_of(self.periods, axis)
        return _spline_along(self.axes[axis], rows, self.degree, period is not None)

    def derivative(self, axis: int) -> np.ndarray:
        """Return d values / d alpha_axis on the grid, of the spline."""
        in_range("axis", axis, 0, self.joints - 1, whole=True)
        if self.masked:
            return self._between_masks(axis)
        slopes = self._along(axis).derivative()(self.axes[axis])
        if period_of(self.periods, axis) is not None:
            slopes[-1] = slopes[0]
        return np.moveaxis(slopes, 0, axis - self.joints)

    @property
    def masked(self) -> bool:
        """Whether some grid points are masked."""
        return bool(np.isnan(self.values).any())

    def _between_masks(self, axis: int) -> np.ndarray:
        """Return `derivative` by a spline through each run of points without a mask;
        nan for a run of one."""
        x = self.axes[axis]
        period = period_of(self.periods, axis)
        derivative = np.full(self.values.shape, np.nan)
        rows = np.moveaxis(self.values, axis - self.joints, -1)
        slopes = np.moveaxis(derivative, axis - self.joints, -1)  # a view
        lead = rows.ndim - self.joints
        for place in np.ndindex(rows.shape[lead:-1]):
            index = (slice(None),) * lead + place
            row = rows[index]
            slope = slopes[index]
            good = np.isfinite(row).all(tuple(range(lead)))
            if period is None:
                slope[...] = _slopes_between(x, row, good, self.degree)
            else:
                slope[...] = _slopes_around(x, row, good, self.degree, period)
        return derivative

    @cached_property
    def spline(self) -> Any:
        """Tensor-product spline through the values: alpha (..., d) within the axes ->
        (..., components)."""
        self._refuse_masks()
        return _tensor_spline(self)

    def antiderivative(self, axis: int) -> Any:
        """Return the integral along ``axis`` from its lower end: alpha (..., d) ->
        (..., components).

        Along an axis with a period it grows by the integral over one period with each
        turn of alpha_axis, which is not wrapped."""
        self._refuse_masks()
        potential = _tensor_spline(self, integrate=axis)
        if not self.periods:
            return potential

        period = period_of(self.periods, axis)
        first, last = self.axes[axis][[0, -1]]

        def integral(alpha):
            alpha = real_array("alpha", alpha)
            inside = wrapped(alpha, self.axes, self.periods)
            value = potential(inside)
            if period is None:
                return value
            turns = np.round((alpha[..., axis] - inside[..., axis]) / period)
            ends = []
            for end in (first, last):
                at_end = inside.copy()
                at_end[..., axis] = end
                ends.append(potential(at_end))
            turns = turns.reshape(*turns.shape, *[1] * (value.ndim - turns.ndim))
            return value - ends[0] + turns * (ends[1] - ends[0])

        return integral

    def __call__(self, alpha) -> np.ndarray:
        """Return values at shapes alpha (..., d), with the components last: (...,
        *components). ValueError outside the grid, which no angle with a period is."""
        return self.spline(self.inside(alpha))

    def _refuse_masks(self) -> None:
        if self.masked:
            raise Refusal(
                "a field with singular shapes cannot be interpolated",
                instead="use the direct tier",
            )

    def inside(self, alpha: ArrayLike) -> np.ndarray:
        """Return alpha as an array, with angles that have a period within their axes;
        Refusal names the first other angle that leaves the grid."""
        return inside(self.axes, alpha, periods=self.periods)


def as_axes(axes: Sequence[ArrayLike]) -> tuple[np.ndarray, ...]:
    """Return axes as arrays of angles; Refusal for anything else."""
    try:
        arrays = tuple(real_array("an axis", a) for a in axes)
    except TypeError:
        arrays = ()
    if not arrays or any(a.ndim != 1 for a in arrays):
        raise Refusal(
            "axes must be rows of ascending angles, one for each joint", value=axes
        )
    return arrays


def inside(axes, alpha, names: Sequence[str] = (), periods: Periods = ()) -> np.ndarray:
    """Return alpha (..., d) as an array, with angles that have a period within their
    axes; Refusal names the first other angle that leaves the grid of these axes, by one
    of ``names`` where given."""
    alpha = real_array("alpha", alpha)
    if alpha.ndim == 0 or alpha.shape[-1] != len(axes) or not np.isfinite(alpha).all():
        raise Refusal(
            f"alpha must be finite and of shape (..., {len(axes)})", value=alpha.shape
        )
    for k, axis in enumerate(axes):
        if period_of(periods, k) is not None:
            continue
        first = axis[0]
        last = axis[-1]
        low = alpha[..., k].min(initial=np.inf)
        high = alpha[..., k].max(initial=-np.inf)
        slack = 1e-9 * (last - first)
        if low < first - slack or high > last + slack:
            worst = low if first - low > high - last else high
            name = f"alpha_{k + 1}"
            if names:
                name = names[k]
            raise Refusal(
                f"{name} = {worst:.4g} rad lies outside the field, which covers "
                f"{first:g} to {last:g}",
                instead="widen the extent or lower the amplitude",
            )
    return wrapped(alpha, axes, periods)


def every_second(axis: np.ndarray, first: int) -> np.ndarray:
    """Return the indices of every second point of an axis from ``first``, and of both
    ends: half a grid, for estimates of errors.

    With both ends the half of an axis with a period has that period."""
    return np.unique([0, *range(first, len(axis), 2), len(axis) - 1])


def half_grid(
    axes: Sequence[np.ndarray], arrays: Sequence[np.ndarray], degree: int, first: int
) -> tuple[tuple[np.ndarray, ...], list[np.ndarray], int]:
    """Return (axes, arrays (..., N_1, ..., N_d), degree) on `every_second` point of
    each axis; of a lower degree where that leaves too few points for the spline."""
    picks = [every_second(axis, first) for axis in axes]
    coarse_axes = tuple(axis[pick] for axis, pick in zip(axes, picks))
    coarse_arrays = [x[(..., *np.ix_(*picks))] for x in arrays]
    return coarse_axes, coarse_arrays, min(degree, min(map(len, picks)) - 1)


def _spline_along(x: np.ndarray, rows: np.ndarray, degree: int, repeats: bool):
    """Return the spline through values ``rows`` (N, ...) at x (N,), periodic where it
    ``repeats``."""
    from scipy.interpolate import BSpline, make_interp_spline

    # Of degree 0 and 1 a spline through equal ends repeats by itself.
    if not repeats or degree < 2:
        return make_interp_spline(x, rows, degree)
    # SciPy solves for one column after another, of which a field has thousands: here
    # only for those of single points, of which all others are sums.
    points = np.eye(len(x))[:, :-1]
    points[-1] = points[0]
    basis = make_interp_spline(x, points, degree, bc_type="periodic")
    coefficients = np.tensordot(basis.c, rows[:-1], 1)
    return BSpline(basis.t, coefficients, degree)


def _slopes_between(x, row, good, degree: int) -> np.ndarray:
    """Return the derivative of values ``row`` (..., N) at x (N,), by a spline through
    each run of ``good`` points (N,); nan at others and for a run of one."""
    from scipy.interpolate import make_interp_spline

    slope = np.full(row.shape, np.nan)
    places = np.flatnonzero(good)
    for run in np.split(places, np.flatnonzero(np.diff(places) > 1) + 1):
        if len(run) > 1:
            k = min(degree, len(run) - 1)
            spline = make_interp_spline(x[run], row[..., run], k, axis=-1)
            slope[..., run] = spline.derivative()(x[run])
    return slope


def _slopes_around(x, row, good, degree: int, period: float) -> np.ndarray:
    """Return `_slopes_between` along an axis with a period: a run goes on beyond the
    end, from its start."""
    if good.all():
        rows = np.moveaxis(row, -1, 0)
        slopes = _spline_along(x, rows, degree, True).derivative()(x)
        slopes[-1] = slopes[0]
        return np.moveaxis(slopes, 0, -1)
    first = int(np.flatnonzero(~good)[0]) % (len(x) - 1)
    order = (first + np.arange(len(x) - 1)) % (len(x) - 1)
    around = x[order] + period * (order < first)
    slope = np.full(row.shape, np.nan)
    slope[..., order] = _slopes_between(around, row[..., order], good[order], degree)
    slope[..., -1] = slope[..., 0]
    return slope


def _tensor_spline(field: Field, integrate: int | None = None):
    """Return the tensor-product spline through a field; along the axis ``integrate``,
    its antiderivative from the lower end."""
    from scipy.interpolate import BSpline, NdBSpline

    d = field.joints
    c = np.moveaxis(field.values, range(-d, 0), range(d))
    knots = []
    degrees = []
    for i, axis in enumerate(field.axes):
        repeats = period_of(field.periods, i) is not None
        b = _spline_along(axis, np.moveaxis(c, i, 0), field.degree, repeats)
        if i == integrate:
            b = BSpline(b.t, b.c, b.k).antiderivative()
        knots.append(b.t)
        degrees.append(b.k)
        c = np.moveaxis(b.c[: len(b.t) - b.k - 1], 0, i)
    return NdBSpline(tuple(knots), np.ascontiguousarray(c), tuple(degrees))
