"""Implementations of methods of values that take the layers of files and words.

They are imported at their first use, so that the package starts fast.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from geomech.core.face import implements
from rft.core.refusal import Refusal, printable


@implements("Connection._repr_html_")
def connection_html(connection: Any) -> str:
    """Return a connection as a notebook shows it."""
    from geomech.shell import notebook

    return notebook.connection(connection)


@implements("Connection.to_xarray")
def connection_to_xarray(connection: Any, shapes: Sequence[str]) -> Any:
    """Return a connection as a Dataset."""
    from geomech.io.results import to_xarray
    from geomech.studies.maps.fields import connection_result

    return to_xarray(connection_result(connection, shapes))


@implements("Connection.load")
def load_connection(path: str | Path, sign: str, order: str) -> Any:
    """Return the connection in a file."""
    from geomech.io.tables import load

    return load(path, sign, order).connection


@implements("Field._repr_html_")
def field_html(field: Any) -> str:
    """Return a field as a notebook shows it."""
    from geomech.shell import notebook

    return notebook.field(field)


@implements("Field.to_xarray")
def field_to_xarray(field: Any, name: str, shapes: Sequence[str]) -> Any:
    """Return a field as a DataArray."""
    from geomech.io.results import to_xarray
    from geomech.studies.maps.fields import field_result

    return to_xarray(field_result(field, name, shapes))[name]


@implements("Result.__repr__")
def result_text(result: Any) -> str:
    """Return a result as a terminal shows it."""
    from geomech.results.show import text

    return printable(text(result))


@implements("Result._repr_html_")
def result_html(result: Any) -> str:
    """Return a result as a notebook shows it."""
    from geomech.results.html import html

    return html(result)


@implements("Result.to_dict")
def result_to_dict(result: Any) -> dict[str, Any]:
    """Return a result as plain data."""
    from geomech.results.files import to_dict

    return to_dict(result)


@implements("Result.to_xarray")
def result_to_xarray(result: Any) -> Any:
    """Return a result as a Dataset."""
    from geomech.results.files import to_xarray

    return to_xarray(result)


@implements("Result.to_dataframe")
def result_to_dataframe(result: Any, dims: tuple[str, ...]) -> Any:
    """Return a result as a data frame."""
    from geomech.results.files import to_dataframe

    return to_dataframe(result, dims)


@implements("Result.save")
def save_result(result: Any, path: Path, **options: Any) -> None:
    """Write a result."""
    from geomech.results.files import save

    save(result, path, **options)


@implements("Result.plot")
def plot_result(result: Any, **options: Any) -> Any:
    """Draw a result in the look that is asked for, or else in the present one."""
    from geomech import plots
    from geomech.questions.shared import looks
    from geomech.results.kinds import kind_of
    from geomech.results.lengths import in_lengths

    kind = kind_of(result)
    if kind.draw is None:
        raise Refusal(
            f"no picture exists of {result.kind or 'this result'}",
            instead="print it, or save it to a file",
        )
    shared, own = looks.split(kind, options)
    if own.get("ax") is not None and {"width", "legend"} & {*shared}:
        raise Refusal(
            "``width`` and ``legend`` are of a figure", instead="drop them, or ``ax``"
        )
    with plots.using(plots.Look(**shared)) as look:
        if look.unit is not None and "unit" in kind.looks:
            result = in_lengths(result, look.unit)
        return kind.draw(result, **own)


@implements("Result.kind")
def kind_of_result(name: str) -> Any:
    """Return the class of the question of that name; None if there is none."""
    from geomech import questions

    if name not in questions.SUMMARIES:
        return None
    return questions.question(name)
