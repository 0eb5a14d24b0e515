"""Scenes: built-in ones run, bad ones are refused with one line that names the place
and the cure."""

import dataclasses
import math
import tracemalloc

import numpy as np
import pytest

import rft
from geomech import scenes
from geomech.mathematics.systems.base import length_unit
from geomech.studies.available import default_tiers
from rft import Chain, Granular
from rft.core.refusal import Refusal

pytestmark = pytest.mark.usefixtures("fastest")
GOOD = """
[medium]
law = "granular"
C = 1.8
gamma0_deg = 13.8

[body]
kind = "chain"
lengths = [1, 2, 1]
length = 0.4
frame = "link-2"

[gait]
kind = "ellipse"
semi_axes = [1.0, 0.5]
tilt_deg = 45

[numerics]
grid = 21
"""


@pytest.mark.parametrize(
    "section",
    [
        '[body]\nkind = "chain"',
        '[body]\nkind = "backbone"\nelements = 9',
        '[body]\nkind = "serpenoid"',
        '[system]\nkind = "no-slip-snake"',
        '[system]\nkind = "floating-chain"',
        '[system]\nkind = "ideal-fluid-swimmer"',
        '[system]\nkind = "differential-drive"',
    ],
)
def test_a_body_of_one_metre_is_no_body_without_a_length(section):
    wave = 'kind = "sine"\nelements = 9'
    gait = wave if "backbone" in section else 'kind = "circle"\namplitude = 0.3'
    medium = '[medium]\nlaw = "viscous"\n' if "[body]" in section else ""
    text = f"{medium}[gait]\n{gait}\n{section}\n"
    key = "track" if "drive" in section else "length"
    for size, unit in (("", "BL"), (f"{key} = 1.0", "m")):
        assert length_unit(scenes.parse(text + size).system) == unit


def test_every_key_arrives():
    read = scenes.parse(GOOD, "good")
    assert read.system.medium == Granular(1.8, math.radians(13.8))
    assert read.system.body == Chain((1, 2, 1), 0.4, "link-2")
    assert read.gait.tilt == pytest.approx(math.pi / 4)
    assert (read.numerics.grid, read.name) == (21, "good")


BAD = [  # beside those of tests/data/refusals.txt
    ("x = 1", "table: 'x' is unknown"),
    (GOOD.split("[gait]")[0], r"the table \[gait\] is missing"),
    ("gait = 3" + GOOD.split("[gait]")[0], "gait must be a table"),
    (
        GOOD + "[water]\nx = 1",
        "table: 'water' is unknown: use one of medium, body, contact, effects, system, gait",
    ),
    (
        GOOD.replace("C = 1.8", 'C = "big"'),
        r"\[medium\] Expected `float`, got `str` - at `.C`",
    ),
    (
        GOOD.replace("lengths = [1, 2, 1]", "lengths = [1, 2]"),
        r"ellipse moves 2 joints, but \[body\] has 1",
    ),
    (
        GOOD.replace("grid = 21", "grid = 3"),
        r"\[numerics\] grid must be a whole number",
    ),
    # Hard for whoever reads numbers or lists.
    (GOOD.replace("13.8", "1" + "0" * 400), r"\[medium\]"),
    (GOOD.replace("C = 1.8", "C = 1" + "0" * 5000), "is not TOML"),
    (GOOD.replace("C = 1.8", "C_deg = 1.8"), "'C_deg' is unknown"),
    (
        GOOD.replace("tilt_deg = 45", f"centre = [{'9.0, ' * 4000}]"),
        "centre must have 2",
    ),
]


@pytest.mark.parametrize(
    ("old", "new", "value"),
    [
        ("gamma0_deg = 13.8", "gamma0 = 0.24", lambda read: read.system.medium.gamma0),
        ("tilt_deg = 45", "centre = [0.24, 0]", lambda read: read.gait.centre[0]),
        ("C = 1.8", "C = 0.24", lambda read: read.system.medium.C),
    ],
)
def test_angles_may_be_in_radians(old, new, value):
    assert value(scenes.parse(GOOD.replace(old, new))) == 0.24


@pytest.mark.parametrize(("text", "said"), BAD)
def test_bad_scenes_are_refused_in_one_line(text, said):
    with pytest.raises(Refusal, match=f"^.*{said}.*$") as caught:
        scenes.parse(text)
    assert len(str(caught.value)) < 450


N = {"loads": "midpoint:3", "regularisation": 1e-2}


def test_numerics_reach_the_solver_and_the_work():
    """Loads and regularisation, in body velocities and what the body does."""
    scene = scenes.load("three-link-glass-close")
    scene = scene.with_numerics(phases=16, tolerance=1e-13, **N)
    alpha, alphadot = scene.gait.cycle(16, 1.3)
    given = scene.system.medium, scene.system.body, alpha, alphadot
    xi = rft.body_velocity(*given, tolerance=1e-13, **N).xi
    cycle = scene.cycle(amplitudes=1.3, work=True)
    np.testing.assert_allclose(cycle.xi, xi, atol=1e-12)
    moments = rft.work_done(*given, xi, **N).bending_moment
    np.testing.assert_allclose(cycle.work.bending_moment, moments, atol=1e-12)


def test_numerics_reach_marches():
    effects = (rft.BodyInertia(0.7, 0.5, 1.0, 1.3),)
    heavy = scenes.load("three-link-glass-close").changed(effects=effects)
    heavy = heavy.with_numerics(phases=16, tolerance=1e-13, cycles=2, **N)
    given = heavy.system.medium, heavy.system.body, *heavy.gait.cycle(16, 1.3)
    options = {"effects": effects, "cycles": 2, "tolerance": 1e-13}
    marched = rft.time_steps(*given, **options, **N)
    cycle = heavy.cycle(amplitudes=1.3)
    np.testing.assert_allclose(cycle.xi, marched.xi, atol=1e-12)


def test_four_links_have_an_area_tier():
    text = GOOD.split("[gait]")[0].replace("[1, 2, 1]", "[1, 1, 1, 1]")
    gait = 'kind = "fourier"\ncos = [[1.0], [0.5], [0.0]]\nsin = [[0.0], [0.5], [1.0]]'
    four = scenes.parse(f"{text}[gait]\n{gait}")
    assert default_tiers(four.system) == ("area", "path", "direct")


def test_a_large_field_converges_everywhere_in_little_memory():
    """61 x 61 x 16 samples of loose glass over +-2.8 rad: solved all at once they would
    take 190 MB."""
    axis = np.linspace(-2.8, 2.8, 61)
    alpha = np.stack(np.meshgrid(axis, axis, indexing="ij"), -1)[:, :, None]
    angle = np.pi * np.arange(16) / 16
    alphadot = np.stack([np.cos(angle), np.sin(angle)], -1)
    tracemalloc.start()
    solution = scenes.load("three-link-glass").system.solve(alpha, alphadot)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert solution.residual.max() < 1e-9
    assert most < 100e6


@pytest.mark.parametrize(
    "name", scenes.builtin_names() + scenes.intruder_names() + scenes.walker_names()
)
def test_a_scene_written_from_its_parts_reads_the_same(name):
    """Not from the text that it was read from; and its tables are a scene of the same
    parts."""
    scene = dataclasses.replace(scenes.load(name), text="")
    text = scenes.toml(scene)
    assert text != scenes.load(name).text and scenes.parse(text, name) == scene
    assert scenes.from_tables(scenes.tables(scenes.load(name)), name) == scene
