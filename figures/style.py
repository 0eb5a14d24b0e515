"""The common look of the figures: colours by role, grey guides, axes of a phase,
legends, tables of numbers."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

# Colours of Okabe and Ito (Color Universal Design, 2008), which colour-blind readers
# tell apart; in print without colour, markers do.
BLACK = "black"
BLUE = "#0072B2"
GREEN = "#009E73"
VERMILION = "#D55E00"
PINK = "#CC79A7"
SEQUENCE = (BLACK, BLUE, GREEN, VERMILION, PINK)
MARKERS = "osD^v"
LOOSE = VERMILION  # a loose packing of grains
CLOSE = BLUE  # a close packing
FLUID = "0.5"  # a viscous fluid
GUIDE = {"color": "0.6", "lw": 0.8, "zorder": 0}  # of lines that are no results
SHADED = {"color": "0.87", "lw": 0}  # of ranges that are no results
SURFACE = {"color": "peru", "lw": 1.0, "zorder": 0}  # of the ground
NOTE = {"fontsize": 8, "color": "0.3"}
QUARTERS = ("0", r"$\pi/2$", r"$\pi$", r"$3\pi/2$", r"$2\pi$")


def shades(count: int) -> list:
    """Return colours of an ordered quantity, dark to light, in order in grey as
    well."""
    from cmcrameri import cm

    return [cm.batlow(x) for x in np.linspace(0.0, 0.8, count)]


def curve_look(k: int, points: int) -> dict:
    """Return the look of curve ``k`` of several without an order: a colour, and a
    marker at four of its points."""
    # Each curve starts elsewhere, so that markers of equal curves do not coincide.
    first = points // 8 + k * points // 40
    return {
        "color": SEQUENCE[k],
        "marker": MARKERS[k],
        "ms": 4,
        "markevery": (first, max(1, points // 4)),
    }


def draw_zero_line(ax) -> None:
    """Draw a grey line at the height zero."""
    ax.axhline(0.0, **GUIDE)


def draw_order_line(ax, x, error, order: int) -> None:
    """Draw errors that fall as x^-order from the first of ``error``, on logarithmic
    axes."""
    x = np.asarray(x, float)
    line = error[0] * (x / x[0]) ** -order
    ax.plot(x, line, **GUIDE, ls="--", label=f"order {order}")


def set_quarter_ticks(ax, which: str, count: int = 5) -> None:
    """Mark the first quarters of a cycle on an axis, "x" or "y"."""
    ticks = np.pi / 2 * np.arange(count)
    ax.set(**{f"{which}ticks": ticks, f"{which}ticklabels": QUARTERS[:count]})


def set_phase_axis(
    ax, which: str = "x", label: str = "phase of the cycle (rad)"
) -> None:
    """Set an axis, "x" or "y", to the phase over one cycle."""
    set_quarter_ticks(ax, which)
    ax.set(**{f"{which}lim": (0, 2 * np.pi), f"{which}label": label})


def set_named_ticks(ax, values, names: Sequence[str]) -> None:
    """Label only these values of the x axis."""
    ax.set_xticks(values, names)
    ax.minorticks_off()


def draw_grid(ax) -> None:
    """Draw grid lines, from which a reader takes values."""
    ax.grid(True, which="major", lw=0.3, color="0.85")


def letter_panels(axes) -> None:
    """Title panels (a), (b), ... in reading order."""
    for ax, letter in zip(axes.flat, "abcdefgh"):
        ax.set_title(f"({letter})", loc="left")


def add_entry(ax, label: str, **look) -> None:
    """Add an entry to the legend for a look that several curves share, grey by
    default."""
    ax.plot([], [], label=label, **{"color": "0.3", **look})


def draw_legend_above(ax, columns: int = 1, **more) -> None:
    """Draw the legend above the axes."""
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=columns, **more)


def draw_legend_right(ax, **more) -> None:
    """Draw the legend to the right of the axes."""
    ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), **more)


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return lines of text with the cells under their heads, the first column aligned
    to the left and the others to the right."""
    lines = [heads, *rows]
    first_width, *widths = (max(map(len, column)) for column in zip(*lines))
    text = []
    for first, *others in lines:
        cells = [first.ljust(first_width)]
        cells += [cell.rjust(width) for cell, width in zip(others, widths)]
        text.append("   ".join(cells).rstrip())
    return "\n".join(text)
