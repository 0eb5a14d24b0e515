"""Sand under MuJoCo models: forces, virtual work, symmetries, prints and lifetimes."""

import contextlib
import copy
import gc
import importlib
import math
import pickle
import sys
import warnings
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from refusals import refuses
from scipy.spatial.transform import Rotation

import rft
from rft.balance import backend
from rft.core.notes import Note
from rft.fits.plates import ZetaFit, fit_stress
from rft.terradynamics.ground import (
    DisturbedGround,
    GrainInertia,
    Ground,
    Slope,
    ground_of,
)
from rft.terradynamics.meshes import Spatial
from rft.terradynamics.meshes.forces.blocks import Blocks
from rft.terradynamics.meshes.forces.contact import Motion, faces
from rft.terradynamics.meshes.forces.extruded import Extruded
from rft.terradynamics.plates import PlateDrags, StressMap
from rft.terradynamics.plates.stress import COEFFICIENTS

mujoco = pytest.importorskip(
    "mujoco", reason="needs the extra: pip install 'geomech[mujoco]'"
)
from rft.mujoco.ground import footprints  # noqa: E402
from rft.mujoco.ground.selection import overlap_note  # noqa: E402
from rft.mujoco.media import law_of  # noqa: E402
from rft.mujoco.sand import meshes  # noqa: E402
from rft.terradynamics.meshes.geoms import mesh_of_elements  # noqa: E402

needs_numba = pytest.mark.skipif(
    not backend.installed(), reason="needs the extra: pip install 'geomech[fast]'"
)
HAS_BATCH = int(mujoco.__version__.partition(".")[0]) >= 4
needs_batch = pytest.mark.skipif(not HAS_BATCH, reason="needs mujoco.batch")
pytestmark = pytest.mark.usefixtures("fastest")
# Steps so short that forces are those of the velocities in the data.
AT_ONCE = '<option timestep="1e-15" gravity="0 0 0"/>'
SPATIAL = Spatial(3e5, surface_friction=0.6, grazing=math.radians(5))
MAP = StressMap(zeta=0.3, grazing=math.radians(5))
OTHER = StressMap(C01=0.1, D10=0.01, zeta=0.7, grazing=math.radians(8))
GEOMS = (
    'type="box" size="0.05 0.03 0.02"',
    'type="capsule" size="0.02 0.04"',
    'type="cylinder" size="0.03 0.04"',
    'type="sphere" size="0.04"',
    'type="ellipsoid" size="0.05 0.03 0.02"',
    'type="mesh" mesh="wedge"',
)
ASSET = '<asset><mesh name="wedge" vertex="0 0 0 .06 0 0 0 .04 0 0 0 .1"/></asset>'
BALL = """<body name="ball" pos="0 0 0.01"><freejoint/>
<geom name="ball" type="sphere" size="0.03" mass="0.2"/></body>"""


@pytest.fixture(autouse=True)
def no_callback_remains():
    """Every test leaves MuJoCo without a callback; notes are asked for where needed."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Note)
        yield
    gc.collect(0 if mujoco.get_mjcb_passive() is None else 2)
    assert mujoco.get_mjcb_passive() is None


def model_of(world, options="", more=""):
    return mujoco.MjModel.from_xml_string(
        f"<mujoco>{options}{ASSET}<worldbody>{world}</worldbody>{more}</mujoco>"
    )


def free(geoms, place=""):
    return f"<body {place}><freejoint/>{geoms}</body>"


def quaternion(turn):
    """As MuJoCo has it: the real part first."""
    return np.roll(turn.as_quat(), 1, -1)


def assert_close(found, expected, part):
    """Assert that numbers are expected ones, to a part of the largest."""
    most = part * np.abs(expected).max()
    np.testing.assert_allclose(found, expected, rtol=0, atol=most)


def forces_of(law, model, data, **options):
    """Forces on the geoms."""
    with rft.mujoco.attach(model, law, **options) as sand:
        mujoco.mj_forward(model, data)
        return sand.forces(data)


# Forces


CHAINS = {
    "free root": (("free",), ("ball",), (), ("hinge", "slide"), ("hinge",)),
    "fixed root": (("hinge",), (), ("slide", "slide", "hinge"), ("ball",), ()),
    "welded to the world": ((), ("ball",), ("slide",), ("hinge",), ("hinge",)),
}
# With arrays of MuJoCo's that are empty without it.
MORE = """<worldbody><camera/><light/>
<body name="m" mocap="true" pos="0 0 9"><site name="s"/></body></worldbody>
<tendon><spatial name="t"><site site="s"/><site site="o"/></spatial></tendon>
<actuator><motor tendon="t"/></actuator><sensor><tendonpos tendon="t"/></sensor>
<equality><weld body1="b0" body2="m" active="false"/></equality>"""


def chain(joints, rng):
    """A branching chain of links with random places, joints and geoms."""

    def numbers(n, size):
        return " ".join(f"{x:.4f}" for x in size * rng.normal(size=n))

    text = ""
    for k, kinds in enumerate(joints):
        place = f'pos="{numbers(3, 0.02)}" euler="{numbers(3, 60)}"'
        turn = numbers(3, 60)
        text += f'<body name="b{k}" pos="{numbers(3, 0.05)}" euler="{turn}">'
        for kind in kinds:
            axis = "" if kind in ("free", "ball") else f'axis="{numbers(3, 1.0)}"'
            where = "" if kind == "free" else f'pos="{numbers(3, 0.02)}"'
            text += f'<joint type="{kind}" {axis} {where}/>'
        text += f'<geom name="g{k}" {GEOMS[k]} {place}/>'
        text += "</body>" if k == 2 else ""
    return text + '<site name="o"/>' + "</body>" * (len(joints) - 1)


def force_and_moment(law, mesh, model, data, geom, effects, rounding):
    """On a mesh, about the geom's origin, by NumPy in the frame of the slope."""
    motion = np.zeros(6)
    mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_GEOM, geom, motion, 0)
    turn = Rotation.from_euler("y", effects[-1].angle).as_matrix()
    rotation = turn @ data.geom_xmat[geom].reshape(3, 3)
    place = turn @ data.geom_xpos[geom]
    spin, velocity = motion.reshape(2, 3) @ turn.T @ rotation
    law = law if isinstance(law, Spatial) else Extruded(law)
    ground = ground_of(
        effects, Ground(rounding=rounding, grazing_sine=law.grazing_sine)
    )
    rows = velocity, spin, place[0], rotation[2], rotation[0], place[2]
    block = Blocks([faces(mesh.vertices[mesh.faces], mesh.middle_normals)])
    out = block.loads_by_numpy(law, ground, Motion(*(x[None, None] for x in rows)))
    return out[0, 0].reshape(2, 3) @ rotation.T @ turn


@pytest.mark.parametrize("law", [SPATIAL, MAP])
@pytest.mark.parametrize("name", CHAINS)
def test_forces_are_those_of_the_meshes_and_do_their_virtual_work(name, law, solved_by):
    """Of random motions: each geom as its mesh alone, joints as by mj_applyFT."""
    rng = np.random.default_rng(len(name))
    more = "" if name == "free root" else MORE
    model = model_of(chain(CHAINS[name], rng), AT_ONCE, more)
    data = mujoco.MjData(model)
    hole = DisturbedGround((0.05, -0.3), 0.2, 0.4)
    effects = (GrainInertia(0.5, 300.0), hole, DisturbedGround((0.2,), 0.15, 0.3))
    options = {"element": 0.02, "slope": 0.2, "effects": effects}
    with rft.mujoco.attach(model, law, **options) as sand:
        geoms = [model.geom(geom).id for geom in sand.geoms]
        for _ in range(3):
            data.qpos[:] = model.qpos0 + 0.3 * rng.normal(size=model.nq)
            data.qpos[2] = -0.05  # a free root in the ground
            data.qvel[:] = rng.normal(size=model.nv)
            mujoco.mj_normalizeQuat(model, data.qpos)
            mujoco.mj_forward(model, data)
            expected = []
            work = np.zeros(model.nv)
            for geom, mesh in zip(geoms, meshes(model, geoms, 0.02)):
                force, moment = force_and_moment(
                    law, mesh, model, data, geom, (*effects, Slope(0.2)), sand.rounding
                )
                body = model.geom_bodyid[geom]
                arm = data.geom_xpos[geom] - data.xpos[body]
                expected.append([*force, *(moment + np.cross(arm, force))])
                place = data.geom_xpos[geom]
                mujoco.mj_applyFT(model, data, force, moment, place, body, work)
            assert np.abs(expected).max() > 0.01
            assert_close(sand.forces(data), np.array(expected)[:, :3], 3e-12)
            wrench = sand.wrench(data, model.geom_bodyid[geoms[-1]])
            assert_close(wrench, expected[-1], 1e-11)
            assert_close(data.qfrc_passive, work, 3e-12)
            power = float(work @ data.qvel)
            assert sand.power(data) == pytest.approx(power, rel=1e-11) and power < 0


@pytest.mark.parametrize("geom", GEOMS)
def test_a_geom_that_hardly_dips_in_bears(geom):
    """With its lowest corner 0.5 mm deep, whatever its pose."""
    model = model_of(free(f'<geom {geom} pos="0.02 0.01 -0.03"/>'))
    data = mujoco.MjData(model)
    data.qvel[2] = -1.0
    mesh = mesh_of_elements(model, 0, 0.01)
    for pose in Rotation.random(6, random_state=1):
        data.qpos[:] = [0.0, 0.0, 0.0, *quaternion(pose)]
        mujoco.mj_forward(model, data)
        heights = mesh.vertices @ data.geom_xmat[0].reshape(3, 3)[2]
        data.qpos[2] = -data.geom_xpos[0, 2] - heights.min() - 5e-4
        force = forces_of(SPATIAL, model, data, element=0.01)[0]
        np.testing.assert_allclose(data.qfrc_passive[:3], force, atol=1e-12)
        assert force[2] > 1e-5


def test_a_body_at_rest_creeps_as_its_sinkage_says():
    model = model_of(BALL, '<option timestep="2e-4"/>')
    data = mujoco.MjData(model)
    data.qpos[2] = 0.028
    with rft.mujoco.attach(model, SPATIAL, element=0.01, rounding=5e-3) as sand:
        mujoco.mj_forward(model, data)
        plastic, later = sand.sinkage(data, 0.5)
        data.qpos[2] -= plastic
        mujoco.mj_step(model, data, 2500)
        sunk = 0.028 - data.qpos[2]
        assert 1e-4 < plastic < later
        assert sunk == pytest.approx(later, abs=0.05 * (later - plastic))
        model.opt.gravity[2] *= 1e6
        assert sand.sinkage(data, 0.5) == (math.inf, math.inf)


# Ground: slopes, hills and regions


def hilly(heights, pose="", geoms=f"<geom {GEOMS[1]}/>"):
    """A body over a height field 2.5 m along x and 1 m along y, of up to 1 m."""
    rows = " ".join(f"{x:.12f}" for x in np.ravel(heights))
    size = f'nrow="{len(heights)}" ncol="{len(heights[0])}" size="1.25 0.5 1 0.1"'
    asset = f'<asset><hfield name="hills" {size} elevation="{rows}"/></asset>'
    field = f'<geom name="hills" type="hfield" hfield="hills" {pose}/>'
    return model_of(field + free(geoms), AT_ONCE, asset)


RISE = np.linspace(0.0, 1.0, 5) * np.ones((4, 1))  # by 1 m in 2.5 m
# By 0.8 m in 2.5 m along x and 0.2 m in 1 m along y; rows of MJCF run down along y.
OBLIQUE = np.linspace(0.0, 0.8, 5) + np.linspace(0.2, 0.0, 4)[:, None]


def test_a_height_field_is_the_surface(solved_by):
    """A plane turned about the vertical is a slope; beyond it the ground is level."""
    place = 'pos="0 0 -0.5" euler="0 0 30"'
    flat = model_of(free(f"<geom {GEOMS[1]}/>"), AT_ONCE)
    roll = Rotation.from_euler("x", 0.4)
    yaw = Rotation.from_euler("z", 30, degrees=True)
    uphill = Rotation.from_euler("z", math.radians(30) + math.atan2(0.2, 0.32))
    straight = Rotation.identity()

    def force(model, turn, place, **options):
        data = mujoco.MjData(model)
        data.qpos[:] = [*turn.apply(place), *quaternion(turn * roll)]
        spin = roll.inv().apply([1.0, -2.0, 0.5])
        data.qvel[:] = [*turn.apply([0.5, 0.05, -0.4]), *spin]  # into it and uphill
        options |= {"element": 0.01, "rounding": 0.01}
        (found,) = forces_of(SPATIAL, model, data, **options)
        assert data.ncon == 0
        return turn.inv().apply(found)

    angle = math.atan(math.hypot(0.32, 0.2))
    expected = force(flat, straight, [0.2, 0.1, 0.11], slope=angle) / math.cos(angle)
    assert np.linalg.norm(expected) > 1.0
    found = force(hilly(OBLIQUE, place), uphill, [0.2, 0.1, 0.11], level="hills")
    assert_close(found, expected, 2e-3)
    expected = force(flat, yaw, [1.5, 0.0, 0.49], level=0.5)
    found = force(hilly(RISE, place), yaw, [1.5, 0.0, 0.49], level="hills")
    assert_close(found, expected, 1e-12)


REGIONS = "2 * x - y / 2 > 0.3 and y >= -0.5", "-1 < x < 0.02", "-x >= 0.01 - 0.5 * y"


def six_geoms():
    """A model of all geoms and data of random motions."""
    geoms = "".join(free(f"<geom {geom}/>", 'pos="0 0 -0.02"') for geom in GEOMS)
    model = model_of(geoms, AT_ONCE)
    data = mujoco.MjData(model)
    data.qpos.reshape(-1, 7)[:, 3:] = Rotation.random(6, random_state=6).as_quat()
    data.qvel[:] = np.random.default_rng(5).normal(size=model.nv)
    return model, data


@pytest.mark.parametrize(
    ("first", "second"), [(MAP, OTHER), (SPATIAL, Spatial(1e5, surface_friction=0.3))]
)
def test_each_region_bears_as_its_medium_alone(first, second, solved_by):
    """Of geoms across boundaries the regions share all faces."""
    model, data = six_geoms()
    places = data.qpos.reshape(-1, 7)[:, :2]

    def forces(medium, *others):
        regions = dict(zip(REGIONS, others))
        options = {"element": 0.02, "rounding": 0.01, "regions": regions}
        return forces_of(medium, model, data, **options)

    places[:] = [[1, 0.3], [1, -1.2], [-0.4, 0], [-0.4, -1], [0.1, 0.1], [0.09, 0.4]]
    inside = np.array([1, 0, 0, 0, 0, 1])[:, None]
    expected = np.choose(inside, [forces(first), forces(second)])
    assert_close(forces(first, second, first, second), expected, 1e-12)
    places[:] = np.random.default_rng(9).uniform([0.08, -0.07], [0.13, -0.02], (6, 2))
    crossed = forces(first, second, first, second)
    crossed += forces(second, first, second, first)
    assert_close(crossed, forces(first) + forces(second), 1e-12)


# Elements


def errors_of_elements(mesh, finer):
    """Errors of the force, over the force, of 200 random poses and motions that bear a
    tenth of the most."""
    law = law_of("poppy-seeds-loose")
    reach = np.linalg.norm(np.ptp(mesh.vertices, axis=0)) / 2
    rng = np.random.default_rng(1)
    turn = Rotation.random(200, random_state=1).as_matrix()
    velocity = rng.normal(size=(200, 3)) - [0.0, 0.0, 1.0]
    spin = rng.normal(size=(200, 3)) * 0.5 / reach
    height = reach * rng.uniform(-1.5, 0.5, (1, 200))
    own = [np.einsum("cij,ci->cj", turn, x)[None] for x in (velocity, spin)]
    motion = Motion(*own, 0 * height, turn[None, :, 2], turn[None, :, 0], height)
    ground = Ground(rounding=1e-5, grazing_sine=law.grazing_sine)
    found, true = (
        Blocks([faces(x.vertices[x.faces], x.middle_normals)]).loads(
            law, ground, motion
        )[0, :, :3]
        for x in (mesh, finer)
    )
    size = np.linalg.norm(true, axis=1)
    kept = size > 0.1 * size.max()
    return np.linalg.norm(found - true, axis=1)[kept] / size[kept]


def slender(kind, ratio):
    """A geom whose longest side is ``ratio`` times its shortest."""
    if kind == "mesh":
        points = Rotation.random(60, random_state=3).as_matrix()[:, 0]
        points = 0.03 * points * [1.0, ratio**-0.5, 1 / ratio]
        return meshed(f'vertex="{" ".join(f"{x:.6g}" for x in points.ravel())}"')
    sizes = {
        "capsule": (0.01, 0.01 * max(ratio - 1.0, 0.1)),
        "cylinder": (0.01, 0.01 * ratio),
        "disc": (0.01, 0.01 / ratio),
    }
    size = sizes.get(kind, (0.03, 0.03 * ratio**-0.5, 0.03 / ratio))
    kind = kind.replace("disc", "cylinder")
    return model_of(free(f'<geom type="{kind}" size="{" ".join(map(str, size))}"/>'))


def meshed(points, body="<freejoint/>"):
    """A model of one mesh geom, of a body 'leg'."""
    asset = f'<asset><mesh name="m" {points}/></asset>'
    geom = f'<body name="leg">{body}<geom type="mesh" mesh="m" mass="1"/></body>'
    return model_of(geom, AT_ONCE, asset)


RATIOS = [1.0, 2.0, 4.0, 20.0]
N_ELEMENTS = {  # of geoms of these ratios
    "box": [432, 416, 348, 224],
    "ellipsoid": [320, 320, 320, 320],
    "capsule": [384, 360, 256, 512],
    "cylinder": [336, 336, 160, 416],
    "disc": [336, 336, 224, 224],
}


@pytest.mark.parametrize("kind", N_ELEMENTS)
def test_a_geom_has_as_few_elements_as_its_error_allows(kind):
    """Their number is what a step costs; the next test measures the error."""
    models = [slender(kind, ratio) for ratio in RATIOS]
    counts = [len(mesh_of_elements(model, 0).faces) for model in models]
    assert counts == N_ELEMENTS[kind]


@needs_numba
@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize(
    "kind", ["box", "ellipsoid", "capsule", "cylinder", "disc", "mesh"]
)
def test_elements_follow_the_shape_of_each_geom(kind, ratio):
    model = slender(kind, ratio)
    mesh = mesh_of_elements(model, 0)
    finest = np.linalg.norm(np.ptp(mesh.vertices, axis=0)) / 24
    if kind != "mesh":
        finest /= 2.5
    if kind in ("capsule", "cylinder"):
        finest = min(finest, 0.01 / 4)
    errors = errors_of_elements(mesh, mesh_of_elements(model, 0, finest))
    assert np.quantile(errors, 0.9) < 0.03 and errors.max() < 0.06


OPEN = 'inertia="shell" vertex="0 0 0 .06 0 0 0 .04 0 0 0 .1" face="{}"'


def test_an_open_mesh_may_stand_for_its_convex_hull():
    """As MuJoCo's contacts take it."""
    forces = []
    for triangles, hulls in (("", True), (" 1 2 3", False)):
        model = meshed(OPEN.format("0 2 1 0 1 3 0 3 2" + triangles))
        data = mujoco.MjData(model)
        data.qvel[:] = [0.1, 0.2, -0.3, 1, 2, 3]
        forces.append(forces_of(MAP, model, data, hulls=hulls, level=0.08))
    np.testing.assert_allclose(*forces, rtol=1e-6)  # corners of single precision


# Prints


PLATE = """<body pos="0 {y} 0.04"><joint type="slide" axis="1 0 0"/>
<joint type="slide" axis="0 0 1"/><geom {geom} mass="1e6"/></body>"""
BLADE = 'type="box" size="0.005 0.046 0.06"'
REMEMBERS = '<size nuserdata="30000"/><option gravity="0 0 0" timestep="{}"/>'


def moved(sand, model, data, velocity, seconds):
    """Forces on the last geom at each step of a motion along x and z."""
    forces = []
    for _ in range(round(seconds / model.opt.timestep)):
        data.qvel[-2:] = velocity
        mujoco.mj_step(model, data)
        forces.append(sand.forces(data)[-1])
    passive = data.qfrc_passive[-2:]
    np.testing.assert_allclose(passive, forces[-1][[0, 2]], rtol=1e-12, atol=1e-12)
    return np.array(forces)


@needs_numba
@pytest.mark.parametrize(("repose", "step"), [(0.4, 2e-3), (0.66, 1e-4)])
def test_a_cone_slides_to_the_angle_of_repose_and_rests(repose, step):
    """Within 2 degrees in all directions, without losing a grain."""
    model = model_of(PLATE.format(y=9, geom=BLADE), REMEMBERS.format(step))
    data = mujoco.MjData(model)
    prints = rft.mujoco.Footprints(0.01, 0.7, 0.6, 1, 2, repose)
    with rft.mujoco.attach(model, MAP, footprints=prints) as sand:
        mujoco.mj_forward(model, data)  # from now on the memory is of this grid
        x, y, _ = sand.ground(data)
        away = np.hypot(*np.meshgrid(x - 1, y - 2))
        memory = sand._bed.prints.memory(data.userdata)
        memory.ground[:] = np.maximum(0.0, 0.15 - 2.5 * away)
        memory.head[3:7] = [0, 60, 0, 70]
        before = memory.ground.sum()
        mujoco.mj_step(model, data, round(2.0 / step))
        heights = sand.ground(data)[2]
    assert heights.sum() == pytest.approx(before, rel=1e-13)
    flank = (away > 0.03) & (heights > 0.015)
    by_y, by_x = np.gradient(heights, 0.01)
    angles = np.degrees(np.arctan(np.hypot(by_x, by_y)))
    sectors = np.round(np.arctan2(by_y, by_x) * 4 / np.pi) % 8
    means = [angles[flank & (sectors == k)].mean() for k in range(8)]
    np.testing.assert_allclose(means, np.degrees(repose), atol=2.0)


HILLS = """<asset><hfield name="hills" nrow="4" ncol="5" size="1 {} {} 0.1"
elevation="{}"/></asset>"""


def on_hills(world, step, place, width=0.5):
    """A model with a height field in it, which rises by 20 or, as wide, 40 %."""
    field = '<geom name="hills" type="hfield" hfield="hills" contype="0" '
    field += f'conaffinity="0" {place}/>'
    hills = HILLS.format(width, 0.4 * width, " ".join(map(str, RISE.ravel())))
    return model_of(field + world, REMEMBERS.format(step), hills)


@needs_numba
@pytest.mark.parametrize(
    "options", [{}, {"slope": math.atan(0.1)}, {"level": "hills"}], ids=str
)
def test_a_foot_meets_less_sand_in_its_print(options):
    """Which is where it was, as deep as it was."""
    shape = 'type="cylinder" size="0.03 0.03" pos="0.12 0 -0.04"'
    ball = f'<body pos="0 0.2 0"><joint type="slide"/><geom {GEOMS[3]}/></body>'
    model = on_hills(ball + PLATE.format(y=-0.06, geom=shape), 0.002, 'pos="0 0 -0.1"')
    data = mujoco.MjData(model)
    slope = 0.1 if options else 0.0
    data.qpos[-1] = 0.12 * slope + 0.033
    prints = rft.mujoco.Footprints(0.01, 0.5, 0.5)
    steps = ((0, -0.1), 0.2), ((0, 0.1), 0.2), ((0, -0.1), 0.2)
    more = {"rounding": 0.01, "footprints": prints}
    with rft.mujoco.attach(model, MAP, **more, **options) as sand:
        mujoco.mj_forward(model, data)
        x, y, flat = sand.ground(data)
        np.testing.assert_allclose(flat, slope * x * np.ones((50, 1)), atol=1e-6)
        first, _, second = (moved(sand, model, data, *step)[:, 2] for step in steps)
        deep = (sand.ground(data)[2] - flat) * (y < 0.1)[:, None]
    i, j = np.nonzero(deep < 0.6 * deep.min())
    assert 28 <= len(i) <= 40
    assert (x[j].mean(), y[i].mean()) == pytest.approx((0.12, -0.06), abs=2e-3)
    assert deep.min() == pytest.approx(-0.017, abs=4e-3)
    assert first[-1] > 1.0 and second[60] < 0.5 * first[60] and second[-1] < first[-1]


@needs_numba
def test_prints_in_a_world_that_is_turned_are_turned():
    """By a quarter, of a box that tumbles."""
    box = free('<geom type="box" size="0.05 0.03 0.02" mass="1e6"/>')
    model = model_of(box, REMEMBERS.format(0.005))
    prints = rft.mujoco.Footprints(0.01, 0.4, 0.4, repose=1.5)
    grounds = []
    for quarters in range(2):
        yaw = Rotation.from_euler("z", 90 * quarters, degrees=True)
        data = mujoco.MjData(model)
        turn = yaw * Rotation.from_rotvec([0.5, -0.3, 0.4])
        data.qpos[:] = [*yaw.apply([0.03, -0.04, 0.01]), *quaternion(turn)]
        data.qvel[:] = [*yaw.apply([0.3, 0.2, -0.1]), 3.0, -2.0, 4.0]
        with rft.mujoco.attach(model, MAP, rounding=0.01, footprints=prints) as sand:
            mujoco.mj_step(model, data, 20)
            grounds.append(np.rot90(sand.ground(data)[2], quarters))
    assert np.ptp(grounds[0]) > 0.03
    np.testing.assert_allclose(grounds[1], grounds[0], rtol=0, atol=1e-13)


START = [0.5, 0.2, 0, 0, 0, 0]


@pytest.mark.parametrize("place", [(0, 0), (4, 0), (2, 1), (0, 5), (4, 5), (2, 3)])
def test_a_heap_slides_to_the_angle_of_repose_wherever_it_is(place):
    """Also at the edges, from which no ground is lost."""
    prints = footprints.Footprints(0.1, 0.6, 0.5)
    size = footprints.HEAD + footprints.PER_GEOM + footprints.PER_CELL * 30
    memory = footprints.memory_of(np.zeros(size), 1, *prints.shape)
    memory.ground[place] = 0.3
    footprints.extend_box(memory.head[footprints.BOX :], *place, 1, *prints.shape)
    for step in range(2000):
        memory.head[footprints.STAMP] = step
        footprints.slide(memory, prints.grid, np.zeros(prints.shape), prints.grid[4])
    ground = memory.ground
    assert ground.sum() == pytest.approx(0.3)
    steepest = 0.1 * math.tan(prints.repose) * (1 + 2 * footprints.STEEPER)
    for drop in (np.diff(ground, axis=0), np.diff(ground, axis=1)):
        assert np.abs(drop).max() < steepest
    for drop in (ground[1:, 1:] - ground[:-1, :-1], ground[1:, :-1] - ground[:-1, 1:]):
        assert np.abs(drop).max() < math.sqrt(2) * steepest
    assert memory.head[footprints.BOX + 1] == 0.0  # nothing slides any more


def test_a_heap_slides_to_all_sides_alike():
    """Its centre stays within a hundredth of a cell."""
    prints = footprints.Footprints(0.1, 1.1, 1.1)
    size = footprints.HEAD + footprints.PER_GEOM + footprints.PER_CELL * 121
    memory = footprints.memory_of(np.zeros(size), 1, *prints.shape)
    memory.ground[5, 5] = 0.3
    footprints.extend_box(memory.head[footprints.BOX :], 5, 5, 1, *prints.shape)
    for step in range(1000):
        memory.head[footprints.STAMP] = step
        passed = 0.02 * prints.grid[4]
        footprints.slide(memory, prints.grid, np.zeros(prints.shape), passed)
    place = np.arange(11) - 5
    centre = [place @ memory.ground.sum(1), place @ memory.ground.sum(0)]
    np.testing.assert_allclose(centre, 0.0, atol=0.01 * 0.3)


def test_a_point_of_a_geom_moves_as_its_twist_says():
    rng = np.random.default_rng(2)
    twist = rng.normal(size=6)
    arm = rng.normal(size=3)
    expected = twist[3:] + np.cross(twist[:3], arm)
    np.testing.assert_allclose(footprints.velocity_at(twist, arm), expected)
    turn = Rotation.random(random_state=3).as_matrix()
    place = rng.normal(size=3)
    found = footprints.to_world(turn, place, arm)
    np.testing.assert_allclose(found, place + turn @ arm)


def test_bodies_that_a_model_has_bear_what_their_geoms_bear():
    model = model_of(BALL)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    with rft.mujoco.attach(model, MAP) as sand:
        assert sand.wrench(data, 0).tolist() == [0.0] * 6  # of the world, no geom
        assert sand.wrench(data, 1)[2] > 0
        for body in (-1, 2, "nobody"):
            with pytest.raises(rft.Refusal, match=str(body)):
                sand.wrench(data, body)


SMALL_PRINTS = {"rounding": 0.02, "footprints": rft.mujoco.Footprints(0.01, 0.4, 0.4)}


@needs_numba
def test_data_rollouts_and_batches_go_and_remember_each_for_itself():
    model = model_of(BALL, '<size nuserdata="9000"/>')
    data = mujoco.MjData(model)
    data.qvel[:] = START
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    start = np.zeros((2, mujoco.mj_stateSize(model, kind)))
    for row in start:
        mujoco.mj_getState(model, data, row, kind)
    with rft.mujoco.attach(model, MAP, **SMALL_PRINTS) as sand:
        mujoco.mj_step(model, data, 150)
        ground = sand.ground(data)[2].copy()
        copied = copy.copy(data)
        for _ in range(2):  # the second time it is the same step
            mujoco.mj_forward(model, copied)
        assert np.ptp(ground) > 0.005
        mujoco.mj_resetData(model, copied)
        assert not sand.ground(copied)[2].any()
        rollout = importlib.import_module("mujoco.rollout").rollout
        states, _ = rollout(model, [copied], start, nstep=150)
        np.testing.assert_array_equal(states[:, -1, 1:8], [data.qpos] * 2)
        for more in ({}, {"persistent": True}) if HAS_BATCH else ():
            batch = sand.batch(3, 2, media=[MAP, OTHER, MAP], **more)
            batch.bind("qvel")[:2] = START
            batch.step(nstep=150)
            found = batch.bind("qpos")[0]
            np.testing.assert_allclose(found, data.qpos, rtol=0, atol=1e-13)
            grounds = [sand.ground(np.array(row))[2] for row in batch.bind("userdata")]
            np.testing.assert_allclose(grounds[0], ground, rtol=0, atol=1e-13)
            assert min(np.abs(x - ground).max() for x in grounds[1:]) > 1e-4


# Media of simulations


def rolled(model, steps=100, speed=0.0):
    """Positions after some steps."""
    data = mujoco.MjData(model)
    data.qvel[:3] = speed
    mujoco.mj_step(model, data, steps)
    return data.qpos.copy()


@needs_batch
@pytest.mark.parametrize("regions", [{}, {"x > 0.01": OTHER}])
def test_simulations_have_media_of_their_own(regions):
    """Each as in its medium alone; one that is changed is felt from then on."""
    model = model_of(BALL)
    media = rft.mujoco.sample("poppy-seeds-loose", 3, seed=1, spread=0.4)
    given = [media[0], (media[1], media[0]) if regions else media[1]]
    with rft.mujoco.attach(model, media[2], rounding=0.02, regions=regions) as sand:
        batch = sand.batch(2, 2, media=given)
        sand.media[0] = media[2]
        whole = (media[2], OTHER) if regions else media[2]
        assert list(sand.media) == sand.media[:] == [whole, given[1]]
        for number in (-3, 2, "first"):
            with pytest.raises(rft.Refusal, match=str(number)):
                sand.media[number] = media[0]
        batch.step(nstep=100)
        found = batch.bind("qpos").copy()
    other = dict.fromkeys(regions, media[0])
    for k, (medium, own) in enumerate(((media[2], regions), (media[1], other))):
        with rft.mujoco.attach(model, medium, rounding=0.02, regions=own):
            np.testing.assert_allclose(found[k], rolled(model), rtol=0, atol=1e-14)
    assert abs(found[0, 2] - found[1, 2]) > 1e-6


def test_media_are_drawn_within_their_uncertainty():
    drawn = rft.mujoco.sample(Spatial(3e5), 2000, seed=2, spread=0.1)
    logs = np.log([x.xi_n / 3e5 for x in drawn])
    assert logs.std() == pytest.approx(0.1, rel=0.1) and abs(logs.mean()) < 0.01
    assert drawn == rft.mujoco.sample(Spatial(3e5), 2000, seed=2, spread=0.1)
    scaled = rft.mujoco.sample(ZetaFit(0.5, 0.05, 30, *[None] * 3, 0.0, 0.0), 1000)
    assert np.std([x.zeta for x in scaled]) == pytest.approx(0.05, rel=0.1)
    angles = np.meshgrid(*[np.radians(np.arange(-75, 90, 30))] * 2)
    beta, gamma = np.reshape(angles, (2, -1))
    noise = 0.02 * np.random.default_rng(1).normal(size=(2, beta.size))
    fit = fit_stress(beta, gamma, *(MAP(beta, gamma) + noise))
    media = rft.mujoco.sample(fit, 4000, seed=3)
    values = [[getattr(x, name) for x in media] for name in COEFFICIENTS]
    assert_close(np.cov(values), fit.covariance, 0.1)


# What is in the sand, and what touches the floor


TWINS = """<body name="shank" pos="0 0 0.1"><freejoint/>
<geom {both} contype="0" conaffinity="0" group="2"/><geom name="calf" {both} group="3"/>
<geom name="foot" type="sphere" size="0.022" group="3"/></body>"""


def test_what_can_touch_nothing_is_not_in_the_sand():
    """A visual twin counts only where it is named, or where all are of its kind."""
    model = model_of(TWINS.format(both='type="capsule" size="0.02 0.1"'))
    for geoms, expected in (
        ("shank", ("calf", "foot")),
        (2, ("geom 0",)),
        (["geom 0", "foot"], ("geom 0", "foot")),
        ("c*", ("calf",)),
        ("*", ("calf", "foot")),
    ):
        with rft.mujoco.attach(model, MAP, geoms=geoms) as sand:
            assert sand.geoms == expected


FLOORED = """<geom name="floor" type="plane" size="1 1 1" {}/>
<geom name="rock" type="box" size=".1 .1 .1" pos="3 0 .1"/>
<body name="a" pos="0 0 0.01"><freejoint/>
<geom name="foot" type="box" size="0.05 0.04 0.02"/></body>
<body name="b" pos="3 0 0.215"><freejoint/>
<geom name="stone" type="sphere" size="0.02"/></body>
<body name="c" pos="1 0 0.015"><freejoint/>
<geom name="ball" type="sphere" size="0.02"/></body>"""
MASKED = FLOORED.format('contype="4" conaffinity="7"')


def touching(model):
    """Names of the geoms that touch, in pairs; of a flex none."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    pairs = data.contact.geom[: data.ncon]
    return {tuple(sorted(model.geom(g).name for g in pair if g >= 0)) for pair in pairs}


@pytest.mark.parametrize(
    ("options", "touched"),
    [
        ({"geoms": "foot"}, {"ball"}),
        ({"geoms": ["foot", "s*"], "level": 0.005}, {"foot", "ball"}),  # a thin bed
        ({"geoms": "foot", "slope": 0.01}, {"foot", "ball"}),
        ({"geoms": "[br]*"}, {"foot"}),  # of a pattern, what moves
        ({}, set()),
    ],
)
def test_geoms_in_the_sand_touch_no_floor_and_everything_else(options, touched):
    """Until it is detached."""
    model = model_of(MASKED)
    before = touching(model)
    assert before == {("floor", "foot"), ("rock", "stone"), ("ball", "floor")}
    with rft.mujoco.attach(model, MAP, **options):
        left = {tuple(sorted(("floor", name))) for name in touched}
        assert touching(model) == {("rock", "stone")} | left
    assert touching(model) == before


@pytest.mark.parametrize(
    ("depth", "bodies", "told"),
    [(-0.03, 1, 0), (0.0, 1, 0), (0.03, 1, 0), (0.07, 1, 1), (0.5, 1, 1), (0.5, 2, 0)],
)
def test_geoms_of_one_body_that_overlap_are_told(depth, bodies, told):
    """From a twentieth of the smaller one's radius on."""
    other = f'<geom type="sphere" size="0.02" pos="{0.06 - 0.02 * depth} 0 0"/>'
    if bodies == 2:
        other = f"<body>{other}</body>"
    model = model_of(free(f'<geom type="sphere" size="0.04"/>{other}'))
    assert bool(overlap_note(model, range(model.ngeom))) == told


def test_sands_of_one_model_come_and_go_in_any_order():
    model = model_of(MASKED)
    before = touching(model)
    first = rft.mujoco.attach(model, MAP, geoms="foot")
    second = rft.mujoco.attach(model, MAP, geoms="ball")
    assert touching(model) == {("rock", "stone")}
    first.detach()
    assert touching(model) == {("rock", "stone"), ("floor", "foot")}
    for _ in range(2):
        second.detach()
    assert touching(model) == before


FLOORS = """<geom name="second" type="plane" size="1 1 1" pos="0 0 9e-4"
euler=".05 0 0"/>
<geom name="below" type="plane" size="1 1 1" pos="0 0 -2e-3"/>
<geom name="tilted" type="plane" size="1 1 1" euler=".06 0 0"/>"""


def test_floors_at_the_surface_are_no_longer_touched_and_others_are():
    model = model_of(FLOORED.format("") + FLOORS)
    before = touching(model)
    with rft.mujoco.attach(model, MAP, geoms="foot"):
        gone = {("floor", "foot"), ("foot", "second")}
        assert touching(model) == before - gone


# Lives of sands


def test_several_models_and_threads_go_as_each_alone():
    """To the last digit."""
    models = [model_of(BALL.replace("0.03", size)) for size in ("0.03", "0.04")]
    alone = []
    for model, law in zip(models, (SPATIAL, MAP)):
        with rft.mujoco.attach(model, law, rounding=0.02):
            alone.append(rolled(model, 300, 0.3))
    with contextlib.ExitStack() as stack:
        for model, law in zip(models, (SPATIAL, MAP)):
            stack.enter_context(rft.mujoco.attach(model, law, rounding=0.02))
        with ThreadPoolExecutor(4) as pool:
            ends = [*pool.map(rolled, models * 2, [300] * 4, [0.3] * 4)]
    np.testing.assert_array_equal(ends, alone * 2)


def test_a_callback_does_not_outlive_its_model():
    model = model_of(BALL)
    sand = rft.mujoco.attach(model, MAP)
    assert sand.is_attached
    del model
    gc.collect()
    assert mujoco.get_mjcb_passive() is None and not sand.is_attached


# Refusals


DRAGS = PlateDrags(*np.random.default_rng(1).uniform(-1.5, 1.5, (4, 200)))
PRINTS = {"footprints": SMALL_PRINTS["footprints"]}
FIXED = """<geom name="slab" type="plane" size="1 1 1"/>
<geom name="post" type="box" size="1 1 1" pos="9 9 9"/>"""
REFUSED = [
    ({"geoms": "bal"}, "'bal' 'ball' | instead"),
    ({"geoms": ["ball", "leg*"]}, "'leg*' | instead"),
    ({"geoms": 5}, "group 5 [0] | instead"),
    ({"geoms": "slab"}, "'slab' plane sphere | instead"),
    ({"geoms": "post"}, "'post' world move | instead"),
    ({"geoms": 1.5}, "geoms names patterns 1.5 | value"),
    ({"geoms": [1.5]}, "geoms names patterns 1.5 | value"),
    ({"geoms": []}, "geoms [] | value"),
    ({"medium": "poppy-seeds-lose"}, "'poppy-seeds-lose' poppy-seeds-loose | instead"),
    ({"medium": "glass-0.3mm-loose"}, "glass-0.3mm-loose generic | instead"),
    ({"medium": rft.Granular(1.8, 0.2)}, "three dimensions StressMap | value instead"),
    ({"medium": DRAGS}, "StressMap nine PlateDrags"),
    ({"level": math.nan}, "level -1e+06 1e+06 m nan | value"),
    ({"level": "ball"}, "'ball' sphere | instead"),
    ({"level": "nothing"}, "'nothing' | instead"),
    ({"slope": 1.2}, "68.8 degrees 37.9 | because"),
    ({"rounding": 0.0}, "rounding 1e-07 10 m/s 0.0 | value"),
    ({"hulls": "no"}, "hulls True False 'no' | value"),
    ({"regions": ["x > 1"]}, "regions 'x > 1' | value instead"),
    ({"regions": {"x > z": MAP}}, "'x > z' 'x > 0.5' | instead"),
    (
        {"regions": {"x > 1 or y > 1": MAP}},
        "'x > 1 or y > 1' 'x > 0.5' | instead",
    ),
    ({"regions": {"x / 0 > 1": MAP}}, "'x / 0 > 1' 'x > 0.5' | instead"),
    ({"regions": {"x > " + 3000 * "-" + "1": MAP}}, "'x 'x > 0.5' | instead"),
    ({"regions": {" < ".join("1x" * 51): MAP}}, "101 100"),
    ({"regions": {"x > 1": SPATIAL}}, "regions | instead"),
    (
        {"regions": {"x > 1": "poppy-seeds-lose"}},
        "poppy-seeds-loose | instead",
    ),
    ({"footprints": 0.01}, "footprints rft.mujoco.Footprints 0.01 | value"),
    ({"element": 0.9e-6}, "element 1e-06 1000 m 9e-07 | value"),
    ({"element": 1001.0}, "element 1e-06 1000 m 1001.0 | value"),
    (PRINTS, '8015 0 <size nuserdata="8015"/> | instead'),
]


@pytest.mark.parametrize(("arguments", "said"), REFUSED)
def test_what_makes_no_sense_is_refused_in_one_line_and_changes_nothing(
    arguments, said
):
    if "footprints" in arguments and not backend.installed():
        pytest.skip("footprints need numba")
    model = model_of(BALL + FIXED)
    masks = model.geom_contype.copy()
    with refuses(said):
        rft.mujoco.attach(model, **({"medium": MAP} | arguments))
    np.testing.assert_array_equal(model.geom_contype, masks)


BLOCK = free('<geom type="box" size="0.1 0.1 0.1"/>')
PAIRED = '<contact><pair geom1="floor" geom2="foot"/></contact>'
UNFIT = [
    (lambda: model_of(FIXED), {}, "move joints | because"),
    (
        lambda: model_of(FLOORED.format(""), more=PAIRED),
        {},
        "<pair> 'floor' 'foot' | instead",
    ),
    (
        lambda: model_of(FLOORED.format('contype="2147483647"')),
        {},
        "bit contypes | instead",
    ),
    (
        lambda: model_of(BLOCK),
        {"element": 1e-3},
        "geom 0, group 0: 480000 element | where instead",
    ),
    (
        lambda: meshed(OPEN.format("0 2 1 0 1 3 0 3 2")),
        {},
        "geom 0, 'leg' group 0: open hulls True | where because instead",
    ),
    (lambda: hilly(RISE, 'euler="10 0 0"'), {"level": "hills"}, "'hills'"),
    (lambda: hilly(RISE), {"level": "hills", "slope": 0.1}, "slopes slope | instead"),
]


@pytest.mark.parametrize(("model", "options", "said"), UNFIT)
def test_models_that_sand_cannot_be_under_are_refused(model, options, said):
    with refuses(said):
        rft.mujoco.attach(model(), MAP, **options)


CHANGED = [
    (lambda sand, model: pickle.dumps(sand), "Sand pickled process | because instead"),
    (lambda sand, model: rft.mujoco.attach(model, MAP), "attached 'ball' | instead"),
    (lambda sand, model: sand.forces(mujoco.MjData(model_of(MASKED))), "data model"),
    (
        lambda sand, model: sand.ground(mujoco.MjData(model)),
        "memory footprints | instead",
    ),
    (
        lambda sand, model: sand.sinkage(mujoco.MjData(model), -1),
        "time 0 1e+06 s -1 | value",
    ),
    (
        lambda sand, model: sand.error(mujoco.MjData(model), -1),
        "seconds 0 1e+06 s -1 | value",
    ),
]


@pytest.mark.parametrize(("ask", "said"), CHANGED)
def test_what_a_sand_cannot_tell_is_refused(ask, said):
    model = model_of(BALL)
    with rft.mujoco.attach(model, MAP) as sand, refuses(said):
        ask(sand, model)


def test_what_changes_after_attach_is_refused():
    model = model_of(BALL)
    data = mujoco.MjData(model)
    sand = rft.mujoco.attach(model, MAP)
    model.geom_size[0, 0] = 0.05
    with refuses("'ball' attach | instead"):
        sand.power(data)
    sand.detach()
    with refuses("detached attach | instead"):
        sand.forces(data)
    mujoco.set_mjcb_passive(lambda *_: None)
    with refuses("callback mujoco.set_mjcb_passive(None) | because instead"):
        rft.mujoco.attach(model, MAP)
    mujoco.set_mjcb_passive(None)


@pytest.mark.parametrize(
    ("missing", "module", "name", "message"),
    [
        ("mujoco", "rft.mujoco", "sand", r"MuJoCo: pip install 'geomech\[mujoco\]'"),
        (
            "gymnasium",
            "geomech.gym",
            "hexapod",
            r"MuJoCo: pip install 'geomech\[gym\]'",
        ),
    ],
)
def test_what_is_not_installed_is_named(missing, module, name, message, monkeypatch):
    package = importlib.import_module(module)
    for loaded in [x for x in sys.modules if x.startswith(f"{module}.")]:
        monkeypatch.delitem(sys.modules, loaded)
    monkeypatch.delattr(package, name, raising=False)
    monkeypatch.setitem(sys.modules, missing, None)
    with pytest.raises(rft.Refusal, match=message):
        getattr(package, package.__all__[0])
