"""Net displacements per cycle as lines of plain text: `text` by the most exact tier, `full` by every tier."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from geomech.core.summary import POSE, WIDTH, zero_words
from geomech.core.variables import Result, Variable
from geomech.studies import tables, uncertainty
from rft.refusal import in_line

numbers = tables.table
MORE = "--all prints every tier, the net distance and the seconds"
FRAME = "x ahead, y to the left, as the body frame points at the start of the cycle"
ROWS, COMPARED, LEAST = (
    14,
    4,
    3,
)  # amplitudes in a table that fits a screen; with x by every tier; below each other


def text(result: Result, title: str = "", rows: int = ROWS) -> str:
    """Return x, y and heading per cycle by the most exact tier, each with its error, a word for what is zero, and x by the
    other tiers or their errors, in lines that fit a screen. title: the beginning of lines, by default the scene's name.
    rows: at most so many amplitudes, of more the first, the last and some between."""
    return "\n".join([*gait_lines(result, title, rows), FRAME])


def gait_lines(result: Result, title: str = "", rows: int = ROWS) -> list[str]:
    """Return the lines of `text`, without the one that tells x from y."""
    facts, title = result.attributes, title or in_line(result.attributes["name"])
    tier, unit, shown = (
        exact_tier(result),
        result["x"].unit,
        shown_rows(len(result["amplitude"].values), rows),
    )
    lines = [f"{title}: {facts['note']}"] if "note" in facts else []
    lines.append(
        f"{title}: displacement per cycle ({unit}), {_tier_words(result, tier)}"
    )
    zeros, moving = _zeros(result, tier)
    moving += ["speed"] if "speed" in result else []
    tables = lambda at: list(
        _side_by_side([_column(result, tier, name, at) for name in moving], result, at)
    )
    if len(stacked := tables(shown)) > 1:
        shown = shown_rows(
            len(result["amplitude"].values), max(LEAST, rows // len(stacked))
        )
        stacked = tables(shown)
    for columns in stacked:
        lines += ["".join(cells) for cells in zip(*columns)]
    lines += [*zeros, *_others(result, tier, shown)]
    if "speed" in result:
        lines.append("speed: net distance, sqrt(x^2 + y^2), times frequency")
    if "medium_error_rule" in result:
        lines.append("medium: one standard deviation by its covariance")
    lines += _effort(result, [tier], shown)
    some = len(shown) < (count := len(result["amplitude"].values))
    lines.append(
        f"amplitude: {_amplitude(result)}" + f", {len(shown)} of {count}" * some
    )
    if "estimate_is" in facts:
        lines.append(f"estimated error: {facts['estimate_is']}")
    return lines


def exact_tier(result: Result) -> int:
    """Return the number of the tier whose largest error of position is least, the last of several."""
    errors = np.nan_to_num(result["x"].error, nan=np.inf).max(1, initial=0.0)
    return len(errors) - 1 - int(errors[::-1].argmin())


def shown_rows(count: int, rows: int) -> np.ndarray:
    """Return the numbers of at most ``rows`` of so many amplitudes, evenly spread."""
    return np.unique(np.linspace(0, count - 1, min(count, rows)).round().astype(int))


def _zeros(result: Result, tier: int) -> tuple[list[str], list[str]]:
    """Return lines that say which of x, y and heading are zero, by symmetry or within their error, and the names of the
    others."""
    symmetric = result.attributes["zero_by_symmetry"]
    lines, moving = zero_words(symmetric), []
    for name in (n for n in POSE if n not in symmetric):
        values, errors = result[name].values[tier], result[name].error[tier]
        zero = (np.abs(values) <= errors).all() and (
            np.abs(values) < 5e-7 * _scale(result, name)
        ).all()
        if zero:
            lines.append(
                f"{name}: zero within its error, {errors.max(initial=0.0):.0e} {result[name].unit}"
            )
        else:
            moving.append(name)
    return lines, moving


def _scale(result: Result, name: str) -> float:
    return 1.0 if name == "heading" else result.attributes["body_length"]


def _tier_words(result: Result, tier: int) -> str:
    """Return the name of a tier, and why it is this one."""
    names, facts = result["tier"].values.tolist(), result.attributes
    if "tolerance" in facts:
        return f"{names[tier]} tier, cheapest within {facts['tolerance']:g} BL"
    return f"{names[tier]} tier" + f", most exact of {len(names)}" * (len(names) > 1)


def _column(result: Result, tier: int, name: str, shown: np.ndarray) -> list[str]:
    """Return the cells of a quantity under its name: values, errors and what an uncertain medium adds."""
    v, facts = result[name], result.attributes
    places = 6 if v.unit == "rad" else _decimals(result)
    head = {
        "heading": "heading (rad)",
        "speed": f"speed ({v.unit}) at {facts.get('frequency', 0.0):g} Hz",
    }.get(name, name)
    wide = max(places + 8, len(head) + 2)
    cells = [
        f"{head:>{wide}}{'+- error':>11}"
        + f"{'+- medium':>12}" * (v.spread is not None)
    ]
    for k in shown:
        cell = f"{np.round(v.values[tier, k], places) + 0.0:{wide}.{places}f}  +-{v.error[tier, k]:7.1e}"
        cells.append(
            cell + (f"   +-{v.spread[tier, k]:7.1e}" if v.spread is not None else "")
        )
    return cells


def _side_by_side(
    columns: list[list[str]], result: Result, shown: np.ndarray
) -> Iterator[list[list[str]]]:
    """Yield columns behind that of amplitudes, as many together as fit WIDTH."""
    amplitudes = [
        "amplitude",
        *(f"{a:9.6g}" for a in result["amplitude"].values[shown]),
    ]
    while columns:
        group = [amplitudes, columns.pop(0)]
        while columns and sum(len(c[0]) for c in group) + len(columns[0][0]) <= WIDTH:
            group.append(columns.pop(0))
        yield group


def _others(result: Result, tier: int, shown: np.ndarray) -> Iterator[str]:
    """Yield x by the other tiers with its errors where amplitudes are few and all shown, else the largest error of each."""
    others = [
        (str(name), k) for k, name in enumerate(result["tier"].values) if k != tier
    ]
    x, places = result["x"], _decimals(result)
    if not others:
        return
    wide = places + 12
    few = len(shown) == len(result["amplitude"].values) <= COMPARED
    if (
        not few
        or 9 + wide * len(others) > WIDTH
        or "x" in result.attributes["zero_by_symmetry"]
    ):
        errors = (f"{name} {x.error[k].max(initial=0.0):.1e}" for name, k in others)
        yield f"other tiers, largest error ({x.unit}): {', '.join(errors)}"
        return
    yield "x by tier" + "".join(f"{name:>{wide}}" for name, _ in others)
    for row in shown:
        values, errors = np.round(x.values[:, row], places) + 0.0, x.error[:, row]
        cells = (f"{values[k]:.{places}f} +-{errors[k]:.0e}" for _, k in others)
        yield f"{result['amplitude'].values[row]:9.6g}" + "".join(
            f"{cell:>{wide}}" for cell in cells
        )


def _amplitude(result: Result) -> str:
    return re.sub(r"[$\\]", "", result["amplitude"].label)


def full(result: Result, title: str = "") -> str:
    """Return x, y, heading and net distance per cycle by tier, each with its error in its own unit. title: the beginning of
    lines, by default the scene's name."""
    facts, title = result.attributes, title or in_line(result.attributes["name"])
    lines = [f"{title}: {facts['note']}"] if "note" in facts else []
    for variable, headline, by, places in _blocks(result):
        lines += [f"{title}: {headline}", *_block(result, variable, by, places)]
    if "medium_error_rule" in result:
        rules = sorted({*result["medium_error_rule"].values.tolist()})
        lines.append(
            f"medium: one standard deviation by its covariance, carried on by {' and '.join(rules)} propagation"
        )
        if any("  mean " in line for line in lines):
            lines.append(
                "mean: how far the mean over the media of that covariance lies from the displacement in their mean"
            )
    every = np.arange(len(result["amplitude"].values))
    lines += [
        *_surfaces(result),
        *_effort(result, range(len(result["tier"].values)), every),
    ]
    lines.append(
        f"amplitude: {_amplitude(result)}; x, y, heading: the pose after a cycle, in the frame at its start"
    )
    lines += zero_words(facts["zero_by_symmetry"])
    if "estimate_is" in facts:
        lines.append(f"estimated error: {facts['estimate_is']}")
    return "\n".join([*lines, _times(facts), ""])


def _blocks(result: Result) -> Iterator[tuple[Variable, str, float, int]]:
    """Yield (variable, headline, factor, decimals) of the parts of a table, each of one unit; the last digit of a length is a
    millionth of the body's."""
    facts, unit = result.attributes, result["x"].unit
    length, decimals = facts["body_length"], _decimals(result)
    per_cycle = f"displacement per cycle ({unit}) +- estimated error"
    yield (
        result["net_distance"],
        f"{per_cycle}: net distance, sqrt(x^2 + y^2)",
        1.0,
        decimals,
    )
    yield result["x"], f"{per_cycle}: x", 1.0, decimals
    yield result["y"], f"{per_cycle}: y", 1.0, decimals
    yield result["heading"], "heading gained (rad) +- estimated error", 1.0, 6
    if (f := facts.get("frequency")) is not None:
        speed = lambda u: (
            f"speed ({u}/s) at {f:g} Hz +- estimated error: net distance times frequency"
        )
        if unit != "BL":
            yield result["net_distance"], speed(unit), f, decimals
        yield result["net_distance"], speed("BL"), f / length, 6


def _decimals(result: Result) -> int:
    """Return the decimals of lengths, of which the last is about a millionth of the body's."""
    return 6 - min(0, math.floor(math.log10(result.attributes["body_length"]) + 1e-9))


def _block(result: Result, variable: Variable, by: float, places: int) -> Iterator[str]:
    """Yield a head and a row an amplitude, a column a tier."""
    uncertain = variable.spread is not None
    yield (
        "amplitude"
        + "".join(f"{m:>{places + 15}}" for m in result["tier"].values)
        + "     medium" * uncertain
    )
    values, errors = (
        np.round(by * variable.values, places) + 0.0,
        by * variable.error,
    )  # no -0.000
    shifts = _shifts(result, variable) if uncertain else {}
    for k, amplitude in enumerate(result["amplitude"].values):
        row = "".join(
            f"{x:{places + 6}.{places}f} +-{e:7.1e}"
            for x, e in zip(values[:, k], errors[:, k])
        )
        medium = f"  +-{by * variable.spread[0, k]:7.1e}" if uncertain else ""
        yield f"{amplitude:9.6g}{row}{medium}" + (
            f"  mean {by * shifts[k]:+.1e}" if k in shifts else ""
        )


def _shifts(result: Result, variable: Variable) -> dict[int, float]:
    """Return, by the numbers of amplitudes at which it matters, how far an uncertain medium shifts the mean of a quantity."""
    least = uncertainty.SEEN * (
        1.0 if variable.unit == "rad" else result.attributes["body_length"]
    )
    shift = result["medium_shift"].values[tables.QUANTITIES.index(variable.name)]
    both = zip(shift.tolist(), variable.spread[0].tolist())
    return {
        k: x
        for k, (x, sd) in enumerate(both)
        if abs(x) > max(uncertainty.SHIFTED * sd, least)
    }


def _surfaces(result: Result) -> Iterator[str]:
    """Yield how far tiers depend on the surface that a loop of three and more joints spans."""
    if tables.SURFACE[0] not in result:
        return
    positions, headings = (result[name] for name in tables.SURFACE)
    for k, tier in enumerate(result["tier"].values):
        if np.isnan(positions.values[k]).any():
            continue
        yield f"{tier}: over a cone from the loop's mean shape; other surfaces that it spans differ by, which is in the error,"
        yield f"amplitude position ({positions.unit})  heading (rad)"
        rows = zip(result["amplitude"].values, positions.values[k], headings.values[k])
        yield from (f"{a:9.6g} {x:13.1e} {t:14.1e}" for a, x, t in rows)


def _effort(result: Result, tiers: Sequence[int], shown: np.ndarray) -> Iterator[str]:
    """Yield path length and work, and the cost of transport by tier, at some of the amplitudes, if the result has them; none of
    these that does not exist."""
    if "work" not in result:
        return
    names = result["tier"].values
    columns = [
        (f"{v.name.replace('_', ' ')} ({v.unit})", v.values, ".6f")
        for v in (result["path_length"], result["work"])
    ]
    columns += [
        (str(names[t]), result["cost_of_transport"].values[t], ".4g") for t in tiers
    ]
    columns = [x for x in columns if np.isfinite(x[1]).any()]
    of_tiers = (
        ""
        if np.isnan(result["work"].values).all()
        else ", cost of transport by tier (drag: the body's along itself)"
    )
    yield f"effort per cycle{of_tiers}"
    wide = [max(10, len(head)) + 2 for head, *_ in columns]
    yield "amplitude" + "".join(f"{head:>{w}}" for (head, *_), w in zip(columns, wide))
    for k in shown:
        cells = (
            format(x[k], form) if np.isfinite(x[k]) else "-" for _, x, form in columns
        )
        yield f"{result['amplitude'].values[k]:9.6g}" + "".join(
            f"{cell:>{w}}" for cell, w in zip(cells, wide)
        )


def _times(facts: Any) -> str:
    """Return the seconds that tables took to build and tiers to look up, in words."""
    stored = facts.get("kept", ())
    times = [
        f"{name} {took:.3g}{' (built before)' * (name in stored)}"
        for name, took in facts["seconds"].items()
    ]
    return f"seconds: {', '.join(times)}{' with the search for it' * ('tier' in facts)}"
