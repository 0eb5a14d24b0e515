"""Sand under MuJoCo models: forces, virtual work, symmetries, steps, threads, lifetimes and refusals."""

import gc
import importlib
import math
import sys
import threading
import warnings

import numpy as np
import pytest
from artists import drawn
from scipy.interpolate import RegularGridInterpolator
from scipy.spatial.transform import Rotation

import rft
from rft.balance.backend import Note, preferring
from rft.ground import GrainInertia, Ground, Slope
from rft.meshes import Spatial, wrench
from rft.meshes.blocks import Blocks
from rft.meshes.contact import Motion, faces
from rft.meshes.extruded import Extruded
from rft.plates import VERTICAL, PlateDrags, RoundRod, StressMap, loads
from rft.plates.calibrate import ZetaFit, fit_stress
from rft.plates.stress import COEFFICIENTS

mujoco = pytest.importorskip("mujoco", reason="needs the extra: pip install 'geomech[mujoco]'")
from rft.mujoco import installed  # noqa: E402
from rft.mujoco.geoms import mesh_of_elements  # noqa: E402
from rft.mujoco.hills import hills_of, tangent_plane  # noqa: E402
from rft.mujoco.media import law_of  # noqa: E402
from rft.mujoco.sand import meshes  # noqa: E402
from rft.mujoco.steps import needed_rounding  # noqa: E402

SPATIAL = Spatial(3e5, surface_friction=0.6, grazing=math.radians(5))
MAP = StressMap(zeta=0.3, grazing=math.radians(5))
GEOMS = (
    'type="box" size="0.05 0.03 0.02"',
    'type="capsule" size="0.02 0.04"',
    'type="cylinder" size="0.03 0.04"',
    'type="sphere" size="0.04"',
    'type="ellipsoid" size="0.05 0.03 0.02"',
    'type="mesh" mesh="wedge"',
)
ASSET = '<asset><mesh name="wedge" vertex="0 0 0 .06 0 0 0 .04 0 0 0 .1"/></asset>'


pytestmark = pytest.mark.usefixtures("fastest")


@pytest.fixture(autouse=True)
def no_callback_remains():
    """Every test leaves MuJoCo without a callback, and notes are no errors but where a test looks for them."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Note)
        yield
        gc.collect()
        assert mujoco.get_mjcb_passive() is None and not installed._entries


def model_of(body, options="", more=""):
    return mujoco.MjModel.from_xml_string(f"<mujoco>{options}{ASSET}<worldbody>{body}</worldbody>{more}</mujoco>")


def own_notes(sand):
    """Notes but for the one about numba."""
    return [line for line in sand.notes if "Python" not in line]


def chain(rng, joints, links=5):
    """A branching chain of links with random places, joints and geoms, hinges and slides two on a body at times."""
    numbers = lambda n, size: " ".join(f"{x:.4f}" for x in size * rng.normal(size=n))
    joint = lambda k: f'<joint type="{k}" axis="{numbers(3, 1.0)}" pos="{numbers(3, 0.02)}"/>' if k else ""
    text = ""
    for k in range(links):
        kind = joints[k % len(joints)]
        own = (
            "".join(map(joint, kind)) if isinstance(kind, tuple) else "<freejoint/>" if kind == "free" else joint(kind)
        )
        geom = '<site name="o"/>' if k == 4 else ""
        geom += f'<geom name="g{k}" {GEOMS[k % len(GEOMS)]} pos="{numbers(3, 0.02)}" euler="{numbers(3, 60)}"/>'
        text += f'<body name="b{k}" pos="{numbers(3, 0.05)}" euler="{numbers(3, 60)}">{own}{geom}'
        text += "</body>" if k == 2 else ""
    return text + "</body>" * (links - 1)


CHAINS = {
    "free root": ("free", "ball", "", ("hinge", "slide"), "hinge"),
    "fixed root": ("hinge", "", ("slide", "slide", "hinge"), "ball", ""),
    "welded to the world": ("", "ball", "slide", "hinge", "hinge"),
}


MORE = """<worldbody><camera/><light/><body name="m" mocap="true" pos="0 0 9"><site name="s"/></body></worldbody>
<tendon><spatial name="t"><site site="s"/><site site="o"/></spatial></tendon><actuator><motor tendon="t"/></actuator>
<sensor><tendonpos tendon="t"/></sensor><equality><weld body1="b0" body2="m" active="false"/></equality>"""


@pytest.mark.parametrize("law", [SPATIAL, MAP])
@pytest.mark.parametrize("name", CHAINS)
def test_forces_are_those_of_the_meshes_and_do_their_virtual_work(name, law, solved_by):
    """Of random motions of chains: each geom against the force on its mesh alone, qfrc_passive against mj_applyFT."""
    rng = np.random.default_rng(len(name))
    more = "" if name == "free root" else MORE  # empty arrays of MuJoCo's, or none
    model = model_of(chain(rng, CHAINS[name]), '<option gravity="0 0 0"/>', more)
    data, plain = mujoco.MjData(model), mujoco.MjData(model)
    effects = (GrainInertia(0.5, 300.0),)
    with rft.mujoco.attach(model, law, element=0.02, slope=0.2, effects=effects) as sand:
        cut = meshes(model, sand._bed.geoms, 0.02)
        for _ in range(3):
            data.qpos[:] += 0.3 * rng.normal(size=model.nq)
            data.qvel[:] = rng.normal(size=model.nv)
            mujoco.mj_normalizeQuat(model, data.qpos)
            mujoco.mj_forward(model, data)
            found, expected, work = sand.forces(data), np.zeros((len(cut), 3)), np.zeros(model.nv)
            for k, (geom, body, mesh) in enumerate(zip(sand._bed.geoms, sand._bed.bodies, cut)):
                motion = np.zeros(6)
                mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_GEOM, geom, motion, 0)
                force, moment = on_mesh(law, mesh, data, geom, motion, Slope(0.2), effects, sand.rounding)
                expected[k] = force
                mujoco.mj_applyFT(model, data, force, moment, data.geom_xpos[geom], body, work)
            assert np.abs(expected).max() > 0.1
            np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max())
            np.testing.assert_allclose(data.qfrc_passive, work, rtol=0, atol=1e-12 * np.abs(work).max())
            power = float(work @ data.qvel)
            assert sand.power(data) == pytest.approx(power, abs=1e-11 * abs(power)) and power < 0
    plain.qpos[:], plain.qvel[:] = data.qpos, data.qvel
    mujoco.mj_forward(model, plain)
    assert not plain.qfrc_passive.any()


def on_mesh(law, mesh, data, geom, motion, slope, effects, rounding):
    """Force and moment about the geom's origin, from `wrench` in the frame of the slope; of a stress map by NumPy."""
    turn = Rotation.from_euler("y", slope.angle).as_matrix()  # from the world to axes along and across the slope
    rotation, place = turn @ data.geom_xmat[geom].reshape(3, 3), turn @ data.geom_xpos[geom]
    velocity, spin = turn @ motion[3:], turn @ motion[:3]
    if isinstance(law, Spatial) and rounding < 1e-9:
        one = wrench(law, mesh, rotation, place, velocity, spin, (*effects, slope))
        return turn.T @ one.force, turn.T @ one.moment
    law = law if isinstance(law, Spatial) else Extruded(law)
    ground = Ground(rounding=rounding, grazing_sine=law.grazing_sine)
    for effect in (*effects, slope):
        ground = effect.apply(ground)
    up, ahead = rotation[2], rotation[0]
    motion = Motion(*(x[None, None] for x in (velocity @ rotation, spin @ rotation, place[0], up, ahead, place[2])))
    block = Blocks([faces(mesh.vertices[mesh.faces], mesh.middle_normals)])
    out = block._loads_by_numpy(law, ground, motion)[0, 0].reshape(2, 3)
    return turn.T @ rotation @ out[0], turn.T @ rotation @ out[1]


BALL = '<body name="ball" pos="0 0 0.01"><freejoint/><geom name="ball" type="sphere" size="0.03" mass="0.2"/></body>'


def test_a_geom_bears_what_its_mesh_does(solved_by):
    """Of `rft.meshes.wrench`, which has no rounding, on the same triangles; and about the origin of the body."""
    model = model_of(BALL.replace("<geom", '<geom pos="0.01 0.02 -0.01" euler="20 30 40"'))
    data = mujoco.MjData(model)
    data.qvel[:] = [0.4, 0.3, -0.5, 3.0, -2.0, 1.0]
    with rft.mujoco.attach(model, SPATIAL, level=-0.005, rounding=1e-7, element=0.01) as sand:
        mujoco.mj_forward(model, data)
        turn, place, motion = data.geom_xmat[0].reshape(3, 3), data.geom_xpos[0] + [0, 0, 0.005], np.zeros(6)
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_GEOM, 0, motion, 0)
        one = wrench(SPATIAL, mesh_of_elements(model, 0, 0.01), turn, place, motion[3:], motion[:3])
        moment = one.moment + np.cross(data.geom_xpos[0] - data.xpos[1], one.force)
        size = np.abs(one.force).max()
        np.testing.assert_allclose(sand.wrench(data, "ball"), [*one.force, *moment], rtol=0, atol=2e-12 * size)
        np.testing.assert_allclose(sand.forces(data), [one.force], rtol=0, atol=2e-12 * size)
        assert sand.power(data) == pytest.approx(one.power, rel=1e-11)


@pytest.mark.parametrize("geom", GEOMS)
def test_a_geom_that_hardly_dips_in_bears(geom, solved_by):
    """With its lowest corner 0.5 mm deep, whatever its pose: the sphere around each geom holds all of it."""
    model = model_of(f'<body><freejoint/><geom {geom} pos="0.02 0.01 -0.03"/></body>')
    data = mujoco.MjData(model)
    mesh = mesh_of_elements(model, 0, 0.01)
    with rft.mujoco.attach(model, SPATIAL, element=0.01) as sand:
        for pose in Rotation.random(6, random_state=1):
            data.qpos[:3], data.qpos[3:], data.qvel[2] = 0.0, np.roll(pose.as_quat(), 1), -1.0
            mujoco.mj_forward(model, data)
            heights = mesh.vertices @ data.geom_xmat[0].reshape(3, 3)[2] + data.geom_xpos[0, 2]
            data.qpos[2] = -heights.min() - 5e-4
            mujoco.mj_forward(model, data)
            force = sand.forces(data)[0]
            np.testing.assert_allclose(data.qfrc_passive[:3], force, atol=1e-12)
            assert force[2] > 1e-5


def test_a_long_rod_bears_what_the_plane_says():
    """A stress map on a cylinder dragged across its axis and down, against the outline of the vertical plane."""
    model = model_of('<body pos="0 0 -0.1" euler="90 0 0"><freejoint/><geom type="cylinder" size="0.02 0.05"/></body>')
    data = mujoco.MjData(model)
    data.qvel[:3] = [0.3, 0.0, -0.2]
    sharp = StressMap(zeta=0.3, grazing=2e-3)
    with rft.mujoco.attach(model, sharp, element=0.002, rounding=1e-7) as sand:
        mujoco.mj_forward(model, data)
        flat = loads(sharp, RoundRod(0.02, 0.1).outline(64), (0, -0.1, 0), (0.3, -0.2, 0)).force
        np.testing.assert_allclose(sand.forces(data)[0, [0, 2]], flat, rtol=0.01)


def hilly(heights, pose="", geoms=f"<geom {GEOMS[1]}/>"):
    """A model of one body over a height field 2 m along x and 1 m along y, with heights of up to 1 m."""
    rows = " ".join(f"{x:.12f}" for x in np.ravel(heights))
    size = f'nrow="{len(heights)}" ncol="{len(heights[0])}" size="1 0.5 1 0.1"'
    asset = f'<asset><hfield name="hills" {size} elevation="{rows}"/></asset>'
    field = f'<geom name="hills" type="hfield" hfield="hills" {pose}/>'
    return model_of(f'{field}<body pos="0 0 0"><freejoint/>{geoms}</body>', more=asset)


def test_a_height_field_is_the_surface(solved_by):
    """A plane of one slope, turned about the vertical: the forces of `slope`, but for the weaker ground; and level beyond."""
    along = np.linspace(0.0, 1.0, 5) * np.ones((4, 1))  # rises by 1 m in 2 m
    model = hilly(along, 'pos="0 0 -0.5" euler="0 0 30"')
    flat, angle = model_of(f"<body><freejoint/><geom {GEOMS[1]}/></body>"), math.atan(0.5)
    turn, place = Rotation.from_euler("z", 30, degrees=True), np.array([0.2, 0.1, 0.11])
    spin, velocity = np.array([1.0, -2.0, 0.5]), np.array([0.5, 0.05, -0.4])  # into the ground and uphill

    def forces(model, turn, **more):
        data = mujoco.MjData(model)
        data.qpos[:3], data.qpos[3:] = turn.apply(place), np.roll((turn * Rotation.from_euler("x", 0.4)).as_quat(), 1)
        data.qvel[:3], data.qvel[3:] = turn.apply(velocity), Rotation.from_euler("x", -0.4).apply(spin)
        with rft.mujoco.attach(model, SPATIAL, element=0.01, rounding=0.01, **more) as sand:
            mujoco.mj_forward(model, data)
            assert data.ncon == 0
            np.testing.assert_allclose(data.qfrc_passive[:3], sand.forces(data)[0], atol=1e-12)
            return turn.inv().apply(sand.forces(data)[0])

    expected = forces(flat, Rotation.identity(), slope=angle) / math.cos(angle)
    assert np.linalg.norm(expected) > 1.0
    np.testing.assert_allclose(forces(model, turn, level="hills"), expected, rtol=0, atol=2e-3 * abs(expected).max())
    place[:] = [1.5, 0.0, 0.49]
    expected = forces(flat, turn, level=0.5)
    np.testing.assert_allclose(forces(model, turn, level="hills"), expected, rtol=0, atol=1e-12 * abs(expected).max())
    with pytest.raises(rft.Refusal, match="a height field has slopes of its own: drop slope"):
        rft.mujoco.attach(model, SPATIAL, level="hills", slope=0.1)
    with pytest.raises(rft.Refusal, match="the geom 'geom 1' is a capsule|has no geom"):
        rft.mujoco.attach(model, SPATIAL, level="geom 1")
    with pytest.raises(rft.Refusal, match="the height field 'hills' is tilted or moves"):
        rft.mujoco.attach(hilly(along, 'euler="10 0 0"'), SPATIAL, level="hills")


def test_a_height_field_is_where_mujoco_has_it():
    """At its nodes, by rays that MuJoCo casts down."""
    heights = np.random.default_rng(7).uniform(0, 1, (4, 6))
    model = hilly((heights - heights.min()) / np.ptp(heights), 'pos="0.3 -0.2 0.1" euler="0 0 40"')
    hills, geom = hills_of(model, "hills")
    data, turn = mujoco.MjData(model), Rotation.from_euler("z", 40, degrees=True)
    data.qpos[2] = -9.0
    mujoco.mj_forward(model, data)
    for u in np.linspace(-1, 1, 6)[1:-1]:
        for v in np.linspace(-0.5, 0.5, 4)[1:-1]:
            x, y, _ = place = turn.apply([u, v, 0.0]) + [0.3, -0.2, 5.0]
            hit = place[2] - mujoco.mj_ray(
                model, data, place, np.array([0, 0, -1.0]), None, 1, -1, np.zeros(1, np.int32)
            )
            (n_x, n_y, n_z), level = tangent_plane(*hills, x, y)
            assert geom == 0 and (level - n_x * x - n_y * y) / n_z == pytest.approx(hit, abs=1e-6)
    x, y = np.linspace(-1, 1, 6), np.linspace(-0.5, 0.5, 4)
    known = np.stack([hills[0][..., 0], *np.gradient(hills[0][..., 0], y, x)], -1)
    for v, u in np.random.default_rng(8).uniform([-0.5, -1], [0.5, 1], (20, 2)):  # between nodes, all along lines
        height, by_v, by_u = RegularGridInterpolator((y, x), known)((v, u))
        place, (by_x, by_y, _) = turn.apply([u, v, 0.0]) + [0.3, -0.2, 0.1], turn.apply([by_u, by_v, 0.0])
        n, level = tangent_plane(*hills, *place[:2])
        np.testing.assert_allclose(n, np.array([-by_x, -by_y, 1.0]) / math.hypot(by_x, by_y, 1.0), atol=1e-12)
        assert level == pytest.approx(n @ (place + [0, 0, height]), abs=1e-12)


def test_forces_converge_with_the_length_of_elements():
    """At order 2, on round and flat geoms."""
    body = "".join(f'<body pos="0 0 -0.02"><freejoint/><geom {geom}/></body>' for geom in GEOMS)
    model = model_of(body, '<option gravity="0 0 0"/>')
    data = mujoco.MjData(model)
    data.qvel[:] = np.random.default_rng(3).normal(size=model.nv)
    values = []
    for element in (0.016, 0.008, 0.004, 0.002):
        with rft.mujoco.attach(model, SPATIAL, element=element) as sand:
            mujoco.mj_forward(model, data)
            values.append(sand.forces(data))
    errors = [np.linalg.norm(x - values[-1]) / np.linalg.norm(values[-1]) for x in values[:-1]]
    assert errors[2] < 4e-3 and errors[0] / errors[2] > 8.0, errors


@pytest.mark.parametrize("geom", GEOMS)
def test_elements_are_as_long_as_asked_for(geom):
    """Edges of about that length, neither much longer nor, but for poles of round geoms, much shorter."""
    model = model_of(f"<body><freejoint/><geom {geom}/></body>")
    for element in (0.01, 0.005):
        mesh = mesh_of_elements(model, 0, element)
        corners = mesh.vertices[mesh.faces]
        edges = np.linalg.norm(corners - np.roll(corners, 1, 1), axis=-1)
        assert edges.max() < 1.75 * element and 0.45 * element < np.median(edges)


def test_forces_turn_and_mirror_with_the_motion():
    model = model_of(f'<body pos="0 0 0.01"><freejoint/><geom {GEOMS[0]}/><geom {GEOMS[1]} pos="0.03 0 0"/></body>')
    data, rng = mujoco.MjData(model), np.random.default_rng(2)
    tilt, twist = Rotation.random(random_state=4), rng.normal(size=(2, 3))

    def wrench_at(turn, velocity, spin):
        data.qpos[3:] = np.roll(turn.as_quat(), 1)
        data.qvel[:3], data.qvel[3:] = velocity, turn.inv().apply(spin)
        mujoco.mj_forward(model, data)
        return sand.wrench(data, 1).reshape(2, 3)

    with rft.mujoco.attach(model, MAP, element=0.01) as sand:
        plain, yaw = wrench_at(tilt, *twist), Rotation.from_euler("z", 0.7)
        turned = wrench_at(yaw * tilt, *yaw.apply(twist))
        np.testing.assert_allclose(turned, yaw.apply(plain), atol=1e-12 * np.abs(plain).max())
        level, mirror = Rotation.from_euler("y", 0.3), np.array([1.0, -1.0, 1.0])
        one = wrench_at(level, *twist)
        other = wrench_at(level, twist[0] * mirror, -twist[1] * mirror)
        np.testing.assert_allclose(other, one * [mirror, -mirror], atol=1e-2 * np.abs(one).max())


@pytest.mark.parametrize("integrator", ["Euler", "implicit", "implicitfast", "RK4"])
def test_a_body_falls_sinks_and_is_dragged_and_the_energy_goes_into_the_grains(integrator):
    """Change of energy = work of the grains, of the pull and of no one else, to the order of the steps."""
    model = model_of(BALL, f'<option timestep="2e-4" integrator="{integrator}"><flag energy="enable"/></option>')
    data = mujoco.MjData(model)
    data.qpos[2], data.qfrc_applied[0] = 0.06, 1.0
    with rft.mujoco.attach(model, SPATIAL, element=0.01) as sand:
        mujoco.mj_forward(model, data)
        energy, work, lost, power = data.energy.sum(), 0.0, 0.0, sand.power(data)
        for _ in range(1000):
            v, before = data.qvel[0], power
            mujoco.mj_step(model, data)
            mujoco.mj_forward(model, data)
            power = sand.power(data)
            work, lost = work + 1e-4 * (v + data.qvel[0]), lost - 1e-4 * (before + power)
        assert lost > 0.05 and data.energy.sum() - energy == pytest.approx(work - lost, abs=0.01 * lost)


def test_a_body_at_rest_creeps_as_its_sinkage_says():
    model = model_of(BALL, '<option timestep="2e-4"/>')
    data = mujoco.MjData(model)
    data.qpos[2] = 0.028
    with rft.mujoco.attach(model, SPATIAL, element=0.01, rounding=5e-3) as sand:
        mujoco.mj_forward(model, data)
        plastic, later = sand.sinkage(data, 0.5)
        data.qpos[2] -= plastic
        mujoco.mj_step(model, data, 2500)
        assert 1e-4 < plastic < later and 0.028 - data.qpos[2] == pytest.approx(later, abs=0.05 * (later - plastic))
        mujoco.mj_forward(model, data)
        assert sand.sinkage(data, 0.0)[0] == pytest.approx(plastic - 0.028 + data.qpos[2], abs=1e-9)
    with rft.mujoco.attach(model, Spatial(1.0)) as sand:
        assert sand.sinkage(data) == (math.inf, math.inf)


def test_the_time_step_and_the_masses_ask_for_a_rounding():
    """h g / 2 of a free body; the step that a rounding allows is told, and a geom that runs away is, once."""
    model = model_of(BALL, '<option timestep="0.002"/>')
    with rft.mujoco.attach(model, MAP) as sand:
        assert sand.rounding == pytest.approx(0.002 * 9.81 / 2) and own_notes(sand) == []
        assert "rounding 0.00981 m/s at a time step of 2 ms" in repr(sand)
    with pytest.warns(Note, match=r"asks for a rounding of 0\.0098 m/s, .* steps of 0\.2 ms would not"):
        rft.mujoco.attach(model, MAP, rounding=9.81e-4).detach()
    model.opt.timestep = 0.05
    with pytest.warns(Note, match=r"the rounding of 0\.25 m/s, .* creep"):
        sand = rft.mujoco.attach(model, MAP)
    data = mujoco.MjData(model)
    data.qpos[2], data.qvel[0] = 0.0, 200.0
    if installed.serves_compiled():
        with pytest.warns(Note, match="a geom in the sand is faster than 100 m/s") as caught:
            mujoco.mj_step(model, data, 3)
        assert len(caught) == 1 and installed.times_too_fast(sand._row) == 3
    model.opt.timestep = 0.1
    with pytest.warns(
        Note, match=r"100 ms asks for a rounding of 0\.49 m/s, the sand has 0\.25: .*; steps of 50 ms"
    ) as caught:
        sand.forces(data), sand.forces(data)
    assert len(caught) == 1
    sand.detach()


FLOORED = """<geom name="floor" type="plane" size="1 1 1" {}/><geom name="rock" type="box" size=".1 .1 .1" pos="3 0 .1"/>
<body name="a" pos="0 0 0.01"><freejoint/><geom name="foot" type="box" size="0.05 0.04 0.02"/></body>
<body name="b" pos="3 0 0.215"><freejoint/><geom name="stone" type="sphere" size="0.02"/></body>
<body name="c" pos="1 0 0.015"><freejoint/><geom name="ball" type="sphere" size="0.02"/></body>"""


def touching(model):
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return sorted(tuple(sorted(model.geom(g).name for g in data.contact.geom[k])) for k in range(data.ncon))


def test_geoms_in_the_sand_touch_no_floor_and_everything_else():
    model = model_of(FLOORED.format('contype="4" conaffinity="7"'))
    before = touching(model)
    assert {*before} == {("floor", "foot"), ("rock", "stone"), ("ball", "floor")}
    with pytest.warns(Note, match="the geom no longer touches the floor 'floor'"):
        sand = rft.mujoco.attach(model, MAP, geoms="foot")
    assert {*touching(model)} == {("rock", "stone"), ("ball", "floor")}
    sand.detach()
    assert touching(model) == before
    with rft.mujoco.attach(model, MAP, geoms=["foot", "s*"], level=0.005) as sand:
        assert own_notes(sand) == [] and touching(model) == before  # the floor is the bottom of a bed 5 mm deep
    first, second = (rft.mujoco.attach(model, MAP, geoms=name) for name in ("foot", "ball"))
    assert {*touching(model)} == {("rock", "stone")}
    first.detach()  # not the last one first
    assert {*touching(model)} == {("rock", "stone"), ("floor", "foot")}
    second.detach()
    assert touching(model) == before
    with rft.mujoco.attach(model, MAP, geoms="foot"):
        model.geom_contype[:] = 1  # as users may
    assert (model.geom_contype == 1).all()
    model = model_of(FLOORED.format('contype="4" conaffinity="7"'))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(Note, match="no longer touches the floor"):
            rft.mujoco.attach(model, MAP, geoms="foot")
    assert touching(model) == before and mujoco.get_mjcb_passive() is None
    model.geom_group[[model.geom(name).id for name in ("ball", "rock")]] = 2
    for fixed_and_moving, moving in ((2, "ball"), ("[rs]*", "stone")):
        with rft.mujoco.attach(model, MAP, geoms=fixed_and_moving) as sand:
            assert sand.geoms == (moving,)
    with rft.mujoco.attach(model, MAP) as sand:
        assert {*touching(model)} == {("rock", "stone")} and sand.geoms == ("foot", "stone", "ball")


CLOTH = """<flexcomp name="cloth" type="grid" count="3 3 1" spacing=".05 .05 .05" mass=".1" radius=".01" pos="2 0 .005">
<contact contype="2" conaffinity="2"/></flexcomp>"""


def test_what_is_not_in_the_sand_touches_the_floor_as_before():
    """Cloth; geoms named in a <pair>, which hold all the same; and geoms in sand whose surface is not the floor."""
    pairs = '<contact><pair geom1="floor" geom2="stone"/><pair geom1="rock" geom2="foot"/></contact>'
    model = model_of(FLOORED.format('contype="3" conaffinity="3"') + CLOTH, more=pairs)

    def cloth():
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        return int((data.contact.flex >= 0).any(1).sum())

    before = cloth()
    assert before > 0
    with rft.mujoco.attach(model, MAP, geoms="foot") as sand:
        assert own_notes(sand) and cloth() == before
    for more in ({"slope": 0.01}, {"level": 0.002}):
        with rft.mujoco.attach(model, MAP, geoms="foot", **more) as sand:
            assert own_notes(sand) == []
    second = '<geom name="{}" type="plane" size="1 1 1" pos="0 0 {}" euler="{} 0 0"/>'
    more = second.format("second", 9e-4, 0.05) + second.format("below", -2e-3, 0) + second.format("tilted", 0, 0.06)
    model = model_of(FLOORED.format("") + more)
    with pytest.warns(Note, match="the geom no longer touches the floor 'floor' and 'second', which lies"):
        sand = rft.mujoco.attach(model, MAP, geoms="foot")
    touched = touching(model)
    sand.detach()
    assert {x for x in touched if "foot" in x} == {("below", "foot"), ("foot", "tilted")}
    assert {x for x in touched if "ball" in x} == {("ball", x) for x in ("floor", "second", "below", "tilted")}
    crowded = model_of(FLOORED.format('contype="2147483647"'))
    with pytest.raises(rft.Refusal, match="no bit is free to tell the floor from other geoms: use fewer contypes"):
        rft.mujoco.attach(crowded, MAP)


def test_several_models_sands_and_threads_at_once():
    """Each as it is alone, to the last digit; a copy of a model has no sand."""
    models = [model_of(BALL.replace("0.03", size)) for size in ("0.03", "0.04")]
    both = model_of(BALL + BALL.replace("ball", "other").replace("0 0 0.01", "1 0 0.01"))

    def run(model):
        data = mujoco.MjData(model)
        data.qvel[:3] = 0.3
        mujoco.mj_step(model, data, 300)
        return data.qpos.copy()

    def attached(model, law, **more):
        with rft.mujoco.attach(model, law, rounding=0.02, **more):
            return run(model)

    alone = [attached(m, law) for m, law in zip(models, (SPATIAL, MAP))]
    sands = [rft.mujoco.attach(m, law, rounding=0.02) for m, law in zip(models, (SPATIAL, MAP))]
    sands += [rft.mujoco.attach(both, law, geoms=g, rounding=0.02) for g, law in (("ball", SPATIAL), ("other", MAP))]
    ends = [[] for _ in range(4)]
    threads = [threading.Thread(target=lambda k=k: ends[k].append(run(models[k % 2]))) for k in range(4)]
    for step in (threading.Thread.start, threading.Thread.join):
        for thread in threads:
            step(thread)
    for k in range(4):
        np.testing.assert_array_equal(ends[k][0], alone[k % 2])
    two = run(both)
    np.testing.assert_allclose(two[:7], alone[0], atol=1e-9)
    assert abs(two[9] - two[2]) > 1e-4
    assert run(__import__("copy").copy(both))[2] < -1.0
    for sand in sands:
        sand.detach()
        sand.detach()
    assert run(both)[2] < -1.0 and "detached" in repr(sands[0])


def test_rollouts_and_batches_feel_the_sand():
    model = model_of(BALL)
    data = mujoco.MjData(model)
    with rft.mujoco.attach(model, MAP, rounding=0.02) as sand:
        mujoco.mj_step(model, data, 200)
        if not installed.serves_compiled():
            return
        from mujoco import rollout

        start = np.zeros((2, mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)))
        mujoco.mj_getState(model, mujoco.MjData(model), start[0], mujoco.mjtState.mjSTATE_FULLPHYSICS)
        start[1] = start[0]
        states, _ = rollout.rollout(model, [mujoco.MjData(model) for _ in range(2)], start, nstep=200)
        np.testing.assert_array_equal(states[:, -1, 1:8], [data.qpos, data.qpos])
        if int(mujoco.__version__.partition(".")[0]) < 4:
            with pytest.raises(rft.Refusal, match=r"has no Batch: pip install 'mujoco>=4\.0'"):
                sand.batch(2)
            return
        batch = sand.batch(4, 2)
        batch.step(nstep=200)
        np.testing.assert_array_equal(batch.bind("qpos"), [data.qpos] * 4)


def test_simulations_have_media_of_their_own():
    """Each as in its medium alone; a medium that is changed between steps is felt from then on."""
    model = model_of(BALL)
    media = rft.mujoco.sample("poppy-seeds-loose", 3, seed=1, spread=0.4)
    with rft.mujoco.attach(model, "poppy-seeds-loose", rounding=0.02) as sand:
        if int(mujoco.__version__.partition(".")[0]) < 4:
            return
        batch = sand.batch(3, 2, media=media)
        batch.step(nstep=100)
        middle = batch.bind("qpos")[0].copy()
        sand.media[0] = media[1]
        batch.step(nstep=100)
        found = batch.bind("qpos").copy()
        assert [*sand.media] == [media[1], *media[1:]] and sand.media[1:] == [law_of(x) for x in media[1:]]
        with pytest.raises(rft.Refusal, match="media must be 4, one for each simulation"):
            sand.batch(4, media=media)
        with pytest.raises(rft.Refusal, match="media of one batch must have one form"):
            sand.media[0] = SPATIAL
        with pytest.raises(rft.Refusal, match="there is no simulation 3"):
            sand.media[3] = media[0]
    for k, medium in enumerate(media):
        with rft.mujoco.attach(model, medium, rounding=0.02):
            data = mujoco.MjData(model)
            mujoco.mj_step(model, data, 100)
            if k == 0:
                np.testing.assert_allclose(middle, data.qpos, rtol=0, atol=1e-14)
                continue
            mujoco.mj_step(model, data, 100)
            np.testing.assert_allclose(found[k], data.qpos, rtol=0, atol=1e-14)
    assert abs(found[0, 2] - found[1, 2]) > 1e-6


def test_media_are_drawn_within_their_uncertainty():
    drawn = rft.mujoco.sample(Spatial(3e5), 2000, seed=2, spread=0.1)
    logs = np.log([x.xi_n / 3e5 for x in drawn])
    assert logs.std() == pytest.approx(0.1, rel=0.1) and abs(logs.mean()) < 0.01
    assert drawn == rft.mujoco.sample(Spatial(3e5), 2000, seed=2, spread=0.1)
    scaled = rft.mujoco.sample(ZetaFit(0.5, 0.05, 30, *[None] * 3, 0.0, 0.0), 1000)
    assert np.std([x.zeta for x in scaled]) == pytest.approx(0.05, rel=0.1)
    beta, gamma = (x.ravel() for x in np.meshgrid(*[np.radians(np.arange(-75, 90, 30))] * 2))
    noise = 0.02 * np.random.default_rng(1).normal(size=(2, beta.size))
    fit = fit_stress(beta, gamma, *(MAP(beta, gamma) + noise))
    drawn = rft.mujoco.sample(fit, 4000, seed=3)
    values = np.array([[getattr(x, name) for name in COEFFICIENTS] for x in drawn])
    np.testing.assert_allclose(np.cov(values.T), fit.covariance, atol=0.1 * fit.covariance.max())
    assert isinstance(drawn[0], StressMap)
    for medium, more, message in (
        ("generic", {}, "the uncertainty of the medium is unknown: give spread"),
        (fit, {"spread": 0.1}, "a fit has its own covariance: drop spread"),
        ("sand", {"spread": 0.1}, "the medium has no strength to draw"),
        ("generic", {"spread": -1.0}, "spread must be"),
    ):
        with pytest.raises(rft.Refusal, match=message):
            rft.mujoco.sample(medium, 3, **more)


def test_a_callback_does_not_outlive_its_model():
    model = model_of(BALL)
    sand = rft.mujoco.attach(model, MAP)
    assert sand.is_attached
    del model
    gc.collect()
    assert mujoco.get_mjcb_passive() is None and not sand.is_attached
    sand.detach()
    with pytest.raises(rft.Refusal, match="the sand is detached"):
        sand.batch(2)
    first, second = model_of(BALL), model_of(BALL)
    rft.mujoco.attach(first, MAP).detach()
    sand = rft.mujoco.attach(second, MAP)  # takes the place of the other in the table
    del first
    gc.collect()
    assert sand.is_attached
    sand.detach()


def test_a_fault_inside_the_callback_of_python_detaches_the_sand(monkeypatch):
    model = model_of(BALL)
    data = mujoco.MjData(model)
    with preferring("numpy"):
        sand = rft.mujoco.attach(model, MAP)
    monkeypatch.setattr("rft.mujoco.bed.Bed.wrenches", lambda *_: 1 / 0)
    with pytest.warns(Note, match="the sand is detached: ZeroDivisionError"):
        mujoco.mj_step(model, data)
    assert not sand.is_attached
    sand.detach()


def test_without_numba_a_line_says_how_much_slower_it_is():
    model = model_of(BALL)
    with preferring("numpy"), pytest.warns(Note, match=r"by Python's callback, some \d+ times slower: pip install"):
        rft.mujoco.attach(model, MAP).detach()


HFIELD = '<geom name="hills" type="plane" size="1 1 1"/>'
DRAGS = PlateDrags(*np.random.default_rng(1).uniform(-1.5, 1.5, (4, 200)))
REFUSED = {
    "geoms": ({"geoms": "bal"}, "the model has no geom 'bal': did you mean 'ball'"),
    "pattern": ({"geoms": ["ball", "leg*"]}, "the model has no geom 'leg"),
    "group": ({"geoms": 5}, r"no geom is in group 5: groups are \[0\]"),
    "none": ({"geoms": []}, "geoms`` names none|geoms names none"),
    "kind": ({"geoms": 1.5}, "must be|not iterable"),
    "plane": ({"geoms": "slab"}, "the geom 'slab' is a plane and has no inside: give a sphere"),
    "fixed": ({"geoms": "post"}, "the geom 'post' is fixed to the world: name geoms that move"),
    "medium": ({"medium": "poppy-seeds-lose"}, "there is no medium 'poppy-seeds-lose': did you mean poppy-seeds-loose"),
    "horizontal": ({"medium": "glass-0.3mm-loose"}, "glass-0.3mm-loose has no vertical law: take one of generic"),
    "law": ({"medium": rft.Granular(1.8, 0.2)}, "the medium has no vertical law in three dimensions"),
    "drags": ({"medium": DRAGS}, "stress must be a StressMap, nine coefficients, .* fit some to plate drags"),
    "zero": ({"element": 0.0}, "element must be"),
    "rounding": ({"rounding": 0.0}, "rounding must be"),
    "level": ({"level": math.nan}, "level must be"),
    "slope": ({"slope": 1.2}, "slides by itself"),
    "effects": ({"effects": ["aeration"]}, "effects must be a list of effects"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_makes_no_sense_is_refused_in_one_line_and_changes_nothing(name):
    more = '<geom name="slab" type="plane" size="1 1 1"/><geom name="post" type="box" size="1 1 1" pos="9 9 9"/>'
    model = model_of(BALL + more)
    arguments, message = REFUSED[name]
    masks = model.geom_contype.copy()
    with pytest.raises(rft.Refusal, match=message) as refused:
        rft.mujoco.attach(model, **({"medium": MAP} | arguments))
    assert "\n" not in str(refused.value)
    assert mujoco.get_mjcb_passive() is None and np.array_equal(masks, model.geom_contype)


def test_what_changes_after_attach_is_refused():
    model = model_of(BALL)
    data = mujoco.MjData(model)
    with rft.mujoco.attach(model, MAP) as sand:
        with pytest.raises(rft.Refusal, match="sand is attached to 'ball' already: detach it"):
            rft.mujoco.attach(model, MAP)
        with pytest.raises(rft.Refusal, match="the model has no body 'zz'"):
            sand.wrench(data, "zz")
        with pytest.raises(rft.Refusal, match="the data are of another model"):
            sand.forces(mujoco.MjData(model_of(FLOORED.format(""))))
        model.geom_size[0, 0] = 0.05
        with pytest.raises(rft.Refusal, match="the geom 'ball' changed after attach: detach the sand"):
            sand.power(data)
        mujoco.set_mjcb_passive(None)
        with pytest.raises(rft.Refusal, match="another passive callback took the place"):
            sand.power(data)
    with pytest.raises(rft.Refusal, match="the sand is detached"):
        sand.forces(data)
    mujoco.set_mjcb_passive(lambda *_: None)
    with pytest.raises(rft.Refusal, match="another passive callback is installed"):
        rft.mujoco.attach(model, MAP)
    mujoco.set_mjcb_passive(None)
    still = model_of('<geom name="post" type="box" size="1 1 1"/>')
    with pytest.raises(rft.Refusal, match="nothing in the model can move"):
        rft.mujoco.attach(still, MAP)
    paired = model_of(FLOORED.format(""), more='<contact><pair geom1="floor" geom2="foot"/></contact>')
    with pytest.raises(rft.Refusal, match="a <pair> of <contact> makes 'floor' and 'foot' touch: drop it"):
        rft.mujoco.attach(paired, MAP)


def test_a_name_is_the_stress_map_of_the_catalogue():
    assert law_of("poppy-seeds-loose") == Extruded(VERTICAL["poppy-seeds-loose"].stress) and law_of(SPATIAL) == SPATIAL
    model = model_of(BALL)
    assert needed_rounding(model, [0]) == pytest.approx(9.81e-3)
    block = model_of('<body><freejoint/><geom type="box" size="0.1 0.1 0.1"/></body>')
    with pytest.raises(rft.Refusal, match=r"^the geom 'geom 0': the geom has 480000 elements, .*: make element longer"):
        rft.mujoco.attach(block, MAP, element=1e-3)


def test_a_gait_for_sand_is_searched_for(tmp_path):
    """A few short walks: the best never gets worse, and what is drawn is what was found."""
    if int(mujoco.__version__.partition(".")[0]) < 4:
        pytest.skip("needs mujoco.batch")
    from figures import sand_gaits

    numbers = sand_gaits.compute(2, 4, 0.6)
    for speeds in numbers["found"].values():
        assert speeds[1] >= speeds[0] > -1.0
    assert numbers["speeds"].shape == (2, 2) and len(numbers["strip"]) == sand_gaits.SNAPSHOTS
    assert numbers["speeds"][0, 0] == pytest.approx(numbers["found"]["sand"][-1], abs=1e-12)
    figure = drawn(sand_gaits, numbers, tmp_path)
    assert [bar.get_height() for bar in figure.axes[1].patches] == [*numbers["speeds"][0], *numbers["speeds"][1]]
    assert "for sand" in sand_gaits.table(numbers)


@pytest.mark.parametrize(
    ("missing", "module", "name", "message"),
    [
        ("mujoco", "rft.mujoco", "sand", r"rft.mujoco needs MuJoCo: pip install 'geomech\[mujoco\]'"),
        (
            "gymnasium",
            "geomech.gym",
            "hexapod",
            r"geomech.gym needs Gymnasium and MuJoCo: pip install 'geomech\[gym\]'",
        ),
    ],
)
def test_what_is_not_installed_is_named(missing, module, name, message, monkeypatch):
    package = importlib.import_module(module)
    monkeypatch.delitem(sys.modules, f"{module}.{name}", raising=False)
    monkeypatch.delattr(package, name, raising=False)
    monkeypatch.setitem(sys.modules, missing, None)
    with pytest.raises(rft.Refusal, match=message):
        getattr(package, package.__all__[0])
