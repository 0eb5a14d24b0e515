"""Net displacements of the gaits of many scenes, by the direct tier with its errors: the question of a sweep."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from geomech.core.variables import Variable
from geomech.mathematics.systems.base import body_size, length_unit
from geomech.mathematics.systems.capabilities import gaits_per_batch
from geomech.run.cost import Cost
from geomech.scenes import write as written
from geomech.scenes.model import Scene, checked_scene
from geomech.studies import tables
from geomech.studies.displacement.batch import batch_key, joined_scene
from geomech.studies.estimates import estimate, uncertainty
from geomech.studies.estimates.cost import direct_jobs, medium_jobs, total_cost
from geomech.studies.grid import Grid, values_at_points

BYTES_PER_POINT = (
    200  # bytes of a point: its row, and copies of it on the way to a file
)
SECONDS_PER_SCENE = 6e-4  # s to build a scene from its tables, measured
BATCH_SIZE = 64  # gaits of a batch: enough to fill the solver, few enough to lose little when stopped
ROW_WIDTH = 5  # numbers of a point: x, y, theta and the errors of position and heading
AMPLITUDE = "gait.amplitude"
FREQUENCIES = (
    "gait",
    "physical",
    "effects",
    "frequency",
)  # sections that have one, and its key


@dataclass(frozen=True)
class Cycles:
    """Net displacement per cycle, as a question of sweeps."""

    def grid(self, scene: Scene, over: Mapping[str, list[float]]) -> Grid:
        """Return the grid; amplitudes of one scene make one batch. Refusal if a corner makes no scene."""
        tables_ = written.tables(checked_scene(scene))
        if any(name.startswith("medium.") for name in over):
            tables_ = written.with_law(tables_, scene)
        grid = Grid(
            scene, over, tables_, AMPLITUDE, _parameters_without_effect(scene, over)
        )
        for corner in grid.corners():
            corner_scene = grid.scene_factory(corner)
            if uncertainty.is_uncertain(corner_scene.system):
                uncertainty.sigma_points(corner_scene)
        return grid

    def batch_size(self, scene: Scene) -> int:
        return min(BATCH_SIZE, gaits_per_batch(scene.system, scene.numerics.phases))

    def rows(self, scenes: list[Scene], amplitudes: list[float] | None) -> np.ndarray:
        """Return x, y, theta, errors of position and heading, and standard deviations of QUANTITIES where the medium is
        uncertain. x and y are in the scene's unit, other lengths in body lengths."""
        rows = np.array(_rows(scenes, amplitudes))
        if uncertainty.is_uncertain(scenes[0].system):
            rows = np.column_stack(
                [rows, _solve_in_batches(scenes, amplitudes, _medium_deviations)]
            )
        return rows

    def cost(self, grid: Grid) -> Cost:
        """Return a forecast from some of the points."""
        points, at, total = grid.points, grid.scene_factory, grid.total
        first = [at(points[k]) for k in range(min(points.total, BATCH_SIZE))]
        together = max(
            1,
            min(
                BATCH_SIZE,
                total // points.total * len(first) // len(set(map(batch_key, first))),
            ),
        )
        samples = [at(points[k]) for k in {0, points.total // 2, points.total - 1}]
        requests = [(s, s.gait, total, s.numerics.phases) for s in samples]
        jobs = [
            direct_jobs(*one, together) + medium_jobs(*one[:3], together)
            for one in requests
        ]
        balances, seconds, _, besides, steps = np.mean(
            list(map(total_cost, jobs)), 0
        ).tolist()
        memory = [
            direct_jobs(s, s.gait, min(total, BATCH_SIZE), s.numerics.phases)[0].memory
            for s in samples
        ]
        making = SECONDS_PER_SCENE * points.total
        return Cost(
            round(balances),
            seconds + making,
            max(memory) + BYTES_PER_POINT * total,
            besides + making,
            steps,
        )

    def variables(
        self, grid: Grid, rows: np.ndarray, dims: tuple[str, ...]
    ) -> tuple[list[Variable], dict]:
        """Return net poses with their errors, the body's length, and frequency and speed where there is a frequency."""
        scene, length = grid.scene, _lengths(grid)
        first = grid.scene_factory([x[0] for x in grid.values.values()])
        unit = length_unit(first.system)  # a swept length gives every point a size
        errors = np.stack([length * rows[..., 3], rows[..., 4]], -1)
        sizes = [length, length, np.ones_like(length), length]
        spread = {
            name: x * size
            for name, x, size in zip(
                tables.QUANTITIES, np.moveaxis(rows[..., ROW_WIDTH:], -1, 0), sizes
            )
        }
        frequency = values_at_points(grid.over, FREQUENCIES, scene.frequency)
        out = tables.pose_variables(
            dims, rows[..., :3], errors, unit, spread or None, frequency
        )
        out.append(Variable("body_length", dims, length, unit, "length of the body"))
        out += (
            [] if frequency is None else [Variable("frequency", dims, frequency, "Hz")]
        )
        error_is = getattr(scene.gait, "estimate_is", "")
        facts = {"error_is": error_is} if error_is else {}
        return out, facts


def _lengths(grid: Grid) -> np.ndarray:
    """Return the body's length (N_1, ...) at the points of a grid. Each parameter either multiplies it or does not
    change it."""
    values = grid.values
    first = {name: x[0] for name, x in values.items()}
    of = lambda name, x: body_size(
        grid.scene_factory([*{**first, name: x}.values()]).system
    )
    length = body_size(grid.scene_factory([*first.values()]).system)
    lengths = np.array(length)
    for name in grid.over:
        other = next((x for x in values[name] if x != first[name]), first[name])
        fixed = name == AMPLITUDE or of(name, other) == length
        along = (
            np.ones(len(values[name]))
            if fixed
            else np.array([of(name, x) for x in values[name]]) / length
        )
        lengths = lengths[..., None] * along
    return lengths


def _parameters_without_effect(scene: Scene, names) -> tuple[str, ...]:
    """Return the parameters that change no displacement: the frequency, where no effect has one."""
    timed = [f"{section}.frequency" for section in ("gait", "physical")]
    return tuple(
        name
        for name in names
        if name in timed and scene.system.traits.frequency is None
    )


def _rows(scenes: list[Scene], amplitudes) -> list:
    """Return [[x, y, theta, error, error of theta], ...] for all amplitudes of every scene, solved in batches; errors
    in body lengths and rad."""
    solve = lambda joined: np.column_stack(
        estimate.direct(joined, joined.gait, None, joined.numerics.phases)
    )
    return _solve_in_batches(scenes, amplitudes, solve)


def _solve_in_batches(scenes: list[Scene], amplitudes, solve: Callable) -> list:
    """Return rows of solve(scenes side by side), one for each amplitude of every scene."""
    groups: dict = {}
    for k, scene in enumerate(scenes):
        groups.setdefault(batch_key(scene), []).append(k)
    rows: list = [None] * len(scenes)
    for members in groups.values():
        numbers = solve(joined_scene([scenes[k] for k in members], amplitudes))
        for k, part in zip(members, np.split(numbers, len(members))):
            rows[k] = part.tolist()
    return list(itertools.chain(*rows))


def _medium_deviations(joined: Scene) -> np.ndarray:
    """Return the standard deviations of QUANTITIES by the medium's uncertainty, (N, 4), body lengths and rad."""
    deviations, length = (
        uncertainty.medium_spread(joined, joined.gait, None),
        body_size(joined.system),
    )
    return np.column_stack(
        [deviations[q] / (1.0 if q == "heading" else length) for q in tables.QUANTITIES]
    )
