"""Recovery of the drag on a body after it has reversed (paper Sec. IV A)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rft.core.refusal import require
from rft.effects.transient import E_FOLDINGS
from rft.grains.drag import END
from rft.grains.experiment import Run
from rft.grains.motions import Stroke


class Drags(NamedTuple):
    """Drag on a rod that moves back and forth, against its motion, in bins of travel.

    amplitude (m). travel: (n,), path length so far at the middle of each bin, m. flank,
    ends: (n,), of the flank and of both ends together, N."""

    amplitude: float
    travel: np.ndarray
    flank: np.ndarray
    ends: np.ndarray


class Recovery(NamedTuple):
    """Drag = plateau (at_once + (1 - at_once) (1 + m) / 2) with the mean direction m of
    `rft.effects.Transient`.

    plateau: drag after a long travel, N. at_once: share of it. travel: m, over which m
    recovers. start: m in the fresh bed. rms: of the bins about the fit, over the
    plateau."""

    plateau: float
    at_once: float
    travel: float
    start: float
    rms: float

    def drag(self, travel: np.ndarray, amplitude: float) -> np.ndarray:
        """Return the drag, N, at path lengths so far (n,), m, of a rod that moves back
        and forth with an amplitude, m."""
        m = mean_direction(travel, amplitude, self.travel, self.start)
        return self.plateau * (self.at_once + (1 - self.at_once) * (1 + m) / 2)


def mean_direction(
    path: np.ndarray, amplitude: float, travel: float, start: float
) -> np.ndarray:
    """Return the mean direction of travel, 1 for the present one, at path lengths so
    far (n,), all lengths in one unit.

    The rod reverses at an amplitude and then at every second one. start: mean direction
    at first. travel: over which it recovers."""
    length = travel / E_FOLDINGS
    stroke = _reversals(path, amplitude).astype(int)
    out = np.empty_like(path)
    for k in range(stroke.max() + 1):
        begin = max(0, 2 * k - 1) * amplitude
        end = (2 * k + 1) * amplitude
        inside = stroke == k
        out[inside] = 1 - (1 - start) * np.exp(-(path[inside] - begin) / length)
        # After the reversal, what was forwards is backwards.
        start = -(1 - (1 - start) * np.exp(-(end - begin) / length))
    return out


def _reversals(path: np.ndarray, amplitude: float) -> np.ndarray:
    """Return the number of reversals (n,) before path lengths so far, of a rod that
    reverses at an amplitude and then at every second one."""
    return np.maximum(np.ceil((path / amplitude - 1) / 2), 0)


def drags(run: Run, stroke: Stroke, half_width: float, bin_width: float) -> Drags:
    """Return the drag on a round rod along x that moved back and forth, in bins (m) of
    travel that divide its amplitude.

    half_width (m): of the rod, whose ends reach `END` of them as in
    `rft.grains.drag.flank_and_ends`. Samples in which it reverses are left out."""
    amplitude = stroke.amplitude
    path = stroke.speed * run.t
    sample = stroke.speed * (run.t[1] - run.t[0])
    require(
        path[-1] > amplitude,
        "the body has not reversed its direction",
        instead="use a longer run",
    )

    # Samples between reversals, and the force on each sphere against the motion.
    reversals = _reversals(path, amplitude)
    has_one_direction = reversals == _reversals(path - sample, amplitude)
    direction = np.array([math.cos(stroke.angle), math.sin(stroke.angle)])
    force = -((-1.0) ** reversals)[:, None] * (run.profile[..., :2] @ direction)

    s = np.abs(run.arc_length)
    is_flank = s < s.max() + half_width - END * half_width
    number = np.floor((path - sample / 2) / bin_width + 1e-9).astype(int)
    n_bins = round(path[-1] / bin_width)

    def bin_means(x: np.ndarray) -> np.ndarray:
        return np.array(
            [x[has_one_direction & (number == k)].mean() for k in range(n_bins)]
        )

    return Drags(
        amplitude,
        travel=(np.arange(n_bins) + 0.5) * bin_width,
        flank=bin_means(force[:, is_flank].sum(1)),
        ends=bin_means(force[:, ~is_flank].sum(1)),
    )


def recovery(cases: Sequence[tuple[float, np.ndarray, np.ndarray]]) -> Recovery:
    """Return the recovery that fits drags on one rod, each run with the same weight.

    cases: (amplitude, travel (n,), drag (n,)) of each run, m, m and N."""
    from scipy.optimize import least_squares

    scale = float(np.mean([drag.mean() for _, _, drag in cases]))
    longest = max(float(travel[-1]) for _, travel, _ in cases)

    def misfit(parameters):
        law = Recovery(*parameters, rms=0.0)
        residuals = []
        for amplitude, travel, drag in cases:
            difference = law.drag(travel, amplitude) - drag
            residuals.append(difference / (scale * math.sqrt(len(travel))))
        return np.concatenate(residuals)

    # Of plateau, at_once, travel and start.
    first = [scale, 0.2, longest / 5, 0.2]
    low = [0.0, -1.0, longest / 1e3, -1.0]
    high = [9 * scale, 1.0, longest, 2.0]
    fit = least_squares(misfit, first, bounds=(low, high), x_scale=first)
    plateau, at_once, travel, start = fit.x.tolist()
    rms = math.sqrt(2 * fit.cost / len(cases)) * scale / plateau
    return Recovery(plateau, at_once, travel, start, rms)
