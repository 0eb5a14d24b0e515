"""The engine of three dimensions: robots as MuJoCo models in sand, one after another.

MuJoCo's steps are of order 1, and its triangles lead as a whole or not at all. So it
takes `SUBSTEPS` steps for each time step, and cuts an element of a leg or belly into
`PIECES`, which makes both errors as small as those of the planar engine.

A robot of the vertical plane becomes a hull on legs at both sides that is free to roll,
yaw and drift (`rft.terradynamics.walking.spatial.hexapod`); a custom MJCF is used as it
is. A walk ends with the stride that repeats the last one. `Simulation` computes strides
by `rft.terradynamics.walking.spatial.multibody`.
"""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from rft.motion import limit_cycle
from rft.terradynamics.meshes.forces.extruded import Extruded
from rft.terradynamics.meshes.forces.law import Spatial
from rft.terradynamics.walking.craft import Screws
from rft.terradynamics.walking.engines import (
    Fineness,
    Variation,
    Walker,
    with_more_elements,
)
from rft.terradynamics.walking.feet import Feet, at_both_ends, feet_of
from rft.terradynamics.walking.planar.stride import (
    AVERAGED_CYCLES,
    MOST_STRIDES,
    REMAINING_CHANGE,
    STRIDES_NEAR_LIMIT,
    STUCK,
    Walk,
    compute_stride,
    cycles_to_settle,
)
from rft.terradynamics.walking.robot import intervals, walking_rounding
from rft.terradynamics.walking.spatial.facets import Facets, Grains
from rft.terradynamics.walking.spatial.machine import (
    FREE,
    HINGE,
    JOINT,
    SLIDE,
    Clock,
    build_machine,
    set_servo_damping,
)
from rft.terradynamics.walking.spatial.mjcf import Mjcf
from rft.terradynamics.walking.spatial.multibody import SUBSTEPS, Multibody

ORDER = 1  # of the time steps
PIECES = 4  # of an element of a leg or belly
MOST_STEPS = 10_000  # of a cycle
# Largest difference of the starts of strides that repeat, over the speed of the legs'
# ends.
REPEATED = 1e-2
# Largest turn until the end of a walk whose strides are repeated along a line, rad.
STRAIGHT = 0.05
# Numbers of a row, and their places.
ROW = (
    "t",
    "x",
    "z",
    "pitch",
    "v_x",
    "v_z",
    "rate",
    "work",
    "loss",
    "energy",
    "y",
    "roll",
    "yaw",
)
T, X, Y, YAW = (ROW.index(name) for name in ("t", "x", "y", "yaw"))
# Columns that grow from stride to stride: t, x, work, loss and y of rows, x and y of
# positions.
GROWING_OF_ROWS = [0, 1, 7, 8, 10]
GROWING_OF_POSITIONS = [0, 1]


def refuse(walker: Walker) -> None:
    """Raise ValueError for a walker that this engine cannot compute."""
    _spatial_law(walker)


def _spatial_law(walker: Walker) -> Spatial | Extruded:
    """Return the law of three dimensions for a walker's ground."""
    if isinstance(walker.stress, Spatial):
        return walker.stress
    return Extruded(walker.stress)


def variations(numerics: Fineness) -> list[Variation]:
    """Return twice and one and a half times the steps, as one change alone may be small
    by chance, and twice the elements.

    An error of order 1 is twice and three times these changes."""
    twice = min(MOST_STEPS, 2 * numerics.steps)
    three_halves = min(MOST_STEPS, 3 * numerics.steps // 2)
    return [
        Variation(dataclasses.replace(numerics, steps=twice), "steps", 2.0, 2.0),
        Variation(dataclasses.replace(numerics, steps=three_halves), "steps", 3.0, 1.5),
        with_more_elements(numerics, 1.25),
    ]


def walk(
    walkers: Sequence[Walker],
    numerics: Fineness,
    cycles: int | None = None,
    progress: Callable | None = None,
    advance: Callable = compute_stride,
) -> list[Walk]:
    """Return the walks of walkers; see
    `rft.terradynamics.walking.engines.Engine.walk`."""
    walks: list[Walk] = []
    for walker in walkers:
        duration = numerics.duration
        if cycles:
            duration = cycles / walker.gait.frequency
        most = math.ceil(duration * walker.gait.frequency - 1e-9)
        if not walker.prints:
            most += MOST_STRIDES

        def report(fraction):
            if progress:
                progress((len(walks) + fraction) / len(walkers))

        simulation = Simulation(walker, numerics, advance=advance)
        walks.append(simulation.walk(most, duration, progress=report))
    return walks


def rerun(
    walkers: Sequence[Walker],
    numerics: Fineness,
    walks: Sequence[Walk],
    cycles: int | None = None,
    advance: Callable = compute_stride,
) -> list[Walk]:
    """Return walks with other numerics, by a few strides from the last state of each;
    see `rft.terradynamics.walking.engines.Engine.rerun`."""
    # All but the fields of the limit cycle.
    series = Walk._fields[:6]
    others = []
    for walker, old in zip(walkers, walks):
        if old.limit is None:
            others += walk([walker], numerics, cycles, advance=advance)
            continue
        simulation = Simulation(walker, numerics, advance=advance)
        other = simulation.walk(STRIDES_NEAR_LIMIT, start=old.limit)
        others.append(other._replace(**{name: getattr(old, name) for name in series}))
    return others


def step_cost(
    walkers: Sequence[Walker], numerics: Fineness, seconds: float
) -> tuple[float, float]:
    """Return the cost of a time step; see
    `rft.terradynamics.walking.engines.Engine.step_cost`."""
    (walker,) = walkers
    body = Simulation(walker, numerics).body
    h = 1 / (walker.gait.frequency * numerics.steps)
    with body.in_sand():
        begin = time.process_time()
        elapsed = 0.0
        steps = 0
        while steps < numerics.steps and elapsed < seconds:
            body.step(h)
            elapsed = time.process_time() - begin
            steps += 1
    return elapsed / steps, body.iterations / (steps * body.substeps)


class Start(NamedTuple):
    """The state of a model at the start of a stride, with the clock at 0."""

    qpos: np.ndarray
    qvel: np.ndarray


class Simulation:
    """A walker in MuJoCo, stride after stride.

    planar: whether a robot of the vertical plane stays in it. advance: computes a
    stride, as `compute_stride`.

    Attributes
    ----------
    machine, clock, body
        The model and its surfaces, the controls of its actuators, and its steps in
        sand.
    intervals : list
        Parts of a stride between kinks of the clock, as of
        `rft.terradynamics.walking.robot.intervals`.
    reach : float
        Of the legs, m.
    ceiling : float
        Height of the root above which the robot is airborne, m.
    hull : array
        Numbers of the triangles of the root.
    """

    def __init__(
        self,
        walker: Walker,
        numerics: Fineness,
        planar: bool = False,
        advance: Callable = compute_stride,
    ):
        self.arguments = (walker, numerics, planar)
        self.advance = advance
        law = _spatial_law(walker)
        self.machine = build_machine(walker.robot, numerics.elements, planar, PIECES)
        self.gait = walker.gait
        self.is_level = walker.rise == 0.0
        # Legs and screws of hardly any mass turn as the clock does, also where its rate
        # jumps.
        self.is_prescribed = not isinstance(walker.robot, Mjcf)
        if self.is_prescribed:
            set_servo_damping(self.machine, walker.gait.frequency)
        self.clock = Clock(self.machine, walker.gait)

        root = self.machine.root
        facets = Facets(self.machine.surfaces)
        is_leg = facets.bodies != root
        legs = is_leg if is_leg.any() else slice(None)
        self.reach = float(facets.reach[legs].max())
        self.hull = np.flatnonzero(np.isin(facets.owner, np.flatnonzero(~is_leg)))

        rounding = numerics.rounding
        if len(self.machine.driven):
            rounding = walking_rounding(rounding, walker.gait.frequency, self.reach)
        ground = walker.ground
        self.body = Multibody(
            self.machine.model,
            self.machine.surfaces,
            Grains(
                law,
                ground.strength,
                ground.flux,
                float(rounding),
                ground.downhill_loss,
            ),
            self.clock,
            _substeps(walker, self.machine.model),
            walker.rise,
            walker.prints,
        )
        self.clock.set_start(self.body)
        self.intervals = intervals(self.clock.kinks(), numerics.steps)
        data = self.body.data
        distance = np.linalg.norm(data.xpos[facets.bodies] - data.xpos[root], axis=1)
        self.ceiling = float((distance + facets.reach).max() + facets.reach.max())

    def __reduce__(self) -> tuple:
        # A process that computes strides builds its own model.
        return Simulation, self.arguments

    def walk(
        self,
        most: int,
        duration: float | None = None,
        start: Start | None = None,
        progress: Callable | None = None,
    ) -> Walk:
        """Return a walk of at most ``most`` strides.

        duration: s, of the walk; after a stride that repeats the last one, the rest
        consists of its repetitions. start: by default, the robot at rest. progress:
        receives the finished fraction."""
        body = self.body
        if start is not None:
            body.data.qpos[:] = start.qpos
            body.data.qvel[:] = start.qvel
            body.update()
        record = _Record(self)
        for stride in range(most):
            end = record.add_stride(stride)
            if progress:
                progress((stride + 1) / most)
            if end:
                break
            if record.is_periodic and record.goes_straight(duration):
                break

        # Strides on ground that remembers do not follow from their starts alone.
        remembers = body.memory is not None
        limit = None
        if not record.status and not remembers:
            limit = Start(self.unwound(stride + 1), body.data.qvel.copy())
        means, drift, status = self.means(
            np.array(record.rows),
            np.array(record.moves).reshape(-1, 3),
            record.is_periodic,
            record.drift,
            record.status,
        )
        speed, lateral_speed, yaw_rate = means
        settling_time = np.nan
        from_rest = start is None
        if record.is_periodic and from_rest and status == "walking":
            settling_time = record.settling_time()
        late_rows, late_positions = record.late()
        feet = self.feet(late_rows, late_positions)
        if record.status:
            late_rows = np.array(record.rows)
        along = self.speed_along(late_rows)
        turned = float(np.diff(np.unwrap(np.array(record.rows)[:, YAW])[[0, -1]])[0])
        rows, positions = record.until(duration)
        columns = dict(zip(ROW, rows.T))
        return Walk(
            columns["t"],
            np.stack([columns[name] for name in ("x", "z", "pitch")], -1),
            np.stack([columns[name] for name in ("v_x", "v_z", "rate")], -1),
            columns["work"],
            columns["loss"],
            columns["energy"],
            speed,
            status,
            cycles=float(len(record.moves)),
            periodic=record.is_periodic,
            drift=drift,
            limit=limit,
            unsolved=body.unsolved,
            residual=body.residual,
            unsolved_error=record.unsolved_error(),
            spatial={
                "y": columns["y"],
                "roll": columns["roll"],
                "yaw": columns["yaw"],
                "states": positions,
            },
            settling_time=settling_time,
            lateral_speed=lateral_speed,
            yaw_rate=yaw_rate,
            speed_along=along,
            turned=turned,
            foot_speed=feet.speed,
            sinkage=feet.sinkage,
            reach=self.reach,
            **record.of_prints(),
        )

    def means(
        self, rows, moves, is_periodic: bool, drift: float, end: str
    ) -> tuple[list[float], float, str]:
        """Return speed, lateral speed and yaw rate of a walk, the drift of the speed,
        and the status.

        moves: (N, 3), of its strides, as of `_move`. drift: m, of the progress of a
        periodic stride. end: as of `end_status`; the means are over the whole walk of a
        robot at an end, else over its last strides."""
        if end:
            forwards, to_left, _ = _move(rows[0], rows[-1])
            turn = np.diff(np.unwrap(rows[:, YAW])[[0, -1]])[0]
            duration = rows[-1, T] or np.inf
            return (np.array([forwards, to_left, turn]) / duration).tolist(), 0.0, end

        late = moves[-1:]
        if not is_periodic:
            late = moves[-AVERAGED_CYCLES:]
            progress = late[:, 0]
            # A single stride may still change by all of its progress.
            drift = np.ptp(progress) if len(late) > 1 else abs(progress[0])
        is_stuck = abs(late[:, 0].mean()) < STUCK * self.reach
        status = "stuck" if is_stuck else "walking"
        f = self.gait.frequency
        return (late.mean(0) * f).tolist(), float(drift * f), status

    def speed_along(self, rows: np.ndarray) -> float:
        """Return the mean velocity along x over rows, m/s."""
        duration = rows[-1, T] - rows[0, T]
        if not duration > 0.0:
            return 0.0
        return float((rows[-1, X] - rows[0, X]) / duration)

    def feet(self, rows: np.ndarray, positions: np.ndarray) -> Feet:
        """Return the feet over rows and positions of steps; of a robot without legs the
        speed is nan."""
        data = mujoco.MjData(self.body.model)
        facets = self.body.facets
        legs = facets.bodies != self.machine.root
        is_leg = legs[facets.owner]
        if not legs.any():
            is_leg[:] = True
        corners = facets.corners[is_leg].reshape(-1, 3)
        bodies = np.repeat(facets.bodies[facets.owner[is_leg]], 3)
        ahead = []
        height = []
        for row, qpos in zip(rows, positions):
            data.qpos[:] = qpos
            mujoco.mj_kinematics(self.body.model, data)
            turn = data.xmat.reshape(-1, 3, 3)[bodies]
            place = np.einsum("pij,pj->pi", turn, corners) + data.xpos[bodies]
            away = place - data.xpos[self.machine.root]
            ahead.append(away[:, 0] * np.cos(row[YAW]) + away[:, 1] * np.sin(row[YAW]))
            height.append(place[:, 2])
        feet = feet_of(
            at_both_ends(np.array(ahead)),
            at_both_ends(np.array(height)),
            float(rows[-1, T] - rows[0, T]),
        )
        # The points of a screw move to the side.
        if not legs.any() or isinstance(self.arguments[0].robot, Screws):
            return feet._replace(speed=np.nan)
        return feet

    def stride(self, stride: int, rows: list, positions: list) -> str:
        """Compute a stride, append its rows and positions, and return `end_status`
        after it."""
        new_rows, new_positions, state = self.advance(
            self.steps, stride, self.body.state()
        )
        self.body.restore(state)
        rows += new_rows.tolist()
        positions += list(new_positions)
        return self.end_status()

    def steps(self, stride: int, state: tuple) -> tuple[np.ndarray, np.ndarray, tuple]:
        """Return rows and positions after each step of a stride, or until the robot's
        end, and the body's state then.

        state: that of the body now, on which the result depends."""
        rows: list[list[float]] = []
        positions: list[np.ndarray] = []
        with self.body.in_sand():
            self._take_steps(stride, rows, positions)
        return np.array(rows), np.array(positions), self.body.state()

    def _take_steps(self, stride: int, rows: list, positions: list) -> None:
        """Take the steps of a stride until the robot's end, and append its rows and
        positions."""
        f = self.gait.frequency
        data = self.body.data
        for begin, end, steps in self.intervals:
            rate_time = (stride + (begin + end) / 2) / f
            if self.is_prescribed:
                self.clock.set_rates(self.body, rate_time)
            for k in range(steps):
                data.time = (stride + begin + (end - begin) * k / steps) / f
                self.body.step((end - begin) / steps / f, rate_time)
                rows.append(self.row())
                positions.append(data.qpos.copy())
                if self.end_status():
                    return

    def row(self) -> list[float]:
        """Return the numbers named in `ROW`, along the world's axes; the rate is about
        the horizontal axis to the left."""
        body = self.body
        root = self.machine.root
        x, y, z = body.data.xpos[root]
        rotation = body.data.xmat[root].reshape(3, 3)
        yaw = np.arctan2(rotation[1, 0], rotation[0, 0])
        pitch = np.arctan2(-rotation[2, 0], np.hypot(rotation[0, 0], rotation[1, 0]))
        roll = np.arctan2(rotation[2, 1], rotation[2, 2])

        # Rates about the world's axes, then velocities along them.
        motion = np.zeros(6)
        mujoco.mj_objectVelocity(
            body.model, body.data, mujoco.mjtObj.mjOBJ_XBODY, root, motion, 0
        )
        rate = motion[1] * np.cos(yaw) - motion[0] * np.sin(yaw)
        values = {
            "t": body.data.time,
            "x": x,
            "z": z,
            "pitch": pitch,
            "v_x": motion[3],
            "v_z": motion[5],
            "rate": rate,
            "work": body.work,
            "loss": body.loss,
            "energy": body.energy(),
            "y": y,
            "roll": roll,
            "yaw": yaw,
        }
        return [values[name] for name in ROW]

    def end_status(self) -> str:
        """Return "flipped", "airborne" or "sunk" for a robot at an end, else ""."""
        data = self.body.data
        root = self.machine.root
        height = data.xpos[root, 2]
        rotation = data.xmat[root].reshape(3, 3)
        if rotation[2, 2] < 0.0:
            return "flipped"
        if height > self.ceiling:
            return "airborne"
        corners = self.body.facets.corners[self.hull]
        top = (corners @ rotation[2] + height).max(initial=height)
        return "sunk" if top < 0.0 else ""

    def scaled_state(self) -> np.ndarray:
        """Return the numbers at the start of a stride that determine all further
        motion: heights over the reach, angles, and velocities over the speed of the
        legs' ends, along and across the heading."""
        model = self.body.model
        data = self.body.data
        rotation = data.xmat[self.machine.root].reshape(3, 3)
        yaw = np.arctan2(rotation[1, 0], rotation[0, 0])
        cos = np.cos(yaw)
        sin = np.sin(yaw)
        leg_speed = 2 * np.pi * self.gait.frequency * self.reach
        velocities = data.qvel * self.body.size / leg_speed
        positions = []
        for joint in range(model.njnt):
            address = model.jnt_qposadr[joint]
            kind = model.jnt_type[joint]
            if kind == FREE:
                positions.append(data.qpos[address + 2] / self.reach)
                first = model.jnt_dofadr[joint]
                v_x, v_y = velocities[first : first + 2]
                velocities[first] = v_x * cos + v_y * sin
                velocities[first + 1] = v_y * cos - v_x * sin
            elif kind == HINGE:
                angle = data.qpos[address]
                positions += [np.cos(angle), np.sin(angle)]
            elif kind == SLIDE and abs(model.jnt_axis[joint, 2]) > 0.5:
                positions.append(data.qpos[address] / self.reach)
        # On a slope the heading matters.
        heading = [] if self.is_level else [cos, sin]
        return np.array([*rotation[2, :2], *heading, *velocities, *positions])

    def unwound(self, strides: int) -> np.ndarray:
        """Return qpos less the full turns of hinges that the clock drives in
        ``strides`` strides."""
        model = self.body.model
        qpos = self.body.data.qpos.copy()
        if not strides or self.machine.stroke:
            return qpos
        for actuator in self.machine.driven:
            joint = model.actuator_trnid[actuator, 0]
            gear = model.actuator_gear[actuator, 0]
            drives_joint = model.actuator_trntype[actuator] == JOINT
            if drives_joint and model.jnt_type[joint] == HINGE and gear:
                qpos[model.jnt_qposadr[joint]] -= 2 * np.pi * strides / gear
        return qpos


class _Record:
    """What a simulation has computed of a walk so far.

    rows, positions: after every step, and at the start. moves: displacement of every
    full stride (3,), as of `_move`. status: as of `Simulation.end_status`.
    is_periodic: whether the last stride repeats the one before. drift: m, of the
    progress of a stride. last_stride: number of the row where the last stride
    starts."""

    def __init__(self, simulation: Simulation):
        self.simulation = simulation
        self.rows = [simulation.row()]
        self.positions = [simulation.body.data.qpos.copy()]
        self.status = simulation.end_status()
        self.moves: list[np.ndarray] = []
        self.starts = [0]  # numbers of the rows where strides start
        self.is_periodic = False
        self.drift = np.inf
        self.last_stride = 0
        self._cycles = limit_cycle.begin(1)
        self._state = simulation.scaled_state()
        self._defect = 0.0
        self._strengths: list[float] = []

    def add_stride(self, stride: int) -> str:
        """Compute a stride, and return the status after it."""
        simulation = self.simulation
        self.last_stride = len(self.rows) - 1
        self._defect = simulation.body.defect
        if not self.status:
            self.status = simulation.stride(stride, self.rows, self.positions)
        if self.status:
            return self.status

        self.starts.append(len(self.rows) - 1)
        self.moves.append(_move(self.rows[self.last_stride], self.rows[-1]))
        progress = np.full((3, 1), self.moves[-1][0])
        self._cycles = limit_cycle.after_massless_cycle(self._cycles, progress)
        self.drift = float(self._cycles.drift[0])
        state = simulation.scaled_state()
        change = np.abs(state - self._state).max()
        self._state = state
        is_settled = self.drift <= REMAINING_CHANGE * simulation.reach
        self.is_periodic = bool(is_settled and change < REPEATED)
        memory = simulation.body.memory
        if memory is not None:
            self.is_periodic = False
            self._strengths.append(memory.mean_strength)
            simulation.body.memory = memory._replace(met=0.0, count=0)
        return ""

    def late(self) -> tuple[np.ndarray, np.ndarray]:
        """Return rows and positions of the last stride of a periodic walk, of a few at
        most of others."""
        count = 1 if self.is_periodic else AVERAGED_CYCLES
        first = self.starts[max(0, len(self.starts) - 1 - count)]
        return np.array(self.rows[first:]), np.array(self.positions[first:])

    def of_prints(self) -> dict[str, np.ndarray]:
        """Return the fields of `Walk` on ground that remembers."""
        memory = self.simulation.body.memory
        if memory is None:
            return {}
        return {
            "step_length": np.array([move[0] for move in self.moves]),
            "step_strength": np.array(self._strengths),
            "prints": memory.prints,
        }

    def goes_straight(self, duration: float | None) -> bool:
        """Return whether the last stride, repeated until the duration, s, follows a
        line; True without a duration."""
        if duration is None:
            return True
        return _goes_straight(self.rows[self.last_stride], self.rows[-1], duration)

    def settling_time(self) -> float:
        """Return `Walk.settling_time` of a periodic walk from rest."""
        progress = [move[0] for move in self.moves]
        cycles = float(cycles_to_settle(progress, progress[-1]))
        return cycles / self.simulation.gait.frequency

    def unsolved_error(self) -> float:
        """Return `Walk.unsolved_error`: of the last stride of a periodic walk, else the
        mean over all strides."""
        defect = self.simulation.body.defect
        if self.is_periodic:
            return defect - self._defect
        return defect / max(1, len(self.moves))

    def until(self, duration: float | None) -> tuple[np.ndarray, np.ndarray]:
        """Return rows and positions until the duration, s, if there is one; the last
        stride of a periodic walk is repeated until then."""
        rows = np.array(self.rows)
        positions = np.array(self.positions)
        if duration is None:
            return rows, positions
        steps = 0
        if self.is_periodic:
            steps = len(rows) - 1 - self.last_stride
        return _rows_until(duration, rows, positions, steps)


def _substeps(walker: Walker, model: mujoco.MjModel) -> int:
    """Return the number of MuJoCo's steps in a time step, such that they are no longer
    than those of a custom machine's model where a cycle has as many as by default."""
    if not isinstance(walker.robot, Mjcf):
        return SUBSTEPS
    longest = 1 / (walker.gait.frequency * Fineness.steps)
    return max(SUBSTEPS, math.ceil(longest / model.opt.timestep - 1e-9))


def _goes_straight(before, after, duration: float) -> bool:
    """Return whether a robot that repeats its motion between two rows turns by at most
    `STRAIGHT` until the duration, s."""
    repetitions = max(0.0, duration - after[T]) / (after[T] - before[T])
    turn = abs(math.remainder(after[YAW] - before[YAW], 2 * math.pi))
    return bool(turn * repetitions <= STRAIGHT)


def _move(before, after) -> np.ndarray:
    """Return the displacement (3,) between two rows, along and to the left of the first
    one's heading, m, and the angle to the left, rad, less than half a turn."""
    dx = after[X] - before[X]
    dy = after[Y] - before[Y]
    cos = np.cos(before[YAW])
    sin = np.sin(before[YAW])
    turn = math.remainder(after[YAW] - before[YAW], 2 * math.pi)
    return np.array([dx * cos + dy * sin, dy * cos - dx * sin, turn])


def _rows_until(
    duration: float, rows, positions, steps: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return rows and positions until the duration, s; the last ``steps`` steps, if not
    0, are repeated until then."""
    if steps:
        period = rows[-1, T] - rows[-1 - steps, T]
        count = math.ceil((duration - rows[-1, T]) / period)
        rows = _with_repetitions(rows, steps, count, GROWING_OF_ROWS)
        positions = _with_repetitions(positions, steps, count, GROWING_OF_POSITIONS)
    is_within = rows[:, T] <= duration * (1 + 1e-9)
    return rows[is_within], positions[is_within]


def _with_repetitions(table, steps: int, count: int, growing: list[int]) -> np.ndarray:
    """Return a table (N, n) with ``count`` repetitions of its last steps, in which the
    columns ``growing`` gain what they have gained in these steps."""
    gain = np.zeros(table.shape[1])
    gain[growing] = (table[-1] - table[-1 - steps])[growing]
    copies = [table[-steps:] + k * gain for k in range(1, count + 1)]
    return np.concatenate([table, *copies])
