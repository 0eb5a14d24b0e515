"""geomech explain: the system of a scene in words, its effects, its engine, and the
results that exist."""

from __future__ import annotations

from geomech import terminal
from geomech.core.summary import wrapped
from geomech.options import SceneArgument


def explain(name: SceneArgument):
    """Print effects and engine of a scene, and what they cost. Results that the effects
    rule out are listed."""
    # The mechanics of scenes takes longer to load than the help of this command.
    from geomech.describe.scene import description
    from geomech.scenes import load

    terminal.show(wrapped(description(load(name)).splitlines()))
