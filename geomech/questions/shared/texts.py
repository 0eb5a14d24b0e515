"""Numbers, angles and lists in the texts of options."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from geomech.core.errors import choose
from rft.core.refusal import Refusal, located

# Reasons to refuse degrees.
NO_ANGLE = "this option is not an angle"
DEGREES_KEY = "this key is already in degrees"
# Panels of figures, by the words of --component.
MAPS = ("x", "y", "theta")
CURVES = ("x", "y", "theta", "distance")
LEAST_PERCENTILE = -1e-9  # 0, and roundoff below it
LARGEST_PERCENTILE = 100.0 + 1e-9


class NoAngle(Exception):
    """Degrees were given where they are refused; its text says why."""


def parse_number(text: str, no_degrees: str | None) -> float:
    """Return 0.5, or 30deg for an angle, in rad.

    no_degrees: why degrees are refused; None for an angle."""
    if not text.strip().endswith("deg"):
        return float(text)
    if no_degrees is not None:
        raise NoAngle(no_degrees)
    return math.radians(float(text.strip().removesuffix("deg")))


def parse_numbers(
    option: str,
    text: str,
    count: int | None = None,
    no_degrees: str | None = NO_ANGLE,
) -> list[float]:
    """Return the numbers of 0.5,0.3; exactly ``count`` of them if that is given.

    no_degrees: why degrees are refused; None for angles, which may be 30deg."""
    try:
        values = [parse_number(part, no_degrees) for part in text.split(",")]
        if count not in (None, len(values)):
            raise ValueError
    except NoAngle as no_angle:
        raise Refusal(
            f"{text!r} is in degrees, but {no_angle}",
            where=option,
            instead="write a number without 'deg'",
        ) from None
    except ValueError:
        expected = "a list of numbers such as 0.5,0.3"
        if no_degrees is None:
            expected = f"{expected} or 30deg,20deg"
        if count:
            expected = "a number"
        raise Refusal(f"{text!r} is not {expected}", where=option) from None
    return values


def angles(scene: Any, option: str, text: str | None) -> tuple[float, ...] | None:
    """Return 0.3,-20deg in rad; None for an option that is left out."""
    if text is None:
        return None
    with located(scene.name):
        return tuple(parse_numbers(option, text, no_degrees=None))


def joint_limits(
    text: str | None, scene: Any
) -> float | list[tuple[float, float]] | None:
    """Return the limits of --limits, rad: 2.5 or 120deg for all joints, -0.5:2 from low
    to high, or one of these for each, 1,-0.5:2."""
    if text is None:
        return None
    pairs = [limit_pair(part) for part in text.split(",")]
    if len(pairs) > 1:
        return pairs
    if ":" in text:
        return pairs * scene.system.joints
    _, largest = pairs[0]
    return largest


def limit_pair(text: str) -> tuple[float, float]:
    """Return the least and the largest angle of 2.5, 120deg or -0.5:2, rad."""
    ends: list[float] = []
    for end in text.split(":"):
        ends += parse_numbers("--limits", end, 1, None)
    if len(ends) > 2:
        raise Refusal(
            f"{text!r} is not a limit",
            where="--limits",
            instead="write  2.5, 120deg or -0.5:2",
        )
    if len(ends) == 1:
        return -ends[0], ends[0]
    low, high = ends
    return low, high


def no_degrees_of_amplitude(scene: Any) -> str | None:
    """Return why degrees are refused for an amplitude of the scene's gait; None if it
    is an angle."""
    if is_angle(scene.gait, "amplitude"):
        return None
    from geomech.mathematics.gaits.wound import unwound

    kind = type(unwound(scene.gait)).__name__.lower()
    return f"the amplitude of a {kind} is not an angle"


def no_degrees_of(scene: Any, parameter: str) -> str | None:
    """Return why degrees are refused for a parameter of a scene
    (`geomech.studies.displacement.sweep`); None if it is an angle."""
    if not hasattr(scene, "robot"):
        if parameter == "gait.amplitude":
            return no_degrees_of_amplitude(scene)
        if parameter == "numerics.extent":
            return None
    section, *rest = parameter.split(".")
    key = rest[-1] if rest else ""
    if any(is_angle(part, key) for part in parts_of(scene, section)):
        return None
    if key.endswith("_deg"):
        return DEGREES_KEY
    return NO_ANGLE


def parts_of(scene: Any, section: str) -> list[Any]:
    """Return the parts of a scene whose keys are those of a section."""
    if hasattr(scene, "robot"):
        parts = {
            "robot": [getattr(scene.robot, "legs", None)],
            "gait": [scene.gait],
            "medium": [scene.medium],
        }
        return parts.get(section, [])
    system = scene.system
    parts = {
        "gait": [scene.gait],
        "system": [system],
        "effects": [*getattr(system, "effects", ())],
    }
    return parts.get(section, [getattr(system, section, None)])


def is_angle(part: Any, key: str) -> bool:
    """Return whether a key of a part of a scene is an angle."""
    from geomech.mathematics.gaits.wound import unwound
    from geomech.scenes.format.key import angles_of

    kind: Any = type(unwound(part))
    return key in angles_of(kind)


def spread(option: str, text: str, no_degrees: str | None = NO_ANGLE) -> list[float]:
    """Return the numbers of 0.5,1.0 or START:STOP:COUNT, all finite.

    no_degrees: as for `parse_numbers`."""
    parts = text.split(":")
    if len(parts) == 1:
        values = parse_numbers(option, text, no_degrees=no_degrees)
    elif len(parts) == 3 and re.fullmatch(r"[1-9]\d{0,4}", parts[2]):
        (start,) = parse_numbers(option, parts[0], 1, no_degrees)
        (stop,) = parse_numbers(option, parts[1], 1, no_degrees)
        count = int(parts[2])
        intervals = max(1, count - 1)
        values = [start + (stop - start) * k / intervals for k in range(count)]
    else:
        raise Refusal(
            f"{text!r} is neither a list such as 0.5,1.0 nor a range START:STOP:COUNT "
            "such as 0.2:2:10",
            where=option,
        )
    if not all(map(math.isfinite, values)):
        raise Refusal(f"{text!r} must be finite", where=option)
    return values


def parameters(
    over: Sequence[str], scene: Any, drawn: bool = False
) -> dict[str, list[float]]:
    """Return the values by parameter of texts such as gait.amplitude=0.5:1.5:3.

    drawn: whether a figure is drawn, which takes one parameter or two."""
    texts = {}
    for text in over:
        parameter, equals, values = text.partition("=")
        if not equals or parameter in texts:
            raise Refusal(
                f"--over {text!r}",
                instead="write each parameter once, as PARAM=START:STOP:COUNT",
            )
        texts[parameter] = values
    if drawn and len(texts) > 2:
        raise Refusal(
            f"cannot draw {len(texts)} parameters",
            instead="sweep one or two parameters, or remove --plot",
        )
    axes = {}
    for parameter, values in texts.items():
        no_degrees = no_degrees_of(scene, parameter)
        axes[parameter] = spread(f"--over {parameter}", values, no_degrees)
    return axes


def column_names(text: str | None) -> tuple[str, ...]:
    """Return the names in T,A1,A2; none for an option that is left out."""
    if text is None:
        return ()
    return tuple(text.split(","))


def parse_end_caps(text: str) -> float | str:
    """Return e of the rod's ends (`rft.EndCaps`), 0 to leave them out, or "fitted"."""
    if text == "left-out":
        return 0.0
    if text == "fitted":
        return text
    try:
        return float(text)
    except ValueError:
        raise Refusal(
            f"--end-caps {text!r} is not left-out, fitted or a number"
        ) from None


def components(text: str | None, names: Sequence[str] = MAPS) -> tuple[str, ...]:
    """Return the panels in x,theta; none for an option that is left out."""
    if text is None:
        return ()
    found = tuple(
        choose("--component", word.strip(), names) for word in text.split(",")
    )
    if len({*found}) < len(found):
        raise Refusal("name each panel once", where="--component", value=text)
    return found


def colour_limit(
    text: str | None, panels: Sequence[str] = ("x",)
) -> float | str | None:
    """Return a limit of colours: a positive number, a percentile such as "98%", or two
    such as "5%:95%".

    panels: on which it holds, none for all. One number cannot hold on panels of
    different units."""
    if text is None:
        return None
    limit = text.strip()
    in_percent = limit.endswith("%")
    if not is_limit(limit, in_percent):
        raise Refusal(
            f"{text!r} is not a limit",
            where="--clim",
            instead="write a number above 0, or percentiles such as 98% or 5%:95%",
        )
    if in_percent:
        return limit
    panels = panels or MAPS
    if "theta" in panels and len(panels) > 1:
        raise Refusal(
            f"{text!r} is a single limit",
            where="--clim",
            because="panels of theta have a different unit from those of x and y",
            instead="use --component x, or a percentile such as 98%",
        )
    return float(limit)


def is_limit(text: str, in_percent: bool) -> bool:
    """Return whether a text is a number above 0 or, in percent, a percentile above 0 or
    two in ascending order."""
    ends = text.split(":")
    if any(end.endswith("%") != in_percent for end in ends):
        return False
    try:
        values = [float(end.removesuffix("%")) for end in ends]
    except ValueError:
        return False
    if not in_percent:
        return len(values) == 1 and 0.0 < values[0] < math.inf
    if len(values) == 1:
        return 0.0 < values[0] < LARGEST_PERCENTILE
    if len(values) > 2:
        return False
    low, high = values
    return LEAST_PERCENTILE < low < high < LARGEST_PERCENTILE


def measurements(path: Path | None, scene: Any, panels: Sequence[str]) -> Any:
    """Return what `geomech.scenes.data.measurements` reads of the quantity of one
    panel, x if none is named; None without a file."""
    from geomech.scenes.data.measurements import read

    if path is None:
        return None
    found = read(path, scene, angle=panels == ("theta",))
    if "value" in found and len(panels) > 1 and {*panels} != {"x", "distance"}:
        raise Refusal(
            "--data FILE contains one quantity",
            instead="choose its panel with --component, such as x",
        )
    return found
