"""Walking robots: the clock, the engine against independent sums, its order and energy,
limit cycles, ends, errors."""

import dataclasses
import itertools
import math
import types

import numpy as np
import pytest
from artists import drawn
from refusals import refuses
from scipy.spatial.transform import Rotation

from figures.robots import walking_sensitivity, walking_steps
from figures.terradynamics import meshes, wheel
from geomech import scenes
from geomech.questions.terradynamics.walk import Walk
from geomech.studies.terradynamics import walking
from rft.balance.backend import preferring
from rft.core.metres import GRAVITY
from rft.terradynamics.ground import Aeration, DisturbedGround, GrainInertia
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
    limit_cycles,
    predicted_progress,
)
from rft.terradynamics.walking.planar.march import march, step
from rft.terradynamics.walking.planar.stride import (
    cycles_to_settle,
    walk_from_rest,
)
from rft.terradynamics.walking.planar_walk import batch_strides, rerun, walk
from rft.terradynamics.walking.robot import walking_rounding

pytestmark = pytest.mark.usefixtures("fastest")
SAND = StressMap(zeta=0.3, grazing=math.radians(5))
LEG = CLeg(0.025, 0.012, 0.6)
HIPS = (-0.05, 0.06)
ROBOT = Rhex(0.2, 0.15, 0.03, 0.06, LEG, HIPS, hip_height=-0.004, axle=0.002)
LIGHT_ROD = dataclasses.replace(ROBOT, legs=RoundRod(0.02, 0.012))
QUICK = Fineness(steps=16, elements=8, duration=2.0)
COARSE = Fineness(steps=12, elements=6)
XPLORER = scenes.load("xplorer")
SANDBOT = scenes.load("sandbot")
QUICK_XPLORER = dataclasses.replace(XPLORER, numerics=QUICK)


def xplorer(curvature=1.0, frequency=2.0, **changes):
    legs = dataclasses.replace(XPLORER.robot.legs, relative_curvature=curvature)
    robot = dataclasses.replace(XPLORER.robot, legs=legs, **changes)
    return Walker(robot, Tripod(frequency), XPLORER.medium)


@pytest.mark.parametrize(
    "gait", [Tripod(2.0), Tripod(1.3, 0.4, 1.1, 0.3), Tripod(0.7, 0.7, 2.0, -0.2)]
)
def test_the_clock_turns_once_a_cycle_and_sweeps_while_it_stands(gait):
    phase = np.linspace(-1.3, 2.1, 3401)
    angle = gait.angle(phase, phase)
    fastest = max(gait.rate(0.0), gait.rate(0.5))
    assert np.abs(np.diff(angle)).max() < 1.001e-3 * fastest  # no jump
    turn = gait.angle(phase + 1, phase + 1) - angle
    np.testing.assert_allclose(turn, 2 * np.pi, atol=1e-12)
    half = gait.duty / 2 - 1e-12
    sweep = gait.angle(half, half) - gait.angle(-half, -half)
    assert sweep == pytest.approx(gait.sweep, abs=1e-9)
    assert gait.angle(0.0, 0.0) == pytest.approx(gait.middle)
    # Its rate jumps at the kinks alone.
    smooth = np.abs(phase[:, None] % 0.5 - gait.kinks).min(1) > 1.5e-3
    slopes = np.gradient(angle, phase)
    np.testing.assert_allclose(slopes[smooth], gait.rate(phase)[smooth], rtol=1e-6)


def fall(steps, time=0.12):
    """Return Xplorer at 4 Hz at rest, after a while, and its equations."""
    robots = batch_strides([xplorer(frequency=4.0)], QUICK).robots
    first = robots.start()
    state = first
    dt = time / steps
    for k in range(steps):
        state = step(robots, state, 4.0 * dt * k, 4.0 * dt * (k + 0.5), dt)
    return first, state, robots


def test_steps_are_of_order_two_and_energy_is_kept_to_that():
    """Motors' work = loss in the ground + change of the body's energy."""
    finest = fall(512)[1].pose
    errors = []
    for steps in (16, 32, 64):
        first, last, robots = fall(steps)
        of_pose = np.abs(last.pose - finest).max() / np.abs(finest).max()
        gain = robots.energy(last) - robots.energy(first)
        of_energy = np.abs(last.work - last.loss - gain)[0] / last.work[0]
        errors.append([of_pose, of_energy])
    orders = -np.polyfit(np.log([16, 32, 64]), np.log(errors), 1)[0]
    assert (orders > 1.7).all()
    assert max(errors[-1]) < 2e-3


def test_the_limit_cycle_is_that_of_many_strides():
    """Of a quick walker, of one that drags its belly and swings for fifty strides, and
    of one that limps. The first and the last come to it by themselves."""
    walkers = [xplorer(c, f) for c, f in ((0.3, 3.0), (-0.6, 3.25), (1.0, 4.0))]
    strides = batch_strides(walkers, COARSE)
    robots = np.arange(3)

    def after_strides(state, count):
        for _ in range(count):
            state = strides.run(state, 0, robots)[1].take(-1)
        return state

    rest = walk_from_rest(strides, 3 / strides.frequency)
    assert rest.period.tolist() == [1, 1, 2]
    limits = [Limit(rest.state.take([k]), rest.period[k]) for k in robots]
    found = limit_cycles(strides, limits)
    assert found.periodic.all()
    late = after_strides(rest.state, 9)
    moved = after_strides(late, 2).pose[:, 0] - late.pose[:, 0]
    np.testing.assert_allclose(2 * found.progress[::2], moved[::2], rtol=2e-3)
    first = State(*map(np.concatenate, zip(*(one.state for one in found.limits))))
    last = after_strides(first, 2)
    moved = last.pose[:, 0] - first.pose[:, 0]
    np.testing.assert_allclose(moved, 2 * found.progress, rtol=5e-3)


@pytest.mark.parametrize(
    ("progress", "limit", "cycles"),
    [
        ([-2.09, -1.91], -2.0, 0),
        ([-2.0, -1.8, -2.09], -2.0, 2),
        ([-2.0, -2.2], -2.0, np.inf),
        ([], -2.0, np.inf),
        ([1.0, np.nan, 1.0], 1.0, 2),
    ],
)
def test_a_walk_has_settled_once_all_cycles_are_near_the_limit(progress, limit, cycles):
    assert cycles_to_settle(progress, limit) == cycles


@pytest.mark.parametrize("period", [1, 2])
def test_slopes_foretell_a_thousand_cycles_of_strides(period):
    """Of a map that halves a deviation, with each of its periods."""
    strides = types.SimpleNamespace(cycle=2, scaled_state=lambda x, robots: x[:, None])
    limit = Limit(np.ones(1), period, np.array([[0.5]]), np.array([0.3]))
    moves = predicted_progress(strides, limit, np.array([1.4]), 0, 0.2)
    maps = np.arange(2000) // period
    np.testing.assert_allclose(moves, 0.2 + 0.12 * 0.5**maps / period, rtol=1e-12)


def test_cost_of_transport_is_work_over_weight_times_way_along_an_arc_too():
    (one,) = walk([xplorer()], QUICK, 1)
    t = np.linspace(0.0, 4.0, 33)
    pose = np.stack([2.5 * np.sin(0.1 * t), 0 * t, 0 * t], -1)
    y = 2.5 * (1 - np.cos(0.1 * t))
    arc = one._replace(t=t, pose=pose, work=0.6 * t, spatial={"y": y})
    cost = walking.cost_of_transport(XPLORER, arc)
    assert cost == pytest.approx(0.6 / (0.15 * 9.81 * 0.25), rel=1e-3)
    still = arc._replace(pose=0 * pose, spatial=None)
    assert walking.cost_of_transport(XPLORER, still) == math.inf


def walk_numbers(one):
    """Return all numbers of a walk that must be finite."""
    means = [one.speed, one.cycles, one.drift, one.residual, one.unsolved_error]
    series = [one.t, one.pose, one.twist, one.work, one.loss, one.energy]
    return np.concatenate([np.ravel(x) for x in (*series, means, one.unaccounted)])


STILL = dataclasses.replace(SANDBOT.robot, axle=0.0)
LONG = dataclasses.replace(XPLORER.robot, hips=(-0.06,), legs=CLeg(0.05, 0.01))
SLAPPED = dataclasses.replace(XPLORER.robot, mass=0.03, inertia=0.01)
ROLLER = Roller(2.0, Wheel(0.1, 0.1, 12, 0.015, 0.006))
POPPY = XPLORER.medium
ENDS = {
    "sunk": Walker(XPLORER.robot, Tripod(2.0), StressMap(zeta=0.005)),
    "stuck": Walker(STILL, Tripod(0.6), POPPY),
    "flipped": Walker(LONG, Tripod(4.0), POPPY),
    "airborne": Walker(SLAPPED, Tripod(20.0, 0.2, 3.0), POPPY, (GrainInertia(4.0),)),
    "walking": Walker(ROLLER, Tripod(1.0, 0.3, 1.0), POPPY),
}


@pytest.mark.parametrize("status", ENDS)
def test_every_end_has_its_status_and_no_nan(status):
    walker = ENDS[status]
    (found,) = walk([walker], QUICK, 2)
    assert found.status == status
    assert np.isfinite(walk_numbers(found)).all()
    lasted = found.t[-1] * walker.gait.frequency
    assert found.cycles >= lasted - 1e-9
    if lasted < 2:  # it ended before its time
        assert found.cycles == pytest.approx(lasted)
    (again,) = rerun([walker], dataclasses.replace(QUICK, steps=12), [found], 2)
    assert math.isfinite(again.speed)


ABSURD = {
    "heavy": Walker(dataclasses.replace(XPLORER.robot, mass=1e4), Tripod(2.0), POPPY),
    "top-heavy": xplorer(inertia=1e-12),
    "fast": xplorer(frequency=200.0),
    "hard ground": Walker(XPLORER.robot, Tripod(2.0), StressMap(zeta=1e6, grazing=0.1)),
    "all jumps": Walker(
        XPLORER.robot, Tripod(2.0), StressMap(zeta=0.3, grazing=0.0, tension="cut")
    ),
}


@pytest.mark.parametrize("what", ABSURD)
def test_absurd_robots_end_with_a_status_and_numbers(what):
    (found,) = walk([ABSURD[what]], Fineness(steps=8, elements=4), 1)
    assert found.status in walking.STATUSES
    assert np.isfinite(walk_numbers(found)).all()


def test_slow_robots_walk_as_their_clock_says():
    """The law is rate-independent. Where nothing has momentum, so is the way of a
    cycle, however slow the clock."""
    slow = (1e-3, 2e-2, 5e-2)
    coarse = dataclasses.replace(COARSE, steps=16)
    found = walk([xplorer(1.0, f) for f in slow], coarse, 3)
    ways = np.array([w.speed / f for w, f in zip(found, slow)])
    assert all(w.periodic and w.unsolved == 0 for w in found)
    np.testing.assert_allclose(ways[:2], ways[2], rtol=0.01)
    assert 0.1 < ways[2] < 2 * np.pi * 0.041


def test_a_walker_that_speeds_up_slowly_is_not_yet_periodic():
    """At 200 Hz a cycle adds a thousandth of the legs' speed."""
    numerics = Fineness(steps=8, elements=4, duration=0.2)
    (found,) = walk([xplorer(1.0, 200.0)], numerics)
    half = np.searchsorted(found.t, 0.1)
    assert 3 * found.twist[half, 0] < found.twist[-1, 0]


def test_what_a_walk_takes_is_told_from_its_first_steps():
    """Of a body so light that it bounces, and of one that takes many cycles to come to
    the speed of its legs."""
    scene = dataclasses.replace(QUICK_XPLORER, numerics=Fineness(duration=10.0))
    light = dataclasses.replace(XPLORER.robot, mass=1e-6)
    usual, bouncing, fast = (
        walking.walk_cost(dataclasses.replace(scene, **changes)).balances
        for changes in ({}, {"robot": light}, {"gait": Tripod(200.0)})
    )
    assert bouncing > 4 * usual
    assert fast > 100 * usual


def test_trends_of_figure_12():
    """Xplorer is faster at higher frequency, on c-legs than on flat ones, on flat than
    on reversed ones. SandBot is slower with more air, and at last no walker."""
    walkers = [xplorer(c, f) for c in (1.0, 0.0, -1.0) for f in (1.0, 3.0)]
    speed = np.reshape([w.speed for w in walk(walkers, COARSE, 1)], (3, 2))
    assert (np.diff(speed, axis=1) > 0.03).all()
    assert (np.diff(speed, axis=0) < 0).all()
    in_air = [
        Walker(SANDBOT.robot, Tripod(f), SANDBOT.medium, (Aeration(air, 0.25),))
        for f in (0.4, 1.2)
        for air in (0.0, 0.12, 0.24)
    ]
    found = walk(in_air, COARSE, 1)
    speed = np.reshape([w.speed for w in found], (2, 3))
    assert (np.diff(speed, axis=1) < -0.01).all()
    assert (speed[1] > speed[0])[:2].all()
    assert {found[2].status, found[5].status} <= {"sunk", "stuck"}


LOOSE = VERTICAL["poppy-seeds-loose"].stress
SMOOTH = Wheel(0.1, 0.08)
SLIP = np.linspace(0.0, 0.8, 5)


def test_a_wheel_bears_its_load_and_pulls_more_the_more_it_slips():
    found = rolling(LOOSE, SMOOTH, 15.0, 2.0, SLIP)
    for k, slip in enumerate(SLIP):
        pose = [0.0, 0.1 - found.sinkage[k], 0.3]
        one = loads(LOOSE, SMOOTH.outline(100), pose, [(1 - slip) * 0.2, 0.0, 2.0])
        expected = (found.pull[k], 15.0, found.torque[k])
        assert (*one.force, -one.moment) == pytest.approx(expected, rel=2e-3)
    assert (np.diff(found.pull) > 0).all()
    assert np.isnan(rolling(LOOSE, SMOOTH, 1e5, 2.0, 0.3).sinkage)


SQUARE = scenes.load("square-rod").intruder
HOLE = DisturbedGround(places=(0.0,), radius=0.02, weakening=0.4)
REFUSED = [
    (lambda: rolling(LOOSE, SQUARE, 15.0, 2.0, 0.1), "radius | instead"),
    (
        lambda: Walker(ROBOT, Tripod(1.0), SAND, (HOLE,)),
        "DisturbedGround PrintedGround | instead",
    ),
    (lambda: dataclasses.replace(ROBOT, legs=None), "legs | because"),
    (lambda: dataclasses.replace(ROBOT, hips=(HIPS,)), "hips x m | value"),
    (
        lambda: dataclasses.replace(XPLORER, numerics=3),
        "numerics Fineness 3 | where value",
    ),
    (lambda: engine(3), "engine planar mujoco 3 | value"),
]


@pytest.mark.parametrize(("build", "said"), REFUSED, ids=[said for _, said in REFUSED])
def test_what_makes_no_walk_is_refused(build, said):
    with refuses(said):
        build()


PLANAR = [n for n in scenes.walker_names() if scenes.load(n).engine == "planar"]


@pytest.mark.parametrize("name", PLANAR)
def test_walks_as_they_are_built_in_are_solved_and_account_for_their_energy(name):
    scene = scenes.load(name)
    brief = dataclasses.replace(scene.numerics, duration=1.5 / scene.gait.frequency)
    (found,) = walk([scene.walker], brief)
    assert found.unsolved == 0
    assert found.residual <= 1e-3 * scene.numerics.rounding
    left = found.work[-1] - found.loss[-1] - found.energy[-1] + found.energy[0]
    assert 0 < found.unaccounted < 0.03
    assert found.unaccounted == pytest.approx(abs(left) / found.work[-1])


FARTHEST = 0.022 + math.hypot(0.06, 0.004) + 0.03  # its axle is 2 mm off the middle


@pytest.mark.parametrize(
    ("z", "pitch", "status"),
    [
        (FARTHEST + 1e-3, 0.0, "airborne"),
        (FARTHEST - 1e-3, 0.0, ""),
        (-0.0151, 0.0, "sunk"),
        (-0.0149, 0.0, ""),
        (0.0, 1.58, "flipped"),
        (0.0, -1.58, "flipped"),
        (0.0, -1.57, ""),
    ],
)
def test_a_robot_ends_above_its_reach_below_its_top_and_on_its_back(z, pitch, status):
    strides = batch_strides([Walker(LIGHT_ROD, Tripod(2.0), SAND)], QUICK)
    state = State.at_rest(np.array([[7.0, z, pitch]]))
    assert strides.end_status(state, np.zeros(1, int)) == [status]


def test_the_rounding_of_slow_legs_is_a_twentieth_of_the_speed_of_their_ends():
    found = walking_rounding(3e-3, np.array([1e-9, 0.1, 1.0]), 0.05)
    np.testing.assert_allclose(found, [1e-7, 0.05 * 2 * np.pi * 0.1 * 0.05, 3e-3])


@pytest.mark.parametrize("robot", [ROBOT, walking_sensitivity.Sheet(**vars(ROBOT))])
@pytest.mark.parametrize("tension", ["keep", "cut"])
def test_forces_are_the_sum_over_legs_and_belly(tension, robot):
    """At 30 m/s the rounding is of no account. A belly that is a sheet moves up."""
    effects = (GrainInertia(0.5, 300.0),)
    stress = dataclasses.replace(SAND, grazing=1e-9, tension=tension)
    gait = Tripod(1.3, 0.4, 1.1)
    walker = Walker(robot, gait, stress, effects)
    robots = batch_strides([walker], dataclasses.replace(QUICK, rounding=1e-7)).robots
    pose = np.array([0.3, 0.006, 0.15])
    twist = np.array([12.0, -25.0, -40.0])
    if robot is not ROBOT:
        twist = -twist
    motion = robots.leg_motion(np.array([0.17]), 0.17)
    found = robots.accelerations(pose[None, None], twist[None, None], *motion)

    parts = [(robot.belly(8), 0.0, 0.0, 0.0, 0.0)]
    for x, phase in itertools.product(robot.hips, (0.17, 0.67)):
        angle = gait.angle(phase, phase)
        rate = 1.3 * gait.rate(phase)
        parts.append((robot.leg(8), x, robot.hip_height, angle, rate))
    wrench = np.zeros(3)
    powers = np.zeros(2)
    for outline, x, z, angle, rate in parts:
        arm = Rotation.from_euler("y", pose[2]).apply([x, 0.0, z])[[0, 2]]
        velocity = [*(twist[:2] + twist[2] * arm[::-1] * [1, -1]), twist[2] + rate]
        place = [arm[0], pose[1] + arm[1], pose[2] + angle]
        force, moment = loads(stress, outline, place, velocity, effects)
        wrench += [*force, moment + arm[1] * force[0] - arm[0] * force[1]]
        powers -= [moment * rate, np.dot([*force, moment], velocity)]
    assert np.abs(wrench).min() > 0.1
    expected = wrench / [0.2, 0.2, robot.inertia] - [0, GRAVITY, 0]
    np.testing.assert_allclose(found[0][0, 0], expected, rtol=1e-6)
    assert np.ravel(found[1:]) == pytest.approx(powers, rel=1e-6)


def test_robots_side_by_side_walk_as_alone():
    first = xplorer(1.0, 2.0)
    air = dataclasses.replace(first, effects=(Aeration(0.1, 0.4), GrainInertia()))
    walkers = [first, xplorer(0.5, 3.0, mass=0.2), air]
    together = walk(walkers, QUICK, 2)
    for walker, one in zip(walkers, together):
        (alone,) = walk([walker], QUICK, 2)
        np.testing.assert_allclose(one.pose[-1], alone.pose[-1], atol=1e-9)
        assert one.speed == pytest.approx(alone.speed, abs=1e-9)


def test_a_walk_goes_on_as_its_last_cycle_until_its_duration():
    (one,) = walk([xplorer(0.3, 3.0)], dataclasses.replace(COARSE, duration=6.1))
    assert 6.1 - 1 / 30 < one.t[-1] <= 6.1
    late = one.t > 5.0
    motion = np.column_stack([one.pose, one.work, one.loss])
    before = [np.interp(one.t[late] - 1 / 3, one.t, column) for column in motion.T]
    x, _, _, work, loss = motion[late].T - before
    assert x == pytest.approx(one.speed / 3, rel=5e-3)
    assert work == pytest.approx(loss, rel=0.02)


# Steps in its sand are not all solved.
JUMPING = Walker(XPLORER.robot, Tripod(1.0), StressMap(zeta=0.3, grazing=0.0))


def test_without_a_limit_cycle_the_mean_of_four_cycles_counts():
    """Of two walks whose limit cycles a push would leave for good."""
    denser = dataclasses.replace(JUMPING, stress=StressMap(zeta=0.6, grazing=0.0))
    strides = batch_strides([JUMPING, denser], Fineness(steps=12, elements=4))
    state = walk_from_rest(strides, np.ones(2)).state
    first = state = state._replace(defect=state.defect + 0.5)
    limits = [
        Limit(state.take([k]), 1, -1.5 * np.eye(5), np.zeros(5)) for k in range(2)
    ]
    found = limit_cycles(strides, limits)
    places = [state.pose[:, 0]]
    for k in range(8):
        state = strides.run(state, k, np.arange(2))[1].take(-1)
        places.append(state.pose[:, 0])
    moved = np.diff(places[::2], axis=0) / 2
    assert not found.periodic.any()
    np.testing.assert_allclose(found.progress, moved.mean(0), rtol=1e-6)
    per_length = (state.defect - first.defect) / 8 / strides.frequency
    assert (per_length > 0).all()
    np.testing.assert_allclose(found.unsolved_error, per_length * strides.period)
    np.testing.assert_allclose(found.drift, np.ptp(moved, axis=0), rtol=1e-6)


FAST_SANDBOT = dataclasses.replace(
    SANDBOT, gait=dataclasses.replace(SANDBOT.gait, frequency=8 / (2 * np.pi))
)
SHORT_STANCE = dataclasses.replace(
    XPLORER, gait=dataclasses.replace(XPLORER.gait, duty=0.05)
)


@pytest.mark.parametrize(
    ("scene", "finer", "most"),
    [
        (QUICK_XPLORER, {"steps": 64, "elements": 32}, 0.15),
        (FAST_SANDBOT, {"elements": 32}, 0.2),  # which then rears up another way
        (SHORT_STANCE, {"steps": 96}, 0.1),
    ],
)
def test_the_estimate_covers_the_error(scene, finer, most):
    (one,) = walking.walked([scene], settling=True)
    fine = dataclasses.replace(scene.numerics, **finer)
    truth = rerun([scene.walker], fine, [one.walk], 2)[0].speed
    assert abs(one.walk.speed - truth) < one.estimate < most * truth


def test_the_error_of_steps_that_are_not_solved_is_told():
    """Of a law that jumps, in coarse steps."""
    coarse = Fineness(steps=12, elements=4, duration=1.0)
    jumps = StressMap(zeta=0.3, grazing=0.0)
    scene = dataclasses.replace(
        XPLORER, medium=jumps, gait=Tripod(1.0), numerics=coarse
    )
    result = Walk(scene).ask()
    assert result["unsolved"].values > 10
    assert 0.1 < float(result["speed_error_of_unsolved"]) < result["speed"].error


def test_a_walk_may_be_over_before_its_first_step():
    brief = dataclasses.replace(QUICK, duration=1e-3)
    (found,) = walk([Walker(ROBOT, Tripod(2.0), SAND)], brief)
    assert found.t.tolist() == [0.0]
    assert walking.cost_of_transport(XPLORER, found) == math.inf


@pytest.mark.parametrize("name", scenes.walker_names())
def test_a_walker_written_is_the_walker_read(name):
    scene = scenes.load(name)
    strength = {"zeta": 0.8} if isinstance(scene.medium, StressMap) else {"xi_n": 2e5}
    medium = dataclasses.replace(scene.medium, **strength)
    weaker = dataclasses.replace(scene, text="", medium=medium)
    assert scenes.parse(scenes.toml(weaker), name) == weaker


FIGURES = [
    (
        walking_steps,
        {"steps": {"implicit": (16,)}, "finest": 48, "frequencies": (3.0,)},
    ),
    (walking_sensitivity, {"factors": (1.0, 1.1), "names": ("robot.height",)}),
    (wheel, {"slips": 3}),
    (meshes, {"ladder": (80, 320, 1280)}),
]


@pytest.mark.parametrize(("figure", "coarse"), FIGURES)
def test_figures_draw_what_they_compute(figure, coarse, tmp_path):
    assert drawn(figure, figure.compute(**coarse), tmp_path).axes


BOUNCING = dataclasses.replace(XPLORER.robot, mass=1e-5)
LUGGED = Roller(0.08, Wheel(0.05, 0.02, 5, 0.01, 0.006))
AIR = (Aeration(0.01, 0.03), GrainInertia(2.0, 700.0))
MARCHES = {
    "legs": [
        Walker(xplorer(c).robot, Tripod(f), SAND, AIR)
        for c, f in ((1.0, 2.0), (-0.4, 3.1), (0.2, 20.0))
    ],
    "wheel": [Walker(LUGGED, Tripod(0.7), SAND)],
    "unsolved": [Walker(BOUNCING, Tripod(1.0), StressMap(zeta=3.0, grazing=0.02))],
}


@pytest.mark.parametrize(
    ("what", "tension"),
    [("legs", "keep"), ("legs", "cut"), ("wheel", "cut"), ("unsolved", "keep")],
)
@pytest.mark.usefixtures("compiled_code")
def test_compiled_steps_are_those_by_numpy(what, tension):
    """Of three robots on legs the last comes to an end."""
    walkers = []
    for walker in MARCHES[what]:
        stress = dataclasses.replace(walker.stress, tension=tension)
        walkers.append(dataclasses.replace(walker, stress=stress))
    strides = batch_strides(walkers, COARSE)
    lowered = strides.airborne_height * [1.0, 1.0, 0.1][: len(walkers)]
    arguments = (
        strides.robots,
        np.arange(len(walkers)),
        strides.robots.start(),
        strides.phases[:4],
        strides.rate_phases[:3],
        (strides.top, lowered),
    )
    with preferring("numpy"):
        slow, tries = march(*arguments)
    with preferring("numba"):
        fast, others = march(*arguments)
    np.testing.assert_array_equal(tries, others)
    arrays = (fast.to_array(), slow.to_array())
    np.testing.assert_allclose(*arrays, rtol=1e-7, atol=1e-9)
    stopped = (slow.pose[-1] == slow.pose[-2]).all(-1).tolist()
    assert stopped == [False, False, True][: len(walkers)]
    assert (slow.unsolved[-1].sum() > 0) == (what == "unsolved")
