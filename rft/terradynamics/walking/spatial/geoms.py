"""Geoms of a MuJoCo model as triangles that touch the ground."""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np

from rft.core.refusal import formatted, require
from rft.terradynamics.meshes.geoms import mesh_of_elements
from rft.terradynamics.meshes.surfaces.mesh import Mesh
from rft.terradynamics.walking.spatial.facets import Surface

# `rft.terradynamics.walking.Fineness.elements` for which a geom has as many elements
# as its shape needs.
DEFAULT_ELEMENTS = 12


def geom_mesh(
    model: mujoco.MjModel, geom: int, elements: int = DEFAULT_ELEMENTS
) -> Mesh:
    """Return the mesh of a geom in its own frame, as `rft.mujoco.attach` builds it;
    ValueError for a geom that has no inside.

    Edges are shorter or longer in proportion where ``elements`` is not
    `DEFAULT_ELEMENTS`. The triangles of a mesh geom are cut in four for each factor of
    2."""
    return mesh_of_elements(model, geom, share=DEFAULT_ELEMENTS / elements)


def surfaces(model: mujoco.MjModel, meshes: Mapping[str, Mesh]) -> list[Surface]:
    """Return surfaces by the names of their geoms, from meshes in the geoms' frames; a
    mesh may differ from its geom."""
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
    body = int(model.geom_bodyid[geom])
    whole = Surface.from_mesh(body, mesh, rotation, model.geom_pos[geom])
    return whole._replace(geom=geom)
