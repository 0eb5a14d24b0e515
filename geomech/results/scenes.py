"""The scenes that results spell out."""

from __future__ import annotations

from typing import Any

from geomech.core.variables import Result
from rft.core.refusal import Refusal


def scene_of(result: Result) -> Any:
    """Return the scene of a result: that of its question, or the one that its file spells
    out; Refusal for a file without one."""
    if result.question is not None:
        return result.question.subject
    return _parsed(result, "scene_toml")


def best_scene(result: Result) -> Any:
    """Return the scene with the best gait, of a result of `optimise`.

    Examples
    --------
    >>> import geomech
    >>> best = geomech.optimise("three-link-viscous", harmonics=1, starts=1)
    >>> geomech.best_scene(best).gait.harmonics
    1
    """
    return _parsed(result, "best_scene_toml")


def _parsed(result: Result, attribute: str) -> Any:
    from geomech.scenes.read import parse

    if attribute not in result.attributes:
        raise Refusal(
            "the file of this result does not have its scene",
            instead="compute it again to draw it",
        )
    name = result.attributes.get("scene", "scene")
    return parse(result.attributes[attribute], name)
