"""What a scene asks for, and what follows from it."""

from __future__ import annotations

from geomech.scene import METHODS, Scene
from rft.effects import KINDS


def explain(scene: Scene) -> str:
    """Effects on and off, the engine and why, the cost of each effect and the results that are left, as plain text."""
    kinds = {kind: name for name, kind in KINDS.items()}
    on = [kinds[type(e)] for e in scene.effects]
    lines = [f"{scene.name}: {scene.medium}, {scene.body}, {type(scene.gait).__name__.lower()} gait"]
    for effect in scene.effects:
        broken = ", ".join(sorted(effect.breaks)) or "nothing"
        lines.append(
            f"on:  {kinds[type(effect)]}: {effect}; breaks {broken}; costs {effect.cost}; gone at {effect.limit}"
        )
    off = [name for name in KINDS if name not in on]
    lines.append("off, not evaluated: " + (", ".join(off) or "none"))
    lines.append(
        "engine: algebraic (the balance of forces at every shape, all shapes at once): nothing remembers, no mass"
    )
    two = scene.body.joints == 2
    lines.append("tiers: " + ", ".join(m for m in METHODS if m == "adapted" or m in scene.methods))
    if any(e.breaks for e in scene.effects):
        lines.append(
            "not available: connection, CCF, area, path and harmonic tiers: an effect breaks what they rest on"
        )
    elif not two:
        lines.append(
            f"not available: CCF maps, area and harmonic tiers: they take two joints, this body has {scene.body.joints}"
        )
    return "\n".join(lines)
