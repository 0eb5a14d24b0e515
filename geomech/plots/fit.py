"""A figure made to fit a page: nothing leaves the canvas, and no text or legend lies on
another.

Texts are wrapped, legends take fewer columns, and the figure becomes as high as its
panels need. The width stays.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.legend import Legend
    from matplotlib.text import Text

    from geomech.plots.look import Look

ROUNDS = 9  # of measuring and changing, at most
GAP = 4.0  # points between texts of neighbours
LEAST_HEIGHT = 1.15  # in, of a panel
MOST_ROWS = 4  # of a figure of maps and curves that grows for its maps
TALLEST_MAP = 1.3  # height over width of a map that the figure's height is made for
SLACK = 0.08  # in, of empty margins that stay
OUTER_GAP = 0.1  # in, between panels and a legend or a text of the figure
SMALLEST = 0.8  # of the size of a text that cannot be wrapped
INSIDE, BELOW, ABOVE, BESIDE = range(4)  # where a legend of a panel lies


def fit(fig: Figure, look: Look) -> None:
    """Make a figure fit its canvas, and place its legends as the look asks."""
    if look.legend == "none":
        _remove_legends(fig)
    if look.legend == "outside":
        _join_legends(fig)
    if look.legend == "inside":
        _legends_inside(fig)
    if look.inches is not None:
        _lift_side_legends(fig)
    for _ in range(ROUNDS):
        _lay_out(fig)
        changed = [
            *map(_wrap, _texts(fig)),
            *(_fold(fig, ax) for ax in fig.axes),
            *(_fold_outer(fig, legend) for legend in fig.legends),
        ]
        if any(changed):
            continue
        if look.inches is None or not _set_height(fig):
            break
    else:
        _lay_out(fig)
    _keep_inside(fig)


def _lay_out(fig: Figure) -> None:
    engine = fig.get_layout_engine()
    if engine is not None:
        engine.execute(fig)


# Texts


class _Place:
    """A text with the room that it has along its line, in pixels."""

    def __init__(self, text: Text, room: float):
        self.text = text
        self.room = room


def _texts(fig: Figure) -> Iterator[_Place]:
    """Yield titles and labels with the room that they have."""
    gap = GAP * fig.dpi / 72
    for name in ("_suptitle", "_supxlabel"):
        text = getattr(fig, name, None)
        if text is not None:
            yield _Place(text, fig.bbox.width - 2 * gap)
    for ax in fig.axes:
        if hasattr(ax, "get_zlim") or not ax.get_visible():
            continue
        low, high = _room(fig, ax, 0)
        centre = (ax.bbox.x0 + ax.bbox.x1) / 2
        about_centre = 2 * min(centre - low, high - centre) - gap
        yield _Place(ax.title, about_centre)
        yield _Place(ax._left_title, high - ax.bbox.x0 - gap)
        yield _Place(ax._right_title, ax.bbox.x1 - low - gap)
        if not ax.axison:
            continue
        yield _Place(ax.xaxis.label, about_centre)
        low, high = _room(fig, ax, 1)
        centre = (ax.bbox.y0 + ax.bbox.y1) / 2
        yield _Place(ax.yaxis.label, 2 * min(centre - low, high - centre) - gap)
        for child in ax.child_axes:
            yield _Place(child.yaxis.label, 2 * min(centre - low, high - centre) - gap)


def _room(fig: Figure, ax: Axes, axis: int) -> tuple[float, float]:
    """Return the range about a panel along x (0) or y (1), half of the way to the next
    panels, in pixels."""
    box = ax.bbox.get_points()
    low, high = box[:, axis]
    across = box[:, 1 - axis]
    room_low = 0.0
    room_high = (fig.bbox.width, fig.bbox.height)[axis]
    for other in fig.axes:
        if other is ax or other.get_label() == "<colorbar>":
            continue
        ends = other.bbox.get_points()
        if ends[1, 1 - axis] <= across[0] or ends[0, 1 - axis] >= across[1]:
            continue
        other_low, other_high = ends[:, axis]
        if other_high <= low + 1:
            room_low = max(room_low, (other_high + low) / 2)
        if other_low >= high - 1:
            room_high = min(room_high, (other_low + high) / 2)
    return room_low, room_high


def _wrap(place: _Place) -> bool:
    """Wrap a text that is longer than its room; return whether it changed."""
    text = place.text
    shown = text.get_text()
    if not shown.strip() or not text.get_visible():
        return False
    length = _length(text)
    if length <= place.room:
        return False
    most = max(len(_plain(line)) for line in shown.split("\n"))
    target = max(4, int(most * place.room / length))
    # A text that is wrapped once more is wrapped as a whole.
    whole = getattr(text, "_whole", shown)
    text._whole = whole  # type: ignore[attr-defined]
    wrapped = wrapped_text(whole, target)
    if wrapped != shown:
        text.set_text(wrapped)
        return True
    if getattr(text, "_shrunk", False):
        return False
    text._shrunk = True  # type: ignore[attr-defined]
    text.set_fontsize(text.get_fontsize() * max(SMALLEST, place.room / length))
    return True


def _length(text: Text) -> float:
    """Return the extent of a text along its lines, in pixels."""
    box = text.get_window_extent()
    if round(text.get_rotation()) % 180 == 90:
        return box.height
    return box.width


def _plain(line: str) -> str:
    """Return about what is seen of a line with formulas."""
    return re.sub(r"\\[a-zA-Z]+|[${}^_]", "", line)


def wrapped_text(text: str, most: int) -> str:
    """Return a text whose lines have at most so many letters, broken at spaces outside
    of formulas.

    Examples
    --------
    >>> from geomech.plots.fit import wrapped_text
    >>> wrapped_text("mean thrust and drag", 12)
    'mean thrust\\nand drag'
    """
    lines = []
    for line in text.split("\n"):
        words = re.findall(r"(?:\$[^$]*\$|[^\s$])+", line)
        row: list[str] = []
        for word in words:
            if row and len(_plain(" ".join([*row, word]))) > most:
                lines.append(" ".join(row))
                row = []
            row.append(word)
        lines.append(" ".join(row))
    return "\n".join(lines)


# Legends


def _remove_legends(fig: Figure) -> None:
    for legend in [*fig.legends, *(ax.get_legend() for ax in fig.axes)]:
        if legend is not None:
            legend.remove()


def _entries(fig: Figure, legend: Legend) -> dict[str, Any]:
    """Return the handles of a legend by its labels."""
    known: dict[str, Any] = {}
    for ax in fig.axes:
        for handle, label in zip(*ax.get_legend_handles_labels()):
            known.setdefault(label, handle)
    found = {}
    for handle, text in zip(legend.legend_handles, legend.get_texts()):
        label = text.get_text()
        found[label] = known.get(label, handle)
    return found


def _join_legends(fig: Figure) -> None:
    """Draw one legend for all panels above them."""
    entries: dict[str, Any] = {}
    for legend in [*fig.legends, *(ax.get_legend() for ax in fig.axes)]:
        if legend is not None:
            entries |= _entries(fig, legend)
    _remove_legends(fig)
    if entries:
        _draw_outer(fig, entries, len(entries))


def _legends_inside(fig: Figure) -> None:
    """Move legends into their panels, that of the figure into the first."""
    outer: dict[str, Any] = {}
    for legend in [*fig.legends]:
        outer |= _entries(fig, legend)
        legend.remove()
    for k, ax in enumerate(fig.axes):
        legend = ax.get_legend()
        entries = {}
        if legend is not None:
            entries = _entries(fig, legend)
        if k == 0:
            entries = {**outer, **entries}
        if entries:
            ax.legend(entries.values(), entries.keys(), loc="best")


def _lift_side_legends(fig: Figure) -> None:
    """Draw legends of the figure above the panels if they stand beside them."""
    if not fig.legends:
        return
    _lay_out(fig)
    for legend in [*fig.legends]:
        box = legend.get_window_extent()
        lowest = box.y0 < 2 * GAP
        highest = box.y1 > fig.bbox.height - 2 * GAP
        if not lowest and not highest:
            entries = _entries(fig, legend)
            legend.remove()
            _draw_outer(fig, entries, len(entries))


def _draw_outer(
    fig: Figure, entries: dict[str, Any], columns: int, side: str = "upper"
) -> None:
    """Draw a legend of the figure, outside of its panels."""
    place = f"outside {side} center"
    fig.legend(entries.values(), entries.keys(), loc=place, ncols=columns)


def _fold_outer(fig: Figure, legend: Legend) -> bool:
    """Draw a legend of the figure in fewer columns if it is wider than the canvas."""
    box = legend.get_window_extent()
    if box.width <= fig.bbox.width:
        return False
    columns = legend._ncols
    if columns == 1:
        return _wrap_entries(legend, fig.bbox.width)
    side = "upper" if box.y0 > 0.5 * fig.bbox.height else "lower"
    entries = _entries(fig, legend)
    fewer = max(1, min(columns - 1, int(columns * fig.bbox.width / box.width)))
    legend.remove()
    _draw_outer(fig, entries, fewer, side)
    return True


def _wrap_entries(legend: Legend, room: float) -> bool:
    """Wrap the entries of a legend of one column."""
    excess = legend.get_window_extent().width - room
    changed = False
    for text in legend.get_texts():
        length = text.get_window_extent().width
        widest = max(t.get_window_extent().width for t in legend.get_texts())
        changed |= _wrap(_Place(text, min(length, widest - excess - 1)))
    return changed


def _fold(fig: Figure, ax: Axes) -> bool:
    """Draw a legend of a panel in fewer columns if it leaves the panel's room."""
    legend = ax.get_legend()
    if legend is None or not legend.get_visible():
        return False
    box = legend.get_window_extent()
    place = _place_of(ax, box)
    low, high = _room(fig, ax, 0)
    centre = (ax.bbox.x0 + ax.bbox.x1) / 2
    room = 2 * min(centre - low, high - centre) - GAP
    if place == INSIDE:
        room = ax.bbox.width
    fits = box.width <= room and place != BESIDE
    if fits and getattr(legend, "_placed", place == INSIDE):
        return False
    columns = legend._ncols
    if box.width > room and columns == 1 and place != BESIDE:
        if _wrap_entries(legend, room):
            return True
    elif box.width > room:
        columns = max(1, min(columns - 1, int(columns * room / box.width)))
    if getattr(legend, "_placed", False) and columns == legend._ncols:
        return False
    _redraw(fig, ax, legend, place, columns)
    return True


def _place_of(ax: Axes, box: Any) -> int:
    """Return where a legend with this box lies."""
    if box.y1 <= ax.bbox.y0 + 1:
        return BELOW
    if box.y0 >= ax.bbox.y1 - 1:
        return ABOVE
    if box.x0 >= ax.bbox.x1 - 1:
        return BESIDE
    return INSIDE


def _redraw(fig: Figure, ax: Axes, legend: Legend, place: int, columns: int) -> None:
    """Draw the legend of a panel anew: below its label, above its title, or inside."""
    from matplotlib.transforms import ScaledTranslation

    entries = _entries(fig, legend)
    title = legend.get_title().get_text() or None
    legend.remove()
    look: dict[str, Any] = {"ncols": columns, "title": title, "borderaxespad": 0.3}
    if place == INSIDE:
        look["loc"] = "best"
    else:
        boxes = [text.get_window_extent() for text in _titles(ax)]
        height = max([ax.bbox.y1, *(box.y1 for box in boxes)]) - ax.bbox.y1
        anchor = (0.5, 1.0)
        look["loc"] = "lower center"
        if place == BELOW:
            label = ax.xaxis.get_tightbbox()
            height = 0.0 if label is None else min(0.0, label.y0 - ax.bbox.y0)
            anchor = (0.5, 0.0)
            look["loc"] = "upper center"
        shift = ScaledTranslation(0, height / fig.dpi, fig.dpi_scale_trans)
        look |= {"bbox_to_anchor": anchor, "bbox_transform": ax.transAxes + shift}
    new = ax.legend(entries.values(), entries.keys(), **look)
    new._placed = True  # type: ignore[attr-defined]
    if title:
        new.get_title().set_fontsize(new.get_texts()[0].get_fontsize())


def _titles(ax: Axes) -> list[Any]:
    titles = (ax.title, ax._left_title, ax._right_title)
    return [title for title in titles if title.get_text()]


# Height


def _set_height(fig: Figure) -> bool:
    """Make the figure as high as its panels need; return whether it changed."""
    width, height = fig.get_size_inches()
    grids = {}
    shortest = np.inf
    has_maps = False
    missing = 0.0  # width that maps leave empty as they lack height, in
    for ax in fig.axes:
        spec = ax.get_subplotspec()
        if spec is None or not ax.axison or hasattr(ax, "get_zlim"):
            continue
        grid = spec.get_topmost_subplotspec().get_gridspec()
        grids[id(grid)] = grid.nrows
        if ax.get_aspect() == "auto":
            shortest = min(shortest, ax.bbox.height / fig.dpi)
        else:
            has_maps = True
            cell = ax.get_position(original=True).width
            shown = ax.get_position()
            if shown.height * height <= TALLEST_MAP * shown.width * width:
                missing = max(missing, width * (cell - shown.width))
    rows = max(grids.values(), default=1)
    if shortest < LEAST_HEIGHT - 0.02:
        fig.set_figheight(height + rows * (LEAST_HEIGHT - shortest))
        return True
    if np.isfinite(shortest):
        if missing > 0.2 * width and rows <= MOST_ROWS:
            fig.set_figheight(height + 0.8 * rows * missing)
            return True
        return False
    if not has_maps:
        return False
    spare_height = _spare_height(fig)
    spare_width = width - fig.get_tightbbox().width
    if spare_width > 2 * SLACK and spare_height < 2 * SLACK:
        fig.set_figheight(height + 0.7 * rows * spare_width)
        return True
    if spare_height > 2 * SLACK:
        fig.set_figheight(height - spare_height + SLACK)
        return True
    return False


def _spare_height(fig: Figure) -> float:
    """Return the height that is left empty above and below all panels, in: to the ends
    of the canvas, or to the legends and the texts of the figure."""
    boxes = [ax.get_tightbbox() for ax in fig.axes if ax.get_visible()]
    bottom = min(box.y0 for box in boxes if box is not None)
    top = max(box.y1 for box in boxes if box is not None)
    lowest = 0.0
    highest = fig.bbox.height
    for outer in (*fig.legends, fig._suptitle, fig._supxlabel):  # type: ignore
        if outer is None or not outer.get_visible():
            continue
        box = outer.get_window_extent()
        gap = OUTER_GAP * fig.dpi
        if box.y0 > (bottom + top) / 2:
            highest = min(highest, box.y0 - gap)
        else:
            lowest = max(lowest, box.y1 + gap)
    # Empty margins are alike at both ends.
    return 2 * max(highest - top, bottom - lowest) / fig.dpi


def _keep_inside(fig: Figure) -> None:
    """Lay panels out in a part of the canvas if something would leave it.

    Each layout may choose other ticks, so that it is judged after one more."""
    engine = fig.get_layout_engine()
    if engine is None:
        return
    x, y, w, h = engine.get().get("rect", (0.0, 0.0, 1.0, 1.0))
    left, bottom, right, top = x, y, x + w, y + h
    for _ in range(4):
        _lay_out(fig)
        width, height = fig.get_size_inches()
        box = fig.get_tightbbox()
        over = (-box.x0, -box.y0, box.x1 - width, box.y1 - height)
        if max(over) <= 0:
            return
        left += max(0.0, over[0] + 0.01) / width
        bottom += max(0.0, over[1] + 0.01) / height
        right -= max(0.0, over[2] + 0.01) / width
        top -= max(0.0, over[3] + 0.01) / height
        engine.set(rect=(left, bottom, right - left, top - bottom))
