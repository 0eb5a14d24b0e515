"""Numbers of answers: all variables of every kind of result, kept in data/answers.json.

    python tests/tools/answers.py    tells which numbers are not as recorded

A result is taken where a command prints it. Recorded is a digest of every variable, with
its error and its spread, and of everything that the command prints as JSON. It was first
recorded before results had one vocabulary: `RENAMED` leads from names of that time to
those of today, and what was printed under other names is looked for by its numbers.
"""

from __future__ import annotations

import contextlib
import json
import pathlib
import re
import shlex
from unittest import mock

import frozen
import numpy as np

FILE = pathlib.Path(__file__).parents[1] / "data" / "answers.json"
TOLERANCE = 1e-12  # relative, of the largest number of a digest
SHORT = 40  # numbers of an array of which each is one by itself, too
SOME = 7  # numbers of a large array that are recorded as they are

CASES = {  # command lines in a copy of data/frozen, by kind
    "displacement": [
        "displacement three-link-glass --grid 9 --amplitudes 0.5,1.0",
        "displacement three-link-viscous --amplitudes 0.5,1 --effort --tiers path,direct",
        "displacement three-link-viscous --amplitudes 0.5,1.0 --tol 1e-3",
        "displacement snake.toml --amplitudes 1",
        "displacement uncertain.toml --amplitudes 0.5,1.0 --grid 9",
        "displacement four.toml --amplitudes 0.3 --grid 5",
    ],
    "ccf": ["ccf three-link-viscous --grid 9", "ccf four.toml --grid 5 --pair 1,3"],
    "connection": [
        "connection three-link-glass --grid 7 -o out.nc",
        "connection swim.toml --grid 5 -o out.nc",
        "connection three-link-viscous --grid 9 -o out.nc",
    ],
    "velocity": [
        "velocity three-link-glass --alpha 0.5,0.3 --alphadot 1,0",
        "velocity three-link-ideal-fluid --alpha 0.5,0.3 --alphadot 1,0",
    ],
    "sweep": [
        "sweep three-link-viscous --over medium.ratio=1.5:3:3"
        " --over gait.amplitude=0.5:1:2 -o out.nc",
        "sweep walk.toml --over gait.frequency=1,2 -o out.nc",
    ],
    "forces": ["forces seven-link-wave", "forces snake.toml",
        "forces swim.toml --radius 0.02 --stress 900 --frequency 2"],
    "optimize": [
        "optimize three-link-viscous --objective efficiency --harmonics 1",
        "optimize three-link-viscous --objective displacement --harmonics 1 --limits 1.2",
        "optimize three-link-viscous --objective speed --rate 1 --harmonics 1",
    ],
    "walk": ["walk walk.toml", "walk robot.toml"],
    "trajectory": ["trajectory swim.toml -o out.csv", "trajectory stepped.toml --cycles 1"],
    "stress": ["stress generic --beta 45 --gamma 45", "stress grains.toml --beta 30 --gamma -50"],
    "intrude": ["intrude leg.toml", "intrude wedge.toml", "intrude sphere"],
    "fit-medium": [
        "fit-medium short-rod-drag",
        "fit-medium short-rod-drag --end-caps fitted",
        "fit-medium plates.csv",
        "fit-medium push.csv",
    ],
    "fit-gait": [
        "fit-gait trial.csv --medium glass-0.3mm-close -o out.nc",
        "fit-gait log.csv --harmonics 1 -o out.nc",
    ],
    "accuracy": ["accuracy leg.toml", "accuracy plain.toml"],
    "run": ["run table.toml -o out"],
}  # fmt: skip


def digest(values) -> list:
    """Return a few numbers of an array that notice any change of it, behind its size."""
    flat = np.ravel(np.asarray(values))
    if flat.dtype.kind == "U":
        return [flat.size, " ".join(flat.tolist())]
    flat = np.where(np.isfinite(flat.astype(float)), flat.astype(float), -9.9e99)
    if flat.size > 2 * SOME:
        some = flat[np.linspace(0, flat.size - 1, SOME).astype(int)]
        mean = (flat * np.cos(1.0 + np.arange(flat.size))).mean()
        flat = np.array([*some, np.sqrt((flat**2).mean()), mean])
    return [np.size(values), *flat.tolist()]


def flat(name: str, told):
    """Yield (path, digest) of the lists of numbers, and the numbers, of plain data."""
    if isinstance(told, dict):
        for key, value in told.items():
            yield from flat(f"{name}.{key}" if name else str(key), value)
        return
    try:
        values = np.array(told, dtype=float)
    except (TypeError, ValueError):
        if isinstance(told, list):
            for k, value in enumerate(told):
                yield from flat(f"{name}[{k}]", value)
        return
    if values.size and not isinstance(told, bool):
        yield name, digest(values)


NUMBERS = ""  # in place of a name: looked for by its numbers
FITS = ("zeta", "zeta_error", "value_error", "interval", "law", "law_error")
RENAMED = {  # names of variables, by the first word of the command
    "connection": {"speed": "xi_rms"},
    "sweep": {"length": "body_length"},
    "trajectory": {"theta": "heading"},
    "optimize": {"theta": "heading"},
    "walk": {
        "aside": "lateral_speed",
        "aside_error": "lateral_speed_error",
        "turning": "yaw_rate",
        "turning_error": "yaw_rate_error",
    },
    "fit-medium": {
        **dict.fromkeys(FITS, NUMBERS),
        "coefficient": "parameter",
        "resolution": "share_from_data",
    },
    "fit-gait": {
        "length": "body_length",
        "length_error": "body_length_error",
        "quantity": None,
        "per_cycle": NUMBERS,
        "displacement_measured": NUMBERS,
        "displacement_measured_error": NUMBERS,
        "displacement_predicted": NUMBERS,
        "displacement_predicted_error": NUMBERS,
    },
}
NOTHING = [1, -9.9e99]  # digest of a null
# Numbers of JSON that are no numbers of a result: times, what the text of the scene says,
# and lists that are variables of text now.
LEFT_OUT = re.compile(r"seconds|residual|unit|gait\.|answers|evaluations|from_")


def results(line: str) -> list:
    """Return the results that a command prints, in a copy of data/frozen."""
    from geomech.shell import pipeline

    found: list = []

    def keep(result, *rest, printed=pipeline.printed):
        found.append(result)
        return printed(result, *rest)

    with contextlib.ExitStack() as stack:
        here = stack.enter_context(frozen.place())
        (here / "uncertain.toml").write_text(uncertain())
        (here / "out").mkdir()
        stack.enter_context(mock.patch.object(pipeline, "printed", keep))
        code, _, err = frozen.geomech(*shlex.split(line))
        assert code == "0", f"{line}: {code} {err}"
    return found


def uncertain() -> str:
    return (pathlib.Path(__file__).parents[1] / "data" / "uncertain.toml").read_text()


def of_result(result) -> dict:
    """Return the digests of a result's variables."""
    variables = {}
    for v in result.variables:
        for ending in ("", "_error", "_spread"):
            values = getattr(v, ending.removeprefix("_") or "values")
            if values is not None:
                variables[v.name + ending] = digest(values)
    return variables


def parts_of(result) -> list:
    """Return the digests of all variables of a result, and of all their rows, columns and
    components, as lists of plain data had them."""
    found = []
    arrays = [
        np.asarray(x) for x in result.attributes.values() if not isinstance(x, str)
    ]
    for v in result.variables:
        arrays += [x for x in (v.values, v.error, v.spread) if x is not None]
        if v.error is not None:
            arrays.append(np.stack([v.values - v.error, v.values + v.error], -1))
    arrays += stacked_cycles(result)
    if {"x", "y", "heading"} <= set(result):
        arrays.append(np.stack([result[q].values for q in ("x", "y", "heading")], -1))
        if result["x"].spread is not None:
            arrays.append(np.hypot(result["x"].spread, result["y"].spread))
    for array in arrays:
        found.append(digest(array))
        most = min(array.ndim, 3)
        if array.size <= SHORT:
            most = array.ndim + 1
        for lead in range(1, most):
            for place in np.ndindex(*array.shape[:lead]):
                found.append(digest(array[place]))
    return found


def stacked_cycles(result) -> list:
    """Return what is known of every cycle of a measured gait, and its poses with their
    errors and intervals, as one array each, as they were before."""
    names = ["x", "y", "heading"]
    if "quantity" in result:
        names = result["quantity"].values.tolist()
    found = []
    for ending in ("_per_cycle", "_per_cycle_predicted", "", "_predicted"):
        parts = [result[f"{x}{ending}"] for x in names if f"{x}{ending}" in result]
        if len(parts) != len(names) or "form" not in result.attributes:
            continue
        found.append(np.stack([part.values for part in parts], -1))
        if parts[0].error is not None:
            error = np.stack([part.error for part in parts], -1)
            found.append(error)
            found.append(np.stack([found[-2] - error, found[-2] + error], -1))
    return found


def is_same(old: list, new: list) -> bool:
    if old[0] != new[0] or len(old) != len(new):
        return False
    if isinstance(old[-1], str) or isinstance(new[-1], str):
        return old == new
    a, b = np.array(old[1:]), np.array(new[1:])
    return bool(np.abs(a - b).max(initial=0) <= TOLERANCE * np.abs(a).max(initial=1e-9))


def differences(line: str, old: dict, result) -> list[str]:
    """Return the numbers of a result that are not as recorded."""
    command, new = line.split()[0], of_result(result)
    renamed, wrong = RENAMED.get(command, {}), []
    found = parts_of(result)
    for name, numbers in old["variables"].items():
        today = renamed.get(name, name)
        if today is None:  # words that were renamed
            continue
        others = [new[today]] if today in new else []
        if today == NUMBERS:
            others = found
        if not any(is_same(numbers, other) for other in others):
            wrong.append(name)
    if hasattr(result, "question") and result.question is not None:
        for name, numbers in old["json"].items():
            if LEFT_OUT.search(name) or numbers == NOTHING:
                continue
            if not any(is_same(numbers, other) for other in found):
                wrong.append(f"JSON {name}")
    return wrong


if __name__ == "__main__":
    recorded = json.loads(FILE.read_text())
    for lines in CASES.values():
        for line in lines:
            pairs = zip(recorded[line], results(line))
            told = [differences(line, old, result) for old, result in pairs]
            print(line, told)
