"""Net displacements per cycle as lines of plain text."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import Any

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.studies import tables, uncertainty

numbers = tables.table


def text(result: Result, title: str = "") -> str:
    """Return x, y, heading and net distance per cycle by tier, each with its error in its own unit. title: the beginning of
    lines, by default the scene's name."""
    facts, title = result.attributes, title or result.attributes["name"]
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
    lines += [*_surfaces(result), *_effort(result, title)]
    amplitude = re.sub(r"[$\\]", "", result["amplitude"].label)
    lines.append(f"amplitude: {amplitude}; x, y, heading: the pose after a cycle, in the frame at its start")
    if "estimate_is" in facts:
        lines.append(f"estimated error: {facts['estimate_is']}")
    return "\n".join([*lines, _times(facts), ""])


def _blocks(result: Result) -> Iterator[tuple[Variable, str, float, int]]:
    """Yield (variable, headline, factor, decimals) of the parts of a table, each of one unit; the last digit of a length is a
    millionth of the body's."""
    facts, unit = result.attributes, result["x"].unit
    length = facts["body_length"]
    decimals = 6 - min(0, math.floor(math.log10(length) + 1e-9))
    per_cycle = f"displacement per cycle ({unit}) +- estimated error"
    yield result["net_distance"], f"{per_cycle}: net distance, sqrt(x^2 + y^2)", 1.0, decimals
    yield result["x"], f"{per_cycle}: x", 1.0, decimals
    yield result["y"], f"{per_cycle}: y", 1.0, decimals
    yield result["heading"], "heading gained (rad) +- estimated error", 1.0, 6
    if (f := facts.get("frequency")) is not None:
        speed = lambda u: f"speed ({u}/s) at {f:g} Hz +- estimated error: net distance times frequency"
        if unit != "BL":
            yield result["net_distance"], speed(unit), f, decimals
        yield result["net_distance"], speed("BL"), f / length, 6


def _block(result: Result, variable: Variable, by: float, places: int) -> Iterator[str]:
    """Yield a head and a row an amplitude, a column a tier."""
    uncertain = variable.spread is not None
    yield "amplitude" + "".join(f"{m:>{places + 15}}" for m in result["tier"].values) + "     medium" * uncertain
    values, errors = np.round(by * variable.values, places) + 0.0, by * variable.error  # no -0.000
    shifts = _shifts(result, variable) if uncertain else {}
    for k, amplitude in enumerate(result["amplitude"].values):
        row = "".join(f"{x:{places + 6}.{places}f} +-{e:7.1e}" for x, e in zip(values[:, k], errors[:, k]))
        medium = f"  +-{by * variable.spread[0, k]:7.1e}" if uncertain else ""
        yield f"{amplitude:9.6g}{row}{medium}" + (f"  mean {by * shifts[k]:+.1e}" if k in shifts else "")


def _shifts(result: Result, variable: Variable) -> dict[int, float]:
    """Return, by the numbers of amplitudes at which it matters, how far an uncertain medium shifts the mean of a quantity."""
    least = uncertainty.SEEN * (1.0 if variable.unit == "rad" else result.attributes["body_length"])
    shift = result["medium_shift"].values[tables.QUANTITIES.index(variable.name)]
    both = zip(shift.tolist(), variable.spread[0].tolist())
    return {k: x for k, (x, sd) in enumerate(both) if abs(x) > max(uncertainty.SHIFTED * sd, least)}


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


def _effort(result: Result, title: str) -> Iterator[str]:
    """Yield path length and work, and the cost of transport by tier, if the result has them."""
    if "work" not in result:
        return
    cell = lambda x, form: f"{format(x, form) if np.isfinite(x) else '-':>12}"
    yield f"{title}: path length and work of a cycle, and cost of transport: work over that of towing the body as far"
    yield "amplitude path length        work" + "".join(f"{m:>12}" for m in result["tier"].values)
    length, work, transport = (result[key].values for key in ("path_length", "work", "cost_of_transport"))
    for k, amplitude in enumerate(result["amplitude"].values):
        ratios = "".join(cell(x, ".4g") for x in transport[:, k])
        yield f"{amplitude:9.6g}{cell(length[k], '.6f')}{cell(work[k], '.6f')}{ratios}"
    with_unit = [result[key] for key in ("path_length", "work") if result[key].unit]
    yield "; ".join(f"{v.name.replace('_', ' ')}: {v.unit}" for v in with_unit)


def _times(facts: Any) -> str:
    """Return the seconds that tables took to build and tiers to look up, in words."""
    stored = facts.get("kept", ())
    times = [f"{name} {took:.3g}{' (built before)' * (name in stored)}" for name, took in facts["seconds"].items()]
    return f"seconds: {', '.join(times)}{' with the search for it' * ('tier' in facts)}"
