"""Force and moment of the grains on outlines that move in the vertical plane, for any
number of poses at once.

A pose is (x, z, angle) of the body's frame, a twist its rates (v_x, v_z, rate). With x
to the right and z up, the y axis points away from the observer. Angles, rates and
moments are about it and so are clockwise. A leg that points down and rotates at a
positive rate sweeps backwards and drives the body forwards. SI units.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rft.balance.backend import check, compiles
from rft.core.checks import real_array, unmasked
from rft.core.refusal import require
from rft.terradynamics.ground import Ground, GroundEffect, ground_of
from rft.terradynamics.plates.contact import (
    Element,
    Motion,
    Part,
    elements,
    leading_part,
    load,
    record,
    sides,
)
from rft.terradynamics.plates.outline import Outline
from rft.terradynamics.plates.stress import PlateStress

# Order of the error in 1 / elements, by `PlateStress.tension`: a cut jumps inside
# elements.
ORDER = {"keep": 2, "cut": 1}

CHUNK = 50_000  # elements times motions that are computed at once, for memory


class Loads(NamedTuple):
    """Loads of the grains on an outline. force: (..., 2) as (x, z), N. moment: (...,),
    N m, about the frame's origin.

    Examples
    --------
    >>> from rft.terradynamics.plates import RoundRod, StressMap, loads
    >>> rod = RoundRod(radius=0.01, width=0.1).outline(60)
    >>> load = loads(StressMap(), rod, [0.0, -0.05, 0.0], [0.01, 0.0, 0.0])
    >>> load.force.shape, bool(load.power([0.01, 0.0, 0.0]) < 0)  # W
    ((2,), True)
    """

    force: np.ndarray
    moment: np.ndarray

    def power(self, twist) -> np.ndarray:
        """Return the power (...,), W, of the grains on a body with twists (..., 3);
        negative where they dissipate."""
        twist = unmasked("twist", twist)
        power_of_force = (self.force * twist[..., :2]).sum(-1)
        return power_of_force + self.moment * twist[..., 2]


def loads(
    stress: PlateStress,
    outline: Outline,
    pose,
    twist,
    effects: Sequence[GroundEffect] = (),
    backend: str = "auto",
) -> Loads:
    """Return force and moment for poses (..., 3) and twists (..., 3) that broadcast
    together, on ground with effects.

    Each element is cut where it crosses the surface and where it begins to lead; the
    stress is that at the middle of the part which is below and leads. The error is of
    `ORDER` 2 in 1/elements, 1 where tension is cut. Without inertia of grains the force
    depends on the direction of the twist alone; at rest it is 0. backend: see
    `rft.balance.backend`.

    Examples
    --------
    >>> from rft.terradynamics.plates import RoundRod, StressMap, loads
    >>> rod = RoundRod(radius=0.01, width=0.1).outline(60)
    >>> load = loads(StressMap(), rod, pose=[0.0, -0.05, 0.0], twist=[0.01, 0.0, 0.0])
    >>> load.force.round(3)  # N, against the motion and up
    array([-40.866,  34.354])
    """
    check(backend)
    pose = _triples("pose", pose)
    twist = _triples("twist", twist)
    pose, twist = np.broadcast_arrays(pose, twist)
    shape = pose.shape[:-1]
    motions = motion(pose.reshape(-1, 3), twist.reshape(-1, 3))

    law = record(stress)
    grazing_sine = math.sin(stress.grazing) if outline.closed else 0.0
    ground = ground_of(effects, Ground(grazing_sine=grazing_sine))
    if compiles(backend, law):
        from rft.terradynamics.plates.compiled import sum_forces  # loads numba
    else:
        sum_forces = sum_forces_by_numpy
    summed_sides = sides(outline.closed, stress.tension)
    f_x, f_z, moment = sum_forces(law, ground, elements(outline), motions, summed_sides)
    force = np.stack([f_x, f_z], -1)
    return Loads(force.reshape(*shape, 2), moment.reshape(shape))


def sum_forces_by_numpy(
    law, ground: Ground, outline: Element, motions: Motion, sides: tuple[float, ...]
) -> np.ndarray:
    """Return (3, M): force (x, z), N, and moment, N m, on the elements (E,) of an
    outline in M motions, summed over the elements and the given sides of them."""
    count = len(motions.x)
    step = max(1, CHUNK // len(outline.area))
    out = np.zeros((3, count))
    for begin in range(0, count, step):
        chunk = slice(begin, begin + step)
        g = Motion(*(x[chunk, None] for x in motions))
        for side in sides:
            force = load(law, ground, outline, g, side, side != 0.0, False)
            out[:, chunk] += [component.sum(-1) for component in force]
    return out


def motion(pose: np.ndarray, twist: np.ndarray) -> Motion:
    """Return the motions (...,) of poses and twists (..., 3)."""
    x, z, angle = np.moveaxis(pose, -1, 0)
    return Motion(x, z, np.cos(angle), np.sin(angle), *np.moveaxis(twist, -1, 0))


def parts(outline: Outline, pose, twist, side: float = 1.0) -> Part:
    """Return the parts (..., E) of an outline's elements that are below the surface and
    lead.

    side: 1 for the faces along the normals, -1 for those against them, 0 for whichever
    lead.

    Examples
    --------
    >>> from rft.terradynamics.plates import Plate, parts
    >>> plate = Plate(length=0.04, width=0.02).outline(4)
    >>> parts(plate, [0.0, -0.05, 0.0], [0.0, -0.01, 0.0]).area  # m^2, of each element
    array([0.0002, 0.0002, 0.0002, 0.0002])
    """
    motions = motion(_triples("pose", pose), _triples("twist", twist))
    g = Motion(*(x[..., None] for x in motions))
    return leading_part(elements(outline), g, side, side != 0.0)


def _triples(name: str, values) -> np.ndarray:
    """Return poses or twists as an array (..., 3); ValueError unless they are finite
    numbers of that shape."""
    values = real_array(name, values)
    require(
        values.ndim > 0 and values.shape[-1] == 3,
        f"{name} must have shape (..., 3)",
        value=values.shape,
    )
    require(bool(np.isfinite(values).all()), f"{name} must be finite")
    return values
