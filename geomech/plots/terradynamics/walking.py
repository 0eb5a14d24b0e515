"""The walk of a robot: its motion in time, and the robot from the side."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from geomech.core.variables import Result
from geomech.plots.look import font_points
from geomech.plots.style import columns_that_fit, figure, styled
from geomech.results.lengths import shown_lengths
from geomech.results.scenes import scene_of
from geomech.studies.terradynamics import walking

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

TRIPOD_COLOURS = ("0.2", "C0")  # of the legs that move in step
STRIP_PICTURES = 6
MEASURED_ROWS = 60  # of a film, at which the extent of a robot is taken
NARROWEST_PICTURE = 1.6  # in
ARROW = 24.0  # points, length of the arrow of gravity
FOLLOWED_SPAN = 2.4  # in half widths of a robot, to either side of one that is followed


@styled
def walk_figure(result: Result) -> Figure:
    """Draw forward speed, height and pitch in time, and the robot at its end."""
    t = result["t"].values
    fig, axes = figure(7.2, 4.6, 2, 2)
    lines = (
        (f"forward speed ({result['v_x'].unit})", result["v_x"].values),
        (rf"height $z$ ({result['z'].unit})", result["z"].values),
        ("pitch (degrees)", np.degrees(result["pitch"].values)),
    )
    for ax, (label, values) in zip(axes.ravel(), lines):
        ax.plot(t, values, color="black", lw=0.8)
        end = t[-1] or scene_of(result).numerics.duration
        ax.set(xlabel="$t$ (s)", ylabel=label, xlim=(0, end))
    speed = float(result["speed"])
    axes[0, 0].axhline(speed, color="C3", lw=1.0, ls="--")
    status = str(result["status"].values)
    axes[0, 0].set_title(
        f"mean {speed:.3g} {result['speed'].unit}, {status}", color="C3"
    )
    last = len(t) - 1
    walk_stage(axes[1, 1], result, np.array([last]))(last)
    return fig


@styled
def walk_strip(result: Result) -> Figure:
    """Draw the last cycle of a walk in pictures from the side."""
    t = result["t"].values
    begin = max(0.0, t[-1] - 1 / float(result["frequency"]))
    rows = rows_at(t, np.linspace(begin, t[-1], STRIP_PICTURES))
    columns = columns_that_fit(2.3 * 3, 3, NARROWEST_PICTURE)
    rows_of_pictures = -(-STRIP_PICTURES // columns)
    size = (2.3 * columns, 1.9 * rows_of_pictures)
    fig, axes = figure(
        *size, columns, rows_of_pictures, "compressed", NARROWEST_PICTURE
    )
    for ax, row in zip(axes.ravel(), rows):
        walk_stage(ax, result, np.array([row]))(row)
        ax.label_outer(remove_inner_ticks=False)
        ax.tick_params(labelbottom=True)
    return fig


def rows_at(t: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return the rows of a walk whose times t (N,) are the first not before
    ``times``."""
    return np.searchsorted(t, times - 1e-9).clip(0, len(t) - 1)


def walk_stage(
    ax: Axes, result: Result, rows: np.ndarray, follow: bool = False
) -> Callable[[int], None]:
    """Draw the ground on axes that hold the robot at these rows of its walk; return a
    function that draws the robot at one of them.

    follow: the axes move with the robot."""
    robot: FlatRobot | SolidRobot
    if "states" in result:
        robot = SolidRobot(result)
    else:
        robot = FlatRobot(result)
    reach = robot.leg_reach
    t = result["t"].values
    x = result["x"].values
    shown_x = x[rows]
    margin = 1.1 * robot.half_width
    if follow:
        shown_x = shown_x[:1]
        margin = FOLLOWED_SPAN * robot.half_width
    left, right = shown_x.min() - margin, shown_x.max() + margin
    bottom, top = -1.2 * reach, 3.2 * reach
    # A robot that stands high, pitches or sinks needs more than that.
    low, high = robot_limits(robot, rows)
    if not follow:
        left = min(left, low[0] - 0.1 * reach)
        right = max(right, high[0] + 0.1 * reach)
    bottom = min(bottom, low[1] - 0.1 * reach)
    top = max(top, high[1] + 0.1 * reach)
    ax.axhspan(min(-3 * reach, bottom), 0.0, color="peru", alpha=0.35, lw=0)
    ax.set(
        xlim=(left, right),
        ylim=(bottom, top),
        aspect="equal",
        xlabel=f"$x$ ({result['x'].unit})",
        ylabel=f"$z$ ({result['z'].unit})",
    )
    draw_gravity(ax, scene_of(result).walker.rise)
    draw_robot = robot.artist(ax)
    title = ax.set_title("", loc="left", fontsize=font_points(8))

    def update(row: int) -> None:
        draw_robot(row)
        title.set_text(f"t = {t[row]:.2f} s")
        if follow:
            ax.set_xlim(x[row] - margin, x[row] + margin)

    return update


def draw_gravity(ax: Axes, rise: float) -> None:
    """Draw the direction of gravity, on ground that rises along x by an angle, rad, and
    is drawn level; nothing on level ground."""
    if rise == 0.0:
        return
    direction = np.array([-np.sin(rise), -np.cos(rise)])
    ax.annotate(
        "$g$",
        xy=(0.94, 0.72),
        xycoords="axes fraction",
        xytext=-ARROW * direction,
        textcoords="offset points",
        ha="center",
        va="center",
        fontsize=font_points(8),
        arrowprops={"arrowstyle": "->", "lw": 0.8},
    )


def robot_limits(
    robot: FlatRobot | SolidRobot, rows: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and highest (x, z) of a robot at some rows of its walk, at most
    MEASURED_ROWS of them."""
    step = -(-len(rows) // MEASURED_ROWS)
    points = np.concatenate([robot.points(row) for row in rows[::step]])
    return points.min(0), points.max(0)


class FlatRobot:
    """The outlines of a robot in the vertical plane over its walk.

    half_width: distance from its origin to its farthest point along x, m. leg_reach:
    size of a leg, m."""

    def __init__(self, result: Result):
        scene = scene_of(result)
        robot = scene.robot
        self.robot = robot
        self.gait = scene.gait
        self.t = result["t"].values
        self.pose = np.stack([result[name].values for name in ("x", "z", "pitch")], -1)
        _, factor = shown_lengths(result)
        self.leg = factor * robot.leg(40).points
        belly = robot.belly(8)
        self.belly = None if belly is None else factor * belly.points
        self.leg_reach = np.abs(self.leg).max()
        self.hips = [(factor * x, factor * robot.hip_height) for x in robot.hips]
        leg_ends = [abs(x) + self.leg_reach for x, _ in self.hips]
        half_length = factor * getattr(robot, "length", 0.0) / 2
        self.half_width = max(self.leg_reach, half_length, *leg_ends)

    @property
    def legs(self) -> list[tuple[int, float]]:
        """The hip and the phase of every leg."""
        phases = self.robot.hip_phases
        return [(hip, phase) for hip in range(len(self.hips)) for phase in phases]

    def outlines(self, row: int) -> list[np.ndarray]:
        """Return the outlines (N, 2) of the legs and, if it has one, of the body."""
        place = self.pose[row, :2]
        pitch = self.pose[row, 2]
        found = []
        for hip, phase in self.legs:
            offset = (hip * self.robot.hip_phases[-1] + phase) % 1.0
            turns = self.gait.frequency * self.t[row] + offset
            centre = rotated(np.array([self.hips[hip]]), pitch) + place
            angle = pitch + float(self.gait.angle(turns, turns))
            found.append(rotated(self.leg, angle) + centre)
        if self.belly is not None:
            found.append(rotated(self.belly, pitch) + place)
        return found

    def points(self, row: int) -> np.ndarray:
        """Return points (N, 2) of its outlines."""
        return np.concatenate(self.outlines(row))

    def artist(self, ax: Axes) -> Callable[[int], None]:
        """Return a function that draws the robot at a row of its walk."""
        lines = []
        for hip, phase in self.legs:
            colour = TRIPOD_COLOURS[int((hip + 2 * phase) % 2)]
            lines += ax.plot([], [], color=colour, lw=1.2)
        lines += ax.plot([], [], color="black", lw=1.2)

        def draw(row: int) -> None:
            for line, outline in zip(lines, self.outlines(row)):
                line.set_data(*outline.T)

        return draw


class SolidRobot:
    """The triangles of a robot in three dimensions over its walk, seen from its right.

    half_width, leg_reach: as for `FlatRobot`."""

    def __init__(self, result: Result):
        self.view = walking.view(scene_of(result))
        self.states = result["states"].values
        _, self.factor = shown_lengths(result)
        first = self.factor * self.view.triangles(self.states[0]).reshape(-1, 3)
        start = [float(result["x"].values[0]), 0.0]
        self.half_width = float(np.abs(first[:, [0, 1]] - start).max())
        self.leg_reach = max(float(np.ptp(first[:, 2])), self.half_width / 4) / 2

    def points(self, row: int) -> np.ndarray:
        """Return the corners (N, 2) of its triangles from the side."""
        triangles = self.factor * self.view.triangles(self.states[row])
        return triangles[..., [0, 2]].reshape(-1, 2)

    def artist(self, ax: Axes) -> Callable[[int], None]:
        """Return a function that draws the robot at a row of its walk."""
        from matplotlib.collections import PolyCollection
        from matplotlib.colors import to_rgba

        group_colours = np.array([to_rgba(c) for c in ("0.75", *TRIPOD_COLOURS)])
        colours = group_colours[self.view.groups]
        # Lines show sheets that are seen edge-on.
        polygons = ax.add_collection(PolyCollection([], lw=1.0))

        def draw(row: int) -> None:
            triangles = self.factor * self.view.triangles(self.states[row])
            # Farther triangles are drawn first.
            order = np.argsort(-triangles[..., 1].mean(1), kind="stable")
            polygons.set_verts(triangles[order][..., [0, 2]])
            polygons.set_facecolor(colours[order])
            polygons.set_edgecolor(colours[order])

        return draw


def rotated(points: np.ndarray, angle: float) -> np.ndarray:
    """Return points (N, 2) of x and z after a rotation of x towards -z, rad."""
    c = np.cos(angle)
    s = np.sin(angle)
    return points @ np.array([[c, -s], [s, c]])
