"""Robots as MuJoCo machines: a model, its surfaces that touch the ground, and the clock
that drives its actuators."""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np

from rft.terradynamics.walking import craft_model, hexapod
from rft.terradynamics.walking.craft import Screws
from rft.terradynamics.walking.facets import Surface
from rft.terradynamics.walking.mjcf import Mjcf
from rft.terradynamics.walking.multibody import Multibody
from rft.terradynamics.walking.robot import Robot, Tripod

JOINT = int(mujoco.mjtTrn.mjTRN_JOINT)
FREE, SLIDE, HINGE = (
    int(getattr(mujoco.mjtJoint, f"mjJNT_{kind}"))
    for kind in ("FREE", "SLIDE", "HINGE")
)
VERTICAL = (
    0.99  # least cosine of an axis with the vertical, for it to count as vertical
)
SERVO_TIME = (
    0.02  # of the servos of legs and screws, cycles: some ten of MuJoCo's steps
)


class Machine(NamedTuple):
    """A robot for MuJoCo. model: compiled. surfaces: those that touch the ground. root:
    number of the body that walks. driven: (K,), numbers of the actuators that follow
    the clock. phases: (K,), of these, cycles."""

    model: mujoco.MjModel
    surfaces: list[Surface]
    root: int
    driven: np.ndarray
    phases: np.ndarray


def machine(
    robot: Robot, elements: int, planar: bool = False, pieces: int = 1
) -> Machine:
    """Return the machine of a robot. elements: number of elements, or of edges, of its
    surfaces. planar: whether a robot of the vertical plane stays in it. pieces: into
    which the elements of such a robot are cut."""
    if isinstance(robot, Mjcf):
        surfaces = robot.surfaces(elements)
        root = int(robot.model.body_rootid[surfaces[0].body])
        return Machine(
            robot.model, surfaces, root, robot.driven, np.array(robot.phases, float)
        )
    if isinstance(robot, Screws):
        model = mujoco.MjModel.from_xml_string(craft_model.mjcf(robot))
        return Machine(
            model, craft_model.surfaces(robot, elements), 1, np.arange(2), np.zeros(2)
        )
    model = mujoco.MjModel.from_xml_string(hexapod.mjcf(robot, elements, planar))
    phases = hexapod.phases(robot)
    return Machine(
        model,
        hexapod.surfaces(robot, pieces * elements),
        1,
        np.arange(len(phases)),
        phases,
    )


def pace_servos(machine: Machine, frequency: float) -> None:
    """Let the servos of legs or screws follow a clock of a frequency, Hz, with the time
    constant `SERVO_TIME`.

    Angles would swing where this is less than half of a step of MuJoCo, which holds
    their force by the angle."""
    bias = machine.model.actuator_biasprm
    bias[machine.driven, 2] = bias[machine.driven, 1] * SERVO_TIME / frequency


class Clock:
    """Controls of a machine's actuators by the clock of a gait. A driven actuator with
    the force g u + b_0 + b_1 length + b_2 velocity gets the control u for which its
    force is 0 at the clock's length and rate; the others have the controls of the
    model's first keyframe, or 0."""

    def __init__(self, machine: Machine, gait: Tripod):
        model = machine.model
        self.machine = machine
        self.gait = gait
        self.rest = model.key_ctrl[0].copy() if model.nkey else np.zeros(model.nu)
        self.gain = model.actuator_gainprm[machine.driven, 0]
        self.bias = model.actuator_biasprm[machine.driven, :3]

    def actuator_motion(
        self, time: float, rate_time: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return lengths and rates (K,) of the driven actuators at a time, s, by the
        rates of the clock at ``rate_time``, s."""
        f = self.gait.frequency
        phases = self.machine.phases
        return self.gait.angle(
            f * time + phases, f * rate_time + phases
        ), f * self.gait.rate(f * rate_time + phases)

    def __call__(self, time: float, rate_time: float) -> np.ndarray:
        """Return the controls (nu,) at a time, s, by the rates of the clock at
        ``rate_time``, s."""
        angle, rate = self.actuator_motion(time, rate_time)
        controls = self.rest.copy()
        controls[self.machine.driven] = (
            -(self.bias[:, 0] + self.bias[:, 1] * angle + self.bias[:, 2] * rate)
            / self.gain
        )
        return controls

    def kinks(self) -> list[float]:
        """Return the phases, from 0 to 1, at which an actuator's rate may jump, with
        both ends."""
        if len(self.gait.kinks) == 2:
            return [0.0, 1.0]
        ends = [
            (side * self.gait.duty / 2 - p) % 1.0
            for p in self.machine.phases
            for side in (-1, 1)
        ]
        return sorted({0.0, 1.0, *(round(e, 12) % 1.0 for e in ends)})

    def set_rates(self, body: Multibody, rate_time: float) -> None:
        """Give the joints that actuators drive the rates of the clock at a time, s."""
        _, rates = self.actuator_motion(rate_time, rate_time)
        for joint, gear, rate in zip(*self._driven_joints(), rates):
            if gear:
                body.data.qvel[body.model.jnt_dofadr[joint]] = rate / gear

    def _driven_joints(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the joints (K,) of the driven actuators and their gears, 0 for those
        that turn or slide no joint."""
        model = self.machine.model
        driven = self.machine.driven
        joints = model.actuator_trnid[driven, 0]
        gears = model.actuator_gear[driven, 0]
        simple = np.isin(model.jnt_type[joints], (SLIDE, HINGE))
        simple &= model.actuator_trntype[driven] == JOINT
        return joints, np.where(simple, gears, 0.0)

    def set_start(self, body: Multibody) -> None:
        """Set a body to its state at time 0: driven actuators by the clock, all else as
        in the first keyframe, if there is one, at rest, and at the height where the
        lowest point of all surfaces is on the ground."""
        model = body.model
        data = body.data
        if model.nkey:
            mujoco.mj_resetDataKeyframe(model, data, 0)
        data.time = 0.0
        data.qvel[:] = 0.0
        lengths, _ = self.actuator_motion(0.0, 1e-9)
        holds = model.actuator_biasprm[self.machine.driven, 1] != 0.0
        for joint, gear, length, held in zip(*self._driven_joints(), lengths, holds):
            if gear and held:
                data.qpos[model.jnt_qposadr[joint]] = length / gear
        self.set_rates(body, 1e-9)
        body.update()
        bodies = body.facets.bodies
        lowest = body.facets.heights(
            data.xmat[bodies].reshape(-1, 3, 3), data.xpos[bodies]
        ).min()
        if (height := self._height_index()) is not None:
            data.qpos[height] -= lowest
            body.update()

    def _height_index(self) -> int | None:
        """Return the index in qpos of the machine's height; None if it cannot fall."""
        model = self.machine.model
        root = self.machine.root
        for joint in np.flatnonzero(model.jnt_bodyid == root):
            if model.jnt_type[joint] == FREE:
                return int(model.jnt_qposadr[joint]) + 2
            if model.jnt_type[joint] == SLIDE and model.jnt_axis[joint, 2] > VERTICAL:
                return int(model.jnt_qposadr[joint])
        return None
