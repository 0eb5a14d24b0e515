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
from geomech.mathematics.systems.base import body_size, length_unit, shape_labels
from geomech.mathematics.systems.capabilities import (
    Drawable,
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
from geomech.studies.scene_tables import SceneTables
from rft.core.checks import is_whole
from rft.core.premise import Premise
from rft.core.refusal import Refusal, located

MOST_CYCLES = 10_000
# s to compute and write a number of a table; some two times the measured time.
SECONDS_PER_NUMBER = 2e-6
COPIES = 4  # of a table, of its numbers or its poses, in memory at a time
OVER = ("phase",)
GRID = ("component", "shape_1", "shape_2")  # dimensions of the CCF beside a motion
FINAL = tuple(f"final_{name}" for name in POSE)


@dataclass(frozen=True, eq=False)
class Motion:
    """Poses and shapes, phase after phase, with the end of the last cycle as the last
    row.

    phase: (P,), rad, growing from cycle to cycle. alpha: (P, joints). pose: (P, 3), of
    the body frame in the frame at phase 0, on the ground, in the scene's unit and rad.
    frequency: of the gait, Hz, or None."""

    scene: Scene
    phase: np.ndarray
    alpha: np.ndarray
    pose: np.ndarray
    frequency: float | None

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
    return facts


def variables(motion: Motion) -> list[Variable]:
    """Return the final pose, and time, pose, shape and ends of all links at every
    phase."""
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
        found.append(Variable(name, OVER, values, shape_unit, label))
    return found + end_variables(motion.points(), unit)


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
        if stepped is None:
            xi = scene.system.run(alpha, alphadot).xi
            pose = repeated(poses(xi), int(cycles))
        else:
            pose = stepped.path(alpha, alphadot, int(cycles))
    rows = np.arange(len(pose))
    phase = 2 * np.pi * rows / phases
    return Motion(scene, phase, alpha[rows % phases], pose, frequency_of(scene))


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
