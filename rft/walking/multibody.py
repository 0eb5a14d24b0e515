"""Newton's equations of the bodies of a MuJoCo model on grains.

MuJoCo gives the equations of motion, M(q) dv/dt + c(q, v) = actuators + springs, dampers and constraints + J^T w, and the
grains' wrenches w(q, v) go with them. The law knows of speed its direction alone, so it is stiff wherever something is nearly
at rest, and forces that are computed at the start of a step and held during it make bodies chatter. So steps are those of the
planar engine (`rft.walking.planar`): SDIRK2, of order 2, each stage solved to its end in all of the model's velocities by
Newton's method. With the state at a stage's end MuJoCo's inverse dynamics tell which forces its accelerations ask for, and
what lacks is the residual. The grains' slopes are by differences, body by body; those of all the rest, stiff actuators among
them, as well, once a step.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import mujoco
import numpy as np

from rft.checks import require
from rft.walking.facets import Facets, Grains, Poses, Surface
from rft.walking.sdirk import ENOUGH, FARTHEST, GAMMA, HALVINGS, LEAST, SOLVED

ITERATIONS = 12  # of Newton's method
WIDER = (30.0, 8.0, 3.0, 1.5, 1.0)  # times the rounding, where Newton's method fails at once
NUDGE = 1e-6  # of a velocity, for differences of MuJoCo's forces


class Multibody:
    """A MuJoCo model on grains, step after step.

    model: compiled; gravity along -z, the surface at z = 0. surfaces: what touches the ground, of `rft.walking.geoms.named`
    or `Surface`; the geoms that they stand for touch grains and nothing else: the model has no contacts of theirs any more,
    with a floor neither. grains: the law. control: a function of (time, of) that gives the actuators' controls (nu,) at a
    time, s, with the rates that hold at the time ``of``, on whose side of a kink it is; None: those of the data as they are.

        craft = Multibody(model, named(model, {"hull": mesh}), Grains(Spatial(xi_n=3e5)))
        while craft.data.time < 10.0:
            craft.step(0.01)

    data: MuJoCo's, whose qpos, qvel and ctrl may be set before a step, and whose qfrc_applied are the grains' generalised
    forces at the end of the last. work: J, of the actuators so far. loss: J, into the ground, dampers and constraints.
    energy(): J, of motion, height and springs; work = loss + change of energy to the order of the steps. wrenches: (B, 6), N
    and N m, of the grains on `Facets.bodies` about their origins at the end of the last step. unsolved: steps so far that
    Newton's method left unsolved, however short; defect: m/s, what these are off by, in all; residual: m/s, the most that any
    step is off by. tries: times that the grains' forces were asked for.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        surfaces: Sequence[Surface],
        grains: Grains,
        control: Callable[[float, float], np.ndarray] | None = None,
    ):
        require(model.nv > 0, "nothing in the model can move: it has no joints")
        require(model.na == 0, "the model has actuators with a state of their own: drop their dyntype")
        mujoco.set_mju_user_warning(_ignored)
        _untouched(model, surfaces)
        model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
        self.model, self.data = model, mujoco.MjData(model)
        self.facets, self.grains, self.control = Facets(surfaces), grains, control
        self.work = self.loss = 0.0
        self.unsolved, self.residual, self.defect, self._off, self.tries = 0, 0.0, 0.0, 0.0, 0
        self.wrenches = np.zeros((len(self.facets.bodies), 6))
        self.jacobians = np.zeros((len(self.facets.bodies), 6, model.nv))
        mujoco.mj_forward(model, self.data)
        self.size = self._sizes()
        self._rest = None

    def _sizes(self) -> np.ndarray:
        """(nv,): what a unit of each velocity moves, m: 1, or a reach where it is a turn."""
        model, data = self.model, self.data
        places = data.xpos[self.facets.bodies]
        reach = float((np.linalg.norm(places - places.mean(0), axis=1) + self.facets.reach).max())
        turns = [int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_BALL)]  # numpy compares no enumerations
        size = np.where(np.isin(model.jnt_type[model.dof_jntid], turns), reach, 1.0)
        for joint in np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_FREE):
            first = model.jnt_dofadr[joint] + 3
            size[first : first + 3] = reach
        return size

    def energy(self) -> float:
        """J, of the data as they stand."""
        mujoco.mj_fwdPosition(self.model, self.data)
        mujoco.mj_energyPos(self.model, self.data)
        mujoco.mj_energyVel(self.model, self.data)
        return float(self.data.energy.sum())

    def numbers(self) -> tuple:
        """All that steps to come follow from."""
        data, sums = self.data, (self.work, self.loss, self.residual, self.defect)
        return data.time, data.qpos.copy(), data.qvel.copy(), *map(float, sums), self.unsolved, self.tries

    def go_on(self, numbers: tuple) -> None:
        """From where `numbers` were."""
        data = self.data
        data.time, data.qpos[:], data.qvel[:], self.work, self.loss, self.residual, self.defect, *counts = numbers
        self.unsolved, self.tries = counts
        mujoco.mj_fwdPosition(self.model, data)

    def step(self, h: float, of: float | None = None, halvings: int = HALVINGS) -> None:
        """On for h, s; the controls' rates those of the time ``of``, by default the middle of the step."""
        data = self.data
        of = data.time + h / 2 if of is None else of
        start = data.time, data.qpos.copy(), data.qvel.copy(), self.work, self.loss
        solved = self._step(*start[:3], h, of)
        if solved and np.isfinite(data.qpos).all():
            self.residual = max(self.residual, self._off)
            return
        if halvings:
            data.time, data.qpos[:], data.qvel[:], self.work, self.loss = start
            self.step(h / 2, of, halvings - 1)
            self.step(h / 2, of, halvings - 1)
            return
        finite = np.isfinite(data.qpos).all() and np.isfinite([self.work, self.loss]).all()
        require(bool(finite), f"the time step at {start[0]:.4g} s cannot be solved: make steps shorter")
        self.unsolved, self.defect = self.unsolved + 1, self.defect + self._off
        self.residual = max(self.residual, self._off)

    def _step(self, t, q, v, h, of) -> bool:
        self._rest, self._off = None, 0.0
        k = GAMMA * h
        first, good, *powers = self._stage(q, v, v, k, t + k, of)
        q_2, v_2 = self._moved(q, first, h - k), v + (h - k) / k * (first - v)
        _, also, *others = self._stage(q_2, v_2, first, k, t + h, of)
        work, loss = (h * ((1 - GAMMA) * a + GAMMA * b) for a, b in zip(powers, others))
        self.work, self.loss = self.work + work, self.loss + loss
        return good and also

    def _moved(self, q, v, time) -> np.ndarray:
        q = q.copy()
        mujoco.mj_integratePos(self.model, q, v, time)
        return q

    def _stage(self, q, v, guess, k, t, of):
        """(velocities V = v + k a(q + k V, V), whether they are found, power of the actuators and of all losses there): at
        once, or by way of wider roundings."""
        data = self.data
        data.time = t
        if self.control:
            data.ctrl[:] = self.control(t, of)
        found, off = self._newton(q, v, guess, k)
        if not off <= SOLVED * self.grains.rounding:
            plain = self.grains
            for wider in WIDER:
                self.grains = self.facets.rounded(plain, wider)
                found, off = self._newton(q, v, found if np.isfinite(found).all() else guess, k)
            self.grains = plain
        self._off, good = max(self._off, off), off <= SOLVED * self.grains.rounding
        motors = float(data.qfrc_actuator @ data.qvel)
        others = data.qfrc_applied + data.qfrc_passive - data.qfrc_spring + data.qfrc_constraint
        return found, good, motors, -float(others @ data.qvel)

    def _newton(self, q, v, guess, k) -> tuple[np.ndarray, float]:
        """(velocities from a guess, m/s that they are off by); the data are those of what is returned."""
        limit, last, here = SOLVED * self.grains.rounding, True, guess
        far = FARTHEST * self.facets.reach.max() / k
        whole = lambda size: far / max(far, size)  # share of a step that goes so far
        residual, slope = self._residual(q, v, here, k)
        step = _solved(slope, -residual)
        size = np.abs(step * self.size).max()
        share = whole(size)
        for _ in range(ITERATIONS):
            if size <= limit or share < LEAST * whole(size) or not np.isfinite(size):
                break
            there = here + share * step
            residual, fresh = self._residual(q, v, there, k)
            ahead = np.abs(_solved(slope, -residual) * self.size).max()
            if ahead <= (1.0 - ENOUGH * share) * size:
                here, slope, last = there, fresh, True
                step = _solved(slope, -residual)
                size = np.abs(step * self.size).max()
                share = whole(size)
            else:
                share, last = share / 2, False
        if not last:
            self._residual(q, v, here, k)
        return here, float(size)

    def _residual(self, q, v, here, k) -> tuple[np.ndarray, np.ndarray]:
        """(force that lacks (nv,), its slopes (nv, nv)) if the velocities at the end of a stage are ``here``."""
        lacking = self._asked(q, v, here, k)
        if self._rest is None or self.data.nefc:
            self._rest = self._slopes(q, v, here, k, lacking)
            lacking = self._asked(q, v, here, k)
        applied, slope = self._loads(k)
        self.tries += 1
        self.data.qfrc_applied[:] = applied
        return lacking - applied, self._rest - slope

    def _asked(self, q, v, here, k) -> np.ndarray:
        """(nv,): the force that the motion of a stage asks for beyond what MuJoCo's model has."""
        data = self.data
        data.qpos[:] = q
        mujoco.mj_integratePos(self.model, data.qpos, here, k)
        data.qvel[:], data.qacc[:] = here, (here - v) / k
        mujoco.mj_inverse(self.model, data)
        mujoco.mj_fwdActuation(self.model, data)
        return data.qfrc_inverse - data.qfrc_actuator

    def _slopes(self, q, v, here, k, asked) -> np.ndarray:
        """(nv, nv) of `_asked`, by differences."""
        slopes = np.empty((len(here), len(here)))
        for j in range(len(here)):
            there = here.copy()
            there[j] += NUDGE / self.size[j]
            slopes[:, j] = (self._asked(q, v, there, k) - asked) * (self.size[j] / NUDGE)
        return slopes

    def _loads(self, k) -> tuple[np.ndarray, np.ndarray]:
        """Generalised forces (nv,) of the grains and their slopes (nv, nv)."""
        model, data, facets, j = self.model, self.data, self.facets, self.jacobians
        for row, body in zip(j, facets.bodies):
            mujoco.mj_jacBody(model, data, row[:3], row[3:], body)
        twist = j @ data.qvel
        rotation = data.xmat[facets.bodies].reshape(-1, 3, 3)
        at = Poses(rotation, data.xpos[facets.bodies], twist[:, :3], twist[:, 3:])
        self.wrenches, slopes = facets.loads(self.grains, at, k)
        return np.einsum("bij,bi->j", j, self.wrenches), (j.swapaxes(1, 2) @ slopes @ j).sum(0)


def _untouched(model: mujoco.MjModel, surfaces: Sequence[Surface]) -> None:
    """Geoms that touch grains touch nothing else."""
    own = np.zeros(model.ngeom, bool)
    for one in surfaces:
        own |= model.geom_bodyid == one.body if one.geom is None else np.arange(model.ngeom) == one.geom
    model.geom_contype[own] = model.geom_conaffinity[own] = 0
    paired = own[model.pair_geom1] | own[model.pair_geom2]
    require(not paired.any(), "a <pair> of <contact> names a geom that touches the ground, and no other thing: drop it")


def _ignored(_warning: str) -> None:
    """MuJoCo writes its warnings to a file in the folder where one is; steps that are not solved are counted and refused."""


def _solved(matrix, right) -> np.ndarray:
    try:
        return np.linalg.solve(matrix, right)
    except np.linalg.LinAlgError:
        return np.full(len(right), np.nan)
