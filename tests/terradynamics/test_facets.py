"""Forces of grains on many bodies at once: triangles below the surface, and the planar
map in three dimensions."""

import dataclasses
import math
from typing import NamedTuple

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rft.terradynamics.ground import Ground
from rft.terradynamics.meshes import Cylinder, Screw, Spatial, Sphere, below, wrench
from rft.terradynamics.meshes.forces.blocks import Blocks
from rft.terradynamics.meshes.forces.contact import Motion, faces
from rft.terradynamics.meshes.forces.extruded import Extruded
from rft.terradynamics.meshes.forces.submerged import submerged_part
from rft.terradynamics.plates import CLeg, Polygon, RoundRod, StressMap
from rft.terradynamics.walking.planar.elements import Elements, Outlines
from rft.terradynamics.walking.spatial.facets import Grains, Surface

SAND = StressMap(zeta=0.3, grazing=math.radians(5))
SPATIAL = Spatial(3e5, surface_friction=0.6)
RNG = np.random.default_rng(5)


def unit(shape):
    x = RNG.normal(size=shape)
    return x / np.linalg.norm(x, axis=0)


def test_what_of_a_triangle_is_below_is_what_cutting_it_leaves():
    corners = RNG.uniform(-1, 1, (500, 3, 3))
    share, middle, moments = submerged_part(corners[..., 2].T)
    parts, of = below(corners, corners[..., 2])

    def area(p):
        sides = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
        return np.linalg.norm(sides, axis=-1) / 2

    def sums(x):
        return np.stack([np.bincount(of, y, len(corners)) for y in x.T], -1)

    whole = area(corners)
    each = area(parts)
    depth = -parts[..., 2]
    np.testing.assert_allclose(share * whole, sums(each[:, None])[:, 0], atol=1e-14)
    first = sums(each[:, None] * parts.mean(1))
    np.testing.assert_allclose(
        np.einsum("in,nij->nj", middle, corners) * (share * whole)[:, None],
        first,
        atol=1e-14,
    )
    arms = (
        np.einsum("pi,pij->pj", depth, parts)
        + 3 * depth.sum(1)[:, None] * parts.mean(1)
    ) * (each / 12)[:, None]
    np.testing.assert_allclose(
        np.einsum("in,nij->nj", moments, corners) * whole[:, None],
        sums(arms),
        atol=1e-14,
    )


@pytest.mark.parametrize("tension", ["keep", "cut"])
def test_a_stress_map_of_three_dimensions_is_the_planar_one_in_every_vertical_plane(
    tension,
):
    stress = StressMap(A00=0.2, D10=0.05, zeta=0.7, tension=tension)
    (b, g), turn = RNG.uniform(-np.pi, np.pi, (2, 300)), RNG.uniform(0, 2 * np.pi, 300)
    n, v = np.array([np.sin(b), -np.cos(b)]), np.array([np.cos(g), -np.sin(g)])

    def raised(a):
        return np.array([a[0] * np.cos(turn), a[0] * np.sin(turn), a[1]])

    def planar(stress):
        return 1e6 * raised(np.array([[-1.0], [1.0]]) * stress.alpha(n, v))

    found, wanted = (
        np.stack(Extruded(stress).traction(raised(n), raised(v))),
        planar(stress),
    )
    kept = planar(dataclasses.replace(stress, tension="keep"))
    clear = np.abs((kept * raised(n)).sum(0) * (n * v).sum(0)) > 0.026 * np.linalg.norm(
        kept, axis=0
    )  # of the cut
    clear |= tension == "keep"
    assert clear.sum() > 200
    np.testing.assert_allclose(
        found[:, clear], wanted[:, clear], atol=1e-9 * np.abs(found).max()
    )
    n, v = unit((3, 200)), unit((3, 200))
    np.testing.assert_allclose(
        Extruded(stress).traction(-n, v), Extruded(stress).traction(n, v), rtol=1e-12
    )


class Poses(NamedTuple):
    """Of B bodies in the world: rotation (B, 3, 3), place, velocity and spin (B, 3)."""

    rotation: np.ndarray
    place: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray


def loads(surfaces, grains, at):
    """Return forces and moments (B, 6) on the bodies of surfaces, one or more to a
    body, in the world."""

    def joined(parts, name):
        return np.concatenate([getattr(p, name) for p in parts])

    def along(v):
        return np.einsum("bij,bi->bj", at.rotation, v)[:, None]

    own = {}
    for one in surfaces:
        own.setdefault(one.body, []).append(one)
    blocks = Blocks(
        [
            faces(
                joined(p, "corners"),
                joined(p, "normals"),
                np.repeat([x.sheet for x in p], [len(x.corners) for x in p]),
            )
            for p in own.values()
        ]
    )
    turn, (x, _, z) = at.rotation, at.place.T
    motions = Motion(
        along(at.velocity),
        along(at.spin),
        x[:, None],
        turn[:, None, 2],
        turn[:, None, 0],
        z[:, None],
    )
    found = blocks.loads(grains.law, grains.ground, motions)[:, 0].reshape(-1, 2, 3)
    return np.einsum("bij,bpj->bpi", turn, found).reshape(-1, 6)


def poses(count):
    turn = Rotation.random(count, random_state=3).as_matrix()
    return Poses(
        turn,
        RNG.normal(size=(count, 3)) * 0.01,
        RNG.normal(size=(count, 3)),
        5 * RNG.normal(size=(count, 3)),
    )


def test_loads_are_those_of_each_mesh_alone():
    """Of two geoms on one body and one on another, against the sums of
    `rft.terradynamics.meshes.wrench` about the bodies' origins."""
    meshes = [
        Sphere(0.02).mesh(80),
        Screw(0.03, 0.02, 0.05, 0.1).mesh(600),
        Cylinder(0.02, 0.05).mesh(200),
    ]
    turn, place = (
        Rotation.from_euler("xyz", [0.3, -1.1, 0.7]).as_matrix(),
        np.array([0.02, -0.01, 0.015]),
    )
    at = poses(2)
    parts = [
        (0, meshes[0], np.eye(3), np.zeros(3)),
        (0, meshes[1], turn, place),
        (1, meshes[2], turn.T, -place),
    ]
    surfaces = [Surface.from_mesh(b + 4, m, r, p) for b, m, r, p in parts]
    found = loads(surfaces, Grains(SPATIAL, 0.7, rounding=1e-7), at)
    wanted = np.zeros((2, 6))
    for b, mesh, r, p in parts:
        arm = at.rotation[b] @ p
        velocity = at.velocity[b] + np.cross(at.spin[b], arm)
        one = wrench(
            SPATIAL, mesh, at.rotation[b] @ r, at.place[b] + arm, velocity, at.spin[b]
        )
        wanted[b] += 0.7 * np.concatenate(
            [one.force, one.moment + np.cross(arm, one.force)]
        )
    assert np.abs(wanted).min() > 1e-4
    np.testing.assert_allclose(
        found, wanted, rtol=2e-3, atol=3e-3 * np.abs(wanted).max()
    )


@pytest.mark.parametrize(
    "shape",
    [
        CLeg(0.03, 0.02, 0.6),
        RoundRod(0.03, 0.02),
        Polygon(((0, 0), (0.05, 0), (0.01, 0.04)), 0.03),
    ],
)
def test_loads_on_outlines_in_their_plane_are_those_of_the_plane(shape):
    outline = shape.outline(96)
    angle, place, motion = (
        0.7,
        np.array([0.01, 0.002, -0.01]),
        np.array([0.3, -0.2, 4.0]),
    )
    at = Poses(
        Rotation.from_euler("y", angle).as_matrix()[None],
        place[None],
        np.array([[0.3, 0.0, -0.2]]),
        np.array([[0, 4.0, 0]]),
    )
    surfaces = [Surface.from_outline(0, outline)]
    found = loads(surfaces, Grains(Extruded(SAND), 1.0, 2000.0, 1e-7), at)[0]
    ground = Ground(*np.array([1.0, 2000.0, 1e-7])[:, None], np.sin(SAND.grazing))
    flat, one = (
        Elements(Outlines.from_list([outline]), None, np.zeros((2, 1, 1)), SAND),
        np.zeros(1, int),
    )
    pose, twist = np.array([place[0], place[2], angle]), motion
    at = (x[:, None, None] for x in (pose, twist))
    *force, moment = np.ravel(flat.load(ground, one, *at, *np.zeros((2, 1, 1)))[:3])
    np.testing.assert_allclose(
        found[[0, 2]], force, rtol=3e-3, atol=2e-4 * np.abs(force).max()
    )
    assert found[4] == pytest.approx(moment, abs=6e-5 * np.abs(force).max())
    np.testing.assert_allclose(found[[1, 3, 5]], 0.0, atol=1e-9)
