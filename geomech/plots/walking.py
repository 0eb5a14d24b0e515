"""The walk of a robot: its motion in time, and the robot from the side."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from geomech.core.variables import Result
from geomech.plots.style import figure, styled
from geomech.results.scenes import scene_of
from geomech.studies import walking

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

TRIPODS = ("0.2", "C0")  # colours of the legs in step
PICTURES = 6  # of a strip
ROOM = 2.4  # robots to either side of one that is followed


@styled
def walk_figure(result: Result) -> Figure:
    """Draw forward speed, height and pitch in time, and the robot at its end."""
    t = result["t"].values
    fig, axes = figure(7.2, 4.6, 2, 2)
    lines = (
        ("forward speed (m/s)", result["v_x"].values),
        (r"height $z$ (m)", result["z"].values),
        ("pitch (degrees)", np.degrees(result["pitch"].values)),
    )
    for ax, (label, values) in zip(axes.ravel(), lines):
        ax.plot(t, values, color="black", lw=0.8)
        end = t[-1] or scene_of(result).numerics.duration
        ax.set(xlabel="$t$ (s)", ylabel=label, xlim=(0, end))
    speed = float(result["speed"])
    axes[0, 0].axhline(speed, color="C3", lw=1.0, ls="--")
    status = str(result["status"].values)
    axes[0, 0].set_title(f"mean {speed:.3g} m/s, {status}", color="C3")
    last = len(t) - 1
    walk_stage(axes[1, 1], result, np.array([last]))(last)
    return fig


@styled
def walk_strip(result: Result) -> Figure:
    """Draw the last cycle in pictures."""
    t = result["t"].values
    begin = max(0.0, t[-1] - 1 / float(result["frequency"]))
    rows = rows_at(t, np.linspace(begin, t[-1], PICTURES))
    fig, axes = figure(2.3 * 3, 1.9 * 2, 3, 2, layout="compressed")
    for ax, row in zip(axes.ravel(), rows):
        walk_stage(ax, result, np.array([row]))(row)
        ax.label_outer(remove_inner_ticks=False)
        ax.tick_params(labelbottom=True)
    return fig


def rows_at(t: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return the rows of a walk at some times."""
    return np.searchsorted(t, times - 1e-9).clip(0, len(t) - 1)


def walk_stage(
    ax: Axes, result: Result, rows: np.ndarray, follow: bool = False
) -> Callable[[int], None]:
    """Draw the ground on axes that hold the robot at these rows of its walk; return a
    function that draws it at one. follow: the axes move with the robot."""
    robot: Flat | Solid
    if "states" in result:
        robot = Solid(result)
    else:
        robot = Flat(result)
    reach, room = robot.reach, 1.1 * robot.room
    t, x = result["t"].values, result["x"].values
    seen = x[rows]
    if follow:
        room, seen = ROOM * robot.room, seen[:1]
    ax.axhspan(-3 * reach, 0.0, color="peru", alpha=0.35, lw=0)
    ax.set(
        xlim=(seen.min() - room, seen.max() + room),
        ylim=(-1.2 * reach, 3.2 * reach),
        aspect="equal",
        xlabel="$x$ (m)",
        ylabel="$z$ (m)",
    )
    draw, label = robot.on(ax), ax.set_title("", loc="left", fontsize=8)

    def update(row: int) -> None:
        draw(row)
        label.set_text(f"t = {t[row]:.2f} s")
        if follow:
            ax.set_xlim(x[row] - room, x[row] + room)

    return update


class Flat:
    """Outlines of a robot in the vertical plane. room: that it takes to both sides;
    reach: of its legs, m."""

    def __init__(self, result: Result):
        scene = scene_of(result)
        robot = scene.robot
        self.robot, self.gait = robot, scene.gait
        self.t = result["t"].values
        self.pose = np.stack([result[name].values for name in ("x", "z", "pitch")], -1)
        self.leg, self.belly = robot.leg(40).points, robot.belly(8)
        self.reach = np.abs(self.leg).max()
        self.hips = [(h, robot.hip_height) for h in robot.hips]
        along = [abs(h) + self.reach for h, _ in self.hips]
        half = getattr(robot, "length", 0.0) / 2
        self.room = max(self.reach, half, *along)

    def on(self, ax: Axes) -> Callable[[int], None]:
        phases = self.robot.hip_phases
        legs = [(k, at) for k in range(len(self.hips)) for at in phases]
        lines = []
        for k, at in legs:
            colour = TRIPODS[int((k + 2 * at) % 2)]
            lines.append(ax.plot([], [], color=colour, lw=1.2)[0])
        box = ax.plot([], [], color="black", lw=1.2)[0]

        def draw(row: int) -> None:
            pose, t = self.pose[row], self.t[row]
            for line, (k, at) in zip(lines, legs):
                phase = self.gait.frequency * t + (k * phases[-1] + at) % 1.0
                hip = rotated(np.array([self.hips[k]]), pose[2]) + pose[:2]
                turn = pose[2] + float(self.gait.angle(phase, phase))
                line.set_data(*(rotated(self.leg, turn) + hip).T)
            if self.belly is not None:
                box.set_data(*(rotated(self.belly.points, pose[2]) + pose[:2]).T)

        return draw


class Solid:
    """Triangles of a robot in three dimensions, seen from its right. room, reach: as for
    `Flat`."""

    def __init__(self, result: Result):
        self.view = walking.view(scene_of(result))
        self.states = result["states"].values
        first = self.view.triangles(self.states[0]).reshape(-1, 3)
        start = [float(result["x"].values[0]), 0.0]
        self.room = float(np.abs(first[:, [0, 1]] - start).max())
        self.reach = max(float(np.ptp(first[:, 2])), self.room / 4) / 2

    def on(self, ax: Axes) -> Callable[[int], None]:
        from matplotlib.collections import PolyCollection
        from matplotlib.colors import to_rgba

        colours = np.array([to_rgba(c) for c in ("0.75", *TRIPODS)])[self.view.groups]
        # Sheets are seen by their edges.
        drawn = ax.add_collection(PolyCollection([], lw=1.0))

        def draw(row: int) -> None:
            triangles = self.view.triangles(self.states[row])
            # What is farther off first.
            order = np.argsort(-triangles[..., 1].mean(1), kind="stable")
            drawn.set_verts(triangles[order][..., [0, 2]])
            drawn.set_facecolor(colours[order])
            drawn.set_edgecolor(colours[order])

        return draw


def rotated(points: np.ndarray, angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return points @ np.array([[c, -s], [s, c]])
