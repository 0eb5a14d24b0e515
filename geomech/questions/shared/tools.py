"""Functions that several questions share."""

from collections.abc import Iterable
from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from geomech.core.errors import choose
from geomech.core.variables import COMPONENTS, Result, Variable, same_or_each
from geomech.questions.shared import base
from rft.core.checks import is_number
from rft.core.notes import warn
from rft.core.refusal import Refusal, in_line

FILMS = (".gif", ".mp4")


def as_numbers(values: Any) -> Any:
    """Return a number or a list of numbers as a tuple; anything else as it is, for its
    reader to refuse."""
    if is_number(values):
        return (float(values),)
    if isinstance(values, (str, bytes)) or np.ndim(values) != 1:
        return values
    return tuple(np.asarray(values).tolist())


def as_words(place: str, names: Any) -> tuple:
    """Return a name or a list of names as a tuple, none for None; Refusal, with
    ``place``, for anything else."""
    if names is None:
        return ()
    if isinstance(names, str):
        return (names,)
    if not isinstance(names, Iterable):
        raise Refusal(f"``{place}`` must be a name or a list of names", value=names)
    return tuple(names)


def command_line(question: base.Question) -> str:
    """Return the command that asks a question, without its output and without options
    on which its answer does not depend."""
    compared = [one.name for one in fields(question) if one.compare]
    words = ["geomech", question.name.replace("_", "-")]
    if question.subject is not None:
        words.append(in_line(question.subject_name))
    for name, (option, _, _) in base.options(type(question)).items():
        value = getattr(question, name)
        if name not in compared or value is None or value is False:
            continue
        words.append(base.flag(name, option))
        if value is not True:
            words.append(option_text(value))
    return " ".join(words)


def option_text(value: Any) -> str:
    """Return the value of an option as it is typed."""
    if isinstance(value, tuple):
        return ",".join(map(option_text, value))
    if isinstance(value, float):
        return f"{value:g}"
    return str(value)


def component() -> Variable:
    """Return the coordinate of x, y and theta."""
    return Variable("component", ("component",), COMPONENTS)


def selected(variable: Variable, dim: str, mask: list[bool]) -> Variable:
    """Return a variable at some places of a dimension."""
    axis = variable.dims.index(dim)
    return variable.with_arrays(partial(np.compress, mask, axis=axis))


def warn_of_notes(result: Result) -> None:
    """Warn in Python of what a command prints as notes."""
    if "note" in result:
        for line in result["note"].values.tolist():
            warn(line)


def side_by_side(result: Result, name: str, dim: str, names: Iterable[str]) -> Variable:
    """Return variables without dimensions as one, over a dimension, with their
    errors."""
    parts = [result[each] for each in names]
    values = [float(part) for part in parts]
    errors = [float(part.error) for part in parts]
    units = same_or_each([part.units for part in parts])
    return Variable(name, (dim,), values, units, error=errors)


def in_degrees(variable: Variable) -> Variable:
    """Return an angle in degrees, and any other variable as it is."""
    if variable.unit != "rad":
        return variable
    return variable.with_arrays(np.degrees, unit="degrees")


def component_number(components: Any) -> int:
    """Return the number of one component, x, y or theta; x if none is named."""
    if isinstance(components, str):
        components = (components,)
    names = [*components] or ["x"]
    return COMPONENTS.index(choose("component", names[0], COMPONENTS))


def is_film(path: Path) -> bool:
    """Return whether a file is a film by its ending."""
    return path.suffix.lower() in FILMS


def check_films(paths: Iterable[Path]) -> None:
    """Refuse films that nothing here can write."""
    for path in paths:
        if is_film(path):
            from geomech.plots import films

            films.check_format(path)
