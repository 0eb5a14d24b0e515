"""Intruder scenes of triangle meshes, which move in any way in three dimensions."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated, NamedTuple

import numpy as np

from geomech.core import summary
from geomech.scenes.columns import columns_reader
from geomech.scenes.intruding import Intruding
from geomech.scenes.sections import Each, FromFile, Keys, OneOf, Within
from geomech.scenes.stress import MatchedKeys
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
    "CSV with the header t,x,y,z or t,x,y,z,rx,ry,rz (rotation vector) (s, m, rad); velocities are differences of order 2 in "
    "the spacing of t",
)
TRIANGLES = (
    "of the mesh, about, 1 to 2,000,000; a mesh from a file has at least its own"
)


class Passed(NamedTuple):
    """Forces along a motion. force, moment (T, 3), N and N m about the mesh's origin, in the world frame; power (T,) W
    of the grains on the body. With effects that have a weight the force is that of both."""

    trajectory: Trajectory
    force: np.ndarray
    moment: np.ndarray
    power: np.ndarray

    @property
    def t(self) -> np.ndarray:
        return self.trajectory.t

    def __repr__(self) -> str:
        span = summary.span
        force, moment = (
            ", ".join(f"{a} {span(f)}" for a, f in zip("xyz", x.T))
            for x in (self.force, self.moment)
        )
        described = f"force {force} N; moment {moment} N m; power {span(self.power)} W"
        return f"Passed({len(self.t)} poses, t {span(self.t)} s; {described})"


@dataclass(frozen=True)
class MeshScene(Intruding):
    """A medium of three dimensions, a solid body and its motion, and effects. triangles: of its mesh, about. matched: what
    the medium's strength was taken from, where it was told by a name of the vertical plane.

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

    parts, finer = "triangles", (4,)
    order = 1  # 2 in their size
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

    def run(self, triangles: int | None = None) -> Passed:
        """Return forces along the motion, with the scene's number of triangles or another."""
        mesh = self.mesh if triangles is None else self.intruder.mesh(triangles)
        trajectory = self.motion.trajectory(mesh)
        result = wrench(
            self.medium, mesh, *trajectory[2:0:-1], *trajectory[3:5], self.effects
        )
        return Passed(
            trajectory, self.weighed(result.force), result.moment, result.power
        )

    def faces(self, result: Passed, k: int) -> tuple[Faces, np.ndarray]:
        """Return the loads on each face below the surface at step k, and the triangles (Q, 3, 3) above it."""
        _, place, rotation, velocity, spin, _ = (x[k] for x in result.trajectory)
        world = (self.mesh.vertices @ rotation.T + place)[self.mesh.faces]
        above = below(world, -world[..., 2])[0]
        return bearing(
            self.medium, self.mesh, rotation, place, velocity, spin, self.effects
        ), above

    def table(self, result: Passed) -> dict[str, np.ndarray]:
        """Return the columns of a result: t, angle (or x, y, z, if the body does not turn about a hub), force_x,
        force_y, force_z, moment_x, moment_y, moment_z, and once more the one about y as moment."""
        trajectory = result.trajectory
        place = (
            {"angle": trajectory.angle}
            if self.motion.turns
            else dict(zip("xyz", trajectory.place.T))
        )
        force = {f"force_{a}": f for a, f in zip("xyz", result.force.T)}
        moment = {f"moment_{a}": m for a, m in zip("xyz", result.moment.T)}
        return {
            "t": trajectory.t,
            **place,
            **force,
            **moment,
            "moment": result.moment[:, 1],
        }
