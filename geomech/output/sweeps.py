"""Sweeps as NetCDF and as pictures."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from geomech.core.errors import SceneError
from geomech.io.files import whole_file
from geomech.output import plots
from geomech.output.netcdf import COMPONENTS, Variable, attribute, units_of
from geomech.scene import write as written
from geomech.scene.model import Scene
from geomech.study.sweep import AMPLITUDE

PARAMETERS = {  # units of parameters, by the last part of their names; the others have none
    "gamma0": "rad", "length": "m", "frequency": "Hz", "mass": "kg", "drag": "N", "depth": "m", "radius": "BL",
    "distance": "BL", "travel": "BL", "slope": "1/BL", "towards": "rad", "tilt": "rad", "period": "s", "extent": "rad",
    "regularisation": "BL/rad",
}  # fmt: skip


def save(path: Path, scene: Scene, results: dict) -> None:
    """The results as NetCDF: dimensions are the parameters with their dots as underscores, and component."""
    from scipy.io import netcdf_file

    with whole_file(path) as part, netcdf_file(part, "w", version=2) as file:
        for key, text in attributes(scene).items():
            setattr(file, key, attribute(text))
        for name, parameter, values in parameters(results):
            file.createDimension(name, len(values))
            axis = file.createVariable(name, "f8", (name,))
            axis[:] = values
            axis.long_name = parameter
        file.createDimension("component", 3)
        file.createDimension("component_length", 5)
        component = file.createVariable("component", "c", ("component", "component_length"))
        component[:] = np.array([list(c.ljust(5, "\0")) for c in COMPONENTS], "S1")
        component._Encoding = "ascii"
        for v in variables(scene, results):
            variable = file.createVariable(v.name, "f8", v.dimensions)
            variable[:] = v.values
            variable.units = v.units


def attributes(scene: Scene) -> dict[str, str]:
    """Of a file of a sweep."""
    said = getattr(scene.gait, "estimate_is", "")
    about = {"estimate_is": said} if said else {}
    return {"title": f"Net displacement per cycle of the scene {scene.name}", "scene": written.toml(scene), **about}


def parameters(results: dict) -> list[tuple[str, str, np.ndarray]]:
    """(name of the dimension, parameter, values) of each that is swept."""
    over = results["over"].items()
    return [(name.replace(".", "_").replace("-", "_"), name, np.array(values, float)) for name, values in over]


def variables(scene: Scene, results: dict) -> list[Variable]:
    """Of a file of a sweep, without its coordinates."""
    names, unit = tuple(name for name, *_ in parameters(results)), units_of(results["units"]["estimate"])
    found = [
        Variable("displacement", (*names, "component"), results["displacement"], f"{unit} (x, y), rad (theta)", ""),
        Variable("estimate", names, results["estimate"], unit, ""),
        Variable("estimate_heading", names, results["estimate_heading"], "rad", ""),
        Variable("length", names, results["length"], unit, ""),
    ]
    if "speed" in results:
        found += [
            Variable("frequency", names, results["frequency"], "Hz", ""),
            Variable("speed", names, results["speed"], f"{unit} s-1", ""),
        ]
    if "medium_error" in results:
        found += [
            Variable("medium_error", names, results["medium_error"], unit, ""),
            Variable("medium_error_heading", names, results["medium_error_heading"], "rad", ""),
        ]
    return found


def draw(scene: Scene, results: dict):
    """What is `drawn` against one parameter, or a map over two; SceneError for more."""
    over = results["over"]
    if len(over) > 2:
        raise SceneError(f"cannot draw {len(over)} parameters: sweep one or two, or leave --plot out")
    values, error, medium, label = drawn(scene, results)
    fig, axes = plots.figure(4.0, 3.0)
    ax, named = axes[0, 0], dict(zip(over, labels(scene, list(over))))
    order = np.ix_(*(np.argsort(x, kind="stable") for x in over.values()))
    rising = [np.sort(x) for x in over.values()]
    if len(over) == 1:
        _line(ax, *rising, values[order], error[order], None if medium is None else medium[order], label)
    else:
        _map(ax, *rising, values[order], label)
    ax.set(**{f"{axis}label": named[name] for axis, name in zip("xy", over)})
    return fig


def drawn(scene: Scene, results: dict):
    """(values, their errors, the medium's or None, a label): the net distance per cycle or, where the frequency differs from
    point to point, the speed; negative where it is backwards."""
    net, frequency = plots.net(results["displacement"]), results.get("frequency")
    unit, timed = results["units"]["estimate"], frequency is not None and np.ptp(frequency) > 0
    factor = frequency if timed else 1.0
    medium = results["medium_error"] * factor if "medium_error" in results else None
    net = net * factor
    label = f"speed ({unit}/s)" if timed else f"net distance per cycle ({unit})"
    return net, results["estimate"] * factor, medium, label + ", backwards < 0" * bool((net < 0).any())


@plots.styled
def _line(ax, x, values: np.ndarray, errors: np.ndarray, medium: np.ndarray | None, label: str) -> None:
    marker = "o" if len(x) <= plots.MARKED else ""
    ax.errorbar(x, values, yerr=errors, fmt=f"{marker}-", color="black", ms=3, lw=1)
    if medium is not None:
        plots.medium_band(ax, x, values, medium)
        ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0))
    ax.set_ylabel(label)


@plots.styled
def _map(ax, x, y, net: np.ndarray, label: str) -> None:
    """Cells about the points, that end where the values do; colours centred on zero where the sign changes."""
    from cmcrameri import cm

    top = np.abs(net).max() or 1.0
    signs = {"cmap": cm.vik, "vmin": -top, "vmax": top} if net.min() < 0 < net.max() else {"cmap": "viridis"}
    image = ax.pcolormesh(x, y, net.T, shading="nearest", rasterized=True, **signs)
    for values, limit in ((x, ax.set_xlim), (y, ax.set_ylim)):
        if values[0] < values[-1]:
            limit(values[0], values[-1])
    ax.figure.colorbar(image, ax=ax).set_label(label)


def labels(scene, parameters: list[str], units: Mapping[str, str] = PARAMETERS) -> list[str]:
    """For axes: names with units; by their last part where that says which, "body-inertia: frequency (Hz)" else."""
    last = [name.rpartition(".")[2] for name in parameters]
    out = []
    for name, short in zip(parameters, last):
        whose = name.split(".")[-2].replace("_", "-")
        shown = short if last.count(short) == 1 else f"{whose}: {short}"
        unit = "deg" if short.endswith("_deg") else units.get(short, "-")
        angle = shown.removesuffix("_deg").replace("gamma0", "gamma_0")
        out.append(scene.gait.amplitude_label if name == AMPLITUDE else plots.quantity(angle, unit))
    return out
