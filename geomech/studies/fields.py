"""Connections, CCFs and other fields of a study over shape space, as variables of results."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.geometry import two_form
from geomech.geometry.connection import Connection
from geomech.geometry.curvature import ccf, exterior_derivative
from geomech.geometry.field import Field
from geomech.geometry.harmonics import Harmonics
from geomech.geometry.metric import Finsler, Metric
from geomech.geometry.minimum_perturbation import minimum_perturbation
from geomech.geometry.stretch import Stretch
from geomech.geometry.tube import TaylorSeries, Tube
from geomech.geometry.two_form import TwoForm
from geomech.io.tables import FORMATS, LAYOUTS
from geomech.io.tables.base import UNKNOWN_FRAME, body_text
from geomech.io.tables.netcdf import SHAPE
from geomech.scenes import toml
from geomech.scenes.model import Scene
from geomech.studies import effort
from geomech.studies.scene_tables import SceneTables
from geomech.studies.tables import COMPONENTS
from geomech.systems.base import System, body_size, length_unit, shape_labels
from geomech.systems.capabilities import (
    OwnMetric,
    Recorded,
    capability,
    solver_of,
    stored_table,
)
from geomech.systems.framed import Framed
from rft.core.refusal import Refusal

WHOLE, A_ALONE, STRUCT = "whole", "A", "struct"  # contents of files
ERROR_OF_CCF = "estimated error of ccf: largest difference, at a shape and its neighbours, from half the grid's points"
INTERVAL_OF_CCF = "half width of the interval of ccf"
INTERVAL_OF_A = "half width of the interval of A"


def of_study(study: SceneTables) -> Result:
    """Return A (component, joint, alpha_1, ...), its fit residual, the rms of xi, and the CCF with its estimated error,
    of each pair of joints; for two joints, where xi is not linear in alphadot, its odd harmonics; the metric, where
    there is one.

    With units, conventions (`about`) and the scene's text. `Connection.load` and [system] kind = "table" read it from a
    file."""
    labels = shape_labels(study.scene.system)
    return Result(
        "connection",
        (*coordinates(study.fitted.axes, labels), *variables(study)),
        attributes(study),
    )


def of_fitted_study(study: SceneTables) -> Result:
    """Return A, its fit residual and the rms of xi, with the conventions of a study."""
    labels = shape_labels(study.scene.system)
    found = of_connection(study.fitted, stored_table(study.scene.system, "A_error"))
    axes = coordinates(study.fitted.axes, labels)
    return Result("connection", (*axes, *found), attributes(study))


def of_fit(study: SceneTables) -> list[Variable]:
    """Return the share of the rms of xi that the linear fit leaves and the share of A that
    more directions change, by component, and the number of singular shapes."""
    fitted = study.fitted
    with np.errstate(invalid="ignore"):
        shares = []
        for residual, speed in zip(fitted.residual, fitted.speed):
            known = np.isfinite(residual)
            share = np.nan
            if known.any():
                size = max(np.nanmean(speed**2), 1e-300)
                share = np.sqrt(np.nanmean(residual**2) / size)
            shares.append(share)
    singular = int(np.isnan(fitted.A).any((0, 1)).sum())
    label = "rms of what the fit leaves, over the rms of xi"
    found = [Variable("fit_share", ("component",), shares, "1", label)]
    if not study.scene.system.traits.linear and fitted.direction_error is not None:
        label = "rms of what more directions change A by, over the rms of A"
        changes = _row_shares(fitted.direction_error, fitted.A)
        found.append(Variable("direction_share", ("component",), changes, "1", label))
    return [
        *found,
        Variable("singular_shapes", (), singular, "1", "points of the grid"),
    ]


def _row_shares(error: np.ndarray, A: np.ndarray) -> np.ndarray:
    """Return the rms of an error of A over the rms of A (3,), row by row."""
    axes = tuple(range(1, A.ndim))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.sqrt(np.nanmean(error**2, axes) / np.nanmean(A**2, axes))


def of_connection_alone(study: SceneTables) -> Result:
    """Return what `of_study` has of A, its errors and its axes, and of a metric that is a quadratic form."""
    labels = shape_labels(study.scene.system)
    variables = of_connection(
        study.fitted, stored_table(study.scene.system, "A_error")
    ) + of_even_part(study)
    if has_matrix(study.scene.system):
        variables += of_metric(
            study.metric, capability(study.scene.system, OwnMetric) is None
        )
    return Result(
        "connection",
        (*coordinates(study.fitted.axes, labels), *variables),
        attributes(study),
    )


def of_struct(study: SceneTables) -> Result:
    """Return what sysplotter's struct s has of a connection of two joints: that of `of_connection_alone`, the same in
    minimum-perturbation coordinates, the pose of their frame, and CCFs with their part dA."""
    alone, fitted = of_connection_alone(study), study.fitted
    frame = minimum_perturbation(fitted)
    optimised = replace(fitted, A=frame.connection(fitted))
    variables = [
        replace(of_connection(optimised)[0], name="A_optimised"),
        of_frame(frame.field),
    ]
    for ending, each in (("", fitted), ("_optimized", optimised)):
        variables.append(of_ccf(ccf(each), name=f"ccf{ending}"))
        variables.append(
            of_ccf(
                replace(fitted.field, values=exterior_derivative(each)),
                name=f"exterior{ending}",
            )
        )
    return Result(alone.kind, (*alone.variables, *variables), alone.attributes)


CONTENTS = {WHOLE: of_study, A_ALONE: of_connection_alone, STRUCT: of_struct}


def contents(file: Callable, layout: str | None = None) -> str:
    """Return which of CONTENTS a format writes, in a layout that it may have."""
    return (
        STRUCT
        if layout == LAYOUTS[1]
        else WHOLE
        if getattr(file, "whole", True)
        else A_ALONE
    )


def save_connection(path: str | Path, study: SceneTables, **settings: str) -> None:
    """Write the connection of a study in the format that the ending names, with ``settings`` that it takes; the file appears
    whole or not at all."""
    file = FORMATS[Path(path).suffix]
    check_joints(study.scene, file)
    file.write(
        path, CONTENTS[contents(file, settings.get("layout"))](study), **settings
    )


def has_matrix(system: System) -> bool:
    """Return whether a system has a metric that is a quadratic form of the rates of shape."""
    own = stored_table(system, "metric")
    return (
        isinstance(own, Metric)
        if own
        else not effort.why_no_metric(system) and effort.is_quadratic(system)
    )


def check_joints(scene: Scene, file: Callable | None) -> None:
    """Refuse a body of more or fewer joints than a format (`geomech.io.tables.FORMATS`), if there is one, takes."""
    if (only := getattr(file, "joints", None)) not in (None, scene.system.joints):
        why = f"a {file.suffix} file has a layout of {only} joints, and this body has {scene.system.joints}"
        raise Refusal(
            why,
            where=scene.name,
            instead="write a .nc file, which takes any number of joints",
        )


def attributes(study: SceneTables) -> dict:
    """Return title, conventions, numerics and text of a scene, as attributes of a file of its connection."""
    scene = study.scene
    numerics = (
        repr(scene.numerics)
        if solver_of(scene.system) is None
        else f"{scene.numerics}, {solver_of(scene.system)}"
    )
    return {
        **about(scene),
        "scene": scene.name,
        **text_of(scene),
        "numerics": numerics,
        "interpolation": int(study.fitted.degree),
        **(
            {}
            if (degree := scene.system.traits.power_degree) is None
            or effort.why_no_metric(scene.system)
            else {"power_degree": degree}
        ),
    }


def text_of(scene: Scene) -> dict[str, str]:
    """Return the text of a scene as an attribute; none if it has parts of Python alone."""
    try:
        return {"scene_toml": toml(scene)}
    except Refusal:
        return {}


def variables(study: SceneTables) -> list[Variable]:
    """Return the fields of a study, without their coordinates."""
    unit = length_unit(study.scene.system)
    variables = of_connection(study.fitted, stored_table(study.scene.system, "A_error"))
    if isinstance(study.fitted, Tube):
        variables += [*of_known(study.fitted.taylor, unit), of_reach(study.fitted)]
    if len(study.fitted.axes) == 2:
        what = INTERVAL_OF_CCF if isinstance(study.fitted, Tube) else ERROR_OF_CCF
        variables.append(of_ccf(study.curvature, study.curvature_error, what))
    elif len(study.fitted.axes) > 2:
        variables += of_pairs(study.two_form, two_form.error(study.fitted))
    if isinstance(study.scene.system, Framed):
        variables.append(of_frame(study.scene.system.field.field))
    if not effort.why_no_metric(study.scene.system):
        variables += of_metric(
            study.metric, capability(study.scene.system, OwnMetric) is None
        )  # before the harmonics, as they may share velocities
    if (harmonics := study.harmonics) is not None:
        variables += of_harmonics(harmonics, unit)
    return variables + of_even_part(study)


def of_even_part(study: SceneTables) -> list[Variable]:
    """Return the part of the velocity that is even in alphadot, if there is one."""
    if (even := study.even_part) is None:
        return []
    units = of_components(length_unit(study.scene.system), "rad")
    name = "rms over directions of xi(alphadot) + xi(-alphadot), |alphadot| = 1, which A takes for 0"
    return [
        Variable(
            "even_part", ("component", *angles_of(study.fitted.axes)), even, units, name
        )
    ]


def of_connection(
    fitted: Connection, error: np.ndarray | None = None
) -> list[Variable]:
    """Return A, its fit residual, and the rms of xi. error: half widths (3, d, N_1, ...) of intervals of A."""
    angles = angles_of(fitted.axes)
    units = of_components(fitted.unit, "rad")
    residual = "rms of xi - A alphadot over directions of alphadot, |alphadot| = 1"
    speed = "rms of xi over directions of alphadot, |alphadot| = 1"
    return [
        Variable(
            "A",
            ("component", "joint", *angles),
            fitted.A,
            units,
            "local connection",
            error,
            error_label=INTERVAL_OF_A,
        ),
        Variable(
            "fit_residual", ("component", *angles), fitted.residual, units, residual
        ),
        Variable("xi_rms", ("component", *angles), fitted.speed, units, speed),
    ]


def of_components(unit: str, per: str) -> tuple[str, str, str]:
    """Return the units of x, y and theta of a field. unit: of lengths."""
    return (f"{unit}/{per}", f"{unit}/{per}", f"rad/{per}")


def of_reach(tube: Tube) -> Variable:
    """Return the distance of the grid of a connection near one gait from it."""
    shapes = np.stack(np.meshgrid(*tube.axes, indexing="ij"), -1)
    label = (
        "distance from the mean gait over that which the data reach: A is nan beyond 1"
    )
    return Variable("reach", angles_of(tube.axes), tube.reach(shapes), "1", label)


def of_known(known: TaylorSeries, unit: str) -> list[Variable]:
    """Return the arrays of a connection near one gait (`geomech.geometry.tube`)."""
    units, order = (
        f"{unit}/rad (x, y), rad/rad (theta)",
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
            "gait_beyond", ("component",), known.beyond, f"{unit} (x, y), rad (theta)",
            "what the variation of the cycles changes in the net pose beyond the first order, part of its error",
        ),
        Variable(
            "gait_off", ("component", "along_and_across", "place"), known.standard_error, units,
            "at equally spaced phases: standard errors of A along the mean gait, and across it, for what is left of xi",
        ),
    ]  # fmt: skip


def of_ccf(
    field: Field,
    error: Field | None = None,
    what: str = ERROR_OF_CCF,
    name: str = "ccf",
) -> Variable:
    """Return a CCF as a variable. what: text on the kind of its error."""
    units = of_components(field.unit, "rad2")
    label, dims = (
        "curvature constraint function of joints 1 and 2",
        ("component", *angles_of(field.axes)),
    )
    return Variable(
        name,
        dims,
        field.values,
        units,
        label,
        None if error is None else error.values,
        error_label=what,
    )


def of_pairs(form: TwoForm, error: TwoForm) -> list[Variable]:
    """Return the CCF of all pairs of joints, its error, and the pairs."""
    u = form.field.unit
    units = f"{u}/rad2 (x, y), rad/rad2 (theta)"
    pairs, over = (
        np.array(form.pairs) + 1.0,
        ("pair", "component", *angles_of(form.field.axes)),
    )
    order = ", ".join(f"{i:g} {j:g}" for i, j in pairs)
    label = f"curvature constraint function of joints {order}, in this order"
    return [
        Variable(
            "pair_joints",
            ("pair", "first_and_second"),
            pairs,
            "1",
            "joints i < j of each pair",
        ),
        Variable(
            "ccf_pairs",
            over,
            form.field.values,
            units,
            label,
            error.field.values,
            error_label=ERROR_OF_CCF.replace("ccf", "ccf_pairs", 1),
        ),
    ]


def of_frame(pose: Field) -> Variable:
    """Return the pose of a minimum-perturbation frame in the original frame."""
    units = (pose.unit, pose.unit, "rad")
    name = "pose of this frame in the mean frame of the body, h with g_this = g_mean h"
    return Variable(
        "frame_pose", ("component", *angles_of(pose.axes)), pose.values, units, name
    )


def of_harmonics(table: Harmonics, unit: str) -> list[Variable]:
    """Return the coefficients of the odd harmonics of xi, and their residual."""
    angles = angles_of(table.axes)
    units = of_components(unit, "rad")
    name = "coefficients of cos(k beta), sin(k beta), k = 1, 3, 5 ..., of xi for alphadot = (cos beta, sin beta)"
    residual = "rms over directions of alphadot of what the harmonics leave of xi, |alphadot| = 1"
    return [
        Variable(
            "harmonics",
            ("component", "coefficient", *angles),
            table.coefficients,
            units,
            name,
        ),
        Variable(
            "harmonics_residual",
            ("component", *angles),
            table.residual,
            units,
            residual,
        ),
    ]


def of_metric(metric: Metric | Finsler, power: bool = True) -> list[Variable]:
    """Return M, or the coefficients of a norm and their residual. power: it is the power of drag, not the system's own
    metric."""
    angles, size = (
        angles_of(metric.axes),
        "drag that of the whole body along itself, lengths those of the body",
    )
    if isinstance(metric, Metric):
        if not power:
            own = "metric M of the system itself: alphadot . M alphadot is what it costs to change shape"
            return [
                Variable(
                    "metric",
                    ("joint", "other_joint", *angles),
                    metric.M,
                    effort.METRIC_UNIT,
                    own,
                )
            ]
        name = f"dissipation metric M, power = alphadot . M alphadot; {size}"
        units = "axial drag at 1 body length per time x body length x time rad-2"
        return [
            Variable("metric", ("joint", "other_joint", *angles), metric.M, units, name)
        ]
    name = "coefficients of 1, cos(k beta), sin(k beta), k = 2, 4 ..., of F = power^(1 / power_degree) for alphadot = "
    units = "(axial drag x body length)^(1 / power_degree) rad-1"
    residual = "rms over directions of alphadot of what the coefficients leave of F, |alphadot| = 1"
    return [
        Variable(
            "norm",
            ("norm_coefficient", *angles),
            metric.coefficients,
            units,
            f"{name}(cos beta, sin beta); {size}",
        ),
        Variable("norm_residual", angles, metric.residual, units, residual),
    ]


def of_stretch(stretch: Stretch, unit: str) -> list[Variable]:
    """Return shape space redrawn to equal effort. unit: of path lengths."""
    dims = ("stretched_alpha_1", "stretched_alpha_2")
    shapes = stretch.field
    rms = "rms of the relative errors of lengths on paper"
    folded = "share of cells that are turned over"
    return [
        *(Variable(name, (name,), x, "rad") for name, x in zip(dims, shapes.axes)),
        Variable(
            "stretched_shape",
            ("axis", *dims),
            shapes.values,
            unit,
            "place of a shape where equal lengths take equal effort",
        ),
        Variable("stretch_distortion", dims, stretch.distortion, "1", rms),
        Variable("stretch_rms", (), stretch.rms, "1", f"{rms}, of all"),
        Variable("stretch_largest", (), stretch.largest, "1", "largest of them"),
        Variable("stretch_folded", (), stretch.folded, "1", folded),
        Variable("stretch_interpolation", (), shapes.degree, "1", "degree of splines"),
    ]


def angles_of(axes) -> tuple[str, ...]:
    """Return the names of the axes of shape space."""
    return tuple(f"alpha_{k + 1}" for k in range(len(axes)))


def coordinates(
    axes: Sequence[np.ndarray], labels: Sequence[tuple[str, str]]
) -> list[Variable]:
    """Return components, joints and the axes of shape space; labels: (name, unit) of each shape variable, alpha_k for an
    angle between links."""
    variables = [
        Variable("component", ("component",), np.array(COMPONENTS)),
        Variable("joint", ("joint",), np.arange(1, len(axes) + 1, dtype="i4")),
    ]
    for k, (name, axis, (label, unit)) in enumerate(zip(angles_of(axes), axes, labels)):
        joint = f"angle of joint {k + 1}, heading of link {k + 2} minus link {k + 1}"
        variables.append(
            Variable(
                name, (name,), axis, unit, joint if label == name else f"{SHAPE}{label}"
            )
        )
    return variables


def of_fitted(fitted: Connection, shapes: Sequence[str] = ()) -> Result:
    """Return A, its fit residual and the rms of xi. shapes: names of the shape variables, where these are no joint angles."""
    sized = (
        {}
        if fitted.length is None
        else {
            "body_length": float(fitted.length),
            "length_unit": fitted.unit,
        }
    )
    variables = (
        *coordinates(fitted.axes, _labels(fitted.axes, shapes)),
        *of_connection(fitted),
    )
    return Result("connection", variables, {"sign_of_A": "xi = + A alphadot", **sized})


def of_field(values: Field, name: str, shapes: Sequence[str] = ()) -> Result:
    """Return a field; with rows x, y and theta it is a CCF, in its units."""
    lead = values.values.shape[: -values.joints]
    dims = (*(f"dimension_{k}" for k in range(len(lead))), *angles_of(values.axes))
    field = (
        of_ccf(values, name=name)
        if lead == (3,)
        else Variable(name, dims, values.values)
    )
    return Result(
        "field",
        (*coordinates(values.axes, _labels(values.axes, shapes)), field),
        {},
    )


def _labels(axes, names: Sequence[str]) -> list[tuple[str, str]]:
    return [(name, "rad") for name in names or angles_of(axes)]


def recorded(system: System) -> dict:
    """Return the system's own attributes for files of its connection."""
    recorded = capability(system, Recorded)
    return {} if recorded is None else dict(recorded.about())


def _body(system: System) -> Any:
    """Return the body of a system, or of the table that it is; None without one."""
    inner = system.inner if isinstance(system, Framed) else system
    return getattr(getattr(inner, "stored", inner), "body", None)


def about(scene: Scene) -> dict:
    """Return the conventions of a connection as attributes of a file: frame, length, forces and signs."""
    system = scene.system
    meanings = {
        "mean": "centre of mass, length-weighted mean heading",
        UNKNOWN_FRAME: "not told by its file",
    }
    meanings["minimum-perturbation"] = (
        "the one in which the squares of A, integrated over the grid, are least"
    )
    meanings["that of the log"] = "the one whose x, y and heading were logged"
    meaning = meanings.get(scene.frame, "centre and heading of that link, 1 the tail")
    return {
        "Conventions": "xi = + A alphadot; CCF = dA + [A, A], positive for counter-clockwise loops",
        "frame": scene.frame,
        "frame_meaning": f"body frame: {meaning}",
        "body_length": float(body_size(system)),
        "length_unit": length_unit(system),
        **recorded(system),
        **({"body": text} if (text := body_text(_body(system))) else {}),
        "components": "x, y, theta of the body velocity xi: forward (tail to head), to the left, counter-clockwise",
        "sign_of_A": "xi = + A alphadot",
        "sign_of_ccf": "CCF = dA + [A, A] with [X, Y] = XY - YX, positive for counter-clockwise loops",
        "pair_of_ccf": "CCF_12 = dA_2 / dalpha_1 - dA_1 / dalpha_2 + [A_1, A_2]",
    }
