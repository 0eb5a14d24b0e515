"""Robots as MuJoCo machines: a model, its surfaces that touch the ground, and the clock
that drives its actuators."""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np

from rft.terradynamics.walking.craft import Screws
from rft.terradynamics.walking.flippers import Flippers
from rft.terradynamics.walking.robot import Robot, Tripod
from rft.terradynamics.walking.spatial import craft_model, flipper_model, hexapod
from rft.terradynamics.walking.spatial.facets import Surface
from rft.terradynamics.walking.spatial.mjcf import Mjcf
from rft.terradynamics.walking.spatial.multibody import Multibody

JOINT = int(mujoco.mjtTrn.mjTRN_JOINT)
FREE = int(mujoco.mjtJoint.mjJNT_FREE)
SLIDE = int(mujoco.mjtJoint.mjJNT_SLIDE)
HINGE = int(mujoco.mjtJoint.mjJNT_HINGE)
# Least cosine of an axis with the vertical, for it to count as vertical.
VERTICAL = 0.99
# Time constant of the servos of legs and screws, cycles: some ten of MuJoCo's steps.
SERVO_TIME = 0.02
# The clock's rates just after time 0, s, on the side of a kink that the walk begins on.
AFTER_START = 1e-9


class Machine(NamedTuple):
    """A robot for MuJoCo.

    model: compiled. surfaces: those that touch the ground. root: number of the body
    that walks. driven: (K,), numbers of the actuators that follow the clock. phases:
    (K,), of these, cycles. stroke: of a robot whose actuators move to and fro; None if
    they turn round."""

    model: mujoco.MjModel
    surfaces: list[Surface]
    root: int
    driven: np.ndarray
    phases: np.ndarray
    stroke: Flippers | None = None


def build_machine(
    robot: Robot, elements: int, planar: bool = False, pieces: int = 1
) -> Machine:
    """Return the machine of a robot.

    elements: number of elements, or of edges, of its surfaces. planar: whether a robot
    of the vertical plane stays in it. pieces: into which the elements of such a robot
    are cut."""
    if isinstance(robot, Mjcf):
        surfaces = robot.surfaces(elements)
        root = int(robot.model.body_rootid[surfaces[0].body])
        phases = np.array(robot.phases, float)
        return Machine(robot.model, surfaces, root, robot.driven, phases)

    if isinstance(robot, Screws):
        model = mujoco.MjModel.from_xml_string(craft_model.mjcf(robot))
        surfaces = craft_model.surfaces(robot, elements)
        return Machine(model, surfaces, 1, np.arange(2), np.zeros(2))

    if isinstance(robot, Flippers):
        model = mujoco.MjModel.from_xml_string(flipper_model.mjcf(robot))
        surfaces = flipper_model.surfaces(robot, elements)
        # A walk begins in the middle of the time between strokes.
        phases = np.full(model.nu, 0.5)
        return Machine(model, surfaces, 1, np.arange(model.nu), phases, robot)

    model = mujoco.MjModel.from_xml_string(hexapod.mjcf(robot, elements, planar))
    surfaces = hexapod.surfaces(robot, pieces * elements)
    phases = hexapod.leg_phases(robot)
    return Machine(model, surfaces, 1, np.arange(len(phases)), phases)


def set_servo_damping(machine: Machine, frequency: float) -> None:
    """Let the servos of legs or screws follow a clock of a frequency, Hz, with the time
    constant `SERVO_TIME`.

    Angles would swing where this is less than half of a step of MuJoCo, which holds
    their force by the angle."""
    bias = machine.model.actuator_biasprm
    bias[machine.driven, 2] = bias[machine.driven, 1] * SERVO_TIME / frequency


class Clock:
    """Controls of a machine's actuators by the clock of a gait.

    A driven actuator with the force g u + b_0 + b_1 length + b_2 velocity gets the
    control u for which its force is 0 at the clock's length and rate; the others have
    the controls of the model's first keyframe, or 0."""

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
        phase = f * time + self.machine.phases
        rate_phase = f * rate_time + self.machine.phases
        stroke = self.machine.stroke
        if stroke:
            # Arm and lift of one side after the other, all at one phase.
            lengths, rates = stroke.stroke(self.gait, phase[0], rate_phase[0])
            return np.tile(lengths, 2), f * np.tile(rates, 2)
        return self.gait.angle(phase, rate_phase), f * self.gait.rate(rate_phase)

    def __call__(self, time: float, rate_time: float) -> np.ndarray:
        """Return the controls (nu,) at a time, s, by the rates of the clock at
        ``rate_time``, s."""
        length, rate = self.actuator_motion(time, rate_time)
        force = self.bias[:, 0] + self.bias[:, 1] * length + self.bias[:, 2] * rate
        controls = self.rest.copy()
        controls[self.machine.driven] = -force / self.gain
        return controls

    def kinks(self) -> list[float]:
        """Return the phases, from 0 to 1, at which an actuator's rate may jump, with
        both ends."""
        kinks = {0.0, 1.0}
        if self.machine.stroke:
            for kink in self.machine.stroke.kinks(self.gait) - self.machine.phases[0]:
                kinks.add(round(float(kink), 12) % 1.0)
            return sorted(kinks)
        if len(self.gait.kinks) == 2:
            return sorted(kinks)
        for phase in self.machine.phases:
            for side in (-1, 1):
                end_of_stance = (side * self.gait.duty / 2 - phase) % 1.0
                kinks.add(round(end_of_stance, 12) % 1.0)
        return sorted(kinks)

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
        has_angle = np.isin(model.jnt_type[joints], (SLIDE, HINGE))
        has_angle &= model.actuator_trntype[driven] == JOINT
        return joints, np.where(has_angle, gears, 0.0)

    def set_start(self, body: Multibody) -> None:
        """Set a body to its state at time 0: at rest, with the lowest point of all
        surfaces on the ground.

        Driven actuators are where the clock has them, all else is as in the first
        keyframe, if there is one."""
        model = body.model
        data = body.data
        if model.nkey:
            mujoco.mj_resetDataKeyframe(model, data, 0)
        data.time = 0.0
        data.qvel[:] = 0.0

        # Actuators of velocity leave their joints where they are.
        lengths, _ = self.actuator_motion(0.0, AFTER_START)
        has_position = model.actuator_biasprm[self.machine.driven, 1] != 0.0
        joints, gears = self._driven_joints()
        for k in np.flatnonzero(has_position & (gears != 0.0)):
            data.qpos[model.jnt_qposadr[joints[k]]] = lengths[k] / gears[k]
        self.set_rates(body, AFTER_START)
        body.update()

        height = self._height_index()
        if height is not None:
            bodies = body.facets.bodies
            rotations = data.xmat[bodies].reshape(-1, 3, 3)
            lowest = body.facets.heights(rotations, data.xpos[bodies]).min()
            data.qpos[height] -= lowest
            body.update()

    def _height_index(self) -> int | None:
        """Return the index in qpos of the machine's height; None if it cannot fall."""
        model = self.machine.model
        for joint in np.flatnonzero(model.jnt_bodyid == self.machine.root):
            if model.jnt_type[joint] == FREE:
                return int(model.jnt_qposadr[joint]) + 2
            if model.jnt_type[joint] == SLIDE and model.jnt_axis[joint, 2] > VERTICAL:
                return int(model.jnt_qposadr[joint])
        return None
