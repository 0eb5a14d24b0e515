"""Steps in sand: bodies that stop stay where they are, at the steps that robots take;
forces, errors and order of the steps."""

import warnings

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import rft
from rft.balance import backend
from rft.balance.backend import Note, preferring
from rft.terradynamics.ground import GrainInertia, Ground, Slope, ground_of
from rft.terradynamics.meshes import Spatial
from rft.terradynamics.meshes.forces.contact import Motion, Part, load, load_with_slopes
from rft.terradynamics.meshes.forces.extruded import Extruded
from rft.terradynamics.plates import StressMap

mujoco = pytest.importorskip(
    "mujoco", reason="needs the extra: pip install 'geomech[mujoco]'"
)
from rft.mujoco.example import HIPS, hexapod  # noqa: E402

needs_numba = pytest.mark.skipif(
    not backend.installed(), reason="needs the extra: pip install 'geomech[fast]'"
)
pytestmark = pytest.mark.usefixtures("fastest")
LOOSE = "poppy-seeds-loose"
BLOCK = '<geom type="box" size="0.1 0.05 0.015" mass="2"/>'
BOX = '<geom type="box" size=".05 .05 .03" mass="1"/>'
STEPS = pytest.mark.parametrize("step", [0.002, 0.0005])


@pytest.fixture(autouse=True)
def no_notes():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Note)
        yield


def free(z, geoms, more="", x=0.0):
    """A free body at a height."""
    return f'<body pos="{x} 0 {z}" {more}><freejoint/>{geoms}</body>'


def model_of(world, step, more="", options=""):
    option = f'<option timestep="{step}" {options}/>'
    return mujoco.MjModel.from_xml_string(
        f"<mujoco>{option}<worldbody>{world}</worldbody>{more}</mujoco>"
    )


def after(model, data, seconds):
    """Step for a time, and return the positions."""
    mujoco.mj_step(model, data, round(seconds / model.opt.timestep))
    return data.qpos.copy()


def in_loose(model, seconds, start=lambda data: None, **options):
    """Positions after some seconds in loose poppy seeds, the speed then, and what the steps cost."""
    data = mujoco.MjData(model)
    start(data)
    with rft.mujoco.attach(model, LOOSE, **options) as sand:
        places = [after(model, data, s) for s in seconds]
        return np.array(places), np.abs(data.qvel).max(), sand.effort


@needs_numba
@STEPS
@pytest.mark.parametrize("integrator", ["Euler", "implicit", "implicitfast", "RK4"])
def test_a_block_that_fell_stays_where_it_stopped(step, integrator):
    """-51.13 mm at 0.1 ms; within 0.5 mm of that, still, and every step solved."""
    model = model_of(free(0.515, BLOCK), step, options=f'integrator="{integrator}"')
    (first, last), speed, effort = in_loose(model, (0.4, 0.8))
    assert 1e3 * first[2] == pytest.approx(-51.13, abs=0.15)
    assert abs(last[2] - first[2]) < 2e-6 and speed < 1e-6
    assert effort.unsolved == effort.coarser == 0 < effort.steps


@needs_numba
@STEPS
def test_a_block_that_was_pressed_does_not_rise(step):
    """By 60 N, for half a second; -17.34 mm at 0.1 ms."""
    model = model_of(free(0.016, BLOCK), step)
    data = mujoco.MjData(model)
    with rft.mujoco.attach(model, LOOSE):
        data.xfrc_applied[1, 2] = -60.0
        pressed = after(model, data, 0.5)[2]
        data.xfrc_applied[1, 2] = 0.0
        assert 1e3 * pressed == pytest.approx(-17.34, abs=0.1)
        assert after(model, data, 1.0)[2] == pytest.approx(pressed, abs=1e-5)


@needs_numba
@STEPS
@pytest.mark.parametrize("angle", [0.1, 0.3, 0.5])
def test_a_box_on_a_slope_below_repose_comes_to_rest(step, angle):
    lean = f'euler="0 {-np.degrees(angle)} 0"'
    model = model_of(free(0.035, BOX, lean), step)
    (first, last), _, _ = in_loose(model, (2.0, 1.0), slope=angle)
    assert np.linalg.norm(last[:3] - first[:3]) < 1e-4


@needs_numba
@STEPS
def test_an_upright_rod_stands(step):
    """4 cm deep, two degrees off the vertical."""
    rod = '<geom type="capsule" size=".008" fromto="0 0 -.067 0 0 .067" mass=".1"/>'
    model = model_of(free(0.035, rod, 'euler="2 0 0"'), step)
    data = mujoco.MjData(model)
    with rft.mujoco.attach(model, LOOSE):
        after(model, data, 2.0)
        assert np.degrees(np.arccos(data.xmat[1, 8])) < 2.5


QUADRUPED_LEG = """<body pos="{x} {y} 0"><joint name="a{n}" axis="1 0 0"/><joint name="b{n}" axis="0 1 0"/>
<geom type="capsule" size=".02" fromto="0 0 0 0 0 -.21" mass="1"/><body pos="0 0 -.21">
<joint name="c{n}" axis="0 1 0" range="-2.7 -.6"/><geom type="capsule" size=".012" fromto="0 0 0 0 0 -.2" mass=".2"/>
<geom name="foot{n}" type="sphere" size=".022" pos="0 0 -.21" mass=".05"/></body></body>"""
MOTOR = '<position joint="{}" kp="150" kv="3" forcerange="-35 35"/>'
HIP_PLACES = ((0.19, 0.13), (0.19, -0.13), (-0.19, 0.13), (-0.19, -0.13))
STANCE = np.tile([0.0, 0.75, -1.5], 4)


def quadruped(step):
    """A robot of 12 kg with two capsules, a foot and three motors a leg."""
    places = enumerate(HIP_PLACES)
    legs = "".join(QUADRUPED_LEG.format(x=x, y=y, n=n) for n, (x, y) in places)
    motors = "".join(MOTOR.format(f"{j}{n}") for n in range(4) for j in "abc")
    trunk = f'<geom type="box" size=".19 .05 .05" mass="6"/>{legs}'
    return mujoco.MjModel.from_xml_string(
        f"""<mujoco><compiler angle="radian"/><option timestep="{step}"/><default>
        <joint armature=".01" damping=".1"/><geom contype="2" conaffinity="1"/></default>
        <worldbody>{free(0.33, trunk)}</worldbody><actuator>{motors}</actuator></mujoco>"""
    )


def stand(data):
    data.qpos[7:] = data.ctrl[:] = STANCE


@needs_numba
@STEPS
def test_a_quadruped_stands_and_trots_as_at_short_steps(step):
    """Within 1 mm over a second and a half; a stride of its trot goes as far as at 0.1 ms."""
    model = quadruped(step)
    data = mujoco.MjData(model)
    stand(data)
    with rft.mujoco.attach(model, LOOSE) as sand:
        first = after(model, data, 0.5)
        last = after(model, data, 1.5)
        assert abs(last[2] - first[2]) < 1e-3 and sand.effort.unsolved == 0
        begin = data.time
        for _ in range(round(1.0 / step)):
            data.ctrl[:] = trot(data.time - begin)
            mujoco.mj_step(model, data)
        assert data.qpos[0] - last[0] == pytest.approx(TROT, rel=0.01)


@needs_numba
@pytest.mark.soak
def test_a_quadruped_stands_for_five_seconds_and_trots_for_three():
    """Within 1 mm; its trot goes as far within 1 % at 2, 0.5 and 0.1 ms."""
    ways = []
    for step in (0.002, 0.0005, 0.0001):
        model = quadruped(step)
        data = mujoco.MjData(model)
        stand(data)
        with rft.mujoco.attach(model, LOOSE) as sand:
            first, last = after(model, data, 0.5), after(model, data, 4.5)
            assert abs(last[2] - first[2]) < 1e-3
            begin = data.time
            for _ in range(round(3.0 / step)):
                data.ctrl[:] = trot(data.time - begin)
                mujoco.mj_step(model, data)
            ways.append(data.qpos[0] - last[0])
            print(step, last[2], ways[-1], sand.effort)
    np.testing.assert_allclose(ways, ways[-1], rtol=0.01)


TROT = 0.3804  # m, in two strides, at 0.1 ms


def trot(time):
    phase = 4 * np.pi * time + np.array([0, np.pi, np.pi, 0])
    lift = np.maximum(np.sin(phase), 0)
    target = STANCE.reshape(4, 3).copy()
    target[:, 1] += 0.25 * np.cos(phase) + 0.3 * lift
    target[:, 2] -= 0.6 * lift
    return target.ravel()


@needs_numba
@STEPS
@pytest.mark.parametrize("integrator", ["Euler", "implicitfast", "RK4"])
@pytest.mark.parametrize("cone", ["pyramidal", "elliptic"])
def test_a_foot_bears_what_lies_on_it(step, integrator, cone):
    """Contacts and grains act at once: a rigid box of 3 kg, which touches no sand, stays on the foot."""
    plate = '<geom name="foot" type="box" size="0.1 0.1 0.02" mass="1"/>'
    load_on_it = '<geom type="box" size="0.04 0.04 0.04" mass="3"/>'
    world = free(0.02, plate) + free(0.10, load_on_it)
    model = model_of(world, step, options=f'integrator="{integrator}" cone="{cone}"')
    (first, last), _, _ = in_loose(model, (0.5, 0.5), geoms="foot")
    assert 1e3 * first[[2, 9]] == pytest.approx([5.2, 64.8], abs=0.3)
    assert abs(last[[2, 9]] - first[[2, 9]]).max() < 2e-5


@needs_numba
@STEPS
def test_welded_boxes_sink_and_stay(step):
    """A weld, a limit, a spring and a leg of 10 g: -9.75 mm at 0.1 ms."""
    a = '<geom type="box" size=".05 .03 .02" mass=".5"/>'
    leg = """<body pos=".05 0 0"><joint axis="0 1 0" range="-10 10" limited="true" stiffness="5"/>
    <geom type="capsule" size=".01" fromto="0 0 0 .1 0 -.05" mass=".01"/></body>"""
    world = free(0.1, a, 'name="a" euler="0 20 0"') + free(
        0.1, a + leg, 'name="b"', 0.2
    )
    weld = '<equality><weld body1="a" body2="b"/></equality>'
    (first, last), _, _ = in_loose(model_of(world, step, weld), (0.5, 0.3))
    assert 1e3 * first[2] == pytest.approx(-9.8, abs=0.15)
    assert abs(last[2] - first[2]) < 2e-5


@needs_numba
def test_the_order_of_the_steps_is_one():
    """Of where a ball that is thrown into the sand comes to rest, and of a tilted box, from 4 to 0.5 ms."""
    ball = '<geom type="sphere" size=".03" mass=".2"/>'
    tilted = free(0.15, BOX, 'euler="30 20 0"')
    for world, speed in ((free(0.1, ball), 1.0), (tilted, 0.0)):
        ends = []
        for step in (0.004, 0.002, 0.001, 0.0005, 0.00025):
            model = model_of(world, step)

            def throw(data, speed=speed):
                data.qvel[0] = speed

            (end,), _, _ = in_loose(model, (1.0,), throw)
            ends.append(end[[0, 2]])
        errors = np.linalg.norm(np.array(ends[:-1]) - ends[-1], axis=1)
        order = np.log2(errors[0] / errors[2]) / 2
        assert 0.7 < order < 1.6, errors


@needs_numba
@STEPS
def test_grains_never_do_work(step):
    """On a hexapod that walks, beyond 1e-7 of the largest kinetic energy so far."""
    model = hexapod()
    model.opt.timestep = step
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    data = mujoco.MjData(model)
    tripod = np.array([((k // 2) + k % 2) % 2 * np.pi for k in range(len(HIPS))])
    data.qpos[7:] = data.ctrl[:] = tripod
    worst = energy = 0.0
    with rft.mujoco.attach(model, LOOSE) as sand:
        for _ in range(round(0.3 / step)):
            data.ctrl[:] = 4 * np.pi * data.time + tripod
            mujoco.mj_forward(model, data)
            energy = max(energy, data.energy[1])
            worst = max(worst, sand.power(data) * step)
            mujoco.mj_step(model, data)
    assert energy > 1e-3 and worst < 1e-7 * energy


WORLDS = {
    "box": (free(0.03, BOX, 'euler="20 10 0"'), "", {}),
    "two robots and a weld": (
        free(0.02, BOX, 'name="a"')
        + free(0.02, BOX, 'name="b" euler="0 20 0"', 0.5)
        + free(0.02, BOX, 'name="c"', 1.0),
        '<equality><weld body1="a" body2="b"/></equality>',
        {"regions": {"x > 0.49": StressMap(zeta=0.6)}},
    ),
    "rock": (
        '<geom type="plane" size="1 1 .1" pos="0 0 -.02"/>' + free(0.0, BLOCK),
        "",
        {"effects": (GrainInertia(1.0, 600.0),)},
    ),
}


@needs_numba
@pytest.mark.parametrize("options", ['cone="elliptic"', 'integrator="implicitfast"'])
@pytest.mark.parametrize("name", WORLDS)
def test_numpy_and_compiled_code_take_the_same_steps(name, options):
    world, more, given = WORLDS[name]
    ends = []
    for kind in ("numpy", "numba"):
        model = model_of(world, 0.002, more, options)
        data = mujoco.MjData(model)
        data.qvel[:] = 0.1 * np.random.default_rng(1).normal(size=model.nv)
        with preferring(kind), rft.mujoco.attach(model, LOOSE, **given) as sand:
            if "regions" in given:
                sand.detach()
                sand = rft.mujoco.attach(model, StressMap(zeta=0.3), **given)
            mujoco.mj_step(model, data, 8)
            mujoco.mj_forward(model, data)
            ends.append(np.concatenate([data.qvel, sand.forces(data).ravel()]))
            assert sand.effort.unsolved == 0 < sand.effort.steps
            sand.detach()
    size = np.abs(ends[0]).max()
    np.testing.assert_allclose(ends[0], ends[1], rtol=0, atol=1e-4 * size)


@needs_numba
def test_robots_of_one_model_are_solved_block_by_block():
    """Each as it goes alone; a robot beside that is not in the sand changes nothing."""
    alone = model_of(free(0.03, BOX, 'euler="20 10 0"'), 0.002)
    (end,), _, _ = in_loose(alone, (0.2,))
    many = "".join(free(0.03, BOX, 'euler="20 10 0"', x=k) for k in range(3))
    model = model_of(many + free(9.0, BOX, x=9), 0.002)
    (ends,), _, _ = in_loose(model, (0.2,))
    for k in range(3):
        np.testing.assert_allclose(ends[7 * k + 1 : 7 * k + 7], end[1:], atol=1e-7)


@pytest.mark.parametrize(
    "law",
    [
        Spatial(3e5, grazing=0.1),
        Spatial(3e5, tension="keep", grazing=0.1),
        Spatial(3e5, tension="push", grazing=0.1),
        Extruded(StressMap(zeta=0.3)),
        Extruded(StressMap(zeta=0.3, tension="cut", grazing=0.1)),
    ],
)
def test_slopes_of_loads_are_their_derivatives(law):
    """By differences, on random parts and velocities, of leading faces and sheets, on a slope with grains' inertia."""
    rng, count = np.random.default_rng(1), 300
    turn = Rotation.random(random_state=1).as_matrix()
    n = rng.normal(size=(3, count))
    n /= np.linalg.norm(n, axis=0)
    middle, arms = rng.normal(size=(2, 3, count))
    area, depth = rng.uniform(1, 2, (2, count))
    part = Part(tuple(n), tuple(middle), area, depth, tuple(arms))
    v = rng.normal(size=(3, count)) * 10 ** rng.uniform(-3, 0, count)
    sheet = rng.uniform(size=count) < 0.3
    rounded = Ground(rounding=1e-2, grazing_sine=law.grazing_sine)
    motion = Motion((), (), 0.0, tuple(turn[2]), tuple(turn[0]), 0.0)
    for effects in ((), (Slope(0.2), GrainInertia(2.0, 300.0))):
        ground = ground_of(effects, rounded)

        def both(v, ground=ground):
            force, moment, _ = load(law, ground, part, motion, tuple(v), sheet)
            return np.array([force, moment])

        found = load_with_slopes(law, ground, part, motion, tuple(v), sheet)
        np.testing.assert_allclose(np.array(found[:2]), both(v), rtol=1e-12)
        for k in range(3):
            change = np.eye(3)[k][:, None] * 1e-6 * np.linalg.norm(v, axis=0)
            expected = both(v + change) - both(v - change)
            expected /= 2 * np.abs(change[k])
            size = np.abs(expected).max((0, 1)) + 1e-6
            error = np.abs(np.array([found[2][k], found[3][k]]) - expected) / size
            assert np.quantile(error.max((0, 1)), 0.97) < 1e-6


def test_what_sleeps_and_what_weighs_nothing_stays(solved_by):
    """A box that MuJoCo lets sleep lies as one that is awake; a foot of a milligram hangs in the sand."""
    if not hasattr(mujoco.MjData, "body_awake"):
        pytest.skip("MuJoCo 4 lets bodies sleep")
    heights = []
    for sleep in ("enable", "disable"):
        flag = f'<option timestep="0.002"><flag sleep="{sleep}"/></option>'
        world = f"<worldbody>{free(0.0, BOX)}</worldbody>"
        model = mujoco.MjModel.from_xml_string(f"<mujoco>{flag}{world}</mujoco>")
        heights += [*in_loose(model, [0.3])[0][:, 2]]
    assert heights[0] == pytest.approx(heights[1], abs=1e-5)
    foot = '<geom type="sphere" size=".02" mass="1e-6"/>'
    limb = f'<body pos="0 0 -.03"><joint axis="0 1 0" armature="1e-5"/>{foot}</body>'
    model = model_of(free(0.0, BOX + limb), 0.002)
    places, speed, effort = in_loose(model, [0.2])
    assert speed < 1e-3 and abs(places[0, 7]) < 0.1 and effort.unsolved == 0


@needs_numba
def test_forces_and_steps_agree_at_any_speed():
    """Also at speeds that MuJoCo calls bad, where both are nothing."""
    ball = '<geom name="ball" type="sphere" size="0.03" mass="0.2"/>'
    model = model_of(free(0.0, ball), 1e-6)
    for speed in (1e-9, 1.0, 150.0, 1e5, 1e155):
        data = mujoco.MjData(model)
        data.qvel[0] = speed
        with rft.mujoco.attach(model, StressMap(zeta=0.3)) as sand:
            mujoco.mj_forward(model, data)
            force = sand.forces(data)[0]
        assert np.isfinite(force).all()
        np.testing.assert_allclose(data.qfrc_passive[:3], force, rtol=1e-6, atol=1e-9)
        assert (force[0] < 0.0) == (speed < 1e100)


def test_a_geom_that_changes_stops_the_sand_with_a_line(solved_by):
    model = model_of(free(0.0, '<geom name="ball" type="sphere" size="0.03"/>'), 0.002)
    data = mujoco.MjData(model)
    with rft.mujoco.attach(model, StressMap(zeta=0.3)) as sand:
        mujoco.mj_step(model, data)
        model.geom_size[0, 0] = 0.05
        line = "detached: the geom 'ball' changed after attach: attach it anew"
        with pytest.warns(Note, match=line) as caught:
            mujoco.mj_step(model, data, 3)
        assert len(caught) == 1 and not sand.is_attached


@needs_numba
def test_the_error_of_a_run_covers_steps_and_elements():
    """Of a ball that is thrown into the sand, against a run with steps and elements an eighth as long; data stay."""
    ball = '<geom type="sphere" size=".03" mass=".2"/>'
    errors = []
    for step, element in ((0.002, 0.02), (0.00025, 0.0025)):
        model = model_of(free(0.05, ball), step)
        data = mujoco.MjData(model)
        data.qvel[0] = 1.0
        with rft.mujoco.attach(model, LOOSE, element=element) as sand:
            if not errors:
                error = sand.error(data, 0.5, lambda model, data: None)
                assert data.time == 0.0 and data.qvel[0] == 1.0
            errors.append(after(model, data, 0.5)[:3])
    true = np.linalg.norm(errors[0] - errors[1])
    assert 0.5 * true < error.step + error.elements < 4.0 * true
    assert error.moved > 0.1 and min(error.step, error.elements) > 0.0


SLENDER = """<mujoco><worldbody><body pos="0 0 .1" euler="0 70 0"><freejoint/>
<geom type="capsule" size=".012 .024" mass="1"/></body></worldbody></mujoco>"""


@needs_numba
def test_the_error_of_elements_is_that_of_a_capsule_thrown_into_the_sand():
    """Elements half as long around as well as along: against some 14,000 elements."""
    ends = []
    for element in (None, 0.0016):
        model = mujoco.MjModel.from_xml_string(SLENDER)
        data = mujoco.MjData(model)
        data.qvel[:] = [0.3, 0.1, -1.0, 2.0, 1.0, 0.0]
        with rft.mujoco.attach(model, "poppy-seeds-loose", element=element) as sand:
            if element is None:
                told = sand.error(data, 0.15).elements
            mujoco.mj_step(model, data, 75)
        mujoco.mj_kinematics(model, data)
        ends.append(data.geom_xpos[0].copy())
    assert told == pytest.approx(np.linalg.norm(ends[0] - ends[1]), rel=0.5)
