"""Methods that other modules add to values: how a notebook shows them, how they are saved and loaded.

`geomech.face` registers them as the package is imported, before the classes of the values exist; the classes do not
depend on them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

METHODS: dict[str, dict[str, Any]] = {}  # by the name of a class


class Extensible:
    """Base of a value whose class receives the methods that are registered under its name."""

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        for name, method in METHODS.get(cls.__name__, {}).items():
            setattr(cls, name, method)

    if TYPE_CHECKING:

        def to_xarray(self, *arguments: Any, **options: Any) -> Any: ...

        @classmethod
        def load(cls, *arguments: Any, **options: Any) -> Any: ...
