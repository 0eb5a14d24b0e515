"""What a scene asks for, and what follows from it."""

from __future__ import annotations

from geomech.scene import ALGEBRAIC, Scene
from rft.effects import ENGINES, KINDS, PREMISES


def explain(scene: Scene) -> str:
    """Effects on and off, the engine and why, the cost of each effect and the results that are left, as plain text."""
    kinds = {kind: name for name, kind in KINDS.items()}
    on = [kinds[type(e)] for e in scene.effects]
    lines = [f"{scene.name}: {scene.medium}, {scene.body}, {type(scene.gait).__name__.lower()} gait"]
    for effect in scene.effects:
        broken = ", ".join(sorted(effect.breaks)) or "nothing"
        lines.append(
            f"on:  {kinds[type(effect)]}: {effect}; breaks {broken}; costs {effect.cost}; gone at {effect.limit}, "
            f"order {effect.order}"
        )
        if assumed := effect.assumes(scene.medium):
            lines.append(f"     assumes {assumed}")
    off = [name for name in KINDS if name not in on]
    lines.append("off, not evaluated: " + (", ".join(off) or "none"))
    lines.append(f"engine: {scene.engine} ({ENGINES[scene.engine]}): {_why(scene, kinds)}")
    lines.append("tiers: " + ", ".join(scene.tiers))
    if blame := ", ".join(kinds[type(e)] for e in scene.effects if e.breaks):
        lost = "connection, CCF, area, path and harmonic tiers"
        if scene.engine != "algebraic":
            lost += ", adapted tier, velocity at a single shape"
        lines.append(f"not available: {lost}: {blame} breaks what they rest on")
    elif scene.body.joints != 2:
        lines.append(
            f"not available: CCF maps, area and harmonic tiers: they take two joints, this body has {scene.body.joints}"
        )
    return "\n".join(lines)


def _why(scene: Scene, kinds) -> str:
    """What makes the scene's engine necessary."""
    reasons = [
        f"with {kinds[type(e)]} {PREMISES[premise].split(':')[0]}"
        for e in scene.effects
        for premise in sorted(e.breaks & ALGEBRAIC)
    ]
    return "; ".join(reasons) or "nothing remembers, places are alike, no mass"
