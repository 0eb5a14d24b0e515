"""Methods of connections and fields for Python and notebooks: how they are shown, saved and loaded."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import FunctionType
from typing import Any

from geomech.core.face import METHODS


class Connection:
    def _repr_html_(self) -> str:
        from geomech.output import display

        return display.connection(self)

    def to_xarray(self, *, shapes: Sequence[str] = ()) -> Any:
        """Return a Dataset of A, its fit residual and the rms of xi, as in the file of `geomech connection`.

        shapes: names of the shape variables, where these are no joint angles. ImportError without the package xarray."""
        from geomech.io.results import to_xarray
        from geomech.studies.fields import of_fitted

        return to_xarray(of_fitted(self, shapes))

    @classmethod
    def load(cls, path: str | Path, sign: str = "", order: str = "") -> Any:
        """Return the connection in a file that `geomech connection` wrote, .nc or .mat, or that sysplotter wrote
        (`geomech.io.tables`).

        Refusal, one line, for any other. The residual is nan where the file has none."""
        from geomech.io.tables import load

        return load(path, sign, order).connection


class Field:
    def _repr_html_(self) -> str:
        from geomech.output import display

        return display.field(self)

    def to_xarray(self, name: str = "ccf", *, shapes: Sequence[str] = ()) -> Any:
        """Return a DataArray; with three components it is taken for a CCF, with its units.

        shapes: names of the shape variables, where these are no joint angles. ImportError without the package xarray."""
        from geomech.io.results import to_xarray
        from geomech.studies.fields import of_field

        return to_xarray(of_field(self, name, shapes))[name]


for _face in (Connection, Field):
    METHODS[_face.__name__] = {k: v for k, v in vars(_face).items() if isinstance(v, FunctionType | classmethod)}
