"""The walk of a robot in pictures and films."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from matplotlib.colors import to_rgba

from geomech import plots
from geomech.core.variables import Result
from geomech.io.files import atomic_file
from geomech.output import animate
from geomech.results.scenes import scene_of
from geomech.studies import walking

TRIPODS = ("0.2", "C0")  # colours of the legs in step
FRAMES, STRIP = 100, 6  # pictures of a film, at most, and of a strip
WIDE, TALL = 6.4, (1.8, 3.6)  # in, of a film and the limits of its height
LABELS = 0.95  # in, of these, for the labels
ROOM = 2.4  # robots to either side of one that is followed


@plots.styled
def draw(result: Result):
    """Draw forward speed, height and pitch in time, and the robot at its end."""
    t = result["t"].values
    fig, axes = plots.figure(7.2, 4.6, 2, 2)
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
    _stage(axes[1, 1], result, np.array([len(t) - 1]))(len(t) - 1)
    return fig


def film(result: Result, path: Path, follow: bool = False) -> None:
    """Write a film (.gif, .mp4) of a walk; whole or not at all. follow: the camera goes
    with the robot."""
    at = animate.pace(scene_of(result).gait.frequency)
    with atomic_file(path) as part:
        frames = _frames(result, at, follow)
        animate.encode(part, frames, at.rate, path.suffix.lower())


@plots.styled
def strip(result: Result):
    """Draw the last cycle in pictures."""
    t = result["t"].values
    begin = max(0.0, t[-1] - 1 / float(result["frequency"]))
    rows = _rows(t, np.linspace(begin, t[-1], STRIP))
    fig, axes = plots.figure(2.3 * 3, 1.9 * 2, 3, 2, layout="compressed")
    for ax, row in zip(axes.ravel(), rows):
        _stage(ax, result, np.array([row]))(row)
        ax.label_outer(remove_inner_ticks=False)
        ax.tick_params(labelbottom=True)
    return fig


def _rows(t: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return the rows of a walk at some times."""
    return np.searchsorted(t, times - 1e-9).clip(0, len(t) - 1)


def _frames(result: Result, at: animate.Pace, follow: bool) -> Iterator[np.ndarray]:
    """Yield pictures (height, width, 3), bytes, at the rate of the film: by MuJoCo for a
    walk of three dimensions where there is a GL to draw with."""
    t, frequency = result["t"].values, float(result["frequency"])
    speed = 1 / (frequency * at.cycle)
    count = min(FRAMES, 1 + int(t[-1] / speed * at.rate))
    rows = _rows(t, np.arange(count) * speed / at.rate)
    if "states" in result:
        states = result["states"].values[rows]
        pictures = walking.view(scene_of(result)).pictures(states)
        if pictures:
            return _captioned(pictures, t[rows], at.caption)
    return _drawn(result, rows, at.caption, follow)


def _captioned(
    pictures: Iterator[np.ndarray], times: np.ndarray, caption: str
) -> Iterator[np.ndarray]:
    """Yield pictures with the time and the speed of the film in their upper corners."""
    from PIL import Image, ImageDraw, ImageFont

    font = ImageFont.load_default(14)
    for picture, t in zip(pictures, times):
        image = Image.fromarray(picture)
        draw, words = (
            ImageDraw.Draw(image),
            {"fill": "white", "font": font, "stroke_width": 1, "stroke_fill": "black"},
        )
        draw.text((10, 8), f"t = {t:.2f} s", **words)
        draw.text((image.width - 10, 8), caption, anchor="ra", **words)
        yield np.array(image)


@plots.styled
def _drawn(
    result: Result, rows: np.ndarray, caption: str, follow: bool
) -> Iterator[np.ndarray]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    fig, axes = plots.figure(WIDE, TALL[1])
    ax = axes[0, 0]
    update = _stage(ax, result, rows, follow)
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    fig.set_figheight(
        float(np.clip((WIDE - LABELS) * (high - low) / (right - left) + LABELS, *TALL))
    )
    ax.set_title(caption, loc="right", fontsize=8, color="0.3")
    fig.set_dpi(animate.DOTS)
    canvas = FigureCanvasAgg(fig)
    for row in rows:
        update(row)
        canvas.draw()
        fig.set_layout_engine("none")  # so that the axes stand still
        yield np.array(canvas.buffer_rgba())[..., :3]


def _stage(ax, result: Result, rows: np.ndarray, follow: bool = False):
    """Draw the ground on axes that hold the robot at these rows of its walk; return a
    function that draws it at one. follow: the axes move with the robot."""
    robot = (_Solid if "states" in result else _Flat)(result)
    room, reach = robot.room * (ROOM if follow else 1.1), robot.reach
    t, x = result["t"].values, result["x"].values
    ax.axhspan(-3 * reach, 0.0, color="peru", alpha=0.35, lw=0)
    seen = x[rows]
    if follow:
        seen = seen[:1]
    ax.set(
        xlim=(seen.min() - room, seen.max() + room),
        ylim=(-1.2 * reach, 3.2 * reach),
        aspect="equal",
        xlabel="$x$ (m)",
        ylabel="$z$ (m)",
    )
    draw, label = robot.on(ax), ax.set_title("", loc="left", fontsize=8)

    def update(row):
        draw(row)
        label.set_text(f"t = {t[row]:.2f} s")
        if follow:
            ax.set_xlim(x[row] - room, x[row] + room)

    return update


class _Flat:
    """Outlines of a robot in the vertical plane. room: that it takes to both sides; reach: of its legs, m."""

    def __init__(self, result: Result):
        scene = scene_of(result)
        self.robot, self.gait = scene.robot, scene.gait
        self.t = result["t"].values
        self.pose = np.stack([result[name].values for name in ("x", "z", "pitch")], -1)
        self.leg, self.belly = scene.robot.leg(40).points, scene.robot.belly(8)
        self.reach, self.hips = (
            np.abs(self.leg).max(),
            [(h, scene.robot.hip_height) for h in scene.robot.hips],
        )
        extents = [
            self.reach,
            *(abs(h) + self.reach for h, _ in self.hips),
            getattr(scene.robot, "length", 0.0) / 2,
        ]
        self.room = max(extents)

    def on(self, ax):
        legs = [(k, at) for k in range(len(self.hips)) for at in self.robot.hip_phases]
        lines = [
            ax.plot([], [], color=TRIPODS[int((k + 2 * at) % 2)], lw=1.2)[0]
            for k, at in legs
        ]
        box = ax.plot([], [], color="black", lw=1.2)[0]

        def draw(row):
            pose, t = self.pose[row], self.t[row]
            for line, (k, at) in zip(lines, legs):
                phase = (
                    self.gait.frequency * t + (k * self.robot.hip_phases[-1] + at) % 1.0
                )
                hip = _rotated(np.array([self.hips[k]]), pose[2]) + pose[:2]
                line.set_data(
                    *(
                        _rotated(
                            self.leg, pose[2] + float(self.gait.angle(phase, phase))
                        )
                        + hip
                    ).T
                )
            if self.belly is not None:
                box.set_data(*(_rotated(self.belly.points, pose[2]) + pose[:2]).T)

        return draw


class _Solid:
    """Triangles of a robot in three dimensions, seen from its right. room, reach: as for `_Flat`."""

    def __init__(self, result: Result):
        self.view = walking.view(scene_of(result))
        self.states = result["states"].values
        first = self.view.triangles(self.states[0]).reshape(-1, 3)
        start = [float(result["x"].values[0]), 0.0]
        self.room = float(np.abs(first[:, [0, 1]] - start).max())
        self.reach = max(float(np.ptp(first[:, 2])), self.room / 4) / 2

    def on(self, ax):
        from matplotlib.collections import PolyCollection

        colours = np.array([to_rgba(c) for c in ("0.75", *TRIPODS)])[self.view.groups]
        drawn = ax.add_collection(
            PolyCollection([], lw=1.0)
        )  # sheets are seen by their edges

        def draw(row):
            triangles = self.view.triangles(self.states[row])
            order = np.argsort(
                -triangles[..., 1].mean(1), kind="stable"
            )  # what is farther off first
            drawn.set_verts(triangles[order][..., [0, 2]])
            drawn.set_facecolor(colours[order])
            drawn.set_edgecolor(colours[order])

        return draw


def _rotated(points: np.ndarray, angle: float) -> np.ndarray:
    return points @ np.array(
        [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    )
