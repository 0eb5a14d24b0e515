"""The parts of elements below the surface, cut once a step, and their loads by the
velocities of their geoms.

By NumPy; `rft.mujoco.step.compiled_parts` defines `write_wrenches`, `write_slopes` and
`add_dampers` a second time for compiled code, eight elements at once. Wrenches are
forces and moments about the origins of geoms along the geoms' axes, twists velocities
and angular velocities there."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rft.terradynamics.ground import Ground
from rft.terradynamics.meshes.forces.blocks import Blocks
from rft.terradynamics.meshes.forces.contact import (
    Motion,
    Part,
    corner_heights,
    load,
    load_with_slopes,
    part_below,
    velocity_of_middle,
)
from rft.terradynamics.meshes.forces.law import Spatial
from rft.terradynamics.meshes.forces.zones import Place, Zones, share_in, share_of_part


class Frames(NamedTuple):
    """Where geoms are. up, ahead: (G, 3), directions along their axes. x, height: (G,),
    of their origins, m. turn: (G, 3, 3), from their axes to the world. place: (G, 3),
    m."""

    up: np.ndarray
    ahead: np.ndarray
    x: np.ndarray
    height: np.ndarray
    turn: np.ndarray
    place: np.ndarray


class Zone(NamedTuple):
    """The parts (T,) in one zone of the ground: its law and state, the parts, the geom
    of each, whether they are of sheets, and up, x and ahead of their geoms."""

    law: Spatial
    ground: Ground
    part: Part
    owner: np.ndarray
    sheet: np.ndarray
    motion: Motion


class Grains(NamedTuple):
    """What the loads of a step follow from, by zones."""

    zones: tuple[Zone, ...]


def cut(blocks: Blocks, laws, zones: Zones, ground: Ground, frames: Frames) -> Grains:
    """Return the parts of all elements below the surface."""
    motion = _motion_at_rest(frames, blocks.owner)
    under = np.flatnonzero(np.min(corner_heights(blocks.faces, motion), 0) < 0.0)
    owner = blocks.owner[under]
    face = type(blocks.faces)(*(x[under] for x in blocks.faces))
    motion = _motion_at_rest(frames, owner)
    part = part_below(face, corner_heights(face, motion))
    if len(laws) == 1:
        shares = [None]
    else:
        where = Place(np.moveaxis(frames.turn[owner], 0, -1), frames.place[owner].T)
        shares = [share_in(zones, zone, face, where) for zone in range(len(laws))]
    return Grains(
        tuple(
            Zone(
                law,
                ground._replace(grazing_sine=law.grazing_sine),
                part if share is None else share_of_part(part, share),
                owner,
                face.sheet > 0.0,
                motion,
            )
            for law, share in zip(laws, shares)
        )
    )


def _motion_at_rest(frames: Frames, owner: np.ndarray) -> Motion:
    """Return where the geoms of elements are, as a motion without velocity."""
    rest = (0.0, 0.0, 0.0)
    up, ahead = tuple(frames.up[owner].T), tuple(frames.ahead[owner].T)
    return Motion(rest, rest, frames.x[owner], up, ahead, frames.height[owner])


def _motion_of_parts(zone: Zone, rounding: float, twists: np.ndarray):
    """Return the ground at a rounding, and the velocities of the middles of parts."""
    own = twists[zone.owner].T
    motion = zone.motion._replace(velocity=tuple(own[:3]), spin=tuple(own[3:]))
    v = velocity_of_middle(zone.part, motion)
    return zone.ground._replace(rounding=rounding), motion, v


def _add_by_owner(out: np.ndarray, owner: np.ndarray, values) -> None:
    """Add values (..., T) of parts to those of their geoms (G, ...). owner: (T,), geom
    after geom."""
    if not len(owner):
        return
    begin = np.flatnonzero(np.diff(owner, prepend=-1))
    sums = np.add.reduceat(np.asarray(values), begin, axis=-1)
    out[owner[begin]] += np.moveaxis(sums, -1, 0)


def write_wrenches(grains, members, rounding, twists, wrenches) -> None:
    """Write the wrenches (G, 6) on geoms that move with twists (G, 6). members: (m,),
    geoms that are computed."""
    wrenches[:] = 0.0
    for zone in grains.zones:
        ground, motion, v = _motion_of_parts(zone, rounding, twists)
        f, m, _ = load(zone.law, ground, zone.part, motion, v, zone.sheet)
        _add_by_owner(wrenches, zone.owner, f + m)


def write_slopes(grains, members, rounding, twists, slopes) -> None:
    """Write the slopes (G, 6, 6) of the wrenches by the twists."""
    slopes[:] = 0.0
    for zone in grains.zones:
        ground, motion, v = _motion_of_parts(zone, rounding, twists)
        _, _, by_v, moment_by_v = load_with_slopes(
            zone.law, ground, zone.part, motion, v, zone.sheet
        )
        count = len(zone.owner)
        by_v = [[np.broadcast_to(x, count) for x in column] for column in by_v]
        moment = [[np.broadcast_to(x, count) for x in column] for column in moment_by_v]
        by_velocity = np.concatenate([by_v, moment], 1).swapaxes(0, 1)  # (6, 3, T)
        x = np.stack(np.broadcast_arrays(*zone.part.middle))
        by_spin = np.cross(np.broadcast_to(x, by_velocity.shape), by_velocity, axis=1)
        _add_by_owner(slopes, zone.owner, np.concatenate([by_velocity, by_spin], 1))


def add_dampers(grains, members, rounding, twists, dampers) -> None:
    """Add the slopes (G, 6, 6) of dampers that bear as much as the elements at their
    speeds."""
    for zone in grains.zones:
        ground, motion, v = _motion_of_parts(zone, rounding, twists)
        f, _, _ = load(zone.law, ground, zone.part, motion, v, zone.sheet)
        f, v = np.stack(np.broadcast_arrays(*f)), np.stack(v)
        size = np.sqrt((f**2).sum(0) / ((v**2).sum(0) + rounding**2))
        x = np.stack(np.broadcast_arrays(*zone.part.middle))
        lever = np.zeros((3, 6, x.shape[1]))  # velocity of the middle by the twist
        for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            lever[i, i] = 1.0
            lever[i, 3 + j], lever[i, 3 + k] = x[k], -x[j]
        _add_by_owner(
            dampers, zone.owner, np.einsum("t,cit,cjt->ijt", size, lever, lever)
        )
