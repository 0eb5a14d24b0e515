"""What a kind of result adds to what every result has.

The class of its question defines it; `kind_of` finds the class.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, ClassVar

from geomech.core.face import implementation

if TYPE_CHECKING:  # the help of a command loads no NumPy
    from geomech.core.variables import Result


class Plain:
    """A kind that adds nothing, such as that of a file of another program.

    All of it is static and takes a result, whether computed or read from a file.

    table: dimensions of the result's CSV file and data frame; those of its first
    variable if empty. looks: the options that its picture shares with others
    (`geomech.questions.shared.looks`).
    """

    table: ClassVar[tuple[str, ...]] = ()
    draw: ClassVar[Any] = None
    looks: ClassVar[tuple[str, ...]] = ("width", "font", "style", "legend")

    @staticmethod
    def ways() -> Iterable[str]:
        """Return the ways to draw it, which its option ``style`` names as well."""
        return ()

    @staticmethod
    def files() -> dict[str, Any]:
        """Return functions (path, result, **options) by the ending of a file that only
        this kind has, such as .toml."""
        return {}

    @classmethod
    def own_files(cls) -> dict[str, Any]:
        """Return `files` without those of plug-ins, which take long to look for."""
        return cls.files()

    @staticmethod
    def headline(result: Result) -> list[str]:
        """Return lines that stand above the numbers."""
        return []

    @staticmethod
    def summary(result: Result) -> Result:
        """Return what is shown first of a result; all of it is shown on demand."""
        return result

    @staticmethod
    def remarks(result: Result) -> list[str]:
        """Return lines that stand below the numbers."""
        return []

    @staticmethod
    def lengths(result: Result) -> Any:
        """Return the units of its lengths (`geomech.results.length_units.Lengths`), by
        default those of its scene."""
        from geomech.results.length_units import scene_lengths
        from geomech.results.scenes import scene_of

        return scene_lengths(scene_of(result))


def kind_of(result: Result) -> Any:
    """Return the class of the question that a result answers."""
    return implementation("Result.kind")(result.kind) or Plain
