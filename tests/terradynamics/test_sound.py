"""Meshes as other programs write them: what grains touch of them, and what is told."""

import logging

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import geomech
from rft.core.notes import Note
from rft.core.refusal import Refusal
from rft.terradynamics.meshes import Mesh, MeshFile, Spatial, read, wrench
from rft.terradynamics.meshes.geoms import mesh_of_elements
from rft.terradynamics.meshes.surfaces import shapes
from rft.terradynamics.meshes.surfaces.merged import resize_faces
from rft.terradynamics.meshes.surfaces.sound import sound

BALL = shapes.sphere(0.02, 2)
BOX = shapes.box((0.02, 0.02, 0.02), 2)
CUBE = shapes.box((0.02, 0.02, 0.02), 1)
HALF = shapes.box((0.01, 0.02, 0.02), (1, 2, 2))
BAR = shapes.box((0.1, 0.01, 0.01), 1)
LOWER = BALL.faces[BALL.middles[:, 2] < 0]
DOWN = {"rotation": np.eye(3), "velocity": [0, 0, -0.1], "spin": [0, 0, 0]}


def placed(mesh, at=0.0, scale=1.0, inside_out=False):
    """Return vertices and faces of a mesh elsewhere."""
    faces = mesh.faces[:, ::-1] if inside_out else mesh.faces
    return mesh.vertices * scale + np.array(at), faces


def joined(*parts):
    """Return vertices and faces of several parts, none of which share a vertex."""
    starts = np.cumsum([0, *[len(vertices) for vertices, _ in parts]])
    faces = [faces + start for (_, faces), start in zip(parts, starts)]
    return np.concatenate([vertices for vertices, _ in parts]), np.concatenate(faces)


def some_reversed(faces, step):
    """Return faces of which each ``step``-th runs the other way."""
    out = faces.copy()
    out[::step] = out[::step, ::-1]
    return out


def soup():
    """Return triangles that share no corner, each corner rounded for itself."""
    corners = BALL.vertices[BALL.faces].reshape(-1, 3)
    noise = np.random.default_rng(1).normal(size=corners.shape)
    return corners + 4e-9 * noise, np.arange(len(corners)).reshape(-1, 3)


def with_corner_on_an_edge(with_flat):
    """Return a box of which a triangle is cut in two at an edge, its neighbour not."""
    a, b, c = CUBE.faces[0]
    m = len(CUBE.vertices)
    middle = (CUBE.vertices[a] + CUBE.vertices[b]) / 2
    faces = [*CUBE.faces[1:], (a, m, c), (m, b, c)]
    faces += [(b, m, a)] if with_flat else []
    return np.vstack([CUBE.vertices, middle]), np.array(faces)


INNER = placed(BALL, scale=0.8, inside_out=True)
EQUAL_TO_THE_BALL = {
    "inside out": placed(BALL, inside_out=True),
    "mixed winding": (BALL.vertices, some_reversed(BALL.faces, 3)),
    "cavity": joined(placed(BALL), INNER),
    "cavity wound outwards": joined(placed(BALL), placed(BALL, scale=0.8)),
    "outer shell inside out": joined(placed(BALL, inside_out=True), INNER),
    "shells in shells": joined(
        placed(BALL), INNER, placed(BALL, scale=0.6), placed(BALL, 0.004, 0.1)
    ),
    "open scrap inside": joined(placed(BALL), (BALL.vertices / 2, BALL.faces[:20])),
    "doubles": (BALL.vertices, np.concatenate([BALL.faces, BALL.faces[:7]])),
    "doubles, reversed": (
        BALL.vertices,
        np.concatenate([BALL.faces, BALL.faces[:7, ::-1]]),
    ),
    "twice": joined(placed(BALL), placed(BALL)),
    "twice, reversed": joined(placed(BALL), placed(BALL, inside_out=True)),
    "a triangle missing": (BALL.vertices, BALL.faces[1:]),
    "rounded corners": soup(),
}


def with_a_wall():
    """Return the box with a wall of single triangles across its middle."""
    rim = np.flatnonzero(np.abs(BOX.vertices[:, 0]) < 1e-12)
    y, z = BOX.vertices[rim, 1:].T
    rim = rim[np.argsort(np.arctan2(z, y))]
    middle = np.full(len(rim), len(BOX.vertices))
    wall = np.stack([middle, rim, np.roll(rim, -1)], -1)
    return np.vstack([BOX.vertices, [0, 0, 0]]), np.concatenate([BOX.faces, wall])


EQUAL_TO_THE_BOX = {
    "a wall across": with_a_wall(),
    "halves with a wall between": joined(
        placed(HALF, (-0.005, 0, 0)), placed(HALF, (0.005, 0, 0))
    ),
    "a corner on an edge": with_corner_on_an_edge(False),
    "a triangle without area": with_corner_on_an_edge(True),
    "one of twelve missing": (CUBE.vertices, CUBE.faces[1:]),
}


def force(mesh):
    return wrench(Spatial(3e5), mesh, place=[0, 0, -0.1], **DOWN).force


@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize(
    ("like", "triangles"),
    [(BALL, x) for x in EQUAL_TO_THE_BALL.values()]
    + [(BOX, x) for x in EQUAL_TO_THE_BOX.values()],
    ids=[*EQUAL_TO_THE_BALL, *EQUAL_TO_THE_BOX],
)
def test_a_mesh_bears_what_grains_touch_of_it(like, triangles, seed):
    """In any place and order; moved by hand, in single precision as files have it."""
    vertices, faces = triangles
    random = np.random.default_rng(seed)
    turn = Rotation.random(random_state=seed).as_matrix()
    moved = (vertices @ turn.T + 0.05 * random.normal(size=3)).astype(np.float32)
    mesh = sound(moved, random.permutation(faces)).mesh
    middle = mesh.vertices.min(0) / 2 + mesh.vertices.max(0) / 2
    back = Mesh((mesh.vertices - middle) @ turn, mesh.faces)
    assert back.volume == pytest.approx(like.volume, rel=1e-4)
    assert force(back) == pytest.approx(force(like), rel=2e-4, abs=1e-5)


@pytest.mark.parametrize("k", range(12))
def test_triangles_without_area_are_merged_with_others(k):
    """Whichever triangle of a box has a corner on an edge."""
    vertices, faces = with_corner_on_an_edge(True)
    order = np.roll(np.arange(len(faces)), k)
    mesh, notes = sound(vertices, faces[order])
    assert notes == ("1 triangle without area merged with others",)
    assert (len(mesh.faces), mesh.areas.min() > 1e-5) == (len(faces), True)
    assert force(mesh) == pytest.approx(force(CUBE), rel=1e-9)


@pytest.mark.parametrize("length", [0.002, 0.03])
@pytest.mark.parametrize("mesh", [BALL, CUBE, BAR])
def test_faces_of_another_size_enclose_the_same(mesh, length):
    """Their area vectors sum to 0, and point outwards."""
    resized = resize_faces(mesh, length, 10**5)
    areas = resized.areas[:, None] * resized.middle_normals
    assert np.abs(areas.sum(0)).max() < 1e-9 * mesh.areas.sum()
    volume = (areas * resized.middles).sum() / 3
    assert volume == pytest.approx(mesh.volume, rel=1e-9)


@pytest.mark.parametrize(
    "at", [0.05, (0.02, 0.02, 0), (0.02, 0.02, 0.02)], ids=["far", "edge", "corner"]
)
@pytest.mark.parametrize("inside_out", [False, True])
def test_two_bodies_stay_two(at, inside_out):
    mesh, notes = sound(*joined(placed(BOX), placed(BOX, at, inside_out=inside_out)))
    assert (len(mesh.faces), len(notes)) == (2 * len(BOX.faces), inside_out)
    assert mesh.volume == pytest.approx(2 * BOX.volume)


@pytest.mark.parametrize(
    "parts",
    [
        (placed(BALL), placed(BALL, 0.01)),
        (placed(BAR), (BAR.vertices[:, [1, 0, 2]] * 1.2, BAR.faces[:, ::-1])),
        (placed(BOX), placed(BOX, (0.02, 0.005, 0))),
        (placed(BOX), placed(BOX, (0, 0, 0.015), 0.5)),
    ],
    ids=["balls", "no corner inside", "faces in part", "face on face"],
)
@pytest.mark.parametrize("make", [sound, Mesh])
def test_parts_that_cross_or_touch_are_refused(parts, make):
    with pytest.raises(Refusal, match="intersect or touch"):
        make(*joined(*parts))


def test_sheets_are_sheets_and_bodies_are_not():
    cup = BALL.vertices, LOWER
    with pytest.raises(Refusal, match="closed = false if it is a sheet"):
        sound(*cup)
    for whole in (BALL.faces, BALL.faces[1:]):
        with pytest.raises(Refusal, match="leave closed = false out"):
            sound(BALL.vertices, whole, closed=False)
    sheet = sound(*cup, closed=False).mesh.two_sided
    back_to_back = np.concatenate([LOWER, LOWER[:, ::-1]])
    doubled = sound(BALL.vertices, back_to_back, closed=False).mesh.two_sided
    assert force(doubled) == pytest.approx(force(sheet), rel=1e-12)
    beside = joined(placed(BALL, (0.1, 0, 0)), cup)
    both = sound(*beside, closed=False).mesh
    assert force(both.two_sided) == pytest.approx(force(sheet) + force(BALL))


# A prism over an L, whose fan of triangles folds back on itself.
PRISM = """v 0 0 0
v 2 0 0
v 2 1 0
v 1 1 0
v 1 2 0
v 0 2 0
v 0 0 1
v 2 0 1
v 2 1 1
v 1 1 1
v 1 2 1
v 0 2 1
f 6 5 4 3 2 1
f 7 8 9 10 11 12
f 1 2 8 7
f 2 3 9 8
f 3 4 10 9
f 4 5 11 10
f 5 6 12 11
f 6 1 7 12
"""


def test_polygons_that_are_not_convex_are_refused(tmp_path):
    pytest.importorskip("trimesh")
    (tmp_path / "l.obj").write_text(PRISM)
    with pytest.raises(Refusal, match="not convex"):
        read(tmp_path / "l.obj", scale=0.01)


def ascii_stl(mesh, name="a"):
    rows = [f"solid {name}"]
    for triangle in mesh.vertices[mesh.faces]:
        rows += ["facet normal 0 0 0", "outer loop"]
        rows += ["vertex {:.9g} {:.9g} {:.9g}".format(*point) for point in triangle]
        rows += ["endloop", "endfacet"]
    return "\n".join([*rows, f"endsolid {name}", ""])


def obj(mesh):
    rows = ["v {:.9g} {:.9g} {:.9g}".format(*point) for point in mesh.vertices]
    rows += ["f {} {} {}".format(*face) for face in mesh.faces + 1]
    return "\n".join([*rows, ""])


def ply(mesh):
    n_vertices, n_faces = len(mesh.vertices), len(mesh.faces)
    rows = ["ply", "format ascii 1.0", f"element vertex {n_vertices}"]
    rows += [f"property float {axis}" for axis in "xyz"]
    rows += [f"element face {n_faces}", "property list uchar int vertex_indices"]
    rows += ["end_header", *obj(mesh).replace("v ", "").split("\n")[:n_vertices]]
    rows += ["3 {} {} {}".format(*face) for face in mesh.faces]
    return "\n".join([*rows, ""])


@pytest.fixture
def quiet(capfd):
    """Nothing that trimesh or NumPy print or log."""
    pytest.importorskip("trimesh")
    handler = logging.StreamHandler()
    logging.getLogger("trimesh").addHandler(handler)
    yield
    logging.getLogger("trimesh").removeHandler(handler)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("a.stl", ascii_stl(BOX, "a vertex of a solid")),
        ("a.stl", ascii_stl(BOX, "größe").encode("latin-1")),
        ("a.stl", ascii_stl(BOX).encode("utf-16")),
        ("a.stl", ascii_stl(BOX).replace("\n", "\r")),
        ("a.obj", "# größe\n".encode("latin-1") + obj(BOX).encode()),
        ("a.obj", obj(BOX).replace("\nf", "   # a note\n  f")),
        ("a.obj", obj(BOX).replace("\nf", "\ng a\nusemtl b\nf")),
        ("a.ply", ply(BOX).replace("\n", "\r\n")),
        ("a.ply", ply(BOX).replace("element", "comment TextureFile a.png\nelement", 1)),
        ("a.stl", ascii_stl(BOX).replace("normal 0 0 0", "normal 0,1 0 0")),
    ],
)
def test_texts_are_read_as_they_are_written(name, data, tmp_path, quiet):
    raw = data if isinstance(data, bytes) else data.encode()
    (tmp_path / name).write_bytes(raw)
    assert read(tmp_path / name).volume == pytest.approx(BOX.volume, rel=1e-6)


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # of modules of others
@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("a.stl", ascii_stl(BOX).replace(".", ",")),
        ("a.stl", ascii_stl(BOX)[:-200]),
        ("a.stl", ascii_stl(BALL).replace("endfacet", "endfacet x", 1)[:-300]),
        ("a.stl", b" " * 80 + b"\x03\0\0\0" + b"\0" * 120),
        ("a.obj", obj(BOX) + "f a b c\n"),
        ("a.obj", obj(BALL) + "f 1 2\nf 1 2 3 4 5 six\n"),
        ("a.ply", ply(BALL)[:-20]),
        ("a.ply", ply(BALL).replace("element face 320", "element face 321")),
        ("a.ply", ply(BOX).replace("property float y", "property float q")),
        ("a.ply", ply(BOX).replace("ascii", "binary_little_endian")),
    ],
)
def test_broken_files_are_refused(name, data, tmp_path, quiet):
    raw = data if isinstance(data, bytes) else data.encode()
    (tmp_path / name).write_bytes(raw)
    with pytest.raises(Refusal, match=name):
        read(tmp_path / name)


@pytest.mark.parametrize("scale", [1e-3, 100.0])
def test_a_size_that_is_likely_not_meant_is_noted(scale, tmp_path):
    pytest.importorskip("trimesh")
    (tmp_path / "a.obj").write_text(obj(BALL))
    MeshFile(str(tmp_path / "a.obj"))
    with pytest.warns(Note, match="m large"):
        MeshFile(str(tmp_path / "a.obj"), scale=scale)


def test_a_mesh_geom_bears_as_a_mesh_of_a_file():
    """MuJoCo takes both shells; the inner one touches no grains."""
    vertices, faces = joined(placed(BALL), INNER)
    numbers = [" ".join(map(str, x.ravel())) for x in (vertices, faces)]
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><asset><mesh name="m" vertex="{numbers[0]}" face="{numbers[1]}"/>
        </asset><worldbody><body><freejoint/><geom type="mesh" mesh="m"/></body>
        </worldbody></mujoco>"""
    )
    with pytest.warns(Note, match="shell inside another"):
        mesh = mesh_of_elements(model, 0)
    assert mesh.volume == pytest.approx(BALL.volume, rel=1e-5)


@pytest.mark.parametrize(
    "text", ["", "# nothing yet\n", "[medium]\n", '[medium]\ntension = "cut"\n']
)
def test_a_medium_without_a_strength_is_refused(text, tmp_path):
    file = tmp_path / "sand.toml"
    file.write_text(text)
    with pytest.raises(ValueError, match="sand.toml:? has no strength"):
        geomech.medium(file)
