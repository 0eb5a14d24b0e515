"""geomech explain."""

from __future__ import annotations

from geomech.commands.options import SceneArgument
from geomech.commands.pipeline import show


def explain(name: SceneArgument):
    """Print effects and engine of a scene, and what they cost. Results that the effects rule out are listed."""
    from geomech.core.summary import wrapped
    from geomech.scenes import load
    from geomech.text.explain import explain

    show(wrapped(explain(load(name)).splitlines()))
