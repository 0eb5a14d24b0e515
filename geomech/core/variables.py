"""A result: variables by name, each an array over named dimensions with its unit, its
error and its spread.

Methods that need the layers above, such as `Result.save`, are found by
`geomech.core.face`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from geomech.core.face import implementation

Unit = str | tuple[str, ...]
COMPONENTS = ("x", "y", "theta")  # of a velocity in the body frame
POSE = ("x", "y", "heading")  # of a displacement
ARRAYS = ("values", "error", "spread")  # of a variable, all of one shape


@dataclass(frozen=True, eq=False)
class Variable:
    """An array over named dimensions.

    Attributes
    ----------
    name : str
        Its name in text, JSON, files and data frames.
    dims : tuple of str
        Names of its dimensions. A variable over the dimension of its own name alone is
        a coordinate.
    values : array
        Read-only.
    unit : str, or tuple of str
        "" where there is none, "1" of a pure number; a tuple has one unit for each
        entry of the first dimension.
    label : str
        What the values are, in words.
    error, spread : array, optional
        Estimated numerical error, and the standard deviation that uncertain inputs
        leave, in the unit of the values.
    error_label : str
        What the error is, where it is no plain estimate.
    zero : str
        Why all values are zero, such as "by symmetry"; "" if they are not.
    """

    name: str
    dims: tuple[str, ...]
    values: Any
    unit: Unit = ""
    label: str = ""
    error: Any = None
    spread: Any = None
    error_label: str = ""
    zero: str = ""

    def __post_init__(self) -> None:
        for name in ARRAYS:
            array = getattr(self, name)
            if array is not None:
                object.__setattr__(self, name, _read_only(array))
        if self.error is None and self.error_label:
            object.__setattr__(self, "error_label", "")

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        return np.array(self.values, dtype=dtype)

    def __float__(self) -> float:
        return float(self.values)

    def __getitem__(self, index: Any) -> Any:
        return self.values[index]

    @property
    def is_coordinate(self) -> bool:
        return self.dims == (self.name,)

    @property
    def is_text(self) -> bool:
        return self.values.dtype.kind == "U"

    @property
    def units(self) -> str:
        """The unit as one text."""
        if isinstance(self.unit, tuple):
            return ", ".join(self.unit)
        return self.unit

    def with_arrays(
        self, change: Callable[[np.ndarray], np.ndarray], **fields: Any
    ) -> Variable:
        """Return the variable with values, error and spread changed alike."""
        for name in ARRAYS:
            array = getattr(self, name)
            if array is not None:
                fields[name] = change(array)
        return replace(self, **fields)

    def at(self, dim: str, index: int) -> Variable:
        """Return the variable at an index of a dimension, without that dimension."""
        if dim not in self.dims:
            return self
        axis = self.dims.index(dim)
        unit = self.unit
        if isinstance(unit, tuple) and axis == 0:
            unit = unit[index]
        dims = self.dims[:axis] + self.dims[axis + 1 :]
        taken = partial(np.take, indices=index, axis=axis)
        return self.with_arrays(taken, dims=dims, unit=unit)


@dataclass(frozen=True, eq=False, repr=False)
class Result(Mapping[str, Variable]):
    """Variables by name.

    Attributes
    ----------
    kind : str
        Name of the question that they answer.
    variables : tuple of Variable
    attributes : mapping
        Facts about all variables: texts and numbers. Whatever is longer is a variable.
    question : Question, optional
        The question, with its scene; None of a result that was read from a file.

    Examples
    --------
    >>> import geomech
    >>> study = geomech.study("three-link-viscous")
    >>> table = study.displacement([0.5, 1.0], "direct")
    >>> table["net_distance"].values.round(4), table["net_distance"].unit
    (array([[0.0153, 0.0513]]), 'BL')
    >>> float(table.at(tier="direct", amplitude=0.5)["y"].values.round(4))
    0.002
    """

    kind: str
    variables: tuple[Variable, ...]
    attributes: Mapping[str, Any] = field(default_factory=dict)
    question: Any = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "variables", tuple(self.variables))
        facts = MappingProxyType(dict(self.attributes))
        object.__setattr__(self, "attributes", facts)

    def __getitem__(self, name: str) -> Variable:
        for variable in self.variables:
            if variable.name == name:
                return variable
        raise KeyError(name)

    def __iter__(self) -> Iterator[str]:
        return (variable.name for variable in self.variables)

    def __len__(self) -> int:
        return len(self.variables)

    def __repr__(self) -> str:
        return implementation("Result.__repr__")(self)

    def _repr_html_(self) -> str:
        return implementation("Result._repr_html_")(self)

    def __reduce__(self) -> tuple:
        # A mapping proxy is not pickled.
        facts = dict(self.attributes)
        return Result, (self.kind, self.variables, facts, self.question)

    @property
    def sizes(self) -> dict[str, int]:
        """The length of every dimension."""
        sizes: dict[str, int] = {}
        for variable in self.variables:
            sizes.update(zip(variable.dims, variable.values.shape))
        return sizes

    def only(self, *names: str) -> Result:
        """Return these variables, in this order, behind their coordinates.

        Names that the result lacks are left out.
        """
        chosen = [self[name] for name in names if name in self]
        dims = {dim for variable in chosen for dim in variable.dims}
        coordinates = []
        for variable in self.variables:
            needed = variable.is_coordinate and variable.name in dims
            if needed and variable.name not in names:
                coordinates.append(variable)
        return replace(self, variables=(*coordinates, *chosen))

    def without(self, *names: str) -> Result:
        """Return the result without these variables."""
        others = [v for v in self.variables if v.name not in names]
        return replace(self, variables=tuple(others))

    def at(self, **places: Any) -> Result:
        """Return the result at values of coordinates, such as tier="direct", without
        their dimensions; KeyError for a value that is none."""
        variables = list(self.variables)
        for dim, value in places.items():
            matches = np.flatnonzero(self[dim].values == value)
            if not matches.size:
                raise KeyError(f"{dim} has no value {value!r}")
            index = int(matches[0])
            variables = [v.at(dim, index) for v in variables if v.name != dim]
        return replace(self, variables=tuple(variables))

    def with_variables(self, *more: Variable) -> Result:
        """Return the result with more variables, which take the place of others of the
        same names."""
        names = {v.name for v in more}
        others = [v for v in self.variables if v.name not in names]
        return replace(self, variables=(*others, *more))

    def to_dict(self) -> dict[str, Any]:
        """Return plain data in the layout of `xarray.Dataset.from_dict`; nan is
        None."""
        return implementation("Result.to_dict")(self)

    def to_xarray(self) -> Any:
        """Return a Dataset; errors and spreads are NAME_error and NAME_spread."""
        return implementation("Result.to_xarray")(self)

    def to_dataframe(self, *dims: str) -> Any:
        """Return the variables over some dimensions, by default those of the kind's
        table, as a data frame of pandas."""
        return implementation("Result.to_dataframe")(self, dims)

    def save(self, path: str | Path, **options: Any) -> None:
        """Write a file whose ending names its format: .nc, .json, .csv, .mat, .txt, or
        one that the kind adds. `geomech.load_result` reads the first four. A result of
        `run` also fills a folder."""
        implementation("Result.save")(self, Path(path), **options)

    def plot(self, **options: Any) -> Any:
        """Draw the result; return the Figure. Another option than these is refused.

        Parameters
        ----------
        width : str
            Width on the page, such as "3.4in", "86mm" or "246pt" (of TeX).
        unit : str
            Unit of lengths, "m", "cm", "mm" or "BL", in pictures that have lengths.
        font : str
            Font and size in points, as "Arial,8", "Arial" or "8".
        style : str or list of str
            Style of matplotlib, a FILE.mplstyle or a name.
        cmap : str
            Colour map of matplotlib or cmcrameri, in pictures with maps.
        legend : str
            "outside" (one above all panels), "inside" or "none".
        **options
            Those of the kind's picture, which the refusal of a wrong one lists.
        """
        return implementation("Result.plot")(self, **options)


def same_or_each(units: Sequence[str]) -> Unit:
    """Return the unit that all have, or one for each."""
    if len({*units}) == 1:
        return units[0]
    return tuple(units)


def _read_only(array: Any) -> np.ndarray:
    """Return an array that nobody can write to."""
    array = np.asarray(array).view()
    array.flags.writeable = False
    return array
