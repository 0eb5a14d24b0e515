"""Connections, CCFs and other fields of a study over shape space, as variables of
results."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.io.tables import FORMATS, LAYOUTS
from geomech.io.tables.base import PERIOD, UNKNOWN_FRAME, body_text
from geomech.io.tables.netcdf import SHAPE
from geomech.mathematics.geometry import two_form
from geomech.mathematics.geometry.connection import Connection
from geomech.mathematics.geometry.curvature import ccf, exterior_derivative
from geomech.mathematics.geometry.metric import Finsler, Metric
from geomech.mathematics.geometry.minimum_perturbation import minimum_perturbation
from geomech.mathematics.geometry.periods import Periods, periodic_axes
from geomech.mathematics.geometry.representations.field import Field
from geomech.mathematics.geometry.representations.harmonics import Harmonics
from geomech.mathematics.geometry.representations.tube import TaylorSeries, Tube
from geomech.mathematics.geometry.stretch import Stretch
from geomech.mathematics.geometry.two_form import TwoForm
from geomech.mathematics.systems.base import (
    System,
    body_size,
    length_unit,
    shape_labels,
)
from geomech.mathematics.systems.capabilities import (
    OwnMetric,
    Recorded,
    capability,
    solver_of,
    stored_table,
)
from geomech.mathematics.systems.framed import Framed
from geomech.scenes import toml
from geomech.scenes.model import Scene
from geomech.studies.displacement.variables import COMPONENTS
from geomech.studies.estimates import effort
from geomech.studies.scene_tables import SceneTables
from rft.core.refusal import Refusal

# Contents of files.
WHOLE = "whole"
A_ALONE = "A"
STRUCT = "struct"

ERROR_OF_CCF = (
    "estimated error of ccf: largest difference, at a shape and its neighbours, from "
    "a grid with half as many points"
)
INTERVAL_OF_CCF = "half width of the confidence interval of ccf"
INTERVAL_OF_A = "half width of the confidence interval of A"


# Results.


def full_result(study: SceneTables) -> Result:
    """Return all fields of a study with their errors, units and conventions.

    These are A (component, joint, alpha_1, ...), its fit residual, the rms of xi, and
    the CCF of each pair of joints; for two joints, where xi is not linear in alphadot,
    its odd harmonics; and the metric, where there is one. `Connection.load` and
    [system] kind = "table" read them from a file."""
    return _result(study, variables(study))


def fitted_result(study: SceneTables) -> Result:
    """Return A, its fit residual and the rms of xi, with the conventions of a study."""
    A_error = stored_table(study.scene.system, "A_error")
    return _result(study, connection_variables(study.fitted, A_error))


def linear_result(study: SceneTables) -> Result:
    """Return the part of `full_result` for formats without a CCF: A with its errors,
    and the metric where it is a quadratic form."""
    system = study.scene.system
    A_error = stored_table(system, "A_error")
    found = connection_variables(study.fitted, A_error)
    found += even_part_variables(study)
    if has_matrix(system):
        of_drag = capability(system, OwnMetric) is None
        found += metric_variables(study.metric, of_drag)
    return _result(study, found)


def struct_result(study: SceneTables) -> Result:
    """Return the contents of sysplotter's struct s, for a connection of two joints.

    These are the variables of `linear_result`; A in minimum-perturbation coordinates
    and the pose of their frame; and, in both coordinates, the CCF and its part dA."""
    linear = linear_result(study)
    fitted = study.fitted
    frame = minimum_perturbation(fitted)
    optimised = replace(fitted, A=frame.connection(fitted))

    A_optimised = connection_variables(optimised)[0]
    found = [replace(A_optimised, name="A_optimised"), frame_variable(frame.field)]
    for ending, connection in (("", fitted), ("_optimized", optimised)):
        exterior = replace(fitted.field, values=exterior_derivative(connection))
        found.append(ccf_variable(ccf(connection), name=f"ccf{ending}"))
        found.append(ccf_variable(exterior, name=f"exterior{ending}"))
    return Result(linear.kind, (*linear.variables, *found), linear.attributes)


def _result(study: SceneTables, found: Sequence[Variable]) -> Result:
    """Return variables of a study with their coordinates and conventions."""
    labels = shape_labels(study.scene.system)
    axes = coordinates(study.fitted.axes, labels, study.fitted.periods)
    return Result("connection", (*axes, *found), attributes(study))


def connection_result(fitted: Connection, shapes: Sequence[str] = ()) -> Result:
    """Return A, its fit residual and the rms of xi of a connection without a scene.
    shapes: names of the shape variables, where these are not joint angles."""
    labels = _angle_labels(fitted.axes, shapes)
    axes = coordinates(fitted.axes, labels, fitted.periods)
    facts: dict[str, Any] = {"sign_of_A": "xi = + A alphadot"}
    if fitted.length is not None:
        facts["body_length"] = float(fitted.length)
        facts["length_unit"] = fitted.unit
    return Result("connection", (*axes, *connection_variables(fitted)), facts)


def field_result(values: Field, name: str, shapes: Sequence[str] = ()) -> Result:
    """Return a field; with rows x, y and theta it is a CCF, in its units."""
    labels = _angle_labels(values.axes, shapes)
    axes = coordinates(values.axes, labels, values.periods)
    lead = values.values.shape[: -values.joints]
    if lead == (3,):
        field = ccf_variable(values, name=name)
    else:
        lead_names = [f"dimension_{k}" for k in range(len(lead))]
        dims = (*lead_names, *angle_names(values.axes))
        field = Variable(name, dims, values.values)
    return Result("field", (*axes, field), {})


def _angle_labels(axes, names: Sequence[str]) -> list[tuple[str, str]]:
    return [(name, "rad") for name in names or angle_names(axes)]


# Files.

CONTENTS = {WHOLE: full_result, A_ALONE: linear_result, STRUCT: struct_result}


def contents(file: Callable, layout: str | None = None) -> str:
    """Return the key of CONTENTS for a format, in one of its layouts."""
    if layout == LAYOUTS[1]:
        return STRUCT
    if getattr(file, "whole", True):
        return WHOLE
    return A_ALONE


def save_connection(path: str | Path, study: SceneTables, **settings: str) -> None:
    """Write the connection of a study in the format of the path's ending. The file
    appears whole or not at all. settings: those of the format."""
    file = FORMATS[Path(path).suffix]
    check_joints(study.scene, file)
    result = CONTENTS[contents(file, settings.get("layout"))](study)
    file.write(path, result, **settings)


def check_joints(scene: Scene, file: Callable | None) -> None:
    """Refuse a body of more or fewer joints than a format (`geomech.io.tables.FORMATS`)
    takes, or with periods that it does not store; None is no format."""
    required = getattr(file, "joints", None)
    joints = scene.system.joints
    stores_periods = file is None or getattr(file, "periods", False)
    if scene.system.traits.periods and not stores_periods:
        raise Refusal(
            f"a {file.suffix} file stores no periods of shape variables",
            where=scene.name,
            instead="write a .nc file",
        )
    if required in (None, joints):
        return
    raise Refusal(
        f"a {file.suffix} file stores {required} joints, but this body has {joints}",
        where=scene.name,
        instead="write a .nc file, which stores any number of joints",
    )


def has_matrix(system: System) -> bool:
    """Return whether a system's metric is a quadratic form of alphadot."""
    stored = stored_table(system, "metric")
    if stored:
        return isinstance(stored, Metric)
    return not effort.why_no_metric(system) and effort.is_quadratic(system)


# Attributes.


def attributes(study: SceneTables) -> dict:
    """Return the attributes of a file of the connection: conventions, title, numerics
    and text of the scene."""
    scene = study.scene
    system = scene.system
    solver = solver_of(system)
    numerics = repr(scene.numerics)
    if solver is not None:
        numerics = f"{scene.numerics}, {solver}"
    facts = {
        **conventions(scene),
        "scene": scene.name,
        **scene_text(scene),
        "numerics": numerics,
        "interpolation": int(study.fitted.degree),
    }
    degree = system.traits.power_degree
    if degree is not None and not effort.why_no_metric(system):
        facts["power_degree"] = degree
    return facts


def scene_text(scene: Scene) -> dict[str, str]:
    """Return the text of a scene as an attribute; none if it has parts in Python."""
    try:
        return {"scene_toml": toml(scene)}
    except Refusal:
        return {}


def conventions(scene: Scene) -> dict:
    """Return the conventions of a connection as attributes of a file: frame, length,
    forces and signs."""
    system = scene.system
    facts = {
        "Conventions": (
            "xi = + A alphadot; CCF = dA + [A, A], positive for counter-clockwise loops"
        ),
        "frame": scene.frame,
        "frame_meaning": f"body frame: {_frame_meaning(scene.frame)}",
        "body_length": float(body_size(system)),
        "length_unit": length_unit(system),
        **recorded_attributes(system),
    }
    body = body_text(_body(system))
    if body:
        facts["body"] = body
    return {
        **facts,
        "components": (
            "x, y, theta of the body velocity xi: forward (tail to head), "
            "to the left, counter-clockwise"
        ),
        "sign_of_A": "xi = + A alphadot",
        "sign_of_ccf": (
            "CCF = dA + [A, A] with [X, Y] = XY - YX, "
            "positive for counter-clockwise loops"
        ),
        "pair_of_ccf": "CCF_12 = dA_2 / dalpha_1 - dA_1 / dalpha_2 + [A_1, A_2]",
    }


def _frame_meaning(frame: str) -> str:
    meanings = {
        "mean": "centre of mass, length-weighted mean heading",
        UNKNOWN_FRAME: "not given in its file",
        "minimum-perturbation": (
            "the one that minimises the integral of the squares of A over the grid"
        ),
        "that of the log": "the one whose x, y and heading were logged",
    }
    return meanings.get(
        frame, "centre and heading of that link, where link 1 is the tail"
    )


def recorded_attributes(system: System) -> dict:
    """Return the system's own attributes for files of its connection."""
    recorded = capability(system, Recorded)
    if recorded is None:
        return {}
    return dict(recorded.about())


def _body(system: System) -> Any:
    """Return the body of a system, or the one that its table was computed for; None
    without one."""
    inner = system
    if isinstance(system, Framed):
        inner = system.inner
    return getattr(getattr(inner, "stored", inner), "body", None)


# Variables.


def variables(study: SceneTables) -> list[Variable]:
    """Return the fields of a study, without their coordinates."""
    system = study.scene.system
    fitted = study.fitted
    unit = length_unit(system)

    found = connection_variables(fitted, stored_table(system, "A_error"))
    if isinstance(fitted, Tube):
        found += [*taylor_variables(fitted.taylor, unit), reach_variable(fitted)]
    found += _ccf_variables(study)
    if isinstance(system, Framed):
        found.append(frame_variable(system.field.field))
    # The metric before the harmonics, as they may share velocities.
    if not effort.why_no_metric(system):
        of_drag = capability(system, OwnMetric) is None
        found += metric_variables(study.metric, of_drag)
    harmonics = study.harmonics
    if harmonics is not None:
        found += harmonics_variables(harmonics, unit)
    return found + even_part_variables(study)


def _ccf_variables(study: SceneTables) -> list[Variable]:
    """Return the CCF of two joints, or of all pairs of more; none of one joint."""
    fitted = study.fitted
    joints = len(fitted.axes)
    if joints < 2:
        return []
    if joints > 2:
        return pair_variables(study.two_form, two_form.error(fitted))
    error_label = ERROR_OF_CCF
    if isinstance(fitted, Tube):
        error_label = INTERVAL_OF_CCF
    return [ccf_variable(study.curvature, study.curvature_error, error_label)]


def fit_variables(study: SceneTables) -> list[Variable]:
    """Return how well A describes xi: by component, the rms of the fit residual over
    the rms of xi, and the rms of the change of A with more directions over the rms of
    A; and the number of singular shapes. nan for a component without values."""
    fitted = study.fitted
    pairs = zip(fitted.residual, fitted.speed)
    shares = [_residual_share(residual, speed) for residual, speed in pairs]
    label = "rms residual of the fit over the rms of xi"
    found = [Variable("fit_share", ("component",), shares, "1", label)]

    if not study.scene.system.traits.linear and fitted.direction_error is not None:
        label = "rms change of A with more directions, over the rms of A"
        changes = _row_shares(fitted.direction_error, fitted.A)
        found.append(Variable("direction_share", ("component",), changes, "1", label))

    singular = int(np.isnan(fitted.A).any((0, 1)).sum())
    label = "number of singular grid points"
    found.append(Variable("singular_shapes", (), singular, "1", label))
    return found


def _residual_share(residual: np.ndarray, speed: np.ndarray) -> float:
    """Return the rms of residuals over the rms of speeds, nan left out; nan if there is
    no residual."""
    if not np.isfinite(residual).any():
        return np.nan
    with np.errstate(invalid="ignore"):
        mean_square = max(np.nanmean(speed**2), 1e-300)
        return np.sqrt(np.nanmean(residual**2) / mean_square)


def _row_shares(error: np.ndarray, A: np.ndarray) -> np.ndarray:
    """Return the rms of an error of A over the rms of A (3,), row by row."""
    axes = tuple(range(1, A.ndim))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.sqrt(np.nanmean(error**2, axes) / np.nanmean(A**2, axes))


def even_part_variables(study: SceneTables) -> list[Variable]:
    """Return the part of the velocity that is even in alphadot, if there is one."""
    even_part = study.even_part
    if even_part is None:
        return []
    dims = ("component", *angle_names(study.fitted.axes))
    units = component_units(length_unit(study.scene.system), "rad")
    label = (
        "rms over directions of xi(alphadot) + xi(-alphadot), |alphadot| = 1, which A "
        "assumes to be 0"
    )
    return [Variable("even_part", dims, even_part, units, label)]


def connection_variables(
    fitted: Connection, error: np.ndarray | None = None
) -> list[Variable]:
    """Return A, its fit residual, and the rms of xi. error: half widths
    (3, d, N_1, ...) of intervals of A."""
    angles = angle_names(fitted.axes)
    units = component_units(fitted.unit, "rad")
    residual = "rms of xi - A alphadot over directions of alphadot, |alphadot| = 1"
    speed = "rms of xi over directions of alphadot, |alphadot| = 1"
    over = ("component", *angles)
    return [
        Variable(
            "A", ("component", "joint", *angles), fitted.A, units, "local connection",
            error, error_label=INTERVAL_OF_A,
        ),
        Variable("fit_residual", over, fitted.residual, units, residual),
        Variable("xi_rms", over, fitted.speed, units, speed),
    ]  # fmt: skip


def component_units(unit: str, per: str) -> tuple[str, str, str]:
    """Return the units of x, y and theta of a field per ``per``. unit: of lengths."""
    return (f"{unit}/{per}", f"{unit}/{per}", f"rad/{per}")


def reach_variable(tube: Tube) -> Variable:
    """Return the distance of the grid's shapes from the gait of a connection near it,
    over the distance that the data reach."""
    shapes = np.stack(np.meshgrid(*tube.axes, indexing="ij"), -1)
    label = (
        "distance from the mean gait over the distance that the data reach; A is "
        "nan beyond 1"
    )
    return Variable("reach", angle_names(tube.axes), tube.reach(shapes), "1", label)


def taylor_variables(series: TaylorSeries, unit: str) -> list[Variable]:
    """Return the arrays of a connection near one gait
    (`geomech.mathematics.geometry.representations.tube`), from which a file restores
    it. unit: of lengths."""
    units = f"{unit}/rad (x, y), rad/rad (theta)"
    over = ("component", "joint")
    harmonics = "harmonic_of_A"
    fourier = "Fourier coefficients, 1, cos t, sin t, cos 2t ..., of"
    at_phases = "at equally spaced phases"
    slope = (
        f"{fourier} the derivative of A along normals of the mean gait; towards its "
        "left in the plane of two joints"
    )
    errors = (
        "independent errors of gait_A and of gait_slope; their squared contributions "
        "add up to a variance"
    )
    spread = f"{at_phases}: the data reach deviations d with d . inverse . d up to 1"
    beyond = (
        "change of the net pose by the variation of the cycles beyond the first "
        "order, part of its error"
    )
    standard_error = (
        f"{at_phases}: standard errors of A along and across the mean gait, from the "
        "residual of xi"
    )
    return [
        Variable(
            "gait", ("joint", "harmonic_of_gait"), series.loop.coefficients, "rad",
            f"{fourier} the mean gait",
        ),
        Variable(
            "gait_A", (*over, harmonics), series.A, units,
            f"{fourier} A at the mean gait",
        ),
        Variable(
            "gait_slope", (*over, "normal", harmonics), series.slope,
            f"{units}, per rad", slope,
        ),
        Variable(
            "gait_errors", ("error", *over, "A_and_normals", harmonics), series.errors,
            units, errors,
        ),
        Variable(
            "gait_spread", ("joint", "other_joint", "place"), series.spread, "rad2",
            spread,
        ),
        Variable(
            "gait_beyond", ("component",), series.beyond,
            f"{unit} (x, y), rad (theta)", beyond,
        ),
        Variable(
            "gait_off", ("component", "along_and_across", "place"),
            series.standard_error, units, standard_error,
        ),
    ]  # fmt: skip


def ccf_variable(
    field: Field,
    error: Field | None = None,
    error_label: str = ERROR_OF_CCF,
    name: str = "ccf",
) -> Variable:
    """Return a CCF with its error as a variable."""
    dims = ("component", *angle_names(field.axes))
    units = component_units(field.unit, "rad2")
    label = "curvature constraint function of joints 1 and 2"
    errors = None
    if error is not None:
        errors = error.values
    return Variable(
        name, dims, field.values, units, label, errors, error_label=error_label
    )


def pair_variables(form: TwoForm, error: TwoForm) -> list[Variable]:
    """Return the CCF of all pairs of joints, its error, and the pairs."""
    unit = form.field.unit
    pairs = np.array(form.pairs, float)
    order = ", ".join(f"{i:g} {j:g}" for i, j in pairs)
    return [
        Variable(
            "pair_joints", ("pair", "first_and_second"), pairs, "1",
            "joints i < j of each pair",
        ),
        Variable(
            "ccf_pairs",
            ("pair", "component", *angle_names(form.field.axes)),
            form.field.values,
            f"{unit}/rad2 (x, y), rad/rad2 (theta)",
            f"curvature constraint function of joints {order}, in this order",
            error.field.values,
            error_label=ERROR_OF_CCF.replace("ccf", "ccf_pairs", 1),
        ),
    ]  # fmt: skip


def frame_variable(pose: Field) -> Variable:
    """Return the pose of a minimum-perturbation frame in the original frame."""
    dims = ("component", *angle_names(pose.axes))
    units = (pose.unit, pose.unit, "rad")
    label = "pose of this frame in the mean frame of the body, h with g_this = g_mean h"
    return Variable("frame_pose", dims, pose.values, units, label)


def harmonics_variables(table: Harmonics, unit: str) -> list[Variable]:
    """Return the coefficients of the odd harmonics of xi, and their residual."""
    angles = angle_names(table.axes)
    units = component_units(unit, "rad")
    coefficients = (
        "coefficients of cos(k beta), sin(k beta), k = 1, 3, 5 ..., of xi "
        "for alphadot = (cos beta, sin beta)"
    )
    residual = (
        "rms residual of xi beyond the harmonics, over directions of alphadot with "
        "|alphadot| = 1"
    )
    return [
        Variable(
            "harmonics", ("component", "coefficient", *angles), table.coefficients,
            units, coefficients,
        ),
        Variable(
            "harmonics_residual", ("component", *angles), table.residual, units,
            residual,
        ),
    ]  # fmt: skip


def metric_variables(metric: Metric | Finsler, of_drag: bool = True) -> list[Variable]:
    """Return M, or the coefficients of a norm and their residual. of_drag: the metric
    is the power of drag, not the system's own metric."""
    angles = angle_names(metric.axes)
    scale = "unit of drag: the axial drag of the whole body; unit of length: the body"
    if isinstance(metric, Metric):
        dims = ("joint", "other_joint", *angles)
        if of_drag:
            units = "axial drag at 1 body length per time x body length x time rad-2"
            label = f"dissipation metric M, power = alphadot . M alphadot; {scale}"
        else:
            units = effort.METRIC_UNIT
            label = (
                "metric M of the system itself: alphadot . M alphadot is the cost of "
                "changing shape"
            )
        return [Variable("metric", dims, metric.M, units, label)]

    units = "(axial drag x body length)^(1 / power_degree) rad-1"
    label = (
        "coefficients of 1, cos(k beta), sin(k beta), k = 2, 4 ..., of "
        "F = power^(1 / power_degree) for alphadot = (cos beta, sin beta); "
        f"{scale}"
    )
    residual = (
        "rms residual of F beyond the coefficients, over directions of alphadot with "
        "|alphadot| = 1"
    )
    return [
        Variable(
            "norm", ("norm_coefficient", *angles), metric.coefficients, units, label
        ),
        Variable("norm_residual", angles, metric.residual, units, residual),
    ]


def stretch_variables(stretch: Stretch, unit: str) -> list[Variable]:
    """Return shape space redrawn to equal effort. unit: of path lengths."""
    dims = ("stretched_alpha_1", "stretched_alpha_2")
    shapes = stretch.field
    stretched = "position of a shape on the map where equal lengths take equal effort"
    rms = "rms relative error of lengths on paper"
    folded = "share of cells that are folded over"
    return [
        *(Variable(name, (name,), x, "rad") for name, x in zip(dims, shapes.axes)),
        Variable("stretched_shape", ("axis", *dims), shapes.values, unit, stretched),
        Variable("stretch_distortion", dims, stretch.distortion, "1", rms),
        Variable("stretch_rms", (), stretch.rms, "1", f"{rms}, over all cells"),
        Variable(
            "stretch_largest",
            (),
            stretch.largest,
            "1",
            "largest relative error of lengths on paper",
        ),
        Variable("stretch_folded", (), stretch.folded, "1", folded),
        Variable("stretch_interpolation", (), shapes.degree, "1", "degree of splines"),
    ]


# Coordinates.


def angle_names(axes) -> tuple[str, ...]:
    """Return the names of the axes of shape space, alpha_1 first."""
    return tuple(f"alpha_{k + 1}" for k in range(len(axes)))


def coordinates(
    axes: Sequence[np.ndarray],
    labels: Sequence[tuple[str, str]],
    periods: Periods = (),
) -> list[Variable]:
    """Return components, joints and the axes of shape space, and periods of axes.
    labels: (name, unit) of each shape variable; alpha_k is the angle between two
    links."""
    found = [
        Variable("component", ("component",), np.array(COMPONENTS)),
        Variable("joint", ("joint",), np.arange(1, len(axes) + 1, dtype="i4")),
    ]
    names = angle_names(axes)
    for k, (name, axis, (label, unit)) in enumerate(zip(names, axes, labels)):
        meaning = f"{SHAPE}{label}"
        if label == name:
            meaning = joint_label(k)
        found.append(Variable(name, (name,), axis, unit, meaning))
    return found + period_variables(names, periods)


def period_variables(names: Sequence[str], periods: Periods) -> list[Variable]:
    """Return the periods of axes as variables such as period_alpha_2, for those that
    have one. names: of the axes."""
    found = []
    for k in periodic_axes(periods):
        label = f"period of {names[k]}, whose axis has the same shape at both ends"
        name = f"{PERIOD}{names[k]}"
        found.append(Variable(name, (), periods[k], "rad", label))
    return found


def joint_label(k: int) -> str:
    """Return the meaning of the angle of joint k, counted from 0."""
    return f"angle of joint {k + 1}, heading of link {k + 2} minus link {k + 1}"
