"""Any result as a file, and back. The kind of a result may add formats of its own.

`geomech.io.results` writes and reads the formats.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from geomech.core.variables import Result
from geomech.io import results as io
from geomech.io.files import atomic_folder, write_text
from geomech.results.kinds import kind_of
from geomech.results.old import translated
from geomech.results.show import text
from rft.core.refusal import Refusal, spell_arguments

flat = io.flat
NOTE = "note"  # a variable: lines that name arguments in double backticks


def to_dict(result: Result) -> dict[str, Any]:
    """Return plain data in the layout of `xarray.Dataset.from_dict`."""
    return io.to_dict(with_plain_notes(result))


def to_xarray(result: Result) -> Any:
    """Return a Dataset of xarray."""
    return io.to_xarray(with_plain_notes(result))


def with_plain_notes(result: Result) -> Result:
    """Return a result whose notes name arguments without backticks, for files and other
    programs."""
    if NOTE not in result:
        return result
    variables = []
    for variable in result.variables:
        if variable.name == NOTE:
            lines = [spell_arguments(line) for line in variable.values.tolist()]
            variable = replace(variable, values=lines)
        variables.append(variable)
    return replace(result, variables=tuple(variables))


def table_dims(result: Result) -> tuple[str, ...]:
    """Return the dimensions of a result's CSV file and data frame: those of its kind,
    or of its first variable that is no coordinate."""
    dims = kind_of(result).table
    if dims:
        return dims
    for variable in result.variables:
        if not variable.is_coordinate and variable.dims:
            return variable.dims
    return ()


def to_dataframe(result: Result, dims: tuple[str, ...] = ()) -> Any:
    """Return a data frame with the coordinates as its index; ImportError that says how
    to install pandas."""
    try:
        import pandas
    except ImportError:
        raise ImportError(
            "to_dataframe needs the package pandas: pip install pandas"
        ) from None
    found = io.columns(result, dims or table_dims(result))
    names = [name for name in found if name in result.sizes]
    frame = pandas.DataFrame(found)
    if not names:
        return frame
    return frame.set_index(names)


def write_csv(path: Path, result: Result) -> None:
    """Write the variables over the dimensions of the kind's table."""
    io.write_csv(path, result, table_dims(result))


def write_txt(path: Path, result: Result) -> None:
    """Write all variables as a terminal shows them."""
    write_text(path, text(result, everything=True) + "\n")


def read_netcdf(path: Path) -> Result:
    """Return the result in a file; of former versions under the names of today."""
    variables, attributes = io.read_netcdf(path)
    if io.FORMAT not in attributes:
        variables = translated(variables)
    kind, facts = io.kind_and_attributes(attributes)
    return io.join_companions(kind, variables, facts)


WRITERS: dict[str, Callable] = {
    ".nc": io.write_netcdf,
    ".json": io.write_json,
    ".csv": write_csv,
    ".mat": io.write_mat,
    ".txt": write_txt,
}
READERS: dict[str, Callable] = {
    ".nc": read_netcdf,
    ".json": io.read_json,
    ".csv": io.read_csv,
    ".mat": io.read_mat,
}


def formats(kind: Any) -> dict[str, Callable]:
    """Return the writers of a kind by ending: those of every kind, and those of its own
    in their place."""
    return {**WRITERS, **kind.files()}


def writer(path: Path, kind: Any) -> Callable:
    """Return the writer (path, result) of a name; Refusal if its ending is no format of
    the kind."""
    writers = formats(kind)
    ending = path.suffix.lower()
    if ending not in writers:
        raise Refusal(
            f"cannot write {path}",
            instead=f"end the name in one of {', '.join(writers)}",
        )
    return writers[ending]


def save(result: Result, path: Path, **options: Any) -> None:
    """Write a result in the format that the ending names; one whose command fills a
    folder, such as `run`, also into a folder."""
    kind = kind_of(result)
    if path.suffix or not getattr(kind, "folder", False):
        writer(path, kind)(path, with_plain_notes(result), **options)
        return
    inputs: list[Path] = []
    if result.question is not None:
        inputs = result.question.inputs()
        result.question.for_files([path], options)  # refuses what stands there
    with atomic_folder(path, inputs) as folder:
        kind.fill(result, folder, **options)


def load(path: str | Path) -> Result:
    """Return the result in a file: of .nc, .json and .mat as it was written, of .csv
    the columns. Refusal for another ending, or a file without a result."""
    if not isinstance(path, (str, Path)):
        raise Refusal("a result must be given by the name of its file", value=path)
    path = Path(path)
    if path.suffix.lower() not in READERS:
        raise Refusal(
            f"cannot read {path}",
            instead=f"end the name in one of {', '.join(READERS)}",
        )
    try:
        return READERS[path.suffix.lower()](path)
    except OSError:
        raise
    except Exception as error:  # a damaged file raises whatever comes first
        reason = str(error)
        if isinstance(error, KeyError):
            reason = f"it has no {reason}"
        raise Refusal(
            f"{path} holds no result",
            because=reason,
            instead="give a file of a saved result",
        ) from None
