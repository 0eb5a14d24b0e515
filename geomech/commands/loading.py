"""Scenes by name, for commands that take one kind of scene or another."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from geomech.core.errors import check_angle
from rft.refusal import Refusal

if TYPE_CHECKING:
    from geomech.scenes import Intruding, Scene, WalkerScene


def load_with_gait(name: str | Scene) -> Scene:
    """Return the scene of that name, or one that is loaded; Refusal for one without a gait."""
    from geomech.scenes import Scene, load

    scene = load(name) if isinstance(name, str) else name
    name = name if isinstance(name, str) else scene.name
    if isinstance(scene, Scene):
        return scene
    if hasattr(scene, "robot"):
        raise Refusal(
            "a robot that walks has no shape space",
            where=name,
            instead="give it to 'geomech walk', 'sweep' or 'accuracy'",
        )
    raise Refusal(
        "an intruder scene has no gait", where=name, instead="give it to 'geomech intrude' or 'geomech accuracy'"
    )


def load_scene(name: str | Scene, grid: int | None = None, extent: float | None = None, medium: Path | None = None):
    """Return the scene of that name, or one that is loaded, with the options of its field, in the medium of a file if one is
    given."""
    from geomech.scenes import in_medium
    from geomech.systems.capabilities import stored_table

    scene = load_with_gait(name)
    file_field = stored_table(scene.system, "connection")
    if (grid, extent) != (None, None) and file_field:
        raise Refusal(
            "the field of a table has its file's own grid", where=scene.name, instead="drop --grid and --extent"
        )
    if scene.system.traits.joint_angles and not file_field:
        check_angle("an extent", scene.numerics.extent if extent is None else extent)
    scene = scene.with_numerics(grid=grid, extent=extent)
    return in_medium(scene, medium) if medium else scene


def load_intruder(name: str):
    """Return the intruder scene of that name; Refusal for one with a gait."""
    from geomech.scenes import Scene, WalkerScene, load

    scene = load(name)
    if isinstance(scene, (Scene, WalkerScene)):
        raise Refusal(
            "a scene with a gait has no [intruder]", where=name, instead="see 'geomech scenes' for those that have"
        )
    return scene


def load_walker(name: str):
    """Return the scene of that name; Refusal for one without a robot."""
    from geomech.scenes import WalkerScene, load

    scene = load(name)
    if not isinstance(scene, WalkerScene):
        raise Refusal(
            "a scene without a [robot] does not walk", where=name, instead="see 'geomech scenes' for those that do"
        )
    return scene


def load_moving(name: str) -> Scene | WalkerScene:
    """Return the scene of that name; Refusal for one with neither a gait nor a robot."""
    from geomech.scenes import load

    scene = load(name)  # once: it may come through a pipe
    return scene if hasattr(scene, "robot") else load_scene(scene)


def load_any(name: str) -> Scene | Intruding | WalkerScene:
    """Return the scene of that name."""
    from geomech.scenes import Scene, load

    scene = load(name)
    return load_scene(scene) if isinstance(scene, Scene) else scene
