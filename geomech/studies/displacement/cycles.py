"""Net displacements of the gaits of many scenes by the direct tier, with their errors:
the question of a sweep."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from geomech.core.variables import Variable
from geomech.mathematics.systems.base import body_size, length_unit
from geomech.mathematics.systems.capabilities import gaits_per_batch
from geomech.runs.cost import Cost
from geomech.scenes import write as written
from geomech.scenes.model import Scene, checked_scene
from geomech.studies.displacement.batch import grouped, joined_scene
from geomech.studies.displacement.variables import QUANTITIES, pose_variables
from geomech.studies.estimates import estimate, uncertainty
from geomech.studies.estimates.cost import direct_jobs, medium_jobs, total_cost
from geomech.studies.grid import Grid, values_at_points
from geomech.studies.mechanics.outcome import (
    least_margin,
    outcome,
    slope_of,
    uphill,
)
from rft.motion.cycles import SlidesDown

BYTES_PER_POINT = 200  # of its row, and of copies while it is written to a file
SECONDS_PER_SCENE = 6e-4  # to build one from its tables; measured
SECONDS_PER_MEDIUM = 9e-5  # to read one into a scene that is built; measured
# Gaits of a batch: enough to fill the solver, and little is lost when a sweep stops.
BATCH_SIZE = 64
ROW_WIDTH = 5  # numbers of a row: x, y, theta and the errors of position and heading
AMPLITUDE = "gait.amplitude"
FREQUENCIES = ("gait", "physical", "effects", "frequency")  # sections, and their key


@dataclass(frozen=True)
class Cycles:
    """Net displacement per cycle, as a question of sweeps."""

    def grid(self, scene: Scene, over: Mapping[str, list[float]]) -> Grid:
        """Return the grid; the amplitudes of one scene make up a batch. Refusal if a
        corner makes no scene."""
        scene_tables = written.tables(checked_scene(scene))
        if any(name.startswith("medium.") for name in over):
            scene_tables = written.with_law(scene_tables, scene)
        idle = _parameters_without_effect(scene, over)
        grid = Grid(scene, over, scene_tables, AMPLITUDE, idle)
        for corner in grid.corners():
            corner_scene = grid.scene_factory(corner)
            if uncertainty.is_uncertain(corner_scene.system):
                uncertainty.sigma_points(corner_scene)
        return grid

    def batch_size(self, scene: Scene) -> int:
        return min(BATCH_SIZE, gaits_per_batch(scene.system, scene.numerics.phases))

    def rows(self, scenes: list[Scene], amplitudes: list[float] | None) -> np.ndarray:
        """Return x, y, theta, the errors of position and heading, and where the medium
        is uncertain the standard deviations of QUANTITIES. x and y are in the scene's
        unit, other lengths in body lengths."""
        rows = np.array(_rows(scenes, amplitudes))
        if uncertainty.is_uncertain(scenes[0].system):
            deviations = _solve_in_batches(scenes, amplitudes, _medium_deviations)
            rows = np.column_stack([rows, deviations])
        return rows

    def cost(self, grid: Grid) -> Cost:
        """Return a forecast from three points of the grid."""
        n_points = grid.points.total
        total = grid.total
        batch_size = _mean_batch_size(grid)
        costs = []
        memories = []
        for k in sorted({0, n_points // 2, n_points - 1}):
            scene = grid.scene_factory(grid.points[k])
            gait, phases = scene.gait, scene.numerics.phases
            jobs = direct_jobs(scene, gait, total, phases, batch_size)
            jobs += medium_jobs(scene, gait, total, batch_size)
            costs.append(total_cost(jobs))
            one_batch = direct_jobs(scene, gait, min(total, BATCH_SIZE), phases)
            memories.append(one_batch[0].memory)

        balances, seconds, _, besides, numpy_seconds = np.mean(costs, 0).tolist()
        building = SECONDS_PER_SCENE * grid.n_scenes + SECONDS_PER_MEDIUM * n_points
        memory = max(memories) + BYTES_PER_POINT * total
        return Cost(
            round(balances),
            seconds + building,
            memory,
            besides + building,
            numpy_seconds,
        )

    def variables(
        self, grid: Grid, rows: np.ndarray, dims: tuple[str, ...]
    ) -> tuple[list[Variable], dict]:
        """Return net poses with their errors, the body's length, and the frequency and
        the speed where there is a frequency."""
        scene = grid.scene
        length = _lengths(grid)
        first = grid.scene_factory([values[0] for values in grid.values.values()])
        unit = length_unit(first.system)  # a swept length gives every point a size
        errors = np.stack([length * rows[..., 3], rows[..., 4]], -1)
        frequency = values_at_points(grid.over, FREQUENCIES, scene.frequency)
        found = pose_variables(
            dims, rows[..., :3], errors, unit, _spreads(rows, length), frequency
        )
        found.append(Variable("body_length", dims, length, unit, "length of the body"))
        if slope_of(first.system) is not None:
            found += _slope_variables(grid, found, errors[..., 0], dims, unit)
        if frequency is not None:
            found.append(Variable("frequency", dims, frequency, "Hz"))

        facts = {}
        error_is = getattr(scene.gait, "estimate_is", "")
        if error_is:
            facts["error_is"] = error_is
        return found, facts


def _slope_variables(
    grid: Grid,
    found: list[Variable],
    errors: np.ndarray,
    dims: tuple[str, ...],
    unit: str,
) -> list[Variable]:
    """Return the distance uphill and the outcome at every point of a sweep of scenes on
    a slope, from the variables x and y; errors: (N_1, ...), of the position."""
    x = found[0].values
    y = found[1].values
    climbed = np.empty(x.shape)
    margin = np.empty(x.shape)
    for index in np.ndindex(x.shape):
        point = {name: grid.over[name][k] for name, k in zip(grid.over, index)}
        scene = grid.scene_factory(tuple(point[name] for name in grid.names))
        amplitude = point.get(AMPLITUDE, scene.gait.amplitude)
        climbed[index] = uphill(slope_of(scene.system), x[index], y[index])
        margin[index] = least_margin(scene.system, scene.gait, amplitude)[0]
    label = "distance uphill along the slope per cycle"
    return [
        Variable("uphill", dims, climbed, unit, label, error=errors),
        Variable("outcome", dims, outcome(climbed, margin), "", "outcome"),
    ]


def _spreads(rows: np.ndarray, length: np.ndarray) -> dict[str, np.ndarray] | None:
    """Return the standard deviations of QUANTITIES in the scene's unit and rad; None
    for rows without them."""
    deviations = np.moveaxis(rows[..., ROW_WIDTH:], -1, 0)
    if not len(deviations):
        return None
    sizes = [length, length, np.ones_like(length), length]
    return {
        name: deviation * size
        for name, deviation, size in zip(QUANTITIES, deviations, sizes)
    }


def _mean_batch_size(grid: Grid) -> int:
    """Return the number of gaits that batches have on average, from the first scenes:
    only scenes that can share a batch are solved together."""
    n_points = grid.points.total
    n_first = min(n_points, BATCH_SIZE)
    groups = grouped([grid.scene_factory(grid.points[k]) for k in range(n_first)])
    gaits = grid.total // n_points * n_first // len(groups)
    return max(1, min(BATCH_SIZE, gaits))


def _lengths(grid: Grid) -> np.ndarray:
    """Return the body's length (N_1, ...) at the points of a grid. Each parameter
    either multiplies it or does not change it."""
    first = {name: values[0] for name, values in grid.values.items()}

    def length_at(**changes: float) -> float:
        point = [*{**first, **changes}.values()]
        return body_size(grid.scene_factory(point).system)

    length = length_at()
    lengths = np.array(length)
    for name in grid.over:
        values = grid.values[name]
        other = next((value for value in values if value != first[name]), first[name])
        factors = np.ones(len(values))
        if name != AMPLITUDE and length_at(**{name: other}) != length:
            factors = (
                np.array([length_at(**{name: value}) for value in values]) / length
            )
        lengths = lengths[..., None] * factors
    return lengths


def _parameters_without_effect(scene: Scene, names) -> tuple[str, ...]:
    """Return the parameters that change no displacement: the frequency, where no effect
    depends on it."""
    if scene.system.traits.frequency is not None:
        return ()
    return tuple(
        name for name in names if name in ("gait.frequency", "physical.frequency")
    )


def _rows(scenes: list[Scene], amplitudes) -> list:
    """Return [[x, y, theta, error, error of theta], ...] for all amplitudes of every
    scene, solved in batches; errors in body lengths and rad. They are nan for a body
    that slides down a slope."""

    def solve(joined: Scene) -> np.ndarray:
        phases = joined.numerics.phases
        poses, errors = estimate.direct(joined, joined.gait, None, phases)
        return np.column_stack([poses, errors])

    try:
        return _solve_in_batches(scenes, amplitudes, solve)
    except SlidesDown:
        gaits = [None] if amplitudes is None else amplitudes
        if len(scenes) == len(gaits) == 1:
            return [[np.nan] * ROW_WIDTH]
    # One by one, as others of the batch may hold.
    rows = []
    for scene in scenes:
        for amplitude in gaits:
            rows += _rows([scene], None if amplitude is None else [amplitude])
    return rows


def _solve_in_batches(scenes: list[Scene], amplitudes, solve: Callable) -> list:
    """Return the rows of solve(joined scene) for the scenes in their order, one for
    each amplitude of every scene."""
    rows: list = [None] * len(scenes)
    for members in grouped(scenes):
        joined = joined_scene([scenes[k] for k in members], amplitudes)
        solved = np.split(solve(joined), len(members))
        for k, part in zip(members, solved):
            rows[k] = part.tolist()
    return list(itertools.chain(*rows))


def _medium_deviations(joined: Scene) -> np.ndarray:
    """Return the standard deviations of QUANTITIES by the medium's uncertainty, (N, 4),
    in body lengths and rad."""
    deviations = uncertainty.medium_spread(joined, joined.gait, None)
    length = body_size(joined.system)
    columns = []
    for name in QUANTITIES:
        size = 1.0 if name == "heading" else length
        columns.append(deviations[name] / size)
    return np.column_stack(columns)
