"""Accuracy studies: error against computing time of a question, at settings of every approximation from coarse to fine.

A setting declares its values from coarse to fine, the order of its error by theory and its reference: the truth, common to
all settings, or the limit of that setting alone, all else being equal."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from typing import Any, ClassVar, Protocol, Self

import numpy as np

from geomech.core.setting import ROUNDING, Setting
from geomech.core.variables import Result, Variable
from geomech.run.cost import Cost
from geomech.run.runner import runner
from geomech.studies.question import Allow, Progress, Question


class Adjustable(Protocol):
    """A question whose approximations can be set: the subject of an accuracy study.

    measures: names of its errors. tolerances: for which the cheapest settings are reported. runs: how often each
    setting is timed. picture: the figure of `geomech.plots` that draws the study."""

    scene: Any
    measures: ClassVar[tuple[str, ...]]
    tolerances: ClassVar[np.ndarray]
    picture: ClassVar[str]
    runs: int

    def check(self) -> None:
        """Refuse a question that makes no sense."""

    def cost(self) -> Cost:
        """Return the cost of all settings, each run ``runs`` times."""

    def prepared(self) -> Self:
        """Return the question with the data that all settings share, computed once."""

    def settings(self) -> list[Setting]: ...

    def numbers(self, setting: Setting | None, value: Any) -> list[np.ndarray]:
        """Return the answer at a value of a setting; for None the limit of the setting, without a setting the truth."""

    def errors(
        self, numbers_: list[np.ndarray], truth: list[np.ndarray]
    ) -> dict[str, float]:
        """Return the error of an answer by measure."""

    def describe(self, setting: Setting, measure: str) -> dict[str, Any]:
        """Return the entries of a line of the study that describe a setting."""

    def cheapest(self, lines: list[dict], tolerance: float) -> dict[str, Any]:
        """Return the best setting for a tolerance; ``lines`` as of `lines`."""

    def facts(self) -> dict[str, Any]:
        """Return attributes of the whole study."""


def adjustable(scene: Any, runs: int | None = None) -> Adjustable:
    """Return the question of an accuracy study of a scene: a displacement, forces along a motion, or the speed of a
    robot."""
    kinds = {"robot": "walking", "intruder": "intrusion"}  # loaded only where needed
    module = next(
        (module for part, module in kinds.items() if hasattr(scene, part)), "tiered"
    )
    kind = import_module(f"geomech.studies.{module}").Settings
    return kind(scene) if runs is None else kind(scene, runs)


@dataclass(frozen=True)
class Accuracy(Question):
    """Error and computing time of a question at every value of its settings.

    Each setting is timed ``runs`` times, and the quickest counts, so that first calls that load and warm up do not.
    Seconds are CPU seconds of one thread."""

    scene: Any
    runs: int | None = None

    @cached_property
    def question(self) -> Adjustable:
        return adjustable(self.scene, self.runs)

    def check(self) -> None:
        self.question.check()

    def cost(self) -> Cost:
        return self.question.cost()

    def answer(self, progress: Progress, allow: Allow) -> Result:
        question = self.question.prepared()
        settings, runs, tasks = question.settings(), question.runs, []
        if any(setting.against == "truth" for setting in settings):
            tasks.append((None, None, 1))
        for setting in settings:
            tasks += [(setting, None, 1)] if setting.against == "limit" else []
            tasks += [(setting, value, runs) for value in setting.values]
        answers = runner().map(answered, question, tasks, len(tasks), progress=progress)
        true = next(answers)[0] if tasks[0][0] is None else None
        rows = []
        for setting in settings:
            truth = next(answers)[0] if setting.against == "limit" else true
            for value in setting.values:
                numbers, seconds = next(answers)
                rows.append(
                    (
                        setting.label,
                        value,
                        seconds,
                        *question.errors(numbers, truth).values(),
                    )
                )
        return _result(question, settings, rows)


def _result(question: Adjustable, settings: list[Setting], rows: list[tuple]) -> Result:
    labels, values, seconds, *errors = zip(*rows)
    over = ("setting",)
    variables = [
        Variable("setting", over, np.array(labels)),
        Variable("value", over, np.array(values, float)),
        Variable("seconds", over, np.array(seconds), "s"),
        *(
            Variable(measure, over, np.array(e))
            for measure, e in zip(question.measures, errors)
        ),
    ]
    descriptions = [
        (setting, measure, question.describe(setting, measure))
        for measure in question.measures
        for setting in settings
    ]
    bare = Result("accuracy", tuple(variables), {"settings": descriptions}, question)
    choices = [
        question.cheapest(lines(bare), float(tolerance))
        for tolerance in question.tolerances
    ]
    return Result(
        "accuracy",
        tuple(variables),
        {**question.facts(), "settings": descriptions, "cheapest": choices},
        question,
    )


def answered(
    question: Any, task: tuple[Setting | None, Any, int]
) -> tuple[list[np.ndarray], float]:
    """Return the answer at a setting, and the seconds that the quickest of its runs took."""
    (setting, value, runs), times = task, []
    for _ in range(runs):
        start = time.thread_time()
        numbers = question.numbers(setting, value)
        times.append(time.thread_time() - start)
    return numbers, min(times)


def lines(result: Result) -> list[dict[str, Any]]:
    """Return a line {"label", ..., "order", "value", "error", "seconds", "slope"} for every setting and measure."""
    out = []
    for setting, measure, description in result.attributes["settings"]:
        rows = result["setting"].values == setting.label
        errors, seconds = (
            result[measure].values[rows].tolist(),
            result["seconds"].values[rows].tolist(),
        )
        numbers = {
            "value": list(setting.values),
            "error": errors,
            "seconds": seconds,
            "slope": slope(setting.values, errors),
        }
        out.append({**description, **numbers})
    return out


def slope(values, errors) -> float | None:
    """Return the measured order of the error in the coarseness; None where all is rounding."""
    x, y = np.log(np.array(values, float)), np.array(errors)
    seen = y > ROUNDING
    if seen.sum() < 3:
        return None
    p = np.polyfit(x[seen], np.log(y[seen]), 1)[0]
    return float(-p if x[0] < x[-1] else p)


def table(result: Result) -> dict[str, Any]:
    """Return the JSON of a study: {"scene", ..., "lines": [...], "cheapest": [...]}."""
    facts = dict(result.attributes)
    del facts["settings"]
    head, last = {}, facts.pop("cheapest")
    for key in [key for key in facts if key not in ("units", "own_error")]:
        head[key] = facts.pop(key)
    return {**head, "lines": lines(result), "cheapest": last, **facts}


def study(
    scene: Any, progress: Callable | None = None, runs: int | None = None
) -> dict[str, Any]:
    """Return the accuracy study of a scene of any kind as a table. Executors: see `geomech.run.workers`."""
    question = Accuracy(scene, runs)
    return table(question.answer(progress or (lambda done: None), lambda cost: None))
