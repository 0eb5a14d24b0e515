"""The look of all pictures: the project's style, figures without pyplot's global state, files that appear whole."""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from geomech.io.files import atomic_file
from rft.refusal import Refusal

GREEK = ("alpha", "gamma", "theta")  # letters that names of shape variables and parameters begin with
MARKED = 40  # points of a line up to which each has its marker
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
    """Make a drawing function use the project's style, whatever the caller's is."""

    @functools.wraps(draw)
    def in_style(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Drawn:
        import matplotlib as mpl

        with mpl.rc_context(STYLE):
            return draw(*args, **kwargs)

    return in_style


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
    width: float, height: float, columns: int = 1, rows: int = 1, layout: str = "constrained", **grid: Any
) -> tuple[Any, Any]:
    """Return (Figure, array of Axes (rows, columns)) as `blank` does; both show in a notebook. ``grid`` as for matplotlib's
    GridSpec."""
    from geomech.plots.shown import ShownAxes

    fig, subplot = blank(width, height, layout), {"axes_class": ShownAxes}
    return fig, fig.subplots(rows, columns, squeeze=False, gridspec_kw=grid, subplot_kw=subplot)


def quantity(name: str, unit: str = "") -> str:
    """Return the label of an axis: the name with its unit in brackets, a letter with an index drawn as one."""
    letter, _, index = name.partition("_")
    if index.isalnum() and (letter in GREEK or len(letter) == 1):
        name = rf"$\{letter}_{{{index}}}$" if letter in GREEK else f"${letter}_{{{index}}}$"
    return f"{name} ({unit})" if unit else name


ENTRY = 2.2  # in, of the width of a figure for an entry of its legend


def shared_legend(fig: Any, place: str = "outside upper center") -> None:
    """Draw one legend for all panels of a figure, with every label once; above or below them in as many columns as fit."""
    handles = {
        label: line for ax in fig.axes for line, label in zip(*ax.get_legend_handles_labels()) if label.strip("_")
    }
    rows = len(handles) if "right" in place else -(-len(handles) // max(1, int(fig.get_figwidth() / ENTRY)))
    if handles:
        fig.legend(handles.values(), handles.keys(), loc=place, ncols=-(-len(handles) // rows))


def axes_of(ax: Any) -> Any:
    """Return ax; without it pyplot's current Axes, where the caller has a figure of pyplot open, else new ones that a notebook
    shows."""
    if ax is not None:
        return ax
    pyplot = sys.modules.get("matplotlib.pyplot")
    return pyplot.gca() if pyplot and pyplot.get_fignums() else figure(3.4, 3.0)[1][0, 0]


def check_format(path: str | Path) -> Path:
    """Return path if its ending is a figure format, else Refusal."""
    formats = (".png", ".pdf", ".svg")
    path = Path(path)
    if path.suffix.lower() not in formats:
        raise Refusal(f"cannot draw {path}", instead=f"end the name in {', '.join(formats)}")
    return path


@styled
def save(fig, *paths: str | Path) -> None:
    """Write a figure to files, each of which appears whole or not at all. The figure is laid out once and drawn once for each
    file, where `savefig` lays out and draws twice for each."""
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
