"""Robots and bodies on slopes: gravity along the surface, ground that is weaker
downhill, and both engines beside each other."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.optimize import brentq

from geomech import scenes
from rft.core.metres import GRAVITY
from rft.effects import Slope as SlopeInThePlane
from rft.laws.incline import gravity_on_incline, incline_factors
from rft.terradynamics.ground import (
    Aeration,
    GrainInertia,
    Slope,
    ground_of,
    strength_at,
)
from rft.terradynamics.plates import VERTICAL
from rft.terradynamics.walking import Fineness, Mjcf, Tripod, Walker, engine
from rft.terradynamics.walking.planar.equations import State
from rft.terradynamics.walking.planar_walk import batch_strides, walk

pytestmark = pytest.mark.usefixtures("fastest")
XPLORER = scenes.load("xplorer")
QUICK = Fineness(steps=16, elements=8, duration=1.0)


def on_slope(degrees, *effects, frequency=2.0):
    slope = Slope(math.radians(degrees))
    return Walker(XPLORER.robot, Tripod(frequency), XPLORER.medium, (slope, *effects))


# The law


def test_both_slopes_have_one_formula():
    """Of the horizontal plane, and of plates; straight downhill, and at 20 degrees half
    the drag of level ground (Zhang and Goldman 2014, Sec. IV B)."""
    for angle, repose in ((0.1, 0.6), (math.radians(20), Slope(0.1).repose)):
        level_factor, loss = incline_factors(angle, repose)
        expected = math.sin(repose - angle) / math.sin(repose)
        assert level_factor - loss == pytest.approx(expected, rel=1e-12)
        for sign in (1.0, -1.0):
            ground = ground_of([Slope(sign * angle, repose)])
            downhill = strength_at(ground, 0.0, -sign)
            assert downhill == pytest.approx(expected, rel=1e-12)
            uphill = strength_at(ground, 0.0, sign)
            assert uphill == pytest.approx(math.cos(angle), rel=1e-12)
    assert expected == pytest.approx(0.5, rel=1e-12)
    assert SlopeInThePlane(0.1).repose == Slope(0.1).repose


# Walks


@pytest.mark.parametrize("backend_of_robots", [0.0, 0.3])
def test_above_the_ground_gravity_alone_acts_along_and_across_the_slope(
    backend_of_robots,
):
    walker = Walker(XPLORER.robot, Tripod(2.0), XPLORER.medium)
    if backend_of_robots:
        walker = on_slope(math.degrees(backend_of_robots))
    robots = batch_strides([walker], QUICK).robots
    pose = np.array([0.0, 5.0, 0.0])[None, None]
    motion = robots.leg_motion(np.zeros(1), 0.0)
    found, *_ = robots.accelerations(pose, 0.0 * pose, *motion)
    expected = [*gravity_on_incline(backend_of_robots), 0.0]
    np.testing.assert_allclose(found[0, 0], expected, rtol=1e-12, atol=1e-12)
    assert np.hypot(*found[0, 0, :2]) == pytest.approx(GRAVITY)

    state = State.at_rest(np.array([[0.2, 1.0, 0.0]]))
    height = 0.2 * math.sin(backend_of_robots) + math.cos(backend_of_robots)
    expected = XPLORER.robot.mass * GRAVITY * height
    assert robots.energy(state)[0] == pytest.approx(expected)


def test_a_slope_of_zero_is_level_ground_to_the_digit():
    level = Walker(XPLORER.robot, Tripod(2.0), XPLORER.medium)
    flat, tilted = walk([level], QUICK, 2) + walk([on_slope(0.0)], QUICK, 2)
    np.testing.assert_array_equal(flat.pose, tilted.pose)
    assert (flat.speed, flat.work[-1]) == (tilted.speed, tilted.work[-1])


def test_robots_on_slopes_side_by_side_walk_as_alone_and_slower_the_steeper():
    walkers = [on_slope(x) for x in (-10.0, 0.0, 5.0, 10.0, 20.0)]
    walkers.append(on_slope(10.0, Aeration(0.1, 0.4), GrainInertia()))
    together = walk(walkers, QUICK, 2)
    speeds = [one.speed for one in together]
    assert (np.diff(speeds[:5]) < -0.02).all()
    assert speeds[4] < 0 < speeds[3]
    for walker, one in zip(walkers, together):
        (alone,) = walk([walker], QUICK, 2)
        np.testing.assert_allclose(one.pose[-1], alone.pose[-1], atol=1e-9)
        assert one.speed == pytest.approx(alone.speed, abs=1e-9)


def test_work_on_a_slope_is_loss_and_energy_gained():
    """Also by the height that the robot gains or loses."""
    for degrees in (-12.0, 8.0):
        (one,) = walk([on_slope(degrees)], dataclasses.replace(QUICK, steps=64))
        assert one.unaccounted < 2e-3
        height = one.pose[-1, 0] * math.sin(math.radians(degrees))
        gained = XPLORER.robot.mass * GRAVITY * height
        assert abs(gained) > 0.05 * one.work[-1]


REFUSED = [
    (lambda: on_slope(38.0), "a slope of 38 degrees slides by itself"),
    (lambda: on_slope(-60.0), "a slope of -60 degrees slides by itself"),
    (
        lambda: dataclasses.replace(on_slope(1.0), effects=(Slope(0.1, mass=1.0),)),
        "a robot has a mass of its own",
    ),
]


@pytest.mark.parametrize(("build", "said"), REFUSED, ids=[said for _, said in REFUSED])
def test_slopes_that_cannot_be_right_are_refused(build, said):
    with pytest.raises(ValueError, match=said):
        build()


# In MuJoCo

mujoco = pytest.importorskip(
    "mujoco", reason="needs the extra: pip install 'geomech[mujoco]'"
)
import rft.mujoco  # noqa: E402
from rft.terradynamics.meshes import wrench  # noqa: E402
from rft.terradynamics.meshes.forces.extruded import Extruded  # noqa: E402
from rft.terradynamics.walking.mujoco_walk import Simulation  # noqa: E402
from rft.terradynamics.walking.spatial import geoms  # noqa: E402
from rft.terradynamics.walking.spatial.facets import Grains  # noqa: E402
from rft.terradynamics.walking.spatial.multibody import Multibody  # noqa: E402


@pytest.mark.parametrize("degrees", [-10.0, 5.0, 10.0, 20.0])
def test_both_engines_walk_at_one_speed_on_slopes(degrees):
    """In the plane, where the robot cannot turn downhill."""
    walker = on_slope(degrees)
    fine = Fineness(steps=64, elements=24)
    (planar,) = walk([walker], fine, 3)
    spatial = Simulation(walker, fine, planar=True).walk(14)
    assert planar.periodic
    assert spatial.speed == pytest.approx(planar.speed, rel=0.03)


def test_slope_zero_is_level_ground_in_mujoco():
    level = Walker(XPLORER.robot, Tripod(2.0), XPLORER.medium)
    flat, tilted = (
        engine("mujoco").walk([walker], QUICK, 1)[0] for walker in (level, on_slope(0))
    )
    assert flat.speed == tilted.speed
    np.testing.assert_array_equal(flat.pose, tilted.pose)


STRESS = VERTICAL["poppy-seeds-loose"].stress
HALF = 0.1, 0.05, 0.02  # m
BLOCK = """<mujoco><option gravity="0 0 -9.81"/><worldbody><body name="block" pos="0 0 {z}">
<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>
<geom name="block" type="box" size="0.1 0.05 0.02" mass="{mass}"/></body></worldbody></mujoco>"""
MASS = 0.1  # kg


def force_downhill(mesh, depth):
    """Return the force (x, z) on a block that slides along -x with its bottom at a
    depth, m, on level ground; it hardly sinks, so that its bottom leads."""
    place = (0.0, 0.0, HALF[2] - depth)
    found = wrench(
        Extruded(STRESS), mesh, np.eye(3), place, (-1.0, 0.0, -1e-3), (0, 0, 0)
    )
    return found.force[0], found.force[2]


def sliding_angle(mesh):
    """Return the angle, rad, above which a block slides, and its depth, m, there: the
    ground bears its weight across the surface and just not along it."""
    weight = MASS * GRAVITY

    def depth_at(angle):
        level_factor, loss = incline_factors(angle, Slope(0.1).repose)
        strength = level_factor - loss
        return brentq(
            lambda depth: (
                strength * force_downhill(mesh, depth)[1] - weight * math.cos(angle)
            ),
            1e-4,
            2 * HALF[2],
        )

    def excess(angle):
        along, across = force_downhill(mesh, depth_at(angle))
        return along / across - math.tan(angle)

    angle = brentq(excess, 0.2, 0.45)
    return angle, depth_at(angle)


def slid(angle, depth, seconds=0.5):
    """Return how far a block at rest slides along +x, m, and its speed then, m/s."""
    z = HALF[2] - depth
    model = mujoco.MjModel.from_xml_string(BLOCK.format(z=z, mass=MASS))
    mesh = geoms.geom_mesh(model, 0, 24)
    ground = ground_of([Slope(angle)])
    grains = Grains(Extruded(STRESS), ground.strength, 0.0, 1e-4, ground.downhill_loss)
    surfaces = geoms.surfaces(model, {"block": mesh})
    body = Multibody(model, surfaces, grains, slope=angle)
    while body.data.time < seconds:
        body.step(0.01)
    return float(body.data.qpos[0]), float(body.data.qvel[0])


def test_a_block_slides_at_the_angle_where_the_law_says_so():
    """Within 0.3 degrees of it; below it, the block sinks a little and stops."""
    model = mujoco.MjModel.from_xml_string(BLOCK.format(z=0.0, mass=MASS))
    mesh = geoms.geom_mesh(model, 0, 24)
    angle, depth = sliding_angle(mesh)
    way, speed = slid(angle - math.radians(0.3), depth)
    assert abs(way) < 2e-4
    assert abs(speed) < 2e-4
    way, speed = slid(angle + math.radians(0.3), depth)
    assert way < -0.005
    assert speed < -0.02
    # Downhill is where the surface falls.
    way, _ = slid(-angle - math.radians(0.3), depth)
    assert way > 0.005


def test_tilted_gravity_is_a_tilted_surface():
    """A box slides on a slope by the walks' tilted gravity as by `attach`, along the
    surface and across it; by a number and by an effect."""
    angle = 0.55
    xml = """<mujoco><option timestep="0.000625"/><worldbody>
    <body pos="{x} 0 {z}" euler="0 {tilt} 0"><freejoint/><geom name="block" type="box" size="0.1 0.05 0.02" mass="0.1"/>
    </body></worldbody></mujoco>"""
    level = mujoco.MjModel.from_xml_string(xml.format(x=0, z=0.005, tilt=0))
    up = np.array([-math.sin(angle), 0.0, math.cos(angle)])
    ahead = np.array([math.cos(angle), 0.0, math.sin(angle)])
    x, _, z = 0.005 * up
    text = xml.format(x=x, z=z, tilt=-math.degrees(angle))
    tilted = mujoco.MjModel.from_xml_string(text)

    mesh = geoms.geom_mesh(level, 0, 24)
    ground = ground_of([Slope(angle)])
    grains = Grains(Extruded(STRESS), ground.strength, 0.0, 1e-5, ground.downhill_loss)
    body = Multibody(level, geoms.surfaces(level, {"block": mesh}), grains, slope=angle)
    while body.data.time < 0.3 - 1e-9:
        body.step(0.01)
    found = body.data.qpos[[0, 2]]

    ends = []
    for options in ({"slope": angle}, {"effects": [Slope(angle)]}):
        data = mujoco.MjData(tilted)
        with rft.mujoco.attach(tilted, STRESS, **options):
            mujoco.mj_step(tilted, data, 480)
        ends.append(data.qpos[:3].copy())
    np.testing.assert_array_equal(*ends)
    assert found[0] < -0.03
    expected = [ends[0] @ ahead, ends[0] @ up]
    np.testing.assert_allclose(found, expected, rtol=0.02, atol=1e-4)


ATTACHED = [
    ({"slope": 0.1, "effects": [Slope(0.1)]}, "the slope is given twice"),
    ({"effects": [Slope(0.1, mass=1.0)]}, "masses of their own"),
    ({"slope": 0.7}, "a slope of 40.1 degrees slides by itself"),
    ({"slope": 0.1, "tilted": True}, "gravity is not along -z"),
]


@pytest.mark.parametrize(("options", "said"), ATTACHED, ids=[s for _, s in ATTACHED])
def test_slopes_that_cannot_be_right_are_not_attached(options, said):
    model = mujoco.MjModel.from_xml_string(BLOCK.format(z=0.01, mass=MASS))
    options = dict(options)
    if options.pop("tilted", False):
        model.opt.gravity[0] = 1.0
    with pytest.raises(ValueError, match=said):
        rft.mujoco.attach(model, STRESS, **options)


def test_sinkage_on_a_slope_is_by_the_weight_across_it():
    """Of a block whose weight across the surface, over the strength of the ground for
    motion straight in, is that on level ground."""
    model = mujoco.MjModel.from_xml_string(BLOCK.format(z=0.02, mass=MASS))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    depths = []
    for slope in (0.0, 0.2):
        lean = [math.cos(slope / 2), 0.0, -math.sin(slope / 2), 0.0]
        model.body_quat[1] = lean
        model.body_pos[1] = [-0.02 * math.sin(slope), 0.0, 0.02 * math.cos(slope)]
        mujoco.mj_forward(model, data)
        with rft.mujoco.attach(model, STRESS, slope=slope) as sand:
            depths.append(sand.sinkage(data)[0])
    assert depths[1] == pytest.approx(depths[0], rel=1e-6)


def test_a_machine_of_its_own_walks_on_a_slope(tmp_path):
    """Two rollers under a trunk are slower uphill and faster downhill."""
    text = """<mujoco><worldbody><body name="trunk"><freejoint/>
    <geom name="trunk" type="box" size="0.06 0.03 0.01" mass="0.1"/>
    <body pos="0.04 0 0"><joint name="front" axis="0 1 0"/>
    <geom name="r1" type="cylinder" size="0.02 0.04" zaxis="0 1 0" mass="0.02"/></body>
    <body pos="-0.04 0 0"><joint name="rear" axis="0 1 0"/>
    <geom name="r2" type="cylinder" size="0.02 0.04" zaxis="0 1 0" mass="0.02"/></body></body></worldbody>
    <actuator><velocity name="front" joint="front" kv="0.05"/><velocity name="rear" joint="rear" kv="0.05"/>
    </actuator></mujoco>"""
    path = tmp_path / "cart.xml"
    path.write_text(text)
    robot = Mjcf(str(path), geoms=("trunk", "r1", "r2"))
    speeds = []
    for degrees in (-4.0, 0.0, 1.0):
        effects = (Slope(math.radians(degrees)),)
        walker = Walker(robot, Tripod(2.0), STRESS, effects)
        (one,) = engine("mujoco").walk([walker], Fineness(steps=32, duration=2.0))
        speeds.append(one.speed)
    assert 0.1 < speeds[2] < 0.9 * speeds[1] < 0.7 * speeds[0]
