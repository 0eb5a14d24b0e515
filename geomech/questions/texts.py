"""Numbers, angles and lists in the texts of options."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rft.core.refusal import Refusal, located

NO_ANGLE = "this is no angle"


def number(text: str, angle: str | None) -> float:
    """Return 0.5, or 30deg for an angle, in rad. angle: why degrees are refused; None for an angle."""
    if not text.strip().endswith("deg"):
        return float(text)
    if angle is not None:
        raise NoAngle(angle)
    return math.radians(float(text.strip().removesuffix("deg")))


class NoAngle(Exception):
    """Degrees were given where they are refused; its text says why."""


def numbers(
    option: str, text: str, count: int | None = None, angle: str | None = NO_ANGLE
) -> list[float]:
    """Return the numbers of 0.5,0.3, ``count`` of them if that is given. angle: None for angles, which may be 30deg; else why
    degrees are refused."""
    try:
        values = [number(x, angle) for x in text.split(",")]
        if count not in (None, len(values)):
            raise ValueError
    except NoAngle as no_angle:
        raise Refusal(
            f"{text!r} is in degrees, but {no_angle}",
            where=option,
            instead="give a number without 'deg'",
        ) from None
    except ValueError:
        such = "0.5,0.3 or 30deg,20deg" if angle is None else "0.5,0.3"
        raise Refusal(
            f"{text!r} is not {('a number' if count else f'a list of numbers such as {such}')}",
            where=option,
        ) from None
    return values


def angles(scene, option: str, text: str | None) -> tuple[float, ...] | None:
    """Return 0.3,-20deg in rad; None for an option that is left out."""
    with located(scene.name):
        return None if text is None else tuple(numbers(option, text, angle=None))


def joint_limits(text: str | None, scene) -> float | list[tuple[float, float]] | None:
    """Return the limits of --limits, rad: 2.5 or 120deg for all joints, -0.5:2 from low to high, or one of these for each,
    1,-0.5:2."""
    if text is None:
        return None
    pairs: list[Any] = []
    for part in text.split(","):
        ends = [
            number
            for end in part.split(":")
            for number in numbers("--limits", end, 1, None)
        ]
        if len(ends) > 2:
            raise Refusal(
                f"{part!r} is no limit",
                where="--limits",
                instead="give one such as 2.5, 120deg or -0.5:2",
            )
        pairs.append((-ends[0], ends[0]) if len(ends) == 1 else tuple(ends))
    if len(pairs) == 1:
        return pairs[0][1] if ":" not in text else pairs * scene.system.joints
    return pairs


def kind_of(part: Any) -> Any:
    """Return the class of a part."""
    return type(part)


def amplitude_kind(scene) -> str | None:
    """Return the ``angle`` of `numbers` for an amplitude of the scene's gait."""
    from geomech.scenes.key import angles_of

    if "amplitude" in angles_of(kind_of(scene.gait)):
        return None
    return f"the amplitude of a {type(scene.gait).__name__.lower()} is none"


def parameter_kind(scene, parameter: str) -> str | None:
    """Return the ``angle`` of `numbers` for a scene's parameter (`geomech.studies.sweep`)."""
    from geomech.scenes.key import angles_of

    section, *_, key = parameter.split(".") if "." in parameter else (parameter, "")
    if hasattr(scene, "robot"):
        of = {
            "robot": getattr(scene.robot, "legs", None),
            "gait": scene.gait,
            "medium": scene.medium,
        }.get(section)
        angle = key in angles_of(kind_of(of))
        return (
            None
            if angle
            else "this key takes degrees as they are"
            if key.endswith("_deg")
            else NO_ANGLE
        )
    if parameter == "gait.amplitude":
        return amplitude_kind(scene)
    system = scene.system
    owners = {
        "gait": [scene.gait],
        "system": [system],
        "effects": getattr(system, "effects", ()),
    }
    of = owners.get(section, [getattr(system, section, None)])
    if parameter == "numerics.extent" or any(
        key in angles_of(kind_of(owner)) for owner in of
    ):
        return None
    return "this key takes degrees as they are" if key.endswith("_deg") else NO_ANGLE


def spread(option: str, text: str, angle: str | None = NO_ANGLE) -> list[float]:
    """Return the numbers of 0.5,1.0 or START:STOP:COUNT, all finite. angle: as for `numbers`."""
    parts = text.split(":")
    if len(parts) == 1:
        values = numbers(option, text, angle=angle)
    elif len(parts) == 3 and re.fullmatch(r"[1-9]\d{0,4}", parts[2]):
        (start,), (stop,) = (numbers(option, part, 1, angle) for part in parts[:2])
        count = int(parts[2])
        values = [start + (stop - start) * k / max(1, count - 1) for k in range(count)]
    else:
        raise Refusal(
            f"{text!r} is neither a list such as 0.5,1.0 nor START:STOP:COUNT such as 0.2:2:10",
            where=option,
        )
    if not all(map(math.isfinite, values)):
        raise Refusal(f"{text!r} must be finite", where=option)
    return values


def parameters(
    over: Sequence[str], scene, drawn: bool = False
) -> dict[str, list[float]]:
    """Return the values by parameter of texts such as gait.amplitude=0.5:1.5:3. drawn: in a figure, which takes one or two."""
    axes = {}
    for text in over:
        parameter, equals, values = text.partition("=")
        if not equals or parameter in axes:
            raise Refusal(
                f"--over {text!r}",
                instead="give each parameter once, as PARAM=START:STOP:COUNT",
            )
        axes[parameter] = values
    if drawn and len(axes) > 2:
        raise Refusal(
            f"cannot draw {len(axes)} parameters",
            instead="sweep one or two, or leave --plot out",
        )
    return {
        p: spread(f"--over {p}", values, parameter_kind(scene, p))
        for p, values in axes.items()
    }


def column_names(text: str | None) -> tuple[str, ...]:
    """Return the names in T,A1,A2; none for an option that is left out."""
    return () if text is None else tuple(text.split(","))


def parse_end_caps(text: str) -> float | str:
    """Return e of the rod's ends (`rft.EndCaps`), 0 to leave them out, or "fitted"."""
    if text in ("left-out", "fitted"):
        return 0.0 if text == "left-out" else text
    try:
        return float(text)
    except ValueError:
        raise Refusal(
            f"--end-caps {text!r} is neither left-out, fitted nor a number"
        ) from None


MAPS, CURVES = (
    ("x", "y", "theta"),
    ("x", "y", "theta", "distance"),
)  # panels of figures, by the words of --component


def components(text: str | None, names: Sequence[str] = MAPS) -> tuple[str, ...]:
    """Return the panels in x,theta; none for an option that is left out."""
    from geomech.core.errors import choose

    found = (
        ()
        if text is None
        else tuple(
            choose("--component", word.strip(), names) for word in text.split(",")
        )
    )
    if len({*found}) < len(found):
        raise Refusal("name each panel once", where="--component", value=text)
    return found


def colour_limit(
    text: str | None, panels: Sequence[str] = ("x",)
) -> float | str | None:
    """Return a limit of colours: a positive number, a percentile such as "98%", or two such as "5%:95%". panels: on which it
    holds, none for all; one number has one unit."""
    if text is None:
        return None
    ends = text.strip().split(":")
    percent = text.strip().endswith("%")
    try:
        if any(end.endswith("%") != percent for end in ends) or len(ends) > 1 + percent:
            raise ValueError
        values = [float(end.removesuffix("%")) for end in ends]
    except ValueError:
        values = [math.nan]
    least = 0.0 if len(values) == 1 else -1e-9
    if not (
        least < values[0]
        and values == sorted({*values})
        and values[-1] < (100.0 + 1e-9 if percent else math.inf)
    ):
        instead = "give a number above 0, or a percentile such as 98% or 5%:95%"
        raise Refusal(f"{text!r} is no limit", where="--clim", instead=instead)
    if not percent and "theta" in (panels or MAPS) and len(panels or MAPS) > 1:
        why = "panels of theta have another unit than those of x and y"
        raise Refusal(
            f"{text!r} is one limit",
            where="--clim",
            because=why,
            instead="say --component x, or a percentile such as 98%",
        )
    return text.strip() if percent else values[0]


def measurements(path: Path | None, scene, panels: Sequence[str]):
    """Return what `geomech.scenes.measurements` reads of the quantity of one panel, x if none is named; None without a file."""
    if path is None:
        return None
    from geomech.scenes.measurements import read

    if len(panels) > 1:
        raise Refusal(
            "--data FILE is of one quantity",
            instead="name its panel alone with --component, such as x",
        )
    return read(path, scene, angle=panels == ("theta",))
