"""Force and moment of a medium on one straight link that moves (paper Eqs. 2-3)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rft.core.checks import in_range, real_array
from rft.core.refusal import Refusal, require
from rft.laws.base import Medium, require_drag
from rft.laws.records import record


class LinkForce(NamedTuple):
    """What a medium exerts on a link.

    force: (..., 2), against the motion, in the frame of the velocity. moment: (...),
    about the link's centre, counter-clockwise. In N and N m where ``axial_drag`` is in
    N/m and lengths are in m.
    """

    force: np.ndarray
    moment: np.ndarray


def link_force(
    medium: Medium,
    velocity: ArrayLike,
    rotation: ArrayLike = 0.0,
    *,
    heading: ArrayLike = 0.0,
    length: float = 1.0,
    axial_drag: float = 1.0,
) -> LinkForce:
    """Return the force and the moment of a medium on a straight link that moves.

    The drag per unit length is, by the paper's Eq. 2,

        dF = -2 k rho g r |z| [f_n(v.n) n + (v.t) t] ds,

    with v the unit vector of the local velocity, t along the link and n across it to
    the left, and by Eq. 3 in grains f_n(v.n) = (1 + C / sqrt(tan^2 gamma0 + (v.n)^2))
    (v.n). Other media have other formulas (`rft.laws`). The average over the link is
    exact for laws in closed form, such as Eq. 3, else by a rule of 24 points.

    Parameters
    ----------
    medium : a force law of `rft.laws`, or any `rft.laws.base.Medium`.
    velocity : array (..., 2), of the link's centre, in the frame in which ``heading``
        is measured, such as the world's; length/time. Dry grains take its direction
        alone, viscous media its size.
    rotation : array (...), rate of the heading, rad/time, counter-clockwise.
    heading : array (...), angle of the link from the x axis, rad, tail to head.
    length : of the link, in the unit of length of the velocity.
    axial_drag : drag per unit length on motion along the link: in grains
        2 k rho g r |z|, N/m, with k of Eq. 2, the density rho of the bed in kg/m^3, the
        link's radius r and the depth |z| of its axis in m; in a viscous medium that at
        unit speed. Forces are in units of it where it is 1.

    Raises
    ------
    ValueError
        For arrays that do not broadcast, for numbers that are not finite, and for a
        medium that pushes.

    Notes
    -----
    A link at rest has no force here: in dry grains a force at rest may have any value
    below the yield force. Ends are not included (`rft.effects.EndCaps.traction`).

    Examples
    --------
    >>> import numpy as np
    >>> from rft import Granular, link_force
    >>> sand = Granular(C=1.8, gamma0=np.radians(13.8))
    >>> along, across = link_force(sand, [[0.1, 0.0], [0.0, 0.1]]).force
    >>> along.round(3) + 0.0, across.round(3) + 0.0  # over the axial drag
    (array([-1.,  0.]), array([ 0.   , -2.748]))
    >>> drag = 2 * 2.5 * 1450 * 9.81 * 0.008 * 0.03  # 2 k rho g r |z|, N/m
    >>> turned = np.radians(45)  # of a link of 8 cm
    >>> found = link_force(
    ...     sand, [0.1, 0.0], heading=turned, length=0.08, axial_drag=drag
    ... )
    >>> found.force.round(3), abs(float(found.moment))  # N, N m
    (array([-3.007,  1.642]), 0.0)
    """
    require_drag(medium)
    in_range("length", length, 1e-15, 1e15)
    in_range("axial_drag", axial_drag, 1e-15, 1e15)
    velocity = real_array("velocity", velocity)
    require(
        velocity.shape[-1:] == (2,),
        f"velocity must have x and y on its last axis, got shape {velocity.shape}",
    )
    x, y, theta, turned = _broadcast(
        velocity[..., 0],
        velocity[..., 1],
        real_array("rotation", rotation),
        real_array("heading", heading),
    )
    batch = x.shape
    x, y, theta, turned = (a.reshape(1, -1) for a in (x, y, theta, turned))
    c = np.cos(turned)
    s = np.sin(turned)
    v_t = c * x + s * y
    v_n = c * y - s * x
    with np.errstate(all="ignore"):  # at rest, where the force is 0
        load = record(medium).average(v_t, v_n, theta * length / 2, 0.0)
    along = -axial_drag * length * load.t
    across = -axial_drag * length * load.n
    force = np.stack([c * along - s * across, s * along + c * across], -1)
    moment = -axial_drag * length * load.w * length / 2
    at_rest = (v_t == 0) & (v_n == 0) & (theta == 0)
    force = np.where(at_rest[..., None], 0.0, force)
    moment = np.where(at_rest, 0.0, moment)
    return LinkForce(force.reshape(*batch, 2), moment.reshape(batch))


def _broadcast(*arrays: np.ndarray) -> list[np.ndarray]:
    """Return arrays of one shape; ValueError for infinite or missing numbers, and for
    shapes that do not broadcast."""
    for name, array in zip(("velocity", "velocity", "rotation", "heading"), arrays):
        require(bool(np.isfinite(array).all()), f"{name} must be finite numbers")
    shapes = [array.shape for array in arrays[1:]]
    try:
        return np.broadcast_arrays(*arrays)
    except ValueError:
        raise Refusal(
            "velocity, rotation and heading do not broadcast, with the shapes "
            f"{', '.join(map(str, shapes))} but for x and y",
            instead="give arrays of one shape, or single numbers",
        ) from None
