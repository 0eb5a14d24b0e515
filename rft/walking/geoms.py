"""Geoms of a MuJoCo model as triangles that touch the ground."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np

from rft.meshes import shapes
from rft.meshes.mesh import Mesh
from rft.meshes.smooth import smooth
from rft.refusal import formatted, require
from rft.walking.facets import Surface

MOST_FACES = 20_000  # of a geom's mesh
ALONG_Z = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # rows of vectors times this: from y to z


def surfaces(model: mujoco.MjModel, meshes: Mapping[str, Mesh]) -> list[Surface]:
    """Return surfaces by the names of their geoms, from meshes in the geoms' frames; a mesh may differ from its geom."""
    out = []
    for name, mesh in meshes.items():
        geom = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, name)
        require(geom >= 0, f"there is no geom {formatted(name)} in the model")
        out.append(surface(model, geom, mesh))
    return out


def surface(model: mujoco.MjModel, geom: int, mesh: Mesh) -> Surface:
    """Return the surface of a geom from a mesh in the geom's frame."""
    rotation = np.zeros(9)
    mujoco.mju_quat2Mat(rotation, model.geom_quat[geom])
    return Surface.from_mesh(int(model.geom_bodyid[geom]), mesh, rotation, model.geom_pos[geom])._replace(geom=geom)


def geom_mesh(model: mujoco.MjModel, geom: int, elements: int) -> Mesh:
    """Return the mesh of a geom in its own frame, with smooth normals, and ``elements`` edges around round geoms; ValueError
    for a geom that has no inside."""
    kind, size = mujoco.mjtGeom(model.geom_type[geom]).name.removeprefix("mjGEOM_").lower(), model.geom_size[geom]
    along = max(1, elements // 6)
    if kind == "mesh":
        return smooth(_model_mesh(model, int(model.geom_dataid[geom])))
    if kind == "box":
        return shapes.box(2 * size, along)
    if kind == "capsule":
        return smooth(shapes.capsule(size[0], size[1], elements, along))
    if kind == "cylinder":
        rod = shapes.cylinder(size[0], 2 * size[1], elements, along, max(1, elements // 12))
        return smooth(Mesh(rod.vertices @ ALONG_Z, rod.faces))
    cure = "give a sphere, ellipsoid, cylinder, capsule, box or mesh"
    require(kind in ("sphere", "ellipsoid"), f"a {kind} cannot touch the ground", instead=cure)
    ball = shapes.sphere(1.0, int(np.clip(np.ceil(np.log2(elements / 5)), 1, 5)))  # 5 edges around, twice that, ...
    return smooth(Mesh(ball.vertices * (size if kind == "ellipsoid" else size[0]), ball.faces))


def _model_mesh(model: mujoco.MjModel, k: int) -> Mesh:
    """Return mesh number k of a model, with equal corners merged."""
    first, start, faces = model.mesh_vertadr[k], model.mesh_faceadr[k], model.mesh_facenum[k]
    require(faces <= MOST_FACES, f"the mesh has {faces} triangles, more than {MOST_FACES}", instead="give fewer")
    vertices = np.array(model.mesh_vert[first : first + model.mesh_vertnum[k]], float)
    merged, index = np.unique(vertices, axis=0, return_inverse=True)
    return Mesh(merged, index.reshape(-1)[model.mesh_face[start : start + faces]])
