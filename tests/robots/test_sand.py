"""Sand under MuJoCo models: forces, virtual work, symmetries, steps, threads, lifetimes and refusals."""

import gc
import importlib
import math
import pickle
import sys
import threading
import warnings

import numpy as np
import pytest
from artists import drawn
from scipy.interpolate import RegularGridInterpolator
from scipy.spatial.transform import Rotation

import rft
from rft.balance import backend
from rft.balance.backend import Note, preferring
from rft.fits.plates import ZetaFit, fit_stress
from rft.terradynamics.ground import DisturbedGround, GrainInertia, Ground, Slope
from rft.terradynamics.meshes import Spatial, wrench
from rft.terradynamics.meshes.forces.blocks import Blocks
from rft.terradynamics.meshes.forces.contact import Motion, faces
from rft.terradynamics.meshes.forces.extruded import Extruded
from rft.terradynamics.meshes.surfaces import shapes
from rft.terradynamics.meshes.surfaces.mesh import Mesh
from rft.terradynamics.meshes.surfaces.smooth import smooth
from rft.terradynamics.plates import VERTICAL, PlateDrags, RoundRod, StressMap, loads
from rft.terradynamics.plates.stress import COEFFICIENTS

mujoco = pytest.importorskip(
    "mujoco", reason="needs the extra: pip install 'geomech[mujoco]'"
)
from rft.mujoco import installed  # noqa: E402
from rft.mujoco.ground.hills import hills_of, tangent_plane  # noqa: E402
from rft.mujoco.media import law_of  # noqa: E402
from rft.mujoco.sand import meshes  # noqa: E402
from rft.terradynamics.meshes.geoms import mesh_of_elements  # noqa: E402

needs_numba = pytest.mark.skipif(
    not backend.installed(), reason="needs the extra: pip install 'geomech[fast]'"
)
# Steps so short that forces are those of the velocities in the data.
AT_ONCE = '<option timestep="1e-15" gravity="0 0 0"/>'  # no velocity changes in it
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
        if installed._entries:
            gc.collect()  # a model that a cycle of references still holds
        assert mujoco.get_mjcb_passive() is None and not installed._entries


def model_of(body, options="", more=""):
    return mujoco.MjModel.from_xml_string(
        f"<mujoco>{options}{ASSET}<worldbody>{body}</worldbody>{more}</mujoco>"
    )


def own_notes(sand):
    """Notes but for the one about numba."""
    return [line for line in sand.notes if "Python" not in line]


def chain(rng, joints, links=5):
    """A branching chain of links with random places, joints and geoms, hinges and slides two on a body at times."""
    numbers = lambda n, size: " ".join(f"{x:.4f}" for x in size * rng.normal(size=n))
    joint = lambda k: (
        f'<joint type="{k}" axis="{numbers(3, 1.0)}" pos="{numbers(3, 0.02)}"/>'
        if k
        else ""
    )
    text = ""
    for k in range(links):
        kind = joints[k % len(joints)]
        own = (
            "".join(map(joint, kind))
            if isinstance(kind, tuple)
            else "<freejoint/>"
            if kind == "free"
            else joint(kind)
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
    model = model_of(chain(rng, CHAINS[name]), AT_ONCE, more)
    data, plain = mujoco.MjData(model), mujoco.MjData(model)
    holes = (
        DisturbedGround((0.05, -0.3), 0.2, 0.4),
        DisturbedGround((0.2,), 0.15, 0.3),
    )
    effects = (GrainInertia(0.5, 300.0), *holes)
    with rft.mujoco.attach(
        model, law, element=0.02, slope=0.2, effects=effects
    ) as sand:
        cut = meshes(model, sand._bed.geoms.ids, 0.02)
        for _ in range(3):
            data.qpos[:] += 0.3 * rng.normal(size=model.nq)
            data.qvel[:] = rng.normal(size=model.nv)
            mujoco.mj_normalizeQuat(model, data.qpos)
            mujoco.mj_forward(model, data)
            found, expected, work = (
                sand.forces(data),
                np.zeros((len(cut), 3)),
                np.zeros(model.nv),
            )
            for k, (geom, body, mesh) in enumerate(
                zip(sand._bed.geoms.ids, sand._bed.geoms.bodies, cut)
            ):
                motion = np.zeros(6)
                mujoco.mj_objectVelocity(
                    model, data, mujoco.mjtObj.mjOBJ_GEOM, geom, motion, 0
                )
                force, moment = on_mesh(
                    law, mesh, data, geom, motion, Slope(0.2), effects, sand.rounding
                )
                expected[k] = force
                mujoco.mj_applyFT(
                    model, data, force, moment, data.geom_xpos[geom], body, work
                )
            assert np.abs(expected).max() > 0.1
            np.testing.assert_allclose(
                found, expected, rtol=0, atol=3e-12 * np.abs(expected).max()
            )
            np.testing.assert_allclose(
                data.qfrc_passive, work, rtol=0, atol=3e-12 * np.abs(work).max()
            )
            power = float(work @ data.qvel)
            assert (
                sand.power(data) == pytest.approx(power, abs=1e-11 * abs(power))
                and power < 0
            )
    plain.qpos[:], plain.qvel[:] = data.qpos, data.qvel
    mujoco.mj_forward(model, plain)
    assert not plain.qfrc_passive.any()


def on_mesh(law, mesh, data, geom, motion, slope, effects, rounding):
    """Force and moment about the geom's origin, from `wrench` in the frame of the slope; of a stress map by NumPy."""
    turn = Rotation.from_euler(
        "y", slope.angle
    ).as_matrix()  # from the world to axes along and across the slope
    rotation, place = (
        turn @ data.geom_xmat[geom].reshape(3, 3),
        turn @ data.geom_xpos[geom],
    )
    velocity, spin = turn @ motion[3:], turn @ motion[:3]
    if isinstance(law, Spatial) and rounding < 1e-9:
        one = wrench(law, mesh, rotation, place, velocity, spin, (*effects, slope))
        return turn.T @ one.force, turn.T @ one.moment
    law = law if isinstance(law, Spatial) else Extruded(law)
    ground = Ground(rounding=rounding, grazing_sine=law.grazing_sine)
    for effect in (*effects, slope):
        ground = effect.apply(ground)
    up, ahead = rotation[2], rotation[0]
    motion = Motion(
        *(
            x[None, None]
            for x in (
                velocity @ rotation,
                spin @ rotation,
                place[0],
                up,
                ahead,
                place[2],
            )
        )
    )
    block = Blocks([faces(mesh.vertices[mesh.faces], mesh.middle_normals)])
    out = block.loads_by_numpy(law, ground, motion)[0, 0].reshape(2, 3)
    return turn.T @ rotation @ out[0], turn.T @ rotation @ out[1]


BALL = '<body name="ball" pos="0 0 0.01"><freejoint/><geom name="ball" type="sphere" size="0.03" mass="0.2"/></body>'


def test_a_geom_bears_what_its_mesh_does(solved_by):
    """Of `rft.terradynamics.meshes.wrench`, which has no rounding, on the same triangles; and about the origin of the body."""
    model = model_of(
        BALL.replace("<geom", '<geom pos="0.01 0.02 -0.01" euler="20 30 40"'), AT_ONCE
    )
    data = mujoco.MjData(model)
    data.qvel[:] = [0.4, 0.3, -0.5, 3.0, -2.0, 1.0]
    with rft.mujoco.attach(
        model, SPATIAL, level=-0.005, rounding=1e-7, element=0.01
    ) as sand:
        mujoco.mj_forward(model, data)
        turn, place, motion = (
            data.geom_xmat[0].reshape(3, 3),
            data.geom_xpos[0] + [0, 0, 0.005],
            np.zeros(6),
        )
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_GEOM, 0, motion, 0)
        one = wrench(
            SPATIAL,
            mesh_of_elements(model, 0, 0.01),
            turn,
            place,
            motion[3:],
            motion[:3],
        )
        moment = one.moment + np.cross(data.geom_xpos[0] - data.xpos[1], one.force)
        size = np.abs(one.force).max()
        np.testing.assert_allclose(
            sand.wrench(data, "ball"), [*one.force, *moment], rtol=0, atol=2e-12 * size
        )
        np.testing.assert_allclose(
            sand.forces(data), [one.force], rtol=0, atol=2e-12 * size
        )
        assert sand.power(data) == pytest.approx(one.power, rel=1e-11)


@pytest.mark.parametrize("geom", GEOMS)
def test_a_geom_that_hardly_dips_in_bears(geom, solved_by):
    """With its lowest corner 0.5 mm deep, whatever its pose: the sphere around each geom holds all of it."""
    model = model_of(f'<body><freejoint/><geom {geom} pos="0.02 0.01 -0.03"/></body>')
    data = mujoco.MjData(model)
    mesh = mesh_of_elements(model, 0, 0.01)
    with rft.mujoco.attach(model, SPATIAL, element=0.01) as sand:
        for pose in Rotation.random(6, random_state=1):
            data.qpos[:3], data.qpos[3:], data.qvel[2] = (
                0.0,
                np.roll(pose.as_quat(), 1),
                -1.0,
            )
            mujoco.mj_forward(model, data)
            heights = (
                mesh.vertices @ data.geom_xmat[0].reshape(3, 3)[2]
                + data.geom_xpos[0, 2]
            )
            data.qpos[2] = -heights.min() - 5e-4
            mujoco.mj_forward(model, data)
            force = sand.forces(data)[0]
            np.testing.assert_allclose(data.qfrc_passive[:3], force, atol=1e-12)
            assert force[2] > 1e-5


def test_a_long_rod_bears_what_the_plane_says():
    """A stress map on a cylinder dragged across its axis and down, against the outline of the vertical plane."""
    model = model_of(
        '<body pos="0 0 -0.1" euler="90 0 0"><freejoint/><geom type="cylinder" size="0.02 0.05"/></body>',
        AT_ONCE,
    )
    data = mujoco.MjData(model)
    data.qvel[:3] = [0.3, 0.0, -0.2]
    sharp = StressMap(zeta=0.3, grazing=2e-3)
    with rft.mujoco.attach(model, sharp, element=0.002, rounding=1e-7) as sand:
        mujoco.mj_forward(model, data)
        flat = loads(
            sharp, RoundRod(0.02, 0.1).outline(64), (0, -0.1, 0), (0.3, -0.2, 0)
        ).force
        np.testing.assert_allclose(sand.forces(data)[0, [0, 2]], flat, rtol=0.01)


def hilly(heights, pose="", geoms=f"<geom {GEOMS[1]}/>"):
    """A model of one body over a height field 2 m along x and 1 m along y, with heights of up to 1 m."""
    rows = " ".join(f"{x:.12f}" for x in np.ravel(heights))
    size = f'nrow="{len(heights)}" ncol="{len(heights[0])}" size="1 0.5 1 0.1"'
    asset = f'<asset><hfield name="hills" {size} elevation="{rows}"/></asset>'
    field = f'<geom name="hills" type="hfield" hfield="hills" {pose}/>'
    body = f'{field}<body pos="0 0 0"><freejoint/>{geoms}</body>'
    return model_of(body, AT_ONCE, asset)


def test_a_height_field_is_the_surface(solved_by):
    """A plane of one slope, turned about the vertical: the forces of `slope`, but for the weaker ground; and level beyond."""
    along = np.linspace(0.0, 1.0, 5) * np.ones((4, 1))  # rises by 1 m in 2 m
    model = hilly(along, 'pos="0 0 -0.5" euler="0 0 30"')
    flat, angle = (
        model_of(f"<body><freejoint/><geom {GEOMS[1]}/></body>", AT_ONCE),
        math.atan(0.5),
    )
    turn, place = Rotation.from_euler("z", 30, degrees=True), np.array([0.2, 0.1, 0.11])
    spin, velocity = (
        np.array([1.0, -2.0, 0.5]),
        np.array([0.5, 0.05, -0.4]),
    )  # into the ground and uphill

    def forces(model, turn, **more):
        data = mujoco.MjData(model)
        data.qpos[:3], data.qpos[3:] = (
            turn.apply(place),
            np.roll((turn * Rotation.from_euler("x", 0.4)).as_quat(), 1),
        )
        data.qvel[:3], data.qvel[3:] = (
            turn.apply(velocity),
            Rotation.from_euler("x", -0.4).apply(spin),
        )
        with rft.mujoco.attach(
            model, SPATIAL, element=0.01, rounding=0.01, **more
        ) as sand:
            mujoco.mj_forward(model, data)
            assert data.ncon == 0
            np.testing.assert_allclose(
                data.qfrc_passive[:3], sand.forces(data)[0], atol=1e-12
            )
            return turn.inv().apply(sand.forces(data)[0])

    expected = forces(flat, Rotation.identity(), slope=angle) / math.cos(angle)
    assert np.linalg.norm(expected) > 1.0
    np.testing.assert_allclose(
        forces(model, turn, level="hills"),
        expected,
        rtol=0,
        atol=2e-3 * abs(expected).max(),
    )
    place[:] = [1.5, 0.0, 0.49]
    expected = forces(flat, turn, level=0.5)
    np.testing.assert_allclose(
        forces(model, turn, level="hills"),
        expected,
        rtol=0,
        atol=1e-12 * abs(expected).max(),
    )
    with pytest.raises(
        rft.Refusal, match="a height field has slopes of its own: drop slope"
    ):
        rft.mujoco.attach(model, SPATIAL, level="hills", slope=0.1)
    with pytest.raises(rft.Refusal, match="the geom 'geom 1' is a capsule|has no geom"):
        rft.mujoco.attach(model, SPATIAL, level="geom 1")
    with pytest.raises(
        rft.Refusal, match="the height field 'hills' is tilted or moves"
    ):
        rft.mujoco.attach(hilly(along, 'euler="10 0 0"'), SPATIAL, level="hills")


def test_a_height_field_is_where_mujoco_has_it():
    """At its nodes, by rays that MuJoCo casts down."""
    heights = np.random.default_rng(7).uniform(0, 1, (4, 6))
    model = hilly(
        (heights - heights.min()) / np.ptp(heights), 'pos="0.3 -0.2 0.1" euler="0 0 40"'
    )
    hills, geom = hills_of(model, "hills")
    data, turn = mujoco.MjData(model), Rotation.from_euler("z", 40, degrees=True)
    data.qpos[2] = -9.0
    mujoco.mj_forward(model, data)
    for u in np.linspace(-1, 1, 6)[1:-1]:
        for v in np.linspace(-0.5, 0.5, 4)[1:-1]:
            x, y, _ = place = turn.apply([u, v, 0.0]) + [0.3, -0.2, 5.0]
            hit = place[2] - mujoco.mj_ray(
                model,
                data,
                place,
                np.array([0, 0, -1.0]),
                None,
                1,
                -1,
                np.zeros(1, np.int32),
            )
            (n_x, n_y, n_z), level = tangent_plane(*hills, x, y)
            assert geom == 0 and (level - n_x * x - n_y * y) / n_z == pytest.approx(
                hit, abs=1e-6
            )
    x, y = np.linspace(-1, 1, 6), np.linspace(-0.5, 0.5, 4)
    known = np.stack([hills[0][..., 0], *np.gradient(hills[0][..., 0], y, x)], -1)
    for v, u in np.random.default_rng(8).uniform(
        [-0.5, -1], [0.5, 1], (20, 2)
    ):  # between nodes, all along lines
        height, by_v, by_u = RegularGridInterpolator((y, x), known)((v, u))
        place, (by_x, by_y, _) = (
            turn.apply([u, v, 0.0]) + [0.3, -0.2, 0.1],
            turn.apply([by_u, by_v, 0.0]),
        )
        n, level = tangent_plane(*hills, *place[:2])
        np.testing.assert_allclose(
            n, np.array([-by_x, -by_y, 1.0]) / math.hypot(by_x, by_y, 1.0), atol=1e-12
        )
        assert level == pytest.approx(n @ (place + [0, 0, height]), abs=1e-12)


OTHER = StressMap(C01=0.1, D10=0.01, zeta=0.7, grazing=math.radians(8))
REGIONS = "2 * x - y / 2 > 0.3 and y >= -0.5", "-1 < x < 0.02", "0.01 + x <= 0.5 * y"


def test_media_by_region(solved_by):
    """A geom in a region bears what that medium bears alone; across boundaries the regions share all of its faces."""
    body = "".join(
        f'<body pos="0 0 -0.02"><freejoint/><geom {geom}/></body>' for geom in GEOMS
    )
    model = model_of(body, AT_ONCE)
    data, rng = mujoco.MjData(model), np.random.default_rng(5)
    poses = data.qpos.reshape(-1, 7)
    poses[:, 3:] = Rotation.random(6, random_state=6).as_quat()
    data.qvel[:] = rng.normal(size=model.nv)

    def forces(medium, **regions):
        with rft.mujoco.attach(
            model, medium, element=0.02, rounding=0.01, **regions
        ) as sand:
            mujoco.mj_forward(model, data)
            by_joint = data.qfrc_passive.reshape(-1, 6)[:, :3]
            np.testing.assert_allclose(
                by_joint, sand.forces(data), rtol=0, atol=1e-12 * np.abs(by_joint).max()
            )
            return by_joint.copy()

    for first, second in ((MAP, OTHER), (SPATIAL, Spatial(1e5, surface_friction=0.3))):
        poses[:, :2] = [
            [1, 0.3],
            [1, -1.2],
            [-0.4, 0],
            [-0.4, -1],
            [0.1, 0.1],
            [0.09, 0.4],
        ]
        alone = forces(first), forces(second)
        found = forces(
            first, regions={REGIONS[0]: second, REGIONS[1]: first, REGIONS[2]: second}
        )
        expected = np.choose(np.array([1, 0, 0, 0, 0, 1])[:, None], alone)
        np.testing.assert_allclose(
            found, expected, rtol=0, atol=1e-12 * np.abs(expected).max()
        )
        poses[:, :2] = rng.uniform(-0.02, 0.03, (6, 2)) + [0.1, -0.05]
        alone, crossed = forces(first) + forces(second), np.zeros((6, 3))
        for medium, other in ((first, second), (second, first)):
            crossed += forces(
                medium,
                regions={REGIONS[0]: other, REGIONS[1]: medium, REGIONS[2]: other},
            )
        np.testing.assert_allclose(
            crossed, alone, rtol=0, atol=1e-12 * np.abs(alone).max()
        )
    straight, yaw = (
        forces(MAP, regions={"x > 0.1": OTHER}),
        Rotation.from_rotvec([0, 0, math.atan2(0.6, 0.8)]),
    )
    poses[:, :3], turn = (
        yaw.apply(poses[:, :3]),
        Rotation.from_quat(np.roll(poses[:, 3:], -1, 1)),
    )
    poses[:, 3:] = np.roll((yaw * turn).as_quat(), 1, 1)
    data.qvel.reshape(-1, 6)[:, :3] = yaw.apply(data.qvel.reshape(-1, 6)[:, :3])
    turned = forces(MAP, regions={"0.8 * x + 0.6 * y > 0.1": OTHER})
    np.testing.assert_allclose(
        turned, yaw.apply(straight), rtol=0, atol=1e-11 * np.abs(straight).max()
    )
    poses[0], data.qvel[:6] = (
        [0.3, -0.2, -0.01, 1, 0, 0, 0],
        [0, 0, -1, 0, 0, 0],
    )  # a box straight down, half in each
    halves = (
        forces(MAP)[0],
        forces(OTHER)[0],
        forces(MAP, regions={"-1.7 > 4*y - 3*x": OTHER})[0],
    )
    assert abs(halves[1][2] - halves[0][2]) > 1.0 and halves[2][2] == pytest.approx(
        (halves[0] + halves[1])[2] / 2
    )


@pytest.mark.parametrize(
    ("regions", "message"),
    [
        (["x > 1"], "regions must be media by their conditions"),
        (
            {"x > z": MAP},
            "the region 'x > z' is no condition on x and y: write it like 'x > 0.5' or",
        ),
        ({"x * y > 1": MAP}, "is no condition"),
        ({"x > 1 or y > 1": MAP}, "is no condition"),
        ({"1 > 0": MAP}, "is no condition"),
        ({"x / 0 > 1": MAP}, "is no condition"),
        ({"x = 1": MAP}, "is no condition"),
        ({"x > " + 3000 * "-" + "1": MAP}, "is no condition"),
        ({"x > 1" + 400 * "0": MAP}, "is no condition"),
        (
            {" < ".join("1x" * 51): MAP},
            "the regions have 101 boundaries, more than 100",
        ),
        (
            {"x > 1": SPATIAL},
            "media of all regions must have one form: give stress maps, or laws, alone",
        ),
        ({"x > 1": "poppy-seeds-lose"}, "did you mean poppy-seeds-loose"),
    ],
)
def test_regions_that_make_no_sense_are_refused(regions, message):
    with pytest.raises(rft.Refusal, match=message):
        rft.mujoco.attach(model_of(BALL), MAP, regions=regions)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"element": 0}, "element must be a number from 1e-06 to 1000 m, got 0"),
        ({"rounding": 0}, "rounding must be a number from 1e-07 to 10 m/s, got 0"),
        ({"level": 2e6}, r"level must be a number from -1e\+06 to 1e\+06 m"),
    ],
)
def test_numbers_of_sand_have_limits(given, message):
    with pytest.raises(rft.Refusal, match=message):
        rft.mujoco.attach(model_of(BALL), MAP, **given)


def test_forces_converge_with_the_length_of_elements():
    """At order 2, on round and flat geoms."""
    body = "".join(
        f'<body pos="0 0 -0.02"><freejoint/><geom {geom}/></body>' for geom in GEOMS
    )
    model = model_of(body, AT_ONCE)
    data = mujoco.MjData(model)
    data.qvel[:] = np.random.default_rng(3).normal(size=model.nv)
    values = []
    for element in (0.016, 0.008, 0.004, 0.002):
        with rft.mujoco.attach(model, SPATIAL, element=element) as sand:
            mujoco.mj_forward(model, data)
            values.append(sand.forces(data))
    errors = [
        np.linalg.norm(x - values[-1]) / np.linalg.norm(values[-1]) for x in values[:-1]
    ]
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


def slender(kind, ratio):
    """A geom of a kind whose longest side is ``ratio`` times its shortest."""
    if kind == "mesh":
        points = Rotation.random(60, random_state=3).as_matrix()[:, 0]
        points = 0.03 * points * [1.0, ratio**-0.5, 1 / ratio]
        numbers = " ".join(f"{x:.6g}" for x in points.ravel())
        asset = f'<asset><mesh name="m" vertex="{numbers}"/></asset>'
        return mujoco.MjModel.from_xml_string(
            f"<mujoco>{asset}<worldbody><body><freejoint/>"
            '<geom type="mesh" mesh="m"/></body></worldbody></mujoco>'
        )
    sizes = {
        "capsule": (0.01, 0.01 * max(ratio - 1.0, 0.1)),
        "cylinder": (0.01, 0.01 * ratio),
        "disc": (0.01, 0.01 / ratio),
    }.get(kind, (0.03, 0.03 * ratio**-0.5, 0.03 / ratio))
    kind = kind.replace("disc", "cylinder")
    size = " ".join(map(str, sizes))
    return model_of(f'<body><freejoint/><geom type="{kind}" size="{size}"/></body>')


def error_of_elements(mesh, finer, seed=1):
    """Errors of the force, over the force, of 200 random poses and motions that bear a tenth of the most."""
    law = law_of("poppy-seeds-loose")
    reach = np.linalg.norm(np.ptp(mesh.vertices, axis=0)) / 2
    rng = np.random.default_rng(seed)
    turn = Rotation.random(200, random_state=seed).as_matrix()
    velocity = rng.normal(size=(200, 3)) - [0.0, 0.0, 1.0]
    spin = rng.normal(size=(200, 3)) * 0.5 / reach
    along_axes = lambda x: np.einsum("cij,ci->cj", turn, x)[None]
    height = reach * rng.uniform(-1.5, 0.5, (1, 200))
    up, ahead = turn[None, :, 2], turn[None, :, 0]
    motion = Motion(
        along_axes(velocity), along_axes(spin), 0 * height, up, ahead, height
    )
    ground = Ground(rounding=1e-5, grazing_sine=law.grazing_sine)

    def forces(mesh):
        block = Blocks([faces(mesh.vertices[mesh.faces], mesh.middle_normals)])
        return block.loads(law, ground, motion)[0, :, :3]

    true = forces(finer)
    size = np.linalg.norm(true, axis=1)
    kept = size > 0.1 * size.max()
    return np.linalg.norm(forces(mesh) - true, axis=1)[kept] / size[kept]


@needs_numba
@pytest.mark.parametrize("ratio", [1.0, 2.0, 4.0, 20.0])
@pytest.mark.parametrize(
    "kind", ["box", "ellipsoid", "capsule", "cylinder", "disc", "mesh"]
)
def test_elements_follow_the_shape_of_each_geom(kind, ratio):
    """Of 200 random poses and motions 90 % are within 3 % and none is beyond 6 %."""
    model = slender(kind, ratio)
    mesh = mesh_of_elements(model, 0)
    reach = np.linalg.norm(np.ptp(mesh.vertices, axis=0)) / 2
    finest = reach / (12 if kind == "mesh" else 30)
    if kind in ("capsule", "cylinder"):
        finest = min(finest, 0.01 / 4)
    finer = mesh_of_elements(model, 0, finest)
    for seed in (1, 2):
        errors = error_of_elements(mesh, finer, seed)
        assert np.quantile(errors, 0.9) < 0.03 and errors.max() < 0.06, errors.max()


def meshed(mesh):
    """A model of one mesh geom."""
    corners = " ".join(f"{x:.9g}" for x in mesh.vertices.ravel())
    triangles = " ".join(map(str, mesh.faces.ravel()))
    asset = f'<asset><mesh name="m" vertex="{corners}" face="{triangles}"/></asset>'
    body = '<body><freejoint/><geom type="mesh" mesh="m"/></body>'
    return mujoco.MjModel.from_xml_string(
        f"<mujoco>{asset}<worldbody>{body}</worldbody></mujoco>"
    )


@needs_numba
@pytest.mark.parametrize("radii", [(0.03, 0.03, 0.03), (0.04, 0.01, 0.004)])
def test_meshes_of_many_triangles_become_fewer_elements(radii):
    """An ellipsoid of 5,120 triangles; a rod of 48 slivers is not cut into thousands."""
    ball = shapes.sphere(1.0, 4)
    fine = smooth(Mesh(ball.vertices * radii, ball.faces))
    model = meshed(fine)
    mesh = mesh_of_elements(model, 0)
    assert len(mesh.faces) < 1000
    turn = Rotation.from_quat(np.roll(model.mesh_quat[0], -1)).as_matrix()
    turned = Mesh(fine.vertices @ turn, fine.faces, True, fine.smooth_normals @ turn)
    errors = error_of_elements(mesh, turned)
    assert np.quantile(errors, 0.9) < 0.03 and errors.max() < 0.06, errors.max()
    rod = meshed(shapes.cylinder(0.005, 0.2, 12, 1, 1))
    assert len(mesh_of_elements(rod, 0).faces) < 400


TWINS = """<body name="shank" pos="0 0 0.1"><freejoint/><geom {both} contype="0" conaffinity="0" group="2"/>
<geom name="calf" {both} group="3"/><geom name="foot" type="sphere" size="0.022" group="3"/></body>"""


def test_what_can_touch_nothing_is_not_in_the_sand():
    """A visual twin counts only where it is named, or where all are of its kind; geoms of a body that overlap are told."""
    model = model_of(TWINS.format(both='type="capsule" size="0.02 0.1"'))
    with rft.mujoco.attach(model, MAP) as sand:
        assert sand.geoms == ("calf", "foot")
        left_out, overlap = own_notes(sand)[:2]
        assert left_out.startswith("the geom 0, of the body 'shank' in group 2, which")
        assert "overlap, where the sand acts on both: 'calf' and 'foot'" in overlap
    for geoms, expected in (
        ("shank", ("calf", "foot")),
        (2, ("geom 0",)),
        (["geom 0", "foot"], ("geom 0", "foot")),
        ("*", ("calf", "foot")),
    ):
        with rft.mujoco.attach(model, MAP, geoms=geoms) as sand:
            assert sand.geoms == expected


def test_an_open_mesh_may_stand_for_its_convex_hull():
    """As MuJoCo's contacts take it; the refusal names the geom, its body and group, and the option."""
    faces = "0 2 1 0 1 3 0 3 2"
    corners = "0 0 0 .06 0 0 0 .04 0 0 0 .1"
    asset = '<asset><mesh name="{}" inertia="shell" vertex="{}" face="{}"/></asset>'
    body = '<body name="leg"><freejoint/><geom type="mesh" mesh="m" mass="1"/></body>'
    models = [
        mujoco.MjModel.from_xml_string(
            f"<mujoco>{AT_ONCE}{asset.format('m', corners, own)}<worldbody>{body}</worldbody></mujoco>"
        )
        for own in (faces, f"{faces} 1 2 3")
    ]
    with pytest.raises(
        rft.Refusal,
        match=r"^the geom 0, of the body 'leg' in group 0: .*open.*: hulls = True",
    ):
        rft.mujoco.attach(models[0], MAP)
    forces = []
    for model, hulls in zip(models, (True, False)):
        data = mujoco.MjData(model)
        data.qvel[:] = [0.1, 0.2, -0.3, 1, 2, 3]
        with rft.mujoco.attach(model, MAP, hulls=hulls, level=0.08) as sand:
            mujoco.mj_forward(model, data)
            forces.append(sand.forces(data)[0])
    np.testing.assert_allclose(*forces, rtol=1e-6)  # corners of single precision


PLATE = """<body pos="0 0 0.04"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>
<geom type="box" size="0.005 0.046 0.06" mass="1e6"/></body>"""
REMEMBERS = '<size nuserdata="30000"/><option gravity="0 0 0" timestep="{}"/>'


def moved(sand, model, data, velocity, seconds):
    """Forces on the last geom at each step of a motion with a velocity along x and z."""
    forces = []
    for _ in range(round(seconds / model.opt.timestep)):
        data.qvel[-2:] = velocity
        mujoco.mj_step(model, data)
        forces.append(sand.forces(data)[-1])
        np.testing.assert_allclose(
            data.qfrc_passive[-2:], forces[-1][[0, 2]], rtol=1e-12, atol=1e-12
        )
    return np.array(forces)


@needs_numba
def test_a_dragged_plate_leaves_a_trench_and_a_ridge_and_its_second_run_meets_less_sand():
    """Fresh ground bears as if it remembered nothing. The volume stays, to rounding; what is left is as wide as the plate."""
    prints = rft.mujoco.Footprints(
        spacing=0.01, length=0.6, width=0.4, x=0.1, y=0.05, repose=0.6
    )
    model = model_of(PLATE.replace('pos="0 0', 'pos="0 0.05'), REMEMBERS.format(0.002))

    def runs(**more):
        data, forces = mujoco.MjData(model), []
        with rft.mujoco.attach(model, MAP, rounding=0.01, **more) as sand:
            for velocity, seconds in (
                ((0.3, 0), 0.7),
                ((0, 0.3), 0.4),
                ((-0.3, 0), 0.7),
                ((0, -0.3), 0.4),
                ((0.3, 0), 0.5),
            ):
                forces.append(moved(sand, model, data, velocity, seconds))
                if more and len(forces) == 1:
                    memory, during = (
                        sand._bed.prints.memory(data.userdata),
                        [x.copy() for x in sand.ground(data)],
                    )
                    assert (memory.pressed < 0.0).any() and memory.ground.max() > 0.01
            return forces, (during, sand.ground(data)) if more else None

    plain, _ = runs()
    forces, ((x, y, heights), (_, _, later)) = runs(footprints=prints)
    assert heights.shape == (40, 60) and (x[0], y[-1]) == pytest.approx((-0.195, 0.245))
    for z in (heights, later):
        assert abs(z.sum()) < 1e-12 * np.abs(z).sum() and np.abs(z).sum() > 1.0
    np.testing.assert_allclose(
        forces[0], plain[0], rtol=0, atol=1e-12 * np.abs(plain[0]).max()
    )
    np.testing.assert_allclose(
        forces[1], plain[1], rtol=0, atol=1e-12 * np.abs(plain[0]).max()
    )
    behind, middle = heights[:, np.searchsorted(x, 0.1)], np.abs(y - 0.05) < 0.02
    assert behind[middle] == pytest.approx(-0.02, abs=3e-3) and behind[
        np.abs(y - 0.05) > 0.15
    ] == pytest.approx(0.0)
    assert 0.005 < behind.max() < 0.03 and behind == pytest.approx(
        behind[::-1], abs=2e-3
    )
    assert (
        x[heights[20].argmax()] == pytest.approx(0.22, abs=0.02)
        and heights[20].max() > behind.max()
    )
    again = slice(50, 200)
    assert np.abs(forces[4][again, 0]).mean() < 0.5 * np.abs(plain[4][again, 0]).mean()


@needs_numba
def test_a_cone_slides_to_the_angle_of_repose_and_rests():
    """Within 2 degrees in all directions, in steps of any length, without losing a grain."""
    model = model_of(PLATE.replace("0 0 0.04", "0 0 1"), REMEMBERS.format(0.002))
    for repose, step in ((0.4, 2e-3), (0.66, 1e-4)):
        model.opt.timestep = step
        data = mujoco.MjData(model)
        with rft.mujoco.attach(
            model, MAP, footprints=rft.mujoco.Footprints(0.01, 0.7, 0.6, 1, 2, repose)
        ) as sand:
            mujoco.mj_forward(model, data)  # from now on the memory is of this grid
            x, y, _ = sand.ground(data)
            away, memory = (
                np.hypot(*np.meshgrid(x - 1, y - 2)),
                sand._bed.prints.memory(data.userdata),
            )
            memory.ground[:] = np.maximum(0.0, 0.15 - 2.5 * away)
            before, memory.head[3:7] = memory.ground.sum(), [0, 60, 0, 70]
            mujoco.mj_step(model, data, round(2.0 / step))
            heights = sand.ground(data)[2]
            assert (
                heights.sum() == pytest.approx(before, rel=1e-13)
                and not memory.head[3:7].any()
            )
            flank = (away > 0.03) & (heights > 0.015)
            by_y, by_x = (x[flank] for x in np.gradient(heights, 0.01))
            angles, directions = (
                np.degrees(np.arctan(np.hypot(by_x, by_y))),
                np.arctan2(by_y, by_x),
            )
            assert flank.sum() > 60 and np.degrees(repose) == pytest.approx(
                angles.min(), abs=2.5
            )
            for k in range(8):
                sector = (
                    np.abs((directions - k * np.pi / 4 + np.pi) % (2 * np.pi) - np.pi)
                    < np.pi / 8
                )
                assert angles[sector].mean() == pytest.approx(
                    np.degrees(repose), abs=2.0
                )


@needs_numba
def test_a_foot_meets_less_sand_in_its_print_and_prints_lie_on_slopes_and_hills():
    """The print is where the foot was, as deep as it was below the surface; a new foot beside it meets what the first met."""
    foot = PLATE.replace("0 0 0.04", "0.12 -0.06 0").replace(
        '"box" size="0.005 0.046 0.06"', '"cylinder" size="0.03 0.03"'
    )
    foot = f'<body pos="0 0.2 0"><joint type="slide"/><geom {GEOMS[3]} mass="1e6"/></body>{foot}'  # beside a ball at rest
    prints = rft.mujoco.Footprints(0.01, 0.5, 0.5)
    rises = np.linspace(0.0, 1.0, 5) * np.ones((4, 1))
    hills = '<asset><hfield name="hills" nrow="4" ncol="5" size="1 0.5 0.2 0.1" elevation="{}"/></asset>'
    hills = hills.format(" ".join(map(str, rises.ravel())))
    field = '<geom name="hills" type="hfield" hfield="hills" pos="0 0 -0.1"/>'  # rises by 0.2 m in 2 m
    for options, slope in (
        ({}, 0.0),
        ({"slope": math.atan(0.1)}, 0.1),
        ({"level": "hills"}, 0.1),
    ):
        model = model_of(
            foot + field * (options.get("level") == "hills"),
            REMEMBERS.format(0.002),
            hills,
        )
        data = mujoco.MjData(model)
        data.qpos[-1] = 0.12 * slope + 0.03 + 0.003
        with rft.mujoco.attach(
            model, MAP, rounding=0.01, footprints=prints, **options
        ) as sand:
            mujoco.mj_forward(model, data)
            x, y, flat = sand.ground(data)
            np.testing.assert_allclose(flat, slope * x * np.ones((50, 1)), atol=1e-6)
            first = moved(sand, model, data, (0, -0.1), 0.2)[:, 2]
            moved(sand, model, data, (0, 0.1), 0.2)
            second = moved(sand, model, data, (0, -0.1), 0.2)[:, 2]
            deep = (sand.ground(data)[2] - flat) * (y < 0.1)[:, None]
            i, j = np.nonzero(deep < 0.6 * deep.min())
            assert (x[j].mean(), y[i].mean()) == pytest.approx(
                (0.12, -0.06), abs=2e-3
            ) and 28 <= len(i) <= 40
            assert deep.min() == pytest.approx(-0.017, abs=4e-3)
            assert (
                first[-1] > 1.0
                and second[60] < 0.5 * first[60]
                and second[-1] < first[-1]
            )
            if slope == 0.0:
                moved(sand, model, data, (0, 0.2), 0.25)
                moved(sand, model, data, (-0.5, 0), 0.3)
                data.qpos[-1] = 0.033
                np.testing.assert_allclose(
                    moved(sand, model, data, (0, -0.1), 0.2)[:, 2], first, rtol=1e-9
                )


@needs_numba
def test_prints_in_a_world_that_is_turned_are_turned():
    """By quarters, of a box that tumbles through the side of a hill; in ground so steep that nothing slides."""
    box = '<body><freejoint/><geom type="box" size="0.05 0.03 0.02" mass="1e6"/></body>'
    rises, grounds = np.linspace(0.0, 1.0, 5) * np.ones((4, 1)), []
    hills = '<asset><hfield name="hills" nrow="4" ncol="5" size="1 1 0.4 0.1" elevation="{}"/></asset>'
    hills = hills.format(" ".join(map(str, rises.ravel())))
    for quarters in range(4):
        yaw = Rotation.from_euler("z", 90 * quarters, degrees=True)
        field = f'<geom name="hills" type="hfield" hfield="hills" pos="0 0 -0.2" euler="0 0 {90 * quarters}"/>'
        model = model_of(box + field, REMEMBERS.format(0.005), hills)
        data, (x, y, _) = mujoco.MjData(model), yaw.apply([0.35, -0.15, 0])
        data.qpos[:3], data.qvel[:3] = (
            yaw.apply([0.31, -0.17, 0.08]),
            yaw.apply([0.3, 0.2, -0.1]),
        )
        data.qpos[3:] = np.roll(
            (yaw * Rotation.from_rotvec([0.5, -0.3, 0.4])).as_quat(), 1
        )
        data.qvel[3:] = [3.0, -2.0, 4.0]
        prints = rft.mujoco.Footprints(
            0.01, *((0.5, 0.4) if quarters % 2 == 0 else (0.4, 0.5)), x, y, repose=1.5
        )
        with rft.mujoco.attach(
            model, MAP, geoms=[0], rounding=0.01, level="hills", footprints=prints
        ) as sand:
            undisturbed, known = sand.ground(data)[2], sand._bed.prints
            assert known.first.tolist() == [0, len(known.points)]
            mujoco.mj_step(model, data, 20)
            grounds.append(np.rot90(sand.ground(data)[2] - undisturbed, quarters))
    assert np.ptp(grounds[0]) > 0.03
    for ground in grounds[1:]:
        np.testing.assert_allclose(ground, grounds[0], rtol=0, atol=1e-13)


@needs_numba
def test_each_simulation_remembers_for_itself():
    """Data, copies, resets, rollouts and batches each have the ground of their own motion."""
    model = model_of(BALL, '<size nuserdata="9000"/>')
    prints = rft.mujoco.Footprints(0.01, 0.4, 0.4)
    with rft.mujoco.attach(model, MAP, rounding=0.02, footprints=prints) as sand:
        data, still = mujoco.MjData(model), mujoco.MjData(model)
        data.qvel[:] = start = [0.5, 0.2, 0, 0, 0, 0]
        mujoco.mj_step(model, data, 150)
        ground, grounds = sand.ground(data)[2], []
        copied = __import__("copy").copy(data)
        for _ in range(2):
            mujoco.mj_forward(model, copied)  # the second time it is the same step
            grounds.append(sand.ground(copied)[2])
        np.testing.assert_array_equal(*grounds)
        assert (
            np.ptp(ground) > 0.005
            and not sand.ground(still)[2].any()
            and not still.userdata.any()
        )
        still.userdata[:] = 1.0  # of another grid, or of something else
        mujoco.mj_step(model, still, 2)
        assert np.abs(sand.ground(still)[2]).max() < 0.05
        from mujoco import rollout

        mujoco.mj_resetData(model, copied)
        assert not sand.ground(copied)[2].any()
        copied.qvel[:] = start
        state = np.zeros(
            (2, mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
        )
        mujoco.mj_getState(model, copied, state[0], mujoco.mjtState.mjSTATE_FULLPHYSICS)
        state[1] = state[0]
        states, _ = rollout.rollout(
            model, [copied], state, nstep=150
        )  # both by the same data, one after the other
        np.testing.assert_array_equal(states[:, -1, 1:8], [data.qpos, data.qpos])
        if int(mujoco.__version__.partition(".")[0]) < 4:
            return
        for more in ({}, {"persistent": True}):
            batch = sand.batch(3, 2, media=[MAP, OTHER, MAP], **more)
            batch.bind("qvel")[:2] = start
            batch.step(nstep=150)
            np.testing.assert_allclose(
                batch.bind("qpos")[0], data.qpos, rtol=0, atol=1e-13
            )
            grounds = [
                sand.ground(np.array(numbers))[2] for numbers in batch.bind("userdata")
            ]
            np.testing.assert_allclose(grounds[0], ground, rtol=0, atol=1e-13)
            assert (
                np.abs(grounds[1] - ground).max() > 1e-4
                and np.abs(grounds[2] - ground).max() > 1e-4
            )
            batch.reset([0])
            assert (
                not sand.ground(batch.bind("userdata")[0])[2].any()
                and batch.bind("userdata")[1].any()
            )


def test_footprints_that_cannot_be_are_refused():
    model, prints = (
        model_of(BALL, '<size nuserdata="100"/>'),
        rft.mujoco.Footprints(0.01, 0.4, 0.4),
    )
    with (
        preferring("numpy"),
        pytest.raises(
            rft.Refusal,
            match=r"footprints need compiled code: pip install 'geomech\[fast\]'",
        ),
    ):
        rft.mujoco.attach(model, MAP, footprints=prints)
    with pytest.raises(
        rft.Refusal, match="footprints have 16000000 cells, more than 1000000"
    ):
        rft.mujoco.Footprints(0.001, 4, 4)
    with pytest.raises(rft.Refusal, match="spacing must be"):
        rft.mujoco.Footprints(0.0, 4, 4)
    with pytest.raises(rft.Refusal, match="footprints must be rft.mujoco.Footprints"):
        rft.mujoco.attach(model, MAP, footprints=0.01)
    with (
        rft.mujoco.attach(model, MAP) as sand,
        pytest.raises(rft.Refusal, match="the ground remembers nothing: give"),
    ):
        sand.ground(mujoco.MjData(model))
    if not backend.installed():
        return
    line = r"footprints need 8015 numbers of userdata, the model has 100: write <size nuserdata=\"8015\"/> in its MJCF"
    with pytest.raises(rft.Refusal, match=line):
        rft.mujoco.attach(model, MAP, footprints=prints)
    both = model_of(BALL + BALL.replace("ball", "other"), '<size nuserdata="9000"/>')
    line = "another sand under the model remembers: attach all geoms at once"
    with rft.mujoco.attach(both, MAP, geoms="ball", footprints=prints) as sand:
        with pytest.raises(rft.Refusal, match=line):
            rft.mujoco.attach(both, MAP, geoms="other", footprints=prints)
        with pytest.raises(
            rft.Refusal,
            match="data must be an MjData, or its userdata, 8015 numbers or more",
        ):
            sand.ground(np.zeros(5))


def test_forces_turn_and_mirror_with_the_motion():
    model = model_of(
        f'<body pos="0 0 0.01"><freejoint/><geom {GEOMS[0]}/><geom {GEOMS[1]} pos="0.03 0 0"/></body>',
        AT_ONCE,
    )
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
        np.testing.assert_allclose(
            turned, yaw.apply(plain), atol=1e-12 * np.abs(plain).max()
        )
        level, mirror = Rotation.from_euler("y", 0.3), np.array([1.0, -1.0, 1.0])
        one = wrench_at(level, *twist)
        other = wrench_at(level, twist[0] * mirror, -twist[1] * mirror)
        np.testing.assert_allclose(
            other, one * [mirror, -mirror], atol=1e-2 * np.abs(one).max()
        )


@pytest.mark.parametrize("integrator", ["Euler", "implicit", "implicitfast", "RK4"])
def test_a_body_falls_sinks_and_is_dragged_and_the_energy_goes_into_the_grains(
    integrator,
):
    """Change of energy = work of the grains, of the pull and of no one else, to the order of the steps."""
    model = model_of(
        BALL,
        f'<option timestep="2e-4" integrator="{integrator}"><flag energy="enable"/></option>',
    )
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
            work, lost = (
                work + 1e-4 * (v + data.qvel[0]),
                lost - 1e-4 * (before + power),
            )
        assert lost > 0.05 and data.energy.sum() - energy == pytest.approx(
            work - lost, abs=0.01 * lost
        )


def test_a_body_at_rest_creeps_as_its_sinkage_says():
    model = model_of(BALL, '<option timestep="2e-4"/>')
    data = mujoco.MjData(model)
    data.qpos[2] = 0.028
    with rft.mujoco.attach(model, SPATIAL, element=0.01, rounding=5e-3) as sand:
        mujoco.mj_forward(model, data)
        plastic, later = sand.sinkage(data, 0.5)
        data.qpos[2] -= plastic
        mujoco.mj_step(model, data, 2500)
        assert 1e-4 < plastic < later and 0.028 - data.qpos[2] == pytest.approx(
            later, abs=0.05 * (later - plastic)
        )
        mujoco.mj_forward(model, data)
        assert sand.sinkage(data, 0.0)[0] == pytest.approx(
            plastic - 0.028 + data.qpos[2], abs=1e-9
        )
    with rft.mujoco.attach(model, Spatial(1.0)) as sand:
        assert sand.sinkage(data) == (math.inf, math.inf)


FLOORED = """<geom name="floor" type="plane" size="1 1 1" {}/><geom name="rock" type="box" size=".1 .1 .1" pos="3 0 .1"/>
<body name="a" pos="0 0 0.01"><freejoint/><geom name="foot" type="box" size="0.05 0.04 0.02"/></body>
<body name="b" pos="3 0 0.215"><freejoint/><geom name="stone" type="sphere" size="0.02"/></body>
<body name="c" pos="1 0 0.015"><freejoint/><geom name="ball" type="sphere" size="0.02"/></body>"""


def touching(model):
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return sorted(
        tuple(sorted(model.geom(g).name for g in data.contact.geom[k]))
        for k in range(data.ncon)
    )


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
        assert (
            own_notes(sand) == [] and touching(model) == before
        )  # the floor is the bottom of a bed 5 mm deep
    first, second = (
        rft.mujoco.attach(model, MAP, geoms=name) for name in ("foot", "ball")
    )
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
        assert {*touching(model)} == {("rock", "stone")} and sand.geoms == (
            "foot",
            "stone",
            "ball",
        )


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
    more = (
        second.format("second", 9e-4, 0.05)
        + second.format("below", -2e-3, 0)
        + second.format("tilted", 0, 0.06)
    )
    model = model_of(FLOORED.format("") + more)
    with pytest.warns(
        Note,
        match="the geom no longer touches the floor 'floor' and 'second', which lies",
    ):
        sand = rft.mujoco.attach(model, MAP, geoms="foot")
    touched = touching(model)
    sand.detach()
    assert {x for x in touched if "foot" in x} == {
        ("below", "foot"),
        ("foot", "tilted"),
    }
    assert {x for x in touched if "ball" in x} == {
        ("ball", x) for x in ("floor", "second", "below", "tilted")
    }
    crowded = model_of(FLOORED.format('contype="2147483647"'))
    with pytest.raises(
        rft.Refusal,
        match="no bit is free to tell the floor from other geoms: use fewer contypes",
    ):
        rft.mujoco.attach(crowded, MAP)


def test_several_models_sands_and_threads_at_once():
    """Each as it is alone, to the last digit; a copy of a model has no sand."""
    models = [model_of(BALL.replace("0.03", size)) for size in ("0.03", "0.04")]
    both = model_of(
        BALL + BALL.replace("ball", "other").replace("0 0 0.01", "1 0 0.01")
    )

    def run(model):
        data = mujoco.MjData(model)
        data.qvel[:3] = 0.3
        mujoco.mj_step(model, data, 300)
        return data.qpos.copy()

    def attached(model, law, **more):
        with rft.mujoco.attach(model, law, rounding=0.02, **more):
            return run(model)

    alone = [attached(m, law) for m, law in zip(models, (SPATIAL, MAP))]
    sands = [
        rft.mujoco.attach(m, law, rounding=0.02)
        for m, law in zip(models, (SPATIAL, MAP))
    ]
    sands += [
        rft.mujoco.attach(both, law, geoms=g, rounding=0.02)
        for g, law in (("ball", SPATIAL), ("other", MAP))
    ]
    ends = [[] for _ in range(4)]
    threads = [
        threading.Thread(target=lambda k=k: ends[k].append(run(models[k % 2])))
        for k in range(4)
    ]
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

        start = np.zeros(
            (2, mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
        )
        mujoco.mj_getState(
            model, mujoco.MjData(model), start[0], mujoco.mjtState.mjSTATE_FULLPHYSICS
        )
        start[1] = start[0]
        states, _ = rollout.rollout(
            model, [mujoco.MjData(model) for _ in range(2)], start, nstep=200
        )
        np.testing.assert_array_equal(states[:, -1, 1:8], [data.qpos, data.qpos])
        if int(mujoco.__version__.partition(".")[0]) < 4:
            with pytest.raises(
                rft.Refusal, match=r"has no Batch: pip install 'mujoco>=4\.0'"
            ):
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
        assert [*sand.media] == [media[1], *media[1:]] and sand.media[1:] == media[1:]
        with pytest.raises(
            rft.Refusal, match="media must be 4, one for each simulation"
        ):
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


def test_simulations_have_media_by_region_of_their_own():
    model = model_of(BALL)
    if int(mujoco.__version__.partition(".")[0]) < 4:
        return
    with rft.mujoco.attach(
        model, MAP, rounding=0.2, regions={"x > 0.01": OTHER}
    ) as sand:
        with pytest.raises(
            rft.Refusal,
            match="media of a simulation must be 2, the medium and one for each region",
        ):
            sand.batch(2, media=[MAP, [MAP]])
        with pytest.raises(
            rft.Refusal, match="media of all regions must have one form"
        ):
            sand.batch(2, media=[MAP, SPATIAL])
        batch = sand.batch(2, 2, media=[MAP, (OTHER, MAP)])
        sand.media[0] = OTHER
        assert sand.media[:] == [(OTHER, OTHER), (OTHER, MAP)]
        batch.step(nstep=100)
        found = batch.bind("qpos").copy()
    for k, regions in enumerate(({}, {"x > 0.01": MAP})):
        with rft.mujoco.attach(model, OTHER, rounding=0.2, regions=regions):
            data = mujoco.MjData(model)
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
    beta, gamma = (
        x.ravel() for x in np.meshgrid(*[np.radians(np.arange(-75, 90, 30))] * 2)
    )
    noise = 0.02 * np.random.default_rng(1).normal(size=(2, beta.size))
    fit = fit_stress(beta, gamma, *(MAP(beta, gamma) + noise))
    drawn = rft.mujoco.sample(fit, 4000, seed=3)
    values = np.array([[getattr(x, name) for name in COEFFICIENTS] for x in drawn])
    np.testing.assert_allclose(
        np.cov(values.T), fit.covariance, atol=0.1 * fit.covariance.max()
    )
    assert isinstance(drawn[0], StressMap)
    for medium, more, message in (
        ("generic", {}, "the uncertainty of the medium is unknown: give spread"),
        (fit, {"spread": 0.1}, "a fit has its own covariance: drop spread"),
        ("sand", {"spread": 0.1}, "the medium has no strength to draw"),
        ("generic", {"spread": -1.0}, "spread must be"),
    ):
        with pytest.raises(rft.Refusal, match=message):
            rft.mujoco.sample(medium, 3, **more)


def test_a_callback_does_not_outlive_its_model(request):
    gc.disable()  # what comes after is in the youngest generation, the only one that need be looked through
    request.addfinalizer(gc.enable)
    model = model_of(BALL)
    sand = rft.mujoco.attach(model, MAP)
    assert sand.is_attached
    del model
    gc.collect(0)
    assert mujoco.get_mjcb_passive() is None and not sand.is_attached
    sand.detach()
    with pytest.raises(rft.Refusal, match="the sand is detached"):
        sand.batch(2)
    first, second = model_of(BALL), model_of(BALL)
    rft.mujoco.attach(first, MAP).detach()
    sand = rft.mujoco.attach(second, MAP)  # takes the place of the other in the table
    del first
    gc.collect(0)
    assert sand.is_attached
    sand.detach()


def test_a_fault_inside_the_callback_of_python_detaches_the_sand(monkeypatch):
    model = model_of(BALL)
    data = mujoco.MjData(model)
    with preferring("numpy"):
        sand = rft.mujoco.attach(model, MAP)
    monkeypatch.setattr("rft.mujoco.bed.Bed.frames", lambda *_: 1 / 0)
    with pytest.warns(Note, match="the sand is detached: ZeroDivisionError"):
        mujoco.mj_step(model, data)
    assert not sand.is_attached
    sand.detach()


def test_without_numba_a_line_says_how_much_slower_it_is():
    model = model_of(BALL)
    with (
        preferring("numpy"),
        pytest.warns(
            Note, match=r"by Python's callback, some \d+ times slower: pip install"
        ),
    ):
        rft.mujoco.attach(model, MAP).detach()


HFIELD = '<geom name="hills" type="plane" size="1 1 1"/>'
DRAGS = PlateDrags(*np.random.default_rng(1).uniform(-1.5, 1.5, (4, 200)))
REFUSED = {
    "geoms": ({"geoms": "bal"}, "the model has no geom 'bal': did you mean 'ball'"),
    "pattern": ({"geoms": ["ball", "leg*"]}, "the model has no geom 'leg"),
    "group": ({"geoms": 5}, r"no geom is in group 5: groups are \[0\]"),
    "none": ({"geoms": []}, "geoms`` names none|geoms names none"),
    "kind": ({"geoms": 1.5}, "must be|not iterable"),
    "plane": (
        {"geoms": "slab"},
        "the geom 'slab' is a plane and has no inside: give a sphere",
    ),
    "fixed": (
        {"geoms": "post"},
        "the geom 'post' is fixed to the world: name geoms that move",
    ),
    "medium": (
        {"medium": "poppy-seeds-lose"},
        "there is no medium 'poppy-seeds-lose': did you mean poppy-seeds-loose",
    ),
    "horizontal": (
        {"medium": "glass-0.3mm-loose"},
        "glass-0.3mm-loose has no vertical law: take one of generic",
    ),
    "law": (
        {"medium": rft.Granular(1.8, 0.2)},
        "the medium has no vertical law in three dimensions",
    ),
    "drags": (
        {"medium": DRAGS},
        "stress must be a StressMap, nine coefficients, .* fit some to plate drags",
    ),
    "zero": ({"element": 0.0}, "element must be"),
    "rounding": ({"rounding": 0.0}, "rounding must be"),
    "level": ({"level": math.nan}, "level must be"),
    "slope": ({"slope": 1.2}, "slides by itself"),
    "no effects": ({"effects": None}, "effects must be a list of effects .* got None"),
    "hulls": ({"hulls": "no"}, "hulls must be True or False, got 'no'"),
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
    assert mujoco.get_mjcb_passive() is None and np.array_equal(
        masks, model.geom_contype
    )


def test_what_changes_after_attach_is_refused():
    model = model_of(BALL)
    data = mujoco.MjData(model)
    with rft.mujoco.attach(model, MAP) as sand:
        with pytest.raises(rft.Refusal, match="a Sand cannot be pickled or copied"):
            pickle.dumps(sand)
        with pytest.raises(
            rft.Refusal, match="sand is attached to 'ball' already: detach it"
        ):
            rft.mujoco.attach(model, MAP)
        with pytest.raises(rft.Refusal, match="the model has no body 'zz'"):
            sand.wrench(data, "zz")
        with pytest.raises(rft.Refusal, match="the data are of another model"):
            sand.forces(mujoco.MjData(model_of(FLOORED.format(""))))
        model.geom_size[0, 0] = 0.05
        with pytest.raises(
            rft.Refusal, match="the geom 'ball' changed after attach: detach the sand"
        ):
            sand.power(data)
        mujoco.set_mjcb_passive(None)
        with pytest.raises(
            rft.Refusal, match="another passive callback took the place"
        ):
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
    paired = model_of(
        FLOORED.format(""), more='<contact><pair geom1="floor" geom2="foot"/></contact>'
    )
    with pytest.raises(
        rft.Refusal,
        match="a <pair> of <contact> makes 'floor' and 'foot' touch: drop it",
    ):
        rft.mujoco.attach(paired, MAP)


def test_a_name_is_the_stress_map_of_the_catalogue():
    assert (
        law_of("poppy-seeds-loose") == Extruded(VERTICAL["poppy-seeds-loose"].stress)
        and law_of(SPATIAL) == SPATIAL
    )
    block = model_of('<body><freejoint/><geom type="box" size="0.1 0.1 0.1"/></body>')
    with pytest.raises(
        rft.Refusal,
        match=r"^the geom 0, of a body without name in group 0: the geom has 480000 elements, .*: make element longer",
    ):
        rft.mujoco.attach(block, MAP, element=1e-3)


def test_a_gait_for_sand_is_searched_for(tmp_path):
    """A few short walks: the best never gets worse, and what is drawn is what was found."""
    if int(mujoco.__version__.partition(".")[0]) < 4:
        pytest.skip("needs mujoco.batch")
    from figures.robots import sand_gaits

    numbers = sand_gaits.compute(2, 4, 0.6)
    for speeds in numbers["best_speeds"].values():
        assert speeds[1] >= speeds[0] > -1.0
    assert (
        numbers["speeds"].shape == (2, 2)
        and len(numbers["strip"]) == sand_gaits.SNAPSHOTS
    )
    assert numbers["speeds"][0, 0] == pytest.approx(
        numbers["best_speeds"]["sand"][-1], abs=1e-12
    )
    figure = drawn(sand_gaits, numbers, tmp_path)
    assert [bar.get_height() for bar in figure.axes[1].patches] == [
        *numbers["speeds"][0],
        *numbers["speeds"][1],
    ]
    assert "for sand" in sand_gaits.table(numbers)


@pytest.mark.parametrize(
    ("missing", "module", "name", "message"),
    [
        (
            "mujoco",
            "rft.mujoco",
            "sand",
            r"rft.mujoco needs MuJoCo: pip install 'geomech\[mujoco\]'",
        ),
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
