"""Geoms of a MuJoCo model: their kinds and names, and their surfaces as triangles."""

from __future__ import annotations

import math
import warnings

import mujoco
import numpy as np
from scipy.spatial import ConvexHull, QhullError

from rft.balance.backend import Note
from rft.core.refusal import Refusal, formatted, located, require
from rft.terradynamics.meshes import shapes, widened
from rft.terradynamics.meshes.merged import resized
from rft.terradynamics.meshes.mesh import Mesh
from rft.terradynamics.meshes.smooth import smooth
from rft.terradynamics.meshes.sound import size_note, sound

MOST_FACES = 200_000  # of a geom's mesh, as in an STL file that MuJoCo takes
MOST_ELEMENTS = 100_000  # of a geom
ALONG_Z = np.array(
    [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]
)  # rows of vectors times this: from y to z
ICOSAHEDRON = 1.0515  # edge of an icosahedron over its radius
FEWEST_AROUND = 8  # edges around round geoms of a given length of edges
# Edges of boxes and of meshes along half of the diagonal, by default; with fewer, a
# face that only just leads in part bears up to a tenth too much or too little.
PER_REACH, PER_REACH_OF_MESH = 5, 6
MOST_PIECES = 12  # of a slender round geom, by default


def mesh_of_elements(
    model: mujoco.MjModel,
    geom: int,
    length: float | None = None,
    hulls: bool = False,
    share: float = 1.0,
) -> Mesh:
    """Return the mesh of a geom in its own frame.

    share: of the lengths of edges that the shape asks for, where ``length`` is None, in
    all directions. length: m, of the edges, about; None for as many triangles as the
    shape of the geom asks for, with which 90 % of random motions have an error of the
    force below 3 %, and none one above 6 %. Of a mesh geom, triangles that are larger
    are halved, and those that are smaller are merged
    (`rft.terradynamics.meshes.merged`). hulls: whether a mesh without an inside stands
    for its convex hull."""
    kind, size = geom_kind(model, geom), np.array(model.geom_size[geom])
    if kind == "box":
        cuts = _pieces(2 * size, length or np.linalg.norm(size) / PER_REACH)
        cuts = cuts if length else _shared(np.maximum(cuts, 2), share)
        _require_few(4 * int(np.dot(cuts, np.roll(cuts, 1))))
        return shapes.box(2 * size, list(map(int, cuts)))
    if kind == "capsule":
        quarter, along = _shared(_cuts_of_capsule(size[0], size[1], length), share)
        _require_few(8 * quarter * (quarter + along))
        return widened.capsule(size[0], size[1], quarter, along)
    if kind == "cylinder":
        cuts = _cuts_of_cylinder(size[0], size[1], length)
        around, along, across = _shared(cuts, share)
        _require_few(2 * around * (along + 2 * across))
        return widened.cylinder(size[0], size[1], around, along, across)
    if kind == "mesh":
        mesh = smooth(_solid_mesh(model, int(model.geom_dataid[geom]), hulls))
        reach = np.linalg.norm(np.ptp(mesh.vertices, axis=0)) / 2
        length = length or share * reach / PER_REACH_OF_MESH
        return resized(mesh, length, MOST_ELEMENTS)
    radii = size if kind == "ellipsoid" else size[[0, 0, 0]]
    fineness = max(1, 2 + round(-math.log2(share)))
    if length:
        fineness = max(1, round(math.log2(ICOSAHEDRON * radii.max() / length)))
    _require_few(20 * 4**fineness)
    return widened.ellipsoid(radii, fineness)


def _pieces(sides, length: float, fewest: int = 1) -> np.ndarray:
    """Return the numbers of pieces of a length, m, at most, that sides, m, are cut
    into."""
    counts = np.ceil(np.atleast_1d(sides) / length - 1e-9)
    return np.clip(counts, fewest, 4096).astype(int)


def _shared(cuts, share: float) -> list[int]:
    """Return numbers of pieces of a share of the length of those in ``cuts``; even ones
    stay even, for symmetry."""
    units = [2 - int(n) % 2 for n in cuts]
    return [unit * max(1, round(n / unit / share)) for n, unit in zip(cuts, units)]


def _cuts_of_capsule(radius: float, half: float, length: float | None):
    """Return the edges along a quarter of the rim, and the pieces of the rod."""
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
    """Return the edges around, the pieces along, and those from the rim to the middle
    of an end."""
    if length:
        (around,) = _pieces(2 * np.pi * radius, length, FEWEST_AROUND)
        (along,) = _pieces(2 * half, length)
        (across,) = _pieces(radius, length)
        return around, along, across
    if half < 0.3 * radius:
        return 16, 2, 3
    around = 24 if half < 4 * radius else 16
    across = 2 if half < 4 * radius else 1
    along = math.ceil(half / radius - 1e-9)
    return around, int(np.clip(along, 4, MOST_PIECES)), across


def _require_few(count: int) -> None:
    """Raise Refusal for more elements than a geom may have."""
    what = f"the geom has {count} elements, more than {MOST_ELEMENTS}"
    require(count <= MOST_ELEMENTS, what, instead="make ``element`` longer")


def geom_kind(model: mujoco.MjModel, geom: int) -> str:
    """Return the kind of a geom, such as "box"."""
    return mujoco.mjtGeom(model.geom_type[geom]).name.removeprefix("mjGEOM_").lower()


def geom_name(model: mujoco.MjModel, geom: int) -> str:
    """Return the name of a geom, or "geom 3" where it has none."""
    return mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_GEOM, geom) or f"geom {geom}"


def described(model: mujoco.MjModel, geom: int) -> str:
    """Return what tells a geom from others: its name, or its number with its body and
    group."""
    name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_GEOM, geom)
    if name:
        return formatted(name)
    body = mujoco.mj_id2name(
        model, mujoco.mjtObj.mjOBJ_BODY, int(model.geom_bodyid[geom])
    )
    owner = f"the body {formatted(body)}" if body else "a body without name"
    return f"{geom}, of {owner} in group {model.geom_group[geom]}"


def is_movable(model: mujoco.MjModel, geom: int) -> bool:
    """Return whether a joint moves a geom."""
    body = model.geom_bodyid[geom]
    while body and not model.body_dofnum[body]:
        body = model.body_parentid[body]
    return bool(body)


def _model_mesh(model: mujoco.MjModel, k: int) -> Mesh:
    """Return mesh number k of a model, mended as by `sound`."""
    first, start, faces = (
        model.mesh_vertadr[k],
        model.mesh_faceadr[k],
        model.mesh_facenum[k],
    )
    vertices = np.array(model.mesh_vert[first : first + model.mesh_vertnum[k]], float)
    name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_MESH, k) or k
    with located(f"mesh {formatted(name)}"):
        mesh, notes = sound(
            vertices, model.mesh_face[start : start + faces], cure="close it"
        )
    notes = [*notes, *size_note(mesh, "is the scale of its asset right?")]
    if notes:
        warnings.warn(f"mesh {formatted(name)}: {'; '.join(notes)}", Note, stacklevel=2)
    return mesh


def _solid_mesh(model: mujoco.MjModel, k: int, hulls: bool) -> Mesh:
    """Return mesh number k of a model, or its convex hull where ``hulls`` and the mesh
    has no inside."""
    count = model.mesh_facenum[k]
    require(
        count <= MOST_FACES,
        f"the mesh has {count} triangles, more than {MOST_FACES}",
        instead="give fewer",
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
            instead="close it, or let its convex hull stand for it: ``hulls`` = True",
        ) from None


def _hull(model: mujoco.MjModel, k: int) -> Mesh:
    """Return the convex hull of mesh number k of a model, as MuJoCo's contacts take
    it."""
    first = model.mesh_vertadr[k]
    points = np.array(model.mesh_vert[first : first + model.mesh_vertnum[k]], float)
    try:
        hull = ConvexHull(points)
    except QhullError:
        raise Refusal("the mesh is flat", because="it has no convex hull") from None
    triangles = hull.simplices
    a, b, c = points[triangles].swapaxes(0, 1)
    inwards = (np.cross(b - a, c - a) * hull.equations[:, :3]).sum(1) < 0.0
    triangles = np.where(inwards[:, None], triangles[:, ::-1], triangles)
    known, index = np.unique(triangles, return_inverse=True)
    return Mesh(points[known], index.reshape(triangles.shape))
