"""Motion of a scene: the pose of its body at every phase of its gait, cycle after cycle."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.geometry.field import Field
from geomech.geometry.reconstruct import poses, repeated
from geomech.run.cost import Cost
from geomech.scenes.model import Scene
from geomech.studies.cost import connection, cycles_of, direct, price
from geomech.studies.question import Allow, Progress, Question
from geomech.studies.study import Study
from geomech.systems.base import length_unit, shape_labels
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
WORDS = (
    2e-6  # s to compute and write a number of a table; some two times the measured time
)
ROWS_TOGETHER = 1 << 20  # numbers of a table in memory at a time


@dataclass(frozen=True, eq=False)
class Motion:
    """Poses and shapes, phase after phase, with the end of the last cycle as the last row.

    phase: (P,), rad, growing from cycle to cycle. alpha: (P, joints). pose: (P, 3), of the body frame in the frame at
    phase 0, on the ground, in the scene's unit and rad. frequency: of the gait, Hz, or None."""

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
        return (
            None
            if self.frequency is None
            else self.phase / (2 * np.pi * self.frequency)
        )

    def points(self, rows=slice(None)) -> np.ndarray | None:
        """Return ends of the links in the world, (..., links + 1, 2), tail to head, at some of the rows; None for a
        system without a body to draw."""
        body = capability(self.scene.system, Drawable)
        return None if body is None else body.points(self.alpha[rows], self.pose[rows])

    @property
    def columns(self) -> dict[str, str]:
        """Unit of each column of a table, by name."""
        system = self.scene.system
        unit, ends = length_unit(system), self.points(slice(0, 1))
        timed = {} if self.frequency is None else {"time": "s"}
        place = {"phase": "rad", **timed, "x": unit, "y": unit, "theta": "rad"}
        shape = {
            f"alpha_{k + 1}": unit_of
            for k, (_, unit_of) in enumerate(shape_labels(system))
        }
        count = 0 if ends is None else ends.shape[-2]
        return {
            **place,
            **shape,
            **{f"end_{k}_{axis}": unit for k in range(count) for axis in "xy"},
        }

    def tables(self) -> Iterator[np.ndarray]:
        """Yield the rows of a table, (some, columns) at a time."""
        size = max(1, ROWS_TOGETHER // len(self.columns))
        for start in range(0, len(self.phase), size):
            rows = slice(start, start + size)
            timed = [] if self.time is None else [self.time[rows, None]]
            parts, ends = (
                [self.phase[rows, None], *timed, self.pose[rows], self.alpha[rows]],
                self.points(rows),
            )
            yield np.concatenate(
                parts + ([] if ends is None else [ends.reshape(len(ends), -1)]), 1
            )


class Drawn(NamedTuple):
    """A motion, and the CCF of its scene with its error where that is drawn beside it."""

    motion: Motion
    ccf: Field | None = None
    ccf_error: Field | None = None


@dataclass(frozen=True)
class Trajectory(Question):
    """Pose of the body at every phase of the scene's gait. drawn: whether beside the CCF, where that is a map. drawing: cost
    of drawing a film."""

    scene: Scene
    cycles: int = 1
    drawn: bool = False
    drawing: Cost | None = None

    @property
    def title(self) -> str:
        return f"motion of {self.scene.name}"

    @cached_property
    def study(self) -> Study:
        return Study(self.scene)

    @property
    def _mapped(self) -> bool:
        return (
            self.drawn
            and self.scene.system.joints == 2
            and PATH.is_offered(self.scene.system)
        )

    def cost(self) -> Cost:
        costs = [
            cost(self.scene, self.cycles),
            *([price(connection(self.scene))] if self._mapped else []),
        ]
        costs += [self.drawing] if self.drawing else []
        balances, seconds, memory, besides, steps = zip(*costs)
        return Cost(sum(balances), sum(seconds), max(memory), sum(besides), sum(steps))

    def answer(self, progress: Progress, allow: Allow) -> Result:
        moved = motion(self.scene, self.cycles)
        if self._mapped:
            self.study.compute_field()
        maps = (
            (self.study.curvature, self.study.curvature_error) if self._mapped else ()
        )
        return _result(Drawn(moved, *maps))


def _result(drawn: Drawn) -> Result:
    """Return pose and shape by phase; the ends of the links, which are many, are in the subject."""
    motion, dims = drawn.motion, ("phase",)
    times = {} if motion.time is None else {"time": motion.time}
    arrays = {
        "phase": motion.phase,
        **times,
        **dict(zip(("x", "y", "theta"), motion.pose.T)),
    }
    arrays |= {f"alpha_{k + 1}": x for k, x in enumerate(motion.alpha.T)}
    return Result(
        "motion",
        tuple(Variable(n, dims, x, motion.columns[n]) for n, x in arrays.items()),
        {},
        drawn,
    )


def motion(scene: Scene, cycles: int = 1) -> Motion:
    """Return so many cycles of the scene's gait at its own phases, by the direct tier.

    Where cycles are run until they repeat, the limit cycle is returned; where the place of the body matters, each cycle
    continues the one before."""
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
    return Motion(
        scene,
        phase,
        alpha[np.arange(len(pose)) % phases],
        pose,
        getattr(gait, "frequency", None),
    )


def checked(cycles: int) -> None:
    """Refuse a number of cycles that makes no sense."""
    if not (is_whole(cycles) and 1 <= cycles <= MOST_CYCLES):
        raise Refusal(
            f"``cycles`` must be a whole number from 1 to {MOST_CYCLES}", value=cycles
        )


def cost(scene: Scene, cycles: int = 1) -> Cost:
    """Return the cost of `motion` and a table of it."""
    checked(cycles)
    system, phases = scene.system, scene.numerics.phases
    jobs = direct(scene, scene.gait, 1, phases, checked=False)
    if system.traits.steps and not settling(system):
        # Each continues the one before; cycles up to the limit cycle are run first.
        first_cycles = (
            0 if system.traits.lacks & Premise.SE2_SYMMETRIC else cycles_of(system)
        )
        times = (first_cycles + cycles_of(system) - 1 + cycles) / cycles_of(system)
        jobs = [
            job._replace(count=job.count * times, batches=job.batches * times)
            for job in jobs
        ]
    total, rows = price(jobs), cycles * phases + 1
    width = 2 * (balance_size(system).elements + 1) + system.joints + 5
    memory = 8 * (
        4 * rows * (system.joints + 5) + 4 * min(rows * width, ROWS_TOGETHER + width)
    )
    words = WORDS * rows * width
    return total._replace(
        seconds=total.seconds + words,
        memory=total.memory + memory,
        besides=total.besides + words,
    )
