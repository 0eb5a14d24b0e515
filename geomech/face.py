"""Implementations of methods of connections and fields that take the layers of files and words.

They are imported at their first use, so that the package starts fast.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from geomech.core.face import implements


@implements("Connection._repr_html_")
def connection_html(connection: Any) -> str:
    """Return a connection as a notebook shows it."""
    from geomech.output import display

    return display.connection(connection)


@implements("Connection.to_xarray")
def connection_to_xarray(connection: Any, shapes: Sequence[str]) -> Any:
    """Return a connection as a Dataset."""
    from geomech.io.results import to_xarray
    from geomech.studies.fields import of_fitted

    return to_xarray(of_fitted(connection, shapes))


@implements("Connection.load")
def load_connection(path: str | Path, sign: str, order: str) -> Any:
    """Return the connection in a file."""
    from geomech.io.tables import load

    return load(path, sign, order).connection


@implements("Field._repr_html_")
def field_html(field: Any) -> str:
    """Return a field as a notebook shows it."""
    from geomech.output import display

    return display.field(field)


@implements("Field.to_xarray")
def field_to_xarray(field: Any, name: str, shapes: Sequence[str]) -> Any:
    """Return a field as a DataArray."""
    from geomech.io.results import to_xarray
    from geomech.studies.fields import of_field

    return to_xarray(of_field(field, name, shapes))[name]
