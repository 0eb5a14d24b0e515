"""The curvature constraint function: CCF = dA + [A, A], the density of displacement in
shape space (paper Fig. 11(d)).

For each pair of joints i < j,  CCF_ij = d_i A_j - d_j A_i + [A_i, A_j]  with the
columns A_i in se(2). Its integral over the area a gait encloses, counter-clockwise
positive, estimates the gait's displacement: to order 3 in the gait's size about a
generic shape, to order 4 where A vanishes at its centre.

Links that stick leave kinks in A, and a derivative across a kink is a matter of the
grid: `error` says where, and by how much, so that no sign is read into noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from geomech.mathematics.geometry.connection import Connection
from geomech.mathematics.geometry.periods import periodic_axes
from geomech.mathematics.geometry.representations.field import Field, every_second
from geomech.mathematics.geometry.representations.tube import Tube
from rft.core.checks import is_whole
from rft.core.refusal import Refusal, formatted
from rft.formulas import se2


def _checked(connection, i, j) -> None:
    """Refuse what is no connection, or no two of its joints."""
    if not isinstance(connection, Connection):
        raise Refusal(
            "a CCF is computed from a Connection, such as the result of connection.fit",
            value=connection,
        )
    joints = connection.field.joints
    are_joints = all(is_whole(k) and 1 <= k <= max(joints, 2) for k in (i, j))
    if not are_joints or i == j:
        raise Refusal(
            f"i and j must be two of the joints 1 to {joints},"
            f" got {formatted(i)} and {formatted(j)}"
        )


def exterior_derivative(connection: Connection, i: int = 1, j: int = 2) -> np.ndarray:
    """Return d_i A_j - d_j A_i on the grid, (3, N_1, ..., N_d), of the joints i and j,
    counted from 1.

    Examples
    --------
    >>> import numpy as np
    >>> from geomech.mathematics.geometry import connection, curvature
    >>> from geomech.scenes import load
    >>> velocity = load("three-link-viscous").system.velocity
    >>> A = connection.fit(velocity, connection.grid(2, 15))
    >>> total = curvature.exterior_derivative(A) + curvature.lie_bracket(A)
    >>> bool(np.allclose(total, curvature.ccf(A).values))
    True
    """
    _checked(connection, i, j)
    field = connection.field
    along_i = field.derivative(i - 1)
    along_j = field.derivative(j - 1)
    return along_i[:, j - 1] - along_j[:, i - 1]


def lie_bracket(connection: Connection, i: int = 1, j: int = 2) -> np.ndarray:
    """Return [A_i, A_j] on the grid, (3, N_1, ..., N_d), of the joints i and j, counted
    from 1.

    Examples
    --------
    >>> from geomech.mathematics.geometry import connection, curvature
    >>> from geomech.scenes import load
    >>> velocity = load("three-link-viscous").system.velocity
    >>> A = connection.fit(velocity, connection.grid(2, 7))
    >>> curvature.lie_bracket(A)[:2, 3, 4].round(3)  # x and y
    array([0.025, 0.016])
    """
    _checked(connection, i, j)
    columns = np.moveaxis(connection.A, 0, -1)
    return np.moveaxis(se2.bracket(columns[i - 1], columns[j - 1]), -1, 0)


def ccf(connection: Connection, i: int = 1, j: int = 2) -> Field:
    """Return CCF_ij on the grid, values (3, N_1, ..., N_d): displacement per rad^2, in
    the connection's length unit and rad.

    i, j: joints, counted from 1.

    Examples
    --------
    >>> from geomech.mathematics.geometry import connection, curvature
    >>> from geomech.scenes import load
    >>> velocity = load("three-link-viscous").system.velocity
    >>> A = connection.fit(velocity, connection.grid(2, 15))
    >>> field = curvature.ccf(A)
    >>> field.values.shape, round(float(field([0.0, 0.0])[0]), 3)
    ((3, 15, 15), -0.021)
    """
    _checked(connection, i, j)
    if connection.field.joints < 2:
        raise Refusal(
            "a CCF needs at least two joints",
            because="a loop of one joint encloses no area",
        )
    if isinstance(connection, Tube) and connection.field.joints == 2:
        values = connection.on_grid(connection.taylor.ccf)
        if i > j:
            values = -values
        return Field(connection.axes, values, connection.degree, **connection.size)
    values = exterior_derivative(connection, i, j) + lie_bracket(connection, i, j)
    return replace(connection.field, values=values)


def error(connection: Connection, i: int = 1, j: int = 2) -> Field:
    """Return the estimated error of `ccf`, values (3, N_1, ..., N_d) in its units, from
    the grid against its halves, without a solve. For a connection near a measured gait
    it is the uncertainty that the log leaves.

    The halves are every second point of each axis, from the first and from the second,
    with both ends kept. The estimate is the largest difference of either half's CCF
    from the whole grid's, at a shape and its neighbours: near a kink one difference may
    vanish by chance. At grid points of dry media it covers the CCF of the same fit by
    differences over 2e-4 rad in more than 90 %, and is some ten times the error in the
    median; where A is smooth, fifty times.

    Examples
    --------
    >>> from geomech.mathematics.geometry import connection, curvature
    >>> from geomech.scenes import load
    >>> velocity = load("three-link-viscous").system.velocity
    >>> A = connection.fit(velocity, connection.grid(2, 15))
    >>> curvature.error(A).values.shape
    (3, 15, 15)
    """
    full = ccf(connection, i, j)  # refuses what has none
    if isinstance(connection, Tube) and connection.field.joints == 2:
        return replace(full, values=connection.on_grid(connection.taylor.ccf_error))
    if full.masked:
        return _masked_error(connection, full, i, j)
    shapes = np.stack(np.meshgrid(*connection.axes, indexing="ij"), -1)
    differences = []
    for first in (0, 1):
        half = ccf(connection.half(first), i, j)(shapes)
        differences.append(np.abs(np.moveaxis(half, -1, 0) - full.values))
    values = _largest_nearby(np.maximum(*differences), connection)
    return replace(full, values=values)


def _masked_error(connection: Connection, full: Field, i: int, j: int) -> Field:
    """Return `error` where there are singular shapes: nothing is interpolated between
    them, so the halves count at their own points."""
    difference = np.zeros(full.values.shape)
    for first in (0, 1):
        points = [every_second(axis, first) for axis in connection.axes]
        picks = (..., *np.ix_(*points))
        half = ccf(connection.half(first), i, j)
        half_difference = np.abs(half.values - full.values[picks])
        difference[picks] = np.fmax(difference[picks], half_difference)
    worst = _largest_nearby(difference, connection)
    return replace(full, values=np.where(np.isnan(full.values), np.nan, worst))


def _largest_nearby(values: np.ndarray, connection: Connection) -> np.ndarray:
    """Return the largest of values (3, N_1, ..., N_d) at each grid point and its
    neighbours, across the seam of an axis with a period as well."""
    from scipy.ndimage import maximum_filter

    joints = len(connection.axes)
    around = periodic_axes(connection.periods)
    distinct = [slice(None)] * values.ndim
    modes = ["reflect"] * values.ndim
    for k in around:
        distinct[1 + k] = slice(-1)  # the last point is the first
        modes[1 + k] = "wrap"
    nearby = maximum_filter(values[tuple(distinct)], (1, *(3,) * joints), mode=modes)
    widths = [(0, 1 if k - 1 in around else 0) for k in range(values.ndim)]
    return np.pad(nearby, widths, mode="wrap")
