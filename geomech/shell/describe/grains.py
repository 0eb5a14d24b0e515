"""Scenes of bodies in grains, in lines."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from geomech.core.summary import effect_lines, part
from rft.core.refusal import in_line
from rft.terradynamics.ground import GROUND_EFFECTS

if TYPE_CHECKING:
    from geomech.scenes.terradynamics.intruding import Intruding
    from geomech.scenes.terradynamics.walker import WalkerScene


def scene_lines(scene: Intruding | WalkerScene) -> list[str]:
    """Return lines on the body and its motion, or the robot, its gait and its engine;
    on the medium; and on the effects that are on and off."""
    name = in_line(scene.name)
    if hasattr(scene, "robot"):
        # Only here: the mechanics of robots takes long to load.
        from geomech.scenes.terradynamics.walker import KINDS

        lines = [
            f"{name}: {named_part(scene.robot)}",
            f"gait: {named_part(scene.gait)}",
            f"medium: {named_part(scene.medium)}",
            f"engine: {scene.engine}",
        ]
        possible = sorted(KINDS)
    else:
        body = f"{named_part(scene.intruder)} of {scene.count:,} {scene.parts}"
        lines = [
            f"{name}: {body}",
            f"motion: {named_part(scene.motion)}",
            f"medium: {named_part(scene.medium)}",
        ]
        possible = [*GROUND_EFFECTS]
    used = {effect.kind for effect in scene.effects}
    off = [kind for kind in possible if kind not in used]
    return [
        *lines,
        *effect_lines(scene.effects),
        f"off (not evaluated): {', '.join(off) or 'none'}",
    ]


def named_part(thing: Any) -> str:
    """Return a part of a scene by the name of its class."""
    return part(type(thing).__name__, thing)
