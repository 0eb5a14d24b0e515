"""Questions to scenes of walking robots: how they walk, with the error of the speed; grids of parameters; what accuracy
costs."""

from __future__ import annotations

import dataclasses
import itertools
import math
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from geomech.core.errors import SceneError, named
from geomech.run import jobs
from geomech.run.backend import preferred, suiting
from geomech.run.cost import BASE, Cost
from geomech.scene import write as written
from geomech.scene.read import from_tables
from geomech.scene.walker import WalkerScene
from geomech.study.sweep import LARGEST, Points, changed, listed, stored_in
from rft.laws.catalogue import GRAVITY
from rft.walking import Mjcf, Rhex, Roller, Walk, engine
from rft.walking.stride import MOST_STRIDES
from rft.walking.stride import NEAR as NEAR

PILOT = 0.05  # s of time steps that tell how long others take
STATUSES = ("walking", "stuck", "sunk", "flipped", "airborne")
TOGETHER = 32  # robots side by side
SETTLING = 3  # cycles from rest in a sweep, before the limit cycle is looked for
PER_STEP = {"numpy": 2.2e-3, "numba": 2e-4}  # s of computing, for a robot by itself,
MORE = {"numpy": 0.23, "numba": 1.0}  # of that for each beside it, measured
STEP = 200.0  # balances, of time by NumPy
ALONE = 5e-3  # s, in three dimensions,
OWN = 3e-2  # and of a machine of one's own, whose wheels stick and slip: 5e-3 to 5e-2 measured
HARD = 30.0  # evaluations of forces in a step; the first steps of the built-in robots take 7 to 14
PUSHED = 0.2  # of gravity, by which legs that are much faster than the body speed it up, measured
IN_VAIN = 40  # cycles that a search for a limit cycle and its errors take where there is none, many at once
TO_COME = 1.5  # times what twice the elements change: all that more would; up to 1.49 measured, 4/3 of order 2
WALKING = 0.7  # of the time, before the errors are asked for
LIMIT = 3  # cycles on the way to the limit cycle, and half as many for each of two errors
KNOBS = {
    "steps": (12, 16, 24, 32, 48, 64, 96),
    "elements": (6, 8, 12, 16, 24, 32),
    "rounding": (8e-3, 4e-3, 2e-3, 1e-3, 5e-4),
}
FINEST = {"steps": 256, "elements": 96, "rounding": 6.25e-5}
ORDERS = {"steps": 2, "elements": 2, "rounding": 1}
TOLERANCES = 10.0 ** -np.arange(1, 5)


class Walked(NamedTuple):
    """walk: as rft has it. estimate: error of its speed, m/s: what half or three quarters of the steps change, the larger, for
    one alone may be small by chance; `TO_COME` times what twice the elements change; what is left to the limit, and what
    steps that are not solved move. aside, turning: errors of those of the walk, m/s and rad/s, by the changes alone.
    elements: m/s, what of the estimate comes from twice the elements."""

    walk: Walk
    estimate: float
    aside: float = 0.0
    turning: float = 0.0
    elements: float = 0.0


def walked(
    scenes: Sequence[WalkerScene], by: str | None = None, settling: bool = False, progress: Callable | None = None
) -> list[Walked]:
    """Scenes of equal numerics and engines, side by side. settling: a few cycles from rest are enough. progress: told the
    fraction done."""
    numerics, how, walkers = scenes[0].numerics, engine(by or scenes[0].engine), [s.walker for s in scenes]
    told = {"progress": lambda done: progress(WALKING * done)} if progress else {}
    walks = how.walk(walkers, numerics, SETTLING if settling else None, advance=jobs.runner().call, **told)
    others = [("steps", max(8, numerics.steps // 2)), ("steps", max(8, 3 * numerics.steps // 4))]
    others += [("elements", min(1000, 2 * numerics.elements))]
    changes = []
    for k, (name, other) in enumerate(others):
        finer = dataclasses.replace(numerics, **{name: other})
        there = how.rerun(walkers, finer, walks, SETTLING if settling else None, advance=jobs.runner().call)
        changes.append(np.abs([np.subtract(_means(a), _means(b)) for a, b in zip(there, walks)]))
        if progress:
            progress(WALKING + (1.0 - WALKING) * (k + 1) / len(others))
    half, most, finer = changes
    error = np.maximum(half, most) + TO_COME * finer
    error[:, 0] += [w.drift + w.unsolved_error for w in walks]
    return [Walked(w, *e, TO_COME * float(x)) for w, e, x in zip(walks, error.tolist(), finer[:, 0])]


def _means(walk: Walk) -> tuple[float, float, float]:
    """What is told of a walk with an error."""
    return walk.speed, walk.lateral_speed, walk.yaw_rate


def cost_of_transport(scene: WalkerScene, walk: Walk) -> float:
    """Work of the motors over weight times way, from rest to the end; the way is in the chords of the cycles. inf of one that
    makes none."""
    at = np.append(np.arange(0.0, walk.t[-1], 1 / scene.gait.frequency), walk.t[-1])
    y = walk.spatial["y"] if walk.spatial else np.zeros_like(walk.t)
    way = np.hypot(*(np.diff(np.interp(at, walk.t, x)) for x in (walk.pose[:, 0], y))).sum()
    return float(walk.work[-1] / (scene.robot.mass * GRAVITY * way)) if way > 0.0 else math.inf


def run(
    scene: WalkerScene, by: str | None = None, progress: Callable | None = None, longest: float = math.inf
) -> Walked:
    """One scene. longest: s of computing, after which SceneError where the way from rest is not yet done: how long that takes
    hangs on whether a cycle repeats itself, which nobody knows before."""
    begin = time.process_time()

    def told(done: float) -> None:
        if time.process_time() - begin > longest and done < WALKING:
            cure = "lower [numerics] duration, or say --yes"
            raise SceneError(
                f"after {longest:.0f} s of computing {done:.0%} is done, and no cycle repeats itself: {cure}"
            )
        if progress:
            progress(done)

    with named(scene.name):
        return walked([scene], by, progress=told)[0]


class Steps(Cost):
    """What walking costs; balances counts the time steps."""

    @property
    def as_balances(self) -> float:
        """A time step takes NumPy as long as some 200 balances."""
        return STEP * self.balances

    def __str__(self) -> str:
        return f"{self.balances:,} time steps, about {max(1.0, self.seconds):.0f} s of computing"


def price(scene: WalkerScene, count: int = 1, settling: bool = False, by: str | None = None) -> Steps:
    """Of ``count`` scenes like this one, from its first time steps. Where these are many times as hard as others, of robots
    that are so light that they bounce or stick at every step, the search for a limit cycle is taken to be in vain."""
    numerics, how = scene.numerics, by or scene.engine
    planar = how == "planar"
    together = TOGETHER if planar else 1
    own = isinstance(scene.robot, Mjcf)  # which may never come to a limit cycle
    most = SETTLING if settling else numerics.duration * scene.gait.frequency
    cycles = min(most, 2 * LIMIT + _speeding_up(scene))
    least = (cycles + 2.75 * LIMIT) * numerics.steps * count
    with named(scene.name), suiting(STEP * least if planar else 0.0):
        per_step, more = PER_STEP[preferred()], MORE[preferred()]
        usual = (OWN if own else per_step if planar else ALONE) * (0.5 + numerics.elements / 32)
        pace, tries = engine(how).step_cost(scene.walker, numerics, PILOT)
    vain = IN_VAIN if tries > HARD else MOST_STRIDES if own else 0
    cycles = most + vain if vain else cycles
    steps, batches = (cycles + 2.75 * LIMIT) * numerics.steps, -(-count // together)
    each = usual if together > 1 and tries <= HARD else max(pace, usual)
    seconds = each * steps * (batches + (count - batches) * more)
    return Steps(round(steps * count), seconds, BASE, seconds)


def _speeding_up(scene: WalkerScene) -> float:
    """Cycles till legs have brought a body to their speed, at a fraction of gravity."""
    if not isinstance(scene.robot, Rhex | Roller):
        return 0.0
    reach, f = np.abs(scene.robot.leg(scene.numerics.elements).points).max(), scene.gait.frequency
    return float(2 * np.pi * reach * f**2 / (PUSHED * 9.81))


def sweep(
    scene: WalkerScene,
    over: Mapping,
    partial: Path | None = None,
    progress: Callable | None = None,
    seconds: float | None = None,
) -> dict:
    """{"over": {parameter: values}, "speed", "estimate": (N_1, ...), m/s, "status": (N_1, ...), "cycles": (N_1, ...)}: as
    `geomech.study.sweep.sweep`, which stores what is done."""
    tables, values, points = _grid(scene, over)
    shape, at = tuple(map(len, values.values())), _At(tables, scene, tuple(values))
    together = TOGETHER if scene.engine == "planar" else 1  # others walk one after the other: each tells how far it is
    parts = -(-points.total // together)
    some = ([points[i] for i in range(k, min(k + together, points.total))] for k in range(0, points.total, together))
    with stored_in(partial, scene):
        rows = [row for found in jobs.runner().map(_part, at, some, parts, seconds, progress) for row in found]
    speed, estimate, kinds, cycles = np.moveaxis(np.reshape(rows, (*shape, 4)), -1, 0)
    status = np.array(STATUSES)[kinds.astype(int)]
    return {"over": values, "speed": speed, "estimate": estimate, "status": status, "cycles": cycles}


class _At(NamedTuple):
    """The scene at a point of a grid."""

    tables: dict
    scene: WalkerScene
    names: tuple[str, ...]

    def __call__(self, point) -> WalkerScene:
        tables = self.tables
        for name, value in zip(self.names, point):
            tables = changed(tables, name, value)
        return from_tables(tables, self.scene.name, self.scene.text)


def _part(at: _At, points: list) -> list[list[float]]:
    """Rows of some points: speed, its error, status, cycles."""
    alike = itertools.groupby(map(at, points), key=lambda s: (s.numerics, s.engine))
    found = [one for _, some in alike for one in walked(list(some), settling=True)]
    return [[w.walk.speed, w.estimate, STATUSES.index(w.walk.status), w.walk.cycles] for w in found]


def cost_of_sweep(scene: WalkerScene, over: Mapping) -> Steps:
    """Of `sweep`; SceneError if a point of the grid makes no scene."""
    tables, values, points = _grid(scene, over)
    at = _At(tables, scene, tuple(values))
    some = [at(points[0]), at(points[points.total - 1])]
    for one in some:
        refuse_engine(one)
    return max((price(s, points.total, settling=True) for s in some), key=lambda c: c.seconds)


def _grid(scene: WalkerScene, over: Mapping):
    """(tables of the scene, values by parameter, points); SceneError if a point of the grid makes no scene."""
    values = {k: listed(k, v) for k, v in over.items()}
    total = math.prod(map(len, values.values()))
    if not 0 < total <= LARGEST:
        raise SceneError(f"--over must span 1 to {LARGEST:,} points, got {total:,}")
    tables = written.tables(scene)
    points, at = Points(list(values.values())), _At(tables, scene, tuple(values))
    for k in {*range(0, points.total, max(1, points.total // 200)), points.total - 1}:
        at(points[k])
    return tables, values, points


def study(scene: WalkerScene, progress: Callable | None = None) -> dict:
    """{"scene", "speed", "lines": [{"label", "order", "value", "error", "seconds", "slope"}], "cheapest"}: error of the speed,
    m/s, against one as far refined as `FINEST`, for every knob. Seconds are of one thread's computing. Who computes:
    `geomech.run.workers`."""
    (walk,) = engine(scene.engine).walk([scene.walker], scene.numerics, SETTLING)
    asked = [(name, value) for name, settings in KNOBS.items() for value in (FINEST[name], *settings)]
    common = scene.engine, scene.walker, scene.numerics, walk
    found = jobs.runner().map(_answer, common, asked, len(asked), progress=progress)
    lines = []
    for name, settings in KNOBS.items():
        truth, _ = next(found)
        speeds, seconds = zip(*(next(found) for _ in settings))
        errors = [abs(speed - truth) for speed in speeds]
        slope = np.polyfit(np.log(settings), np.log(np.maximum(errors, 1e-15)), 1)[0] * (
            1 if name == "rounding" else -1
        )
        line = {"label": name, "order": ORDERS[name], "value": list(settings), "error": errors}
        lines.append({**line, "seconds": list(seconds), "slope": float(slope)})
    return {
        "scene": scene.name,
        "speed": walk.speed,
        "lines": lines,
        "cheapest": [_cheapest(lines, t) for t in TOLERANCES],
    }


def _answer(common: tuple, setting: tuple[str, float]) -> tuple[float, float]:
    """(speed, seconds) of (engine, walker, numerics, its walk) with one knob at another value."""
    (by, walker, numerics, walk), (name, value) = common, setting
    start = time.thread_time()
    (found,) = engine(by).rerun([walker], dataclasses.replace(numerics, **{name: value}), [walk], SETTLING)
    return found.speed, time.thread_time() - start


def _cheapest(lines, tolerance: float) -> dict:
    """For each knob the coarsest setting from which on the error is within the tolerance, m/s; None if there is none."""
    found = {}
    for line in lines:
        good = [v for k, v in enumerate(line["value"]) if max(line["error"][k:]) <= tolerance]
        found[line["label"]] = good[0] if good else None
    return {"tolerance": float(tolerance), **found}


def cost(scene: WalkerScene) -> Steps:
    """Of `study`."""
    refuse_engine(scene)
    shares = sum(v / scene.numerics.steps for v in (*KNOBS["steps"], FINEST["steps"]))
    shares += sum(0.5 + v / 32 for v in (*KNOBS["elements"], FINEST["elements"])) + 2 * len(KNOBS["rounding"])
    one = price(scene, settling=True)
    seconds = one.seconds * shares / 2
    return Steps(round(one.balances * shares / 2), seconds, BASE, seconds)


def table(results: dict) -> str:
    """The coarsest settings by tolerance, as plain text."""
    names = [line["label"] for line in results["lines"]]
    rows = [f"speed {results['speed']:.6g} m/s", "error (m/s) " + " ".join(f"{n:>10}" for n in names)]
    for c in results["cheapest"]:
        rows.append(f"{c['tolerance']:11.0e} " + " ".join(f"{'-' if c[n] is None else c[n]:>10}" for n in names))
    return "\n".join(rows)


def sentences(results: dict) -> list[str]:
    """One sentence a knob: from its coarsest setting to the finest, and the measured order."""
    out = []
    for line in results["lines"]:
        e, v = line["error"], line["value"]
        sizes = f"error of the speed {e[0]:.1e} to {e[-1]:.1e} m/s"
        out.append(
            f"{line['label']} {v[0]:g} to {v[-1]:g}: {sizes} (measured order {line['slope']:.1f}; declared: {line['order']})."
        )
    return out


def refuse_engine(scene: WalkerScene, by: str | None = None) -> None:
    """SceneError unless there is such an engine here, and it takes the scene."""
    with named(scene.name):
        engine(by or scene.engine).refuse(scene.walker)


def view(scene: WalkerScene):
    """What draws a walk of three dimensions (`rft.walking.view.View`)."""
    from rft.walking.view import View

    return View(scene.walker, scene.numerics)
