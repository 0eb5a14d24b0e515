"""The engine of three dimensions: momentum, energy, order, ends, and its speeds beside
those of the planar engine."""

import dataclasses
import math
import types

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from geomech import scenes
from geomech.scenes import WalkerScene
from geomech.studies.terradynamics.walking import view as view_of
from geomech.studies.terradynamics.walking import walked
from rft.balance import backend
from rft.core.metres import GRAVITY
from rft.terradynamics.ground import Aeration, GrainInertia
from rft.terradynamics.meshes import Spatial, wrench
from rft.terradynamics.plates import VERTICAL, CLeg, RoundRod, StressMap, Wheel
from rft.terradynamics.walking import Fineness, Rhex, Roller, Tripod, Walker, rolling
from rft.terradynamics.walking.planar_walk import walk as planar_walk
from rft.terradynamics.walking.spatial.facets import Grains

mujoco = pytest.importorskip(
    "mujoco", reason="needs the extra: pip install 'geomech[mujoco]'"
)
pytestmark = pytest.mark.usefixtures("fastest")
needs_numba = pytest.mark.skipif(
    not backend.installed(), reason="needs the extra: pip install 'geomech[fast]'"
)
from rft.terradynamics.walking.mujoco_walk import (  # noqa: E402
    ROW,
    Simulation,
    Start,
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


def body_of(text, resolution=24, geom="g"):
    """A body of grains of which one geom is in the sand."""
    model = mujoco.MjModel.from_xml_string(text)
    mesh = geoms.geom_mesh(model, model.geom(geom).id, resolution)
    return Multibody(model, geoms.surfaces(model, {geom: mesh}), Grains(SPATIAL))


def test_momenta_change_by_the_forces_and_moments_of_grains_and_weight():
    """Of a body whose centre of mass, origin and geom are three places with three
    frames, that tumbles; against the wrench of the geom's mesh by itself."""
    body = body_of(TILTED)
    model, data = body.model, body.data
    data.qvel[:] = [0.4, 0.2, -0.5, 3.0, -4.0, 2.0]

    def momenta():
        mujoco.mj_forward(model, data)
        mujoco.mj_subtreeVel(model, data)
        return np.array([0.3 * data.subtree_linvel[0], data.subtree_angmom[0]])

    before = momenta()
    motion = np.zeros(6)
    mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_GEOM, 0, motion, 0)
    pose = data.geom_xmat[0].reshape(3, 3), data.geom_xpos[0]
    mesh = geoms.geom_mesh(model, 0, 24)
    one = wrench(SPATIAL, mesh, *pose, motion[3:], motion[:3])
    moment = one.moment + np.cross(data.geom_xpos[0] - data.xipos[1], one.force)
    expected = np.array([one.force + [0, 0, -0.3 * 9.81], moment])
    assert np.abs(expected).min() > 1e-3
    body.step(1e-5)
    change = (momenta() - before) / 1e-5
    np.testing.assert_allclose(change, expected, rtol=0.02, atol=2e-3)


FLOORED = """<mujoco><option gravity="0 0 -9.81"/><worldbody><geom name="floor" type="plane" size="1 1 1"/>
<body name="a" pos="0 0 0.02"><freejoint/><geom name="foot" type="box" size="0.05 0.04 0.02"/>
<geom name="arm" type="sphere" size="0.01" pos="0 0 0.05"/></body></worldbody></mujoco>"""


def test_what_touches_grains_touches_no_floor():
    """A foot sinks until the grains bear it."""
    body = body_of(FLOORED, geom="foot")
    for _ in range(100):
        body.step(0.005)
        assert body.data.ncon == 0
    assert body.data.qpos[2] < 0.02 - 1e-3
    assert body.unsolved == 0 and body.residual < 1e-4
    weight = body.model.body_mass[1] * 9.81
    assert body.data.qfrc_passive[2] == pytest.approx(weight, rel=0.02)


@needs_numba
def test_steps_are_of_order_one_and_energy_is_kept_to_that():
    """Xplorer in its plane at 4 Hz, after its fall: motors' work = losses + change of
    energy."""
    walker = dataclasses.replace(XPLORER.walker, gait=Tripod(4.0))

    def run(steps, **start):
        finely = dataclasses.replace(QUICK, steps=steps)
        return Simulation(walker, finely, planar=True).walk(1, **start)

    fallen = run(48)
    walks = [run(steps, start=fallen.limit) for steps in (12, 24, 48)]
    np.testing.assert_allclose(walks[2].pose[0, 1:], fallen.pose[-1, 1:], atol=1e-12)
    changes = np.abs(np.diff([w.pose[-1] for w in walks], axis=0)).max(1)
    audits = [w.unaccounted for w in walks]
    assert 1.6 < changes[0] / changes[1] < 2.6 and changes[1] < 1e-3
    assert 1.6 < audits[0] / audits[1] < 2.6 and audits[2] < 0.02
    assert [w.unsolved for w in walks] == [0, 0, 0]


@needs_numba
@pytest.mark.parametrize(("name", "frequency"), [("xplorer", 3.0), ("sandbot", 0.6366)])
def test_speeds_are_those_of_the_planar_engine(name, frequency):
    """Of fine steps, within 1 %, though its own are coarse and it may roll, yaw and
    drift; and so is how far its nose goes up."""
    scene = scenes.load(name)
    effects = (Aeration(0.03, 0.25),) if name == "sandbot" else ()
    gait = dataclasses.replace(scene.gait, frequency=frequency)
    walker = dataclasses.replace(scene.walker, gait=gait, effects=effects)
    finely = dataclasses.replace(QUICK, steps=96, elements=48)
    coarse = dataclasses.replace(QUICK, steps=16, elements=12)
    (wanted,) = planar_walk([walker], finely, 2)
    (free,) = walk([walker], coarse, 2)
    assert free.status == wanted.status == "walking"
    assert free.speed == pytest.approx(wanted.speed, rel=0.01)
    lowest = wanted.pose[:, 2].min()
    assert free.pose[:, 2].min() == pytest.approx(lowest, abs=0.02)


def test_a_robot_and_its_mirror_image_walk_as_mirror_images():
    """Legs swapped from left to right; hips so near that they roll and yaw."""
    leg = CLeg(0.0205, 0.01)
    robot = Rhex(0.15, 0.13, 0.03, 0.05, leg, (-0.05, 0.04), aside=(0.03, 0.04))
    sides = []
    for middle in (0.0, math.pi):
        gait = Tripod(2.0, 0.5, math.pi, middle)
        course = Simulation(
            Walker(robot, gait, SAND, (GrainInertia(0.5, 300.0),)), QUICK
        )
        rows = [course.row()]
        course.stride(0, rows, [])
        sides.append(np.array(rows))
    first, other = sides
    assert np.abs(first[-1, 10:13]).min() > 1e-4  # y, roll and yaw
    np.testing.assert_allclose(other[:, 10:], -first[:, 10:], atol=1e-6)
    np.testing.assert_allclose(other[:, 1:4], first[:, 1:4], atol=1e-6)


STILL = dataclasses.replace(XPLORER.robot, hip_height=0.08)
LONG = dataclasses.replace(XPLORER.robot, hips=(-0.06,), legs=CLeg(0.05, 0.01))
ROD = Roller(2.0, RoundRod(0.1, 0.1), axle=0.02)


@needs_numba
@pytest.mark.parametrize(
    ("status", "walker"),
    [
        ("sunk", Walker(XPLORER.robot, Tripod(2.0), StressMap(zeta=0.005))),
        ("stuck", Walker(STILL, Tripod(4.0), XPLORER.medium)),
        ("flipped", Walker(LONG, Tripod(4.0), XPLORER.medium)),
        ("walking", Walker(ROD, Tripod(1.0), XPLORER.medium)),
    ],
)
def test_every_end_has_its_status_and_no_nan(status, walker):
    (found,) = walk([walker], QUICK, 1)
    assert found.status == status
    for values in (*found[:7], found.drift, *found.spatial.values()):
        assert np.isfinite(values).all()
    (more,) = rerun([walker], dataclasses.replace(QUICK, steps=8), [found], 1)
    assert math.isfinite(more.speed)


@needs_numba
def test_a_robot_that_is_thrown_up_is_airborne():
    thrown = Simulation(Walker(STILL, Tripod(4.0), XPLORER.medium), QUICK)
    velocity = np.array([1.0, 0.0, 3.0, *np.zeros(9)])
    found = thrown.walk(3, start=Start(thrown.body.data.qpos, velocity))
    assert (found.status, found.limit) == ("airborne", None)


@needs_numba
def test_a_walk_that_repeats_itself_goes_on_in_equal_steps():
    """Its last stride again and again, up to the end of the time."""
    simulation = Simulation(
        Walker(ROD, Tripod(1.0), XPLORER.medium), dataclasses.replace(QUICK, steps=8)
    )
    found = simulation.walk(20, 24.1)
    assert found.periodic and found.cycles < 20
    np.testing.assert_allclose(found.t, np.arange(8 * 24 + 1) / 8, atol=1e-9)
    assert len(found.spatial["states"]) == len(found.pose) == len(found.t)
    strides = np.diff(found.pose[::8, 0])[-18:]
    np.testing.assert_allclose(strides, found.speed, rtol=1e-6)
    np.testing.assert_allclose(found.pose[-1, 1:], found.pose[-9, 1:], atol=1e-9)


@needs_numba
def test_a_plain_wheel_rolls_as_fast_as_the_grains_bear_it():
    """Against the balance of forces of a wheel of 400 elements, with the slip at which
    it pulls nothing; both engines tell their error."""
    stress, wheel, turn = (
        VERTICAL["poppy-seeds-loose"].stress,
        Wheel(0.1, 0.08),
        2 * np.pi,
    )
    slip = np.linspace(0.3, 0.33, 4)
    pull = rolling(stress, wheel, 2.0 * GRAVITY, turn, slip, elements=400).pull
    truth = (1 - np.interp(0.0, pull, slip)) * turn * 0.1
    scene = WalkerScene(
        stress, Roller(2.0, wheel), Tripod(1.0), numerics=Fineness(elements=24)
    )
    for engine, most in (("planar", 0.05), ("mujoco", 0.03)):
        (one,) = walked([scene], engine, settling=True)
        assert abs(one.walk.speed - truth) < one.estimate < most * truth


WAY = complex(0.3, -0.1) * np.exp(-3.0j)  # m/s, along and to the left of the heading


def course(t):
    """Rows of a robot that goes steadily and turns from a heading of 3 rad by 0.5."""
    yaw = (3.0 + np.linspace(0, 0.5, len(t)) + np.pi) % (2 * np.pi) - np.pi
    columns = {"t": t, "x": 0.3 * t, "y": -0.1 * t, "yaw": yaw}
    return np.stack([columns.get(name, 0 * t) for name in ROW], -1)


@pytest.mark.parametrize(
    ("moves", "periodic", "end", "velocity", "spread", "status"),
    [
        (slice(None), True, "", [0.4, 0.04, 0.2], 0.06, "walking"),
        (slice(None), False, "", [0.4, 0.04, 0.1], 0.4, "walking"),
        (slice(1, 2), False, "", [0.2, 0.02, -0.2], 0.2, "walking"),
        (slice(None), False, "sunk", [WAY.real, WAY.imag, 0.25], 0.0, "sunk"),
    ],
)
def test_the_means_of_a_walk_are_those_of_its_last_strides(
    moves, periodic, end, velocity, spread, status
):
    """Of the last one where it repeats itself, else of four; at an end of all."""
    robot = types.SimpleNamespace(gait=Tripod(2.0), reach=0.5)
    strides = [[9, 9, 9], [0.1, 0.01, -0.1], [0.2, 0.02, -0.2], [0.3, 0.03, 0.4]]
    strides = np.array([*strides, [0.2, 0.02, 0.1]])[moves]
    rows = course(np.linspace(0, 2, 9))
    found = Simulation.means(robot, rows, strides, periodic, 0.03, end)
    means = pytest.approx(velocity, abs=1e-6), pytest.approx(spread), status
    assert found == means


def test_a_view_of_a_hexapod_has_a_hull_and_two_tripods():
    """Which have as many triangles, and lie below it."""
    view = view_of(XPLORER)
    triangles = view.triangles(view.machine.model.qpos0)
    assert len(triangles) == len(view.groups)
    hull, one, other = (triangles[view.groups == k].mean((0, 1)) for k in range(3))
    assert np.count_nonzero(view.groups == 1) == np.count_nonzero(view.groups == 2)
    assert one[2] == pytest.approx(other[2]) and one[2] < hull[2]


def test_a_row_tells_place_attitude_and_their_rates():
    """Of a robot turned by yaw, pitch and roll; its nose is down at a positive
    pitch."""
    one = Simulation(XPLORER.walker, QUICK)
    data = one.body.data
    turn = Rotation.from_euler("ZYX", (0.4, 0.3, -0.2))
    data.qpos[:7] = [0.3, -0.4, 0.5, *turn.as_quat()[[3, 0, 1, 2]]]
    data.qvel[:6] = [1.0, 2.0, 3.0, 0.5, -0.6, 0.7]
    data.time = 0.25
    mujoco.mj_forward(one.body.model, data)
    row = dict(zip(ROW, one.row()))
    spin = turn.apply([0.5, -0.6, 0.7])
    rate = spin @ [-math.sin(0.4), math.cos(0.4), 0.0]
    names = ("t", "x", "y", "z", "yaw", "pitch", "roll", "v_x", "v_z", "rate")
    expected = [0.25, 0.3, -0.4, 0.5, 0.4, 0.3, -0.2, 1.0, 3.0, rate]
    assert [row[x] for x in names] == pytest.approx(expected)


def test_the_state_of_a_stride_knows_no_place_and_no_heading():
    """Limit cycles are told by it."""
    one = Simulation(XPLORER.walker, QUICK)
    data = one.body.data
    states = []
    for yaw in (0.0, 1.2):
        turn = Rotation.from_euler("ZYX", (yaw, 0.3, -0.2))
        data.qpos[:7] = [yaw, -yaw, 0.5, *turn.as_quat()[[3, 0, 1, 2]]]
        velocity = Rotation.from_euler("z", yaw).apply([1.0, 2.0, 3.0])
        data.qvel[:6] = [*velocity, 0.5, -0.6, 0.7]
        mujoco.mj_forward(one.body.model, data)
        states.append(one.scaled_state())
    np.testing.assert_allclose(states[1], states[0], atol=1e-12)


def test_a_hull_is_a_box_that_pitches_as_its_robot_is_told():
    """It rolls and yaws as a box would."""
    robot = Rhex(0.2, 0.15, 0.03, 0.06, CLeg(0.025, 0.012), (-0.05, 0.06), inertia=5e-4)
    x, y, z = 0.15**2, 0.06**2, 0.03**2
    box = 5e-4 / (x + z) * np.array([y + z, x + z, x + y])
    np.testing.assert_allclose(hexapod.inertia(robot, 0.1), box)
    model = mujoco.MjModel.from_xml_string(hexapod.mjcf(robot))
    sides = 2 * model.geom_size[model.geom_bodyid == 1]
    np.testing.assert_allclose(sides, [[0.15, 0.06, 0.03]])


@pytest.mark.parametrize(
    "robot",
    [
        Rhex(0.2, 0.15, 0.03, 0.06, CLeg(0.025, 0.012), (-0.05, 0.06), inertia=5e-4),
        XPLORER.robot,
    ],
)
def test_legs_turn_as_rods_about_their_ends_and_weigh_what_the_hull_lacks(robot):
    model = mujoco.MjModel.from_xml_string(hexapod.mjcf(robot))
    reach = np.abs(robot.leg(12).points).max()
    legs = model.body_mass[2:, None] * reach**2 / 3
    np.testing.assert_allclose(model.body_inertia[2:], legs + [0, 0, 0])
    assert model.body_mass.sum() == pytest.approx(robot.mass)
