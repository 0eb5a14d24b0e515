"""The common look of the figures: colours by role, grey guides, axes of a phase, legends, tables of numbers."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

# Colours of Okabe and Ito (Color Universal Design, 2008), which readers who lack one of the cones tell apart; markers
# tell the same curves apart in print without colour.
SEQUENCE = BLACK, BLUE, GREEN, VERMILION, PINK = (
    "black",
    "#0072B2",
    "#009E73",
    "#D55E00",
    "#CC79A7",
)
MARKERS = "osD^v"
LOOSE, CLOSE, FLUID = (
    VERMILION,
    BLUE,
    "0.5",
)  # two packings of grains, and a viscous fluid
GUIDE = {"color": "0.6", "lw": 0.8, "zorder": 0}  # of lines that are no results
SHADED = {"color": "0.87", "lw": 0}  # of ranges that are no results
SURFACE = {"color": "peru", "lw": 1.0, "zorder": 0}  # of the ground
NOTE = {"fontsize": 8, "color": "0.3"}
QUARTERS = ("0", r"$\pi/2$", r"$\pi$", r"$3\pi/2$", r"$2\pi$")


def shades(count: int) -> list:
    """Return colours of an ordered quantity, dark to light, which stay in order without colour."""
    from cmcrameri import cm

    return [cm.batlow(x) for x in np.linspace(0.0, 0.8, count)]


def sparse(k: int, points: int) -> dict:
    """Return the look of curve ``k`` of several that have no order: a colour, and a marker at four of its points."""
    first = (
        points // 8 + k * points // 40
    )  # markers of curves that coincide stand beside one another
    return {
        "color": SEQUENCE[k],
        "marker": MARKERS[k],
        "ms": 4,
        "markevery": (first, max(1, points // 4)),
    }


def zero_line(ax) -> None:
    """Draw a grey line at the height zero."""
    ax.axhline(0.0, **GUIDE)


def order_line(ax, x, error, order: int) -> None:
    """Draw errors that fall as x^-order from the first of those given, on logarithmic axes."""
    x = np.asarray(x, float)
    ax.plot(
        x, error[0] * (x / x[0]) ** -order, **GUIDE, ls="--", label=f"order {order}"
    )


def quarter_ticks(ax, which: str, count: int = 5) -> None:
    """Mark the first quarters of a cycle on an axis, "x" or "y"."""
    ax.set(
        **{
            f"{which}ticks": np.pi / 2 * np.arange(count),
            f"{which}ticklabels": QUARTERS[:count],
        }
    )


def phase_axis(ax, which: str = "x", label: str = "phase of the cycle (rad)") -> None:
    """Set an axis, "x" or "y", to the phase over one cycle."""
    quarter_ticks(ax, which)
    ax.set(**{f"{which}lim": (0, 2 * np.pi), f"{which}label": label})


def named_ticks(ax, values, names: Sequence[str]) -> None:
    """Name some values of the axis of x, and no others."""
    ax.set_xticks(values, names)
    ax.minorticks_off()


def grid(ax) -> None:
    """Draw the grid of a diagram whose values are to be read off."""
    ax.grid(True, which="major", lw=0.3, color="0.85")


def lettered(axes) -> None:
    """Name panels (a), (b), ... in reading order."""
    for ax, letter in zip(axes.flat, "abcdefgh"):
        ax.set_title(f"({letter})", loc="left")


def entry(ax, label: str, **look) -> None:
    """Add an entry to the legend for a look that several curves share, in grey if it is not a colour."""
    ax.plot([], [], label=label, **{"color": "0.3", **look})


def legend_above(ax, columns: int = 1, **more) -> None:
    """Draw the legend above the axes."""
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=columns, **more)


def legend_right(ax, **more) -> None:
    """Draw the legend to the right of the axes."""
    ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), **more)


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return lines of text with the cells under their heads, the first column to the left and the others to the right."""
    lines = [heads, *rows]
    first, *others = (max(map(len, column)) for column in zip(*lines))
    aligned = (
        [row[0].ljust(first), *(x.rjust(width) for x, width in zip(row[1:], others))]
        for row in lines
    )
    return "\n".join("   ".join(cells).rstrip() for cells in aligned)
