"""The units of length that results have, and those in which they can be shown."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NoReturn

from geomech.core.errors import choose
from geomech.mathematics.systems.base import body_size, length_unit
from rft.core.refusal import Refusal

METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}  # of a unit
BODY_LENGTH = "BL"
UNITS = (*METRES, BODY_LENGTH)


@dataclass(frozen=True)
class Lengths:
    """The units of length in a result.

    metres: of each unit that is converted, such as {"m": 1.0}; None where its size is
    unknown. body: length of the body, m; None where it is unknown. kept: names of
    variables that are shares of the body and stay as they are."""

    metres: dict[str, float | None]
    body: float | None = None
    kept: tuple[str, ...] = ()

    def factor(self, own: str, unit: str, name: str) -> float:
        """Return the factor from lengths in one of the units to lengths in another;
        Refusal where it is unknown. name: of the scene or file, for the Refusal."""
        if own == unit:
            return 1.0
        own_metres = self.metres[own]
        metres = METRES.get(unit, self.body)
        if own_metres is None:
            refuse_lengths(name, own, unit)
        if metres is None:
            raise Refusal(
                f"{name} has no body length",
                where="``unit``",
                value=unit,
                instead=f"give one of {', '.join(METRES)}",
            )
        return own_metres / metres


def scene_lengths(scene: Any) -> Lengths:
    """Return the units of length in results of a scene."""
    own = own_unit(scene)
    if own == "m" and hasattr(scene, "system"):
        return Lengths({"m": 1.0}, body_size(scene.system))
    if own == "m":
        return Lengths({"m": 1.0})
    return Lengths({own: None})


def refuse_lengths(name: str, own: str, unit: str) -> NoReturn:
    """Refuse a unit where the size of a body length, or of another unit, is
    unknown."""
    instead = "leave ``unit`` out"
    if own == BODY_LENGTH:
        own = "body lengths"
        instead = "give its [body] a length in m, such as length = 0.15, or unit BL"
    raise Refusal(
        f"lengths of {name} are in {own}", where="``unit``", value=unit, instead=instead
    )


def own_unit(scene: Any) -> str:
    """Return the unit of lengths in the results of a scene."""
    if hasattr(scene, "system"):
        return length_unit(scene.system)
    return "m"


def length_factor(scene: Any, unit: str) -> float:
    """Return the factor from lengths in the results of a scene to lengths in a unit;
    Refusal for a unit that the scene's lengths cannot have.

    Examples
    --------
    >>> import geomech
    >>> from geomech.results.length_units import length_factor
    >>> length_factor(geomech.load("shovel-nosed-snake"), "BL")
    1.0
    """
    choose("``unit``", unit, UNITS)
    return scene_lengths(scene).factor(own_unit(scene), unit, scene.name)
