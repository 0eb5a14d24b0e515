"""geomech explain: the system of a scene in words, its effects, its engine, and the
results that exist."""

from __future__ import annotations

from geomech.core.summary import wrapped
from geomech.shell import terminal
from geomech.shell.options import SceneArgument


def explain(name: SceneArgument) -> None:
    """Print effects, engine and cost of a scene. It also lists the results that
    the effects rule out."""
    # The mechanics of scenes takes longer to load than the help of this command.
    from geomech.scenes import load
    from geomech.shell.describe.scene import description

    terminal.show(wrapped(description(load(name)).splitlines()))
