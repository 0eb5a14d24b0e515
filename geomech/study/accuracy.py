"""What accuracy costs: every approximation of a question as a knob, set from coarse to fine, error against time.

A knob declares its settings, the order theory gives its error and what it is measured against: the truth, the same for all
knobs, or the limit of that knob alone, all else being equal.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from typing import Any, ClassVar, Protocol, Self

import numpy as np

from geomech.core.knob import ROUNDING, Knob
from geomech.core.variables import Result, Variable
from geomech.run.cost import Cost
from geomech.run.jobs import runner
from geomech.study.question import Allow, Progress, Question


class Adjustable(Protocol):
    """A question whose approximations can be set: what an accuracy study is made of.

    measures: the errors that it has, by name. tolerances: for which the cheapest settings are told. runs: each setting is
    timed so often. picture: the figure of `geomech.output.plots` that draws the study."""

    scene: Any
    measures: ClassVar[tuple[str, ...]]
    tolerances: ClassVar[np.ndarray]
    picture: ClassVar[str]
    runs: int

    def check(self) -> None:
        """Refusal for what makes no sense."""

    def cost(self) -> Cost:
        """Return what all settings take, each ``runs`` times."""

    def prepared(self) -> Self:
        """Return the question with what all settings share, computed once."""

    def knobs(self) -> list[Knob]: ...

    def numbers(self, knob: Knob | None, value: Any) -> list[np.ndarray]:
        """Return the answer at a setting; of a knob at None its limit, without a knob the truth."""

    def errors(self, found: list[np.ndarray], truth: list[np.ndarray]) -> dict[str, float]:
        """Return the error by measure."""

    def told(self, knob: Knob, measure: str) -> dict[str, Any]:
        """Return what a line of the study says of a knob."""

    def cheapest(self, lines: list[dict], tolerance: float) -> dict[str, Any]:
        """Return the setting to take for a tolerance, of lines as `lines` has them."""

    def facts(self) -> dict[str, Any]:
        """Return what holds of the whole study."""


def adjustable(scene: Any, runs: int | None = None) -> Adjustable:
    """Return what an accuracy study asks of a scene: a displacement, forces along a motion, or the speed of a robot."""
    kinds = {"robot": "walking", "intruder": "intrusion"}  # each loaded where it is asked for
    module = next((module for part, module in kinds.items() if hasattr(scene, part)), "tiered")
    kind = import_module(f"geomech.study.{module}").Settings
    return kind(scene) if runs is None else kind(scene, runs)


@dataclass(frozen=True)
class Accuracy(Question):
    """Error and seconds of a question at every setting of its knobs.

    Each setting is timed ``runs`` times, and the quickest counts, so that what a first call loads and warms does not.
    Seconds are of one thread's computing."""

    scene: Any
    runs: int | None = None

    @cached_property
    def asked(self) -> Adjustable:
        return adjustable(self.scene, self.runs)

    def check(self) -> None:
        self.asked.check()

    def cost(self) -> Cost:
        return self.asked.cost()

    def answer(self, progress: Progress, allow: Allow) -> Result:
        asked = self.asked.prepared()
        knobs, runs, tasks = asked.knobs(), asked.runs, []
        if any(knob.against == "truth" for knob in knobs):
            tasks.append((None, None, 1))
        for knob in knobs:
            tasks += [(knob, None, 1)] if knob.against == "limit" else []
            tasks += [(knob, value, runs) for value in knob.values]
        found = runner().map(answered, asked, tasks, len(tasks), progress=progress)
        true = next(found)[0] if tasks[0][0] is None else None
        rows = []
        for knob in knobs:
            truth = next(found)[0] if knob.against == "limit" else true
            for value in knob.values:
                numbers, seconds = next(found)
                rows.append((knob.label, value, seconds, *asked.errors(numbers, truth).values()))
        return _result(asked, knobs, rows)


def _result(asked: Adjustable, knobs: list[Knob], rows: list[tuple]) -> Result:
    labels, values, seconds, *errors = zip(*rows)
    over = ("setting",)
    found = [
        Variable("knob", over, np.array(labels)),
        Variable("value", over, np.array(values, float)),
        Variable("seconds", over, np.array(seconds), "s"),
        *(Variable(measure, over, np.array(e)) for measure, e in zip(asked.measures, errors)),
    ]
    told = [(knob, measure, asked.told(knob, measure)) for measure in asked.measures for knob in knobs]
    bare = Result("accuracy", tuple(found), {"knobs": told}, asked)
    choices = [asked.cheapest(lines(bare), float(tolerance)) for tolerance in asked.tolerances]
    return Result("accuracy", tuple(found), {**asked.facts(), "knobs": told, "cheapest": choices}, asked)


def answered(asked: Any, task: tuple[Knob | None, Any, int]) -> tuple[list[np.ndarray], float]:
    """Return the answer at a setting, and the seconds that the quickest of its runs took."""
    (knob, value, runs), times = task, []
    for _ in range(runs):
        start = time.thread_time()
        numbers = asked.numbers(knob, value)
        times.append(time.thread_time() - start)
    return numbers, min(times)


def lines(result: Result) -> list[dict[str, Any]]:
    """Return a line {"label", ..., "order", "value", "error", "seconds", "slope"} for every knob and measure."""
    found = []
    for knob, measure, told in result.attributes["knobs"]:
        some = result["knob"].values == knob.label
        errors, seconds = result[measure].values[some].tolist(), result["seconds"].values[some].tolist()
        numbers = {"value": list(knob.values), "error": errors, "seconds": seconds, "slope": slope(knob.values, errors)}
        found.append({**told, **numbers})
    return found


def slope(values, errors) -> float | None:
    """Return the measured order of the error in the coarseness; None where all is rounding."""
    x, y = np.log(np.array(values, float)), np.array(errors)
    seen = y > ROUNDING
    if seen.sum() < 3:
        return None
    p = np.polyfit(x[seen], np.log(y[seen]), 1)[0]
    return float(-p if x[0] < x[-1] else p)


def table(result: Result) -> dict[str, Any]:
    """Return {"scene", ..., "lines": [...], "cheapest": [...]}, as JSON has a study."""
    facts = dict(result.attributes)
    del facts["knobs"]
    head, last = {}, facts.pop("cheapest")
    for key in [key for key in facts if key not in ("units", "own_error")]:
        head[key] = facts.pop(key)
    return {**head, "lines": lines(result), "cheapest": last, **facts}


def study(scene: Any, progress: Callable | None = None, runs: int | None = None) -> dict[str, Any]:
    """Return the accuracy study of a scene of any kind as a table. Who computes: `geomech.run.workers`."""
    question = Accuracy(scene, runs)
    return table(question.answer(progress or (lambda done: None), lambda cost: None))
