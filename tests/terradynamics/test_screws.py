"""Screws in the ground: meshes, forces against integrals over surfaces, limits, and craft that two of them drive."""

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rft.terradynamics.meshes import Screw, Spatial, wrench
from rft.terradynamics.walking.craft import Screws
from rft.terradynamics.walking.screws import (
    _solve,
    _SteadyCraft,
    cruise,
    free_turning,
    turning,
)

pytestmark = pytest.mark.usefixtures("fastest")

SAND = Spatial(3e5, 0.3)
SCREW = Screw(0.03, 0.018, 0.05, 0.13, 0.006, 0.02)
CRAFT = Screws(0.25, 0.2, 0.16, 0.04, SCREW, 0.12, 0.03)
COARSE = {"triangles": 400, "angles": 4}


def volume(screw):
    share, core = screw.thickness / screw.pitch, np.pi * screw.core**2
    return screw.length * (
        core + share * (np.pi * screw.radius**2 - core)
    ) + volume_of_cones(screw)


@pytest.mark.parametrize(
    "screw", [SCREW, dataclasses.replace(SCREW, handed="left", nose=0.0, pitch=0.21)]
)
def test_the_volume_of_a_screw_is_its_closed_form_and_normals_point_out(screw):
    errors = []
    for triangles in (1000, 4000, 16000):
        mesh = screw.mesh(triangles)  # closed and with its inside inside, or refused
        assert 0.5 < len(mesh.faces) / triangles < 2.5
        errors.append(1 - mesh.volume / volume(screw))
    assert errors[2] < 8e-3
    assert (
        errors[0] > 3 * errors[1] > 9 * errors[2] > 0.0
    )  # of order 1 in their number, below as chords are
    assert (mesh.middle_normals * mesh.normals).sum(-1).min() > 0.995
    reach = np.hypot(mesh.vertices[:, 1], mesh.vertices[:, 2])
    assert reach.max() == pytest.approx(screw.radius)
    assert np.ptp(mesh.vertices[:, 0]) == pytest.approx(screw.length + 2 * screw.nose)


def test_in_a_nut_nothing_but_the_ends_leads_or_trails():
    mesh = SCREW.mesh(800)
    along = mesh.middle_normals @ [
        SCREW.pitch / (2 * np.pi),
        0,
        0,
    ] + mesh.normal_moments @ [1.0, 0, 0]
    inside = np.abs(mesh.middles[:, 0]) < SCREW.length / 2 * (1 - 1e-9)
    assert np.abs(along[inside]).max() < 1e-15 and inside.mean() > 0.7
    out = np.sign(mesh.middles[~inside, 0])
    np.testing.assert_array_equal(np.sign(along[~inside]), out)


def test_a_smooth_thread_has_either_hand_and_noses():
    screw = Screw(0.03, 0.018, 0.05, 0.13, nose=0.02, handed="left")
    blunt = dataclasses.replace(screw, nose=0.0, handed="right")
    left, right = (
        screw.mesh(4000),
        dataclasses.replace(screw, handed="right").mesh(4000),
    )
    assert left.volume == pytest.approx(right.volume, rel=1e-12)
    ends = [abs(m.volume - blunt.mesh(4000).volume) for m in (left, right)]
    assert np.ptp(left.vertices[:, 0]) == pytest.approx(0.17)
    assert 0.8 * volume_of_cones(screw) < ends[0] < 1.5 * volume_of_cones(screw)
    of = lambda mesh, spin: wrench(
        SAND, mesh, np.eye(3), [0, 0, -0.1], [0, 0, 0], [spin, 0, 0]
    ).force[0]
    assert of(left, -6.0) == pytest.approx(of(right, 6.0), rel=1e-9) and of(
        right, 6.0
    ) > 1.0 > -1.0 > of(left, 6.0)


def volume_of_cones(screw):
    return 2 / 3 * np.pi * screw.core**2 * screw.nose


def surfaces(screw, n):
    """(points, normals, areas), each of (N, 3), (N, 3), (N,): of a right-handed screw, by midpoints of its surfaces' own
    coordinates; tangents by hand, and no triangles."""
    k, half = 2 * np.pi / screw.pitch, np.pi * screw.thickness / screw.pitch
    middles = lambda low, high, m: low + (high - low) * (np.arange(m) + 0.5) / m
    x, out = middles(-screw.length / 2, screw.length / 2, 4 * n), []
    polar = lambda a: (np.cos(a), np.sin(a))

    def add(x, r, angle, normal, area):
        c, s = polar(angle)
        at = np.stack(
            np.broadcast_arrays(x + 0 * angle, r * c + 0 * x, r * s + 0 * x), -1
        ).reshape(-1, 3)
        n_x, n_r, n_a = (np.broadcast_to(v, c.shape) for v in normal)
        n = np.stack([n_x, n_r * c - n_a * s, n_r * s + n_a * c], -1).reshape(-1, 3)
        out.append(
            (
                at,
                n / np.linalg.norm(n, axis=-1, keepdims=True),
                np.broadcast_to(area, c.shape).ravel(),
            )
        )

    for r, low, high, m in (
        (screw.core, half, 2 * np.pi - half, 2 * n),
        (screw.radius, -half, half, n // 4),
    ):
        angle = k * x[:, None] + middles(low, high, m)
        add(
            x[:, None],
            r,
            angle,
            (0, 1, 0),
            screw.length / len(x) * r * (high - low) / m,
        )
    r = middles(screw.core, screw.radius, n)
    slope = np.hypot(1, k * r) * screw.length / len(x) * (screw.radius - screw.core) / n
    for side in (-1, 1):
        add(
            x[:, None],
            r,
            k * x[:, None] + side * half + 0 * r,
            (-side * k * r, 0, side),
            slope,
        )
        end = side * screw.length / 2
        angle = k * end + middles(-half, half, n // 2)[:, None]
        add(
            end,
            r,
            angle + 0 * r,
            (side, 0, 0),
            r * (screw.radius - screw.core) / n * half * 2 / (n // 2) + 0 * angle,
        )
        r_cone, angle = middles(0, screw.core, n), middles(0, 2 * np.pi, 2 * n)[:, None]
        slant = np.hypot(screw.nose, screw.core) / screw.core
        tip = end + side * screw.nose * (1 - r_cone / screw.core)
        area = slant * r_cone * screw.core / n * 2 * np.pi / (2 * n)
        add(
            tip,
            r_cone,
            angle + 0 * r_cone,
            (side * screw.core, screw.nose, 0),
            area + 0 * angle,
        )
    return (np.concatenate(some) for some in zip(*out))


@pytest.mark.parametrize("height", [0.004, -0.1])
def test_forces_on_a_screw_are_the_integral_over_its_surfaces(height):
    turn = Rotation.from_rotvec([0.4, -0.1, 0.2]).as_matrix()
    velocity, spin = np.array([0.01, -0.05, 0.02]), np.array([5.0, 0.3, -0.4])
    at, n, area = surfaces(SCREW, 60)
    at, n = at @ turn.T, n @ turn.T
    z = at[:, 2] + height
    force = (
        SAND.stress(n, velocity + np.cross(spin, at))
        * (np.where(z < 0, -z, 0) * area)[:, None]
    )
    found = wrench(SAND, SCREW.mesh(20_000), turn, [0.3, -0.2, height], velocity, spin)
    np.testing.assert_allclose(
        found.force, force.sum(0), atol=6e-3 * np.abs(force.sum(0)).max()
    )
    moment = np.cross(at, force).sum(0)
    np.testing.assert_allclose(found.moment, moment, atol=6e-3 * np.abs(moment).max())
    assert (
        np.abs(force.sum(0)).min() > 0.015 * np.abs(force.sum(0)).max()
    )  # every component is tried


def test_a_mirror_shows_the_other_hand():
    """Vectors across it change sign, turns about axes along it do, too. What the surface cuts is cut otherwise."""
    flip, mesh, other = (
        np.array([1, -1, 1]),
        SCREW.mesh(1500),
        SCREW.mirrored.mesh(1500),
    )
    np.testing.assert_array_equal(
        mesh.vertices[mesh.faces] * flip, other.vertices[other.faces][:, ::-1]
    )
    np.testing.assert_array_equal(
        mesh.smooth_normals * flip, other.smooth_normals[:, ::-1]
    )
    velocity, spin = np.array([0.02, 0.01, 0.03]), np.array([6.0, 1.0, 2.0])
    for height, rel in ((-0.1, 1e-12), (0.0, 2e-3)):
        one = wrench(SAND, mesh, np.eye(3), [0, 0, height], velocity, spin)
        two = wrench(
            SAND, other, np.eye(3), [0, 0, height], velocity * flip, -spin * flip
        )
        np.testing.assert_allclose(two.force, one.force * flip, rtol=rel)
        np.testing.assert_allclose(two.moment, -one.moment * flip, rtol=rel)


def test_thrust_grows_with_slip_and_no_more_is_done_than_the_motor_gives():
    slip = np.array([-0.2, 0.1, 0.5, 1.0])
    found = turning(SAND, SCREW, -0.005, slip, 3.0, **COARSE)
    assert (np.diff(found.thrust) > 0.3).all() and found.thrust[0] < 0 < found.thrust[
        -1
    ]
    assert (
        (found.lift > 0.1).all()
        and (found.torque > 0).all()
        and (found.efficiency < 1).all()
    )
    np.testing.assert_allclose(
        found.efficiency[2],
        found.thrust[2] * 0.5 * SCREW.pitch / (2 * np.pi) / found.torque[2],
    )
    one = turning(SAND, SCREW, -0.1, slip, 3.0, **COARSE)
    two = turning(
        SAND, SCREW.mirrored, -0.1, slip, 0.01, **COARSE
    )  # the other hand, another rate
    for name, way in (
        ("thrust", 1),
        ("side", -1),
        ("lift", 1),
        ("torque", 1),
        ("pitching", 1),
        ("efficiency", 1),
    ):
        np.testing.assert_allclose(
            getattr(two, name), way * getattr(one, name), rtol=1e-9, atol=1e-12
        )


def test_a_screw_runs_freely_where_it_pulls_nothing():
    free = free_turning(SAND, SCREW, -0.005, **COARSE)
    assert abs(free.thrust) < 1e-3 and 0.02 < free.slip < 0.5
    assert turning(SAND, SCREW, -0.005, free.slip + 0.01, **COARSE).thrust > 1e-3
    assert np.isnan(free_turning(SAND, SCREW, 0.05, **COARSE).slip)  # out of the ground


def test_limits_of_the_blade():
    """A smooth core slides along itself; a blade of no pitch is a row of rings, which do, too; one of any pitch a paddle."""
    at = lambda screw: turning(SAND, screw, -0.1, 1.0, 1.0, 1500, 4)
    whole = at(SCREW)
    heights = np.array([4e-4, 2e-4, 1e-4])
    low = np.array(
        [
            at(dataclasses.replace(SCREW, core=0.03 - h, nose=0.0)).thrust
            for h in heights
        ]
    )
    np.testing.assert_allclose(
        low / heights, low[-1] / heights[-1], rtol=0.05
    )  # goes with the blade
    assert low[-1] < 0.02 * whole.thrust
    rings = Screw(0.03, 0.018, 0.001, 0.004, 1e-4)
    assert at(rings).thrust / rings.turns < 0.02 * whole.thrust / SCREW.turns
    paddle = at(dataclasses.replace(SCREW, pitch=5.0, thickness=0.2))
    assert (
        abs(paddle.thrust)
        < 0.02 * whole.thrust
        < whole.thrust / 30
        < paddle.torque / 0.03
    )


@pytest.mark.parametrize("pair", ["mirrored", "alike"])
def test_a_craft_is_in_balance_as_it_goes_on(pair):
    """Told anew, screw by screw, at the pose and velocity that were found."""
    craft = dataclasses.replace(CRAFT, pair=pair)
    found = cruise(SAND, craft, 2.0, **COARSE)
    body = Rotation.from_euler("xy", [found.roll, found.pitch]).as_matrix()
    force, moment, spin = np.zeros(3), np.zeros(3), np.array([0, 0, found.yaw_rate])
    for screw, place in craft.screws:
        way = {"right": 1, "left": -1}[screw.handed]
        arm = body @ place
        for angle in 2 * np.pi * np.arange(4) / 4:
            turn = body @ Rotation.from_rotvec([angle, 0, 0]).as_matrix()
            v = np.array([*found.velocity, 0.0]) + np.cross(spin, arm)
            one = wrench(
                SAND,
                screw.mesh(400),
                turn,
                [0, 0, found.height] + arm,
                v,
                spin + way * 4 * np.pi * body[:, 0],
            )
            force, moment = (
                force + one.force / 4,
                moment + (one.moment + np.cross(arm, one.force)) / 4,
            )
    weight = 9.81 * craft.mass
    rest = (
        2e-3 if pair == "mirrored" else 1e-4
    )  # of triangles that the surface cuts otherwise in the mirror
    np.testing.assert_allclose(force / weight, [0, 0, 1], atol=rest)
    np.testing.assert_allclose(moment / weight / SCREW.length, 0, atol=rest)
    if pair == "mirrored":
        assert found.roll == found.velocity[1] == found.yaw_rate == 0
        assert (
            found.advance == pytest.approx((1 - found.slip) * SCREW.pitch)
            and 0.05 < found.slip < 0.6
        )
    else:
        assert (
            -0.5 < found.velocity[1] / found.velocity[0] < -0.02
            and found.roll * found.yaw_rate > 0
        )


def test_the_other_hand_drifts_to_the_other_side():
    alike = dataclasses.replace(CRAFT, pair="alike")
    one, two = (
        cruise(SAND, dataclasses.replace(alike, screw=s), **COARSE)
        for s in (SCREW, SCREW.mirrored)
    )
    np.testing.assert_allclose(two.velocity, one.velocity * [1, -1], rtol=0.1)
    np.testing.assert_allclose(
        [two.roll, two.yaw_rate], [-one.roll, -one.yaw_rate], rtol=0.15
    )
    np.testing.assert_allclose(two.torque, one.torque[::-1], rtol=0.02)


def test_craft_of_other_sizes_and_gravity_go_alike():
    """Lengths by L, mass by L^3 on the same ground, and ground as strong as the craft is heavy: the same slip, the granular
    scaling laws of Slonaker et al. (2017), found for craft on screws by Thoesen et al. (2019, 2020)."""
    one = cruise(SAND, CRAFT, **COARSE)
    sizes = {
        k: 2.5 * getattr(SCREW, k)
        for k in ("radius", "core", "pitch", "length", "thickness", "nose")
    }
    large = {
        k: 2.5 * getattr(CRAFT, k)
        for k in ("length", "width", "height", "track", "drop")
    }
    craft = Screws(mass=2.5**3 * CRAFT.mass, screw=Screw(**sizes), **large)
    two = cruise(SAND, craft, 3.0, **COARSE)
    three = cruise(
        dataclasses.replace(SAND, xi_n=6e5),
        dataclasses.replace(CRAFT, mass=0.5),
        0.1,
        **COARSE,
    )
    for other, size in ((two, 2.5), (three, 1.0)):
        assert other.slip == pytest.approx(one.slip, abs=1e-4)
        assert other.advance / size == pytest.approx(one.advance, rel=1e-4)
        assert other.height / size == pytest.approx(one.height, rel=1e-3)


def test_a_craft_of_no_weight_floats_on_its_screws():
    assert (
        1.9
        < _SteadyCraft(
            SAND, dataclasses.replace(CRAFT, mass=1e-3), 1.0, **COARSE
        ).floating_height()
        < 2.0
    )  # radii


def test_a_craft_that_nothing_bears_is_told_so():
    found = cruise(
        SAND, dataclasses.replace(CRAFT, mass=500.0), triangles=200, angles=2
    )
    assert np.isnan(found.advance) and found.residual > 1e-3


REFUSED = [
    ({"core": 0.03}, "core must be less than the radius"), ({"pitch": 0.0}, "pitch must be a number from 1e-06"),
    ({"pitch": -0.05}, "pitch must be"), ({"thickness": 0.05}, "thickness must be 0, or from a thousandth of the pitch"),
    ({"thickness": 1e-5}, "thickness must be 0, or"), ({"thickness": -0.01}, "thickness must be a number from 0"),
    ({"nose": np.nan}, "nose must be"), ({"handed": "both"}, "handed must be one of right, left, got 'both'"),
    ({"pitch": 1e-3, "thickness": 1e-4}, "the thread has 130 turns, beyond 100"),
]  # fmt: skip


@pytest.mark.parametrize(("wrong", "said"), REFUSED, ids=[said for _, said in REFUSED])
def test_what_makes_no_screw_is_refused(wrong, said):
    with pytest.raises(ValueError, match=".") as caught:
        dataclasses.replace(SCREW, **wrong)
    assert said in str(caught.value) and "\n" not in str(caught.value)


def test_a_balance_is_found_by_short_steps_or_what_is_left_is_told():
    """Of a line far off, of a curve, and where there is none."""
    A, tries = np.array([[2.0, -0.5], [0.3, 1.0]]), []
    x, left = _solve(lambda x: tries.append(x) or A @ (x - [1.0, -2.0]), np.zeros(2))
    np.testing.assert_allclose(x, [1.0, -2.0], atol=1e-5)
    assert left < 1e-5 and np.abs(np.diff(tries[::3], axis=0)).max() <= 0.3 + 1e-9
    x, left = _solve(
        lambda x: np.array([x[0] ** 2 - 2.0, x[0] * x[1] - 1.0]), np.array([0.5, 0.5])
    )
    np.testing.assert_allclose(x, [2**0.5, 0.5**0.5], atol=1e-5)
    x, left = _solve(lambda x: x**2 + 0.3, np.array([0.8]))
    assert 0.3 <= left < 0.31 and abs(x[0]) < 0.1
