"""Force and moment of the grains on outlines that move in the vertical plane, for any number of poses at once.

A pose is (x, z, angle) of the body's frame, a twist (v_x, v_z, rate). Angles, rates and moments are about the y axis that
points away from one who sees x to the right and z up: clockwise there, so a leg that points down and turns at a positive
rate sweeps backwards and drives the body forwards. SI units.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rft.balance.backend import check, compiles
from rft.checks import real_array, require
from rft.ground import Ground, GroundEffect, ground_of
from rft.plates.contact import Element, Motion, Part, elements, leading_part, load, record, sides
from rft.plates.outline import Outline
from rft.plates.stress import PlateStress

ORDER = {"keep": 2, "cut": 1}  # of the error in 1 / elements, by `PlateStress.tension`: a cut jumps inside an element

TOGETHER = 50_000  # parts that are computed at once, for memory


class Loads(NamedTuple):
    """force: (..., 2) as (x, z), N. moment: (...,), N m, about the frame's origin."""

    force: np.ndarray
    moment: np.ndarray

    def power(self, twist) -> np.ndarray:
        """(...,), W, of the grains on the body; negative where they take it."""
        twist = np.asarray(twist, float)
        return (self.force * twist[..., :2]).sum(-1) + self.moment * twist[..., 2]


def loads(
    stress: PlateStress,
    outline: Outline,
    pose,
    twist,
    effects: Sequence[GroundEffect] = (),
    backend: str = "auto",
) -> Loads:
    """Net force and moment for poses (..., 3) and twists (..., 3) that broadcast together, on ground with effects.

    Midpoints of the parts that are below the surface and lead, each element cut where it crosses the surface and where it
    begins to lead: of `ORDER` 2 in 1/elements, 1 where tension is cut. Without inertia of grains the force depends on the
    direction of the twist alone; it is nothing at rest. backend: see `rft.balance.backend`.
    """
    check(backend)
    pose, twist = np.broadcast_arrays(_triples("pose", pose), _triples("twist", twist))
    shape, law, parts = pose.shape[:-1], record(stress), elements(outline)
    ground = ground_of(effects, Ground(sine=math.sin(stress.grazing) if outline.closed else 0.0))
    motions = motion(pose.reshape(-1, 3), twist.reshape(-1, 3))
    if compiles(backend, law):
        from rft.plates.compiled import summed
    else:
        summed = summed_by_numpy
    force = summed(law, ground, parts, motions, sides(outline.closed, stress.tension))
    return Loads(np.moveaxis(force[:2], 0, -1).reshape(*shape, 2), force[2].reshape(shape))


def summed_by_numpy(law, ground: Ground, parts: Element, motions: Motion, sides: tuple[float, ...]) -> np.ndarray:
    """Return (3, M): force (x, z) and moment of the elements, (E,), on these sides, in each of M motions."""
    size, together = len(motions.x), max(1, TOGETHER // len(parts.area))
    out = np.zeros((3, size))
    for begin in range(0, size, together):
        some = slice(begin, begin + together)
        at = Motion(*(x[some, None] for x in motions))
        for side in sides:
            out[:, some] += [x.sum(-1) for x in load(law, ground, parts, at, side, side != 0.0, False)]
    return out


def motion(pose: np.ndarray, twist: np.ndarray) -> Motion:
    """Return the motions, (...,), of poses and twists (..., 3)."""
    x, z, angle = np.moveaxis(pose, -1, 0)
    return Motion(x, z, np.cos(angle), np.sin(angle), *np.moveaxis(twist, -1, 0))


def parts(outline: Outline, pose, twist, side: float = 1.0) -> Part:
    """Return what of the outline is below the surface and leads; arrays (..., E)."""
    at = motion(_triples("pose", pose), _triples("twist", twist))
    return leading_part(elements(outline), Motion(*(x[..., None] for x in at)), side, side != 0.0)


def _triples(name: str, values) -> np.ndarray:
    values = real_array(name, values)
    require(values.ndim > 0 and values.shape[-1] == 3, f"{name} must have shape (..., 3), got {values.shape}")
    require(bool(np.isfinite(values).all()), f"{name} must be finite")
    return values
