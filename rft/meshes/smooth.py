"""Normals of the smooth surface that a mesh of flat triangles stands for.

A flat triangle of a round body that turns about its own axis leads on one half and trails on the other, where the round
surface would slide along itself; with normals of the surface it does not.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from rft.meshes.mesh import Mesh

CREASE = np.radians(40.0)  # assumed: triangles that meet at a larger angle meet at an edge
TOGETHER = 200_000  # corners at a time, for memory


def smooth(mesh: Mesh, crease: float = CREASE) -> Mesh:
    """The mesh with normals at the corners of its triangles: the mean over those that meet there and turn by less than
    ``crease`` (rad) from the one the corner is of, weighted by their angles. Of second order in the size of triangles where
    these are alike, else of first."""
    corners = mesh.vertices[mesh.faces]
    to, back = (np.roll(corners, -k, 1) - corners for k in (1, 2))
    angle = np.arctan2(np.linalg.norm(np.cross(to, back), axis=-1), (to * back).sum(-1)).ravel()
    order = np.argsort(mesh.faces.ravel(), kind="stable")  # corners (3 F), vertex by vertex
    meeting = np.bincount(mesh.faces.ravel(), minlength=len(mesh.vertices))
    first = np.cumsum(meeting) - meeting
    out = np.empty((mesh.faces.size, 3))
    for begin in range(0, mesh.faces.size, TOGETHER):
        some = np.arange(begin, min(begin + TOGETHER, mesh.faces.size))
        vertex = mesh.faces.ravel()[some]
        count = meeting[vertex]
        one = np.repeat(some, count)  # pairs of corners that share a vertex
        nth = np.arange(len(one)) - np.repeat(np.cumsum(count) - count, count)
        other = order[np.repeat(first[vertex], count) + nth]
        n, m = mesh.normals[one // 3], mesh.normals[other // 3]
        weight = np.where((n * m).sum(-1) > np.cos(crease), angle[other], 0.0)
        starts = np.cumsum(count) - count
        out[some] = np.add.reduceat(weight[:, None] * m, starts, axis=0)
    out /= np.linalg.norm(out, axis=-1, keepdims=True)
    return dataclasses.replace(mesh, bends=out.reshape(-1, 3, 3))
