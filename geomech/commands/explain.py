"""geomech explain."""

from __future__ import annotations

from geomech.commands.options import SceneArgument
from geomech.commands.pipeline import show


def explain(name: SceneArgument):
    """Which effects a scene asks for, the engine that follows, what each costs and what it takes away."""
    from geomech.scene import load
    from geomech.text.explain import explain

    show([explain(load(name))])
