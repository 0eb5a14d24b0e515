"""The look of all pictures: the project's style, figures without pyplot's global state,
files that appear whole."""

from __future__ import annotations

import functools
import inspect
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar, get_origin

from geomech.io.files import atomic_file
from geomech.plots import look
from geomech.plots.look import STYLE as STYLE
from geomech.plots.shown import ShownAxes, ShownFigure
from rft.core.refusal import Refusal

if TYPE_CHECKING:
    from matplotlib.figure import Figure

GREEK = ("alpha", "gamma", "theta")  # first letters of shape variables and parameters
PANEL_WIDTH = 2.25  # in, of the narrowest panel of several side by side
STACKED_HEIGHT = 2.3  # in, of a panel with curves that stands above another
SHORTEST_PANEL = 0.8  # of its usual height, of a panel that is narrower than usual
MARKED = 40  # points of the longest line that has a marker at each
LEGEND_ENTRY = 2.2  # in, of a figure's width, for an entry of its legend
MINUS_SIGN = "\N{MINUS SIGN}"
SOURCES = {  # where a value of each class comes from, for refusals
    "Connection": "a Connection such as study.fitted",
    "Field": "a Field such as study.ccf()",
    "Fitted": "a measured gait, the result of geomech.fit_log",
    "Mapping": "a table such as study.displacement(...)",
    "Optimum": "an Optimum, the result of study.optimise()",
    "Result": "the Result of a question",
    "TwoForm": "a TwoForm such as study.two_form",
}
# Of zlib's nine levels: half the time of the usual six, for files a twentieth larger.
PNG_COMPRESSION = 4


Arguments = ParamSpec("Arguments")
Drawn = TypeVar("Drawn")


def styled(draw: Callable[Arguments, Drawn]) -> Callable[Arguments, Drawn]:
    """Return a drawing function that uses the look that is asked for
    (`geomech.plots.look`), and refuses a first argument that it does not draw.

    A figure that it returns fits the look."""

    @functools.wraps(draw)
    def in_style(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Drawn:
        import matplotlib as mpl

        if args:
            _require_drawn(draw, args[0])
        asked = look.current()
        with mpl.rc_context(asked.rc):
            drawn = draw(*args, **kwargs)
            if isinstance(drawn, ShownFigure):
                drawn.finish(asked)
        return drawn

    return in_style


def _require_drawn(draw: Callable[..., Any], value: Any) -> None:
    """Refuse a first argument of another class than the function draws."""
    kind = _drawn_kind(draw)
    if kind and not isinstance(value, kind):
        raise Refusal(f"{draw.__name__} draws {SOURCES[kind.__name__]}", value=value)


@functools.cache
def _drawn_kind(draw: Callable[..., Any]) -> type | None:
    """Return the class of SOURCES that the first argument is annotated with, or
    None."""
    first = next(iter(inspect.signature(draw).parameters.values()))
    # Only the first annotation: others may be types of Matplotlib, which are imported
    # for type checkers alone.
    try:
        hint = eval(first.annotation, draw.__globals__)
    except (NameError, TypeError):  # an annotation for type checkers alone, or none
        return None
    kind = get_origin(hint) or hint
    if isinstance(kind, type) and kind.__name__ in SOURCES:
        return kind
    return None


def blank(width: float, height: float, layout: str = "constrained") -> Any:
    """Return an empty Figure whose Axes will be laid out without overlap.

    width, height: in inches. layout: "constrained", or "compressed", which closes the
    gaps in a row of maps."""
    import matplotlib as mpl

    asked = look.current()
    with mpl.rc_context(asked.rc):
        fig = ShownFigure(figsize=(asked.inches or width, height), layout=layout)
    fig.rc = asked.rc
    fig.get_layout_engine().set(wspace=0.06)
    return fig


@styled
def figure(
    width: float,
    height: float,
    columns: int = 1,
    rows: int = 1,
    layout: str = "constrained",
    narrowest: float = PANEL_WIDTH,
    **grid: Any,
) -> tuple[Any, Any]:
    """Return (Figure, array of Axes (rows, columns)), both of which a notebook shows.

    width, height: in inches, of the default look. In a narrower one, panels that have
    no room side by side stand one above the other. layout: "constrained", or
    "compressed", which closes the gaps in a row of maps. narrowest: width that a panel
    needs, in. grid: as for matplotlib's GridSpec.

    Examples
    --------
    >>> from geomech.plots import figure
    >>> fig, axes = figure(6.0, 3.0, columns=2)
    >>> axes.shape
    (1, 2)
    """
    subplot = {"axes_class": ShownAxes}
    fit = columns_that_fit(width, columns, narrowest)
    return panels(width, height, columns, rows, fit, subplot, layout, grid)


def panels(
    width: float,
    height: float,
    columns: int,
    rows: int,
    fit: int,
    subplot: dict[str, Any],
    layout: str = "constrained",
    grid: dict[str, Any] | None = None,
) -> tuple[Any, Any]:
    """Return (Figure, array of Axes (rows, columns)), of which only ``fit`` stand side
    by side.

    width, height: in inches, of the default look. subplot, grid: of
    `Figure.subplots`."""
    if fit == columns:
        fig = blank(width, height_that_fits(width, height), layout)
        axes = fig.subplots(
            rows, columns, squeeze=False, gridspec_kw=grid, subplot_kw=subplot
        )
        return fig, axes
    lines = -(-columns // fit)
    panel_height = height_that_fits(width / columns * fit, height / rows)
    if layout == "constrained" and "projection" not in subplot:
        panel_height = min(panel_height, STACKED_HEIGHT)
    fig = blank(width, panel_height * lines * rows, layout)
    cells = fig.subplots(lines * rows, fit, squeeze=False, subplot_kw=subplot)
    axes = cells.reshape(rows, lines * fit)
    for ax in axes[:, columns:].flat:
        ax.remove()
    return fig, axes[:, :columns]


def columns_that_fit(width: float, columns: int, narrowest: float = PANEL_WIDTH) -> int:
    """Return how many of the columns of a figure the look has room for side by side.

    width: of the figure in the default look, in. narrowest: width that a panel needs,
    in."""
    inches = look.current().inches
    if inches is None or inches >= width:
        return columns
    narrowest = min(narrowest, width / columns)
    return min(columns, max(1, int(inches / narrowest + 1e-9)))


def height_that_fits(width: float, height: float) -> float:
    """Return the height of a figure, or of a part, whose size is (width, height) in the
    default look."""
    inches = look.current().inches
    if inches is None:
        return height
    return height * min(1.0, max(SHORTEST_PANEL, inches / width))


def quantity(name: str, unit: str = "") -> str:
    """Return the label of an axis: the name with its unit in brackets, and a letter
    with an index as a formula.

    Examples
    --------
    >>> from geomech.plots import quantity
    >>> quantity("speed", "m/s")
    'speed (m/s)'
    """
    letter, _, index = name.partition("_")
    if index.isalnum() and (letter in GREEK or len(letter) == 1):
        if letter in GREEK:
            letter = rf"\{letter}"
        name = f"${letter}_{{{index}}}$"
    if unit:
        return f"{name} ({unit})"
    return name


def with_minus_signs(text: str) -> str:
    """Return a text of numbers with minus signs in place of hyphens."""
    return text.replace("-", MINUS_SIGN)


def shared_legend(fig: Any, place: str = "outside upper center") -> None:
    """Draw one legend for all panels of a figure, with every label once.

    place: a location of matplotlib's legends. At the right it has one column, above or
    below the panels as many as fit."""
    handles = {}
    for ax in fig.axes:
        for line, label in zip(*ax.get_legend_handles_labels()):
            if label.strip("_"):
                handles[label] = line
    if not handles:
        return
    columns = 1
    if "right" not in place:
        most = max(1, int(fig.get_figwidth() / LEGEND_ENTRY))
        rows = -(-len(handles) // most)
        columns = -(-len(handles) // rows)
    fig.legend(handles.values(), handles.keys(), loc=place, ncols=columns)


def axes_of(ax: Any, width: float = 3.4, height: float = 3.0) -> Any:
    """Return the Axes to draw on: ``ax`` if it is given, else pyplot's current ones if
    the caller has a figure of pyplot open, else new ones, which a notebook shows.

    width, height: of the new figure, in inches."""
    if ax is not None:
        return ax
    pyplot = sys.modules.get("matplotlib.pyplot")
    if pyplot and pyplot.get_fignums():
        return pyplot.gca()
    _, axes = figure(width, height)
    return axes[0, 0]


def check_format(path: str | Path) -> Path:
    """Return the path if its ending is a format of pictures; else raise Refusal."""
    formats = (".png", ".pdf", ".svg")
    path = Path(path)
    if path.suffix.lower() not in formats:
        raise Refusal(
            f"cannot draw {path}", instead=f"end the name in {', '.join(formats)}"
        )
    return path


def save(fig: Figure, *paths: str | Path) -> None:
    """Write a figure, or the figure of Axes, to files, each of which appears whole or
    not at all. Letters stay text in .pdf and .svg.

    The figure is laid out once and drawn once for each file; `savefig` lays out and
    draws twice for each.

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
    import matplotlib as mpl

    fig = getattr(fig, "figure", fig)
    canvas = fig.canvas
    engine = fig.get_layout_engine()
    dpi = fig.dpi
    rc = {**look.current().rc, **getattr(fig, "rc", {})}
    try:
        for path in map(check_format, paths):
            with atomic_file(path) as part, mpl.rc_context(rc):
                if rc["savefig.dpi"] != "figure":
                    fig.dpi = rc["savefig.dpi"]
                _print(fig, path.suffix.lower(), part)
            fig.set_layout_engine("none")
    finally:
        fig.set_layout_engine(engine)
        fig.set_canvas(canvas)
        fig.dpi = dpi


def _print(fig, ending: str, file: Path) -> None:
    if ending == ".png":
        from matplotlib.backends.backend_agg import FigureCanvasAgg

        FigureCanvasAgg(fig).print_png(
            file, pil_kwargs={"compress_level": PNG_COMPRESSION}
        )
    elif ending == ".pdf":
        from matplotlib.backends.backend_pdf import FigureCanvasPdf

        FigureCanvasPdf(fig).print_pdf(file)
    else:
        from matplotlib.backends.backend_svg import FigureCanvasSVG

        FigureCanvasSVG(fig).print_svg(file)
