"""Steps of the bodies of a MuJoCo model in sand.

MuJoCo takes the steps, with the grains' forces of `rft.mujoco` at the velocities that a
step ends with. Its steps are of order 1, so a time step of a walk consists of several.
"""

from __future__ import annotations

import copy
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import mujoco
import numpy as np

from rft.core.notes import Note
from rft.core.refusal import require
from rft.laws.incline import gravity_on_incline
from rft.mujoco import installed
from rft.mujoco.bed import Bed
from rft.mujoco.sand import require_passive
from rft.terradynamics.meshes.forces.contact import faces
from rft.terradynamics.meshes.forces.zones import EVERYWHERE
from rft.terradynamics.walking.prints import Limb, Memory, PrintedGround, meet
from rft.terradynamics.walking.spatial.facets import Facets, Grains, Surface

SUBSTEPS = 16  # steps of MuJoCo in a time step
NO_ROW = -1  # of the table of beds, where the bed is not under its model
IMPLICIT_FAST = int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST)
ENERGY = int(mujoco.mjtEnableBit.mjENBL_ENERGY)
NO_RESET = int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
STATE = mujoco.mjtState.mjSTATE_INTEGRATION
ROTATING = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_BALL)


class Multibody:
    """A MuJoCo model in sand, time step after time step.

        grains = Grains(Spatial(xi_n=3e5))
        craft = Multibody(model, surfaces(model, {"hull": mesh}), grains)
        while craft.data.time < 10.0:
            craft.step(0.01)

    Parameters
    ----------
    model : MjModel
        Compiled; gravity along -z, the surface at z = 0. It stays as it is.
    surfaces : sequence of Surface
        Those that touch the ground, for example from
        `rft.terradynamics.walking.spatial.geoms.surfaces`. Their geoms touch grains and
        nothing else, no floor either.
    grains : Grains
        The ground.
    control : callable, optional
        Returns the controls (nu,) of the actuators for (time, rate_time): at a time, s,
        by the rates of a clock at ``rate_time``, which determines the side of a kink.
        By default the controls are those in the data.
    substeps : int
        Steps of MuJoCo, by its integrator implicitfast, in a time step.
    slope : float
        Angle by which the surface rises along x, rad: gravity is turned by it about y.
    prints : PrintedGround, optional
        How the ground remembers limbs, all bodies of the surfaces but roots; by
        default not at all.

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
    memory : Memory, optional
        What the ground remembers.
    size : array (nv,)
        Speed, m/s, per unit of each velocity: 1, or a reach, m, for rotations.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        surfaces: Sequence[Surface],
        grains: Grains,
        control: Callable[[float, float], np.ndarray] | None = None,
        substeps: int = SUBSTEPS,
        slope: float = 0.0,
        prints: PrintedGround | None = None,
    ):
        require(
            model.nv > 0, "nothing in the model can move", because="it has no joints"
        )
        require(
            model.na == 0,
            "the model has actuators with a state of their own",
            instead="remove their dyntype",
        )
        require_passive(model)
        mujoco.set_mju_user_warning(_ignore)
        model = copy.copy(model)
        _remove_contacts(model, surfaces)
        if slope:
            g_x, g_z = gravity_on_incline(slope, float(-model.opt.gravity[2]))
            model.opt.gravity[:] = g_x, 0.0, g_z
        model.opt.enableflags |= ENERGY
        model.opt.disableflags |= NO_RESET
        model.opt.integrator = IMPLICIT_FAST
        self.model = model
        self.data = mujoco.MjData(model)
        self.facets = Facets(surfaces)
        self.control = control
        self.substeps = substeps
        self.work = self.loss = self.defect = self.residual = 0.0
        self.unsolved = self.iterations = 0
        self._bed = bed_under(model, surfaces, grains)
        self._row = NO_ROW
        self._prints = prints
        self.memory: Memory | None = None
        if prints:
            self._limbs = _limbs(model, self.facets)
            self.memory = Memory.undisturbed(len(self._limbs))

        # The structure of `qDeriv`, which older versions of MuJoCo keep in the data.
        structure = model if hasattr(model, "D_rownnz") else self.data
        self._slope_rows = np.repeat(np.arange(model.nv), structure.D_rownnz)
        self._slope_columns = np.array(structure.D_colind)
        self.update()
        self.size = self._sizes()

    def _sizes(self) -> np.ndarray:
        """Return the speed, m/s, per unit of each velocity (nv,): 1, or a reach, m, for
        rotations."""
        model = self.model
        data = self.data
        places = data.xpos[self.facets.bodies]
        distance = np.linalg.norm(places - places.mean(0), axis=1)
        reach = float((distance + self.facets.reach).max())
        is_rotation = np.isin(model.jnt_type[model.dof_jntid], ROTATING)
        size = np.where(is_rotation, reach, 1.0)
        # The last three velocities of a free joint are rotations.
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
        counts = (self.unsolved, self.iterations)
        memory = () if self.memory is None else (self.memory,)
        return (numbers, *sums, *counts, *memory)

    def restore(self, state: tuple) -> None:
        """Set the body to a `state`."""
        numbers, self.work, self.loss, self.residual, self.defect, *rest = state
        self.unsolved, self.iterations, *memory = rest
        if memory:
            self.memory = Memory(*memory[0])
        mujoco.mj_setState(self.model, self.data, numbers, STATE)
        self.update()

    @contextmanager
    def in_sand(self) -> Iterator[None]:
        """Put the sand under the model for several steps.

        Otherwise each step does so by itself, which takes a millisecond."""
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
        """Take a time step h, s, with the controls' rates at ``rate_time``, s, by
        default the middle of the step."""
        with self.in_sand():
            self._step(h, rate_time)

    def _step(self, h: float, rate_time: float | None) -> None:
        """Take a time step in the sand."""
        if self._prints:
            self._meet_prints()
        model = self.model
        data = self.data
        begin = data.time
        before = installed.effort(self._row)
        if rate_time is None:
            rate_time = begin + h / 2
        dt = h / self.substeps
        model.opt.timestep = dt
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
            bool(np.isfinite(sums).all())
            and installed.is_installed(self._row, self._bed),
            f"the time step at {begin:.4g} s cannot be solved",
            instead="use shorter steps",
        )
        self.update()
        self._count(before, dt)

    def _meet_prints(self) -> None:
        """Let limbs meet the prints where they are, and remember these places."""
        assert self._prints is not None
        assert self.memory is not None
        places = self.data.xpos
        turns = self.data.xmat.reshape(-1, 3, 3)
        limbs = []
        for body, middles, areas in self._limbs:
            world = middles @ turns[body].T + places[body]
            limbs.append(Limb(world[:, :2], -world[:, 2], areas))
        shares, self.memory = meet(self._prints, self.memory, limbs)
        of_bodies = {limb[0]: share for limb, share in zip(self._limbs, shares)}
        self._bed.blocks.set_shares(
            np.array([of_bodies.get(int(b), 1.0) for b in self._bed.geoms.bodies])
        )

    def _add_work(self, before: np.ndarray, dt: float) -> None:
        """Add what forces have done in a step of MuJoCo, dt, from velocities ``before``
        (nv,).

        The step moves bodies by its last velocities, at which forces of motors and
        dampers act as well."""
        model = self.model
        data = self.data
        velocity = data.qvel
        change = data.qvel - before
        by_change = data.qDeriv * change[self._slope_columns]
        implicit = np.bincount(self._slope_rows, by_change, model.nv)
        damping = model.dof_damping * change
        motors = data.qfrc_actuator + implicit + damping
        losses = data.qfrc_passive - data.qfrc_spring - damping + data.qfrc_constraint
        self.work += dt * float(velocity @ motors)
        self.loss -= dt * float(velocity @ losses)

    def _count(self, before: installed.Effort, dt: float) -> None:
        """Add the iterations and the defects of the steps of a time step, from the
        effort before them."""
        now = installed.effort(self._row)
        # Residuals are relative to the speed of the bodies and of a fall for a step.
        mass = float(self.model.body_mass.sum())
        fall = dt * float(np.linalg.norm(self.model.opt.gravity))
        kinetic = float(self.data.energy[1])
        speed = (2 * kinetic / max(mass, 1e-300)) ** 0.5 + fall
        unsolved = now.unsolved - before.unsolved
        self.iterations += now.iterations - before.iterations
        self.unsolved += unsolved
        self.defect += unsolved * now.residual * speed
        if now.residual > before.residual:
            self.residual = max(self.residual, now.residual * speed)


def _limbs(
    model: mujoco.MjModel, facets: Facets
) -> list[tuple[int, np.ndarray, np.ndarray]]:
    """Return the bodies but roots of all surfaces, with the middles (n, 3), m, of their
    triangles in their frames, and the areas (n,), m^2."""
    found = []
    for k, body in enumerate(facets.bodies):
        if model.body_rootid[body] == body:
            continue
        corners = facets.corners[facets.owner == k]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        areas = np.linalg.norm(normals, axis=1) / 2
        found.append((int(body), corners.mean(1), areas))
    return found


def bed_under(
    model: mujoco.MjModel, surfaces: Sequence[Surface], grains: Grains
) -> Bed:
    """Return the sand under surfaces of a model, each in the place of its geom, or of
    its body's first one."""
    surfaces_of_geoms: dict[int, list[Surface]] = {}
    for surface in surfaces:
        geom = surface.geom
        if geom is None:
            geom = int(model.body_geomadr[surface.body])
        require(geom >= 0, f"the body {surface.body} of a surface has no geom")
        surfaces_of_geoms.setdefault(int(geom), []).append(surface)
    geom_faces = [
        _faces_of_geom(model, geom, own) for geom, own in surfaces_of_geoms.items()
    ]
    return Bed.from_faces(
        model,
        [*surfaces_of_geoms],
        geom_faces,
        (grains.law,),
        EVERYWHERE,
        grains.ground,
    )


def _faces_of_geom(model: mujoco.MjModel, geom: int, surfaces: Sequence[Surface]):
    """Return the faces of surfaces in the frame of a geom."""
    rotation = np.zeros(9)
    mujoco.mju_quat2Mat(rotation, model.geom_quat[geom])
    rotation = rotation.reshape(3, 3)
    corners = np.concatenate([s.corners for s in surfaces]) - model.geom_pos[geom]
    normals = np.concatenate([s.normals for s in surfaces])
    sheet = np.concatenate([np.full(len(s.corners), s.sheet) for s in surfaces])
    return faces(corners @ rotation, normals @ rotation, sheet)


def _remove_contacts(model: mujoco.MjModel, surfaces: Sequence[Surface]) -> None:
    """Remove all contacts of the surfaces' geoms from a model; ValueError where a
    <pair> names one."""
    in_sand = np.zeros(model.ngeom, bool)
    for surface in surfaces:
        if surface.geom is None:
            in_sand |= model.geom_bodyid == surface.body
        else:
            in_sand[surface.geom] = True
    model.geom_contype[in_sand] = 0
    model.geom_conaffinity[in_sand] = 0
    is_paired = in_sand[model.pair_geom1] | in_sand[model.pair_geom2]
    require(
        not is_paired.any(),
        "a <pair> of <contact> names a geom that touches only the ground",
        instead="remove it",
    )


def _ignore(_warning: str) -> None:
    """Ignore a warning, which MuJoCo would write to a file in the present folder;
    unsolved steps are counted."""
