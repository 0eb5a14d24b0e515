"""Connections as self-describing NetCDF (classic format, which every NetCDF library opens)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from geomech.files import whole_file
from geomech.scene.model import Scene
from geomech.scene.write import toml
from geomech.study.bench import Study

COMPONENTS = ("x", "y", "theta")


def save_connection(path: str | Path, study: Study) -> None:
    """Write A (component, joint, alpha_1, ...), its fit residual and, for two joints, the CCF and its estimated error,
    with units, conventions (`about`) and the scene's text. The file appears whole or not at all."""
    from scipy.io import netcdf_file

    scene, fitted = study.scene, study.fitted
    unit = "body length" if scene.system.unit == "BL" else "m"
    with whole_file(path) as part, netcdf_file(part, "w", version=2) as file:
        file.title = attribute(f"Local connection and curvature constraint function of the scene {scene.name}")
        for key, value in about(scene).items():
            setattr(file, key, value)
        file.scene = attribute(toml(scene))
        file.numerics = (
            repr(scene.numerics) if scene.system.solver is None else f"{scene.numerics}, {scene.system.solver}"
        )
        _coordinates(file, fitted)
        angles = tuple(f"alpha_{k + 1}" for k in range(len(fitted.axes)))
        units = f"{unit} rad-1 (x, y), rad rad-1 (theta)"
        _variable(file, "A", fitted.A, ("component", "joint", *angles), units, "local connection")
        name = "rms of xi - A alphadot over directions of alphadot, |alphadot| = 1"
        _variable(file, "fit_residual", fitted.residual, ("component", *angles), units, name)
        if len(angles) == 2:
            units = f"{unit} rad-2 (x, y), rad rad-2 (theta)"
            name = "curvature constraint function of joints 1 and 2"
            _variable(file, "ccf", study.curvature.values, ("component", *angles), units, name)
            name = (
                "estimated error of ccf: largest difference, at a shape and its neighbours, from half the grid's points"
            )
            _variable(file, "ccf_error", study.curvature_error.values, ("component", *angles), units, name)


def about(scene: Scene) -> dict:
    """What the numbers of a connection rest on, as attributes of a file: frame, length, forces and signs."""
    system = scene.system
    mean = "centre of mass, length-weighted mean heading"
    return {
        "Conventions": "xi = + A alphadot; CCF = dA + [A, A], positive for counter-clockwise loops",
        "frame": scene.frame,
        "frame_meaning": f"body frame: {mean if scene.frame == 'mean' else 'centre and heading of that link, 1 the tail'}",
        "body_length": float(system.length),
        "length_unit": "body length" if system.unit == "BL" else "m",
        **system.about(),
        "components": "x, y, theta of the body velocity xi: forward (tail to head), to the left, counter-clockwise",
        "sign_of_A": "xi = + A alphadot",
        "sign_of_ccf": "CCF = dA + [A, A] with [X, Y] = XY - YX, positive for counter-clockwise loops",
        "pair_of_ccf": "CCF_12 = dA_2 / dalpha_1 - dA_1 / dalpha_2 + [A_1, A_2]",
    }


def attribute(text: str) -> bytes:
    """In UTF-8; what is none in a file name is escaped."""
    return text.encode("utf-8", "backslashreplace")


def _coordinates(file, fitted) -> None:
    width = max(map(len, COMPONENTS))
    file.createDimension("component", len(COMPONENTS))
    file.createDimension("component_length", width)
    variable = file.createVariable("component", "c", ("component", "component_length"))
    variable[:] = np.array([list(name.ljust(width, "\0")) for name in COMPONENTS], "S1")
    variable._Encoding = "ascii"
    file.createDimension("joint", len(fitted.axes))
    file.createVariable("joint", "i4", ("joint",))[:] = np.arange(1, len(fitted.axes) + 1)
    for k, axis in enumerate(fitted.axes):
        name = f"alpha_{k + 1}"
        file.createDimension(name, len(axis))
        _variable(
            file, name, axis, (name,), "rad", f"angle of joint {k + 1}, heading of link {k + 2} minus link {k + 1}"
        )


def _variable(file, name, values, dimensions, units, long_name) -> None:
    variable = file.createVariable(name, "f8", dimensions)
    variable[:] = values
    variable.units, variable.long_name = units, long_name
