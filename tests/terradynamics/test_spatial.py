"""Three-dimensional resistive force theory on meshes, against the published law, closed
forms and finer meshes."""

import numpy as np
import pytest
from refusals import refuses
from scipy.spatial.transform import Rotation

from rft.terradynamics.meshes import Mesh, Spatial, Sphere, bearing, wrench
from rft.terradynamics.meshes.forces import law
from rft.terradynamics.meshes.surfaces import shapes
from rft.terradynamics.meshes.surfaces.mesh import quartered_mesh
from rft.terradynamics.meshes.surfaces.smooth import smooth

pytestmark = pytest.mark.usefixtures("fastest")

RNG = np.random.default_rng(7)
MEDIUM = Spatial(xi_n=3e5, surface_friction=0.3)
UPRIGHT = np.eye(3)
STILL = np.zeros(3)


def directions(count):
    v = RNG.normal(size=(count, 3))
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def force(mesh, height=-0.1, velocity=STILL, spin=STILL, medium=MEDIUM):
    """Return the force on an upright mesh."""
    return wrench(medium, mesh, UPRIGHT, [0, 0, height], velocity, spin).force


@pytest.mark.parametrize(
    ("angles", "expected"),
    [
        ((0, 90, 0), (0, 0, 0.875)),
        ((0, -90, 0), (0, 0, -0.080)),
        ((90, 0, 0), (-0.192, 0, 0.075)),
        ((45, 45, 0), (-0.342, 0, 0.583)),
    ],
)
def test_alpha_at_plain_angles(angles, expected):
    assert law.alpha_of_angles(*np.radians(angles)) == pytest.approx(expected, abs=5e-4)


def test_alpha_is_the_published_sum_of_terms():
    """By angles and along r, theta, z, as in the source, over all three."""
    beta, gamma, psi = RNG.uniform(-np.pi / 2, np.pi / 2, (3, 200))
    x1 = np.sin(gamma)
    x2 = np.cos(beta)
    x3 = np.cos(psi) * np.cos(gamma) * np.sin(beta) + np.sin(gamma) * np.cos(beta)
    powers = [
        (0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (2, 0, 0), (0, 2, 0), (0, 0, 2),
        (1, 1, 0), (0, 1, 1), (1, 0, 1), (3, 0, 0), (0, 3, 0), (0, 0, 3), (1, 2, 0),
        (2, 1, 0), (0, 1, 2), (0, 2, 1), (2, 0, 1), (1, 0, 2), (1, 1, 1),
    ]  # fmt: skip
    terms = np.array([x1**i * x2**j * x3**k for i, j, k in powers])
    f1, f2, f3 = law.COEFFICIENTS @ terms
    expected = np.stack([
        f1 * np.sin(beta) * np.cos(psi) + f2 * np.cos(gamma),
        f1 * np.sin(beta) * np.sin(psi),
        -f1 * np.cos(beta) - f2 * np.sin(gamma) - f3,
    ], -1)  # fmt: skip
    assert law.alpha_of_angles(beta, gamma, psi) == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize("tension", law.TENSION)
def test_stress_turns_about_the_vertical_and_is_mirrored(tension):
    n = directions(500)
    v = directions(500)
    medium = Spatial(2.0, 0.35, tension)
    stress = medium.stress(n, v)
    assert np.abs(stress).max() > 0.1
    turn = Rotation.from_rotvec([0, 0, 1.234]).as_matrix()
    for moved in (turn, np.diag([1.0, -1.0, 1.0])):
        found = medium.stress(n @ moved.T, v @ moved.T)
        assert found == pytest.approx(stress @ moved.T, abs=1e-13)
    # It is independent of speed.
    assert medium.stress(n, 7.0 * v) == pytest.approx(stress, abs=1e-13)


def test_stress_grows_over_the_grazing_angle():
    """From nothing where the velocity lies in the face to the fitted law beyond the
    angle, without a jump."""
    angle = np.radians([-1, 0, 1e-6, 1.0, 2.0, 3.9, 4.0, 4.1, 50])[:, None]
    n = np.array([0.3, -0.4, -np.sqrt(0.75)])
    along = np.cross(n, [1.0, 0.2, 0.1])
    v = np.cos(angle) * along / np.linalg.norm(along) + np.sin(angle) * n
    sharp = Spatial(1.0, 0.4, grazing=0.0).stress(n, v)
    soft = Spatial(1.0, 0.4, grazing=np.radians(4.0)).stress(n, v)
    share = np.clip(np.sin(angle) / np.sin(np.radians(4.0)), 0, 1)
    assert soft == pytest.approx(sharp * share**2 * (3 - 2 * share), abs=1e-15)
    assert np.abs(soft[2]).max() < 1e-9 < 1e-3 < np.abs(sharp[2]).max()


def test_faces_that_are_pulled_keep_push_or_lose_the_stress():
    n = directions(20_000)
    v = directions(20_000)
    n *= np.where((n * v).sum(-1) < 0, -1, 1)[:, None]
    across = {}
    for tension in law.TENSION:
        stress = Spatial(1.0, 0.3, tension, grazing=0.0).stress(n, v)
        across[tension] = (stress * n).sum(-1)
        along = np.linalg.norm(stress - across[tension][:, None] * n, axis=-1)
        assert (along <= 0.3 * np.abs(across[tension]) + 1e-15).all()
        assert along.max() > 0.1
    kept = across["keep"]
    pulled = kept > 0
    assert pulled.mean() == pytest.approx(0.0487, abs=0.005)
    assert across["push"] == pytest.approx(-np.abs(kept))
    assert across["cut"] == pytest.approx(np.where(pulled, 0.0, kept))


def test_strength_from_density_and_friction():
    strength = 3000 * 9.81 * (894 * 0.064 - 386 * 0.16 + 89 * 0.4)
    assert Spatial.from_grains(3000.0, 0.4).xi_n == pytest.approx(strength)


TURN = Rotation.random(random_state=11).as_matrix()
PLACE = np.array([0.3, -0.2, -0.01])
VELOCITY = np.array([-0.4, 0.7, -1.1])
SPIN = np.array([0.9, -1.2, 0.5])


def test_force_and_moment_are_the_sum_over_faces():
    """In the world's axes; each cut into so many that stress is even over them."""
    mesh = shapes.leg(0.03, 0.8, 0.006, 0.02, along=12, across=3, thick=1)
    fine = quartered_mesh(quartered_mesh(quartered_mesh(mesh)))
    # Without spin the stress per depth is even over every face.
    pose = (TURN, PLACE, VELOCITY, STILL)
    found = wrench(MEDIUM, mesh, *pose)
    exact = bearing(MEDIUM, fine, *pose)
    assert found.force == pytest.approx(exact.force.sum(0), rel=1e-12)
    assert found.power == pytest.approx((exact.force @ VELOCITY).sum())
    moment = np.cross(exact.middle - PLACE, exact.force).sum(0)
    assert found.moment == pytest.approx(moment, rel=5e-3)


@pytest.mark.parametrize(("across", "thick"), [(1, 1), (2, 3)])
def test_a_leg_has_one_surface_however_it_is_divided(across, thick):
    mesh = shapes.leg(0.03, 0.8, 0.006, 0.02, along=12, across=across, thick=thick)
    expected = shapes.leg(0.03, 0.8, 0.006, 0.02, along=12, across=3, thick=1)
    assert (mesh.areas > 0).all()
    assert mesh.areas.sum() == pytest.approx(expected.areas.sum(), rel=1e-12)
    assert mesh.volume == pytest.approx(expected.volume, rel=1e-12)


def test_turned_poses_turn_the_wrench_and_batches_agree():
    mesh = shapes.screw(0.03, 0.015, 0.05, 0.2, 24, 40, 2)
    pose = (TURN, PLACE, VELOCITY, SPIN)
    one = wrench(MEDIUM, mesh, *pose)
    yaw = Rotation.from_euler("z", np.linspace(0, 5, 6)[:, None]).as_matrix()
    turned = wrench(MEDIUM, mesh, *(yaw @ x for x in pose))
    assert turned.force == pytest.approx(yaw @ one.force, rel=1e-9)
    assert turned.moment == pytest.approx(yaw @ one.moment, rel=1e-9)
    assert turned.power == pytest.approx(np.full(6, one.power), rel=1e-9)


def refined(what, k):
    if what == "sphere":
        return shapes.sphere(0.02, k)
    return shapes.cylinder(0.02, 0.06, 6 * 2**k, 4 * 2**k, 2**k)


@pytest.mark.parametrize("velocity", [(0.1, 0.0, 0.0), (0.03, 0.05, -0.1)])
@pytest.mark.parametrize("depth", [0.1, 0.004])
@pytest.mark.parametrize("what", ["sphere", "cylinder"])
def test_drag_converges_with_the_mesh(what, depth, velocity):
    """Of order two in the limit."""
    forces = [
        force(refined(what, k), -depth, velocity, [2.0, -1.0, 3.0])
        for k in (1, 2, 3, 5)
    ]
    truth = forces.pop()
    errors = np.linalg.norm(forces - truth, axis=1) / np.linalg.norm(truth)
    assert errors[-1] < 1e-2
    assert np.log2(errors[0] / errors[-1]) / 2 > 1.6


SQUARE = np.array([(0, -1, -1), (0, 1, -1), (0, 1, 1), (0, -1, 1)]) * 0.02
HALVES = np.array([(0, 1, 2), (0, 2, 3)])


@pytest.mark.parametrize("height", [-0.1, -0.012, 0.003, 0.019])
def test_a_box_that_floats_is_cut_at_its_waterline(height):
    """Drag on the leading side of a cube, deep and half out: integrals of depth."""
    side = 0.04
    mesh = Mesh(SQUARE + [side / 2, 0, 0], HALVES, closed=False)
    low = height - side / 2
    top = min(height + side / 2, 0.0)
    stress = MEDIUM.stress([1.0, 0, 0], [1.0, 0, 0])
    found = wrench(MEDIUM, mesh, UPRIGHT, [0, 0, height], [0.2, 0, 0], STILL)
    first = side * (low**2 - top**2) / 2
    second = side * (top**3 - low**3) / 3
    assert found.force == pytest.approx(stress * first, rel=1e-12)
    arm = [side / 2 * first, 0, -second - height * first]
    assert found.moment == pytest.approx(np.cross(arm, stress), rel=1e-9, abs=1e-15)
    assert found.area == pytest.approx(side * (top - low))


def test_an_open_plate_bears_on_the_side_that_leads():
    plate = Mesh(SQUARE, HALVES, closed=False)
    assert not force(plate, velocity=[-1, 0, 0]).any()
    there = force(plate.two_sided, velocity=[1, 0, 0])
    back = force(plate.two_sided, velocity=[-1, 0, 0])
    assert there == pytest.approx(back * [-1, 1, 1])
    assert there[0] < 0


LEG_VOLUME = 0.038 * 0.003 * 0.01


@pytest.mark.parametrize(
    ("mesh", "volume"),
    [
        (shapes.sphere(0.02, 5), 4 / 3 * np.pi * 0.02**3),
        (shapes.cylinder(0.01, 0.06, 256, 3, 2), np.pi * 0.01**2 * 0.06),
        (shapes.leg(0.019, 1.0, 0.003, 0.01, 256), np.pi / 2 * LEG_VOLUME),
        (shapes.leg(0.019, -1.0, 0.003, 0.01, 256), np.pi / 2 * LEG_VOLUME),
        (shapes.leg(0.019, 0.0, 0.003, 0.01), LEG_VOLUME),
        (shapes.leg(0.019, 0.5, 0.003, 0.01, 256), 2 * np.arcsin(0.5) * LEG_VOLUME),
    ],
)
def test_shapes_have_their_volume(mesh, volume):
    assert mesh.volume == pytest.approx(volume, rel=1e-3)
    assert mesh.areas @ mesh.normals == pytest.approx(np.zeros(3), abs=1e-15)


CUBE = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * 0.01
SIDES = np.array([
    (0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7),
    (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3),
])  # fmt: skip
TURNED = np.concatenate([SIDES[:-1], SIDES[-1:, ::-1]])
DOUBLED = np.concatenate([SIDES, SIDES[:1]])
WITHIN = np.concatenate([CUBE, CUBE / 2 + 0.002])
HOLLOW = np.concatenate([SIDES, SIDES[:, ::-1] + len(CUBE)])
LINE = np.concatenate([SIDES[:-1], [(1, 1, 3)]])
BALL = shapes.sphere(0.02, 1)
REFUSED = [
    (
        lambda: Mesh(CUBE, SIDES[:-1]),
        "open 3 edges | because instead",
    ),
    (lambda: Mesh(CUBE, SIDES[:, ::-1]), "normals | because instead"),
    (lambda: Mesh(CUBE, TURNED), "two edge | because instead"),
    (lambda: Mesh(CUBE, DOUBLED), "duplicated | because instead"),
    (lambda: Mesh(WITHIN, HOLLOW), "shell | because instead"),
    (lambda: Mesh(CUBE, LINE), "1 of 12 area | instead"),
    (lambda: Mesh(CUBE * np.nan, SIDES), "finite"),
    (lambda: Mesh(CUBE[:-1], SIDES), "vertex 7 0 6 | instead"),
    (
        lambda: wrench(MEDIUM, BALL, (1 + 0.8e-9) * UPRIGHT, STILL, STILL, STILL),
        "rotation matrices | because",
    ),
    (
        lambda: wrench(MEDIUM, BALL, -UPRIGHT, STILL, STILL, STILL),
        "rotation matrices | because",
    ),
    (lambda: Spatial.from_grains(3000, 30.0), "friction 0.05 1.5 30.0 | value"),
    (lambda: shapes.leg(0.02, 1.0, 0.03, 0.01), "thickness 0.03 0.02"),
]


@pytest.mark.parametrize(("build", "said"), REFUSED, ids=[said for _, said in REFUSED])
def test_what_makes_no_sense_is_refused(build, said):
    with refuses(said):
        build()


@pytest.mark.parametrize(
    ("ball", "off"),
    [(Sphere(0.02).mesh(300), 1e-15), (smooth(shapes.sphere(0.02, 2)), 4e-3)],
)
def test_smooth_spheres_have_radial_normals(ball, off):
    radial = ball.middles / np.linalg.norm(ball.middles, axis=-1, keepdims=True)
    error = np.abs(ball.middle_normals - radial).max()
    assert error < off < np.abs(ball.normals - radial).max()


def test_a_round_body_that_turns_about_its_axis_bears_nothing_across():
    """With normals of its surface; flat triangles of 6 degrees push."""
    flat = shapes.cylinder(0.02, 0.06, 60, 6, 3)
    sizes = [np.abs(force(x, spin=[0, 5.0, 0])).max() for x in (smooth(flat), flat)]
    assert sizes[0] < 1e-2 < 2.0 < sizes[1]


def test_smooth_cylinders_keep_their_edges():
    """Also on both sides of a sheet."""
    mesh = smooth(shapes.cylinder(0.02, 0.06, 40, 6, 3))
    side = np.abs(mesh.normals[:, 1]) < 0.5
    outwards = mesh.middles * [1, 0, 1]
    outwards /= np.linalg.norm(outwards, axis=-1, keepdims=True)
    expected = np.where(side[:, None], outwards, mesh.normals)
    np.testing.assert_allclose(mesh.middle_normals, expected, atol=1e-4)
    sheet = smooth(Mesh(mesh.vertices, mesh.faces[side], closed=False)).two_sided
    front, back = np.split(sheet.middle_normals, 2)
    np.testing.assert_allclose(back, -front, atol=1e-15)
