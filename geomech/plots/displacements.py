"""Displacement per cycle against amplitude: x, y, heading and net distance, a line a tier."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from geomech.core.errors import choose
from geomech.core.summary import listed
from geomech.gaits import Gait
from geomech.geometry.symmetry import zero_components
from geomech.plots.style import axes_of, figure, shared_legend, styled
from geomech.scenes.measurements import converted, units_of
from geomech.studies.tables import ERRORS, QUANTITIES, error_of, of_pose, unit_of
from geomech.systems.base import System
from geomech.tiers import TIERS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LEAST = 1e-3  # body lengths or rad: an axis spans no less, so that rounding is not drawn as motion
BAND, EDGE = "#E69F00", "#A66F00"  # of the medium: its area and its outline
ERROR, MEDIUM, MEASURED = (
    "estimated error, in the tier's colour",
    "medium, one standard deviation",
    "measured",
)
PANELS = {
    "x": "x",
    "y": "y",
    "theta": "heading",
    "distance": "net_distance",
}  # by the words of --component
SPAN, APART = 1.0, 0.04  # of the axis about one amplitude; of it, between tiers there
ROUNDING = 1e-9  # body lengths or rad: below it a displacement is nothing
TO_ROUNDING = "every tier has less than 1e-9"


@styled
def displacement(
    table: Mapping, *, ax: Axes | None = None, label: str = "", gait: Gait | None = None, quantity: str = "x",
    legend: bool = True, errors: bool = True, data: Mapping | None = None, **style: Any,
) -> Axes:  # fmt: skip
    """Draw one of QUANTITIES per cycle against amplitude, a line for each tier; ``table`` as `Study.study` returns it.

    errors: with a band of each tier's estimated error, in its colour; an uncertain medium has an outlined band of its own. The
    table's own units are those of the axis. data: measurements to draw as points, "amplitude", "value" and "error" (N,), such
    as a data frame of pandas; the error may be missing. A name may end in a unit, as those of a file: "amplitude_deg",
    "value_cm"; without it the unit is that of the axis.

    Examples
    --------
    >>> import geomech
    >>> table = geomech.study("three-link-viscous", grid=15).displacement([0.5, 1.0], ["path", "direct"])
    >>> geomech.plots.displacement(table, quantity="net_distance").get_ylabel()
    'net distance per cycle (BL)'
    """
    ax, amplitudes = axes_of(ax, 4.4, 3.8), np.asarray(table["amplitude"], float)
    if data is not None:
        unit, length = unit_of(table, "x"), table.get("body_length", 1.0)
        units = units_of(gait, unit, length, angle=quantity == "heading")
        data = converted(data, units)
    errors = errors and all(key in table for key in ERRORS)
    shown = [name for name in TIERS if name in table]
    span = np.ptp(np.append(amplitudes, [] if data is None else data["amplitude"]))
    places = _side_by_side(amplitudes, len(shown), span or SPAN)
    for name, x in zip(shown, places):
        tier, values = TIERS[name], of_pose(table[name])[quantity]
        title = f"{label}, {tier.label}" if label else tier.label
        point = (
            {"marker": "o", "ms": 5} if len(amplitudes) == 1 else {}
        )  # one point is no line
        ax.plot(x, values, label=title, **{**tier.style, **point, **style})
        if errors:
            _error_band(ax, x, values, error_of(table, quantity, name), tier.colour)
    if errors:
        ax.plot([], [], color="0.5", alpha=0.3, lw=7, label=ERROR)
    if shown:
        _band(ax, table, quantity, shown[-1], places[-1])
    if data is not None:
        measured(ax, data)
    if not span:
        ax.set(xlim=amplitudes + [-SPAN / 2, SPAN / 2], xticks=amplitudes)
    ax.axhline(0.0, color="0.7", lw=0.6, zorder=0)
    _widen(
        ax, LEAST * (1.0 if quantity == "heading" else table.get("body_length", 1.0))
    )
    what = quantity.replace("_", " ")
    ax.set(xlabel=gait.amplitude_label if gait else "amplitude")
    ax.set_ylabel(f"{what} per cycle ({unit_of(table, quantity)})")
    if legend:
        ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=1)
    return ax


def _side_by_side(amplitudes: np.ndarray, count: int, span: float) -> np.ndarray:
    """Return where each of so many tiers is drawn (count, B): at the amplitudes or, of one amplitude, about it side by side, so
    that no error bar hides another. span: of the axis."""
    aside = (
        APART * span * (np.arange(count) - (count - 1) / 2)
        if len(amplitudes) == 1
        else np.zeros(count)
    )
    return amplitudes + aside[:, None]


def _error_band(ax, x, values, error, colour: str) -> None:
    """Draw the estimated error (B,) of a tier to either side of its values (B,), outlined so that bands that overlap are told
    apart."""
    from matplotlib.colors import to_rgba

    if len(x) == 1:  # no band to see
        ax.vlines(x, values - error, values + error, colors=colour, lw=1.0, zorder=0.9)
    else:
        look = {
            "facecolor": to_rgba(colour, 0.14),
            "edgecolor": to_rgba(colour, 0.6),
            "lw": 0.5,
            "zorder": 0.5,
        }
        ax.fill_between(x, values - error, values + error, **look)


def _band(ax, table: Mapping, quantity: str, best: str, x) -> None:
    """Draw the uncertainty by the medium about the best tier, shifted as far as the medium shifts the mean."""
    if "medium_error_of" in table:
        values, error = (
            of_pose(table[best])[quantity],
            np.array(table["medium_error_of"][quantity]),
        )
        shift = (
            np.array(table["medium_shift_of"][quantity])
            if "medium_shift_of" in table
            else 0.0
        )
        medium_band(ax, x, values + shift, error)


def medium_band(ax: Axes, x: Any, values: Any, error: Any) -> None:
    """Draw the uncertainty by a medium of values (B,): error (B,) to either side, outlined so that it is seen over the line of
    the tier that it is about."""
    from matplotlib.colors import to_rgba

    if len(x) == 1:  # no band to see
        ax.vlines(
            x,
            values - error,
            values + error,
            lw=6,
            color=BAND,
            alpha=0.6,
            label=MEDIUM,
            zorder=1.5,
        )
    else:
        look = {
            "facecolor": to_rgba(BAND, 0.35),
            "edgecolor": EDGE,
            "lw": 0.8,
            "label": MEDIUM,
            "zorder": 1.5,
        }
        ax.fill_between(x, values - error, values + error, **look)


def measured(ax, data: Mapping) -> None:
    """Draw measurements as points with bars of their errors."""
    x, values, error = data["amplitude"], data["value"], data.get("error")
    look = {
        "fmt": "D",
        "ms": 4,
        "mfc": "white",
        "color": "black",
        "elinewidth": 1.0,
        "capsize": 2.5,
    }
    ax.errorbar(x, values, error, label=MEASURED, zorder=4, **look)


def _widen(ax, least: float) -> None:
    low, high = ax.get_ylim()
    if high - low < least:
        ax.set_ylim((low + high - least) / 2, (low + high + least) / 2)


@styled
def displacement_figure(
    tables: Mapping[str, Mapping], gaits: Sequence[Gait], *, system: System | None = None,
    components: Sequence[str] = (), data: Mapping | None = None,
) -> Figure:  # fmt: skip
    """Draw QUANTITIES side by side, a row for each gait's table, without those that are zero; a line says which and why.

    system: whose symmetry makes quantities zero; that of the tables' scene if left out. components: of PANELS, drawn even where
    they are zero; all of them if left out. data: measurements of the first gait, drawn as `displacement` does on the first of
    the components, else on x.

    Examples
    --------
    >>> import geomech
    >>> from geomech.plots import displacement_figure
    >>> study = geomech.study("three-link-viscous", grid=15)
    >>> fig = displacement_figure({"circle": study.displacement([0.5, 1.0])}, [study.scene.gait])
    """
    wanted = [PANELS[choose("component", name, PANELS)] for name in components]
    zero = [
        {} if wanted else _zeros(table, gait, system)
        for table, gait in zip(tables.values(), gaits)
    ]
    if data is not None and not wanted:
        zero[0].pop("x", None)
    panels = (
        wanted
        or [q for q in QUANTITIES if not all(q in one for one in zero)]
        or [*QUANTITIES]
    )
    alone = len(panels) == 1  # with its legend at the right
    fig, axes = figure(
        2.7 * (len(panels) + alone) + 0.3,
        0.5 + 2.5 * len(tables),
        len(panels),
        len(tables),
    )
    for row, (name, table), gait, absent in zip(axes, tables.items(), gaits, zero):
        for ax, quantity in zip(row, panels):
            if quantity in absent and len(absent) < len(QUANTITIES):
                _say_zero(ax, quantity, absent[quantity])
                continue
            measurements = (
                data if ax is axes[0, 0] else None
            )  # x is never left out beside them
            displacement(
                table,
                ax=ax,
                gait=gait,
                quantity=quantity,
                legend=False,
                data=measurements,
                marker="o",
            )
        row[0].set_title(
            f"{name} (not in the scene)" if "note" in table else name, loc="left"
        )
        if table.get("frequency") and panels[-1] == "net_distance":
            _speed_axis(row[-1], table["frequency"], unit_of(table, "x"))
    fig.get_layout_engine().set(
        rect=(0.0, 0.0, 0.985, 1.0)
    )  # the last labels are wider than their axes
    shared_legend(fig, "outside right center" if alone else "outside upper center")
    if not wanted:
        fig.supxlabel(
            _left_out({q: why for q, why in zero[0].items() if q not in panels}),
            fontsize=8,
            color="0.3",
        )
    return fig


def _left_out(zero: Mapping[str, str]) -> str:
    """Return lines that say which quantities are zero, and why."""
    reasons = dict.fromkeys(zero.values())
    names = {
        why: [q.replace("_", " ") for q in QUANTITIES if zero.get(q) == why]
        for why in reasons
    }
    return "\n".join(f"{listed(some)}: zero, as {why}" for why, some in names.items())


def _zeros(table: Mapping, gait: Gait, system: System | None) -> dict[str, str]:
    """Return why quantities of a table are zero, by symmetry or to rounding; none that is not."""
    scene: Any = getattr(table, "scene", None)
    system, poses = (
        system or (scene and scene.system),
        np.concatenate([table[t] for t in TIERS if t in table]),
    )
    least = {
        q: ROUNDING * (1.0 if q == "heading" else table.get("body_length", 1.0))
        for q in QUANTITIES
    }
    nothing = {
        q: TO_ROUNDING
        for q, x in of_pose(poses).items()
        if np.all(np.abs(x) <= least[q])
    }
    return nothing | (
        zero_components(system.traits, gait, table["amplitude"]) if system else {}
    )


def _say_zero(ax, quantity: str, why: str) -> None:
    """Write in place of a panel why it is zero."""
    import textwrap

    lines = "\n".join(textwrap.wrap(f"{quantity}: zero, as {why}", 26))
    ax.text(
        0.5,
        0.5,
        lines,
        ha="center",
        va="center",
        transform=ax.transAxes,
        fontsize=8,
        color="0.3",
    )
    ax.set_axis_off()


def _speed_axis(ax, frequency: float, unit: str) -> None:
    """Draw a scale on the right of net distances: the speed at that frequency."""
    right = ax.secondary_yaxis(
        "right", functions=(lambda d: d * frequency, lambda v: v / frequency)
    )
    right.set_ylabel(f"speed ({unit}/s) at {frequency:g} Hz")
    right.spines["right"].set_visible(True)


def net(poses: Any) -> np.ndarray:
    """Return the net distance (...,) of poses (..., 3), negative where it points backwards (x < 0).

    Examples
    --------
    >>> import numpy as np
    >>> from geomech.plots import net
    >>> net(np.array([[0.3, 0.4, 0.0], [-0.3, 0.0, 0.0]]))
    array([ 0.5, -0.3])
    """
    found = of_pose(poses)
    return np.copysign(found["net_distance"], found["x"])
