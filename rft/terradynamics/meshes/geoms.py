"""Geoms of a MuJoCo model: their kinds and names, and their surfaces as triangles."""

from __future__ import annotations

import math

import mujoco
import numpy as np
from scipy.spatial import ConvexHull, QhullError

from rft.core.notes import warn
from rft.core.refusal import Refusal, formatted, located, require
from rft.terradynamics.meshes.surfaces import shapes, widened
from rft.terradynamics.meshes.surfaces.merged import resize_faces
from rft.terradynamics.meshes.surfaces.mesh import Mesh
from rft.terradynamics.meshes.surfaces.smooth import smooth
from rft.terradynamics.meshes.surfaces.sound import size_note, sound

MOST_FACES = 200_000  # of a geom's mesh, as in an STL file that MuJoCo takes
MOST_ELEMENTS = 100_000  # of a geom
ICOSAHEDRON = 1.0515  # edge of an icosahedron over its radius
FEWEST_AROUND = 8  # edges around round geoms of a given length of edges
# Edges of boxes and of meshes along half of the diagonal, by default; with fewer, a
# face that only just leads in part bears up to a tenth too much or too little.
PER_REACH = 5
PER_REACH_OF_MESH = 6
MOST_PIECES = 12  # of a slender round geom, by default


def mesh_of_elements(
    model: mujoco.MjModel,
    geom: int,
    length: float | None = None,
    hulls: bool = False,
    share: float = 1.0,
) -> Mesh:
    """Return the mesh of a geom in its own frame.

    length: m, of the edges, about; None for as many triangles as the shape of the geom
    needs, with which 90 % of random motions have an error of the force below 3 %, and
    none has one above 6 %. Of a mesh geom, triangles that are larger are halved, and
    those that are smaller are merged (`rft.terradynamics.meshes.surfaces.merged`).
    share: factor of the lengths of edges where ``length`` is None. hulls: whether the
    convex hull stands for a mesh without an inside."""
    kind = geom_kind(model, geom)
    size = np.array(model.geom_size[geom])
    if kind == "box":
        return _box(size, length, share)
    if kind == "capsule":
        cuts = _cuts_of_capsule(size[0], size[1], length)
        quarter, along = _scaled_cuts(cuts, share)
        _require_allowed(8 * quarter * (quarter + along))
        return widened.capsule(size[0], size[1], quarter, along)
    if kind == "cylinder":
        cuts = _cuts_of_cylinder(size[0], size[1], length)
        around, along, across = _scaled_cuts(cuts, share)
        _require_allowed(2 * around * (along + 2 * across))
        return widened.cylinder(size[0], size[1], around, along, across)
    if kind == "mesh":
        mesh = smooth(_solid_mesh(model, int(model.geom_dataid[geom]), hulls))
        reach = np.linalg.norm(np.ptp(mesh.vertices, axis=0)) / 2
        length = length or share * reach / PER_REACH_OF_MESH
        return resize_faces(mesh, length, MOST_ELEMENTS)

    radii = size if kind == "ellipsoid" else size[[0, 0, 0]]
    fineness = max(1, 2 + round(-math.log2(share)))
    if length:
        fineness = max(1, round(math.log2(ICOSAHEDRON * radii.max() / length)))
    _require_allowed(20 * 4**fineness)
    return widened.ellipsoid(radii, fineness)


def _box(half: np.ndarray, length: float | None, share: float) -> Mesh:
    """Return the mesh of a box with half its sides, m; for the rest see
    `mesh_of_elements`."""
    if length:
        cuts = _pieces(2 * half, length)
    else:
        cuts = _pieces(2 * half, np.linalg.norm(half) / PER_REACH)
        cuts = _scaled_cuts(np.maximum(cuts, 2), share)
    _require_allowed(4 * int(np.dot(cuts, np.roll(cuts, 1))))
    return shapes.box(2 * half, list(map(int, cuts)))


def _pieces(sides, length: float, fewest: int = 1) -> np.ndarray:
    """Return the numbers of pieces of at most a length, m, into which sides, m, are
    cut."""
    counts = np.ceil(np.atleast_1d(sides) / length - 1e-9)
    return np.clip(counts, fewest, 4096).astype(int)


def _scaled_cuts(cuts, share: float) -> list[int]:
    """Return numbers of pieces whose length is a share of that of the pieces in
    ``cuts``; even numbers stay even, for symmetry."""
    scaled = []
    for count in cuts:
        unit = 2 - int(count) % 2
        scaled.append(unit * max(1, round(count / unit / share)))
    return scaled


def _cuts_of_capsule(radius: float, half: float, length: float | None):
    """Return the number of edges along a quarter of the rim, and of pieces of the rod.
    half: half of its length, m."""
    if length:
        (quarter,) = _pieces(np.pi / 2 * radius, length, FEWEST_AROUND // 4)
        (along,) = _pieces(2 * half, length)
        return quarter, along
    if half < radius / 2:
        return 6, 2
    quarter = 5 if half < 3 * radius else 4
    along = math.ceil(half / radius - 1e-9)
    return quarter, int(np.clip(along, 4, MOST_PIECES))


def _cuts_of_cylinder(radius: float, half: float, length: float | None):
    """Return the numbers of edges around, of pieces along, and of pieces from the rim
    to the middle of an end."""
    if length:
        (around,) = _pieces(2 * np.pi * radius, length, FEWEST_AROUND)
        (along,) = _pieces(2 * half, length)
        (across,) = _pieces(radius, length)
        return around, along, across
    if half < 0.3 * radius:
        return 16, 2, 3
    is_short = half < 4 * radius
    around = 24 if is_short else 16
    across = 2 if is_short else 1
    along = math.ceil(half / radius - 1e-9)
    return around, int(np.clip(along, 4, MOST_PIECES)), across


def _require_allowed(count: int) -> None:
    """Raise Refusal for more elements than a geom may have."""
    require(
        count <= MOST_ELEMENTS,
        f"the geom has {count} elements, more than {MOST_ELEMENTS}",
        instead="make ``element`` longer",
    )


def geom_kind(model: mujoco.MjModel, geom: int) -> str:
    """Return the kind of a geom, such as "box"."""
    return mujoco.mjtGeom(model.geom_type[geom]).name.removeprefix("mjGEOM_").lower()


def geom_name(model: mujoco.MjModel, geom: int) -> str:
    """Return the name of a geom, or "geom 3" where it has none."""
    return mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_GEOM, geom) or f"geom {geom}"


def geom_label(model: mujoco.MjModel, geom: int) -> str:
    """Return a text that tells a geom from others: its name, or its number with its
    body and group."""
    name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_GEOM, geom)
    if name:
        return formatted(name)
    owner = int(model.geom_bodyid[geom])
    body = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, owner)
    body = f"the body {formatted(body)}" if body else "a body without name"
    return f"{geom}, of {body} in group {model.geom_group[geom]}"


def is_movable(model: mujoco.MjModel, geom: int) -> bool:
    """Return whether a joint moves a geom."""
    body = model.geom_bodyid[geom]
    while body and not model.body_dofnum[body]:
        body = model.body_parentid[body]
    return bool(body)


def _mesh_vertices(model: mujoco.MjModel, k: int) -> np.ndarray:
    """Return the vertices (V, 3), m, of mesh number k of a model."""
    first = model.mesh_vertadr[k]
    return np.array(model.mesh_vert[first : first + model.mesh_vertnum[k]], float)


def _model_mesh(model: mujoco.MjModel, k: int) -> Mesh:
    """Return mesh number k of a model, mended as by `sound`."""
    start = model.mesh_faceadr[k]
    faces = model.mesh_face[start : start + model.mesh_facenum[k]]
    name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_MESH, k) or k
    with located(f"mesh {formatted(name)}"):
        mesh, notes = sound(_mesh_vertices(model, k), faces, cure="close it")
    notes = [*notes, *size_note(mesh, "is the scale of its asset correct?")]
    if notes:
        warn(f"mesh {formatted(name)}: {'; '.join(notes)}")
    return mesh


def _solid_mesh(model: mujoco.MjModel, k: int, hulls: bool) -> Mesh:
    """Return mesh number k of a model, or its convex hull where ``hulls`` and the mesh
    has no inside."""
    count = model.mesh_facenum[k]
    require(
        count <= MOST_FACES,
        f"the mesh has {count} triangles, more than {MOST_FACES}",
        instead="give fewer triangles",
    )
    try:
        return _model_mesh(model, k)
    except Refusal as refusal:
        if hulls:
            return _hull(model, k)
        raise Refusal(
            refusal.what,
            where=refusal.where,
            because=refusal.because,
            instead="close it, or use its convex hull instead: ``hulls`` = True",
        ) from None


def _hull(model: mujoco.MjModel, k: int) -> Mesh:
    """Return the convex hull of mesh number k of a model, with which MuJoCo's contacts
    compute."""
    points = _mesh_vertices(model, k)
    try:
        hull = ConvexHull(points)
    except QhullError:
        raise Refusal("the mesh is flat", because="it has no convex hull") from None
    triangles = hull.simplices
    a, b, c = points[triangles].swapaxes(0, 1)
    inwards = (np.cross(b - a, c - a) * hull.equations[:, :3]).sum(1) < 0.0
    triangles = np.where(inwards[:, None], triangles[:, ::-1], triangles)
    used, index = np.unique(triangles, return_inverse=True)
    return Mesh(points[used], index.reshape(triangles.shape))
