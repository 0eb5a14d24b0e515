"""Thousands of mutated scenes: every one is run, or refused with one clear line."""

import functools
import re

import numpy as np
import pytest

from geomech import scenes
from geomech.studies.scene_tables import SceneTables

pytestmark = [
    pytest.mark.usefixtures("fastest"),
    pytest.mark.filterwarnings("ignore::geomech.core.errors.UnitWarning"),
]

VALUES = [
    "nan", "inf", "-inf", "0", "-0.0", "-1", "1e308", "-1e308", "1e-320", "1e6", "999999999999999999999999", "true",
    '""', '"x"', '"mean"', '"link-2"', '"circle"', '"granular"', "[]", "[[]]", "[1]", "[1, 2, 3, 4]", "[[1, 2], [3]]",
    "[[0, 0], [1, 0], [0, 1]]", "{}", "{ a = 1 }", "1979-05-27", "'''\nx'''", "[nan, 1, 1]", "[1, 1e-320, 1]",
    "0xff", "3",
]  # fmt: skip
KEYS = [
    "C", "gamma0", "gamma0_deg", "ratio", "lengths", "length", "frame", "amplitude", "centre", "centre_deg", "tilt",
    "travel", "mass", "frequency", "drag", "along", "slope", "weakening", "radius", "depth", "strength", "reference",
    "points", "cos", "sin", "semi_axes", "reverse", "grid", "phases", "law", "name", "kind", "loads", "zzz", "é",
]  # fmt: skip
EFFECTS = [
    'kind = "transient"\ntravel = 0.05', 'kind = "disturbed-ground"\nradius = 0.05\nweakening = 0.2',
    'kind = "depth-profile"\nslope = 0.1\nalong = [1, 2]', 'kind = "grain-inertia"\nfrequency = 2\nlength = 0.1\ndepth = 0.05',
    'kind = "body-inertia"\nmass = 0.1\nfrequency = 1\nlength = 0.2\ndrag = 2', 'kind = "end-caps"\nradius = 0.05',
    'kind = "skin-friction"\nforward = 0.1',
]  # fmt: skip
TABLES = ["[medium]", "[body]", "[gait]", "[numerics]", "[[medium]]", "[x]", "[", "]"]


@functools.cache
def text_of(name):
    return scenes.load(name).text


def with_effects(text, rng):
    """The text, half of the time with one or two effects more."""
    more = (
        rng.choice(EFFECTS, rng.integers(3), replace=False) if rng.integers(2) else []
    )
    return "\n[[effects]]\n".join([text, *more])


def mutated(text, rng, keys=KEYS, values=VALUES):
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    for _ in range(rng.integers(1, 3)):
        k = rng.integers(len(lines))
        match rng.integers(9):
            case 0 if len(lines) > 1:
                del lines[k]
            case 1:
                lines.insert(k, lines[rng.integers(len(lines))])
            case 2 if "=" in lines[k]:
                lines[k] = (
                    lines[k].split("=")[0] + "= " + values[rng.integers(len(values))]
                )
            case 3 if "=" in lines[k]:
                lines[k] = (
                    keys[rng.integers(len(keys))] + " =" + lines[k].split("=", 1)[1]
                )
            case 4:
                lines.insert(
                    k,
                    keys[rng.integers(len(keys))]
                    + " = "
                    + values[rng.integers(len(values))],
                )
            case 5 | 6 if "=" in lines[k]:
                lines[k] = re.sub(
                    r"\d+(\.\d+)?",
                    lambda _: f"{10 ** rng.uniform(-2, 1):.3g}",
                    lines[k],
                )
            case 7:
                lines[k] = TABLES[rng.integers(len(TABLES))]
            case _:
                cut = rng.integers(len(lines[k]) + 1)
                lines[k] = lines[k][:cut] + chr(rng.integers(32, 900)) + lines[k][cut:]
    return "\n".join(lines)


def outcome(text):
    """'run', 'marched' or 'refused'; anything else raises."""
    try:
        read = scenes.parse(text)
        read = read.with_numerics(
            phases=max(16, 2 * read.gait.harmonics + 1), loads="exact"
        )
        if read.system.traits.steps:
            run = read.with_numerics(cycles=1).cycle(phases=8)
            assert np.isfinite(run.xi).all()
            return "marched"
        solution = read.system.solve(
            *read.gait.cycle(16 if read.gait.harmonics < 8 else 64)
        )
        assert (solution.status != "unconverged").all()
        assert np.isfinite(solution.xi).all()
        assert np.isfinite(SceneTables(read).poses("direct")).all()
        return "run"
    except ValueError as error:
        message = str(error)
        assert message and "\n" not in message and len(message) < 450
        return "refused"


@pytest.mark.parametrize("seed", range(4))
def test_mutated_scenes_are_run_or_refused(seed):
    rng, names = np.random.default_rng(seed), scenes.builtin_names()
    texts = [
        mutated(with_effects(text_of(names[rng.integers(len(names))]), rng), rng)
        for _ in range(500)
    ]
    seen = [outcome(text) for text in texts]
    assert seen.count("run") + seen.count("marched") > 30
    assert seen.count("marched") > 6
    assert seen.count("refused") > 250
