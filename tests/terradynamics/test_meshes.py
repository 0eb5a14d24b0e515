"""Solid bodies: their meshes and motions, and files of meshes."""

import dataclasses
import math
import re
import sys

import numpy as np
import pytest
from frozen import FOLDER
from scipy.spatial.transform import Rotation

from geomech import scenes
from geomech.scenes import MeshScene
from rft.terradynamics.meshes import (
    SOLIDS,
    Cylinder,
    Drag,
    Leg,
    MeshFile,
    Path,
    Penetrate,
    Rotate,
    Screw,
    Sphere,
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
    ("name", "zeta", "strength"),
    [
        ("poppy-seeds-loose", "", 0.254e6),
        ("poppy-seeds-loose", "zeta = 2.0\n", 0.508e6),
        ("own.toml", "", 0.3e6),
    ],
)
def test_strength_is_matched_to_the_vertical_plane(name, zeta, strength, tmp_path):
    """So that a level plate that is pushed down bears the same."""
    (tmp_path / "own.toml").write_text("[medium]\nzeta = 0.3\n")
    key = "file" if name == "own.toml" else "name"
    text = scenes.load("sphere").text
    text = text.replace('name = "poppy-seeds-loose"', f'{key} = "{name}"\n{zeta}')
    (tmp_path / "s.toml").write_text(text)
    scene = scenes.load(tmp_path / "s.toml")
    down = [0.0, 0.0, -1.0]
    assert scene.medium.stress(down, down)[2] == pytest.approx(strength)


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
    assert path.t[-1] == pytest.approx(1.5)


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
    counts = [len(scene.intruder.mesh(n).faces) for n in scene.ladder[:2]]
    assert counts == [len(mesh.faces), 4 * len(mesh.faces)]


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
        ("ply", "3 1 2 4\n", "a face names vertex 4, but vertices are numbered 0 to 3"),
        (
            "ply",
            "3 1 2 -1\n",
            "a face names vertex -1, but vertices are numbered 0 to 3",
        ),
        (
            "ply",
            "4 1 2 -4 3\n",
            "a face names vertex -4, but vertices are numbered 0 to 3",
        ),
        (
            "obj",
            "f -3 -2 -1\nv 5 5 5\n",
            "a face counts vertices backwards, but vertices",
        ),
        ("obj", "f 2 3 5\n", "is not a valid OBJ mesh: 'index 4 is out of bounds"),
        ("obj", "f 2 3 -5\n", "is not a valid OBJ mesh: 'index -5 is out of bounds"),
        ("obj", "f 0//1 2//1 -1//1", "a face names vertex 0, where vertices count"),
    ],
)
def test_faces_name_vertices_that_exist(kind, last, said, tmp_path):
    with pytest.raises(ValueError, match=f"^{tmp_path}.*{said}"):
        read_open(tmp_path, kind, last)


def test_without_trimesh_files_are_refused(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "trimesh", None)
    write_stl(tmp_path / "a.stl", BALL)
    with pytest.raises(ValueError, match=r"needs trimesh: pip install 'geomech\[mesh"):
        MeshFile(str(tmp_path / "a.stl"))
