"""The look of a figure for a page: its width, the unit of its lengths, its font, its
colours and its legend.

`Look` reads and checks what is asked for; `using` makes it the look of all figures that
are drawn meanwhile. `geomech.plots.fit` then makes a figure fit.
"""

from __future__ import annotations

import contextlib
import difflib
import math
import re
from collections.abc import Iterator, Sequence
from contextvars import ContextVar
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Any

from geomech.core.errors import choose
from rft.core.refusal import Refusal, in_line

FONT_SIZE = 9  # points, of the project's style
STYLE = {
    "font.size": FONT_SIZE,
    "axes.labelsize": FONT_SIZE,
    "axes.titlesize": FONT_SIZE,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "savefig.dpi": 200,
    "pdf.fonttype": 42,  # TrueType, whose letters stay text in other programs
    "ps.fonttype": 42,
    "svg.fonttype": "none",
    "hatch.linewidth": 0.35,
    "lines.markersize": 3,
}
SIZES = ("axes.labelsize", "axes.titlesize", "legend.fontsize")  # follow font.size
INCHES = {  # of a unit of width
    "in": 1.0,
    "cm": 1 / 2.54,
    "mm": 1 / 25.4,
    "pt": 1 / 72.27,  # of TeX, which prints \columnwidth in it
}
NARROWEST = 1.5  # in
WIDEST = 40.0  # in
SMALLEST_FONT = 3.0  # points
LARGEST_FONT = 40.0  # points
LEGENDS = ("outside", "inside", "none")
FAMILIES = ("sans-serif", "serif", "monospace")  # that every style defines
BUNDLED = ("DejaVu Sans", "DejaVu Serif", "STIXGeneral")  # that matplotlib brings
NAMED = 4  # similar fonts that a refusal names


@dataclass(frozen=True)
class Look:
    """What a figure for a page is asked to look like; None leaves a default.

    Attributes
    ----------
    width : str
        Width of the page's column, such as "3.4in", "86mm", "8.6cm" or "246pt". Panels
        that have no room side by side stand one above the other.
    unit : str
        Unit of lengths, "m", "cm", "mm" or "BL", see `geomech.results.lengths`.
    font : str
        Name and size in points, as "Arial,8"; either may stand alone.
    style : str or sequence of str
        File FILE.mplstyle of matplotlib, or the name of one of its styles.
    cmap : str
        Name of a colour map of matplotlib or cmcrameri, for maps.
    legend : str
        "outside" for one legend above all panels, "inside" for legends in the panels,
        or "none".

    Examples
    --------
    >>> from geomech.plots import Look
    >>> round(Look(width="86mm").inches, 3)
    3.386
    """

    width: str | None = None
    unit: str | None = None
    font: str | None = None
    style: str | Sequence[str] | None = None
    cmap: str | None = None
    legend: str | None = None

    def check(self) -> None:
        """Refuse what does not exist or makes no sense."""
        _ = self.inches
        if self.legend is not None:
            choose("``legend``", self.legend, LEGENDS)
        if self.cmap is not None:
            _ = self.colour_map
        if self.font is not None or self.style is not None:
            _ = self.rc

    @property
    def changes_figure(self) -> bool:
        """Whether a figure has to be changed once it is drawn: texts or panels may have
        other sizes than in the default look, or its legends another place."""
        parts = (self.width, self.font, self.style, self.legend)
        return any(part is not None for part in parts)

    @cached_property
    def inches(self) -> float | None:
        """The width, in."""
        if self.width is None:
            return None
        return parse_width(self.width)

    @cached_property
    def rc(self) -> dict[str, Any]:
        """The settings of matplotlib: the project's, under those of the user's
        matplotlibrc, of the style and of the font."""
        import matplotlib as mpl

        # What the user's file sets differs from the defaults.
        own = {
            key for key in STYLE if mpl.rcParamsOrig[key] != mpl.rcParamsDefault[key]
        }
        rc = {key: value for key, value in STYLE.items() if key not in own}
        changed = {key: mpl.rcParamsOrig[key] for key in own}
        for style in self.styles:
            changed |= style_settings(style)
        if self.font is not None:
            changed |= font_settings(self.font)
        scale = float(changed.get("font.size", FONT_SIZE)) / FONT_SIZE
        for key in SIZES:
            if key in rc:
                rc[key] = scale * STYLE[key]  # type: ignore[operator]
        return {**rc, **changed}

    @property
    def styles(self) -> tuple[str, ...]:
        """The names of the styles."""
        if self.style is None:
            return ()
        if isinstance(self.style, str):
            return tuple(word.strip() for word in self.style.split(","))
        return tuple(map(str, self.style))

    @cached_property
    def colour_map(self) -> Any:
        """The colour map, or None."""
        if self.cmap is None:
            return None
        return named_colour_map(self.cmap)


DEFAULT = Look()
_current: ContextVar[Look] = ContextVar("look")


def current() -> Look:
    """Return the look of figures that are drawn now."""
    return _current.get(DEFAULT)


@contextlib.contextmanager
def using(look: Look) -> Iterator[Look]:
    """Draw figures with a look in the body of the statement; what it leaves open is
    that of the look around it.

    Examples
    --------
    >>> import geomech
    >>> from geomech.plots import Look, using
    >>> study = geomech.study("three-link-viscous", grid=9)
    >>> with using(Look(width="3.4in", font="8")):
    ...     fig = geomech.plots.connection_figure(study.tables.fitted)
    >>> float(fig.get_figwidth())
    3.4
    """
    given = {}
    for field in fields(Look):
        value = getattr(look, field.name)
        if value is None:
            value = getattr(current(), field.name)
        given[field.name] = value
    joined = Look(**given)
    joined.check()
    token = _current.set(joined)
    try:
        yield joined
    finally:
        _current.reset(token)


def parse_width(text: Any) -> float:
    """Return the width 3.4in, 86mm, 8.6cm or 246pt, in."""
    match = re.fullmatch(r"\s*([0-9.eE+-]+)\s*([a-zA-Z]*)\s*", str(text))
    try:
        number = float(match[1])  # type: ignore[index]
        unit = match[2].lower()  # type: ignore[index]
    except (TypeError, ValueError):
        number, unit = math.nan, ""
    if not unit and math.isfinite(number):
        raise Refusal(
            "a width needs its unit",
            where="``width``",
            value=text,
            instead=f"give {number:g}in, {number:g}cm or {number:g}mm",
        )
    if unit not in INCHES or not math.isfinite(number):
        raise Refusal(
            "this is no width",
            where="``width``",
            value=text,
            instead="give one such as 3.4in, 86mm, 8.6cm or 246pt",
        )
    inches = number * INCHES[unit]
    if not NARROWEST <= inches <= WIDEST:
        raise Refusal(
            f"a figure is {NARROWEST:g} to {WIDEST:g} inches wide",
            where="``width``",
            value=text,
            instead="give one such as 3.4in or 86mm",
        )
    return inches


# Styles


def style_settings(name: str) -> dict[str, Any]:
    """Return the settings of a style of matplotlib, by its name or its file."""
    import matplotlib as mpl
    from matplotlib import style

    if name in style.library:
        return dict(style.library[name])
    path = Path(name)
    if path.suffix != ".mplstyle" and not path.is_file():
        instead = "give a file FILE.mplstyle, or a name such as ggplot or grayscale"
        nearest = difflib.get_close_matches(name, style.available, 1, 0.5)
        if nearest:
            instead = f"did you mean {nearest[0]!r}?"
        raise Refusal(
            f"{name!r} is unknown", where="``style``", instead=instead
        ) from None
    try:
        read = mpl.rc_params_from_file(path, use_default_template=False)
    except (OSError, ValueError, TypeError, UnicodeDecodeError) as error:
        raise Refusal(
            f"cannot read {in_line(path)}",
            where="``style``",
            because=str(error).splitlines()[0],
            instead="give a style file of matplotlib",
        ) from None
    return dict(read)


# Fonts


def font_settings(text: str) -> dict[str, Any]:
    """Return the settings of a font such as "Arial,8", "Arial" or "8"."""
    found: dict[str, Any] = {}
    for word in str(text).split(","):
        word = word.strip()
        size = re.fullmatch(r"([0-9.]+)\s*(?:pt)?", word)
        if size is not None:
            found["font.size"] = _font_size(word, float(size[1]))
        elif word:
            found |= _family_settings(word)
    if not found:
        raise Refusal(
            "no font", where="``font``", instead="give a name and a size, as Arial,8"
        )
    return found


def _font_size(text: str, size: float) -> float:
    if not SMALLEST_FONT <= size <= LARGEST_FONT:
        raise Refusal(
            f"a font has {SMALLEST_FONT:g} to {LARGEST_FONT:g} points",
            where="``font``",
            value=text,
        )
    return size


def _family_settings(name: str) -> dict[str, Any]:
    """Return the settings of a font for texts and formulas; Refusal if it is not
    installed."""
    if name in FAMILIES:
        fonts = "dejavuserif" if name == "serif" else "dejavusans"
        return {"font.family": [name], "mathtext.fontset": fonts}
    from matplotlib import font_manager

    try:
        font_manager.findfont(name, fallback_to_default=False)
    except ValueError:
        known = sorted({font.name for font in font_manager.fontManager.ttflist})
        nearest = difflib.get_close_matches(name, known, NAMED, 0.6)
        shown = [*dict.fromkeys([*nearest, *BUNDLED])]
        raise Refusal(
            f"no font {name!r} is installed here",
            where="``font``",
            instead=f"install it, or give another such as {', '.join(shown)}",
        ) from None
    upright = ("rm", "cal", "tt", "sf")
    return {
        "font.family": [name],
        "mathtext.fontset": "custom",
        **{f"mathtext.{kind}": name for kind in upright},
        "mathtext.it": f"{name}:italic",
        "mathtext.bf": f"{name}:bold",
        "mathtext.fallback": "stixsans",
    }


def font_points(size: float) -> float:
    """Return the size of a text that has this size in the project's style, in points of
    the style in use."""
    import matplotlib as mpl

    return size * mpl.rcParams["font.size"] / FONT_SIZE


# Colours


def named_colour_map(name: str) -> Any:
    """Return a colour map of matplotlib or of cmcrameri by its name."""
    from cmcrameri import cm  # registers its maps as cmc.NAME
    from matplotlib import colormaps

    for known in (name, f"cmc.{name}"):
        if known in colormaps:
            return colormaps[known]
    names = [*colormaps, *(x for x in vars(cm) if f"cmc.{x}" in colormaps)]
    instead = "give one of matplotlib's, such as RdBu_r, or cmcrameri's, such as vik"
    nearest = difflib.get_close_matches(str(name), names, 1, 0.5)
    if nearest:
        instead = f"did you mean {nearest[0]!r}?"
    raise Refusal(f"{name!r} is unknown", where="``cmap``", instead=instead)


def colours(default: Any) -> Any:
    """Return the colour map that the look asks for, else the default."""
    return current().colour_map or default
