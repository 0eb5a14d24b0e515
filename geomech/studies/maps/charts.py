"""Charts: splines over two shape variables that predict the displacement of any loop of
one scene without a balance of forces.

A chart has the tables of the area, path and harmonic tiers, in the scene's frame and in
the minimum-perturbation frame, in single precision, as the page of `geomech lab` looks
them up.
`tiers` predicts from these numbers alone, with an error; the page computes the same."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from geomech.mathematics.gaits import Points
from geomech.mathematics.geometry.connection import Connection
from geomech.mathematics.geometry.curvature import ccf, error
from geomech.mathematics.geometry.gait import Gait
from geomech.mathematics.geometry.reconstruct import displacement
from geomech.mathematics.geometry.representations.field import Field, inside
from geomech.mathematics.geometry.representations.harmonics import Harmonics, basis
from geomech.mathematics.systems.base import body_size
from geomech.mathematics.systems.capabilities import Drawable, capability
from geomech.mathematics.systems.framed import NAME as MINIMUM_PERTURBATION
from geomech.mathematics.tiers import harmonic
from geomech.scenes.model import Scene
from geomech.studies.estimates.estimate import evenly_spaced
from geomech.studies.scene_tables import SceneTables
from rft.core.refusal import Refusal, located
from rft.formulas import se2

# Harmonics with smaller coefficients, relative to the largest one, are left out.
SMALLEST_HARMONIC = 1e-7
MAX_ENDS = 33  # points of a body's outline
# Shares of what the series leaves along a loop: for 95 % of loops the errors of
# position and of heading are smaller. Measured.
RESIDUAL_SHARES = (0.35, 0.45)
# Loops by which the error of the grid, and that between members of a family, are
# measured.
N_LOOPS = 12
N_SAMPLES = 64  # of a gait that is no Fourier series
REACH = (
    0.85  # share of the field on either side within which those loops have their points
)
# Share of the change by half the grid that is the grid's error: of order 2, which is
# less than the order of splines of smooth media.
HALF_GRID_SHARE = 0.25
TABLE_NAMES = ("harmonics", "residual", "outline")
FRAME_TABLE_NAMES = ("A", "ccf", "ccf_error", "pose")


@dataclass(frozen=True, eq=False)
class FrameTables:
    """Tables of a body frame on a grid of shapes.

    A: spline coefficients of the connection, (N_1, N_2, 6), columns within rows. ccf:
    of the CCF, (N_1, N_2, 3). ccf_error: values on the grid, (N_1, N_2, 3). pose:
    spline coefficients of the frame's pose in the scene's frame, (N_1, N_2, 3); None
    for the scene's frame itself."""

    A: np.ndarray
    ccf: np.ndarray
    ccf_error: np.ndarray
    pose: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class Family:
    """Scenes that differ in one parameter. The tables of their chart have a leading
    axis of spline coefficients along it.

    key: of the parameter. values: of the members, ascending, among them ``own``, that
    of the scene. knots, degree: of the spline. error: largest distance, body lengths,
    by which interpolated tables change net positions of `N_LOOPS` loops."""

    key: str
    values: np.ndarray
    knots: np.ndarray
    degree: int
    own: float
    error: float = 0.0


@dataclass(frozen=True, eq=False)
class Chart:
    """Splines of a scene over its shape space, coefficients in single precision.

    axes: of the grid, rad. knots, degree: of the splines along each axis. harmonics:
    (N_1, N_2, 3 T), of cos beta, sin beta, cos 3 beta ... of each component of xi.
    residual: on the grid, (N_1, N_2, 3), rms over directions of what the harmonics
    leave.
    outline: (N_1, N_2, 2 P), x and y of the ends of links in the scene's frame. frames:
    tables by name of the frame. grid_error: error of position, in the scene's unit, and
    of heading, rad, for each rad of a loop's length. family: None for one scene.
    between: error of position by interpolation between members, in the scene's unit."""

    scene: Scene
    axes: tuple[np.ndarray, ...]
    knots: tuple[np.ndarray, ...]
    degree: int
    harmonics: np.ndarray
    residual: np.ndarray
    outline: np.ndarray
    frames: Mapping[str, FrameTables]
    grid_error: tuple[float, float]
    family: Family | None = None
    between: float = 0.0

    @property
    def shapes(self) -> int:
        """Number of shapes of the grid."""
        return math.prod(map(len, self.axes))

    @property
    def highest(self) -> int:
        """Highest harmonic of the direction of alphadot."""
        return self.harmonics.shape[-1] // 3 - 1

    def member(self, value: float) -> Chart:
        """Return the chart of a member of the family, or of a scene between two of
        them."""
        family = self.family
        if family is None:
            raise Refusal("this chart belongs to one scene, not to a family")
        between = 0.0
        if value not in family.values:
            between = family.error * body_size(self.scene.system)

        def evaluate(coefficients: np.ndarray) -> np.ndarray:
            spline = _spline((family.knots,), (family.degree,), coefficients)
            return spline([[value]])[0]

        return _map_tables(replace(self, family=None, between=between), evaluate)

    @cached_property
    def _splines(self) -> dict[Any, Any]:
        """Splines by (frame, table), and the harmonics by name."""
        degrees = (self.degree,) * 2
        splines: dict[Any, Any] = {}
        for name, tables in self.frames.items():
            splines[name, "A"] = _spline(self.knots, degrees, tables.A)
            splines[name, "ccf"] = _spline(self.knots, degrees, tables.ccf)
            splines[name, "area"] = _area(self.knots, self.degree, tables.ccf)
            if tables.pose is not None:
                splines[name, "pose"] = _spline(self.knots, degrees, tables.pose)
        splines["harmonics"] = _spline(self.knots, degrees, self.harmonics)
        return splines

    def xi(
        self, tier: str, alpha: np.ndarray, alphadot: np.ndarray, frame: str
    ) -> np.ndarray:
        """Return body velocities (..., 3): by the connection in ``frame`` for the tier
        "path", else by the harmonics in the scene's frame."""
        if tier == "path":
            A = self._splines[frame, "A"](alpha).reshape(*alpha.shape[:-1], 3, 2)
            return np.einsum("...ij,...j->...i", A, alphadot)

        speed = np.linalg.norm(alphadot, axis=-1)
        unit = alphadot / np.where(speed > 0, speed, 1.0)[..., None]
        series = self._splines["harmonics"](alpha).reshape(*alpha.shape[:-1], 3, -1)
        terms = basis(unit, self.highest)
        return np.einsum("...ij,...j->...i", series, terms) * speed[..., None]


class Prediction(NamedTuple):
    """Net pose (3,) of a loop by a tier, in the chosen frame at the start, in the
    scene's unit and rad. error: of position and of heading."""

    net: np.ndarray
    error: tuple[float, float]


def tiers(
    chart: Chart, gait: Gait, frame: str | None = None, phases: int = 256
) -> dict[str, Prediction]:
    """Return the predictions of a chart for a cycle of a gait by the area, the path and
    the harmonic tier; Refusal for a gait that leaves the chart.

    frame: the scene's own if None. phases: of a cycle; the page takes 256.

    The error of the harmonic tier is `harmonic_error`. The other two have their
    distance from the harmonic tier besides."""
    frame = frame or chart.scene.frame
    alpha, alphadot = gait.cycle(phases)
    inside(chart.axes, alpha)

    net = displacement(chart.xi("harmonic", alpha, alphadot, frame))
    net = _in_frame(chart, frame, net, alpha[0])
    position_error, heading_error = harmonic_error(chart, alpha, alphadot)
    predictions = {"harmonic": Prediction(net, (position_error, heading_error))}

    path = displacement(chart.xi("path", alpha, alphadot, frame))
    potential = chart._splines[frame, "area"](alpha)
    area = 2 * np.pi * (potential * alphadot[..., 1:]).mean(-2)
    for name, pose in (("path", path), ("area", se2.exp(area))):
        distance = np.hypot(*(pose - net)[:2])
        turn = abs(pose[2] - net[2])
        error = (float(distance) + position_error, float(turn) + heading_error)
        predictions[name] = Prediction(pose, error)
    return predictions


def harmonic_error(
    chart: Chart, alpha: np.ndarray, alphadot: np.ndarray
) -> tuple[float, float]:
    """Return the error of the harmonic tier for one cycle (P, 2): of position, in the
    scene's unit, and of heading, rad.

    It is the error of the grid, and a share (`RESIDUAL_SHARES`) of what the series
    leaves along the loop."""
    from scipy.interpolate import RegularGridInterpolator

    limits = np.array([axis[[0, -1]] for axis in chart.axes])
    rms = RegularGridInterpolator(chart.axes, chart.residual)(np.clip(alpha, *limits.T))
    speed = np.linalg.norm(alphadot, axis=-1)
    along = np.array([speed @ np.hypot(rms[:, 0], rms[:, 1]), speed @ rms[:, 2]])
    along = along / len(speed)
    by_grid = speed.mean() * np.array(chart.grid_error)
    position, heading = 2 * np.pi * (RESIDUAL_SHARES * along + by_grid)
    return float(position) + chart.between, float(heading)


def _in_frame(
    chart: Chart, frame: str, net: np.ndarray, start: np.ndarray
) -> np.ndarray:
    """Return a net pose in the scene's frame as one in another frame."""
    if chart.frames[frame].pose is None:
        return net
    h = chart._splines[frame, "pose"](start)
    return se2.compose(se2.inverse(h), se2.compose(net, h))


def _spline(knots, degrees, coefficients: np.ndarray) -> Any:
    from scipy.interpolate import NdBSpline

    return NdBSpline(
        tuple(knots), np.ascontiguousarray(coefficients, float), tuple(degrees)
    )


def _area(knots, degree: int, coefficients: np.ndarray) -> Any:
    """Return the antiderivative of a spline along the first axis, from its lower
    end."""
    from scipy.interpolate import BSpline

    along = BSpline(knots[0], np.asarray(coefficients, float), degree).antiderivative()
    rows = along.c[: len(along.t) - along.k - 1]
    return _spline((along.t, knots[1]), (along.k, degree), rows)


def refuse(scene: Scene) -> None:
    """Refuse a scene that has no chart: other than two joints, no harmonics, or no
    body."""
    system = scene.system
    with located(scene.name):
        if system.joints != 2:
            raise Refusal(
                f"a chart needs two shape variables, this body has {system.joints}",
                instead="use 'geomech displacement'",
            )
        harmonic.HARMONIC.refuse(system)
        if system.traits.compliant:
            raise Refusal(
                "a chart is of gaits that prescribe the shape",
                because="with springs a gait is only a command",
                instead="remove the effect springs, or use 'geomech ccf'",
            )
        if system.traits.periods:
            raise Refusal(
                "a chart is of gaits whose shape variables all return",
                because="one of this body repeats, and gaits wind around it",
                instead="use 'geomech ccf' and 'geomech displacement'",
            )
        if capability(system, Drawable) is None:
            raise Refusal(
                "this system has no body to draw", instead="use 'geomech ccf'"
            )


def chart(scene: Scene) -> Chart:
    """Return the chart of a scene; Refusal for one without harmonics or without a body
    to draw."""
    refuse(scene)
    study = SceneTables(scene)
    fitted = study.fitted
    series = _significant_harmonics(study)
    frames = {scene.frame: _frame_tables(fitted)}
    if scene.frame != MINIMUM_PERTURBATION:
        other = study.in_frame(MINIMUM_PERTURBATION)
        pose = other.scene.system.field.field
        frames[MINIMUM_PERTURBATION] = _frame_tables(other.fitted, pose)

    return Chart(
        scene,
        series.axes,
        tuple(series.field.spline.t),
        series.degree,
        harmonics=_coefficients(series.field),
        residual=_single_precision(_components_last(series.residual)),
        outline=_coefficients(_outline(scene, series)),
        frames=frames,
        grid_error=_grid_error(series),
    )


def _significant_harmonics(study: SceneTables) -> Harmonics:
    """Return the harmonics of a scene up to the last one that is not negligible; where
    xi = A alphadot, A alone."""
    if study.scene.system.traits.linear:
        A = study.fitted
        return Harmonics(A.axes, A.A, A.residual, A.degree)
    series = study.compute_harmonics()
    size = np.abs(series.coefficients).max((0, 2, 3)).reshape(-1, 2).max(-1)
    is_significant = size > SMALLEST_HARMONIC * size.max()
    count = 1 + int(np.flatnonzero(is_significant).max())
    return replace(series, coefficients=series.coefficients[:, : 2 * count])


def _frame_tables(connection: Connection, pose: Field | None = None) -> FrameTables:
    """Return the tables of a frame from its connection. pose: the frame's pose in the
    scene's frame; None for that frame itself."""
    density = ccf(connection)
    return FrameTables(
        A=_coefficients(connection.field),
        ccf=_coefficients(density),
        ccf_error=_single_precision(_components_last(error(connection).values)),
        pose=None if pose is None else _coefficients(pose),
    )


def _outline(scene: Scene, series: Harmonics) -> Field:
    """Return the ends of up to `MAX_ENDS` links in the body frame at every shape of the
    grid."""
    grid = np.stack(np.meshgrid(*series.axes, indexing="ij"), -1)
    at_rest = np.zeros((*grid.shape[:2], 3))
    ends = capability(scene.system, Drawable).points(grid, at_rest)
    n_ends = ends.shape[-2]
    drawn = ends[..., evenly_spaced(n_ends, min(MAX_ENDS, n_ends)), :]
    values = np.moveaxis(drawn.reshape(*grid.shape[:2], -1), -1, 0)
    return Field(series.axes, values, series.degree)


def loops(
    axes: tuple[np.ndarray, ...], count: int = N_LOOPS, seed: int = 1
) -> list[Points]:
    """Return closed curves through random shapes, within a field."""
    rng = np.random.default_rng(seed)
    low, high = np.array([(axis[0], axis[-1]) for axis in axes]).T
    middle = (low + high) / 2
    half = (high - low) / 2
    accepted: list[Points] = []
    while len(accepted) < count:
        unit = rng.uniform(-1, 1, (int(rng.integers(3, 10)), 2))
        points = middle + REACH * half * unit
        gait = Points(points=tuple(map(tuple, points.round(3).tolist())))
        if (np.abs(gait.cycle(256)[0] - middle) < half).all():
            accepted.append(gait)
    return accepted


def fourier_series(gait: Gait) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the unit curve of a gait as a Fourier series: its mean (2,), and the
    coefficients of cos and of sin, (2, K) each. For a gait that is no such series these
    are the first terms of its curve."""
    if hasattr(gait, "coefficients"):
        return np.zeros(2), *gait.coefficients()
    unit = gait.unit(2 * np.pi * np.arange(N_SAMPLES) / N_SAMPLES)
    terms = np.fft.rfft(unit, axis=0)[1 : N_SAMPLES // 4] * 2 / N_SAMPLES
    return unit.mean(0), terms.real.T, -terms.imag.T


def _grid_error(series: Harmonics) -> tuple[float, float]:
    """Return the error of the grid in position and heading for each rad of a loop's
    length, from the harmonics on half of the grid."""
    half = series.half(0)
    rates = []
    for gait in loops(series.axes):
        alpha, alphadot = gait.cycle(256)
        net = displacement(series.velocity(alpha, alphadot))
        difference = net - displacement(half.velocity(alpha, alphadot))
        length = 2 * np.pi * np.linalg.norm(alphadot, axis=-1).mean()
        change = np.array([np.hypot(*difference[:2]), abs(difference[2])])
        rates.append(change / length)
    return tuple((HALF_GRID_SHARE * np.median(rates, 0)).tolist())


def family(
    scene: Scene,
    key: str,
    values: list[float],
    own: float,
    members: list[Chart],
    between: list[Chart],
) -> Chart:
    """Return the charts of scenes that differ in one parameter as one chart.

    between: charts halfway between neighbouring members, by which the error of
    interpolation is measured."""
    from scipy.interpolate import make_interp_spline

    degree = min(3, len(values) - 1)

    def interpolated(arrays: list[np.ndarray]) -> np.ndarray:
        """Return the coefficients of the spline along the parameter."""
        spline = make_interp_spline(values, np.stack(arrays), degree)
        return _single_precision(spline.c)

    def interpolated_frame(frame: str) -> FrameTables:
        tables = {}
        for name in FRAME_TABLE_NAMES:
            arrays = [getattr(member.frames[frame], name) for member in members]
            if arrays[0] is not None:
                tables[name] = interpolated(arrays)
        return FrameTables(**tables)

    parts = {}
    for name in TABLE_NAMES:
        parts[name] = interpolated([getattr(member, name) for member in members])
    knots = make_interp_spline(values, np.asarray(values), degree).t
    largest_errors = np.max([member.grid_error for member in members], 0)
    chart = replace(
        members[values.index(own)],
        **parts,
        frames={frame: interpolated_frame(frame) for frame in members[0].frames},
        grid_error=tuple(largest_errors.tolist()),
        family=Family(key, np.array(values), knots, degree, own),
    )

    differences = []
    for value, exact in zip(midpoints(values), between):
        differences.append(_largest_difference(chart.member(value), exact))
    return replace(chart, family=replace(chart.family, error=max(differences)))


def midpoints(values: list[float]) -> list[float]:
    """Return the values halfway between neighbours."""
    return [(a + b) / 2 for a, b in pairwise(values)]


def _largest_difference(chart: Chart, other: Chart) -> float:
    """Return the largest distance, body lengths, between net positions of two
    charts."""
    gaits = loops(chart.axes)
    nets = np.array([tiers(chart, gait)["harmonic"].net for gait in gaits])
    other_nets = np.array([tiers(other, gait)["harmonic"].net for gait in gaits])
    distances = np.hypot(*(nets - other_nets)[:, :2].T)
    return float(distances.max() / body_size(chart.scene.system))


def _map_tables(chart: Chart, function: Callable[[np.ndarray], np.ndarray]) -> Chart:
    """Return the chart with a function applied to all of its tables."""
    parts = {name: function(getattr(chart, name)) for name in TABLE_NAMES}
    frames = {}
    for frame, tables in chart.frames.items():
        mapped = {}
        for name in FRAME_TABLE_NAMES:
            array = getattr(tables, name)
            if array is not None:
                mapped[name] = function(array)
        frames[frame] = FrameTables(**mapped)
    return replace(chart, **parts, frames=frames)


def _coefficients(field: Field) -> np.ndarray:
    """Return the coefficients of the spline through a field, components last,
    (N_1, N_2, K)."""
    coefficients = np.asarray(field.spline.c)
    return _single_precision(coefficients.reshape(*map(len, field.axes), -1))


def _components_last(values: np.ndarray) -> np.ndarray:
    return np.moveaxis(values, 0, -1)


def _single_precision(values: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(values, np.float32)
