"""Geoms of a MuJoCo model as triangles, and the geoms that a name, a pattern or a group means."""

from __future__ import annotations

import difflib
import fnmatch
import math
import warnings
from collections.abc import Iterable, Sequence

import mujoco
import numpy as np

from rft.balance.backend import Note
from rft.meshes import shapes
from rft.meshes.mesh import Mesh, quartered
from rft.meshes.smooth import smooth
from rft.meshes.sound import size_note, sound
from rft.refusal import Refusal, formatted, located, require

MOST_FACES = 20_000  # of a geom's mesh
MOST_ELEMENTS = 100_000  # of a geom
ALONG_Z = np.array(
    [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]
)  # rows of vectors times this: from y to z
ICOSAHEDRON = 1.0515  # edge of an icosahedron over its radius
FEWEST_AROUND = 8  # edges around round geoms


def geom_mesh(model: mujoco.MjModel, geom: int, elements: int) -> Mesh:
    """Return the mesh of a geom in its own frame, with smooth normals, and ``elements`` edges around round geoms; ValueError
    for a geom that has no inside."""
    kind, size = (
        mujoco.mjtGeom(model.geom_type[geom]).name.removeprefix("mjGEOM_").lower(),
        model.geom_size[geom],
    )
    along = max(1, elements // 6)
    if kind == "mesh":
        return smooth(_model_mesh(model, int(model.geom_dataid[geom])))
    if kind == "box":
        return shapes.box(2 * size, along)
    if kind == "capsule":
        return smooth(shapes.capsule(size[0], size[1], elements, along))
    if kind == "cylinder":
        rod = shapes.cylinder(
            size[0], 2 * size[1], elements, along, max(1, elements // 12)
        )
        return smooth(Mesh(rod.vertices @ ALONG_Z, rod.faces))
    cure = "give a sphere, ellipsoid, cylinder, capsule, box or mesh"
    require(
        kind in ("sphere", "ellipsoid"),
        f"a {kind} cannot touch the ground",
        instead=cure,
    )
    ball = shapes.sphere(
        1.0, int(np.clip(np.ceil(np.log2(elements / 5)), 1, 5))
    )  # 5 edges around, twice that, ...
    return smooth(
        Mesh(ball.vertices * (size if kind == "ellipsoid" else size[0]), ball.faces)
    )


def mesh_of_elements(model: mujoco.MjModel, geom: int, length: float) -> Mesh:
    """Return the mesh of a geom in its own frame, of triangles with edges of about ``length``, m; the triangles of a mesh
    geom are cut in four until they are that small."""
    kind, size = geom_kind(model, geom), np.array(model.geom_size[geom])
    pieces = lambda x, fewest=1: int(
        np.clip(math.ceil(x / length - 1e-9), fewest, 4096)
    )
    around, across = pieces(2 * math.pi * size[0], FEWEST_AROUND), pieces(size[0])
    if kind == "box":
        a, b, c = (pieces(2 * x) for x in size)
        _require_few(4 * (a * b + b * c + c * a))
        return shapes.box(2 * size, (a, b, c))
    if kind == "capsule":
        _require_few(2 * around * (pieces(2 * size[1]) + around // 2))
        return smooth(shapes.capsule(size[0], size[1], around, pieces(2 * size[1])))
    if kind == "cylinder":
        _require_few(2 * around * (pieces(2 * size[1]) + 2 * across))
        rod = shapes.cylinder(size[0], 2 * size[1], around, pieces(2 * size[1]), across)
        return smooth(Mesh(rod.vertices @ ALONG_Z, rod.faces))
    if kind == "mesh":
        mesh = smooth(_model_mesh(model, int(model.geom_dataid[geom])))
        while _longest_edge(mesh) > 1.5 * length:
            _require_few(4 * len(mesh.faces))
            mesh = quartered(mesh)
        return mesh
    radii = size if kind == "ellipsoid" else size[[0, 0, 0]]
    fineness = max(1, round(math.log2(ICOSAHEDRON * radii.max() / length)))
    _require_few(20 * 4**fineness)
    ball = shapes.sphere(1.0, fineness)
    return smooth(Mesh(ball.vertices * radii, ball.faces))


def _require_few(count: int) -> None:
    """Raise Refusal for more elements than a geom may have."""
    what = f"the geom has {count} elements, more than {MOST_ELEMENTS}"
    require(count <= MOST_ELEMENTS, what, instead="make ``element`` longer")


def _longest_edge(mesh: Mesh) -> float:
    """Return the length of the longest edge, m."""
    corners = mesh.vertices[mesh.faces]
    return float(np.linalg.norm(corners - np.roll(corners, 1, 1), axis=-1).max())


def geom_kind(model: mujoco.MjModel, geom: int) -> str:
    """Return the kind of a geom, such as "box"."""
    return mujoco.mjtGeom(model.geom_type[geom]).name.removeprefix("mjGEOM_").lower()


def geom_name(model: mujoco.MjModel, geom: int) -> str:
    """Return the name of a geom, or "geom 3" where it has none."""
    return mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_GEOM, geom) or f"geom {geom}"


def is_movable(model: mujoco.MjModel, geom: int) -> bool:
    """Return whether a joint moves a geom."""
    body = model.geom_bodyid[geom]
    while body and not model.body_dofnum[body]:
        body = model.body_parentid[body]
    return bool(body)


SOLID = ("sphere", "ellipsoid", "cylinder", "capsule", "box", "mesh")


def chosen_geoms(
    model: mujoco.MjModel, geoms: str | int | Sequence[str | int] | None
) -> list[int]:
    """Return the numbers of geoms given by name, by a pattern such as "leg*" or by group, a whole number; None for all that
    joints move. Refusal for unknown ones, those without an inside and those that nothing moves."""
    if geoms is None:
        able = [
            g
            for g in range(model.ngeom)
            if is_movable(model, g) and geom_kind(model, g) in SOLID
        ]
        require(
            len(able) > 0,
            "the model has no geom that moves and has an inside",
            instead="give it joints",
        )
        return able
    found: list[int] = []
    given = [geoms] if isinstance(geoms, str | int) else geoms
    require(
        isinstance(given, Iterable),
        "``geoms`` must be names, patterns or groups",
        value=geoms,
    )
    for one in given:
        found += [g for g in _matching(model, one) if g not in found]
    require(len(found) > 0, "``geoms`` names none", value=geoms)
    for geom in found:
        name, kind = formatted(geom_name(model, geom)), geom_kind(model, geom)
        cure = f"give a {', '.join(SOLID[:-1])} or {SOLID[-1]}"
        require(
            kind in SOLID,
            f"the geom {name} is a {kind} and has no inside",
            instead=cure,
        )
        require(
            is_movable(model, geom),
            f"the geom {name} is fixed to the world",
            instead="name geoms that move",
        )
    return found


def _matching(model: mujoco.MjModel, one: str | int) -> list[int]:
    """Return the numbers of the geoms that a name, a pattern or a group means."""
    if isinstance(one, int) and not isinstance(one, bool):
        group = np.flatnonzero(model.geom_group == one)
        require(
            len(group) > 0,
            f"no geom is in group {one}",
            instead=f"groups are {sorted({*model.geom_group.tolist()})}",
        )
        return [int(g) for g in group if is_movable(model, g)] or group.tolist()
    require(
        isinstance(one, str), "``geoms`` must be names, patterns or groups", value=one
    )
    names = {geom_name(model, g): g for g in range(model.ngeom)}
    if one in names:
        return [names[one]]
    if matches := fnmatch.filter(names, one):
        return [names[name] for name in matches if is_movable(model, names[name])] or [
            names[x] for x in matches
        ]
    near = difflib.get_close_matches(one, names, 3, 0.5)
    few = ", ".join(map(formatted, near or [*names][:8]))
    cure = (
        f"did you mean {few}?" if near else f"it has {few}" if names else "it has none"
    )
    raise Refusal(f"the model has no geom {formatted(one)}", instead=cure)


def _model_mesh(model: mujoco.MjModel, k: int) -> Mesh:
    """Return mesh number k of a model, mended as by `sound`."""
    first, start, faces = (
        model.mesh_vertadr[k],
        model.mesh_faceadr[k],
        model.mesh_facenum[k],
    )
    require(
        faces <= MOST_FACES,
        f"the mesh has {faces} triangles, more than {MOST_FACES}",
        instead="give fewer",
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
