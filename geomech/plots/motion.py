"""A body in motion: its pose on its track and its shape among all shapes, as a film's
panels and as a strip of pictures for a page."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from geomech.core.variables import Result
from geomech.geometry.field import Field
from geomech.plots.maps import ccf_map, draw_gait, has, shape_space
from geomech.plots.style import blank, figure, quantity, styled
from geomech.results.fields import field_of
from geomech.results.scenes import scene_of
from geomech.studies.fields import angle_names
from geomech.studies.motion import Motion
from geomech.studies.tables import poses
from geomech.systems.base import body_size, length_unit, shape_labels

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BODY, HEAD = "#1b4965", "#d1495b"
LINES = 8  # shape variables beyond which they are a map along the body, not a line each
MOST_JOINTS = 12  # links beyond which their joints are not marked
STRIP = 6  # pictures of a strip
MAP = 2.4  # in, height of a map with its labels
ROOM = 0.06  # of the larger side, left around what moves


def reach(motion: Motion, rows) -> tuple[np.ndarray, np.ndarray]:
    """Return (lowest, highest) x and y of all that is seen in these rows, with a margin."""
    places = [motion.pose[:, :2], _bodies(motion, rows).reshape(-1, 2)]
    low, high = np.concatenate(places).min(0), np.concatenate(places).max(0)
    room = ROOM * max(*(high - low), 1e-9 * body_size(motion.scene.system))
    return low - room, high + room


def _bodies(motion: Motion, rows) -> np.ndarray:
    """Return the links' ends (rows, points, 2), or an arrow's tail and head for a system without a body."""
    points = motion.points(rows)
    if points is not None:
        return points
    x, y, theta = motion.pose[rows].T[..., None]
    along = body_size(motion.scene.system) * np.array([-0.5, 0.5])
    return np.stack([x + np.cos(theta) * along, y + np.sin(theta) * along], -1)


def world(ax, motion: Motion, rows, limits=None) -> Callable:
    """Draw the track of the frame's origin to the scale of the body; return a function that draws the body at a row and
    returns the artists that it moved."""
    low, high = reach(motion, rows) if limits is None else limits
    unit = length_unit(motion.scene.system)
    ax.set(
        xlabel=f"x ({unit})",
        ylabel=f"y ({unit})",
        aspect="equal",
        xlim=(low[0], high[0]),
        ylim=(low[1], high[1]),
    )
    ax.plot(*motion.pose[:, :2].T, color="0.6", lw=0.6)
    (track,) = ax.plot([], [], color=HEAD, lw=1.0, zorder=3)
    few = (
        motion.points(slice(0, 1)) is not None
        and motion.points(slice(0, 1)).shape[-2] <= MOST_JOINTS + 1
    )
    (body,) = ax.plot(
        [],
        [],
        color=BODY,
        lw=2.5,
        solid_capstyle="round",
        marker="o" if few else "",
        ms=3,
        mfc="white",
        mew=0.8,
    )
    (head,) = ax.plot([], [], "o", color=HEAD, ms=5)

    def update(row: int):
        bodies = _bodies(motion, slice(row, row + 1))[0]
        track.set_data(*motion.pose[: row + 1, :2].T)
        body.set_data(*bodies.T)
        head.set_data(*bodies[-1:].T)
        return track, body, head

    return update


def shape(
    ax, motion: Motion, field: Field | None = None, error: Field | None = None
) -> Callable:
    """Draw the gait among all shapes: on the map of the CCF along x, or of the first component that exists, or on the bare
    plane of two shape variables; for more, against phase, a line each for few, a map along the body for many. Return a
    function as `world` does."""
    scene, system = motion.scene, motion.scene.system
    if system.joints == 2:
        if field is not None:
            component = next((k for k in range(3) if has(field, k)), 0)
            ccf_map(
                field,
                component,
                [scene.gait],
                ax=ax,
                error=error,
                labels=shape_labels(system),
            )
        else:
            draw_gait(scene.gait, ax)
            low, high = motion.alpha.min(0), motion.alpha.max(0)
            room = 0.15 * max(high - low) + 1e-9
            shape_space(
                ax,
                [np.array(x) for x in zip(low - room, high + room)],
                shape_labels(system),
            )
        (dot,) = ax.plot([], [], "o", color=HEAD, ms=7, mec="white", mew=0.8)
        return _moving(
            dot, lambda row: ([motion.alpha[row, 0]], [motion.alpha[row, 1]])
        )
    turns = motion.phase / (2 * np.pi)
    once = turns <= 1 + 1e-9
    ax.set(xlabel="phase (cycles)", xlim=(0, 1))
    if system.joints <= LINES:
        for k, (name, _) in enumerate(shape_labels(system)):
            ax.plot(turns[once], motion.alpha[once, k], label=quantity(name))
        ax.set_ylabel(quantity("shape variable", shape_labels(system)[0][1]))
        ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=4)
    else:
        _bends(ax, motion, turns[once])
    line = ax.axvline(0.0, color=HEAD, lw=1.5)
    return _moving(line, lambda row: ([turns[row] % 1] * 2, [0, 1]))


def _bends(ax, motion: Motion, turns) -> None:
    """Draw the curvature over phase and place along the body: angles between elements over the distance of their centres."""
    from cmcrameri import cm

    values, name, ends = (
        motion.alpha[: len(turns)].T,
        "angle between elements (rad)",
        motion.points(slice(0, 1)),
    )
    place = np.arange(1, len(values) + 1) / (len(values) + 1)
    if ends is not None and ends.shape[-2] == len(values) + 2:
        parts = np.hypot(*np.diff(ends[0], axis=0).T)
        values, place = (
            values / ((parts[1:] + parts[:-1]) / 2)[:, None],
            np.cumsum(parts[:-1]) / parts.sum(),
        )
        name = f"curvature (rad/{length_unit(motion.scene.system)})"
    top = np.abs(values).max() or 1.0
    image = ax.pcolormesh(
        turns,
        place,
        values,
        cmap=cm.vik,
        vmin=-top,
        vmax=top,
        shading="gouraud",
        rasterized=True,
    )
    ax.figure.colorbar(image, ax=ax, shrink=0.85).set_label(name)
    ax.set(ylabel="place, tail 0 to head 1", ylim=(place[0], place[-1]))


def _moving(artist, at: Callable) -> Callable:
    def update(row: int):
        artist.set_data(*at(row))
        return (artist,)

    return update


def clock(motion: Motion, row: int) -> str:
    """Return the time at a row, or its cycle where the gait has no frequency."""
    if motion.time is not None:
        return f"t = {motion.time[row]:.3g} s"
    return f"cycle {motion.phase[row] / (2 * np.pi):.2f}"


def motion_of(result: Result) -> Motion:
    """Return the motion that a result is of."""
    scene = scene_of(result)
    names = angle_names(range(scene.system.joints))
    alpha = np.stack([result[name].values for name in names], -1)
    frequency = result.attributes.get("frequency")
    return Motion(scene, result["phase"].values, alpha, poses(result), frequency)


def map_of(result: Result) -> tuple[Field | None, Field | None]:
    """Return the CCF beside a motion, and its error; None without one."""
    if "ccf" not in result:
        return None, None
    return field_of(result, "ccf")


@styled
def stage(result: Result, rows: Any, caption: str = "") -> Any:
    """Return (Figure, function that moves its artists to a row and returns them): the
    world next to the shapes.

    result: of `geomech.trajectory`. caption: of the film, such as its speed."""
    motion = motion_of(result)
    fig, axes = figure(8.0, 3.6, 2, width_ratios=[1.25, 1.0])
    track_ax, shape_ax = axes[0]
    if motion.scene.system.joints != 2:
        shape_ax.set_box_aspect(0.8)
    move_body = world(track_ax, motion, rows)
    move_shape = shape(shape_ax, motion, *map_of(result))
    text = track_ax.set_title("", loc="left")
    track_ax.set_title(caption, loc="right", color="0.3")

    def update(row: int) -> tuple:
        text.set_text(clock(motion, row))
        return *move_body(row), *move_shape(row), text

    return fig, update


@styled
def filmstrip(result: Result, pictures: int = STRIP) -> Figure:
    """Draw the body at some phases, equally spaced from start to end and to one scale, and
    its shapes in a panel next to them, with the same numbers.

    result: of `geomech.trajectory`; the panel is a map of the CCF where it has that.

    Examples
    --------
    >>> import geomech
    >>> moved = geomech.study("three-link-viscous", grid=15, phases=16).trajectory()
    >>> fig = geomech.plots.filmstrip(moved, pictures=4)
    """
    motion = motion_of(result)
    rows = np.linspace(0, len(motion.phase) - 1, pictures).round().astype(int)
    low, high = limits = reach(motion, rows)
    tall = max((high - low)[1] / (high - low)[0], 0.12)  # of a picture, for its width
    columns = min(pictures, max(1, round(1.2 * np.sqrt(tall * pictures))))
    lines = -(-pictures // columns)
    room = lines * (tall * (3.9 / columns - 0.15) + 0.3) + 0.45
    height = float(np.clip(room, MAP, 8.0))
    fig = blank(7.2, height)
    strip_cell, shape_cell = fig.add_gridspec(1, 2, width_ratios=[4.2, 3.0])
    axes = strip_cell.subgridspec(lines, columns).subplots(
        squeeze=False, sharex=True, sharey=True
    )
    for ax in axes.flat[pictures:]:
        ax.remove()
    for k, (ax, row) in enumerate(zip(axes.flat, rows)):
        world(ax, motion, rows, limits)(row)
        ax.set_title(rf"$\bf{{{k + 1}}}$  {clock(motion, row)}", loc="left", fontsize=8)
        ax.label_outer()
    around = max(1e-3, (height - MAP) / 2)
    panel = fig.add_subplot(
        shape_cell.subgridspec(3, 1, height_ratios=[around, MAP, around])[1]
    )
    shape(panel, motion, *map_of(result))
    _numbers(panel, motion, rows)
    return fig


def _numbers(ax, motion: Motion, rows) -> None:
    """Write the pictures' numbers at their shapes; numbers of one shape stand in one text."""
    numbers: dict[tuple, list[str]] = {}
    for k, row in enumerate(rows):
        turn = float(motion.phase[row] / (2 * np.pi) % 1)
        at = (
            tuple(np.round(motion.alpha[row], 9))
            if motion.scene.system.joints == 2
            else (round(turn, 9),)
        )
        numbers.setdefault(at, []).append(str(k + 1))
    middle = motion.alpha.mean(0)
    for at, texts in numbers.items():
        if len(at) == 2:
            ax.plot(*at, "o", color=HEAD, ms=6, mec="white", mew=0.8)
            away = np.subtract(at, middle)
            where = {"xy": at, "xytext": 11 * away / (np.hypot(*away) or 1.0)}
        else:
            ax.axvline(at[0], color=HEAD, lw=1.0)
            where = {
                "xy": (at[0], 1.0),
                "xycoords": ("data", "axes fraction"),
                "xytext": (0, 6),
            }
        style = {
            "textcoords": "offset points",
            "ha": "center",
            "va": "center",
            "weight": "bold",
        }
        ax.annotate(",".join(texts), **where, **style)
