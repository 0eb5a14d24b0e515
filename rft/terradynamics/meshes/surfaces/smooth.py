"""Normals of the smooth surface that a mesh of flat triangles stands for.

A round body that rotates about its own axis slides along itself. Half of its flat
triangles would lead and half would trail; with normals of the smooth surface none does
either.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from rft.terradynamics.meshes.surfaces.mesh import Mesh

# Triangles that meet at a larger angle meet at an edge; assumed.
CREASE = np.radians(40.0)
CHUNK = 200_000  # corners at a time, for memory


def smooth(mesh: Mesh, crease: float = CREASE) -> Mesh:
    """Return the mesh with smooth normals at the corners of its triangles.

    The normal at a corner of a triangle is the mean of the normals of the triangles
    that meet there, weighted by their angles. Triangles at more than ``crease``, rad,
    to the one in question do not count. The error is of order 2 in the size of
    triangles where these are regular, else of order 1."""
    vertices = mesh.faces.ravel()  # of corners (3 F), triangle by triangle
    angle = _corner_angles(mesh)
    by_vertex = np.argsort(vertices, kind="stable")
    n_corners = np.bincount(vertices, minlength=len(mesh.vertices))  # at each vertex
    first = np.cumsum(n_corners) - n_corners

    out = np.empty((len(vertices), 3))
    for begin in range(0, len(vertices), CHUNK):
        chunk = np.arange(begin, min(begin + CHUNK, len(vertices)))
        vertex = vertices[chunk]
        count = n_corners[vertex]
        starts = np.cumsum(count) - count

        # All pairs of corners that share a vertex.
        one = np.repeat(chunk, count)
        nth = np.arange(len(one)) - np.repeat(starts, count)
        other = by_vertex[np.repeat(first[vertex], count) + nth]
        n = mesh.normals[one // 3]
        m = mesh.normals[other // 3]
        weight = np.where((n * m).sum(-1) > np.cos(crease), angle[other], 0.0)
        out[chunk] = np.add.reduceat(weight[:, None] * m, starts, axis=0)
    out /= np.linalg.norm(out, axis=-1, keepdims=True)
    return dataclasses.replace(mesh, smooth_normals=out.reshape(-1, 3, 3))


def _corner_angles(mesh: Mesh) -> np.ndarray:
    """Return the angles (3 F,) of triangles at their corners, rad."""
    corners = mesh.vertices[mesh.faces]
    following = np.roll(corners, -1, 1) - corners
    preceding = np.roll(corners, -2, 1) - corners
    sine = np.linalg.norm(np.cross(following, preceding), axis=-1)
    cosine = (following * preceding).sum(-1)
    return np.arctan2(sine, cosine).ravel()
