"""The best gait of a search as variables of a result."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from geomech.core.variables import POSE, Variable
from geomech.mathematics.geometry.symmetry import zero_components
from geomech.mathematics.systems.base import body_size, length_unit, shape_labels
from geomech.scenes.model import Scene
from geomech.scenes.write import toml
from geomech.studies.displacement.variables import COMPONENTS, zero_reason
from geomech.studies.estimates.effort import units, why_no_metric
from geomech.studies.maps import fields
from geomech.studies.optimisation.limiting import PHASES, limiting
from geomech.studies.optimisation.optimum import Optimum
from rft.core.refusal import Refusal

# How far local optima were searched.
HOW = ("refined", "from a table only")


def attributes(optimum: Optimum) -> dict[str, Any]:
    """Return the objective with its limits, and the scene with the best gait as
    text."""
    objective = optimum.request.objective
    facts: dict[str, Any] = {
        "objective": objective.name,
        "starts": optimum.request.starts,
        "body_length": float(body_size(optimum.scene.system)),
    }
    with contextlib.suppress(Refusal):  # parts of Python alone have no text
        facts["best_scene_toml"] = toml(optimum.scene)
    if objective.direction:
        facts["direction"] = objective.direction
    if objective.rate:
        facts["largest_rate"] = float(objective.rate)
    if objective.power:
        facts["largest_power"] = float(objective.power)
    return facts


def variables(optimum: Optimum) -> list[Variable]:
    """Return the value of the best gait, its displacement and effort, the local optima
    that the starts led to, the limits that the best touches, and the search's cost.

    The value of a distance is over the body's length, the displacement is not."""
    return [
        *values(optimum),
        *displacement(optimum),
        *answers(optimum),
        *limits(optimum),
        Variable(
            "evaluations", (), optimum.evaluations, "1", "number of cycles evaluated"
        ),
        Variable("seconds", (), optimum.seconds, "s", "computing time"),
    ]


def values(optimum: Optimum) -> list[Variable]:
    """Return the values of the best gait and of the scene's own."""
    objective = optimum.request.objective
    unit = objective.unit
    if objective.name == "efficiency":
        unit = units(optimum.scene.system)["efficiency"]
    best = optimum.best
    start = optimum.start
    own = f"{objective.name} of the scene's gait"
    return [
        Variable("value", (), best.value, unit, objective.name, best.error),
        Variable("start_value", (), start.value, unit, own, start.error),
    ]


def displacement(optimum: Optimum) -> list[Variable]:
    """Return the pose after a cycle with its errors, path length and work where they
    are known, and the frequency of a gait that is timed."""
    system = optimum.scene.system
    best = optimum.best
    length = length_unit(system)
    reasons = zero_components(system.traits, optimum.gait)
    pose_units = (length, length, "rad")
    found = []
    for name, value, error, unit in zip(
        POSE, best.displacement, best.displacement_error, pose_units
    ):
        zero = ""
        if name in reasons:
            zero = zero_reason(reasons[name])
        label = "net displacement per cycle"
        found.append(Variable(name, (), value, unit, label, error, zero=zero))

    effort_units = units(system)
    for name, value in (("path_length", best.length), ("work", best.work)):
        if value is not None:
            unit = effort_units.get(name, "")
            found.append(Variable(name, (), value, unit, "per cycle"))
    if optimum.request.objective.timed:
        frequency = optimum.gait.frequency
        found.append(
            Variable("frequency", (), frequency, "Hz", "frequency of the best gait")
        )
    return found


def answers(optimum: Optimum) -> list[Variable]:
    """Return the local optima that the starts led to, best first."""
    found = []
    for how, optima in zip(HOW, (optimum.answers, optimum.others)):
        found += [(value, starts, how) for value, starts in optima]
    if not found:
        return []
    values, starts, how = zip(*found)
    dims = ("answer",)
    unit = optimum.request.objective.unit
    numbers = np.arange(1, len(found) + 1)
    return [
        Variable("answer", dims, numbers, "", "local optima, best first"),
        Variable("answer_value", dims, values, unit, "value of a local optimum"),
        Variable("answer_starts", dims, starts, "1", "number of starts that led there"),
        Variable("answer_how", dims, [*how], "", "how closely it was searched"),
    ]


def limits(optimum: Optimum) -> list[Variable]:
    """Return the limits that the best gait touches; none without any."""
    if not optimum.active:
        return []
    return [Variable("limit_touched", ("limit",), [*optimum.active])]


def loop(optimum: Optimum) -> list[Variable]:
    """Return the best loop and the start, phase by phase, what limits the best there,
    and the joint limits, where it was searched within any."""
    phase = np.linspace(0, 2 * np.pi, PHASES)
    joints = np.arange(1, optimum.gait.joints + 1)
    dims = ("phase", "joint")
    best = optimum.gait.shape(phase)
    start = optimum.start.gait.shape(phase)
    found = [
        Variable("phase", ("phase",), phase, "rad", "phase of the gait"),
        Variable("joint", ("joint",), joints),
        Variable("loop", dims, best, "rad", "best gait"),
        Variable("start_loop", dims, start, "rad", "the scene's gait"),
        Variable(
            "limited_by", ("phase",), limiting(optimum), "", "limit reached there"
        ),
    ]
    box = getattr(optimum.request.loops, "box", None)
    if box is not None and np.isfinite(box).all():
        box = np.broadcast_to(box, (2, optimum.gait.joints))
        label = "lowest and highest angles"
        found.append(Variable("joint_limits", ("end", "joint"), box, "rad", label))
    return found


def gained(optimum: Optimum) -> tuple[list[Variable], Mapping[str, Any]]:
    """Return the CCF whose area the best gait gains, over two joints, and as attributes
    its component and frame; nothing where there is none."""
    if optimum.gained is None:
        return [], {}
    field, component = optimum.gained
    frame = "minimum-perturbation"
    if field.masked:
        frame = optimum.scene.frame
    labels = shape_labels(optimum.scene.system)
    _, _, *axes = fields.coordinates(field.axes, labels)
    coordinate = Variable("component", ("component",), [*COMPONENTS])
    facts = {
        "gained_component": COMPONENTS[component],
        "gained_frame": frame,
        "interpolation": field.degree,
    }
    return [coordinate, *axes, fields.ccf_variable(field, name="gained_ccf")], facts


def check_stretch(scene: Scene) -> None:
    """Refuse a scene whose shape space cannot be redrawn to equal effort."""
    joints = scene.system.joints
    if joints != 2:
        raise Refusal(
            f"``stretch`` needs two joints, this body has {joints}",
            where=scene.name,
            instead="remove it",
        )
    reason = why_no_metric(scene.system)
    if reason:
        raise Refusal(reason, where=scene.name, instead="remove ``stretch``")
