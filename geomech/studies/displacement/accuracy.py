"""Accuracy studies: error against computing time of an answer, at settings of every
approximation from coarse to fine.

A setting declares its values from coarse to fine, the order of its error by theory, and
its reference: the truth, common to all settings, or the limit of that setting alone,
with all other settings unchanged."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from importlib import import_module
from typing import Any, ClassVar, Protocol, Self

import numpy as np

from geomech.core.setting import Setting
from geomech.core.variables import Result, Variable
from geomech.runs.cost import Cost
from geomech.runs.runner import runner
from geomech.studies.settings import Measurements, measurement_variables, padded_array

# Modules of other kinds of scene, loaded only where needed.
KINDS = {"robot": "terradynamics.walking", "intruder": "terradynamics.intrusion"}
DIGITS = 3  # of seconds: another run differs in the second digit


class AccuracySubject(Protocol):
    """An answer whose approximations can be set: the subject of an accuracy study.

    about: the answer in words. unit: of its errors. measures: labels of these by name.
    runs: how often each setting is timed."""

    scene: Any
    about: ClassVar[str]
    unit: ClassVar[str]
    measures: ClassVar[Mapping[str, str]]
    runs: int

    def check(self) -> None:
        """Refuse a question that makes no sense."""

    def cost(self) -> Cost:
        """Return the cost of all settings, each run ``runs`` times."""

    def with_shared_data(self) -> Self:
        """Return the subject with the data that all settings share, computed once."""

    def settings(self) -> list[Setting]: ...

    def evaluate(self, setting: Setting | None, value: Any) -> list[np.ndarray]:
        """Return the answer at a value of a setting. If the value is None, it is the
        limit of the setting; without a setting, the truth."""

    def errors(
        self, numbers: list[np.ndarray], truth: list[np.ndarray]
    ) -> dict[str, float]:
        """Return the error of an answer by measure."""

    def choices(self, measured: Measurements) -> list[Variable]:
        """Return the values that meet tolerances, and other variables of the whole
        study."""

    def facts(self) -> dict[str, Any]:
        """Return attributes of the whole study."""


def accuracy_subject(scene: Any, runs: int | None = None) -> AccuracySubject:
    """Return the subject of an accuracy study of a scene: a displacement, forces along
    a motion, or the speed of a robot."""
    module = "displacement.tiered"
    for part, name in KINDS.items():
        if hasattr(scene, part):
            module = name
    kind = import_module(f"geomech.studies.{module}").Settings
    if runs is None:
        return kind(scene)
    return kind(scene, runs)


def answer(subject: AccuracySubject, progress: Callable | None = None) -> Result:
    """Return error and seconds at every value of the settings of a subject.

    Each value is timed ``runs`` times, and the quickest run counts, since first calls
    load and compile code. Seconds are CPU seconds of one thread."""
    subject = subject.with_shared_data()
    measured = measure(subject, progress)
    found = [
        *measurement_variables(measured, subject.unit, subject.measures),
        *subject.choices(measured),
    ]
    facts = {"about": subject.about, **subject.facts()}
    return Result("accuracy", tuple(found), facts)


def measure(subject: AccuracySubject, progress: Callable | None) -> Measurements:
    """Return the runs of a subject at all values of its settings."""
    settings = subject.settings()
    tasks = [*list_tasks(settings, subject.runs)]
    answers = runner().map(timed_answer, subject, tasks, len(tasks), progress=progress)
    truth = None
    first_setting, _, _ = tasks[0]
    if first_setting is None:
        truth, _ = next(answers)

    seconds: list[list[float]] = []
    errors: dict[str, list[list[float]]] = {name: [] for name in subject.measures}
    for setting in settings:
        reference = truth
        if setting.against == "limit":
            reference, _ = next(answers)
        seconds.append([])
        for rows in errors.values():
            rows.append([])

        for _ in setting.values:
            numbers, run_seconds = next(answers)
            seconds[-1].append(run_seconds)
            for name, error in subject.errors(numbers, reference).items():
                errors[name][-1].append(error)

    return Measurements(
        settings,
        padded_array([setting.values for setting in settings]),
        padded_array(seconds),
        {name: padded_array(rows) for name, rows in errors.items()},
    )


def list_tasks(settings: list[Setting], runs: int) -> Iterator[tuple]:
    """Yield (setting, value, runs). The truth has no setting, and comes first if any
    setting is compared with it; the limit of a setting has no value."""
    if any(setting.against == "truth" for setting in settings):
        yield None, None, 1
    for setting in settings:
        if setting.against == "limit":
            yield setting, None, 1
        for value in setting.values:
            yield setting, value, runs


def timed_answer(
    subject: Any, task: tuple[Setting | None, Any, int]
) -> tuple[list[np.ndarray], float]:
    """Return the answer at a setting, and the seconds that the quickest of its runs
    took."""
    setting, value, runs = task
    times = []
    for _ in range(runs):
        start = time.thread_time()
        numbers = subject.evaluate(setting, value)
        times.append(time.thread_time() - start)
    return numbers, float(f"{min(times):.{DIGITS}g}")
