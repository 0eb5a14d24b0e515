"""Forces and moments on a body that is moved through grains, with errors, and the
accuracy study of these: error against the number of elements or triangles, and time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from geomech.core.setting import ROUNDING, Setting
from geomech.core.summary import effect_lines
from geomech.core.variables import Result, Variable
from geomech.runs.cost import BASE, Cost
from geomech.scenes.terradynamics.intruding import Intruding
from geomech.studies.settings import Choice, Measurements, choice_variables

UNITS = {  # by the first part of names
    "t": "s",
    "angle": "rad",
    "x": "m",
    "y": "m",
    "z": "m",
    "force": "N",
    "moment": "N m",
}
LABELS = {
    "force": "force on the body, including the weight for effects that have one",
    "moment": "moment on the body about the origin of its frame",
}
TOLERANCES = 10.0 ** -np.arange(1, 7)  # over the largest force and moment
# Factor on the extrapolation by order: covers the error of 95 of 100 motions of
# outlines, measured.
MARGIN = 1.125
NUMPY_SECONDS = 1e-7  # that an element is assumed to take NumPy


def cost(scene: Intruding) -> Elements:
    """Return the cost of `answer`."""
    runs = sum((1, *scene.finer))  # in runs with the scene's own parts
    return total_cost(scene, runs * scene.count)


def answer(scene: Intruding) -> Result:
    """Return force and moment along a scene's motion, with errors from finer parts."""
    run = scene.run()
    error = estimate(scene, run)
    bounds = {"force": error.force, "moment": error.moment}
    variables = []
    for name, values in scene.table(run).items():
        kind = name.partition("_")[0]
        bound = None
        if kind in bounds and np.isfinite(bounds[kind]):
            bound = np.full_like(values, bounds[kind])
        label = LABELS.get(kind, "")
        unit = UNITS[kind]
        variables.append(Variable(name, ("t",), values, unit, label, bound))
    mean_power = (run.power[1:] + run.power[:-1]) / 2
    work = float(np.sum(mean_power * np.diff(run.t)))
    largest = "largest error along the motion, nan where it is unknown"
    finest = f"number of {scene.parts} from which the errors are estimated"
    grains = "of the grains on the body"
    variables += [
        Variable("power", ("t",), run.power, "W", grains),
        Variable("work", (), work, "J", grains),
        Variable("largest_power", (), run.power.max(), "W", grains),
        Variable("largest_force_error", (), error.force, "N", largest),
        Variable("largest_moment_error", (), error.moment, "N m", largest),
        Variable("finest_parts", (), error.count, "1", finest),
    ]
    lines = effect_lines(scene.effects)
    if lines:
        variables.append(Variable("effect", ("line",), lines))
    intruder = type(scene.intruder).__name__
    motion = type(scene.motion).__name__
    size = f"{scene.count:,} {scene.parts}"
    facts = {
        "about": f"{intruder} of {size}, {motion} in {len(run.t)} steps",
        "parts": scene.parts,
    }
    matched = getattr(scene, "matched", "")
    if matched:
        facts["matched"] = matched
    return Result("intrude", tuple(variables), facts)


class Estimate(NamedTuple):
    """Largest errors of force, N, and moment, N m, along the motion, from finer parts,
    at most ``count``; nan where a body does not allow so many."""

    force: float
    moment: float
    count: int


def estimate(scene: Intruding, run: Any) -> Estimate:
    """Return the largest change of a run with finer parts, extrapolated by the order of
    the error."""
    counts = _finer_counts(scene)
    if counts[0] == scene.count:
        return Estimate(np.nan, np.nan, scene.count)
    force = np.float64(0.0)
    moment = np.float64(0.0)
    for times, count in zip(scene.finer, counts):
        finer = scene.run(times * scene.count)
        factor = MARGIN / (1.0 - (scene.count / count) ** scene.order)
        force_change = factor * _largest_change(finer.force, run.force)
        moment_change = factor * _largest_change(finer.moment, run.moment)
        force = np.maximum(force, force_change)
        moment = np.maximum(moment, moment_change)
    return Estimate(float(force), float(moment), counts[-1])


def _finer_counts(scene: Intruding) -> list[int]:
    """Return the numbers of parts of the finer runs; the scene's own where its body
    does not allow so many."""
    try:
        return [scene.actual_count(times * scene.count) for times in scene.finer]
    except ValueError:
        return [scene.count]


def _largest_change(finer: np.ndarray, coarse: np.ndarray) -> float:
    """Return the largest norm of the difference of vectors (T, ...) along a motion."""
    difference = (finer - coarse).reshape(len(coarse), -1)
    return np.linalg.norm(difference, axis=1).max()


@dataclass(frozen=True)
class Settings:
    """Force and moment along a motion by numbers of parts, as the subject of accuracy
    studies (`geomech.studies.displacement.accuracy`). Errors are rms over the motion,
    over the largest value, against the finest of the scene's ladder."""

    scene: Intruding
    runs: int = 3

    about: ClassVar[str] = "force and moment"
    unit: ClassVar[str] = "1"
    measures: ClassVar[dict[str, str]] = {
        "force_error": "rms error over the motion, relative to the largest force",
        "moment_error": "rms error over the motion, relative to the largest moment",
    }

    def check(self) -> None: ...

    def cost(self) -> Elements:
        *counts, finest = self.scene.ladder
        return total_cost(self.scene, finest + self.runs * sum(counts))

    def with_shared_data(self) -> Settings:
        return self

    def settings(self) -> list[Setting]:
        """Return the number of parts as a setting; a shape may have more than the
        number given."""
        values = tuple(self.scene.actual_count(n) for n in self.scene.ladder[:-1])
        return [Setting(self.scene.parts, values, self.scene.order, against="limit")]

    def evaluate(self, setting: Setting | None, value: Any) -> list[np.ndarray]:
        """Return force (T, 2 or 3), N, and moment (T,) or (T, 3), N m, along the
        motion; with the finest parts for None."""
        *counts, count = self.scene.ladder
        if value is not None:
            (parts,) = self.settings()
            count = counts[parts.values.index(value)]
        run = self.scene.run(count)
        return [run.force, run.moment]

    def errors(
        self, numbers: list[np.ndarray], truth: list[np.ndarray]
    ) -> dict[str, float]:
        """Return the errors of force and moment. A moment that is only roundoff is
        compared to the force times the body's size."""
        errors = {}
        largest_force = np.abs(truth[0]).max()
        for what, arm, one, exact in zip(
            self.measures, (1.0, self.scene.size), numbers, truth
        ):
            scale = np.abs(exact).max()
            bound = arm * largest_force
            if not scale > ROUNDING * bound:
                scale = bound or 1.0
            errors[what] = float(np.sqrt(np.mean((one - exact) ** 2)) / scale)
        return errors

    def choices(self, measured: Measurements) -> list[Variable]:
        """Return the fewest of the tried parts that meet tolerances in force and
        moment."""
        errors = np.maximum(*measured.errors.values())

        def choose(tolerance: float) -> Choice | None:
            within = np.flatnonzero(errors[0] <= tolerance)
            if within.size:
                return Choice(0, int(within[0]))
            return None

        return choice_variables(measured, errors, self.unit, TOLERANCES, choose)

    def facts(self) -> dict[str, Any]:
        scene = self.scene
        finest = scene.actual_count(scene.ladder[-1])
        return {
            "parts": scene.parts,
            "poses": int(scene.motion.samples),
            "finest": int(finest),
        }


class Elements(Cost):
    """Cost of forces along a motion; balances counts the elements, at every pose."""

    parts = "elements"

    def __str__(self) -> str:
        seconds = max(1.0, self.seconds)
        parts = f"{self.balances:,} {self.parts}"
        return f"{parts} at one pose, about {seconds:.0f} s of computing"


class Triangles(Elements):
    """Cost of forces on a mesh along a motion; its balances count triangles."""

    parts = "triangles"


def total_cost(scene: Intruding, count: int) -> Elements:
    """Return the cost of runs along a scene's motion with ``count`` parts in all."""
    parts = scene.motion.samples * count
    seconds = parts * scene.per_part
    if scene.parts == Triangles.parts:  # which are never compiled
        return Triangles(parts, seconds, BASE, seconds)
    return Elements(parts, seconds, BASE, seconds, NUMPY_SECONDS * parts)
