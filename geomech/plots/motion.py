"""A body in motion: its pose on its track and its shape among all shapes, as a film's
panels and as a strip of pictures for a page."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from geomech.core.variables import Result
from geomech.mathematics.geometry.periods import period_of, wrapped
from geomech.mathematics.geometry.representations.field import Field
from geomech.mathematics.systems.base import body_size, shape_labels
from geomech.plots.look import font_points
from geomech.plots.maps import (
    ccf_map,
    draw_colours,
    draw_gait,
    has_component,
    shape_space,
)
from geomech.plots.style import blank, columns_that_fit, figure, quantity, styled
from geomech.results.fields import field_of, loops_of
from geomech.results.lengths import shown_lengths
from geomech.results.scenes import scene_of
from geomech.studies.displacement.variables import poses
from geomech.studies.maps.fields import angle_names
from geomech.studies.mechanics.motion import Motion

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BODY = "#1b4965"  # colour
LIFTED = "#9cb4c4"  # colour of the parts of a body that do not touch the ground
TOUCHES = 0.5  # weight of contact from which a link is drawn as touching
HEAD = "#d1495b"  # colour of the head, its track and the present shape
LINES = 8  # shape variables that are drawn as curves; more as a map along the body
MARKED_LINKS = 12  # of the longest chain whose joints are marked
STRIP_PICTURES = 6
STRIP_WIDTH = 7.2  # in
HIGHEST_STRIP = 8.0  # in
MAP_HEIGHT = 2.4  # in, with labels
MARGIN = 0.06  # of the larger side, around everything that moves

# Moves artists to a row of a motion and returns them.
Update = Callable[[int], tuple]


@dataclass(frozen=True, eq=False)
class ShownMotion(Motion):
    """A motion whose lengths are in the unit of a picture.

    factor: of that unit to the scene's. loops: curves in shape space to draw, gaits or
    `geomech.results.fields.Loop`. weights: (P, links), of contact, or None."""

    unit: str = "BL"
    factor: float = 1.0
    loops: tuple = ()
    weights: np.ndarray | None = None

    @property
    def size(self) -> float:
        """The length of the body."""
        return self.factor * body_size(self.scene.system)

    def points(self, rows: Any = slice(None)) -> np.ndarray | None:
        """Return ends of the links as `Motion.points` does, in the unit."""
        pose = self.pose / [self.factor, self.factor, 1.0]
        points = replace(self, pose=pose, factor=1.0).own_points(rows)
        if points is None:
            return None
        return self.factor * points

    def own_points(self, rows: Any) -> np.ndarray | None:
        return super().points(rows)

    def leg_points(self, rows: Any = slice(None)) -> np.ndarray | None:
        """Return shoulders and feet as `Motion.leg_points` does, in the unit."""
        pose = self.pose / [self.factor, self.factor, 1.0]
        legs = replace(self, pose=pose, factor=1.0).own_leg_points(rows)
        if legs is None:
            return None
        return self.factor * legs

    def own_leg_points(self, rows: Any) -> np.ndarray | None:
        return super().leg_points(rows)


# The world


def world_limits(motion: ShownMotion, rows: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and highest (x, y) of the track and of the body at these rows,
    with a margin."""
    points = [motion.pose[:, :2], _bodies(motion, rows).reshape(-1, 2)]
    legs = motion.leg_points(rows)
    if legs is not None:
        points.append(legs.reshape(-1, 2))
    low = np.concatenate(points).min(0)
    high = np.concatenate(points).max(0)
    margin = MARGIN * max(*(high - low), 1e-9 * motion.size)
    return low - margin, high + margin


def _bodies(motion: ShownMotion, rows: Any) -> np.ndarray:
    """Return the ends of the links (rows, points, 2), or tail and head of an arrow for
    a system without a body."""
    points = motion.points(rows)
    if points is not None:
        return points
    x, y, theta = motion.pose[rows].T[..., None]
    along = motion.size * np.array([-0.5, 0.5])
    return np.stack([x + np.cos(theta) * along, y + np.sin(theta) * along], -1)


def draw_world(ax: Axes, motion: ShownMotion, rows: Any, limits: Any = None) -> Update:
    """Draw the track of the frame's origin to the scale of the body; return a function
    that draws the body at a row and returns the artists that it moved.

    rows: of all pictures, which fit into the axes. limits: of the axes,
    as from `world_limits`."""
    low, high = limits or world_limits(motion, rows)
    ax.set(
        xlabel=f"x ({motion.unit})",
        ylabel=f"y ({motion.unit})",
        aspect="equal",
        xlim=(low[0], high[0]),
        ylim=(low[1], high[1]),
    )
    ax.plot(*motion.pose[:, :2].T, color="0.6", lw=0.6)
    (track,) = ax.plot([], [], color=HEAD, lw=1.0, zorder=3)
    marker = "o" if _has_few_links(motion) else ""
    joints = {"marker": marker, "ms": 3, "mfc": "white", "mew": 0.8}
    weights = motion.weights
    has_legs = motion.leg_points(slice(0, 1)) is not None
    colour = BODY if weights is None or has_legs else LIFTED
    (body,) = ax.plot([], [], color=colour, lw=2.5, solid_capstyle="round", **joints)
    (touching,) = ax.plot([], [], color=BODY, lw=3.5, solid_capstyle="butt")
    (legs,) = ax.plot([], [], color=LIFTED, lw=1.5, zorder=1.9)
    (feet,) = ax.plot([], [], "o", color=BODY, ms=4)
    (head,) = ax.plot([], [], "o", color=HEAD, ms=5)

    def update(row: int) -> tuple:
        points = _bodies(motion, slice(row, row + 1))[0]
        track.set_data(*motion.pose[: row + 1, :2].T)
        body.set_data(*points.T)
        head.set_data(*points[-1:].T)
        if weights is None:
            return track, body, head
        if has_legs:
            lines = motion.leg_points(slice(row, row + 1))[0]
            legs.set_data(*_separated(lines).T)
            feet.set_data(*lines[weights[row] >= TOUCHES, 1].T)
            return track, body, legs, feet, head
        touching.set_data(*_touching_lines(points, weights[row]).T)
        return track, body, touching, head

    return update


def _separated(lines: np.ndarray) -> np.ndarray:
    """Return lines (n, 2, 2) one after the other (3 n, 2), with nan between them."""
    gaps = np.full((len(lines), 1, 2), np.nan)
    return np.concatenate([lines, gaps], 1).reshape(-1, 2)


def _touching_lines(points: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the links that touch the ground as a line (2 links + 1, 2) with gaps of
    nan, from ends (links + 1, 2) and weights (links,)."""
    touches = (weights >= TOUCHES)[:, None]
    breaks = np.where(touches, points[:-1], np.nan)
    links = np.stack([points[:-1], breaks], 1).reshape(-1, 2)
    return np.concatenate([links, points[-1:]])


def _has_few_links(motion: ShownMotion) -> bool:
    """Return whether the body is a chain of few enough links to mark its joints."""
    points = motion.points(slice(0, 1))
    return points is not None and points.shape[-2] <= MARKED_LINKS + 1


# Shape space


def draw_shapes(
    ax: Axes,
    motion: ShownMotion,
    field: Field | None = None,
    error: Field | None = None,
) -> Update:
    """Draw the gait among all shapes; return a function that marks the shape at a row
    and returns the artists that it moved.

    Two shape variables are drawn as a plane, with the CCF if there is one; more against
    phase, as curves or as a map along the body.

    field, error: the CCF and its error. Its component along x is drawn, or the first
    that is not zero."""
    if motion.scene.system.joints == 2:
        if field is None:
            _draw_plane(ax, motion)
        else:
            _draw_ccf(ax, motion, field, error)
        dot_style = {"ms": 7, "mec": "white", "mew": 0.8}
        (dot,) = ax.plot([], [], "o", color=HEAD, **dot_style)

        def move_dot(row: int) -> tuple:
            alpha = motion.alpha[row]
            if field is not None:
                alpha = wrapped(alpha, field.axes, field.periods)
            dot.set_data([alpha[0]], [alpha[1]])
            return (dot,)

        return move_dot

    turns = motion.phase / (2 * np.pi)
    _draw_cycle(ax, motion, turns)
    line = ax.axvline(0.0, color=HEAD, lw=1.5)

    def move_line(row: int) -> tuple:
        line.set_data([turns[row] % 1] * 2, [0, 1])
        return (line,)

    return move_line


def _draw_ccf(ax: Axes, motion: ShownMotion, field: Field, error: Field | None) -> None:
    """Draw the map of the CCF with the gait on it."""
    present = [k for k in range(3) if has_component(field, k)]
    component = present[0] if present else 0
    labels = shape_labels(motion.scene.system)
    ccf_map(field, component, motion.loops, ax=ax, error=error, labels=labels)


def _draw_plane(ax: Axes, motion: ShownMotion) -> None:
    """Draw the gait on the bare plane of two shape variables."""
    for loop in motion.loops:
        line = getattr(loop, "line", "-")
        draw_gait(loop, ax, getattr(loop, "colour", "black"), line=line)
    low = motion.alpha.min(0)
    high = motion.alpha.max(0)
    margin = 0.15 * max(high - low) + 1e-9
    axes = np.stack([low - margin, high + margin], -1)
    shape_space(ax, axes, shape_labels(motion.scene.system))


def _draw_cycle(ax: Axes, motion: ShownMotion, turns: np.ndarray) -> None:
    """Draw the shape variables over one cycle. turns: phase in cycles, at each row."""
    labels = shape_labels(motion.scene.system)
    first = turns <= 1 + 1e-9
    ax.set(xlabel="phase (cycles)", xlim=(0, 1))
    if motion.scene.system.joints > LINES:
        _draw_bends(ax, motion, turns[first])
        return
    periods = motion.scene.system.traits.periods
    for k, (name, _) in enumerate(labels):
        values = motion.alpha[first, k]
        period = period_of(periods, k)
        if period is not None:  # the end of a cycle is stored as its start
            values = np.unwrap(values, period=period)
        ax.plot(turns[first], values, label=quantity(name))
    ax.set_ylabel(quantity("shape variable", labels[0][1]))
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=4)


def _draw_bends(ax: Axes, motion: ShownMotion, turns: np.ndarray) -> None:
    """Draw a map over phase and place along the body: the curvature, which is the angle
    between elements over the distance of their centres, or the bare angles where there
    is no chain of elements."""
    values = motion.alpha[: len(turns)].T
    joints = len(values)
    points = motion.points(slice(0, 1))
    if points is not None and points.shape[-2] == joints + 2:
        lengths = np.hypot(*np.diff(points[0], axis=0).T)
        centre_distances = (lengths[1:] + lengths[:-1]) / 2
        values = values / centre_distances[:, None]
        place = np.cumsum(lengths[:-1]) / lengths.sum()
        name = f"curvature (rad/{motion.unit})"
    else:
        place = np.arange(1, joints + 1) / (joints + 1)
        name = "angle between elements (rad)"
    top = np.abs(values).max() or 1.0
    image = draw_colours(ax, turns, place, values, top, "gouraud")
    ax.figure.colorbar(image, ax=ax, shrink=0.85).set_label(name)
    ax.set(ylabel="place, tail 0 to head 1", ylim=(place[0], place[-1]))


# Films and strips


def time_text(motion: ShownMotion, row: int) -> str:
    """Return the time at a row, or its cycle where the gait has no frequency."""
    if motion.time is not None:
        return f"t = {motion.time[row]:.3g} s"
    return f"cycle {motion.phase[row] / (2 * np.pi):.2f}"


def motion_of(result: Result) -> ShownMotion:
    """Return the motion of a scene from its result."""
    scene = scene_of(result)
    names = angle_names(range(scene.system.joints))
    alpha = np.stack([result[name].values for name in names], -1)
    frequency = result.attributes.get("frequency")
    unit, factor = shown_lengths(result)
    phase = result["phase"].values
    weights = None
    if "contact_1" in result:
        count = sum(name.startswith("contact_") for name in result)
        columns = [result[f"contact_{k + 1}"].values for k in range(count)]
        weights = np.stack(columns, -1)
    return ShownMotion(
        scene,
        phase,
        alpha,
        poses(result),
        frequency,
        unit=unit,
        factor=factor,
        loops=tuple(loops_of(result, scene.gait)),
        weights=weights,
    )


def ccf_of(result: Result) -> tuple[Field | None, Field | None]:
    """Return the CCF of a motion's result and its error, or (None, None) without
    one."""
    if "ccf" not in result:
        return None, None
    return field_of(result, "ccf")


@styled
def stage(result: Result, rows: Any, caption: str = "") -> Any:
    """Return (Figure, function that moves its artists to a row and returns them), with
    the body on its track next to its shape among all shapes.

    result: of `geomech.trajectory`. rows: of all pictures of the film. caption: of the
    film, such as its speed."""
    motion = motion_of(result)
    fig, axes = figure(8.0, 3.6, 2, width_ratios=[1.25, 1.0])
    track_ax, shape_ax = axes[0]
    if motion.scene.system.joints != 2:
        shape_ax.set_box_aspect(0.8)
    move_body = draw_world(track_ax, motion, rows)
    move_shape = draw_shapes(shape_ax, motion, *ccf_of(result))
    text = track_ax.set_title("", loc="left")
    track_ax.set_title(caption, loc="right", color="0.3")

    def update(row: int) -> tuple:
        text.set_text(time_text(motion, row))
        return *move_body(row), *move_shape(row), text

    return fig, update


@styled
def filmstrip(result: Result, pictures: int = STRIP_PICTURES) -> Figure:
    """Draw the body at some phases, equally spaced from start to end and to one scale,
    and its shapes in a panel next to them, with the same numbers.

    result: of `geomech.trajectory`; with a CCF, the panel is a map of it.

    Examples
    --------
    >>> import geomech
    >>> moved = geomech.study("three-link-viscous", grid=15, phases=16).trajectory()
    >>> fig = geomech.plots.filmstrip(moved, pictures=4)
    """
    motion = motion_of(result)
    rows = np.linspace(0, len(motion.phase) - 1, pictures).round().astype(int)
    limits = world_limits(motion, rows)
    fig, axes, panel = _strip_panels(pictures, *limits)
    for k, row in enumerate(rows):
        ax = axes[k]
        draw_world(ax, motion, rows, limits)(row)
        title = rf"$\bf{{{k + 1}}}$  {time_text(motion, row)}"
        ax.set_title(title, loc="left", fontsize=font_points(8))
        ax.label_outer()
    draw_shapes(panel, motion, *ccf_of(result))
    if motion.scene.system.joints == 2:
        _number_shapes(panel, motion, rows)
    else:
        _number_phases(panel, motion, rows)
    return fig


def _strip_panels(
    pictures: int, low: np.ndarray, high: np.ndarray
) -> tuple[Any, list, Any]:
    """Return (Figure, Axes of the pictures, Axes of the shapes), in a height that fits
    pictures from ``low`` to ``high`` (2,)."""
    width, height = high - low
    aspect = max(height / width, 0.12)
    columns = min(pictures, max(1, round(1.2 * np.sqrt(aspect * pictures))))
    lines = -(-pictures // columns)
    strip_height = lines * (aspect * (3.9 / columns - 0.15) + 0.3) + 0.45
    if columns_that_fit(STRIP_WIDTH, 2) == 1:
        strip_height = min(strip_height, HIGHEST_STRIP)
        fig = blank(STRIP_WIDTH, strip_height + MAP_HEIGHT)
        heights = [strip_height, MAP_HEIGHT]
        strip_cell, shape_cell = fig.add_gridspec(2, 1, height_ratios=heights)
        axes = _strip_axes(strip_cell, lines, columns, pictures)
        return fig, axes, fig.add_subplot(shape_cell)

    fig_height = float(np.clip(strip_height, MAP_HEIGHT, HIGHEST_STRIP))
    fig = blank(STRIP_WIDTH, fig_height)
    strip_cell, shape_cell = fig.add_gridspec(1, 2, width_ratios=[4.2, 3.0])
    axes = _strip_axes(strip_cell, lines, columns, pictures)
    around = max(1e-3, (fig_height - MAP_HEIGHT) / 2)
    cells = shape_cell.subgridspec(3, 1, height_ratios=[around, MAP_HEIGHT, around])
    return fig, axes, fig.add_subplot(cells[1])


def _strip_axes(cell: Any, lines: int, columns: int, pictures: int) -> list:
    """Return the Axes of the pictures in a cell of a figure."""
    grid = cell.subgridspec(lines, columns)
    axes = grid.subplots(squeeze=False, sharex=True, sharey=True)
    for ax in axes.flat[pictures:]:
        ax.remove()
    return list(axes.flat[:pictures])


def _number_shapes(ax: Axes, motion: ShownMotion, rows: np.ndarray) -> None:
    """Write the pictures' numbers at their shapes on the plane, away from its
    middle."""
    shapes = [tuple(np.round(motion.alpha[row], 9)) for row in rows]
    middle = motion.alpha.mean(0)
    for shape, text in _numbers_by_place(shapes).items():
        ax.plot(*shape, "o", color=HEAD, ms=6, mec="white", mew=0.8)
        away = np.subtract(shape, middle)
        offset = 11 * away / (np.hypot(*away) or 1.0)
        _write_number(ax, text, shape, offset)


def _number_phases(ax: Axes, motion: ShownMotion, rows: np.ndarray) -> None:
    """Write the pictures' numbers above lines at their phases."""
    turns = [round(float(motion.phase[row] / (2 * np.pi) % 1), 9) for row in rows]
    for turn, text in _numbers_by_place(turns).items():
        ax.axvline(turn, color=HEAD, lw=1.0)
        _write_number(ax, text, (turn, 1.0), (0, 6), xycoords=("data", "axes fraction"))


def _numbers_by_place(places: Sequence) -> dict[Any, str]:
    """Return the numbers of pictures, from 1, by their place; those of one place are
    joined by commas."""
    numbers: dict[Any, list[str]] = {}
    for k, place in enumerate(places):
        numbers.setdefault(place, []).append(str(k + 1))
    return {place: ",".join(texts) for place, texts in numbers.items()}


def _write_number(ax: Axes, text: str, point: Any, offset: Any, **options: Any) -> None:
    """Write a number next to a point. offset: in points of the page."""
    look = {"ha": "center", "va": "center", "weight": "bold"}
    place = {"xytext": offset, "textcoords": "offset points"}
    ax.annotate(text, point, **place, **look, **options)
