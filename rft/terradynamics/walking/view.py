"""Views of a walk in three dimensions: triangles for any drawing, and pictures by
MuJoCo where there is a GL."""

from __future__ import annotations

import warnings
from collections.abc import Iterator

import mujoco
import numpy as np

from rft.terradynamics.walking.engines import Fineness, Walker
from rft.terradynamics.walking.machine import machine

SAND = (0.80, 0.65, 0.45, 0.75)  # red, green, blue and opacity
# colour of lines across the surface, and their number to either side
LINE = (0.55, 0.42, 0.28, 1.0)
LINES = 8
# of the camera: degrees, degrees, and sizes of the robot
AZIMUTH = 65.0
ELEVATION = -18.0
DISTANCE = 2.0


class View:
    """View of one walker. groups: (T,), of each triangle: 0 for the body that walks, 1
    or 2 for the other bodies, by the phases of the actuators where there is one for
    each of these bodies."""

    def __init__(self, walker: Walker, numerics: Fineness):
        self.machine = machine(walker.robot, numerics.elements)
        self.data = mujoco.MjData(self.machine.model)
        surfaces = self.machine.surfaces
        legs = [s.body for s in surfaces if s.body != self.machine.root]
        late = (
            np.round(2 * self.machine.phases).astype(int) % 2
            if len(legs) == len(self.machine.phases)
            else None
        )
        kind = {
            body: 1 if late is None else 1 + int(late[k]) for k, body in enumerate(legs)
        }
        self.groups = np.repeat(
            [kind.get(s.body, 0) for s in surfaces], [len(s.corners) for s in surfaces]
        )

    def triangles(self, state: np.ndarray) -> np.ndarray:
        """Return the triangles (T, 3, 3) in the world, m, at positions (nq,)."""
        self.data.qpos[:] = state
        mujoco.mj_kinematics(self.machine.model, self.data)
        place = self.data.xpos
        rotation = self.data.xmat.reshape(-1, 3, 3)
        return np.concatenate(
            [
                s.corners @ rotation[s.body].T + place[s.body]
                for s in self.machine.surfaces
            ]
        )

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
        camera = mujoco.MjvCamera()
        size = float(np.ptp(self.triangles(states[0]).reshape(-1, 3), axis=0).max())
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

    _gl_context = _mjr_context = None


def _add_sand(scene, place, size: float) -> None:
    """Add the surface about a place to a scene, with a line across it every ``size``,
    m, which shows its motion."""
    lines = size * (np.round(place[0] / size) + np.arange(-LINES, LINES + 1))
    width = 0.01 * size
    parts = [
        (mujoco.mjtGeom.mjGEOM_PLANE, (20 * size, 20 * size, 0.01), place[0], SAND)
    ]
    parts += [
        (mujoco.mjtGeom.mjGEOM_BOX, (width, 20 * size, 0.1 * width), x, LINE)
        for x in lines
    ]
    for kind, sizes, x, colour in parts:
        if scene.ngeom < scene.maxgeom:
            geom = scene.geoms[scene.ngeom]
            centre = np.array([x, place[1], 0.0])
            mujoco.mjv_initGeom(
                geom,
                kind,
                np.array(sizes),
                centre,
                np.eye(3).ravel(),
                np.array(colour, "f4"),
            )
            scene.ngeom += 1
