"""Error against computing time of an answer, at settings of every approximation."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np

from geomech.core.variables import Result
from geomech.questions.shared import loading, names
from geomech.questions.shared.base import Option, Question, Run, Subject
from geomech.results.numbers import number, size
from geomech.runs.cost import Cost
from rft.core.checks import in_range

if TYPE_CHECKING:
    from geomech.scenes import Intruding, Scene, WalkerScene
    from geomech.studies.displacement.accuracy import AccuracySubject

SHOWN = (
    "best_setting",
    "best_value",
    "best_error",
    "best_seconds",
    "coarsest_value",
)
LARGEST_RUNS = 1000  # of one setting; assumed
ERRORS = ("error", "force_error", "moment_error")


@dataclass(frozen=True)
class Accuracy(Question):
    """Measure error against time for every tier and setting. The result lists the
    cheapest settings for each tolerance. The settings of an intruder scene are numbers
    of elements or triangles; those of a robot are steps, elements and rounding."""

    scene: Annotated[
        "Scene | Intruding | WalkerScene",
        Subject(loading.load_any, names.all_scene_names),
    ]
    runs: Annotated[
        int | None,
        Option("runs of each setting, of which the fastest is timed", "N"),
    ] = None

    name: ClassVar[str] = "accuracy"
    looks: ClassVar[tuple[str, ...]] = (*Question.looks, "unit")
    table: ClassVar[tuple[str, ...]] = ("setting", "fineness")
    parallel: ClassVar[bool] = True

    @cached_property
    def adjustable(self) -> "AccuracySubject":
        from geomech.studies.displacement import accuracy

        return accuracy.accuracy_subject(self.scene, self.runs)

    def check(self) -> None:
        if self.runs is not None:
            in_range("runs", self.runs, 1, LARGEST_RUNS, whole=True)
        self.adjustable.check()

    def cost(self) -> Cost:
        return self.adjustable.cost()

    def compute(self, run: Run) -> Result:
        from geomech.studies.displacement import accuracy

        return accuracy.answer(self.adjustable, run.progress)

    @staticmethod
    def headline(result: Result) -> list[str]:
        facts = result.attributes
        words = f"{facts['scene']}: error of {facts['about']}"
        if "speed" in result:
            speed = result["speed"]
            words = f"{words}, {float(speed):.6g} {speed.unit},"
        return [f"{words} against computing time in seconds"]

    @staticmethod
    def summary(result: Result) -> Result:
        return result.only(*SHOWN)

    @staticmethod
    def remarks(result: Result) -> list[str]:
        lines = []
        if "own_error" in result:
            system_error = size(float(result["own_error"]))
            lines.append(
                "errors in the table include the error of the system itself, "
                f"{system_error} {result['own_error'].unit}, which no setting "
                "reduces; those below do not"
            )
        for k in range(result.sizes["setting"]):
            for name in ERRORS:
                if name in result:
                    lines.append(setting_words(result, k, name))
        return lines

    @staticmethod
    def lengths(result: Result) -> Any:
        """Errors of a gait are in body lengths, whatever the unit of its scene."""
        from geomech.results.length_units import Lengths, scene_lengths
        from geomech.results.scenes import scene_of

        lengths = scene_lengths(scene_of(result))
        if hasattr(scene_of(result), "system"):
            return Lengths({"BL": lengths.body}, lengths.body)
        return lengths

    @staticmethod
    def draw(result: Result) -> Any:
        """Draw errors against seconds or against the values of settings; return the
        Figure."""
        from geomech import plots

        return plots.accuracy_figure(result)


def setting_words(result: Result, k: int, name: str) -> str:
    """Return in a sentence what a setting gains: its coarsest and its finest value,
    their errors and seconds, and the measured order."""
    values = ends(result, k, "value")
    errors = ends(result, k, name)
    seconds = ends(result, k, "seconds")
    about = name.replace("_", " ")
    unit = error_words(result, name)
    if str(result["against"][k]) == "limit":
        unit = f"{unit} relative to its own limit"
    words = (
        f"{result['setting'][k]} {number(values[0])} to {number(values[1])}: "
        f"{about} {size(errors[0])} to {size(errors[1])}{unit} "
        f"in {number(seconds[0])} to {number(seconds[1])} s"
    )
    if "buys" in result:
        words = f"{words}; gives {result['buys'][k]}"
    return f"{words} ({order_words(result, k, name)})"


def ends(result: Result, k: int, name: str) -> tuple[float, float]:
    """Return a variable of a setting at its coarsest and at its finest value."""
    row = result[name][k]
    row = row[np.isfinite(result["value"][k])]
    return float(row[0]), float(row[-1])


def error_words(result: Result, name: str) -> str:
    """Return the unit of an error, as it stands behind a number."""
    unit = result[name].units
    if unit == "1":
        return " of its largest value"
    return f" {unit}"


def order_words(result: Result, k: int, name: str) -> str:
    """Return the measured order of an error beside that of theory."""
    order = float(result[name.removesuffix("error") + "order"][k])
    measured = f"measured order {order:.1f}"
    if math.isnan(order):
        measured = "no order, only rounding"
    return f"{measured}; theory: {result['order_by_theory'][k]}"
