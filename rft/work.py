"""What the medium does to a moving body, element by element: forces, power, internal moments."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rft.balance import checked_input
from rft.bodies.base import Body, Kinematics, checked_body, halves, pace
from rft.bodies.pieces import PIECES
from rft.contact import SIDE, Model
from rft.effects.base import Effect, broken, folded, pieced
from rft.media.base import Medium, real_array, require


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
    broken(effects)  # refuses what is no effect
    pieces_of = pieced(body, effects, pieces)
    model = folded(effects, medium, pieces_of, loads)
    alpha, alphadot = (x.reshape(-1, body.joints).T for x in (alpha, alphadot))
    xi = xi.reshape(-1, 3).T / np.array([[body.length], [body.length], [1.0]])
    speed = pace(body, alphadot)
    eps = regularisation * np.where(speed > 0, speed, 1.0)  # a body at rest: any will do
    done = done_by(model, halves(body), model.motions(pieces_of.motion(alpha, alphadot)), xi, eps)
    return Work(done.power.reshape(batch) * body.length, *(x.reshape((*batch, *x.shape[1:])) for x in done[1:]))


def done_by(model: Model, whole: np.ndarray, motions: dict[str, Kinematics], xi, eps) -> Work:
    """`Work` of B samples at body velocities xi (3, B), in body lengths.

    motions: kinematics of the elements of each contact, by its name. whole: half lengths of the body's own elements, of
    which those of the model may be pieces; bending moments are those between the body's own. eps: (B,), the speed below
    which dry friction is rounded off.
    """
    power, borne = 0.0, {}
    for name, contact in model.contacts.items():
        motion = motions[name]
        v = motion.v + motion.carried(xi)
        f = contact.load(*v, eps)[:, 0]
        power = power + (motion.weight * f * v).sum((0, 1))
        borne[name] = motion.wrenches(f)
        if name == SIDE:
            slip = np.average(np.arctan2(np.abs(v[1]), np.abs(v[0])), 0, motion.half[:, 0])
            borne[name] += sum(term.on_elements(xi, motion, v) for term in model.terms)
    return Work(power, _moments(model, motions, borne, whole), slip)


def _moments(model: Model, motions, borne: dict[str, np.ndarray], whole: np.ndarray) -> np.ndarray:
    """(B, n - 1) from the wrenches on the frame, (3, k, B) for each contact, that elements oppose to the motion.

    The medium pushes the other way. At a point between two elements the body must hold the tail's side, and pushes the
    head's side with the opposite: with the moment about that point of all that hangs on the tail's side.
    """
    side = motions[SIDE]
    ends = np.cumsum(2 * side.half[:, 0])
    last = np.searchsorted(ends, np.cumsum(2 * whole)[:-1] - 1e-9 * whole[0])  # piece on the tail's side of each point
    stations = np.concatenate([model.contacts[name].places(motions[name]) for name in borne])
    order = np.argsort(stations, kind="stable")
    so_far = np.cumsum(np.concatenate(list(borne.values()), 1)[:, order], 1)
    x, y, turn = so_far[:, np.searchsorted(stations[order], ends[last]) - 1]
    point = (side.place + side.half * (side.c + 1j * side.s))[last]
    return (point.real * y - point.imag * x - turn).T
