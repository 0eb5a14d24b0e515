"""Errors and seconds at the values of settings, and what follows from them: orders, and
the cheapest values that meet a tolerance."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from geomech.core.setting import ROUNDING, Setting
from geomech.core.variables import Variable

DIMS = ("setting", "fineness")
NONE = "none"  # in place of a setting where none meets a tolerance
MIN_ERRORS = 3  # errors above rounding from which an order is measured


@dataclass(frozen=True, eq=False)
class Measurements:
    """Runs at the values of settings, from coarse to fine.

    values, seconds, and errors by measure: (S, F) for S settings; nan behind the last
    value of a setting that has fewer than F."""

    settings: Sequence[Setting]
    values: np.ndarray
    seconds: np.ndarray
    errors: Mapping[str, np.ndarray]


class Choice(NamedTuple):
    """A value of a setting: the index of the setting, and that of the value."""

    setting: int
    value: int


def padded_array(rows: Sequence[Sequence[float]]) -> np.ndarray:
    """Return rows of different lengths as one array, filled with nan."""
    longest = max(map(len, rows))
    array = np.full((len(rows), longest), np.nan)
    for k, row in enumerate(rows):
        array[k, : len(row)] = row
    return array


def measured_order(values: np.ndarray, errors: np.ndarray) -> float:
    """Return the measured order of errors in the coarseness, by least squares; nan
    where fewer than `MIN_ERRORS` are more than rounding."""
    is_significant = errors > ROUNDING
    if is_significant.sum() < MIN_ERRORS:
        return np.nan
    x = np.log(values[np.isfinite(values)])
    log_values = np.log(values[is_significant])
    log_errors = np.log(errors[is_significant])
    slope = np.polyfit(log_values, log_errors, 1)[0]
    if x[0] < x[-1]:
        return -slope
    return slope


def order_name(error: str) -> str:
    """Return the name of the order of an error: order, or force_order of
    force_error."""
    return error.removesuffix("error") + "order"


def measurement_variables(
    measured: Measurements, unit: str, labels: Mapping[str, str]
) -> Iterator[Variable]:
    """Yield settings, values, seconds, errors in ``unit``, and orders."""
    settings = measured.settings
    texts = {
        "setting": [setting.label for setting in settings],
        "tier": [setting.tier for setting in settings],
        "varied": [setting.name for setting in settings],
        "against": [setting.against for setting in settings],
        "order_by_theory": [str(setting.order) for setting in settings],
        "buys": [setting.buys for setting in settings],
    }
    for name, words in texts.items():
        if any(words):
            yield Variable(name, ("setting",), np.array(words))
    yield Variable("value", DIMS, measured.values, "", "value of the setting")
    yield Variable(
        "seconds", DIMS, measured.seconds, "s", "computing time of the fastest run"
    )
    for name, errors in measured.errors.items():
        yield Variable(name, DIMS, errors, unit, labels[name])
        orders = []
        for values, setting_errors in zip(measured.values, errors):
            orders.append(measured_order(values, setting_errors))
        label = "measured order, nan where all is rounding"
        yield Variable(order_name(name), ("setting",), np.array(orders), "1", label)


def choice_variables(
    measured: Measurements,
    errors: np.ndarray,
    unit: str,
    tolerances: np.ndarray,
    choose: Callable[[float], Choice | None],
) -> list[Variable]:
    """Return the value that is chosen for each tolerance, its error and its seconds.

    errors: (S, F), which are compared with the tolerances. choose: returns the value
    for a tolerance; None where no value meets it."""
    names = []
    rows = []
    for tolerance in tolerances:
        choice = choose(float(tolerance))
        if choice is None:
            names.append(NONE)
            rows.append((np.nan, np.nan, np.nan))
            continue
        names.append(measured.settings[choice.setting].label)
        rows.append((measured.values[choice], errors[choice], measured.seconds[choice]))
    values, found_errors, seconds = np.array(rows).T
    dims = ("tolerance",)
    return [
        Variable("tolerance", dims, tolerances, unit),
        Variable("best_setting", dims, np.array(names)),
        Variable("best_value", dims, values, "", "value of the setting"),
        Variable("best_error", dims, found_errors, unit),
        Variable("best_seconds", dims, seconds, "s"),
    ]
