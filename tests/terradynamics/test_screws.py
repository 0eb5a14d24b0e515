"""Screws in the ground: their meshes and forces, and the craft that two of them
drive."""

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rft.terradynamics.meshes import Screw, Spatial, wrench
from rft.terradynamics.walking.craft import Screws
from rft.terradynamics.walking.screws import cruise, free_turning, turning

pytestmark = pytest.mark.usefixtures("fastest")

SAND = Spatial(3e5, 0.3)
SCREW = Screw(0.03, 0.018, 0.05, 0.13, 0.006, 0.02)
CRAFT = Screws(0.25, 0.2, 0.16, 0.04, SCREW, 0.12, 0.03)
COARSE = {"triangles": 400, "angles": 4}


def volume(screw):
    core = np.pi * screw.core**2
    blade = screw.thickness / screw.pitch * (np.pi * screw.radius**2 - core)
    return screw.length * (core + blade) + 2 / 3 * core * screw.nose


@pytest.mark.parametrize(
    "screw", [SCREW, dataclasses.replace(SCREW, handed="left", nose=0.0, pitch=0.21)]
)
def test_the_volume_of_a_screw_is_its_closed_form_and_normals_point_out(screw):
    """Of order 1 in the number of triangles, from below as chords are."""
    meshes = [screw.mesh(count) for count in (1000, 4000, 16000)]
    errors = [1 - mesh.volume / volume(screw) for mesh in meshes]
    assert errors[0] > 3 * errors[1] > 9 * errors[2] > 0.0
    assert errors[2] < 8e-3
    mesh = meshes[-1]
    assert 0.5 < len(mesh.faces) / 16000 < 2.5
    assert (mesh.middle_normals * mesh.normals).sum(-1).min() > 0.995
    x, y, z = mesh.vertices.T
    assert np.hypot(y, z).max() == pytest.approx(screw.radius)
    assert np.ptp(x) == pytest.approx(screw.length + 2 * screw.nose)


def test_in_a_nut_nothing_but_the_ends_leads_or_trails():
    mesh = SCREW.mesh(800)
    lead = SCREW.pitch / (2 * np.pi)
    along = lead * mesh.middle_normals[:, 0] + mesh.normal_moments[:, 0]
    x = mesh.middles[:, 0]
    inside = np.abs(x) < SCREW.length / 2 * (1 - 1e-9)
    assert inside.mean() > 0.7
    np.testing.assert_allclose(along[inside], 0.0, atol=1e-15)
    np.testing.assert_array_equal(np.sign(along[~inside]), np.sign(x[~inside]))


@pytest.mark.parametrize(("height", "rel"), [(-0.1, 1e-12), (0.0, 2e-3)])
def test_a_mirror_shows_the_other_hand(height, rel):
    """Vectors across it change sign, and so do turns about axes along it. What the
    surface cuts is cut otherwise."""
    flip = np.array([1, -1, 1])
    velocity = np.array([0.02, 0.01, 0.03])
    spin = np.array([6.0, 1.0, 2.0])
    place = (np.eye(3), [0, 0, height])
    one = wrench(SAND, SCREW.mesh(1500), *place, velocity, spin)
    mirrored = SCREW.mirrored.mesh(1500)
    two = wrench(SAND, mirrored, *place, velocity * flip, -spin * flip)
    np.testing.assert_allclose(two.force, one.force * flip, rtol=rel)
    np.testing.assert_allclose(two.moment, -one.moment * flip, rtol=rel)


def test_thrust_grows_with_slip_and_no_more_is_done_than_the_motor_gives():
    slip = np.array([-0.2, 0.1, 0.5, 1.0])
    found = turning(SAND, SCREW, -0.005, slip, 3.0, **COARSE)
    assert (np.diff(found.thrust) > 0.3).all()
    assert found.thrust[0] < 0 < found.thrust[-1]
    assert found.lift.min() > 0.1
    assert found.torque.min() > 0
    work = found.thrust * (1 - slip) * SCREW.pitch / (2 * np.pi)
    np.testing.assert_allclose(found.efficiency[1:3], (work / found.torque)[1:3])


def test_a_screw_runs_freely_where_it_pulls_nothing():
    free = free_turning(SAND, SCREW, -0.005, **COARSE)
    assert abs(free.thrust) < 1e-3
    assert 0.02 < free.slip < 0.5
    assert turning(SAND, SCREW, -0.005, free.slip + 0.01, **COARSE).thrust > 1e-3
    in_air = free_turning(SAND, SCREW, 0.05, **COARSE)
    assert np.isnan(in_air.slip)


@pytest.mark.parametrize(("pair", "rest"), [("mirrored", 2e-3), ("alike", 1e-4)])
def test_a_craft_is_in_balance_as_it_goes_on(pair, rest):
    """Told anew, screw by screw, at the pose and velocity that were found. The surface
    cuts triangles otherwise in the mirror."""
    craft = dataclasses.replace(CRAFT, pair=pair)
    found = cruise(SAND, craft, 2.0, **COARSE)
    body = Rotation.from_euler("xy", [found.roll, found.pitch]).as_matrix()
    yawing = np.array([0, 0, found.yaw_rate])
    force = np.zeros(3)
    moment = np.zeros(3)
    for screw, place in craft.screws:
        side = {"right": 1, "left": -1}[screw.handed]
        arm = body @ place
        v = np.array([*found.velocity, 0.0]) + np.cross(yawing, arm)
        spin = yawing + side * 4 * np.pi * body[:, 0]
        for angle in np.pi / 2 * np.arange(4):
            turn = body @ Rotation.from_rotvec([angle, 0, 0]).as_matrix()
            at = [0, 0, found.height] + arm
            one = wrench(SAND, screw.mesh(400), turn, at, v, spin)
            force += one.force / 4
            moment += (one.moment + np.cross(arm, one.force)) / 4
    weight = 9.81 * craft.mass
    np.testing.assert_allclose(force / weight, [0, 0, 1], atol=rest)
    np.testing.assert_allclose(moment / weight / SCREW.length, 0, atol=rest)


def test_a_craft_of_mirrored_screws_goes_straight_ahead():
    found = cruise(SAND, CRAFT, 2.0, **COARSE)
    assert found.roll == found.velocity[1] == found.yaw_rate == 0
    assert found.advance == pytest.approx((1 - found.slip) * SCREW.pitch)
    assert 0.05 < found.slip < 0.6


def test_a_craft_of_equal_screws_drifts_to_the_side_of_its_hand():
    alike = dataclasses.replace(CRAFT, pair="alike")
    one = cruise(SAND, alike, **COARSE)
    two = cruise(SAND, dataclasses.replace(alike, screw=SCREW.mirrored), **COARSE)
    assert -0.5 < one.velocity[1] / one.velocity[0] < -0.02
    assert one.roll * one.yaw_rate > 0
    np.testing.assert_allclose(two.velocity, one.velocity * [1, -1], rtol=0.1)
    turns = [-one.roll, -one.yaw_rate]
    np.testing.assert_allclose([two.roll, two.yaw_rate], turns, rtol=0.15)
    np.testing.assert_allclose(two.torque, one.torque[::-1], rtol=0.02)


LARGE_SCREW = Screw(*(2.5 * np.array([0.03, 0.018, 0.05, 0.13, 0.006, 0.02])))
LARGE_CRAFT = Screws(2.5**3 * 0.25, 0.5, 0.4, 0.1, LARGE_SCREW, track=0.3, drop=0.075)


@pytest.mark.parametrize(
    ("ground", "craft", "rate", "size"),
    [
        (SAND, LARGE_CRAFT, 3.0, 2.5),
        (Spatial(6e5, 0.3), dataclasses.replace(CRAFT, mass=0.5), 0.1, 1.0),
    ],
)
def test_craft_of_other_sizes_and_gravity_go_alike(ground, craft, rate, size):
    """Lengths by L, mass by L^3 on the same ground, and ground as strong as the craft
    is heavy: the same slip, the granular scaling laws of Slonaker et al. (2017), found
    for craft on screws by Thoesen et al. (2019, 2020)."""
    one = cruise(SAND, CRAFT, **COARSE)
    other = cruise(ground, craft, rate, **COARSE)
    assert other.slip == pytest.approx(one.slip, abs=1e-4)
    assert other.advance / size == pytest.approx(one.advance, rel=1e-4)
    assert other.height / size == pytest.approx(one.height, rel=1e-3)


def test_a_craft_that_nothing_bears_is_told_so():
    heavy = dataclasses.replace(CRAFT, mass=500.0)
    found = cruise(SAND, heavy, triangles=200, angles=2)
    assert np.isnan(found.advance)
    assert found.residual > 1e-3
