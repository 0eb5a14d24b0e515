"""The engine of three dimensions: robots as MuJoCo models in sand
(`rft.terradynamics.walking.multibody`), one after the other.

MuJoCo's steps are of order 1, and its triangles lead as a whole or not at all. So it
takes `SUBSTEPS` for each time step, and cuts an element of a leg or belly into
`PIECES`, which makes both errors as small as those of the planar engine.

A robot of the vertical plane becomes a hull on legs at both sides that is free to roll,
yaw and drift (`rft.terradynamics.walking.hexapod`); a custom MJCF is used as it is. A
walk ends with the stride that repeats the last one.
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
from rft.terradynamics.meshes.extruded import Extruded
from rft.terradynamics.meshes.law import Spatial
from rft.terradynamics.walking.engines import (
    Fineness,
    Refined,
    Walker,
    with_more_elements,
)
from rft.terradynamics.walking.facets import Facets, Grains
from rft.terradynamics.walking.machine import (
    FREE,
    HINGE,
    JOINT,
    SLIDE,
    Clock,
    machine,
    pace_servos,
)
from rft.terradynamics.walking.mjcf import Mjcf
from rft.terradynamics.walking.multibody import SUBSTEPS, Multibody
from rft.terradynamics.walking.robot import intervals, walking_rounding
from rft.terradynamics.walking.stride import (
    FEW_STRIDES,
    LAST_CYCLES,
    MOST_STRIDES,
    SETTLED,
    STUCK,
    Walk,
    compute_stride,
    cycles_to_settle,
)

ORDER = 1  # of the time steps
PIECES = 4  # of an element of a leg or belly
MOST_STEPS = 10_000  # of a cycle
# largest difference of the starts of strides that repeat, over the speed of the legs'
# ends
REPEATED = 1e-2
# rad, largest turn until the end of a walk whose strides are repeated along a line
STRAIGHT = 0.05
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


def refuse(walker: Walker) -> None:
    """Raise ValueError for a walker that this engine cannot compute."""
    if not isinstance(walker.stress, Spatial):
        Extruded(walker.stress)


def refined(numerics: Fineness) -> list[Refined]:
    """Return twice and one and a half times the steps, as one change alone may be small
    by chance, and twice the elements.

    An error of order 1 is twice and three times these changes."""
    more = [min(MOST_STEPS, numerics.steps * halves // 2) for halves in (4, 3)]
    return [
        Refined(dataclasses.replace(numerics, steps=more[0]), "steps", 2.0, 2.0),
        Refined(dataclasses.replace(numerics, steps=more[1]), "steps", 3.0, 1.5),
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
        duration = cycles / walker.gait.frequency if cycles else numerics.duration
        most = math.ceil(duration * walker.gait.frequency - 1e-9) + MOST_STRIDES

        def report(fraction):
            progress((len(walks) + fraction) / len(walkers))

        simulation = Simulation(walker, numerics, advance=advance)
        walks.append(
            simulation.walk(most, duration, progress=report if progress else None)
        )
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
    others = []
    for walker, known in zip(walkers, walks):
        if known.limit is None:
            others += walk([walker], numerics, cycles, advance=advance)
            continue
        other = Simulation(walker, numerics, advance=advance).walk(
            FEW_STRIDES, start=known.limit
        )
        others.append(
            other._replace(**{name: getattr(known, name) for name in Walk._fields[:6]})
        )
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
            steps = steps + 1
    return elapsed / steps, body.iterations / (steps * body.substeps)


class Start(NamedTuple):
    """The state of a model at the start of a stride, with the clock at 0."""

    qpos: np.ndarray
    qvel: np.ndarray


class Simulation:
    """A walker in MuJoCo, stride after stride.

    reach: m, of the legs. ceiling: m, height of the root above which the robot is
    airborne. hull: triangles of the root."""

    def __init__(
        self,
        walker: Walker,
        numerics: Fineness,
        planar: bool = False,
        advance: Callable = compute_stride,
    ):
        refuse(walker)
        self.arguments = (walker, numerics, planar)
        self.advance = advance
        self.machine = machine(walker.robot, numerics.elements, planar, PIECES)
        self.gait = walker.gait
        # Legs and screws of hardly any mass turn as the clock does, also where its rate
        # jumps.
        self.prescribed = not isinstance(walker.robot, Mjcf)
        if self.prescribed:
            pace_servos(self.machine, walker.gait.frequency)
        self.clock = Clock(self.machine, walker.gait)
        root = self.machine.root
        facets = Facets(self.machine.surfaces)
        legs = facets.bodies != root
        self.reach = float(
            facets.reach[legs].max() if legs.any() else facets.reach.max()
        )
        law = (
            walker.stress
            if isinstance(walker.stress, Spatial)
            else Extruded(walker.stress)
        )
        ground = walker.ground
        rounding = numerics.rounding
        if len(self.machine.driven):
            rounding = walking_rounding(rounding, walker.gait.frequency, self.reach)
        self.body = Multibody(
            self.machine.model,
            self.machine.surfaces,
            Grains(law, ground.strength, ground.flux, float(rounding)),
            self.clock,
            _substeps(walker, self.machine.model),
        )
        self.clock.set_start(self.body)
        self.intervals = intervals(self.clock.kinks(), numerics.steps)
        data = self.body.data
        distance = np.linalg.norm(data.xpos[facets.bodies] - data.xpos[root], axis=1)
        self.ceiling = float((distance + facets.reach).max() + facets.reach.max())
        self.hull = np.flatnonzero(np.isin(facets.owner, np.flatnonzero(~legs)))

    def __reduce__(self) -> tuple:
        return Simulation, self.arguments

    def walk(
        self,
        most: int,
        duration: float | None = None,
        start: Start | None = None,
        progress: Callable | None = None,
    ) -> Walk:
        """Return a walk of at most ``most`` strides. duration: s, of the walk; after a
        stride that repeats the last one, the rest consists of its repetitions."""
        body = self.body
        if start is not None:
            body.data.qpos[:], body.data.qvel[:] = start
            body.update()
        cycles = limit_cycle.begin(1)
        moves = []
        periodic = False
        drift = np.inf
        before = 0.0
        rows = [self.row()]
        states = [body.data.qpos.copy()]
        last = self.scaled_state()
        ended = self.end_status()
        for stride in range(most):
            first = rows[-1]
            start_row = len(rows) - 1
            before = body.defect
            ended = ended or self.stride(stride, rows, states)
            if progress:
                progress((stride + 1) / most)
            if ended:
                break
            moves.append(_moved(first, rows[-1]))
            cycles = limit_cycle.after_massless_cycle(
                cycles, np.full((3, 1), moves[-1][0])
            )
            drift = float(cycles.drift[0])
            now = self.scaled_state()
            change = np.abs(now - last).max()
            last = now
            periodic = bool(drift <= SETTLED * self.reach and change < REPEATED)
            if periodic and (
                duration is None or _goes_straight(first, rows[-1], duration)
            ):
                break
        limit = (
            None if ended else Start(self.unwound(stride + 1), body.data.qvel.copy())
        )
        table = np.array(rows)
        path = np.array(states)
        unsolved_error = (
            body.defect - before if periodic else body.defect / max(1, len(moves))
        )
        (speed, lateral_speed, yaw_rate), drift, status = self.means(
            table, np.array(moves).reshape(-1, 3), periodic, drift, ended
        )
        settling_time = np.nan
        if periodic and start is None and status == "walking":
            settling_time = (
                float(cycles_to_settle([m[0] for m in moves], moves[-1][0]))
                / self.gait.frequency
            )
        if duration is not None:
            table, path = _until(
                duration, table, path, len(table) - 1 - start_row if periodic else 0
            )
        columns = dict(zip(ROW, table.T))
        pose, twist = (
            np.stack([columns[n] for n in x], -1) for x in (ROW[1:4], ROW[4:7])
        )
        spatial = {name: columns[name] for name in ("y", "roll", "yaw")} | {
            "states": path
        }
        return Walk(
            columns["t"], pose, twist, columns["work"], columns["loss"], columns["energy"], speed, status,
            float(len(moves)), periodic, drift, limit, body.unsolved, body.residual, unsolved_error, spatial, settling_time,
            lateral_speed, yaw_rate,
        )  # fmt: skip

    def means(
        self, rows, moves, periodic: bool, drift: float, ended: str
    ) -> tuple[list[float], float, str]:
        """Return speed, lateral speed and yaw rate of a walk whose cycles have moved by
        (N, 3), the drift of the speed, and the status."""
        f = self.gait.frequency
        if ended:
            ahead, left, _ = _moved(rows[0], rows[-1])
            turn = np.diff(np.unwrap(rows[:, ROW.index("yaw")])[[0, -1]])[0]
            return (
                (np.array([ahead, left, turn]) / (rows[-1, 0] or np.inf)).tolist(),
                0.0,
                ended,
            )
        late = moves[-1:] if periodic else moves[-LAST_CYCLES:]
        if not periodic:
            drift = np.ptp(late[:, 0]) if len(late) > 1 else abs(late[0, 0])
        status = "stuck" if abs(late[:, 0].mean()) < STUCK * self.reach else "walking"
        return (late.mean(0) * f).tolist(), float(drift * f), status

    def stride(self, stride: int, rows: list, states: list) -> str:
        """Compute a stride, append its rows and positions, and return `end_status`
        after it."""
        new_rows, positions, state = self.advance(self.steps, stride, self.body.state())
        self.body.restore(state)
        rows += new_rows.tolist()
        states += list(positions)
        return self.end_status()

    def steps(self, stride: int, state: tuple) -> tuple[np.ndarray, np.ndarray, tuple]:
        """Return rows and positions after each step of a stride, or until the robot's
        end, and the body's state then. state: that of the body now, on which the result
        depends."""
        with self.body.in_sand():
            return self._steps(stride)

    def _steps(self, stride: int) -> tuple[np.ndarray, np.ndarray, tuple]:
        """Return what `steps` does, in the sand."""
        rows = []
        states = []
        f = self.gait.frequency
        data = self.body.data
        for begin, end, steps in self.intervals:
            rate_time = (stride + (begin + end) / 2) / f
            if self.prescribed:
                self.clock.set_rates(self.body, rate_time)
            for k in range(steps):
                data.time = (stride + begin + (end - begin) * k / steps) / f
                self.body.step((end - begin) / steps / f, rate_time)
                rows.append(self.row())
                states.append(data.qpos.copy())
                if self.end_status():
                    return np.array(rows), np.array(states), self.body.state()
        return np.array(rows), np.array(states), self.body.state()

    def row(self) -> list[float]:
        """Return the numbers named in `ROW`, along the world's axes; the rate is about
        the horizontal axis to the left."""
        body = self.body
        root = self.machine.root
        place = body.data.xpos[root]
        rotation = body.data.xmat[root].reshape(3, 3)
        motion = np.zeros(6)
        mujoco.mj_objectVelocity(
            body.model, body.data, mujoco.mjtObj.mjOBJ_XBODY, root, motion, 0
        )
        yaw = np.arctan2(rotation[1, 0], rotation[0, 0])
        pitch = np.arctan2(-rotation[2, 0], np.hypot(rotation[0, 0], rotation[1, 0]))
        rate = motion[1] * np.cos(yaw) - motion[0] * np.sin(yaw)
        sums = body.work, body.loss, body.energy()
        roll = np.arctan2(rotation[2, 1], rotation[2, 2])
        return [
            body.data.time,
            place[0],
            place[2],
            pitch,
            motion[3],
            motion[5],
            rate,
            *sums,
            place[1],
            roll,
            yaw,
        ]

    def end_status(self) -> str:
        """Return "flipped", "airborne" or "sunk" for a robot at an end, else ""."""
        data = self.body.data
        facets = self.body.facets
        root = self.machine.root
        height = data.xpos[root, 2]
        rotation = data.xmat[root].reshape(3, 3)
        if rotation[2, 2] < 0.0:
            return "flipped"
        if height > self.ceiling:
            return "airborne"
        top = (facets.corners[self.hull] @ rotation[2] + height).max(initial=height)
        return "sunk" if top < 0.0 else ""

    def scaled_state(self) -> np.ndarray:
        """Return the numbers at the start of a stride that determine all further
        motion: heights over the reach, angles, and velocities over the speed of the
        legs' ends, along and across the heading."""
        model = self.body.model
        data = self.body.data
        rotation = data.xmat[self.machine.root].reshape(3, 3)
        leg_speed = 2 * np.pi * self.gait.frequency * self.reach
        numbers = [*rotation[2, :2], *(data.qvel * self.body.size / leg_speed)]
        for joint in range(model.njnt):
            address = model.jnt_qposadr[joint]
            first = model.jnt_dofadr[joint]
            kind = model.jnt_type[joint]
            if kind == FREE:
                numbers.append(data.qpos[address + 2] / self.reach)
                yaw = np.arctan2(rotation[1, 0], rotation[0, 0])
                k = len(rotation[2, :2]) + first
                a, b = numbers[k : k + 2]
                numbers[k : k + 2] = (
                    a * np.cos(yaw) + b * np.sin(yaw),
                    b * np.cos(yaw) - a * np.sin(yaw),
                )
            elif kind == HINGE:
                numbers += [np.cos(data.qpos[address]), np.sin(data.qpos[address])]
            elif kind == SLIDE and abs(model.jnt_axis[joint, 2]) > 0.5:
                numbers.append(data.qpos[address] / self.reach)
        return np.array(numbers)

    def unwound(self, strides: int) -> np.ndarray:
        """Return qpos less the full turns of hinges that the clock drives in
        ``strides`` strides."""
        model = self.body.model
        qpos = self.body.data.qpos.copy()
        for actuator in self.machine.driven if strides else ():
            joint = model.actuator_trnid[actuator, 0]
            gear = model.actuator_gear[actuator, 0]
            hinge = (
                model.actuator_trntype[actuator] == JOINT
                and model.jnt_type[joint] == HINGE
            )
            if hinge and gear:
                qpos[model.jnt_qposadr[joint]] -= 2 * np.pi * strides / gear
        return qpos


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
    t = ROW.index("t")
    yaw = ROW.index("yaw")
    repetitions = max(0.0, duration - after[t]) / (after[t] - before[t])
    return bool(
        abs(math.remainder(after[yaw] - before[yaw], 2 * math.pi)) * repetitions
        <= STRAIGHT
    )


def _moved(before, after) -> np.ndarray:
    """Return the displacement (3,) between two rows, along and to the left of the first
    one's heading, m, and the angle to the left, rad, less than half a turn."""
    x, y, yaw = (ROW.index(n) for n in ("x", "y", "yaw"))
    dx = after[x] - before[x]
    dy = after[y] - before[y]
    cos = np.cos(before[yaw])
    sin = np.sin(before[yaw])
    return np.array(
        [
            dx * cos + dy * sin,
            dy * cos - dx * sin,
            math.remainder(after[yaw] - before[yaw], 2 * math.pi),
        ]
    )


def _until(duration: float, rows, states, steps: int) -> list[np.ndarray]:
    """Return rows and positions until the duration, s; the last ``steps`` steps, if not
    0, are repeated until then."""
    count = (
        math.ceil((duration - rows[-1, 0]) / (rows[-1, 0] - rows[-1 - steps, 0]))
        if steps
        else 0
    )
    tables = []
    for table, columns in (
        (rows, [0, 1, 7, 8, 10]),
        (states, [0, 1]),
    ):  # columns that grow from stride to stride
        gain = np.zeros(table.shape[1])
        gain[columns] = (table[-1] - table[-1 - steps])[columns]
        tables.append(
            np.concatenate(
                [table, *(table[-steps:] + k * gain for k in range(1, count + 1))]
            )
        )
    within = tables[0][:, 0] <= duration * (1 + 1e-9)
    return [table[within] for table in tables]
