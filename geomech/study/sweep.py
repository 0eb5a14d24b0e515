"""A scene over a grid of its own parameters: force balance and error at every point, kept as it goes."""

from __future__ import annotations

import contextlib
import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from geomech.core.errors import SceneError, real_array, short
from geomech.run.cost import Cost
from geomech.run.jobs import context_of, runner, storing
from geomech.scene import write as written
from geomech.scene.model import Scene, checked_scene
from geomech.scene.read import from_tables, inputs
from geomech.study import estimate, uncertainty
from geomech.study.batch import beside, kind
from geomech.study.cost import direct, of_medium, price
from geomech.study.results import Swept
from geomech.study.tables import of_pose
from geomech.systems.base import length_unit
from geomech.systems.capabilities import at_once

LARGEST = 100_000_000  # points
HELD = 200  # bytes of a point: its row, and what becomes of it on the way to a file
MAKING = 3e-4  # s that a scene takes to be made of its tables; assumed
SAMPLES_TOGETHER = 64  # gaits run side by side: enough to fill the solver, few enough to lose little when stopped
WIDTH = 5  # numbers of a point: x, y, theta and the errors of position and heading
AMPLITUDE = "gait.amplitude"
FREQUENCIES = "gait", "physical", "effects", "frequency"  # sections that have one, and its key


def changed(tables: dict, parameter: str, value: float) -> dict:
    """The tables with one parameter set: "section.key", "effects.KIND.key" for an effect that is on, or
    "effects.key" for all effects that give that key."""
    parts = parameter.split(".")
    within = tables.get("robot", {}).get(parts[1]) if len(parts) == 3 and parts[0] == "robot" else None
    if isinstance(within, dict):  # a table inside a table
        inner = changed({"robot": within}, f"robot.{parts[2]}", value)
        return {**tables, "robot": {**tables["robot"], parts[1]: inner["robot"]}}
    if len(parts) == 2 and parts[0] in ("medium", "body", "gait", "numerics", "system", "physical", "robot"):
        old = tables.get(parts[0], {}).get(parts[1])
        tables = {**tables, parts[0]: {k: v for k, v in tables.get(parts[0], {}).items() if k != _twin(parts[1])}}
        value = int(value) if isinstance(old, int) and not isinstance(old, bool) and value == int(value) else value
        return {**tables, parts[0]: {**tables.get(parts[0], {}), parts[1]: value}}
    if len(parts) == 2 and parts[0] == "effects":
        effects = tables.get("effects", [])
        if any(parts[1] in e for e in effects):
            return {**tables, "effects": [{**e, parts[1]: value} if parts[1] in e else e for e in effects]}
        raise SceneError(f"--over {parameter}: no effect of the scene gives {parts[1]!r}: name the effect, or add it")
    if len(parts) == 3 and parts[0] == "effects":
        effects = tables.get("effects", [])
        if any(e.get("kind") == parts[1] for e in effects):
            return {**tables, "effects": [{**e, parts[2]: value} if e["kind"] == parts[1] else e for e in effects]}
        raise SceneError(f"--over {parameter}: the scene has no effect {parts[1]!r}: add it as [[effects]]")
    raise SceneError(
        f"--over {parameter}: name a parameter such as gait.amplitude, medium.C or effects.end-caps.radius"
    )


def _twin(key: str) -> str:
    """The key that gives the same in degrees, or in rad."""
    return key.removesuffix("_deg") if key.endswith("_deg") else f"{key}_deg"


def sweep(
    scene: Scene,
    over: Mapping[str, list[float]],
    partial: Path | None = None,
    progress: Callable | None = None,
    seconds: float | None = None,
) -> dict:
    """{"over": {parameter: values}, "displacement": (N_1, ..., 3), "estimate": (N_1, ...), "estimate_heading": (N_1, ...)}
    by the direct tier; estimates as in `estimate.direct`, in the unit of the displacement and rad. "length": (N_1, ...), of
    the body, and "units": {key: unit}. Where the swimmer has a frequency also {"frequency": (N_1, ...), Hz, "speed":
    (N_1, ...)}, the net distance times it; where the medium is uncertain {"medium_error": (N_1, ...), of the position,
    "medium_error_heading": (N_1, ...), rad} (`geomech.study.uncertainty`).

    Points that differ in the gait or in what effects let differ within a batch (`batched` in rft/effects) go through the
    solver together. partial: a file in which what is done is stored, so that the same sweep resumes; it is the caller's to
    remove, once the results are saved. seconds: what `cost` has said, if it was asked: others begin sooner. Who computes:
    `geomech.run.workers`. SceneError if a point of the grid makes no scene.
    """
    tables, names, values, points = _grid(scene, over)
    shape, amplitudes = tuple(map(len, values.values())), values.get(AMPLITUDE)
    solved = tuple(1 if name in _idle(scene, names) else n for name, n in zip(names, shape))
    at = _At(tables, scene, tuple(names))
    parts = -(-points.total * len(amplitudes or [0]) // SAMPLES_TOGETHER)
    doubtful = uncertainty.uncertain(scene.system)
    rows, done = np.empty((int(np.prod(solved)), WIDTH + 2 * doubtful)), 0
    with stored_in(partial, scene):
        for found in runner().map(_part, at, _parts(at, points, amplitudes), parts, seconds):
            rows[done : done + len(found)] = found
            done += len(found)
            if progress:
                progress(done / len(rows))
    flat = rows.reshape(*solved, -1)
    flat = np.broadcast_to(flat, (*shape, flat.shape[-1]))
    back = [names.index(k) for k in over]
    flat = np.transpose(flat, (*back, len(shape)))
    length, over = lengths(at, values, over), {k: values[k] for k in over}
    errors = {"estimate": length * flat[..., 3], "estimate_heading": flat[..., 4], "length": length}
    if doubtful:
        errors |= {"medium_error": length * flat[..., 5], "medium_error_heading": flat[..., 6]}
    results = {"over": over, "displacement": flat[..., :3], **errors}
    results |= _speeds(scene, results)
    return Swept({**results, "units": _units(scene, results)}, scene)


def stored_in(partial: Path | None, scene) -> contextlib.AbstractContextManager:
    """Store what is done of a sweep in a file, if one is given; it stays until the caller removes it."""
    if partial is None:
        return contextlib.nullcontext()
    if not (isinstance(partial, (str, Path)) and str(partial)):
        raise SceneError(f"partial must be the path of a file, got {short(partial)}")
    return storing(Path(partial), context_of(inputs(scene)), Path(partial), keep=True)


def lengths(at: _At, values: Mapping[str, list[float]], names: Iterable[str]) -> np.ndarray:
    """The body's length (N_1, ...) at the points of a sweep over these parameters, of which each multiplies it or does not."""
    first = {name: x[0] for name, x in values.items()}
    of = lambda name, x: at([*{**first, name: x}.values()]).system.length
    length = at([*first.values()]).system.length
    found = np.array(length)
    for name in names:
        other = next((x for x in values[name] if x != first[name]), first[name])
        fixed = name == AMPLITUDE or of(name, other) == length
        along = np.ones(len(values[name])) if fixed else np.array([of(name, x) for x in values[name]]) / length
        found = found[..., None] * along
    return found


def _units(scene: Scene, results: Mapping) -> dict:
    """Of what a sweep has, by key. Lengths are in body lengths where no point has a size."""
    unit = length_unit(scene.system) if np.all(results["length"] == scene.system.length) else "m"
    every = {"displacement": [unit, unit, "rad"], "estimate": unit, "estimate_heading": "rad", "length": unit}
    every |= {"frequency": "Hz", "speed": f"{unit}/s", "medium_error": unit, "medium_error_heading": "rad"}
    return {key: told for key, told in every.items() if key in results}


def _idle(scene: Scene, names: Iterable[str]) -> list[str]:
    """The parameters that change no displacement: the frequency, where no effect has one."""
    timed = [f"{section}.frequency" for section in ("gait", "physical")]
    return [name for name in names if name in timed and scene.system.traits.frequency is None]


def _speeds(scene: Scene, results: dict) -> dict:
    """Frequency and speed at every point, if there is a frequency."""
    frequency = at_points(results["over"], FREQUENCIES, scene.frequency)
    if frequency is None:
        return {}
    return {"frequency": frequency, "speed": of_pose(results["displacement"])["net_distance"] * frequency}


def at_points(over: Mapping[str, list[float]], names: tuple[str, ...], value):
    """The number (N_1, ...) that the points of a sweep have for what goes by one of these names: that parameter's where it
    is swept, else ``value``, None for nothing."""
    for axis, (name, values) in enumerate(over.items()):
        if name.partition(".")[0] in names and name.rpartition(".")[2] == names[-1]:
            values = np.reshape(values, [-1 if k == axis else 1 for k in range(len(over))])
            return np.broadcast_to(values, [len(v) for v in over.values()]).copy()
    return None if value is None else np.full([len(v) for v in over.values()], float(value))


def cost(scene: Scene, over: Mapping[str, list[float]]) -> Cost:
    """Of `sweep`, by some of its points; SceneError as there."""
    tables, names, values, points = _grid(scene, over)
    total, at = points.total * len(values.get(AMPLITUDE, [0])), _At(tables, scene, tuple(names))
    first = [at(points[k]) for k in range(min(points.total, SAMPLES_TOGETHER))]
    together = max(1, min(SAMPLES_TOGETHER, total // points.total * len(first) // len(set(map(kind, first)))))
    some = [at(points[k]) for k in {0, points.total // 2, points.total - 1}]
    jobs = [direct(s, s.gait, total, s.numerics.phases, together) + of_medium(s, s.gait, total, together) for s in some]
    balances, seconds, _, besides = np.mean(list(map(price, jobs)), 0).tolist()
    held = [direct(s, s.gait, min(total, SAMPLES_TOGETHER), s.numerics.phases)[0].memory for s in some]
    making = MAKING * points.total
    return Cost(round(balances), seconds + making, max(held) + HELD * total, besides + making)


def _grid(scene: Scene, over: Mapping[str, list[float]]):
    """(tables of the scene, names of the parameters, their values, points of those other than the amplitude), the
    amplitude last; of what changes no displacement the points have the first value. SceneError if they make no sweep."""
    checked_scene(scene)
    if not (isinstance(over, Mapping) and all(isinstance(k, str) for k in over)):
        raise SceneError(
            f"over must be values by parameter, such as {{'gait.amplitude': [0.5, 1.0]}}, got {short(over)}"
        )
    names = [k for k in over if k != AMPLITUDE] + [k for k in over if k == AMPLITUDE]  # amplitudes innermost: one batch
    values = {k: listed(k, over[k]) for k in names}
    total = math.prod(len(v) for v in values.values()) if names else 0
    if not 0 < total <= LARGEST:
        raise SceneError(f"--over must span 1 to {LARGEST:,} points, got {total:,}")
    outer = [values[k] for k in names if k != AMPLITUDE]
    tables = written.tables(scene)
    if any(name.startswith("medium.") for name in names):
        tables = written.spelled_out(tables, scene)
    for corner in _corners(outer):
        there = _At(tables, scene, tuple(names))(corner)  # refuse before computing
        if uncertainty.uncertain(there.system):
            uncertainty.sigma_points(there)
    idle = _idle(scene, names)
    some = [values[k][:1] if k in idle else values[k] for k in names if k != AMPLITUDE]
    return tables, names, values, Points(some)


class Points:
    """The points of a grid, the last parameter running fastest, none of them held: there may be millions."""

    def __init__(self, axes: list[list[float]]):
        self.axes, self.sizes = axes, tuple(map(len, axes))
        self.total = math.prod(self.sizes)

    def __getitem__(self, k: int) -> tuple[float, ...]:
        return tuple(axis[i] for axis, i in zip(self.axes, np.unravel_index(k, self.sizes))) if self.axes else ()


def listed(name: str, values) -> list[float]:
    array = real_array(name, values)
    if array.ndim != 1 or not np.isfinite(array).all():
        raise SceneError(f"--over {name}: values must be a list of finite numbers, got {short(values)}")
    return array.tolist()


def _corners(outer: list[list[float]]):
    """The grid's corners, and every value of each parameter with the others at their first."""
    yield from itertools.product(*([v[0], v[-1]] for v in outer))
    for k, values in enumerate(outer):
        yield from ([*(v[0] for v in outer[:k]), x, *(v[0] for v in outer[k + 1 :])] for x in values)


class _At(NamedTuple):
    """The scene at a point of a grid."""

    tables: dict
    scene: Scene
    names: tuple[str, ...]

    def __call__(self, point) -> Scene:
        tables = self.tables
        for name, value in zip(self.names, point):
            tables = changed(tables, name, value)
        return from_tables(tables, self.scene.name, self.scene.text)


def _parts(at: _At, points: Points, amplitudes: list[float] | None) -> Iterator[tuple]:
    """What is solved together, in order: (scenes, or their points, amplitudes)."""
    count, total, done = len(amplitudes or [0]), points.total * len(amplitudes or [0]), 0
    while done < total:
        k, j = divmod(done, count)  # points, of which amplitudes run fastest
        first = at(points[k])
        most = min(SAMPLES_TOGETHER, at_once(first.system, first.numerics.phases))
        here = range(k, min(k + max(1, most // count), points.total) if j == 0 else k + 1)
        some = amplitudes[j : j + most] if amplitudes else None
        batch = [points[i] for i in here]
        yield [at(p) for p in batch] if at.scene.files else batch, some  # files need not be where it is computed
        done += len(here) * len(some or [0])


def _part(at: _At, part: tuple) -> np.ndarray:
    """Rows of a part."""
    batch, amplitudes = part
    scenes = [p if isinstance(p, Scene) else at(p) for p in batch]
    rows = np.array(_rows(scenes, amplitudes))
    if uncertainty.uncertain(at.scene.system):
        rows = np.column_stack([rows, _together(scenes, amplitudes, _doubt)])
    return rows


def _rows(scenes: list[Scene], amplitudes) -> list:
    """[[x, y, theta, error, error of theta], ...] for all amplitudes of every scene, those that fit into one batch together;
    errors in body lengths and rad."""
    solve = lambda joined: np.column_stack(estimate.direct(joined, joined.gait, None, joined.numerics.phases))
    return _together(scenes, amplitudes, solve)


def _together(scenes: list[Scene], amplitudes, solve: Callable) -> list:
    """Rows of solve(scenes side by side), as many as there are amplitudes, of every scene."""
    groups: dict = {}
    for k, scene in enumerate(scenes):
        groups.setdefault(kind(scene), []).append(k)
    rows: list = [None] * len(scenes)
    for members in groups.values():
        found = solve(beside([scenes[k] for k in members], amplitudes))
        for k, part in zip(members, np.split(found, len(members))):
            rows[k] = part.tolist()
    return list(itertools.chain(*rows))


def _doubt(joined: Scene) -> np.ndarray:
    """What the medium's uncertainty does to positions, body lengths, and headings, rad: (N, 2)."""
    found = uncertainty.of_medium(joined, joined.gait, None)
    return np.column_stack([found["position"] / joined.system.length, found["heading"]])
