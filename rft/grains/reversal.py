"""How the drag on a body comes back after it has turned round (paper Sec. IV A)."""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np

from rft.grains.experiment import Run
from rft.grains.motions import Stroke
from rft.refusal import require

SHARE = 0.95  # of the late drag: what counts as come back
LATE = 0.4  # of a stretch, its end


class Recovery(NamedTuple):
    """Drag along one straight stretch of a body's way, fitted by force = plateau (1 - (1 - start) exp(-travel / scale)).

    plateau: N, which short stretches and rising drags leave open. start: share of it at the start of the stretch. scale: m.
    late: mean drag over the last `LATE` of the stretch, N. rms: of the samples about the fit, N."""

    plateau: float
    start: float
    scale: float
    late: float
    rms: float

    @property
    def at_once(self) -> float:
        """Fitted drag at the start of the stretch over the late one."""
        return self.plateau * self.start / self.late

    @property
    def travel(self) -> float:
        """Travel at which the fitted drag reaches `SHARE` of the late one, m."""
        return self.reaches(SHARE * self.late)

    def reaches(self, force: float) -> float:
        """Return the travel at which a force, N, is reached, m: 0 where it is there at once, inf where it never is."""
        missing = 1 - force / self.plateau
        if missing <= 0:
            return math.inf
        return self.scale * math.log(max(1.0, (1 - self.start) / missing))


def recoveries(run: Run, stroke: Stroke) -> list[Recovery]:
    """Return the recoveries of a body that went to and fro: the first in a fresh bed, the others after a reversal."""
    a, v = stroke.amplitude, stroke.speed
    direction = np.array([math.cos(stroke.angle), math.sin(stroke.angle)])
    ends = np.array([0.0, *np.arange(a, v * run.t[-1] + 1e-9, 2 * a)])
    if v * run.t[-1] - ends[-1] > a:  # the last stretch counts if half of it is there
        ends = np.append(ends, v * run.t[-1])
    require(len(ends) >= 2, "the body has not turned round", instead="take a longer run")
    drag = -(run.force[:, :2] @ direction)
    travel = v * (run.t - 0.5 * (run.t[1] - run.t[0]))  # middles of the samples
    found = []
    for k, (low, high) in enumerate(itertools.pairwise(ends)):
        inside = (travel > low) & (travel < high)
        found.append(_fit(travel[inside] - low, (-1.0) ** k * drag[inside]))
    return found


def _fit(x: np.ndarray, force: np.ndarray) -> Recovery:
    """Return the recovery of forces (n,), N, over travel x (n,), m."""
    from scipy.optimize import least_squares

    late = float(force[x > (1 - LATE) * x.max()].mean())

    def misfit(p):
        return p[0] * (1 - (1 - p[1]) * np.exp(-x / p[2])) - force

    span = float(x.max())
    shortest = float(
        x[1] - x[0]
    )  # nothing faster than a sample is seen: where the drag is there at once, any start would do
    low, high = [0.0, -1.0, shortest], [5 * late, 2.0, 2 * span]
    starts = [[late, h, s * span] for h in (0.2, 0.8) for s in (0.05, 0.3)]
    best = min((least_squares(misfit, p, bounds=(low, high), x_scale=p) for p in starts), key=lambda r: r.cost)
    return Recovery(*best.x.tolist(), late, rms=float(np.sqrt(np.mean(best.fun**2))))
