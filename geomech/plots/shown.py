"""Figures and axes that a notebook shows by themselves, without pyplot."""

from __future__ import annotations

import io
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

DPI = 110  # of pictures in notebooks


class ShownFigure(Figure):
    """A Figure that a notebook shows if it is the last value of a cell.

    rc: settings of matplotlib that it was drawn with, and is written with."""

    rc: Mapping[str, Any] = MappingProxyType({})
    finished: Any = None  # the look that it fits

    def finish(self, look: Any) -> None:
        """Make the figure fit a look (`geomech.plots.look.Look`), once."""
        if self.finished is None and look.changes_figure:
            from geomech.plots.fit import fit

            fit(self, look)
            self.finished = look

    def savefig(self, fname: Any, **options: Any) -> None:
        """Write the figure, with the fonts that it was drawn with."""
        import matplotlib as mpl

        # Files other than those of `geomech.plots.save` keep the user's resolution.
        rc = {k: v for k, v in self.rc.items() if not k.startswith("savefig.")}
        with mpl.rc_context(rc):
            super().savefig(fname, **options)

    def _repr_png_(self) -> bytes:
        with io.BytesIO() as file:
            self.savefig(file, format="png", dpi=DPI)
            return file.getvalue()


class ShownAxes(Axes):
    """Axes whose figure a notebook shows if they are the last value of a cell."""

    def _repr_png_(self) -> bytes:
        return self.get_figure(root=True)._repr_png_()

    def _update_title_position(self, renderer) -> None:
        """Place titles only where there are any.

        matplotlib measures all ticks for it, which takes a tenth of a drawing."""
        titles = (self.title, self._left_title, self._right_title)
        if any(title.get_text() for title in titles):
            super()._update_title_position(renderer)
