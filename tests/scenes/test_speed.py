"""A swimmer's frequency: said once, of the gait, and every displacement is a speed."""

import dataclasses

import numpy as np
import pytest
from registry import GAITS
from tabled import swept_table, tabled

from geomech import scenes
from geomech.mathematics.gaits import Circle
from geomech.studies.displacement.sweep import sweep
from geomech.studies.mechanics import undulation
from geomech.studies.scene_tables import SceneTables
from rft import BodyInertia, GrainInertia
from rft.core.refusal import Refusal

pytestmark = pytest.mark.usefixtures("fastest")

CHAIN = """[medium]
name = "glass-0.3mm-loose"
[body]
kind = "chain"
lengths = [1, 1.4, 0.8]
length = 0.3
frame = "link-1"
[gait]
kind = "ellipse"
centre = [0.3, -0.2]
frequency = 2.5
[numerics]
phases = 32
grid = 6
"""
TIMELESS = CHAIN.replace("frequency = 2.5", "")
PHYSICAL = "[physical]\nfrequency = 2.5\n"
GRAINS = '[[effects]]\nkind = "grain-inertia"\nlength = 0.3\ndepth = 0.05\n'
MASS = '[[effects]]\nkind = "body-inertia"\nlength = 0.3\nmass = 0.02\ndrag = 1.0\n'


@pytest.mark.parametrize("kind", GAITS)
def test_every_gait_may_have_one_and_moves_as_without(kind):
    gait = GAITS[kind]
    timed = dataclasses.replace(gait, frequency=3)
    assert gait.frequency is None and timed.frequency == 3.0 and timed != gait
    np.testing.assert_array_equal(gait.cycle(64), timed.cycle(64))


@pytest.mark.parametrize(
    "text",
    [
        CHAIN + GRAINS + MASS,
        TIMELESS + PHYSICAL + GRAINS + MASS,
        CHAIN + PHYSICAL + GRAINS + "frequency = 2.5\n" + MASS,
    ],
)
def test_the_gaits_frequency_is_that_of_effects_which_need_one(text):
    scene = scenes.parse(text)
    effects = (GrainInertia(2.5, 0.3, 0.05), BodyInertia(0.02, 2.5, 0.3, 1.0))
    assert scene.frequency == 2.5 and scene.system.effects == effects
    anew = scenes.tables(scene.changed(text=""))
    assert scenes.from_tables(anew, scene.name) == scene.changed(text="")


def test_a_frequency_may_be_of_the_swimmer_or_of_an_effect():
    assert scenes.parse(TIMELESS + PHYSICAL).frequency == 2.5
    own = scenes.parse(TIMELESS + GRAINS + "frequency = 2.5")
    assert (own.frequency, own.gait.frequency) == (2.5, None)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            CHAIN + "[physical]\nfrequency = 2",
            r"\[gait\] frequency = 2.5, but \[physical\] frequency = 2: keep one",
        ),
        (
            CHAIN + GRAINS + "frequency = 3",
            r"\[\[effects\]\] frequency = 3, but \[gait\] frequency = 2.5: keep one",
        ),
        (CHAIN.replace("2.5", "-1"), r"\[gait\] frequency must be a number from 0"),
    ],
)
def test_contradictions_are_named(text, said):
    with pytest.raises(Refusal, match=f"^.*{said}.*$"):
        scenes.parse(text)


def test_a_gait_from_python_has_the_frequency_of_the_scene():
    study = SceneTables(scenes.parse(CHAIN + GRAINS))
    said = r"\[gait\] frequency = 2, but the effects of the swimmer have 2.5"
    with pytest.raises(Refusal, match=said):
        study.displacements([0.5], ["direct"], Circle(frequency=2.0))
    table = tabled(study.displacements([0.5], ["direct"], Circle()))
    assert table["frequency"] == 2.5


def test_every_displacement_is_a_speed():
    table = SceneTables(scenes.parse(CHAIN)).displacements([0.5, 1.0], ["direct"])
    distance = table["net_distance"].values
    np.testing.assert_allclose(table["speed"].values, 2.5 * distance)
    body_lengths = table["speed_body_lengths"].values
    np.testing.assert_allclose(body_lengths, 2.5 * distance / 0.3)
    turning = table["turning_rate"].values
    np.testing.assert_allclose(turning, 2.5 * table["heading"].values)
    plain = SceneTables(scenes.parse(TIMELESS)).displacements([0.5, 1.0], ["direct"])
    assert "speed" not in plain
    np.testing.assert_array_equal(plain["net_distance"].values, distance)


@pytest.mark.parametrize("effects", ["", GRAINS])
def test_sweeps_give_it(effects):
    """Grains that are pushed aside notice it; without them fast and slow move alike."""
    frequencies = [1.0, 2.5, 4.0]
    scene = scenes.parse(CHAIN + effects)
    over = {"gait.amplitude": [0.5, 1.0], "gait.frequency": frequencies}
    found = swept_table(sweep(scene, over))
    moved = np.moveaxis(found["displacement"], -1, 0)
    assert (np.diff(moved[0]) != 0).all() == bool(effects)
    speed = np.hypot(moved[0], moved[1]) * frequencies
    np.testing.assert_allclose(found["speed"], speed)


def test_performance_speaks_the_scenes_own_unit():
    fish = scenes.load("sandfish-loose").with_numerics(phases=32)
    small = fish.changed(
        body=dataclasses.replace(fish.system.body, length=0.1),
        effects=tuple(effect.in_metres(0.1) for effect in fish.system.effects),
        gait=dataclasses.replace(fish.gait, frequency=3),
    )
    found = undulation.performance(small, [0.1, 0.22])
    net = small.cycle(amplitudes=[0.1, 0.22]).net
    distance = np.hypot(net[:, 0], net[:, 1])
    np.testing.assert_allclose(found["distance"], distance)
    np.testing.assert_allclose(found["speed"], 3 * distance)
    np.testing.assert_allclose(found["speed_body_lengths"], 30 * distance)
    per_second = found["velocity"] * [0.1, 0.1, 1.0] * 6 * np.pi
    np.testing.assert_allclose(found["velocity_per_second"], per_second)
