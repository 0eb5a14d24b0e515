"""Sweeps over walking robots as NetCDF and as pictures."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from geomech.core.errors import SceneError
from geomech.io.files import whole_file
from geomech.output import plots
from geomech.output.netcdf import attribute
from geomech.output.sweeps import labels
from geomech.scene import write as written
from geomech.scene.walker import WalkerScene
from geomech.study.walking import STATUSES

UNITS = {  # of parameters, by the last part of their names; the others have none
    "mass": "kg", "inertia": "kg m$^2$", "length": "m", "width": "m", "height": "m", "hip_height": "m", "radius": "m",
    "lug_height": "m", "lug_width": "m", "axle": "m", "frequency": "Hz", "sweep": "rad", "middle": "rad", "air_speed": "m/s",
    "fluidisation": "m/s", "grazing": "rad", "duration": "s", "rounding": "m/s", "core": "m", "pitch": "m", "thickness": "m",
    "nose": "m", "track": "m", "drop": "m", "xi_n": "N/m$^3$", "density": "kg/m$^3$",
}  # fmt: skip


def save(path: Path, scene: WalkerScene, results: dict) -> None:
    """The results as NetCDF: dimensions are the parameters with their dots as underscores; status is an index, told in its
    attribute."""
    from scipy.io import netcdf_file

    with whole_file(path) as part, netcdf_file(part, "w", version=2) as file:
        file.title = attribute(f"Mean speed of the walking robot {scene.name}")
        file.scene = attribute(written.toml(scene))
        names = []
        for parameter, values in results["over"].items():
            names.append(parameter.replace(".", "_").replace("-", "_"))
            file.createDimension(names[-1], len(values))
            axis = file.createVariable(names[-1], "f8", (names[-1],))
            axis[:] = values
            axis.long_name = parameter
        for name, unit in (("speed", "m/s"), ("estimate", "m/s"), ("cycles", "1"), ("status", "1")):
            variable = file.createVariable(name, "f8", tuple(names))
            variable[:] = results[name] if name != "status" else _index(results["status"])
            variable.units = unit
        variable.long_name = ", ".join(f"{k}: {status}" for k, status in enumerate(STATUSES))


def _index(status: np.ndarray) -> np.ndarray:
    return np.argmax(np.array(STATUSES) == status[..., None], -1)


def told(results: dict) -> str:
    """One line."""
    speed, kinds = results["speed"], {s: int((results["status"] == s).sum()) for s in STATUSES}
    which = ", ".join(f"{count} {kind}" for kind, count in kinds.items() if count)
    return f"{speed.size} points ({which}), speed {speed.min():.6g} to {speed.max():.6g} m/s"


@plots.styled
def draw(scene: WalkerScene, results: dict):
    """Speed against one parameter, or against the first for every value of a second; open: not walking. SceneError for more."""
    over = results["over"]
    if len(over) > 2:
        raise SceneError(f"cannot draw {len(over)} parameters: sweep one or two, or leave --plot out")
    name, *second = labels(scene, list(over), UNITS)
    values, *others = over.values()
    fig, axes = plots.figure(4.6, 3.2)
    curves(axes[0, 0], values, results, [f"{second[0]}: {v:g}" for v in others[0]] if others else [""])
    axes[0, 0].set(xlabel=name, ylabel="mean speed (m/s)")
    return fig


def curves(ax, values, results: dict, names) -> None:
    """Speed (N, ...) over ``values``, a curve for each name, with its error; open: not walking."""
    from cmcrameri import cm

    speed, error, status = (np.asarray(results[x]).reshape(len(values), -1) for x in ("speed", "estimate", "status"))
    for k, label in enumerate(names):
        colour = cm.batlow(0.85 * k / max(1, len(names) - 1))
        ax.errorbar(values, speed[:, k], yerr=error[:, k], color=colour, lw=1.0, capsize=2, label=label)
        for fill, some in ((colour, status[:, k] == "walking"), ("white", status[:, k] != "walking")):
            ax.plot(np.array(values)[some], speed[some, k], "o", ms=4, color=colour, mfc=fill)
    if any(names):
        ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
