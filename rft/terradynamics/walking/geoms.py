"""Geoms of a MuJoCo model as triangles that touch the ground."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np

from rft.core.refusal import formatted, require
from rft.terradynamics.meshes.geoms import MOST_ELEMENTS, geom_kind, mesh_of_elements
from rft.terradynamics.meshes.mesh import Mesh, quartered
from rft.terradynamics.walking.facets import Surface

USUAL = 12  # `rft.terradynamics.walking.Fineness.elements` for which a geom has as many as its shape asks for


def geom_mesh(model: mujoco.MjModel, geom: int, elements: int = USUAL) -> Mesh:
    """Return the mesh of a geom in its own frame, as in `rft.mujoco.attach`: with as many elements as its shape asks for,
    and edges shorter or longer in proportion where ``elements`` is not `USUAL`. ValueError for a geom that has no inside.

    The triangles of a mesh geom are cut in four for each factor of 2, up to `MOST_ELEMENTS` of them."""
    mesh = mesh_of_elements(model, geom)
    if elements == USUAL:
        return mesh
    if geom_kind(model, geom) != "mesh":
        length = USUAL / elements * _edge(mesh)
        return mesh_of_elements(model, geom, length)
    for _ in range(round(np.log2(elements / USUAL))):
        if 4 * len(mesh.faces) <= MOST_ELEMENTS:
            mesh = quartered(mesh)
    return mesh


def _edge(mesh: Mesh) -> float:
    """Return the root mean square length of the edges of triangles, m."""
    corners = mesh.vertices[mesh.faces]
    edges = corners - np.roll(corners, 1, axis=1)
    return float(np.sqrt((edges**2).sum(-1).mean()))


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
    return Surface.from_mesh(
        int(model.geom_bodyid[geom]), mesh, rotation, model.geom_pos[geom]
    )._replace(geom=geom)
