"""Measured against predicted: the motion in the world that a medium gives to the
measured shapes."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from geomech.mathematics.geometry.reconstruct import displacement
from geomech.mathematics.systems import Swimmer
from geomech.runs.backend import prefer_backend
from geomech.runs.cost import assumed_seconds
from geomech.studies.measured.midlines import intervals, kinematics, smooth
from geomech.studies.measured.midlines.fit import Kinematics
from geomech.studies.measured.midlines.kinematics import PHASES, QUANTITIES
from rft import Backbone
from rft.core.checks import number_fields
from rft.core.refusal import Refusal
from rft.motion.work import slip_angles

HARMONICS = 5  # of the mean cycle's headings
ELEMENTS = smooth.NODES  # of the body; twice as many give the error
RESAMPLED = 12  # times that noise is added to the midlines
COMPARED = ("speed", "stride", "heading", "turn", "slip", "efficiency")
FACTORS = np.geomspace(1 / 64, 64, 25)  # of a parameter, that are tried first
# Of the stride: a parameter with a smaller effect does not change it.
LEAST_CHANGE = 1e-4
FINE = 1e-3  # relative accuracy of a parameter that closes the gap


@dataclass(frozen=True)
class Closing:
    """A parameter of the medium that makes the predicted speed the measured one.

    value, error: nan where none within bounds does; low, high: the bounds tried. unit:
    "-" for none."""

    name: str
    present: float
    unit: str
    value: float
    error: float
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class Comparison:
    """Quantities of COMPARED, measured and predicted, with half widths of intervals,
    (Q,) each, and what would close the gap.

    per_cycle: predicted (C, Q), pseudo-values. ends: (Q,), what ends of the body that
    have no points may change of the prediction at most; the intervals contain it.
    notes: what was taken for granted."""

    medium: Any
    measured: np.ndarray
    measured_error: np.ndarray
    predicted: np.ndarray
    predicted_error: np.ndarray
    per_cycle: np.ndarray
    closing: tuple[Closing, ...]
    ends: np.ndarray | None = None
    notes: tuple[str, ...] = ()


def compare(fit: Kinematics, medium: Any, effects: tuple = ()) -> Comparison:
    """Return the measured motion beside that of the measured shapes in a medium.

    The body that moves is the piece from the first point to the last, and its motion is
    told in the unit of the measured one. effects: of the scene, such as drag on the
    head; their lengths are in lengths of that piece."""
    # Means of all cycles, and of all but each, are solved for at every resampling.
    means = 2 * RESAMPLED + 4
    count = means * (len(fit.used) + 1) * PHASES
    with prefer_backend(assumed_seconds(count, ELEMENTS, False, means, "numpy")):
        return _compared(fit, medium, effects)


def _compared(fit: Kinematics, medium: Any, effects: tuple) -> Comparison:
    """Return what `compare` does."""
    swimmer = Swimmer(medium, Backbone(ELEMENTS), effects)
    near = fit.clock.phase(fit.curve)

    def values(swimmer: Swimmer, curve: smooth.Curve) -> tuple[np.ndarray, np.ndarray]:
        cycles = fit.cycles(curve, near)

        def predicted(weights):
            return _predicted(swimmer, cycles, weights, fit)

        return kinematics.pseudo_values(predicted, len(fit.used))

    sample = intervals.sampled(
        fit.curve,
        fit.coarse,
        partial(values, swimmer),
        fit.clock.frame_phases(fit.curve),
        RESAMPLED,
    )
    found = intervals.intervals(sample, fit.level)
    fine_value, _ = values(Swimmer(medium, Backbone(2 * ELEMENTS), effects), fit.curve)
    finer = fine_value - sample.value
    ends = _change_by_ends(fit, swimmer, sample.value)
    k = [QUANTITIES.index(name) for name in COMPARED]
    value = found.value + 4 / 3 * finer  # elements are chords: errors of order 2
    comparison = Comparison(
        medium=medium,
        measured=fit.intervals.value[k],
        measured_error=fit.intervals.half_width[k],
        predicted=value,
        predicted_error=np.sqrt(found.half_width**2 + finer**2 + ends**2),
        per_cycle=found.per_cycle,
        closing=(),
        ends=ends,
        notes=_notes(fit, value, ends),
    )
    return replace(comparison, closing=_closing(comparison, swimmer, fit, effects))


def _predicted(
    swimmer: Swimmer,
    cycles: kinematics.Cycles,
    weights: np.ndarray,
    fit: Kinematics,
    tail: float = 0.0,
    head: float = 0.0,
    straight: bool = False,
) -> np.ndarray:
    """Return COMPARED (R, Q) of the mean cycles with weights (R, C).

    tail, head: lengths of the ends without points that the body has beyond the piece,
    over that of the piece. straight: they follow the piece's ends, else they go on with
    its wave."""
    averages = kinematics.averages(cycles).weighted(weights)
    time, own, _, _, axis, _, cosine = averages.numbers.T
    body = own
    if fit.trial.length is not None:
        body = np.full_like(own, fit.trial.length)
    alpha, alphadot = _bends(cycles, weights, swimmer.joints + 1, tail, head, straight)
    xi = swimmer.velocity(alpha, alphadot)
    net = displacement(xi)
    moved = (swimmer.medium, swimmer.body, alpha, alphadot, xi)
    slip = slip_angles(*moved, effects=swimmer.effects).mean(-1)
    heading = axis + _about_mean(xi, net)
    # The balance is for a body of length 1, the piece with its ends.
    distance = np.hypot(net[:, 0], net[:, 1]) * own * (1 + tail + head)
    stride = distance / body
    wavelength = own / body * cosine * kinematics.arc_waves(averages.first)
    speed = distance / time
    if fit.trial.unit != "m":
        speed = speed / body
    efficiency = stride / wavelength
    return np.stack([speed, stride, heading, net[:, 2], slip, efficiency], -1)


def _about_mean(xi: np.ndarray, net: np.ndarray) -> np.ndarray:
    """Return the direction (R,) of net poses (R, 3), less the mean heading of the
    cycle."""
    from geomech.mathematics.geometry.reconstruct import poses

    heading = poses(xi)[..., 2].mean(-1)
    angle = np.arctan2(net[:, 1], net[:, 0]) - heading
    return (angle + np.pi) % (2 * np.pi) - np.pi


def _change_by_ends(fit: Kinematics, swimmer: Swimmer, piece: np.ndarray) -> np.ndarray:
    """Return how much ends of the body without points may change the prediction (Q,) of
    the piece between them.

    The missing length is put at the tail, at the head, or half at each, and it goes on
    with the wave or is straight: the largest change of these six."""
    missing = _missing(fit)
    if not missing:
        return np.zeros_like(piece)
    cycles = fit.cycles(fit.curve)
    weights = np.full((1, len(fit.used)), 1 / len(fit.used))
    changes = []
    for at_tail in (0.0, 0.5, 1.0):
        for straight in (False, True):
            tail = at_tail * missing
            head = (1 - at_tail) * missing
            longer = _predicted(swimmer, cycles, weights, fit, tail, head, straight)
            changes.append(np.abs(longer[0] - piece))
    return np.max(changes, 0)


def _missing(fit: Kinematics) -> float:
    """Return the length of the body beyond its points, over that of the piece between
    them."""
    if fit.trial.length is None:
        return 0.0
    return max(0.0, fit.trial.length / fit.own_length - 1)


def _notes(fit: Kinematics, predicted: np.ndarray, ends: np.ndarray) -> tuple[str, ...]:
    """Return a note on ends of the body that have no points."""
    missing = _missing(fit)
    if not missing:
        return ()
    stride = COMPARED.index("stride")
    change = ends[stride] / predicted[stride]
    return (
        "the prediction describes the part of the body that has points, "
        f"{1 / (1 + missing):.0%} of it: the ends may change the distance by at most "
        f"{change:.1%}, which its interval includes",
    )


def _bends(
    cycles: kinematics.Cycles,
    weights: np.ndarray,
    elements: int,
    tail: float = 0.0,
    head: float = 0.0,
    straight: bool = False,
) -> tuple[np.ndarray, np.ndarray]:
    """Return bends and their rates (R, PHASES, elements - 1) of mean cycles, by
    HARMONICS harmonics.

    tail, head, straight: as of `_predicted`; a wave that goes on has the time course of
    the end, later by its length."""
    headings = np.tensordot(weights, cycles.headings, 1)
    spectrum = np.fft.rfft(headings, axis=1)[:, : HARMONICS + 1]
    wave = np.arange(HARMONICS + 1)[:, None]
    places = (np.arange(elements) + 0.5) / elements * (1 + tail + head) - tail
    inside = np.clip(places, 0.0, 1.0)
    spectrum = _headings_at(spectrum, inside)
    if (tail or head) and not straight:
        first = kinematics.averages(cycles).weighted(weights).first
        turns = kinematics.wave_sign(first.mean(0)) / kinematics.arc_waves(first)
        later = 2j * np.pi * turns[:, None, None] * wave * (places - inside)
        spectrum = spectrum * np.exp(later)
    alpha = np.fft.irfft(np.diff(spectrum), PHASES, axis=1)
    alphadot = np.fft.irfft(np.diff(1j * wave * spectrum), PHASES, axis=1)
    return alpha, alphadot


def _headings_at(headings: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return headings at other places along the body, by Legendre polynomials through
    those at equal parts."""
    from numpy.polynomial import legendre

    count = headings.shape[-1]
    s = (np.arange(count) + 0.5) / count
    degree = min(16, int(2 * np.sqrt(count)) + 4)
    fit = np.linalg.pinv(legendre.legvander(2 * s - 1, degree))
    matrix = legendre.legvander(2 * places - 1, degree) @ fit
    return headings @ matrix.T


def _closing(
    comparison: Comparison, swimmer: Swimmer, fit: Kinematics, effects: tuple
) -> tuple[Closing, ...]:
    """Return, for every parameter of the medium that changes the stride, the value that
    makes it the measured one."""
    weights = np.full((1, len(fit.used)), 1 / len(fit.used))
    alpha, alphadot = _bends(fit.cycles(fit.curve), weights, swimmer.joints + 1)
    k = COMPARED.index("stride")
    present = comparison.predicted[k]
    measured = comparison.measured[k]
    error = math.hypot(comparison.measured_error[k], comparison.predicted_error[k])

    # The balance is in lengths of the piece that has points.
    share = 1.0
    if fit.trial.length is not None:
        share = fit.own_length / fit.trial.length

    def stride(medium: Any) -> float:
        varied = Swimmer(medium, swimmer.body, effects)
        net = displacement(varied.velocity(alpha, alphadot))
        return share * float(np.hypot(net[0, 0], net[0, 1]))

    offset = present - stride(swimmer.medium)  # of elements and noise, the same for all
    found = []
    for name, number in number_fields(type(swimmer.medium)).items():
        value = getattr(swimmer.medium, name)
        if value is None or name == "k":
            continue

        def gap(x, name=name):
            return stride(_changed(swimmer.medium, name, x)) + offset - measured

        closing = closing_of(name, number.unit, float(value), gap, error, present)
        if closing is not None:
            found.append(closing)
    return tuple(found)


def _changed(medium: Any, name: str, value: float) -> Any:
    """Return a medium with another value of a parameter, which has no covariance."""
    changes = {name: value}
    if hasattr(medium, "covariance"):
        changes["covariance"] = None
    return replace(medium, **changes)


def closing_of(name, unit, value, gap, error, stride) -> Closing | None:
    """Return where a parameter closes the gap; None for a parameter that does not
    change the stride."""
    from scipy.optimize import brentq

    candidates = np.geomspace(1e-3, 1e3, 13)
    if value:
        candidates = value * FACTORS
    tried = []
    gaps = []
    for x in candidates:
        try:
            gaps.append(gap(float(x)))
            tried.append(float(x))
        except Refusal:
            continue  # beyond the bounds of a medium
    tried = np.array(tried)
    gaps = np.array(gaps)
    if len(gaps) < 2 or np.ptp(gaps) < LEAST_CHANGE * stride:
        return None
    closing = Closing(name, value, unit, math.nan, math.nan, tried[0], tried[-1])
    changes = np.flatnonzero(np.sign(gaps[1:]) != np.sign(gaps[:-1]))
    if not changes.size:
        return closing
    k = changes[0]
    if value:
        k = changes[np.abs(np.log(tried[changes] / value)).argmin()]
    root = float(brentq(gap, tried[k], tried[k + 1], xtol=1e-12, rtol=FINE))
    slope = (gap(root * 1.02) - gap(root * 0.98)) / (0.04 * root)
    return replace(closing, value=root, error=float(error / max(abs(slope), 1e-300)))
