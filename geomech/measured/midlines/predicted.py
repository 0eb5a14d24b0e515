"""Measured against predicted: the motion in the world that a medium gives to the measured shapes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from geomech.geometry.reconstruct import displacement
from geomech.measured.midlines import intervals, kinematics, smooth
from geomech.measured.midlines.fit import Kinematics
from geomech.measured.midlines.kinematics import PHASES, QUANTITIES
from geomech.systems import Swimmer
from rft import Backbone
from rft.checks import number_fields
from rft.refusal import Refusal

HARMONICS = 5  # of the mean cycle's headings
ELEMENTS = smooth.NODES  # of the body; twice as many tell the error
RESAMPLED = 12  # times that noise is put on the midlines
COMPARED = "speed", "stride", "heading", "turn", "slip", "efficiency"
FACTORS = np.geomspace(1 / 64, 64, 25)  # of a parameter, that are tried first
MOVED = (
    1e-4  # relative change of the stride, below which a parameter does not change it
)
FINE = 1e-3  # relative accuracy of a parameter that closes the gap


@dataclass(frozen=True)
class Closing:
    """A parameter of the medium that makes the predicted speed the measured one.

    value, error: nan where none within bounds does; low, high: the bounds tried. unit: "-" for none."""

    name: str
    present: float
    unit: str
    value: float
    error: float
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class Comparison:
    """Quantities of COMPARED, measured and predicted, with half widths of intervals, (Q,) each, and what would close the gap.

    per_cycle: predicted (C, Q), pseudo-values."""

    medium: Any
    measured: np.ndarray
    measured_error: np.ndarray
    predicted: np.ndarray
    predicted_error: np.ndarray
    per_cycle: np.ndarray
    closing: tuple[Closing, ...]


def compare(fit: Kinematics, medium: Any, effects: tuple = ()) -> Comparison:
    """Return the measured motion beside that of the measured shapes in a medium. effects: of the scene, such as drag on
    the head."""
    swimmer = Swimmer(medium, Backbone(ELEMENTS), effects)
    near = fit.clock.phase(fit.curve)

    def values(
        swimmer: Swimmer,
    ) -> Callable[[smooth.Curve], tuple[np.ndarray, np.ndarray]]:
        def of(curve: smooth.Curve) -> tuple[np.ndarray, np.ndarray]:
            cycles = fit.cycles(curve, near)
            return kinematics.pseudo_values(
                lambda w: _predicted(swimmer, cycles, w, fit), len(fit.used)
            )

        return of

    phase = fit.clock.of_frames(fit.curve)
    sample = intervals.sampled(
        fit.curve, fit.coarse, values(swimmer), phase, RESAMPLED
    )
    found = intervals.intervals(sample, fit.level)
    finer = (
        values(Swimmer(medium, Backbone(2 * ELEMENTS), effects))(fit.curve)[0]
        - sample.value
    )
    k = [QUANTITIES.index(name) for name in COMPARED]
    predicted_error = np.hypot(found.half_width, finer)
    measured, error = fit.intervals.value[k], fit.intervals.half_width[k]
    value = found.value + 4 / 3 * finer  # elements are chords: errors of order 2
    comparison = Comparison(
        medium, measured, error, value, predicted_error, found.per_cycle, ()
    )
    return replace(comparison, closing=_closing(comparison, swimmer, fit, effects))


def _predicted(
    swimmer: Swimmer, cycles: kinematics.Cycles, weights: np.ndarray, fit: Kinematics
) -> np.ndarray:
    """Return COMPARED (R, Q) of the mean cycles with weights (R, C)."""
    each = kinematics.averages(cycles)
    time, own, _, _, axis, _, cosine = each.weighted(weights).numbers.T
    body = own if fit.trial.length is None else np.full_like(own, fit.trial.length)
    alpha, alphadot = _bends(cycles, weights, swimmer.joints + 1)
    xi = swimmer.velocity(alpha, alphadot)
    net = displacement(xi)
    slip = swimmer.work(alpha, alphadot, xi).slip.mean(-1)
    net_in_mean_axis = _about_mean(xi, net)
    stride = np.hypot(net[:, 0], net[:, 1])
    wavelength = (
        own / body * cosine * kinematics.arc_waves(each.weighted(weights).first)
    )
    speed = stride / time * (body if fit.trial.unit == "m" else 1.0)
    return np.stack(
        [speed, stride, axis + net_in_mean_axis, net[:, 2], slip, stride / wavelength],
        -1,
    )


def _about_mean(xi: np.ndarray, net: np.ndarray) -> np.ndarray:
    """Return the direction (R,) of net poses (R, 3), less the mean heading of the cycle."""
    from geomech.geometry.reconstruct import poses

    heading = poses(xi)[..., 2].mean(-1)
    angle = np.arctan2(net[:, 1], net[:, 0]) - heading
    return (angle + np.pi) % (2 * np.pi) - np.pi


def _bends(
    cycles: kinematics.Cycles, weights: np.ndarray, elements: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return bends and their rates (R, PHASES, elements - 1) of mean cycles, by HARMONICS harmonics."""
    spectrum = np.fft.rfft(np.tensordot(weights, cycles.headings, 1), axis=1)[
        :, : HARMONICS + 1
    ]
    wave = np.arange(HARMONICS + 1)[:, None]
    restored = lambda s: np.fft.irfft(s, PHASES, axis=1)
    places = (np.arange(elements) + 0.5) / elements
    between = lambda x: np.diff(_at(x, places), axis=-1)
    return between(restored(spectrum)), between(restored(1j * wave * spectrum))


def _at(headings: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return headings at other places along the body, by Legendre polynomials through those at equal parts."""
    from numpy.polynomial import legendre

    count = headings.shape[-1]
    s = (np.arange(count) + 0.5) / count
    degree = min(16, int(2 * np.sqrt(count)) + 4)
    matrix = legendre.legvander(2 * places - 1, degree) @ np.linalg.pinv(
        legendre.legvander(2 * s - 1, degree)
    )
    return headings @ matrix.T


def _closing(
    comparison: Comparison, swimmer: Swimmer, fit: Kinematics, effects: tuple
) -> tuple[Closing, ...]:
    """Return, for every parameter of the medium that changes the stride, the value that makes it the measured one."""
    cycles, weights = (
        fit.cycles(fit.curve),
        np.full((1, len(fit.used)), 1 / len(fit.used)),
    )
    alpha, alphadot = _bends(cycles, weights, swimmer.joints + 1)
    present, wanted = comparison.predicted[1], comparison.measured[1]
    error = math.hypot(comparison.measured_error[1], comparison.predicted_error[1])

    def stride(medium: Any) -> float:
        net = displacement(
            Swimmer(medium, swimmer.body, effects).velocity(alpha, alphadot)
        )
        return float(np.hypot(net[0, 0], net[0, 1]))

    offset = present - stride(swimmer.medium)  # of elements and noise, the same for all
    found = []
    for name, number in number_fields(type(swimmer.medium)).items():
        value = getattr(swimmer.medium, name)
        if value is None or name == "k":
            continue
        gap = lambda x, name=name: (
            stride(_changed(swimmer.medium, name, x)) + offset - wanted
        )
        if (
            closing := _closed(
                name, number.unit, float(value), gap, error, swimmer.medium, present
            )
        ) is not None:
            found.append(closing)
    return tuple(found)


def _changed(medium: Any, name: str, value: float) -> Any:
    return replace(
        medium,
        **{name: value},
        **({"covariance": None} if hasattr(medium, "covariance") else {}),
    )


def _closed(name, unit, value, gap, error, medium, stride) -> Closing | None:
    """Return where a parameter closes the gap; None for one that does not change the stride."""
    from scipy.optimize import brentq

    tried, gaps = [], []
    for x in value * FACTORS if value else np.geomspace(1e-3, 1e3, 13):
        try:
            gaps.append(gap(float(x)))
            tried.append(float(x))
        except Refusal:
            continue  # beyond the bounds of a medium
    tried, gaps = np.array(tried), np.array(gaps)
    if len(gaps) < 2 or np.ptp(gaps) < MOVED * stride:
        return None
    closing = Closing(name, value, unit, math.nan, math.nan, tried[0], tried[-1])
    changes = np.flatnonzero(np.sign(gaps[1:]) != np.sign(gaps[:-1]))
    if not changes.size:
        return closing
    k = (
        changes[np.abs(np.log(tried[changes] / value)).argmin()]
        if value
        else changes[0]
    )
    root = float(brentq(gap, tried[k], tried[k + 1], xtol=1e-12, rtol=FINE))
    slope = (gap(root * 1.02) - gap(root * 0.98)) / (0.04 * root)
    return replace(closing, value=root, error=float(error / max(abs(slope), 1e-300)))
