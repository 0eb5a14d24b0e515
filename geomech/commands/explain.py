"""geomech explain."""

from __future__ import annotations

from geomech.commands.options import SceneArgument
from geomech.commands.pipeline import show


def explain(name: SceneArgument):
    """Print the effects of a scene, the engine that follows, their costs, and the results that they rule out."""
    from geomech.scene import load
    from geomech.text.explain import explain

    show([explain(load(name))])
