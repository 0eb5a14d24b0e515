"""Results as files of figures: functions of (result, path)."""

from __future__ import annotations

from pathlib import Path

from geomech import plots
from geomech.core.variables import Result

check = plots.check_format
CALIBRATIONS = {
    "rod_drag": plots.drag_figure,
    "plate_drags": plots.plates_figure,
    "penetration": plots.penetration_figure,
}


def measured(result: Result, path: Path) -> None:
    """Draw a measured gait, or midlines."""
    figure = (
        plots.midlines_figure(result)
        if result.kind == "midlines"
        else plots.measured_figure(result.subject)
    )
    plots.save(figure, path)


def calibration(result: Result, path: Path) -> None:
    """Draw measurements and the law that was fitted to them."""
    plots.save(CALIBRATIONS[result.kind](result), path)
