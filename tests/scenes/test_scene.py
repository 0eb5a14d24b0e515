"""Scenes: built-in ones run, bad ones are refused with one line that names the place and the cure."""

import dataclasses
import math
import tracemalloc

import numpy as np
import pytest
from tabled import tabled

import rft
from geomech import scenes
from geomech.mathematics.systems.base import as_system, length_unit
from geomech.studies.available import default_tiers
from geomech.studies.scene_tables import SceneTables
from rft import Chain, Granular, Viscous
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
    ("section", "key"),
    [('[body]\nkind = "chain"', "length"), ('[body]\nkind = "backbone"', "length"), ('[body]\nkind = "serpenoid"', "length")]
    + [(f'[system]\nkind = "{kind}"', "length") for kind in ("no-slip-snake", "floating-chain", "ideal-fluid-swimmer")]
    + [('[system]\nkind = "differential-drive"', "track")],
)  # fmt: skip
def test_a_body_of_one_metre_is_no_body_without_a_length(section, key):
    gait = '[gait]\nkind = "circle"\namplitude = 0.3\n'
    if "backbone" in section:
        section, gait = (
            section + "\nelements = 9",
            '[gait]\nkind = "sine"\nelements = 9\n',
        )
    medium = '[medium]\nlaw = "viscous"\n' if "[body]" in section else ""
    units = [
        length_unit(scenes.parse(medium + gait + section + size).system)
        for size in ("", f"\n{key} = 1.0", f"\n{key} = 2.0")
    ]
    assert units == ["BL", "m", "m"]


def test_a_class_of_ones_own_is_in_metres_where_it_has_a_length():
    class Wheel:
        joints = 1

        def velocity(self, alpha, alphadot):
            return alphadot[..., :1] * [1.0, 0.0, 0.0]

    assert length_unit(as_system(Wheel())) == "BL"
    Wheel.length = 1.0
    assert length_unit(as_system(Wheel())) == "m"


@pytest.mark.parametrize(
    "name", ["three-link-glass", "three-link-viscous", "shovel-nosed-snake"]
)
def test_a_study_has_every_tier_its_errors_and_times(name):
    """Numbers of the scenes are pinned in test_builtin_scenes.py; a study's are those of `displacement`, tier by tier."""
    loaded = scenes.load(name).with_numerics(grid=11, phases=64)
    study, amplitudes = SceneTables(loaded), [0.1, 0.3]
    table = tabled(study.displacements(amplitudes))
    assert set(default_tiers(loaded.system)) <= set(table)
    assert table["amplitude"] == amplitudes
    for tier in default_tiers(loaded.system):
        np.testing.assert_allclose(
            table[tier], study.poses(tier, None, amplitudes), atol=1e-9
        )
        assert len(table["estimate"][tier]) == 2
        assert min(table["estimate"][tier]) > 0
    looked_up = [
        plan.table.name
        for plan in map(study.plan, default_tiers(loaded.system))
        if plan.table
    ]
    tables = {"field"} if "connection" in looked_up else set()
    tables |= {"harmonic table"} if name == "three-link-glass" else set()
    assert set(table["seconds"]) == {*default_tiers(loaded.system)} | tables
    again = tabled(study.displacements(amplitudes))
    assert table["kept"] == [] and set(again["kept"]) == tables
    assert {k: table["seconds"][k] for k in tables} == {
        k: again["seconds"][k] for k in tables
    }  # what building took
    assert all(v >= 0 for v in table["seconds"].values())


def test_every_key_arrives():
    read = scenes.parse(GOOD, "good")
    assert read.system.medium == Granular(1.8, math.radians(13.8))
    assert read.system.body == Chain((1, 2, 1), 0.4, "link-2")
    assert read.gait.tilt == pytest.approx(math.pi / 4)
    assert (read.numerics.grid, read.name, length_unit(read.system)) == (
        21,
        "good",
        "m",
    )
    assert (
        scenes.parse(
            GOOD.replace("gamma0_deg = 13.8", "gamma0 = 0.24")
        ).system.medium.gamma0
        == 0.24
    )
    assert (
        scenes.parse(GOOD.replace("C = 1.8", "C = 1.8\nk = 3")).system.medium.k == 3.0
    )
    assert scenes.parse(
        GOOD.replace("tilt_deg = 45", "centre_deg = [90, 0]")
    ).gait.centre[0] == pytest.approx(math.pi / 2)
    assert scenes.load("three-link-viscous").system.medium == Viscous(2.0)


BAD = [
    ("[medium", "scene is not TOML"),
    (
        GOOD + "[water]\nx = 1",
        "table: 'water' is unknown: use one of medium, body, effects, system, gait",
    ),
    (GOOD.replace("[gait]", "[giat]"), "table: 'giat' is unknown: did you mean 'gait'"),
    ("x = 1", "table: 'x' is unknown"),
    (GOOD.split("[gait]")[0], r"the table \[gait\] is missing"),
    ("gait = 3" + GOOD.split("[gait]")[0], r"gait must be a table"),
    (
        GOOD.replace('law = "granular"', 'law = "granluar"'),
        r"\[medium\] law: 'granluar' is unknown: did you mean 'granular'",
    ),
    (GOOD.replace('law = "granular"', ""), r"\[medium\] has no 'law'"),
    (
        GOOD.replace('law = "granular"', 'name = "glass"'),
        r"'C' is unknown: use one of name \(no 'law'\)",
    ),
    (
        GOOD.replace("C = 1.8", "c = 1.8"),
        r"\[medium\] key: 'c' is unknown: use one of C, gamma0",
    ),
    (GOOD.replace("C = 1.8", ""), r"\[medium\] has no `C`: add C = "),
    (
        GOOD.replace("C = 1.8", 'C = "big"'),
        r"\[medium\] Expected `float`, got `str` - at `.C`",
    ),
    (GOOD.replace("C = 1.8", "C = nan"), r"\[medium\] C must be a number from 0"),
    (
        GOOD.replace("gamma0_deg = 13.8", "gamma0_deg = 90"),
        "gamma0 must lie between 0 and 90 degrees, got 90 degrees",
    ),
    (
        GOOD.replace("gamma0_deg = 13.8", "gamma0_deg = 13.8\ngamma0 = 0.2"),
        "gamma0 is given twice",
    ),
    (
        GOOD.replace("lengths = [1, 2, 1]", "lengths = [1, -2, 1]"),
        r"\[body\] lengths must all be finite and > 0",
    ),
    (
        GOOD.replace("lengths = [1, 2, 1]", "lengths = [1, 2]"),
        r"ellipse moves 2 joints but \[body\] has 1",
    ),
    (
        GOOD.replace("length = 0.4", "lenght = 0.4"),
        "'lenght' is unknown: did you mean 'length",
    ),
    (
        GOOD.replace("link-2", "link-9"),
        "frame must be 'mean' or 'link-1' ... 'link-3', got 'link-9'",
    ),
    (
        GOOD.replace("tilt_deg = 45", "tilt_deg = inf"),
        r"\[gait\] tilt must be a number",
    ),
    (
        GOOD.replace("grid = 21", "grid = 3"),
        r"\[numerics\] grid must be a whole number from 4",
    ),
    (GOOD.replace("grid = 21", 'loads = "simpson"'), r"\[numerics\] loads must be"),
    (
        GOOD.replace("grid = 21", "regularisation = 0"),
        "regularisation must be a number from 1e-12 to 1 body lengths per rad, got 0",
    ),
]


BAD += [
    (GOOD.replace("gamma0_deg = 13.8", "gamma0_deg = 1" + "0" * 400), r"\[medium\]"),
    (GOOD.replace("C = 1.8", "C = 1" + "0" * 5000), "is not TOML"),
    (GOOD.replace("C = 1.8", "C_deg = 1.8"), "'C_deg' is unknown"),
    (
        GOOD.replace("grid = 21", "extent = 5e-324"),
        "extent must be a number from 1e-06",
    ),
    (GOOD.replace("grid = 21", "directions = 1"), r"\[numerics\] directions must be"),
    (
        GOOD.replace("tilt_deg = 45", "centre = [" + "9.0, " * 4000 + "]"),
        "centre must have 2 angles",
    ),
    (
        GOOD.replace("tilt_deg = 45", "amplitude = 1e308"),
        "amplitude must be a number from",
    ),
]


@pytest.mark.parametrize(("text", "said"), BAD)
def test_bad_scenes_are_refused_in_one_line(text, said):
    with pytest.raises(Refusal, match=said) as caught:
        scenes.parse(text)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 450


def test_unknown_names_and_files():
    with pytest.raises(Refusal, match="did you mean 'three-link-glass'"):
        scenes.load("three-link-glas")
    with pytest.raises(Refusal, match="cannot read scene 'nowhere.toml': No such file"):
        scenes.load("nowhere.toml")


def test_numerics_reach_the_solver_and_the_work():
    """Loads and regularisation are the scene's, in body velocities, marches and what the body does."""
    n = {"loads": "midpoint:3", "regularisation": 1e-2}
    scene = scenes.load("three-link-glass-close").with_numerics(
        phases=16, tolerance=1e-13, **n
    )
    alpha, alphadot = scene.gait.cycle(16, 1.3)
    given = scene.system.medium, scene.system.body, alpha, alphadot
    wanted = rft.body_velocity(*given, tolerance=1e-13, **n)
    found = scene.system.solve(alpha, alphadot)
    np.testing.assert_allclose(found.xi, wanted.xi, atol=1e-13)
    default = scenes.load("three-link-glass-close").system.velocity(alpha, alphadot)
    assert np.abs(default - wanted.xi).max() > 1e-3
    moments = rft.work_done(*given, wanted.xi, **n)
    for got, want in zip(scene.system.work(alpha, alphadot, wanted.xi), moments):
        np.testing.assert_allclose(got, want, rtol=1e-12)
    for other in ({"loads": n["loads"]}, {"regularisation": n["regularisation"]}):
        assert (
            np.abs(
                rft.work_done(*given, wanted.xi, **other).bending_moment
                - moments.bending_moment
            ).max()
            > 1e-4
        )
    cycle = scene.cycle(amplitudes=1.3, work=True)
    np.testing.assert_allclose(
        cycle.work.bending_moment, moments.bending_moment, atol=1e-12
    )
    heavy = scene.changed(effects=(rft.BodyInertia(0.7, 0.5, 1.0, 1.3),)).with_numerics(
        cycles=2
    )
    marched = rft.time_steps(
        *given,
        effects=heavy.system.effects,
        cycles=2,
        tolerance=1e-13,
        with_work=True,
        **n,
    )
    cycle = heavy.cycle(amplitudes=1.3, work=True)
    np.testing.assert_allclose(cycle.xi, marched.xi, atol=1e-12)
    np.testing.assert_allclose(cycle.net, marched.displacement, atol=1e-12)
    np.testing.assert_allclose(
        cycle.work.bending_moment, marched.work.bending_moment, atol=1e-12
    )


def test_the_path_of_a_linear_medium_needs_no_field():
    viscous = scenes.load("three-link-viscous")
    table = tabled(SceneTables(viscous).displacements([1.0], ["path", "direct"]))
    assert "field" not in table["seconds"]
    assert math.hypot(*table["path"][0][:2]) == pytest.approx(0.0512808243, abs=5e-11)
    assert table["path"] == table["direct"]


def test_four_links_have_an_area_tier_and_two_have_none():
    text = GOOD.replace("[1, 2, 1]", "[1, 1, 1, 1]").split("[gait]")[0]
    four = scenes.parse(
        text
        + '[gait]\nkind = "fourier"\ncos = [[1.0], [0.5], [0.0]]\nsin = [[0.0], [0.5], [1.0]]'
    )
    assert default_tiers(four.system) == ("area", "path", "direct")
    assert np.isfinite(SceneTables(four).poses("direct")).all()
    two = scenes.parse(
        text.replace("[1, 1, 1, 1]", "[1, 1]") + '[gait]\nkind = "wave"\njoints = 1\n'
    )
    with pytest.raises(Refusal, match="the area tier takes two joints and more"):
        SceneTables(two).poses("area")


def test_loose_glass_circles():
    """Displacement per cycle on circles of 0.5, 1 and 1.75 rad, an independent computation's three digits."""
    got = SceneTables(scenes.load("three-link-glass")).poses(
        "direct", amplitudes=np.array([0.5, 1.0, 1.75])
    )
    np.testing.assert_allclose(
        np.hypot(got[:, 0], got[:, 1]), [0.0121, 0.0638, 0.1378], rtol=0.01
    )


def test_a_large_field_converges_everywhere_in_little_memory():
    """61 x 61 x 16 samples of loose glass over +-2.8 rad: solved all at once they would take 190 MB."""
    glass, axis = scenes.load("three-link-glass"), np.linspace(-2.8, 2.8, 61)
    alpha = np.stack(np.meshgrid(axis, axis, indexing="ij"), -1)[:, :, None]
    angle = np.pi * np.arange(16) / 16
    tracemalloc.start()
    try:
        solution = glass.system.solve(
            alpha, np.stack([np.cos(angle), np.sin(angle)], -1)
        )
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert solution.residual.max() < 1e-9
    assert not (solution.status == "unconverged").any()
    assert most < 100e6


@pytest.mark.parametrize(
    "name", scenes.builtin_names() + scenes.intruder_names() + scenes.walker_names()
)
def test_a_scene_written_from_its_parts_reads_the_same(name):
    """Not from the text that it was read from; and its tables are a scene of the same parts."""
    scene = dataclasses.replace(scenes.load(name), text="")
    text = scenes.toml(scene)
    assert text != scenes.load(name).text and scenes.parse(text, name) == scene
    assert scenes.from_tables(scenes.tables(scenes.load(name)), name) == scene
