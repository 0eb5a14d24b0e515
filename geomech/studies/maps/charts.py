"""Charts: all that predicts a loop of one scene without solving for forces, as splines over two shape variables.

A chart has the tables of the area, path and harmonic tiers, in the scene's frame and in
the minimum-perturbation frame, in single precision, as a page that is opened anywhere
looks them up. `tiers` predicts by these numbers alone, with an error; the page of
`geomech lab` computes the same."""

from __future__ import annotations

import math
from collections.abc import Mapping
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
from geomech.studies.scene_tables import SceneTables
from rft.core.refusal import Refusal, located
from rft.formulas import se2

SMALLEST_HARMONIC = 1e-7  # of the largest coefficient: harmonics below it are left out
MAX_ENDS = 33  # points of a body's outline at most
RESIDUAL_SHARES = (
    0.35,
    0.45,
)  # of what the series leaves along a loop, by which positions and headings of 95 % of loops are off at most
N_LOOPS = 12  # loops by which the error of the grid, and that between members of a family, are measured
N_SAMPLES = 64  # of a gait that is no Fourier series
REACH = 0.85  # of the field on either side, within which those loops have their points
# of what half the grid changes is the grid's error: of order 2, less than splines of
# smooth media have
HALF_GRID_SHARE = 0.25


@dataclass(frozen=True, eq=False)
class FrameTables:
    """Tables of a body frame. A, ccf: coefficients of splines, (N_1, N_2, 6), columns
    within rows, and (N_1, N_2, 3). ccf_error: on the grid, (N_1, N_2, 3). pose:
    coefficients of the frame's pose in the scene's, (N_1, N_2, 3); None for that frame
    itself."""

    A: np.ndarray
    ccf: np.ndarray
    ccf_error: np.ndarray
    pose: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class Family:
    """Scenes that differ in one parameter: the tables of a chart have a leading axis along it, of spline coefficients.

    key: of the parameter. values: of the members, ascending, one of them the scene's
    own. knots, degree: of the spline. error: distance, body lengths, up to which
    interpolated tables change net positions of `N_LOOPS` loops."""

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
    residual: on the grid, (N_1, N_2, 3), rms over directions of what they leave.
    outline: (N_1, N_2, 2 P), x and y of the ends of links in the scene's frame. frames:
    by name. grid_error: of position and heading for each rad of a loop's length, that
    the grid leaves, in the scene's unit and rad. family: None for one scene. between:
    error of position that interpolation from member to member leaves, in the scene's
    unit."""

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
        """Return the chart of a member of the family, or of a scene between two of them."""
        if self.family is None:
            raise Refusal("this chart is that of one scene, and not of a family")
        f = self.family
        between = 0.0 if value in f.values else f.error * body_size(self.scene.system)
        return _map_tables(
            replace(self, family=None, between=between),
            lambda x: _spline((f.knots,), (f.degree,), x)([[value]])[0],
        )

    @cached_property
    def _splines(self) -> dict[tuple, Any]:
        of = lambda x: _spline(self.knots, (self.degree,) * 2, x)
        made = {
            (name, part): of(getattr(t, part))
            for name, t in self.frames.items()
            for part in ("A", "ccf")
        }
        poses = {
            (name, "pose"): of(t.pose)
            for name, t in self.frames.items()
            if t.pose is not None
        }
        areas = {
            (name, "area"): _area(self.knots, self.degree, t.ccf)
            for name, t in self.frames.items()
        }
        return {**made, **poses, **areas, "harmonics": of(self.harmonics)}

    def xi(
        self, tier: str, alpha: np.ndarray, alphadot: np.ndarray, frame: str
    ) -> np.ndarray:
        """Return body velocities (..., 3) by the harmonics, in the scene's frame, or by the connection in another."""
        if tier == "path":
            A = self._splines[frame, "A"](alpha).reshape(*alpha.shape[:-1], 3, 2)
            return np.einsum("...ij,...j->...i", A, alphadot)
        speed = np.linalg.norm(alphadot, axis=-1)
        unit = alphadot / np.where(speed > 0, speed, 1.0)[..., None]
        series = self._splines["harmonics"](alpha).reshape(*alpha.shape[:-1], 3, -1)
        return (
            np.einsum("...ij,...j->...i", series, basis(unit, self.highest))
            * speed[..., None]
        )


class Prediction(NamedTuple):
    """Net pose (3,) of a loop by a tier, in the chosen frame at the start, in the
    scene's unit and rad; error: of position and heading."""

    net: np.ndarray
    error: tuple[float, float]


def tiers(
    chart: Chart, gait: Gait, frame: str | None = None, phases: int = 256
) -> dict[str, Prediction]:
    """Return what a chart predicts of a cycle of a gait by the area, the path and the
    harmonic tier. Refusal for a gait that leaves the chart.

    frame: the scene's own if None. phases: of a cycle; the page takes 256.

    The harmonic tier is off by the error of the grid and by a share (`RESIDUAL_SHARES`)
    of what the series leaves along the loop, the other two by their distance from it,
    besides."""
    frame = frame or chart.scene.frame
    alpha, alphadot = gait.cycle(phases)
    inside(chart.axes, alpha)
    net = _in_frame(
        chart,
        frame,
        displacement(chart.xi("harmonic", alpha, alphadot, frame)),
        alpha[0],
    )
    own = harmonic_error(chart, alpha, alphadot)
    found = {"harmonic": Prediction(net, own)}
    area = (
        2 * np.pi * (chart._splines[frame, "area"](alpha) * alphadot[..., 1:]).mean(-2)
    )
    others = {
        "path": displacement(chart.xi("path", alpha, alphadot, frame)),
        "area": se2.exp(area),
    }
    for name, x in others.items():
        off = np.hypot(*(x - net)[:2]), abs(x[2] - net[2])
        found[name] = Prediction(x, (float(off[0]) + own[0], float(off[1]) + own[1]))
    return found


def harmonic_error(
    chart: Chart, alpha: np.ndarray, alphadot: np.ndarray
) -> tuple[float, float]:
    """Return the error of the harmonic tier for one cycle (P, 2): of position, and of heading."""
    from scipy.interpolate import RegularGridInterpolator

    rms = RegularGridInterpolator(chart.axes, chart.residual)(
        np.clip(alpha, *np.array([a[[0, -1]] for a in chart.axes]).T)
    )
    speed = np.linalg.norm(alphadot, axis=-1)
    along = np.array([speed @ np.hypot(rms[:, 0], rms[:, 1]), speed @ rms[:, 2]]) / len(
        speed
    )
    position, heading = (
        2
        * np.pi
        * (RESIDUAL_SHARES * along + speed.mean() * np.array(chart.grid_error))
    )
    return float(position) + chart.between, float(heading)


def _in_frame(
    chart: Chart, frame: str, net: np.ndarray, start: np.ndarray
) -> np.ndarray:
    """Return a net pose of the scene's frame in another one."""
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
    """Return the antiderivative of a spline along the first axis, from its lower end."""
    from scipy.interpolate import BSpline

    along = BSpline(knots[0], np.asarray(coefficients, float), degree).antiderivative()
    rows = along.c[: len(along.t) - along.k - 1]
    return _spline((along.t, knots[1]), (along.k, degree), rows)


def refuse(scene: Scene) -> None:
    """Refuse a scene of which there is no chart."""
    system = scene.system
    with located(scene.name):
        if system.joints != 2:
            raise Refusal(
                f"a chart has two shape variables, this body {system.joints}",
                instead="see 'geomech displacement'",
            )
        harmonic.HARMONIC.refuse(system)
        if capability(system, Drawable) is None:
            raise Refusal(
                "this system has no body to draw", instead="see 'geomech ccf'"
            )


def chart(scene: Scene) -> Chart:
    """Return the chart of a scene. Refusal for one without harmonics, or without a body to draw."""
    refuse(scene)
    study = SceneTables(scene)
    fitted, series = study.fitted, _significant_harmonics(study)
    frames = {scene.frame: _frame_tables(fitted)}
    if scene.frame != MINIMUM_PERTURBATION:
        other = study.in_frame(MINIMUM_PERTURBATION)
        frames[MINIMUM_PERTURBATION] = _frame_tables(
            other.fitted, other.scene.system.field.field
        )
    field = series.field
    made = Chart(
        scene,
        series.axes,
        tuple(field.spline.t),
        series.degree,
        _coefficients(field),
        _single_precision(_components_last(series.residual)),
        _coefficients(_outline(scene, series)),
        frames,
        (0.0, 0.0),
    )
    return replace(made, grid_error=_grid_error(series))


def _significant_harmonics(study: SceneTables) -> Harmonics:
    """Return the harmonics of a scene without those that are next to nothing; where xi = A alphadot, A alone."""
    if study.scene.system.traits.linear:
        A = study.fitted
        return Harmonics(A.axes, A.A, A.residual, A.degree)
    series = study.compute_harmonics()
    size = np.abs(series.coefficients).max((0, 2, 3)).reshape(-1, 2).max(-1)
    count = 1 + int(np.flatnonzero(size > SMALLEST_HARMONIC * size.max()).max())
    return replace(series, coefficients=series.coefficients[:, : 2 * count])


def _frame_tables(connection: Connection, pose: Field | None = None) -> FrameTables:
    map_ = ccf(connection)
    return FrameTables(
        _coefficients(connection.field), _coefficients(map_), _single_precision(_components_last(error(connection).values)),
        None if pose is None else _coefficients(pose),
    )  # fmt: skip


def _outline(scene: Scene, series: Harmonics) -> Field:
    """Return the ends of the links in the body frame at every shape of the grid."""
    grid = np.stack(np.meshgrid(*series.axes, indexing="ij"), -1)
    ends = capability(scene.system, Drawable).points(
        grid, np.zeros((*grid.shape[:2], 3))
    )
    some = np.unique(
        np.linspace(0, ends.shape[-2] - 1, min(MAX_ENDS, ends.shape[-2]))
        .round()
        .astype(int)
    )
    return Field(
        series.axes,
        np.moveaxis(ends[..., some, :].reshape(*grid.shape[:2], -1), -1, 0),
        series.degree,
    )


def loops(
    axes: tuple[np.ndarray, ...], count: int = N_LOOPS, seed: int = 1
) -> list[Points]:
    """Return closed curves through random shapes, within a field."""
    rng, found = np.random.default_rng(seed), []
    low, high = np.array([(a[0], a[-1]) for a in axes]).T
    middle, half = (low + high) / 2, (high - low) / 2
    while len(found) < count:
        points = middle + REACH * half * rng.uniform(
            -1, 1, (int(rng.integers(3, 10)), 2)
        )
        gait = Points(points=tuple(map(tuple, points.round(3).tolist())))
        if (np.abs(gait.cycle(256)[0] - middle) < half).all():
            found.append(gait)
    return found


def fourier_series(gait: Gait) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the unit curve of a gait as a Fourier series: its mean (2,), and
    coefficients (cos, sin), (2, K) each; of one that is no series the first terms of
    its own."""
    if hasattr(gait, "coefficients"):
        return np.zeros(2), *gait.coefficients()
    unit = gait.unit(2 * np.pi * np.arange(N_SAMPLES) / N_SAMPLES)
    terms = np.fft.rfft(unit, axis=0)[1 : N_SAMPLES // 4] * 2 / N_SAMPLES
    return unit.mean(0), terms.real.T, -terms.imag.T


def _grid_error(series: Harmonics) -> tuple[float, float]:
    """Return the error of the grid, for each rad of a loop's length, by the harmonics on half of it."""
    half, rates = series.half(0), []
    for gait in loops(series.axes):
        alpha, alphadot = gait.cycle(256)
        off = displacement(series.velocity(alpha, alphadot)) - displacement(
            half.velocity(alpha, alphadot)
        )
        length = 2 * np.pi * np.linalg.norm(alphadot, axis=-1).mean()
        rates.append(np.array([np.hypot(*off[:2]), abs(off[2])]) / length)
    return tuple((HALF_GRID_SHARE * np.median(rates, 0)).tolist())


def family(
    scene: Scene,
    key: str,
    values: list[float],
    own: float,
    members: list[Chart],
    between: list[Chart],
) -> Chart:
    """Return the charts of scenes that differ in one parameter as one. between: those
    halfway from member to member, by which the error of interpolation is measured."""
    from scipy.interpolate import make_interp_spline

    degree = min(3, len(values) - 1)
    knots = make_interp_spline(values, np.asarray(values), degree).t
    stacked = lambda some: _single_precision(
        make_interp_spline(values, np.stack(some), degree).c
    )
    parts = {
        name: stacked([getattr(m, name) for m in members])
        for name in ("harmonics", "residual", "outline")
    }
    frames = {
        frame: FrameTables(*(
            None if getattr(tables, part) is None else stacked([getattr(m.frames[frame], part) for m in members])
            for part in ("A", "ccf", "ccf_error", "pose")
        )) for frame, tables in members[0].frames.items()
    }  # fmt: skip
    worst = tuple(np.max([m.grid_error for m in members], 0).tolist())
    first = members[values.index(own)]
    made = replace(
        first,
        **parts,
        frames=frames,
        grid_error=worst,
        family=Family(key, np.array(values), knots, degree, own),
    )
    off = max(
        _largest_difference(made.member(v), one)
        for v, one in zip(midpoints(values), between)
    )
    return replace(made, family=replace(made.family, error=off))


def midpoints(values: list[float]) -> list[float]:
    """Return the values halfway from one to the next."""
    return [(a + b) / 2 for a, b in pairwise(values)]


def _largest_difference(one: Chart, other: Chart) -> float:
    """Return the largest distance, body lengths, between net positions of two charts."""
    nets = [
        [tiers(c, gait)["harmonic"].net for gait in loops(one.axes)]
        for c in (one, other)
    ]
    return float(
        np.hypot(*(np.array(nets[0]) - nets[1])[:, :2].T).max()
        / body_size(one.scene.system)
    )


def _map_tables(chart: Chart, f) -> Chart:
    """Return the chart with all of its tables through a function."""
    parts = {
        name: f(getattr(chart, name)) for name in ("harmonics", "residual", "outline")
    }
    of = lambda t: FrameTables(
        f(t.A), f(t.ccf), f(t.ccf_error), None if t.pose is None else f(t.pose)
    )
    return replace(
        chart, **parts, frames={name: of(t) for name, t in chart.frames.items()}
    )


def _coefficients(field: Field) -> np.ndarray:
    """Return the coefficients of the spline through a field, components last, (N_1, N_2, K)."""
    return _single_precision(
        np.asarray(field.spline.c).reshape(*map(len, field.axes), -1)
    )


def _components_last(values: np.ndarray) -> np.ndarray:
    return np.moveaxis(values, 0, -1)


def _single_precision(values: np.ndarray) -> np.ndarray:
    """Return values rounded to single precision."""
    return np.ascontiguousarray(values, np.float32)
