"""A bed of sand under the geoms of a model: its surface, its laws, and the elements of
the geoms."""

from __future__ import annotations

from dataclasses import dataclass, replace

import mujoco
import numpy as np

from rft.mujoco.ground.footprints import Prints
from rft.mujoco.ground.hills import FLAT, Hills, tangent_plane
from rft.mujoco.memory.model_parts import last_dof
from rft.mujoco.step.parts import Frames
from rft.terradynamics.ground import Ground
from rft.terradynamics.meshes.forces.blocks import Blocks
from rft.terradynamics.meshes.forces.contact import Face, Motion, faces
from rft.terradynamics.meshes.forces.extruded import Extruded
from rft.terradynamics.meshes.forces.law import Spatial
from rft.terradynamics.meshes.forces.zones import Place, Zones, share_in
from rft.terradynamics.meshes.geoms import geom_label
from rft.terradynamics.meshes.surfaces.mesh import Mesh


@dataclass(frozen=True)
class Surface:
    """The undisturbed surface of the sand: the plane up . x = level, or hills.

    up, ahead: (3,), unit vectors away from the plane and along it, in the world. level:
    m. hills: the surface in place of the plane, where its grid is not empty."""

    up: np.ndarray
    ahead: np.ndarray
    level: float
    hills: Hills = FLAT

    @classmethod
    def inclined(cls, slope: float, level: float, hills: Hills = FLAT) -> Surface:
        """Return the plane that rises along x by ``slope``, rad, and has the height
        ``level``, m, at x = 0."""
        up = np.array([-np.sin(slope), 0.0, np.cos(slope)])
        ahead = np.array([np.cos(slope), 0.0, np.sin(slope)])
        return cls(up, ahead, float(level * up[2]), hills)

    def planes(self, middles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the planes up . x = level, (G, 3) and (G,), below geoms with these
        middles (G, 3), m."""
        if not self.hills.grid.size:
            count = len(middles)
            return np.broadcast_to(self.up, (count, 3)), np.full(count, self.level)
        planes = [tangent_plane(*self.hills, x, y) for x, y, _ in middles]
        ups = np.array([up for up, _ in planes])
        levels = np.array([level for _, level in planes])
        return ups, levels


LEVEL = Surface.inclined(0.0, 0.0)


@dataclass(frozen=True)
class BedGeoms:
    """The G geoms of a model that are in a bed of sand.

    ids, bodies, roots: (G,), numbers of the geoms, their bodies and these bodies'
    roots. moved_by: (G, nv), whether each degree of freedom moves each geom. spheres:
    (G, 4), middle of a sphere around each geom in its frame, and its radius, m. names:
    for messages."""

    ids: np.ndarray
    bodies: np.ndarray
    roots: np.ndarray
    moved_by: np.ndarray
    spheres: np.ndarray
    names: tuple[str, ...]

    @classmethod
    def from_faces(
        cls, model: mujoco.MjModel, ids: list[int], own_faces: list[Face]
    ) -> BedGeoms:
        """Return geoms by their numbers, with the faces of each along its own axes."""
        bodies = np.array([model.geom_bodyid[g] for g in ids], np.int64)
        corners = [np.stack(one[:9], -1).reshape(-1, 3) for one in own_faces]
        return cls(
            ids=np.array(ids, np.int64),
            bodies=bodies,
            roots=model.body_rootid[bodies].astype(np.int64),
            moved_by=np.array([_moving_dofs(model, body) for body in bodies]),
            spheres=np.array([_bounding_sphere(points) for points in corners]),
            names=tuple(geom_label(model, g) for g in ids),
        )

    def __len__(self) -> int:
        return len(self.ids)

    def twists(self, data: mujoco.MjData) -> tuple[np.ndarray, np.ndarray]:
        """Return velocities of the geoms' origins, m/s, and angular velocities, rad/s,
        (G, 3), in the world."""
        twist = data.cvel[self.bodies]
        spin = twist[:, :3]
        arm = data.geom_xpos[self.ids] - data.subtree_com[self.roots]
        return twist[:, 3:] + _cross(spin, arm), spin

    def poses(self, data) -> tuple[np.ndarray, np.ndarray]:
        """Return rotations from the geoms' axes to the world, (G, 3, 3), and places of
        their origins, (G, 3), m. data: MjData or
        `rft.mujoco.memory.addresses.Arrays`."""
        return data.geom_xmat[self.ids].reshape(-1, 3, 3), data.geom_xpos[self.ids]


@dataclass(frozen=True)
class Bed:
    """Sand with a surface, and the geoms of a model in it.

    laws: one for each of the zones. ground: its state. blocks: elements of all geoms.
    prints: the grid of footprints; None for ground that remembers nothing."""

    laws: tuple[Extruded | Spatial, ...]
    zones: Zones
    ground: Ground
    surface: Surface
    geoms: BedGeoms
    blocks: Blocks
    prints: Prints | None = None

    @classmethod
    def from_meshes(
        cls,
        model: mujoco.MjModel,
        geoms: list[int],
        meshes: list[Mesh],
        laws: tuple[Extruded | Spatial, ...],
        zones: Zones,
        ground: Ground,
        surface: Surface = LEVEL,
    ) -> Bed:
        """Return the bed under geoms, by their numbers, with a mesh each."""
        own = [faces(m.vertices[m.faces], m.middle_normals) for m in meshes]
        return cls.from_faces(model, geoms, own, laws, zones, ground, surface)

    @classmethod
    def from_faces(
        cls,
        model: mujoco.MjModel,
        geoms: list[int],
        own_faces: list[Face],
        laws: tuple[Extruded | Spatial, ...],
        zones: Zones,
        ground: Ground,
        surface: Surface = LEVEL,
    ) -> Bed:
        """Return the bed under geoms with these faces each, along the geom's own axes;
        the faces may be those of sheets."""
        bed_geoms = BedGeoms.from_faces(model, geoms, own_faces)
        return cls(laws, zones, ground, surface, bed_geoms, Blocks(own_faces))

    def with_rounding(self, rounding: float) -> Bed:
        """Return the bed with another rounding, m/s."""
        return replace(self, ground=self.ground._replace(rounding=rounding))

    @property
    def userdata_size(self) -> int:
        """How many numbers of userdata a simulation needs for its footprints."""
        return self.prints.userdata_size if self.prints else 0

    def frames(self, data) -> Frames:
        """Return where the geoms are. data: MjData or
        `rft.mujoco.memory.addresses.Arrays`."""
        turn, place = self.geoms.poses(data)
        middles = place + np.einsum("gij,gj->gi", turn, self.geoms.spheres[:, :3])
        up, level = self.surface.planes(middles)
        if self.prints:
            level = level + up[:, 2] * self.prints.memory(data.userdata).levels
        ahead = np.broadcast_to(self.surface.ahead, place.shape)
        return Frames(
            up=_along_axes(turn, up),
            ahead=_along_axes(turn, ahead),
            x=place @ self.surface.ahead,
            height=(place * up).sum(-1) - level,
            turn=turn,
            place=place,
        )

    def wrenches(
        self, data: mujoco.MjData, velocity=None, spin=None, depth: float = 0.0
    ) -> np.ndarray:
        """Return force, N, and moment about the geom's origin, N m, on each geom, (G,
        6), in the world.

        velocity, spin: (G, 3), m/s and rad/s in the world, by default those of the
        data. depth: m, by which all geoms lie deeper than in the data."""
        if velocity is None:
            velocity, spin = self.geoms.twists(data)
        frames = self.frames(data)
        turn = frames.turn
        motions = Motion(
            velocity=_along_axes(turn, np.asarray(velocity))[:, None],
            spin=_along_axes(turn, np.asarray(spin))[:, None],
            x=frames.x[:, None],
            up=frames.up[:, None],
            ahead=frames.ahead[:, None],
            height=frames.height[:, None] - depth,
        )
        loads = self._loads(motions, turn, frames.place).reshape(-1, 2, 3)
        return np.einsum("gij,gpj->gpi", turn, loads).reshape(-1, 6)

    def _loads(
        self, motions: Motion, turn: np.ndarray, place: np.ndarray
    ) -> np.ndarray:
        """Return force and moment on each geom along its own axes, (G, 6), summed over
        the zones."""
        grounds = [
            self.ground._replace(grazing_sine=law.grazing_sine) for law in self.laws
        ]
        if len(self.laws) == 1:
            return self.blocks.loads(self.laws[0], grounds[0], motions)[:, 0]

        owner = self.blocks.owner
        element_place = Place(np.moveaxis(turn[owner], 0, -1), place[owner].T)
        total = np.zeros((len(self.geoms), 6))
        for zone, (law, ground) in enumerate(zip(self.laws, grounds)):
            share = share_in(self.zones, zone, self.blocks.faces, element_place)
            total += self.blocks.loads_by_numpy(law, ground, motions, share)[:, 0]
        return total


def _along_axes(turn: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Return vectors (G, 3) of the world along the axes of geoms. turn: (G, 3, 3)."""
    return np.einsum("gij,gi->gj", turn, vectors)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return a x b of arrays (N, 3); `numpy.cross` takes five times as long for a few
    rows."""
    return a[:, [1, 2, 0]] * b[:, [2, 0, 1]] - a[:, [2, 0, 1]] * b[:, [1, 2, 0]]


def _moving_dofs(model: mujoco.MjModel, body: int) -> np.ndarray:
    """Return whether each degree of freedom moves a body, (nv,)."""
    moving = np.zeros(model.nv, bool)
    dof = last_dof(model, body)
    while dof >= 0:
        moving[dof] = True
        dof = model.dof_parentid[dof]
    return moving


def _bounding_sphere(points: np.ndarray) -> list[float]:
    """Return the middle and the radius, m, of a sphere around points (N, 3)."""
    middle = (points.max(0) + points.min(0)) / 2
    return [*middle, np.linalg.norm(points - middle, axis=1).max()]
