"""What a scene asks for, and what follows from it."""

from __future__ import annotations

import dataclasses

from geomech.errors import short
from geomech.gaits import KINDS as GAITS
from geomech.scene.model import Scene
from rft.bodies import KINDS as BODIES
from rft.effects import ENGINES, KINDS
from rft.media import LAWS
from rft.premise import SHAPE_ALONE, not_so


def explain(scene: Scene) -> str:
    """Effects on and off, the engine and why, the cost of each effect and the results that are left, as plain text."""
    medium, body = said(_kind(LAWS, scene.medium), scene.medium), said(_kind(BODIES, scene.body), scene.body)
    lines = [f"{scene.name}: {medium}, {body}, {_kind(GAITS, scene.gait)} gait"]
    for effect in scene.effects:
        broken = not_so(effect.breaks) or "keeps every premise"
        lines.append(
            f"on:  {said(effect.kind, effect)}; {broken}; costs {effect.cost}; gone at {effect.limit}, "
            f"order {effect.order}"
        )
        if assumed := effect.assumes(scene.medium):
            lines.append(f"     assumes {assumed}")
    off = [name for name in KINDS if name not in [e.kind for e in scene.effects]]
    lines.append("off, not evaluated: " + (", ".join(off) or "none"))
    lines.append(f"engine: {scene.engine} ({ENGINES[scene.engine]}): {_why(scene)}")
    lines.append("tiers: " + ", ".join(scene.tiers))
    if blame := ", ".join(e.kind for e in scene.effects if e.breaks):
        lost = "connection, CCF, area, path and harmonic tiers"
        if scene.engine != "algebraic":
            lost += ", adapted tier, velocity at a single shape"
        lines.append(f"not available: {lost}: {blame} takes away what they rest on")
    elif scene.body.joints != 2:
        lines.append(
            f"not available: CCF maps, area and harmonic tiers: they take two joints, this body has {scene.body.joints}"
        )
    return "\n".join(lines)


def said(kind: str, thing) -> str:
    """What a part of a scene is and its numbers, as a scene has them."""
    values = [f"{f.name} = {short(getattr(thing, f.name))}" for f in dataclasses.fields(thing)]
    return f"{kind} ({', '.join(values)})" if values else kind


def _kind(kinds: dict, thing) -> str:
    """Its name in ``kinds``, or that of its class."""
    return next((name for name, kind in kinds.items() if type(thing) is kind), type(thing).__name__)


def _why(scene: Scene) -> str:
    """What makes the scene's engine necessary."""
    reasons = [
        f"with {e.kind} the scene is {not_so(e.breaks & SHAPE_ALONE)}" for e in scene.effects if e.breaks & SHAPE_ALONE
    ]
    return "; ".join(reasons) or "nothing remembers, places are alike, no mass"
