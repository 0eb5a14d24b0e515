"""Steps in sand: bodies that stop stay where they are, at the steps that robots take;
forces, errors and order of the steps."""

import warnings

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import rft
from rft.balance import backend
from rft.balance.backend import preferring
from rft.core.notes import Note
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
MAP = StressMap(zeta=0.3)
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
    """Positions after some seconds in loose poppy seeds, the speed then, and effort."""
    data = mujoco.MjData(model)
    start(data)
    with rft.mujoco.attach(model, LOOSE, **options) as sand:
        places = [after(model, data, s) for s in seconds]
        return np.array(places), np.abs(data.qvel).max(), sand.effort


PLATE = '<geom name="foot" type="box" size="0.1 0.1 0.02" mass="1"/>'
LOAD = '<geom type="box" size="0.04 0.04 0.04" mass="3"/>'
HALF = '<geom type="box" size=".05 .03 .02" mass=".5"/>'
LEG = """<body pos=".05 0 0"><joint axis="0 1 0" range="-10 10" limited="true"
stiffness="5"/><geom type="capsule" size=".01" fromto="0 0 0 .1 0 -.05" mass=".01"/>
</body>"""
WELDED = free(0.1, HALF, 'name="a" euler="0 20 0"') + free(
    0.1, HALF + LEG, 'name="b"', 0.2
)
WELD = '<equality><weld body1="a" body2="b"/></equality>'
# Worlds, what is given to attach, seconds, heights, mm, at 0.1 ms, and the margin, mm.
# A rigid box that touches no sand stays on a foot: contacts and grains act at once.
RESTING = {
    "block": (free(0.515, BLOCK), "", {}, (0.4, 0.8), [-51.13], 0.15),
    "foot": (
        free(0.02, PLATE) + free(0.10, LOAD),
        "",
        {"geoms": "foot"},
        (0.5, 0.5),
        [5.2, 64.8],
        0.3,
    ),
    "weld, limit, spring": (WELDED, WELD, {}, (0.5, 0.3), [-9.8], 0.15),
}
AT_REST = [
    *(
        ("block", f'integrator="{x}"')
        for x in ("Euler", "implicit", "implicitfast", "RK4")
    ),
    *(
        ("foot", f'integrator="{x}" cone="{cone}"')
        for x in ("Euler", "implicitfast", "RK4")
        for cone in ("pyramidal", "elliptic")
    ),
    ("weld, limit, spring", ""),
]


@needs_numba
@STEPS
@pytest.mark.parametrize(("name", "options"), AT_REST)
def test_what_came_to_rest_stays_where_it_does_at_short_steps(name, options, step):
    """At 0.1 ms, in mm; and every step is solved."""
    world, more, given, seconds, expected, margin = RESTING[name]
    model = model_of(world, step, more, options)
    (first, last), speed, effort = in_loose(model, seconds, **given)
    heights = first[2::7][: len(expected)]
    assert 1e3 * heights == pytest.approx(expected, abs=margin)
    assert abs(last[2::7][: len(expected)] - heights).max() < 2e-5
    if name == "block":
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


def stood_and_trotted(step, standing, walking):
    """Change of height after half a second, m; the way of the trot, m; the effort."""
    model = quadruped(step)
    data = mujoco.MjData(model)
    stand(data)
    with rft.mujoco.attach(model, LOOSE) as sand:
        first = after(model, data, 0.5)
        last = after(model, data, standing)
        begin = data.time
        for _ in range(round(walking / step)):
            data.ctrl[:] = trot(data.time - begin)
            mujoco.mj_step(model, data)
        return last[2] - first[2], data.qpos[0] - last[0], sand.effort


@needs_numba
def test_a_quadruped_stands_and_trots_as_at_short_steps():
    """Within 1 mm over a second and a half; a stride goes as far as at 0.1 ms."""
    sunk, way, effort = stood_and_trotted(0.002, 1.5, 1.0)
    assert abs(sunk) < 1e-3 and effort.unsolved == 0
    assert way == pytest.approx(TROT, rel=0.01)


@needs_numba
@pytest.mark.soak
def test_a_quadruped_stands_for_five_seconds_and_trots_for_three():
    """Within 1 mm; its trot goes as far within 1 % at 2, 0.5 and 0.1 ms."""
    runs = [stood_and_trotted(step, 4.5, 3.0) for step in (0.002, 0.0005, 0.0001)]
    sunk, ways, _ = zip(*runs)
    np.testing.assert_allclose(sunk, 0.0, atol=1e-3)
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
@pytest.mark.parametrize(
    ("world", "speed"),
    [
        (free(0.1, '<geom type="sphere" size=".03" mass=".2"/>'), 1.0),
        (free(0.15, BOX, 'euler="30 20 0"'), 0.0),
    ],
    ids=["a ball that is thrown", "a tilted box"],
)
def test_the_order_of_the_steps_is_one(world, speed):
    """Of where it comes to rest, from 4 to 0.5 ms."""

    def throw(data):
        data.qvel[0] = speed

    steps = 0.004, 0.002, 0.001, 0.0005, 0.00025
    places = [in_loose(model_of(world, step), (1.0,), throw)[0] for step in steps]
    ends = np.array(places)[:, 0, [0, 2]]
    errors = np.linalg.norm(ends[:-1] - ends[-1], axis=1)
    assert 0.7 < np.log2(errors[0] / errors[2]) / 2 < 1.6, errors


@needs_numba
@STEPS
def test_grains_never_do_work(step):
    """On a hexapod that walks, beyond 1e-7 of the largest kinetic energy so far."""
    model = hexapod()
    model.opt.timestep = step
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    data = mujoco.MjData(model)
    k = np.arange(len(HIPS))
    tripod = (k // 2 + k % 2) % 2 * np.pi
    data.qpos[7:] = tripod
    rows = []
    with rft.mujoco.attach(model, LOOSE) as sand:
        for _ in range(round(0.3 / step)):
            data.ctrl[:] = 4 * np.pi * data.time + tripod
            mujoco.mj_forward(model, data)
            rows.append((data.energy[1], sand.power(data) * step))
            mujoco.mj_step(model, data)
    energy, work = np.max(rows, axis=0)
    assert energy > 1e-3 and work < 1e-7 * energy


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
    model = model_of(world, 0.002, more, options)
    ends = []
    efforts = []
    for kind in ("numpy", "numba"):
        data = mujoco.MjData(model)
        data.qvel[:] = 0.1 * np.random.default_rng(1).normal(size=model.nv)
        with preferring(kind), rft.mujoco.attach(model, MAP, **given) as sand:
            mujoco.mj_step(model, data, 8)
            mujoco.mj_forward(model, data)
            ends.append(np.concatenate([data.qvel, sand.forces(data).ravel()]))
            efforts.append(sand.effort)
    one, other = efforts
    assert one[:5] == other[:5] and one.unsolved == 0 < one.steps
    assert one.residual == pytest.approx(other.residual, rel=0.1, abs=1e-12)
    size = np.abs(ends[0]).max()
    np.testing.assert_allclose(ends[0], ends[1], rtol=0, atol=1e-4 * size)


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
@pytest.mark.parametrize("effects", [(), (Slope(0.2), GrainInertia(2.0, 300.0))])
def test_slopes_of_loads_are_their_derivatives(law, effects):
    """By differences, on random parts and velocities, of leading faces and sheets."""
    rng = np.random.default_rng(1)
    turn = Rotation.random(random_state=1).as_matrix()
    n, middle, arms, v = rng.normal(size=(4, 3, 300))
    n /= np.linalg.norm(n, axis=0)
    v *= 10 ** rng.uniform(-3, 0, 300)
    part = Part(tuple(n), tuple(middle), *rng.uniform(1, 2, (2, 300)), tuple(arms))
    sheet = rng.uniform(size=300) < 0.3
    ground = ground_of(effects, Ground(rounding=1e-2, grazing_sine=law.grazing_sine))
    motion = Motion((), (), 0.0, tuple(turn[2]), tuple(turn[0]), 0.0)

    def both(v):
        return np.array(load(law, ground, part, motion, tuple(v), sheet)[:2])

    found = load_with_slopes(law, ground, part, motion, tuple(v), sheet)
    size = 1e-6 * np.linalg.norm(v, axis=0)
    for k in range(3):
        change = np.eye(3)[k][:, None] * size
        expected = (both(v + change) - both(v - change)) / (2 * size)
        error = np.abs(np.array([found[2][k], found[3][k]]) - expected)
        error /= np.abs(expected).max((0, 1)) + 1e-6
        assert np.quantile(error.max((0, 1)), 0.97) < 1e-6


@pytest.mark.skipif(
    not hasattr(mujoco.MjData, "body_awake"), reason="MuJoCo 4 lets bodies sleep"
)
def test_a_box_that_mujoco_lets_sleep_lies_as_one_that_is_awake():
    heights = []
    for sleep in ("enable", "disable"):
        flag = f'<option timestep="0.002"><flag sleep="{sleep}"/></option>'
        world = f"<worldbody>{free(0.0, BOX)}</worldbody>"
        model = mujoco.MjModel.from_xml_string(f"<mujoco>{flag}{world}</mujoco>")
        places, _, _ = in_loose(model, [0.3])
        heights.append(places[0, 2])
    assert heights[0] == pytest.approx(heights[1], abs=1e-5)


def test_a_foot_of_a_milligram_hangs_in_the_sand():
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


def test_a_geom_that_changes_stops_the_sand_with_a_line(solved_by):
    model = model_of(free(0.0, '<geom name="ball" type="sphere" size="0.03"/>'), 0.002)
    data = mujoco.MjData(model)
    with rft.mujoco.attach(model, StressMap(zeta=0.3)) as sand:
        mujoco.mj_step(model, data, 3)
        assert sand.effort.steps == 3
        model.geom_size[0, 0] = 0.05
        with pytest.warns(Note, match="'ball'") as told:
            mujoco.mj_step(model, data, 3)
        assert [x.filename for x in told] == [__file__]
        assert not sand.is_attached


@needs_numba
def test_the_error_of_a_run_covers_steps_and_elements():
    """Of a ball that its control throws, against steps and elements an eighth as long;
    data stay."""
    ball = free(0.05, '<geom type="sphere" size=".03" mass=".2"/>')

    def throw(model, data):
        if data.time == 0.0:
            data.qvel[0] = 1.0

    ends = []
    for step, length in ((0.002, None), (0.00025, 0.0025)):
        model = model_of(ball, step)
        data = mujoco.MjData(model)
        with rft.mujoco.attach(model, LOOSE, element=length) as sand:
            if not ends:
                error = sand.error(data, 0.5, throw)
                assert data.time == data.qvel[0] == 0.0
            throw(model, data)
            ends.append(after(model, data, 0.5)[:3])
    true = np.linalg.norm(ends[0] - ends[1])
    assert 0.5 * true < error.step + error.elements < 4.0 * true
    assert error.moved > 0.1 and min(error.step, error.elements) > 0.0
    with rft.mujoco.attach(model, LOOSE) as sand:
        falling = mujoco.MjData(model)
        free_error = sand.error(falling, 0.05)  # it touches no grains
    assert free_error.elements == 0.0 < free_error.step
    assert free_error.moved == pytest.approx(9.81 / 2 * 0.05**2, rel=0.01)
