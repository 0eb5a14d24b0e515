"""Results as values: a kind, and arrays over named dimensions, each with its unit and its error."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np


@dataclass(frozen=True, eq=False)
class Variable:
    """An array over named dimensions.

    values, error and spread have one shape and one unit; unit: "" where none is told, "1" of a pure number. error: the
    estimated numerical error; error_label: what that is, where it is no plain estimate. spread: one standard deviation that
    uncertain inputs leave. label: what the values are, in words. A variable over the dimension of its own name alone is a
    coordinate.
    """

    name: str
    dims: tuple[str, ...]
    values: np.ndarray
    unit: str = ""
    label: str = ""
    error: np.ndarray | None = None
    spread: np.ndarray | None = None
    error_label: str = ""

    def __post_init__(self) -> None:
        for name in ("values", "error", "spread"):
            if (x := getattr(self, name)) is not None:
                object.__setattr__(self, name, np.asarray(x))

    @property
    def is_coordinate(self) -> bool:
        return self.dims == (self.name,)

    @property
    def is_text(self) -> bool:
        return self.values.dtype.kind == "U"


@dataclass(frozen=True, eq=False, repr=False)
class Result(Mapping[str, Variable]):
    """Variables by name.

    kind: the question that they answer; `geomech.text` has a module of that name, which puts them in words. attributes:
    facts about all variables, by name. subject: the object from which they were computed, for pictures that show more
    than the variables.
    """

    kind: str
    variables: tuple[Variable, ...]
    attributes: Mapping[str, Any] = field(default_factory=dict)
    subject: Any = None

    def __getitem__(self, name: str) -> Variable:
        for variable in self.variables:
            if variable.name == name:
                return variable
        raise KeyError(name)

    def __iter__(self) -> Iterator[str]:
        return (v.name for v in self.variables)

    def __len__(self) -> int:
        return len(self.variables)

    def __repr__(self) -> str:
        parts = (
            f"{v.name} ({', '.join(v.dims)})" if v.dims else v.name
            for v in self.variables
        )
        return f"Result({self.kind}: {', '.join(parts)})"

    @property
    def sizes(self) -> dict[str, int]:
        """The length of every dimension."""
        return {
            dim: n for v in self.variables for dim, n in zip(v.dims, v.values.shape)
        }
