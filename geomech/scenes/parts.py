"""Scenes from a name, a file, a scene, or parts in any order."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from geomech.mathematics.gaits import Circle, Gait, Wave
from geomech.mathematics.systems.base import System, as_system
from geomech.mathematics.systems.swimmer import Swimmer
from geomech.scenes.model import Scene
from geomech.scenes.read import load, medium_of
from rft.core.refusal import Refusal, formatted

FORMS = (
    "give the name of a scene, a TOML file, a Scene, (medium, body, gait), "
    "(system, gait), or a function velocity(alpha, alphadot)"
)
MOST_JOINTS = 12  # of a system for which a wave is the default gait
PART_WIDTH = 24  # letters that a refusal prints of each part


def as_scene(
    *parts: Any, effects: Sequence = (), joints: int | None = None, **numerics: Any
) -> Any:
    """Return a scene from a name, a file or a scene, from an object that has a
    ``scene``, or from parts.

    Parts are a medium and a body, or a system, or a function velocity(alpha, alphadot),
    and a gait, in any order; they may be in a tuple. A medium may be its name or its
    file. Without a gait two joints run a circle of 1 rad, and other bodies of few
    joints a wave of 0.5 rad. effects: of a medium and a body. joints: of a velocity
    without a gait, 2 if left out. numerics: in place of the scene's [numerics]. Refusal
    for anything else."""
    if len(parts) == 1 and isinstance(parts[0], tuple):
        parts = parts[0]
    scene = None
    if len(parts) == 1:
        scene = _scene_of(parts[0])
    if scene is None:
        scene = _assemble(parts, tuple(effects), joints)
    elif joints is not None:
        raise Refusal("``joints`` applies only to a velocity", instead="leave it out")
    elif effects:
        raise Refusal(
            "effects apply only to a medium and a body",
            instead="add [[effects]] to the scene",
        )
    if numerics:
        return scene.with_numerics(**numerics)
    return scene


def _scene_of(part: Any) -> Any:
    """Return the scene that a single argument names, is or has; None for a part of
    one."""
    if isinstance(part, (str, Path)):
        return load(part)
    part = getattr(part, "scene", part)
    # Scenes of all kinds, with a gait or without, have an example.
    return part if hasattr(type(part), "example") else None


def _assemble(parts: Sequence, effects: tuple, joints: int | None) -> Scene:
    """Return the scene of a medium and a body, or a system or velocity, and a gait if
    there is one."""
    gaits = []
    media = []
    bodies = []
    others = []
    for part in parts:
        if _is_gait(part):
            gaits.append(part)
        if _is_medium(part):
            media.append(part)
        if _is_body(part):
            bodies.append(part)
        if not (_is_gait(part) or _is_medium(part) or _is_body(part)):
            others.append(part)
    media = [medium_of(x) if isinstance(x, (str, Path)) else x for x in media]
    counts = (len(media), len(bodies), len(others))
    if counts == (1, 1, 0) and len(gaits) <= 1:
        if joints is not None:
            raise Refusal(
                "``joints`` applies only to a velocity", instead="leave it out"
            )
        system: System = Swimmer(media[0], bodies[0], effects)
    elif counts == (0, 0, 1) and len(gaits) <= 1 and not effects and _moves(others[0]):
        system = as_system(others[0], _joints_of(others[0], gaits, joints))
        if joints not in (None, system.joints):
            raise Refusal(
                f"``joints`` is {joints}, but the velocity has {system.joints}",
                instead="leave it out",
            )
    else:
        listed = ", ".join(formatted(part, PART_WIDTH) for part in parts) or "nothing"
        raise Refusal(f"{listed} do not form a scene", instead=FORMS)
    gait = gaits[0] if gaits else _default_gait(system.joints)
    return Scene(system, gait)


def _joints_of(velocity: Any, gaits: Sequence, joints: int | None) -> int:
    """Return the number of joints of a velocity: ``joints``, or that of its gait, or 2.
    Refusal for a velocity without either that takes another number."""
    if joints is not None:
        return joints
    if gaits:
        return gaits[0].joints
    if hasattr(velocity, "joints") or _takes(velocity, 2):
        return 2
    for n in range(1, MOST_JOINTS + 1):
        if _takes(velocity, n):
            raise Refusal(
                f"the velocity needs {n} joints",
                because="without a gait two joints are assumed",
                instead=f"give ``joints`` = {n}, or a gait",
            )
    return 2


def _takes(velocity: Any, joints: int) -> bool:
    """Return whether a velocity takes shapes of a number of joints."""
    function = getattr(velocity, "velocity", velocity)
    alpha = np.full(joints, 0.1)
    try:
        return np.shape(function(alpha, alpha.copy())) == (3,)
    except Exception:  # a custom function may raise any error
        return False


def _is_gait(part: Any) -> bool:
    if isinstance(part, Gait):
        return True
    return hasattr(part, "joints") and hasattr(part, "cycle")


def _is_medium(part: Any) -> bool:
    return isinstance(part, (str, Path)) or hasattr(part, "traction")


def _is_body(part: Any) -> bool:
    return all(hasattr(part, name) for name in ("joints", "length", "motion"))


def _moves(part: Any) -> bool:
    return not isinstance(part, type) and callable(getattr(part, "velocity", part))


def _default_gait(joints: int) -> Gait:
    """Return the gait of a system without one."""
    if joints > MOST_JOINTS:
        raise Refusal(
            f"no default gait exists for a body of {joints} joints",
            instead="give a gait such as Wave or Sine",
        )
    if joints == 2:
        return Circle()
    return Wave(joints=joints)
