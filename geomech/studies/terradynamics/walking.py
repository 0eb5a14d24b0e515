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
from geomech.runs.backend import prefer_backend
from geomech.runs.cost import BASE, Cost, duration
from geomech.runs.runner import runner
from geomech.scenes import write as written
from geomech.scenes.terradynamics.walker import WalkerScene
from geomech.studies.grid import Grid
from geomech.studies.settings import Measurements
from geomech.studies.terradynamics.outcome import OUTCOMES, outcome
from rft.core.metres import GRAVITY
from rft.core.refusal import Refusal, located
from rft.terradynamics.walking import Mjcf, Rhex, Roller, Walk, engine
from rft.terradynamics.walking.planar.stride import MOST_STRIDES
from rft.terradynamics.walking.planar.stride import NEAR as NEAR

PILOT = 0.05  # s of time steps that are timed
STATUSES = ("walking", "stuck", "sunk", "flipped", "airborne")
BATCH = 32  # robots
SETTLING = 3  # cycles from rest in a sweep, before the limit cycle is looked for
# Seconds that a time step is assumed to take NumPy, in the plane and in three
# dimensions.
STEP = 3e-3
STEP_IN_SPACE = 0.165
# Evaluations of forces in a step; the first steps of the built-in robots take 7 to 14.
MANY_EVALUATIONS = 30.0
LEG_ACCELERATION = 0.2  # of a body by much faster legs, over gravity, measured
# Cycles of a failing search for a limit cycle with its errors, many robots at once.
FAILED_SEARCH = 40
SHARE_OF_WALKS = 0.7  # of the computing time; the rest computes the errors
UNITS = {  # of a walk's table
    "t": "s",
    "x": "m",
    "z": "m",
    "pitch": "rad",
    "v_x": "m/s",
    "v_z": "m/s",
    "rate": "rad/s",
    "work": "J",
    "loss": "J",
    "energy": "J",
    "y": "m",
    "roll": "rad",
    "yaw": "rad",
}
LABELS = {
    "pitch": "nose down",
    "states": "of the engine in three dimensions",
    "roll": "left side up",
    "yaw": "to the left",
}
LIMIT = 3  # cycles up to the limit cycle, and as many for each of its errors
SLIP = "1 - distance / distance by which the feet move back in the ground"
SINKAGE = "largest depth of the legs in the ground"
UPHILL = "distance uphill along the slope per cycle"
SETTINGS = (
    Setting("steps", (12, 16, 24, 32, 48, 64, 96), 2, against="limit"),
    Setting("elements", (6, 8, 12, 16, 24, 32), 2, against="limit"),
    Setting("rounding", (8e-3, 4e-3, 2e-3, 1e-3, 5e-4), 1, against="limit"),
)
FINEST = {"steps": 256, "elements": 96, "rounding": 6.25e-5}
TOLERANCES = 10.0 ** -np.arange(1, 5)  # of the speed, m/s


# Walks and their errors.


class Walked(NamedTuple):
    """A walk with the errors of its means.

    walk: as computed by rft. estimate: error of its speed, m/s, the sum of four parts:
    the larger of the changes with two other numbers of steps, and the change with twice
    the elements, each times the factor of
    `rft.terradynamics.walking.engines.Variation`; the distance from the limit cycle;
    and the effect of unsolved steps. lateral, turning: errors of the lateral speed,
    m/s, and of the yaw rate, rad/s, by the changes alone. steps, elements: m/s, the
    parts of the estimate that come from each. along: as the estimate, m/s, of the
    velocity along x. feet, sinkage: errors of the feet's speed, m/s, and of the
    sinkage, m, by the changes alone."""

    walk: Walk
    estimate: float
    lateral: float = 0.0
    turning: float = 0.0
    steps: float = 0.0
    elements: float = 0.0
    along: float = 0.0
    feet: float = 0.0
    sinkage: float = 0.0

    @property
    def slip(self) -> tuple[float, float]:
        """1 - distance / distance of the feet's motion, and its error; nan where no
        foot moves back in the ground."""
        foot_speed = self.walk.foot_speed
        if not foot_speed > 0.0:
            return math.nan, math.nan
        ratio = self.walk.speed / foot_speed
        error = (self.estimate + abs(ratio) * self.feet) / foot_speed
        return 1.0 - ratio, error

    def outcome(self, scene: WalkerScene) -> str:
        """Return the outcome of the walk of a scene
        (`geomech.studies.terradynamics.outcome`)."""
        rise = scene.walker.rise
        return outcome(self.walk, self.along, scene.gait.frequency, rise)

    def uphill(self, scene: WalkerScene) -> tuple[float, float]:
        """Return the distance uphill per cycle of the walk of a scene, m, and its
        error; nan on level ground."""
        rise = scene.walker.rise
        f = scene.gait.frequency
        if rise == 0.0:
            return math.nan, math.nan
        return math.copysign(1.0, rise) * self.walk.speed_along / f, self.along / f


def walked(
    scenes: Sequence[WalkerScene],
    by: str | None = None,
    settling: bool = False,
    progress: Callable | None = None,
) -> list[Walked]:
    """Return the walks of scenes with equal numerics and engines, computed in batches.

    by: the engine, in place of the scenes'. settling: a few cycles from rest suffice,
    unless the ground remembers the steps.
    progress: called with the fraction done."""
    numerics = scenes[0].numerics
    chosen = engine(by or scenes[0].engine)
    walkers = [scene.walker for scene in scenes]
    remembers = any(walker.prints for walker in walkers)
    # On ground that remembers no limit cycle follows the first cycles.
    cycles = SETTLING if settling and not remembers else None
    advance = runner().call

    def report(done: float) -> None:
        progress(SHARE_OF_WALKS * done)

    # Without ``progress`` an engine reports none.
    callback = {"progress": report} if progress else {}
    walks = chosen.walk(walkers, numerics, cycles, advance=advance, **callback)

    means = np.array([_means(walk) for walk in walks])
    changes: dict[str, list[np.ndarray]] = {"steps": [], "elements": []}
    refinements = chosen.variations(numerics)
    for k, refined in enumerate(refinements):
        rerun = chosen.rerun(walkers, refined.numerics, walks, cycles, advance=advance)
        change = np.array([_means(walk) for walk in rerun]) - means
        changes[refined.setting].append(refined.factor * np.abs(change))
        if progress:
            done = (k + 1) / len(refinements)
            progress(SHARE_OF_WALKS + (1.0 - SHARE_OF_WALKS) * done)

    steps = np.max(changes["steps"], axis=0)
    elements = np.max(changes["elements"], axis=0)
    errors = steps + elements
    of_cycles = np.array([walk.drift + walk.unsolved_error for walk in walks])
    errors[:, [0, 3]] += of_cycles[:, None]
    found = []
    for k, walk in enumerate(walks):
        estimate, lateral, turning, along, feet, sinkage = errors[k].tolist()
        of_steps = float(steps[k, 0])
        of_elements = float(elements[k, 0])
        parts = of_steps, of_elements, along, feet, sinkage
        found.append(Walked(walk, estimate, lateral, turning, *parts))
    return found


def _means(walk: Walk) -> tuple[float, ...]:
    """Return the means of a walk that have an error: speed, lateral speed, yaw rate,
    velocity along x, speed of the feet, and sinkage."""
    return (
        walk.speed,
        walk.lateral_speed,
        walk.yaw_rate,
        walk.speed_along,
        walk.foot_speed,
        walk.sinkage,
    )


def cost_of_transport(scene: WalkerScene, walk: Walk) -> float:
    """Return the work of the motors over weight times distance, from rest to the end.

    The distance is the sum of the chords of the cycles. inf for a robot that does not
    move."""
    end = walk.t[-1]
    times = np.append(np.arange(0.0, end, 1 / scene.gait.frequency), end)
    x = walk.pose[:, 0]
    y = np.zeros_like(walk.t)
    if walk.spatial:
        y = walk.spatial["y"]
    dx = np.diff(np.interp(times, walk.t, x))
    dy = np.diff(np.interp(times, walk.t, y))
    distance = np.hypot(dx, dy).sum()
    if not distance > 0.0:
        return math.inf
    weight = scene.robot.mass * GRAVITY
    return float(walk.work[-1] / (weight * distance))


def run(
    scene: WalkerScene,
    by: str | None = None,
    progress: Callable | None = None,
    longest: float = math.inf,
) -> Walked:
    """Return the walk of one scene.

    by: the engine, in place of the scene's. longest: seconds of computing, after which
    the walk is refused if its start from rest is not done yet: that time depends on
    whether a cycle repeats itself, which is not known beforehand."""
    begin = time.process_time()

    def report(done: float) -> None:
        seconds = time.process_time() - begin
        if seconds > longest and done < SHARE_OF_WALKS:
            raise Refusal(
                f"after {longest:.0f} s of computing {done:.0%} is done, and no cycle "
                "repeats",
                instead="lower [numerics] duration, or lift the limit (``longest``)",
            )
        if progress:
            progress(done)

    with located(scene.name):
        return walked([scene], by, progress=report)[0]


# Variables of a walk.


def variables(scene: WalkerScene, run: Walked) -> list[Variable]:
    """Return the means of a walk with their errors, its totals, and its motion."""
    return [*means(scene, run), *totals(scene, run), *steps_of(run), *motion(run)]


def means(scene: WalkerScene, run: Walked) -> list[Variable]:
    """Return the means over the limit cycle."""
    walk = run.walk
    along = "mean speed over the limit cycle, along the heading"
    of_steps = "part of the error of speed, from other numbers of steps"
    of_elements = "part of the error of speed, from twice as many elements"
    periodic = "1 if the limit cycle was found"
    found = [
        Variable("status", (), walk.status, label="how the walk ended"),
        Variable("periodic", (), int(walk.periodic), "1", periodic),
        Variable("speed", (), walk.speed, "m/s", along, run.estimate),
        Variable("speed_error_of_steps", (), run.steps, "m/s", of_steps),
        Variable("speed_error_of_elements", (), run.elements, "m/s", of_elements),
        Variable("frequency", (), scene.gait.frequency, "Hz", "frequency of the gait"),
        Variable("cycles", (), walk.cycles, "1", "computed"),
    ]
    zero = "" if walk.spatial else "in the plane"  # the reason, of a planar walk
    to_the_left = "mean, positive to the left of the heading"
    for name, value, unit, error in (
        ("lateral_speed", walk.lateral_speed, "m/s", run.lateral),
        ("yaw_rate", walk.yaw_rate, "rad/s", run.turning),
    ):
        found.append(Variable(name, (), value, unit, to_the_left, error, zero=zero))
    found += fates(scene, run)
    if not math.isnan(walk.settling_time):
        share = f"{100 * NEAR:g} %"
        label = f"time from rest until within {share} of the limit cycle, inf for never"
        found.append(Variable("settling_time", (), walk.settling_time, "s", label))
    return found


def fates(scene: WalkerScene, run: Walked) -> list[Variable]:
    """Return the outcome of a walk, its sinkage, its slip where feet move back in the
    ground, and on a slope the distance uphill."""
    slip, slip_error = run.slip
    found = [
        Variable("outcome", (), run.outcome(scene), label="what becomes of the robot"),
        Variable("sinkage", (), run.walk.sinkage, "m", SINKAGE, run.sinkage),
    ]
    if not math.isnan(slip):
        found.append(Variable("slip", (), slip, "1", SLIP, slip_error))
    if scene.walker.rise:
        uphill, error = run.uphill(scene)
        found.append(Variable("uphill", (), uphill, "m", UPHILL, error))
    return found


def totals(scene: WalkerScene, run: Walked) -> list[Variable]:
    """Return work, loss and cost of transport of the whole walk, and how well its steps
    were solved."""
    walk = run.walk
    transport = cost_of_transport(scene, walk)
    of_weight = "work over weight times distance, from rest"
    share = "share of the work that the steps do not account for"
    unsolved = "part of the error of speed, from steps that did not converge"
    return [
        Variable("total_work", (), walk.work[-1], "J", "work of the motors"),
        Variable("total_loss", (), walk.loss[-1], "J", "work lost to the ground"),
        Variable("cost_of_transport", (), transport, "1", of_weight),
        Variable("unaccounted", (), walk.unaccounted, "1", share),
        Variable(
            "unsolved", (), walk.unsolved, "1", "number of steps that did not converge"
        ),
        Variable("residual", (), walk.residual, "m/s", "largest residual of a step"),
        Variable("speed_error_of_unsolved", (), walk.unsolved_error, "m/s", unsolved),
    ]


def steps_of(run: Walked) -> list[Variable]:
    """Return the steps of a walk on ground that remembers; none on other ground."""
    walk = run.walk
    if walk.step_length is None:
        return []
    progress = "progress in each cycle from rest, along the heading at its start"
    strength = "mean strength of the ground under limbs in it, in each cycle"
    over = ("cycle",)
    return [
        Variable("step_length", over, walk.step_length, "m", progress),
        Variable("step_strength", over, walk.step_strength, "1", strength),
    ]


def motion(run: Walked) -> list[Variable]:
    """Return the motion in time: pose, velocity and energies, in three dimensions also
    y, roll, yaw and the states of the engine, from which it is drawn."""
    walk = run.walk
    pose_and_twist = (walk.t, *walk.pose.T, *walk.twist.T)
    columns = dict(zip(UNITS, (*pose_and_twist, walk.work, walk.loss, walk.energy)))
    if walk.spatial:
        columns.update(walk.spatial)
    found = []
    for name, values in columns.items():
        dims = ("t",) if values.ndim == 1 else ("t", "state")
        label = LABELS.get(name, "")
        found.append(Variable(name, dims, values, UNITS.get(name, ""), label))
    return found


# Cost.


class WalkCost(Cost):
    """Cost of walking: balances counts the time steps."""

    def __str__(self) -> str:
        seconds = duration(self.seconds)
        return f"{self.balances:,} time steps, about {seconds} of computing"


def walk_cost(
    scene: WalkerScene,
    count: int = 1,
    settling: bool = False,
    engine_name: str | None = None,
) -> WalkCost:
    """Return the cost of ``count`` scenes like this one, estimated from its first time
    steps. engine_name: in place of the scene's.

    Where these take many times as many evaluations as usual, as for robots so light
    that they bounce or stick at every step, the search for a limit cycle is assumed to
    fail."""
    numerics = scene.numerics
    name = engine_name or scene.engine
    planar = name == "planar"
    # Other engines walk one robot after the other.
    batch = min(count, BATCH) if planar else 1
    with located(scene.name):
        chosen = engine(name)

    most = numerics.duration * scene.gait.frequency
    if settling and not scene.walker.prints:
        most = SETTLING
    cycles = min(most, 2 * LIMIT + _accelerating_cycles(scene))
    error_cycles = LIMIT * sum(refined.cost for refined in chosen.variations(numerics))

    fewest_steps = (cycles + error_cycles) * numerics.steps * count
    numpy_step = STEP if planar else STEP_IN_SPACE
    with located(scene.name), prefer_backend(numpy_step * fewest_steps):
        walkers = [scene.walker] * batch
        step_seconds, evaluations = chosen.step_cost(walkers, numerics, PILOT)

    if scene.walker.prints:
        # No cycle repeats the last one: all are computed, and so are their errors.
        cycles = math.ceil(most)
        shares = sum(refined.cost for refined in chosen.variations(numerics))
        error_cycles = cycles * shares
    elif evaluations > MANY_EVALUATIONS:
        cycles = most + FAILED_SEARCH
    elif isinstance(scene.robot, Mjcf):
        # Custom machines may have no limit cycle.
        cycles = most + MOST_STRIDES
    steps = (cycles + error_cycles) * numerics.steps
    batches = -(-count // batch)
    seconds = step_seconds * steps * batches
    total = round(steps * count)
    return WalkCost(total, seconds, BASE, seconds, numpy_step * total)


def _accelerating_cycles(scene: WalkerScene) -> float:
    """Return the number of cycles in which rotating legs bring a body to their speed,
    at a fraction of gravity; 0 for other robots."""
    if not isinstance(scene.robot, Rhex | Roller):
        return 0.0
    leg = scene.robot.leg(scene.numerics.elements)
    radius = np.abs(leg.points).max()
    f = scene.gait.frequency
    return float(2 * np.pi * radius * f**2 / (LEG_ACCELERATION * 9.81))


# Sweeps.


@dataclass(frozen=True)
class Walks:
    """Speed, slip, sinkage and outcome of robots, as a question of sweeps."""

    def grid(self, scene: WalkerScene, over: Mapping[str, list[float]]) -> Grid:
        """Return the grid; Refusal if one of some 200 of its points does not yield a
        scene, or if no engine here computes the first and the last."""
        grid = Grid(scene, over, written.tables(scene))
        last = grid.total - 1
        stride = max(1, grid.total // 200)
        for k in {*range(0, grid.total, stride), last}:
            point_scene = grid.scene_factory(grid.points[k])
            if k in (0, last):
                refuse_engine(point_scene)
        return grid

    def batch_size(self, scene: WalkerScene) -> int:
        # Other engines walk one robot after the other, which also shows progress.
        return BATCH if scene.engine == "planar" else 1

    def rows(self, scenes: list[WalkerScene], inner_values: None) -> np.ndarray:
        """Return speed, its error, status and cycles of each scene, slip, sinkage and
        distance uphill with their errors, and outcome, (n, 11)."""
        rows = []
        groups = itertools.groupby(scenes, key=lambda s: (s.numerics, s.engine))
        for _, group in groups:
            members = list(group)
            for scene, one in zip(members, walked(members, settling=True)):
                walk = one.walk
                status = STATUSES.index(walk.status)
                row = [walk.speed, one.estimate, status, walk.cycles]
                row += [*one.slip, walk.sinkage, one.sinkage, *one.uphill(scene)]
                row.append([*OUTCOMES].index(one.outcome(scene)))
                rows.append(row)
        return np.array(rows)

    def cost(self, grid: Grid) -> WalkCost:
        """Return the cost of the grid, as if all points were like its dearer end."""
        costs = []
        for k in (0, grid.total - 1):
            scene = grid.scene_factory(grid.points[k])
            costs.append(walk_cost(scene, grid.total, settling=True))
        return max(costs, key=lambda cost: cost.seconds)

    def variables(
        self, grid: Grid, rows: np.ndarray, dims: tuple[str, ...]
    ) -> tuple[list[Variable], dict]:
        speed, estimate, kinds, cycles, *others = np.moveaxis(rows, -1, 0)
        slip, slip_error, sinkage, sinkage_error, uphill, uphill_error, fates = others
        names = np.array([*OUTCOMES])[fates.astype(int)]
        variables = [
            Variable("speed", dims, speed, "m/s", "mean speed", estimate),
            Variable("status", dims, np.array(STATUSES)[kinds.astype(int)]),
            Variable("cycles", dims, cycles, "1"),
            Variable("slip", dims, slip, "1", SLIP, slip_error),
            Variable("sinkage", dims, sinkage, "m", SINKAGE, sinkage_error),
            Variable("outcome", dims, names, "", "outcome"),
        ]
        if not np.isnan(uphill).all():
            variables.append(
                Variable("uphill", dims, uphill, "m", UPHILL, uphill_error)
            )
        return variables, {}


# Accuracy.


@dataclass(frozen=True)
class Settings:
    """The speed of a robot, m/s, near a walk of its scene, as the subject of accuracy
    studies (`geomech.studies.displacement.accuracy`). For every setting the reference
    has that setting at `FINEST`. near: the walk, once it is computed."""

    scene: WalkerScene
    runs: int = 1
    near: Walk | None = field(default=None, repr=False)

    about: ClassVar[str] = "the speed"
    unit: ClassVar[str] = "m/s"
    measures: ClassVar[dict[str, str]] = {"error": "of the speed"}

    def check(self) -> None:
        refuse_engine(self.scene)

    def cost(self) -> WalkCost:
        values = {}
        for setting in SETTINGS:
            values[setting.name] = (*setting.values, FINEST[setting.name])
        # A walk takes time in proportion to the steps, and half of it to the elements.
        shares = sum(n / self.scene.numerics.steps for n in values["steps"])
        shares += sum(0.5 + n / 32 for n in values["elements"])
        shares += 2 * (len(values["rounding"]) - 1)
        one = walk_cost(self.scene, settling=True)
        seconds = one.seconds * shares / 2
        balances = round(one.balances * shares / 2)
        numpy_seconds = one.numpy_seconds * shares / 2
        return WalkCost(balances, seconds, BASE, seconds, numpy_seconds)

    def with_shared_data(self) -> Settings:
        scene = self.scene
        chosen = engine(scene.engine)
        (walk,) = chosen.walk([scene.walker], scene.numerics, SETTLING)
        return dataclasses.replace(self, near=walk)

    def settings(self) -> list[Setting]:
        order = engine(self.scene.engine).ORDER
        found = []
        for setting in SETTINGS:
            if setting.name == "steps":
                setting = dataclasses.replace(setting, order=order)
            found.append(setting)
        return found

    def evaluate(self, setting: Setting, value: Any) -> list[np.ndarray]:
        """Return the speed with one setting at another value, `FINEST` for None."""
        scene = self.scene
        if value is None:
            value = FINEST[setting.name]
        numerics = dataclasses.replace(scene.numerics, **{setting.name: value})
        chosen = engine(scene.engine)
        (walk,) = chosen.rerun([scene.walker], numerics, [self.near], SETTLING)
        return [np.array(walk.speed)]

    def errors(
        self, numbers: list[np.ndarray], truth: list[np.ndarray]
    ) -> dict[str, float]:
        return {"error": float(abs(numbers[0] - truth[0]))}

    def choices(self, measured: Measurements) -> list[Variable]:
        """Return, for each tolerance and setting, the coarsest value from which on the
        error is within the tolerance, nan if there is none; and the speed."""
        coarsest = np.full((len(measured.settings), len(TOLERANCES)), np.nan)
        for k, setting in enumerate(measured.settings):
            errors = measured.errors["error"][k, : len(setting.values)]
            # From the end: the largest error of a value and all finer ones.
            largest = np.maximum.accumulate(errors[::-1])[::-1]
            for j, tolerance in enumerate(TOLERANCES):
                within = np.flatnonzero(largest <= tolerance)
                if within.size:
                    coarsest[k, j] = measured.values[k, within[0]]
        over = ("setting", "tolerance")
        label = "time after which the error stays within the tolerance"
        return [
            Variable("tolerance", ("tolerance",), TOLERANCES, self.unit),
            Variable("coarsest_value", over, coarsest, "", label),
            Variable("speed", (), self.near.speed, self.unit, "speed of the robot"),
        ]

    def facts(self) -> dict[str, Any]:
        return {}


def refuse_engine(scene: WalkerScene, by: str | None = None) -> None:
    """Refuse an engine that is not available, or that cannot compute the scene. by: the
    engine, in place of the scene's."""
    with located(scene.name):
        engine(by or scene.engine).refuse(scene.walker)


# Pictures.


def view(scene: WalkerScene) -> Any:
    """Return the view that draws a walk of three dimensions
    (`rft.terradynamics.walking.view.View`)."""
    from rft.terradynamics.walking.view import View

    return View(scene.walker, scene.numerics)
