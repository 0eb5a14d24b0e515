"""The trunk of a robot, which moves freely, and the joints that move its limbs."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

HINGE = int(mujoco.mjtJoint.mjJNT_HINGE)
SLIDE = int(mujoco.mjtJoint.mjJNT_SLIDE)
FREE = int(mujoco.mjtJoint.mjJNT_FREE)
COORDINATES = {FREE: 7, int(mujoco.mjtJoint.mjJNT_BALL): 4, SLIDE: 1, HINGE: 1}


@dataclass(frozen=True)
class Joints:
    """Where the coordinates of a model are in qpos and qvel.

    trunk: first numbers of the first free joint in qpos and qvel; None without one.
    turning: in qpos, of hinges without a range, whose angle counts up to a turn.
    others: in qpos, of all other coordinates but the trunk's. rates: in qvel, of all
    but the trunk. scalars: in qpos, of all hinges and slides."""

    trunk: tuple[int, int] | None
    turning: np.ndarray
    others: np.ndarray
    rates: np.ndarray
    scalars: np.ndarray

    @classmethod
    def of_model(cls, model: mujoco.MjModel) -> Joints:
        """Return the joints of a model."""
        trunk = None
        turning: list[int] = []
        others: list[int] = []
        scalars: list[int] = []
        rates = np.ones(model.nv, bool)
        for joint, kind in enumerate(model.jnt_type):
            first = int(model.jnt_qposadr[joint])
            if kind == FREE and trunk is None:
                trunk = first, int(model.jnt_dofadr[joint])
                rates[trunk[1] : trunk[1] + 6] = False
                continue
            if kind == HINGE and not model.jnt_limited[joint]:
                turning.append(first)
            else:
                others += range(first, first + COORDINATES[int(kind)])
            if kind in (HINGE, SLIDE):
                scalars.append(first)
        return cls(
            trunk,
            np.array(turning, int),
            np.array(others, int),
            np.flatnonzero(rates),
            np.array(scalars, int),
        )


def rotation(quaternion: np.ndarray) -> np.ndarray:
    """Return the matrices (..., 3, 3) from the trunk's axes to the world, of
    quaternions (..., 4)."""
    w, x, y, z = np.moveaxis(quaternion, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, -1) for row in rows], -2)


def observation(joints: Joints, qpos: np.ndarray, qvel: np.ndarray) -> np.ndarray:
    """Return observations (..., n) from positions (..., nq) and velocities (..., nv).

    In order: of the trunk, its height, the vertical and its velocity along its axes,
    and its angular velocity; cosines and sines of the hinges without a range; the other
    positions of joints; the rates of all joints. A model without a freejoint has no
    trunk."""
    parts = []
    if joints.trunk is not None:
        place, rate = joints.trunk
        turn = rotation(qpos[..., place + 3 : place + 7])
        velocity = np.einsum("...ij,...i->...j", turn, qvel[..., rate : rate + 3])
        parts += [
            qpos[..., place + 2 : place + 3],
            turn[..., 2, :],
            velocity,
            qvel[..., rate + 3 : rate + 6],
        ]
    angles = qpos[..., joints.turning]
    parts += [
        np.cos(angles),
        np.sin(angles),
        qpos[..., joints.others],
        qvel[..., joints.rates],
    ]
    return np.concatenate(parts, -1)


def upright(joints: Joints, qpos: np.ndarray) -> np.ndarray:
    """Return the cosine of the trunk's tilt (...,); 1 without a trunk."""
    if joints.trunk is None:
        return np.ones(qpos.shape[:-1])
    place = joints.trunk[0]
    x = qpos[..., place + 4]
    y = qpos[..., place + 5]
    return 1 - 2 * (x * x + y * y)


@dataclass(frozen=True)
class Motors:
    """Which velocity each of the actuators (nu,) of a model acts on.

    on_joint: whether it acts on a hinge or a slide. dofs, gears: of those that do; 0
    for the rest."""

    on_joint: np.ndarray
    dofs: np.ndarray
    gears: np.ndarray

    @classmethod
    def of_model(cls, model: mujoco.MjModel) -> Motors:
        """Return the motors of a model."""
        is_joint = model.actuator_trntype == int(mujoco.mjtTrn.mjTRN_JOINT)
        joints = np.where(is_joint, model.actuator_trnid[:, 0], 0)
        on_joint = is_joint & np.isin(model.jnt_type[joints], (HINGE, SLIDE))
        return cls(
            on_joint,
            np.where(on_joint, model.jnt_dofadr[joints], 0),
            np.where(on_joint, model.actuator_gear[:, 0], 0.0),
        )

    def power(self, state) -> np.ndarray:
        """Return the power that the actuators give, W, (...,); what they take up does
        not count against it. state: `geomech.gym.state.State`."""
        force = state.actuator_force
        rate = self.gears * state.qvel[..., self.dofs]
        if not self.on_joint.all():
            rate = np.where(self.on_joint, rate, state.actuator_velocity)
        return np.maximum(force * rate, 0.0).sum(-1)
