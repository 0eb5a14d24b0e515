"""Questions about scenes of walking robots: a walk with the error of its speed, and the
sweeps and accuracy studies of walks."""

from __future__ import annotations

import dataclasses
import itertools
import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple

import numpy as np

from geomech.core.setting import Setting
from geomech.core.variables import Variable
from geomech.run.backend import prefer_backend
from geomech.run.cost import BASE, Cost, duration
from geomech.run.runner import runner
from geomech.scenes import write as written
from geomech.scenes.walker import WalkerScene
from geomech.studies.grid import Grid
from geomech.studies.settings import Measurements
from rft.core.metres import GRAVITY
from rft.core.refusal import Refusal, located
from rft.terradynamics.walking import Mjcf, Rhex, Roller, Walk, engine
from rft.terradynamics.walking.stride import MOST_STRIDES
from rft.terradynamics.walking.stride import NEAR as NEAR

PILOT = 0.05  # s of time steps that are timed
STATUSES = ("walking", "stuck", "sunk", "flipped", "airborne")
TOGETHER = 32  # robots in a batch
SETTLING = 3  # cycles from rest in a sweep, before the limit cycle is looked for
STEP = 200.0  # balances that take NumPy as long as a time step in the plane
STEP_IN_SPACE = 11_000.0  # and as one in three dimensions, 55 ms
HARD = 30.0  # evaluations of forces in a step; the first steps of the built-in robots take 7 to 14
PUSHED = 0.2  # acceleration of a body by much faster legs over gravity, measured
IN_VAIN = (
    40  # cycles of a failing search for a limit cycle with its errors, many at once
)
WALKING = 0.7  # share of the time before the errors are computed
UNITS = {  # of a walk's table; a positive pitch is nose down
    "t": "s", "x": "m", "z": "m", "pitch": "rad", "v_x": "m/s", "v_z": "m/s", "rate": "rad/s", "work": "J", "loss": "J",
    "energy": "J", "y": "m", "roll": "rad", "yaw": "rad",
}  # fmt: skip
LABELS = {
    "pitch": "nose down",
    "states": "of the engine in three dimensions",
    "roll": "left side up",
    "yaw": "to the left",
}
LIMIT = 3  # cycles up to the limit cycle, and as many for each of its errors
SETTINGS = (
    Setting("steps", (12, 16, 24, 32, 48, 64, 96), 2, against="limit"),
    Setting("elements", (6, 8, 12, 16, 24, 32), 2, against="limit"),
    Setting("rounding", (8e-3, 4e-3, 2e-3, 1e-3, 5e-4), 1, against="limit"),
)
FINEST = {"steps": 256, "elements": 96, "rounding": 6.25e-5}
TOLERANCES = 10.0 ** -np.arange(1, 5)  # of the speed, m/s


class Walked(NamedTuple):
    """A walk with the errors of its means.

    walk: as computed by rft. estimate: error of its speed, m/s: the larger of the
    changes with two other numbers of steps and the change with twice the elements, each
    times the factor of `rft.terradynamics.walking.engines.Refined`; the distance from
    the limit cycle; and the effect of unsolved steps. lateral, turning: errors of the
    lateral speed, m/s, and of the yaw rate, rad/s, by the changes alone. steps,
    elements: m/s, the parts of the estimate that come from each."""

    walk: Walk
    estimate: float
    lateral: float = 0.0
    turning: float = 0.0
    steps: float = 0.0
    elements: float = 0.0


def walked(
    scenes: Sequence[WalkerScene],
    by: str | None = None,
    settling: bool = False,
    progress: Callable | None = None,
) -> list[Walked]:
    """Return the walks of scenes with equal numerics and engines, computed in batches.
    settling: a few cycles from rest suffice. progress: called with the fraction
    done."""
    numerics, chosen, walkers = (
        scenes[0].numerics,
        engine(by or scenes[0].engine),
        [s.walker for s in scenes],
    )
    callback = {"progress": lambda done: progress(WALKING * done)} if progress else {}
    walks = chosen.walk(
        walkers,
        numerics,
        SETTLING if settling else None,
        advance=runner().call,
        **callback,
    )
    refinements, changes = chosen.refined(numerics), {"steps": [], "elements": []}
    for k, refined in enumerate(refinements):
        rerun = chosen.rerun(
            walkers,
            refined.numerics,
            walks,
            SETTLING if settling else None,
            advance=runner().call,
        )
        change = [np.subtract(_means(a), _means(b)) for a, b in zip(rerun, walks)]
        changes[refined.setting].append(refined.factor * np.abs(change))
        if progress:
            progress(WALKING + (1.0 - WALKING) * (k + 1) / len(refinements))
    steps, elements = (np.max(changes[name], axis=0) for name in ("steps", "elements"))
    error = steps + elements
    error[:, 0] += [w.drift + w.unsolved_error for w in walks]
    parts = np.stack([steps[:, 0], elements[:, 0]], -1)
    return [Walked(w, *e, *p) for w, e, p in zip(walks, error.tolist(), parts.tolist())]


def _means(walk: Walk) -> tuple[float, float, float]:
    """Return the means of a walk that have an error: speed, lateral speed, yaw rate."""
    return walk.speed, walk.lateral_speed, walk.yaw_rate


def cost_of_transport(scene: WalkerScene, walk: Walk) -> float:
    """Return the work of the motors over weight times distance, from rest to the end;
    the distance is the sum of the chords of the cycles. inf for a robot that does not
    move."""
    at = np.append(np.arange(0.0, walk.t[-1], 1 / scene.gait.frequency), walk.t[-1])
    y = walk.spatial["y"] if walk.spatial else np.zeros_like(walk.t)
    path = np.hypot(
        *(np.diff(np.interp(at, walk.t, x)) for x in (walk.pose[:, 0], y))
    ).sum()
    return (
        float(walk.work[-1] / (scene.robot.mass * GRAVITY * path))
        if path > 0.0
        else math.inf
    )


def run(
    scene: WalkerScene,
    by: str | None = None,
    progress: Callable | None = None,
    longest: float = math.inf,
) -> Walked:
    """Return the walk of one scene.

    longest: seconds of computing, after which it is refused if the start from rest is
    not done yet: that time depends on whether a cycle repeats itself, which is not
    known beforehand."""
    begin = time.process_time()

    def report(done: float) -> None:
        if time.process_time() - begin > longest and done < WALKING:
            cure = "lower [numerics] duration, or lift the limit (``longest``)"
            raise Refusal(
                f"after {longest:.0f} s of computing {done:.0%} is done, and no cycle repeats itself",
                instead=cure,
            )
        if progress:
            progress(done)

    with located(scene.name):
        return walked([scene], by, progress=report)[0]


def variables(scene: WalkerScene, run: Walked) -> list[Variable]:
    """Return the means of a walk with their errors, what it took, and its motion."""
    return [*means(scene, run), *totals(scene, run), *motion(run)]


def means(scene: WalkerScene, run: Walked) -> list[Variable]:
    """Return the means over the limit cycle."""
    walk = run.walk
    along = "mean over the limit cycle, along the heading"
    of_steps = "part of the error of speed, from other numbers of steps"
    of_elements = "part of the error of speed, from twice as many elements"
    ended = "1 if the limit cycle was found"
    found = [
        Variable("status", (), walk.status, label="how the walk ended"),
        Variable("periodic", (), int(walk.periodic), "1", ended),
        Variable("speed", (), walk.speed, "m/s", along, run.estimate),
        Variable("speed_error_of_steps", (), run.steps, "m/s", of_steps),
        Variable("speed_error_of_elements", (), run.elements, "m/s", of_elements),
        Variable("frequency", (), scene.gait.frequency, "Hz", "of the gait"),
        Variable("cycles", (), walk.cycles, "1", "computed"),
    ]
    flat = "" if walk.spatial else "in the plane"
    to_the_left = "mean, to the left of the heading"
    for name, value, unit, error in (
        ("lateral_speed", walk.lateral_speed, "m/s", run.lateral),
        ("yaw_rate", walk.yaw_rate, "rad/s", run.turning),
    ):
        found.append(Variable(name, (), value, unit, to_the_left, error, zero=flat))
    if not math.isnan(walk.settling_time):
        share = f"{100 * NEAR:g} %"
        label = f"from rest until within {share} of the limit cycle, inf for never"
        found.append(Variable("settling_time", (), walk.settling_time, "s", label))
    return found


def totals(scene: WalkerScene, run: Walked) -> list[Variable]:
    """Return what the whole walk took, and how well its steps were solved."""
    walk = run.walk
    transport = cost_of_transport(scene, walk)
    of_weight = "work over weight times distance, from rest"
    share = "share of the work that the steps do not account for"
    unsolved = "part of the error of speed, from unsolved steps"
    return [
        Variable("total_work", (), walk.work[-1], "J", "of the motors"),
        Variable("total_loss", (), walk.loss[-1], "J", "into the ground"),
        Variable("cost_of_transport", (), transport, "1", of_weight),
        Variable("unaccounted", (), walk.unaccounted, "1", share),
        Variable("unsolved", (), walk.unsolved, "1", "steps that were taken unsolved"),
        Variable("residual", (), walk.residual, "m/s", "largest of a step"),
        Variable("speed_error_of_unsolved", (), walk.unsolved_error, "m/s", unsolved),
    ]


def motion(run: Walked) -> list[Variable]:
    """Return the motion in time: pose, velocity and energies, in three dimensions also
    y, roll, yaw and the states of the engine, from which it is drawn."""
    walk = run.walk
    pose_and_twist = (walk.t, *walk.pose.T, *walk.twist.T)
    columns = dict(zip(UNITS, (*pose_and_twist, walk.work, walk.loss, walk.energy)))
    found = []
    for name, values in {**columns, **(walk.spatial or {})}.items():
        dims = ("t",) if values.ndim == 1 else ("t", "state")
        label = LABELS.get(name, "")
        found.append(Variable(name, dims, values, UNITS.get(name, ""), label))
    return found


class Steps(Cost):
    """Cost of walking; balances counts the time steps, steps those in three dimensions."""

    @property
    def as_balances(self) -> float:
        """Number of balances that take NumPy as long."""
        return STEP * (self.balances - self.steps) + STEP_IN_SPACE * self.steps

    def __str__(self) -> str:
        return (
            f"{self.balances:,} time steps, about {duration(self.seconds)} of computing"
        )


def price(
    scene: WalkerScene, count: int = 1, settling: bool = False, by: str | None = None
) -> Steps:
    """Return the cost of ``count`` scenes like this one, estimated from its first time
    steps.

    Where these take many times as many evaluations as usual, as for robots so light
    that they bounce or stick at every step, the search for a limit cycle is assumed to
    fail."""
    numerics, engine_name = scene.numerics, by or scene.engine
    planar = engine_name == "planar"
    together = min(count, TOGETHER if planar else 1)
    own = isinstance(scene.robot, Mjcf)  # custom machines may have no limit cycle
    most = SETTLING if settling else numerics.duration * scene.gait.frequency
    cycles = min(most, 2 * LIMIT + _speeding_up(scene))
    with located(scene.name):
        chosen = engine(engine_name)
    again = LIMIT * sum(refined.cost for refined in chosen.refined(numerics))
    least = (cycles + again) * numerics.steps * count
    step = STEP if planar else STEP_IN_SPACE
    with located(scene.name), prefer_backend(step * least):
        step_seconds, tries = chosen.step_cost(
            [scene.walker] * together, numerics, PILOT
        )
    vain = IN_VAIN if tries > HARD else MOST_STRIDES if own else 0
    cycles = most + vain if vain else cycles
    steps = (cycles + again) * numerics.steps
    seconds = step_seconds * steps * -(-count // together)
    total = round(steps * count)
    return Steps(total, seconds, BASE, seconds, 0.0 if planar else total)


def _speeding_up(scene: WalkerScene) -> float:
    """Return the number of cycles in which legs bring a body to their speed, at a
    fraction of gravity."""
    if not isinstance(scene.robot, Rhex | Roller):
        return 0.0
    radius, f = (
        np.abs(scene.robot.leg(scene.numerics.elements).points).max(),
        scene.gait.frequency,
    )
    return float(2 * np.pi * radius * f**2 / (PUSHED * 9.81))


@dataclass(frozen=True)
class Walks:
    """Speed of robots, as a question of sweeps."""

    def grid(self, scene: WalkerScene, over: Mapping[str, list[float]]) -> Grid:
        """Return the grid; Refusal if one of some 200 of its points makes no scene, or
        one that no engine here computes."""
        grid = Grid(scene, over, written.tables(scene))
        last = grid.total - 1
        for k in {*range(0, grid.total, max(1, grid.total // 200)), last}:
            scene_ = grid.scene_factory(grid.points[k])
            if k in (0, last):
                refuse_engine(scene_)
        return grid

    def batch_size(self, scene: WalkerScene) -> int:
        # Other engines walk one robot after the other, which also shows progress.
        return TOGETHER if scene.engine == "planar" else 1

    def rows(self, scenes: list[WalkerScene], inner_values: None) -> np.ndarray:
        """Return speed, its error, status and cycles."""
        groups = itertools.groupby(scenes, key=lambda s: (s.numerics, s.engine))
        walks = [
            one for _, group in groups for one in walked(list(group), settling=True)
        ]
        return np.array(
            [
                [w.walk.speed, w.estimate, STATUSES.index(w.walk.status), w.walk.cycles]
                for w in walks
            ]
        )

    def cost(self, grid: Grid) -> Steps:
        ends = (grid.scene_factory(grid.points[k]) for k in (0, grid.total - 1))
        return max(
            (price(s, grid.total, settling=True) for s in ends), key=lambda c: c.seconds
        )

    def variables(
        self, grid: Grid, rows: np.ndarray, dims: tuple[str, ...]
    ) -> tuple[list[Variable], dict]:
        speed, estimate, kinds, cycles = np.moveaxis(rows, -1, 0)
        variables = [
            Variable("speed", dims, speed, "m/s", "mean speed", estimate),
            Variable("status", dims, np.array(STATUSES)[kinds.astype(int)]),
            Variable("cycles", dims, cycles, "1"),
        ]
        return variables, {}


@dataclass(frozen=True)
class Settings:
    """The speed of a robot, m/s, near a walk of its scene. For every setting the
    reference has that setting at `FINEST`."""

    scene: WalkerScene
    runs: int = 1
    near: Walk | None = field(default=None, repr=False)

    about: ClassVar[str] = "the speed"
    unit: ClassVar[str] = "m/s"
    measures: ClassVar[dict[str, str]] = {"error": "of the speed"}

    def check(self) -> None:
        refuse_engine(self.scene)

    def cost(self) -> Steps:
        finest = {
            setting.name: (*setting.values, FINEST[setting.name])
            for setting in SETTINGS
        }
        shares = sum(v / self.scene.numerics.steps for v in finest["steps"])
        shares += sum(0.5 + v / 32 for v in finest["elements"]) + 2 * (
            len(finest["rounding"]) - 1
        )
        one = price(self.scene, settling=True)
        seconds = one.seconds * shares / 2
        balances, steps = (round(x * shares / 2) for x in (one.balances, one.steps))
        return Steps(balances, seconds, BASE, seconds, steps)

    def with_shared_data(self) -> Settings:
        (walk,) = engine(self.scene.engine).walk(
            [self.scene.walker], self.scene.numerics, SETTLING
        )
        return dataclasses.replace(self, near=walk)

    def settings(self) -> list[Setting]:
        order = engine(self.scene.engine).ORDER
        return [
            dataclasses.replace(one, order=order) if one.name == "steps" else one
            for one in SETTINGS
        ]

    def evaluate(self, setting: Setting, value: Any) -> list[np.ndarray]:
        """Return the speed with one setting at another value."""
        value = FINEST[setting.name] if value is None else value
        numerics = dataclasses.replace(self.scene.numerics, **{setting.name: value})
        (walk,) = engine(self.scene.engine).rerun(
            [self.scene.walker], numerics, [self.near], SETTLING
        )
        return [np.array(walk.speed)]

    def errors(
        self, numbers: list[np.ndarray], truth: list[np.ndarray]
    ) -> dict[str, float]:
        return {"error": float(abs(numbers[0] - truth[0]))}

    def choices(self, measured: Measurements) -> list[Variable]:
        """Return for tolerances the coarsest value of each setting from which on the
        error is within, nan if there is none, and the speed."""
        coarsest = np.full((len(measured.settings), len(TOLERANCES)), np.nan)
        for k, setting in enumerate(measured.settings):
            errors = measured.errors["error"][k, : len(setting.values)]
            # From the end: the largest error of a value and all finer ones.
            largest = np.maximum.accumulate(errors[::-1])[::-1]
            for j, tolerance in enumerate(TOLERANCES):
                good = np.flatnonzero(largest <= tolerance)
                if good.size:
                    coarsest[k, j] = measured.values[k, good[0]]
        over = ("setting", "tolerance")
        label = "from which on the error is within the tolerance"
        return [
            Variable("tolerance", ("tolerance",), TOLERANCES, self.unit),
            Variable("coarsest_value", over, coarsest, "", label),
            Variable("speed", (), self.near.speed, self.unit, "of the robot"),
        ]

    def facts(self) -> dict[str, Any]:
        return {}


def refuse_engine(scene: WalkerScene, by: str | None = None) -> None:
    """Refuse an engine that is not available, or does not take the scene."""
    with located(scene.name):
        engine(by or scene.engine).refuse(scene.walker)


def view(scene: WalkerScene):
    """Return the view that draws a walk of three dimensions
    (`rft.terradynamics.walking.view.View`)."""
    from rft.terradynamics.walking.view import View

    return View(scene.walker, scene.numerics)
