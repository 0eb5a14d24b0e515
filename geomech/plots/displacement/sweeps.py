"""Sweeps over a scene's parameters, in pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.mathematics.systems.base import body_size, length_unit
from geomech.plots.displacement.displacements import draw_measurements, medium_band
from geomech.plots.look import colours
from geomech.plots.style import MARKED, figure, quantity, styled
from geomech.results.scenes import scene_of
from geomech.scenes.data.measurements import METRES, swept_points
from geomech.scenes.model import Scene
from geomech.studies.displacement.cycles import AMPLITUDE
from geomech.studies.displacement.variables import position_spread
from geomech.studies.mechanics.outcome import CLIMBS, ROLLS, SLIDES, SLIPS
from geomech.studies.terradynamics import outcome as robots
from rft.core.refusal import Refusal

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Units of parameters by the last part of their names; other parameters have none.
PARAMETER_UNITS = {
    "gamma0": "rad",
    "length": "m",
    "frequency": "Hz",
    "mass": "kg",
    "drag": "N",
    "depth": "m",
    "radius": "BL",
    "distance": "BL",
    "travel": "BL",
    "lag": "rad",
    "rise": "rad",
    "angle": "rad",
    "slope": "1/BL",
    "towards": "rad",
    "tilt": "rad",
    "period": "s",
    "extent": "rad",
    "regularisation": "BL/rad",
    "stiffness": "drag x BL/rad",
    "damping": "drag x BL x s/rad",
    "bending": "drag x BL$^2$",
    "dead_band": "rad",
    "rest": "rad",
}
# Of springs whose unit of torque is given.
TORQUE_UNITS = {"stiffness": "N m/rad", "damping": "N m s/rad"}

MARK = "#b5179e"  # colour of outcomes
OUTCOME_MARKS = {
    SLIPS: "v",
    SLIDES: "x",
    ROLLS: "o",
    robots.STAYS: "s",
    robots.TURNS: "<",
    robots.TIPS: "^",
    robots.SINKS: "1",
    robots.FLIES: "*",
    robots.UNDECIDED: "$?$",
}
# In maps of robots; bodies that do what they should have no mark in other pictures.
GOOD_MARKS = {robots.WALKS: ".", CLIMBS: "+", robots.DESCENDS: "|"}
MAPPED = {"speed": "mean speed", "slip": "slip", "sinkage": "sinkage"}
ESTIMATED = "with estimated error"  # label of a curve

ROBOT_UNITS = {  # likewise, in scenes of robots
    "mass": "kg",
    "inertia": "kg m$^2$",
    "length": "m",
    "width": "m",
    "height": "m",
    "hip_height": "m",
    "radius": "m",
    "lug_height": "m",
    "lug_width": "m",
    "axle": "m",
    "frequency": "Hz",
    "sweep": "rad",
    "middle": "rad",
    "air_speed": "m/s",
    "fluidisation": "m/s",
    "grazing": "rad",
    "duration": "s",
    "rounding": "m/s",
    "core": "m",
    "pitch": "m",
    "thickness": "m",
    "nose": "m",
    "track": "m",
    "drop": "m",
    "angle": "rad",
    "repose": "rad",
    "xi_n": "N/m$^3$",
    "density": "kg/m$^3$",
}


@styled
def sweep_figure(
    scene: Any, result: Result, data: Any = None, maps: bool = False
) -> Figure:
    """Draw a sweep over one parameter or two: net distance or speed, or the speed of a
    robot; refuse more parameters.

    maps: draw speed, slip and sinkage of a robot over two parameters as maps, with the
    outcomes marked, in place of curves.

    data: measurements to draw as points over a single parameter: the name of a file, or
    a table, with a column of the parameter, "value" and, if known, "error".

    Examples
    --------
    >>> import geomech
    >>> swept = geomech.sweep("three-link-viscous", {"medium.ratio": [1.5, 2.0]})
    >>> fig = geomech.plots.sweep_figure(swept.question.scene, swept)
    """
    count = len(parameters(result))
    if count > 2:
        raise Refusal(
            f"cannot draw {count} parameters",
            instead="sweep one or two, or leave ``plot`` out",
        )
    if data is not None and count > 1:
        raise Refusal(
            "measured points are drawn over one parameter",
            instead="sweep one parameter, or leave ``data`` out",
        )
    if maps:
        check_maps(count, "slip" in result)
        return _maps_of_walks(result)
    if "status" in result:
        return _speed_figure(scene, result, data)
    return _net_figure(scene, result, data)


def check_maps(count: int, is_walk: bool) -> None:
    """Raise Refusal for maps of other sweeps than those of robots over two of their
    parameters. count: of the parameters. is_walk: whether a robot walks."""
    if not is_walk:
        raise Refusal(
            "maps are of robots that walk",
            instead="leave ``maps`` out: sweeps over two parameters are maps already",
        )
    if count != 2:
        raise Refusal(
            f"cannot draw maps over {count} parameters",
            instead="sweep two parameters, or leave ``maps`` out",
        )


def measured_units(scene: Any, quantity: str, unit: str) -> dict[str, dict[str, float]]:
    """Return what is drawn of a sweep, with the units that measurements of it may have.

    quantity: net_distance or speed. unit: of its lengths in the picture."""
    sizes = {"": 1.0}
    own = "m"
    if hasattr(scene, "system"):
        own = length_unit(scene.system)
    if unit in METRES:
        sizes |= {name: size / METRES[unit] for name, size in METRES.items()}
    if hasattr(scene, "system") and own == "m":
        body = body_size(scene.system)
        sizes["BL"] = body / METRES.get(unit, body)
        if unit == "BL":
            sizes |= {name: size / body for name, size in METRES.items()}
    elif own == unit:
        sizes[own] = 1.0
    if quantity == "speed":
        sizes = {f"{name}/s" if name else "": size for name, size in sizes.items()}
    return {quantity: sizes}


def _draw_points(
    ax: Axes, data: Any, parameter: str, units: dict[str, dict[str, float]]
) -> None:
    """Draw measurements over a parameter, with a legend."""
    points = swept_points(data, parameter, units)
    draw_measurements(ax, points["parameter"], points["value"], points.get("error"))
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)


def parameters(result: Result) -> dict[str, np.ndarray]:
    """Return the values of the parameters of a sweep, by their names in a scene."""
    return {v.label: v.values for v in result.variables if v.is_coordinate}


# Swimmers


def _net_figure(scene: Scene, result: Result, data: Any) -> Figure:
    """Draw `net_values` against one parameter, with measurements, or a map over two."""
    over = parameters(result)
    values, error, spread, label = net_values(result)
    fig, axes = figure(4.0, 3.0)
    ax = axes[0, 0]
    order = np.ix_(*(np.argsort(x, kind="stable") for x in over.values()))
    rising = [np.sort(x) for x in over.values()]
    names = axis_labels(scene, list(over))
    ax.set_xlabel(names[0])
    if len(over) == 1:
        if spread is not None:
            spread = spread[order]
        _draw_line(ax, *rising, values[order], error[order], spread)
        if data is not None:
            quantity = "speed" if label.startswith("speed") else "net_distance"
            unit = result["net_distance"].unit
            units = measured_units(scene, quantity, unit)
            _draw_points(ax, data, *over, units)
        ax.set_ylabel(label)
    else:
        _draw_map(ax, *rising, values[order], label)
        ax.set_ylabel(names[1])
    if "outcome" in result:
        _mark_outcomes(ax, result, order, rising)
    return fig


def net_values(result: Result) -> tuple:
    """Return (values, their errors, their spread by the medium or None, label) to draw.

    Values are the net distance per cycle, negative where it is backwards; on a slope
    the distance uphill; where the frequency differs from point to point, the speed."""
    net = result["net_distance"]
    distance = np.copysign(net.values, result["x"].values)
    factor: Any = 1.0
    label = f"net distance per cycle ({net.unit})"
    if "uphill" in result:
        return _uphill_values(result["uphill"])
    if "frequency" in result and np.ptp(result["frequency"].values) > 0:
        factor = result["frequency"].values
        label = f"speed ({net.unit}/s)"
    spread = None
    if net.spread is not None:
        spread = position_spread(result) * factor
    distance = distance * factor
    if (distance < 0).any():
        label += ",\nbackwards < 0"
    return distance, net.error * factor, spread, label


def _uphill_values(uphill: Variable) -> tuple:
    """Return what `net_values` does of a distance uphill."""
    label = f"distance uphill per cycle ({uphill.unit})"
    if (uphill.values < 0).any():
        label += ",\ndownhill < 0"
    return uphill.values, uphill.error, None, label


def _mark_outcomes(
    ax: Axes, result: Result, order: Any, rising: list[np.ndarray]
) -> None:
    """Mark the points of a sweep at which a body does not do what it should, with a
    legend if there are any."""
    _scatter_outcomes(ax, result, order, rising, OUTCOME_MARKS)
    if np.isin(result["outcome"].values, [*OUTCOME_MARKS]).any():
        ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)


def _scatter_outcomes(
    ax: Axes,
    result: Result,
    order: Any,
    rising: list[np.ndarray],
    marks: Mapping[str, str],
) -> None:
    """Mark the points of a sweep whose outcomes have marks."""
    outcomes = result["outcome"].values[order]
    for name, marker in marks.items():
        where = np.nonzero(outcomes == name)
        if not len(where[0]):
            continue
        x = rising[0][where[0]]
        look = {"s": 22, "label": name, "zorder": 4, "clip_on": False}
        if len(rising) == 1:
            height = ax.get_xaxis_transform()
            ax.scatter(x, 0 * x, marker=marker, color=MARK, transform=height, **look)
        else:
            y = rising[1][where[1]]
            ax.scatter(x, y, marker=marker, color=MARK, **look)


@styled
def _draw_line(
    ax: Axes,
    x: np.ndarray,
    values: np.ndarray,
    errors: np.ndarray,
    spread: np.ndarray | None,
) -> None:
    """Draw values (B,) over x with their errors and the band of an uncertain medium."""
    marker = "o" if len(x) <= MARKED else ""
    ax.errorbar(
        x,
        values,
        yerr=errors,
        fmt=f"{marker}-",
        color="black",
        ms=3,
        lw=1,
        label=ESTIMATED,
    )
    if spread is not None:
        medium_band(ax, x, values, spread)
        ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0))


@styled
def _draw_map(
    ax: Axes, x: np.ndarray, y: np.ndarray, values: np.ndarray, label: str
) -> None:
    """Draw values (N, M) as cells about the points of x (N,) and y (M,).

    Colours are centred on zero where the sign changes; the axes end at the outermost
    points."""
    from cmcrameri import cm

    known = values[np.isfinite(values)]
    top = np.abs(known).max(initial=0.0) or 1.0
    look: dict[str, Any] = {"cmap": colours("viridis")}
    if known.min(initial=0.0) < 0 < known.max(initial=0.0):
        look = {"cmap": colours(cm.vik), "vmin": -top, "vmax": top}
    image = ax.pcolormesh(x, y, values.T, shading="nearest", rasterized=True, **look)
    if x[0] < x[-1]:
        ax.set_xlim(x[0], x[-1])
    if y[0] < y[-1]:
        ax.set_ylim(y[0], y[-1])
    ax.figure.colorbar(image, ax=ax).set_label(label)


def axis_labels(
    scene: Any, parameters: list[str], units: Mapping[str, str] = PARAMETER_UNITS
) -> list[str]:
    """Return a label with unit for each parameter: the last part of its name, or such
    as "body-inertia: frequency (Hz)" where several have the same last part."""
    last_parts = [name.rpartition(".")[2] for name in parameters]
    labels = []
    for name, last in zip(parameters, last_parts):
        if name == AMPLITUDE:
            labels.append(scene.gait.amplitude_label)
            continue
        text = last
        if last_parts.count(last) > 1:
            owner = name.split(".")[-2].replace("_", "-")
            text = f"{owner}: {last}"
        unit = units.get(last, "-")
        effects = getattr(getattr(scene, "system", None), "effects", ())
        if any(getattr(effect, "unit", None) is not None for effect in effects):
            unit = TORQUE_UNITS.get(last, unit)
        if last.endswith("_deg"):
            unit = "deg"
            text = text.removesuffix("_deg")
        labels.append(quantity(_words(text), unit))
    return labels


def _words(name: str) -> str:
    """Return the name of a parameter as it is written in a label."""
    return name.replace("gamma0", "gamma_0").replace("dead_band", "dead band")


# Robots


@styled
def _speed_figure(scene: Any, result: Result, data: Any) -> Figure:
    """Draw speed against the first parameter, with measurements, or with a curve for
    each value of a second."""
    over = parameters(result)
    labels = axis_labels(scene, list(over), ROBOT_UNITS)
    values = list(over.values())
    names = ["" if data is None else ESTIMATED]
    if len(over) == 2:
        names = [f"{labels[1]}: {value:g}" for value in values[1]]
    fig, axes = figure(4.6, 3.2)
    ax = axes[0, 0]
    curves(ax, values[0], result, names)
    unit = result["speed"].unit
    ax.set(xlabel=labels[0], ylabel=f"mean speed ({unit})")
    if data is not None:
        units = measured_units(scene, "speed", unit.removesuffix("/s"))
        _draw_points(ax, data, *over, units)
    elif len(over) == 1 and "outcome" in result:
        order = np.argsort(values[0], kind="stable")
        _mark_outcomes(ax, result, order, [np.sort(values[0])])
    return fig


@styled
def _maps_of_walks(result: Result) -> Figure:
    """Draw speed, slip and sinkage over two parameters, with the outcomes marked and
    named."""
    fig, axes = figure(9.6, 3.4, len(MAPPED))
    handles, names = draw_maps_of_walks(list(axes.ravel()), result)
    fig.legend(handles, names, loc="outside upper center", ncols=6)
    return fig


@styled
def draw_maps_of_walks(
    axes: list[Axes], result: Result, names: Sequence[str] = tuple(MAPPED)
) -> tuple[list, list[str]]:
    """Draw maps of a sweep of a robot over two parameters, one on each of some axes;
    return handles and names of the outcomes for a legend.

    names: what to draw, of speed, slip and sinkage.

    Examples
    --------
    >>> import geomech
    >>> over = {"effects.slope.angle_deg": [0.0, 10.0], "gait.frequency": [1.0, 2.0]}
    >>> swept = geomech.sweep("xplorer-slope", over)
    >>> fig, axes = geomech.plots.figure(4.0, 3.0)
    >>> handles, names = geomech.plots.draw_maps_of_walks(axes[0], swept, ["slip"])
    >>> names
    ['walks', 'climbs']
    """
    over = parameters(result)
    order = np.ix_(*(np.argsort(x, kind="stable") for x in over.values()))
    rising = [np.sort(x) for x in over.values()]
    labels = axis_labels(scene_of(result), list(over), ROBOT_UNITS)
    for ax, name in zip(axes, names):
        variable = result[name]
        unit = variable.unit if variable.unit != "1" else "-"
        _draw_map(ax, *rising, variable.values[order], quantity(MAPPED[name], unit))
        ax.set(xlabel=labels[0], ylabel=labels[1])
        _scatter_outcomes(ax, result, order, rising, GOOD_MARKS | OUTCOME_MARKS)
    return axes[0].get_legend_handles_labels()


def curves(ax: Axes, values: Any, result: Result, names: Any) -> None:
    """Draw speed with its error over the values (N,) of a parameter, with a curve for
    each name; markers are open where the robot does not walk.

    result: of a sweep, with ``speed`` and ``status`` (N, ...)."""
    from cmcrameri import cm

    rows = len(values)
    speed = result["speed"].values.reshape(rows, -1)
    error = result["speed"].error.reshape(rows, -1)
    status = result["status"].values.reshape(rows, -1)
    for k, label in enumerate(names):
        colour = colours(cm.batlow)(0.85 * k / max(1, len(names) - 1))
        ax.errorbar(
            values,
            speed[:, k],
            yerr=error[:, k],
            color=colour,
            lw=1.0,
            capsize=2,
            label=label,
        )
        walks = status[:, k] == "walking"
        for fill, mask in ((colour, walks), ("white", ~walks)):
            x = np.array(values)[mask]
            ax.plot(x, speed[mask, k], "o", ms=4, color=colour, mfc=fill)
    if any(names):
        ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
