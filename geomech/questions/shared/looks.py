"""The options that the pictures of questions share: the look of a figure for a page.

They are declared here once, for the command line, for `Result.plot` and for the pages
that list options. `geomech.plots.look.Look` reads their values.
"""

import difflib
import inspect
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from geomech.core.errors import choose
from geomech.questions.shared import base
from geomech.questions.shared.base import Declared, Option
from rft.core.refusal import Refusal


@dataclass(frozen=True)
class FigureOptions:
    """The shared options; the fields are those of `geomech.plots.look.Look`."""

    width: Annotated[
        Any, Option("width on the page, such as 3.4in, 86mm or 246pt", "WIDTH")
    ] = None
    unit: Annotated[
        Any, Option("unit of lengths, in print as well: m, cm, mm or BL", "UNIT")
    ] = None
    font: Annotated[
        Any, Option("font and size in points, as Arial,8 or 8", "NAME,SIZE")
    ] = None
    style: Annotated[
        Any, Option("style of matplotlib, a FILE.mplstyle or a name", "STYLE")
    ] = None
    cmap: Annotated[
        Any, Option("colour map of matplotlib or cmcrameri, such as RdBu_r", "NAME")
    ] = None
    legend: Annotated[
        Any, Option("outside (one above all panels), inside or none", "PLACE")
    ] = None


DECLARED = base.options(FigureOptions)  # type: ignore[arg-type]


def look_options(question: Any) -> Declared:
    """Return the shared options that the pictures of a question take; without pictures
    there are none."""
    if question.draw is None:
        return {}
    return {name: DECLARED[name] for name in DECLARED if name in question.looks}


def own_options(question: Any) -> list[str]:
    """Return the keywords that the picture of a question alone takes."""
    if question.draw is None:
        return []
    parameters = inspect.signature(question.draw).parameters.values()
    return [p.name for p in parameters if p.kind is p.KEYWORD_ONLY]


def split(question: Any, given: dict[str, Any]) -> tuple[dict, dict]:
    """Return the options of a look and those of the question's own picture; Refusal for
    an option that the picture does not take.

    A style is the question's own if it is one of its ways to draw, else one of
    matplotlib."""
    own = own_options(question)
    shared = look_options(question)
    known = [*own, *(name for name in shared if name not in own)]
    looks: dict[str, Any] = {}
    others: dict[str, Any] = {}
    for name, value in given.items():
        if name not in known:
            refuse_option(question, name, known)
        if name == "style" and name in own:
            ways, styles = split_styles(question, value)
            if ways:
                others[name] = ways[-1]
            if styles:
                looks[name] = styles
        elif name in own:
            others[name] = value
        elif value is not None:
            looks[name] = value
    return looks, others


def split_styles(question: Any, value: Any) -> tuple[list[str], list[str]]:
    """Return the question's own ways to draw among some styles, and those of
    matplotlib."""
    if value is None:
        return [], []
    words = value
    if isinstance(value, str):
        words = [word.strip() for word in value.split(",")]
    known = [*question.ways()]
    ways = []
    styles = []
    for word in map(str, words):
        if word in known:
            ways.append(word)
        elif is_style(word):
            styles.append(word)
        else:
            choose("``style``", word, known)
    return ways, styles


def is_style(name: str) -> bool:
    """Return whether a name is a style of matplotlib or the file of one."""
    from matplotlib import style

    return name in style.library or name.endswith(".mplstyle") or Path(name).is_file()


def refuse_option(question: Any, name: str, known: Iterable[str]) -> None:
    known = list(known)
    instead = f"it takes {', '.join(known)}"
    nearest = difflib.get_close_matches(name, known, 1, 0.7)
    if nearest:
        instead = f"did you mean {nearest[0]!r}? {instead}"
    raise Refusal(
        f"the picture of {question.name} has no option {name!r}", instead=instead
    )


def checked_look(question: Any, values: dict[str, Any]) -> Any:
    """Return the look with these values; Refusal, before anything is computed, for one
    that makes no sense."""
    from geomech.plots.look import Look

    look = Look(**values)
    look.check()
    if look.unit is not None:
        question.check_unit(look.unit)
    return look
