"""Forces along a body over a cycle: maps over place and phase, and thrust and drag stacked."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from geomech.core.errors import choose
from geomech.core.variables import Result
from geomech.plots.maps import extend, limit_of
from geomech.plots.style import figure, shared_legend, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MAPS = {  # titles, and what the colour bar says of the sign
    "forward": ("force forwards", "thrust +, drag \N{MINUS SIGN}"),
    "normal": ("force across the body", "to its left +"),
    "tangential": ("force along the body", "to its head +"),
    "power": ("power into the medium", ""),
    "moment": ("bending moment", "left side works +"),
}
STACKS = ("phase", "place")
DEFAULT = ("forward", "phase", "place")
COLOURS = {"normal": "#0072B2", "tangential": "#D55E00", "ends": "#009E73"}
TICKS = {
    0.0: "0",
    np.pi / 2: r"$\pi/2$",
    np.pi: r"$\pi$",
    3 * np.pi / 2: r"$3\pi/2$",
    2 * np.pi: r"$2\pi$",
}
PLACE, PHASE = "place on the body, tail 0 to head 1", "phase of the cycle (rad)"
COLUMNS = 3  # of panels


@styled
def forces_figure(
    result: Result, panels: Sequence[str] = (), *, clim: float | str | None = None
) -> Figure:
    """Draw forces along a body: maps over place and phase ("forward", "normal", "tangential", "power", "moment"), and thrust
    and drag stacked by their parts against "phase" or "place".

    panels: which, by default the force forwards and both stacks. clim: limit of the colours of each map on either side of
    zero, a number or a percentile of the values' size such as "98%".

    Examples
    --------
    >>> import geomech
    >>> forces = geomech.study("seven-link-wave", phases=32).forces()
    >>> fig = geomech.plots.forces_figure(forces, ["power"])
    """
    names = [choose("panel", name, (*MAPS, *STACKS)) for name in panels or DEFAULT]
    columns = min(COLUMNS, len(names))
    rows = -(-len(names) // columns)
    fig, axes = figure(3.7 * columns, 0.5 + 2.9 * rows, columns, rows)
    for name, ax in zip(names, axes.ravel()):
        if name in MAPS:
            force_map(result, name, ax, clim)
        else:
            (stacked_by_phase if name == "phase" else stacked_by_place)(result, ax)
    for ax in axes.ravel()[len(names) :]:
        ax.set_axis_off()
    shared_legend(fig)
    return fig


def force_map(
    result: Result, name: str, ax: Axes, clim: float | str | None = None
) -> Axes:
    """Draw a quantity of MAPS over place and phase; on that of the moment also where the right side starts (solid) and ends
    (dashed) to work."""
    from cmcrameri import cm

    v = result["bending_moment" if name == "moment" else name]
    values = np.concatenate([v.values, v.values[:1]])
    phase = (
        (np.arange(len(values) + 1) - 0.5) * 2 * np.pi / len(v.values)
    )  # ends of the rows
    place = np.append(0.0, np.cumsum(result["length"].values))
    if name == "moment":  # at the points between elements; at the ends it vanishes
        place, values = (
            np.concatenate([[0.0], (place[1:] + place[:-1]) / 2, [1.0]]),
            np.pad(values, ((0, 0), (1, 1))),
        )
    top = limit_of(v.values, clim)
    image = ax.pcolormesh(
        place, phase, values, cmap=cm.vik, vmin=-top, vmax=top, rasterized=True
    )
    title, sign = MAPS[name]
    ax.set_title(title)
    bar = ax.figure.colorbar(image, ax=ax, extend=extend(v.values, top))
    bar.set_label(f"{sign} ({_unit(v.unit)})".strip())
    if name == "moment":
        _lines_of_activation(result, ax)
    ax.set(xlabel=PLACE, ylabel=PHASE, xlim=(0, 1), ylim=(0, 2 * np.pi))
    ax.set_yticks(list(TICKS), list(TICKS.values()))
    return ax


def _lines_of_activation(result: Result, ax: Axes) -> None:
    """Draw onset and offset of the right side, also where the lines come back into the cycle."""
    for name, dashes in (("onset", "-"), ("offset", "--")):
        for turn in (-2 * np.pi, 0.0, 2 * np.pi):
            label = f"{name} of the right side" if turn == 0 else None
            ax.plot(
                result["joint"].values,
                result[name].values + turn,
                color="black",
                lw=1.0,
                ls=dashes,
                label=label,
            )


def stacked_by_phase(result: Result, ax: Axes) -> Axes:
    """Draw thrust above zero and drag below it, by normal and tangential forces and the ends, against the phase; the line is
    their sum."""
    phase = np.append(result["phase"].values, 2 * np.pi)
    closed = lambda name: np.append(result[name].values, result[name].values[0])
    total = _stack(
        ax,
        phase,
        {part: (closed(f"thrust_{part}"), closed(f"drag_{part}")) for part in COLOURS},
    )
    ax.plot(phase, total, color="black", lw=1.2, label="sum")
    ax.set(
        xlabel=PHASE,
        ylabel=f"force forwards ({_unit(result['thrust_normal'].unit)})",
        xlim=(0, 2 * np.pi),
    )
    ax.set_xticks(list(TICKS), list(TICKS.values()))
    ax.set_title("thrust and drag through the cycle")
    return ax


def stacked_by_place(result: Result, ax: Axes) -> Axes:
    """Draw the cycle's mean of thrust above zero and of drag below it, by normal and tangential forces, against the place on
    the body; forces on the ends, which have no length, are named."""
    edges = np.append(0.0, np.cumsum(result["length"].values))
    steps = lambda name: np.repeat(result[name].values, 2)
    place = np.repeat(edges, 2)[1:-1]
    parts = {
        part: (steps(f"mean_thrust_{part}"), steps(f"mean_drag_{part}"))
        for part in ("normal", "tangential")
    }
    total = _stack(ax, place, parts)
    ax.plot(place, total, color="black", lw=1.2, label="sum")
    density, unit = _unit(result["forward"].unit), _unit(result["thrust_ends"].unit)
    ax.set(xlabel=PLACE, ylabel=f"force forwards per length ({density})", xlim=(0, 1))
    ends = {end: result[f"{end}_forward"].values.mean() for end in ("tail", "head")}
    named = [f"{end} {x:.3g}" for end, x in ends.items() if x]
    ax.set_title(
        "mean thrust and drag"
        + (f"\nbesides, on the ends: {', '.join(named)} {unit}" if named else "")
    )
    return ax


def _stack(
    ax: Axes, x: np.ndarray, parts: dict[str, tuple[np.ndarray, np.ndarray]]
) -> np.ndarray:
    """Fill thrust upwards and drag downwards, part on part; return their sum."""
    up, down = np.zeros_like(x), np.zeros_like(x)
    for part, (thrust, drag) in parts.items():
        if thrust.any() or drag.any():
            label = f"by {part} forces" if part != "ends" else "on the ends"
            ax.fill_between(
                x, up, up + thrust, color=COLOURS[part], alpha=0.75, lw=0, label=label
            )
            ax.fill_between(x, down, down + drag, color=COLOURS[part], alpha=0.4, lw=0)
        up, down = up + thrust, down + drag
    ax.axhline(0.0, color="0.3", lw=0.6)
    return up + down


def _unit(unit: str) -> str:
    return unit.replace(" x ", r" $\times$ ")
