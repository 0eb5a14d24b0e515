"""A swimmer's frequency: said once, of the gait, and every displacement is a speed."""

import dataclasses
import json
from unittest import mock

import numpy as np
import pytest
import xarray
from commands import geomech
from registry import GAITS
from tabled import swept_table, tabled

from geomech import scenes
from geomech.io.results import from_dict
from geomech.mathematics.gaits import Circle
from geomech.mathematics.systems import Swimmer
from geomech.studies import report
from geomech.studies.displacement import sweep
from geomech.studies.displacement.choose import cheapest_displacements
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
GRAINS = '[[effects]]\nkind = "grain-inertia"\nlength = 0.3\ndepth = 0.05\n'
MASS = '[[effects]]\nkind = "body-inertia"\nlength = 0.3\nmass = 0.02\ndrag = 1.0\n'


@pytest.mark.parametrize("kind", GAITS)
def test_every_gait_may_have_one_and_moves_as_without(kind):
    gait = GAITS[kind]
    timed = dataclasses.replace(gait, frequency=3)
    assert gait.frequency is None and timed.frequency == 3.0 and timed != gait
    for a, b in zip(gait.cycle(64), timed.cycle(64)):
        np.testing.assert_array_equal(a, b)


def test_the_gaits_frequency_is_that_of_effects_which_need_one():
    scene = scenes.parse(CHAIN + GRAINS + MASS)
    assert scene.frequency == 2.5 == scene.gait.frequency
    assert scene.system.effects == (
        GrainInertia(2.5, 0.3, 0.05),
        BodyInertia(0.02, 2.5, 0.3, 1.0),
    )
    shared = CHAIN.replace("frequency = 2.5", "") + "[physical]\nfrequency = 2.5\n"
    assert scenes.parse(shared + GRAINS + MASS) == scene
    assert (
        scenes.parse(shared).frequency == 2.5
    )  # of a swimmer whose forces do not know it
    assert scenes.parse(
        CHAIN
        + "[physical]\nfrequency = 2.5\n"
        + GRAINS.replace("depth", "frequency = 2.5\ndepth")
    )
    own = scenes.parse(
        CHAIN.replace("frequency = 2.5", "")
        + GRAINS.replace("depth", "frequency = 2.5\ndepth")
    )
    assert (own.frequency, own.gait.frequency) == (2.5, None)
    anew = scenes.tables(scene.changed(text=""))
    assert anew["gait"]["frequency"] == 2.5 and not any(
        "frequency" in e for e in anew["effects"]
    )
    assert scenes.from_tables(anew, scene.name) == scene.changed(text="")


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
        (
            CHAIN.replace("2.5", "-1"),
            r"\[gait\] frequency must be a number from 0 to 10000 Hz, got -1",
        ),
        (
            CHAIN.replace("2.5", '"fast"'),
            r"\[gait\] Expected `float \| null`, got `str`",
        ),
        (CHAIN.replace("2.5", "nan"), r"\[gait\] frequency must be a number"),
    ],
)
def test_contradictions_are_named(text, said):
    with pytest.raises(Refusal, match=said) as caught:
        scenes.parse(text)
    assert "\n" not in str(caught.value)


def test_from_python_too():
    scene = scenes.parse(CHAIN + GRAINS)
    for contradict in (
        lambda: scene.changed(gait=Circle(frequency=2.0)),
        lambda: tabled(
            SceneTables(scene).displacements([0.5], ["direct"], Circle(frequency=2.0))
        ),
    ):
        with pytest.raises(
            Refusal,
            match=r"\[gait\] frequency = 2, but the effects of the swimmer have 2.5",
        ):
            contradict()
    assert (
        tabled(SceneTables(scene).displacements([0.5], ["direct"], Circle()))[
            "frequency"
        ]
        == 2.5
    )
    assert [g.frequency for g in report.compared_gaits(scene)] == [
        2.5
    ] * 3  # those that `run` adds, too


def test_every_displacement_is_a_speed():
    scene = scenes.parse(CHAIN)
    table, amplitudes = (
        tabled(SceneTables(scene).displacements([0.5, 1.0], ["area", "direct"])),
        [0.5, 1.0],
    )
    for tier in ("area", "direct"):
        poses = np.array(table[tier])
        assert (np.abs(poses) > 1e-4).any(0).all()  # it moves along, sideways and turns
        np.testing.assert_allclose(
            table["speed"][tier], 2.5 * np.hypot(poses[:, 0], poses[:, 1])
        )
        np.testing.assert_allclose(
            table["speed_body_lengths"][tier], np.array(table["speed"][tier]) / 0.3
        )
        np.testing.assert_allclose(table["turning_rate"][tier], 2.5 * poses[:, 2])
    plain = tabled(
        SceneTables(scenes.parse(CHAIN.replace("frequency = 2.5", ""))).displacements(
            amplitudes, ["area", "direct"]
        )
    )
    assert {k: plain[k] for k in ("area", "direct", "estimate")} == {
        k: table[k] for k in ("area", "direct", "estimate")
    }
    assert set(table) - set(plain) == {
        "frequency",
        "speed",
        "speed_body_lengths",
        "turning_rate",
    }
    answer = cheapest_displacements(scene, amplitudes, 1e-2)
    distance = answer["net_distance"].values
    np.testing.assert_allclose(answer["speed"].values, 2.5 * distance)


def test_what_is_nothing_but_its_error_is_zero():
    study = SceneTables(scenes.parse(CHAIN))
    result = study.displacements([0.5, 1.0], ["direct"])
    y = dataclasses.replace(result["y"], values=[[1e-8, -1e-8]], error=[[2e-8, 3e-8]])
    lines = str(result.with_variables(y)).splitlines()
    assert "y: zero within its error, 3.0e-08 m" in lines


def test_sweeps_give_it(tmp_path):
    scene = scenes.parse(CHAIN + GRAINS)
    found = swept_table(
        sweep.sweep(
            scene, {"gait.amplitude": [0.5, 1.0], "gait.frequency": [1.0, 2.5, 4.0]}
        )
    )
    assert (
        np.diff(found["displacement"][..., 0]) != 0
    ).all()  # grains that are pushed aside notice
    np.testing.assert_allclose(found["frequency"], [[1.0, 2.5, 4.0]] * 2)
    np.testing.assert_allclose(
        found["speed"],
        np.hypot(*np.moveaxis(found["displacement"], -1, 0)[:2]) * [1.0, 2.5, 4.0],
    )
    alone = tabled(
        SceneTables(
            scene.changed(gait=dataclasses.replace(scene.gait, amplitude=1.0))
        ).displacements([1.0], ["direct"])
    )
    np.testing.assert_allclose(
        found["speed"][1, 1], alone["speed"]["direct"][0], rtol=1e-6
    )
    (tmp_path / "s.toml").write_text(CHAIN)
    over = ("--over", "body.length=0.1,0.2", "-o", "s.nc", "--plot", "s.png")
    code, out, err = geomech("sweep", "s.toml", *over, cwd=tmp_path)
    assert (code, err) == (0, "") and "speed" in out
    with xarray.open_dataset(tmp_path / "s.nc") as data:
        assert (
            data.speed.attrs["units"] == "m/s" and data.frequency.attrs["units"] == "Hz"
        )
        np.testing.assert_allclose(data.speed, np.hypot(data.x, data.y) * 2.5)
    run, seen = Swimmer.run, []
    with mock.patch.object(
        Swimmer,
        "run",
        lambda self, alpha, *rest, **more: (
            seen.append(len(alpha)) or run(self, alpha, *rest, **more)
        ),
    ):
        plain = swept_table(
            sweep.sweep(
                scenes.parse(CHAIN),
                {"gait.frequency": [1.0, 2.0, 4.0], "gait.amplitude": [0.5, 1.0]},
            )
        )
        each = len(seen), sum(seen)
        assert plain["displacement"].shape == (3, 2, 3) and plain["estimate"].shape == (
            3,
            2,
        )
        seen.clear()
        one = swept_table(
            sweep.sweep(scenes.parse(CHAIN), {"gait.amplitude": [0.5, 1.0]})
        )
    assert (
        len(seen),
        sum(seen),
    ) == each  # what is fast and slow moves alike, and is solved once
    np.testing.assert_array_equal(plain["displacement"], [one["displacement"]] * 3)
    np.testing.assert_allclose(
        plain["speed"][:, 1], one["speed"][1] * np.array([0.4, 0.8, 1.6])
    )
    timeless = swept_table(
        sweep.sweep(
            scenes.parse(CHAIN.replace("frequency = 2.5", "")),
            {"gait.amplitude": [0.5]},
        )
    )
    assert "speed" not in timeless


def test_performance_speaks_the_scenes_own_unit():
    fish = scenes.load("sandfish-loose").with_numerics(phases=32)
    small = fish.changed(
        body=dataclasses.replace(fish.system.body, length=0.1),
        effects=tuple(effect.in_metres(0.1) for effect in fish.system.effects),
    )
    plain = undulation.performance(small, [0.1, 0.22])
    timed = undulation.performance(
        small.changed(gait=dataclasses.replace(fish.gait, frequency=3)), [0.1, 0.22]
    )
    assert set(timed) - set(plain) == {
        "distance",
        "speed",
        "speed_body_lengths",
        "velocity_per_second",
    }
    for key in plain:
        np.testing.assert_array_equal(plain[key], timed[key])
    net = small.cycle(amplitudes=[0.1, 0.22]).net
    np.testing.assert_allclose(timed["distance"], np.hypot(net[:, 0], net[:, 1]))
    np.testing.assert_allclose(timed["speed"], 3 * timed["distance"])
    np.testing.assert_allclose(timed["speed_body_lengths"], 30 * timed["distance"])
    np.testing.assert_allclose(
        timed["velocity_per_second"], plain["velocity"] * [0.1, 0.1, 1.0] * 6 * np.pi
    )


def test_the_command_gives_it(tmp_path):
    (tmp_path / "s.toml").write_text(CHAIN)
    args = ("--amplitudes", "1", "--tiers", "direct", "--json")
    out = geomech("displacement", "s.toml", *args, cwd=tmp_path)[1]
    found = from_dict(json.loads(out))
    distance = float(found["net_distance"][0, 0])
    assert float(found["speed"][0, 0]) == pytest.approx(2.5 * distance)


@pytest.mark.parametrize("top", [0.03, 0.22, 1.0, 1.3247, 2.5, 7.0, 999.0, 1e-5, 4e5])
def test_amplitudes_of_tables_are_round(top):
    steps = report.round_amplitudes(top)
    assert (
        6 <= len(steps) <= 15
        and steps[-1] <= top * (1 + 1e-9) < steps[-1] + 1.01 * steps[0]
    )
    assert all(len(f"{a:e}".split("e")[0].rstrip("0")) <= 5 for a in steps)
    np.testing.assert_allclose(np.diff(steps), steps[0], rtol=1e-9)
    assert f"{steps[0]:e}".rstrip("0123456789").rstrip("e+-").rstrip("0") in (
        "1.",
        "2.",
        "2.5",
        "5.",
    )
