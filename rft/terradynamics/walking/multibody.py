"""Newton's equations of the bodies of a MuJoCo model on grains.

MuJoCo gives the equations of motion, M(q) dv/dt + c(q, v) = actuators + springs,
dampers and constraints + J^T w, with the grains' wrenches w(q, v) added. The law
depends on the direction of a velocity alone, so it is stiff wherever something is
nearly at rest; bodies chatter where forces are computed at the start of a step and held
during it. So steps are those of the planar engine (`rft.terradynamics.walking.sdirk`):
SDIRK2, of order 2, each stage solved to convergence in all of the model's velocities by
Newton's method. From the state at a stage's end MuJoCo's inverse dynamics compute the
forces that its accelerations require; the residual is what the grains' forces lack of
these. The slopes of the grains' forces are differences, body by body. The slopes of all
other forces, stiff actuators' among them, are differences, too, once a step.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import mujoco
import numpy as np

from rft.core.refusal import require
from rft.terradynamics.walking.facets import Facets, Grains, Poses, Surface
from rft.terradynamics.walking.sdirk import (
    FARTHEST,
    GAMMA,
    HALVINGS,
    LEAST_DECREASE,
    LEAST_SHARE,
    TOLERANCE,
)

ITERATIONS = 12  # of Newton's method
WIDTHS = (
    30.0,
    8.0,
    3.0,
    1.5,
    1.0,
)  # factors of the rounding, one after another where Newton's method fails
NUDGE = 1e-6  # change of a velocity for differences of MuJoCo's forces, m/s


class Multibody:
    """A MuJoCo model on grains, step after step.

    model: compiled; gravity along -z, the surface at z = 0. surfaces: those that touch
    the ground, from `rft.terradynamics.walking.geoms.surfaces` or `Surface`. Their
    geoms touch grains and nothing else: the model loses all contacts of theirs, those
    with a floor, too. grains: the law. control: function (time, rate_time) -> controls
    (nu,) of the actuators at a time, s, by the rates of a clock at ``rate_time``, which
    tells the side of a kink; None for the controls in the data.

        craft = Multibody(model, surfaces(model, {"hull": mesh}), Grains(Spatial(xi_n=3e5)))
        while craft.data.time < 10.0:
            craft.step(0.01)

    Attributes
    ----------
    data : MjData
        qpos, qvel and ctrl may be set before a step; qfrc_applied are the grains' generalised forces at the end of the last.
    work, loss : float
        Work of the actuators, and loss into the ground, dampers and constraints, J; work = loss + change of `energy`, to the
        order of the steps.
    wrenches : array (B, 6)
        Force, N, and moment, N m, of the grains on `Facets.bodies` about their origins at the end of the last step.
    unsolved : int
        Number of steps that were accepted unsolved, since Newton's method failed even at the shortest length.
    defect, residual : float
        Sum of the residuals of these steps, and the largest residual of all steps, m/s.
    evaluations : int
        How often the grains' forces were computed.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        surfaces: Sequence[Surface],
        grains: Grains,
        control: Callable[[float, float], np.ndarray] | None = None,
    ):
        require(
            model.nv > 0, "nothing in the model can move", because="it has no joints"
        )
        require(
            model.na == 0,
            "the model has actuators with a state of their own",
            instead="drop their dyntype",
        )
        mujoco.set_mju_user_warning(_ignore)
        _remove_contacts(model, surfaces)
        model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
        self.model, self.data = model, mujoco.MjData(model)
        self.facets, self.grains, self.control = Facets(surfaces), grains, control
        self.work = self.loss = 0.0
        (
            self.unsolved,
            self.residual,
            self.defect,
            self._step_residual,
            self.evaluations,
        ) = 0, 0.0, 0.0, 0.0, 0
        self.wrenches = np.zeros((len(self.facets.bodies), 6))
        self.jacobians = np.zeros((len(self.facets.bodies), 6, model.nv))
        mujoco.mj_forward(model, self.data)
        self.size = self._sizes()
        self._model_slopes = None

    def _sizes(self) -> np.ndarray:
        """Return the speed, m/s, per unit of each velocity (nv,): 1, or a reach, m, for rotations."""
        model, data = self.model, self.data
        places = data.xpos[self.facets.bodies]
        reach = float(
            (np.linalg.norm(places - places.mean(0), axis=1) + self.facets.reach).max()
        )
        rotating = [
            int(mujoco.mjtJoint.mjJNT_HINGE),
            int(mujoco.mjtJoint.mjJNT_BALL),
        ]  # NumPy compares no enumerations
        size = np.where(np.isin(model.jnt_type[model.dof_jntid], rotating), reach, 1.0)
        for joint in np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_FREE):
            first = model.jnt_dofadr[joint] + 3
            size[first : first + 3] = reach
        return size

    def energy(self) -> float:
        """Return the kinetic and potential energy of the data, J, with that of springs."""
        mujoco.mj_fwdPosition(self.model, self.data)
        mujoco.mj_energyPos(self.model, self.data)
        mujoco.mj_energyVel(self.model, self.data)
        return float(self.data.energy.sum())

    def state(self) -> tuple:
        """Return the numbers that all further steps depend on."""
        data, sums = self.data, (self.work, self.loss, self.residual, self.defect)
        return (
            data.time,
            data.qpos.copy(),
            data.qvel.copy(),
            *map(float, sums),
            self.unsolved,
            self.evaluations,
        )

    def restore(self, state: tuple) -> None:
        """Set the body to a `state`."""
        data = self.data
        (
            data.time,
            data.qpos[:],
            data.qvel[:],
            self.work,
            self.loss,
            self.residual,
            self.defect,
            *counts,
        ) = state
        self.unsolved, self.evaluations = counts
        mujoco.mj_fwdPosition(self.model, data)

    def step(
        self, h: float, rate_time: float | None = None, halvings: int = HALVINGS
    ) -> None:
        """Take a time step h, s, with the controls' rates at ``rate_time``, s, by default the middle of the step; a step that
        cannot be solved is halved."""
        data = self.data
        rate_time = data.time + h / 2 if rate_time is None else rate_time
        start = data.time, data.qpos.copy(), data.qvel.copy(), self.work, self.loss
        solved = self._step(*start[:3], h, rate_time)
        if solved and np.isfinite(data.qpos).all():
            self.residual = max(self.residual, self._step_residual)
            return
        if halvings:
            data.time, data.qpos[:], data.qvel[:], self.work, self.loss = start
            self.step(h / 2, rate_time, halvings - 1)
            self.step(h / 2, rate_time, halvings - 1)
            return
        finite = (
            np.isfinite(data.qpos).all() and np.isfinite([self.work, self.loss]).all()
        )
        require(
            bool(finite),
            f"the time step at {start[0]:.4g} s cannot be solved",
            instead="make steps shorter",
        )
        self.unsolved, self.defect = (
            self.unsolved + 1,
            self.defect + self._step_residual,
        )
        self.residual = max(self.residual, self._step_residual)

    def _step(self, t, q, v, h, rate_time) -> bool:
        """Take a time step h from positions q and velocities v, and return whether both stages were solved."""
        self._model_slopes, self._step_residual = None, 0.0
        k = GAMMA * h
        first, solved, *powers = self._stage(q, v, v, k, t + k, rate_time)
        q_2, v_2 = self._integrated(q, first, h - k), v + (h - k) / k * (first - v)
        _, solved_2, *powers_2 = self._stage(q_2, v_2, first, k, t + h, rate_time)
        work, loss = (
            h * ((1 - GAMMA) * a + GAMMA * b) for a, b in zip(powers, powers_2)
        )
        self.work, self.loss = self.work + work, self.loss + loss
        return solved and solved_2

    def _integrated(self, q, v, time) -> np.ndarray:
        """Return the positions after a time with constant velocities."""
        q = q.copy()
        mujoco.mj_integratePos(self.model, q, v, time)
        return q

    def _stage(self, q, v, guess, k, t, rate_time):
        """Return velocities V = v + k a(q + k V, V), whether the stage is solved, and power of the actuators and of all losses
        there, W. Where Newton's method fails, it goes through wider roundings."""
        data = self.data
        data.time = t
        if self.control:
            data.ctrl[:] = self.control(t, rate_time)
        velocity, residual = self._newton(q, v, guess, k)
        if not residual <= TOLERANCE * self.grains.rounding:
            plain = self.grains
            for width in WIDTHS:
                self.grains = replace(plain, rounding=width * plain.rounding)
                velocity, residual = self._newton(
                    q, v, velocity if np.isfinite(velocity).all() else guess, k
                )
            self.grains = plain
        self._step_residual = max(self._step_residual, residual)
        solved = residual <= TOLERANCE * self.grains.rounding
        motor_power = float(data.qfrc_actuator @ data.qvel)
        losses = (
            data.qfrc_applied
            + data.qfrc_passive
            - data.qfrc_spring
            + data.qfrc_constraint
        )
        return velocity, solved, motor_power, -float(losses @ data.qvel)

    def _newton(self, q, v, guess, k) -> tuple[np.ndarray, float]:
        """Return velocities by Newton's method from a guess, and their residual, m/s; the data are those of the velocities."""
        tolerance, data_match, velocity = TOLERANCE * self.grains.rounding, True, guess
        farthest = FARTHEST * self.facets.reach.max() / k

        def largest_share(size):
            return farthest / max(farthest, size)

        residual, slope = self._residual(q, v, velocity, k)
        step = _solve(slope, -residual)
        size = np.abs(step * self.size).max()
        share = largest_share(size)
        for _ in range(ITERATIONS):
            if (
                size <= tolerance
                or share < LEAST_SHARE * largest_share(size)
                or not np.isfinite(size)
            ):
                break
            trial = velocity + share * step
            residual, trial_slope = self._residual(q, v, trial, k)
            trial_size = np.abs(_solve(slope, -residual) * self.size).max()
            if trial_size <= (1.0 - LEAST_DECREASE * share) * size:
                velocity, slope, data_match = trial, trial_slope, True
                step = _solve(slope, -residual)
                size = np.abs(step * self.size).max()
                share = largest_share(size)
            else:
                share, data_match = share / 2, False
        if not data_match:
            self._residual(q, v, velocity, k)
        return velocity, float(size)

    def _residual(self, q, v, velocity, k) -> tuple[np.ndarray, np.ndarray]:
        """Return the force (nv,) that a stage with these velocities at its end lacks, and its slopes (nv, nv)."""
        required = self._required_force(q, v, velocity, k)
        if self._model_slopes is None or self.data.nefc:
            self._model_slopes = self._slopes(q, v, velocity, k, required)
            required = self._required_force(q, v, velocity, k)
        applied, slope = self._loads(k)
        self.evaluations += 1
        self.data.qfrc_applied[:] = applied
        return required - applied, self._model_slopes - slope

    def _required_force(self, q, v, velocity, k) -> np.ndarray:
        """Return the force (nv,) that the motion of a stage requires beside all forces of MuJoCo's model."""
        data = self.data
        data.qpos[:] = q
        mujoco.mj_integratePos(self.model, data.qpos, velocity, k)
        data.qvel[:], data.qacc[:] = velocity, (velocity - v) / k
        mujoco.mj_inverse(self.model, data)
        mujoco.mj_fwdActuation(self.model, data)
        return data.qfrc_inverse - data.qfrc_actuator

    def _slopes(self, q, v, velocity, k, required) -> np.ndarray:
        """Return the slopes (nv, nv) of `_required_force` by the velocities, from differences."""
        slopes = np.empty((len(velocity), len(velocity)))
        for j in range(len(velocity)):
            changed = velocity.copy()
            changed[j] += NUDGE / self.size[j]
            slopes[:, j] = (self._required_force(q, v, changed, k) - required) * (
                self.size[j] / NUDGE
            )
        return slopes

    def _loads(self, k) -> tuple[np.ndarray, np.ndarray]:
        """Return the grains' generalised forces (nv,) and their slopes (nv, nv)."""
        model, data, facets, j = self.model, self.data, self.facets, self.jacobians
        for row, body in zip(j, facets.bodies):
            mujoco.mj_jacBody(model, data, row[:3], row[3:], body)
        twist = j @ data.qvel
        rotation = data.xmat[facets.bodies].reshape(-1, 3, 3)
        poses = Poses(rotation, data.xpos[facets.bodies], twist[:, :3], twist[:, 3:])
        self.wrenches, slopes = facets.loads(self.grains, poses, k)
        return np.einsum("bij,bi->j", j, self.wrenches), (
            j.swapaxes(1, 2) @ slopes @ j
        ).sum(0)


def _remove_contacts(model: mujoco.MjModel, surfaces: Sequence[Surface]) -> None:
    """Remove all contacts of the surfaces' geoms from a model; ValueError where a <pair> names one."""
    own = np.zeros(model.ngeom, bool)
    for surface in surfaces:
        own |= (
            model.geom_bodyid == surface.body
            if surface.geom is None
            else np.arange(model.ngeom) == surface.geom
        )
    model.geom_contype[own] = model.geom_conaffinity[own] = 0
    paired = own[model.pair_geom1] | own[model.pair_geom2]
    require(
        not paired.any(),
        "a <pair> of <contact> names a geom that touches the ground, and no other thing",
        instead="drop it",
    )


def _ignore(_warning: str) -> None:
    """Ignore a warning, which MuJoCo would write to a file in the present folder; unsolved steps are counted."""


def _solve(matrix, right) -> np.ndarray:
    """Return the solution (n,) of linear equations, nan for singular ones."""
    try:
        return np.linalg.solve(matrix, right)
    except np.linalg.LinAlgError:
        return np.full(len(right), np.nan)
