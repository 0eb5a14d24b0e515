"""Midlines of a trial: the kinematics of an undulating body in glass beads, with
confidence intervals, and the speed that the balance of forces predicts for its shapes.

The trial is computed in loose beads, so that the truth is known. It has 30 points with
1 % of noise, a swing of the headings and a number of waves that vary by 5 %, and a
frequency that varies by 2 %. The prediction is for close-packed beads.
"""

from __future__ import annotations

from figures import main
from geomech import plots
from geomech.core.variables import Result
from geomech.mathematics.systems import Swimmer
from geomech.mathematics.systems.swimmer import MEDIA
from geomech.results import show
from geomech.studies.measured.midlines.fit import fit_midlines
from geomech.studies.measured.midlines.predicted import compare
from geomech.studies.measured.midlines.results import trial_result
from geomech.studies.measured.midlines.synthetic import synthetic_midlines
from rft import Backbone


def compute(
    medium: str = "glass-0.3mm-close", cycles: float = 8.4, seed: int = 1
) -> Result:
    """Return the kinematics of a synthetic trial in loose beads, with the prediction
    for a medium."""
    swimmer = Swimmer(MEDIA["glass-0.3mm-loose"], Backbone(40))
    trial = synthetic_midlines(swimmer, cycles, seed=seed).trial("trial.csv")
    fit = fit_midlines(trial)
    return trial_result(fit, compare(fit, MEDIA[medium]))


def draw(numbers: Result):
    return plots.midlines_figure(numbers)


def table(numbers: Result) -> str:
    """Return quantities with intervals, measured and predicted."""
    return show.text(numbers)


if __name__ == "__main__":
    main("midlines", compute, draw, table)
