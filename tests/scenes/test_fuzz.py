"""Thousands of mutated scenes: every one is run, or refused with one clear line."""

import collections
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
    "nan", "inf", "-inf", "0", "-0.0", "-1", "3", "0xff", "1e308", "-1e308", "1e-320",
    "1e6", "999999999999999999999999", "true", "1979-05-27", '""', '"x"', '"mean"',
    '"link-2"', '"circle"', '"granular"', "'''\nx'''", "{}", "{ a = 1 }",
    "[]", "[[]]", "[1]", "[1, 2, 3, 4]", "[[1, 2], [3]]", "[[0, 0], [1, 0], [0, 1]]",
    "[nan, 1, 1]", "[1, 1e-320, 1]",
]  # fmt: skip
KEYS = [
    "C", "gamma0", "gamma0_deg", "ratio", "lengths", "length", "frame", "amplitude",
    "centre", "centre_deg", "tilt", "travel", "mass", "frequency", "drag", "along",
    "slope", "weakening", "radius", "depth", "strength", "reference", "points", "cos",
    "sin", "semi_axes", "reverse", "grid", "phases", "law", "name", "kind", "loads",
    "zzz", "é",
]  # fmt: skip
EFFECTS = [
    'kind = "transient"\ntravel = 0.05',
    'kind = "disturbed-ground"\nradius = 0.05\nweakening = 0.2',
    'kind = "depth-profile"\nslope = 0.1\nalong = [1, 2]',
    'kind = "grain-inertia"\nfrequency = 2\nlength = 0.1\ndepth = 0.05',
    'kind = "body-inertia"\nmass = 0.1\nfrequency = 1\nlength = 0.2\ndrag = 2',
    'kind = "end-caps"\nradius = 0.05',
    'kind = "skin-friction"\nforward = 0.1',
]
TABLES = ["[medium]", "[body]", "[gait]", "[numerics]", "[[medium]]", "[x]", "[", "]"]
N_TEXTS = 500  # scenes for each seed


@functools.cache
def text_of(name):
    return scenes.load(name).text


def drawn(rng, some):
    """Return one of a list at random."""
    return some[rng.integers(len(some))]


def with_effects(text, rng):
    """Return the text, half of the time with one or two effects more."""
    more = []
    if rng.integers(2):
        more = rng.choice(EFFECTS, rng.integers(3), replace=False)
    return "\n[[effects]]\n".join([text, *more])


def mutated(text, rng, keys=KEYS, values=VALUES):
    """Return the text with one or two lines that are lost, doubled, new or wrong."""
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    for _ in range(rng.integers(1, 3)):
        k = rng.integers(len(lines))
        key, is_entry, value = lines[k].partition("=")
        match rng.integers(9):
            case 0 if len(lines) > 1:
                del lines[k]
            case 1:
                lines.insert(k, drawn(rng, lines))
            case 2 if is_entry:
                lines[k] = f"{key}= {drawn(rng, values)}"
            case 3 if is_entry:
                lines[k] = f"{drawn(rng, keys)} ={value}"
            case 4:
                lines.insert(k, f"{drawn(rng, keys)} = {drawn(rng, values)}")
            case 5 | 6 if is_entry:
                lines[k] = with_other_numbers(lines[k], rng)
            case 7:
                lines[k] = drawn(rng, TABLES)
            case _:
                cut = rng.integers(len(lines[k]) + 1)
                letter = chr(rng.integers(32, 900))
                lines[k] = lines[k][:cut] + letter + lines[k][cut:]
    return "\n".join(lines)


def with_other_numbers(line, rng):
    """Return a line with a random number between 0.01 and 10 in place of each."""
    return re.sub(r"\d+(\.\d+)?", lambda _: f"{10 ** rng.uniform(-2, 1):.3g}", line)


def outcome(text):
    """Return "run", "marched" or "refused"; anything else raises."""
    try:
        scene = scenes.parse(text)
        phases = max(16, 2 * scene.gait.harmonics + 1)
        scene = scene.with_numerics(phases=phases, loads="exact")
        if scene.system.traits.steps:
            march = scene.with_numerics(cycles=1).cycle(phases=8)
            assert np.isfinite(march.xi).all()
            return "marched"
        phases = 16 if scene.gait.harmonics < 8 else 64
        solution = scene.system.solve(*scene.gait.cycle(phases))
        assert (solution.status != "unconverged").all()
        assert np.isfinite(solution.xi).all()
        assert np.isfinite(SceneTables(scene).poses("direct")).all()
        return "run"
    except ValueError as error:
        message = str(error)
        assert message
        assert "\n" not in message
        assert len(message) < 450
        return "refused"


@pytest.mark.parametrize("seed", range(4))
def test_mutated_scenes_are_run_or_refused(seed):
    rng = np.random.default_rng(seed)
    names = scenes.builtin_names()
    seen = collections.Counter()
    for _ in range(N_TEXTS):
        text = with_effects(text_of(drawn(rng, names)), rng)
        seen[outcome(mutated(text, rng))] += 1
    assert seen["run"] + seen["marched"] > 30
    assert seen["marched"] > 6
    assert seen["refused"] > 250
