"""How the drag on a body comes back after it has turned round (paper Sec. IV A)."""

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
    """Drag on a rod that goes to and fro, against its motion, in bins of its way.

    amplitude (m). travel: (n,), way so far at the middle of each bin, m. flank, ends:
    (n,), of the flank and of both ends together, N."""

    amplitude: float
    travel: np.ndarray
    flank: np.ndarray
    ends: np.ndarray


class Recovery(NamedTuple):
    """Drag = plateau (at_once + (1 - at_once) (1 + m) / 2) with the mean direction m of
    `rft.effects.Transient`.

    plateau: drag after a long way, N. at_once: share of it. travel: m. start: m in the
    fresh bed. rms: of the bins about the fit, over the plateau."""

    plateau: float
    at_once: float
    travel: float
    start: float
    rms: float

    def drag(self, travel: np.ndarray, amplitude: float) -> np.ndarray:
        """Return the drag, N, at ways so far (n,), m, of a rod to and fro with an
        amplitude, m."""
        m = mean_direction(travel, amplitude, self.travel, self.start)
        return self.plateau * (self.at_once + (1 - self.at_once) * (1 + m) / 2)


def mean_direction(
    way: np.ndarray, amplitude: float, travel: float, start: float
) -> np.ndarray:
    """Return the mean direction of travel, 1 for the present one, at ways so far (n,)
    of a rod that turns round at an amplitude and then at every second one, from
    ``start``; lengths in one unit."""
    length = travel / E_FOLDINGS
    stretch = np.maximum(np.ceil((way / amplitude - 1) / 2), 0).astype(int)
    out = np.empty_like(way)
    for k in range(stretch.max() + 1):
        begin = max(0, 2 * k - 1) * amplitude
        end = (2 * k + 1) * amplitude
        mine = stretch == k
        out[mine] = 1 - (1 - start) * np.exp(-(way[mine] - begin) / length)
        start = -(1 - (1 - start) * np.exp(-(end - begin) / length))
    return out


def drags(run: Run, stroke: Stroke, half_width: float, bin_width: float) -> Drags:
    """Return the drag on a round rod along x that went to and fro, in bins (m) of its
    way that divide its amplitude.

    half_width (m): of the rod, whose ends reach `END` of them as in
    `rft.grains.drag.flank_and_ends`. Samples in which it turns are left out."""
    a = stroke.amplitude
    way = stroke.speed * run.t
    sample = stroke.speed * (run.t[1] - run.t[0])
    require(way[-1] > a, "the body has not turned round", instead="take a longer run")
    turned = np.maximum(np.ceil((way / a - 1) / 2), 0)
    whole = turned == np.maximum(np.ceil(((way - sample) / a - 1) / 2), 0)
    direction = np.array([math.cos(stroke.angle), math.sin(stroke.angle)])
    force = -((-1.0) ** turned)[:, None] * (run.profile[..., :2] @ direction)
    flank = np.abs(run.along) < np.abs(run.along).max() + half_width - END * half_width
    bins = np.floor((way - sample / 2) / bin_width + 1e-9).astype(int)
    n = round(way[-1] / bin_width)
    mean = lambda x: np.array([x[whole & (bins == k)].mean() for k in range(n)])
    return Drags(
        a,
        (np.arange(n) + 0.5) * bin_width,
        mean(force[:, flank].sum(1)),
        mean(force[:, ~flank].sum(1)),
    )


def recovery(cases: Sequence[tuple[float, np.ndarray, np.ndarray]]) -> Recovery:
    """Return the recovery that fits drags on one rod, (amplitude, travel (n,), drag
    (n,)) of each run, all runs alike."""
    from scipy.optimize import least_squares

    scale = float(np.mean([drag.mean() for _, _, drag in cases]))
    longest = max(float(way[-1]) for _, way, _ in cases)

    def misfit(p):
        law = Recovery(*p, rms=0.0)
        return np.concatenate(
            [
                (law.drag(way, a) - drag) / (scale * math.sqrt(len(way)))
                for a, way, drag in cases
            ]
        )

    first = [scale, 0.2, longest / 5, 0.2]
    low = [0.0, -1.0, longest / 1e3, -1.0]
    high = [9 * scale, 1.0, longest, 2.0]
    found = least_squares(misfit, first, bounds=(low, high), x_scale=first)
    plateau, *others = found.x.tolist()
    return Recovery(
        plateau, *others, rms=math.sqrt(2 * found.cost / len(cases)) * scale / plateau
    )
