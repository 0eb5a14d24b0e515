"""The engine of three dimensions: loads against independent sums, momentum, energy, order, the planar engine; MJCF files."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from geomech import scene as scenes
from rft.spatial import Cylinder, Screw, Spatial, Sphere, below, shapes, wrench
from rft.spatial.extruded import Extruded
from rft.spatial.submerged import submerged
from rft.vertical import CLeg, Polygon, RoundRod, StressMap
from rft.vertical.effects import Aeration, GrainInertia
from rft.vertical.loads import _loads
from rft.walking import Fineness, Rhex, Roller, Tripod, Walker
from rft.walking.facets import Facets, Grains, Poses, Surface
from rft.walking.ground import Ground, Outlines
from rft.walking.planar_walk import walk as planar_walk

mujoco = pytest.importorskip("mujoco", reason="needs the extra: pip install 'geomech[mujoco]'")
from rft.walking import geoms, hexapod  # noqa: E402
from rft.walking.mujoco_walk import Course, Start, again, walk  # noqa: E402
from rft.walking.multibody import Multibody  # noqa: E402

SAND = StressMap(zeta=0.3, grazing=math.radians(5))
SPATIAL = Spatial(3e5, surface_friction=0.6)
QUICK = Fineness(steps=12, elements=6, duration=1.0)
XPLORER = scenes.load("xplorer")
RNG = np.random.default_rng(5)


def unit(shape):
    x = RNG.normal(size=shape)
    return x / np.linalg.norm(x, axis=0)


def test_what_of_a_triangle_is_below_is_what_cutting_it_leaves():
    corners = RNG.uniform(-1, 1, (500, 3, 3))
    share, middle, moments = submerged(corners[..., 2].T)
    parts, of = below(corners, corners[..., 2])
    area = lambda p: np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=-1) / 2
    whole, each, depth = area(corners), area(parts), -parts[..., 2]
    sums = lambda x: np.stack([np.bincount(of, y, len(corners)) for y in x.T], -1)
    np.testing.assert_allclose(share * whole, sums(each[:, None])[:, 0], atol=1e-14)
    first = sums(each[:, None] * parts.mean(1))
    np.testing.assert_allclose(np.einsum("in,nij->nj", middle, corners) * (share * whole)[:, None], first, atol=1e-14)
    arms = (np.einsum("pi,pij->pj", depth, parts) + 3 * depth.sum(1)[:, None] * parts.mean(1)) * (each / 12)[:, None]
    np.testing.assert_allclose(np.einsum("in,nij->nj", moments, corners) * whole[:, None], sums(arms), atol=1e-14)


@pytest.mark.parametrize("tension", ["keep", "cut"])
def test_a_stress_map_of_three_dimensions_is_the_planar_one_in_every_vertical_plane(tension):
    stress = StressMap(A00=0.2, D10=0.05, zeta=0.7, tension=tension)
    (b, g), turn = RNG.uniform(-np.pi, np.pi, (2, 300)), RNG.uniform(0, 2 * np.pi, 300)
    n, v = np.array([np.sin(b), -np.cos(b)]), np.array([np.cos(g), -np.sin(g)])
    raised = lambda a: np.array([a[0] * np.cos(turn), a[0] * np.sin(turn), a[1]])
    found, wanted = Extruded(stress).traction(raised(n), raised(v)), raised(stress.traction(n, v))
    kept = raised(dataclasses.replace(stress, tension="keep").traction(n, v))
    clear = np.abs((kept * raised(n)).sum(0) * (n * v).sum(0)) > 0.026 * np.linalg.norm(kept, axis=0)  # of the cut
    clear |= tension == "keep"
    assert clear.sum() > 200
    np.testing.assert_allclose(found[:, clear], wanted[:, clear], atol=1e-9 * np.abs(found).max())
    n, v = unit((3, 200)), unit((3, 200))
    np.testing.assert_allclose(Extruded(stress).traction(-n, v), Extruded(stress).traction(n, v), rtol=1e-12)
    upright, along = np.array([[0.6], [0.8], [0.0]]), np.array([[-0.8], [0.6], [0.0]])
    np.testing.assert_allclose(Extruded(stress).traction(upright, along)[:2], 0.0, atol=1e-9)


def poses(count):
    turn = Rotation.random(count, random_state=3).as_matrix()
    return Poses(turn, RNG.normal(size=(count, 3)) * 0.01, RNG.normal(size=(count, 3)), 5 * RNG.normal(size=(count, 3)))


def test_loads_are_those_of_each_mesh_alone():
    """Of two geoms on one body and one on another, against the sums of `rft.spatial.wrench` about the bodies' origins."""
    meshes = [Sphere(0.02).mesh(80), Screw(0.03, 0.02, 0.05, 0.1).mesh(600), Cylinder(0.02, 0.05).mesh(200)]
    turn, place = Rotation.from_euler("xyz", [0.3, -1.1, 0.7]).as_matrix(), np.array([0.02, -0.01, 0.015])
    at = poses(2)
    parts = [(0, meshes[0], np.eye(3), np.zeros(3)), (0, meshes[1], turn, place), (1, meshes[2], turn.T, -place)]
    facets = Facets([Surface.of_mesh(b + 4, m, r, p) for b, m, r, p in parts])
    found, _ = facets.loads(Grains(SPATIAL, 0.7, rounding=1e-7), at)
    wanted = np.zeros((2, 6))
    for b, mesh, r, p in parts:
        arm = at.rotation[b] @ p
        velocity = at.velocity[b] + np.cross(at.spin[b], arm)
        one = wrench(SPATIAL, mesh, at.rotation[b] @ r, at.place[b] + arm, velocity, at.spin[b])
        wanted[b] += 0.7 * np.concatenate([one.force, one.moment + np.cross(arm, one.force)])
    assert list(facets.bodies) == [4, 5] and np.abs(wanted).min() > 1e-4
    np.testing.assert_allclose(found, wanted, rtol=2e-3, atol=3e-3 * np.abs(wanted).max())


@pytest.mark.parametrize(
    "shape", [CLeg(0.03, 0.02, 0.6), RoundRod(0.03, 0.02), Polygon(((0, 0), (0.05, 0), (0.01, 0.04)), 0.03)]
)
def test_loads_on_outlines_in_their_plane_are_those_of_the_plane(shape):
    outline = shape.outline(96)
    angle, place, motion = 0.7, np.array([0.01, 0.002, -0.01]), np.array([0.3, -0.2, 4.0])
    at = Poses(
        Rotation.from_euler("y", angle).as_matrix()[None],
        place[None],
        np.array([[0.3, 0.0, -0.2]]),
        np.array([[0, 4.0, 0]]),
    )
    facets = Facets([Surface.of_outline(0, outline)])
    found = facets.loads(Grains(Extruded(SAND), 1.0, 2000.0, 1e-7), at)[0][0]
    ground = Ground(SAND, *np.array([1.0, 2000.0, 1e-7])[:, None, None], outline.closed)
    force, moment = _loads(ground, Outlines.of([outline]), np.array([[place[0], place[2], angle]]), motion[None])
    np.testing.assert_allclose(found[[0, 2]], force[0], rtol=3e-3, atol=2e-4 * np.abs(force).max())
    assert found[4] == pytest.approx(moment[0], abs=6e-5 * np.abs(force).max())
    np.testing.assert_allclose(found[[1, 3, 5]], 0.0, atol=1e-9)


def test_what_moves_aside_is_held_back():
    """A box that turns and drifts to its left feels a force to its right; grains never drive."""
    facets = Facets([Surface.of_mesh(0, shapes.box((0.1, 0.05, 0.03), 3))])
    for law in (SPATIAL, Extruded(SAND)):
        for grains in (Grains(law), Grains(law, flux=500.0)):
            at = Poses(np.eye(3)[None], np.array([[0, 0, -0.005]]), np.array([[0, 0.4, 0]]), np.zeros((1, 3)))
            assert facets.loads(grains, at)[0][0, 1] < -0.01
            at = at._replace(spin=np.array([[0, 0, 3.0]]), velocity=np.zeros((1, 3)))
            assert facets.loads(grains, at)[0][0, 5] < -1e-4


def test_slopes_of_loads_are_what_moving_a_body_changes():
    facets, k = (
        Facets([Surface.of_mesh(0, Sphere(0.02).mesh(320)), Surface.of_outline(1, CLeg(0.03, 0.02).outline(12))]),
        0.002,
    )
    at, grains = poses(2), Grains(Extruded(SAND), 0.8, 200.0, 0.3)
    _, slopes = facets.loads(grains, at, k)
    for j in range(6):
        change = []
        for side in (1e-4, -1e-4):
            dv, dw = (side * np.eye(3)[j % 3] * (j // 3 == part) for part in (0, 1))
            turn = Rotation.from_rotvec(k * dw).as_matrix() @ at.rotation
            moved = Poses(turn, at.place + k * dv, at.velocity + dv, at.spin + dw)
            change.append(facets.loads(grains, moved)[0])
        wanted = (change[0] - change[1]) / 2e-4
        np.testing.assert_allclose(slopes[:, :, j], wanted, atol=0.02 * np.abs(wanted).max())


TILTED = """<mujoco><option gravity="0 0 -9.81"/><worldbody><body name="a" pos="0 0 0.01" euler="20 30 40"><freejoint/>
<inertial pos="0.02 -0.01 0.015" mass="0.3" diaginertia="3e-4 2e-4 4e-4" euler="10 50 0"/>
<geom name="g" type="ellipsoid" size="0.03 0.02 0.04" pos="0.01 0.005 -0.02" euler="0 0 70" contype="0" conaffinity="0"/>
</body></worldbody></mujoco>"""


def test_momenta_change_by_the_forces_and_moments_of_grains_and_weight():
    """Of a body whose centre of mass, origin and geom are three places with three frames, that tumbles; against the wrench of
    the geom's mesh by itself."""
    model = mujoco.MjModel.from_xml_string(TILTED)
    mesh = geoms.mesh_of(model, 0, 24)
    body = Multibody(model, geoms.named(model, {"g": mesh}), Grains(SPATIAL, rounding=1e-5))
    data = body.data
    data.qvel[:] = [0.4, 0.2, -0.5, 3.0, -4.0, 2.0]

    def momenta():
        mujoco.mj_forward(model, data)
        mujoco.mj_subtreeVel(model, data)
        return np.concatenate([0.3 * data.subtree_linvel[0], data.subtree_angmom[0]])

    before, h = momenta(), 1e-5
    turn, place, com = data.geom_xmat[0].reshape(3, 3).copy(), data.geom_xpos[0].copy(), data.xipos[1].copy()
    motion = np.zeros(6)
    mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_GEOM, 0, motion, 0)
    one = wrench(SPATIAL, mesh, turn, place, motion[3:], motion[:3])
    body.step(h)
    wanted = [one.force + [0, 0, -0.3 * 9.81], one.moment + np.cross(place - com, one.force)]
    assert np.abs(wanted).min() > 1e-3
    np.testing.assert_allclose((momenta() - before) / h, np.concatenate(wanted), rtol=0.02, atol=2e-3)


def test_what_falls_free_falls_as_galilei_says():
    model = mujoco.MjModel.from_xml_string(TILTED)
    body = Multibody(model, geoms.named(model, {"g": geoms.mesh_of(model, 0, 12)}), Grains(SPATIAL))
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
    np.testing.assert_allclose(data.xipos[1], com + 0.2 * start + [0, 0, -9.81 * 0.02], atol=1e-4)
    np.testing.assert_allclose(data.subtree_angmom[0], spin, atol=1e-4 * np.linalg.norm(spin))
    assert body.energy() == pytest.approx(energy, rel=1e-4) and (body.work, body.loss) == (0.0, 0.0)


PENDULUM = """<mujoco><option gravity="0 0 -9.81"/><worldbody><body pos="0 0 5"><joint name="j" axis="0 1 0" stiffness="0.4"
damping="0.02"/><geom name="g" type="sphere" size="0.05" pos="0.2 0 0" mass="0.3"/></body></worldbody></mujoco>"""


def test_springs_keep_energy_and_dampers_take_it():
    """To the second order of the steps, which make no difference to what a halved step does."""
    model, left = mujoco.MjModel.from_xml_string(PENDULUM), []
    for steps in (20, 40):
        body = Multibody(model, geoms.named(model, {"g": geoms.mesh_of(model, 0, 8)}), Grains(SPATIAL))
        body.data.qpos[0], body.data.qvel[0] = 0.3, 2.0
        first = body.energy()
        for _ in range(steps):
            body.step(0.25 / steps)
        left.append(abs(body.loss + body.energy() - first) / body.loss)
        assert body.work == 0.0 and body.loss > 0.02
    assert left[1] < 1e-4 and left[0] / left[1] > 3.5
    ends = []
    for fails in (0, 1):
        body = Multibody(model, geoms.named(model, {"g": geoms.mesh_of(model, 0, 8)}), Grains(SPATIAL))
        body.data.qvel[0], solved, tried = 2.0, body._step, iter([fails, 0, 0])
        body._step = lambda *args: solved(*args) and not next(tried)
        for h in (0.04,) if fails else (0.02, 0.02):
            body.step(h)
        ends.append([body.data.qpos[0], body.data.qvel[0], body.data.time, body.loss])
    np.testing.assert_allclose(ends[0], ends[1], rtol=1e-12)


def test_steps_are_of_order_two_and_energy_is_kept_to_that():
    """Xplorer in its plane at 4 Hz, after its fall: motors' work = losses + change of energy."""
    walker = dataclasses.replace(XPLORER.walker, gait=Tripod(4.0))
    first = Course(walker, dataclasses.replace(QUICK, steps=48), planar=True).walk(1).limit
    run = lambda steps: Course(walker, dataclasses.replace(QUICK, steps=steps), planar=True).walk(1, start=first)
    finest, errors, audits = run(160), [], []
    for steps in (12, 24, 48):
        w = run(steps)
        errors.append(np.abs(w.pose[-1] - finest.pose[-1]).max() / np.abs(finest.pose).max())
        audits.append(abs((w.work - w.loss - w.energy)[-1] + w.energy[0]) / w.work[-1])
        assert w.unsolved == 0
    for values in (errors, audits):
        assert -np.polyfit(np.log([12, 24, 48]), np.log(values), 1)[0] > 1.5, values
    assert errors[-1] < 4e-3 and audits[-1] < 2e-3


@pytest.mark.parametrize(("name", "frequency"), [("xplorer", 3.0), ("sandbot", 0.6366)])
def test_speeds_are_those_of_the_planar_engine(name, frequency):
    """Within 3 %, of a robot that may roll, yaw and drift, and within 2.5 % of one that keeps to the plane."""
    scene = scenes.load(name)
    effects = (Aeration(0.03, 0.25),) if name == "sandbot" else ()
    gait = dataclasses.replace(scene.gait, frequency=frequency)
    walker = dataclasses.replace(scene.walker, gait=gait, effects=effects)
    finely = dataclasses.replace(QUICK, steps=12, elements=12)
    wanted = planar_walk([walker], finely, 2)[0]
    free = walk([walker], finely, 2)[0]
    assert free.status == wanted.status == "walking" and free.speed == pytest.approx(wanted.speed, rel=0.03)
    assert np.abs(free.more["roll"]).max() < 0.06 and np.abs(free.more["yaw"]).max() < 0.06
    if name != "xplorer":
        return
    assert free.pose[:, 2].min() == pytest.approx(wanted.pose[:, 2].min(), abs=0.02)  # nose up, by ten degrees
    assert free.twist[:, 2].max() == pytest.approx(wanted.twist[:, 2].max(), rel=0.2)
    kept = Course(walker, finely, planar=True).walk(8)
    assert kept.speed == pytest.approx(wanted.speed, rel=0.025)
    assert np.abs(kept.more["roll"]).max() < 1e-12


def test_a_robot_and_its_mirror_image_walk_as_mirror_images():
    """Legs swapped from left to right, by half a cycle; hips so near that they roll and yaw."""
    robot = Rhex(0.15, 0.13, 0.03, 0.05, CLeg(0.0205, 0.01), (-0.05, 0.04), aside=(0.03, 0.04))
    right, left = (
        Course(Walker(robot, Tripod(2.0, 0.5, math.pi, m), SAND, (GrainInertia(0.5, 300.0),)), QUICK)
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


def test_legs_alternate_as_in_the_plane():
    robot = XPLORER.robot
    legs = dict(zip(map(tuple, np.sign(hexapod.hips(robot)).astype(int).tolist()), hexapod.phases(robot)))
    assert {k for k, phase in legs.items() if phase} == {(-1, -1, 0), (0, 1, 0), (1, -1, 0)}
    out = np.array([(-1) ** k * y for k, y in enumerate(robot.sides)])
    assert out.sum() == pytest.approx(0.0) and robot.sides.min() == pytest.approx(0.03)
    assert hexapod.mjcf(robot).count('type="hinge"') == 6


def test_every_end_has_its_status_and_no_nan():
    still = dataclasses.replace(XPLORER.robot, hip_height=0.08)
    long = dataclasses.replace(XPLORER.robot, hips=(-0.06,), legs=CLeg(0.05, 0.01))
    cases = {
        "sunk": Walker(XPLORER.robot, Tripod(2.0), StressMap(zeta=0.005)),
        "stuck": Walker(still, Tripod(4.0), XPLORER.medium),
        "flipped": Walker(long, Tripod(4.0), XPLORER.medium),
        "walking": Walker(Roller(2.0, RoundRod(0.1, 0.1), axle=0.02), Tripod(1.0), XPLORER.medium),
    }
    for status, walker in cases.items():
        found = walk([walker], QUICK, 1)[0]
        assert found.status == status
        for values in (*found[:7], found.drift, *found.more.values()):
            assert np.isfinite(values).all(), status
        more = again([walker], dataclasses.replace(QUICK, steps=8), [found], 1)[0]
        assert math.isfinite(more.speed)
    thrown = Course(cases["stuck"], QUICK)
    start = Start(thrown.body.data.qpos, np.array([1.0, 0.0, 3.0, *np.zeros(9)]))
    found = thrown.walk(3, start=start)
    assert found.status == "airborne" and found.limit is None and found.speed == pytest.approx(1.0, rel=1e-3)


def test_the_figure_compares_steps_and_engines(monkeypatch):
    from figures import walking_mujoco

    coarse = dataclasses.replace(XPLORER, numerics=dataclasses.replace(QUICK, elements=4))
    monkeypatch.setattr(walking_mujoco, "load", lambda name: coarse)
    monkeypatch.setattr(walking_mujoco, "SETTLED", 1)
    numbers = walking_mujoco.compute({"implicit": (12,), "held": (12,)}, 24, {"xplorer": ()})
    (_, implicit), (_, held) = numbers["steps"].values()
    assert implicit.max() < 0.2 < held[0]
    numbers["speeds"]["xplorer"] = (1.0, 2.0), np.array([0.1, 0.2]), np.array([0.1, 0.202])
    assert walking_mujoco.draw(numbers).axes[0].get_ylabel() == "error of the way"
