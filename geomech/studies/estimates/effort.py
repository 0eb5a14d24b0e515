"""The cost of moving: the metric of a system's shape space, and path length, work and
cost of transport of its gaits.

Power is in axial drags of the whole body times body lengths per unit of time, in which
phase grows by 1 rad; in a fluid the drag is that at a body length per unit of time.
Work is its integral over a cycle, in drag x BL. Path length is the integral of F =
power^(1/degree) (`geomech.mathematics.geometry.metric`), the speed at which towing the
body, straight and along itself, takes the same power; so it is in body lengths, and in
a dry medium the same number as work. Efficiency is the net distance in body lengths
over it, cost of transport the work over that of towing the body as far in the same
time. A system with a metric of its own has a path length in units of that alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache, partial
from typing import Any

import numpy as np

from geomech.core.variables import Result, Variable
from geomech.mathematics.gaits import Gait
from geomech.mathematics.geometry import connection, metric
from geomech.mathematics.geometry.gait import checked_gait
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
from geomech.studies import tables
from geomech.studies.estimates.elements import error_by_elements, n_elements
from geomech.studies.estimates.estimate import MAX_PIECES
from rft.core.checks import in_range, real_array
from rft.core.premise import ALL, SHAPE_ALONE
from rft.core.refusal import Refusal

DEPENDS_ON = ("grid", "extent", "interpolation")  # of [numerics]
HIGHEST_HARMONIC = (
    14  # harmonic of a norm that the 24 directions of the harmonic table resolve well
)
METRIC_UNIT = "own metric"  # unit of path lengths by the metric of the system itself
WORK_UNIT = (
    "drag x BL"  # the axial drag of the whole body, in a fluid at 1 BL per rad of phase
)
EVEN_TOLERANCE = 1e-6  # of the power: above a solver's tolerance


def why_no_metric(system: System) -> str:
    """Return why a system has no metric, in words that follow its name; "" if it has
    one."""
    if parts := because(system, SHAPE_ALONE):
        return f"no metric with {parts}: its power does not follow from shape alone"
    if stored_table(system, "metric") or capability(system, OwnMetric) is not None:
        return ""
    if stored_table(system, "connection") and capability(system, Dissipative) is None:
        return "no metric with this table: its file tells no power, and the scene no medium"
    if system.traits.power_degree is None:
        has_power = capability(system, Dissipative) is not None
        power = (
            "its power is of no one degree in the rate"
            if has_power
            else "nothing says what moving costs"
        )
        return f"no metric with {_responsible_parts(system)}: {power}"
    if not is_quadratic(system) and system.joints != 2:
        return f"no metric of {system.joints} joints where power is not quadratic: its norm is told for two"
    return (
        ""
        if _is_even(system)
        else f"no metric with {_responsible_parts(system)}: one way costs another power than the way back"
    )


def is_quadratic(system: System) -> bool:
    """Return whether power is a quadratic form of alphadot: that of a linear medium
    where xi = A alphadot."""
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
    alpha, alphadot = (
        rng.uniform(-1.0, 1.0, (connection.EVEN_SHAPES, 1, 2)),
        connection.directions(2, 8),
    )
    forth, back = (power(system, alpha, sign * alphadot) for sign in (1, -1))
    return bool(np.abs(forth - back).max() <= EVEN_TOLERANCE * np.abs(forth).max())


def fit_metric(
    system: System, numerics: Numerics, progress: Callable | None = None
) -> Metric | Finsler:
    """Return the metric on the field's grid: quadratic where xi = A alphadot, else a
    norm. Refusal if there is none."""
    if reason := why_no_metric(system):
        raise Refusal(reason)
    if own := stored_table(system, "metric"):
        return own
    grid, degree = axes(system, numerics), numerics.interpolation
    own = capability(system, OwnMetric)
    if own is not None or is_quadratic(system):
        return metric.fit(
            own.squared_speed if own else partial(power, system), grid, degree, progress
        )
    norm = partial(_norm_at, system)
    count = harmonic.directions(system, numerics)
    return metric.fit_norm(
        norm, grid, count, degree, progress, highest=HIGHEST_HARMONIC
    )


def shares_velocities(system: System) -> bool:
    """Return whether the metric can be computed from the velocities of the harmonic
    table."""
    of_its_own = (
        system.traits.linear
        or capability(system, OwnMetric) is not None
        or stored_table(system, "connection")
    )
    return not of_its_own and HARMONIC.is_offered(system)


def shared_table(system: System, numerics: Numerics) -> Table:
    """Return the harmonic table as it is built with the metric."""
    return harmonic.table(_PowerRecorder(system), numerics)


def fit_with_harmonics(
    system: System, numerics: Numerics, progress: Callable | None = None
) -> tuple[Harmonics, Metric | Finsler]:
    """Return the harmonic table and the metric from the same force balances. Refusal if
    there is no metric."""
    if reason := why_no_metric(system):
        raise Refusal(reason)
    watched = _PowerRecorder(system)
    harmonics = harmonic.table(watched, numerics).build(progress)
    P, size = np.concatenate(watched.powers), np.prod([len(a) for a in harmonics.axes])
    P = np.concatenate(
        [P, P[: size - len(P)][::-1]]
    )  # with mirror symmetry half of the grid is solved
    F = _norm(P, system.traits.power_degree).T.reshape(-1, *map(len, harmonics.axes))
    unit = connection.directions(2, len(F))
    return harmonics, metric.norm_from_samples(
        F, harmonics.axes, unit, harmonics.degree, highest=HIGHEST_HARMONIC
    )


class _PowerRecorder:
    """A system that records powers whenever its velocities are computed, shape after
    shape on half of the grid."""

    def __init__(self, system: System):
        self.system, self.powers = system, []
        self.traits = replace(system.traits, reversible=False)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.system, name)

    @property
    def velocity(self) -> _RecordedVelocity:
        return _RecordedVelocity(self.system, self.powers)


class _RecordedVelocity(connection.Reporting):
    """The velocity of a system, which also passes on the power."""

    def __init__(self, system: System, powers: list):
        self.with_report, self.receive = (
            partial(velocity_and_power, system),
            powers.append,
        )

    def __reduce__(self) -> tuple:
        return _RecordedVelocity, (self.with_report.args[0], [])


def _norm_at(system: System, alpha, alphadot) -> np.ndarray:
    return _norm(power(system, alpha, alphadot), system.traits.power_degree)


def _norm(power, degree: float) -> np.ndarray:
    return np.maximum(power, 0.0) ** (1.0 / degree)


def refuse_costless(scene: Scene) -> None:
    """Refuse a scene whose cost of moving is not known."""
    system = scene.system
    if not any(capability(system, kind) for kind in (Dissipative, OwnMetric)):
        what = (
            "its file does not tell it"
            if stored_table(system, "connection")
            else "nothing says what moving costs"
        )
        raise Refusal(
            f"no path length or work with the {kind_of(system)}",
            where=scene.name,
            instead=what,
        )


def effort(
    scene: Scene, gait: Gait | None = None, amplitudes=None, phases: int | None = None
) -> dict[str, np.ndarray]:
    """Return {"path_length", "work", "path_length_error", "work_error"} (B,) of a gait,
    or the scene's own, by the direct tier.

    Each error is the change with half of the phases; in time stepping at least a
    quarter of the change from half to a quarter of them; twice the change with twice
    the pieces into which effects cut the body; and what half and a quarter of the
    elements of a continuous body show (`geomech.studies.estimates.elements`). Changes
    by later cycles are not included. Path lengths are nan where power has no one degree
    in the rate. Refusal where the cost of moving is not known."""
    system, gait = scene.system, checked_gait(scene.gait if gait is None else gait)
    amplitudes = real_array(
        "amplitudes", [gait.amplitude] if amplitudes is None else amplitudes
    ).ravel()
    in_range("phases", phases or 8, 8, 1e6, whole=True)
    phases = effort_phases(scene, phases)
    finer = (
        scene.with_numerics(
            pieces=min(2 * pieces_per_length(system), MAX_PIECES)
        ).system
        if pieces_per_length(system)
        else None
    )

    integral = lambda rates: 2 * np.pi * rates.mean(-1)

    def integrals(amplitudes):
        shapes = gait.cycle(phases, amplitudes)
        rates = _rates(system, *shapes)
        fine = integral(rates)
        fewer = [tuple(x[..., ::step, :] for x in shapes) for step in (2, 4)]
        if (
            system.traits.steps
        ):  # each step depends on the one before: fewer phases are other steps
            half, quarter = (integral(_rates(system, *coarser)) for coarser in fewer)
            error = np.maximum(np.abs(fine - half), np.abs(half - quarter) / 4)
        else:
            half, quarter = (integral(rates[..., ::step]) for step in (2, 4))
            error = np.abs(fine - half)
        if finer:
            error += 2 * np.abs(integral(_rates(finer, *fewer[1])) - quarter)
        if n_elements(system):
            error += effort_error_by_elements(system, *fewer[1], quarter)
        return np.concatenate([fine, error], 1)

    names = ("path_length", "work", "path_length_error", "work_error")
    return dict(
        zip(
            names,
            in_groups(integrals, amplitudes, gaits_per_batch(system, phases))[:, :4].T,
        )
    )


def effort_error_by_elements(
    system: System, alpha, alphadot, values: np.ndarray
) -> np.ndarray:
    """Return the errors (B, 2) of path length and work, ``values``, that the elements
    of a continuous body cause."""

    def integrals(other, *shapes):
        return 2 * np.pi * _rates(other, *shapes).mean(-1)

    def apart(a, b):
        return np.abs(a - b)

    return error_by_elements(system, alpha, alphadot, values, integrals, apart)


def effort_phases(scene: Scene, phases: int | None = None) -> int:
    """Return the number of phases of `effort`, rounded up, from the number given or the
    scene's own."""
    return max(
        32 if scene.system.traits.steps else 8,
        -(-(phases or scene.numerics.phases) // 4) * 4,
    )


def _rates(system: System, alpha, alphadot) -> np.ndarray:
    """Return the integrands of path length and work, (B, 2, N), nan where there is
    none."""
    degree = system.traits.power_degree
    own = capability(system, OwnMetric)
    if own is not None:  # a metric has no work
        square = np.asarray(own.squared_speed(alpha, alphadot))
        return np.stack([_norm(square, 2.0), np.full_like(square, np.nan)], 1)
    work = system.run(alpha, alphadot, True).work
    P = (
        power(system, alpha, alphadot)
        if work is None
        else work.power / body_size(system)
    )
    return np.stack(
        [np.full_like(P, np.nan) if degree is None else _norm(P, degree), P], 1
    )


def with_effort(result: Result, scene: Scene, gait: Gait | None = None) -> Result:
    """Return net displacements with path length and work of a cycle, their errors, and
    by tier the efficiency (net distance in body lengths over path length) and the cost
    of transport (work over that of towing the body as far); nan where undefined."""
    efforts, unit = effort(scene, gait, result["amplitude"].values), units(scene.system)
    degree, distance = (
        scene.system.traits.power_degree,
        result["net_distance"].values / body_size(scene.system),
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        towed = (
            np.nan * distance
            if degree is None
            else distance * (distance / (2 * np.pi)) ** (degree - 1)
        )
        ratios = {
            "efficiency": distance / efforts["path_length"],
            "cost_of_transport": efforts["work"] / towed,
        }
    extra = [
        Variable(
            key,
            ("amplitude",),
            efforts[key],
            unit.get(key, ""),
            "",
            efforts[f"{key}_error"],
        )
        for key in ("path_length", "work")
    ]
    extra += [
        Variable(key, tables.DIMS, x, unit.get(key, "")) for key, x in ratios.items()
    ]
    return replace(result, variables=(*result.variables, *extra))


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
