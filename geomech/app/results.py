"""Results that print themselves, show themselves in a notebook and draw themselves."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from geomech import optimisation, plots, text
from geomech.core.variables import Result
from geomech.io.results import to_xarray, write_netcdf
from geomech.measured.midlines import predicted
from geomech.measured.midlines import question as midlines
from geomech.optimisation.question import result_of
from geomech.output import display, parts, pictures
from geomech.scenes.read import medium_of
from geomech.studies import results, sweep, tables
from rft.refusal import printable


class Displacements(results.Displacements):
    """Net displacement per cycle by amplitude and tier: `table["direct"]` are poses (B, 3), `table["estimate"]` their
    errors, `table["units"]` the units of all.

    Examples
    --------
    >>> import geomech
    >>> table = geomech.study("three-link-viscous").displacement([0.5, 1.0], "direct")
    >>> [round(x, 4) for x in table["net_distance"]["direct"]], table["units"]["estimate"]
    ([0.0153, 0.0513], 'BL')
    >>> ax = table.plot()
    """

    def __repr__(self) -> str:
        return printable(text.text(self.result))

    def _repr_html_(self) -> str:
        return display.displacements(self)

    def plot(
        self, quantity: str = "net_distance", *, ax: Any = None, **options: Any
    ) -> Any:
        """Draw x, y, heading or net_distance against amplitude, a line a tier with its errors; return the Axes."""
        return plots.displacement(
            self, quantity=quantity, gait=self.gait, ax=ax, **options
        )

    def to_xarray(self) -> Any:
        """Return a Dataset over tier, amplitude and component, with units and error estimates."""
        return to_xarray(tables.as_stored(self.result))


class Swept(sweep.Swept):
    """Result of a sweep: {"over": {parameter: values}, name: array (N_1, ...)}.

    Examples
    --------
    >>> import geomech
    >>> swept = geomech.sweep("three-link-viscous", {"medium.ratio": [1.5, 2.0]})
    >>> swept["over"]
    {'medium.ratio': [1.5, 2.0]}
    >>> fig = swept.plot()
    """

    def _repr_html_(self) -> str:
        return display.swept(self)

    def plot(self) -> Any:
        """Draw curves over one parameter, or maps over two; return the Figure."""
        return plots.sweep_figure(self.scene, self)

    def to_xarray(self) -> Any:
        """Return a Dataset over the parameters and component, as the file of `geomech sweep`."""
        return to_xarray(sweep.as_stored(self.result))


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Optimum(optimisation.Optimum):
    """The best gait: its ``gait``, ``value``, ``estimate`` of the error, and the ``scene`` with it.

    Examples
    --------
    >>> import geomech
    >>> best = geomech.optimise("three-link-viscous", harmonics=1, starts=1)
    >>> best.gait.harmonics, best.scene.gait is best.gait
    (1, True)
    >>> ax = best.plot()
    """

    def __repr__(self) -> str:
        return printable(text.text(result_of(self)))

    def plot(self, *, ax: Any = None) -> Any:
        """Draw the loop on the CCF that it gains from, or, without a map, its joint angles; return the Axes."""
        draw = (
            plots.optimum_map if self.scene.system.joints == 2 else plots.optimum_angles
        )
        return draw(self, ax)


class Forces:
    """Forces along a body over a cycle: ``forces["forward"]`` are values, ``forces.result`` has units and labels, too.

    Examples
    --------
    >>> import geomech
    >>> forces = geomech.study("seven-link-wave", phases=32).forces()
    >>> forces["forward"].shape  # by phase and element, in axial drags of the straight body
    (32, 42)
    >>> fig = forces.plot("forward")
    """

    def __init__(self, result: Result):
        self.result = result

    def __getitem__(self, name: str) -> Any:
        return self.result[name].values

    def __repr__(self) -> str:
        return printable(text.text(self.result))

    def plot(self, *panels: str, clim: float | str | None = None) -> Any:
        """Draw maps over place and phase, and thrust and drag stacked; see `geomech.plots.forces_figure`. Return the Figure."""
        return plots.forces_figure(self.result, panels, clim=clim)

    def to_xarray(self) -> Any:
        """Return a Dataset over phase, s, point and joint, with units."""
        return to_xarray(self.result)


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


class FittedMedium:
    """A medium fitted to measurements. result: parameters, errors and residuals. medium: the law, or stress map.

    Examples
    --------
    >>> import geomech
    >>> sand = geomech.fit_medium("short-rod-drag")
    >>> print(str(sand).splitlines()[0])
    granular law fitted to short_rod_drag.csv: 16 forces at 8 angles
    >>> fig = sand.plot()
    """

    def __init__(self, result: Result):
        self.result = result
        self.medium = (
            result.subject.medium
            if result.kind == "rod_drag"
            else result.subject.stress
        )

    def __repr__(self) -> str:
        return printable(text.text(self.result))

    def plot(self) -> Any:
        """Draw measurements and fit; return the Figure."""
        return pictures.CALIBRATIONS[self.result.kind](self.result)

    def save(self, path: str | Path) -> None:
        """Write a medium's file, which a scene names as [medium] file."""
        parts.write_medium(self.result, Path(path))
