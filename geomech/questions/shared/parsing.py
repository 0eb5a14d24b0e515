"""Values of options from the texts of a command line.

Each function takes a text, the question's subject and the option as it is typed
(`geomech.questions.shared.base.Option.parse`); `texts.py` reads the texts.
"""

from pathlib import Path
from typing import Any

from geomech.core.errors import choose
from geomech.questions.shared import texts
from rft.core.refusal import Refusal

FORCE_PANELS = ("forward", "normal", "tangential", "power", "moment", "phase", "place")

MIDLINE_PANELS = ("track", "slip_along", "amplitude_along", "speed", "heading", "slip")


def amplitudes(text: str, scene: Any, flag: str) -> tuple[float, ...]:
    """Return the amplitudes in 0.5,1,30deg or START:STOP:COUNT."""
    no_degrees = texts.no_degrees_of_amplitude(scene)
    return tuple(texts.spread(flag, text, no_degrees))


def tiers(text: str, scene: Any, flag: str) -> tuple[str, ...]:
    """Return the names in path,direct."""
    from geomech.mathematics.tiers import TIERS

    words = [word.strip() for word in text.split(",")]
    return tuple(choose("``tiers``", word, TIERS) for word in words)


def angles(text: str, scene: Any, flag: str) -> tuple[float, ...] | None:
    """Return the angles in 0.3,-20deg, rad."""
    return texts.angles(scene, flag, text)


def angle(text: str, subject: Any, flag: str) -> float:
    """Return the angle 0.3 or 20deg, rad."""
    return texts.parse_numbers(flag, text, 1, None)[0]


def joint_limits(text: str, scene: Any, flag: str) -> Any:
    """Return the limits in 2.5, 120deg, -0.5:2 or one of these for each joint, rad."""
    return texts.joint_limits(text, scene)


def parameters(words: list[str], scene: Any, flag: str) -> dict[str, list[float]]:
    """Return the values by parameter of texts such as gait.amplitude=0.5:1.5:3."""
    return texts.parameters(words, scene)


def names(text: str, subject: Any, flag: str) -> tuple[str, ...]:
    """Return the names in T,A1,A2."""
    return texts.column_names(text)


def panels(text: str, scene: Any, flag: str) -> tuple[str, ...]:
    """Return the panels in x,theta."""
    return texts.components(text)


def curve_panels(text: str, scene: Any, flag: str) -> tuple[str, ...]:
    """Return the panels in x,distance."""
    return texts.components(text, texts.CURVES)


def force_panels(text: str, scene: Any, flag: str) -> tuple[str, ...]:
    """Return the panels in forward,power."""
    return texts.components(text, FORCE_PANELS)


def midline_panels(text: str, scene: Any, flag: str) -> tuple[str, ...]:
    """Return the panels in track,speed."""
    return texts.components(text, MIDLINE_PANELS)


def colour_limit(text: str, scene: Any, flag: str) -> float | str | None:
    """Return the limit of colours in 2.5, 98% or 5%:95%."""
    return texts.colour_limit(text)


def one_limit(limit: Any, panels: Any) -> None:
    """Refuse a number that limits the colours of panels in different units."""
    if limit is not None:
        texts.colour_limit(str(limit), panels)


def end_caps(text: str, subject: Any, flag: str) -> float | str:
    """Return e of the rod's ends, 0 to leave them out, or "fitted"."""
    return texts.parse_end_caps(text)


def degrees(text: str, subject: Any, flag: str) -> tuple[float, ...]:
    """Return the angles in 0,30,90 or START:STOP:COUNT, degrees."""
    return tuple(texts.spread(flag, text))


def folder(text: str, subject: Any, flag: str) -> Path:
    """Return the folder of a name; an empty name is refused."""
    if not text:
        raise Refusal(
            "the name is empty",
            where=flag,
            instead="give a folder name, '.' for this one",
        )
    return Path(text)
