"""Methods of values that are no business of theirs: how a notebook shows them, and what saves and loads them.

`geomech.face` registers them as the package is imported, before any value's class exists; the classes know none of them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

METHODS: dict[str, dict[str, Any]] = {}  # by the name of a class


class Extensible:
    """Base of a value whose class takes the methods that are registered under its name."""

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        for name, method in METHODS.get(cls.__name__, {}).items():
            setattr(cls, name, method)

    if TYPE_CHECKING:

        def to_xarray(self, *arguments: Any, **options: Any) -> Any: ...

        @classmethod
        def load(cls, *arguments: Any, **options: Any) -> Any: ...
