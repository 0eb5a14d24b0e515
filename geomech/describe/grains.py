"""Scenes of bodies in grains, in lines."""

from __future__ import annotations

from typing import TYPE_CHECKING

from geomech.core.summary import effect_lines, part
from rft.core.refusal import in_line
from rft.terradynamics.ground import GROUND_EFFECTS

if TYPE_CHECKING:
    from geomech.scenes.intruding import Intruding
    from geomech.scenes.walker import WalkerScene


def described(scene: Intruding | WalkerScene) -> list[str]:
    """Return lines on the law, the body and its motion, or the robot, its clock and the engine, and which effects are on and
    off."""
    walks = hasattr(scene, "robot")
    body, motion = (
        (scene.robot, scene.gait) if walks else (scene.intruder, scene.motion)
    )
    body, moves, medium = (
        part(type(x).__name__, x) for x in (body, motion, scene.medium)
    )
    lines = [f"gait: {moves}" if walks else f"motion: {moves}", f"medium: {medium}"]
    lines += [f"engine: {scene.engine}"] if walks else []
    known = (
        sorted(kind for kind, effect in GROUND_EFFECTS.items() if effect.walks)
        if walks
        else GROUND_EFFECTS
    )
    off = [kind for kind in known if kind not in [e.kind for e in scene.effects]]
    return [
        f"{in_line(scene.name)}: {body}"
        + ("" if walks else f" of {scene.count:,} {scene.parts}"),
        *lines,
        *effect_lines(scene.effects),
        "off, not evaluated: " + (", ".join(off) or "none"),
    ]
