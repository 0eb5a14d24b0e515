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
from geomech.core.variables import Result, Variable
from geomech.gaits import Circle
from geomech.studies import report, sweep, undulation
from geomech.studies.choose import cheapest
from geomech.studies.study import Study
from geomech.systems import Swimmer
from geomech.text import displacement
from rft import BodyInertia, GrainInertia
from rft.refusal import Refusal

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
            Study(scene).displacements([0.5], ["direct"], Circle(frequency=2.0))
        ),
    ):
        with pytest.raises(
            Refusal,
            match=r"\[gait\] frequency = 2, but the effects of the swimmer have 2.5",
        ):
            contradict()
    assert (
        tabled(Study(scene).displacements([0.5], ["direct"], Circle()))["frequency"]
        == 2.5
    )
    assert [g.frequency for g in report._gaits(scene)] == [
        2.5
    ] * 3  # those that `run` adds, too


def test_every_displacement_is_a_speed():
    scene = scenes.parse(CHAIN)
    table, amplitudes = (
        tabled(Study(scene).displacements([0.5, 1.0], ["area", "direct"])),
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
    assert table["units"] == {
        "amplitude": "amplitude of the ellipse (scale)", "x": "m", "y": "m", "net_distance": "m", "heading": "rad",
        "estimate": "m", "estimate_heading": "rad", "body_length": "m", "seconds": "s",
        "frequency": "Hz", "speed": "m/s", "speed_body_lengths": "BL/s", "turning_rate": "rad/s",
    }  # fmt: skip
    plain = tabled(
        Study(scenes.parse(CHAIN.replace("frequency = 2.5", ""))).displacements(
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
    answer = cheapest(scene, amplitudes, 1e-2)
    np.testing.assert_allclose(
        answer["speed"][answer["tier"]],
        2.5 * np.array(answer["net_distance"][answer["tier"]]),
    )
    lines = displacement.full(table.result, "s").splitlines()
    for unit, length in (("m", 1.0), ("BL", 0.3)):
        (at,) = [
            k
            for k, x in enumerate(lines)
            if x.startswith(f"s: speed ({unit}/s) at 2.5 Hz")
        ]
        a, *_, direct, error = lines[at + 3].split()
        assert (float(a), float(direct)) == (
            1.0,
            pytest.approx(table["speed"]["direct"][1] / length, abs=1e-6),
        )
        assert error == f"+-{table['estimate']['direct'][1] * 2.5 / length:.1e}"


def test_tables_have_one_unit_a_row():
    scene = scenes.parse(CHAIN)
    table = tabled(Study(scene).displacements([1.0], ["direct"]))
    lines = displacement.full(table.result, "s").splitlines()
    found = {}
    for head, _, row in zip(lines[::3], lines[1::3], lines[2::3]):
        if head.startswith("s: "):
            found[head] = [float(x.removeprefix("+-")) for x in row.split()[1:]]
    x, y, heading = table["direct"][0]
    estimate, turned = (
        table["estimate"]["direct"][0],
        table["estimate_heading"]["direct"][0],
    )
    wanted = [(v, estimate) for v in (np.hypot(x, y), x, y)] + [(heading, turned)]
    for (head, row), (value, error), unit in zip(
        found.items(), wanted, ["(m)", "(m)", "(m)", "(rad)"]
    ):
        assert row == [pytest.approx(value, abs=1e-6), pytest.approx(error, rel=0.05)]
        assert unit in head
    assert [head.rpartition(": ")[2] for head in found][:3] == [
        "net distance, sqrt(x^2 + y^2)",
        "x",
        "y",
    ]


def test_what_is_nothing_but_its_error_is_zero():
    result = tabled(
        Study(scenes.parse(CHAIN)).displacements([0.5, 1.0], ["direct"])
    ).result
    y = dataclasses.replace(result["y"], values=[[1e-8, -1e-8]], error=[[2e-8, 3e-8]])
    lines = displacement.text(
        dataclasses.replace(
            result, variables=(y, *(v for v in result.values() if v.name != "y"))
        )
    )
    assert "y: zero within its error, 3e-08 m" in lines.splitlines()


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
        Study(
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
            data.speed.attrs["units"] == "m s-1"
            and data.frequency.attrs["units"] == "Hz"
        )
        np.testing.assert_allclose(
            data.speed, np.hypot(data.displacement[:, 0], data.displacement[:, 1]) * 2.5
        )
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
    small = fish.changed(body=dataclasses.replace(fish.system.body, length=0.1))
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
    table = json.loads(geomech("displacement", "s.toml", *args, cwd=tmp_path)[1])
    assert table["speed"]["direct"][0] == pytest.approx(
        2.5 * table["net_distance"]["direct"][0]
    )


@pytest.mark.parametrize("top", [0.03, 0.22, 1.0, 1.3247, 2.5, 7.0, 999.0, 1e-5, 4e5])
def test_amplitudes_of_tables_are_round(top):
    steps = report.steps(top)
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


def by_hand(parts=(), **facts):
    """Displacements of a body 0.02 m long by two tiers at three amplitudes."""
    over, x = (
        ("tier", "amplitude"),
        np.array([[0.00123456789, -0.002, 0.003], [0.0012, -0.0021, 0.0031]]),
    )

    def of(name, values, error, unit):
        return Variable(
            name, over, np.zeros((2, 3)) + values, unit, "", np.zeros((2, 3)) + error
        )

    error = [[1.2e-6, 3e-6, 5e-6], [4e-6, 2e-6, 4e-6]]
    variables = {v.name: v for v in (
        Variable("tier", ("tier",), np.array(["path", "direct"])),
        Variable("amplitude", ("amplitude",), [0.5, 1.0, 1.5], "1", "amplitude of the $circle$ (rad)"),
        of("x", x, error, "m"), of("y", 0.9e-8, 1e-8, "m"), of("heading", [0.1, 0.2, 0.3], 1e-3, "rad"),
        of("net_distance", np.abs(x), error, "m"), *(of(*x) for x in parts),
    )}  # fmt: skip
    facts = {
        "name": "s.toml",
        "zero_by_symmetry": [],
        "body_length": 0.02,
        "seconds": {"path": 0.5, "direct": 1.25},
        "kept": ("path",),
    } | facts
    return Result("displacement", tuple(variables.values()), facts)


BY_HAND = """\
s.toml: a note
s.toml: displacement per cycle (m), direct tier, cheapest within 0.001 BL
amplitude               x   +- error
      0.5      0.00120000  +-4.0e-06
        1     -0.00210000  +-2.0e-06
      1.5      0.00310000  +-4.0e-06
heading: zero by symmetry
y: zero within its error, 1e-08 m
x by tier                path
      0.5  0.00123457 +-1e-06
        1 -0.00200000 +-3e-06
      1.5  0.00300000 +-5e-06
amplitude: amplitude of the circle (rad)
estimated error: of halves
x ahead, y to the left, as the body frame points at the start of the cycle"""
OF_ALL = """\
s.toml: speed (m/s) at 2 Hz +- estimated error: net distance times frequency
amplitude                   path                 direct
      0.5    0.00246914 +-2.4e-06    0.00240000 +-8.0e-06
        1    0.00400000 +-6.0e-06    0.00420000 +-4.0e-06
      1.5    0.00600000 +-1.0e-05    0.00620000 +-8.0e-06
s.toml: speed (BL/s) at 2 Hz +- estimated error: net distance times frequency
amplitude                 path               direct
      0.5    0.123457 +-1.2e-04    0.120000 +-4.0e-04
        1    0.200000 +-3.0e-04    0.210000 +-2.0e-04
      1.5    0.300000 +-5.0e-04    0.310000 +-4.0e-04
amplitude: amplitude of the circle (rad); x, y, heading: the pose after a cycle, in the frame at its start
seconds: path 0.5 (built before), direct 1.25 with the search for it
"""


def test_displacements_are_told_to_a_millionth_of_the_body():
    facts = {
        "zero_by_symmetry": ["heading"],
        "note": "a note",
        "estimate_is": "of halves",
        "tolerance": 1e-3,
    }
    assert displacement.text(by_hand(**facts)) == BY_HAND
    lines = displacement.text(by_hand()).splitlines()
    assert lines[:2] == [
        "s.toml: displacement per cycle (m), direct tier, most exact of 2",
        "amplitude               x   +- error  heading (rad)   +- error",
    ]
    assert lines[3] == "        1     -0.00210000  +-2.0e-06       0.200000  +-1.0e-03"
    assert displacement.full(by_hand(frequency=2.0, tier="direct")).endswith(OF_ALL)
    for length, decimals in (
        (0.02, 8),
        (0.0999, 8),
        (0.1, 7),
        (0.3, 7),
        (1.0, 6),
        (25.0, 6),
        (0.001, 9),
    ):
        assert displacement._decimals(by_hand(body_length=length)) == decimals


@pytest.mark.parametrize(
    ("value", "error", "length", "zero"),
    [
        (8e-9, 8.001e-9, 0.02, True), (8e-9, 7.999e-9, 0.02, False), (0.99e-8, 1e-7, 0.02, True),
        (1.01e-8, 1e-7, 0.02, False),
        (-1.01e-8, 1e-7, 0.02, False), (4.9e-7, 1e-6, 1.0, True), (5.1e-7, 1e-6, 1.0, False),
    ],
)  # fmt: skip
def test_a_component_is_zero_within_its_error_and_below_the_last_digit(
    value, error, length, zero
):
    lines, moving = displacement._zeros(
        by_hand([("y", [0.0, value, 0.0], error, "m")], body_length=length), 1
    )
    assert ("y" not in moving) == zero == bool(lines) and moving[0] == "x"
    _, moving = displacement._zeros(
        by_hand([("heading", [0.0, value, 0.0], error, "rad")], body_length=length), 1
    )
    assert ("heading" not in moving) == (abs(value) <= error and abs(value) < 5e-7)


def test_the_most_exact_tier_is_that_of_the_least_largest_error():
    of = lambda *errors: displacement.exact_tier(
        by_hand([("x", 0.0, np.array(errors), "m")])
    )
    assert (
        of([1, 2, 3], [1, 1, 4]) == 0
        and of([1, 2, 3], [3, 1, 1]) == 1
        and of([1, 2, np.nan], [9, 9, 9]) == 1
    )
    assert displacement.shown_rows(3, 14).tolist() == [
        0,
        1,
        2,
    ] and displacement.shown_rows(30, 4).tolist() == [
        0,
        10,
        19,
        29,
    ]


def test_columns_stand_together_as_far_as_a_screen_is_wide():
    of = lambda *wide: [
        len(group) - 1
        for group in displacement._side_by_side(
            [[" " * w] for w in wide], by_hand(), np.arange(3)
        )
    ]
    assert (
        of(35, 36) == [2]
        and of(35, 37) == [1, 1]
        and of(20, 20, 20, 20) == [3, 1]
        and of(90, 90) == [1, 1]
    )


def test_other_tiers_are_told_by_x_where_they_fit():
    others = lambda result, shown: list(
        displacement._others(result, 1, np.array(shown))
    )
    assert others(by_hand(), [0, 1, 2])[0] == "x by tier" + "path".rjust(20)
    assert (
        others(by_hand(), [0, 1])
        == others(by_hand(zero_by_symmetry=["x"]), [0, 1, 2])
        == ["other tiers, largest error (m): path 5.0e-06"]
    )


def test_a_shift_of_the_mean_is_told_where_it_is_a_tenth_of_the_deviation():
    spread = np.array([[1e-4, 1e-4, 1e-9]] * 2)
    shift = Variable(
        "medium_shift",
        ("quantity", "amplitude"),
        [
            [0.0] * 3,
            [1.01e-5, -0.99e-5, 2.1e-8],
            [1.01e-5, -1.01e-5, 0.9e-6],
            [0.0] * 3,
        ],
    )
    result = by_hand([("y", 0.0, 1e-8, "m"), ("heading", 0.0, 1e-8, "rad")])
    result = dataclasses.replace(result, variables=(*result.variables, shift))
    of = lambda name: displacement._shifts(
        result, dataclasses.replace(result[name], spread=spread)
    )
    assert (
        of("y") == {0: 1.01e-5, 2: 2.1e-8}
        and of("heading") == {0: 1.01e-5, 1: -1.01e-5}
        and of("x") == {}
    )
