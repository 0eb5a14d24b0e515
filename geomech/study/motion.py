"""A scene in motion: where its body is at every phase of its gait, cycle after cycle."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.geometry.reconstruct import poses, repeated
from geomech.run.cost import Cost
from geomech.scene.model import Scene
from geomech.study.bench import Study
from geomech.study.cost import connection, cycles_of, direct, price
from geomech.study.question import Allow, Progress, Question
from geomech.systems.base import length_unit, shape_labels
from geomech.systems.capabilities import Drawable, Stepped, capability, costed, settling
from rft.checks import is_whole
from rft.premise import Premise
from rft.refusal import Refusal, located

MOST_CYCLES = 10_000
WORDS = 2e-6  # s a number of a table takes to be computed and written; some two times what it took
ROWS_TOGETHER = 1 << 20  # numbers of a table that are held at a time


@dataclass(frozen=True, eq=False)
class Motion:
    """Rows, phase after phase and the end besides: the last row is where the last cycle has led. phase: (P,), rad, growing
    from cycle to cycle. alpha: (P, joints). pose: (P, 3), of the body frame, seen from where it is at phase 0, on the
    ground, in the scene's unit and rad. frequency: of the gait, Hz, or None."""

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
        """(P,), s, where the gait has a frequency."""
        return None if self.frequency is None else self.phase / (2 * np.pi * self.frequency)

    def points(self, rows=slice(None)) -> np.ndarray | None:
        """Ends of the links in the world, (..., links + 1, 2), tail to head, at some of the rows; None for a system that
        has no body to show."""
        body = capability(self.scene.system, Drawable)
        return None if body is None else body.points(self.alpha[rows], self.pose[rows])

    @property
    def columns(self) -> dict[str, str]:
        """Of a table of it: what each is, by name, with its unit."""
        system = self.scene.system
        unit, ends = length_unit(system), self.points(slice(0, 1))
        timed = {} if self.frequency is None else {"time": "s"}
        place = {"phase": "rad", **timed, "x": unit, "y": unit, "theta": "rad"}
        shape = {f"alpha_{k + 1}": unit_of for k, (_, unit_of) in enumerate(shape_labels(system))}
        count = 0 if ends is None else ends.shape[-2]
        return {**place, **shape, **{f"end_{k}_{axis}": unit for k in range(count) for axis in "xy"}}

    def tables(self) -> Iterator[np.ndarray]:
        """The rows of a table of it, (some, columns) at a time."""
        size = max(1, ROWS_TOGETHER // len(self.columns))
        for start in range(0, len(self.phase), size):
            rows = slice(start, start + size)
            timed = [] if self.time is None else [self.time[rows, None]]
            parts, ends = [self.phase[rows, None], *timed, self.pose[rows], self.alpha[rows]], self.points(rows)
            yield np.concatenate(parts + ([] if ends is None else [ends.reshape(len(ends), -1)]), 1)


@dataclass(frozen=True)
class Trajectory(Question):
    """Where the body is at every phase of the scene's gait."""

    scene: Scene
    cycles: int = 1

    @property
    def title(self) -> str:
        return f"motion of {self.scene.name}"

    def cost(self) -> Cost:
        return cost(self.scene, self.cycles)

    def answer(self, progress: Progress, allow: Allow) -> Result:
        return of_motion(motion(self.scene, self.cycles))


def of_motion(found: Motion) -> Result:
    """Return pose and shape by phase; the ends of the links, which are many, are with the subject."""
    columns, dims = found.columns, ("phase",)
    times = {} if found.time is None else {"time": found.time}
    arrays = {"phase": found.phase, **times, **dict(zip(("x", "y", "theta"), found.pose.T))}
    arrays |= {f"alpha_{k + 1}": x for k, x in enumerate(found.alpha.T)}
    return Result("motion", tuple(Variable(n, dims, x, columns[n]) for n, x in arrays.items()), {}, found)


@dataclass(frozen=True)
class Picture(Question):
    """A motion beside the CCF of its scene, where that has a map: a strip of pictures, or a film of so many frames a cycle.

    drawing: what drawing the film costs."""

    scene: Scene
    cycles: int
    drawing: Cost | None = None

    title = Trajectory.title

    @cached_property
    def study(self) -> Study:
        return Study(self.scene)

    @property
    def _mapped(self) -> bool:
        return self.scene.system.joints == 2 and self.study.has_connection

    def cost(self) -> Cost:
        costs = [cost(self.scene, self.cycles), *([price(connection(self.scene))] if self._mapped else [])]
        costs += [self.drawing] if self.drawing else []
        balances, seconds, memory, besides, steps = zip(*costs)
        return Cost(sum(balances), sum(seconds), max(memory), sum(besides), sum(steps))

    def answer(self, progress: Progress, allow: Allow) -> Result:
        found = of_motion(motion(self.scene, self.cycles))
        if self._mapped:
            self.study.compute_field()
        maps = (self.study.curvature, self.study.curvature_error) if self._mapped else ()
        return replace(found, kind="film", subject=(found.subject, *maps))


def motion(scene: Scene, cycles: int = 1) -> Motion:
    """So many cycles of the scene's gait at its own phases, by the direct tier: a cycle ends where that says. Where cycles
    are run until they repeat it is the limit cycle, where place matters each goes on from the one before."""
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
    return Motion(scene, phase, alpha[np.arange(len(pose)) % phases], pose, getattr(gait, "frequency", None))


def checked(cycles: int) -> None:
    """Refusal unless so many cycles make sense."""
    if not (is_whole(cycles) and 1 <= cycles <= MOST_CYCLES):
        raise Refusal(f"--cycles must be a whole number from 1 to {MOST_CYCLES}", value=cycles)


def cost(scene: Scene, cycles: int = 1) -> Cost:
    """Of `motion` and a table of it."""
    checked(cycles)
    system, phases = scene.system, scene.numerics.phases
    jobs = direct(scene, scene.gait, 1, phases, checked=False)
    if system.traits.steps and not settling(system):
        # Each goes on from the one before; cycles that are alike are run first.
        alike = 0 if system.traits.lacks & Premise.SE2_SYMMETRIC else cycles_of(system)
        times = (alike + cycles_of(system) - 1 + cycles) / cycles_of(system)
        jobs = [job._replace(count=job.count * times, batches=job.batches * times) for job in jobs]
    found, rows = price(jobs), cycles * phases + 1
    width = 2 * (costed(system).elements + 1) + system.joints + 5
    memory = 8 * (4 * rows * (system.joints + 5) + 4 * min(rows * width, ROWS_TOGETHER + width))
    words = WORDS * rows * width
    return found._replace(seconds=found.seconds + words, memory=found.memory + memory, besides=found.besides + words)
