"""Motion of a scene: the pose of its body at every phase of its gait, cycle after cycle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.geometry.reconstruct import poses, repeated
from geomech.geometry.symmetry import zero_components
from geomech.run.cost import Cost
from geomech.scenes.model import Scene
from geomech.studies import fields
from geomech.studies.cost import connection_jobs, direct_jobs, n_cycles, total_cost
from geomech.studies.scene_tables import SceneTables
from geomech.studies.tables import COMPONENTS, POSE, zero_reason
from geomech.systems.base import body_size, length_unit, shape_labels
from geomech.systems.capabilities import (
    Drawable,
    Stepped,
    balance_size,
    capability,
    settling,
)
from geomech.tiers.path import PATH
from rft.core.checks import is_whole
from rft.core.premise import Premise
from rft.core.refusal import Refusal, located

MOST_CYCLES = 10_000
# s to compute and write a number of a table; some two times the measured time.
WORDS = 2e-6
HELD = 4  # copies of a table, of its numbers or its poses, in memory at a time
OVER = ("phase",)
GRID = ("component", "shape_1", "shape_2")  # dimensions of the CCF beside a motion
FINAL = tuple(f"final_{name}" for name in POSE)


@dataclass(frozen=True, eq=False)
class Motion:
    """Poses and shapes, phase after phase, with the end of the last cycle as the last row.

    phase: (P,), rad, growing from cycle to cycle. alpha: (P, joints). pose: (P, 3), of the
    body frame in the frame at phase 0, on the ground, in the scene's unit and rad.
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
        """Return ends of the links in the world, (..., links + 1, 2), tail to head, at
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
    """Return so many cycles of a scene's motion as a result.

    mapped: with the CCF, on which a picture shows the shapes, of a scene that has one."""
    scene = tables.scene
    moved = motion(scene, cycles)
    found, facts = variables(moved), attributes(moved)
    if mapped and is_mapped(scene):
        tables.compute_field(progress)
        found += of_map(tables)
        facts["interpolation"] = tables.curvature.degree
    return Result("trajectory", tuple(found), facts)


def attributes(moved: Motion) -> dict[str, Any]:
    """Return facts about a motion."""
    scene = moved.scene
    facts: dict[str, Any] = {
        "frame": scene.frame,
        "cycles": moved.cycles,
        "body_length": float(body_size(scene.system)),
    }
    if moved.frequency is not None:
        facts["frequency"] = float(moved.frequency)
    return facts


def variables(moved: Motion) -> list[Variable]:
    """Return the final pose, and time, pose, shape and ends of all links at every
    phase."""
    system = moved.scene.system
    unit = length_unit(system)
    phase = Variable("phase", OVER, moved.phase, "rad", "of the gait, 2 pi a cycle")
    found = [*final_pose(moved), phase]
    if moved.time is not None:
        found.append(Variable("time", OVER, moved.time, "s", "from phase 0"))
    label = f"of the frame {moved.scene.frame}, seen from where it is at phase 0"
    for name, values, of in zip(POSE, moved.pose.T, (unit, unit, "rad")):
        found.append(Variable(name, OVER, values, of, label))
    shapes = zip(moved.alpha.T, shape_labels(system), fields.angles_of(moved.alpha.T))
    for k, (values, (label, of), name) in enumerate(shapes):
        if label == name:
            label = (
                f"angle of joint {k + 1}, heading of link {k + 2} minus link {k + 1}"
            )
        found.append(Variable(name, OVER, values, of, label))
    return found + ends(moved.points(), unit)


def final_pose(moved: Motion) -> list[Variable]:
    """Return the pose after the last cycle, with why it is zero where a symmetry makes it
    so."""
    system = moved.scene.system
    why = zero_components(system.traits, moved.scene.gait)
    if "heading" not in why and moved.cycles > 1:
        why = {}  # where the body turns, x and y of one cycle are not those of all
    unit, found = length_unit(system), []
    for name, value, of in zip(POSE, moved.pose[-1], (unit, unit, "rad")):
        zero = ""
        if name in why:
            zero = zero_reason(why[name])
        label = "after the last cycle"
        found.append(Variable(f"final_{name}", (), value, of, label, zero=zero))
    return found


def ends(points: np.ndarray | None, unit: str) -> list[Variable]:
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


def of_map(tables: SceneTables) -> list[Variable]:
    """Return the CCF with its error over axes of its own names, as the shapes of a motion
    are over phase."""
    ccf = fields.of_ccf(tables.curvature, tables.curvature_error)
    labels = shape_labels(tables.scene.system)
    found = [Variable("component", ("component",), [*COMPONENTS])]
    for name, axis, (label, of) in zip(GRID[1:], tables.curvature.axes, labels):
        found.append(Variable(name, (name,), axis, of, f"{label} on the map"))
    return [*found, replace(ccf, dims=GRID)]


def motion(scene: Scene, cycles: int = 1) -> Motion:
    """Return so many cycles of the scene's gait at its own phases, by the direct tier.

    Where cycles are run until they repeat, the limit cycle is returned; where the place of
    the body matters, each cycle continues the one before."""
    if not isinstance(scene, Scene):
        raise Refusal("a motion is that of a Scene", value=scene)
    checked(cycles)
    gait, phases = scene.gait, scene.numerics.phases
    with located(scene.name):
        alpha, alphadot = gait.cycle(phases)
        stepped = capability(scene.system, Stepped)
        if stepped is None:
            pose = repeated(poses(scene.system.run(alpha, alphadot).xi), int(cycles))
        else:
            pose = stepped.path(alpha, alphadot, int(cycles))
    phase = 2 * np.pi * np.arange(len(pose)) / phases
    again = alpha[np.arange(len(pose)) % phases]
    return Motion(scene, phase, again, pose, frequency_of(scene))


def frequency_of(scene: Scene) -> float | None:
    """Return the frequency of a scene's gait, Hz, where it has one."""
    return getattr(scene.gait, "frequency", None)


def checked(cycles: int) -> None:
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
    balances, seconds, memory, besides, steps = zip(*parts)
    return Cost(sum(balances), sum(seconds), max(memory), sum(besides), sum(steps))


def cost_of_table(scene: Scene, cycles: int) -> Cost:
    """Return the cost of `motion` and a table of it."""
    checked(cycles)
    system, phases = scene.system, scene.numerics.phases
    jobs = direct_jobs(scene, scene.gait, 1, phases, checked=False)
    if system.traits.steps and not settling(system):
        # Each continues the one before; cycles up to the limit cycle are run first.
        first_cycles = n_cycles(system)
        if system.traits.lacks & Premise.SE2_SYMMETRIC:
            first_cycles = 0
        times = (first_cycles + n_cycles(system) - 1 + cycles) / n_cycles(system)
        jobs = [
            job._replace(count=job.count * times, batches=job.batches * times)
            for job in jobs
        ]
    total, rows = total_cost(jobs), cycles * phases + 1
    width = 2 * (balance_size(system).elements + 1) + system.joints + 5
    memory = 8 * HELD * rows * (system.joints + 5 + width)
    words = WORDS * rows * width
    return total._replace(
        seconds=total.seconds + words,
        memory=total.memory + memory,
        besides=total.besides + words,
    )
