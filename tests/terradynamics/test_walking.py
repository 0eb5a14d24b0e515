"""Walking robots: the clock, the engine against independent sums, its order and energy, limit cycles, ends, commands."""

import dataclasses
import json
import math
import types

import numpy as np
import pytest
from artists import curve, drawn
from PIL import Image, ImageSequence
from scipy.io import netcdf_file
from tabled import of_json, of_swept

from figures.robots.walking_sensitivity import Sheet
from geomech import plots, scenes
from geomech.core.variables import Result
from geomech.io.results import from_dict
from geomech.plots import films
from geomech.plots.terradynamics.walking import walk_stage
from geomech.questions.terradynamics import walk as questions_walk
from geomech.scenes import WalkerScene
from geomech.shell.describe.scene import description
from geomech.studies.displacement.sweep import Plan
from geomech.studies.terradynamics import walking
from rft.balance.backend import preferring
from rft.core.metres import GRAVITY
from rft.core.refusal import Refusal
from rft.terradynamics.ground import Aeration, GrainInertia, Slope
from rft.terradynamics.plates import VERTICAL, CLeg, RoundRod, StressMap, Wheel, loads
from rft.terradynamics.walking import (
    Fineness,
    Rhex,
    Roller,
    Tripod,
    Walker,
    engine,
    rolling,
)
from rft.terradynamics.walking.planar.equations import State
from rft.terradynamics.walking.planar.limit import (
    Limit,
    LimitCycles,
    _Search,
    _with_means,
    limit_cycles,
    predicted_progress,
    solve_regular,
)
from rft.terradynamics.walking.planar.march import march, step
from rft.terradynamics.walking.planar.sdirk import (
    EFFORT,
    Effort,
    end_of_part,
    largest_speed,
    newton_step,
    next_part,
    start_of_step,
)
from rft.terradynamics.walking.planar.stride import (
    Walk,
    cycles_to_settle,
    map_period,
    remaining_change,
    walk_from_rest,
)
from rft.terradynamics.walking.planar_walk import (
    _limit_fields,
    _rows_until,
    _strides,
    rerun,
    walk,
)
from rft.terradynamics.walking.robot import intervals, walking_rounding

pytestmark = pytest.mark.usefixtures("fastest")
SAND = StressMap(zeta=0.3, grazing=math.radians(5))
ROBOT = Rhex(
    0.2,
    0.15,
    0.03,
    0.06,
    CLeg(0.025, 0.012, 0.6),
    (-0.05, 0.06),
    hip_height=-0.004,
    axle=0.002,
)
QUICK = Fineness(steps=16, elements=8, duration=2.0)
XPLORER = scenes.load("xplorer")


def xplorer(curvature=1.0, frequency=2.0, **changes):
    legs = dataclasses.replace(XPLORER.robot.legs, relative_curvature=curvature)
    robot = dataclasses.replace(XPLORER.robot, legs=legs, **changes)
    return Walker(robot, Tripod(frequency), XPLORER.medium)


@pytest.fixture(scope="module", autouse=True)
def compiled_steps():
    """What is compiled once says so on standard error, where tests of commands look for one line."""
    walk([xplorer()], QUICK, 1)


@pytest.mark.parametrize(
    "gait", [Tripod(2.0), Tripod(1.3, 0.4, 1.1, 0.3), Tripod(0.7, 0.7, 2.0, -0.2)]
)
def test_the_clock_turns_once_a_cycle_and_sweeps_while_it_stands(gait):
    phase = np.linspace(-1.3, 2.1, 3401)
    angle = gait.angle(phase, phase)
    assert np.abs(np.diff(angle)).max() < 1.001e-3 * max(
        gait.rate(0.0), gait.rate(0.5)
    )  # no jump, whatever the cycle
    np.testing.assert_allclose(
        gait.angle(phase + 1, phase + 1) - angle, 2 * np.pi, atol=1e-12
    )
    half = gait.duty / 2 - 1e-12
    assert gait.angle(half, half) - gait.angle(-half, -half) == pytest.approx(
        gait.sweep, abs=1e-9
    )
    assert gait.angle(0.0, 0.0) == pytest.approx(gait.middle)
    inside = (phase[1:] + phase[:-1]) / 2
    same = (np.abs((phase[:-1] + 0.5) % 1 - 0.5) < gait.duty / 2) == (
        np.abs((phase[1:] + 0.5) % 1 - 0.5) < gait.duty / 2
    )
    np.testing.assert_allclose(
        (np.diff(angle) / np.diff(phase))[same], gait.rate(inside)[same], rtol=1e-6
    )
    kinks = gait.kinks[1:-1]
    jumps = [
        k
        for k in np.linspace(0.001, 0.499, 499)
        if abs(gait.rate(k - 6e-4) - gait.rate(k + 6e-4)) > 1e-9
    ]
    assert all(min(abs(k - x) for x in kinks) < 1.2e-3 for k in jumps)


def test_each_kink_of_the_clock_stands_once():
    """Where a leg of the one tripod changes its rate as one of the other does, too; and where the rate never changes."""
    assert Tripod(1.0, 0.3).kinks == pytest.approx((0.0, 0.15, 0.35, 0.5))
    assert Tripod(1.0, 0.8).kinks == pytest.approx((0.0, 0.1, 0.4, 0.5))
    assert Tripod(1.0, 0.5, 1.0).kinks == (0.0, 0.25, 0.5)
    assert Tripod(1.0, 0.3, 0.6 * np.pi).kinks == (0.0, 0.5)


@pytest.mark.parametrize("robot", [ROBOT, Sheet(**vars(ROBOT))], ids=["box", "sheet"])
@pytest.mark.parametrize("tension", ["keep", "cut"])
def test_forces_are_the_sum_over_legs_and_belly(tension, robot):
    """Leg by leg through the public loads; at 30 m/s the rounding is of no account. A belly that is an open sheet moves up."""
    effects = (GrainInertia(0.5, 300.0),)
    walker = Walker(
        robot,
        Tripod(1.3, 0.4, 1.1),
        dataclasses.replace(SAND, grazing=1e-9, tension=tension),
        effects,
    )
    robots = _strides([walker], dataclasses.replace(QUICK, rounding=1e-7)).robots
    pose, twist, phase = (
        np.array([0.3, 0.006, 0.15]),
        np.array([12.0, -25.0, -40.0]),
        0.17,
    )
    twist = twist if robot is ROBOT else -twist
    angle, rate = robots.leg_motion(np.array([phase]), phase)
    a, motors, ground = robots.accelerations(
        pose[None, None], twist[None, None], angle, rate
    )
    wrench, motor, into = np.zeros(3), 0.0, 0.0
    places = [(x, robot.hip_height, at) for x in robot.hips for at in (0.0, 0.5)]
    parts = [(robot.leg(8), x, z, at) for x, z, at in places] + [
        (robot.belly(8), 0.0, 0.0, None)
    ]
    for outline, x, z, at in parts:
        phi, turn = (
            (0.0, 0.0)
            if at is None
            else (
                walker.gait.angle(phase + at, phase + at),
                1.3 * walker.gait.rate(phase + at),
            )
        )
        cos, sin = math.cos(pose[2]), math.sin(pose[2])
        r = cos * x + sin * z, cos * z - sin * x
        v = twist[0] + twist[2] * r[1], twist[1] - twist[2] * r[0]
        found = loads(
            walker.stress,
            outline,
            [r[0], pose[1] + r[1], pose[2] + phi],
            [*v, twist[2] + turn],
            effects,
        )
        wrench += [
            *found.force,
            found.moment + r[1] * found.force[0] - r[0] * found.force[1],
        ]
        motor -= found.moment * turn
        into -= found.force @ v + found.moment * (twist[2] + turn)
    assert np.abs(wrench).min() > 0.1
    np.testing.assert_allclose(
        a[0, 0], wrench / [0.2, 0.2, robot.inertia] - [0, GRAVITY, 0], rtol=1e-6
    )
    assert (motors[0, 0], ground[0, 0]) == pytest.approx((motor, into), rel=1e-6)


def test_a_belly_feels_the_ground_by_degrees_and_robots_stand_on_their_lowest_point():
    """Sinking at about the rounding: what it bears falls off with the speed, and with that across its bottom."""
    high = dataclasses.replace(ROBOT, hip_height=0.5)
    stress, sink, rounding = (
        dataclasses.replace(SAND, grazing=math.radians(30)),
        4e-3,
        3e-3,
    )
    robots = _strides([Walker(high, Tripod(1.0), stress)], QUICK).robots
    pose, twist = np.array([0.0, 0.01, 0.0]), np.array([0.0, -sink, 0.0])
    a = robots.accelerations(
        pose[None, None], twist[None, None], *robots.leg_motion(np.zeros(1), 0.0)
    )[0][0, 0]
    plain = loads(
        dataclasses.replace(stress, grazing=0.0), high.belly(8), pose, twist
    ).force
    fast = math.hypot(sink, rounding)
    share = sink / fast * sink / math.hypot(sink, math.sin(stress.grazing) * fast)
    assert share < 0.7 and plain[1] > 1.0
    np.testing.assert_allclose(
        a[:2] * high.mass + [0, high.mass * GRAVITY],
        share * plain,
        rtol=1e-9,
        atol=1e-9,
    )
    gait = Tripod(2.0, 0.4, 1.1, 1.3)
    flat = dataclasses.replace(ROBOT, height=0.002)
    robots = _strides([Walker(flat, gait, SAND)], QUICK).robots
    lowest = []
    for at in (0.0, 0.5):
        (x, z), angle = ROBOT.leg(8).points.T, gait.angle(at, at)
        lowest.append(
            (math.cos(angle) * z - math.sin(angle) * x).min() + ROBOT.hip_height
        )
    assert robots.start().pose[0, 1] == pytest.approx(
        -min(*lowest, -flat.height / 2), abs=1e-12
    )


def fall(steps: int, time: float = 0.12) -> tuple[State, State, object]:
    """Xplorer at 4 Hz for a while from rest."""
    robots = _strides([xplorer(frequency=4.0)], QUICK).robots
    state = first = robots.start()
    for k in range(steps):
        half = 4.0 * time / steps
        state = step(robots, state, k * half, (k + 0.5) * half, time / steps)
    return first, state, robots


def test_steps_are_of_order_two_and_energy_is_kept_to_that():
    """Motors' work = loss in the ground + change of the body's energy."""
    finest = fall(512)[1]
    errors, audits = [], []
    for steps in (16, 32, 64):
        first, last, robots = fall(steps)
        errors.append(np.abs(last.pose - finest.pose).max() / np.abs(finest.pose).max())
        audits.append(
            abs(last.work - last.loss - robots.energy(last) + robots.energy(first))[0]
            / last.work[0]
        )
    for values in (errors, audits):
        slope = -np.polyfit(np.log([16, 32, 64]), np.log(values), 1)[0]
        assert slope > 1.7, values
    assert errors[-1] < 2e-3 and audits[-1] < 2e-3


def test_what_falls_free_falls_as_galilei_says():
    robots = _strides([Walker(ROBOT, Tripod(2.0), SAND)], QUICK).robots
    state = robots.start()
    state = state._replace(
        pose=state.pose + [0, 5.0, 0], twist=np.array([[0.3, 1.0, 0.7]])
    )
    for k in range(10):
        state = step(robots, state, 0.02 * k, 0.02 * k + 0.01, 0.01)
    z = -robots.start().pose[0, 1]
    assert state.pose[0, 0] == pytest.approx(0.03, abs=1e-9)
    assert state.pose[0, 1] + z == pytest.approx(
        5.0 + 0.1 - GRAVITY * 0.01 / 2, abs=1e-4
    )
    assert (state.pose[0, 2], state.work[0], state.loss[0]) == pytest.approx(
        (0.07, 0.0, 0.0)
    )


def test_a_box_pitches_about_its_width():
    assert ROBOT.inertia == pytest.approx(0.2 * (0.15**2 + 0.03**2) / 12)


def test_what_a_limit_tells_is_of_a_stride_and_a_walk_of_a_second():
    """Of a map of one stride, and of two: all progress to come, and what defects move; stuck below 2 % of a reach a cycle."""
    strides, both = _strides([xplorer(1.0, 3.0)] * 2, QUICK), np.arange(2)
    start = strides.robots.start()
    slopes, gains = (
        np.diag([0.5, 0.2, 0.8, 0.1, -0.3]),
        np.array([0.2, 0.0, 0.05, 0.01, 0.0]),
    )
    search = _Search(
        strides,
        [
            Limit(start.take([k]), period, slopes, gains)
            for k, period in enumerate((1, 2))
        ],
    )
    residual = np.array([[1e-3], [2e-3], [4e-3], [0.0], [1e-3]]) * [1.0, 1.0]
    search._step(both, search.start.copy(), residual, np.array([1e-3, 1e-3]))
    np.testing.assert_allclose(
        search.drift, (0.2 * 1e-3 / 0.5 + 0.05 * 4e-3 / 0.2) / np.array([1, 2])
    )
    np.testing.assert_allclose(
        search.unsolved_error, 1e-3 * 0.05 / 0.2 / strides.leg_speed / [1, 2]
    )
    for computed, unknown in (
        (2, [False, False]),
        (3, [True, False]),
        (6, [False, True]),
        (7, [True, True]),
    ):
        search.computed[:], search.last_size[:] = (
            computed,
            np.inf,
        )  # a slope serves three strides of its map
        search._step(both, search.start.copy(), residual / 10, np.zeros(2))
        assert search.needs_slopes.tolist() == unknown
    one = np.ones(1)
    for progress, status in ((4.0e-4, "stuck"), (4.2e-4, "walking")):
        found = LimitCycles(
            progress * one, 2e-3 * one, 1e-3 * one, [True], 5 * one, [""], search.limits
        )
        fields = _limit_fields(strides, found, 0)
        assert fields["status"] == status and fields["cycles"] == 2.5
        assert [
            fields[x] for x in ("speed", "drift", "unsolved_error")
        ] == pytest.approx([6 * progress, 12e-3, 6e-3])


def test_without_a_limit_cycle_the_mean_of_four_cycles_counts():
    """Half cycles of 1, 2, 3, ... mm, each off by 0.5 mm/s: eight of them, and what they differ by from cycle to cycle."""

    def run(state, k, r):
        pose, defect = (
            state.pose + np.array([1e-3 * (k + 1), 0, 0]),
            state.defect + 5e-4,
        )
        return None, State(*(x[None] for x in state._replace(pose=pose, defect=defect)))

    fake = types.SimpleNamespace(
        cycle=2,
        period=0.5,
        frequency=np.array([3.0]),
        end_status=lambda state, r: [""],
        run=run,
    )
    start = Limit(State.at_rest(np.zeros((1, 3))), 1)
    found = _with_means(
        fake,
        [start],
        np.array([0]),
        LimitCycles(*np.zeros((5, 1)), np.array([""]), [start]),
    )
    assert (found.progress[0], found.drift[0], found.strides[0]) == pytest.approx(
        (4.5e-3, 6e-3, 8)
    )
    assert found.unsolved_error[0] * 3.0 / 0.5 == pytest.approx(5e-4)


def test_the_limit_cycle_is_that_of_many_strides():
    """Of a quick walker, of one that drags its belly and swings for fifty strides, and of one that limps: it repeats itself,
    and the first and the last get there by themselves."""
    walkers = [xplorer(c, f) for c, f in ((0.3, 3.0), (-0.6, 3.25), (1.0, 4.0))]
    strides, every = _strides(walkers, Fineness(steps=12, elements=6)), np.arange(3)
    state, _, _, _, period = walk_from_rest(strides, 3 / strides.frequency)
    assert period.tolist() == [1, 1, 2]
    found = limit_cycles(strides, [Limit(state.take([k]), period[k]) for k in every])
    assert (
        found.periodic.all()
        and (found.ends == "").all()
        and (found.strides <= 10).all()
    )
    for _ in range(10):
        first, state = state, strides.run(state, 0, every)[1].take(-1)
    last = strides.run(state, 0, every)[1].take(-1)
    moved = last.pose[:, 0] - first.pose[:, 0]
    np.testing.assert_allclose((2 * found.progress)[[0, 2]], moved[[0, 2]], rtol=2e-3)
    assert abs(2 * found.progress[1] / moved[1] - 1) > 0.02
    first = State(
        *(np.concatenate(x) for x in zip(*(one.state for one in found.limits)))
    )
    last = strides.run(strides.run(first, 0, every)[1].take(-1), 0, every)[1].take(-1)
    assert (
        np.abs(
            strides.scaled_state(last, every) - strides.scaled_state(first, every)
        ).max()
        < 2e-3
    )
    np.testing.assert_allclose(
        last.pose[:, 0] - first.pose[:, 0], 2 * found.progress, rtol=5e-3
    )
    left = [
        found.limits[0]._replace(slopes=-1.5 * np.eye(5)),
        *found.limits[1:],
    ]  # as if a push sent it away
    pushed = limit_cycles(strides, left)
    assert pushed.periodic.tolist() == [False, True, True]
    np.testing.assert_allclose(pushed.progress, found.progress, rtol=5e-3)


def test_a_walk_tells_when_it_is_near_its_limit_cycle():
    """Of one that drags its belly and swings through the limit's speed: the slopes there, known after two seconds, foretell
    what the strides of six seconds are."""
    assert [
        cycles_to_settle(x, -2.0)
        for x in ([-2.09, -1.91], [-2.0, -1.8, -2.09], [-2.0, -2.2], [])
    ] == [
        0,
        2,
        np.inf,
        np.inf,
    ]
    assert cycles_to_settle([1.0, np.nan, 1.0], 1.0) == 2
    swings = xplorer(-0.6, 3.25)
    brief, long = (
        walk([swings], Fineness(steps=12, elements=6, duration=d))[0]
        for d in (2.0, 6.0)
    )
    x = np.interp(np.arange(20) / 3.25, long.t, long.pose[:, 0])
    seen = cycles_to_settle(np.diff(x), long.speed / 3.25) / 3.25
    assert (
        4.0 < seen == long.settling_time < 6.0
        and abs(brief.settling_time - seen) < 1.5 / 3.25
    )


def told_of(scene, found):
    """What is printed of a walk, on one line, and its result."""
    found = Result("walk", tuple(walking.variables(scene, found)))
    facts = {"scene": scene.name}
    result = dataclasses.replace(
        found, attributes=facts, question=questions_walk.Walk(scene)
    )
    return " ".join(str(result).split()), result


def test_what_is_told_of_a_walk():
    """An energy over weight times way, when the robot is near its limit cycle, how it turns; nothing of the solver's cycles."""
    t = np.linspace(0.0, 4.0, 33)
    zero, pose = np.zeros_like(t), np.stack([0.25 * t, 0.03 + 0 * t, 0 * t], -1)
    fields = (
        t,
        pose,
        np.zeros_like(pose),
        0.6 * t,
        0.5 * t,
        zero,
        0.25,
        "walking",
        14.0,
        True,
        0.0,
        None,
    )
    one = walking.Walked(Walk(*fields, settling_time=1.5), 0.01)
    said, found = told_of(XPLORER, one)
    assert said.startswith(
        "xplorer: walking at 0.250 +- 1.0e-02 m/s at 2 Hz "
        "(limit cycle; from rest within 5 % of it after 1.5 s)"
    )
    cost = 0.6 / (0.15 * 9.81 * 0.25)
    assert "total work 2.4 J" in said
    assert f"cost of transport {cost:.6g} work over weight times distance" in said
    assert "14" not in said and "turning" not in said
    assert float(found["settling_time"]) == 1.5 and float(found["cycles"]) == 14.0
    for settled, words in (
        (0.0, "within 5 % of it from the start)"),
        (np.inf, "does not come within 5 %"),
        (np.nan, "cycle)"),
    ):
        other = one._replace(walk=one.walk._replace(settling_time=settled))
        said, found = told_of(XPLORER, other)
        assert words in said and ("settling_time" in found) != np.isnan(settled)
    y = 0.25 * (1 - np.cos(0.1 * t)) / 0.1
    arc = np.stack([0.25 * np.sin(0.1 * t) / 0.1, pose[:, 1], 0 * t], -1)
    more = {"y": y, "roll": zero, "yaw": 0.1 * t}
    turns = one._replace(
        walk=one.walk._replace(
            pose=arc, spatial=more, yaw_rate=0.1, lateral_speed=-0.02
        ),
        turning=0.01,
        lateral=0.003,
    )
    said, found = told_of(XPLORER, turns)
    assert "yaw rate 0.100 +- 1.0e-02 rad/s" in said
    assert f"cost of transport {cost:.3g}" in said  # along the arc
    for name, value, error in (
        ("yaw_rate", 0.1, 0.01),
        ("lateral_speed", -0.02, 0.003),
    ):
        assert (float(found[name]), float(found[name].error)) == (value, error)


def test_robots_side_by_side_walk_as_alone():
    walkers = [xplorer(1.0, 2.0), xplorer(0.5, 3.0, mass=0.2)]
    walkers.append(
        dataclasses.replace(walkers[0], effects=(Aeration(0.1, 0.4), GrainInertia()))
    )
    together = walk(walkers, QUICK, 2)
    for w, one in zip(walkers, together):
        alone = walk([w], QUICK, 2)[0]
        assert alone.status == one.status
        np.testing.assert_allclose(one.pose[-1], alone.pose[-1], atol=1e-9)
        assert one.speed == pytest.approx(alone.speed, abs=1e-9)
    assert len({round(w.speed, 3) for w in together}) == 3
    assert together[0].settling_time == 0.5 and (
        together[0].lateral_speed,
        together[0].yaw_rate,
    ) == (0.0, 0.0)


def test_every_end_has_its_status_and_no_nan():
    still = dataclasses.replace(scenes.load("sandbot").robot, axle=0.0)
    long = dataclasses.replace(XPLORER.robot, hips=(-0.06,), legs=CLeg(0.05, 0.01))
    light = dataclasses.replace(
        XPLORER.robot, mass=0.03, inertia=0.01
    )  # and slapped by fast legs
    cases = {
        "sunk": Walker(XPLORER.robot, Tripod(2.0), StressMap(zeta=0.005)),
        "stuck": Walker(still, Tripod(0.6), XPLORER.medium),
        "flipped": Walker(long, Tripod(4.0), XPLORER.medium),
        "airborne": Walker(
            light, Tripod(20.0, 0.2, 3.0), XPLORER.medium, (GrainInertia(4.0),)
        ),
        "walking": Walker(
            Roller(2.0, Wheel(0.1, 0.1, 12, 0.015, 0.006)),
            Tripod(1.0, 0.3, 1.0),
            XPLORER.medium,
        ),
    }
    for status, walker in cases.items():
        found = walk([walker], QUICK, 2)[0]
        assert found.status == status and np.isnan(found.settling_time) == (
            status != "walking"
        )
        assert (found.t[-1] < 2 / walker.gait.frequency) == (
            status in ("sunk", "flipped")
        )
        for values in found[:8]:
            if not isinstance(values, str):
                assert np.isfinite(values).all(), status
        more = rerun([walker], dataclasses.replace(QUICK, steps=12), [found], 2)[0]
        assert math.isfinite(more.speed)


ABSURD = {
    "heavy": {"mass": 1e4},
    "top-heavy": {"inertia": 1e-12},
    "fast": {"gait": Tripod(200.0)},
    "hard ground": {"medium": StressMap(zeta=1e6, grazing=0.1)},
    "all jumps": {"medium": StressMap(zeta=0.3, grazing=0.0, tension="cut")},
}


@pytest.mark.parametrize("what", ABSURD)
def test_absurd_robots_end_with_a_status_and_numbers(what):
    changes = dict(ABSURD[what])
    gait, stress = (
        changes.pop("gait", XPLORER.gait),
        changes.pop("medium", XPLORER.medium),
    )
    one = Walker(dataclasses.replace(XPLORER.robot, **changes), gait, stress)
    (found,) = walk([one], Fineness(steps=8, elements=4), 1)
    assert found.status in walking.STATUSES
    for values in (
        *found[:7],
        found.cycles,
        found.drift,
        found.residual,
        found.unsolved_error,
        found.unaccounted,
    ):
        assert np.isfinite(values).all()


def test_slow_robots_walk_as_their_clock_says():
    """The law is rate-independent: so is the way of a cycle, where nothing has momentum, however slow the clock."""
    slow = (1e-3, 2e-2, 5e-2)
    found = walk([xplorer(1.0, f) for f in slow], Fineness(steps=16, elements=6), 3)
    ways = np.array([w.speed / f for w, f in zip(found, slow)])
    assert all(w.periodic and w.unsolved == 0 for w in found)
    np.testing.assert_allclose(ways[:2], ways[2], rtol=0.01)
    assert 0.1 < ways[2] < 2 * np.pi * 0.041
    rest = walk_from_rest(
        _strides([xplorer(1.0, 0.02)], Fineness(steps=16, elements=6)),
        np.array([1000.0]),
    )
    assert (
        rest.status == ["periodic"] and 2 < rest.strides < 20
    )  # further ones need no computing


def test_a_walker_that_speeds_up_slowly_is_not_yet_periodic():
    """At 200 Hz a cycle adds a thousandth of the legs' speed, and a fall turns round between two that are much alike."""
    (found,) = walk([xplorer(1.0, 200.0)], Fineness(steps=8, elements=4, duration=0.2))
    half = np.searchsorted(found.t, 0.1)
    assert 3 * found.twist[half, 0] < found.twist[-1, 0]
    change = np.array([[1e-4, 3e-4, 3e-4, 0.0]])
    np.testing.assert_allclose(
        remaining_change(change, [[2e-4, 3e-4, 1e-4, 0.0]], 50),
        [2e-4, 1.5e-2, 1.5e-2, 0.0],
        rtol=1e-12,
    )


def test_what_is_to_come_is_asked_for_the_cycles_that_are_left(monkeypatch):
    left = []
    monkeypatch.setattr(
        "rft.terradynamics.walking.planar.stride.remaining_change",
        lambda *x: left.append(x[2].tolist()) or np.ones(1),
    )
    walk([xplorer(1.0, 4.0)], Fineness(steps=8, elements=4, duration=0.5))
    assert left == [[1.5], [1.0], [0.5], [0.0]]


def test_what_a_walk_takes_is_told_from_its_first_steps(geomech, tmp_path):
    """Of a body so light that it bounces, of one whose legs are so fast that it takes many cycles to come to their speed."""
    numerics = dataclasses.replace(QUICK, duration=10.0)
    usual, light, fast = (
        walking.walk_cost(
            dataclasses.replace(XPLORER, numerics=numerics, **changes)
        ).balances
        for changes in (
            {},
            {"robot": dataclasses.replace(XPLORER.robot, mass=1e-6)},
            {"gait": Tripod(200.0)},
        )
    )
    assert light > 4 * usual and fast > 100 * usual
    (tmp_path / "light.toml").write_text(
        SMALL.replace("mass = 0.15", "mass = 1e-6").replace("= 2.0\n", "= 2000.0\n")
    )
    code, out, err = geomech("walk", "light.toml")
    assert (code, out) == (2, "") and "say --yes" in err and err.count("\n") == 1, err
    with pytest.raises(
        Refusal,
        match=r"xplorer: after 0 s of computing \d+% is done, and no cycle repeats itself",
    ):
        walking.run(dataclasses.replace(XPLORER, numerics=QUICK), longest=0.0)


def test_a_sweep_takes_the_strides_until_robots_walk_steadily_and_no_more():
    def costs(duration):
        scene = dataclasses.replace(
            XPLORER, numerics=dataclasses.replace(QUICK, duration=duration)
        )
        over = {"gait.frequency": [1.0, 2.0]}
        return Plan(scene, over).cost.balances, walking.walk_cost(scene).balances

    (brief, one), (long, whole) = costs(0.5), costs(20.0)
    assert brief == long and whole > one > 2 * walking.LIMIT * QUICK.steps


def test_a_walk_may_be_over_before_its_first_step():
    (found,) = walk(
        [Walker(ROBOT, Tripod(2.0), SAND)], dataclasses.replace(QUICK, duration=1e-3)
    )
    assert found.t.tolist() == [0.0] and found.speed > 0.0 and found.unaccounted == 0.0
    scene, one = (
        dataclasses.replace(
            XPLORER, numerics=dataclasses.replace(QUICK, duration=1e-3)
        ),
        walking.Walked(found, 0.01),
    )
    said, result = told_of(scene, one)
    assert "cost of transport inf" not in said
    assert plots.walk_figure(result).axes[0].get_xlim() == (0.0, 1e-3)


def test_the_estimate_covers_the_error():
    scene = dataclasses.replace(XPLORER, numerics=QUICK)
    done: list = []
    one = walking.walked([scene], settling=True, progress=done.append)[0]
    assert (
        done == sorted(done) and 0 < done[0] < 0.5 and done[-1] == 1.0 and len(done) > 5
    )
    truth = rerun(
        [scene.walker], dataclasses.replace(QUICK, steps=64, elements=32), [one.walk], 2
    )[0].speed
    assert abs(one.walk.speed - truth) < one.estimate < 0.15 * truth
    sandbot = scenes.load(
        "sandbot"
    )  # at 8 rad/s, where finer outlines rear up another way
    sandbot = dataclasses.replace(
        sandbot, gait=dataclasses.replace(sandbot.gait, frequency=8 / (2 * np.pi))
    )
    one = walking.walked([sandbot], settling=True)[0]
    truth = rerun(
        [sandbot.walker],
        dataclasses.replace(sandbot.numerics, elements=32),
        [one.walk],
        2,
    )[0].speed
    assert 0.08 * truth < abs(one.walk.speed - truth) < one.estimate < 0.2 * truth


def test_a_short_stance_has_steps_enough():
    """The legs of Xplorer turn slowly in a fortieth of the half cycle, in which one step was all there was; half of the steps
    then told nothing of that."""
    for duty, few in ((0.05, 4), (0.9, 4), (0.375, 4)):
        gait = Tripod(2.0, duty)
        counts, half, twice = (
            [n for *_, n in intervals(gait.kinks, steps)] for steps in (32, 16, 64)
        )
        assert min(counts) == few and all(
            n >= 1 for *_, n in intervals(gait.kinks, 4)
        )  # half of the fewest
        assert [2 * n for n in half[::2]] == counts[::2] == [n / 2 for n in twice[::2]]
    scene = dataclasses.replace(
        XPLORER, gait=dataclasses.replace(XPLORER.gait, duty=0.05)
    )
    one = walking.walked([scene], settling=True)[0]
    truth = rerun(
        [scene.walker], dataclasses.replace(scene.numerics, steps=96), [one.walk], 2
    )[0].speed
    assert abs(one.walk.speed - truth) < one.estimate < 0.1 * truth


def test_an_estimate_that_is_small_by_chance_is_not_taken(monkeypatch):
    """Of half and three quarters of the steps the larger change counts, and that with twice the elements besides."""
    from rft.terradynamics.walking import planar_walk

    other = lambda numerics: {
        16: 0.0,
        24: 0.3,
        32: 0.02 if numerics.elements == 24 else 0.0,
    }[numerics.steps]
    means = lambda off: {
        "speed": 1.0 + off,
        "lateral_speed": 0.1 - 2 * off,
        "yaw_rate": 0.2 + 3 * off,
    }
    walk = types.SimpleNamespace(**means(0.0), drift=0.001, unsolved_error=0.0)
    how = types.SimpleNamespace(
        walk=lambda *args, **more: [walk],
        rerun=lambda w, numerics, *rest, **more: [
            types.SimpleNamespace(**means(other(numerics)))
        ],
        variations=planar_walk.variations,
    )
    monkeypatch.setattr(walking, "engine", lambda name: how)
    numerics = dataclasses.replace(XPLORER.numerics, steps=32, elements=12)
    (one,) = walking.walked([dataclasses.replace(XPLORER, numerics=numerics)])
    change = 0.3 + 1.5 * 0.02
    assert (one.steps, one.elements) == pytest.approx((0.3, 0.03))
    assert (one.estimate, one.lateral, one.turning) == pytest.approx(
        (0.001 + change, 2 * change, 3 * change)
    )


def test_trends_of_figure_12():
    """Xplorer is faster at higher frequency, on c-legs than on flat ones, on flat than on reversed ones; SandBot slower with
    more air, and at last no walker."""
    shapes, frequencies, coarse = (
        (1.0, 0.0, -1.0),
        (1.0, 3.0),
        Fineness(steps=12, elements=6),
    )
    speed = np.array(
        [
            w.speed
            for w in walk(
                [xplorer(c, f) for c in shapes for f in frequencies], coarse, 1
            )
        ]
    ).reshape(3, 2)
    assert (np.diff(speed, axis=1) > 0.03).all()
    assert (np.diff(speed, axis=0) < 0).all()
    sandbot = scenes.load("sandbot")
    air = [Aeration(u, 0.25) for u in (0.0, 0.12, 0.24)]
    found = walk(
        [
            Walker(sandbot.robot, Tripod(w), sandbot.medium, (a,))
            for w in (0.4, 1.2)
            for a in air
        ],
        coarse,
        1,
    )
    speed = np.array([w.speed for w in found]).reshape(2, 3)
    assert (np.diff(speed, axis=1) < -0.01).all() and (speed[1] > speed[0])[:2].all()
    assert {found[2].status, found[5].status} <= {"sunk", "stuck"}


def test_a_wheel_bears_its_load_and_pulls_more_the_more_it_slips():
    stress, wheel, slip = (
        VERTICAL["poppy-seeds-loose"].stress,
        Wheel(0.1, 0.08),
        np.linspace(0.0, 0.8, 5),
    )
    found = rolling(stress, wheel, 15.0, 2.0, slip)
    for k, i in enumerate(slip):
        pose, twist = [0.0, 0.1 - found.sinkage[k], 0.3], [(1 - i) * 0.2, 0.0, 2.0]
        one = loads(stress, wheel.outline(100), pose, twist)
        assert (*one.force, -one.moment) == pytest.approx(
            (found.pull[k], 15.0, found.torque[k]), rel=2e-3
        )
    assert (np.diff(found.pull) > 0).all() and found.pull[0] < 0 < found.pull[-1]
    np.testing.assert_allclose(
        rolling(stress, wheel, 15.0, 50.0, slip).pull, found.pull, rtol=1e-9
    )  # no rate without inertia
    slow, fast = (
        rolling(stress, wheel, 15.0, w, slip, [GrainInertia()]) for w in (0.1, 50.0)
    )
    np.testing.assert_allclose(slow.sinkage, found.sinkage, rtol=1e-3)
    assert (fast.sinkage < 0.98 * found.sinkage).all()
    lugs = rolling(stress, Wheel(0.1, 0.08, 12, 0.01, 0.005), 15.0, 2.0, 0.3)
    assert lugs.pull > 2 * np.interp(0.3, slip, found.pull)
    assert np.isnan(rolling(stress, wheel, 1e5, 2.0, 0.3).sinkage)
    with pytest.raises(ValueError, match="load must be a number from 1e-06 to 1e\\+06"):
        rolling(stress, wheel, 1.1e6, 2.0, 0.3)
    with pytest.raises(ValueError, match="slip must be"):
        rolling(stress, wheel, 15.0, 2.0, math.nan)
    with pytest.raises(ValueError, match="has no radius"):
        rolling(stress, scenes.load("square-rod").intruder, 15.0, 2.0, 0.1)


SMALL = XPLORER.text + "\n[numerics]\nsteps = 16\nelements = 8\nduration = 2.0\n"


def test_walk_as_a_command(geomech, tmp_path):
    (tmp_path / "small.toml").write_text(SMALL)
    (tmp_path / "out").mkdir()
    code, out, err = geomech(
        "walk", "small.toml", "--json", "-o", "out", "--plot", "walk.png", "--strip"
    )
    assert (code, err) == (0, "")
    found = from_dict(json.loads(out))
    t, x = found["t"].values, found["x"].values
    assert t[0] == 0 and t[-1] == pytest.approx(2.0)
    assert str(found["status"].values) == "walking"
    late = np.searchsorted(t, [1.0, 2.0 - 1e-9])
    assert np.diff(x[late])[0] / np.diff(t[late])[0] == pytest.approx(
        float(found["speed"]), rel=0.01
    )
    assert 0 < found["speed"].error < 0.1 * float(found["speed"])
    assert {p.name for p in (tmp_path / "out").iterdir()} == {
        "walk.csv",
        "walk.json",
        "walk.nc",
        "walk.txt",
        "walk.png",
    }
    assert (tmp_path / "walk.png").is_file()
    table = np.genfromtxt(tmp_path / "out" / "walk.csv", delimiter=",", names=True)
    work, loss, energy = (
        np.diff(table[name][late])[0] for name in ("work", "loss", "energy")
    )
    assert work - loss == pytest.approx(energy, abs=0.1 * work) and work > 0.1
    np.testing.assert_allclose(
        np.gradient(table["x"], table["t"])[5:-5], table["v_x"][5:-5], atol=0.06
    )


def test_films_of_a_walk_follow_the_robot_and_tell_their_speed(tmp_path):
    """The axes hold the whole way, or go with the robot; 3 Hz is seen at half the speed."""
    scene = dataclasses.replace(
        XPLORER, numerics=dataclasses.replace(QUICK, duration=0.3), gait=Tripod(3.0)
    )
    found = walking.run(scene)
    _, result = told_of(scene, found)
    x, rows, limits = found.walk.pose[:, 0], [0, 5, len(found.walk.t) - 1], {}
    for follow in (False, True):
        ax = plots.figure(4, 2)[1][0, 0]
        update = walk_stage(ax, result, np.array(rows), follow)
        limits[follow] = np.array([update(row) or ax.get_xlim() for row in rows])
    assert (np.ptp(limits[False], axis=0) == 0).all()
    assert (limits[False][0, 0] < x[rows].min()) and (
        x[rows].max() < limits[False][0, 1]
    )
    np.testing.assert_allclose(limits[True].mean(1), x[rows])
    films.write_walk(tmp_path / "film.gif", result, follow=True)
    with Image.open(tmp_path / "film.gif") as film:
        shown = (
            sum(frame.info["duration"] for frame in ImageSequence.Iterator(film)) / 1000
        )
    assert shown == pytest.approx(2 * found.walk.t[-1], abs=0.1)
    (picture,) = films.with_captions(
        iter([np.zeros((90, 400, 3), np.uint8)]), np.array([1.0]), "0.5 × real time"
    )
    assert (
        picture[:30, :120].any() and picture[:30, 280:].any() and not picture[40:].any()
    )


def test_settings_of_a_walk_go_from_coarse_to_fine():
    """Each has a finer reference."""
    for setting in walking.SETTINGS:
        steps = np.diff([*setting.values, walking.FINEST[setting.name]])
        assert min(setting.values) > 0 and ((steps > 0).all() or (steps < 0).all())


def test_sweep_and_accuracy_of_a_walk(geomech, tmp_path, monkeypatch):
    (tmp_path / "small.toml").write_text(
        SMALL.replace("steps = 16", "steps = 10").replace(
            "elements = 8", "elements = 6"
        )
    )
    over = ["--over", "robot.legs.relative_curvature=1", "--over", "gait.frequency=2,3"]
    code, out, err = geomech(
        "sweep", "small.toml", *over, "-o", "s.nc", "--plot", "s.png"
    )
    assert (code, err) == (0, "") and "2 points" in out and "walking" in out
    with netcdf_file(tmp_path / "s.nc", mmap=False) as file:
        speed = file.variables["speed"][:]
        assert file.variables["gait_frequency"][:].tolist() == [
            2,
            3,
        ] and speed.shape == (1, 2)
        assert (np.diff(speed, axis=1) > 0).all()
        assert file.variables["status"].data.tobytes() == 2 * b"walking"
    few = {"steps": (16,), "elements": (6,), "rounding": (4e-3,)}
    settings = tuple(
        dataclasses.replace(setting, values=few[setting.name])
        for setting in walking.SETTINGS
    )
    monkeypatch.setattr(walking, "SETTINGS", settings)
    monkeypatch.setattr(
        walking, "FINEST", {"steps": 24, "elements": 12, "rounding": 2e-3}
    )
    code, out, err = geomech("accuracy", "small.toml", "--json", "--plot", "a.png")
    assert (code, err) == (0, "")
    found = of_json(out)
    assert found["setting"].values.tolist() == ["steps", "elements", "rounding"]
    assert (found["error"].values < 0.05).all()


WRONG = {
    "kind = \"rhex\"": ("kind = \"rex\"", "did you mean 'rhex'"),
    "frequency = 2.0 ": ("frequency = 0 ", "frequency must be a number from 0.001 to 200 Hz, got 0"),
    "mass = 0.15 ": ("mass = -1 ", "mass must be a number"),
    "length = 0.13 ": ("length = 130 ", "length must be a number from 1e-06 to 10 m"),
    "hips = [-0.05, 0.0, 0.05]": ("hips = []", "a robot without legs"),
    "height = 0.03 ": ("heigth = 0.03 ", "did you mean 'height'"),
    "radius = 0.0205 ": ("radius = 20.5 ", "radius must be a number from 1e-06 to 10 m"),
    "[gait]": ("[gate]", "did you mean 'gait'"),
    "[robot.legs]": ("[robot.legz]", "key: 'legz' is unknown: did you mean 'legs'"),
    "sweep_deg = 180": ("sweep_deg = 400", "sweep must be a number"),
    "width = 0.01 ": ("", "width"),
}  # fmt: skip


@pytest.mark.parametrize("right", WRONG)
def test_what_makes_no_robot_is_refused_with_one_line(right, geomech, tmp_path):
    wrong, said = WRONG[right]
    assert right in SMALL
    (tmp_path / "bad.toml").write_text(
        SMALL.replace(right, wrong + " # " if right != "[gait]" else wrong)
    )
    code, out, err = geomech("walk", "bad.toml")
    assert (
        (code, out) == (2, "")
        and err.count("\n") == 1
        and err.startswith("error: ")
        and said in err
    ), err


def test_other_refusals(geomech, tmp_path):
    legless = SMALL[: SMALL.index("[robot.legs]")] + SMALL[SMALL.index("[gait]") :]
    (tmp_path / "bad.toml").write_text(legless)
    (tmp_path / "small.toml").write_text(SMALL)
    weightless = (
        SMALL[: SMALL.index("[robot]")]
        + '[robot]\nkind = "wheel"\n'
        + SMALL[SMALL.index("[robot.legs]") :]
    )
    (tmp_path / "wheel.toml").write_text(weightless)
    for args, said in (
        (("walk", "wheel.toml"), "[robot] has no `mass`: add mass = ..., in kg"),
        (("walk", "bad.toml"), "the table [robot.legs] is missing: add it"),
        (
            ("walk", "small.toml", "--engine", "fast"),
            "engine must be one of planar, mujoco",
        ),
        (("walk", "three-link-glass"), "does not walk"),
        (("walk", "small.toml", "-o", "film.avi"), "end the name in"),
        (("walk", "small.toml", "-o", ""), "empty name"),
        (("displacement", "xplorer", "--amplitudes", "1"), "no shape space"),
        (("intrude", "xplorer"), "no [intruder]"),
        (
            ("sweep", "xplorer", "--over", "gait.frequency=0,1", "-o", "s.nc"),
            "frequency must be",
        ),
        (("sweep", "xplorer", "--over", "robot.legs.radios=1", "-o", "s.nc"), "radios"),
        (
            (
                "sweep",
                "sandbot",
                "--over",
                "effects.aeration.air_speed=0.3",
                "-o",
                "s.nc",
            ),
            "fluidised",
        ),
    ):
        code, out, err = geomech(*args)
        assert (code, out) == (2, "") and err.count("\n") == 1 and said in err, err
    with pytest.raises(
        ValueError, match="takes the effects aeration and grain-inertia, not slope"
    ):
        Walker(ROBOT, Tripod(1.0), SAND, (Slope(0.1),))
    with pytest.raises(ValueError, match="a robot without legs"):
        dataclasses.replace(ROBOT, legs=None)
    with pytest.raises(ValueError, match="hips must be a list of x in m"):
        dataclasses.replace(ROBOT, hips=((-0.05, 0.06),))
    with pytest.raises(ValueError, match="engine must be one of"):
        engine(3)


@pytest.mark.parametrize("name", scenes.walker_names())
def test_a_walker_written_is_the_walker_read(name):
    scene = scenes.load(name)
    assert isinstance(scene, WalkerScene) and scenes.toml(scene) == scene.text
    weaker = {"zeta": 0.8} if isinstance(scene.medium, StressMap) else {"xi_n": 2e5}
    anew = dataclasses.replace(
        scene, text="", medium=dataclasses.replace(scene.medium, **weaker)
    )
    assert scenes.parse(scenes.toml(anew), name) == anew
    assert scenes.inputs(scene) == []
    with pytest.raises(Refusal, match="numerics must be Fineness"):
        dataclasses.replace(scene, numerics=3)


def test_an_eccentric_wheel_is_a_leg():
    rod = dataclasses.replace(ROBOT, legs=RoundRod(0.02, 0.01), axle=0.015)
    np.testing.assert_allclose(
        rod.leg(20).points, RoundRod(0.02, 0.01).outline(20).points - [0, 0.015]
    )


def test_figures_of_walking_are_drawn(tmp_path, monkeypatch):
    from figures.paper import fig12_walking
    from figures.robots import walking_sensitivity, walking_steps
    from figures.terradynamics import wheel

    coarse = Fineness(steps=8, elements=4, duration=1.0)
    for module in (fig12_walking, walking_sensitivity, walking_steps):
        monkeypatch.setattr(
            module,
            "load",
            lambda name: dataclasses.replace(scenes.load(name), numerics=coarse),
        )
    told = types.SimpleNamespace(
        walk=types.SimpleNamespace(speed=0.1, status="stuck"), estimate=0.01
    )
    many = types.SimpleNamespace(walked=lambda some, settling: [told for _ in some])
    monkeypatch.setattr(walking_sensitivity, "walking", many)
    made = {
        fig12_walking: fig12_walking.compute([1.0], [3.0], [4.0], [0.0]),
        walking_sensitivity: walking_sensitivity.compute(),
        walking_steps: walking_steps.compute(
            {"implicit": (16, 32), "explicit": (64,)}, 48, (3.0,)
        ),
        wheel: wheel.compute(slips=4),
    }
    axes = {
        module: drawn(module, numbers, tmp_path).axes
        for module, numbers in made.items()
    }
    walk, _, flow = made[fig12_walking].values()
    np.testing.assert_allclose(
        axes[fig12_walking][0].lines[0].get_ydata(),
        walk.walk.twist[walk.walk.t <= 3.0, 0],
    )
    row = fig12_walking.table(made[fig12_walking]).splitlines()[-1]
    status = flow["status"].values[0, 0].replace("walking", "").split()
    assert row.split() == [
        "at",
        "0.637",
        "Hz",
        f"{flow['speed'].values[0, 0]:.3f}",
        *status,
    ]
    sandbot = scenes.load("sandbot")
    other = lambda name: walking_sensitivity.CHOICES.get(name, (1.0, 1.4))[1]
    wide = [
        walking_sensitivity.with_change(sandbot, name, other(name))
        for name in walking_sensitivity.NAMES
    ]
    assert wide[-2].medium.tension == "cut" and wide[-1].robot.belly(8).points[
        :, 1
    ] == pytest.approx(-0.025)
    assert all(
        walking_sensitivity.with_change(sandbot, n, some[0]) == sandbot
        for n, some in walking_sensitivity.CHOICES.items()
    )
    assert walking_sensitivity.table(made[walking_sensitivity]).count("+0") == 5 * (
        2 * 8 + 2
    )
    assert all(a != b for a, b in zip(wide, [sandbot, *wide]))
    assert wide[0].robot.axle == pytest.approx(1.4 * sandbot.robot.axle)
    (_, _, left), (_, _, chattering) = made[walking_steps][3.0].values()
    assert left[-1] < 0.02 and (chattering > 0).all()
    left_of_energy = axes[walking_steps][1]
    np.testing.assert_allclose(curve(left_of_energy, "explicit"), [[64], chattering])
    smooth, lugs = made[wheel]["wheels"].values()
    np.testing.assert_allclose(
        curve(axes[wheel][3], "30 rad/s"),
        [made[wheel]["slip"], 1e3 * lugs[30.0].sinkage],
    )
    assert (
        smooth[60.0].pull[2]
        < smooth[0.0].pull[2]
        < lugs[0.0].pull[2]
        < lugs[60.0].pull[2]
    )


@pytest.mark.parametrize(
    "effort",
    [EFFORT, Effort(np.array([[1.0, 3.0, 1.0]]).T, 3.0, 0.25)],
    ids=["all", "cut short"],
)
@pytest.mark.parametrize("tension", ["keep", "cut"])
def test_compiled_steps_are_those_by_numpy(tension, effort, monkeypatch):
    """Robots side by side on legs and a belly, of which one comes to an end, and a wheel."""
    pytest.importorskip("numba")
    monkeypatch.setattr("rft.terradynamics.walking.planar.march.EFFORT", effort)
    medium, air = (
        dataclasses.replace(SAND, tension=tension),
        (Aeration(0.01, 0.03), GrainInertia(2.0, 700.0)),
    )
    legged = [
        Walker(xplorer(c, 2.0).robot, Tripod(f), medium, air)
        for c, f in ((1.0, 2.0), (-0.4, 3.1), (0.2, 20.0))
    ]
    lugs, unsolved, stopped = Wheel(0.05, 0.02, 5, 0.01, 0.006), [], []
    for walkers in (legged, [Walker(Roller(0.08, lugs), Tripod(0.7), medium)]):
        strides = _strides(walkers, dataclasses.replace(QUICK, steps=8))
        at = (
            strides.robots,
            np.arange(len(walkers)),
            strides.robots.start(),
            strides.phases,
            strides.rate_phases,
        )
        ends, found = (
            (strides.top, strides.airborne_height * [1.0, 1.0, 0.1][: len(walkers)]),
            {},
        )
        for backend in ("numpy", "numba"):
            with preferring(backend):
                found[backend] = march(*at, ends)
        (slow, tries), (fast, others) = found.values()
        np.testing.assert_array_equal(tries, others)
        np.testing.assert_allclose(
            fast.to_array(), slow.to_array(), rtol=1e-7, atol=1e-9
        )
        unsolved.append(slow.unsolved[-1].sum())
        stopped.append((slow.pose[-1] == slow.pose[-2]).all(-1).tolist())
    assert any(unsolved) == (effort is not EFFORT) and stopped == [
        [False, False, True],
        [False],
    ]


def test_steps_that_are_not_solved_are_told(monkeypatch):
    """With Newton's method cut short some are not; the walk tells how far that moves its speed, and it is no farther off."""
    robot, scene = xplorer(1.0, 2.0), dataclasses.replace(XPLORER, numerics=QUICK)
    (right,) = walk([robot], QUICK, 1)
    assert (right.unsolved, right.unsolved_error) == (
        0,
        0.0,
    ) and 0 < right.residual <= 1e-3 * QUICK.rounding
    for tries in (2.0, 4.0):
        monkeypatch.setattr(
            "rft.terradynamics.walking.planar.march.EFFORT",
            Effort(np.ones((1, 1)), tries, 0.5),
        )
        (found,) = walk([robot], QUICK, 1)
        assert found.unsolved > 0 and found.residual > 0.01
        assert (
            1e-4
            < abs(found.speed - right.speed)
            < found.unsolved_error
            < right.speed / 5
        )
    one = walking.walked([scene], settling=True)[0]
    assert one.estimate > one.walk.unsolved_error > 0
    said = told_of(scene, one)[0]
    assert f"{one.walk.unsolved} steps were taken unsolved, off by up to" in said


@pytest.mark.parametrize(
    "name", [n for n in scenes.walker_names() if scenes.load(n).engine == "planar"]
)
def test_walks_as_they_are_built_in_are_solved_and_account_for_their_energy(name):
    scene = scenes.load(name)
    (found,) = walk(
        [scene.walker],
        dataclasses.replace(scene.numerics, duration=1.5 / scene.gait.frequency),
    )
    assert found.unsolved == 0 and found.residual <= 1e-3 * scene.numerics.rounding
    assert 0 < found.unaccounted < 0.03
    left = found.work[-1] - found.loss[-1] - np.diff(found.energy[[0, -1]])[0]
    assert found.unaccounted == pytest.approx(abs(left) / found.work[-1])


def test_explain_tells_the_robot_its_engine_and_effects():
    told = description(scenes.load("sandbot"))
    assert "sandbot: Rhex (mass = 2.3" in told and "engine: planar" in told
    assert "on:  aeration (air_speed" in told and told.endswith(
        "off, not evaluated: grain-inertia"
    )
    assert "engine: mujoco" in description(scenes.load("screws"))


def test_axes_of_a_sweep_have_units():
    from geomech import plots

    many = {
        "speed": np.ones((2, 3)),
        "estimate": np.zeros((2, 3)),
        "status": np.full((2, 3), "walking"),
    }
    over = {"gait.frequency": [1.0, 2.0], "robot.mass": [0.1, 0.2, 0.3]}
    table = of_swept({"over": over, **many})
    (ax,) = plots.sweep_figure(scenes.load("xplorer"), table).axes
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("frequency (Hz)", "mean speed (m/s)")
    assert [t.get_text() for t in ax.get_legend().get_texts()] == [
        "mass (kg): 0.1",
        "mass (kg): 0.2",
        "mass (kg): 0.3",
    ]
    one = {
        "over": {"robot.legs.relative_curvature": [0.0, 1.0]},
        **{k: v[:, 0] for k, v in many.items()},
    }
    (ax,) = plots.sweep_figure(scenes.load("xplorer"), of_swept(one)).axes
    assert ax.get_xlabel() == "relative_curvature (-)" and ax.get_legend() is None


def test_a_robot_limps_whose_every_second_stride_is_alike():
    """By less than half of what one stride changes, where that is more than nothing."""
    starts = lambda before, last, now: map_period(
        *(np.array([[0.0], [x]]) for x in (before, last, now))
    )
    assert [int(starts(0.0, -0.1, x)[0]) for x in (0.099, 0.101, -0.05)] == [2, 1, 1]
    assert [int(starts(0.0, -x, 0.0)[0]) for x in (0.99e-3, 1.01e-3)] == [1, 2]


@pytest.mark.parametrize("period", [1, 2])
def test_slopes_at_a_limit_foretell_the_strides_on_the_way_to_it(period):
    """Each map of so many strides takes the distance on, and adds what the gains make of it to the progress of each."""
    slopes, gains = np.array([[0.6, -0.3], [0.2, 0.5]]), np.array([0.03, -0.07])
    fake = types.SimpleNamespace(
        cycle=2, scaled_state=lambda state, index: np.array([[state], [2.0 * state]])
    )
    found = predicted_progress(fake, Limit(0.1, period, slopes, gains), 0.6, 0, 0.02)
    distance = [
        np.linalg.matrix_power(slopes, k // period) @ [0.5, 1.0] for k in range(2000)
    ]
    np.testing.assert_allclose(
        found, 0.02 + np.array(distance) @ gains / period, rtol=1e-9
    )


def test_strides_that_repeat_themselves_go_on_until_the_walk_is_over():
    """Time, way and the sums of energies grow, all else recurs; a walk that does not repeat itself ends where it ends."""

    def rows(t):
        rocks = np.sin(4 * np.pi * t)
        return np.stack(
            [t, 0.3 * t, rocks, -rocks, 0.3 + 0 * t, rocks, rocks, 2.0 * t, 1.5 * t], -1
        )

    times = [np.zeros(1), *np.arange(1, 5)[:, None] / 4 + np.array([-0.125, 0.0])]
    for cycle, duration, last in (
        (2, 2.3, 2.25),
        (4, 2.0, 2.0),
        (2, 1.0, 1.0),
        (2, 0.6, 0.5),
        (0, 2.3, 1.0),
    ):
        found = _rows_until([rows(t) for t in times], cycle, duration)
        np.testing.assert_allclose(
            found, rows(np.arange(0, last + 1e-9, 0.125)), atol=1e-12
        )


@pytest.mark.parametrize(
    ("stage", "ended", "halved", "after"),
    [
        ((1.0, 0.0), True, False, (1.0, 0.0, True)), ((1.0, 0.0), False, True, (0.5, 0.0, False)),
        ((0.5, 0.0), True, False, (0.5, 0.5, False)), ((0.5, 0.5), True, False, (1.0, 0.0, True)),
        ((0.25, 0.25), True, False, (0.5, 0.5, False)), ((0.125, 0.375), True, False, (0.5, 0.5, False)),
        ((0.125, 0.125), True, False, (0.25, 0.25, False)), ((0.125, 0.25), True, False, (0.125, 0.375, False)),
        ((0.25, 0.5), False, True, (0.125, 0.5, False)), ((0.25, 0.5), False, False, (0.25, 0.5, False)),
        ((0.125, 0.875), True, False, (1.0, 0.0, True)),
    ],
)  # fmt: skip
def test_parts_of_a_step_that_were_halved_join_again(stage, ended, halved, after):
    part, elapsed = np.array(stage)[:, None]
    found = next_part(
        types.SimpleNamespace(part=part, elapsed=elapsed),
        np.array([ended]),
        np.array([halved]),
    )
    assert tuple(x[0] for x in found) == after


def test_a_step_of_newtons_method_goes_to_the_zero_of_a_line_but_not_too_far():
    """Of robots whose residual is S (v - w): one near its zero, one that is far off, and one whose residual grew."""
    S, k, reach = (
        np.array([[2.0, 0.3, -0.1], [0.4, 1.5, 0.2], [-0.2, 0.1, 0.7]]),
        0.01,
        0.05,
    )
    w, v = (
        np.array([0.3, -0.2, 4.0]),
        np.array([[0.1, 0.1, 2.0], [-9.0, 2.0, 1.0], [0.1, 0.1, 2.0]]).T,
    )
    start = start_of_step((0.0 * v), tuple(v), *np.zeros((5, 3))).newton
    last = start._replace(
        residual=np.array([np.inf, np.inf, 1e-3]),
        step=tuple(np.full((3, 3), 0.8)),
        best=tuple(0.5 * v),
    )
    power = np.full(3, 7.0), np.full(3, 5.0)
    residual = S @ (v - w[:, None])
    slopes = tuple(tuple(np.full(3, x) for x in column) for column in S.T)
    step, solved, failed = newton_step(
        last, tuple(residual), slopes, power, k, reach, 1e-6, EFFORT
    )
    assert (
        not solved.any() and not failed.any() and step.evaluations.tolist() == [1.0] * 3
    )
    far = (
        0.5 * reach / k / 9.3
    )  # a half of its reach in the step's time, over the fastest rate
    np.testing.assert_allclose(step.share, [1.0, far, 0.5])
    np.testing.assert_allclose(np.array(step.trial)[:, 0], w)
    np.testing.assert_allclose(
        np.array(step.trial)[:, 1], v[:, 1] + far * (w - v[:, 1])
    )
    np.testing.assert_allclose(np.array(step.trial)[:, 2], 0.5 * v[:, 2] + 0.5 * 0.8)
    size = np.abs(residual * [[1.0], [1.0], [reach]]).max(0)
    np.testing.assert_allclose(step.residual, [*size[:2], 1e-3])
    assert [x.tolist() for x in step.power] == [[7.0, 7.0, 0.0], [5.0, 5.0, 0.0]]
    more, solved, failed = newton_step(
        step,
        tuple(S @ (np.array(step.trial) - w[:, None])),
        slopes,
        power,
        k,
        reach,
        1e-6,
        EFFORT,
    )
    assert (
        solved.tolist() == [True, False, False]
        and not failed.any()
        and more.share[2] == 0.25
    )
    for share, tries, ends in (
        (0.11, 3.0, False),
        (0.09, 3.0, True),
        (1.0, 12.0, False),
        (1.0, 13.0, True),
    ):
        late = last._replace(
            share=np.full(3, share),
            evaluations=np.full(3, tries),
            residual=np.full(3, 1e-9),
        )
        assert (
            newton_step(late, tuple(residual), slopes, power, k, reach, 1e-6, EFFORT)[
                2
            ].tolist()
            == [ends] * 3
        )


def test_a_part_of_a_step_adds_what_its_stages_did():
    """Powers by the weights of its stages, and the residuals of those that were not solved; else all stays."""
    first = tuple(np.full(4, x) for x in (3.0, 2.0)), np.array([1e-9, 1e-9, 5e-3, 1e-9])
    stage = types.SimpleNamespace(
        base=(1.0, 2.0, 3.0), first_result=(*first[0], first[1])
    )
    best, power = (0.1, 0.2, 0.3), (np.full(4, 10.0), np.full(4, 20.0))
    newton = types.SimpleNamespace(
        best=best, power=power, residual=np.array([1e-8, 2e-3, 1e-3, 2e-3])
    )
    old = start_of_step(
        (0.5, 0.6, 0.7),
        (0.0, 0.0, 0.0),
        *np.array([1.0, 4.0, 2.0, 0.1, 1e-3])[:, None] * np.ones(4),
    ).accepted
    h, k = 0.1, (1 - 0.5**0.5) * 0.1
    new = end_of_part(
        old, stage, newton, np.array([True, True, True, False]), 1e-6, k, h
    )
    np.testing.assert_allclose(
        np.array(new.pose)[:, 0], [1 + 0.1 * k, 2 + 0.2 * k, 3 + 0.3 * k]
    )
    np.testing.assert_allclose(
        [x[3] for x in (*new.pose, *new.twist)], [0.5, 0.6, 0.7, 0.0, 0.0, 0.0]
    )
    np.testing.assert_allclose(np.array(new.twist)[:, 0], best)
    np.testing.assert_allclose(new.work - 1.0, [3.0 * (h - k) + 10.0 * k] * 3 + [0.0])
    np.testing.assert_allclose(new.loss - 4.0, [2.0 * (h - k) + 20.0 * k] * 3 + [0.0])
    assert new.unsolved.tolist() == [2.0, 3.0, 3.0, 2.0]
    np.testing.assert_allclose(new.defect, [0.1, 0.102, 0.106, 0.1])
    np.testing.assert_allclose(new.residual, [1e-3, 2e-3, 5e-3, 1e-3])


def test_a_trial_counts_as_better_where_the_largest_speed_falls_by_a_tenth_of_what_is_foretold():
    """Speeds of a body's ends count like others; what is no number is never better."""
    assert [
        largest_speed(v, 0.5)
        for v in ((1.0, -2.0, 3.0), (1.0, -2.0, -5.0), (-3.0, 1.0, 1.0))
    ] == [2.0, 2.5, 3.0]
    start = start_of_step((0.0,) * 3, (0.0,) * 3, *np.zeros(5)).newton
    slopes, power = tuple(map(tuple, np.eye(3))), (0.0, 0.0)
    for share, old, better in (
        (1.0, 1.12, True),
        (1.0, 1.1, False),
        (0.5, 1.06, True),
        (0.5, 1.04, False),
    ):
        last = start._replace(residual=old, share=share, best=(9.0, 9.0, 9.0))
        found, *_ = newton_step(
            last, (1.0, 0.5, 0.2), slopes, power, 1e-9, 0.5, 1e-6, EFFORT
        )
        assert (found.best == (0.0, 0.0, 0.0)) is better and found.share == (
            1.0 if better else share / 2
        )
    for bad in (np.inf, np.nan):
        for residual in ((bad, 0.1, 0.1), (0.1, bad, 0.1), (0.1, 0.1, bad)):
            with np.errstate(invalid="ignore"):
                found, solved, _ = newton_step(
                    start, residual, slopes, power, 1e-9, 0.5, 1e-6, EFFORT
                )
            assert not solved and found.share == 0.5 and found.residual == np.inf


def test_a_robot_comes_to_an_end_above_its_reach_below_its_top_and_on_its_back():
    """Of a robot whose farthest hip and legs are known; on an axle that is kept level neither pitch nor its rate is free."""
    rod = dataclasses.replace(ROBOT, legs=RoundRod(0.02, 0.012))
    strides = _strides(
        [Walker(rod, Tripod(2.0), SAND), Walker(rod, Tripod(3.0), SAND)], QUICK
    )
    reach, height = 0.022, 0.03  # the axle is 2 mm off the middle of the rod
    farthest = reach + math.hypot(0.06, 0.004) + height
    assert strides.reach == pytest.approx([reach] * 2, rel=0.02)
    one = np.zeros(1, int)
    for z, pitch, status in (
        (farthest + 1e-3, 0.0, "airborne"), (farthest - 1e-3, 0.0, ""), (-0.0151, 0.0, "sunk"), (-0.0149, 0.0, ""),
        (0.0, 1.58, "flipped"), (0.0, -1.58, "flipped"), (0.0, -1.57, ""),
    ):  # fmt: skip
        assert strides.end_status(State.at_rest(np.array([[7.0, z, pitch]])), one) == [
            status
        ]
    speed = 2 * np.pi * np.array([2.0, 3.0]) * strides.reach
    state = State.at_rest(np.array([[9.0, 0.1, 0.2]] * 2))._replace(
        twist=np.array([[0.3, 0.4, 0.5]] * 2)
    )
    scaled = [
        0.1 / strides.reach,
        [0.2] * 2,
        0.3 / speed,
        0.4 / speed,
        0.5 * strides.reach / speed,
    ]
    np.testing.assert_allclose(strides.scaled_state(state, np.arange(2)), scaled)
    moved = strides.with_scaled_state(state, 2 * np.array(scaled), np.arange(2))
    np.testing.assert_allclose(
        [*moved.pose[1], *moved.twist[1]], [9.0, 0.2, 0.4, 0.6, 0.8, 1.0]
    )
    roller = _strides(
        [Walker(Roller(1.0, RoundRod(0.05, 0.02)), Tripod(1.0, 0.3), SAND)], QUICK
    )
    assert roller.scaled_state(state.take([0]), one)[:, 0] == pytest.approx(
        np.array([0.1, 0.3 / (2 * np.pi), 0.4 / (2 * np.pi)]) / 0.05
    )
    kinks = roller.phases[np.flatnonzero(np.diff(roller.rate_phases) != 0) + 1]
    assert (strides.cycle, roller.cycle) == (2, 1) and kinks == pytest.approx(
        [0.15, 0.35, 0.5, 0.65, 0.85]
    )
    assert (
        roller.phases[[0, -1]] == pytest.approx([0.0, 1.0])
        and strides.phases[-1] == 0.5
    )


def test_equations_without_a_solution_are_answered_by_nothing():
    slopes = np.array(
        [[[2.0, 1.0], [0.0, 4.0]], [[1.0, 2.0], [2.0, 4.0]], [[0.0, 1.0], [1.0, 0.0]]]
    )
    right = np.array([[3.0, 4.0], [1.0, 1.0], [5.0, 6.0]])
    np.testing.assert_allclose(
        solve_regular(slopes, right), [[1.0, 1.0], [0.0, 0.0], [6.0, 5.0]]
    )
    np.testing.assert_allclose(
        solve_regular(slopes[::2], right[::2]), [[1.0, 1.0], [6.0, 5.0]]
    )


def test_the_rounding_of_slow_legs_is_a_twentieth_of_the_speed_of_their_ends():
    found = walking_rounding(3e-3, np.array([1e-9, 0.1, 1.0]), 0.05)
    np.testing.assert_allclose(found, [1e-7, 0.05 * 2 * np.pi * 0.1 * 0.05, 3e-3])
