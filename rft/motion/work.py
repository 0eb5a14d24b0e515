"""Work of a moving body against the medium: power, internal bending moments, slip."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rft.balance.arrays import loads as loads_on
from rft.balance.arrays import velocities, with_frame_velocity
from rft.balance.velocity import checked_input
from rft.bodies.base import (
    Body,
    Elements,
    body_size,
    checked_body,
    half_lengths,
    joint_speed,
)
from rft.bodies.pieces import PIECES
from rft.core.checks import real_array
from rft.core.premise import SHAPE_ALONE
from rft.core.refusal import require
from rft.effects.base import Effect, broken_premises
from rft.effects.contact import Assembly, Problem, assemble
from rft.formulas.momentum import element_momentum_rates
from rft.formulas.newton import times, to_frame
from rft.laws.base import Medium


class Work(NamedTuple):
    """Power, internal moments and slip.

    power: (...), rate of work against the medium, >= 0, in units of (axial drag of the
    whole body) x (length / time). bending_moment: (..., n - 1), internal moments at the
    points between the n elements, in axial drag x body length. They balance the medium
    and, where the body has mass, accelerate it; positive where the body works to bend
    to the left (counter-clockwise, tail to head), as muscles on its left side do. The
    sum of bending_moment d(bend)/dt x length is the power, with mass in the mean over a
    cycle that repeats. slip: (...), mean over the body of the angle between an
    element's direction and the velocity of its centre, 0 to pi/2 rad.

    Of the m elements into which effects cut the n: element_force: (..., 2, m), force of
    the medium on each, along it towards the head and across it to the left, in axial
    drag. element_power: (..., m), work against it, in axial drag x body length / time.
    end_force: (..., 2, 2), the same force on points that effects add at the tail and at
    the head, by the direction of the element there. end_power: (..., 2).

    Examples
    --------
    >>> from rft import Chain, Viscous, body_velocity, work_done
    >>> motion = Viscous(), Chain(), [0.5, 0.3], [1.0, 0.0]
    >>> work = work_done(*motion, body_velocity(*motion).xi)
    >>> work.bending_moment.shape, bool(work.power > 0)
    ((2,), True)
    """

    power: np.ndarray
    bending_moment: np.ndarray
    slip: np.ndarray
    element_force: np.ndarray
    element_power: np.ndarray
    end_force: np.ndarray
    end_power: np.ndarray

    def __repr__(self) -> str:
        names = zip(("power", "bending moment", "slip"), self)
        sizes = [
            f"{name} {np.min(x):.3g} to {np.max(x):.3g}"
            for name, x in names
            if np.size(x)
        ]
        joints = np.shape(self.bending_moment)[-1]
        return (
            f"Work({np.shape(self.power)} samples of {joints} joints; "
            f"{', '.join(sizes)})"
        )


def work_done(
    medium: Medium,
    body: Body,
    alpha: ArrayLike,
    alphadot: ArrayLike,
    xi: ArrayLike,
    *,
    loads: str = "exact",
    regularisation: float = 1e-6,
    effects: Sequence[Effect] = (),
    pieces: int = PIECES,
) -> Work:
    """Return power, internal moments and slip at body velocities xi (..., 3) of
    `body_velocity` for the same arguments.

    Examples
    --------
    >>> from rft import Chain, Viscous, body_velocity, work_done
    >>> motion = Viscous(), Chain(), [0.5, 0.3], [1.0, 0.0]
    >>> work = work_done(*motion, body_velocity(*motion).xi)
    >>> round(float(work.power), 5), work.bending_moment.round(4)
    (0.00827, array([0.0083, 0.0056]))
    """
    assembly = _assembled(medium, body, effects, loads, pieces)
    motion = _motion(assembly, body, alpha, alphadot, xi, regularisation)
    rounding = regularisation * motion.scale
    work = element_work(motion.problem, half_lengths(body), motion.xi, rounding)
    return Work(
        work.power.reshape(motion.batch) * body_size(body),
        *(x.reshape((*motion.batch, *x.shape[1:])) for x in work[1:]),
    )


def slip_angles(
    medium: Medium,
    body: Body,
    alpha: ArrayLike,
    alphadot: ArrayLike,
    xi: ArrayLike,
    *,
    effects: Sequence[Effect] = (),
    pieces: int = PIECES,
) -> np.ndarray:
    """Return the slip (...) of `work_done` alone, in rad, without computing forces.

    Examples
    --------
    >>> from rft import Chain, Viscous, body_velocity, work_done
    >>> from rft.motion.work import slip_angles
    >>> motion = Viscous(), Chain(), [0.5, 0.3], [1.0, 0.0]
    >>> xi = body_velocity(*motion).xi
    >>> bool(slip_angles(*motion, xi) == work_done(*motion, xi).slip)
    True
    """
    assembly = _assembled(medium, body, effects, "exact", pieces)
    motion = _motion(assembly, body, alpha, alphadot, xi)
    problem = motion.problem
    scale = problem.frame.speed_scale
    v = with_frame_velocity(problem, velocities(problem), *(motion.xi / scale))
    return _mean_slip(problem.sides.elements, v[0]).reshape(motion.batch)


def _assembled(
    medium: Medium, body: Body, effects: Sequence[Effect], loads: str, pieces: int
) -> Assembly:
    """Return the assembly without effects that break the premise of shape alone."""
    checked_body(body)
    broken_premises(effects)  # raises ValueError unless all are effects
    assembly = assemble(medium, body, effects, loads, pieces)
    return assembly._replace(
        effects=tuple(e for e in assembly.effects if not e.breaks & SHAPE_ALONE)
    )


class _Motion(NamedTuple):
    """Motions of a batch of B samples.

    xi: (3, B), in body lengths. scale: (B,), of speed. batch: the shape that the
    samples have."""

    problem: Problem
    xi: np.ndarray
    scale: np.ndarray
    batch: tuple[int, ...]


def _motion(
    assembly: Assembly,
    body: Body,
    alpha: ArrayLike,
    alphadot: ArrayLike,
    xi: ArrayLike,
    regularisation: float = 1e-6,
) -> _Motion:
    """Return the motion of a body at given velocities; ValueError for arrays of another
    shape."""
    alpha, alphadot = checked_input(body, alpha, alphadot, regularisation, 1.0)
    batch = alpha.shape[:-1]
    xi = real_array("xi", xi)
    require(
        xi.shape == (*batch, 3),
        f"xi must have shape {(*batch, 3)} for these alpha and alphadot",
        value=xi.shape,
    )
    alpha = alpha.reshape(-1, body.joints).T
    alphadot = alphadot.reshape(-1, body.joints).T
    length = body_size(body)
    xi = xi.reshape(-1, 3).T / np.array([[length], [length], [1.0]])
    speed = joint_speed(body, alphadot)
    scale = np.where(speed > 0, speed, 1.0)  # of a body at rest any scale will do
    return _Motion(assembly.problem(alpha, alphadot, scale), xi, scale, batch)


def element_work(
    problem: Problem, body_halves: np.ndarray, xi: np.ndarray, rounding: np.ndarray
) -> Work:
    """Return the work of B samples at body velocities xi (3, B), in body lengths.

    body_halves: (n,), half lengths of the body's elements before these were cut into
    pieces; bending moments are those between these elements. rounding: (B,), speed
    below which dry friction is rounded off."""
    scale = problem.frame.speed_scale
    v = with_frame_velocity(problem, velocities(problem), *(xi / scale))
    wrenches = []
    stations = []
    forces = []
    powers = []
    contacts = problem.sides, problem.points
    loads = loads_on(problem, v, rounding / scale[0])
    for (e, load), (v_t, v_n, v_w), contact in zip(loads, v, contacts):
        f_t = e.weight * load.t
        f_n = e.weight * load.n
        f_w = e.weight * load.w
        wrenches.append(np.stack(np.broadcast_arrays(*to_frame(e, f_t, f_n, f_w))))
        stations.append(contact.station[:, 0])

        # Work against gravity is not done against the medium.
        weight = e.weight * contact.incline.weight
        drag_t = f_t + weight * contact.incline.down_t
        drag_n = f_n + weight * contact.incline.down_n
        forces.append(np.stack(np.broadcast_arrays(-drag_t, -drag_n)))
        powers.append(drag_t * scale * v_t + drag_n * scale * v_n + f_w * scale * v_w)

    e = problem.sides.elements
    slip = _mean_slip(e, v[0])
    if problem.momentum_rate is not None:
        wrenches[0] = wrenches[0] + element_momentum_rates(
            e, problem.momentum_rate, times(scale, v[0])
        )
    moment = _moments(
        e, np.concatenate(wrenches, 1), np.concatenate(stations), body_halves
    )
    return Work(
        power=sum(x.sum(0) for x in powers),
        bending_moment=moment,
        slip=slip,
        element_force=np.moveaxis(forces[0], -1, 0),
        element_power=np.moveaxis(powers[0], -1, 0),
        end_force=np.moveaxis(_by_end(problem, forces), -1, 0),
        end_power=np.moveaxis(_by_end(problem, powers), -1, 0),
    )


def _mean_slip(sides: Elements, v: tuple[np.ndarray, ...]) -> np.ndarray:
    """Return the mean over the body (B,) of the angles between its elements and their
    velocities (v_t, v_n, v_w)."""
    v_t, v_n, _ = v
    return np.average(np.arctan2(np.abs(v_n), np.abs(v_t)), 0, sides.half[:, 0])


def _by_end(problem: Problem, values: Sequence[np.ndarray]) -> np.ndarray:
    """Return sums (..., 2, B) over the points nearer to the tail and nearer to the
    head, from values (..., n, B) of the sides and of the points, if there are any."""
    of_points = values[0][..., :0, :]
    if len(values) > 1:
        of_points = values[1]
    is_at_head = problem.points.station[:, 0] > 0.5
    tail = of_points[..., ~is_at_head, :].sum(-2)
    head = of_points[..., is_at_head, :].sum(-2)
    return np.stack([tail, head], -2)


def _moments(
    sides: Elements, wrenches: np.ndarray, stations: np.ndarray, body_halves: np.ndarray
) -> np.ndarray:
    """Return the bending moments (B, n - 1) from the wrenches (3, k, B) on the frame
    that oppose the motion of elements.

    The bending moment at a point between two elements balances the moment about that
    point of the wrenches on all elements between it and the tail.
    """
    ends = np.cumsum(2 * sides.half[:, 0])
    # The piece before each point between elements of the body.
    joints = np.cumsum(2 * body_halves)[:-1]
    last = np.searchsorted(ends, joints - 1e-9 * body_halves[0])
    order = np.argsort(stations, kind="stable")
    cumulative = np.cumsum(wrenches[:, order], 1)
    f_x, f_y, moment = cumulative[:, np.searchsorted(stations[order], ends[last]) - 1]
    point = (sides.centres + sides.half * (sides.c + 1j * sides.s))[last]
    return (point.real * f_y - point.imag * f_x - moment).T
