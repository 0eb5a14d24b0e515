"""Normals of the smooth surface that a mesh of flat triangles stands for.

A round body that rotates about its own axis slides along itself. Of its flat triangles one half would lead and the other
trail; with normals of the smooth surface neither does.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from rft.terradynamics.meshes.mesh import Mesh

CREASE = np.radians(
    40.0
)  # assumed: triangles that meet at a larger angle meet at an edge
CHUNK = 200_000  # corners at a time, for memory


def smooth(mesh: Mesh, crease: float = CREASE) -> Mesh:
    """Return the mesh with smooth normals at the corners of its triangles.

    The normal at a corner of a triangle is the mean of the normals of the triangles that meet there, weighted by their
    angles; triangles at more than ``crease``, rad, to the first do not count. The error is of order 2 in the size of
    triangles where these are regular, else of order 1."""
    corners = mesh.vertices[mesh.faces]
    to, back = (np.roll(corners, -k, 1) - corners for k in (1, 2))
    angle = np.arctan2(
        np.linalg.norm(np.cross(to, back), axis=-1), (to * back).sum(-1)
    ).ravel()
    order = np.argsort(
        mesh.faces.ravel(), kind="stable"
    )  # corners (3 F), vertex by vertex
    n_corners = np.bincount(
        mesh.faces.ravel(), minlength=len(mesh.vertices)
    )  # at each vertex
    first = np.cumsum(n_corners) - n_corners
    out = np.empty((mesh.faces.size, 3))
    for begin in range(0, mesh.faces.size, CHUNK):
        chunk = np.arange(begin, min(begin + CHUNK, mesh.faces.size))
        vertex = mesh.faces.ravel()[chunk]
        count = n_corners[vertex]
        one = np.repeat(chunk, count)  # pairs of corners that share a vertex
        nth = np.arange(len(one)) - np.repeat(np.cumsum(count) - count, count)
        other = order[np.repeat(first[vertex], count) + nth]
        n, m = mesh.normals[one // 3], mesh.normals[other // 3]
        weight = np.where((n * m).sum(-1) > np.cos(crease), angle[other], 0.0)
        starts = np.cumsum(count) - count
        out[chunk] = np.add.reduceat(weight[:, None] * m, starts, axis=0)
    out /= np.linalg.norm(out, axis=-1, keepdims=True)
    return dataclasses.replace(mesh, smooth_normals=out.reshape(-1, 3, 3))
