"""Force and moment of the grains on outlines that move in the vertical plane (Eq. 4), for any number of poses at once.

A pose is (x, z, angle) of the body's frame, a twist (v_x, v_z, rate). Angles, rates and moments are about the y axis that
points away from one who sees x to the right and z up: clockwise there, so a leg that points down and turns at a positive
rate sweeps backwards and drives the body forwards. SI units.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rft.media.base import real_array, require
from rft.vertical.outline import Outline
from rft.vertical.stress import PlateStress

ORDER = {"keep": 2, "cut": 1}  # of the error in 1 / elements, by `PlateStress.tension`: a cut jumps inside an element

TOGETHER = 50_000  # parts that are computed at once, for memory


class Parts(NamedTuple):
    """What of each element is below the surface and leads; arrays (..., N), pairs of them as (x, z).

    x: of the part's middle, m. arm: from the frame's origin to it, m. depth: of it, m, 0 if there is no such part. area: m^2,
    counting a grazing face by its share. n, v: unit normal, of either side where both are one part, and unit velocity.
    speed: m/s.
    """

    x: np.ndarray
    arm: tuple[np.ndarray, np.ndarray]
    depth: np.ndarray
    area: np.ndarray
    n: tuple[np.ndarray, np.ndarray]
    v: tuple[np.ndarray, np.ndarray]
    speed: np.ndarray


class Loads(NamedTuple):
    """force: (..., 2) as (x, z), N. moment: (...,), N m, about the frame's origin."""

    force: np.ndarray
    moment: np.ndarray

    def power(self, twist) -> np.ndarray:
        """(...,), W, of the grains on the body; negative where they take it."""
        twist = np.asarray(twist, float)
        return (self.force * twist[..., :2]).sum(-1) + self.moment * twist[..., 2]


def loads(stress: PlateStress, outline: Outline, pose, twist) -> Loads:
    """Net force and moment for poses (..., 3) and twists (..., 3) that broadcast together.

    Midpoints of the parts that are below the surface and lead, each element cut where it crosses the surface and where it
    begins to lead: of `ORDER` 2 in 1/elements, 1 where tension is cut. The force depends on the direction of the twist
    alone, and is nothing at rest.
    """
    pose, twist = np.broadcast_arrays(_triples("pose", pose), _triples("twist", twist))
    shape, pose, twist = pose.shape[:-1], pose.reshape(-1, 3), twist.reshape(-1, 3)
    force, moment, together = np.empty((len(pose), 2)), np.empty(len(pose)), max(1, TOGETHER // outline.elements)
    for begin in range(0, len(pose), together):
        some = slice(begin, begin + together)
        force[some], moment[some] = _loads(stress, outline, pose[some], twist[some])
    return Loads(force.reshape(*shape, 2), moment.reshape(shape))


def _loads(stress: PlateStress, outline: Outline, pose, twist) -> Loads:
    """The sum over the outline's sides."""
    grazing = stress.grazing if outline.closed else 0.0
    found = []
    for side in _sides(stress, outline):
        here = parts(outline, pose, twist, side, grazing)
        found.append(net(here, stress.on(here)))
    return Loads(*map(sum, zip(*found)))


def _sides(stress: PlateStress, outline: Outline) -> tuple[int, ...]:
    """The faces to sum: the outer one; both of a sheet at once (0), or one by one where it matters which leads."""
    if outline.closed:
        return (1,)
    return (0,) if stress.tension == "keep" else (1, -1)


def net(here: Parts, traction) -> Loads:
    """Sums over the elements, for any stress on the parts."""
    f_x, f_z = here.area * traction[0], here.area * traction[1]
    moment = (here.arm[1] * f_x - here.arm[0] * f_z).sum(-1)
    return Loads(np.stack([f_x.sum(-1), f_z.sum(-1)], -1), moment)


def parts(outline: Outline, pose, twist, side: int = 1, grazing: float = 0.0) -> Parts:
    """What of the outline is below the surface and leads. side: 1 for faces along the normals, -1 against them, 0 for
    whichever leads. grazing: see `PlateStress`."""
    r, z, v, n = _moved(outline, _triples("pose", pose), _triples("twist", twist))
    first, last = _below(z[..., :-1], z[..., 1:])
    if side:
        across = [n[k][0] * v[0][..., at] + n[k][1] * v[1][..., at] for k, at in ((0, slice(-1)), (1, slice(1, None)))]
        begins, stops = _below(-side * across[0], -side * across[1])
        first, last = np.maximum(first, begins), np.minimum(last, stops)
    part, middle = np.maximum(last - first, 0.0), (first + last) / 2
    at = lambda y: y[..., :-1] + middle * (y[..., 1:] - y[..., :-1])
    arm, n, v = (at(r[0]), at(r[1])), _normal(n, middle, side), (at(v[0]), at(v[1]))
    speed = np.sqrt(v[0] * v[0] + v[1] * v[1])
    still = speed == 0.0
    per = 1.0 / np.where(still, 1.0, speed)
    area = outline.width * outline.lengths * part
    if grazing and side:
        area = area * _risen(across, first, last, side * per / np.sin(grazing))
    depth = np.where((part > 0.0) & ~still, -at(z), 0.0)
    return Parts(np.asarray(pose, float)[..., :1] + arm[0], arm, depth, area, n, (v[0] * per, v[1] * per), speed)


def _moved(outline: Outline, pose, twist):
    """Arms from the origin, heights and velocities of the points (..., N + 1); normals at both ends of the elements."""
    pose, twist = pose[..., None], twist[..., None]
    turn = np.cos(pose[..., 2, :]), np.sin(pose[..., 2, :])
    r = _turned(_pair(outline.points), turn)
    v = twist[..., 0, :] + twist[..., 2, :] * r[1], twist[..., 1, :] - twist[..., 2, :] * r[0]
    if outline.bends is None:
        n = (_turned(_pair(outline.normals), turn),) * 2
    else:
        n = tuple(_turned(_pair(outline.bends[..., k, :]), turn) for k in (0, 1))
    return r, r[1] + pose[..., 1, :], v, n


def _triples(name: str, values) -> np.ndarray:
    values = real_array(name, values)
    require(values.ndim > 0 and values.shape[-1] == 3, f"{name} must have shape (..., 3), got {values.shape}")
    require(bool(np.isfinite(values).all()), f"{name} must be finite")
    return values


def _pair(vectors):
    """(x, z) of vectors (..., 2)."""
    return vectors[..., 0], vectors[..., 1]


def _turned(vectors, turn):
    """(x, z), each (..., N), by angles (..., 1) about y."""
    cos, sin = turn
    return cos * vectors[0] + sin * vectors[1], cos * vectors[1] - sin * vectors[0]


def _below(start, end):
    """First and last place, of 0 to 1 along an element, where what runs straight from start to end is negative; first > last
    where nothing is."""
    fall = start - end
    zero = start / np.where(fall == 0.0, 1.0, fall)
    return (
        np.where(start < 0.0, 0.0, np.where(end < 0.0, zero, 1.0)),
        np.where(end < 0.0, 1.0, np.where(start < 0.0, zero, 0.0)),
    )


def _normal(n, middle, side: int):
    """The unit normal there, between those of the ends."""
    sign = side or 1
    if n[0] is n[1]:
        return sign * n[0][0], sign * n[0][1]
    x, z = (a + middle * (b - a) for a, b in zip(*n))
    per = sign / np.sqrt(x * x + z * z)
    return x * per, z * per


def _risen(ends, first, last, scale):
    """Mean over a part of the share of the stress on a face, which rises as its speed across does, times ``scale``, to 1."""
    a, b = (np.maximum((ends[0] + t * (ends[1] - ends[0])) * scale, 0.0) for t in (first, last))
    whole = lambda y: np.where(y < 1.0, y * y / 2, y - 0.5)  # the integral of the share
    step = b - a
    flat = np.abs(step) < 1e-6
    return np.where(flat, np.minimum((a + b) / 2, 1.0), (whole(b) - whole(a)) / np.where(flat, 1.0, step))
