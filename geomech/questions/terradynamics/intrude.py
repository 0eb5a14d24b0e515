"""Force and moment of grains on a body that is moved through them."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np

from geomech.core.summary import first_place
from geomech.core.variables import Result
from geomech.questions.shared import loading, names
from geomech.questions.shared.base import Question, Run, Subject
from geomech.runs.cost import Cost

if TYPE_CHECKING:
    from geomech.scenes.terradynamics.intruding import Intruding

ROUNDING = 1e-12  # over the largest force or moment


@dataclass(frozen=True)
class Intrude(Question):
    """Compute force and moment of grains on a moving body. The body is an outline in
    the vertical plane or a mesh. Results are in SI units."""

    scene: Annotated["Intruding", Subject(loading.load_intruder, names.intruder_names)]

    name: ClassVar[str] = "intrude"
    looks: ClassVar[tuple[str, ...]] = (*Question.looks, "unit", "cmap")
    table: ClassVar[tuple[str, ...]] = ("t",)
    unlimited: ClassVar[bool] = True  # it takes seconds at most

    def cost(self) -> Cost:
        from geomech.studies.terradynamics import intrusion

        return intrusion.cost(self.scene)

    def compute(self, run: Run) -> Result:
        from geomech.studies.terradynamics import intrusion

        return intrusion.answer(self.scene)

    @staticmethod
    def headline(result: Result) -> list[str]:
        facts = result.attributes
        lines = [f"{facts['scene']}: {facts['about']}"]
        if "matched" in facts:
            lines.append(facts["matched"])
        if "effect" in result:
            lines += result["effect"].values.tolist()
        return lines

    @staticmethod
    def summary(result: Result) -> Result:
        return result.only()

    @staticmethod
    def remarks(result: Result) -> list[str]:
        work = float(result["work"])
        power = float(result["largest_power"])
        return [
            *extreme_lines(result),
            f"error    {error_words(result)}",
            f"work     {work:.4g} J of the grains on the body; power at most "
            f"{power:.4g} W",
        ]

    @staticmethod
    def draw(result: Result) -> Any:
        """Draw the body, and force and moment along its motion; return the Figure."""
        from geomech import plots
        from geomech.results.scenes import scene_of

        return plots.intrusion_figure(scene_of(result), result)


def loads(result: Result) -> list[str]:
    """Return the names of the forces and moments of a result; in three dimensions the
    components of the moment in place of its size."""
    names = [name for name in result if name.startswith(("force", "moment"))]
    if "moment_y" in names:
        names.remove("moment")
    return names


def place_of(result: Result) -> str:
    """Return the name of the coordinate along which the body moves most."""
    if "angle" in result:
        return "angle"
    places = [name for name in "xyz" if name in result]
    return max(places, key=lambda name: np.ptp(result[name].values))


def extreme_lines(result: Result) -> list[str]:
    """Return the least and the largest value of each force and moment with their
    places."""
    names = loads(result)
    largest = dict.fromkeys(("force", "moment"), 0.0)
    for name in names:
        kind = name.partition("_")[0]
        size = float(np.abs(result[name].values).max())
        largest[kind] = max(largest[kind], size)
    lines = []
    for name in names:
        values = result[name].values
        unit = result[name].unit
        kind = name.partition("_")[0]
        least = value_words(result, name, *first_place(values, values.min()))
        greatest = value_words(result, name, *first_place(values, values.max()))
        if np.abs(values).max() < ROUNDING * largest[kind]:
            lines.append(f"{name:8} zero within rounding")
        elif np.ptp(values) < ROUNDING * largest[kind]:
            lines.append(f"{name:8} {values[0]:.4g} {unit} throughout")
        else:
            lines.append(f"{name:8} {least}, to {greatest} ({unit})")
    return lines


def value_words(result: Result, name: str, index: int) -> str:
    """Return a force or a moment at a step, with the place of the body."""
    value = float(result[name].values[index])
    return f"{value + 0.0:.4g} at {place_words(result, index)}"


def place_words(result: Result, index: int) -> str:
    """Return the place of the body at a step."""
    name = place_of(result)
    value = float(result[name].values[index])
    unit = result[name].unit
    if name == "angle":
        value = math.degrees(value)
        unit = "degrees"
    return f"{name} = {value + 0.0:.4g} {unit}"


def error_words(result: Result) -> str:
    force = float(result["largest_force_error"])
    moment = float(result["largest_moment_error"])
    parts = result.attributes["parts"]
    if not math.isfinite(force):
        return (
            f"unknown: a finer computation would exceed the largest number of {parts}"
        )
    count = int(result["finest_parts"].values)
    unit = result["largest_moment_error"].unit
    sizes = f"force {force:.1g} N, moment {moment:.1g} {unit}"
    return f"{sizes} at most, estimated with up to {count:,} {parts}"
