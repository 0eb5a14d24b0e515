"""A measured gait: sixty noisy cycles of a three-link swimmer in a viscous fluid, the
connection near their mean gait by regression, and the displacement that it predicts.

The method is that of Bittner, Hatton and Revzen, Nonlinear Dynamics 94, 1933 (2018).
The log is computed from the velocity of the swimmer, so that the truth is known. The
joint angles deviate from the gait by 0.05 rad, and each row has noise of 1e-3 rad and
1e-3 BL.
"""

from __future__ import annotations

import numpy as np

from figures import main
from geomech import plots
from geomech.core.variables import Result
from geomech.mathematics.gaits import Ellipse
from geomech.results import show
from geomech.scenes import load
from geomech.studies.measured import Log, fit_log, synthetic
from geomech.studies.measured.results import fit_result

GAIT = Ellipse(semi_axes=(0.8, 0.5), tilt=0.4, centre=(0.2, -0.1))
JOINTS = ("alpha_1", "alpha_2")


def compute(
    scene: str = "three-link-viscous", cycles: int = 60, seed: int = 1
) -> Result:
    """Return the fit of a synthetic log."""
    log = synthetic.synthetic_log(
        load(scene).system.velocity, GAIT, cycles, spread=0.05, noise=1e-3, seed=seed
    )
    lines = np.arange(len(log.t)) + 2
    fit = fit_log(Log("log.csv", log.t, log.alpha, log.pose, JOINTS, lines))
    return fit_result(fit, mapped=False)


def draw(numbers: Result):
    return plots.measured_figure(numbers)


def table(numbers: Result) -> str:
    """Return displacements and the fraction of the velocity that the connection
    explains."""
    return show.text(numbers)


if __name__ == "__main__":
    main("measured", compute, draw, table)
