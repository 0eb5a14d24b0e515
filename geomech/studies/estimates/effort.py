"""The effort of moving: the metric of a system's shape space, and path length, work and
cost of transport of its gaits.

Power is in axial drags of the whole body times body lengths per unit of time, in which
the phase grows by 1 rad; in a fluid the drag is that at a body length per unit of time.
Work is the integral of power over a cycle, in drag x BL. Path length is the integral of
F = power^(1/degree) (`geomech.mathematics.geometry.metric`), in body lengths: F is the
speed at which towing the body, straight and along itself, takes the same power. In a
dry medium path length and work are the same number.

Efficiency is the net distance in body lengths over path length. Cost of transport is
the work over that of towing the body as far in the same time. A system with its own
metric has a path length in units of that metric, and no work."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache, partial
from typing import Any

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.mathematics.gaits import Gait
from geomech.mathematics.geometry import connection, metric
from geomech.mathematics.geometry.metric import Finsler, Metric
from geomech.mathematics.geometry.representations.harmonics import Harmonics
from geomech.mathematics.systems.base import System, body_size, kind_of
from geomech.mathematics.systems.capabilities import (
    Dissipative,
    OwnMetric,
    capability,
    gaits_per_batch,
    pieces_per_length,
    power,
    stored_table,
    velocity_and_power,
)
from geomech.mathematics.systems.premises import because, listed
from geomech.mathematics.tiers import harmonic
from geomech.mathematics.tiers.base import Numerics, Table, in_groups
from geomech.mathematics.tiers.fitted import axes
from geomech.mathematics.tiers.harmonic import HARMONIC
from geomech.scenes.model import Scene
from geomech.studies.displacement.variables import DIMS
from geomech.studies.estimates.elements import error_by_elements, n_elements
from geomech.studies.estimates.estimate import MAX_PIECES, every_nth_phase
from rft.core.checks import in_range, real_array
from rft.core.premise import ALL, SHAPE_ALONE
from rft.core.refusal import Refusal

DEPENDS_ON = ("grid", "extent", "interpolation")  # of [numerics]
# Of a norm: the harmonics that the 24 directions of the harmonic table resolve well.
HIGHEST_HARMONIC = 14
METRIC_UNIT = "own metric"  # of path lengths by the metric of the system itself
# The axial drag of the whole body, in a fluid at 1 BL per rad of phase.
WORK_UNIT = "drag x BL"
EVEN_TOLERANCE = 1e-6  # of the power: above a solver's tolerance


def why_no_metric(system: System) -> str:
    """Return why a system has no metric, in words that follow its name; "" if it has
    one."""
    parts = because(system, SHAPE_ALONE)
    if parts:
        return f"no metric with {parts}: its power does not follow from shape alone"
    if stored_table(system, "metric") or capability(system, OwnMetric) is not None:
        return ""

    has_power = capability(system, Dissipative) is not None
    if stored_table(system, "connection") and not has_power:
        return (
            "no metric with this table: its file gives no power, and the scene has no "
            "medium"
        )
    if system.traits.power_degree is None:
        reason = "nothing defines what moving costs"
        if has_power:
            reason = "its power is not proportional to one power of the rate"
        return f"no metric with {_responsible_parts(system)}: {reason}"
    if not is_quadratic(system) and system.joints != 2:
        return (
            f"no metric of {system.joints} joints where power is not quadratic: its "
            "norm is available only for two"
        )
    if not _is_even(system):
        return (
            f"no metric with {_responsible_parts(system)}: its power differs between "
            "opposite directions"
        )
    return ""


def is_quadratic(system: System) -> bool:
    """Return whether power is a quadratic form of alphadot, as in a linear medium with
    xi = A alphadot."""
    return system.traits.linear and system.traits.power_degree in (None, 2.0)


def _responsible_parts(system: System) -> str:
    """Return the parts of a system that break a premise; the whole system where none
    does."""
    return listed(system, ALL)


@lru_cache(maxsize=16)
def _is_even(system: System) -> bool:
    """Return whether power is equal for alphadot and -alphadot, tested at a few
    shapes."""
    if system.traits.linear:
        return True
    rng = np.random.default_rng(0)
    alpha = rng.uniform(-1.0, 1.0, (connection.EVEN_SHAPES, 1, 2))
    alphadot = connection.directions(2, 8)
    forward = power(system, alpha, alphadot)
    backward = power(system, alpha, -alphadot)
    largest = np.abs(forward).max()
    return bool(np.abs(forward - backward).max() <= EVEN_TOLERANCE * largest)


def fit_metric(
    system: System, numerics: Numerics, progress: Callable | None = None
) -> Metric | Finsler:
    """Return the metric on the field's grid: quadratic where power is, else a norm.
    Refusal if there is none."""
    _refuse_without_metric(system)
    stored = stored_table(system, "metric")
    if stored:
        return stored

    grid = axes(system, numerics)
    degree = numerics.interpolation
    periods = system.traits.periods
    own = capability(system, OwnMetric)
    if own is not None or is_quadratic(system):
        power_of = partial(power, system) if own is None else own.squared_speed
        return metric.fit(
            power_of,
            grid,
            degree,
            progress,
            periods=periods,
            singularity=system.traits.singularity,
        )
    norm = partial(_norm_at, system)
    count = harmonic.directions(system, numerics)
    return metric.fit_norm(
        norm,
        grid,
        count,
        degree,
        progress,
        highest=HIGHEST_HARMONIC,
        periods=periods,
    )


def _refuse_without_metric(system: System) -> None:
    reason = why_no_metric(system)
    if reason:
        raise Refusal(reason)


def shares_velocities(system: System) -> bool:
    """Return whether the metric comes from the same velocities as the harmonic
    table."""
    has_other_source = (
        system.traits.linear
        or system.traits.periods  # whose axes have ends that are solved once
        or capability(system, OwnMetric) is not None
        or stored_table(system, "connection")
    )
    return not has_other_source and HARMONIC.is_offered(system)


def shared_table(system: System, numerics: Numerics) -> Table:
    """Return the harmonic table as it is built together with the metric."""
    return harmonic.table(_PowerRecorder(system), numerics)


def fit_with_harmonics(
    system: System, numerics: Numerics, progress: Callable | None = None
) -> tuple[Harmonics, Metric | Finsler]:
    """Return the harmonic table and the metric from the same balances of force. Refusal
    if there is no metric."""
    _refuse_without_metric(system)
    recorder = _PowerRecorder(system)
    harmonics = harmonic.table(recorder, numerics).build(progress)

    P = np.concatenate(recorder.powers)
    shape = tuple(map(len, harmonics.axes))
    # With mirror symmetry half of the grid is solved, and the other half is its image.
    n_missing = np.prod(shape) - len(P)
    P = np.concatenate([P, P[:n_missing][::-1]])
    F = _norm(P, system.traits.power_degree).T.reshape(-1, *shape)
    unit = connection.directions(2, len(F))
    norm = metric.norm_from_samples(
        F, harmonics.axes, unit, harmonics.degree, highest=HIGHEST_HARMONIC
    )
    return harmonics, norm


class _PowerRecorder:
    """A system that records powers whenever its velocities are computed, shape after
    shape on half of the grid."""

    def __init__(self, system: System):
        self.system = system
        self.powers: list[np.ndarray] = []
        self.traits = replace(system.traits, reversible=False)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.system, name)

    @property
    def velocity(self) -> _RecordedVelocity:
        return _RecordedVelocity(self.system, self.powers)


class _RecordedVelocity(connection.Reporting):
    """The velocity of a system, which also reports the power."""

    def __init__(self, system: System, powers: list):
        self.with_report = partial(velocity_and_power, system)
        self.receive = powers.append

    def __reduce__(self) -> tuple:
        return _RecordedVelocity, (self.with_report.args[0], [])


def _norm_at(system: System, alpha, alphadot) -> np.ndarray:
    return _norm(power(system, alpha, alphadot), system.traits.power_degree)


def _norm(power, degree: float) -> np.ndarray:
    """Return F = power^(1/degree), 0 where power is negative by roundoff."""
    return np.maximum(power, 0.0) ** (1.0 / degree)


def refuse_costless(scene: Scene) -> None:
    """Refuse a scene whose cost of moving is unknown."""
    system = scene.system
    if any(capability(system, kind) for kind in (Dissipative, OwnMetric)):
        return
    reason = "nothing defines what moving costs"
    if stored_table(system, "connection"):
        reason = "its file does not give it"
    raise Refusal(
        f"no path length or work for the {kind_of(system)}",
        where=scene.name,
        instead=reason,
    )


def effort(
    scene: Scene, gait: Gait | None = None, amplitudes=None, phases: int | None = None
) -> dict[str, np.ndarray]:
    """Return {"path_length", "work", "path_length_error", "work_error"} (B,) of a gait,
    or the scene's own, by the direct tier.

    Each error is a sum: the change with half of the phases, in time stepping at least a
    quarter of the change from half to a quarter of them; twice the change with twice
    the pieces into which effects cut the body; and what half and a quarter of the
    elements of a continuous body show (`geomech.studies.estimates.elements`). Changes
    by later cycles are not included. Path lengths are nan where power has no one degree
    in the rate. Refusal where the cost of moving is unknown."""
    system = scene.system
    gait = scene.fitting_gait(scene.gait if gait is None else gait)
    if amplitudes is None:
        amplitudes = [gait.amplitude]
    amplitudes = real_array("amplitudes", amplitudes).ravel()
    in_range("phases", phases or 8, 8, 1e6, whole=True)
    phases = effort_phases(scene, phases)
    finer = _with_twice_the_pieces(scene)

    def values_and_errors(amplitudes: np.ndarray) -> np.ndarray:
        shapes = gait.cycle(phases, amplitudes)
        values, error, quarter = _integrals_and_error(system, shapes)
        coarse_shapes = every_nth_phase(4, shapes)
        if finer is not None:
            change = _integrals(finer, *coarse_shapes) - quarter
            error += 2 * np.abs(change)
        if n_elements(system):
            error += effort_error_by_elements(system, *coarse_shapes, quarter)
        return np.concatenate([values, error], 1)

    group = gaits_per_batch(system, phases)
    columns = in_groups(values_and_errors, amplitudes, group)[:, :4].T
    names = ("path_length", "work", "path_length_error", "work_error")
    return dict(zip(names, columns))


def _with_twice_the_pieces(scene: Scene) -> System | None:
    """Return the system with pieces of half the length; None if effects cut none."""
    n_pieces = pieces_per_length(scene.system)
    if not n_pieces:
        return None
    return scene.with_numerics(pieces=min(2 * n_pieces, MAX_PIECES)).system


def _integrals_and_error(
    system: System, shapes: tuple[np.ndarray, ...]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return path length and work (B, 2), their error by the phases, and both at a
    quarter of the phases."""
    rates = _rates(system, *shapes)
    full = _integral(rates)
    if not system.traits.steps:
        half = _integral(rates[..., ::2])
        return full, np.abs(full - half), _integral(rates[..., ::4])

    # Each step depends on the one before: fewer phases are other steps.
    half = _integrals(system, *every_nth_phase(2, shapes))
    quarter = _integrals(system, *every_nth_phase(4, shapes))
    error = np.maximum(np.abs(full - half), np.abs(half - quarter) / 4)
    return full, error, quarter


def _integrals(system: System, alpha, alphadot) -> np.ndarray:
    """Return path length and work (B, 2) of one cycle."""
    return _integral(_rates(system, alpha, alphadot))


def _integral(rates: np.ndarray) -> np.ndarray:
    """Return the integral over a cycle of values at its phases, (..., N)."""
    return 2 * np.pi * rates.mean(-1)


def effort_error_by_elements(
    system: System, alpha, alphadot, values: np.ndarray
) -> np.ndarray:
    """Return the errors (B, 2) of path length and work, ``values``, that the elements
    of a continuous body cause."""

    def difference(a, b):
        return np.abs(a - b)

    return error_by_elements(system, alpha, alphadot, values, _integrals, difference)


def effort_phases(scene: Scene, phases: int | None = None) -> int:
    """Return the number of phases of `effort`, a multiple of 4, from the number given
    or the scene's own."""
    least = 32 if scene.system.traits.steps else 8
    phases = phases or scene.numerics.phases
    return max(least, -(-phases // 4) * 4)


def _rates(system: System, alpha, alphadot) -> np.ndarray:
    """Return the integrands of path length and work, (B, 2, N), nan where there is
    none."""
    own = capability(system, OwnMetric)
    if own is not None:  # a metric has no work
        square = np.asarray(own.squared_speed(alpha, alphadot))
        return np.stack([_norm(square, 2.0), np.full_like(square, np.nan)], 1)

    work = system.run(alpha, alphadot, True).work
    if work is None:
        P = power(system, alpha, alphadot)
    else:
        P = work.power / body_size(system)
    degree = system.traits.power_degree
    F = np.full_like(P, np.nan)
    if degree is not None:
        F = _norm(P, degree)
    return np.stack([F, P], 1)


def with_effort(result: Result, scene: Scene, gait: Gait | None = None) -> Result:
    """Return a result of net displacements with path length and work of a cycle, their
    errors, and by tier the efficiency (net distance in body lengths over path length)
    and the cost of transport (work over that of towing the body as far); nan where
    undefined."""
    efforts = effort(scene, gait, result["amplitude"].values)
    distance = result["net_distance"].values / body_size(scene.system)
    degree = scene.system.traits.power_degree
    towing_work = np.nan * distance
    with np.errstate(divide="ignore", invalid="ignore"):
        if degree is not None:
            towing_work = distance * (distance / (2 * np.pi)) ** (degree - 1)
        ratios = {
            "efficiency": distance / efforts["path_length"],
            "cost_of_transport": efforts["work"] / towing_work,
        }

    unit = units(scene.system)
    added = []
    for name in ("path_length", "work"):
        error = efforts[f"{name}_error"]
        over = ("amplitude",)
        added.append(Variable(name, over, efforts[name], unit.get(name, ""), "", error))
    for name, values in ratios.items():
        added.append(Variable(name, DIMS, values, unit.get(name, "")))
    return replace(result, variables=(*result.variables, *added))


def units(system: System) -> dict[str, str]:
    """Return the units of the variables that `with_effort` adds."""
    if capability(system, OwnMetric) is not None:
        return {"path_length": METRIC_UNIT, "efficiency": f"BL / {METRIC_UNIT}"}
    return {
        "path_length": "BL",
        "work": WORK_UNIT,
        "efficiency": "BL/BL",
        "cost_of_transport": "1",
    }
