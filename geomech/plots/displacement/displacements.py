"""Displacement per cycle against amplitude: x, y, heading and net distance, with a line
for each tier."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from geomech.core.errors import choose
from geomech.core.summary import listed
from geomech.core.variables import Result
from geomech.mathematics.geometry.representations.field import UNKNOWN_UNIT
from geomech.mathematics.tiers import TIERS, Tier
from geomech.plots.look import current, font_points
from geomech.plots.style import axes_of, figure, shared_legend, styled
from geomech.scenes.data.measurements import converted, points_of, units_of
from geomech.scenes.model import Scene
from geomech.studies.displacement.variables import QUANTITIES, pose_quantities
from rft.core.refusal import printable

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHORTEST_AXIS = 1e-3  # body lengths or rad: a shorter one would show rounding as motion
MEDIUM_COLOUR = "#E69F00"  # of the area of a medium's uncertainty
MEDIUM_EDGE = "#A66F00"
ERROR = "estimated error, in the tier's colour"
MEDIUM = "medium, one standard deviation"
UNNAMED = Scene.name  # of a scene from parts
MEASURED = "measured"
PANELS = {  # quantities by the words of --component
    "x": "x",
    "y": "y",
    "theta": "heading",
    "distance": "net_distance",
}
SINGLE_SPAN = 1.0  # of the axis about a single amplitude
TIER_DISTANCE = 0.04  # of the axis, between tiers at a single amplitude
ROUNDING = 1e-9  # body lengths or rad: smaller displacements are drawn as zero
TO_ROUNDING = "to rounding, every tier has less than 1e-9"


# One quantity


@styled
def displacement(
    result: Result,
    *,
    ax: Axes | None = None,
    label: str = "",
    quantity: str = "x",
    legend: bool = True,
    errors: bool = True,
    data: Mapping | None = None,
    **style: Any,
) -> Axes:
    """Draw one of QUANTITIES per cycle against amplitude, with a line for each tier of
    a result of displacements; return the Axes.

    errors: draw a band of each tier's estimated error, in its colour. An uncertain
    medium has an outlined band. data: measurements to draw as points, "amplitude",
    "value" and "error" (N,), such as a data frame of pandas, or columns by quantity
    such as "x" and "x_error"; errors may be absent. A name may end in a unit, as in a
    file: "amplitude_deg", "value_cm"; without one the unit is that of the axis.

    Examples
    --------
    >>> import geomech
    >>> study = geomech.study("three-link-viscous", grid=15)
    >>> table = study.displacement([0.5, 1.0], ["path", "direct"])
    >>> geomech.plots.displacement(table, quantity="net_distance").get_ylabel()
    'net distance per cycle (BL)'
    """
    ax = axes_of(ax, 4.4, 3.8)
    variable = result[choose("quantity", quantity, QUANTITIES)]
    amplitudes = result["amplitude"].values
    rows = result["tier"].values.tolist()
    tiers = [name for name in TIERS if name in rows]
    errors = errors and variable.error is not None
    abscissae = amplitudes
    if data is not None:
        columns = converted(data, _data_units(result, quantity))
        data = points_of(columns, quantity, [quantity])
    if data is not None:
        abscissae = np.append(amplitudes, data["amplitude"])
    span = np.ptp(abscissae)

    places = _tier_abscissae(amplitudes, len(tiers), span or SINGLE_SPAN)
    for name, x in zip(tiers, places):
        tier = TIERS[name]
        row = rows.index(name)
        values = variable.values[row]
        _draw_tier(ax, tier, x, values, label, style)
        if errors:
            _draw_error(ax, x, values, variable.error[row], tier.colour)
    if errors:
        ax.plot([], [], color="0.5", alpha=0.3, lw=7, label=ERROR)
    if tiers and variable.spread is not None:
        best = rows.index(tiers[-1])
        centre = variable.values[best] + _medium_shift(result, quantity)
        medium_band(ax, places[-1], centre, variable.spread[best])
    if data is not None:
        draw_measurements(ax, data["amplitude"], data["value"], data.get("error"))

    if not span:
        ends = amplitudes + [-SINGLE_SPAN / 2, SINGLE_SPAN / 2]
        ax.set(xlim=ends, xticks=amplitudes)
    ax.axhline(0.0, color="0.7", lw=0.6, zorder=0)
    _widen(ax, SHORTEST_AXIS * _unit_size(result, quantity))
    name = quantity.replace("_", " ")
    ax.set(xlabel=result["amplitude"].label or "amplitude")
    ax.set_ylabel(f"{name} per cycle ({variable.unit or UNKNOWN_UNIT})")
    if legend:
        ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=1)
    return ax


def _data_units(result: Result, quantity: str) -> dict[str, dict[str, float]]:
    """Return the units that columns of measurements may have next to a result."""
    return units_of(
        "(rad)" in result["amplitude"].label,
        result["x"].unit,
        result.attributes.get("body_length", 1.0),
        angle=quantity == "heading",
    )


def _unit_size(result: Result, quantity: str) -> float:
    """Return the size by which a quantity is large or small: the body's length, or
    1 rad."""
    if quantity == "heading":
        return 1.0
    return float(result.attributes.get("body_length", 1.0))


def _medium_shift(result: Result, quantity: str) -> Any:
    """Return the shift of the mean of a quantity by an uncertain medium, (B,) or 0."""
    if "medium_shift" not in result:
        return 0.0
    row = result["quantity"].values.tolist().index(quantity)
    return result["medium_shift"].values[row]


def _tier_abscissae(amplitudes: np.ndarray, n_tiers: int, span: float) -> np.ndarray:
    """Return the abscissae of the points of each tier, (n_tiers, B).

    They are the amplitudes. At a single amplitude, tiers stand side by side about it,
    so that no error bar hides another. span: of the axis."""
    offsets = np.zeros(n_tiers)
    if len(amplitudes) == 1:
        places = np.arange(n_tiers) - (n_tiers - 1) / 2
        offsets = TIER_DISTANCE * span * places
    return amplitudes + offsets[:, None]


def _draw_tier(
    ax: Axes, tier: Tier, x: np.ndarray, values: np.ndarray, label: str, style: dict
) -> None:
    """Draw the values (B,) of a tier as a line, or as a point where there is one."""
    title = tier.label
    if label:
        title = f"{label}, {title}"
    look = {**tier.style}
    if len(x) == 1:
        look |= {"marker": "o", "ms": 5}
    look |= style
    ax.plot(x, values, label=title, **look)


def _draw_error(
    ax: Axes, x: np.ndarray, values: np.ndarray, error: np.ndarray, colour: str
) -> None:
    """Draw the estimated error (B,) of a tier to either side of its values (B,).

    The outline of a band tells it from others that overlap it; a single point has a
    bar."""
    from matplotlib.colors import to_rgba

    low = values - error
    high = values + error
    if len(x) == 1:
        ax.vlines(x, low, high, colors=colour, lw=1.0, zorder=0.9)
        return
    face = to_rgba(colour, 0.14)
    edge = to_rgba(colour, 0.6)
    ax.fill_between(x, low, high, facecolor=face, edgecolor=edge, lw=0.5, zorder=0.5)


def medium_band(ax: Axes, x: Any, values: Any, error: Any) -> None:
    """Draw the uncertainty (B,) by a medium to either side of values (B,), outlined so
    that it is seen over the line of its tier; a single point has a bar."""
    from matplotlib.colors import to_rgba

    low = values - error
    high = values + error
    look: dict[str, Any] = {"label": MEDIUM, "zorder": 1.5}
    if len(x) == 1:
        ax.vlines(x, low, high, lw=6, color=MEDIUM_COLOUR, alpha=0.6, **look)
        return
    face = to_rgba(MEDIUM_COLOUR, 0.35)
    ax.fill_between(x, low, high, facecolor=face, edgecolor=MEDIUM_EDGE, lw=0.8, **look)


def draw_measurements(ax: Axes, x: Any, value: Any, error: Any = None) -> None:
    """Draw measurements (N,) over x as points with bars of their errors, if they have
    any."""
    ax.errorbar(
        x,
        value,
        error,
        label=MEASURED,
        zorder=4,
        fmt="D",
        ms=4,
        mfc="white",
        color="black",
        elinewidth=1.0,
        capsize=2.5,
    )


def _widen(ax: Axes, shortest: float) -> None:
    """Widen the vertical axis to a shortest length, about its middle."""
    low, high = ax.get_ylim()
    if high - low < shortest:
        ax.set_ylim((low + high - shortest) / 2, (low + high + shortest) / 2)


# All quantities


@styled
def displacement_figure(
    tables: Mapping[str, Result],
    *,
    components: Sequence[str] = (),
    data: Mapping | None = None,
) -> Figure:
    """Draw QUANTITIES side by side, in a row for each result of displacements, without
    those that are zero; a line below names these and the reason.

    components: of PANELS, drawn even where they are zero; by default all. data:
    measurements of the first gait, as `displacement` takes them, drawn on every
    quantity that they have. A column "value" is of the first of the components, else of
    x and, by its size, of the net distance.

    Examples
    --------
    >>> import geomech
    >>> from geomech.plots import displacement_figure
    >>> study = geomech.study("three-link-viscous", grid=15)
    >>> fig = displacement_figure({"circle": study.displacement([0.5, 1.0])})
    """
    named = [PANELS[choose("component", name, PANELS)] for name in components]
    first = next(iter(tables.values()))
    points = _points_by_quantity(first, data, named)
    zeros: list[dict[str, str]] = [{} for _ in tables]
    if not named:
        zeros = [_zero_reasons(table) for table in tables.values()]
        for quantity in points:
            # No quantity is left out next to measurements of it.
            zeros[0].pop(quantity, None)
    moving = [q for q in QUANTITIES if not all(q in zero for zero in zeros)]
    panels = named or moving or [*QUANTITIES]

    fig, axes = _displacement_panels(len(panels), len(tables))
    for row, (name, table), zero in zip(axes, tables.items(), zeros):
        for ax, quantity in zip(row, panels):
            if quantity in zero and len(zero) < len(QUANTITIES):
                _write_zero(ax, quantity, zero[quantity])
                continue
            own = points.get(quantity) if table is first else None
            displacement(
                table, ax=ax, quantity=quantity, legend=False, data=own, marker="o"
            )
        title = printable(name)
        if "note" in table.attributes:
            title = f"{title} (not in the scene)"
        # A page has its caption, and a scene of parts from Python has no name.
        is_named = current().inches is None and name != UNNAMED
        if len(tables) > 1 or is_named:
            row[0].set_title(title, loc="left")
        frequency = table.attributes.get("frequency")
        if frequency and panels[-1] == "net_distance":
            _draw_speed_axis(row[-1], frequency, table["x"].units)

    place = "outside right center" if len(panels) == 1 else "outside upper center"
    shared_legend(fig, place)
    if not named:
        absent = {q: why for q, why in zeros[0].items() if q not in panels}
        fig.supxlabel(_zero_note(absent), fontsize=font_points(8), color="0.3")
    return fig


def _points_by_quantity(
    table: Result, data: Mapping | None, named: Sequence[str]
) -> dict[str, dict]:
    """Return the points of measurements by the quantity that they are of.

    named: quantities that are drawn; by default all."""
    if data is None:
        return {}
    value_of = [*named[:1]] or ["x", "net_distance"]
    if {*named} == {"x", "net_distance"}:
        value_of = [*named]
    columns = converted(data, _data_units(table, value_of[0]))
    found = {}
    for quantity in named or QUANTITIES:
        points = points_of(columns, quantity, value_of)
        if points is not None:
            found[quantity] = points
    return found


def _displacement_panels(columns: int, rows: int) -> tuple[Figure, Any]:
    """Return (Figure, Axes) with room for the legend: at the right of a single column,
    else above."""
    width = 2.7 * columns + 0.3
    if columns == 1:
        width = 2.7 * 2 + 0.3
    fig, axes = figure(width, 0.5 + 2.5 * rows, columns, rows)
    # The last labels are wider than their axes.
    fig.get_layout_engine().set(rect=(0.0, 0.0, 0.985, 1.0))
    return fig, axes


def _zero_note(reasons: Mapping[str, str]) -> str:
    """Return a line for each reason with the quantities that are zero by it."""
    lines = []
    for reason in dict.fromkeys(reasons.values()):
        quantities = [q for q in QUANTITIES if reasons.get(q) == reason]
        names = [q.replace("_", " ") for q in quantities]
        lines.append(f"{listed(names)}: zero {reason}")
    return "\n".join(lines)


def _zero_reasons(table: Result) -> dict[str, str]:
    """Return the quantities of a table that are zero, with the reason: symmetry, or
    that they are less than rounding."""
    reasons = {}
    for quantity in QUANTITIES:
        variable = table[quantity]
        limit = ROUNDING * _unit_size(table, quantity)
        if variable.zero:
            reasons[quantity] = variable.zero
        elif np.all(np.abs(variable.values) <= limit):
            reasons[quantity] = TO_ROUNDING
    return reasons


def _write_zero(ax: Axes, quantity: str, reason: str) -> None:
    """Write in place of a panel that its quantity is zero, and why."""
    lines = "\n".join(textwrap.wrap(f"{quantity}: zero {reason}", 26))
    look = {"ha": "center", "va": "center", "fontsize": font_points(8), "color": "0.3"}
    ax.text(0.5, 0.5, lines, transform=ax.transAxes, **look)
    ax.set_axis_off()


def _draw_speed_axis(ax: Axes, frequency: float, unit: str) -> None:
    """Draw a scale of speed at the right of net distances. frequency: of cycles, Hz."""

    def speed(distance):
        return distance * frequency

    def distance(speed):
        return speed / frequency

    right = ax.secondary_yaxis("right", functions=(speed, distance))
    right.set_ylabel(f"speed ({unit}/s) at {frequency:g} Hz")
    right.spines["right"].set_visible(True)


def net(poses: Any) -> np.ndarray:
    """Return the net distance (...,) of poses (..., 3), negative where x < 0.

    Examples
    --------
    >>> import numpy as np
    >>> from geomech.plots import net
    >>> net(np.array([[0.3, 0.4, 0.0], [-0.3, 0.0, 0.0]]))
    array([ 0.5, -0.3])
    """
    quantities = pose_quantities(poses)
    return np.copysign(quantities["net_distance"], quantities["x"])
