"""Notes: warnings about what is likely not meant, or was decided for the user."""

import sys
import warnings
from types import FrameType

from rft.core.refusal import spell_arguments


class Note(UserWarning):
    """A warning that stops nothing; on the command line a line on standard error.

    It names arguments as a `Refusal` does, in double backticks, which ``args[0]``
    keeps."""

    def __str__(self) -> str:
        return spell_arguments(str(self.args[0]))


def warn(text: str, category: type[Warning] = Note) -> None:
    """Warn at the line of the caller's program: the one that called rft or geomech."""
    frame: FrameType | None = sys._getframe(1)
    caller = frame
    while frame is not None:
        if is_ours(frame):
            caller = frame.f_back
        frame = frame.f_back
    if caller is None:  # in a thread that compiled code began
        caller = sys._getframe(1)
    names = caller.f_globals
    warnings.warn_explicit(
        text,
        category,
        caller.f_code.co_filename,
        caller.f_lineno,
        names.get("__name__", "unknown"),
        names.setdefault("__warningregistry__", {}),
    )


def is_ours(frame: FrameType) -> bool:
    """Return whether a frame runs code of this package."""
    module = frame.f_globals.get("__name__") or ""
    return module.partition(".")[0] in ("rft", "geomech")
