"""Forces and moments on a body that is moved through grains, with errors, and the accuracy study of these: error
against the number of elements or triangles, and time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from geomech.core.setting import ROUNDING, Setting
from geomech.core.summary import effect_lines
from geomech.core.variables import Result, Variable
from geomech.run.cost import BASE, Cost
from geomech.scenes.intruding import Intruding
from geomech.studies.settings import Choice, Measurements, choice_variables

UNITS = {
    "t": "s",
    "angle": "rad",
    "x": "m",
    "y": "m",
    "z": "m",
    "force": "N",
    "moment": "N m",
}  # by the first part of names
LABELS = {
    "force": "on the body, with the weight of effects that have one",
    "moment": "on the body, about the frame's origin",
}
TOLERANCES = 10.0 ** -np.arange(1, 7)  # over the largest force and moment
MARGIN = 1.125  # factor on the extrapolation by order: covers the error of 95 of 100 motions of outlines, measured


def cost(scene: Intruding) -> Elements:
    """Return the cost of `answer`."""
    return price(scene, sum((1, *scene.finer)) * scene.count)


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
    largest = "largest error along the motion, nan where it is not known"
    finest = f"number of {scene.parts} from which the errors come"
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
    kinds = type(scene.intruder).__name__, type(scene.motion).__name__
    size = f"{scene.count:,} {scene.parts}"
    facts = {
        "about": f"{kinds[0]} of {size}, {kinds[1]} in {len(run.t)} steps",
        "parts": scene.parts,
    }
    matched = getattr(scene, "matched", "")
    if matched:
        facts["matched"] = matched
    return Result("intrude", tuple(variables), facts)


class Estimate(NamedTuple):
    """Largest errors of force, N, and moment, N m, along the motion, from finer parts, at most ``count``; nan where a
    body does not allow so many."""

    force: float
    moment: float
    count: int


def estimate(scene: Intruding, run) -> Estimate:
    """Return the largest change of a run with finer parts, extrapolated by the order of the error."""
    change, counts = np.zeros(2), [times * scene.count for times in scene.finer]
    try:
        counts = [scene.actual_count(count) for count in counts]
    except ValueError:
        counts = [scene.count]
    if counts[0] == scene.count:
        return Estimate(np.nan, np.nan, scene.count)
    for times, count in zip(scene.finer, counts):
        finer, factor = (
            scene.run(times * scene.count),
            MARGIN / (1.0 - (scene.count / count) ** scene.order),
        )
        pairs = (
            (x.reshape(len(x), -1), y.reshape(len(y), -1))
            for x, y in zip(_loads(finer), _loads(run))
        )
        change = np.maximum(
            change, [factor * np.linalg.norm(x - y, axis=1).max() for x, y in pairs]
        )
    return Estimate(*change.tolist(), counts[-1])


def _loads(run) -> tuple[np.ndarray, np.ndarray]:
    return run.force, run.moment


@dataclass(frozen=True)
class Settings:
    """Force and moment along a motion by numbers of parts. Errors are rms over the motion, over the largest value,
    against the finest of the scene's ladder."""

    scene: Intruding
    runs: int = 3

    about: ClassVar[str] = "force and moment"
    unit: ClassVar[str] = "1"
    measures: ClassVar[dict[str, str]] = {
        "force_error": "rms over the motion, over the largest force",
        "moment_error": "rms over the motion, over the largest moment",
    }

    def check(self) -> None: ...

    def cost(self) -> Elements:
        *counts, finest = self.scene.ladder
        return price(self.scene, finest + self.runs * sum(counts))

    def with_shared_data(self) -> Settings:
        return self

    def settings(self) -> list[Setting]:
        """Return the number of parts as a setting; a shape may have more than the number given."""
        values = tuple(self.scene.actual_count(n) for n in self.scene.ladder[:-1])
        return [Setting(self.scene.parts, values, self.scene.order, against="limit")]

    def evaluate(self, setting: Setting | None, value: Any) -> list[np.ndarray]:
        """Return force (T, 2 or 3), N, and moment (T,) or (T, 3), N m, along the motion."""
        *counts, finest = self.scene.ladder
        run = self.scene.run(
            finest if value is None else counts[self.settings()[0].values.index(value)]
        )
        return [run.force, run.moment]

    def errors(
        self, numbers: list[np.ndarray], truth: list[np.ndarray]
    ) -> dict[str, float]:
        """Return the error of force and moment; a moment that is only roundoff is compared to the force times the
        body's size."""
        errors, most = {}, np.abs(truth[0]).max()
        for what, arm, one, exact in zip(
            self.measures, (1.0, self.scene.size), numbers, truth
        ):
            largest, bound = np.abs(exact).max(), arm * most
            largest = largest if largest > ROUNDING * bound else bound or 1.0
            errors[what] = float(np.sqrt(np.mean((one - exact) ** 2)) / largest)
        return errors

    def choices(self, measured: Measurements) -> list[Variable]:
        """Return the fewest of the tried parts that meet tolerances in force and
        moment."""
        errors = np.maximum(*measured.errors.values())

        def choose(tolerance: float) -> Choice | None:
            good = np.flatnonzero(errors[0] <= tolerance)
            if good.size:
                return Choice(0, int(good[0]))
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

    @property
    def as_balances(self) -> float:
        """Number of balances that take NumPy as long: 150 elements count as one; triangles are never compiled."""
        return self.balances / 150 if self.parts == "elements" else 0.0

    def __str__(self) -> str:
        return f"{self.balances:,} {self.parts} at a pose, about {max(1.0, self.seconds):.0f} s of computing"


class Triangles(Elements):
    """Cost of forces on a mesh along a motion."""

    parts = "triangles"


def price(scene: Intruding, count: int | None = None) -> Elements:
    """Return the cost of runs with so many parts in all, or of one with the scene's own."""
    parts = scene.motion.samples * (count or scene.count)
    kind = next(kind for kind in (Elements, Triangles) if kind.parts == scene.parts)
    seconds = parts * scene.per_part
    return kind(parts, seconds, BASE, seconds)
