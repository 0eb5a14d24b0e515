"""geomech explain."""

from __future__ import annotations

from geomech.commands.options import SceneArgument


def explain(name: SceneArgument):
    """Which effects a scene asks for, the engine that follows, what each costs and what it takes away."""
    from geomech.output.explain import explain as told
    from geomech.scene import load

    print(told(load(name)))
