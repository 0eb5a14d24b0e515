"""A scene over a grid of its own parameters: force balance and error at every point, kept as it goes."""

from __future__ import annotations

import dataclasses
import itertools
import time
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from geomech import __version__
from geomech.errors import SceneError
from geomech.files import note, whole_file
from geomech.gaits import Gait
from geomech.output.netcdf import COMPONENTS, attribute
from geomech.scene import write as written
from geomech.scene.model import Scene
from geomech.scene.read import from_tables
from geomech.study import estimate, kept
from geomech.study.cost import Cost, direct, price
from geomech.systems import Swimmer
from rft import SOLVER
from rft.effects import side_by_side

LARGEST = 1_000_000  # points
SAMPLES_TOGETHER = 64  # gaits run side by side: enough to fill the solver, few enough to lose little when stopped
AMPLITUDE = "gait.amplitude"
SAVE_EVERY = 2.0  # seconds between savings of what there is, and more where saving takes long:
PATIENCE = 20  # times as long


def changed(tables: dict, parameter: str, value: float) -> dict:
    """The tables with one parameter set: "section.key", "effects.KIND.key" for an effect that is on, or
    "effects.key" for all effects that give that key."""
    parts = parameter.split(".")
    if len(parts) == 2 and parts[0] in ("medium", "body", "gait", "numerics", "system", "physical"):
        old = tables.get(parts[0], {}).get(parts[1])
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


def sweep(
    scene: Scene, over: Mapping[str, list[float]], partial: Path | None = None, progress: Callable | None = None
) -> dict:
    """{"over": {parameter: values}, "displacement": (N_1, ..., 3), "estimate": (N_1, ...), "estimate_heading": (N_1, ...)}
    by the direct tier; estimates as in `estimate.direct`.

    Points that differ in the gait or in what effects let differ within a batch (`batched` in rft/effects) go through the
    solver together. partial: a file that keeps what is done (`geomech.study.kept`) and is taken up again when the same sweep is
    asked for; it is the caller's to remove, once the results are saved. SceneError if a point of the grid makes no scene.
    """
    tables, names, values, points = _grid(scene, over)
    shape, amplitudes = tuple(map(len, values.values())), values.get(AMPLITUDE)
    with _Rows(partial, question(scene, values), int(np.prod(shape))) as rows:
        while len(rows) < rows.total:
            k, done = divmod(len(rows), len(amplitudes or [0]))  # points, of which amplitudes run fastest
            first = _scene_at(tables, scene, names, points[k])
            most = min(SAMPLES_TOGETHER, first.system.at_once(first.numerics.phases))
            beyond = points[k + 1 : k + max(1, most // len(amplitudes or [0]))] if done == 0 else []
            batch = [first, *(_scene_at(tables, scene, names, p) for p in beyond)]
            rows.add(_rows(batch, amplitudes[done : done + most] if amplitudes else None))
            if progress:
                progress(len(rows) / rows.total)
    flat = np.array(list(rows)).reshape(*shape, kept.WIDTH)
    back = [names.index(k) for k in over]
    flat = np.transpose(flat, (*back, len(shape)))
    errors = {"estimate": flat[..., 3], "estimate_heading": flat[..., 4]}
    return {"over": {k: values[k] for k in over}, "displacement": flat[..., :3], **errors}


def cost(scene: Scene, over: Mapping[str, list[float]]) -> Cost:
    """Of `sweep`, by some of its points; SceneError as there."""
    tables, names, values, points = _grid(scene, over)
    total = len(points) * len(values.get(AMPLITUDE, [0]))
    some = [_scene_at(tables, scene, names, points[k]) for k in {0, len(points) // 2, len(points) - 1}]
    each = [price(direct(s, s.gait, total, s.numerics.phases, SAMPLES_TOGETHER)) for s in some]
    balances, seconds, memory = np.array(each).T
    return Cost(round(balances.mean()), float(seconds.mean()), float(memory.max()))


def _grid(scene: Scene, over: Mapping[str, list[float]]):
    """(tables of the scene, names of the parameters, their values, points of those other than the amplitude), the
    amplitude last; SceneError if they make no sweep."""
    names = [k for k in over if k != AMPLITUDE] + [k for k in over if k == AMPLITUDE]  # amplitudes innermost: one batch
    values = {k: [float(x) for x in over[k]] for k in names}
    total = int(np.prod([len(v) for v in values.values()])) if names else 0
    if not 0 < total <= LARGEST:
        raise SceneError(f"--over must span 1 to {LARGEST} points, got {total}")
    outer = [values[k] for k in names if k != AMPLITUDE]
    tables = written.tables(scene)
    for corner in _corners(outer):
        _scene_at(tables, scene, names, corner)  # refuse before computing
    return tables, names, values, list(itertools.product(*outer))


def question(scene: Scene, values: Mapping[str, list[float]]) -> dict:
    """All that the numbers of a sweep follow from: the code, the scene, and the parameters' values by name, in order."""
    system = scene.system
    of_system = {f.name: repr(getattr(system, f.name)) for f in dataclasses.fields(system) if f.name != "solver"}
    numerics = f"{scene.numerics}, {system.solver}"
    parts = {"system": system.kind, **of_system, "gait": repr(scene.gait), "numerics": numerics}
    over = [[name, list(x)] for name, x in values.items()]
    return {"geomech": __version__, "solver": SOLVER, "scene": scene.text, **parts, "over": over}


class _Rows(list):
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

    def __enter__(self) -> _Rows:
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
    groups: dict = {}
    for k, scene in enumerate(scenes):
        groups.setdefault(_kind(scene), []).append(k)
    rows: list = [None] * len(scenes)
    for members in groups.values():
        joined = beside([scenes[k] for k in members], amplitudes)
        found = np.column_stack(estimate.direct(joined, joined.gait, None, joined.numerics.phases))
        for k, part in zip(members, np.split(found, len(members))):
            rows[k] = part.tolist()
    return list(itertools.chain(*rows))


def _kind(scene: Scene) -> str:
    """The same for scenes that can share a batch."""
    effects = [
        (type(e), [getattr(e, f.name) for f in dataclasses.fields(e) if f.name not in e.batched])
        for e in getattr(scene.system, "effects", ())
    ]
    s = scene.system
    rest = (s.medium, s.body, s.solver) if isinstance(s, Swimmer) else s
    return repr((rest, scene.numerics, scene.gait.joints, s.lacks, effects))


def beside(scenes: list[Scene], amplitudes=None) -> Scene:
    """One scene with the gaits and effects of several side by side, each for all amplitudes or its own one."""
    count = 1 if amplitudes is None else len(amplitudes)
    gaits = Beside(tuple(s.gait for s in scenes), amplitudes)
    joined = dataclasses.replace(scenes[0], gait=gaits)
    if not isinstance(joined.system, Swimmer):
        return joined
    effects = tuple(side_by_side(same, [count] * len(scenes)) for same in zip(*(s.system.effects for s in scenes)))
    return joined.changed(effects=effects)


@dataclasses.dataclass(frozen=True)
class Beside:
    """Several gaits run at once, each for ``amplitudes`` or its own one: what a batch asks of a gait."""

    gaits: tuple[Gait, ...]
    amplitudes: list[float] | None

    @property
    def joints(self) -> int:
        return self.gaits[0].joints

    @property
    def harmonics(self) -> int:
        return max(g.harmonics for g in self.gaits)

    def cycle(self, phases: int, amplitudes=None) -> tuple[np.ndarray, np.ndarray]:
        """alpha, alphadot (gaits x amplitudes, phases, joints)."""
        each = [g.cycle(phases, [g.amplitude] if self.amplitudes is None else self.amplitudes) for g in self.gaits]
        return tuple(np.concatenate(x) for x in zip(*each))


def save(path: Path, scene: Scene, results: dict) -> None:
    """The results as NetCDF: dimensions are the parameters with their dots as underscores, and component."""
    from scipy.io import netcdf_file

    with whole_file(path) as part, netcdf_file(part, "w", version=2) as file:
        file.title = attribute(f"Net displacement per cycle of the scene {scene.name}")
        file.scene = attribute(written.toml(scene))
        names = []
        for parameter, values in results["over"].items():
            names.append(parameter.replace(".", "_").replace("-", "_"))
            file.createDimension(names[-1], len(values))
            axis = file.createVariable(names[-1], "f8", (names[-1],))
            axis[:] = values
            axis.long_name = parameter
        file.createDimension("component", 3)
        file.createDimension("component_length", 5)
        component = file.createVariable("component", "c", ("component", "component_length"))
        component[:] = np.array([list(c.ljust(5, "\0")) for c in COMPONENTS], "S1")
        component._Encoding = "ascii"
        unit = "body length" if scene.system.unit == "BL" else "m"
        for name, dims, units in (
            ("displacement", (*names, "component"), f"{unit} (x, y), rad (theta)"),
            ("estimate", tuple(names), "body length"),
            ("estimate_heading", tuple(names), "rad"),
        ):
            variable = file.createVariable(name, "f8", dims)
            variable[:] = results[name]
            variable.units = units


def draw(scene: Scene, results: dict):
    """Net displacement against one parameter, or a map over two; SceneError for more."""
    from geomech.output import plots

    over = results["over"]
    if len(over) > 2:
        raise SceneError(f"cannot draw {len(over)} parameters: sweep one or two, or leave --plot out")
    net, label = plots.net(results["displacement"]), f"displacement per cycle ({scene.system.unit})"
    fig, axes = plots.figure(4.0, 3.0)
    ax, names = axes[0, 0], list(over)
    named = [scene.gait.amplitude_label if name == AMPLITUDE else name for name in names]
    if len(over) == 1:
        ax.errorbar(over[names[0]], net, yerr=results["estimate"], fmt="o-", color="black", ms=3, lw=1)
        ax.set(xlabel=named[0], ylabel=label)
    else:
        image = ax.pcolormesh(over[names[0]], over[names[1]], net.T, shading="nearest", cmap="viridis", rasterized=True)
        fig.colorbar(image, ax=ax).set_label(label)
        ax.set(xlabel=named[0], ylabel=named[1])
    return fig
