"""The look of all pictures: the project's style, figures without pyplot's global state, files that appear whole."""

from __future__ import annotations

import functools
import inspect
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar, get_origin

from geomech.io.files import atomic_file
from rft.core.refusal import Refusal

if TYPE_CHECKING:
    from matplotlib.figure import Figure

GREEK = (
    "alpha",
    "gamma",
    "theta",
)  # letters that names of shape variables and parameters begin with
MARKED = 40  # points of a line up to which each has its marker
SOURCES = {  # what is drawn, by its class
    "Connection": "a Connection such as study.fitted",
    "Field": "a Field such as study.ccf()",
    "Fitted": "a measured gait, the result of geomech.fit_log",
    "Mapping": "a table such as study.displacement(...)",
    "Optimum": "an Optimum, the result of study.optimise()",
    "Result": "the Result of a question",
    "TwoForm": "a TwoForm such as study.two_form",
}
PACKED = 4  # of zlib's nine levels: half the time of the usual six, for files a twentieth larger
STYLE = {
    "font.size": 9,
    "axes.labelsize": 9,
    "axes.titlesize": 9,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "savefig.dpi": 200,
    "svg.fonttype": "none",
    "hatch.linewidth": 0.35,
    "lines.markersize": 3,
}


Arguments = ParamSpec("Arguments")
Drawn = TypeVar("Drawn")


def styled(draw: Callable[Arguments, Drawn]) -> Callable[Arguments, Drawn]:
    """Make a drawing function use the project's style, whatever the caller's is, and refuse what it does not draw."""

    @functools.wraps(draw)
    def in_style(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Drawn:
        import matplotlib as mpl

        if args:
            _require_drawn(draw, args[0])
        with mpl.rc_context(STYLE):
            return draw(*args, **kwargs)

    return in_style


def _require_drawn(draw: Callable[..., Any], value: Any) -> None:
    """Refuse a first argument of another class than the function draws."""
    kind = _drawn_kind(draw)
    if kind and not isinstance(value, kind):
        raise Refusal(f"{draw.__name__} draws {SOURCES[kind.__name__]}", value=value)


@functools.cache
def _drawn_kind(draw: Callable[..., Any]) -> type | None:
    """Return the class of the first argument by its annotation; None where several kinds will do."""
    first = next(iter(inspect.signature(draw).parameters.values()))
    try:  # the first alone: others may be of Matplotlib's types, which are imported for type checkers only
        hint = eval(first.annotation, draw.__globals__)
    except (NameError, TypeError):  # an annotation for type checkers alone, or none
        return None
    kind = get_origin(hint) or hint
    return kind if isinstance(kind, type) and kind.__name__ in SOURCES else None


@styled
def blank(width: float, height: float, layout: str = "constrained") -> Any:
    """Return a Figure, sizes in inches, whose Axes are laid out without overlap; "compressed" closes the gaps in a row of
    maps."""
    from geomech.plots.shown import ShownFigure

    fig = ShownFigure(figsize=(width, height), layout=layout)
    fig.get_layout_engine().set(wspace=0.06)
    return fig


@styled
def figure(
    width: float,
    height: float,
    columns: int = 1,
    rows: int = 1,
    layout: str = "constrained",
    **grid: Any,
) -> tuple[Any, Any]:
    """Return (Figure, array of Axes (rows, columns)) as `blank` does; both show in a notebook. ``grid`` as for matplotlib's
    GridSpec.

    Examples
    --------
    >>> from geomech.plots import figure
    >>> fig, axes = figure(6.0, 3.0, columns=2)
    >>> axes.shape
    (1, 2)
    """
    from geomech.plots.shown import ShownAxes

    fig, subplot = blank(width, height, layout), {"axes_class": ShownAxes}
    return fig, fig.subplots(
        rows, columns, squeeze=False, gridspec_kw=grid, subplot_kw=subplot
    )


def quantity(name: str, unit: str = "") -> str:
    """Return the label of an axis: the name with its unit in brackets, a letter with an index drawn as one.

    Examples
    --------
    >>> from geomech.plots import quantity
    >>> quantity("speed", "m/s")
    'speed (m/s)'
    """
    letter, _, index = name.partition("_")
    if index.isalnum() and (letter in GREEK or len(letter) == 1):
        name = (
            rf"$\{letter}_{{{index}}}$"
            if letter in GREEK
            else f"${letter}_{{{index}}}$"
        )
    return f"{name} ({unit})" if unit else name


ENTRY = 2.2  # in, of the width of a figure for an entry of its legend


def shared_legend(fig: Any, place: str = "outside upper center") -> None:
    """Draw one legend for all panels of a figure, with every label once; above or below them in as many columns as fit."""
    handles = {
        label: line
        for ax in fig.axes
        for line, label in zip(*ax.get_legend_handles_labels())
        if label.strip("_")
    }
    rows = (
        len(handles)
        if "right" in place
        else -(-len(handles) // max(1, int(fig.get_figwidth() / ENTRY)))
    )
    if handles:
        fig.legend(
            handles.values(), handles.keys(), loc=place, ncols=-(-len(handles) // rows)
        )


def axes_of(ax: Any, width: float = 3.4, height: float = 3.0) -> Any:
    """Return ax; without it pyplot's current Axes, where the caller has a figure of pyplot open, else new ones, of a size in
    inches, which a notebook shows."""
    if ax is not None:
        return ax
    pyplot = sys.modules.get("matplotlib.pyplot")
    return (
        pyplot.gca()
        if pyplot and pyplot.get_fignums()
        else figure(width, height)[1][0, 0]
    )


def check_format(path: str | Path) -> Path:
    """Return path if its ending is a figure format, else Refusal."""
    formats = (".png", ".pdf", ".svg")
    path = Path(path)
    if path.suffix.lower() not in formats:
        raise Refusal(
            f"cannot draw {path}", instead=f"end the name in {', '.join(formats)}"
        )
    return path


@styled
def save(fig: Figure, *paths: str | Path) -> None:
    """Write a figure, or that of Axes, to files, each of which appears whole or not at all. The figure is laid out once and
    drawn once for each file, where `savefig` lays out and draws twice for each.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from geomech.plots import figure, save
    >>> fig, axes = figure(3.0, 3.0)
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "empty.png"
    >>> save(fig, path)
    >>> path.exists()
    True
    """
    fig = getattr(fig, "figure", fig)
    canvas, engine, dpi = fig.canvas, fig.get_layout_engine(), fig.dpi
    try:
        for path in map(check_format, paths):
            with atomic_file(path) as part:
                fig.dpi = STYLE["savefig.dpi"]
                _print(fig, path.suffix.lower(), part)
            fig.set_layout_engine("none")
    finally:
        fig.set_layout_engine(engine)
        fig.set_canvas(canvas)
        fig.dpi = dpi


def _print(fig, ending: str, file: Path) -> None:
    if ending == ".png":
        from matplotlib.backends.backend_agg import FigureCanvasAgg

        FigureCanvasAgg(fig).print_png(file, pil_kwargs={"compress_level": PACKED})
    elif ending == ".pdf":
        from matplotlib.backends.backend_pdf import FigureCanvasPdf

        FigureCanvasPdf(fig).print_pdf(file)
    else:
        from matplotlib.backends.backend_svg import FigureCanvasSVG

        FigureCanvasSVG(fig).print_svg(file)
