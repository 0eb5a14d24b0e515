"""The engine of three dimensions: momentum, energy, order, its speeds beside those of the planar engine, ends."""

import dataclasses
import math
import types

import numpy as np
import pytest
from artists import curve
from scipy.spatial.transform import Rotation

from geomech import scenes
from geomech.scenes import WalkerScene
from geomech.studies.terradynamics.walking import walked
from rft.balance import backend
from rft.core.metres import GRAVITY
from rft.terradynamics.ground import Aeration, GrainInertia
from rft.terradynamics.meshes import Spatial, wrench
from rft.terradynamics.plates import VERTICAL, CLeg, RoundRod, StressMap, Wheel
from rft.terradynamics.walking import Fineness, Rhex, Roller, Tripod, Walker, rolling
from rft.terradynamics.walking.planar_walk import walk as planar_walk
from rft.terradynamics.walking.spatial.facets import Grains, Surface

mujoco = pytest.importorskip(
    "mujoco", reason="needs the extra: pip install 'geomech[mujoco]'"
)
pytestmark = pytest.mark.usefixtures("fastest")
needs_numba = pytest.mark.skipif(
    not backend.installed(), reason="needs the extra: pip install 'geomech[fast]'"
)
from rft.mujoco import installed  # noqa: E402
from rft.mujoco.installed import Effort  # noqa: E402
from rft.terradynamics.walking.mujoco_walk import (  # noqa: E402
    ROW,
    Simulation,
    Start,
    _goes_straight,
    _move,
    _rows_until,
    rerun,
    walk,
)
from rft.terradynamics.walking.spatial import geoms, hexapod  # noqa: E402
from rft.terradynamics.walking.spatial.multibody import Multibody  # noqa: E402

SAND = StressMap(zeta=0.3, grazing=math.radians(5))
SPATIAL = Spatial(3e5, surface_friction=0.6)
QUICK = Fineness(steps=12, elements=6, duration=1.0)
XPLORER = scenes.load("xplorer")


TILTED = """<mujoco><option gravity="0 0 -9.81"/><worldbody><body name="a" pos="0 0 0.01" euler="20 30 40"><freejoint/>
<inertial pos="0.02 -0.01 0.015" mass="0.3" diaginertia="3e-4 2e-4 4e-4" euler="10 50 0"/>
<geom name="g" type="ellipsoid" size="0.03 0.02 0.04" pos="0.01 0.005 -0.02" euler="0 0 70" contype="0" conaffinity="0"/>
</body></worldbody></mujoco>"""


def test_momenta_change_by_the_forces_and_moments_of_grains_and_weight(
    tmp_path, monkeypatch
):
    """Of a body whose centre of mass, origin and geom are three places with three frames, that tumbles; against the wrench of
    the geom's mesh by itself."""
    monkeypatch.chdir(tmp_path)
    model = mujoco.MjModel.from_xml_string(TILTED)
    mesh = geoms.geom_mesh(model, 0, 24)
    body = Multibody(
        model, geoms.surfaces(model, {"g": mesh}), Grains(SPATIAL, rounding=1e-5)
    )
    data = body.data
    data.qvel[:] = [0.4, 0.2, -0.5, 3.0, -4.0, 2.0]

    def momenta():
        mujoco.mj_forward(model, data)
        mujoco.mj_subtreeVel(model, data)
        return np.concatenate([0.3 * data.subtree_linvel[0], data.subtree_angmom[0]])

    before, h = momenta(), 1e-5
    turn, place, com = (
        data.geom_xmat[0].reshape(3, 3).copy(),
        data.geom_xpos[0].copy(),
        data.xipos[1].copy(),
    )
    motion = np.zeros(6)
    mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_GEOM, 0, motion, 0)
    one = wrench(SPATIAL, mesh, turn, place, motion[3:], motion[:3])
    body.step(h)
    wanted = [
        one.force + [0, 0, -0.3 * 9.81],
        one.moment + np.cross(place - com, one.force),
    ]
    assert np.abs(wanted).min() > 1e-3
    np.testing.assert_allclose(
        (momenta() - before) / h, np.concatenate(wanted), rtol=0.02, atol=2e-3
    )
    data.qpos[0] = np.nan
    mujoco.mj_step(model, data)  # warns, but in no file
    assert not [*tmp_path.iterdir()]


def test_what_falls_free_falls_as_galilei_says():
    model = mujoco.MjModel.from_xml_string(TILTED)
    body = Multibody(
        model,
        geoms.surfaces(model, {"g": geoms.geom_mesh(model, 0, 12)}),
        Grains(SPATIAL),
    )
    data = body.data
    data.qpos[2], data.qvel[3:] = 3.0, [2.0, -1.0, 3.0]
    mujoco.mj_forward(model, data)
    mujoco.mj_subtreeVel(model, data)
    spin, com, start, energy = (
        data.subtree_angmom[0].copy(),
        data.xipos[1].copy(),
        data.subtree_linvel[0].copy(),
        body.energy(),
    )
    for _ in range(40):
        body.step(0.005)
    mujoco.mj_subtreeVel(model, data)
    # Steps of order 1 fall by half a step's change of velocity more, in each.
    fall = 9.81 * (0.02 + 0.2 * 0.005 / 16 / 2)
    np.testing.assert_allclose(
        data.xipos[1], com + 0.2 * start + [0, 0, -fall], atol=1e-5
    )
    np.testing.assert_allclose(
        data.subtree_angmom[0], spin, atol=1e-4 * np.linalg.norm(spin)
    )
    assert body.energy() == pytest.approx(energy, rel=2e-4) and (
        body.work,
        body.loss,
    ) == (0.0, 0.0)


FLOORED = """<mujoco><option gravity="0 0 -9.81"/><worldbody><geom name="floor" type="plane" size="1 1 1"/>
<body name="a" pos="0 0 0.02"><freejoint/><geom name="foot" type="box" size="0.05 0.04 0.02"/>
<geom name="arm" type="sphere" size="0.01" pos="0 0 0.05"/></body></worldbody>{}</mujoco>"""


def test_what_touches_grains_touches_no_floor():
    """As `geomech walk` has it: a foot sinks through the floor of its MJCF as through none, until the grains bear it, while
    other geoms go on to touch the floor; of a surface that names no geom that holds of all of its body."""
    made = lambda text: mujoco.MjModel.from_xml_string(text)
    foot = lambda model: geoms.geom_mesh(model, 1, 24)
    depths = []
    for text in (
        FLOORED.format(""),
        FLOORED.format("").replace(
            'name="floor"', 'name="floor" contype="0" conaffinity="0"'
        ),
    ):
        model = made(text)
        body = Multibody(
            model, geoms.surfaces(model, {"foot": foot(model)}), Grains(SPATIAL)
        )
        assert body.data.ncon == 0
        for _ in range(100):
            body.step(0.005)
        depths.append(0.02 - body.data.qpos[2])
        assert body.unsolved == 0 and body.residual < 1e-4
        assert body.data.ncon == 0 and body.data.qfrc_passive[2] == pytest.approx(
            model.body_mass[1] * 9.81, rel=0.02
        )
        assert model.geom_contype[1] == 1  # of another's model, as it was
    assert depths[0] == depths[1] > 1e-3
    model = made(FLOORED.format("").replace('pos="0 0 0.05"', 'pos="0 0 -0.025"'))
    body = Multibody(
        model, geoms.surfaces(model, {"foot": foot(model)}), Grains(SPATIAL)
    )
    assert body.data.ncon == 1 and body.model.geom_contype.tolist() == [1, 0, 1]
    whole = Multibody(model, [Surface.from_mesh(1, foot(model))], Grains(SPATIAL))
    assert whole.data.ncon == 0 and whole.model.geom_contype.tolist() == [1, 0, 0]
    paired = made(
        FLOORED.format('<contact><pair geom1="floor" geom2="foot"/></contact>')
    )
    with pytest.raises(
        ValueError, match="a <pair> of <contact> names a geom that touches the ground"
    ):
        Multibody(
            paired, geoms.surfaces(paired, {"foot": foot(paired)}), Grains(SPATIAL)
        )


PENDULUM = """<mujoco><option gravity="0 0 -9.81"/><worldbody><body pos="0 0 5"><joint name="j" axis="0 1 0" stiffness="0.4"
damping="0.02"/><geom name="g" type="sphere" size="0.05" pos="0.2 0 0" mass="0.3"/></body></worldbody></mujoco>"""


def test_springs_keep_energy_and_dampers_take_it():
    """To the order of the steps."""
    model, left = mujoco.MjModel.from_xml_string(PENDULUM), []
    for steps in (20, 40):
        body = Multibody(
            model,
            geoms.surfaces(model, {"g": geoms.geom_mesh(model, 0, 8)}),
            Grains(SPATIAL),
        )
        body.data.qpos[0], body.data.qvel[0] = 0.3, 2.0
        first = body.energy()
        for _ in range(steps):
            body.step(0.25 / steps)
        left.append(abs(body.loss + body.energy() - first) / body.loss)
        assert body.work == 0.0 and body.loss > 0.02
    assert left[1] < 5e-3 and left[0] / left[1] == pytest.approx(2.0, rel=0.05)


def test_steps_that_are_not_solved_are_counted_with_what_they_lack(monkeypatch):
    """Two of them in the second of three time steps, by a thousandth of the momentum."""
    model = mujoco.MjModel.from_xml_string(PENDULUM)
    surfaces = geoms.surfaces(model, {"g": geoms.geom_mesh(model, 0, 8)})
    body = Multibody(model, surfaces, Grains(SPATIAL))
    none, two = Effort(9, 9, 9, 0, 0, 1e-6), Effort(9, 20, 9, 0, 2, 1e-3)
    efforts = iter([none, none, none, two, two, two])
    monkeypatch.setattr(installed, "effort", lambda row: next(efforts))
    body.data.qvel[0] = 2.0
    for _ in range(3):
        body.step(1e-3)
    assert mujoco.get_mjcb_passive() is None  # others may need it between walks
    speed = math.hypot(0.2, math.sqrt(0.4) * 0.05) * 2.0  # of all its parts
    assert (body.unsolved, body.iterations) == (2, 11)
    assert body.residual == pytest.approx(1e-3 * speed, rel=0.05)
    assert body.defect == pytest.approx(2e-3 * speed, rel=0.05)
    assert body.state()[3:5] == (body.residual, body.defect)


def test_legs_turn_by_their_clock_across_its_kinks():
    """Of a clock with two rates, by 1e-4 rad, which is how far they yield to the robot's weight."""
    walker = dataclasses.replace(XPLORER.walker, gait=Tripod(2.0, 0.3, 1.2))
    one = Simulation(walker, QUICK)
    rows, states = [], []
    assert one.stride(0, rows, states) == ""
    for row, state in zip(rows, states):
        if row[0] < 0.5:  # at the end the rate is that of the next stride
            angles, _ = one.clock.actuator_motion(row[0], row[0] - 1e-6)
            np.testing.assert_allclose(state[7:], angles, atol=3e-4)


@needs_numba
def test_steps_are_of_order_one_and_energy_is_kept_to_that():
    """Xplorer in its plane at 4 Hz, after its fall: motors' work = losses + change of energy."""
    walker = dataclasses.replace(XPLORER.walker, gait=Tripod(4.0))
    fallen = Simulation(walker, dataclasses.replace(QUICK, steps=48), planar=True).walk(
        1
    )
    run = lambda steps: Simulation(
        walker, dataclasses.replace(QUICK, steps=steps), planar=True
    ).walk(1, start=fallen.limit)
    ends, audits = [], []
    for steps in (12, 24, 48):
        w = run(steps)
        ends.append(w.pose[-1])
        audits.append(w.unaccounted)
        assert w.unsolved == 0
    np.testing.assert_allclose(w.pose[0, 1:], fallen.pose[-1, 1:], atol=1e-12)
    changes = np.abs(np.diff(ends, axis=0)).max(1)
    assert 1.6 < changes[0] / changes[1] < 2.6 and changes[1] < 1e-3
    assert 1.6 < audits[0] / audits[1] < 2.6 and audits[2] < 0.02


@needs_numba
@pytest.mark.parametrize(("name", "frequency"), [("xplorer", 3.0), ("sandbot", 0.6366)])
def test_speeds_are_those_of_the_planar_engine(name, frequency):
    """Where these are of 96 steps and 48 elements, within 1 %, though its own are of 16 steps and 12 elements; of a robot
    that may roll, yaw and drift, and of one that keeps to the plane."""
    scene = scenes.load(name)
    effects = (Aeration(0.03, 0.25),) if name == "sandbot" else ()
    gait = dataclasses.replace(scene.gait, frequency=frequency)
    walker = dataclasses.replace(scene.walker, gait=gait, effects=effects)
    finely = dataclasses.replace(QUICK, steps=96, elements=48)
    coarse = dataclasses.replace(QUICK, steps=16, elements=12)
    wanted = planar_walk([walker], finely, 2)[0]
    free = walk([walker], coarse, 2)[0]
    assert free.status == wanted.status == "walking" and free.speed == pytest.approx(
        wanted.speed, rel=0.01
    )
    assert (
        np.abs(free.spatial["roll"]).max() < 0.06
        and np.abs(free.spatial["yaw"]).max() < 0.06
    )
    if name != "xplorer":
        return
    assert free.pose[:, 2].min() == pytest.approx(
        wanted.pose[:, 2].min(), abs=0.02
    )  # nose up, by ten degrees
    assert free.twist[:, 2].max() == pytest.approx(wanted.twist[:, 2].max(), rel=0.2)
    kept = Simulation(walker, coarse, planar=True).walk(8)
    assert kept.speed == pytest.approx(wanted.speed, rel=0.01)
    assert np.abs(kept.spatial["roll"]).max() < 1e-12


def test_the_hull_is_drawn_as_a_box():
    robot = XPLORER.robot
    model = mujoco.MjModel.from_xml_string(hexapod.mjcf(robot))
    sides = 2 * model.geom_size[model.geom_bodyid == 1]
    np.testing.assert_allclose(sides, [[robot.length, robot.width, robot.height]])


def test_a_robot_and_its_mirror_image_walk_as_mirror_images():
    """Legs swapped from left to right, by half a cycle; hips so near that they roll and yaw."""
    robot = Rhex(
        0.15, 0.13, 0.03, 0.05, CLeg(0.0205, 0.01), (-0.05, 0.04), aside=(0.03, 0.04)
    )
    right, left = (
        Simulation(
            Walker(
                robot, Tripod(2.0, 0.5, math.pi, m), SAND, (GrainInertia(0.5, 300.0),)
            ),
            QUICK,
        )
        for m in (0.0, math.pi)
    )
    first, other = (np.zeros(0),) * 2
    for course in (right, left):
        rows = [course.row()]
        course.stride(0, rows, [])
        first, other = other, np.array(rows)
    y, roll, yaw = (first[:, k] for k in (10, 11, 12))
    assert np.abs([y[-1], roll[-1], yaw[-1]]).min() > 1e-4
    np.testing.assert_allclose(other[:, 10:], -first[:, 10:], atol=1e-6)
    np.testing.assert_allclose(other[:, 1:4], first[:, 1:4], atol=1e-6)


@pytest.mark.parametrize(
    "aside", [(0.03,), (0.03, -0.04), (0.03, 2e3), ((0.03, 0.04),), (0.03, np.nan)]
)
def test_distances_of_legs_from_the_middle_plane_are_checked(aside):
    with pytest.raises(
        ValueError,
        match="^aside must be 2 numbers from 0 to .* m, one for each hip, got",
    ):
        Rhex(0.15, 0.13, 0.03, 0.05, CLeg(0.0205, 0.01), (-0.05, 0.04), aside=aside)


def test_distances_of_legs_may_be_listed():
    listed, told = (
        Rhex(0.15, 0.13, 0.03, 0.05, CLeg(0.02, 0.01), (0.0,), aside=kind([0.03]))
        for kind in (list, tuple)
    )
    assert listed == told and hash(listed) == hash(told)


def test_legs_alternate_as_in_the_plane():
    robot = XPLORER.robot
    legs = dict(
        zip(
            map(tuple, np.sign(hexapod.hips(robot)).astype(int).tolist()),
            hexapod.leg_phases(robot),
        )
    )
    assert {k for k, phase in legs.items() if phase} == {
        (-1, -1, 0),
        (0, 1, 0),
        (1, -1, 0),
    }
    out = np.array([(-1) ** k * y for k, y in enumerate(robot.sides)])
    assert out.sum() == pytest.approx(0.0) and robot.sides.min() == pytest.approx(0.03)
    assert hexapod.mjcf(robot).count('type="hinge"') == 6


@needs_numba
def test_every_end_has_its_status_and_no_nan():
    still = dataclasses.replace(XPLORER.robot, hip_height=0.08)
    long = dataclasses.replace(XPLORER.robot, hips=(-0.06,), legs=CLeg(0.05, 0.01))
    cases = {
        "sunk": Walker(XPLORER.robot, Tripod(2.0), StressMap(zeta=0.005)),
        "stuck": Walker(still, Tripod(4.0), XPLORER.medium),
        "flipped": Walker(long, Tripod(4.0), XPLORER.medium),
        "walking": Walker(
            Roller(2.0, RoundRod(0.1, 0.1), axle=0.02), Tripod(1.0), XPLORER.medium
        ),
    }
    for status, walker in cases.items():
        found = walk([walker], QUICK, 1)[0]
        assert found.status == status
        for values in (*found[:7], found.drift, *found.spatial.values()):
            assert np.isfinite(values).all(), status
        more = rerun([walker], dataclasses.replace(QUICK, steps=8), [found], 1)[0]
        assert math.isfinite(more.speed)
    thrown = Simulation(cases["stuck"], QUICK)
    start = Start(thrown.body.data.qpos, np.array([1.0, 0.0, 3.0, *np.zeros(9)]))
    found = thrown.walk(3, start=start)
    assert (
        found.status == "airborne"
        and found.limit is None
        and found.speed == pytest.approx(1.0, rel=1e-3)
    )


def test_the_state_of_a_stride_has_velocities_over_that_of_the_legs():
    states = []
    for frequency in (1.0, 2.0):
        one = Simulation(
            Walker(XPLORER.robot, Tripod(frequency), XPLORER.medium), QUICK
        )
        one.body.data.qvel[:] = frequency * np.linspace(-1, 1, one.body.model.nv)
        states.append(one.scaled_state())
    np.testing.assert_allclose(*states, atol=1e-12)


@pytest.mark.parametrize("turn", [0.0, 0.3])
def test_who_turns_is_not_told_by_strides_along_a_line(turn, monkeypatch):
    """A way that is prescribed: each stride 0.1 m ahead, then to the left."""

    def stride(self, count, rows, states):
        yaw, qpos = count * turn, self.body.data.qpos
        qpos[:2] += 0.1 * np.array([math.cos(yaw), math.sin(yaw)])
        qpos[3:7] = [math.cos((yaw + turn) / 2), 0.0, 0.0, math.sin((yaw + turn) / 2)]
        self.body.data.time, self.body.data.qvel[:] = (count + 1) / 2.0, 0.0
        mujoco.mj_forward(self.body.model, self.body.data)
        rows.append(self.row())
        states.append(qpos.copy())
        return ""

    monkeypatch.setattr(Simulation, "stride", stride)
    found = walk(
        [Walker(XPLORER.robot, Tripod(2.0), XPLORER.medium)],
        dataclasses.replace(QUICK, duration=5.0),
    )[0]
    assert (
        found.periodic
        and found.speed == pytest.approx(0.2)
        and (found.cycles == 10) == (turn > 0.0)
    )
    assert (found.yaw_rate, found.lateral_speed, found.settling_time) == pytest.approx(
        (2 * turn, 0.0, 0.0), abs=1e-9
    )
    way = 0.1 * np.exp(1j * turn * np.arange(10)).cumsum()
    np.testing.assert_allclose(found.pose[1:, 0], way.real, atol=1e-9)
    np.testing.assert_allclose(found.spatial["y"][1:], way.imag, atol=1e-9)


@needs_numba
def test_a_plain_wheel_rolls_as_fast_as_the_grains_bear_it():
    """At the default grazing, where triangles lead or do not as a whole: against the balance of forces of a wheel of 400
    elements, with the slip at which it pulls nothing; both engines tell how far they are off."""
    stress, wheel, turn = (
        VERTICAL["poppy-seeds-loose"].stress,
        Wheel(0.1, 0.08),
        2 * np.pi,
    )
    slip = np.linspace(0.3, 0.33, 7)
    pull = rolling(stress, wheel, 2.0 * GRAVITY, turn, slip, elements=400).pull
    truth = (1 - np.interp(0.0, pull, slip)) * turn * 0.1
    scene = WalkerScene(
        stress, Roller(2.0, wheel), Tripod(1.0), numerics=Fineness(elements=48)
    )
    for engine, most in (("planar", 0.012), ("mujoco", 0.03)):
        (one,) = walked([scene], engine, settling=True)
        assert abs(one.walk.speed - truth) < one.estimate < most * truth


@needs_numba
def test_the_figure_compares_steps_and_engines(monkeypatch):
    from figures.robots import walking_mujoco

    coarse = dataclasses.replace(
        XPLORER, numerics=dataclasses.replace(QUICK, elements=4)
    )
    monkeypatch.setattr(walking_mujoco, "load", lambda name: coarse)
    monkeypatch.setattr(walking_mujoco, "MOST_STRIDES", 1)
    numbers = walking_mujoco.compute(
        {"steps": (8, 12)}, {"steps": 24}, {"SandBot": ()}, {}
    )
    _, errors = numbers["errors"]["steps"]
    assert errors[1] < errors[0] < 0.05
    numbers["speeds"]["SandBot"] = (
        (1.0, 2.0),
        np.array([0.1, 0.2]),
        np.array([0.1, 0.202]),
    )
    ways, speeds = walking_mujoco.draw(numbers).axes
    np.testing.assert_allclose(curve(ways, "steps"), [[8, 12], errors])
    np.testing.assert_allclose(curve(speeds, "MuJoCo"), [[1.0, 2.0], [0.1, 0.202]])
    assert (ways.get_ylabel(), speeds.get_title()) == (
        "error of the way",
        "SandBot: within 1.0 %",
    )
    assert {name.lower() for name in walking_mujoco.FREQUENCIES} <= {
        *scenes.walker_names()
    }


def course(t, yaw=0.0, ahead=0.3):
    """Rows of a robot that goes steadily and rocks twice a second."""
    zero, rocks = np.zeros_like(t), np.sin(4 * np.pi * t)
    columns = {
        "t": t,
        "x": ahead * t,
        "z": 0.1 + 0.01 * rocks,
        "pitch": 0.2 * rocks,
        "v_x": ahead + zero,
        "v_z": 0.4 * rocks,
    }
    columns |= {
        "rate": rocks,
        "work": 2.0 * t,
        "loss": 1.5 * t,
        "energy": 0.3 + rocks,
        "y": -0.1 * t,
        "roll": -rocks,
    }
    return np.stack([columns.get(name, yaw + zero) for name in ROW], -1)


def test_strides_are_repeated_until_the_walk_is_over():
    """What grows goes on growing, x and y and the sums of energies, and all else recurs; without strides a walk is cut."""
    positions = lambda t: np.stack(
        [0.3 * t, -0.1 * t, 0.1 + 0.01 * np.sin(4 * np.pi * t), np.cos(4 * np.pi * t)],
        -1,
    )
    known, whole = np.arange(0, 1.26, 0.125), np.arange(0, 3.01, 0.125)
    for duration, steps, t in (
        (3.1, 4, whole),
        (3.0, 8, whole),
        (1.25, 4, known),
        (0.7, 4, known[:6]),
        (3.0, 0, known),
    ):
        rows, states = _rows_until(duration, course(known), positions(known), steps)
        np.testing.assert_allclose(rows, course(t), atol=1e-12)
        np.testing.assert_allclose(states, positions(t), atol=1e-12)


def test_a_way_is_along_and_to_the_left_of_the_first_heading():
    """And turns by less than half a turn."""
    before, after = np.zeros((2, len(ROW)))
    before[[1, 10, 12]], after[[1, 10, 12]] = (
        (2.0, -1.0, 3.0),
        (2.0 - 3.0, -1.0 + 0.5, -3.0),
    )
    way = complex(-3.0, 0.5) * np.exp(-3.0j)
    np.testing.assert_allclose(
        _move(before, after), [way.real, way.imag, 2 * np.pi - 6.0], rtol=1e-12
    )


@pytest.mark.parametrize(
    ("turn", "straight"),
    [
        (0.0083, True),
        (-0.0083, True),
        (0.0084, False),
        (2 * np.pi - 0.0084, False),
        (2 * np.pi - 0.0083, True),
    ],
)
def test_a_way_is_straight_that_turns_little_until_the_end(turn, straight):
    """By 0.05 rad in the six strides of half a second that are left, not in those that are over."""
    before, after = course(np.array([1.5, 2.0]))
    before[12], after[12] = 0.7, 0.7 + turn
    assert _goes_straight(before, after, 5.0) is straight
    assert _goes_straight(before, after, 1.0) and not _goes_straight(
        before, after + 0.1, 1e3
    )


def test_the_means_of_a_walk_are_those_of_its_last_strides():
    """Of the last one where it repeats itself, else of four; of a robot at its end of all its way."""
    robot = types.SimpleNamespace(gait=Tripod(2.0), reach=0.5)
    moves = np.array(
        [
            [9.0, 9.0, 9.0],
            [0.1, 0.01, -0.1],
            [0.2, 0.02, -0.2],
            [0.3, 0.03, 0.4],
            [0.2, 0.02, 0.1],
        ]
    )
    means = lambda *arguments: Simulation.means(
        robot, course(np.linspace(0, 2, 9)), *arguments
    )
    assert means(moves, True, 0.03, "") == (
        pytest.approx([0.4, 0.04, 0.2]),
        pytest.approx(0.06),
        "walking",
    )
    assert means(moves, False, 0.03, "") == (
        pytest.approx([0.4, 0.04, 0.1]),
        pytest.approx(0.4),
        "walking",
    )
    assert means(moves[1:2] * [-1, 1, 1], False, 0.0, "")[1:] == (
        pytest.approx(0.2),
        "walking",
    )
    for move, status in ((-0.0099, "stuck"), (0.0101, "walking")):
        assert means(np.array([[move, 0.5, 0.0]]), True, 0.0, "")[2] == status
    rows = course(np.linspace(0, 2, 9))
    rows[:, 12] = (3.0 + np.linspace(0, 0.5, 9) + np.pi) % (2 * np.pi) - np.pi
    way = complex(0.3, -0.1) * np.exp(-3.0j)
    found = Simulation.means(robot, rows, moves, False, 0.03, "sunk")
    assert found == (pytest.approx([way.real, way.imag, 0.25]), 0.0, "sunk")


def test_a_row_tells_place_attitude_and_their_rates():
    """Of a robot turned by yaw, then pitch, then roll, nose down where the pitch is positive, that moves anyhow."""
    one = Simulation(XPLORER.walker, QUICK)
    data, angles = one.body.data, (0.4, 0.3, -0.2)  # yaw, pitch, roll
    turn = Rotation.from_euler("ZYX", angles)
    data.qpos[:7] = [0.3, -0.4, 0.5, *turn.as_quat()[[3, 0, 1, 2]]]
    data.qvel[:6], data.time = [1.0, 2.0, 3.0, 0.5, -0.6, 0.7], 0.25
    mujoco.mj_forward(one.body.model, data)
    row = dict(zip(ROW, one.row()))
    assert [
        row[x] for x in ("t", "x", "y", "z", "yaw", "pitch", "roll")
    ] == pytest.approx([0.25, 0.3, -0.4, 0.5, *angles])
    spin = turn.apply([0.5, -0.6, 0.7])
    assert (row["v_x"], row["v_z"]) == pytest.approx((1.0, 3.0))
    assert row["rate"] == pytest.approx(spin @ [-math.sin(0.4), math.cos(0.4), 0.0])
    (x, y, z), legs = (
        (XPLORER.robot.length, XPLORER.robot.width, XPLORER.robot.height),
        one.body.facets.bodies != one.machine.root,
    )
    hips = np.linalg.norm(
        data.xpos[one.body.facets.bodies[legs]] - data.xpos[1], axis=1
    )
    diagonal = math.sqrt(x**2 + y**2 + z**2) / 2
    assert one.ceiling == pytest.approx(
        max(diagonal, hips.max() + one.reach) + max(diagonal, one.reach)
    )


@pytest.mark.parametrize(
    ("height", "tilt", "status"),
    [(-0.497, 0.0, ""), (-0.503, 0.0, "sunk"), (-1.7, 1.0, ""), (-6.0, 1.6, "flipped")],
)
def test_a_robot_is_sunk_with_all_of_its_hull(height, tilt, status):
    """Whose highest corner counts, whichever way it is tilted. height: over that of the hull."""
    one = Simulation(XPLORER.walker, QUICK)
    data = one.body.data
    data.qpos[2:7] = [
        height * XPLORER.robot.height,
        math.cos(tilt / 2),
        0.0,
        math.sin(tilt / 2),
        0.0,
    ]
    mujoco.mj_forward(one.body.model, data)
    assert one.end_status() == status
    data.qpos[2:7] = [one.ceiling + (0.001 if tilt else -0.001), 1.0, 0.0, 0.0, 0.0]
    mujoco.mj_forward(one.body.model, data)
    assert one.end_status() == ("airborne" if tilt else "")


def test_a_hull_pitches_as_its_robot_is_told_and_rolls_and_yaws_as_a_box_would():
    robot = Rhex(0.2, 0.15, 0.03, 0.06, CLeg(0.025, 0.012), (-0.05, 0.06), inertia=5e-4)
    x, y, z = 0.15**2, 0.06**2, 0.03**2
    np.testing.assert_allclose(
        hexapod.inertia(robot, 0.1), 5e-4 / (x + z) * np.array([y + z, x + z, x + y])
    )
    wheel = Roller(2.0, RoundRod(0.1, 0.1))
    assert hexapod.inertia(wheel, 0.1).tolist() == pytest.approx([0.02] * 3)
    assert (hexapod.hips(wheel), hexapod.leg_phases(wheel).tolist()) == (
        [(0.0, 0.0, 0.0)],
        [0.0],
    )
