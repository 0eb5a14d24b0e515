"""Results as files of figures: functions of (result, path)."""

from __future__ import annotations

from pathlib import Path

from geomech import plots
from geomech.core.variables import Result

check = plots.check_format


def measured(result: Result, path: Path) -> None:
    """Draw a measured gait, or midlines."""
    figure = (
        plots.midlines_figure(result)
        if result.kind == "midlines"
        else plots.measured_figure(result.subject)
    )
    plots.save(figure, path)
