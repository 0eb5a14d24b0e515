"""Intruder scenes of meshes: bodies, motions, files, and the commands that take them."""

import csv
import dataclasses
import math
import re
import sys

import numpy as np
import pytest
from artists import curve, drawn
from registry import GROUND_EFFECTS
from scipy.spatial.transform import Rotation
from tabled import of_json
from test_fuzz import VALUES, mutated
from test_intrude import outcome, refused

import geomech.scenes as scenes
from figures.terradynamics import meshes
from geomech import plots
from geomech.scenes import MeshScene
from geomech.shell.describe.scene import description
from geomech.studies.terradynamics.intrusion import answer
from rft.core.refusal import Refusal
from rft.terradynamics.meshes import (
    SOLIDS,
    Cylinder,
    Drag,
    Leg,
    Mesh,
    Path,
    Penetrate,
    Rotate,
    Screw,
    Spatial,
    Sphere,
    bearing,
    read,
    solids,
    wrench,
)
from rft.terradynamics.meshes.surfaces import shapes
from rft.terradynamics.plates import VERTICAL

pytestmark = pytest.mark.usefixtures("fastest")

NAMES = [n for n in scenes.intruder_names() if isinstance(scenes.load(n), MeshScene)]
BODIES = (
    Sphere(0.02),
    Cylinder(0.0127, 0.1),
    Screw(0.03, 0.015, 0.06, 0.18),
    Leg(0.038, 0.025, 0.003, 0.7),
)
MOTIONS = (
    Drag(0.03, 0.2, -0.4, 0.05, 0.08, (0.1, 0.2, -0.3), 5),
    Penetrate(0.03, 1.1, 0.6, 0.02, 0.5, 5),
    Rotate(-0.01, (1.0, 2.0, -1.0), -3.0, 1.0, -2.0, 0.3, 0.5, 0.2, 6),
)
MADE = """[medium]
density = 1500
internal_friction = 0.5
surface_friction = 0.3
grazing_deg = 3
[intruder]
kind = "mesh"
shape = "sphere"
radius = 0.02
[motion]
kind = "drag"
depth = 0.015
direction_deg = 20
heading_deg = 30
attitude_deg = [10, 0, 20]
distance = 0.05
samples = 5
[numerics]
triangles = 300
[[effects]]
kind = "slope"
angle_deg = 10
mass = 0.2
"""


def stl(path, mesh, scale=1.0):
    """Binary, by hand."""
    rows = np.zeros(
        len(mesh.faces), dtype=[("n", "<f4", 3), ("p", "<f4", (3, 3)), ("a", "<u2")]
    )
    rows["p"] = mesh.vertices[mesh.faces] * scale
    path.write_bytes(b" " * 80 + np.uint32(len(rows)).tobytes() + rows.tobytes())


def test_there_is_a_scene_of_every_body():
    assert {type(scenes.load(n).intruder) for n in NAMES} == set(SOLIDS.values())


@pytest.mark.parametrize("name", NAMES)
def test_scenes_of_meshes_run(name, geomech, tmp_path):
    shipped = scenes.load(name)
    assert scenes.toml(shipped) == shipped.text and name in geomech("scenes")[1]
    triangles = 5000 if name == "screw" else 2000
    (tmp_path / "coarse.toml").write_text(
        f"{shipped.text}\n[numerics]\ntriangles = {triangles}\n"
    )
    scene = scenes.load(tmp_path / "coarse.toml")
    code, out, err = geomech("intrude", "coarse.toml", "--json", "-o", "out.csv")
    assert (code, err) == (0, "")
    found = of_json(out)
    place = ["angle"] if isinstance(scene.motion, Rotate) else ["x", "y", "z"]
    assert 0 < float(found["largest_force_error"]) < 0.4
    assert int(found["finest_parts"].values) >= 3 * scene.count
    names = [f"{what}_{axis}" for what in ("force", "moment") for axis in "xyz"]
    assert {"t", *place, *names} <= set(found)
    np.testing.assert_array_equal(found["moment"], found["moment_y"])
    trajectory = scene.motion.trajectory(scene.mesh)
    k = len(trajectory.t) // 3
    turn, at, v, w = (
        trajectory.rotation[k],
        trajectory.place[k],
        trajectory.velocity[k],
        trajectory.spin[k],
    )
    wanted = wrench(scene.medium, scene.mesh, turn, at, v, w)
    np.testing.assert_allclose(
        [found[f"force_{a}"][k] for a in "xyz"], wanted.force, rtol=1e-12, atol=1e-15
    )
    np.testing.assert_allclose(
        [found[f"moment_{a}"][k] for a in "xyz"], wanted.moment, rtol=1e-12, atol=1e-15
    )
    with open(tmp_path / "out.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    for key in ("t", *place, *names):
        assert [float(row[key]) for row in rows] == found[key].values.tolist()


def test_strength_is_matched_to_the_vertical_plane_and_that_is_told(geomech, tmp_path):
    scene = scenes.load("sphere")
    plate = Spatial(scene.medium.xi_n, 0.4).stress([0.0, 0, -1], [0.0, 0, -1])[2]
    assert plate == pytest.approx(0.254e6, rel=1e-12)
    (tmp_path / "made.toml").write_text(MADE)
    assert (
        "matched to alpha_z(0, 90 degrees) of poppy-seeds-loose"
        in geomech("intrude", "sphere")[1]
    )
    assert "matched" not in geomech("intrude", "made.toml")[1]
    twice = scenes.parse(
        scene.text.replace("surface_friction", "zeta = 2.0\nsurface_friction")
    )
    assert (
        twice.medium.xi_n == pytest.approx(2 * scene.medium.xi_n)
        and "2 times alpha_z" in twice.matched
    )
    (tmp_path / "own.toml").write_text("[medium]\nzeta = 0.3\n")
    (tmp_path / "s.toml").write_text(
        scene.text.replace('name = "poppy-seeds-loose"', 'file = "own.toml"')
    )
    own = scenes.load(tmp_path / "s.toml")
    assert own.medium.xi_n * scene.medium.plate == pytest.approx(0.3e6)
    assert "of own.toml in" in own.matched and own.files == (
        str(tmp_path / "own.toml"),
    )
    assert scenes.parse(MADE).medium.xi_n == Spatial.from_grains(1500, 0.5).xi_n


def test_a_leg_of_three_dimensions_is_like_that_of_two():
    """Thin and smooth, peaks of lift and drive are within a third of the flat one's, at angles 20 degrees off at most."""
    solid, flat = scenes.load("extruded-c-leg").run(), scenes.load("c-leg").run()
    for k in (0, 1):
        one, two = solid.force[:, 2 * k], flat.force[:, k]
        assert one.max() == pytest.approx(two.max(), rel=0.3)
        at = solid.trajectory.angle[one.argmax()], flat.pose[two.argmax(), 2]
        assert abs(np.degrees(at[0] - at[1])) < 20
    assert np.abs(solid.force[:, 1]).max() < 1e-12
    assert solid.moment[:, 1].min() == pytest.approx(flat.moment.min(), rel=0.2)


def test_the_coarsest_meshes_still_are_the_bodies():
    share = [body.mesh(1).volume / body.mesh(20_000).volume for body in BODIES]
    assert share == pytest.approx([0.606, 0.901, 0.915, 0.975], abs=1e-3)


@pytest.mark.parametrize("motion", MOTIONS, ids=["drag", "penetrate", "rotate"])
@pytest.mark.parametrize("body", BODIES, ids=["sphere", "cylinder", "screw", "leg"])
def test_velocities_are_those_of_the_poses(body, motion):
    """Against differences between poses close by."""
    mesh = body.mesh(200)
    dense = dataclasses.replace(motion, samples=4001).trajectory(mesh)
    h, k = dense.t[1], 1234
    np.testing.assert_allclose(
        (dense.place[k + 1] - dense.place[k - 1]) / (2 * h),
        dense.velocity[k],
        atol=1e-9,
    )
    turn = Rotation.from_matrix(
        dense.rotation[k + 1] @ dense.rotation[k - 1].T
    ).as_rotvec() / (2 * h)
    np.testing.assert_allclose(turn, dense.spin[k], atol=1e-9)
    if isinstance(motion, Penetrate):
        lowest = (mesh.vertices @ dense.rotation[0].T + dense.place[[0, -1], None])[
            ..., 2
        ].min(1)
        np.testing.assert_allclose(lowest, [0.0, -motion.depth], atol=1e-12)


def test_motions_go_where_their_angles_say():
    """Along closed forms, with level, upright and oblique ways; a turn of the body about y by default."""
    ball = Sphere(0.02).mesh(100)
    for heading, direction, way in (
        (0.0, 0.0, (1, 0, 0)),
        (0.0, np.pi / 2, (0, 0, -1)),
        (np.pi / 2, 0.0, (0, 1, 0)),
        (
            2.0,
            -0.5,
            (np.cos(0.5) * np.cos(2.0), np.cos(0.5) * np.sin(2.0), np.sin(0.5)),
        ),
    ):
        p = Drag(0.05, direction, heading, speed=0.2, distance=0.3).trajectory(ball)
        np.testing.assert_allclose(
            p.place[-1], [0, 0, -0.05] + 0.3 * np.array(way), atol=1e-15
        )
        np.testing.assert_allclose(p.velocity[7], 0.2 * np.array(way), atol=1e-16)
        assert (p.velocity[7] == 0.0).tolist() == [
            x == 0 for x in way
        ]  # to the last digit
        assert p.t[-1] == pytest.approx(1.5) and not p.angle.any()
    p = Penetrate(0.03, direction=2.0, heading=-1.0).trajectory(ball)
    assert p.place[-1] == pytest.approx(
        [0.03 / np.tan(2.0) * np.cos(1.0), -0.03 / np.tan(2.0) * np.sin(1.0), -0.01]
    )
    turned = Rotate(0.04, start=-1.0, stop=0.5).trajectory(ball)
    assert turned.spin[0] == pytest.approx([0, 2 * np.pi, 0]) and turned.angle[
        [0, -1]
    ] == pytest.approx([-1.0, 0.5])
    np.testing.assert_allclose(
        turned.rotation[-1] @ [0, 0, -1], [-np.sin(0.5), 0, -np.cos(0.5)], atol=1e-15
    )
    t = np.arange(3.0)
    assert not Path(t, t, 0 * t, 0 * t).trajectory(ball).angle.any()


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Drag(0.1, heading=-11.0), "heading must be"),
        (lambda: Drag(0.1, direction=11.0), "direction must be"),
        (lambda: Drag(-11.0), "depth must be"),
        (lambda: Penetrate(0.0), "depth must be"),
        (lambda: Penetrate(0.1, direction=0.0), "direction must point downwards"),
        (lambda: Path((0, 1), (0, 1), (0, 1), (0, 1)), "3 to"),
        (
            lambda: Path((0, 1, 2), *[(0, 0, 0)] * 4, (0, 1, 3.5), (0, 0, 0)),
            "2 rad or more after t = 1",
        ),
        (lambda: Path((0, 2, 1), *[(0, 0, 0)] * 3), "t must ascend"),
        (lambda: Sphere(0.1).mesh(2.5), "whole number"),
    ],
)
def test_motions_and_counts_that_make_no_sense_are_refused(make, said):
    with pytest.raises(ValueError, match=said):
        make()


def test_a_path_of_poses_gives_the_motion_it_was_taken_from(geomech, tmp_path):
    """A steady rotation about an oblique axis, with the hub moving, from a CSV file."""
    made = MADE.replace("sphere", "c-leg").replace(
        "radius", "width = 0.02\nthickness = 0.004\nradius"
    )
    motion = Rotate(0.01, (1.0, 2.0, -1.0), 3.0, -1.0, 1.5, 0.1, 0.5, 0.2, 21)
    straight = dataclasses.replace(scenes.parse(made), motion=motion).run()
    p = straight.trajectory
    rows = np.column_stack(
        [p.t, p.place, Rotation.from_matrix(p.rotation).as_rotvec()]
    ).tolist()
    (tmp_path / "p.csv").write_text(
        "t,x,y,z,rx,ry,rz\n" + "\n".join(",".join(map(repr, row)) for row in rows)
    )
    parts = made[: made.index("[motion]")], made[made.index("[numerics]") :]
    (tmp_path / "s.toml").write_text(
        f'{parts[0]}[motion]\nkind = "csv"\nfile = "p.csv"\n{parts[1]}'
    )
    found = of_json(geomech("intrude", "s.toml", "--json")[1])
    assert list(found)[:4] == ["t", "x", "y", "z"]
    force = np.stack([found[f"force_{a}"] for a in "xyz"], -1)
    assert np.abs(straight.force).max() > 0.1
    np.testing.assert_allclose(force, straight.force, atol=1e-12)


def test_velocities_of_a_path_are_of_order_2():
    turns = lambda t: Rotation.from_rotvec(np.stack([np.sin(2 * t), t**2, 1 - t], -1))
    errors = []
    for samples in (50, 100, 200):
        t = 0.1 + np.linspace(0, 1, samples) ** 1.2
        exact = (turns(t + 1e-6) * turns(t - 1e-6).inv()).as_rotvec() / 2e-6
        found = Path(t, np.sin(t), 0 * t, t**3 / 5, *turns(t).as_rotvec().T).trajectory(
            None
        )
        errors.append(
            [
                np.abs(found.spin - exact).max(),
                np.abs(found.velocity[:, 0] - np.cos(t)).max(),
            ]
        )
    assert np.max(errors[-1]) < 2e-4
    assert (np.log2(np.divide(errors[0], errors[-1])) / 2 > 1.8).all()


def test_meshes_of_files(geomech, tmp_path, monkeypatch):
    pytest.importorskip("trimesh")
    mesh = shapes.leg(0.038, -1.0, 0.003, 0.025, 40, 6, 1)
    stl(tmp_path / "leg.STL", mesh, 1000)
    text = MADE.replace(
        'shape = "sphere"\nradius = 0.02', 'file = "leg.STL"\nscale = 0.001'
    )
    (tmp_path / "s.toml").write_text(text)
    scene = scenes.load(tmp_path / "s.toml")
    assert [p.name for p in scenes.inputs(scene)] == ["s.toml", "leg.STL"]
    assert (
        scenes.parse(scenes.toml(dataclasses.replace(scene, triangles=301))).mesh.volume
        == scene.mesh.volume
    )
    p = scene.motion.trajectory(mesh)
    wanted = wrench(
        scene.medium, mesh, p.rotation, p.place, p.velocity, p.spin, scene.effects
    )
    weight = [-0.2 * 9.81 * math.sin(math.radians(10)), 0.0, 0.0]
    assert scene.run(len(mesh.faces)).force == pytest.approx(
        wanted.force + weight, rel=1e-4, abs=1e-6
    )
    assert [len(scene.intruder.mesh(n).faces) for n in scene.ladder[:2]] == [
        len(mesh.faces),
        4 * len(mesh.faces),
    ]
    n = len(mesh.faces)
    for finest, ladder in (
        (5 * n, (n, 4 * n)),
        (n - 1, (n, n)),
    ):  # a finer mesh that is within reach, and none
        monkeypatch.setattr(solids, "FINEST", finest)
        assert scene.ladder == ladder
    refused(
        geomech("intrude", "s.toml", "-o", "leg.csv", "--plot", "leg.STL"),
        "end the name in .png",
    )


@pytest.mark.parametrize(
    ("part", "scale", "said"),
    [
        (0.5, 1.0, "the mesh is open: "),
        (1.0, 1e3, "give scale, 0.001 if it is in mm"),
    ],
)
def test_bad_mesh_files_get_one_line(part, scale, said, geomech, tmp_path):
    pytest.importorskip("trimesh")
    ball = shapes.sphere(0.02, 1)
    kept = ball.faces[ball.middles[:, 2] <= ball.middles[:, 2].max() * (2 * part - 1)]
    stl(tmp_path / "a.stl", Mesh(ball.vertices, kept, closed=False), scale)
    (tmp_path / "s.toml").write_text(
        MADE.replace('shape = "sphere"\nradius = 0.02', 'file = "a.stl"')
    )
    refused(geomech("intrude", "s.toml", "--plot", "a.png"), said)
    assert not (tmp_path / "a.png").exists()
    if scale == 1.0:
        (tmp_path / "s.toml").write_text(
            MADE.replace(
                'shape = "sphere"\nradius = 0.02', 'file = "a.stl"\nclosed = false'
            )
        )
        assert geomech("intrude", "s.toml")[0] == 0


@pytest.mark.parametrize(
    ("name", "data", "said"),
    [
        ("a.stl", b"", "is no STL mesh"),
        ("a.stl", b"hello", "is no STL mesh"),
        ("a.stl", b"\0" * 80 + b"\xff" * 4, "is no STL mesh"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\n", "is no OBJ mesh: it has no triangles"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "is no OBJ mesh"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 1 0 0\nf 1 2 3\n", "no area"),
        ("a.ply", b"ply\n", "is no PLY mesh"),
        ("a.step", b"", "a mesh is an .stl, .obj or .ply file"),
        ("gone.stl", None, "No such file"),
        (".", None, "a mesh is an .stl"),
    ],
)
def test_files_that_are_no_mesh_get_one_line(name, data, said, geomech, tmp_path):
    pytest.importorskip("trimesh")
    if data is not None:
        (tmp_path / name).write_bytes(data)
    (tmp_path / "s.toml").write_text(
        MADE.replace('shape = "sphere"\nradius = 0.02', f'file = "{name}"')
    )
    refused(geomech("intrude", "s.toml"), said)


PLY = b"""ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
element face 4
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
0 1 0
0 0 1
3 0 2 1
3 0 1 3
3 0 3 2
3 1 2 3
"""
OBJ = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
LAST = {PLY: b"3 1 2 3\n", OBJ: b"f 2 3 4\n"}


@pytest.mark.parametrize("closed", [True, False])
@pytest.mark.parametrize(
    ("whole", "last", "said"),
    [
        (PLY, b"3 1 2 3\n", None),
        (PLY, b"3 1 2 9\n", "a face names vertex 9, where vertices are 0 to 3"),
        (PLY, b"3 1 2 4\n", "a face names vertex 4, where vertices are 0 to 3"),
        (PLY, b"3 1 2 -1\n", "a face names vertex -1, where vertices are 0 to 3"),
        (PLY, b"4 1 2 -4 3\n", "a face names vertex -4, where vertices are 0 to 3"),
        (OBJ, b"f 2/1/1 3//-7 4\n", None),
        (OBJ, b"f -3 -2 -1\n", None),
        (
            OBJ,
            b"f -3 -2 -1\nv 5 5 5\n",
            "a face counts vertices back, and vertices follow it: count from 1, or",
        ),
        (OBJ, b"f 2 3 5\n", "is no OBJ mesh: 'index 4 is out of bounds"),
        (OBJ, b"f 2 3 -5\n", "is no OBJ mesh: 'index -5 is out of bounds"),
        (OBJ, b"f 2 3 0\n", "a face names vertex 0, where vertices count from 1"),
        (
            OBJ,
            b"f 0//1 2//1 -1//1",
            "a face names vertex 0, where vertices count from 1",
        ),
    ],
)
def test_faces_name_vertices_that_exist(whole, last, said, closed, tmp_path):
    """An open mesh, too, which no edge that lacks a neighbour gives away."""
    pytest.importorskip("trimesh")
    if not closed:  # of the tetrahedron one face is left out: the first
        for row in (b"3 0 2 1\n", b"f 1 3 2\n"):
            whole = whole.replace(row, b"")
        whole = whole.replace(b"element face 4", b"element face 3")
    is_ply = whole.startswith(b"ply")
    path = tmp_path / ("a.ply" if is_ply else "a.obj")
    path.write_bytes(whole.replace(LAST[PLY if is_ply else OBJ], last))
    if said is None:
        mesh = read(path, closed)
        assert len(mesh.faces) == 3 + closed
        assert mesh.volume == pytest.approx(1 / 6, abs=1e-12)
        return
    with pytest.raises(ValueError, match=re.escape(said)) as error:
        read(path, closed)
    assert str(error.value).startswith(f"{path}")


@pytest.mark.parametrize("bad", [9, -1])
def test_a_mesh_of_arrays_names_vertices_that_exist(bad):
    with pytest.raises(
        ValueError, match=f"a face names vertex {bad}, where vertices are 0 to 3"
    ):
        Mesh(np.eye(4, 3), np.array([[0, 2, 1], [0, 1, bad]]), closed=False)


def test_without_trimesh_files_are_refused_and_shapes_go_on(
    geomech, tmp_path, monkeypatch
):
    monkeypatch.setitem(sys.modules, "trimesh", None)
    stl(tmp_path / "a.stl", shapes.sphere(0.02, 1))
    (tmp_path / "s.toml").write_text(
        MADE.replace('shape = "sphere"\nradius = 0.02', 'file = "a.stl"')
    )
    refused(geomech("intrude", "s.toml"), "needs trimesh: pip install 'geomech[mesh]'")
    assert geomech("intrude", "sphere")[0] == 0


REFUSED = [
    (
        "density = 1500",
        "",
        "give 'xi_n' (N/m^3), or 'density' and 'internal_friction', or 'name' or",
    ),
    ("density = 1500", "xi_n = 3e5", "give 'xi_n' (N/m^3), or"),
    (
        "density = 1500\ninternal_friction = 0.5",
        "xi_n = 0.2",
        "xi_n must be a number from 1",
    ),
    (
        "density = 1500\ninternal_friction = 0.5",
        'name = "poppy"',
        "[medium] name: 'poppy' is unknown",
    ),
    (
        "density = 1500",
        "density = nan",
        "density must be a number from 1 to 100000 kg/m^3",
    ),
    (
        "surface_friction = 0.3",
        "surface_friction = -1",
        "surface_friction must be a number",
    ),
    ("surface_friction = 0.3", "friction = 0.3", "[medium] key: 'friction' is unknown"),
    (
        "surface_friction = 0.3",
        'tension = "pull"',
        "tension must be one of cut, keep, push",
    ),
    (
        'shape = "sphere"',
        "",
        "has no 'shape': add shape = one of sphere, cylinder, screw, c-leg, or file",
    ),
    (
        'shape = "sphere"',
        'shape = "spere"',
        "[intruder] shape: 'spere' is unknown: did you mean 'sphere'",
    ),
    (
        'shape = "sphere"',
        'shape = "sphere"\nfile = "a.stl"',
        "'file' is unknown: use one of radius",
    ),
    ('kind = "mesh"', 'kind = "sphere"', "'shape' is unknown: use one of radius"),
    ("radius = 0.02", "radius = 20", "radius must be a number from 1e-06 to 10 m"),
    (
        "radius = 0.02",
        "radius = 0.02\nlength = 0.1",
        "[intruder] key: 'length' is unknown",
    ),
    (
        "attitude_deg = [10, 0, 20]",
        "attitude_deg = [10, 0]",
        "attitude must be an angle about y or a rotation vector of three numbers, within 10 rad, got",
    ),
    ('kind = "drag"', 'kind = "rotate"', "[motion] key: 'depth' is unknown"),
    ("triangles = 300", "triangles = 0", "triangles must be a whole number from 1"),
    ("triangles = 300", "elements = 300", "[numerics] key: 'elements' is unknown"),
    ('kind = "slope"', 'kind = "hill"', "[[effects]] kind: 'hill' is unknown"),
    ("angle_deg = 10", "angle_deg = 38", "a slope of 38 degrees slides by itself"),
    (
        "mass = 0.2",
        'mass = 0.2\n[[effects]]\nkind = "slope"\nangle = 0.1',
        "slope stands twice",
    ),
]


@pytest.mark.parametrize(
    ("old", "new", "said"), REFUSED, ids=[said for *_, said in REFUSED]
)
def test_what_makes_no_sense_is_refused(old, new, said):
    assert old in MADE
    with pytest.raises(Refusal) as caught:
        scenes.parse(MADE.replace(old, new), "made")
    assert said in str(caught.value) and str(caught.value).startswith("made")
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 450


def test_what_is_written_reads_the_same():
    for k, body in enumerate(BODIES):
        effects = (
            GROUND_EFFECTS["disturbed-ground"][0](0.3),
            GROUND_EFFECTS["aeration"][0](0.2),
        )[: k % 3]
        scene = MeshScene(
            Spatial(2.5e5, 0.3, "keep", 0.1),
            body,
            MOTIONS[k % 3],
            triangles=70,
            effects=effects,
        )
        assert scenes.parse(scenes.toml(scene)) == scene


def test_a_scene_made_in_python_says_what_is_wrong():
    scene = MeshScene(Spatial(3e5), BODIES[0], MOTIONS[0], triangles=80)
    assert scene.run().force.shape == (5, 3)
    for part, said in (
        ("medium", "a medium such as"),
        ("intruder", "a solid such as"),
        ("motion", "a motion of rft.terradynamics.meshes"),
    ):
        with pytest.raises(ValueError, match=said):
            dataclasses.replace(scene, **{part: VERTICAL["generic"].stress})


def test_accuracy_of_the_number_of_triangles(geomech, tmp_path, monkeypatch):
    monkeypatch.setattr(type(BODIES[0]), "ladder", (80, 320, 1280, 5120))
    (tmp_path / "s.toml").write_text(MADE)
    code, out, err = geomech("accuracy", "s.toml", "--json")
    assert (code, err) == (0, "")
    found = of_json(out)
    facts = found.attributes
    assert facts["parts"] == "triangles" and facts["finest"] == 5120
    assert found["value"].values.tolist() == [[80, 320, 1280]]
    assert found["order_by_theory"].values.tolist() == ["1"]
    assert 0.8 < found["force_order"][0] < 1.3 and found["moment_error"][0, -1] < 0.02
    assert found["best_setting"][0] == "triangles"
    assert "triangles 80 to 1280: " in str(found)


def test_pictures_show_the_stress_on_the_mesh():
    scene = scenes.parse(MADE.replace("distance = 0.05", "distance = 0.001"))
    found = scene.run()
    fig = plots.intrusion_figure(scene, answer(scene))
    step = np.linalg.norm(found.force, axis=-1).argmax()
    faces, above = scene.faces(found, step)
    solid = next(ax for ax in fig.axes if ax.name == "3d")
    assert len(solid.collections[0].get_facecolor()) <= len(faces.triangle) + len(above)
    p = [x[step] for x in found.trajectory]
    wanted = bearing(scene.medium, scene.mesh, p[2], p[1], p[3], p[4], scene.effects)
    np.testing.assert_array_equal(faces.force, wanted.force)
    assert (
        above[..., 2].min() >= -1e-12
        and faces.corners[..., 2].max() <= 1e-12
        and len(above)
        and len(faces.triangle)
    )
    areas = lambda t: (
        np.linalg.norm(np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]), axis=-1).sum()
        / 2
    )
    assert areas(faces.corners) + areas(above) == pytest.approx(scene.mesh.areas.sum())
    lines = [
        line
        for ax in fig.axes
        for line in ax.lines
        if len(line.get_xdata()) == len(found.t)
    ]
    for line, values in zip(lines, [*found.force.T, *found.moment.T]):
        np.testing.assert_array_equal(line.get_ydata(), values)


def test_a_body_in_the_air_is_drawn_without_stress(tmp_path):
    scene = scenes.parse(
        MADE.replace("depth = 0.015", "depth = -0.5").replace("mass = 0.2", "")
    )
    found = scene.run()
    assert not found.force.any()
    fig = plots.intrusion_figure(scene, answer(scene))
    plots.save(fig, tmp_path / "a.png")
    faces, above = scene.faces(found, 0)
    assert len(faces.triangle) == 0 and len(above) == scene.count


def test_figure_of_meshes(tmp_path):
    numbers = meshes.compute(ladder=(80, 320, 1280))
    orders = {name: order for name, (_, _, order) in numbers["errors"].items()}
    assert len(orders) == 4 and all(0.8 < order < 1.3 for order in orders.values())
    told = meshes.table(numbers)
    assert "alpha_z: correlation 0.93" in told and "alpha_x: correlation 0.83" in told
    axes = {ax.get_title(): ax for ax in drawn(meshes, numbers, tmp_path).axes}
    n, error, order = numbers["errors"]["cylinder", "half out"]
    errors = axes["order in 1 / triangles (declared: 1)"]
    np.testing.assert_allclose(
        curve(errors, f"cylinder, half out: {order:.2f}"), [n, error]
    )
    across = axes["all angles, r = 0.93"].lines[0].get_xydata()
    np.testing.assert_allclose(
        across.T, [numbers["two"][1].ravel(), numbers["three"][1].ravel()]
    )


def test_explain_tells_effects_and_what_they_assume():
    told = description(scenes.parse(MADE))
    assert (
        "Sphere (radius = 0.02) of 320 triangles" in told
        and "on:  slope (angle = 0.174" in told
    )
    assert "assumes an angle of repose of 37.9 degrees" in told
    assert "off, not evaluated: aeration, disturbed-ground, grain-inertia" in told
    assert (
        "off, not evaluated: aeration, disturbed-ground, grain-inertia, slope"
        in description(scenes.load("c-leg"))
    )


@pytest.mark.parametrize("seed", range(2))
def test_mutated_scenes_of_meshes_are_run_or_refused(seed):
    rng = np.random.default_rng(seed)
    texts = [
        MADE,
        *(scenes.load(name).text + "[numerics]\ntriangles = 100\n" for name in NAMES),
    ]
    values = [
        *VALUES,
        '"cut"',
        '"screw"',
        '"mesh"',
        "[0, 0, 1]",
        "360",
        "-0.04",
        "[[1]]",
        '"rotate"',
    ]
    keys = "kind shape xi_n name zeta tension grazing radius length core axis heading_deg rate start stop_deg samples"
    keys = f"{keys} triangles attitude speed depth angle mass repose_deg".split()
    seen = [
        outcome(mutated(texts[rng.integers(len(texts))], rng, keys, values))
        for _ in range(150)
    ]
    assert seen.count("run") > 10 and seen.count("refused") > 50
