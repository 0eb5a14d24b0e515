"""Questions of measurements, with results that show themselves."""

from __future__ import annotations

from typing import Any

from geomech.app.results import FittedMidlines
from geomech.measured.midlines import fit
from geomech.measured.midlines import question as of_midlines


def fit_midlines(midlines: Any, medium: Any = None, **options: Any) -> FittedMidlines:
    """Return the kinematics of tracked midlines with intervals, as `geomech fit-gait` does.

    Parameters
    ----------
    midlines : path, or `geomech.measured.midlines.trial.Trial`
        CSV file of points along the body over whole cycles.
    medium : medium, name or file
        In which the motion of the measured shapes is predicted; none if left out.
    **options : columns, units, scale, fps, y, head, least_score, individual, body_length,
        mend, level
        See `geomech.measured.midlines.fit.fit_midlines`.
    """
    fitted = FittedMidlines(
        of_midlines.result_of(fit.fit_midlines(midlines, **options))
    )
    return fitted if medium is None else fitted.against(medium)
