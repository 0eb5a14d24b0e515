"""Any result as text for a screen.

A result is shown as its kind's headline, its scalars, a table for each set of
dimensions, what is zero and why, and its kind's remarks. `parts` returns these;
`lines` prints them, and `html.py` sets them for a notebook.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from geomech.core.summary import WIDTH, first_place, wrapped
from geomech.core.variables import Result, Variable
from geomech.results.kinds import kind_of
from geomech.results.numbers import decimals, number, size, with_error
from rft.core.refusal import in_line

ROWS = 14  # of a table; of more the first, the last and some between are shown
COLUMNS = 8  # places of outer dimensions side by side; of more the extremes are shown
NOTHING = 1e-12  # values below it are zero to rounding
SMALL = 5e-7  # values below it and below their error are called zero
GAP = "  "  # between columns

Places = tuple[int, ...]
Column = list[str]  # cells below a heading
Block = list[Column]  # columns that stay side by side: a value, its error, its spread


@dataclass(frozen=True)
class Table:
    """A table of cells as text. title: a line above it, or ""."""

    title: str
    first: Column
    blocks: list[Block]


def text(result: Result, everything: bool = False) -> str:
    """Return a result as lines of at most WIDTH characters, but for long tables.

    everything: all its variables and rows, not only those that its kind shows first."""
    found = lines(result, everything)
    if everything:
        return "\n".join(found)
    return "\n".join(wrapped(found))


def lines(result: Result, everything: bool = False) -> list[str]:
    """Return the lines of `text`."""
    found: list[str] = []
    for part in parts(result, everything):
        if isinstance(part, Table):
            found += table_lines(part)
        else:
            found.append(part)
    return found


def parts(result: Result, everything: bool = False) -> list[str | Table]:
    """Return lines and tables, in their order."""
    kind = kind_of(result)
    shown = kind.summary(result)
    rows: int | None = ROWS
    if everything:
        shown = result
        rows = None
    found: list[str | Table] = [in_line(line) for line in kind.headline(result)]
    for variables in variables_by_dims(shown):
        if variables[0].dims:
            found += tables(shown, variables, rows)
        else:
            found += scalars(variables)
    found += zeros(shown)
    found += kind.remarks(result)
    if everything:
        found += facts(result)
    return found


def facts(result: Result) -> list[str]:
    """Return a line for each attribute; texts of several lines are left out."""
    found = []
    for name, value in result.attributes.items():
        if "\n" not in str(value):
            found.append(f"{name}: {value}")
    return found


def leaves_out(result: Result) -> bool:
    """Return whether `text` leaves out a variable or a row."""
    shown = kind_of(result).summary(result)
    long = any(size > ROWS for size in shown.sizes.values())
    return long or len(shown) < len(result)


def variables_by_dims(result: Result) -> list[list[Variable]]:
    """Return the variables to be shown, those with the same dimensions together, in
    the order of the result."""
    groups: dict[tuple[str, ...], list[Variable]] = {}
    for variable in result.variables:
        if not variable.is_coordinate and not zero_reason(variable):
            groups.setdefault(variable.dims, []).append(variable)
    for variable in result.variables:
        if variable.is_coordinate and not is_used(result, variable):
            groups.setdefault(variable.dims, []).append(variable)
    return list(groups.values())


def is_used(result: Result, coordinate: Variable) -> bool:
    """Return whether another variable is over the dimension of a coordinate."""
    others = [v for v in result.variables if v is not coordinate]
    return any(coordinate.name in v.dims for v in others)


def title(name: str) -> str:
    return name.replace("_", " ")


def unit_of(variable: Variable) -> str:
    if variable.unit == "1":
        return ""
    return variable.units


def head(variable: Variable) -> str:
    """Return the name of a variable with its unit."""
    if isinstance(variable.unit, tuple):
        return title(variable.name)
    return with_unit(title(variable.name), variable.unit)


# Scalars


def scalars(variables: Sequence[Variable]) -> list[str]:
    """Return a line for each of some variables without dimensions."""
    names = [title(v.name) for v in variables]
    values = [scalar(v) for v in variables]
    name_width = max(map(len, names))
    value_width = max(map(len, values))
    found = []
    for name, value, variable in zip(names, values, variables):
        line = f"{name:{name_width}}  {value:{value_width}}  {variable.label}"
        if len(line) > WIDTH:
            line = f"{name:{name_width}}  {value}"
        found.append(line.rstrip())
    return found


def scalar(variable: Variable) -> str:
    """Return the value of a variable without dimensions, with errors and unit."""
    if variable.is_text:
        return str(variable.values)
    unit = unit_of(variable)
    shown = with_error(variable.values, variable.error, unit)
    if is_error(variable):
        shown = f"{cell(variable, float(variable))} {unit}".rstrip()
    if variable.spread is not None:
        shown += f", +- {size(float(variable.spread))} from the medium"
    return shown


def zeros(result: Result) -> list[str]:
    """Return lines that say which variables are zero, and why."""
    reasons: dict[str, list[str]] = {}
    for variable in result.variables:
        reason = zero_reason(variable)
        if reason:
            reasons.setdefault(reason, []).append(title(variable.name))
    return [f"{', '.join(names)}: zero {reason}" for reason, names in reasons.items()]


def zero_reason(variable: Variable) -> str:
    """Return why all values of a variable are zero, as its question says or within
    their errors; "" if they are not."""
    if variable.zero:
        return variable.zero
    if variable.is_text or variable.error is None or not variable.values.size:
        return ""
    sizes = np.abs(variable.values)
    if sizes.max() < SMALL and (sizes <= variable.error).all():
        error = size(float(np.max(variable.error)))
        return f"within its error, {error} {unit_of(variable)}".rstrip()
    return ""


# Tables


def tables(
    result: Result, variables: Sequence[Variable], rows: int | None
) -> Iterator[Table]:
    """Yield variables over the same dimensions as tables: value by value, or by their
    extremes where there are too many."""
    *outer, inner = variables[0].dims
    count = variables[0].values.shape[-1]
    if rows is not None and is_map(result, variables[0]):
        for variable in variables:
            if variable.is_text:
                yield counts_table(result, variable)
            else:
                yield map_table(result, variable)
        return
    chosen = chosen_rows(count, rows)
    note = ""
    if len(chosen) < count:
        note = f", {len(chosen)} of {count}"
    if not outer:
        first = index_column(result, inner, chosen, variables[0], note)
        blocks = [block(v, chosen, head(v)) for v in variables]
        yield Table("", first, blocks)
        return
    first = index_column(result, inner, chosen, None, note)
    outer_names = " and ".join(map(title, outer))
    for variable in variables:
        blocks = []
        for place in np.ndindex(*variable.values.shape[:-1]):
            name = row_name(result, variable, outer, place)
            blocks.append(block(variable, chosen, name, place))
        yield Table(f"{head(variable)}, by {outer_names}", first, blocks)


def table_lines(table: Table) -> Iterator[str]:
    """Yield the lines of a table, as many blocks side by side as fit."""
    if table.title:
        yield table.title
    first = aligned(table.first)
    remaining = [joined(one) for one in table.blocks]
    while remaining:
        group = [first, remaining.pop(0)]
        while remaining and width([*group, remaining[0]]) <= WIDTH:
            group.append(remaining.pop(0))
        for cells in zip(*group):
            yield GAP.join(cells)


def width(columns: list[Column]) -> int:
    return sum(len(cells[0]) + len(GAP) for cells in columns) - len(GAP)


def joined(block: Block) -> Column:
    """Return the columns of a block as one."""
    return [" ".join(cells) for cells in zip(*map(aligned, block))]


def aligned(cells: Column) -> Column:
    """Return cells of one width."""
    wide = max(map(len, cells))
    return [f"{cell:>{wide}}" for cell in cells]


def chosen_rows(count: int, most: int | None) -> np.ndarray:
    """Return the numbers of at most ``most`` rows, evenly spread; of all for None."""
    n_rows = min(count, most or count)
    return np.unique(np.linspace(0, count - 1, n_rows).round().astype(int))


def block(variable: Variable, rows: np.ndarray, name: str, place: Places = ()) -> Block:
    """Return the column of a variable at a place of its outer dimensions, with columns
    of its error and its spread."""
    values = variable.values[place][rows]
    if variable.is_text:
        return [[name, *map(str, values)]]
    errors = None
    if variable.error is not None:
        errors = variable.error[place][rows]
    cells = [cell(variable, float(x), decimals(values, errors)) for x in values]
    found = [[name, *cells]]
    if errors is not None:
        found.append(["+- error", *(size(float(x)) for x in errors)])
    if variable.spread is not None:
        spreads = variable.spread[place][rows]
        found.append(["+- medium", *(size(float(x)) for x in spreads)])
    return found


def cell(variable: Variable, value: float, places: int | None = None) -> str:
    """Return a number of a variable; of an error two digits."""
    if is_error(variable) and np.isfinite(value):
        return size(value)
    return number(value, places)


def is_error(variable: Variable) -> bool:
    """Return whether a variable is itself an error, such as of a setting."""
    return variable.name == "error" or variable.name.endswith("_error")


def index_column(
    result: Result,
    dim: str,
    rows: np.ndarray,
    variable: Variable | None = None,
    note: str = "",
) -> Column:
    """Return the coordinates of a dimension under its name.

    variable: its unit stands in each row where it differs from row to row."""
    name = title(dim)
    if dim in result:
        name = head(result[dim])
    cells = [coordinate(result, dim, k) for k in rows]
    if variable is not None and isinstance(variable.unit, tuple):
        cells = [with_unit(cell, variable.unit[k]) for cell, k in zip(cells, rows)]
    return [name + note, *cells]


def coordinate(result: Result, dim: str, index: int) -> str:
    if dim not in result:
        return str(index)
    value = result[dim].values[index]
    if result[dim].is_text:
        return str(value)
    return number(float(value))


def row_name(
    result: Result, variable: Variable, dims: Sequence[str], place: Places
) -> str:
    """Return the coordinates of a place, such as "direct" or "0.5, 2", with the unit of
    its values where that differs from place to place."""
    name = ", ".join(coordinate(result, dim, k) for dim, k in zip(dims, place))
    if isinstance(variable.unit, tuple):
        return with_unit(name, variable.unit[place[0]])
    return name


def with_unit(name: str, unit: str) -> str:
    """Return a name with its unit behind it; that of a pure number is left out."""
    if unit in ("", "1"):
        return name
    return f"{name} ({unit})"


# Maps


def is_label(result: Result, dim: str) -> bool:
    """Return whether the places of a dimension are labels, such as tiers or joints, and
    no continuous quantity."""
    return dim not in result or result[dim].values.dtype.kind != "f"


def is_map(result: Result, variable: Variable) -> bool:
    """Return whether a variable is over continuous dimensions, with more values than a
    table can show."""
    continuous = [dim for dim in variable.dims if not is_label(result, dim)]
    columns = int(np.prod(variable.values.shape[:-1]))
    return len(continuous) > 1 and columns > COLUMNS and not variable.is_text


def map_table(result: Result, variable: Variable) -> Table:
    """Return the extremes of a variable over its continuous dimensions: with their
    places, a row a label; of two dimensions of labels the ranges alone."""
    labels = [dim for dim in variable.dims if is_label(result, dim)]
    grid = [dim for dim in variable.dims if dim not in labels]
    moved = reordered(variable, (*labels, *grid))
    heading = f"{head(variable)}, over {grid_words(result, grid)}"
    if len(labels) == 2:
        return ranges(result, moved, labels, heading)
    return extremes(result, moved, labels, grid, heading)


def counts_table(result: Result, variable: Variable) -> Table:
    """Return how often each text of a variable occurs over its dimensions, a row a
    text."""
    names, counts = np.unique(variable.values, return_counts=True)
    grid = [dim for dim in variable.dims if not is_label(result, dim)]
    heading = f"{head(variable)}, over {grid_words(result, grid)}"
    points = ["points", *map(str, counts)]
    return Table(heading, [title(variable.name), *map(str, names)], [[points]])


def grid_words(result: Result, dims: Sequence[str]) -> str:
    """Return the size of a grid and the ranges of its axes."""
    sizes = " x ".join(str(result.sizes[dim]) for dim in dims)
    spans: dict[str, list[str]] = {}
    for dim in dims:
        axis = result[dim].values
        span = f"{axis[0]:.4g} to {axis[-1]:.4g} {unit_of(result[dim])}".rstrip()
        spans.setdefault(span, []).append(title(dim))
    words = [f"{' and '.join(names)} {span}" for span, names in spans.items()]
    return f"{sizes} points, {', '.join(words)}"


def reordered(variable: Variable, dims: Sequence[str]) -> Variable:
    """Return a variable with its dimensions in another order."""
    order = [variable.dims.index(dim) for dim in dims]
    return variable.with_arrays(partial(np.transpose, axes=order), dims=tuple(dims))


def ranges(
    result: Result, variable: Variable, labels: Sequence[str], heading: str
) -> Table:
    """Return a table of "least to largest": a column for each place of the first
    dimension, a row for each of the second."""
    count, rows = variable.values.shape[:2]
    first = [title(labels[1])]
    for k in range(rows):
        first.append(coordinate(result, labels[1], k))
    blocks = []
    for place in range(count):
        name = row_name(result, variable, labels[:1], (place,))
        cells = [span(variable.values[place, k]) for k in range(rows)]
        blocks.append([[name, *cells]])
    return Table(heading, first, blocks)


def span(values: np.ndarray) -> str:
    """Return "least to largest" of numbers."""
    finite = values[np.isfinite(values)]
    if not np.abs(finite).max(initial=0.0) > NOTHING:
        return "zero"
    return f"{finite.min():.4g} to {finite.max():.4g}"


def extremes(
    result: Result,
    variable: Variable,
    labels: Sequence[str],
    grid: Sequence[str],
    heading: str,
) -> Table:
    """Return the least and the largest value of each label, with their places."""
    names = []
    rows = []
    for place in np.ndindex(*variable.values.shape[: len(labels)]):
        names.append(row_name(result, variable, labels, place))
        rows.append(extremes_at(result, variable, grid, place))
    heads = ["least", "at", "largest", "at"]
    if variable.error is not None:
        heads.append("+- error")
    blocks = [[[name, *cells]] for name, cells in zip(heads, zip(*rows))]
    return Table(heading, [" and ".join(map(title, labels)), *names], blocks)


def extremes_at(
    result: Result, variable: Variable, grid: Sequence[str], place: Places
) -> list[str]:
    """Return the cells of a row of `extremes`."""
    values = variable.values[place]
    if not np.nanmax(np.abs(values), initial=0.0) > NOTHING:
        cells = ["zero", "", "zero", ""]
        low = high = (0,) * values.ndim
    else:
        low = first_place(values, np.nanmin(values))
        high = first_place(values, np.nanmax(values))
        cells = []
        for where in (low, high):
            cells += [f"{values[where]:.4g}", place_words(result, grid, where)]
    if variable.error is not None:
        errors = variable.error[place]
        cells.append(size(float(max(errors[low], errors[high]))))
    return cells


def place_words(result: Result, dims: Sequence[str], place: Places) -> str:
    """Return the coordinates of a place to three digits."""
    axes = [result[dim].values for dim in dims]
    return ", ".join(f"{axis[k] + 0.0:.3g}" for axis, k in zip(axes, place))
