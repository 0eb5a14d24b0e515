"""A bed of sand under the geoms of a model: its surface, its law, and the elements of the geoms."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import mujoco
import numpy as np

from rft.mujoco.footprints import Prints
from rft.mujoco.hills import FLAT, Hills, tangent_plane
from rft.mujoco.model_parts import last_dof
from rft.mujoco.parts import Frames
from rft.terradynamics.ground import Ground
from rft.terradynamics.meshes.blocks import Blocks
from rft.terradynamics.meshes.contact import Face, Motion, faces
from rft.terradynamics.meshes.extruded import Extruded
from rft.terradynamics.meshes.geoms import geom_label
from rft.terradynamics.meshes.law import Spatial
from rft.terradynamics.meshes.mesh import Mesh
from rft.terradynamics.meshes.zones import Place, Zones, share_in


@dataclass(frozen=True)
class Bed:
    """Sand below the plane up . x = level, and what of a model is in it.

    up, ahead: (3,), unit vectors away from the surface and along it, in the world. geoms, bodies, roots: (G,), numbers of the
    geoms, their bodies and these bodies' roots. dofs: (G,), the last degree of freedom of each body; parents: (nv,), that of
    each degree of freedom, -1 for none. spheres: (G, 4), middle of a sphere around each geom in its frame, and radius, m.
    hills: the surface in place of a plane, where its grid is not empty. laws: one for each of the zones. prints: what
    footprints follow from; None for ground that remembers nothing. names: of the geoms."""

    laws: tuple[Extruded | Spatial, ...]
    zones: Zones
    ground: Ground
    up: np.ndarray
    ahead: np.ndarray
    level: float
    blocks: Blocks
    geoms: np.ndarray
    bodies: np.ndarray
    roots: np.ndarray
    dofs: np.ndarray
    parents: np.ndarray
    spheres: np.ndarray
    hills: Hills = FLAT
    prints: Prints | None = None
    names: tuple[str, ...] = ()

    @classmethod
    def under(
        cls,
        model: mujoco.MjModel,
        geoms: list[int],
        meshes: list[Mesh],
        laws,
        zones,
        ground,
        slope,
        level,
        hills: Hills,
    ) -> Bed:
        """Return the bed under geoms with these meshes. slope: rad, by which the surface rises along x. level: m, the height
        of the surface at x = 0. hills: the surface in place of this plane, or `FLAT`."""
        own = [faces(m.vertices[m.faces], m.middle_normals) for m in meshes]
        return cls.under_faces(
            model, geoms, own, laws, zones, ground, slope, level, hills
        )

    @classmethod
    def under_faces(
        cls,
        model: mujoco.MjModel,
        geoms: list[int],
        own: list[Face],
        laws,
        zones,
        ground,
        slope: float = 0.0,
        level: float = 0.0,
        hills: Hills = FLAT,
    ) -> Bed:
        """Return the bed as `under`, from the faces of each geom along its own axes, which may be those of sheets."""
        bodies = np.array([model.geom_bodyid[g] for g in geoms], np.int64)
        up, ahead = (
            np.array([-np.sin(slope), 0.0, np.cos(slope)]),
            np.array([np.cos(slope), 0.0, np.sin(slope)]),
        )
        spheres = [_sphere(np.stack(one[:9], -1).reshape(-1, 3)) for one in own]
        return cls(
            laws, zones, ground, up, ahead, float(level * up[2]), Blocks(own),
            np.array(geoms, np.int64), bodies, model.body_rootid[bodies].astype(np.int64),
            np.array([last_dof(model, b) for b in bodies], np.int64), model.dof_parentid.astype(np.int64),
            np.array(spheres), hills, names=tuple(geom_label(model, g) for g in geoms),
        )  # fmt: skip

    def rounded(self, rounding: float) -> Bed:
        """Return the bed with another rounding, m/s."""
        return replace(self, ground=self.ground._replace(rounding=rounding))

    def twists(self, data: mujoco.MjData) -> tuple[np.ndarray, np.ndarray]:
        """Return velocities of the geoms' origins, m/s, and angular velocities, rad/s, (G, 3), in the world."""
        twist = data.cvel[self.bodies]
        arm = data.geom_xpos[self.geoms] - data.subtree_com[self.roots]
        return twist[:, 3:] + _cross(twist[:, :3], arm), twist[:, :3]

    def frames(self, data) -> Frames:
        """Return where the geoms are, by an MjData or `rft.mujoco.addresses.Arrays`."""
        turn = data.geom_xmat[self.geoms].reshape(-1, 3, 3)
        place = data.geom_xpos[self.geoms]
        middles = place + np.einsum("gij,gj->gi", turn, self.spheres[:, :3])
        up, level = self.surface(middles)
        if self.prints:
            level = level + up[:, 2] * self.prints.memory(data.userdata).levels
        along_axes = lambda x: np.einsum(
            "gij,gi->gj", turn, np.broadcast_to(x, place.shape)
        )
        return Frames(
            along_axes(up),
            along_axes(self.ahead),
            place @ self.ahead,
            (place * up).sum(-1) - level,
            turn,
            place,
        )

    def wrenches(
        self, data: mujoco.MjData, velocity=None, spin=None, sunk: float = 0.0
    ) -> np.ndarray:
        """Return force, N, and moment about the geom's origin, N m, on each geom at given velocities, (G, 6), in the world.

        velocity, spin: (G, 3), by default those of the data. sunk: m, by which all geoms lie deeper than in the data."""
        if velocity is None:
            velocity, spin = self.twists(data)
        frames = self.frames(data)
        turn = frames.turn
        along_axes = lambda x: np.einsum("gij,gi->gj", turn, x)[:, None]
        motions = Motion(
            along_axes(np.asarray(velocity)),
            along_axes(np.asarray(spin)),
            frames.x[:, None],
            frames.up[:, None],
            frames.ahead[:, None],
            frames.height[:, None] - sunk,
        )
        loads = self._loads(motions, turn, frames.place).reshape(-1, 2, 3)
        return np.einsum("gij,gpj->gpi", turn, loads).reshape(-1, 6)

    @property
    def remembered(self) -> int:
        """How many numbers of userdata a simulation takes."""
        return self.prints.numbers if self.prints else 0

    def _loads(
        self, motions: Motion, turn: np.ndarray, place: np.ndarray
    ) -> np.ndarray:
        """Return force and moment on each geom along its own axes, (G, 6), summed over the zones."""
        grounds = [
            self.ground._replace(grazing_sine=law.grazing_sine) for law in self.laws
        ]
        if len(self.laws) == 1:
            return self.blocks.loads(self.laws[0], grounds[0], motions)[:, 0]
        where = Place(
            np.moveaxis(turn[self.blocks.owner], 0, -1), place[self.blocks.owner].T
        )
        total = np.zeros((len(self.geoms), 6))
        for zone, (law, ground) in enumerate(zip(self.laws, grounds)):
            share = share_in(self.zones, zone, self.blocks.faces, where)
            total += self.blocks.loads_by_numpy(law, ground, motions, share)[:, 0]
        return total

    def surface(self, middles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the planes up . x = level, (G, 3) and (G,), that geoms with these middles (G, 3) see."""
        if not self.hills.grid.size:
            return np.broadcast_to(self.up, middles.shape), np.full(
                len(middles), self.level
            )
        planes = [tangent_plane(*self.hills, x, y) for x, y, _ in middles]
        return np.array([n for n, _ in planes]), np.array(
            [level for _, level in planes]
        )

    @cached_property
    def moved_by(self) -> np.ndarray:
        """Whether each degree of freedom moves each geom, (G, nv)."""
        moved = np.zeros((len(self.geoms), len(self.parents)), bool)
        for row, dof in zip(moved, self.dofs):
            while dof >= 0:
                row[dof], dof = True, self.parents[dof]
        return moved


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return a x b of arrays (N, 3); `numpy.cross` takes five times as long for a few rows."""
    return a[:, [1, 2, 0]] * b[:, [2, 0, 1]] - a[:, [2, 0, 1]] * b[:, [1, 2, 0]]


def _sphere(points: np.ndarray) -> list[float]:
    """Return the middle and the radius, m, of a sphere around points (N, 3)."""
    middle = (points.max(0) + points.min(0)) / 2
    return [*middle, np.linalg.norm(points - middle, axis=1).max()]
