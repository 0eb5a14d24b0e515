"""The geoms in the sand: those that a name, a pattern, a group or a body means, and what is left out of them."""

from __future__ import annotations

import difflib
import fnmatch
import itertools
from collections.abc import Iterable, Sequence

import mujoco
import numpy as np

from rft.core.refusal import Refusal, formatted, require
from rft.terradynamics.meshes.geoms import geom_kind, geom_label, geom_name, is_movable

SOLID = ("sphere", "ellipsoid", "cylinder", "capsule", "box", "mesh")
OVERLAP = 0.05  # depth, over the smaller geom's radius, from which an overlap is told
SHOWN = 3  # names in a note


def chosen_geoms(
    model: mujoco.MjModel, geoms: str | int | Sequence[str | int] | None
) -> tuple[list[int], list[str]]:
    """Return the numbers of the geoms in the sand, and notes about them.

    geoms: names of geoms or bodies, patterns such as "leg*" and groups, whole numbers; None for all that joints move.
    Geoms that can touch nothing, such as those that only show a robot's surface, are left out but where they are named
    one by one or where nothing else is meant. Refusal for unknown ones, those without an inside and those that nothing
    moves."""
    if geoms is None:
        found, left_out = _touching(model, _solid_ones(model))
        require(
            len(found) > 0,
            "the model has no geom that moves and has an inside",
            instead="give it joints",
        )
        return found, [_note_of_left_out(model, left_out)] if left_out else []
    given = [geoms] if isinstance(geoms, str | int) else geoms
    require(
        isinstance(given, Iterable),
        "``geoms`` must be names, patterns or groups",
        value=geoms,
    )
    found, left_out = [], []
    for one in given:
        means, rest = _matching(model, one)
        found += [g for g in means if g not in found]
        left_out += [g for g in rest if g not in left_out]
    require(len(found) > 0, "``geoms`` names none", value=geoms)
    for geom in found:
        _require_usable(model, geom)
    left_out = [g for g in left_out if g not in found]
    return found, [_note_of_left_out(model, left_out)] if left_out else []


def _solid_ones(model: mujoco.MjModel) -> list[int]:
    """Return the geoms that have an inside and that joints move."""
    return [
        g
        for g in range(model.ngeom)
        if is_movable(model, g) and geom_kind(model, g) in SOLID
    ]


def _touching(model: mujoco.MjModel, geoms: list[int]) -> tuple[list[int], list[int]]:
    """Return the geoms that can touch others, and the rest; all of them where none can."""
    can = [g for g in geoms if can_touch(model, g)]
    if not can:
        return geoms, []
    return can, [g for g in geoms if g not in can]


def can_touch(model: mujoco.MjModel, geom: int) -> bool:
    """Return whether the masks of a geom, or a <pair>, let it touch anything."""
    paired = geom in model.pair_geom1 or geom in model.pair_geom2
    return bool(model.geom_contype[geom] or model.geom_conaffinity[geom] or paired)


def _require_usable(model: mujoco.MjModel, geom: int) -> None:
    """Raise Refusal for a geom without an inside and for one that nothing moves."""
    name, kind = geom_label(model, geom), geom_kind(model, geom)
    require(
        kind in SOLID,
        f"the geom {name} is a {kind} and has no inside",
        instead=f"give a {', '.join(SOLID[:-1])} or {SOLID[-1]}",
    )
    require(
        is_movable(model, geom),
        f"the geom {name} is fixed to the world",
        instead="name geoms that move",
    )


def _matching(model: mujoco.MjModel, one: str | int) -> tuple[list[int], list[int]]:
    """Return the numbers of the geoms that a name, a pattern or a group means, and of those that are left out."""
    if isinstance(one, int) and not isinstance(one, bool):
        group = np.flatnonzero(model.geom_group == one)
        require(
            len(group) > 0,
            f"no geom is in group {one}",
            instead=f"groups are {sorted({*model.geom_group.tolist()})}",
        )
        return _movable(model, group.tolist())
    require(
        isinstance(one, str), "``geoms`` must be names, patterns or groups", value=one
    )
    names = {geom_name(model, g): g for g in range(model.ngeom)}
    if one in names:
        return [names[one]], []
    if matches := fnmatch.filter(names, one):
        return _movable(model, [names[name] for name in matches])
    bodies = _bodies(model)
    own = {bodies[name] for name in fnmatch.filter(bodies, one)}
    if own:
        geoms = [g for g in range(model.ngeom) if int(model.geom_bodyid[g]) in own]
        require(len(geoms) > 0, f"the body {formatted(one)} has no geom")
        return _movable(model, geoms)
    near = difflib.get_close_matches(one, [*names, *bodies], 3, 0.5)
    few = ", ".join(map(formatted, near or [*names][:8]))
    cure = (
        f"did you mean {few}?" if near else f"it has {few}" if names else "it has none"
    )
    raise Refusal(f"the model has no geom {formatted(one)}", instead=cure)


def _movable(model: mujoco.MjModel, geoms: list[int]) -> tuple[list[int], list[int]]:
    """Return those of geoms that move and can touch others, and those that cannot; all, where none moves."""
    able = [g for g in geoms if is_movable(model, g)]
    return _touching(model, able) if able else (geoms, [])


def _bodies(model: mujoco.MjModel) -> dict[str, int]:
    """Return the numbers of the named bodies but the world."""
    named = {
        mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, b): b
        for b in range(1, model.nbody)
    }
    return {name: b for name, b in named.items() if name}


def _note_of_left_out(model: mujoco.MjModel, left_out: list[int]) -> str:
    """Return the line about geoms that are not in the sand."""
    names = ", ".join(geom_label(model, g) for g in left_out[:1])
    more = f" and {len(left_out) - 1} more" if len(left_out) > 1 else ""
    return (
        f"the geom {names}{more}, which can touch nothing (contype = conaffinity = 0),"
        " is not in the sand: name it in geoms to have it there"
    )


def overlap_note(model: mujoco.MjModel, geoms: Sequence[int]) -> str:
    """Return a line about geoms of one body that overlap, or "" for none."""
    pairs = []
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    points = np.zeros(6)
    bodies = model.geom_bodyid
    for a, b in itertools.combinations(geoms, 2):
        if bodies[a] != bodies[b]:
            continue
        distance = mujoco.mj_geomDistance(model, data, a, b, 1.0, points)
        if distance < -OVERLAP * min(model.geom_rbound[[a, b]]):
            pairs.append((a, b))
    if not pairs:
        return ""
    names = ", ".join(
        f"{geom_label(model, a)} and {geom_label(model, b)}" for a, b in pairs[:SHOWN]
    )
    more = f" and {len(pairs) - SHOWN} more pairs" if len(pairs) > SHOWN else ""
    return (
        f"geoms of one body overlap, where the sand acts on both: {names}{more}; name"
        " those in ``geoms`` that are to be in the sand"
    )
