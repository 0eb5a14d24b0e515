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

LENGTHS = ("body.length", "system.length", "physical.length")
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
    fig, axes = plots.figure(4.0, 3.0)
    named = dict(zip(over, labels(scene, list(over))))
    order = np.ix_(*(np.argsort(values, kind="stable") for values in over.values()))
    rising = {name: np.sort(values) for name, values in over.items()}
    unit = "m" if {*over} & {*LENGTHS} else scene.system.unit
    net, label = plots.net(results["displacement"])[order], f"displacement per cycle ({unit})"
    (_line if len(over) == 1 else _map)(axes[0, 0], rising, net, _errors(scene, results)[order], label)
    axes[0, 0].set(**{f"{axis}label": named[name] for axis, name in zip("xy", over)})
    return fig


def _errors(scene: Scene, results: dict) -> np.ndarray:
    """Those of positions, in the scene's unit, as the displacement is."""
    errors = np.array(results["estimate"], float)
    lengths = [k for k, name in enumerate(results["over"]) if name in LENGTHS]
    if not lengths:
        return errors * scene.system.length
    values = np.array(list(results["over"].values())[lengths[0]])
    return errors * values.reshape([-1 if k == lengths[0] else 1 for k in range(errors.ndim)])


@plots.styled
def _line(ax, over: dict, net: np.ndarray, errors: np.ndarray, label: str) -> None:
    (values,) = over.values()
    marker = "o" if len(values) <= plots.MARKED else ""
    ax.errorbar(values, net, yerr=errors, fmt=f"{marker}-", color="black", ms=3, lw=1)
    ax.set_ylabel(label)


@plots.styled
def _map(ax, over: dict, net: np.ndarray, errors: np.ndarray, label: str) -> None:
    """Cells about the points, that end where the values do; colours centred on zero where the sign changes."""
    from cmcrameri import cm

    x, y = over.values()
    top = np.abs(net).max() or 1.0
    signs = {"cmap": cm.vik, "vmin": -top, "vmax": top} if net.min() < 0 < net.max() else {"cmap": "viridis"}
    image = ax.pcolormesh(x, y, net.T, shading="nearest", rasterized=True, **signs)
    for values, limit in ((x, ax.set_xlim), (y, ax.set_ylim)):
        if values[0] < values[-1]:
            limit(values[0], values[-1])
    ax.figure.colorbar(image, ax=ax).set_label(label)


def labels(scene: Scene, parameters: list[str]) -> list[str]:
    """For axes: names with units; by their last part where that says which, "body-inertia: frequency (Hz)" else."""
    last = [name.rpartition(".")[2] for name in parameters]
    out = []
    for name, short in zip(parameters, last):
        whose = name.split(".")[-2].replace("_", "-")
        shown = short if last.count(short) == 1 else f"{whose}: {short}"
        unit = "deg" if short.endswith("_deg") else PARAMETERS.get(short, "-")
        angle = shown.removesuffix("_deg").replace("gamma0", "gamma_0")
        out.append(scene.gait.amplitude_label if name == AMPLITUDE else plots.quantity(angle, unit))
    return out
