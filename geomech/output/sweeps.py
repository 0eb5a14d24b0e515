"""Sweeps as NetCDF and as pictures."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from geomech.errors import SceneError
from geomech.files import whole_file
from geomech.output import plots
from geomech.output.netcdf import COMPONENTS, UNITS, Variable, attribute
from geomech.scene import write as written
from geomech.scene.model import Scene
from geomech.study.sweep import AMPLITUDE


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
    return {"title": f"Net displacement per cycle of the scene {scene.name}", "scene": written.toml(scene)}


def parameters(results: dict) -> list[tuple[str, str, np.ndarray]]:
    """(name of the dimension, parameter, values) of each that is swept."""
    over = results["over"].items()
    return [(name.replace(".", "_").replace("-", "_"), name, np.array(values, float)) for name, values in over]


def variables(scene: Scene, results: dict) -> list[Variable]:
    """Of a file of a sweep, without its coordinates."""
    names, unit = tuple(name for name, *_ in parameters(results)), UNITS[scene.system.unit]
    return [
        Variable("displacement", (*names, "component"), results["displacement"], f"{unit} (x, y), rad (theta)", ""),
        Variable("estimate", names, results["estimate"], "body length", ""),
        Variable("estimate_heading", names, results["estimate_heading"], "rad", ""),
    ]


def draw(scene: Scene, results: dict):
    """Net displacement against one parameter, or a map over two; SceneError for more."""
    over = results["over"]
    if len(over) > 2:
        raise SceneError(f"cannot draw {len(over)} parameters: sweep one or two, or leave --plot out")
    net, label = plots.net(results["displacement"]), f"displacement per cycle ({scene.system.unit})"
    fig, axes = plots.figure(4.0, 3.0)
    ax, names = axes[0, 0], list(over)
    named = [scene.gait.amplitude_label if name == AMPLITUDE else name for name in names]
    if len(over) == 1:
        ax.errorbar(over[names[0]], net, yerr=results["estimate"], fmt="o-", color="black", ms=3, lw=1)
        ax.set(xlabel=named[0], ylabel=label)
    else:
        image = ax.pcolormesh(over[names[0]], over[names[1]], net.T, shading="nearest", cmap="viridis", rasterized=True)
        fig.colorbar(image, ax=ax).set_label(label)
        ax.set(xlabel=named[0], ylabel=named[1])
    return fig
