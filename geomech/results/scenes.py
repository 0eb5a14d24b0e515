"""The scenes and media that results spell out."""

from __future__ import annotations

from typing import Any

from geomech.core.variables import Result
from geomech.scenes.read import medium_in, parse
from rft.core.refusal import Refusal


def scene_of(result: Result) -> Any:
    """Return the scene of a result: that of its question, or the one that its file
    spells out; Refusal for a file without one."""
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
    require_result(result)
    if "best_scene_toml" not in result.attributes:
        raise Refusal(
            "this result has no best scene",
            instead="give a result of ``optimize`` for a scene that a file can hold",
        )
    return _parsed(result, "best_scene_toml")


def fitted_medium(result: Result) -> Any:
    """Return the medium of a result of `fit_medium`: a force law with the covariance of
    its parameters, or a stress map.

    Examples
    --------
    >>> import geomech
    >>> sand = geomech.fitted_medium(geomech.fit_medium("short-rod-drag"))
    >>> round(sand.C, 2), round(sand.gamma0, 2)
    (1.49, 0.22)
    >>> chain, circle = geomech.bodies.Chain(), geomech.mathematics.gaits.Circle(1.0)
    >>> moved = geomech.study(sand, chain, circle).displacement(tiers="direct")
    >>> moved["net_distance"].values.round(3)
    array([[0.05]])
    """
    require_result(result)
    if "medium_toml" not in result.attributes:
        raise Refusal(
            "this result has no medium", instead=("give a result of ``fit_medium``")
        )
    return medium_in(result.attributes["medium_toml"])


def require_result(result: object) -> None:
    """Refuse what is no result, such as the name of its file."""
    if not isinstance(result, Result):
        raise Refusal(
            "the result must come from a question or from load_result(FILE)",
            value=result,
        )


def _parsed(result: Result, attribute: str) -> Any:
    if attribute not in result.attributes:
        raise Refusal(
            "the file of this result does not contain its scene",
            instead="compute it again to draw it",
        )
    name = result.attributes.get("scene", "scene")
    return parse(result.attributes[attribute], name)
