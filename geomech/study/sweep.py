"""A scene over a grid of its own parameters: force balance and error at every point, kept as it goes."""

from __future__ import annotations

import dataclasses
import itertools
import time
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

import numpy as np

from geomech import __version__
from geomech.errors import SceneError, real_array, short
from geomech.files import note
from geomech.kinds import code
from geomech.scene import write as written
from geomech.scene.model import Scene, checked_scene
from geomech.scene.read import from_tables
from geomech.study import estimate, kept, uncertainty
from geomech.study.batch import beside, kind
from geomech.study.cost import Cost, direct, of_medium, price
from geomech.study.results import Swept
from geomech.study.tables import of_pose
from rft import SOLVER

LARGEST = 1_000_000  # points
SAMPLES_TOGETHER = 64  # gaits run side by side: enough to fill the solver, few enough to lose little when stopped
AMPLITUDE = "gait.amplitude"
FREQUENCIES = "gait", "physical", "effects", "frequency"  # sections that have one, and its key
LENGTHS = "body", "physical", "system", "length"
SAVE_EVERY = 2.0  # seconds between savings of what there is, and more where saving takes long:
PATIENCE = 20  # times as long


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
    scene: Scene, over: Mapping[str, list[float]], partial: Path | None = None, progress: Callable | None = None
) -> dict:
    """{"over": {parameter: values}, "displacement": (N_1, ..., 3), "estimate": (N_1, ...), "estimate_heading": (N_1, ...)}
    by the direct tier; estimates as in `estimate.direct`. Where the swimmer has a frequency also {"frequency": (N_1, ...),
    Hz, "speed": (N_1, ...)}, the net distance times it; where the medium is uncertain {"medium_error": (N_1, ...), of the
    position, body lengths, "medium_error_heading": (N_1, ...), rad} (`geomech.study.uncertainty`).

    Points that differ in the gait or in what effects let differ within a batch (`batched` in rft/effects) go through the
    solver together. partial: a file that keeps what is done (`geomech.study.kept`) and is taken up again when the same sweep is
    asked for; it is the caller's to remove, once the results are saved. SceneError if a point of the grid makes no scene.
    """
    tables, names, values, points = _grid(scene, over)
    shape, amplitudes = tuple(map(len, values.values())), values.get(AMPLITUDE)
    solved = tuple(1 if name in _idle(scene, names) else n for name, n in zip(names, shape))
    if not (partial is None or (isinstance(partial, (str, Path)) and str(partial))):
        raise SceneError(f"partial must be the path of a file, got {short(partial)}")
    partial = partial and Path(partial)
    told, doubtful = progress or (lambda fraction: None), uncertainty.uncertain(scene.system)
    with Rows(partial, question(scene, values), int(np.prod(solved))) as rows:
        while len(rows) < rows.total:
            k, done = divmod(len(rows), len(amplitudes or [0]))  # points, of which amplitudes run fastest
            first = _scene_at(tables, scene, names, points[k])
            most = min(SAMPLES_TOGETHER, first.system.at_once(first.numerics.phases))
            beyond = points[k + 1 : k + max(1, most // len(amplitudes or [0]))] if done == 0 else []
            batch = [first, *(_scene_at(tables, scene, names, p) for p in beyond)]
            rows.add(_rows(batch, amplitudes[done : done + most] if amplitudes else None))
            told(len(rows) / rows.total * (0.4 if doubtful else 1.0))
    flat = np.array(list(rows))
    if doubtful:
        at = lambda point: _scene_at(tables, scene, names, point)
        flat = np.column_stack([flat, _doubts(at, points, amplitudes, lambda done: told(0.4 + 0.6 * done))])
    flat = flat.reshape(*solved, -1)
    flat = np.broadcast_to(flat, (*shape, flat.shape[-1]))
    back = [names.index(k) for k in over]
    flat = np.transpose(flat, (*back, len(shape)))
    errors = {"estimate": flat[..., 3], "estimate_heading": flat[..., 4]}
    if doubtful:
        errors |= {"medium_error": flat[..., 5], "medium_error_heading": flat[..., 6]}
    results = {"over": {k: values[k] for k in over}, "displacement": flat[..., :3], **errors}
    return Swept({**results, **_speeds(scene, results)}, scene)


def _idle(scene: Scene, names: Iterable[str]) -> list[str]:
    """The parameters that change no displacement: the frequency, where no effect has one."""
    timed = [f"{section}.frequency" for section in ("gait", "physical")]
    return [name for name in names if name in timed and scene.system.frequency is None]


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
    total = len(points) * len(values.get(AMPLITUDE, [0]))
    some = [_scene_at(tables, scene, names, points[k]) for k in {0, len(points) // 2, len(points) - 1}]
    jobs = [direct(s, s.gait, total, s.numerics.phases, SAMPLES_TOGETHER) + of_medium(s, s.gait, total) for s in some]
    each = list(map(price, jobs))
    balances, seconds, memory = np.array(each).T
    return Cost(round(balances.mean()), float(seconds.mean()), float(memory.max()))


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
    total = int(np.prod([len(v) for v in values.values()])) if names else 0
    if not 0 < total <= LARGEST:
        raise SceneError(f"--over must span 1 to {LARGEST} points, got {total}")
    outer = [values[k] for k in names if k != AMPLITUDE]
    tables = written.tables(scene)
    if any(name.startswith("medium.") for name in names):
        tables = written.spelled_out(tables, scene)
    for corner in _corners(outer):
        at = _scene_at(tables, scene, names, corner)  # refuse before computing
        if uncertainty.uncertain(at.system):
            uncertainty.sigma_points(at)
    idle = _idle(scene, names)
    some = [values[k][:1] if k in idle else values[k] for k in names if k != AMPLITUDE]
    return tables, names, values, list(itertools.product(*some))


def listed(name: str, values) -> list[float]:
    array = real_array(name, values)
    if array.ndim != 1 or not np.isfinite(array).all():
        raise SceneError(f"--over {name}: values must be a list of finite numbers, got {short(values)}")
    return array.tolist()


def partial(scene: Scene, over: Mapping[str, list[float]], output: Path) -> Path:
    """The file that keeps what is done of this sweep to ``output``; SceneError as from `sweep`."""
    return kept.beside(output, question(scene, _grid(scene, over)[2]))


def question(scene: Scene, values: Mapping[str, list[float]]) -> dict:
    """All that the numbers of a sweep follow from: the code, the scene, and the parameters' values by name, in order."""
    system = scene.system
    of_system = {f.name: repr(getattr(system, f.name)) for f in dataclasses.fields(system) if f.name != "solver"}
    numerics = f"{scene.numerics}, {system.solver}"
    parts = {"system": system.kind, **of_system, "gait": repr(scene.gait), "numerics": numerics}
    own = {"own code": code()} if code() else {}
    over = [[name, list(x)] for name, x in values.items()]
    return {"geomech": __version__, "solver": SOLVER, **own, "scene": scene.text, **parts, "over": over}


class Rows(list):
    """The rows done so far, saved to ``path`` every now and then, and when computing ends for whatever reason."""

    def __init__(self, path: Path | None, question: dict, total: int):
        super().__init__(kept.taken_up(path, question, total))
        self.path, self.question, self.total, self.saved, self.told = path, question, total, len(self), False
        self.due = time.monotonic() + SAVE_EVERY

    def add(self, rows: list) -> None:
        self += rows
        if time.monotonic() > self.due:
            self._save()

    def _save(self) -> None:
        """A disk that is full now is no reason to lose what is computed."""
        start = time.monotonic()
        if self.path and len(self) > self.saved:
            try:
                kept.keep(self.path, self.question, list(self))
                self.saved = len(self)
            except (SceneError, OSError) as error:
                if not self.told:
                    note(f"what is done of the sweep is not kept: {error}")
                self.told = True
        now = time.monotonic()
        self.due = now + max(SAVE_EVERY, PATIENCE * (now - start))

    def __enter__(self) -> Rows:
        return self

    def __exit__(self, kind, error, _) -> None:
        self._save()
        if error and self.path and self.saved:
            told = f"{self.saved} of {self.total} points are kept in {self.path}: the same command goes on from there"
            error.add_note(told)


def _corners(outer: list[list[float]]):
    """The grid's corners, and every value of each parameter with the others at their first."""
    yield from itertools.product(*([v[0], v[-1]] for v in outer))
    for k, values in enumerate(outer):
        yield from ([*(v[0] for v in outer[:k]), x, *(v[0] for v in outer[k + 1 :])] for x in values)


def _scene_at(tables: dict, scene: Scene, names, point) -> Scene:
    for name, value in zip(names, point):
        tables = changed(tables, name, value)
    return from_tables(tables, scene.name, scene.text)


def _rows(scenes: list[Scene], amplitudes) -> list:
    """[[x, y, theta, error, error of theta], ...] for all amplitudes of every scene, those that fit into one batch
    together."""
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


def _doubts(at: Callable, points, amplitudes: list[float] | None, progress: Callable) -> np.ndarray:
    """What the medium's uncertainty does to the positions, body lengths, and headings, rad, of every point: (N, 2). at: gives
    the scene at a point. These are not kept: they are soon computed anew, beside the rest."""
    size, rows = max(1, SAMPLES_TOGETHER // len(amplitudes or [0])), []
    for k in range(0, len(points), size):
        scenes = [at(p) for p in points[k : k + size]]
        for j in range(0, len(amplitudes or [0]), SAMPLES_TOGETHER):  # one point alone where there are so many
            rows += _together(scenes, amplitudes and amplitudes[j : j + SAMPLES_TOGETHER], _doubt)
        progress(min(1.0, (k + size) / len(points)))
    return np.array(rows)


def _doubt(joined: Scene) -> np.ndarray:
    found = uncertainty.of_medium(joined, joined.gait, None)
    return np.column_stack([found["position"] / joined.system.length, found["heading"]])
