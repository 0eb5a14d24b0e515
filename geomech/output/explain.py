"""What a scene asks for, and what follows from it."""

from __future__ import annotations

from geomech.gaits import KINDS as GAITS
from geomech.scene.model import Scene
from geomech.study.offer import tiers
from geomech.systems.base import ALL


def explain(scene: Scene) -> str:
    """The system with its effects on and off, the engine and why, and the results that are left, as plain text."""
    system, (first, *told) = scene.system, scene.system.told()
    gait = next((name for name, kind in GAITS.items() if type(scene.gait) is kind), type(scene.gait).__name__)
    lines = [f"{scene.name}: {first}, {gait} gait", *told]
    lines.append(f"engine: {system.engine} {system.because}")
    lines.append("tiers: " + ", ".join(tiers(system)))
    if system.lacks & ALL:
        lost = "connection, CCF, area, path and harmonic tiers"
        if system.steps:
            lost += ", adapted tier, velocity at a single shape"
        lines.append(f"not available: {lost}: {system.blames} takes away what they rest on")
    elif system.joints != 2:
        lines.append(
            f"not available: CCF maps, area and harmonic tiers: they take two joints, this body has {system.joints}"
        )
    elif system.singularity is not None:
        lines.append(
            f"not available: area and harmonic tiers: the field has singular shapes, where {system.singular}; maps and "
            "files leave these out, and gaits that meet one are refused"
        )
    return "\n".join(lines)
