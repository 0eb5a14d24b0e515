"""Results that print themselves, show themselves in a notebook and draw themselves."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from geomech import plots, text
from geomech.core.variables import Result
from geomech.io.results import to_xarray, write_netcdf
from geomech.measured.midlines import predicted
from geomech.measured.midlines import question as midlines
from geomech.scenes.read import medium_of
from rft.core.refusal import printable

CALIBRATIONS = {
    "rod_drag": plots.drag_figure,
    "plate_drags": plots.plates_figure,
    "penetration": plots.penetration_figure,
}


class FittedMidlines:
    """Kinematics of midlines. result: all numbers as variables. kinematics: the fit. comparison: with a prediction, or None."""

    def __init__(self, result: Result):
        self.result = result
        self.kinematics, self.comparison = result.subject

    def __getitem__(self, name: str) -> tuple[float, float]:
        """Return a quantity such as "speed", and half the width of its interval."""
        variable = self.result[name]
        return float(variable.values), float(np.asarray(variable.error))

    def __repr__(self) -> str:
        notes = [f"note: {line}" for line in self.result.attributes["notes"]]
        return printable("\n".join([text.text(self.result), *notes]))

    def against(self, medium: Any, effects: Any = ()) -> FittedMidlines:
        """Return the same beside its prediction in a medium, or a medium's name or file, with effects on the body."""
        known = medium_of(medium) if isinstance(medium, (str, Path)) else medium
        return FittedMidlines(
            midlines.result_of(
                self.kinematics,
                predicted.compare(self.kinematics, known, tuple(effects)),
            )
        )

    def plot(self) -> Any:
        """Draw the way of the body, slip and amplitude along it, and the prediction; return the Figure."""
        return plots.midlines_figure(self.result)

    def save(self, path: str | Path) -> None:
        """Write a NetCDF file."""
        write_netcdf(path, self.result)

    def to_xarray(self) -> Any:
        """Return a Dataset, as the file of `geomech fit-gait`."""
        return to_xarray(self.result)
