"""Sweeps over a scene's parameters, in pictures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from geomech.core.variables import Result
from geomech.plots.displacements import medium_band
from geomech.plots.style import MARKED, figure, quantity, styled
from geomech.scenes.model import Scene
from geomech.studies.cycles import AMPLITUDE
from geomech.studies.tables import position_spread
from rft.core.refusal import Refusal

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PARAMETERS = {  # units of parameters, by the last part of their names; the others have none
    "gamma0": "rad", "length": "m", "frequency": "Hz", "mass": "kg", "drag": "N", "depth": "m", "radius": "BL",
    "distance": "BL", "travel": "BL", "slope": "1/BL", "towards": "rad", "tilt": "rad", "period": "s", "extent": "rad",
    "regularisation": "BL/rad",
}  # fmt: skip


OF_ROBOTS = {  # likewise, of scenes of robots
    "mass": "kg", "inertia": "kg m$^2$", "length": "m", "width": "m", "height": "m", "hip_height": "m", "radius": "m",
    "lug_height": "m", "lug_width": "m", "axle": "m", "frequency": "Hz", "sweep": "rad", "middle": "rad", "air_speed": "m/s",
    "fluidisation": "m/s", "grazing": "rad", "duration": "s", "rounding": "m/s", "core": "m", "pitch": "m", "thickness": "m",
    "nose": "m", "track": "m", "drop": "m", "xi_n": "N/m$^3$", "density": "kg/m$^3$",
}  # fmt: skip


def sweep_figure(scene: Any, result: Result) -> Figure:
    """Draw a sweep over one parameter or two: net distance or speed, or the speed of a
    robot. Refusal for more.

    Examples
    --------
    >>> import geomech
    >>> swept = geomech.sweep("three-link-viscous", {"medium.ratio": [1.5, 2.0]})
    >>> fig = geomech.plots.sweep_figure(swept.question.scene, swept)
    """
    over = parameters(result)
    if len(over) > 2:
        raise Refusal(
            f"cannot draw {len(over)} parameters",
            instead="sweep one or two, or leave ``plot`` out",
        )
    if "status" in result:
        return _speed_figure(scene, result)
    return _net_figure(scene, result)


def parameters(result: Result) -> dict[str, np.ndarray]:
    """Return the values of the parameters of a sweep by their names in a scene."""
    return {v.label: v.values for v in result.variables if v.is_coordinate}


def _net_figure(scene: Scene, result: Result):
    """Draw the values of `drawn` against one parameter, or a map over two."""
    over = parameters(result)
    values, error, medium, label = drawn(result)
    fig, axes = figure(4.0, 3.0)
    ax, named = axes[0, 0], dict(zip(over, labels(scene, list(over))))
    order = np.ix_(*(np.argsort(x, kind="stable") for x in over.values()))
    rising = [np.sort(x) for x in over.values()]
    if len(over) == 1:
        if medium is not None:
            medium = medium[order]
        _line(ax, *rising, values[order], error[order], medium, label)
    else:
        _map(ax, *rising, values[order], label)
    ax.set(**{f"{axis}label": named[name] for axis, name in zip("xy", over)})
    return fig


def drawn(result: Result):
    """Return (values, their errors, the medium's or None, a label): the net distance per
    cycle or, where the frequency differs from point to point, the speed; negative where
    it is backwards."""
    net = result["net_distance"]
    distance = np.copysign(net.values, result["x"].values)
    factor: Any = 1.0
    label = f"net distance per cycle ({net.unit})"
    if "frequency" in result and np.ptp(result["frequency"].values) > 0:
        factor = result["frequency"].values
        label = f"speed ({net.unit}/s)"
    medium = None
    if net.spread is not None:
        medium = position_spread(result) * factor
    distance = distance * factor
    if (distance < 0).any():
        label += ", backwards < 0"
    return distance, net.error * factor, medium, label


@styled
def _line(
    ax, x, values: np.ndarray, errors: np.ndarray, medium: np.ndarray | None, label: str
) -> None:
    marker = "o" if len(x) <= MARKED else ""
    ax.errorbar(
        x,
        values,
        yerr=errors,
        fmt=f"{marker}-",
        color="black",
        ms=3,
        lw=1,
        label="with estimated error",
    )
    if medium is not None:
        medium_band(ax, x, values, medium)
        ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0))
    ax.set_ylabel(label)


@styled
def _map(ax, x, y, net: np.ndarray, label: str) -> None:
    """Draw cells about the points, which end where the values do; colours are centred on zero where the sign changes."""
    from cmcrameri import cm

    top = np.abs(net).max() or 1.0
    signs = (
        {"cmap": cm.vik, "vmin": -top, "vmax": top}
        if net.min() < 0 < net.max()
        else {"cmap": "viridis"}
    )
    image = ax.pcolormesh(x, y, net.T, shading="nearest", rasterized=True, **signs)
    for values, limit in ((x, ax.set_xlim), (y, ax.set_ylim)):
        if values[0] < values[-1]:
            limit(values[0], values[-1])
    ax.figure.colorbar(image, ax=ax).set_label(label)


def labels(
    scene, parameters: list[str], units: Mapping[str, str] = PARAMETERS
) -> list[str]:
    """Return labels of axes: names with units; by their last part where that is unique, else as "body-inertia: frequency
    (Hz)"."""
    last = [name.rpartition(".")[2] for name in parameters]
    out = []
    for name, short in zip(parameters, last):
        owner = name.split(".")[-2].replace("_", "-")
        text = short if last.count(short) == 1 else f"{owner}: {short}"
        unit = "deg" if short.endswith("_deg") else units.get(short, "-")
        angle = text.removesuffix("_deg").replace("gamma0", "gamma_0")
        out.append(
            scene.gait.amplitude_label if name == AMPLITUDE else quantity(angle, unit)
        )
    return out


@styled
def _speed_figure(scene: Any, result: Result):
    """Draw speed against one parameter, or against the first for every value of a second;
    open markers: not walking."""
    over = parameters(result)
    name, *second = labels(scene, list(over), OF_ROBOTS)
    values, *others = over.values()
    names = [""]
    if others:
        names = [f"{second[0]}: {v:g}" for v in others[0]]
    fig, axes = figure(4.6, 3.2)
    curves(axes[0, 0], values, result, names)
    axes[0, 0].set(xlabel=name, ylabel="mean speed (m/s)")
    return fig


def curves(ax: Axes, values: Any, result: Result, names: Any) -> None:
    """Draw speed (N, ...) over ``values``, a curve for each name, with its error; open
    markers: not walking."""
    from cmcrameri import cm

    rows = len(values)
    speed = result["speed"].values.reshape(rows, -1)
    error = result["speed"].error.reshape(rows, -1)
    status = result["status"].values.reshape(rows, -1)
    for k, label in enumerate(names):
        colour = cm.batlow(0.85 * k / max(1, len(names) - 1))
        ax.errorbar(
            values,
            speed[:, k],
            yerr=error[:, k],
            color=colour,
            lw=1.0,
            capsize=2,
            label=label,
        )
        for fill, mask in (
            (colour, status[:, k] == "walking"),
            ("white", status[:, k] != "walking"),
        ):
            ax.plot(
                np.array(values)[mask],
                speed[mask, k],
                "o",
                ms=4,
                color=colour,
                mfc=fill,
            )
    if any(names):
        ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
