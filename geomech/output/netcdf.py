"""Connections as self-describing NetCDF (classic format, which every NetCDF library opens)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from geomech.geometry import two_form
from geomech.geometry.connection import Connection
from geomech.geometry.field import Field
from geomech.geometry.harmonics import Harmonics
from geomech.geometry.metric import Finsler, Metric
from geomech.geometry.tube import Known, Tube
from geomech.geometry.two_form import TwoForm
from geomech.io.files import whole_file
from geomech.io.tables.netcdf import SHAPE
from geomech.scene.model import Scene
from geomech.scene.write import toml
from geomech.study import effort
from geomech.study.bench import Study
from geomech.systems.base import length_unit, shape_labels
from geomech.systems.capabilities import OwnMetric, Recorded, capability, solver_of, stored
from geomech.systems.framed import Framed

COMPONENTS = ("x", "y", "theta")
ERROR_OF_CCF = "estimated error of ccf: largest difference, at a shape and its neighbours, from half the grid's points"
INTERVAL_OF_CCF = "half width of the interval of ccf"
UNITS = {"BL": "body length", "m": "m"}


class Variable(NamedTuple):
    """One of a file, or of a data set of xarray."""

    name: str
    dimensions: tuple[str, ...]
    values: np.ndarray
    units: str
    long_name: str


def save_connection(path: str | Path, study: Study) -> None:
    """Write A (component, joint, alpha_1, ...), its fit residual, the rms of xi, the CCF with its estimated error, of each
    pair of joints; for two joints, where xi is not linear in alphadot, its odd harmonics; what a change of shape costs, where
    something says it; with units, conventions (`about`) and the scene's text. `Connection.load` and [system] kind = "table"
    read it. The file appears whole or not at all."""
    write(path, attributes(study), study.fitted.axes, shape_labels(study.scene.system), variables(study))


def write(path: str | Path, told: Mapping, axes, labels, found: Sequence[Variable]) -> None:
    """A file of variables on the grid of ``axes``; told: its attributes; labels: (name, unit) of each shape variable. It
    appears whole or not at all."""
    from scipy.io import netcdf_file

    with whole_file(path) as part, netcdf_file(part, "w", version=2) as file:
        for key, value in told.items():
            text = isinstance(value, str)  # SciPy keeps but seven digits of a float of Python's
            setattr(file, key, attribute(value) if text else np.float64(value) if isinstance(value, float) else value)
        _coordinates(file, axes, labels)
        for name, dimensions, values, units, long_name in found:
            for dimension, size in zip(dimensions, values.shape):
                if dimension not in file.dimensions:
                    file.createDimension(dimension, size)
            _variable(file, name, values, dimensions, units, long_name)


def attributes(study: Study) -> dict:
    """Of a file of the scene's connection: what it is, what it rests on, and the scene's text."""
    scene = study.scene
    numerics = (
        repr(scene.numerics) if solver_of(scene.system) is None else f"{scene.numerics}, {solver_of(scene.system)}"
    )
    return {
        "title": f"Local connection and curvature constraint function of the scene {scene.name}",
        **about(scene),
        "scene": toml(scene),
        "numerics": numerics,
        "interpolation": int(study.fitted.degree),
        **(
            {}
            if (degree := scene.system.traits.power_degree) is None or effort.why_none(scene.system)
            else {"power_degree": degree}
        ),
    }


def variables(study: Study) -> list[Variable]:
    """Of a file of the scene's connection, without its coordinates."""
    unit = length_unit(study.scene.system)
    found = of_connection(study.fitted)
    if (error := stored(study.scene.system, "A_error")) is not None:
        found.append(of_error(error, unit))
    if isinstance(study.fitted, Tube):
        found += [*of_known(study.fitted.known, unit), of_reach(study.fitted)]
    if len(study.fitted.axes) == 2:
        found.append(of_ccf(study.curvature))
        what = INTERVAL_OF_CCF if isinstance(study.fitted, Tube) else ERROR_OF_CCF
        found.append(of_ccf(study.curvature_error, "ccf_error", what))
    elif len(study.fitted.axes) > 2:
        found += of_pairs(study.two_form, two_form.error(study.fitted))
    if isinstance(study.scene.system, Framed):
        found.append(of_frame(study.scene.system.field.field))
    if not effort.why_none(study.scene.system):
        found += of_metric(
            study.metric, capability(study.scene.system, OwnMetric) is None
        )  # before the harmonics, whose velocities it may share
    if (harmonics := study.harmonics) is not None:
        found += of_harmonics(harmonics, unit)
    if (even := study.even_part) is not None:
        units = f"{units_of(unit)} rad-1 (x, y), rad rad-1 (theta)"
        name = "rms over directions of xi(alphadot) + xi(-alphadot), |alphadot| = 1, which A takes for 0"
        found.append(Variable("even_part", ("component", *angles_of(study.fitted.axes)), even, units, name))
    return found


def of_connection(fitted: Connection) -> list[Variable]:
    """A, what its fit leaves, and the rms of xi."""
    angles = angles_of(fitted.axes)
    units = f"{units_of(fitted.unit)} rad-1 (x, y), rad rad-1 (theta)"
    left = "rms of xi - A alphadot over directions of alphadot, |alphadot| = 1"
    speed = "rms of xi over directions of alphadot, |alphadot| = 1"
    return [
        Variable("A", ("component", "joint", *angles), fitted.A, units, "local connection"),
        Variable("fit_residual", ("component", *angles), fitted.residual, units, left),
        Variable("speed", ("component", *angles), fitted.speed, units, speed),
    ]


def of_error(error: np.ndarray, unit: str) -> Variable:
    """Half widths (3, d, N_1, ...) of intervals of A."""
    units, over = f"{units_of(unit)} rad-1 (x, y), rad rad-1 (theta)", angles_of(error.shape[2:])
    return Variable("A_error", ("component", "joint", *over), error, units, "half width of the interval of A")


def of_reach(tube: Tube) -> Variable:
    """How far the grid of a connection near one gait is from it."""
    shapes = np.stack(np.meshgrid(*tube.axes, indexing="ij"), -1)
    told = "distance from the mean gait over that which the data reach: A is nan beyond 1"
    return Variable("reach", angles_of(tube.axes), tube.reach(shapes), "1", told)


def of_known(known: Known, unit: str) -> list[Variable]:
    """What a connection near one gait is looked up in (`geomech.geometry.tube`)."""
    units, order = (
        f"{units_of(unit)} rad-1 (x, y), rad rad-1 (theta)",
        "Fourier coefficients, 1, cos t, sin t, cos 2t ..., of",
    )
    lead, row = ("component", "joint"), "harmonic_of_A"
    return [
        Variable("gait", ("joint", "harmonic_of_gait"), known.loop.coefficients, "rad", f"{order} the mean gait"),
        Variable("gait_A", (*lead, row), known.A, units, f"{order} A at the mean gait"),
        Variable(
            "gait_slope", (*lead, "normal", row), known.slope, f"{units}, per rad",
            f"{order} the derivative of A along normals of the mean gait; to its left in the plane of two joints",
        ),
        Variable(
            "gait_errors", ("error", *lead, "A_and_normals", row), known.errors, units,
            "independent errors of gait_A, and of gait_slope: the squares of what each does add up to a variance",
        ),
        Variable(
            "gait_spread", ("joint", "other_joint", "place"), known.spread, "rad2",
            "at equally spaced phases: the data reach deviations d with d . inverse . d up to 1",
        ),
        Variable(
            "gait_beyond", ("component",), known.beyond, f"{units_of(unit)} (x, y), rad (theta)",
            "what the variation of the cycles changes in the net pose beyond the first order, part of its error",
        ),
        Variable(
            "gait_off", ("component", "along_and_across", "place"), known.off, units,
            "at equally spaced phases: standard errors of A along the mean gait, and across it, for what is left of xi",
        ),
    ]  # fmt: skip


def of_ccf(field: Field, name: str = "ccf", said: str = "") -> Variable:
    """A CCF, or its error."""
    units = f"{units_of(field.unit)} rad-2 (x, y), rad rad-2 (theta)"
    said = said or "curvature constraint function of joints 1 and 2"
    return Variable(name, ("component", *angles_of(field.axes)), field.values, units, said)


def of_pairs(form: TwoForm, error: TwoForm) -> list[Variable]:
    """The CCF of all pairs of joints, its error, and the pairs."""
    units = f"{units_of(form.field.unit)} rad-2 (x, y), rad rad-2 (theta)"
    pairs, over = np.array(form.pairs) + 1.0, ("pair", "component", *angles_of(form.field.axes))
    told = ", ".join(f"{i:g} {j:g}" for i, j in pairs)
    said = f"curvature constraint function of joints {told}, in this order"
    return [
        Variable("pair_joints", ("pair", "first_and_second"), pairs, "1", "joints i < j of each pair"),
        Variable("ccf_pairs", over, form.field.values, units, said),
        Variable("ccf_pairs_error", over, error.field.values, units, ERROR_OF_CCF.replace("ccf", "ccf_pairs", 1)),
    ]


def of_frame(pose: Field) -> Variable:
    """The pose of a minimum-perturbation frame in the frame that it was made from."""
    units = f"{units_of(pose.unit)} (x, y), rad (theta)"
    name = "pose of this frame in the mean frame of the body, h with g_this = g_mean h"
    return Variable("frame_pose", ("component", *angles_of(pose.axes)), pose.values, units, name)


def of_harmonics(table: Harmonics, unit: str) -> list[Variable]:
    """Coefficients of the odd harmonics of xi, and what they leave."""
    angles = angles_of(table.axes)
    units = f"{units_of(unit)} rad-1 (x, y), rad rad-1 (theta)"
    name = "coefficients of cos(k beta), sin(k beta), k = 1, 3, 5 ..., of xi for alphadot = (cos beta, sin beta)"
    left = "rms over directions of alphadot of what the harmonics leave of xi, |alphadot| = 1"
    return [
        Variable("harmonics", ("component", "coefficient", *angles), table.coefficients, units, name),
        Variable("harmonics_residual", ("component", *angles), table.residual, units, left),
    ]


def of_metric(metric: Metric | Finsler, power: bool = True) -> list[Variable]:
    """M, or the coefficients of a norm and what they leave. power: it is that of drag, not the system's own."""
    angles, size = angles_of(metric.axes), "drag that of the whole body along itself, lengths those of the body"
    if isinstance(metric, Metric):
        if not power:
            own = "metric M of the system itself: alphadot . M alphadot is what it costs to change shape"
            return [Variable("metric", ("joint", "other_joint", *angles), metric.M, effort.METRIC, own)]
        name = f"dissipation metric M, power = alphadot . M alphadot; {size}"
        units = "axial drag at 1 body length per time x body length x time rad-2"
        return [Variable("metric", ("joint", "other_joint", *angles), metric.M, units, name)]
    name = "coefficients of 1, cos(k beta), sin(k beta), k = 2, 4 ..., of F = power^(1 / power_degree) for alphadot = "
    units = "(axial drag x body length)^(1 / power_degree) rad-1"
    left = "rms over directions of alphadot of what the coefficients leave of F, |alphadot| = 1"
    return [
        Variable(
            "norm", ("norm_coefficient", *angles), metric.coefficients, units, f"{name}(cos beta, sin beta); {size}"
        ),
        Variable("norm_residual", angles, metric.residual, units, left),
    ]


def units_of(unit: str) -> str:
    """A unit of lengths as files name it."""
    return UNITS.get(unit, unit)


def angles_of(axes) -> tuple[str, ...]:
    """Names of the axes of shape space."""
    return tuple(f"alpha_{k + 1}" for k in range(len(axes)))


def shapes(axes, labels) -> list[Variable]:
    """The axes of shape space; labels: (name, unit) of each shape variable, alpha_k for an angle between links."""
    found = []
    for k, (name, axis, (label, unit)) in enumerate(zip(angles_of(axes), axes, labels)):
        joint = f"angle of joint {k + 1}, heading of link {k + 2} minus link {k + 1}"
        found.append(Variable(name, (name,), axis, unit, joint if label == name else f"{SHAPE}{label}"))
    return found


def about(scene: Scene) -> dict:
    """What the numbers of a connection rest on, as attributes of a file: frame, length, forces and signs."""
    system = scene.system
    meanings = {"mean": "centre of mass, length-weighted mean heading", "that of the table": "not told by its file"}
    meanings["minimum-perturbation"] = "the one in which the squares of A, integrated over the grid, are least"
    meanings["that of the log"] = "the one whose x, y and heading were logged"
    meaning = meanings.get(scene.frame, "centre and heading of that link, 1 the tail")
    return {
        "Conventions": "xi = + A alphadot; CCF = dA + [A, A], positive for counter-clockwise loops",
        "frame": scene.frame,
        "frame_meaning": f"body frame: {meaning}",
        "body_length": float(system.length),
        "length_unit": units_of(length_unit(system)),
        **recorded(system),
        "components": "x, y, theta of the body velocity xi: forward (tail to head), to the left, counter-clockwise",
        "sign_of_A": "xi = + A alphadot",
        "sign_of_ccf": "CCF = dA + [A, A] with [X, Y] = XY - YX, positive for counter-clockwise loops",
        "pair_of_ccf": "CCF_12 = dA_2 / dalpha_1 - dA_1 / dalpha_2 + [A_1, A_2]",
    }


def recorded(system) -> dict:
    recorded = capability(system, Recorded)
    return {} if recorded is None else recorded.about()


def attribute(text: str) -> bytes:
    """In UTF-8; what is none in a file name is escaped."""
    return text.encode("utf-8", "backslashreplace")


def _coordinates(file, axes, labels) -> None:
    width = max(map(len, COMPONENTS))
    file.createDimension("component", len(COMPONENTS))
    file.createDimension("component_length", width)
    variable = file.createVariable("component", "c", ("component", "component_length"))
    variable[:] = np.array([list(name.ljust(width, "\0")) for name in COMPONENTS], "S1")
    variable._Encoding = "ascii"
    file.createDimension("joint", len(axes))
    file.createVariable("joint", "i4", ("joint",))[:] = np.arange(1, len(axes) + 1)
    for name, dimensions, axis, units, long_name in shapes(axes, labels):
        file.createDimension(name, len(axis))
        _variable(file, name, axis, dimensions, units, long_name)


def _variable(file, name, values, dimensions, units, long_name) -> None:
    variable = file.createVariable(name, "f8", dimensions)
    variable[:] = values
    variable.units, variable.long_name = units, long_name
