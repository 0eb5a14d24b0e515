"""Geoms of a MuJoCo model as triangles that touch the ground."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np

from rft.checks import require, shown
from rft.meshes import shapes
from rft.meshes.mesh import Mesh
from rft.meshes.smooth import smooth
from rft.walking.facets import Surface

MOST_FACES = 20_000  # of a geom's mesh
ALONG_Z = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # rows times this: from y to z


def named(model: mujoco.MjModel, meshes: Mapping[str, Mesh]) -> list[Surface]:
    """Meshes in the frames of the geoms that they are named after, which they need not be those of."""
    out = []
    for name, mesh in meshes.items():
        geom = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, name)
        require(geom >= 0, f"there is no geom {shown(name)} in the model")
        out.append(surface(model, geom, mesh))
    return out


def surface(model: mujoco.MjModel, geom: int, mesh: Mesh) -> Surface:
    """A mesh in the frame of a geom."""
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
    return Surface.of_mesh(int(model.geom_bodyid[geom]), mesh, turn, model.geom_pos[geom])._replace(geom=geom)


def mesh_of(model: mujoco.MjModel, geom: int, elements: int) -> Mesh:
    """Of a geom in its own frame, round ones of ``elements`` edges around, with normals of what the triangles stand for.
    ValueError for a geom that has no inside."""
    kind, size = mujoco.mjtGeom(model.geom_type[geom]).name.removeprefix("mjGEOM_").lower(), model.geom_size[geom]
    along = max(1, elements // 6)
    if kind == "mesh":
        return smooth(_own(model, int(model.geom_dataid[geom])))
    if kind == "box":
        return shapes.box(2 * size, along)
    if kind == "capsule":
        return smooth(shapes.capsule(size[0], size[1], elements, along))
    if kind == "cylinder":
        rod = shapes.cylinder(size[0], 2 * size[1], elements, along, max(1, elements // 12))
        return smooth(Mesh(rod.vertices @ ALONG_Z, rod.faces))
    told = f"a {kind} cannot touch the ground: give a sphere, ellipsoid, cylinder, capsule, box or mesh"
    require(kind in ("sphere", "ellipsoid"), told)
    ball = shapes.sphere(1.0, int(np.clip(np.ceil(np.log2(elements / 5)), 1, 5)))  # 5 edges around, twice that, ...
    return smooth(Mesh(ball.vertices * (size if kind == "ellipsoid" else size[0]), ball.faces))


def _own(model: mujoco.MjModel, k: int) -> Mesh:
    """The mesh of that number, corners that are one put together."""
    first, start, faces = model.mesh_vertadr[k], model.mesh_faceadr[k], model.mesh_facenum[k]
    require(faces <= MOST_FACES, f"the mesh has {faces} triangles, more than {MOST_FACES}: give fewer")
    vertices = np.array(model.mesh_vert[first : first + model.mesh_vertnum[k]], float)
    merged, where = np.unique(vertices, axis=0, return_inverse=True)
    return Mesh(merged, where.reshape(-1)[model.mesh_face[start : start + faces]])
