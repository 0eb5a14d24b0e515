"""Solid bodies: their meshes and motions, files of meshes, pictures."""

import dataclasses
import math
import re
import sys

import numpy as np
import pytest
from artists import curve, drawn
from frozen import FOLDER
from scipy.spatial.transform import Rotation

from figures.terradynamics import meshes
from geomech import plots, scenes
from geomech.scenes import MeshScene
from geomech.studies.terradynamics.intrusion import answer
from rft.terradynamics.meshes import (
    SOLIDS,
    Cylinder,
    Drag,
    Leg,
    Mesh,
    MeshFile,
    Path,
    Penetrate,
    Rotate,
    Screw,
    Sphere,
    bearing,
    read,
    wrench,
)
from rft.terradynamics.meshes.surfaces import shapes

pytestmark = pytest.mark.usefixtures("fastest")

NAMES = [n for n in scenes.intruder_names() if isinstance(scenes.load(n), MeshScene)]
MADE = (FOLDER / "ball.toml").read_text()
SPHERE = 'shape = "sphere"\nradius = 0.02'
BODIES = {
    "sphere": Sphere(0.02),
    "cylinder": Cylinder(0.0127, 0.1),
    "screw": Screw(0.03, 0.015, 0.06, 0.18),
    "leg": Leg(0.038, 0.025, 0.003, 0.7),
}
MOTIONS = {
    "drag": Drag(0.03, 0.2, -0.4, 0.05, 0.08, (0.1, 0.2, -0.3), 4001),
    "penetrate": Penetrate(0.03, 1.1, 0.6, 0.02, 0.5, 4001),
    "rotate": Rotate(-0.01, (1.0, 2.0, -1.0), -3.0, 1.0, -2.0, 0.3, 0.5, 0.2, 4001),
}


def write_stl(path, mesh, scale=1.0):
    """Write a binary STL file by hand."""
    layout = [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("size", "<u2")]
    rows = np.zeros(len(mesh.faces), layout)
    rows["corners"] = mesh.vertices[mesh.faces] * scale
    path.write_bytes(b" " * 80 + np.uint32(len(rows)).tobytes() + rows.tobytes())


def test_there_is_a_scene_of_every_body():
    assert {type(scenes.load(n).intruder) for n in NAMES} == set(SOLIDS.values())


@pytest.mark.parametrize(
    ("name", "zeta", "strength", "told"),
    [
        (
            "poppy-seeds-loose",
            "",
            0.254e6,
            "matched to alpha_z(0, 90 degrees) of poppy",
        ),
        ("poppy-seeds-loose", "zeta = 2.0\n", 0.508e6, "2 times alpha_z"),
        ("own.toml", "", 0.3e6, "of own.toml in"),
    ],
)
def test_strength_is_matched_to_the_vertical_plane(
    name, zeta, strength, told, tmp_path
):
    """So that a level plate that is pushed down bears the same."""
    (tmp_path / "own.toml").write_text("[medium]\nzeta = 0.3\n")
    key = "file" if name == "own.toml" else "name"
    text = scenes.load("sphere").text
    text = text.replace('name = "poppy-seeds-loose"', f'{key} = "{name}"\n{zeta}')
    (tmp_path / "s.toml").write_text(text)
    scene = scenes.load(tmp_path / "s.toml")
    down = [0.0, 0.0, -1.0]
    assert scene.medium.stress(down, down)[2] == pytest.approx(strength)
    assert told in scene.matched


def test_a_leg_of_three_dimensions_is_like_that_of_two():
    """Thin and smooth: peaks of lift and drive are within a third of the flat one's, at
    angles 20 degrees off at most."""
    solid = scenes.load("extruded-c-leg").run()
    flat = scenes.load("c-leg").run()
    for k in (0, 1):
        one = solid.force[:, 2 * k]
        two = flat.force[:, k]
        assert one.max() == pytest.approx(two.max(), rel=0.3)
        off = solid.trajectory.angle[one.argmax()] - flat.pose[two.argmax(), 2]
        assert abs(np.degrees(off)) < 20
    assert np.abs(solid.force[:, 1]).max() < 1e-12
    assert solid.moment[:, 1].min() == pytest.approx(flat.moment.min(), rel=0.2)


def test_the_coarsest_meshes_still_are_the_bodies():
    share = [b.mesh(1).volume / b.mesh(20_000).volume for b in BODIES.values()]
    assert share == pytest.approx([0.606, 0.901, 0.915, 0.975], abs=1e-3)


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("body", BODIES)
def test_velocities_are_those_of_the_poses(body, motion):
    """Against differences between poses close by."""
    mesh = BODIES[body].mesh(200)
    path = MOTIONS[motion].trajectory(mesh)
    k = 1234
    step = 2 * path.t[1]
    velocity = (path.place[k + 1] - path.place[k - 1]) / step
    np.testing.assert_allclose(velocity, path.velocity[k], atol=1e-9)
    turn = Rotation.from_matrix(path.rotation[k + 1] @ path.rotation[k - 1].T)
    np.testing.assert_allclose(turn.as_rotvec() / step, path.spin[k], atol=1e-9)
    if motion == "penetrate":
        ends = path.place[[0, -1], None]
        lowest = (mesh.vertices @ path.rotation[0].T + ends)[..., 2].min(1)
        np.testing.assert_allclose(lowest, [0.0, -0.03], atol=1e-12)


BALL = Sphere(0.02).mesh(100)


@pytest.mark.parametrize(
    ("heading", "direction", "way"),
    [
        (0.0, 0.0, [1, 0, 0]),
        (0.0, np.pi / 2, [0, 0, -1]),
        (np.pi / 2, 0.0, [0, 1, 0]),
        (2.0, -0.5, np.array([np.cos(2), np.sin(2), np.tan(0.5)]) * np.cos(0.5)),
    ],
    ids=["ahead", "down", "left", "oblique"],
)
def test_drags_go_where_their_angles_say(heading, direction, way):
    motion = Drag(0.05, direction, heading, speed=0.2, distance=0.3)
    path = motion.trajectory(BALL)
    place = [0, 0, -0.05] + 0.3 * np.array(way)
    np.testing.assert_allclose(path.place[-1], place, atol=1e-15)
    np.testing.assert_allclose(path.velocity[7], 0.2 * np.array(way), atol=1e-16)
    # To the last digit.
    np.testing.assert_array_equal(path.velocity[7] == 0, np.array(way) == 0)
    assert path.t[-1] == pytest.approx(1.5)


def test_penetration_goes_down_along_its_heading():
    path = Penetrate(0.03, direction=2.0, heading=-1.0).trajectory(BALL)
    way = 0.03 / np.tan(2.0)
    expected = [way * np.cos(1.0), -way * np.sin(1.0), -0.01]
    assert path.place[-1] == pytest.approx(expected)


def test_a_body_turns_about_y_by_default():
    path = Rotate(0.04, start=-1.0, stop=0.5).trajectory(BALL)
    assert path.spin[0] == pytest.approx([0, 2 * np.pi, 0])
    assert path.angle[[0, -1]] == pytest.approx([-1.0, 0.5])
    down = path.rotation[-1] @ [0, 0, -1]
    np.testing.assert_allclose(down, [-np.sin(0.5), 0, -np.cos(0.5)], atol=1e-15)


STILL = (0, 0, 0)
REFUSED = [
    (lambda: Drag(0.1, heading=-11.0), "heading must be"),
    (lambda: Drag(-11.0), "depth must be"),
    (lambda: Penetrate(0.0), "depth must be"),
    (lambda: Penetrate(0.1, direction=0.0), "direction must point downwards"),
    (lambda: Path(*[(0, 1)] * 4), "3 to"),
    (lambda: Path((0, 1, 2), *[STILL] * 4, (0, 1, 3.5), STILL), "2 rad or more after"),
    (lambda: Path((0, 2, 1), *[STILL] * 3), "t must ascend"),
    (lambda: Sphere(0.1).mesh(2.5), "whole number"),
    (lambda: Mesh(np.eye(4, 3), [[0, 2, 1], [0, 1, 9]], closed=False), "vertex 9, wh"),
    (
        lambda: Mesh(np.eye(4, 3), [[0, 2, 1], [0, 1, -1]], closed=False),
        "vertex -1, wh",
    ),
]


@pytest.mark.parametrize(("build", "said"), REFUSED, ids=[said for _, said in REFUSED])
def test_motions_and_meshes_that_make_no_sense_are_refused(build, said):
    with pytest.raises(ValueError, match=said):
        build()


def test_a_path_of_poses_gives_the_motion_it_was_taken_from(tmp_path):
    """A steady rotation about an oblique axis, with the hub moving, from a CSV file."""
    text = MADE.replace("sphere", "c-leg")
    text = text.replace("radius", "width = 0.02\nthickness = 0.004\nradius")
    motion = Rotate(0.01, (1.0, 2.0, -1.0), 3.0, -1.0, 1.5, 0.1, 0.5, 0.2, 21)
    expected = dataclasses.replace(scenes.parse(text), motion=motion).run()
    path = expected.trajectory
    turns = Rotation.from_matrix(path.rotation).as_rotvec()
    rows = np.column_stack([path.t, path.place, turns])
    head = "t,x,y,z,rx,ry,rz"
    np.savetxt(
        tmp_path / "p.csv", rows, "%.17g", delimiter=",", header=head, comments=""
    )
    of_file = '[motion]\nkind = "csv"\nfile = "p.csv"\n[numerics]'
    text = re.sub(r"\[motion\].*\[numerics\]", of_file, text, flags=re.DOTALL)
    (tmp_path / "s.toml").write_text(text)
    found = scenes.load(tmp_path / "s.toml").run()
    assert np.abs(expected.force).max() > 0.1
    np.testing.assert_allclose(found.force, expected.force, atol=1e-12)


def test_velocities_of_a_path_are_of_order_2():
    def turns(t):
        return Rotation.from_rotvec(np.stack([np.sin(2 * t), t**2, 1 - t], -1))

    errors = []
    for samples in (50, 100, 200):
        t = 0.1 + np.linspace(0, 1, samples) ** 1.2
        spin = (turns(t + 1e-6) * turns(t - 1e-6).inv()).as_rotvec() / 2e-6
        rotvec = turns(t).as_rotvec().T
        found = Path(t, np.sin(t), 0 * t, t**3 / 5, *rotvec).trajectory(None)
        off = found.velocity[:, 0] - np.cos(t)
        errors.append([np.abs(found.spin - spin).max(), np.abs(off).max()])
    assert np.max(errors[-1]) < 2e-4
    assert (np.log2(np.divide(errors[0], errors[-1])) / 2 > 1.8).all()


def test_a_mesh_of_a_file_bears_what_its_triangles_bear(tmp_path):
    pytest.importorskip("trimesh")
    mesh = shapes.leg(0.038, -1.0, 0.003, 0.025, 40, 6, 1)
    write_stl(tmp_path / "leg.STL", mesh, 1000)
    text = MADE.replace(SPHERE, 'file = "leg.STL"\nscale = 0.001')
    (tmp_path / "s.toml").write_text(text)
    scene = scenes.load(tmp_path / "s.toml")
    _, place, turn, *rates, _ = scene.motion.trajectory(mesh)
    expected = wrench(scene.medium, mesh, turn, place, *rates, scene.effects).force
    weight = [-0.2 * 9.81 * math.sin(math.radians(10)), 0.0, 0.0]
    force = scene.run(len(mesh.faces)).force
    assert force == pytest.approx(expected + weight, rel=1e-4, abs=1e-6)
    assert [p.name for p in scenes.inputs(scene)] == ["s.toml", "leg.STL"]
    again = scenes.parse(scenes.toml(dataclasses.replace(scene, triangles=301)))
    assert again.mesh.volume == scene.mesh.volume
    counts = [len(scene.intruder.mesh(n).faces) for n in scene.ladder[:2]]
    assert counts == [len(mesh.faces), 4 * len(mesh.faces)]


def test_an_open_mesh_is_a_sheet_where_its_scene_says_so(tmp_path):
    pytest.importorskip("trimesh")
    ball = shapes.sphere(0.02, 1)
    lower = ball.faces[ball.middles[:, 2] <= 0]
    write_stl(tmp_path / "a.stl", Mesh(ball.vertices, lower, closed=False))
    with pytest.raises(ValueError, match="the mesh is open: "):
        MeshFile(str(tmp_path / "a.stl"))
    sheet = MeshFile(str(tmp_path / "a.stl"), closed=False)
    assert sheet.mesh(1).areas.sum() > 0


@pytest.mark.parametrize(
    ("name", "data", "said"),
    [
        ("a.stl", b"", "is no STL mesh"),
        ("a.stl", b"hello", "is no STL mesh"),
        ("a.stl", b"\0" * 80 + b"\xff" * 4, "is no STL mesh"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\n", "is no OBJ mesh: it has no triangles"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 1 0 0\nf 1 2 3\n", "no area"),
        ("a.ply", b"ply\n", "is no PLY mesh"),
    ],
)
def test_files_that_are_no_mesh_are_refused(name, data, said, tmp_path):
    pytest.importorskip("trimesh")
    (tmp_path / name).write_bytes(data)
    with pytest.raises(ValueError, match=said):
        MeshFile(str(tmp_path / name))


# An open tetrahedron; its last face follows.
PLY = """ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
element face 3
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
0 1 0
0 0 1
3 0 1 3
3 0 3 2
"""
OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 4\nf 1 4 3\n"


def read_open(folder, kind, last):
    """Read the tetrahedron with its last face; no edge that lacks a neighbour gives a
    wrong one away."""
    pytest.importorskip("trimesh")
    path = folder / f"a.{kind}"
    path.write_text({"ply": PLY, "obj": OBJ}[kind] + last)
    return read(path, closed=False)


@pytest.mark.parametrize(
    ("kind", "last"),
    [("ply", "3 1 2 3\n"), ("obj", "f 2/1/1 3//-7 4\n"), ("obj", "f -3 -2 -1\n")],
)
def test_faces_name_vertices_from_the_first_or_the_last(kind, last, tmp_path):
    mesh = read_open(tmp_path, kind, last)
    assert len(mesh.faces) == 3
    assert mesh.volume == pytest.approx(1 / 6, abs=1e-12)


@pytest.mark.parametrize(
    ("kind", "last", "said"),
    [
        ("ply", "3 1 2 4\n", "a face names vertex 4, where vertices are 0 to 3"),
        ("ply", "3 1 2 -1\n", "a face names vertex -1, where vertices are 0 to 3"),
        ("ply", "4 1 2 -4 3\n", "a face names vertex -4, where vertices are 0 to 3"),
        ("obj", "f -3 -2 -1\nv 5 5 5\n", "a face counts vertices back, and vertices"),
        ("obj", "f 2 3 5\n", "is no OBJ mesh: 'index 4 is out of bounds"),
        ("obj", "f 2 3 -5\n", "is no OBJ mesh: 'index -5 is out of bounds"),
        ("obj", "f 0//1 2//1 -1//1", "a face names vertex 0, where vertices count"),
    ],
)
def test_faces_name_vertices_that_exist(kind, last, said, tmp_path):
    with pytest.raises(ValueError, match=f"^{tmp_path}.*{said}"):
        read_open(tmp_path, kind, last)


def test_without_trimesh_files_are_refused_and_shapes_go_on(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "trimesh", None)
    write_stl(tmp_path / "a.stl", BALL)
    with pytest.raises(ValueError, match=r"needs trimesh: pip install 'geomech\[mesh"):
        MeshFile(str(tmp_path / "a.stl"))
    assert scenes.load("sphere").run(100).force.any()


def test_pictures_show_the_stress_on_the_mesh():
    """Below the surface, and the faces above it."""
    scene = scenes.parse(MADE.replace("distance = 0.05", "distance = 0.001"))
    found = scene.run()
    step = np.linalg.norm(found.force, axis=-1).argmax()
    faces, above = scene.faces(found, step)
    _, place, turn, *rates, _ = (x[step] for x in found.trajectory)
    expected = bearing(scene.medium, scene.mesh, turn, place, *rates, scene.effects)
    np.testing.assert_array_equal(faces.force, expected.force)
    assert faces.corners[..., 2].max() <= 1e-12 < 2e-12 + above[..., 2].min()
    sides = [np.diff(t, axis=1).swapaxes(0, 1) for t in (faces.corners, above)]
    areas = [np.linalg.norm(np.cross(*side), axis=-1).sum() / 2 for side in sides]
    assert min(areas) > 0
    assert sum(areas) == pytest.approx(scene.mesh.areas.sum())
    axes = plots.intrusion_figure(scene, answer(scene)).axes
    lines = [line.get_ydata() for ax in axes for line in ax.lines]
    curves = [y for y in lines if len(y) == len(found.t)]
    np.testing.assert_array_equal(curves[:6], [*found.force.T, *found.moment.T])


def test_a_body_in_the_air_is_drawn_without_stress(tmp_path):
    text = MADE.replace("depth = 0.015", "depth = -0.5").replace("mass = 0.2", "")
    scene = scenes.parse(text)
    found = scene.run()
    assert not found.force.any()
    plots.save(plots.intrusion_figure(scene, answer(scene)), tmp_path / "a.png")
    faces, above = scene.faces(found, 0)
    assert (len(faces.triangle), len(above)) == (0, scene.count)


def test_figure_of_meshes(tmp_path):
    numbers = meshes.compute(ladder=(80, 320, 1280))
    orders = [order for _, _, order in numbers["errors"].values()]
    assert len(orders) == 4
    assert 0.8 < min(orders) < max(orders) < 1.3
    told = meshes.table(numbers)
    assert "alpha_z: correlation 0.93" in told
    assert "alpha_x: correlation 0.83" in told
    axes = {ax.get_title(): ax for ax in drawn(meshes, numbers, tmp_path).axes}
    n, error, order = numbers["errors"]["cylinder", "half out"]
    errors = axes["order in 1 / triangles (declared: 1)"]
    line = curve(errors, f"cylinder, half out: {order:.2f}")
    np.testing.assert_allclose(line, [n, error])
