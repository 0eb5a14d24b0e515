"""The engine of three dimensions: robots as MuJoCo models on grains (`rft.walking.multibody`), one after the other.

A robot of the vertical plane becomes a hull on legs at both sides that is free to roll, yaw and drift (`rft.walking.hexapod`);
an MJCF of one's own is taken as it is. Strides are those of the planar engine, until one repeats the last.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import mujoco
import numpy as np

from rft import limit_cycle
from rft.meshes.extruded import Extruded
from rft.meshes.law import Spatial
from rft.walking.engines import Fineness, Walker
from rft.walking.facets import Grains
from rft.walking.machine import FREE, HINGE, JOINT, SLIDE, Clock, machine
from rft.walking.multibody import Multibody
from rft.walking.robot import parts, rounded
from rft.walking.stride import FEW_STRIDES, LATE, MOST_STRIDES, SETTLED, STUCK, Walk, advanced, cycles_to_settle

REPEATED = (
    1e-2  # of the speed of the legs' ends: what the start of a stride may differ from the last one's, to repeat it
)
STRAIGHT = 0.05  # rad, by which a robot may yet turn, for strides to be repeated along a line
ROW = ("t", "x", "z", "pitch", "v_x", "v_z", "rate", "work", "loss", "energy", "y", "roll", "yaw")


def refuse(walker: Walker) -> None:
    """ValueError for a walker that this engine does not take."""
    if not isinstance(walker.stress, Spatial):
        Extruded(walker.stress)


def walk(
    walkers: Sequence[Walker],
    numerics: Fineness,
    settling: int | None = None,
    progress: Callable | None = None,
    advance: Callable = advanced,
) -> list[Walk]:
    """Each walker from rest for the duration, or so many cycles, or to its end; its speed at the limit cycle. progress: told
    the fraction done. advance: takes the strides, as `rft.walking.stride.advanced`."""
    found: list[Walk] = []
    for walker in walkers:
        duration = settling / walker.gait.frequency if settling else numerics.duration
        most = math.ceil(duration * walker.gait.frequency - 1e-9) + MOST_STRIDES
        told = (lambda done: progress((len(found) + done) / len(walkers))) if progress else None
        found.append(Course(walker, numerics, advance=advance).walk(most, duration, progress=told))
    return found


def again(
    walkers: Sequence[Walker],
    numerics: Fineness,
    walks: Sequence[Walk],
    settling: int | None = None,
    advance: Callable = advanced,
) -> list[Walk]:
    """The same with other numerics, a few strides from where a stride begins at the end of each walk, and nothing but what is
    said of those is new."""
    found = []
    for walker, known in zip(walkers, walks):
        if known.limit is None:
            found += walk([walker], numerics, settling, advance=advance)
            continue
        here = Course(walker, numerics, advance=advance).walk(FEW_STRIDES, start=known.limit)
        found.append(here._replace(**{name: getattr(known, name) for name in Walk._fields[:6]}))
    return found


def pace(walker: Walker, numerics: Fineness, enough: float) -> tuple[float, float]:
    """(s of computing, times that forces are evaluated) of a time step: of the first ones from rest, till ``enough`` s are
    over or a stride is."""
    body, h = Course(walker, numerics).body, 1 / (walker.gait.frequency * numerics.steps)
    begin, took, steps = time.process_time(), 0.0, 0
    while steps < numerics.steps and took < enough:
        body.step(h)
        took, steps = time.process_time() - begin, steps + 1
    return took / steps, body.tries / steps


class Start(NamedTuple):
    """The state of a model at the start of a stride, the clock at 0."""

    qpos: np.ndarray
    qvel: np.ndarray


class Course:
    """One walker on its way."""

    def __init__(self, walker: Walker, numerics: Fineness, planar: bool = False, advance: Callable = advanced):
        refuse(walker)
        self.made_of, self.advance = (walker, numerics, planar), advance
        self.machine = machine(walker.robot, numerics.elements, planar)
        self.clock, self.gait = Clock(self.machine, walker.gait), walker.gait
        law = walker.stress if isinstance(walker.stress, Spatial) else Extruded(walker.stress)
        ground = walker.ground
        grains = Grains(law, ground.strength, ground.flux, numerics.rounding)
        self.body = Multibody(self.machine.model, self.machine.surfaces, grains, self.clock)
        self.clock.place(self.body)
        self.segments = parts(self.clock.kinks(), numerics.steps)
        facets, data, root = self.body.facets, self.body.data, self.machine.root
        away = np.linalg.norm(data.xpos[facets.bodies] - data.xpos[root], axis=1)
        legs = facets.bodies != root
        self.reach = float(facets.reach[legs].max() if legs.any() else facets.reach.max())
        self.far = float((away + facets.reach).max() + facets.reach.max())
        if len(self.machine.driven):
            rounding = float(rounded(numerics.rounding, walker.gait.frequency, self.reach))
            self.body.grains = replace(self.body.grains, rounding=rounding)
        self.own = np.flatnonzero(np.isin(facets.of, np.flatnonzero(~legs)))

    def __reduce__(self) -> tuple:
        return Course, self.made_of

    def walk(
        self,
        most: int,
        duration: float | None = None,
        start: Start | None = None,
        progress: Callable | None = None,
    ) -> Walk:
        """At most so many strides. duration: s, for which the walk is told, the rest as repetitions of the last stride."""
        body = self.body
        if start is not None:
            body.data.qpos[:], body.data.qvel[:] = start
            mujoco.mj_forward(body.model, body.data)
        cycles, moves, periodic, drift, before = limit_cycle.begin(1), [], False, np.inf, 0.0
        rows, states, last, ended = [self.row()], [body.data.qpos.copy()], self.section(), self.ended()
        for stride in range(most):
            first, begun, before = rows[-1], len(rows) - 1, body.defect
            ended = ended or self.stride(stride, rows, states)
            if progress:
                progress((stride + 1) / most)
            if ended:
                break
            moves.append(_moved(first, rows[-1]))
            cycles = limit_cycle.after_massless_cycle(cycles, np.full((3, 1), moves[-1][0]))
            drift = float(cycles.drift[0])
            here = self.section()
            change, last = np.abs(here - last).max(), here
            periodic = bool(drift <= SETTLED * self.reach and change < REPEATED)
            if periodic and (duration is None or _straight(first, rows[-1], duration)):
                break
        limit = None if ended else Start(self.unwound(stride + 1), body.data.qvel.copy())
        table, path = np.array(rows), np.array(states)
        off = body.defect - before if periodic else body.defect / max(1, len(moves))
        (speed, aside, turning), drift, status = self.told(
            table, np.array(moves).reshape(-1, 3), periodic, drift, ended
        )
        settled = np.nan
        if periodic and start is None and status == "walking":
            settled = float(cycles_to_settle([m[0] for m in moves], moves[-1][0])) / self.gait.frequency
        if periodic and duration is not None:
            table, path = _repeated(table, path, len(table) - 1 - begun, duration)
        if duration is not None:
            some = table[:, 0] <= duration * (1 + 1e-9)
            table, path = table[some], path[some]
        named = dict(zip(ROW, table.T))
        pose, twist = (np.stack([named[n] for n in x], -1) for x in (ROW[1:4], ROW[4:7]))
        more = {name: named[name] for name in ("y", "roll", "yaw")} | {"states": path}
        return Walk(
            named["t"], pose, twist, named["work"], named["loss"], named["energy"], speed, status,
            float(len(moves)), periodic, drift, limit, body.unsolved, body.residual, off, more, settled, aside, turning,
        )  # fmt: skip

    def told(self, rows, moves, periodic: bool, drift: float, ended: str) -> tuple[list[float], float, str]:
        """(speed, m/s aside and rad/s of turning), what the speed may yet change, and status, of cycles that move by (N, 3)."""
        f = self.gait.frequency
        if ended:
            ahead, aside, _ = _moved(rows[0], rows[-1])
            turned = np.diff(np.unwrap(rows[:, ROW.index("yaw")])[[0, -1]])[0]
            return (np.array([ahead, aside, turned]) / (rows[-1, 0] or np.inf)).tolist(), 0.0, ended
        late = moves[-1:] if periodic else moves[-LATE:]
        if not periodic:
            drift = np.ptp(late[:, 0]) if len(late) > 1 else abs(late[0, 0])
        status = "stuck" if abs(late[:, 0].mean()) < STUCK * self.reach else "walking"
        return (late.mean(0) * f).tolist(), float(drift * f), status

    def stride(self, stride: int, rows: list, states: list) -> str:
        """The next one; how it ended, or ""."""
        body = self.body
        more, path, numbers = self.advance(self.steps, stride, body.numbers())
        body.go_on(numbers)
        rows += more.tolist()
        states += list(path)
        return self.ended()

    def steps(self, stride: int, numbers: tuple) -> tuple[np.ndarray, np.ndarray, tuple]:
        """Return the rows and states of a stride's steps, or of those to the robot's end, and the numbers that all to come
        follows from. numbers: those of the body as it is now."""
        rows, states = [], []
        f, data = self.gait.frequency, self.body.data
        for begin, end, steps in self.segments:
            for k in range(steps):
                data.time = (stride + begin + (end - begin) * k / steps) / f
                self.body.step((end - begin) / steps / f, (stride + (begin + end) / 2) / f)
                rows.append(self.row())
                states.append(data.qpos.copy())
                if self.ended():
                    return np.array(rows), np.array(states), self.body.numbers()
        return np.array(rows), np.array(states), self.body.numbers()

    def row(self) -> list[float]:
        """As `ROW` says, along the world's axes but for the rate, about the axis to the robot's left."""
        body, root = self.body, self.machine.root
        place, turn = body.data.xpos[root], body.data.xmat[root].reshape(3, 3)
        motion = np.zeros(6)
        mujoco.mj_objectVelocity(body.model, body.data, mujoco.mjtObj.mjOBJ_XBODY, root, motion, 0)
        yaw = np.arctan2(turn[1, 0], turn[0, 0])
        pitch = np.arctan2(-turn[2, 0], np.hypot(turn[0, 0], turn[1, 0]))
        rate = motion[1] * np.cos(yaw) - motion[0] * np.sin(yaw)
        sums = body.work, body.loss, body.energy()
        roll = np.arctan2(turn[2, 1], turn[2, 2])
        return [body.data.time, place[0], place[2], pitch, motion[3], motion[5], rate, *sums, place[1], roll, yaw]

    def ended(self) -> str:
        """How, or ""."""
        data, facets, root = self.body.data, self.body.facets, self.machine.root
        height, turn = data.xpos[root, 2], data.xmat[root].reshape(3, 3)
        if turn[2, 2] < 0.0:
            return "flipped"
        if height > self.far:
            return "airborne"
        top = max(height, (facets.corners[self.own] @ turn[2] + height).max(initial=height))
        return "sunk" if top < 0.0 else ""

    def section(self) -> np.ndarray:
        """What tells all that is to come at the start of a stride, per reach, turn and speed of the legs' ends."""
        model, data = self.body.model, self.body.data
        turn = data.xmat[self.machine.root].reshape(3, 3)
        fast = 2 * np.pi * self.gait.frequency * self.reach
        numbers = [*turn[2, :2], *(data.qvel * self.body.size / fast)]
        for joint in range(model.njnt):
            at, first = model.jnt_qposadr[joint], model.jnt_dofadr[joint]
            kind = model.jnt_type[joint]
            if kind == FREE:
                numbers.append(data.qpos[at + 2] / self.reach)
                yaw = np.arctan2(turn[1, 0], turn[0, 0])
                there = len(turn[2, :2]) + first
                a, b = numbers[there : there + 2]
                numbers[there : there + 2] = a * np.cos(yaw) + b * np.sin(yaw), b * np.cos(yaw) - a * np.sin(yaw)
            elif kind == HINGE:
                numbers += [np.cos(data.qpos[at]), np.sin(data.qpos[at])]
            elif kind == SLIDE and abs(model.jnt_axis[joint, 2]) > 0.5:
                numbers.append(data.qpos[at] / self.reach)
        return np.array(numbers)

    def unwound(self, strides: int) -> np.ndarray:
        """qpos with what the clock has turned since its start taken back."""
        model, qpos = self.body.model, self.body.data.qpos.copy()
        for actuator in self.machine.driven if strides else ():
            joint, gear = model.actuator_trnid[actuator, 0], model.actuator_gear[actuator, 0]
            turns = model.actuator_trntype[actuator] == JOINT and model.jnt_type[joint] == HINGE
            if turns and gear:
                qpos[model.jnt_qposadr[joint]] -= 2 * np.pi * strides / gear
        return qpos


def _straight(before, after, duration: float) -> bool:
    """Whether a robot that does this between two rows, over and over, hardly turns till the duration is over."""
    t, yaw = ROW.index("t"), ROW.index("yaw")
    left = max(0.0, duration - after[t]) / (after[t] - before[t])
    return bool(abs(math.remainder(after[yaw] - before[yaw], 2 * math.pi)) * left <= STRAIGHT)


def _moved(before, after) -> np.ndarray:
    """(3,): m along the heading of the first of two rows and to the left of it, and rad to the left, less than half a turn."""
    x, y, yaw = (ROW.index(n) for n in ("x", "y", "yaw"))
    dx, dy, cos, sin = after[x] - before[x], after[y] - before[y], np.cos(before[yaw]), np.sin(before[yaw])
    return np.array([dx * cos + dy * sin, dy * cos - dx * sin, math.remainder(after[yaw] - before[yaw], 2 * math.pi)])


def _repeated(rows, states, steps: int, duration: float) -> tuple[np.ndarray, np.ndarray]:
    """With the last so many steps over and over, till the duration is over."""
    gains, more = [], max(0, math.ceil((duration - rows[-1, 0]) / (rows[-1, 0] - rows[-1 - steps, 0])))
    for table, kept in ((rows, (0, 1, 7, 8, 10)), (states, (0, 1))):
        gain = np.zeros(table.shape[1])
        gain[list(kept)] = (table[-1] - table[-1 - steps])[list(kept)]
        gains.append(gain)
    return tuple(
        np.concatenate([table, *(table[-steps:] + k * gain for k in range(1, more + 1))])
        for table, gain in zip((rows, states), gains)
    )
