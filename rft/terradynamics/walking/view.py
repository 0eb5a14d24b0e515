"""Views of a walk in three dimensions: triangles for any drawing, and pictures by
MuJoCo where it can draw."""

from __future__ import annotations

import warnings
from collections.abc import Iterator

import mujoco
import numpy as np

from rft.terradynamics.walking.engines import Fineness, Walker
from rft.terradynamics.walking.spatial.machine import build_machine

# Colours are red, green, blue and opacity.
SAND_COLOUR = (0.80, 0.65, 0.45, 0.75)
LINE_COLOUR = (0.55, 0.42, 0.28, 1.0)
LINES = 8  # across the surface, before the robot and behind it
AZIMUTH = 65.0  # of the camera, degrees
ELEVATION = -18.0  # of the camera, degrees
DISTANCE = 2.0  # of the camera, sizes of the robot


class View:
    """View of one walker.

    groups: (T,), of each triangle: 0 for the body that walks, 1 or 2 for the other
    bodies, by the phases of the actuators where there is one for each of these
    bodies."""

    def __init__(self, walker: Walker, numerics: Fineness):
        self.machine = build_machine(walker.robot, numerics.elements)
        self.data = mujoco.MjData(self.machine.model)
        surfaces = self.machine.surfaces
        groups = self._groups_of_bodies()
        self.groups = np.repeat(
            [groups.get(s.body, 0) for s in surfaces],
            [len(s.corners) for s in surfaces],
        )

    def _groups_of_bodies(self) -> dict[int, int]:
        """Return the groups of the bodies other than the one that walks."""
        root = self.machine.root
        phases = self.machine.phases
        legs = [s.body for s in self.machine.surfaces if s.body != root]
        if len(legs) != len(phases):
            return dict.fromkeys(legs, 1)
        is_late = np.round(2 * phases).astype(int) % 2
        return {body: 1 + int(late) for body, late in zip(legs, is_late)}

    def triangles(self, state: np.ndarray) -> np.ndarray:
        """Return the triangles (T, 3, 3) in the world, m, at positions (nq,)."""
        self.data.qpos[:] = state
        mujoco.mj_kinematics(self.machine.model, self.data)
        place = self.data.xpos
        rotation = self.data.xmat.reshape(-1, 3, 3)
        triangles = [
            s.corners @ rotation[s.body].T + place[s.body]
            for s in self.machine.surfaces
        ]
        return np.concatenate(triangles)

    def pictures(
        self, states: np.ndarray, wide: int = 640, tall: int = 360
    ) -> Iterator[np.ndarray] | None:
        """Return pictures (tall, wide, 3), bytes, at positions (N, nq); None where
        MuJoCo cannot draw."""
        model = self.machine.model
        buffer = model.vis.global_
        buffer.offwidth = max(wide, buffer.offwidth)
        buffer.offheight = max(tall, buffer.offheight)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                renderer = _Renderer(model, tall, wide)
        except Exception:  # the error depends on which GL or display is missing
            return None
        return self._pictures(renderer, states)

    def _pictures(self, renderer, states: np.ndarray) -> Iterator[np.ndarray]:
        """Yield the pictures of `pictures`, the camera beside the body that walks."""
        corners = self.triangles(states[0]).reshape(-1, 3)
        size = float(np.ptp(corners, axis=0).max())
        camera = mujoco.MjvCamera()
        camera.azimuth = AZIMUTH
        camera.elevation = ELEVATION
        camera.distance = DISTANCE * size
        with renderer:
            for state in states:
                self.data.qpos[:] = state
                mujoco.mj_forward(self.machine.model, self.data)
                camera.lookat[:] = self.data.xpos[self.machine.root]
                renderer.update_scene(self.data, camera)
                _add_sand(renderer.scene, camera.lookat, size)
                yield renderer.render()


class _Renderer(mujoco.Renderer):
    """MuJoCo's renderer with contexts that always exist: before 4.0 it closes them even
    where there is no GL, and fails."""

    _gl_context = None
    _mjr_context = None


def _add_sand(scene, place, size: float) -> None:
    """Add the surface about a place to a scene, with a line across it every ``size``,
    m, which shows its motion."""
    plane = mujoco.mjtGeom.mjGEOM_PLANE
    _add_geom(scene, plane, (20 * size, 20 * size, 0.01), place[:2], SAND_COLOUR)

    nearest = np.round(place[0] / size)
    width = 0.01 * size
    for x in size * (nearest + np.arange(-LINES, LINES + 1)):
        sizes = (width, 20 * size, 0.1 * width)
        _add_geom(scene, mujoco.mjtGeom.mjGEOM_BOX, sizes, (x, place[1]), LINE_COLOUR)


def _add_geom(scene, kind, sizes, centre, colour) -> None:
    """Add a geom to a scene that has room for it. centre: x and y on the surface, m."""
    if scene.ngeom >= scene.maxgeom:
        return
    mujoco.mjv_initGeom(
        scene.geoms[scene.ngeom],
        kind,
        np.array(sizes),
        np.array([*centre, 0.0]),
        np.eye(3).ravel(),
        np.array(colour, "f4"),
    )
    scene.ngeom += 1
