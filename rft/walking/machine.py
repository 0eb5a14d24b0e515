"""Robots as MuJoCo machines: a model, what of it touches the ground, and the clock that drives its actuators."""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np

from rft.walking import craft_model, hexapod
from rft.walking.craft import Screws
from rft.walking.facets import Surface
from rft.walking.mjcf import Mjcf
from rft.walking.multibody import Multibody
from rft.walking.robot import Robot, Tripod

JOINT = int(mujoco.mjtTrn.mjTRN_JOINT)
FREE, SLIDE, HINGE = (int(getattr(mujoco.mjtJoint, f"mjJNT_{kind}")) for kind in ("FREE", "SLIDE", "HINGE"))
LEVEL = 0.99  # cosine of the angle to the vertical, of what counts as such


class Machine(NamedTuple):
    """model: compiled. surfaces: what touches the ground. root: the body that walks. driven: (K,) actuators that follow the
    clock; phases: (K,) of each, in cycles."""

    model: mujoco.MjModel
    surfaces: list[Surface]
    root: int
    driven: np.ndarray
    phases: np.ndarray


def machine(robot: Robot, elements: int, planar: bool = False) -> Machine:
    """Of a robot, its outlines of so many elements; planar: one of the vertical plane keeps to that."""
    if isinstance(robot, Mjcf):
        surfaces = robot.surfaces(elements)
        root = int(robot.model.body_rootid[surfaces[0].body])
        return Machine(robot.model, surfaces, root, robot.driven, np.array(robot.phases, float))
    if isinstance(robot, Screws):
        model = mujoco.MjModel.from_xml_string(craft_model.mjcf(robot))
        return Machine(model, craft_model.surfaces(robot, elements), 1, np.arange(2), np.zeros(2))
    model = mujoco.MjModel.from_xml_string(hexapod.mjcf(robot, elements, planar))
    phases = hexapod.phases(robot)
    return Machine(model, hexapod.surfaces(robot, elements), 1, np.arange(len(phases)), phases)


class Clock:
    """What a machine's actuators are told by the clock of a gait. An actuator whose force is
    g u + b_0 + b_1 length + b_2 velocity is given the control u for which it rests where the clock says; others keep the
    controls of the model's first keyframe, or 0."""

    def __init__(self, machine: Machine, gait: Tripod):
        model, self.machine, self.gait = machine.model, machine, gait
        self.rest = model.key_ctrl[0].copy() if model.nkey else np.zeros(model.nu)
        self.gain, self.bias = model.actuator_gainprm[machine.driven, 0], model.actuator_biasprm[machine.driven, :3]

    def turned(self, time: float, of: float) -> tuple[np.ndarray, np.ndarray]:
        """Lengths and rates (K,) of the driven actuators at a time, by the rates that hold at the time ``of``."""
        f, phases = self.gait.frequency, self.machine.phases
        return self.gait.angle(f * time + phases, f * of + phases), f * self.gait.rate(f * of + phases)

    def __call__(self, time: float, of: float) -> np.ndarray:
        """(nu,): controls."""
        angle, rate = self.turned(time, of)
        controls = self.rest.copy()
        controls[self.machine.driven] = (
            -(self.bias[:, 0] + self.bias[:, 1] * angle + self.bias[:, 2] * rate) / self.gain
        )
        return controls

    def kinks(self) -> list[float]:
        """Parts of the cycle, from 0 to 1, at which an actuator's rate may jump."""
        if len(self.gait.kinks) == 2:
            return [0.0, 1.0]
        ends = [(side * self.gait.duty / 2 - p) % 1.0 for p in self.machine.phases for side in (-1, 1)]
        return sorted({0.0, 1.0, *(round(e, 12) % 1.0 for e in ends)})

    def place(self, body: Multibody) -> None:
        """At rest at the time 0: what the clock drives as it says, all else as in the first keyframe, if there is one, lifted
        or lowered until the lowest point of what touches the ground is on it."""
        model, data = body.model, body.data
        if model.nkey:
            mujoco.mj_resetDataKeyframe(model, data, 0)
        data.time, data.qvel[:] = 0.0, 0.0
        lengths, rates = self.turned(0.0, 1e-9)
        for actuator, length, rate in zip(self.machine.driven, lengths, rates):
            joint, gear = model.actuator_trnid[actuator, 0], model.actuator_gear[actuator, 0]
            if model.actuator_trntype[actuator] == JOINT and model.jnt_type[joint] in (SLIDE, HINGE) and gear:
                if model.actuator_biasprm[actuator, 1]:
                    data.qpos[model.jnt_qposadr[joint]] = length / gear
                data.qvel[model.jnt_dofadr[joint]] = rate / gear
        mujoco.mj_forward(model, data)
        bodies = body.facets.bodies
        lowest = body.facets.heights(data.xmat[bodies].reshape(-1, 3, 3), data.xpos[bodies]).min()
        if (upright := self._upright()) is not None:
            data.qpos[upright] -= lowest
            mujoco.mj_forward(model, data)

    def _upright(self) -> int | None:
        """Where in qpos the height of the machine is, if it may fall."""
        model, root = self.machine.model, self.machine.root
        for joint in np.flatnonzero(model.jnt_bodyid == root):
            if model.jnt_type[joint] == FREE:
                return int(model.jnt_qposadr[joint]) + 2
            if model.jnt_type[joint] == SLIDE and model.jnt_axis[joint, 2] > LEVEL:
                return int(model.jnt_qposadr[joint])
        return None
