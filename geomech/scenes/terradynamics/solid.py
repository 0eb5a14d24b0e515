"""Intruder scenes of triangle meshes that move in three dimensions as prescribed."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated, NamedTuple

import numpy as np

from geomech.core import summary
from geomech.scenes.format.columns import columns_reader
from geomech.scenes.format.sections import Each, FromFile, Keys, OneOf, Within
from geomech.scenes.terradynamics.intruding import Intruding
from geomech.scenes.terradynamics.stress import MatchedKeys
from rft.core.checks import Number
from rft.core.refusal import located
from rft.terradynamics.ground import GROUND_EFFECTS, GroundEffect
from rft.terradynamics.meshes import (
    MOTIONS,
    SOLIDS,
    Faces,
    Mesh,
    MeshFile,
    Motion,
    Solid,
    Spatial,
    Trajectory,
    bearing,
    below,
    wrench,
)

KINDS = {
    **{k: v for k, v in SOLIDS.items() if k != "c-leg"},
    "extruded-c-leg": SOLIDS["c-leg"],
    "mesh": OneOf(SOLIDS, "shape", otherwise=(MeshFile,)),
}
COURSE = FromFile(
    columns_reader(("t", "x", "y", "z"), ("rx", "ry", "rz")),
    "CSV with the header t,x,y,z or t,x,y,z,rx,ry,rz (rotation vector) (s, m, rad); "
    "velocities are finite differences, with an error of order 2 in the spacing of t",
)
TRIANGLES = (
    "approximate number of triangles of the mesh, 1 to 2,000,000; a mesh from a "
    "file has at least its own"
)


class MeshIntrusion(NamedTuple):
    """Forces along a motion, in the world frame.

    force: (T, 3), N, with the weights of effects. moment: (T, 3), N m, about the mesh's
    origin. power: (T,), W, of the grains on the body."""

    trajectory: Trajectory
    force: np.ndarray
    moment: np.ndarray
    power: np.ndarray

    @property
    def t(self) -> np.ndarray:
        return self.trajectory.t

    def __repr__(self) -> str:
        span = summary.span
        force = ", ".join(f"{a} {span(x)}" for a, x in zip("xyz", self.force.T))
        moment = ", ".join(f"{a} {span(x)}" for a, x in zip("xyz", self.moment.T))
        described = f"force {force} N; moment {moment} N m; power {span(self.power)} W"
        return f"MeshIntrusion({len(self.t)} poses, t {span(self.t)} s; {described})"


@dataclass(frozen=True)
class MeshScene(Intruding):
    """A medium of three dimensions, a solid body and its motion, and effects.

    triangles: of its mesh, about. matched: how the medium's strength was matched to a
    map of the vertical plane, if it was; else "".

    Examples
    --------
    >>> from geomech.scenes import load
    >>> load("sphere").run(300).force.shape  # of 300 triangles
    (11, 3)
    """

    medium: Annotated[Spatial, Keys(MatchedKeys, owner="an intruder scene of a mesh")]
    intruder: Annotated[Solid, OneOf(KINDS)]
    motion: Annotated[Motion, OneOf(MOTIONS, files={"csv": COURSE}, owner="a mesh")]
    triangles: Annotated[
        int,
        Within("numerics", owner="an intruder scene of a mesh"),
        Number(1, 2_000_000, "-", TRIANGLES, whole=True),
    ] = 5000
    effects: Annotated[
        tuple[GroundEffect, ...], Each(GROUND_EFFECTS, owner="an intruder scene")
    ] = ()
    name: str = "scene"
    text: str = field(default="", repr=False, compare=False)
    files: tuple[str, ...] = field(default=(), repr=False, compare=False)
    matched: str = field(default="", compare=False)

    parts = "triangles"
    finer = (4,)
    order = 1  # in their number; 2 in their size
    per_part = 1.5e-7
    field_types = {
        "medium": (Spatial, "a medium such as Spatial(xi_n=3e5)"),
        "intruder": (Solid, "a solid such as Sphere(radius=0.02)"),
        "motion": (
            tuple(MOTIONS.values()),
            "a motion of rft.terradynamics.meshes such as Drag(depth=0.05)",
        ),
        "matched": (str, "text"),
    }

    def __post_init__(self):
        with located(self.name):
            self._check()
            _ = self.mesh

    @cached_property
    def mesh(self) -> Mesh:
        return self.intruder.mesh(self.triangles)

    @property
    def count(self) -> int:
        return len(self.mesh.faces)

    def actual_count(self, count: int) -> int:
        return len(self.intruder.mesh(count).faces)

    @property
    def ladder(self) -> tuple[int, ...]:
        return self.intruder.ladder

    @property
    def size(self) -> float:
        return float(np.ptp(self.mesh.vertices, axis=0).max())

    def run(self, triangles: int | None = None) -> MeshIntrusion:
        """Return forces along the motion. triangles: in place of the scene's."""
        mesh = self.mesh
        if triangles is not None:
            mesh = self.intruder.mesh(triangles)
        trajectory = self.motion.trajectory(mesh)
        _, place, rotation, velocity, spin, _ = trajectory
        result = wrench(
            self.medium, mesh, rotation, place, velocity, spin, self.effects
        )
        force = self.weighed(result.force)
        return MeshIntrusion(trajectory, force, result.moment, result.power)

    def faces(self, result: MeshIntrusion, k: int) -> tuple[Faces, np.ndarray]:
        """Return the loads on each face below the surface at step k, and the triangles
        (Q, 3, 3) above it, m."""
        _, place, rotation, velocity, spin, _ = (x[k] for x in result.trajectory)
        world = (self.mesh.vertices @ rotation.T + place)[self.mesh.faces]
        above = below(world, -world[..., 2])[0]
        faces = bearing(
            self.medium, self.mesh, rotation, place, velocity, spin, self.effects
        )
        return faces, above

    def table(self, result: MeshIntrusion) -> dict[str, np.ndarray]:
        """Return the columns of a result: t; angle, or x, y, z if the body does not
        turn about a hub; force_x, force_y, force_z, moment_x, moment_y, moment_z; and
        moment, which is moment_y, as scenes of the vertical plane have it."""
        trajectory = result.trajectory
        columns = {"t": trajectory.t}
        if self.motion.turns:
            columns["angle"] = trajectory.angle
        else:
            columns |= zip("xyz", trajectory.place.T)
        for axis, values in zip("xyz", result.force.T):
            columns[f"force_{axis}"] = values
        for axis, values in zip("xyz", result.moment.T):
            columns[f"moment_{axis}"] = values
        columns["moment"] = result.moment[:, 1]
        return columns
