"""Motion of a scene: the pose of its body at every phase of its gait, cycle after
cycle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.mathematics.geometry.reconstruct import poses, repeated
from geomech.mathematics.geometry.symmetry import zero_components
from geomech.mathematics.systems.base import (
    Cycle,
    body_size,
    length_unit,
    shape_labels,
)
from geomech.mathematics.systems.capabilities import (
    Compliant,
    Drawable,
    PartlyLifted,
    Stepped,
    balance_size,
    capability,
    settling,
)
from geomech.mathematics.tiers.path import PATH
from geomech.runs.cost import Cost
from geomech.scenes.model import Scene
from geomech.studies.displacement.variables import COMPONENTS, POSE, zero_reason
from geomech.studies.estimates.cost import (
    connection_jobs,
    direct_jobs,
    n_cycles,
    total_cost,
)
from geomech.studies.maps import fields
from geomech.studies.mechanics.outcome import can_roll, outcome, slope_of, uphill
from geomech.studies.realised import commanded, limit_cycles
from geomech.studies.scene_tables import SceneTables
from rft.core.checks import is_whole
from rft.core.premise import SHAPE_ALONE, Premise
from rft.core.refusal import Refusal, located
from rft.effects.springs import joint_rows
from rft.motion.compliance import SpringMotion

MOST_CYCLES = 10_000
# s to compute and write a number of a table; some two times the measured time.
SECONDS_PER_NUMBER = 2e-6
COPIES = 4  # of a table, of its numbers or its poses, in memory at a time
OVER = ("phase",)
GRID = ("component", "shape_1", "shape_2")  # dimensions of the CCF beside a motion
FINAL = tuple(f"final_{name}" for name in POSE)
TORQUE = "axial drag x body length"  # unit of torques and energies of springs
POWER = "axial drag x body length/rad"


@dataclass(frozen=True, eq=False)
class Motion:
    """Poses and shapes, phase after phase, with the end of the last cycle as the last
    row.

    phase: (P,), rad, growing from cycle to cycle. alpha: (P, joints). pose: (P, 3), of
    the body frame in the frame at phase 0, on the ground, in the scene's unit and rad.
    frequency: of the gait, Hz, or None. springs: what joints that give way do in one
    cycle (`rft.motion.compliance.SpringMotion`), or None; alpha is then the shape that
    the body really takes, and command (P, joints) that of the gait. contact: what
    touches at every phase (`rft.contacts.ContactState`), or None for all of the
    body."""

    scene: Scene
    phase: np.ndarray
    alpha: np.ndarray
    pose: np.ndarray
    frequency: float | None
    command: np.ndarray | None = None
    springs: SpringMotion | None = None
    contact: Any = None

    @property
    def cycles(self) -> int:
        return round(self.phase[-1] / (2 * np.pi))

    @property
    def time(self) -> np.ndarray | None:
        """Times (P,), s, where the gait has a frequency."""
        if self.frequency is None:
            return None
        return self.phase / (2 * np.pi * self.frequency)

    def points(self, rows: Any = slice(None)) -> np.ndarray | None:
        """Return ends of the links in the world (..., links + 1, 2), tail to head, at
        some of the rows; None for a system without a body to draw."""
        body = capability(self.scene.system, Drawable)
        if body is None:
            return None
        return body.points(self.alpha[rows], self.pose[rows])

    def leg_points(self, rows: Any = slice(None)) -> np.ndarray | None:
        """Return shoulders and feet in the world (..., legs, 2, 2) at some of the rows;
        None for a body without legs."""
        body: Any = capability(self.scene.system, Drawable)
        if not hasattr(body, "leg_points"):
            return None
        return body.leg_points(self.alpha[rows], self.pose[rows])


def is_mapped(scene: Scene) -> bool:
    """Return whether the shapes of a scene are seen on a map of its CCF."""
    return scene.system.joints == 2 and PATH.is_offered(scene.system)


def answer(
    tables: SceneTables, cycles: int, mapped: bool, progress: Any = None
) -> Result:
    """Return the motion of a scene over cycles of its gait, as a result.

    mapped: with the CCF, on which a picture shows the shapes, for a scene that has
    one."""
    scene = tables.scene
    motion = compute_motion(scene, cycles)
    found = variables(motion)
    if motion.springs is not None and settling(scene.system) > 0:
        found += limit_cycle_variables(scene)
    facts = attributes(motion)
    if mapped and is_mapped(scene):
        tables.compute_field(progress)
        found += ccf_variables(tables)
        facts["interpolation"] = tables.curvature.degree
    return Result("trajectory", tuple(found), facts)


def attributes(motion: Motion) -> dict[str, Any]:
    """Return facts about a motion."""
    scene = motion.scene
    facts: dict[str, Any] = {
        "frame": scene.frame,
        "cycles": motion.cycles,
        "body_length": float(body_size(scene.system)),
    }
    if motion.frequency is not None:
        facts["frequency"] = float(motion.frequency)
    slope = slope_of(scene.system)
    if slope is not None:
        margin = np.inf
        lifted = capability(scene.system, PartlyLifted)
        if lifted is not None and can_roll(lifted):
            margin = motion.contact.margin.min()
        climbed = uphill(slope, *motion.pose[-1, :2])
        facts["outcome"] = str(outcome(climbed, margin))
    return facts


def variables(motion: Motion) -> list[Variable]:
    """Return the final pose, and time, pose, shape and ends of all links at every
    phase, and what touches the ground where that is not all of the body."""
    scene = motion.scene
    system = scene.system
    unit = length_unit(system)
    phase = Variable(
        "phase", OVER, motion.phase, "rad", "phase of the gait, 2 pi per cycle"
    )
    found = [*final_pose(motion), phase]
    if motion.time is not None:
        found.append(Variable("time", OVER, motion.time, "s", "time since phase 0"))

    label = f"pose of the frame {scene.frame}, relative to its pose at phase 0"
    for name, values, pose_unit in zip(POSE, motion.pose.T, (unit, unit, "rad")):
        found.append(Variable(name, OVER, values, pose_unit, label))

    names = fields.angle_names(motion.alpha.T)
    shapes = zip(names, motion.alpha.T, shape_labels(system))
    for k, (name, values, (label, shape_unit)) in enumerate(shapes):
        if label == name:
            label = fields.joint_label(k)
        if motion.springs is not None:
            label = f"{label}, as it really is"
        found.append(Variable(name, OVER, values, shape_unit, label))
    if motion.springs is not None and motion.command is not None:
        found += spring_variables(motion, motion.springs, motion.command)
    if motion.contact is not None:
        legs = motion.leg_points()
        found += contact_variables(motion.contact, "link" if legs is None else "leg")
        found += foot_variables(legs, unit)
        lifted = capability(system, PartlyLifted)
        if lifted is not None and can_roll(lifted):
            label = "distance of the centre of mass inside what touches, < 0 outside"
            margin = body_size(system) * motion.contact.margin
            found.append(Variable("support_margin", OVER, margin, unit, label))
    return found + end_variables(motion.points(), unit)


def spring_variables(
    motion: Motion, springs: SpringMotion, command: np.ndarray
) -> list[Variable]:
    """Return the command, and the torques, power and energy of joints that give way, at
    every phase, and the work of all actuators in a cycle."""
    system = motion.scene.system
    found = []
    names = fields.angle_names(command.T)
    for k, (name, values) in enumerate(zip(names, command.T)):
        _, unit = shape_labels(system)[k]
        label = f"command of {fields.joint_label(k)}"
        found.append(Variable(f"command_{name}", OVER, values, unit, label))
    phases = len(springs.stored)
    rows = np.arange(len(motion.phase)) % phases
    entries = (
        ("torque", springs.torque, TORQUE, "torque of spring and damper on"),
        ("actuator_torque", springs.actuator, TORQUE, "torque of the actuator of"),
        ("actuator_power", springs.actuator_power, POWER, "actuator's power at"),
    )
    for k in range(springs.torque.shape[1]):
        where = f"joint {k + 1}"
        for name, values, unit, label in entries:
            if np.isnan(values[:, k]).all():
                continue
            found.append(
                Variable(
                    f"{name}_{k + 1}",
                    OVER,
                    values[rows, k],
                    unit,
                    f"{label} {where}",
                )
            )
    stored = springs.stored[rows]
    found.append(Variable("stored", OVER, stored, TORQUE, "energy in all springs"))
    work = springs.actuator_power.sum(-1).mean() * 2 * np.pi
    if not np.isnan(work):
        label = "work of all actuators, per cycle"
        found.append(Variable("actuator_work", (), work, TORQUE, label))
    label = "steps whose balance certainly has more solutions than the one taken"
    count = float(springs.several)
    found.append(Variable("ambiguous_steps", (), count, "1", label))
    return found


def contact_variables(state: Any, part: str) -> list[Variable]:
    """Return the weight of contact and the load of every link, or leg, at every
    phase."""
    found = []
    for k, (weight, load) in enumerate(zip(state.weight.T, state.load.T), 1):
        label = f"contact of {part} {k}, 0 lifted, 1 on the ground"
        found.append(Variable(f"contact_{k}", OVER, weight, "1", label))
        label = f"load on {part} {k}, over the mean of all"
        found.append(Variable(f"load_{k}", OVER, load, "1", label))
    return found


def foot_variables(legs: np.ndarray | None, unit: str) -> list[Variable]:
    """Return the places of the feet from shoulders and feet (P, legs, 2, 2), a variable
    for each coordinate; none without legs."""
    found: list[Variable] = []
    if legs is None:
        return found
    for k in range(legs.shape[1]):
        for axis, values in zip("xy", legs[:, k, 1].T):
            label = f"{axis} of the foot of leg {k + 1}, left and right of each pair"
            found.append(Variable(f"foot_{k + 1}_{axis}", OVER, values, unit, label))
    return found


def limit_cycle_variables(scene: Scene) -> list[Variable]:
    """Return the displacements of the different cycles that joints which give way
    settle into from four starts, and the number of starts that reach none."""
    with located(scene.name):
        found = limit_cycles(scene.system, scene.gait, scene.numerics.phases)
    dims = ("limit_cycle",)
    unit = length_unit(scene.system)
    count = np.arange(1.0, len(found.nets) + 1)
    label = "different cycles reached from four starts, that of the motion first"
    variables = [Variable("limit_cycle", dims, count, "1", label)]
    for name, values, of_pose in zip(POSE, found.nets.T, (unit, unit, "rad")):
        label = "displacement in each of the different cycles"
        variables.append(Variable(f"cycle_{name}", dims, values, of_pose, label))
    label = "starts of four from which no cycle is reached"
    variables.append(Variable("unsettled_starts", (), found.unsettled, "1", label))
    return variables


def final_pose(motion: Motion) -> list[Variable]:
    """Return the pose after the last cycle, with the reason where a symmetry makes a
    component zero."""
    system = motion.scene.system
    reasons = zero_components(system.traits, motion.scene.gait)
    if "heading" not in reasons and motion.cycles > 1:
        # Where the body turns, x and y of one cycle are not those of all.
        reasons = {}
    unit = length_unit(system)
    found = []
    for name, value, pose_unit in zip(POSE, motion.pose[-1], (unit, unit, "rad")):
        zero = ""
        if name in reasons:
            zero = zero_reason(reasons[name])
        label = "after the last cycle"
        found.append(Variable(f"final_{name}", (), value, pose_unit, label, zero=zero))
    slope = slope_of(system)
    if slope is not None:
        climbed = uphill(slope, *motion.pose[-1, :2])
        label = "after the last cycle, along the slope"
        found.append(Variable("final_uphill", (), climbed, unit, label))
    return found


def end_variables(points: np.ndarray | None, unit: str) -> list[Variable]:
    """Return the ends of links (P, links + 1, 2), a variable for each coordinate; none
    without a body to draw."""
    if points is None:
        return []
    found = []
    for k in range(points.shape[1]):
        for axis, values in zip("xy", points[:, k].T):
            label = f"{axis} of end {k} of the links, 0 the tail"
            found.append(Variable(f"end_{k}_{axis}", OVER, values, unit, label))
    return found


def ccf_variables(tables: SceneTables) -> list[Variable]:
    """Return the CCF with its error. Its axes have names of their own, as the shapes of
    a motion depend on the phase."""
    ccf = fields.ccf_variable(tables.curvature, tables.curvature_error)
    labels = shape_labels(tables.scene.system)
    found = [Variable("component", ("component",), [*COMPONENTS])]
    for name, axis, (label, unit) in zip(GRID[1:], tables.curvature.axes, labels):
        found.append(Variable(name, (name,), axis, unit, f"{label} on the map"))
    found += fields.period_variables(GRID[1:], tables.curvature.periods)
    return [*found, replace(ccf, dims=GRID)]


def compute_motion(scene: Scene, cycles: int = 1) -> Motion:
    """Return the motion over cycles of the scene's gait at its own phases, by the
    direct tier.

    Where cycles are run until they repeat, the limit cycle is returned; where the place
    of the body matters, each cycle continues the one before."""
    if not isinstance(scene, Scene):
        raise Refusal("a motion needs a Scene", value=scene)
    refuse_cycles(cycles)
    gait = scene.gait
    phases = scene.numerics.phases
    with located(scene.name):
        alpha, alphadot = gait.cycle(phases)
        stepped = capability(scene.system, Stepped)
        if scene.system.traits.compliant:
            return _compliant_motion(scene, alpha, alphadot, int(cycles))
        if stepped is None:
            xi = scene.system.run(alpha, alphadot).xi
            pose = repeated(poses(xi), int(cycles))
        else:
            pose = stepped.path(alpha, alphadot, int(cycles))
    rows = np.arange(len(pose))
    shapes = alpha[rows % phases]
    contact = None
    lifted = capability(scene.system, PartlyLifted)
    if lifted is not None:
        contact = lifted.contact_state(shapes, pose[:, 2])
    phase = 2 * np.pi * rows / phases
    frequency = frequency_of(scene)
    return Motion(scene, phase, shapes, pose, frequency, contact=contact)


def _compliant_motion(
    scene: Scene, alpha: np.ndarray, alphadot: np.ndarray, cycles: int
) -> Motion:
    """Return the motion of a body with springs over cycles of its limit cycle; one
    cycle where its place matters, as the shape then differs from cycle to cycle."""
    cycle = scene.system.run(alpha, alphadot)
    stepped = capability(scene.system, Stepped)
    if stepped is not None and scene.system.traits.lacks & Premise.SE2_SYMMETRIC:
        if cycles > 1:
            raise Refusal(
                "with springs and an effect that depends on place no two cycles are "
                "alike",
                instead="request one cycle",
            )
        pose = stepped.path(alpha, alphadot, 1)
    else:
        pose = repeated(poses(cycle.xi), cycles)
    rows = np.arange(len(pose))
    phases = scene.numerics.phases
    return Motion(
        scene,
        2 * np.pi * rows / phases,
        cycle.springs.alpha[rows % phases],
        pose,
        frequency_of(scene),
        commanded(scene.system, alpha)[rows % phases],
        _with_prescribed_joints(scene, cycle),
    )


def _with_prescribed_joints(scene: Scene, cycle: Cycle) -> SpringMotion:
    """Return what joints do in a cycle with the torque and the power of the actuators
    of prescribed joints: internal moments of the body. They stay nan with effects that
    depend on place, past or mass."""
    springs = cycle.springs
    is_rigid = np.isnan(springs.actuator).all(0)
    compliant = capability(scene.system, Compliant)
    depends_on_more = bool(scene.system.traits.lacks & SHAPE_ALONE)
    if compliant is None or depends_on_more or not is_rigid.any():
        return springs
    system: Any = compliant.prescribed
    work = system.work(springs.alpha, springs.alphadot, cycle.xi)
    moment = work.bending_moment / system.axial_drag
    rate = springs.alphadot @ joint_rows(system.body).T
    return springs._replace(
        actuator=np.where(is_rigid, moment, springs.actuator),
        actuator_power=np.where(is_rigid, moment * rate, springs.actuator_power),
    )


def frequency_of(scene: Scene) -> float | None:
    """Return the frequency of a scene's gait, Hz, where it has one."""
    return getattr(scene.gait, "frequency", None)


def refuse_cycles(cycles: int) -> None:
    """Refuse a number of cycles that makes no sense."""
    if not (is_whole(cycles) and 1 <= cycles <= MOST_CYCLES):
        raise Refusal(
            f"``cycles`` must be a whole number from 1 to {MOST_CYCLES}", value=cycles
        )


def cost(scene: Scene, cycles: int = 1, mapped: bool = False) -> Cost:
    """Return the cost of `answer` and a table of it."""
    parts = [cost_of_table(scene, cycles)]
    if mapped and is_mapped(scene):
        parts.append(total_cost(connection_jobs(scene)))
    return summed(parts)


def summed(parts: Sequence[Cost]) -> Cost:
    """Return the cost of parts, one after the other."""
    return Cost(
        balances=sum(part.balances for part in parts),
        seconds=sum(part.seconds for part in parts),
        memory=max(part.memory for part in parts),
        besides=sum(part.besides for part in parts),
        numpy_seconds=sum(part.numpy_seconds for part in parts),
    )


def cost_of_table(scene: Scene, cycles: int) -> Cost:
    """Return the cost of `compute_motion` and a table of it."""
    refuse_cycles(cycles)
    system = scene.system
    phases = scene.numerics.phases
    jobs = direct_jobs(scene, scene.gait, 1, phases, with_error=False)
    if system.traits.steps and not settling(system):
        # Each continues the one before; cycles up to the limit cycle are run first.
        assumed = n_cycles(system)
        first_cycles = assumed
        if system.traits.lacks & Premise.SE2_SYMMETRIC:
            first_cycles = 0
        times = (first_cycles + assumed - 1 + cycles) / assumed
        jobs = [
            job._replace(count=job.count * times, batches=job.batches * times)
            for job in jobs
        ]
    total, rows = total_cost(jobs), cycles * phases + 1
    width = 2 * (balance_size(system).elements + 1) + system.joints + 5
    memory = 8 * COPIES * rows * (system.joints + 5 + width)
    seconds = SECONDS_PER_NUMBER * rows * width
    return total._replace(
        seconds=total.seconds + seconds,
        memory=total.memory + memory,
        besides=total.besides + seconds,
    )
