"""A trial: points tracked along a body over time, in the world."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rft.core.refusal import Refusal

# In m; px needs a scale, and BL is the body's own length.
UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}


@dataclass(frozen=True, eq=False)
class Trial:
    """Points of a file, in the order of the body.

    name: of the file. t: (F,), ascending, in s or, untimed, in frames. points: (F, P,
    2), in ``unit``, nan where the tracker has none. names: (P,), of the points. lines:
    (F, P), of the file. unit: m, BL, or "" where it is unknown. length: of the body, in
    ``unit``; None where the points are the whole body. filled: (F, P), which points
    were missing and are now those of the smooth midlines; None where they are still
    nan. notes: assumptions. file_unit: of the file, such as px, where ``unit`` is "";
    "" where it is not known."""

    name: str
    t: np.ndarray
    points: np.ndarray
    names: tuple[str, ...]
    lines: np.ndarray
    unit: str = ""
    timed: bool = True
    length: float | None = None
    filled: np.ndarray | None = None
    notes: tuple[str, ...] = ()
    file_unit: str = ""

    def wrong(
        self,
        what: str,
        frame: int | None = None,
        point: int | None = None,
        **facts: Any,
    ) -> Refusal:
        """Return a Refusal about a point of a frame, a frame, or the file. facts:
        keywords of `Refusal`."""
        where = self.name
        if point is not None:
            line = self.lines[frame, point]
            point_name = self.names[point]
            where = f"{where}, line {line} ({self.frame(frame)}, point {point_name})"
        elif frame is not None:
            where = f"{where}, line {self.lines[frame, 0]} ({self.frame(frame)})"
        return Refusal(what, where=where, **facts)

    def frame(self, frame: int) -> str:
        """Return the name of a frame: its time, or its number."""
        if self.timed:
            return f"t = {self.t[frame]:.6g}"
        return f"frame {self.t[frame]:g}"

    @property
    def unit_of_time(self) -> str:
        """Unit of t: s, or a frame."""
        return "s" if self.timed else "frame"

    @property
    def unit_of_length(self) -> str:
        """Unit of the points, in words where it is unknown."""
        return self.unit or self.file_unit or "the file's unit"

    def with_notes(self, *notes: str, **changes: Any) -> Trial:
        """Return the trial with more notes, and other fields."""
        return replace(self, notes=(*self.notes, *notes), **changes)

    @property
    def n_observed(self) -> int:
        """Number of coordinates that the tracker gave."""
        missing = self.filled
        if missing is None:
            missing = np.isnan(self.points[..., 0])
        return 2 * int((~missing).sum())

    def reversed(self) -> Trial:
        """Return the trial with its points in the other order."""
        filled = self.filled
        if filled is not None:
            filled = filled[:, ::-1]
        return replace(
            self,
            points=self.points[:, ::-1],
            names=self.names[::-1],
            lines=self.lines[:, ::-1],
            filled=filled,
        )
