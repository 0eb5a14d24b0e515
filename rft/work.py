"""What the medium does to a moving body, element by element: forces, power, internal moments."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rft.balance import checked_input
from rft.balance.arrays import loads as loads_on
from rft.balance.arrays import moved, velocities
from rft.balance.newton import times, to_frame
from rft.bodies.base import Body, Elements, checked_body, half_lengths, joint_speed
from rft.bodies.pieces import PIECES
from rft.checks import real_array, require
from rft.contact import Problem, assemble
from rft.effects.base import Effect, broken_premises
from rft.laws.base import Medium
from rft.momentum import on_elements
from rft.premise import SHAPE_ALONE


class Work(NamedTuple):
    """power: (...), rate of work against the medium, >= 0, in units of (the whole body's axial drag) x (length / time).
    bending_moment: (..., n - 1), at the points between the n elements: what holds against the medium, and moves the
    mass where the body has any, in axial drag x body length: positive where the body works to bend to the left
    (counter-clockwise, tail to head), as muscles on its left side do; bending_moment . d(bend)/dt x length sums to the
    power, with mass in the mean over a cycle that repeats. slip: (...), mean over the body of the angle between an
    element's direction and the velocity of its centre, 0 to pi/2 rad."""

    power: np.ndarray
    bending_moment: np.ndarray
    slip: np.ndarray

    def __repr__(self) -> str:
        names = zip(("power", "bending moment", "slip"), self)
        sizes = [f"{name} {np.min(x):.3g} to {np.max(x):.3g}" for name, x in names if np.size(x)]
        return f"Work({np.shape(self.power)} samples of {np.shape(self.bending_moment)[-1]} joints; {', '.join(sizes)})"


def work_done(
    medium: Medium,
    body: Body,
    alpha,
    alphadot,
    xi,
    *,
    loads: str = "exact",
    regularisation: float = 1e-6,
    effects: Sequence[Effect] = (),
    pieces: int = PIECES,
) -> Work:
    """Power and internal moments for body velocities xi (..., 3) that `body_velocity` gave for the same arguments."""
    checked_body(body)
    alpha, alphadot = checked_input(body, alpha, alphadot, regularisation, 1.0)
    batch, xi = alpha.shape[:-1], real_array("xi", xi)
    require(xi.shape == (*batch, 3), f"xi must have shape {(*batch, 3)} for these alpha and alphadot, got {xi.shape}")
    broken_premises(effects)  # refuses what is no effect
    assembly = assemble(medium, body, effects, loads, pieces)
    assembly = assembly._replace(effects=tuple(e for e in assembly.effects if not e.breaks & SHAPE_ALONE))
    alpha, alphadot = (x.reshape(-1, body.joints).T for x in (alpha, alphadot))
    xi = xi.reshape(-1, 3).T / np.array([[body.length], [body.length], [1.0]])
    problem, speed = assembly.at(alpha, alphadot), joint_speed(body, alphadot)
    scale = np.where(speed > 0, speed, 1.0)  # a body at rest: any will do
    problem = assembly.rescaled(problem, scale)
    done = done_by(problem, half_lengths(body), xi, regularisation * scale)
    return Work(done.power.reshape(batch) * body.length, *(x.reshape((*batch, *x.shape[1:])) for x in done[1:]))


def done_by(problem: Problem, whole: np.ndarray, xi: np.ndarray, rounding: np.ndarray) -> Work:
    """Return the work of B samples at body velocities xi (3, B), in body lengths.

    whole: (n,), half lengths of the body's own elements, of which those of the problem may be pieces; bending moments
    are those between the body's own. rounding: (B,), the speed below which dry friction is rounded off."""
    scale = problem.frame.speed
    v = moved(problem, velocities(problem), *(xi / scale))
    power, borne, stations = 0.0, [], []
    for (e, load), u, contact in zip(loads_on(problem, v, rounding / scale[0]), v, (problem.sides, problem.points)):
        force = [e.weight * x for x in (load.t, load.n, load.w)]
        weight = [e.weight * contact.incline.weight * x for x in (contact.incline.down_t, contact.incline.down_n)]
        on_ground = force[0] + weight[0], force[1] + weight[1], force[2]  # gravity's power is none of the ground's
        power = power + sum(f * scale * x for f, x in zip(on_ground, u)).sum(0)
        borne.append(np.stack(np.broadcast_arrays(*to_frame(e, *force))))
        stations.append(contact.station[:, 0])
    e, (v_t, v_n, _) = problem.sides.elements, v[0]
    slip = np.average(np.arctan2(np.abs(v_n), np.abs(v_t)), 0, e.half[:, 0])
    if problem.momenta is not None:
        borne[0] = borne[0] + on_elements(e, problem.momenta, times(scale, v[0]))
    return Work(power, _moments(e, np.concatenate(borne, 1), np.concatenate(stations), whole), slip)


def _moments(sides: Elements, borne: np.ndarray, stations: np.ndarray, whole: np.ndarray) -> np.ndarray:
    """Return the bending moments (B, n - 1) from the wrenches (3, k, B) on the frame that elements oppose to the
    motion.

    The medium pushes the other way. At a point between two elements the body must hold the tail's side, and pushes the
    head's side with the opposite: with the moment about that point of all that is attached on the tail's side.
    """
    ends = np.cumsum(2 * sides.half[:, 0])
    last = np.searchsorted(ends, np.cumsum(2 * whole)[:-1] - 1e-9 * whole[0])  # piece on the tail's side of each point
    order = np.argsort(stations, kind="stable")
    so_far = np.cumsum(borne[:, order], 1)
    x, y, turn = so_far[:, np.searchsorted(stations[order], ends[last]) - 1]
    point = (sides.centres + sides.half * (sides.c + 1j * sides.s))[last]
    return (point.real * y - point.imag * x - turn).T
