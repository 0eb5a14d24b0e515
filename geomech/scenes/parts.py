"""Scenes from whatever a caller has: a name, a file, a scene, or the parts of one in any order."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from geomech.gaits import Circle, Gait, Wave
from geomech.scenes.model import Scene
from geomech.scenes.read import load, medium_of
from geomech.systems.base import System, as_system
from geomech.systems.swimmer import Swimmer
from rft.core.refusal import Refusal, formatted

FORMS = (
    "give the name of a scene, a TOML file, a Scene, (medium, body, gait), (system, gait), or a function "
    "velocity(alpha, alphadot)"
)
JOINTS = 12  # up to which a wave is the gait of a system without one
LONG = 24  # letters that a refusal prints of each part


def as_scene(
    *parts: Any, effects: Sequence = (), joints: int | None = None, **numerics: Any
) -> Any:
    """Return a scene from a name, a file or a scene, from an object that has a ``scene``, or from parts.

    Parts are a medium and a body, or a system, or a function velocity(alpha, alphadot), and a gait, each by its kind; a
    tuple stands for its members. A medium may be its name or its file. Without a gait two joints run a circle of 1 rad,
    and other bodies of few joints a wave of 0.5 rad. effects: of a medium and a body. joints: of a velocity that comes
    without a gait, 2 if left out. numerics: other [numerics]. Refusal for anything else."""
    if len(parts) == 1 and isinstance(parts[0], tuple):
        parts = parts[0]
    scene = _whole(parts[0]) if len(parts) == 1 else None
    if scene is None:
        scene = _assembled(parts, tuple(effects), joints)
    elif joints is not None:
        raise Refusal("``joints`` are those of a velocity", instead="drop it")
    elif effects:
        raise Refusal(
            "effects are those of a medium and a body",
            instead="add [[effects]] to the scene",
        )
    return scene.with_numerics(**numerics) if numerics else scene


def _whole(part: Any) -> Any:
    """Return the scene that a single argument names, is or has; None for a part of one."""
    if isinstance(part, (str, Path)):
        return load(part)
    part = getattr(part, "scene", part)
    return (
        part if hasattr(type(part), "example") else None
    )  # of any kind, with a gait or without


def _assembled(parts: Sequence, effects: tuple, joints: int | None) -> Scene:
    """Return the scene of a medium and a body, a system or a velocity, and a gait where there is one."""
    gaits = [p for p in parts if _is_gait(p)]
    media = [
        medium_of(p) if isinstance(p, (str, Path)) else p
        for p in parts
        if _is_medium(p)
    ]
    bodies = [p for p in parts if _is_body(p)]
    others = [p for p in parts if not (_is_gait(p) or _is_medium(p) or _is_body(p))]
    if (len(media), len(bodies), len(others)) == (1, 1, 0) and len(gaits) <= 1:
        if joints is not None:
            raise Refusal("``joints`` are those of a velocity", instead="drop it")
        system: System = Swimmer(media[0], bodies[0], effects)
    elif (
        (media, bodies, effects) == ([], [], ())
        and len(others) == 1
        and len(gaits) <= 1
        and _moves(others[0])
    ):
        system = as_system(others[0], _joints_of(others[0], gaits, joints))
        if joints not in (None, system.joints):
            raise Refusal(
                f"``joints`` is {joints}, but the velocity has {system.joints}",
                instead="drop it",
            )
    else:
        given = ", ".join(formatted(p, LONG) for p in parts) or "nothing"
        raise Refusal(f"no scene of {given}", instead=FORMS)
    return Scene(system, gaits[0] if gaits else _usual_gait(system.joints))


def _joints_of(velocity: Any, gaits: Sequence, joints: int | None) -> int:
    """Return the number of joints of a velocity: the given one, that of its gait, or 2.
    Refusal if it takes no two, but another number."""
    if joints is not None or gaits:
        return gaits[0].joints if joints is None else joints
    if hasattr(velocity, "joints") or _takes(velocity, 2):
        return 2
    others = [n for n in range(1, JOINTS + 1) if _takes(velocity, n)]
    if others:
        raise Refusal(
            f"the velocity takes {others[0]} joints",
            because="without a gait it is taken for one of two",
            instead=f"give ``joints`` = {others[0]}, or a gait",
        )
    return 2


def _takes(velocity: Any, joints: int) -> bool:
    """Return whether a velocity takes a shape of so many joints."""
    function = getattr(velocity, "velocity", velocity)
    alpha = np.full(joints, 0.1)
    try:
        return np.shape(function(alpha, alpha.copy())) == (3,)
    except Exception:  # whatever a function of somebody else raises
        return False


def _is_gait(part: Any) -> bool:
    return isinstance(part, Gait) or (
        hasattr(part, "joints") and hasattr(part, "cycle")
    )


def _is_medium(part: Any) -> bool:
    return isinstance(part, (str, Path)) or hasattr(part, "traction")


def _is_body(part: Any) -> bool:
    return all(hasattr(part, name) for name in ("joints", "length", "motion"))


def _moves(part: Any) -> bool:
    return not isinstance(part, type) and callable(getattr(part, "velocity", part))


def _usual_gait(joints: int) -> Gait:
    """Return the gait of a system that comes without one."""
    if joints > JOINTS:
        raise Refusal(
            f"a body of {joints} joints has no usual gait",
            instead="give one, such as Wave or Sine",
        )
    return Circle() if joints == 2 else Wave(joints=joints)
