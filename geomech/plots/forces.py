"""Forces along a body over a cycle: maps over place and phase, and thrust and drag
stacked."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from geomech.core.errors import choose
from geomech.core.variables import Result
from geomech.plots.maps import colorbar_extend, draw_colours, scale_limit
from geomech.plots.style import figure, shared_legend, styled, with_minus_signs

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MAPS = {  # title, and what the colour bar says of the sign
    "forward": ("force forwards", "thrust +, drag \N{MINUS SIGN}"),
    "normal": ("force across the body", "to its left +"),
    "tangential": ("force along the body", "to its head +"),
    "power": ("power into the medium", ""),
    "moment": ("bending moment", "left side works +"),
}
STACKS = ("phase", "place")
DEFAULT_PANELS = ("forward", "phase", "place")
COLOURS = {"normal": "#0072B2", "tangential": "#D55E00", "ends": "#009E73"}
TICKS = {
    0.0: "0",
    np.pi / 2: r"$\pi/2$",
    np.pi: r"$\pi$",
    3 * np.pi / 2: r"$3\pi/2$",
    2 * np.pi: r"$2\pi$",
}
PLACE_LABEL = "place on the body, tail 0 to head 1"
PHASE_LABEL = "phase of the cycle (rad)"
COLUMNS = 3  # of panels, at most


@styled
def forces_figure(
    result: Result, panels: Sequence[str] = (), *, clim: float | str | None = None
) -> Figure:
    """Draw forces along a body: maps over place and phase, and thrust and drag stacked.

    panels: of the maps "forward", "normal", "tangential", "power" and "moment", and of
    the stacks against "phase" and "place"; by default the force forwards and both
    stacks.
    clim: limit of the colours of each map on either side of zero, a number or a
    percentile of the values' size such as "98%".

    Examples
    --------
    >>> import geomech
    >>> forces = geomech.study("seven-link-wave", phases=32).forces()
    >>> fig = geomech.plots.forces_figure(forces, ["power"])
    """
    available = (*MAPS, *STACKS)
    names = [choose("panel", name, available) for name in panels or DEFAULT_PANELS]
    columns = min(COLUMNS, len(names))
    rows = -(-len(names) // columns)
    fig, axes = figure(3.7 * columns, 0.5 + 2.9 * rows, columns, rows)
    for name, ax in zip(names, axes.ravel()):
        if name == "phase":
            stacked_by_phase(result, ax)
        elif name == "place":
            stacked_by_place(result, ax)
        else:
            force_map(result, name, ax, clim)
    for ax in axes.ravel()[len(names) :]:
        ax.set_axis_off()
    shared_legend(fig)
    return fig


# Maps


def force_map(
    result: Result, name: str, ax: Axes, clim: float | str | None = None
) -> Axes:
    """Draw a quantity of MAPS over place and phase.

    The map of the moment also shows where the right side starts (solid) and ends
    (dashed) to work."""
    is_moment = name == "moment"
    variable = result["bending_moment" if is_moment else name]
    phases = len(variable.values)
    values = np.concatenate([variable.values, variable.values[:1]])
    phase_edges = (np.arange(phases + 2) - 0.5) * 2 * np.pi / phases
    place_edges = _element_ends(result)
    if is_moment:
        # Moments are those at the points between elements; at the ends they vanish.
        centres = (place_edges[1:] + place_edges[:-1]) / 2
        place_edges = np.concatenate([[0.0], centres, [1.0]])
        values = np.pad(values, ((0, 0), (1, 1)))

    top = scale_limit(variable.values, clim)
    image = draw_colours(ax, place_edges, phase_edges, values, top, "flat")
    title, sign = MAPS[name]
    ax.set_title(title)
    extend = colorbar_extend(variable.values, top)
    bar = ax.figure.colorbar(image, ax=ax, extend=extend)
    bar.set_label(f"{sign} ({_unit_label(variable.unit)})".strip())
    if is_moment:
        _draw_activation(result, ax)
    ax.set(xlabel=PLACE_LABEL, ylabel=PHASE_LABEL, xlim=(0, 1), ylim=(0, 2 * np.pi))
    ax.set_yticks(list(TICKS), list(TICKS.values()))
    return ax


def _element_ends(result: Result) -> np.ndarray:
    """Return the places of the elements' ends, tail 0 to head 1."""
    return np.append(0.0, np.cumsum(result["length"].values))


def _draw_activation(result: Result, ax: Axes) -> None:
    """Draw onset and offset of the right side over the joints; a line that leaves the
    cycle comes back at its other end."""
    joints = result["joint"].values
    for name, dashes in (("onset", "-"), ("offset", "--")):
        phase = result[name].values
        look = {"color": "black", "lw": 1.0, "ls": dashes}
        ax.plot(joints, phase - 2 * np.pi, **look)
        ax.plot(joints, phase, label=f"{name} of the right side", **look)
        ax.plot(joints, phase + 2 * np.pi, **look)


# Stacks


def stacked_by_phase(result: Result, ax: Axes) -> Axes:
    """Draw thrust above zero and drag below it against the phase, by normal and
    tangential forces and forces on the ends; the line is their sum."""
    phase = np.append(result["phase"].values, 2 * np.pi)

    def closed(name: str) -> np.ndarray:
        values = result[name].values
        return np.append(values, values[0])

    parts = {
        part: (closed(f"thrust_{part}"), closed(f"drag_{part}")) for part in COLOURS
    }
    total = _stack(ax, phase, parts)
    ax.plot(phase, total, color="black", lw=1.2, label="sum")
    unit = _unit_label(result["thrust_normal"].unit)
    ax.set(xlabel=PHASE_LABEL, ylabel=f"force forwards ({unit})", xlim=(0, 2 * np.pi))
    ax.set_xticks(list(TICKS), list(TICKS.values()))
    ax.set_title("thrust and drag through the cycle")
    return ax


def stacked_by_place(result: Result, ax: Axes) -> Axes:
    """Draw the cycle's mean of thrust above zero and of drag below it against the place
    on the body, by normal and tangential forces.

    Forces on the ends, which have no length, are written in the title."""
    place = np.repeat(_element_ends(result), 2)[1:-1]

    def steps(name: str) -> np.ndarray:
        return np.repeat(result[name].values, 2)

    parts = {}
    for part in ("normal", "tangential"):
        parts[part] = (steps(f"mean_thrust_{part}"), steps(f"mean_drag_{part}"))
    total = _stack(ax, place, parts)
    ax.plot(place, total, color="black", lw=1.2, label="sum")
    unit = _unit_label(result["forward"].unit)
    ax.set(xlabel=PLACE_LABEL, ylabel=f"force forwards per length ({unit})")
    ax.set(xlim=(0, 1))
    ax.set_title("mean thrust and drag" + _end_forces(result))
    return ax


def _end_forces(result: Result) -> str:
    """Return a line of the mean forces on the ends, or "" where there are none."""
    forces = []
    for end in ("tail", "head"):
        mean = result[f"{end}_forward"].values.mean()
        if mean:
            forces.append(with_minus_signs(f"{end} {mean:.3g}"))
    if not forces:
        return ""
    unit = _unit_label(result["thrust_ends"].unit)
    return f"\nforces on the ends: {', '.join(forces)} {unit}"


def _stack(
    ax: Axes, x: np.ndarray, parts: dict[str, tuple[np.ndarray, np.ndarray]]
) -> np.ndarray:
    """Fill thrust upwards and drag downwards, part on part; return their sum."""
    above = np.zeros_like(x)
    below = np.zeros_like(x)
    for part, (thrust, drag) in parts.items():
        colour = COLOURS[part]
        label = "on the ends" if part == "ends" else f"by {part} forces"
        if thrust.any() or drag.any():
            thrust_look = {"color": colour, "alpha": 0.75, "lw": 0, "label": label}
            ax.fill_between(x, above, above + thrust, **thrust_look)
            ax.fill_between(x, below, below + drag, color=colour, alpha=0.4, lw=0)
        above = above + thrust
        below = below + drag
    ax.axhline(0.0, color="0.3", lw=0.6)
    return above + below


def _unit_label(unit: str) -> str:
    """Return a unit with multiplication signs."""
    return unit.replace(" x ", r" $\times$ ")
