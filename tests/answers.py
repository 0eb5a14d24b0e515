"""Numbers of answers: all variables of every kind of result, kept in data/answers.json.

    python tests/answers.py            which numbers are not as recorded
    python tests/answers.py --write    records them

A result is taken where a command prints it. Recorded is a digest of every variable, with
its error and its spread, and of everything that the command prints as JSON. It was first
recorded before results had one vocabulary: `RENAMED` leads from names of that time to
those of today, and what was printed under other names is looked for by its numbers.
"""

from __future__ import annotations

import contextlib
import json
import pathlib
import shlex
import sys
from unittest import mock

import frozen
import numpy as np

FILE = pathlib.Path(__file__).parent / "data" / "answers.json"
TOLERANCE = 1e-12  # relative, of the largest number of a digest
LOOSE = 1e-8  # of errors, which contain the residual of a balance, and of walks
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
    "accuracy": ["accuracy leg.toml -o out", "accuracy plain.toml -o out"],
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


def results(line: str) -> list:
    """Return the results that a command prints, in a copy of data/frozen."""
    from geomech.commands import pipeline

    found: list = []

    def keep(result, *rest, print_=pipeline._print):
        found.append(result)
        print_(result, *rest)

    places = [mock.patch.object(pipeline, "_print", keep)]
    with contextlib.ExitStack() as stack:
        here = stack.enter_context(frozen.place())
        (here / "uncertain.toml").write_text(uncertain())
        for place in places:
            stack.enter_context(place)
        code, _, err = frozen.geomech(*shlex.split(line))
        assert code == "0", f"{line}: {code} {err}"
    return found


def uncertain() -> str:
    return (pathlib.Path(__file__).parent / "data" / "uncertain.toml").read_text()


def of_result(result) -> dict:
    """Return the digests of a result's variables, and of what is printed as JSON."""
    from geomech import text

    variables = {}
    for v in result.variables:
        for ending in ("", "_error", "_spread"):
            values = getattr(v, ending.removeprefix("_") or "values")
            if values is not None:
                variables[v.name + ending] = digest(values)
    try:
        told = text.numbers(result)
    except AttributeError:  # a kind without JSON
        told = {}
    return {"variables": variables, "json": dict(flat("", told))}


def compute() -> dict:
    return {
        line: [of_result(result) for result in results(line)]
        for lines in CASES.values()
        for line in lines
    }


if __name__ == "__main__":
    new = compute()
    if "--write" in sys.argv[1:]:
        FILE.write_text(
            json.dumps(new, indent=0).replace(",\n", ", ").replace('], "', '],\n"')
        )
    print(
        {
            line: [(len(r["variables"]), len(r["json"])) for r in x]
            for line, x in new.items()
        }
    )
