"""Surfaces of triangles: their edges, pieces, holes, volumes, and what lies inside."""

import numpy as np
import pytest

from rft.core.refusal import Refusal
from rft.terradynamics.meshes.surfaces import merged, shapes, shells, widened

CUBE = shapes.box((1.0, 2.0, 3.0))
BALL = shapes.sphere(1.0, 2)
# A strip of an odd number of half turns has one side.
STRIP = np.array([(k % 7, (k + 1) % 7, (k + 2) % 7) for k in range(7)])


def joined(*meshes):
    """Return vertices and faces of some meshes side by side."""
    vertices = []
    faces = []
    count = 0
    for points, triangles in meshes:
        vertices.append(points)
        faces.append(np.asarray(triangles) + count)
        count += len(points)
    return np.concatenate(vertices), np.concatenate(faces)


def of(mesh, move=0.0, scale=1.0):
    return scale * mesh.vertices + move, mesh.faces


def test_edges_of_a_closed_surface_have_two_sides_and_those_of_a_hole_one():
    assert len(shells.excess_edges(CUBE.faces)) == 0
    a, b, c = CUBE.faces[4].tolist()
    around = {
        tuple(edge)
        for edge in shells.excess_edges(np.delete(CUBE.faces, 4, 0)).tolist()
    }
    assert around == {(b, a), (c, b), (a, c)}
    twice = np.concatenate([CUBE.faces, CUBE.faces[4:5]])
    more = [tuple(edge) for edge in shells.excess_edges(twice).tolist()]
    assert sorted(more) == sorted([(a, b), (b, c), (c, a)])
    one_way = np.concatenate([CUBE.faces, CUBE.faces])
    assert len(shells.excess_edges(one_way)) == 0


def test_neighbours_meet_at_an_edge_where_no_others_do():
    pairs, same_way = shells.neighbours(CUBE.faces)
    assert len(pairs) == 18
    assert not same_way.any()
    for one, two in pairs:
        assert len({*CUBE.faces[one]} & {*CUBE.faces[two]}) == 2
    flipped = CUBE.faces.copy()
    flipped[0] = flipped[0, ::-1]
    pairs, same_way = shells.neighbours(flipped)
    assert sorted(map(bool, same_way)) == 15 * [False] + 3 * [True]
    assert ((pairs == 0).any(1) == same_way).all()


def test_bodies_that_share_an_edge_are_two_shells():
    vertices, faces = joined(of(CUBE), of(CUBE, (1.0, 2.0, 0.0)))
    _, index = np.unique(vertices.round(9), axis=0, return_inverse=True)
    for given in (faces, index.reshape(-1)[faces]):
        found = sorted(sorted(part.tolist()) for part in shells.shells(given))
        assert found == [[*range(12)], [*range(12, 24)]]
    assert [len(part) for part in shells.shells(CUBE.faces)] == [12]


@pytest.mark.parametrize("share", [0.1, 0.4])
def test_the_fewest_triangles_are_reversed(share):
    rng = np.random.default_rng(3)
    is_wrong = rng.random(len(BALL.faces)) < share
    faces = np.where(is_wrong[:, None], BALL.faces[:, ::-1], BALL.faces)
    np.testing.assert_array_equal(shells.reversed_triangles(faces), is_wrong)
    np.testing.assert_array_equal(shells.reversed_triangles(faces[:, ::-1]), is_wrong)


def test_a_surface_of_one_side_has_no_sense():
    assert shells.reversed_triangles(STRIP) is None
    assert len(shells.excess_edges(STRIP)) > 0


def test_volume_and_area_are_those_of_the_body():
    corners = CUBE.vertices[CUBE.faces]
    for moved in (corners, corners + [3.0, -5.0, 7.0]):
        assert shells.volume(moved) == pytest.approx(6.0)
        assert shells.volume(moved[:, ::-1]) == pytest.approx(-6.0)
        assert shells.area(moved) == pytest.approx(22.0)


def test_a_point_has_as_many_windings_as_bodies_round_it():
    vertices, faces = joined(of(BALL), of(BALL, scale=0.5), of(BALL, (4.0, 0.0, 0.0)))
    points = [(0.1, 0, 0), (0.7, 0, 0.1), (4.1, 0, 0), (2.0, 0, 0), (0.0, 0.0, 1.2)]
    corners = vertices[faces]
    assert shells.winding(np.array(points), corners).tolist() == [2, 1, 1, 0, 0]
    turned = shells.winding(np.array(points), corners[:, ::-1])
    assert turned.tolist() == [-2, -1, -1, 0, 0]


def test_a_hole_is_closed_by_its_least_surface():
    is_side = CUBE.normals[:, 0] > 0.5
    left = CUBE.faces[~is_side]
    points, added, count = shells.caps(CUBE.vertices, left)
    assert (len(added), count) == (is_side.sum(), 1)
    whole = np.concatenate([left, added])
    assert len(shells.excess_edges(whole)) == 0
    assert shells.volume(points[whole]) == pytest.approx(6.0)
    assert len(points) == len(CUBE.vertices)


def test_the_least_surface_is_the_least_of_all():
    """Of a loop of five points out of a plane, by trying all three diagonals."""
    rng = np.random.default_rng(4)
    loop = np.array(
        [
            (np.cos(t), np.sin(t), z)
            for t, z in zip(2 * np.pi * np.arange(5) / 5, rng.normal(size=5))
        ]
    )
    tip = np.array([[0.0, 0.0, -9.0]])
    faces = np.array([(5, (k + 1) % 5, k) for k in range(5)])
    points, added, count = shells.caps(np.concatenate([loop, tip]), faces)
    areas = []
    for first in range(5):
        fan = [(first, (first + k) % 5, (first + k + 1) % 5) for k in (1, 2, 3)]
        areas.append(shells.area(loop[np.array(fan)]))
    assert (len(added), count) == (3, 1)
    assert shells.area(points[added]) == pytest.approx(min(areas))


def test_a_large_hole_has_a_new_corner_in_its_middle():
    around = shells.LONGEST_LOOP + 4
    rod = shapes.cylinder(1.0, 2.0, around, 1, 1)
    is_end = np.abs(rod.normals[:, 1]) > 0.5
    is_end &= rod.middles[:, 1] > 0
    points, added, count = shells.caps(rod.vertices, rod.faces[~is_end])
    assert (len(added), count) == (around, 1)
    assert len(points) == len(rod.vertices) + 1
    np.testing.assert_allclose(points[-1], [0.0, 1.0, 0.0], atol=1e-12)


@pytest.mark.parametrize(("height", "closes"), [(10.0, True), (2.0, False)])
def test_a_surface_nearly_closes_where_its_hole_is_small(height, closes):
    """A side of 1 of 2 + 4 h, which is open."""
    tower = shapes.box((1.0, 1.0, height))
    is_top = tower.normals[:, 2] > 0.5
    assert shells.nearly_closes(tower.vertices, tower.faces[~is_top]) == closes


def test_what_lies_inside_another_is_found_and_what_crosses_refused():
    vertices, faces = joined(of(BALL), of(BALL, scale=0.5), of(BALL, 9.0, 0.2))
    parts = np.split(faces, 3)
    assert shells.is_enclosed(vertices, parts).tolist() == [False, True, False]
    assert shells.is_enclosed(vertices, parts[::-1]).tolist() == [False, True, False]
    assert shells.is_enclosed(vertices, parts[:1]).tolist() == [False]
    vertices, faces = joined(of(BALL), of(BALL, 0.6, 0.5))
    with pytest.raises(Refusal):
        shells.is_enclosed(vertices, np.split(faces, 2))


COUNTS = [
    (lambda: shapes.sphere(1.0, 0), 20),
    (lambda: shapes.sphere(1.0, 3), 20 * 64),
    (lambda: shapes.box((1, 2, 3), (2, 3, 5)), 4 * (6 + 15 + 10)),
    (lambda: shapes.cylinder(1.0, 2.0, 7, 3, 4), 2 * 7 * 3 + 2 * 7 * (2 * 4 - 1)),
    (lambda: shapes.screw(1.0, 0.5, 1.0, 2.0, 9, 8, 3), 2 * 9 * 8 + 2 * 9 * 5),
    (lambda: shapes.leg(1.0, 0.5, 0.1, 0.2, 6, 4, 2), 2 * 12 * 6 + 2 * 12 * 3),
    (lambda: widened.ellipsoid((1, 2, 3), 1), 80),
    (lambda: widened.cylinder(1.0, 2.0, 7, 3, 4), 2 * 7 * 3 + 2 * 7 * (2 * 4 - 1)),
    (lambda: widened.capsule(1.0, 2.0, 3, 4), 2 * 4 * 9 + 2 * 12 * 4),
]


@pytest.mark.parametrize(("made", "count"), COUNTS)
def test_a_shape_has_as_many_triangles_as_it_is_told(made, count):
    mesh = made()
    assert len(mesh.faces) == count
    assert len(shells.excess_edges(mesh.faces)) == 0
    assert len(mesh.vertices) == count // 2 + 2


@pytest.mark.parametrize(
    ("mesh", "volume", "normal"),
    [
        (widened.ellipsoid((1, 2, 3)), 8 * np.pi, lambda x: x / [1, 4, 9]),
        (
            widened.capsule(1.0, 2.0, 3, 4),
            np.pi * (4 / 3 + 4),
            lambda x: x - np.clip(x, [0, 0, -2], [0, 0, 2]),
        ),
        (
            widened.cylinder(1.0, 2.0, 16, 4, 3),
            4 * np.pi,
            lambda x: np.where(
                np.abs(x[:, 2:]) > 2 - 1e-9, x * [0, 0, 1], x * [1, 1, 0]
            ),
        ),
    ],
)
def test_a_round_solid_has_its_volume_and_the_normals_of_its_surface(
    mesh, volume, normal
):
    assert mesh.volume == pytest.approx(volume)
    expected = normal(mesh.vertices[mesh.faces].mean(1))
    expected = expected / np.linalg.norm(expected, axis=1, keepdims=True)
    np.testing.assert_allclose(mesh.middle_normals, expected, atol=1e-9)


def test_faces_are_made_as_long_as_they_are_asked_for():
    for length in (0.7, 0.3):
        found = merged.resize_faces(CUBE, length, 10**5)
        corners = found.vertices[found.faces]
        edges = np.linalg.norm(corners - np.roll(corners, 1, 1), axis=-1)
        assert edges.max() <= merged.LONGEST * length
        assert edges.max() > merged.LONGEST * length / 2
    fine = shapes.sphere(1.0, 5)
    found = merged.resize_faces(fine, 0.5, 10**5)
    assert len(found.faces) < len(fine.faces) / 20
    assert found.areas.sum() == pytest.approx(4 * np.pi, rel=0.02)
    assert merged.resize_faces(BALL, 0.4, 10**5) is BALL
    with pytest.raises(Refusal, match="100"):
        merged.resize_faces(CUBE, 0.01, 100)
