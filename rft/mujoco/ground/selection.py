"""The geoms in the sand: those that a name, a pattern, a group or a body means, and
those that are left out."""

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
OVERLAP = 0.05  # depth over the smaller geom's radius from which an overlap is noted
PAIRS_IN_NOTE = 3
NAMES_IN_CURE = 8


def choose_geoms(
    model: mujoco.MjModel, geoms: str | int | Sequence[str | int] | None
) -> tuple[list[int], list[str]]:
    """Return the numbers of the geoms in the sand, and notes about them.

    geoms: names of geoms or bodies, patterns such as "leg*" and groups, whole numbers;
    None for all that joints move. Geoms that can touch nothing, such as those that only
    show a robot's surface, are left out, unless they are named one by one or nothing
    else is meant. Refusal for unknown ones, those without an inside and those that
    nothing moves."""
    if geoms is None:
        chosen, left_out = _split_by_touch(model, _movable_solids(model))
        require(
            len(chosen) > 0,
            "no geom in the model is both solid and able to move",
            instead="give the model joints",
        )
        return chosen, _notes_on_left_out(model, left_out)

    words = [geoms] if isinstance(geoms, str | int) else geoms
    require(
        isinstance(words, Iterable),
        "``geoms`` must be names, patterns or groups",
        value=geoms,
    )
    chosen = []
    left_out = []
    for word in words:
        meant, without_touch = _geoms_of_word(model, word)
        chosen += [g for g in meant if g not in chosen]
        left_out += [g for g in without_touch if g not in left_out]
    require(len(chosen) > 0, "``geoms`` selects no geom", value=geoms)
    for geom in chosen:
        _require_usable(model, geom)
    left_out = [g for g in left_out if g not in chosen]
    return chosen, _notes_on_left_out(model, left_out)


def _movable_solids(model: mujoco.MjModel) -> list[int]:
    """Return the geoms that have an inside and that joints move."""
    return [
        g
        for g in range(model.ngeom)
        if is_movable(model, g) and geom_kind(model, g) in SOLID
    ]


def _split_by_touch(
    model: mujoco.MjModel, geoms: list[int]
) -> tuple[list[int], list[int]]:
    """Return the geoms that can touch others, and the rest; all of them, and none,
    where none can."""
    touching = [g for g in geoms if can_touch(model, g)]
    if not touching:
        return geoms, []
    return touching, [g for g in geoms if g not in touching]


def can_touch(model: mujoco.MjModel, geom: int) -> bool:
    """Return whether the masks of a geom, or a <pair>, let it touch anything."""
    paired = geom in model.pair_geom1 or geom in model.pair_geom2
    return bool(model.geom_contype[geom] or model.geom_conaffinity[geom] or paired)


def _require_usable(model: mujoco.MjModel, geom: int) -> None:
    """Raise Refusal for a geom without an inside and for one that nothing moves."""
    name, kind = geom_label(model, geom), geom_kind(model, geom)
    require(
        kind in SOLID,
        f"the geom {name} is a {kind}, which is not solid",
        instead=f"choose a {', '.join(SOLID[:-1])} or {SOLID[-1]}",
    )
    require(
        is_movable(model, geom),
        f"the geom {name} is fixed to the world",
        instead="choose geoms that move",
    )


def _geoms_of_word(
    model: mujoco.MjModel, word: str | int
) -> tuple[list[int], list[int]]:
    """Return the geoms that a name, a pattern or a group means, and those that are left
    out because they can touch nothing."""
    if isinstance(word, int) and not isinstance(word, bool):
        return _split_movable(model, _geoms_of_group(model, word))
    require(
        isinstance(word, str), "``geoms`` must be names, patterns or groups", value=word
    )
    geoms = {geom_name(model, g): g for g in range(model.ngeom)}
    if word in geoms:
        return [geoms[word]], []
    matches = fnmatch.filter(geoms, word)
    if matches:
        return _split_movable(model, [geoms[name] for name in matches])
    bodies = _named_bodies(model)
    matching_bodies = {bodies[name] for name in fnmatch.filter(bodies, word)}
    if matching_bodies:
        own = np.isin(model.geom_bodyid, [*matching_bodies])
        require(bool(own.any()), f"the body {formatted(word)} has no geom")
        return _split_movable(model, np.flatnonzero(own).tolist())
    raise Refusal(
        f"the model has no geom {formatted(word)}",
        instead=_cure_of_unknown(word, [*geoms], [*bodies]),
    )


def _geoms_of_group(model: mujoco.MjModel, group: int) -> list[int]:
    """Return the geoms of a group; Refusal for an empty one."""
    geoms = np.flatnonzero(model.geom_group == group)
    require(
        len(geoms) > 0,
        f"no geom is in group {group}",
        instead=f"the groups are {sorted({*model.geom_group.tolist()})}",
    )
    return geoms.tolist()


def _cure_of_unknown(word: str, geoms: list[str], bodies: list[str]) -> str:
    """Return the names that a user may have meant, or those that there are."""
    near = difflib.get_close_matches(word, [*geoms, *bodies], 3, 0.5)
    if near:
        return f"did you mean {', '.join(map(formatted, near))}?"
    if geoms:
        return f"the geoms are {', '.join(map(formatted, geoms[:NAMES_IN_CURE]))}"
    return "it has none"


def _split_movable(
    model: mujoco.MjModel, geoms: list[int]
) -> tuple[list[int], list[int]]:
    """Return those of geoms that move and can touch others, and those that move and
    cannot; all, and none, where none moves."""
    movable = [g for g in geoms if is_movable(model, g)]
    if not movable:
        return geoms, []
    return _split_by_touch(model, movable)


def _named_bodies(model: mujoco.MjModel) -> dict[str, int]:
    """Return the numbers of the bodies that have a name, without the world."""
    bodies = {}
    for body in range(1, model.nbody):
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, body)
        if name:
            bodies[name] = body
    return bodies


def _notes_on_left_out(model: mujoco.MjModel, left_out: list[int]) -> list[str]:
    """Return a list with a line about geoms that are not in the sand, empty for
    none."""
    if not left_out:
        return []
    name = geom_label(model, left_out[0])
    more = ""
    if len(left_out) > 1:
        more = f" and {len(left_out) - 1} more"
    return [
        f"the geom {name}{more}, which touches nothing (contype = conaffinity = 0), "
        "is not in the sand: list it in geoms to include it"
    ]


def overlap_note(model: mujoco.MjModel, geoms: Sequence[int]) -> str:
    """Return a line about geoms of one body that overlap, or "" for none."""
    pairs = _overlapping_pairs(model, geoms)
    if not pairs:
        return ""
    named = [
        f"{geom_label(model, a)} and {geom_label(model, b)}"
        for a, b in pairs[:PAIRS_IN_NOTE]
    ]
    more = ""
    if len(pairs) > PAIRS_IN_NOTE:
        more = f" and {len(pairs) - PAIRS_IN_NOTE} more pairs"
    return (
        "geoms of one body overlap, and the sand acts on both: "
        f"{', '.join(named)}{more}; list only the geoms that should be in the sand in "
        "``geoms``"
    )


def _overlapping_pairs(
    model: mujoco.MjModel, geoms: Sequence[int]
) -> list[tuple[int, int]]:
    """Return the pairs of geoms of one body that overlap by more than `OVERLAP`."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    bodies = model.geom_bodyid
    points = np.zeros(6)
    pairs = []
    for a, b in itertools.combinations(geoms, 2):
        if bodies[a] != bodies[b]:
            continue
        distance = mujoco.mj_geomDistance(model, data, a, b, 1.0, points)
        if distance < -OVERLAP * min(model.geom_rbound[[a, b]]):
            pairs.append((a, b))
    return pairs
