"""Intruder scenes of triangle meshes, which move in any way in three dimensions, and how their TOML is read."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

from geomech.core import summary
from geomech.core.errors import SceneError, choose, named, number
from geomech.scene.columns import columns
from geomech.scene.intruding import Intruding, as_table, checked_tables, located
from geomech.scene.parts import build, kind_in
from rft.ground import KINDS as EFFECTS
from rft.ground import GroundEffect
from rft.meshes import (
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

KINDS = {"mesh": MeshFile, **{k: v for k, v in SOLIDS.items() if k != "c-leg"}, "extruded-c-leg": SOLIDS["c-leg"]}
STRENGTHS = ("name", "file", "zeta", "xi_n", "density", "internal_friction")


class Passed(NamedTuple):
    """Forces along a motion. force, moment (T, 3), N and N m about the mesh's origin, told in the world; power (T,) W of the
    grains on the body. With effects that have a weight the force is that of both."""

    trajectory: Trajectory
    force: np.ndarray
    moment: np.ndarray
    power: np.ndarray

    @property
    def t(self) -> np.ndarray:
        return self.trajectory.t

    def __repr__(self) -> str:
        span = summary.span
        force, moment = (", ".join(f"{a} {span(f)}" for a, f in zip("xyz", x.T)) for x in (self.force, self.moment))
        told = f"force {force} N; moment {moment} N m; power {span(self.power)} W"
        return f"Passed({len(self.t)} poses, t {span(self.t)} s; {told})"


@dataclass(frozen=True)
class MeshScene(Intruding):
    """A medium of three dimensions, a solid body and its motion, and effects. triangles: of its mesh, about. matched: what
    the medium's strength was taken from, where it was told by a name of the vertical plane."""

    medium: Spatial
    intruder: Solid
    motion: Motion
    triangles: int = 5000
    effects: tuple[GroundEffect, ...] = ()
    name: str = "scene"
    text: str = field(default="", repr=False, compare=False)
    files: tuple[str, ...] = field(default=(), repr=False, compare=False)
    matched: str = field(default="", compare=False)

    parts, finer = "triangles", (4,)
    order = 1  # 2 in their size
    per_part = 1.5e-7
    takes = {
        "medium": (Spatial, "a medium such as Spatial(xi_n=3e5)"),
        "intruder": (Solid, "a solid such as Sphere(radius=0.02)"),
        "motion": (tuple(MOTIONS.values()), "a motion of rft.meshes such as Drag(depth=0.05)"),
        "matched": (str, "text"),
    }

    def __post_init__(self):
        with named(self.name):
            self._check()
            number("triangles", self.triangles, 1, 2_000_000, whole=True)
            object.__setattr__(self, "triangles", int(self.triangles))
            _ = self.mesh

    @cached_property
    def mesh(self) -> Mesh:
        return self.intruder.mesh(self.triangles)

    @property
    def count(self) -> int:
        return len(self.mesh.faces)

    def used(self, count: int) -> int:
        return len(self.intruder.mesh(count).faces)

    @property
    def ladder(self) -> tuple[int, ...]:
        return self.intruder.ladder

    @property
    def size(self) -> float:
        return float(np.ptp(self.mesh.vertices, axis=0).max())

    def run(self, triangles: int | None = None) -> Passed:
        """Forces along the motion, with as many triangles if told so."""
        mesh = self.mesh if triangles is None else self.intruder.mesh(triangles)
        trajectory = self.motion.trajectory(mesh)
        found = wrench(self.medium, mesh, *trajectory[2:0:-1], *trajectory[3:5], self.effects)
        return Passed(trajectory, self.weighed(found.force), found.moment, found.power)

    def faces(self, found: Passed, k: int) -> tuple[Faces, np.ndarray]:
        """What each face below the surface bears at step k; and the triangles (Q, 3, 3) above it."""
        _, place, rotation, velocity, spin, _ = (x[k] for x in found.trajectory)
        world = (self.mesh.vertices @ rotation.T + place)[self.mesh.faces]
        above = below(world, -world[..., 2])[0]
        return bearing(self.medium, self.mesh, rotation, place, velocity, spin, self.effects), above

    def table(self, found: Passed) -> dict[str, np.ndarray]:
        """The columns of a result: t, angle (or x, y, z, if the body does not turn about a hub), force_x, force_y, force_z,
        moment_x, moment_y, moment_z, and once more the one about y as moment."""
        trajectory = found.trajectory
        place = {"angle": trajectory.angle} if self.motion.turns else dict(zip("xyz", trajectory.place.T))
        force = {f"force_{a}": f for a, f in zip("xyz", found.force.T)}
        moment = {f"moment_{a}": m for a, m in zip("xyz", found.moment.T)}
        return {"t": trajectory.t, **place, **force, **moment, "moment": found.moment[:, 1]}

    def tables(self) -> dict:
        """Of a scene file that reads the same; SceneError for paths, which are files of their own."""
        if MOTIONS["csv"] is type(self.motion):
            raise SceneError(f"{self.name}: paths are CSV files: write the scene that names them by hand")
        return {
            "medium": dataclasses.asdict(self.medium),
            "intruder": as_table(self.intruder, KINDS),
            "motion": as_table(self.motion, MOTIONS),
            "numerics": {"triangles": self.triangles},
        } | ({"effects": [as_table(e, EFFECTS) for e in self.effects]} if self.effects else {})


def from_tables(tables: Mapping, name: str, text: str, vertical: Callable) -> MeshScene:
    """The scene of the tables of a TOML text; SceneError if they make none. vertical: reads a [medium] of the vertical
    plane."""
    rest, files = checked_tables(tables, name), []
    place, folder = (lambda key: f"{name}: [{key}]"), Path(name).absolute().parent
    for key in rest["numerics"]:
        choose(f"{place('numerics')} key", key, ("triangles",))
    medium, matched = read_medium(place("medium"), located(tables["medium"], folder, files), vertical)
    return MeshScene(
        medium=medium,
        intruder=_solid(place("intruder"), located(tables["intruder"], folder, files)),
        motion=_motion(place("motion"), located(tables["motion"], folder, files)),
        effects=rest["effects"],
        **rest["numerics"],
        name=name,
        text=text,
        files=tuple(files),
        matched=matched,
    )


def read_medium(place: str, table: dict, vertical: Callable) -> tuple[Spatial, str]:
    """Of a [medium] of three dimensions: xi_n (N/m^3), or density and internal_friction, or name or file of one of the vertical
    plane, with zeta; and surface_friction, tension, grazing(_deg). And what xi_n was matched to, if to one of those."""
    given = {k: table.pop(k) for k in STRENGTHS if k in table}
    ways = [{"name"}, {"file"}, {"xi_n"}, {"density", "internal_friction"}]
    if {*given} not in ways and {*given} not in [{"name", "zeta"}, {"file", "zeta"}]:
        told = "give 'xi_n' (N/m^3), or 'density' and 'internal_friction', or 'name' or 'file' and, if wanted, 'zeta'"
        raise SceneError(f"{place}: {told}")
    xi_n, told = given.get("xi_n"), ""
    with named(place):
        if {"name", "file"} & {*given}:
            xi_n = matched_strength(vertical(place, given))
            of = given.get("name") or Path(given["file"]).name
            times = f"{given['zeta']:g} times " if given.get("zeta", 1.0) != 1.0 else ""
            told = f"xi_n = {xi_n:.4g} N/m^3, matched to {times}alpha_z(0, 90 degrees) of {of} in the vertical plane"
        elif "density" in given:
            xi_n = Spatial.from_grains(given["density"], given["internal_friction"]).xi_n
    return build(place, {**table, "xi_n": xi_n}, Spatial), told


def matched_strength(stress) -> float:
    """xi_n, N/m^3, with which a flat plate pushed straight down bears what it does by a map of the vertical plane."""
    flat, down = (0.0, -1.0), (0.0, -1.0)
    return 1e6 * float(stress.alpha(flat, down)[1]) / Spatial(1.0).plate


def _solid(place: str, table: dict) -> Solid:
    kind, shape = table.pop("kind"), table.pop("shape", None)
    if shape is None:
        if kind == "mesh" and "file" not in table:
            raise SceneError(f"{place}: give 'file' (.stl, .obj, .ply) or 'shape', one of {', '.join(SOLIDS)}")
        return build(place, table, KINDS[kind])
    if kind != "mesh" or "file" in table:
        raise SceneError(f"{place}: 'shape' goes with kind = 'mesh' and no 'file': drop one")
    return build(place, table, SOLIDS[choose(f"{place} shape", shape, SOLIDS)])


def _motion(place: str, table: dict) -> Motion:
    name = kind_in(place, table, "kind", MOTIONS)
    del table["kind"]
    if name == "csv":
        if {*table} != {"file"}:
            told = "a motion of kind 'csv' takes 'file' and nothing else: a table t,x,y,z, and rx,ry,rz (rotation vector, rad)"
            raise SceneError(f"{place}: {told}")
        found = columns(place, table["file"], ("t", "x", "y", "z"), ("rx", "ry", "rz"))
        table = {k: v.tolist() for k, v in found.items()}
    return build(place, table, MOTIONS[name])
