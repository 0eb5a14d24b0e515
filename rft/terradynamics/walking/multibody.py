"""Steps of the bodies of a MuJoCo model in sand.

MuJoCo takes the steps, with the grains' forces of `rft.mujoco`: those of the velocities
that a step ends with. They are of order 1, so a time step of a walk consists of some of
them.
"""

from __future__ import annotations

import copy
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import mujoco
import numpy as np

from rft.balance.backend import Note
from rft.core.refusal import require
from rft.mujoco import installed
from rft.mujoco.bed import Bed
from rft.mujoco.sand import require_passive
from rft.terradynamics.meshes.contact import faces
from rft.terradynamics.meshes.zones import EVERYWHERE
from rft.terradynamics.walking.facets import Facets, Grains, Surface

SUBSTEPS = 16  # steps of MuJoCo in a time step
NO_ROW = -1  # of the table of beds, where the bed is not under its model
IMPLICIT_FAST = int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST)
ENERGY = int(mujoco.mjtEnableBit.mjENBL_ENERGY)
NO_RESET = int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
STATE = mujoco.mjtState.mjSTATE_INTEGRATION
ROTATING = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_BALL)


class Multibody:
    """A MuJoCo model in sand, time step after time step.

    model: compiled; gravity along -z, the surface at z = 0; it stays as it is.
    surfaces: those that touch the ground, from
    `rft.terradynamics.walking.geoms.surfaces` or `Surface`. Their geoms touch grains
    and nothing else, no floor either. grains: the ground. control: function
    (time, rate_time) -> controls (nu,) of the actuators at a time, s, by the rates of a
    clock at ``rate_time``, which tells the side of a kink; None for the controls in the
    data. substeps: steps of MuJoCo, by its integrator implicitfast, in a time step.

        craft = Multibody(model, surfaces(model, {"hull": mesh}), Grains(Spatial(xi_n=3e5)))
        while craft.data.time < 10.0:
            craft.step(0.01)

    Attributes
    ----------
    model, data : MjModel, MjData
        A copy of the model, and its data; qpos, qvel and ctrl may be set before a step.
        Places and velocities of the bodies in the data are up to date after a step.
    work, loss : float
        Work of the actuators, and loss into the ground, dampers and constraints, J;
        work = loss + change of `energy`, to the order of the steps.
    unsolved : int
        Number of MuJoCo's steps that were taken unsolved.
    defect, residual : float
        Velocity, m/s, that the unsolved steps lack at most, in all, and that any step
        lacks at most.
    iterations : int
        Of Newton's method for the grains' forces, in all.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        surfaces: Sequence[Surface],
        grains: Grains,
        control: Callable[[float, float], np.ndarray] | None = None,
        substeps: int = SUBSTEPS,
    ):
        require(
            model.nv > 0, "nothing in the model can move", because="it has no joints"
        )
        require(
            model.na == 0,
            "the model has actuators with a state of their own",
            instead="drop their dyntype",
        )
        require_passive(model)
        mujoco.set_mju_user_warning(_ignore)
        model = copy.copy(model)
        _remove_contacts(model, surfaces)
        model.opt.enableflags |= ENERGY
        model.opt.disableflags |= NO_RESET
        model.opt.integrator = IMPLICIT_FAST
        self.model, self.data, self.facets = (
            model,
            mujoco.MjData(model),
            Facets(surfaces),
        )
        self.control, self.substeps = control, substeps
        self.work = self.loss = self.defect = self.residual = 0.0
        self.unsolved = self.iterations = 0
        self._bed, self._row = bed_under(model, surfaces, grains), NO_ROW
        structure = model if hasattr(model, "D_rownnz") else self.data
        self._slope_rows = np.repeat(np.arange(model.nv), structure.D_rownnz)
        self._slope_columns = np.array(structure.D_colind)
        self.update()
        self.size = self._sizes()

    def _sizes(self) -> np.ndarray:
        """Return the speed, m/s, per unit of each velocity (nv,): 1, or a reach, m, for
        rotations."""
        model, data = self.model, self.data
        places = data.xpos[self.facets.bodies]
        reach = float(
            (np.linalg.norm(places - places.mean(0), axis=1) + self.facets.reach).max()
        )
        size = np.where(np.isin(model.jnt_type[model.dof_jntid], ROTATING), reach, 1.0)
        for joint in np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_FREE):
            first = model.jnt_dofadr[joint] + 3
            size[first : first + 3] = reach
        return size

    def update(self) -> None:
        """Compute places, velocities and energies of the bodies from positions and
        velocities in the data."""
        # mj_forward would compute the grains' forces, which takes as long as a step.
        mujoco.mj_fwdPosition(self.model, self.data)
        mujoco.mj_comVel(self.model, self.data)
        mujoco.mj_energyPos(self.model, self.data)
        mujoco.mj_energyVel(self.model, self.data)

    def energy(self) -> float:
        """Return the kinetic and potential energy of the data, J, with that of
        springs."""
        self.update()
        return float(self.data.energy.sum())

    def state(self) -> tuple:
        """Return the numbers that all further steps depend on."""
        numbers = np.zeros(mujoco.mj_stateSize(self.model, STATE))
        mujoco.mj_getState(self.model, self.data, numbers, STATE)
        sums = map(float, (self.work, self.loss, self.residual, self.defect))
        return (numbers, *sums, self.unsolved, self.iterations)

    def restore(self, state: tuple) -> None:
        """Set the body to a `state`."""
        numbers, self.work, self.loss, self.residual, self.defect, *counts = state
        self.unsolved, self.iterations = counts
        mujoco.mj_setState(self.model, self.data, numbers, STATE)
        self.update()

    @contextmanager
    def in_sand(self) -> Iterator[None]:
        """Put the sand under the model for some steps, of which each does so by itself otherwise, in a millisecond."""
        if self._row != NO_ROW:
            yield
            return
        self._row = installed.install(self.model, self._bed)
        try:
            yield
        finally:
            # At once: MuJoCo has one passive callback, which others may need next.
            installed.remove(self._row)
            self._row = NO_ROW

    def step(self, h: float, rate_time: float | None = None) -> None:
        """Take a time step h, s, with the controls' rates at ``rate_time``, s, by default the middle of the step."""
        with self.in_sand():
            self._step(h, rate_time)

    def _step(self, h: float, rate_time: float | None) -> None:
        """Take a time step in the sand."""
        model, data = self.model, self.data
        begin, before = data.time, installed.effort(self._row)
        rate_time = begin + h / 2 if rate_time is None else rate_time
        model.opt.timestep = dt = h / self.substeps
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Note)  # unsolved steps are counted
            for k in range(self.substeps):
                data.time = begin + k * dt
                if self.control:
                    data.ctrl[:] = self.control(data.time, rate_time)
                velocity = data.qvel.copy()
                mujoco.mj_step(model, data)
                self._add_work(velocity, dt)
        data.time = begin + h
        sums = [*data.qpos, *data.qvel, self.work, self.loss]
        require(
            bool(np.isfinite(sums).all()) and installed.is_installed(self._row),
            f"the time step at {begin:.4g} s cannot be solved",
            instead="make steps shorter",
        )
        self.update()
        self._count(before, dt)

    def _add_work(self, before: np.ndarray, dt: float) -> None:
        """Add what forces have done in a step of MuJoCo, dt, from velocities ``before``
        (nv,).

        The step moves bodies by its last velocities, at which forces of motors and
        dampers act, too."""
        model, data = self.model, self.data
        velocity, change = data.qvel, data.qvel - before
        by_change = data.qDeriv * change[self._slope_columns]
        implicit = np.bincount(self._slope_rows, by_change, model.nv)
        damping = model.dof_damping * change
        motors = data.qfrc_actuator + implicit + damping
        losses = data.qfrc_passive - data.qfrc_spring - damping + data.qfrc_constraint
        self.work += dt * float(velocity @ motors)
        self.loss -= dt * float(velocity @ losses)

    def _count(self, before: installed.Effort, dt: float) -> None:
        """Add what the steps of a time step have cost and lack, from the effort before
        them."""
        now = installed.effort(self._row)
        mass = float(self.model.body_mass.sum())
        fall = dt * float(np.linalg.norm(self.model.opt.gravity))
        speed = (2 * float(self.data.energy[1]) / max(mass, 1e-300)) ** 0.5 + fall
        unsolved = now.unsolved - before.unsolved
        self.iterations += now.iterations - before.iterations
        self.unsolved += unsolved
        self.defect += unsolved * now.residual * speed
        if now.residual > before.residual:
            self.residual = max(self.residual, now.residual * speed)


def bed_under(
    model: mujoco.MjModel, surfaces: Sequence[Surface], grains: Grains
) -> Bed:
    """Return the sand under surfaces of a model, each in the place of its geom, or of
    its body's first one."""
    own: dict[int, list[Surface]] = {}
    for surface in surfaces:
        first = model.body_geomadr[surface.body]
        geom = int(first if surface.geom is None else surface.geom)
        require(geom >= 0, f"the body {surface.body} of a surface has no geom")
        own.setdefault(geom, []).append(surface)
    along = [_faces_of_geom(model, geom, parts) for geom, parts in own.items()]
    return Bed.from_faces(
        model, [*own], along, (grains.law,), EVERYWHERE, grains.ground
    )


def _faces_of_geom(model: mujoco.MjModel, geom: int, surfaces: Sequence[Surface]):
    """Return the faces of surfaces in the frame of a geom."""
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
    turn = turn.reshape(3, 3)
    corners = np.concatenate([s.corners for s in surfaces]) - model.geom_pos[geom]
    normals = np.concatenate([s.normals for s in surfaces])
    sheet = np.concatenate([np.full(len(s.corners), s.sheet) for s in surfaces])
    return faces(corners @ turn, normals @ turn, sheet)


def _remove_contacts(model: mujoco.MjModel, surfaces: Sequence[Surface]) -> None:
    """Remove all contacts of the surfaces' geoms from a model; ValueError where a
    <pair> names one."""
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
    """Ignore a warning, which MuJoCo would write to a file in the present folder;
    unsolved steps are counted."""
